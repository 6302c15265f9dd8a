//! Twins of what decides pairs: visibility, transport, bounds and splits.

use crate::twins::{self, Tables, Vectors, basis, fit, is_flat, node_coordinates, vector_area};
use crate::way_twins::{Blockers, Ends, Shares, free_ways, shares_of, visibility};
use glam::{DVec3, Vec3};
use linklight::gpu::shaders::types::{FaceElement, Light};
use std::f64::consts::PI;

pub const DONE: u32 = 0;
pub const SPLIT_RECEIVER: u32 = 1;
pub const SPLIT_SHOOTER: u32 = 2;
pub const SPLIT_BOTH: u32 = 3;
/// Of a decision, and of a shooter.
pub const IN_SHADOW: u32 = 1 << 30;

fn axes(e: &FaceElement) -> [DVec3; 3] {
    [e.axis_x, e.axis_y, e.axis_z].map(|axis| axis.as_dvec3())
}

fn least_area(e: &FaceElement, d: DVec3) -> f64 {
    vector_area(e) * e.axis_z.as_dvec3().dot(d).max(0.0)
}

fn most_area(e: &FaceElement, d: DVec3) -> f64 {
    let of_axis = |k: usize| {
        let along = axes(e)[k].dot(d);
        f64::from(if along > 0.0 { e.facing[2 * k] } else { e.facing[2 * k + 1] }) * along.abs()
    };
    (0..3).map(of_axis).sum()
}

fn projected_area(e: &FaceElement, d: DVec3) -> f64 {
    let (flat, c) = (vector_area(e), e.axis_z.as_dvec3().dot(d));
    let open = ((1.0 - f64::from(e.self_share)) * f64::from(e.area)).max(flat);
    let share = flat / open.max(1e-30);
    let expected = if share > 0.75 {
        let s = (3.0 / share - 3.0).sqrt();
        flat * if c >= s {
            c
        } else if c <= -s {
            0.0
        } else {
            (c + s).powi(2) / (4.0 * s)
        }
    } else {
        open * (0.25 + 0.5 * share * c + 0.75 * (share - 0.5).max(0.0) * (c * c - 1.0 / 3.0))
    };
    expected.min(most_area(e, d))
}

/// What is kept of light 1 from `d`.
fn kept_vector(t: &Tables, e: &FaceElement, d: DVec3) -> DVec3 {
    if is_bent(e) && t.children(e.cluster).is_some() {
        return d;
    }
    let beyond = projected_area(e, d) - least_area(e, d);
    let normal = e.axis_z.as_dvec3() * (beyond / stand_in_area(e));
    if e.axis_z.as_dvec3().dot(d) > 0.0 { d + normal } else { normal }
}

fn is_bent(e: &FaceElement) -> bool {
    vector_area(e) < 0.8 * f64::from(e.area)
}

/// What stands for the vector area where that is small.
fn stand_in_area(e: &FaceElement) -> f64 {
    vector_area(e).max(0.5 * f64::from(e.area))
}

/// Whether some side of `e` looks at some corner of the box of `other`.
fn may_face(e: &FaceElement, other: &FaceElement) -> bool {
    let size = |e: &FaceElement| f64::from(e.half_extent.x + e.half_extent.y);
    let corners = |e: &FaceElement| -> Vec<DVec3> {
        let corner = |k: u32| {
            let sign = |bit: u32| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
            (0..3).map(|i| axes(e)[i] * (sign(i as u32) * f64::from(e.half_extent[i]))).sum::<DVec3>()
        };
        (0..8).map(|k| e.center.as_dvec3() + corner(k)).collect()
    };
    (0..6).any(|k| {
        let axis = axes(e)[k / 2] * if k % 2 == 0 { 1.0 } else { -1.0 };
        let lowest = corners(e).iter().map(|p| p.dot(axis)).fold(f64::INFINITY, f64::min);
        let highest = corners(other).iter().map(|p| p.dot(axis)).fold(f64::NEG_INFINITY, f64::max);
        e.facing[k] > 1e-3 * e.area && highest - lowest > 1e-5 * (size(e) + size(other))
    })
}

