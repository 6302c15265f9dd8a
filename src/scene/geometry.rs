//! The scene flattened for the stages: one vertex per finite element, triangles with global indices.
//!
//! Every instance of a mesh has its own vertices, since each element carries its own light. Positions stay in the
//! space of the mesh ("local"): [`super::deform::world_vertices`] and the GPU's deformation pass place them, morph
//! first, then by joint palette or node. Vertices along hard edges and texture seams are separate elements at the
//! same place; [`super::adjacency::weld`] finds them.

use glam::{Mat3, Vec2, Vec3, Vec4};
use thiserror::Error;

use super::pose::{Pose, PoseLayout};
use super::{Primitive, Scene, deform};

/// Flat vertex and triangle arrays. Vertices and triangles of a part are contiguous, parts in node order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Geometry {
    /// Mesh space, metres before the node's scale.
    pub local_positions: Vec<Vec3>,
    /// Unit.
    pub local_normals: Vec<Vec3>,
    /// xyz unit, w = +1 or -1 handedness; any perpendicular where the primitive has none.
    pub local_tangents: Vec<Vec4>,
    /// Zero where the primitive has none.
    pub uv: [Vec<Vec2>; 2],
    /// Linear RGBA; white where the primitive has none.
    pub colors: Vec<Vec4>,
    /// Index in `parts`, one per vertex.
    pub vertex_part: Vec<u32>,

    /// Global vertex indices, counter-clockwise seen from the front in world space at rest.
    pub triangles: Vec<[u32; 3]>,
    /// Index in `parts`, one per triangle.
    pub triangle_part: Vec<u32>,
    pub parts: Vec<Part>,

    /// Influences of the vertices of skinned parts only ([`Part::skin_offset`]): indices into the whole
    /// [`Pose::joint_palette`], weights that sum to one; unused slots have weight 0.
    pub skin_joints: Vec<[u32; 8]>,
    pub skin_weights: Vec<[f32; 8]>,

    /// Displacements ([`Part::morph_offset`]): entry `morph_offset + target * vertex_count + (vertex -
    /// vertex_offset)`. All three arrays have the same length.
    pub morph_positions: Vec<Vec3>,
    pub morph_normals: Vec<Vec3>,
    pub morph_tangents: Vec<Vec3>,
}

/// One drawn (node, primitive) pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    pub node: u32,
    pub mesh: u32,
    /// Index within the mesh.
    pub primitive: u32,
    pub material: u32,
    pub vertex_offset: u32,
    pub vertex_count: u32,
    pub triangle_offset: u32,
    pub triangle_count: u32,
    /// The part is mirrored at rest: its triangles were flipped against the file's order.
    pub mirrored: bool,
    /// First influence in `skin_joints`, one per vertex; `None` moves rigidly with its node.
    pub skin_offset: Option<u32>,
    pub morph_target_count: u32,
    pub morph_offset: u32,
    /// First weight in [`Pose::morph_weights`].
    pub morph_weight_offset: u32,
}

#[derive(Debug, Clone, PartialEq, Error)]
pub enum GeometryError {
    #[error(
        "{what} needs {needed} bytes, {available} are allowed; use fewer elements (--elements) or fewer instances, or raise --max-memory"
    )]
    OutOfMemory { what: &'static str, needed: u64, available: u64 },
    #[error("{what}: {needed} needed, at most {allowed} can be indexed; use fewer elements (--elements) or instances")]
    TooMany { what: &'static str, needed: u64, allowed: u64 },
    #[error(
        "node {node}: a vertex stands at {position} in world space, at most {MAX_COORDINATE:e} m a side is allowed; scale the scene down"
    )]
    TooFar { node: u32, position: Vec3 },
    #[error("mesh {mesh}, primitive {primitive}: {what} {value}, allowed is below {allowed}; check the loader's input")]
    OutOfRange { mesh: u32, primitive: u32, what: &'static str, value: u64, allowed: u64 },
}

/// World coordinates beyond this (metres) are refused: their squared areas no longer fit an f32.
pub const MAX_COORDINATE: f32 = 1e9;

