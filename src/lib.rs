//! **linklight**: a Vulkan-native global-illumination renderer.
pub mod gpu;
pub mod scene;
pub mod stages;
