//! Hot reload: shaders edited while the program runs take effect at the next frame.
//!
//! A file (or any file that includes it) that changed is compiled by the same function as at build time. The last
//! good shader stays when it does not compile, or when its interface no longer fits the Rust side made from it.

use super::context::Context;
use super::pass::Program;
use super::shaders::PROGRAMS;
use super::{reflection, shader_compiler};
use notify::{RecursiveMode, Watcher};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc;

/// What became of one shader file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reload {
    /// Relative to the shader folder.
    pub file: &'static str,
    /// The compiler's message, with file and line, where the last good shader stays.
    pub result: Result<(), String>,
}

/// Watches a folder of shader sources.
pub struct ShaderWatcher {
    root: PathBuf,
    changes: mpsc::Receiver<PathBuf>,
    // Stops watching when dropped.
    _watcher: notify::RecommendedWatcher,
}

impl ShaderWatcher {
    /// Watches `root`, a checkout's `glsl/` folder.
    pub fn new(root: &Path) -> Result<Self, String> {
        let root = root.canonicalize().map_err(|e| format!("shader folder {}: {e}", root.display()))?;
        let (sender, changes) = mpsc::channel();
        let mut watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            for path in event.into_iter().filter(|e| !e.kind.is_access()).flat_map(|e| e.paths) {
                // The receiver goes with the watcher; a change after that interests nobody.
                let _ = sender.send(path);
            }
        })
        .map_err(|e| format!("watching {}: {e}", root.display()))?;
        watcher.watch(&root, RecursiveMode::Recursive).map_err(|e| format!("watching {}: {e}", root.display()))?;
        Ok(Self { root, changes, _watcher: watcher })
    }

    /// Recompiles what changed since the last call. Call between frames.
    pub fn poll(&self, context: &Context) -> Vec<Reload> {
        let changed: BTreeSet<PathBuf> =
            self.changes.try_iter().filter_map(|p| p.strip_prefix(&self.root).ok().map(Path::to_path_buf)).collect();
        if changed.is_empty() {
            return Vec::new();
        }
        reload(context, &self.root, &changed)
    }
}

/// Recompiles every program that depends on one of the `changed` files (relative to `root`).
pub fn reload(context: &Context, root: &Path, changed: &BTreeSet<PathBuf>) -> Vec<Reload> {
    let mut reloads = Vec::new();
    for program in PROGRAMS.iter().copied() {
        for stage in program.stages {
            let dependencies = dependencies(root, Path::new(stage.file));
            if dependencies.is_disjoint(changed) {
                continue;
            }
            let result = reload_stage(context, root, program, stage.file, stage.interface);
            match &result {
                Ok(()) => tracing::info!("reloaded {}", stage.file),
                Err(message) => tracing::error!("{} kept as it was: {message}", stage.file),
            }
            reloads.push(Reload { file: stage.file, result });
        }
    }
    reloads
}

fn reload_stage(
    context: &Context,
    root: &Path,
    program: &'static Program,
    file: &'static str,
    interface: u64,
) -> Result<(), String> {
    let spirv = shader_compiler::compile(root, Path::new(file)).map_err(|e| e.to_string())?;
    let reflected = reflection::reflect(&spirv).map_err(|e| format!("glsl/{file}: {e}"))?;
    if reflection::fingerprint(&reflected) != interface {
        return Err(format!(
            "glsl/{file}: its bindings, push constants, constants or workgroup size changed; rebuild the program"
        ));
    }
    context.pipelines.replace(program, file, spirv);
    Ok(())
}

/// Every file that `root/file` includes, directly or not, itself first: what a reload has to watch.
fn dependencies(root: &Path, file: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut queue = vec![file.to_path_buf()];
    while let Some(next) = queue.pop() {
        let text = std::fs::read_to_string(root.join(&next)).unwrap_or_default();
        let includes = text.lines().filter_map(|line| {
            let rest = line.trim_start().strip_prefix("#include")?.trim().strip_prefix('"')?;
            rest.split('"').next().map(PathBuf::from)
        });
        queue.extend(includes.filter(|include| !found.contains(include)));
        found.insert(next);
    }
    found
}
