//! Linkless shooting: Algorithm 1 of [Gobbetti2003], all receivers at once.
//!
//! [Gobbetti2003]: crate::methods::PAPERS

use super::transfer::ray_offset;
use super::{FaceClusterError, FaceClusters, Stage, lights};
use crate::gpu::shaders::methods::face_cluster as passes;
use crate::gpu::shaders::types::{Light, PoolCounters};
use crate::gpu::{Buffer, Context};
use crate::scene::LightKind;
use glam::Vec3;
use std::f32::consts::PI;
use std::time::Instant;

/// `IS_LIGHT` of `lib/face_element.glsl`.
pub(super) const IS_LIGHT: u32 = 1 << 31;
/// Nearest a light is taken to stand to a surface, as a share of the scene's diagonal: bounds what can arrive.
const NEAREST_LIGHT: f32 = 0.01;

/// Where what arrives is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kept {
    /// Reflected and forgotten.
    No,
    Direct,
    Indirect,
}

/// What a pass of light shoots.
#[derive(Clone, Copy)]
pub(super) enum Shooters<'a> {
    /// So many entries of a table.
    Lights(&'a Buffer<Light>, u32),
    Emission,
    Unshot,
}

/// One pass of light through the scene.
pub(super) struct LightPass<'a> {
    pub name: String,
    pub shooters: Shooters<'a>,
    pub kept: Kept,
    /// W, sent.
    pub power: Vec3,
    /// W/m2, the most that can arrive anywhere.
    pub most: f32,
}

/// What a pass of light may get wrong.
#[derive(Clone, Copy)]
pub(super) struct Tolerance {
    /// W, of a transfer.
    pub threshold: f32,
    /// W/m2, that a bent receiver may get as a whole.
    pub bent_light: f32,
}

impl FaceClusters {
    /// Shoots emitted light and `bounces` reflections of it. After an interruption what has been shot so far can be
    /// shown: call [`Self::locate`].
    pub fn solve(&mut self, context: &Context, stage: &Stage<'_>, bounces: u32) -> Result<(), FaceClusterError> {
        let clock = Instant::now();
        self.report.iterations.clear();
        self.most_light = 0.0;
        self.start(context, stage)?;
        let [low, high] = stage.bounds;
        let diagonal = (high - low).length().max(f32::MIN_POSITIVE);
        let distant = lights::distant_emitters(stage.environment, self.settings.environment_directions);
        let across = PI * 0.25 * diagonal * diagonal;
        let count = u64::from(bounces) + 3;

        stage.watch.step("light", 0, count)?;
        if stage.world.light_count > 0 {
            let most = stage.pose.lights.iter().map(|light| match light.kind {
                LightKind::Directional => light.intensity.max_element(),
                _ => light.intensity.max_element() / (NEAREST_LIGHT * diagonal).powi(2),
            });
            let shooters = Shooters::Lights(&stage.world.lights, stage.world.light_count);
            let (name, most) = ("punctual".to_owned(), most.sum());
            let power = punctual_power(stage, across);
            let pass = LightPass { name, shooters, kept: Kept::No, power, most };
            // Shown per pixel: its errors are seen only once reflected.
            let tolerance = self.tolerance(power.max_element());
            self.shoot(context, stage, &pass, tolerance)?;
        }
        stage.watch.step("light", 1, count)?;
        if !distant.is_empty() {
            let most = distant.iter().map(|light| light.intensity.max_element()).sum();
            let table = context.upload("face-cluster/distant emitters", &distant)?;
            let shooters = Shooters::Lights(&table, distant.len() as u32);
            let name = "environment".to_owned();
            let power = distant.iter().map(|light| across * light.intensity).sum();
            let pass = LightPass { name, shooters, kept: Kept::Direct, power, most };
            let tolerance = self.judge(context, stage, &pass)?;
            self.shoot(context, stage, &pass, tolerance)?;
        }
        stage.watch.step("light", 2, count)?;
        let emitted = self.emit(context)?;
        if emitted > 0.0 {
            let (name, shooters) = ("direct".to_owned(), Shooters::Emission);
            let power = self.placement.emitted_power;
            let pass = LightPass { name, shooters, kept: Kept::Direct, power, most: emitted };
            let tolerance = self.judge(context, stage, &pass)?;
            self.shoot(context, stage, &pass, tolerance)?;
        }

        let mut first = 0.0f32;
        let power = if bounces > 0 { self.reflected_power(context)? } else { Vec3::ZERO };
        let mut judged = None;
        for bounce in 1..=bounces {
            stage.watch.step("light", u64::from(bounce) + 2, count)?;
            // What the last pass reflected is what this one shoots.
            let unshot = self.report.iterations.last().map_or(0.0, |last| last.largest_unshot);
            first = first.max(unshot);
            if unshot <= self.settings.convergence * first {
                break;
            }
            std::mem::swap(&mut self.state.unshot, &mut self.state.next_unshot);
            let mut recorder = context.recorder("face-cluster")?;
            recorder.fill(&self.state.next_unshot, 0);
            recorder.submit()?;
            let (name, shooters) = (format!("bounce {bounce}"), Shooters::Unshot);
            let pass = LightPass { name, shooters, kept: Kept::Indirect, power, most: unshot };
            // Later bounces are judged as the first: they add to the same light.
            let tolerance = match judged {
                Some(tolerance) => tolerance,
                None => self.judge(context, stage, &pass)?,
            };
            judged = Some(tolerance);
            self.shoot(context, stage, &pass, tolerance)?;
        }
        stage.watch.step("light", count, count)?;
        self.report.solve_seconds = clock.elapsed().as_secs_f64();
        self.locate(context, stage)
    }

