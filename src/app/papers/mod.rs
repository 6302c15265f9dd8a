//! `linklight papers -o DIR`: every table and every reproducible figure of the five papers, measured here, as a page.
//!
//! One file for each paper holds its rows: what it says, on what, and the runs of `linklight render` that measure the same
//! on our scenes. Rows that cannot be measured say why. A run that several rows share is made once.

mod dachsbacher2007;
mod dong2007;
mod gobbetti2003;
mod ritschel2008;
mod row;
mod schmitz2008;

use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::AppError;
use super::cli::{Global, PapersArgs};
use super::compare::measured::measure;
use super::compare::plan::{Plan, Run};
use super::compare::reference::{Quality, Reference};
use super::console::{Console, Watcher};
use super::interrupt::Interrupt;
use super::values::parse_method;
use super::{measure as device_facts, render};
use crate::methods;
use crate::report::errors::compare;
use crate::report::image;
use crate::report::papers_page::{
    Command, Outcome, Picture, Report, RowReport, SCHEMA, VERSION, Value, Verdict, to_html,
};
use crate::report::tonemap::{ToneMap, ToneSettings};
use crate::report::write::{FileError, write_text};
use row::{Held, Measurement, Ours, Row, Theirs};

/// All rows, paper by paper.
fn rows() -> Vec<Row> {
    [schmitz2008::rows(), dong2007::rows(), dachsbacher2007::rows(), ritschel2008::rows(), gobbetti2003::rows()]
        .into_iter()
        .flatten()
        .collect()
}

pub fn run(
    args: &PapersArgs,
    global: &Global,
    console: &Console,
    interrupt: &Interrupt,
    out: &mut dyn Write,
) -> Result<(), AppError> {
    let mut rows = rows();
    rows.retain(|row| args.method.is_empty() || args.method.iter().any(|method| method.key == row.method));
    if let Some(text) = &args.only {
        let text = text.to_lowercase();
        rows.retain(|row| names(&format!("{} {} {}", row.place, row.what, row.on).to_lowercase(), &text));
    }
    if rows.is_empty() {
        let message =
            "no row is left; --only looks for its text in places such as \"Table 1\", in what is measured and on what";
        return Err(AppError::Usage(message.into()));
    }
    crate::files::create_dir_all(&args.output)
        .map_err(|source| FileError::new("make the folder", &args.output, source))?;
    let device = device_facts::device(render::open_device(global, false)?.info());
    let program = concat!("linklight ", env!("CARGO_PKG_VERSION"));
    let mut report = Report { schema: SCHEMA, version: VERSION, program, device, rows: Vec::new() };
    let mut evidence = Evidence {
        args,
        global,
        watch: Watcher::new(console, interrupt),
        measured: HashMap::new(),
        folder: args.output.join("runs"),
    };
    crate::files::create_dir_all(&evidence.folder)
        .map_err(|source| FileError::new("make the folder", &evidence.folder, source))?;
    for row in &rows {
        let row = evidence.row(row)?;
        if !args.json {
            writeln!(out, "{}", row.line())?;
            out.flush()?;
        }
        report.rows.push(row);
        write_text(&args.output.join("papers.json"), &serde_json::to_string_pretty(&report)?)?;
        write_text(&args.output.join("index.html"), &to_html(&report))?;
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        writeln!(out, "{}\nopen {}", report.summary(), args.output.join("index.html").display())?;
    }
    Ok(())
}

/// Whether a text holds another, not as a piece of a longer number: "Fig. 1" is not named by "Fig. 11".
fn names(all: &str, text: &str) -> bool {
    let is_digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    all.match_indices(text).any(|(at, _)| {
        let (before, behind) = (&all[..at], &all[at + text.len()..]);
        let is_cut = |outer, inner| is_digit(outer) && is_digit(inner);
        !is_cut(before.chars().next_back(), text.chars().next())
            && !is_cut(behind.chars().next(), text.chars().next_back())
    })
}

/// What was measured so far.
struct Evidence<'a> {
    args: &'a PapersArgs,
    global: &'a Global,
    watch: Watcher<'a>,
    /// By line of options; an error in words.
    measured: HashMap<String, Result<Measurement, String>>,
    folder: PathBuf,
}