/// Counts that decide the memory of a [`Geometry`]. Arithmetic saturates: a saturated count is refused.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct GeometryCounts {
    pub vertices: u64,
    pub triangles: u64,
    pub parts: u64,
    pub skinned_vertices: u64,
    pub morph_deltas: u64,
}

const BYTES_PER_VERTEX: u64 = 12 + 12 + 16 + 2 * 8 + 16 + 4;
const BYTES_PER_TRIANGLE: u64 = 12 + 4;
const BYTES_PER_INFLUENCE: u64 = 32 + 32;
const BYTES_PER_DELTA: u64 = 3 * 12;

impl GeometryCounts {
    /// What [`Geometry::flatten`] will hold.
    pub fn of(scene: &Scene) -> Self {
        let mut counts = Self::default();
        for Drawn { primitive, skinned, .. } in drawn(scene) {
            let vertices = primitive.positions.len() as u64;
            let deltas = vertices.saturating_mul(primitive.morph_targets.len() as u64);
            counts.parts += 1;
            counts.vertices = counts.vertices.saturating_add(vertices);
            counts.triangles = counts.triangles.saturating_add(primitive.triangles.len() as u64);
            counts.skinned_vertices = counts.skinned_vertices.saturating_add(if skinned { vertices } else { 0 });
            counts.morph_deltas = counts.morph_deltas.saturating_add(deltas);
        }
        counts
    }

    pub fn bytes(&self) -> u64 {
        let parts = self.parts.saturating_mul(size_of::<Part>() as u64);
        [
            self.vertices.saturating_mul(BYTES_PER_VERTEX),
            self.triangles.saturating_mul(BYTES_PER_TRIANGLE),
            self.skinned_vertices.saturating_mul(BYTES_PER_INFLUENCE),
            self.morph_deltas.saturating_mul(BYTES_PER_DELTA),
        ]
        .into_iter()
        .fold(parts, u64::saturating_add)
    }

    /// Refuses what cannot be indexed by u32 or exceeds the budget.
    pub fn check(&self, what: &'static str, max_memory_bytes: u64) -> Result<(), GeometryError> {
        self.check_beside(what, 0, max_memory_bytes)
    }

    /// As [`Self::check`], `beside` bytes being held at the same time.
    pub(super) fn check_beside(
        &self,
        what: &'static str,
        beside: u64,
        max_memory_bytes: u64,
    ) -> Result<(), GeometryError> {
        let allowed = u64::from(u32::MAX);
        for (what, needed) in [
            ("vertices", self.vertices),
            // Flat index arrays hold three entries a triangle.
            ("triangle corners", self.triangles.saturating_mul(3)),
            ("parts", self.parts),
            ("morph displacements", self.morph_deltas),
        ] {
            if needed > allowed {
                return Err(GeometryError::TooMany { what, needed, allowed });
            }
        }
        let needed = self.bytes().saturating_add(beside);
        if needed > max_memory_bytes {
            return Err(GeometryError::OutOfMemory { what, needed, available: max_memory_bytes });
        }
        Ok(())
    }
}

struct Drawn<'a> {
    node: usize,
    mesh: u32,
    /// Index within the mesh.
    slot: usize,
    primitive: &'a Primitive,
    skinned: bool,
}

/// Every drawn (node, primitive) pair, in node order.
fn drawn(scene: &Scene) -> impl Iterator<Item = Drawn<'_>> {
    scene.nodes.iter().enumerate().flat_map(move |(node, described)| {
        let mesh = described.mesh.unwrap_or(u32::MAX);
        let primitives = scene.meshes.get(mesh as usize).map_or(&[][..], |mesh| &mesh.primitives);
        let skin = described.skin.and_then(|skin| scene.skins.get(skin as usize));
        let has_joints = skin.is_some_and(|skin| !skin.joints.is_empty());
        primitives.iter().enumerate().filter_map(move |(slot, primitive)| {
            let count = primitive.positions.len();
            let empty = count == 0 || primitive.triangles.is_empty();
            let skinned = has_joints && primitive.joints.len() == count && primitive.joint_weights.len() == count;
            (!empty).then_some(Drawn { node, mesh, slot, primitive, skinned })
        })
    })
}

