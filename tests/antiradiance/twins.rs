//! Plain versions of the passes, over plain slices, in double precision where sums are long.

use glam::{DVec3, Vec3};
use linklight::gpu::shaders::types::{HierarchyLeaf, HierarchyNode, SpreadEntry};
use linklight::stages::direction_bins::DirectionBins;
use linklight::stages::hierarchy::{BLOCKS_BEHIND, NONE, REFLECTS_BEHIND};
use std::f32::consts::PI;

/// Unordered pairs of nodes that exchange light, by recursion.
pub fn links(nodes: &[HierarchyNode], solid_angle: f32) -> Vec<[u32; 2]> {
    let mut found = Vec::new();
    let mut stack = vec![(0, 0)];
    while let Some((a, b)) = stack.pop() {
        let (x, y) = (&nodes[a as usize], &nodes[b as usize]);
        if x.surface != NONE && x.surface == y.surface {
            continue;
        }
        if a == b {
            let own: Vec<u32> = children(nodes, a).collect();
            for (k, &c) in own.iter().enumerate() {
                stack.extend(own[k..].iter().map(|&d| (c, d)));
            }
            continue;
        }
        let apart = x.center.distance(y.center) - x.margin - y.margin;
        let allowed = if apart > 0.0 { solid_angle * apart * apart } else { 0.0 };
        let must_split = |node: &HierarchyNode| node.leaf == NONE && PI * node.radius * node.radius > allowed;
        match (must_split(x), must_split(y)) {
            (false, false) => found.push([a, b]),
            (true, false) => stack.extend(children(nodes, a).map(|c| (c, b))),
            (true, true) if x.radius >= y.radius => stack.extend(children(nodes, a).map(|c| (c, b))),
            _ => stack.extend(children(nodes, b).map(|c| (a, c))),
        }
    }
    found
}

pub fn children(nodes: &[HierarchyNode], node: u32) -> impl Iterator<Item = u32> + '_ {
    let end = nodes[node as usize].skip;
    let mut next = if nodes[node as usize].leaf == NONE { node + 1 } else { end };
    std::iter::from_fn(move || {
        let child = next;
        (child < end).then(|| next = nodes[child as usize].skip).map(|()| child)
    })
}

/// What a discrete cosine is held at, at least.
pub fn discrete_cosine(cosine: f32, norm: f32, bin_count: u32) -> f32 {
    norm * cosine.abs().max(0.5 / (bin_count as f32).sqrt())
}

pub fn cosine_norm(normal: Vec3, bins: &DirectionBins) -> f32 {
    let sum: f64 = bins.directions.iter().map(|w| f64::from(discrete_cosine(normal.dot(*w), 1.0, bins.count()))).sum();
    (f64::from(bins.count()) / (2.0 * sum)) as f32
}

/// What transfers are made from.
pub struct Transferring<'a> {
    pub nodes: &'a [HierarchyNode],
    pub leaves: &'a [HierarchyLeaf],
    pub norms: &'a [f32],
    pub bins: &'a DirectionBins,
    pub lists: &'a (Vec<u32>, Vec<SpreadEntry>),
    pub class_count: u32,
    pub is_gaussian: bool,
}

impl Transferring<'_> {
    fn list(&self, class: u32, bin: u32) -> &[SpreadEntry] {
        let at = (class * self.bins.count() + bin) as usize;
        &self.lists.1[self.lists.0[at] as usize..self.lists.0[at + 1] as usize]
    }

    /// (receiver's cell, sender's entry, weight) from one node to another.
    pub fn transfers(&self, sender: u32, receiver: u32) -> Vec<(u32, u32, f32)> {
        let (q, p) = (&self.nodes[sender as usize], &self.nodes[receiver as usize]);
        let offset = p.center - q.center;
        let squared = offset.length_squared();
        if squared <= 0.0 || q.area <= 0.0 {
            return Vec::new();
        }
        let (m, w) = (self.bins.count(), offset / squared.sqrt());
        let leaf = |node: &HierarchyNode| (node.shape != NONE).then(|| &self.leaves[node.shape as usize]);
        let (q_leaf, p_leaf) = (leaf(q), leaf(p));
        let cosine = |leaf: Option<&HierarchyLeaf>, v: Vec3| leaf.map_or(0.0, |leaf| leaf.normal.dot(v));
        let held = |node: &HierarchyNode, c: f32| discrete_cosine(c, self.norms[node.shape as usize], m);
        let passes_behind = p_leaf.is_some_and(|leaf| leaf.flags & BLOCKS_BEHIND == 0);
        let (q_cos, p_cos) = (cosine(q_leaf, w), cosine(p_leaf, w));

        let solid_angle = if q_leaf.is_some() {
            2.0 * PI * (1.0 - 1.0 / (1.0 + f64::from(q.area * q_cos.abs() / (PI * squared))).sqrt()) as f32
        } else {
            q.area / squared
        };
        if solid_angle <= 0.0 {
            return Vec::new();
        }
        let coverage = solid_angle / self.bins.solid_angle();
        let middle = self.bins.bin_of(w);
        let entry = |bin: u32, read: u32, weight: f32| (receiver * m + bin, sender * m + read, weight);
        let doublings = coverage.log2();
        let size_class = if doublings < 0.25 { 0 } else { ((2.0 * doublings).ceil() as u32).min(self.class_count) };
        let on_side = |bin: u32| q_leaf.is_none() || cosine(q_leaf, self.bins.directions[bin as usize]) * q_cos > 0.0;
        if q_leaf.is_none() || size_class == 0 {
            if passes_behind && p_cos >= 0.0 {
                return Vec::new();
            }
            let received =
                |bin: u32| p_leaf.is_none() || cosine(p_leaf, self.bins.directions[bin as usize]) * p_cos > 0.0;
            let near = self.list(0, middle).iter().map(|e| e.bin).find(|&bin| on_side(bin) && received(bin));
            return near
                .map(|bin| {
                    let v = self.bins.directions[bin as usize];
                    let mut weight = coverage;
                    if p_leaf.is_some() {
                        weight *= p_cos.abs() / held(p, cosine(p_leaf, v));
                    }
                    if q_leaf.is_some() {
                        weight /= held(q, cosine(q_leaf, v));
                    }
                    entry(bin, bin, weight)
                })
                .into_iter()
                .collect();
        }

        let list = self.list(size_class, middle);
        let total: f32 = list.iter().filter(|e| on_side(e.bin)).map(|e| e.weight).sum();
        let nearest = list.iter().map(|e| e.bin).find(|&bin| on_side(bin));
        let mut found = Vec::new();
        for &SpreadEntry { bin, weight } in list.iter().filter(|e| on_side(e.bin)) {
            if passes_behind && cosine(p_leaf, self.bins.directions[bin as usize]) >= 0.0 {
                continue;
            }
            let share = coverage * weight / total;
            let (read, share) = if self.is_gaussian { (nearest.unwrap_or(bin), share) } else { (bin, share.min(1.0)) };
            found.push(entry(bin, read, share / held(q, cosine(q_leaf, self.bins.directions[read as usize]))));
        }
        found
    }
}

