//! Which vertices carry light together: each its own, or, on flat parts, all within a square of a grid.
//!
//! A patch is made of the cells of its vertices (a third of each triangle around). On a flat part the grid lies along the
//! sides of the smallest rectangle around the part; a vertex then takes light from the patches that it lies between.
//! Looks at the rest pose alone: flat parts move rigidly.

use super::calipers;
use super::facets::Facets;
use glam::{UVec2, Vec2, Vec3};
use std::collections::BTreeMap;

/// Of [`Patches::along`]: a patch has no grid to lie along.
pub const NO_GRID: UVec2 = UVec2::MAX;

/// A part this much narrower than long has no grid; and what squares, and distances from the border, are off by at most.
const SLIMMEST: f32 = 1e-3;

/// See the [module](self).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Patches {
    /// Of each patch, rising.
    pub vertices: Vec<Vec<u32>>,
    /// Where each lies among those of its facet: in the plane of its grid, or world space; metres.
    pub places: Vec<Vec3>,
    /// Mean of its vertices, world space, metres.
    pub world_places: Vec<Vec3>,
    /// The vertex nearest to that.
    middles: Vec<u32>,
    /// The patches of each facet.
    pub of_facet: Vec<Vec<u32>>,
    /// Per facet: two vertices that its grid lies along, or [`NO_GRID`].
    pub along: Vec<UVec2>,
    /// Per vertex: the patches that it takes light from, with shares that sum to 1; nothing for a vertex of no triangle.
    pub shares: Vec<Vec<(u32, f32)>>,
}

impl Patches {
    /// Each of `vertices` its own.
    pub fn of_vertices(vertices: &[u32], positions: &[Vec3], facets: &Facets) -> Self {
        Self::new(vertices, positions, facets, None)
    }

    /// Those of flat facets in squares of at most `side` metres, as long as several vertices share one.
    pub fn of_squares(vertices: &[u32], positions: &[Vec3], facets: &Facets, side: f32) -> Self {
        Self::new(vertices, positions, facets, Some(side))
    }

    fn new(vertices: &[u32], positions: &[Vec3], facets: &Facets, side: Option<f32>) -> Self {
        let facet_count = facets.is_flat.len();
        let mut by_facet: Vec<Vec<u32>> = vec![Vec::new(); facet_count];
        for &vertex in vertices {
            by_facet[facets.of_vertex[vertex as usize] as usize].push(vertex);
        }
        let mut patches = Self {
            of_facet: vec![Vec::new(); facet_count],
            along: vec![NO_GRID; facet_count],
            shares: vec![Vec::new(); positions.len()],
            ..Self::default()
        };
        for (facet, own) in by_facet.iter().enumerate() {
            let grid = side.filter(|_| facets.is_flat[facet]).and_then(|side| Grid::new(own, positions, side));
            match grid {
                Some(grid) => patches.add_grid(facet, own, positions, &grid),
                None => {
                    for &vertex in own {
                        let patch = patches.add(facet, vec![vertex], positions[vertex as usize], positions);
                        patches.shares[vertex as usize].push((patch, 1.0));
                    }
                }
            }
        }
        patches
    }

    /// The vertex nearest to the middle of a patch.
    pub fn middle_of(&self, patch: u32) -> u32 {
        self.middles[patch as usize]
    }

    fn add(&mut self, facet: usize, vertices: Vec<u32>, place: Vec3, positions: &[Vec3]) -> u32 {
        let patch = self.vertices.len() as u32;
        let at = |vertex: u32| positions[vertex as usize];
        let mean = vertices.iter().map(|&vertex| at(vertex)).sum::<Vec3>() / vertices.len() as f32;
        let off = |vertex: u32| at(vertex).distance_squared(mean);
        let middle = vertices.iter().copied().min_by(|&a, &b| off(a).total_cmp(&off(b)).then(a.cmp(&b)));
        self.middles.push(middle.expect("a patch has vertices"));
        self.world_places.push(mean);
        self.vertices.push(vertices);
        self.places.push(place);
        self.of_facet[facet].push(patch);
        patch
    }

