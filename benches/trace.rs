//! Rays per second of our traversal on the GPU, of ray query, and of obvhs's own CWBVH traversal on the CPU, over the
//! same triangles and the same rays, all cores each. Incoherent: cosine-distributed directions from random surface
//! points of a displaced sphere within a displaced room. Prints millions of rays per second and the ratios of one run.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec3, Vec3, Vec3A};
use linklight::gpu::shaders::types::{Hit, Ray};
use linklight::gpu::{Buffer, Context, Options};
use linklight::stages::bvh::Bvh;
use linklight::stages::trace::{self, NO_HIT, OpaqueSurfaces, Tracer};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::time::{Duration, Instant};

const RAY_COUNT: usize = 1 << 18;
/// Rounds of the ratio; the fastest of each counts, rounds alternate so that other loads hit all alike.
const ROUNDS: usize = 7;

/// SplitMix64 in [0, 1).
fn unit(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

struct Scene {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Triangles from here on belong to the inner sphere, which is lit from outside.
    inner_first: usize,
}

impl Scene {
    /// About `4 * (a * a + b * b)` triangles.
    fn new(outer_rings: u32, inner_rings: u32) -> Self {
        let mut scene = Self { positions: Vec::new(), triangles: Vec::new(), inner_first: 0 };
        scene.add_sphere(outer_rings, 2.0, 0.15);
        scene.inner_first = scene.triangles.len();
        scene.add_sphere(inner_rings, 1.0, 0.25);
        scene
    }

    fn add_sphere(&mut self, rings: u32, radius: f32, height: f32) {
        let (first, around) = (self.positions.len() as u32, 2 * rings);
        for ring in 0..=rings {
            let (sin, cos) = (std::f32::consts::PI * ring as f32 / rings as f32).sin_cos();
            for k in 0..around {
                let (s, c) = (std::f32::consts::TAU * k as f32 / around as f32).sin_cos();
                let n = Vec3::new(sin * s, cos, sin * c);
                let coarse = (9.0 * n.x).sin() * (11.0 * n.y).sin() * (7.0 * n.z).sin();
                let fine = 0.3 * (40.0 * n.x).sin() * (43.0 * n.y + 31.0 * n.z).sin();
                self.positions.push(radius * (1.0 + height * (coarse + fine)) * n);
            }
        }
        let at = |ring: u32, k: u32| first + ring * around + k % around;
        for ring in 0..rings {
            for k in 0..around {
                let (a, b, c, d) = (at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1));
                self.triangles.extend((ring > 0).then_some([a, c, d]));
                self.triangles.extend((ring + 1 < rings).then_some([a, b, c]));
            }
        }
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    fn rays(&self) -> Vec<Ray> {
        let state = &mut 1;
        let ray = |_| {
            let triangle = (unit(state) * self.triangles.len() as f32) as usize % self.triangles.len();
            let [a, b, c] = self.corners(triangle);
            let (u, v) = (unit(state), unit(state));
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let point = a + u * (b - a) + v * (c - a);
            let normal = (b - a).cross(c - a).normalize();
            let outwards = (normal.dot(point) > 0.0) == (triangle >= self.inner_first);
            let normal = if outwards { normal } else { -normal };
            let on_sphere = loop {
                let p = 2.0 * Vec3::new(unit(state), unit(state), unit(state)) - 1.0;
                if p.length() > 0.01 && p.length() <= 1.0 {
                    break p.normalize();
                }
            };
            let direction = (1.0001 * normal + on_sphere).normalize();
            Ray { origin: point + 1e-4 * normal, t_min: 0.0, direction, t_max: f32::INFINITY }
        };
        (0..RAY_COUNT).map(ray).collect()
    }
}

struct Cpu {
    bvh: CwBvh,
    /// In leaf order.
    triangles: Vec<RtTriangle>,
}

impl Cpu {
    fn new(scene: &Scene) -> Self {
        let corners = |t: usize| scene.corners(t).map(Vec3A::from);
        let triangles: Vec<Triangle> =
            (0..scene.triangles.len()).map(corners).map(|[v0, v1, v2]| Triangle { v0, v1, v2 }).collect();
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        let triangles = bvh.primitive_indices.iter().map(|&t| (&triangles[t as usize]).into()).collect();
        Self { bvh, triangles }
    }

    /// The number of hits.
    fn closest_hit(&self, rays: &[Ray]) -> usize {
        let is_hit = |ray: &Ray| {
            let ray = obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max);
            let mut hit = RayHit::none();
            self.bvh.ray_traverse(ray, &mut hit, |ray, slot| self.triangles[slot].intersect(ray))
        };
        rays.par_chunks(1024).map(|chunk| chunk.iter().filter(|ray| is_hit(ray)).count()).sum()
    }

    fn any_hit(&self, rays: &[Ray]) -> usize {
        let is_hit = |ray: &Ray| {
            let ray = obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max);
            !self.bvh.ray_traverse_miss(ray, |ray, slot| self.triangles[slot].intersect(ray))
        };
        rays.par_chunks(1024).map(|chunk| chunk.iter().filter(|ray| is_hit(ray)).count()).sum()
    }
}

