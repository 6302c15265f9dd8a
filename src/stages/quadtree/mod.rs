//! Quadtrees of surfels over the elements, one per chart: the hierarchy that links are made on.
//!
//! Their shape is made once ([`topology`]); places, normals, bounds and light are pulled up from the leaves whenever they
//! change, so that anything may deform.                                                           [Dong2007]
//!
//! [Dong2007]: crate::methods::PAPERS

pub mod topology;

use super::elements::Elements;
use super::world::World;
use crate::gpu::shaders::quadtree as passes;
use crate::gpu::shaders::types::{LeafCell, QuadtreeSegment, Surfel, SurfelMoments, WalkStep};
use crate::gpu::{Buffer, Context, GpuError, Recorder, TexelBuffer};
use glam::Vec3;
use topology::QuadtreeTopology;

/// The trees on the device. A node is a leaf exactly where its index is below [`QuadtreeTopology::leaf_count`].
pub struct Quadtrees {
    pub topology: QuadtreeTopology,
    pub leaf_elements: Buffer<u32>,
    pub node_segments: Buffer<u32>,
    pub segments: Buffer<QuadtreeSegment>,
    /// One per node.
    pub surfels: Buffer<Surfel>,
    /// One per node.
    pub moments: Buffer<SurfelMoments>,
    /// One per leaf.
    pub leaf_cells: Buffer<LeafCell>,
    /// `CORNER_TEXELS` of no triangle, then so many per entry of the elements' incident triangles.
    pub corner_texels: TexelBuffer,
    /// One per node.
    walk: Buffer<WalkStep>,
    /// The same with what a walk looks at, `WALK_TEXELS` per node.
    pub walk_texels: TexelBuffer,
    /// Per node: the step of the node two levels above it (the root where there are fewer), whose subtree holds what lies
    /// around it.
    pub walk_starts: Buffer<u32>,
}

/// Texels of a step of the walk and of a corner of a leaf's cell; the layouts are those of `lib/quadtree.glsl`.
const WALK_TEXELS: usize = 3;
const CORNER_TEXELS: usize = 3;

impl Quadtrees {
    /// Uploads the topology; [`Self::pull_surfels`] places the nodes.
    /// `corner_count` is the number of the elements' incident triangles.
    pub fn new(context: &Context, topology: QuadtreeTopology, corner_count: usize) -> Result<Self, GpuError> {
        let count = topology.node_count() as usize;
        let walk = topology.walk();
        Ok(Self {
            leaf_elements: context.upload("quadtree/leaf elements", &topology.leaf_elements)?,
            node_segments: context.upload("quadtree/node segments", &topology.node_segments)?,
            segments: context.upload("quadtree/segments", &topology.segments)?,
            surfels: context.buffer("quadtree/surfels", count)?,
            moments: context.buffer("quadtree/moments", count)?,
            leaf_cells: context.buffer("quadtree/leaf cells", topology.leaf_count() as usize)?,
            corner_texels: context.texel_buffer("quadtree/corner texels", CORNER_TEXELS * (1 + corner_count))?,
            walk_starts: context.upload("quadtree/walk starts", &topology.steps_above(&walk, 2))?,
            walk: context.upload("quadtree/walk", &walk)?,
            walk_texels: context.texel_buffer("quadtree/walk texels", (WALK_TEXELS * count).max(1))?,
            topology,
        })
    }

    /// Bytes of the tables of [`Self::new`].
    pub fn bytes_needed(topology: &QuadtreeTopology, corner_count: usize) -> u64 {
        let walk = size_of::<WalkStep>() + WALK_TEXELS * 16;
        let node = size_of::<Surfel>() + size_of::<SurfelMoments>() + walk + 3 * size_of::<u32>();
        u64::from(topology.node_count()) * node as u64
            + u64::from(topology.leaf_count()) * (size_of::<LeafCell>() + size_of::<u32>()) as u64
            + (16 * CORNER_TEXELS * (1 + corner_count)) as u64
            + (topology.segments.len() * size_of::<QuadtreeSegment>()) as u64
    }

    /// Follows the elements' present places: leaves, then level by level.                          [Dong2007 4.2.1]
    pub fn pull_surfels(&self, recorder: &mut Recorder<'_>, elements: &Elements, world: &World) {
        let leaf_count = self.topology.leaf_count();
        let pass = passes::LeafSurfels {
            leaf_elements: &self.leaf_elements,
            element_vertices: &elements.vertices,
            element_normals: &elements.normals,
            positions: &world.positions,
            triangles: &world.triangles,
            incident_offsets: &elements.incident_offsets,
            incident_triangles: &elements.incident_triangles,
            back_elements: &elements.back_elements,
            surfels: &self.surfels,
            moments: &self.moments,
            leaf_cells: &self.leaf_cells,
            corner_texels: self.corner_texels.buffer(),
            params: passes::LeafSurfelsParams { leaf_count },
        };
        recorder.dispatch(&pass, leaf_count);
        for level in self.topology.levels.iter().skip(1) {
            let pass = passes::PullSurfels {
                node_segments: &self.node_segments,
                segments: &self.segments,
                surfels: &self.surfels,
                moments: &self.moments,
                params: passes::PullSurfelsParams { first: level.start, count: level.len() as u32 },
            };
            recorder.dispatch(&pass, level.len());
        }
        let node_count = self.topology.node_count();
        let pass = passes::PackWalk {
            walk: &self.walk,
            surfels: &self.surfels,
            walk_texels: self.walk_texels.buffer(),
            params: passes::PackWalkParams { node_count },
        };
        recorder.dispatch(&pass, node_count);
    }

    /// Radiosity of all nodes from that of the elements, W/m2.                                     [Dong2007 4.3]
    pub fn pull_radiosity(&self, recorder: &mut Recorder<'_>, radiosity: &Buffer<Vec3>, node_radiosity: &Buffer<Vec3>) {
        for level in &self.topology.levels {
            let pass = passes::PullRadiosity {
                node_segments: &self.node_segments,
                segments: &self.segments,
                surfels: &self.surfels,
                leaf_elements: &self.leaf_elements,
                radiosity,
                node_radiosity,
                params: passes::PullRadiosityParams { first: level.start, count: level.len() as u32 },
            };
            recorder.dispatch(&pass, level.len());
        }
    }
}
