//! Twins of the light sources of glsl/elements/.

use glam::Vec3;
use linklight::gpu::shaders::types::{EmitterSample, Light, Ray};
use linklight::scene::adjacency::Rows;
use linklight::stages::elements::BACK_SIDE;
use std::f32::consts::PI;

/// Irradiance facing the light, direction and distance to it.
pub fn light_irradiance(light: &Light, point: Vec3) -> (Vec3, Vec3, f32) {
    if light.kind == 2 {
        return (light.intensity, -light.direction, 1e30);
    }
    let offset = light.position - point;
    let squared = offset.dot(offset).max(1e-12);
    let distance = squared.sqrt();
    let to_light = offset / distance;
    let mut falloff = 1.0;
    if light.range > 0.0 {
        falloff = (1.0 - (distance / light.range).powi(4)).clamp(0.0, 1.0);
    }
    if light.kind == 1 {
        falloff *= (light.direction.dot(-to_light) * light.spot_scale + light.spot_offset).clamp(0.0, 1.0).powi(2);
    }
    (light.intensity * (falloff / squared), to_light, distance)
}

/// What the shadow rays of an element start from.
pub struct ShadowMesh<'a> {
    pub element_vertices: &'a [u32],
    pub element_normals: &'a [Vec3],
    pub ray_origins: &'a [Vec3],
    pub shadow_offsets: &'a [u32],
    pub positions: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    pub incident: &'a Rows,
}

pub fn punctual_rays(mesh: &ShadowMesh<'_>, light: &Light, first: u32, count: u32, ray_offset: f32) -> Vec<Ray> {
    let shadow_ray = |origin: Vec3, normal: Vec3| {
        let (_, to_light, distance) = light_irradiance(light, origin);
        let t_max = if normal.dot(to_light) > 0.0 { distance } else { -1.0 };
        Ray { origin, t_min: 0.0, direction: to_light, t_max }
    };
    let mut rays = Vec::new();
    for element in first as usize..(first + count) as usize {
        let normal = mesh.element_normals[element];
        rays.push(shadow_ray(mesh.ray_origins[element], normal));
        let entry = mesh.element_vertices[element];
        let incident = mesh.incident.row(entry & !BACK_SIDE);
        let sampled = (mesh.shadow_offsets[element + 1] - mesh.shadow_offsets[element] - 1) as usize / 2;
        for k in 0..sampled {
            let corners = mesh.triangles[incident[k * incident.len() / sampled] as usize];
            let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
            let own = mesh.positions[(entry & !BACK_SIDE) as usize];
            let centre = (a + b + c) / 3.0;
            let across = (b - a).cross(c - a);
            let side = if entry & BACK_SIDE != 0 { -1.0 } else { 1.0 };
            let face = if across.length_squared() > 0.0 { across.normalize() * side } else { normal };
            rays.push(shadow_ray(centre.lerp(own, 0.5) + ray_offset * face, normal));
            rays.push(shadow_ray(centre + ray_offset * face, normal));
        }
    }
    rays
}

pub fn punctual_visibility(shadow_offsets: &[u32], rays: &[Ray], is_free: &[u32]) -> Vec<f32> {
    let mean = |row: &[u32]| {
        let cast: Vec<u32> =
            (row[0] as usize..row[1] as usize).filter(|&ray| rays[ray].t_max >= 0.0).map(|ray| is_free[ray]).collect();
        if cast.is_empty() { 0.0 } else { cast.iter().sum::<u32>() as f32 / cast.len() as f32 }
    };
    shadow_offsets.windows(2).map(mean).collect()
}

struct EmitterPoint {
    position: Vec3,
    normal: Vec3,
    area: f32,
}

fn emitter_point(at: &EmitterSample, triangles: &[[u32; 3]], positions: &[Vec3]) -> EmitterPoint {
    let [a, b, c] = triangles[at.triangle as usize].map(|v| positions[v as usize]);
    let across = (b - a).cross(c - a);
    EmitterPoint {
        position: a + at.barycentrics.x * (b - a) + at.barycentrics.y * (c - a),
        normal: across.normalize_or_zero(),
        area: 0.5 * across.length() * at.share,
    }
}

fn emitter_cosine(at: &EmitterSample, point: &EmitterPoint, direction: Vec3) -> f32 {
    let cosine = point.normal.dot(direction);
    if at.is_double_sided != 0 { cosine.abs() } else { cosine }
}

#[expect(clippy::too_many_arguments, reason = "bindings in order")]
pub fn emitter_rays(
    normals: &[Vec3],
    origins: &[Vec3],
    samples: &[EmitterSample],
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    first: u32,
    count: u32,
    ray_offset: f32,
) -> Vec<Ray> {
    let mut rays = Vec::new();
    for element in first as usize..(first + count) as usize {
        for at in samples {
            let point = emitter_point(at, triangles, positions);
            let origin = origins[element];
            let side = if point.normal.dot(origin - point.position) < 0.0 { -1.0 } else { 1.0 };
            let direction = point.position + point.normal * (side * ray_offset) - origin;
            let is_lit = normals[element].dot(direction) > 0.0 && emitter_cosine(at, &point, -direction) > 0.0;
            rays.push(Ray { origin, t_min: 0.0, direction, t_max: if is_lit { 1.0 } else { -1.0 } });
        }
    }
    rays
}

pub fn pack_visibility(rays: &[Ray], is_free: &[u32], row_length: usize) -> Vec<u32> {
    let answers: Vec<u32> = rays.iter().zip(is_free).map(|(r, free)| if r.t_max >= 0.0 { *free } else { 0 }).collect();
    let word = |bits: &[u32]| bits.iter().enumerate().fold(0, |word, (k, bit)| word | bit << k);
    answers.chunks(row_length).flat_map(|row| row.chunks(32).map(word)).collect()
}

pub fn emitter_irradiance(
    element_positions: &[Vec3],
    element_normals: &[Vec3],
    samples: &[EmitterSample],
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    emission: &[Vec3],
    visible: &[u32],
) -> Vec<Vec3> {
    let words = samples.len().div_ceil(32);
    let irradiance = |element: usize| {
        let (position, normal) = (element_positions[element], element_normals[element]);
        let mut sum = Vec3::ZERO;
        for (k, at) in samples.iter().enumerate() {
            if visible[element * words + k / 32] >> (k % 32) & 1 == 0 {
                continue;
            }
            let point = emitter_point(at, triangles, positions);
            let offset = point.position - position;
            let squared = offset.dot(offset);
            let direction = if squared > 0.0 { offset / squared.sqrt() } else { normal };
            let cosines = normal.dot(direction).max(0.0) * emitter_cosine(at, &point, -direction).max(0.0);
            let [a, b, c] = triangles[at.triangle as usize].map(|v| emission[v as usize]);
            let w = at.barycentrics;
            let radiance = (1.0 - w.x - w.y) * a + w.x * b + w.y * c;
            sum += radiance * (cosines * point.area / (squared + point.area / PI));
        }
        sum
    };
    (0..element_positions.len()).map(irradiance).collect()
}
