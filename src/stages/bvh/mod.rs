//! The bounding volume hierarchy over world-space triangles: built on the CPU, refitted and traversed on the GPU.
//!
//! Four children a node, the bounds of siblings side by side, levels stored one after the other from the root. Binary
//! trees come from obvhs and are widened here ([`topology`]); bounds are always made by the same GPU passes, at build
//! and after deformation, so that both agree bit by bit. Casting rays is the stage [`super::trace`].
//!
//! What it does not do: no instancing (each instance has its own triangles), no building on the GPU.

pub mod topology;

use crate::gpu::shaders::bvh::{RefitNodes, RefitNodesParams, RefitTriangles, RefitTrianglesParams};
use crate::gpu::shaders::types::{BvhNode, BvhTriangle};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use glam::{UVec3, Vec3};
use rayon::prelude::*;
use topology::Topology;

/// Largest absolute coordinate, metres: products of four of them stay finite.
pub const COORDINATE_LIMIT: f32 = 1e9;

/// Levels of at most this many nodes are refitted together, by one workgroup.
const SMALL_LEVEL: u32 = 256;

#[derive(Debug, thiserror::Error)]
pub enum BvhError {
    #[error(
        "triangle {triangle} refers to vertex {vertex}, but there are {vertex_count}; the indices of the scene are broken"
    )]
    VertexIndex { triangle: usize, vertex: u32, vertex_count: usize },
    #[error(
        "vertex {vertex} lies at {position}; coordinates must be finite and within {COORDINATE_LIMIT:e} m of the origin: \
         repair or rescale the scene"
    )]
    Coordinate { vertex: usize, position: Vec3 },
    #[error(
        "{count} triangles; at most {} can be traced: simplify the scene or lower --elements",
        topology::MAX_TRIANGLES
    )]
    TriangleCount { count: usize },
    #[error("{expected} vertex positions expected, {actual} given; build a new hierarchy when the mesh itself changes")]
    VertexCount { expected: usize, actual: usize },
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// The hierarchy on the device.
pub struct Bvh {
    /// node_count, the root first; never empty.
    nodes: Buffer<BvhNode>,
    /// triangle_count, in leaf order.
    triangles: Buffer<BvhTriangle>,
    /// Vertex indices of `triangles`.
    slot_vertices: Buffer<UVec3>,
    level_first: Buffer<u32>,
    /// m2.
    subtree_costs: Buffer<f32>,
    levels: Vec<u32>,
    vertex_count: usize,
    built_cost: f32,
}

