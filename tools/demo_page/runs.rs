//! Runs `linklight` and reads what it wrote: pictures, profiles, error figures.
//!
//! A run that fails gives the program's own message; nothing here stops the page.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use linklight::report::image::{self, Metadata, Picture};
use linklight::report::profile::Profile;
use linklight::report::tonemap::{ToneMap, ToneSettings};
use serde_json::Value;

/// A scene of the page.
#[derive(Debug, Clone, Copy)]
pub struct Subject {
    pub name: &'static str,
    /// What stands after `builtin:`: the name, or the name with parameters.
    pub source: &'static str,
}

/// What all pictures of a page share.
#[derive(Debug, Clone)]
pub struct Quality {
    /// `WxH`, pixels.
    pub size: String,
    /// Samples per pixel of the reference.
    pub spp: u32,
    /// Tessellation target of the methods that solve on elements.
    pub elements: u32,
    pub bounces: u32,
}

/// A row of `linklight methods --json`.
#[derive(Debug, Clone)]
pub struct Method {
    pub key: String,
    pub summary: String,
    /// Authors and year.
    pub source: String,
    pub doi: Option<String>,
}

/// One finished picture.
#[derive(Debug, Clone)]
pub struct Run {
    /// File beside the page.
    pub picture: String,
    /// Linear radiance, beside the page too.
    pub radiance: String,
    /// From start to exit of the program.
    pub seconds: f64,
    pub profile: Profile,
    /// How radiance became the picture; the same for a reference and all that are compared with it.
    tone: ToneMap,
}

/// A picture held to the reference.
#[derive(Debug, Clone)]
pub struct Difference {
    /// File beside the page.
    pub picture: String,
    /// Relative mean square error; `None` where it is undefined.
    pub relative_mse: Option<f64>,
    /// Energy of the picture over energy of the reference.
    pub energy: Option<f64>,
    /// Mean FLIP error, 0..1.
    pub flip: Option<f64>,
}

/// A method's picture and, where there is a reference, its difference from it.
#[derive(Debug, Clone)]
pub struct Compared {
    pub run: Run,
    pub difference: Option<Difference>,
}

/// The program and where its files go.
pub struct Linklight<'a> {
    program: PathBuf,
    folder: &'a Path,
    quality: Quality,
}

impl<'a> Linklight<'a> {
    pub fn new(program: &Path, folder: &'a Path, quality: Quality) -> Result<Self, String> {
        let program = program.canonicalize().map_err(|error| {
            format!("cannot run {}: {error}; build it with `cargo build --release`", program.display())
        })?;
        std::fs::create_dir_all(folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))?;
        Ok(Self { program, folder, quality })
    }

    /// Every method there is.
    pub fn methods(&self) -> Result<Vec<Method>, String> {
        let listing: Value = serde_json::from_slice(&self.run(&["methods", "--json"])?)
            .map_err(|error| format!("`linklight methods --json` printed no JSON: {error}"))?;
        let rows = listing["methods"].as_array().ok_or("`linklight methods --json` lists no methods")?;
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        Ok(rows
            .iter()
            .map(|row| Method {
                key: text(&row["key"]),
                summary: text(&row["summary"]),
                source: format!("{}, {}", text(&row["paper"]["authors"]), row["paper"]["year"]),
                doi: row["paper"]["doi"].as_str().map(str::to_owned),
            })
            .collect())
    }

    /// The picture that the others are held to.
    pub fn reference(&self, scene: Subject, method: &str) -> Result<Run, String> {
        self.render(scene, method, &["--spp", &self.quality.spp.to_string()], None)
    }

    /// A method's picture, under the tone curve of the reference.
    pub fn compared(&self, scene: Subject, method: &str, reference: Option<&Run>) -> Result<Compared, String> {
        let run = self.render(
            scene,
            method,
            &["--elements", &self.quality.elements.to_string()],
            reference.map(|reference| reference.tone),
        )?;
        let difference = reference.map(|reference| self.difference(&run, reference)).transpose()?;
        Ok(Compared { run, difference })
    }

    fn render(&self, scene: Subject, method: &str, extra: &[&str], tone: Option<ToneMap>) -> Result<Run, String> {
        let stem = format!("{}.{method}", scene.name);
        let [radiance, picture, profile] = ["exr", "png", "profile.json"].map(|kind| format!("{stem}.{kind}"));
        let start = Instant::now();
        let source = format!("builtin:{}", scene.source);
        let bounces = self.quality.bounces.to_string();
        let mut arguments = vec!["render", &source, "-o", &radiance, "--profile", &profile, "--method", method];
        arguments.extend(["--size", &self.quality.size, "--bounces", &bounces, "--diffuse", "--quiet"]);
        arguments.extend(extra);
        self.run(&arguments)?;
        let seconds = start.elapsed().as_secs_f64();

        let linear = image::read(&self.folder.join(&radiance)).map_err(|error| error.to_string())?;
        let tone = tone.unwrap_or_else(|| ToneSettings::default().fit(&linear.rgb));
        self.write_png(&picture, &linear, tone)?;
        let profile = Profile::read(&self.folder.join(&profile)).map_err(|error| error.to_string())?;
        Ok(Run { picture, radiance, seconds, profile, tone })
    }

    fn write_png(&self, name: &str, linear: &Picture, tone: ToneMap) -> Result<(), String> {
        let bytes = tone.to_bytes(&linear.rgb);
        image::write_png(&self.folder.join(name), linear.width, linear.height, &bytes.bytes, &Metadata::new())
            .map_err(|error| error.to_string())
    }

    fn difference(&self, run: &Run, reference: &Run) -> Result<Difference, String> {
        let picture = run.radiance.replace(".exr", ".difference.png");
        let arguments = ["diff", &run.radiance, &reference.radiance, "-o", &picture, "--json", "--map", "relative"];
        let listing: Value = serde_json::from_slice(&self.run(&arguments)?)
            .map_err(|error| format!("`linklight diff --json` printed no JSON: {error}"))?;
        let figure = |name: &str| listing["figures"][name].as_f64();
        Ok(Difference { picture, relative_mse: figure("relmse"), energy: figure("energy"), flip: figure("flip") })
    }

    /// Standard output of `linklight arguments`, run in the page's folder.
    fn run(&self, arguments: &[&str]) -> Result<Vec<u8>, String> {
        let output = Command::new(&self.program)
            .args(arguments)
            .current_dir(self.folder)
            .output()
            .map_err(|error| format!("cannot run {}: {error}", self.program.display()))?;
        if output.status.success() {
            return Ok(output.stdout);
        }
        let message = String::from_utf8_lossy(&output.stderr);
        Err(format!("`linklight {}` ended with {}\n{}", arguments.join(" "), output.status, message.trim()))
    }
}
