//! A pass: the static description of a program (made from its shader at build time) and one use of it with its
//! buffers, parameters and constants.

use super::{AccelerationStructure, Buffer, Format, Image, Sampler, Shape, TexelBuffer, TextureTable};
use ash::vk;

/// One program: a compute shader, or a vertex and a fragment shader. Written by the build script.
#[derive(Debug)]
pub struct Program {
    /// The shader file without extension, `gather/links`: label, timing row and test name too.
    pub name: &'static str,
    pub stages: &'static [Stage],
    /// Bindings of set 0 in ascending order.
    pub bindings: &'static [BindingInfo],
    pub push_constant_bytes: u32,
    /// Threads per workgroup (compute).
    pub workgroup: [u32; 3],
    /// Set 1 is the scene's texture table.
    pub uses_textures: bool,
}

/// One compiled shader file of a program.
#[derive(Debug)]
pub struct Stage {
    pub kind: StageKind,
    /// Relative to `glsl/`.
    pub file: &'static str,
    /// Little-endian words.
    pub spirv: &'static [u8],
    /// Fingerprint of the reflected interface.
    pub interface: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StageKind {
    Compute,
    Vertex,
    Fragment,
}

#[derive(Debug)]
pub struct BindingInfo {
    pub name: &'static str,
    pub binding: u32,
    pub kind: ResourceKind,
    pub reads: bool,
    pub writes: bool,
}

/// What a shader declares of a binding, and what an object can be bound as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResourceKind {
    Buffer,
    TexelBuffer,
    SampledImage {
        shape: Shape,
        /// Texels are unsigned integers, else floats.
        is_integer: bool,
    },
    StorageImage(Format),
    AccelerationStructure,
}

impl Program {
    /// True for a compute program.
    pub fn is_compute(&self) -> bool {
        self.stages.iter().any(|s| s.kind == StageKind::Compute)
    }
}

/// One use of a program. Implemented by generated structs whose fields are the shader's bindings.
pub trait Pass {
    const PROGRAM: &'static Program;
    /// Hands over every binding in ascending order, then push constants and specialisation constants.
    fn bind<'b>(&'b self, bindings: &mut Bindings<'b>);
}

/// An image with the sampler it is read by.
#[derive(Clone, Copy)]
pub struct Sampled<'a> {
    pub image: &'a Image,
    pub sampler: &'a Sampler,
}

/// What a pass binds, collected by [`Pass::bind`].
#[derive(Default)]
pub struct Bindings<'b> {
    pub(super) resources: Vec<Resource>,
    pub(super) push_constants: &'b [u8],
    /// (id, 32 bits).
    pub(super) constants: Vec<(u32, u32)>,
    pub(super) textures: Option<&'b TextureTable>,
    /// What cannot be bound, if anything: the first of it.
    pub(super) refusal: Option<String>,
}

/// One bound object: what the descriptor needs and what the hazard check needs.
pub(super) struct Resource {
    /// Unique per object; see [`super::device::Device::new_id`].
    pub id: u64,
    pub bytes: u64,
    pub kind: ResourceKind,
    pub handle: Handle,
}

pub(super) enum Handle {
    Buffer(vk::DescriptorBufferInfo),
    TexelBuffer([vk::BufferView; 1]),
    Image(vk::DescriptorImageInfo),
    AccelerationStructure(vk::AccelerationStructureKHR),
}

impl<'b> Bindings<'b> {
    pub fn buffer<T>(&mut self, buffer: &'b Buffer<T>) {
        let info = vk::DescriptorBufferInfo::default().buffer(buffer.raw()).offset(0).range(vk::WHOLE_SIZE);
        self.raw_buffer(buffer.id(), buffer.size_bytes(), info);
    }

    /// A buffer known by its handle alone.
    pub(super) fn raw_buffer(&mut self, id: u64, bytes: u64, info: vk::DescriptorBufferInfo) {
        self.resources.push(Resource { id, bytes, kind: ResourceKind::Buffer, handle: Handle::Buffer(info) });
    }

    pub fn texel_buffer(&mut self, texels: &'b TexelBuffer) {
        let handle = Handle::TexelBuffer([texels.view()]);
        let (id, bytes) = (texels.buffer().id(), texels.size_bytes());
        self.resources.push(Resource { id, bytes, kind: ResourceKind::TexelBuffer, handle });
    }

    pub fn sampled(&mut self, sampled: Sampled<'b>) {
        if !sampled.sampler.is_beside(sampled.image) {
            self.refusal
                .get_or_insert_with(|| format!("image `{}` has a sampler of another device", sampled.image.name()));
        }
        if sampled.sampler.filters() && sampled.image.format.is_integer() {
            let name = sampled.image.name();
            self.refusal.get_or_insert_with(|| format!("image `{name}` has integers, which cannot be filtered"));
        }
        let info = vk::DescriptorImageInfo::default()
            .image_view(sampled.image.sampled_view())
            .image_layout(vk::ImageLayout::GENERAL)
            .sampler(sampled.sampler.raw());
        let Image { shape, format, .. } = *sampled.image;
        let kind = ResourceKind::SampledImage { shape, is_integer: format.is_integer() };
        let (id, bytes) = (sampled.image.id(), sampled.image.size_bytes());
        self.resources.push(Resource { id, bytes, kind, handle: Handle::Image(info) });
    }

    pub fn storage_image(&mut self, image: &'b Image) {
        if !image.format.is_storable() {
            self.refusal.get_or_insert_with(|| {
                format!("image `{}` is {:?}, which cannot be written", image.name(), image.format)
            });
        }
        let info =
            vk::DescriptorImageInfo::default().image_view(image.storage_view()).image_layout(vk::ImageLayout::GENERAL);
        let (id, bytes, kind) = (image.id(), image.size_bytes(), ResourceKind::StorageImage(image.format));
        self.resources.push(Resource { id, bytes, kind, handle: Handle::Image(info) });
    }

    pub fn acceleration_structure(&mut self, structure: &'b AccelerationStructure) {
        let handle = Handle::AccelerationStructure(structure.raw());
        let (id, bytes, kind) = (structure.id(), structure.size_bytes(), ResourceKind::AccelerationStructure);
        self.resources.push(Resource { id, bytes, kind, handle });
    }

    pub fn textures(&mut self, table: &'b TextureTable) {
        self.textures = Some(table);
    }

    pub fn push_constants(&mut self, bytes: &'b [u8]) {
        self.push_constants = bytes;
    }

    pub fn constant(&mut self, id: u32, bits: u32) {
        self.constants.push((id, bits));
    }

    /// What of it does not fit the shader of `program`, if anything: number and kinds of objects, shapes and formats of
    /// images, bytes of push constants. Sizes of buffers are the shader's business, and the device checks them.
    pub(super) fn misfit(&self, program: &Program) -> Option<String> {
        let (given, wanted) = (self.resources.len(), program.bindings.len());
        if given != wanted {
            return Some(format!("{given} objects are bound, its shader declares {wanted}"));
        }
        let mut pairs = self.resources.iter().zip(program.bindings);
        if let Some((resource, info)) = pairs.find(|(resource, info)| resource.kind != info.kind) {
            return Some(format!("`{}` is {:?}, what is bound to it {:?}", info.name, info.kind, resource.kind));
        }
        if self.push_constants.len() != program.push_constant_bytes as usize {
            let (given, wanted) = (self.push_constants.len(), program.push_constant_bytes);
            return Some(format!("{given} bytes of push constants, its shader declares {wanted}"));
        }
        (program.uses_textures && self.textures.is_none()).then(|| "the texture table is not bound".to_owned())
    }
}
