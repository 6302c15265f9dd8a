//! The passes against their twins, on the states of small scenes.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{by_node, entries, prepare, settings};
use crate::twins::{self, Transferring};
use glam::{DVec3, UVec2, Vec3};
use linklight::gpu::Options;
use linklight::methods::antiradiance::{LocalStep, Settings, link_solid_angle};
use linklight::scene::camera::View;
use linklight::scene::pose::Pose;
use linklight::scene::{LightKind, Scene};
use linklight::stages::direction_bins::Spread;
use linklight::stages::world::World;
use std::collections::{BTreeMap, BTreeSet};

/// Largest difference, of the largest value expected.
fn difference(found: &[Vec3], expected: &[DVec3]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().map(|e| e.abs().max_element()).fold(1e-30, f64::max);
    let error = found.iter().zip(expected).map(|(f, e)| (f.as_dvec3() - e).abs().max_element());
    error.fold(0.0, |a, b| if b.is_nan() { f64::INFINITY } else { a.max(b) }) / largest
}

#[test]
fn links_and_transfers_agree_with_their_twins() {
    let context = TestContext::new();
    for (name, edge, spread) in
        [("cornell-box", 0.9, Spread::Cone), ("two-rooms", 1.6, Spread::Gaussian), ("furnace", 0.8, Spread::None)]
    {
        let fixture = Fixture::new(&context, builtin_scene(name), Some(edge));
        let settings = Settings { spread, ..settings(128) };
        let method = prepare(&context, &fixture, settings);
        let hierarchy = method.hierarchy();
        let nodes = context.download(&hierarchy.nodes).unwrap();
        let leaves = context.download(&hierarchy.leaves).unwrap();
        let bins = &method.bins().bins;

        let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        // Decisions at the very edge may fall either way in another order of rounding.
        let twin: BTreeSet<[u32; 2]> =
            twins::pairs(&nodes, &leaves, link_solid_angle(&settings), 0.0)[0].iter().copied().map(sorted).collect();
        let pairs = method.links().download(&context).unwrap();
        let found: BTreeSet<[u32; 2]> = pairs.iter().map(|p| sorted([p.x, p.y])).collect();
        assert_eq!(found.len(), pairs.len(), "{name}: no pair twice");
        let unlike = twin.symmetric_difference(&found).count();
        assert!(unlike * 1000 <= twin.len(), "{name}: {unlike} of {} links differ", twin.len());

        let ends: Vec<[u32; 2]> = pairs.iter().map(|pair| pair.to_array()).collect();
        let (scales, twin_scales) =
            (context.download(&method.tables().scales).unwrap(), twins::scales(&nodes, &leaves, &ends));
        let far_off =
            |by: f32| scales.iter().zip(&twin_scales).filter(|(s, t)| (f64::from(by * **s) - **t).abs() > 2e-3).count();
        // A direction within a leaf's plane may fall on either side.
        assert!(far_off(1.0) * 100 <= scales.len(), "{name}: {} of {} scales differ", far_off(1.0), scales.len());
        assert!(far_off(1.01) * 2 > scales.len(), "the comparison would see a hundredth");

        let norms: Vec<f32> = leaves.iter().map(|leaf| twins::cosine_norm(leaf.normal, bins)).collect();
        for (found, expected) in context.download(&method.tables().cosine_norms).unwrap().iter().zip(&norms) {
            assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
        }
        let transferring = Transferring {
            nodes: &nodes,
            leaves: &leaves,
            norms: &norms,
            bins,
            lists: &bins.spread_lists(spread),
            class_count: if spread == Spread::None { 0 } else { bins.class_count() },
            is_gaussian: spread == Spread::Gaussian,
        };
        let mut twin = BTreeMap::new();
        for pair in &pairs {
            for (sender, receiver) in [(pair.x, pair.y), (pair.y, pair.x)] {
                for (cell, entry, weight) in transferring.transfers(sender, receiver) {
                    assert!(twin.insert((cell, entry), weight).is_none());
                }
            }
        }
        let found = method.transfers().download(&context).unwrap();
        let sorted = found.windows(2).all(|pair| (pair[0].0, pair[0].1) < (pair[1].0, pair[1].1));
        assert!(sorted, "{name}: by cell, then by sender, each once");
        let agree = |(cell, entry, weight): &(u32, u32, f32)| {
            twin.get(&(*cell, *entry)).is_some_and(|expected| (weight - expected).abs() <= 2e-3 * expected + 1e-6)
        };
        let alike = found.iter().filter(|t| agree(t)).count();
        println!("{name}: {} links, {} transfers, {} as the twin's", found.len(), twin.len(), alike);
        // A direction on the border of two bins, or a sender on that of two classes.
        assert!(alike * 1000 >= 990 * found.len().max(twin.len()), "{name}: {alike} of {}", found.len());
        // The comparison would see weights off by a hundredth.
        let moved = found.iter().filter(|&&(c, e, w)| agree(&(c, e, 1.01 * w))).count();
        assert!(moved * 100 < found.len(), "{moved}");
    }
}

/// Two boards that stand side by side over a floor, each of its own colour on both sides.
fn boards() -> Scene {
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 6, 0);
    let board = |x, material| parallelogram(Vec3::new(x, 0.1, 0.0), Vec3::X, Vec3::new(0.0, 1.0, 0.3), 3, material);
    let lamps = [-1.5, 1.5].map(|z| (light(LightKind::Point, 5.0), Vec3::new(0.0, 1.5, z), Vec3::NEG_Y));
    let colors = [Vec3::splat(0.7), Vec3::new(0.8, 0.1, 0.1), Vec3::new(0.1, 0.1, 0.8)];
    scene(colors.map(lambert).to_vec(), vec![floor, board(-1.2, 1), board(0.2, 2)], &lamps)
}

