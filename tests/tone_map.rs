//! Tone mapping on the device against its twin, `report::tonemap`.

mod common;

use common::{Random, TestContext};
use glam::{UVec2, Vec3};
use linklight::display::tone_map::{LightParts, ToneMapping};
use linklight::gpu::{Context, Format, ImageDescription, Shape};
use linklight::report::tonemap::{Operator, ToneSettings, log_average_luminance};
use linklight::stages::film::Film;

/// Bytes may differ by one: logarithms and powers of the device are its own.
const BYTE_TOLERANCE: u8 = 1;

/// Radiance over nine orders of magnitude, with black, NaN and infinite pixels in it.
fn radiance(count: usize, seed: u64) -> Vec<Vec3> {
    let mut random = Random(seed);
    let mut value = move || (random.unit() * 20.0 - 13.0).exp();
    let mut pixels: Vec<Vec3> = (0..count).map(|_| Vec3::new(value(), value(), value())).collect();
    for (i, odd) in [Vec3::ZERO, Vec3::new(1.0, f32::NAN, 0.0), Vec3::splat(f32::INFINITY)].into_iter().enumerate() {
        if let Some(pixel) = pixels.get_mut(5 * i + 3) {
            *pixel = odd;
        }
    }
    pixels
}

fn film(context: &Context, size: UVec2, direct: &[Vec3], indirect: &[Vec3]) -> Film {
    let film = Film::new(context, size.x, size.y).unwrap();
    context.write(&film.direct, direct).unwrap();
    context.write(&film.indirect, indirect).unwrap();
    film
}

/// The frame's RGB after drawing the film at `corner`, and the average.
fn drawn(
    context: &Context,
    film: &Film,
    parts: LightParts,
    tone: ToneSettings,
    frame_size: UVec2,
    corner: UVec2,
) -> (Vec<[u8; 4]>, f32) {
    let frame = context
        .image(&ImageDescription {
            name: "test/frame",
            width: frame_size.x,
            height: frame_size.y,
            layers: 1,
            mip_levels: 1,
            format: Format::Rgba8,
            shape: Shape::Flat,
        })
        .unwrap();
    let mapping = ToneMapping::new(context, film.pixel_count()).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.clear_image(&frame, [0.2, 0.4, 0.6, 1.0]);
    mapping.draw(&mut recorder, film, parts, tone, &frame, corner);
    recorder.submit().unwrap();
    (context.download_image(&frame, 0).unwrap(), mapping.log_average(context).unwrap())
}

fn worst(shown: &[[u8; 4]], twin: &[u8]) -> u8 {
    assert_eq!(3 * shown.len(), twin.len());
    let pairs = shown.iter().flat_map(|pixel| &pixel[..3]).zip(twin);
    pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap()
}

#[test]
fn every_operator_and_light_agrees_with_the_twin() {
    let context = TestContext::new();
    for (size, seed) in [(UVec2::new(1, 1), 1), (UVec2::new(63, 65), 2), (UVec2::new(131, 127), 3)] {
        let count = (size.x * size.y) as usize;
        let (direct, indirect) = (radiance(count, seed), radiance(count, seed + 10));
        let film = film(&context, size, &direct, &indirect);
        for operator in [Operator::Reinhard, Operator::Filmic, Operator::None] {
            for (parts, exposure) in
                [(LightParts::All, 0.0), (LightParts::DirectOnly, 1.5), (LightParts::IndirectOnly, -2.0)]
            {
                let tone = ToneSettings { operator, exposure, ..ToneSettings::default() };
                let rgb: Vec<Vec3> = match parts {
                    LightParts::All => direct.iter().zip(&indirect).map(|(&d, &i)| d + i).collect(),
                    LightParts::DirectOnly => direct.clone(),
                    LightParts::IndirectOnly => indirect.clone(),
                };
                let (shown, average) = drawn(&context, &film, parts, tone, size, UVec2::ZERO);
                let expected = log_average_luminance(&rgb);
                assert!((average / expected - 1.0).abs() < 1e-4, "{size}: average {average}, twin {expected}");
                let twin = tone.fit(&rgb).to_bytes(&rgb).bytes;
                let difference = worst(&shown, &twin);
                assert!(difference <= BYTE_TOLERANCE, "{size} {operator:?} {parts:?}: {difference} of 255");
                assert!(shown.iter().all(|pixel| pixel[3] == 255));
            }
        }
        // The comparator sees another operator, and another exposure.
        if count > 1 {
            let rgb: Vec<Vec3> = direct.iter().zip(&indirect).map(|(&d, &i)| d + i).collect();
            let tone = ToneSettings::default();
            let (shown, _) = drawn(&context, &film, LightParts::All, tone, size, UVec2::ZERO);
            for wrong in [ToneSettings { operator: Operator::Filmic, ..tone }, ToneSettings { exposure: 0.1, ..tone }] {
                assert!(worst(&shown, &wrong.fit(&rgb).to_bytes(&rgb).bytes) > BYTE_TOLERANCE, "{wrong:?}");
            }
        }
    }
}

#[test]
fn a_black_film_is_black_and_the_rest_of_the_frame_stays() {
    let context = TestContext::new();
    let size = UVec2::new(7, 5);
    let black = vec![Vec3::ZERO; 35];
    let film = film(&context, size, &black, &black);
    let (frame, corner) = (UVec2::new(12, 8), UVec2::new(9, 2));
    let (shown, average) = drawn(&context, &film, LightParts::All, ToneSettings::default(), frame, corner);
    assert_eq!(average, 0.0);
    for (i, pixel) in shown.iter().enumerate() {
        let at = UVec2::new(i as u32 % frame.x, i as u32 / frame.x);
        let is_inside = at.cmpge(corner).all() && at.cmplt(corner + size).all();
        let expected = if is_inside { [0, 0, 0, 255] } else { [51, 102, 153, 255] };
        assert_eq!(*pixel, expected, "{at}: what lies beyond the frame is cut off, what was there stays");
    }
}
