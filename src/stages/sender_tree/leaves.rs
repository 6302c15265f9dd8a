//! Shapes of leaves, and the leaves of methods whose light lives on vertices.

use super::{SenderTree, SenderTreeError, TreeOptions};
use crate::gpu::shaders::sender_tree::{VertexLight, VertexLightParams};
use crate::gpu::shaders::types::SenderLeaf;
use crate::gpu::{Buffer, Context, Recorder};
use glam::{UVec3, Vec3};

/// The triangle of these corners (metres), counter-clockwise seen from the side that sends.
pub fn triangle([a, b, c]: [Vec3; 3]) -> SenderLeaf {
    SenderLeaf { centre: (a + b + c) / 3.0, edge_u: b - a, edge_v: c - a, is_triangle: 1 }
}

/// The parallelogram with these sides (metres) about `centre`; it sends towards `side_u` x `side_v`.
pub fn parallelogram(centre: Vec3, side_u: Vec3, side_v: Vec3) -> SenderLeaf {
    SenderLeaf { centre, edge_u: side_u, edge_v: side_v, is_triangle: 0 }
}

/// A square of `area` (m2) about `centre` that sends along `normal` (unit): what a surfel or a disc sends.
pub fn disc(centre: Vec3, normal: Vec3, area: f32) -> SenderLeaf {
    let (u, v) = normal.any_orthonormal_pair();
    let side = area.max(0.0).sqrt();
    // The pair is right-handed about the normal: u x v = normal.
    parallelogram(centre, side * u, side * v)
}

/// The leaves of a scene's triangles: every front, then the back of each triangle whose first vertex has an entry in
/// `back_elements` (per vertex, u32::MAX where the surface is one-sided). Beside each leaf the elements at its corners.
pub fn triangle_leaves(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    back_elements: &[u32],
) -> (Vec<SenderLeaf>, Vec<UVec3>) {
    let fronts = triangles.iter().map(|&t| (t, t));
    let backs = triangles.iter().filter(|t| back_elements[t[0] as usize] != u32::MAX).map(|&[a, b, c]| {
        let vertices = [a, c, b];
        (vertices, vertices.map(|v| back_elements[v as usize]))
    });
    fronts
        .chain(backs)
        .map(|(vertices, elements)| (triangle(vertices.map(|v| positions[v as usize])), UVec3::from(elements)))
        .unzip()
}

/// A tree over the triangles between elements that stand at vertices.
pub struct VertexLeaves {
    pub tree: SenderTree,
    leaf_elements: Buffer<UVec3>,
    emitted: Buffer<Vec3>,
    reflected: Buffer<Vec3>,
}

/// What elements at vertices hold, one entry each.
#[derive(Clone, Copy)]
pub struct VertexElements<'a> {
    /// W m^-2 sr^-1.
    pub emission: &'a Buffer<Vec3>,
    pub albedo: &'a Buffer<Vec3>,
    /// W/m2: their sum is what the elements reflect by their albedo.
    pub punctual: &'a Buffer<Vec3>,
    pub direct: &'a Buffer<Vec3>,
    pub indirect: &'a Buffer<Vec3>,
}

impl VertexLeaves {
    /// `positions` in world space, `back_elements` per vertex as in [`triangle_leaves`].
    pub fn new(
        context: &Context,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        back_elements: &[u32],
        options: TreeOptions,
    ) -> Result<Self, SenderTreeError> {
        let (leaves, elements) = triangle_leaves(positions, triangles, back_elements);
        Ok(Self {
            tree: SenderTree::build(context, &leaves, options)?,
            leaf_elements: context.upload("sender_tree/leaf elements", &elements)?,
            emitted: context.buffer("sender_tree/emitted", leaves.len())?,
            reflected: context.buffer("sender_tree/reflected", leaves.len())?,
        })
    }

    /// Fills the tree; without `has_reflected` with the elements' own emission alone.
    pub fn fill(&self, recorder: &mut Recorder<'_>, elements: VertexElements<'_>, has_reflected: bool) {
        let leaf_count = self.leaf_elements.len() as u32;
        let pass = VertexLight {
            leaf_elements: &self.leaf_elements,
            emission: elements.emission,
            albedo: elements.albedo,
            punctual: elements.punctual,
            direct: elements.direct,
            indirect: elements.indirect,
            emitted: &self.emitted,
            reflected: &self.reflected,
            params: VertexLightParams { leaf_count, has_reflected: u32::from(has_reflected) },
        };
        recorder.dispatch(&pass, leaf_count);
        self.tree.pull(recorder, &self.emitted, &self.reflected);
    }
}
