//! Orders in which the texels of an atlas are visited: neighbours in the order see nearly the same.  [Ritschel2008 3.2]
//!
//! [Ritschel2008]: crate::methods::PAPERS

use crate::scene::atlas::{Atlas, NO_TEXEL, Texel};
use glam::{UVec2, Vec3};
use std::collections::{BTreeMap, HashMap};

crate::choice! {
    /// How the texels are walked.
    pub enum Sequence {
        /// From each texel to the nearest one left, charts or not
        Greedy = "greedy",
        /// Row by row in each chart, to and fro
        ZigZag = "zig-zag",
        /// Along the border of each chart and inwards, stepping back when stuck
        Spiral = "spiral",
        /// To the map close by that is most alike, as small maps made before tell; charts or not. Smaller, but a depth that
        /// holds for more maps stands less well for each: more light comes by behind thin things
        Sight = "sight",
    }
}

/// Indices of all texels, each once, in the order of the walk; of [`Sequence::Sight`], the one that it starts from.
pub fn walk(atlas: &Atlas, sequence: Sequence) -> Vec<u32> {
    match sequence {
        Sequence::Greedy => greedy(&atlas.texels),
        Sequence::ZigZag => by_chart(atlas, zig_zag),
        Sequence::Spiral | Sequence::Sight => by_chart(atlas, spiral),
    }
}

fn greedy(texels: &[Texel]) -> Vec<u32> {
    let mut nearest = NearestLeft::new(texels.iter().map(|texel| texel.position).collect());
    let mut order = Vec::with_capacity(texels.len());
    let mut next = (!texels.is_empty()).then_some(0);
    while let Some(texel) = next {
        nearest.take(texel);
        order.push(texel);
        next = nearest.to(texels[texel as usize].position);
    }
    order
}

/// Walks chart after chart, each by `within` from the texel nearest to where the last one ended, among charts that face
/// alike before others: what lies below a chart's own plane its maps leave open, and alike ones leave open the same.
/// Differs from [Ritschel2008]: there the nearest chart is next, whatever it faces.
fn by_chart(atlas: &Atlas, within: impl Fn(&Atlas, &[u32], u32, &mut Vec<u32>)) -> Vec<u32> {
    let mut charts: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (index, texel) in atlas.texels.iter().enumerate() {
        charts.entry(texel.chart).or_default().push(index as u32);
    }
    let texel = |index: u32| &atlas.texels[index as usize];
    let mut alike: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for chart in charts.values() {
        let normal: Vec3 = chart.iter().map(|&index| texel(index).area * texel(index).normal).sum();
        alike.entry(facing(normal)).or_default().extend(chart);
    }
    let mut order = Vec::with_capacity(atlas.texels.len());
    let (mut last, mut faces) = (Vec3::ZERO, None);
    while let Some(next) = alike.keys().copied().reduce(|a, b| if turn(faces, b) < turn(faces, a) { b } else { a }) {
        let members = alike.remove(&next).unwrap_or_default();
        faces = Some(next);
        let mut nearest = NearestLeft::new(members.iter().map(|&index| texel(index).position).collect());
        let place: HashMap<u32, u32> = members.iter().copied().zip(0..).collect();
        while let Some(first) = nearest.to(last) {
            let first = members[first as usize];
            let chart = &charts[&texel(first).chart];
            within(atlas, chart, first, &mut order);
            chart.iter().for_each(|index| nearest.take(place[index]));
            last = order.last().map_or(last, |&index| texel(index).position);
        }
    }
    order
}

/// Cells a side of each face of a cube, by which directions are told apart.
const FACING_CELLS: usize = 31;

/// Number of the cell that a direction, of any length, goes through.
fn facing(normal: Vec3) -> usize {
    let axis = normal.abs().max_position();
    let (along, across) = (normal[axis], [normal[(axis + 1) % 3], normal[(axis + 2) % 3]]);
    let cell = |c: f32| ((c / along.abs().max(f32::MIN_POSITIVE) * 0.5 + 0.5) * FACING_CELLS as f32) as usize;
    let [u, v] = across.map(|c| cell(c).min(FACING_CELLS - 1));
    ((2 * axis + usize::from(along < 0.0)) * FACING_CELLS + v) * FACING_CELLS + u
}

/// The middle of a cell, unit.
fn faced(cell: usize) -> Vec3 {
    let middle = |k: usize| (2.0 * (k % FACING_CELLS) as f32 + 1.0) / FACING_CELLS as f32 - 1.0;
    let (face, axis) = (cell / (FACING_CELLS * FACING_CELLS), cell / (2 * FACING_CELLS * FACING_CELLS));
    let mut direction = Vec3::ZERO;
    direction[axis] = if face % 2 == 0 { 1.0 } else { -1.0 };
    direction[(axis + 1) % 3] = middle(cell);
    direction[(axis + 2) % 3] = middle(cell / FACING_CELLS);
    direction.normalize()
}

