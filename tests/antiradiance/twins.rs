//! Plain versions of the passes, over plain slices, in double precision where sums are long.

use glam::{DVec3, Vec3};
use linklight::gpu::shaders::types::{HierarchyLeaf, HierarchyNode, SpreadEntry};
use linklight::stages::direction_bins::DirectionBins;
use linklight::stages::hierarchy::{BLOCKS_BEHIND, NONE, REFLECTS_BEHIND};
use std::f32::consts::PI;

/// Unordered pairs of nodes that exchange light, by recursion; and those that would, if they were not back to back.
pub fn pairs(nodes: &[HierarchyNode], leaves: &[HierarchyLeaf], solid_angle: f32, slack: f32) -> [Vec<[u32; 2]>; 2] {
    let (mut found, mut back_to_back) = (Vec::new(), Vec::new());
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
            (false, false) if x.margin + y.margin == 0.0 && are_back_to_back(x, y, leaves, slack) => {
                back_to_back.push([a, b])
            }
            (false, false) => found.push([a, b]),
            (true, false) => stack.extend(children(nodes, a).map(|c| (c, b))),
            (true, true) if x.radius >= y.radius => stack.extend(children(nodes, a).map(|c| (c, b))),
            _ => stack.extend(children(nodes, b).map(|c| (a, c))),
        }
    }
    [found, back_to_back]
}

/// Whether each of two flat nodes of solids is behind the other's surface, but for a share `slack` of its size.
pub fn are_back_to_back(x: &HierarchyNode, y: &HierarchyNode, leaves: &[HierarchyLeaf], slack: f32) -> bool {
    let (Some(a), Some(b)) = (leaves.get(x.shape as usize), leaves.get(y.shape as usize)) else { return false };
    let slant = (1.0 - a.normal.dot(b.normal).powi(2)).max(0.0).sqrt();
    let is_behind = |own: &HierarchyNode, leaf: &HierarchyLeaf, other: &HierarchyNode| {
        leaf.flags & BLOCKS_BEHIND == 0 && leaf.normal.dot(other.center - own.center) <= other.radius * (slack - slant)
    };
    is_behind(x, a, y) && is_behind(y, b, x)
}

