//! The logical device with everything that objects need to be made, named, counted and freed.

use super::error::{Checked, GpuError};
use super::faults::{complain, failure_of};
use super::features::{FeatureChain, OptionalFeatures};
use super::instance::Instance;
use super::selection::{Candidate, DeviceInfo};
use ash::{amd, ext, khr, vk};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use std::collections::BTreeMap;
use std::ffi::CString;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

/// Most textures a scene may have (also bounded by the device).
pub const MAX_TEXTURES: u32 = 4096;

/// Device limits that the house works within; each can be lowered by [`super::Options`] to test smaller devices.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Largest buffer a pass can bind, bytes.
    pub storage_buffer_bytes: u64,
    /// Longest texel buffer, texels of 16 bytes.
    pub texel_buffer_elements: u32,
    /// Workgroups per dispatch dimension.
    pub workgroup_count: u32,
    /// Workgroups of a row that long lists of threads are folded into.
    pub row_of_workgroups: u32,
    pub image_extent: u32,
    pub image_layers: u32,
    pub textures: u32,
    /// Nanoseconds per timestamp tick.
    pub timestamp_period_ns: f64,
    pub sampler_anisotropy: f32,
}

/// Bits of an object's number that tell it from others of its device; the bits above tell the device.
const NUMBER_BITS: u32 = 40;
static DEVICES: AtomicU64 = AtomicU64::new(0);

pub(super) struct Device {
    pub raw: ash::Device,
    pub queue: vk::Queue,
    /// Held by whoever submits, presents, or waits for the queue.
    pub queue_lock: Mutex<()>,
    pub queue_family: u32,
    pub limits: Limits,
    pub info: DeviceInfo,
    pub optional: OptionalFeatures,
    pub push_descriptor: khr::push_descriptor::Device,
    pub acceleration_structure: Option<khr::acceleration_structure::Device>,
    pub calibrated_timestamps: Option<CalibratedTimestamps>,
    pub device_fault: Option<ext::device_fault::Device>,
    pub buffer_marker: Option<amd::buffer_marker::Device>,
    dynamic_rendering: Option<khr::dynamic_rendering::Device>,
    synchronization2: Option<khr::synchronization2::Device>,
    debug_utils: Option<ext::debug_utils::Device>,
    pub timeline: vk::Semaphore,
    /// Value of the last submission.
    pub submitted: AtomicU64,
    /// Value of the last submission known to be complete.
    pub completed: AtomicU64,
    pub open_recorders: AtomicU64,
    /// Something was drawn on it.
    pub has_drawn: AtomicBool,
    /// Made so far.
    pub allocations: AtomicU64,
    /// It was lost, or never finished: nothing more will come of it.
    pub is_lost: AtomicBool,
    /// It did not finish in time, and may be at work for ever: nothing that it uses is given back.
    pub is_hung: AtomicBool,
    next_id: AtomicU64,
    allocator: Mutex<Option<Allocator>>,
    graveyard: Mutex<Vec<Grave>>,
    memory: Mutex<BTreeMap<String, MemoryUse>>,
    /// Most that all objects together may take.
    pub max_memory_bytes: u64,
    pub physical: vk::PhysicalDevice,
    pub instance: Arc<Instance>,
}

/// The same extension under both its names.
pub(super) enum CalibratedTimestamps {
    Khr(khr::calibrated_timestamps::Device),
    Ext(ext::calibrated_timestamps::Device),
}

/// Bytes held under one owner: the part of an object's name before the first '/'.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MemoryUse {
    pub current_bytes: u64,
    pub peak_bytes: u64,
}

/// Objects waiting for the device to be done with them.
pub(super) enum Grave {
    Buffer(vk::Buffer, Allocation),
    BufferView(vk::BufferView),
    Image(vk::Image, Vec<vk::ImageView>, Allocation),
    Sampler(vk::Sampler),
    Pipelines(Vec<vk::Pipeline>),
    DescriptorPool(vk::DescriptorPool),
    AccelerationStructure(vk::AccelerationStructureKHR),
}

