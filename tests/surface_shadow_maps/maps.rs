//! Maps: every compressed answer is the uncompressed one, on the host and on the device; ratios; the cache.

use crate::common::scenes::{lambert, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, builtin_scene, options};
use glam::Vec3;
use linklight::gpu::shaders::types::SurfaceMapQuery;
use linklight::scene::Material;
use linklight::scene::environment::Environment;
use linklight::stages::surface_maps::{
    Interval, MapFilter, MapOptions, MapUntil, RunLayout, Sequence, SurfaceMapError, SurfaceMaps, sequence,
    uncompressed,
};
use linklight::stages::work::{Interrupted, Unwatched, Watch};

const SEQUENCES: [Sequence; 3] = [Sequence::Greedy, Sequence::ZigZag, Sequence::Spiral];
/// With the one that looks at the maps.
const ALL: [Sequence; 4] = [Sequence::Greedy, Sequence::ZigZag, Sequence::Spiral, Sequence::Sight];

/// The first depth that its interval does not hold.
fn first_wrong(maps: &SurfaceMaps, intervals: &[Interval]) -> Option<(usize, usize)> {
    let pixels = maps.maps.pixel_count();
    let count = intervals.len() / pixels;
    (0..count)
        .flat_map(|place| (0..pixels).map(move |pixel| (place, pixel)))
        .find(|&(place, pixel)| !intervals[place * pixels + pixel].contains(maps.maps.depth(place as u32, pixel)))
}

#[test]
fn every_compressed_depth_answers_like_the_uncompressed_map() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), &Environment::default());
    let atlas = fixture.atlas(32);
    for (walk, until) in ALL.into_iter().flat_map(|walk| [(walk, MapUntil::Next), (walk, MapUntil::Lit)]) {
        let options = |resolution, walk| MapOptions { until, ..options(resolution, walk) };
        let input = fixture.map_input(&atlas, None);
        let maps = SurfaceMaps::new(&context, input, options(8, walk), &Unwatched).unwrap();
        let mut order: Vec<u32> = (0..atlas.texels.len() as u32).collect();
        order.sort_by_key(|&texel| maps.places[texel as usize]);
        assert_eq!(order == sequence::walk(&atlas, walk), walk != Sequence::Sight);
        let intervals = uncompressed(&context, input, options(8, walk), &order, &Unwatched).unwrap();
        assert_eq!(intervals.len(), order.len() * maps.maps.pixel_count());
        println!("{walk:?}, {until:?}: {} texels, {:.2} : 1", order.len(), maps.ratio());
        assert_eq!(first_wrong(&maps, &intervals), None);
        let mut other = order.clone();
        other.reverse();
        let reversed = uncompressed(&context, input, options(8, walk), &other, &Unwatched).unwrap();
        assert!(first_wrong(&maps, &reversed).is_some(), "a wrong order would go unnoticed");
    }
}

/// Points just before and just behind what a pixel of a map at a place may hold, seen and not.
struct Asked {
    queries: Vec<SurfaceMapQuery>,
    expected: Vec<f32>,
}

impl Asked {
    /// Of the pixels at places that `choose` gives.
    fn new(
        context: &TestContext,
        maps: &SurfaceMaps,
        intervals: &[Interval],
        choose: impl Iterator<Item = (u32, u32)>,
    ) -> Self {
        let origins: Vec<Vec3> = context.download(&maps.origins).unwrap();
        let mut asked = Self { queries: Vec::new(), expected: Vec::new() };
        for (place, pixel) in choose {
            let interval = intervals[place as usize * maps.maps.pixel_count() + pixel as usize];
            if interval == Interval::ANY {
                continue;
            }
            let direction = direction(pixel, maps.options.resolution);
            // Codes at the ends of the interval, moved by more than rounding.
            for (is_seen, code) in [(1.0, f32::from(interval.low) - 0.5), (0.0, f32::from(interval.high) + 1.5)] {
                if (20.0..=65_000.0).contains(&code) {
                    let point = origins[place as usize] + direction * (code / maps.codes_per_metre);
                    asked.queries.push(SurfaceMapQuery { point, normal: direction, place });
                    asked.expected.push(is_seen);
                }
            }
        }
        assert!(asked.expected.iter().filter(|&&seen| seen == 0.0).count() * 20 > asked.expected.len());
        asked
    }

