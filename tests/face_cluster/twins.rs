//! Plain twins of the kernels, in double precision and without regard to speed. Each takes what the kernel reads.

use glam::{DMat3, DQuat, DVec2, DVec3, Vec3};
use linklight::gpu::shaders::types::{ClusterInstance, CubatureNode, FaceCluster, FaceElement};
use linklight::stages::clusters::{face_count, first_face, measure::decode_color, self_shares};
use std::ops::Range;

pub const NONE: u32 = u32::MAX;

/// Irradiance vectors of three channels.
pub type Vectors = [DVec3; 3];

/// What the scene and its clusters are, on the host.
pub struct Tables {
    pub clusters: Vec<FaceCluster>,
    pub skips: Vec<u32>,
    pub instances: Vec<ClusterInstance>,
    pub faces: Vec<u32>,
    pub places: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
    pub positions: Vec<Vec3>,
    /// Of the receiver, then of the shooter; on the square, then on a triangle.
    pub rules: Vec<CubatureNode>,
    pub receiver_nodes: usize,
    /// Per triangle: of a closed body.
    pub is_solid: Vec<bool>,
    /// Rays start so far off a surface, metres.
    pub ray_offset: f32,
}

impl Tables {
    pub fn children(&self, cluster: u32) -> Option<[u32; 2]> {
        let left = cluster + 1;
        (self.skips[cluster as usize] != left).then(|| [left, self.skips[left as usize]])
    }

    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize].as_dvec3())
    }

    /// Of the element's own kind: receiver's, then shooter's.
    pub fn rules_of(&self, e: &FaceElement) -> &[CubatureNode] {
        let half = self.rules.len() / 2;
        if e.place_count == 1 { &self.rules[half..] } else { &self.rules[..half] }
    }

    pub fn triangle_at(&self, instance: &ClusterInstance, place: u32) -> u32 {
        instance.first_triangle + self.faces[(instance.first_face + place) as usize]
    }
}

pub fn count(cluster: &FaceCluster) -> u32 {
    face_count(cluster)
}

pub fn turn(cluster: &FaceCluster) -> DQuat {
    let [x, y, z, w] = cluster.rotation.map(f64::from);
    DQuat::from_xyzw(x, y, z, w)
}

pub fn frame(instance: &ClusterInstance) -> (DMat3, DVec3) {
    let [x, y, z, at] = instance.world_from_tree.map(|c| Vec3::from_array(c).as_dvec3());
    (DMat3::from_cols(x, y, z), at)
}

/// `make_element`: a cluster placed in the world.
pub fn element(t: &Tables, instance: u32, cluster: u32, parent: u32, level: u32) -> FaceElement {
    let (inst, c) = (&t.instances[instance as usize], &t.clusters[cluster as usize]);
    let (linear, at) = frame(inst);
    let scale = f64::from(inst.scale);
    let axis = |k: usize| (linear * (turn(c) * [DVec3::X, DVec3::Y, DVec3::Z][k]) / scale).as_vec3();
    let is_back = inst.is_back != 0;
    let mut facing = c.facing.map(|sum| (f64::from(sum) * scale * scale) as f32);
    if is_back {
        // x with -x, y with -y; z is turned about together with the normals.
        facing.swap(0, 1);
        facing.swap(2, 3);
    }
    FaceElement {
        cluster,
        instance,
        parent,
        children: NONE,
        level,
        first_place: inst.first_triangle + first_face(c),
        place_count: count(c),
        self_share: self_shares(c)[usize::from(is_back)]
            * (1.0 - (c.facing[4] - c.facing[5]) / c.area.max(1e-30)).clamp(0.0, 1.0),
        center: (linear * c.center.as_dvec3() + at).as_vec3(),
        axis_x: axis(0),
        axis_y: axis(1),
        axis_z: if is_back { -axis(2) } else { axis(2) },
        half_extent: c.half_extent * inst.scale,
        area: c.area * inst.scale * inst.scale,
        facing,
        albedo: decode_color(c.albedo[1]),
        most_albedo: decode_color(c.albedo[2]).max_element(),
        emission: c.emission,
        is_part_hidden: 0,
    }
}

