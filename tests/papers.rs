//! `linklight papers` as a black box: one scene of one table, measured; the page and its data.

use std::process::{Command, Output, Stdio};

use serde_json::Value;

fn papers(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    let output = program.env_remove("RUST_LOG").stdin(Stdio::null()).arg("papers").args(arguments).output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    output
}

#[test]
fn rows_of_one_scene_are_measured_by_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    let output = papers(&["-o", path, "--only", "colorlamp", "--frames", "1", "--json", "-v"]);
    let log = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{log}");
    assert_eq!(log.matches("linklight render builtin:cornell-box").count(), 1, "shared by all rows: {log}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let written = std::fs::read(folder.path().join("papers.json")).unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&written).unwrap(), report);
    assert_eq!((&report["schema"], &report["version"]), (&"linklight-papers".into(), &1.into()));
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 7);
    for row in rows {
        let number = &row["outcome"]["number"];
        let (ours, ratio) = (number["ours"].as_f64().unwrap(), number["ratio"].as_f64().unwrap());
        assert!(ours > 0.0, "{row}");
        assert!((ratio * row["theirs"].as_f64().unwrap() / ours - 1.0).abs() < 1e-9);
        assert!(row["commands"][0].as_str().unwrap().starts_with("linklight render builtin:cornell-box"));
    }
    let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
    assert_eq!(page.matches("<tr class=").count(), 7);
}

#[test]
fn what_is_left_out_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    let output = papers(&["-o", path, "--method", "face-cluster", "--only", "Fig. 4", "--quick"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("left out by --quick") && text.contains("volume clusters is not one of our methods"),
        "{text}"
    );
    let output = papers(&["-o", path, "--only", "Table 99"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no row is left"));
}
