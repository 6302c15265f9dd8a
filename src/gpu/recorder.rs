//! The recorder: every pass is labelled, timed, counted and synchronised here, in one place, always.

use super::RawBuffer;
use super::context::Context;
use super::descriptors::push_descriptors;
use super::error::{Checked, GpuError};
use super::hazards::{Access, Hazards};
use super::pass::{Bindings, Pass, Program};
use super::pass_hashes::PendingHashes;
use super::pipelines::{Bound, RasterState, stage_flags};
use super::profiler::Cost;
use super::staging::Way;
use super::target::{Target, attachment};
use ash::vk;
use std::cell::Cell;
use std::fmt::Display;
use std::sync::atomic::Ordering;

/// Passes timed per query pool.
pub(super) const PASSES_PER_POOL: u32 = 512;

/// How many threads a dispatch runs; workgroups are counted from the shader's own size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// A list; folded into two dimensions where it is longer than one allows (shaders use `linear_index()`).
    Linear(u32),
    /// Pixels or other grids.
    Grid(u32, u32, u32),
}

impl From<u32> for Threads {
    fn from(count: u32) -> Self {
        Self::Linear(count)
    }
}

impl From<usize> for Threads {
    fn from(count: usize) -> Self {
        // A count beyond u32 cannot be indexed by a shader; no buffer of that length can be made either.
        Self::Linear(u32::try_from(count).unwrap_or(u32::MAX))
    }
}

impl From<[u32; 2]> for Threads {
    fn from(size: [u32; 2]) -> Self {
        Self::Grid(size[0], size[1], 1)
    }
}

/// Device objects of one recording, reused from submission to submission.
pub(super) struct CommandSlot {
    pub pool: vk::CommandPool,
    pub commands: vk::CommandBuffer,
    /// Timestamp pools in use order.
    pub timestamps: Vec<vk::QueryPool>,
    /// Pipeline statistics pools, in step with `timestamps`; empty without statistics.
    pub statistics: Vec<vk::QueryPool>,
}

/// A pass that was recorded, waiting for its times.
pub(super) struct Timed {
    pub path: String,
    pub name: &'static str,
    pub cost: Cost,
    pub threads: u64,
    pub overlapped: bool,
    /// Its number among all passes; see `loss`.
    pub marker: u32,
    /// `None` for transfers, which no pipeline statistics count.
    pub is_compute: Option<bool>,
}

/// Records one command buffer and submits it. The first error is kept and returned by [`Recorder::submit`].
pub struct Recorder<'c> {
    pub(super) context: &'c Context,
    pub(super) slot: Option<CommandSlot>,
    pub(super) scopes: Vec<String>,
    pub(super) timed: Vec<Timed>,
    hazards: Hazards,
    pub(super) staging: Vec<(Way, RawBuffer)>,
    pub(super) error: Option<GpuError>,
    /// No pass was recorded since the last barrier.
    pub(super) is_behind_barrier: Cell<bool>,
    /// The device is lost here, on purpose: nothing more is recorded.
    pub(super) is_lost_here: bool,
    pub(super) hashes: PendingHashes,
}

impl<'c> Recorder<'c> {
    pub(super) fn new(context: &'c Context, name: &str) -> Result<Self, GpuError> {
        let device = &context.device;
        if context.is_lost() {
            return Err(GpuError::DeviceLost { last_pass: name.to_owned(), fault: " (before it began)".into() });
        }
        let slot = context.take_slot()?;
        device.open_recorders.fetch_add(1, Ordering::AcqRel);
        let recorder = Self {
            context,
            slot: Some(slot),
            scopes: vec![name.to_owned()],
            timed: Vec::new(),
            hazards: Hazards::default(),
            staging: Vec::new(),
            error: None,
            is_behind_barrier: Cell::new(false),
            is_lost_here: false,
            hashes: PendingHashes::default(),
        };
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's command buffer is idle and freshly reset.
        unsafe { device.raw.begin_command_buffer(recorder.commands(), &begin) }
            .checked("vkBeginCommandBuffer", name)?;
        device.set_name(recorder.commands(), name);
        device.begin_label(recorder.commands(), name);
        // What earlier submissions wrote becomes visible here.
        recorder.barrier();
        Ok(recorder)
    }

    pub(super) fn commands(&self) -> vk::CommandBuffer {
        self.slot.as_ref().map_or(vk::CommandBuffer::null(), |s| s.commands)
    }

