//! The film: what a method shows through the camera, one value per pixel and quantity.
//!
//! Direct and indirect light are apart, so that either can be shown or judged alone. It does no tone mapping and
//! writes no files.

use crate::gpu::{Buffer, Context, GpuError};
use glam::Vec3;

/// A picture on the device. Every buffer holds `width * height` values, row 0 on top.
pub struct Film {
    /// Pixels.
    pub width: u32,
    pub height: u32,
    /// Radiance (W m^-2 sr^-1, linear Rec. 709): emission seen and light reflected exactly once.
    pub direct: Buffer<Vec3>,
    /// Radiance reflected more than once.
    pub indirect: Buffer<Vec3>,
    /// Diffuse reflectance of what is seen, 0..1; black where nothing is hit.
    pub albedo: Buffer<Vec3>,
    /// World-space shading normal towards the eye, at most unit length; zero where nothing is hit.
    pub normal: Buffer<Vec3>,
    /// Metres along the pixel's ray; 0 where nothing is hit.
    pub depth: Buffer<f32>,
}

impl Film {
    /// A film with undefined content.
    pub fn new(context: &Context, width: u32, height: u32) -> Result<Self, GpuError> {
        let pixels = width as usize * height as usize;
        Ok(Self {
            width,
            height,
            direct: context.buffer("film/direct", pixels)?,
            indirect: context.buffer("film/indirect", pixels)?,
            albedo: context.buffer("film/albedo", pixels)?,
            normal: context.buffer("film/normal", pixels)?,
            depth: context.buffer("film/depth", pixels)?,
        })
    }

    pub fn pixel_count(&self) -> u32 {
        self.direct.len() as u32
    }
}
