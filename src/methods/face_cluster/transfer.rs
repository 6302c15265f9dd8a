//! One pass of light: pairs refined and transported, what arrived pushed to the leaves, reflected, and pulled up.

use super::placement::NO_ELEMENT;
use super::report::Iteration;
use super::shooting::{IS_LIGHT, Kept, LightPass, Shooters, Tolerance};
use super::{FaceClusterError, FaceClusters, SEEDS, Settings, Stage, Visibility};
use crate::gpu::shaders::methods::face_cluster as passes;
use crate::gpu::shaders::types::{PairCounters, PoolCounters};
use crate::gpu::{Context, Recorder};
use glam::{DVec3, UVec2};
use std::time::Instant;

/// Whole units of the most that can arrive: five bits of room to the largest i32.
const MOST_UNITS: f32 = (1 << 26) as f32;
/// Times the error that transfers of a coarse look may have: it says how much of a light strikes surfaces.
const COARSER: f32 = 100.0;
/// Of a light, what is taken to strike surfaces, at least: what is all in the dark must not be looked into without end.
const LEAST_STRUCK: f32 = 0.01;
/// How far rays to lights start off their surface, as a share of the scene's diagonal.
const RAY_OFFSET: f32 = 1e-5;
/// Where some of its light is blocked, times a receiver's area that an emitter may have before it is split first: four times
/// as wide. A shadow's border is found by splitting receivers: each piece of an emitter is soon too weak for a shadow to
/// matter to it, and all together lose it. What was reflected is not even over a shooter: there it is 1.
const WIDER_EMITTERS: f32 = 16.0;

/// Metres.
pub(super) fn ray_offset(stage: &Stage<'_>) -> f32 {
    RAY_OFFSET * (stage.bounds[1] - stage.bounds[0]).length()
}

impl LightPass<'_> {
    /// Whole units of 1 W/m2.
    fn units(&self) -> f32 {
        MOST_UNITS / self.most.max(f32::MIN_POSITIVE)
    }
}

impl FaceClusters {
    /// Shoots, settles and pulls.
    pub(super) fn shoot(
        &mut self,
        context: &Context,
        stage: &Stage<'_>,
        pass: &LightPass<'_>,
        tolerance: Tolerance,
    ) -> Result<(), FaceClusterError> {
        let clock = Instant::now();
        let shot = match pass.shooters {
            Shooters::Lights(..) => None,
            Shooters::Emission | Shooters::Unshot => Some(self.shot(context)?),
        };
        let units = pass.units();
        let pairs = self.send(context, stage, pass, tolerance)?;
        if pass.kept != Kept::No {
            self.most_light += pass.most;
        }
        let counters = context.download(&self.state.pool)?[0];
        self.settle(context, pass.kept, 1.0 / units, &counters)?;
        self.reflect(context, &counters)?;

        let counters = context.download(&self.state.pool)?[0];
        let received = self.received(context, counters.element_count as usize)?;
        let iteration = Iteration {
            name: pass.name.clone(),
            pairs,
            transfers: counters.transfers,
            rays: counters.rays,
            elements: counters.element_count,
            shot,
            received,
            largest_unshot: f32::from_bits(counters.largest_unshot),
            seconds: clock.elapsed().as_secs_f64(),
        };
        tracing::debug!("{iteration}");
        self.report.iterations.push(iteration);
        Ok(())
    }

    /// For light of so many W.
    pub(super) fn tolerance(&self, power: f32) -> Tolerance {
        let Settings { threshold, bent_light, .. } = self.settings;
        Tolerance {
            threshold: threshold * power,
            bent_light: bent_light * power / self.placement.area.max(f32::MIN_POSITIVE),
        }
    }

    /// What errors of a pass are judged by: the light of it that strikes any surface, as a coarse look says.
    pub(super) fn judge(
        &mut self,
        context: &Context,
        stage: &Stage<'_>,
        pass: &LightPass<'_>,
    ) -> Result<Tolerance, FaceClusterError> {
        let sent = pass.power.max_element();
        self.send(context, stage, pass, self.tolerance(COARSER * sent))?;
        let counters = context.download(&self.state.pool)?[0];
        self.settle(context, Kept::No, 1.0 / pass.units(), &counters)?;
        let struck = self.received(context, counters.element_count as usize)?;
        let struck = struck.into_iter().fold(0.0f64, f64::max) as f32;
        tracing::debug!("{struck} of {sent} W of the light {} strike surfaces", pass.name);
        Ok(self.tolerance(struck.clamp(LEAST_STRUCK * sent, sent)))
    }

