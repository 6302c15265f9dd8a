//! What glossy elements reflect bin by bin and send along tables, against plain versions over tables drawn by chance.

use crate::common::lobe::{brdf, specular_albedo};
use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use crate::twins;
use bytemuck::Zeroable;
use glam::{DVec3, Quat, Vec3, Vec4};
use linklight::gpu::shaders::methods::implicit_visibility as passes;
use linklight::gpu::shaders::types::{GlossTarget, LeafGloss, Receiver, Surfel};
use linklight::methods::implicit_visibility::bins;
use linklight::stages::elements::BACK_SIDE;
use linklight::stages::quadtree::topology::QuadtreeTopology;
use std::f64::consts::PI;

/// Sums of some hundred terms in single precision; lobes a tenth wide square the error of a half vector.
pub const TOLERANCE: Tolerance = Tolerance { absolute: 2e-5, relative: 5e-4 };

/// Of the leaves' cube maps, and of the tables.
pub const N: u32 = 6;
pub const SIDE: u32 = 2;

pub fn unit_vector(random: &mut Random) -> Vec3 {
    let z = 2.0 * random.unit() - 1.0;
    let (sin, cos) = (std::f32::consts::TAU * random.unit()).sin_cos();
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

pub fn color(random: &mut Random) -> Vec3 {
    Vec3::new(random.unit(), random.unit(), random.unit())
}

/// Leaves of one window that starts at `first_leaf`, half of them glossy, and two nodes above.
#[derive(Clone)]
pub struct Case {
    pub first_leaf: u32,
    /// All leaves, those before the window too.
    pub receivers: Vec<Receiver>,
    /// Of the window, bin after bin.
    pub winners: Vec<u32>,
    pub node_radiosity: Vec<Vec3>,
    pub glossy_of_node: Vec<u32>,
    pub glossy_leaves: Vec<u32>,
    pub specular: Vec<Vec3>,
    pub leaf_elements: Vec<u32>,
    pub element_vertices: Vec<u32>,
    pub lobes: Vec<LeafGloss>,
    pub bin_radiance: Vec<Vec3>,
}

impl Case {
    pub fn new(leaf_count: u32, first_leaf: u32, random: &mut Random) -> Self {
        let (all, nodes) = (leaf_count + first_leaf, leaf_count + first_leaf + 2);
        let bins = 6 * N * N;
        let receivers = (0..all).map(|leaf| Receiver {
            origin: 3.0 * unit_vector(random),
            normal: unit_vector(random),
            // One in three turned.
            frame: if leaf % 3 == 0 {
                Quat::from_axis_angle(unit_vector(random), 1.0).to_array()
            } else {
                [0.0, 0.0, 0.0, 1.0]
            },
        });
        let receivers: Vec<Receiver> = receivers.collect();
        let winners = (0..bins * leaf_count).map(|_| match random.below(4) {
            0 => twins::EMPTY,
            1 => random.below(nodes) | twins::BACK,
            _ => random.below(nodes),
        });
        let winners: Vec<u32> = winners.collect();
        let glossy_leaves: Vec<u32> = (0..all).filter(|leaf| leaf % 2 == 0).collect();
        // The nodes above are glossy too.
        let glossy: Vec<u32> = glossy_leaves.iter().copied().chain(all..nodes).collect();
        let mut glossy_of_node = vec![u32::MAX; nodes as usize];
        glossy.iter().zip(0..).for_each(|(&node, index)| glossy_of_node[node as usize] = index);
        let lobe =
            |random: &mut Random| LeafGloss { f0: 0.9 * color(random), f90: 1.0, alpha: 0.05 + 0.6 * random.unit() };
        Self {
            first_leaf,
            node_radiosity: (0..nodes).map(|_| color(random)).collect(),
            specular: (0..glossy.len() as u32 * 6 * SIDE * SIDE).map(|_| color(random)).collect(),
            bin_radiance: (0..bins).map(|_| color(random)).collect(),
            // Elements in another order than leaves, backs among them.
            leaf_elements: (0..all).rev().collect(),
            element_vertices: (0..all)
                .map(|element| (element / 2) | if element % 2 == 1 { BACK_SIDE } else { 0 })
                .collect(),
            lobes: (0..all.div_ceil(2)).map(|_| lobe(random)).collect(),
            receivers,
            winners,
            glossy_of_node,
            glossy_leaves,
        }
    }

    pub fn leaf_count(&self) -> u32 {
        self.receivers.len() as u32 - self.first_leaf
    }

    fn lobe(&self, leaf: u32) -> &LeafGloss {
        &self.lobes[(self.element_vertices[self.leaf_elements[leaf as usize] as usize] & !BACK_SIDE) as usize]
    }

    /// The glossy leaves of the window, among all.
    fn target(&self, side: u32) -> GlossTarget {
        let first = self.glossy_leaves.iter().filter(|&&leaf| leaf < self.first_leaf).count() as u32;
        GlossTarget { side, first, count: self.glossy_leaves.len() as u32 - first }
    }

    fn on_device(
        &self,
        context: &TestContext,
        target: GlossTarget,
        eye: Vec4,
        table_side: u32,
        sky: bool,
    ) -> Vec<Vec3> {
        let directions = if target.side == 0 { 1 } else { 6 * target.side * target.side };
        let reflected =
            context.buffer::<Vec3>("test/reflected", self.glossy_leaves.len() * directions as usize).unwrap();
        let pass = passes::ReflectGlossy {
            glossy_leaves: &context.upload("test/glossy", &self.glossy_leaves).unwrap(),
            winners: &context.upload("test/winners", &self.winners).unwrap(),
            receivers: &context.upload("test/receivers", &self.receivers).unwrap(),
            bin_vectors: &context.upload("test/vectors", &bins::vectors(N)).unwrap(),
            bin_radiance: &context.upload("test/sky", &self.bin_radiance).unwrap(),
            node_radiosity: &context.upload("test/radiosity", &self.node_radiosity).unwrap(),
            glossy_of_node: &context.upload("test/glossy of node", &self.glossy_of_node).unwrap(),
            specular: &context.upload("test/specular", &self.specular).unwrap(),
            lobes: &context.upload("test/lobes", &self.lobes).unwrap(),
            leaf_elements: &context.upload("test/elements", &self.leaf_elements).unwrap(),
            element_vertices: &context.upload("test/vertices", &self.element_vertices).unwrap(),
            reflected: &reflected,
            params: passes::ReflectGlossyParams {
                target,
                eye: eye.to_array(),
                first_leaf: self.first_leaf,
                leaf_count: self.leaf_count(),
                n: N,
                table_side,
                has_environment: u32::from(sky),
            },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.fill(&reflected, 0);
        recorder.dispatch(&pass, target.count * directions);
        recorder.submit().unwrap();
        context.download(&reflected).unwrap()
    }

    /// The twin of `reflect_glossy`: what the lobe sends to the eye of what comes through the bins.
    fn reflected(&self, target: GlossTarget, eye: Vec4, table_side: u32, sky: bool) -> Vec<Vec3> {
        let vectors = bins::vectors(N);
        let directions = directions_of(target.side);
        let mut out = vec![Vec3::ZERO; self.glossy_leaves.len() * directions.len().max(1)];
        for glossy in target.first..target.first + target.count {
            let leaf = self.glossy_leaves[glossy as usize];
            let at = &self.receivers[leaf as usize];
            let (lobe, frame) = (self.lobe(leaf), Quat::from_array(at.frame));
            let alpha = widened(lobe, 6 * N * N);
            let (f0, normal) = (lobe.f0.as_dvec3(), at.normal.as_dvec3());
            for k in 0..directions.len().max(1) {
                let to_eye = directions.get(k).copied().unwrap_or_else(|| towards(eye, at.origin));
                let (mut sum, mut weights) = (DVec3::ZERO, DVec3::ZERO);
                for (bin, vector) in vectors.iter().enumerate() {
                    let cosine = (frame * *vector).dot(at.normal);
                    if cosine <= 0.0 || to_eye.dot(normal) <= 0.0 {
                        continue;
                    }
                    let from = (frame * *vector).normalize();
                    let weight = f64::from(cosine) * brdf(f0, lobe.f90.into(), alpha, normal, to_eye, from.as_dvec3());
                    let winner = self.winners[bin * self.leaf_count() as usize + (leaf - self.first_leaf) as usize];
                    sum += weight * self.arriving(winner, from, table_side, sky).as_dvec3();
                    weights += weight;
                }
                let share = specular_albedo(f0, lobe.f90.into(), alpha, normal.dot(to_eye));
                out[glossy as usize * directions.len().max(1) + k] =
                    (share * sum / weights.max(DVec3::splat(1e-20))).as_vec3();
            }
        }
        out
    }

    fn arriving(&self, winner: u32, from: Vec3, table_side: u32, sky: bool) -> Vec3 {
        if winner == twins::EMPTY {
            return if sky { self.bin_radiance[bins::bin_of(from, N) as usize] } else { Vec3::ZERO };
        }
        if winner & twins::BACK != 0 {
            return Vec3::ZERO;
        }
        let even = self.node_radiosity[winner as usize] / PI as f32;
        let glossy = self.glossy_of_node[winner as usize];
        if table_side == 0 || glossy == u32::MAX {
            return even;
        }
        let bin = bins::bin_of(-from, table_side);
        even + self.specular[(glossy * 6 * table_side * table_side + bin) as usize]
    }
}

/// Along the bins of a table; none of the eye's.
pub fn directions_of(side: u32) -> Vec<DVec3> {
    if side == 0 { Vec::new() } else { twins::directions(side) }
}

pub fn towards(eye: Vec4, origin: Vec3) -> DVec3 {
    (eye.truncate() - eye.w * origin).as_dvec3().normalize()
}

/// No lobe is narrower than a bin.
pub fn widened(lobe: &LeafGloss, bin_count: u32) -> f64 {
    (f64::from(lobe.alpha).powi(2) + 1.0 / f64::from(bin_count)).sqrt()
}

#[test]
fn what_comes_through_the_bins_is_reflected_by_the_lobe() {
    let context = TestContext::new();
    let random = &mut Random(21);
    let eyes = [Vec4::new(1.0, 2.0, 5.0, 1.0), Vec4::new(0.6, 0.0, 0.8, 0.0)];
    for (leaf_count, first_leaf) in [(1, 0), (33, 0), (40, 26)] {
        let case = Case::new(leaf_count, first_leaf, random);
        for (side, eye) in [(0, eyes[0]), (0, eyes[1]), (SIDE, Vec4::ZERO)] {
            for (table_side, sky) in [(0, true), (SIDE, false)] {
                let what = format!("{leaf_count} leaves from {first_leaf}, side {side}, tables {table_side}");
                let target = case.target(side);
                let twin = case.reflected(target, eye, table_side, sky);
                hold(&what, &case.on_device(&context, target, eye, table_side, sky), &twin, TOLERANCE);
            }
        }
    }
    // Each table matters.
    let case = Case::new(40, 26, random);
    let target = case.target(SIDE);
    let expected = case.reflected(target, Vec4::ZERO, SIDE, true);
    let differs = |what: &str, change: &dyn Fn(&mut Case)| {
        let mut wrong = Case { specular: case.specular.clone(), ..Case::new(40, 26, &mut Random(21)) };
        for (to, from) in [(&mut wrong.winners, &case.winners), (&mut wrong.glossy_of_node, &case.glossy_of_node)] {
            to.clone_from(from);
        }
        wrong.receivers.clone_from(&case.receivers);
        wrong.node_radiosity.clone_from(&case.node_radiosity);
        wrong.bin_radiance.clone_from(&case.bin_radiance);
        wrong.lobes.clone_from(&case.lobes);
        assert_eq!(wrong.reflected(target, Vec4::ZERO, SIDE, true), expected);
        change(&mut wrong);
        tells_apart(what, &wrong.reflected(target, Vec4::ZERO, SIDE, true), &expected, TOLERANCE);
    };
    differs("other winners", &|case| case.winners.rotate_left(1));
    differs("backs that send", &|case| {
        case.winners.iter_mut().filter(|w| **w != twins::EMPTY).for_each(|w| *w &= !twins::BACK)
    });
    differs("other tables", &|case| case.specular.rotate_left(1));
    differs("another sky", &|case| case.bin_radiance.rotate_left(1));
    differs("other lobes", &|case| case.lobes.rotate_left(1));
    differs("frames left out", &|case| case.receivers.iter_mut().for_each(|at| at.frame = [0.0, 0.0, 0.0, 1.0]));
}

#[test]
fn tables_above_glossy_leaves_are_means_of_those_below() {
    let context = TestContext::new();
    let random = &mut Random(8);
    let trees = QuadtreeTopology::of_sizes(&[21, 6]);
    let directions = 6 * SIDE * SIDE;
    // Leaves 3, 6, 9 ... and all above them.
    let mut is_glossy: Vec<bool> =
        (0..trees.node_count()).map(|node| node < trees.leaf_count() && node % 3 == 0).collect();
    for node in 0..trees.node_count() {
        if let (true, Some(parent)) = (is_glossy[node as usize], trees.parent(node)) {
            is_glossy[parent as usize] = true;
        }
    }
    let nodes: Vec<u32> = (0..trees.node_count()).filter(|&node| is_glossy[node as usize]).collect();
    let mut glossy_of_node = vec![u32::MAX; trees.node_count() as usize];
    nodes.iter().zip(0..).for_each(|(&node, index)| glossy_of_node[node as usize] = index);
    let surfels: Vec<Surfel> = is_glossy.iter().map(|_| Surfel { area: random.unit(), ..Surfel::zeroed() }).collect();
    let before: Vec<Vec3> = (0..nodes.len() as u32 * directions).map(|_| color(random)).collect();

    let specular = context.upload("test/specular", &before).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let glossy_nodes = context.upload("test/glossy nodes", &nodes).unwrap();
    let of_node = context.upload("test/glossy of node", &glossy_of_node).unwrap();
    let node_segments = context.upload("test/node segments", &trees.node_segments).unwrap();
    let segments = context.upload("test/segments", &trees.segments).unwrap();
    let areas = context.upload("test/surfels", &surfels).unwrap();
    for level in &trees.levels[1..] {
        let place = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        let (first, count) = (place(level.start), place(level.end) - place(level.start));
        let pass = passes::PullSpecular {
            glossy_nodes: &glossy_nodes,
            glossy_of_node: &of_node,
            node_segments: &node_segments,
            segments: &segments,
            surfels: &areas,
            specular: &specular,
            params: passes::PullSpecularParams { first, count, directions },
        };
        recorder.dispatch(&pass, count * directions);
    }
    recorder.submit().unwrap();

    let twin = |surfels: &[Surfel]| {
        let mut table = before.clone();
        for (glossy, &node) in nodes.iter().enumerate().filter(|(_, node)| **node >= trees.leaf_count()) {
            for direction in 0..directions as usize {
                let area: f32 = trees.children(node).map(|child| surfels[child as usize].area).sum();
                let own = trees.children(node).filter(|&child| is_glossy[child as usize]);
                let sent = |child: u32| table[(glossy_of_node[child as usize] * directions) as usize + direction];
                let sum: Vec3 = own.map(|child| surfels[child as usize].area * sent(child)).sum();
                table[glossy * directions as usize + direction] = sum / area;
            }
        }
        table
    };
    let tolerance = Tolerance { absolute: 1e-6, relative: 1e-5 };
    hold("pull_specular", &context.download(&specular).unwrap(), &twin(&surfels), tolerance);
    let even: Vec<Surfel> = surfels.iter().map(|_| Surfel { area: 1.0, ..Surfel::zeroed() }).collect();
    tells_apart("areas left out", &twin(&even), &twin(&surfels), tolerance);
}
