//! The light on the hierarchy: tables over nodes and bins, and the passes over them.

use super::gloss::Gloss;
use super::linking::Transfers;
use crate::gpu::shaders::methods::antiradiance as passes;
use crate::gpu::{Buffer, Context, GpuError, Recorder, Threads};
use crate::scene::environment::Environment;
use crate::stages::direction_bins::{DeviceBins, DirectionBins};
use crate::stages::elements::Elements;
use crate::stages::hierarchy::Hierarchy;
use glam::{Vec2, Vec3};
use std::ops::Range;

/// Bins of one thread, in `table.glsl`; as pairs of opposite ones in `local.glsl`.
const BINS_A_THREAD: u32 = 8;

/// The light on the nodes in consecutive bins: as many as one buffer holds. Entry: `bin * nodes + node`, bins counted from the
/// window's first, [`Tables::words`] words of 64 bits.
pub struct TableWindow {
    pub bins: Range<u32>,
    /// Intensity per area, radiance times cosine: reflected and emitted light less antiradiance, W m^-2 sr^-1.
    pub exitant: Buffer<u64>,
    /// Radiance, W m^-2 sr^-1. A leaf lacks what stands with its parent.
    pub incident: Buffer<u64>,
}

impl TableWindow {
    /// Threads that share the bins of a node or leaf.
    fn parts(&self) -> u32 {
        self.bins.len() as u32 / BINS_A_THREAD
    }
}

/// Light by direction and node, and by leaf and side.
pub struct Tables {
    pub bin_count: u32,
    /// Entries are three f16, else three f32.
    pub half: bool,
    /// All bins, in order.
    pub windows: Vec<TableWindow>,
    /// How far below zero the light of a bin may fall, of its side's mean.
    pub undershoot: f32,
    /// Per bin: radiance of the environment that travels along it.
    pub environment: Buffer<Vec3>,
    pub is_environment_black: bool,
    /// Per leaf: scale of its cosines.
    pub cosine_norms: Buffer<f32>,
    /// Two per leaf from here on, front and back. Scale of what links bring, 1: see [`super::NodeLinks::even_out`].
    pub scales: Buffer<f32>,
    pub albedo: Buffer<Vec3>,
    /// W/m2. Radiosity without transport.
    pub source: Buffer<Vec3>,
    pub radiosity: Buffer<Vec3>,
    /// Mean radiance that arrived before anything was taken away, W m^-2 sr^-1.
    pub means: Buffer<Vec3>,
    /// Per bin and leaf: what arrived so in the bin, of the mean of its side.
    pub peaks: Buffer<f32>,
    /// What arrived last.
    pub irradiance: Buffer<Vec3>,
    /// The same, front and back of each thread's bins in turn.
    irradiance_parts: Buffer<Vec3>,
    /// Direct light of linked emitters and of the environment.
    pub linked: Buffer<Vec3>,
    /// The leaves with specular lobes, and what those send.
    pub gloss: Gloss,
    /// Per thread's bins and leaf, W: change of the exitant light in the last step, and its sum.
    residual_parts: Buffer<Vec2>,
    /// Per leaf, the same of what the fronts of plain leaves reflect and emit, which is in no part.
    light_changes: Buffer<Vec2>,
    /// Per leaf, W: the same of all bins, and what of the light is reflected and emitted.
    pub residuals: Buffer<Vec3>,
}

/// What a step does beside moving antiradiance on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalStep {
    /// Light is reflected anew, else what was reflected before stays.
    pub reflects: bool,
    /// The environment shines on every leaf.
    pub has_environment: bool,
    /// What arrives now, uncut, sets how far below zero a bin may fall from now on.
    pub sets_floor: bool,
    /// Nothing falls below zero, whatever [`Tables::undershoot`] says.
    pub cuts: bool,
    /// Reflected light of all bounces so far, of the sources': the floor grows with it.
    pub bounced: f32,
    /// Share of the new exitant light, the rest stays what it was: less than 1 damps the iteration.
    pub damping: f32,
}

impl Default for LocalStep {
    fn default() -> Self {
        Self { reflects: false, has_environment: false, sets_floor: false, cuts: false, bounced: 1.0, damping: 1.0 }
    }
}

impl Tables {
    /// Words of an entry.
    pub fn words(half: bool) -> u64 {
        if half { 1 } else { 2 }
    }

