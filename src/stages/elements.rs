//! Finite elements over the world's vertices: where they are, what they reflect and emit, who their neighbours are.
//!
//! One element per vertex, and behind those one more per vertex of a double-sided surface, for its back: a thin sheet
//! is lit on each side by what that side sees. Element `e < vertex_count` is the front of vertex `e`.
//! What does not change with the pose is made once; [`Elements::place`] follows a deformation.

use super::open_places::AT_ITS_VERTEX;
use super::world::World;
use crate::gpu::shaders::elements as passes;
use crate::gpu::shaders::types::OpenPlace;
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::scene::Scene;
use crate::scene::adjacency::{self, Rows};
use crate::scene::geometry::Geometry;
use glam::Vec3;

/// Of an entry of [`Elements::vertices`]; the same constant stands in `lib/element.glsl`.
pub const BACK_SIDE: u32 = 1 << 31;
/// Of an entry of [`Elements::back_elements`]: the surface is one-sided.
pub const NO_ELEMENT: u32 = u32::MAX;
/// Triangles around a vertex that shadow rays start from, at most.
const SHADOW_TRIANGLES: u32 = 8;
/// Neighbours kept for an element, at most: an apex with hundreds of split vertices needs no more.
const RING_LIMIT: usize = 64;

/// Which elements there are, and who is whose neighbour: plain data, made once per scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ElementTopology {
    /// Vertex of each element, with [`BACK_SIDE`] set for a back.
    pub vertices: Vec<u32>,
    /// Per vertex: the element of its back, or [`NO_ELEMENT`].
    pub back_elements: Vec<u32>,
    /// Triangles around each *vertex*.
    pub incident: Rows,
    /// Elements at the same or a neighbouring place on the same side, per element; itself left out.
    pub ring: Rows,
    /// Shadow rays to one light of all elements before, `element_count + 1` entries.
    pub shadow_offsets: Vec<u32>,
}

impl ElementTopology {
    /// `positions` (world space, at rest) decide which vertices stand at one place.
    pub fn new(scene: &Scene, geometry: &Geometry, positions: &[Vec3]) -> Self {
        let vertex_count = geometry.vertex_count();
        let mut vertices: Vec<u32> = (0..vertex_count).collect();
        let mut back_elements = vec![NO_ELEMENT; vertex_count as usize];
        for part in &geometry.parts {
            if scene.materials.get(part.material as usize).is_some_and(|m| m.double_sided) {
                for vertex in part.vertex_offset..part.vertex_offset + part.vertex_count {
                    back_elements[vertex as usize] = vertices.len() as u32;
                    vertices.push(vertex | BACK_SIDE);
                }
            }
        }
        let incident = adjacency::incident_triangles(vertex_count, &geometry.triangles);
        let ring = ring(&vertices, &back_elements, &geometry.triangles, positions);
        let mut shadow_offsets = vec![0];
        let mut rays = 0;
        for &entry in &vertices {
            rays += 1 + 2 * (incident.row(entry & !BACK_SIDE).len() as u32).min(SHADOW_TRIANGLES);
            shadow_offsets.push(rays);
        }
        Self { vertices, back_elements, incident, ring, shadow_offsets }
    }
}

/// Neighbours of every element: all elements of its side at its own place and at the places next to it.
fn ring(vertices: &[u32], back_elements: &[u32], triangles: &[[u32; 3]], positions: &[Vec3]) -> Rows {
    let weld = adjacency::weld(positions);
    let members = weld.members();
    let places: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| weld.group_of[v as usize])).collect();
    let neighbours = adjacency::one_ring(weld.group_count, &places);
    let mut rows = Rows { offsets: vec![0], values: Vec::new() };
    for (element, &entry) in vertices.iter().enumerate() {
        let place = weld.group_of[(entry & !BACK_SIDE) as usize];
        let near = std::iter::once(&place).chain(neighbours.row(place)).flat_map(|&place| members.row(place));
        let on_side = near.map(|&vertex| if entry & BACK_SIDE == 0 { vertex } else { back_elements[vertex as usize] });
        let others = on_side.filter(|&other| other != NO_ELEMENT && other as usize != element);
        rows.values.extend(others.take(RING_LIMIT));
        rows.offsets.push(rows.values.len() as u32);
    }
    rows
}

