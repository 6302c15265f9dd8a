//! When the device is lost: which pass it had come to, what the driver tells of it, and a switch that provokes it.
//!
//! Markers are two words in memory that the host sees, written by the device itself on its way: the number of the pass
//! begun last, and of the pass ended last. Where the device has VK_AMD_buffer_marker both are written around every
//! pass. Elsewhere vkCmdFillBuffer writes the first behind every barrier, before the first of the passes that may run
//! side by side from there: all before it have ended, and one of those is where the device stands.
//!
//! A loss is told once, to [`Options::on_loss`](super::Options), while the process can still write a file. A submission
//! that did not end in time counts as a loss too, and what it may still be using is never given back: waiting for it
//! could take forever.

use super::buffer::RawBuffer;
use super::context::Context;
use super::device::Device;
use super::error::GpuError;
use super::recorder::{Recorder, Timed};
use super::selection::DeviceInfo;
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Places of the two markers, bytes.
const BEGUN: u64 = 0;
const ENDED: u64 = 4;

/// Hears of a loss, before the error is returned.
#[derive(Clone)]
pub struct LossHook(pub Arc<dyn Fn(&Loss) + Send + Sync>);

impl std::fmt::Debug for LossHook {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("LossHook")
    }
}

/// What is known of a loss.
#[derive(Debug, Clone)]
pub struct Loss {
    /// The error in words.
    pub error: String,
    pub device: DeviceInfo,
    /// It was asked for by [`LossPoint`].
    pub is_provoked: bool,
    pub queue: QueueMarkers,
    pub fault: Option<Fault>,
}

/// How far the queue had come; passes by their paths.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct QueueMarkers {
    /// What writes the markers.
    pub written_by: &'static str,
    /// Passes of the submission.
    pub passes: usize,
    /// `None`: none of the submission.
    pub begun: Option<String>,
    pub ended: Option<String>,
    /// Those that may have been running.
    pub running: Vec<String>,
}

/// What VK_EXT_device_fault tells.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fault {
    pub description: String,
    /// Kind and address.
    pub addresses: Vec<(String, u64)>,
    /// The vendor's words, code and data.
    pub vendor: Vec<(String, u64, u64)>,
}

/// Where to lose the device on purpose: `gather/links`, or `gather/links@3` for its third run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LossPoint {
    /// A pass as profiles name it.
    pub pass: String,
    /// Counted from 1.
    pub run: u32,
}

impl FromStr for LossPoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (pass, run) = match text.split_once('@') {
            Some((pass, run)) => (pass, run.parse().ok().filter(|&run| run > 0)),
            None => (text, Some(1)),
        };
        match run {
            Some(run) if pass.contains('/') => Ok(Self { pass: pass.to_owned(), run }),
            _ => {
                Err("expected a pass as --profile names it, such as gather/links, or gather/links@3 for its third run"
                    .into())
            }
        }
    }
}

/// The words that the device writes, and the counters behind them.
pub(super) struct Markers {
    buffer: RawBuffer,
    next: AtomicU32,
    /// Runs so far of the pass at which the device is to be lost.
    runs: AtomicU32,
}

impl Markers {
    pub fn new(device: &Arc<Device>) -> Result<Self, GpuError> {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let mut buffer = RawBuffer::new(device, "markers/passes", 16, usage, MemoryLocation::GpuToCpu)?;
        buffer.mapped().fill(0);
        Ok(Self { buffer, next: AtomicU32::new(1), runs: AtomicU32::new(0) })
    }

    /// Begun and ended.
    fn read(&self) -> [u32; 2] {
        let bytes = self.buffer.mapped_now();
        let word = |at: u64| bytes.get(at as usize..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; 4]);
        [BEGUN, ENDED].map(|at| u32::from_le_bytes(word(at)))
    }
}

impl Recorder<'_> {
    /// Before a pass: its number, which the device writes when it comes here.
    pub(super) fn mark_begun(&mut self) -> u32 {
        if self.is_lost_here {
            self.barrier();
        }
        let (markers, device) = (&self.context.markers, &self.context.device);
        let number = markers.next.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the word lies inside the buffer, which lives as long as the context. Writes of one word without the
        // extension are apart by a barrier each.
        unsafe {
            if let Some(extension) = &device.buffer_marker {
                let stage = vk::PipelineStageFlags::TOP_OF_PIPE;
                extension.cmd_write_buffer_marker(self.commands(), stage, markers.buffer.raw, BEGUN, number);
            } else if self.is_behind_barrier.replace(false) {
                device.raw.cmd_fill_buffer(self.commands(), markers.buffer.raw, BEGUN, 4, number);
            }
        }
        number
    }

    /// After a pass.
    pub(super) fn mark_ended(&self, number: u32) {
        let Some(extension) = &self.context.device.buffer_marker else { return };
        let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        // SAFETY: as above.
        unsafe {
            extension.cmd_write_buffer_marker(self.commands(), stage, self.context.markers.buffer.raw, ENDED, number);
        }
    }

    /// After the last pass of a submission.
    pub(super) fn mark_all_ended(&mut self) {
        let device = &self.context.device;
        let Some(last) = self.timed.last().filter(|last| last.marker > 0) else { return };
        if device.buffer_marker.is_some() || self.is_lost_here {
            return;
        }
        self.barrier();
        device.begin_label(self.commands(), "markers/ended");
        // SAFETY: the word lies inside the buffer, which lives as long as the context.
        unsafe {
            device.raw.cmd_fill_buffer(self.commands(), self.context.markers.buffer.raw, ENDED, 4, last.marker);
        }
        device.end_label(self.commands());
    }

    /// Whether the device is to be lost at this run of pass `name`.
    pub(super) fn is_lost_at(&self, name: &str) -> bool {
        let Some(point) = &self.context.options.lose_device_at else { return false };
        point.pass == name && self.context.markers.runs.fetch_add(1, Ordering::AcqRel) + 1 == point.run
    }

    /// What a device lost on purpose answers, once the submission up to there has run.
    pub(super) fn provoked(&self) -> Result<(), GpuError> {
        let lost = GpuError::DeviceLost { last_pass: String::new(), fault: " (as --lose-device-at asked)".into() };
        if self.is_lost_here { Err(lost) } else { Ok(()) }
    }

    /// `error`, with the pass that the device had come to; a loss is told.
    pub(super) fn found_lost(&self, error: GpuError) -> GpuError {
        self.context.found_lost(error, &self.timed, self.is_lost_here)
    }
}

