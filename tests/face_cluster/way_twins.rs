//! What of the ways between two elements is free: twins of `ways.glsl`, and of rays and clusters that block.

use crate::pair_twins::Way;
use crate::twins::{Tables, count, frame, turn};
use glam::{DVec3, Vec3};
use linklight::gpu::shaders::types::{ClusterInstance, FaceElement};
use linklight::stages::clusters::first_face;

/// What says whether light passes.
#[derive(Clone, Copy, PartialEq)]
pub enum Blockers {
    Triangles,
    Clusters,
}

fn meets(x: DVec3, y: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let d = y - x;
    let n = (b - a).cross(c - a);
    let t = (a - x).dot(n) / d.dot(n);
    let p = x + t * d;
    t > 1e-4 && t < 1.0 - 1e-4 && [(a, b), (b, c), (c, a)].iter().all(|&(s, e)| (e - s).cross(p - s).dot(n) >= 0.0)
}

/// Share of the way from x to y that is free; faces of `passed` (first place and count) block nothing.
pub fn visibility(t: &Tables, by: Blockers, passed: [[u32; 2]; 2], width: f64, x: DVec3, y: DVec3) -> f64 {
    let within = |place: u32, [first, count]: [u32; 2]| place >= first && place < first + count;
    if by == Blockers::Triangles {
        let blocks = |triangle: u32| {
            let place = t.places[triangle as usize];
            !passed.iter().any(|&range| within(place, range)) && meets(x, y, t.corners(triangle))
        };
        return if (0..t.triangles.len() as u32).any(blocks) { 0.0 } else { 1.0 };
    }
    let mut share = 1.0;
    for inst in t.instances.iter().filter(|inst| inst.is_back == 0) {
        share *= past_cluster(t, inst, inst.first_cluster, passed, width, x, y);
    }
    share
}

/// Of one cluster and all below it.
fn past_cluster(
    t: &Tables,
    inst: &ClusterInstance,
    index: u32,
    passed: [[u32; 2]; 2],
    width: f64,
    x: DVec3,
    y: DVec3,
) -> f64 {
    let c = &t.clusters[index as usize];
    let (first, last) = (inst.first_triangle + first_face(c), inst.first_triangle + first_face(c) + count(c));
    let is_passed = passed.iter().any(|&[f, n]| first >= f && last <= f + n);
    let holds = passed.iter().any(|&[f, n]| first < f + n && f < last);
    let (linear, at) = frame(inst);
    let to_box = |p: DVec3| turn(c).inverse() * (linear.inverse() * (p - at) - c.center.as_dvec3());
    let (o, d, h) = (to_box(x), to_box(y) - to_box(x), c.half_extent.as_dvec3());
    let (mut enter, mut leave) = (1e-4f64, 1.0 - 1e-4f64);
    for k in 0..3 {
        let d = if d[k] == 0.0 { 1e-20 } else { d[k] };
        let (p, q) = ((-h[k] - o[k]) / d, (h[k] - o[k]) / d);
        (enter, leave) = (enter.max(p.min(q)), leave.min(p.max(q)));
    }
    if is_passed || enter > leave {
        return 1.0;
    }
    let shadow = 2.0 * h.length() * f64::from(inst.scale) / (1.0 - 0.5 * (enter + leave)).max(1e-3);
    match t.children(index) {
        Some(children) if holds || shadow > width => {
            children.into_iter().map(|child| past_cluster(t, inst, child, passed, width, x, y)).product()
        }
        None if count(c) == 1 => f64::from(u8::from(!meets(x, y, t.corners(t.triangle_at(inst, first_face(c)))))),
        _ if holds => 1.0,
        _ => {
            let d = d.normalize();
            let f = c.facing.map(f64::from);
            let seen = |sign: f64| -> f64 {
                (0..3).map(|k| (sign * d[k]).max(0.0) * f[2 * k] + (-sign * d[k]).max(0.0) * f[2 * k + 1]).sum()
            };
            let of_box = 4.0 * (d.x.abs() * h.y * h.z + d.y.abs() * h.z * h.x + d.z.abs() * h.x * h.y);
            1.0 - (seen(1.0).max(seen(-1.0)) / of_box.max(1e-30)).min(1.0)
        }
    }
}

/// What rays say of nodes, and of all ways.
pub struct Shares {
    pub of_nodes: Vec<f64>,
    pub mean: f64,
    /// What draws compared with 1.
    pub quotients: Vec<f64>,
}

