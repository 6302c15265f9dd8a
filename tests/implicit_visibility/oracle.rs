//! The links against all pairs of leaves, and the light that follows from them.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene, solve, winners};
use crate::twins;
use glam::Vec3;
use linklight::gpu::shaders::types::Surfel;
use linklight::methods::implicit_visibility::{ImplicitVisibility, Settings, bins};
use linklight::scene::environment::Environment;
use linklight::scene::pose::Pose;
use std::f64::consts::PI;

/// So many leaves are held against the oracle.
const SAMPLES: usize = 14;

/// The bins above the horizon that the oracle fills.
#[derive(Debug, Default)]
struct Agreement {
    filled: usize,
    /// The same leaf on the same side, or a node above it.
    same: usize,
    /// Another node at the same distance, within a twentieth: a neighbour on the same surface.
    beside: usize,
    empty: usize,
    /// Of the others: a node that is nearer than what is there, and so reaches beyond its own surface.
    nearer: usize,
    /// And one that is farther: what is there did not reach the bin's centre.
    farther: usize,
    /// Of both and of the empty ones: no edge of anything passes through the bin or those around it.
    unexplained: usize,
    /// Of all: one does.
    at_edges: usize,
}

impl Agreement {
    fn share(&self) -> f64 {
        (self.same + self.beside) as f64 / self.filled as f64
    }
}

/// Whether what is seen around a bin leaves the plane of the surface seen in it by more than a tenth of the distance, so
/// that an edge passes there.
fn is_at_an_edge(row: &[(f64, u32)], bin: usize, n: u32, own: &Surfel, origin: Vec3) -> bool {
    let face = bin as u32 / (n * n);
    let direction = twins::directions(n)[bin];
    let axis = (face / 2) as usize;
    let uv = [(axis + 1) % 3, (axis + 2) % 3].map(|k| direction[k] / direction[axis].abs());
    let step = 2.0 / f64::from(n);
    let height = f64::from(own.normal.dot(own.centre - origin));
    (-1..=1).flat_map(|dv| (-1..=1).map(move |du| (f64::from(du) * step, f64::from(dv) * step))).any(|(du, dv)| {
        let towards = bins::face_direction(face, uv[0] + du, uv[1] + dv).as_vec3().normalize();
        let beside = bins::bin_of(towards, n) as usize;
        let on_plane = height / twins::directions(n)[beside].dot(own.normal.as_dvec3());
        (on_plane / row[beside].0 - 1.0).abs() > 0.1
    })
}

fn expected(context: &TestContext, fixture: &Fixture, method: &ImplicitVisibility) -> Vec<Vec<(f64, u32)>> {
    let trees = &method.trees().topology;
    let topology = &method.elements().topology;
    let receivers = context.download(&method.linking().receivers).unwrap();
    let mut leaf_of = vec![twins::EMPTY; topology.vertices.len()];
    trees.leaf_elements.iter().zip(0..).for_each(|(&element, leaf)| leaf_of[element as usize] = leaf);
    let of_back = |&back: &u32| leaf_of.get(back as usize).copied().unwrap_or(twins::EMPTY);
    let backs: Vec<u32> = topology.back_elements.iter().map(of_back).collect();
    let positions = context.download(&fixture.world.positions).unwrap();
    let triangles = &fixture.geometry.triangles;
    let cells = twins::Cells { positions: &positions, triangles, fronts: &leaf_of, backs: &backs };
    receivers
        .iter()
        .step_by(receivers.len() / SAMPLES)
        .map(|at| cells.nearest(at.origin, method.settings().bins))
        .collect()
}

fn agreement(
    context: &TestContext,
    fixture: &Fixture,
    settings: Settings,
    expected: &mut Vec<Vec<(f64, u32)>>,
) -> Agreement {
    let method = fixture.linked(context, settings);
    if expected.is_empty() {
        *expected = self::expected(context, fixture, &method);
    }
    let trees = &method.trees().topology;
    let surfels = context.download(&method.trees().surfels).unwrap();
    let receivers = context.download(&method.linking().receivers).unwrap();
    let mut found = Agreement::default();
    let rows = winners(context, &method);
    let sampled = rows.iter().zip(&receivers).step_by(rows.len() / SAMPLES);
    let directions = twins::directions(settings.bins);
    for (row, (winners, receiver)) in expected.iter().zip(sampled) {
        for (bin, ((&(distance, winner), &own), direction)) in row.iter().zip(winners).zip(&directions).enumerate() {
            let direction = direction.as_vec3();
            if winner == twins::EMPTY || direction.dot(receiver.normal) <= 0.02 {
                continue;
            }
            found.filled += 1;
            let there = &surfels[(winner & !twins::BACK) as usize];
            let is_at_edge = is_at_an_edge(row, bin, settings.bins, there, receiver.origin);
            found.at_edges += usize::from(is_at_edge);
            let edge = || usize::from(!is_at_edge);
            if own == twins::EMPTY {
                found.empty += 1;
                found.unexplained += edge();
                continue;
            }
            // Where the bin's ray meets the winner's plane.
            let s = &surfels[(own & !twins::BACK) as usize];
            let there = s.normal.dot(s.centre - receiver.origin) / s.normal.dot(direction);
            let is_same_side = (own ^ winner) & twins::BACK == 0;
            if is_same_side && trees.leaves(own & !twins::BACK).contains(&(winner & !twins::BACK)) {
                found.same += 1;
            } else if is_same_side && (f64::from(there) / distance - 1.0).abs() < 0.05 {
                found.beside += 1;
            } else {
                *(if f64::from(there) < distance { &mut found.nearer } else { &mut found.farther }) += 1;
                found.unexplained += edge();
            }
        }
    }
    println!("{settings:?}\n{:.4}: {found:?}", found.share());
    found
}

