//! Merging, writing and gathering links, against twins.

use crate::common::{Random, TestContext};
use crate::meshes::{assert_close, points};
use crate::twins::links::{self as twins, PACKED_UNITS, RAY_UNITS};
use glam::{UVec3, Vec2, Vec3};
use linklight::gpu::Options;
use linklight::gpu::shaders::types::Hit;
use linklight::stages::elements::NO_ELEMENT;
use linklight::stages::gather;
use linklight::stages::links::{Link, LinkBuilder, LinkCounts, LinkError, LinkFormat, Links, Outcomes};
use linklight::stages::trace::{BACK_FACE, NO_HIT};

const VERTICES: u32 = 300;

/// Hits of every kind: many on few triangles, corners, edges, escapes, both sides.
struct Hits {
    hits: Vec<Hit>,
    triangles: Vec<[u32; 3]>,
    back_elements: Vec<u32>,
}

fn random_hits(random: &mut Random, count: usize, triangle_count: u32) -> Hits {
    let triangles = (0..triangle_count).map(|_| [(); 3].map(|()| random.below(VERTICES))).collect();
    // Vertices below 200 are one-sided; each triangle asks its first corner.
    let back_elements = (0..VERTICES).map(|v| if v < 200 { NO_ELEMENT } else { VERTICES + v - 200 }).collect();
    let hit = |random: &mut Random| {
        let mut b = Vec2::new(random.unit(), random.unit());
        if b.x + b.y > 1.0 {
            b = 1.0 - b;
        }
        let b = match random.below(8) {
            0 => Vec2::ZERO,
            1 => Vec2::X,
            2 => Vec2::new(b.x, 1.0 - b.x),
            _ => b,
        };
        let triangle = match random.below(10) {
            0 => NO_HIT,
            1 => random.below(triangle_count) | BACK_FACE,
            _ => random.below(triangle_count),
        };
        Hit { t: 1.0, triangle, barycentrics: b }
    };
    let mut hits: Hits = Hits { hits: (0..count).map(|_| hit(random)).collect(), triangles, back_elements };
    // A triangle seen from behind has backs at all corners or at none.
    for triangle in &mut hits.triangles {
        if triangle[0] >= 200 {
            *triangle = triangle.map(|v| 200 + v % 100);
        }
    }
    hits
}

/// Builds links in batches of `batch` from given hits.
fn build(
    context: &TestContext,
    input: &Hits,
    format: LinkFormat,
    elements: u32,
    ray_count: u32,
    batch: u32,
) -> (Links, Outcomes) {
    let triangles: Vec<UVec3> = input.triangles.iter().map(|&t| t.into()).collect();
    let triangles = context.upload("test/triangles", &triangles).unwrap();
    let back_elements = context.upload("test/backs", &input.back_elements).unwrap();
    let outcomes = Outcomes::new(context, elements, ray_count).unwrap();
    let mut builder = LinkBuilder::new(context, format, counts(elements, ray_count, batch), u64::MAX).unwrap();
    for first in (0..elements).step_by(batch as usize) {
        let range = first..elements.min(first + batch);
        let rays = |e: u32| (e * ray_count) as usize;
        let hits = context.upload("test/hits", &input.hits[rays(range.start)..rays(range.end)]).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        builder.merge(&mut recorder, range.clone(), &hits, &triangles, &back_elements, &outcomes);
        recorder.submit().unwrap();
        builder.append(context, range).unwrap();
    }
    (builder.finish(), outcomes)
}

fn counts(receivers: u32, rays: u32, batch: u32) -> LinkCounts {
    LinkCounts { receivers, senders: VERTICES + 100, rays, batch }
}

#[test]
fn rows_agree_with_their_twin_to_the_bit() {
    let context = TestContext::new();
    let mut random = Random(21);
    // (elements, rays, triangles, batch): few and many senders, a table filled to the brim, partial batches.
    let cases =
        [(0, 16, 4, 8), (1, 16, 200, 8), (63, 64, 5, 64), (64, 144, 90, 50), (65, 256, 300, 32), (5, 1024, 3000, 2)];
    for (elements, ray_count, triangle_count, batch) in cases {
        let input = random_hits(&mut random, (elements * ray_count) as usize, triangle_count);
        for format in [LinkFormat::Full, LinkFormat::Packed] {
            let (links, outcomes) = build(&context, &input, format, elements, ray_count, batch);
            let offsets = context.download(&links.offsets).unwrap();
            let device = links.download(&context).unwrap();
            let escaped = context.download(&outcomes.escaped).unwrap();
            let counts = context.download(&outcomes.counts).unwrap();
            let words = ray_count.div_ceil(32) as usize;
            assert_eq!((offsets[0], offsets.len()), (0, elements as usize + 1));
            for e in 0..elements as usize {
                let own = &input.hits[e * ray_count as usize..(e + 1) * ray_count as usize];
                let divisor = match format {
                    LinkFormat::Full => 1,
                    LinkFormat::Packed => RAY_UNITS * ray_count / PACKED_UNITS,
                };
                let twin = twins::merge_hits(own, &input.triangles, &input.back_elements, divisor);
                let row = &device[offsets[e] as usize..offsets[e + 1] as usize];
                let expected: Vec<Link> = twin
                    .entries
                    .iter()
                    .map(|&(sender, units)| {
                        let weight = match format {
                            LinkFormat::Full => units as f32 * (1.0 / (RAY_UNITS * ray_count) as f32),
                            LinkFormat::Packed => units.min(PACKED_UNITS - 1) as f32 / PACKED_UNITS as f32,
                        };
                        Link { sender, weight }
                    })
                    .collect();
                assert_eq!(row, expected, "{elements} elements, {ray_count} rays, element {e}, {format:?}");
                assert_eq!(escaped[e * words..(e + 1) * words], twin.escaped, "escaped rays of {e}");
                assert_eq!(counts[e], twin.outcome, "outcome of {e}");
            }
        }
    }
}

