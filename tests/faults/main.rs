//! Everything that can fail fails once: each Vulkan call and allocation, each access to a file. Whatever it is, the work
//! ends in an error of its type (or does as well without), with nothing left behind on the device or the disk.
//!
//! Small work on a device fails at every call. Renders fail at a sample of theirs: `LINKLIGHT_FAULTS=all` takes every one
//! of them, which is hours; a number takes so many a method, and `LINKLIGHT_FAULTS_METHODS=path-tracing` one method alone.

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

/// Which of `count` (from 1) to let fail: about `some` of them at equal distances, or as the environment says.
fn sample(count: usize, some: usize) -> Vec<u64> {
    let some = match std::env::var("LINKLIGHT_FAULTS") {
        Ok(text) if text == "all" => count,
        Ok(text) => text.parse().expect("LINKLIGHT_FAULTS is a number or all"),
        Err(_) => some,
    };
    let some = some.clamp(1, count.max(1));
    (0..some).map(|i| ((2 * i + 1) * count / (2 * some)) as u64 + 1).filter(|at| *at <= count as u64).collect()
}

#[test]
fn samples_are_spread_and_within() {
    if std::env::var_os("LINKLIGHT_FAULTS").is_none() {
        assert_eq!(sample(10, 2), [3, 8]);
        assert_eq!(sample(3, 7), [1, 2, 3]);
        assert_eq!(sample(0, 7), [0; 0]);
    }
}
