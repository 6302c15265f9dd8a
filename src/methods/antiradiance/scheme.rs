//! The iterations: antiradiance alone until it has settled, or light and antiradiance together; and the watch over both.

use super::tables::LocalStep;
use super::{Antiradiance, AntiradianceError, Scheme};
use crate::gpu::{Context, GpuError};
use crate::stages::work::Watch;
use serde::Serialize;

/// Change of the exitant light, of the most there was, beyond which an iteration is said to grow.
const GROWTH_LIMIT: f64 = 1e4;
/// Steps over which a growth rate is estimated.
const GROWTH_STEPS: usize = 4;
/// Changes of the light below these shares are rounding: of tables in f16, and in f32.
const LEAST_CHANGE_F16: f64 = 1e-3;
const LEAST_CHANGE: f64 = 1e-5;
/// Share of a step below which the symmetric scheme gives up.
const LEAST_DAMPING: f32 = 1.0 / 16.0;
/// Steps of antiradiance alone that may rise unwatched: as many as surfaces stand one behind the other, errors grow first.
const FREE_STEPS: usize = 8;
/// Steps after the first of a bounce in which nothing falls below zero, while each changes more than a share of the light: they
/// bring antiradiance near to where it settles, so that what then swings is small.
const CUT_STEPS: u32 = 3;
const CUT_ABOVE: f64 = 0.02;
/// From this undershoot on they are as all others.
const NEVER_CUTS: f32 = 1e6;
/// Bounds what [`LocalStep::bounced`] grows to.
const MOST_BOUNCED: f64 = 1e6;

/// One step of an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Residual {
    /// Steps so far, this one counted.
    pub step: u32,
    /// Bounce that the step belongs to; 0: direct light of emitters and environment.
    pub bounce: u32,
    /// Whether light was reflected anew, beside antiradiance.
    pub reflects: bool,
    /// Change of the exitant light, sum of its magnitudes over leaves, bins and channels, W.
    pub change: f64,
    /// The exitant light itself, the same sum, W.
    pub total: f64,
}

impl Residual {
    /// Change as a share of what there is.
    pub fn relative(&self) -> f64 {
        if self.total > 0.0 { self.change / self.total } else { 0.0 }
    }
}

/// Factor per step by which changes grew over the last steps: an estimate of the spectral radius of the iteration, from
/// below while changes still fall.
pub fn growth_rate(residuals: &[Residual]) -> Option<f64> {
    let last = residuals.len().checked_sub(1)?;
    let first = last.checked_sub(GROWTH_STEPS)?;
    let (before, after) = (residuals[first].change, residuals[last].change);
    (before > 0.0 && after.is_finite()).then(|| (after / before).powf(1.0 / GROWTH_STEPS as f64))
}

/// Estimate of the spectral radius of whole steps from those of share `damping`: such a step multiplies by
/// `1 - damping + damping * radius`.
fn spectral_radius(residuals: &[Residual], damping: f32) -> f64 {
    let share = f64::from(damping);
    growth_rate(residuals).map_or(f64::INFINITY, |rate| (rate - 1.0 + share) / share)
}

/// Whether changes rise by more than rounding, every other step's on its own: an iteration may swing between two states.
fn is_rising(residuals: &[Residual], least_change: f64) -> bool {
    match residuals {
        [_, .., a, b, c, d] => c.change > a.change && d.change > b.change && d.relative() > least_change,
        _ => false,
    }
}

/// The last step of each bounce.
fn bounce_ends(residuals: &[Residual]) -> Vec<Residual> {
    residuals.chunk_by(|a, b| a.bounce == b.bounce).filter_map(|own| own.last().copied()).collect()
}

