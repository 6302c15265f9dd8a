//! **linklight**: a Vulkan-native global-illumination renderer.
pub mod scene;
