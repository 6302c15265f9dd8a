//! `linklight compare SCENE... -o DIR`: methods and settings beside the reference, as a page, as data, and as a test.

pub(super) mod measured;
pub(super) mod plan;
pub(super) mod reference;

use std::io::Write;
use std::path::{Path, PathBuf};

use super::AppError;
use super::cli::{CompareArgs, Global};
use super::console::{Console, Watcher};
use super::diff::{complaint, is_above, number};
use super::interrupt::Interrupt;
use super::values::SceneSource;
use super::{frame, measure, render};
use crate::methods::{self, METHODS, Method};
use crate::report::compare_page::{
    CurvePoint, Done, MethodReport, Outcome, ReferenceReport, Report, RunReport, SCHEMA, SceneReport, VERSION, to_html,
};
use crate::report::errors::compare;
use crate::report::image::{self, Metadata, Picture};
use crate::report::tonemap::ToneSettings;
use crate::report::{heat_map, write};

pub use plan::Variation;
use plan::{Plan, REFERENCE, Run};
use reference::{Quality, Reference};

/// The means of single bounces need far less than a picture: they are averages over all pixels.
const BOUNCE_NOISE: f64 = 0.25;
const BOUNCE_SAMPLES: u32 = 64;

/// Everything one command needs.
struct Session<'a> {
    args: &'a CompareArgs,
    watch: Watcher<'a>,
    /// Radiance is shown and judged by FLIP through this.
    tone: ToneSettings,
}

pub fn run(
    args: &CompareArgs,
    global: &Global,
    console: &Console,
    interrupt: &Interrupt,
    out: &mut dyn Write,
) -> Result<(), AppError> {
    if args.reference.is_some() && args.scenes.len() > 1 {
        return Err(AppError::Usage("--reference is a picture of one scene; give one scene".into()));
    }
    let methods = match args.method.as_slice() {
        [] => METHODS.iter().filter(|method| method.key != REFERENCE).collect(),
        chosen => chosen.to_vec(),
    };
    let described = method_reports(&methods);
    let plan = Plan { methods, variations: &args.vary, set: &args.set, options: &args.options, global };
    plan.check()?;
    let folders = folders(&args.output, &args.scenes)?;
    // All usage errors before the first picture.
    let mut work = Vec::new();
    for (scene, folder) in args.scenes.iter().zip(&folders) {
        work.push((plan.reference(scene, folder)?, plan.runs(scene, folder)?));
    }
    let tone = work.first().map_or_else(ToneSettings::default, |(reference, _)| reference.request.tone);
    let session = Session { args, watch: Watcher::new(console, interrupt), tone };

    let device = measure::device(render::open_device(global, false)?.info());
    let mut report =
        Report { schema: SCHEMA, version: VERSION, program: PROGRAM, device, methods: described, scenes: Vec::new() };
    let mut complaints = Vec::new();
    for ((reference, runs), folder) in work.into_iter().zip(&folders) {
        session.scene(&reference, runs, folder, &mut report, &mut complaints)?;
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        print_table(&report, out)?;
        writeln!(out, "open {}", args.output.join("index.html").display())?;
    }
    if complaints.is_empty() { Ok(()) } else { Err(AppError::AboveLimit(complaints.join("\n"))) }
}

const PROGRAM: &str = concat!("linklight ", env!("CARGO_PKG_VERSION"));

/// Those compared and the reference, each once.
fn method_reports(compared: &[&'static Method]) -> Vec<MethodReport> {
    let mut methods: Vec<&Method> = Vec::new();
    for method in compared.iter().copied().chain(methods::find(REFERENCE)) {
        if methods.iter().all(|other| other.key != method.key) {
            methods.push(method);
        }
    }
    let describe = |method: &&Method| {
        let paper = method.paper;
        let source = format!("{}. {}. {}, {}.", paper.authors, paper.title, paper.venue, paper.year);
        MethodReport { key: method.key, summary: method.summary, source, doi: paper.doi }
    };
    methods.iter().map(describe).collect()
}

/// A folder for the pictures of each scene, made when missing: named for the scene, and numbered where two are alike.
fn folders(output: &Path, scenes: &[SceneSource]) -> Result<Vec<PathBuf>, AppError> {
    let mut names: Vec<String> = Vec::new();
    for scene in scenes {
        let text = match scene {
            SceneSource::Builtin(name) => name.clone(),
            SceneSource::File(path) => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        };
        let plain = |c: char| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '-' };
        let name: String = text.chars().map(plain).collect();
        let count = names.iter().filter(|other| other.split('.').next() == Some(&name)).count();
        names.push(if count == 0 { name } else { format!("{name}.{}", count + 1) });
    }
    let folders: Vec<PathBuf> = names.iter().map(|name| output.join(name)).collect();
    for folder in &folders {
        crate::files::create_dir_all(folder)
            .map_err(|source| write::FileError::new("make the folder", folder, source))?;
    }
    Ok(folders)
}

