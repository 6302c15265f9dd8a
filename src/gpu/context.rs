//! The front door of the GPU layer: one [`Context`] per device, from which everything is made.

use super::device::{CalibratedTimestamps, Device, Limits, MemoryUse, lock};
use super::error::{Checked, GpuError};
use super::features::OptionalFeatures;
use super::image::{Image, ImageDescription, Sampler, SamplerDescription, TextureTable};
use super::instance::Instance;
use super::loss::{LossHook, LossPoint, Markers};
use super::pass_hashes::PassHash;
use super::pipelines::Pipelines;
use super::profiler::{self, ClockPair, PassRecord};
use super::recorder::{CommandSlot, PASSES_PER_POOL, Recorder};
use super::selection::{self, DeviceInfo};
use super::staging::StagingPool;
use super::{Buffer, TexelBuffer};
use ash::vk;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How a context is made.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Device index or a part of its name; the fastest kind of device where empty.
    pub gpu: Option<String>,
    /// Run core and synchronization validation; messages are collected.
    pub validation: bool,
    /// With `validation`, also look at what shaders do: accesses beyond the end of buffers, which are errors then. Slow.
    pub gpu_assisted: bool,
    /// With `validation`, also say what may be slow or unwise.
    pub best_practices: bool,
    /// A full barrier before every pass. If a picture changes by it, a hazard was missed.
    pub full_barriers: bool,
    /// Leave every barrier out. Only to show that validation sees it.
    pub skip_barriers: bool,
    /// Leave new images in the layout they are born in. Only to show that validation sees it.
    pub skip_layouts: bool,
    /// Hash what every compute pass writes; see [`Context::take_hashes`].
    pub hash_passes: bool,
    /// Take no times of passes, and neither label nor mark them: to measure what that costs.
    pub no_pass_times: bool,
    /// Count invocations and primitives per pass where the device can.
    pub statistics: bool,
    /// Pretend to lack every optional feature.
    pub no_optional_features: bool,
    /// Pretend that this is the largest buffer a pass can bind, bytes.
    pub max_storage_buffer_bytes: Option<u64>,
    /// Fold lists of threads into rows of so many workgroups at most; of as many as the device allows where empty. To show
    /// that passes over lists longer than a row find their places.
    pub max_row_of_workgroups: Option<u32>,
    /// Most device memory that all objects together may take, bytes; all that the device has where empty. What is made
    /// for the device on the host keeps to it too.
    pub max_memory_bytes: Option<u64>,
    /// Where the driver's pipeline cache is kept; nowhere where empty.
    pub pipeline_cache: Option<PathBuf>,
    /// Ready to show images in windows; see [`super::Presenter`].
    pub presents: bool,
    /// Give up on a submission after this long; ten minutes where empty.
    pub timeout: Option<Duration>,
    /// Lose the device here, on purpose: the submission ends before that pass, and fails as a lost one does.
    pub lose_device_at: Option<LossPoint>,
    /// Hears of a loss.
    pub on_loss: Option<LossHook>,
}

/// How long a submission may take where nothing else is said.
const DEFAULT_TIMEOUT: Duration = Duration::from_secs(600);

/// Pipeline statistics in bit order; see `STATISTICS` of the recorder for their names.
pub(super) const STATISTIC_FLAGS: vk::QueryPipelineStatisticFlags = vk::QueryPipelineStatisticFlags::from_raw(
    vk::QueryPipelineStatisticFlags::CLIPPING_PRIMITIVES.as_raw()
        | vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS.as_raw()
        | vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS.as_raw(),
);

/// One device and all that is made on it.
pub struct Context {
    pub(super) options: Options,
    pub(super) pipelines: Pipelines,
    pub(super) markers: Markers,
    pub(super) staging_pool: Mutex<StagingPool>,
    slots: Mutex<Vec<CommandSlot>>,
    records: Mutex<Vec<PassRecord>>,
    hashes: Mutex<Vec<PassHash>>,
    // Dropped last: everything above is made on it.
    pub(super) device: Arc<Device>,
}

