//! Small meshes and rays for the tests of this folder.

use crate::common::Random;
use glam::Vec3;
use linklight::gpu::shaders::types::Ray;

pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

pub fn point(random: &mut Random) -> Vec3 {
    Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0
}

/// Uniform on the unit sphere.
pub fn direction(random: &mut Random) -> Vec3 {
    loop {
        let p = point(random);
        if p.length() <= 1.0 && p.length() > 0.1 {
            return p.normalize();
        }
    }
}

pub fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, t_min: 0.0, direction, t_max: f32::INFINITY }
}

/// `count` triangles of edge about `size` strewn over -1..1.
pub fn soup(count: usize, size: f32, random: &mut Random) -> Mesh {
    let mut mesh = Mesh { positions: Vec::new(), triangles: Vec::new() };
    for triangle in 0..count as u32 {
        let center = point(random);
        mesh.positions.extend((0..3).map(|_| center + size * point(random)));
        mesh.triangles.push([0, 1, 2].map(|k| 3 * triangle + k));
    }
    mesh
}

/// A closed unit sphere of `2 * around * rings` triangles at most, fronts outwards.
pub fn sphere(rings: u32, around: u32) -> Mesh {
    let mut positions = vec![Vec3::Y];
    for ring in 1..rings {
        let (sin, cos) = (std::f32::consts::PI * ring as f32 / rings as f32).sin_cos();
        for k in 0..around {
            let (s, c) = (std::f32::consts::TAU * k as f32 / around as f32).sin_cos();
            positions.push(Vec3::new(sin * s, cos, sin * c));
        }
    }
    positions.push(Vec3::NEG_Y);
    let bottom = positions.len() as u32 - 1;
    let at = |ring: u32, k: u32| 1 + (ring - 1) * around + k % around;
    let mut triangles = Vec::new();
    for k in 0..around {
        triangles.push([0, at(1, k), at(1, k + 1)]);
        for ring in 1..rings - 1 {
            triangles.push([at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)]);
            triangles.push([at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)]);
        }
        triangles.push([at(rings - 1, k), bottom, at(rings - 1, k + 1)]);
    }
    Mesh { positions, triangles }
}

/// The closed cube -1..1, `n` squares along each edge, fronts outwards.
pub fn cube(n: u32) -> Mesh {
    let mut mesh = Mesh { positions: Vec::new(), triangles: Vec::new() };
    for axis in 0..3 {
        for side in [-1.0f32, 1.0] {
            let first = mesh.positions.len() as u32;
            for i in 0..=n {
                for j in 0..=n {
                    let mut p = [0.0; 3];
                    p[axis] = side;
                    p[(axis + 1) % 3] = 2.0 * i as f32 / n as f32 - 1.0;
                    p[(axis + 2) % 3] = 2.0 * j as f32 / n as f32 - 1.0;
                    mesh.positions.push(Vec3::from(p));
                }
            }
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let a = first + i * (n + 1) + j;
                let (b, c, d) = (a + n + 1, a + n + 2, a + 1);
                for t in [[a, b, c], [a, c, d]] {
                    mesh.triangles.push(if side > 0.0 { t } else { [t[0], t[2], t[1]] });
                }
            }
        }
    }
    mesh
}
