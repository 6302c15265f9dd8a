//! An order of maps by what they see: each next to those that agree with it in most pixels, as small maps of them tell.
//!
//! Where a depth holds for a map and not for the next one, a run ends. Of the pairs of maps that stand close by and face
//! alike, those that part in the fewest pixels are joined first, into chains; then the chains are joined end to end. A
//! scene of many small charts has no long walk within any: here charts do not count. Differs from [Ritschel2008]: there
//! orders know of places and charts alone.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use super::{Interval, MapInput, MapOptions, SurfaceMapError, uncompressed};
use crate::gpu::Context;
use crate::scene::atlas::Texel;
use crate::stages::work::Watch;
use rayon::prelude::*;

/// Pixels a side of the small maps' faces.
const COARSE: u32 = 8;
/// Maps that each may be joined to.
const CANDIDATES: usize = 40;
/// Metres, as a share of the extent of all, that a difference of normals by 1 counts as.
const TURN: f32 = 0.8;

/// The texels of `order` by what they see, as small maps of them tell.
pub(super) fn order(
    context: &Context,
    input: &MapInput<'_>,
    options: MapOptions,
    order: &[u32],
    watch: &dyn Watch,
) -> Result<Vec<u32>, SurfaceMapError> {
    let small = MapOptions { resolution: COARSE.min(options.resolution), ..options };
    let maps = uncompressed(context, *input, small, order, watch)?;
    let texels: Vec<Texel> = order.iter().map(|&texel| input.atlas.texels[texel as usize]).collect();
    Ok(walk(&texels, &maps).into_iter().map(|place| order[place as usize]).collect())
}

/// The places of `texels`, whose small maps lie one after the other in `maps`, as a walk.
fn walk(texels: &[Texel], maps: &[Interval]) -> Vec<u32> {
    let count = texels.len();
    let keys = keys(texels);
    let pixels = maps.len() / count.max(1);
    let map = |place: u32| &maps[place as usize * pixels..(place as usize + 1) * pixels];
    let parted = |a: u32, b: u32| {
        let pairs = map(a).iter().zip(map(b));
        pairs.map(|(a, b)| u32::from(a.low.max(b.low) > a.high.min(b.high))).sum::<u32>()
    };
    let mut across: Vec<u32> = (0..count as u32).collect();
    across.sort_unstable_by(|&a, &b| keys[a as usize][0].total_cmp(&keys[b as usize][0]).then(a.cmp(&b)));
    let near = |at: usize| {
        let place = across[at];
        // Outwards along the first axis, until nothing farther along it can be among the nearest.
        let ways = [at + 1..count, 0..at];
        let found = ways.into_iter().enumerate().fold(Nearest::of(&keys, place), |found, (side, way)| {
            let back = side == 1;
            let places = way.clone().map(|k| across[if back { way.end - 1 - k + way.start } else { k }]);
            found.among(places, true)
        });
        found.places().map(|other| [place.min(other), place.max(other)]).collect::<Vec<_>>()
    };
    let mut pairs: Vec<[u32; 2]> = (0..count).into_par_iter().flat_map_iter(near).collect();
    pairs.par_sort_unstable();
    pairs.dedup();
    let mut pairs: Vec<(u32, [u32; 2])> = pairs.into_par_iter().map(|[a, b]| (parted(a, b), [a, b])).collect();
    pairs.par_sort_unstable();
    let mut chains = Chains::new(count);
    pairs.iter().for_each(|&(_, [a, b])| chains.join(a, b));
    chains.end_to_end(|from, ends| {
        let near = Nearest::of(&keys, from).among(ends.iter().copied(), false);
        near.places().min_by_key(|&end| (parted(from, end), end))
    })
}

/// Where each stands, and which way it faces, as places that are close where both are.
fn keys(texels: &[Texel]) -> Vec<[f32; 6]> {
    let (low, high) = texels.iter().fold((glam::Vec3::MAX, glam::Vec3::MIN), |(low, high), texel| {
        (low.min(texel.position), high.max(texel.position))
    });
    let turn = TURN * (high - low).max_element();
    let key = |texel: &Texel| {
        let ([x, y, z], [u, v, w]) = (texel.position.to_array(), (turn * texel.normal).to_array());
        [x, y, z, u, v, w]
    };
    texels.iter().map(key).collect()
}

/// The places nearest to one, at most [`CANDIDATES`].
struct Nearest<'a> {
    keys: &'a [[f32; 6]],
    own: [f32; 6],
    /// Squared distance and place, nearest first.
    found: Vec<(f32, u32)>,
}

impl<'a> Nearest<'a> {
    fn of(keys: &'a [[f32; 6]], place: u32) -> Self {
        Self { keys, own: keys[place as usize], found: Vec::with_capacity(CANDIDATES + 1) }
    }

