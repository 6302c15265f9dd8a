//! Surfels of leaves and of the nodes above them.

use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, builtin_scene};
use crate::twins;
use glam::{DMat3, Vec3};
use linklight::methods::implicit_visibility::Settings;

#[test]
fn surfels_have_the_moments_of_their_cells_and_bound_all_below() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("tea-room"), None);
    let method = fixture.linked(&context, Settings { bins: 2, ..Settings::default() });
    let trees = method.trees();
    let surfels = context.download(&trees.surfels).unwrap();
    let positions = context.download(&fixture.world.positions).unwrap();
    let topology = &trees.topology;

    // A sample of leaves against brute force.
    let mut random = Random(5);
    let (mut seen, mut stretched) = (0, 0);
    while seen < 24 {
        let leaf = random.below(topology.leaf_count());
        let element = topology.leaf_elements[leaf as usize];
        let vertex = method.elements().topology.vertices[element as usize] & !twins::BACK;
        let around: Vec<[u32; 3]> =
            fixture.geometry.triangles.iter().copied().filter(|t| t.contains(&vertex)).collect();
        let (area, mean, covariance) = twins::cell_moments(vertex, &positions, &around);
        let s = &surfels[leaf as usize];
        let is_sliver = s.radius * s.g1.length().max(s.g2.length()) > 20.0; // widened
        if area < 1e-8 || s.thickness > 1e-3 * s.radius || is_sliver {
            continue; // no plane to compare in
        }
        seen += 1;
        // The twin cuts each third along its rim.
        assert!((f64::from(s.area) / area - 1.0).abs() < 0.06, "leaf {leaf}: area {} for {area}", s.area);
        let off = (s.centre.as_dvec3() - mean).length();
        assert!(off < 0.05 * f64::from(s.radius), "leaf {leaf}: centre off by {off}");
        // The ellipse has the covariance's axes: C g . g is the same along both factors.
        let [first, second] = [s.g1.as_dvec3(), s.g2.as_dvec3()].map(|g| g.dot(covariance * g).sqrt());
        assert!((first / second - 1.0).abs() < 0.08, "leaf {leaf}: {first} {second}");
        // And it holds the cell, without much to spare: semi-axes of 2 to 6 standard deviations.
        assert!((2.0..6.0).contains(&first.recip()), "leaf {leaf}: {}", first.recip());
        // A disc of the same area would be told apart from a long cell.
        let (along, across) = (covariance_along(covariance, s.g1), covariance_along(covariance, s.g2));
        stretched += u32::from(along / across > 1.5 || across / along > 1.5);
    }

    assert!(stretched > 2, "{stretched} of {seen} cells are longer than wide");

    // Spheres, slabs and cones of inner nodes hold those of their children.
    for node in topology.leaf_count()..topology.node_count() {
        let s = &surfels[node as usize];
        let mut area = 0.0;
        for child in topology.children(node) {
            let c = &surfels[child as usize];
            area += c.area;
            let offset = c.centre - s.centre;
            assert!(offset.length() + c.radius <= 1.001 * s.radius + 1e-6, "node {node}: a child sticks out");
            let cosine = s.normal.dot(c.normal).clamp(-1.0, 1.0);
            assert!(cosine >= s.cos_cone - 1e-3, "node {node}: a normal outside its cone");
            let across = offset.dot(s.normal).abs();
            assert!(across <= 1.001 * s.thickness + 1e-6, "node {node}: a child outside its slab");
        }
        assert!((s.area - area).abs() <= 1e-4 * area, "node {node}: {} for {area}", s.area);
        assert!(s.normal == Vec3::ZERO || (s.normal.length() - 1.0).abs() < 1e-4);
    }
}

/// Variance in the direction of `g`, m2.
fn covariance_along(covariance: DMat3, g: Vec3) -> f64 {
    let direction = g.as_dvec3().normalize();
    direction.dot(covariance * direction)
}