    /// How many answers of the device are not what is expected.
    fn wrong(&self, context: &TestContext, maps: &SurfaceMaps, filter: MapFilter) -> usize {
        let buffer = context.upload("test/queries", &self.queries).unwrap();
        let visibility = context.buffer("test/visibility", self.queries.len()).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        maps.query(&mut recorder, &buffer, &visibility, self.queries.len(), filter);
        recorder.submit().unwrap();
        let got = context.download(&visibility).unwrap();
        let wrong = got.iter().zip(&self.expected).filter(|(got, expected)| (**got - **expected).abs() > 1e-3).count();
        println!("filter {filter:?}: {wrong} of {} answers differ", self.queries.len());
        wrong
    }
}

/// On the device: points on the near side of the first surface are seen, those on the far side of the second are not;
/// through every pixel of every map of a small scene.
#[test]
fn queries_on_the_device_agree_with_the_intervals() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), &Environment::default());
    let atlas = fixture.atlas(32);
    let options = options(8, Sequence::Spiral);
    let order = sequence::walk(&atlas, Sequence::Spiral);
    let input = fixture.map_input(&atlas, None);
    let mut maps = SurfaceMaps::new(&context, input, options, &Unwatched).unwrap();
    let intervals = uncompressed(&context, input, options, &order, &Unwatched).unwrap();
    let pixels = maps.maps.pixel_count() as u32;
    let all = (0..order.len() as u32).flat_map(|place| (0..pixels).map(move |pixel| (place, pixel)));
    let asked = Asked::new(&context, &maps, &intervals, all);
    for layout in RunLayout::ALL {
        maps.repack(&context, layout).unwrap();
        // At the middle of a pixel no other counts.
        for filter in [MapFilter::None, MapFilter::Four] {
            assert_eq!(asked.wrong(&context, &maps, filter), 0, "{layout:?}");
        }
    }
    let mut spoilt = asked;
    spoilt.queries.iter_mut().for_each(|query| query.place = (query.place + 40) % order.len() as u32);
    assert!(spoilt.wrong(&context, &maps, MapFilter::None) > 1000, "another texel's answers would go unnoticed");
}

/// The same of a scene with many charts, sampled.
#[test]
fn queries_of_a_large_scene_agree_with_the_intervals() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("maze"), &Environment::default());
    let atlas = fixture.atlas(128);
    let options = options(6, Sequence::Spiral);
    let order = sequence::walk(&atlas, Sequence::Spiral);
    let input = fixture.map_input(&atlas, None);
    let mut maps = SurfaceMaps::new(&context, input, options, &Unwatched).unwrap();
    let intervals = uncompressed(&context, input, options, &order, &Unwatched).unwrap();
    assert!(order.len() > 5000 && first_wrong(&maps, &intervals).is_none());
    let random = &mut Random(17);
    let pixels = maps.maps.pixel_count() as u32;
    let some = std::iter::repeat_with(|| (random.below(order.len() as u32), random.below(pixels)));
    let asked = Asked::new(&context, &maps, &intervals, some.take(40_000));
    for layout in RunLayout::ALL {
        maps.repack(&context, layout).unwrap();
        assert_eq!(asked.wrong(&context, &maps, MapFilter::None), 0, "{layout:?}");
    }
}

