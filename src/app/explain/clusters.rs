//! Pixels of face clusters: the vector irradiance of the leaf that is seen, by bounces. No links are kept.

use glam::{DVec3, UVec2, Vec2, Vec3};

use super::probe::{Probe, Seen};
use super::{Frame, Parts, add};
use crate::app::AppError;
use crate::app::on_clusters::{ClustersShown, cluster_stage};
use crate::display::direct::{Canvas, Lighting};
use crate::display::irradiance_vector;
use crate::gpu::shaders::types::{LeafElement, SharedVectors};
use crate::gpu::{Buffer, Context};
use crate::report::explanation::Light;
use crate::stages::film::Film;
use crate::stages::irradiance_vector::ElementLight;

pub fn explain(
    frame: Frame<'_>,
    shown: &mut ClustersShown,
    pixel: UVec2,
    parts: &mut Parts,
) -> Result<Vec<String>, AppError> {
    let Frame { context, request, stage, watch, .. } = frame;
    let scratch = Film::new(context, request.width, request.height)?;
    let mut names = Vec::new();
    let mut before = [DVec3::ZERO; 2];
    for bounces in 0..=request.bounces {
        let ClustersShown { method, shadow_maps, g_buffer, .. } = &mut *shown;
        method.solve(context, &cluster_stage(stage, None, watch), bounces).map_err(AppError::failed)?;
        let solution = method.keep(context).map_err(AppError::failed)?;
        let light = method.light(&solution);
        let (world, tracer, view, samples) = (&stage.world, stage.tracer(), &stage.view, request.spp);
        let canvas =
            Canvas { lighting: Lighting { world, shadow_maps, tracer, g_buffer }, view, samples, film: &scratch };
        let probe = Probe::new(context, stage, canvas, pixel)?;
        // Light without the method counts once.
        let mut others = Parts::new();
        let mut now = [DVec3::ZERO; 2];
        for index in 0..samples {
            let seen = probe.sample(index, &mut others)?;
            let Some(triangle) = seen.triangle.filter(|_| seen.reflects) else { continue };
            let (shines, leaf) = radiance(&probe, &light, triangle, &seen)?;
            now.iter_mut().zip(shines).for_each(|(now, shines)| *now += shines);
            if bounces == request.bounces {
                let line = format!("{}, leaf cluster {leaf} of {}", probe.name(triangle), light.leaves.len());
                if !names.contains(&line) {
                    names.push(line);
                }
            }
        }
        if bounces == 0 {
            parts.append(&mut others);
        }
        let [direct, indirect] = [now[0] - before[0], now[1] - before[1]];
        let source = |what: &str| format!("{what}, {} functions a leaf", light.functions);
        add(parts, (Light::Direct, Some(0), source("emitters and environment"), String::new()), direct);
        add(parts, (Light::Indirect, Some(bounces), source("clusters"), String::new()), indirect);
        before = now;
    }
    Ok(names)
}

