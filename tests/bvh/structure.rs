//! The tree itself: every triangle in one leaf, parents around children, refit equal to a fresh build, odd input.

use crate::common::{Random, TestContext};
use crate::meshes::{Mesh, cube, point, ray, soup, sphere};
use crate::trace::cast;
use glam::Vec3;
use linklight::gpu::shaders::types::BvhNode;
use linklight::stages::bvh::topology::{EMPTY, LEAF, STACK, Topology};
use linklight::stages::bvh::{Bvh, BvhError};
use linklight::stages::trace::NO_HIT;

#[derive(Debug, Default, PartialEq)]
struct Statistics {
    nodes: usize,
    leaves: usize,
    depth: u32,
    largest_leaf: usize,
}

fn bounds(node: &BvhNode, k: usize) -> (Vec3, Vec3) {
    (Vec3::new(node.min_x[k], node.min_y[k], node.min_z[k]), Vec3::new(node.max_x[k], node.max_y[k], node.max_z[k]))
}

/// Walks the tree from the root; every invariant fails with the values it saw.
fn validate(context: &TestContext, bvh: &Bvh, mesh: &Mesh) -> Statistics {
    let nodes = context.download(bvh.nodes()).unwrap();
    let slots = context.download(bvh.triangles()).unwrap();
    let mut statistics = Statistics::default();
    let mut seen = vec![0; mesh.triangles.len()];
    let everywhere = (Vec3::NEG_INFINITY, Vec3::INFINITY);
    let mut stack = vec![(0usize, everywhere, 1)];
    while let Some((index, (low, high), depth)) = stack.pop() {
        statistics.nodes += 1;
        statistics.depth = statistics.depth.max(depth);
        let node = &nodes[index];
        for k in (0..4).filter(|&k| node.child[k] != EMPTY) {
            let (child_low, child_high) = bounds(node, k);
            assert!(low.cmple(child_low).all() && high.cmpge(child_high).all(), "child {k} of {index} sticks out");
            let child = node.child[k];
            if child & LEAF == 0 {
                assert!(child as usize > index, "node {index} has child {child}");
                stack.push((child as usize, (child_low, child_high), depth + 1));
                continue;
            }
            statistics.leaves += 1;
            let (first, count) = ((child & 0xff_ffff) as usize, ((child >> 24 & 0x7f) + 1) as usize);
            statistics.largest_leaf = statistics.largest_leaf.max(count);
            for slot in &slots[first..first + count] {
                seen[slot.triangle as usize] += 1;
                let corners = mesh.triangles[slot.triangle as usize].map(|v| mesh.positions[v as usize]);
                assert_eq!(slot.corners, corners, "triangle {}", slot.triangle);
                for corner in corners {
                    let inside = child_low.cmple(corner).all() && child_high.cmpge(corner).all();
                    assert!(inside, "{corner} of {} outside {child_low} .. {child_high}", slot.triangle);
                }
            }
        }
    }
    assert!(seen.iter().all(|&count| count == 1), "each triangle lies in one leaf, found {seen:?}");
    assert_eq!(statistics.nodes, nodes.len(), "nodes that no parent has");
    statistics
}

#[test]
fn trees_of_awkward_sizes_are_valid() {
    let context = TestContext::new();
    let mut random = Random(5);
    for count in [0, 1, 2, 4, 5, 63, 64, 65, 1009, 20_011] {
        let mesh = soup(count, 0.1, &mut random);
        let bvh = Bvh::build(&context, &mesh.positions, &mesh.triangles).unwrap();
        let statistics = validate(&context, &bvh, &mesh);
        assert!(statistics.leaves <= count && statistics.leaves * 4 >= count, "{statistics:?} of {count}");
        assert!(bvh.sah_cost(&context).unwrap() >= 1.0);
        assert!(!bvh.needs_rebuild(&context, 1.01).unwrap());
    }
}

#[test]
#[should_panic(expected = "outside")]
fn the_validator_can_fail() {
    let context = TestContext::new();
    let mut mesh = sphere(8, 8);
    let bvh = Bvh::build(&context, &mesh.positions, &mesh.triangles).unwrap();
    mesh.positions[3] *= 1.5;
    let positions = context.upload("test/positions", &mesh.positions).unwrap();
    // Only the triangles move: bounds are left behind.
    let mut slots = context.download(bvh.triangles()).unwrap();
    for slot in &mut slots {
        slot.corners = mesh.triangles[slot.triangle as usize].map(|v| mesh.positions[v as usize]);
    }
    context.write(bvh.triangles(), &slots).unwrap();
    drop(positions);
    validate(&context, &bvh, &mesh);
}

