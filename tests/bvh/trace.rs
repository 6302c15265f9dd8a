//! `trace/closest_hit` and `trace/any_hit` against brute force in f64, closed meshes that must not leak, bad rays.

use crate::common::{Random, TestContext};
use crate::meshes::{Mesh, cube, direction, point, ray, soup, sphere};
use glam::{DVec3, Vec2, Vec3};
use linklight::gpu::shaders::types::{Hit, Ray};
use linklight::stages::bvh::Bvh;
use linklight::stages::trace::{self, BACK_FACE, NO_HIT, OpaqueSurfaces, Tracer};

pub fn cast(context: &TestContext, mesh: &Mesh, rays: &[Ray]) -> (Vec<Hit>, Vec<u32>) {
    let bvh = Bvh::build(context, &mesh.positions, &mesh.triangles).unwrap();
    let opaque = OpaqueSurfaces::new(context).unwrap();
    cast_by(context, &Tracer::compute(&bvh, &opaque), rays)
}

/// Closest and any hits.
pub fn cast_by(context: &TestContext, tracer: &Tracer<'_>, rays: &[Ray]) -> (Vec<Hit>, Vec<u32>) {
    let ray_buffer = context.upload("test/rays", rays).unwrap();
    let hits = context.buffer("test/hits", rays.len()).unwrap();
    let visibility = context.buffer("test/visibility", rays.len()).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    trace::closest_hit(&mut recorder, tracer, &ray_buffer, &hits, rays.len());
    trace::any_hit(&mut recorder, tracer, &ray_buffer, &visibility, rays.len());
    recorder.submit().unwrap();
    (context.download(&hits).unwrap(), context.download(&visibility).unwrap())
}

/// What a ray does with one triangle, in double precision: t, barycentrics, and by how much (relative to the triangle)
/// it passes inside its edges; negative outside.
fn intersect(mesh: &Mesh, triangle: usize, ray: &Ray) -> Option<(f64, [f64; 2], f64)> {
    let [a, b, c] = mesh.triangles[triangle].map(|v| mesh.positions[v as usize].as_dvec3());
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p: DVec3 = direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant.abs() < 1e-12 * e1.length() * e2.length() {
        return None;
    }
    let s = origin - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(e1);
    let v = direction.dot(q) / determinant;
    Some((e2.dot(q) / determinant, [u, v], u.min(v).min(1.0 - u - v)))
}

/// Holds a hit against all triangles; edges and grazing rays may fall either way.
fn compare(mesh: &Mesh, ray: &Ray, hit: &Hit, visibility: u32) {
    const MARGIN: f64 = 1e-4;
    let inside = |t: f64| t >= f64::from(ray.t_min) && t <= f64::from(ray.t_max);
    let sure = (0..mesh.triangles.len())
        .filter_map(|k| intersect(mesh, k, ray).map(|(t, _, margin)| (t, margin)))
        .filter(|(t, margin)| *margin > MARGIN && inside(*t))
        .map(|(t, _)| t)
        .fold(f64::INFINITY, f64::min);
    assert_eq!(visibility == 0, hit.triangle != NO_HIT, "any and closest disagree: {ray:?} {hit:?}");
    if hit.triangle == NO_HIT {
        assert_eq!(sure, f64::INFINITY, "missed a triangle at t {sure}: {ray:?}");
        assert_eq!(hit.t, ray.t_max);
        return;
    }
    let triangle = (hit.triangle & !BACK_FACE) as usize;
    let (t, barycentrics, margin) = intersect(mesh, triangle, ray).unwrap();
    let tolerance = 1e-4 * (1.0 + t.abs());
    assert!(margin > -MARGIN, "hit {triangle} from outside by {margin}: {ray:?} {hit:?}");
    assert!((f64::from(hit.t) - t).abs() < tolerance, "t {} should be {t}: {ray:?}", hit.t);
    assert!(f64::from(hit.t) < sure + tolerance, "a nearer triangle at {sure} was missed: {ray:?} {hit:?}");
    let expected = Vec2::new(barycentrics[0] as f32, barycentrics[1] as f32);
    assert!(hit.barycentrics.abs_diff_eq(expected, 2e-3), "{hit:?} should have barycentrics {expected}");
    let [a, b, c] = mesh.triangles[triangle].map(|v| mesh.positions[v as usize]);
    let is_front = (b - a).cross(c - a).dot(ray.direction) < 0.0;
    assert_eq!(hit.triangle & BACK_FACE == 0, is_front, "{ray:?} {hit:?}");
}

