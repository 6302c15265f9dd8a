//! Bins of equal solid angle over the sphere of directions, and which bins a sender of some size spreads over.
//!
//! `m = 8 k^2` bins: each octant of the sphere is a square of k x k cells, by the equal-area map of [Shirley1997] over
//! each half of the sphere. The set is closed under reversal. A class of senders is a list for each bin: the bins
//! around it, nearest first, with weights. Class 0 has the nearest bins, for a sender within one bin; class c >= 1 is
//! for senders of up to `2^(c/2)` bins.
//!
//! [Shirley1997]: crate::methods::PAPERS

use crate::gpu::shaders::types::SpreadEntry;
use crate::gpu::{Buffer, Context, GpuError};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Bins listed in class 0.
pub const NEAREST: usize = 16;
/// Samples a side of a bin, for its mean direction.
const SUBCELLS: u32 = 4;

crate::choice! {
    /// How a sender larger than a bin spreads over the receiver's bins.
    pub enum Spread {
        /// All in the bin of the direction between the centres
        None = "none",
        /// Over the bins within the sender's solid angle, by a Gaussian of a bin's width
        Gaussian = "gaussian",
        /// Over the bins that the sender covers: a flat one by samples of its rectangle, from close by as its sides cut them, others evenly within a cone
        Cone = "cone",
    }
}

/// The bins: plain data.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionBins {
    /// Cells a side of half the sphere, 2k.
    pub side: u32,
    /// Unit; the mean over each bin. Bins 2p and 2p + 1 are opposite, the first looks up (+z).
    pub directions: Vec<Vec3>,
}

impl DirectionBins {
    /// `octant_side` is k.
    pub fn new(octant_side: u32) -> Self {
        let side = 2 * octant_side;
        let upper = (0..side * side).map(|cell| {
            let samples = (0..SUBCELLS * SUBCELLS).map(|s| Vec2::new((s % SUBCELLS) as f32, (s / SUBCELLS) as f32));
            let sum: Vec3 = samples.map(|s| direction_in(cell, side, (s + 0.5) / SUBCELLS as f32)).sum();
            let p = sum.normalize().truncate();
            // As the device makes it from x and y.
            p.extend((1.0 - p.dot(p)).max(0.0).sqrt())
        });
        Self { side, directions: upper.flat_map(|w| [w, -w]).collect() }
    }

    pub fn count(&self) -> u32 {
        2 * self.side * self.side
    }

    /// Solid angle of a bin, sr.
    pub fn solid_angle(&self) -> f32 {
        4.0 * PI / self.count() as f32
    }

    /// The bin of the reversed directions.
    pub fn opposite(&self, bin: u32) -> u32 {
        bin ^ 1
    }

    /// Bin of a unit direction, as `bin_of` of `lib/direction_bins.glsl`.
    pub fn bin_of(&self, w: Vec3) -> u32 {
        let r = (1.0 - w.z.abs()).max(0.0).sqrt();
        let mut p = Vec2::ZERO;
        if w.x != 0.0 || w.y != 0.0 {
            if w.x.abs() > w.y.abs() {
                p.x = if w.x > 0.0 { r } else { -r };
                p.y = p.x * (w.y / w.x).atan() * (4.0 / PI);
            } else {
                p.y = if w.y > 0.0 { r } else { -r };
                p.x = p.y * (w.x / w.y).atan() * (4.0 / PI);
            }
        }
        let cell =
            ((p * 0.5 + 0.5) * self.side as f32).max(Vec2::ZERO).as_uvec2().min(glam::UVec2::splat(self.side - 1));
        let index = cell.y * self.side + cell.x;
        // Below, cells are counted from the end: there lies the one opposite to a cell above.
        if w.z < 0.0 { 2 * (self.side * self.side - 1 - index) + 1 } else { 2 * index }
    }

    /// Classes beside class 0: the last is for senders of half the sphere.
    pub fn class_count(&self) -> u32 {
        (2.0 * (0.5 * self.count() as f32).log2()).ceil() as u32
    }

    /// The lists of class `0..=class_count()`, each bin's in turn, and where each starts.
    pub fn spread_lists(&self, spread: Spread) -> (Vec<u32>, Vec<SpreadEntry>) {
        let count = self.count() as usize;
        let sorted: Vec<Vec<(f32, u32)>> = self.directions.iter().map(|&w| self.by_angle(w)).collect();
        let (mut offsets, mut entries) = (Vec::with_capacity(count + 1), Vec::new());
        for class in 0..=self.class_count() {
            for near in &sorted {
                offsets.push(entries.len() as u32);
                let weights =
                    near.iter().map(|&(angle, bin)| SpreadEntry { bin, weight: self.weight(spread, class, angle) });
                let kept = weights.enumerate().take_while(|(k, entry)| match class {
                    0 => *k < NEAREST,
                    _ => entry.weight > 0.0 || *k == 0,
                });
                entries.extend(
                    kept.map(|(k, e)| SpreadEntry { weight: if k == 0 { e.weight.max(1e-3) } else { e.weight }, ..e }),
                );
            }
        }
        offsets.push(entries.len() as u32);
        (offsets, entries)
    }

