//! Flat-sided shapes: quads, boxes with hard or rounded edges, walls with rectangular or arched openings.

use super::{Shape, circle};
use glam::{Vec2, Vec3};

/// A plane to draw on: `u` to the right and `v` up (unit, perpendicular); the front faces `u` x `v`.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub origin: Vec3,
    pub u: Vec3,
    pub v: Vec3,
}

/// A hole in a wall with an upright arch on top (flat when `arch_segments` is 0). Metres in the wall's [`Frame`].
#[derive(Debug, Clone, Copy)]
pub struct Opening {
    /// Lower corner.
    pub low: Vec2,
    /// Upper corner; where there is an arch, it springs from this height and rises by half the width.
    pub high: Vec2,
    pub arch_segments: usize,
}

impl Frame {
    pub fn new(origin: Vec3, u: Vec3, v: Vec3) -> Self {
        Self { origin, u, v }
    }

    pub fn normal(&self) -> Vec3 {
        self.u.cross(self.v)
    }

    pub fn point(&self, at: Vec2) -> Vec3 {
        self.origin + self.u * at.x + self.v * at.y
    }

    fn vertex(&self, shape: &mut Shape, at: Vec2) -> u32 {
        shape.vertex(self.point(at), self.normal(), Vec2::new(at.x, -at.y))
    }

    /// A wall of `size` with rectangular holes: the cells of a grid through all hole edges, so that no vertex lies on
    /// another's edge.
    pub fn wall(&self, size: Vec2, holes: &[Opening]) -> Shape {
        let cuts = |size: f32, pick: fn(Vec2) -> f32| {
            let mut cuts: Vec<f32> =
                holes.iter().flat_map(|h| [pick(h.low), pick(h.high)]).chain([0.0, size]).collect();
            cuts.retain(|x| (0.0..=size).contains(x));
            cuts.sort_by(f32::total_cmp);
            cuts.dedup();
            cuts
        };
        let (columns, rows) = (cuts(size.x, |p| p.x), cuts(size.y, |p| p.y));
        let mut shape = Shape::default();
        for pair in rows.windows(2) {
            for cell in columns.windows(2) {
                let centre = Vec2::new(cell[0] + cell[1], pair[0] + pair[1]) * 0.5;
                if holes.iter().any(|h| centre.cmpgt(h.low).all() && centre.cmplt(h.high).all()) {
                    continue;
                }
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| Vec2::new(cell[i], pair[j]));
                let quad = corners.map(|at| self.vertex(&mut shape, at));
                shape.quad_of(quad);
            }
        }
        shape.welded()
    }

    /// A wall of `size` with one arched opening.
    pub fn arched_wall(&self, size: Vec2, opening: &Opening) -> Shape {
        let (low, high) = (opening.low, opening.high);
        let mut shape = Shape::default();
        let mut cell = |corners: [Vec2; 4]| {
            let quad = corners.map(|at| self.vertex(&mut shape, at));
            shape.quad_of(quad);
        };
        for (left, right) in [(0.0, low.x), (high.x, size.x)] {
            for (bottom, top) in [(0.0, low.y), (low.y, high.y), (high.y, size.y)] {
                if right > left && top > bottom {
                    cell([(left, bottom), (right, bottom), (right, top), (left, top)].map(Vec2::from));
                }
            }
        }
        for pair in opening.arch().windows(2) {
            let [a, b] = [pair[0], pair[1]];
            cell([a, b, Vec2::new(b.x, size.y), Vec2::new(a.x, size.y)]);
            if low.y > 0.0 {
                cell([Vec2::new(a.x, 0.0), Vec2::new(b.x, 0.0), Vec2::new(b.x, low.y), Vec2::new(a.x, low.y)]);
            }
        }
        shape.welded()
    }

    /// The inside of an opening through a wall `depth` thick: sides, arch, and a sill when `sill`.
    pub fn reveal(&self, opening: &Opening, depth: f32, sill: bool) -> Shape {
        let back = self.normal() * -depth;
        let mut shape = Shape::default();
        let mut strip = |a: Vec2, b: Vec2, normal_a: Vec2, normal_b: Vec2| {
            let mut add = |at: Vec2, normal: Vec2, offset: Vec3, depth: f32| {
                let uv = Vec2::new(if normal.x.abs() > 0.5 { at.y } else { at.x }, depth);
                shape.vertex(self.point(at) + offset, self.u * normal.x + self.v * normal.y, uv)
            };
            let quad = [
                add(a, normal_a, Vec3::ZERO, 0.0),
                add(b, normal_b, Vec3::ZERO, 0.0),
                add(b, normal_b, back, depth),
                add(a, normal_a, back, depth),
            ];
            shape.quad_of(quad);
        };
        let (low, high) = (opening.low, opening.high);
        strip(Vec2::new(low.x, high.y), low, Vec2::X, Vec2::X);
        strip(Vec2::new(high.x, low.y), high, -Vec2::X, -Vec2::X);
        if sill {
            strip(low, Vec2::new(high.x, low.y), Vec2::Y, Vec2::Y);
        }
        let centre = Vec2::new((low.x + high.x) * 0.5, high.y);
        let inward = |at: Vec2| if opening.arch_segments > 0 { (centre - at).normalize_or(Vec2::Y) } else { -Vec2::Y };
        for pair in opening.arch().windows(2) {
            strip(pair[1], pair[0], inward(pair[1]), inward(pair[0]));
        }
        shape.welded()
    }

    /// The pane that fills an opening, in the plane of the frame and facing as it does.
    pub fn pane(&self, opening: &Opening) -> Shape {
        let mut shape = Shape::default();
        let mut quad = |corners: [Vec2; 4]| {
            let indices = corners.map(|at| self.vertex(&mut shape, at));
            shape.quad_of(indices);
        };
        let low = opening.low.y;
        for pair in opening.arch().windows(2) {
            let [a, b] = [pair[0], pair[1]];
            quad([Vec2::new(a.x, low), Vec2::new(b.x, low), b, a]);
        }
        shape.welded()
    }
}

