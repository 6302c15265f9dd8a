//! `linklight bench SCENE... -o FILE.json`: how long frames and passes take, measured in turns, with confidence.

mod against;
mod rounds;
mod subject;
pub(in crate::app) mod yardsticks;

use std::io::Write;
use std::time::Instant;

use super::AppError;
use super::cli::{BenchArgs, Global};
use super::compare::plan::{Plan, Run, methods_or_all};
use super::console::{Console, Watcher};
use super::interrupt::Interrupt;
use crate::report::bench_file::{BenchFile, Comparison, SCHEMA, VERSION, WarmUp};
use crate::report::statistics::{Verdict, median, paired};
use crate::report::write::check_writable;
use rounds::{Limits, MIN_ROUNDS, Rounds};
use subject::Subject;
use yardsticks::Yardsticks;

/// What changes a driver's work without being an option of ours: any variable with such a beginning.
const ENVIRONMENT: [&str; 9] =
    ["VK_", "MESA_", "LP_", "GALLIUM_", "LLVMPIPE_", "RADV_", "ANV_", "NVK_", "RAYON_NUM_THREADS"];

pub fn run(
    args: &BenchArgs,
    global: &Global,
    console: &Console,
    interrupt: &Interrupt,
    out: &mut dyn Write,
) -> Result<(), AppError> {
    let old = args.against.as_deref().map(BenchFile::read).transpose().map_err(AppError::failed)?;
    let new = match (&args.read, &args.output) {
        (Some(path), _) => BenchFile::read(path).map_err(AppError::failed)?,
        (None, Some(output)) => {
            check_writable(output)?;
            let watch = Watcher::new(console, interrupt);
            let file = measure(runs(args, global)?, args, &watch)?;
            file.write(output).map_err(AppError::failed)?;
            print(&file, out)?;
            file
        }
        (None, None) => return Err(AppError::Usage("give scenes and -o FILE.json, or --read FILE.json".into())),
    };
    let Some(old) = old else { return Ok(()) };
    let changes = against::changes(&old, &new)?;
    against::print(&changes, out)?;
    let slower: Vec<&str> =
        changes.iter().filter(|change| change.verdict == Verdict::Slower).map(|change| change.what.as_str()).collect();
    if args.fail_slower && !slower.is_empty() {
        return Err(AppError::AboveLimit(format!("slower than before: {}", slower.join("; "))));
    }
    Ok(())
}

/// Every scene by every method and variation; the first one is what the others are held against.
fn runs(args: &BenchArgs, global: &Global) -> Result<Vec<Run>, AppError> {
    let methods = methods_or_all(&args.method);
    let plan = Plan { methods, variations: &args.vary, set: &args.set, options: &args.options, global };
    plan.check()?;
    let folder = std::env::temp_dir();
    let mut runs = Vec::new();
    for scene in &args.scenes {
        runs.extend(plan.runs(scene, &folder)?);
    }
    Ok(runs)
}

