//! One run of a comparison: the picture, and what it cost.

use std::time::Instant;

use glam::Vec3;

use super::plan::Run;
use crate::app::measure::milliseconds;
use crate::app::stage::Stage;
use crate::app::{AppError, frame, measure, render};
use crate::methods::path_tracing::{Options, PathTracing};
use crate::report::compare_page::{Cost, CurvePoint};
use crate::report::errors::compare;
use crate::report::image::Picture;
use crate::report::profile::{Milliseconds, summarise};
use crate::report::tonemap::ToneSettings;
use crate::report::trace::TimeLine;
use crate::stages::film::Film;
use crate::stages::work::Watch;

/// A picture, its cost, and the mean radiance with 0, 1, 2 ... bounces.
pub struct Measured {
    pub picture: Picture,
    pub cost: Cost,
    pub bounce_means: Vec<f64>,
}

/// Runs on a device of its own, so that memory is this run's alone. Preparation is timed the second time, when the
/// driver has compiled everything; frames after a first one.
///
/// `each_bounce` asks for the means with fewer bounces, which costs a frame each.
pub fn measure(run: &Run, frames: u32, each_bounce: bool, watch: &dyn Watch) -> Result<Measured, AppError> {
    let context = render::open_device(&run.global, true)?;
    let stage = Stage::new(&context, &run.request, &TimeLine::default())?;
    let film = Film::new(&context, run.request.width, run.request.height)?;
    let mut prepared = context.take_records();
    drop(frame::Method::prepare(&context, &run.request, &stage, watch)?);
    context.take_records();
    let start = Instant::now();
    let mut method = frame::Method::prepare(&context, &run.request, &stage, watch)?;
    let prepare_ms = milliseconds(start);
    prepared.extend(context.take_records());
    let prepare_passes = summarise(&measure::pass_records(prepared));

    method.frame(&context, &run.request, &stage, &film, watch)?;
    context.take_records();
    let mut frame_ns = Vec::new();
    for _ in 0..frames {
        let start = Instant::now();
        method.frame(&context, &run.request, &stage, &film, watch)?;
        frame_ns.push(u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX));
    }
    let passes = summarise(&measure::pass_records(context.take_records()));
    let picture = frame::picture(&context, &run.request, &film)?;

    let facts = method.report()?;
    let mut bounce_means = Vec::new();
    for bounces in 0..if each_bounce { run.request.bounces } else { 0 } {
        let mut request = run.request.clone();
        request.bounces = bounces;
        method.frame(&context, &request, &stage, &film, watch)?;
        bounce_means.push(mean(&frame::picture(&context, &request, &film)?));
    }
    bounce_means.push(mean(&picture));
    render::check_validation(&context)?;

    let memory = measure::memory(&context.memory_by_owner());
    let scene = stage.facts();
    let cost = Cost {
        prepare_ms,
        frame_ms: Milliseconds::of(frame_ns),
        peak_bytes: memory.peak_bytes,
        triangles: scene.triangles,
        elements: scene.elements,
        passes,
        prepare_passes,
        memory: memory.owners,
        facts,
    };
    Ok(Measured { picture, cost, bounce_means })
}

/// The yardstick of every method: paths of another seed than the reference's, for ever longer.
pub fn path_tracing_curve(
    reference: &Run,
    picture: &Picture,
    samples: u32,
    tone: &ToneSettings,
    watch: &dyn Watch,
) -> Result<Vec<CurvePoint>, AppError> {
    let request = &reference.request;
    let context = render::open_device(&reference.global, false)?;
    let stage = Stage::new(&context, request, &TimeLine::default())?;
    let film = Film::new(&context, request.width, request.height)?;
    let options = Options {
        width: request.width,
        height: request.height,
        bounces: request.bounces,
        seed: request.seed.wrapping_add(1),
        settings: request.settings()?,
    };
    let mut points = Vec::new();
    // The first round is the driver's, to compile.
    for is_warm in [false, true] {
        let mut method = PathTracing::new(&context, &stage.scene, &stage.geometry, &stage.world, options)
            .map_err(AppError::failed)?;
        method.prepare(&context, &stage.world)?;
        let start = Instant::now();
        let mut target = 1;
        while target <= if is_warm { samples } else { 1 } {
            while method.sample_count() < target {
                watch.step("path-tracing", method.sample_count().into(), samples.into())?;
                let count = method.samples_at_once().min(target - method.sample_count());
                let mut recorder = context.recorder("frame")?;
                method.sample(&mut recorder, &stage.world, &stage.tracer(), &stage.view, count);
                recorder.submit()?;
            }
            let milliseconds = milliseconds(start);
            let mut recorder = context.recorder("frame")?;
            method.resolve(&mut recorder, &film);
            recorder.submit()?;
            if is_warm {
                let figures = compare(&frame::picture(&context, request, &film)?, picture, None, tone)?.figures;
                points.push(CurvePoint { samples: target, milliseconds, figures });
            }
            target *= 2;
        }
    }
    watch.step("path-tracing", 1, 1)?;
    Ok(points)
}

/// Mean radiance over pixels and channels.
pub fn mean(picture: &Picture) -> f64 {
    let sum: f64 = picture.rgb.iter().map(|pixel: &Vec3| f64::from(pixel.element_sum())).sum();
    sum / (3.0 * picture.rgb.len().max(1) as f64)
}
