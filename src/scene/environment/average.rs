//! A coarse copy of an environment for those who look into few directions: each texel is the mean over its solid angle,
//! so that even the smallest sun keeps its power.

use super::{Environment, EnvironmentMap};
use glam::Vec3;
use std::f64::consts::PI;

impl Environment {
    /// At most `width` x `height` texels (both at least 1); a smaller map or a constant stays as it is.
    pub fn averaged(&self, width: u32, height: u32) -> Self {
        match self {
            Self::Map(map) if map.width > width || map.height > height => {
                Self::Map(map.averaged(width.clamp(1, map.width), height.clamp(1, map.height)))
            }
            other => other.clone(),
        }
    }
}

impl EnvironmentMap {
    fn averaged(&self, width: u32, height: u32) -> Self {
        // Rows count by their solid angle: z from cos of the upper to cos of the lower edge.
        let rows = shares(self.height, height, |edge| -(PI * edge).cos());
        let columns = shares(self.width, width, |edge| edge);
        let mut texels = Vec::with_capacity((width * height) as usize);
        for row in &rows {
            for column in &columns {
                let (mut sum, mut weight) = (glam::DVec3::ZERO, 0.0);
                for &(y, share_y) in row {
                    for &(x, share_x) in column {
                        let texel = self.texels[y as usize * self.width as usize + x as usize];
                        sum += texel.as_dvec3() * (share_x * share_y);
                        weight += share_x * share_y;
                    }
                }
                texels.push(if weight > 0.0 { (sum / weight).as_vec3() } else { Vec3::ZERO });
            }
        }
        Self { width, height, texels, rotation: self.rotation }
    }
}

/// For each coarse cell, the fine cells it covers and how much of `measure` they share with it. `measure` rises over
/// 0..=1.
fn shares(fine: u32, coarse: u32, measure: impl Fn(f64) -> f64) -> Vec<Vec<(u32, f64)>> {
    let edge = |cell: u32, count: u32| f64::from(cell) / f64::from(count);
    let of_cell = |cell: u32| {
        let (low, high) = (edge(cell, coarse), edge(cell + 1, coarse));
        let first = (low * f64::from(fine)).floor() as u32;
        let last = ((high * f64::from(fine)).ceil() as u32).min(fine);
        let covered = (first..last).map(|at| {
            let (from, to) = (edge(at, fine).max(low), edge(at + 1, fine).min(high));
            (at, (measure(to) - measure(from)).max(0.0))
        });
        covered.collect()
    };
    (0..coarse).map(of_cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Power over the whole sphere, by texel solid angles.
    fn power(map: &EnvironmentMap) -> f64 {
        let solid_angle = |y: u32| {
            let edge = |y: u32| (PI * f64::from(y) / f64::from(map.height)).cos();
            2.0 * PI / f64::from(map.width) * (edge(y) - edge(y + 1))
        };
        let texels = map.texels.iter().enumerate();
        texels.map(|(i, t)| solid_angle(i as u32 / map.width) * f64::from(t.element_sum())).sum()
    }

    #[test]
    fn averaging_keeps_all_power_even_of_one_texel() {
        for (width, height, coarse) in [(64, 32, (32, 16)), (100, 37, (32, 16)), (33, 16, (32, 16)), (7, 5, (3, 2))] {
            for lit in [0, (width * height / 2) as usize, (width * height - 1) as usize] {
                let mut map = EnvironmentMap {
                    width,
                    height,
                    texels: vec![Vec3::ZERO; (width * height) as usize],
                    rotation: 0.3,
                };
                map.texels[lit] = Vec3::new(1000.0, 500.0, 1.0);
                let Environment::Map(averaged) = Environment::Map(map.clone()).averaged(coarse.0, coarse.1) else {
                    panic!("a map stays a map")
                };
                assert_eq!((averaged.width, averaged.height, averaged.rotation), (coarse.0, coarse.1, 0.3));
                let (before, after) = (power(&map), power(&averaged));
                assert!((before - after).abs() < 1e-5 * before, "{width} x {height}: {before} became {after}");
            }
        }
    }

    #[test]
    fn what_is_coarse_already_stays() {
        let map = EnvironmentMap { width: 4, height: 2, texels: vec![Vec3::ONE; 8], rotation: 0.0 };
        assert_eq!(Environment::Map(map.clone()).averaged(32, 16), Environment::Map(map));
        assert_eq!(Environment::Constant(Vec3::ONE).averaged(1, 1), Environment::Constant(Vec3::ONE));
    }
}