    /// Bins of each window but the last, where one buffer holds at most `largest` bytes; `None` where not even the bins of one
    /// thread fit.
    pub fn window_bins(node_count: u32, half: bool, largest: u64) -> Option<u32> {
        let bins = largest / Self::table_bytes(node_count, 1, half).max(1) / u64::from(BINS_A_THREAD);
        let bins = bins.min(u64::from(u32::MAX / BINS_A_THREAD)) as u32 * BINS_A_THREAD;
        (bins > 0).then_some(bins)
    }

    /// All of what nodes send, or of what they receive, as if it were one window.
    pub fn download(
        &self,
        context: &Context,
        table: impl Fn(&TableWindow) -> &Buffer<u64>,
    ) -> Result<Vec<u64>, GpuError> {
        let windows = self.windows.iter().map(|window| context.download(table(window)));
        Ok(windows.collect::<Result<Vec<_>, _>>()?.concat())
    }

    /// Bytes of one of the two large tables.
    pub fn table_bytes(node_count: u32, bin_count: u32, half: bool) -> u64 {
        u64::from(node_count) * u64::from(bin_count) * 8 * Self::words(half)
    }

    pub fn new(
        context: &Context,
        hierarchy: &Hierarchy,
        bins: &DeviceBins,
        environment: &Environment,
        half: bool,
        undershoot: f32,
        gloss: Gloss,
    ) -> Result<Self, GpuError> {
        let bin_count = bins.bins.count();
        let nodes = hierarchy.node_count();
        // One thread's bins at least: what does not fit is refused where it is allocated.
        let wanted = Self::window_bins(nodes, half, context.limits().storage_buffer_bytes).unwrap_or(BINS_A_THREAD);
        let windows = (0..bin_count).step_by(wanted as usize).zip(0..).map(|(first, index)| {
            let bins = first..bin_count.min(first.saturating_add(wanted));
            let words = (Self::table_bytes(nodes, bins.len() as u32, half) / 8) as usize;
            Ok(TableWindow {
                exitant: context.buffer(&format!("antiradiance/exitant {index}"), words)?,
                incident: context.buffer(&format!("antiradiance/incident {index}"), words)?,
                bins,
            })
        });
        let (leaves, sides) = (hierarchy.leaf_count() as usize, 2 * hierarchy.leaf_count() as usize);
        let parts = (bin_count / BINS_A_THREAD) as usize;
        Ok(Self {
            bin_count,
            half,
            undershoot,
            gloss,
            windows: windows.collect::<Result<_, GpuError>>()?,
            environment: context.upload("antiradiance/environment", &binned(environment, &bins.bins))?,
            is_environment_black: environment.is_black(),
            cosine_norms: context.buffer("antiradiance/cosine norms", leaves)?,
            scales: context.buffer("antiradiance/scales", sides)?,
            albedo: context.buffer("antiradiance/leaf albedo", sides)?,
            source: context.buffer("antiradiance/source", sides)?,
            radiosity: context.buffer("antiradiance/radiosity", sides)?,
            means: context.buffer("antiradiance/means", sides)?,
            irradiance: context.buffer("antiradiance/irradiance", sides)?,
            linked: context.buffer("antiradiance/linked irradiance", sides)?,
            peaks: context.buffer("antiradiance/peaks", leaves * bin_count as usize)?,
            irradiance_parts: context.buffer("antiradiance/irradiance parts", sides * parts)?,
            residual_parts: context.buffer("antiradiance/residual parts", leaves * parts)?,
            light_changes: context.buffer("antiradiance/light changes", leaves)?,
            residuals: context.buffer("antiradiance/residuals", leaves)?,
        })
    }

    /// Follows the leaves' normals.
    pub fn update_norms(&self, recorder: &mut Recorder<'_>, hierarchy: &Hierarchy, bins: &DeviceBins) {
        let leaf_count = hierarchy.leaf_count();
        let pass = passes::CosineNorms {
            leaves: &hierarchy.leaves,
            bin_directions: &bins.directions,
            cosine_norms: &self.cosine_norms,
            params: passes::CosineNormsParams { leaf_count, bin_count: self.bin_count },
        };
        recorder.dispatch(&pass, leaf_count);
    }