impl Device {
    pub fn new(
        instance: Arc<Instance>,
        candidate: Candidate,
        enabled: OptionalFeatures,
        robust: bool,
    ) -> Result<Self, GpuError> {
        let Candidate { physical, info, support, .. } = candidate;
        let queue_family = support.graphics_queue_family.unwrap_or(0);
        let optional = enabled;
        // SAFETY: create structs outlive their calls; extensions and features were found present.
        unsafe {
            let priorities = [1.0];
            let queues =
                [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&priorities)];
            let skip_ray_query = |name: &&std::ffi::CStr| {
                optional.ray_query
                    || ![khr::acceleration_structure::NAME, khr::ray_query::NAME, khr::deferred_host_operations::NAME]
                        .contains(name)
            };
            // The swapchain needs the instance's surfaces, which are there only for programs with a window.
            let presents = instance.surface.is_some();
            let skip_swapchain = |name: &&std::ffi::CStr| presents || *name != khr::swapchain::NAME;
            let extensions = support.extensions.iter().copied().filter(skip_ray_query).filter(skip_swapchain);
            let extensions: Vec<_> = extensions.collect();
            let names: Vec<_> = extensions.iter().map(|e| e.as_ptr()).collect();
            let mut f = FeatureChain::enabled(optional, robust);
            let mut create = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&names)
                .enabled_features(&f.core)
                .push_next(&mut f.dynamic_rendering)
                .push_next(&mut f.synchronization2)
                .push_next(&mut f.timeline_semaphore)
                .push_next(&mut f.scalar_block_layout)
                .push_next(&mut f.descriptor_indexing)
                .push_next(&mut f.atomic_int64)
                .push_next(&mut f.host_query_reset);
            if optional.storage_16bit {
                create = create.push_next(&mut f.storage_16bit);
            }
            if optional.ray_query {
                create = create
                    .push_next(&mut f.buffer_device_address)
                    .push_next(&mut f.acceleration_structure)
                    .push_next(&mut f.ray_query);
            }
            if optional.device_fault {
                create = create.push_next(&mut f.device_fault);
            }
            let raw = instance.raw.create_device(physical, &create, None).checked("vkCreateDevice", &info.name)?;
            let queue = raw.get_device_queue(queue_family, 0);
            let allocator = Allocator::new(&AllocatorCreateDesc {
                instance: instance.raw.clone(),
                device: raw.clone(),
                physical_device: physical,
                debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
                buffer_device_address: optional.ray_query,
                allocation_sizes: gpu_allocator::AllocationSizes::default(),
            })
            .map_err(|e| GpuError::NoDevice { wanted: None, reasons: format!("{}: {e}", info.name) });
            let allocator = allocator.inspect_err(|_| raw.destroy_device(None))?;
            let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
            let timeline = raw
                .create_semaphore(&vk::SemaphoreCreateInfo::default().push_next(&mut kind), None)
                .inspect_err(|_| raw.destroy_device(None))
                .checked("vkCreateSemaphore", "start")?;

