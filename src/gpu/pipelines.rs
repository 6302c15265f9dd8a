//! Pipelines by program, constants and raster state, made on first use and kept; their cache lives on disk.

use super::device::{Device, Grave, MAX_TEXTURES, lock};
use super::error::{Checked, GpuError};
use super::image::Format;
use super::pass::{Program, ResourceKind, StageKind};
use crate::files;
use ash::vk;
use std::collections::HashMap;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Which triangles a raster pass drops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Cull {
    #[default]
    None,
    Front,
    Back,
}

/// How a raster pass's colours meet those of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Blend {
    #[default]
    Replace,
    /// Colours are premultiplied by their alpha and laid over.
    Over,
    /// Colours and alphas are added up.
    Add,
}

/// Fixed-function state of a raster pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct RasterState {
    pub cull: Cull,
    /// Draw only what is nearer than the depth image, and write it. Depth is reversed everywhere: 1 near, 0 far.
    pub depth_test: bool,
    pub blend: Blend,
    /// Draw lines along triangle edges' vertices (line list) instead of triangles.
    pub lines: bool,
}

#[derive(Clone, PartialEq, Eq, Hash)]
struct Key {
    program: &'static str,
    constants: Vec<(u32, u32)>,
    raster: Option<(RasterState, Vec<vk::Format>, vk::Format)>,
}

/// Layouts of a program, made once.
#[derive(Clone, Copy)]
struct Layouts {
    set: vk::DescriptorSetLayout,
    pipeline: vk::PipelineLayout,
}

/// A pipeline ready to bind.
#[derive(Clone, Copy)]
pub(super) struct Bound {
    pub pipeline: vk::Pipeline,
    pub layout: vk::PipelineLayout,
}

pub(super) struct Pipelines {
    device: Arc<Device>,
    cache: vk::PipelineCache,
    cache_file: Option<PathBuf>,
    pub texture_layout: vk::DescriptorSetLayout,
    layouts: Mutex<HashMap<&'static str, Layouts>>,
    pipelines: Mutex<HashMap<Key, vk::Pipeline>>,
    /// SPIR-V of reloaded shaders by file, in place of what was built in.
    reloaded: Mutex<HashMap<&'static str, Vec<u32>>>,
    made: AtomicU64,
}

