//! Writes the Rust side of every shader: `shaders::<folder>::<Pass>` with named, typed bindings, its push-constant
//! struct, and `shaders::types` with the structs that buffers hold. Used by the build script only.
//!
//! A `.vert` and a `.frag` of one stem make one raster pass. A struct that several shaders use becomes one Rust type;
//! two that differ under one name are an error.

use crate::reflection::{self, Binding, BindingKind, Constant, ImageShape, Interface, Layout, Struct};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// One compiled file.
pub struct Shader {
    /// Relative to `glsl/`.
    pub file: PathBuf,
    pub spirv: Vec<u32>,
    pub interface: Interface,
}

/// The stages of one pass, merged.
struct PassShaders<'a> {
    stages: Vec<&'a Shader>,
    bindings: Vec<Binding>,
    constants: Vec<Constant>,
    push_constants: Option<Struct>,
}

/// Where the SPIR-V of a shader lies in OUT_DIR.
pub fn spirv_file_name(file: &Path) -> String {
    format!("{}.spv", file.to_string_lossy().replace(['/', '\\'], "."))
}

/// The whole generated module.
pub fn generate(shaders: &[Shader]) -> Result<String, String> {
    let mut passes: BTreeMap<String, PassShaders> = BTreeMap::new();
    for shader in shaders {
        let name = shader.file.with_extension("").to_string_lossy().replace('\\', "/");
        let pass = passes.entry(name).or_insert_with(|| PassShaders {
            stages: Vec::new(),
            bindings: Vec::new(),
            constants: Vec::new(),
            push_constants: None,
        });
        merge(pass, shader).map_err(|e| format!("glsl/{}: {e}", shader.file.display()))?;
    }

    let mut types = BTreeMap::new();
    let mut root = Module::default();
    for (name, pass) in &passes {
        let text = pass_text(name, pass, &mut types).map_err(|e| format!("glsl/{name}: {e}"))?;
        root.insert(name, text);
    }

    let mut out = String::from("// Written by the build script from the shaders in glsl/.\n");
    out += "/// The structs that buffers hold, each declared once in GLSL.\npub mod types {\n";
    for block in types.values() {
        out += &struct_text(&block.name, block)?;
    }
    out += "}\n";
    out += &root.text();
    let _ = writeln!(
        out,
        "/// Every program of the house, sorted by name.\npub const PROGRAMS: &[&crate::gpu::Program] = &["
    );
    for name in passes.keys() {
        let _ = writeln!(out, "    {}::PROGRAM,", rust_path(name));
    }
    out += "];\n";
    Ok(out)
}

fn merge<'a>(pass: &mut PassShaders<'a>, shader: &'a Shader) -> Result<(), String> {
    for binding in &shader.interface.bindings {
        match pass.bindings.iter_mut().find(|b| (b.set, b.binding) == (binding.set, binding.binding)) {
            None => pass.bindings.push(binding.clone()),
            Some(seen) if seen.name == binding.name && seen.kind == binding.kind => {
                seen.reads |= binding.reads;
                seen.writes |= binding.writes;
            }
            Some(seen) => {
                return Err(format!(
                    "binding {}.{} is `{}` here and `{}` in the other stage",
                    binding.set, binding.binding, binding.name, seen.name
                ));
            }
        }
    }
    pass.bindings.sort_by_key(|b| (b.set, b.binding));
    for constant in &shader.interface.constants {
        if !pass.constants.iter().any(|c| c.id == constant.id) {
            pass.constants.push(constant.clone());
        }
    }
    match (&pass.push_constants, &shader.interface.push_constants) {
        (Some(a), Some(b)) if a != b => return Err("the two stages declare different push constants".into()),
        (None, Some(b)) => pass.push_constants = Some(b.clone()),
        _ => {}
    }
    pass.stages.push(shader);
    Ok(())
}

/// Folders become modules.
#[derive(Default)]
struct Module {
    modules: BTreeMap<String, Module>,
    passes: Vec<String>,
}

impl Module {
    fn insert(&mut self, name: &str, text: String) {
        match name.split_once('/') {
            Some((folder, rest)) => self.modules.entry(folder.to_owned()).or_default().insert(rest, text),
            None => self.passes.push(text),
        }
    }

    fn text(&self) -> String {
        let mut out = self.passes.concat();
        for (name, module) in &self.modules {
            let _ = writeln!(out, "/// Passes of `glsl/../{name}/`.\npub mod {name} {{\n{}}}", module.text());
        }
        out
    }
}

fn camel_case(name: &str) -> String {
    let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
    name.split('_').filter(|w| !w.is_empty()).map(capital).collect()
}

/// `gather/links` -> `gather::Links`.
fn rust_path(name: &str) -> String {
    match name.rsplit_once('/') {
        Some((folders, stem)) => format!("{}::{}", folders.replace('/', "::"), camel_case(stem)),
        None => camel_case(name),
    }
}

