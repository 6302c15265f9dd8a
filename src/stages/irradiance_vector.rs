//! A solution as vector irradiance per element: what a method offers, and the display shades by.

use crate::gpu::Buffer;
use crate::gpu::shaders::types::FaceElement;
use glam::{UVec2, Vec3};

/// What a method offers per element.
#[derive(Clone, Copy)]
pub struct ElementLight<'a> {
    pub elements: &'a Buffer<FaceElement>,
    /// Per triangle: the elements of its front and back, u32::MAX where there is none.
    pub triangle_elements: &'a Buffer<UVec2>,
    /// From emitters and the environment, per element and function; a column a channel, W/m2.
    pub direct: &'a Buffer<[[f32; 3]; 3]>,
    /// Reflected at least once.
    pub indirect: &'a Buffer<[[f32; 3]; 3]>,
    /// Functions an element.
    pub functions: u32,
    /// False colours per element.
    pub colors: &'a Buffer<Vec3>,
    /// They are shown instead of all light, unlit.
    pub shows_colors: bool,
    /// GGX alpha of the narrowest lobe.
    pub least_alpha: f32,
    /// Shade at vertices and interpolate.
    pub per_vertex: bool,
}