impl Pipelines {
    /// `cache_file` is where the driver's pipeline cache is kept between runs; unreadable or foreign data is ignored.
    pub fn new(device: &Arc<Device>, cache_file: Option<PathBuf>) -> Result<Self, GpuError> {
        // The driver checks the header (vendor, device, UUID) of what it is given and starts empty if it does not fit.
        let data = cache_file.as_ref().and_then(|f| files::read(f).ok()).and_then(undamaged).unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&data);
        let stages = vk::ShaderStageFlags::COMPUTE | vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .binding(0)
            .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
            .descriptor_count(device.limits.textures.min(MAX_TEXTURES))
            .stage_flags(stages)];
        let flags =
            [vk::DescriptorBindingFlags::PARTIALLY_BOUND | vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT];
        let mut binding_flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
        let layout_info =
            vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings).push_next(&mut binding_flags);
        // SAFETY: complete create infos.
        let (cache, texture_layout) = unsafe {
            let cache = device.raw.create_pipeline_cache(&info, None).checked("vkCreatePipelineCache", "start")?;
            let layout = device
                .raw
                .create_descriptor_set_layout(&layout_info, None)
                .inspect_err(|_| device.raw.destroy_pipeline_cache(cache, None))
                .checked("vkCreateDescriptorSetLayout", "textures")?;
            (cache, layout)
        };
        device.set_name(cache, "pipeline cache");
        device.set_name(texture_layout, "textures");
        Ok(Self {
            device: device.clone(),
            cache,
            cache_file,
            texture_layout,
            layouts: Mutex::default(),
            pipelines: Mutex::default(),
            reloaded: Mutex::default(),
            made: AtomicU64::new(0),
        })
    }

    pub fn compute(&self, program: &'static Program, constants: &[(u32, u32)]) -> Result<Bound, GpuError> {
        let layouts = self.layouts(program)?;
        let key = Key { program: program.name, constants: constants.to_vec(), raster: None };
        self.find_or_make(key, layouts, || self.make_compute(program, constants, layouts.pipeline))
    }

    pub fn raster(
        &self,
        program: &'static Program,
        constants: &[(u32, u32)],
        state: RasterState,
        color: &[Format],
        depth: Option<Format>,
    ) -> Result<Bound, GpuError> {
        let layouts = self.layouts(program)?;
        let color: Vec<_> = color.iter().map(|f| f.raw()).collect();
        let depth = depth.map_or(vk::Format::UNDEFINED, Format::raw);
        let key =
            Key { program: program.name, constants: constants.to_vec(), raster: Some((state, color.clone(), depth)) };
        self.find_or_make(key, layouts, || self.make_raster(program, constants, layouts.pipeline, state, &color, depth))
    }

    /// Puts new SPIR-V in the place of `file`'s and forgets the pipelines of `program`.
    pub fn replace(&self, program: &'static Program, file: &'static str, spirv: Vec<u32>) {
        lock(&self.reloaded).insert(file, spirv);
        let mut pipelines = lock(&self.pipelines);
        let old: Vec<Key> = pipelines.keys().filter(|k| k.program == program.name).cloned().collect();
        let old = old.iter().filter_map(|key| pipelines.remove(key)).collect();
        self.device.bury(Grave::Pipelines(old));
    }

    /// How many were made so far; none should be once a program is warm.
    pub fn made_count(&self) -> u64 {
        self.made.load(Ordering::Relaxed)
    }

    fn find_or_make(
        &self,
        key: Key,
        layouts: Layouts,
        make: impl FnOnce() -> Result<vk::Pipeline, GpuError>,
    ) -> Result<Bound, GpuError> {
        let layout = layouts.pipeline;
        if let Some(&pipeline) = lock(&self.pipelines).get(&key) {
            return Ok(Bound { pipeline, layout });
        }
        let start = std::time::Instant::now();
        let pipeline = make()?;
        self.made.fetch_add(1, Ordering::Relaxed);
        self.device.set_name(pipeline, key.program);
        tracing::debug!("pipeline {} made in {:.1} ms", key.program, start.elapsed().as_secs_f64() * 1e3);
        lock(&self.pipelines).insert(key, pipeline);
        Ok(Bound { pipeline, layout })
    }

    fn layouts(&self, program: &'static Program) -> Result<Layouts, GpuError> {
        if let Some(&layouts) = lock(&self.layouts).get(program.name) {
            return Ok(layouts);
        }
        let stages = stage_flags(program);
        let bindings: Vec<_> = program
            .bindings
            .iter()
            .map(|b| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(b.binding)
                    .descriptor_type(descriptor_type(b.kind))
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let set_info = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
            .bindings(&bindings);
        // SAFETY: complete create infos over live layouts.
        let layouts = unsafe {
            let set = self
                .device
                .raw
                .create_descriptor_set_layout(&set_info, None)
                .checked("vkCreateDescriptorSetLayout", program.name)?;
            let sets = [set, self.texture_layout];
            let push = [vk::PushConstantRange { stage_flags: stages, offset: 0, size: program.push_constant_bytes }];
            let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(if program.uses_textures {
                &sets
            } else {
                &sets[..1]
            });
            if program.push_constant_bytes > 0 {
                info = info.push_constant_ranges(&push);
            }
            let pipeline = self
                .device
                .raw
                .create_pipeline_layout(&info, None)
                .inspect_err(|_| self.device.raw.destroy_descriptor_set_layout(set, None))
                .checked("vkCreatePipelineLayout", program.name)?;
            self.device.set_name(set, program.name);
            self.device.set_name(pipeline, program.name);
            Layouts { set, pipeline }
        };
        lock(&self.layouts).insert(program.name, layouts);
        Ok(layouts)
    }

    fn module(&self, spirv: &[u32], name: &str) -> Result<vk::ShaderModule, GpuError> {
        let info = vk::ShaderModuleCreateInfo::default().code(spirv);
        // SAFETY: the words were compiled by us from GLSL.
        let module =
            unsafe { self.device.raw.create_shader_module(&info, None) }.checked("vkCreateShaderModule", name)?;
        self.device.set_name(module, name);
        Ok(module)
    }

    fn modules(&self, program: &'static Program) -> Result<Vec<(vk::ShaderStageFlags, vk::ShaderModule)>, GpuError> {
        let reloaded = lock(&self.reloaded);
        let mut modules = Vec::new();
        for stage in program.stages {
            let built_in;
            let spirv = match reloaded.get(stage.file) {
                Some(spirv) => spirv.as_slice(),
                None => {
                    built_in = stage
                        .spirv
                        .chunks_exact(4)
                        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                        .collect::<Vec<_>>();
                    &built_in
                }
            };
            let flag = match stage.kind {
                StageKind::Compute => vk::ShaderStageFlags::COMPUTE,
                StageKind::Vertex => vk::ShaderStageFlags::VERTEX,
                StageKind::Fragment => vk::ShaderStageFlags::FRAGMENT,
            };
            match self.module(spirv, stage.file) {
                Ok(module) => modules.push((flag, module)),
                Err(error) => {
                    self.destroy(&modules);
                    return Err(error);
                }
            }
        }
        Ok(modules)
    }

    fn destroy(&self, modules: &[(vk::ShaderStageFlags, vk::ShaderModule)]) {
        // SAFETY: modules may go once their pipelines stand, or will never be made.
        unsafe { modules.iter().for_each(|m| self.device.raw.destroy_shader_module(m.1, None)) };
    }

    fn make_compute(
        &self,
        program: &'static Program,
        constants: &[(u32, u32)],
        layout: vk::PipelineLayout,
    ) -> Result<vk::Pipeline, GpuError> {
        let modules = self.modules(program)?;
        let (entries, data) = specialization(constants);
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(modules[0].0)
            .module(modules[0].1)
            .name(c"main")
            .specialization_info(&special);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout);
        // SAFETY: complete create info over live modules.
        unsafe {
            let made = self.device.raw.create_compute_pipelines(self.cache, &[info], None);
            self.destroy(&modules);
            made.map(|p| p[0]).map_err(|(_, e)| e).checked("vkCreateComputePipelines", program.name)
        }
    }

    fn make_raster(
        &self,
        program: &'static Program,
        constants: &[(u32, u32)],
        layout: vk::PipelineLayout,
        state: RasterState,
        color: &[vk::Format],
        depth: vk::Format,
    ) -> Result<vk::Pipeline, GpuError> {
        let modules = self.modules(program)?;
        let (entries, data) = specialization(constants);
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        let stages: Vec<_> = modules
            .iter()
            .map(|m| {
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(m.0)
                    .module(m.1)
                    .name(c"main")
                    .specialization_info(&special)
            })
            .collect();
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
        let topology =
            if state.lines { vk::PrimitiveTopology::LINE_LIST } else { vk::PrimitiveTopology::TRIANGLE_LIST };
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(topology);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(match state.cull {
                Cull::None => vk::CullModeFlags::NONE,
                Cull::Front => vk::CullModeFlags::FRONT,
                Cull::Back => vk::CullModeFlags::BACK,
            })
            // Counter-clockwise in glTF's y-up world is counter-clockwise in a y-down framebuffer seen through
            // a projection that flips y.
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth_state = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(state.depth_test)
            .depth_write_enable(state.depth_test)
            .depth_compare_op(vk::CompareOp::GREATER);
        let kept = if state.blend == Blend::Add { vk::BlendFactor::ONE } else { vk::BlendFactor::ONE_MINUS_SRC_ALPHA };
        let blend = vk::PipelineColorBlendAttachmentState {
            blend_enable: vk::Bool32::from(state.blend != Blend::Replace),
            src_color_blend_factor: vk::BlendFactor::ONE,
            dst_color_blend_factor: kept,
            color_blend_op: vk::BlendOp::ADD,
            src_alpha_blend_factor: vk::BlendFactor::ONE,
            dst_alpha_blend_factor: kept,
            alpha_blend_op: vk::BlendOp::ADD,
            color_write_mask: vk::ColorComponentFlags::RGBA,
        };
        let blends = vec![blend; color.len()];
        let blending = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(color).depth_attachment_format(depth);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth_state)
            .color_blend_state(&blending)
            .dynamic_state(&dynamic)
            .layout(layout)
            .push_next(&mut rendering);
        // SAFETY: complete create info over live modules.
        unsafe {
            let made = self.device.raw.create_graphics_pipelines(self.cache, &[info], None);
            self.destroy(&modules);
            made.map(|p| p[0]).map_err(|(_, e)| e).checked("vkCreateGraphicsPipelines", program.name)
        }
    }

    /// Writes the driver's cache to disk: a temporary file, then a rename.
    fn save_cache(&self) -> std::io::Result<()> {
        let Some(file) = &self.cache_file else { return Ok(()) };
        let Some(folder) = file.parent() else { return Ok(()) };
        // SAFETY: the cache is alive.
        let data = unsafe { self.device.raw.get_pipeline_cache_data(self.cache) }.unwrap_or_default();
        files::create_dir_all(folder)?;
        let mut part = files::Part::create(&tempfile::Builder::new(), file)?;
        part.write_all(blake3::hash(&data).as_bytes())?;
        part.write_all(&data)?;
        part.finish()
    }
}

