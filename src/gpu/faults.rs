//! Vulkan calls that fail on purpose: a layer between us and the loader, to show that every failure is met.
//!
//! While a [`FaultInjection`] lives, instances are made through it. It counts every call that can fail, of ours and of the
//! memory allocator, and makes one of them return an error in the driver's place, without reaching the driver. Nothing of
//! it runs otherwise.

use super::device::lock;
use ash::vk;
use std::ffi::{CStr, c_char, c_void};
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicPtr, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard};

/// One at a time: the counts are the process's.
static TURN: Mutex<()> = Mutex::new(());
static IS_ON: AtomicBool = AtomicBool::new(false);
static CALLS: AtomicU64 = AtomicU64::new(0);
/// The call that fails, from 1; 0 for none.
static FAIL_AT: AtomicU64 = AtomicU64::new(0);
static FAIL_WITH: AtomicI32 = AtomicI32::new(0);
static FAILED: Mutex<Option<&'static str>> = Mutex::new(None);
static NAMES: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
static COMPLAINTS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// How a call fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    OutOfHostMemory,
    OutOfDeviceMemory,
    DeviceLost,
}

/// The layer, switched on until this is dropped. Others wait for their turn.
pub struct FaultInjection {
    _turn: MutexGuard<'static, ()>,
}

impl FaultInjection {
    /// Starts counting; no call fails yet.
    pub fn start() -> Self {
        let turn = lock(&TURN);
        IS_ON.store(true, Ordering::Release);
        let injection = Self { _turn: turn };
        injection.fail(0, Failure::OutOfHostMemory);
        injection
    }

    /// Counts anew from 0, and makes call number `at` (from 1; 0 for none) fail, once.
    pub fn fail(&self, at: u64, failure: Failure) {
        let result = match failure {
            Failure::OutOfHostMemory => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
            Failure::OutOfDeviceMemory => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
            Failure::DeviceLost => vk::Result::ERROR_DEVICE_LOST,
        };
        FAIL_WITH.store(result.as_raw(), Ordering::Release);
        FAIL_AT.store(at, Ordering::Release);
        CALLS.store(0, Ordering::Release);
        *lock(&FAILED) = None;
        lock(&NAMES).clear();
        lock(&COMPLAINTS).clear();
    }

    /// Calls that could have failed since the last [`Self::fail`], by name in their order.
    pub fn calls(&self) -> Vec<&'static str> {
        lock(&NAMES).clone()
    }

    /// What validation said of instances that are gone since the last [`Self::fail`] (objects that were left behind), and
    /// memory that was still counted when its device went.
    pub fn complaints(&self) -> Vec<String> {
        lock(&COMPLAINTS).clone()
    }

    /// The name of the call that failed, if it was reached.
    pub fn failed(&self) -> Option<&'static str> {
        *lock(&FAILED)
    }
}

impl Drop for FaultInjection {
    fn drop(&mut self) {
        self.fail(0, Failure::OutOfHostMemory);
        IS_ON.store(false, Ordering::Release);
    }
}

/// Counts a call; the error it is to fail with, if it is its turn.
pub(super) fn failure_of(name: &'static str) -> Option<vk::Result> {
    if !IS_ON.load(Ordering::Acquire) {
        return None;
    }
    lock(&NAMES).push(name);
    if CALLS.fetch_add(1, Ordering::AcqRel) + 1 != FAIL_AT.load(Ordering::Acquire) {
        return None;
    }
    *lock(&FAILED) = Some(name);
    Some(vk::Result::from_raw(FAIL_WITH.load(Ordering::Acquire)))
}

/// Keeps what is left to say when an instance or a device goes.
pub(super) fn complain(complaints: impl IntoIterator<Item = String>) {
    if IS_ON.load(Ordering::Acquire) {
        lock(&COMPLAINTS).extend(complaints);
    }
}

/// The entry to make an instance from: the loader's, or this layer before it.
pub(super) fn entry(loader: &ash::Entry) -> ash::Entry {
    if !IS_ON.load(Ordering::Acquire) {
        return loader.clone();
    }
    LOADER.store(loader.static_fn().get_instance_proc_addr as *mut c_void, Ordering::Release);
    // SAFETY: our function answers as the loader's does. The instance keeps the loader's entry beside this one.
    unsafe { ash::Entry::from_static_fn(ash::StaticFn { get_instance_proc_addr: instance_function }) }
}

/// `vkGetInstanceProcAddr` of the loader, and its `vkGetDeviceProcAddr`.
static LOADER: AtomicPtr<c_void> = AtomicPtr::new(ptr::null_mut());
static DEVICE_LOADER: AtomicPtr<c_void> = AtomicPtr::new(ptr::null_mut());

