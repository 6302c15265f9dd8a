//! An environment in two: what is bright in it as a few directions, and a rest that is even enough for pixels as coarse
//! as direction bins.
//!
//! Above a level of radiance all is bright. Its texels are cut into regions, the one that holds most light over the
//! widest angle first, and each region becomes one direction with all of its light [Debevec2005]. The level is the
//! lowest at which no direction has to stand for more light than a bin of the rest may hold: shadows are then as exact
//! for the one as for the other. It is the mean radiance at least, so that an even environment has no bright spots.
//!
//! Differs from [Debevec2005]: regions are cut where their mean lies, by angle as well as by light; the rest stays.
//!
//! [Debevec2005]: crate::methods::PAPERS

use super::sampling::luminance;
use super::{Environment, EnvironmentMap};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// Texels along the width of the map that is cut: finer maps are averaged, coarser ones interpolated.
const MOST_TEXELS: u32 = 2048;
const LEAST_TEXELS: u32 = 512;

/// All light of a part of the environment, from one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Unit, towards it.
    pub direction: Vec3,
    /// On a surface across it, W/m2.
    pub irradiance: Vec3,
}

/// A texel's light above the level.
#[derive(Clone, Copy)]
struct Bright {
    direction: Vec3,
    /// Radiance times solid angle, W/m2.
    light: Vec3,
}

impl Environment {
    /// At most `most` bright spots, and the rest, which is to be told apart by `solid_angle` (sr).
    pub fn split(&self, most: u32, solid_angle: f64) -> (Vec<Spot>, Self) {
        let Self::Map(map) = self else { return (Vec::new(), self.clone()) };
        let mut map = map.resampled();
        let Some(level) = map.level(most, solid_angle) else { return (Vec::new(), self.clone()) };
        let mut bright = Vec::new();
        for y in 0..map.height {
            let solid = map.solid_angle(y);
            for x in 0..map.width {
                let at = Vec2::new((x as f32 + 0.5) / map.width as f32, (y as f32 + 0.5) / map.height as f32);
                let direction = map.direction_of(at);
                let texel = &mut map.texels[(y * map.width + x) as usize];
                let whole = luminance(*texel);
                if whole > level {
                    let rest = *texel * (level / whole) as f32;
                    bright.push(Bright { direction, light: (*texel - rest) * solid as f32 });
                    *texel = rest;
                }
            }
        }
        (spots(&mut bright, most, level * solid_angle), Self::Map(map))
    }
}

impl EnvironmentMap {
    /// With [`LEAST_TEXELS`] to [`MOST_TEXELS`] along its width.
    fn resampled(&self) -> Self {
        let Environment::Map(coarse) = Environment::Map(self.clone()).averaged(MOST_TEXELS, MOST_TEXELS / 2) else {
            return self.clone();
        };
        let parts = [coarse.width, 2 * coarse.height].map(|texels| LEAST_TEXELS.div_ceil(texels));
        if parts == [1, 1] {
            return coarse;
        }
        let (width, height) = (coarse.width * parts[0], coarse.height * parts[1]);
        let radiance = |i: u32| {
            let at = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            coarse.radiance(coarse.direction_of(at / Vec2::new(width as f32, height as f32)))
        };
        let texels = (0..width * height).map(radiance).collect();
        Self { width, height, texels, rotation: coarse.rotation }
    }

    /// Of a texel of a row, sr.
    fn solid_angle(&self, y: u32) -> f64 {
        let edge = |y: u32| (PI * f64::from(y) / f64::from(self.height)).cos();
        2.0 * PI / f64::from(self.width) * (edge(y) - edge(y + 1))
    }

    /// The luminance from which on `most` spots can stand for what is above; `None` where that is next to nothing.
    fn level(&self, most: u32, solid_angle: f64) -> Option<f64> {
        let rows = || (0..self.height).map(|y| (self.solid_angle(y), y as usize * self.width as usize));
        let texels = |first: usize| self.texels[first..first + self.width as usize].iter().map(|&t| luminance(t));
        let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
            rows().map(|(solid, first)| texels(first).map(|l| of(l, solid)).sum::<f64>()).sum()
        };
        let mean = sum(&|luminance, solid| luminance * solid) / (4.0 * PI);
        let highest = self.texels.iter().map(|&texel| luminance(texel)).fold(0.0, f64::max);
        // In units of what a bin of the rest may hold; a texel is a spot at most.
        let needed = |level: f64| sum(&|l, solid| ((l - level).max(0.0) * solid / (level * solid_angle)).min(1.0));
        if most == 0 || mean <= 0.0 || sum(&|l, solid| (l - mean).max(0.0) * solid) < mean * solid_angle {
            return None;
        }
        let (mut low, mut high) = (mean, highest);
        if needed(low) <= f64::from(most) {
            return Some(low);
        }
        for _ in 0..16 {
            let middle = (low * high).sqrt();
            if needed(middle) <= f64::from(most) { high = middle } else { low = middle }
        }
        Some(high)
    }
}

/// A run of bright texels.
struct Region {
    first: usize,
    count: usize,
    light: DVec3,
    /// Where its light comes from in the mean, not of unit length.
    middle: DVec3,
    /// Between its outermost directions along an axis, and that axis.
    extent: f32,
    axis: usize,
}

impl Region {
    fn new(bright: &[Bright], first: usize, count: usize) -> Self {
        let own = &bright[first..first + count];
        let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = own.iter().fold(start, |(low, high), b| (low.min(b.direction), high.max(b.direction)));
        let size = if count > 0 { high - low } else { Vec3::ZERO };
        let axis = if size.x >= size.max_element() { 0 } else { 1 + usize::from(size.y < size.z) };
        let light = own.iter().map(|b| b.light.as_dvec3()).sum();
        let middle = own.iter().map(|b| b.direction.as_dvec3() * luminance(b.light)).sum();
        Self { first, count, light, middle, extent: size[axis], axis }
    }