#[test]
fn hits_agree_with_brute_force_in_double_precision() {
    let context = TestContext::new();
    let mut random = Random(7);
    for (triangle_count, ray_count) in [(1, 63), (2, 64), (63, 65), (64, 1009), (65, 257), (1009, 4099)] {
        let mesh = soup(triangle_count, 0.5, &mut random);
        let rays: Vec<Ray> = (0..ray_count)
            .map(|k| {
                let (t_min, t_max) = if k % 3 == 0 { (0.2 * random.unit(), 2.0 * random.unit()) } else { (0.0, 100.0) };
                let target = mesh.positions[random.below(mesh.positions.len() as u32) as usize];
                let origin = 2.0 * point(&mut random);
                let toward = target + 0.2 * point(&mut random) - origin;
                // Lengths other than 1 scale t.
                Ray { origin, t_min, direction: if k % 2 == 0 { toward.normalize() } else { toward }, t_max }
            })
            .collect();
        let (hits, visibility) = cast(&context, &mesh, &rays);
        for ((ray, hit), visibility) in rays.iter().zip(&hits).zip(visibility) {
            compare(&mesh, ray, hit, visibility);
        }
        assert!(triangle_count < 10 || hits.iter().any(|h| h.triangle != NO_HIT), "the test hits nothing");
    }
}

#[test]
#[should_panic(expected = "missed a triangle")]
fn the_comparison_can_fail() {
    let mesh = cube(1);
    let ray = ray(Vec3::new(0.1, 0.2, 0.3), Vec3::X);
    let missed = Hit { t: ray.t_max, triangle: NO_HIT, barycentrics: Vec2::ZERO };
    compare(&mesh, &ray, &missed, 1);
}

/// Rays from inside a closed mesh: everywhere, and at every vertex, edge midpoint and other points of edges exactly.
fn rays_from_inside(mesh: &Mesh, count: usize, random: &mut Random) -> Vec<Ray> {
    let mut rays = Vec::with_capacity(count);
    while rays.len() < count {
        let origin = match rays.len() % 4 {
            0 => Vec3::ZERO,
            // Exact coordinates make rays that lie in planes of edges.
            1 => Vec3::from([0; 3].map(|_: i32| random.below(5) as f32 * 0.125 - 0.25)),
            _ => 0.35 * point(random),
        };
        let corners = mesh.triangles[random.below(mesh.triangles.len() as u32) as usize];
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
        let target = match random.below(6) {
            0 => a,
            1 => 0.5 * (a + b),
            2 => a + random.unit() * (b - a),
            3 => a + 1e-6 * random.unit() * (c - a),
            4 => origin + direction(random),
            _ => {
                origin
                    + [Vec3::X, Vec3::Y, Vec3::Z][random.below(3) as usize]
                        * if random.unit() < 0.5 { 1.0 } else { -1.0 }
            }
        };
        let toward = target - origin;
        if toward.length() > 1e-3 {
            rays.push(ray(origin, if random.below(2) == 0 { toward.normalize() } else { toward }));
        }
    }
    rays
}

