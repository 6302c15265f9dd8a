//! The view as shaders read it: `lib/view.glsl` makes the rays of [`View::ray`].

use crate::gpu::shaders::types::ViewInfo;
use crate::scene::camera::{Lens, View};

impl From<&View> for ViewInfo {
    fn from(view: &View) -> Self {
        let (half_extent, is_orthographic) = match view.lens {
            Lens::Perspective { tan_half } => (tan_half, 0),
            Lens::Orthographic { half_extent } => (half_extent, 1),
        };
        Self {
            position: view.position,
            right: view.right,
            up: view.up,
            forward: view.forward,
            half_extent,
            near: view.near,
            far: view.far.unwrap_or(f32::INFINITY),
            is_orthographic,
        }
    }
}
