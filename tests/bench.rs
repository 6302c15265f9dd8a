//! `linklight bench` as a black box: the file, comparison with an older file, and what is refused.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use linklight::report::bench_file::BenchFile;
use linklight::report::statistics::Verdict;

fn bench(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    program.env_remove("RUST_LOG").env("LP_PERF", "").stdin(Stdio::null()).arg("bench").args(arguments);
    let output = program.output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    output
}

fn measured(file: &Path) -> Output {
    let output = file.to_str().unwrap();
    bench(&[
        "builtin:perpendicular-plates",
        "-o",
        output,
        "--method",
        "explicit-visibility",
        "--vary",
        "bounces=0,64",
        "--seconds",
        "0",
        "--",
        "--size",
        "16x16",
        "--elements",
        "600",
    ])
}

#[track_caller]
fn out(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn sixty_four_bounces_take_longer_than_none_and_files_compare() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new.json");
    let printed = out(&measured(&path));
    let file = BenchFile::read(&path).unwrap();
    assert_eq!((file.subjects.len(), file.yardsticks.len()), (2, 1));
    assert!(file.environment.contains_key("LP_PERF"), "{:?}", file.environment);
    let [none, many] = [&file.subjects[0], &file.subjects[1]];
    assert_eq!([none.frame.values.len(), many.frame.values.len()], [file.rounds as usize; 2]);
    assert!(file.rounds >= 12 && file.warm_up.rounds >= 8);
    assert_eq!(none.against_first, None);
    let against = many.against_first.unwrap();
    assert_eq!(against.verdict, Verdict::Slower, "{against:?}");
    assert!(printed.contains("slower than the first"), "{printed}");
    let yardstick = &file.yardsticks[0];
    for values in [&yardstick.copy_ms, &yardstick.multiply_add_ms, &yardstick.empty_ms, &yardstick.cpu_ms] {
        assert!(values.len() == file.rounds as usize && values.iter().all(|ms| *ms > 0.0));
    }
    let gather = many.passes.iter().find(|pass| pass.path.contains("bounce 64/gather/links")).unwrap();
    assert!(gather.bytes > 0 && gather.bandwidth_share > 0.0 && gather.times.values.len() == file.rounds as usize);

    // The same against itself: nothing changed. Against one where everything was half as long: slower.
    let new = path.to_str().unwrap();
    let same = out(&bench(&["--read", new, "--against", new, "--fail-slower"]));
    assert!(same.contains("no change shown") && !same.contains("slower"), "{same}");
    let mut faster = file.clone();
    for subject in &mut faster.subjects {
        subject.frame.values.iter_mut().for_each(|ms| *ms *= 0.1);
    }
    let old = folder.path().join("old.json");
    faster.write(&old).unwrap();
    let output = bench(&["--read", new, "--against", old.to_str().unwrap(), "--fail-slower"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stdout).contains("slower"), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("slower than before"), "{output:?}");

    // Other settings are another subject.
    for subject in &mut faster.subjects {
        subject.settings.insert("bounces".into(), 7.into());
    }
    faster.write(&old).unwrap();
    let output = bench(&["--read", new, "--against", old.to_str().unwrap()]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("no subject in common"), "{output:?}");
}

#[test]
fn what_is_no_measurement_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.json");
    for (text, message) in [
        ("", "EOF"),
        ("{}", "schema null"),
        (r#"{"schema": "linklight-bench", "version": 2}"#, "version 2"),
        (r#"{"schema": "linklight-bench", "version": 1}"#, "missing field"),
    ] {
        std::fs::write(&path, text).unwrap();
        let bad = path.to_str().unwrap();
        let output = bench(&["--read", bad, "--against", bad]);
        let log = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{log}");
        assert!(log.contains(message), "{message:?} is not in: {log}");
    }
    for arguments in [&["-o", "x.json"][..], &["builtin:furnace"], &["builtin:furnace", "-o", "x", "--read", "y"]] {
        assert_eq!(bench(arguments).status.code(), Some(2), "{arguments:?}");
    }
}
