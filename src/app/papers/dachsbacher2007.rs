//! Rows of [Dachsbacher2007]: antiradiance.
//!
//! [Dachsbacher2007]: crate::methods::PAPERS

use super::row::Better::{Higher, Lower, Near};
use super::row::{Measurement, Row, Trend, vary};

const METHOD: &str = "antiradiance";
/// As in the paper: 128 bins, four steps, direct light without antiradiance. Its elements are all nodes of the hierarchy (18.2k of 128 bins in 71.3 MB are five
/// tables of three halves), so ours are as many nodes, and `refinement` makes as many links, where scenes allow.
const AS_THERE: &str = "--method antiradiance --set bins=128 --set scheme=symmetric --set iterations=4 \
                        --set emitters=sampled --bounces 4 --size 160x90 --spp 1";
const FINE: &str = "--method antiradiance --bounces 3 --diffuse --size 128x96 --spp 4";

/// A box whose white parts gloss: there is no scene with one glossy object alone.
const GLOSSY: &str = "--method antiradiance --edit material:0.roughness=0.3 --edit material:0.metallic=1";

/// A scene of Tables 1 and 2.
struct Scene {
    on: &'static str,
    run: &'static str,
    links: f64,
    link_seconds: f64,
    local_ms: f64,
    global_ms: f64,
    push_pull_ms: f64,
    table_mb: f64,
    link_mb: f64,
    rate: f64,
}