impl Context {
    /// `error`, with what the markers (of a submission of `passes`) and the driver tell; a loss is told once.
    pub(super) fn found_lost(&self, error: GpuError, passes: &[Timed], is_provoked: bool) -> GpuError {
        let is_hung = matches!(error, GpuError::Timeout { .. });
        if !is_hung && !matches!(error, GpuError::DeviceLost { .. }) {
            return error;
        }
        self.device.is_hung.fetch_or(is_hung, Ordering::AcqRel);
        let is_first = !self.device.is_lost.swap(true, Ordering::AcqRel);
        let queue = self.queue_markers(passes);
        let fault = if is_hung || is_provoked { None } else { self.fault() };
        let stands_in = |name: String| queue.begun.clone().unwrap_or(name);
        let error = match error {
            GpuError::DeviceLost { last_pass, fault: words } => GpuError::DeviceLost {
                last_pass: stands_in(last_pass),
                fault: fault.as_ref().map_or(words, |fault| format!(" ({})", fault.description)),
            },
            GpuError::Timeout { last_pass, seconds } => GpuError::Timeout { last_pass: stands_in(last_pass), seconds },
            other => other,
        };
        if let (true, Some(hook)) = (is_first, &self.options.on_loss) {
            let device = self.device.info.clone();
            (hook.0)(&Loss { error: error.to_string(), device, is_provoked, queue, fault });
        }
        error
    }

    fn queue_markers(&self, passes: &[Timed]) -> QueueMarkers {
        let is_precise = self.device.buffer_marker.is_some();
        let [begun, ended] = self.markers.read();
        let find = |number: u32| passes.iter().position(|timed| timed.marker == number);
        let path = |index: usize| passes[index].path.clone();
        let written_by = if is_precise { "VK_AMD_buffer_marker" } else { "vkCmdFillBuffer" };
        let (first, last) = match find(begun) {
            None => (0, 0),
            // Up to the next barrier.
            Some(first) if !is_precise => {
                let beside = passes[first + 1..].iter().take_while(|timed| timed.overlapped).count();
                (first, first + 1 + beside)
            }
            Some(begun) => (find(ended).map_or(0, |ended| ended + 1), begun + 1),
        };
        QueueMarkers {
            written_by,
            passes: passes.len(),
            begun: find(begun).map(path),
            ended: first.checked_sub(1).map(path),
            running: (first..last.max(first)).map(path).collect(),
        }
    }

    /// What the driver tells of a device loss, where it does.
    fn fault(&self) -> Option<Fault> {
        let extension = self.device.device_fault.as_ref()?;
        let (handle, tell) = (self.device.raw.handle(), extension.fp().get_device_fault_info_ext);
        let mut counts = vk::DeviceFaultCountsEXT::default();
        // SAFETY: without a target only the counts are written.
        unsafe { tell(handle, &mut counts, std::ptr::null_mut()) }.result().ok()?;
        let mut addresses = vec![vk::DeviceFaultAddressInfoEXT::default(); counts.address_info_count as usize];
        let mut vendor = vec![vk::DeviceFaultVendorInfoEXT::default(); counts.vendor_info_count as usize];
        counts.vendor_binary_size = 0;
        let mut info = vk::DeviceFaultInfoEXT {
            p_address_infos: addresses.as_mut_ptr(),
            p_vendor_infos: vendor.as_mut_ptr(),
            ..Default::default()
        };
        // SAFETY: both lists have the lengths that the counts say.
        let told = unsafe { tell(handle, &mut counts, &mut info) };
        if !matches!(told, vk::Result::SUCCESS | vk::Result::INCOMPLETE) {
            return None;
        }
        let words = |text: Result<&std::ffi::CStr, _>| {
            text.map(|text: &std::ffi::CStr| text.to_string_lossy().into_owned()).unwrap_or_default()
        };
        addresses.truncate(counts.address_info_count as usize);
        vendor.truncate(counts.vendor_info_count as usize);
        Some(Fault {
            description: words(info.description_as_c_str()),
            addresses: addresses.iter().map(|at| (format!("{:?}", at.address_type), at.reported_address)).collect(),
            vendor: vendor
                .iter()
                .map(|at| (words(at.description_as_c_str()), at.vendor_fault_code, at.vendor_fault_data))
                .collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_loss_read_as_they_are_written() {
        let point = |text: &str| text.parse::<LossPoint>().map(|point| (point.pass, point.run));
        assert_eq!(point("gather/links"), Ok(("gather/links".into(), 1)));
        assert_eq!(point("gather/links@12"), Ok(("gather/links".into(), 12)));
        assert!(["", "links", "gather/links@0", "gather/links@x", "@3"].iter().all(|text| point(text).is_err()));
    }
}
