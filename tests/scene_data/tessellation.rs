//! Tessellation: no T-junctions, area kept, hard edges hard, attributes interpolated, counts near the target.

use std::collections::{HashMap, HashSet};

use glam::{DVec3, Mat4, Quat, Vec2, Vec3, Vec4};
use linklight::scene::adjacency::weld;
use linklight::scene::deform::world_vertices;
use linklight::scene::geometry::{Geometry, GeometryError};
use linklight::scene::pose::Pose;
use linklight::scene::tessellate::patch::shape;
use linklight::scene::tessellate::{Fineness, Tessellation, TessellationError, tessellate};
use linklight::scene::{MorphTarget, Node, Primitive, Scene, Skin, Transform};
use proptest::prelude::*;

use crate::made::{assert_near, cube, primitive, scene_of, square};

const BUDGET: u64 = 1 << 30;

fn cut(scene: &Scene, fineness: Fineness) -> Tessellation {
    let geometry = Geometry::flatten(scene, BUDGET).unwrap();
    tessellate(geometry, &Pose::rest(scene), fineness, BUDGET).unwrap()
}

/// A bumpy sheet over the unit square, `n` cells a side, diagonals and heights by `seed`.
fn sheet(n: u32, seed: u64) -> Primitive {
    let mut state = seed;
    let mut next = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let side = n + 1;
    let mut positions = Vec::new();
    for index in 0..side * side {
        let (x, y) = ((index % side) as f32, (index / side) as f32);
        let inner = |c: f32| c > 0.0 && c < n as f32;
        let jitter = |c: f32, r: f32| if inner(c) { c + 0.7 * (r - 0.5) } else { c };
        positions.push(Vec3::new(jitter(x, next()), jitter(y, next()), 0.5 * next()) / n as f32);
    }
    let mut triangles = Vec::new();
    for cell in 0..n * n {
        let a = cell / n * side + cell % n;
        let [a, b, c, d] = [a, a + 1, a + side + 1, a + side];
        let split = if next() < 0.5 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        triangles.extend(split);
    }
    primitive(positions, triangles)
}

/// Directed edges by welded position, with how often each occurs.
fn directed_edges(triangles: &[[u32; 3]], group_of: &[u32]) -> HashMap<(u32, u32), u32> {
    let mut edges = HashMap::new();
    for corners in triangles {
        for k in 0..3 {
            let [a, b] = [corners[k], corners[(k + 1) % 3]].map(|vertex| group_of[vertex as usize]);
            *edges.entry((a, b)).or_insert(0) += 1;
        }
    }
    edges
}

/// Total length of edges without exactly one partner the other way round.
fn open_length(triangles: &[[u32; 3]], positions: &[Vec3]) -> f64 {
    let welded = weld(positions);
    let members = welded.members();
    let at = |group: u32| positions[members.row(group)[0] as usize].as_dvec3();
    let edges = directed_edges(triangles, &welded.group_of);
    let open = edges.iter().filter(|((a, b), count)| **count != 1 || edges.get(&(*b, *a)) != Some(&1));
    open.map(|((a, b), count)| at(*a).distance(at(*b)) * f64::from(*count)).sum()
}

fn corners(triangle: [u32; 3], positions: &[Vec3]) -> [DVec3; 3] {
    triangle.map(|vertex| positions[vertex as usize].as_dvec3())
}

fn area(triangles: &[[u32; 3]], positions: &[Vec3]) -> f64 {
    let one = |&triangle| {
        let [a, b, c] = corners(triangle, positions);
        (b - a).cross(c - a).length() * 0.5
    };
    triangles.iter().map(one).sum()
}

fn longest_edge(triangles: &[[u32; 3]], positions: &[Vec3]) -> f64 {
    let sides = triangles.iter().flat_map(|&triangle| {
        let [a, b, c] = corners(triangle, positions);
        [a.distance(b), b.distance(c), c.distance(a)]
    });
    sides.fold(0.0, f64::max)
}

/// Mean and least shape (1 is equilateral).
fn shapes(result: &Tessellation) -> (f64, f64) {
    let shapes = result.geometry.triangles.iter().map(|&t| shape(corners(t, &result.rest_positions)));
    let (sum, least) = shapes.fold((0.0, 1.0f64), |(sum, least), s| (sum + s, least.min(s)));
    (sum / result.geometry.triangles.len() as f64, least)
}