pub fn plane_point(e: &FaceElement, uv: DVec2) -> DVec3 {
    let d = 2.0 * uv - 1.0;
    let (x, y) = (d.x * f64::from(e.half_extent.x), d.y * f64::from(e.half_extent.y));
    e.center.as_dvec3() + x * e.axis_x.as_dvec3() + y * e.axis_y.as_dvec3()
}

pub fn plane_coordinates(e: &FaceElement, point: DVec3) -> DVec2 {
    let d = point - e.center.as_dvec3();
    let along = DVec2::new(d.dot(e.axis_x.as_dvec3()), d.dot(e.axis_y.as_dvec3()));
    0.5 + 0.5 * along / e.half_extent.truncate().as_dvec2().max(DVec2::splat(1e-30))
}

/// The nearest point of a triangle: of its inside, else of a side.
pub fn nearest(p: DVec3, corners: [DVec3; 3]) -> DVec3 {
    let [a, b, c] = corners;
    let n = (b - a).cross(c - a);
    let foot = p - n * ((p - a).dot(n) / n.length_squared());
    let sides = [(a, b), (b, c), (c, a)];
    if sides.iter().all(|&(s, t)| (t - s).cross(foot - s).dot(n) >= 0.0) {
        return foot;
    }
    let on_side =
        |(s, t): (DVec3, DVec3)| s + (t - s) * ((p - s).dot(t - s) / (t - s).length_squared()).clamp(0.0, 1.0);
    sides.map(on_side).into_iter().min_by(|x, y| x.distance(p).total_cmp(&y.distance(p))).unwrap()
}

/// Places looked at for a node.
const TRIES: usize = 8;

/// Whether some closed body holds what is just off `place`, along a slanted `normal`: by all triangles.
fn is_hidden(t: &Tables, place: DVec3, normal: DVec3) -> bool {
    let aside = if normal.x.abs() < 0.5 { DVec3::X } else { DVec3::Y };
    let way = (normal + 0.07 * aside + 0.03 * normal.cross(aside)).normalize();
    let mut bodies = 0;
    for (triangle, _) in t.is_solid.iter().enumerate().filter(|(_, is_solid)| **is_solid) {
        let [a, b, c] = t.corners(triangle as u32);
        let n = (b - a).cross(c - a);
        let distance = (a - place).dot(n) / way.dot(n);
        let p = place + distance * way;
        let is_met = [(a, b), (b, c), (c, a)].iter().all(|&(s, e)| (e - s).cross(p - s).dot(n) >= 0.0);
        if is_met && distance > f64::from(t.ray_offset) {
            bodies += if way.dot(n) > 0.0 { 1 } else { -1 };
        }
    }
    bodies > 0
}

