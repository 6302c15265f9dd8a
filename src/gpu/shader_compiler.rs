//! One function turns a GLSL file into SPIR-V: [`compile`].
//!
//! The build script and the run-time hot reload share this file, so a shader that builds also reloads. With the
//! Cargo feature `shaderc` the linked library compiles; without it the `glslc` command of the same project does.
//! Includes are written relative to the shader root (`#include "lib/bvh.glsl"`).

use std::path::Path;

/// The three kinds of file under `glsl/` that are compiled; `.glsl` files are only included.
pub const STAGE_EXTENSIONS: [&str; 3] = ["comp", "vert", "frag"];

/// A shader that did not compile: the compiler's own lines, each with file and line number.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{}", .0.trim_end())]
pub struct ShaderError(pub String);

/// Compiles `root/file` to SPIR-V 1.5 words, optimised, with names kept for reflection and captures. (1.5, since under
/// a frame debugger the device may call itself Vulkan 1.2.)
pub fn compile(root: &Path, file: &Path) -> Result<Vec<u32>, ShaderError> {
    #[cfg(feature = "shaderc")]
    return compile_with_library(root, file);
    #[cfg(not(feature = "shaderc"))]
    return compile_with_command(root, file);
}

/// Runs `glslc`, looked up on PATH or named by the variable GLSLC.
#[cfg_attr(feature = "shaderc", allow(dead_code, reason = "the build script then uses the library alone"))]
pub fn compile_with_command(root: &Path, file: &Path) -> Result<Vec<u32>, ShaderError> {
    let glslc = std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into());
    let output = std::process::Command::new(&glslc)
        .args(["-O", "-g", "--target-env=vulkan1.2", "-Werror", "-I"])
        .arg(root)
        .args(["-o", "-"])
        .arg(root.join(file))
        .output()
        .map_err(|error| {
            ShaderError(format!(
                "{}: could not run the shader compiler {}: {error}; run tools/setup, install the package `glslc`, \
                 or build with --features shaderc",
                file.display(),
                glslc.display()
            ))
        })?;
    if !output.status.success() {
        return Err(ShaderError(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    if output.stdout.len() % 4 != 0 {
        return Err(ShaderError(format!(
            "{}: the compiler wrote {} bytes, no multiple of 4",
            file.display(),
            output.stdout.len()
        )));
    }
    Ok(output.stdout.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}

/// Calls the linked shaderc library.
#[cfg(feature = "shaderc")]
pub fn compile_with_library(root: &Path, file: &Path) -> Result<Vec<u32>, ShaderError> {
    let fail = |error: &dyn std::fmt::Display| ShaderError(format!("{}: {error}", file.display()));
    let source = std::fs::read_to_string(root.join(file)).map_err(|e| fail(&e))?;
    let kind = match file.extension().and_then(|e| e.to_str()) {
        Some("comp") => shaderc::ShaderKind::Compute,
        Some("vert") => shaderc::ShaderKind::Vertex,
        Some("frag") => shaderc::ShaderKind::Fragment,
        other => return Err(fail(&format!("extension {other:?} is not one of {STAGE_EXTENSIONS:?}"))),
    };
    let compiler = shaderc::Compiler::new().map_err(|e| fail(&e))?;
    let mut options = shaderc::CompileOptions::new().map_err(|e| fail(&e))?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_optimization_level(shaderc::OptimizationLevel::Performance);
    options.set_generate_debug_info();
    options.set_warnings_as_errors();
    options.set_include_callback(|name, _, _, _| {
        let path = root.join(name);
        let content = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(shaderc::ResolvedInclude { resolved_name: path.display().to_string(), content })
    });
    let name = root.join(file).display().to_string();
    let artifact = compiler.compile_into_spirv(&source, kind, &name, "main", Some(&options)).map_err(|e| fail(&e))?;
    Ok(artifact.as_binary().to_vec())
}
