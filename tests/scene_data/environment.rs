//! Orientation, sampling densities against statistics, loading of good and bad files.

use std::f32::consts::{FRAC_PI_2, PI};
use std::path::Path;

use glam::{Quat, Vec2, Vec3, vec2};
use linklight::scene::environment::load::{EnvironmentError, EnvironmentLimits, EnvironmentSource, MAX_RADIANCE, load};
use linklight::scene::environment::sampling::EnvironmentSampler;
use linklight::scene::environment::{Environment, EnvironmentMap};
use proptest::prelude::*;

use crate::made::assert_near;

/// A dim gradient with one very bright texel, some black ones and colour.
fn map(width: u32, height: u32, rotation: f32) -> EnvironmentMap {
    let texel = |index: u32| {
        let (x, y) = (index % width, index / width);
        if (x, y) == (width / 3, height / 4) {
            Vec3::new(200.0, 180.0, 90.0)
        } else if x < width / 8 {
            Vec3::ZERO
        } else {
            Vec3::new(0.1 + x as f32 / width as f32, 0.3, 0.5 + y as f32 / height as f32)
        }
    };
    EnvironmentMap { width, height, texels: (0..width * height).map(texel).collect(), rotation }
}

/// Directions evenly spread over the sphere.
fn fibonacci_sphere(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |index| {
        let y = 1.0 - (2 * index + 1) as f32 / count as f32;
        let angle = (f64::from(index) * 2.399_963_229_728_653) as f32;
        let radius = (1.0 - y * y).sqrt();
        Vec3::new(radius * angle.cos(), y, radius * angle.sin())
    })
}

/// Independent numbers in 0..1 (SplitMix64).
fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

fn random_pair(state: &mut u64) -> Vec2 {
    vec2(random(state), random(state))
}

#[test]
fn the_middle_looks_along_x_and_right_goes_to_z() {
    let map = map(8, 4, 0.0);
    assert_near(map.direction_of(vec2(0.5, 0.5)), Vec3::X, 1e-6);
    assert_near(map.direction_of(vec2(0.75, 0.5)), Vec3::Z, 1e-6);
    assert_near(map.direction_of(vec2(0.5, 0.0)), Vec3::Y, 1e-6);
    let turned = EnvironmentMap { rotation: FRAC_PI_2, ..map };
    assert_near(turned.direction_of(vec2(0.5, 0.5)), Quat::from_rotation_y(FRAC_PI_2) * Vec3::X, 1e-6);
}

#[test]
fn radiance_is_exact_at_texel_centres_and_wraps_at_the_seam() {
    let map = map(16, 8, 1.0);
    for y in 0..8 {
        for x in 0..16 {
            let centre = vec2((x as f32 + 0.5) / 16.0, (y as f32 + 0.5) / 8.0);
            let texel = map.texels[y * 16 + x];
            assert_near(map.radiance(map.direction_of(centre)), texel, 2e-3 * texel.max_element().max(1.0));
        }
    }
    let seam = map.radiance(map.direction_of(vec2(0.0, 2.5 / 8.0)));
    assert_near(seam, (map.texels[2 * 16] + map.texels[2 * 16 + 15]) / 2.0, 1e-3);
}

#[test]
fn density_integrates_to_one_and_covers_all_light() {
    // 4096 x 1100 is sampled by blocks, the last of them partial.
    for (width, height) in [(1, 1), (16, 8), (37, 19), (4096, 1100)] {
        let environment = Environment::Map(map(width, height, 0.7));
        let sampler = EnvironmentSampler::new(&environment);
        let count = 400_000;
        let mut integral = 0.0;
        for direction in fibonacci_sphere(count) {
            let density = sampler.density(&environment, direction);
            integral += f64::from(density) * 4.0 * f64::from(PI) / f64::from(count);
            let dark = environment.radiance(direction).max_element() < 1e-4;
            assert!(density > 0.0 || dark, "light from {direction} has density 0");
        }
        let tolerance = if width > 1000 { 2e-2 } else { 2e-3 };
        assert!((integral - 1.0).abs() < tolerance, "{width} x {height}: {integral}");
    }
}

