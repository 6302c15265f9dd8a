//! Vertex display: punctual light per pixel by shadow maps, all other light interpolated between vertices.

use super::g_buffer::GBuffer;
use super::shadow_maps::ShadowMaps;
use super::{PixelView, sample_offset};
use crate::gpu::shaders::display::{Vertex, VertexParams};
use crate::gpu::{Buffer, Recorder, Sampled};
use crate::scene::camera::View;
use crate::stages::film::Film;
use crate::stages::world::World;
use glam::{UVec2, Vec3};

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

/// Fills `film` with the mean of `samples` pictures, each shifted within the pixel.
#[expect(clippy::too_many_arguments, reason = "everything a picture is made of, each by its own type")]
pub fn draw(
    recorder: &mut Recorder<'_>,
    world: &World,
    light: VertexLight<'_>,
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
            g_buffer.draw(recorder, world, &pixel_view);
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
                lights: &world.lights,
                shadow_lights: &shadow_maps.lights,
                shadow_views: &shadow_maps.views,
                shadow_maps: Sampled { image: &shadow_maps.depth, sampler: &shadow_maps.sampler },
                environment_info: &world.environment.info_buffer,
                environment_map: Sampled { image: &world.environment.map, sampler: &world.environment.sampler },
                direct: &film.direct,
                indirect: &film.indirect,
                albedo: &film.albedo,
                normal: &film.normal,
                depth: &film.depth,
                params: VertexParams {
                    clip_from_world: pixel_view.clip_from_world.to_cols_array_2d(),
                    eye: pixel_view.eye,
                    forward: pixel_view.forward,
                    eye_along: pixel_view.eye_along,
                    light_count: world.light_count,
                    weight: 1.0 / samples as f32,
                    is_first: u32::from(sample == 0),
                    shows_colors: u32::from(light.colors.is_some()),
                },
            };
            recorder.dispatch(&pass, [film.width, film.height]);
        });
    }
}
