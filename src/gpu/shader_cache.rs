//! For the build script: SPIR-V of earlier builds, kept by what it was made of, so that a change of one shader does not
//! compile a hundred others again.

use super::shader_compiler::{self, ShaderError};
use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// A folder of compiled shaders.
pub struct ShaderCache {
    folder: PathBuf,
    /// Of everything but the source: the compiler, how it is called, the features.
    compiler: u64,
}

impl ShaderCache {
    /// `compiler` names what compiles: its version and how it is called.
    pub fn new(folder: PathBuf, compiler: &[&str]) -> Self {
        // Without a folder every shader is compiled, and nothing else is lost.
        let _ = std::fs::create_dir_all(&folder);
        let mut hasher = DefaultHasher::new();
        compiler.hash(&mut hasher);
        Self { folder, compiler: hasher.finish() }
    }

    /// The words of `root/file`, and where they are kept.
    pub fn compile(&self, root: &Path, file: &Path) -> Result<(Vec<u32>, PathBuf), ShaderError> {
        let kept = self.folder.join(format!("{:016x}.spv", self.key(root, file)));
        if let Some(words) = std::fs::read(&kept).ok().and_then(|bytes| words(&bytes)) {
            return Ok((words, kept));
        }
        let words = shader_compiler::compile(root, file)?;
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        // Whole or not at all: a build may be killed at any time.
        let part = kept.with_extension("part");
        if std::fs::write(&part, bytes).is_ok() {
            let _ = std::fs::rename(&part, &kept);
        }
        Ok((words, kept))
    }

    /// Forgets what is not among `used`.
    pub fn keep_only(&self, used: &[PathBuf]) {
        for entry in std::fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            if !used.contains(&entry.path()) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Of the file's name, its text and the texts of all it includes.
    fn key(&self, root: &Path, file: &Path) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.compiler, root, file).hash(&mut hasher);
        let mut seen = BTreeSet::new();
        let mut open = vec![file.to_path_buf()];
        while let Some(name) = open.pop() {
            if !seen.insert(name.clone()) {
                continue;
            }
            let text = std::fs::read_to_string(root.join(&name)).unwrap_or_default();
            (&name, &text).hash(&mut hasher);
            let included = text.lines().filter_map(|line| line.trim_start().strip_prefix("#include"));
            open.extend(included.filter_map(|rest| Some(PathBuf::from(rest.split('"').nth(1)?))));
        }
        hasher.finish()
    }
}

/// `None` of what is no SPIR-V, such as a file cut short.
fn words(bytes: &[u8]) -> Option<Vec<u32>> {
    const MAGIC: u32 = 0x0723_0203;
    let words: Vec<u32> = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    (bytes.len().is_multiple_of(4) && words.first() == Some(&MAGIC)).then_some(words)
}
