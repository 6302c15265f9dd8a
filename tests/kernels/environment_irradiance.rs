//! `methods/explicit_visibility/environment_irradiance` and `lib/environment.glsl` against `scene::environment`.

use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use glam::{Mat3, Vec2, Vec3};
use linklight::gpu::shaders::methods::explicit_visibility::{EnvironmentIrradiance, EnvironmentIrradianceParams};
use linklight::gpu::{Context, Sampled};
use linklight::scene::environment::{Environment, EnvironmentMap};
use linklight::stages::world::WorldEnvironment;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Software drivers compute sine, arc tangent and arc cosine to some 1e-4: a thousandth of a texel here, where
/// neighbouring texels differ by at most 1.
const TOLERANCE: Tolerance = Tolerance { absolute: 2e-3, relative: 0.0 };

fn vector(random: &mut Random) -> Vec3 {
    Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0
}

fn map(width: u32, height: u32, rotation: f32, random: &mut Random) -> Environment {
    let texels = (0..width * height).map(|_| Vec3::new(random.unit(), random.unit(), random.unit())).collect();
    Environment::Map(EnvironmentMap { width, height, texels, rotation })
}

/// Two hashes in 0..1 of an element's index: pcg2d.
fn element_shift(element: u32) -> Vec2 {
    let step = |v: u32| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let (mut x, mut y) = (step(element), step(element ^ 0x9e37_79b9));
    for _ in 0..2 {
        x = x.wrapping_add(y.wrapping_mul(1_664_525));
        y = y.wrapping_add(x.wrapping_mul(1_664_525));
        x ^= x >> 16;
        y ^= y >> 16;
    }
    Vec2::new((x >> 8) as f32, (y >> 8) as f32) / 16_777_216.0
}

/// Square to hemisphere about +z, cosine-weighted.                                  [Shirley1997]
pub fn cosine_hemisphere(square: Vec2) -> Vec3 {
    let p = 2.0 * square - 1.0;
    let (radius, angle) = match p {
        Vec2::ZERO => return Vec3::Z,
        _ if p.x.abs() > p.y.abs() => (p.x, FRAC_PI_4 * (p.y / p.x)),
        _ => (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y)),
    };
    let disc = radius * Vec2::from_angle(angle);
    disc.extend((1.0 - disc.length_squared()).max(0.0).sqrt())
}

fn element_ray(ray: u32, side: u32, shift: Vec2) -> Vec3 {
    let (block, blocks) = (ray / 16, side / 4);
    let cell = Vec2::new((block % blocks * 4 + ray % 4) as f32, (block / blocks * 4 + ray / 4 % 4) as f32);
    cosine_hemisphere(((cell + 0.5) / side as f32 + shift).fract())
}

/// Orthonormal, the normal last.                                                    [Duff2017]
pub fn basis_of(n: Vec3) -> Mat3 {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    Mat3::from_cols(Vec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x), Vec3::new(b, s + n.y * n.y * a, -n.y), n)
}

/// The twin.
fn environment_irradiance(
    normals: &[Vec3],
    escaped: &[u32],
    environment: &Environment,
    side: u32,
    is_rotated: bool,
) -> Vec<Vec3> {
    let words = ((side * side) as usize).div_ceil(32);
    let element = |(element, &normal): (usize, &Vec3)| {
        let basis = basis_of(normal);
        let shift = if is_rotated { element_shift(element as u32) } else { Vec2::ZERO };
        let mut sum = Vec3::ZERO;
        for ray in 0..side * side {
            if escaped[element * words + ray as usize / 32] >> (ray % 32) & 1 == 1 {
                sum += environment.radiance((basis * element_ray(ray, side, shift)).normalize());
            }
        }
        sum * (PI / (side * side) as f32)
    };
    normals.iter().enumerate().map(element).collect()
}

struct Case {
    normals: Vec<Vec3>,
    escaped: Vec<u32>,
    side: u32,
    is_rotated: bool,
}

impl Case {
    fn new(element_count: usize, side: u32, is_rotated: bool, random: &mut Random) -> Self {
        let mut normals: Vec<Vec3> = (0..element_count).map(|_| vector(random).normalize()).collect();
        // Along the axes, where the basis turns over and the map has its poles and its seam.
        let axes = [Vec3::Y, Vec3::NEG_Y, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z];
        normals.iter_mut().zip(axes).for_each(|(normal, axis)| *normal = axis);
        let words = (side * side).div_ceil(32);
        let last_bits = (side * side - 1) % 32;
        let word = |index: u32, random: &mut Random| {
            let bits = random.next_u64() as u32;
            if index + 1 == words { bits & (u32::MAX >> (31 - last_bits)) } else { bits }
        };
        let escaped = (0..element_count as u32 * words).map(|i| word(i % words, random)).collect();
        Self { normals, escaped, side, is_rotated }
    }

