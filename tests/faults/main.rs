//! Everything that can fail fails once: each Vulkan call and allocation, each access to a file. Whatever it is, the work
//! ends in an error of its type (or does as well without), with nothing left behind on the device or the disk.
//!
//! Renders fail at a sample of calls: the first and the last of each name, and some between. `LINKLIGHT_FAULTS=all`
//! takes every one of them, which is hours; a number takes about so many a method.

mod device;
mod renders;

use std::process::Command;
use std::sync::Mutex;

/// The layer and the counts are the process's: one test at a time.
static TURN: Mutex<()> = Mutex::new(());

/// Runs the test `name` of this program in a process with a cache folder of its own, which the environment names. True
/// in that process.
fn is_apart(name: &str) -> bool {
    const APART: &str = "LINKLIGHT_FAULTS_APART";
    if std::env::var_os(APART).is_some() {
        return true;
    }
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(std::env::current_exe().unwrap())
        .args([name, "--exact", "--nocapture"])
        .env(APART, "1")
        .env("XDG_CACHE_HOME", folder.path())
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let out = text(&output.stdout);
    print!("{}", out.lines().filter(|line| line.starts_with("  ")).map(|line| format!("{line}\n")).collect::<String>());
    assert!(output.status.success() && out.contains("1 passed"), "{out}\n{}", text(&output.stderr));
    false
}

/// Which of `names` (from 1) to let fail: the first and last of each name and about `more` of the others, or all.
fn sample(names: &[&'static str], more: usize) -> Vec<u64> {
    let more = match std::env::var("LINKLIGHT_FAULTS") {
        Ok(text) if text == "all" => names.len(),
        Ok(text) => text.parse().expect("LINKLIGHT_FAULTS is a number or all"),
        Err(_) => more,
    };
    let step = (names.len() / more.max(1)).max(1);
    let is_end = |at: usize| {
        let name = names[at];
        !names[..at].contains(&name) || !names[at + 1..].contains(&name)
    };
    (0..names.len()).filter(|at| at % step == step / 2 || is_end(*at)).map(|at| at as u64 + 1).collect()
}

#[test]
fn samples_hold_the_ends_of_each_name() {
    let names = ["a", "a", "b", "a", "b", "c", "a"];
    assert_eq!(sample(&names, 0), [1, 3, 5, 6, 7]);
}