fn pass_text(name: &str, pass: &PassShaders, types: &mut BTreeMap<String, Struct>) -> Result<String, String> {
    let ty = camel_case(name.rsplit('/').next().unwrap_or(name));
    let mut out = String::new();
    let (mut fields, mut binds, mut infos) = (String::new(), String::new(), String::new());
    let mut borrows = false;
    for binding in &pass.bindings {
        let Binding { name, binding: index, kind, reads, writes, .. } = binding;
        let access = match (reads, writes) {
            (true, true) => "updates",
            (_, true) => "writes",
            _ => "reads",
        };
        borrows = true;
        let (field_type, call, kind_name) = match kind {
            BindingKind::Buffer(layout) => {
                collect_types(layout, types)?;
                (format!("&'a crate::gpu::Buffer<{}>", rust_type(layout)), "buffer", "Buffer".to_owned())
            }
            BindingKind::TexelBuffer => ("&'a crate::gpu::TexelBuffer".into(), "texel_buffer", "TexelBuffer".into()),
            BindingKind::SampledImage(ImageShape { shape, is_integer }) => {
                let kind = format!("SampledImage {{ shape: crate::gpu::Shape::{shape}, is_integer: {is_integer} }}");
                ("crate::gpu::Sampled<'a>".into(), "sampled", kind)
            }
            BindingKind::TextureTable => {
                if binding.set != 1 {
                    return Err(format!("the texture table `{name}` must be set = 1"));
                }
                ("&'a crate::gpu::TextureTable".into(), "textures", String::new())
            }
            BindingKind::StorageImage(format) => {
                let kind = format!("StorageImage(crate::gpu::Format::{format})");
                ("&'a crate::gpu::Image".into(), "storage_image", kind)
            }
            BindingKind::AccelerationStructure => {
                let kind = "AccelerationStructure".to_owned();
                ("&'a crate::gpu::AccelerationStructure".into(), "acceleration_structure", kind)
            }
        };
        if *kind != BindingKind::TextureTable && binding.set != 0 {
            return Err(format!("`{name}` must be in set 0"));
        }
        let _ = writeln!(fields, "    /// {access}\n    pub {name}: {field_type},");
        let _ = writeln!(binds, "        bindings.{call}(self.{name});");
        if *kind != BindingKind::TextureTable {
            let _ = writeln!(
                infos,
                "            crate::gpu::BindingInfo {{ name: {name:?}, binding: {index}, kind: crate::gpu::ResourceKind::{kind_name}, reads: {reads}, writes: {writes} }},"
            );
        }
    }
    let mut push_bytes = 0;
    if let Some(block) = &pass.push_constants {
        push_bytes = block.size_bytes;
        if push_bytes > 128 {
            return Err(format!("push constants take {push_bytes} bytes; at most 128 work everywhere"));
        }
        for field in &block.fields {
            collect_types(&field.layout, types)?;
        }
        out += &struct_text(&format!("{ty}Params"), block)?;
        let _ = writeln!(fields, "    pub params: {ty}Params,");
        binds += "        bindings.push_constants(bytemuck::bytes_of(&self.params));\n";
    }
    if !pass.constants.is_empty() {
        let _ = writeln!(
            out,
            "/// Specialisation constants of `{name}`.\n#[derive(Debug, Clone, Copy, PartialEq)]\npub struct {ty}Constants {{"
        );
        for constant in &pass.constants {
            let field = constant.name.to_lowercase();
            let (rust, bits) = match constant.layout {
                Layout::Bool => ("bool", format!("u32::from(self.constants.{field})")),
                Layout::Scalar('u', 32) => ("u32", format!("self.constants.{field}")),
                Layout::Scalar('i', 32) => ("i32", format!("self.constants.{field} as u32")),
                Layout::Scalar('f', 32) => ("f32", format!("self.constants.{field}.to_bits()")),
                ref other => return Err(format!("specialisation constant {} of type {other:?}", constant.name)),
            };
            let _ = writeln!(out, "    pub {field}: {rust},");
            let _ = writeln!(binds, "        bindings.constant({}, {bits});", constant.id);
        }
        out += "}\n";
        let _ = writeln!(fields, "    pub constants: {ty}Constants,");
    }

    let life = if borrows { "<'a>" } else { "" };
    let any_life = if borrows { "<'_>" } else { "" };
    let files: Vec<String> = pass.stages.iter().map(|s| format!("`glsl/{}`", s.file.display())).collect();
    let _ = writeln!(out, "/// The pass of {}.\npub struct {ty}{life} {{\n{fields}}}", files.join(" and "));
    let workgroup = pass.stages[0].interface.workgroup;
    let invocations: u32 = workgroup.iter().product();
    if invocations > 256 {
        return Err(format!("a workgroup of {workgroup:?} has {invocations} invocations; at most 256 work everywhere"));
    }
    let uses_textures = pass.bindings.iter().any(|b| b.kind == BindingKind::TextureTable);
    let _ = writeln!(out, "impl crate::gpu::Pass for {ty}{any_life} {{");
    let _ = writeln!(
        out,
        "    const PROGRAM: &'static crate::gpu::Program = &crate::gpu::Program {{\n        name: {name:?},\n        stages: &["
    );
    for shader in &pass.stages {
        let kind = match shader.file.extension().and_then(|e| e.to_str()) {
            Some("comp") => "Compute",
            Some("vert") => "Vertex",
            _ => "Fragment",
        };
        let _ = writeln!(
            out,
            "            crate::gpu::Stage {{ kind: crate::gpu::StageKind::{kind}, file: {:?}, spirv: include_bytes!(concat!(env!(\"OUT_DIR\"), {:?})), interface: {:#x} }},",
            shader.file.to_string_lossy(),
            format!("/{}", spirv_file_name(&shader.file)),
            reflection::fingerprint(&shader.interface),
        );
    }
    let _ = writeln!(
        out,
        "        ],\n        bindings: &[\n{infos}        ],\n        push_constant_bytes: {push_bytes},\n        workgroup: {workgroup:?},\n        uses_textures: {uses_textures},\n    }};"
    );
    let _ = writeln!(
        out,
        "    fn bind<'b>(&'b self, bindings: &mut crate::gpu::Bindings<'b>) {{\n        let _ = &bindings;\n{binds}    }}\n}}"
    );
    let _ = writeln!(
        out,
        "impl {ty}{any_life} {{\n    /// The static description of the pass.\n    pub const PROGRAM: &'static crate::gpu::Program = <Self as crate::gpu::Pass>::PROGRAM;\n}}"
    );
    Ok(out)
}

