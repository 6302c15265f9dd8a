//! Two pictures of one state: another method, or the reference, beside the picture or taken from it.
//!
//! The renderer makes the other picture whenever nothing more urgent is asked for. The reference starts with a few paths
//! a pixel and doubles them for as long as it is looked at. Figures are those of [`crate::report::errors`]; the light of
//! each bounce is the mean over small pictures of fewer bounces, by both.

use std::sync::Arc;

use egui::{ComboBox, Ui};
use glam::Vec3;

use super::engine::Engine;
use crate::app::AppError;
use crate::app::cli::Display;
use crate::app::render::RenderRequest;
use crate::gpu::Context;
use crate::methods::{METHODS, Method};
use crate::report::errors::relative_mse;
use crate::report::heat_map;
use crate::report::tonemap::srgb_decode;
use crate::stages::film::Film;
use crate::stages::work::Watch;

/// Paths a pixel of the first and of the finest reference.
const FIRST_SPP: u32 = 8;
const FINEST_SPP: u32 = 8192;
/// Width of the pictures whose light is told by bounce, pixels, and their samples.
const BOUNCE_WIDTH: u32 = 64;
const BOUNCE_PATHS: u32 = 64;
const BOUNCE_SAMPLES: u32 = 16;
const BOUNCE_GATHERS: u32 = 2;
/// Relative error that the difference shows as bright as it can.
const BRIGHTEST: f32 = 1.0;

/// What the picture is compared with: a method, the reference by its paths if that is path tracing.
pub type Against = &'static Method;

/// How two pictures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Layout {
    #[default]
    SideBySide,
    /// Relative error by pixel: black none, bright 1 and more.
    Difference,
}

/// What the user chose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Comparison {
    pub against: Option<Against>,
    pub layout: Layout,
}

impl Comparison {
    pub fn is_side_by_side(self) -> bool {
        self.against.is_some() && self.layout == Layout::SideBySide
    }

    /// The choice as widgets.
    pub fn rows(&mut self, ui: &mut Ui) {
        let name = self.against.map_or("nothing", title);
        ComboBox::from_label("compare with").selected_text(name).show_ui(ui, |ui| {
            ui.selectable_value(&mut self.against, None, "nothing");
            for method in METHODS {
                ui.selectable_value(&mut self.against, Some(method), title(method)).on_hover_text(method.summary);
            }
        });
        if self.against.is_some() {
            ui.horizontal(|ui| {
                ui.selectable_value(&mut self.layout, Layout::SideBySide, "side by side");
                ui.selectable_value(&mut self.layout, Layout::Difference, "difference");
            });
        }
    }
}

/// As the panel calls it.
fn title(method: Against) -> &'static str {
    if method.key == "path-tracing" { "the reference" } else { method.key }
}

/// Another picture that is wanted.
#[derive(Clone)]
pub struct OtherJob {
    /// Of the picture it is compared with.
    pub own: RenderRequest,
    pub other: RenderRequest,
    step: Step,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Picture,
    Bounces,
    /// The picture again, of more paths.
    Refine,
}

/// The other picture, and how far the picture is from it.
#[derive(Clone)]
pub struct Compared {
    pub own: RenderRequest,
    pub film: Arc<Film>,
    /// Relative error as colours, of encoded values.
    pub difference: Arc<Film>,
    pub key: &'static str,
    /// Paths a pixel of the reference; samples of others.
    pub spp: u32,
    pub relative_mse: Option<f64>,
    /// Mean of the picture over that of the other.
    pub mean_ratio: Option<f64>,
    /// By bounce, direct light first: mean radiance of the picture and of the other.
    pub bounces: Vec<[f64; 2]>,
}

impl OtherJob {
    pub fn new(own: RenderRequest, mut other: RenderRequest) -> Self {
        if other.method.key == "path-tracing" {
            other.spp = FIRST_SPP;
        }
        Self { own, other, step: Step::Picture }
    }

