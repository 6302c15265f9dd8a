//! The facets of a geometry's surfaces: neighbouring vertices that look the same way.
//!
//! A smooth mesh turns round corners: both sides of a board with rounded edges are one surface. Its facets are its flat
//! parts, however their edges are rounded, and elsewhere stretches whose normals lie within a cone. Looks at the rest
//! pose alone.

use glam::Vec3;

use super::adjacency::{incident_triangles, one_ring};
use super::geometry::Geometry;
use super::surfaces::{Disjoint, Surfaces};

/// Sine of the angle between neighbouring triangles of one plane.
const COPLANAR: f32 = 1e-3;
/// How far vertices of a flat part may lie off its plane, as a share of its extent.
const FLATNESS: f32 = 1e-3;
/// Cosine of the angle (20 degrees) by which the cell of a vertex on a rounded edge may lean from the plane it belongs to.
const LEANING: f32 = 0.94;
/// Vertices of a flat part, at least.
const LEAST_FLAT: u32 = 4;
/// Cosine of the half angle (25 degrees) of a cone of normals.
const CONE: f32 = 0.906;
/// Not yet in a facet.
const NONE: u32 = u32::MAX;

/// See the [module](self).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Facets {
    /// Facet of each vertex.
    pub of_vertex: Vec<u32>,
    /// Per facet: all of it lies in one plane, apart from rounded edges.
    pub is_flat: Vec<bool>,
    /// Per facet: the vertex whose cell looks most like the whole.
    pub middle: Vec<u32>,
}

impl Facets {
    /// `positions`: world space, as for `surfaces`.
    pub fn new(geometry: &Geometry, positions: &[Vec3], surfaces: &Surfaces) -> Self {
        let corners_of = |corners: [u32; 3]| corners.map(|vertex| positions[vertex as usize]);
        let areas: Vec<Vec3> = geometry
            .triangles
            .iter()
            .map(|&corners| {
                let [a, b, c] = corners_of(corners);
                0.5 * (b - a).cross(c - a)
            })
            .collect();
        let mut cells = vec![Vec3::ZERO; positions.len()];
        for (corners, area) in geometry.triangles.iter().zip(&areas) {
            corners.iter().for_each(|&vertex| cells[vertex as usize] += *area);
        }
        let normals: Vec<Vec3> = cells.iter().map(|area| area.normalize_or_zero()).collect();

        let mut facets = Self { of_vertex: vec![NONE; positions.len()], ..Self::default() };
        facets.take_flat_surfaces(surfaces);
        let bends = deforming(geometry);
        facets.find_planes(geometry, positions, &areas, &normals, &bends);
        facets.find_cones(geometry, &normals, surfaces);
        facets.find_middles(&cells, &normals);
        facets
    }

    fn open(&mut self, is_flat: bool) -> u32 {
        self.is_flat.push(is_flat);
        self.is_flat.len() as u32 - 1
    }

    /// A flat surface is one facet.
    fn take_flat_surfaces(&mut self, surfaces: &Surfaces) {
        let mut facet_of = vec![NONE; surfaces.is_flat.len()];
        for (vertex, &surface) in surfaces.of_vertex.iter().enumerate() {
            let surface = surface as usize;
            if !surfaces.is_flat[surface] {
                continue;
            }
            if facet_of[surface] == NONE {
                facet_of[surface] = self.open(true);
            }
            self.of_vertex[vertex] = facet_of[surface];
        }
    }

