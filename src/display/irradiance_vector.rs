//! Vector-irradiance display: every pixel (or every vertex) finds its leaf element, evaluates one irradiance vector a
//! channel, and is shaded as if light came along them; punctual light comes from shadow maps.  [Gobbetti2003 3.5]
//!
//! A vector has no angular spread, so lobes are never narrower than a setting.
//!
//! [Gobbetti2003]: crate::methods::PAPERS

use super::PixelView;
use super::direct::{Canvas, Lighting};
use crate::gpu::Recorder;
use crate::gpu::shaders::display::{IrradianceVector, IrradianceVectorConstants, IrradianceVectorParams};
use crate::stages::irradiance_vector::ElementLight;

/// Fills the canvas' film.
pub fn draw(recorder: &mut Recorder<'_>, light: ElementLight<'_>, canvas: Canvas<'_>) {
    canvas.draw(recorder, light.shows_colors, |recorder, pixel_view, weight| {
        add(recorder, light, canvas, pixel_view, weight);
    });
}

/// What a sample adds to the film, the G-buffer being drawn.
pub fn add(
    recorder: &mut Recorder<'_>,
    light: ElementLight<'_>,
    canvas: Canvas<'_>,
    pixel_view: &PixelView,
    weight: f32,
) {
    let Canvas { lighting: Lighting { world, g_buffer, .. }, film, .. } = canvas;
    let pass = IrradianceVector {
        visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
        g_position: g_buffer.sampled(&g_buffer.position),
        g_normal: g_buffer.sampled(&g_buffer.normal),
        g_albedo: g_buffer.sampled(&g_buffer.albedo),
        g_specular: g_buffer.sampled(&g_buffer.specular),
        g_emission: g_buffer.sampled(&g_buffer.emission),
        triangles: &world.triangles,
        positions: &world.positions,
        normals: &world.normals,
        leaves: light.leaves,
        triangle_leaves: light.triangle_leaves,
        direct_irradiance: light.direct,
        indirect_irradiance: light.indirect,
        colors: light.colors,
        neighbour_offsets: light.neighbour_offsets,
        neighbours: light.neighbours,
        direct: &film.direct,
        indirect: &film.indirect,
        params: IrradianceVectorParams {
            eye: pixel_view.eye,
            weight,
            unit: light.unit,
            reach: light.reach,
            least_alpha: light.least_alpha,
            per_vertex: u32::from(light.per_vertex),
            shows_colors: u32::from(light.shows_colors),
        },
        constants: IrradianceVectorConstants { irradiance_functions: light.functions },
    };
    recorder.dispatch(&pass, [film.width, film.height]);
}