    /// Sends a pass's light to all receivers, on which it arrives in whole units; returns the number of pairs looked at.
    fn send(
        &mut self,
        context: &Context,
        stage: &Stage<'_>,
        pass: &LightPass<'_>,
        tolerance: Tolerance,
    ) -> Result<u64, FaceClusterError> {
        let mut counters = context.download(&self.state.pool)?[0];
        (counters.transfers, counters.rays, counters.largest_unshot) = (0, 0, 0);
        context.write(&self.state.pool, &[counters])?;
        let mut recorder = context.recorder("face-cluster")?;
        recorder.fill(&self.state.arriving, 0);
        recorder.submit()?;
        let mut pairs = 0;
        for seeds in self.seeds(pass.shooters).chunks(SEEDS) {
            pairs += self.refine(context, stage, pass, tolerance, seeds)?;
        }
        Ok(pairs)
    }

    /// Every root with every shooter.                                                    [Gobbetti2003 Alg. 1]
    fn seeds(&self, shooters: Shooters<'_>) -> Vec<UVec2> {
        let roots = self.placement.instance_count;
        let shooters: Vec<u32> = match shooters {
            Shooters::Lights(_, count) => (0..count).map(|light| light | IS_LIGHT).collect(),
            Shooters::Emission | Shooters::Unshot => (0..roots).collect(),
        };
        (0..roots).flat_map(|root| shooters.iter().map(move |&shooter| UVec2::new(root, shooter))).collect()
    }

    /// Splits and transports until nothing is left; returns the number of pairs looked at.
    fn refine(
        &mut self,
        context: &Context,
        stage: &Stage<'_>,
        pass: &LightPass<'_>,
        tolerance: Tolerance,
        seeds: &[UVec2],
    ) -> Result<u64, FaceClusterError> {
        self.queue.start(context, seeds)?;
        loop {
            let mut outcome = Ok(false);
            // Between submissions: whether the elements still have room, and the work is still wanted.
            let look = |counters: &PairCounters| -> Result<bool, FaceClusterError> {
                let seen = u64::from(counters.visited);
                stage.watch.step(&pass.name, seen, seen + u64::from(counters.top))?;
                Ok(context.download(&self.state.pool)?[0].is_full != 0)
            };
            let step = |recorder: &mut Recorder<'_>| self.step(recorder, stage, pass, tolerance);
            let counters = self.queue.go_on_while(context, "face-cluster", step, |counters| {
                outcome = look(counters);
                matches!(outcome, Ok(false))
            })?;
            if !outcome? && !look(&counters)? {
                return Ok(counters.visited.into());
            }
            // Pairs that found no room for children wait on the stack.
            self.state.grow(context, &self.settings, self.placement.instance_count)?;
        }
    }

    /// Decides the pairs of a step, makes what is to be split, and puts the halves back.
    fn step(&self, recorder: &mut Recorder<'_>, stage: &Stage<'_>, pass: &LightPass<'_>, tolerance: Tolerance) {
        let (s, queue) = (&self.state, &self.queue);
        self.decide(recorder, stage, pass, tolerance);
        self.grow(recorder, stage, matches!(pass.shooters, Shooters::Emission));
        let expand = passes::Expand {
            taken_pairs: &queue.taken,
            decisions: &s.decisions,
            elements: &s.elements,
            counters: &queue.counters,
            pair_stack: &queue.stack,
            pool: &s.pool,
        };
        recorder.dispatch_indirect(&expand, &queue.groups);
    }

