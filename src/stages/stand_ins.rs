//! Elements that stand inside of other things, and what they show instead of the darkness in there: the light of an
//! element in the open beside them.
//!
//! For methods whose light at an element cannot be asked for elsewhere ([`super::open_places`] is for those where it can).
//! Triangles that lie in the open in part have corners inside, as a wall's do behind its skirting, and the display would
//! draw the darkness out into the room. Decided once, at rest. Nothing here is sent on: what is hidden sends no light.
//!
//! What it does not do: elements more than `RINGS` neighbours away from the open stay as they are, as do those on
//! surfaces that lie inside of things as a whole; nobody sees them.

use super::elements::ElementTopology;
use super::hidden_parts::HiddenPartsError;
use super::open_places::{self, AtRest};
use super::work::Watch;
use crate::gpu::shaders::elements as passes;
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use glam::{UVec2, Vec3};
use std::collections::BTreeMap;

/// How far from the open an element takes its light from there, in neighbours.
const RINGS: usize = 64;
/// Cosine between the normals of neighbours on one surface, at least.
const SAME_WAY: f32 = 0.5;

/// Which elements show whose light.
pub struct StandIns {
    /// The element in the open, by the one that is not.
    of: BTreeMap<u32, u32>,
    /// (hidden, in the open).
    pairs: Buffer<UVec2>,
}

impl StandIns {
    pub fn find(
        context: &Context,
        at_rest: &AtRest<'_>,
        topology: &ElementTopology,
        watch: &dyn Watch,
    ) -> Result<Self, HiddenPartsError> {
        let (points, normals) = at_rest.stands(topology);
        let hidden = open_places::hidden(context, at_rest, (&points, &normals), watch)?;
        Ok(Self::new(context, nearest_in_the_open(&hidden, topology, &points, &normals))?)
    }

    /// Where every element shows its own light.
    pub fn none(context: &Context) -> Result<Self, GpuError> {
        Self::new(context, BTreeMap::new())
    }

    fn new(context: &Context, of: BTreeMap<u32, u32>) -> Result<Self, GpuError> {
        let pairs: Vec<UVec2> = of.iter().map(|(&hidden, &open)| UVec2::new(hidden, open)).collect();
        Ok(Self { of, pairs: context.upload("elements/stand-ins", &pairs)? })
    }

    /// Whose light `element` shows: its own, mostly.
    pub fn of(&self, element: u32) -> u32 {
        self.of.get(&element).copied().unwrap_or(element)
    }

    /// Gives hidden elements the value of those that stand in for them.
    pub fn take_over(&self, recorder: &mut Recorder<'_>, values: &Buffer<Vec3>) {
        let pair_count = self.of.len() as u32;
        let params = passes::TakeOverParams { pair_count };
        recorder.dispatch(&passes::TakeOver { pairs: &self.pairs, values, params }, pair_count);
    }
}

/// Outwards in, ring by ring: of the neighbours that look the same way, the nearest in the open or its own stand-in.
fn nearest_in_the_open(
    hidden: &[usize],
    topology: &ElementTopology,
    points: &[Vec3],
    normals: &[Vec3],
) -> BTreeMap<u32, u32> {
    let mut shown: Vec<Option<u32>> = (0..points.len() as u32).map(Some).collect();
    hidden.iter().for_each(|&element| shown[element] = None);
    let (mut left, mut of) = (hidden.to_vec(), BTreeMap::new());
    for _ in 0..RINGS {
        let beside = |&element: &usize| {
            let ring = topology.ring.row(element as u32).iter().map(|&other| other as usize);
            let same_way = ring.filter(|&other| normals[element].dot(normals[other]) > SAME_WAY);
            let away = |open: &u32| points[*open as usize].distance_squared(points[element]);
            let open = same_way.filter_map(|other| shown[other]);
            open.min_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b))).map(|open| (element, open))
        };
        let found: Vec<(usize, u32)> = left.iter().filter_map(beside).collect();
        if found.is_empty() {
            break;
        }
        for (element, open) in found {
            shown[element] = Some(open);
            of.insert(element as u32, open);
        }
        left.retain(|&element| shown[element].is_none());
    }
    of
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::adjacency::Rows;

    /// A row of places a metre apart, two elements at the third: one that looks up, one that looks aside.
    #[test]
    fn the_nearest_in_the_open_on_the_same_surface_stands_in() {
        let points: Vec<Vec3> = [0.0, 1.0, 2.0, 3.5, 2.0].map(|x| Vec3::X * x).to_vec();
        let mut normals = vec![Vec3::Y; 5];
        normals[4] = Vec3::X;
        let ring = [vec![1], vec![0, 2, 4], vec![1, 3, 4], vec![2, 4], vec![1, 2, 3]];
        let mut rows = Rows { offsets: vec![0], values: Vec::new() };
        for row in ring {
            rows.values.extend(row);
            rows.offsets.push(rows.values.len() as u32);
        }
        let topology = ElementTopology { ring: rows, ..ElementTopology::default() };
        let found = nearest_in_the_open(&[1, 2, 4], &topology, &points, &normals);
        // 2 is nearer to 3 than to 0, and 4, which looks aside, lies inside as a whole.
        assert_eq!(found, BTreeMap::from([(1, 0), (2, 3)]));
        let found = nearest_in_the_open(&[0, 1, 2], &topology, &points, &normals);
        assert_eq!(found, BTreeMap::from([(0, 3), (1, 3), (2, 3)]));
    }
}
