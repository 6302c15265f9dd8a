//! The driver's pipeline cache on disk: written, read again, and ignored when damaged.

use crate::common::TestContext;
use linklight::gpu::Options;
use linklight::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams};
use std::path::Path;

/// One pass on a context that keeps its cache in `file`.
fn run(file: &Path) {
    let context = TestContext::with(Options { pipeline_cache: Some(file.to_owned()), ..Options::default() });
    let values = context.upload("test/values", &[1u32; 4]).unwrap();
    let block_sums = context.upload("test/block sums", &[7u32]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = AddBlockSumsParams { value_count: 4 };
    recorder.dispatch(&AddBlockSums { values: &values, block_sums: &block_sums, params }, 4u32);
    recorder.submit().unwrap();
    assert_eq!(context.download(&values).unwrap(), [8; 4]);
}

#[test]
fn the_cache_is_written_used_again_and_ignored_when_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("made/on demand/pipelines.bin");
    run(&file);
    let first = std::fs::read(&file).unwrap();
    assert!(first.len() >= 64, "a checksum and at least the driver's header: {} bytes", first.len());
    run(&file);
    let second = std::fs::read(&file).unwrap();
    assert!(second.len() >= first.len(), "what was cached is still there: {} of {}", second.len(), first.len());

    let mut flipped = first.clone();
    let last = flipped.len() - 1;
    flipped[last] ^= 1;
    let longer: Vec<u8> = first.iter().copied().chain([0]).collect();
    let damaged: [&[u8]; 6] = [b"", b"no cache at all", &first[..31], &first[..last], &flipped, &longer];
    for bytes in damaged {
        std::fs::write(&file, bytes).unwrap();
        run(&file);
        assert!(std::fs::read(&file).unwrap() != bytes, "a good cache takes the place of {} bad bytes", bytes.len());
    }
    let left: Vec<_> = std::fs::read_dir(file.parent().unwrap()).unwrap().flatten().map(|e| e.file_name()).collect();
    assert_eq!(left, ["pipelines.bin"], "no temporary files stay");
}

#[test]
fn a_place_that_cannot_be_written_costs_only_the_cache() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("pipelines.bin");
    std::fs::create_dir(&file).unwrap();
    run(&file);
    assert!(file.is_dir());
}
