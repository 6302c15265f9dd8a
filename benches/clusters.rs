//! Face-cluster radiosity in figures, as ratios of one run: clustering by size against N log N; solving one gallery at
//! growing triangle counts, all sizes in turn in every round; showing its solution against rasterising the same mesh.
//! Fastest of the rounds.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec2, Vec3};
use linklight::display::direct::{Canvas, Lighting};
use linklight::display::g_buffer::GBuffer;
use linklight::display::irradiance_vector;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::gpu::{Context, Options};
use linklight::methods::face_cluster::{FaceClusters, Report, Settings, Stage};
use linklight::scene::camera::View;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{self, LoadOptions, Scene, deform};
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::trace::Tracer;
use linklight::stages::work::Unwatched;
use linklight::stages::world::World;
use std::time::Duration;

/// Of solving, after one that is the driver's, to compile, and the pool's, to grow.
const ROUNDS: usize = 5;
const BOUNCES: u32 = 4;
const MEMORY: u64 = 12 << 30;
const SIZE: UVec2 = UVec2::new(480, 300);
/// Triangles asked of the gallery: the paper's range, and beyond it.
const TRIANGLES: [u32; 6] = [160_000, 400_000, 800_000, 1_500_000, 2_500_000, 5_000_000];
/// Those of the paper.
const PAPERS: usize = 4;

fn gallery(triangles: u32) -> Scene {
    let options = LoadOptions { max_memory_bytes: MEMORY, ..LoadOptions::default() };
    scene::open(&format!("builtin:gallery?triangles={triangles}"), &options).unwrap()
}

/// Milliseconds of the passes of a picture: those that rasterise, and all.
#[derive(Debug, Clone, Copy)]
struct Shown {
    raster: f64,
    all: f64,
}

/// One size of the gallery on the device, clustered, and what it costs.
struct Row {
    scene: Scene,
    geometry: Geometry,
    pose: Pose,
    positions: Vec<Vec3>,
    bounds: [Vec3; 2],
    world: World,
    bvh: Bvh,
    method: FaceClusters,
    film: Film,
    g_buffer: GBuffer,
    shadow_maps: ShadowMaps,
    view: View,
    /// Seconds, and those of all processors where the system tells.
    solve: [f64; 2],
    shown: Shown,
}

/// Of what the solve read and the display shows.
fn stage<'a>(
    (scene, geometry, pose): (&'a Scene, &'a Geometry, &'a Pose),
    (positions, bounds): (&'a [Vec3], [Vec3; 2]),
    (world, bvh, environment): (&'a World, &'a Bvh, &'a Environment),
) -> Stage<'a> {
    Stage {
        scene,
        geometry,
        rest_positions: positions,
        pose,
        bounds,
        environment,
        world,
        bvh,
        cluster_cache: None,
        watch: &Unwatched,
    }
}

/// All that processors have spent on this process, the device's threads among them where the device is the processor.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // User and system time are the twelfth and thirteenth after the name, in hundredths.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    fields.filter_map(|field| field.parse::<f64>().ok()).sum::<f64>() / 100.0
}

impl Row {
    /// Or why the device cannot hold so many.
    fn new(context: &Context, triangles: u32) -> Result<Self, String> {
        let scene = gallery(triangles);
        let pose = Pose::rest(&scene);
        let geometry = Geometry::flatten(&scene, MEMORY).unwrap();
        let vertices = deform::world_vertices(&geometry, &pose);
        let (bounds, positions) = (vertices.bounds().unwrap(), vertices.positions);
        let environment = Environment::default();
        let refused = |error: &dyn std::fmt::Display| format!("{}: {error}", geometry.triangle_count());
        let world = World::new(context, &scene, &geometry, &pose, &environment, false).map_err(|e| refused(&e))?;
        let bvh = Bvh::build(context, &positions, &geometry.triangles).map_err(|e| refused(&e))?;
        let stage = stage((&scene, &geometry, &pose), (&positions, bounds), (&world, &bvh, &environment));
        // As many bounces of all sizes, whatever each leaves unshot.
        let settings = Settings { convergence: 0.0, ..Settings::default() };
        let method = FaceClusters::prepare(context, &stage, settings).unwrap();
        let view = View::of_scene(&scene, &pose, None, Some(bounds), SIZE).unwrap();
        let film = Film::new(context, SIZE.x, SIZE.y).unwrap();
        let g_buffer = GBuffer::new(context, SIZE.x, SIZE.y).unwrap();
        let shadow_maps = ShadowMaps::new(context, &pose, SIZE.to_array()).unwrap();
        let (solve, shown) = ([f64::INFINITY; 2], Shown { raster: f64::INFINITY, all: f64::INFINITY });
        Ok(Self {
            scene,
            geometry,
            pose,
            positions,
            bounds,
            world,
            bvh,
            method,
            film,
            g_buffer,
            shadow_maps,
            view,
            solve,
            shown,
        })
    }

