//! Images, samplers and the scene's texture table. Every image stays in the layout GENERAL from birth to death.

use super::device::{Device, Grave};
use super::error::{Checked, GpuError};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use std::sync::Arc;

/// Pixel formats in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Rgba8Srgb,
    Rgba8,
    Rgba16Float,
    Rgba32Float,
    R32Float,
    R32Uint,
    Depth32,
}

impl Format {
    pub(super) fn raw(self) -> vk::Format {
        match self {
            Self::Rgba8Srgb => vk::Format::R8G8B8A8_SRGB,
            Self::Rgba8 => vk::Format::R8G8B8A8_UNORM,
            Self::Rgba16Float => vk::Format::R16G16B16A16_SFLOAT,
            Self::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
            Self::R32Float => vk::Format::R32_SFLOAT,
            Self::R32Uint => vk::Format::R32_UINT,
            Self::Depth32 => vk::Format::D32_SFLOAT,
        }
    }

    pub fn bytes_per_pixel(self) -> u64 {
        match self {
            Self::Rgba8Srgb | Self::Rgba8 | Self::R32Float | Self::R32Uint | Self::Depth32 => 4,
            Self::Rgba16Float => 8,
            Self::Rgba32Float => 16,
        }
    }

    pub fn is_depth(self) -> bool {
        self == Self::Depth32
    }

    /// Texels are unsigned integers, else floats.
    pub(super) fn is_integer(self) -> bool {
        self == Self::R32Uint
    }

    /// Whether shaders can write it as a storage image. sRGB images are textures only; no device need store to them.
    pub(super) fn is_storable(self) -> bool {
        !matches!(self, Self::Depth32 | Self::Rgba8Srgb)
    }

    pub(super) fn aspect(self) -> vk::ImageAspectFlags {
        if self.is_depth() { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR }
    }
}

/// How shaders see an image's layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Flat,
    Array,
    /// Six layers a cube.
    CubeArray,
}

#[derive(Debug, Clone)]
pub struct ImageDescription<'a> {
    pub name: &'a str,
    pub width: u32,
    pub height: u32,
    pub layers: u32,
    pub mip_levels: u32,
    pub format: Format,
    pub shape: Shape,
}

impl ImageDescription<'_> {
    /// Bytes of all layers of mip level 0.
    fn size_bytes(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * u64::from(self.layers) * self.format.bytes_per_pixel()
    }

    /// Refuses shapes that contradict the sizes.
    fn check(&self) -> Result<(), GpuError> {
        let Self { name, width, height, layers, mip_levels, shape, .. } = self;
        let possible_levels = (*width).max(*height).max(1).ilog2() + 1;
        let wrong = match shape {
            _ if *mip_levels == 0 || *mip_levels > possible_levels => {
                format!("{mip_levels} mip levels, possible are 1 to {possible_levels}")
            }
            Shape::Flat if *layers != 1 => format!("{layers} layers, a flat image has 1"),
            Shape::CubeArray if layers % 6 != 0 => format!("{layers} layers, cubes have 6 each"),
            Shape::CubeArray if width != height => "sides of different length, the faces of a cube are square".into(),
            _ => return Ok(()),
        };
        Err(GpuError::Refused(format!("image `{name}` of {width} x {height} has {wrong}")))
    }
}

/// A named image with its views, usable as texture, attachment, storage image and for copies.
pub struct Image {
    raw: vk::Image,
    id: u64,
    name: String,
    sampled_view: vk::ImageView,
    /// One per layer, of mip level 0: attachments and storage.
    layer_views: Vec<vk::ImageView>,
    allocation: Option<Allocation>,
    pub width: u32,
    pub height: u32,
    pub layers: u32,
    pub mip_levels: u32,
    pub format: Format,
    pub shape: Shape,
    device: Arc<Device>,
}

