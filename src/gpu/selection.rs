//! Which device: all of them are listed, the unusable ones with the reason.

use super::context::Options;
use super::error::{Checked as _, GpuError};
use super::features::{self, OptionalFeatures, Support};
use super::instance::Instance;
use ash::vk;

/// One physical device as `linklight devices` shows it.
#[derive(Debug, Clone)]
pub struct DeviceInfo {
    pub index: usize,
    pub name: String,
    /// "discrete GPU", "integrated GPU", "virtual GPU", "CPU" or "other".
    pub kind: &'static str,
    pub driver: String,
    /// "1.4.305"
    pub api_version: String,
    pub memory_bytes: u64,
    pub max_storage_buffer_bytes: u64,
    /// Threads that run in lock-step; never assumed by a kernel.
    pub subgroup_size: u32,
    /// Names of required features it lacks; empty when usable.
    pub missing: Vec<String>,
    pub optional: OptionalFeatures,
    /// Order of preference by kind, 0 first.
    rank: u32,
}

pub(super) struct Candidate {
    pub physical: vk::PhysicalDevice,
    pub info: DeviceInfo,
    pub support: Support,
}

/// Every device of the instance, in the driver's order.
pub(super) fn candidates(instance: &Instance) -> Result<Vec<Candidate>, GpuError> {
    // SAFETY: plain queries on a live instance.
    let devices = match unsafe { instance.raw.enumerate_physical_devices() } {
        // What loaders answer where there is no driver.
        Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Vec::new(),
        devices => devices.checked("vkEnumeratePhysicalDevices", "start")?,
    };
    Ok(devices.into_iter().enumerate().map(|(index, physical)| candidate(instance, index, physical)).collect())
}

fn candidate(instance: &Instance, index: usize, physical: vk::PhysicalDevice) -> Candidate {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut subgroup);
    // SAFETY: the chain outlives the call.
    let memory = unsafe {
        instance.raw.get_physical_device_properties2(physical, &mut properties);
        instance.raw.get_physical_device_memory_properties(physical)
    };
    let core = properties.properties;
    let support = features::query(&instance.raw, physical);
    let (kind, rank) = match core.device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => ("discrete GPU", 0),
        vk::PhysicalDeviceType::INTEGRATED_GPU => ("integrated GPU", 1),
        vk::PhysicalDeviceType::VIRTUAL_GPU => ("virtual GPU", 2),
        vk::PhysicalDeviceType::CPU => ("CPU", 3),
        _ => ("other", 4),
    };
    let text = |s: Result<&std::ffi::CStr, _>| s.map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let version = core.api_version;
    let info = DeviceInfo {
        index,
        name: text(core.device_name_as_c_str()),
        kind,
        driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
        api_version: format!(
            "{}.{}.{}",
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version)
        ),
        memory_bytes: memory
            .memory_heaps_as_slice()
            .iter()
            .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
            .map(|h| h.size)
            .sum(),
        max_storage_buffer_bytes: u64::from(core.limits.max_storage_buffer_range),
        subgroup_size: subgroup.subgroup_size,
        missing: support.missing.clone(),
        optional: support.optional,
        rank,
    };
    Candidate { physical, info, support }
}

/// The candidate of [`choose_device`].
pub(super) fn choose(mut candidates: Vec<Candidate>, wanted: Option<&str>) -> Result<Candidate, GpuError> {
    let devices: Vec<DeviceInfo> = candidates.iter().map(|candidate| candidate.info.clone()).collect();
    // The list is in enumeration order, so a device's index is its place.
    choose_device(&devices, wanted).map(|device| candidates.swap_remove(device.index))
}

/// Picks a usable device by index or by a part of the name (any case); without a wish the fastest kind.
pub fn choose_device<'d>(devices: &'d [DeviceInfo], wanted: Option<&str>) -> Result<&'d DeviceInfo, GpuError> {
    let reasons = if devices.is_empty() {
        "the Vulkan loader found no driver (tools/setup installs one)".to_owned()
    } else {
        let verdict = |device: &DeviceInfo| match device.missing.as_slice() {
            [] => format!("{} {} is usable", device.index, device.name),
            missing => format!("{} {} lacks {}", device.index, device.name, missing.join(", ")),
        };
        devices.iter().map(verdict).collect::<Vec<_>>().join("; ")
    };
    let matches = |info: &DeviceInfo| match wanted {
        None => true,
        Some(wish) => match wish.parse::<usize>() {
            Ok(index) => info.index == index,
            Err(_) => info.name.to_lowercase().contains(&wish.to_lowercase()),
        },
    };
    devices
        .iter()
        .filter(|device| device.missing.is_empty() && matches(device))
        .min_by_key(|device| (device.rank, device.index))
        .ok_or(GpuError::NoDevice { wanted: wanted.map(str::to_owned), reasons })
}

/// Every device, usable or not, for `linklight devices`.
pub fn list_devices() -> Result<Vec<DeviceInfo>, GpuError> {
    let instance = Instance::new(&Options::default())?;
    Ok(candidates(&instance)?.into_iter().map(|c| c.info).collect())
}