/// Chi-square over cells of the sphere of drawn directions against `density`; returns (statistic, degrees of freedom).
fn chi_square(environment: &Environment, sampler: &EnvironmentSampler, distort: f32) -> (f64, f64) {
    let Environment::Map(map) = environment else { panic!("a map is tested") };
    let (columns, rows, draws) = (map.width, map.height, 200_000);
    let mut seen = vec![0u32; (columns * rows) as usize];
    let mut state = 7;
    for _ in 0..draws {
        let mut choose = random_pair(&mut state);
        choose.y = (choose.y + distort).min(0.999);
        let drawn = sampler.sample(environment, choose, random_pair(&mut state));
        assert!((drawn.direction.length() - 1.0).abs() < 1e-5);
        let uv = map.uv_of(drawn.direction);
        let cell = (uv.y * rows as f32) as u32 * columns + ((uv.x * columns as f32) as u32).min(columns - 1);
        seen[cell as usize] += 1;
    }
    let (mut statistic, mut freedom) = (0.0, -1.0);
    for row in 0..rows {
        let [upper, lower] = [row, row + 1].map(|row| (f64::from(row) / f64::from(rows) * f64::from(PI)).cos());
        let solid_angle = 2.0 * f64::from(PI) / f64::from(columns) * (upper - lower);
        for column in 0..columns {
            let centre = vec2((column as f32 + 0.5) / columns as f32, (row as f32 + 0.5) / rows as f32);
            let density = f64::from(sampler.density(environment, map.direction_of(centre)));
            let expected = density * solid_angle * f64::from(draws);
            let count = f64::from(seen[(row * columns + column) as usize]);
            if expected > 5.0 {
                statistic += (count - expected).powi(2) / expected;
                freedom += 1.0;
            }
        }
    }
    (statistic, freedom)
}

#[test]
fn drawn_directions_follow_the_density() {
    let environment = Environment::Map(map(24, 12, 0.3));
    let sampler = EnvironmentSampler::new(&environment);
    let (statistic, freedom) = chi_square(&environment, &sampler, 0.0);
    // Mean `freedom`, variance 2 `freedom`: five standard deviations.
    let limit = freedom + 5.0 * (2.0 * freedom).sqrt();
    assert!(freedom > 200.0 && statistic < limit, "chi-square {statistic} for {freedom}");
    // The test can fail: a slightly wrong coin is seen.
    let (distorted, _) = chi_square(&environment, &sampler, 0.05);
    assert!(distorted > limit, "chi-square {distorted} of a distorted sampler is not seen");
}

#[test]
fn the_estimator_is_unbiased_with_low_variance() {
    let environment = Environment::Map(map(64, 32, 0.0));
    let sampler = EnvironmentSampler::new(&environment);
    let count = 2_000_000;
    let exact = fibonacci_sphere(count).map(|d| environment.radiance(d).as_dvec3()).sum::<glam::DVec3>()
        * (4.0 * f64::from(PI) / f64::from(count));
    let (mut state, draws) = (1, 100_000);
    let mut sum = glam::DVec3::ZERO;
    for _ in 0..draws {
        let drawn = sampler.sample(&environment, random_pair(&mut state), random_pair(&mut state));
        sum += environment.radiance(drawn.direction).as_dvec3() / f64::from(drawn.density);
    }
    let error = (sum / f64::from(draws) / exact - 1.0).abs().max_element();
    assert!(error < 0.01, "relative error {error}");
}

#[test]
fn a_constant_is_exact_and_a_black_map_is_uniform() {
    let constant = Environment::Constant(Vec3::new(0.25, 0.5, 1.0));
    let black = EnvironmentMap { width: 8, height: 4, texels: vec![Vec3::ZERO; 32], rotation: 0.0 };
    assert!(Environment::default().is_black() && !constant.is_black());
    for environment in [constant, Environment::Map(black)] {
        let sampler = EnvironmentSampler::new(&environment);
        let (mut state, mut sum) = (3, Vec3::ZERO);
        for _ in 0..10_000 {
            let drawn = sampler.sample(&environment, random_pair(&mut state), random_pair(&mut state));
            assert!((drawn.density * 4.0 * PI - 1.0).abs() < 1e-5);
            assert_eq!(drawn.density, sampler.density(&environment, drawn.direction));
            sum += drawn.direction;
        }
        assert!((sum / 10_000.0).length() < 0.03, "directions lean to {sum}");
    }
}

fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, EnvironmentSource) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, EnvironmentSource::File(path))
}

fn hdr_bytes(width: usize, texels: &[Vec3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels: Vec<image::Rgb<f32>> = texels.iter().map(|texel| image::Rgb(texel.to_array())).collect();
    image::codecs::hdr::HdrEncoder::new(&mut bytes).encode(&pixels, width, texels.len() / width).unwrap();
    bytes
}

fn exr_bytes(width: usize, texels: &[Vec3]) -> Vec<u8> {
    use exr::prelude::*;
    let channels = SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
        let texel = texels[at.y() * width + at.x()];
        (texel.x, texel.y, texel.z)
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = Image::from_channels((width, texels.len() / width), channels);
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn both_formats_load_what_was_written() {
    let texels: Vec<Vec3> = (0..32).map(|index| Vec3::new(index as f32, 0.5, 2.0)).collect();
    let (_folder, source) = written("a.exr", &exr_bytes(8, &texels));
    let loaded = load(&source, 0.5, &EnvironmentLimits::default()).unwrap();
    let expected = EnvironmentMap { width: 8, height: 4, texels: texels.clone(), rotation: 0.5 };
    assert_eq!(loaded.environment, Environment::Map(expected));
    assert!(loaded.notes.is_empty());

    // The name's ending does not matter.
    let (_folder, source) = written("a.picture", &hdr_bytes(8, &texels));
    let Environment::Map(map) = load(&source, 0.0, &EnvironmentLimits::default()).unwrap().environment else {
        panic!("a file is a map")
    };
    for (read, written) in map.texels.iter().zip(&texels) {
        // Eight bits of the largest channel.
        assert_near(*read, *written, written.max_element() / 128.0);
    }
    // Stated exposure is divided out.
    let mut exposed = hdr_bytes(8, &texels);
    let line_end = exposed.iter().position(|&byte| byte == b'\n').unwrap() + 1;
    exposed.splice(line_end..line_end, *b"EXPOSURE=2.0\n");
    let (_folder, source) = written("b.hdr", &exposed);
    let loaded = load(&source, 0.0, &EnvironmentLimits::default()).unwrap();
    let Environment::Map(half) = loaded.environment else { panic!("a file is a map") };
    assert_eq!(half.texels[5], map.texels[5] / 2.0);
    assert_eq!(loaded.notes.len(), 1);
}

#[test]
fn texels_that_are_no_radiance_are_repaired_and_counted() {
    let texels = [f32::NAN, -1.0, f32::INFINITY, 1.0].map(Vec3::splat);
    let (_folder, source) = written("a.exr", &exr_bytes(2, &texels));
    let loaded = load(&source, 0.0, &EnvironmentLimits::default()).unwrap();
    let Environment::Map(map) = loaded.environment else { panic!("a file is a map") };
    assert_eq!(map.texels, [0.0, 0.0, MAX_RADIANCE, 1.0].map(Vec3::splat));
    assert!(loaded.notes.len() == 1 && loaded.notes[0].contains("3 texels"), "{:?}", loaded.notes);
}

#[test]
fn size_is_refused_from_the_header() {
    let texels = vec![Vec3::ONE; 64];
    for bytes in [exr_bytes(16, &texels), hdr_bytes(16, &texels)] {
        let (_folder, source) = written("a", &bytes);
        let small = EnvironmentLimits { max_extent: 15, ..Default::default() };
        let error = load(&source, 0.0, &small).unwrap_err();
        assert!(matches!(error, EnvironmentError::Extent { width: 16, height: 4, allowed: 15, .. }), "{error}");
        let poor = EnvironmentLimits { max_memory_bytes: bytes.len() as u64 + 100, ..Default::default() };
        assert!(matches!(load(&source, 0.0, &poor).unwrap_err(), EnvironmentError::OutOfMemory { .. }));
        let poorer = EnvironmentLimits { max_memory_bytes: 10, ..Default::default() };
        assert!(matches!(load(&source, 0.0, &poorer).unwrap_err(), EnvironmentError::OutOfMemory { .. }));
    }
    let (_folder, source) = written("a.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 16000\nxx");
    let error = load(&source, 0.0, &EnvironmentLimits::default()).unwrap_err();
    assert!(matches!(error, EnvironmentError::OutOfMemory { .. } | EnvironmentError::Decode { .. }), "{error}");
}

#[test]
fn constants_and_files_are_told_apart() {
    let parse = |text: &str| text.parse::<EnvironmentSource>();
    assert_eq!(parse("1,2.5, 0").unwrap(), EnvironmentSource::Constant(Vec3::new(1.0, 2.5, 0.0)));
    assert_eq!(parse("a,b.hdr").unwrap(), EnvironmentSource::File("a,b.hdr".into()));
    for bad in ["", "1,2", "1,2,3,4", "-1,0,0", "nan,0,0", "inf,0,0", "1e30,0,0"] {
        assert!(matches!(parse(bad), Err(EnvironmentError::Constant { .. })), "{bad}");
    }
    let missing = EnvironmentSource::File("no/such/file.hdr".into());
    assert!(matches!(load(&missing, 0.0, &EnvironmentLimits::default()), Err(EnvironmentError::Read { .. })));
    let folder = EnvironmentSource::File(std::env::temp_dir());
    assert!(load(&folder, 0.0, &EnvironmentLimits::default()).is_err());
    let (_folder, text) = written("a.hdr", b"hello");
    assert!(matches!(load(&text, 0.0, &EnvironmentLimits::default()), Err(EnvironmentError::UnknownFormat { .. })));
}

#[test]
fn real_maps_load_when_they_are_there() {
    let shared = std::env::var("LINKLIGHT_SHARED")
        .map_or_else(|_| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"), Into::into);
    let path = shared.join("scenes/hdr/venice_sunset_1k.hdr");
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return;
    }
    let loaded = load(&EnvironmentSource::File(path), 0.0, &EnvironmentLimits::default()).unwrap();
    let Environment::Map(map) = &loaded.environment else { panic!("a file is a map") };
    assert_eq!((map.width, map.height, loaded.notes.len()), (1024, 512, 0));
    // A sky: brighter above than below.
    let half = map.texels.len() / 2;
    let sum = |texels: &[Vec3]| texels.iter().map(|texel| texel.element_sum()).sum::<f32>();
    assert!(sum(&map.texels[..half]) > sum(&map.texels[half..]));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn damaged_files_end_in_an_error_or_a_map(
        exr in any::<bool>(),
        keep in 0.0f64..1.2,
        changes in prop::collection::vec((0.0f64..1.0, any::<u8>()), 0..6),
    ) {
        let texels: Vec<Vec3> = (0..128).map(|index| Vec3::splat(index as f32)).collect();
        let mut bytes = if exr { exr_bytes(16, &texels) } else { hdr_bytes(16, &texels) };
        for (at, value) in changes {
            let at = (at * bytes.len() as f64) as usize;
            bytes[at] = value;
        }
        bytes.truncate((keep * bytes.len() as f64) as usize);
        let (_folder, source) = written("a", &bytes);
        let limits = EnvironmentLimits { max_extent: 4096, max_memory_bytes: 64 << 20 };
        if let Ok(loaded) = load(&source, 0.0, &limits) {
            let Environment::Map(map) = loaded.environment else { panic!("a file is a map") };
            prop_assert_eq!(map.texels.len() as u32, map.width * map.height);
            prop_assert!(map.texels.iter().all(|texel| texel.is_finite() && texel.min_element() >= 0.0));
        }
    }
}
