//! The Vulkan layer: hand-written, little of it, and the only folder with `unsafe` and `vk::`.
//!
//! - [`Context`] is one device; buffers, images and recorders are made from it.
//! - GLSL is the single source of layouts: [`shaders`] holds, for every shader, a generated [`Pass`] struct whose
//!   fields are the shader's bindings by name.
//! - [`Recorder::dispatch`] and [`Recorder::draw`] are the only ways to run a pass: each labels, times, counts and
//!   synchronises it from the access that the shader declares.
//!
//! - [`Presenter`] shows an image in a window.
//!
//! What it does not do: no render graph, no asynchronous queues, no buffer device addresses (captures hide them).

mod acceleration;
mod buffer;
mod capture;
mod context;
mod descriptors;
mod device;
mod error;
mod faults;
mod features;
mod hazards;
mod image;
mod indirect;
mod instance;
mod loss;
mod pass;
mod pass_hashes;
mod pipelines;
mod presenter;
mod profiler;
mod recorder;
pub mod reflection;
mod reload;
mod selection;
pub mod shader_compiler;
mod staging;
mod submission;
mod target;
mod texel_buffer;
mod transfer;

/// Passes and buffer structs made from the shaders by the build script.
#[allow(missing_docs)]
pub mod shaders {
    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}

use buffer::RawBuffer;

pub use acceleration::AccelerationStructure;
pub use buffer::Buffer;
pub use capture::{Capture, CaptureError, prepare_capture};
pub use context::{Context, Options};
pub use device::{Limits, MAX_TEXTURES, MemoryUse};
pub use error::GpuError;
pub use faults::{Failure, FaultInjection};
pub use features::OptionalFeatures;
pub use image::{AddressMode, Format, Image, ImageDescription, Sampler, SamplerDescription, Shape, TextureTable};
pub use indirect::GroupCounts;
pub use loss::{Fault, Loss, LossHook, LossPoint, QueueMarkers};
pub use pass::{BindingInfo, Bindings, Pass, Program, ResourceKind, Sampled, Stage, StageKind};
pub use pass_hashes::PassHash;
pub use pipelines::{Blend, Cull, RasterState};
pub use presenter::{Presenter, WindowSource};
pub use profiler::{ClockPair, Cost, PassRecord};
pub use recorder::{Recorder, Threads};
pub use reload::{Reload, ShaderWatcher, reload};
pub use selection::{DeviceInfo, choose_device, list_devices};
pub use target::{Load, Target};
pub use texel_buffer::TexelBuffer;
