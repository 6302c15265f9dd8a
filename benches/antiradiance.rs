//! Antiradiance in figures, as ratios of one run: times and memory beside the paper's office row, the global pass
//! against a plain Rust loop over the same transfers, links made per second, growth with elements; and the convergence of
//! both schemes (the paper's Fig. 5), written to `target/antiradiance-convergence.csv`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use linklight::gpu::{Context, Options, PassRecord};
use linklight::methods::antiradiance::{Antiradiance, BinCount, Scheme, Settings};
use linklight::methods::explicit_visibility::Stage;
use linklight::scene::builtin::{self, Source};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::tessellate::{Fineness, Tessellation, tessellate};
use linklight::scene::{Scene, load_bytes};
use linklight::stages::bvh::Bvh;
use linklight::stages::emitters::EmitterChoice;
use linklight::stages::trace::Tracer;
use linklight::stages::work::Unwatched;
use linklight::stages::world::World;
use rayon::prelude::*;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

const ROUNDS: usize = 8;
/// Of making links, which takes seconds.
const LINK_ROUNDS: usize = 3;
const MEMORY: u64 = 4 << 30;
/// Steps of the convergence curves.
const CURVE_STEPS: u32 = 300;

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

    fn stage(&self) -> Stage<'_> {
        Stage {
            scene: &self.scene,
            geometry: &self.cut.geometry,
            rest_positions: &self.cut.rest_positions,
            environment: &Environment::Constant(Vec3::ZERO),
            world: &self.world,
            tracer: Tracer::compute(&self.bvh, &self.world),
            watch: &Unwatched,
        }
    }
}

/// As the paper's tables: 128 bins, four steps of the symmetric scheme, f16, direct light without antiradiance.
fn paper_settings(refinement: f32) -> Settings {
    Settings {
        bins: BinCount::new(128).unwrap(),
        scheme: Scheme::Symmetric,
        iterations: 4,
        emitters: EmitterChoice::Sampled,
        refinement,
        ..Settings::default()
    }
}

/// Milliseconds on the device of all passes of that name.
fn device_ms(records: &[PassRecord], names: &[&str]) -> f64 {
    let own = records.iter().filter(|record| names.iter().any(|name| record.name.ends_with(name)));
    // From zero: the sum of nothing is -0.
    own.fold(0.0, |sum, record| sum + (record.end_ns - record.start_ns) as f64 * 1e-6)
}

const LOCAL_PASSES: [&str; 4] = ["/local_irradiance", "/local_reflect", "/local_exitant", "/local_residual"];

/// What finds the pairs of nodes that are links.
const PAIR_PASSES: [&str; 4] = ["count_groups", "choose", "take", "refine_links"];

const LINK_PASSES: [&str; 18] = [
    "pack_nodes",
    "count_groups",
    "choose",
    "take",
    "refine_links",
    "even_light",
    "even_scales",
    "count_transfers",
    "count_cells",
    "list_cells",
    "measure_slices",
    "scan_blocks",
    "add_block_sums",
    "place_cells",
    "place_transfers",
    "fill_transfers",
    "sort_transfers",
    "cosine_norms",
];

/// Milliseconds of moving on with new links.
struct LinkTimes {
    /// Fastest of several rounds.
    all: f64,
    /// Of that round, what finds the links.
    pairs: f64,
    /// Of that round, the longest passes, as text.
    longest: String,
    /// Fastest of several rounds with new form factors alone.
    factors: f64,
}

fn link_ms(context: &Context, method: &mut Antiradiance, prepared: &Prepared) -> LinkTimes {
    let mut times = LinkTimes { all: f64::MAX, pairs: 0.0, longest: String::new(), factors: f64::MAX };
    for _ in 0..LINK_ROUNDS {
        for standing in [false, true] {
            context.take_records();
            method.follow(context, &prepared.stage(), standing).unwrap();
            let records = context.take_records();
            let ms = device_ms(&records, &LINK_PASSES);
            if standing {
                times.factors = times.factors.min(ms);
            } else if ms < times.all {
                let mut shares = LINK_PASSES.map(|pass| (pass, device_ms(&records, &[pass])));
                shares.sort_by(|a, b| b.1.total_cmp(&a.1));
                let longest = shares.iter().take(6).map(|(pass, ms)| format!("{pass} {ms:.0}"));
                times.longest = longest.collect::<Vec<_>>().join(", ");
                (times.all, times.pairs) = (ms, device_ms(&records, &PAIR_PASSES));
            }
        }
    }
    times
}

