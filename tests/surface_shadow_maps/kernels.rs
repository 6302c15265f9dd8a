//! Kernels of the maps and of the solution against plain loops, each shown to tell a wrong result.

use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, builtin_scene};
use glam::{Vec2, Vec3};
use linklight::gpu::shaders::methods::surface_shadow_maps::{Emit, EmitParams, Reflect, ReflectParams};
use linklight::gpu::shaders::surface_maps::{
    CubeRays, CubeRaysParams, Intervals, IntervalsParams, SecondRays, SecondRaysParams,
};
use linklight::gpu::shaders::types::{Hit, Ray};
use linklight::scene::environment::Environment;
use linklight::stages::texels::Texels;
use linklight::stages::trace::NO_HIT;
use std::f32::consts::PI;

fn vectors(random: &mut Random, count: usize) -> Vec<Vec3> {
    (0..count).map(|_| Vec3::new(random.unit(), random.unit(), random.unit())).collect()
}

#[test]
fn texels_emit_and_reflect_as_plain_loops_do() {
    let context = TestContext::new();
    let random = &mut Random(3);
    for count in [1, 63, 65, 1009] {
        // One more than there are texels: it stays as it is.
        let [emission, irradiance, albedo, before, indirect] = [(); 5].map(|()| vectors(random, count + 1));
        let upload = |values: &[Vec3]| context.upload("test/values", values).unwrap();
        let (emission_buffer, emitted) = (upload(&emission), upload(&vec![Vec3::NAN; count + 1]));
        let (irradiance_buffer, albedo_buffer, reflected) = (upload(&irradiance), upload(&albedo), upload(&before));
        let (reflected_sum, indirect_sum) = (upload(&before), upload(&indirect));
        let texel_count = count as u32;
        let mut recorder = context.recorder("test").unwrap();
        let params = EmitParams { texel_count };
        recorder.dispatch(&Emit { emission: &emission_buffer, emitted: &emitted, params }, count);
        for is_indirect in [1, 0] {
            let pass = Reflect {
                irradiance: &irradiance_buffer,
                even_albedo: &albedo_buffer,
                reflected: &reflected,
                reflected_sum: &reflected_sum,
                indirect: &indirect_sum,
                params: ReflectParams { texel_count, is_indirect },
            };
            recorder.dispatch(&pass, count);
        }
        recorder.submit().unwrap();
        let near =
            |got: Vec3, expected: Vec3| (got - expected).abs().max_element() <= 1e-6 * (1.0 + expected.max_element());
        let [emitted, reflected, sum, indirect_sum] =
            [emitted, reflected, reflected_sum, indirect_sum].map(|buffer| context.download(&buffer).unwrap());
        for i in 0..count {
            assert!(near(emitted[i], PI * emission[i]));
            let once = albedo[i] * irradiance[i];
            assert!(near(reflected[i], once) && near(sum[i], before[i] + 2.0 * once), "{} for {once}", sum[i]);
            assert!(near(indirect_sum[i], indirect[i] + irradiance[i]), "direct light is no indirect one");
            assert!(!near(sum[i], before[i] + once + 1e-3));
        }
        let rest = [reflected[count], sum[count], indirect_sum[count]];
        assert!(emitted[count].is_nan() && rest == [before[count], before[count], indirect[count]], "{rest:?}");
    }
}

