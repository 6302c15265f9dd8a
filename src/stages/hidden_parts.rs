//! What of an atlas nobody can see: parts of texels that lie inside other things, as a wall does behind its skirting.
//!
//! From each part a few rays look around. Where most end at the backs of one-sided surfaces, the part is inside of
//! something: it takes no light and sends none. A texel keeps the parts that are left, and stands on one of them, so that
//! what is asked from a texel is asked from where there is light.
//!
//! What it does not do: the backs of two-sided surfaces tell nothing, so what lies inside of such things stays.

use super::trace::{self, Tracer};
use super::work::{Interrupted, Watch};
use crate::gpu::shaders::atlas as passes;
use crate::gpu::shaders::types::{Hit, Ray};
use crate::gpu::{Buffer, Context, GpuError};
use crate::scene::atlas::Atlas;
use crate::scene::geometry::Geometry;
use glam::Vec3;

/// Rays that look around from each part.
const SAMPLES: u32 = 8;
/// Of those, as many that end at backs make a part hidden.
pub const HIDDEN_FROM: u32 = SAMPLES / 2 + 1;
/// Parts of a batch.
const BATCH_PARTS: u32 = 1 << 16;

/// Why it cannot be told.
#[derive(Debug, thiserror::Error)]
pub enum HiddenPartsError {
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// What the parts are hidden by.
pub struct Seen<'a> {
    /// One, or one for each object where they move against each other: those hide themselves alone.
    pub tracers: &'a [Tracer<'a>],
    /// Of each triangle; empty where there is one tracer.
    pub triangle_objects: &'a [u32],
    /// How far rays start off the surface, metres.
    pub ray_offset: f32,
}

/// Leaves the hidden parts out of `atlas`; returns how many they were.
pub fn leave_out(
    context: &Context,
    seen: &Seen<'_>,
    geometry: &Geometry,
    positions: &[Vec3],
    atlas: &mut Atlas,
    watch: &dyn Watch,
) -> Result<usize, HiddenPartsError> {
    let (points, normals) = atlas.part_points(geometry, positions);
    let mut kept = vec![true; points.len()];
    for (object, tracer) in seen.tracers.iter().enumerate() {
        let is_own = |part: &u32| {
            let triangle = atlas.parts[*part as usize].triangle as usize;
            seen.triangle_objects.get(triangle).is_none_or(|&of| of as usize == object)
        };
        let own: Vec<u32> = (0..points.len() as u32).filter(is_own).collect();
        let of = |values: &[Vec3]| own.iter().map(|&part| values[part as usize]).collect::<Vec<_>>();
        let back_hits = back_hits(context, tracer, (&of(&points), &of(&normals)), seen.ray_offset, watch)?;
        own.iter().zip(back_hits).for_each(|(&part, hits)| kept[part as usize] = hits < HIDDEN_FROM);
    }
    let hidden = kept.iter().filter(|kept| !**kept).count();
    if hidden > 0 {
        atlas.keep_parts(geometry, positions, &kept);
    }
    Ok(hidden)
}

/// Of each point (metres, with its unit normal), how many of its rays end at the back of a one-sided surface.
pub fn back_hits(
    context: &Context,
    tracer: &Tracer<'_>,
    (points, normals): (&[Vec3], &[Vec3]),
    ray_offset: f32,
    watch: &dyn Watch,
) -> Result<Vec<u32>, HiddenPartsError> {
    let part_count = points.len() as u32;
    let fitting = context.limits().storage_buffer_bytes / u64::from(SAMPLES * size_of::<Ray>() as u32);
    let batch = (fitting.max(1) as u32).min(BATCH_PARTS);
    let ray_count = (part_count.min(batch) * SAMPLES) as usize;
    let points = context.upload("hidden parts/points", points)?;
    let normals = context.upload("hidden parts/normals", normals)?;
    let back_hits = context.buffer("hidden parts/back hits", part_count as usize)?;
    let rays: Buffer<Ray> = context.buffer("hidden parts/rays", ray_count)?;
    let hits: Buffer<Hit> = context.buffer("hidden parts/hits", ray_count)?;
    let (Tracer::Compute(_, surfaces) | Tracer::RayQuery(_, surfaces)) = tracer;
    for first_part in (0..part_count).step_by(batch as usize) {
        watch.step("hidden parts", first_part.into(), part_count.into())?;
        let batch_count = batch.min(part_count - first_part);
        let mut recorder = context.recorder("hidden parts")?;
        let params = passes::PartRaysParams { first_part, batch_count, sample_count: SAMPLES, ray_offset };
        let pass = passes::PartRays { points: &points, normals: &normals, rays: &rays, params };
        recorder.dispatch(&pass, batch_count * SAMPLES);
        trace::closest_hit(&mut recorder, tracer, &rays, &hits, (batch_count * SAMPLES) as usize);
        let pass = passes::PartHits {
            hits: &hits,
            triangle_materials: surfaces.triangle_materials,
            materials: surfaces.materials,
            back_hits: &back_hits,
            params: passes::PartHitsParams { first_part, batch_count, sample_count: SAMPLES },
        };
        recorder.dispatch(&pass, batch_count);
        recorder.submit()?;
    }
    watch.step("hidden parts", part_count.into(), part_count.into())?;
    Ok(context.download(&back_hits)?)
}
