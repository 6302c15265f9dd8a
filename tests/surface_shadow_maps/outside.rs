//! Outside maps against closed forms: a ball seen from all around.

use crate::common::TestContext;
use glam::Vec3;
use linklight::gpu::shaders::surface_maps::{OutsideIntervals, OutsideIntervalsParams, OutsideRays, OutsideRaysParams};
use linklight::gpu::shaders::types::{Hit, Ray};
use linklight::stages::trace::NO_HIT;

const REACH: f32 = 1.01;

/// Every direction's rays stand on a square grid across it, before and behind the ball; together they go all ways.
#[test]
fn outside_rays_cross_the_ball_along_every_direction() {
    let context = TestContext::new();
    let (directions, resolution, radius, centre) = (4, 8, 0.5, Vec3::new(1.0, -2.0, 3.0));
    let count = (3 * directions * directions) as usize;
    let pixels = (resolution * resolution) as usize;
    let rays = context.buffer::<Ray>("test/rays", 2 * count * pixels).unwrap();
    let params =
        OutsideRaysParams { centre, radius, first_direction: 0, chunk_count: count as u32, directions, resolution };
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(&OutsideRays { rays: &rays, params }, rays.len());
    recorder.submit().unwrap();
    let rays = context.download(&rays).unwrap();
    let (before, behind) = rays.split_at(count * pixels);
    let mut ways = Vec::new();
    for (k, (a, b)) in before.iter().zip(behind).enumerate() {
        assert!((a.direction + b.direction).length() < 1e-5 && (a.direction.length() - 1.0).abs() < 1e-5);
        // The two ends are one line through the ball's square, a reach from its middle either way.
        assert!((b.origin - a.origin - a.t_max * a.direction).length() < 1e-4);
        assert!(((a.origin - centre).dot(a.direction) + REACH * radius).abs() < 1e-4);
        let aside = a.origin - centre - (a.origin - centre).dot(a.direction) * a.direction;
        let (x, y) = ((k % pixels % 8) as f32, (k % pixels / 8) as f32);
        let expected = Vec3::new((x + 0.5) / 4.0 - 1.0, (y + 0.5) / 4.0 - 1.0, 0.0).length() * radius;
        assert!((aside.length() - expected).abs() < 1e-4, "{aside} for {expected}");
        if k % pixels == 0 {
            ways.push(a.direction);
        }
    }
    // Neighbours in the walk look nearly the same way, and every way lies near one of them, or its opposite.
    let turns = ways.windows(2).filter(|pair| pair[0].dot(pair[1]) > 0.8).count();
    assert!(turns >= count - 3, "{turns} small turns of {count}");
    for k in 0..200 {
        let z = 1.0 - (k as f32 + 0.5) / 100.0;
        let angle = 2.4 * k as f32;
        let way = Vec3::new((1.0 - z * z).sqrt() * angle.cos(), (1.0 - z * z).sqrt() * angle.sin(), z);
        let nearest = ways.iter().map(|other| way.dot(*other).abs()).fold(0.0, f32::max);
        assert!(nearest > 0.9, "{way}: {nearest}");
    }
}

#[test]
fn outside_intervals_reach_from_the_first_surface_to_the_last() {
    let context = TestContext::new();
    let radius = 2.0;
    // (depth of the first surface, of the last) in radii about the middle; a flat thing has one; none is free.
    let cases = [Some((-0.5, 0.25)), Some((0.3, 0.3)), None, Some((-1.0, 1.0))];
    let hit = |depth: Option<f32>| match depth {
        Some(t) => Hit { t, triangle: 3, barycentrics: glam::Vec2::ZERO },
        None => Hit { t: 0.0, triangle: NO_HIT, barycentrics: glam::Vec2::ZERO },
    };
    let before = cases.map(|case| hit(case.map(|(first, _)| (first + REACH) * radius)));
    let behind = cases.map(|case| hit(case.map(|(_, last)| (REACH - last) * radius)));
    let hits = context.upload("test/hits", &[before, behind].concat()).unwrap();
    let intervals = context.buffer::<u32>("test/intervals", cases.len()).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = OutsideIntervalsParams { pixel_count: cases.len() as u32, radius };
    recorder.dispatch(&OutsideIntervals { hits: &hits, intervals: &intervals, params }, cases.len());
    recorder.submit().unwrap();
    let code = |depth: f32| (depth / REACH * 0.5 + 0.5) * 65534.0;
    for (case, word) in cases.iter().zip(context.download(&intervals).unwrap()) {
        let (low, high) = ((word & 0xffff) as f32, (word >> 16) as f32);
        match *case {
            None => assert_eq!((low, high), (65535.0, 65535.0)),
            Some((first, last)) if first == last => assert!(low == high && (low - code(first)).abs() <= 1.0),
            Some((first, last)) => {
                assert!(low >= code(first) - 0.1 && low < code(first) + 1.1, "{low} for {}", code(first));
                assert!(high <= code(last) + 0.1 && high > code(last) - 1.1, "{high} for {}", code(last));
            }
        }
    }
}