/// Points that texels receive at lie on their own surface: each part's triangle has its centroid, the sides of the scene's
/// triangle made smaller, and its area where that fits.
#[test]
fn shapes_of_parts_are_their_triangles_made_smaller() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), &Environment::default());
    let atlas = fixture.atlas(24);
    let texels = Texels::new(&context, &atlas, &fixture.world, 1e-3).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    texels.update_shapes(&mut recorder, &fixture.world);
    recorder.submit().unwrap();
    let shapes = context.download(&texels.shapes).unwrap();
    let (points, _) = atlas.part_points(&fixture.geometry, &fixture.positions);
    let (mut cut, mut full) = (0, 0);
    for (index, texel) in atlas.texels.iter().enumerate() {
        let parts = atlas.parts_of(index);
        let all: f32 = parts.iter().map(|part| part.area).sum();
        let mut until = 0.0;
        for (part, k) in parts.iter().zip(texel.first_part as usize..) {
            let [a, b, c] = fixture.geometry.triangles[part.triangle as usize].map(|v| fixture.positions[v as usize]);
            let (shape, area) = (shapes[k], 0.5 * (b - a).cross(c - a).length());
            until += part.area / all;
            assert!(shape.centre.distance(points[k]) < 1e-5 && (shape.until - until).abs() < 1e-5, "part {k}");
            let [x, y] = part.barycentrics.to_array();
            let (ratio, most) = ((part.area / area).sqrt(), 3.0 * x.min(y).min(1.0 - x - y));
            let ratio = ratio.min(most);
            // All three corners lie on the triangle, up to rounding.
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
                let at = [x + (u - 1.0 / 3.0) * ratio, y + (v - 1.0 / 3.0) * ratio];
                assert!(at[0] > -1e-5 && at[1] > -1e-5 && at[0] + at[1] < 1.0 + 1e-5, "part {k}: {at:?}");
            }
            full += u32::from(ratio < most);
            assert!(shape.edge_u.distance(ratio * (b - a)) < 1e-4 && shape.edge_v.distance(ratio * (c - a)) < 1e-4);
            cut += u32::from(ratio < 0.9);
        }
    }
    assert!(full > 100, "{full} parts keep their area");
    assert!(cut > 100, "whole triangles alone would tell nothing of the scale");
}

/// Through the middle of a pixel.
fn direction(pixel: u32, resolution: u32) -> Vec3 {
    let (face, within) = (pixel / (resolution * resolution), pixel % (resolution * resolution));
    let at = |k: u32| (k as f32 + 0.5) * 2.0 / resolution as f32 - 1.0;
    let (x, y) = (at(within % resolution), at(within / resolution));
    let s = if face % 2 == 0 { 1.0 } else { -1.0 };
    [Vec3::new(s, x, y), Vec3::new(x, s, y), Vec3::new(x, y, s)][face as usize / 2].normalize()
}

/// Where the ray of a pixel of a map that faces `normal` goes, if a point can be looked up in it: the twin of `map_pixel_ray`.
/// A point is filtered over pixels up to a width off: of the square of such places the pixel's middle looks, or what lies
/// between the plane and the highest corner.
fn pixel_ray(pixel: u32, resolution: u32, normal: Vec3) -> Option<Vec3> {
    let middle = direction(pixel, resolution);
    if middle.dot(normal) > 0.0 {
        return Some(middle);
    }
    let axis = (pixel / (2 * resolution * resolution)) as usize;
    let middle = middle / middle[axis].abs();
    let width = 2.0 / resolution as f32;
    let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| {
        let mut step = Vec3::ZERO;
        (step[(axis + 1) % 3], step[(axis + 2) % 3]) = (x * width, y * width);
        middle + step
    });
    let highest = corners.into_iter().max_by(|a, b| a.dot(normal).total_cmp(&b.dot(normal)))?;
    let (low, high) = (middle.dot(normal), highest.dot(normal));
    let crossing = middle + (highest - middle) * (-low / (high - low));
    (high > 0.0).then(|| (0.5 * (crossing + highest)).normalize())
}

/// What a pixel may hold, codes; the twin of `surface_maps/intervals`.
fn interval(above: bool, first: Option<f32>, second: Option<f32>, codes: f32, bias: f32) -> (u32, u32) {
    let (true, Some(first)) = (above, first) else { return if above { (65_534, 65_535) } else { (0, 65_535) } };
    let (first, farthest) = (first * codes, 65_534.0f32);
    let off = bias * first;
    let mut low = (first + off).ceil() + 1.0;
    let mut high = 65_535.0;
    if let Some(second) = second.map(|second| second * codes) {
        high = (second - off).floor() - 1.0;
        if high < low {
            high = (0.5 * (first + second)).floor();
            low = high;
        }
    }
    low = low.min(if high == 65_535.0 { farthest } else { high });
    (low.clamp(0.0, farthest) as u32, high.clamp(0.0, 65_535.0) as u32)
}