            let l = instance.raw.get_physical_device_properties(physical).limits;
            let workgroup_count = l.max_compute_work_group_count[0].min(l.max_compute_work_group_count[1]);
            let limits = Limits {
                storage_buffer_bytes: u64::from(l.max_storage_buffer_range),
                texel_buffer_elements: l.max_texel_buffer_elements,
                workgroup_count,
                row_of_workgroups: workgroup_count,
                image_extent: l
                    .max_image_dimension2_d
                    .min(l.max_image_dimension_cube)
                    .min(l.max_framebuffer_width)
                    .min(l.max_framebuffer_height),
                image_layers: l.max_image_array_layers,
                textures: MAX_TEXTURES.min(l.max_per_stage_descriptor_sampled_images.saturating_sub(16)),
                timestamp_period_ns: f64::from(l.timestamp_period),
                sampler_anisotropy: if optional.sampler_anisotropy { l.max_sampler_anisotropy.min(8.0) } else { 1.0 },
            };
            let has = |name| extensions.contains(&name);
            let device = Self {
                queue,
                queue_lock: Mutex::default(),
                queue_family,
                limits,
                info,
                optional,
                push_descriptor: khr::push_descriptor::Device::new(&instance.raw, &raw),
                acceleration_structure: optional
                    .ray_query
                    .then(|| khr::acceleration_structure::Device::new(&instance.raw, &raw)),
                calibrated_timestamps: match () {
                    () if !optional.calibrated_timestamps => None,
                    () if has(khr::calibrated_timestamps::NAME) => {
                        Some(CalibratedTimestamps::Khr(khr::calibrated_timestamps::Device::new(&instance.raw, &raw)))
                    }
                    () => Some(CalibratedTimestamps::Ext(ext::calibrated_timestamps::Device::new(&instance.raw, &raw))),
                },
                device_fault: optional.device_fault.then(|| ext::device_fault::Device::new(&instance.raw, &raw)),
                buffer_marker: optional.buffer_marker.then(|| amd::buffer_marker::Device::new(&instance.raw, &raw)),
                dynamic_rendering: has(khr::dynamic_rendering::NAME)
                    .then(|| khr::dynamic_rendering::Device::new(&instance.raw, &raw)),
                synchronization2: has(khr::synchronization2::NAME)
                    .then(|| khr::synchronization2::Device::new(&instance.raw, &raw)),
                debug_utils: instance.has_debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw)),
                timeline,
                submitted: AtomicU64::new(0),
                completed: AtomicU64::new(0),
                open_recorders: AtomicU64::new(0),
                has_drawn: AtomicBool::new(false),
                allocations: AtomicU64::new(0),
                is_lost: AtomicBool::new(false),
                is_hung: AtomicBool::new(false),
                next_id: AtomicU64::new((DEVICES.fetch_add(1, Ordering::Relaxed) + 1) << NUMBER_BITS),
                allocator: Mutex::new(Some(allocator)),
                graveyard: Mutex::default(),
                memory: Mutex::default(),
                max_memory_bytes: u64::MAX,
                physical,
                instance,
                raw,
            };
            device.set_name(queue, "queue");
            device.set_name(timeline, "submissions");
            Ok(device)
        }
    }

    /// A number that no other object has, of any device.
    pub fn new_id(&self) -> u64 {
        self.next_id.fetch_add(1, Ordering::Relaxed)
    }

    /// Whether the object of that number is this device's.
    pub fn owns(&self, id: u64) -> bool {
        id >> NUMBER_BITS == self.next_id.load(Ordering::Relaxed) >> NUMBER_BITS
    }

    /// Names a Vulkan object for captures and validation messages; in release builds too.
    pub fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(debug_utils) = &self.debug_utils else { return };
        let name = CString::new(name.replace('\0', "")).unwrap_or_default();
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle is alive. A failed naming costs only the name.
        unsafe {
            let _ = debug_utils.set_debug_utils_object_name(&info);
        }
    }

    pub fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        let Some(debug_utils) = &self.debug_utils else { return };
        let name = CString::new(name.replace('\0', "")).unwrap_or_default();
        // SAFETY: `commands` is recording.
        unsafe {
            debug_utils.cmd_begin_debug_utils_label(commands, &vk::DebugUtilsLabelEXT::default().label_name(&name))
        };
    }

    pub fn end_label(&self, commands: vk::CommandBuffer) {
        let Some(debug_utils) = &self.debug_utils else { return };
        // SAFETY: `commands` is recording inside a label.
        unsafe { debug_utils.cmd_end_debug_utils_label(commands) };
    }

    /// # Safety
    /// `commands` is recording, outside of rendering; what `info` names is alive and in the layouts it says.
    pub unsafe fn cmd_pipeline_barrier2(&self, commands: vk::CommandBuffer, info: &vk::DependencyInfo<'_>) {
        // SAFETY: as the caller promises for `commands` and `info`.
        unsafe {
            match &self.synchronization2 {
                Some(extension) => extension.cmd_pipeline_barrier2(commands, info),
                None => self.raw.cmd_pipeline_barrier2(commands, info),
            }
        }
    }

    /// # Safety
    /// `commands` is recording, outside of rendering; attachments are alive and in the layouts that `info` says.
    pub unsafe fn cmd_begin_rendering(&self, commands: vk::CommandBuffer, info: &vk::RenderingInfo<'_>) {
        // SAFETY: as the caller promises.
        unsafe {
            match &self.dynamic_rendering {
                Some(extension) => extension.cmd_begin_rendering(commands, info),
                None => self.raw.cmd_begin_rendering(commands, info),
            }
        }
    }

    /// # Safety
    /// `commands` is recording what [`Self::cmd_begin_rendering`] began.
    pub unsafe fn cmd_end_rendering(&self, commands: vk::CommandBuffer) {
        // SAFETY: as the caller promises.
        unsafe {
            match &self.dynamic_rendering {
                Some(extension) => extension.cmd_end_rendering(commands),
                None => self.raw.cmd_end_rendering(commands),
            }
        }
    }

    /// Allocates named memory and counts it under its owner.
    pub fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, GpuError> {
        let heap = if location == MemoryLocation::GpuOnly { "device" } else { "host" };
        let available = self.available_bytes();
        let fail = |_| GpuError::OutOfMemory { name: name.to_owned(), bytes: requirements.size, available, heap };
        if requirements.size > available {
            return Err(fail(gpu_allocator::AllocationError::OutOfMemory));
        }
        // The allocator takes from blocks that it has: most of its failures are no call's.
        if failure_of("allocation").is_some() {
            return Err(fail(gpu_allocator::AllocationError::OutOfMemory));
        }
        let mut guard = lock(&self.allocator);
        let Some(allocator) = guard.as_mut() else { return Err(fail(gpu_allocator::AllocationError::OutOfMemory)) };
        let allocation = allocator
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location,
                linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(fail)?;
        self.allocations.fetch_add(1, Ordering::Relaxed);
        let mut memory = lock(&self.memory);
        let usage = memory.entry(owner(name).to_owned()).or_default();
        usage.current_bytes += allocation.size();
        usage.peak_bytes = usage.peak_bytes.max(usage.current_bytes);
        Ok(allocation)
    }

    /// Device memory that may still be taken: the driver's budget where it tells one, else the heap less what we hold;
    /// in either case within what the options allow.
    pub fn available_bytes(&self) -> u64 {
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut properties = vk::PhysicalDeviceMemoryProperties2::default();
        if self.optional.memory_budget {
            properties = properties.push_next(&mut budget);
        }
        // SAFETY: the chain outlives the call.
        unsafe { self.instance.raw.get_physical_device_memory_properties2(self.physical, &mut properties) };
        let heaps = properties.memory_properties;
        let held: u64 = lock(&self.memory).values().map(|m| m.current_bytes).sum();
        let local = heaps
            .memory_heaps_as_slice()
            .iter()
            .enumerate()
            .filter(|(_, h)| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
        local
            .map(|(i, heap)| match self.optional.memory_budget {
                true => budget.heap_budget[i].saturating_sub(budget.heap_usage[i]),
                false => heap.size.saturating_sub(held),
            })
            .max()
            .unwrap_or(0)
            .min(self.max_memory_bytes.saturating_sub(held))
    }

    /// Bytes by owner, now and at most so far.
    pub fn memory_by_owner(&self) -> BTreeMap<String, MemoryUse> {
        lock(&self.memory).clone()
    }

    pub fn forget_memory(&self, name: &str, bytes: u64) {
        if let Some(usage) = lock(&self.memory).get_mut(owner(name)) {
            usage.current_bytes = usage.current_bytes.saturating_sub(bytes);
        }
    }

    /// Frees an object when the device can no longer be using it.
    pub fn bury(&self, grave: Grave) {
        lock(&self.graveyard).push(grave);
        self.sweep();
    }

    /// Frees all buried objects if nothing is recorded or running.
    pub fn sweep(&self) {
        let idle = self.open_recorders.load(Ordering::Acquire) == 0
            && self.completed.load(Ordering::Acquire) == self.submitted.load(Ordering::Acquire);
        if idle {
            let graves = std::mem::take(&mut *lock(&self.graveyard));
            for grave in graves {
                self.free(grave);
            }
        }
    }

    fn free(&self, grave: Grave) {
        // SAFETY: the device is idle with respect to these objects, and nothing else holds their handles.
        unsafe {
            let allocation = match grave {
                Grave::Buffer(buffer, allocation) => {
                    self.raw.destroy_buffer(buffer, None);
                    Some(allocation)
                }
                Grave::BufferView(view) => {
                    self.raw.destroy_buffer_view(view, None);
                    None
                }
                Grave::Image(image, views, allocation) => {
                    views.into_iter().for_each(|view| self.raw.destroy_image_view(view, None));
                    self.raw.destroy_image(image, None);
                    Some(allocation)
                }
                Grave::Sampler(sampler) => {
                    self.raw.destroy_sampler(sampler, None);
                    None
                }
                Grave::Pipelines(pipelines) => {
                    pipelines.into_iter().for_each(|pipeline| self.raw.destroy_pipeline(pipeline, None));
                    None
                }
                Grave::DescriptorPool(pool) => {
                    self.raw.destroy_descriptor_pool(pool, None);
                    None
                }
                Grave::AccelerationStructure(structure) => {
                    if let Some(extension) = &self.acceleration_structure {
                        extension.destroy_acceleration_structure(structure, None);
                    }
                    None
                }
            };
            if let (Some(allocation), Some(allocator)) = (allocation, lock(&self.allocator).as_mut())
                && let Err(error) = allocator.free(allocation)
            {
                tracing::error!("freeing device memory: {error}");
            }
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if self.is_hung.load(Ordering::Acquire) {
            std::mem::forget((lock(&self.allocator).take(), self.instance.clone()));
            return;
        }
        // SAFETY: every object holds an Arc of the device, so only buried ones are left; the queue is drained first.
        unsafe {
            let _ = self.raw.device_wait_idle();
            self.completed.store(self.submitted.load(Ordering::Acquire), Ordering::Release);
            self.open_recorders.store(0, Ordering::Release);
            self.sweep();
            let held: u64 = lock(&self.memory).values().map(|m| m.current_bytes).sum();
            complain((held > 0).then(|| format!("{held} bytes of device memory are counted still")));
            self.raw.destroy_semaphore(self.timeline, None);
            drop(lock(&self.allocator).take());
            self.raw.destroy_device(None);
        }
    }
}

fn owner(name: &str) -> &str {
    name.split('/').next().unwrap_or(name)
}

/// Locks, going on after a panic elsewhere: what these mutexes guard is consistent between statements.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
