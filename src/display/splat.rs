//! Splatting display: flat patches as rectangles that fade into one another, everything else between vertices; punctual
//! light per pixel by shadow maps.                                                        [Dachsbacher2007 4.3]
//!
//! Three passes: which surface each pixel sees (the G-buffer's triangles, by the surface of each); the patches' light, the
//! mean over their vertices, weighted; the sums divided by the weights. Light is thus shown where it was computed, at the
//! patches' centres.
//!
//! [Dachsbacher2007]: crate::methods::PAPERS

use super::PixelView;
use super::direct::{Canvas, Lighting};
use super::vertex::VertexLight;
use crate::gpu::shaders::display::{
    Splat, SplatLight as LightOfSplats, SplatLightParams, SplatNormalize, SplatNormalizeParams, SplatParams,
};
use crate::gpu::{
    Blend, Context, Format, GpuError, Image, ImageDescription, Load, RasterState, Recorder, Shape, Target,
};
use crate::stages::splats::Splats;

/// Corners of the two triangles of a splat: `SPLAT_CORNERS` of `lib/splat.glsl`.
const CORNERS: u32 = 6;

/// Sums of weighted irradiance by pixel, W/m2, with the weights.
pub struct SplatSums {
    direct: Image,
    indirect: Image,
}

impl SplatSums {
    pub fn new(context: &Context, width: u32, height: u32) -> Result<Self, GpuError> {
        let image = |name| {
            let (format, shape) = (Format::Rgba32Float, Shape::Flat);
            context.image(&ImageDescription { name, width, height, layers: 1, mip_levels: 1, format, shape })
        };
        Ok(Self { direct: image("splats/direct")?, indirect: image("splats/indirect")? })
    }
}

/// What the display draws.
#[derive(Clone, Copy)]
pub struct SplatLight<'a> {
    pub vertices: VertexLight<'a>,
    pub splats: &'a Splats,
    pub sums: &'a SplatSums,
}

/// Fills the canvas' film.
pub fn draw(recorder: &mut Recorder<'_>, light: SplatLight<'_>, canvas: Canvas<'_>) {
    canvas.draw(recorder, false, |recorder, pixel_view, weight| add(recorder, light, canvas, pixel_view, weight));
}

/// What a sample adds to the film, the G-buffer being drawn.
pub fn add(
    recorder: &mut Recorder<'_>,
    light: SplatLight<'_>,
    canvas: Canvas<'_>,
    pixel_view: &PixelView,
    weight: f32,
) {
    let Canvas { lighting: Lighting { world, g_buffer, .. }, film, .. } = canvas;
    let SplatLight { vertices, splats, sums } = light;
    let light_of_splats = LightOfSplats {
        splats: &splats.splats,
        shares: &splats.shares,
        back_elements: vertices.back_elements,
        direct_irradiance: vertices.direct_irradiance,
        indirect_irradiance: vertices.indirect_irradiance,
        splat_light: &splats.light,
        params: SplatLightParams { splat_count: splats.count },
    };
    recorder.dispatch(&light_of_splats, splats.count);
    let splat = Splat {
        splats: &splats.splats,
        visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
        g_position: g_buffer.sampled(&g_buffer.position),
        triangle_surfaces: &splats.triangle_surfaces,
        splat_light: &splats.light,
        params: SplatParams { clip_from_world: pixel_view.clip_from_world.to_cols_array_2d(), eye: pixel_view.eye },
    };
    let clear = Load::Clear([0.0; 4]);
    let target = Target { color: vec![(&sums.direct, clear), (&sums.indirect, clear)], depth: None };
    let state = RasterState { blend: Blend::Add, ..RasterState::default() };
    recorder.draw(&splat, &target, state, CORNERS, splats.count);
    let normalize = SplatNormalize {
        visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
        g_position: g_buffer.sampled(&g_buffer.position),
        g_normal: g_buffer.sampled(&g_buffer.normal),
        g_albedo: g_buffer.sampled(&g_buffer.albedo),
        g_specular: g_buffer.sampled(&g_buffer.specular),
        g_emission: g_buffer.sampled(&g_buffer.emission),
        triangles: &world.triangles,
        positions: &world.positions,
        direct_irradiance: vertices.direct_irradiance,
        indirect_irradiance: vertices.indirect_irradiance,
        back_elements: vertices.back_elements,
        direct: &film.direct,
        indirect: &film.indirect,
        direct_splats: g_buffer.sampled(&sums.direct),
        indirect_splats: g_buffer.sampled(&sums.indirect),
        params: SplatNormalizeParams { eye: pixel_view.eye, weight },
    };
    recorder.dispatch(&normalize, [film.width, film.height]);
}
