//! `linklight render --target-error` as a black box.

use std::process::{Command, Output, Stdio};

fn render(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    program.env_remove("RUST_LOG").stdin(Stdio::null()).arg("render").args(arguments);
    let output = program.output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    output
}

/// The number after `words`, of the last line that has them.
fn number(text: &str, words: &str) -> f64 {
    let line = text.lines().rev().find(|line| line.contains(words)).unwrap_or_else(|| panic!("{words:?} in {text}"));
    let rest = &line[line.find(words).unwrap() + words.len()..];
    let end = rest.trim_start().find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.trim_start().len());
    rest.trim_start()[..end]
        .trim_end_matches('.')
        .parse()
        .unwrap_or_else(|_| panic!("a number after {words:?} in {line}"))
}

#[test]
fn settings_are_picked_for_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("a.png");
    let of =
        ["builtin:cornell-empty", "-o", picture.to_str().unwrap(), "--size", "64x64", "--bounces", "1", "--diffuse"];
    let output = render(&[&of[..], &["--target-error", "0.05"]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && picture.is_file(), "{text}");
    assert!(text.contains("pilot --method explicit-visibility --elements 2500"), "{text}");
    assert!(number(&text, "achieved relative MSE") <= 0.05, "{text}");
    assert!(number(&text, "predicted relative MSE") > 0.0, "{text}");

    // Paths follow their law: half the error, twice the samples.
    let output = render(&[&of[..], &["--target-error", "0.1", "--method", "path-tracing"]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    let (predicted, achieved) = (number(&text, "predicted relative MSE"), number(&text, "achieved relative MSE"));
    assert!(achieved <= 0.1 && predicted <= 0.1 && (0.3..3.0).contains(&(predicted / achieved)), "{text}");
}

#[test]
fn what_has_no_target_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("a.png").to_str().unwrap().to_owned();
    let cases: [(&[&str], &str); 3] = [
        (&["builtin:furnace", "-o", &picture, "--method", "auto"], "--target-error"),
        (&["builtin:furnace", "-o", &picture, "--target-error", "0"], "above 0"),
        (&["builtin:furnace", "-o", &picture, "--target-error", "0.1", "--elements", "900"], "--elements"),
    ];
    for (arguments, expected) in cases {
        let output = render(arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
}
