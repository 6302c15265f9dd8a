//! What every display stage starts from: the G-buffer, background, emission, and punctual light by shadow maps.

use super::PixelView;
use super::g_buffer::GBuffer;
use super::shadow_maps::ShadowMaps;
use crate::gpu::shaders::display::{Direct, DirectParams};
use crate::gpu::{Recorder, Sampled};
use crate::stages::film::Film;
use crate::stages::world::World;

/// One of the pictures whose mean the film holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    pub index: u32,
    /// In all, at least 1.
    pub samples: u32,
    /// Surfaces stay black: the stage shows colours, not light.
    pub is_unlit: bool,
}

/// Draws the G-buffer and adds this sample of the direct light to `film`; the first sample clears it.
pub fn draw(
    recorder: &mut Recorder<'_>,
    world: &World,
    shadow_maps: &ShadowMaps,
    g_buffer: &GBuffer,
    view: &PixelView,
    sample: Sample,
    film: &Film,
) {
    g_buffer.draw(recorder, world, view);
    let pass = Direct {
        visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
        g_position: g_buffer.sampled(&g_buffer.position),
        g_normal: g_buffer.sampled(&g_buffer.normal),
        g_albedo: g_buffer.sampled(&g_buffer.albedo),
        g_specular: g_buffer.sampled(&g_buffer.specular),
        g_emission: g_buffer.sampled(&g_buffer.emission),
        triangles: &world.triangles,
        positions: &world.positions,
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
        params: DirectParams {
            clip_from_world: view.clip_from_world.to_cols_array_2d(),
            eye: view.eye,
            forward: view.forward,
            eye_along: view.eye_along,
            light_count: world.light_count,
            weight: 1.0 / sample.samples as f32,
            is_first: u32::from(sample.index == 0),
            is_unlit: u32::from(sample.is_unlit),
        },
    };
    recorder.dispatch(&pass, [film.width, film.height]);
}
