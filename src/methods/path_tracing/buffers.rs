//! What the reference keeps on the device: the paths in flight, and the sums over all samples of every pixel.

use crate::gpu::shaders::types::{Hit, Path, PathVertex, Ray};
use crate::gpu::{Buffer, Context, GpuError};
use glam::{Vec2, Vec3};

/// Paths in flight; every buffer has one entry per path.
pub(super) struct Paths {
    pub rays: Buffer<Ray>,
    pub hits: Buffer<Hit>,
    pub paths: Buffer<Path>,
    pub vertices: Buffer<PathVertex>,
    pub shadow_rays: Buffer<Ray>,
    pub visibility: Buffer<u32>,
    /// Radiance that arrives at the eye if the shadow ray is free.
    pub connections: Buffer<Vec3>,
    /// Radiance of the path so far.
    pub direct: Buffer<Vec3>,
    pub indirect: Buffer<Vec3>,
}

impl Paths {
    pub const BYTES_PER_PATH: u64 = (2 * size_of::<Ray>()
        + size_of::<Hit>()
        + size_of::<Path>()
        + size_of::<PathVertex>()
        + size_of::<u32>()
        + 3 * size_of::<Vec3>()) as u64;

    pub fn new(context: &Context, count: usize) -> Result<Self, GpuError> {
        Ok(Self {
            rays: context.buffer("path-tracing/rays", count)?,
            hits: context.buffer("path-tracing/hits", count)?,
            paths: context.buffer("path-tracing/paths", count)?,
            vertices: context.buffer("path-tracing/vertices", count)?,
            shadow_rays: context.buffer("path-tracing/shadow rays", count)?,
            visibility: context.buffer("path-tracing/visibility", count)?,
            connections: context.buffer("path-tracing/connections", count)?,
            direct: context.buffer("path-tracing/direct", count)?,
            indirect: context.buffer("path-tracing/indirect", count)?,
        })
    }

    pub fn count(&self) -> u32 {
        self.rays.len() as u32
    }
}

/// Sums over samples; every buffer has one entry per pixel.
pub(super) struct Sums {
    pub direct: Buffer<Vec3>,
    pub indirect: Buffer<Vec3>,
    /// Direct and indirect of the samples with even index: half of all, for the error estimate.
    pub even: Buffer<Vec3>,
    pub albedo: Buffer<Vec3>,
    pub normal: Buffer<Vec3>,
    /// Metres, and how many rays hit anything.
    pub depth: Buffer<Vec2>,
}

impl Sums {
    pub const BYTES_PER_PIXEL: u64 = (5 * size_of::<Vec3>() + size_of::<Vec2>()) as u64;

    pub fn new(context: &Context, pixels: usize) -> Result<Self, GpuError> {
        Ok(Self {
            direct: context.buffer("path-tracing/direct sum", pixels)?,
            indirect: context.buffer("path-tracing/indirect sum", pixels)?,
            even: context.buffer("path-tracing/even sum", pixels)?,
            albedo: context.buffer("path-tracing/albedo sum", pixels)?,
            normal: context.buffer("path-tracing/normal sum", pixels)?,
            depth: context.buffer("path-tracing/depth sum", pixels)?,
        })
    }
}
