//! One thing that is measured: a method prepared on a device of its own, and the times of its frames.

use std::time::Instant;

use crate::app::compare::plan::Run;
use crate::app::measure::milliseconds;
use crate::app::stage::Stage;
use crate::app::{AppError, frame, measure, render};
use crate::gpu::Context;
use crate::report::bench_file::{self, PassTimes, Times};
use crate::report::profile::{Pass, summarise};
use crate::report::statistics::Estimate;
use crate::report::trace::TimeLine;
use crate::stages::film::Film;
use crate::stages::work::Watch;

/// A run, ready to render frame after frame.
pub struct Subject<'w> {
    run: Run,
    stage: Stage,
    film: Film,
    method: frame::Method,
    context: Context,
    watch: &'w dyn Watch,
    prepare_ms: f64,
    /// Passes of each round.
    rounds: Vec<Vec<Pass>>,
}

impl<'w> Subject<'w> {
    pub fn prepare(run: Run, watch: &'w dyn Watch) -> Result<Self, AppError> {
        let context = render::open_device(&run.global, false)?;
        let stage = Stage::new(&context, &run.request, &TimeLine::default())?;
        let film = Film::new(&context, run.request.width, run.request.height)?;
        // Twice: the first time is the driver's, to compile.
        drop(frame::Method::prepare(&context, &run.request, &stage, watch)?);
        let start = Instant::now();
        let method = frame::Method::prepare(&context, &run.request, &stage, watch)?;
        let prepare_ms = milliseconds(start);
        Ok(Self { run, stage, film, method, context, watch, prepare_ms, rounds: Vec::new() })
    }

    /// One frame until the GPU is idle, ms. Passes are kept of frames that count.
    pub fn frame(&mut self, counts: bool) -> Result<f64, AppError> {
        self.context.take_records();
        let start = Instant::now();
        self.method.frame(&self.context, &self.run.request, &self.stage, &self.film, self.watch)?;
        let ms = milliseconds(start);
        if counts {
            self.rounds.push(summarise(&measure::pass_records(self.context.take_records())));
        }
        Ok(ms)
    }

    pub fn context(&self) -> &Context {
        &self.context
    }

    /// With the times of its frames, on the device of that index whose copy moves so many bytes a millisecond.
    pub fn report(&self, frames: &[f64], device: usize, bytes_per_ms: f64) -> Result<bench_file::Subject, AppError> {
        let Run { request, variation, command, .. } = &self.run;
        Ok(bench_file::Subject {
            scene: request.scene.to_string(),
            scene_hash: request.scene.hash().to_hex().to_string(),
            method: request.method.key.to_owned(),
            variation: variation.clone(),
            command: command.clone(),
            settings: request.record()?,
            device,
            prepare_ms: self.prepare_ms,
            frame: times(frames.to_vec())?,
            passes: self.passes(bytes_per_ms)?,
            against_first: None,
        })
    }

    /// Every pass that ran in all rounds, in order of first call.
    fn passes(&self, bytes_per_ms: f64) -> Result<Vec<PassTimes>, AppError> {
        let Some(first) = self.rounds.first() else { return Ok(Vec::new()) };
        let mut passes = Vec::new();
        for Pass { path, bytes_read, bytes_written, .. } in first {
            let of_round = |passes: &Vec<Pass>| passes.iter().find(|pass| pass.path == *path).map(|pass| pass.ms.total);
            let Some(values) = self.rounds.iter().map(of_round).collect::<Option<Vec<f64>>>() else { continue };
            let times = times(values)?;
            let bytes = bytes_read + bytes_written;
            let ms = times.estimate.median;
            let bandwidth_share = if ms > 0.0 { bytes as f64 / ms / bytes_per_ms } else { 0.0 };
            passes.push(PassTimes { path: path.clone(), times, bytes, bandwidth_share });
        }
        Ok(passes)
    }
}

/// Values with their median and its interval.
fn times(values: Vec<f64>) -> Result<Times, AppError> {
    let estimate = Estimate::of(&values).ok_or_else(|| AppError::failed("nothing was measured"))?;
    Ok(Times { estimate, values })
}