impl Context {
    /// Opens the wanted (or best) device. Fails by name of what is missing.
    pub fn new(options: Options) -> Result<Self, GpuError> {
        let instance = Arc::new(Instance::new(&options)?);
        let candidate = selection::choose(selection::candidates(&instance)?, options.gpu.as_deref())?;
        let enabled =
            if options.no_optional_features { OptionalFeatures::default() } else { candidate.support.optional };
        let mut device = Device::new(instance, candidate, enabled, !options.gpu_assisted)?;
        if let Some(bytes) = options.max_storage_buffer_bytes {
            device.limits.storage_buffer_bytes = device.limits.storage_buffer_bytes.min(bytes);
        }
        if let Some(longest) = options.max_row_of_workgroups {
            device.limits.row_of_workgroups = device.limits.row_of_workgroups.min(longest.max(1));
        }
        device.max_memory_bytes = options.max_memory_bytes.unwrap_or(u64::MAX);
        let device = Arc::new(device);
        tracing::debug!("device {} {} ({})", device.info.index, device.info.name, device.info.driver);
        let pipelines = Pipelines::new(&device, options.pipeline_cache.clone())?;
        let markers = Markers::new(&device)?;
        Ok(Self {
            options,
            pipelines,
            markers,
            staging_pool: Mutex::default(),
            slots: Mutex::default(),
            records: Mutex::default(),
            hashes: Mutex::default(),
            device,
        })
    }

    pub fn info(&self) -> &DeviceInfo {
        &self.device.info
    }

    /// Optional features that are on.
    pub fn features(&self) -> OptionalFeatures {
        self.device.optional
    }

    pub fn limits(&self) -> Limits {
        self.device.limits
    }

    /// Validation messages so far (warnings and errors), oldest first.
    pub fn validation_messages(&self) -> Vec<String> {
        lock(&self.device.instance.messages).clone()
    }

    /// True when core and synchronization validation listen.
    pub fn validates(&self) -> bool {
        self.device.instance.validation
    }

    /// A buffer of `len` elements with undefined content. Names are `owner/what`.
    pub fn buffer<T>(&self, name: &str, len: usize) -> Result<Buffer<T>, GpuError> {
        let buffer = Buffer::new(&self.device, name, len)?;
        if self.options.hash_passes {
            // What no pass writes is hashed too.
            let mut recorder = self.recorder("new buffer")?;
            recorder.fill(&buffer, 0);
            recorder.submit()?;
        }
        Ok(buffer)
    }

    /// `len` texels of four words with undefined content.
    pub fn texel_buffer(&self, name: &str, len: usize) -> Result<TexelBuffer, GpuError> {
        TexelBuffer::new(&self.device, name, len)
    }

    pub fn image(&self, description: &ImageDescription<'_>) -> Result<Image, GpuError> {
        let image = Image::new(&self.device, description)?;
        if self.options.skip_layouts {
            return Ok(image);
        }
        let mut recorder = self.recorder("new image")?;
        recorder.initialize_image(&image);
        recorder.submit()?;
        Ok(image)
    }

    pub fn sampler(&self, name: &str, description: SamplerDescription) -> Result<Sampler, GpuError> {
        Sampler::new(&self.device, name, description)
    }

    /// Binds `images[i]` through `samplers[s]` as texture `t` for `textures[t] = (i, s)`.
    pub fn texture_table(
        &self,
        images: Vec<Image>,
        samplers: Vec<Sampler>,
        textures: &[(usize, usize)],
    ) -> Result<TextureTable, GpuError> {
        TextureTable::new(&self.device, self.pipelines.texture_layout, images, samplers, textures)
    }

