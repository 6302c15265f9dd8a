//! Lightmap display: punctual light per pixel by shadow maps, all other light from the atlas, filtered.
//!
//! The filter is the uniform cubic B-spline over the texels of the chart that is seen; texels of other charts and empty
//! ones are left out, so that nothing bleeds in over the border.

use super::PixelView;
use super::direct::{Canvas, Lighting};
use crate::gpu::shaders::display::{Lightmap as Pass, LightmapParams};
use crate::gpu::shaders::types::{AtlasTexel, TriangleCorners};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::report::image::{Picture, PictureError};
use crate::scene::atlas::{Atlas, NO_TEXEL};
use crate::stages::texels;
use glam::Vec3;

/// Where things lie in the atlas.
pub struct Lightmap {
    resolution: u32,
    triangle_count: u32,
    corner_places: Buffer<TriangleCorners>,
    texel_at: Buffer<u32>,
    texel_charts: Buffer<u32>,
    texels: Buffer<AtlasTexel>,
}

/// What a method offers per texel, W/m2; punctual lights are added per pixel.
#[derive(Clone, Copy)]
pub struct TexelLight<'a> {
    /// From emitters and the environment, unreflected.
    pub direct_irradiance: &'a Buffer<Vec3>,
    /// Reflected at least once.
    pub indirect_irradiance: &'a Buffer<Vec3>,
    /// What the texels send to the eye by their specular lobes; without it, these reflect as if light came evenly.
    pub gloss: Option<Gloss<'a>>,
}

/// By place of the atlas, W m^-2 sr^-1 towards the eye.
#[derive(Clone, Copy)]
pub struct Gloss<'a> {
    pub direct: &'a Buffer<Vec3>,
    pub indirect: &'a Buffer<Vec3>,
}

impl Lightmap {
    pub fn new(context: &Context, atlas: &Atlas) -> Result<Self, GpuError> {
        let places = atlas.corner_places.iter().flatten();
        let places: Vec<TriangleCorners> = places.map(|&[a, b, c]| TriangleCorners { a, b, c }).collect();
        let charts: Vec<u32> = atlas.texels.iter().map(|texel| texel.chart).collect();
        Ok(Self {
            resolution: atlas.resolution,
            triangle_count: atlas.corner_places[0].len() as u32,
            corner_places: context.upload("lightmap/corner places", &places)?,
            texel_at: context.upload("lightmap/texel at", &atlas.texel_at)?,
            texel_charts: context.upload("lightmap/texel charts", &charts)?,
            texels: context.upload("lightmap/texels", &texels::receivers(atlas))?,
        })
    }

    /// Fills the canvas' film.
    pub fn draw(&self, recorder: &mut Recorder<'_>, light: TexelLight<'_>, canvas: Canvas<'_>) {
        canvas.draw(recorder, false, |recorder, pixel_view, weight| {
            self.add(recorder, light, canvas, pixel_view, weight);
        });
    }

    /// What a sample adds to the film, the G-buffer being drawn.
    pub fn add(
        &self,
        recorder: &mut Recorder<'_>,
        light: TexelLight<'_>,
        canvas: Canvas<'_>,
        pixel_view: &PixelView,
        weight: f32,
    ) {
        let Canvas { lighting: Lighting { world, g_buffer, .. }, film, .. } = canvas;
        let pass = Pass {
            visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
            g_position: g_buffer.sampled(&g_buffer.position),
            g_normal: g_buffer.sampled(&g_buffer.normal),
            g_albedo: g_buffer.sampled(&g_buffer.albedo),
            g_specular: g_buffer.sampled(&g_buffer.specular),
            g_emission: g_buffer.sampled(&g_buffer.emission),
            triangles: &world.triangles,
            positions: &world.positions,
            corner_places: &self.corner_places,
            texel_at: &self.texel_at,
            texel_charts: &self.texel_charts,
            direct_irradiance: light.direct_irradiance,
            indirect_irradiance: light.indirect_irradiance,
            texels: &self.texels,
            direct_gloss: light.gloss.map_or(light.direct_irradiance, |gloss| gloss.direct),
            indirect_gloss: light.gloss.map_or(light.indirect_irradiance, |gloss| gloss.indirect),
            direct: &film.direct,
            indirect: &film.indirect,
            params: LightmapParams {
                has_gloss: u32::from(light.gloss.is_some()),
                eye: pixel_view.eye,
                weight,
                resolution: self.resolution,
                triangle_count: self.triangle_count,
            },
        };
        recorder.dispatch(&pass, [film.width, film.height]);
    }
}

/// The atlas as a picture: irradiance of each texel (W/m2), black where there is none; and the places that are filled as
/// the channel `coverage`.
pub fn picture(atlas: &Atlas, irradiance: &[Vec3]) -> Result<Picture, PictureError> {
    let resolution = atlas.resolution;
    let at = |place: &u32| if *place == NO_TEXEL { Vec3::ZERO } else { irradiance[*place as usize] };
    let mut picture = Picture::new(resolution, resolution, atlas.texel_at.iter().map(at).collect())?;
    let coverage = atlas.texel_at.iter().map(|&place| f32::from(u8::from(place != NO_TEXEL)));
    picture.add_channel("coverage", coverage.collect())?;
    Ok(picture)
}
