//! What each cluster is like: oriented box, areas and attributes, each found from its faces.
//!
//! The box's z is the area-averaged normal; x and y come from rotating callipers on the projected outline, of which
//! large clusters keep the extreme points along 26 directions. Extents and projected areas are exact at all levels, so
//! bounds are bounds.                                                                    [Gobbetti2003 3.1]

use super::forest::Forest;
use super::self_transfer::{self, SelfTransfer};
use super::{INDEX_BITS, MeshFaces};
use crate::gpu::shaders::types::FaceCluster;
use crate::scene::calipers;
use glam::{DVec3, Mat3, Quat, Vec2, Vec3};
use rayon::prelude::*;

/// Points of an outline before it is thinned.
const OUTLINE: usize = 64;
/// Faces from which on a subtree is worth a task of its own.
const TASK_FACES: u32 = 2048;
/// How much boxes are grown against rounding.
const GROWTH: f32 = 1.0 + 1e-5;

/// A face with what it contributes.
pub(super) struct Face {
    pub corners: [Vec3; 3],
    /// A n.
    pub normal: Vec3,
    pub area: f32,
    albedo: Vec3,
    reflectance: Vec3,
    emission: Vec3,
}

/// Every cluster of `forest`, in its order.
pub fn measure(mesh: &MeshFaces<'_>, forest: &Forest) -> Vec<FaceCluster> {
    let face = |&f: &u32| {
        let corners = mesh.triangles[f as usize].map(|v| mesh.positions[v as usize]);
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a) * 0.5;
        Face {
            corners,
            normal: normal.as_vec3(),
            area: normal.length() as f32,
            albedo: mesh.albedo[f as usize],
            reflectance: mesh.reflectance[f as usize],
            emission: mesh.emission[f as usize],
        }
    };
    let faces: Vec<Face> = forest.faces.par_iter().map(face).collect();
    let mut clusters = vec![bytemuck::Zeroable::zeroed(); forest.counts.len()];
    measure_subtree(forest, &faces, 0, 0, &mut clusters);
    clusters
}

/// Measures the cluster at `first` and all below it, into `out`; returns points whose hull is that of its faces, nearly,
/// its normal, and what it sends itself.
fn measure_subtree(
    forest: &Forest,
    faces: &[Face],
    first: usize,
    first_face: u32,
    out: &mut [FaceCluster],
) -> (Vec<Vec3>, Vec3, SelfTransfer) {
    let count = forest.counts[first];
    let own = &faces[first_face as usize..(first_face + count) as usize];
    let (outline, fallback, kept) = if count == 1 {
        (own[0].corners.to_vec(), Vec3::Y, [0.0; 2])
    } else {
        let left_count = forest.counts[first + 1];
        let right = 2 * left_count as usize;
        let (left_out, right_out) = out[1..].split_at_mut(right - 1);
        let mut left = || measure_subtree(forest, faces, first + 1, first_face, left_out);
        let mut right = || measure_subtree(forest, faces, first + right, first_face + left_count, right_out);
        let ((mut outline, normal, of_left), (others, _, of_right)) =
            if count > TASK_FACES { rayon::join(left, right) } else { (left(), right()) };
        outline.extend(others);
        let (left, right) = own.split_at(left_count as usize);
        let between = self_transfer::between(left, right);
        (thin(outline), normal, [0, 1].map(|k| of_left[k] + of_right[k] + 2.0 * between[k]))
    };
    out[0] = cluster(own, &outline, fallback, first_face);
    let turned = out[0].area - super::normal_projected_area(&out[0]);
    let [front, back] = kept.map(|power| self_level(power, turned));
    // No front of a convex cluster sees another, whatever rounding says; of others, some does.
    let front = if forest.convex[first] { 0 } else { front.max(1) };
    out[0].face_count |= front << INDEX_BITS;
    out[0].first_face |= back << INDEX_BITS;
    let normal = super::axes(&out[0]).z_axis;
    (outline, normal, kept)
}

/// `power` of `turned` (both m2), which it may not exceed, in steps of half a power of two; 0 is none.
fn self_level(power: f32, turned: f32) -> u32 {
    if power <= 0.0 || turned <= 0.0 {
        0
    } else {
        (15.0 + 2.0 * (power / turned).log2()).round().clamp(0.0, 15.0) as u32
    }
}