fn check_consistent(geometry: &Geometry) {
    for (index, part) in geometry.parts.iter().enumerate() {
        let vertices = part.vertex_offset..part.vertex_offset + part.vertex_count;
        assert!(vertices.clone().all(|vertex| geometry.vertex_part[vertex as usize] == index as u32));
        let triangles = part.triangle_offset as usize..(part.triangle_offset + part.triangle_count) as usize;
        assert!(geometry.triangles[triangles.clone()].iter().flatten().all(|vertex| vertices.contains(vertex)));
        assert!(geometry.triangle_part[triangles].iter().all(|&part| part == index as u32));
    }
    let n = geometry.local_positions.len();
    assert_eq!(n as u32, geometry.parts.iter().map(|part| part.vertex_count).sum::<u32>());
    assert_eq!(
        [n; 5],
        [
            geometry.local_normals.len(),
            geometry.local_tangents.len(),
            geometry.uv[0].len(),
            geometry.uv[1].len(),
            geometry.colors.len(),
        ]
    );
    let used: HashSet<u32> = geometry.triangles.iter().flatten().copied().collect();
    assert_eq!(used.len(), n, "every vertex is used");
}

/// Two cubes of which one touches the other, one of them mirrored.
fn cubes() -> Scene {
    let mut scene = scene_of(cube());
    let place = |matrix| Node { mesh: Some(0), transform: Transform::Matrix(matrix), ..Default::default() };
    scene.nodes.push(place(Mat4::from_translation(Vec3::X)));
    scene.nodes.push(place(Mat4::from_scale(Vec3::new(-1.0, 0.5, 2.0))));
    scene
}

#[test]
fn a_closed_surface_of_separate_sides_stays_closed() {
    for max_edge in [0.9, 0.5, 0.31, 0.1] {
        let scene = scene_of(cube());
        let result = cut(&scene, Fineness::MaxEdge(max_edge));
        let g = &result.geometry;
        check_consistent(g);
        assert_eq!(open_length(&g.triangles, &result.rest_positions), 0.0, "open at {max_edge}");
        assert!(longest_edge(&g.triangles, &result.rest_positions) <= f64::from(max_edge) * 1.00001);
        assert!((area(&g.triangles, &result.rest_positions) / 6.0 - 1.0).abs() < 1e-5);
        // Hard edges stay hard: normals are those of the sides, and no vertex belongs to two sides.
        let mut side_of = HashMap::new();
        for triangle in &g.triangles {
            let normal = g.local_normals[triangle[0] as usize];
            let [a, b, c] = corners(*triangle, &result.rest_positions);
            assert_near((b - a).cross(c - a).normalize().as_vec3(), normal, 1e-4);
            for vertex in triangle {
                assert_near(g.local_normals[*vertex as usize], normal, 1e-6);
                assert_eq!(*side_of.entry(*vertex).or_insert(normal.to_string()), normal.to_string());
            }
        }
        // Euler: a welded closed surface like the sphere.
        let welded = weld(&result.rest_positions).group_count as i64;
        assert_eq!(welded - g.triangles.len() as i64 / 2, 2);
    }
}

#[test]
fn the_open_length_check_sees_a_t_junction() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.5, 0.5, 0.0), Vec3::ONE];
    let whole = [[0, 1, 2], [2, 1, 4]];
    let torn = [[0, 1, 3], [0, 3, 2], [2, 1, 4]];
    let outline = open_length(&whole, &positions);
    assert!(open_length(&torn, &positions) > outline + 2.0);
}

#[test]
fn shared_vertices_stay_shared_and_neighbouring_objects_fit() {
    let result = cut(&scene_of(square()), Fineness::MaxEdge(0.1));
    // One vertex per place: nothing along the diagonal is doubled.
    assert_eq!(weld(&result.rest_positions).group_count, result.geometry.vertex_count());
    assert!((open_length(&result.geometry.triangles, &result.rest_positions) - 4.0).abs() < 1e-5);

    let scene = cubes();
    let result = cut(&scene, Fineness::MaxEdge(0.23));
    check_consistent(&result.geometry);
    // The sides at x = 1 of the first cube and of its neighbour are cut at the same border places.
    let border = |part: u32| -> HashSet<String> {
        let on = |p: &Vec3| p.x == 1.0 && [p.y, p.z].iter().any(|c| *c == 0.0 || *c == 1.0);
        let vertices = result.rest_positions.iter().zip(&result.geometry.vertex_part);
        vertices.filter(|(p, of)| **of == part && on(p)).map(|(p, _)| p.to_string()).collect()
    };
    assert!(border(0).len() > 16);
    assert_eq!(border(0), border(1));
    // Deforming anew puts the vertices where they were cut, and the mirrored part still faces out.
    let world = world_vertices(&result.geometry, &Pose::rest(&scene));
    for (deformed, cut) in world.positions.iter().zip(&result.rest_positions) {
        assert_near(*deformed, *cut, 1e-6);
    }
    for triangle in &result.geometry.triangles {
        let [a, b, c] = corners(*triangle, &world.positions);
        assert!((b - a).cross(c - a).normalize().as_vec3().dot(world.normals[triangle[1] as usize]) > 0.999);
    }
}

