//! Surface shadow maps and the final gather in one run, as ratios: look-ups in compressed maps against shadow rays between
//! the same points, making maps against casting the same rays alone, gathers of pixels and of texels, memory.
//!
//! How much of the look-ups' time goes by in waiting for memory is told by the same look-ups of a few pairs alone, which stay in
//! the caches, and by bare fetches in a row over as many bytes; how much each asks for, by the CPU's twin.
//!
//! `LINKLIGHT_BENCH_SCENE` names another scene than the church, `LINKLIGHT_BENCH_ATLAS` another atlas than 128 texels a side;
//! `LINKLIGHT_BENCH_QUERIES` set to anything leaves the gathers out.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{UVec2, Vec3};
use linklight::display::direct::Sample;
use linklight::display::final_gather::{self, FinalGather, Gathered, Visibility};
use linklight::display::g_buffer::GBuffer;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::gpu::shaders::surface_maps::{CubeRays, CubeRaysParams};
use linklight::gpu::shaders::types::{Hit, Ray, SurfaceMapQuery};
use linklight::gpu::shaders::yardstick::{Fetches, FetchesParams};
use linklight::gpu::{Buffer, Context, Options, Recorder};
use linklight::methods::surface_shadow_maps::{Lit, Settings, Stage, SurfaceShadowMaps, TexelVisibility};
use linklight::report::tonemap::ToneSettings;
use linklight::scene::camera::View;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{LoadOptions, builtin, deform};
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::surface_maps::{Fetch, MapFilter, MapInput, MapOptions, PackedRuns, PlacedMaps, SurfaceMaps};
use linklight::stages::trace::{self, Tracer};
use linklight::stages::work::Unwatched;
use linklight::stages::world::World;
use std::collections::HashSet;
use std::hint::black_box;
use std::time::Instant;

const QUERIES: usize = 1 << 19;
/// Pairs that stay in a core's own caches.
const FEW: usize = 64;
const SIZE: UVec2 = UVec2::new(160, 90);