impl Image {
    pub(super) fn new(device: &Arc<Device>, d: &ImageDescription<'_>) -> Result<Self, GpuError> {
        let (allowed, allowed_layers) = (device.limits.image_extent, device.limits.image_layers);
        if d.width == 0
            || d.height == 0
            || d.layers == 0
            || d.width > allowed
            || d.height > allowed
            || d.layers > allowed_layers
        {
            return Err(GpuError::ImageExtent {
                name: d.name.to_owned(),
                width: d.width,
                height: d.height,
                layers: d.layers,
                allowed,
                allowed_layers,
            });
        }
        d.check()?;
        let available = device.available_bytes();
        if d.size_bytes() > available {
            return Err(GpuError::OutOfMemory {
                name: d.name.to_owned(),
                bytes: d.size_bytes(),
                available,
                heap: "device",
            });
        }
        let mut usage =
            vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        usage |= match d.format {
            Format::Depth32 => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
            format if format.is_storable() => vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::STORAGE,
            _ => vk::ImageUsageFlags::COLOR_ATTACHMENT,
        };
        let flags = if d.shape == Shape::CubeArray {
            vk::ImageCreateFlags::CUBE_COMPATIBLE
        } else {
            vk::ImageCreateFlags::empty()
        };
        let info = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(vk::ImageType::TYPE_2D)
            .format(d.format.raw())
            .extent(vk::Extent3D { width: d.width, height: d.height, depth: 1 })
            .mip_levels(d.mip_levels)
            .array_layers(d.layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage)
            .sharing_mode(vk::SharingMode::EXCLUSIVE)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: complete create infos; views are made of the live image; all is buried together in `drop`.
        unsafe {
            let raw = device.raw.create_image(&info, None).checked("vkCreateImage", d.name)?;
            let requirements = device.raw.get_image_memory_requirements(raw);
            let allocation = match device.allocate(d.name, requirements, MemoryLocation::GpuOnly, false) {
                Ok(allocation) => allocation,
                Err(error) => {
                    device.raw.destroy_image(raw, None);
                    return Err(error);
                }
            };
            let bound = device.raw.bind_image_memory(raw, allocation.memory(), allocation.offset());
            let mut image = Self {
                raw,
                id: device.new_id(),
                name: d.name.to_owned(),
                sampled_view: vk::ImageView::null(),
                layer_views: Vec::new(),
                allocation: Some(allocation),
                width: d.width,
                height: d.height,
                layers: d.layers,
                mip_levels: d.mip_levels,
                format: d.format,
                shape: d.shape,
                device: device.clone(),
            };
            bound.checked("vkBindImageMemory", d.name)?;
            device.set_name(raw, d.name);
            let shape = match d.shape {
                Shape::Flat => vk::ImageViewType::TYPE_2D,
                Shape::Array => vk::ImageViewType::TYPE_2D_ARRAY,
                Shape::CubeArray => vk::ImageViewType::CUBE_ARRAY,
            };
            image.sampled_view = image.view(shape, 0, d.layers, d.mip_levels)?;
            for layer in 0..d.layers {
                let view = image.view(vk::ImageViewType::TYPE_2D, layer, 1, 1)?;
                image.layer_views.push(view);
            }
            Ok(image)
        }
    }

