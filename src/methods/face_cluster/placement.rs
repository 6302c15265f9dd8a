//! Clusters placed in the scene: one tree per distinct mesh, an instance for each side of each placed one, and the
//! tables of both on the device.
//!
//! The device holds the upper part of each tree, down to [`Placement::least_area`]: nothing below is ever an element.
//! Meshes that are skinned, morphed, sheared or mirrored get a tree of their own in world space.

use super::{FaceClusterError, Stage};
use crate::gpu::shaders::methods::face_cluster as passes;
use crate::gpu::shaders::types::{ClusterInstance, FaceCluster};
use crate::gpu::{Buffer, Context};
use crate::scene::geometry::Part;
use crate::scene::surfaces::Surfaces;
use crate::stages::clusters::{ClusterTree, MeshFaces, cache, face_count};
use glam::{Mat4, UVec2, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Of [`Placement::triangle_roots`]: the triangle has no such side.
pub const NO_ELEMENT: u32 = u32::MAX;
/// Clusters on the device, at most: more are cut off at the smallest.
const MOST_CLUSTERS: usize = 1 << 20;

/// What each triangle reflects and emits, means over it.
pub struct FaceMaterials {
    /// Diffuse.
    pub albedo: Vec<Vec3>,
    /// Diffuse and, at normal incidence, specular: the most that a change of irradiance shows.
    pub reflectance: Vec<Vec3>,
    /// Radiance, W m^-2 sr^-1.
    pub emission: Vec<Vec3>,
}

/// A part with the tree it uses.
struct Placed {
    part: u32,
    tree: usize,
    world_from_tree: Mat4,
    scale: f32,
    has_back: bool,
}

/// What the head of this file describes.
pub struct Placement {
    pub trees: Vec<ClusterTree>,
    pub clusters: Buffer<FaceCluster>,
    /// Per cluster on the device: the first after its subtree.
    pub skips: Buffer<u32>,
    pub instances: Buffer<ClusterInstance>,
    /// Triangle of the mesh at each place of each tree.
    pub faces: Buffer<u32>,
    /// Per triangle: its place, trees' places counted from the part's first triangle.
    pub places: Buffer<u32>,
    /// A bit per triangle: of a closed body, which hides what is inside.
    pub solids: Buffer<u32>,
    /// Per triangle: instances of its front and back.
    pub triangle_roots: Buffer<UVec2>,
    pub instance_count: u32,
    /// Clusters on the device, instances counted each.
    pub placed_clusters: u64,
    /// Levels on the device.
    pub depth: u32,
    /// m2; clusters are not split below.
    pub least_area: f32,
    /// Of all instances, m2.
    pub area: f32,
    /// Emitted by all instances, W.
    pub emitted_power: Vec3,
}

impl Placement {
    /// Clusters the stage's meshes in their present pose.
    pub fn new(context: &Context, stage: &Stage<'_>, least_area_share: f32) -> Result<Self, FaceClusterError> {
        let materials = face_materials(context, stage)?;
        let positions = context.download(&stage.world.positions)?;
        let surfaces = Surfaces::new(stage.geometry, stage.rest_positions);
        let (trees, placed) = build_trees(stage, &surfaces, &materials, &positions);
        let total_area: f64 = placed.iter().map(|p| f64::from(root_area(&trees, p))).sum();
        let sides = |p: &Placed| if p.has_back { 2.0 } else { 1.0 };
        let emitted_power: Vec3 = placed
            .iter()
            .map(|p| trees[p.tree].clusters[0].emission * (std::f32::consts::PI * root_area(&trees, p) * sides(p)))
            .sum();

        let mut scales = vec![0.0f32; trees.len()];
        for p in &placed {
            scales[p.tree] = scales[p.tree].max(p.scale);
        }
        let mut least_area = (f64::from(least_area_share) * total_area) as f32;
        let upper = loop {
            let upper = Upper::of(&trees, &scales, least_area);
            if upper.clusters.len() <= MOST_CLUSTERS {
                break upper;
            }
            least_area = (2.0 * least_area).max(1e-12 * total_area as f32).max(f32::MIN_POSITIVE);
        };

        let face_offsets: Vec<u32> = trees
            .iter()
            .scan(0u32, |next, tree| Some(std::mem::replace(next, *next + tree.faces.len() as u32)))
            .collect();
        let geometry = stage.geometry;
        let mut instances = Vec::new();
        let mut places: Vec<u32> = (0..geometry.triangle_count()).collect();
        let mut triangle_roots = vec![UVec2::splat(NO_ELEMENT); geometry.triangles.len()];
        let mut solids = vec![0u32; geometry.triangles.len().div_ceil(32)];
        let mut placed_clusters = 0;
        for p in &placed {
            let part = &geometry.parts[p.part as usize];
            let front = instances.len() as u32;
            for is_back in 0..=u32::from(p.has_back) {
                let m = p.world_from_tree;
                instances.push(ClusterInstance {
                    world_from_tree: [m.x_axis, m.y_axis, m.z_axis, m.w_axis].map(|c| c.truncate().to_array()),
                    scale: p.scale,
                    is_back,
                    first_cluster: upper.first[p.tree],
                    first_face: face_offsets[p.tree],
                    first_triangle: part.triangle_offset,
                });
                placed_clusters += upper.count(p.tree);
            }
            let back = if p.has_back { front + 1 } else { NO_ELEMENT };
            for (place, &face) in trees[p.tree].faces.iter().enumerate() {
                let triangle = (part.triangle_offset + face) as usize;
                places[triangle] = part.triangle_offset + place as u32;
                triangle_roots[triangle] = UVec2::new(front, back);
                let surface = surfaces.of_vertex[geometry.triangles[triangle][0] as usize];
                solids[triangle / 32] |= u32::from(surfaces.is_solid[surface as usize]) << (triangle % 32);
            }
        }
        let faces: Vec<u32> = trees.iter().flat_map(|tree| tree.faces.iter().copied()).collect();
        Ok(Self {
            clusters: context.upload("face-cluster/clusters", &upper.clusters)?,
            skips: context.upload("face-cluster/skips", &upper.skips)?,
            instances: context.upload("face-cluster/instances", &instances)?,
            faces: context.upload("face-cluster/faces", &faces)?,
            places: context.upload("face-cluster/places", &places)?,
            solids: context.upload("face-cluster/solids", &solids)?,
            triangle_roots: context.upload("face-cluster/triangle roots", &triangle_roots)?,
            instance_count: instances.len() as u32,
            placed_clusters,
            depth: upper.depth,
            least_area,
            area: total_area as f32,
            emitted_power,
            trees,
        })
    }

    /// All trees, on the host.
    pub fn model_bytes(&self) -> u64 {
        self.trees.iter().map(ClusterTree::size_bytes).sum()
    }
}

fn root_area(trees: &[ClusterTree], placed: &Placed) -> f32 {
    trees[placed.tree].clusters[0].area * placed.scale * placed.scale
}

/// The upper part of every tree.
#[derive(Default)]
struct Upper {
    clusters: Vec<FaceCluster>,
    skips: Vec<u32>,
    /// Per tree, and one more.
    first: Vec<u32>,
    depth: u32,
}

impl Upper {
    /// Clusters of more than `least_area` (m2 at the tree's scale) and their children.
    fn of(trees: &[ClusterTree], scales: &[f32], least_area: f32) -> Self {
        let mut upper = Self::default();
        for (tree, scale) in trees.iter().zip(scales) {
            upper.first.push(upper.clusters.len() as u32);
            upper.push(tree, 0, least_area / (scale * scale), 0);
        }
        upper.first.push(upper.clusters.len() as u32);
        upper
    }

    fn push(&mut self, tree: &ClusterTree, index: u32, least_area: f32, depth: u32) {
        let at = self.clusters.len();
        self.clusters.push(tree.clusters[index as usize]);
        self.skips.push(0);
        self.depth = self.depth.max(depth);
        if tree.clusters[index as usize].area > least_area
            && let Some(children) = tree.children(index)
        {
            children.into_iter().for_each(|child| self.push(tree, child, least_area, depth + 1));
        }
        self.skips[at] = self.clusters.len() as u32;
    }

    fn count(&self, tree: usize) -> u64 {
        u64::from(self.first[tree + 1] - self.first[tree])
    }
}

fn face_materials(context: &Context, stage: &Stage<'_>) -> Result<FaceMaterials, FaceClusterError> {
    let world = stage.world;
    let count = world.triangle_count as usize;
    let albedo = context.buffer("face-cluster/face albedo", count)?;
    let reflectance = context.buffer("face-cluster/face reflectance", count)?;
    let emission = context.buffer("face-cluster/face emission", count)?;
    let mut recorder = context.recorder("face-cluster")?;
    let pass = passes::FaceMaterials {
        triangles: &world.triangles,
        triangle_materials: &world.triangle_materials,
        attributes: &world.attributes,
        materials: &world.materials,
        albedo: &albedo,
        reflectance: &reflectance,
        emission: &emission,
        textures: &world.textures,
        params: passes::FaceMaterialsParams { triangle_count: world.triangle_count },
    };
    recorder.dispatch(&pass, count);
    recorder.submit()?;
    Ok(FaceMaterials {
        albedo: context.download(&albedo)?,
        reflectance: context.download(&reflectance)?,
        emission: context.download(&emission)?,
    })
}

/// Where a part's tree lives: local space, if that is placed by turning, moving and one scale; else world space.
fn similarity(stage: &Stage<'_>, part: &Part) -> Option<(Mat4, f32)> {
    if part.skin_offset.is_some() || part.morph_target_count > 0 {
        return None;
    }
    let m = stage.pose.world_from_node[part.node as usize];
    let columns = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate());
    let scale = (columns[0].length() + columns[1].length() + columns[2].length()) / 3.0;
    let is_even = columns.iter().all(|c| (c.length() - scale).abs() <= 1e-4 * scale);
    let is_square = (0..3).all(|k| columns[k].dot(columns[(k + 1) % 3]).abs() <= 1e-4 * scale * scale);
    (scale > 0.0 && is_even && is_square && m.determinant() > 0.0).then_some((m, scale))
}