impl Evidence<'_> {
    fn row(&mut self, row: &Row) -> Result<RowReport, AppError> {
        let paper = methods::find(row.method).map_or("", |method| method.paper.key);
        let (theirs, unit) = match row.theirs {
            Theirs::Number { value, unit, .. } => (Some(value), unit),
            Theirs::Words(_) => (None, ""),
        };
        let says = match row.theirs {
            Theirs::Words(words) => words,
            Theirs::Number { .. } => "",
        };
        let outcome = match &row.ours {
            Ours::Not(why) => Outcome::Not((*why).to_owned()),
            _ if row.is_slow && self.args.quick => Outcome::Not("left out by --quick".into()),
            _ => {
                for run in row.runs() {
                    self.measure(run, row.has_reference)?;
                }
                self.outcome(row)
            }
        };
        let commands =
            row.runs().into_iter().map(|run| Command(format!("linklight render {run} -o out.exr"))).collect();
        let (place, what, on) = (row.place, row.what.clone(), row.on);
        let pictures = self.pictures(row);
        Ok(RowReport { paper, method: row.method, place, what, on, theirs, says, unit, outcome, pictures, commands })
    }

    /// The pictures of a row that were rendered; one of a reference stands behind those that are held to it.
    fn pictures(&self, row: &Row) -> Vec<Picture> {
        let beside = |path: &Path| path.strip_prefix(&self.args.output).unwrap_or(path).to_string_lossy().into_owned();
        let mut pictures: Vec<Picture> = Vec::new();
        let mut waiting: Option<String> = None;
        for (caption, run) in row.shown() {
            let Some(Ok(measured)) = self.measured.get(run) else { continue };
            let reference = measured.reference.as_ref().filter(|_| row.has_reference).map(|held| beside(&held.png));
            if waiting != reference {
                pictures.extend(waiting.take().map(Picture::reference));
            }
            waiting = reference;
            pictures.push(Picture { caption: caption.clone(), png: beside(&measured.png) });
        }
        pictures.extend(waiting.map(Picture::reference));
        pictures
    }

    /// Measures a run unless it was; an error ends the program only where the user asked for the end.
    fn measure(&mut self, line: &str, has_reference: bool) -> Result<(), AppError> {
        let known = self.measured.get(line);
        if known.is_some_and(|known| known.as_ref().map_or(true, |m| m.reference.is_some() || !has_reference)) {
            return Ok(());
        }
        tracing::info!("linklight render {line}");
        let measured = self.watch.attempt(self.run(line, has_reference))?;
        self.measured.insert(line.to_owned(), measured);
        Ok(())
    }

    fn run(&self, line: &str, has_reference: bool) -> Result<Measurement, AppError> {
        let [run, reference] = parse(line, &self.folder, self.global)?;
        let measured = measure(&run, self.args.frames, false, &self.watch)?;
        let tone = ToneSettings::default();
        let rgb = &measured.picture.rgb;
        let (reference, tone_map) = if has_reference {
            let quality = Quality { noise: self.args.noise, max_samples: self.args.reference_spp };
            let path_traced = Reference::path_traced(&reference, quality, &self.watch)?.picture;
            let figures = compare(&measured.picture, &path_traced, None, &tone)?.figures;
            let tone_map = tone.fit(&path_traced.rgb);
            let png = reference.request.output.path.with_extension("png");
            write_shown(&png, &path_traced, tone_map)?;
            (Some(Held { png, figures }), tone_map)
        } else {
            (None, tone.fit(rgb))
        };
        let held = if has_reference { "held " } else { "" };
        let name = blake3::hash(format!("{held}{line}").as_bytes()).to_hex();
        let png = self.folder.join(format!("{}.png", &name.as_str()[..12]));
        write_shown(&png, &measured.picture, tone_map)?;
        Ok(Measurement { cost: measured.cost, frames: self.args.frames, png, reference })
    }

    /// What the runs of a row, all measured, say.
    fn outcome(&self, row: &Row) -> Outcome {
        let found = |run: &str| match self.measured.get(run) {
            Some(Ok(measured)) => Ok(measured),
            Some(Err(reason)) => Err(reason.clone()),
            None => Err("it was not measured".to_owned()),
        };
        let missing = || "the run has no such pass or number".to_owned();
        let attempt = || -> Result<Outcome, String> {
            match (&row.ours, row.theirs) {
                (Ours::Number { runs, value }, Theirs::Number { value: theirs, better, .. }) => {
                    let runs = runs.iter().map(|run| found(run)).collect::<Result<Vec<_>, _>>()?;
                    let ours = value(&runs).filter(|ours| ours.is_finite()).ok_or_else(missing)?;
                    Ok(Outcome::Number { ours, ratio: ours / theirs, verdict: better.verdict(ours, theirs) })
                }
                (Ours::Trend { runs, unit, value, expected }, _) => {
                    let mut values = Vec::new();
                    for (caption, run) in runs {
                        let measured = value(found(run)?).filter(|value| value.is_finite()).ok_or_else(missing)?;
                        values.push(Value { caption: caption.clone(), value: measured });
                    }
                    let numbers: Vec<f64> = values.iter().map(|value| value.value).collect();
                    let verdict = if expected.holds(&numbers) { Verdict::Holds } else { Verdict::DoesNotHold };
                    Ok(Outcome::Trend { values, unit, expected: expected.in_words(), verdict })
                }
                (Ours::Pictures(runs), _) => {
                    runs.iter().try_for_each(|(_, run)| found(run).map(drop))?;
                    Ok(Outcome::Shown)
                }
                (_, _) => Err("the row has nothing to measure".into()),
            }
        };
        attempt().unwrap_or_else(Outcome::Failed)
    }
}