    /// Starts recording under the label `name`.
    pub fn recorder(&self, name: &str) -> Result<Recorder<'_>, GpuError> {
        Recorder::new(self, name)
    }

    /// Takes all pass records since the last call, in submission order; at most 2^18 are held until then.
    pub fn take_records(&self) -> Vec<PassRecord> {
        std::mem::take(&mut *lock(&self.records))
    }

    /// Device memory by owner (the part of names before the first '/').
    pub fn memory_by_owner(&self) -> BTreeMap<String, MemoryUse> {
        self.device.memory_by_owner()
    }

    /// Allocations of device memory so far, staging memory counted.
    pub fn allocation_count(&self) -> u64 {
        self.device.allocations.load(Ordering::Relaxed)
    }

    /// Pipelines made so far.
    pub fn pipeline_count(&self) -> u64 {
        self.pipelines.made_count()
    }

    /// Whether the device was lost or did not finish in time: then nothing more will come of it.
    pub fn is_lost(&self) -> bool {
        self.device.is_lost.load(Ordering::Acquire)
    }

    /// What [`Options::max_memory_bytes`] said.
    pub fn max_memory_bytes(&self) -> Option<u64> {
        self.options.max_memory_bytes
    }

    /// Device memory that may still be allocated, bytes.
    pub fn available_bytes(&self) -> u64 {
        self.device.available_bytes()
    }

    /// Device and host clock read together, where the device can.
    pub fn calibrate(&self) -> Option<ClockPair> {
        let domain = |time_domain| vk::CalibratedTimestampInfoKHR::default().time_domain(time_domain);
        let infos = [domain(vk::TimeDomainKHR::DEVICE), domain(vk::TimeDomainKHR::CLOCK_MONOTONIC)];
        // SAFETY: both domains are asked for by name; a device that lacks one answers with an error.
        let (values, max_deviation_ns) = unsafe {
            match &self.device.calibrated_timestamps {
                Some(CalibratedTimestamps::Khr(extension)) => extension.get_calibrated_timestamps(&infos),
                Some(CalibratedTimestamps::Ext(extension)) => extension.get_calibrated_timestamps(&infos),
                None => return None,
            }
        }
        .ok()?;
        let device_ns = (values[0] as f64 * self.device.limits.timestamp_period_ns) as u64;
        Some(ClockPair { device_ns, host_ns: values[1], max_deviation_ns })
    }

    /// Waits until submission `value` is complete.
    pub(super) fn wait(&self, value: u64, last_pass: &str) -> Result<(), GpuError> {
        let patience = self.options.timeout.unwrap_or(DEFAULT_TIMEOUT);
        let (semaphores, values) = ([self.device.timeline], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        let nanoseconds = u64::try_from(patience.as_nanos()).unwrap_or(u64::MAX);
        // SAFETY: the semaphore is alive.
        match unsafe { self.device.raw.wait_semaphores(&info, nanoseconds) } {
            Ok(()) => {
                self.device.completed.fetch_max(value, Ordering::AcqRel);
                Ok(())
            }
            Err(vk::Result::TIMEOUT) => {
                Err(GpuError::Timeout { last_pass: last_pass.to_owned(), seconds: patience.as_secs_f64() })
            }
            Err(vk::Result::ERROR_DEVICE_LOST) => {
                Err(GpuError::from_call("vkWaitSemaphores", vk::Result::ERROR_DEVICE_LOST, last_pass))
            }
            Err(error) => {
                // The work may still be running: until it ends, nothing that it uses may be freed or used again.
                let idle = {
                    let _queue = lock(&self.device.queue_lock);
                    // SAFETY: the device is alive; the queue is ours alone while its lock is held.
                    unsafe { self.device.raw.device_wait_idle() }
                };
                match idle {
                    Ok(()) => drop(self.device.completed.fetch_max(value, Ordering::AcqRel)),
                    Err(_) => self.device.is_lost.store(true, Ordering::Release),
                }
                Err(GpuError::from_call("vkWaitSemaphores", error, last_pass))
            }
        }
    }

    /// What the passes left in their buffers since the last call, in order; empty without [`Options::hash_passes`].
    pub fn take_hashes(&self) -> Vec<PassHash> {
        std::mem::take(&mut lock(&self.hashes))
    }

    pub(super) fn append_hashes(&self, hashes: impl IntoIterator<Item = PassHash>) {
        lock(&self.hashes).extend(hashes);
    }

    pub(super) fn append_records(&self, records: Vec<PassRecord>) {
        if !profiler::keep(&mut lock(&self.records), records) {
            tracing::warn!(
                "more than {} passes ran since their records were read: profiles leave out those after",
                profiler::RECORDS_KEPT
            );
        }
    }

    /// A command slot with reset command pool and queries.
    pub(super) fn take_slot(&self) -> Result<CommandSlot, GpuError> {
        let raw = &self.device.raw;
        // Apart from the condition, whose temporary would hold the lock.
        let kept = lock(&self.slots).pop();
        if let Some(slot) = kept {
            // SAFETY: slots are given back only when their submission is complete.
            unsafe {
                if let Err(error) = raw.reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty()) {
                    self.give_slot(slot);
                    return Err(GpuError::from_call("vkResetCommandPool", error, "start"));
                }
                for &pool in &slot.timestamps {
                    raw.reset_query_pool(pool, 0, 2 * PASSES_PER_POOL);
                }
                for &pool in &slot.statistics {
                    raw.reset_query_pool(pool, 0, PASSES_PER_POOL);
                }
            }
            return Ok(slot);
        }
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(self.device.queue_family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: complete create infos.
        unsafe {
            let pool = raw.create_command_pool(&info, None).checked("vkCreateCommandPool", "start")?;
            self.device.set_name(pool, "commands");
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .level(vk::CommandBufferLevel::PRIMARY)
                .command_buffer_count(1);
            match raw.allocate_command_buffers(&info).checked("vkAllocateCommandBuffers", "start") {
                Ok(made) => Ok(CommandSlot { pool, commands: made[0], timestamps: Vec::new(), statistics: Vec::new() }),
                Err(error) => {
                    raw.destroy_command_pool(pool, None);
                    Err(error)
                }
            }
        }
    }

    /// Makes query pools up to index `pool`.
    pub(super) fn grow_slot(&self, slot: &mut CommandSlot, pool: usize) -> Result<(), GpuError> {
        let raw = &self.device.raw;
        while slot.timestamps.len() <= pool {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2 * PASSES_PER_POOL);
            // SAFETY: complete create infos; fresh pools are reset before use. Statistics go first: the length of
            // `timestamps` says how far both have come.
            unsafe {
                let counts = self.options.statistics && self.device.optional.pipeline_statistics;
                if counts && slot.statistics.len() <= slot.timestamps.len() {
                    let info = vk::QueryPoolCreateInfo::default()
                        .query_type(vk::QueryType::PIPELINE_STATISTICS)
                        .pipeline_statistics(STATISTIC_FLAGS)
                        .query_count(PASSES_PER_POOL);
                    let queries = raw.create_query_pool(&info, None).checked("vkCreateQueryPool", "statistics")?;
                    self.device.set_name(queries, "statistics");
                    raw.reset_query_pool(queries, 0, PASSES_PER_POOL);
                    slot.statistics.push(queries);
                }
                let queries = raw.create_query_pool(&info, None).checked("vkCreateQueryPool", "timestamps")?;
                self.device.set_name(queries, "timestamps");
                raw.reset_query_pool(queries, 0, 2 * PASSES_PER_POOL);
                slot.timestamps.push(queries);
            }
        }
        Ok(())
    }

    pub(super) fn give_slot(&self, slot: CommandSlot) {
        lock(&self.slots).push(slot);
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // What a hung device may be using stays; see `loss`.
        if self.device.is_hung.load(Ordering::Acquire) {
            return;
        }
        // SAFETY: the device is drained before its command and query pools go.
        unsafe {
            let raw = &self.device.raw;
            let _ = raw.device_wait_idle();
            self.device.completed.store(self.device.submitted.load(Ordering::Acquire), Ordering::Release);
            for slot in lock(&self.slots).drain(..) {
                raw.destroy_command_pool(slot.pool, None);
                slot.timestamps.iter().chain(&slot.statistics).for_each(|&pool| raw.destroy_query_pool(pool, None));
            }
        }
    }
}
