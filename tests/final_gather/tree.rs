//! What the tree holds on the device, against sums on the CPU.

use crate::common::{Random, TestContext};
use glam::Vec3;
use linklight::stages::sender_tree::{
    self, Representative, SenderTree, TreeOptions, VertexElements, VertexLeaves, parallelogram, triangle,
};

/// Power of every node and the leaf that stands for it, by walking below it.
fn pull(tree: &SenderTree, areas: &[f32], emitted: &[Vec3], reflected: &[Vec3]) -> Vec<(Vec3, Vec3)> {
    let topology = &tree.topology;
    let below = |node: usize| {
        let leaves = (node..topology.nodes[node].skip as usize)
            .filter(|&below| topology.nodes[below].skip as usize == below + 1)
            .map(|below| topology.leaf_order[topology.nodes[below].leaf as usize] as usize);
        leaves.fold((Vec3::ZERO, Vec3::ZERO), |(all, own), leaf| {
            (all + areas[leaf] * (emitted[leaf] + reflected[leaf]), own + areas[leaf] * emitted[leaf])
        })
    };
    (0..topology.nodes.len()).map(below).collect()
}

#[test]
fn powers_add_up_and_representatives_are_the_heaviest() {
    let context = TestContext::new();
    for count in [0, 1, 2, 65, 1009] {
        let random = &mut Random(count);
        let mut vector = |scale: f32| scale * Vec3::new(random.unit(), random.unit(), random.unit());
        let leaves: Vec<_> = (0..count)
            .map(|i| {
                let (at, u, v) = (vector(5.0), vector(0.2), vector(0.2));
                if i % 2 == 0 { triangle([at, at + u, at + v]) } else { parallelogram(at, u, v) }
            })
            .collect();
        let (emitted, reflected): (Vec<_>, Vec<_>) = (0..count).map(|_| (vector(3.0), vector(1.0))).unzip();
        for representative in [Representative::Intensity, Representative::Area] {
            let options = TreeOptions { representative, ..TreeOptions::default() };
            let tree = SenderTree::build(&context, &leaves, options).unwrap();
            let sent = [&emitted, &reflected].map(|values| context.upload("test/sent", values).unwrap());
            let mut recorder = context.recorder("test").unwrap();
            tree.pull(&mut recorder, &sent[0], &sent[1]);
            recorder.submit().unwrap();

            let areas: Vec<f32> = leaves.iter().map(sender_tree::area).collect();
            let light: Vec<[u32; 4]> = context.download(tree.light.buffer()).unwrap();
            let float = |texel: [u32; 4]| {
                Vec3::new(f32::from_bits(texel[0]), f32::from_bits(texel[1]), f32::from_bits(texel[2]))
            };
            let expected = pull(&tree, &areas, &emitted, &reflected);
            for (node, &(power, own)) in expected.iter().enumerate() {
                let (got, got_own) = (float(light[2 * node]), float(light[2 * node + 1]));
                let tolerance = 1e-4 * power.max_element();
                assert!((got - power).abs().max_element() < tolerance, "node {node}: {got} for {power}");
                assert!((got_own - own).abs().max_element() < tolerance, "node {node}: {got_own} for {own}");
                // The heavier child's representative is the node's.
                let skip = tree.topology.nodes[node].skip as usize;
                if skip == node + 1 {
                    assert_eq!(light[2 * node + 1][3], tree.topology.nodes[node].leaf);
                    continue;
                }
                let right = tree.topology.nodes[node + 1].skip as usize;
                let weight = |child: usize| match representative {
                    Representative::Intensity => float(light[2 * child]).element_sum(),
                    Representative::Area => tree.topology.nodes[child].area,
                };
                let heavier = if weight(node + 1) >= weight(right) { node + 1 } else { right };
                assert_eq!(light[2 * node + 1][3], light[2 * heavier + 1][3], "node {node}");
            }
            if count > 2 {
                let wrong = pull(&tree, &areas, &reflected, &emitted);
                assert!(wrong[0].1.distance(expected[0].1) > 0.1, "swapped light would go unnoticed");
            }
        }
    }
}

/// Luminance that the leaves are adapted to: log-average by area, without what is dark beside the rest.
fn adaptation(areas: &[f32], reflected: &[Vec3]) -> f64 {
    let luminance = |v: Vec3| f64::from(v.dot(Vec3::new(0.2126, 0.7152, 0.0722))) / std::f64::consts::PI;
    let weighted = || areas.iter().zip(reflected).map(|(&area, &v)| (f64::from(area), luminance(v)));
    let (light, area) = weighted().fold((0.0, 0.0), |(light, sum), (area, l)| (light + area * l, sum + area));
    let lit = weighted().filter(|(_, l)| *l > 1e-3 * light / area);
    let (log, area) = lit.fold((0.0, 0.0), |(log, sum), (area, l)| (log + area * l.ln(), sum + area));
    if area > 0.0 { (log / area).exp() } else { 0.0 }
}

