//! **linklight**: a Vulkan-native global-illumination renderer.
pub mod app;
pub mod display;
pub mod files;
pub mod gpu;
pub mod methods;
pub mod report;
pub mod scene;
pub mod stages;
