//! A glossy bounce for each texel of an atlas, towards the eye: the atlas as a picture of itself, gathered pixel by pixel.
//!                                                                                        [Ritschel2008 4.4, Fig. 17]
//!
//! The lightmap shows what arrives at a texel by its diffuse reflectance; what shines there is another light for each eye.
//! Texels stand in the G-buffer of the final gather with their specular lobe alone, and so it sees by whatever pixels see by.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use super::PixelView;
use super::direct::Sample;
use super::final_gather::{FinalGather, Gathered, Settings};
use super::g_buffer::GBuffer;
use super::lightmap::Gloss;
use crate::gpu::shaders::display::{AtlasSurfaces, AtlasSurfacesParams};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::report::tonemap::ToneSettings;
use crate::scene::atlas::Atlas;
use crate::stages::film::Film;
use crate::stages::texels::Texels;
use glam::UVec2;

/// The atlas as a picture.
pub struct GlossyTexels {
    g_buffer: GBuffer,
    texel_at: Buffer<u32>,
    gather: FinalGather,
    film: Film,
}

impl GlossyTexels {
    pub fn new(
        context: &Context,
        atlas: &Atlas,
        settings: Settings,
        tone: ToneSettings,
        seed: u32,
    ) -> Result<Self, GpuError> {
        let side = atlas.resolution;
        Ok(Self {
            g_buffer: GBuffer::new(context, side, side)?,
            texel_at: context.upload("glossy texels/texel at", &atlas.texel_at)?,
            gather: FinalGather::new(context, [side, side], settings, tone, seed)?,
            film: Film::new(context, side, side)?,
        })
    }

    /// What the texels send to the eye by their specular lobes, as drawn last.
    pub fn gloss(&self) -> Gloss<'_> {
        Gloss { direct: &self.film.direct, indirect: &self.film.indirect }
    }

    /// Takes the mean of so many samples of what the texels gather; `from` says from what, and for which view.
    pub fn draw(&self, recorder: &mut Recorder<'_>, texels: &Texels, from: Gathered<'_>, samples: u32) {
        let side = self.film.width;
        let view = PixelView::new(from.view, UVec2::splat(side), 0, 1);
        recorder.scope("glossy texels", |recorder| {
            let pass = AtlasSurfaces {
                texel_at: &self.texel_at,
                texels: &texels.texels,
                parts: &texels.parts,
                gloss: &texels.gloss,
                visible_triangles: &self.g_buffer.visible_triangles,
                g_position: &self.g_buffer.position,
                g_normal: &self.g_buffer.normal,
                g_albedo: &self.g_buffer.albedo,
                g_specular: &self.g_buffer.specular,
                g_emission: &self.g_buffer.emission,
                params: AtlasSurfacesParams { eye: view.eye, resolution: side },
            };
            recorder.dispatch(&pass, [side, side]);
            recorder.fill(&self.film.direct, 0);
            recorder.fill(&self.film.indirect, 0);
            let from = Gathered { g_buffer: &self.g_buffer, ..from };
            for index in 0..samples {
                self.gather.gather(recorder, &from, &view, Sample { index, samples, is_unlit: false }, &self.film);
            }
        });
    }
}
