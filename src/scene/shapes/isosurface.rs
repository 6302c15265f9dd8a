//! Surface nets: the zero set of a distance field as a smooth, closed triangle mesh.
//!
//! Dual method after Gibson, "Constrained Elastic Surface Nets" (1998): one vertex per cell that the surface crosses,
//! one quad per crossed grid edge; vertices are then drawn onto the surface by Newton steps along the field's gradient.

use super::Shape;
use glam::{UVec3, Vec2, Vec3};
use rayon::prelude::*;

const NO_VERTEX: u32 = u32::MAX;

/// Edge of the blocks that are looked at as a whole, in cells.
const BLOCK: u32 = 8;
/// By how many metres a field may change within a metre.
const STEEPEST: f32 = 2.5;

/// Meshes `field = 0` (negative inside) within the box `low..high` on cubes of edge `cell` metres. The surface must not
/// touch the box, and the field must not be much steeper than a distance is (at most 2.5 m per metre). Normals follow the field's gradient. Memory: 8 bytes per grid point.
pub fn isosurface(low: Vec3, high: Vec3, cell: f32, field: impl Fn(Vec3) -> f32 + Sync) -> Shape {
    let n = ((high - low) / cell).ceil().max(Vec3::ONE).as_uvec3() + UVec3::ONE;
    let position = |i: UVec3| low + i.as_vec3() * cell;
    let slice = (n.x * n.y) as usize;
    let coordinates = |i: usize| UVec3::new(i as u32 % n.x, i as u32 / n.x % n.y, (i / slice) as u32);
    // Where the field at the middle of a block is larger than it can fall within the block, the block has no surface.
    let blocks = n.map(|count| count.div_ceil(BLOCK));
    let block_slice = (blocks.x * blocks.y) as usize;
    let reach = STEEPEST * cell * BLOCK as f32 * 3f32.sqrt() * 0.5;
    let empty: Vec<Option<f32>> = (0..block_slice * blocks.z as usize)
        .into_par_iter()
        .map(|i| {
            let block = UVec3::new(i as u32 % blocks.x, i as u32 / blocks.x % blocks.y, (i / block_slice) as u32);
            let middle = low + (block.as_vec3() + 0.5) * (BLOCK as f32 * cell);
            Some(field(middle)).filter(|value| value.abs() > reach)
        })
        .collect();
    let values: Vec<f32> = (0..slice * n.z as usize)
        .into_par_iter()
        .map(|i| {
            let at = coordinates(i);
            let block = at / BLOCK;
            let known = empty[(block.x + blocks.x * block.y) as usize + block_slice * block.z as usize];
            known.unwrap_or_else(|| field(position(at)))
        })
        .collect();
    let index = |i: UVec3| (i.x + n.x * i.y) as usize + slice * i.z as usize;

    let gradient = |p: Vec3| {
        let h = cell * 0.25;
        Vec3::from_array([Vec3::X, Vec3::Y, Vec3::Z].map(|axis| field(p + axis * h) - field(p - axis * h))) / (2.0 * h)
    };
    let crossing = |cell_low: UVec3| -> Option<(Vec3, Vec3)> {
        let corner = |k: usize| values[index(cell_low + CORNERS[k])];
        let mut sum = Vec3::ZERO;
        let mut count = 0;
        for (a, b) in EDGES {
            let (fa, fb) = (corner(a), corner(b));
            if (fa < 0.0) != (fb < 0.0) {
                sum += CORNERS[a].as_vec3().lerp(CORNERS[b].as_vec3(), fa / (fa - fb));
                count += 1;
            }
        }
        if count == 0 {
            return None;
        }
        let start = low + (cell_low.as_vec3() + sum / count as f32) * cell;
        let mut p = start;
        for _ in 0..2 {
            let g = gradient(p);
            p -= g * (field(p) / g.length_squared().max(0.05));
        }
        // Vertices stay within their cells: the mesh cannot fold, nor two of them meet.
        let corner = low + cell_low.as_vec3() * cell;
        let p = p.clamp(corner + 0.2 * cell, corner + 0.8 * cell);
        Some((p, gradient(p).normalize_or(Vec3::Y)))
    };

    let found: Vec<(usize, Vec3, Vec3)> = (0..values.len())
        .into_par_iter()
        .filter_map(|i| {
            let at = coordinates(i);
            (at + UVec3::ONE).cmplt(n).all().then(|| crossing(at)).flatten().map(|(p, normal)| (i, p, normal))
        })
        .collect();
    let mut shape = Shape::default();
    let mut vertex_of = vec![NO_VERTEX; values.len()];
    for &(i, p, normal) in &found {
        vertex_of[i] = shape.vertex(p, normal, Vec2::ZERO);
    }

    // Each crossed grid edge is surrounded by four cells, whose vertices make a quad.
    for &(i, ..) in &found {
        let at = coordinates(i);
        for axis in 0..3 {
            let (s, t) = (UNIT[(axis + 1) % 3], UNIT[(axis + 2) % 3]);
            if (at * (s + t)).cmplt(s + t).any() {
                continue;
            }
            let (here, next) = (values[index(at)], values[index(at + UNIT[axis])]);
            if (here < 0.0) == (next < 0.0) {
                continue;
            }
            let mut quad = [at - s - t, at - t, at, at - s].map(|cell| vertex_of[index(cell)]);
            if quad.contains(&NO_VERTEX) {
                continue;
            }
            if here >= 0.0 {
                quad.reverse();
            }
            let [a, b, c, d] = quad;
            let (one, other) = ([[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]);
            let [one_worst, other_worst] =
                [one, other].map(|pair| shape.agreement(pair[0]).min(shape.agreement(pair[1])));
            let best = if other_worst > one_worst { other } else { one };
            best.into_iter().for_each(|triangle| shape.triangle(triangle));
        }
    }
    shape
}

impl Shape {
    /// How well a triangle faces the way its vertex normals say: three times the mean cosine, negative when turned over.
    fn agreement(&self, triangle: [u32; 3]) -> f32 {
        let [p, q, r] = triangle.map(|i| self.positions[i as usize]);
        let normals: Vec3 = triangle.iter().map(|&i| self.normals[i as usize]).sum();
        (q - p).cross(r - p).normalize_or_zero().dot(normals)
    }
}

const UNIT: [UVec3; 3] = [UVec3::X, UVec3::Y, UVec3::Z];

/// Corner k of a cell: bit 0 is x, bit 1 is y, bit 2 is z.
const CORNERS: [UVec3; 8] = [
    UVec3::new(0, 0, 0),
    UVec3::new(1, 0, 0),
    UVec3::new(0, 1, 0),
    UVec3::new(1, 1, 0),
    UVec3::new(0, 0, 1),
    UVec3::new(1, 0, 1),
    UVec3::new(0, 1, 1),
    UVec3::new(1, 1, 1),
];

const EDGES: [(usize, usize); 12] =
    [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)];
