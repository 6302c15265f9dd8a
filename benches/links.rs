//! Explicit visibility in figures, as ratios of one run: links gathered per second against a plain Rust loop over the
//! same rows on the same threads; making links against sending light along them; growth with the scene; memory.
//! Fastest of several rounds, which alternate so that other loads hit all alike.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use linklight::gpu::{Buffer, Context, Options, PassRecord};
use linklight::methods::explicit_visibility::{ExplicitVisibility, RayCount, Settings, Stage};
use linklight::scene::builtin::{self, Source};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::tessellate::{Fineness, Tessellation, tessellate};
use linklight::scene::{Scene, load_bytes};
use linklight::stages::bvh::Bvh;
use linklight::stages::gather;
use linklight::stages::links::Link;
use linklight::stages::trace::Tracer;
use linklight::stages::work::Unwatched;
use linklight::stages::world::World;
use rayon::prelude::*;
use std::time::{Duration, Instant};

const ROUNDS: usize = 15;
const MEMORY: u64 = 4 << 30;

/// A built-in scene cut to about so many elements, on the device.
struct Prepared {
    scene: Scene,
    cut: Tessellation,
    world: World,
    bvh: Bvh,
}

impl Prepared {
    fn new(context: &Context, name: &str, elements: u32) -> Self {
        let bytes = match builtin::resolve(name) {
            Ok(Source::File(bytes)) => bytes,
            other => panic!("{name}: {other:?}"),
        };
        let scene = load_bytes(name, bytes).unwrap();
        let rest = Pose::rest(&scene);
        let geometry = Geometry::flatten(&scene, MEMORY).unwrap();
        let cut = tessellate(geometry, &rest, Fineness::Elements(elements), MEMORY).unwrap();
        let world = World::new(context, &scene, &cut.geometry, &rest, &Environment::default(), true).unwrap();
        let positions = context.download(&world.positions).unwrap();
        let bvh = Bvh::build(context, &positions, &cut.geometry.triangles).unwrap();
        Self { scene, cut, world, bvh }
    }

    fn method(&self, context: &Context, settings: Settings) -> ExplicitVisibility {
        let stage = Stage {
            scene: &self.scene,
            geometry: &self.cut.geometry,
            rest_positions: &self.cut.rest_positions,
            environment: &Environment::default(),
            world: &self.world,
            tracer: Tracer::compute(&self.bvh, &self.world),
            watch: &Unwatched,
        };
        ExplicitVisibility::prepare(context, &stage, settings).unwrap()
    }
}

/// Milliseconds on the device of all passes whose path ends so.
fn device_ms(records: &[PassRecord], name: &str) -> f64 {
    let own = records.iter().filter(|record| record.name == name);
    own.map(|record| (record.end_ns - record.start_ns) as f64 * 1e-6).sum()
}

/// One gather along all links, milliseconds on the device.
fn gather_ms(
    context: &Context,
    method: &ExplicitVisibility,
    radiosity: &Buffer<Vec3>,
    irradiance: &Buffer<Vec3>,
) -> f64 {
    context.take_records();
    let mut recorder = context.recorder("bench").unwrap();
    gather::over_links(&mut recorder, method.links(), radiosity, irradiance);
    recorder.submit().unwrap();
    context.take_records().iter().map(|record| (record.end_ns - record.start_ns) as f64 * 1e-6).sum()
}

/// The same by a plain loop, milliseconds.
fn plain_ms(offsets: &[u32], links: &[Link], radiosity: &[Vec3]) -> f64 {
    let start = Instant::now();
    let rows = offsets.par_windows(2).with_min_len(128).map(|row| {
        let mut sum = Vec3::ZERO;
        for link in &links[row[0] as usize..row[1] as usize] {
            sum += link.weight * radiosity[link.sender as usize];
        }
        sum
    });
    let irradiance: Vec<Vec3> = rows.collect();
    std::hint::black_box(irradiance);
    1e3 * start.elapsed().as_secs_f64()
}