#[test]
fn gathering_agrees_with_its_twin_over_any_windows() {
    let mut random = Random(22);
    // The second context cuts the list into windows of at most 64 KiB.
    for limit in [None, Some(1 << 16)] {
        let context = TestContext::with(Options { max_storage_buffer_bytes: limit, ..Options::default() });
        for elements in [1, 63, 64, 65, 257] {
            let input = random_hits(&mut random, (elements * 64) as usize, 400);
            let mut radiosity: Vec<Vec3> = points(&mut random, VERTICES + 100).iter().map(|b| b.abs()).collect();
            (radiosity[0], radiosity[1]) = (Vec3::ZERO, Vec3::new(3.9999998, 1e-12, 0.0));
            for format in [LinkFormat::Full, LinkFormat::Packed] {
                let (links, _) = build(&context, &input, format, elements, 64, 16);
                assert!(elements < 257 || limit.is_none() || links.window_count() > 1, "several windows");
                let sent = context.upload("test/radiosity", &radiosity).unwrap();
                let irradiance = context.buffer::<Vec3>("test/irradiance", elements as usize).unwrap();
                let mut recorder = context.recorder("test").unwrap();
                gather::over_links(&mut recorder, &links, &sent, &irradiance);
                recorder.submit().unwrap();
                let offsets = context.download(&links.offsets).unwrap();
                let plain = links.download(&context).unwrap();
                // What is sent is rounded by half a unit of the brightest channel: below 4, and weights sum to 1.
                let (bits, rounding) = match format {
                    LinkFormat::Full => (18, 4.0 / (1 << 18) as f32),
                    LinkFormat::Packed => (8, 4.0 / (1 << 8) as f32),
                };
                let device = context.download(&irradiance).unwrap();
                let exact = twins::gather(&offsets, &plain, &radiosity);
                assert_close("gather", &device, &exact, 0.5 * rounding + 1e-6, 1e-5);
                let rounded: Vec<Vec3> = radiosity.iter().map(|b| twins::shared_exponent(*b, bits)).collect();
                let twin = twins::gather(&offsets, &plain, &rounded);
                assert_close("gather of rounded radiosity", &device, &twin, 1e-6, 1e-5);
            }
        }
    }
}

#[test]
fn what_does_not_fit_is_refused_with_figures() {
    let context = TestContext::new();
    let mut random = Random(23);
    let input = random_hits(&mut random, 64 * 64, 400);
    let triangles: Vec<UVec3> = input.triangles.iter().map(|&t| t.into()).collect();
    let triangles = context.upload("test/triangles", &triangles).unwrap();
    let back_elements = context.upload("test/backs", &input.back_elements).unwrap();
    let hits = context.upload("test/hits", &input.hits).unwrap();
    let outcomes = Outcomes::new(&context, 64, 64).unwrap();
    let mut builder = LinkBuilder::new(&context, LinkFormat::Full, counts(64, 64, 32), 20_000).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    builder.merge(&mut recorder, 0..32, &hits, &triangles, &back_elements, &outcomes);
    recorder.submit().unwrap();
    match builder.append(&context, 0..32) {
        Err(error @ LinkError::OutOfMemory { needed, available, counted: 32, element_count: 64, .. }) => {
            assert!(needed > available && available == 20_000, "{needed} of {available}");
            assert!(error.to_string().contains("rays_per_element"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    let too_many = LinkCounts { senders: (1 << 20) + 1, ..counts(1, 16, 1) };
    let refused = LinkBuilder::new(&context, LinkFormat::Packed, too_many, u64::MAX).err().unwrap();
    assert!(refused.to_string().contains("packed_links=false"), "{refused}");
}
