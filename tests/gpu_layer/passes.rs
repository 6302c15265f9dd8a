//! Ways to run a pass: indirect dispatch, draws of nothing, devices without any optional feature.

use crate::common::scenes::{lambert, scene};
use crate::common::{Random, TestContext};
use glam::Vec3;
use linklight::gpu::shaders::display::{ShadowMap, ShadowMapParams};
use linklight::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams};
use linklight::gpu::shaders::types::ShadowView;
use linklight::gpu::shaders::yardstick::{Fetches, FetchesParams, MultiplyAdd, MultiplyAddParams};
use linklight::gpu::{
    Buffer, Context, Format, Image, ImageDescription, Load, OptionalFeatures, Options, RasterState, Shape, Target,
};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::stages::scan;
use linklight::stages::world::World;

#[test]
fn an_indirect_dispatch_runs_as_many_threads_as_an_earlier_pass_left() {
    let context = TestContext::new();
    let values = context.upload("test/values", &[0u32; 1000]).unwrap();
    let block_sums = context.upload("test/block sums", &[7u32]).unwrap();
    let threads = context.upload("test/threads", &[9u32, 0]).unwrap();
    let groups = context.group_counts("test/groups", 256).unwrap();
    let pass =
        AddBlockSums { values: &values, block_sums: &block_sums, params: AddBlockSumsParams { value_count: 1000 } };
    // Two workgroups of 256 threads; none; and more than one dimension of a device holds, in rows: each value once.
    for (count, reached) in [(257u32, 512), (512, 512), (0, 0), (70_000 * 256, 1000)] {
        let mut recorder = context.recorder("test").unwrap();
        recorder.write(&values, 0, &[0u32; 1000]);
        recorder.write(&threads, 1, &[count]);
        recorder.count_groups(&groups, &threads, 1);
        recorder.dispatch_indirect(&pass, &groups);
        recorder.submit().unwrap();
        let expected: Vec<u32> = (0..1000).map(|i| if i < reached { 7 } else { 0 }).collect();
        assert_eq!(context.download(&values).unwrap(), expected, "{count} threads");
    }
}

fn empty_world(context: &Context) -> World {
    let scene = scene(vec![lambert(Vec3::ONE)], vec![], &[]);
    let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
    World::new(context, &scene, &geometry, &Pose::rest(&scene), &Environment::default(), false).unwrap()
}

fn shadow_map<'a>(world: &'a World, shadow_views: &'a Buffer<ShadowView>) -> ShadowMap<'a> {
    ShadowMap {
        triangles: &world.triangles,
        positions: &world.positions,
        attributes: &world.attributes,
        shadow_views,
        triangle_materials: &world.triangle_materials,
        materials: &world.materials,
        textures: &world.textures,
        params: ShadowMapParams { view: 0 },
    }
}

fn depth_image(context: &Context) -> Image {
    let description = ImageDescription {
        name: "test/depth",
        width: 5,
        height: 3,
        layers: 2,
        mip_levels: 1,
        format: Format::Depth32,
        shape: Shape::Array,
    };
    context.image(&description).unwrap()
}

/// A pass takes as long behind a draw as before any.
#[test]
fn a_pass_behind_a_draw_is_timed_whole() {
    let context = TestContext::new();
    let world = empty_world(&context);
    let (shadow_views, depth) = (context.buffer("test/views", 1).unwrap(), depth_image(&context));
    let draw = shadow_map(&world, &shadow_views);
    let values = context.upload("test/values", &[0.5f32; 1 << 16]).unwrap();
    let work = MultiplyAdd { values: &values, params: MultiplyAddParams { count: 1 << 16, iterations: 100 } };
    let state = RasterState { depth_test: true, ..RasterState::default() };
    let shortest = |is_drawn: bool| {
        let once = |_| {
            let mut recorder = context.recorder("test").unwrap();
            if is_drawn {
                let target = Target { color: vec![], depth: Some((&depth, 0, Load::Clear([0.0; 4]))) };
                recorder.draw(&draw, &target, state, 0, 1);
            }
            recorder.dispatch(&work, values.len());
            context.take_records();
            recorder.submit().unwrap();
            let record = context.take_records().pop().unwrap();
            assert_eq!(record.name, "yardstick/multiply_add");
            record.end_ns - record.start_ns
        };
        (0..4).map(once).min().unwrap()
    };
    let [before, behind] = [false, true].map(shortest);
    println!("before any draw {before} ns, behind one {behind} ns");
    assert!(behind > before / 4 && before > behind / 4, "{before} ns and {behind} ns");
}