    /// Follows the elements' materials.
    pub fn update_albedo(&self, recorder: &mut Recorder<'_>, hierarchy: &Hierarchy, elements: &Elements) {
        let leaf_count = hierarchy.leaf_count();
        let pass = passes::LeafAlbedo {
            leaves: &hierarchy.leaves,
            members: &hierarchy.members,
            back_elements: &elements.back_elements,
            area: &elements.area,
            albedo: &elements.albedo,
            leaf_albedo: &self.albedo,
            params: passes::LeafAlbedoParams { leaf_count },
        };
        recorder.dispatch(&pass, leaf_count);
    }

    /// Starts over: no light has been transported yet, leaves send their sources.
    pub fn start(&self, recorder: &mut Recorder<'_>, hierarchy: &Hierarchy, bins: &DeviceBins, has_environment: bool) {
        for window in &self.windows {
            recorder.fill(&window.incident, 0);
            recorder.fill(&window.exitant, 0);
        }
        recorder.fill(&self.means, 0);
        recorder.fill(&self.peaks, 0);
        recorder.copy(&self.gloss.base, &self.gloss.specular);
        self.local(recorder, hierarchy, bins, LocalStep { has_environment, sets_floor: true, ..LocalStep::default() });
    }

    /// One application of U, then K and J: global, push, local, pull.                  [Dachsbacher2007 4.2]
    pub fn step(
        &self,
        recorder: &mut Recorder<'_>,
        transfers: &Transfers,
        hierarchy: &Hierarchy,
        bins: &DeviceBins,
        step: LocalStep,
    ) {
        recorder.scope("global", |recorder| {
            transfers.gather(recorder, self);
        });
        recorder.scope("push", |recorder| self.push(recorder, hierarchy));
        self.local(recorder, hierarchy, bins, step);
    }

    /// Reflects what arrived last; antiradiance stays what it is.
    pub fn reflect(
        &self,
        recorder: &mut Recorder<'_>,
        hierarchy: &Hierarchy,
        bins: &DeviceBins,
        (bounced, damping): (f32, f32),
    ) {
        let step = LocalStep { reflects: true, bounced, damping, ..LocalStep::default() };
        self.local(recorder, hierarchy, bins, step);
    }

    fn push(&self, recorder: &mut Recorder<'_>, hierarchy: &Hierarchy) {
        hierarchy.levels.downwards(recorder, |recorder, level| {
            if level.start == 0 {
                return; // the root has no parent
            }
            for window in &self.windows {
                let pass = passes::Push {
                    level_nodes: &hierarchy.levels.nodes,
                    nodes: &hierarchy.nodes,
                    incident: &window.incident,
                    constants: passes::PushConstants { words: Self::words(self.half) as u32 },
                    params: passes::PushParams {
                        first: level.start,
                        count: level.len() as u32,
                        node_count: hierarchy.node_count(),
                    },
                };
                recorder.dispatch(&pass, Threads::Grid(level.len() as u32, window.parts(), 1));
            }
        });
    }

