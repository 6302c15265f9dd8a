//! Tone mapping on the device: what a display shows of a film, into an image. [`crate::report::tonemap`] is its twin.
//!
//! The film's log-average luminance is summed in a fixed order, so the same film gives the same bits.

use crate::gpu::shaders::tone_map::{
    Apply, ApplyParams, AverageLuminance, AverageLuminanceParams, SumLuminance, SumLuminanceParams,
};
use crate::gpu::{Buffer, Context, GpuError, Image, Recorder, Threads};
use crate::report::tonemap::{Operator, ToneSettings};
use crate::stages::film::Film;
use glam::{UVec2, Vec2};

/// Pixels that one workgroup sums.
const BLOCK: u32 = 4096;

/// Which light of a film is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LightParts {
    #[default]
    All,
    DirectOnly,
    IndirectOnly,
}

impl LightParts {
    /// As records name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::DirectOnly => "direct",
            Self::IndirectOnly => "indirect",
        }
    }
}

/// Scratch memory of the sums, for films of up to a number of pixels.
pub struct ToneMapping {
    /// (lit pixels, sum) per block.
    sums: Buffer<Vec2>,
    /// Floor of luminance, log-average luminance.
    average: Buffer<f32>,
    pixels: u32,
}

impl ToneMapping {
    pub fn new(context: &Context, pixels: u32) -> Result<Self, GpuError> {
        Ok(Self {
            sums: context.buffer("tone map/sums", pixels.div_ceil(BLOCK) as usize)?,
            average: context.buffer("tone map/average", 2)?,
            pixels,
        })
    }

    /// The largest film it can show, pixels.
    pub fn pixels(&self) -> u32 {
        self.pixels
    }

    /// The log-average luminance of the film last drawn.
    pub fn log_average(&self, context: &Context) -> Result<f32, GpuError> {
        Ok(context.download(&self.average)?[1])
    }

    /// Draws `parts` of `film` into `frame`, its top left pixel at `corner`; what lies beyond the frame is cut off.
    pub fn draw(
        &self,
        recorder: &mut Recorder<'_>,
        film: &Film,
        parts: LightParts,
        tone: ToneSettings,
        frame: &Image,
        corner: UVec2,
    ) {
        let Film { direct, indirect, .. } = film;
        let (sums, average) = (&self.sums, &self.average);
        let pixel_count = film.pixel_count().min(self.pixels);
        let block_count = pixel_count.div_ceil(BLOCK);
        let light_parts = parts as u32;
        // The floor first, which the logarithms need.
        for is_logarithm in [0, 1] {
            let params = SumLuminanceParams { pixel_count, light_parts, is_logarithm };
            recorder.dispatch(
                &SumLuminance { direct, indirect, average, sums, params },
                Threads::Linear(block_count.saturating_mul(256)),
            );
            let params = AverageLuminanceParams { block_count, is_logarithm };
            recorder.dispatch(&AverageLuminance { sums, average, params }, 256u32);
        }
        let params = ApplyParams {
            film_size: UVec2::new(film.width, film.height),
            corner,
            light_parts,
            operator: match tone.operator {
                Operator::Reinhard => 0,
                Operator::Filmic => 1,
                Operator::None => 2,
            },
            exposure: tone.exposure.exp2(),
            key: tone.key,
            white: tone.white,
        };
        recorder.dispatch(&Apply { direct, indirect, average, frame, params }, [film.width, film.height]);
    }
}
