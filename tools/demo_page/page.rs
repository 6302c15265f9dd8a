//! The web page: plain HTML with its own style, relative links, no script.

use std::fmt::Write;

use crate::runs::{Compared, Method, Quality, Run};

/// Passes listed under a picture: the ones that take longest.
const LISTED_PASSES: usize = 12;

/// All scenes rendered so far.
pub struct Page {
    pub scenes: Vec<SceneRow>,
    quality: Quality,
    methods: Vec<Method>,
}

/// One scene by every method; a picture that failed has the reason in its place.
pub struct SceneRow {
    name: String,
    description: String,
    pub reference: Result<Run, String>,
    /// By method key.
    pub methods: Vec<(String, Result<Compared, String>)>,
}

impl SceneRow {
    pub fn new(name: &str, description: &str, reference: Result<Run, String>) -> Self {
        Self { name: name.to_owned(), description: description.to_owned(), reference, methods: Vec::new() }
    }

    /// Pictures without success.
    pub fn failures(&self) -> usize {
        usize::from(self.reference.is_err()) + self.methods.iter().filter(|(_, result)| result.is_err()).count()
    }

    /// Every run that succeeded.
    fn runs(&self) -> impl Iterator<Item = (&str, &Run)> {
        let methods = self.methods.iter().filter_map(|(key, result)| Some((key.as_str(), &result.as_ref().ok()?.run)));
        self.reference.iter().map(|run| ("reference", run)).chain(methods)
    }
}

impl Page {
    pub fn new(quality: Quality, methods: Vec<Method>) -> Self {
        Self { scenes: Vec::new(), quality, methods }
    }