/// The elements on the device.
pub struct Elements {
    pub count: u32,
    /// Vertices come first: `vertices[e] == e` for `e < vertex_count`.
    pub vertices: Buffer<u32>,
    pub back_elements: Buffer<u32>,
    /// Where it receives, metres, world.
    pub positions: Buffer<Vec3>,
    /// Unit, towards the element's side.
    pub normals: Buffer<Vec3>,
    /// Where its rays start, metres.
    pub ray_origins: Buffer<Vec3>,
    /// Diffuse reflectance.
    pub albedo: Buffer<Vec3>,
    /// Emitted radiance, W m^-2 sr^-1.
    pub emission: Buffer<Vec3>,
    /// A third of the triangles around, m2.
    pub area: Buffer<f32>,
    pub incident_offsets: Buffer<u32>,
    pub incident_triangles: Buffer<u32>,
    pub ring_offsets: Buffer<u32>,
    pub ring: Buffer<u32>,
    pub shadow_offsets: Buffer<u32>,
    open_places: Buffer<OpenPlace>,
    pub topology: ElementTopology,
    /// How far rays start off their surface, metres.
    pub ray_offset: f32,
}

impl Elements {
    /// Uploads the topology and places the elements of `world`. `relative_ray_offset` is a share of the extent of
    /// `positions` (world space, at rest).
    pub fn new(
        context: &Context,
        topology: ElementTopology,
        positions: &[Vec3],
        world: &World,
        relative_ray_offset: f32,
    ) -> Result<Self, GpuError> {
        let count = topology.vertices.len();
        let elements = Self {
            count: count as u32,
            vertices: context.upload("elements/vertices", &topology.vertices)?,
            back_elements: context.upload("elements/back elements", &topology.back_elements)?,
            positions: context.buffer("elements/positions", count)?,
            normals: context.buffer("elements/normals", count)?,
            ray_origins: context.buffer("elements/ray origins", count)?,
            albedo: context.buffer("elements/albedo", count)?,
            emission: context.buffer("elements/emission", count)?,
            area: context.buffer("elements/area", count)?,
            incident_offsets: context.upload("elements/incident offsets", &topology.incident.offsets)?,
            incident_triangles: context.upload("elements/incident triangles", &topology.incident.values)?,
            ring_offsets: context.upload("elements/ring offsets", &topology.ring.offsets)?,
            ring: context.upload("elements/ring", &topology.ring.values)?,
            shadow_offsets: context.upload("elements/shadow offsets", &topology.shadow_offsets)?,
            open_places: context.upload("elements/open places", &vec![AT_ITS_VERTEX; count])?,
            ray_offset: relative_ray_offset * extent(positions),
            topology,
        };
        let mut recorder = context.recorder("elements")?;
        elements.place(&mut recorder, world);
        elements.update_materials(&mut recorder, world);
        recorder.submit()?;
        Ok(elements)
    }

    /// Bytes of the tables of [`Self::new`], as counted before any of them is made.
    pub fn bytes_needed(topology: &ElementTopology) -> u64 {
        let words = topology.vertices.len() * (1 + 3 + 3 + 3 + 3 + 3 + 1 + 1 + 1 + 3)
            + topology.back_elements.len() * 2
            + topology.incident.values.len()
            + topology.ring.values.len();
        4 * words as u64
    }

    /// From the next [`Self::place`] on, elements look from `places`, one each. Shadow rays of one that does not look from
    /// its vertex start there alone.
    pub fn look_from(&mut self, context: &Context, places: &[OpenPlace]) -> Result<(), GpuError> {
        let offsets = &mut self.topology.shadow_offsets;
        let mut rays = 0;
        for (element, place) in places.iter().enumerate() {
            let own = offsets[element + 1] - offsets[element];
            let is_moved = *place != AT_ITS_VERTEX;
            (offsets[element], rays) = (rays, rays + if is_moved { 1 } else { own });
        }
        offsets[places.len()] = rays;
        context.write(&self.shadow_offsets, &self.topology.shadow_offsets)?;
        context.write(&self.open_places, places)
    }

    /// Follows the world's vertices.
    pub fn place(&self, recorder: &mut Recorder<'_>, world: &World) {
        let pass = passes::Place {
            element_vertices: &self.vertices,
            positions: &world.positions,
            normals: &world.normals,
            triangles: &world.triangles,
            incident_offsets: &self.incident_offsets,
            incident_triangles: &self.incident_triangles,
            element_positions: &self.positions,
            element_normals: &self.normals,
            ray_origins: &self.ray_origins,
            open_places: &self.open_places,
            params: passes::PlaceParams { element_count: self.count, ray_offset: self.ray_offset },
        };
        recorder.dispatch(&pass, self.count);
    }

