//! The safe interface cannot be misused into undefined behaviour: what is dropped while it is in use lives on, what
//! belongs to another device is refused, and what reaches beyond the end of a buffer finds nothing there.

use crate::common::TestContext;
use glam::{UVec3, Vec3};
use linklight::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams};
use linklight::gpu::{
    Bindings, Buffer, Context, Format, GpuError, Image, ImageDescription, Load, Pass, Program, RasterState, Sampled,
    SamplerDescription, Shape, Target, TexelBuffer,
};
use std::marker::PhantomData;

fn image(context: &Context, width: u32, format: Format) -> Image {
    let description =
        ImageDescription { name: "test/image", width, height: 4, layers: 1, mip_levels: 1, format, shape: Shape::Flat };
    context.image(&description).unwrap()
}

#[track_caller]
fn refused<T>(result: Result<T, GpuError>, parts: &[&str]) {
    match result.err() {
        Some(GpuError::Refused(message)) => parts.iter().for_each(|part| assert!(message.contains(part), "{message}")),
        other => panic!("{other:?}"),
    }
}

fn add<'a>(values: &'a Buffer<u32>, block_sums: &'a Buffer<u32>, value_count: u32) -> AddBlockSums<'a> {
    AddBlockSums { values, block_sums, params: AddBlockSumsParams { value_count } }
}