/// At most 26 of many points: the extreme ones.
fn thin(points: Vec<Vec3>) -> Vec<Vec3> {
    if points.len() <= OUTLINE {
        return points;
    }
    let mut kept: Vec<usize> = Vec::with_capacity(26);
    for x in -1..=1 {
        for y in -1..=1 {
            for z in -1..=1 {
                let axis = Vec3::new(x as f32, y as f32, z as f32);
                let farthest = (0..points.len()).max_by(|&a, &b| points[a].dot(axis).total_cmp(&points[b].dot(axis)));
                kept.extend(farthest.filter(|_| axis != Vec3::ZERO));
            }
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|k| points[k]).collect()
}

fn cluster(faces: &[Face], outline: &[Vec3], fallback: Vec3, first_face: u32) -> FaceCluster {
    let (mut area, mut normal) = (0.0f64, DVec3::ZERO);
    let (mut albedo, mut emission) = (DVec3::ZERO, DVec3::ZERO);
    let (mut albedo_range, mut emission_range) = ([Vec3::MAX, Vec3::ZERO], [Vec3::MAX, Vec3::ZERO]);
    for face in faces {
        let a = f64::from(face.area);
        area += a;
        normal += face.normal.as_dvec3();
        albedo += face.albedo.as_dvec3() * a;
        emission += face.emission.as_dvec3() * a;
        albedo_range = [albedo_range[0].min(face.albedo), albedo_range[1].max(face.reflectance)];
        emission_range = [emission_range[0].min(face.emission), emission_range[1].max(face.emission)];
    }
    let mean = |sum: DVec3, range: [Vec3; 2]| if area > 0.0 { (sum / area).as_vec3() } else { range[1] };
    let axes = box_axes(if normal.length() > 1e-7 * area { normal.normalize().as_vec3() } else { fallback }, outline);

    let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
    let mut facing = [0.0f64; 6];
    for face in faces {
        for corner in face.corners {
            let p = axes.transpose() * corner;
            (low, high) = (low.min(p), high.max(p));
        }
        let n = axes.transpose() * face.normal;
        for k in 0..3 {
            facing[2 * k] += f64::from(n[k].max(0.0));
            facing[2 * k + 1] += f64::from((-n[k]).max(0.0));
        }
    }
    let center = axes * ((low + high) * 0.5);
    let rounding = center.abs().max_element() * 1e-6;
    FaceCluster {
        center,
        rotation: Quat::from_mat3(&axes).to_array(),
        half_extent: (high - low) * 0.5 * GROWTH + rounding,
        area: area as f32,
        facing: facing.map(|sum| sum as f32),
        albedo: [albedo_range[0], mean(albedo, albedo_range), albedo_range[1]].map(encode_color),
        emission: mean(emission, emission_range),
        emission_range: emission_range.map(encode_color),
        first_face,
        face_count: faces.len() as u32,
    }
}

/// x, y by callipers around z. The quaternion's own axes, so that what is stored is what was measured.
fn box_axes(z: Vec3, outline: &[Vec3]) -> Mat3 {
    let (s, t) = z.any_orthonormal_pair();
    let mut projected: Vec<Vec2> = outline.iter().map(|p| Vec2::new(p.dot(s), p.dot(t))).collect();
    let along = calipers::direction(&mut projected);
    let x = (s * along.x + t * along.y).normalize();
    let mut y = z.cross(x);
    let mut x = x;
    // The longer side is x.
    let extent = |axis: Vec3| {
        let (low, high) =
            outline.iter().fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(p.dot(axis)), high.max(p.dot(axis))));
        high - low
    };
    if extent(y) > extent(x) {
        (x, y) = (y, -x);
    }
    Mat3::from_quat(Quat::from_mat3(&Mat3::from_cols(x, y, z)).normalize())
}

/// `encode_32` of `lib/shared_exponent.glsl`.
pub fn encode_color(color: Vec3) -> u32 {
    // NaN counts as black.
    let largest = color.max_element().clamp(0.0, 3e38);
    if largest.is_nan() || largest <= 1e-30 {
        return 1;
    }
    let exponent = (largest.to_bits() >> 23) as i32 - 126;
    let scale = 2f64.powi(8 - exponent);
    let mantissa = color.to_array().map(|c| ((f64::from(c.min(3e38)) * scale + 0.5) as u32).min(255));
    mantissa[0] << 24 | mantissa[1] << 16 | mantissa[2] << 8 | (exponent - 8 + 127).clamp(1, 255) as u32
}

/// `decode_32` of `lib/shared_exponent.glsl`.
pub fn decode_color(word: u32) -> Vec3 {
    f32::from_bits((word & 0xff) << 23)
        * Vec3::new((word >> 24) as f32, (word >> 16 & 0xff) as f32, (word >> 8 & 0xff) as f32)
}
