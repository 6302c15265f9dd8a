//! What a compiled shader declares, read from its SPIR-V: bindings with access, push constants, specialisation
//! constants, workgroup size. The build script makes Rust types of it; hot reload checks that it did not change.

use spirq::entry_point::ExecutionModel;
use spirq::ty::{AccessType, DescriptorType, ScalarType, Type, VectorType};
use spirq::var::Variable;
use spirq::{ReflectConfig, spirv};

/// The interface of one shader stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Sorted by (set, binding).
    pub bindings: Vec<Binding>,
    pub push_constants: Option<Struct>,
    pub constants: Vec<Constant>,
    /// Threads per workgroup; ones for raster stages.
    pub workgroup: [u32; 3],
}

#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    pub set: u32,
    pub binding: u32,
    pub name: String,
    pub kind: BindingKind,
    pub reads: bool,
    pub writes: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub enum BindingKind {
    /// A storage buffer: an array of this element type (or one value of it).
    Buffer(Layout),
    /// `usamplerBuffer`: texels of four words.
    TexelBuffer,
    /// `sampler2D`, `usampler2DArray` ...: one image with its sampler.
    SampledImage(ImageShape),
    /// The unbounded `sampler2D textures[]` of the scene.
    TextureTable,
    /// `image2D` of this format, by its name in Rust.
    StorageImage(&'static str),
    AccelerationStructure,
}

/// How a shader sees a sampled image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageShape {
    /// Its layers, by their name in Rust.
    pub shape: &'static str,
    /// Texels are unsigned integers, else floats.
    pub is_integer: bool,
}

/// A specialisation constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    pub id: u32,
    pub name: String,
    pub layout: Layout,
}

