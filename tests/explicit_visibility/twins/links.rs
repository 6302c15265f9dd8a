//! Twins of glsl/links/ and glsl/gather/.

use glam::Vec3;
use linklight::gpu::shaders::types::Hit;
use linklight::stages::elements::NO_ELEMENT;
use linklight::stages::links::Link;
use linklight::stages::trace::{BACK_FACE, NO_HIT};
use std::collections::BTreeMap;

pub const RAY_UNITS: u32 = 65536;
pub const PACKED_UNITS: u32 = 4096;

/// One element's row in whole units, its escaped rays as bits, and blocked | escaped << 16.
pub struct MergedRow {
    pub entries: Vec<(u32, u32)>,
    pub escaped: Vec<u32>,
    pub outcome: u32,
}

pub fn merge_hits(hits: &[Hit], triangles: &[[u32; 3]], back_elements: &[u32], unit_divisor: u32) -> MergedRow {
    let mut weights: BTreeMap<u32, u32> = BTreeMap::new();
    let mut escaped = vec![0u32; hits.len().div_ceil(32)];
    let (mut blocked, mut escaped_count) = (0, 0);
    for (ray, hit) in hits.iter().enumerate() {
        if hit.triangle == NO_HIT {
            escaped[ray / 32] |= 1 << (ray % 32);
            escaped_count += 1;
            continue;
        }
        let mut senders = triangles[(hit.triangle & !BACK_FACE) as usize];
        if hit.triangle & BACK_FACE != 0 {
            senders = senders.map(|v| back_elements[v as usize]);
            if senders[0] == NO_ELEMENT {
                blocked += 1;
                continue;
            }
        }
        let units = |b: f32| (b.clamp(0.0, 1.0) * RAY_UNITS as f32 + 0.5) as u32;
        let second = units(hit.barycentrics.x).min(RAY_UNITS);
        let third = units(hit.barycentrics.y).min(RAY_UNITS - second);
        for (sender, weight) in senders.into_iter().zip([RAY_UNITS - second - third, second, third]) {
            if weight > 0 {
                *weights.entry(sender).or_default() += weight;
            }
        }
    }
    let rounded = |weight: u32| (weight + unit_divisor / 2) / unit_divisor;
    let mut before = 0;
    let entries = weights.into_iter().map(|(sender, weight)| {
        let units = rounded(before + weight) - rounded(before);
        before += weight;
        (sender, units)
    });
    MergedRow { entries: entries.collect(), escaped, outcome: blocked | escaped_count << 16 }
}

pub fn gather(offsets: &[u32], links: &[Link], radiosity: &[Vec3]) -> Vec<Vec3> {
    let row = |r: usize| &links[offsets[r] as usize..offsets[r + 1] as usize];
    let irradiance = |r| row(r).iter().map(|link| link.weight * radiosity[link.sender as usize]).sum();
    (0..offsets.len() - 1).map(irradiance).collect()
}

/// A colour as its channels come back from three mantissas of `bits` bits under the exponent of the brightest.
pub fn shared_exponent(color: Vec3, bits: i32) -> Vec3 {
    let largest = color.max_element();
    if largest <= 1e-30 {
        return Vec3::ZERO;
    }
    // The next power of two above it.
    let exponent = (largest.to_bits() >> 23) as i32 - 126;
    let unit = 2f32.powi(exponent - bits);
    color.map(|c| (c / unit + 0.5).floor().min(2f32.powi(bits) - 1.0) * unit)
}