/// Drawn filtering is the filter over all four pixels in the mean.
#[test]
fn drawn_pixels_are_the_filter_in_the_mean() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), &Environment::default());
    let atlas = fixture.atlas(32);
    let input = fixture.map_input(&atlas, None);
    let maps = SurfaceMaps::new(&context, input, options(8, Sequence::Spiral), &Unwatched).unwrap();
    let origins: Vec<Vec3> = context.download(&maps.origins).unwrap();
    let random = &mut Random(23);
    let count = 40_000;
    let queries: Vec<SurfaceMapQuery> = (0..count)
        .map(|_| {
            let place = random.below(atlas.texels.len() as u32);
            let other = origins[random.below(atlas.texels.len() as u32) as usize];
            let spread = Vec3::new(random.unit(), random.unit(), random.unit()) - 0.5;
            SurfaceMapQuery { point: other + 0.2 * spread, normal: spread.normalize(), place }
        })
        .collect();
    let buffer = context.upload("test/queries", &queries).unwrap();
    let visibility = context.buffer("test/visibility", queries.len()).unwrap();
    let mut run = |filter| {
        let mut recorder = context.recorder("test").unwrap();
        maps.query(&mut recorder, &buffer, &visibility, queries.len(), filter);
        recorder.submit().unwrap();
        context.download(&visibility).unwrap()
    };
    let [none, drawn, four] = [MapFilter::None, MapFilter::Drawn, MapFilter::Four].map(&mut run);
    assert!(drawn.iter().all(|&v| v == 0.0 || v == 1.0) && drawn != none);
    let mean = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
    // Where all four agree, the drawn one agrees with them.
    assert!(
        drawn.iter().zip(&four).all(|(&drawn, &four)| (drawn > 0.5 || four < 0.9999) && (drawn < 0.5 || four > 1e-4))
    );
    println!("seen in the mean: drawn {:.4}, all four {:.4}, unfiltered {:.4}", mean(&drawn), mean(&four), mean(&none));
    // Three standard errors of a mean of coin tosses.
    assert!((mean(&drawn) - mean(&four)).abs() < 1.5 / (count as f64).sqrt());
}

/// Through the middle of a pixel; the twin of `cube_pixel_direction`.
fn direction(pixel: u32, resolution: u32) -> Vec3 {
    let (face, within) = (pixel / (resolution * resolution), pixel % (resolution * resolution));
    let at = |k: u32| (k as f32 + 0.5) * 2.0 / resolution as f32 - 1.0;
    let (x, y) = (at(within % resolution), at(within / resolution));
    let s = if face % 2 == 0 { 1.0 } else { -1.0 };
    match face / 2 {
        0 => Vec3::new(s, x, y),
        1 => Vec3::new(x, s, y),
        _ => Vec3::new(x, y, s),
    }
    .normalize()
}

/// Beside [Ritschel2008 Table 2]: 7.4, 11.7, 16.9 : 1 along spirals at 32, 64 and 128 texels a side.
#[test]
fn charts_compress_better_than_greedy_walks_and_more_so_when_finer() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), &Environment::default());
    let mut before = 0.0;
    for resolution in [32, 64] {
        let atlas = fixture.atlas(resolution);
        let ratio = |walk| {
            let input = fixture.map_input(&atlas, None);
            SurfaceMaps::new(&context, input, options(8, walk), &Unwatched).unwrap().ratio()
        };
        let [greedy, zig_zag, spiral] = SEQUENCES.map(ratio);
        println!(
            "{resolution} x {resolution} texels: greedy {greedy:.2}, zig-zag {zig_zag:.2}, spiral {spiral:.2} : 1"
        );
        assert!(spiral > greedy && spiral > zig_zag, "{greedy} {zig_zag} {spiral}");
        assert!(spiral > before, "{spiral} after {before}");
        before = spiral;
    }
}

/// Where charts are of few texels, an order by what their maps see holds depths for longer than any walk within charts.
#[test]
fn small_charts_compress_better_by_sight() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("office"), &Environment::default());
    let atlas = fixture.atlas(64);
    let ratio = |walk| {
        let maps = SurfaceMaps::new(&context, fixture.map_input(&atlas, None), options(16, walk), &Unwatched).unwrap();
        maps.ratio()
    };
    let [spiral, sight] = [Sequence::Spiral, Sequence::Sight].map(ratio);
    let (texels, charts) = (atlas.texels.len(), atlas.chart_count);
    println!("{texels} texels in {charts} charts: spiral {spiral:.2}, sight {sight:.2} : 1");
    assert!(sight > 1.1 * spiral, "{sight} and {spiral}");
}

