//! Random meshes and elements for the kernels, and how results are compared.

use crate::common::Random;
use glam::{UVec3, Vec3};
use linklight::gpu::{Buffer, Context};
use linklight::scene::adjacency::{self, Rows};
use linklight::stages::elements::BACK_SIDE;

/// Element counts every kernel is tried with.
pub const COUNTS: [u32; 6] = [0, 1, 63, 64, 65, 257];

pub fn point(random: &mut Random) -> Vec3 {
    4.0 * Vec3::new(random.unit(), random.unit(), random.unit()) - 2.0
}

pub fn unit(random: &mut Random) -> Vec3 {
    loop {
        let at = point(random);
        if (0.1..=4.0).contains(&at.length_squared()) {
            return at.normalize();
        }
    }
}

pub fn points(random: &mut Random, count: u32) -> Vec<Vec3> {
    (0..count).map(|_| point(random)).collect()
}

/// A soup of triangles, and elements on either side of its vertices.
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub incident: Rows,
    /// As `Elements::vertices`, in any order.
    pub element_vertices: Vec<u32>,
    pub shadow_offsets: Vec<u32>,
}

impl Mesh {
    pub fn random(random: &mut Random, element_count: u32) -> Self {
        let vertex_count = element_count.max(3);
        let triangles: Vec<[u32; 3]> =
            (0..2 * vertex_count).map(|_| [(); 3].map(|()| random.below(vertex_count))).collect();
        let incident = adjacency::incident_triangles(vertex_count, &triangles);
        let element_vertices: Vec<u32> =
            (0..element_count).map(|e| e | if random.below(3) == 0 { BACK_SIDE } else { 0 }).collect();
        let mut shadow_offsets = vec![0];
        for &entry in &element_vertices {
            let incident = (incident.row(entry & !BACK_SIDE).len() as u32).min(8);
            shadow_offsets.push(shadow_offsets.last().unwrap() + 1 + 2 * incident);
        }
        Self {
            positions: points(random, vertex_count),
            normals: (0..vertex_count).map(|_| unit(random)).collect(),
            triangles,
            incident,
            element_vertices,
            shadow_offsets,
        }
    }

    pub fn device_triangles(&self, context: &Context) -> Buffer<UVec3> {
        let triangles: Vec<UVec3> = self.triangles.iter().map(|&t| t.into()).collect();
        context.upload("test/triangles", &triangles).unwrap()
    }
}

/// Random rows of element indices.
pub fn rows(random: &mut Random, count: u32) -> Rows {
    let mut rows = Rows { offsets: vec![0], values: vec![] };
    for _ in 0..count {
        rows.values.extend((0..random.below(9)).map(|_| random.below(count)));
        rows.offsets.push(rows.values.len() as u32);
    }
    rows
}

/// |a - b| <= absolute + relative |b|, in every component of every value.
pub fn assert_close(what: &str, device: &[Vec3], twin: &[Vec3], absolute: f32, relative: f32) {
    assert_eq!(device.len(), twin.len(), "{what}");
    for (i, (a, b)) in device.iter().zip(twin).enumerate() {
        let allowed = absolute + relative * b.abs();
        assert!((*a - *b).abs().cmple(allowed).all(), "{what}[{i}]: {a} on the device, {b} in the twin");
    }
}

#[test]
#[should_panic(expected = "on the device")]
fn the_comparison_sees_a_small_difference() {
    assert_close("values", &[Vec3::ONE, Vec3::new(1.0, 1.0, 1.00003)], &[Vec3::ONE; 2], 1e-6, 1e-5);
}

#[test]
#[should_panic(expected = "on the device")]
fn the_comparison_sees_a_number_that_is_none() {
    assert_close("values", &[Vec3::NAN], &[Vec3::ONE], 1e-6, 1e-5);
}
