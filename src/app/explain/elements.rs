//! Pixels of methods whose light is on elements, shown between vertices or by flat patches.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec3, UVec2, Vec3};

use super::probe::{Probe, Seen};
use super::{Frame, Parts, add};
use crate::app::AppError;
use crate::app::frame::{VertexShown, explicit_stage};
use crate::app::on_elements::OnElements;
use crate::app::stage::Stage;
use crate::display::direct::{Canvas, Lighting};
use crate::display::splat::{self, SplatLight};
use crate::display::vertex::{self, VertexLight};
use crate::gpu::Buffer;
use crate::gpu::shaders::types::{Splat, SplatShare};
use crate::methods::carried::{Carried, Sender};
use crate::report::explanation::Light;
use crate::stages::elements::{BACK_SIDE, Elements, NO_ELEMENT};
use crate::stages::film::Film;

/// `SPLAT_REACH` of `lib/splat.glsl`.
const SPLAT_REACH: f32 = 2.0;

/// By element: radiance of the pixel for irradiance on the element, 1/sr.
type Weights = BTreeMap<u32, DVec3>;

pub fn explain(
    frame: Frame<'_>,
    shown: &mut VertexShown,
    pixel: UVec2,
    parts: &mut Parts,
) -> Result<Vec<String>, AppError> {
    let Frame { context, request, stage, film, .. } = frame;
    let (weights, mut seen) = weights(frame, shown, pixel, parts)?;
    let method = &mut shown.method;
    let (direct, indirect) = method.look(context, &stage.world, &stage.view)?;
    let (direct, indirect) = (context.download(direct)?, context.download(indirect)?);
    let even = context.download(method.indirect_irradiance())?;
    for (&element, &weight) in &weights {
        let name = name(stage, method.elements(), element);
        seen.push(format!("{name}: {:.4} 1/sr", weight.element_sum() / 3.0));
        let at = element as usize;
        let source = "emitters and environment".to_owned();
        add(parts, (Light::Direct, Some(0), source, name.clone()), weight * direct[at].as_dvec3());
        let glossy = (indirect[at] - even[at]).as_dvec3();
        if glossy != DVec3::ZERO {
            let source = "glossy reflection, beyond even light".to_owned();
            add(parts, (Light::Indirect, None, source, name), weight * glossy);
        }
    }

    // What smoothing averaged.
    let gathered = match method.smoothing() {
        Some(angle) => averaged(&context.download(&method.elements().normals)?, method.elements(), angle, &weights),
        None => weights.clone(),
    };
    method.keep_sent(context, true)?;
    let told = tell_links(frame, &mut **method, &gathered, parts);
    method.keep_sent(context, false)?;
    told?;
    debug_assert_eq!(film.pixel_count(), request.width * request.height);
    Ok(seen)
}

/// What came along links, bounce by bounce; `gathered`: what each element counts in the pixel.
fn tell_links(
    frame: Frame<'_>,
    method: &mut dyn OnElements,
    gathered: &Weights,
    parts: &mut Parts,
) -> Result<(), AppError> {
    let Frame { context, request, stage, watch, .. } = frame;
    let elements: Vec<u32> = gathered.keys().copied().collect();
    let mut before: Vec<HashMap<Sender, Vec3>> = vec![HashMap::new(); elements.len()];
    for bounce in 1..=request.bounces {
        watch.step("explain", u64::from(bounce) - 1, request.bounces.into())?;
        method.solve_again(context, &explicit_stage(stage, watch), bounce)?;
        let told = method.bounces_are_apart().then_some(bounce);
        let carried = method.carried_to(context, &elements)?;
        for ((&weight, before), carried) in gathered.values().zip(&mut before).zip(carried) {
            for Carried { from, irradiance } in carried {
                let source = match from {
                    Sender::Element(sender) => name(stage, method.elements(), sender),
                    Sender::Node { node, first, leaf_count } => {
                        format!("node {node} of {leaf_count}, {}", name(stage, method.elements(), first))
                    }
                    Sender::Neighbours => "neighbours of elements inside something".into(),
                    Sender::Glossy => "glossy senders' tables".into(),
                    Sender::Floor => "what is not taken away below zero, and rounding".into(),
                };
                let mut added = irradiance;
                if method.bounces_add_up() {
                    added -= before.insert(from, irradiance).unwrap_or_default();
                }
                if added != Vec3::ZERO {
                    add(parts, (Light::Indirect, told, source, String::new()), weight * added.as_dvec3());
                }
            }
        }
    }
    Ok(())
}

