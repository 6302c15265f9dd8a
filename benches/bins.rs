//! Implicit visibility in figures, as ratios of one run: the stages of a frame by bins, as in the paper's Table 1; growth
//! with the scene; bins gathered per second against a plain Rust loop; memory. Fastest of several rounds.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use linklight::gpu::{Context, Options, PassRecord};
use linklight::methods::explicit_visibility::Stage;
use linklight::methods::implicit_visibility::{ImplicitVisibility, Settings, bins};
use linklight::scene::builtin::{self, Source};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::load_bytes;
use linklight::scene::pose::Pose;
use linklight::scene::tessellate::{Fineness, tessellate};
use linklight::stages::bvh::Bvh;
use linklight::stages::trace::Tracer;
use linklight::stages::work::Unwatched;
use linklight::stages::world::World;
use rayon::prelude::*;
use std::time::{Duration, Instant};

const ROUNDS: usize = 3;
const MEMORY: u64 = 4 << 30;

/// Device milliseconds of a frame by stage.
#[derive(Debug, Clone, Copy)]
struct Frame {
    update: f64,
    create: f64,
    refine_and_push: f64,
    illumination: f64,
    /// Of the last, gathers of a bounce alone.
    gather: f64,
}

impl Frame {
    fn of(records: &[PassRecord]) -> Self {
        let sum = |is_own: &dyn Fn(&PassRecord) -> bool| -> f64 {
            let own = records.iter().filter(|record| is_own(record));
            own.map(|record| (record.end_ns - record.start_ns) as f64 * 1e-6).sum()
        };
        let under = |part: &'static str| move |record: &PassRecord| record.path.contains(part);
        let (update, create) = (sum(&under("update elements")), sum(&under("create links")));
        let refine_and_push = sum(&under("refine and push"));
        Self {
            update,
            create,
            refine_and_push,
            illumination: sum(&|_| true) - update - create - refine_and_push,
            gather: sum(&|record| record.name.ends_with("implicit_visibility/gather")),
        }
    }

    fn total(&self) -> f64 {
        self.update + self.create + self.refine_and_push + self.illumination
    }
}

/// Whole frames with one bounce of a built-in scene; the fastest of all rounds, and the method as it stands.
fn frames(
    context: &Context,
    name: &str,
    elements: u32,
    settings: Settings,
    rounds: usize,
) -> (Frame, ImplicitVisibility) {
    let bytes = match builtin::resolve(name) {
        Ok(Source::File(bytes)) => bytes,
        other => panic!("{name}: {other:?}"),
    };
    let scene = load_bytes(name, bytes).unwrap();
    let rest = Pose::rest(&scene);
    let geometry = Geometry::flatten(&scene, MEMORY).unwrap();
    let cut = tessellate(geometry, &rest, Fineness::Elements(elements), MEMORY).unwrap();
    let environment = Environment::default();
    let world = World::new(context, &scene, &cut.geometry, &rest, &environment, true).unwrap();
    let positions = context.download(&world.positions).unwrap();
    let bvh = Bvh::build(context, &positions, &cut.geometry.triangles).unwrap();
    let stage = Stage {
        scene: &scene,
        geometry: &cut.geometry,
        rest_positions: &cut.rest_positions,
        environment: &environment,
        world: &world,
        tracer: Tracer::compute(&bvh, &world),
        watch: &Unwatched,
    };
    let mut method = ImplicitVisibility::prepare(context, &stage, settings).unwrap();
    let mut fastest: Option<Frame> = None;
    // The first frame holds the driver's compile time.
    for round in 0..=rounds {
        context.take_records();
        method.link(context, &stage).unwrap();
        let mut recorder = context.recorder("frame").unwrap();
        method.solve(&mut recorder, &world, 1);
        recorder.submit().unwrap();
        let frame = Frame::of(&context.take_records());
        if round > 0 && fastest.is_none_or(|fastest| frame.total() < fastest.total()) {
            fastest = Some(frame);
        }
    }
    (fastest.unwrap(), method)
}

/// The paper's Table 1, an NVIDIA card of 2007: milliseconds by stage.
const PAPER: [(u32, [f64; 4]); 3] =
    [(8, [12.0, 23.0, 30.0, 35.0]), (12, [12.0, 43.0, 35.0, 40.0]), (16, [12.0, 78.0, 60.0, 48.0])];