/// Irradiance vector of a triangle of radiosity 1, of either side, above the plane through x. [Arvo1995 Eq. 2.5]
fn triangle_vector(x: DVec3, normal: DVec3, corners: [DVec3; 3]) -> DVec3 {
    let mut polygon = Vec::new();
    for k in 0..3 {
        let (p, q) = (corners[k] - x, corners[(k + 1) % 3] - x);
        let (above_p, above_q) = (p.dot(normal), q.dot(normal));
        if above_p > 0.0 {
            polygon.push(p);
        }
        if (above_p > 0.0) != (above_q > 0.0) {
            polygon.push(p.lerp(q, above_p / (above_p - above_q)));
        }
    }
    let mut sum = DVec3::ZERO;
    for k in 0..polygon.len() {
        let (p, q) = (polygon[k].normalize_or_zero(), polygon[(k + 1) % polygon.len()].normalize_or_zero());
        sum += p.cross(q).normalize_or_zero() * p.dot(q).clamp(-1.0, 1.0).acos() / (2.0 * PI);
    }
    if sum.dot(normal) < 0.0 { -sum } else { sum }
}

/// Settings of a pass of light.
#[derive(Clone, Copy)]
pub struct Way {
    pub threshold: f64,
    pub bent_light: f64,
    pub rays_per_node: usize,
    /// Where light is blocked: times the receiver's area that a shooter may have before it is split first.
    pub wider: f32,
    pub functions: usize,
    pub by: Blockers,
}

/// What becomes of a pair.
pub struct Outcome {
    pub decision: u32,
    /// On the receiver's functions, W/m2.
    pub arrives: Option<Vec<Vectors>>,
    /// The quotients that decisions compared with 1: near it, single precision may decide otherwise.
    pub quotients: Vec<f64>,
}

impl Outcome {
    fn new(decision: u32, quotients: Vec<f64>) -> Self {
        Self { decision, arrives: None, quotients }
    }

    pub fn is_clear(&self) -> bool {
        self.quotients.iter().all(|q| (q - 1.0).abs() > 1e-3)
    }
}

/// What reaches a receiver's nodes, and the bounds of what all of it would reflect, W.
struct Reaching {
    at_nodes: Vec<Vectors>,
    least: Vec<f64>,
    greatest: Vec<f64>,
    /// The channel that errors are judged by.
    channel: usize,
    /// What the pair says of blocked light.
    shadow: u32,
}

