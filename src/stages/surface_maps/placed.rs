//! The maps in the order of a sender tree's leaves, and what moves among them.

use super::{MapFilter, MovingMaps, SurfaceMaps};
use crate::gpu::shaders::surface_maps as passes;
use crate::gpu::shaders::types::{AtlasTexel, LeafMaps, SurfaceMapFrame};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::scene::atlas::Atlas;
use glam::UVec2;

/// The maps as the leaves of a sender tree ask them.
pub struct PlacedMaps {
    pub maps: SurfaceMaps,
    /// Which maps each leaf is seen by, in tree order.
    pub leaf_maps: Buffer<LeafMaps>,
    /// One: how the maps are read.
    pub frame: Buffer<SurfaceMapFrame>,
    pub filter: MapFilter,
    /// What moves against each other.
    pub moving: Option<MovingMaps>,
}

impl PlacedMaps {
    /// `leaf_order` gives the texel of each leaf of the tree; `filters` are between pixels and between senders.
    pub fn new(
        context: &Context,
        maps: SurfaceMaps,
        atlas: &Atlas,
        leaf_order: &[u32],
        filters: [MapFilter; 2],
    ) -> Result<Self, GpuError> {
        Ok(Self {
            leaf_maps: context.upload("surface_maps/leaf maps", &leaf_maps(&maps, atlas, leaf_order))?,
            frame: context.upload("surface_maps/frame", &[maps.frame(filters[0], filters[1])])?,
            maps,
            filter: filters[0],
            moving: None,
        })
    }

    /// Of pairs of texels (sender, receiver) that may belong to objects that move: what share of the way is free, or -1
    /// where rays must be asked; the first `count` pairs. Does nothing where nothing moves.
    pub fn query_pairs(
        &self,
        recorder: &mut Recorder<'_>,
        texels: &Buffer<AtlasTexel>,
        pairs: &Buffer<UVec2>,
        visibility: &Buffer<f32>,
        count: usize,
    ) {
        let Some(moving) = &self.moving else { return };
        let pass = passes::MovingQuery {
            pairs,
            texels,
            map_origins: &self.maps.origins,
            run_offsets: &self.maps.run_offsets,
            runs: &self.maps.runs,
            rigid_words: &moving.words,
            rigid_objects: &moving.present,
            visibility,
            params: passes::MovingQueryParams {
                pair_count: count as u32,
                frame: self.maps.frame(self.filter, MapFilter::None),
            },
        };
        recorder.dispatch(&pass, count);
    }

    /// Takes over a tree that was built anew over the same leaves; `atlas` is that of the rest.
    pub fn reorder(&self, context: &Context, atlas: &Atlas, leaf_order: &[u32]) -> Result<(), GpuError> {
        context.write(&self.leaf_maps, &leaf_maps(&self.maps, atlas, leaf_order))
    }
}

fn leaf_maps(maps: &SurfaceMaps, atlas: &Atlas, leaf_order: &[u32]) -> Vec<LeafMaps> {
    let of = |&texel: &u32| LeafMaps {
        place: maps.places[texel as usize],
        around: neighbours(atlas, texel as usize).map(|other| maps.places[other]),
    };
    leaf_order.iter().map(of).collect()
}

/// The texels of its chart that lie beside a texel towards +u, -u, +v and -v of its sides; itself where there is none.
fn neighbours(atlas: &Atlas, texel: usize) -> [usize; 4] {
    let own = &atlas.texels[texel];
    let mut found = [texel; 4];
    for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
        let Some(at) = own.at.checked_add_signed(glam::IVec2::new(dx, dy)) else { continue };
        if at.max_element() >= atlas.resolution {
            continue;
        }
        let index = atlas.texel_at[(at.y * atlas.resolution + at.x) as usize];
        let Some(other) = atlas.texels.get(index as usize).filter(|other| other.chart == own.chart) else { continue };
        // Along which side it lies, in widths of the texel.
        let offset = other.position - own.position;
        let along =
            [own.side_u, own.side_v].map(|side| offset.dot(side) / side.length_squared().max(f32::MIN_POSITIVE));
        let axis = usize::from(along[1].abs() > along[0].abs());
        found[2 * axis + usize::from(along[axis] < 0.0)] = index as usize;
    }
    found
}
