//! Presentation: an image of ours shown in a window of the system's.
//!
//! The frame is drawn into an ordinary image; [`Presenter::present`] acquires a swapchain image, copies the frame into
//! it and hands it over. A window that was resized gets a new swapchain, one without area none, and a surface that the
//! system took away is made anew: none of it is an error. What it does not do: draw into swapchain images.

use super::context::Context;
use super::device::{Device, lock};
use super::error::{Checked, GpuError};
use super::hazards::Access;
use super::image::Image;
use super::profiler::Cost;
use super::recorder::Recorder;
use ash::{khr, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A window of any window system.
pub trait WindowSource: HasDisplayHandle + HasWindowHandle {}
impl<T: HasDisplayHandle + HasWindowHandle> WindowSource for T {}

/// How long to wait for the window system to give an image back, before the frame is left out.
const PATIENCE_NS: u64 = 100_000_000;

/// Shows images in one window.
pub struct Presenter {
    loader: khr::swapchain::Device,
    surface: vk::SurfaceKHR,
    swapchain: Option<Swapchain>,
    /// Signalled when an acquired image may be written.
    acquired: vk::Semaphore,
    wants_new_swapchain: bool,
    swapchain_count: u64,
    device: Arc<Device>,
    // Outlives the surface.
    window: Arc<dyn WindowSource>,
}

struct Swapchain {
    raw: vk::SwapchainKHR,
    extent: vk::Extent2D,
    images: Vec<vk::Image>,
    /// One per image: signalled when it may be shown.
    finished: Vec<vk::Semaphore>,
}

impl Presenter {
    /// The context must have been made to present ([`super::Options::presents`]).
    pub fn new(context: &Context, window: Arc<dyn WindowSource>) -> Result<Self, GpuError> {
        let device = context.device.clone();
        if device.instance.surface.is_none() || !device.optional.swapchain {
            return Err(GpuError::Refused(format!(
                "{} cannot show images in a window (VK_KHR_swapchain); use another --gpu, or `linklight render`",
                device.info.name
            )));
        }
        let loader = khr::swapchain::Device::new(&device.instance.raw, &device.raw);
        // SAFETY: complete create info.
        let acquired = unsafe { device.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
            .checked("vkCreateSemaphore", "window")?;
        device.set_name(acquired, "window/acquired");
        let mut presenter = Self {
            loader,
            surface: vk::SurfaceKHR::null(),
            swapchain: None,
            acquired,
            wants_new_swapchain: true,
            swapchain_count: 0,
            device,
            window,
        };
        presenter.make_surface()?;
        Ok(presenter)
    }

    /// Submits `recorder` and shows `frame`, which its passes draw, in the window: pixel by pixel where their sizes
    /// agree, else stretched. False where the window shows nothing now (minimised, or busy): the passes have run.
    pub fn present(&mut self, context: &Context, mut recorder: Recorder<'_>, frame: &Image) -> Result<bool, GpuError> {
        let Some(index) = self.acquire(context, [frame.width, frame.height])? else {
            recorder.submit()?;
            return Ok(false);
        };
        let Some(swapchain) = &self.swapchain else { return Ok(false) };
        let (image, finished) = (swapchain.images[index as usize], swapchain.finished[index as usize]);
        record_copy(&mut recorder, frame, image, swapchain.extent);
        if let Err(error) = recorder.submit_between(self.acquired, finished) {
            // The semaphore may stay signalled: nothing of this swapchain is used again.
            self.lose_surface(context);
            return Err(error);
        }
        let (swapchains, indices, semaphores) = ([swapchain.raw], [index], [finished]);
        let info =
            vk::PresentInfoKHR::default().wait_semaphores(&semaphores).swapchains(&swapchains).image_indices(&indices);
        let presented = {
            let _queue = lock(&context.device.queue_lock);
            // SAFETY: the image was acquired and is in PRESENT_SRC; queue access is exclusive by the lock.
            unsafe { self.loader.queue_present(self.device.queue, &info) }
        };
        match presented {
            Ok(is_suboptimal) => {
                self.wants_new_swapchain |= is_suboptimal;
                Ok(true)
            }
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.wants_new_swapchain = true;
                Ok(false)
            }
            Err(vk::Result::ERROR_SURFACE_LOST_KHR) => {
                self.lose_surface(context);
                Ok(false)
            }
            Err(error) => {
                Err(context.found_lost(GpuError::from_call("vkQueuePresentKHR", error, "window/present"), &[], false))
            }
        }
    }

    /// Gives the surface up; the next frame makes a new one. For systems that take windows away, and for tests.
    pub fn lose_surface(&mut self, context: &Context) {
        self.drop_swapchain(context);
        if let Some(surfaces) = &self.device.instance.surface {
            // SAFETY: its swapchain is gone.
            unsafe { surfaces.destroy_surface(std::mem::replace(&mut self.surface, vk::SurfaceKHR::null()), None) };
        }
        // SAFETY: the queue is idle. A semaphore that was signalled and never waited for cannot be used again.
        unsafe { self.device.raw.destroy_semaphore(self.acquired, None) };
        self.acquired = vk::Semaphore::null();
    }

    /// Swapchains made so far.
    pub fn swapchain_count(&self) -> u64 {
        self.swapchain_count
    }

    fn make_surface(&mut self) -> Result<(), GpuError> {
        let instance = &self.device.instance;
        let refuse = |reason: String| GpuError::Refused(format!("the window has no surface: {reason}"));
        let display = self.window.display_handle().map_err(|error| refuse(error.to_string()))?.as_raw();
        let window = self.window.window_handle().map_err(|error| refuse(error.to_string()))?.as_raw();
        // SAFETY: the window outlives its surface: we hold it. Complete create infos.
        unsafe {
            if self.acquired == vk::Semaphore::null() {
                self.acquired = self
                    .device
                    .raw
                    .create_semaphore(&vk::SemaphoreCreateInfo::default(), None)
                    .checked("vkCreateSemaphore", "window")?;
                self.device.set_name(self.acquired, "window/acquired");
            }
            self.surface = ash_window::create_surface(&instance.entry, &instance.raw, display, window, None)
                .checked("vkCreateSurfaceKHR", "window")?;
            let surfaces = instance.surface.as_ref();
            let (physical, family) = (self.device.physical, self.device.queue_family);
            let can_present =
                surfaces.map(|s| s.get_physical_device_surface_support(physical, family, self.surface)).transpose();
            if !can_present.checked("vkGetPhysicalDeviceSurfaceSupportKHR", "window")?.unwrap_or(false) {
                let name = &self.device.info.name;
                return Err(refuse(format!("{name} cannot present to this window system; use another --gpu")));
            }
        }
        self.wants_new_swapchain = true;
        Ok(())
    }

    /// The index of an image that may be written after `acquired`; `None` where nothing can be shown now.
    fn acquire(&mut self, context: &Context, size: [u32; 2]) -> Result<Option<u32>, GpuError> {
        // Once as it is, once with a new swapchain, once with a new surface.
        for _ in 0..3 {
            if self.surface == vk::SurfaceKHR::null() {
                self.make_surface()?;
            }
            let fits = |s: &Swapchain| [s.extent.width, s.extent.height] == size;
            if self.wants_new_swapchain || !self.swapchain.as_ref().is_some_and(fits) {
                match self.make_swapchain(context, size) {
                    Ok(()) => {}
                    Err(GpuError::Call { result: vk::Result::ERROR_SURFACE_LOST_KHR, .. }) => {
                        self.lose_surface(context);
                        continue;
                    }
                    Err(error) => return Err(error),
                }
            }
            let Some(swapchain) = &self.swapchain else { return Ok(None) };
            // SAFETY: the semaphore is unsignalled: every acquired image was submitted, and waited for.
            let acquired =
                unsafe { self.loader.acquire_next_image(swapchain.raw, PATIENCE_NS, self.acquired, vk::Fence::null()) };
            match acquired {
                Ok((index, is_suboptimal)) => {
                    self.wants_new_swapchain |= is_suboptimal;
                    return Ok(Some(index));
                }
                Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(None),
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.wants_new_swapchain = true,
                Err(vk::Result::ERROR_SURFACE_LOST_KHR) => self.lose_surface(context),
                Err(error) => {
                    let error = GpuError::from_call("vkAcquireNextImageKHR", error, "window");
                    return Err(context.found_lost(error, &[], false));
                }
            }
        }
        Ok(None)
    }

    /// A swapchain of the surface's own size, or about `size` where it has none; none for a window without area.
    fn make_swapchain(&mut self, context: &Context, size: [u32; 2]) -> Result<(), GpuError> {
        self.drop_swapchain(context);
        let device = self.device.clone();
        let Some(surfaces) = &device.instance.surface else { return Ok(()) };
        // SAFETY: plain queries of a live surface; complete create infos.
        unsafe {
            let capabilities = surfaces
                .get_physical_device_surface_capabilities(device.physical, self.surface)
                .checked("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", "window")?;
            let (low, high) = (capabilities.min_image_extent, capabilities.max_image_extent);
            let extent = match capabilities.current_extent {
                vk::Extent2D { width: u32::MAX, .. } => vk::Extent2D {
                    width: size[0].clamp(low.width, high.width.max(low.width)),
                    height: size[1].clamp(low.height, high.height.max(low.height)),
                },
                extent => extent,
            };
            if extent.width == 0 || extent.height == 0 {
                return Ok(());
            }
            let formats = surfaces
                .get_physical_device_surface_formats(device.physical, self.surface)
                .checked("vkGetPhysicalDeviceSurfaceFormatsKHR", "window")?;
            // The frame is encoded already, so the copy must not encode it again.
            let plain = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
            let format = formats.iter().find(|f| plain.contains(&f.format));
            let copies = capabilities.supported_usage_flags.contains(vk::ImageUsageFlags::TRANSFER_DST);
            let (Some(format), true) = (format, copies) else {
                let message = format!("the window's surface takes no copies of 8-bit UNORM images, only {formats:?}");
                return Err(GpuError::Refused(message));
            };
            let most = if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
            let alpha = [vk::CompositeAlphaFlagsKHR::OPAQUE, vk::CompositeAlphaFlagsKHR::INHERIT];
            let alpha = alpha.into_iter().find(|&a| capabilities.supported_composite_alpha.contains(a));
            let info = vk::SwapchainCreateInfoKHR::default()
                .surface(self.surface)
                .min_image_count((capabilities.min_image_count + 1).min(most))
                .image_format(format.format)
                .image_color_space(format.color_space)
                .image_extent(extent)
                .image_array_layers(1)
                .image_usage(vk::ImageUsageFlags::TRANSFER_DST)
                .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
                .pre_transform(capabilities.current_transform)
                .composite_alpha(alpha.unwrap_or(vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED))
                .present_mode(vk::PresentModeKHR::FIFO)
                .clipped(true);
            let raw = self.loader.create_swapchain(&info, None).checked("vkCreateSwapchainKHR", "window")?;
            device.set_name(raw, "window/swapchain");
            let mut swapchain = Swapchain { raw, extent, images: Vec::new(), finished: Vec::new() };
            let images = self.loader.get_swapchain_images(raw).checked("vkGetSwapchainImagesKHR", "window");
            let mut failure = None;
            for (i, &image) in images.as_ref().map_or(&[][..], Vec::as_slice).iter().enumerate() {
                device.set_name(image, &format!("window/image {i}"));
                match device.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) {
                    Ok(semaphore) => {
                        device.set_name(semaphore, &format!("window/finished {i}"));
                        swapchain.images.push(image);
                        swapchain.finished.push(semaphore);
                    }
                    Err(error) => failure = Some(GpuError::from_call("vkCreateSemaphore", error, "window")),
                }
            }
            self.swapchain = Some(swapchain);
            images?;
            if let Some(error) = failure {
                self.drop_swapchain(context);
                return Err(error);
            }
        }
        self.wants_new_swapchain = false;
        self.swapchain_count += 1;
        Ok(())
    }

    fn drop_swapchain(&mut self, context: &Context) {
        let _queue = lock(&context.device.queue_lock);
        self.destroy_swapchain();
    }

    /// The caller holds the queue.
    fn destroy_swapchain(&mut self) {
        if self.device.is_hung.load(Ordering::Acquire) {
            return;
        }
        // SAFETY: the queue is idle, so nothing uses the swapchain's images and semaphores any more.
        unsafe {
            let _ = self.device.raw.queue_wait_idle(self.device.queue);
            if let Some(swapchain) = self.swapchain.take() {
                swapchain.finished.iter().for_each(|&semaphore| self.device.raw.destroy_semaphore(semaphore, None));
                self.loader.destroy_swapchain(swapchain.raw, None);
            }
        }
    }
}