/// How far one cell is turned from another.
fn turn(from: Option<usize>, to: usize) -> f32 {
    from.map_or(0.0, |from| faced(from).distance(faced(to)))
}

/// Rows from the top, or from the bottom where the start is nearer to it, every other one backwards.
fn zig_zag(atlas: &Atlas, chart: &[u32], first: u32, order: &mut Vec<u32>) {
    let at = |texel: u32| atlas.texels[texel as usize].at;
    let top = chart.iter().map(|&t| at(t).y).min().unwrap_or(0);
    let bottom = chart.iter().map(|&t| at(t).y).max().unwrap_or(0);
    let upwards = bottom - at(first).y < at(first).y - top;
    let left = chart.iter().map(|&t| at(t).x).min().unwrap_or(0);
    let right = chart.iter().map(|&t| at(t).x).max().unwrap_or(0);
    let backwards = right - at(first).x < at(first).x - left;
    let key = |&texel: &u32| {
        let UVec2 { x, y } = at(texel);
        let row = if upwards { bottom - y } else { y - top };
        (row, if (row % 2 == 1) != backwards { u32::MAX - x } else { x })
    };
    let mut rows = chart.to_vec();
    rows.sort_by_key(key);
    order.extend(rows);
}

/// Keeps to the left what is outside or was visited; where all around was, goes back along its way to where it can
/// turn off.
fn spiral(atlas: &Atlas, chart: &[u32], first: u32, order: &mut Vec<u32>) {
    let mut left: HashMap<u32, bool> = chart.iter().map(|&texel| (texel, true)).collect();
    let neighbour = |texel: u32, heading: usize| -> Option<u32> {
        let UVec2 { x, y } = atlas.texels[texel as usize].at;
        let size = atlas.resolution;
        let (x, y) = match heading % 4 {
            0 => (x + 1, y),
            1 => (x, y + 1),
            2 => (x.wrapping_sub(1), y),
            _ => (x, y.wrapping_sub(1)),
        };
        let index = (x < size && y < size).then(|| atlas.texel_at[(y * size + x) as usize])?;
        (index != NO_TEXEL && atlas.texels[index as usize].chart == atlas.texels[texel as usize].chart).then_some(index)
    };
    // Texels in atlas order, for parts of a chart that touch nowhere.
    let mut rest = chart.iter();
    let mut start = Some(first);
    while let Some(mut texel) = start {
        let mut heading = (0..4).find(|&h| neighbour(texel, h + 3).is_none()).unwrap_or(0);
        let mut way = Vec::new();
        left.insert(texel, false);
        order.push(texel);
        loop {
            // Left, ahead, right, back.
            let turns = [3, 0, 1, 2].map(|turn| (heading + turn) % 4);
            let free = turns.iter().find_map(|&h| neighbour(texel, h).filter(|n| left[n]).map(|n| (h, n)));
            match free {
                Some((taken, next)) => {
                    way.push((texel, heading));
                    heading = taken;
                    texel = next;
                    left.insert(texel, false);
                    order.push(texel);
                }
                None => match way.pop() {
                    Some((before, its_heading)) => (texel, heading) = (before, its_heading),
                    None => break,
                },
            }
        }
        start = rest.find(|texel| left[*texel]).copied();
    }
}

/// Finds the nearest of the points that were not taken yet, by a grid.
struct NearestLeft {
    points: Vec<Vec3>,
    cells: HashMap<[i32; 3], Vec<u32>>,
    cell: f32,
    low: Vec3,
    /// Cells a side.
    extent: i32,
    left: usize,
}

