//! The Vulkan instance: loader, layers, and validation messages caught for tests and the log.

use super::context::Options;
use super::device::lock;
use super::error::{Checked, GpuError};
use super::faults;
use ash::{ext, khr, vk};
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Windows of every system that may be running.
const SURFACE_EXTENSIONS: [&CStr; 6] = [
    khr::surface::NAME,
    khr::xlib_surface::NAME,
    khr::xcb_surface::NAME,
    khr::wayland_surface::NAME,
    khr::win32_surface::NAME,
    ext::metal_surface::NAME,
];

/// Messages of severity warning and error, in order.
pub(super) type MessageLog = Arc<Mutex<Vec<String>>>;

/// Loader, instance and debug messenger; destroyed last.
pub(super) struct Instance {
    pub raw: ash::Instance,
    /// True when core and synchronization validation run.
    pub validation: bool,
    /// Surfaces can be made, and asked.
    pub surface: Option<khr::surface::Instance>,
    pub messages: MessageLog,
    /// Names and labels can be given (a layer or capture tool listens).
    pub has_debug_utils: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    // The callback's user data; freed after the messenger.
    _callback_log: Box<MessageLog>,
    pub entry: ash::Entry,
    // What `entry` may stand on.
    _loader: ash::Entry,
}

/// Whether the Vulkan loader knows a layer of that name, switched on or not.
pub(super) fn has_layer(name: &CStr) -> bool {
    // SAFETY: loading the Vulkan loader runs its initialisers, as every Vulkan program does; a plain query.
    let layers = unsafe { ash::Entry::load().map(|entry| entry.enumerate_instance_layer_properties()) };
    layers.is_ok_and(|layers| layers.is_ok_and(|l| l.iter().any(|l| l.layer_name_as_c_str() == Ok(name))))
}

impl Instance {
    /// `validation` asks for the Khronos layer with core and synchronization checks; a missing layer is an error,
    /// so that silence always means that somebody listened.
    /// With `presents`, everything the loader offers for showing images in windows is on.
    pub fn new(options: &Options) -> Result<Self, GpuError> {
        let &Options { validation, presents, .. } = options;
        // SAFETY: loading the Vulkan loader runs its initialisers, as every Vulkan program does.
        let loader = unsafe { ash::Entry::load() }.map_err(|e| GpuError::NoLoader(e.to_string()))?;
        let entry = faults::entry(&loader);
        // SAFETY: plain queries and creation with structs that outlive the calls; the log box outlives the messenger.
        unsafe {
            let layers =
                entry.enumerate_instance_layer_properties().checked("vkEnumerateInstanceLayerProperties", "start")?;
            let has_layer = layers.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION_LAYER));
            if validation && !has_layer {
                return Err(GpuError::NoLoader(
                    "--validate needs the layer VK_LAYER_KHRONOS_validation, which is not installed (tools/setup --test installs it)".into(),
                ));
            }
            let available = entry
                .enumerate_instance_extension_properties(None)
                .checked("vkEnumerateInstanceExtensionProperties", "start")?;
            let has_debug_utils =
                validation || available.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));

            let mut extensions = Vec::new();
            if has_debug_utils {
                extensions.push(ext::debug_utils::NAME.as_ptr());
            }
            if presents {
                let is_there = |name: &&CStr| available.iter().any(|e| e.extension_name_as_c_str() == Ok(*name));
                let found: Vec<_> = SURFACE_EXTENSIONS.iter().filter(|name| is_there(name)).collect();
                if found.len() < 2 || !is_there(&khr::surface::NAME) {
                    return Err(GpuError::Refused(
                        "this Vulkan loader knows no window system (VK_KHR_surface and one of its kinds); \
                         render without a window by `linklight render`"
                            .into(),
                    ));
                }
                extensions.extend(found.iter().map(|name| name.as_ptr()));
            }
            let mut layer_names = Vec::new();
            if validation {
                layer_names.push(VALIDATION_LAYER.as_ptr());
                extensions.push(ext::validation_features::NAME.as_ptr());
            }

            let app = vk::ApplicationInfo::default()
                .application_name(c"linklight")
                .engine_name(c"linklight")
                .api_version(vk::API_VERSION_1_3);
            // Newer layers see hazards between shader accesses only when asked to by this setting; older layers and
            // loaders do not know the struct and pass over it (so the extension of that name is not enabled).
            let on = vk::TRUE;
            let mut heuristic = vk::LayerSettingEXT::default()
                .layer_name(VALIDATION_LAYER)
                .setting_name(c"syncval_shader_accesses_heuristic")
                .ty(vk::LayerSettingTypeEXT::BOOL32);
            heuristic.value_count = 1;
            heuristic.p_values = (&raw const on).cast();
            let settings = [heuristic];
            let mut layer_settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
            let mut enables = vec![vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
            if options.gpu_assisted {
                enables.push(vk::ValidationFeatureEnableEXT::GPU_ASSISTED);
                enables.push(vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT);
            }
            if options.best_practices {
                enables.push(vk::ValidationFeatureEnableEXT::BEST_PRACTICES);
            }
            let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enables);
            let mut create = vk::InstanceCreateInfo::default()
                .application_info(&app)
                .enabled_layer_names(&layer_names)
                .enabled_extension_names(&extensions);
            if validation {
                create = create.push_next(&mut features).push_next(&mut layer_settings);
            }
            let messages = MessageLog::default();
            let callback_log = Box::new(messages.clone());
            let mut info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                .message_severity(
                    vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
                )
                .message_type(
                    vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
                )
                .pfn_user_callback(Some(on_message))
                .user_data(std::ptr::from_ref::<MessageLog>(&callback_log).cast_mut().cast::<c_void>());
            // Also for what is said while the instance is made and unmade: objects that were left behind.
            let for_messenger = info;
            if validation {
                create = create.push_next(&mut info);
            }
            let raw = entry.create_instance(&create, None).map_err(|e| match e {
                vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                    GpuError::from_call("vkCreateInstance", e, "start")
                }
                e => GpuError::NoLoader(format!("vkCreateInstance: {e:?}")),
            })?;

            let messenger = if validation {
                let extension = ext::debug_utils::Instance::new(&entry, &raw);
                match extension.create_debug_utils_messenger(&for_messenger, None) {
                    Ok(messenger) => Some((extension, messenger)),
                    Err(error) => {
                        raw.destroy_instance(None);
                        return Err(GpuError::from_call("vkCreateDebugUtilsMessengerEXT", error, "start"));
                    }
                }
            } else {
                None
            };
            let surface = presents.then(|| khr::surface::Instance::new(&entry, &raw));
            Ok(Self {
                raw,
                validation,
                surface,
                messages,
                has_debug_utils,
                messenger,
                _callback_log: callback_log,
                entry,
                _loader: loader,
            })
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: devices hold an Arc of the instance, so none is left; the messenger goes first.
        unsafe {
            if let Some((loader, messenger)) = &self.messenger {
                loader.destroy_debug_utils_messenger(*messenger, None);
            }
            self.raw.destroy_instance(None);
        }
        faults::complain(std::mem::take(&mut *lock(&self.messages)));
    }
}

unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    log: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid callback data, and our user data is the boxed log that outlives the messenger.
    let (text, log) = unsafe {
        let text = (*data).message_as_c_str().map(|m| m.to_string_lossy().into_owned()).unwrap_or_default();
        (text, &*log.cast::<MessageLog>())
    };
    if severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) {
        tracing::error!("validation: {text}");
    } else {
        tracing::warn!("validation: {text}");
    }
    if let Ok(mut log) = log.lock() {
        log.push(text);
    }
    vk::FALSE
}