/// Shortest of `rounds` submissions, seconds; the first of all compiles.
fn seconds(context: &Context, rounds: usize, mut body: impl FnMut(&mut Recorder<'_>)) -> f64 {
    let once = |_| {
        let mut recorder = context.recorder("bench").unwrap();
        let start = Instant::now();
        body(&mut recorder);
        recorder.submit().unwrap();
        start.elapsed().as_secs_f64()
    };
    (0..rounds).map(once).fold(f64::MAX, f64::min)
}

fn surface_maps(criterion: &mut Criterion) {
    let context = Context::new(Options::default()).expect("a Vulkan device");
    let name = std::env::var("LINKLIGHT_BENCH_SCENE").unwrap_or_else(|_| "builtin:church".into());
    let scene = builtin::open(&name, &LoadOptions::default()).expect("a scene");
    let geometry = Geometry::flatten(&scene, 1 << 32).unwrap();
    let pose = Pose::rest(&scene);
    let world = World::new(&context, &scene, &geometry, &pose, &Environment::default(), true).unwrap();
    let vertices = deform::world_vertices(&geometry, &pose);
    let bounds = vertices.bounds().unwrap();
    let bvh = Bvh::build(&context, &vertices.positions, &geometry.triangles).unwrap();
    let tracer = Tracer::compute(&bvh, &world);
    let stage = Stage {
        scene: &scene,
        geometry: &geometry,
        positions: &vertices.positions,
        rest_positions: &vertices.positions,
        pose: &pose,
        bounds,
        world: &world,
        tracer,
        tone: ToneSettings::default(),
        seed: 0,
        cache: None,
        watch: &Unwatched,
    };

    let atlas = std::env::var("LINKLIGHT_BENCH_ATLAS").map_or(128, |side| side.parse().expect("texels a side"));
    // The maps are made apart, to be timed alone.
    let settings = Settings { atlas_resolution: atlas, visibility: TexelVisibility::Rays, ..Settings::default() };
    let mut method = SurfaceShadowMaps::prepare(&context, &stage, settings).unwrap();
    let maps = making(&context, &method, settings, &tracer, bounds);
    let filters = [settings.map_filter, settings.sender_filter];
    let leaf_order = &method.tree.topology.leaf_order;
    method.maps = Some(PlacedMaps::new(&context, maps, &method.atlas, leaf_order, filters).unwrap());
    println!("{name}: {}", method.report());
    let maps = &method.maps.as_ref().expect("made just now").maps;
    let bytes = maps.size_bytes() as f64 / f64::from(method.texels.count.max(1));
    println!("  {bytes:.0} bytes a texel at 6 x {0} x {0}", maps.options.resolution);

    queries(&context, criterion, &method, maps, &tracer);
    if std::env::var_os("LINKLIGHT_BENCH_QUERIES").is_some() {
        return;
    }
    gathers(&context, &method, &stage, &bvh, &pose);
}

/// Makes the maps; their rays against the first rays of every n-th map alone.
fn making(
    context: &Context,
    method: &SurfaceShadowMaps,
    settings: Settings,
    tracer: &Tracer<'_>,
    bounds: [Vec3; 2],
) -> SurfaceMaps {
    let resolution = settings.map_resolution;
    let input = MapInput { atlas: &method.atlas, tracer: *tracer, apart: None, bounds, content: &[], cache: None };
    let options = MapOptions {
        resolution,
        sequence: settings.sequence,
        bias: settings.map_bias,
        until: settings.map_until,
        sharing: settings.map_sharing,
    };
    let start = Instant::now();
    let made = SurfaceMaps::new(context, input, options, &Unwatched).unwrap();
    let spent = start.elapsed().as_secs_f64();
    let rate = made.ray_count as f64 / spent;

    let pixels = 6 * resolution * resolution;
    let places = ((1 << 19) / pixels).clamp(1, method.texels.count);
    let every = (method.atlas.texels.len() / places as usize).max(1);
    let chosen = method.atlas.texels.iter().step_by(every).take(places as usize);
    let (origins, normals): (Vec<Vec3>, Vec<Vec3>) =
        chosen.map(|texel| (texel.position + method.texels.ray_offset * texel.normal, texel.normal)).unzip();
    let map_origins = context.upload("bench/origins", &origins).unwrap();
    let map_normals = context.upload("bench/normals", &normals).unwrap();
    let rays: Buffer<Ray> = context.buffer("bench/rays", origins.len() * pixels as usize).unwrap();
    let hits: Buffer<Hit> = context.buffer("bench/hits", rays.len()).unwrap();
    let params = CubeRaysParams { first_place: 0, chunk_count: origins.len() as u32, resolution };
    let alone = seconds(context, 5, |recorder| {
        let pass = CubeRays { map_origins: &map_origins, map_normals: &map_normals, rays: &rays, params };
        recorder.dispatch(&pass, rays.len());
        trace::closest_hit(recorder, tracer, &rays, &hits, rays.len());
    });
    let bvh_rate = rays.len() as f64 / alone;
    println!(
        "  making maps: {spent:.1} s, {:.2} M rays/s, first rays alone {:.2} M rays/s: {:.0} %",
        rate / 1e6,
        bvh_rate / 1e6,
        100.0 * rate / bvh_rate
    );
    made
}

/// Look-ups against shadow rays between random texels that face each other.
fn queries(
    context: &Context,
    criterion: &mut Criterion,
    method: &SurfaceShadowMaps,
    maps: &SurfaceMaps,
    tracer: &Tracer<'_>,
) {
    let texels = &method.atlas.texels;
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % texels.len()
    };
    let (mut asked, mut rays) = (Vec::new(), Vec::new());
    for _ in 0..64 * QUERIES {
        let (sender, receiver) = (random(), random());
        let offset = texels[receiver].position - texels[sender].position;
        if offset.dot(texels[sender].normal) <= 0.0 || offset.dot(texels[receiver].normal) >= 0.0 {
            continue;
        }
        let off = method.texels.ray_offset;
        let origin = texels[receiver].position + off * texels[receiver].normal;
        let target = texels[sender].position + off * texels[sender].normal;
        asked.push(SurfaceMapQuery { point: origin, normal: texels[receiver].normal, place: maps.places[sender] });
        rays.push(Ray { origin, t_min: 0.0, direction: target - origin, t_max: 1.0 });
        if asked.len() == QUERIES {
            break;
        }
    }
    let count = asked.len();
    let few: Vec<SurfaceMapQuery> = (0..count).map(|i| asked[i % FEW]).collect();
    let few = context.upload("bench/few queries", &few).unwrap();
    let places: Vec<u32> = asked.iter().map(|query| query.place).collect();
    let asked = context.upload("bench/queries", &asked).unwrap();
    let rays = context.upload("bench/rays", &rays).unwrap();
    let (seen, free) = (context.buffer("bench/seen", count).unwrap(), context.buffer("bench/free", count).unwrap());
    let by_rays = seconds(context, 5, |recorder| trace::any_hit(recorder, tracer, &rays, &free, count));
    let by_few = seconds(context, 5, |recorder| maps.query(recorder, &few, &seen, count, MapFilter::None));
    let million = |seconds: f64| count as f64 / seconds / 1e6;
    println!("  from the caches ({FEW} pairs over and over), filter None: {:.2} M look-ups/s", million(by_few));
    waiting(context, maps, &places);
    for filter in [MapFilter::None, MapFilter::Drawn, MapFilter::Four] {
        let by_maps = seconds(context, 5, |recorder| maps.query(recorder, &asked, &seen, count, filter));
        println!(
            "  {count} pairs, filter {filter:?}: {:.2} M look-ups/s, {:.2} M shadow rays/s: {:.1} x",
            million(by_maps),
            million(by_rays),
            by_rays / by_maps
        );
    }
    let (seen, free) = (context.download(&seen).unwrap(), context.download(&free).unwrap());
    let differ = seen.iter().zip(&free).map(|(seen, &free)| f64::from((seen - free as f32).abs())).sum::<f64>();
    println!("  filtered answers differ from rays by {:.2} % in the mean", 100.0 * differ / count as f64);
    let seen = context.buffer("bench/seen", count).unwrap();
    criterion.bench_function("look-ups", |b| {
        b.iter(|| {
            let mut recorder = context.recorder("bench").unwrap();
            maps.query(&mut recorder, &asked, &seen, count, MapFilter::Drawn);
            recorder.submit().unwrap();
            black_box(());
        });
    });
}

