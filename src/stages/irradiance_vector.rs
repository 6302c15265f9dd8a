//! A solution as vector irradiance per leaf element: what a method offers, and the display shades by.

use crate::gpu::Buffer;
use crate::gpu::shaders::types::{HalfVectors, LeafElement};
use glam::{UVec2, Vec3};

/// What a method offers per leaf.
#[derive(Clone, Copy)]
pub struct ElementLight<'a> {
    pub leaves: &'a Buffer<LeafElement>,
    /// Per triangle: the leaves of its front and back, u32::MAX where there is none.
    pub triangle_leaves: &'a Buffer<UVec2>,
    /// From emitters and the environment, per leaf and function, in units.
    pub direct: &'a Buffer<HalfVectors>,
    /// Reflected at least once.
    pub indirect: &'a Buffer<HalfVectors>,
    /// W/m2.
    pub unit: f32,
    /// Functions a leaf.
    pub functions: u32,
    /// False colours per leaf.
    pub colors: &'a Buffer<Vec3>,
    /// They are shown instead of all light, unlit.
    pub shows_colors: bool,
    /// GGX alpha of the narrowest lobe.
    pub least_alpha: f32,
    /// Shade at vertices and interpolate.
    pub per_vertex: bool,
}
