//! What shiny texels send each other: their lobes' light along bins over their hemispheres.
//!
//! A bounce draws what arrives at a shiny texel into the bins of its hemisphere; its lobe is laid over them, and the tree
//! takes over what is sent along each bin. What an eye or a receiver then sees of it is looked up between four bins.
//!
//! Differs from [Ritschel2008]: there all senders are Lambertian; other ones are their future work.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use super::{SurfaceShadowMaps, passes};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::stages::shiny_texels::ShinyTexels;
use crate::stages::texels::Texels;
use glam::Vec3;

/// Reflectances of all texels (1), and what shiny ones send by row and bin (W m^-2 sr^-1, shared exponents).
pub(super) struct Gloss {
    pub shiny: ShinyTexels,
    /// Of even light, all lobes.
    pub reflectance: Buffer<Vec3>,
    /// The part of it that is sent on evenly.
    pub even_albedo: Buffer<Vec3>,
    /// Of the last bounce.
    sent: Buffer<u32>,
    sent_sum: Buffer<u32>,
    /// Of the sum, what left before the last bounce.
    sent_before: Buffer<u32>,
}

impl Gloss {
    pub fn new(context: &Context, shiny: ShinyTexels) -> Result<Self, GpuError> {
        let (texels, entries) = (shiny.rows.len(), shiny.entry_count());
        Ok(Self {
            reflectance: context.buffer("surface_shadow_maps/reflectance", texels)?,
            even_albedo: context.buffer("surface_shadow_maps/even albedo", texels)?,
            sent: context.buffer("surface_shadow_maps/glossy sent", entries)?,
            sent_sum: context.buffer("surface_shadow_maps/glossy sent sum", entries)?,
            sent_before: context.buffer("surface_shadow_maps/glossy sent before", entries)?,
            shiny,
        })
    }

    fn is_empty(&self) -> bool {
        self.shiny.row_count == 0
    }

    /// Of the world's present materials; nothing is sent yet.
    pub fn begin(&self, recorder: &mut Recorder<'_>, texels: &Texels) {
        let pass = passes::Reflectances {
            albedo: &texels.albedo,
            gloss: &texels.gloss,
            glossy_rows: &self.shiny.glossy_rows,
            reflectance: &self.reflectance,
            sent_evenly: &self.even_albedo,
            params: passes::ReflectancesParams { texel_count: texels.count },
        };
        recorder.dispatch(&pass, texels.count);
        if !self.is_empty() {
            recorder.fill(&self.sent_sum, 0);
            recorder.fill(&self.sent_before, 0);
        }
    }

    pub fn keep_sum(&self, recorder: &mut Recorder<'_>) {
        if !self.is_empty() {
            recorder.copy(&self.sent_sum, &self.sent_before);
        }
    }

    /// What arrived along the bins leaves again by the lobes.
    pub fn reflect(&self, recorder: &mut Recorder<'_>, texels: &Texels) {
        if self.is_empty() {
            return;
        }
        let (row_count, side) = (self.shiny.row_count, self.shiny.side);
        let pass = passes::ReflectGloss {
            glossy_texels: &self.shiny.glossy_texels,
            gloss: &texels.gloss,
            arrived: &self.shiny.arrived,
            sent: &self.sent,
            sent_sum: &self.sent_sum,
            params: passes::ReflectGlossParams { row_count, side },
        };
        recorder.dispatch(&pass, self.shiny.entry_count() as u32);
    }
}

/// Which light fills the tree.
#[derive(Clone, Copy)]
pub(super) enum Filled {
    /// What emits.
    Emitted,
    /// What the last bounce reflected.
    Bounce,
    /// What emits and all that was reflected.
    All,
    /// ... but for the last bounce.
    BeforeLast,
}

impl SurfaceShadowMaps {
    /// Fills the tree with light of the texels.
    pub(super) fn fill(&self, recorder: &mut Recorder<'_>, light: Filled) {
        let (s, g) = (&self.state, &self.gloss);
        let (emitted, reflected, sent) = match light {
            Filled::Emitted => (&s.emitted, &s.dark, None),
            Filled::Bounce => (&s.dark, &s.reflected, Some(&g.sent)),
            Filled::All => (&s.emitted, &s.reflected_sum, Some(&g.sent_sum)),
            Filled::BeforeLast => (&s.emitted, &s.sent_before, Some(&g.sent_before)),
        };
        self.tree.pull_with(recorder, emitted, reflected, sent);
    }
}
