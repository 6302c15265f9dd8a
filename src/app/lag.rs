//! `linklight lag`: frames and milliseconds from a change of the lights until the picture shows it.
//!
//! A method is prepared and has rendered; then every punctual light gets another colour and strength, and frames are
//! counted until the picture is near its final state: that of a method prepared anew with the changed lights, so that
//! something left over from before is seen too.
//!
//! # Schema of the file, version 1
//!
//! `{schema: "linklight-lag", version, program, device, within, rows: [{scene, method, frames, ms, differences, command,
//! failed}]}`; `frames` and `ms` are null where the picture never came near; `differences` has one entry a frame: mean
//! absolute difference to the final picture over its mean. Fields are only added within a version.

use std::io::Write;
use std::time::Instant;

use glam::Vec3;
use serde::Serialize;

use super::cli::{Global, LagArgs};
use super::compare::plan::{Plan, Run, methods_or_all};
use super::console::{Console, Watcher};
use super::interrupt::Interrupt;
use super::measure::milliseconds;
use super::stage::Stage;
use super::{AppError, frame, measure, render};
use crate::gpu::Context;
use crate::report::image::Picture;
use crate::report::profile::Device;
use crate::report::trace::TimeLine;
use crate::report::write::{check_writable, write_text};
use crate::stages::film::Film;
use crate::stages::work::Watch;

/// What the lights' intensities are multiplied by.
const CHANGE: Vec3 = Vec3::new(0.25, 0.5, 1.5);

#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: u32,
    program: &'static str,
    device: Device,
    /// How near to its final state a picture must be, as a share of its mean.
    within: f64,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    scene: String,
    method: &'static str,
    frames: Option<u32>,
    ms: Option<f64>,
    differences: Vec<f64>,
    command: String,
    failed: Option<String>,
}

pub fn run(
    args: &LagArgs,
    global: &Global,
    console: &Console,
    interrupt: &Interrupt,
    out: &mut dyn Write,
) -> Result<(), AppError> {
    args.output.as_deref().map(check_writable).transpose()?;
    let methods = methods_or_all(&args.method);
    let plan = Plan { methods: methods.clone(), variations: &[], set: &args.set, options: &args.options, global };
    plan.check()?;
    let mut work = Vec::new();
    for scene in &args.scenes {
        for method in &methods {
            work.push(plan.run(scene, method, &[], &std::env::temp_dir().join("lag.exr"))?);
        }
    }
    let watch = Watcher::new(console, interrupt);
    let device = measure::device(render::open_device(global, false)?.info());
    let program = concat!("linklight ", env!("CARGO_PKG_VERSION"));
    let mut report =
        Report { schema: "linklight-lag", version: 1, program, device, within: args.within, rows: Vec::new() };
    writeln!(out, "{:<22} {:<22} {:>7} {:>10}  difference by frame", "scene", "method", "frames", "ms")?;
    for run in work {
        let (scene, method) = (run.request.scene.to_string(), run.request.method.key);
        let command = run.command.clone();
        let row = match watch.attempt(follow(&run, args, &watch))? {
            Ok(Lag { frames, ms, differences }) => {
                Row { scene, method, frames, ms, differences, command, failed: None }
            }
            Err(reason) => {
                Row { scene, method, frames: None, ms: None, differences: Vec::new(), command, failed: Some(reason) }
            }
        };
        row.print(out)?;
        report.rows.push(row);
        if let Some(path) = &args.output {
            write_text(path, &serde_json::to_string_pretty(&report)?)?;
        }
    }
    let failed: Vec<String> = report.rows.iter().filter_map(|row| row.complaint(args)).collect();
    if failed.is_empty() { Ok(()) } else { Err(AppError::AboveLimit(failed.join("\n"))) }
}

