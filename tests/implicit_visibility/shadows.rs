//! Which points on emitters elements see by their bins: against a plain twin, and against rays.

use crate::common::TestContext;
use crate::common::scenes::{lambert, one_sided_box, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene, winners};
use crate::twins;
use glam::{Quat, Vec3};
use linklight::gpu::shaders::methods::implicit_visibility as passes;
use linklight::gpu::shaders::types::{EmitterSample, Ray, Receiver};
use linklight::methods::implicit_visibility::{ImplicitVisibility, Settings, bins};
use linklight::scene::{Material, Scene};
use linklight::stages::elements::BACK_SIDE;
use linklight::stages::emitters::EmitterChoice;
use linklight::stages::trace::{self, Tracer};

/// A point on an emitter as the elements look for it.
struct Point {
    position: Vec3,
    normal: Vec3,
    area: f32,
    is_double_sided: bool,
    vertex: u32,
}

impl Point {
    fn new(fixture: &Fixture, sample: &EmitterSample) -> Self {
        let corners = fixture.geometry.triangles[sample.triangle as usize];
        let [a, b, c] = corners.map(|v| fixture.rest_positions[v as usize]);
        let across = (b - a).cross(c - a);
        let [q, r] = sample.barycentrics.to_array();
        let nearest = if 1.0 - q - r >= q.max(r) { 0 } else { 1 + usize::from(r > q) };
        Self {
            position: a + q * (b - a) + r * (c - a),
            normal: across.normalize(),
            area: 0.5 * across.length() * sample.share,
            is_double_sided: sample.is_double_sided != 0,
            vertex: corners[nearest],
        }
    }

    /// Cosines, area and distance: what the point sends to the receiver where nothing hides it.
    fn weight(&self, at: &Receiver) -> f64 {
        let offset = self.position - at.origin;
        let (above, away) = (offset.dot(at.normal).max(0.0), -offset.dot(self.normal));
        let away = if self.is_double_sided { away.abs() } else { away.max(0.0) };
        f64::from(above * away * self.area / offset.length_squared().powi(2))
    }

    /// Where ways to it end: on the side that is seen.
    fn end(&self, at: &Receiver, ray_offset: f32) -> Vec3 {
        let side = if self.normal.dot(self.position - at.origin) > 0.0 { -1.0 } else { 1.0 };
        self.position + self.normal * (side * ray_offset)
    }
}

/// The winners of the four bins around a direction.
pub fn winners_around(row: &[u32], direction: Vec3, n: u32) -> Vec<u32> {
    let axis = direction.abs().max_position();
    let across = [direction[(axis + 1) % 3], direction[(axis + 2) % 3]].map(|c| c / direction[axis].abs());
    let face = 2 * axis as u32 + u32::from(direction[axis] < 0.0);
    let low = across.map(|c| ((0.5 * c + 0.5) * n as f32 - 0.5).floor());
    let winner = |corner: u32| {
        let uv =
            [low[0] + (corner & 1) as f32, low[1] + (corner >> 1) as f32].map(|k| (2.0 * k + 1.0) / n as f32 - 1.0);
        row[bins::bin_of(bins::face_direction(face, uv[0].into(), uv[1].into()).as_vec3(), n) as usize]
    };
    (0..4).map(winner).filter(|&winner| winner != twins::EMPTY).map(|winner| winner & !twins::BACK).collect()
}

/// What the elements and the emitters of a method see.
pub struct Seen<'a> {
    method: &'a ImplicitVisibility,
    pub rows: Vec<Vec<u32>>,
    pub receivers: Vec<Receiver>,
    points: Vec<Point>,
    visible: Vec<u32>,
    /// The triangles around each vertex.
    around: Vec<Vec<[Vec3; 3]>>,
}

impl<'a> Seen<'a> {
    pub fn new(context: &TestContext, fixture: &Fixture, method: &'a ImplicitVisibility) -> Self {
        let samples = context.download(&method.emitters().samples).unwrap();
        let mut around = vec![Vec::new(); fixture.rest_positions.len()];
        for triangle in &fixture.geometry.triangles {
            let corners = triangle.map(|v| fixture.rest_positions[v as usize]);
            triangle.iter().for_each(|&v| around[v as usize].push(corners));
        }
        Self {
            around,
            method,
            rows: winners(context, method),
            receivers: context.download(&method.linking().receivers).unwrap(),
            points: samples.iter().map(|sample| Point::new(fixture, sample)).collect(),
            visible: context.download(&method.emitters().visible).unwrap(),
        }
    }

    fn is_visible(&self, leaf: usize, k: usize) -> bool {
        let element = self.method.trees().topology.leaf_elements[leaf] as usize;
        self.visible[element * self.points.len().div_ceil(32) + k / 32] >> (k % 32) & 1 != 0
    }

    /// The leaf of a side of a vertex.
    fn leaf_of(&self, entry: u32) -> Option<usize> {
        let vertices = &self.method.elements().topology.vertices;
        self.method.trees().topology.leaf_elements.iter().position(|&element| vertices[element as usize] == entry)
    }