impl Drop for Presenter {
    /// Others may still submit.
    fn drop(&mut self) {
        if self.device.is_hung.load(Ordering::Acquire) {
            return;
        }
        let device = self.device.clone();
        let _queue = lock(&device.queue_lock);
        self.destroy_swapchain();
        // SAFETY: the queue is idle and the swapchain gone.
        unsafe {
            self.device.raw.destroy_semaphore(self.acquired, None);
            if let Some(surfaces) = &self.device.instance.surface {
                surfaces.destroy_surface(self.surface, None);
            }
        }
    }
}

/// The frame into the acquired image, which goes from nothing to what the window system takes.
fn record_copy(recorder: &mut Recorder<'_>, frame: &Image, image: vk::Image, extent: vk::Extent2D) {
    let device = recorder.context.device.clone();
    let range = frame.whole_range();
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: range.aspect_mask,
        mip_level: 0,
        base_array_layer: 0,
        layer_count: 1,
    };
    let corner = |width: u32, height: u32| vk::Offset3D { x: width as i32, y: height as i32, z: 1 };
    let blit = vk::ImageBlit {
        src_subresource: layers,
        src_offsets: [vk::Offset3D::default(), corner(frame.width, frame.height)],
        dst_subresource: layers,
        dst_offsets: [vk::Offset3D::default(), corner(extent.width, extent.height)],
    };
    let to_transfer = vk::ImageMemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .old_layout(vk::ImageLayout::UNDEFINED)
        .new_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
        .image(image)
        .subresource_range(range);
    let to_window = vk::ImageMemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .old_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
        .new_layout(vk::ImageLayout::PRESENT_SRC_KHR)
        .image(image)
        .subresource_range(range);
    let access = [Access { id: frame.id(), reads: true, writes: false }];
    let cost = Cost { bytes_read: frame.size_bytes(), bytes_written: frame.size_bytes() };
    recorder.timed("window/present", &access, cost, 0, None, |recorder| {
        let commands = recorder.commands();
        let barrier = |barrier: &vk::ImageMemoryBarrier2<'_>| {
            let info = vk::DependencyInfo::default().image_memory_barriers(std::slice::from_ref(barrier));
            // SAFETY: the image was acquired; the submission waits for that.
            unsafe { device.cmd_pipeline_barrier2(commands, &info) };
        };
        barrier(&to_transfer);
        // SAFETY: both images are alive and in the layouts named.
        unsafe {
            device.raw.cmd_blit_image(
                commands,
                frame.raw(),
                vk::ImageLayout::GENERAL,
                image,
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &[blit],
                vk::Filter::NEAREST,
            );
        }
        barrier(&to_window);
    });
}