    /// Flat parts of other surfaces; a vertex on an edge goes with the plane that has the most of its cell.
    fn find_planes(
        &mut self,
        geometry: &Geometry,
        positions: &[Vec3],
        areas: &[Vec3],
        normals: &[Vec3],
        bends: &[bool],
    ) {
        let triangles = &geometry.triangles;
        let is_open = |vertex: u32| self.of_vertex[vertex as usize] == NONE && !bends[vertex as usize];
        let mut edges: Vec<([u32; 2], u32)> = triangles
            .iter()
            .zip(0..)
            .filter(|(corners, _)| corners.iter().all(|&vertex| is_open(vertex)))
            .flat_map(|(&[a, b, c], triangle)| [[a, b], [b, c], [c, a]].map(|[p, q]| ([p.min(q), p.max(q)], triangle)))
            .collect();
        edges.sort_unstable();
        let units: Vec<Vec3> = areas.iter().map(|area| area.normalize_or_zero()).collect();
        let mut joined = Disjoint::new(triangles.len());
        for pair in edges.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            let [p, q] = [pair[0].1, pair[1].1].map(|triangle| units[triangle as usize]);
            if p.dot(q) > 0.0 && p.cross(q).length() < COPLANAR {
                joined.join(pair[0].1, pair[1].1);
            }
        }
        let (group_of, group_count) = joined.numbered();
        let mut sums = vec![Vec3::ZERO; group_count];
        let mut bounds = vec![(Vec3::MAX, Vec3::MIN); group_count];
        for (&group, (corners, area)) in group_of.iter().zip(triangles.iter().zip(areas)) {
            sums[group as usize] += *area;
            let (low, high) = &mut bounds[group as usize];
            for &vertex in corners {
                (*low, *high) = (low.min(positions[vertex as usize]), high.max(positions[vertex as usize]));
            }
        }
        let planes: Vec<Vec3> = sums.iter().map(|sum| sum.normalize_or_zero()).collect();
        let mut anchors = vec![NONE; group_count];
        let mut is_plane = vec![true; group_count];
        for (&group, corners) in group_of.iter().zip(triangles) {
            let group = group as usize;
            if anchors[group] == NONE {
                anchors[group] = corners[0];
            }
            let (low, high) = bounds[group];
            let slack = FLATNESS * (high - low).length();
            let anchor = positions[anchors[group] as usize];
            is_plane[group] &=
                corners.iter().all(|&vertex| (positions[vertex as usize] - anchor).dot(planes[group]).abs() <= slack);
        }

        let incident = incident_triangles(positions.len() as u32, triangles);
        let chosen: Vec<u32> = (0..positions.len() as u32)
            .map(|vertex| {
                if !is_open(vertex) {
                    return NONE;
                }
                let own = incident.row(vertex);
                let share = |group: u32| -> f32 {
                    own.iter().filter(|&&t| group_of[t as usize] == group).map(|&t| areas[t as usize].length()).sum()
                };
                let groups = own.iter().map(|&triangle| group_of[triangle as usize]);
                let best = groups.max_by(|&a, &b| share(a).total_cmp(&share(b)).then(b.cmp(&a)));
                let fits = |group: &u32| {
                    is_plane[*group as usize] && normals[vertex as usize].dot(planes[*group as usize]) > LEANING
                };
                best.filter(fits).unwrap_or(NONE)
            })
            .collect();
        let mut counts = vec![0u32; group_count];
        chosen.iter().filter(|&&group| group != NONE).for_each(|&group| counts[group as usize] += 1);
        let mut facet_of = vec![NONE; group_count];
        for (vertex, group) in chosen.into_iter().enumerate() {
            if group == NONE || counts[group as usize] < LEAST_FLAT {
                continue;
            }
            if facet_of[group as usize] == NONE {
                facet_of[group as usize] = self.open(true);
            }
            self.of_vertex[vertex] = facet_of[group as usize];
        }
    }

    /// What is left, from seeds outwards as far as normals stay within a cone around the seed's.
    fn find_cones(&mut self, geometry: &Geometry, normals: &[Vec3], surfaces: &Surfaces) {
        let count = self.of_vertex.len() as u32;
        if !self.of_vertex.contains(&NONE) {
            return;
        }
        let rings = one_ring(count, &geometry.triangles);
        let mut front = Vec::new();
        for seed in 0..count {
            if self.of_vertex[seed as usize] != NONE {
                continue;
            }
            let facet = self.open(false);
            self.of_vertex[seed as usize] = facet;
            front.push(seed);
            while let Some(vertex) = front.pop() {
                for &near in rings.row(vertex) {
                    debug_assert_eq!(surfaces.of_vertex[near as usize], surfaces.of_vertex[seed as usize]);
                    if self.of_vertex[near as usize] == NONE
                        && normals[near as usize].dot(normals[seed as usize]) > CONE
                    {
                        self.of_vertex[near as usize] = facet;
                        front.push(near);
                    }
                }
            }
        }
    }

    fn find_middles(&mut self, cells: &[Vec3], normals: &[Vec3]) {
        let mut sums = vec![Vec3::ZERO; self.is_flat.len()];
        self.of_vertex.iter().zip(cells).for_each(|(&facet, area)| sums[facet as usize] += *area);
        self.middle = vec![NONE; self.is_flat.len()];
        for (vertex, &facet) in (0u32..).zip(&self.of_vertex) {
            let likeness = |vertex: u32| normals[vertex as usize].dot(sums[facet as usize]);
            let middle = &mut self.middle[facet as usize];
            if *middle == NONE || likeness(vertex) > likeness(*middle) {
                *middle = vertex;
            }
        }
    }
}