/// What the samples of the pixel see of which element, and what they see.
fn weights(
    frame: Frame<'_>,
    shown: &VertexShown,
    pixel: UVec2,
    parts: &mut Parts,
) -> Result<(Weights, Vec<String>), AppError> {
    let Frame { context, request, stage, .. } = frame;
    let scratch = Film::new(context, request.width, request.height)?;
    let VertexShown { method, shadow_maps, g_buffer, splat_sums, .. } = shown;
    let (world, tracer, view, samples) = (&stage.world, stage.tracer(), &stage.view, request.spp);
    let canvas = Canvas { lighting: Lighting { world, shadow_maps, tracer, g_buffer }, view, samples, film: &scratch };
    let probe = Probe::new(context, stage, canvas, pixel)?;
    let elements = method.elements();
    let ones: Buffer<Vec3> = context.upload("explain/ones", &vec![Vec3::ONE; elements.count as usize])?;
    let light = VertexLight {
        direct_irradiance: &ones,
        indirect_irradiance: &ones,
        back_elements: &elements.back_elements,
        colors: None,
    };
    let patches = match (splat_sums, method.splats()) {
        (Some(sums), Some(splats)) => {
            let rectangles = context.download(&splats.splats)?;
            let members = context.download(&splats.shares)?;
            let surfaces = context.download(&splats.triangle_surfaces)?;
            Some((SplatLight { vertices: light, splats, sums }, rectangles, members, surfaces))
        }
        _ => None,
    };
    let (mut weights, mut names) = (Weights::new(), Vec::new());
    for index in 0..request.spp {
        let seen = probe.sample(index, parts)?;
        let Some(triangle) = seen.triangle else { continue };
        let line = probe.name(triangle);
        if !names.contains(&line) {
            names.push(line);
        }
        if !seen.reflects {
            continue;
        }
        let reflectance = probe.reflectance(&seen, |recorder, view, weight| match &patches {
            Some((light, ..)) => splat::add(recorder, *light, canvas, view, weight),
            None => vertex::add(recorder, light, canvas, view, weight),
        })?;
        let by_patches = patches.as_ref().and_then(|(_, splats, members, surfaces)| {
            of_splats(splats, members, surfaces[triangle as usize], &seen, elements)
        });
        let shares = by_patches.unwrap_or_else(|| of_corners(&probe, triangle, &seen, elements));
        for (element, share) in shares {
            *weights.entry(method.shown_by(element)).or_default() += f64::from(share) * reflectance;
        }
    }
    Ok((weights, names))
}

/// As `display/vertex_light` shares between the corners of the triangle.
fn of_corners(probe: &Probe<'_>, triangle: u32, seen: &Seen, elements: &Elements) -> Vec<(u32, f32)> {
    let vertices = probe.corners(triangle);
    let backs = vertices.map(|vertex| elements.topology.back_elements[vertex as usize]);
    let of = if seen.is_back && backs[0] != NO_ELEMENT { backs } else { vertices };
    of.into_iter().zip(seen.weights).collect()
}

/// As `display/splat` and `display/splat_normalize` share between patches, and `display/splat_light` between their vertices;
/// `None` where none reaches.
fn of_splats(
    splats: &[Splat],
    members: &[SplatShare],
    surface: u32,
    seen: &Seen,
    elements: &Elements,
) -> Option<Vec<(u32, f32)>> {
    let eye = seen.view.eye;
    let mut shares: Vec<(u32, f32)> = Vec::new();
    for splat in splats.iter().filter(|splat| splat.surface == surface) {
        let (u, v) = (splat.half_u, splat.half_v);
        let offset = seen.position - splat.center;
        let along =
            |half: Vec3| (1.0 - offset.dot(half).abs() / (SPLAT_REACH * half.length_squared().max(1e-30))).max(0.0);
        let weight = along(u) * along(v);
        if weight > 0.0 {
            let eye_at = Vec3::from_slice(&eye);
            let to_eye = if eye[3] == 0.0 { eye_at } else { eye_at - splat.center };
            let sees_back = u.cross(v).dot(to_eye) < 0.0;
            let own = &members[splat.first_share as usize..][..splat.share_count as usize];
            shares.extend(own.iter().map(|member| {
                let back = elements.topology.back_elements[member.vertex as usize];
                (if sees_back && back != NO_ELEMENT { back } else { member.vertex }, weight * member.share)
            }));
        }
    }
    let sum: f32 = shares.iter().map(|(_, weight)| weight).sum();
    shares.iter_mut().for_each(|(_, weight)| *weight /= sum);
    (sum > 0.0).then_some(shares)
}

/// Weights of what `elements/smooth` averaged into the elements of `weights`.
fn averaged(normals: &[Vec3], elements: &Elements, angle: f32, weights: &Weights) -> Weights {
    let mut gathered = Weights::new();
    for (&element, &weight) in weights {
        let normal = normals[element as usize];
        let alike = |other: &&u32| normal.dot(normals[**other as usize]) > angle.cos();
        let members: Vec<u32> =
            elements.topology.ring.row(element).iter().filter(alike).copied().chain([element]).collect();
        for &member in &members {
            *gathered.entry(member).or_default() += weight / members.len() as f64;
        }
    }
    gathered
}

/// An element in words.
fn name(stage: &Stage, elements: &Elements, element: u32) -> String {
    let entry = elements.topology.vertices[element as usize];
    let vertex = entry & !BACK_SIDE;
    let part = stage.geometry.parts[stage.geometry.vertex_part[vertex as usize] as usize];
    let node = stage.scene.nodes.get(part.node as usize).map_or("", |node| node.name.as_str());
    let side = if entry & BACK_SIDE != 0 { " (back)" } else { "" };
    format!("element {element}{side} of node {} `{node}`", part.node)
}
