//! Links made beside the rendering: spread over frames, and over devices. Both end at the same bits.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene, solve};
use glam::Vec3;
use linklight::gpu::Options;
use linklight::methods::explicit_visibility::{ExplicitVisibility, Helper, RayCount, Settings, Shown};
use linklight::scene::pose::Pose;
use linklight::stages::false_color::{self, NEUTRAL, PICKED};

fn few_rays() -> Settings {
    Settings { rays_per_element: RayCount::new(64).unwrap(), ..Settings::default() }
}

fn pose(context: &TestContext, fixture: &Fixture, seconds: f32) {
    let mut recorder = context.recorder("test").unwrap();
    fixture.world.pose(&mut recorder, &Pose::at(&fixture.scene, seconds));
    fixture.bvh.refit(&mut recorder, &fixture.world.positions).unwrap();
    recorder.submit().unwrap();
}

/// Links and outcomes to the bit.
fn state(context: &TestContext, method: &ExplicitVisibility) -> (Vec<u64>, Vec<u32>, Vec<u32>, Vec<u32>) {
    let links = method.links();
    let words =
        links.download(context).unwrap().into_iter().map(|l| u64::from(l.weight.to_bits()) << 32 | u64::from(l.sender));
    let download = |buffer| context.download(buffer).unwrap();
    let outcomes = method.outcomes();
    (words.collect(), download(&links.offsets), download(&outcomes.escaped), download(&outcomes.counts))
}

#[test]
fn links_within_a_budget_come_to_what_links_at_once_are_and_tell_their_age() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("dancer"), None);
    let mut spread = fixture.prepare(&context, few_rays());
    let mut at_once = fixture.prepare(&context, few_rays());
    let elements = spread.elements().count;
    assert!(!spread.is_stale() && spread.link_ages().is_empty());
    let before = state(&context, &spread);

    pose(&context, &fixture, 0.9);
    at_once.follow(&context, &fixture.stage()).unwrap();
    let wanted = state(&context, &at_once);
    assert!(wanted != before, "the dancer has moved");

    // A quarter of the rays a frame: three frames along the old links, all as old as they are.
    let quarter = elements.div_ceil(4) * 64;
    let mut ages = Vec::new();
    for frame in 0..4 {
        spread.follow_within(&context, &fixture.stage(), quarter, frame == 0).unwrap();
        ages.push((spread.is_stale(), spread.oldest_link()));
        let light = solve(&context, &spread, &fixture.world, 2).indirect;
        assert!(light.iter().all(|e| e.is_finite()) && light.iter().any(|e| *e != Vec3::ZERO), "frame {frame}");
        assert_eq!(state(&context, &spread) == before, frame < 3, "frame {frame}: old links until all are new");
    }
    assert_eq!(ages, [(true, 1), (true, 2), (true, 3), (false, 0)]);
    assert!(state(&context, &spread) == wanted);
    assert!(
        solve(&context, &spread, &fixture.world, 2).indirect == solve(&context, &at_once, &fixture.world, 2).indirect
    );

    // While surfaces go on moving, links are never those of now, and parts of them older than others.
    for frame in 1..=6u8 {
        pose(&context, &fixture, 0.9 + 0.1 * f32::from(frame));
        spread.follow_within(&context, &fixture.stage(), quarter, true).unwrap();
    }
    let told = spread.link_ages();
    let (youngest, oldest) = (told.iter().min().unwrap(), told.iter().max().unwrap());
    assert_eq!((*youngest, *oldest, told.len()), (2, 5, elements as usize));
    assert!(spread.is_stale());

    // Two sets of links take turns: once both are there nothing is allocated any more, and nothing grows.
    let mut held = Vec::new();
    for frame in 0..14u8 {
        pose(&context, &fixture, 0.9 + 0.1 * f32::from(frame % 3));
        spread.follow_within(&context, &fixture.stage(), quarter, true).unwrap();
        let bytes: u64 = context.memory_by_owner().values().map(|memory| memory.current_bytes).sum();
        held.push((context.allocation_count(), bytes));
    }
    assert!(held[7..].iter().all(|now| *now == held[7]), "allocations and bytes by frame: {held:?}");
}

#[test]
fn views_show_the_links_of_the_picked_element_both_ways() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.5));
    let light = fixture.prepare(&context, few_rays());
    assert_eq!(light.view_colors(&context, Some(0)).unwrap(), None);
    let (links, offsets) =
        (light.links().download(&context).unwrap(), context.download(&light.links().offsets).unwrap());
    let row = |element: usize| &links[offsets[element] as usize..offsets[element + 1] as usize];
    let count = light.elements().count as usize;
    let picked = (0..count).max_by_key(|&element| row(element).len()).unwrap();
    let strongest = row(picked).iter().max_by(|a, b| a.weight.total_cmp(&b.weight)).unwrap();
    for (show, linked) in [
        (Shown::LinksIn, row(picked).iter().map(|link| link.sender as usize).collect::<Vec<_>>()),
        (Shown::LinksOut, (0..count).filter(|&e| row(e).iter().any(|link| link.sender == picked as u32)).collect()),
    ] {
        let method = fixture.prepare(&context, Settings { show, ..few_rays() });
        let colors = method.view_colors(&context, Some(picked as u32)).unwrap().unwrap();
        let is_colored = |element: &usize| colors[*element] != NEUTRAL && *element != picked;
        assert!(!linked.is_empty() && (0..count).filter(is_colored).eq(linked.iter().copied()), "{show:?}");
        assert_eq!(colors[picked], PICKED);
        if show == Shown::LinksIn {
            assert_eq!(colors[strongest.sender as usize], false_color::of_amount(1.0));
        }
        // Nothing picked, or nothing that is there: nothing to show.
        for nothing in [None, Some(u32::MAX)] {
            assert!(method.view_colors(&context, nothing).unwrap().unwrap().iter().all(|color| *color == NEUTRAL));
        }
    }
}

#[test]
fn two_devices_make_the_links_of_one_to_the_bit() {
    let context = TestContext::new();
    for (name, max_edge, packed_links) in [("dancer", None, false), ("cornell-box", Some(1.0), true)] {
        let fixture = Fixture::new(&context, builtin_scene(name), max_edge);
        let settings = Settings { packed_links, ..few_rays() };
        pose(&context, &fixture, 0.0);
        let mut alone = fixture.prepare(&context, settings);
        let options = Options { validation: true, ..Options::default() };
        let helper = Helper::new(options, &fixture.stage(), &Pose::at(&fixture.scene, 0.0), settings).unwrap();
        let stage = fixture.stage();
        let mut together = ExplicitVisibility::prepare_over(&context, &stage, settings, vec![helper]).unwrap();
        assert!(state(&context, &alone) == state(&context, &together), "packed {packed_links}");
        let shares = &together.report().device_elements;
        assert!(shares.len() == 2 && shares.iter().all(|&share| share > 0), "both took part: {shares:?}");
        assert_eq!(shares.iter().sum::<u32>(), alone.elements().count);
        assert_eq!(together.helpers()[0].validation_messages(), [""; 0]);
        if packed_links {
            continue;
        }
        // Both follow what moves: the same scene turned into another by its own pose.
        let before = state(&context, &alone);
        pose(&context, &fixture, 0.7);
        alone.follow(&context, &fixture.stage()).unwrap();
        together.follow(&context, &fixture.stage()).unwrap();
        assert!(state(&context, &alone) == state(&context, &together) && state(&context, &alone) != before);
        assert_eq!(together.report().device_elements.len(), 2);
        assert_eq!(together.helpers()[0].validation_messages(), [""; 0]);
    }
}
