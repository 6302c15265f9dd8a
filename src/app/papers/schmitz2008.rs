//! Rows of [Schmitz2008]: explicit visibility.
//!
//! [Schmitz2008]: crate::methods::PAPERS

use super::row::Better::{Higher, Lower, Near};
use super::row::{Measurement, Row, Trend, vary};

const METHOD: &str = "explicit-visibility";
/// Links and bounces are what is measured: the picture is small.
const SMALL: &str = "--method explicit-visibility --bounces 3 --size 160x90 --spp 1";

/// One scene of Tables 1 and 2, system A: one GeForce 8800 Ultra.
struct Scene {
    /// As measured there.
    on: &'static str,
    /// Ours that stands for it.
    run: &'static str,
    /// Raw links for each that is kept.
    compression: f64,
    tree_ms: f64,
    links_ms: f64,
    /// Thousand rays a second.
    link_rays: f64,
    bounces_ms: f64,
    first_seconds: f64,
    rate: f64,
    is_slow: bool,
}

const SCENES: [Scene; 5] = [
    Scene {
        on: "COLORLAMP, 1.6k vertices",
        run: "builtin:cornell-box --elements 1600",
        compression: 3.6 / 0.5,
        tree_ms: 8.0,
        links_ms: 833.0,
        link_rays: 1930.0,
        bounces_ms: 3.0,
        first_seconds: 0.8,
        rate: 54.0,
        is_slow: false,
    },
    Scene {
        on: "TORSO, 7.1k vertices, deforming",
        run: "builtin:dancer --elements 7100",
        compression: 3.4 / 0.8,
        tree_ms: 111.0,
        links_ms: 413.0,
        link_rays: 4420.0,
        bounces_ms: 4.0,
        first_seconds: 0.5,
        rate: 65.0,
        is_slow: false,
    },
    Scene {
        on: "TEAROOM, 11.9k vertices",
        run: "builtin:tea-room --elements 11900",
        compression: 6.7 / 2.0,
        tree_ms: 71.0,
        links_ms: 680.0,
        link_rays: 4472.0,
        bounces_ms: 6.0,
        first_seconds: 0.8,
        rate: 65.0,
        is_slow: false,
    },
    Scene {
        on: "IPHI, 76.5k vertices",
        run: "builtin:church --elements 76500",
        compression: 42.0 / 12.0,
        tree_ms: 35.0,
        links_ms: 11_382.0,
        link_rays: 1721.0,
        bounces_ms: 54.0,
        first_seconds: 12.4,
        rate: 12.5,
        is_slow: true,
    },
    Scene {
        on: "CONFERENCE, 122.8k vertices",
        run: "builtin:office --elements 122800",
        compression: 73.0 / 14.0,
        tree_ms: 173.0,
        links_ms: 21_606.0,
        link_rays: 1454.0,
        bounces_ms: 57.0,
        first_seconds: 25.2,
        rate: 10.0,
        is_slow: true,
    },
];

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for scene in &SCENES {
        let run = format!("{} {SMALL}", scene.run);
        let mut push = |place, what: &str, theirs, value: fn(&[&Measurement]) -> Option<f64>| {
            let row = Row::number(METHOD, place, what, scene.on, theirs, &[&run], value);
            rows.push(if scene.is_slow { row.slow() } else { row });
        };
        push("Table 1", "raw links for each kept", (scene.compression, ": 1", Near), |m| {
            Some(m[0].fact("/raw_links")? / m[0].fact("/links")?)
        });
        push(
            "Table 2",
            "hierarchy over the triangles (here: refit after a deformation)",
            (scene.tree_ms, "ms", Lower),
            |m| m[0].prepare_ms(&["refit"]),
        );
        push("Table 2", "link generation", (scene.links_ms, "ms", Lower), |m| m[0].prepare_ms(&["links/"]));
        push("Table 2", "rays of link generation", (scene.link_rays, "thousand/s", Higher), |m| {
            Some(m[0].fact("/rays")? / m[0].prepare_ms(&["links/"])?)
        });
        push("Table 2", "three bounces", (scene.bounces_ms, "ms", Lower), |m| m[0].frame_ms(&["/bounce "]));
        push("Table 2", "first frame", (scene.first_seconds, "s", Lower), |m| {
            Some((m[0].cost.prepare_ms + m[0].cost.frame_ms.median) / 1e3)
        });
        push("Table 2", "frames a second", (scene.rate, "1/s", Higher), |m| m[0].rate());
    }
    rows.push(Row::trend(
        METHOD,
        "Fig. 2",
        ("rays a second by rays per vertex", "more rays per vertex: more coherent, higher throughput"),
        "several scenes",
        vary(
            &format!("builtin:tea-room --elements 11900 {SMALL}"),
            "--set rays_per_element=",
            &["16", "64", "256", "576"],
        ),
        ("thousand/s", |m| Some(m.fact("/rays")? / m.prepare_ms(&["links/"])?)),
        Trend::Rises,
    ));
    rows.push(Row::error_trend(
        METHOD,
        "Fig. 5",
        ("relative MSE against an unbiased renderer", "converges to a correct solution, differs at shadow borders"),
        "TEAROOM against Luxrender",
        vary(
            "builtin:tea-room --method explicit-visibility --bounces 3 --size 160x90 --spp 4",
            "--elements ",
            &["16000", "24000", "40000"],
        ),
        ("relative MSE", Measurement::relative_mse),
        Trend::Falls,
    ));
    rows.push(Row::trend(
        METHOD,
        "Sec. 4.1",
        ("time of bounces for each link", "light exchange is linear in the number of links"),
        "complexity analysis",
        vary(&format!("builtin:tea-room {SMALL}"), "--elements ", &["10000", "20000", "40000"]),
        ("ns a link", |m| Some(1e6 * m.frame_ms(&["/bounce "])? / (3.0 * m.fact("/links")?))),
        Trend::RisesAtMost(1.5),
    ));
    let shown = |scene: &str, options: &str| {
        format!("builtin:{scene} --method explicit-visibility --size 240x150 --spp 4 {options}")
    };
    rows.push(Row::pictures(
        METHOD,
        "Fig. 1, test scenes",
        ("the scenes of the tables", "TORSO, TEAROOM, CONFERENCE, IPHI"),
        "7.1k to 123k vertices",
        &["dancer", "tea-room", "office", "church"].map(|scene| (scene, shown(scene, "--bounces 3"))),
    ));
    rows.push(Row::views(
        METHOD,
        "Fig. 4",
        ("direct light, indirect light, both", "the combined image is a sum of the two"),
        "TEAROOM",
        &[
            ("direct", shown("tea-room", "--bounces 3 --direct-only")),
            ("indirect", shown("tea-room", "--bounces 3 --indirect-only")),
            ("both", shown("tea-room", "--bounces 3")),
        ],
    ));
    rows.push(
        Row::pictures(
            METHOD,
            "Fig. 6",
            ("a large model with one and four bounces", "our system is even able to handle large models"),
            "CONFERENCE, 122.8k vertices",
            &[
                ("one bounce", shown("office", "--elements 122800 --bounces 1")),
                ("four bounces", shown("office", "--elements 122800 --bounces 4")),
            ],
        )
        .slow(),
    );
    rows.push(Row::not(
        METHOD,
        "Table 2, system B",
        "two GPUs share the elements",
        "elements are shared in proportion to measured rates, but this takes a machine of two GPUs",
    ));
    rows.push(Row::not(
        METHOD,
        "Table 1",
        "memory of the kd-tree",
        "the hierarchy is a BVH of four children, not a kd-tree",
    ));
    rows
}
