//! What the church is put together from: column, shaft, rib, dome, pew, candlestick, painted windows.

use super::kit::{self, profile, slab};
use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Shape, circle};

/// A column on a square plinth with a spreading capital and a square abacus whose top is at `height`; the abacus covers
/// the foot of a wall `wall` thick.
pub fn column(height: f32, wall: f32) -> Shape {
    let half = wall * 0.5 + 0.07;
    let plinth = slab([-0.5, 0.5], [0.0, 0.22], [-0.5, 0.5], 0.03);
    let abacus = slab([-half, half], [height - 0.2, height], [-0.62, 0.62], 0.03);
    let base = profile([[0.47, 0.22], [0.49, 0.27], [0.45, 0.33], [0.39, 0.36], [0.4, 0.41], [0.36, 0.46]], 1);
    let drum = [[0.36, 0.46], [0.355, 1.4], [0.33, height - 0.72]];
    let ring =
        profile([[0.33, height - 0.72], [0.375, height - 0.69], [0.375, height - 0.65], [0.33, height - 0.62]], 1);
    let capital =
        profile([[0.33, height - 0.62], [0.34, height - 0.5], [0.4, height - 0.34], [0.53, height - 0.19]], 2);
    Shape::union([plinth, abacus, Shape::lathe(&[&base, &drum, &ring, &capital], 24)])
}

/// A slender half-round shaft against a wall at x = 0, on a small corbel.
pub fn shaft(low: f32, high: f32) -> Shape {
    let corbel = profile([[0.0, low - 0.08], [0.06, low], [0.15, low + 0.22], [0.2, low + 0.3]], 1);
    let body = [[0.13, low + 0.36], [0.13, high - 0.4]];
    let capital = profile([[0.13, high - 0.4], [0.15, high - 0.25], [0.26, high]], 2);
    let ledge = [[0.2, low + 0.3], [0.2, low + 0.36]];
    let top = [[0.26, high], [0.0, high]];
    Shape::lathe(&[&corbel, &ledge, &[[0.2, low + 0.36], [0.13, low + 0.36]], &body, &capital, &top], 14)
}

/// A half ring under a barrel vault of `radius`, `depth` deep and `width` wide, its centre at the origin.
pub fn rib(radius: f32, depth: f32, width: f32, steps: usize) -> Shape {
    let half = width * 0.5;
    let inner = radius - depth;
    let mut shape = Shape::default();
    let point = |i: usize, r: f32, z: f32| (circle(0.5 * i as f32 / steps as f32) * r).extend(z);
    for i in 0..steps {
        let soffit = [(i, half), (i + 1, half), (i + 1, -half), (i, -half)];
        let quad = soffit.map(|(i, z)| {
            let normal = -point(i, 1.0, 0.0);
            shape.vertex(point(i, inner, z), normal, Vec2::ZERO)
        });
        shape.quad_of(quad);
        let front = [(i, inner), (i, radius + 0.05), (i + 1, radius + 0.05), (i + 1, inner)];
        let quad = front.map(|(i, r)| shape.vertex(point(i, r, half), Vec3::Z, Vec2::ZERO));
        shape.quad_of(quad);
        let mut back = front.map(|(i, r)| shape.vertex(point(i, r, -half), Vec3::NEG_Z, Vec2::ZERO));
        back.reverse();
        shape.quad_of(back);
    }
    shape.welded()
}

/// A half dome over half a regular polygon of `2 * sides` corners, seen from inside; it opens towards +Z. Each gore is
/// smooth from springing to crown and meets its neighbours at an edge.
pub fn half_dome(sides: usize, rows: usize, radius: f32) -> Shape {
    let mut shape = Shape::default();
    for side in 0..sides {
        let [left, right] = [side, side + 1].map(|k| circle(0.5 - 0.5 * k as f32 / sides as f32));
        let middle = (left + right).normalize_or(Vec2::Y);
        let mut row_of = |row: usize| {
            let rise = circle(0.25 * row as f32 / rows as f32);
            let flat = if row == rows { 0.0 } else { rise.x };
            let normal = -Vec3::new(middle.x * rise.x, rise.y, -middle.y * rise.x);
            [left, right].map(|c| {
                let at = Vec3::new(c.x * flat, rise.y, -c.y * flat) * radius;
                shape.vertex(at, normal, Vec2::ZERO)
            })
        };
        let corners: Vec<[u32; 2]> = (0..=rows).map(&mut row_of).collect();
        for pair in corners.windows(2) {
            shape.quad_of([pair[0][0], pair[0][1], pair[1][1], pair[1][0]]);
        }
    }
    shape.welded()
}

/// A bench of 2.5 m whose sitters look towards -Z.
pub fn pew() -> Shape {
    let seat = slab([-1.2, 1.2], [0.42, 0.46], [-0.22, 0.2], 0.01);
    let back = slab([-1.2, 1.2], [0.46, 0.95], [0.2, 0.235], 0.01);
    let rail = slab([-1.22, 1.22], [0.94, 0.985], [0.17, 0.26], 0.012);
    let ends = [-1.25, 1.2].map(|x| slab([x, x + 0.05], [0.0, 1.02], [-0.26, 0.28], 0.014));
    Shape::union([seat, back, rail]).with(Shape::union(ends))
}