impl Antiradiance {
    /// Direct light of linked emitters and of the environment, into `linked`.
    pub(super) fn solve_linked(&mut self, context: &Context, watch: &dyn Watch) -> Result<(), AntiradianceError> {
        let mut recorder = context.recorder("antiradiance")?;
        recorder.fill(&self.tables.linked, 0);
        recorder.fill(&self.tables.gloss.base, 0);
        let has_environment = !self.tables.is_environment_black;
        if !self.has_linked_light() {
            return Ok(recorder.submit()?);
        }
        recorder.scope("linked direct light", |recorder| {
            self.sources(recorder, true);
            self.tables.start(recorder, &self.hierarchy, &self.bins, has_environment);
        });
        recorder.submit()?;
        watch.step("antiradiance, direct light", 0, 1)?;
        (self.bounced, self.damping) = (1.0, self.settings.damping);
        self.settle(context, 0, has_environment)?;
        let mut recorder = context.recorder("antiradiance")?;
        recorder.copy(&self.tables.irradiance, &self.tables.linked);
        let gloss = &self.tables.gloss;
        gloss.reflect(&mut recorder, &self.tables, &self.hierarchy, &self.bins, has_environment, 1.0);
        recorder.copy(&gloss.specular, &gloss.base);
        recorder.copy(&gloss.arrived, &gloss.arrived_directly);
        Ok(recorder.submit()?)
    }

    /// Whether emitters or the environment send along links.
    pub(super) fn has_linked_light(&self) -> bool {
        self.emitters.plan.linked_parts > 0 || !self.tables.is_environment_black
    }

    /// Indirect light of `bounces` bounces after the sources, into `irradiance`.     [Dachsbacher2007 2.2]
    pub(super) fn solve_indirect(
        &mut self,
        context: &Context,
        bounces: u32,
        watch: &dyn Watch,
    ) -> Result<(), AntiradianceError> {
        let mut recorder = context.recorder("antiradiance")?;
        self.sources(&mut recorder, false);
        self.has_bounced = bounces > 0;
        if !self.has_bounced {
            recorder.submit()?;
            // No step is taken: what views show of the tables is the sources' light, not what an earlier solution left.
            if self.settings.view.shows_tables() {
                self.start(context)?;
            }
            let mut recorder = context.recorder("antiradiance")?;
            recorder.fill(&self.tables.irradiance, 0);
            return Ok(recorder.submit()?);
        }
        recorder.submit()?;
        match self.settings.scheme {
            Scheme::Symmetric => self.iterate(context, watch),
            Scheme::Asymmetric => {
                self.start(context)?;
                let mut first = self.residuals.len();
                for bounce in 1..=bounces {
                    watch.step("antiradiance", u64::from(bounce) - 1, bounces.into())?;
                    self.settle(context, bounce, false)?;
                    // Bounces of few steps hand on what has not settled.
                    if self.is_rising(&bounce_ends(&self.residuals[first..])) && self.damp() {
                        first = self.residuals.len();
                    }
                    // The last of the steps that settle antiradiance is also what the next bounce reflects.
                    if bounce < bounces {
                        self.reflect(context)?;
                    }
                }
                Ok(())
            }
        }
    }

    /// The sources' light alone.
    fn start(&mut self, context: &Context) -> Result<(), GpuError> {
        let mut recorder = context.recorder("antiradiance")?;
        self.tables.start(&mut recorder, &self.hierarchy, &self.bins, false);
        recorder.submit()?;
        (self.bounced, self.damping) = (1.0, self.settings.damping);
        self.source_power = self.sum_residuals(context)?[2];
        Ok(())
    }

