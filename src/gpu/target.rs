//! What a raster pass draws into, and that it fits together.

use super::image::Image;
use ash::vk;

/// What an attachment holds before the first draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Load {
    Keep,
    Clear([f32; 4]),
}

/// What a raster pass draws into: images of one size.
pub struct Target<'a> {
    pub color: Vec<(&'a Image, Load)>,
    /// Depth image, layer, load.
    pub depth: Option<(&'a Image, u32, Load)>,
}

impl Target<'_> {
    /// The size that all its images have, or what is wrong with them.
    pub(super) fn extent(&self) -> Result<(u32, u32), String> {
        let depth = self.depth.map(|(image, ..)| image);
        let mut images = self.color.iter().map(|(image, _)| *image).chain(depth);
        let first = images.next().ok_or("nothing to draw into")?;
        let extent = (first.width, first.height);
        if let Some(other) = images.find(|image| (image.width, image.height) != extent) {
            let (a, b) = (first.name(), other.name());
            return Err(format!(
                "`{a}` is {extent:?} pixels and `{b}` {:?}; draw into images of one size",
                (other.width, other.height)
            ));
        }
        let mut ids: Vec<u64> = self.color.iter().map(|(image, _)| image.id()).collect();
        ids.sort_unstable();
        if ids.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err("an image is drawn into twice at once".into());
        }
        if let Some((image, _)) = self.color.iter().find(|(image, _)| image.format.is_depth()) {
            return Err(format!("`{}` is a depth image, drawn into as colour", image.name()));
        }
        match self.depth {
            Some((image, layer, _)) if layer >= image.layers || !image.format.is_depth() => Err(format!(
                "layer {layer} of `{}` ({} layers of {:?}) is no depth",
                image.name(),
                image.layers,
                image.format
            )),
            _ => Ok(extent),
        }
    }

    pub(super) fn size_bytes(&self) -> u64 {
        let color: u64 = self.color.iter().map(|(image, _)| image.size_bytes()).sum();
        color + self.depth.map_or(0, |(image, ..)| image.size_bytes() / u64::from(image.layers))
    }
}

/// An attachment of that view.
pub(super) fn attachment(view: vk::ImageView, load: Load, depth: bool) -> vk::RenderingAttachmentInfo<'static> {
    let (op, value) = match load {
        Load::Keep => (vk::AttachmentLoadOp::LOAD, [0.0; 4]),
        Load::Clear(value) => (vk::AttachmentLoadOp::CLEAR, value),
    };
    let clear = if depth {
        vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: value[0], stencil: 0 } }
    } else {
        vk::ClearValue { color: vk::ClearColorValue { float32: value } }
    };
    vk::RenderingAttachmentInfo::default()
        .image_view(view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(op)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(clear)
}
