//! Copies between host and device, always through staging memory, in pieces of bounded size.

use super::Buffer;
use super::buffer::RawBuffer;
use super::context::Context;
use super::error::GpuError;
use super::hazards::Access;
use super::image::{Format, Image};
use super::profiler::Cost;
use super::recorder::Recorder;
use super::staging::Way;
use ash::vk;
use bytemuck::Pod;

/// Staging memory per piece; larger data takes several submissions.
const STAGING_BYTES: usize = 64 << 20;

impl Context {
    /// A new buffer holding `data`.
    pub fn upload<T: Pod>(&self, name: &str, data: &[T]) -> Result<Buffer<T>, GpuError> {
        let buffer = self.buffer(name, data.len())?;
        self.write(&buffer, data)?;
        Ok(buffer)
    }

    /// Overwrites the start of `buffer` with `data`, waiting for it.
    pub fn write<T: Pod>(&self, buffer: &Buffer<T>, data: &[T]) -> Result<(), GpuError> {
        let piece = (STAGING_BYTES / size_of::<T>().max(1)).max(1);
        for (i, part) in data.chunks(piece).enumerate() {
            let mut recorder = self.recorder("upload")?;
            recorder.write(buffer, i * piece, part);
            recorder.submit()?;
        }
        Ok(())
    }

    /// Reads the whole buffer back.
    pub fn download<T: Pod>(&self, buffer: &Buffer<T>) -> Result<Vec<T>, GpuError> {
        self.download_range(buffer, 0..buffer.len())
    }

    /// Reads the elements of `range` back (clamped to the buffer).
    pub fn download_range<T: Pod>(
        &self,
        buffer: &Buffer<T>,
        range: std::ops::Range<usize>,
    ) -> Result<Vec<T>, GpuError> {
        let end = range.end.min(buffer.len());
        let mut data = Vec::with_capacity(end.saturating_sub(range.start));
        let piece = (STAGING_BYTES / size_of::<T>().max(1)).max(1);
        for first in (range.start..end).step_by(piece) {
            let count = piece.min(end - first);
            let size = size_of::<T>() as u64;
            let mut recorder = self.recorder("download")?;
            let staging = self.staging(Way::Down, count as u64 * size)?;
            recorder.copy_raw(
                "transfer/download",
                (buffer.raw(), buffer.id()),
                (staging.raw, staging.id),
                first as u64 * size,
                0,
                count as u64 * size,
            );
            recorder.keep(Way::Down, staging);
            let mut kept = recorder.finish()?;
            if let Some((_, staging)) = kept.last_mut() {
                let bytes = &staging.mapped()[..count * size_of::<T>()];
                data.extend(bytemuck::pod_collect_to_vec::<u8, T>(bytes));
            }
            recorder.give_back(kept);
        }
        Ok(data)
    }

    /// Reads mip level 0 of one layer back, rows top to bottom; `T` is one pixel.
    pub fn download_image<T: Pod>(&self, image: &Image, layer: u32) -> Result<Vec<T>, GpuError> {
        let pixel = image.format.bytes_per_pixel();
        if layer >= image.layers || size_of::<T>() as u64 != pixel {
            let (name, layers, given) = (image.name(), image.layers, size_of::<T>());
            return Err(GpuError::Refused(format!(
                "image `{name}`: layer {layer} of {layers} read as pixels of {given} bytes, they have {pixel}"
            )));
        }
        let bytes = u64::from(image.width) * u64::from(image.height) * pixel;
        let mut recorder = self.recorder("download")?;
        let staging = self.staging(Way::Down, bytes)?;
        let accesses = [
            Access { id: image.id(), reads: true, writes: false },
            Access { id: staging.id, reads: false, writes: true },
        ];
        let cost = Cost { bytes_read: bytes, bytes_written: bytes };
        let (device, region) = (self.device.clone(), image_region(image, layer));
        recorder.timed("transfer/download", &accesses, cost, 0, None, |recorder| {
            // SAFETY: the image is alive and in GENERAL; the staging buffer holds a whole layer.
            unsafe {
                device.raw.cmd_copy_image_to_buffer(
                    recorder.commands(),
                    image.raw(),
                    vk::ImageLayout::GENERAL,
                    staging.raw,
                    &[region],
                );
            }
        });
        recorder.keep(Way::Down, staging);
        let mut kept = recorder.finish()?;
        let pixels =
            kept.last_mut().map(|(_, staging)| bytemuck::pod_collect_to_vec(&staging.mapped()[..bytes as usize]));
        recorder.give_back(kept);
        Ok(pixels.unwrap_or_default())
    }
}