/// A type in memory.
#[derive(Debug, Clone, PartialEq)]
pub enum Layout {
    Bool,
    /// 'i', 'u' or 'f' and bits.
    Scalar(char, u32),
    Vector(char, u32, u32),
    /// columns, rows, of f32.
    Matrix(u32, u32),
    Array(Box<Layout>, u32, u32),
    Struct(Struct),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Struct {
    pub name: String,
    pub fields: Vec<Field>,
    pub size_bytes: u32,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub name: String,
    pub offset_bytes: u32,
    pub layout: Layout,
}

/// Reads the interface of the one entry point of `spirv`.
pub fn reflect(spirv: &[u32]) -> Result<Interface, String> {
    let entry_points = ReflectConfig::new()
        .spv(spirv)
        .ref_all_rscs(true)
        .combine_img_samplers(true)
        .reflect()
        .map_err(|e| format!("reflection failed: {e}"))?;
    let entry = entry_points.first().ok_or("no entry point")?;
    let mut interface =
        Interface { bindings: Vec::new(), push_constants: None, constants: Vec::new(), workgroup: [1; 3] };
    for variable in &entry.vars {
        match variable {
            Variable::Descriptor { name, desc_bind, desc_ty, ty, nbind } => {
                interface.bindings.push(binding(
                    name.as_deref(),
                    desc_bind.set(),
                    desc_bind.bind(),
                    desc_ty,
                    ty,
                    *nbind,
                )?);
            }
            Variable::PushConstant { ty, .. } => match layout(ty)? {
                Layout::Struct(block) => interface.push_constants = Some(block),
                other => return Err(format!("push constants must be a block, not {other:?}")),
            },
            Variable::SpecConstant { name, spec_id, ty } => interface.constants.push(Constant {
                id: *spec_id,
                name: name.clone().ok_or_else(|| format!("specialisation constant {spec_id} has no name"))?,
                layout: layout(ty)?,
            }),
            Variable::Input { .. } | Variable::Output { .. } => {}
        }
    }
    interface.bindings.sort_by_key(|b| (b.set, b.binding));
    interface.constants.sort_by_key(|c| c.id);
    if entry.exec_model == ExecutionModel::GLCompute {
        let local_size = entry.exec_modes.iter().find(|m| m.exec_mode == spirv::ExecutionMode::LocalSize);
        let local_size = local_size.ok_or("no workgroup size")?;
        for (extent, operand) in interface.workgroup.iter_mut().zip(&local_size.operands) {
            *extent = match operand.value {
                spirq::constant::ConstantValue::U32(value) => value,
                ref other => return Err(format!("workgroup size {other:?} is no plain number")),
            };
        }
    }
    Ok(interface)
}

fn binding(
    name: Option<&str>,
    set: u32,
    binding: u32,
    descriptor: &DescriptorType,
    ty: &Type,
    count: u32,
) -> Result<Binding, String> {
    let access = |access: &AccessType| (*access != AccessType::WriteOnly, *access != AccessType::ReadOnly);
    let ((reads, writes), kind, own_name) = match descriptor {
        DescriptorType::StorageBuffer(a) => {
            let (own_name, element) = block_element(ty)?;
            (access(a), BindingKind::Buffer(element), Some(own_name))
        }
        DescriptorType::CombinedImageSampler() if count == 1 => {
            ((true, false), BindingKind::SampledImage(sampled_shape(ty)?), None)
        }
        DescriptorType::CombinedImageSampler() => ((true, false), BindingKind::TextureTable, None),
        DescriptorType::UniformTexelBuffer() => ((true, false), BindingKind::TexelBuffer, None),
        DescriptorType::StorageImage(a) => (access(a), BindingKind::StorageImage(storage_format(ty)?), None),
        DescriptorType::AccelStruct() => ((true, false), BindingKind::AccelerationStructure, None),
        other => return Err(format!("binding {set}.{binding}: {other:?} is not used in this project")),
    };
    let name = own_name.or(name.map(str::to_owned));
    let name = name.filter(|n| !n.is_empty()).ok_or_else(|| format!("binding {set}.{binding} has no name"))?;
    Ok(Binding { set, binding, name, kind, reads, writes })
}

fn sampled_shape(ty: &Type) -> Result<ImageShape, String> {
    let Type::CombinedImageSampler(sampled) = ty else { return Err(format!("{ty} is no image with a sampler")) };
    let image = &sampled.sampled_image_ty;
    let shape = match (image.dim, image.is_array) {
        _ if image.is_multisampled => return Err(format!("{ty}: images have one sample a pixel here")),
        (spirv::Dim::Dim2D, false) => "Flat",
        (spirv::Dim::Dim2D, true) => "Array",
        (spirv::Dim::DimCube, true) => "CubeArray",
        _ => return Err(format!("{ty}: no image of ours has this shape")),
    };
    match image.scalar_ty {
        ScalarType::Float { bits: 32 } => Ok(ImageShape { shape, is_integer: false }),
        ScalarType::Integer { bits: 32, is_signed: false } => Ok(ImageShape { shape, is_integer: true }),
        _ => Err(format!("{ty}: no image of ours has such texels")),
    }
}

fn storage_format(ty: &Type) -> Result<&'static str, String> {
    let Type::StorageImage(image) = ty else { return Err(format!("{ty} is no storage image")) };
    if image.dim != spirv::Dim::Dim2D || image.is_array || image.is_multisampled {
        return Err(format!("{ty}: storage images are flat here"));
    }
    match image.fmt {
        spirv::ImageFormat::Rgba8 => Ok("Rgba8"),
        spirv::ImageFormat::Rgba16f => Ok("Rgba16Float"),
        spirv::ImageFormat::Rgba32f => Ok("Rgba32Float"),
        spirv::ImageFormat::R32f => Ok("R32Float"),
        spirv::ImageFormat::R32ui => Ok("R32Uint"),
        _ => Err(format!("{ty}: no image of ours has this format; declare one of crate::gpu::Format")),
    }
}

