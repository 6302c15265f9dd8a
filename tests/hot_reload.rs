//! Shaders reload while running: a changed include takes effect, a broken shader leaves the last good one.

mod common;

use common::TestContext;
use linklight::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams};
use linklight::gpu::{Context, reload};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const SHADER: &str = "scan/add_block_sums.comp";

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// What the pass adds to a zero.
fn added(context: &Context) -> u32 {
    let values = context.upload("test/values", &[0u32; 4]).unwrap();
    let block_sums = context.upload("test/block sums", &[7u32]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(
        &AddBlockSums { values: &values, block_sums: &block_sums, params: AddBlockSumsParams { value_count: 4 } },
        4u32,
    );
    recorder.submit().unwrap();
    context.download(&values).unwrap()[0]
}

#[test]
fn good_edits_take_effect_and_bad_ones_keep_the_last_good_shader() {
    let context = TestContext::new();
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    copy_folder(&Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl"), root);
    let changed = |file: &str| BTreeSet::from([PathBuf::from(file)]);
    let original = std::fs::read_to_string(root.join(SHADER)).unwrap();
    assert_eq!(added(&context), 7);

    // A good edit.
    std::fs::write(root.join(SHADER), original.replace("values[i] +=", "values[i] += 100 +")).unwrap();
    let reloads = reload(&context, root, &changed(SHADER));
    assert_eq!(reloads.len(), 1);
    assert_eq!((reloads[0].file, &reloads[0].result), (SHADER, &Ok(())));
    assert_eq!(added(&context), 107);

    // A broken one: the message has file and line, the last good shader stays.
    std::fs::write(root.join(SHADER), original.replace("values[i] +=", "valuse[i] +=")).unwrap();
    let message = reload(&context, root, &changed(SHADER)).remove(0).result.unwrap_err();
    let line = original.lines().position(|l| l.contains("values[i] +=")).unwrap() + 1;
    assert!(message.contains(&format!("{SHADER}:{line}")) && message.contains("valuse"), "{message}");
    assert_eq!(added(&context), 107);

    // A changed interface needs a rebuild.
    std::fs::write(
        root.join(SHADER),
        original.replace("uint value_count; } params", "uint value_count; uint more; } params"),
    )
    .unwrap();
    let message = reload(&context, root, &changed(SHADER)).remove(0).result.unwrap_err();
    assert!(message.contains("rebuild"), "{message}");
    assert_eq!(added(&context), 107);

    // A change in a shared include reaches every shader that includes it.
    std::fs::write(root.join(SHADER), &original).unwrap();
    let reloads = reload(&context, root, &changed("lib/prelude.glsl"));
    assert!(
        reloads.iter().any(|r| r.file == SHADER) && reloads.len() >= 2 && reloads.iter().all(|r| r.result.is_ok()),
        "{reloads:?}"
    );
    assert_eq!(added(&context), 7);
}
