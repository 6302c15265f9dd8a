//! Each pass of links and light against its plain twin.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene, winners};
use crate::twins;
use glam::{Quat, Vec3};
use linklight::methods::implicit_visibility::{DebugView, Footprint, Frames, Settings, bins};
use linklight::stages::false_color;

const EMPTY_KEY: u64 = u64::MAX;

/// The nearest link of a leaf and all nodes above it in the window, by what the level sweep left.
#[test]
fn winners_are_the_nearest_of_a_leaf_and_what_is_above() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.25));
    let settings = Settings { bins: 4, fill_holes: false, ..Settings::default() };
    let method = fixture.linked(&context, settings);
    let trees = &method.trees().topology;
    let [window] = &method.linking().windows[..] else { panic!("one window") };
    let keys = context.download(&method.linking().keys).unwrap();
    let rows = winners(&context, &method);
    let bin_count = settings.bin_count() as usize;
    let key = |level: usize, node: u32, bin: usize| {
        let own = &window.plan.levels[level];
        keys[(own.row + node - own.first) as usize * bin_count + bin]
    };
    let receivers = context.download(&method.linking().receivers).unwrap();
    let (mut from_above, mut below) = (0, 0);
    for (leaf, row) in rows.iter().enumerate() {
        for (bin, &winner) in row.iter().enumerate() {
            let own = key(0, leaf as u32, bin);
            let above = trees.parent(leaf as u32).map_or(EMPTY_KEY, |parent| key(1, parent, bin));
            from_above += usize::from(above < own);
            // What lies below the horizon as a whole stays empty.
            let highest = twins::highest(bin as u32, receivers[leaf].normal, settings.bins);
            if highest.abs() > 1e-5 {
                let expected = if highest > 0.0 { own.min(above) as u32 } else { twins::EMPTY };
                assert_eq!(winner, expected, "leaf {leaf}, bin {bin}");
                below += usize::from(highest < 0.0);
            }
        }
    }
    for level in 1..trees.levels.len() {
        for node in trees.levels[level].clone() {
            if let Some(parent) = trees.parent(node) {
                let is_nearer = |bin: usize| key(level, node, bin) <= key(level + 1, parent, bin);
                assert!((0..bin_count).all(is_nearer), "a link above node {node} did not come down");
            }
        }
    }
    assert!(from_above > 1000 && below > 1000, "{from_above} links come from above, {below} bins lie below");
}

/// Where leaves receive: the origin of their rays, their normal, and the turn of their bins.
#[test]
fn receivers_stand_on_their_elements() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(1.5));
    for (frames, spin) in [(Frames::World, 0.0), (Frames::Surface, 0.0), (Frames::World, 33.0)] {
        let method = fixture.linked(&context, Settings { bins: 2, frames, spin, ..Settings::default() });
        let origins = context.download(&method.elements().ray_origins).unwrap();
        let normals = context.download(&method.elements().normals).unwrap();
        let axis = Vec3::new(1.0, 2.0, 3.0).normalize();
        for (leaf, at) in context.download(&method.linking().receivers).unwrap().iter().enumerate() {
            let element = method.trees().topology.leaf_elements[leaf] as usize;
            assert_eq!((at.origin, at.normal), (origins[element], normals[element]));
            let frame = Quat::from_array(at.frame);
            assert!((frame.length() - 1.0).abs() < 1e-5);
            match frames {
                // The bins' third axis is the normal.
                Frames::Surface => assert!((frame * Vec3::Z).distance(at.normal) < 1e-4, "{}", frame * Vec3::Z),
                Frames::World => {
                    let expected = Quat::from_axis_angle(axis, spin.to_radians());
                    assert!((frame.dot(expected).abs() - 1.0).abs() < 1e-5, "{frame} for {expected}");
                }
            }
        }
    }
}

/// How much of what an element sees turns its back, and how many bins have winners.
#[test]
fn backs_and_kept_links_are_counted() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("dancer"), None);
    let settings = Settings { bins: 4, view: DebugView::Backs, ..Settings::default() };
    let method = fixture.linked(&context, settings);
    let receivers = context.download(&method.linking().receivers).unwrap();
    let vectors = bins::vectors(settings.bins);
    let colors = method.view_colors(&context, None).unwrap();
    let (mut kept, mut inside) = (0, 0);
    for (leaf, row) in winners(&context, &method).iter().enumerate() {
        let weights = twins::weights(receivers[leaf].normal, &vectors);
        let is_kept = |(winner, weight): &(&u32, &f64)| **winner != twins::EMPTY && **weight > 0.0;
        kept += row.iter().zip(&weights).filter(is_kept).count() as u64;
        let backs = row.iter().zip(&weights).filter(|pair| is_kept(pair) && *pair.0 & twins::BACK != 0);
        let share = backs.map(|(_, weight)| weight / std::f64::consts::PI).sum::<f64>();
        inside += usize::from(share > 0.5);
        let element = method.trees().topology.leaf_elements[leaf] as usize;
        let is_near = |thousandths: f64| {
            (-2..=2)
                .any(|off| colors[element] == false_color::of_amount(((thousandths + f64::from(off)) / 1000.0) as f32))
        };
        assert!(is_near((1000.0 * share).floor()), "element {element}: {share}");
    }
    assert_eq!(kept, method.report().links_kept);
    assert!(inside > 0, "no element stands inside the figure's pedestal");
}

/// Without footprints each link goes into one bin: the same twin sees it.
#[test]
fn a_single_bin_takes_what_is_nearest_by_its_centre() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(1.5));
    let settings =
        Settings { bins: 4, footprint: Footprint::Single, brute_force: true, fill_holes: false, ..Settings::default() };
    let method = fixture.linked(&context, settings);
    let surfels = context.download(&method.trees().surfels).unwrap();
    let receivers = context.download(&method.linking().receivers).unwrap();
    let (mut same, mut filled) = (0, 0);
    for ((leaf, row), at) in winners(&context, &method).iter().enumerate().zip(&receivers) {
        let mut nearest = vec![(f32::INFINITY, twins::EMPTY); row.len()];
        for (sender, s) in surfels[..receivers.len()].iter().enumerate() {
            let offset = s.centre - at.origin;
            if sender == leaf || offset.dot(at.normal) <= -s.radius {
                continue;
            }
            let back = if s.normal.dot(offset) > 0.0 { twins::BACK } else { 0 };
            let bin = &mut nearest[bins::bin_of(offset, settings.bins) as usize];
            *bin = if offset.length() < bin.0 { (offset.length(), sender as u32 | back) } else { *bin };
        }
        for (bin, &winner) in row.iter().enumerate().filter(|(_, winner)| **winner != twins::EMPTY) {
            filled += 1;
            same += usize::from(winner == nearest[bin].1);
        }
    }
    // The rest lies at the horizon, where the walk drops what the twin keeps.
    assert!(filled > 5000 && same as f64 > 0.93 * f64::from(filled), "{same} of {filled}");
}
