//! A scene with elements that twins grew in it, for kernels to run on; and comparisons that are shown to fail.

use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::fixture::Fixture;
use crate::twins::{self, NONE, Tables, Vectors};
use glam::{Mat3, Vec3};
use linklight::gpu::Buffer;
use linklight::gpu::shaders::types::{FaceElement, PairCounters, PoolCounters};
use linklight::methods::face_cluster::rules::Rule;
use linklight::methods::face_cluster::{FaceClusters, Placement, Settings};
use linklight::scene::{Light, LightKind, Primitive};

pub const RECEIVER: Rule = Rule::Seven;
pub const SHOOTER: Rule = Rule::Six;
pub const FUNCTIONS: usize = 6;
pub const RADIOSITY_FUNCTIONS: usize = 3;

/// A scene with its clusters on the host, and elements that twins grew in it.
pub struct Grown {
    pub context: TestContext,
    pub fixture: Fixture,
    pub method: FaceClusters,
    pub tables: Tables,
    pub elements: Vec<FaceElement>,
    pub nodes: Vec<Vec<Vec3>>,
    pub normals: Vec<Vec<Vec3>>,
    /// Per element and node: it is no matter of rounding.
    pub is_clear: Vec<Vec<bool>>,
    /// Per element: of each function and receiver node, then of each shooter node.
    pub fits: Vec<f32>,
    /// Per element and function.
    pub means: Vec<f32>,
}

/// A floor, a wavy sheet with two sides above it, a board between them, a closed post that stands in the floor, and
/// three lamps.
pub fn grown(count: usize) -> Grown {
    grown_in(count, [0.2, 3.0], Some(closed_box(Vec3::new(-0.8, -0.1, -0.7), Vec3::new(-0.35, 0.3, 0.1), 4, 0)))
}

/// With waves so high and so many radians a metre, and without the post.
pub fn grown_over(count: usize, waves: [f32; 2]) -> Grown {
    grown_in(count, waves, None)
}