    /// # Safety
    /// The layers and mip levels lie in the image, and fit the shape.
    unsafe fn view(
        &self,
        shape: vk::ImageViewType,
        first_layer: u32,
        layers: u32,
        mips: u32,
    ) -> Result<vk::ImageView, GpuError> {
        let range = vk::ImageSubresourceRange {
            aspect_mask: self.format.aspect(),
            base_mip_level: 0,
            level_count: mips,
            base_array_layer: first_layer,
            layer_count: layers,
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(shape)
            .format(self.format.raw())
            .subresource_range(range);
        // SAFETY: the image is alive; the range lies in it, as the caller promises.
        let view =
            unsafe { self.device.raw.create_image_view(&info, None) }.checked("vkCreateImageView", &self.name)?;
        self.device.set_name(view, &self.name);
        Ok(view)
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Bytes of all layers of mip level 0.
    pub fn size_bytes(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * u64::from(self.layers) * self.format.bytes_per_pixel()
    }

    pub(super) fn raw(&self) -> vk::Image {
        self.raw
    }

    pub(super) fn id(&self) -> u64 {
        self.id
    }

    pub(super) fn sampled_view(&self) -> vk::ImageView {
        self.sampled_view
    }

    pub(super) fn storage_view(&self) -> vk::ImageView {
        self.layer_views[0]
    }

    pub(super) fn layer_view(&self, layer: u32) -> vk::ImageView {
        self.layer_views[layer as usize]
    }

    pub(super) fn whole_range(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange {
            aspect_mask: self.format.aspect(),
            base_mip_level: 0,
            level_count: self.mip_levels,
            base_array_layer: 0,
            layer_count: self.layers,
        }
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        if let Some(allocation) = self.allocation.take() {
            self.device.forget_memory(&self.name, allocation.size());
            let mut views = std::mem::take(&mut self.layer_views);
            if self.sampled_view != vk::ImageView::null() {
                views.push(self.sampled_view);
            }
            self.device.bury(Grave::Image(self.raw, views, allocation));
        }
    }
}

/// How coordinates beyond the edge are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AddressMode {
    Repeat,
    MirroredRepeat,
    ClampToEdge,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SamplerDescription {
    pub address: [AddressMode; 2],
    pub mag_linear: bool,
    pub min_linear: bool,
    pub mip_linear: bool,
    /// Levels beyond the first are read.
    pub mipmapped: bool,
}

impl SamplerDescription {
    /// Linear, clamped, without mip levels.
    pub const LINEAR_CLAMP: Self = Self {
        address: [AddressMode::ClampToEdge; 2],
        mag_linear: true,
        min_linear: true,
        mip_linear: false,
        mipmapped: false,
    };
    /// Nearest texel, clamped.
    pub const NEAREST_CLAMP: Self = Self { mag_linear: false, min_linear: false, ..Self::LINEAR_CLAMP };
}

pub struct Sampler {
    raw: vk::Sampler,
    /// Takes means of texels.
    filters: bool,
    device: Arc<Device>,
}

impl Sampler {
    pub(super) fn new(device: &Arc<Device>, name: &str, d: SamplerDescription) -> Result<Self, GpuError> {
        let filter = |linear| if linear { vk::Filter::LINEAR } else { vk::Filter::NEAREST };
        let address = |mode| match mode {
            AddressMode::Repeat => vk::SamplerAddressMode::REPEAT,
            AddressMode::MirroredRepeat => vk::SamplerAddressMode::MIRRORED_REPEAT,
            AddressMode::ClampToEdge => vk::SamplerAddressMode::CLAMP_TO_EDGE,
        };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter(d.mag_linear))
            .min_filter(filter(d.min_linear))
            .mipmap_mode(if d.mip_linear { vk::SamplerMipmapMode::LINEAR } else { vk::SamplerMipmapMode::NEAREST })
            .address_mode_u(address(d.address[0]))
            .address_mode_v(address(d.address[1]))
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .max_lod(if d.mipmapped { vk::LOD_CLAMP_NONE } else { 0.0 });
        // SAFETY: complete create info.
        let raw = unsafe { device.raw.create_sampler(&info, None) }.checked("vkCreateSampler", name)?;
        device.set_name(raw, name);
        let filters = d.mag_linear || d.min_linear || d.mip_linear;
        Ok(Self { raw, filters, device: device.clone() })
    }

    pub(super) fn filters(&self) -> bool {
        self.filters
    }

    pub(super) fn raw(&self) -> vk::Sampler {
        self.raw
    }

    /// Whether both were made on the same device.
    pub(super) fn is_beside(&self, image: &Image) -> bool {
        Arc::ptr_eq(&self.device, &image.device)
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        self.device.bury(Grave::Sampler(self.raw));
    }
}

/// All textures of a scene as one descriptor array (set 1, binding 0), indexed non-uniformly.
pub struct TextureTable {
    pool: vk::DescriptorPool,
    set: vk::DescriptorSet,
    /// Kept alive as long as the set.
    textures: Vec<Image>,
    samplers: Vec<Sampler>,
    device: Arc<Device>,
}

impl TextureTable {
    /// `textures[i]` is read through `samplers[sampler_of[i]]`. Fails when there are more than the device binds.
    pub(super) fn new(
        device: &Arc<Device>,
        layout: vk::DescriptorSetLayout,
        images: Vec<Image>,
        samplers: Vec<Sampler>,
        textures: &[(usize, usize)],
    ) -> Result<Self, GpuError> {
        let allowed = u64::from(device.limits.textures);
        let count = textures.len().max(1) as u32;
        if u64::from(count) > allowed {
            return Err(GpuError::Refused(format!(
                "texture table: the scene has {count} textures, this device binds {allowed}; use a scene with fewer textures"
            )));
        }
        let absent = |&(image, sampler): &(usize, usize)| image >= images.len() || sampler >= samplers.len();
        if let Some(wrong) = textures.iter().position(absent) {
            return Err(GpuError::Refused(format!(
                "texture table: texture {wrong} takes image and sampler {:?}, there are {} and {}",
                textures[wrong],
                images.len(),
                samplers.len()
            )));
        }
        let is_foreign = |other: &Arc<Device>| !Arc::ptr_eq(device, other);
        if images.iter().any(|i| is_foreign(&i.device)) || samplers.iter().any(|s| is_foreign(&s.device)) {
            return Err(GpuError::Refused("texture table: an image or sampler is of another device".into()));
        }
        if let Some(wrong) = images.iter().find(|i| i.shape != Shape::Flat || i.format.is_integer()) {
            let Image { name, shape, format, .. } = wrong;
            return Err(GpuError::Refused(format!("texture table: image `{name}` is {shape:?} of {format:?}")));
        }
        // SAFETY: create infos outlive their calls; written descriptors refer to live objects that the table keeps.
        unsafe {
            let sizes =
                [vk::DescriptorPoolSize { ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER, descriptor_count: count }];
            let pool_info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
            let pool =
                device.raw.create_descriptor_pool(&pool_info, None).checked("vkCreateDescriptorPool", "textures")?;
            device.set_name(pool, "textures");
            let counts = [count];
            let layouts = [layout];
            let mut variable =
                vk::DescriptorSetVariableDescriptorCountAllocateInfo::default().descriptor_counts(&counts);
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts)
                .push_next(&mut variable);
            let mut table =
                Self { pool, set: vk::DescriptorSet::null(), textures: images, samplers, device: device.clone() };
            table.set = device.raw.allocate_descriptor_sets(&info).checked("vkAllocateDescriptorSets", "textures")?[0];
            device.set_name(table.set, "textures");
            let infos: Vec<_> = textures
                .iter()
                .map(|&(image, sampler)| {
                    vk::DescriptorImageInfo::default()
                        .image_view(table.textures[image].sampled_view())
                        .image_layout(vk::ImageLayout::GENERAL)
                        .sampler(table.samplers[sampler].raw())
                })
                .collect();
            if !infos.is_empty() {
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(table.set)
                    .dst_binding(0)
                    .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                    .image_info(&infos);
                device.raw.update_descriptor_sets(&[write], &[]);
            }
            Ok(table)
        }
    }

    /// Device bytes of all textures, mip level 0.
    pub fn size_bytes(&self) -> u64 {
        self.textures.iter().map(Image::size_bytes).sum()
    }

    pub(super) fn set(&self) -> vk::DescriptorSet {
        self.set
    }

    pub(super) fn is_of(&self, device: &Arc<Device>) -> bool {
        Arc::ptr_eq(&self.device, device)
    }
}

impl Drop for TextureTable {
    fn drop(&mut self) {
        self.device.bury(Grave::DescriptorPool(self.pool));
    }
}