impl NearestLeft {
    fn new(points: Vec<Vec3>) -> Self {
        let (low, high) = points.iter().fold((Vec3::MAX, Vec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
        let size = (high - low).max_element().max(f32::MIN_POSITIVE);
        // Points lie on surfaces: a few to a cell.
        let extent = ((points.len() as f32).sqrt() / 2.0).clamp(1.0, 256.0) as i32;
        let cell = size / extent as f32;
        let mut grid = Self { left: points.len(), points, cells: HashMap::new(), cell, low, extent };
        for index in 0..grid.points.len() {
            let key = grid.key(grid.points[index]);
            grid.cells.entry(key).or_default().push(index as u32);
        }
        grid
    }

    fn key(&self, point: Vec3) -> [i32; 3] {
        ((point - self.low) / self.cell).as_ivec3().clamp(glam::IVec3::ZERO, glam::IVec3::splat(self.extent)).to_array()
    }

    fn take(&mut self, index: u32) {
        let key = self.key(self.points[index as usize]);
        if let Some(cell) = self.cells.get_mut(&key)
            && let Some(at) = cell.iter().position(|&other| other == index)
        {
            cell.remove(at);
            self.left -= 1;
            if cell.is_empty() {
                self.cells.remove(&key);
            }
        }
    }

    /// The lowest index of the nearest points left.
    fn to(&self, point: Vec3) -> Option<u32> {
        let squared = |i: u32| self.points[i as usize].distance_squared(point);
        let nearer = |a: u32, b: u32| if (squared(b), b) < (squared(a), a) { b } else { a };
        let best_of = |cells: &mut dyn Iterator<Item = &Vec<u32>>| cells.flatten().copied().reduce(nearer);
        // Few cells left: look at all of them, rather than at ever larger shells of empty ones.
        if self.left < 64 || self.cells.len() < 64 {
            return best_of(&mut self.cells.values());
        }
        let [x, y, z] = self.key(point);
        let mut best: Option<u32> = None;
        for shell in 0..=self.extent {
            if best.is_some_and(|b| squared(b).sqrt() < (shell - 1) as f32 * self.cell) {
                break;
            }
            let range = |c: i32| (c - shell).max(0)..=(c + shell).min(self.extent);
            for i in range(x) {
                for j in range(y) {
                    for k in range(z) {
                        if (i - x).abs().max((j - y).abs()).max((k - z).abs()) != shell {
                            continue;
                        }
                        let found = best_of(&mut self.cells.get(&[i, j, k]).into_iter());
                        best = best.into_iter().chain(found).reduce(nearer);
                    }
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::atlas::Size;
    use crate::scene::geometry::Geometry;
    use crate::scene::pose::Pose;
    use crate::scene::{LoadOptions, builtin, deform};

    fn cornell() -> Atlas {
        let scene = builtin::open("builtin:cornell-box", &LoadOptions::default()).unwrap();
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let positions = deform::world_positions(&geometry, &Pose::rest(&scene));
        Atlas::new(&scene, &geometry, &positions, Size::tight(64)).unwrap()
    }

    #[test]
    fn every_texel_is_visited_once_and_most_steps_are_short() {
        let atlas = cornell();
        for sequence in [Sequence::Greedy, Sequence::ZigZag, Sequence::Spiral] {
            let order = walk(&atlas, sequence);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert!(sorted.iter().copied().eq(0..atlas.texels.len() as u32), "{sequence:?}");
            assert_eq!(order, walk(&atlas, sequence));
            let places: Vec<Vec3> = order.iter().map(|&t| atlas.texels[t as usize].position).collect();
            let short = places.windows(2).filter(|pair| pair[0].distance(pair[1]) < 1.6 / atlas.scale).count();
            println!("{sequence:?}: {short} of {} steps are short", order.len());
            assert!(short * 10 > order.len() * 9, "{sequence:?}: {short} short steps");
        }
    }

    /// Charts that face alike follow each other, whatever order they lie in, and cells are those of their own middles.
    #[test]
    fn charts_that_face_alike_are_walked_together() {
        let cells = 6 * FACING_CELLS * FACING_CELLS;
        assert!((0..cells).all(|cell| facing(faced(cell)) == cell && turn(Some(cell), cell) == 0.0));
        let atlas = cornell();
        let order = walk(&atlas, Sequence::Spiral);
        let faces: Vec<usize> = order.iter().map(|&t| facing(atlas.texels[t as usize].normal)).collect();
        let changes = faces.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let distinct: std::collections::BTreeSet<usize> = faces.into_iter().collect();
        assert_eq!(changes + 1, distinct.len(), "flat charts alone: every direction is walked through once");
        assert!(distinct.len() > 5);
    }

    #[test]
    fn the_nearest_left_is_the_nearest() {
        let atlas = cornell();
        let points: Vec<Vec3> = atlas.texels.iter().map(|texel| texel.position).collect();
        let mut grid = NearestLeft::new(points.clone());
        let mut is_left = vec![true; points.len()];
        for step in 0..400u32 {
            let from = points[(step * 997) as usize % points.len()];
            let found = grid.to(from).unwrap();
            let best = (0..points.len())
                .filter(|&i| is_left[i])
                .map(|i| points[i].distance_squared(from))
                .fold(f32::MAX, f32::min);
            assert_eq!(points[found as usize].distance_squared(from), best);
            grid.take(found);
            is_left[found as usize] = false;
        }
    }
}
