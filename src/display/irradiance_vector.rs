//! Vector-irradiance display: every pixel (or every vertex) finds its leaf element, evaluates one irradiance vector a
//! channel, and is shaded as if light came along them; punctual light comes from shadow maps.  [Gobbetti2003 3.5]
//!
//! A vector has no angular spread, so lobes are never narrower than a setting.
//!
//! [Gobbetti2003]: crate::methods::PAPERS

use super::direct::{self, Sample};
use super::g_buffer::GBuffer;
use super::shadow_maps::ShadowMaps;
use super::{PixelView, sample_offset};
use crate::gpu::Recorder;
use crate::gpu::shaders::display::{IrradianceVector, IrradianceVectorConstants, IrradianceVectorParams};
use crate::scene::camera::View;
use crate::stages::film::Film;
use crate::stages::irradiance_vector::ElementLight;
use crate::stages::world::World;
use glam::UVec2;

/// Fills `film` with the mean of `samples` pictures, each shifted within the pixel.
#[expect(clippy::too_many_arguments, reason = "everything a picture is made of, each by its own type")]
pub fn draw(
    recorder: &mut Recorder<'_>,
    world: &World,
    light: ElementLight<'_>,
    shadow_maps: &ShadowMaps,
    g_buffer: &GBuffer,
    view: &View,
    samples: u32,
    film: &Film,
) {
    let size = UVec2::new(film.width, film.height);
    for sample in 0..samples {
        let pixel_view = PixelView::new(view, size, sample_offset(sample, samples));
        recorder.scope("sample", |recorder| {
            let sample = Sample { index: sample, samples, is_unlit: light.shows_colors };
            direct::draw(recorder, world, shadow_maps, g_buffer, &pixel_view, sample, film);
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
                direct: &film.direct,
                indirect: &film.indirect,
                params: IrradianceVectorParams {
                    eye: pixel_view.eye,
                    weight: 1.0 / samples as f32,
                    unit: light.unit,
                    least_alpha: light.least_alpha,
                    per_vertex: u32::from(light.per_vertex),
                    shows_colors: u32::from(light.shows_colors),
                },
                constants: IrradianceVectorConstants { irradiance_functions: light.functions },
            };
            recorder.dispatch(&pass, [film.width, film.height]);
        });
    }
}