    fn power(&self) -> f64 {
        luminance(self.light.as_vec3())
    }
}

/// At most `most` regions of all bright texels, none of which has to be cut that holds no more than `enough` W/m2.
fn spots(bright: &mut [Bright], most: u32, enough: f64) -> Vec<Spot> {
    let mut regions = vec![Region::new(bright, 0, bright.len())];
    while regions.len() < most as usize {
        let wanted = |region: &Region| {
            let can_be_cut = region.count > 1 && region.extent > 0.0 && region.power() > enough;
            if can_be_cut { region.power() * f64::from(region.extent) } else { 0.0 }
        };
        let widest = (0..regions.len()).max_by(|&a, &b| wanted(&regions[a]).total_cmp(&wanted(&regions[b])));
        let Some(widest) = widest.filter(|&region| wanted(&regions[region]) > 0.0) else { break };
        let region = regions.swap_remove(widest);
        let (first, axis) = (region.first, region.axis);
        let at = (region.middle[axis] / region.power()) as f32;
        let own = &mut bright[first..first + region.count];
        own.sort_unstable_by_key(|b| b.direction[axis] > at);
        // Rounding may put all on one side of their mean.
        let below = own.partition_point(|b| b.direction[axis] <= at).clamp(1, region.count - 1);
        regions.push(Region::new(bright, first, below));
        regions.push(Region::new(bright, first + below, region.count - below));
    }
    let spot = |region: Region| {
        let direction = region.middle.as_vec3().try_normalize()?;
        Some(Spot { direction, irradiance: region.light.as_vec3() })
    };
    regions.into_iter().filter_map(spot).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An even sky with a sun of one texel and a wide glow.
    fn sky(width: u32, sun: f32) -> EnvironmentMap {
        let height = width / 2;
        let blank = EnvironmentMap { width, height, texels: Vec::new(), rotation: 0.3 };
        let towards = Vec3::new(0.6, 0.7, 0.2).normalize();
        let at = |i: u32| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let texel = |i: u32| {
            let direction = blank.direction_of(at(i) / Vec2::new(width as f32, height as f32));
            Vec3::new(0.2, 0.3, 0.5) + 2.0 * direction.dot(towards).max(0.0).powi(20)
        };
        let mut texels: Vec<Vec3> = (0..width * height).map(texel).collect();
        texels[(height / 4 * width + width / 3) as usize] += sun;
        EnvironmentMap { texels, ..blank }
    }

    fn power(environment: &Environment) -> DVec3 {
        let Environment::Map(map) = environment else { panic!("a map") };
        let texel = |(i, t): (usize, &Vec3)| t.as_dvec3() * map.solid_angle(i as u32 / map.width);
        map.texels.iter().enumerate().map(texel).sum()
    }

    #[test]
    fn spots_and_rest_are_all_light_there_is() {
        for (width, sun, most) in [(64, 1000.0, 64), (512, 5e4, 16), (512, 0.0, 64), (4096, 1e6, 7)] {
            let whole = Environment::Map(sky(width, sun));
            let (spots, rest) = whole.split(most, 4.0 * PI / 384.0);
            assert!(!spots.is_empty() && spots.len() <= most as usize);
            let lit: DVec3 = spots.iter().map(|spot| spot.irradiance.as_dvec3()).sum();
            let error = ((lit + power(&rest)) / power(&whole) - 1.0).abs().max_element();
            // A coarse map is interpolated, which moves a little light over its rows.
            assert!(error < if width < LEAST_TEXELS { 2e-2 } else { 1e-4 }, "{width}: {error}");
            assert!(spots.iter().all(|spot| spot.direction.is_normalized() && spot.irradiance.min_element() >= 0.0));
        }
    }

    #[test]
    fn a_sun_is_one_spot_and_the_rest_below_its_level() {
        let map = sky(512, 5e4);
        let sun = map.direction_of(Vec2::new((512 / 3) as f32 + 0.5, 64.5) / Vec2::new(512.0, 256.0));
        let (spots, rest) = Environment::Map(map).split(64, 4.0 * PI / 384.0);
        let brightest = spots.iter().max_by(|a, b| a.irradiance.y.total_cmp(&b.irradiance.y)).unwrap();
        assert!(brightest.direction.dot(sun) > 1.0 - 1e-6, "{brightest:?} for {sun}");
        let Environment::Map(rest) = rest else { panic!("a map") };
        let highest = rest.texels.iter().map(|&t| luminance(t)).fold(0.0, f64::max);
        let next = spots.iter().map(|s| luminance(s.irradiance)).filter(|&l| l < luminance(brightest.irradiance));
        let next = next.fold(0.0, f64::max);
        assert!(next < 4.0 * highest * 4.0 * PI / 384.0, "{next} beside bins of {}", highest * 4.0 * PI / 384.0);
    }

    #[test]
    fn an_even_environment_has_no_spots() {
        let even =
            EnvironmentMap { width: 64, height: 32, texels: vec![Vec3::new(1.0, 2.0, 3.0); 2048], rotation: 0.0 };
        for environment in [Environment::Constant(Vec3::ONE), Environment::Map(even), Environment::default()] {
            let (spots, rest) = environment.split(64, 4.0 * PI / 384.0);
            assert_eq!((spots.len(), rest), (0, environment));
        }
        let (spots, rest) = Environment::Map(sky(512, 5e4)).split(0, 0.03);
        assert_eq!((spots.len(), rest), (0, Environment::Map(sky(512, 5e4))));
    }
}
