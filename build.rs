//! Compiles every shader under `glsl/` and writes the Rust side of each: element structs, push constants, and one
//! struct of named buffers per pass. GLSL is the only place where a layout is written down.

#[path = "src/gpu/reflection.rs"]
mod reflection;
#[path = "src/gpu/shader_cache.rs"]
mod shader_cache;
#[path = "src/gpu/shader_codegen.rs"]
mod shader_codegen;
#[path = "src/gpu/shader_compiler.rs"]
mod shader_compiler;

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=glsl");
    println!("cargo::rerun-if-changed=src/gpu/reflection.rs");
    println!("cargo::rerun-if-changed=src/gpu/shader_cache.rs");
    println!("cargo::rerun-if-changed=src/gpu/shader_codegen.rs");
    println!("cargo::rerun-if-changed=src/gpu/shader_compiler.rs");
    println!("cargo::rerun-if-env-changed=GLSLC");
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("glsl");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));

    let mut files = Vec::new();
    collect(&root, &root, &mut files);
    files.sort();
    let cache = shader_cache::ShaderCache::new(out.join("shader-cache"), &[&compiler_version(), COMPILER_SOURCE]);
    let compiled = compile_all(&cache, &root, &files);
    let used: Vec<PathBuf> = compiled.iter().flatten().map(|(_, kept)| kept.clone()).collect();
    cache.keep_only(&used);

    let mut shaders = Vec::new();
    let mut failed = false;
    for (file, result) in files.iter().zip(compiled) {
        let reflected = result.map_err(|e| e.to_string()).and_then(|(spirv, _)| {
            let interface = reflection::reflect(&spirv).map_err(|e| format!("glsl/{}: {e}", file.display()))?;
            Ok(shader_codegen::Shader { file: file.clone(), spirv, interface })
        });
        match reflected {
            Ok(shader) => shaders.push(shader),
            Err(message) => {
                failed = true;
                message.lines().filter(|l| !l.is_empty()).for_each(|line| println!("cargo::error={line}"));
            }
        }
    }
    if failed {
        return;
    }
    match shader_codegen::generate(&shaders) {
        Ok(text) => {
            for shader in &shaders {
                let bytes: Vec<u8> = shader.spirv.iter().flat_map(|w| w.to_le_bytes()).collect();
                std::fs::write(out.join(shader_codegen::spirv_file_name(&shader.file)), bytes)
                    .expect("OUT_DIR is writable");
            }
            std::fs::write(out.join("shaders.rs"), text).expect("OUT_DIR is writable");
        }
        Err(message) => println!("cargo::error={message}"),
    }
}

/// Every shader below `dir`, relative to `root`.
fn collect(root: &Path, dir: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("glsl/ is readable").flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(root, &path, files);
        } else if path.extension().is_some_and(|e| shader_compiler::STAGE_EXTENSIONS.iter().any(|s| e == *s)) {
            files.push(path.strip_prefix(root).expect("below root").to_path_buf());
        }
    }
}

/// How shaders are compiled: a change there is a change of all of them.
const COMPILER_SOURCE: &str = include_str!("src/gpu/shader_compiler.rs");

/// What the compiler says of itself; nothing where it is linked, or missing (compiling then says so).
fn compiler_version() -> String {
    let glslc = std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into());
    let output = std::process::Command::new(glslc).arg("--version").output();
    let version = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    format!("{} {version}", if cfg!(feature = "shaderc") { "shaderc" } else { "glslc" })
}

/// A compiled shader, and where its words are kept.
type Compiled = Result<(Vec<u32>, PathBuf), shader_compiler::ShaderError>;

/// Compiles on all cores; results in the order of `files`.
fn compile_all(cache: &shader_cache::ShaderCache, root: &Path, files: &[PathBuf]) -> Vec<Compiled> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let share = files.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let workers: Vec<_> = files
            .chunks(share)
            .map(|chunk| scope.spawn(move || chunk.iter().map(|f| cache.compile(root, f)).collect::<Vec<_>>()))
            .collect();
        workers.into_iter().flat_map(|w| w.join().expect("a shader compile thread panicked")).collect()
    })
}