fn gather_links(criterion: &mut Criterion) {
    let context = Context::new(Options::default()).unwrap();
    let mut group = criterion.benchmark_group("gather");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(1));
    for (name, elements) in [("cornell-box", 2_000), ("cornell-box", 12_000), ("tea-room", 15_000)] {
        let prepared = Prepared::new(&context, name, elements);
        for packed_links in [false, true] {
            let method = prepared.method(&context, Settings { packed_links, ..Settings::default() });
            let report = method.report();
            let offsets = context.download(&method.links().offsets).unwrap();
            let links = method.links().download(&context).unwrap();
            let sent: Vec<Vec3> = (0..report.elements).map(|e| Vec3::new(1.0, e as f32 * 1e-4, 0.25)).collect();
            let radiosity = context.upload("bench/radiosity", &sent).unwrap();
            let irradiance = context.buffer::<Vec3>("bench/irradiance", sent.len()).unwrap();
            let device = || gather_ms(&context, &method, &radiosity, &irradiance);
            let (mut on_device, mut plain) = (f64::MAX, f64::MAX);
            for _ in 0..ROUNDS {
                on_device = on_device.min(device());
                plain = plain.min(plain_ms(&offsets, &links, &sent));
            }
            let rate = |ms: f64| links.len() as f64 / ms / 1e3;
            println!(
                "gather, {name}, {} elements, {} links{}: {:.0} M links/s, plain Rust {:.0}, ratio {:.2}",
                report.elements,
                links.len(),
                if packed_links { ", packed" } else { "" },
                rate(on_device),
                rate(plain),
                plain / on_device
            );

            let kind = if packed_links { "packed" } else { "full" };
            group.throughput(Throughput::Elements(links.len() as u64));
            let id = |what: &str| BenchmarkId::new(format!("{what} {kind}"), format!("{name} {}", report.elements));
            group.bench_function(id("device"), |bencher| {
                bencher.iter_custom(|n| Duration::from_secs_f64((0..n).map(|_| device()).sum::<f64>() * 1e-3));
            });
            group.bench_function(id("plain"), |bencher| {
                bencher.iter_custom(|n| {
                    let ms: f64 = (0..n).map(|_| plain_ms(&offsets, &links, &sent)).sum();
                    Duration::from_secs_f64(ms * 1e-3)
                });
            });
        }
    }
    group.finish();
}

/// Generation and one bounce of exchange, milliseconds, with a line of figures.
fn generate(context: &Context, prepared: &Prepared, what: &str, settings: Settings) -> (f64, f64) {
    context.take_records();
    let method = prepared.method(context, settings);
    let records = context.take_records();
    let ms = |name: &str| device_ms(&records, name);
    let rays = ms("methods/explicit_visibility/rays") + ms("trace/closest_hit");
    let merge = ms("links/merge_hits") + ms("scan/scan_blocks") + ms("scan/add_block_sums");
    let write = ms("links/write_rows") + ms("links/write_packed_rows");

    let report = method.report();
    let radiosity = context.upload("bench/radiosity", &vec![Vec3::ONE; report.elements as usize]).unwrap();
    let irradiance = context.buffer::<Vec3>("bench/irradiance", radiosity.len()).unwrap();
    let exchanges = (0..ROUNDS).map(|_| gather_ms(context, &method, &radiosity, &irradiance));
    let exchange = exchanges.fold(f64::MAX, f64::min);
    let generation = rays + merge + write;
    println!(
        "{what}: {} elements, {:.1} M rays, {:.2} M links, compression {:.2}; generation {generation:.0} ms (rays {rays:.0}, \
         merging {merge:.0}, writing {write:.0}), one bounce {exchange:.2} ms, 1/{:.0} of it",
        report.elements,
        report.rays as f64 * 1e-6,
        f64::from(report.links) * 1e-6,
        report.compression,
        generation / exchange
    );
    (generation, exchange)
}

fn generate_links(_: &mut Criterion) {
    let context = Context::new(Options::default()).unwrap();
    let tea_room = Prepared::new(&context, "tea-room", 15_000);
    for rays in [64, 256, 1024] {
        let rays_per_element = RayCount::new(rays).unwrap();
        let what = format!("generation, tea-room, {rays} rays");
        generate(&context, &tea_room, &what, Settings { rays_per_element, ..Settings::default() });
    }
    drop(tea_room);

    // The paper: generation grows as n log n, exchange linearly in links.
    let mut before: Option<(f64, f64)> = None;
    for elements in [3_000, 6_000, 12_000, 24_000] {
        let prepared = Prepared::new(&context, "cornell-box", elements);
        let (generation, _) = generate(&context, &prepared, "growth, cornell-box", Settings::default());
        let n = f64::from(prepared.cut.geometry.vertex_count());
        if let Some((n_before, generation_before)) = before {
            println!(
                "  elements x {:.2}, generation x {:.2}; n log n would be x {:.2}",
                n / n_before,
                generation / generation_before,
                n * n.ln() / (n_before * n_before.ln())
            );
        }
        before = Some((n, generation));
    }
    for (owner, memory) in context.memory_by_owner() {
        println!("peak memory of {owner}: {:.1} MiB", memory.peak_bytes as f64 / f64::from(1 << 20));
    }
}

criterion_group!(benches, gather_links, generate_links);
criterion_main!(benches);
