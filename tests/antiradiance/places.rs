//! Where leaves, nodes and splats are, against plain sums over triangles; and light on its way from and to elements.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, settings, solve};
use crate::twins;
use glam::{DMat3, DVec3, Vec3};
use linklight::gpu::shaders::types::{HierarchyLeaf, HierarchyNode};
use linklight::methods::antiradiance::{Leaves, Settings};
use linklight::scene::LightKind;
use linklight::stages::hierarchy::NONE;
use std::collections::BTreeSet;

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// `u u^T + v v^T` of a rectangle's half sides: the same whichever side is called which.
fn rectangle(node: &HierarchyNode) -> DMat3 {
    outer(node.half_u.as_dvec3()) + outer(node.half_v.as_dvec3())
}

fn largest(m: DMat3) -> f64 {
    m.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max)
}

struct Place {
    center: DVec3,
    vector_area: DVec3,
    rectangle: DMat3,
}

/// The cells of a leaf's vertices: a third of each triangle around them.
fn cells(leaf: &HierarchyLeaf, members: &[u32], positions: &[Vec3], triangles: &[[u32; 3]]) -> Place {
    let at = |vertex: u32| positions[vertex as usize].as_dvec3();
    let around = |vertex: u32| -> Vec<[DVec3; 3]> {
        triangles.iter().filter(|corners| corners.contains(&vertex)).map(|corners| corners.map(at)).collect()
    };
    let across = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    // A third is two triangles: the vertex, the middle of the triangle, the middle of either edge.
    let thirds = |vertex: u32| -> Vec<[DVec3; 3]> {
        let own = at(vertex);
        around(vertex)
            .iter()
            .flat_map(|corners| {
                let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
                let others: Vec<DVec3> = corners.iter().copied().filter(|corner| *corner != own).collect();
                others.into_iter().map(move |corner| [own, 0.5 * (own + corner), middle])
            })
            .collect()
    };
    let parts: Vec<[DVec3; 3]> = members.iter().flat_map(|&vertex| thirds(vertex)).collect();
    let area = |part: &[DVec3; 3]| 0.5 * across(*part).length();
    let total: f64 = parts.iter().map(area).sum();
    let center = parts.iter().map(|p| area(p) * (p[0] + p[1] + p[2]) / 3.0).sum::<DVec3>() / total;
    let corners = members.iter().flat_map(|&vertex| around(vertex));
    let vector_area = corners.map(|corners| across(corners) / 6.0).sum::<DVec3>();
    let normal = vector_area.normalize();
    let own = at(leaf.element);
    let middle = around(leaf.element);
    let edges = middle.iter().flatten().map(|corner| *corner - own).filter(|edge| edge.length_squared() > 0.0);
    let shortest = edges.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared())).unwrap();
    let edge = if leaf.along.x == NONE { shortest } else { at(leaf.along.y) - at(leaf.along.x) };
    let along = edge.reject_from(normal).normalize();
    let axes = [along, normal.cross(along)];
    let squares = axes.map(|axis| {
        let moment = |part: &[DVec3; 3]| {
            let [a, b, c] = part.map(|corner| (corner - center).dot(axis));
            area(part) / 6.0 * (a * a + b * b + c * c + a * b + b * c + c * a)
        };
        3.0 * parts.iter().map(moment).sum::<f64>() / total
    });
    // Of the area seen along the normal.
    let scale = vector_area.length() / (4.0 * (squares[0] * squares[1]).sqrt());
    let rectangle = scale * (squares[0] * outer(axes[0]) + squares[1] * outer(axes[1]));
    Place { center, vector_area, rectangle }
}

#[test]
fn leaves_nodes_and_splats_are_where_their_triangles_are() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.9));
    are_in_place(&context, &fixture, settings(72));
}

/// Squares of 1.1 m: walls of five times five, and blocks of two times two, in place of seven and three vertices a side.
#[test]
fn patches_are_where_their_triangles_are() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.9));
    let by_patches = Settings { leaves: Leaves::Patches, patch_side: 0.12, ..settings(72) };
    let leaves = are_in_place(&context, &fixture, by_patches);
    let vertices = fixture.rest_positions.len();
    println!("{leaves} patches of {vertices} vertices");
    assert!(leaves < vertices / 2);
}