/// Pixels below a map's plane are open, and any depth may stand there, but not where a point hardly above the plane, at the
/// foot of a wall, is filtered over them.
#[test]
fn pixels_across_the_plane_of_a_map_tell_what_is_above_it() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 1, 0);
    let wall = parallelogram(Vec3::new(2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::Y * 2.0, 1, 0);
    let material = Material { double_sided: false, ..lambert(Vec3::splat(0.7)) };
    let fixture = Fixture::new(&context, scene(vec![material], vec![floor, wall], &[]), &Environment::default());
    let atlas = fixture.atlas(32);
    let input = fixture.map_input(&atlas, None);
    let maps = SurfaceMaps::new(&context, input, options(16, Sequence::Spiral), &Unwatched).unwrap();
    let (point, normal) = (Vec3::new(2.0, 0.01, 0.0), Vec3::NEG_X);
    let floor = atlas.texels.iter().zip(&maps.places).filter(|(texel, _)| texel.normal.y > 0.9);
    let central = floor.filter(|(texel, _)| texel.position.length() < 1.0);
    let queries: Vec<SurfaceMapQuery> = central.map(|(_, &place)| SurfaceMapQuery { point, normal, place }).collect();
    let buffer = context.upload("test/queries", &queries).unwrap();
    let visibility = context.buffer("test/visibility", queries.len()).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    maps.query(&mut recorder, &buffer, &visibility, queries.len(), MapFilter::Four);
    recorder.submit().unwrap();
    let seen: Vec<f32> = context.download(&visibility).unwrap();
    let hidden = seen.iter().filter(|&&seen| seen < 0.999).count();
    println!("{hidden} of {} are hidden", seen.len());
    assert!(seen.len() > 20 && hidden == 0, "{hidden}");
}

/// Wants no more work after so many steps.
struct Stops(std::cell::Cell<u32>);

impl Watch for Stops {
    fn step(&self, _: &str, _: u64, _: u64) -> Result<(), Interrupted> {
        self.0.set(self.0.get().saturating_sub(1));
        if self.0.get() == 0 { Err(Interrupted) } else { Ok(()) }
    }
}

#[test]
fn maps_are_kept_whole_or_not_at_all() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), &Environment::default());
    let atlas = fixture.atlas(32);
    let folder = tempfile::tempdir().unwrap();
    let input = fixture.map_input(&atlas, Some(folder.path()));
    let make =
        |resolution, watch: &dyn Watch| SurfaceMaps::new(&context, input, options(resolution, Sequence::ZigZag), watch);
    let files = || std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().path()).collect::<Vec<_>>();

    let stopped = make(32, &Stops(2.into()));
    assert!(matches!(stopped, Err(SurfaceMapError::Interrupted(_))));
    assert!(files().is_empty(), "an interrupted run leaves nothing");

    let first = make(8, &Unwatched).unwrap();
    assert!(first.ray_count > 0);
    let again = make(8, &Unwatched).unwrap();
    assert!(again.ray_count == 0 && again.maps == first.maps, "read from disk");
    assert!(make(10, &Unwatched).unwrap().ray_count > 0, "other settings, other maps");
    assert_eq!(files().len(), 2);

    for file in files() {
        let mut bytes = std::fs::read(&file).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x10;
        std::fs::write(&file, bytes).unwrap();
    }
    let rebuilt = make(8, &Unwatched).unwrap();
    assert!(rebuilt.ray_count > 0 && rebuilt.maps == first.maps, "a damaged file is replaced");
    assert_eq!(make(8, &Unwatched).unwrap().ray_count, 0);
}