impl Opening {
    pub fn rectangle(low: Vec2, high: Vec2) -> Self {
        Self { low, high, arch_segments: 0 }
    }

    pub fn arched(low: Vec2, high: Vec2, arch_segments: usize) -> Self {
        Self { low, high, arch_segments }
    }

    /// Points of the upper edge from left to right.
    fn arch(&self) -> Vec<Vec2> {
        let (left, right) = (Vec2::new(self.low.x, self.high.y), self.high);
        let n = self.arch_segments;
        if n == 0 {
            return vec![left, right];
        }
        let (centre, radius) = ((left + right) * 0.5, (right.x - left.x) * 0.5);
        let mut points: Vec<Vec2> =
            (0..=n).map(|i| centre + circle(0.5 - 0.5 * i as f32 / n as f32) * radius).collect();
        // The springing points are exact, so that the arch meets its sides without a crack.
        (points[0], points[n]) = (left, right);
        points
    }
}

impl Shape {
    /// One flat quad; corners counter-clockwise seen from the front. Texture coordinates in metres from the first.
    pub fn quad(corners: [Vec3; 4]) -> Self {
        let [a, b, c, d] = corners;
        let normal = (c - a).cross(d - b).normalize_or(Vec3::Y);
        let (u, v) = ((b - a).normalize_or(Vec3::X), (d - a).normalize_or(Vec3::Z));
        let mut shape = Self::default();
        let quad = corners.map(|p| shape.vertex(p, normal, Vec2::new((p - a).dot(u), -(p - a).dot(v))));
        shape.quad_of(quad);
        shape
    }

    /// A flat convex polygon; corners counter-clockwise seen from the front.
    pub fn polygon(corners: &[Vec3]) -> Self {
        let Some((&first, rest)) = corners.split_first() else { return Self::default() };
        let area_normal: Vec3 = rest.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first)).sum();
        let normal = area_normal.normalize_or(Vec3::Y);
        let mut shape = Self::default();
        let indices: Vec<u32> = corners.iter().map(|p| shape.vertex(*p, normal, Vec2::ZERO)).collect();
        for i in 1..indices.len().saturating_sub(1) {
            shape.triangle([indices[0], indices[i], indices[i + 1]]);
        }
        shape
    }

    /// A box seen from outside, hard edges.
    pub fn cuboid(low: Vec3, high: Vec3) -> Self {
        let corner = |k: usize| {
            Vec3::from_array(std::array::from_fn(|axis| if k >> axis & 1 == 1 { high[axis] } else { low[axis] }))
        };
        Self::union(CUBE_FACES.map(|face| Self::quad(face.map(corner))))
    }

    /// A box seen from inside: a closed room.
    pub fn room(low: Vec3, high: Vec3) -> Self {
        Self::cuboid(low, high).flipped()
    }

    /// A box whose edges are cut at `bevel` metres and shaded as if round: 24 vertices, 44 triangles.
    pub fn rounded_cuboid(low: Vec3, high: Vec3, bevel: f32) -> Self {
        let (centre, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let mut shape = Self::default();
        let corner_sign = |corner: usize| {
            Vec3::from_array(std::array::from_fn(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 }))
        };
        // Vertex 3 * corner + axis lies on the face across `axis`.
        for corner in 0..8 {
            let sign = corner_sign(corner);
            for axis in 0..3 {
                let mut inset = half - Vec3::splat(bevel);
                inset[axis] = half[axis];
                let mut normal = Vec3::ZERO;
                normal[axis] = sign[axis];
                let (s, t) = ((axis + 1) % 3, (axis + 2) % 3);
                let uv = Vec2::new(sign[s] * half[s], sign[t] * half[t]);
                shape.vertex(centre + sign * inset, normal, uv);
            }
        }
        let index = |corner: usize, axis: usize| (3 * corner + axis) as u32;
        let mut outward = |corners: &[u32]| {
            let at = |i: u32| shape.positions[i as usize];
            let middle = corners.iter().map(|&i| at(i)).sum::<Vec3>() / corners.len() as f32 - centre;
            let normal = (at(corners[1]) - at(corners[0])).cross(at(corners[2]) - at(corners[0]));
            let mut order = corners.to_vec();
            if normal.dot(middle) < 0.0 {
                order.reverse();
            }
            match *order {
                [a, b, c, d] => shape.quad_of([a, b, c, d]),
                [a, b, c] => shape.triangle([a, b, c]),
                _ => {}
            }
        };
        for axis in 0..3 {
            let (s, t) = (1usize << ((axis + 1) % 3), 1usize << ((axis + 2) % 3));
            for side in [0, 1usize << axis] {
                outward(&[side, side | s, side | s | t, side | t].map(|corner| index(corner, axis)));
            }
            // The edge along `axis` joins the faces across the two others.
            for edge in [0, s, t, s | t] {
                let (p, q) = (edge, edge | 1 << axis);
                let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
                outward(&[index(p, first), index(q, first), index(q, second), index(p, second)]);
            }
        }
        for corner in 0..8 {
            outward(&[index(corner, 0), index(corner, 1), index(corner, 2)]);
        }
        shape
    }
}

/// Corners of the six faces, counter-clockwise seen from outside: bit 0 is x, bit 1 is y, bit 2 is z.
const CUBE_FACES: [[usize; 4]; 6] =
    [[4, 5, 7, 6], [1, 0, 2, 3], [5, 1, 3, 7], [0, 4, 6, 2], [6, 7, 3, 2], [0, 1, 5, 4]];
