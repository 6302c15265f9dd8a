//! Meshes: triangles and vertex attributes of every primitive, only the vertices its triangles use.

use super::accessor::{Accessor, Component, Selection};
use super::document::Document;
use super::error::Fault;
use super::json::Object;
use super::surface;
use super::tangent;
use super::topology::{self, Mode};
use crate::scene::{Material, Mesh, MorphTarget, Primitive, TextureRef};
use glam::{Vec2, Vec3, Vec4};

use Component::{F32, I8, I16, U8, U16, U32};

/// What of a material a primitive's vertices depend on.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Our material index.
    pub material: u32,
    /// The normal map, which needs tangents.
    pub normal_texture: Option<TextureRef>,
}

impl Wanted {
    pub fn new(material: u32, materials: &[Material]) -> Self {
        Self { material, normal_texture: materials[material as usize].normal_texture }
    }
}

/// Degenerate triangles and other repairs, summed over the file to be noted once.
#[derive(Debug, Default)]
pub struct Repairs {
    pub degenerate_triangles: usize,
    pub lost_normals: usize,
    pub repaired_weights: usize,
}

impl Repairs {
    pub fn note(&self, document: &Document) {
        let counts = [
            (self.degenerate_triangles, "degenerate triangles were dropped."),
            (self.lost_normals, "normals of length zero were replaced by those of the triangles around."),
            (self.repaired_weights, "vertices with negative or only zero joint weights were repaired."),
        ];
        for (count, what) in counts {
            if count > 0 {
                document.notes.say(format!("{count} {what}"));
            }
        }
    }
}

/// Reads a mesh. `wanted` answers for the material of each primitive object.
pub fn read<'a>(
    document: &Document<'a>,
    object: &Object<'a>,
    wanted: impl Fn(&Object) -> Result<Wanted, Fault>,
    repairs: &mut Repairs,
) -> Result<Mesh, Fault> {
    let list = object.list("primitives")?;
    if list.is_empty() {
        return Err(Fault::invalid(object.at("primitives"), "must hold at least one primitive", "absent or empty"));
    }
    let mut mesh = Mesh { name: object.name(), ..Mesh::default() };
    let target_count = target_count(object)?;
    for primitive in list.objects() {
        let primitive = primitive?;
        let targets = primitive.list("targets")?.len();
        if targets != target_count {
            let rule = format!("must hold as many morph targets as the mesh's first primitive, {target_count}");
            return Err(Fault::invalid(primitive.at("targets"), rule, targets));
        }
        let wanted = wanted(&primitive)?;
        mesh.primitives.extend(Reader { document, object: &primitive }.read(wanted, repairs)?);
    }
    mesh.morph_weights = object.list("weights")?.numbers()?;
    if !mesh.morph_weights.is_empty() && mesh.morph_weights.len() != target_count {
        let rule = format!("must hold a weight for each of the {target_count} morph targets");
        return Err(Fault::invalid(object.at("weights"), rule, mesh.morph_weights.len()));
    }
    mesh.morph_weights.resize(target_count, 0.0);
    Ok(mesh)
}

/// Morph targets of a mesh object.
pub fn target_count(object: &Object) -> Result<usize, Fault> {
    let list = object.list("primitives")?;
    if list.is_empty() { Ok(0) } else { Ok(list.object(0)?.list("targets")?.len()) }
}

struct Reader<'r, 'a> {
    document: &'r Document<'a>,
    object: &'r Object<'a>,
}

/// Component types by attribute; `true` is normalized. The plain integers need KHR_mesh_quantization.
const POSITION: [(Component, bool); 9] = [
    (F32, false),
    (I8, false),
    (I8, true),
    (U8, false),
    (U8, true),
    (I16, false),
    (I16, true),
    (U16, false),
    (U16, true),
];
const DIRECTION: [(Component, bool); 3] = [(F32, false), (I8, true), (I16, true)];
const FRACTION: [(Component, bool); 3] = [(F32, false), (U8, true), (U16, true)];
const JOINTS: [(Component, bool); 2] = [(U8, false), (U16, false)];
const INDICES: [(Component, bool); 3] = [(U8, false), (U16, false), (U32, false)];

/// The extension that keeps vertices in a form of its own, beside which accessors may be empty shells.
const COMPRESSION: &str = "KHR_draco_mesh_compression";