#[test]
fn attributes_are_interpolated_linearly() {
    let mut rich = square();
    let at = |corner: &Vec3| Vec4::new(corner.x, corner.y, 1.0 - corner.x, 0.5);
    rich.colors = rich.positions.iter().map(at).collect();
    rich.normals = rich.positions.iter().map(|p| (*p - Vec3::new(0.5, 0.5, -1.0)).normalize()).collect();
    rich.tangents = vec![Vec4::new(1.0, 0.0, 0.0, -1.0); 4];
    rich.morph_targets = vec![
        MorphTarget { positions: rich.positions.iter().map(|p| *p * 2.0).collect(), ..Default::default() },
        MorphTarget { normals: rich.positions.iter().map(|p| Vec3::Z * p.x).collect(), ..Default::default() },
    ];
    let mut scene = scene_of(rich);
    scene.nodes[0].transform = Transform::Trs {
        translation: Vec3::new(5.0, -2.0, 1.0),
        rotation: Quat::from_rotation_y(0.7),
        scale: Vec3::splat(3.0),
    };
    let g = cut(&scene, Fineness::MaxEdge(0.4)).geometry;
    assert!(g.vertex_count() > 80);
    for vertex in 0..g.local_positions.len() {
        let p = g.local_positions[vertex];
        assert!((g.uv[0][vertex] - p.truncate()).length() < 1e-6 && g.uv[1][vertex] == Vec2::ZERO);
        assert!((g.colors[vertex] - at(&p)).length() < 1e-6);
        assert!((g.local_normals[vertex].length() - 1.0).abs() < 1e-6);
        let expected = (p - Vec3::new(0.5, 0.5, -1.0)).normalize();
        assert_near(g.local_normals[vertex], expected, 1e-6);
        assert_eq!(g.local_tangents[vertex].w, -1.0);
        assert_near(g.morph_positions[vertex], p * 2.0, 1e-6);
        assert_near(g.morph_normals[vertex + g.local_positions.len()], Vec3::Z * p.x, 1e-6);
    }
    assert_eq!(g.morph_positions.len(), 2 * g.local_positions.len());
}

#[test]
fn skin_influences_merge_to_eight_that_sum_to_one() {
    let mut skinned = primitive(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]);
    // Three disjoint sets of eight joints: inside, 24 compete for eight places.
    skinned.joints = (0..3).map(|v| std::array::from_fn(|slot| (v * 8 + slot) as u16)).collect();
    skinned.joint_weights = (0..3).map(|_| std::array::from_fn(|slot| (slot + 1) as f32 / 36.0)).collect();
    let mut scene = scene_of(skinned);
    scene.nodes[0].skin = Some(0);
    scene.skins = vec![Skin { joints: vec![0; 24], inverse_bind: vec![Mat4::IDENTITY; 24] }];
    let result = cut(&scene, Fineness::MaxEdge(0.2));
    let g = &result.geometry;
    assert_eq!((g.skin_joints.len(), g.skin_weights.len()), (g.local_positions.len(), g.local_positions.len()));
    let b = |p: Vec3| [1.0 - p.x - p.y, p.x, p.y];
    for (vertex, (joints, weights)) in g.skin_joints.iter().zip(&g.skin_weights).enumerate() {
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        assert!(weights.is_sorted_by(|a, b| a >= b) || vertex < 3);
        // The ratio of any two kept weights is that of the exact blend.
        let exact = |joint: u32| b(g.local_positions[vertex])[joint as usize / 8] * (joint % 8 + 1) as f32 / 36.0;
        for slot in 1..8 {
            let (left, right) = (weights[slot] * exact(joints[0]), weights[0] * exact(joints[slot]));
            assert!((left - right).abs() < 1e-5, "vertex {vertex}, slot {slot}: {left} against {right}");
        }
        let kept = weights.iter().zip(joints).filter(|(w, _)| **w > 0.0).map(|(_, j)| exact(*j)).fold(1.0, f32::min);
        let dropped = (0..24).filter(|joint| !joints.contains(joint)).map(exact).fold(0.0, f32::max);
        assert!(dropped <= kept + 1e-6, "vertex {vertex} drops {dropped}, keeps {kept}");
    }
}

