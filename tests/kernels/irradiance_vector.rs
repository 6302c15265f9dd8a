//! `irradiance_vector/elements` against a plain sum over triangles.

use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use glam::{Mat3, UVec2, UVec3, Vec3};
use linklight::gpu::Context;
use linklight::gpu::shaders::irradiance_vector::{Elements, ElementsConstants, ElementsParams};
use linklight::gpu::shaders::types::{LeafElement, SharedVectors};

const BACK: u32 = 1 << 31;
const NO_LEAF: u32 = u32::MAX;
pub const FUNCTIONS: usize = 3;
pub const UNIT: f32 = 0.25;
pub const REACH: f32 = 0.8;
/// Some tens of products; vectors are kept exactly.
const TOLERANCE: Tolerance = Tolerance { absolute: 1e-5, relative: 1e-5 };

/// With the exponent of 16, of which all multiples of 1/32 are exact.
pub fn packed(m: &Mat3) -> SharedVectors {
    let exponent = 4 + 48u32;
    let mantissa = |value: f32| {
        assert!(value.abs() < 16.0 && (32.0 * value).fract() == 0.0, "{value} is not exact");
        (32.0 * value) as i32 as u32 & 0x3ff
    };
    let columns = m.to_cols_array_2d();
    let word = |c: usize| {
        let [x, y, z] = columns[c].map(mantissa);
        x | y << 10 | z << 20 | (exponent >> (2 * c) & 3) << 30
    };
    SharedVectors { words: [word(0), word(1), word(2)] }
}

/// Leaves, and those beside each: what light is on them, in units of [`UNIT`] and [`FUNCTIONS`] a leaf.
pub struct Leaves {
    pub shapes: Vec<LeafElement>,
    pub rows: Vec<Vec<u32>>,
}

impl Leaves {
    /// Of one leaf alone, and how much it counts.
    fn of_leaf(&self, vectors: &[Mat3], leaf: usize, point: Vec3) -> (Mat3, f32) {
        let shape = &self.shapes[leaf];
        let axes = [shape.axis_x, shape.axis_y, shape.axis_x.cross(shape.axis_y)];
        let offset = Vec3::from(axes.map(|axis| (point - shape.center).dot(axis)));
        let s = (offset / shape.half_extent).clamp(Vec3::NEG_ONE, Vec3::ONE) * 3.0f32.sqrt();
        let functions = &vectors[leaf * FUNCTIONS..][..FUNCTIONS];
        let over = (offset.abs() - shape.half_extent).max_element();
        let share = (1.0 - over / (REACH * shape.half_extent.truncate().min_element())).clamp(0.0, 1.0);
        let area = 4.0 * shape.half_extent.x * shape.half_extent.y;
        (UNIT * (functions[0] + s.x * functions[1] + s.y * functions[2]), share / area)
    }

    /// The mean of the leaf and those beside it.
    pub fn light(&self, vectors: &[Mat3], leaf: usize, point: Vec3) -> Mat3 {
        let (own, weight) = self.of_leaf(vectors, leaf, point);
        let least = 1e-6 / self.shapes[leaf].half_extent.truncate().element_product();
        let mut sum = (own * weight.max(least), weight.max(least));
        for &other in &self.rows[leaf] {
            let (light, weight) = self.of_leaf(vectors, other as usize, point);
            sum = (sum.0 + light * weight, sum.1 + weight);
        }
        sum.0 * (1.0 / sum.1)
    }

    /// Where the rows start, and their number.
    pub fn row_starts(&self) -> Vec<u32> {
        (0..=self.rows.len()).map(|leaf| self.rows[..leaf].iter().map(Vec::len).sum::<usize>() as u32).collect()
    }
}

/// Two triangles of a double-sided sheet, and one whose front alone has a leaf.
struct Case {
    entries: Vec<u32>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<UVec3>,
    offsets: Vec<u32>,
    incident: Vec<u32>,
    leaves: Leaves,
    triangle_leaves: Vec<UVec2>,
    direct: Vec<Mat3>,
    indirect: Vec<Mat3>,
}