/// Per vertex: a skin or a morph target bends what it belongs to.
fn deforming(geometry: &Geometry) -> Vec<bool> {
    let mut bends = vec![false; geometry.vertex_part.len()];
    for part in geometry.parts.iter().filter(|part| part.skin_offset.is_some() || part.morph_target_count > 0) {
        bends[part.vertex_offset as usize..(part.vertex_offset + part.vertex_count) as usize].fill(true);
    }
    bends
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of squares, folded up along its length into a box profile with edges cut off: `sides` flat walls of three
    /// squares, joined by narrow slanting ones.
    fn board() -> (Geometry, Vec<Vec3>) {
        // Cross-section of a board 2 m wide and .2 m thick, corners cut by 2 cm; open at the ends.
        let profile = [
            (-1.0, -0.08),
            (-0.98, -0.1),
            (0.0, -0.1),
            (0.98, -0.1),
            (1.0, -0.08),
            (1.0, 0.08),
            (0.98, 0.1),
            (0.0, 0.1),
            (-0.98, 0.1),
            (-1.0, 0.08),
        ];
        let mut positions = Vec::new();
        for z in 0..4 {
            positions.extend(profile.iter().map(|&(x, y)| Vec3::new(x, y, z as f32)));
        }
        let n = profile.len() as u32;
        let mut triangles = Vec::new();
        for z in 0..3 {
            for k in 0..n {
                let (a, b) = (z * n + k, z * n + (k + 1) % n);
                triangles.extend([[a, a + n, b], [b, a + n, b + n]]);
            }
        }
        let vertex_part = vec![0; positions.len()];
        (Geometry { triangles, vertex_part, ..Geometry::default() }, positions)
    }

    #[test]
    fn both_sides_of_a_rounded_board_are_facets_of_their_own() {
        let (geometry, positions) = board();
        let surfaces = Surfaces::new(&geometry, &positions);
        assert!(surfaces.of_vertex.iter().all(|&surface| surface == 0) && !surfaces.is_flat[0]);
        let facets = Facets::new(&geometry, &positions, &surfaces);
        let facet_at = |x: f32, y: f32| -> Vec<u32> {
            let at = positions.iter().zip(&facets.of_vertex).filter(|(p, _)| (p.x, p.y) == (x, y));
            at.map(|(_, &facet)| facet).collect()
        };
        for y in [-0.1, 0.1] {
            let inside = facet_at(0.0, y);
            assert!(inside.iter().all(|&facet| facet == inside[0] && facets.is_flat[facet as usize]), "{inside:?}");
            // Its edges lean a little, and belong to it all the same.
            assert_eq!(facet_at(0.98, y), inside);
            assert_eq!(positions[facets.middle[inside[0] as usize] as usize].y, y);
        }
        assert_ne!(facet_at(0.0, 0.1), facet_at(0.0, -0.1));
        assert_ne!(facet_at(1.0, 0.08), facet_at(0.98, 0.1));
    }

    #[test]
    fn a_ball_has_facets_by_direction() {
        let (columns, rows) = (24, 12);
        let mut positions = Vec::new();
        for row in 0..=rows {
            let theta = std::f32::consts::PI * (0.5 + row as f32) / (rows + 1) as f32;
            for column in 0..columns {
                let phi = std::f32::consts::TAU * column as f32 / columns as f32;
                positions.push(Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()));
            }
        }
        let mut triangles = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let (a, b) = (row * columns + column, row * columns + (column + 1) % columns);
                triangles.extend([[a, b, a + columns], [b, b + columns, a + columns]]);
            }
        }
        let vertex_part = vec![0; positions.len()];
        let geometry = Geometry { triangles, vertex_part, ..Geometry::default() };
        let facets = Facets::new(&geometry, &positions, &Surfaces::new(&geometry, &positions));
        assert!(facets.is_flat.iter().all(|flat| !flat), "nothing is flat");
        assert!((12..120).contains(&facets.is_flat.len()), "{}", facets.is_flat.len());
        for (a, &facet) in positions.iter().zip(&facets.of_vertex) {
            for (b, _) in positions.iter().zip(&facets.of_vertex).filter(|(_, other)| **other == facet) {
                assert!(a.dot(*b) > 0.5, "{a} and {b} in one facet");
            }
        }
    }
}
