//! The user interface over the picture: all triangles of egui in one draw, clipped in the shader.

use crate::gpu::shaders::display::{Interface as InterfacePass, InterfaceParams};
use crate::gpu::shaders::types::InterfaceCorner;
use crate::gpu::{
    Blend, Buffer, Context, Format, GpuError, Image, ImageDescription, Load, RasterState, Recorder, Sampled, Sampler,
    SamplerDescription, Shape, Target,
};
use egui::epaint::{ClippedPrimitive, ImageData, Primitive};
use glam::Vec2;

/// What the interface's pass reads; buffers grow and stay.
pub struct Interface {
    corners: Buffer<InterfaceCorner>,
    indices: Buffer<u32>,
    /// Left, top, right, bottom in pixels.
    clips: Buffer<[f32; 4]>,
    glyphs: Image,
    /// The texture's pixels, which egui sends in pieces, and their width and height.
    pixels: Vec<[u8; 4]>,
    size: [u32; 2],
    /// The device has not seen the pixels yet.
    is_changed: bool,
    sampler: Sampler,
    index_count: u32,
}

impl Interface {
    pub fn new(context: &Context) -> Result<Self, GpuError> {
        Ok(Self {
            corners: context.buffer("interface/corners", 1)?,
            indices: context.buffer("interface/indices", 1)?,
            clips: context.buffer("interface/clips", 1)?,
            glyphs: glyphs(context, [1, 1])?,
            pixels: vec![[255; 4]],
            size: [1, 1],
            is_changed: true,
            sampler: context.sampler("interface/glyphs", SamplerDescription::LINEAR_CLAMP)?,
            index_count: 0,
        })
    }

    /// Takes what egui wants painted: `primitives` at so many pixels per point.
    pub fn update(
        &mut self,
        context: &Context,
        recorder: &mut Recorder<'_>,
        primitives: &[ClippedPrimitive],
        pixels_per_point: f32,
    ) -> Result<(), GpuError> {
        self.update_glyphs(context, recorder)?;
        let (mut corners, mut indices, mut clips) = (Vec::new(), Vec::new(), Vec::new());
        for ClippedPrimitive { clip_rect, primitive } in primitives {
            let Primitive::Mesh(mesh) = primitive else { continue };
            let (clip, first) = (clips.len() as u32, corners.len() as u32);
            let corner = |at: egui::Pos2| [at.x * pixels_per_point, at.y * pixels_per_point];
            let ([left, top], [right, bottom]) = (corner(clip_rect.min), corner(clip_rect.max));
            clips.push([left.round(), top.round(), right.round(), bottom.round()]);
            corners.extend(mesh.vertices.iter().map(|vertex| InterfaceCorner {
                position: corner(vertex.pos).into(),
                uv: Vec2::new(vertex.uv.x, vertex.uv.y),
                color: u32::from_le_bytes(vertex.color.to_array()),
                clip,
            }));
            indices.extend(mesh.indices.iter().map(|&index| first + index));
        }
        grow(context, &mut self.corners, corners.len())?;
        grow(context, &mut self.indices, indices.len())?;
        grow(context, &mut self.clips, clips.len())?;
        recorder.write(&self.corners, 0, &corners);
        recorder.write(&self.indices, 0, &indices);
        recorder.write(&self.clips, 0, &clips);
        self.index_count = indices.len() as u32;
        Ok(())
    }

    /// Paints over `frame`.
    pub fn draw(&self, recorder: &mut Recorder<'_>, frame: &Image) {
        let pass = InterfacePass {
            corners: &self.corners,
            indices: &self.indices,
            clips: &self.clips,
            glyphs: Sampled { image: &self.glyphs, sampler: &self.sampler },
            params: InterfaceParams { frame_size: Vec2::new(frame.width as f32, frame.height as f32) },
        };
        let target = Target { color: vec![(frame, Load::Keep)], depth: None };
        let state = RasterState { blend: Blend::Over, ..RasterState::default() };
        recorder.draw(&pass, &target, state, self.index_count, 1);
    }

    /// Puts what egui changed of its texture into our copy. The interface uses no pictures of its own, so the only
    /// texture is the one of glyphs.
    pub fn take_textures(&mut self, mut textures: egui::TexturesDelta) {
        for delta in textures.set.remove(&egui::TextureId::default()).into_iter().flatten() {
            let ImageData::Color(image) = &delta.image;
            let [width, height] = image.size;
            match delta.pos {
                None => {
                    self.size = [width as u32, height as u32];
                    self.pixels = image.pixels.iter().map(|color| color.to_array()).collect();
                }
                Some([left, top]) => {
                    let stride = self.size[0] as usize;
                    for (row, colors) in image.pixels.chunks(width.max(1)).enumerate() {
                        let start = (top + row) * stride + left;
                        let target = self.pixels.get_mut(start..start + colors.len()).unwrap_or_default();
                        target.iter_mut().zip(colors).for_each(|(pixel, color)| *pixel = color.to_array());
                    }
                }
            }
            self.is_changed = true;
        }
        textures.clear();
    }

    fn update_glyphs(&mut self, context: &Context, recorder: &mut Recorder<'_>) -> Result<(), GpuError> {
        if std::mem::take(&mut self.is_changed) {
            if [self.glyphs.width, self.glyphs.height] != self.size {
                self.glyphs = glyphs(context, self.size)?;
            }
            recorder.write_image(&self.glyphs, 0, &self.pixels);
        }
        Ok(())
    }
}

fn glyphs(context: &Context, [width, height]: [u32; 2]) -> Result<Image, GpuError> {
    context.image(&ImageDescription {
        name: "interface/glyphs",
        width,
        height,
        layers: 1,
        mip_levels: 1,
        format: Format::Rgba8,
        shape: Shape::Flat,
    })
}

/// Makes room for `len`, and more, so that this stays rare.
fn grow<T>(context: &Context, buffer: &mut Buffer<T>, len: usize) -> Result<(), GpuError> {
    if buffer.len() < len {
        *buffer = context.buffer(buffer.name(), len.next_power_of_two())?;
    }
    Ok(())
}