impl Recorder<'_> {
    /// Overwrites `buffer[first..first + data.len()]`; for data of at most some megabytes per frame.
    pub fn write<T: Pod>(&mut self, buffer: &Buffer<T>, first: usize, data: &[T]) {
        if data.is_empty() {
            return;
        }
        if first.checked_add(data.len()).is_none_or(|end| end > buffer.len()) {
            let message =
                format!("`{}`: write of {} elements at {first} into {}", buffer.name(), data.len(), buffer.len());
            return self.fail(GpuError::Refused(message));
        }
        let bytes: &[u8] = bytemuck::cast_slice(data);
        match self.stage(bytes) {
            Ok(staging) => {
                let offset = first as u64 * size_of::<T>() as u64;
                self.copy_raw(
                    "transfer/upload",
                    (staging.raw, staging.id),
                    (buffer.raw(), buffer.id()),
                    0,
                    offset,
                    bytes.len() as u64,
                );
                self.keep(Way::Up, staging);
            }
            Err(error) => self.fail(error),
        }
    }

    /// Sets every 32-bit word of `buffer` to `word`.
    pub fn fill<T>(&mut self, buffer: &Buffer<T>, word: u32) {
        let bytes = buffer.size_bytes() & !3;
        if bytes == 0 {
            return;
        }
        let device = self.context().device.clone();
        let (raw, access) = (buffer.raw(), Access { id: buffer.id(), reads: false, writes: true });
        self.timed("transfer/fill", &[access], Cost { bytes_read: 0, bytes_written: bytes }, 0, None, |recorder| {
            // SAFETY: fills whole words inside the buffer.
            unsafe { device.raw.cmd_fill_buffer(recorder.commands(), raw, 0, bytes, word) };
        });
    }

    /// Copies all of `source` to the start of `target`, which is at least as long.
    pub fn copy<T>(&mut self, source: &Buffer<T>, target: &Buffer<T>) {
        if source.is_empty() {
            return;
        }
        if source.len() > target.len() || source.id() == target.id() {
            let message =
                format!("copy of `{}` ({}) into `{}` ({})", source.name(), source.len(), target.name(), target.len());
            return self.fail(GpuError::Refused(message));
        }
        self.copy_raw(
            "transfer/copy",
            (source.raw(), source.id()),
            (target.raw(), target.id()),
            0,
            0,
            source.size_bytes(),
        );
    }

    /// Fills mip level 0 of one layer, rows top to bottom; `T` is one pixel.
    pub fn write_image<T: Pod>(&mut self, image: &Image, layer: u32, pixels: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(pixels);
        let expected = u64::from(image.width) * u64::from(image.height) * image.format.bytes_per_pixel();
        if bytes.len() as u64 != expected || layer >= image.layers {
            let message =
                format!("image `{}` layer {layer}: {} bytes given, {expected} wanted", image.name(), bytes.len());
            return self.fail(GpuError::Refused(message));
        }
        let staging = match self.stage(bytes) {
            Ok(staging) => staging,
            Err(error) => return self.fail(error),
        };
        let accesses = [
            Access { id: staging.id, reads: true, writes: false },
            Access { id: image.id(), reads: false, writes: true },
        ];
        let cost = Cost { bytes_read: expected, bytes_written: expected };
        let (device, region) = (self.context().device.clone(), image_region(image, layer));
        self.timed("transfer/upload", &accesses, cost, 0, None, |recorder| {
            // SAFETY: the image is alive and in GENERAL; the staging buffer holds a whole layer.
            unsafe {
                device.raw.cmd_copy_buffer_to_image(
                    recorder.commands(),
                    staging.raw,
                    image.raw(),
                    vk::ImageLayout::GENERAL,
                    &[region],
                );
            }
        });
        self.keep(Way::Up, staging);
    }

    /// Sets every pixel of a colour image.
    pub fn clear_image(&mut self, image: &Image, color: [f32; 4]) {
        if image.format.is_depth() {
            return self
                .fail(GpuError::Refused(format!("image `{}` is a depth image and has no colour", image.name())));
        }
        let access = [Access { id: image.id(), reads: false, writes: true }];
        let cost = Cost { bytes_read: 0, bytes_written: image.size_bytes() };
        let device = self.context().device.clone();
        self.timed("transfer/clear", &access, cost, 0, None, |recorder| {
            let value = vk::ClearColorValue { float32: color };
            // SAFETY: the image is alive and in GENERAL.
            unsafe {
                device.raw.cmd_clear_color_image(
                    recorder.commands(),
                    image.raw(),
                    vk::ImageLayout::GENERAL,
                    &value,
                    &[image.whole_range()],
                );
            }
        });
    }

    /// Fills mip levels 1.. by halving, averaged in linear light (sRGB images are decoded by the blit).
    pub fn generate_mips(&mut self, image: &Image) {
        if image.mip_levels > 1 && (image.format.is_depth() || image.format == Format::R32Uint) {
            let message = format!("image `{}` is {:?}, which cannot be averaged", image.name(), image.format);
            return self.fail(GpuError::Refused(message));
        }
        let device = self.context().device.clone();
        for level in 1..image.mip_levels {
            let access = [Access { id: image.id(), reads: true, writes: true }];
            let extent = |level: u32| vk::Offset3D {
                x: (image.width >> level).max(1) as i32,
                y: (image.height >> level).max(1) as i32,
                z: 1,
            };
            let layers = |mip_level| vk::ImageSubresourceLayers {
                aspect_mask: image.format.aspect(),
                mip_level,
                base_array_layer: 0,
                layer_count: image.layers,
            };
            let blit = vk::ImageBlit {
                src_subresource: layers(level - 1),
                src_offsets: [vk::Offset3D::default(), extent(level - 1)],
                dst_subresource: layers(level),
                dst_offsets: [vk::Offset3D::default(), extent(level)],
            };
            let bytes = image.size_bytes() >> (2 * level);
            let cost = Cost { bytes_read: 4 * bytes, bytes_written: bytes };
            self.timed("transfer/mip", &access, cost, 0, None, |recorder| {
                // SAFETY: both levels exist and are in GENERAL.
                unsafe {
                    device.raw.cmd_blit_image(
                        recorder.commands(),
                        image.raw(),
                        vk::ImageLayout::GENERAL,
                        image.raw(),
                        vk::ImageLayout::GENERAL,
                        &[blit],
                        vk::Filter::LINEAR,
                    );
                }
            });
        }
    }

    /// Moves a new image from UNDEFINED to GENERAL, where it stays.
    pub(super) fn initialize_image(&mut self, image: &Image) {
        let device = self.context().device.clone();
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(vk::ImageLayout::UNDEFINED)
            .new_layout(vk::ImageLayout::GENERAL)
            .image(image.raw())
            .subresource_range(image.whole_range())];
        // SAFETY: the image is alive and not yet used.
        unsafe {
            device.cmd_pipeline_barrier2(
                self.commands(),
                &vk::DependencyInfo::default().image_memory_barriers(&barriers),
            );
        }
    }

    fn stage(&mut self, bytes: &[u8]) -> Result<RawBuffer, GpuError> {
        let mut staging = self.context().staging(Way::Up, bytes.len() as u64)?;
        staging.mapped()[..bytes.len()].copy_from_slice(bytes);
        Ok(staging)
    }

    fn copy_raw(
        &mut self,
        name: &'static str,
        (source, source_id): (vk::Buffer, u64),
        (target, target_id): (vk::Buffer, u64),
        src_offset: u64,
        dst_offset: u64,
        size: u64,
    ) {
        let accesses = [
            Access { id: source_id, reads: true, writes: false },
            Access { id: target_id, reads: false, writes: true },
        ];
        let device = self.context().device.clone();
        self.timed(name, &accesses, Cost { bytes_read: size, bytes_written: size }, 0, None, |recorder| {
            // SAFETY: both ranges were checked by the callers.
            unsafe {
                let region = vk::BufferCopy { src_offset, dst_offset, size };
                device.raw.cmd_copy_buffer(recorder.commands(), source, target, &[region]);
            }
        });
    }
}

fn image_region(image: &Image, layer: u32) -> vk::BufferImageCopy {
    vk::BufferImageCopy::default()
        .image_subresource(vk::ImageSubresourceLayers {
            aspect_mask: image.format.aspect(),
            mip_level: 0,
            base_array_layer: layer,
            layer_count: 1,
        })
        .image_extent(vk::Extent3D { width: image.width, height: image.height, depth: 1 })
}