    /// Transports the pairs of a step, or decides how to split them.                       [Gobbetti2003 3.3]
    fn decide(&self, recorder: &mut Recorder<'_>, stage: &Stage<'_>, pass: &LightPass<'_>, tolerance: Tolerance) {
        let (s, p, queue, world) = (&self.state, &self.placement, &self.queue, stage.world);
        let receiver_nodes = self.settings.receiver_rule.nodes().len() as u32;
        let shooter_nodes = self.settings.shooter_rule.nodes().len() as u32;
        let irradiance_functions = self.settings.irradiance_basis.functions();
        let radiosity_functions = self.settings.radiosity_basis.functions();
        let clusters_block = self.settings.visibility == Visibility::Clusters;
        // Both kernels read the same tables, and write the same (`receive.glsl`).
        macro_rules! deciding {
            ($kernel:ident, $($own:tt)*) => {
                passes::$kernel {
                    bvh_nodes: stage.bvh.nodes(),
                    bvh_triangles: stage.bvh.triangles(),
                    triangles: &world.triangles,
                    triangle_materials: &world.triangle_materials,
                    attributes: &world.attributes,
                    materials: &world.materials,
                    triangle_places: &p.places,
                    elements: &s.elements,
                    element_nodes: &s.nodes,
                    node_normals: &s.normals,
                    fits: &s.fits,
                    rules: &s.rules,
                    cluster_skips: &p.skips,
                    clusters: &p.clusters,
                    instances: &p.instances,
                    tree_faces: &p.faces,
                    positions: &world.positions,
                    arriving: &s.arriving,
                    pool: &s.pool,
                    textures: &world.textures,
                    counters: &queue.counters,
                    taken_pairs: &queue.taken,
                    decisions: &s.decisions,
                    $($own)*
                }
            };
        }
        let (Tolerance { threshold, bent_light }, units, alpha_test) = (tolerance, pass.units(), world.has_holes);
        if let Shooters::Lights(lights, _) = pass.shooters {
            let diagonal = (stage.bounds[1] - stage.bounds[0]).length().max(f32::MIN_POSITIVE);
            let (far, ray_offset) = (2.0 * diagonal, RAY_OFFSET * diagonal);
            let constants = passes::TransportLightsConstants {
                receiver_nodes,
                shooter_nodes,
                irradiance_functions,
                alpha_test,
                clusters_block,
            };
            let params = passes::TransportLightsParams { threshold, bent_light, units, far, ray_offset };
            recorder.dispatch_indirect(&deciding!(TransportLights, lights, params, constants), &queue.groups);
        } else {
            let constants = passes::TransportConstants {
                receiver_nodes,
                shooter_nodes,
                irradiance_functions,
                radiosity_functions,
                alpha_test,
                clusters_block,
            };
            let wider = if matches!(pass.shooters, Shooters::Emission) { WIDER_EMITTERS } else { 1.0 };
            let rays_per_node = self.settings.rays_per_node;
            let params = passes::TransportParams { threshold, bent_light, units, rays_per_node, wider };
            recorder.dispatch_indirect(&deciding!(Transport, unshot: &s.unshot, params, constants), &queue.groups);
        }
    }

    /// Makes the children that a step's decisions ask for.                                  [Gobbetti2003 3.3.4]
    fn grow(&self, recorder: &mut Recorder<'_>, stage: &Stage<'_>, is_emission: bool) {
        let (s, p, queue, world) = (&self.state, &self.placement, &self.queue, stage.world);
        let capacity = s.capacity;
        let claim = passes::Grow {
            counters: &queue.counters,
            taken_pairs: &queue.taken,
            decisions: &s.decisions,
            cluster_skips: &p.skips,
            elements: &s.elements,
            pool: &s.pool,
            params: passes::GrowParams { capacity },
        };
        recorder.dispatch_indirect(&claim, &queue.groups);
        let make = passes::MakeChildren {
            clusters: &p.clusters,
            cluster_skips: &p.skips,
            instances: &p.instances,
            tree_faces: &p.faces,
            triangles: &world.triangles,
            positions: &world.positions,
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
            counters: &queue.counters,
            params: passes::MakeChildrenParams { capacity, ray_offset: ray_offset(stage) },
            constants: passes::MakeChildrenConstants {
                receiver_nodes: self.settings.receiver_rule.nodes().len() as u32,
                shooter_nodes: self.settings.shooter_rule.nodes().len() as u32,
                irradiance_functions: self.settings.irradiance_basis.functions(),
                laid_functions: self.settings.receiver_rule.functions(),
                sent_functions: self.settings.shooter_rule.functions(),
            },
        };
        recorder.dispatch_indirect(&make, &queue.groups);
        let inherit = passes::Inherit {
            counters: &queue.counters,
            elements: &s.elements,
            pool: &s.pool,
            unshot: &s.unshot,
            next_unshot: &s.next_unshot,
            direct_irradiance: &s.direct,
            indirect_irradiance: &s.indirect,
            arriving: &s.arriving,
            params: passes::InheritParams { capacity, is_emission: u32::from(is_emission) },
            constants: passes::InheritConstants {
                irradiance_functions: self.settings.irradiance_basis.functions(),
                radiosity_functions: self.settings.radiosity_basis.functions(),
            },
        };
        recorder.dispatch_indirect(&inherit, &queue.groups);
    }

