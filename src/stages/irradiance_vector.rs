//! A solution as vector irradiance per leaf element: what a method offers, and the display shades by.

use super::elements::Elements;
use super::world::World;
use crate::gpu::shaders::irradiance_vector as passes;
use crate::gpu::shaders::types::{LeafElement, SharedVectors};
use crate::gpu::{Buffer, Recorder};
use glam::{UVec2, Vec3};

/// What a method offers per leaf.
#[derive(Clone, Copy)]
pub struct ElementLight<'a> {
    pub leaves: &'a Buffer<LeafElement>,
    /// Per triangle: the leaves of its front and back, u32::MAX where there is none.
    pub triangle_leaves: &'a Buffer<UVec2>,
    /// From emitters and the environment, per leaf and function, in units.
    pub direct: &'a Buffer<SharedVectors>,
    /// Reflected at least once.
    pub indirect: &'a Buffer<SharedVectors>,
    /// W/m2.
    pub unit: f32,
    /// Functions a leaf.
    pub functions: u32,
    /// Per leaf, and one more: where the row of leaves beside it starts.
    pub neighbour_offsets: &'a Buffer<u32>,
    pub neighbours: &'a Buffer<u32>,
    /// How far the light of a leaf reaches over its border, in its shorter half sides; 0: leaves meet in steps.
    pub reach: f32,
    /// False colours per leaf.
    pub colors: &'a Buffer<Vec3>,
    /// They are shown instead of all light, unlit.
    pub shows_colors: bool,
    /// GGX alpha of the narrowest lobe.
    pub least_alpha: f32,
    /// Shade at vertices and interpolate.
    pub per_vertex: bool,
}

impl ElementLight<'_> {
    /// What elements at the vertices receive by the leaves around them, into direct and indirect irradiance, W/m2.
    pub fn at_elements(
        &self,
        recorder: &mut Recorder<'_>,
        world: &World,
        elements: &Elements,
        [direct_irradiance, indirect_irradiance]: [&Buffer<Vec3>; 2],
    ) {
        let pass = passes::Elements {
            element_vertices: &elements.vertices,
            positions: &world.positions,
            normals: &world.normals,
            triangles: &world.triangles,
            incident_offsets: &elements.incident_offsets,
            incident_triangles: &elements.incident_triangles,
            leaves: self.leaves,
            triangle_leaves: self.triangle_leaves,
            direct_vectors: self.direct,
            indirect_vectors: self.indirect,
            direct_irradiance,
            indirect_irradiance,
            neighbour_offsets: self.neighbour_offsets,
            neighbours: self.neighbours,
            params: passes::ElementsParams { element_count: elements.count, unit: self.unit, reach: self.reach },
            constants: passes::ElementsConstants { irradiance_functions: self.functions },
        };
        recorder.dispatch(&pass, elements.count);
    }
}