    pub fn to_html(&self) -> String {
        let mut html = String::from("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
        html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
        html += "<title>linklight: every method beside the reference</title>\n<style>\n";
        html += include_str!("page.css");
        html += "</style>\n</head>\n<body>\n<h1>linklight: every method beside the reference</h1>\n";
        html += &self.introduction();
        html += &self.overview();
        for row in &self.scenes {
            html += &scene(row);
        }
        html + "</body>\n</html>\n"
    }

    fn introduction(&self) -> String {
        let Quality { size, spp, elements, bounces } = &self.quality;
        let mut html = format!(
            "<p>Diffuse surfaces, direct light and {bounces} indirect bounces, {size} pixels; about {elements} elements, \
             the reference with {spp} paths a pixel. One tone curve for each scene, fitted to its reference. Difference pictures show the error of \
             radiance relative to the reference, black none, white 100&nbsp;%; what is left of the reference's own \
             noise is in them too.</p>\n"
        );
        if let Some((_, run)) = self.scenes.iter().flat_map(SceneRow::runs).next() {
            let device = &run.profile.device;
            let text = format!("{}, {}, Vulkan {}", device.name, device.driver, device.api);
            let _ = writeln!(html, "<p class=\"quiet\">{}</p>", escaped(&text));
        }
        html +=
            "<div class=\"scroll\"><table class=\"words\">\n<thead><tr><th>method</th><th>what carries the light</th>";
        html += "<th>source</th></tr></thead>\n<tbody>\n";
        for Method { key, summary, source, doi } in &self.methods {
            let source = match doi {
                Some(doi) => format!("<a href=\"https://doi.org/{}\">{}</a>", escaped(doi), escaped(source)),
                None => escaped(source),
            };
            let _ = writeln!(html, "<tr><td>{}</td><td>{}</td><td>{source}</td></tr>", escaped(key), escaped(summary));
        }
        html + "</tbody></table></div>\n"
    }

    /// One line a scene: error and time of each method.
    fn overview(&self) -> String {
        let mut html = String::from("<div class=\"scroll\"><table>\n<thead><tr><th>scene</th><th>triangles</th>");
        html += "<th>reference,<br>GPU ms</th>";
        let Some(first) = self.scenes.first() else { return String::new() };
        for (key, _) in &first.methods {
            let key = escaped(key);
            let _ = write!(html, "<th>{key},<br>GPU ms</th><th>relative MSE</th><th>energy</th><th>FLIP</th>");
        }
        html += "</tr></thead>\n<tbody>\n";
        for row in &self.scenes {
            let name = escaped(&row.name);
            let triangles = row.runs().next().map(|(_, run)| run.profile.scene.triangles as f64);
            let reference = row.reference.as_ref().ok().map(|run| run.profile.total_ms);
            let _ = write!(
                html,
                "<tr><td><a href=\"#{name}\">{name}</a></td><td>{}</td><td>{}</td>",
                number(triangles, 0),
                number(reference, 0)
            );
            for (_, result) in &row.methods {
                let compared = result.as_ref().ok();
                let difference = compared.and_then(|compared| compared.difference.as_ref());
                let _ = write!(
                    html,
                    "<td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                    number(compared.map(|compared| compared.run.profile.total_ms), 0),
                    number(difference.and_then(|d| d.relative_mse), 4),
                    number(difference.and_then(|d| d.energy), 3),
                    number(difference.and_then(|d| d.flip), 3)
                );
            }
            html += "</tr>\n";
        }
        html + "</tbody></table></div>\n"
    }
}

fn scene(row: &SceneRow) -> String {
    let mut html = format!("<h2 id=\"{0}\">{0}</h2>\n", escaped(&row.name));
    let _ = writeln!(html, "<p class=\"quiet\">{}</p>\n<div class=\"pictures\">", escaped(&row.description));
    match &row.reference {
        Ok(run) => html += &figure(&run.picture, "reference", &times(run)),
        Err(reason) => html += &failure("reference", reason),
    }
    for (key, result) in &row.methods {
        match result {
            Ok(Compared { run, difference }) => {
                html += &figure(&run.picture, key, &times(run));
                if let Some(difference) = difference {
                    let text = format!(
                        "relative MSE {}, energy {}, FLIP {}",
                        number(difference.relative_mse, 4),
                        number(difference.energy, 3),
                        number(difference.flip, 3)
                    );
                    html += &figure(&difference.picture, &format!("{key}: difference"), &text);
                }
            }
            Err(reason) => html += &failure(key, reason),
        }
    }
    html += "</div>\n<details><summary>Passes that take longest</summary>\n";
    for (key, run) in row.runs() {
        html += &passes(key, run);
    }
    html + "</details>\n"
}

fn figure(picture: &str, title: &str, text: &str) -> String {
    let (picture, title) = (escaped(picture), escaped(title));
    format!(
        "<figure><a href=\"{picture}\"><img src=\"{picture}\" alt=\"{title}\" loading=\"lazy\"></a>\
         <figcaption><b>{title}</b><span class=\"quiet\">{text}</span></figcaption></figure>\n"
    )
}

fn failure(title: &str, reason: &str) -> String {
    format!("<figure class=\"failed\"><b>{}</b>\n{}</figure>\n", escaped(title), escaped(reason))
}

fn times(run: &Run) -> String {
    let Run { profile, seconds, radiance, .. } = run;
    let memory = profile.memory.peak_bytes as f64 / f64::from(1 << 20);
    format!(
        "{:.0} ms on the GPU, {seconds:.1} s from start to file, {memory:.1} MiB; <a href=\"{}\">EXR</a>",
        profile.total_ms,
        escaped(radiance)
    )
}

/// The passes that take longest, as the profile tells.
fn passes(key: &str, run: &Run) -> String {
    let mut sorted: Vec<_> = run.profile.passes.iter().collect();
    sorted.sort_by(|a, b| b.ms.total.total_cmp(&a.ms.total));
    let mut html = format!("<h3>{}</h3>\n<div class=\"scroll\"><table>\n<thead><tr><th>pass</th>", escaped(key));
    html += "<th>calls</th><th>ms, median</th><th>ms, all</th></tr></thead>\n<tbody>\n";
    for pass in sorted.iter().take(LISTED_PASSES) {
        let mark = if pass.overlapped { "~" } else { "" };
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{mark}{:.3}</td><td>{mark}{:.2}</td></tr>",
            escaped(&pass.name),
            pass.calls,
            pass.ms.median,
            pass.ms.total
        );
    }
    if sorted.len() > LISTED_PASSES {
        let rest: f64 = sorted[LISTED_PASSES..].iter().map(|pass| pass.ms.total).sum();
        let count = sorted.len() - LISTED_PASSES;
        let _ = writeln!(html, "<tr><td>{count} more passes</td><td></td><td></td><td>{rest:.2}</td></tr>");
    }
    html + "</tbody></table></div>\n"
}

/// A figure with `digits` after the point, or in powers of ten where these would show none of it.
fn number(value: Option<f64>, digits: usize) -> String {
    match value {
        None => "&ndash;".to_owned(),
        Some(value) if value != 0.0 && digits > 0 && value.abs() < 0.1f64.powi(digits as i32) => format!("{value:.1e}"),
        Some(value) => format!("{value:.digits$}"),
    }
}

/// Text as it may stand in HTML, attributes included.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