/// Incident radiance of all nodes along `transfers`, pushed down to the leaves.
pub fn gather_and_push(
    nodes: &[HierarchyNode],
    bin_count: u32,
    transfers: &[(u32, u32, f32)],
    exitant: &[Vec3],
) -> Vec<DVec3> {
    let mut incident = vec![DVec3::ZERO; nodes.len() * bin_count as usize];
    for &(cell, entry, weight) in transfers {
        incident[cell as usize] += f64::from(weight) * exitant[entry as usize].as_dvec3();
    }
    for (node, own) in nodes.iter().enumerate().skip(1) {
        for bin in 0..bin_count as usize {
            let above = incident[own.parent as usize * bin_count as usize + bin];
            incident[node * bin_count as usize + bin] += above;
        }
    }
    incident
}

/// A leaf after the local pass.
pub struct Local {
    /// Front and back, W/m2.
    pub irradiance: [DVec3; 2],
    pub radiosity: [DVec3; 2],
    pub exitant: Vec<DVec3>,
}

/// `incident`: the leaf's row. `albedo` and `source`: front and back. `lowest`: by side and bin.
pub fn local(
    leaf: &HierarchyLeaf,
    norm: f32,
    bins: &DirectionBins,
    incident: &[DVec3],
    source: [Vec3; 2],
    albedo: [Vec3; 2],
    lowest: impl Fn(usize, usize) -> Vec3,
) -> Local {
    let held = |w: Vec3| f64::from(discrete_cosine(leaf.normal.dot(w), norm, bins.count()));
    let side = |bin: usize| usize::from(leaf.normal.dot(bins.directions[bin]) > 0.0);
    let arriving = |bin: usize| incident[bin].max(lowest(side(bin), bin).as_dvec3());
    let solid_angle = 4.0 * std::f64::consts::PI / f64::from(bins.count());
    let mut irradiance = [DVec3::ZERO; 2];
    for (bin, &w) in bins.directions.iter().enumerate() {
        irradiance[usize::from(leaf.normal.dot(w) > 0.0)] += solid_angle * held(w) * arriving(bin);
    }
    let reflects_behind = leaf.flags & REFLECTS_BEHIND != 0;
    if !reflects_behind {
        irradiance[1] = DVec3::ZERO;
    }
    let mut radiosity = [0, 1].map(|side| source[side].as_dvec3() + albedo[side].as_dvec3() * irradiance[side]);
    if !reflects_behind {
        radiosity[1] = source[1].as_dvec3();
    }
    let exitant = bins.directions.iter().enumerate().map(|(bin, &w)| {
        let front = leaf.normal.dot(w) > 0.0;
        let mut radiance = radiosity[usize::from(!front)] / std::f64::consts::PI;
        if !front || leaf.flags & BLOCKS_BEHIND != 0 {
            radiance -= arriving(bin);
        }
        held(w) * radiance
    });
    Local { irradiance, radiosity, exitant: exitant.collect() }
}

/// Inner nodes' exitant light from their children's, in place.
pub fn pull(nodes: &[HierarchyNode], bin_count: u32, exitant: &mut [DVec3]) {
    for node in (0..nodes.len() as u32).rev().filter(|&node| nodes[node as usize].leaf == NONE) {
        for bin in 0..bin_count {
            let mut sum = DVec3::ZERO;
            let mut area = 0.0;
            for child in children(nodes, node) {
                let own = f64::from(nodes[child as usize].area);
                sum += own * exitant[(child * bin_count + bin) as usize];
                area += own;
            }
            exitant[(node * bin_count + bin) as usize] = sum / area;
        }
    }
}
