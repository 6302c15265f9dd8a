//! Charts of small surfaces: complete, flat, without overlaps, and cut where they must be.

use super::*;
use glam::{vec2, vec3};
use std::f32::consts::{PI, TAU};

struct Mesh {
    positions: Vec<Vec3>,
    uv: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<u32>,
}

impl Mesh {
    /// `columns` x `rows` squares over 0..=1 x 0..=1, placed by `at`, their texture coordinates by `uv`.
    fn grid(columns: u32, rows: u32, at: impl Fn(Vec2) -> Vec3, uv: impl Fn(Vec2) -> Vec2) -> Self {
        let mut mesh = Self { positions: vec![], uv: vec![], triangles: vec![], parts: vec![] };
        for y in 0..=rows {
            for x in 0..=columns {
                let t = vec2(x as f32 / columns as f32, y as f32 / rows as f32);
                mesh.positions.push(at(t));
                mesh.uv.push(uv(t));
            }
        }
        for y in 0..rows {
            for x in 0..columns {
                let a = y * (columns + 1) + x;
                let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh.parts = vec![0; mesh.triangles.len()];
        mesh
    }

    fn surface(&self) -> Surface<'_> {
        Surface {
            positions: &self.positions,
            triangles: &self.triangles,
            triangle_part: &self.parts,
            uv: [&[], &self.uv],
        }
    }

    fn charts(&self, model_uv: bool) -> Charts {
        let charts = unwrap(&self.surface(), &Options { model_uv, ..Options::default() });
        check(&self.surface(), &charts);
        charts
    }
}

/// What holds for the charts of any surface.
fn check(surface: &Surface<'_>, charts: &Charts) {
    for (index, chart) in charts.charts.iter().enumerate() {
        let own = |t: &usize| charts.triangle_chart[*t] == index as u32;
        let triangles: Vec<usize> = (0..surface.triangles.len()).filter(own).collect();
        assert!(!triangles.is_empty(), "chart {index} is empty");
        let uv: Vec<[Vec2; 3]> = triangles.iter().map(|&t| charts.corner_uv[t]).collect();
        assert!(triangles.iter().all(|&t| surface.triangle_part[t] == chart.part));
        assert!(uv.iter().all(|&uv| flat::signed_area(uv) >= 0.0), "chart {index} folds");
        assert_eq!(first_overlapping(&uv), None, "chart {index} overlaps itself");
        let (low, high) = bounds(&uv);
        assert!(low.abs().max_element() < 1e-5 && (high - chart.size).abs().max_element() < 1e-5);
        let area: f32 = triangles.iter().map(|&t| 0.5 * surface.across(t as u32).length()).sum();
        assert!((area - chart.area).abs() <= 1e-4 * area);
    }
    assert!(charts.triangle_chart.iter().all(|&chart| (chart as usize) < charts.charts.len()));
    for (vertex, (&chart, &at)) in charts.vertex_chart.iter().zip(&charts.vertex_uv).enumerate() {
        let corners = surface
            .triangles
            .iter()
            .enumerate()
            .flat_map(|(t, corners)| corners.iter().enumerate().map(move |(k, &v)| (v as usize, t, k)));
        let mut own = corners.filter(|&(v, ..)| v == vertex).peekable();
        if own.peek().is_none() {
            assert_eq!(chart, NO_CHART);
        } else {
            assert!(own.any(|(_, t, k)| charts.triangle_chart[t] == chart && charts.corner_uv[t][k] == at));
        }
    }
}

#[test]
fn usable_coordinates_are_taken_in_metres_on_both_axes() {
    // A wall of 4 m by 1 m whose picture is square, and mirrored.
    let wall = Mesh::grid(8, 4, |t| vec3(4.0 * t.x, t.y, 0.0), |t| vec2(1.0 - t.x, t.y));
    let charts = wall.charts(true);
    assert_eq!(charts.charts.len(), 1);
    assert_eq!(charts.charts[0].source, Source::Model);
    assert!((charts.charts[0].size - vec2(4.0, 1.0)).length() < 1e-4, "{:?}", charts.charts[0]);
}

#[test]
fn coordinates_that_cannot_serve_are_replaced() {
    let flat = |t: Vec2| vec3(t.x, t.y, 0.0);
    type Spoil = fn(Vec2) -> Vec2;
    let spoilt: [(&str, Spoil); 4] = [
        ("absent", |_| Vec2::ZERO),
        ("folded", |t| vec2((t.x - 0.5).abs(), t.y)),
        ("wound twice around", |t| (0.5 + t.y) * Vec2::from_angle(4.0 * PI * t.x)),
        ("blown up", |t| vec2(t.x.powi(8), t.y)),
    ];
    for (what, uv) in spoilt {
        let charts = Mesh::grid(24, 4, flat, uv).charts(true);
        assert_eq!(charts.charts.len(), 1, "{what}");
        assert_eq!(charts.charts[0].source, Source::Projected, "{what}");
        assert!((charts.charts[0].size - Vec2::ONE).length() < 1e-4, "{what}: lies straight");
    }
}

#[test]
fn a_box_is_cut_along_its_edges_and_a_sphere_into_caps() {
    // The sides of a box: three corners on the way round.
    let corner = |t: Vec2| {
        let along = 4.0 * t.x;
        let (side, rest) = ((along.floor() as usize).min(3), along - along.floor().min(3.0));
        let corners = [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(1.0, 1.0), vec2(0.0, 1.0), vec2(0.0, 0.0)];
        corners[side].lerp(corners[side + 1], rest).extend(t.y)
    };
    let sides = Mesh::grid(16, 4, corner, |_| Vec2::ZERO).charts(false);
    assert_eq!(sides.charts.len(), 4);

    let sphere = |t: Vec2| {
        let (phi, theta) = (TAU * t.x, 0.1 + 2.9 * t.y); // open at the poles
        vec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), -theta.cos())
    };
    let caps = Mesh::grid(32, 16, sphere, |t| t).charts(false);
    assert!((6..=40).contains(&caps.charts.len()), "{} charts", caps.charts.len());
}