impl Reaching {
    /// Takes away what is blocked (`free`: shares of the nodes, of a small pair or another), and decides; `split` where the
    /// error is too large.
    fn decided(
        mut self,
        (t, nodes): (&Tables, &[Vec3]),
        (a, shooter): (&FaceElement, Option<&FaceElement>),
        way: &Way,
        free: impl Fn(bool) -> Shares,
        measured: Option<&dyn Fn() -> Shares>,
        split: u32,
    ) -> Outcome {
        let most = self.greatest.iter().copied().fold(0.0, f64::max);
        let stake = f64::from(a.most_albedo) * most / way.threshold;
        let bend = most / (way.bent_light * f64::from(a.area));
        let mut quotients = vec![stake];
        for (e, decision) in [(Some(a), SPLIT_RECEIVER), (shooter, SPLIT_SHOOTER)] {
            let Some(e) = e.filter(|e| t.children(e.cluster).is_some()) else { continue };
            quotients.extend(is_bent(e).then_some(bend));
            quotients.extend((e.is_part_hidden != 0).then_some(0.25 * stake));
            if is_bent(e) && bend > 1.0 || e.is_part_hidden != 0 && 0.25 * stake > 1.0 {
                return Outcome::new(decision | self.shadow, quotients);
            }
        }
        // Lamps' pairs say nothing.
        let (is_pair, shadow) = (measured.is_some(), self.shadow);
        let marked = |is_blocked: bool| split | if is_pair && is_blocked { IN_SHADOW } else { shadow };
        let is_small = stake <= 1.0;
        let shares = free(is_small);
        quotients.extend(&shares.quotients);
        let is_blocked = shares.of_nodes.iter().all(|&share| share == 0.0);
        if is_blocked {
            if !is_small && split != DONE {
                return Outcome::new(marked(true), quotients);
            }
            if is_small || measured.is_none() {
                return Outcome::new(DONE, quotients);
            }
        }
        for (r, &share) in shares.of_nodes.iter().enumerate() {
            self.least[r] *= f64::from(u8::from(share >= 0.999));
            self.greatest[r] *= f64::from(u8::from(share > 0.0));
        }
        let place = |r: usize| node_coordinates(t, a, nodes, r);
        let (fits, _) = fit(t, a, nodes, way.functions);
        let arriving = |shares: &[f64]| -> Vec<Vectors> {
            let on = |k: usize, c: usize| -> DVec3 {
                (0..t.receiver_nodes).map(|r| fits[k][r] * shares[r] * self.at_nodes[r][c]).sum()
            };
            (0..way.functions).map(|k| [0, 1, 2].map(|c| on(k, c))).collect()
        };
        let arrives = arriving(&shares.of_nodes);
        let sizes = self.at_nodes.iter().map(|of| of.iter().map(|v| v.length()).sum::<f64>()).collect::<Vec<_>>();
        let all: f64 = sizes.iter().sum();
        let seen = if all > 0.0 {
            sizes.iter().zip(&shares.of_nodes).map(|(size, share)| size * share).sum::<f64>() / all
        } else {
            1.0
        };
        if !is_small && !is_blocked && split != DONE {
            let said = |r: usize| -> f64 {
                let normal = a.axis_z.as_dvec3() * vector_area(a);
                let value = |(k, v): (usize, &Vectors)| basis(k, place(r)) * normal.dot(v[self.channel]);
                arrives.iter().enumerate().map(value).sum()
            };
            let off = |r: usize| (said(r) - self.least[r]).max(self.greatest[r] - said(r));
            let share = shares.of_nodes.iter().sum::<f64>() / t.receiver_nodes as f64;
            let at_border = if (if is_pair { seen } else { share }) < 0.999 { 0.5 * most } else { 0.0 };
            let error = (0..t.receiver_nodes).map(off).fold(at_border, f64::max);
            quotients.push(f64::from(a.most_albedo) * error / way.threshold);
            if *quotients.last().unwrap() > 1.0 {
                return Outcome::new(marked(seen < 0.999), quotients);
            }
        }
        let Some(measured) = measured.filter(|_| !is_small) else {
            return Outcome { decision: DONE, arrives: Some(arrives), quotients };
        };
        // Neither is trusted where they differ by too much. Else what nodes keep is dimmed, or what they lack is lit, until all of it is as free as measured.
        let measured = measured();
        quotients.extend(&measured.quotients);
        let normal = a.axis_z.as_dvec3() * vector_area(a);
        let strongest = self.at_nodes.iter().flatten().map(|v| normal.dot(*v)).fold(0.0, f64::max);
        if split != DONE {
            quotients.push(f64::from(a.most_albedo) * (measured.mean - seen).abs() * strongest / way.threshold);
            if *quotients.last().unwrap() > 1.0 {
                return Outcome::new(marked(true), quotients);
            }
        }
        if measured.mean == 0.0 {
            return Outcome::new(DONE, quotients);
        }
        let of = |share: &f64| match measured.mean < seen {
            true => share * measured.mean / seen,
            false => 1.0 - (1.0 - share) * (1.0 - measured.mean) / (1.0 - seen).max(1e-6),
        };
        let arrives = arriving(&shares.of_nodes.iter().map(of).collect::<Vec<_>>());
        Outcome { decision: DONE, arrives: Some(arrives), quotients }
    }
}

/// Whether single precision may see a way on the other side of a face: along one axis it is exact.
fn is_level(normal: DVec3, way: DVec3) -> bool {
    let axes = normal.to_array().iter().filter(|v| **v != 0.0).count();
    axes > 1 && way.dot(normal).abs() < 1e-5 * way.length()
}