/// What look-ups through random pixels of the maps at `places` fetch, and how long as many bare fetches take.
fn waiting(context: &Context, maps: &SurfaceMaps, places: &[u32]) {
    let packed = PackedRuns::of(&maps.maps, maps.layout());
    let pixels = maps.maps.pixel_count() as u32;
    let (mut fetches, mut lines, mut pages) = (0usize, 0usize, 0usize);
    let mut all_lines = HashSet::new();
    for (k, &place) in places.iter().enumerate() {
        let pixel = (k as u32).wrapping_mul(2_654_435_761) % pixels;
        let mut texels = Vec::new();
        packed.depth(place, pixel as usize, |fetch| {
            texels.push(match fetch {
                Fetch::Offsets(texel) => (0, texel),
                Fetch::Words(texel) => (1, texel),
            });
        });
        let distinct = |texels_each: u32| -> HashSet<(u32, u32)> {
            texels.iter().map(|&(table, texel)| (table, texel / texels_each)).collect()
        };
        fetches += texels.len();
        // Of 64 bytes, and of 4096.
        lines += distinct(4).len();
        pages += distinct(256).len();
        all_lines.extend(distinct(4));
    }
    let each = |sum: usize| sum as f64 / places.len() as f64;
    println!(
        "  a look-up in {:?} runs fetches {:.2} texels, of {:.2} cache lines in {:.2} pages; {} lines of {} in all",
        maps.layout(),
        each(fetches),
        each(lines),
        each(pages),
        all_lines.len(),
        maps.size_bytes() / 64
    );
    let texels = (maps.size_bytes() / 16) as u32;
    let mut next: Vec<[u32; 4]> = (0..texels).map(|texel| [texel, 0, 0, 0]).collect();
    let mut state = 7u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for texel in (1..next.len()).rev() {
        let other = random(texel + 1);
        next.swap(texel, other);
    }
    let starts: Vec<u32> = places.iter().map(|_| random(next.len()) as u32).collect();
    let table = context.texel_buffer("bench/table", next.len()).unwrap();
    context.write(table.buffer(), &next).unwrap();
    let places = context.upload("bench/places", &starts).unwrap();
    for fetches in 1..=5 {
        let params = FetchesParams { count: starts.len() as u32, fetches };
        let pass = Fetches { table: &table, places: &places, params };
        let bare = seconds(context, 5, |recorder| recorder.dispatch(&pass, starts.len()));
        let rate = starts.len() as f64 / bare / 1e6;
        println!("  {fetches} bare fetches in a row over as many bytes: {rate:.2} M/s");
    }
}

