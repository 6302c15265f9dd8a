//! `atlas/light_rays`, `atlas/light_irradiance` and `atlas/environment_rays` against plain loops over texels.

use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use crate::environment_irradiance::{basis_of, cosine_hemisphere};
use glam::{UVec4, Vec2, Vec3};
use linklight::gpu::shaders::atlas::{
    EnvironmentRays, EnvironmentRaysParams, LightIrradiance, LightIrradianceParams, LightRays, LightRaysParams,
};
use linklight::gpu::shaders::types::{AtlasTexel, Light, Ray};

const OFFSET: f32 = 1e-3;
/// Some tens of roundings of numbers near 1; a spot's edge multiplies them by its scale.
const TOLERANCE: Tolerance = Tolerance { absolute: 2e-5, relative: 2e-5 };
const POINT: u32 = 0;
const SPOT: u32 = 1;
const DIRECTIONAL: u32 = 2;

fn unit(random: &mut Random) -> Vec3 {
    (Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0 + 1e-3).normalize()
}

fn texels(random: &mut Random, count: usize) -> Vec<AtlasTexel> {
    let texel = |_| {
        let normal = unit(random);
        let (u, v) = normal.any_orthonormal_pair();
        let position = Vec3::new(random.unit(), random.unit(), random.unit());
        AtlasTexel { position, normal, side_u: 0.1 * u, side_v: 0.2 * v, first_part: 0, part_count: 0, is_back: 0 }
    };
    (0..count).map(texel).collect()
}

fn lights(random: &mut Random) -> Vec<Light> {
    let light = |kind| Light {
        position: Vec3::new(2.0, 1.5, 0.5) * random.unit(),
        kind,
        direction: unit(random),
        range: if kind == POINT { 2.5 } else { 0.0 },
        intensity: Vec3::new(1.0, 2.0, 0.5),
        spot_scale: 2.0,
        spot_offset: 0.4,
    };
    [POINT, SPOT, DIRECTIONAL].map(light).to_vec()
}

fn point(texel: &AtlasTexel, k: u32) -> Vec3 {
    let u = (Vec2::splat(0.5) + k as f32 * Vec2::new(0.754_877_7, 0.569_840_3)).fract() - 0.5;
    texel.position + u.x * texel.side_u + u.y * texel.side_v
}

/// What arrives at a point that faces the light, towards it, and how far it is.
fn arriving(light: &Light, point: Vec3) -> (Vec3, Vec3, f32) {
    if light.kind == DIRECTIONAL {
        return (light.intensity, -light.direction, 1e30);
    }
    let offset = light.position - point;
    let distance = offset.length();
    let in_range = if light.range > 0.0 { (1.0 - (distance / light.range).powi(4)).clamp(0.0, 1.0) } else { 1.0 };
    let cosine = light.direction.dot(-offset / distance);
    let cone = (cosine * light.spot_scale + light.spot_offset).clamp(0.0, 1.0).powi(2);
    let falloff = in_range * if light.kind == SPOT { cone } else { 1.0 };
    (light.intensity * falloff / (distance * distance), offset / distance, distance)
}

fn ray_to(light: &Light, texel: &AtlasTexel, k: u32) -> Ray {
    let origin = point(texel, k) + OFFSET * texel.normal;
    let (_, direction, distance) = arriving(light, origin);
    let t_max = if texel.normal.dot(direction) > 0.0 { distance } else { -1.0 };
    Ray { origin, t_min: 0.0, direction, t_max }
}