/// `transport`: a shooter's light to a receiver, or which of them is to be split.               [Gobbetti2003 3.3]
pub fn transport(
    t: &Tables,
    elements: &[FaceElement],
    (nodes, normals): (&[Vec<Vec3>], &[Vec<Vec3>]),
    unshot: &[Vec<Vec3>],
    ([receiver, shooter], shadow): ([usize; 2], u32),
    way: &Way,
) -> Outcome {
    let (a, b) = (&elements[receiver], &elements[shooter]);
    let can_split = |e: &FaceElement| t.children(e.cluster).is_some();
    let brightest = f64::from(unshot[shooter][0].max_element());
    if brightest <= 0.0 {
        return Outcome::new(DONE, vec![]);
    }
    if receiver == shooter {
        let share = f64::from(a.self_share);
        let stake = f64::from(a.most_albedo * a.area) * brightest * share / way.threshold;
        if can_split(a) && stake > 1.0 {
            return Outcome::new(SPLIT_BOTH, vec![stake]);
        }
        let kept = a.axis_z.as_dvec3() * (share * f64::from(a.area) / stand_in_area(a));
        let of = |k: usize| unshot[receiver].get(k).map_or(DVec3::ZERO, |b| b.as_dvec3());
        let arrives = (0..way.functions).map(|k| [0, 1, 2].map(|c| kept * of(k)[c])).collect();
        return Outcome { decision: DONE, arrives: (share > 0.0).then_some(arrives), quotients: vec![stake] };
    }
    if !may_face(a, b) || !may_face(b, a) {
        return Outcome::new(DONE, vec![]);
    }
    let weights = twins::weights(t, b, &nodes[shooter]);
    let sent: Vec<DVec3> = (0..weights.len())
        .map(|e| {
            let uv = node_coordinates(t, b, &nodes[shooter], t.receiver_nodes + e);
            let value = |(k, v): (usize, &Vec3)| basis(k, uv) * v.as_dvec3();
            unshot[shooter].iter().enumerate().map(value).sum::<DVec3>().max(DVec3::ZERO)
        })
        .collect();
    let (mut at_nodes, mut least, mut greatest) = (Vec::new(), Vec::new(), Vec::new());
    let mut quotients = Vec::new();
    // From a place to a box in half diagonals, and what the element may fill of the hemisphere.
    let mut nearness = |e: &FaceElement, x: DVec3| -> [f64; 2] {
        let (d, half) = (x - e.center.as_dvec3(), e.half_extent.as_dvec3());
        let off = DVec3::from_array(axes(e).map(|axis| d.dot(axis).abs())) - half;
        let squared = off.max(DVec3::ZERO).length_squared().max(1e-20);
        let away = (squared / half.length_squared()).sqrt();
        quotients.extend([2.0 * away, 0.5 * away, 0.1 * away]);
        [away, if away < 0.5 { (f64::from(e.area) / (PI * squared)).min(1.0) } else { 0.0 }]
    };
    let near_power = brightest * f64::from(b.area) * nearness(a, b.center.as_dvec3())[1];
    let mut is_far = true;
    for r in 0..t.receiver_nodes {
        let x = nodes[receiver][r].as_dvec3();
        let [away, share] = nearness(b, x);
        let around = if b.place_count == 1 { 0.0 } else { brightest * f64::from(a.area) * share };
        is_far &= away > 2.0;
        let (mut vectors, mut sum, mut passed) = ([DVec3::ZERO; 3], 0.0, DVec3::ZERO);
        let (mut low, mut high, mut sends) = (f64::INFINITY, near_power.max(around), false);
        for (e, weight) in weights.iter().enumerate() {
            let d = nodes[shooter][t.receiver_nodes + e].as_dvec3() - x;
            let squared = d.length_squared().max(1e-20);
            let direction = d / squared.sqrt();
            let scale = sent[e].max_element() / (PI * squared);
            low = low.min(scale * least_area(b, -direction) * least_area(a, direction));
            high = high.max(scale * most_area(b, -direction) * most_area(a, direction));
            let share = weight * projected_area(b, -direction) / (PI * squared);
            let kept = share * kept_vector(t, a, direction);
            sends |= share > 0.0;
            sum += kept.length();
            passed += kept.length() * sent[e];
            (0..3).for_each(|c| vectors[c] += sent[e][c] * kept);
        }
        if sends && (b.place_count == 1 || b.place_count <= 8 && is_flat(b) && away < 10.0) {
            let mean = if sum > 0.0 { passed / sum } else { sent[0] };
            let inst = &t.instances[b.instance as usize];
            let faces = (0..b.place_count).map(|f| t.triangle_at(inst, b.first_place + f - inst.first_triangle));
            let side = if inst.is_back != 0 { -1.0 } else { 1.0 };
            let is_seen = |[p, q, s]: &[DVec3; 3]| side * (q - p).cross(s - p).dot(x - p) > 0.0;
            let seen = faces.map(|f| t.corners(f)).filter(is_seen);
            let seen: Vec<_> = seen.collect();
            let normal = a.axis_z.as_dvec3();
            let on = |side: f64| seen.iter().map(|&corners| triangle_vector(x, side * normal, corners)).sum::<DVec3>();
            let parts = if is_flat(a) { vec![on(1.0)] } else { vec![on(1.0), on(-1.0)] };
            sum = parts.iter().map(|part| part.length()).sum();
            let kept = |part: &DVec3| part.length() * kept_vector(t, a, part.normalize_or_zero());
            let kept: DVec3 = parts.iter().map(kept).sum();
            vectors = [0, 1, 2].map(|c| kept * mean[c]);
        }
        at_nodes.push(vectors.map(|v| v / sum.max(1.0)));
        least.push(low);
        greatest.push(high);
    }
    let strongest = unshot[shooter][0];
    let channel = (0..3).find(|&c| strongest[c] == strongest.max_element()).unwrap();
    let reaching = Reaching { at_nodes, least, greatest, channel, shadow };
    let (shooters, receivers) = (weights.len(), t.receiver_nodes);
    let at = |e: usize, k: usize| (nodes[e][k].as_dvec3(), normals[e][k].as_dvec3());
    let ends = Ends {
        elements: [a, b],
        places: [&nodes[receiver], &nodes[shooter]],
        normals: [&normals[receiver], &normals[shooter]],
    };
    let free = |is_small: bool| free_ways(t, &ends, way, false, is_small);
    let measured = || free_ways(t, &ends, way, true, false);
    let wider = if is_far && shadow != 0 { way.wider } else { 1.0 };
    let split = match (can_split(a), can_split(b)) {
        (false, false) => DONE,
        (true, is_b) if wider * a.area >= b.area || !is_b => SPLIT_RECEIVER,
        _ => SPLIT_SHOOTER,
    };
    let mut outcome = reaching.decided((t, &nodes[receiver]), (a, Some(b)), way, free, Some(&measured), split);
    let is_unclear = |r: usize, s: usize| {
        let (x, y) = (at(receiver, r), at(shooter, s));
        is_level(x.1, y.0 - x.0) || is_level(y.1, x.0 - y.0)
    };
    let all = receivers + shooters;
    outcome.quotients.extend(quotients);
    if (0..receivers).any(|r| (receivers..all).any(|s| is_unclear(r, s) || is_unclear(s, r))) {
        outcome.quotients.push(1.0);
    }
    outcome
}