#[test]
fn closed_meshes_do_not_leak() {
    let context = TestContext::new();
    let mut random = Random(11);
    let mut moved = sphere(37, 61);
    moved.positions.iter_mut().for_each(|p| *p = 0.75 * *p + 0.1 * Vec3::new(p.y, p.z, p.x * p.y));
    for (name, mesh, offset, scale) in [
        ("sphere", sphere(24, 48), Vec3::ZERO, 1.0),
        ("deformed sphere", moved, Vec3::ZERO, 1.0),
        ("cube of 12", cube(1), Vec3::ZERO, 1.0),
        ("cube of 1200", cube(10), Vec3::ZERO, 1.0),
        ("far cube", cube(7), Vec3::new(1000.0, -300.0, 77.0), 1.0),
        ("tiny cube", cube(7), Vec3::ZERO, 1e-6),
        ("huge sphere", sphere(24, 48), Vec3::ZERO, 1e7),
    ] {
        let mut rays = rays_from_inside(&mesh, 150_000, &mut random);
        for ray in &mut rays {
            ray.origin = ray.origin * scale + offset;
            ray.direction *= if ray.direction.length() > 0.999 && ray.direction.length() < 1.001 { 1.0 } else { scale };
        }
        let positions = mesh.positions.iter().map(|&p| p * scale + offset).collect();
        let mesh = Mesh { positions, ..mesh };
        let (hits, visibility) = cast(&context, &mesh, &rays);
        let escaped: Vec<_> = rays.iter().zip(&hits).filter(|(_, hit)| hit.triangle == NO_HIT).collect();
        assert!(
            escaped.is_empty(),
            "{name}: {} of {} rays escape, such as {:?}",
            escaped.len(),
            rays.len(),
            escaped[0].0
        );
        let free = visibility.iter().filter(|&&v| v != 0).count();
        assert_eq!(free, 0, "{name}: {free} shadow rays escape");
        let front = hits.iter().filter(|hit| hit.triangle & BACK_FACE == 0).count();
        assert_eq!(front, 0, "{name}: {front} fronts seen from inside");
    }
}

#[test]
fn bad_and_inactive_rays_hit_nothing() {
    let context = TestContext::new();
    let good = ray(Vec3::new(0.1, 0.2, 0.3), Vec3::X);
    let mut rays = vec![good, Ray { t_max: -1.0, ..good }];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3e38, -3e38] {
        for axis in 0..3 {
            let mut ray = good;
            ray.origin[axis] = bad;
            rays.push(ray);
            let mut ray = good;
            ray.direction[axis] = bad;
            rays.push(ray);
        }
    }
    rays.push(Ray { direction: Vec3::ZERO, ..good });
    rays.push(Ray { direction: Vec3::splat(1e-30), ..good });
    rays.push(Ray { t_max: f32::NAN, ..good });
    rays.push(Ray { t_min: f32::NAN, ..good });
    rays.push(Ray { t_min: 5.0, t_max: 4.0, ..good });
    rays.push(Ray { t_min: f32::INFINITY, ..good });
    let (hits, visibility) = cast(&context, &cube(3), &rays);
    assert!(hits[0].triangle != NO_HIT && visibility[0] == 0);
    for ((ray, hit), visibility) in rays.iter().zip(&hits).zip(visibility).skip(1) {
        assert!(hit.triangle == NO_HIT && visibility == 1, "{ray:?} hit {hit:?}");
    }
}

#[test]
fn of_equal_distances_the_lowest_triangle_counts() {
    let context = TestContext::new();
    let mut mesh = cube(2);
    // The same cube 40 times over, in an order that no builder keeps.
    let once = mesh.triangles.clone();
    let mut random = Random(3);
    for _ in 0..40 {
        let start = random.below(once.len() as u32) as usize;
        mesh.triangles.extend_from_slice(&once[start..]);
        mesh.triangles.extend_from_slice(&once[..start]);
    }
    let rays: Vec<Ray> = (0..5000).map(|_| ray(0.5 * point(&mut random), direction(&mut random))).collect();
    let (hits, _) = cast(&context, &mesh, &rays);
    assert!(hits.iter().all(|hit| ((hit.triangle & !BACK_FACE) as usize) < once.len()));
}
