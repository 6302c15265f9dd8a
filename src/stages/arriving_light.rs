//! Light that arrives at texels, by direction: spherical harmonics of bands 0 and 1, for normal maps and moving things.
//!
//! Rays from every texel look up what the solution's surfaces send; punctual lights are added by shadow rays. What comes
//! from behind the texel's own plane is no part of it.
//!
//! [Ramamoorthi2001]: crate::methods::PAPERS

use super::texels::Texels;
use super::trace::{self, Tracer};
use super::work::{Interrupted, Watch};
use super::world::World;
use crate::gpu::shaders::arriving_light as passes;
use crate::gpu::shaders::atlas::{LightRays, LightRaysParams};
use crate::gpu::shaders::types::{ArrivingLight, Hit, Ray};
use crate::gpu::{Buffer, Context, GpuError, Sampled};
use glam::Vec3;

/// Rays of a batch: each batch is a submission, after which the user may interrupt.
const BATCH_RAYS: u32 = 1 << 18;
/// Of the linear functions: sqrt(3 / (4 pi)).
const LINEAR: f32 = 0.488_602_51;
/// Of the constant one: 1 / (2 sqrt pi).
const CONSTANT: f32 = 0.282_094_79;

/// What surfaces send towards the texels.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    pub tracer: &'a Tracer<'a>,
    pub world: &'a World,
    /// Per element, W m^-2 sr^-1: emitted and diffusely reflected. Element `v` is the front of vertex `v`.
    pub exitant: &'a Buffer<Vec3>,
    /// Per vertex; u32::MAX where the surface is one-sided.
    pub back_elements: &'a Buffer<u32>,
    /// Punctual lights and the environment count too.
    pub has_lights: bool,
}

/// Why there is none.
#[derive(Debug, thiserror::Error)]
pub enum ArrivingLightError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// One entry per texel, from `ray_count` rays each and as many of `light_samples` to every punctual light.
pub fn gather(
    context: &Context,
    texels: &Texels,
    surroundings: Surroundings<'_>,
    [ray_count, light_samples]: [u32; 2],
    seed: u32,
    watch: &dyn Watch,
) -> Result<Buffer<ArrivingLight>, ArrivingLightError> {
    let Surroundings { tracer, world, exitant, back_elements, has_lights } = surroundings;
    let room = BATCH_RAYS.max(ray_count).max(light_samples) as usize;
    let rays: Buffer<Ray> = context.buffer("arriving_light/rays", room)?;
    let hits: Buffer<Hit> = context.buffer("arriving_light/hits", room)?;
    let is_free: Buffer<u32> = context.buffer("arriving_light/is free", room)?;
    let arriving: Buffer<ArrivingLight> = context.buffer("arriving_light/arriving", texels.count as usize)?;
    let mut recorder = context.recorder("arriving light")?;
    recorder.fill(&arriving, 0);
    recorder.submit()?;

    let environment = &world.environment;
    for (first_texel, batch_count) in batches(texels.count, ray_count) {
        watch.step("arriving light", first_texel.into(), texels.count.into())?;
        let (count, sample_count) = (batch_count * ray_count, ray_count);
        let ray_offset = texels.ray_offset;
        let mut recorder = context.recorder("arriving light")?;
        let params = passes::RaysParams { first_texel, batch_count, sample_count, seed, ray_offset };
        recorder.dispatch(&passes::Rays { texels: &texels.texels, rays: &rays, params }, count);
        trace::closest_hit(&mut recorder, tracer, &rays, &hits, count as usize);
        let pass = passes::Surfaces {
            rays: &rays,
            hits: &hits,
            triangles: &world.triangles,
            back_elements,
            exitant,
            environment_info: &environment.info_buffer,
            environment_map: Sampled { image: &environment.map, sampler: &environment.sampler },
            arriving: &arriving,
            params: passes::SurfacesParams {
                first_texel,
                batch_count,
                sample_count,
                has_environment: u32::from(has_lights),
            },
        };
        recorder.dispatch(&pass, batch_count);
        recorder.submit()?;
    }
    for light in 0..if has_lights { world.light_count } else { 0 } {
        watch.step("arriving light, lights", light.into(), world.light_count.into())?;
        for (first_texel, batch_count) in batches(texels.count, light_samples) {
            let (count, sample_count) = (batch_count * light_samples, light_samples);
            let ray_offset = texels.ray_offset;
            let mut recorder = context.recorder("arriving light")?;
            let params = LightRaysParams { first_texel, batch_count, sample_count, light, ray_offset };
            let (of, lights, rays) = (&texels.texels, &world.lights, &rays);
            recorder.dispatch(&LightRays { texels: of, lights, rays, params }, count);
            trace::any_hit(&mut recorder, tracer, rays, &is_free, count as usize);
            let params = passes::LightParams { first_texel, batch_count, sample_count, light };
            let (is_free, arriving) = (&is_free, &arriving);
            recorder.dispatch(&passes::Light { lights, rays, is_free, arriving, params }, batch_count);
            recorder.submit()?;
        }
    }
    watch.step("arriving light", texels.count.into(), texels.count.into())?;
    Ok(arriving)
}

