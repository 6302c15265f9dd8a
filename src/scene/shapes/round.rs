//! Smooth shapes: bodies of revolution, tubes along a path, spheres.

use super::Shape;
use glam::{Vec2, Vec3};

/// Sine and cosine of an angle in turns; the same bits wherever the double-precision library is within half an ulp.
pub fn sin_cos(turns: f32) -> (f32, f32) {
    let (sin, cos) = (f64::from(turns) * std::f64::consts::TAU).sin_cos();
    // Quarter turns are exact.
    let snap = |x: f64| if x.abs() < 1e-12 { 0.0 } else { x as f32 };
    (snap(sin), snap(cos))
}

/// The point of the unit circle at an angle in turns, counter-clockwise from +X.
pub fn circle(turns: f32) -> Vec2 {
    let (sin, cos) = sin_cos(turns);
    Vec2::new(cos, sin)
}

/// A smooth curve through `points` (Catmull-Rom, chord-length free), `steps` pieces between neighbours.
pub fn smooth_path<const N: usize>(points: [Vec3; N], steps: usize) -> Vec<Vec3> {
    let at = |i: isize| {
        let last = N as isize - 1;
        if i < 0 {
            points[0] * 2.0 - points[1.min(N - 1)]
        } else if i > last {
            points[N - 1] * 2.0 - points[N.saturating_sub(2)]
        } else {
            points[i as usize]
        }
    };
    let mut curve = Vec::with_capacity((N - 1) * steps + 1);
    for piece in 0..N as isize - 1 {
        let [p, q, r, s] = std::array::from_fn(|k| at(piece - 1 + k as isize));
        for step in 0..steps {
            let t = step as f32 / steps as f32;
            let cubic = (q - r) * 3.0 + s - p;
            let square = p * 2.0 - q * 5.0 + r * 4.0 - s;
            curve.push(q + ((r - p) + (square + cubic * t) * t) * (0.5 * t));
        }
    }
    curve.push(points[N - 1]);
    curve
}

impl Shape {
    /// A body of revolution about +Y. Each of `curves` is a smooth stretch of the profile as (radius, height), with a
    /// hard edge between stretches; going upwards along the profile the outside is to the right.
    pub fn lathe(curves: &[&[[f32; 2]]], segments: usize) -> Self {
        let mut shape = Self::default();
        for curve in curves {
            let points: Vec<Vec2> = curve.iter().copied().map(Vec2::from).collect();
            let first = shape.positions.len() as u32;
            for (i, at) in points.iter().enumerate() {
                let tangent = points[(i + 1).min(points.len() - 1)] - points[i.saturating_sub(1)];
                // On the axis a smooth surface is level.
                let mut outward = Vec2::new(tangent.y, -tangent.x).normalize_or(Vec2::X);
                if at.x == 0.0 {
                    outward = Vec2::new(0.0, if outward.y < 0.0 { -1.0 } else { 1.0 });
                }
                for k in 0..segments {
                    let around = circle(k as f32 / segments as f32);
                    let swing = |r: f32, y: f32| Vec3::new(around.x * r, y, -around.y * r);
                    shape.vertex(swing(at.x, at.y), swing(outward.x, outward.y).normalize_or(Vec3::Y), Vec2::ZERO);
                }
            }
            let n = segments as u32;
            for row in 0..points.len() as u32 - 1 {
                for k in 0..n {
                    let (a, b) = (first + row * n + k, first + row * n + (k + 1) % n);
                    shape.triangle([a, b, b + n]);
                    shape.triangle([a, b + n, a + n]);
                }
            }
        }
        shape.welded()
    }

    /// A cylinder with flat ends from `low` to `high` on the Y axis.
    pub fn cylinder(radius: f32, low: f32, high: f32, segments: usize) -> Self {
        Self::lathe(
            &[&[[0.0, low], [radius, low]], &[[radius, low], [radius, high]], &[[radius, high], [0.0, high]]],
            segments,
        )
    }

    /// A unit sphere about the origin; poles on Y.
    pub fn sphere(segments: usize) -> Self {
        let rows = segments / 2;
        let profile: Vec<[f32; 2]> = (0..=rows)
            .map(|i| {
                let at = circle(0.5 * i as f32 / rows as f32 - 0.25);
                [if i == 0 || i == rows { 0.0 } else { at.x }, at.y]
            })
            .collect();
        let mut sphere = Self::lathe(&[&profile], segments);
        sphere.normals = sphere.positions.iter().map(|p| p.normalize_or(Vec3::Y)).collect();
        sphere.welded()
    }

    /// A tube around `path` with a radius at each point. Ends are closed by flat caps when `capped`; a path whose last
    /// point is its first closes on itself (and takes no caps).
    pub fn tube(path: &[Vec3], radius: impl Fn(f32) -> Vec2, segments: usize, capped: bool) -> Self {
        let n = path.len();
        if n < 2 {
            return Self::default();
        }
        let closed = path[0] == path[n - 1];
        let tangent = |i: usize| {
            let before = if i > 0 {
                path[i - 1]
            } else if closed {
                path[n - 2]
            } else {
                path[0]
            };
            let after = if i + 1 < n {
                path[i + 1]
            } else if closed {
                path[1]
            } else {
                path[n - 1]
            };
            (after - before).normalize_or(Vec3::Y)
        };
        let mut shape = Self::default();
        // The side direction is carried along the path, so that the tube does not twist.
        let start = tangent(0);
        let mut side = start.cross(if start.y.abs() < 0.9 { Vec3::Y } else { Vec3::Z }).normalize_or(Vec3::X);
        let rows = if closed { n - 1 } else { n };
        for (i, &centre) in path.iter().enumerate().take(rows) {
            let along = tangent(i);
            side = (side - along * side.dot(along)).normalize_or(Vec3::X);
            let up = side.cross(along);
            let r = radius(i as f32 / (n - 1) as f32);
            for k in 0..segments {
                let c = circle(k as f32 / segments as f32);
                let normal = (side * (c.x * r.y) + up * (c.y * r.x)).normalize_or(along);
                shape.vertex(centre + side * (c.x * r.x) + up * (c.y * r.y), normal, Vec2::ZERO);
            }
        }
        let ring = |row: usize, k: usize| (row % rows * segments + k % segments) as u32;
        for row in 0..n - 1 {
            for k in 0..segments {
                shape.triangle([ring(row, k), ring(row + 1, k), ring(row + 1, k + 1)]);
                shape.triangle([ring(row, k), ring(row + 1, k + 1), ring(row, k + 1)]);
            }
        }
        if capped && !closed {
            for (row, reverse) in [(0, false), (n - 1, true)] {
                let mut rim: Vec<Vec3> = (0..segments).map(|k| shape.positions[ring(row, k) as usize]).collect();
                if reverse {
                    rim.reverse();
                }
                shape.append(Self::polygon(&rim));
            }
        }
        shape
    }
}
