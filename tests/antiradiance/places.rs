//! Where leaves, nodes and splats are, against plain sums over triangles; and light on its way from and to elements.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, settings, solve};
use crate::twins;
use glam::{DMat3, DVec3, Vec3};
use linklight::gpu::shaders::types::HierarchyNode;
use linklight::methods::antiradiance::Settings;
use linklight::scene::LightKind;
use linklight::stages::hierarchy::NONE;

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

/// A vertex's cell: a third of each triangle around it.
fn cell(vertex: u32, positions: &[Vec3], triangles: &[[u32; 3]]) -> Place {
    let own = positions[vertex as usize].as_dvec3();
    let around: Vec<[DVec3; 3]> = triangles
        .iter()
        .filter(|corners| corners.contains(&vertex))
        .map(|corners| corners.map(|v| positions[v as usize].as_dvec3()))
        .collect();
    let across = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    // The third is two triangles: the vertex, the middle of the triangle, the middle of either edge.
    let parts: Vec<[DVec3; 3]> = around
        .iter()
        .flat_map(|corners| {
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let others: Vec<DVec3> = corners.iter().copied().filter(|corner| *corner != own).collect();
            others.into_iter().map(move |corner| [own, 0.5 * (own + corner), middle])
        })
        .collect();
    let area = |part: &[DVec3; 3]| 0.5 * across(*part).length();
    let total: f64 = parts.iter().map(area).sum();
    let center = parts.iter().map(|p| area(p) * (p[0] + p[1] + p[2]) / 3.0).sum::<DVec3>() / total;
    let vector_area = around.iter().map(|corners| across(*corners) / 6.0).sum::<DVec3>();
    let normal = vector_area.normalize();
    let edges = around.iter().flatten().map(|corner| *corner - own).filter(|edge| edge.length_squared() > 0.0);
    let shortest = edges.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared())).unwrap();
    let along = shortest.reject_from(normal).normalize();
    let axes = [along, normal.cross(along)];
    let squares = axes.map(|axis| {
        let moment = |part: &[DVec3; 3]| {
            let [a, b, c] = part.map(|corner| (corner - center).dot(axis));
            area(part) / 6.0 * (a * a + b * b + c * c + a * b + b * c + c * a)
        };
        3.0 * parts.iter().map(moment).sum::<f64>() / total
    });
    // The same area.
    let scale = total / (4.0 * (squares[0] * squares[1]).sqrt());
    let rectangle = scale * (squares[0] * outer(axes[0]) + squares[1] * outer(axes[1]));
    Place { center, vector_area, rectangle }
}

#[test]
fn leaves_nodes_and_splats_are_where_their_triangles_are() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.9));
    let method = prepare(&context, &fixture, settings(72));
    let hierarchy = method.hierarchy();
    let nodes = context.download(&hierarchy.nodes).unwrap();
    let leaves = context.download(&hierarchy.leaves).unwrap();
    let positions = context.download(&fixture.world.positions).unwrap();
    let mut rectangles = 0;
    for leaf in &leaves {
        let (node, place) = (&nodes[leaf.node as usize], cell(leaf.element, &positions, &fixture.geometry.triangles));
        let size = f64::from(node.radius);
        assert!(node.center.as_dvec3().distance(place.center) < 1e-5 + 1e-4 * size);
        assert!((leaf.normal.as_dvec3() * f64::from(leaf.area) - place.vector_area).length() < 1e-4 * size * size);
        assert!(node.area == leaf.area && node.radius > 0.0);
        // Of two edges of one length either may be the shortest.
        rectangles += usize::from(largest(rectangle(node) - place.rectangle) < 1e-3 * size * size);
    }
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
    let flat = leaves.iter().filter(|leaf| nodes[leaf.node as usize].surface != NONE);
    assert_eq!(splats.len(), flat.clone().count());
    for (splat, leaf) in splats.iter().zip(flat) {
        let node = &nodes[leaf.node as usize];
        assert_eq!((splat.center, splat.half_u, splat.half_v), (node.center, node.half_u, node.half_v));
        assert_eq!((splat.element, splat.back_element, splat.surface), (leaf.element, leaf.back_element, node.surface));
    }
}

#[test]
fn leaves_send_what_elements_reflect_and_elements_take_what_leaves_receive() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 6, 0);
    let wall = parallelogram(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0, 5, 0);
    let lamp = (light(LightKind::Point, 5.0), Vec3::new(0.3, 1.5, 0.2), Vec3::NEG_Y);
    let fixture =
        Fixture::new(&context, scene(vec![lambert(Vec3::new(0.8, 0.5, 0.2))], vec![floor, wall], &[lamp]), None);
    let mut method = prepare(&context, &fixture, Settings { smoothing: false, ..settings(72) });
    let indirect = solve(&context, &mut method, &fixture, 2).indirect;
    let leaves = context.download(&method.hierarchy().leaves).unwrap();
    let albedo = context.download(&method.elements().albedo).unwrap();
    let punctual = context.download(method.punctual_irradiance()).unwrap();
    let source = context.download(&method.tables().source).unwrap();
    let irradiance = context.download(&method.tables().irradiance).unwrap();
    let (mut lit, mut received) = (0, 0);
    for (index, leaf) in leaves.iter().enumerate() {
        for (side, element) in [leaf.element, leaf.back_element].into_iter().enumerate().filter(|(_, e)| *e != NONE) {
            let (element, slot) = (element as usize, 2 * index + side);
            let expected = albedo[element] * punctual[element];
            assert!((source[slot] - expected).abs().max_element() <= 1e-6 * expected.max_element());
            assert_eq!(indirect[element], irradiance[slot].max(Vec3::ZERO));
            lit += usize::from(source[slot] != Vec3::ZERO);
            received += usize::from(indirect[element] != Vec3::ZERO);
        }
    }
    assert!(lit > 10 && received > 10, "{lit} lit, {received} received");
}