    /// Averages albedo and emission over the elements, with the world's present materials.
    pub fn update_materials(&self, recorder: &mut Recorder<'_>, world: &World) {
        let pass = passes::Materials {
            element_vertices: &self.vertices,
            triangles: &world.triangles,
            triangle_materials: &world.triangle_materials,
            incident_offsets: &self.incident_offsets,
            incident_triangles: &self.incident_triangles,
            positions: &world.positions,
            attributes: &world.attributes,
            materials: &world.materials,
            albedo: &self.albedo,
            emission: &self.emission,
            area: &self.area,
            textures: &world.textures,
            params: passes::MaterialsParams { element_count: self.count },
        };
        recorder.dispatch(&pass, self.count);
    }

    /// `radiosity = albedo * irradiance`, W/m2.
    pub fn reflect(&self, recorder: &mut Recorder<'_>, irradiance: &Buffer<Vec3>, radiosity: &Buffer<Vec3>) {
        let params = passes::ReflectParams { element_count: self.count };
        recorder.dispatch(&passes::Reflect { irradiance, albedo: &self.albedo, radiosity, params }, self.count);
    }

    /// `sum += term`, element by element.
    pub fn add(&self, recorder: &mut Recorder<'_>, term: &Buffer<Vec3>, sum: &Buffer<Vec3>) {
        let params = passes::AddParams { element_count: self.count };
        recorder.dispatch(&passes::Add { term, sum, params }, self.count);
    }

    /// Averages `irradiance` over neighbours whose normals differ by less than `feature_angle` (radians).
    pub fn smooth(
        &self,
        recorder: &mut Recorder<'_>,
        feature_angle: f32,
        irradiance: &Buffer<Vec3>,
        smoothed: &Buffer<Vec3>,
    ) {
        let pass = passes::Smooth {
            ring_offsets: &self.ring_offsets,
            ring: &self.ring,
            element_normals: &self.normals,
            irradiance,
            smoothed,
            params: passes::SmoothParams { element_count: self.count, cos_feature_angle: feature_angle.cos() },
        };
        recorder.dispatch(&pass, self.count);
    }
}

/// Diagonal of the bounds, or the farthest coordinate where the scene stands far from the origin.
fn extent(positions: &[Vec3]) -> f32 {
    let finite = || positions.iter().copied().filter(|p| p.is_finite());
    let (low, high) = finite().fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    if low.x > high.x {
        return 1.0;
    }
    (high - low).length().max(low.abs().max(high.abs()).max_element()).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh, Node, Primitive, Transform};

    /// Two triangles that share an edge, one of whose ends is split in two vertices.
    fn split_quad(double_sided: bool) -> (Scene, Geometry) {
        let mut scene = Scene::default();
        scene.materials.push(Material { double_sided, ..Material::default() });
        scene.meshes.push(Mesh {
            primitives: vec![Primitive {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y, Vec3::Y],
                triangles: vec![[0, 1, 2], [1, 3, 4]],
                ..Primitive::default()
            }],
            ..Mesh::default()
        });
        scene.nodes.push(Node { mesh: Some(0), transform: Transform::Matrix(glam::Mat4::IDENTITY), ..Node::default() });
        let geometry = Geometry::flatten(&scene, u64::MAX).unwrap();
        (scene, geometry)
    }

    #[test]
    fn split_vertices_are_neighbours_of_all_at_their_place() {
        let (scene, geometry) = split_quad(false);
        let topology = ElementTopology::new(&scene, &geometry, &geometry.local_positions);
        assert_eq!(topology.vertices, [0, 1, 2, 3, 4]);
        let ring = |e| {
            let mut row = topology.ring.row(e).to_vec();
            row.sort_unstable();
            row
        };
        assert_eq!(ring(0), [1, 2, 4]);
        assert_eq!(ring(2), [0, 1, 3, 4]);
        assert_eq!(ring(4), [0, 1, 2, 3]);
        assert_eq!(topology.shadow_offsets, [0, 3, 8, 11, 14, 17]);
    }

    #[test]
    fn a_double_sided_surface_has_elements_on_both_sides_that_do_not_mix() {
        let (scene, geometry) = split_quad(true);
        let topology = ElementTopology::new(&scene, &geometry, &geometry.local_positions);
        assert_eq!(topology.vertices.len(), 10);
        assert_eq!(topology.back_elements, [5, 6, 7, 8, 9]);
        assert_eq!(topology.vertices[7], 2 | BACK_SIDE);
        for element in 0..10 {
            assert!(topology.ring.row(element).iter().all(|&other| (other < 5) == (element < 5) && other != element));
        }
    }
}
