//! Parts of a scene that move as one: whatever hangs below an animated node, down to the next one.
//!
//! Of each object: where it was at rest, and a hull that tells whether others reach into it. Scenes whose surfaces deform,
//! or scale, have no such objects ([`RigidObjects::of`] gives none).

use super::geometry::Geometry;
use super::pose::Pose;
use super::{Scene, Track};
use glam::{Mat3, Mat4, Vec3};

/// Objects that are told apart; a scene with more has none.
pub const MAX_OBJECTS: usize = 32;

/// How far a transform may be from a rotation.
const TOLERANCE: f32 = 1e-3;

/// The objects of a scene; the first is all that stands still.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidObjects {
    /// The node that carries each; none carries the first.
    nodes: Vec<Option<u32>>,
    /// Of each triangle.
    pub triangle_objects: Vec<u32>,
}

impl RigidObjects {
    /// None where nothing moves, something deforms, or more moves than can be told apart.
    pub fn of(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        let channels = || scene.clips.iter().flat_map(|clip| &clip.channels);
        let mut is_driven = vec![false; scene.nodes.len()];
        for channel in channels() {
            match channel.track {
                Track::Translation(_) | Track::Rotation(_) => *is_driven.get_mut(channel.node as usize)? = true,
                Track::Scale(_) | Track::MorphWeights { .. } => return None,
            }
        }
        if geometry.parts.iter().any(|part| part.skin_offset.is_some()) {
            return None;
        }
        let mut objects = Self { nodes: vec![None], triangle_objects: vec![0; geometry.triangles.len()] };
        for part in &geometry.parts {
            let above = std::iter::successors(Some(part.node), |&node| scene.nodes[node as usize].parent);
            let Some(node) = above.into_iter().find(|&node| is_driven[node as usize]) else { continue };
            let object = objects.nodes.iter().position(|&known| known == Some(node)).unwrap_or_else(|| {
                objects.nodes.push(Some(node));
                objects.nodes.len() - 1
            });
            let first = part.triangle_offset as usize;
            objects.triangle_objects[first..first + part.triangle_count as usize].fill(object as u32);
        }
        (2..=MAX_OBJECTS).contains(&objects.nodes.len()).then_some(objects)
    }

    pub fn count(&self) -> usize {
        self.nodes.len()
    }

    /// The node's name; that of the first object is empty.
    pub fn name<'a>(&self, scene: &'a Scene, object: usize) -> &'a str {
        self.nodes[object].map_or("", |node| &scene.nodes[node as usize].name)
    }

    /// Where each object went from its rest; none where one of them is not as it was, but larger, or bent.
    pub fn world_from_rest(&self, rest: &Pose, pose: &Pose) -> Option<Vec<Mat4>> {
        let moved = |node: &Option<u32>| {
            let Some(node) = *node else { return Some(Mat4::IDENTITY) };
            let moved = pose.world_from_node[node as usize] * rest.world_from_node[node as usize].inverse();
            let linear = Mat3::from_mat4(moved);
            let off = (linear.transpose() * linear - Mat3::IDENTITY).to_cols_array();
            let is_rigid = off.iter().all(|value| value.abs() < TOLERANCE) && linear.determinant() > 0.0;
            is_rigid.then_some(moved)
        };
        self.nodes.iter().map(moved).collect()
    }
}

/// What holds all points of an object: between two planes along each of a few directions. Larger than the convex hull.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    spans: Vec<(f32, f32)>,
}

/// Directions of the planes: the axes, diagonals of faces, diagonals.
fn directions() -> impl Iterator<Item = Vec3> {
    let signs = [-1.0, 0.0, 1.0];
    let all = signs
        .into_iter()
        .flat_map(move |x| signs.map(|y| (x, y)))
        .flat_map(move |(x, y)| signs.map(move |z| Vec3::new(x, y, z)));
    // One of each pair of opposites.
    all.filter(|v| *v != Vec3::ZERO && v.to_array().into_iter().find(|&c| c != 0.0) == Some(1.0)).map(Vec3::normalize)
}

impl Hull {
    pub fn of(points: impl Iterator<Item = Vec3> + Clone) -> Self {
        let span = |direction: Vec3| {
            points
                .clone()
                .map(|point| point.dot(direction))
                .fold((f32::MAX, f32::MIN), |(low, high), at| (low.min(at), high.max(at)))
        };
        Self { spans: directions().map(span).collect() }
    }

    /// Whether the polygon of `corners` reaches into the hull, by more than `slack` metres; true also for some that pass
    /// close by.
    pub fn meets(&self, corners: &[Vec3], slack: f32) -> bool {
        directions().zip(&self.spans).all(|(direction, &(low, high))| {
            let along = corners.iter().map(|corner| corner.dot(direction));
            let (least, most) = along.fold((f32::MAX, f32::MIN), |(low, high), at| (low.min(at), high.max(at)));
            most > low + slack && least < high - slack
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hulls_meet_what_reaches_into_them() {
        let corners = |low: f32, high: f32| {
            (0..8).map(move |k| Vec3::new([low, high][k & 1], [low, high][k >> 1 & 1], [low, high][k >> 2]))
        };
        assert_eq!(directions().count(), 13);
        let hull = Hull::of(corners(0.0, 1.0));
        let square = |at: Vec3| [at, at + Vec3::X, at + Vec3::X + Vec3::Z, at + Vec3::Z];
        assert!(hull.meets(&square(Vec3::new(0.5, 0.5, 0.5)), 1e-4));
        assert!(hull.meets(&square(Vec3::new(-0.5, 0.5, -0.5)), 1e-4), "a corner inside");
        assert!(!hull.meets(&square(Vec3::new(0.2, 1.1, 0.2)), 1e-4));
        assert!(!hull.meets(&square(Vec3::new(-0.5, 1.0, -0.5)), 1e-4), "touching is not reaching in");
        // Beside an edge, where a box of axes alone would say it meets a slanted one.
        let slanted = Hull::of(corners(0.0, 1.0).filter(|p| p.x + p.y < 1.5));
        assert!(!slanted.meets(&[Vec3::new(0.9, 0.9, 0.2), Vec3::new(0.9, 0.9, 0.8), Vec3::new(0.8, 0.9, 0.5)], 1e-4));
    }
}
