//! Casting rays at the scene: closest and any hit of lists of rays, all by the one traversal of glsl/lib/bvh.glsl.

use super::bvh::Bvh;
use crate::gpu::shaders::trace::{AnyHit, AnyHitParams, ClosestHit, ClosestHitParams};
use crate::gpu::shaders::types::{Hit, Ray};
use crate::gpu::{Buffer, Recorder};

/// `Hit::triangle` where nothing was hit; `NO_HIT` of glsl/lib/ray.glsl.
pub const NO_HIT: u32 = u32::MAX;
/// Set in `Hit::triangle` where the triangle was hit from behind its counter-clockwise front.
pub const BACK_FACE: u32 = 1 << 31;

/// What rays are traced by.
#[derive(Clone, Copy)]
pub enum Tracer<'a> {
    /// Our own traversal, on any device.
    Compute(&'a Bvh),
}

/// The closest hits of the first `count` rays.
pub fn closest_hit(
    recorder: &mut Recorder<'_>,
    tracer: &Tracer<'_>,
    rays: &Buffer<Ray>,
    hits: &Buffer<Hit>,
    count: usize,
) {
    let ray_count = count.min(rays.len()).min(hits.len()) as u32;
    match tracer {
        Tracer::Compute(bvh) => recorder.dispatch(
            &ClosestHit {
                bvh_nodes: bvh.nodes(),
                bvh_triangles: bvh.triangles(),
                rays,
                hits,
                params: ClosestHitParams { ray_count },
            },
            ray_count,
        ),
    }
}

/// Whether each of the first `count` rays is free along its whole length: 1 free, 0 blocked.
pub fn any_hit(
    recorder: &mut Recorder<'_>,
    tracer: &Tracer<'_>,
    rays: &Buffer<Ray>,
    visibility: &Buffer<u32>,
    count: usize,
) {
    let ray_count = count.min(rays.len()).min(visibility.len()) as u32;
    match tracer {
        Tracer::Compute(bvh) => recorder.dispatch(
            &AnyHit {
                bvh_nodes: bvh.nodes(),
                bvh_triangles: bvh.triangles(),
                rays,
                visibility,
                params: AnyHitParams { ray_count },
            },
            ray_count,
        ),
    }
}
