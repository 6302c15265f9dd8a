//! What can go wrong on the device, as one typed error.

use ash::vk;

/// An error of the GPU layer. Messages name what failed, the value seen, what was allowed and what to do.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    #[error("no Vulkan loader: {0}; install the Vulkan loader (tools/setup does) or a GPU driver")]
    NoLoader(String),
    #[error("no usable Vulkan device{}: {reasons}", .wanted.as_ref().map(|w| format!(" matches --gpu {w:?}")).unwrap_or_default())]
    NoDevice { wanted: Option<String>, reasons: String },
    #[error(
        "out of {heap} memory: {bytes} bytes for `{name}` could not be allocated ({available} bytes available); \
         lower --elements or --size, raise --max-memory where it is given, or close other programs"
    )]
    OutOfMemory { name: String, bytes: u64, available: u64, heap: &'static str },
    #[error(
        "buffer `{name}` needs {bytes} bytes, but this device binds at most {allowed} bytes (maxStorageBufferRange); \
         use a smaller scene or lower --elements"
    )]
    StorageRange { name: String, bytes: u64, allowed: u64 },
    #[error(
        "image `{name}` of {width} x {height} with {layers} layers exceeds this device's limit of {allowed} a side \
         or {allowed_layers} layers"
    )]
    ImageExtent { name: String, width: u32, height: u32, layers: u32, allowed: u32, allowed_layers: u32 },
    #[error("the device was lost in `{last_pass}`{fault}; try a smaller --size or --elements, or another --gpu")]
    DeviceLost { last_pass: String, fault: String },
    #[error(
        "the device did not finish `{last_pass}` within {seconds} s; raise --gpu-timeout, or try a smaller --size or --elements"
    )]
    Timeout { last_pass: String, seconds: f64 },
    /// Asked for something that cannot be, in whole words.
    #[error("{0}")]
    Refused(String),
    #[error("{call} failed with {result:?} in `{last_pass}`")]
    Call { call: &'static str, result: vk::Result, last_pass: String },
}

impl GpuError {
    /// True where there is no device to work with at all (exit code 3 of the command line).
    pub fn is_no_device(&self) -> bool {
        matches!(self, Self::NoLoader(_) | Self::NoDevice { .. })
    }

    /// The typed error of a failed Vulkan call made for `context` (a pass or an object's name).
    pub(super) fn from_call(call: &'static str, result: vk::Result, context: &str) -> Self {
        match result {
            vk::Result::ERROR_DEVICE_LOST => Self::DeviceLost { last_pass: context.to_owned(), fault: String::new() },
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                Self::OutOfMemory { name: context.to_owned(), bytes: 0, available: 0, heap: "device" }
            }
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                Self::OutOfMemory { name: context.to_owned(), bytes: 0, available: 0, heap: "host" }
            }
            result => Self::Call { call, result, last_pass: context.to_owned() },
        }
    }
}

/// Names the call and the object for `?`.
pub(super) trait Checked<T> {
    fn checked(self, call: &'static str, context: &str) -> Result<T, GpuError>;
}

impl<T> Checked<T> for Result<T, vk::Result> {
    fn checked(self, call: &'static str, context: &str) -> Result<T, GpuError> {
        self.map_err(|result| GpuError::from_call(call, result, context))
    }
}
