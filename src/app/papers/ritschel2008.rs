//! Rows of [Ritschel2008]: coherent surface shadow maps.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use super::row::Better::{Higher, Near};
use super::row::{Measurement, Row, Trend, vary};

const METHOD: &str = "surface-shadow-maps";
const METHOD_OPTION: &str = "--method surface-shadow-maps";
/// Small enough for a software driver.
const TEXTURED: &str = "--method surface-shadow-maps --set atlas_resolution=64";
/// Few pixels: only the maps are of interest.
const MAPS: &str = "--method surface-shadow-maps --display lightmap --bounces 0 --size 32x32 --spp 1";
const FINE: &str = "--method surface-shadow-maps --bounces 1 --diffuse --size 96x72 --spp 4";

/// Table 2: ratio by sequence for atlases of 32, 64 and 128 texels a side.
const TABLE_2: [(&str, [f64; 3]); 3] =
    [("greedy", [5.6, 8.8, 12.8]), ("zig-zag", [7.1, 11.2, 15.7]), ("spiral", [7.4, 11.7, 16.9])];

/// Table 1: our scene, frames a second of 640 x 480 pixels and of 128 x 128 texels, with one and two bounces.
const TABLE_1: [(&str, &str, [f64; 2], [f64; 2]); 2] = [
    ("Cornell Box", "builtin:cornell-box --set atlas_resolution=64", [5.2, 1.4], [35.7, 10.4]),
    ("Cornell Church", "builtin:church --set atlas_resolution=128", [4.1, 0.7], [11.9, 3.1]),
];

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for (sequence, ratios) in TABLE_2 {
        for (resolution, ratio) in [32, 64, 128].into_iter().zip(ratios) {
            let run = format!(
                "builtin:cornell-box {MAPS} --set map_resolution=32 --set atlas_resolution={resolution} --set sequence={sequence}"
            );
            let what = format!("compression, {sequence}, atlas {resolution} x {resolution}");
            let theirs = (ratio, ": 1", Higher);
            let row = Row::number(METHOD, "Table 2", what, "Cornell box, 6 x 32 x 32", theirs, &[&run], |m| {
                m[0].fact("/ratio")
            });
            rows.push(if resolution == 128 { row.slow() } else { row });
        }
    }
    let church = format!(
        "builtin:church {MAPS} --set map_resolution=64 --set atlas_resolution=128 --set map_until=lit --set map_sharing=2"
    );
    rows.push(
        Row::number(
            METHOD,
            "Sec. 5",
            "compression of the church",
            "Cornell Church",
            (21.4, ": 1", Higher),
            &[&church],
            |m| m[0].fact("/ratio"),
        )
        .slow(),
    );
    let runs: Vec<String> =
        ["cornell-box", "two-rooms"].map(|scene| format!("builtin:{scene} {MAPS} --set map_resolution=64")).to_vec();
    let runs: Vec<&str> = runs.iter().map(String::as_str).collect();
    rows.push(
        Row::number(METHOD, "Sec. 5", "best compression", "several scenes", (41.5, ": 1", Higher), &runs, |m| {
            m.iter().map(|m| m.fact("/ratio")).try_fold(0.0f64, |best, ratio| Some(best.max(ratio?)))
        })
        .slow(),
    );
    for (on, scene, pixels, texels) in TABLE_1 {
        for (index, bounces) in [1, 2].into_iter().enumerate() {
            let run =
                format!("{scene} {METHOD_OPTION} --display final-gather --bounces {bounces} --size 160x120 --spp 1");
            let (there, what) = (pixels[index] * 640.0 * 480.0 / 1e6, format!("pixels gathered, {bounces} bounces"));
            rows.push(
                Row::number(METHOD, "Table 1", what, on, (there, "million/s", Higher), &[&run], |m| {
                    Some(160.0 * 120.0 / 1e6 * m[0].rate()?)
                })
                .slow(),
            );
            let run = format!("{scene} {METHOD_OPTION} --display lightmap --bounces {bounces} --size 160x120 --spp 1");
            let (there, what) = (texels[index] * 128.0 * 128.0 / 1e6, format!("texels gathered, {bounces} bounces"));
            rows.push(
                Row::number(METHOD, "Table 1", what, on, (there, "million/s", Higher), &[&run], |m| {
                    Some(m[0].fact("/texels")? / 1e6 * m[0].rate()?)
                })
                .slow(),
            );
        }
    }
    let run = |display: &str| {
        format!("builtin:cornell-box {TEXTURED} --display {display} --bounces 1 --size 160x120 --spp 1")
    };
    rows.push(
        Row::number(
            METHOD,
            "Table 1",
            "a frame of texels for each of pixels, one bounce",
            "Cornell Box, 128 x 128 texels, 640 x 480 pixels",
            (35.7 / 5.2, ": 1", Near),
            &[&run("lightmap"), &run("final-gather")],
            |m| {
                // At the paper's number of texels and pixels.
                let texels = m[0].rate()? * m[0].fact("/texels")? / (128.0 * 128.0);
                Some(texels / (m[1].rate()? * 160.0 * 120.0 / (640.0 * 480.0)))
            },
        )
        .slow(),
    );
    let error: (&'static str, fn(&Measurement) -> Option<f64>) = ("relative MSE", Measurement::relative_mse);
    rows.push(
        Row::error_trend(
            METHOD,
            "Fig. 13",
            ("relative MSE by atlas resolution", "a finer atlas reduces banding"),
            "Cornell box",
            vary(
                &format!("builtin:cornell-box {FINE} --display lightmap"),
                "--set atlas_resolution=",
                &["32", "64", "96"],
            ),
            error,
            Trend::Falls,
        )
        .slow(),
    );
    rows.push(
        Row::error_trend(
            METHOD,
            "Fig. 14",
            ("relative MSE, maps and rays as visibility", "the error of the maps is hard to perceive"),
            "6 x 64 x 64 maps, 64 x 64 atlas",
            vary(
                &format!(
                    "builtin:cornell-box {FINE} --display lightmap --set atlas_resolution=64 --set map_resolution=64"
                ),
                "--set visibility=",
                &["maps", "rays"],
            ),
            error,
            Trend::Flat(1.25),
        )
        .slow(),
    );
    rows.push(
        Row::error_trend(
            METHOD,
            "Fig. 15",
            ("energy over the reference's", "the distribution of light is nearly identical to pbrt's"),
            "Cornell box against pbrt",
            vec![("cornell-box".into(), format!("builtin:cornell-box {FINE} --set atlas_resolution=64"))],
            ("|energy - 1|", |m| Some((m.energy()? - 1.0).abs())),
            Trend::AtMost(0.02),
        )
        .slow(),
    );
    rows.push(Row::not(
        METHOD,
        "Sec. 5",
        "150 million evaluated senders a second, visibility included",
        "`cargo bench --bench surface_maps` measures look-ups and evaluated nodes against shadow rays",
    ));
    rows.push(Row::not(
        METHOD,
        "Table 1, Cornell Heads",
        "frames a second",
        "no built-in scene has two heads in a box",
    ));
    rows.extend(pictures());
    rows
}

