//! The environment: what is even of it through empty bins, what is bright as directions of their own, past the surfaces
//! that the bins around them name.                                                                    [Dong2007 4.4]
//!
//! [Dong2007]: crate::methods::PAPERS

use super::{ImplicitVisibility, Linking, Settings, bins};
use crate::gpu::shaders::methods::implicit_visibility as passes;
use crate::gpu::shaders::types::SkySpot;
use crate::gpu::{Buffer, Context, GpuError, Recorder, Sampled};
use crate::scene::environment::Environment;
use crate::stages::elements::Elements;
use crate::stages::quadtree::Quadtrees;
use crate::stages::world::WorldEnvironment;
use glam::Vec3;
use std::f64::consts::PI;

/// Of the scene's extent, how far away light comes from that is infinitely far.
const FAR: f32 = 1e3;

/// The environment as the bins see it, and its bright spots.
pub(super) struct Sky {
    /// What is not bright, at the density of the bins.
    pub environment: WorldEnvironment,
    /// Its mean over each bin along the world's axes, W m^-2 sr^-1.
    pub bin_radiance: Buffer<Vec3>,
    pub spots: Buffer<SkySpot>,
    /// A bit per element and spot; each element starts a word.
    pub spots_seen: Buffer<u32>,
    pub spot_count: u32,
}

impl Sky {
    pub fn new(
        context: &Context,
        environment: &Environment,
        elements: &Elements,
        settings: &Settings,
    ) -> Result<Self, GpuError> {
        let n = settings.bins;
        let (spots, rest) = environment.split(settings.sky_spots, 4.0 * PI / f64::from(settings.bin_count()));
        let spots: Vec<SkySpot> =
            spots.iter().map(|spot| SkySpot { direction: spot.direction, irradiance: spot.irradiance }).collect();
        let words = elements.count as usize * spots.len().div_ceil(32);
        Ok(Self {
            environment: WorldEnvironment::new(context, &rest.averaged(4 * n, 2 * n))?,
            bin_radiance: context.upload("implicit/bin radiance", &bins::radiance(&rest, n))?,
            spots: context.upload("implicit/sky spots", &spots)?,
            spots_seen: context.buffer("implicit/sky spots seen", words)?,
            spot_count: spots.len() as u32,
        })
    }

    pub fn is_black(&self) -> bool {
        self.environment.info.is_black != 0
    }

    /// Which spots each element sees.
    pub fn see(
        &self,
        recorder: &mut Recorder<'_>,
        (trees, elements): (&Quadtrees, &Elements),
        linking: &Linking,
        settings: &Settings,
    ) {
        if self.spot_count == 0 {
            return;
        }
        recorder.fill(&self.spots_seen, 0);
        for window in &linking.windows {
            let leaves = window.plan.leaves();
            let pass = passes::SeeSky {
                winners: &window.winners,
                receivers: &linking.receivers,
                leaf_elements: &trees.leaf_elements,
                spots: &self.spots,
                walk_texels: &trees.walk_texels,
                walk_starts: &trees.walk_starts,
                leaf_cells: &trees.leaf_cells,
                corner_texels: &trees.corner_texels,
                spots_seen: &self.spots_seen,
                params: passes::SeeSkyParams {
                    first_leaf: leaves.start,
                    leaf_count: leaves.len() as u32,
                    n: settings.bins,
                    spot_count: self.spot_count,
                    all_leaves: trees.topology.leaf_count(),
                    far: FAR * elements.ray_offset / settings.ray_offset,
                },
            };
            recorder.dispatch(&pass, leaves.len() * self.spot_count.div_ceil(32) as usize);
        }
    }
}

impl ImplicitVisibility {
    /// Another environment; links stay.
    pub fn set_environment(&mut self, context: &Context, environment: &Environment) -> Result<(), GpuError> {
        self.sky = Sky::new(context, environment, &self.elements, &self.settings)?;
        self.report.sky_spots = self.sky.spot_count;
        let mut recorder = context.recorder("implicit-visibility")?;
        self.sky.see(&mut recorder, (&self.trees, &self.elements), &self.linking, &self.settings);
        recorder.submit()
    }

    /// What is bright in the environment, and which of it each element sees: a bit per element and spot, each element
    /// starts a word.
    pub fn sky_spots(&self) -> (&Buffer<SkySpot>, &Buffer<u32>) {
        (&self.sky.spots, &self.sky.spots_seen)
    }

    /// `irradiance` of all elements from the environment.                                            [Dong2007 4.4]
    pub(super) fn gather_environment(&self, recorder: &mut Recorder<'_>) {
        let irradiance = &self.state.irradiance;
        recorder.fill(irradiance, 0);
        for window in &self.linking.windows {
            let leaves = window.plan.leaves();
            let Sky { environment, bin_radiance, .. } = &self.sky;
            let pass = passes::Environment {
                winners: &window.winners,
                receivers: &self.linking.receivers,
                leaf_elements: &self.trees.leaf_elements,
                bin_vectors: &self.linking.bin_vectors,
                bin_radiance,
                environment_info: &environment.info_buffer,
                environment_map: Sampled { image: &environment.map, sampler: &environment.sampler },
                irradiance,
                params: passes::EnvironmentParams {
                    first_leaf: leaves.start,
                    leaf_count: leaves.len() as u32,
                    n: self.settings.bins,
                    is_turned: u32::from(self.settings.is_turned()),
                },
            };
            recorder.dispatch(&pass, leaves.len());
        }
        let (element_count, spot_count) = (self.elements.count, self.sky.spot_count);
        if spot_count > 0 {
            let pass = passes::LightOfSpots {
                element_normals: &self.elements.normals,
                spots: &self.sky.spots,
                spots_seen: &self.sky.spots_seen,
                irradiance,
                params: passes::LightOfSpotsParams { element_count, spot_count },
            };
            recorder.dispatch(&pass, element_count);
        }
    }
}