    /// Does the next step of it with `engine`; `ours` renders the picture itself, into `film`. Returns what there is now
    /// and what is to be done next.
    pub fn work(
        mut self,
        context: &Context,
        (ours, engine): (&mut Engine<'_>, &mut Engine<'_>),
        film: &Film,
        before: Option<&Compared>,
        watch: &dyn Watch,
    ) -> Result<(Option<Compared>, Option<Self>), AppError> {
        if self.step == Step::Bounces {
            let own = bounce_means(context, ours, &self.own, watch)?;
            let other = bounce_means(context, engine, &self.other, watch)?;
            let compared = before.map(|before| {
                let bounces = own.into_iter().zip(other).map(|(own, other)| [own, other]).collect();
                Compared { bounces, ..before.clone() }
            });
            self.step = Step::Refine;
            let goes_on = self.other.method.key == "path-tracing";
            return Ok((compared, goes_on.then_some(self)));
        }
        let is_first = self.step == Step::Picture;
        if !is_first {
            self.other.spp = self.other.spp.saturating_mul(2).min(FINEST_SPP);
        }
        let other = engine.render(&self.other, watch)?;
        let [a, b] = [pixels(context, film)?, pixels(context, &other)?];
        let (figure, errors) = relative_mse(&a, &b);
        let compared = Compared {
            own: self.own.clone(),
            difference: Arc::new(colored(context, &other, &errors)?),
            film: other,
            key: self.other.method.key,
            spp: self.other.spp,
            relative_mse: figure,
            mean_ratio: Some(mean(&a) / mean(&b)).filter(|ratio| ratio.is_finite()),
            bounces: before.filter(|_| !is_first).map(|before| before.bounces.clone()).unwrap_or_default(),
        };
        self.step = if is_first { Step::Bounces } else { Step::Refine };
        let goes_on = is_first || self.other.spp < FINEST_SPP;
        Ok((Some(compared), goes_on.then_some(self)))
    }
}

impl Compared {
    /// Figures, for the panel.
    pub fn rows(&self, ui: &mut Ui) {
        let told = |figure: Option<f64>| figure.map_or("undefined".to_owned(), |figure| format!("{figure:.4}"));
        ui.label(format!("{} of {} samples a pixel", self.key, self.spp));
        ui.label(format!("relative MSE {}, energy {}", told(self.relative_mse), told(self.mean_ratio)));
        for (bounce, [own, other]) in self.bounces.iter().enumerate() {
            let name = if bounce == 0 { "direct".to_owned() } else { format!("bounce {bounce}") };
            let ratio = if *other > 0.0 { format!("{:.3}", own / other) } else { "-".to_owned() };
            ui.monospace(format!("{name:9} {own:9.3e} / {other:9.3e} = {ratio}"));
        }
    }
}

/// All light of a film.
fn pixels(context: &Context, film: &Film) -> Result<Vec<Vec3>, AppError> {
    let (direct, indirect) = (context.download(&film.direct)?, context.download(&film.indirect)?);
    Ok(direct.into_iter().zip(indirect).map(|(direct, indirect)| direct + indirect).collect())
}

fn mean(pixels: &[Vec3]) -> f64 {
    pixels.iter().map(|pixel| f64::from(pixel.element_sum())).sum::<f64>() / (3 * pixels.len().max(1)) as f64
}

/// What each bounce adds to a small picture, direct light first.
fn bounce_means(
    context: &Context,
    engine: &mut Engine<'_>,
    request: &RenderRequest,
    watch: &dyn Watch,
) -> Result<Vec<f64>, AppError> {
    let width = request.width.min(BOUNCE_WIDTH);
    let height = (request.height * width / request.width.max(1)).max(1);
    let spp = match request.display {
        None => BOUNCE_PATHS,
        Some(Display::FinalGather) => BOUNCE_GATHERS,
        Some(_) => BOUNCE_SAMPLES,
    };
    let mut sums = Vec::new();
    for bounces in 0..=request.bounces {
        let small = RenderRequest { width, height, spp, bounces, ..request.clone() };
        let film = engine.render(&small, watch)?;
        sums.push(mean(&pixels(context, &film)?));
    }
    Ok((0..sums.len()).map(|k| sums[k] - if k > 0 { sums[k - 1] } else { 0.0 }).collect())
}

/// A film of the size of `like` that shows errors as colours when it is encoded without a tone curve.
fn colored(context: &Context, like: &Film, errors: &[f32]) -> Result<Film, AppError> {
    let film = Film::new(context, like.width, like.height)?;
    let decoded = |byte: u8| srgb_decode(f32::from(byte) / 255.0);
    let scaled: Vec<f32> = errors.iter().map(|error| error / BRIGHTEST).collect();
    let colors: Vec<Vec3> = heat_map::to_bytes(&scaled)
        .chunks_exact(3)
        .map(|bytes| Vec3::new(decoded(bytes[0]), decoded(bytes[1]), decoded(bytes[2])))
        .collect();
    context.write(&film.direct, &colors)?;
    context.write(&film.indirect, &vec![Vec3::ZERO; colors.len()])?;
    Ok(film)
}
