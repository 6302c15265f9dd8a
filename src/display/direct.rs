//! What every display stage starts from: the G-buffer, background, emission, and punctual light by shadow maps.

use super::PixelView;
use super::g_buffer::GBuffer;
use super::shadow_maps::ShadowMaps;
use crate::gpu::shaders::display::{Direct, DirectParams};
use crate::gpu::{Recorder, Sampled};
use crate::scene::camera::View;
use crate::stages::film::Film;
use crate::stages::world::World;
use glam::UVec2;

/// What a display stage draws with, and into.
#[derive(Clone, Copy)]
pub struct Canvas<'a> {
    pub world: &'a World,
    pub shadow_maps: &'a ShadowMaps,
    pub g_buffer: &'a GBuffer,
    pub view: &'a View,
    /// Places within each pixel, at least 1.
    pub samples: u32,
    pub film: &'a Film,
}

impl Canvas<'_> {
    /// Fills the film with the mean of all samples, each shifted within the pixel: direct light, then what `add` draws of
    /// one sample, which counts by the weight it is given. Without light (`is_unlit`) surfaces start black.
    pub fn draw(
        &self,
        recorder: &mut Recorder<'_>,
        is_unlit: bool,
        mut add: impl FnMut(&mut Recorder<'_>, &PixelView, f32),
    ) {
        let Self { world, shadow_maps, g_buffer, view, samples, film } = *self;
        let size = UVec2::new(film.width, film.height);
        for index in 0..samples {
            let pixel_view = PixelView::new(view, size, index, samples);
            recorder.scope("sample", |recorder| {
                let sample = Sample { index, samples, is_unlit };
                draw(recorder, world, shadow_maps, g_buffer, &pixel_view, sample, film);
                add(recorder, &pixel_view, 1.0 / samples as f32);
            });
        }
    }
}

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
    shade(recorder, (world, shadow_maps, g_buffer), view, sample, world.light_count, film);
}

/// What is seen in a G-buffer that was drawn, lit by the first `light_count` punctual lights of the world.
pub fn shade(
    recorder: &mut Recorder<'_>,
    (world, shadow_maps, g_buffer): (&World, &ShadowMaps, &GBuffer),
    view: &PixelView,
    sample: Sample,
    light_count: u32,
    film: &Film,
) {
    let pass = Direct {
        visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
        g_position: g_buffer.sampled(&g_buffer.position),
        g_normal: g_buffer.sampled(&g_buffer.normal),
        g_albedo: g_buffer.sampled(&g_buffer.albedo),
        g_specular: g_buffer.sampled(&g_buffer.specular),
        g_emission: g_buffer.sampled(&g_buffer.emission),
        triangles: &world.triangles,
        positions: &world.positions,
        normals: &world.normals,
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
            light_count,
            weight: 1.0 / sample.samples as f32,
            is_first: u32::from(sample.index == 0),
            is_unlit: u32::from(sample.is_unlit),
        },
    };
    recorder.dispatch(&pass, [film.width, film.height]);
}