    /// What the roots are about to send, W per channel.
    fn shot(&self, context: &Context) -> Result<[f64; 3], FaceClusterError> {
        let roots = self.placement.instance_count as usize;
        let functions = self.settings.radiosity_basis.functions() as usize;
        let elements = context.download_range(&self.state.elements, 0..roots)?;
        let unshot = context.download_range(&self.state.unshot, 0..roots * functions)?;
        let power = elements.iter().zip(unshot.iter().step_by(functions));
        Ok(power.map(|(e, b)| f64::from(e.area) * b.as_dvec3()).sum::<DVec3>().to_array())
    }

    /// What arrived at the leaves in the pass that was just settled, W per channel.
    fn received(&self, context: &Context, count: usize) -> Result<[f64; 3], FaceClusterError> {
        let functions = self.settings.irradiance_basis.functions() as usize;
        let elements = context.download_range(&self.state.elements, 0..count)?;
        let arrived = context.download_range(&self.state.arriving, 0..count * functions * 9)?;
        let means = context.download_range(&self.state.function_means, 0..count * functions)?;
        let light = arrived.chunks(9 * functions).zip(means.chunks(functions));
        let leaves = elements.iter().zip(light).filter(|(e, _)| e.children == NO_ELEMENT);
        let power = leaves.map(|(e, (words, means))| {
            let normal = e.axis_z * (e.facing[4] - e.facing[5]).max(0.0);
            let of = |(words, mean): (&[i32], &f32), c: usize| -> f32 {
                mean * (0..3).map(|k| normal[k] * f32::from_bits(words[3 * c + k] as u32)).sum::<f32>()
            };
            let along = |c: usize| f64::from(words.chunks(9).zip(means).map(|row| of(row, c)).sum::<f32>());
            DVec3::new(along(0), along(1), along(2))
        });
        Ok(power.sum::<DVec3>().to_array())
    }

    /// Pushes down to the leaves.                                  [Gobbetti2003 3.3.4]
    fn settle(
        &self,
        context: &Context,
        kept: Kept,
        inverse_units: f32,
        counters: &PoolCounters,
    ) -> Result<(), FaceClusterError> {
        let s = &self.state;
        let irradiance_functions = self.settings.irradiance_basis.functions();
        let element_count = counters.element_count;
        let mut recorder = context.recorder("face-cluster")?;
        for level in 0..=counters.deepest_level {
            let pass = passes::Settle {
                elements: &s.elements,
                arriving: &s.arriving,
                irradiance: if kept == Kept::Indirect { &s.indirect } else { &s.direct },
                params: passes::SettleParams {
                    element_count,
                    level,
                    inverse_units,
                    is_kept: u32::from(kept != Kept::No),
                },
                constants: passes::SettleConstants { irradiance_functions },
            };
            recorder.dispatch(&pass, element_count * irradiance_functions);
        }
        recorder.submit()?;
        Ok(())
    }

    /// Leaves reflect what arrived, as the next pass's unshot light, pulled up.            [Gobbetti2003 3.3.4, Eq. 9]
    fn reflect(&self, context: &Context, counters: &PoolCounters) -> Result<(), FaceClusterError> {
        let s = &self.state;
        let irradiance_functions = self.settings.irradiance_basis.functions();
        let radiosity_functions = self.settings.radiosity_basis.functions();
        let element_count = counters.element_count;
        let mut recorder = context.recorder("face-cluster")?;
        let reflect = passes::Reflect {
            elements: &s.elements,
            arriving: &s.arriving,
            function_means: &s.function_means,
            next_unshot: &s.next_unshot,
            params: passes::ReflectParams { element_count },
            constants: passes::ReflectConstants { irradiance_functions, radiosity_functions },
        };
        recorder.dispatch(&reflect, element_count);
        for level in (0..=counters.deepest_level).rev() {
            let pass = passes::Pull {
                elements: &s.elements,
                next_unshot: &s.next_unshot,
                pool: &s.pool,
                params: passes::PullParams { element_count, level },
                constants: passes::PullConstants { radiosity_functions },
            };
            recorder.dispatch(&pass, element_count);
        }
        recorder.submit()?;
        Ok(())
    }
}