#[test]
fn what_is_dropped_before_it_runs_lives_until_it_ran() {
    let context = TestContext::new();
    let values = context.upload("test/values", &[1u32; 4096]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    for _ in 0..3 {
        // Bound, then dropped, while the recording goes on: the next may not take its memory.
        let block_sums = context.upload("test/sums", &[2u32; 4]).unwrap();
        recorder.dispatch(&add(&values, &block_sums, 4096), 4096u32);
        drop(block_sums);
        let other = context.upload("test/other", &[1000u32; 4]).unwrap();
        drop(other);
    }
    recorder.submit().unwrap();
    assert_eq!(context.download(&values).unwrap(), [7; 4096]);
    let held = context.memory_by_owner()["test"].current_bytes;
    drop(values);
    assert_eq!((held, context.memory_by_owner()["test"].current_bytes), (4 * 4096, 0), "all is freed then");
}

#[test]
fn objects_outlive_their_context() {
    let context = TestContext::new();
    let buffer = context.upload("test/values", &[1u32; 64]).unwrap();
    let texels = context.texel_buffer("test/texels", 8).unwrap();
    let picture = image(&context, 4, Format::Rgba8);
    let sampler = context.sampler("test/sampler", SamplerDescription::LINEAR_CLAMP).unwrap();
    let table = context.texture_table(vec![picture], vec![sampler], &[(0, 0)]).unwrap();
    drop(context);
    drop((buffer, texels, table));
}

#[test]
fn objects_of_another_device_are_refused() {
    let (context, other) = (TestContext::new(), TestContext::new());
    let values = context.upload("test/values", &[1u32; 64]).unwrap();
    let foreign = other.upload("test/foreign", &[1u32; 64]).unwrap();
    let recorded = |record: &dyn Fn(&mut linklight::gpu::Recorder<'_>)| {
        let mut recorder = context.recorder("test").unwrap();
        record(&mut recorder);
        recorder.submit()
    };
    refused(recorded(&|r| r.dispatch(&add(&values, &foreign, 64), 64u32)), &["scan/add_block_sums", "another device"]);
    let groups = other.group_counts("test/groups", 256).unwrap();
    refused(recorded(&|r| r.dispatch_indirect(&add(&values, &values, 64), &groups)), &["another device"]);
    refused(recorded(&|r| r.count_groups(&groups, &values, 0)), &["another device"]);
    refused(recorded(&|r| r.copy(&foreign, &values)), &["another device"]);
    refused(recorded(&|r| r.fill(&foreign, 0)), &["another device"]);
    refused(recorded(&|r| r.write(&foreign, 0, &[1u32])), &["another device"]);
    refused(context.download(&foreign), &["another device"]);
    let picture = image(&other, 4, Format::Rgba8);
    refused(recorded(&|r| r.clear_image(&picture, [0.0; 4])), &["another device"]);
    refused(context.download_image::<u32>(&picture, 0), &["another device"]);
    let sampler = context.sampler("test/sampler", SamplerDescription::LINEAR_CLAMP).unwrap();
    refused(context.texture_table(vec![picture], vec![sampler], &[(0, 0)]), &["another device"]);
    if context.features().ray_query {
        let positions = other.upload("test/positions", &[Vec3::ZERO; 3]).unwrap();
        let triangles = context.upload("test/triangles", &[UVec3::new(0, 1, 2)]).unwrap();
        refused(context.acceleration_structure("test/structure", &positions, &triangles), &["another device"]);
    }
    // Both go on working.
    assert_eq!(context.download(&values).unwrap(), [1; 64]);
    assert_eq!(other.download(&foreign).unwrap(), [1; 64]);
}

/// Counts, ranges and layers that do not fit are refused where the host knows them.
#[test]
fn ranges_beyond_the_end_are_refused() {
    let context = TestContext::new();
    let values = context.upload("test/values", &[1u32; 64]).unwrap();
    for len in [usize::MAX, usize::MAX / 2 + 1, 1 << 62] {
        let error = context.buffer::<u32>("test/endless", len).err().unwrap();
        assert!(matches!(error, GpuError::StorageRange { .. }), "{error}");
        let error = context.texel_buffer("test/endless", len).map(|t: TexelBuffer| t.size_bytes()).unwrap_err();
        assert!(matches!(error, GpuError::StorageRange { .. }), "{error}");
    }
    let recorded = |record: &dyn Fn(&mut linklight::gpu::Recorder<'_>)| {
        let mut recorder = context.recorder("test").unwrap();
        record(&mut recorder);
        recorder.submit()
    };
    refused(recorded(&|r| r.write(&values, usize::MAX, &[1u32; 2])), &["test/values"]);
    let groups = context.group_counts("test/groups", 64).unwrap();
    refused(recorded(&|r| r.count_groups(&groups, &values, 64)), &["64 of 64"]);
    refused(recorded(&|r| r.count_groups(&groups, &values, usize::MAX)), &["of 64"]);
    refused(recorded(&|r| r.dispatch_indirect(&add(&values, &values, 64), &groups)), &["[256, 1, 1]", "for 64"]);
    assert!(context.group_counts("test/groups", 0).is_err());
    refused(recorded(&|r| r.dispatch(&add(&values, &values, 64), [u32::MAX, 1])), &["workgroups"]);
    refused(recorded(&|r| r.copy(&values, &values)), &["test/values"]);
    let (color, depth) = (image(&context, 4, Format::Rgba8), image(&context, 4, Format::Depth32));
    refused(context.download_image::<u32>(&color, 1), &["layer 1 of 1"]);
    refused(context.download_image::<[f32; 4]>(&color, 0), &["16 bytes, they have 4"]);
    refused(recorded(&|r| r.clear_image(&depth, [0.0; 4])), &["depth"]);
    let mut recorder = context.recorder("test").unwrap();
    recorder.generate_mips(&depth);
    recorder.submit().unwrap();
}

/// Where only the shader knows, the device's bounds checks hold: a count beyond both buffers changes nothing outside.
#[test]
fn counts_beyond_a_buffer_touch_nothing_else() {
    let context = TestContext::new();
    let before = context.upload("test/before", &vec![5u32; 1 << 16]).unwrap();
    let values = context.upload("test/values", &[1u32; 100]).unwrap();
    let after = context.upload("test/after", &vec![6u32; 1 << 16]).unwrap();
    let block_sums = context.upload("test/sums", &[2u32; 1]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(&add(&values, &block_sums, 1 << 20), 1u32 << 20);
    recorder.submit().unwrap();
    assert_eq!(context.download(&values).unwrap(), [3; 100], "what is there is done");
    assert!(context.download(&before).unwrap().iter().all(|value| *value == 5));
    assert!(context.download(&after).unwrap().iter().all(|value| *value == 6));
}

/// A pass written by hand: the program of a generated one, with anything bound to it.
struct ByHand<'a, P> {
    buffers: Vec<&'a Buffer<u32>>,
    storage: Option<&'a Image>,
    sampled: Option<Sampled<'a>>,
    push_constants: Vec<u8>,
    program: PhantomData<P>,
}

impl<P> Default for ByHand<'_, P> {
    fn default() -> Self {
        Self { buffers: Vec::new(), storage: None, sampled: None, push_constants: Vec::new(), program: PhantomData }
    }
}

impl<P: Pass> Pass for ByHand<'_, P> {
    const PROGRAM: &'static Program = P::PROGRAM;
    fn bind<'b>(&'b self, bindings: &mut Bindings<'b>) {
        self.buffers.iter().for_each(|buffer| bindings.buffer(*buffer));
        self.storage.into_iter().for_each(|image| bindings.storage_image(image));
        self.sampled.into_iter().for_each(|sampled| bindings.sampled(sampled));
        bindings.push_constants(&self.push_constants);
    }
}

