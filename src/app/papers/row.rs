//! A row of the papers' evidence: what a paper says, and how this program measures the same.

use std::path::PathBuf;

use serde_json::Value;

use crate::report::compare_page::Cost;
use crate::report::errors::ErrorFigures;
use crate::report::papers_page::Verdict;
use crate::report::profile::Pass;

/// One figure or claim of a paper.
pub struct Row {
    /// Key of the paper's method.
    pub method: &'static str,
    /// `Table 1`, `Fig. 4, centre`, `Sec. 5`.
    pub place: &'static str,
    pub what: String,
    /// What the paper measured it on.
    pub on: &'static str,
    pub theirs: Theirs,
    pub ours: Ours,
    /// Its runs are held to path-traced references.
    pub has_reference: bool,
    /// Takes minutes on a software driver: `--quick` leaves it out.
    pub is_slow: bool,
}

/// What the paper says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Theirs {
    Number { value: f64, unit: &'static str, better: Better },
    Words(&'static str),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Better {
    Lower,
    Higher,
    /// A property of method and scene: as near as scenes are alike.
    Near,
}

/// How it is measured here: by runs of `linklight render`, each a line of options that begins with the scene.
pub enum Ours {
    Number {
        runs: Vec<String>,
        value: fn(&[&Measurement]) -> Option<f64>,
    },
    Trend {
        runs: Vec<(String, String)>,
        unit: &'static str,
        value: fn(&Measurement) -> Option<f64>,
        expected: Trend,
    },
    /// It is a picture: the same, rendered here, each with its caption.
    Pictures(Vec<(String, String)>),
    /// It is not, and why.
    Not(&'static str),
}

/// What the paper lets expect of a row of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trend {
    /// The last below the first.
    Falls,
    /// The last above the first.
    Rises,
    /// Largest over smallest at most this.
    Flat(f64),
    /// The last over the first at most this.
    RisesAtMost(f64),
    /// None above this.
    AtMost(f64),
}

/// One run.
pub struct Measurement {
    pub cost: Cost,
    /// Frames in [`Cost::passes`].
    pub frames: u32,
    /// As a display shows it.
    pub png: PathBuf,
    /// The path-traced reference of the same options.
    pub reference: Option<Held>,
}

/// A reference, and how far the measured picture is from it.
pub struct Held {
    pub png: PathBuf,
    pub figures: ErrorFigures,
}

/// How far apart figures of like scenes may be and still be called alike.
const ALIKE: f64 = 1.25;

impl Row {
    pub fn number(
        method: &'static str,
        place: &'static str,
        what: impl Into<String>,
        on: &'static str,
        (value, unit, better): (f64, &'static str, Better),
        runs: &[&str],
        measured: fn(&[&Measurement]) -> Option<f64>,
    ) -> Self {
        let runs = runs.iter().map(|run| (*run).to_owned()).collect();
        let ours = Ours::Number { runs, value: measured };
        Self {
            method,
            place,
            what: what.into(),
            on,
            theirs: Theirs::Number { value, unit, better },
            ours,
            has_reference: false,
            is_slow: false,
        }
    }

    pub fn trend(
        method: &'static str,
        place: &'static str,
        (what, says): (&str, &'static str),
        on: &'static str,
        runs: Vec<(String, String)>,
        (unit, value): (&'static str, fn(&Measurement) -> Option<f64>),
        expected: Trend,
    ) -> Self {
        let ours = Ours::Trend { runs, unit, value, expected };
        Self {
            method,
            place,
            what: what.to_owned(),
            on,
            theirs: Theirs::Words(says),
            ours,
            has_reference: false,
            is_slow: false,
        }
    }

    /// A figure of the paper that holds pictures alone, beside path-traced references.
    pub fn pictures(
        method: &'static str,
        place: &'static str,
        (what, says): (&str, &'static str),
        on: &'static str,
        runs: &[(&str, String)],
    ) -> Self {
        Self { has_reference: true, ..Self::views(method, place, (what, says), on, runs) }
    }

    /// As [`Self::pictures`], of what no path tracer shows.
    pub fn views(
        method: &'static str,
        place: &'static str,
        (what, says): (&str, &'static str),
        on: &'static str,
        runs: &[(&str, String)],
    ) -> Self {
        let runs = runs.iter().map(|(caption, run)| ((*caption).to_owned(), run.clone())).collect();
        Self {
            method,
            place,
            what: what.to_owned(),
            on,
            theirs: Theirs::Words(says),
            ours: Ours::Pictures(runs),
            has_reference: false,
            is_slow: false,
        }
    }

    pub fn not(method: &'static str, place: &'static str, what: &str, why: &'static str) -> Self {
        let (what, theirs, ours) = (what.to_owned(), Theirs::Words(""), Ours::Not(why));
        Self { method, place, what, on: "", theirs, ours, has_reference: false, is_slow: false }
    }

    /// As [`Self::trend`], of runs that are held to path-traced references.
    pub fn error_trend(
        method: &'static str,
        place: &'static str,
        words: (&str, &'static str),
        on: &'static str,
        runs: Vec<(String, String)>,
        measured: (&'static str, fn(&Measurement) -> Option<f64>),
        expected: Trend,
    ) -> Self {
        Self { has_reference: true, ..Self::trend(method, place, words, on, runs, measured, expected) }
    }

    pub fn slow(self) -> Self {
        Self { is_slow: true, ..self }
    }

    /// Lines of options of all its runs.
    pub fn runs(&self) -> Vec<&str> {
        match &self.ours {
            Ours::Number { runs, .. } => runs.iter().map(String::as_str).collect(),
            Ours::Trend { runs, .. } | Ours::Pictures(runs) => runs.iter().map(|(_, run)| run.as_str()).collect(),
            Ours::Not(_) => Vec::new(),
        }
    }

    /// Captions and lines of options of the runs whose pictures belong on the page: those that show what is told.
    pub fn shown(&self) -> &[(String, String)] {
        match &self.ours {
            Ours::Pictures(runs) => runs,
            Ours::Trend { runs, .. } if self.has_reference => runs,
            Ours::Trend { .. } | Ours::Number { .. } | Ours::Not(_) => &[],
        }
    }
}

/// `run` once for every value of an option, captioned by it.
pub fn vary(run: &str, option: &str, values: &[&str]) -> Vec<(String, String)> {
    let caption = option.trim_start_matches("--set ").trim_start_matches("--").trim_end_matches(['=', ' ']);
    let line = |value: &&str| (format!("{caption} {value}"), format!("{run} {option}{value}"));
    values.iter().map(line).collect()
}

impl Trend {
    pub fn holds(self, values: &[f64]) -> bool {
        let (Some(&first), Some(&last)) = (values.first(), values.last()) else { return false };
        let largest = values.iter().copied().fold(f64::MIN, f64::max);
        let smallest = values.iter().copied().fold(f64::MAX, f64::min);
        match self {
            Self::Falls => last < first,
            Self::Rises => last > first,
            Self::Flat(ratio) => smallest > 0.0 && largest <= ratio * smallest,
            Self::RisesAtMost(ratio) => last <= ratio * first,
            Self::AtMost(limit) => largest <= limit,
        }
    }

    pub fn in_words(self) -> String {
        match self {
            Self::Falls => "falls".into(),
            Self::Rises => "rises".into(),
            Self::Flat(ratio) => format!("largest over smallest at most {ratio}"),
            Self::RisesAtMost(ratio) => format!("rises at most by {ratio}"),
            Self::AtMost(limit) => format!("at most {limit}"),
        }
    }
}

impl Better {
    pub fn verdict(self, ours: f64, theirs: f64) -> Verdict {
        let ratio = ours / theirs;
        match self {
            Self::Lower if ratio <= 1.0 => Verdict::Won,
            Self::Higher if ratio >= 1.0 => Verdict::Won,
            Self::Lower | Self::Higher => Verdict::Lost,
            Self::Near if (1.0 / ALIKE..=ALIKE).contains(&ratio) => Verdict::Alike,
            Self::Near => Verdict::Different,
        }
    }
}

impl Measurement {
    /// GPU time a frame of all passes whose path holds one of `parts`, ms.
    pub fn frame_ms(&self, parts: &[&str]) -> Option<f64> {
        total_ms(&self.cost.passes, parts).map(|ms| ms / f64::from(self.frames))
    }

    /// As [`Self::frame_ms`], of what is done once per scene.
    pub fn prepare_ms(&self, parts: &[&str]) -> Option<f64> {
        total_ms(&self.cost.prepare_passes, parts)
    }

    /// A number of the method's report, by its JSON pointer.
    pub fn fact(&self, pointer: &str) -> Option<f64> {
        self.cost.facts.pointer(pointer).and_then(Value::as_f64)
    }

    /// The sum of a number over the entries of a list in the method's report.
    pub fn sum(&self, list: &str, name: &str) -> Option<f64> {
        let entries = self.cost.facts.pointer(list)?.as_array()?;
        entries.iter().map(|entry| entry[name].as_f64()).sum()
    }

    /// Frames a second on the CPU's clock.
    pub fn rate(&self) -> Option<f64> {
        let ms = self.cost.frame_ms.median;
        (ms > 0.0).then(|| 1e3 / ms)
    }

    fn figures(&self) -> Option<&ErrorFigures> {
        Some(&self.reference.as_ref()?.figures)
    }

    pub fn relative_mse(&self) -> Option<f64> {
        self.figures()?.relative_mse
    }

    pub fn energy(&self) -> Option<f64> {
        self.figures()?.mean_ratio
    }
}

fn total_ms(passes: &[Pass], parts: &[&str]) -> Option<f64> {
    let mut found = passes.iter().filter(|pass| parts.iter().any(|part| pass.path.contains(part))).peekable();
    found.peek()?;
    Some(found.map(|pass| pass.ms.total).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_go_by_the_direction() {
        assert_eq!(Better::Lower.verdict(1.0, 2.0), Verdict::Won);
        assert_eq!(Better::Lower.verdict(3.0, 2.0), Verdict::Lost);
        assert_eq!(Better::Higher.verdict(3.0, 2.0), Verdict::Won);
        assert_eq!(Better::Near.verdict(2.4, 2.0), Verdict::Alike);
        assert_eq!(Better::Near.verdict(1.5, 2.0), Verdict::Different);
    }

    #[test]
    fn trends_hold_or_do_not() {
        assert!(Trend::Falls.holds(&[3.0, 4.0, 1.0]) && !Trend::Falls.holds(&[1.0, 1.0]));
        assert!(Trend::Rises.holds(&[1.0, 2.0]) && !Trend::Rises.holds(&[]));
        assert!(Trend::Flat(1.12).holds(&[1.0, 1.1]) && !Trend::Flat(1.12).holds(&[1.0, 1.2]));
        assert!(Trend::RisesAtMost(1.5).holds(&[2.0, 4.0, 3.0]) && !Trend::RisesAtMost(1.5).holds(&[2.0, 1.0, 3.1]));
        assert!(Trend::AtMost(2.0).holds(&[1.0, 2.0]) && !Trend::AtMost(2.0).holds(&[1.0, f64::NAN, 3.0]));
    }

    #[test]
    fn variations_are_captioned() {
        let lines = vary("builtin:maze --spp 1", "--set bins=", &["128", "512"]);
        assert_eq!(lines[1], ("bins 512".to_owned(), "builtin:maze --spp 1 --set bins=512".to_owned()));
    }
}
