//! Pixels of the final gather: the senders of the cut, by a kernel that keeps what it takes from each; their light is
//! told bounce by bounce from what the tree holds after fewer of them.

use glam::{DVec3, UVec2, Vec3};

use super::probe::Probe;
use super::{Frame, Parts, add};
use crate::app::AppError;
use crate::app::frame::Method;
use crate::app::render::RenderRequest;
use crate::app::stage::Stage;
use crate::display::direct::{Canvas, Lighting};
use crate::display::final_gather::{NO_SENDER, Visibility};
use crate::gpu::Context;
use crate::report::explanation::Light;
use crate::stages::film::Film;
use crate::stages::sender_tree::LeafLight;

/// Arrivals that are kept of a pixel.
const MOST_KEPT: usize = 1 << 20;

pub fn explain(
    frame: Frame<'_>,
    method: &mut Method,
    pixel: UVec2,
    parts: &mut Parts,
) -> Result<Vec<String>, AppError> {
    let Frame { context, request, stage, watch, .. } = frame;
    let scratch = Film::new(context, request.width, request.height)?;
    let mut seen = lights(frame, method, pixel, &scratch, parts)?;
    // What leaves of the tree send when light has been reflected less often.
    let mut reflected: Vec<Vec<Vec3>> = Vec::new();
    for bounces in 0..request.bounces {
        let fewer = RenderRequest { bounces, spp: 1, lightmap: None, ..request.clone() };
        method.frame(context, &fewer, stage, &scratch, watch)?;
        reflected.push(leaf_light(context, method)?.into_iter().map(|light| light.reflected).collect());
    }
    let keep = |method: &mut Method, pixel| -> Result<(), AppError> {
        let Some(shown) = method.gathering() else { return Ok(()) };
        Ok(shown.display.keep(context, pixel, MOST_KEPT)?)
    };
    keep(method, Some(pixel.y * request.width + pixel.x))?;
    let again = RenderRequest { lightmap: None, ..request.clone() };
    let rendered = method.frame(context, &again, stage, &scratch, watch);
    let Some(shown) = method.gathering() else { return Ok(seen) };
    let kept = shown.display.kept(context);
    keep(method, None)?;
    rendered?;
    let kept = kept?;
    let all = leaf_light(context, method)?;
    reflected.push(all.iter().map(|light| light.reflected).collect());
    seen.push(format!("{} senders in {} samples", kept.len(), request.spp));

    let Some(shown) = method.gathering() else { return Ok(seen) };
    let order = &shown.tree.topology.leaf_order;
    let weight = 1.0 / f64::from(request.spp);
    for sender in kept {
        let slot = sender.leaf as usize;
        let name =
            if sender.leaf == NO_SENDER { "the environment".to_owned() } else { owner(stage, request, order[slot]) };
        let key = |light, bounce| (light, Some(bounce), name.clone(), String::new());
        add(parts, key(Light::Direct, 0), weight * sender.direct.as_dvec3());
        if sender.indirect == Vec3::ZERO {
            continue;
        }
        // The leaf's light by bounces, in proportion.
        let whole = all[slot].reflected.as_dvec3();
        let part = weight * sender.indirect.as_dvec3();
        let mut before = DVec3::ZERO;
        for (bounce, light) in reflected.iter().enumerate().skip(1) {
            let now = light[slot].as_dvec3();
            let share = (now - before) / whole;
            let share = DVec3::select(whole.cmpeq(DVec3::ZERO), DVec3::ZERO, share);
            add(parts, key(Light::Indirect, bounce as u32), part * share);
            before = now;
        }
    }
    Ok(seen)
}

/// Light without the gather.
fn lights(
    frame: Frame<'_>,
    method: &mut Method,
    pixel: UVec2,
    scratch: &Film,
    parts: &mut Parts,
) -> Result<Vec<String>, AppError> {
    let Frame { context, request, stage, .. } = frame;
    let mut names = Vec::new();
    let Some(shown) = method.gathering() else { return Ok(names) };
    if matches!(shown.display.settings.gather_visibility, Visibility::Auto | Visibility::Maps) && shown.has_maps {
        return Err(AppError::Usage(
            "--explain follows a final gather that sees by rays; set gather_visibility=rays or none".into(),
        ));
    }
    let (world, tracer) = (&stage.world, stage.tracer());
    let lighting = Lighting { world, shadow_maps: shown.shadow_maps, tracer, g_buffer: shown.g_buffer };
    let canvas = Canvas { lighting, view: &stage.view, samples: request.spp, film: scratch };
    let probe = Probe::new(context, stage, canvas, pixel)?;
    for index in 0..request.spp {
        if let Some(triangle) = probe.sample(index, parts)?.triangle {
            let line = probe.name(triangle);
            if !names.contains(&line) {
                names.push(line);
            }
        }
    }
    Ok(names)
}

fn leaf_light(context: &Context, method: &mut Method) -> Result<Vec<LeafLight>, AppError> {
    match method.gathering() {
        Some(shown) => Ok(shown.tree.leaf_light(context)?),
        None => Ok(Vec::new()),
    }
}

/// Whose light a leaf of the tree is: a texel's, or a triangle's.
fn owner(stage: &Stage, request: &RenderRequest, owner: u32) -> String {
    if request.method.key == "surface-shadow-maps" {
        return format!("texel {owner}");
    }
    let triangles = stage.geometry.triangle_part.len();
    match stage.geometry.triangle_part.get(owner as usize) {
        Some(&part) => {
            let part = stage.geometry.parts[part as usize];
            let node = stage.scene.nodes.get(part.node as usize).map_or("", |node| node.name.as_str());
            format!("triangle {owner} of node {} `{node}`", part.node)
        }
        None => format!("back {} of two-sided triangles", owner as usize - triangles),
    }
}