impl Bvh {
    /// Builds over `triangles` (indices into `positions`, metres, world space) on all cores and uploads.
    pub fn build(context: &Context, positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, BvhError> {
        check(positions, triangles)?;
        let topology = Topology::build(positions, triangles);
        let corner = |index: u32| positions[index as usize];
        let slots: Vec<BvhTriangle> = topology
            .slots
            .par_iter()
            .map(|&triangle| BvhTriangle { corners: triangles[triangle as usize].map(corner), triangle })
            .collect();
        let slot_vertices: Vec<UVec3> =
            topology.slots.par_iter().map(|&triangle| UVec3::from(triangles[triangle as usize])).collect();
        let nodes: Vec<BvhNode> =
            topology.children.par_iter().map(|&child| BvhNode { child, ..bytemuck::Zeroable::zeroed() }).collect();
        let mut bvh = Self {
            nodes: context.upload("bvh/nodes", &nodes)?,
            triangles: context.upload("bvh/triangles", &slots)?,
            slot_vertices: context.upload("bvh/slot vertices", &slot_vertices)?,
            level_first: context.upload("bvh/level first", &topology.level_first)?,
            subtree_costs: context.buffer("bvh/subtree costs", nodes.len())?,
            levels: topology.level_first,
            vertex_count: positions.len(),
            built_cost: 0.0,
        };
        let mut recorder = context.recorder("bvh build")?;
        bvh.refit_nodes(&mut recorder);
        recorder.submit()?;
        bvh.built_cost = bvh.sah_cost(context)?;
        Ok(bvh)
    }

    /// Moves all bounds to where the vertices now are; `positions` are those of the build, deformed.
    pub fn refit(&self, recorder: &mut Recorder<'_>, positions: &Buffer<Vec3>) -> Result<(), BvhError> {
        if positions.len() != self.vertex_count {
            return Err(BvhError::VertexCount { expected: self.vertex_count, actual: positions.len() });
        }
        recorder.scope("refit", |recorder| {
            let triangle_count = self.triangles.len() as u32;
            recorder.dispatch(
                &RefitTriangles {
                    slot_vertices: &self.slot_vertices,
                    positions,
                    bvh_triangles: &self.triangles,
                    params: RefitTrianglesParams { triangle_count },
                },
                triangle_count,
            );
            self.refit_nodes(recorder);
        });
        Ok(())
    }

    /// Deepest level first; runs of small levels take one dispatch.
    fn refit_nodes(&self, recorder: &mut Recorder<'_>) {
        let size = |level: usize| self.levels[level + 1] - self.levels[level];
        let mut end = self.levels.len() - 1;
        while end > 0 {
            let deepest = end - 1;
            let mut highest = deepest;
            while size(deepest) <= SMALL_LEVEL && highest > 0 && size(highest - 1) <= SMALL_LEVEL {
                highest -= 1;
            }
            recorder.dispatch(
                &RefitNodes {
                    level_first: &self.level_first,
                    bvh_triangles: &self.triangles,
                    bvh_nodes: &self.nodes,
                    subtree_costs: &self.subtree_costs,
                    params: RefitNodesParams { deepest_level: deepest as u32, highest_level: highest as u32 },
                },
                size(deepest).max(1),
            );
            end = highest;
        }
    }

    /// Expected visits of nodes and triangles by a ray that crosses the scene (surface area heuristic), by the bounds of
    /// the last refit; waits for the device.                                               [Goldsmith1987]
    ///
    /// [Goldsmith1987]: crate::methods::PAPERS
    pub fn sah_cost(&self, context: &Context) -> Result<f32, BvhError> {
        let cost = context.download_range(&self.subtree_costs, 0..1)?;
        let root = context.download_range(&self.nodes, 0..1)?;
        let area = root.first().map_or(0.0, surface_area);
        Ok(1.0 + if area > 0.0 { cost.first().copied().unwrap_or(0.0) / area } else { 0.0 })
    }

    /// True when refitting has made the expected cost of a ray grow beyond `growth` (1.5, say) times that of the build.
    pub fn needs_rebuild(&self, context: &Context, growth: f32) -> Result<bool, BvhError> {
        let cost = self.sah_cost(context)?;
        Ok(cost.is_nan() || cost > growth * self.built_cost)
    }

    /// Builds anew over the present positions and takes the place of the old tree.
    pub fn rebuild(&mut self, context: &Context, positions: &Buffer<Vec3>) -> Result<(), BvhError> {
        let positions = context.download(positions)?;
        let mut triangles = vec![[0; 3]; self.triangles.len()];
        let slots = context.download(&self.triangles)?;
        for (slot, vertices) in slots.iter().zip(context.download(&self.slot_vertices)?) {
            triangles[slot.triangle as usize] = vertices.to_array();
        }
        *self = Self::build(context, &positions, &triangles)?;
        Ok(())
    }

    pub fn nodes(&self) -> &Buffer<BvhNode> {
        &self.nodes
    }

    /// Triangles in leaf order.
    pub fn triangles(&self) -> &Buffer<BvhTriangle> {
        &self.triangles
    }

    pub fn size_bytes(&self) -> u64 {
        self.nodes.size_bytes()
            + self.triangles.size_bytes()
            + self.slot_vertices.size_bytes()
            + self.level_first.size_bytes()
            + self.subtree_costs.size_bytes()
    }
}

fn check(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), BvhError> {
    if triangles.len() > topology::MAX_TRIANGLES {
        return Err(BvhError::TriangleCount { count: triangles.len() });
    }
    let outside = |p: &Vec3| !p.is_finite() || p.abs().max_element() > COORDINATE_LIMIT;
    if let Some(vertex) = positions.par_iter().position_first(outside) {
        return Err(BvhError::Coordinate { vertex, position: positions[vertex] });
    }
    let broken = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= positions.len());
    if let Some(triangle) = triangles.par_iter().position_first(broken) {
        let vertex = triangles[triangle].iter().copied().max().unwrap_or(0);
        return Err(BvhError::VertexIndex { triangle, vertex, vertex_count: positions.len() });
    }
    Ok(())
}

/// Of the union of the children's bounds, m2.
fn surface_area(node: &BvhNode) -> f32 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for k in (0..4).filter(|&k| node.child[k] != topology::EMPTY) {
        low = low.min(Vec3::new(node.min_x[k], node.min_y[k], node.min_z[k]));
        high = high.max(Vec3::new(node.max_x[k], node.max_y[k], node.max_z[k]));
    }
    let size = (high - low).max(Vec3::ZERO);
    2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
}
