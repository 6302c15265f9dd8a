//! What every display stage starts from: the G-buffer, background, emission, and punctual light by shadow maps, with rays
//! where these leave doubt.

use super::PixelView;
use super::g_buffer::GBuffer;
use super::shadow_maps::ShadowMaps;
use crate::gpu::shaders::display as passes;
use crate::gpu::{Recorder, Sampled};
use crate::scene::camera::View;
use crate::stages::film::Film;
use crate::stages::trace::Tracer;
use crate::stages::world::World;
use glam::UVec2;

/// What a display stage draws with, and into.
#[derive(Clone, Copy)]
pub struct Canvas<'a> {
    pub lighting: Lighting<'a>,
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
        let Self { lighting, view, samples, film } = *self;
        let size = UVec2::new(film.width, film.height);
        for index in 0..samples {
            let pixel_view = PixelView::new(view, size, index, samples);
            recorder.scope("sample", |recorder| {
                let sample = Sample { index, samples, is_unlit };
                lighting.g_buffer.draw(recorder, lighting.world, &pixel_view);
                lighting.shade(recorder, &pixel_view, sample, lighting.world.light_count, film);
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

/// What lights the surfaces of a G-buffer.
#[derive(Clone, Copy)]
pub struct Lighting<'a> {
    pub world: &'a World,
    pub shadow_maps: &'a ShadowMaps,
    /// Casts rays where shadow maps leave doubt.
    pub tracer: Tracer<'a>,
    pub g_buffer: &'a GBuffer,
}

impl Lighting<'_> {
    /// Adds this sample of what is seen in the G-buffer, which was drawn, to `film`, lit by the first `light_count`
    /// punctual lights of the world; the first sample clears it.
    pub fn shade(&self, recorder: &mut Recorder<'_>, view: &PixelView, sample: Sample, light_count: u32, film: &Film) {
        let Self { world, shadow_maps, tracer, g_buffer } = *self;
        macro_rules! shade {
            ($pass:ident, $params:ident, $constants:ident, $surfaces:expr $(, $field:ident: $value:expr)*) => {{
                let pass = passes::$pass {
                    $($field: $value,)*
                    triangles: $surfaces.triangles,
                    triangle_materials: $surfaces.triangle_materials,
                    attributes: $surfaces.attributes,
                    materials: $surfaces.materials,
                    textures: $surfaces.textures,
                    visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
                    g_position: g_buffer.sampled(&g_buffer.position),
                    g_normal: g_buffer.sampled(&g_buffer.normal),
                    g_albedo: g_buffer.sampled(&g_buffer.albedo),
                    g_specular: g_buffer.sampled(&g_buffer.specular),
                    g_emission: g_buffer.sampled(&g_buffer.emission),
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
                    params: passes::$params {
                        clip_from_world: view.clip_from_world.to_cols_array_2d(),
                        eye: view.eye,
                        forward: view.forward,
                        eye_along: view.eye_along,
                        light_count,
                        weight: 1.0 / sample.samples as f32,
                        is_first: u32::from(sample.index == 0),
                        is_unlit: u32::from(sample.is_unlit),
                    },
                    constants: passes::$constants { alpha_test: $surfaces.has_holes },
                };
                recorder.dispatch(&pass, [film.width, film.height]);
            }};
        }
        match tracer {
            Tracer::Compute(bvh, surfaces) => shade!(
                Direct,
                DirectParams,
                DirectConstants,
                surfaces,
                bvh_nodes: bvh.nodes(),
                bvh_triangles: bvh.triangles()
            ),
            Tracer::RayQuery(structure, surfaces) => shade!(
                DirectRayQuery,
                DirectRayQueryParams,
                DirectRayQueryConstants,
                surfaces,
                acceleration_structure: structure
            ),
        }
    }
}