/// What a sample shows of the direct and indirect vectors of its leaf and of those that reach it, and the leaf: on the
/// host for diffuse surfaces, as `display/irradiance_vector` computes it; by that pass for others.
fn radiance(
    probe: &Probe<'_>,
    light: &ElementLight<'_>,
    triangle: u32,
    seen: &Seen,
) -> Result<([DVec3; 2], u32), AppError> {
    let context = probe.context;
    let at = triangle as usize;
    let [front, back] = context.download_range(light.triangle_leaves, at..at + 1)?[0].to_array();
    let leaf = if seen.is_back && back != u32::MAX { back } else { front };
    if leaf == u32::MAX {
        return Ok(([DVec3::ZERO; 2], leaf));
    }
    if !seen.is_diffuse || light.per_vertex {
        let (film, at) = (probe.canvas.film, (probe.pixel.y * probe.canvas.film.width + probe.pixel.x) as usize);
        let indirect = probe.reflectance(seen, |recorder, view, weight| {
            irradiance_vector::add(recorder, *light, probe.canvas, view, weight);
        })?;
        let direct = context.download_range(&film.direct, at..at + 1)?[0].as_dvec3();
        return Ok(([direct, indirect], leaf));
    }
    let mut others = Vec::new();
    if light.reach > 0.0 {
        let row = context.download_range(light.neighbour_offsets, leaf as usize..leaf as usize + 2)?;
        others = context.download_range(light.neighbours, row[0] as usize..row[1] as usize)?;
    }
    let mut sum = [[Vec3::ZERO; 3]; 2];
    let mut weights = 0.0;
    for leaf in [leaf].into_iter().chain(others) {
        let element = context.download_range(light.leaves, leaf as usize..leaf as usize + 1)?[0];
        let extent = element.half_extent;
        let mut weight = weight_of(&element, seen.position, light.reach);
        if weights == 0.0 {
            weight = weight.max(1e-6 / (extent.x * extent.y).max(1e-30));
        }
        if weight <= 0.0 {
            continue;
        }
        let offset = seen.position - element.center;
        let along = Vec2::new(offset.dot(element.axis_x), offset.dot(element.axis_y));
        let uv = (0.5 + 0.5 * along / extent.truncate().max(Vec2::splat(1e-30))).clamp(Vec2::ZERO, Vec2::ONE);
        for (sum, buffer) in sum.iter_mut().zip([light.direct, light.indirect]) {
            let vectors = at_place(context, light, buffer, leaf, uv)?;
            sum.iter_mut().zip(vectors).for_each(|(sum, vector)| *sum += weight * vector);
        }
        weights += weight;
    }
    let reflectance = seen.albedo / std::f32::consts::PI / probe.canvas.samples as f32;
    let shines = sum.map(|vectors| {
        let along = Vec3::from_array(vectors.map(|vector| (vector / weights).dot(seen.normal).max(0.0)));
        (reflectance * along).as_dvec3()
    });
    Ok((shines, leaf))
}

/// As `lib/leaf_light.glsl` weighs a leaf at a place, 1/m2; `reach` in shorter half sides.
fn weight_of(element: &LeafElement, place: Vec3, reach: f32) -> f32 {
    let (offset, extent) = (place - element.center, element.half_extent);
    let axes = [element.axis_x, element.axis_y, element.axis_x.cross(element.axis_y)];
    let over = Vec3::from_array(axes.map(|axis| offset.dot(axis).abs())) - extent;
    let limit = reach * extent.x.min(extent.y);
    let share = if limit > 0.0 { (1.0 - over.max_element() / limit).clamp(0.0, 1.0) } else { 0.0 };
    share / (4.0 * extent.x * extent.y).max(1e-30)
}

/// The irradiance vectors of the three channels at a place of a leaf, W/m2: `unpacked` of `lib/face_element.glsl`.
fn at_place(
    context: &Context,
    light: &ElementLight<'_>,
    buffer: &Buffer<SharedVectors>,
    leaf: u32,
    uv: Vec2,
) -> Result<[Vec3; 3], AppError> {
    let (first, count) = ((leaf * light.functions) as usize, light.functions as usize);
    let packed = context.download_range(buffer, first..first + count)?;
    let mut sum = [Vec3::ZERO; 3];
    for (k, vectors) in packed.iter().enumerate() {
        let [r, g, b] = vectors.words.map(|word| word >> 30);
        let scale = 2f32.powi((r | g << 2 | b << 4) as i32 - 48 - 9) * light.unit * basis(k, uv);
        for (word, sum) in vectors.words.iter().zip(&mut sum) {
            let mantissa = |axis: u32| ((word << (22 - 10 * axis)) as i32 >> 22) as f32;
            *sum += scale * Vec3::new(mantissa(0), mantissa(1), mantissa(2));
        }
    }
    Ok(sum)
}

/// As `lib/cluster_basis.glsl`: products of Legendre polynomials, orthonormal on the unit square.
fn basis(k: usize, uv: Vec2) -> f32 {
    let s = 2.0 * uv - 1.0;
    let p1 = 3f32.sqrt() * s;
    let p2 = 1.25f32.sqrt() * (3.0 * s * s - 1.0);
    let p3 = 1.75f32.sqrt() * s * (5.0 * s * s - 3.0);
    match k {
        0 => 1.0,
        1 => p1.x,
        2 => p1.y,
        3 => p1.x * p1.y,
        4 => p2.x,
        5 => p2.y,
        6 => p3.x,
        7 => p2.x * p1.y,
        8 => p1.x * p2.y,
        _ => p3.y,
    }
}