    /// Whether what lies around one of the nodes, below the node so many levels above it, crosses the way.
    pub fn is_crossed(&self, nodes: &[u32], levels: u32, origin: Vec3, way: Vec3) -> bool {
        let trees = &self.method.trees().topology;
        let topology = &self.method.elements().topology;
        nodes.iter().any(|&node| {
            let above = (0..levels).fold(node, |node, _| trees.parent(node).unwrap_or(node));
            trees.leaves(above).any(|leaf| {
                let vertex = topology.vertices[trees.leaf_elements[leaf as usize] as usize] & !BACK_SIDE;
                self.around[vertex as usize].iter().any(|&[a, b, c]| {
                    // [Moller1997]
                    let (p, q) = (b - a, c - a);
                    let (across, from) = (way.cross(q), origin - a);
                    let det = p.dot(across);
                    let (x, y) = (from.dot(across) / det, way.dot(from.cross(p)) / det);
                    let t = q.dot(from.cross(p)) / det;
                    x >= 0.0 && y >= 0.0 && x + y <= 1.0 && t > 0.0 && t < 1.0
                })
            })
        })
    }
}

/// A ball above a floor, below a lamp in a shade: what is bent, as far off as bins are coarse, and what stands so close to
/// the lamp that only the lamp's own bins know it.
fn ball_and_lamp() -> Scene {
    let matte = Material { double_sided: false, ..lambert(Vec3::splat(0.5)) };
    let lamp = Material { emission: Vec3::splat(10.0), ..matte.clone() };
    let mut parts = one_sided_box(Vec3::NEG_ONE, Vec3::ONE, 6);
    for part in &mut parts {
        for (position, normal) in part.positions.iter_mut().zip(&mut part.normals) {
            *normal = position.normalize();
            *position = Vec3::Y + 0.5 * *normal;
        }
    }
    parts.push(parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 16, 0));
    parts.push(parallelogram(Vec3::new(-0.3, 3.0, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, 3, 1));
    for side in 0..4 {
        let turn = Quat::from_rotation_y(side as f32 * std::f32::consts::FRAC_PI_2);
        let from = Vec3::Y * 3.0 + turn * Vec3::new(-0.32, 0.0, 0.32);
        parts.push(parallelogram(from, turn * Vec3::X * 0.64, Vec3::NEG_Y * 0.2, 3, 0));
    }
    scene(vec![matte, lamp], parts, &[])
}

fn settings(bins: u32, emitter_samples: u32) -> Settings {
    Settings { bins, emitters: EmitterChoice::Sampled, emitter_samples, ..Settings::default() }
}

/// Twin of `see_emitters`.
#[test]
fn emitters_are_hidden_by_the_surfaces_of_winners() {
    let context = TestContext::new();
    let cornell = Fixture::new(&context, builtin_scene("cornell-box"), Some(1.4));
    let (mut visible, mut hidden, mut differing, mut alone) = (0, 0, 0, [0; 2]);
    for (fixture, samples) in [(cornell, 40), (Fixture::new(&context, ball_and_lamp(), None), 24)] {
        let method = fixture.linked(&context, settings(6, samples));
        let seen = Seen::new(&context, &fixture, &method);
        let frame = |leaf: usize| Quat::from_array(seen.receivers[leaf].frame).inverse();
        let sides: Vec<[usize; 2]> = (seen.points.iter())
            .map(|point| {
                let front = seen.leaf_of(point.vertex).unwrap();
                [front, seen.leaf_of(point.vertex | BACK_SIDE).unwrap_or(front)]
            })
            .collect();
        for (leaf, at) in seen.receivers.iter().enumerate().step_by(3) {
            for (k, point) in seen.points.iter().enumerate() {
                if point.weight(at) <= 0.0 {
                    assert!(!seen.is_visible(leaf, k), "leaf {leaf} sees point {k}, which looks away");
                    continue;
                }
                let way = point.end(at, method.elements().ray_offset) - at.origin;
                let own = winners_around(&seen.rows[leaf], frame(leaf) * way, 6);
                let emitter = sides[k][usize::from(point.normal.dot(way) > 0.0)];
                let back = winners_around(&seen.rows[emitter], frame(emitter) * -way, 6);
                let reasons = [own, back].map(|nodes| seen.is_crossed(&nodes, 2, at.origin, way));
                alone[0] += usize::from(reasons == [true, false]);
                alone[1] += usize::from(reasons == [false, true]);
                let is_visible = seen.is_visible(leaf, k);
                *(if is_visible { &mut visible } else { &mut hidden }) += 1;
                differing += usize::from(is_visible != (reasons == [false, false]));
            }
        }
    }
    println!("{visible} visible, {hidden} hidden, {differing} differ; by one's bins alone {alone:?}");
    // Rims that rounding decides. Each side's bins matter.
    assert!(differing * 500 < visible + hidden && visible > 1000 && hidden > 500);
    assert!(alone.iter().all(|&count| count > 20), "{alone:?}");
}