/// In a box, and among small things: what all leaves together would find by brute force, each by its real surface.
#[test]
fn brute_force_finds_what_rays_would_and_the_hierarchy_next_to_always() {
    let context = TestContext::new();
    for (name, max_edge, least) in [("cornell-box", Some(0.4), [0.99, 0.998]), ("dancer", None, [0.99, 0.993])] {
        let fixture = Fixture::new(&context, builtin_scene(name), max_edge);
        let settings = Settings { bins: 8, fill_holes: false, ..Settings::default() };
        let mut expected = Vec::new();
        if max_edge.is_some() {
            let brute = agreement(&context, &fixture, Settings { brute_force: true, ..settings }, &mut expected);
            // The rest are rims that rounding decides.
            assert!(brute.filled > 1500 && brute.share() > 0.998, "{name}: {brute:?}");
            assert!(brute.empty * 1000 < brute.filled, "{name}: {brute:?}");
        }
        for (refinement, least) in [2.0, 0.25].into_iter().zip(least) {
            let hierarchy = agreement(&context, &fixture, Settings { refinement, ..settings }, &mut expected);
            // The rest stand at silhouettes: a node's place is off by part of a bin, and the bin goes to what is beside.
            assert!(hierarchy.share() > least, "{name}: {hierarchy:?}");
            assert!(hierarchy.empty * 100 < hierarchy.filled, "{name}: {hierarchy:?}");
            // Away from edges few differ.
            assert!(hierarchy.unexplained * 50 < hierarchy.filled - hierarchy.at_edges, "{name}: {hierarchy:?}");
        }
    }
}

/// Light gathered from the winners, from an environment through the empty bins, and pulled up the trees.
#[test]
fn light_is_what_the_winners_send() {
    let context = TestContext::new();
    let scene = builtin_scene("cornell-box");
    let sky = Environment::Constant(Vec3::new(0.25, 0.5, 1.0));
    let fixture = Fixture::posed(&context, scene, Some(0.6), sky, Pose::rest);
    let settings = Settings { bins: 6, smoothing: false, ..Settings::default() };
    let method = fixture.linked(&context, settings);
    let first = solve(&context, &method, &fixture.world, 0);
    let second = solve(&context, &method, &fixture.world, 1);

    let trees = &method.trees().topology;
    let surfels = context.download(&method.trees().surfels).unwrap();
    let receivers = context.download(&method.linking().receivers).unwrap();
    let albedo = context.download(&method.elements().albedo).unwrap();
    let vectors = bins::vectors(settings.bins);
    let mut radiosity = vec![Vec3::ZERO; trees.node_count() as usize];
    for node in 0..trees.node_count() {
        radiosity[node as usize] = if node < trees.leaf_count() {
            let element = trees.leaf_elements[node as usize] as usize;
            albedo[element] * (first.direct[element] + first.punctual[element])
        } else {
            let area: f32 = trees.children(node).map(|child| surfels[child as usize].area).sum();
            let sum: Vec3 = trees.children(node).map(|c| surfels[c as usize].area * radiosity[c as usize]).sum();
            if area > 0.0 { sum / area } else { Vec3::ZERO }
        };
    }
    let (mut compared, mut of_sky) = (0, 0.0f64);
    for (leaf, winners) in winners(&context, &method).iter().enumerate() {
        let element = trees.leaf_elements[leaf] as usize;
        let weights = twins::weights(receivers[leaf].normal, &vectors);
        let backs: f64 = (winners.iter().zip(&weights))
            .filter(|(winner, _)| **winner != twins::EMPTY && **winner & twins::BACK != 0)
            .map(|(_, weight)| weight / PI)
            .sum();
        if backs > 0.49 {
            continue; // takes its neighbours' light
        }
        compared += 1;
        let mut expected = glam::DVec3::ZERO;
        for (&winner, weight) in winners.iter().zip(&weights) {
            if winner < twins::BACK {
                expected += radiosity[winner as usize].as_dvec3() * (weight / PI);
            } else if winner == twins::EMPTY {
                of_sky += weight;
            }
        }
        let error = (second.last[element].as_dvec3() - expected).abs().max_element();
        assert!(
            error <= 1e-4 * expected.max_element() + 1e-6,
            "element {element}: {} for {expected}",
            second.last[element]
        );
    }
    assert!(compared > 500 && of_sky > 10.0, "{compared} elements, sky {of_sky}");
}