fn stages(_: &mut Criterion) {
    let context = Context::new(Options::default()).unwrap();
    for (bins, paper) in PAPER {
        let (frame, method) = frames(&context, "cornell-box", 3_400, Settings { bins, ..Settings::default() }, ROUNDS);
        let share = |ms: f64| format!("{ms:.1} ms ({:.0} %)", 100.0 * ms / frame.total());
        let report = method.report();
        let rate = |count: u64| count as f64 / frame.create * 1e-3;
        println!(
            "{} elements, N = {bins}: update {}, create {}, refine and push {}, illumination {}, total {:.1} ms; paper \
             {paper:?}, {:.0} ms; {:.2} M pairs/s, {:.2} M links proposed/s, {:.2} M kept/s",
            report.elements,
            share(frame.update),
            share(frame.create),
            share(frame.refine_and_push),
            share(frame.illumination),
            frame.total(),
            paper.iter().sum::<f64>(),
            rate(report.pairs_visited),
            rate(report.links_proposed),
            rate(report.links_kept),
        );
    }
}

/// Whole frames from 3,000 to 100,000 elements: the exponent of N log N that fits, and memory.
fn growth(_: &mut Criterion) {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (elements, rounds) in [(3_000, ROUNDS), (10_000, ROUNDS), (30_000, 2), (100_000, 1)] {
        let context = Context::new(Options::default()).unwrap();
        let (frame, method) =
            frames(&context, "cornell-box", elements, Settings { bins: 8, ..Settings::default() }, rounds);
        let report = method.report();
        let count = f64::from(report.elements);
        let memory = context.memory_by_owner();
        let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let peak = mebibytes(memory.values().map(|use_of| use_of.peak_bytes).sum());
        println!(
            "{count} elements, N = 8: {:.0} ms, {:.1} M pairs, {:.1} M links; at most {:.0} MiB, of these winners {:.0} ({:.2} \
             bytes per element and bin), keys {:.0}",
            frame.total(),
            report.pairs_visited as f64 * 1e-6,
            report.links_proposed as f64 * 1e-6,
            peak,
            mebibytes(report.winner_bytes),
            report.winner_bytes as f64 / (count * f64::from(report.bins)),
            mebibytes(method.linking().keys.size_bytes()),
        );
        assert!(peak < 2048.0, "{count} elements take {peak:.0} MiB, more than 2 GiB");
        points.push(((count * count.log2()).ln(), frame.total().ln()));
    }
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
    println!("frame time grows with (N log N) to the power {slope:.2}");
    assert!(slope < 1.15, "time grows faster than O(N log N)");
}

fn gather(criterion: &mut Criterion) {
    let context = Context::new(Options::default()).unwrap();
    let mut group = criterion.benchmark_group("gather bins");
    group.sample_size(10).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    let settings = Settings::default();
    let (frame, method) = frames(&context, "cornell-box", 8_000, settings, ROUNDS);
    let window = &method.linking().windows[0];
    let (winners, count) = (context.download(&window.winners).unwrap(), window.plan.leaves().len());
    let rows: Vec<Vec<u32>> =
        (0..count).map(|leaf| winners.iter().skip(leaf).step_by(count).copied().collect()).collect();
    let receivers = context.download(&method.linking().receivers).unwrap();
    let radiosity = vec![Vec3::ONE; method.trees().topology.node_count() as usize];
    let vectors = bins::vectors(settings.bins);
    let bin_count = rows.len() as f64 * f64::from(settings.bin_count());
    let plain = || {
        let of_row = |(row, receiver): (&Vec<u32>, &linklight::gpu::shaders::types::Receiver)| {
            let (mut sum, mut total) = (Vec3::ZERO, 0.0);
            for (&winner, vector) in row.iter().zip(&vectors) {
                let weight = vector.dot(receiver.normal);
                if weight > 0.0 {
                    total += weight;
                    if winner < 1 << 31 {
                        sum += weight * radiosity[winner as usize];
                    }
                }
            }
            sum / total
        };
        let irradiance: Vec<Vec3> = rows.par_iter().zip(&receivers[..count]).with_min_len(64).map(of_row).collect();
        std::hint::black_box(irradiance)
    };
    let start = Instant::now();
    for _ in 0..5 {
        plain();
    }
    let plain_ms = 200.0 * start.elapsed().as_secs_f64();
    println!(
        "gather: {:.0} M bins/s on the device, {:.0} M bins/s in a plain loop",
        bin_count / frame.gather * 1e-3,
        bin_count / plain_ms * 1e-3
    );
    group.throughput(Throughput::Elements(bin_count as u64));
    group.bench_function(BenchmarkId::new("plain loop", count), |bencher| bencher.iter(plain));
    group.finish();
}

criterion_group!(benches, stages, growth, gather);
criterion_main!(benches);