/// What is bound is what the shader declares: as many objects, of those kinds, images of that shape and format.
#[test]
fn what_does_not_fit_the_shader_is_refused() {
    type Add = AddBlockSums<'static>;
    type Interface = linklight::gpu::shaders::display::Interface<'static>;
    let context = TestContext::new();
    let values = context.upload("test/values", &[1u32; 64]).unwrap();
    let color = image(&context, 4, Format::Rgba8);
    let dispatched = |record: &dyn Fn(&mut linklight::gpu::Recorder<'_>)| {
        let mut recorder = context.recorder("test").unwrap();
        record(&mut recorder);
        recorder.submit()
    };
    let whole = || ByHand::<Add> { buffers: vec![&values; 2], push_constants: vec![0; 4], ..ByHand::default() };
    dispatched(&|r| r.dispatch(&whole(), 1u32)).unwrap();
    let few = ByHand::<Add> { buffers: vec![&values], ..whole() };
    refused(dispatched(&|r| r.dispatch(&few, 1u32)), &["1 objects", "declares 2"]);
    let other = ByHand::<Add> { buffers: vec![&values], storage: Some(&color), ..whole() };
    refused(dispatched(&|r| r.dispatch(&other, 1u32)), &["`block_sums` is Buffer", "StorageImage(Rgba8)"]);
    let short = ByHand::<Add> { push_constants: vec![0; 3], ..whole() };
    refused(dispatched(&|r| r.dispatch(&short, 1u32)), &["3 bytes of push constants", "declares 4"]);

    // A picture of another format than the kernel stores, and of another shape or kind than it samples.
    let float = image(&context, 4, Format::Rgba32Float);
    type Tone = linklight::gpu::shaders::tone_map::Apply<'static>;
    let frame = |storage| ByHand::<Tone> {
        buffers: vec![&values; 3],
        storage: Some(storage),
        push_constants: vec![0; Tone::PROGRAM.push_constant_bytes as usize],
        ..ByHand::default()
    };
    dispatched(&|r| r.dispatch(&frame(&color), 0u32)).unwrap();
    refused(dispatched(&|r| r.dispatch(&frame(&float), 1u32)), &["`frame`", "Rgba8", "Rgba32Float"]);
    let layered = |shape, layers, format| {
        let description =
            ImageDescription { name: "test/layers", width: 4, height: 4, layers, mip_levels: 1, format, shape };
        context.image(&description).unwrap()
    };
    let sampler = context.sampler("test/sampler", SamplerDescription::LINEAR_CLAMP).unwrap();
    let nearest = context.sampler("test/sampler", SamplerDescription::NEAREST_CLAMP).unwrap();
    for (image, sampler, told) in [
        (layered(Shape::Array, 2, Format::Rgba8), &sampler, "shape: Array"),
        (layered(Shape::CubeArray, 6, Format::Rgba8), &sampler, "shape: CubeArray"),
        (layered(Shape::Flat, 1, Format::R32Uint), &nearest, "is_integer: true"),
        (layered(Shape::Flat, 1, Format::R32Uint), &sampler, "cannot be filtered"),
    ] {
        let glyphs = ByHand::<Interface> {
            buffers: vec![&values; 3],
            sampled: Some(Sampled { image: &image, sampler }),
            push_constants: vec![0; Interface::PROGRAM.push_constant_bytes as usize],
            ..ByHand::default()
        };
        let target = Target { color: vec![(&color, Load::Keep)], depth: None };
        refused(dispatched(&|r| r.draw(&glyphs, &target, RasterState::default(), 3, 1)), &[told]);
        let table = context.texture_table(vec![image], vec![], &[]);
        refused(table, &["test/layers"]);
    }
    // What is drawn into is not read by the same draw, and not drawn into twice.
    let own = ByHand::<Interface> {
        buffers: vec![&values; 3],
        sampled: Some(Sampled { image: &color, sampler: &sampler }),
        push_constants: vec![0; Interface::PROGRAM.push_constant_bytes as usize],
        ..ByHand::default()
    };
    let once = Target { color: vec![(&color, Load::Keep)], depth: None };
    refused(dispatched(&|r| r.draw(&own, &once, RasterState::default(), 3, 1)), &["drawn into is bound"]);
    let twice = Target { color: vec![(&color, Load::Keep); 2], depth: None };
    refused(dispatched(&|r| r.draw(&own, &twice, RasterState::default(), 3, 1)), &["twice"]);
}