fn grown_in(count: usize, [height, waves]: [f32; 2], post: Option<Primitive>) -> Grown {
    let context = TestContext::new();
    let mut sheet = parallelogram(Vec3::new(-1.0, 1.2, 1.0), Vec3::X * 2.0, Vec3::NEG_Z * 2.0, 10, 1);
    sheet.positions.iter_mut().for_each(|p| p.y += height * (waves * p.x).sin() * (2.0 * p.z).cos());
    let floor = parallelogram(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::NEG_Z * 2.0, 8, 0);
    let board = parallelogram(Vec3::new(-0.3, 0.4, 0.5), Vec3::X * 0.7, Vec3::NEG_Z * 0.9, 3, 2);
    let mut materials =
        vec![lambert(Vec3::new(0.6, 0.5, 0.4)), lambert(Vec3::new(0.2, 0.7, 0.5)), lambert(Vec3::splat(0.3))];
    materials[0].double_sided = false;
    materials[2].emission = Vec3::new(2.0, 1.0, 0.5);
    let lamps = [
        (light(LightKind::Point, 3.0), Vec3::new(0.2, 0.7, -0.1), Vec3::NEG_Y),
        (light(LightKind::Directional, 2.0), Vec3::ZERO, Vec3::new(0.3, -1.0, 0.2)),
        (
            Light { range: Some(1.5), ..light(LightKind::Spot { inner_angle: 0.3, outer_angle: 1.0 }, 4.0) },
            Vec3::new(-0.5, 0.8, 0.3),
            Vec3::new(0.4, -1.0, -0.2),
        ),
    ];
    let fixture =
        Fixture::new(&context, scene(materials, [floor, sheet, board].into_iter().chain(post).collect(), &lamps), None);
    let settings = Settings { receiver_rule: RECEIVER, shooter_rule: SHOOTER, ..Settings::default() };
    let method = FaceClusters::prepare(&context, &fixture.stage(), settings).unwrap();
    let p: &Placement = method.placement();
    let rules = [RECEIVER.nodes(), SHOOTER.nodes(), RECEIVER.triangle_nodes(), SHOOTER.triangle_nodes()].concat();
    let solids = context.download(&p.solids).unwrap();
    let [low, high] = fixture.bounds;
    let tables = Tables {
        clusters: context.download(&p.clusters).unwrap(),
        skips: context.download(&p.skips).unwrap(),
        instances: context.download(&p.instances).unwrap(),
        faces: context.download(&p.faces).unwrap(),
        places: context.download(&p.places).unwrap(),
        triangles: fixture.geometry.triangles.clone(),
        positions: fixture.positions.clone(),
        rules,
        receiver_nodes: RECEIVER.nodes().len(),
        is_solid: (0..fixture.geometry.triangles.len()).map(|t| solids[t / 32] >> (t % 32) & 1 != 0).collect(),
        ray_offset: 1e-5 * (high - low).length(),
    };
    let roots = tables.instances.len() as u32;
    let mut elements: Vec<FaceElement> =
        (0..roots).map(|i| twins::element(&tables, i, tables.instances[i as usize].first_cluster, NONE, 0)).collect();
    while elements.len() < count {
        let can = |e: &FaceElement| e.children == NONE && tables.children(e.cluster).is_some();
        let widest = (0..elements.len()).filter(|&e| can(&elements[e]));
        let widest = widest.max_by(|&a, &b| elements[a].area.total_cmp(&elements[b].area).then(b.cmp(&a))).unwrap();
        let parent = elements[widest];
        elements[widest].children = elements.len() as u32;
        for cluster in tables.children(parent.cluster).unwrap() {
            elements.push(twins::element(&tables, parent.instance, cluster, widest as u32, parent.level + 1));
        }
    }
    let laid: Vec<twins::Nodes> = elements.iter().map(|e| twins::nodes(&tables, e)).collect();
    elements.iter_mut().zip(&laid).for_each(|(e, laid)| *e = twins::exposed(*e, laid));
    let (mut fits, mut means) = (Vec::new(), Vec::new());
    for (e, laid) in elements.iter().zip(&laid) {
        let (rows, of_functions) = twins::fit(&tables, e, &laid.places, FUNCTIONS);
        fits.extend(rows.iter().flatten().chain(&twins::weights(&tables, e, &laid.places)).map(|&v| v as f32));
        means.extend(of_functions.iter().map(|&v| v as f32));
    }
    let is_clear = laid.iter().map(|laid| laid.is_clear.clone()).collect();
    let normals = laid.iter().map(|laid| laid.normals.clone()).collect();
    let nodes = laid.into_iter().map(|laid| laid.places).collect();
    Grown { context, fixture, method, tables, elements, nodes, normals, is_clear, fits, means }
}

/// Six sides of `cells` x `cells` squares, welded, wound outwards.
pub fn closed_box(low: Vec3, high: Vec3, cells: u32, material: u32) -> Primitive {
    let size = high - low;
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    let sides = [(low, z, y), (low + x, y, z), (low, x, z), (low + y, z, x), (low, y, x), (low + z, x, y)];
    let mut all = parallelogram(low, z, y, cells, material);
    for (corner, u, v) in &sides[1..] {
        let side = parallelogram(*corner, *u, *v, cells, material);
        let first = all.positions.len() as u32;
        all.triangles.extend(side.triangles.iter().map(|t| t.map(|v| v + first)));
        all.positions.extend(side.positions);
        all.normals.extend(side.normals);
        all.tangents.extend(side.tangents);
        all.colors.extend(side.colors);
        all.uv.iter_mut().zip(side.uv).for_each(|(all, side)| all.extend(side));
    }
    all
}

impl Grown {
    pub fn table<T: bytemuck::Pod>(&self, values: &[T]) -> Buffer<T> {
        self.context.upload("test/table", values).unwrap()
    }

