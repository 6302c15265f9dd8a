//! The G-buffer: a raster pass finds the triangle each pixel sees, a compute pass evaluates the surface there.

use super::PixelView;
use crate::gpu::shaders::display::{GBuffer as Resolve, GBufferParams, VisibleTriangles, VisibleTrianglesParams};
use crate::gpu::{
    Context, Format, GpuError, Image, ImageDescription, Load, RasterState, Recorder, Sampled, Sampler,
    SamplerDescription, Shape, Target,
};
use crate::stages::world::World;

/// Images of one size; what each holds is said in `glsl/display/g_buffer.comp`.
pub struct GBuffer {
    /// Triangle index + 1; 0 is the background.
    pub visible_triangles: Image,
    pub position: Image,
    pub normal: Image,
    pub albedo: Image,
    pub specular: Image,
    pub emission: Image,
    depth: Image,
    /// Reads single texels.
    pub sampler: Sampler,
}

impl GBuffer {
    pub fn new(context: &Context, width: u32, height: u32) -> Result<Self, GpuError> {
        let image = |name: &str, format| {
            let name = &format!("g-buffer/{name}");
            context.image(&ImageDescription {
                name,
                width,
                height,
                layers: 1,
                mip_levels: 1,
                format,
                shape: Shape::Flat,
            })
        };
        Ok(Self {
            visible_triangles: image("visible triangles", Format::R32Uint)?,
            position: image("position", Format::Rgba32Float)?,
            normal: image("normal", Format::Rgba32Float)?,
            albedo: image("albedo", Format::Rgba32Float)?,
            specular: image("specular", Format::Rgba32Float)?,
            emission: image("emission", Format::Rgba32Float)?,
            depth: image("depth", Format::Depth32)?,
            sampler: context.sampler("g-buffer/texels", SamplerDescription::NEAREST_CLAMP)?,
        })
    }

    /// Draws the world as `view` sees it.
    pub fn draw(&self, recorder: &mut Recorder<'_>, world: &World, view: &PixelView) {
        recorder.scope("g-buffer", |recorder| {
            let visible = VisibleTriangles {
                triangles: &world.triangles,
                positions: &world.positions,
                attributes: &world.attributes,
                triangle_materials: &world.triangle_materials,
                materials: &world.materials,
                textures: &world.textures,
                params: VisibleTrianglesParams { clip_from_world: view.clip_from_world.to_cols_array_2d() },
            };
            let target = Target {
                color: vec![(&self.visible_triangles, Load::Clear([0.0; 4]))],
                depth: Some((&self.depth, 0, Load::Clear([0.0; 4]))),
            };
            let state = RasterState { depth_test: true, ..RasterState::default() };
            recorder.draw(&visible, &target, state, 3 * world.triangle_count, 1);

            let resolve = Resolve {
                visible_triangles: self.sampled(&self.visible_triangles),
                triangles: &world.triangles,
                positions: &world.positions,
                normals: &world.normals,
                tangents: &world.tangents,
                attributes: &world.attributes,
                triangle_materials: &world.triangle_materials,
                materials: &world.materials,
                g_position: &self.position,
                g_normal: &self.normal,
                g_albedo: &self.albedo,
                g_specular: &self.specular,
                g_emission: &self.emission,
                textures: &world.textures,
                params: GBufferParams {
                    clip_from_world: view.clip_from_world.to_cols_array_2d(),
                    eye: view.eye,
                    footprint: view.footprint,
                },
            };
            recorder.dispatch(&resolve, [self.position.width, self.position.height]);
        });
    }

    /// An image of this buffer for reading by texel.
    pub fn sampled<'a>(&'a self, image: &'a Image) -> Sampled<'a> {
        Sampled { image, sampler: &self.sampler }
    }
}