impl Row {
    fn print(&self, out: &mut dyn Write) -> Result<(), AppError> {
        write!(out, "{:<22} {:<22} ", self.scene, self.method)?;
        if let Some(reason) = &self.failed {
            writeln!(out, "failed: {reason}")?;
        } else {
            let frames = self.frames.map_or_else(|| "never".to_owned(), |frames| frames.to_string());
            let ms = self.ms.map_or_else(|| "-".to_owned(), |ms| format!("{ms:.1}"));
            let shown: Vec<String> = self.differences.iter().take(8).map(|d| format!("{d:.4}")).collect();
            writeln!(out, "{frames:>7} {ms:>10}  {}", shown.join(" "))?;
        }
        Ok(out.flush()?)
    }

    fn complaint(&self, args: &LagArgs) -> Option<String> {
        match (&self.failed, self.frames) {
            (Some(reason), _) => Some(format!("`{}` failed: {reason}", self.command)),
            (None, None) => {
                let (frames, within) = (args.frames, args.within);
                Some(format!("`{}` was not within {within} of its final state after {frames} frames", self.command))
            }
            _ => None,
        }
    }
}

struct Lag {
    frames: Option<u32>,
    ms: Option<f64>,
    differences: Vec<f64>,
}

fn follow(run: &Run, args: &LagArgs, watch: &dyn Watch) -> Result<Lag, AppError> {
    let request = &run.request;
    let context = render::open_device(&run.global, false)?;
    let mut stage = Stage::new(&context, request, &TimeLine::default())?;
    if stage.pose.lights.is_empty() {
        return Err(AppError::failed(
            "the scene has no punctual light that could change; take one with KHR_lights_punctual",
        ));
    }
    let film = Film::new(&context, request.width, request.height)?;
    let mut method = frame::Method::prepare(&context, request, &stage, watch)?;
    method.frame(&context, request, &stage, &film, watch)?;

    change_lights(&context, &mut stage)?;
    let mut fresh = frame::Method::prepare(&context, request, &stage, watch)?;
    let own_film = Film::new(&context, request.width, request.height)?;
    fresh.frame(&context, request, &stage, &own_film, watch)?;
    let expected = frame::picture(&context, request, &own_film)?;
    let mut lag = Lag { frames: None, ms: None, differences: Vec::new() };
    let start = Instant::now();
    for number in 0..args.frames {
        watch.step("lag", number.into(), args.frames.into())?;
        method.frame(&context, request, &stage, &film, watch)?;
        let ms = milliseconds(start);
        let difference = difference(&frame::picture(&context, request, &film)?, &expected);
        lag.differences.push(difference);
        if difference <= args.within {
            (lag.frames, lag.ms) = (Some(number + 1), Some(ms));
            break;
        }
    }
    watch.step("lag", 1, 1)?;
    render::check_validation(&context)?;
    Ok(lag)
}

/// Another colour and strength for every punctual light.
fn change_lights(context: &Context, stage: &mut Stage) -> Result<(), AppError> {
    for light in &mut stage.pose.lights {
        light.intensity *= CHANGE;
    }
    let mut recorder = context.recorder("lag")?;
    stage.world.pose(&mut recorder, &stage.pose);
    Ok(recorder.submit()?)
}

/// Mean absolute difference over the mean of the second.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let pairs = a.rgb.iter().zip(&b.rgb);
    let apart: f64 = pairs.map(|(a, b)| f64::from((*a - *b).abs().element_sum())).sum();
    let level: f64 = b.rgb.iter().map(|pixel| f64::from(pixel.element_sum())).sum();
    if level > 0.0 { apart / level } else { apart }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_shares_of_the_mean() {
        let picture = |value: f32| Picture::new(2, 1, vec![Vec3::splat(value), Vec3::ZERO]).unwrap();
        assert_eq!(difference(&picture(1.0), &picture(2.0)), 0.5);
        assert_eq!(difference(&picture(2.0), &picture(2.0)), 0.0);
        assert_eq!(difference(&picture(0.0), &picture(0.0)), 0.0);
    }
}