/// One global pass on the device, and by a plain loop on as many threads; milliseconds, fastest of rounds that alternate.
fn gather_ms(context: &Context, method: &Antiradiance) -> (f64, f64) {
    let tables = method.tables();
    let bins = tables.bin_count as usize;
    let nodes = method.hierarchy().node_count() as usize;
    // Bin by bin, as on the device: what a bin's transfers read fits into a cache.
    let by_bin = |entry: u32| entry % bins as u32 * nodes as u32 + entry / bins as u32;
    let mut all = method.transfers().download(context).unwrap();
    all.iter_mut().for_each(|(cell, entry, _)| (*cell, *entry) = (by_bin(*cell), by_bin(*entry)));
    all.sort_unstable_by_key(|&(cell, entry, _)| (cell, entry));
    let mut offsets = vec![0u32; nodes * bins + 1];
    all.iter().for_each(|transfer| offsets[transfer.0 as usize + 1] += 1);
    for cell in 1..offsets.len() {
        offsets[cell] += offsets[cell - 1];
    }
    let plain: Vec<(u32, f32)> = all.iter().map(|&(_, entry, weight)| (entry, weight)).collect();
    let exitant: Vec<Vec3> = (0..nodes * bins).map(|k| Vec3::new(1.0, k as f32 * 1e-6, 0.25)).collect();

    let mut fastest = (f64::MAX, f64::MAX);
    for _ in 0..ROUNDS {
        fastest.0 = fastest.0.min(device_gather_ms(context, method));

        let start = Instant::now();
        let cells = offsets.par_windows(2).with_min_len(4096).map(|cell| {
            let mut sum = Vec3::ZERO;
            for &(entry, weight) in &plain[cell[0] as usize..cell[1] as usize] {
                sum += weight * exitant[entry as usize];
            }
            sum
        });
        let incident: Vec<Vec3> = cells.collect();
        std::hint::black_box(incident);
        fastest.1 = fastest.1.min(1e3 * start.elapsed().as_secs_f64());
    }
    fastest
}

fn device_gather_ms(context: &Context, method: &Antiradiance) -> f64 {
    let tables = method.tables();
    context.take_records();
    let mut recorder = context.recorder("bench").unwrap();
    method.transfers().gather(&mut recorder, tables);
    recorder.submit().unwrap();
    device_ms(&context.take_records(), &["gather", "fill"])
}

fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

fn office(criterion: &mut Criterion) {
    let context = Context::new(Options::default()).unwrap();
    let prepared = Prepared::new(&context, "office", 13_000);
    // So coarse that links are as many as the paper's.
    let mut method = Antiradiance::prepare(&context, &prepared.stage(), paper_settings(12.0)).unwrap();
    let report = method.report().clone();
    println!("office: {report}");
    println!("  paper: 18 253 elements, 632 098 links, 128 bins, four steps, GeForce 8800 GTX");

    let [mut local, mut glossy, mut global, mut push_pull] = [f64::MAX; 4];
    for _ in 0..ROUNDS {
        context.take_records();
        method.solve(&context, &prepared.world, 4, &Unwatched).unwrap();
        let records = context.take_records();
        local = local.min(device_ms(&records, &LOCAL_PASSES));
        glossy = glossy.min(device_ms(&records, &["/arrive_glossy", "/reflect_glossy"]));
        global = global.min(device_ms(&records, &["/gather"]));
        push_pull = push_pull.min(device_ms(&records, &["/push", "/pull"]));
    }
    let times = link_ms(&context, &mut method, &prepared);
    println!(
        "  local {:.1} ms, {glossy:.1} of them for lobes (paper 7.1), global {global:.1} ms (63.4), push and pull {push_pull:.1} ms (14.0)",
        local + glossy
    );
    println!(
        "  new links {:.0} ms (8 700 on the CPU), form factors over standing links {:.0} ms",
        times.all, times.factors
    );
    println!("  of new links: {}", times.longest);
    println!(
        "  tables {:.1} MiB (71.3 MB), links {:.1} MiB (29.5 MB)",
        mib(report.table_bytes),
        mib(report.link_bytes)
    );
    let links_per_second = |ms: f64| report.links as f64 / ms / 1e3;
    println!(
        "  links made: {:.1} M/s with all they transfer, {:.1} M/s as pairs of nodes alone",
        links_per_second(times.all),
        links_per_second(times.pairs)
    );

    let (device, plain) = gather_ms(&context, &method);
    let rate = |ms: f64| f64::from(report.transfers) / ms / 1e3;
    println!(
        "  global pass: {:.0} M transfers/s, plain Rust {:.0}, ratio {:.2}",
        rate(device),
        rate(plain),
        plain / device
    );
    let mut group = criterion.benchmark_group("antiradiance");
    group.sample_size(10).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    group.throughput(Throughput::Elements(report.transfers.into()));
    group.bench_function(BenchmarkId::new("global pass", "office"), |bencher| {
        bencher.iter_custom(|n| {
            Duration::from_secs_f64((0..n).map(|_| device_gather_ms(&context, &method)).sum::<f64>() * 1e-3)
        });
    });
    group.finish();
}