#[test]
fn a_step_agrees_with_its_twin() {
    let context = TestContext::new();
    let cornell_box = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.9));
    let boards = Fixture::new(&context, boards(), None);
    for (fixture, undershoot) in [(&cornell_box, 0.25), (&cornell_box, 1e9), (&boards, 0.25)] {
        let mut method = prepare(&context, fixture, Settings { undershoot, ..settings(128) });
        // Some steps, so that light and antiradiance of several kinds are there.
        crate::support::solve(&context, &mut method, fixture, 2);
        let (hierarchy, bins, tables) = (method.hierarchy(), method.bins(), method.tables());
        let nodes = context.download(&hierarchy.nodes).unwrap();
        let leaves = context.download(&hierarchy.leaves).unwrap();
        let norms = context.download(&tables.cosine_norms).unwrap();
        let albedo = context.download(&method.elements().albedo).unwrap();
        let source = context.download(&tables.source).unwrap();
        let before = entries(&context, tables, |window| &window.exitant);
        let transfers = method.transfers().download(&context).unwrap();
        let means = context.download(&tables.means).unwrap();
        let scales = context.download(&tables.scales).unwrap();
        let peaks = by_node(&context.download(&tables.peaks).unwrap(), tables.bin_count);

        let mut recorder = context.recorder("test").unwrap();
        let step = LocalStep { reflects: true, ..LocalStep::default() };
        tables.step(&mut recorder, method.transfers(), hierarchy, bins, step);
        recorder.submit().unwrap();

        let m = bins.bins.count() as usize;
        let incident = twins::gather_and_push(&nodes, m as u32, &transfers, &before);
        let mut expected = vec![DVec3::ZERO; nodes.len() * m];
        let (mut irradiance, mut radiosity) = (Vec::new(), Vec::new());
        for (index, leaf) in leaves.iter().enumerate() {
            let row = leaf.node as usize * m..(leaf.node as usize + 1) * m;
            let albedo = [leaf.element, leaf.back_element].map(|e| albedo.get(e as usize).copied().unwrap_or_default());
            let source = [source[2 * index], source[2 * index + 1]];
            let scales = [scales[2 * index], scales[2 * index + 1]];
            let lowest =
                |side: usize, bin: usize| -undershoot * peaks[index * m + bin].max(1.0) * means[2 * index + side];
            let row_in = &incident[row.clone()];
            let twin = twins::local(leaf, norms[index], &bins.bins, row_in, (source, albedo, scales), lowest);
            irradiance.extend(twin.irradiance);
            radiosity.extend(twin.radiosity);
            expected[row].copy_from_slice(&twin.exitant);
        }
        twins::pull(&nodes, m as u32, &mut expected);
        let found = entries(&context, tables, |window| &window.exitant);
        assert!(difference(&found, &expected) < 2e-5, "{}", difference(&found, &expected));
        let found_irradiance = context.download(&tables.irradiance).unwrap();
        assert!(difference(&found_irradiance, &irradiance) < 2e-5);
        assert!(difference(&context.download(&tables.radiosity).unwrap(), &radiosity) < 2e-5);
        // What the step started from is something else, and the comparison sees it.
        assert!(difference(&before, &expected) > 1e-4, "{}", difference(&before, &expected));
    }
}

/// Tables and transfers cut into windows, and links spread over buffers, give the same light, to the bit; glossy leaves too.
#[test]
fn a_low_buffer_limit_gives_the_same_light() {
    let light = |limit: Option<u64>| {
        let context = TestContext::with(Options { max_storage_buffer_bytes: limit, ..Options::default() });
        let mut scene = builtin_scene("cornell-box");
        (scene.materials[1].metallic, scene.materials[1].roughness) = (1.0, 0.3);
        let mut fixture = Fixture::new(&context, scene, Some(0.9));
        let pose = Pose::rest(&fixture.scene);
        fixture.world =
            World::new(&context, &fixture.scene, &fixture.geometry, &pose, &fixture.environment, false).unwrap();
        let mut method = prepare(&context, &fixture, Settings { refinement: 0.3, ..settings(128) });
        let transfer_windows = method.transfers().windows.len();
        let counts = [method.tables().windows.len(), transfer_windows, method.links().parts().count()];
        println!("{counts:?} windows of tables and of transfers, buffers of links");
        let solution = crate::support::solve(&context, &mut method, &fixture, 2);
        assert!(method.tables().gloss.count > 0);
        let mut recorder = context.recorder("test").unwrap();
        method.look(
            &mut recorder,
            &fixture.world,
            &View::towards(Vec3::new(0.0, 1.0, 2.5), Vec3::Y, 0.8, UVec2::splat(64)),
        );
        recorder.submit().unwrap();
        (counts, solution.indirect, context.download(method.shown_irradiance().1).unwrap())
    };
    // The list of cells is what needs the most otherwise.
    let (whole, cut) = (light(None), light(Some(900_000)));
    assert_eq!(whole.0, [1; 3]);
    assert!(cut.0.iter().all(|&count| count > 1), "{:?} windows and buffers", cut.0);
    assert!(whole.1 == cut.1 && whole.2 == cut.2);
    assert!(whole.1 != whole.2, "gloss is seen");
}