impl<'a> Reader<'_, 'a> {
    /// `None` when there is nothing to draw, which is noted.
    fn read(&self, wanted: Wanted, repairs: &mut Repairs) -> Result<Option<Primitive>, Fault> {
        let notes = self.document.notes;
        let mode = match self.object.integer("mode")?.unwrap_or(4) {
            4 => Mode::Triangles,
            5 => Mode::TriangleStrip,
            6 => Mode::TriangleFan,
            0..=3 => {
                notes.say("Points and lines are not drawn.");
                return Ok(None);
            }
            _ => return Err(self.object.invalid("mode", "must be from 0 to 6")),
        };
        let attributes = self.object.require("attributes", self.object.object("attributes")?)?;
        let Some(positions) = Accessor::open(self.document, &attributes, "POSITION")? else {
            notes.say("A primitive without POSITION has no shape and was left out.");
            return Ok(None);
        };
        positions.expect("POSITION", &["VEC3"], &POSITION)?;
        // Some exporters leave out both the requirement and the uncompressed data that would make it optional.
        if positions.is_all_zero() && self.object.extension(COMPRESSION)?.is_some() {
            return Err(Fault::required_extension(self.object.pointer(), COMPRESSION.into()));
        }
        let vertex_count = positions.count;
        let mut triangles = self.read_triangles(mode, &positions)?;

        // Where nothing bends the shape, a triangle without area stays one; else it may open.
        let has_joints = attributes.has("JOINTS_0");
        let by_area = !has_joints && self.object.list("targets")?.is_empty();
        let mut used = topology::used_vertices(&triangles, vertex_count);
        let mut vertices = positions.read(self.document, Selection::These(&used), Vec3::from_array)?;
        topology::renumber(&mut triangles, &used);
        let dropped = topology::drop_degenerate(&mut triangles, &vertices, by_area);
        repairs.degenerate_triangles += dropped;
        if dropped > 0 {
            let still_used = topology::used_vertices(&triangles, vertices.len());
            topology::renumber(&mut triangles, &still_used);
            vertices = still_used.iter().map(|vertex| vertices[*vertex as usize]).collect();
            used = still_used.iter().map(|vertex| used[*vertex as usize]).collect();
        }
        if triangles.is_empty() {
            return Ok(None);
        }

        let mut primitive =
            Primitive { positions: vertices, triangles, material: wanted.material, ..Primitive::default() };
        let attributes = Attributes { document: self.document, object: &attributes, vertex_count, used: &used };
        attributes.read_into(&mut primitive, repairs)?;
        self.read_targets(&mut primitive, attributes)?;
        self.complete_surface(&mut primitive, attributes, wanted, repairs)?;
        Ok(Some(primitive))
    }

    fn read_triangles(&self, mode: Mode, positions: &Accessor) -> Result<Vec<[u32; 3]>, Fault> {
        let indices = Accessor::open(self.document, self.object, "indices")?;
        let vertex_count = positions.count;
        let corner_count = indices.as_ref().map_or(vertex_count, |indices| indices.count);
        let triangle_count = mode.triangle_count(corner_count) as u64;
        let pointer = self.object.pointer();
        // Each corner can become a vertex of its own, and vertices are numbered in 32 bits.
        if triangle_count * 3 >= u64::from(u32::MAX) {
            return Err(Fault::too_large(
                pointer,
                format!("must have less than {} triangles", u32::MAX / 3),
                triangle_count,
            ));
        }
        self.document.budget.reserve_array::<[u32; 3]>(triangle_count, || format!("the triangles of {pointer}"))?;
        let Some(indices) = indices else {
            positions.check_backed(corner_count)?;
            self.document.budget.reserve_array::<u32>(corner_count as u64, || format!("the corners of {pointer}"))?;
            return Ok(mode.triangles(&(0..vertex_count as u32).collect::<Vec<_>>()));
        };
        indices.expect("indices", &["SCALAR"], &INDICES)?;
        let restart = match indices.component {
            U8 => 0xff,
            U16 => 0xffff,
            _ => u32::MAX,
        };
        let corners = indices.read_indices(self.document)?;
        let bad = |corner: &u32| *corner as usize >= vertex_count || *corner == restart;
        match corners.iter().position(bad) {
            None => Ok(mode.triangles(&corners)),
            Some(at) => {
                let corner = corners[at];
                let rule = match corner == restart {
                    true => "must not hold the value that restarts primitives".to_owned(),
                    false => format!("must stay below the {vertex_count} vertices of {pointer}"),
                };
                Err(Fault::invalid(&indices.pointer, rule, format!("{corner} in element {at}")))
            }
        }
    }

    fn read_targets(&self, primitive: &mut Primitive, attributes: Attributes<'_, 'a>) -> Result<(), Fault> {
        for target in self.object.list("targets")?.objects() {
            let target = target?;
            let target = attributes.of(&target);
            let read =
                |key: &str, components: &[(Component, bool)]| target.read(key, &["VEC3"], components, Vec3::from_array);
            let has_normals = !primitive.normals.is_empty();
            primitive.morph_targets.push(MorphTarget {
                positions: read("POSITION", &POSITION)?,
                // Without normals to displace these would displace the flat ones, which follow from the positions.
                normals: if has_normals { read("NORMAL", &DIRECTION)? } else { Vec::new() },
                tangents: Vec::new(),
            });
            for key in target.object.keys() {
                if !matches!(key, "POSITION" | "NORMAL" | "TANGENT") && !key.starts_with('_') {
                    self.document.notes.say("Morph targets move positions, normals and tangents only.");
                }
            }
        }
        Ok(())
    }

    /// Normals and, for a normal map, tangents: the file's brought to unit length, or computed.
    fn complete_surface(
        &self,
        primitive: &mut Primitive,
        attributes: Attributes<'_, 'a>,
        wanted: Wanted,
        repairs: &mut Repairs,
    ) -> Result<(), Fault> {
        let (budget, pointer) = (self.document.budget, self.object.pointer());
        let has_normals = !primitive.normals.is_empty();
        if has_normals {
            repairs.lost_normals += surface::unit_normals(primitive);
        } else {
            budget.reserve(surface::unsharing_bytes(primitive), || format!("the flat normals of {pointer}"))?;
            surface::flat_normals(primitive);
        }
        let Some(texture) = wanted.normal_texture else { return Ok(()) };
        // Tangents without normals are meaningless (glTF 2.0, 3.7.2.1), and vertices may have been doubled.
        if has_normals && attributes.object.has("TANGENT") {
            primitive.tangents = attributes.read("TANGENT", &["VEC4"], &DIRECTION, Vec4::from_array)?;
            surface::unit_tangents(primitive);
            for (index, target) in self.object.list("targets")?.objects().enumerate() {
                let target = target?;
                let tangents = attributes.of(&target).read("TANGENT", &["VEC3"], &DIRECTION, Vec3::from_array)?;
                primitive.morph_targets[index].tangents = tangents;
            }
            return Ok(());
        }
        let uv = &primitive.uv[texture.uv_set as usize];
        if uv.is_empty() {
            self.document.notes.say("A normal map has no effect on a primitive without texture coordinates.");
            return Ok(());
        }
        let bytes = surface::unsharing_bytes(primitive) + primitive.triangles.len() as u64 * 512;
        budget.reserve(bytes, || format!("the tangents of {pointer}"))?;
        let transformed = |uv: &Vec2| {
            Vec2::from(texture.transform.map(|[a, b, c]| (a * uv.x + b * uv.y + c).clamp(f32::MIN, f32::MAX)))
        };
        let uv: Vec<Vec2> = uv.iter().map(transformed).collect();
        tangent::generate(primitive, &uv);
        Ok(())
    }
}