impl Case {
    fn new(random: &mut Random) -> Self {
        let vector = |random: &mut Random| Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
        let leaf = |random: &mut Random| {
            let axis_x = vector(random).normalize();
            let axis_y = axis_x.any_orthonormal_vector();
            LeafElement { center: vector(random), axis_x, axis_y, half_extent: Vec3::new(1.5, 0.75, 0.25) }
        };
        let eighths = |random: &mut Random| Vec3::from([0; 3].map(|_| random.below(17) as f32 / 8.0 - 1.0));
        let vectors = |random: &mut Random| Mat3::from_cols(eighths(random), eighths(random), eighths(random));
        Self {
            entries: vec![0, 1, 2, 3, 4, BACK, 1 | BACK, 4 | BACK],
            positions: (0..5).map(|_| vector(random)).collect(),
            normals: (0..5).map(|_| vector(random).normalize()).collect(),
            triangles: vec![UVec3::new(0, 1, 2), UVec3::new(2, 1, 3), UVec3::new(3, 1, 4)],
            offsets: vec![0, 1, 4, 6, 8, 9],
            incident: vec![0, 0, 1, 2, 0, 1, 1, 2, 2],
            leaves: Leaves {
                shapes: (0..4).map(|_| leaf(random)).collect(),
                rows: vec![vec![1, 3], vec![0], vec![], vec![2, 0, 1]],
            },
            triangle_leaves: vec![UVec2::new(0, 2), UVec2::new(1, 2), UVec2::new(3, NO_LEAF)],
            direct: (0..4 * FUNCTIONS).map(|_| vectors(random)).collect(),
            indirect: (0..4 * FUNCTIONS).map(|_| vectors(random)).collect(),
        }
    }

    fn twin(&self, vectors: &[Mat3]) -> Vec<Vec3> {
        let of_element = |&entry: &u32| {
            let (vertex, is_back) = ((entry & !BACK) as usize, entry & BACK != 0);
            let normal = if is_back { -self.normals[vertex] } else { self.normals[vertex] };
            let (mut sum, mut area_sum) = (Vec3::ZERO, 0.0);
            for &triangle in &self.incident[self.offsets[vertex] as usize..self.offsets[vertex + 1] as usize] {
                let sides = self.triangle_leaves[triangle as usize];
                let leaf = if is_back { sides.y } else { sides.x };
                if leaf == NO_LEAF {
                    continue;
                }
                let [a, b, c] = self.triangles[triangle as usize].to_array().map(|v| self.positions[v as usize]);
                let area = (b - a).cross(c - a).length();
                let light = self.leaves.light(vectors, leaf as usize, self.positions[vertex]);
                sum += area * (light.transpose() * normal).max(Vec3::ZERO);
                area_sum += area;
            }
            if area_sum > 0.0 { sum / area_sum } else { Vec3::ZERO }
        };
        self.entries.iter().map(of_element).collect()
    }

    fn on_device(&self, context: &Context) -> [Vec<Vec3>; 2] {
        let halves = |vectors: &[Mat3]| -> Vec<SharedVectors> { vectors.iter().map(packed).collect() };
        let out = [(); 2].map(|()| context.buffer("test/irradiance", self.entries.len()).unwrap());
        let pass = Elements {
            element_vertices: &context.upload("test/entries", &self.entries).unwrap(),
            positions: &context.upload("test/positions", &self.positions).unwrap(),
            normals: &context.upload("test/normals", &self.normals).unwrap(),
            triangles: &context.upload("test/triangles", &self.triangles).unwrap(),
            incident_offsets: &context.upload("test/offsets", &self.offsets).unwrap(),
            incident_triangles: &context.upload("test/incident", &self.incident).unwrap(),
            leaves: &context.upload("test/leaves", &self.leaves.shapes).unwrap(),
            triangle_leaves: &context.upload("test/triangle leaves", &self.triangle_leaves).unwrap(),
            direct_vectors: &context.upload("test/direct", &halves(&self.direct)).unwrap(),
            indirect_vectors: &context.upload("test/indirect", &halves(&self.indirect)).unwrap(),
            direct_irradiance: &out[0],
            indirect_irradiance: &out[1],
            neighbour_offsets: &context.upload("test/rows", &self.leaves.row_starts()).unwrap(),
            neighbours: &context.upload("test/neighbours", &self.leaves.rows.concat()).unwrap(),
            params: ElementsParams { element_count: self.entries.len() as u32, unit: UNIT, reach: REACH },
            constants: ElementsConstants { irradiance_functions: FUNCTIONS as u32 },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&pass, self.entries.len());
        recorder.submit().unwrap();
        out.map(|buffer| context.download(&buffer).unwrap())
    }
}

#[test]
fn irradiance_of_elements_agrees_with_its_twin() {
    let context = TestContext::new();
    let random = &mut Random(41);
    for _ in 0..8 {
        let case = Case::new(random);
        let [direct, indirect] = case.on_device(&context);
        let expected = case.twin(&case.direct);
        hold("direct", &direct, &expected, TOLERANCE);
        hold("indirect", &indirect, &case.twin(&case.indirect), TOLERANCE);
        tells_apart("the other vectors", &case.twin(&case.indirect), &expected, TOLERANCE);
        let alone = Case { leaves: Leaves { rows: vec![Vec::new(); 4], ..case.leaves }, ..case };
        tells_apart("without neighbours", &alone.twin(&alone.direct), &expected, TOLERANCE);
    }
    let words = packed(&Mat3::from_diagonal(Vec3::new(1.0, -0.125, 8.0))).words;
    assert_eq!(words, [32, 0x3fc << 10 | 1 << 30, 256 << 20 | 3 << 30]);
}