    fn on_device(&self, context: &Context, environment: &Environment) -> Vec<Vec3> {
        let tables = WorldEnvironment::new(context, environment).unwrap();
        let irradiance = context.buffer("test/irradiance", self.normals.len()).unwrap();
        let pass = EnvironmentIrradiance {
            element_normals: &context.upload("test/normals", &self.normals).unwrap(),
            escaped: &context.upload("test/escaped", &self.escaped).unwrap(),
            environment_info: &tables.info_buffer,
            environment_map: Sampled { image: &tables.map, sampler: &tables.sampler },
            irradiance: &irradiance,
            params: EnvironmentIrradianceParams {
                element_count: self.normals.len() as u32,
                side: self.side,
                is_rotated: self.is_rotated.into(),
            },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&pass, self.normals.len());
        recorder.submit().unwrap();
        context.download(&irradiance).unwrap()
    }

    fn twin(&self, environment: &Environment) -> Vec<Vec3> {
        environment_irradiance(&self.normals, &self.escaped, environment, self.side, self.is_rotated)
    }
}

#[test]
fn environment_irradiance_agrees_with_its_twin() {
    let context = TestContext::new();
    let random = &mut Random(21);
    let constant = Environment::Constant(Vec3::new(0.25, 0.5, 1.0));
    for (element_count, side) in [(0, 4), (1, 4), (63, 12), (64, 8), (65, 20), (251, 8)] {
        for (rotation, is_rotated) in [(0.0, false), (1.0, true), (-2.5, true)] {
            let case = Case::new(element_count, side, is_rotated, random);
            let map = map(16, 8, rotation, random);
            let what = format!("{element_count} elements of {side} x {side} rays, a map turned by {rotation}");
            hold(&what, &case.on_device(&context, &map), &case.twin(&map), TOLERANCE);
            let what = format!("{element_count} elements under a constant");
            hold(&what, &case.on_device(&context, &constant), &case.twin(&constant), Tolerance::absolute(1e-5));
        }
    }
}

/// Odd maps: one texel, one column, one row, and sizes that do not divide.
#[test]
fn maps_of_any_shape_agree_with_the_twin() {
    let context = TestContext::new();
    let random = &mut Random(22);
    let case = Case::new(65, 8, false, random);
    for (width, height) in [(1, 1), (1, 7), (5, 1), (7, 3)] {
        let map = map(width, height, 0.7, random);
        hold(&format!("{width} x {height}"), &case.on_device(&context, &map), &case.twin(&map), TOLERANCE);
    }
}

#[test]
fn what_the_twin_is_given_matters() {
    let random = &mut Random(23);
    let case = Case::new(251, 8, true, random);
    let Environment::Map(map) = map(16, 8, 1.0, random) else { unreachable!("made as a map") };
    let expected = case.twin(&Environment::Map(map.clone()));
    let turned = Environment::Map(EnvironmentMap { rotation: 1.05, ..map.clone() });
    tells_apart("a map turned by three degrees more", &case.twin(&turned), &expected, TOLERANCE);
    let mirrored = EnvironmentMap { texels: map.texels.iter().rev().copied().collect(), ..map.clone() };
    tells_apart("a map upside down", &case.twin(&Environment::Map(mirrored)), &expected, TOLERANCE);
    let unshifted = Case { is_rotated: false, ..case };
    tells_apart("rays without their shift", &unshifted.twin(&Environment::Map(map)), &expected, TOLERANCE);
}

/// All rays free under light from everywhere: pi times the radiance, whatever the normal.
#[test]
fn an_open_sky_gives_pi_times_its_radiance() {
    let context = TestContext::new();
    let mut case = Case::new(65, 16, true, &mut Random(24));
    case.escaped.fill(u32::MAX);
    let white = vec![Vec3::ONE; 32 * 16];
    let map = Environment::Map(EnvironmentMap { width: 32, height: 16, texels: white, rotation: 0.3 });
    for environment in [map, Environment::Constant(Vec3::ONE)] {
        // 256 sums of 1.
        hold("open sky", &case.on_device(&context, &environment), &[Vec3::splat(PI); 65], Tolerance::absolute(2e-5));
    }
}
