//! Both ways to compile a shader give the same interface: the linked shaderc library and the `glslc` command.
//!
//! Built only with the feature `shaderc`, since it needs the library. With a Vulkan SDK installed:
//! `cargo test --features shaderc --test shader_compilers`; with a library built by hand, set `SHADERC_LIB_DIR` to the
//! folder of `libshaderc_combined.a` first.

use linklight::gpu::shader_compiler::{ShaderError, compile, compile_with_command, compile_with_library};
use linklight::gpu::{reflection, shaders};
use std::path::Path;

fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl")
}

#[test]
fn every_shader_has_the_same_interface_either_way() {
    let mut different = Vec::new();
    for stage in shaders::PROGRAMS.iter().flat_map(|program| program.stages) {
        let file = Path::new(stage.file);
        let interface = |spirv: Result<Vec<u32>, ShaderError>| {
            reflection::reflect(&spirv.map_err(|error| error.to_string())?)
                .map_err(|error| format!("{file:?}: {error}"))
        };
        let by_command = interface(compile_with_command(&root(), file));
        let by_library = interface(compile_with_library(&root(), file));
        let built_in = by_library.as_ref().is_ok_and(|i| reflection::fingerprint(i) == stage.interface);
        if by_command.is_err() || by_command != by_library || !built_in {
            different.push(format!("{}:\n  glslc   {by_command:?}\n  shaderc {by_library:?}", stage.file));
        }
    }
    assert!(!shaders::PROGRAMS.is_empty() && different.is_empty(), "{}", different.join("\n"));
}

/// A shader that cannot be compiled is refused either way, with its file and line.
#[test]
fn errors_name_file_and_line_either_way() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.comp"), "#version 460\nvoid main() { undeclared = 1; }\n").unwrap();
    let ways: [fn(&Path, &Path) -> Result<Vec<u32>, ShaderError>; 3] =
        [compile, compile_with_command, compile_with_library];
    for way in ways {
        let message = way(folder.path(), Path::new("bad.comp")).unwrap_err().to_string();
        assert!(message.contains("bad.comp:2") && message.contains("undeclared"), "{message}");
        let message = way(folder.path(), Path::new("absent.comp")).unwrap_err().to_string();
        assert!(message.contains("absent.comp"), "{message}");
    }
}
