//! The plain CPU reference of the GPU's deformation pass: morph, then skin or node transform, to world space.
//!
//! Used as the twin in tests and to build the first BVH. Slow and simple on purpose.

use glam::{Mat3, Mat4, Vec3, Vec4};

use super::geometry::Geometry;
use super::pose::Pose;

/// World-space vertex attributes, one per vertex of the [`Geometry`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WorldVertices {
    /// Metres.
    pub positions: Vec<Vec3>,
    /// Unit.
    pub normals: Vec<Vec3>,
    /// xyz unit, w handedness (turned about where the part's transform mirrors).
    pub tangents: Vec<Vec4>,
}

impl WorldVertices {
    /// Smallest and largest corner of what is finite; `None` without any finite vertex.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let finite = self.positions.iter().copied().filter(|position| position.is_finite());
        finite.fold(None, |bounds, position| {
            let [low, high] = bounds.unwrap_or([position; 2]);
            Some([low.min(position), high.max(position)])
        })
    }
}

/// Deforms every vertex of `geometry` by `pose`; both must come from the same scene.
pub fn world_vertices(geometry: &Geometry, pose: &Pose) -> WorldVertices {
    let count = geometry.vertex_count();
    let mut world = WorldVertices {
        positions: Vec::with_capacity(count as usize),
        normals: Vec::with_capacity(count as usize),
        tangents: Vec::with_capacity(count as usize),
    };
    for vertex in 0..count {
        let v = vertex as usize;
        let (mut normal, mut tangent) = (geometry.local_normals[v], geometry.local_tangents[v].truncate());
        for (weight, delta) in morphs(geometry, pose, vertex) {
            normal += weight * geometry.morph_normals[delta];
            tangent += weight * geometry.morph_tangents[delta];
        }
        let linear = Mat3::from_mat4(world_from_local(geometry, pose, vertex));
        let mirror = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        world.positions.push(world_position(geometry, pose, vertex));
        world.normals.push(unit_or(normal_matrix(linear) * normal, geometry.local_normals[v]));
        world.tangents.push(unit_or(linear * tangent, tangent).extend(geometry.local_tangents[v].w * mirror));
    }
    world
}

/// World positions alone, one per vertex.
pub fn world_positions(geometry: &Geometry, pose: &Pose) -> Vec<Vec3> {
    (0..geometry.vertex_count()).map(|vertex| world_position(geometry, pose, vertex)).collect()
}

pub(super) fn world_position(geometry: &Geometry, pose: &Pose, vertex: u32) -> Vec3 {
    let mut position = geometry.local_positions[vertex as usize];
    for (weight, delta) in morphs(geometry, pose, vertex) {
        position += weight * geometry.morph_positions[delta];
    }
    world_from_local(geometry, pose, vertex).transform_point3(position)
}

/// The vertex's morph targets as (weight, index of the displacement).
fn morphs(geometry: &Geometry, pose: &Pose, vertex: u32) -> impl Iterator<Item = (f32, usize)> {
    let part = geometry.parts[geometry.vertex_part[vertex as usize] as usize];
    (0..part.morph_target_count).map(move |target| {
        let weight = pose.morph_weights[(part.morph_weight_offset + target) as usize];
        let delta = part.morph_offset + target * part.vertex_count + (vertex - part.vertex_offset);
        (weight, delta as usize)
    })
}

/// What places the vertex: its node, or the blend of the joints that hold it.
fn world_from_local(geometry: &Geometry, pose: &Pose, vertex: u32) -> Mat4 {
    let part = geometry.parts[geometry.vertex_part[vertex as usize] as usize];
    match part.skin_offset {
        None => pose.world_from_node[part.node as usize],
        Some(first) => {
            let influence = (first + vertex - part.vertex_offset) as usize;
            blend(&pose.joint_palette, geometry.skin_joints[influence], geometry.skin_weights[influence])
        }
    }
}

/// Linear blend of palette entries.
fn blend(palette: &[Mat4], joints: [u32; 8], weights: [f32; 8]) -> Mat4 {
    let mut sum = Mat4::ZERO;
    for (joint, weight) in joints.into_iter().zip(weights) {
        if weight != 0.0 {
            sum += palette[joint as usize] * weight;
        }
    }
    sum
}

/// The inverse transpose of `linear` up to a positive factor, from its cofactors: defined for singular matrices
/// too, as when a node is scaled flat.
pub fn normal_matrix(linear: Mat3) -> Mat3 {
    let largest = linear.to_cols_array().into_iter().fold(0.0f32, |m, v| m.max(v.abs()));
    // Scaled first, so that products of small scales do not vanish.
    let m = if largest > 0.0 { linear * largest.recip() } else { linear };
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign
}

fn unit_or(vector: Vec3, otherwise: Vec3) -> Vec3 {
    vector.try_normalize().unwrap_or(otherwise)
}
