//! `sender_tree/pack`: the paper's 128 bits of every node against a plain twin, and what they must hold.

use crate::common::{Random, TestContext};
use glam::{UVec3, Vec3};
use linklight::stages::sender_tree::{NodeLayout, SenderTree, TreeOptions, parallelogram};
use std::f32::consts::PI;

/// What nodes are quantised in.
struct Frame {
    low: Vec3,
    extent: Vec3,
    largest_radius: f32,
    largest_power: f32,
}

/// A node as the wide layout has it.
#[derive(Clone, Copy)]
struct Wide {
    centre: Vec3,
    radius: f32,
    axis: Vec3,
    cos_cone: f32,
    skip: u32,
    power: Vec3,
    leaf: u32,
}

/// Twin of `unpack_axis`.
fn unpack_axis(word: u32) -> Vec3 {
    let [x, y] = [word as i16, (word >> 16) as i16].map(|c| (f32::from(c) / 32_767.0).max(-1.0));
    let z = 1.0 - x.abs() - y.abs();
    let [x, y] = [x, y].map(|c| if c >= 0.0 { c - (-z).max(0.0) } else { c + (-z).max(0.0) });
    Vec3::new(x, y, z).normalize()
}

fn pack_power(power: Vec3, largest: f32) -> u32 {
    let brightest = power.max_element();
    if brightest <= 0.0 {
        return 0;
    }
    let exponent = (63.0 + 2.0 * (brightest / largest).log2()).ceil().clamp(1.0, 63.0);
    let scale = largest * ((exponent - 63.0) * 0.5).exp2();
    let m = (power / scale * 63.0 + 0.5).clamp(Vec3::ZERO, Vec3::splat(63.0)).as_uvec3();
    m.x | m.y << 6 | m.z << 12 | (exponent as u32) << 18
}

/// The node's fields: place, radius; axis, cone; power; skip, leaf.
fn pack(node: &Wide, f: &Frame) -> [u32; 10] {
    let place = ((node.centre - f.low) / f.extent * 255.0 + 0.5).clamp(Vec3::ZERO, Vec3::splat(255.0)).as_uvec3();
    let moved = f.low + place.as_vec3() / 255.0 * f.extent - node.centre;
    let radius = (node.radius + moved.length()) * 1.0001;
    let radius = (255.0 + 12.0 * (radius / f.largest_radius).log2()).ceil().clamp(0.0, 255.0) as u32;
    let axis = ((node.axis + 1.0) * 127.0 + 0.5).clamp(Vec3::ZERO, Vec3::splat(254.0)).as_uvec3();
    let turned = (axis.as_vec3() / 127.0 - 1.0).normalize().dot(node.axis).clamp(-1.0, 1.0).acos();
    let cone = (node.cos_cone.clamp(-1.0, 1.0).acos() + turned + 1e-3).min(PI);
    let cone = ((cone.cos() + 1.0) * 127.0).floor().clamp(0.0, 254.0) as u32;
    let power = pack_power(node.power, f.largest_power);
    [place.x, place.y, place.z, radius, axis.x, axis.y, axis.z, cone, power, node.skip | node.leaf << 16]
}

fn fields(texel: [u32; 4]) -> [u32; 10] {
    let byte = |word: u32, k: u32| word >> (8 * k) & 0xff;
    let [x, y, z, w] = texel;
    let [a, b] = [x, y].map(|word| [0, 1, 2, 3].map(|k| byte(word, k)));
    [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3], z & 0x00ff_ffff, w]
}

/// The first node whose fields differ by more than rounding may move them.
fn difference(got: &[[u32; 10]], expected: &[[u32; 10]]) -> Option<String> {
    let may_differ = |field: usize, a: u32, b: u32| match field {
        // Mantissas of six bits, an exponent of six.
        8 => (0..4).all(|k| (a >> (6 * k) & 63).abs_diff(b >> (6 * k) & 63) <= 1),
        9 => a == b,
        _ => a.abs_diff(b) <= 1,
    };
    let pairs = got.iter().zip(expected).enumerate();
    let mut wrong = pairs.filter(|(_, (a, b))| (0..10).any(|field| !may_differ(field, a[field], b[field])));
    wrong.next().map(|(node, (a, b))| format!("node {node}: {a:?} for {b:?}"))
}

