//! Rows of [Dong2007]: implicit visibility.
//!
//! [Dong2007]: crate::methods::PAPERS

use super::row::Better::{Higher, Lower, Near};
use super::row::{Measurement, Row, Trend, vary};

const METHOD: &str = "implicit-visibility";
/// About 3,400 vertices and one bounce, as the monster.
const MONSTER: &str =
    "builtin:cornell-box --elements 3400 --method implicit-visibility --bounces 1 --size 160x90 --spp 1";
const FINE: &str = "--method implicit-visibility --bounces 1 --diffuse --size 128x96 --spp 4";

/// Table 1: bins a side of a cube's face, and milliseconds of update, hierarchy, refine and push, illumination.
const TABLE_1: [(&str, [f64; 4]); 3] =
    [("8", [12.0, 23.0, 30.0, 35.0]), ("12", [12.0, 43.0, 35.0, 40.0]), ("16", [12.0, 78.0, 60.0, 48.0])];
const TOTALS: [f64; 3] = [112.0, 148.0, 218.0];

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for ((bins, stages), total) in TABLE_1.into_iter().zip(TOTALS) {
        let run = format!("{MONSTER} --set bins={bins}");
        let mut push = |what: &str, ms: f64, value: fn(&[&Measurement]) -> Option<f64>| {
            let what = format!("{what}, 6 x {bins} x {bins} bins");
            let on = "monster, 3378 vertices, GeForce 8800";
            rows.push(Row::number(METHOD, "Table 1", what, on, (ms, "ms", Lower), &[&run], value));
        };
        push("update of elements", stages[0], |m| m[0].frame_ms(&["/update elements/"]));
        push("link creation", stages[1], |m| m[0].frame_ms(&["/create links/"]));
        push("refine and push", stages[2], |m| m[0].frame_ms(&["/refine and push/"]));
        push("illumination, one bounce", stages[3], |m| m[0].frame_ms(&["/see lights/", "frame/implicit-visibility/"]));
        push("total", total, |m| Some(m[0].cost.frame_ms.median));
        let on = "monster, 3378 vertices, GeForce 8800";
        let share = (stages[1] / total, "of the frame", Near);
        let what = format!("share of link creation, 6 x {bins} x {bins} bins");
        rows.push(Row::number(METHOD, "Table 1", what, on, share, &[&run], |m| {
            Some(m[0].frame_ms(&["/create links/"])? / m[0].cost.frame_ms.median)
        }));
    }
    rows.push(Row::number(
        METHOD,
        "Sec. 5",
        "frames a second, direct and indirect light",
        "teapot, 3878 vertices, GeForce 8800",
        (7.0, "1/s", Higher),
        &[MONSTER],
        |m| m[0].rate(),
    ));
    let error: (&'static str, fn(&Measurement) -> Option<f64>) = ("relative MSE", Measurement::relative_mse);
    let run = format!("builtin:cornell-box --elements 4000 {FINE}");
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 7, 8 and 9",
        ("relative MSE by bins", "artifacts are reduced by more bins; 6 x 16 x 16 differs little from path tracing"),
        "teapot, monster",
        vary(&run, "--set bins=", &["8", "12", "16"]),
        error,
        Trend::Falls,
    ));
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 10c",
        ("relative MSE, hierarchical and brute force", "virtually no difference"),
        "teapot",
        vary(
            &format!("builtin:cornell-box --elements 1500 --set bins=12 {FINE}"),
            "--set brute_force=",
            &["false", "true"],
        ),
        error,
        Trend::Flat(1.1),
    ));
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 10d",
        ("relative MSE by vertices", "coarsely tessellated objects leak"),
        "teapot of 792 vertices",
        vary(&format!("builtin:cornell-box --set bins=12 {FINE}"), "--elements ", &["800", "4000"]),
        error,
        Trend::Falls,
    ));
    rows.extend(pictures());
    rows.push(
        Row::trend(
            METHOD,
            "Sec. 5",
            ("frame time over N log N", "roughly O(N log N)"),
            "several models",
            vary(
                "builtin:tea-room --method implicit-visibility --set bins=8 --bounces 1 --size 160x90 --spp 1",
                "--elements ",
                &["16000", "32000", "64000"],
            ),
            ("ns", |m| {
                let count = m.fact("/elements")?;
                Some(1e6 * m.cost.frame_ms.median / (count * count.log2()))
            }),
            Trend::RisesAtMost(1.5),
        )
        .slow(),
    );
    rows
}

/// Figures without numbers.
fn pictures() -> [Row; 6] {
    let shown = |scene: &str, options: &str| {
        format!("builtin:{scene} --method implicit-visibility --size 240x150 --spp 4 {options}")
    };
    [
        Row::pictures(
            METHOD,
            "Fig. 1 and 6",
            ("shadows and indirect light between objects", "shadowing and indirect lighting effects between objects"),
            "teapot, chess pieces",
            &[
                ("light that comes straight from lights", shown("tea-room", "--camera table --bounces 0")),
                ("two bounces", shown("tea-room", "--camera table --bounces 2")),
            ],
        )
        .slow(),
        Row::pictures(
            METHOD,
            "Fig. 2",
            ("a deforming model", "all elements and links are made anew in each frame"),
            "flying dragon",
            &[("0 s", 0), ("1 s", 1), ("2 s", 2)]
                .map(|(caption, time)| (caption, shown("dancer", &format!("--bounces 1 --seconds {time}")))),
        )
        .slow(),
        Row::views(
            METHOD,
            "Fig. 3a",
            ("segments of the surface, and levels of the trees in them", "colour-coded surface segments"),
            "several models",
            &["charts", "level-2", "level-3"].map(|view| (view, shown("dancer", &format!("--view {view}")))),
        ),
        Row::pictures(
            METHOD,
            "Fig. 8",
            ("light with no, one and two bounces", "one-bounce lighting is sufficient for a pleasing result"),
            "monster on a plane",
            &[("no bounce", 0), ("one bounce", 1), ("two bounces", 2)]
                .map(|(caption, bounces)| (caption, shown("cornell-box", &format!("--diffuse --bounces {bounces}")))),
        ),
        Row::pictures(
            METHOD,
            "Fig. 11",
            ("glossy surfaces under direct light", "compares favourably to the reference solution"),
            "glossy direct light only; here glossy interreflection as well",
            &[("glossy Cornell box", shown("cornell-box", "--bounces 2 --edit material:0.roughness=0.4"))],
        ),
        Row::not(METHOD, "Fig. 4 and 5", "creation and refinement of links", "drawings that explain the algorithm"),
    ]
}
