//! Small helpers that several scenes share: short spellings of boxes and rods, dice, painted textures.

use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Shape, smooth_path};

/// A box between ranges of x, y and z with edges rounded at `bevel` metres.
pub fn slab(x: [f32; 2], y: [f32; 2], z: [f32; 2], bevel: f32) -> Shape {
    Shape::rounded_cuboid(Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]), bevel)
}

/// A box with hard edges.
pub fn block(x: [f32; 2], y: [f32; 2], z: [f32; 2]) -> Shape {
    Shape::cuboid(Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]))
}

/// A straight rod with flat ends, `radius` at its first and last point.
pub fn rod(ends: [[f32; 3]; 2], radius: [f32; 2], segments: usize) -> Shape {
    let taper = |t: f32| Vec2::splat(radius[0] + (radius[1] - radius[0]) * t);
    Shape::tube(&ends.map(Vec3::from), taper, segments, true)
}

/// Texture coordinates seen from above: x and z in metres.
pub fn plan_uv(mut shape: Shape) -> Shape {
    shape.uv = shape.positions.iter().map(|p| Vec2::new(p.x, p.z)).collect();
    shape
}

/// A smooth profile for [`Shape::lathe`] through (radius, height) points.
pub fn profile<const N: usize>(points: [[f32; 2]; N], steps: usize) -> Vec<[f32; 2]> {
    let curve = smooth_path(points.map(|[r, y]| Vec3::new(r, y, 0.0)), steps);
    curve.into_iter().map(|p| [p.x.max(0.0), p.y]).collect()
}

/// Pseudo-random numbers by xorshift; the same seed gives the same row.
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        let mut dice = Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        // The first numbers of nearby seeds are alike.
        for _ in 0..4 {
            dice.unit();
        }
        dice
    }

    /// In 0..1.
    pub fn unit(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    pub fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

fn lattice(x: i32, y: i32, period: i32) -> f32 {
    let (x, y) = (x.rem_euclid(period) as u32, y.rem_euclid(period) as u32);
    let mut h = x.wrapping_mul(0x85EB_CA6B) ^ y.wrapping_mul(0xC2B2_AE35) ^ 0x27D4_EB2F;
    h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ h >> 12).wrapping_mul(0x297A_2D39);
    (h ^ h >> 15) as f32 / u32::MAX as f32
}

/// Smooth noise in 0..1 that repeats every `period` units.
pub fn noise(x: f32, y: f32, period: i32) -> f32 {
    let (i, j) = (x.floor() as i32, y.floor() as i32);
    let fade = |t: f32| t * t * (3.0 - 2.0 * t);
    let (u, v) = (fade(x - x.floor()), fade(y - y.floor()));
    let row = |j: i32| lattice(i, j, period) * (1.0 - u) + lattice(i + 1, j, period) * u;
    row(j) * (1.0 - v) + row(j + 1) * v
}

fn mixed(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// Planks along the picture's x: `rows` of them, between two sRGB tones, with grain and dark joints.
pub fn planks(rows: i32, dark: [f32; 3], light: [f32; 3]) -> impl Fn(f32, f32) -> [f32; 3] {
    move |x, y| {
        let row = (y * rows as f32).floor() as i32;
        let across = y * rows as f32 - row as f32;
        let along = x + lattice(row, 7, rows);
        let board = (along * 2.0).floor() as i32 % 2 + 2 * row;
        let tone = lattice(board, 3, 2 * rows);
        let grain = noise(x * 8.0, y * rows as f32 * 8.0, 8 * rows) * 0.6
            + noise(x * 16.0, y * rows as f32 * 16.0, 16 * rows) * 0.4;
        let joint = (across * (1.0 - across) * 40.0).min(1.0)
            * ((along * 2.0).fract().min(1.0 - (along * 2.0).fract()) * 120.0).min(1.0);
        mixed(dark, light, 0.55 * tone + 0.45 * grain).map(|c| c * (0.55 + 0.45 * joint))
    }
}

/// Two by two tiles with joints.
pub fn checker(first: [f32; 3], second: [f32; 3], joint: [f32; 3]) -> impl Fn(f32, f32) -> [f32; 3] {
    move |x, y| {
        let (u, v) = (x * 2.0, y * 2.0);
        let tile = if (u as i32 + v as i32) % 2 == 0 { first } else { second };
        let edge = u.fract().min(1.0 - u.fract()).min(v.fract().min(1.0 - v.fract()));
        let stain = 0.92 + 0.08 * noise(x * 16.0, y * 16.0, 16);
        if edge < 0.016 { joint } else { tile.map(|c| c * stain) }
    }
}