fn write_shown(path: &Path, picture: &image::Picture, tone_map: ToneMap) -> Result<(), AppError> {
    let bytes = tone_map.to_bytes(&picture.rgb).bytes;
    Ok(image::write_png(path, picture.width, picture.height, &bytes, &image::Metadata::new())?)
}

/// The run of a line of options, and its path-traced reference.
fn parse(line: &str, folder: &Path, global: &Global) -> Result<[Run; 2], AppError> {
    let mut words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
    let key = words.iter().position(|word| word == "--method");
    let (Some(key), false) = (key, words.is_empty()) else {
        return Err(AppError::failed(format!("{line:?} names no method")));
    };
    let method = words.drain(key..(key + 2).min(words.len())).nth(1).unwrap_or_default();
    let method = parse_method(&method).map_err(AppError::failed)?;
    let scene = words.remove(0).parse().map_err(AppError::failed)?;
    let plan = Plan { methods: vec![method], variations: &[], set: &[], options: &words, global };
    let run = plan.run(&scene, method, &[], &folder.join("picture.exr"))?;
    let mut reference_options: Vec<String> = Vec::new();
    let mut rest = words.iter();
    while let Some(word) = rest.next() {
        // Settings and views are the method's own.
        if word == "--set" || word == "--view" {
            rest.next();
        } else {
            reference_options.push(word.clone());
        }
    }
    let plan = Plan { methods: vec![method], variations: &[], set: &[], options: &reference_options, global };
    let mut reference = plan.reference(&scene, folder)?;
    let mut record = reference.request.record()?;
    record.remove("spp");
    let identity = blake3::hash(format!("{scene} {}", serde_json::Value::from(record)).as_bytes()).to_hex();
    reference.request.output.path = folder.join(format!("reference-{}.exr", &identity.as_str()[..12]));
    Ok([run, reference])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_of_every_row_is_understood() {
        let folder = tempfile::tempdir().unwrap();
        let rows = rows();
        assert!(rows.len() > 80, "{} rows", rows.len());
        for row in &rows {
            assert!(methods::find(row.method).is_some_and(|method| !method.paper.key.is_empty()), "{}", row.method);
            assert!(!row.runs().is_empty() || matches!(row.ours, Ours::Not(_)), "{} {}", row.place, row.what);
            for run in row.runs() {
                let [run, reference] =
                    parse(run, folder.path(), &Global::UNSAID).unwrap_or_else(|e| panic!("{run}: {e}"));
                assert_eq!(run.request.method.key, row.method);
                assert_eq!(run.request.bounces, reference.request.bounces);
            }
        }
    }

    #[test]
    fn a_figure_is_chosen_without_those_that_begin_like_it() {
        let places = |text: &str| -> Vec<&str> {
            let chosen = rows().into_iter().filter(|row| names(&row.place.to_lowercase(), text));
            chosen.filter(|row| row.method == "surface-shadow-maps").map(|row| row.place).collect()
        };
        assert_eq!(places("fig. 1"), ["Fig. 1"]);
        assert_eq!(places("fig. 17"), ["Fig. 17"]);
        assert!(places("fig.").len() > 6, "without a number all are");
        assert!(names("table 12, 2 bounces", "2 bounces") && !names("table 12 bounces", "2 bounces"));
        assert!(names("fig. 11, then fig. 1", "fig. 1"), "a later place counts");
    }

    #[test]
    fn references_are_shared_where_settings_alone_differ() {
        let folder = tempfile::tempdir().unwrap();
        let path = |line: &str| parse(line, folder.path(), &Global::UNSAID).unwrap()[1].request.output.path.clone();
        let coarse = path("builtin:maze --method antiradiance --bounces 2 --size 8x8 --elements 900 --set bins=128");
        let fine = path("builtin:maze --method antiradiance --bounces 2 --size 8x8 --set bins=512");
        assert_eq!(coarse, fine);
        assert_ne!(coarse, path("builtin:maze --method antiradiance --bounces 3 --size 8x8"));
        assert!(parse("builtin:maze", folder.path(), &Global::UNSAID).is_err());
    }
}