/// Shares of the nodes, of those that were asked: of the others, and of a small pair's, the mean.
pub fn shares_of(asked: &[(usize, f64)], count: usize, is_small: bool) -> Shares {
    let mean = |own: &[f64]| own.iter().sum::<f64>() / own.len().max(1) as f64;
    let all: Vec<f64> = asked.iter().map(|(_, share)| *share).collect();
    let of = |r: usize| {
        let own: Vec<f64> = asked.iter().filter(|(node, _)| *node == r).map(|(_, share)| *share).collect();
        if own.is_empty() || is_small { mean(&all) } else { mean(&own) }
    };
    Shares { of_nodes: (0..count).map(of).collect(), mean: mean(&all), quotients: Vec::new() }
}

/// `lib/random.glsl`.
fn pcg4d(mut v: [u32; 4]) -> [f64; 4] {
    let step = |v: &mut [u32; 4]| {
        for (k, l, m) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[k] = v[k].wrapping_add(v[l].wrapping_mul(v[m]));
        }
    };
    v.iter_mut().for_each(|x| *x = x.wrapping_mul(1664525).wrapping_add(1013904223));
    step(&mut v);
    v.iter_mut().for_each(|x| *x ^= *x >> 16);
    step(&mut v);
    v.map(|x| f64::from(x >> 8) / 16_777_216.0)
}

/// The entry of `weights` that a chance draws, their sum, and the quotients that were compared with 1.
fn draw(weights: &[f64], chance: f64) -> (usize, f64, Vec<f64>) {
    let sum: f64 = weights.iter().sum();
    let sums: Vec<f64> = weights
        .iter()
        .scan(0.0, |s, w| {
            Some({
                *s += w;
                *s
            })
        })
        .collect();
    let last = weights.len() - 1;
    let drawn = sums[..last].iter().position(|&s| s > chance * sum).unwrap_or(last);
    let quotients =
        if sum > 0.0 { sums[..last].iter().map(|s| s / (chance * sum).max(1e-300)).collect() } else { vec![] };
    (drawn, sum, quotients)
}

/// A receiver and a shooter, with all their nodes.
pub struct Ends<'a> {
    pub elements: [&'a FaceElement; 2],
    pub places: [&'a [Vec3]; 2],
    pub normals: [&'a [Vec3]; 2],
}

/// `free_ways`: from nodes of the receiver to nodes of the shooter, to decide or to measure.
pub fn free_ways(t: &Tables, ends: &Ends<'_>, way: &Way, measures: bool, is_small: bool) -> Shares {
    let [a, b] = ends.elements;
    let passed = ends.elements.map(|e| [e.first_place, e.place_count]);
    let (near, far) = (0..t.receiver_nodes, t.receiver_nodes..ends.places[0].len());
    let (from, to) = if measures { (far, near) } else { (near, far) };
    let at = |end: usize, k: usize| (ends.places[end][k].as_dvec3(), ends.normals[end][k].as_dvec3());
    let key = |k: u32| [a.cluster, b.cluster, a.instance + 65536 * b.instance, k];
    let weights = |r: usize| -> Vec<f64> {
        let (x, n) = at(0, r);
        let weight = |s: usize| {
            let (y, m) = at(1, s);
            let d = y - x;
            d.dot(n).max(0.0) * (-d.dot(m)).max(0.0) / d.length_squared().max(1e-20).powi(2)
        };
        to.clone().map(weight).collect()
    };
    let [by_node, any, ..] = pcg4d(key(0));
    let (count, mut quotients) = (from.len(), Vec::new());
    let rays = if is_small { 1 } else { count * way.rays_per_node };
    let first = if is_small {
        let (first, _, unclear) = draw(&from.clone().map(|r| weights(r).iter().sum()).collect::<Vec<f64>>(), by_node);
        quotients.extend(unclear);
        first
    } else {
        0
    };
    let mut asked: Vec<(usize, f64, f64)> = Vec::new();
    for k in 0..=rays {
        let is_any = k == rays;
        if is_any && !asked.is_empty() {
            break;
        }
        let r = if is_any { (any * count as f64) as usize } else { (first + k) % count };
        let (s, sum, unclear) = draw(&weights(from.start + r), pcg4d(key(1 + k as u32 + 256 * u32::from(measures)))[0]);
        if sum <= 0.0 && !is_any {
            continue;
        }
        quotients.extend(unclear);
        let (x, y) = (at(0, from.start + r).0, at(1, to.start + s).0);
        asked.push((r, sum.max(1e-30), visibility(t, way.by, passed, 0.5 * f64::from(a.half_extent.y), x, y)));
    }
    let all: f64 = asked.iter().map(|(_, weight, _)| weight).sum();
    let mean = asked.iter().map(|(_, weight, share)| weight * share).sum::<f64>() / all;
    let of = |r: usize| {
        let own: Vec<f64> = asked.iter().filter(|(node, ..)| *node == r).map(|(_, _, share)| *share).collect();
        if is_small || own.is_empty() { mean } else { own.iter().sum::<f64>() / way.rays_per_node as f64 }
    };
    Shares { of_nodes: (0..count).map(of).collect(), mean, quotients }
}
