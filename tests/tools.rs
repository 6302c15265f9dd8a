//! What decides whether a run of the tests counts, and what the dependencies are allowed to be.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

const GOOD: &str = "running 2 tests\ntest a ... ok\ntest b ... ok\n\n\
                    test result: ok. 2 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.10s\n\
                    test result: ok. 5 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.10s\n";

/// Whether `tools/verdict` takes a run for good, and what it says.
fn verdict(log: &str, status: i32, fewest: u32) -> (bool, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.log");
    std::fs::write(&path, log).unwrap();
    let output = Command::new(root().join("tools/verdict"))
        .arg(&path)
        .args([status.to_string(), fewest.to_string()])
        .output()
        .expect("bash runs tools/verdict");
    let said = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8(said).unwrap())
}

#[test]
fn a_run_counts_only_when_every_test_did() {
    let (good, said) = verdict(GOOD, 0, 7);
    assert!(good && said.contains("total: 7 passed, 0 failed, 0 ignored in 2 programs"), "{said}");
    let replaced = |from: &str, to: &str| GOOD.replace(from, to);
    let cases = [
        (GOOD.to_owned(), 0, 8, "only 7 tests ran, at least 8"),
        // A crash of a test program has no line of its own.
        (GOOD.to_owned(), 101, 7, "ended with 101"),
        (String::new(), 0, 1, "only 0 tests ran"),
        (replaced("5 passed; 0 failed", "4 passed; 1 failed"), 0, 5, "1 tests failed"),
        (replaced("5 passed; 0 failed; 0 ignored", "5 passed; 0 failed; 3 ignored"), 0, 5, "3 tests were ignored"),
        // A missing driver fails the tests that need it; a missing tool, or device feature, is said and counts too.
        (format!("{GOOD}skipped: this device has no ray query\n"), 0, 7, "this device has no ray query"),
        (format!("{GOOD}skipped: xdotool is not installed (package xdotool)\n"), 0, 7, "xdotool"),
    ];
    for (log, status, fewest, part) in cases {
        let (good, said) = verdict(&log, status, fewest);
        assert!(!good && said.contains(part), "{part:?} is not in {said:?}");
    }
    // What a clean clone does without.
    let (good, said) = verdict(&format!("{GOOD}skipped: shared/x does not exist (set LINKLIGHT_SHARED)\n"), 0, 7);
    assert!(good, "{said}");
}

#[test]
fn continuous_integration_holds_the_run_to_its_verdict() {
    let test = std::fs::read_to_string(root().join("tools/test")).unwrap();
    assert!(test.contains("exec tools/verdict \"$log\" \"$status\" \"$fewest_tests\""), "{test}");
    assert!(test.contains("--show-output"), "a skipped test would not be seen");
    let floor = test.lines().find_map(|line| line.strip_prefix("readonly fewest_tests=")).expect("a floor");
    assert!(floor.parse::<u32>().unwrap() > 500, "{floor}");
}

/// Whether an SPDX expression, without exceptions of its own, is met by licences of `allowed`.
fn is_allowed(expression: &str, allowed: &[String]) -> bool {
    expression.replace('/', " OR ").split(" AND ").all(|part| {
        let part = part.trim().trim_start_matches('(').trim_end_matches(')');
        part.split(" OR ").any(|licence| allowed.iter().any(|allowed| allowed == licence.trim()))
    })
}

fn allowed_licences() -> Vec<String> {
    let text = std::fs::read_to_string(root().join("deny.toml")).unwrap();
    let list = text.split_once("allow = [").expect("a list").1.split_once(']').expect("its end").0;
    list.split(',').map(|entry| entry.trim().trim_matches('"').to_owned()).filter(|entry| !entry.is_empty()).collect()
}

#[test]
fn licences_are_read_as_they_are_written() {
    let allowed = ["MIT", "Zlib", "OFL-1.1"].map(str::to_owned);
    for good in ["MIT", "Apache-2.0 OR MIT", "Unlicense/MIT", "(MIT OR X) AND OFL-1.1", "Apache-2.0 / MIT"] {
        assert!(is_allowed(good, &allowed), "{good}");
    }
    for bad in ["GPL-3.0", "MIT AND GPL-3.0", "(GPL-2.0 OR X) AND OFL-1.1", "MIT-0", ""] {
        assert!(!is_allowed(bad, &allowed), "{bad}");
    }
}

/// Of what is built here; `tools/audit` looks at all platforms, and at advisories.
#[test]
fn every_dependency_has_a_licence_that_is_allowed() {
    let allowed = allowed_licences();
    assert!(allowed.len() > 5, "{allowed:?}");
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--offline", "--locked", "--filter-platform"])
        .arg(format!("{}-unknown-linux-gnu", std::env::consts::ARCH))
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let resolved: Vec<&str> =
        metadata["resolve"]["nodes"].as_array().unwrap().iter().filter_map(|node| node["id"].as_str()).collect();
    let packages = metadata["packages"].as_array().unwrap();
    let mut checked = 0;
    for package in packages.iter().filter(|package| package["id"].as_str().is_some_and(|id| resolved.contains(&id))) {
        let licence = package["license"].as_str().unwrap_or("none");
        assert!(is_allowed(licence, &allowed), "{}: {licence}, allowed are {allowed:?}", package["name"]);
        checked += 1;
    }
    assert!(checked > 150, "{checked} packages");
    assert!(Path::new(&root()).join("tools/audit").exists());
}
