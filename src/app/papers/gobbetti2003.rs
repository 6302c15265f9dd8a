//! Rows of [Gobbetti2003]: hierarchical higher-order face cluster radiosity.
//!
//! [Gobbetti2003]: crate::methods::PAPERS

use super::row::Better::{Lower, Near};
use super::row::{Measurement, Row, Trend, vary};

const METHOD: &str = "face-cluster";
/// As there: constant radiosity, quadratic irradiance, relative transfer error 1e-5, ten iterations. Nothing is cut finer.
const AS_THERE: &str = "--method face-cluster --bounces 9 --elements 1 --set threshold=0.00001 --size 160x90 --spp 1";
const SIZES: [&str; 4] = ["160000", "400000", "800000", "1500000"];
const ON: &str = "a room with three statues, 160k to 1.5M triangles, Athlon XP 1600";

fn gallery(triangles: &str, basis: &str) -> String {
    format!("builtin:gallery?triangles={triangles} {AS_THERE} --set irradiance_basis={basis}")
}

fn shown(basis: &str, options: &str) -> String {
    format!(
        "builtin:gallery?triangles=40000 --method face-cluster --bounces 5 --size 240x150 --spp 4 \
         --set irradiance_basis={basis} {options}"
    )
}

fn by_size(basis: &str) -> Vec<(String, String)> {
    SIZES.iter().map(|size| (format!("{size} triangles"), gallery(size, basis))).collect()
}

pub fn rows() -> Vec<Row> {
    let largest = gallery("1500000", "quadratic");
    let number = |place, what: &str, theirs, value: fn(&[&Measurement]) -> Option<f64>| {
        Row::number(METHOD, place, what, ON, theirs, &[&largest], value).slow()
    };
    let trend =
        |place, words, runs, value, expected| Row::trend(METHOD, place, words, ON, runs, value, expected).slow();
    let seconds: (&'static str, fn(&Measurement) -> Option<f64>) = ("s", |m| m.fact("/solve_seconds"));
    let transfers: (&'static str, fn(&Measurement) -> Option<f64>) =
        ("transfers", |m| m.sum("/iterations", "transfers"));
    let leaves: (&'static str, fn(&Measurement) -> Option<f64>) = ("leaves", |m| m.fact("/leaves"));
    let by_basis = |runs: fn(&str) -> String| {
        ["constant", "linear", "quadratic"].map(|basis| (basis.to_owned(), runs(basis))).to_vec()
    };
    vec![
        number("Sec. 4", "solution of 1.5M triangles", (115.0, "s", Lower), |m| m[0].fact("/solve_seconds")),
        number("Sec. 4", "clustering of 1.5M triangles", (464.0, "s", Lower), |m| m[0].fact("/clustering_seconds")),
        number("Sec. 4", "leaves of the solution, quadratic", (5800.0, "", Near), |m| m[0].fact("/leaves")),
        number("Sec. 4", "memory of the solution, quadratic", (3.5, "MB", Lower), |m| {
            Some(m[0].fact("/solution_bytes")? / 1e6)
        }),
        number("Sec. 4", "memory of the model for each triangle", (238.0, "bytes", Lower), |m| {
            Some(m[0].fact("/cluster_bytes")? / m[0].fact("/triangles")?)
        }),
        trend(
            "Fig. 4, left",
            ("time of the solution by triangles", "constant: 103 to 115 s"),
            by_size("linear"),
            seconds,
            Trend::Flat(1.12),
        ),
        trend(
            "Fig. 4, left",
            ("leaves of the solution by triangles", "independent of the size of the input"),
            by_size("linear"),
            leaves,
            Trend::Flat(1.12),
        ),
        trend(
            "Fig. 4, centre",
            ("transfers by basis of irradiance", "diminish significantly as the order rises"),
            by_basis(|basis| gallery("160000", basis)),
            transfers,
            Trend::Falls,
        ),
        trend(
            "Fig. 4, right",
            ("memory of the solution by triangles", "stays constant"),
            by_size("linear"),
            ("MB", |m| Some(m.fact("/solution_bytes")? / 1e6)),
            Trend::Flat(1.12),
        ),
        Row::error_trend(
            METHOD,
            "Fig. 3",
            ("relative MSE by basis of irradiance", "smoother with higher orders"),
            "a room with three statues",
            by_basis(|basis| {
                format!(
                    "builtin:cornell-box --method face-cluster --bounces 3 --diffuse --size 128x96 --spp 4 \
                     --set irradiance_basis={basis}"
                )
            }),
            ("relative MSE", Measurement::relative_mse),
            Trend::Falls,
        ),
        Row::error_trend(
            METHOD,
            "Sec. 3.3",
            ("relative MSE by threshold", "accuracy is controlled by the threshold of transfers"),
            "the oracle",
            vary(
                "builtin:cornell-box --method face-cluster --bounces 3 --diffuse --size 128x96 --spp 4",
                "--set threshold=",
                &["0.001", "0.0001", "0.00001"],
            ),
            ("relative MSE", Measurement::relative_mse),
            Trend::Falls,
        ),
        Row::not(
            METHOD,
            "Fig. 4, left",
            "volume clustering: 1 h 37 to 15 h 50",
            "radiosity by volume clusters is not one of our methods",
        ),
        Row::views(
            METHOD,
            "Fig. 3, left",
            ("leaves of the solution by basis of irradiance", "larger leaves with higher orders"),
            "a room with three statues",
            &["constant", "linear", "quadratic"].map(|basis| (basis, shown(basis, "--view elements"))),
        ),
        Row::pictures(
            METHOD,
            "Fig. 3, centre",
            ("diffuse surfaces by basis of irradiance", "smoother with higher orders"),
            "a room with three statues",
            &["constant", "linear", "quadratic"].map(|basis| (basis, shown(basis, "--diffuse"))),
        ),
        Row::pictures(
            METHOD,
            "Fig. 3, right; Fig. 5",
            (
                "glossy surfaces by basis of irradiance",
                "glossy reflection of indirect light, limited to the last bounce",
            ),
            "a room with three statues",
            &["constant", "linear", "quadratic"].map(|basis| (basis, shown(basis, ""))),
        ),
        Row::not(METHOD, "Fig. 1 and 2", "a face cluster, two hierarchies", "drawings that explain the algorithm"),
    ]
}
