//! What a map tells of a point of a surface, beside a plain twin: through one pixel and through the four around.

use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, builtin_scene, options};
use glam::Vec3;
use linklight::gpu::shaders::surface_maps::{Query, QueryParams};
use linklight::gpu::shaders::types::SurfaceMapQuery;
use linklight::scene::environment::Environment;
use linklight::stages::surface_maps::{MapFilter, Sequence, SurfaceMaps};
use linklight::stages::work::Unwatched;

const RESOLUTION: u32 = 8;

/// How rays after looking up are told apart from what maps tell, and how far the plane of a point counts.
#[derive(Clone, Copy)]
struct Rules {
    near_share: f64,
    farthest_plane: f64,
}

/// The face that `d` goes through, and where on it, in pixels.
fn place_of(d: [f64; 3]) -> (usize, [f64; 2]) {
    let axis = (0..3).max_by(|&a, &b| d[a].abs().total_cmp(&d[b].abs())).unwrap();
    let others = [[1, 2], [0, 2], [0, 1]][axis];
    (2 * axis + usize::from(d[axis] < 0.0), others.map(|k| (d[k] / d[axis].abs() + 1.0) * 0.5 * f64::from(RESOLUTION)))
}

/// Unit, through the middle of a pixel.
fn direction_of(face: usize, at: [usize; 2]) -> [f64; 3] {
    let [x, y] = at.map(|k| (k as f64 + 0.5) * 2.0 / f64::from(RESOLUTION) - 1.0);
    let s = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    let [a, b, c] = [[s, x, y], [x, s, y], [x, y, s]][face / 2];
    let length = (a * a + b * b + c * c).sqrt();
    [a / length, b / length, c / length]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// One query beside the maps that are asked.
struct Look<'a> {
    maps: &'a SurfaceMaps,
    place: u32,
    to: [f64; 3],
    normal: [f64; 3],
}

impl Look<'_> {
    /// Whether the pixel sees the point; nothing where rounding decides.
    fn pixel(&self, rules: Rules, face: usize, at: [usize; 2]) -> Option<bool> {
        let distance = dot(self.to, self.to).sqrt();
        let along = dot(self.normal, self.to) / dot(self.normal, direction_of(face, at));
        let off = (along - distance).abs() / (rules.farthest_plane / f64::from(RESOLUTION) * distance);
        let along = if off <= 1.0 { along } else { distance };
        let side = RESOLUTION as usize;
        let depth = f64::from(self.maps.maps.depth(self.place, face * side * side + at[1] * side + at[0]));
        let code = (along * (1.0 - rules.near_share) * f64::from(self.maps.codes_per_metre)).min(65_533.0);
        let is_sure = (off - 1.0).abs() > 1e-3 && (code - depth).abs() > 0.5;
        is_sure.then_some(code <= depth)
    }

    /// 0..1.
    fn seen(&self, rules: Rules, filter: MapFilter) -> Option<f64> {
        let (face, at) = place_of(self.to);
        let lies_inside = |x: &f64| (0.001..0.999).contains(&x.fract());
        let share = |seen: bool| f64::from(u8::from(seen));
        if filter == MapFilter::None {
            let pixel = at.map(|x| x as usize);
            return self.pixel(rules, face, pixel).filter(|_| at.iter().all(lies_inside)).map(share);
        }
        // Beyond the outer pixels' middles they stand for what lies over the edge.
        let at = at.map(|x| (x - 0.5).clamp(0.0, f64::from(RESOLUTION) - 1.0));
        let low = at.map(|x| (x as usize).min(RESOLUTION as usize - 2));
        let [u, v] = [0, 1].map(|k| at[k] - low[k] as f64);
        let corners =
            [([0, 0], (1.0 - u) * (1.0 - v)), ([1, 0], u * (1.0 - v)), ([0, 1], (1.0 - u) * v), ([1, 1], u * v)];
        let some = corners.iter().filter(|(_, weight)| *weight > 0.0);
        some.map(|(step, weight)| {
            self.pixel(rules, face, [low[0] + step[0], low[1] + step[1]]).map(|seen| weight * share(seen))
        })
        .sum()
    }
}

fn unit_vector(random: &mut Random) -> Vec3 {
    let mut part = || 2.0 * random.unit() - 1.0;
    Vec3::new(part(), part(), part()).normalize_or(Vec3::X)
}

#[test]
fn look_ups_are_those_of_a_plain_twin() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), &Environment::default());
    let atlas = fixture.atlas(32);
    let input = fixture.map_input(&atlas, None);
    let maps = SurfaceMaps::new(&context, input, options(RESOLUTION, Sequence::Spiral), &Unwatched).unwrap();
    let origins: Vec<Vec3> = context.download(&maps.origins).unwrap();
    let random = &mut Random(31);
    // Points on and off other surfaces, and the normals they may have.
    let queries: Vec<SurfaceMapQuery> = (0..60_000)
        .map(|_| {
            let place = random.below(origins.len() as u32);
            let point = origins[random.below(origins.len() as u32) as usize] + 0.05 * unit_vector(random);
            SurfaceMapQuery { point, normal: unit_vector(random), place }
        })
        .collect();
    let buffer = context.upload("test/queries", &queries).unwrap();
    let visibility = context.buffer("test/visibility", queries.len()).unwrap();
    for near_share in [0.0, 0.25, 1.0] {
        for filter in [MapFilter::None, MapFilter::Four] {
            let mut frame = maps.frame(filter, MapFilter::None);
            frame.near_share = near_share;
            let pass = Query {
                queries: &buffer,
                map_origins: &maps.origins,
                run_offsets: &maps.run_offsets,
                runs: &maps.runs,
                visibility: &visibility,
                params: QueryParams { query_count: queries.len() as u32, frame },
            };
            let mut recorder = context.recorder("test").unwrap();
            recorder.dispatch(&pass, queries.len());
            recorder.submit().unwrap();
            let got: Vec<f32> = context.download(&visibility).unwrap();
            // How many are sure, and how many of those differ.
            let wrong = |rules: Rules| {
                let twins = queries.iter().zip(&got).filter_map(|(query, got)| {
                    let to = (query.point - origins[query.place as usize]).as_dvec3().to_array();
                    let normal = query.normal.as_dvec3().to_array();
                    let look = Look { maps: &maps, place: query.place, to, normal };
                    look.seen(rules, filter).map(|twin| (twin - f64::from(*got)).abs() > 2e-3)
                });
                twins.fold((0, 0), |(sure, wrong), differs| (sure + 1, wrong + usize::from(differs)))
            };
            let rules = Rules { near_share: f64::from(near_share), farthest_plane: 16.0 };
            let (sure, differ) = wrong(rules);
            println!("{filter:?}, near share {near_share}: {differ} of {sure} differ");
            assert!(sure > 40_000 && differ == 0);
            // With everything near, nothing is told.
            if near_share < 1.0 {
                let planes = wrong(Rules { farthest_plane: 12.0, ..rules }).1;
                let shares = wrong(Rules { near_share: rules.near_share + 0.1, ..rules }).1;
                println!("with another plane {planes}, another share {shares}");
                assert!(planes > 5 && shares > 100);
            }
        }
    }
}
