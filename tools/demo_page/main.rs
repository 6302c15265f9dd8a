//! Renders the built-in scenes by every method beside the reference and writes one web page that opens from disk.
//!
//! Drives the `linklight` command as any other program would, and reads its files. `tools/demo` calls this; it does not
//! install or build anything itself.

mod page;
mod runs;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use linklight::scene::builtin::BUILTINS;

use page::{Page, SceneRow};
use runs::{Linklight, Quality, Subject};

/// Scenes that exist to be computed by hand: little to look at, left out unless asked for.
const ANALYTIC: [&str; 5] = ["cornell-empty", "furnace", "parallel-plates", "perpendicular-plates", "two-rooms"];
/// Scenes that are shown with less detail than they have by default, and how.
const LIGHTER: [(&str, &str); 1] = [("gallery", "gallery?triangles=16000")];
/// What `--quick` shows.
const QUICK: [&str; 2] = ["cornell-box", "office"];
/// The method that the others are held to.
const REFERENCE: &str = "path-tracing";

/// Render the built-in scenes by every method beside the reference, into one web page
#[derive(Debug, Parser)]
#[command(name = "tools/demo", max_term_width = 110)]
struct Options {
    /// Folder of the page; made when missing
    #[arg(short, long, value_name = "DIR", default_value = "target/demo")]
    output: PathBuf,
    /// Scene by its built-in name; may be repeated [default: all but the analytic ones]
    #[arg(long, value_name = "NAME", value_parser = scene_names())]
    scene: Vec<String>,
    /// Method beside the reference; may be repeated [default: all]
    #[arg(long, value_name = "KEY")]
    method: Vec<String>,
    /// Width and height of the pictures in pixels
    #[arg(long, value_name = "WxH", default_value = "256x192")]
    size: String,
    /// Samples per pixel of the reference
    #[arg(long, value_name = "N", default_value_t = 64)]
    spp: u32,
    /// Indirect bounces after the direct light
    #[arg(long, value_name = "N", default_value_t = 4)]
    bounces: u32,
    /// Elements that a scene is tessellated to for methods that solve on elements
    #[arg(long, value_name = "N", default_value_t = 8000)]
    elements: u32,
    /// Two scenes with a quarter of the pixels, samples and elements
    #[arg(long, conflicts_with_all = ["scene", "size", "spp", "elements"])]
    quick: bool,
    /// The program that renders
    #[arg(long, value_name = "FILE", default_value = "target/release/linklight", hide = true)]
    linklight: PathBuf,
}

fn scene_names() -> clap::builder::PossibleValuesParser {
    clap::builder::PossibleValuesParser::new(BUILTINS.iter().map(|scene| scene.name))
}

impl Options {
    fn scenes(&self) -> Vec<&'static str> {
        let names = BUILTINS.iter().map(|scene| scene.name);
        if self.quick {
            names.filter(|name| QUICK.contains(name)).collect()
        } else if self.scene.is_empty() {
            names.filter(|name| !ANALYTIC.contains(name)).collect()
        } else {
            names.filter(|name| self.scene.iter().any(|wanted| wanted == name)).collect()
        }
    }

    fn quality(&self) -> Quality {
        let part = if self.quick { 4 } else { 1 };
        Quality {
            size: if self.quick { "128x96" } else { self.size.as_str() }.to_owned(),
            spp: self.spp / part,
            elements: self.elements / part,
            bounces: self.bounces,
        }
    }
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(failures) => {
            eprintln!("demo: {failures} of the pictures failed; the page says why");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("demo: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Returns how many pictures could not be made.
fn run(options: &Options) -> Result<usize, String> {
    let start = Instant::now();
    let linklight = Linklight::new(&options.linklight, &options.output, options.quality())?;
    let known = linklight.methods()?;
    for wanted in &options.method {
        if !known.iter().any(|method| method.key == *wanted) {
            let keys: Vec<&str> = known.iter().map(|method| method.key.as_str()).collect();
            return Err(format!("there is no method \"{wanted}\"; choose from {}", keys.join(", ")));
        }
    }
    let methods: Vec<_> = known
        .iter()
        .filter(|method| method.key != REFERENCE)
        .filter(|method| options.method.is_empty() || options.method.contains(&method.key))
        .collect();

    let mut page = Page::new(options.quality(), known.clone());
    let path = options.output.join("index.html");
    for name in options.scenes() {
        let description = BUILTINS.iter().find(|scene| scene.name == name).map_or("", |scene| scene.description);
        let source = LIGHTER.iter().find(|(scene, _)| *scene == name).map_or(name, |(_, source)| source);
        let subject = Subject { name, source };
        let mut row = SceneRow::new(name, description, linklight.reference(subject, REFERENCE));
        report(name, REFERENCE, &row.reference.as_ref().map(|run| run.seconds));
        for method in &methods {
            let compared = linklight.compared(subject, &method.key, row.reference.as_ref().ok());
            report(name, &method.key, &compared.as_ref().map(|compared| compared.run.seconds));
            row.methods.push((method.key.clone(), compared));
        }
        page.scenes.push(row);
        // The page grows as pictures come, so that it can be looked at meanwhile.
        write(&path, &page.to_html())?;
    }
    println!("demo: {} scenes in {:.0} s; open {}", page.scenes.len(), start.elapsed().as_secs_f64(), path.display());
    Ok(page.scenes.iter().map(SceneRow::failures).sum())
}

fn report(scene: &str, method: &str, seconds: &Result<f64, &String>) {
    match seconds {
        Ok(seconds) => println!("demo: {scene}, {method}: {seconds:.1} s"),
        Err(reason) => eprintln!("demo: {scene}, {method} failed: {}", reason.trim_end()),
    }
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    std::fs::write(path, text).map_err(|error| format!("cannot write {}: {error}", path.display()))
}