/// Where `uv` of an element may be laid: on the nearest of its faces, found by the nearer box at every level, with the
/// normal of that face's front. Where two boxes are as near, single precision takes either.
fn laid(t: &Tables, e: &FaceElement, uv: DVec2) -> Vec<(DVec3, DVec3)> {
    let inst = &t.instances[e.instance as usize];
    let (linear, at) = frame(inst);
    let side = if inst.is_back != 0 { -1.0 } else { 1.0 };
    let front = |corners: [DVec3; 3]| (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
    if e.place_count == 1 {
        let corners = t.corners(t.triangle_at(inst, e.first_place - inst.first_triangle));
        let uv = if uv.x + uv.y > 1.0 { 1.0 - uv } else { uv };
        let place = corners[0] * (1.0 - uv.x - uv.y) + corners[1] * uv.x + corners[2] * uv.y;
        return vec![(place, front(corners))];
    }
    let point = plane_point(e, uv);
    let q = linear.inverse() * (point - at);
    let in_box = |k: u32| {
        let (c, h) = (&t.clusters[k as usize], t.clusters[k as usize].half_extent.as_dvec3());
        c.center.as_dvec3() + turn(c) * (turn(c).inverse() * (q - c.center.as_dvec3())).clamp(-h, h)
    };
    let (mut places, mut stack) = (Vec::new(), vec![e.cluster]);
    while let Some(cluster) = stack.pop() {
        if let Some([left, right]) = t.children(cluster) {
            let (to_left, to_right) = (in_box(left).distance(q), in_box(right).distance(q));
            let slack = 1e-5;
            stack.extend((to_right <= to_left + slack).then_some(right));
            stack.extend((to_left <= to_right + slack).then_some(left));
            continue;
        }
        let c = &t.clusters[cluster as usize];
        places.push(if count(c) > 1 {
            (linear * in_box(cluster) + at, side * e.axis_z.as_dvec3())
        } else {
            let corners = t.corners(t.triangle_at(inst, first_face(c)));
            (nearest(point, corners).lerp(corners.iter().sum::<DVec3>() / 3.0, 0.05), front(corners))
        });
    }
    places
}

/// The nodes of an element, and the share of its area that is not hidden.
pub struct Nodes {
    pub places: Vec<Vec3>,
    /// Of the faces there.
    pub normals: Vec<Vec3>,
    pub share: f64,
    /// Per node: single precision finds the same place.
    pub is_clear: Vec<bool>,
}

/// `lay_nodes`.
pub fn nodes(t: &Tables, e: &FaceElement) -> Nodes {
    let side = if t.instances[e.instance as usize].is_back != 0 { -1.0 } else { 1.0 };
    let (mut places, mut free, mut is_clear, mut tried) = (Vec::new(), Vec::new(), Vec::new(), 0.0);
    let mut normals: Vec<DVec3> = Vec::new();
    for rule in t.rules_of(e) {
        let (mut last, mut clear, mut normal) = ((DVec3::ZERO, false), true, DVec3::ZERO);
        for k in 0..TRIES {
            let step = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_2) * k as f64;
            let found = laid(t, e, (rule.uv.as_dvec2() + step).fract());
            clear &= found.iter().all(|(place, _)| place.distance(found[0].0) < 1e-4);
            normal = side * found[0].1;
            last = (found[0].0, !is_hidden(t, found[0].0, side * found[0].1));
            tried += 1.0;
            if last.1 {
                break;
            }
        }
        places.push(last.0);
        normals.push(normal);
        free.push(last.1);
        is_clear.push(clear);
    }
    // The one before, around.
    let count = free.len();
    for k in (0..count).filter(|&k| !free[k]) {
        if let Some(seen) = (1..count).map(|back| (k + count - back) % count).find(|&other| free[other]) {
            (places[k], normals[k]) = (places[seen], normals[seen]);
        }
    }
    let share = (free.iter().filter(|&&free| free).count() as f64 / tried).max(1.0 / 256.0);
    if share < 1.0 && !is_clear.iter().all(|&clear| clear) {
        is_clear.iter_mut().for_each(|clear| *clear = false);
    }
    let single = |of: &[DVec3]| of.iter().map(|v| v.as_vec3()).collect();
    Nodes { places: single(&places), normals: single(&normals), share, is_clear }
}

/// Where node `k` of an element counts as standing in its square.
pub fn node_coordinates(t: &Tables, e: &FaceElement, nodes: &[Vec3], k: usize) -> DVec2 {
    if is_flat(e) { plane_coordinates(e, nodes[k].as_dvec3()) } else { t.rules_of(e)[k].uv.as_dvec2() }
}

/// Whether the faces lie in one plane, nearly.
pub fn is_flat(e: &FaceElement) -> bool {
    e.place_count == 1 || vector_area(e) > 0.99 * f64::from(e.area)
}

/// Solves for all columns beyond the first as many as there are rows. By Gauss and Jordan.
fn solved(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let count = rows.len();
    for j in 0..count {
        let pivot = rows[j][j];
        rows[j].iter_mut().for_each(|v| *v /= pivot);
        let own = rows[j].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != j) {
            let factor = row[j];
            row.iter_mut().zip(&own).for_each(|(v, o)| *v -= factor * o);
        }
    }
    rows.into_iter().map(|row| row[count..].to_vec()).collect()
}