#[test]
fn counts_come_near_the_target_and_never_below_the_input() {
    for (name, scene) in [
        ("square", scene_of(square())),
        ("cube", scene_of(cube())),
        ("sheet", scene_of(sheet(12, 3))),
        ("cubes", cubes()),
    ] {
        for target in [400, 1000, 3000, 10_000, 37_000] {
            let result = cut(&scene, Fineness::Elements(target));
            let count = result.geometry.vertex_count();
            let ratio = f64::from(count) / f64::from(target);
            println!("{name}: {target} wanted, {count} made, shape {:?}", shapes(&result));
            assert!((0.8..1.25).contains(&ratio), "{name}: {target} wanted, {count} made");
            let edge = longest_edge(&result.geometry.triangles, &result.rest_positions);
            assert!(edge <= f64::from(result.max_edge) * 1.00001);
        }
        let before = Geometry::flatten(&scene, BUDGET).unwrap();
        for target in [0, 1, before.vertex_count()] {
            assert_eq!(cut(&scene, Fineness::Elements(target)).geometry, before);
        }
    }
}

#[test]
fn large_surfaces_are_cut_where_small_things_already_make_up_the_number() {
    // 961 vertices on a square metre, beside a floor of 4 and 20 m a side.
    let floor = |side: f32| {
        let [x, z] = [Vec3::X * side, Vec3::Z * side];
        primitive(vec![Vec3::ZERO, x, x + z, z], vec![[0, 2, 1], [0, 3, 2]])
    };
    for side in [4.0, 20.0] {
        let mut scene = scene_of(sheet(30, 30));
        scene.meshes[0].primitives.push(floor(side));
        let before = Geometry::flatten(&scene, BUDGET).unwrap().vertex_count();
        let [few, many] = [500, 3000].map(|elements| cut(&scene, Fineness::Balanced { elements, longest_edge: 0.05 }));
        let diagonal = (2.0 * f64::from(side).powi(2) + 1.0).sqrt();
        let edge = longest_edge(&few.geometry.triangles, &few.rest_positions);
        assert!(edge <= 0.05001 * diagonal && edge > 0.02 * diagonal, "floor of {side} m cut to {edge} m");
        let count = few.geometry.vertex_count();
        assert!(count > before + 200 && count < 4 * before, "{before} vertices, {count} after");
        let ratio = f64::from(many.geometry.vertex_count()) / 3000.0;
        assert!((0.8..1.25).contains(&ratio), "{ratio} of the number asked for");
        // Slivers all over would take too many: it stops at about four times as many.
        let fine = cut(&scene, Fineness::Balanced { elements: 500, longest_edge: 1e-4 });
        let growth = f64::from(fine.geometry.vertex_count()) / f64::from(before);
        assert!((2.5..6.0).contains(&growth), "grew {growth} times");
    }
}

#[test]
fn triangles_stay_well_shaped() {
    // A right isosceles triangle has shape 0.866, its half by the height too.
    for target in [300, 1000, 4000, 20_000] {
        let (mean, least) = shapes(&cut(&scene_of(square()), Fineness::Elements(target)));
        assert!(mean > 0.8 && least > 0.5, "square at {target}: mean {mean}, least {least}");
    }
    // Long strips become ladders, not fans of needles.
    let strip =
        primitive(vec![Vec3::ZERO, Vec3::X * 50.0, Vec3::new(50.0, 1.0, 0.0), Vec3::Y], vec![[0, 1, 2], [0, 2, 3]]);
    let result = cut(&scene_of(strip), Fineness::MaxEdge(1.5));
    let count = result.geometry.triangles.len();
    assert!(count < 280, "{count} triangles for a strip of 34 cells");
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let scene = scene_of(sheet(9, 11));
    let [first, second] = [0, 1].map(|_| cut(&scene, Fineness::Elements(5000)));
    assert_eq!(first, second);
}

