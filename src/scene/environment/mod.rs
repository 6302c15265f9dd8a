//! Light from infinitely far away: one radiance for all directions, or an equirectangular map.
//!
//! Convention, kept everywhere: row 0 of the map is up (+Y), the last row down. The middle of the picture looks along
//! +X and the picture's right goes towards +Z, as seen from inside: `u = atan2(z, x) / 2 pi + 1/2`,
//! `v = acos(y) / pi`. (three.js, Khronos' sample viewer and Blender's export agree on this one, so a map shows up
//! turned the same way here.) `rotation` turns the whole map about +Y, counter-clockwise seen from above.
//!
//! Texels are radiance, W m^-2 sr^-1, linear Rec. 709, taken one to one. Between texel centres radiance is bilinear,
//! around the seam too. [`sampling`] chooses directions by importance. Loading is in [`load`].

mod average;
mod bright;
pub mod load;
pub mod sampling;

pub use bright::Spot;

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3, vec2};

#[derive(Debug, Clone, PartialEq)]
pub enum Environment {
    /// Radiance from everywhere, W m^-2 sr^-1.
    Constant(Vec3),
    Map(EnvironmentMap),
}

impl Default for Environment {
    /// Darkness.
    fn default() -> Self {
        Self::Constant(Vec3::ZERO)
    }
}

/// An equirectangular radiance map; see the module for its orientation.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentMap {
    pub width: u32,
    pub height: u32,
    /// `width * height`, row 0 on top; finite and not negative.
    pub texels: Vec<Vec3>,
    /// Radians about +Y.
    pub rotation: f32,
}

impl Environment {
    /// Radiance seen along a unit direction.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Map(map) => map.radiance(direction),
        }
    }

    /// Bytes of its table.
    pub fn size_bytes(&self) -> u64 {
        match self {
            Self::Constant(_) => 0,
            Self::Map(map) => size_of_val(map.texels.as_slice()) as u64,
        }
    }

    /// Whether no light comes from any direction.
    pub fn is_black(&self) -> bool {
        match self {
            Self::Constant(radiance) => *radiance == Vec3::ZERO,
            Self::Map(map) => map.texels.iter().all(|&texel| texel == Vec3::ZERO),
        }
    }
}

impl EnvironmentMap {
    /// Place in the map, both in 0..1, of a unit direction.
    pub fn uv_of(&self, direction: Vec3) -> Vec2 {
        let angle = direction.z.atan2(direction.x) + self.rotation;
        let u = (angle / TAU + 0.5).rem_euclid(1.0);
        vec2(if u < 1.0 { u } else { 0.0 }, direction.y.clamp(-1.0, 1.0).acos() / PI)
    }

    /// Unit direction of a place in the map.
    pub fn direction_of(&self, uv: Vec2) -> Vec3 {
        let (sin_theta, cos_theta) = (uv.y * PI).sin_cos();
        self.direction_at(uv.x, cos_theta, sin_theta)
    }

    fn direction_at(&self, u: f32, cos_theta: f32, sin_theta: f32) -> Vec3 {
        let (sin_phi, cos_phi) = ((u - 0.5) * TAU - self.rotation).sin_cos();
        Vec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi)
    }

    /// Bilinear radiance along a unit direction: wraps left and right, holds the first and last row.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let at = self.uv_of(direction) * vec2(self.width as f32, self.height as f32) - 0.5;
        let (low, t) = (at.floor(), at - at.floor());
        let (x, y) = (low.x as i64, low.y as i64);
        let upper = self.texel(x, y).lerp(self.texel(x + 1, y), t.x);
        let lower = self.texel(x, y + 1).lerp(self.texel(x + 1, y + 1), t.x);
        upper.lerp(lower, t.y)
    }

    /// A texel, columns wrapped and rows held.
    fn texel(&self, x: i64, y: i64) -> Vec3 {
        let x = x.rem_euclid(i64::from(self.width)) as usize;
        let y = y.clamp(0, i64::from(self.height) - 1) as usize;
        self.texels[y * self.width as usize + x]
    }
}
