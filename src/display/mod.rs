//! From a solution to pixels: direct light with shadow maps, the G-buffer, the display stages.
//!
//! | module | what |
//! |---|---|
//! | [`shadow_maps`] | reversed depth of every view of every punctual light |
//! | [`g_buffer`] | which triangle each pixel sees, and the surface there |
//! | [`direct`] | what every display stage starts from: background, emission, punctual light |
//! | [`vertex`] | the display stage that interpolates irradiance between vertices |
//! | [`splat`] | the display stage that draws flat patches as rectangles that fade into one another |
//! | [`lightmap`] | the display stage that filters the texels of an atlas |
//! | [`glossy_texels`] | what texels of an atlas send to the eye by their specular lobe |
//! | [`irradiance_vector`] | the display stage that shades by the vector irradiance of elements, per pixel or per vertex |
//! | [`final_gather`] | the display stage that gathers from a sender tree at every pixel |
//! | [`tone_map`] | what a display shows of a film |
//! | [`interface`] | the user interface over the picture |
//!
//! Every stage fills a [`Film`](crate::stages::film::Film): linear radiance, direct and indirect apart. Tone mapping
//! comes after: here for windows, in [`crate::report::tonemap`] for files.

pub mod direct;
pub mod final_gather;
pub mod g_buffer;
pub mod glossy_texels;
pub mod interface;
pub mod irradiance_vector;
pub mod lightmap;
pub mod pixel_samples;
pub mod shadow_maps;
pub mod splat;
pub mod tone_map;
pub mod vertex;

use crate::scene::camera::{Lens, View};
use glam::{Mat4, UVec2, Vec3};

/// A view as the passes of a picture take it: shifted within the pixel for antialiasing.
#[derive(Debug, Clone, Copy)]
pub struct PixelView {
    pub clip_from_world: Mat4,
    /// Position and 1, or for an orthographic view the direction to the eye and 0.
    pub eye: [f32; 4],
    /// Unit.
    pub forward: Vec3,
    /// The eye's place along `forward`, metres.
    pub eye_along: f32,
    /// Side of the part of a pixel that is seen, pixels: what textures are filtered over.
    pub footprint: f32,
}

impl PixelView {
    /// One of `samples` places in each pixel of a picture of `size`.
    pub fn new(view: &View, size: UVec2, index: u32, samples: u32) -> Self {
        let shift = -2.0 * pixel_samples::sample_offset(index, samples) / size.as_vec2();
        let eye = match view.lens {
            Lens::Perspective { .. } => view.position.extend(1.0),
            Lens::Orthographic { .. } => (-view.forward).extend(0.0),
        };
        Self {
            clip_from_world: Mat4::from_translation(shift.extend(0.0)) * view.clip_from_world(),
            eye: eye.to_array(),
            forward: view.forward,
            eye_along: view.position.dot(view.forward),
            footprint: 1.0 / (samples.max(1) as f32).sqrt(),
        }
    }
}