fn build_trees(
    stage: &Stage<'_>,
    surfaces: &Surfaces,
    materials: &FaceMaterials,
    world: &[Vec3],
) -> (Vec<ClusterTree>, Vec<Placed>) {
    let geometry = stage.geometry;
    let mut keys = HashMap::new();
    let (mut wanted, mut placed) = (Vec::new(), Vec::new());
    for (index, part) in geometry.parts.iter().enumerate() {
        let material = &stage.scene.materials[part.material as usize];
        if material.unlit {
            continue;
        }
        let vertices = part.vertex_offset as usize..(part.vertex_offset + part.vertex_count) as usize;
        let place = similarity(stage, part);
        let positions =
            if place.is_some() { &geometry.local_positions[vertices.clone()] } else { &world[vertices.clone()] };
        let faces = part.triangle_offset as usize..(part.triangle_offset + part.triangle_count) as usize;
        let offset = |t: &[u32; 3]| t.map(|v| v - part.vertex_offset);
        let triangles: Vec<[u32; 3]> = geometry.triangles[faces.clone()].iter().map(offset).collect();
        let mut hash = blake3::Hasher::new();
        hash.update(bytemuck::cast_slice(positions));
        hash.update(bytemuck::cast_slice(&triangles));
        for values in [&materials.albedo, &materials.reflectance, &materials.emission] {
            hash.update(bytemuck::cast_slice(&values[faces.clone()]));
        }
        let tree = *keys.entry(hash.finalize()).or_insert_with(|| {
            wanted.push((positions, triangles, faces.clone()));
            wanted.len() - 1
        });
        let is_solid = vertices.clone().all(|v| surfaces.is_solid[surfaces.of_vertex[v] as usize]);
        let (world_from_tree, scale) = place.unwrap_or((Mat4::IDENTITY, 1.0));
        placed.push(Placed {
            part: index as u32,
            tree,
            world_from_tree,
            scale,
            has_back: material.double_sided && !is_solid,
        });
    }
    let folder = stage.cluster_cache;
    let build = |(positions, triangles, faces): &(&[Vec3], Vec<[u32; 3]>, std::ops::Range<usize>)| {
        let mesh = MeshFaces {
            positions,
            triangles,
            albedo: &materials.albedo[faces.clone()],
            reflectance: &materials.reflectance[faces.clone()],
            emission: &materials.emission[faces.clone()],
        };
        cache::tree(&mesh, folder)
    };
    let trees: Vec<ClusterTree> = wanted.par_iter().map(build).collect();
    debug_assert!(trees.iter().all(|tree| face_count(&tree.clusters[0]) as usize == tree.faces.len()));
    (trees, placed)
}