#[test]
fn texels_are_lit_as_plain_loops_light_them() {
    let context = TestContext::new();
    let random = &mut Random(63);
    let lights = lights(random);
    let (first_texel, sample_count) = (3, 5);
    for batch_count in [1u32, 13, 64] {
        // Those after the batch stay dark.
        let texels = texels(random, (first_texel + batch_count + 70) as usize);
        let free: Vec<u32> = (0..batch_count * sample_count).map(|_| u32::from(random.below(4) > 0)).collect();
        let (texel_buffer, light_buffer) =
            (context.upload("test/texels", &texels).unwrap(), context.upload("test/lights", &lights).unwrap());
        let is_free = context.upload("test/is free", &free).unwrap();
        for (light, of) in lights.iter().enumerate() {
            let before = Vec3::new(0.1, 0.2, 0.3);
            let rays = context.buffer::<Ray>("test/rays", free.len()).unwrap();
            let irradiance = context.upload("test/irradiance", &vec![before; texels.len()]).unwrap();
            let light = light as u32;
            let mut recorder = context.recorder("test").unwrap();
            let params = LightRaysParams { first_texel, batch_count, sample_count, light, ray_offset: OFFSET };
            recorder
                .dispatch(&LightRays { texels: &texel_buffer, lights: &light_buffer, rays: &rays, params }, free.len());
            let params = LightIrradianceParams { first_texel, batch_count, sample_count, light };
            let (texel_table, light_table) = (&texel_buffer, &light_buffer);
            let pass = LightIrradiance {
                texels: texel_table,
                lights: light_table,
                rays: &rays,
                is_free: &is_free,
                irradiance: &irradiance,
                params,
            };
            recorder.dispatch(&pass, batch_count);
            recorder.submit().unwrap();

            let of_batch = &texels[first_texel as usize..][..batch_count as usize];
            let twin = |of: &Light| -> Vec<Ray> {
                of_batch.iter().flat_map(|texel| (0..sample_count).map(|k| ray_to(of, texel, k))).collect()
            };
            let expected = twin(of);
            hold(&format!("rays to light {light}"), &context.download(&rays).unwrap(), &expected, TOLERANCE);
            let other = &lights[(light as usize + 1) % lights.len()];
            tells_apart("rays to another light", &twin(other), &expected, TOLERANCE);

            let lit = |free: &[u32]| -> Vec<Vec3> {
                let mut lit = vec![before; texels.len()];
                for (index, (texel, rays)) in of_batch.iter().zip(expected.chunks(sample_count as usize)).enumerate() {
                    for (ray, &free) in rays.iter().zip(&free[index * sample_count as usize..]) {
                        let (light, towards, _) = arriving(of, ray.origin);
                        if ray.t_max >= 0.0 && free != 0 {
                            lit[first_texel as usize + index] +=
                                light * texel.normal.dot(towards) / sample_count as f32;
                        }
                    }
                }
                lit
            };
            let got = context.download(&irradiance).unwrap();
            hold(&format!("light {light}"), &got, &lit(&free), TOLERANCE);
            if batch_count == 64 {
                tells_apart("blocked rays", &lit(&vec![1; free.len()]), &lit(&free), TOLERANCE);
            }
        }
    }
}

pub fn pcg4d(v: UVec4) -> UVec4 {
    let mut v = v.to_array().map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mix = |v: &mut [u32; 4]| {
        for [to, a, b] in [[0, 1, 3], [1, 2, 0], [2, 0, 1], [3, 1, 2]] {
            v[to] = v[to].wrapping_add(v[a].wrapping_mul(v[b]));
        }
    };
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    UVec4::from(v)
}

/// Owen's scrambling.                                                                          [Burley2020 Listing 2]
fn scrambled(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul(seed >> 16 | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// A point of Sobol's first two dimensions, shuffled.
pub fn even_point(index: u32, seeds: UVec4) -> Vec2 {
    let index = scrambled(index, seeds.x);
    let (mut second, mut column) = (0, 0x8000_0000u32);
    for bit in 0..32 {
        second ^= if index >> bit & 1 == 1 { column } else { 0 };
        column ^= column >> 1;
    }
    let words = [scrambled(index.reverse_bits(), seeds.y), scrambled(second, seeds.z)];
    Vec2::from(words.map(|word| (word >> 8) as f32 / 16_777_216.0))
}

#[test]
fn rays_to_the_environment_are_those_of_plain_loops() {
    let context = TestContext::new();
    let random = &mut Random(64);
    let (first_texel, batch_count, sample_count) = (2, 21, 6);
    let texels = texels(random, (first_texel + batch_count) as usize);
    let texel_buffer = context.upload("test/texels", &texels).unwrap();
    let rays = context.buffer::<Ray>("test/rays", (batch_count * sample_count) as usize).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = EnvironmentRaysParams { first_texel, batch_count, sample_count, ray_offset: OFFSET };
    recorder.dispatch(&EnvironmentRays { texels: &texel_buffer, rays: &rays, params }, batch_count * sample_count);
    recorder.submit().unwrap();
    let twin = |shift: u32| -> Vec<Ray> {
        let ray = |index: u32, k: u32| {
            let texel = &texels[index as usize];
            let u = even_point(k, pcg4d(UVec4::new(index + shift, 0, 0, 0)));
            let direction = basis_of(texel.normal) * cosine_hemisphere(u);
            Ray { origin: point(texel, k) + OFFSET * texel.normal, t_min: 0.0, direction, t_max: 3e38 }
        };
        (first_texel..first_texel + batch_count)
            .flat_map(|index| (0..sample_count).map(move |k| ray(index, k)))
            .collect()
    };
    hold("rays", &context.download(&rays).unwrap(), &twin(0), TOLERANCE);
    tells_apart("another texel's directions", &twin(1), &twin(0), TOLERANCE);
}