    fn local<'a>(
        &'a self,
        recorder: &mut Recorder<'_>,
        hierarchy: &'a Hierarchy,
        bins: &'a DeviceBins,
        step: LocalStep,
    ) {
        if step.reflects {
            recorder.scope("local/glossy", |recorder| {
                self.gloss.reflect(recorder, self, hierarchy, bins, false, step.bounced)
            });
        }
        let (leaf_count, node_count) = (hierarchy.leaf_count(), hierarchy.node_count());
        let (words, bin_count) = (Self::words(self.half) as u32, self.bin_count);
        let part_count = bin_count / BINS_A_THREAD;
        let undershoot = if step.cuts { 0.0 } else { step.bounced * self.undershoot };
        let (sets_floor, add_environment) = (u32::from(step.sets_floor), u32::from(step.has_environment));
        let is_undamped = u32::from(!step.sets_floor && step.damping == 1.0);
        let irradiance_of = |window: &'a TableWindow| passes::LocalIrradiance {
            leaves: &hierarchy.leaves,
            nodes: &hierarchy.nodes,
            cosine_norms: &self.cosine_norms,
            bin_directions: &bins.directions,
            incident: &window.incident,
            environment: &self.environment,
            means: &self.means,
            peaks: &self.peaks,
            parts: &self.irradiance_parts,
            exitant: &window.exitant,
            residual_parts: &self.residual_parts,
            constants: passes::LocalIrradianceConstants { words, bin_count },
            params: passes::LocalIrradianceParams {
                leaf_count,
                node_count,
                first_bin: window.bins.start,
                sets_floor,
                undershoot,
                damping: step.damping,
                add_environment,
            },
        };
        let reflect = passes::LocalReflect {
            parts: &self.irradiance_parts,
            leaves: &hierarchy.leaves,
            source: &self.source,
            leaf_albedo: &self.albedo,
            radiosity: &self.radiosity,
            means: &self.means,
            irradiance: &self.irradiance,
            glossy_of_leaf: &self.gloss.glossy_of_leaf,
            light_changes: &self.light_changes,
            scales: &self.scales,
            params: passes::LocalReflectParams {
                leaf_count,
                part_count,
                is_linked: u32::from(!step.has_environment),
                update_radiosity: u32::from(step.reflects),
                sets_floor,
                is_undamped,
            },
        };
        let exitant_of = |window: &'a TableWindow| passes::LocalExitant {
            leaves: &hierarchy.leaves,
            nodes: &hierarchy.nodes,
            cosine_norms: &self.cosine_norms,
            bin_directions: &bins.directions,
            incident: &window.incident,
            environment: &self.environment,
            radiosity: &self.radiosity,
            means: &self.means,
            peaks: &self.peaks,
            glossy_of_leaf: &self.gloss.glossy_of_leaf,
            specular: &self.gloss.specular,
            exitant: &window.exitant,
            residual_parts: &self.residual_parts,
            constants: passes::LocalExitantConstants { words, bin_count },
            params: passes::LocalExitantParams {
                leaf_count,
                node_count,
                first_bin: window.bins.start,
                sets_floor,
                undershoot,
                damping: step.damping,
                keeps_light: u32::from(!step.reflects) & is_undamped,
                add_environment,
                is_undamped,
            },
        };
        let residual = passes::LocalResidual {
            residual_parts: &self.residual_parts,
            leaves: &hierarchy.leaves,
            radiosity: &self.radiosity,
            residuals: &self.residuals,
            light_changes: &self.light_changes,
            params: passes::LocalResidualParams { leaf_count, part_count },
        };
        recorder.scope("local", |recorder| {
            for window in &self.windows {
                recorder.dispatch(&irradiance_of(window), Threads::Grid(leaf_count, window.parts(), 1));
            }
            recorder.dispatch(&reflect, leaf_count);
            for window in &self.windows {
                recorder.dispatch(&exitant_of(window), Threads::Grid(leaf_count, window.parts(), 1));
            }
            recorder.dispatch(&residual, leaf_count);
        });
        recorder.scope("pull", |recorder| {
            hierarchy.levels.upwards(recorder, |recorder, level| {
                for window in &self.windows {
                    let pass = passes::Pull {
                        level_nodes: &hierarchy.levels.nodes,
                        nodes: &hierarchy.nodes,
                        exitant: &window.exitant,
                        constants: passes::PullConstants { words },
                        params: passes::PullParams { first: level.start, count: level.len() as u32, node_count },
                    };
                    recorder.dispatch(&pass, Threads::Grid(level.len() as u32, window.parts(), 1));
                }
            });
        });
    }
}

/// Mean radiance of the environment's light that travels along each bin.
pub fn binned(environment: &Environment, bins: &DirectionBins) -> Vec<Vec3> {
    let map = match environment {
        Environment::Constant(radiance) => return vec![*radiance; bins.count() as usize],
        Environment::Map(map) => map,
    };
    // Samples fine enough that several fall into each bin.
    let columns = map.width.max(16 * bins.side);
    let rows = map.height.max(8 * bins.side);
    let mut sums = vec![(Vec3::ZERO, 0.0f32); bins.count() as usize];
    for row in 0..rows {
        let v = (row as f32 + 0.5) / rows as f32;
        let solid_angle = (std::f32::consts::PI * v).sin();
        for column in 0..columns {
            let towards = map.direction_of(Vec2::new((column as f32 + 0.5) / columns as f32, v));
            let (sum, weight) = &mut sums[bins.bin_of(-towards) as usize];
            *sum += solid_angle * map.radiance(towards);
            *weight += solid_angle;
        }
    }
    sums.into_iter().map(|(sum, weight)| if weight > 0.0 { sum / weight } else { Vec3::ZERO }).collect()
}
