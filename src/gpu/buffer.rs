//! Typed device buffers. All data goes to and comes from them through staging, on every kind of memory alike.

use super::device::{Device, Grave};
use super::error::{Checked, GpuError};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use std::marker::PhantomData;
use std::sync::Arc;

/// A named array of `len` values of `T` in device memory.
pub struct Buffer<T> {
    inner: RawBuffer,
    len: usize,
    element: PhantomData<fn() -> T>,
}

impl<T> Buffer<T> {
    pub(super) fn new(device: &Arc<Device>, name: &str, len: usize) -> Result<Self, GpuError> {
        let bytes = (len as u64).saturating_mul(size_of::<T>() as u64);
        let allowed = device.limits.storage_buffer_bytes;
        if bytes > allowed {
            return Err(GpuError::StorageRange { name: name.to_owned(), bytes, allowed });
        }
        let mut usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        if device.optional.ray_query {
            usage |= vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
                | vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        }
        let inner = RawBuffer::new(device, name, bytes, usage, MemoryLocation::GpuOnly)?;
        Ok(Self { inner, len, element: PhantomData })
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.len
    }

    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub fn size_bytes(&self) -> u64 {
        self.len as u64 * size_of::<T>() as u64
    }

    pub fn name(&self) -> &str {
        &self.inner.name
    }

    pub(super) fn raw(&self) -> vk::Buffer {
        self.inner.raw
    }

    pub(super) fn id(&self) -> u64 {
        self.inner.id
    }
}

/// Staging memory takes whole pages: GFXReconstruct follows the host's accesses by page and writes pages back whole,
/// so that what the device wrote beside would be lost.
const PAGE_BYTES: u64 = 4096;

/// An untyped buffer with its memory.
pub(super) struct RawBuffer {
    pub raw: vk::Buffer,
    pub id: u64,
    pub name: String,
    /// As asked for.
    pub bytes: u64,
    pub allocation: Option<Allocation>,
    device: Arc<Device>,
}

impl RawBuffer {
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self, GpuError> {
        // Vulkan has no empty buffers; an empty table still needs something to bind.
        let info = vk::BufferCreateInfo::default().size(bytes.max(16)).usage(usage);
        // SAFETY: `info` is complete; the memory bound was made for this buffer.
        unsafe {
            let raw = device.raw.create_buffer(&info, None).checked("vkCreateBuffer", name)?;
            let mut requirements = device.raw.get_buffer_memory_requirements(raw);
            if location != MemoryLocation::GpuOnly {
                requirements.alignment = requirements.alignment.max(PAGE_BYTES);
                requirements.size = requirements.size.next_multiple_of(PAGE_BYTES);
            }
            let allocation = match device.allocate(name, requirements, location, true) {
                Ok(allocation) => allocation,
                Err(error) => {
                    device.raw.destroy_buffer(raw, None);
                    return Err(error);
                }
            };
            let bound = device.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset());
            device.set_name(raw, name);
            let id = device.new_id();
            let buffer =
                Self { raw, id, name: name.to_owned(), bytes, allocation: Some(allocation), device: device.clone() };
            bound.checked("vkBindBufferMemory", name)?;
            Ok(buffer)
        }
    }

    /// The mapped bytes as they are now.
    pub fn mapped_now(&self) -> &[u8] {
        self.allocation.as_ref().and_then(Allocation::mapped_slice).unwrap_or(&[])
    }

    /// The mapped bytes of a staging buffer.
    pub fn mapped(&mut self) -> &mut [u8] {
        self.allocation.as_mut().and_then(Allocation::mapped_slice_mut).unwrap_or(&mut [])
    }
}

impl Drop for RawBuffer {
    fn drop(&mut self) {
        if let Some(allocation) = self.allocation.take() {
            self.device.forget_memory(&self.name, allocation.size());
            self.device.bury(Grave::Buffer(self.raw, allocation));
        }
    }
}
