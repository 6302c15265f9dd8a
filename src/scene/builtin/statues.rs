//! The statues of the gallery as distance fields: negative inside, metres, standing on y = 0 and facing +Z, scaled so
//! that none changes by much more than a metre per metre.

use glam::{Vec2, Vec3};

/// One statue: its field and the box that holds it.
pub struct Statue {
    pub name: &'static str,
    pub low: Vec3,
    pub high: Vec3,
    pub field: fn(Vec3) -> f32,
}

pub const STATUES: [Statue; 8] = [
    Statue {
        name: "draped figure",
        low: Vec3::new(-0.4, -0.03, -0.36),
        high: Vec3::new(0.4, 1.72, 0.4),
        field: figure,
    },
    Statue { name: "knot", low: Vec3::new(-0.68, -0.05, -0.3), high: Vec3::new(0.68, 1.33, 0.3), field: knot },
    Statue { name: "flame", low: Vec3::new(-0.45, -0.03, -0.45), high: Vec3::new(0.45, 1.72, 0.45), field: flame },
    Statue { name: "sleeping head", low: Vec3::new(-0.5, -0.03, -0.45), high: Vec3::new(0.5, 1.03, 0.55), field: head },
    Statue { name: "coral", low: Vec3::new(-0.7, -0.05, -0.7), high: Vec3::new(0.7, 1.3, 0.7), field: coral },
    Statue {
        name: "pierced form",
        low: Vec3::new(-0.62, -0.05, -0.45),
        high: Vec3::new(0.62, 1.45, 0.45),
        field: pierced,
    },
    Statue { name: "lattice", low: Vec3::new(-0.62, -0.04, -0.62), high: Vec3::new(0.62, 1.28, 0.62), field: lattice },
    Statue {
        name: "reclining figure",
        low: Vec3::new(-0.95, -0.04, -0.45),
        high: Vec3::new(0.9, 0.95, 0.45),
        field: reclining,
    },
];

/// Union whose parts flow together within `k` metres.
fn blend(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// `a` without `b`, the edge rounded over `k` metres.
fn carve(a: f32, b: f32, k: f32) -> f32 {
    -blend(-a, b, k)
}

fn sphere(p: Vec3, centre: [f32; 3], radius: f32) -> f32 {
    (p - Vec3::from(centre)).length() - radius
}

fn ellipsoid(p: Vec3, centre: [f32; 3], radii: [f32; 3]) -> f32 {
    let radii = Vec3::from(radii);
    let q = p - Vec3::from(centre);
    let (unit, slope) = ((q / radii).length(), (q / (radii * radii)).length());
    if slope > 0.0 { unit * (unit - 1.0) / slope } else { -radii.min_element() }
}

/// A rod with round ends from `a` to `b` whose radius changes from `ra` to `rb`.
fn limb(p: Vec3, a: [f32; 3], b: [f32; 3], ra: f32, rb: f32) -> f32 {
    let (a, b) = (Vec3::from(a), Vec3::from(b));
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    (p - a.lerp(b, t)).length() - (ra + (rb - ra) * t)
}

fn hash(x: i32, y: i32, z: i32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x85EB_CA6B)
        ^ (y as u32).wrapping_mul(0xC2B2_AE35)
        ^ (z as u32).wrapping_mul(0x27D4_EB2F);
    h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ h >> 12).wrapping_mul(0x297A_2D39);
    (h ^ h >> 15) as f32 / u32::MAX as f32
}

/// Smooth noise in -1..1 with features of about one unit.
fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let t = f * f * (Vec3::splat(3.0) - 2.0 * f);
    let [i, j, k] = cell.as_ivec3().to_array();
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let edge = |y: i32, z: i32| mix(hash(i, j + y, k + z), hash(i + 1, j + y, k + z), t.x);
    let face = |z: i32| mix(edge(0, z), edge(1, z), t.y);
    2.0 * mix(face(0), face(1), t.z) - 1.0
}

