//! Images of unusual sizes and shapes.

use crate::common::TestContext;
use linklight::gpu::{Format, GpuError, ImageDescription, Shape};

fn description(width: u32, height: u32, layers: u32, mip_levels: u32, shape: Shape) -> ImageDescription<'static> {
    ImageDescription { name: "test/image", width, height, layers, mip_levels, format: Format::Rgba32Float, shape }
}

/// Distinct small integers: exact in f32.
fn pixels(width: u32, height: u32, layer: u32) -> Vec<[f32; 4]> {
    (0..width * height).map(|i| [i as f32, layer as f32, (i % 7) as f32, 1.0]).collect()
}

#[test]
fn every_layer_of_unusual_images_comes_back() {
    let context = TestContext::new();
    let longest = context.limits().image_extent;
    let cases = [
        (1, 1, 1, 1, Shape::Flat),
        (3, 5, 1, 3, Shape::Flat),
        (longest, 1, 1, 1, Shape::Flat),
        (1, longest, 1, 1, Shape::Flat),
        (13, 7, 3, 4, Shape::Array),
        (5, 5, 12, 3, Shape::CubeArray),
    ];
    for (width, height, layers, mip_levels, shape) in cases {
        let image = context.image(&description(width, height, layers, mip_levels, shape)).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        for layer in 0..layers {
            recorder.write_image(&image, layer, &pixels(width, height, layer));
        }
        recorder.generate_mips(&image);
        recorder.submit().unwrap();
        for layer in 0..layers {
            let got = context.download_image::<[f32; 4]>(&image, layer).unwrap();
            assert!(got == pixels(width, height, layer), "{width} x {height}, layer {layer} of {layers}");
        }
    }
}

#[test]
fn impossible_images_are_refused_by_name() {
    let context = TestContext::new();
    let limits = context.limits();
    for (width, height, layers) in
        [(0, 4, 1), (4, 0, 1), (4, 4, 0), (limits.image_extent + 1, 1, 1), (1, 1, limits.image_layers + 1)]
    {
        match context.image(&description(width, height, layers, 1, Shape::Array)) {
            Err(GpuError::ImageExtent { name, .. }) => assert_eq!(name, "test/image"),
            other => panic!("{width} x {height} x {layers}: {:?}", other.map(|image| image.size_bytes())),
        }
    }
    for wrong in [
        description(4, 4, 1, 0, Shape::Flat),
        description(4, 4, 1, 4, Shape::Flat),
        description(4, 4, 2, 1, Shape::Flat),
        description(4, 4, 5, 1, Shape::CubeArray),
        description(4, 5, 6, 1, Shape::CubeArray),
    ] {
        let message = context.image(&wrong).err().unwrap().to_string();
        assert!(message.contains("test/image"), "{message}");
    }
}

#[test]
fn pixels_that_do_not_fill_a_layer_are_refused() {
    let context = TestContext::new();
    let image = context.image(&description(3, 2, 1, 1, Shape::Flat)).unwrap();
    for (layer, count) in [(0, 5), (0, 7), (1, 6)] {
        let mut recorder = context.recorder("test").unwrap();
        recorder.write_image(&image, layer, &vec![[0.0f32; 4]; count]);
        let message = recorder.submit().unwrap_err().to_string();
        assert!(message.contains("test/image") && message.contains("96 wanted"), "{message}");
    }
}
