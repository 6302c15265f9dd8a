//! Pixels of path tracing, which keeps no light apart: frames of fewer bounces, and what each bounce adds.

use glam::UVec2;

use super::{Frame, Parts, add};
use crate::app::AppError;
use crate::app::frame::Method;
use crate::app::render::RenderRequest;
use crate::report::explanation::Light;
use crate::stages::film::Film;

pub fn explain(
    frame: Frame<'_>,
    method: &mut Method,
    pixel: UVec2,
    parts: &mut Parts,
) -> Result<Vec<String>, AppError> {
    let Frame { context, request, stage, watch, .. } = frame;
    let film = Film::new(context, request.width, request.height)?;
    let mut before = [glam::DVec3::ZERO; 2];
    for bounces in 0..=request.bounces {
        let fewer = RenderRequest { bounces, lightmap: None, ..request.clone() };
        method.show(context, &fewer, stage)?;
        method.frame(context, &fewer, stage, &film, watch)?;
        let now = frame.value(&film, pixel)?.map(glam::Vec3::as_dvec3);
        let source = match bounces {
            0 => "emission, lights and environment".to_owned(),
            bounces => format!("paths of {} reflections", bounces + 1),
        };
        for (light, (now, before)) in [Light::Direct, Light::Indirect].into_iter().zip(now.into_iter().zip(before)) {
            add(parts, (light, Some(bounces), source.clone(), String::new()), now - before);
        }
        before = now;
    }
    Ok(Vec::new())
}