/// A low round base under a statue.
fn base(p: Vec3, radius: f32) -> f32 {
    let d = Vec2::new(Vec2::new(p.x, p.z).length() - radius, (p.y - 0.03).abs() - 0.03);
    d.max(Vec2::ZERO).length() + d.max_element().min(0.0) - 0.008
}

/// An armless figure in a draped skirt.
fn figure(p: Vec3) -> f32 {
    let sway = 0.035 * (p.y * 2.6).sin();
    let q = Vec3::new(p.x - sway, p.y, p.z);
    let rise = (p.y / 0.86).clamp(0.0, 1.0);
    let around = q.z.atan2(q.x);
    let folds = (around * 13.0 + 2.2 * (p.y * 3.1 + around).sin()).sin() + 0.5 * (around * 7.0 - p.y * 5.0).sin();
    let radius = 0.31 - 0.125 * rise + 0.03 * (rise * 6.0).sin() * rise + 0.016 * (1.0 - 0.55 * rise) * folds;
    let skirt = (Vec2::new(q.x, q.z * 1.15).length() - radius) * 0.55;
    let skirt = skirt.max((p.y - 0.43).abs() - 0.43);
    let flat = Vec3::new(q.x, q.y, q.z * 1.3);
    let mut body = blend(
        limb(flat, [0.0, 0.84, 0.0], [0.005, 1.02, 0.0], 0.178, 0.13),
        limb(flat, [0.005, 1.1, 0.0], [0.0, 1.24, -0.01], 0.146, 0.145),
        0.12,
    );
    let mirrored = Vec3::new(q.x.abs(), q.y, q.z);
    body = blend(body, sphere(mirrored, [0.07, 1.16, 0.09], 0.062), 0.05);
    body = blend(body, limb(mirrored, [0.155, 1.275, -0.01], [0.225, 1.1, -0.02], 0.066, 0.055), 0.07);
    body = blend(body, limb(q, [0.0, 1.28, -0.015], [0.012, 1.42, 0.0], 0.06, 0.05), 0.05);
    let turned = Vec3::new(q.x * 0.94 + q.z * 0.34, q.y, q.z * 0.94 - q.x * 0.34);
    let mut face = blend(
        limb(turned, [0.0, 1.47, 0.025], [0.0, 1.55, 0.005], 0.062, 0.094),
        sphere(turned, [0.0, 1.505, 0.098], 0.012),
        0.03,
    );
    let curls = 0.006 * noise(turned * 45.0);
    face = blend(face, sphere(turned, [0.0, 1.58, -0.025], 0.092) + curls, 0.02);
    face = blend(face, sphere(turned, [0.0, 1.57, -0.125], 0.045) + curls, 0.02);
    body = blend(body, face, 0.03);
    blend(blend(skirt, body, 0.05), base(p, 0.35), 0.03)
}

/// A trefoil standing upright, its strand ridged.
fn knot(p: Vec3) -> f32 {
    let q = Vec3::new(p.x, p.y - 0.66, p.z);
    let around = q.y.atan2(q.x);
    let section = Vec2::new(Vec2::new(q.x, q.y).length() - 0.4, q.z);
    let mut strand = f32::MAX;
    for half in [0.0, std::f32::consts::PI] {
        let turn = around * 1.5 + half;
        let offset = section - Vec2::new(turn.cos(), turn.sin()) * 0.145;
        let ridges = 0.006 * (offset.y.atan2(offset.x) * 5.0 + around * 15.0).sin();
        strand = strand.min(offset.length() - 0.078 - ridges);
    }
    let rough = 0.0025 * noise(p * 60.0);
    let foot = limb(p, [0.0, 0.03, 0.0], [0.0, 0.13, 0.0], 0.07, 0.04);
    blend(blend((strand + rough) * 0.62, foot, 0.05), base(p, 0.24), 0.02)
}

