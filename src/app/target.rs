//! `--target-error`: settings, and with `--method auto` the method, picked by pilot runs.
//!
//! Pilots render a small picture by the coarsest steps of each method's ladder and are held to a path-traced reference of
//! that size. Error and time follow a power law along the ladder; the first step that promises the error is taken, of
//! several methods the fastest. Before the picture is rendered, the step taken is held to the reference itself: where it
//! misses, the next finer one is tried.

use super::AppError;
use super::cli::{Display, Global};
use super::compare::measured::{Measured, measure};
use super::compare::plan::Run;
use super::compare::reference::{Quality, Reference};
use super::render::{RenderRequest, displays};
use super::values::{Format, Output};
use crate::methods::settings::{Assignment, SettingError};
use crate::methods::{METHODS, Method, find};
use crate::report::errors::compare;
use crate::report::tonemap::ToneSettings;
use crate::stages::work::Watch;

/// What the user asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Relative MSE.
    pub error: f64,
    /// Any method will do.
    pub any_method: bool,
}

/// Pixels of a pilot, about.
const PILOT_PIXELS: u32 = 9_600;
/// Places within a pixel of display stages that take little for each: the error must not be that of the lamps' edges.
const EDGE_SAMPLES: u32 = 32;
/// Steps of a ladder that are tried at first.
const PILOTS: usize = 3;
/// Of the target: the error of the reference itself.
const REFERENCE_SHARE: f64 = 0.1;
const REFERENCE_SAMPLES: u32 = 4096;

/// One step of a method's ladder, coarse to fine: each is about twice the work of the one before.
#[derive(Debug, Clone, PartialEq)]
struct Step {
    elements: Option<u32>,
    spp: Option<u32>,
    settings: Vec<(&'static str, &'static str)>,
}

/// What error and time a step promises, or had.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Promise {
    /// Relative MSE.
    pub error: f64,
    /// Preparation and one frame of the full picture, ms.
    pub ms: f64,
}

/// A request with its settings picked.
pub struct Picked {
    pub request: RenderRequest,
    pub predicted: Promise,
    /// Of a pilot by the same settings; its time is scaled to the full picture.
    pub achieved: Promise,
    /// What was picked, in words.
    pub words: String,
}

fn step(elements: u32, settings: &[(&'static str, &'static str)]) -> Step {
    Step { elements: Some(elements), spp: None, settings: settings.to_vec() }
}

fn setting(name: &'static str, value: &'static str) -> Step {
    Step { elements: None, spp: None, settings: vec![(name, value)] }
}

/// The ladder of a method.
fn ladder(method: &Method) -> Vec<Step> {
    match method.key {
        "explicit-visibility" => [2_500, 5_000, 10_000, 20_000, 40_000, 80_000, 160_000].map(|n| step(n, &[])).to_vec(),
        "implicit-visibility" => vec![
            step(1_500, &[("bins", "8")]),
            step(3_000, &[("bins", "8")]),
            step(3_000, &[("bins", "12")]),
            step(6_000, &[("bins", "12")]),
            step(6_000, &[("bins", "16")]),
            step(12_000, &[("bins", "16")]),
            step(24_000, &[("bins", "16")]),
        ],
        "antiradiance" => vec![
            step(1_500, &[("bins", "128")]),
            step(3_000, &[("bins", "128")]),
            step(3_000, &[("bins", "200")]),
            step(6_000, &[("bins", "200")]),
            step(6_000, &[("bins", "512")]),
            step(12_000, &[("bins", "512")]),
            step(24_000, &[("bins", "512")]),
        ],
        "surface-shadow-maps" => {
            ["32", "48", "64", "96", "128", "192", "256"].map(|side| setting("atlas_resolution", side)).to_vec()
        }
        "face-cluster" => ["0.001", "0.0003", "0.0001", "0.00003", "0.00001", "0.000003", "0.000001"]
            .map(|threshold| setting("threshold", threshold))
            .to_vec(),
        _ => (2..13).map(|power| Step { elements: None, spp: Some(1 << power), settings: Vec::new() }).collect(),
    }
}

impl Step {
    fn apply(&self, request: &RenderRequest) -> Result<RenderRequest, SettingError> {
        let mut picked = request.clone();
        picked.elements = self.elements.or(picked.elements);
        picked.spp = self.spp.unwrap_or(picked.spp);
        for (name, value) in &self.settings {
            picked.assignments.retain(|assignment| assignment.key != *name);
            picked.assignments.push(Assignment { key: (*name).to_owned(), value: (*value).to_owned() });
        }
        picked.method.record(&picked.assignments)?;
        Ok(picked)
    }

    fn words(&self, method: &Method) -> String {
        let mut words = vec![format!("--method {}", method.key)];
        words.extend(self.elements.map(|n| format!("--elements {n}")));
        words.extend(self.spp.map(|n| format!("--spp {n}")));
        words.extend(self.settings.iter().map(|(name, value)| format!("--set {name}={value}")));
        words.join(" ")
    }
}

