//! What the sweep leaves for the light: holes that are closed, and the lists of light links.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene, winners};
use crate::twins;
use glam::{Quat, Vec3};
use linklight::gpu::shaders::types::Receiver;
use linklight::methods::implicit_visibility::{Settings, bins};
use linklight::stages::emitters::EmitterChoice;

const NO_KEY: u64 = u64::MAX;

/// The twin of `fill_holes` for one leaf: `keys` of its bins once the sweep is done. `takes` picks among what is around.
fn filled(keys: &[u64], at: &Receiver, n: u32, takes: impl Fn(&[u64]) -> u64) -> Vec<u32> {
    let normal = Quat::from_array(at.frame).inverse() * at.normal;
    let row = keys.iter().zip(twins::directions(n)).enumerate().map(|(bin, (&key, direction))| {
        let direction = direction.as_vec3();
        if twins::highest(bin as u32, normal, n) <= 0.0 {
            return twins::EMPTY;
        }
        if key != NO_KEY || direction.dot(normal) <= 0.0 {
            return key as u32;
        }
        let face = bin as u32 / (n * n);
        let axis = (face / 2) as usize;
        let uv = [(axis + 1) % 3, (axis + 2) % 3].map(|k| direction[k] / direction[axis].abs());
        let step = 2.0 / n as f32;
        let beside = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]]
            .map(|[du, dv]| bins::face_direction(face, f64::from(uv[0] + du), f64::from(uv[1] + dv)).as_vec3());
        let above = beside.iter().filter(|towards| towards.dot(normal) > 0.0);
        let around: Vec<u64> = above.map(|&towards| keys[bins::bin_of(towards, n) as usize]).collect();
        let full: Vec<u64> = around.iter().copied().filter(|&key| key != NO_KEY).collect();
        let is_hole = !full.is_empty() && 3 * (around.len() - full.len()) <= full.len();
        if is_hole { takes(&full) as u32 } else { twins::EMPTY }
    });
    row.collect()
}

#[test]
fn holes_take_the_farthest_of_their_neighbours() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("dancer"), None);
    // Single bins leave many holes.
    let settings = Settings {
        bins: 6,
        footprint: linklight::methods::implicit_visibility::Footprint::Single,
        ..Settings::default()
    };
    let method = fixture.linked(&context, settings);
    let receivers = context.download(&method.linking().receivers).unwrap();
    let keys = context.download(&method.linking().keys).unwrap();
    let [window] = &method.linking().windows[..] else { panic!("one window") };
    let (trees, bin_count) = (&method.trees().topology, settings.bin_count() as usize);
    let row_of = |level: usize, node: u32| {
        let own = &window.plan.levels[level];
        let first = (own.row + node - own.first) as usize * bin_count;
        &keys[first..first + bin_count]
    };
    let (mut holes, mut wrong, mut differing) = (0, 0, 0);
    for (leaf, row) in winners(&context, &method).iter().enumerate() {
        let own = row_of(0, leaf as u32);
        let above = trees.parent(leaf as u32).map_or(own, |parent| row_of(1, parent));
        let swept: Vec<u64> = own.iter().zip(above).map(|(a, b)| *a.min(b)).collect();
        let expected = filled(&swept, &receivers[leaf], settings.bins, |full| *full.iter().max().unwrap());
        let normal = Quat::from_array(receivers[leaf].frame).inverse() * receivers[leaf].normal;
        let is_clear = |bin: usize| twins::highest(bin as u32, normal, settings.bins).abs() > 1e-5;
        differing += (0..bin_count).filter(|&bin| row[bin] != expected[bin] && is_clear(bin)).count();
        holes += swept.iter().zip(row).filter(|(key, winner)| **key == NO_KEY && **winner != twins::EMPTY).count();
        let nearest = filled(&swept, &receivers[leaf], settings.bins, |full| *full.iter().min().unwrap());
        wrong += usize::from(nearest != expected);
    }
    println!("{holes} holes closed, {differing} bins differ");
    // Bins and neighbours on the horizon, which rounding puts above or below.
    assert!(differing * 2000 < holes, "{differing} of {holes}");
    assert!(holes > 1000 && wrong > 100, "{holes} holes, {wrong} leaves would differ by the nearest");
}

#[test]
fn light_links_are_the_bins_whose_winners_emit() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.6));
    let settings = Settings { bins: 5, emitters: EmitterChoice::Linked, ..Settings::default() };
    let method = fixture.linked(&context, settings);
    let trees = &method.trees().topology;
    let receivers = context.download(&method.linking().receivers).unwrap();
    let emission = context.download(&method.elements().emission).unwrap();
    let area = context.download(&method.elements().area).unwrap();
    let emits = |node: u32| {
        trees.leaves(node).any(|leaf| {
            let element = trees.leaf_elements[leaf as usize] as usize;
            emission[element] != Vec3::ZERO && area[element] > 0.0
        })
    };
    let vectors = bins::vectors(settings.bins);
    let [window] = &method.linking().windows[..] else { panic!("one window") };
    let bits = context.download(&window.light_bins).unwrap();
    let rows = winners(&context, &method);
    let (mut lit, mut dark) = (0, 0);
    for (leaf, row) in rows.iter().enumerate() {
        let at = &receivers[leaf];
        for (bin, (&winner, vector)) in row.iter().zip(&vectors).enumerate() {
            let is_above = (Quat::from_array(at.frame) * *vector).dot(at.normal) > 0.0;
            let expected = is_above && winner < twins::BACK && emits(winner);
            let found = bits[bin / 32 * rows.len() + leaf] >> (bin % 32) & 1 != 0;
            assert_eq!(found, expected, "leaf {leaf}, bin {bin}, winner {winner:x}");
            *(if found { &mut lit } else { &mut dark }) += 1;
        }
    }
    assert!(lit > 150 && dark > 10 * lit, "{lit} light links, {dark} others");
}
