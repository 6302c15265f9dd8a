//! The reference of a comparison: a picture that was given, or one path-traced until its noise is low enough, and kept
//! in the folder of the report for the next time.

use std::path::Path;

use serde_json::Value;

use super::plan::Run;
use crate::app::stage::Stage;
use crate::app::{AppError, frame, render};
use crate::gpu::Context;
use crate::methods::path_tracing::{Options, PathTracing};
use crate::report::image::{self, Picture};
use crate::report::trace::TimeLine;
use crate::scene::environment::load::EnvironmentSource;
use crate::stages::film::Film;
use crate::stages::work::Watch;

/// Keys of the picture's metadata.
const HASH: &str = "linklight.reference";
const NOISE: &str = "linklight.noise";
const SAMPLES: &str = "linklight.samples";

/// How good it must be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Standard error of a pixel, root mean square, as a fraction of the picture's mean.
    pub noise: f64,
    /// Paths per pixel at which it ends all the same.
    pub max_samples: u32,
}

/// The picture and what is known of its error.
#[derive(Debug, Clone)]
pub struct Reference {
    pub picture: Picture,
    /// As [`Quality::noise`]; unknown for a picture that was given.
    pub noise: Option<f64>,
    pub samples: Option<u32>,
    /// Taken from an earlier run.
    pub is_cached: bool,
}

impl Reference {
    /// A picture of the user's.
    pub fn given(path: &Path) -> Result<Self, AppError> {
        Ok(Self { picture: image::read(path)?, noise: None, samples: None, is_cached: false })
    }

    /// The one kept at the run's output if it is of the same scene and options and good enough, else a new one, kept.
    pub fn path_traced(run: &Run, quality: Quality, watch: &dyn Watch) -> Result<Self, AppError> {
        let hash = hash(run)?;
        let path = &run.request.output.path;
        if let Some(kept) = Self::kept(path, &hash, quality) {
            return Ok(kept);
        }
        let context = render::open_device(&run.global, false)?;
        let stage = Stage::new(&context, &run.request, &TimeLine::default())?;
        let (mut picture, noise, samples) = trace(&context, run, &stage, quality, watch)?;
        let facts = [(HASH, hash), (NOISE, format!("{noise:e}")), (SAMPLES, samples.to_string())];
        picture.metadata = facts.map(|(key, value)| (key.to_owned(), value)).into();
        image::write_exr(path, &picture)?;
        Ok(Self { picture, noise: Some(noise), samples: Some(samples), is_cached: false })
    }

    /// A file that is missing, damaged or of something else is no error: it is made anew.
    fn kept(path: &Path, hash: &str, quality: Quality) -> Option<Self> {
        let picture = image::read(path).ok()?;
        let noise: f64 = picture.metadata.get(NOISE)?.parse().ok()?;
        let samples: u32 = picture.metadata.get(SAMPLES)?.parse().ok()?;
        let is_same = picture.metadata.get(HASH)? == hash;
        let is_good = noise <= quality.noise || samples >= quality.max_samples;
        (is_same && is_good).then_some(Self { picture, noise: Some(noise), samples: Some(samples), is_cached: true })
    }
}

/// Paths until the noise is low enough. The estimate wants a few samples before it can be believed.
fn trace(
    context: &Context,
    run: &Run,
    stage: &Stage,
    quality: Quality,
    watch: &dyn Watch,
) -> Result<(Picture, f64, u32), AppError> {
    const FIRST_ESTIMATE: u32 = 16;
    let request = &run.request;
    let options = Options {
        width: request.width,
        height: request.height,
        bounces: request.bounces,
        seed: request.seed,
        settings: request.settings()?,
    };
    let film = Film::new(context, request.width, request.height)?;
    let mut method =
        PathTracing::new(context, &stage.scene, &stage.geometry, &stage.world, options).map_err(AppError::failed)?;
    method.prepare(context, &stage.world)?;
    let mut target = FIRST_ESTIMATE.min(quality.max_samples);
    loop {
        while method.sample_count() < target {
            watch.step("reference", method.sample_count().into(), quality.max_samples.into())?;
            let samples = method.samples_at_once().min(target - method.sample_count());
            let mut recorder = context.recorder("reference")?;
            method.sample(&mut recorder, &stage.world, &stage.tracer(), &stage.view, samples);
            recorder.submit()?;
        }
        // Black everywhere has no noise.
        let noise = method.error_estimate(context)?.map_or(0.0, |estimate| estimate.relative_pixel_error);
        if noise <= quality.noise || target >= quality.max_samples {
            watch.step("reference", 1, 1)?;
            let mut recorder = context.recorder("reference")?;
            method.resolve(&mut recorder, &film);
            recorder.submit()?;
            return Ok((frame::picture(context, request, &film)?, noise, method.sample_count()));
        }
        // Noise falls with the root of the samples; never more than four times as many on one estimate's word.
        let wanted = f64::from(target) * (noise / quality.noise).powi(2) * 1.05;
        target = (wanted.ceil() as u32).clamp(target + 1, target.saturating_mul(4)).min(quality.max_samples);
    }
}

/// Of everything that decides the picture but its noise: the scene's files, the options, the version.
fn hash(run: &Run) -> Result<String, AppError> {
    let mut hasher = blake3::Hasher::new();
    let mut record = run.request.record()?;
    record.remove("spp");
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(Value::from(record).to_string().as_bytes());
    if let Some(EnvironmentSource::File(path)) = &run.request.environment {
        hasher.update(&crate::files::read(path).unwrap_or_default());
    }
    hasher.update(run.request.scene.hash().as_bytes());
    Ok(hasher.finalize().to_hex().to_string())
}