#[test]
fn refit_follows_the_vertices_and_rebuild_restores_quality() {
    let context = TestContext::new();
    let mut random = Random(9);
    let mesh = soup(10_007, 0.05, &mut random);
    let mut bvh = Bvh::build(&context, &mesh.positions, &mesh.triangles).unwrap();
    let built = bvh.sah_cost(&context).unwrap();

    let refit = |bvh: &Bvh, positions: &[Vec3]| {
        let buffer = context.upload("test/positions", positions).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        bvh.refit(&mut recorder, &buffer).unwrap();
        recorder.submit().unwrap();
        buffer
    };
    // There and back again gives the bounds of the build.
    let fresh = context.download(bvh.nodes()).unwrap();
    let moved = Mesh {
        positions: mesh.positions.iter().map(|p| *p + 0.3 * Vec3::new(p.y * p.y, p.z, p.x)).collect(),
        triangles: mesh.triangles.clone(),
    };
    refit(&bvh, &moved.positions);
    validate(&context, &bvh, &moved);
    refit(&bvh, &mesh.positions);
    assert!(context.download(bvh.nodes()).unwrap() == fresh, "refit to the built positions changes the tree");

    // Strewing the triangles anew ruins the tree; a rebuild mends it.
    let strewn: Vec<Vec3> = mesh
        .positions
        .chunks(3)
        .flat_map(|t| {
            let shift = point(&mut random) - t[0];
            [t[0] + shift, t[1] + shift, t[2] + shift]
        })
        .collect();
    let strewn = Mesh { positions: strewn, triangles: mesh.triangles };
    let buffer = refit(&bvh, &strewn.positions);
    validate(&context, &bvh, &strewn);
    assert!(bvh.needs_rebuild(&context, 1.5).unwrap(), "{} against {built}", bvh.sah_cost(&context).unwrap());
    bvh.rebuild(&context, &buffer).unwrap();
    validate(&context, &bvh, &strewn);
    let rebuilt = bvh.sah_cost(&context).unwrap();
    assert!(rebuilt < 1.2 * built, "{rebuilt} against {built}");
    assert!(!bvh.needs_rebuild(&context, 1.5).unwrap());
}

#[test]
fn refit_with_other_vertices_is_refused() {
    let context = TestContext::new();
    let mesh = cube(2);
    let bvh = Bvh::build(&context, &mesh.positions, &mesh.triangles).unwrap();
    let fewer = context.upload("test/positions", &mesh.positions[1..]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    assert!(matches!(bvh.refit(&mut recorder, &fewer), Err(BvhError::VertexCount { expected: 54, actual: 53 })));
    recorder.submit().unwrap();
}

#[test]
fn broken_input_is_refused() {
    let context = TestContext::new();
    let p = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let refused =
        |positions: &[Vec3], triangles: &[[u32; 3]]| Bvh::build(&context, positions, triangles).err().unwrap();
    assert!(matches!(refused(&p, &[[0, 1, 2], [0, 3, 1]]), BvhError::VertexIndex { triangle: 1, vertex: 3, .. }));
    for bad in [f32::NAN, f32::INFINITY, -1e30] {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, bad, 0.0)];
        assert!(matches!(refused(&positions, &[[0, 1, 2]]), BvhError::Coordinate { vertex: 2, .. }), "{bad}");
    }
}

#[test]
fn degenerate_and_coincident_triangles_are_harmless() {
    let context = TestContext::new();
    // A hundred copies of one triangle, points, needles, and one good triangle behind them all.
    let mut positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    positions.extend([Vec3::new(-9.0, -9.0, -1.0), Vec3::new(9.0, -9.0, -1.0), Vec3::new(0.0, 9.0, -1.0)]);
    let mut triangles = vec![[0, 1, 2]; 100];
    triangles.extend([[0, 0, 0], [1, 1, 1], [0, 1, 1], [0, 0, 2], [2, 1, 2]].repeat(20));
    triangles.push([3, 4, 5]);
    let mesh = Mesh { positions, triangles };
    let bvh = Bvh::build(&context, &mesh.positions, &mesh.triangles).unwrap();
    validate(&context, &bvh, &mesh);
    let rays = [
        ray(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z),
        ray(Vec3::new(-0.2, 0.2, 1.0), Vec3::NEG_Z),
        ray(Vec3::Z, Vec3::Z),
    ];
    let (hits, _) = cast(&context, &mesh, &rays);
    assert_eq!(hits.iter().map(|h| h.triangle).collect::<Vec<_>>(), [0, 200, NO_HIT]);
    // A scene of nothing else.
    let points = Mesh { positions: vec![Vec3::ONE; 3], triangles: vec![[0, 1, 2]; 65] };
    validate(&context, &Bvh::build(&context, &points.positions, &points.triangles).unwrap(), &points);
    let nothing = Mesh { positions: Vec::new(), triangles: Vec::new() };
    assert!(cast(&context, &nothing, &rays).0.iter().all(|h| h.triangle == NO_HIT));
}

#[test]
fn the_stack_always_suffices() {
    // Each triangle is twice as large and as far as the last: trees of such scenes are as deep as they get.
    for (count, growth) in [(60u32, 2.0f32), (4000, 1.01), (2000, 0.98)] {
        let mut positions = Vec::new();
        let mut size = if growth > 1.0 { 1e-9 } else { 1e8 };
        for _ in 0..count {
            positions.extend([Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * size));
            size *= growth;
        }
        let triangles: Vec<_> = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let topology = Topology::build(&positions, &triangles);
        assert!(topology.stack_need() <= STACK, "{} entries", topology.stack_need());
    }
}