impl Geometry {
    /// Flattens `scene`, every instance expanded. Needs at most `max_memory_bytes`, checked before allocating.
    pub fn flatten(scene: &Scene, max_memory_bytes: u64) -> Result<Self, GeometryError> {
        let counts = GeometryCounts::of(scene);
        counts.check("the flattened scene", max_memory_bytes)?;
        let layout = PoseLayout::of(scene);
        let rest = Pose::rest(scene);

        let mut geometry = Self::with_capacity(&counts);
        for drawn in drawn(scene) {
            geometry.push_part(scene, &layout, &rest, drawn)?;
        }
        geometry.check_extent(&rest)?;
        Ok(geometry)
    }

    /// Refuses vertices too far away to compute with, or not finite at all, at rest.
    fn check_extent(&self, rest: &Pose) -> Result<(), GeometryError> {
        for (vertex, &part) in self.vertex_part.iter().enumerate() {
            let position = deform::world_position(self, rest, vertex as u32);
            if position.is_nan() || position.abs().max_element() > MAX_COORDINATE {
                return Err(GeometryError::TooFar { node: self.parts[part as usize].node, position });
            }
        }
        Ok(())
    }

    pub fn vertex_count(&self) -> u32 {
        self.local_positions.len() as u32
    }

    pub fn triangle_count(&self) -> u32 {
        self.triangles.len() as u32
    }

    pub fn counts(&self) -> GeometryCounts {
        GeometryCounts {
            vertices: self.local_positions.len() as u64,
            triangles: self.triangles.len() as u64,
            parts: self.parts.len() as u64,
            skinned_vertices: self.skin_joints.len() as u64,
            morph_deltas: self.morph_positions.len() as u64,
        }
    }

    pub(super) fn with_capacity(counts: &GeometryCounts) -> Self {
        let (vertices, triangles) = (counts.vertices as usize, counts.triangles as usize);
        let (influences, deltas) = (counts.skinned_vertices as usize, counts.morph_deltas as usize);
        Self {
            local_positions: Vec::with_capacity(vertices),
            local_normals: Vec::with_capacity(vertices),
            local_tangents: Vec::with_capacity(vertices),
            uv: [Vec::with_capacity(vertices), Vec::with_capacity(vertices)],
            colors: Vec::with_capacity(vertices),
            vertex_part: Vec::with_capacity(vertices),
            triangles: Vec::with_capacity(triangles),
            triangle_part: Vec::with_capacity(triangles),
            parts: Vec::with_capacity(counts.parts as usize),
            skin_joints: Vec::with_capacity(influences),
            skin_weights: Vec::with_capacity(influences),
            morph_positions: Vec::with_capacity(deltas),
            morph_normals: Vec::with_capacity(deltas),
            morph_tangents: Vec::with_capacity(deltas),
        }
    }