/// What is hidden is: no light is lost. What is not known to hide lets through the less light the more bins there are.
#[test]
fn more_bins_see_as_rays_do() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, ball_and_lamp(), None);
    let mut free: Vec<u32> = Vec::new();
    let figures = [2, 4, 8].map(|n| {
        let method = fixture.linked(&context, settings(n, 32));
        let seen = Seen::new(&context, &fixture, &method);
        if free.is_empty() {
            let ray_offset = method.elements().ray_offset;
            let ray = |(at, point): (&Receiver, &Point)| {
                let direction = point.end(at, ray_offset) - at.origin;
                Ray { origin: at.origin, t_min: 0.0, direction, t_max: 1.0 }
            };
            let pairs = seen.receivers.iter().flat_map(|at| seen.points.iter().map(move |point| (at, point)));
            let rays: Vec<Ray> = pairs.map(ray).collect();
            let buffer = context.upload("rays", &rays).unwrap();
            let answers = context.buffer::<u32>("free", rays.len()).unwrap();
            let mut recorder = context.recorder("test").unwrap();
            trace::any_hit(
                &mut recorder,
                &Tracer::compute(&fixture.bvh, &fixture.world),
                &buffer,
                &answers,
                rays.len(),
            );
            recorder.submit().unwrap();
            free = context.download(&answers).unwrap();
        }
        let (mut all, mut lost, mut leaked) = (0.0, 0.0, 0.0);
        let (mut squares, mut error) = (0.0, 0.0);
        for (leaf, at) in seen.receivers.iter().enumerate() {
            let (mut found, mut expected) = (0.0, 0.0);
            for (k, point) in seen.points.iter().enumerate() {
                let (weight, is_free) = (point.weight(at), free[leaf * seen.points.len() + k] != 0);
                let is_visible = seen.is_visible(leaf, k);
                all += if is_free { weight } else { 0.0 };
                lost += if is_free && !is_visible { weight } else { 0.0 };
                leaked += if !is_free && is_visible { weight } else { 0.0 };
                found += if is_visible { weight } else { 0.0 };
                expected += if is_free { weight } else { 0.0 };
            }
            squares += expected * expected;
            error += (found - expected) * (found - expected);
        }
        let [lost, leaked, error] = [lost / all, leaked / all, error / squares];
        println!("N = {n}: lost {lost:.1e}, leaked {leaked:.1e}, relative MSE {error:.1e}");
        assert!(lost < 1e-4, "N = {n}: {lost}");
        [leaked, error]
    });
    for pair in figures.windows(2) {
        assert!(pair[1][0] < 0.7 * pair[0][0] && pair[1][1] < 0.7 * pair[0][1], "{figures:?}");
    }
}

/// Twin of `emitter_points`.
#[test]
fn points_on_emitters_lie_in_the_bundles_of_their_words() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, ball_and_lamp(), None);
    let method = fixture.linked(&context, settings(4, 45));
    let seen = Seen::new(&context, &fixture, &method);
    let (points, bundles) = (context.buffer("points", 45).unwrap(), context.buffer("bundles", 2).unwrap());
    let pass = passes::EmitterPoints {
        samples: &method.emitters().samples,
        triangles: &fixture.world.triangles,
        positions: &fixture.world.positions,
        points: &points,
        bundles: &bundles,
        params: passes::EmitterPointsParams { sample_count: 45, ray_offset: 0.01 },
    };
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(&pass, 2u32);
    recorder.submit().unwrap();
    let (points, bundles) = (context.download(&points).unwrap(), context.download(&bundles).unwrap());
    let boxes: Vec<[Vec3; 2]> = bundles.iter().map(|b| [b.middle - b.half_size, b.middle + b.half_size]).collect();
    let mut tight = [[Vec3::INFINITY, Vec3::NEG_INFINITY]; 2];
    for (k, (found, expected)) in points.iter().zip(&seen.points).enumerate() {
        assert!(found.position.distance(expected.position) < 1e-5 && found.normal.distance(expected.normal) < 1e-5);
        assert_eq!(found.is_double_sided != 0, expected.is_double_sided);
        let ends =
            [0.01, if expected.is_double_sided { -0.01 } else { 0.01 }].map(|off| found.position + off * found.normal);
        for (least, most, end) in ends.map(|end| (boxes[k / 32][0], boxes[k / 32][1], end)) {
            assert!(end.cmpge(least - 1e-6).all() && end.cmple(most + 1e-6).all(), "{end} outside {least} to {most}");
        }
        tight[k / 32] = [tight[k / 32][0].min(ends[0].min(ends[1])), tight[k / 32][1].max(ends[0].max(ends[1]))];
    }
    for (found, expected) in boxes.iter().zip(&tight) {
        assert!(found[0].distance(expected[0]) + found[1].distance(expected[1]) < 1e-5, "{found:?} for {expected:?}");
    }
}
