//! The end of a recording: submission, waiting, and one record per pass read from the queries.

use super::buffer::RawBuffer;
use super::device::lock;
use super::error::{Checked, GpuError};
use super::profiler::{Cost, PassRecord};
use super::recorder::{PASSES_PER_POOL, Recorder, Timed};
use super::staging::Way;
use ash::vk;
use std::sync::atomic::Ordering;

/// Counter names in the order of the flag bits in [`super::context::STATISTIC_FLAGS`], and whether compute fills them.
const STATISTICS: [(&str, bool); 3] =
    [("clipping_primitives", false), ("fragment_invocations", false), ("compute_invocations", true)];

impl Recorder<'_> {
    /// Submits, waits until the device is done, and hands the pass records to the context.
    pub fn submit(mut self) -> Result<(), GpuError> {
        let kept = self.finish()?;
        self.give_back(kept);
        Ok(())
    }

    /// As [`Self::submit`], after `wait` and before `signal`: binary semaphores of the window system.
    pub(super) fn submit_between(mut self, wait: vk::Semaphore, signal: vk::Semaphore) -> Result<(), GpuError> {
        let kept = self.finish_between(Some((wait, signal)))?;
        self.give_back(kept);
        Ok(())
    }

    /// As [`Self::submit`], handing back the staging buffers (read-backs) in the order they were kept.
    pub(super) fn finish(&mut self) -> Result<Vec<(Way, RawBuffer)>, GpuError> {
        self.finish_between(None)
    }

    /// Staging buffers that were read, for the next submission.
    pub(super) fn give_back(&self, kept: Vec<(Way, RawBuffer)>) {
        kept.into_iter().for_each(|(way, buffer)| self.context.give_staging(way, buffer));
    }

    fn finish_between(
        &mut self,
        between: Option<(vk::Semaphore, vk::Semaphore)>,
    ) -> Result<Vec<(Way, RawBuffer)>, GpuError> {
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        let device = self.context.device.clone();
        let commands = self.commands();
        // Host reads of staging memory need an explicit dependency.
        let to_host = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        self.mark_all_ended();
        let last_pass = self.timed.last().map_or_else(|| self.scopes.join("/"), |t| t.path.clone());
        // SAFETY: the command buffer is complete; queue access is exclusive by the lock.
        unsafe {
            device.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().memory_barriers(&to_host));
            device.end_label(commands);
            device.raw.end_command_buffer(commands).checked("vkEndCommandBuffer", &last_pass)?;
            let value = {
                let _queue = lock(&device.queue_lock);
                let value = device.submitted.load(Ordering::Acquire) + 1;
                // Values of binary semaphores are ignored.
                let (wait_values, values) = ([0], [value, 0]);
                let (wait, signal) = between.unwrap_or_default();
                let (waited, count) = if between.is_some() { (1, 2) } else { (0, 1) };
                let mut timeline = vk::TimelineSemaphoreSubmitInfo::default()
                    .wait_semaphore_values(&wait_values[..waited])
                    .signal_semaphore_values(&values[..count]);
                let (buffers, waits, signals) = ([commands], [wait], [device.timeline, signal]);
                let submit = vk::SubmitInfo::default()
                    .wait_semaphores(&waits[..waited])
                    .wait_dst_stage_mask(&[vk::PipelineStageFlags::ALL_COMMANDS][..waited])
                    .command_buffers(&buffers)
                    .signal_semaphores(&signals[..count])
                    .push_next(&mut timeline);
                device
                    .raw
                    .queue_submit(device.queue, &[submit], vk::Fence::null())
                    .checked("vkQueueSubmit", &last_pass)
                    .map_err(|error| self.found_lost(error))?;
                device.submitted.store(value, Ordering::Release);
                value
            };
            self.context.wait(value, &last_pass).map_err(|error| self.found_lost(error))?;
            self.provoked().map_err(|error| self.found_lost(error))?;
        }
        self.collect(&last_pass)?;
        self.collect_hashes()?;
        Ok(std::mem::take(&mut self.staging))
    }

    /// A command without label, queries and markers.
    pub(super) fn untimed(
        &mut self,
        name: &'static str,
        cost: Cost,
        threads: u64,
        is_compute: Option<bool>,
        body: impl FnOnce(&mut Self),
    ) {
        body(self);
        // What errors name.
        self.timed.push(Timed { path: name.to_owned(), name, cost, threads, overlapped: false, marker: 0, is_compute });
    }

    /// Reads the queries and appends one record per pass.
    fn collect(&mut self, last_pass: &str) -> Result<(), GpuError> {
        if self.context.options.no_pass_times {
            return Ok(());
        }
        let device = &self.context.device;
        let Some(slot) = &self.slot else { return Ok(()) };
        let period = device.limits.timestamp_period_ns;
        let mut records = Vec::with_capacity(self.timed.len());
        for (pool, chunk) in self.timed.chunks(PASSES_PER_POOL as usize).enumerate() {
            let mut ticks = vec![0u64; 2 * chunk.len()];
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
            // SAFETY: the submission is complete and wrote each of these queries.
            unsafe { device.raw.get_query_pool_results(slot.timestamps[pool], 0, &mut ticks, flags) }
                .checked("vkGetQueryPoolResults", last_pass)?;
            for (i, timed) in chunk.iter().enumerate() {
                let mut counters = vec![("threads", timed.threads)];
                if let (Some(&statistics), Some(is_compute)) = (slot.statistics.get(pool), timed.is_compute) {
                    let mut counts = [[0u64; STATISTICS.len()]];
                    // SAFETY: as above; one result of three values.
                    unsafe { device.raw.get_query_pool_results(statistics, i as u32, &mut counts, flags) }
                        .checked("vkGetQueryPoolResults", last_pass)?;
                    let named = STATISTICS.iter().zip(counts[0]);
                    counters.extend(
                        named
                            .filter(|((_, compute), _)| *compute == is_compute)
                            .map(|((name, _), count)| (*name, count)),
                    );
                }
                let to_ns = |ticks: u64| (ticks as f64 * period) as u64;
                records.push(PassRecord {
                    path: timed.path.clone(),
                    name: timed.name,
                    start_ns: to_ns(ticks[2 * i]),
                    end_ns: to_ns(ticks[2 * i + 1]),
                    bytes_read: timed.cost.bytes_read,
                    bytes_written: timed.cost.bytes_written,
                    counters,
                    overlapped: timed.overlapped,
                });
            }
        }
        self.context.append_records(records);
        Ok(())
    }
}
