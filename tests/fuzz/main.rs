//! Fuzzing on stable Rust: inputs of every kind that the program reads from outside, made by bending valid ones where
//! their structure is, and held to this: no panic, memory and time within stated bounds.
//!
//! A short run is part of the tests. A long one, in an optimised build:
//!
//! ```text
//! LINKLIGHT_FUZZ_RUNS=10000000 LINKLIGHT_FUZZ_SEED=7 cargo test --release --test fuzz inputs -- --nocapture
//! ```
//!
//! `LINKLIGHT_FUZZ_TARGET=gltf` takes one kind of input alone, and with `LINKLIGHT_FUZZ_FIRST=INDEX` it starts at that
//! execution: what a finding prints repeats it. An input that was mended goes to `regressions/TARGET-what-is-wrong`.

mod bombs;
mod files;
mod gltf_inputs;
mod mutate;
mod words;

#[path = "../gltf/sound.rs"]
mod sound;
#[path = "../gltf/support.rs"]
#[allow(dead_code, reason = "each test file uses its own part")]
mod support;

use mutate::Random;
use peak_alloc::PeakAlloc;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// The allocator counts for the whole process: one measurement at a time.
static TURN: Mutex<()> = Mutex::new(());

/// A kind of input.
pub struct Target {
    pub name: &'static str,
    /// Executions of a short run.
    pub runs: u64,
    pub seeds: fn() -> Vec<Vec<u8>>,
    pub mutate: fn(&mut Random, &[Vec<u8>]) -> Vec<u8>,
    /// Reads the input; files go into the folder.
    pub read: fn(&[u8], &Path),
    /// Most memory that one execution may take, bytes.
    pub max_bytes: usize,
}

const TARGETS: [&Target; 10] = [
    &gltf_inputs::GLTF,
    &files::ENVIRONMENT,
    &files::PICTURE,
    &files::SURFACE_MAPS,
    &files::CLUSTERS,
    &words::SETTINGS,
    &words::COMMAND_LINE,
    &words::STATE,
    &files::PROFILE,
    &files::BENCH,
];

/// No input takes more than milliseconds; a loaded machine gets its time.
const MAX_TIME: Duration = Duration::from_secs(10);

/// What is wrong with reading `input`, if anything is.
fn complaint(target: &Target, input: &[u8], folder: &Path) -> Option<String> {
    let start = Instant::now();
    let held = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let result = catch_unwind(AssertUnwindSafe(|| (target.read)(input, folder)));
    let bytes = ALLOCATOR.peak_usage().saturating_sub(held);
    let time = start.elapsed();
    if let Err(panic) = result {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        return Some(format!("it panics: {}", text.unwrap_or("without a message")));
    }
    if bytes > target.max_bytes {
        return Some(format!("it takes {bytes} bytes, {} are allowed", target.max_bytes));
    }
    (time > MAX_TIME).then(|| format!("it takes {time:?}"))
}

/// The input of one execution: the same for the same numbers.
fn input(target: &Target, seeds: &[Vec<u8>], seed: u64, index: u64) -> Vec<u8> {
    let name = target.name.bytes().fold(seed, |hash, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)));
    let mut random = Random::new(name ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    (target.mutate)(&mut random, seeds)
}

/// Findings of `runs` executions from `first` on, each with the input kept in a file.
fn fuzz(target: &Target, seed: u64, first: u64, runs: u64) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let seeds = (target.seeds)();
    let mut findings = Vec::new();
    for index in first..first.saturating_add(runs) {
        let input = input(target, &seeds, seed, index);
        if let Some(complaint) = complaint(target, &input, folder.path()) {
            let kept = std::env::temp_dir().join(format!("linklight-fuzz-{}-{seed}-{index}", target.name));
            std::fs::write(&kept, &input).unwrap();
            findings.push(format!(
                "{}, execution {index} of seed {seed} ({}): {complaint}",
                target.name,
                kept.display()
            ));
            if findings.len() == 20 {
                break;
            }
        }
    }
    findings
}

fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name}={text} is no whole number")))
}

#[test]
fn inputs_bent_in_any_way_are_harmless() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let only = std::env::var("LINKLIGHT_FUZZ_TARGET").ok();
    let chosen: Vec<&Target> =
        TARGETS.into_iter().filter(|t| only.as_ref().is_none_or(|only| t.name == only)).collect();
    assert!(!chosen.is_empty(), "there is no target {only:?}");
    let short: u64 = chosen.iter().map(|target| target.runs).sum();
    let wanted = number("LINKLIGHT_FUZZ_RUNS").unwrap_or(short);
    let (seed, first) = (number("LINKLIGHT_FUZZ_SEED").unwrap_or(1), number("LINKLIGHT_FUZZ_FIRST").unwrap_or(0));
    let mut findings = Vec::new();
    for target in chosen {
        let runs = (u128::from(wanted) * u128::from(target.runs) / u128::from(short)).max(1) as u64;
        let start = Instant::now();
        let found = fuzz(target, seed, first, runs);
        println!("{:<14} {runs:>10} executions, {} findings, {:.1?}", target.name, found.len(), start.elapsed());
        findings.extend(found);
    }
    assert!(findings.is_empty(), "{} findings:\n{}", findings.len(), findings.join("\n"));
}

/// What is bent must be whole before: else everything would end at the first byte.
#[test]
fn the_seeds_are_read_whole() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    gltf_inputs::seeds_are_valid();
    files::seeds_are_valid();
    words::seeds_are_valid();
}

/// Files `regressions/TARGET-what-is-wrong`: each was a finding once.
#[test]
fn mended_findings_stay_mended() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let kept = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/regressions");
    for entry in std::fs::read_dir(kept).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let target = TARGETS.into_iter().find(|target| name.starts_with(&format!("{}-", target.name)));
        let target = target.unwrap_or_else(|| panic!("{name} belongs to no target"));
        let complaint = complaint(target, &std::fs::read(&path).unwrap(), folder.path());
        assert_eq!(complaint, None, "{name}");
    }
}

/// The harness itself: a reader that panics or takes too much is seen, and the same numbers give the same input.
#[test]
fn a_planted_fault_is_found() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    fn read(input: &[u8], _: &Path) {
        match input.first() {
            Some(0) => drop(vec![1u8; 1 << 20]),
            Some(1) => panic!("a planted panic"),
            _ => {}
        }
    }
    let planted = Target {
        name: "planted",
        runs: 1,
        seeds: || vec![vec![7; 4]],
        mutate: |random, seeds| mutate::bytes(random, seeds[0].clone()),
        read,
        max_bytes: 1 << 16,
    };
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(complaint(&planted, &[7], folder.path()), None);
    assert!(complaint(&planted, &[0], folder.path()).unwrap().contains("65536 are allowed"));
    assert!(complaint(&planted, &[1], folder.path()).unwrap().contains("a planted panic"));
    let seeds = (planted.seeds)();
    assert_eq!(input(&planted, &seeds, 5, 9), input(&planted, &seeds, 5, 9));
    let different = (0..50).filter(|index| input(&planted, &seeds, 5, *index) != seeds[0]).count();
    assert!(different > 40, "{different} of 50 inputs are bent");
}
