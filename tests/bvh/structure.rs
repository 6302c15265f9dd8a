//! The tree itself: every triangle in one leaf, parents around children, refit equal to a fresh build, odd input.

use crate::common::{Random, TestContext};
use crate::meshes::{Mesh, cube, point, ray, soup, sphere};
use crate::trace::cast;
use glam::Vec3;
use linklight::stages::bvh::topology::{KIND_INNER, LEAF_TRIANGLES, MAX_LEVELS, Topology};
use linklight::stages::bvh::{Bvh, BvhError, NODE_TEXELS, TRIANGLE_TEXELS};
use linklight::stages::trace::NO_HIT;

#[derive(Debug, Default, PartialEq)]
struct Statistics {
    nodes: usize,
    leaves: usize,
    levels: usize,
}

/// A node as glsl/lib/bvh_pack.glsl lays it out: bounds, kind, and first node or slot of each child.
fn children(node: &[[u32; 4]]) -> Vec<((Vec3, Vec3), u32, usize)> {
    let origin = Vec3::from([0, 1, 2].map(|axis| f32::from_bits(node[0][axis])));
    let cell = Vec3::from([0, 1, 2].map(|axis| f32::from_bits((node[0][3] >> (8 * axis) & 0xff) << 23)));
    let (mut child, mut slot) = (node[2][2] as usize, node[2][3] as usize);
    let corner =
        |words: [u32; 3], k: usize| origin + cell * Vec3::from(words.map(|word| (word >> (8 * k) & 0xff) as f32));
    (0..4)
        .map(|k| {
            let low = corner([node[1][0], node[1][2], node[2][0]], k);
            let high = corner([node[1][1], node[1][3], node[2][1]], k);
            let kind = node[0][3] >> (24 + 2 * k) & 3;
            let place = if kind == KIND_INNER { &mut child } else { &mut slot };
            let first = *place;
            *place += if kind == KIND_INNER { 1 } else { kind as usize };
            ((low, high), kind, first)
        })
        .filter(|(_, kind, _)| *kind != 0)
        .collect()
}

fn is_inside(point: Vec3, (low, high): (Vec3, Vec3)) -> bool {
    low.cmple(point).all() && high.cmpge(point).all()
}

/// Walks the tree from the root; every invariant fails with the values it saw.
fn validate(context: &TestContext, bvh: &Bvh, mesh: &Mesh) -> Statistics {
    let nodes = context.download(bvh.nodes().buffer()).unwrap();
    let texels = context.download(bvh.triangles().buffer()).unwrap();
    let mut statistics = Statistics::default();
    let mut seen = vec![0; mesh.triangles.len()];
    // A node with the bounds that all of its ancestors have for it.
    let mut stack = vec![(0usize, Vec::new())];
    while let Some((index, around)) = stack.pop() {
        statistics.nodes += 1;
        statistics.levels = statistics.levels.max(around.len() + 1);
        for (bounds, kind, first) in children(&nodes[NODE_TEXELS * index..][..NODE_TEXELS]) {
            let around: Vec<_> = around.iter().copied().chain([bounds]).collect();
            if kind == KIND_INNER {
                assert!(first > index, "node {index} has child {first}");
                stack.push((first, around));
                continue;
            }
            statistics.leaves += 1;
            for texels in texels[TRIANGLE_TEXELS * first..].chunks(TRIANGLE_TEXELS).take(kind as usize) {
                let words = texels.as_flattened();
                let triangle = words[9] as usize;
                seen[triangle] += 1;
                let corners = mesh.triangles[triangle].map(|v| mesh.positions[v as usize]);
                let stored = [0, 3, 6].map(|k| Vec3::from([k, k + 1, k + 2].map(|word| f32::from_bits(words[word]))));
                assert_eq!(stored, corners, "triangle {triangle}");
                for corner in corners {
                    let outside = around.iter().find(|bounds| !is_inside(corner, **bounds));
                    assert!(outside.is_none(), "{corner} of {triangle} outside {outside:?}");
                }
            }
        }
    }
    assert!(seen.iter().all(|&count| count == 1), "each triangle lies in one leaf, found {seen:?}");
    assert_eq!(statistics.nodes * NODE_TEXELS, nodes.len(), "nodes that no parent has");
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
        assert!(statistics.leaves <= count && statistics.leaves * LEAF_TRIANGLES >= count, "{statistics:?} of {count}");
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
    // Only the triangles move: bounds are left behind.
    let mut texels = context.download(bvh.triangles().buffer()).unwrap();
    for words in texels.chunks_mut(TRIANGLE_TEXELS).map(<[[u32; 4]]>::as_flattened_mut) {
        let corners = mesh.triangles[words[9] as usize].map(|v| mesh.positions[v as usize].to_array());
        for (word, coordinate) in words.iter_mut().zip(corners.as_flattened()) {
            *word = coordinate.to_bits();
        }
    }
    context.write(bvh.triangles().buffer(), &texels).unwrap();
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
    let fresh = context.download(bvh.nodes().buffer()).unwrap();
    let moved = Mesh {
        positions: mesh.positions.iter().map(|p| *p + 0.3 * Vec3::new(p.y * p.y, p.z, p.x)).collect(),
        triangles: mesh.triangles.clone(),
    };
    refit(&bvh, &moved.positions);
    validate(&context, &bvh, &moved);
    refit(&bvh, &mesh.positions);
    assert!(context.download(bvh.nodes().buffer()).unwrap() == fresh, "refit to the built positions changes the tree");

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
fn trees_are_never_deeper_than_the_stack() {
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
        assert!(topology.level_count() <= MAX_LEVELS, "{} levels", topology.level_count());
    }
}