/// The bench's floor of look-ups fetches what it says, in a row.
#[test]
fn chains_of_fetches_go_where_they_are_told() {
    let context = TestContext::new();
    let random = &mut Random(3);
    let next: Vec<[u32; 4]> = (0..500).map(|_| [random.below(500), 0, 0, 0]).collect();
    let starts: Vec<u32> = (0..100).map(|_| random.below(500)).collect();
    let table = context.texel_buffer("test/table", next.len()).unwrap();
    context.write(table.buffer(), &next).unwrap();
    for fetches in 0..4 {
        let places = context.upload("test/places", &starts).unwrap();
        let params = FetchesParams { count: 100, fetches };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&Fetches { table: &table, places: &places, params }, places.len());
        recorder.submit().unwrap();
        let expected: Vec<u32> =
            starts.iter().map(|&start| (0..fetches).fold(start, |at, _| next[at as usize][0])).collect();
        assert_eq!(context.download(&places).unwrap(), expected);
    }
}

#[test]
fn a_draw_of_nothing_still_clears() {
    let context = TestContext::new();
    let world = empty_world(&context);
    let shadow_views = context.buffer("test/views", 1).unwrap();
    let depth = depth_image(&context);
    let pass = shadow_map(&world, &shadow_views);
    let state = RasterState { depth_test: true, ..RasterState::default() };
    let target = |layer, load| Target { color: vec![], depth: Some((&depth, layer, load)) };
    let mut recorder = context.recorder("test").unwrap();
    recorder.draw(&pass, &target(0, Load::Clear([0.25; 4])), state, 0, 1);
    recorder.draw(&pass, &target(1, Load::Clear([0.75; 4])), state, 3, 0);
    recorder.draw(&pass, &target(1, Load::Keep), state, 0, 0);
    recorder.submit().unwrap();
    assert_eq!(context.download_image::<f32>(&depth, 0).unwrap(), [0.25; 15]);
    assert_eq!(context.download_image::<f32>(&depth, 1).unwrap(), [0.75; 15]);

    let mut recorder = context.recorder("test").unwrap();
    recorder.draw(&pass, &Target { color: vec![], depth: None }, state, 3, 1);
    let message = recorder.submit().unwrap_err().to_string();
    assert!(message.contains("display/shadow_map") && message.contains("nothing to draw into"), "{message}");

    let other = context
        .image(&ImageDescription {
            name: "test/other",
            width: 9,
            height: 9,
            layers: 1,
            mip_levels: 1,
            format: Format::Rgba8,
            shape: Shape::Flat,
        })
        .unwrap();
    let keep = Load::Keep;
    for (wrong, word) in [
        (Target { color: vec![], depth: Some((&depth, depth.layers, keep)) }, "is no depth"),
        (Target { color: vec![(&other, keep)], depth: Some((&depth, 0, keep)) }, "one size"),
        (Target { color: vec![], depth: Some((&other, 0, keep)) }, "is no depth"),
        (Target { color: vec![(&depth, keep)], depth: None }, "as colour"),
    ] {
        let mut recorder = context.recorder("test").unwrap();
        recorder.draw(&pass, &wrong, state, 3, 1);
        let message = recorder.submit().unwrap_err().to_string();
        assert!(message.contains("display/shadow_map") && message.contains(word), "{message}");
    }
}

/// Every device allows 128 bytes of push constants and, of those we run on, 256 invocations a workgroup.
#[test]
fn every_program_keeps_to_what_all_devices_allow() {
    let programs = linklight::gpu::shaders::PROGRAMS;
    assert!(programs.len() > 50, "{} programs", programs.len());
    for program in programs {
        assert!(program.push_constant_bytes <= 128, "{}: {} bytes", program.name, program.push_constant_bytes);
        let invocations: u32 = program.workgroup.iter().product();
        assert!(invocations <= 256, "{}: {invocations} invocations", program.name);
    }
}

#[test]
fn a_device_without_optional_features_does_the_same_work() {
    let data: Vec<u32> = {
        let mut random = Random(2);
        (0..5000).map(|_| random.below(10)).collect()
    };
    let scanned = |options: Options| {
        let context = TestContext::with(options);
        let values = context.upload("test/values", &data).unwrap();
        let scratch = scan::ScanScratch::new(&context, "test", data.len()).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        scan::exclusive(&mut recorder, &values, data.len(), &scratch);
        recorder.submit().unwrap();
        (context.features(), context.calibrate().is_some(), context.download(&values).unwrap())
    };
    let (features, calibrated, bare) =
        scanned(Options { no_optional_features: true, statistics: true, ..Options::default() });
    assert_eq!((features, calibrated), (OptionalFeatures::default(), false));
    let (_, _, full) = scanned(Options { statistics: true, ..Options::default() });
    assert!(bare == full, "the same numbers");
}