    fn push_part(
        &mut self,
        scene: &Scene,
        layout: &PoseLayout,
        rest: &Pose,
        Drawn { node, mesh, slot, primitive, skinned }: Drawn,
    ) -> Result<(), GeometryError> {
        let count = primitive.positions.len();
        let part_index = self.parts.len() as u32;
        let out_of_range = |what, value, allowed| {
            Err(GeometryError::OutOfRange { mesh, primitive: slot as u32, what, value, allowed })
        };
        if let Some(index) = primitive.triangles.iter().flatten().find(|&&index| index as usize >= count) {
            return out_of_range("vertex index", u64::from(*index), count as u64);
        }
        if primitive.material as usize >= scene.materials.len() {
            return out_of_range("material index", u64::from(primitive.material), scene.materials.len() as u64);
        }

        let mut part = Part {
            node: node as u32,
            mesh,
            primitive: slot as u32,
            material: primitive.material,
            vertex_offset: self.vertex_count(),
            vertex_count: count as u32,
            triangle_offset: self.triangle_count(),
            triangle_count: primitive.triangles.len() as u32,
            mirrored: Mat3::from_mat4(rest.world_from_node[node]).determinant() < 0.0,
            skin_offset: None,
            morph_target_count: primitive.morph_targets.len() as u32,
            morph_offset: self.morph_positions.len() as u32,
            morph_weight_offset: layout.weight_offset[node],
        };
        if skinned && let Some(skin) = scene.nodes[node].skin {
            let (first, joint_count) = (layout.palette_offset[skin as usize], scene.skins[skin as usize].joints.len());
            part.skin_offset = Some(self.skin_joints.len() as u32);
            self.push_influences(primitive, first, joint_count as u32);
            part.mirrored = self.skin_is_mirrored(&part, rest);
        }
        self.push_attributes(primitive);
        self.vertex_part.extend(std::iter::repeat_n(part_index, count));
        for target in &primitive.morph_targets {
            push_or(&mut self.morph_positions, &target.positions, count, |_| Vec3::ZERO);
            push_or(&mut self.morph_normals, &target.normals, count, |_| Vec3::ZERO);
            push_or(&mut self.morph_tangents, &target.tangents, count, |_| Vec3::ZERO);
        }
        self.triangles.extend(primitive.triangles.iter().map(|&[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|index| part.vertex_offset + index);
            if part.mirrored { [a, c, b] } else { [a, b, c] }
        }));
        self.triangle_part.extend(std::iter::repeat_n(part_index, primitive.triangles.len()));
        self.parts.push(part);
        Ok(())
    }

    fn push_attributes(&mut self, primitive: &Primitive) {
        let count = primitive.positions.len();
        self.local_positions.extend_from_slice(&primitive.positions);
        if primitive.normals.len() == count {
            self.local_normals.extend_from_slice(&primitive.normals);
        } else {
            self.local_normals.extend(smooth_normals(&primitive.positions, &primitive.triangles));
        }
        let first = self.local_normals.len() - count;
        let normals = &self.local_normals[first..];
        push_or(&mut self.local_tangents, &primitive.tangents, count, |i| any_tangent(normals[i]));
        for (set, values) in self.uv.iter_mut().zip(&primitive.uv) {
            push_or(set, values, count, |_| Vec2::ZERO);
        }
        push_or(&mut self.colors, &primitive.colors, count, |_| Vec4::ONE);
    }

    fn push_influences(&mut self, primitive: &Primitive, first: u32, joint_count: u32) {
        for (joints, weights) in primitive.joints.iter().zip(&primitive.joint_weights) {
            // An unused slot may name any joint: clamped so that nothing ever reads outside the skin.
            self.skin_joints.push(joints.map(|joint| first + u32::from(joint).min(joint_count - 1)));
            self.skin_weights.push(*weights);
        }
    }

    /// Whether most of the influence on a skinned part comes from mirroring joints.
    fn skin_is_mirrored(&self, part: &Part, rest: &Pose) -> bool {
        let sign: Vec<f64> = (rest.joint_palette.iter())
            .map(|matrix| if Mat3::from_mat4(*matrix).determinant() < 0.0 { -1.0 } else { 1.0 })
            .collect();
        let first = part.skin_offset.unwrap_or(0) as usize;
        let influences = self.skin_joints[first..].iter().zip(&self.skin_weights[first..]);
        let balance: f64 = influences
            .flat_map(|(joints, weights)| joints.iter().zip(weights))
            .map(|(&joint, &weight)| f64::from(weight) * sign.get(joint as usize).copied().unwrap_or(1.0))
            .sum();
        balance < 0.0
    }
}

/// Appends `values` when there are `count` of them, else `count` made values.
fn push_or<T: Copy>(into: &mut Vec<T>, values: &[T], count: usize, make: impl Fn(usize) -> T) {
    if values.len() == count {
        into.extend_from_slice(values);
    } else {
        into.extend((0..count).map(make));
    }
}

/// Some unit tangent perpendicular to `normal`.
fn any_tangent(normal: Vec3) -> Vec4 {
    normal.try_normalize().map_or(Vec3::X, |normal| normal.any_orthonormal_vector()).extend(1.0)
}

/// Area-weighted vertex normals; +Y for a vertex without a triangle of area.
fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|index| positions[index as usize]);
        for &index in triangle {
            sums[index as usize] += (b - a).cross(c - a);
        }
    }
    sums.into_iter().map(|sum| sum.try_normalize().unwrap_or(Vec3::Y)).collect()
}