/// A rising body with two lobes, twisted about its axis.
fn flame(p: Vec3) -> f32 {
    let rise = (p.y / 1.66).clamp(0.0, 1.0);
    let (sin, cos) = (p.y * 3.6).sin_cos();
    let q = Vec2::new(p.x * cos + p.z * sin, p.z * cos - p.x * sin);
    let swell = (1.0 - rise).max(0.0).sqrt() * (0.72 + 0.5 * (rise * 3.4).sin());
    let wave = 0.012 * (p.y * 42.0 + 3.0 * q.x).sin() * rise * (1.0 - rise) * 4.0;
    let lobes = Vec2::new(q.x.abs() - 0.13 * swell, q.y);
    let body = (lobes.length() - 0.205 * swell - wave) * 0.5;
    let body = body.max(p.y - 1.66).max(-p.y);
    blend(body, base(p, 0.3), 0.05)
}

/// A smooth head lying on its cheek.
fn head(p: Vec3) -> f32 {
    let (sin, cos) = 0.42f32.sin_cos();
    let q = Vec3::new(p.x * cos + (p.y - 0.45) * sin, (p.y - 0.45) * cos - p.x * sin, p.z);
    let mut egg = ellipsoid(q, [0.0, 0.05, 0.0], [0.29, 0.37, 0.33]);
    egg = blend(egg, ellipsoid(q, [0.0, -0.2, 0.1], [0.19, 0.22, 0.2]), 0.12);
    egg = blend(egg, limb(q, [0.0, 0.07, 0.3], [0.0, -0.09, 0.365], 0.022, 0.042), 0.06);
    egg = blend(egg, ellipsoid(Vec3::new(q.x.abs(), q.y, q.z), [0.03, -0.205, 0.285], [0.06, 0.022, 0.03]), 0.025);
    let brow = Vec3::new(q.x.abs(), q.y, q.z);
    egg = carve(egg, ellipsoid(brow, [0.125, 0.04, 0.345], [0.085, 0.05, 0.06]), 0.06);
    egg = blend(egg, ellipsoid(brow, [0.118, 0.035, 0.268], [0.062, 0.04, 0.042]), 0.02);
    egg = blend(egg, ellipsoid(brow, [0.285, 0.0, 0.0], [0.035, 0.085, 0.055]), 0.03);
    let neck = limb(p, [0.05, 0.06, -0.08], [0.04, 0.3, -0.04], 0.19, 0.15);
    let strands = 0.008 * (q.x * 90.0 + 3.0 * noise(q * 9.0)).sin();
    let hair = ellipsoid(q, [0.0, 0.11, -0.045], [0.315, 0.37, 0.325]) + strands;
    let hair = carve(hair, ellipsoid(q, [0.0, -0.06, 0.33], [0.26, 0.33, 0.3]), 0.05);
    blend(blend(egg, hair, 0.02), neck, 0.06).max(-p.y)
}

/// A ball with meandering grooves.
fn coral(p: Vec3) -> f32 {
    let q = p - Vec3::new(0.0, 0.64, 0.0);
    let lumps = 0.07 * noise(q * 3.1 + 5.2) + 0.02 * noise(q * 7.0);
    let meander = (13.0 * noise(q * 2.7) + 4.0 * noise(q * 5.3 + 1.9)).sin();
    let ball = (q.length() - 0.49 - lumps - 0.017 * meander) * 0.6;
    blend(ball, base(p, 0.34), 0.12)
}