    /// Light and antiradiance together; where changes grow, in shorter steps from there on.   [Dachsbacher2007 2.2]
    /// Differs from [Dachsbacher2007]: damped where needed, which brings every iteration to rest whose eigenvalues have
    /// real parts below one; plain steps need magnitudes below one.
    fn iterate(&mut self, context: &Context, watch: &dyn Watch) -> Result<(), AntiradianceError> {
        self.start(context)?;
        let mut first = self.residuals.len();
        for iteration in 1..=self.settings.iterations {
            watch.step("antiradiance", u64::from(iteration) - 1, self.settings.iterations.into())?;
            let (bounced, damping) = (self.bounced, self.damping);
            let step =
                LocalStep { reflects: true, sets_floor: iteration == 1, bounced, damping, ..LocalStep::default() };
            self.step_once(context, iteration, step)?;
            let own = &self.residuals[first..];
            if !self.is_rising(own) {
                continue;
            }
            let rate = spectral_radius(own, damping);
            if !self.damp() {
                return Err(AntiradianceError::Growth { steps: iteration, rate, scheme: "symmetric" });
            }
            first = self.residuals.len();
        }
        Ok(())
    }

    fn is_rising(&self, residuals: &[Residual]) -> bool {
        is_rising(residuals, if self.tables.half { LEAST_CHANGE_F16 } else { LEAST_CHANGE })
    }

    /// Halves the share of steps; `false` where it is as small as it may be.
    fn damp(&mut self) -> bool {
        let may = self.damping > LEAST_DAMPING;
        self.damping = (0.5 * self.damping).max(LEAST_DAMPING);
        if may {
            tracing::info!("changes grow after {} steps; damped by {}", self.residuals.len(), self.damping);
        }
        may
    }

    /// Moves antiradiance on until it changes no more, light being what it is.            [Dachsbacher2007 Eq. 14]
    /// Differs from [Dachsbacher2007]: damped as the symmetric scheme is, where it goes on to swing; cut at zero at first.
    fn settle(&mut self, context: &Context, bounce: u32, has_environment: bool) -> Result<(), AntiradianceError> {
        let mut first = self.residuals.len() + FREE_STEPS;
        for step in 0..self.settings.depth {
            let (sets_floor, bounced, damping) = (bounce <= 1 && step == 0, self.bounced, self.damping);
            // What many surfaces one behind the other take away too much of, and give back too much of, dies out slowly: a
            // curtain seen along its folds swings for dozens of steps, and all light behind it.
            let changed = self.residuals.last().map_or(0.0, Residual::relative);
            let cuts = (1..=CUT_STEPS).contains(&step)
                && step + 1 < self.settings.depth
                && changed > CUT_ABOVE
                && self.settings.undershoot < NEVER_CUTS;
            let step = LocalStep { has_environment, sets_floor, cuts, bounced, damping, ..LocalStep::default() };
            let residual = self.step_once(context, bounce, step)?;
            if !cuts && residual.relative() < f64::from(self.settings.tolerance) {
                break;
            }
            if self.residuals.get(first..).is_some_and(|own| self.is_rising(own)) && self.damp() {
                first = self.residuals.len();
            }
        }
        Ok(())
    }

    /// What arrived last, reflected.                                                      [Dachsbacher2007 Eq. 13]
    fn reflect(&mut self, context: &Context) -> Result<(), AntiradianceError> {
        let mut recorder = context.recorder("antiradiance")?;
        recorder.scope("reflect", |recorder| {
            self.tables.reflect(recorder, &self.hierarchy, &self.bins, (self.bounced, self.damping));
        });
        recorder.submit()?;
        let power = self.sum_residuals(context)?[2];
        self.count_bounces(power);
        Ok(())
    }

    /// One application of U and what follows; its residual is kept and watched.
    fn step_once(&mut self, context: &Context, bounce: u32, step: LocalStep) -> Result<Residual, AntiradianceError> {
        let mut recorder = context.recorder("antiradiance")?;
        if let Some(kept) = &mut self.kept {
            for (window, sent) in self.tables.windows.iter().zip(&kept.exitant) {
                recorder.copy(&window.exitant, sent);
            }
            kept.step = step;
        }
        recorder.scope(format_args!("bounce {bounce}"), |recorder| {
            self.tables.step(recorder, &self.transfers, &self.hierarchy, &self.bins, step);
        });
        recorder.submit()?;
        let [change, total, power] = self.sum_residuals(context)?;
        let steps = self.residuals.last().map_or(0, |last| last.step) + 1;
        let residual = Residual { step: steps, bounce, reflects: step.reflects, change, total };
        if step.reflects {
            self.count_bounces(power);
        }
        tracing::debug!("step {steps}, bounce {bounce}: exitant light {total:.4} W, changed by {change:.4} W");
        self.residuals.push(residual);
        self.watch()?;
        Ok(residual)
    }