unsafe extern "system" fn instance_function(instance: vk::Instance, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: LOADER holds the loader's own function, set before this one was handed out; `name` is the caller's C text.
    unsafe {
        let next: vk::PFN_vkGetInstanceProcAddr = std::mem::transmute(LOADER.load(Ordering::Acquire));
        let function = next(instance, name)?;
        if CStr::from_ptr(name) == c"vkGetDeviceProcAddr" {
            DEVICE_LOADER.store(function as *mut c_void, Ordering::Release);
            let ours: vk::PFN_vkGetDeviceProcAddr = device_function;
            return Some(std::mem::transmute::<vk::PFN_vkGetDeviceProcAddr, unsafe extern "system" fn()>(ours));
        }
        Some(wrapped(name, function))
    }
}

unsafe extern "system" fn device_function(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: as above, with the loader's function for devices.
    unsafe {
        let next: vk::PFN_vkGetDeviceProcAddr = std::mem::transmute(DEVICE_LOADER.load(Ordering::Acquire));
        next(device, name).map(|function| wrapped(name, function))
    }
}

/// Our function in the place of `function`, where its result is one that can be an error.
unsafe fn wrapped(name: *const c_char, function: unsafe extern "system" fn()) -> unsafe extern "system" fn() {
    // SAFETY: `name` is the caller's C text; a wrapper has the type of the function of that name.
    unsafe {
        match CStr::from_ptr(name).to_str().ok().and_then(|name| wrapper(name, function as *mut c_void)) {
            Some(ours) => std::mem::transmute::<*const c_void, unsafe extern "system" fn()>(ours),
            None => function,
        }
    }
}

type Callbacks = vk::AllocationCallbacks<'static>;

macro_rules! calls {
    ($($name:ident($($argument:ident: $type:ty),*);)*) => {
        $(
            #[allow(non_snake_case, reason = "Vulkan's own name")]
            mod $name {
                use super::*;
                type Function = unsafe extern "system" fn($($type),*) -> vk::Result;
                /// The driver's (or the next layer's). Of one chain of layers, so the same for all devices of a process.
                pub static NEXT: AtomicPtr<c_void> = AtomicPtr::new(ptr::null_mut());

                #[allow(clippy::too_many_arguments, reason = "Vulkan's own arguments")]
                pub unsafe extern "system" fn call($($argument: $type),*) -> vk::Result {
                    if let Some(result) = failure_of(stringify!($name)) {
                        return result;
                    }
                    // SAFETY: NEXT is the function of this name and type; the arguments are the caller's.
                    unsafe {
                        let next: Function = std::mem::transmute(NEXT.load(Ordering::Acquire));
                        next($($argument),*)
                    }
                }
            }
        )*

        /// Our function of that name, which goes on to `next`.
        fn wrapper(name: &str, next: *mut c_void) -> Option<*const c_void> {
            match name {
                $(stringify!($name) => {
                    $name::NEXT.store(next, Ordering::Release);
                    Some($name::call as *const c_void)
                })*
                _ => None,
            }
        }
    };
}

/// `vkCreate...(device, info, callbacks, object)`, as most are.
macro_rules! all_calls {
    ($($create:ident($info:ty, $object:ty);)* ; $($other:tt)*) => {
        calls! {
            $($create(device: vk::Device, info: *const $info, callbacks: *const Callbacks, object: *mut $object);)*
            $($other)*
        }
    };
}