impl Session<'_> {
    /// One scene: its reference, then every run; the page is written anew after each.
    fn scene(
        &self,
        reference_run: &Run,
        runs: Vec<Run>,
        folder: &Path,
        report: &mut Report,
        complaints: &mut Vec<String>,
    ) -> Result<(), AppError> {
        let reference = self.reference(reference_run)?;
        if let (Some(noise), Some(samples)) = (reference.noise, reference.samples) {
            let origin = if reference.is_cached { "as kept" } else { "traced" };
            let scene = &reference_run.request.scene;
            tracing::info!("reference of {scene} {origin}: {samples} paths a pixel, noise {:.2} %", 100.0 * noise);
        }
        let picture = &reference.picture;
        let png = folder.join("reference.png");
        let tone_map = self.tone.fit(&picture.rgb);
        image::write_png(
            &png,
            picture.width,
            picture.height,
            &tone_map.to_bytes(&picture.rgb).bytes,
            &Metadata::new(),
        )?;
        let exr = self.args.reference.clone().unwrap_or_else(|| reference_run.request.output.path.clone());
        let bounce_means = self.reference_bounces(reference_run, folder, &reference)?;
        report.scenes.push(SceneReport {
            scene: reference_run.request.scene.to_string(),
            reference: ReferenceReport {
                png: self.beside(&png),
                exr: self.beside(&exr),
                command: reference.samples.map(|samples| format!("{} --spp {samples}", reference_run.command)),
                noise: reference.noise,
                samples: reference.samples,
                bounce_means,
            },
            runs: Vec::new(),
            path_tracing: self.path_tracing(reference_run, &reference)?,
        });
        self.write(report)?;
        for run in runs {
            let Some(scene) = report.scenes.last_mut() else { return Ok(()) };
            let outcome =
                match self.watch.attempt(self.run(&run, (reference_run, &reference), &scene.reference.bounce_means))? {
                    Ok(done) => {
                        let failed = self.args.fail_above.iter().filter(|limit| is_above(limit, &done.figures));
                        complaints.extend(
                            failed.map(|limit| format!("`{}`: {}", run.command, complaint(limit, &done.figures))),
                        );
                        Outcome::Done(Box::new(done))
                    }
                    Err(reason) => {
                        complaints.push(format!("`{}` failed: {reason}", run.command));
                        Outcome::Failed(reason)
                    }
                };
            let method = run.request.method.key;
            scene.runs.push(RunReport { method, variation: run.variation, command: run.command, outcome });
            self.write(report)?;
        }
        Ok(())
    }

    fn reference(&self, run: &Run) -> Result<Reference, AppError> {
        match &self.args.reference {
            Some(path) => Reference::given(path),
            None => {
                let quality = Quality { noise: self.args.noise, max_samples: self.args.reference_spp };
                Reference::path_traced(run, quality, &self.watch)
            }
        }
    }

    /// Mean radiance of the reference with 0, 1, 2 ... bounces; none of a picture that was given.
    fn reference_bounces(&self, run: &Run, folder: &Path, reference: &Reference) -> Result<Vec<f64>, AppError> {
        if self.args.reference.is_some() {
            return Ok(Vec::new());
        }
        let mut means = Vec::new();
        for bounces in 0..run.request.bounces {
            let mut fewer = run.clone();
            fewer.request.bounces = bounces;
            fewer.request.output.path = folder.join(format!("reference-{bounces}-bounces.exr"));
            let quality = Quality { noise: BOUNCE_NOISE, max_samples: BOUNCE_SAMPLES };
            let picture = Reference::path_traced(&fewer, quality, &self.watch)?.picture;
            means.push(measured::mean(&picture));
        }
        means.push(measured::mean(&reference.picture));
        Ok(means)
    }

    fn path_tracing(&self, run: &Run, reference: &Reference) -> Result<Vec<CurvePoint>, AppError> {
        let is_same_size =
            (run.request.width, run.request.height) == (reference.picture.width, reference.picture.height);
        if self.args.curve_spp == 0 || !is_same_size {
            return Ok(Vec::new());
        }
        let (samples, tone) = (self.args.curve_spp, &self.tone);
        measured::path_tracing_curve(run, &reference.picture, samples, tone, &self.watch)
    }

    /// The reference of as many bounces as `run`'s picture holds, where that is not what was asked for.
    fn own_reference(&self, run: &Run, reference_run: &Run) -> Result<Option<(Reference, u32)>, AppError> {
        let bounces = frame::bounces_held(&run.request)?;
        if self.args.reference.is_some() || bounces == reference_run.request.bounces {
            return Ok(None);
        }
        let mut own = reference_run.clone();
        own.request.bounces = bounces;
        own.request.output.path.set_file_name(format!("reference-{bounces}-bounces.exr"));
        Ok(Some((self.reference(&own)?, bounces)))
    }

    fn run(
        &self,
        run: &Run,
        (reference_run, reference): (&Run, &Reference),
        reference_means: &[f64],
    ) -> Result<Done, AppError> {
        let own = self.own_reference(run, reference_run)?;
        let measured = measured::measure(run, self.args.frames, own.is_none(), &self.watch)?;
        let held_to = own.as_ref().map_or(reference, |(own, _)| own);
        let comparison = compare(&measured.picture, &held_to.picture, None, &self.tone)?;
        let exr = &run.request.output.path;
        image::write_exr(exr, &measured.picture)?;
        let Picture { width, height, rgb, .. } = &measured.picture;
        let write = |name: &str, bytes: &[u8]| -> Result<String, AppError> {
            let path = exr.with_extension(name);
            image::write_png(&path, *width, *height, bytes, &Metadata::new())?;
            Ok(self.beside(&path))
        };
        Ok(Done {
            png: write("png", &self.tone.fit(&reference.picture.rgb).to_bytes(rgb).bytes)?,
            flip: write("flip.png", &heat_map::to_bytes(&comparison.flip_map))?,
            relative: write("relative.png", &heat_map::to_bytes(&comparison.relative_map))?,
            exr: self.beside(exr),
            figures: comparison.figures,
            bounce_energy: if own.is_none() {
                bounce_energy(&measured.bounce_means, reference_means)
            } else {
                Vec::new()
            },
            bounces_held: own.map(|(_, bounces)| bounces),
            cost: measured.cost,
        })
    }

    /// As the page names a file: relative to itself where it lies in its folder.
    fn beside(&self, path: &Path) -> String {
        path.strip_prefix(&self.args.output).unwrap_or(path).to_string_lossy().replace('\\', "/")
    }

    fn write(&self, report: &Report) -> Result<(), AppError> {
        write::write_text(&self.args.output.join("compare.json"), &serde_json::to_string_pretty(report)?)?;
        Ok(write::write_text(&self.args.output.join("index.html"), &to_html(report))?)
    }
}

