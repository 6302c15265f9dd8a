//! Pictures made by another program ("all bounces", one, two, none) against ours, at a quarter of their size.

use crate::render::{Set, mean, options};
use glam::{UVec2, Vec3};
use linklight::report::errors::compare;
use linklight::report::image::{self, Picture};
use linklight::report::tonemap::ToneSettings;
use linklight::scene::environment::Environment;
use linklight::scene::{LoadOptions, load};
use std::path::{Path, PathBuf};

/// Pixels a side of the compared pictures.
const SIZE: u32 = 64;

/// Inputs that stand beside the checkout.
fn shared() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let folder = std::env::var_os("LINKLIGHT_SHARED").map_or(beside, PathBuf::from);
    if !folder.join("references").is_dir() {
        println!("skipped: no reference pictures at {}", folder.display());
        return None;
    }
    Some(folder)
}

/// Averages square blocks of pixels.
fn shrunk(picture: &Picture, size: u32) -> Picture {
    let block = picture.width / size;
    let at = |x: u32, y: u32| picture.rgb[(y * picture.width + x) as usize];
    let average = |i: u32| {
        let (x, y) = (i % size * block, i / size * block);
        let values: Vec<Vec3> = (0..block * block).map(|k| at(x + k % block, y + k / block)).collect();
        mean(&values)
    };
    Picture::new(size, size, (0..size * size).map(average).collect()).unwrap()
}

fn agrees(scene: &str, reference: &str, bounces: u32, samples: u32) {
    let Some(shared) = shared() else { return };
    let scene = load(&shared.join("scenes").join(scene), &LoadOptions::default()).unwrap();
    let set = Set::new(scene, &Environment::default(), true);
    let view = set.view(Some("0"), UVec2::splat(SIZE));
    let rendered = set.render(&view, options(SIZE, bounces), samples);
    let picture = Picture::new(SIZE, SIZE, rendered.radiance()).unwrap();
    let theirs = image::read(&shared.join("references").join(reference)).unwrap();
    let theirs = shrunk(&theirs, SIZE);
    let figures = compare(&picture, &theirs, None, &ToneSettings::default()).unwrap().figures;
    println!(
        "{reference}: mean {:.5} for {:.5}, ratio {:.5}, relative MSE {:.2e}, own estimate {:?}",
        mean(&picture.rgb),
        mean(&theirs.rgb),
        figures.mean_ratio.unwrap(),
        figures.relative_mse.unwrap(),
        rendered.estimate.unwrap()
    );
    assert!((figures.mean_ratio.unwrap() - 1.0).abs() < 5e-3, "{reference}: {figures:?}");
}

#[test]
fn cornell_box_direct() {
    agrees("scenes/cornell_box.glb", "cornell_box_b0.exr", 0, 64);
}

#[test]
fn cornell_box_one_bounce() {
    agrees("scenes/cornell_box.glb", "cornell_box_b1.exr", 1, 64);
}

#[test]
fn cornell_box_two_bounces() {
    agrees("scenes/cornell_box.glb", "cornell_box_b2.exr", 2, 64);
}

#[test]
fn cornell_box_all_bounces() {
    agrees("scenes/cornell_box.glb", "cornell_box.exr", 16, 64);
}

#[test]
fn hotel_room_all_bounces() {
    agrees("scenes/hotel_room.glb", "hotel_room.exr", 24, 16);
}

#[test]
fn punctual_lights_of_three_types() {
    agrees("conformance/lights_punctual_three_types.glb", "lights_punctual_three_types.exr", 8, 64);
}