struct Gpu<'a> {
    context: &'a Context,
    rays: Buffer<Ray>,
    hits: Buffer<Hit>,
    visibility: Buffer<u32>,
}

impl Gpu<'_> {
    /// Traces and waits.
    fn trace(&self, tracer: &Tracer<'_>, any: bool) {
        let mut recorder = self.context.recorder("bench").unwrap();
        if any {
            trace::any_hit(&mut recorder, tracer, &self.rays, &self.visibility, RAY_COUNT);
        } else {
            trace::closest_hit(&mut recorder, tracer, &self.rays, &self.hits, RAY_COUNT);
        }
        recorder.submit().unwrap();
    }

    fn hit_count(&self) -> usize {
        self.context.download(&self.hits).unwrap().iter().filter(|hit| hit.triangle != NO_HIT).count()
    }
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn trace_rays(criterion: &mut Criterion) {
    let context = Context::new(Options::default()).unwrap();
    println!("{}", context.info().name);
    for (name, scene) in [("65k", Scene::new(112, 60)), ("1M", Scene::new(440, 240))] {
        let rays = scene.rays();
        let cpu = Cpu::new(&scene);
        let gpu = Gpu {
            context: &context,
            rays: context.upload("bench/rays", &rays).unwrap(),
            hits: context.buffer("bench/hits", RAY_COUNT).unwrap(),
            visibility: context.buffer("bench/visibility", RAY_COUNT).unwrap(),
        };
        let bvh = Bvh::build(&context, &scene.positions, &scene.triangles).unwrap();
        let opaque = OpaqueSurfaces::new(&context).unwrap();
        let compute = Tracer::compute(&bvh, &opaque);
        let positions = context.upload("bench/positions", &scene.positions).unwrap();
        let triangles: Vec<UVec3> = scene.triangles.iter().map(|&t| t.into()).collect();
        let triangles = context.upload("bench/triangles", &triangles).unwrap();
        let structure = context.acceleration_structure("bench/structure", &positions, &triangles).unwrap();
        if let Some(structure) = &structure {
            let mut recorder = context.recorder("bench").unwrap();
            recorder.build_acceleration_structure(structure, &positions, &triangles);
            recorder.submit().unwrap();
        }
        let query = structure.as_ref().map(|structure| Tracer::ray_query(structure, &opaque));

        // The ratios, alternating; the first round of each warms up.
        for any in [false, true] {
            let mut best = [f64::INFINITY; 3];
            for _ in 0..ROUNDS {
                let cpu_seconds = seconds(|| {
                    std::hint::black_box(if any { cpu.any_hit(&rays) } else { cpu.closest_hit(&rays) });
                });
                best[0] = best[0].min(cpu_seconds);
                best[1] = best[1].min(seconds(|| gpu.trace(&compute, any)));
                if let Some(query) = &query {
                    best[2] = best[2].min(seconds(|| gpu.trace(query, any)));
                }
            }
            let [cpu, compute, query] = best.map(|s| RAY_COUNT as f64 / s * 1e-6);
            println!(
                "{} triangles, {} hit: obvhs CWBVH on the CPU {cpu:.2}, compute {compute:.2}, ray query {query:.2} M \
                 rays/s; compute is {:.2} x the CPU, ray query {:.2} x",
                scene.triangles.len(),
                if any { "any" } else { "closest" },
                compute / cpu,
                query / cpu
            );
        }
        gpu.trace(&compute, false);
        let (cpu_hits, gpu_hits) = (cpu.closest_hit(&rays), gpu.hit_count());
        assert!(cpu_hits.abs_diff(gpu_hits) * 1000 < RAY_COUNT, "{cpu_hits} and {gpu_hits} hits are not the same rays");

        let mut group = criterion.benchmark_group("closest_hit");
        group.throughput(Throughput::Elements(RAY_COUNT as u64)).sample_size(10);
        group.bench_function(BenchmarkId::new("obvhs cwbvh", name), |b| b.iter(|| cpu.closest_hit(&rays)));
        group.bench_function(BenchmarkId::new("compute", name), |b| b.iter(|| gpu.trace(&compute, false)));
        if let Some(query) = &query {
            group.bench_function(BenchmarkId::new("ray query", name), |b| b.iter(|| gpu.trace(query, false)));
        }
        group.bench_function(BenchmarkId::new("refit", name), |b| {
            b.iter(|| {
                let mut recorder = context.recorder("bench").unwrap();
                bvh.refit(&mut recorder, &positions).unwrap();
                recorder.submit().unwrap();
            })
        });
        group.bench_function(BenchmarkId::new("build", name), |b| {
            b.iter(|| Bvh::build(&context, &scene.positions, &scene.triangles).unwrap())
        });
        group.finish();
    }
}

criterion_group!(benches, trace_rays);
criterion_main!(benches);
