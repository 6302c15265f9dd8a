//! The environment as distant emitters: each stands for a cell of the sphere with its mean radiance.

use crate::gpu::shaders::types::Light;
use crate::scene::environment::{Environment, EnvironmentMap};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// `LIGHT_DIRECTIONAL` of `lib/scene.glsl`.
const DIRECTIONAL: u32 = 2;

/// About `count` directional lights that shine as the environment does; none where it is black.
pub fn distant_emitters(environment: &Environment, count: u32) -> Vec<Light> {
    if environment.is_black() {
        return Vec::new();
    }
    let rows = ((count as f32 / 2.0).sqrt().round() as u32).max(2);
    let columns = 2 * rows;
    let grid = EnvironmentMap {
        width: columns,
        height: rows,
        texels: vec![Vec3::ZERO; (columns * rows) as usize],
        rotation: match environment {
            Environment::Map(map) => map.rotation,
            Environment::Constant(_) => 0.0,
        },
    };
    let averaged = environment.averaged(columns, rows);
    let exact = match &averaged {
        Environment::Map(map) if map.width == columns && map.height == rows => Some(&map.texels),
        _ => None,
    };
    let mut lights = Vec::new();
    for row in 0..rows {
        // The middle by solid angle, so that a row's emitters stand for all of it.
        let (upper, lower) = ((PI * row as f32 / rows as f32).cos(), (PI * (row + 1) as f32 / rows as f32).cos());
        let v = (0.5 * (upper + lower)).acos() / PI;
        let solid_angle = TAU / columns as f32 * (upper - lower);
        for column in 0..columns {
            let direction = grid.direction_of(Vec2::new((column as f32 + 0.5) / columns as f32, v));
            let radiance = match exact {
                Some(texels) => texels[(row * columns + column) as usize],
                None => averaged.radiance(direction),
            };
            lights.push(Light {
                position: Vec3::ZERO,
                kind: DIRECTIONAL,
                direction: -direction,
                range: 0.0,
                intensity: radiance * solid_angle,
                spot_scale: 0.0,
                spot_offset: 1.0,
            });
        }
    }
    lights.retain(|light| light.intensity != Vec3::ZERO);
    lights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_makes_a_plane_as_bright_as_pi() {
        for normal in [Vec3::Y, Vec3::X, Vec3::new(0.3, -0.5, 0.8).normalize()] {
            for (count, tolerance) in [(128, 2e-2), (2048, 2e-3)] {
                let lights = distant_emitters(&Environment::Constant(Vec3::ONE), count);
                let sum: Vec3 = lights.iter().map(|l| l.intensity * (-l.direction).dot(normal).max(0.0)).sum();
                assert!((sum.x / PI - 1.0).abs() < tolerance, "{count} towards {normal}: {}", sum.x / PI);
            }
        }
        assert!(distant_emitters(&Environment::default(), 128).is_empty());
    }
}
