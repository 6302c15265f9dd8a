//! Buffers that shaders read by whole texels of four words, through `usamplerBuffer` and `texelFetch`.
//!
//! Worth it for tables that neighbouring threads read at unrelated places: one fetch brings 16 bytes, where a load from
//! a storage buffer on a software driver is four times a test and a load for each thread.

use super::Buffer;
use super::device::{Device, Grave};
use super::error::{Checked, GpuError};
use ash::vk;
use std::sync::Arc;

/// A named array of texels; other passes write it as the storage buffer [`TexelBuffer::buffer`].
pub struct TexelBuffer {
    buffer: Buffer<[u32; 4]>,
    view: vk::BufferView,
    device: Arc<Device>,
}

impl TexelBuffer {
    pub(super) fn new(device: &Arc<Device>, name: &str, len: usize) -> Result<Self, GpuError> {
        let allowed = 16 * u64::from(device.limits.texel_buffer_elements);
        let bytes = (len as u64).saturating_mul(16);
        if bytes > allowed {
            return Err(GpuError::StorageRange { name: name.to_owned(), bytes, allowed });
        }
        let buffer = Buffer::new(device, name, len)?;
        let info = vk::BufferViewCreateInfo::default()
            .buffer(buffer.raw())
            .format(vk::Format::R32G32B32A32_UINT)
            .range(vk::WHOLE_SIZE);
        // SAFETY: every device offers this format for texel buffers; the buffer lives as long as the view.
        let view = unsafe { device.raw.create_buffer_view(&info, None) }.checked("vkCreateBufferView", name)?;
        device.set_name(view, name);
        Ok(Self { buffer, view, device: device.clone() })
    }

    /// The same memory as a storage buffer.
    pub fn buffer(&self) -> &Buffer<[u32; 4]> {
        &self.buffer
    }

    pub fn size_bytes(&self) -> u64 {
        self.buffer.size_bytes()
    }

    pub(super) fn view(&self) -> vk::BufferView {
        self.view
    }
}

impl Drop for TexelBuffer {
    fn drop(&mut self) {
        self.device.bury(Grave::BufferView(self.view));
    }
}
