//! The atlas on the device: texels as receivers, what they reflect and emit, and their direct light.

use super::shiny_texels::ShinyTexels;
use super::trace::{self, Tracer};
use super::world::World;
use crate::gpu::shaders::atlas as passes;
use crate::gpu::shaders::types::{AtlasPart, AtlasTexel, PartShape, Ray, SenderLeaf, TexelGloss};
use crate::gpu::{Buffer, Context, GpuError, Recorder, Sampled};
use crate::scene::atlas::Atlas;
use crate::stages::sender_tree::parallelogram;
use glam::Vec3;

/// Shadow rays of a batch.
const BATCH_RAYS: u32 = 1 << 19;

/// `count` entries each unless said otherwise.
pub struct Texels {
    pub count: u32,
    pub texels: Buffer<AtlasTexel>,
    /// Diffuse reflectance.
    pub albedo: Buffer<Vec3>,
    /// W m^-2 sr^-1.
    pub emission: Buffer<Vec3>,
    /// The specular lobe.
    pub gloss: Buffer<TexelGloss>,
    /// How far rays start off their surface, metres.
    pub ray_offset: f32,
    pub parts: Buffer<AtlasPart>,
    /// Where the parts lie, one each.
    pub shapes: Buffer<PartShape>,
    rays: Buffer<Ray>,
    is_free: Buffer<u32>,
}

impl Texels {
    /// Uploads the texels of `atlas` and takes the world's present materials.
    pub fn new(context: &Context, atlas: &Atlas, world: &World, ray_offset: f32) -> Result<Self, GpuError> {
        let count = atlas.texels.len();
        let parts = atlas.parts.iter();
        let parts: Vec<AtlasPart> = parts
            .map(|part| AtlasPart { triangle: part.triangle, barycentrics: part.barycentrics, area: part.area })
            .collect();
        let texels = Self {
            count: count as u32,
            texels: context.upload("texels/texels", &receivers(atlas))?,
            albedo: context.buffer("texels/albedo", count)?,
            emission: context.buffer("texels/emission", count)?,
            gloss: context.buffer("texels/gloss", count)?,
            ray_offset,
            parts: context.upload("texels/parts", &parts)?,
            shapes: context.buffer("texels/shapes", parts.len())?,
            rays: context.buffer("texels/rays", BATCH_RAYS as usize)?,
            is_free: context.buffer("texels/is free", BATCH_RAYS as usize)?,
        };
        let mut recorder = context.recorder("texels")?;
        texels.update_materials(&mut recorder, world);
        recorder.submit()?;
        Ok(texels)
    }

    /// Takes over where the same texels are now.
    pub fn move_to(&self, context: &Context, atlas: &Atlas) -> Result<(), GpuError> {
        context.write(&self.texels, &receivers(atlas))
    }

    /// Averages what the texels reflect and emit over them, with the world's present materials.
    pub fn update_materials(&self, recorder: &mut Recorder<'_>, world: &World) {
        let pass = passes::Materials {
            texels: &self.texels,
            parts: &self.parts,
            triangles: &world.triangles,
            triangle_materials: &world.triangle_materials,
            attributes: &world.attributes,
            materials: &world.materials,
            positions: &world.positions,
            albedo: &self.albedo,
            emission: &self.emission,
            gloss: &self.gloss,
            textures: &world.textures,
            params: passes::MaterialsParams { texel_count: self.count },
        };
        recorder.dispatch(&pass, self.count);
    }

    /// Takes over where the world's triangles are now.
    pub fn update_shapes(&self, recorder: &mut Recorder<'_>, world: &World) {
        let pass = passes::PartShapes {
            texels: &self.texels,
            parts: &self.parts,
            triangles: &world.triangles,
            positions: &world.positions,
            shapes: &self.shapes,
            params: passes::PartShapesParams { texel_count: self.count },
        };
        recorder.dispatch(&pass, self.count);
    }