all_calls! {
    vkAllocateMemory(vk::MemoryAllocateInfo<'static>, vk::DeviceMemory);
    vkCreateBuffer(vk::BufferCreateInfo<'static>, vk::Buffer);
    vkCreateBufferView(vk::BufferViewCreateInfo<'static>, vk::BufferView);
    vkCreateImage(vk::ImageCreateInfo<'static>, vk::Image);
    vkCreateImageView(vk::ImageViewCreateInfo<'static>, vk::ImageView);
    vkCreateSampler(vk::SamplerCreateInfo<'static>, vk::Sampler);
    vkCreateDescriptorPool(vk::DescriptorPoolCreateInfo<'static>, vk::DescriptorPool);
    vkCreateDescriptorSetLayout(vk::DescriptorSetLayoutCreateInfo<'static>, vk::DescriptorSetLayout);
    vkCreatePipelineLayout(vk::PipelineLayoutCreateInfo<'static>, vk::PipelineLayout);
    vkCreatePipelineCache(vk::PipelineCacheCreateInfo<'static>, vk::PipelineCache);
    vkCreateShaderModule(vk::ShaderModuleCreateInfo<'static>, vk::ShaderModule);
    vkCreateCommandPool(vk::CommandPoolCreateInfo<'static>, vk::CommandPool);
    vkCreateQueryPool(vk::QueryPoolCreateInfo<'static>, vk::QueryPool);
    vkCreateSemaphore(vk::SemaphoreCreateInfo<'static>, vk::Semaphore);
    vkCreateAccelerationStructureKHR(vk::AccelerationStructureCreateInfoKHR<'static>, vk::AccelerationStructureKHR);
    ;
    vkEnumerateInstanceLayerProperties(count: *mut u32, layers: *mut vk::LayerProperties);
    vkEnumerateInstanceExtensionProperties(layer: *const c_char, count: *mut u32, found: *mut vk::ExtensionProperties);
    vkCreateInstance(info: *const vk::InstanceCreateInfo<'static>, callbacks: *const Callbacks, made: *mut vk::Instance);
    vkCreateDebugUtilsMessengerEXT(
        instance: vk::Instance, info: *const vk::DebugUtilsMessengerCreateInfoEXT<'static>, callbacks: *const Callbacks,
        made: *mut vk::DebugUtilsMessengerEXT
    );
    vkEnumeratePhysicalDevices(instance: vk::Instance, count: *mut u32, devices: *mut vk::PhysicalDevice);
    vkEnumerateDeviceExtensionProperties(
        device: vk::PhysicalDevice, layer: *const c_char, count: *mut u32, found: *mut vk::ExtensionProperties
    );
    vkCreateDevice(
        device: vk::PhysicalDevice, info: *const vk::DeviceCreateInfo<'static>, callbacks: *const Callbacks,
        made: *mut vk::Device
    );
    vkSetDebugUtilsObjectNameEXT(device: vk::Device, info: *const vk::DebugUtilsObjectNameInfoEXT<'static>);
    vkBindBufferMemory(device: vk::Device, buffer: vk::Buffer, memory: vk::DeviceMemory, offset: u64);
    vkBindImageMemory(device: vk::Device, image: vk::Image, memory: vk::DeviceMemory, offset: u64);
    vkMapMemory(
        device: vk::Device, memory: vk::DeviceMemory, offset: u64, size: u64, flags: vk::MemoryMapFlags,
        data: *mut *mut c_void
    );
    vkAllocateDescriptorSets(
        device: vk::Device, info: *const vk::DescriptorSetAllocateInfo<'static>, sets: *mut vk::DescriptorSet
    );
    vkAllocateCommandBuffers(
        device: vk::Device, info: *const vk::CommandBufferAllocateInfo<'static>, commands: *mut vk::CommandBuffer
    );
    vkCreateComputePipelines(
        device: vk::Device, cache: vk::PipelineCache, count: u32, infos: *const vk::ComputePipelineCreateInfo<'static>,
        callbacks: *const Callbacks, made: *mut vk::Pipeline
    );
    vkCreateGraphicsPipelines(
        device: vk::Device, cache: vk::PipelineCache, count: u32, infos: *const vk::GraphicsPipelineCreateInfo<'static>,
        callbacks: *const Callbacks, made: *mut vk::Pipeline
    );
    vkGetPipelineCacheData(device: vk::Device, cache: vk::PipelineCache, size: *mut usize, data: *mut c_void);
    vkResetCommandPool(device: vk::Device, pool: vk::CommandPool, flags: vk::CommandPoolResetFlags);
    vkBeginCommandBuffer(commands: vk::CommandBuffer, info: *const vk::CommandBufferBeginInfo<'static>);
    vkEndCommandBuffer(commands: vk::CommandBuffer);
    vkQueueSubmit(queue: vk::Queue, count: u32, submits: *const vk::SubmitInfo<'static>, fence: vk::Fence);
    vkWaitSemaphores(device: vk::Device, info: *const vk::SemaphoreWaitInfo<'static>, timeout: u64);
    vkDeviceWaitIdle(device: vk::Device);
    vkGetQueryPoolResults(
        device: vk::Device, pool: vk::QueryPool, first: u32, count: u32, size: usize, data: *mut c_void, stride: u64,
        flags: vk::QueryResultFlags
    );
    vkGetCalibratedTimestampsKHR(
        device: vk::Device, count: u32, infos: *const vk::CalibratedTimestampInfoKHR<'static>, timestamps: *mut u64,
        deviation: *mut u64
    );
    vkGetCalibratedTimestampsEXT(
        device: vk::Device, count: u32, infos: *const vk::CalibratedTimestampInfoKHR<'static>, timestamps: *mut u64,
        deviation: *mut u64
    );
}
