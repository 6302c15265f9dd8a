//! Which device features the house requires and which it uses when present.
//!
//! Required by *feature*, never by version number: under a frame debugger a device may call itself older than it is.

use ash::{amd, ext, khr, vk};
use std::collections::BTreeSet;
use std::ffi::CStr;

/// Optional features, all off where the device lacks them (or `--validate` tests ask for none).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OptionalFeatures {
    /// Hardware (or driver) ray traversal in shaders.
    pub ray_query: bool,
    /// f16 and u16 in storage buffers.
    pub storage_16bit: bool,
    pub pipeline_statistics: bool,
    pub memory_budget: bool,
    pub calibrated_timestamps: bool,
    pub device_fault: bool,
    /// Passes are marked one by one as they begin and end.
    pub buffer_marker: bool,
    pub sampler_anisotropy: bool,
    /// Images can be shown in windows.
    pub swapchain: bool,
}

/// What a physical device offers, measured against what we need.
#[derive(Debug, Clone)]
pub(super) struct Support {
    /// Names of required features that are missing; empty for a usable device.
    pub missing: Vec<String>,
    pub optional: OptionalFeatures,
    /// Extensions to enable.
    pub extensions: Vec<&'static CStr>,
    pub graphics_queue_family: Option<u32>,
}

const REQUIRED_EXTENSIONS: [&CStr; 1] = [khr::push_descriptor::NAME];

/// In core 1.3, or as extensions of the same content: enabled by name where advertised.
const PROMOTED_EXTENSIONS: [&CStr; 2] = [khr::dynamic_rendering::NAME, khr::synchronization2::NAME];

const RAY_QUERY_EXTENSIONS: [&CStr; 3] =
    [khr::acceleration_structure::NAME, khr::ray_query::NAME, khr::deferred_host_operations::NAME];

/// The structs a device is created with; only those of present features are chained.
#[derive(Default)]
pub(super) struct FeatureChain {
    pub core: vk::PhysicalDeviceFeatures,
    pub dynamic_rendering: vk::PhysicalDeviceDynamicRenderingFeatures<'static>,
    pub synchronization2: vk::PhysicalDeviceSynchronization2Features<'static>,
    pub timeline_semaphore: vk::PhysicalDeviceTimelineSemaphoreFeatures<'static>,
    pub scalar_block_layout: vk::PhysicalDeviceScalarBlockLayoutFeatures<'static>,
    pub descriptor_indexing: vk::PhysicalDeviceDescriptorIndexingFeatures<'static>,
    pub atomic_int64: vk::PhysicalDeviceShaderAtomicInt64Features<'static>,
    pub host_query_reset: vk::PhysicalDeviceHostQueryResetFeatures<'static>,
    pub storage_16bit: vk::PhysicalDevice16BitStorageFeatures<'static>,
    pub buffer_device_address: vk::PhysicalDeviceBufferDeviceAddressFeatures<'static>,
    pub acceleration_structure: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    pub ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR<'static>,
    pub device_fault: vk::PhysicalDeviceFaultFeaturesEXT<'static>,
}