/// An upright oval with a hole, and a small ball in the hole.
fn pierced(p: Vec3) -> f32 {
    let (sin, cos) = 0.22f32.sin_cos();
    let q = Vec3::new(p.x * cos - (p.y - 0.72) * sin, (p.y - 0.72) * cos + p.x * sin, p.z);
    let bow = Vec3::new(q.x, q.y, q.z + 0.25 * q.y * q.y - 0.05);
    let mut form = ellipsoid(bow, [0.0, 0.0, 0.0], [0.44, 0.66, 0.25]);
    form = blend(form, ellipsoid(bow, [-0.2, -0.4, 0.02], [0.27, 0.3, 0.24]), 0.15);
    form = carve(form, ellipsoid(bow, [0.1, 0.18, 0.0], [0.17, 0.24, 0.6]), 0.14);
    form = carve(form, ellipsoid(bow, [-0.14, -0.32, 0.2], [0.12, 0.13, 0.2]), 0.1);
    let grain = 0.0015 * (p.y * 160.0 + 6.0 * noise(p * 7.0)).sin();
    let ball = sphere(bow, [0.1, 0.13, 0.0], 0.1);
    let stem = limb(bow, [0.1, 0.1, 0.0], [0.1, -0.1, 0.0], 0.035, 0.045);
    let form = blend(form, blend(ball, stem, 0.05), 0.03) + grain;
    blend(form * 0.85, base(p, 0.33), 0.06)
}

/// A ball of gyroid: all holes.
fn lattice(p: Vec3) -> f32 {
    let q = p - Vec3::new(0.0, 0.64, 0.0);
    let k = std::f32::consts::TAU / 0.4;
    let (s, c) = ((q * k).map(f32::sin), (q * k).map(f32::cos));
    let gyroid = s.x * c.y + s.y * c.z + s.z * c.x;
    let strut = (gyroid + 0.2) / (k * 1.25);
    let ball = q.length() - 0.55;
    let shell = carve(ball, -strut, 0.03).max(ball);
    blend(shell * 0.8, base(p, 0.3), 0.04)
}

/// A figure resting on one arm, its waist open.
fn reclining(p: Vec3) -> f32 {
    let mut body = limb(p, [-0.38, 0.36, -0.02], [-0.44, 0.6, 0.0], 0.15, 0.13);
    body = blend(body, limb(p, [-0.4, 0.36, 0.02], [0.12, 0.2, 0.04], 0.12, 0.19), 0.12);
    body = blend(body, limb(p, [-0.47, 0.66, 0.0], [-0.48, 0.74, 0.01], 0.06, 0.055), 0.06);
    body = blend(body, ellipsoid(p, [-0.485, 0.83, 0.02], [0.07, 0.09, 0.085]), 0.03);
    body = blend(body, limb(p, [-0.58, 0.58, 0.02], [-0.74, 0.26, 0.08], 0.08, 0.065), 0.08);
    body = blend(body, limb(p, [-0.74, 0.24, 0.08], [-0.6, 0.06, 0.24], 0.062, 0.06), 0.05);
    body = blend(body, limb(p, [-0.33, 0.58, 0.06], [-0.02, 0.42, 0.2], 0.07, 0.055), 0.07);
    body = blend(body, limb(p, [-0.02, 0.42, 0.2], [0.2, 0.5, 0.14], 0.055, 0.05), 0.05);
    body = blend(body, limb(p, [0.14, 0.2, 0.1], [0.4, 0.56, 0.12], 0.15, 0.1), 0.08);
    body = blend(body, limb(p, [0.4, 0.56, 0.12], [0.62, 0.1, 0.16], 0.098, 0.065), 0.07);
    body = blend(body, limb(p, [0.14, 0.17, -0.08], [0.52, 0.17, -0.12], 0.15, 0.1), 0.08);
    body = blend(body, limb(p, [0.52, 0.17, -0.12], [0.78, 0.08, -0.05], 0.098, 0.06), 0.06);
    body = carve(body, ellipsoid(p, [-0.13, 0.29, 0.0], [0.1, 0.09, 0.5]), 0.09);
    let chisel = 0.004 * noise(p * 26.0) + 0.002 * noise(p * 60.0);
    let slab = {
        let d = Vec3::new(p.x.abs() - 0.84, (p.y - 0.03).abs() - 0.025, p.z.abs() - 0.34);
        d.max(Vec3::ZERO).length() + d.max_element().min(0.0) - 0.012
    };
    blend((body + chisel) * 0.85, slab, 0.04)
}