/// A straight line through (step, logarithm) points, by least squares; never rising where errors are meant to fall.
fn power_law(values: &[f64]) -> impl Fn(usize) -> f64 {
    let logs: Vec<f64> = values.iter().map(|value| value.max(1e-12).ln()).collect();
    let count = logs.len() as f64;
    let mean_at = (count - 1.0) / 2.0;
    let mean = logs.iter().sum::<f64>() / count;
    let spread: f64 = (0..logs.len()).map(|at| (at as f64 - mean_at).powi(2)).sum();
    let along: f64 = logs.iter().enumerate().map(|(at, log)| (at as f64 - mean_at) * (log - mean)).sum();
    let slope = if spread > 0.0 { along / spread } else { 0.0 };
    move |step: usize| (mean + slope * (step as f64 - mean_at)).exp()
}

/// The first step that promises the error, and what it promises; of a ladder that never does, the best.
fn choose(errors: &[f64], times: &[f64], steps: usize, target: f64) -> (usize, Promise) {
    let (error, time) = (power_law(errors), power_law(times));
    // Steps that were tried are known, the others follow the law; a law that does not fall promises nothing new.
    let best = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let error_at = |step: usize| errors.get(step).copied().unwrap_or_else(|| error(step).min(best));
    let time_at = |step: usize| times.get(step).copied().unwrap_or_else(|| time(step));
    let picked = (0..steps)
        .find(|&step| error_at(step) <= target)
        .or_else(|| (0..steps).min_by(|&a, &b| error_at(a).total_cmp(&error_at(b))))
        .unwrap_or(0);
    (picked, Promise { error: error_at(picked), ms: time_at(picked) })
}

/// Picks by pilots; says what it does as it goes.
pub fn pick(
    request: &RenderRequest,
    target: Target,
    global: &Global,
    watch: &dyn Watch,
    say: &mut dyn FnMut(String) -> Result<(), AppError>,
) -> Result<Picked, AppError> {
    let pilots = Pilots::new(request, target, global, watch)?;
    let methods: Vec<&'static Method> = if target.any_method { METHODS.iter().collect() } else { vec![request.method] };
    let mut best: Option<(&'static Method, usize, Promise)> = None;
    for method in methods {
        let Some(base) = pilots.by(method) else { continue };
        let steps = ladder(method);
        let (mut errors, mut times) = (Vec::new(), Vec::new());
        for step in steps.iter().take(PILOTS) {
            match pilots.run(&step.apply(&base)?) {
                Ok(had) => {
                    say(format!("pilot {}: relative MSE {:.4}, {:.0} ms", step.words(method), had.error, had.ms))?;
                    errors.push(had.error);
                    times.push(had.ms);
                    if had.error <= target.error {
                        break;
                    }
                }
                Err(error @ (AppError::Interrupted(_) | AppError::NoGpu(_))) => return Err(error),
                Err(error) if target.any_method => {
                    say(format!("pilot {}: {error}", step.words(method)))?;
                    break;
                }
                Err(error) => return Err(error),
            }
        }
        if errors.is_empty() {
            continue;
        }
        let (picked, promise) = choose(&errors, &times, steps.len(), target.error);
        let words = steps[picked].words(method);
        say(format!("{words} promises relative MSE {:.4} in {:.0} ms", promise.error, promise.ms))?;
        let reaches = |promise: &Promise| promise.error <= target.error;
        let is_better = best.as_ref().is_none_or(|(_, _, known)| match (reaches(&promise), reaches(known)) {
            (true, true) => promise.ms < known.ms,
            (false, false) => promise.error < known.error,
            (now, _) => now,
        });
        if is_better {
            best = Some((method, picked, promise));
        }
    }
    let Some((method, mut at, predicted)) = best else {
        return Err(AppError::failed("no method could render a pilot of this scene"));
    };
    let steps = ladder(method);
    let Some(base) = pilots.by(method) else { return Err(AppError::failed("the method picked cannot be used")) };
    loop {
        let achieved = pilots.run(&steps[at].apply(&base)?)?;
        let words = steps[at].words(method);
        if achieved.error <= target.error || at + 1 == steps.len() {
            if achieved.error > target.error {
                say(format!("no step of {} reaches {}: {words} comes nearest", method.key, target.error))?;
            }
            let full = RenderRequest { method, display: base.display, ..request.clone() };
            let full = RenderRequest { assignments: base.assignments.clone(), spp: base.spp, ..full };
            return Ok(Picked { request: steps[at].apply(&full)?, predicted, achieved, words });
        }
        say(format!("{words} has relative MSE {:.4}: the next step is tried", achieved.error))?;
        at += 1;
    }
}

/// Small pictures of one scene beside their reference.
struct Pilots<'a> {
    request: RenderRequest,
    global: &'a Global,
    watch: &'a dyn Watch,
    reference: Reference,
    /// Pixels of the full picture over those of a pilot.
    pixels: f64,
    any_method: bool,
}