fn growth(_: &mut Criterion) {
    let context = Context::new(Options::default()).unwrap();
    let mut before: Option<(f64, f64)> = None;
    for elements in [2_000, 4_000, 8_000, 16_000] {
        let prepared = Prepared::new(&context, "cornell-box", elements);
        let mut method = Antiradiance::prepare(&context, &prepared.stage(), paper_settings(3.0)).unwrap();
        let LinkTimes { all: links, factors, .. } = link_ms(&context, &mut method, &prepared);
        let report = method.report();
        let (n, made) = (f64::from(report.leaves), report.links as f64);
        println!(
            "growth, cornell-box: {report}; new links {links:.0} ms ({:.1} M/s), form factors {factors:.0} ms",
            made / links / 1e3
        );
        if let Some((n_before, made_before)) = before {
            println!("  leaves x {:.2}, links x {:.2}", n / n_before, made / made_before);
        }
        before = Some((n, made));
    }
    for (owner, memory) in context.memory_by_owner() {
        println!("peak memory of {owner}: {:.1} MiB", mib(memory.peak_bytes));
    }
}

/// The paper's Fig. 5: change of the light by step, of both schemes, on the office.
fn convergence(_: &mut Criterion) {
    let context = Context::new(Options::default()).unwrap();
    let mut csv = "scene,scheme,step,bounce,reflects,change_w,total_w\n".to_owned();
    for (scene, elements) in [("cornell-box", 2_000), ("office", 7_000)] {
        let prepared = Prepared::new(&context, scene, elements);
        let mut ends: Vec<Vec<Vec3>> = Vec::new();
        for (name, scheme) in [("symmetric", Scheme::Symmetric), ("asymmetric", Scheme::Asymmetric)] {
            let settings = Settings {
                scheme,
                iterations: CURVE_STEPS,
                // Four steps of antiradiance to one of light, as in the paper.
                depth: 4,
                tolerance: 0.0,
                half_tables: false,
                smoothing: false,
                ..paper_settings(6.0)
            };
            let mut method = Antiradiance::prepare(&context, &prepared.stage(), settings).unwrap();
            let outcome = method.solve(&context, &prepared.world, CURVE_STEPS / 4, &Unwatched);
            let steps: Vec<_> = method.residuals().iter().filter(|r| r.bounce > 0).collect();
            for r in &steps {
                let (change, total) = (r.change, r.total);
                writeln!(csv, "{scene},{name},{},{},{},{change:e},{total:e}", r.step, r.bounce, r.reflects).unwrap();
            }
            let last = steps.last().map_or(0.0, |r| r.relative());
            let ended = outcome.map_or_else(|error| error.to_string(), |()| format!("changes by {last:.1e} at last"));
            println!("convergence, {scene}, {name}: {} steps, damped by {}, {ended}", steps.len(), method.damping());
            ends.push(context.download(method.indirect_irradiance()).unwrap());
        }
        let square = |a: &Vec3| f64::from(a.length_squared());
        let apart: f64 = ends[0].iter().zip(&ends[1]).map(|(a, b)| square(&(*a - *b))).sum();
        let apart = (apart / ends[0].iter().map(square).sum::<f64>()).sqrt();
        println!("convergence, {scene}: the schemes' light differs by {apart:.1e} (paper: less than 1e-4)");
    }
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/target/antiradiance-convergence.csv");
    std::fs::write(file, csv).unwrap();
    println!("convergence: curves in target/antiradiance-convergence.csv");
}

criterion_group!(benches, convergence, office, growth);
criterion_main!(benches);