/// Shares of its intensity that a lamp sends along `way` (metres, to the lamp): within its range, and its cone.
fn falloff(light: &Light, way: DVec3) -> f64 {
    let ratio = if light.range > 0.0 { way.length() / f64::from(light.range) } else { 0.0 };
    let cosine = -light.direction.as_dvec3().dot(way.normalize());
    let in_cone = (cosine * f64::from(light.spot_scale) + f64::from(light.spot_offset)).clamp(0.0, 1.0).powi(2);
    (1.0 - ratio.powi(4)).clamp(0.0, 1.0) * if light.kind == 1 { in_cone } else { 1.0 }
}

/// The most that a lamp may send anywhere within a sphere, W/m2.
fn most_irradiance(light: &Light, center: DVec3, radius: f64) -> f64 {
    let intensity = f64::from(light.intensity.max_element());
    if light.kind == 2 {
        return intensity;
    }
    let offset = center - light.position.as_dvec3();
    let distance = offset.length();
    let nearest = (distance - radius).max(0.01 * radius);
    let mut to_lamp = -light.direction.as_dvec3() * nearest;
    if light.kind == 1 && distance > radius {
        let (axis, reach) = (light.direction.as_dvec3(), (radius / distance).asin());
        let angle = (offset.dot(axis) / distance).clamp(-1.0, 1.0).acos();
        let turned = (angle - reach).max(0.0);
        let aside = axis.cross(if axis.x.abs() < 0.5 { DVec3::X } else { DVec3::Y }).normalize();
        to_lamp = -(axis * turned.cos() + aside * turned.sin()) * nearest;
    }
    intensity * falloff(light, to_lamp) / to_lamp.length_squared()
}