/// A buffer block holds one member, `T items[]` or `T item`: its name and element type.
fn block_element(ty: &Type) -> Result<(String, Layout), String> {
    let Type::Struct(block) = ty else { return Err(format!("a buffer binding is no block: {ty}")) };
    let [member] = block.members.as_slice() else {
        return Err(format!(
            "buffer block {:?} has {} members; declare one array or one struct in it",
            block.name,
            block.members.len()
        ));
    };
    let name = member.name.clone().ok_or("a buffer block's member has no name")?;
    let element = match &member.ty {
        Type::Array(array) if array.nelement.is_none() => {
            let element = layout(&array.element_ty)?;
            let stride = array.stride.unwrap_or(0) as u32;
            if stride != element.size_bytes() {
                return Err(format!(
                    "`{name}` has stride {stride} but element size {}; use layout(scalar)",
                    element.size_bytes()
                ));
            }
            element
        }
        other => layout(other)?,
    };
    Ok((name, element))
}

fn scalar(ty: &ScalarType) -> Result<(char, u32), String> {
    match ty {
        ScalarType::Integer { bits, is_signed } => Ok((if *is_signed { 'i' } else { 'u' }, *bits)),
        ScalarType::Float { bits } => Ok(('f', *bits)),
        other => Err(format!("{other} cannot stand in memory")),
    }
}

fn vector(ty: &VectorType) -> Result<Layout, String> {
    let (kind, bits) = scalar(&ty.scalar_ty)?;
    Ok(Layout::Vector(kind, bits, ty.nscalar))
}

fn layout(ty: &Type) -> Result<Layout, String> {
    match ty {
        Type::Scalar(ScalarType::Boolean) => Ok(Layout::Bool),
        Type::Scalar(s) => scalar(s).map(|(kind, bits)| Layout::Scalar(kind, bits)),
        Type::Vector(v) => vector(v),
        Type::Matrix(m) => match vector(&m.vector_ty)? {
            Layout::Vector('f', 32, rows) if m.stride == Some(4 * rows as usize) => Ok(Layout::Matrix(m.nvector, rows)),
            other => Err(format!("matrix of {other:?} with stride {:?}; use layout(scalar) and float", m.stride)),
        },
        Type::Array(a) => {
            let count = a.nelement.ok_or("an unbounded array must be a block's only member")?;
            Ok(Layout::Array(Box::new(layout(&a.element_ty)?), count, a.stride.unwrap_or(0) as u32))
        }
        Type::Struct(s) => {
            let mut fields = Vec::new();
            for member in &s.members {
                fields.push(Field {
                    name: member.name.clone().ok_or("a struct member has no name")?,
                    offset_bytes: member.offset.ok_or("a struct member has no offset")? as u32,
                    layout: layout(&member.ty)?,
                });
            }
            let end = fields.last().map_or(0, |f| f.offset_bytes + f.layout.size_bytes());
            let align = fields.iter().map(|f| f.layout.align_bytes()).max().unwrap_or(1);
            let name = s.name.clone().ok_or("a struct has no name")?;
            Ok(Layout::Struct(Struct { name, fields, size_bytes: end.next_multiple_of(align) }))
        }
        other => Err(format!("type {other} cannot stand in a buffer")),
    }
}

impl Layout {
    pub fn size_bytes(&self) -> u32 {
        match self {
            Self::Bool => 4,
            Self::Scalar(_, bits) => bits / 8,
            Self::Vector(_, bits, n) => bits / 8 * n,
            Self::Matrix(columns, rows) => 4 * columns * rows,
            Self::Array(_, count, stride) => count * stride,
            Self::Struct(s) => s.size_bytes,
        }
    }

    pub fn align_bytes(&self) -> u32 {
        match self {
            Self::Bool | Self::Matrix(..) => 4,
            Self::Scalar(_, bits) | Self::Vector(_, bits, _) => bits / 8,
            Self::Array(element, ..) => element.align_bytes(),
            Self::Struct(s) => s.fields.iter().map(|f| f.layout.align_bytes()).max().unwrap_or(1),
        }
    }
}

/// A fingerprint of the interface, to tell whether a reloaded shader still fits the Rust side.
pub fn fingerprint(interface: &Interface) -> u64 {
    // FNV-1a over the debug form: stable within one build, which is all that is compared.
    format!("{interface:?}")
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}
