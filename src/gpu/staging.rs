//! Staging memory, kept between submissions: a frame that moves what the frame before moved allocates nothing.

use super::buffer::RawBuffer;
use super::context::Context;
use super::device::lock;
use super::error::GpuError;
use ash::vk;
use gpu_allocator::MemoryLocation;

/// Largest buffer that is kept, and most that all of one kind together may hold, bytes.
const LARGEST_BYTES: u64 = 4 << 20;
const MOST_BYTES: u64 = 32 << 20;
/// Least buffer.
const LEAST_BYTES: u64 = 4096;

/// Which way a staging buffer moves data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    Up,
    Down,
}

/// Buffers that no submission uses.
#[derive(Default)]
pub(super) struct StagingPool {
    free: Vec<(Way, u64, RawBuffer)>,
}

impl Context {
    /// A mapped buffer of at least so many bytes.
    pub(super) fn staging(&self, way: Way, bytes: u64) -> Result<RawBuffer, GpuError> {
        let size = if bytes <= LARGEST_BYTES { bytes.max(LEAST_BYTES).next_power_of_two() } else { bytes };
        let mut pool = lock(&self.staging_pool);
        if let Some(at) = pool.free.iter().position(|(free_way, free_bytes, _)| (*free_way, *free_bytes) == (way, size))
        {
            return Ok(pool.free.swap_remove(at).2);
        }
        drop(pool);
        let (name, usage, location) = match way {
            Way::Up => ("staging/upload", vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu),
            Way::Down => ("staging/download", vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu),
        };
        RawBuffer::new(&self.device, name, size, usage, location)
    }

    /// Takes back what [`Self::staging`] gave, once the device is done with it.
    pub(super) fn give_staging(&self, way: Way, buffer: RawBuffer) {
        let bytes = buffer.bytes;
        let mut pool = lock(&self.staging_pool);
        let held: u64 = pool.free.iter().filter(|(other, ..)| *other == way).map(|(_, bytes, _)| bytes).sum();
        if bytes <= LARGEST_BYTES && held + bytes <= MOST_BYTES {
            pool.free.push((way, bytes, buffer));
        }
    }
}
