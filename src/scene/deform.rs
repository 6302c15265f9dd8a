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
    let count = geometry.local_positions.len();
    let mut world = WorldVertices {
        positions: Vec::with_capacity(count),
        normals: Vec::with_capacity(count),
        tangents: Vec::with_capacity(count),
    };
    for part in &geometry.parts {
        for slot in 0..part.vertex_count {
            let vertex = (part.vertex_offset + slot) as usize;
            let mut position = geometry.local_positions[vertex];
            let mut normal = geometry.local_normals[vertex];
            let mut tangent = geometry.local_tangents[vertex].truncate();
            for target in 0..part.morph_target_count {
                let weight = pose.morph_weights[(part.morph_weight_offset + target) as usize];
                let delta = (part.morph_offset + target * part.vertex_count + slot) as usize;
                position += weight * geometry.morph_positions[delta];
                normal += weight * geometry.morph_normals[delta];
                tangent += weight * geometry.morph_tangents[delta];
            }
            let world_from_local = match part.skin_offset {
                None => pose.world_from_node[part.node as usize],
                Some(first) => {
                    let influence = (first + slot) as usize;
                    let joints = geometry.skin_joints[influence];
                    blend(&pose.joint_palette, joints, geometry.skin_weights[influence])
                }
            };
            let linear = Mat3::from_mat4(world_from_local);
            let handedness = geometry.local_tangents[vertex].w;
            let mirror = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
            let normal = unit_or(normal_matrix(linear) * normal, geometry.local_normals[vertex]);
            world.positions.push(world_from_local.transform_point3(position));
            world.normals.push(normal);
            world.tangents.push(unit_or(linear * tangent, tangent).extend(handedness * mirror));
        }
    }
    world
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