/// Notes every struct below `layout`; the same name must mean the same layout.
fn collect_types(layout: &Layout, types: &mut BTreeMap<String, Struct>) -> Result<(), String> {
    match layout {
        Layout::Array(element, ..) => collect_types(element, types),
        Layout::Struct(block) => {
            for field in &block.fields {
                collect_types(&field.layout, types)?;
            }
            match types.get(&block.name) {
                Some(seen) if seen != block => Err(format!(
                    "struct {} differs from the struct of that name in another shader; declare it once in glsl/lib/",
                    block.name
                )),
                _ => {
                    types.insert(block.name.clone(), block.clone());
                    Ok(())
                }
            }
        }
        _ => Ok(()),
    }
}

fn scalar_type(kind: char, bits: u32) -> String {
    match (kind, bits) {
        ('f', 16) => "u16".into(),
        _ => format!("{kind}{bits}"),
    }
}

fn rust_type(layout: &Layout) -> String {
    match layout {
        Layout::Bool => "u32".into(),
        Layout::Scalar(kind, bits) => scalar_type(*kind, *bits),
        // glam's four-component types are 16-byte aligned, scalar layout's are not: those become arrays.
        Layout::Vector('f', 32, n @ 2..=3) => format!("glam::Vec{n}"),
        Layout::Vector('u', 32, n @ 2..=3) => format!("glam::UVec{n}"),
        Layout::Vector('i', 32, n @ 2..=3) => format!("glam::IVec{n}"),
        Layout::Vector(kind, bits, n) => format!("[{}; {n}]", scalar_type(*kind, *bits)),
        Layout::Matrix(columns, rows) => format!("[[f32; {rows}]; {columns}]"),
        Layout::Array(element, count, _) => format!("[{}; {count}]", rust_type(element)),
        Layout::Struct(block) => format!("crate::gpu::shaders::types::{}", block.name),
    }
}

fn struct_text(name: &str, block: &Struct) -> Result<String, String> {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "#[allow(missing_docs)]\n#[repr(C)]\n#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]\npub struct {name} {{"
    );
    for field in &block.fields {
        if let Layout::Array(element, _, stride) = &field.layout
            && *stride != element.size_bytes()
        {
            return Err(format!(
                "{name}.{} has array stride {stride} but element size {}; use layout(scalar)",
                field.name,
                element.size_bytes()
            ));
        }
        let _ = writeln!(out, "    pub {}: {},", field.name, rust_type(&field.layout));
    }
    let _ = writeln!(out, "}}\nconst _: () = {{\n    assert!(std::mem::size_of::<{name}>() == {});", block.size_bytes);
    for field in &block.fields {
        let _ = writeln!(out, "    assert!(std::mem::offset_of!({name}, {}) == {});", field.name, field.offset_bytes);
    }
    out += "};\n";
    Ok(out)
}