/// Means of products of two functions over flat faces, or over 64 of them.
fn products_over_faces(t: &Tables, e: &FaceElement, functions: usize) -> Vec<Vec<f64>> {
    let (inst, all, taken) = (&t.instances[e.instance as usize], e.place_count, e.place_count.min(64));
    let half = t.rules.len() / 2;
    let (mut sums, mut area) = (vec![vec![0.0; functions]; functions], 0.0);
    for f in 0..taken {
        let face = e.first_place - inst.first_triangle + (2 * f + 1) * all / (2 * taken);
        let [a, b, c] = t.corners(t.triangle_at(inst, face));
        let size = (b - a).cross(c - a).length();
        area += size;
        for node in &t.rules[half..half + t.receiver_nodes] {
            let (u, v) = (f64::from(node.uv.x), f64::from(node.uv.y));
            let uv = plane_coordinates(e, a * (1.0 - u - v) + b * u + c * v);
            for (j, row) in sums.iter_mut().enumerate() {
                let value = |k: usize| size * f64::from(node.weight) * basis(j, uv) * basis(k, uv);
                row.iter_mut().enumerate().for_each(|(k, sum)| *sum += value(k));
            }
        }
    }
    sums.iter_mut().flatten().for_each(|sum| *sum /= area);
    sums
}

/// What is laid through some nodes by least squares, projected on so many functions over the faces (a row a function, a
/// column a node); the functions' means; and whether these are the faces' or the nodes' own.
fn laid_over(
    t: &Tables,
    e: &FaceElement,
    nodes: &[Vec3],
    (of, higher): (Range<usize>, f64),
    functions: usize,
) -> (Vec<Vec<f64>>, Vec<f64>, bool) {
    let laid = [(16, 10), (6, 6), (4, 3), (1, 1)].into_iter().find(|(nodes, _)| of.len() >= *nodes).unwrap().1;
    let at: Vec<Vec<f64>> = of
        .clone()
        .map(|k| node_coordinates(t, e, nodes, k))
        .map(|uv| (0..laid).map(|k| basis(k, uv)).collect())
        .collect();
    let weights = rule_weights(t, e, of);
    let sum = |j: usize, k: usize| -> f64 { at.iter().zip(&weights).map(|(b, w)| w * b[j] * b[k]).sum() };
    let at_nodes: Vec<Vec<f64>> = (0..laid).map(|j| (0..laid).map(|k| sum(j, k)).collect()).collect();
    let fills = !is_flat(e) || e.area > 0.99 * 4.0 * e.half_extent.x * e.half_extent.y;
    let scale = t.instances[e.instance as usize].scale;
    let is_whole = e.area > 0.9999 * t.clusters[e.cluster as usize].area * scale * scale;
    let by_faces = !fills && is_whole && e.place_count > 1;
    let products = if by_faces { products_over_faces(t, e, laid) } else { at_nodes.clone() };
    let ridge = |j: usize| match j {
        0 => 0.0,
        1..3 => 1e-3,
        _ => {
            if fills {
                1e-3
            } else {
                higher
            }
        }
    };
    let columns = |j: usize| at.iter().zip(&weights).map(move |(b, w)| w * b[j]);
    let square = |j: usize, k: usize| at_nodes[j][k] + if j == k { ridge(j) } else { 0.0 };
    let rows = (0..laid).map(|j| (0..laid).map(|k| square(j, k)).chain(columns(j)).collect());
    let through = solved(rows.collect());
    let projected = |j: usize, r: usize| -> f64 { (0..laid).map(|k| products[j][k] * through[k][r]).sum() };
    let rows = (0..functions).map(|j| {
        let own = (0..functions).map(|k| products[j][k] + if j == k && j > 0 { 1e-5 } else { 0.0 });
        own.chain((0..at.len()).map(|r| projected(j, r))).collect()
    });
    (solved(rows.collect()), products[0][..functions].to_vec(), by_faces)
}

fn rule_weights(t: &Tables, e: &FaceElement, of: Range<usize>) -> Vec<f64> {
    t.rules_of(e)[of].iter().map(|rule| f64::from(rule.weight)).collect()
}

/// `weigh`: by how much each of some nodes makes the mean.
fn mean_weights(t: &Tables, e: &FaceElement, nodes: &[Vec3], of: Range<usize>) -> Vec<f64> {
    let (mut rows, _, by_faces) = laid_over(t, e, nodes, (of.clone(), 0.01), 1);
    if by_faces { rows.remove(0) } else { rule_weights(t, e, of) }
}

/// `fit_functions` of the receiver's nodes: a row a function, a column a node; and the functions' means.
pub fn fit(t: &Tables, e: &FaceElement, nodes: &[Vec3], functions: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (mut rows, means, _) = laid_over(t, e, nodes, (0..t.receiver_nodes, 0.1), functions);
    for (r, weight) in mean_weights(t, e, nodes, 0..t.receiver_nodes).into_iter().enumerate() {
        let said: f64 = rows.iter().zip(&means).map(|(row, mean)| mean * row[r]).sum();
        rows[0][r] += weight - said;
    }
    (rows, means)
}