    /// Change of the exitant light, its sum, and what of it is reflected and emitted, W.
    fn sum_residuals(&self, context: &Context) -> Result<[f64; 3], GpuError> {
        let leaves = context.download(&self.tables.residuals)?;
        Ok(leaves.iter().fold([0.0; 3], |sum, leaf| {
            [sum[0] + f64::from(leaf.x), sum[1] + f64::from(leaf.y), sum[2] + f64::from(leaf.z)]
        }))
    }

    fn count_bounces(&mut self, power: f64) {
        if self.source_power > 0.0 && power.is_finite() {
            self.bounced = (power / self.source_power).clamp(1.0, MOST_BOUNCED) as f32;
        }
    }

    /// Refuses an iteration that grows.
    fn watch(&self) -> Result<(), AntiradianceError> {
        let Some(last) = self.residuals.last() else { return Ok(()) };
        let own = self.residuals.iter().filter(|r| (r.bounce == 0) == (last.bounce == 0));
        let largest_source = own.map(|r| r.total).next().unwrap_or(0.0);
        let grew = !last.change.is_finite() || !last.total.is_finite() || last.total > GROWTH_LIMIT * largest_source;
        if !grew || largest_source == 0.0 {
            return Ok(());
        }
        Err(AntiradianceError::Growth {
            steps: last.step,
            rate: spectral_radius(&self.residuals, self.damping),
            scheme: match self.settings.scheme {
                Scheme::Symmetric => "symmetric",
                Scheme::Asymmetric => "asymmetric",
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn residuals(changes: &[f64]) -> Vec<Residual> {
        let residual =
            |(step, &change)| Residual { step: step as u32 + 1, bounce: 1, reflects: true, change, total: 1.0 };
        changes.iter().enumerate().map(residual).collect()
    }

    #[test]
    fn swinging_without_growth_is_not_rising() {
        let is_rising = |changes: &[f64]| is_rising(&residuals(changes), LEAST_CHANGE);
        assert!(!is_rising(&[3.0, 1.0, 2.9, 0.9, 2.8]));
        assert!(is_rising(&[3.0, 1.0, 3.1, 1.1, 3.2]));
        assert!(!is_rising(&[1.0, 2.0, 3.0, 4.0]), "too few to tell");
        assert!(!is_rising(&[1e-6, 2e-6, 3e-6, 4e-6, 5e-6]), "rounding");
    }

    #[test]
    fn a_bounce_ends_with_its_last_step() {
        let mut steps = residuals(&[5.0, 4.0, 3.0, 2.0, 1.0]);
        steps.iter_mut().zip([1, 1, 2, 3, 3]).for_each(|(step, bounce)| step.bounce = bounce);
        assert_eq!(bounce_ends(&steps).iter().map(|end| end.change).collect::<Vec<_>>(), [4.0, 3.0, 1.0]);
    }

    #[test]
    fn the_growth_rate_is_that_of_a_geometric_series() {
        let halving: Vec<f64> = (0..8).map(|k| 0.5f64.powi(k)).collect();
        assert!((growth_rate(&residuals(&halving)).unwrap() - 0.5).abs() < 1e-12);
        let tripling: Vec<f64> = (0..8).map(|k| 3f64.powi(k)).collect();
        assert!((growth_rate(&residuals(&tripling)).unwrap() - 3.0).abs() < 1e-12);
        assert_eq!(growth_rate(&residuals(&halving[..4])), None);
        assert_eq!(growth_rate(&residuals(&[0.0; 8])), None);
    }
}