/// Stick, candle and flame; the flame's middle is 0.9 m up.
pub fn candlestick() -> (Shape, Shape, Shape) {
    let foot = profile(
        [
            [0.11, 0.0],
            [0.1, 0.03],
            [0.03, 0.07],
            [0.035, 0.12],
            [0.02, 0.18],
            [0.022, 0.4],
            [0.045, 0.44],
            [0.06, 0.46],
        ],
        2,
    );
    let stick = Shape::lathe(&[&[[0.0, 0.0], [0.11, 0.0]], &foot, &[[0.06, 0.46], [0.0, 0.46]]], 16);
    let candle = Shape::cylinder(0.028, 0.45, 0.86, 12);
    let fire = profile([[0.0, -0.035], [0.014, -0.012], [0.011, 0.01], [0.0, 0.045]], 2);
    (stick, candle, Shape::lathe(&[&fire], 8).moved(Vec3::new(0.0, 0.9, 0.0)))
}

/// A round pane with a texture across it, and the moulding around it; both in the plane z = 0, facing +Z.
pub fn rose_window(radius: f32) -> (Shape, Shape) {
    const STEPS: usize = 32;
    let rim: Vec<Vec3> = (0..STEPS).map(|k| (circle(k as f32 / STEPS as f32) * radius).extend(0.02)).collect();
    let mut pane = Shape::polygon(&rim);
    pane.uv = rim.iter().map(|p| Vec2::new(0.5 + 0.5 * p.x / radius, 0.5 - 0.5 * p.y / radius)).collect();
    let path: Vec<Vec3> = (0..=STEPS).map(|k| rim[k % STEPS] * 1.03).collect();
    (pane, Shape::tube(&path, |_| Vec2::new(0.13, 0.16), 8, false))
}

const JEWELS: [[f32; 3]; 6] =
    [[0.12, 0.2, 0.75], [0.75, 0.08, 0.1], [0.95, 0.68, 0.15], [0.1, 0.5, 0.28], [0.3, 0.5, 0.9], [0.6, 0.2, 0.6]];

fn jewel(pick: f32) -> [f32; 3] {
    JEWELS[((pick * 6.0) as usize).min(5)]
}

/// A tall window: diamonds of coloured glass in lead, a pale border and a medallion; sRGB.
pub fn stained_glass(x: f32, y: f32) -> [f32; 3] {
    const LEAD: [f32; 3] = [0.02, 0.02, 0.02];
    let border = x.min(1.0 - x).min((1.0 - y) * 2.0);
    if border < 0.09 {
        let bead = (y * 18.0).fract();
        return if !(0.015..=0.078).contains(&border) || bead < 0.12 { LEAD } else { [0.95, 0.86, 0.55] };
    }
    let from_centre = Vec2::new((x - 0.5) * 1.0, (y - 0.45) * 2.0);
    let r = from_centre.length();
    if r < 0.3 {
        let ray = turns(from_centre) * 8.0;
        let ring = usize::from(r > 0.11) + usize::from(r > 0.21);
        if (r - 0.11).abs() < 0.013 || (r - 0.21).abs() < 0.013 || r > 0.285 || (ring > 0 && ray.fract() < 0.09) {
            return LEAD;
        }
        return [[0.98, 0.82, 0.3], [0.8, 0.1, 0.12], [0.2, 0.36, 0.85]]
            [(ring + ray as usize * usize::from(ring == 2)) % 3];
    }
    let (u, v) = (x * 5.0 + y * 9.0, x * 5.0 - y * 9.0);
    if u.fract().min(1.0 - u.fract()).min(v.rem_euclid(1.0)).min(1.0 - v.rem_euclid(1.0)) < 0.06 {
        return LEAD;
    }
    jewel(kit::noise(u.floor() * 1.7 + 0.5, v.floor() * 2.3 + 0.5, 64))
}

/// A wheel of petals; sRGB, black outside the circle.
pub fn rose(x: f32, y: f32) -> [f32; 3] {
    let at = Vec2::new(x - 0.5, y - 0.5) * 2.0;
    let r = at.length();
    let ray = turns(at) * 12.0;
    let lead = 0.05 / (r + 0.1);
    let rings = [0.22, 0.55, 0.78];
    if r > 0.97
        || rings.iter().any(|ring| (r - ring).abs() < 0.02)
        || (r > 0.22 && ray.fract().min(1.0 - ray.fract()) < lead)
    {
        return [0.02; 3];
    }
    let ring = rings.iter().filter(|edge| r > **edge).count();
    const PETALS: [[[f32; 3]; 2]; 4] = [
        [[0.98, 0.85, 0.4], [0.98, 0.85, 0.4]],
        [[0.16, 0.28, 0.85], [0.75, 0.1, 0.14]],
        [[0.95, 0.6, 0.15], [0.2, 0.5, 0.85]],
        [[0.5, 0.12, 0.5], [0.12, 0.48, 0.35]],
    ];
    PETALS[ring][ray as usize % 2]
}

/// The angle of a direction as turns after the first full one, so that it is positive.
fn turns(at: Vec2) -> f32 {
    (f64::from(at.y).atan2(f64::from(at.x)) / std::f64::consts::TAU + 1.0) as f32
}
