//! Flattening: instances, winding, budgets, refusals; adjacency and welding.

use glam::{Mat4, Vec3};
use linklight::scene::adjacency::{incident_triangles, one_ring, weld};
use linklight::scene::deform::{world_positions, world_vertices};
use linklight::scene::geometry::{Geometry, GeometryCounts, GeometryError};
use linklight::scene::pose::Pose;
use linklight::scene::{Node, Transform};
use proptest::prelude::*;

use crate::made::{cube, primitive, scene_of, square};

const BUDGET: u64 = 1 << 30;

fn at(matrix: Mat4) -> Node {
    Node { mesh: Some(0), transform: Transform::Matrix(matrix), ..Default::default() }
}

#[test]
fn instances_are_expanded_and_mirrored_ones_face_the_same_way() {
    let mut scene = scene_of(cube());
    scene.nodes.push(at(Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0))));
    scene.nodes.push(at(Mat4::from_scale(Vec3::new(-1.0, -2.0, 1.0))));
    let geometry = Geometry::flatten(&scene, BUDGET).unwrap();
    assert_eq!(geometry.counts(), GeometryCounts::of(&scene));
    assert_eq!((geometry.vertex_count(), geometry.triangle_count()), (3 * 24, 3 * 12));
    assert_eq!(geometry.parts.iter().map(|part| part.mirrored).collect::<Vec<_>>(), [false, true, false]);
    let world = world_vertices(&geometry, &Pose::rest(&scene));
    for (triangle, &part) in geometry.triangles.iter().zip(&geometry.triangle_part) {
        let [a, b, c] = triangle.map(|index| world.positions[index as usize]);
        let facing = (b - a).cross(c - a).normalize();
        assert!(facing.dot(world.normals[triangle[0] as usize]) > 0.999, "part {part}");
        assert!(triangle.iter().all(|&index| geometry.vertex_part[index as usize] == part));
    }
}

#[test]
fn a_mirroring_skin_flips_even_when_its_node_does_not() {
    let mut skinned = square();
    skinned.joints = vec![[0; 8]; 4];
    skinned.joint_weights = vec![[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]; 4];
    let mut scene = scene_of(skinned);
    scene.nodes[0].skin = Some(0);
    scene.skins = vec![linklight::scene::Skin {
        joints: vec![0],
        inverse_bind: vec![Mat4::from_scale(Vec3::new(1.0, 1.0, -1.0))],
    }];
    assert!(Geometry::flatten(&scene, BUDGET).unwrap().parts[0].mirrored);
}

#[test]
fn memory_is_refused_before_allocating_with_both_numbers() {
    let scene = scene_of(cube());
    let needed = GeometryCounts::of(&scene).bytes();
    assert!(Geometry::flatten(&scene, needed).is_ok());
    let error = Geometry::flatten(&scene, needed - 1).unwrap_err();
    assert_eq!(error, GeometryError::OutOfMemory { what: "the flattened scene", needed, available: needed - 1 });
    assert!(error.to_string().contains("--elements"), "{error}");
    let counts = GeometryCounts { vertices: 1 << 33, ..Default::default() };
    assert!(matches!(counts.check("x", u64::MAX), Err(GeometryError::TooMany { what: "vertices", .. })));
    let counts = GeometryCounts { morph_deltas: u64::MAX, triangles: u64::MAX, ..Default::default() };
    assert!(counts.check("x", u64::MAX).is_err());
}

#[test]
fn the_stated_bytes_are_the_held_bytes() {
    let mut scene = scene_of(cube());
    scene.meshes[0].primitives[0].morph_targets = vec![Default::default(); 3];
    let g = Geometry::flatten(&scene, BUDGET).unwrap();
    let held = size_of_val(&*g.local_positions)
        + size_of_val(&*g.local_normals)
        + size_of_val(&*g.local_tangents)
        + g.uv.iter().map(|set| size_of_val(&**set)).sum::<usize>()
        + size_of_val(&*g.colors)
        + size_of_val(&*g.vertex_part)
        + size_of_val(&*g.triangles)
        + size_of_val(&*g.triangle_part)
        + size_of_val(&*g.parts)
        + size_of_val(&*g.morph_positions) * 3;
    assert_eq!(held as u64, GeometryCounts::of(&scene).bytes());
}