/// Energy of each bounce alone, picture over reference; `None` where the reference has none.
fn bounce_energy(means: &[f64], reference: &[f64]) -> Vec<Option<f64>> {
    let alone = |means: &[f64], bounce: usize| means[bounce] - if bounce == 0 { 0.0 } else { means[bounce - 1] };
    let count = means.len().min(reference.len());
    let ratio = |bounce: usize| {
        let wanted = alone(reference, bounce);
        (wanted > 0.0).then(|| alone(means, bounce) / wanted)
    };
    (0..count).map(ratio).collect()
}

fn print_table(report: &Report, out: &mut dyn Write) -> Result<(), AppError> {
    let line = ["scene", "method", "relmse", "energy", "flip", "prepare ms", "frame ms", "MiB", "variation"];
    let [scene, method, relmse, energy, flip, prepare, frame, memory, variation] = line;
    writeln!(
        out,
        "{scene:<22} {method:<20} {relmse:>10} {energy:>8} {flip:>8} {prepare:>10} {frame:>10} {memory:>8}  {variation}"
    )?;
    for scene in &report.scenes {
        for run in &scene.runs {
            write!(out, "{:<22} {:<20} ", scene.scene, run.method)?;
            match &run.outcome {
                Outcome::Done(done) => {
                    let (figures, cost) = (&done.figures, &done.cost);
                    write!(out, "{:>10} ", number(figures.relative_mse))?;
                    write!(out, "{:>8.8} {:>8.4} ", number(figures.mean_ratio), figures.flip_mean)?;
                    let memory = cost.peak_bytes as f64 / f64::from(1 << 20);
                    write!(out, "{:>10.1} {:>10.1} {memory:>8.1}", cost.prepare_ms, cost.frame_ms.median)?;
                }
                Outcome::Failed(reason) => write!(out, "failed: {reason}")?,
            }
            write!(out, "  {}", run.variation)?;
            if let Outcome::Done(done) = &run.outcome
                && let Some(bounces) = done.bounces_held
            {
                write!(out, " (against {bounces} bounces, as many as it holds)")?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounces_are_told_apart() {
        let ratios = bounce_energy(&[1.0, 1.9, 2.3], &[1.0, 2.0, 2.5]);
        let expected = [1.0, 0.9, 0.8];
        assert!(ratios.iter().zip(expected).all(|(ratio, wanted)| (ratio.unwrap() - wanted).abs() < 1e-12));
        assert_eq!(bounce_energy(&[1.0, 2.0], &[1.0, 1.0])[1], None);
        assert!(bounce_energy(&[1.0], &[]).is_empty());
    }

    #[test]
    fn scenes_of_one_name_get_folders_of_their_own() {
        let output = tempfile::tempdir().unwrap();
        let scenes = ["a/x.glb", "b/x.gltf", "builtin:gallery?triangles=20000"].map(|text| text.parse().unwrap());
        let folders = folders(output.path(), &scenes).unwrap();
        let names: Vec<_> = folders.iter().map(|folder| folder.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(names, ["x", "x.2", "gallery-triangles-20000"]);
        assert!(folders.iter().all(|folder| folder.is_dir()));
    }
}