#[test]
fn a_ramp_that_passes_over_itself_is_cut() {
    // Two and a half turns of a shallow spiral stair: all normals agree, but floors lie over floors.
    let ramp = |t: Vec2| (Vec2::from_angle(5.0 * PI * t.x) * (1.0 + t.y)).extend(0.5 * t.x);
    let charts = Mesh::grid(100, 3, ramp, |_| Vec2::ZERO).charts(true);
    assert!((3..=12).contains(&charts.charts.len()), "{} charts", charts.charts.len());
}

#[test]
fn degenerate_and_lonely_things_do_no_harm() {
    let mut mesh = Mesh::grid(2, 2, |t| vec3(t.x, t.y, 0.0), |t| t);
    mesh.positions.push(Vec3::splat(7.0));
    mesh.uv.push(Vec2::ZERO);
    let lonely = mesh.positions.len() as u32 - 1;
    mesh.triangles.extend([[0, 0, 1], [0, 1, 2], [0, 4, 8]]);
    mesh.parts.extend([0, 0, 1]);
    for model_uv in [false, true] {
        assert_eq!(mesh.charts(model_uv).vertex_chart[lonely as usize], NO_CHART);
    }
    let empty = Surface { positions: &[], triangles: &[], triangle_part: &[], uv: [&[], &[]] };
    assert_eq!(unwrap(&empty, &Options::default()), Charts::default());
}

#[test]
fn the_same_surface_gives_the_same_charts() {
    let bumpy = |t: Vec2| vec3(3.0 * t.x, 3.0 * t.y, (9.0 * t.x).sin() * (7.0 * t.y).cos());
    let mesh = Mesh::grid(40, 40, bumpy, |t| vec2(t.x, t.y + t.y * t.y));
    assert_eq!(mesh.charts(false), mesh.charts(false));
    assert_eq!(mesh.charts(true).charts.len(), 1);
}
