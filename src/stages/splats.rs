//! The flat patches of a hierarchy, as the splatting display draws them: one rectangle per leaf of a flat surface, with the
//! light of its vertices.

use super::elements::Elements;
use super::hierarchy::{Hierarchy, NONE};
use crate::gpu::shaders::hierarchy::{PlaceSplats, PlaceSplatsParams};
use crate::gpu::shaders::types::{Splat, SplatShare};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::scene::facets::Facets;
use crate::scene::geometry::Geometry;
use glam::Vec3;

/// Splats on the device, and which surface each triangle belongs to.
pub struct Splats {
    pub count: u32,
    pub splats: Buffer<Splat>,
    /// Per triangle: its flat surface, or [`NONE`] where vertices are to be interpolated.
    pub triangle_surfaces: Buffer<u32>,
    /// The vertices whose light each shows, by area.
    pub shares: Buffer<SplatShare>,
    /// W/m2; four per splat: direct light of front and back, indirect. What the display shows last.
    pub light: Buffer<Vec3>,
    share_offsets: Buffer<u32>,
    leaves: Buffer<u32>,
}

impl Splats {
    /// Of the hierarchy as it stands; [`Self::place`] follows it.
    pub fn new(
        context: &Context,
        hierarchy: &Hierarchy,
        facets: &Facets,
        geometry: &Geometry,
        elements: &Elements,
    ) -> Result<Self, GpuError> {
        let plan = &hierarchy.plan;
        let areas = context.download(&elements.area)?;
        let is_flat = |leaf: u32| plan.nodes[plan.leaves[leaf as usize].node as usize].surface != NONE;
        let leaves: Vec<u32> = (0..hierarchy.leaf_count()).filter(|&leaf| is_flat(leaf)).collect();
        let surface_of = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|vertex| facets.of_vertex[vertex as usize]);
            if a == b && b == c && facets.is_flat[a as usize] { a } else { NONE }
        };
        let triangle_surfaces: Vec<u32> = geometry.triangles.iter().map(surface_of).collect();
        let (mut shares, mut share_offsets) = (Vec::new(), vec![0]);
        for &leaf in &leaves {
            let own = plan.members_of(leaf);
            let total: f32 = own.iter().map(|&vertex| areas[vertex as usize]).sum();
            let share = |vertex: u32| match total > 0.0 {
                true => areas[vertex as usize] / total,
                false => 1.0 / own.len() as f32,
            };
            shares.extend(own.iter().map(|&vertex| SplatShare { vertex, share: share(vertex) }));
            share_offsets.push(shares.len() as u32);
        }
        let splats = Self {
            shares: context.upload("splats/shares", &shares)?,
            share_offsets: context.upload("splats/share offsets", &share_offsets)?,
            light: context.buffer("splats/light", 4 * leaves.len())?,
            count: leaves.len() as u32,
            splats: context.buffer("splats/rectangles", leaves.len())?,
            triangle_surfaces: context.upload("splats/triangle surfaces", &triangle_surfaces)?,
            leaves: context.upload("splats/leaves", &leaves)?,
        };
        let mut recorder = context.recorder("splats")?;
        splats.place(&mut recorder, hierarchy);
        recorder.submit()?;
        Ok(splats)
    }

    /// Follows the hierarchy's leaves.
    pub fn place(&self, recorder: &mut Recorder<'_>, hierarchy: &Hierarchy) {
        let pass = PlaceSplats {
            splat_leaves: &self.leaves,
            share_offsets: &self.share_offsets,
            leaves: &hierarchy.leaves,
            nodes: &hierarchy.nodes,
            splats: &self.splats,
            params: PlaceSplatsParams { splat_count: self.count },
        };
        recorder.dispatch(&pass, self.count);
    }
}