    /// All bins, nearest to `w` first.
    fn by_angle(&self, w: Vec3) -> Vec<(f32, u32)> {
        let angle = |v: Vec3| 2.0 * (0.5 * (v - w).length()).min(1.0).asin();
        let mut near: Vec<(f32, u32)> = self.directions.iter().zip(0..).map(|(&v, bin)| (angle(v), bin)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near
    }

    /// Weight of a bin at `angle` from the middle of a sender of class `class`; falls with the angle.
    fn weight(&self, spread: Spread, class: u32, angle: f32) -> f32 {
        let cone = |solid_angle: f32| (1.0 - solid_angle / (2.0 * PI)).max(-1.0).acos();
        let bin_radius = cone(self.solid_angle());
        let radius = cone((self.solid_angle() * (0.5 * class as f32).exp2()).min(2.0 * PI));
        match (class, spread) {
            (0, _) | (_, Spread::None) => 1.0,
            // The standard deviation is a bin's width, the radius that of the sender.           [Dachsbacher2007 3.1]
            (_, Spread::Gaussian) if angle <= radius + bin_radius => (-0.5 * angle * angle / self.solid_angle()).exp(),
            (_, Spread::Gaussian) => 0.0,
            // The share of the bin that the cone covers, as if both were straight.
            (_, Spread::Cone) => ((radius + bin_radius - angle) / (2.0 * bin_radius)).clamp(0.0, 1.0),
        }
    }
}

/// Direction at `at` (0..1 twice) inside a cell of the upper half.
fn direction_in(cell: u32, side: u32, at: Vec2) -> Vec3 {
    let p = 2.0 * (Vec2::new((cell % side) as f32, (cell / side) as f32) + at) / side as f32 - 1.0;
    let (r, phi) = if p == Vec2::ZERO {
        (0.0, 0.0)
    } else if p.x.abs() > p.y.abs() {
        (p.x, 0.25 * PI * (p.y / p.x))
    } else {
        (p.y, 0.5 * PI - 0.25 * PI * (p.x / p.y))
    };
    // r^2 = 1 - |z| keeps areas in proportion from the disc to half the sphere.
    let scale = (2.0 - r * r).max(0.0).sqrt();
    let z = 1.0 - r * r;
    Vec3::new(r * phi.cos() * scale, r * phi.sin() * scale, z)
}

/// The bins on the device.
pub struct DeviceBins {
    pub bins: DirectionBins,
    /// Of each bin: x and y, the bits of two floats; z is what is left, up for even bins.
    pub directions: Buffer<u64>,
    /// See [`DirectionBins::spread_lists`].
    pub spread_offsets: Buffer<u32>,
    pub spread: Buffer<SpreadEntry>,
}

impl DeviceBins {
    pub fn new(context: &Context, octant_side: u32, spread: Spread) -> Result<Self, GpuError> {
        let bins = DirectionBins::new(octant_side);
        let (offsets, entries) = bins.spread_lists(spread);
        let word = |w: &Vec3| u64::from(w.x.to_bits()) | u64::from(w.y.to_bits()) << 32;
        let words: Vec<u64> = bins.directions.iter().map(word).collect();
        Ok(Self {
            directions: context.upload("bins/directions", &words)?,
            spread_offsets: context.upload("bins/spread offsets", &offsets)?,
            spread: context.upload("bins/spread", &entries)?,
            bins,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_closed_under_reversal_and_contain_their_directions() {
        for k in [1, 4, 5, 8, 11] {
            let bins = DirectionBins::new(k);
            assert_eq!(bins.count(), 8 * k * k);
            for (bin, &w) in bins.directions.iter().enumerate() {
                let bin = bin as u32;
                assert_eq!((bins.bin_of(w), bins.bin_of(-w)), (bin, bins.opposite(bin)), "k = {k}, {w}");
                assert_eq!(bins.directions[bins.opposite(bin) as usize], -w);
                assert!(w.is_normalized() && (w.z > 0.0) == bin.is_multiple_of(2));
            }
        }
    }

    /// Points spread evenly over the sphere fall into all bins alike.
    #[test]
    fn bins_have_equal_solid_angles() {
        let bins = DirectionBins::new(4);
        let samples = 400_000;
        let mut hits = vec![0u32; bins.count() as usize];
        for i in 0..samples {
            // A spiral of equal areas.
            let z = 1.0 - (2.0 * i as f64 + 1.0) / f64::from(samples);
            let (r, phi) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * f64::from(i));
            hits[bins.bin_of(Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32)) as usize] += 1;
        }
        let mean = f64::from(samples) / f64::from(bins.count());
        assert!(hits.iter().all(|&n| (f64::from(n) / mean - 1.0).abs() < 0.03), "{hits:?}");
    }

    #[test]
    fn lists_start_at_their_bin_and_grow_with_the_class() {
        let bins = DirectionBins::new(4);
        for spread in [Spread::Gaussian, Spread::Cone] {
            let (offsets, entries) = bins.spread_lists(spread);
            let count = bins.count() as usize;
            assert_eq!(offsets.len(), count * (bins.class_count() as usize + 1) + 1);
            for class in 1..=bins.class_count() as usize {
                for bin in 0..count {
                    let list =
                        &entries[offsets[class * count + bin] as usize..offsets[class * count + bin + 1] as usize];
                    assert_eq!(list[0].bin as usize, bin);
                    assert!(list.windows(2).all(|pair| pair[0].weight >= pair[1].weight && pair[1].weight > 0.0));
                    if spread == Spread::Cone {
                        // Covers as many bins as the class is for, roughly.
                        let covered: f32 = list.iter().map(|entry| entry.weight).sum();
                        let ratio = covered / (0.5 * class as f32).exp2();
                        assert!((0.6..1.8).contains(&ratio), "class {class}, bin {bin}: {covered}");
                    }
                }
            }
        }
    }
}
