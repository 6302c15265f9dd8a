//! Which texels look through one map.
//!
//! An atlas of small charts has slivers of texels side by side, each with a map of its own that shows nearly what its
//! neighbour's does. Texels that stand close together in one plane may share: the largest keep their maps, the others
//! look through the nearest of them. Differs from [Ritschel2008]: there every texel has a map.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use crate::scene::atlas::{Atlas, Texel};
use glam::Vec3;
use std::collections::HashMap;

/// Cosine between the normals of texels that share, at least.
const LEAST_COSINE: f32 = 0.95;
/// How far a texel's middle may stand off the other's plane, texels.
const MOST_OFF_PLANE: f32 = 0.1;

/// The texels that have maps, in the order of the walk, and the place of the map that each texel looks through.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sharing {
    pub order: Vec<u32>,
    pub places: Vec<u32>,
}

impl Sharing {
    /// `order` is the walk over all texels; those less than `reach` texels apart share, none does for 0. Only texels of one
    /// object do, where `objects` tells it of each.
    pub fn new(atlas: &Atlas, order: &[u32], objects: Option<&[u32]>, reach: f32) -> Self {
        let side = 1.0 / atlas.scale.max(f32::MIN_POSITIVE);
        let object = |texel: u32| objects.map_or(0, |objects| objects[texel as usize]);
        let keepers = keepers(&atlas.texels, object, reach * side, MOST_OFF_PLANE * side);
        let order: Vec<u32> = order.iter().copied().filter(|&texel| keepers[texel as usize] == texel).collect();
        let mut place_of = vec![0; atlas.texels.len()];
        order.iter().zip(0..).for_each(|(&texel, place)| place_of[texel as usize] = place);
        let places = keepers.iter().map(|&keeper| place_of[keeper as usize]).collect();
        Self { order, places }
    }

    /// The same maps in another order of theirs.
    pub fn reorder(&mut self, order: Vec<u32>) {
        let place_of: HashMap<u32, u32> = order.iter().copied().zip(0..).collect();
        self.places.iter_mut().for_each(|place| *place = place_of[&self.order[*place as usize]]);
        self.order = order;
    }
}

/// Of each texel, whose map it looks through; the largest choose first.
fn keepers(texels: &[Texel], object: impl Fn(u32) -> u32, reach: f32, off_plane: f32) -> Vec<u32> {
    let mut keepers: Vec<u32> = (0..texels.len() as u32).collect();
    if reach <= 0.0 {
        return keepers;
    }
    let mut by_area = keepers.clone();
    by_area.sort_by(|&a, &b| texels[b as usize].area.total_cmp(&texels[a as usize].area).then(a.cmp(&b)));
    let cell = |point: Vec3| (point / reach).floor().as_ivec3();
    let mut grid: HashMap<(u32, glam::IVec3), Vec<u32>> = HashMap::new();
    for index in by_area {
        let texel = &texels[index as usize];
        let suits = |&other: &u32| {
            let other = &texels[other as usize];
            let offset = other.position - texel.position;
            texel.normal.dot(other.normal) >= LEAST_COSINE
                && offset.length() < reach
                && offset.dot(texel.normal).abs().max(offset.dot(other.normal).abs()) <= off_plane
        };
        let (at, object) = (cell(texel.position), object(index));
        let around = (0..27).map(|k| at + glam::IVec3::new(k % 3, k / 3 % 3, k / 9) - 1);
        let nearest = around
            .filter_map(|at| grid.get(&(object, at)))
            .flatten()
            .copied()
            .filter(suits)
            .map(|other| (texels[other as usize].position.distance_squared(texel.position), other))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match nearest {
            Some((_, other)) => keepers[index as usize] = other,
            None => grid.entry((object, at)).or_default().push(index),
        }
    }
    keepers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::atlas::Size;
    use crate::scene::geometry::Geometry;
    use crate::scene::pose::Pose;
    use crate::scene::{LoadOptions, builtin, deform};
    use crate::stages::surface_maps::sequence::{Sequence, walk};

    #[test]
    fn texels_share_with_what_is_near_and_faces_alike() {
        let scene = builtin::open("builtin:cornell-box", &LoadOptions::default()).unwrap();
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let positions = deform::world_positions(&geometry, &Pose::rest(&scene));
        let atlas = Atlas::new(&scene, &geometry, &positions, Size::tight(48)).unwrap();
        let order = walk(&atlas, Sequence::Spiral);
        let texels = &atlas.texels;

        let alone = Sharing::new(&atlas, &order, None, 0.0);
        assert_eq!(alone.order, order);
        assert!(order.iter().zip(0..).all(|(&texel, place)| alone.places[texel as usize] == place));

        let mut before = order.len();
        for reach in [0.75f32, 1.5, 3.0] {
            let shared = Sharing::new(&atlas, &order, None, reach);
            println!("reach {reach}: {} maps of {} texels", shared.order.len(), texels.len());
            assert!(shared.order.len() < before, "farther reaches need fewer maps");
            before = shared.order.len();
            for (texel, &place) in texels.iter().zip(&shared.places) {
                let keeper = &texels[shared.order[place as usize] as usize];
                assert!(keeper.position.distance(texel.position) * atlas.scale < reach);
                assert!(keeper.normal.dot(texel.normal) > 0.94 && keeper.area >= texel.area);
            }
            // The walk is that of all texels.
            assert!(shared.order.iter().eq(order.iter().filter(|texel| shared.order.contains(texel))));
        }
        // Each on its own object: nothing is shared.
        let objects: Vec<u32> = (0..texels.len() as u32).collect();
        assert_eq!(Sharing::new(&atlas, &order, Some(&objects), 3.0), alone);
    }
}