/// What an even light brings to each side of each leaf along `links`, at the leaf itself over what it brings as seen from the
/// receivers.
pub fn scales(nodes: &[HierarchyNode], leaves: &[HierarchyLeaf], links: &[[u32; 2]]) -> Vec<f64> {
    let mut sums = vec![[0.0f64; 2]; 2 * leaves.len()];
    for (sender, receiver) in links.iter().flat_map(|&[a, b]| [(a, b), (b, a)]) {
        let (from, to) = (&nodes[sender as usize], &nodes[receiver as usize]);
        let shape = leaves.get(from.shape as usize);
        let looks_away =
            |leaf: &HierarchyLeaf| leaf.flags & REFLECTS_BEHIND == 0 && leaf.normal.dot(to.center - from.center) <= 0.0;
        if shape.is_some_and(looks_away) || to.center == from.center {
            continue;
        }
        for own in nodes[receiver as usize..to.skip as usize].iter().filter(|own| own.leaf != NONE) {
            let normal = leaves[own.leaf as usize].normal;
            for (k, place) in [own.center, to.center].into_iter().enumerate() {
                let offset = place - from.center;
                let w = offset.normalize();
                let (u, v) = (from.half_u, from.half_v);
                let is_close = offset.length_squared() < 16.0 * (u.length_squared() + v.length_squared());
                let is_beside = normal.dot(offset).abs() >= 0.999 * (normal.dot(u).abs() + normal.dot(v).abs());
                if shape.is_some() && is_close && is_beside {
                    let irradiance = rectangle_irradiance(offset.as_dvec3(), [u, v], normal.as_dvec3());
                    sums[2 * own.leaf as usize + usize::from(irradiance < 0.0)][k] += irradiance.abs();
                    continue;
                }
                let turned = shape.map_or(0.5, |leaf| leaf.normal.dot(w).abs());
                let disc = f64::from(from.area * turned / offset.length_squared() / PI);
                let solid_angle = 2.0 * std::f64::consts::PI * (1.0 - 1.0 / (1.0 + disc).sqrt());
                let side = 2 * own.leaf as usize + usize::from(normal.dot(w) > 0.0);
                sums[side][k] += solid_angle * f64::from(normal.dot(w).abs());
            }
        }
    }
    sums.iter().map(|[here, there]| if *there > 0.0 { (here / there).clamp(0.5, 2.0) } else { 1.0 }).collect()
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

    /// Normal and scale of cosines of a node within one flat surface, and whether light passes it from behind.
    fn end(&self, node: &HierarchyNode) -> Option<(Vec3, f32, bool)> {
        let leaf = self.leaves.get(node.shape as usize)?;
        Some((leaf.normal, self.norms[node.shape as usize], leaf.flags & BLOCKS_BEHIND == 0))
    }

    /// Bin for light along `w` between two ends, and what a bin's worth of it weighs.
    fn carried(&self, p: Option<(Vec3, f32, bool)>, q: Option<(Vec3, f32, bool)>, w: Vec3) -> Option<(u32, f32)> {
        let m = self.bins.count();
        let on_side = |end: Option<(Vec3, f32, bool)>, v: Vec3| {
            end.is_none_or(|(normal, ..)| normal.dot(v) * normal.dot(w) > 0.0)
        };
        let near = self.list(0, self.bins.bin_of(w)).iter().map(|e| e.bin);
        let at = |bin: u32| self.bins.directions[bin as usize];
        let bin = near.into_iter().find(|&bin| on_side(p, at(bin)) && on_side(q, at(bin)))?;
        let received =
            p.map_or(1.0, |(normal, norm, _)| normal.dot(w).abs() / discrete_cosine(normal.dot(at(bin)), norm, m));
        let sent = q.map_or(1.0, |(normal, norm, _)| 1.0 / discrete_cosine(normal.dot(at(bin)), norm, m));
        Some((bin, received * sent))
    }

    /// What of a bin's width around a direction, `whole` of which counts, lies on a rectangle (middle, half sides), as seen from
    /// the origin: by the angle's sine to each of its sides.
    fn share_of_bin(&self, direction: Vec3, middle: Vec3, sides: [Vec3; 2], whole: f32) -> f32 {
        let within = |side: Vec3, along: Vec3| {
            let across = (middle + side).cross(along).normalize_or_zero();
            let inwards = across.dot(direction) * across.dot(middle).signum();
            ((0.5 + inwards / self.bins.solid_angle().sqrt()) / whole).clamp(0.0, 1.0)
        };
        let [u, v] = sides;
        (within(u, v) + within(-u, v) - 1.0).max(0.0) * (within(v, u) + within(-v, u) - 1.0).max(0.0)
    }

    /// (receiver's cell, sender's entry, weight) from one node to another.
    pub fn transfers(&self, sender: u32, receiver: u32) -> Vec<(u32, u32, f32)> {
        let (from, to) = (&self.nodes[sender as usize], &self.nodes[receiver as usize]);
        let offset = to.center - from.center;
        let squared = offset.length_squared();
        if squared <= 0.0 || from.area <= 0.0 {
            return Vec::new();
        }
        let (m, w, q, p) = (self.bins.count(), offset / squared.sqrt(), self.end(from), self.end(to));
        let disc = |area: f32| 2.0 * PI * (1.0 - 1.0 / (1.0 + f64::from(area / PI)).sqrt()) as f32;
        let solid_angle = q.map_or(from.area / squared, |(normal, ..)| disc(from.area * normal.dot(w).abs() / squared));
        if solid_angle <= 0.0 {
            return Vec::new();
        }
        // A flat sender all of which lies behind a surface that nothing reaches from there.
        if let (Some((normal, _, true)), Some(_)) = (p, q)
            && normal.dot(offset) >= normal.dot(from.half_u).abs() + normal.dot(from.half_v).abs()
        {
            return Vec::new();
        }
        let coverage = solid_angle / self.bins.solid_angle();
        let entry = |bin: u32, read: u32, weight: f32| (receiver * m + bin, sender * m + read, weight);
        let is_hidden = |v: Vec3| p.is_some_and(|(normal, _, passes_behind)| passes_behind && normal.dot(v) >= 0.0);

        // Whether a flat sender's light along `v` arrives at a side of the receiver that its centre is on, or, of what the
        // receiver stands on, a quarter of it.
        let reaches = |v: Vec3| {
            let (Some((normal, ..)), Some((sends, ..))) = (p, q) else { return true };
            let reach = normal.dot(from.half_u).abs() + normal.dot(from.half_v).abs();
            let (arrives_in_front, behind) = (normal.dot(v) < 0.0, normal.dot(offset));
            let stands_on = sends.dot(offset) > 0.0 && behind < 0.5 * reach;
            !is_hidden(v) && if arrives_in_front { behind <= 0.0 || stands_on } else { behind > 0.0 }
        };

        let is_facing = |sends: Vec3| sends.dot(offset) > 0.0 && p.is_some_and(|(normal, ..)| normal.dot(offset) < 0.0);
        let is_on_its_way = |sends: Vec3, v: Vec3| v.dot(offset) > 0.0 || is_facing(sends);

        // A rectangle close by, bin by bin.
        let sides = [from.half_u, from.half_v];
        let is_close = squared < 4.0 * sides.iter().map(|half| half.length_squared()).sum::<f32>();
        let is_close = is_close && rectangle_solid_angle(offset.as_dvec3(), sides) > f64::from(self.bins.solid_angle());
        let is_flat_cone = self.class_count > 0 && !self.is_gaussian;
        if let (Some((normal, norm, _)), true) = (q, is_flat_cone && (is_close || coverage > 4.0)) {
            // Of a bin's width, what lies on its side of a plane.
            let on_side = |cosine: f32| (0.5 + cosine.abs() / self.bins.solid_angle().sqrt()).min(1.0);
            let shares = self.bins.directions.iter().map(|v| {
                let received = p.map_or(1.0, |(normal, ..)| on_side(normal.dot(*v)));
                (self.share_of_bin(-*v, -offset, sides, on_side(normal.dot(*v))) / received).min(1.0)
            });
            let own = shares.zip(0..).filter(|&(share, bin)| {
                let v = self.bins.directions[bin as usize];
                share > 0.0 && normal.dot(v) * normal.dot(w) > 0.0 && reaches(v) && is_on_its_way(normal, v)
            });
            let sent = |bin: u32| discrete_cosine(normal.dot(self.bins.directions[bin as usize]), norm, m);
            return own.map(|(share, bin)| entry(bin, bin, share / sent(bin))).collect();
        }

        // A rectangle, sample by sample.
        if let (Some((normal, ..)), true) = (q, is_flat_cone) {
            let side = ((2.0 * coverage.sqrt()).ceil() as u32).clamp(1, 4);
            let mut found: Vec<(u32, f32, f32)> = Vec::new();
            for (i, j) in (0..side * side).map(|s| (s % side, s / side)) {
                let [a, b] = [i, j].map(|k| (k as f32 + 0.5) / side as f32 * 2.0 - 1.0);
                let offset = to.center - (from.center + a * from.half_u + b * from.half_v);
                let (squared, w) = (offset.length_squared(), offset.normalize());
                if !reaches(w) {
                    continue;
                }
                let Some((bin, weight)) = self.carried(p, q, w) else { continue };
                if !is_on_its_way(normal, self.bins.directions[bin as usize]) {
                    continue;
                }
                let own = disc(from.area / (side * side) as f32 * normal.dot(w).abs() / squared);
                let covered = own / self.bins.solid_angle();
                match found.iter_mut().find(|(other, ..)| *other == bin) {
                    Some((_, sum, cover)) => (*sum, *cover) = (*sum + weight * covered, *cover + covered),
                    None => found.push((bin, weight * covered, covered)),
                }
            }
            return found.into_iter().map(|(bin, weight, cover)| entry(bin, bin, weight / cover.max(1.0))).collect();
        }

        let doublings = coverage.log2();
        let size_class = if doublings < 0.25 { 0 } else { ((2.0 * doublings).ceil() as u32).min(self.class_count) };
        if size_class == 0 {
            let carried = self.carried(p, q, w).filter(|_| !is_hidden(w));
            return carried.map(|(bin, weight)| entry(bin, bin, coverage * weight)).into_iter().collect();
        }
        let at = |bin: u32| self.bins.directions[bin as usize];
        let list: Vec<&SpreadEntry> = self
            .list(size_class, self.bins.bin_of(w))
            .iter()
            .filter(|e| [p, q].iter().flatten().all(|(normal, ..)| normal.dot(at(e.bin)) * normal.dot(w) > 0.0))
            .collect();
        let total: f32 = list.iter().map(|e| e.weight).sum();
        let mut found = Vec::new();
        for &&SpreadEntry { bin, weight } in list.iter().filter(|e| !is_hidden(at(e.bin))) {
            let read = if self.is_gaussian { list[0].bin } else { bin };
            let mut share = coverage * weight / total;
            if let Some((normal, norm, _)) = q {
                share /= discrete_cosine(normal.dot(at(read)), norm, m);
            }
            found.push(entry(bin, read, share));
        }
        found
    }
}

