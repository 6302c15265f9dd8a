//! `linklight leak`: how much light each method lets through a closed wall, by the wall's thickness.
//!
//! Two closed rooms ([`crate::scene::builtin::ClosedRooms`]), one of them lit, are seen by cameras that mirror each other.
//! The leak is the mean of the dark room's picture over the mean of the lit one's: 0 is right, whatever the wall.
//!
//! # Schema of the file, version 1
//!
//! `{schema: "linklight-leak", version, program, device, rows: [{method, sides, wall_mm, leak, lit, dark, command, failed}]}`;
//! `lit` and `dark` are mean radiances, W m^-2 sr^-1; fields are only added within a version.

use std::io::Write;

use serde::Serialize;

use super::cli::{Global, LeakArgs, WallSides};
use super::compare::measured::mean;
use super::compare::plan::{Plan, Run, methods_or_all};
use super::console::{Console, Watcher};
use super::interrupt::Interrupt;
use super::stage::Stage;
use super::values::SceneSource;
use super::{AppError, frame, measure, render};
use crate::report::profile::Device;
use crate::report::trace::TimeLine;
use crate::report::write::{check_writable, write_text};
use crate::scene::camera::View;
use crate::stages::film::Film;
use crate::stages::work::Watch;

#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: u32,
    program: &'static str,
    device: Device,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    method: &'static str,
    sides: WallSides,
    wall_mm: u32,
    /// `None` where the lit room is black too, or the method failed.
    leak: Option<f64>,
    lit: f64,
    dark: f64,
    command: String,
    failed: Option<String>,
}

pub fn run(
    args: &LeakArgs,
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
    for method in methods {
        for &sides in &args.sides {
            for &wall in &args.walls {
                let text = if sides == WallSides::Two { "two" } else { "one" };
                let scene: SceneSource = format!("builtin:closed-rooms?wall={wall}&sides={text}")
                    .parse()
                    .map_err(|message: String| AppError::failed(message))?;
                let picture = std::env::temp_dir().join("leak.exr");
                work.push((sides, wall, plan.run(&scene, method, &[], &picture)?));
            }
        }
    }
    let watch = Watcher::new(console, interrupt);
    let device = measure::device(render::open_device(global, false)?.info());
    let program = concat!("linklight ", env!("CARGO_PKG_VERSION"));
    let mut report = Report { schema: "linklight-leak", version: 1, program, device, rows: Vec::new() };
    writeln!(out, "{:<22} {:<5} {:>7} {:>11} {:>11} {:>11}", "method", "sides", "wall mm", "leak", "lit", "dark")?;
    for (sides, wall_mm, run) in work {
        let method = run.request.method.key;
        let command = run.command.clone();
        let (lit, dark, failed) = match watch.attempt(means(&run, &watch))? {
            Ok([lit, dark]) => (lit, dark, None),
            Err(reason) => (0.0, 0.0, Some(reason)),
        };
        let leak = (failed.is_none() && lit > 0.0).then(|| dark / lit);
        let row = Row { method, sides, wall_mm, leak, lit, dark, command, failed };
        row.print(out)?;
        report.rows.push(row);
        if let Some(path) = &args.output {
            write_text(path, &serde_json::to_string_pretty(&report)?)?;
        }
    }
    let limit = args.fail_above.unwrap_or(f64::INFINITY);
    let complaints: Vec<String> = report.rows.iter().filter_map(|row| row.complaint(limit)).collect();
    if complaints.is_empty() { Ok(()) } else { Err(AppError::AboveLimit(complaints.join("\n"))) }
}

impl Row {
    fn print(&self, out: &mut dyn Write) -> Result<(), AppError> {
        let sides = if self.sides == WallSides::Two { "two" } else { "one" };
        write!(out, "{:<22} {sides:<5} {:>7} ", self.method, self.wall_mm)?;
        match (&self.failed, self.leak) {
            (Some(reason), _) => writeln!(out, "failed: {reason}")?,
            (None, Some(leak)) => writeln!(out, "{leak:>11.3e} {:>11.4} {:>11.3e}", self.lit, self.dark)?,
            (None, None) => writeln!(out, "the lit room is black")?,
        }
        Ok(out.flush()?)
    }

    fn complaint(&self, limit: f64) -> Option<String> {
        let place = format!("`{}`", self.command);
        match (&self.failed, self.leak) {
            (Some(reason), _) => Some(format!("{place} failed: {reason}")),
            (None, Some(leak)) if leak > limit => {
                Some(format!("{place}: {leak:.3e} of the light comes through, {limit} is allowed"))
            }
            _ => None,
        }
    }
}

/// Mean radiance of the lit and of the dark room, from one preparation.
fn means(run: &Run, watch: &dyn Watch) -> Result<[f64; 2], AppError> {
    let request = &run.request;
    let context = render::open_device(&run.global, false)?;
    let mut stage = Stage::new(&context, request, &TimeLine::default())?;
    let film = Film::new(&context, request.width, request.height)?;
    let mut method = frame::Method::prepare(&context, request, &stage, watch)?;
    let mut means = [0.0; 2];
    for (mean_of, camera) in means.iter_mut().zip(["lit", "main"]) {
        let size = glam::UVec2::new(request.width, request.height);
        let view = View::of_scene(&stage.scene, &stage.pose, Some(camera), Some(stage.bounds), size);
        stage.view = view.map_err(AppError::failed)?;
        if run.request.method.key == "path-tracing" {
            // Paths gather until they are told of something new.
            method = frame::Method::prepare(&context, request, &stage, watch)?;
        }
        method.frame(&context, request, &stage, &film, watch)?;
        *mean_of = mean(&frame::picture(&context, request, &film)?);
    }
    render::check_validation(&context)?;
    Ok(means)
}