/// How many leaves there are.
fn are_in_place(context: &TestContext, fixture: &Fixture, settings: Settings) -> usize {
    let method = prepare(context, fixture, settings);
    let hierarchy = method.hierarchy();
    let nodes = context.download(&hierarchy.nodes).unwrap();
    let leaves = context.download(&hierarchy.leaves).unwrap();
    let positions = context.download(&fixture.world.positions).unwrap();
    let mut rectangles = 0;
    for leaf in &leaves {
        let members = hierarchy.plan.members_of(nodes[leaf.node as usize].leaf);
        assert!(members.contains(&leaf.element) && members.is_sorted());
        let node = &nodes[leaf.node as usize];
        let place = cells(leaf, members, &positions, &fixture.geometry.triangles);
        let size = f64::from(node.radius);
        assert!(node.center.as_dvec3().distance(place.center) < 1e-5 + 1e-4 * size);
        assert!((leaf.normal.as_dvec3() * f64::from(leaf.area) - place.vector_area).length() < 1e-4 * size * size);
        assert!(node.area == leaf.area && node.radius > 0.0);
        // Of two edges of one length either may be the shortest.
        rectangles += usize::from(largest(rectangle(node) - place.rectangle) < 1e-3 * size * size);
    }
    let all: BTreeSet<u32> = hierarchy.plan.members.iter().copied().collect();
    assert_eq!((all.len(), hierarchy.plan.members.len()), (positions.len(), positions.len()), "each vertex once");
    let surface: f64 = fixture
        .geometry
        .triangles
        .iter()
        .map(|corners| corners.map(|vertex| positions[vertex as usize].as_dvec3()))
        .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
        .sum();
    let held: f64 = leaves.iter().map(|leaf| f64::from(leaf.area)).sum();
    assert!((held / surface - 1.0).abs() < 1e-4, "{held} m2 of {surface}");
    println!("{rectangles} of {} rectangles as their twins'", leaves.len());
    assert!(rectangles * 100 >= 95 * leaves.len());

    // Inner nodes from their children.
    for (index, node) in nodes.iter().enumerate().filter(|(_, node)| node.leaf == NONE) {
        let children: Vec<&HierarchyNode> = twins::children(&nodes, index as u32).map(|c| &nodes[c as usize]).collect();
        let area: f64 = children.iter().map(|child| f64::from(child.area)).sum();
        let center = children.iter().map(|c| f64::from(c.area) * c.center.as_dvec3()).sum::<DVec3>() / area;
        assert!(node.center.as_dvec3().distance(center) < 1e-4, "node {index}");
        if node.shape == NONE {
            assert!(node.half_u == Vec3::ZERO && node.half_v == Vec3::ZERO);
            continue;
        }
        let axes = [children[0].half_u, children[0].half_v].map(|half| half.as_dvec3().normalize());
        let expected = axes.map(|axis| {
            let moment = |child: &&HierarchyNode| {
                let offset = (child.center.as_dvec3() - center).dot(axis);
                f64::from(child.area) * (offset * offset + axis.dot(rectangle(child) * axis) / 3.0)
            };
            3.0 * children.iter().map(moment).sum::<f64>() / area * outer(axis)
        });
        let size = f64::from(node.radius);
        assert!(largest(rectangle(node) - expected[0] - expected[1]) < 1e-4 * size * size, "node {index}");
    }

    let splats = context.download(&method.splats().splats).unwrap();
    let shares = context.download(&method.splats().shares).unwrap();
    let flat = leaves.iter().filter(|leaf| nodes[leaf.node as usize].surface != NONE);
    assert_eq!(splats.len(), flat.clone().count());
    for (splat, leaf) in splats.iter().zip(flat) {
        let node = &nodes[leaf.node as usize];
        assert_eq!((splat.center, splat.half_u, splat.half_v), (node.center, node.half_u, node.half_v));
        assert_eq!(splat.surface, node.surface);
        let own = &shares[splat.first_share as usize..][..splat.share_count as usize];
        let members: Vec<u32> = own.iter().map(|member| member.vertex).collect();
        assert_eq!(members, hierarchy.plan.members_of(node.leaf));
        assert!((own.iter().map(|member| member.share).sum::<f32>() - 1.0).abs() < 1e-5);
    }
    leaves.len()
}

#[test]
fn leaves_send_what_elements_reflect_and_elements_take_what_leaves_receive() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 6, 0);
    let wall = parallelogram(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0, 5, 0);
    let lamp = (light(LightKind::Point, 5.0), Vec3::new(0.3, 1.5, 0.2), Vec3::NEG_Y);
    let fixture =
        Fixture::new(&context, scene(vec![lambert(Vec3::new(0.8, 0.5, 0.2))], vec![floor, wall], &[lamp]), None);
    for (leaves, count) in [(Leaves::Vertices, 49 + 36), (Leaves::Patches, 16 + 12)] {
        let mut method =
            prepare(&context, &fixture, Settings { smoothing: false, leaves, patch_side: 0.16, ..settings(72) });
        assert_eq!(method.report().leaves, count);
        let indirect = solve(&context, &mut method, &fixture, 2).indirect;
        let plan = &method.hierarchy().plan;
        let elements = method.elements();
        let albedo = context.download(&elements.albedo).unwrap();
        let area = context.download(&elements.area).unwrap();
        let punctual = context.download(method.punctual_irradiance()).unwrap();
        let source = context.download(&method.tables().source).unwrap();
        let irradiance = context.download(&method.tables().irradiance).unwrap();
        let element = |vertex: u32, side: usize| match side {
            0 => vertex as usize,
            _ => elements.topology.back_elements[vertex as usize] as usize,
        };
        let mut lit = 0;
        for (leaf, side) in (0..count).flat_map(|leaf| [(leaf, 0), (leaf, 1)]) {
            let own = plan.members_of(leaf);
            let total: f32 = own.iter().map(|&vertex| area[vertex as usize]).sum();
            let sent =
                |vertex: u32| area[vertex as usize] * albedo[element(vertex, side)] * punctual[element(vertex, side)];
            let expected = own.iter().map(|&vertex| sent(vertex)).sum::<Vec3>() / total;
            let slot = 2 * leaf as usize + side;
            assert!((source[slot] - expected).abs().max_element() <= 1e-5 * expected.max_element());
            lit += usize::from(source[slot] != Vec3::ZERO);
        }
        let mut received = 0;
        for (vertex, side) in (0..fixture.rest_positions.len() as u32).flat_map(|v| [(v, 0), (v, 1)]) {
            let range = plan.share_offsets[vertex as usize] as usize..plan.share_offsets[vertex as usize + 1] as usize;
            let shares = &plan.shares[range];
            assert!(leaves == Leaves::Patches || shares.len() == 1);
            let expected: Vec3 =
                shares.iter().map(|s| s.share * irradiance[2 * s.leaf as usize + side].max(Vec3::ZERO)).sum();
            let found = indirect[element(vertex, side)];
            assert!((found - expected).abs().max_element() <= 1e-5 * expected.max_element());
            received += usize::from(found != Vec3::ZERO);
        }
        assert!(lit > 10 && received > 10, "{lit} lit, {received} received");
    }
}