    fn add_grid(&mut self, facet: usize, vertices: &[u32], positions: &[Vec3], grid: &Grid) {
        self.along[facet] = grid.along;
        let mut squares: BTreeMap<(i32, i32), Vec<u32>> = BTreeMap::new();
        for &vertex in vertices {
            squares.entry(grid.square_of(positions[vertex as usize])).or_default().push(vertex);
        }
        let mut patch_of = BTreeMap::new();
        for (&square, own) in &squares {
            let middle = grid.low + (Vec2::new(square.0 as f32, square.1 as f32) + 0.5) * grid.sides;
            patch_of.insert(square, self.add(facet, own.clone(), middle.extend(0.0), positions));
        }
        for &vertex in vertices {
            let near = grid.between(positions[vertex as usize]);
            let found = near.into_iter().filter_map(|(square, share)| Some((*patch_of.get(&square)?, share)));
            let found: Vec<(u32, f32)> = found.filter(|&(_, share)| share > 0.0).collect();
            // Its own square is always among them.
            let sum: f32 = found.iter().map(|&(_, share)| share).sum();
            self.shares[vertex as usize] = found.into_iter().map(|(patch, share)| (patch, share / sum)).collect();
        }
    }
}

/// Squares over a flat facet.
struct Grid {
    /// In the plane, unit, metres.
    axes: [Vec3; 2],
    low: Vec2,
    sides: Vec2,
    counts: (i32, i32),
    along: UVec2,
}

impl Grid {
    /// `None` where all vertices lie in one line.
    fn new(vertices: &[u32], positions: &[Vec3], side: f32) -> Option<Self> {
        let at = |vertex: u32| positions[vertex as usize];
        // Any two directions in the plane: to the vertex farthest from the first, and to the one farthest from that line.
        let first = at(*vertices.first()?);
        let farthest = |from: &dyn Fn(Vec3) -> Vec3| {
            vertices
                .iter()
                .map(|&vertex| from(at(vertex)))
                .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        };
        let u = farthest(&|p| p - first)?.try_normalize()?;
        let v = farthest(&|p| (p - first).reject_from_normalized(u))?.try_normalize()?;
        let mut flat: Vec<Vec2> = vertices
            .iter()
            .map(|&vertex| at(vertex) - first)
            .map(|offset| Vec2::new(offset.dot(u), offset.dot(v)))
            .collect();
        let direction = calipers::direction(&mut flat);
        let axes = [direction, direction.perp()].map(|d| d.x * u + d.y * v);
        let project = |p: Vec3| Vec2::new(p.dot(axes[0]), p.dot(axes[1]));
        let (low, high) = vertices.iter().fold((Vec2::MAX, Vec2::MIN), |(low, high), &vertex| {
            (low.min(project(at(vertex))), high.max(project(at(vertex))))
        });
        let extent = high - low;
        if extent.min_element() <= SLIMMEST * extent.max_element() {
            return None;
        }
        // More squares than vertices would all be single ones.
        let counts = (extent / side - SLIMMEST).ceil().clamp(Vec2::ONE, Vec2::splat(vertices.len() as f32));
        let along = [low.y, high.y].map(|border| {
            // The edge of the hull that lies along the rectangle.
            let on_border = |vertex: &u32| (project(at(*vertex)).y - border).abs() <= SLIMMEST * extent.y;
            let by_place = |a: &u32, b: &u32| project(at(*a)).x.total_cmp(&project(at(*b)).x);
            let mut own: Vec<u32> = vertices.iter().copied().filter(on_border).collect();
            own.sort_by(by_place);
            UVec2::new(own[0], own[own.len() - 1])
        });
        let length = |pair: &UVec2| at(pair.x).distance_squared(at(pair.y));
        let along = if length(&along[0]) >= length(&along[1]) { along[0] } else { along[1] };
        if along.x == along.y {
            return None;
        }
        Some(Self { axes, low, sides: extent / counts, counts: (counts.x as i32, counts.y as i32), along })
    }

    /// In squares from the corner.
    fn place(&self, p: Vec3) -> Vec2 {
        (Vec2::new(p.dot(self.axes[0]), p.dot(self.axes[1])) - self.low) / self.sides
    }