#[test]
fn bad_indices_and_far_vertices_are_refused() {
    let mut scene = scene_of(square());
    scene.meshes[0].primitives[0].triangles[1][2] = 4;
    let error = Geometry::flatten(&scene, BUDGET).unwrap_err();
    assert!(matches!(error, GeometryError::OutOfRange { value: 4, allowed: 4, .. }), "{error}");

    let mut scene = scene_of(square());
    scene.nodes[0].transform = Transform::Matrix(Mat4::from_scale(Vec3::splat(1e30)));
    let mut child = at(Mat4::from_scale(Vec3::splat(1e30)));
    child.parent = Some(0);
    scene.nodes[0].mesh = None;
    scene.nodes.push(child);
    let error = Geometry::flatten(&scene, BUDGET).unwrap_err();
    assert!(matches!(error, GeometryError::TooFar { node: 1, .. }), "{error}");
}

#[test]
fn absent_attributes_have_usable_values() {
    let mut bare = square();
    bare.normals.clear();
    bare.uv[0].clear();
    let geometry = Geometry::flatten(&scene_of(bare), BUDGET).unwrap();
    assert_eq!(geometry.local_normals, [Vec3::Z; 4]);
    for (tangent, normal) in geometry.local_tangents.iter().zip(&geometry.local_normals) {
        assert!(tangent.truncate().dot(*normal).abs() < 1e-6 && (tangent.truncate().length() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn cube_corners_weld_into_eight_groups_of_three() {
    let scene = scene_of(cube());
    let geometry = Geometry::flatten(&scene, BUDGET).unwrap();
    let welded = weld(&world_positions(&geometry, &Pose::rest(&scene)));
    assert_eq!(welded.group_count, 8);
    let members = welded.members();
    for group in 0..8 {
        assert_eq!(members.row(group).len(), 3);
        assert!(members.row(group).iter().all(|&vertex| welded.group_of[vertex as usize] == group));
    }
    assert_eq!(weld(&[Vec3::ZERO, -Vec3::ZERO, Vec3::X]).group_of, [0, 0, 1]);
}

#[test]
fn a_fan_has_the_ring_it_shows() {
    // Vertex 0 in the middle of 1, 2, 3, 4; vertex 5 stands alone.
    let triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 4]];
    let ring = one_ring(6, &triangles);
    assert_eq!(ring.row(0), [1, 2, 3, 4]);
    assert_eq!(ring.row(1), [0, 2]);
    assert_eq!(ring.row(2), [0, 1, 3]);
    assert_eq!(ring.row(5), [] as [u32; 0]);
    let incident = incident_triangles(6, &triangles);
    assert_eq!(incident.row(0), [0, 1, 2]);
    assert_eq!(incident.row(3), [1, 2]);
    assert_eq!(incident.row_count(), 6);
}

proptest! {
    #[test]
    fn rings_are_symmetric_and_complete(corners in prop::collection::vec((0u32..9, 0u32..9, 0u32..9), 0..20)) {
        let triangles: Vec<[u32; 3]> = corners.into_iter().map(|(a, b, c)| [a, b, c]).collect();
        let ring = one_ring(9, &triangles);
        for a in 0..9 {
            for b in 0..9 {
                let touch = a != b && triangles.iter().any(|t| t.contains(&a) && t.contains(&b));
                prop_assert_eq!(ring.row(a).contains(&b), touch);
                prop_assert_eq!(ring.row(b).contains(&a), touch);
            }
        }
    }

    #[test]
    fn smooth_normals_point_out_of_a_fan(heights in prop::collection::vec(-0.3f32..0.3, 4)) {
        let rim = [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y];
        let mut positions = vec![Vec3::ZERO];
        positions.extend(rim.iter().zip(&heights).map(|(rim, height)| *rim + Vec3::Z * *height));
        let mut fan = primitive(positions, vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]);
        fan.normals.clear();
        let geometry = Geometry::flatten(&scene_of(fan), BUDGET).unwrap();
        prop_assert!(geometry.local_normals.iter().all(|n| n.z > 0.5 && (n.length() - 1.0).abs() < 1e-5));
    }
}
