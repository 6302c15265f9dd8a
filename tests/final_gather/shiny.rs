//! Leaves that send by direction: what the tree holds of them, and what pixels take, against plain sums.

use crate::common::hemisphere_bins::{between, cosine, decode_32, encode_32, solid_angle};
use crate::common::scenes::{lambert, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, view};
use glam::{DVec3, Vec3};
use linklight::display::final_gather::{Settings, Visibility};
use linklight::gpu::shaders::types::SenderLeaf;
use linklight::scene::Material;
use linklight::scene::environment::Environment;
use linklight::stages::sender_tree::{self, NodeLayout, SenderTree, ShinyLeaves};
use std::f64::consts::PI;

const ALBEDO: f64 = 0.6;

/// Radiance at a point of the floor from far leaves, of which some have tables.
fn expected(point: DVec3, leaves: &[SenderLeaf], even: &[Vec3], tables: &[Vec<DVec3>], side: u32) -> DVec3 {
    let of = |(i, leaf): (usize, &SenderLeaf)| {
        let to = leaf.centre.as_dvec3() - point;
        let (direction, normal) = (to.normalize(), sender_tree::normal(leaf).as_dvec3());
        let along = leaf.edge_u.as_dvec3().normalize();
        let d = -direction;
        let in_leaf = DVec3::new(d.dot(along), d.dot(normal.cross(along)), d.dot(normal));
        let lobe = tables.get(i).filter(|table| !table.is_empty());
        let radiance = even[i].as_dvec3() / PI + lobe.map_or(DVec3::ZERO, |table| between(table, side, in_leaf));
        let cosines = direction.y.max(0.0) * in_leaf.z.max(0.0);
        radiance * cosines * f64::from(sender_tree::area(leaf)) / to.length_squared()
    };
    ALBEDO / PI * leaves.iter().enumerate().map(of).sum::<DVec3>()
}