/// First texel and number of texels of each batch of at most [`BATCH_RAYS`] rays.
fn batches(texels: u32, samples: u32) -> impl Iterator<Item = (u32, u32)> {
    let size = (BATCH_RAYS / samples.max(1)).max(1);
    (0..texels).step_by(size as usize).map(move |first| (first, size.min(texels - first)))
}

/// Vector irradiance: a column a channel, W/m2. Its part along the texel's normal is the irradiance there, exactly.
pub fn irradiance_vectors(light: &ArrivingLight) -> [Vec3; 3] {
    let channel = |c: usize| Vec3::new(light.along_x[c], light.along_y[c], light.along_z[c]) / LINEAR;
    [channel(0), channel(1), channel(2)]
}

/// Irradiance on a plane of that unit normal, as far as two bands tell, W/m2.    [Ramamoorthi2001 Eq. 10 and 11]
pub fn irradiance(light: &ArrivingLight, normal: Vec3) -> Vec3 {
    use std::f32::consts::PI;
    let linear = light.along_x * normal.x + light.along_y * normal.y + light.along_z * normal.z;
    PI * CONSTANT * light.constant + 2.0 / 3.0 * PI * LINEAR * linear
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    /// Light of irradiance 1 from one direction, as `add_arriving` adds it.
    fn from(direction: Vec3) -> ArrivingLight {
        ArrivingLight {
            constant: Vec3::splat(CONSTANT),
            along_y: Vec3::splat(LINEAR * direction.y),
            along_z: Vec3::splat(LINEAR * direction.z),
            along_x: Vec3::splat(LINEAR * direction.x),
        }
    }

    #[test]
    fn one_direction_gives_its_vector_and_the_known_two_band_irradiance() {
        let direction = Vec3::new(1.0, 2.0, -2.0) / 3.0;
        let light = from(direction);
        for vector in irradiance_vectors(&light) {
            assert!(vector.abs_diff_eq(direction, 1e-6), "{vector}");
        }
        // 1/4 + 1/2 cos, the clamped cosine's first two terms.
        assert!((irradiance(&light, direction).x - 0.75).abs() < 1e-6);
        assert!((irradiance(&light, direction.any_orthonormal_vector()).x - 0.25).abs() < 1e-6);
    }

    #[test]
    fn even_light_gives_pi_times_its_radiance() {
        let constant = Vec3::splat(4.0 * PI * CONSTANT);
        let zero = Vec3::ZERO;
        let light = ArrivingLight { constant, along_y: zero, along_z: zero, along_x: zero };
        assert!((irradiance(&light, Vec3::Y).x - PI).abs() < 1e-5);
        assert_eq!(irradiance_vectors(&light)[1], zero);
    }

    #[test]
    fn batches_cover_every_texel_once() {
        for (texels, samples) in [(0, 4), (1, 1 << 20), (1000, 1024), (300_000, 1)] {
            let covered: Vec<u32> = batches(texels, samples).flat_map(|(first, count)| first..first + count).collect();
            assert_eq!(covered, (0..texels).collect::<Vec<_>>());
        }
    }
}
