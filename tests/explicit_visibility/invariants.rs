//! What holds of the links of any scene.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene};
use linklight::gpu::Options;
use linklight::methods::explicit_visibility::{ExplicitError, ExplicitVisibility, Settings};

/// Checks rows and returns (links, lightest, heaviest row sum).
fn validate(context: &TestContext, method: &ExplicitVisibility, slack: f32) -> (usize, f32, f32) {
    let links = method.links();
    let offsets = context.download(&links.offsets).unwrap();
    let all = links.download(context).unwrap();
    let counts = context.download(&method.outcomes().counts).unwrap();
    let ray_count = method.settings().rays_per_element.get();
    assert!(offsets.is_sorted(), "offsets rise");
    assert_eq!((offsets[0], *offsets.last().unwrap() as usize), (0, all.len()));
    assert_eq!(all.len(), links.link_count as usize);
    let (mut least, mut most) = (f32::MAX, f32::MIN);
    for (element, count) in counts.iter().enumerate() {
        let row = &all[offsets[element] as usize..offsets[element + 1] as usize];
        assert!(row.windows(2).all(|pair| pair[0].sender < pair[1].sender), "row {element}: sorted, each sender once");
        assert!(row.iter().all(|link| link.sender < links.element_count && link.weight >= 0.0 && link.weight <= 1.0));
        let hits = ray_count - (count & 0xffff) - (count >> 16);
        let sum: f32 = row.iter().map(|link| link.weight).sum();
        let expected = hits as f32 / ray_count as f32;
        assert!((sum - expected).abs() <= slack, "row {element}: sums to {sum}, {hits} of {ray_count} rays hit");
        (least, most) = (least.min(sum), most.max(sum));
    }
    (all.len(), least, most)
}

#[test]
fn rows_are_sorted_and_sum_to_the_rays_that_hit() {
    let context = TestContext::new();
    for name in ["cornell-box", "two-rooms", "perpendicular-plates"] {
        let fixture = Fixture::new(&context, builtin_scene(name), Some(0.5));
        for packed_links in [false, true] {
            let method = fixture.prepare(&context, Settings { packed_links, ..Settings::default() });
            let report = method.report();
            // Units of weight are exact in f32; what is left is the sum of some hundred roundings. A packed row may
            // lose half a unit, and one more where a single link holds all.
            let slack = if packed_links { 1.5 / 4096.0 } else { 1e-6 };
            let (links, least, most) = validate(&context, &method, slack);
            println!(
                "{name}, packed {packed_links}: {links} links, compression {:.2}, rows sum to {least}..{most}",
                report.compression
            );
            assert_eq!(report.raw_links, 3 * (report.rays - report.blocked_rays - report.escaped_rays));
            assert!(report.compression > 1.0 && report.links as usize == links);
            assert!(links * if packed_links { 4 } else { 8 } <= report.link_bytes as usize);
        }
    }
}

/// The paper sees 3 to 5 at 256 rays, on models with large and small triangles side by side.
#[test]
fn links_compress_as_in_the_paper() {
    let context = TestContext::new();
    for name in ["office", "maze"] {
        let fixture = Fixture::new(&context, builtin_scene(name), None);
        let method = fixture.prepare(&context, Settings::default());
        let report = method.report();
        println!(
            "{name}: {} elements, {} links of {}, compression {:.2}",
            report.elements, report.links, report.raw_links, report.compression
        );
        assert!(report.compression > 3.0, "{report:?}");
    }
}

#[test]
fn a_low_buffer_limit_gives_the_same_links_in_more_windows() {
    let whole = TestContext::new();
    let small = TestContext::with(Options { max_storage_buffer_bytes: Some(1 << 20), ..Options::default() });
    let links = |context: &TestContext| {
        let fixture = Fixture::new(context, builtin_scene("cornell-box"), Some(0.4));
        let method = fixture.prepare(context, Settings::default());
        let offsets = context.download(&method.links().offsets).unwrap();
        let links = method.links().download(context).unwrap();
        (method.links().window_count(), offsets, links, context.download(&method.outcomes().escaped).unwrap())
    };
    let (one, many) = (links(&whole), links(&small));
    assert_eq!(one.0, 1);
    assert!(many.0 > 1, "{} windows", many.0);
    assert!(one.1 == many.1 && one.2 == many.2 && one.3 == many.3);
}

#[test]
fn a_scene_that_does_not_fit_is_refused_before_anything_is_made() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.5));
    let refuse = |budget| ExplicitVisibility::prepare_within(&context, &fixture.stage(), Settings::default(), budget);
    match refuse(1 << 20) {
        Err(error @ ExplicitError::OutOfMemory { needed, available, .. }) => {
            assert!(needed > available && available == 1 << 20);
            assert!(error.to_string().contains("rays_per_element"), "{error}");
            // All but the links fits now; the links are counted and refused.
            match refuse(needed) {
                Err(ExplicitError::Link(error)) => assert!(error.to_string().contains("links need"), "{error}"),
                other => panic!("{:?}", other.map(|m| m.report().clone())),
            }
            assert!(refuse(needed + (64 << 20)).is_ok());
        }
        other => panic!("{:?}", other.map(|m| m.report().clone())),
    }
}