    fn square_of(&self, p: Vec3) -> (i32, i32) {
        let at = self.place(p).floor();
        ((at.x as i32).clamp(0, self.counts.0 - 1), (at.y as i32).clamp(0, self.counts.1 - 1))
    }

    /// The four squares whose middles lie around a point, and its bilinear shares of them.
    fn between(&self, p: Vec3) -> [((i32, i32), f32); 4] {
        let at = self.place(p) - 0.5;
        let (corner, share) = (at.floor(), at - at.floor());
        let (i, j) = (corner.x as i32, corner.y as i32);
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(di, dj)| {
            let along = |step: i32, share: f32| if step == 0 { 1.0 - share } else { share };
            ((i + di, j + dj), along(di, share.x) * along(dj, share.y))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    /// A rectangle of 4 by 3 m in vertices 10 cm apart, turned about all axes.
    fn board() -> (Vec<Vec3>, Quat) {
        let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.7);
        let flat = (0..31 * 41).map(|k| Vec3::new((k % 41) as f32 * 0.1, 0.0, (k / 41) as f32 * 0.1));
        (flat.map(|p| turn * p + Vec3::ONE).collect(), turn)
    }

    fn one_facet(count: usize, is_flat: bool) -> Facets {
        Facets { of_vertex: vec![0; count], is_flat: vec![is_flat], middle: vec![0] }
    }

    #[test]
    fn squares_lie_along_the_sides_and_hold_every_vertex_once() {
        let (positions, turn) = board();
        let vertices: Vec<u32> = (0..positions.len() as u32).collect();
        let patches = Patches::of_squares(&vertices, &positions, &one_facet(positions.len(), true), 0.5);
        assert_eq!(patches.vertices.len(), 8 * 6);
        let [from, to] = patches.along[0].to_array().map(|v| positions[v as usize]);
        let along = turn.inverse() * (to - from).normalize();
        assert!(along.abs().max_element() > 0.9999, "{along}");
        let mut all: Vec<u32> = patches.vertices.concat();
        all.sort_unstable();
        assert_eq!(all, vertices);
        // Parts that are not flat, or lie in one line, stay as they are.
        let bent = Patches::of_squares(&vertices, &positions, &one_facet(positions.len(), false), 0.5);
        assert_eq!(bent, Patches::of_vertices(&vertices, &positions, &one_facet(positions.len(), true)));
        let line: Vec<u32> = (0..41).collect();
        let line = Patches::of_squares(&line, &positions, &one_facet(positions.len(), true), 0.5);
        assert_eq!((line.vertices.len(), line.along[0]), (41, NO_GRID));
    }

    /// What rises evenly over squares rises evenly between vertices, out to the middles of the outermost squares.
    #[test]
    fn vertices_take_light_from_the_patches_around() {
        let (positions, _) = board();
        let vertices: Vec<u32> = (0..positions.len() as u32).collect();
        let grid = Grid::new(&vertices, &positions, 0.5).unwrap();
        for &at in &positions {
            let near = grid.between(at);
            let sum =
                |of: &dyn Fn((i32, i32)) -> f32| near.iter().map(|&(square, share)| share * of(square)).sum::<f32>();
            let taken = Vec2::new(sum(&|(i, _)| i as f32 + 0.5), sum(&|(_, j)| j as f32 + 0.5));
            assert!(taken.distance(grid.place(at)) < 1e-3, "{taken} for {}", grid.place(at));
            let (i, j) = grid.square_of(at);
            assert!(
                near.iter().any(|&(square, share)| square == (i, j) && share >= 0.2499),
                "its own square is among them"
            );
        }
        let patches = Patches::of_squares(&vertices, &positions, &one_facet(positions.len(), true), 0.5);
        for (vertex, shares) in (0u32..).zip(&patches.shares) {
            assert!((shares.iter().map(|&(_, share)| share).sum::<f32>() - 1.0).abs() < 1e-5);
            assert!(shares.iter().any(|&(patch, _)| patches.vertices[patch as usize].contains(&vertex)));
        }
        // In a corner there is nothing else.
        assert_eq!(patches.shares[0].len(), 1);
    }
}