    /// Runs `body` inside a nested label.
    pub fn scope<R>(&mut self, name: impl Display, body: impl FnOnce(&mut Self) -> R) -> R {
        let name = name.to_string();
        self.context.device.begin_label(self.commands(), &name);
        self.scopes.push(name);
        let result = body(self);
        self.scopes.pop();
        self.context.device.end_label(self.commands());
        result
    }

    /// Lets the passes in `body` run without barriers between them; `why` says what makes that right
    /// (they write disjoint parts, say) and shows in captures.
    pub fn overlap<R>(&mut self, why: &str, body: impl FnOnce(&mut Self) -> R) -> R {
        self.barrier();
        self.hazards.clear();
        let outer = self.hazards.is_overlapping();
        self.hazards.set_overlapping(true);
        let result = self.scope(format_args!("overlap: {why}"), body);
        self.hazards.set_overlapping(outer);
        result
    }

    /// Runs a compute pass over `threads`; none at all for zero threads.
    pub fn dispatch<P: Pass>(&mut self, pass: &P, threads: impl Into<Threads>) {
        self.dispatch_counted(pass, threads, None);
    }

    /// As [`Self::dispatch`], with the bytes its algorithm moves.
    pub fn dispatch_counted<P: Pass>(&mut self, pass: &P, threads: impl Into<Threads>, cost: Option<Cost>) {
        let mut bindings = Bindings::default();
        pass.bind(&mut bindings);
        self.dispatch_bound(P::PROGRAM, &bindings, threads.into(), cost);
    }

    /// As [`Self::dispatch_counted`], of bindings collected before.
    pub(super) fn dispatch_bound(
        &mut self,
        program: &'static Program,
        bindings: &Bindings<'_>,
        threads: Threads,
        cost: Option<Cost>,
    ) {
        let (groups, count) = match self.groups(program, threads) {
            Ok(Some(groups)) => groups,
            Ok(None) => return,
            Err(error) => return self.fail(error),
        };
        self.compute(program, bindings, &[], cost, count, |device, commands| {
            // SAFETY: the pipeline and all its bindings are bound; the group counts are within limits.
            unsafe { device.raw.cmd_dispatch(commands, groups[0], groups[1], groups[2]) }
        });
    }

