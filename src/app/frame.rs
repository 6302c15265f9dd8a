//! The frame: from a staged scene to a film, by the method that was asked for.

use super::AppError;
use super::cli::Channel;
use super::console::Console;
use super::interrupt::Interrupt;
use super::render::LightParts;
use super::render::RenderRequest;
use super::stage::Stage;
use crate::gpu::Context;
use crate::methods::path_tracing::{Options, PathTracing};
use crate::report::image::Picture;
use crate::stages::film::Film;
use crate::stages::trace::Tracer;

/// Renders one frame of `stage` into `film`.
pub fn render(
    context: &Context,
    request: &RenderRequest,
    stage: &Stage,
    film: &Film,
    console: &Console,
    interrupt: &Interrupt,
) -> Result<(), AppError> {
    match request.method.key {
        "path-tracing" => path_trace(context, request, stage, film, console, interrupt),
        other => Err(AppError::failed(format!("method {other} cannot be rendered"))),
    }
}

/// Samples until there are as many as asked for, then resolves. Each submission is one sample of every pixel.
fn path_trace(
    context: &Context,
    request: &RenderRequest,
    stage: &Stage,
    film: &Film,
    console: &Console,
    interrupt: &Interrupt,
) -> Result<(), AppError> {
    let options = Options {
        width: request.width,
        height: request.height,
        bounces: request.bounces,
        seed: request.seed,
        settings: request.settings()?,
    };
    let Stage { scene, geometry, world, view, bvh, .. } = stage;
    let tracer = Tracer::Compute(bvh, world.into());
    let mut tracing = PathTracing::new(context, scene, geometry, world, options).map_err(AppError::failed)?;
    let progress = console.progress("path tracing", request.spp.into());
    for _ in 0..request.spp {
        interrupt.check()?;
        let mut recorder = context.recorder("path-tracing")?;
        tracing.sample(&mut recorder, world, &tracer, view, 1);
        recorder.submit()?;
        progress.advance(1);
    }
    let mut recorder = context.recorder("path-tracing")?;
    tracing.resolve(&mut recorder, film);
    recorder.submit()?;
    if let Some(estimate) = tracing.error_estimate(context)? {
        tracing::info!("{estimate:?}");
    }
    Ok(())
}

/// Reads the film back: the light asked for as RGB, and the extra channels.
pub fn picture(context: &Context, request: &RenderRequest, film: &Film) -> Result<Picture, AppError> {
    let direct = context.download(&film.direct)?;
    let indirect = context.download(&film.indirect)?;
    let rgb = match request.light {
        LightParts::All => direct.iter().zip(&indirect).map(|(&d, &i)| d + i).collect(),
        LightParts::DirectOnly => direct.clone(),
        LightParts::IndirectOnly => indirect.clone(),
    };
    let mut picture = Picture::new(film.width, film.height, rgb)?;
    for channel in &request.channels {
        match channel {
            Channel::Direct => picture.add_rgb("direct", &direct)?,
            Channel::Indirect => picture.add_rgb("indirect", &indirect)?,
            Channel::Albedo => picture.add_rgb("albedo", &context.download(&film.albedo)?)?,
            Channel::Normal => picture.add_xyz("normal", &context.download(&film.normal)?)?,
            Channel::Depth => picture.add_channel("depth.Z", context.download(&film.depth)?)?,
        }
    }
    Ok(picture)
}