    /// Looks at `places`; where they come ever farther along the first axis, only while one could be nearer than those found.
    fn among(mut self, places: impl Iterator<Item = u32>, are_sorted: bool) -> Self {
        for place in places {
            let key = &self.keys[place as usize];
            let last = if self.found.len() < CANDIDATES { f32::MAX } else { self.found[CANDIDATES - 1].0 };
            let along = key[0] - self.own[0];
            if are_sorted && along * along > last {
                break;
            }
            let squared = key.iter().zip(&self.own).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
            if squared <= last {
                let at = self.found.partition_point(|&(other, at)| (other, at) <= (squared, place));
                self.found.insert(at, (squared, place));
                self.found.truncate(CANDIDATES);
            }
        }
        self
    }

    fn places(&self) -> impl Iterator<Item = u32> {
        self.found.iter().map(|&(_, place)| place)
    }
}

/// Pieces of a walk: each place with at most two beside it, and no rings.
struct Chains {
    beside: Vec<[Option<u32>; 2]>,
    /// Towards a place that stands for the whole chain.
    parents: Vec<u32>,
}

impl Chains {
    fn new(count: usize) -> Self {
        Self { beside: vec![[None; 2]; count], parents: (0..count as u32).collect() }
    }

    fn chain_of(&mut self, mut place: u32) -> u32 {
        while self.parents[place as usize] != place {
            let above = self.parents[place as usize];
            self.parents[place as usize] = self.parents[above as usize];
            place = above;
        }
        place
    }

    /// Joins the ends of two chains; does nothing where either is no end, or both are of one chain.
    fn join(&mut self, a: u32, b: u32) {
        let free = |place: u32| self.beside[place as usize].iter().position(Option::is_none);
        let (Some(at_a), Some(at_b)) = (free(a), free(b)) else { return };
        let (chain_a, chain_b) = (self.chain_of(a), self.chain_of(b));
        if chain_a == chain_b {
            return;
        }
        self.parents[chain_a as usize] = chain_b;
        self.beside[a as usize][at_a] = Some(b);
        self.beside[b as usize][at_b] = Some(a);
    }

    /// All places: chain after chain, each begun at the end that `next` chooses for where the last one ended.
    fn end_to_end(&self, next: impl Fn(u32, &[u32]) -> Option<u32>) -> Vec<u32> {
        let mut is_left = vec![true; self.beside.len()];
        let is_end = |&place: &u32| self.beside[place as usize].contains(&None);
        let mut ends: Vec<u32> = (0..self.beside.len() as u32).filter(is_end).collect();
        let mut order = Vec::with_capacity(self.beside.len());
        let mut start = ends.first().copied();
        while let Some(mut place) = start {
            loop {
                is_left[place as usize] = false;
                order.push(place);
                let after = self.beside[place as usize].into_iter().flatten().find(|&other| is_left[other as usize]);
                match after {
                    Some(after) => place = after,
                    None => break,
                }
            }
            ends.retain(|&end| is_left[end as usize]);
            start = next(place, &ends);
        }
        order
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{UVec2, Vec3};

    fn texel(position: Vec3) -> Texel {
        let (side_u, side_v) = (Vec3::X, Vec3::Y);
        Texel { at: UVec2::ZERO, chart: 0, position, normal: Vec3::Z, area: 1.0, side_u, side_v, first_part: 0 }
    }

    /// Maps of two kinds, mixed in space: the walk takes one kind and then the other.
    #[test]
    fn maps_that_agree_follow_each_other() {
        let mut random = 7u32;
        let texels: Vec<Texel> = (0..200)
            .map(|k| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                texel(Vec3::new((random >> 16) as f32 / 65536.0, k as f32 / 200.0, 0.0))
            })
            .collect();
        let kind = |place: usize| place.is_multiple_of(3);
        let interval = |near| if near { Interval { low: 10, high: 20 } } else { Interval { low: 30, high: 40 } };
        let maps: Vec<Interval> = (0..200).flat_map(|place| vec![interval(kind(place)); 6]).collect();
        let order = walk(&texels, &maps);
        let mut all = order.clone();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..200), "each once");
        let changes = |order: &[u32]| order.windows(2).filter(|w| kind(w[0] as usize) != kind(w[1] as usize)).count();
        let in_space: Vec<u32> = (0..200).collect();
        println!("{} changes, {} by place alone", changes(&order), changes(&in_space));
        assert!(changes(&order) <= 3 && changes(&in_space) > 100);
        assert_eq!(order, walk(&texels, &maps), "the same again");
        assert!(walk(&[], &[]).is_empty() && walk(&texels[..1], &maps[..6]) == [0]);
    }
}