    /// Solves and shows once more; what costs less than before is kept.
    fn round(&mut self, context: &Context, is_counted: bool) {
        let environment = Environment::default();
        let stage = stage(
            (&self.scene, &self.geometry, &self.pose),
            (&self.positions, self.bounds),
            (&self.world, &self.bvh, &environment),
        );
        let before = processor_seconds();
        self.method.solve(context, &stage, BOUNCES).unwrap();
        let spent = processor_seconds() - before;
        let solution = self.method.keep(context).unwrap();
        context.take_records();
        let mut recorder = context.recorder("frame").unwrap();
        let light = self.method.light(&solution);
        let (world, shadow_maps, g_buffer) = (&self.world, &self.shadow_maps, &self.g_buffer);
        let tracer = Tracer::compute(&self.bvh, world);
        let lighting = Lighting { world, shadow_maps, tracer, g_buffer };
        let canvas = Canvas { lighting, view: &self.view, samples: 1, film: &self.film };
        irradiance_vector::draw(&mut recorder, light, canvas);
        recorder.submit().unwrap();
        if !is_counted {
            return;
        }
        let records = context.take_records();
        let ms = |is_own: &dyn Fn(&str) -> bool| -> f64 {
            let own = records.iter().filter(|record| is_own(record.name));
            own.map(|record| (record.end_ns - record.start_ns) as f64 * 1e-6).sum()
        };
        self.solve = [self.solve[0].min(self.method.report().solve_seconds), self.solve[1].min(spent)];
        let now = Shown { raster: ms(&|name| name.ends_with("visible_triangles")), all: ms(&|_| true) };
        if now.all < self.shown.all {
            self.shown = now;
        }
    }

    fn report(&self) -> &Report {
        self.method.report()
    }
}

/// All these sizes in turn, so that a machine that is slower for a while is so for all of them.
fn rows(context: &Context, sizes: &[u32]) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for &triangles in sizes {
        match Row::new(context, triangles) {
            Ok(row) => rows.push(row),
            Err(refusal) => println!("refused: {refusal}"),
        }
    }
    for round in 0..=ROUNDS {
        rows.iter_mut().for_each(|row| row.round(context, round > 0));
    }
    rows
}

fn by_size(_: &mut Criterion) {
    let context = Context::new(Options::default()).expect("the benchmark needs a Vulkan device");
    println!("device {}", context.info().name);
    println!(
        "triangles  clustering s (M/s)   bytes/cluster  bytes/N  depth | solve s  of processors  leaves  transfers  solution MB | raster ms  picture ms"
    );
    let measured =
        |rows: &[Row]| rows.iter().map(|row| (row.report().clone(), row.solve, row.shown)).collect::<Vec<_>>();
    let mut all = measured(&rows(&context, &TRIANGLES[..PAPERS]));
    assert!(all.len() == PAPERS, "the device holds the paper's range");
    for triangles in &TRIANGLES[PAPERS..] {
        all.extend(measured(&rows(&context, &[*triangles])));
    }
    for (r, [solve, spent], shown) in &all {
        let n = f64::from(r.triangles);
        // Triangles of three indices, and half as many vertices of three coordinates.
        let model = r.cluster_bytes as f64 / n + 12.0 + 6.0;
        println!(
            "{:9}  {:8.2} ({:.3})  {:13.1}  {model:7.1}  {:5} | {solve:7.2}  {spent:13.2}  {:6}  {:9}  {:11.2} | {:9.1}  {:10.1}",
            r.triangles,
            r.clustering_seconds,
            1e-6 * n / r.clustering_seconds,
            r.cluster_bytes as f64 / r.clusters as f64,
            r.tree_depth,
            r.leaves,
            r.transfers(),
            1e-6 * r.solution_bytes as f64,
            shown.raster,
            shown.all
        );
    }
    type Measured = (Report, [f64; 2], Shown);
    let spread = |of: &dyn Fn(&Measured) -> f64| {
        let values: Vec<f64> = all[..PAPERS].iter().map(of).collect();
        values.iter().copied().fold(0.0, f64::max) / values.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let per_n_log_n = |(report, ..): &Measured| {
        let n = f64::from(report.triangles);
        report.clustering_seconds / (n * n.log2())
    };
    println!(
        "largest/smallest of the paper's range: solve {:.3} (goal 1.12), of processors {:.3}, leaves {:.3}, clustering per N log N {:.3}",
        spread(&|(_, solve, _)| solve[0]),
        spread(&|(_, solve, _)| solve[1]),
        spread(&|(report, ..)| f64::from(report.leaves)),
        spread(&per_n_log_n)
    );
    for (report, [solve, _], shown) in &all[PAPERS - 1..] {
        let (triangles, ratio) = (report.triangles, shown.all / shown.raster);
        println!(
            "{triangles} triangles: solve {:.2} of the smallest's, picture / rasterising {ratio:.2}",
            solve / all[0].1[0]
        );
    }
}

/// A wavy sheet of so many triangles: clustering alone.
fn clustering(c: &mut Criterion) {
    use linklight::stages::clusters::{ClusterTree, MeshFaces};
    let mut group = c.benchmark_group("clustering");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(5));
    for side in [64u32, 128, 256] {
        let at = |i: u32| i as f32 / side as f32;
        let positions: Vec<Vec3> = (0..(side + 1) * (side + 1))
            .map(|k| (at(k % (side + 1)), at(k / (side + 1))))
            .map(|(x, y)| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()))
            .collect();
        let corner = |k: u32| k / side * (side + 1) + k % side;
        let triangles: Vec<[u32; 3]> = (0..side * side)
            .map(corner)
            .flat_map(|a| [[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]])
            .collect();
        let (gray, dark) = (vec![Vec3::splat(0.5); triangles.len()], vec![Vec3::ZERO; triangles.len()]);
        let mesh = MeshFaces {
            positions: &positions,
            triangles: &triangles,
            albedo: &gray,
            reflectance: &gray,
            emission: &dark,
        };
        group.throughput(Throughput::Elements(triangles.len() as u64));
        group.bench_function(BenchmarkId::new("faces", triangles.len()), |b| b.iter(|| ClusterTree::build(&mesh)));
    }
    group.finish();
}

criterion_group!(benches, clustering, by_size);
criterion_main!(benches);
