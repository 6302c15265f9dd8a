//! What `linklight papers` leaves: the data, and the page that shows it, which opens from disk.
//!
//! # Schema of `papers.json`, version 1
//!
//! The structs below are the schema: `schema` is `"linklight-papers"`; fields are only added within a version.

use std::fmt::Write;

use serde::Serialize;

use super::plot::escaped;
use super::profile::Device;

pub const SCHEMA: &str = "linklight-papers";
pub const VERSION: u32 = 1;

#[derive(Debug, Clone, Serialize)]
pub struct Report {
    pub schema: &'static str,
    pub version: u32,
    pub program: &'static str,
    pub device: Device,
    pub rows: Vec<RowReport>,
}

/// One figure or claim of a paper beside ours.
#[derive(Debug, Clone, Serialize)]
pub struct RowReport {
    /// Key of the paper: `Schmitz2008`.
    pub paper: &'static str,
    pub method: &'static str,
    pub place: &'static str,
    pub what: String,
    /// What the paper measured it on.
    pub on: &'static str,
    /// The paper's figure, or what it says in words.
    pub theirs: Option<f64>,
    pub says: &'static str,
    pub unit: &'static str,
    pub outcome: Outcome,
    pub pictures: Vec<Picture>,
    pub commands: Vec<Command>,
}

/// A picture of a row's runs, or of the reference they are held to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Picture {
    pub caption: String,
    /// Relative to the page.
    pub png: String,
}

impl Picture {
    /// The path-traced one.
    pub fn reference(png: String) -> Self {
        Self { caption: "path tracing".into(), png }
    }
}

/// A command whose runs were measured.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Command(pub String);

#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    Number {
        ours: f64,
        /// Ours over theirs.
        ratio: f64,
        verdict: Verdict,
    },
    Trend {
        values: Vec<Value>,
        unit: &'static str,
        expected: String,
        verdict: Verdict,
    },
    /// It is a figure of pictures, which stand on the page.
    Shown,
    /// Why it is not measured.
    Not(String),
    /// What went wrong.
    Failed(String),
}

#[derive(Debug, Clone, Serialize)]
pub struct Value {
    pub caption: String,
    pub value: f64,
}

/// How a measured row stands beside the paper's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Won,
    Lost,
    /// Within a quarter.
    Alike,
    Different,
    /// What the paper found is found here.
    Holds,
    DoesNotHold,
}

impl Verdict {
    fn in_words(self) -> &'static str {
        match self {
            Self::Won => "won",
            Self::Lost => "lost",
            Self::Alike => "alike",
            Self::Different => "different",
            Self::Holds => "holds",
            Self::DoesNotHold => "does not hold",
        }
    }
}

impl Outcome {
    /// In a word.
    fn verdict(&self) -> &'static str {
        match self {
            Self::Number { verdict, .. } | Self::Trend { verdict, .. } => verdict.in_words(),
            Self::Shown => "shown",
            Self::Not(_) => "not measured",
            Self::Failed(_) => "failed",
        }
    }

    fn ours(&self, unit: &str) -> String {
        match self {
            Self::Number { ours, .. } => with_unit(*ours, unit),
            Self::Trend { values, unit, .. } => {
                let values: Vec<String> =
                    values.iter().map(|value| format!("{}: {}", value.caption, number(value.value))).collect();
                format!("{} ({unit})", values.join(", "))
            }
            Self::Shown => "pictures".into(),
            Self::Not(why) | Self::Failed(why) => why.clone(),
        }
    }
}

impl RowReport {
    /// What the paper says, as text.
    fn theirs(&self) -> String {
        self.theirs.map_or_else(|| self.says.to_owned(), |value| with_unit(value, self.unit))
    }

    /// For a terminal.
    pub fn line(&self) -> String {
        let (theirs, ours) = (self.theirs(), self.outcome.ours(self.unit));
        let ratio = match self.outcome {
            Outcome::Number { ratio, .. } => format!(" (x {})", number(ratio)),
            _ => String::new(),
        };
        let verdict = self.outcome.verdict();
        format!("{:<16} {:<14} {verdict:<13} {}: {theirs} | {ours}{ratio}", self.paper, self.place, self.what)
    }
}

impl Report {
    /// How many rows ended how.
    pub fn summary(&self) -> String {
        let mut counts: Vec<(&str, usize)> = Vec::new();
        for verdict in self.rows.iter().map(|row| row.outcome.verdict()) {
            match counts.iter_mut().find(|(known, _)| *known == verdict) {
                Some((_, count)) => *count += 1,
                None => counts.push((verdict, 1)),
            }
        }
        let counts: Vec<String> = counts.into_iter().map(|(verdict, count)| format!("{count} {verdict}")).collect();
        format!("{} rows: {}", self.rows.len(), counts.join(", "))
    }
}

/// Three digits that count.
fn number(value: f64) -> String {
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    match magnitude {
        6.. => format!("{:.2} million", value / 1e6),
        2..=5 => format!("{value:.0}"),
        -3..=1 => format!("{value:.*}", (2 - magnitude) as usize),
        _ => format!("{value:.2e}"),
    }
}

fn with_unit(value: f64, unit: &str) -> String {
    let text = format!("{} {unit}", number(value));
    text.trim_end().to_owned()
}