/// The attributes of a primitive or of one of its morph targets, read at the vertices in use.
#[derive(Clone, Copy)]
struct Attributes<'r, 'a> {
    document: &'r Document<'a>,
    object: &'r Object<'a>,
    vertex_count: usize,
    used: &'r [u32],
}

impl<'r, 'a> Attributes<'r, 'a> {
    /// The same vertices in another object: a morph target.
    fn of<'o>(self, object: &'o Object<'a>) -> Attributes<'o, 'a>
    where
        'r: 'o,
    {
        Attributes { document: self.document, object, vertex_count: self.vertex_count, used: self.used }
    }

    /// Empty where the attribute is absent.
    fn read<const N: usize, T>(
        &self,
        key: &str,
        shapes: &[&str],
        components: &[(Component, bool)],
        make: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, Fault> {
        let Some(accessor) = Accessor::open(self.document, self.object, key)? else { return Ok(Vec::new()) };
        accessor.expect(key, shapes, components)?;
        accessor.expect_count(key, self.vertex_count)?;
        accessor.read(self.document, Selection::These(self.used), make)
    }

    fn read_into(&self, primitive: &mut Primitive, repairs: &mut Repairs) -> Result<(), Fault> {
        primitive.normals = self.read("NORMAL", &["VEC3"], &DIRECTION, Vec3::from_array)?;
        for (set, key) in ["TEXCOORD_0", "TEXCOORD_1"].into_iter().enumerate() {
            primitive.uv[set] = self.read(key, &["VEC2"], &POSITION, Vec2::from_array)?;
        }
        primitive.colors = self.read_colors()?;
        self.read_joints(primitive, repairs)?;
        for key in self.object.keys() {
            let ignored = ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"].iter().any(|prefix| key.starts_with(prefix));
            let read = ["TEXCOORD_0", "TEXCOORD_1", "COLOR_0", "JOINTS_0", "JOINTS_1", "WEIGHTS_0", "WEIGHTS_1"];
            if ignored && !read.contains(&key) {
                self.document
                    .notes
                    .say("Texture coordinates and joints beyond two sets, and colours beyond one, were ignored.");
            }
        }
        Ok(())
    }

    fn read_colors(&self) -> Result<Vec<Vec4>, Fault> {
        let Some(accessor) = Accessor::open(self.document, self.object, "COLOR_0")? else { return Ok(Vec::new()) };
        let opaque = accessor.shape == "VEC3";
        let clamp = |color: [f32; 4]| {
            let color = Vec4::from(color).clamp(Vec4::ZERO, Vec4::ONE);
            if opaque { color.with_w(1.0) } else { color }
        };
        self.read("COLOR_0", &["VEC3", "VEC4"], &FRACTION, clamp)
    }

    fn read_joints(&self, primitive: &mut Primitive, repairs: &mut Repairs) -> Result<(), Fault> {
        let mut sets = Vec::new();
        for (joints_key, weights_key) in [("JOINTS_0", "WEIGHTS_0"), ("JOINTS_1", "WEIGHTS_1")] {
            match (self.object.has(joints_key), self.object.has(weights_key)) {
                (true, true) => {
                    let joints =
                        self.read(joints_key, &["VEC4"], &JOINTS, |joints: [f32; 4]| joints.map(|joint| joint as u16))?;
                    sets.push((joints, self.read(weights_key, &["VEC4"], &FRACTION, |weights: [f32; 4]| weights)?));
                }
                (false, false) => {}
                _ => self
                    .document
                    .notes
                    .say(format!("{joints_key} and {weights_key} go together; one alone was ignored.")),
            }
        }
        if sets.is_empty() {
            return Ok(());
        }
        let count = self.used.len();
        let bytes = count as u64 * (size_of::<[u16; 8]>() + size_of::<[f32; 8]>()) as u64;
        self.document.budget.reserve(bytes, || format!("the joints of {}", self.object.pointer()))?;
        primitive.joints = vec![[0; 8]; count];
        primitive.joint_weights = vec![[0.0; 8]; count];
        for (set, (joints, weights)) in sets.iter().enumerate() {
            for vertex in 0..count {
                primitive.joints[vertex][set * 4..][..4].copy_from_slice(&joints[vertex]);
                primitive.joint_weights[vertex][set * 4..][..4].copy_from_slice(&weights[vertex]);
            }
        }
        for (joints, weights) in primitive.joints.iter_mut().zip(&mut primitive.joint_weights) {
            repairs.repaired_weights += usize::from(normalize_weights(joints, weights));
        }
        Ok(())
    }
}

/// Makes weights non-negative with sum one; joints without weight become joint 0, since files leave anything there.
/// Returns whether more than scaling was needed.
fn normalize_weights(joints: &mut [u16; 8], weights: &mut [f32; 8]) -> bool {
    let is_negative = weights.iter().any(|weight| *weight < 0.0);
    weights.iter_mut().for_each(|weight| *weight = weight.max(0.0));
    // Eight of the largest floats overflow a float, not a double.
    let sum: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
    let is_empty = sum == 0.0;
    match is_empty {
        true => weights[0] = 1.0,
        false => weights.iter_mut().for_each(|weight| *weight = (f64::from(*weight) / sum) as f32),
    }
    for (joint, weight) in joints.iter_mut().zip(weights) {
        if *weight == 0.0 || is_empty {
            *joint = 0;
        }
    }
    is_negative || is_empty
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joint_weights_sum_to_one() {
        let (mut joints, mut weights) = ([1, 2, 3, 4, 5, 6, 7, 8], [0.5, 0.25, 0.0, 0.25, 1.0, 0.0, 0.0, 0.0]);
        assert!(!normalize_weights(&mut joints, &mut weights));
        assert_eq!(weights, [0.25, 0.125, 0.0, 0.125, 0.5, 0.0, 0.0, 0.0]);
        assert_eq!(joints, [1, 2, 0, 4, 5, 0, 0, 0]);
    }

    #[test]
    fn useless_joint_weights_are_repaired() {
        let (mut joints, mut weights) = ([9; 8], [0.0; 8]);
        assert!(normalize_weights(&mut joints, &mut weights));
        assert_eq!((joints[0], weights[0]), (0, 1.0));
        let (mut joints, mut weights) = ([9; 8], [f32::MAX, -1.0, f32::MAX, f32::MAX, f32::MAX, 0.0, 0.0, 0.0]);
        assert!(normalize_weights(&mut joints, &mut weights));
        assert_eq!(weights, [0.25, 0.0, 0.25, 0.25, 0.25, 0.0, 0.0, 0.0]);
    }
}