/// `transport_lights`.
pub fn transport_light(
    t: &Tables,
    a: &FaceElement,
    (nodes, normals): (&[Vec3], &[Vec3]),
    light: &Light,
    way: &Way,
    [far, offset]: [f64; 2],
) -> Outcome {
    let of = |r: usize| {
        let to = light.position.as_dvec3() - nodes[r].as_dvec3();
        if light.kind == 2 {
            (-light.direction.as_dvec3(), light.intensity.as_dvec3(), far)
        } else {
            (to.normalize(), light.intensity.as_dvec3() * falloff(light, to) / to.length_squared(), to.length())
        }
    };
    let around = most_irradiance(light, a.center.as_dvec3(), a.half_extent.as_dvec3().length());
    let is_dark = |r: usize| of(r).1.max_element() <= 0.0;
    let (mut at_nodes, mut least, mut greatest) = (Vec::new(), Vec::new(), Vec::new());
    for r in 0..t.receiver_nodes {
        let (direction, arrives, _) = of(r);
        least.push(arrives.max_element() * least_area(a, direction));
        greatest.push(if is_dark(r) { around } else { arrives.max_element() } * most_area(a, direction));
        let kept = kept_vector(t, a, direction);
        at_nodes.push([0, 1, 2].map(|c| kept * arrives[c]));
    }
    let reaching = Reaching {
        channel: (0..3).find(|&c| light.intensity[c] == light.intensity.max_element()).unwrap(),
        at_nodes,
        least,
        greatest: greatest.clone(),
        shadow: 0,
    };
    let passed = [[a.first_place, a.place_count], [0, 0]];
    let ray = |r: usize| {
        if greatest[r] <= 0.0 {
            return 0.0;
        }
        let (direction, _, distance) = of(r);
        let from = nodes[r].as_dvec3();
        let (x, y) = (from + direction * offset, from + direction * distance.min(far));
        visibility(t, way.by, passed, 0.5 * f64::from(a.half_extent.y), x, y)
    };
    let receivers = t.receiver_nodes;
    let first = a.cluster as usize % receivers;
    let free = |is_small: bool| -> Shares {
        let order = (0..receivers).map(|k| if is_small { (first + k) % receivers } else { k });
        let order = order.filter(|&r| !is_dark(r));
        let faced = order.clone().filter(|&r| of(r).0.dot(normals[r].as_dvec3()) > 0.0);
        let mut asked: Vec<usize> = faced.take(if is_small { 1 } else { receivers }).collect();
        if asked.is_empty() {
            asked.extend(order.take(1));
        }
        shares_of(&asked.iter().map(|&r| (r, ray(r))).collect::<Vec<_>>(), receivers, is_small)
    };
    let split = if t.children(a.cluster).is_some() { SPLIT_RECEIVER } else { DONE };
    let mut outcome = reaching.decided((t, nodes), (a, None), way, free, None, split);
    if (0..receivers).any(|r| is_level(normals[r].as_dvec3(), of(r).0)) {
        outcome.quotients.push(1.0);
    }
    outcome
}
