//! The bounding volume hierarchy over world-space triangles: built on the CPU, refitted and traversed on the GPU.
//!
//! Four children a node, their bounds in eight bits, levels stored one after the other from the root. Binary trees come
//! from obvhs and are widened here ([`topology`]); bounds are always made by the same GPU passes, at build and after
//! deformation, so that both agree bit by bit. Casting rays is the stage [`super::trace`].
//!
//! What it does not do: no instancing (each instance has its own triangles), no building on the GPU.

pub mod topology;

use crate::gpu::shaders::bvh::{RefitNodes, RefitNodesParams, RefitTriangles, RefitTrianglesParams};
use crate::gpu::shaders::types::{BvhBounds, BvhSlot};
use crate::gpu::{Buffer, Context, GpuError, Recorder, TexelBuffer};
use glam::Vec3;
use rayon::prelude::*;
use topology::{Node, Topology};

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

/// Texels of a node and of a triangle; the layout is that of glsl/lib/bvh_pack.glsl.
pub const NODE_TEXELS: usize = 3;
pub const TRIANGLE_TEXELS: usize = 3;

/// The hierarchy on the device.
pub struct Bvh {
    /// node_count, the root first; never empty.
    nodes: TexelBuffer,
    /// triangle_count (at least one is allocated), in leaf order.
    triangles: TexelBuffer,
    /// triangle_count, in leaf order.
    slots: Buffer<BvhSlot>,
    level_first: Buffer<u32>,
    /// node_count, metres.
    node_bounds: Buffer<BvhBounds>,
    /// node_count, m2.
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
        let slot = |&triangle: &u32| BvhSlot { vertices: triangles[triangle as usize].into(), triangle };
        let slots: Vec<BvhSlot> = topology.slots.par_iter().map(slot).collect();
        // What stays when bounds move: kinds and places of the children.
        let texels = |node: &Node| {
            let kinds = node.kinds.iter().rev().fold(0, |word, kind| word << 2 | kind);
            [[0, 0, 0, kinds << 24], [0; 4], [0, 0, node.first_child, node.first_slot]]
        };
        let nodes: Vec<[[u32; 4]; NODE_TEXELS]> = topology.nodes.par_iter().map(texels).collect();
        let mut bvh = Self {
            nodes: context.texel_buffer("bvh/nodes", NODE_TEXELS * nodes.len())?,
            triangles: context.texel_buffer("bvh/triangles", TRIANGLE_TEXELS * slots.len().max(1))?,
            slots: context.upload("bvh/slots", &slots)?,
            level_first: context.upload("bvh/level first", &topology.level_first)?,
            node_bounds: context.buffer("bvh/node bounds", nodes.len())?,
            subtree_costs: context.buffer("bvh/subtree costs", nodes.len())?,
            levels: topology.level_first,
            vertex_count: positions.len(),
            built_cost: 0.0,
        };
        context.write(bvh.nodes.buffer(), nodes.as_flattened())?;
        let positions = context.upload("bvh/positions", positions)?;
        let mut recorder = context.recorder("bvh build")?;
        bvh.refit(&mut recorder, &positions)?;
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
            let triangle_count = self.slots.len() as u32;
            recorder.dispatch(
                &RefitTriangles {
                    bvh_slots: &self.slots,
                    positions,
                    triangle_texels: self.triangles.buffer(),
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
                    triangle_texels: self.triangles.buffer(),
                    node_texels: self.nodes.buffer(),
                    node_bounds: &self.node_bounds,
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
        let root = context.download_range(&self.node_bounds, 0..1)?;
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
        let mut triangles = vec![[0; 3]; self.slots.len()];
        for slot in context.download(&self.slots)? {
            triangles[slot.triangle as usize] = slot.vertices.to_array();
        }
        *self = Self::build(context, &positions, &triangles)?;
        Ok(())
    }

    pub fn nodes(&self) -> &TexelBuffer {
        &self.nodes
    }

    /// Triangles in leaf order.
    pub fn triangles(&self) -> &TexelBuffer {
        &self.triangles
    }

    pub fn size_bytes(&self) -> u64 {
        self.nodes.size_bytes()
            + self.triangles.size_bytes()
            + self.slots.size_bytes()
            + self.level_first.size_bytes()
            + self.node_bounds.size_bytes()
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

/// m2; zero for nothing.
fn surface_area(bounds: &BvhBounds) -> f32 {
    let size = (bounds.high - bounds.low).max(Vec3::ZERO);
    2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
}