const SCENES: [Scene; 3] = [
    Scene {
        on: "Office, 18.2k elements",
        run: "builtin:office --elements 12200 --set refinement=34",
        links: 632e3,
        link_seconds: 8.7,
        local_ms: 7.1,
        global_ms: 63.4,
        push_pull_ms: 14.0,
        table_mb: 71.3,
        link_mb: 29.5,
        rate: 10.1,
    },
    Scene {
        on: "Character, 19.7k elements",
        run: "builtin:dancer --elements 13000 --set refinement=33",
        links: 661e3,
        link_seconds: 13.1,
        local_ms: 8.2,
        global_ms: 72.0,
        push_pull_ms: 17.0,
        table_mb: 77.0,
        link_mb: 31.1,
        rate: 8.3,
    },
    Scene {
        on: "Oriental, 15.6k elements",
        run: "builtin:tea-room --elements 10400 --set refinement=21",
        links: 776e3,
        link_seconds: 13.0,
        local_ms: 10.8,
        global_ms: 81.4,
        push_pull_ms: 18.9,
        table_mb: 60.9,
        link_mb: 36.0,
        rate: 7.5,
    },
];

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for scene in &SCENES {
        let run = format!("{} {AS_THERE}", scene.run);
        let mut push = |place, what: &str, theirs, value: fn(&[&Measurement]) -> Option<f64>| {
            rows.push(Row::number(METHOD, place, what, scene.on, theirs, &[&run], value).slow());
        };
        push("Table 1", "links", (scene.links, "", Near), |m| m[0].fact("/links"));
        push("Table 1", "frames a second", (scene.rate, "1/s", Higher), |m| m[0].rate());
        push("Table 2", "initial linking", (scene.link_seconds, "s", Lower), |m| {
            Some(m[0].prepare_ms(&["links/"])? / 1e3)
        });
        push("Table 2", "local pass, four steps", (scene.local_ms, "ms", Lower), |m| m[0].frame_ms(&["/local/"]));
        push("Table 2", "global pass, four steps", (scene.global_ms, "ms", Lower), |m| m[0].frame_ms(&["/global/"]));
        push("Table 2", "push and pull, four steps", (scene.push_pull_ms, "ms", Lower), |m| {
            m[0].frame_ms(&["/push/", "/pull/"])
        });
        push("Table 2", "tables of light", (scene.table_mb, "MB", Lower), |m| Some(m[0].fact("/table_bytes")? / 1e6));
        push("Table 2", "links", (scene.link_mb, "MB", Lower), |m| Some(m[0].fact("/link_bytes")? / 1e6));
    }
    let error: (&'static str, fn(&Measurement) -> Option<f64>) = ("relative MSE", Measurement::relative_mse);
    // A step is a bounce in the symmetric scheme: as many as the reference has.
    let symmetric = "builtin:cornell-box --elements 4000 --method antiradiance --set scheme=symmetric --set bins=128 \
                     --bounces 8 --diffuse --size 128x96 --spp 4";
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 2",
        ("relative MSE by step", "no shadows, too dark, too bright, almost converged after 4 of 8 steps"),
        "a box with an object",
        vary(symmetric, "--set iterations=", &["1", "2", "3", "4", "8"]),
        error,
        Trend::Falls,
    ));
    rows.push(Row::not(
        METHOD,
        "Fig. 5",
        "convergence of both schemes over 300 steps",
        "`cargo bench --bench antiradiance` writes both curves as target/antiradiance-convergence.csv",
    ));
    let filtered = format!("builtin:cornell-box --elements 4000 --set bins=512 {FINE}");
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 8",
        ("relative MSE without and with filtering", "filtering takes away the pattern of the bins"),
        "a blocker of 4 x 4 samples",
        vary(&filtered, "--set spread=", &["none", "gaussian"]),
        error,
        Trend::Falls,
    ));
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 13",
        ("relative MSE by bins", "128 bins blur shadows, 512 are sharper"),
        "a box",
        vary(&format!("builtin:cornell-box --elements 4000 {FINE}"), "--set bins=", &["128", "512"]),
        error,
        Trend::Falls,
    ));
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 12",
        ("energy over the reference's in a scene lit only indirectly", "comparable to path tracing"),
        "a maze",
        vs_one(&format!("builtin:maze --elements 6000 --set bins=200 {FINE}")),
        ("|energy - 1|", |m| Some((m.energy()? - 1.0).abs())),
        Trend::AtMost(0.1),
    ));
    rows.push(
        Row::error_trend(
            METHOD,
            "Fig. 14",
            ("energy over the reference's in the untextured office", "overall levels of light are satisfactory"),
            "office against PBRT",
            vs_one(&format!("builtin:office --elements 18200 --set bins=200 {FINE}")),
            ("|energy - 1|", |m| Some((m.energy()? - 1.0).abs())),
            Trend::AtMost(0.1),
        )
        .slow(),
    );
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 15",
        ("energy over the reference's in a glossy box", "a glossy object lights floor and ceiling by direction"),
        "a glossy cube against PBRT",
        vs_one(&format!("builtin:cornell-box {GLOSSY} --bounces 3 --size 128x96 --spp 4")),
        ("|energy - 1|", |m| Some((m.energy()? - 1.0).abs())),
        Trend::AtMost(0.1),
    ));
    let shown = |options: &str| format!("{options} --method antiradiance --bounces 3 --size 240x150 --spp 4");
    rows.push(
        Row::pictures(
            METHOD,
            "Fig. 1 and 16",
            ("the scenes of the tables", "light and objects are moved at 9, 7.8 and 6.8 frames a second"),
            "Office, Character, glossy bust, Oriental",
            &[
                ("office", shown("builtin:office")),
                ("dancer", shown("builtin:dancer")),
                ("glossy Cornell box", format!("builtin:cornell-box {GLOSSY} --bounces 3 --size 240x150 --spp 4")),
                ("tea-room", shown("builtin:tea-room")),
            ],
        )
        .slow(),
    );

    rows.push(Row::not(
        METHOD,
        "Fig. 14 (e) and (f)",
        "instant radiosity; form factors with visibility",
        "instant radiosity is not one of our methods; explicit visibility on the same elements is the nearest to (f)",
    ));
    rows.push(Row::not(
        METHOD,
        "Fig. 3, 4, 6, 7, 9, 10 and 11",
        "operators, bins, passes and tables",
        "drawings that explain the algorithm",
    ));
    rows
}

/// One run, captioned by its scene.
fn vs_one(run: &str) -> Vec<(String, String)> {
    vec![(run.split(' ').next().unwrap_or_default().to_owned(), run.to_owned())]
}