impl Drop for Pipelines {
    fn drop(&mut self) {
        if self.device.is_hung.load(Ordering::Acquire) {
            return;
        }
        if let Err(error) = self.save_cache() {
            tracing::debug!("pipeline cache not saved: {error}");
        }
        // SAFETY: the owner waits for the device before dropping its pipelines.
        unsafe {
            let raw = &self.device.raw;
            lock(&self.pipelines).drain().for_each(|(_, pipeline)| raw.destroy_pipeline(pipeline, None));
            for (_, layouts) in lock(&self.layouts).drain() {
                raw.destroy_pipeline_layout(layouts.pipeline, None);
                raw.destroy_descriptor_set_layout(layouts.set, None);
            }
            raw.destroy_descriptor_set_layout(self.texture_layout, None);
            raw.destroy_pipeline_cache(self.cache, None);
        }
    }
}

/// The driver's data in a cache file, which starts with its checksum: a driver may crash on data it did not write.
fn undamaged(file: Vec<u8>) -> Option<Vec<u8>> {
    let (checksum, data) = file.split_first_chunk::<{ blake3::OUT_LEN }>()?;
    (blake3::hash(data) == *checksum).then(|| data.to_vec())
}

pub(super) fn stage_flags(program: &Program) -> vk::ShaderStageFlags {
    if program.is_compute() {
        vk::ShaderStageFlags::COMPUTE
    } else {
        vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT
    }
}

pub(super) fn descriptor_type(kind: ResourceKind) -> vk::DescriptorType {
    match kind {
        ResourceKind::Buffer => vk::DescriptorType::STORAGE_BUFFER,
        ResourceKind::TexelBuffer => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        ResourceKind::SampledImage { .. } => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        ResourceKind::StorageImage(_) => vk::DescriptorType::STORAGE_IMAGE,
        ResourceKind::AccelerationStructure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
    }
}

fn specialization(constants: &[(u32, u32)]) -> (Vec<vk::SpecializationMapEntry>, Vec<u8>) {
    let entries = constants
        .iter()
        .enumerate()
        .map(|(i, &(constant_id, _))| vk::SpecializationMapEntry { constant_id, offset: 4 * i as u32, size: 4 })
        .collect();
    (entries, constants.iter().flat_map(|(_, bits)| bits.to_le_bytes()).collect())
}