#[test]
fn compact_nodes_are_those_of_a_plain_loop_and_hold_the_wide_ones() {
    let context = TestContext::new();
    let random = &mut Random(19);
    let mut vector = |scale: f32| scale * (Vec3::new(random.unit(), random.unit(), random.unit()) - 0.3);
    let leaves: Vec<_> = (0..900).map(|_| parallelogram(vector(5.0), vector(0.3), vector(0.3))).collect();
    let mut sent = |scale: f32| -> Vec<Vec3> { leaves.iter().map(|_| vector(scale).max(Vec3::ZERO)).collect() };
    let sent = [sent(4.0), sent(1.0)].map(|values| context.upload("test/sent", &values).unwrap());
    let build = |layout| {
        let tree = SenderTree::build(&context, &leaves, TreeOptions { layout, ..TreeOptions::default() }).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        tree.pull(&mut recorder, &sent[0], &sent[1]);
        recorder.submit().unwrap();
        tree
    };
    let [wide, compact] = [NodeLayout::Wide, NodeLayout::Compact].map(build);
    let vec3 =
        |texel: [u32; 4]| Vec3::new(f32::from_bits(texel[0]), f32::from_bits(texel[1]), f32::from_bits(texel[2]));
    let (nodes, light) =
        (context.download(wide.nodes().0.buffer()).unwrap(), context.download(wide.light.buffer()).unwrap());
    let wide: Vec<Wide> = (nodes.chunks(2).zip(light.chunks(2)))
        .map(|(node, light)| Wide {
            centre: vec3(node[0]),
            radius: f32::from_bits(node[0][3]),
            axis: unpack_axis(node[1][0]),
            cos_cone: f32::from_bits(node[1][1]),
            skip: node[1][3],
            power: vec3(light[0]),
            leaf: light[1][3],
        })
        .collect();
    // The walk's own copy of the power, and axes that stand for those of the topology.
    for ((node, texels), exact) in wide.iter().zip(nodes.chunks(2)).zip(&compact.topology.nodes) {
        assert_eq!(f32::from_bits(texels[1][2]), node.power.max_element());
        assert!(
            node.axis.distance(exact.axis) < 1e-4 && node.cos_cone <= exact.cos_cone,
            "{} {}",
            node.axis,
            exact.axis
        );
    }
    let frame = context.download(&compact.frame).unwrap()[0];
    let frame = Frame {
        low: frame.low,
        extent: frame.extent,
        largest_radius: frame.largest_radius,
        largest_power: frame.largest_power,
    };
    assert!((frame.largest_power / wide[0].power.max_element() - 1.0).abs() < 1e-6, "that of the root");
    let got: Vec<[u32; 10]> = context.download(compact.nodes().0.buffer()).unwrap().into_iter().map(fields).collect();
    let twin = |wide: &[Wide]| -> Vec<[u32; 10]> { wide.iter().map(|node| pack(node, &frame)).collect() };
    assert_eq!((got.len(), difference(&got, &twin(&wide))), (wide.len(), None));

    // Wrong inputs are told apart.
    let wrong = |change: &dyn Fn(&mut Wide)| {
        let mut nodes = wide.clone();
        change(&mut nodes[40]);
        assert!(difference(&got, &twin(&nodes)).is_some(), "a wrong node would go unnoticed");
    };
    wrong(&|node| node.centre.y += 0.1);
    wrong(&|node| node.radius *= 1.3);
    wrong(&|node| node.axis = -node.axis);
    wrong(&|node| node.power *= Vec3::new(2.5, 1.0, 1.0));
    wrong(&|node| node.skip += 1);
    wrong(&|node| node.leaf += 1);

    // What is read back holds the sphere and the cone, and nearly the power.
    for (node, code) in wide.iter().zip(&got) {
        let centre = frame.low + UVec3::new(code[0], code[1], code[2]).as_vec3() / 255.0 * frame.extent;
        let radius = frame.largest_radius * ((code[3] as f32 - 255.0) / 12.0).exp2();
        assert!(centre.distance(node.centre) + node.radius <= 1.00001 * radius, "{radius} m for {} m", node.radius);
        let axis = (UVec3::new(code[4], code[5], code[6]).as_vec3() / 127.0 - 1.0).normalize();
        let cone = (code[7] as f32 / 127.0 - 1.0).acos();
        let needed = axis.dot(node.axis).clamp(-1.0, 1.0).acos() + node.cos_cone.clamp(-1.0, 1.0).acos();
        assert!(cone + 1e-3 >= needed.min(PI), "{cone} for {needed}");
        let scale = frame.largest_power * (((code[8] >> 18) as f32 - 63.0) * 0.5).exp2() / 63.0;
        let power = scale * UVec3::new(code[8] & 63, code[8] >> 6 & 63, code[8] >> 12 & 63).as_vec3();
        assert!(
            (power - node.power).abs().max_element() <= 0.012 * node.power.max_element(),
            "{power} for {}",
            node.power
        );
    }
}
