//! Vertex display: punctual light per pixel by shadow maps, all other light interpolated between vertices.

use super::PixelView;
use super::direct::{Canvas, Lighting};
use crate::gpu::shaders::display::{Vertex, VertexParams};
use crate::gpu::{Buffer, Recorder};
use glam::Vec3;

/// What a method offers per element, W/m2. Element `v` is the front of vertex `v`.
#[derive(Clone, Copy)]
pub struct VertexLight<'a> {
    /// From emitters and the environment, unreflected; punctual lights are added per pixel.
    pub direct_irradiance: &'a Buffer<Vec3>,
    /// Reflected at least once.
    pub indirect_irradiance: &'a Buffer<Vec3>,
    /// Per vertex: the entry of the two above that its back shows; u32::MAX shows the front's.
    pub back_elements: &'a Buffer<u32>,
    /// False colours per element: shown instead of all light, unlit.
    pub colors: Option<&'a Buffer<Vec3>>,
}

/// Fills the canvas' film.
pub fn draw(recorder: &mut Recorder<'_>, light: VertexLight<'_>, canvas: Canvas<'_>) {
    canvas.draw(recorder, light.colors.is_some(), |recorder, pixel_view, weight| {
        add(recorder, light, canvas, pixel_view, weight);
    });
}

/// What a sample adds to the film, the G-buffer being drawn.
pub fn add(recorder: &mut Recorder<'_>, light: VertexLight<'_>, canvas: Canvas<'_>, view: &PixelView, weight: f32) {
    let Canvas { lighting: Lighting { world, g_buffer, .. }, film, .. } = canvas;
    let pass = Vertex {
        visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
        g_position: g_buffer.sampled(&g_buffer.position),
        g_normal: g_buffer.sampled(&g_buffer.normal),
        g_albedo: g_buffer.sampled(&g_buffer.albedo),
        g_specular: g_buffer.sampled(&g_buffer.specular),
        g_emission: g_buffer.sampled(&g_buffer.emission),
        triangles: &world.triangles,
        positions: &world.positions,
        direct_irradiance: light.colors.unwrap_or(light.direct_irradiance),
        indirect_irradiance: light.indirect_irradiance,
        back_elements: light.back_elements,
        direct: &film.direct,
        indirect: &film.indirect,
        params: VertexParams { eye: view.eye, weight, shows_colors: u32::from(light.colors.is_some()) },
    };
    recorder.dispatch(&pass, [film.width, film.height]);
}