    pub fn read<T: bytemuck::Pod>(&self, buffer: &Buffer<T>) -> Vec<T> {
        self.context.download(buffer).unwrap()
    }

    /// Those of the nodes, each as whole 127ths.
    fn bytes_of_normals(&self) -> impl Iterator<Item = Vec<Vec3>> {
        let bytes = |n: &Vec3| (n.clamp(Vec3::NEG_ONE, Vec3::ONE) * 127.0).round();
        self.normals.iter().map(move |of_element| of_element.iter().map(bytes).collect())
    }

    /// As kernels store them: a signed byte an axis.
    pub fn packed_normals(&self) -> Vec<u32> {
        let byte = |v: f32| v as i32 as u32 & 0xff;
        self.bytes_of_normals().flatten().map(|n| byte(n.x) | byte(n.y) << 8 | byte(n.z) << 16).collect()
    }

    /// As kernels read them.
    pub fn read_normals(&self) -> Vec<Vec<Vec3>> {
        self.bytes_of_normals().map(|of_element| of_element.iter().map(|n| n / 127.0).collect()).collect()
    }

    pub fn pool(&self, element_count: usize, made_count: usize) -> Buffer<PoolCounters> {
        let (element_count, made_count) = (element_count as u32, made_count as u32);
        self.table(&[PoolCounters { element_count, made_count, ..bytemuck::Zeroable::zeroed() }])
    }

    pub fn counters(&self, taken: usize) -> Buffer<PairCounters> {
        self.table(&[PairCounters { taken: taken as u32, ..bytemuck::Zeroable::zeroed() }])
    }

    pub fn leaves(&self) -> Vec<usize> {
        (0..self.elements.len()).filter(|&e| self.elements[e].children == NONE).collect()
    }

    pub fn deepest(&self) -> u32 {
        self.elements.iter().map(|e| e.level).max().unwrap()
    }
}

/// The first place where `found` is farther from `expected` than `tolerance` of the largest magnitude expected.
pub fn difference(found: &[f32], expected: &[f64], tolerance: f64) -> Option<String> {
    let scale = expected.iter().fold(1e-12, |most: f64, v| most.max(v.abs()));
    if found.len() != expected.len() {
        return Some(format!("{} values, expected {}", found.len(), expected.len()));
    }
    let wrong = |(_, (f, e)): &(usize, (&f32, &f64))| {
        let off = (f64::from(**f) - **e).abs();
        off.is_nan() || off > tolerance * scale
    };
    let (at, (f, e)) = found.iter().zip(expected).enumerate().find(wrong)?;
    Some(format!("value {at} is {f}, expected {e} (of {scale})"))
}

/// Equal, and noticed if one value were wrong.
pub fn check(what: &str, found: &[f32], expected: &[f64], tolerance: f64) {
    assert_eq!(difference(found, expected, tolerance), None, "{what}");
    let largest = (0..expected.len()).max_by(|&a, &b| expected[a].abs().total_cmp(&expected[b].abs())).unwrap();
    let mut wrong = expected.to_vec();
    wrong[largest] *= 1.0 + 10.0 * tolerance;
    assert!(difference(found, &wrong, tolerance).is_some(), "{what}: a wrong value is not noticed");
}

pub fn random_vectors(random: &mut Random, count: usize) -> Vec<Mat3> {
    let mut v = || Vec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5) * 4.0;
    (0..count).map(|_| Mat3::from_cols(v(), v(), v())).collect()
}

pub fn vectors(m: &Mat3) -> Vectors {
    [m.x_axis, m.y_axis, m.z_axis].map(|c| c.as_dvec3())
}

pub fn flat(of: &[Vectors]) -> Vec<f64> {
    of.iter().flat_map(|v| v.iter().flat_map(|c| c.to_array())).collect()
}

pub fn as_words(values: &[Mat3]) -> Vec<[[f32; 3]; 3]> {
    values.iter().map(Mat3::to_cols_array_2d).collect()
}