/// Leaves inside of things are nearly dark; half of all being so must not make the rest look white.
#[test]
fn what_nobody_sees_does_not_adapt_the_eye() {
    let context = TestContext::new();
    let random = &mut Random(4);
    let mut vector = |scale: f32| scale * Vec3::new(random.unit(), random.unit(), random.unit());
    let leaves: Vec<_> = (0..777).map(|_| parallelogram(vector(5.0), vector(0.2), vector(0.2))).collect();
    let mut reflected: Vec<Vec3> = leaves.iter().map(|_| vector(2.0)).collect();
    let areas: Vec<f32> = leaves.iter().map(sender_tree::area).collect();
    let adapted = |reflected: &[Vec3]| {
        let tree = SenderTree::build(&context, &leaves, TreeOptions::default()).unwrap();
        let [dark, sent] =
            [&vec![Vec3::ZERO; leaves.len()][..], reflected].map(|v| context.upload("test/sent", v).unwrap());
        let mut recorder = context.recorder("test").unwrap();
        tree.pull(&mut recorder, &dark, &sent);
        recorder.submit().unwrap();
        f64::from(context.download(&tree.adaptation).unwrap()[0])
    };
    let all_lit = adapted(&reflected);
    assert!((all_lit / adaptation(&areas, &reflected) - 1.0).abs() < 1e-3);
    reflected.iter_mut().step_by(2).for_each(|v| *v *= 1e-7);
    let half_dark = adapted(&reflected);
    assert!((half_dark / adaptation(&areas, &reflected) - 1.0).abs() < 1e-3);
    assert!((half_dark / all_lit - 1.0).abs() < 0.2, "{half_dark} for {all_lit}: the dark half counts");
    assert_eq!(adapted(&vec![Vec3::ZERO; leaves.len()]), 0.0);
}

#[test]
fn triangles_send_the_mean_of_the_elements_at_their_corners() {
    let context = TestContext::new();
    let random = &mut Random(77);
    let mut vectors = |count: usize, scale: f32| -> Vec<Vec3> {
        (0..count).map(|_| scale * Vec3::new(random.unit(), random.unit(), random.unit())).collect()
    };
    // A strip; its second half has backs, whose elements stand after those of all fronts.
    let (vertex_count, triangle_count) = (80u32, 78);
    let positions = vectors(vertex_count as usize, 3.0);
    let triangles: Vec<[u32; 3]> = (0..triangle_count).map(|i| [i, i + 1, i + 2]).collect();
    let back_elements: Vec<u32> =
        (0..vertex_count).map(|v| if v < 40 { u32::MAX } else { vertex_count + v - 40 }).collect();
    let values: [Vec<Vec3>; 5] = std::array::from_fn(|k| vectors(120, 1.0 + k as f32));
    let [emission, albedo, punctual, direct, indirect] =
        values.each_ref().map(|values| context.upload("test/elements", values).unwrap());
    let elements = VertexElements {
        emission: &emission,
        albedo: &albedo,
        punctual: &punctual,
        direct: &direct,
        indirect: &indirect,
    };
    let leaves = VertexLeaves::new(&context, &positions, &triangles, &back_elements, TreeOptions::default()).unwrap();
    let twin = |owner: usize| {
        let (corners, is_back) = match owner.checked_sub(triangles.len()) {
            None => (triangles[owner], false),
            Some(back) => (triangles[40 + back], true),
        };
        let element = |v: u32| if is_back { back_elements[v as usize] as usize } else { v as usize };
        let mean = |of: &dyn Fn(usize) -> Vec3| corners.iter().map(|v| of(element(*v))).sum::<Vec3>() / 3.0;
        let [emission, albedo, punctual, direct, indirect] = &values;
        let emitted = std::f32::consts::PI * mean(&|e| emission[e]);
        (emitted, mean(&|e| albedo[e] * (punctual[e] + direct[e] + indirect[e])))
    };
    assert_eq!(leaves.tree.leaf_count() as usize, 78 + 38);
    for has_reflected in [true, false] {
        let mut recorder = context.recorder("test").unwrap();
        leaves.fill(&mut recorder, elements, has_reflected);
        recorder.submit().unwrap();
        for (light, owner) in leaves.tree.leaf_light(&context).unwrap().iter().zip(&leaves.tree.topology.leaf_order) {
            let (emitted, reflected) = twin(*owner as usize);
            let reflected = if has_reflected { reflected } else { Vec3::ZERO };
            assert!(light.emitted.distance(emitted) <= 1e-5 * emitted.length(), "leaf {owner}: {light:?}");
            assert!(light.reflected.distance(reflected) <= 1e-5 * reflected.length(), "leaf {owner}: {light:?}");
        }
    }
    // Another triangle's light is told apart.
    assert!(twin(3).1.distance(twin(4).1) > 0.01 && twin(78).0.distance(twin(40).0) > 0.01);
}