#[test]
fn pixels_take_from_shiny_leaves_what_is_sent_towards_them() {
    let context = TestContext::new();
    let random = &mut Random(44);
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 1, 0);
    let matt = Material { double_sided: false, ..lambert(Vec3::splat(ALBEDO as f32)) };
    let view = view(Vec3::new(0.3, 1.2, 3.5), Vec3::new(0.0, 0.2, -1.0), 0.4);
    let fixture = Fixture::new(&context, &scene(vec![matt], vec![floor], &[]), &Environment::default(), true, view);
    // Small leaves above the floor that look down, each turned otherwise.
    let leaves: Vec<SenderLeaf> = (0..9)
        .map(|_| {
            let [x, z, turn] = [(); 3].map(|()| 4.0 * random.unit() - 2.0);
            let (u, tilt) = (Vec3::new(turn.cos(), 0.0, turn.sin()), 0.2 * random.unit());
            let v = u.cross(Vec3::new(tilt, -1.0, 0.0).normalize());
            sender_tree::parallelogram(Vec3::new(x, 2.0 + random.unit(), z), 0.1 * u, -0.1 * v)
        })
        .collect();
    assert!(leaves.iter().all(|leaf| sender_tree::normal(leaf).y < -0.9));
    let side = 3;
    let rows = [0, 2, 1, 0, 3, 4, 0, 6, 5];
    let words: Vec<u32> = (0..6 * side * side)
        .map(|_| encode_32(DVec3::new(random.unit().into(), random.unit().into(), 4.0 * f64::from(random.unit()))))
        .collect();
    let bins = (side * side) as usize;
    let table = |row: u32| match row {
        0 => Vec::new(),
        _ => words[bins * (row as usize - 1)..][..bins].iter().map(|&word| decode_32(word)).collect(),
    };
    let tables: Vec<Vec<DVec3>> = rows.iter().map(|&row| table(row)).collect();
    let even: Vec<Vec3> = leaves.iter().map(|_| Vec3::new(random.unit(), random.unit(), 0.2)).collect();
    let dark = context.upload("test/dark", &vec![Vec3::ZERO; leaves.len()]).unwrap();
    let reflected = context.upload("test/reflected", &even).unwrap();
    let sent = context.upload("test/sent", &words).unwrap();
    for (node_layout, gather_jitter) in
        [(NodeLayout::Wide, false), (NodeLayout::Wide, true), (NodeLayout::Compact, true)]
    {
        let settings = Settings {
            gather_threshold: 0.0,
            gather_visibility: Visibility::None,
            gather_jitter,
            node_layout,
            ..Settings::default()
        };
        let shiny = ShinyLeaves { rows: &rows, side };
        let tree = SenderTree::with_shiny(&context, &leaves, shiny, settings.tree_options()).unwrap();
        let gather = fixture.gather_from(&context, settings, &tree, 1, |recorder| {
            tree.pull_with(recorder, &dark, &reflected, Some(&sent));
        });
        let off = |tables: &[Vec<DVec3>]| {
            let (mut error, mut sum) = (0.0, 0.0);
            for (pixel, _) in gather.normals.iter().enumerate().filter(|(_, normal)| normal.length() > 0.5) {
                let expected = expected(gather.positions[pixel].as_dvec3(), &leaves, &even, tables, side);
                error += gather.indirect[pixel].as_dvec3().distance_squared(expected);
                sum += expected.length_squared();
            }
            (error / sum).sqrt()
        };
        let mut turned = tables.clone();
        turned.iter_mut().for_each(|table| table.reverse());
        println!("{node_layout:?}, jitter {gather_jitter}: off by {:.4}; {:.3} if turned", off(&tables), off(&turned));
        // A drawn point is not the middle: three hundredths of a bin's width.
        assert!(off(&tables) < if gather_jitter { 0.02 } else { 2e-3 }, "{}", off(&tables));
        assert!(off(&turned) > 0.05, "tables the wrong way round would go unnoticed");

        // What the tree holds: all that leaves in the mean, and no less than along the brightest direction.
        let light = tree.leaf_light(&context).unwrap();
        let nodes = context.download(tree.nodes().0.buffer()).unwrap();
        let power: Vec<[u32; 4]> = context.download(tree.light.buffer()).unwrap();
        let (mut sum, mut bound) = (DVec3::ZERO, 0.0);
        for (slot, &owner) in tree.topology.leaf_order.iter().enumerate() {
            let (table, owner) = (&tables[owner as usize], owner as usize);
            let lobe: DVec3 = (0..).zip(table).map(|(bin, l)| cosine(bin, side) * solid_angle(side) * *l).sum();
            let all = even[owner].as_dvec3() + lobe;
            assert!((light[slot].reflected.as_dvec3() - all).length() < 1e-4 * all.length(), "leaf {owner}");
            let brightest = table.iter().map(|l| l.max_element()).fold(0.0, f64::max);
            let area = f64::from(sender_tree::area(&leaves[owner]));
            (sum, bound) = (sum + area * all, bound + area * (even[owner].as_dvec3().max_element() + PI * brightest));
        }
        let [r, g, b, _] = power[0].map(|word| f64::from(f32::from_bits(word)));
        assert!((DVec3::new(r, g, b) - sum).length() < 1e-4 * sum.length(), "the root's power: {r} {g} {b} for {sum}");
        if node_layout == NodeLayout::Wide {
            let held = f64::from(f32::from_bits(nodes[1][2]));
            // Brightest channels of leaves add up to at least that of their sum.
            assert!(held > sum.max_element() && (0.7..1.0001).contains(&(held / bound)), "{held} for {bound}");
        }
        // Without tables shiny leaves send what is even alone.
        let mut recorder = context.recorder("test").unwrap();
        tree.pull(&mut recorder, &dark, &reflected);
        recorder.submit().unwrap();
        let light = tree.leaf_light(&context).unwrap();
        let order = &tree.topology.leaf_order;
        assert!(light.iter().zip(order).all(|(light, &owner)| light.reflected == even[owner as usize]));
    }
}