/// Bounces over texels and the gather of a picture, by maps and by rays, beside the paper's Table 1 in all: a frame of texels
/// against one of pixels, two bounces against one.
fn gathers(context: &Context, method: &SurfaceShadowMaps, stage: &Stage<'_>, bvh: &Bvh, pose: &Pose) {
    let solve = |bounces| {
        seconds(context, 2, |recorder| {
            method.solve(recorder, Lit { world: stage.world, tracer: stage.tracer, bvh }, bounces)
        })
    };
    let [direct, one, two] = [0, 1, 2].map(solve);
    let cuts = context.download(method.cut_sizes()).unwrap();
    let nodes = cuts.iter().map(|&cut| f64::from(cut)).sum::<f64>();
    let texels = f64::from(method.texels.count);
    println!(
        "  {texels} texels: direct {direct:.3} s, 1 bounce {one:.3} s, 2 bounces {two:.3} s; {:.2} M nodes gathered/s, cut {:.0}",
        nodes / (two - one) / 1e6,
        nodes / texels
    );
    println!(
        "  texels/s with 1 bounce {:.1} k, with 2 {:.1} k: {:.2} : 1",
        texels / one / 1e3,
        texels / two / 1e3,
        two / one
    );
    let shadow_maps = ShadowMaps::new(context, pose, SIZE.to_array()).unwrap();
    let g_buffer = GBuffer::new(context, SIZE.x, SIZE.y).unwrap();
    let film = Film::new(context, SIZE.x, SIZE.y).unwrap();
    let view = View::of_scene(stage.scene, pose, None, Some(stage.bounds), SIZE).unwrap();
    let mut recorder = context.recorder("bench").unwrap();
    shadow_maps.draw(&mut recorder, stage.world, pose, stage.bounds);
    recorder.submit().unwrap();
    let all = [Visibility::Maps, Visibility::Checked, Visibility::Rays, Visibility::None];
    for (gather_visibility, gather_chance) in
        all.into_iter().flat_map(|by| [(by, 0.0), (by, 0.5), (by, 1.0), (by, 2.0)])
    {
        let settings = final_gather::Settings { gather_visibility, gather_chance, ..final_gather::Settings::default() };
        let display = FinalGather::new(context, SIZE.to_array(), settings, ToneSettings::default(), 0).unwrap();
        let from = Gathered {
            world: stage.world,
            tree: &method.tree,
            tracer: stage.tracer,
            maps: method.maps.as_ref(),
            bvh,
            shadow_maps: &shadow_maps,
            g_buffer: &g_buffer,
            view: &view,
        };
        let sample = Sample { index: 0, samples: 1, is_unlit: false };
        let time = seconds(context, 3, |recorder| display.draw(recorder, from, sample, &film));
        let report = display.report(context).unwrap();
        let pixels = report.pixels as f64;
        println!(
            "  {SIZE} pixels by {gather_visibility:?}, chance {gather_chance}: {time:.3} s, {:.1} k pixels/s; with the texels' frame, 1 \
             bounce {:.1} k, 2 bounces {:.1} k; {:.2} M nodes gathered/s, cut {:.0} of {:.0} visited, {:.1} rays",
            pixels / time / 1e3,
            pixels / (time + direct) / 1e3,
            pixels / (time + one) / 1e3,
            pixels * report.mean_cut / time / 1e6,
            report.mean_cut,
            report.mean_visited,
            report.mean_rays
        );
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = surface_maps
}
criterion_main!(benches);