#[test]
fn rays_of_maps_and_what_they_tell_are_those_of_plain_loops() {
    let context = TestContext::new();
    let random = &mut Random(8);
    let (resolution, places, codes, bias, gap) = (6, 3, 1000.0, 0.3, 0.01);
    let pixels = 6 * resolution * resolution;
    let (first_place, chunk_count) = (1, 2);
    let origins = vectors(random, places);
    let normals: Vec<Vec3> = vectors(random, places).iter().map(|v| (*v - 0.5).normalize()).collect();
    let count = (chunk_count * pixels) as usize;
    let [map_origins, map_normals] = [&origins, &normals].map(|v| context.upload("test/places", v).unwrap());
    let rays = context.buffer::<Ray>("test/rays", count).unwrap();
    let hit = |t: Option<f32>| Hit { t: t.unwrap_or(9e9), triangle: t.map_or(NO_HIT, |_| 2), barycentrics: Vec2::ZERO };
    let firsts: Vec<Option<f32>> =
        (0..count).map(|k| (k % 7 != 0).then(|| 0.01 + 20.0 * random.unit() * random.unit())).collect();
    let seconds: Vec<Option<f32>> = firsts
        .iter()
        .map(|first| first.filter(|_| random.below(3) > 0).map(|t| t * (1.0 + 0.2 * random.unit())))
        .collect();
    let hits = context.upload("test/hits", &firsts.iter().map(|&t| hit(t)).collect::<Vec<_>>()).unwrap();
    let second_hits = context.upload("test/second hits", &seconds.iter().map(|&t| hit(t)).collect::<Vec<_>>()).unwrap();
    let intervals = context.buffer::<u32>("test/intervals", count).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = CubeRaysParams { first_place, chunk_count, resolution };
    recorder.dispatch(&CubeRays { map_origins: &map_origins, map_normals: &map_normals, rays: &rays, params }, count);
    recorder.submit().unwrap();
    let first_rays = context.download(&rays).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = SecondRaysParams { ray_count: count as u32, gap };
    recorder.dispatch(&SecondRays { hits: &hits, rays: &rays, params }, count);
    let params = IntervalsParams { first_place, chunk_count, resolution, codes_per_metre: codes, bias };
    let pass =
        Intervals { map_normals: &map_normals, hits: &hits, second_hits: &second_hits, intervals: &intervals, params };
    recorder.dispatch(&pass, count);
    recorder.submit().unwrap();
    let (second_rays, intervals) = (context.download(&rays).unwrap(), context.download(&intervals).unwrap());
    let (mut differ, mut turned) = (0, 0);
    for k in 0..count {
        let (place, pixel) = (1 + k / pixels as usize, k as u32 % pixels);
        let way = pixel_ray(pixel, resolution, normals[place]);
        let above = way.is_some();
        turned += u32::from(way.is_some_and(|way| way != direction(pixel, resolution)));
        let ray = first_rays[k];
        assert!(ray.origin == origins[place] && ray.t_min == 0.0);
        assert!(way.is_none_or(|way| ray.direction.distance(way) < 1e-5 && way.dot(normals[place]) > 0.0));
        assert_eq!(ray.t_max > 1e38, above);
        let next = second_rays[k];
        assert_eq!(next.t_max < 0.0, !above || firsts[k].is_none());
        if let (true, Some(t)) = (above, firsts[k]) {
            assert!((next.t_min - t - gap).abs() < 1e-4 && next.t_min > t);
        }
        let expected = interval(above, firsts[k], seconds[k], codes, bias * 2.0 / resolution as f32);
        let got = (intervals[k] & 0xffff, intervals[k] >> 16);
        // Rounding may turn a code; not more.
        assert!(got.0.abs_diff(expected.0) <= 1 && got.1.abs_diff(expected.1) <= 1, "{got:?} for {expected:?}");
        differ += u32::from(got != interval(above, firsts[k], None, codes, bias * 2.0 / resolution as f32));
    }
    assert!(differ > 20, "a twin blind to second surfaces would pass");
    assert!(turned > 20, "a twin blind to pixels across the plane would pass");
}
