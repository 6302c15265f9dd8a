//! Twins of glsl/elements/ but for light sources, and of the rays of an element.

use glam::{Mat3, UVec2, Vec2, Vec3};
use linklight::gpu::shaders::types::{OpenPlace, Ray};
use linklight::scene::adjacency::Rows;
use linklight::stages::elements::BACK_SIDE;
use linklight::stages::open_places::AT_ITS_VERTEX;
use std::f32::consts::PI;

fn side_of(entry: u32) -> f32 {
    if entry & BACK_SIDE != 0 { -1.0 } else { 1.0 }
}

/// Positions, normals, ray origins.
pub fn place(
    element_vertices: &[u32],
    positions: &[Vec3],
    normals: &[Vec3],
    triangles: &[[u32; 3]],
    incident: &Rows,
    open_places: &[OpenPlace],
    ray_offset: f32,
) -> [Vec<Vec3>; 3] {
    let mut placed = [vec![], vec![], vec![]];
    for (&entry, open) in element_vertices.iter().zip(open_places) {
        let vertex = entry & !BACK_SIDE;
        let (position, normal) = (positions[vertex as usize], normals[vertex as usize] * side_of(entry));
        let mut inward = Vec3::ZERO;
        for &triangle in incident.row(vertex) {
            inward += triangles[triangle as usize].iter().map(|&v| positions[v as usize] - position).sum::<Vec3>();
        }
        let count = incident.row(vertex).len();
        if count > 0 {
            inward /= 3.0 * count as f32;
        }
        inward -= normal * normal.dot(inward);
        let mut origin = position + inward / 64.0;
        if *open != AT_ITS_VERTEX {
            let [a, b, c] = triangles[open.triangle as usize].map(|v| positions[v as usize]);
            origin = a + open.barycentrics.x * (b - a) + open.barycentrics.y * (c - a);
        }
        placed[0].push(if *open == AT_ITS_VERTEX { position } else { origin });
        placed[1].push(normal);
        placed[2].push(origin + ray_offset * normal);
    }
    placed
}

pub fn basis_of(n: Vec3) -> Mat3 {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    Mat3::from_cols(Vec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x), Vec3::new(b, s + n.y * n.y * a, -n.y), n)
}

pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let p = 2.0 * u - 1.0;
    if p == Vec2::ZERO {
        return Vec3::Z;
    }
    let (r, phi) =
        if p.x.abs() > p.y.abs() { (p.x, PI / 4.0 * (p.y / p.x)) } else { (p.y, PI / 2.0 - PI / 4.0 * (p.x / p.y)) };
    let d = r * Vec2::new(phi.cos(), phi.sin());
    d.extend((1.0 - d.dot(d)).max(0.0).sqrt())
}

pub fn element_shift(element: u32) -> Vec2 {
    let step = |v: u32| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let (mut x, mut y) = (step(element), step(element ^ 0x9e37_79b9));
    x = x.wrapping_add(y.wrapping_mul(1_664_525));
    y = y.wrapping_add(x.wrapping_mul(1_664_525));
    (x, y) = (x ^ (x >> 16), y ^ (y >> 16));
    x = x.wrapping_add(y.wrapping_mul(1_664_525));
    y = y.wrapping_add(x.wrapping_mul(1_664_525));
    (x, y) = (x ^ (x >> 16), y ^ (y >> 16));
    Vec2::new((x >> 8) as f32, (y >> 8) as f32) / 16_777_216.0
}

pub fn element_ray(ray: u32, side: u32, shift: Vec2) -> Vec3 {
    let (block, blocks) = (ray / 16, side / 4);
    let cell = [block % blocks * 4 + ray % 4, block / blocks * 4 + ray / 4 % 4];
    let at = Vec2::new(cell[0] as f32 + 0.5, cell[1] as f32 + 0.5) / side as f32 + shift;
    cosine_hemisphere(at.fract())
}

pub fn rays(origins: &[Vec3], normals: &[Vec3], first: u32, count: u32, side: u32, is_rotated: bool) -> Vec<Ray> {
    let mut rays = Vec::new();
    for element in first..first + count {
        let shift = if is_rotated { element_shift(element) } else { Vec2::ZERO };
        let basis = basis_of(normals[element as usize]);
        rays.extend((0..side * side).map(|ray| Ray {
            origin: origins[element as usize],
            t_min: 0.0,
            direction: basis * element_ray(ray, side, shift),
            t_max: 1e30,
        }));
    }
    rays
}

pub fn fill_unresolved(outcomes: &[u32], ring: &Rows, normals: &[Vec3], irradiance: &mut [Vec3], ray_count: u32) {
    let before = irradiance.to_vec();
    let is_unresolved = |element: u32| (outcomes[element as usize] & 0xffff) * 2 > ray_count;
    for element in 0..irradiance.len() as u32 {
        if !is_unresolved(element) {
            continue;
        }
        let cosine = |e: u32| normals[e as usize].dot(normals[element as usize]);
        let resolved = |range: std::ops::Range<f32>| {
            let chosen = ring.row(element).iter().filter(|&&e| !is_unresolved(e) && range.contains(&cosine(e)));
            chosen.map(|&e| before[e as usize]).collect::<Vec<Vec3>>()
        };
        let same_way = resolved(0.5f32.next_up()..2.0);
        let resolved = if same_way.is_empty() { resolved((-0.5f32).next_up()..2.0) } else { same_way };
        if !resolved.is_empty() {
            irradiance[element as usize] = resolved.iter().sum::<Vec3>() / resolved.len() as f32;
        }
    }
}

pub fn take_over(pairs: &[UVec2], values: &mut [Vec3]) {
    for pair in pairs {
        values[pair.x as usize] = values[pair.y as usize];
    }
}

pub fn smooth(ring: &Rows, normals: &[Vec3], irradiance: &[Vec3], cos_feature_angle: f32) -> Vec<Vec3> {
    let smoothed = |element: u32| {
        let (mut sum, mut count) = (irradiance[element as usize], 1.0);
        for &neighbour in ring.row(element) {
            if normals[element as usize].dot(normals[neighbour as usize]) > cos_feature_angle {
                sum += irradiance[neighbour as usize];
                count += 1.0;
            }
        }
        sum / count
    };
    (0..irradiance.len() as u32).map(smoothed).collect()
}
