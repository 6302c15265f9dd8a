//! Bins over a hemisphere, and colours of a shared exponent, in plain double precision: for twins.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Unit direction of a place in cells, about +z.
pub fn direction(place: DVec2, side: u32) -> DVec3 {
    let p = 2.0 * place / f64::from(side) - 1.0;
    let (r, phi) = match p.x.abs() > p.y.abs() {
        true => (p.x, 0.25 * PI * p.y / p.x),
        false if p.y == 0.0 => (0.0, 0.0),
        false => (p.y, 0.5 * PI - 0.25 * PI * p.x / p.y),
    };
    let flat = r * (2.0 - r * r).sqrt();
    DVec3::new(flat * phi.cos(), flat * phi.sin(), 1.0 - r * r)
}

pub fn middle(bin: u32, side: u32) -> DVec3 {
    direction(DVec2::new(f64::from(bin % side), f64::from(bin / side)) + 0.5, side)
}

/// Mean cosine over a bin, by points of it.
pub fn cosine(bin: u32, side: u32) -> f64 {
    const POINTS: u32 = 64;
    let of = |k: u32| DVec2::new(f64::from(k % POINTS), f64::from(k / POINTS)) + 0.5;
    let cell = DVec2::new(f64::from(bin % side), f64::from(bin / side));
    let sum: f64 = (0..POINTS * POINTS).map(|k| direction(cell + of(k) / f64::from(POINTS), side).z).sum();
    sum / f64::from(POINTS * POINTS)
}

pub fn solid_angle(side: u32) -> f64 {
    2.0 * PI / f64::from(side * side)
}

/// Where a direction above the horizon lies, in cells.
pub fn place(w: DVec3, side: u32) -> DVec2 {
    let (r, phi) = ((1.0 - w.z).sqrt(), w.y.atan2(w.x));
    // Quadrants about the axes: -45 .. 45 degrees about +x first.
    let quarter = (phi / (0.5 * PI)).round();
    let along = 4.0 / PI * (phi - 0.5 * PI * quarter) * r;
    let square = match quarter as i32 {
        0 => DVec2::new(r, along),
        1 => DVec2::new(-along, r),
        -1 => DVec2::new(along, -r),
        _ => DVec2::new(-r, -along),
    };
    0.5 * f64::from(side) * (square + 1.0)
}

/// Between the four bins around.
pub fn between(table: &[DVec3], side: u32, w: DVec3) -> DVec3 {
    let last = f64::from(side) - 1.0;
    let at = (place(w, side) - 0.5).clamp(DVec2::ZERO, DVec2::splat(last));
    let low = at.floor();
    let t = at - low;
    let value = |step: DVec2| {
        let cell = (low + step).min(DVec2::splat(last)).as_uvec2();
        let weights = DVec2::ONE - step + (2.0 * step - 1.0) * t;
        weights.x * weights.y * table[(cell.y * side + cell.x) as usize]
    };
    [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(value).into_iter().sum()
}

pub fn decode_32(word: u32) -> DVec3 {
    let scale = f64::from(f32::from_bits((word & 0xff) << 23));
    scale * DVec3::new(f64::from(word >> 24), f64::from(word >> 16 & 0xff), f64::from(word >> 8 & 0xff))
}

/// Eight bits a channel, rounded down; below 1e-30 black.
pub fn encode_32(color: DVec3) -> u32 {
    let largest = color.max_element();
    if largest < 1e-30 {
        return 1;
    }
    let exponent = largest.log2().floor() as i32 + 1;
    let [r, g, b] = (color * 2f64.powi(8 - exponent)).to_array().map(|m| (m as u32).min(255));
    r << 24 | g << 16 | b << 8 | (exponent - 8 + 127) as u32
}
