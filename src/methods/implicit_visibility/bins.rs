//! Direction bins: exact solid angles and directions, and the environment seen through each.
//!
//! The layout is that of `lib/bins.glsl`: six faces of `n` x `n` texels of a cube map.

use crate::scene::environment::Environment;
use glam::{DVec3, Vec2, Vec3};

/// Texels of the environment are cut until they are at most this share of a bin's side.
const FINENESS: u32 = 4;

/// Towards (u, v) in -1..1 of a face, its component along the face's axis +-1.
pub fn face_direction(face: u32, u: f64, v: f64) -> DVec3 {
    let side = if face & 1 == 0 { 1.0 } else { -1.0 };
    match face >> 1 {
        0 => DVec3::new(side, u, v),
        1 => DVec3::new(v, side, u),
        _ => DVec3::new(u, v, side),
    }
}

/// The bin a direction falls into.
pub fn bin_of(direction: Vec3, n: u32) -> u32 {
    let a = direction.abs();
    let axis = if a.x >= a.y && a.x >= a.z { 0 } else { 1 + u32::from(a.y < a.z) };
    let along = direction[axis as usize];
    let face = 2 * axis + u32::from(along < 0.0);
    let at = Vec2::new(direction[(axis as usize + 1) % 3], direction[(axis as usize + 2) % 3]) / along.abs();
    let cell = (0.5 * at + 0.5).clamp(Vec2::ZERO, Vec2::ONE) * n as f32;
    let cell = cell.as_uvec2().min(glam::UVec2::splat(n - 1));
    (face * n + cell.y) * n + cell.x
}

/// The four corners of each bin, counter-clockwise or clockwise, in order of bins.
fn corners(n: u32) -> impl Iterator<Item = [DVec3; 4]> {
    let edge = move |cell: u32| 2.0 * f64::from(cell) / f64::from(n) - 1.0;
    (0..6 * n * n).map(move |bin| {
        let (face, y, x) = (bin / (n * n), bin / n % n, bin % n);
        let at = |dx: u32, dy: u32| face_direction(face, edge(x + dx), edge(y + dy)).normalize();
        [at(0, 0), at(1, 0), at(1, 1), at(0, 1)]
    })
}

/// Solid angle of each bin of a face, sr; the same for all six.
pub fn solid_angles(n: u32) -> Vec<f32> {
    // Area below a corner of a texel seen from the cube's centre: atan2(x y, sqrt(x^2 + y^2 + 1)).
    let below = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    let edge = |cell: u32| 2.0 * f64::from(cell) / f64::from(n) - 1.0;
    let of_cell = |cell: u32| {
        let (x0, x1) = (edge(cell % n), edge(cell % n + 1));
        let (y0, y1) = (edge(cell / n), edge(cell / n + 1));
        (below(x1, y1) - below(x0, y1) - below(x1, y0) + below(x0, y0)) as f32
    };
    (0..n * n).map(of_cell).collect()
}

/// The integral of the unit direction over each bin, sr: its product with a normal is the integral of the cosine, by
/// Lambert's formula for the bin's spherical quadrangle.
pub fn vectors(n: u32) -> Vec<Vec3> {
    let of_bin = |corners: [DVec3; 4]| {
        let mut sum = DVec3::ZERO;
        for edge in 0..4 {
            let (a, b) = (corners[edge], corners[(edge + 1) % 4]);
            let across = a.cross(b);
            sum += 0.5 * across.length().atan2(a.dot(b)) * across.normalize();
        }
        // Whichever way the corners run, the integral points along the bin.
        (sum * sum.dot(corners[0] + corners[2]).signum()).as_vec3()
    };
    corners(n).map(of_bin).collect()
}

/// Mean radiance of the environment over each bin, W m^-2 sr^-1.                                    [Dong2007 4.4]
pub fn radiance(environment: &Environment, n: u32) -> Vec<Vec3> {
    let count = (6 * n * n) as usize;
    let map = match environment {
        Environment::Constant(radiance) => return vec![*radiance; count],
        Environment::Map(map) => map,
    };
    // Small texels count whole where their centre falls; large ones are cut into parts first.
    let parts_x = (4 * n * FINENESS).div_ceil(map.width);
    let parts_y = (2 * n * FINENESS).div_ceil(map.height);
    let mut sums = vec![(DVec3::ZERO, 0.0); count];
    for y in 0..map.height * parts_y {
        let edge = |y: u32| (std::f64::consts::PI * f64::from(y) / f64::from(map.height * parts_y)).cos();
        let weight = edge(y) - edge(y + 1);
        for x in 0..map.width * parts_x {
            let at = Vec2::new(
                (x as f32 + 0.5) / (map.width * parts_x) as f32,
                (y as f32 + 0.5) / (map.height * parts_y) as f32,
            );
            let direction = map.direction_of(at);
            let radiance =
                if parts_x * parts_y == 1 { map.texels[(y * map.width + x) as usize] } else { map.radiance(direction) };
            let sum = &mut sums[bin_of(direction, n) as usize];
            sum.0 += weight * radiance.as_dvec3();
            sum.1 += weight;
        }
    }
    sums.iter().map(|&(sum, weight)| (sum / weight.max(f64::MIN_POSITIVE)).as_vec3()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::environment::EnvironmentMap;
    use std::f64::consts::PI;

    #[test]
    fn bins_fill_the_sphere_exactly() {
        for n in [1, 2, 3, 8, 12, 16] {
            let solid: f64 = solid_angles(n).iter().map(|&s| f64::from(s)).sum();
            assert!((6.0 * solid - 4.0 * PI).abs() < 1e-5, "n = {n}: {solid}");
            let all: DVec3 = vectors(n).iter().map(|v| v.as_dvec3()).sum();
            assert!(all.length() < 1e-4, "opposite bins cancel");
            let above: f32 = vectors(n).iter().map(|v| v.z.max(0.0)).sum();
            if n % 2 == 0 {
                // The horizon of an axis runs between bins: the integral of the cosine is exact.
                assert!((f64::from(above) - PI).abs() < 1e-4, "n = {n}: {above}");
            }
        }
    }

    #[test]
    fn each_bin_holds_its_own_centre() {
        let n = 5;
        for bin in 0..6 * n * n {
            let (face, y, x) = (bin / (n * n), bin / n % n, bin % n);
            let at = |cell: u32| (2.0 * f64::from(cell) + 1.0) / f64::from(n) - 1.0;
            assert_eq!(bin_of(face_direction(face, at(x), at(y)).as_vec3(), n), bin);
        }
    }

    #[test]
    fn the_environment_keeps_its_power() {
        for (width, height) in [(64, 32), (5, 3)] {
            let mut map =
                EnvironmentMap { width, height, texels: vec![Vec3::ZERO; (width * height) as usize], rotation: 0.4 };
            map.texels[(width * (height / 2) + 2) as usize] = Vec3::splat(100.0);
            let n = 8;
            let seen = radiance(&Environment::Map(map.clone()), n);
            let solid = solid_angles(n);
            let power: f64 = seen.iter().enumerate().map(|(b, r)| f64::from(r.x * solid[b % solid.len()])).sum();
            let edge = |y: u32| (PI * f64::from(y) / f64::from(height)).cos();
            let expected = 100.0 * 2.0 * PI / f64::from(width) * (edge(height / 2) - edge(height / 2 + 1));
            // Bins are averaged by the texels that fall into them, whose share differs a little from the bin's own.
            assert!((power / expected - 1.0).abs() < 0.1, "{power} instead of {expected}");
        }
    }
}