    /// Adds punctual lights to `irradiance` (W/m2), by shadow rays from `samples` points of every texel, and to the tables of
    /// those that are `shiny`.
    pub fn add_lights(
        &self,
        recorder: &mut Recorder<'_>,
        tracer: &Tracer<'_>,
        world: &World,
        samples: u32,
        irradiance: &Buffer<Vec3>,
        shiny: Option<&ShinyTexels>,
    ) {
        let shiny = shiny.filter(|shiny| shiny.row_count > 0);
        for light in 0..world.light_count {
            self.batches(samples, |first_texel, batch_count| {
                let ray_count = batch_count * samples;
                let (texels, lights, rays) = (&self.texels, &world.lights, &self.rays);
                let params = passes::LightRaysParams {
                    first_texel,
                    batch_count,
                    sample_count: samples,
                    light,
                    ray_offset: self.ray_offset,
                };
                recorder.dispatch(&passes::LightRays { texels, lights, rays, params }, ray_count);
                trace::any_hit(recorder, tracer, rays, &self.is_free, ray_count as usize);
                let params = passes::LightIrradianceParams { first_texel, batch_count, sample_count: samples, light };
                let is_free = &self.is_free;
                let pass = passes::LightIrradiance { texels, lights, rays, is_free, irradiance, params };
                recorder.dispatch(&pass, batch_count);
                if let Some(ShinyTexels { side, glossy_rows, arrived, .. }) = shiny {
                    let (sample_count, side) = (samples, *side);
                    let params = passes::LightGlossParams { first_texel, batch_count, sample_count, light, side };
                    let pass = passes::LightGloss { texels, glossy_rows, lights, rays, is_free, arrived, params };
                    recorder.dispatch(&pass, batch_count);
                }
            });
        }
    }

    /// Adds the environment to `irradiance` (W/m2), by `samples` rays of every texel, and to the tables of those that are
    /// `shiny`.
    pub fn add_environment(
        &self,
        recorder: &mut Recorder<'_>,
        tracer: &Tracer<'_>,
        world: &World,
        samples: u32,
        irradiance: &Buffer<Vec3>,
        shiny: Option<&ShinyTexels>,
    ) {
        let shiny = shiny.filter(|shiny| shiny.row_count > 0);
        let environment = &world.environment;
        if environment.info.is_black != 0 {
            return;
        }
        self.batches(samples, |first_texel, batch_count| {
            let ray_count = batch_count * samples;
            let (texels, rays, sample_count) = (&self.texels, &self.rays, samples);
            let params =
                passes::EnvironmentRaysParams { first_texel, batch_count, sample_count, ray_offset: self.ray_offset };
            recorder.dispatch(&passes::EnvironmentRays { texels, rays, params }, ray_count);
            trace::any_hit(recorder, tracer, rays, &self.is_free, ray_count as usize);
            let pass = passes::EnvironmentIrradiance {
                rays,
                is_free: &self.is_free,
                environment_info: &environment.info_buffer,
                environment_map: Sampled { image: &environment.map, sampler: &environment.sampler },
                irradiance,
                params: passes::EnvironmentIrradianceParams { first_texel, batch_count, sample_count },
            };
            recorder.dispatch(&pass, batch_count);
            if let Some(ShinyTexels { side, glossy_rows, arrived, .. }) = shiny {
                let pass = passes::EnvironmentGloss {
                    texels,
                    glossy_rows,
                    rays,
                    is_free: &self.is_free,
                    environment_info: &environment.info_buffer,
                    environment_map: Sampled { image: &environment.map, sampler: &environment.sampler },
                    arrived,
                    params: passes::EnvironmentGlossParams { first_texel, batch_count, sample_count, side: *side },
                };
                recorder.dispatch(&pass, batch_count);
            }
        });
    }

    /// Texels in batches whose rays fit; at most [`BATCH_RAYS`] samples each.
    fn batches(&self, samples: u32, mut batch: impl FnMut(u32, u32)) {
        let texels = (BATCH_RAYS / samples.max(1)).max(1);
        for first in (0..self.count).step_by(texels as usize) {
            batch(first, texels.min(self.count - first));
        }
    }
}

/// Texels as receivers, in the atlas' order.
pub fn receivers(atlas: &Atlas) -> Vec<AtlasTexel> {
    (atlas.texels.iter().enumerate())
        .map(|(index, texel)| AtlasTexel {
            position: texel.position,
            normal: texel.normal,
            side_u: texel.side_u,
            side_v: texel.side_v,
            first_part: texel.first_part,
            part_count: atlas.parts_of(index).len() as u32,
            is_back: u32::from(texel.chart >= atlas.chart_count),
        })
        .collect()
}

/// Texels as senders, in the atlas' order.
pub fn leaves(atlas: &Atlas) -> Vec<SenderLeaf> {
    atlas.texels.iter().map(|texel| parallelogram(texel.position, texel.side_u, texel.side_v)).collect()
}