    /// What the direct light left to shoot, W.
    fn reflected_power(&self, context: &Context) -> Result<Vec3, FaceClusterError> {
        let (s, roots) = (&self.state, self.placement.instance_count as usize);
        let functions = self.settings.radiosity_basis.functions() as usize;
        let elements = context.download_range(&s.elements, 0..roots)?;
        let unshot = context.download_range(&s.next_unshot, 0..roots * functions)?;
        Ok(elements.iter().zip(unshot.iter().step_by(functions)).map(|(element, &b)| element.area * b).sum())
    }

    /// The elements of all roots, dark.
    fn start(&self, context: &Context, stage: &Stage<'_>) -> Result<(), FaceClusterError> {
        let (s, p) = (&self.state, &self.placement);
        let counters = PoolCounters {
            element_count: p.instance_count,
            made_count: p.instance_count,
            ..bytemuck::Zeroable::zeroed()
        };
        context.write(&s.pool, &[counters])?;
        let mut recorder = context.recorder("face-cluster")?;
        for buffer in [&s.unshot, &s.next_unshot] {
            recorder.fill(buffer, 0);
        }
        recorder.fill(&s.direct, 0);
        recorder.fill(&s.indirect, 0);
        let pass = passes::MakeRoots {
            clusters: &p.clusters,
            cluster_skips: &p.skips,
            instances: &p.instances,
            tree_faces: &p.faces,
            triangles: &stage.world.triangles,
            positions: &stage.world.positions,
            rules: &s.rules,
            elements: &s.elements,
            element_nodes: &s.nodes,
            node_normals: &s.normals,
            fits: &s.fits,
            function_means: &s.function_means,
            pool: &s.pool,
            bvh_nodes: stage.bvh.nodes(),
            bvh_triangles: stage.bvh.triangles(),
            solids: &p.solids,
            params: passes::MakeRootsParams { instance_count: p.instance_count, ray_offset: ray_offset(stage) },
            constants: passes::MakeRootsConstants {
                receiver_nodes: self.settings.receiver_rule.nodes().len() as u32,
                shooter_nodes: self.settings.shooter_rule.nodes().len() as u32,
                irradiance_functions: self.settings.irradiance_basis.functions(),
                laid_functions: self.settings.receiver_rule.functions(),
                sent_functions: self.settings.shooter_rule.functions(),
            },
        };
        recorder.dispatch(&pass, p.instance_count);
        recorder.submit()?;
        Ok(())
    }

    /// Makes emission the unshot light; returns the largest, W/m2.
    fn emit(&self, context: &Context) -> Result<f32, FaceClusterError> {
        let s = &self.state;
        let mut counters = context.download(&s.pool)?[0];
        counters.largest_unshot = 0;
        context.write(&s.pool, &[counters])?;
        let mut recorder = context.recorder("face-cluster")?;
        let pass = passes::Emit {
            elements: &s.elements,
            unshot: &s.unshot,
            pool: &s.pool,
            params: passes::EmitParams {
                element_count: counters.element_count,
                radiosity_functions: self.settings.radiosity_basis.functions(),
            },
        };
        recorder.dispatch(&pass, counters.element_count);
        recorder.submit()?;
        Ok(f32::from_bits(context.download(&s.pool)?[0].largest_unshot))
    }
}

/// Of all punctual lights, W; `across` is what a directional light sees of the scene, m2.
fn punctual_power(stage: &Stage<'_>, across: f32) -> Vec3 {
    let power = stage.pose.lights.iter().map(|light| match light.kind {
        LightKind::Point => 4.0 * PI * light.intensity,
        LightKind::Spot { outer_angle, .. } => 2.0 * PI * (1.0 - outer_angle.cos()) * light.intensity,
        LightKind::Directional => across * light.intensity,
    });
    power.sum()
}
