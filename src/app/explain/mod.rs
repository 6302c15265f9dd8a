//! `--explain X,Y`: the ranked list of elements, links and bounces that make up a pixel.
//!
//! | module | what |
//! |---|---|
//! | [`probe`] | what the samples of the pixel see, by the display's own passes |
//! | [`elements`] | light on elements, link by link |
//! | [`texels`] | light on the texels of an atlas |
//! | [`clusters`] | vector irradiance of face clusters |
//! | [`gathered`] | the cut of a final gather |
//! | [`bounces`] | path tracing: frames of fewer bounces |
//!
//! Weights come from the passes that drew the picture, light from the tables that the method gathered along its links;
//! both are multiplied and summed up anew on the host, and held to the pixel.
//!
//! What it does not do: it tells a pixel of light, not of a debug view.

mod bounces;
mod clusters;
mod elements;
mod gathered;
mod probe;
mod texels;

use glam::{DVec3, UVec2, Vec3};
use std::collections::BTreeMap;

use super::AppError;
use super::frame::Method;
use super::render::RenderRequest;
use super::stage::Stage;
use super::{state, views};
use crate::gpu::Context;
use crate::report::explanation::{Entry, Explanation, Light};
use crate::stages::film::Film;
use crate::stages::work::Watch;

/// Entries by light, bounce and source: links and W m^-2 sr^-1.
type Parts = BTreeMap<(Light, Option<u32>, String, String), (u32, DVec3)>;

/// What a frame was made from, and the film it is in.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    pub context: &'a Context,
    pub request: &'a RenderRequest,
    pub stage: &'a Stage,
    pub film: &'a Film,
    pub watch: &'a dyn Watch,
}

impl Frame<'_> {
    /// Of `film`: direct and indirect radiance.
    fn value(&self, film: &Film, pixel: UVec2) -> Result<[Vec3; 2], AppError> {
        let at = (pixel.y * film.width + pixel.x) as usize;
        let one = |buffer| self.context.download_range(buffer, at..at + 1).map(|all| all[0]);
        Ok([one(&film.direct)?, one(&film.indirect)?])
    }
}

/// Explains a pixel of the frame that `method` rendered last; the method's light is computed again on the way, and is
/// at the end what it was.
pub fn explain(frame: Frame<'_>, method: &mut Method, pixel: UVec2) -> Result<Explanation, AppError> {
    let Frame { request, film, .. } = frame;
    check(request, pixel)?;
    let value = frame.value(film, pixel)?;
    let mut parts = Parts::new();
    let seen = match method {
        Method::OnElements(shown) if shown.gather.is_none() => elements::explain(frame, shown, pixel, &mut parts)?,
        Method::OnTexels(shown) if shown.lightmap().is_some() => texels::explain(frame, shown, pixel, &mut parts)?,
        Method::OnClusters(shown) if shown.gather.is_none() => clusters::explain(frame, shown, pixel, &mut parts)?,
        Method::PathTracing(_) => bounces::explain(frame, method, pixel, &mut parts)?,
        _ => gathered::explain(frame, method, pixel, &mut parts)?,
    };
    let entry = |((light, bounce, source, receiver), (count, radiance))| Entry {
        light,
        bounce,
        source,
        receiver,
        count,
        radiance,
    };
    let mut explanation = Explanation {
        pixel,
        method: request.method.key.to_owned(),
        display: request.display.map(|display| state::name(&display)).unwrap_or_default(),
        seen,
        value,
        entries: parts.into_iter().map(entry).collect(),
    };
    explanation.rank();
    Ok(explanation)
}

/// Refuses what cannot be explained.
pub fn check(request: &RenderRequest, pixel: UVec2) -> Result<(), AppError> {
    let RenderRequest { width, height, .. } = request;
    if pixel.x >= *width || pixel.y >= *height {
        let UVec2 { x, y } = pixel;
        return Err(AppError::Usage(format!("--explain {x},{y}: the picture has {width} x {height} pixels")));
    }
    if views::is_shown(request) {
        return Err(AppError::Usage("--explain tells a pixel of light; leave --view (or its setting) out".into()));
    }
    Ok(())
}

/// Adds to an entry.
fn add(parts: &mut Parts, key: (Light, Option<u32>, String, String), radiance: DVec3) {
    let (count, sum) = parts.entry(key).or_default();
    *count += 1;
    *sum += radiance;
}