impl<'a> Pilots<'a> {
    fn new(full: &RenderRequest, target: Target, global: &'a Global, watch: &'a dyn Watch) -> Result<Self, AppError> {
        let pixels = f64::from(full.width) * f64::from(full.height);
        let shrink = (pixels / f64::from(PILOT_PIXELS)).sqrt().max(1.0);
        let side = |side: u32| ((f64::from(side) / shrink).round() as u32).max(1);
        let folder = tempfile::tempdir().map_err(AppError::failed)?;
        let output = Output { path: folder.path().join("pilot.exr"), format: Format::Exr };
        let request = RenderRequest {
            width: side(full.width),
            height: side(full.height),
            output,
            frames: 1,
            channels: Vec::new(),
            lightmap: None,
            profile: None,
            trace: None,
            capture: None,
            hashes: None,
            target: None,
            ..full.clone()
        };
        let Some(path_tracing) = find("path-tracing") else {
            return Err(AppError::failed("the reference is no method"));
        };
        let traced = RenderRequest {
            method: path_tracing,
            display: None,
            elements: None,
            assignments: Vec::new(),
            display_assignments: Vec::new(),
            // Apart from what a pilot of paths draws.
            seed: full.seed.wrapping_add(0x5eed),
            ..request.clone()
        };
        let run = Run { request: traced, variation: String::new(), command: String::new(), global: global.clone() };
        let quality = Quality { noise: (REFERENCE_SHARE * target.error).sqrt(), max_samples: REFERENCE_SAMPLES };
        let reference = Reference::path_traced(&run, quality, watch)?;
        let pixels = pixels / (f64::from(request.width) * f64::from(request.height));
        Ok(Self { request, global, watch, reference, pixels, any_method: target.any_method })
    }

    /// The request of a pilot by a method; `None` for one that the request's own options rule out.
    fn by(&self, method: &'static Method) -> Option<RenderRequest> {
        let mut request = self.request.clone();
        if method.key != self.request.method.key {
            if !self.any_method {
                return None;
            }
            let (display, assignments) = (displays(method).first().copied(), Vec::new());
            request = RenderRequest { method, display, assignments, ..request };
        }
        if !matches!(request.display, None | Some(Display::FinalGather)) {
            request.spp = EDGE_SAMPLES;
        }
        Some(request)
    }

    fn run(&self, request: &RenderRequest) -> Result<Promise, AppError> {
        let (request, global) = (request.clone(), self.global.clone());
        let run = Run { request, variation: String::new(), command: String::new(), global };
        let Measured { picture, cost, .. } = measure(&run, 1, false, self.watch)?;
        let figures = compare(&picture, &self.reference.picture, None, &ToneSettings::default())?.figures;
        let Some(error) = figures.relative_mse else {
            return Err(AppError::failed("the reference is black: there is no error to aim at"));
        };
        // Of the frame, what is done per pixel grows with the picture.
        let of_pixels = |path: &str| path.contains("display") || path.contains("path-tracing");
        let all: f64 = cost.passes.iter().map(|pass| pass.ms.total).sum();
        let shown: f64 = cost.passes.iter().filter(|pass| of_pixels(&pass.path)).map(|pass| pass.ms.total).sum();
        let share = if all > 0.0 { shown / all } else { 0.0 };
        let ms = cost.prepare_ms + cost.frame_ms.median * (1.0 - share + share * self.pixels);
        Ok(Promise { error, ms })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_pass_through_what_was_measured() {
        let law = power_law(&[0.4, 0.2, 0.1]);
        assert!((law(1) - 0.2).abs() < 1e-12 && (law(4) - 0.025).abs() < 1e-12);
        let flat = power_law(&[0.3]);
        assert!((flat(5) - 0.3).abs() < 1e-12);
    }

    #[test]
    fn the_first_step_that_promises_the_error_is_taken() {
        let (step, promise) = choose(&[0.4, 0.2, 0.1], &[10.0, 20.0, 40.0], 7, 0.03);
        assert_eq!(step, 4);
        assert!((promise.error - 0.025).abs() < 1e-9 && (promise.ms - 160.0).abs() < 1e-6);
        assert_eq!(choose(&[0.4, 0.01], &[1.0, 2.0], 7, 0.02).0, 1, "one that was tried");
        assert_eq!(choose(&[0.1, 0.1, 0.1], &[1.0, 2.0, 4.0], 7, 0.02).0, 0, "nothing promises more");
    }

    #[test]
    fn every_ladder_is_understood_by_its_method() {
        for method in METHODS {
            let steps = ladder(method);
            assert!(steps.len() >= 2 * PILOTS, "{}", method.key);
            for step in steps {
                let of_method: Vec<Assignment> = step
                    .settings
                    .iter()
                    .map(|(name, value)| Assignment { key: (*name).into(), value: (*value).into() })
                    .collect();
                method.record(&of_method).unwrap_or_else(|error| panic!("{}: {error}", step.words(method)));
            }
        }
    }
}
