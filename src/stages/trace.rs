//! Casting rays at the scene: closest and any hit of lists of rays, by our traversal (glsl/lib/bvh.glsl) or by the
//! device's own where it has ray query. Holes of alpha masks let rays pass in both.

use super::bvh::Bvh;
use super::world::World;
use crate::gpu::shaders::trace as pass;
use crate::gpu::shaders::types::{Hit, Material, Ray, VertexAttributes};
use crate::gpu::{AccelerationStructure, Buffer, Context, GpuError, Recorder, TextureTable};
use glam::UVec3;

/// `Hit::triangle` where nothing was hit; `NO_HIT` of glsl/lib/ray.glsl.
pub const NO_HIT: u32 = u32::MAX;
/// Set in `Hit::triangle` where the triangle was hit from behind its counter-clockwise front.
pub const BACK_FACE: u32 = 1 << 31;

/// What rays are traced by, over what.
#[derive(Clone, Copy)]
pub enum Tracer<'a> {
    /// Our own traversal, on any device. Of hits at one t the lowest triangle index counts.
    Compute(&'a Bvh, Surfaces<'a>),
    /// The device's traversal; of hits at one t it may report any. The structure is `None` without ray query.
    RayQuery(&'a AccelerationStructure, Surfaces<'a>),
}

/// What tells whether a point of a triangle is a hole.
#[derive(Clone, Copy)]
pub struct Surfaces<'a> {
    pub triangles: &'a Buffer<UVec3>,
    pub triangle_materials: &'a Buffer<u32>,
    pub attributes: &'a Buffer<VertexAttributes>,
    pub materials: &'a Buffer<Material>,
    pub textures: &'a TextureTable,
    /// False: no material has holes, and nothing is asked.
    pub has_holes: bool,
}

impl<'a> From<&'a World> for Surfaces<'a> {
    fn from(world: &'a World) -> Self {
        Self {
            triangles: &world.triangles,
            triangle_materials: &world.triangle_materials,
            attributes: &world.attributes,
            materials: &world.materials,
            textures: &world.textures,
            has_holes: world.has_holes,
        }
    }
}

/// Stands in for the surfaces of geometry that has none.
pub struct OpaqueSurfaces {
    triangles: Buffer<UVec3>,
    triangle_materials: Buffer<u32>,
    attributes: Buffer<VertexAttributes>,
    materials: Buffer<Material>,
    textures: TextureTable,
}

impl OpaqueSurfaces {
    pub fn new(context: &Context) -> Result<Self, GpuError> {
        Ok(Self {
            triangles: context.buffer("trace/no triangles", 0)?,
            triangle_materials: context.buffer("trace/no triangle materials", 0)?,
            attributes: context.buffer("trace/no attributes", 0)?,
            materials: context.buffer("trace/no materials", 0)?,
            textures: context.texture_table(Vec::new(), Vec::new(), &[])?,
        })
    }
}

impl<'a> From<&'a OpaqueSurfaces> for Surfaces<'a> {
    fn from(opaque: &'a OpaqueSurfaces) -> Self {
        Self {
            triangles: &opaque.triangles,
            triangle_materials: &opaque.triangle_materials,
            attributes: &opaque.attributes,
            materials: &opaque.materials,
            textures: &opaque.textures,
            has_holes: false,
        }
    }
}

impl<'a> Tracer<'a> {
    pub fn compute(bvh: &'a Bvh, surfaces: impl Into<Surfaces<'a>>) -> Self {
        Self::Compute(bvh, surfaces.into())
    }

    pub fn ray_query(structure: &'a AccelerationStructure, surfaces: impl Into<Surfaces<'a>>) -> Self {
        Self::RayQuery(structure, surfaces.into())
    }
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
    match *tracer {
        Tracer::Compute(bvh, surfaces) => recorder.dispatch(
            &pass::ClosestHit {
                bvh_nodes: bvh.nodes(),
                bvh_triangles: bvh.triangles(),
                rays,
                triangles: surfaces.triangles,
                triangle_materials: surfaces.triangle_materials,
                attributes: surfaces.attributes,
                materials: surfaces.materials,
                textures: surfaces.textures,
                hits,
                params: pass::ClosestHitParams { ray_count },
                constants: pass::ClosestHitConstants { alpha_test: surfaces.has_holes },
            },
            ray_count,
        ),
        Tracer::RayQuery(acceleration_structure, surfaces) => recorder.dispatch(
            &pass::ClosestHitRayQuery {
                acceleration_structure,
                rays,
                triangles: surfaces.triangles,
                triangle_materials: surfaces.triangle_materials,
                attributes: surfaces.attributes,
                materials: surfaces.materials,
                textures: surfaces.textures,
                hits,
                params: pass::ClosestHitRayQueryParams { ray_count },
                constants: pass::ClosestHitRayQueryConstants { alpha_test: surfaces.has_holes },
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
    match *tracer {
        Tracer::Compute(bvh, surfaces) => recorder.dispatch(
            &pass::AnyHit {
                bvh_nodes: bvh.nodes(),
                bvh_triangles: bvh.triangles(),
                rays,
                triangles: surfaces.triangles,
                triangle_materials: surfaces.triangle_materials,
                attributes: surfaces.attributes,
                materials: surfaces.materials,
                textures: surfaces.textures,
                visibility,
                params: pass::AnyHitParams { ray_count },
                constants: pass::AnyHitConstants { alpha_test: surfaces.has_holes },
            },
            ray_count,
        ),
        Tracer::RayQuery(acceleration_structure, surfaces) => recorder.dispatch(
            &pass::AnyHitRayQuery {
                acceleration_structure,
                rays,
                triangles: surfaces.triangles,
                triangle_materials: surfaces.triangle_materials,
                attributes: surfaces.attributes,
                materials: surfaces.materials,
                textures: surfaces.textures,
                visibility,
                params: pass::AnyHitRayQueryParams { ray_count },
                constants: pass::AnyHitRayQueryConstants { alpha_test: surfaces.has_holes },
            },
            ray_count,
        ),
    }
}