fn measure(runs: Vec<Run>, args: &BenchArgs, watch: &Watcher<'_>) -> Result<BenchFile, AppError> {
    let mut subjects = Vec::new();
    for run in runs {
        subjects.push(Subject::prepare(run, watch)?);
    }
    // One set of yardsticks for each device among the subjects.
    let mut devices: Vec<usize> = Vec::new();
    let mut owners: Vec<usize> = Vec::new();
    for (index, subject) in subjects.iter().enumerate() {
        let info = subject.context().info();
        let is_same = |owner: &usize| subjects[*owner].context().info().index == info.index;
        let device = owners.iter().position(is_same).unwrap_or_else(|| {
            owners.push(index);
            owners.len() - 1
        });
        devices.push(device);
    }
    let mut yardsticks = Vec::new();
    for owner in &owners {
        yardsticks.push(Yardsticks::new(subjects[*owner].context())?);
    }

    let limits = Limits { precision: args.precision, seconds: args.seconds };
    let clock = Instant::now();
    let rounds = rounds::run(
        subjects.len(),
        limits,
        || clock.elapsed().as_secs_f64(),
        |subject, counts| {
            // The yardsticks of a device beside the first of its subjects.
            if let Some(device) = owners.iter().position(|owner| *owner == subject) {
                yardsticks[device].round(subjects[subject].context(), counts)?;
            }
            crate::stages::work::Watch::step(watch, "rounds", 0, 1)?;
            subjects[subject].frame(counts)
        },
    )?;
    let yardsticks: Vec<_> = yardsticks.into_iter().map(Yardsticks::finish).collect();
    let mut reports = Vec::new();
    for ((subject, frames), &device) in subjects.iter().zip(&rounds.times).zip(&devices) {
        let yardstick = &yardsticks[device];
        let copy_ms = median(&yardstick.copy_ms).unwrap_or(f64::INFINITY);
        reports.push(subject.report(frames, device, yardstick.copy_bytes as f64 / copy_ms)?);
    }
    if let Some((first, others)) = rounds.times.split_first() {
        for (report, frames) in reports.iter_mut().skip(1).zip(others) {
            report.against_first = paired(first, frames).map(Comparison::from);
        }
    }
    warn_of_noise(&rounds, args);
    Ok(BenchFile {
        schema: SCHEMA.to_owned(),
        version: VERSION,
        program: concat!("linklight ", env!("CARGO_PKG_VERSION")).to_owned(),
        environment: std::env::vars().filter(|(name, _)| ENVIRONMENT.iter().any(|e| name.starts_with(e))).collect(),
        rounds: rounds.times.first().map_or(0, Vec::len) as u32,
        warm_up: WarmUp { rounds: rounds.warm_up_rounds as u32, drift: rounds.drift, settled: rounds.settled },
        yardsticks,
        subjects: reports,
    })
}

fn warn_of_noise(rounds: &Rounds, args: &BenchArgs) {
    if !rounds.settled {
        tracing::warn!(
            "times never settled: after {} rounds of warming up medians still differed by {:.1} %; something else uses this machine",
            rounds.warm_up_rounds,
            100.0 * rounds.drift
        );
    }
    if !rounds.precise {
        let count = rounds.times.first().map_or(0, Vec::len);
        tracing::warn!(
            "after {:.0} s and {count} rounds ratios are not known to {:.1} %; give more --seconds (at least {MIN_ROUNDS} rounds are measured)",
            args.seconds,
            100.0 * args.precision
        );
    }
}

fn print(file: &BenchFile, out: &mut dyn Write) -> Result<(), AppError> {
    writeln!(out, "{} rounds after {} of warming up", file.rounds, file.warm_up.rounds)?;
    for yardstick in &file.yardsticks {
        let rate = |amount: u64, ms: &[f64]| median(ms).map_or(0.0, |ms| amount as f64 / ms * 1e-6);
        writeln!(
            out,
            "{}: copies {:.1} GB/s, multiply-adds {:.1} Gflop/s, an empty dispatch {:.3} ms, the loop on the CPU {:.3} ms",
            yardstick.device.name,
            rate(yardstick.copy_bytes, &yardstick.copy_ms),
            rate(yardstick.multiply_add_flops, &yardstick.multiply_add_ms),
            median(&yardstick.empty_ms).unwrap_or(0.0),
            median(&yardstick.cpu_ms).unwrap_or(0.0)
        )?;
    }
    for subject in &file.subjects {
        let estimate = &subject.frame.estimate;
        let name = format!("{} {} {}", subject.scene, subject.method, subject.variation);
        write!(
            out,
            "{:10.3} ms ({:.3} to {:.3}), prepared in {:.0} ms  {}",
            estimate.median,
            estimate.low,
            estimate.high,
            subject.prepare_ms,
            name.trim_end()
        )?;
        if let Some(Comparison { shift, verdict }) = subject.against_first {
            let word = match verdict {
                Verdict::Slower => "slower than the first",
                Verdict::Faster => "faster than the first",
                Verdict::NotShown => "no difference to the first shown",
            };
            write!(out, ": x{:.3} ({:.3} to {:.3}), {word}", shift.ratio, shift.low, shift.high)?;
        }
        writeln!(out)?;
    }
    Ok(())
}
