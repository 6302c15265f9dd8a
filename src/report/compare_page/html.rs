//! The page: a table that sorts, error against time, and every picture against the reference.

use std::fmt::Write;

use super::{Done, MethodReport, Outcome, Report, RunReport, SceneReport};
use crate::report::plot::{Series, escaped, log_log};

/// Passes listed under a picture: the ones that take longest.
const LISTED_PASSES: usize = 12;

/// The whole page; its pictures lie beside it.
pub fn to_html(report: &Report) -> String {
    let mut html = String::from("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
    let _ = writeln!(
        html,
        "<title>linklight: methods beside the reference</title>\n<style>\n{}</style>",
        include_str!("page.css")
    );
    html += "</head>\n<body>\n<h1>Methods beside the reference</h1>\n";
    let device = &report.device;
    let device = format!("{} on {}, {}, Vulkan {}", report.program, device.name, device.driver, device.api);
    let _ = writeln!(html, "<p class=\"quiet\">{}</p>", escaped(&device));
    html += "<p>One tone curve for each scene, fitted to its reference. Times are of the second preparation and of frames \
             after the first. Energy is the mean of the picture over the mean of the reference. Click a heading to sort, a \
             picture to flip between it and the reference.</p>\n";
    html += &methods(report);
    html += &table(report);
    for scene in &report.scenes {
        html += &scene_section(scene);
    }
    let _ = writeln!(html, "<script>\n{}</script>\n</body>\n</html>", include_str!("page.js"));
    html
}

/// A cell that sorts by its number.
fn cell(html: &mut String, value: Option<f64>, digits: usize) {
    let _ = match value {
        Some(value) => write!(html, "<td data-value=\"{value}\">{}</td>", number(value, digits)),
        None => write!(html, "<td data-value=\"\">&ndash;</td>"),
    };
}

/// The methods compared, with their papers.
fn methods(report: &Report) -> String {
    let mut html = String::from("<div class=\"scroll\"><table class=\"words\">\n<thead><tr><th>method</th>");
    html += "<th>what carries the light</th><th>source</th></tr></thead>\n<tbody>\n";
    for MethodReport { key, summary, source, doi } in &report.methods {
        let source = match doi {
            Some(doi) => format!("<a href=\"https://doi.org/{}\">{}</a>", escaped(doi), escaped(source)),
            None => escaped(source),
        };
        let _ = writeln!(html, "<tr><td>{key}</td><td>{}</td><td>{source}</td></tr>", escaped(summary));
    }
    html + "</tbody></table></div>\n"
}

fn table(report: &Report) -> String {
    let heads = [
        "scene",
        "method",
        "variation",
        "relative MSE",
        "energy",
        "p95",
        "SSIM",
        "FLIP",
        "prepare ms",
        "frame ms",
        "MiB",
        "elements",
    ];
    let mut html = String::from("<div class=\"scroll\"><table class=\"figures\">\n<thead><tr>");
    for head in heads {
        let _ = write!(html, "<th data-key>{head}</th>");
    }
    html += "</tr></thead>\n<tbody>\n";
    for scene in &report.scenes {
        for run in &scene.runs {
            let name = escaped(&scene.scene);
            let _ = write!(html, "<tr><td><a href=\"#{name}\">{name}</a></td>");
            let _ = write!(html, "<td>{}</td><td>{}</td>", run.method, escaped(&run.variation));
            match &run.outcome {
                Outcome::Done(done) => {
                    let Done { figures, cost, .. } = &**done;
                    cell(&mut html, figures.relative_mse, 4);
                    cell(&mut html, figures.mean_ratio, 3);
                    cell(&mut html, figures.relative_error_p95, 3);
                    cell(&mut html, Some(figures.ssim), 3);
                    cell(&mut html, Some(figures.flip_mean), 3);
                    cell(&mut html, Some(cost.prepare_ms), 0);
                    cell(&mut html, Some(cost.frame_ms.median), 1);
                    cell(&mut html, Some(cost.peak_bytes as f64 / f64::from(1 << 20)), 1);
                    cell(&mut html, Some(cost.elements as f64), 0);
                }
                Outcome::Failed(reason) => {
                    let _ =
                        write!(html, "<td colspan=\"{}\" class=\"failed\">{}</td>", heads.len() - 3, escaped(reason));
                }
            }
            html += "</tr>\n";
        }
    }
    html + "</tbody></table></div>\n"
}

fn scene_section(scene: &SceneReport) -> String {
    let name = escaped(&scene.scene);
    let mut html = format!("<h2 id=\"{name}\">{name}</h2>\n");
    let reference = &scene.reference;
    let noise = match (reference.noise, reference.samples) {
        (Some(noise), Some(samples)) => {
            format!("{samples} paths a pixel; standard error of a pixel {:.2} % of the mean", 100.0 * noise)
        }
        _ => "given".to_owned(),
    };
    let _ =
        writeln!(html, "<p class=\"quiet\">Reference: {noise}; <a href=\"{}\">EXR</a></p>", escaped(&reference.exr));
    if let Some(command) = &reference.command {
        let _ = writeln!(html, "<code>{}</code>", escaped(command));
    }
    html += &log_log(&series(scene), "preparation and one frame, ms", "relative MSE");
    html += "<div class=\"viewer\">\n";
    for run in &scene.runs {
        html += &figure(scene, run);
    }
    html + "</div>\n"
}

/// Error against time: the path tracer for ever longer, and each method's runs.
fn series(scene: &SceneReport) -> Vec<Series> {
    let paths = scene.path_tracing.iter().filter_map(|point| Some((point.milliseconds, point.figures.relative_mse?)));
    let mut series = vec![Series { name: "path-tracing".into(), points: paths.collect(), is_line: true }];
    for run in &scene.runs {
        let Outcome::Done(done) = &run.outcome else { continue };
        let Some(error) = done.figures.relative_mse else { continue };
        let point = (done.cost.prepare_ms + done.cost.frame_ms.median, error);
        match series.iter_mut().skip(1).find(|series| series.name == run.method) {
            Some(series) => series.points.push(point),
            None => series.push(Series { name: run.method.into(), points: vec![point], is_line: false }),
        }
    }
    series
}

fn figure(scene: &SceneReport, run: &RunReport) -> String {
    let title = escaped(format!("{} {}", run.method, run.variation).trim());
    let done = match &run.outcome {
        Outcome::Done(done) => done,
        Outcome::Failed(reason) => {
            return format!("<figure class=\"failed\"><b>{title}</b>\n{}</figure>\n", escaped(reason));
        }
    };
    let mut html = format!(
        "<figure><div class=\"split\"><img src=\"{}\" alt=\"reference\" loading=\"lazy\"><img class=\"over\" src=\"{}\" alt=\"{title}\" \
         loading=\"lazy\"></div><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"split\">\n",
        escaped(&scene.reference.png),
        escaped(&done.png)
    );
    let map = |file: &str, what: &str| {
        format!("<a href=\"{0}\"><img src=\"{0}\" alt=\"{what}\" title=\"{what}\" loading=\"lazy\"></a>", escaped(file))
    };
    let _ = writeln!(
        html,
        "<div class=\"maps\">{}{}</div>",
        map(&done.flip, "FLIP error"),
        map(&done.relative, "relative error, white 100 %")
    );
    let bounces: Vec<String> = done
        .bounce_energy
        .iter()
        .map(|energy| energy.map_or("&ndash;".to_owned(), |energy| number(energy, 3)))
        .collect();
    let Done { figures, cost, .. } = &**done;
    let _ = writeln!(
        html,
        "<figcaption><b>{title}</b><span class=\"quiet\">relative MSE {}, FLIP {}; {} ms + {} ms a frame ({} to {}), {} MiB; \
         energy by bounce {}; <a href=\"{}\">EXR</a></span>\n<code>{}</code>",
        figures.relative_mse.map_or("&ndash;".to_owned(), |error| number(error, 4)),
        number(figures.flip_mean, 3),
        number(cost.prepare_ms, 0),
        number(cost.frame_ms.median, 1),
        number(cost.frame_ms.min, 1),
        number(cost.frame_ms.max, 1),
        number(cost.peak_bytes as f64 / f64::from(1 << 20), 1),
        done.bounces_held.map_or_else(
            || bounces.join(" "),
            |held| format!("not told apart: held to a reference of {held} bounces, as many as it holds")
        ),
        escaped(&done.exr),
        escaped(&run.command)
    );
    html += &passes(done);
    html + "</figcaption></figure>\n"
}

/// The passes that take longest.
fn passes(done: &Done) -> String {
    let mut sorted: Vec<_> = done.cost.passes.iter().collect();
    sorted.sort_by(|a, b| b.ms.total.total_cmp(&a.ms.total));
    let mut html = String::from(
        "<details><summary>Passes of the frame that take longest</summary><div class=\"scroll\"><table>\n",
    );
    html += "<thead><tr><th>pass</th><th>calls</th><th>ms, median</th><th>ms, all</th></tr></thead>\n<tbody>\n";
    for pass in sorted.iter().take(LISTED_PASSES) {
        let mark = if pass.overlapped { "~" } else { "" };
        let (name, calls, ms) = (escaped(&pass.path), pass.calls, &pass.ms);
        let _ = writeln!(
            html,
            "<tr><td>{name}</td><td>{calls}</td><td>{mark}{:.3}</td><td>{mark}{:.2}</td></tr>",
            ms.median, ms.total
        );
    }
    html + "</tbody></table></div></details>\n"
}

/// A figure with `digits` after the point, or in powers of ten where these would show none of it.
fn number(value: f64, digits: usize) -> String {
    if value != 0.0 && digits > 0 && value.abs() < 0.1f64.powi(digits as i32) {
        format!("{value:.1e}")
    } else {
        format!("{value:.digits$}")
    }
}