/// The whole page.
pub fn to_html(report: &Report) -> String {
    let mut html = String::from("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
    let css = include_str!("compare_page/page.css");
    let _ = writeln!(html, "<title>linklight: the papers, measured again</title>\n<style>\n{css}{EXTRA_CSS}</style>");
    html += "</head>\n<body>\n<h1>The papers, measured again</h1>\n";
    let device = &report.device;
    let device = format!("{} on {}, {}, Vulkan {}", report.program, device.name, device.driver, device.api);
    let _ = writeln!(html, "<p class=\"quiet\">{}</p>", escaped(&device));
    let _ = writeln!(html, "<p>{}. {EXPLANATION}</p>", report.summary());
    let mut papers: Vec<&str> = report.rows.iter().map(|row| row.paper).collect();
    papers.dedup();
    for paper in papers {
        let rows = report.rows.iter().filter(|row| row.paper == paper);
        let method = rows.clone().next().map_or("", |row| row.method);
        let _ = writeln!(html, "<h2>{}: {method}</h2>\n<div class=\"scroll\"><table class=\"papers\">", escaped(paper));
        html += "<thead><tr><th>where</th><th>what</th><th>measured on</th><th>paper</th><th>here</th><th>ratio</th>\
                 <th>verdict</th></tr></thead>\n<tbody>\n";
        for row in rows {
            let ratio = match row.outcome {
                Outcome::Number { ratio, .. } => number(ratio),
                _ => String::new(),
            };
            let verdict = row.outcome.verdict();
            let cells = [row.place, &row.what, row.on, &row.theirs(), &row.outcome.ours(row.unit), &ratio];
            let cells: String = cells.iter().map(|cell| format!("<td>{}</td>", escaped(cell))).collect();
            let commands: Vec<String> = row.commands.iter().map(|command| escaped(&command.0)).collect();
            let commands = if commands.is_empty() {
                String::new()
            } else {
                format!("<details><summary>commands</summary><code>{}</code></details>", commands.join("\n"))
            };
            let class = verdict.replace(' ', "-");
            let _ = writeln!(html, "<tr class=\"{class}\">{cells}<td><b>{verdict}</b>{commands}</td></tr>");
        }
        html += "</tbody></table></div>\n";
        let rows = report.rows.iter().filter(|row| row.paper == paper && !row.pictures.is_empty());
        rows.for_each(|row| html += &pictures(row));
    }
    html + "</body>\n</html>\n"
}

/// The pictures of one row.
fn pictures(row: &RowReport) -> String {
    let figures: String = row
        .pictures
        .iter()
        .map(|Picture { caption, png }| {
            let (caption, png) = (escaped(caption), escaped(png));
            format!("<figure><img src=\"{png}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>\n")
        })
        .collect();
    let (place, what, theirs) = (escaped(row.place), escaped(&row.what), escaped(&row.theirs()));
    format!("<h3>{place}: {what}</h3>\n<p class=\"quiet\">{theirs}</p>\n<div class=\"pictures\">\n{figures}</div>\n")
}

const EXPLANATION: &str = "Their figures stand as printed, on their scenes and graphics cards of their years; ours come \
    from the scenes built in that come nearest, on the device named above. Ratio is ours over theirs; won and lost go by \
    what is better, alike means within a quarter. Times are of the GPU's clock without the first frame.";

const EXTRA_CSS: &str = "
.papers :is(th, td) { text-align: left; white-space: normal; vertical-align: top; max-width: 26rem; }
.papers :is(.won, .holds, .alike) b { color: light-dark(#1b6e3c, #7fd6a0); }
.papers :is(.lost, .does-not-hold, .different, .failed) b { color: light-dark(#b3261e, #f2b8b5); }
.papers tr.failed { padding: 0; font: inherit; white-space: normal; }
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let texts = [0.0, 1.0, 12.34, 0.004_567, 123.4, 54_321.0, 1_234_567.0, 1e-7].map(number);
        assert_eq!(texts, ["0.00", "1.00", "12.3", "0.00457", "123", "54321", "1.23 million", "1.00e-7"]);
    }

    #[test]
    fn every_row_is_on_the_page_once_and_escaped() {
        let row = |outcome| RowReport {
            paper: "Schmitz2008",
            method: "explicit-visibility",
            place: "Table 1",
            what: "a < b".into(),
            on: "x & y",
            theirs: Some(2.0),
            says: "",
            unit: "ms",
            outcome,
            pictures: vec![Picture::reference("runs/a&b.png".into())],
            commands: vec![Command("linklight render 'a&b'".into())],
        };
        let rows = vec![
            row(Outcome::Number { ours: 1.0, ratio: 0.5, verdict: Verdict::Won }),
            row(Outcome::Failed("a & b".into())),
            row(Outcome::Not("because".into())),
        ];
        let report = Report { schema: SCHEMA, version: VERSION, program: "linklight", device: Device::default(), rows };
        let html = to_html(&report);
        assert_eq!(html.matches("<tr class=").count(), 3);
        assert!(html.contains("a &lt; b") && html.contains("x &amp; y") && !html.contains("a & b"));
        assert_eq!(html.matches("<img src=\"runs/a&amp;b.png\"").count(), 3);
        assert_eq!(report.summary(), "3 rows: 1 won, 1 failed, 1 not measured");
        assert!(report.rows[0].line().contains("2.00 ms | 1.00 ms (x 0.500)"), "{}", report.rows[0].line());
    }
}