#[test]
fn what_does_not_fit_is_refused_quickly() {
    let scene = scene_of(cube());
    let refuse = |fineness, budget| {
        let geometry = Geometry::flatten(&scene, BUDGET).unwrap();
        tessellate(geometry, &Pose::rest(&scene), fineness, budget).unwrap_err()
    };
    for fineness in [Fineness::Elements(1_000_000_000), Fineness::MaxEdge(1e-4)] {
        let error = refuse(fineness, BUDGET);
        assert!(matches!(error, TessellationError::Geometry(GeometryError::OutOfMemory { .. })), "{error}");
    }
    let error = refuse(Fineness::MaxEdge(f32::MIN_POSITIVE), u64::MAX);
    assert!(matches!(error, TessellationError::Geometry(GeometryError::TooMany { .. })), "{error}");
    for length in [0.0, -1.0, f32::NAN] {
        assert!(matches!(refuse(Fineness::MaxEdge(length), BUDGET), TessellationError::EdgeLength(_)));
        let balanced = Fineness::Balanced { elements: 9, longest_edge: length };
        assert!(matches!(refuse(balanced, BUDGET), TessellationError::EdgeLength(_)));
    }
    let empty = Scene::default();
    let geometry = Geometry::flatten(&empty, BUDGET).unwrap();
    assert!(tessellate(geometry, &Pose::rest(&empty), Fineness::Elements(100), BUDGET).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn random_sheets_keep_their_outline_and_area(n in 1u32..7, seed in any::<u64>(), max_edge in 0.02f32..1.0) {
        let scene = scene_of(sheet(n, seed));
        let before = Geometry::flatten(&scene, BUDGET).unwrap();
        let result = cut(&scene, Fineness::MaxEdge(max_edge));
        check_consistent(&result.geometry);
        let (t, p) = (&result.geometry.triangles, &result.rest_positions);
        prop_assert!(longest_edge(t, p) <= f64::from(max_edge) * 1.00001);
        let (area_before, area_after) = (area(&before.triangles, &before.local_positions), area(t, p));
        prop_assert!((area_after / area_before - 1.0).abs() < 1e-5);
        // Every inner edge has one partner; what is open is the outline, as before.
        let outline = open_length(&before.triangles, &before.local_positions);
        prop_assert!((open_length(t, p) / outline - 1.0).abs() < 1e-5);
        prop_assert_eq!(weld(p).group_count, result.geometry.vertex_count());
    }

    #[test]
    fn separately_indexed_triangles_fit_as_well(n in 1u32..6, seed in any::<u64>(), max_edge in 0.03f32..0.5) {
        let shared = sheet(n, seed);
        let corners: Vec<Vec3> = shared.triangles.iter().flatten().map(|&v| shared.positions[v as usize]).collect();
        let triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let outline = open_length(&shared.triangles, &shared.positions);
        let result = cut(&scene_of(primitive(corners, triangles)), Fineness::MaxEdge(max_edge));
        let open = open_length(&result.geometry.triangles, &result.rest_positions);
        prop_assert!((open / outline - 1.0).abs() < 1e-5, "{} open, outline {}", open, outline);
    }

    #[test]
    fn any_triangle_ends_with_few_pieces(
        corners in prop::array::uniform3(prop::array::uniform3(prop_oneof![-1.0f32..1.0, Just(0.0f32), Just(1.0)])),
        flat in prop_oneof![Just(1.0f32), Just(1e-2), Just(1e-4), Just(0.0)],
        max_edge in 0.01f32..2.0,
    ) {
        let positions: Vec<Vec3> = corners.iter().map(|c| Vec3::from(*c) * Vec3::new(1.0, flat, flat)).collect();
        let scene = scene_of(primitive(positions.clone(), vec![[0, 1, 2]]));
        let result = cut(&scene, Fineness::MaxEdge(max_edge));
        let [a, b, c] = [0, 1, 2].map(|k| positions[k].as_dvec3());
        let l = f64::from(max_edge);
        let border: f64 = [a.distance(b), b.distance(c), c.distance(a)].iter().map(|e| (e / l).ceil().max(1.0)).sum();
        let area = (b - a).cross(c - a).length() * 0.5;
        let pieces = result.geometry.triangles.len() as f64;
        // An equilateral piece has 0.433 l^2; three times as many, and two per border segment, are plenty.
        prop_assert!(pieces <= 3.0 * area / (0.433 * l * l) + 3.0 * border, "{} pieces", pieces);
        prop_assert!(longest_edge(&result.geometry.triangles, &result.rest_positions) <= l * 1.00001);
    }
}
