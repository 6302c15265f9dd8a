//! What the layer refuses: the first error of a recording is kept and returned, nothing after it runs.

use crate::common::TestContext;
use linklight::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams};
use linklight::gpu::{Format, GpuError, ImageDescription, Options, SamplerDescription, Shape};

const TEXEL: ImageDescription<'_> = ImageDescription {
    name: "test/texel",
    width: 1,
    height: 1,
    layers: 1,
    mip_levels: 1,
    format: Format::Rgba8,
    shape: Shape::Flat,
};

#[test]
fn the_first_error_of_a_recording_is_kept_and_nothing_runs() {
    let context = TestContext::new();
    let values = context.upload("test/values", &[5u32; 4]).unwrap();
    let small = context.buffer::<u32>("test/small", 2).unwrap();
    let block_sums = context.upload("test/ones", &[1u32]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.fill(&values, 3);
    recorder.write(&values, 2, &[0u32; 3]);
    recorder.copy(&values, &small);
    let params = AddBlockSumsParams { value_count: 4 };
    recorder.dispatch(&AddBlockSums { values: &values, block_sums: &block_sums, params }, 4u32);
    let message = recorder.submit().unwrap_err().to_string();
    assert!(message.contains("test/values") && message.contains("3 elements at 2 into 4"), "{message}");
    assert_eq!(context.download(&values).unwrap(), [5; 4], "a failed recording changes nothing");

    // The context goes on working.
    let mut recorder = context.recorder("test").unwrap();
    recorder.fill(&values, 3);
    recorder.submit().unwrap();
    assert_eq!(context.download(&values).unwrap(), [3; 4]);
}

#[test]
fn an_abandoned_recording_leaves_no_trace() {
    let context = TestContext::new();
    let values = context.upload("test/values", &[5u32; 4]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.fill(&values, 3);
    drop(recorder);
    assert_eq!(context.download(&values).unwrap(), [5; 4]);
}

#[test]
fn memory_beyond_the_heap_is_refused_with_numbers() {
    let context = TestContext::new();
    let side = context.limits().image_extent;
    let layer_bytes = u64::from(side).pow(2) * 16;
    let layers = u32::try_from(context.available_bytes() / layer_bytes + 1).unwrap();
    assert!(layers <= context.limits().image_layers, "a device that could hold the largest image of all");
    let description = ImageDescription {
        name: "test/vast",
        width: side,
        height: side,
        layers,
        format: Format::Rgba32Float,
        shape: Shape::Array,
        ..TEXEL
    };
    let error = context.image(&description).err().unwrap();
    match &error {
        GpuError::OutOfMemory { name, bytes, available, .. } => {
            assert_eq!(name, "test/vast");
            assert!(*bytes >= layer_bytes * u64::from(layers) && *bytes > *available, "{error}");
        }
        other => panic!("{other:?}"),
    }
    assert!(error.to_string().contains("test/vast"), "{error}");
    assert!(context.buffer::<u32>("test/small", 16).is_ok(), "the context goes on working");
}

#[test]
fn memory_beyond_what_is_allowed_is_refused_with_numbers() {
    let context = TestContext::with(Options { max_memory_bytes: Some(1 << 20), ..Options::default() });
    let half = context.buffer::<u8>("test/half", 600 << 10).unwrap();
    let error = context.buffer::<u8>("test/more", 600 << 10).err().unwrap();
    match &error {
        GpuError::OutOfMemory { name, bytes, available, .. } => {
            assert_eq!(
                (name.as_str(), *bytes >= 600 << 10, *available <= 424 << 10),
                ("test/more", true, true),
                "{error}"
            );
        }
        other => panic!("{other:?}"),
    }
    assert!(error.to_string().contains("--max-memory"), "{error}");
    drop(half);
    assert!(context.buffer::<u8>("test/more", 600 << 10).is_ok(), "what is given back can be taken again");
}

#[test]
fn a_texture_table_holds_what_the_device_binds_and_no_more() {
    let context = TestContext::new();
    let table = |pairs: &[(usize, usize)]| {
        let image = context.image(&TEXEL)?;
        let sampler = context.sampler("test/sampler", SamplerDescription::NEAREST_CLAMP)?;
        context.texture_table(vec![image], vec![sampler], pairs)
    };
    let allowed = context.limits().textures as usize;
    assert!(table(&[]).is_ok(), "a scene without textures has a table too");
    assert!(table(&vec![(0, 0); allowed]).is_ok());
    let message = table(&vec![(0, 0); allowed + 1]).err().unwrap().to_string();
    assert!(message.contains(&(allowed + 1).to_string()) && message.contains(&allowed.to_string()), "{message}");
    for wrong in [(1, 0), (0, 1)] {
        let message = table(&[(0, 0), wrong]).err().unwrap().to_string();
        assert!(message.contains("texture 1"), "{message}");
    }
}