/// Figures without numbers.
fn pictures() -> [Row; 6] {
    let bounced = |bounces: u32, scene: &str, options: &str| {
        format!("builtin:{scene} {METHOD_OPTION} --bounces {bounces} --size 240x150 --spp 4 {options}")
    };
    let shown = |scene: &str, options: &str| bounced(1, scene, options);
    let glossy = "--edit material:0.roughness=0.3 --edit material:0.metallic=1";
    [
        Row::pictures(
            METHOD,
            "Fig. 1",
            ("two bounces and a glossy one, gathered by pixels", "normal maps at 0.4 to 1.4 frames a second"),
            "several scenes",
            &["tea-room", "office"]
                .map(|scene| (scene, bounced(2, scene, "--set visibility=rays --display final-gather"))),
        )
        .slow(),
        Row::views(
            METHOD,
            "Fig. 3, 6 and 7",
            (
                "charts of the atlas, the walk over its texels, the depth map of one",
                "zig-zag and spiral walks over charts",
            ),
            "bunny, Cornell box",
            &[
                ("charts", shown("cornell-box", "--view atlas")),
                ("spiral", shown("cornell-box", "--view traversal-order --set sequence=spiral")),
                ("zig-zag", shown("cornell-box", "--view traversal-order --set sequence=zig-zag")),
                ("depth cube map", shown("cornell-box", "--view depth-map --set pick=120,110")),
            ],
        ),
        Row::views(
            METHOD,
            "Fig. 11",
            ("a glossy box, and how many nodes its pixels gather from", "the cut grows where reflections are sharp"),
            "glossy Cornell Box",
            &[
                ("light", shown("cornell-box", glossy)),
                ("nodes of the cut", shown("cornell-box", &format!("{glossy} --view cut-size"))),
            ],
        )
        .slow(),
        Row::pictures(
            METHOD,
            "Fig. 12",
            ("a glossy box without jitter and with it", "the bias of the senders shows; jittered frames converge"),
            "highly glossy Cornell Box",
            &[
                ("without jitter", shown("cornell-box", &format!("{glossy} --set gather_jitter=false"))),
                ("jittered", shown("cornell-box", &format!("{glossy} --set gather_jitter=true"))),
            ],
        )
        .slow(),
        Row::pictures(
            METHOD,
            "Fig. 17",
            ("gathered by pixels, and by texels of the atlas", "indirect light itself is smooth in both"),
            "two heads",
            &["final-gather", "lightmap"]
                .map(|display| (display, shown("cornell-box", &format!("--display {display}")))),
        )
        .slow(),
        Row::not(
            METHOD,
            "Fig. 2, 4, 8, 9 and 10",
            "limits of maps from outside, queries, the tree",
            "drawings that explain the algorithm",
        ),
    ]
}