/// Of a rectangle (half of its sides) from a place `offset` from its middle, as two triangles (Van Oosterom and Strackee 1983).
fn rectangle_solid_angle(offset: DVec3, sides: [Vec3; 2]) -> f64 {
    let [u, v] = sides.map(Vec3::as_dvec3);
    let triangle = |corners: [DVec3; 3]| {
        let [a, b, c] = corners.map(|corner| (corner - offset).normalize());
        2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    };
    triangle([u + v, u - v, -u - v]) + triangle([u + v, v - u, -u - v])
}

/// Irradiance from a rectangle of radiance 1, as above, on a surface of that normal; negative at its back: by many small parts.
fn rectangle_irradiance(offset: DVec3, sides: [Vec3; 2], normal: DVec3) -> f64 {
    const PARTS: u32 = 48;
    let [u, v] = sides.map(Vec3::as_dvec3);
    let area = 4.0 * u.cross(v).length() / f64::from(PARTS * PARTS);
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(PARTS) * 2.0 - 1.0;
    let part = |k: u32| {
        let way = at(k % PARTS) * u + at(k / PARTS) * v - offset;
        let w = way.normalize();
        area * w.dot(u.cross(v).normalize()).abs() * w.dot(normal) / way.length_squared()
    };
    (0..PARTS * PARTS).map(part).sum()
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

/// `incident`: the leaf's row. `source`, `albedo` and `scales` (of what links bring): front and back. `lowest`: by side and bin.
pub fn local(
    leaf: &HierarchyLeaf,
    norm: f32,
    bins: &DirectionBins,
    incident: &[DVec3],
    (source, albedo, scales): ([Vec3; 2], [Vec3; 2], [f32; 2]),
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
    irradiance[0] *= f64::from(scales[0]);
    irradiance[1] *= f64::from(scales[1]);
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