    /// Draws `vertices` x `instances` into `target`; vertex shaders pull their data from buffers.
    pub fn draw<P: Pass>(&mut self, pass: &P, target: &Target<'_>, state: RasterState, vertices: u32, instances: u32) {
        let mut bindings = Bindings::default();
        pass.bind(&mut bindings);
        let mut attachments: Vec<Access> =
            target.color.iter().map(|(image, _)| Access { id: image.id(), reads: true, writes: true }).collect();
        attachments.extend(target.depth.iter().map(|(image, ..)| Access { id: image.id(), reads: true, writes: true }));
        let (width, height) = match target.extent() {
            // What is drawn into cannot be read by the same draw.
            Ok(_) if bindings.resources.iter().any(|bound| attachments.iter().any(|a| a.id == bound.id)) => {
                let message = format!("{}: an image that is drawn into is bound too", P::PROGRAM.name);
                return self.fail(GpuError::Refused(message));
            }
            Ok(extent) => extent,
            Err(wrong) => return self.fail(GpuError::Refused(format!("{}: {wrong}", P::PROGRAM.name))),
        };
        let color: Vec<_> = target.color.iter().map(|(image, _)| image.format).collect();
        let depth = target.depth.map(|(image, ..)| image.format);
        let bound = match self.context.pipelines.raster(P::PROGRAM, &bindings.constants, state, &color, depth) {
            Ok(bound) => bound,
            Err(error) => return self.fail(error),
        };
        let cost = Some(Cost {
            bytes_read: bytes(P::PROGRAM, &bindings, true),
            bytes_written: bytes(P::PROGRAM, &bindings, false) + target.size_bytes(),
        });
        let count = u64::from(vertices) * u64::from(instances);
        self.context.device.has_drawn.store(true, Ordering::Relaxed);
        self.record(P::PROGRAM, &bindings, &attachments, cost, count, bound, |recorder| {
            let device = &recorder.context.device;
            let commands = recorder.commands();
            let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
            let viewport = vk::Viewport {
                x: 0.0,
                y: 0.0,
                width: width as f32,
                height: height as f32,
                min_depth: 0.0,
                max_depth: 1.0,
            };
            let color: Vec<_> =
                target.color.iter().map(|(image, load)| attachment(image.layer_view(0), *load, false)).collect();
            let depth = target.depth.map(|(image, layer, load)| attachment(image.layer_view(layer), load, true));
            let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&color);
            if let Some(depth) = &depth {
                info = info.depth_attachment(depth);
            }
            // SAFETY: attachments are alive and in GENERAL; the pipeline was made for their formats.
            unsafe {
                device.cmd_begin_rendering(commands, &info);
                device.raw.cmd_set_viewport(commands, 0, &[viewport]);
                device.raw.cmd_set_scissor(commands, 0, &[area]);
                if vertices > 0 && instances > 0 {
                    device.raw.cmd_draw(commands, vertices, instances, 0, 0);
                }
                device.cmd_end_rendering(commands);
            }
        });
    }

    fn groups(&self, program: &'static Program, threads: Threads) -> Result<Option<([u32; 3], u64)>, GpuError> {
        let size = program.workgroup;
        let limit = self.context.device.limits.workgroup_count;
        let (groups, count) = match threads {
            Threads::Linear(count) => {
                let groups = count.div_ceil(size[0]);
                // Fold a long list into rows.
                let rows = groups.div_ceil(self.context.device.limits.row_of_workgroups).max(1);
                ([groups.div_ceil(rows), rows, 1], u64::from(count))
            }
            Threads::Grid(x, y, z) => (
                [x.div_ceil(size[0]), y.div_ceil(size[1]), z.div_ceil(size[2])],
                u64::from(x) * u64::from(y) * u64::from(z),
            ),
        };
        if groups.iter().any(|&g| g > limit) {
            return Err(GpuError::Refused(format!(
                "{}: {groups:?} workgroups, this device allows {limit}",
                program.name
            )));
        }
        Ok((count > 0).then_some((groups, count)))
    }

    /// Binds a compute pipeline and records `command`.
    pub(super) fn compute(
        &mut self,
        program: &'static Program,
        bindings: &Bindings<'_>,
        extra: &[Access],
        cost: Option<Cost>,
        count: u64,
        command: impl FnOnce(&super::device::Device, vk::CommandBuffer),
    ) {
        match self.context.pipelines.compute(program, &bindings.constants) {
            Ok(bound) => {
                self.record(program, bindings, extra, cost, count, bound, |recorder| {
                    command(&recorder.context.device, recorder.commands());
                });
                if self.context.options.hash_passes {
                    self.hash_outputs(program, bindings);
                }
            }
            Err(error) => self.fail(error),
        }
    }

    /// The one place: barrier, label, timestamps, statistics, bindings, push constants, and then the command itself.
    #[expect(clippy::too_many_arguments, reason = "the one place that every pass goes through")]
    fn record(
        &mut self,
        program: &'static Program,
        bindings: &Bindings<'_>,
        extra: &[Access],
        cost: Option<Cost>,
        count: u64,
        bound: Bound,
        body: impl FnOnce(&Self),
    ) {
        if self.error.is_some() {
            return;
        }
        let is_foreign = bindings.textures.is_some_and(|table| !table.is_of(&self.context.device));
        let foreign = is_foreign.then(|| "its textures are of another device".to_owned());
        let refusal = bindings.refusal.clone().or(foreign).or_else(|| bindings.misfit(program));
        if let Some(refusal) = refusal {
            return self.fail(GpuError::Refused(format!("{}: {refusal}", program.name)));
        }
        let mut accesses: Vec<Access> = program
            .bindings
            .iter()
            .zip(&bindings.resources)
            .map(|(info, resource)| Access { id: resource.id, reads: info.reads, writes: info.writes })
            .collect();
        accesses.extend_from_slice(extra);
        let cost = cost.unwrap_or_else(|| Cost {
            bytes_read: bytes(program, bindings, true),
            bytes_written: bytes(program, bindings, false),
        });
        let device = self.context.device.clone();
        let commands = self.commands();
        self.timed(program.name, &accesses, cost, count, Some(program.is_compute()), |recorder| {
            let point =
                if program.is_compute() { vk::PipelineBindPoint::COMPUTE } else { vk::PipelineBindPoint::GRAPHICS };
            // SAFETY: the layout was made for this program; resources are alive until the submission ends (their
            // owners borrow or bury them).
            unsafe {
                device.raw.cmd_bind_pipeline(commands, point, bound.pipeline);
                push_descriptors(&device, commands, point, bound.layout, program, bindings);
                if let (true, Some(table)) = (program.uses_textures, bindings.textures) {
                    device.raw.cmd_bind_descriptor_sets(commands, point, bound.layout, 1, &[table.set()], &[]);
                }
                if program.push_constant_bytes > 0 {
                    device.raw.cmd_push_constants(
                        commands,
                        bound.layout,
                        stage_flags(program),
                        0,
                        bindings.push_constants,
                    );
                }
            }
            body(recorder);
        });
    }

    /// Wraps one command in hazard check, label and queries.
    pub(super) fn timed(
        &mut self,
        name: &'static str,
        accesses: &[Access],
        cost: Cost,
        threads: u64,
        is_compute: Option<bool>,
        body: impl FnOnce(&mut Self),
    ) {
        if self.error.is_some() || self.is_lost_here {
            return;
        }
        if !accesses.iter().all(|access| self.context.device.owns(access.id)) {
            let message = format!("{name}: it is given an object of another device; make all objects by one context");
            return self.fail(GpuError::Refused(message));
        }
        let needs_barrier = self.hazards.needs_barrier(accesses);
        if (needs_barrier && !self.context.options.skip_barriers) || self.context.options.full_barriers {
            self.barrier();
            self.hazards.clear();
            let _ = self.hazards.needs_barrier(accesses);
        }
        if self.context.options.no_pass_times {
            return self.untimed(name, cost, threads, is_compute, body);
        }
        let index = self.timed.len() as u32;
        let (pool, query) = ((index / PASSES_PER_POOL) as usize, index % PASSES_PER_POOL);
        let slot = match self.slot.as_mut().map(|slot| self.context.grow_slot(slot, pool).map(|()| slot)) {
            Some(Ok(slot)) => slot,
            Some(Err(error)) => return self.fail(error),
            None => return,
        };
        let (timestamps, statistics) = (slot.timestamps[pool], slot.statistics.get(pool).copied());
        let statistics = statistics.filter(|_| is_compute.is_some());
        let commands = slot.commands;
        let device = self.context.device.clone();
        device.begin_label(commands, name);
        self.is_lost_here = self.is_lost_at(name);
        let marker = self.mark_begun();
        // SAFETY: the queries were reset on the host when the slot was taken; begin and end pair up.
        unsafe {
            device.raw.cmd_write_timestamp(commands, vk::PipelineStageFlags::TOP_OF_PIPE, timestamps, 2 * query);
            self.take_timestamp();
            if let Some(statistics) = statistics {
                device.raw.cmd_begin_query(commands, statistics, query, vk::QueryControlFlags::empty());
            }
            if !self.is_lost_here {
                body(self);
            }
            if let Some(statistics) = statistics {
                device.raw.cmd_end_query(commands, statistics, query);
            }
            device.raw.cmd_write_timestamp(commands, vk::PipelineStageFlags::BOTTOM_OF_PIPE, timestamps, 2 * query + 1);
        }
        self.mark_ended(marker);
        device.end_label(commands);
        let overlapped = !(needs_barrier || self.context.options.full_barriers || self.timed.is_empty());
        let path = format!("{}/{name}", self.scopes.join("/"));
        self.timed.push(Timed { path, name, cost, threads, overlapped, marker, is_compute });
    }

    /// Drivers that draw on the CPU keep timestamps with what they have to draw, once they drew anything: the one before a
    /// pass would be taken behind it. A barrier makes them draw first.
    fn take_timestamp(&self) {
        let device = &self.context.device;
        if device.info.kind == "CPU" && device.has_drawn.load(Ordering::Relaxed) {
            self.barrier_of_all();
        }
    }

    /// Makes all that was written before visible to all that comes after.
    pub(super) fn barrier(&self) {
        self.is_behind_barrier.set(true);
        self.barrier_of_all();
    }

    fn barrier_of_all(&self) {
        let all = vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE);
        let barriers = [all];
        // SAFETY: the command buffer is recording.
        unsafe {
            self.context
                .device
                .cmd_pipeline_barrier2(self.commands(), &vk::DependencyInfo::default().memory_barriers(&barriers));
        }
    }

    /// Keeps a staging buffer alive until the submission ends.
    pub(super) fn keep(&mut self, way: Way, staging: RawBuffer) {
        self.staging.push((way, staging));
    }

    pub(super) fn fail(&mut self, error: GpuError) {
        self.error.get_or_insert(error);
    }

    pub(super) fn context(&self) -> &'c Context {
        self.context
    }
}

impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        if let Some(slot) = self.slot.take() {
            self.context.give_slot(slot);
        }
        self.staging.clear();
        self.context.device.open_recorders.fetch_sub(1, Ordering::AcqRel);
        self.context.device.sweep();
    }
}

/// Bytes of everything a pass reads (or writes), each bound object once.
fn bytes(program: &Program, bindings: &Bindings<'_>, read: bool) -> u64 {
    let used = program
        .bindings
        .iter()
        .zip(&bindings.resources)
        .filter(|(info, _)| if read { info.reads } else { info.writes });
    used.map(|(_, resource)| resource.bytes).sum()
}