/// Asks the device for everything at once.
pub(super) fn query(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Support {
    // SAFETY: `physical` comes from `instance`; every chained struct outlives the call.
    unsafe {
        let listed = instance.enumerate_device_extension_properties(physical);
        let unlisted = listed.as_ref().err().map(|error| format!("a list of its extensions ({error:?})"));
        let available: BTreeSet<_> = listed
            .unwrap_or_default()
            .iter()
            .filter_map(|e| e.extension_name_as_c_str().ok().map(CStr::to_owned))
            .collect();
        let has = |name: &CStr| available.contains(name);
        let has_ray_query = RAY_QUERY_EXTENSIONS.iter().all(|e| has(e));

        let mut f = FeatureChain::default();
        let mut query = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut f.dynamic_rendering)
            .push_next(&mut f.synchronization2)
            .push_next(&mut f.timeline_semaphore)
            .push_next(&mut f.scalar_block_layout)
            .push_next(&mut f.descriptor_indexing)
            .push_next(&mut f.atomic_int64)
            .push_next(&mut f.host_query_reset)
            .push_next(&mut f.storage_16bit);
        if has_ray_query {
            query = query
                .push_next(&mut f.buffer_device_address)
                .push_next(&mut f.acceleration_structure)
                .push_next(&mut f.ray_query);
        }
        if has(ext::device_fault::NAME) {
            query = query.push_next(&mut f.device_fault);
        }
        instance.get_physical_device_features2(physical, &mut query);
        let core = query.features;

        let d = &f.descriptor_indexing;
        let required = [
            (core.shader_int64, "shaderInt64"),
            (core.fragment_stores_and_atomics, "fragmentStoresAndAtomics"),
            (core.image_cube_array, "imageCubeArray"),
            (f.dynamic_rendering.dynamic_rendering, "dynamicRendering"),
            (f.synchronization2.synchronization2, "synchronization2"),
            (f.timeline_semaphore.timeline_semaphore, "timelineSemaphore"),
            (f.scalar_block_layout.scalar_block_layout, "scalarBlockLayout"),
            (d.runtime_descriptor_array, "runtimeDescriptorArray"),
            (d.shader_sampled_image_array_non_uniform_indexing, "shaderSampledImageArrayNonUniformIndexing"),
            (d.descriptor_binding_partially_bound, "descriptorBindingPartiallyBound"),
            (d.descriptor_binding_variable_descriptor_count, "descriptorBindingVariableDescriptorCount"),
            (f.atomic_int64.shader_buffer_int64_atomics, "shaderBufferInt64Atomics"),
            (f.host_query_reset.host_query_reset, "hostQueryReset"),
        ];
        let mut missing: Vec<String> =
            required.iter().filter(|(present, _)| *present == 0).map(|(_, name)| (*name).to_owned()).collect();
        missing.extend(REQUIRED_EXTENSIONS.iter().filter(|e| !has(e)).map(|e| e.to_string_lossy().into_owned()));
        missing.extend(unlisted);
        let families = instance.get_physical_device_queue_family_properties(physical);
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let graphics_queue_family = families
            .iter()
            .position(|q| q.queue_flags.contains(wanted) && q.timestamp_valid_bits > 0)
            .map(|i| i as u32);
        if graphics_queue_family.is_none() {
            missing.push("a queue with graphics, compute and timestamps".into());
        }

        let optional = OptionalFeatures {
            ray_query: has_ray_query
                && f.ray_query.ray_query != 0
                && f.acceleration_structure.acceleration_structure != 0
                && f.buffer_device_address.buffer_device_address != 0,
            storage_16bit: f.storage_16bit.storage_buffer16_bit_access != 0,
            pipeline_statistics: core.pipeline_statistics_query != 0,
            memory_budget: has(ext::memory_budget::NAME),
            calibrated_timestamps: has(khr::calibrated_timestamps::NAME) || has(ext::calibrated_timestamps::NAME),
            device_fault: f.device_fault.device_fault != 0,
            buffer_marker: has(amd::buffer_marker::NAME),
            sampler_anisotropy: core.sampler_anisotropy != 0,
            swapchain: has(khr::swapchain::NAME),
        };
        let mut extensions = REQUIRED_EXTENSIONS.to_vec();
        extensions.extend(PROMOTED_EXTENSIONS.iter().filter(|e| has(e)));
        let mut add = |present: bool, names: &[&'static CStr]| {
            if present {
                extensions.extend(names);
            }
        };
        add(optional.ray_query, &RAY_QUERY_EXTENSIONS);
        add(optional.memory_budget, &[ext::memory_budget::NAME]);
        let clocks: &[&CStr] = if has(khr::calibrated_timestamps::NAME) {
            &[khr::calibrated_timestamps::NAME]
        } else {
            &[ext::calibrated_timestamps::NAME]
        };
        add(optional.calibrated_timestamps, clocks);
        add(optional.device_fault, &[ext::device_fault::NAME]);
        add(optional.buffer_marker, &[amd::buffer_marker::NAME]);
        add(optional.swapchain, &[khr::swapchain::NAME]);
        Support { missing, optional, extensions, graphics_queue_family }
    }
}

impl FeatureChain {
    /// Exactly the features we use: what is required, and what of the optional is on. `robust` gives accesses beyond the
    /// end of a buffer a meaning (every device can): a wrong count in a pass must not become undefined behaviour.
    pub fn enabled(optional: OptionalFeatures, robust: bool) -> Self {
        let on = |flag: bool| vk::Bool32::from(flag);
        Self {
            core: vk::PhysicalDeviceFeatures {
                robust_buffer_access: on(robust),
                shader_int64: vk::TRUE,
                fragment_stores_and_atomics: vk::TRUE,
                image_cube_array: vk::TRUE,
                pipeline_statistics_query: on(optional.pipeline_statistics),
                sampler_anisotropy: on(optional.sampler_anisotropy),
                ..Default::default()
            },
            dynamic_rendering: vk::PhysicalDeviceDynamicRenderingFeatures::default().dynamic_rendering(true),
            synchronization2: vk::PhysicalDeviceSynchronization2Features::default().synchronization2(true),
            timeline_semaphore: vk::PhysicalDeviceTimelineSemaphoreFeatures::default().timeline_semaphore(true),
            scalar_block_layout: vk::PhysicalDeviceScalarBlockLayoutFeatures::default().scalar_block_layout(true),
            descriptor_indexing: vk::PhysicalDeviceDescriptorIndexingFeatures::default()
                .runtime_descriptor_array(true)
                .shader_sampled_image_array_non_uniform_indexing(true)
                .descriptor_binding_partially_bound(true)
                .descriptor_binding_variable_descriptor_count(true),
            atomic_int64: vk::PhysicalDeviceShaderAtomicInt64Features::default().shader_buffer_int64_atomics(true),
            host_query_reset: vk::PhysicalDeviceHostQueryResetFeatures::default().host_query_reset(true),
            storage_16bit: vk::PhysicalDevice16BitStorageFeatures::default()
                .storage_buffer16_bit_access(optional.storage_16bit),
            buffer_device_address: vk::PhysicalDeviceBufferDeviceAddressFeatures::default()
                .buffer_device_address(optional.ray_query),
            acceleration_structure: vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default()
                .acceleration_structure(optional.ray_query),
            ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(optional.ray_query),
            device_fault: vk::PhysicalDeviceFaultFeaturesEXT::default().device_fault(optional.device_fault),
        }
    }
}