/// `fit_functions` of the shooter's nodes: what each is of all.
pub fn weights(t: &Tables, e: &FaceElement, nodes: &[Vec3]) -> Vec<f64> {
    mean_weights(t, e, nodes, t.receiver_nodes..nodes.len())
}

/// Elements without what is hidden of them.
pub fn exposed(mut e: FaceElement, laid: &Nodes) -> FaceElement {
    e.area = (f64::from(e.area) * laid.share) as f32;
    e.facing = e.facing.map(|sum| (f64::from(sum) * laid.share) as f32);
    e.is_part_hidden = u32::from(laid.share > 1.0 / 256.0 && laid.share < 1.0);
    e
}

/// `lib/cluster_basis.glsl`.
pub fn basis(k: usize, uv: DVec2) -> f64 {
    let s = 2.0 * uv - 1.0;
    let p = |degree: u32, x: f64| match degree {
        0 => 1.0,
        1 => 3f64.sqrt() * x,
        2 => 5f64.sqrt() * 0.5 * (3.0 * x * x - 1.0),
        _ => 7f64.sqrt() * 0.5 * x * (5.0 * x * x - 3.0),
    };
    let (u, v) = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)][k];
    p(u, s.x) * p(v, s.y)
}

/// Mean over the square, exact for degree 9 in each variable.
pub fn mean(f: impl Fn(DVec2) -> DVec3) -> DVec3 {
    let (near, far) =
        ((5.0 - 2.0 * (10f64 / 7.0).sqrt()).sqrt() / 3.0, (5.0 + 2.0 * (10f64 / 7.0).sqrt()).sqrt() / 3.0);
    let (heavy, light) = ((322.0 + 13.0 * 70f64.sqrt()) / 1800.0, (322.0 - 13.0 * 70f64.sqrt()) / 1800.0);
    let line = [(-far, light), (-near, heavy), (0.0, 128.0 / 450.0), (near, heavy), (far, light)];
    let mut sum = DVec3::ZERO;
    for (u, wu) in line {
        for (v, wv) in line {
            sum += f(0.5 + 0.5 * DVec2::new(u, v)) * (wu * wv);
        }
    }
    sum
}

/// Coefficients on the functions of `to` of a function that has `values` on those of `from`.   [Gobbetti2003 3.3.4]
pub fn rebased(from: &FaceElement, to: &FaceElement, values: &[DVec3], functions: usize) -> Vec<DVec3> {
    let at = |uv: DVec2| -> DVec3 {
        let place = plane_coordinates(from, plane_point(to, uv));
        values.iter().enumerate().map(|(k, &v)| basis(k, place) * v).sum()
    };
    (0..functions).map(|k| mean(|uv| basis(k, uv) * at(uv))).collect()
}

/// Coefficient on function `k` of the parent of what a child has on its own functions, over the child's square.
pub fn pulled(parent: &FaceElement, child: &FaceElement, values: &[DVec3], k: usize) -> DVec3 {
    mean(|uv| {
        let value: DVec3 = values.iter().enumerate().map(|(j, &v)| basis(j, uv) * v).sum();
        basis(k, plane_coordinates(parent, plane_point(child, uv))) * value
    })
}

/// What a child gets of its parent's vectors: by change of basis, per channel, where its half-space has the mean.
pub fn pushed(parent: &FaceElement, child: &FaceElement, vectors: &[Vectors]) -> Vec<Vectors> {
    let mut out = vec![[DVec3::ZERO; 3]; vectors.len()];
    for c in 0..3 {
        let of_channel: Vec<DVec3> = vectors.iter().map(|v| v[c]).collect();
        let values = rebased(parent, child, &of_channel, vectors.len());
        if values[0].dot(child.axis_z.as_dvec3()) > 0.0 {
            values.iter().zip(&mut out).for_each(|(&value, out)| out[c] = value);
        }
    }
    out
}

pub fn vector_area(e: &FaceElement) -> f64 {
    f64::from(e.facing[4] - e.facing[5]).max(0.0)
}
