//! Implicit visibility [Dong2007]: each element keeps, for each direction, only its shortest link. No ray is cast.
//!
//! Directions are the texels of a cube map about each element, its bins. Links are made between nodes of surfel trees
//! that fill no more than a bin of each other; each goes into the bins it covers, and each bin keeps its nearest.
//! Pushed down to the leaves, the winners are what each element sees: light is gathered from them, and a bin without a
//! winner sees the environment. All of it is made anew each frame, so that everything may move and deform.
//!
//! | paper | here | unit | buffer |
//! |---|---|---|---|
//! | N_bin = 6 N N | [`Settings::bins`] is N | – | – |
//! | Omega_bin | `bin_solid_angles`; times cosine, `bin_vectors` . n | sr | `implicit/bin ...` |
//! | x, n_x | receiver | m, – | `implicit/receivers` |
//! | y, n_y, A_y | surfel: centre, normal, area | m, –, m2 | `quadtree/surfels` |
//! | y_s, the closest in a bin | winner | – | `implicit/winners` |
//! | f_r | albedo / pi | 1/sr | [`Elements::albedo`] |
//! | unshot energy | radiosity of nodes | W/m2 | `implicit/node radiosity` |
//!
//! **Per frame with new links** ([`ImplicitVisibility::link`]): anything that moves or deforms. **Without:** lights,
//! materials, the environment.
//!
//! Differs from [Dong2007]: neighbouring receivers find their senders by one walk over the trees, which a queue of pairs
//! would only scatter; leaves fill all the bins whose centres see their own triangles and nodes above leaves those that see their
//! ellipse, at the distance there, so that no light leaks where leaves are larger than bins, and nothing blocks beyond
//! its outline; the winner's weight is the bin's (the paper's Eq. 5 is a setting); points on small emitters and what is
//! bright in an environment are hidden by the surfaces of the winners around the way (`shadows`, `sky`); elements inside of
//! things look from the open beside them, which rays find once (`stages::open_places`); punctual lights cast shadow rays; glossy elements
//! send tables of directions along the links (`gloss`). Not done: mirrors sharper than a bin, holes of alpha masks.
//!
//! [Dong2007]: crate::methods::PAPERS

pub mod bins;
mod carried;
mod gloss;
mod linking;
mod report;
mod settings;
mod shadows;
mod sky;
mod views;
pub mod windows;

pub use linking::{ImplicitError, Linking, Window};
pub use report::Report;
pub use settings::{Footprint, Frames, Settings, Transport};
pub use views::DebugView;

use crate::gpu::shaders::elements::{EmittedRadiosity, EmittedRadiosityParams, FillUnresolved, FillUnresolvedParams};
use crate::gpu::shaders::methods::implicit_visibility as passes;
use crate::gpu::shaders::types::Ray;
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::methods::explicit_visibility::Stage;
use crate::scene::charts::{self, Charts};
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::quadtree::{Quadtrees, topology::QuadtreeTopology};
use crate::stages::world::World;
use crate::stages::{emitters::Emitters, punctual};
use glam::Vec3;
use gloss::Gloss;
use linking::Sizes;
use shadows::Shadows;
use sky::Sky;

/// The method on one scene.
pub struct ImplicitVisibility {
    settings: Settings,
    pub charts: Charts,
    elements: Elements,
    trees: Quadtrees,
    emitters: Emitters,
    linking: Linking,
    shadows: Shadows,
    gloss: Gloss,
    state: State,
    sky: Sky,
    report: Report,
}

/// Light on the elements, W/m2, and scratch; `element_count` entries each unless said otherwise.
struct State {
    radiosity: Buffer<Vec3>,
    /// `node_count` entries.
    node_radiosity: Buffer<Vec3>,
    irradiance: Buffer<Vec3>,
    punctual: Buffer<Vec3>,
    /// From emitters and the environment.
    direct: Buffer<Vec3>,
    indirect: Buffer<Vec3>,
    smoothed: Buffer<Vec3>,
    /// As the eye sees them; empty where nothing is glossy.
    shown_direct: Buffer<Vec3>,
    shown_indirect: Buffer<Vec3>,
    /// Thousandths of backs seen.
    outcomes: Buffer<u32>,
    /// Per light, then per element; 0..1.
    visibility: Buffer<f32>,
    /// Shadow rays of a batch, and their answers.
    rays: Buffer<Ray>,
    is_free: Buffer<u32>,
}

/// What is gathered along links.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sent {
    /// Along light links alone, evenly.
    Emitted,
    /// Along all, glossy nodes by their tables.
    Reflected,
}

/// Shadow rays of a batch.
const BATCH_RAYS: usize = 1 << 18;

impl ImplicitVisibility {
    /// Charts, trees, and room for links: what is done once. Follow with [`Self::link`].
    pub fn prepare(context: &Context, stage: &Stage<'_>, settings: Settings) -> Result<Self, ImplicitError> {
        let Stage { scene, geometry, rest_positions, environment, world, .. } = *stage;
        let topology = ElementTopology::new(scene, geometry, rest_positions);
        let options = charts::Options { model_uv: settings.model_charts, ..charts::Options::default() };
        let charts = charts::unwrap(&charts::Surface::of(geometry, rest_positions), &options);
        let tree_topology = QuadtreeTopology::new(&charts, &topology.vertices); // 4.1

        let sizes = Sizes::new(context, &tree_topology, &settings);
        let (count, light_count) = (topology.vertices.len(), world.light_count as usize);
        let light_words = 8 * 3
            + 1
            + light_count
            + (settings.emitter_samples.div_ceil(32) + settings.sky_spots.div_ceil(32)) as usize
            + 1;
        let ray_bytes = BATCH_RAYS * (size_of::<Ray>() + 4) * usize::from(light_count > 0);
        let needed = sizes.bytes()
            + Elements::bytes_needed(&topology)
            + Quadtrees::bytes_needed(&tree_topology, topology.incident.values.len())
            + Shadows::bytes_needed(&settings)
            + (4 * count * light_words + ray_bytes) as u64;
        let (available, elements) = (context.available_bytes(), count as u64);
        if needed > available {
            return Err(ImplicitError::OutOfMemory { needed, available, elements, bins: settings.bin_count() });
        }

        let elements = stage.elements(context, topology, settings.ray_offset)?;
        let trees = Quadtrees::new(context, tree_topology, elements.topology.incident.values.len())?;
        let (choice, samples) = (settings.emitters, settings.emitter_samples);
        let emitters = Emitters::new(context, geometry, rest_positions, &elements, choice, samples)?;
        let linking = Linking::new(context, &trees, &settings, sizes)?;
        let shadows = Shadows::new(context, &trees, &elements, &emitters, &geometry.triangles, &settings)?;
        let glossy = Gloss::find(context, &trees, &elements, world, settings.glossy)?;
        let (needed, available) =
            (Gloss::bytes_needed(&glossy.0, &trees, settings.glossy_bins), context.available_bytes());
        if needed > available {
            return Err(ImplicitError::GlossOutOfMemory { needed, available, nodes: glossy.0.len() });
        }
        let gloss = Gloss::new(context, &trees, glossy, settings.glossy_bins)?;
        let state = State::new(context, &elements, &trees, world.light_count, !gloss.is_empty())?;
        let sky = Sky::new(context, environment, &elements, &settings)?;
        Ok(Self {
            report: Report {
                glossy: gloss.leaf_count(),
                sky_spots: sky.spot_count,
                ..Report::new(&settings, &charts, &elements, &trees, &linking)
            },
            charts,
            elements,
            trees,
            emitters,
            linking,
            shadows,
            gloss,
            state,
            sky,
            settings,
        })
    }

    /// Follows the world's present places: all that Algorithm 1 does for a frame but the light.        [Dong2007 4.2]
    pub fn link(&mut self, context: &Context, stage: &Stage<'_>) -> Result<(), ImplicitError> {
        let world = stage.world;
        let mut recorder = context.recorder("implicit-visibility")?;
        recorder.scope("update elements", |recorder| {
            self.elements.place(recorder, world);
            self.update_materials(recorder, world);
            self.trees.pull_surfels(recorder, &self.elements, world); // UpdateElements
            self.linking.place(recorder, world, &self.elements, &self.trees, &self.settings);
        });
        recorder.submit()?;

        // CreateHierarchicalLinks, RefineHierarchicalLinks, PushdownLinks
        (self.report.pairs_visited, self.report.links_proposed) =
            self.linking.link(context, &self.trees, &self.settings, stage.watch)?;

        let mut recorder = context.recorder("implicit-visibility")?;
        recorder.scope("see lights", |recorder| {
            self.survey(recorder);
            let seen_by = (&self.trees, &self.elements, &self.emitters);
            self.shadows.see_emitters(recorder, world, seen_by, &self.linking, &self.settings);
            self.sky.see(recorder, (&self.trees, &self.elements), &self.linking, &self.settings);
            let State { rays, is_free, visibility, .. } = &self.state;
            self.report.light_rays =
                punctual::trace_visibility(recorder, &stage.tracer, world, &self.elements, rays, is_free, visibility);
        });
        recorder.submit()?;
        self.report.links_kept = context.download(&self.linking.counts)?[0].kept.into();
        Ok(())
    }

    /// Counts, and the lists of light links.
    fn survey(&self, recorder: &mut Recorder<'_>) {
        recorder.fill(&self.state.outcomes, 0);
        let has_emitters = self.emitters.plan.linked_parts > 0;
        if has_emitters {
            self.send_emission(recorder);
        }
        for window in &self.linking.windows {
            let leaves = window.plan.leaves();
            recorder.fill(&window.light_bins, 0);
            let pass = passes::Survey {
                winners: &window.winners,
                receivers: &self.linking.receivers,
                leaf_elements: &self.trees.leaf_elements,
                bin_vectors: &self.linking.bin_vectors,
                outcomes: &self.state.outcomes,
                link_counts: &self.linking.counts,
                node_radiosity: &self.state.node_radiosity,
                light_bins: &window.light_bins,
                params: passes::SurveyParams {
                    first_leaf: leaves.start,
                    leaf_count: leaves.len() as u32,
                    bin_count: self.settings.bin_count(),
                    has_emitters: u32::from(has_emitters),
                },
            };
            recorder.dispatch(&pass, leaves.len());
        }
    }

    /// Takes over the world's present materials; links stay. Emission may change as long as the same parts emit in
    /// about the same proportion; for others, link anew.
    pub fn update_materials(&self, recorder: &mut Recorder<'_>, world: &World) {
        self.elements.update_materials(recorder, world);
        self.gloss.update_materials(recorder, &self.elements, world);
    }

    /// The light of direct illumination and `bounces` more.                                     [Dong2007 4.3]
    pub fn solve(&self, recorder: &mut Recorder<'_>, world: &World, bounces: u32) {
        let (elements, s) = (&self.elements, &self.state);
        recorder.scope("direct", |recorder| {
            self.direct_light(recorder, world);
            self.reflect_direct(recorder, world);
        });
        elements.reflect(recorder, &s.irradiance, &s.radiosity);

        recorder.fill(&s.indirect, 0);
        for bounce in 1..=bounces {
            recorder.scope(format_args!("bounce {bounce}"), |recorder| {
                self.trees.pull_radiosity(recorder, &s.radiosity, &s.node_radiosity); // PullupEnergy
                self.gloss.send(recorder, &self.trees, &s.node_radiosity);
                self.gather(recorder, Sent::Reflected); // ComputeIlluminateLeafNodes: Eq. 5
                self.reflect_bounce(recorder);
                elements.add(recorder, &s.irradiance, &s.indirect);
                elements.reflect(recorder, &s.irradiance, &s.radiosity);
            });
        }
        if self.settings.smoothing {
            elements.smooth(recorder, self.settings.feature_angle.to_radians(), &s.indirect, &s.smoothed);
        }
    }

    /// Irradiance that was not reflected before: by kind, and the sum in `irradiance`.
    fn direct_light(&self, recorder: &mut Recorder<'_>, world: &World) {
        let (elements, s) = (&self.elements, &self.state);
        punctual::irradiance(recorder, world, elements, &s.visibility, &s.punctual);
        self.fill_unresolved(recorder, &s.punctual);

        self.emitters.irradiance(recorder, world, elements, &s.direct);
        if self.emitters.plan.linked_parts > 0 {
            self.send_emission(recorder);
            self.gather(recorder, Sent::Emitted);
            elements.add(recorder, &s.irradiance, &s.direct);
        }
        if !self.sky.is_black() {
            self.gather_environment(recorder);
            elements.add(recorder, &s.irradiance, &s.direct);
        }
        self.fill_unresolved(recorder, &s.direct);

        recorder.copy(&s.direct, &s.irradiance);
        elements.add(recorder, &s.punctual, &s.irradiance);
    }

    /// Emission that comes along links, to all nodes.
    fn send_emission(&self, recorder: &mut Recorder<'_>) {
        let (elements, s) = (&self.elements, &self.state);
        let pass = EmittedRadiosity {
            emission: &elements.emission,
            is_sampled: &self.emitters.is_sampled,
            radiosity: &s.radiosity,
            params: EmittedRadiosityParams { element_count: elements.count },
        };
        recorder.dispatch(&pass, elements.count);
        self.trees.pull_radiosity(recorder, &s.radiosity, &s.node_radiosity);
    }

    /// `irradiance` of all elements from their winners.
    fn gather(&self, recorder: &mut Recorder<'_>, sent: Sent) {
        let s = &self.state;
        recorder.fill(&s.irradiance, 0);
        for window in &self.linking.windows {
            let leaves = window.plan.leaves();
            let pass = passes::Gather {
                winners: &window.winners,
                receivers: &self.linking.receivers,
                leaf_elements: &self.trees.leaf_elements,
                bin_vectors: &self.linking.bin_vectors,
                surfels: &self.trees.surfels,
                node_radiosity: &s.node_radiosity,
                glossy_of_node: &self.gloss.glossy_of_node,
                specular: &self.gloss.specular,
                irradiance: &s.irradiance,
                light_bins: &window.light_bins,
                constants: passes::GatherConstants {
                    transport: self.settings.transport_kind(),
                    of_emitters: u32::from(sent == Sent::Emitted),
                    table_side: if sent == Sent::Reflected && !self.gloss.is_empty() { self.gloss.side } else { 0 },
                },
                params: passes::GatherParams {
                    first_leaf: leaves.start,
                    leaf_count: leaves.len() as u32,
                    bin_count: self.settings.bin_count(),
                },
            };
            recorder.dispatch(&pass, leaves.len());
        }
        self.fill_unresolved(recorder, &s.irradiance);
    }

    /// Elements inside other things take over their neighbours' light.
    fn fill_unresolved(&self, recorder: &mut Recorder<'_>, irradiance: &Buffer<Vec3>) {
        let pass = FillUnresolved {
            outcomes: &self.state.outcomes,
            ring_offsets: &self.elements.ring_offsets,
            ring: &self.elements.ring,
            element_normals: &self.elements.normals,
            irradiance,
            params: FillUnresolvedParams { element_count: self.elements.count, ray_count: 1000 },
        };
        recorder.dispatch(&pass, self.elements.count);
    }

    /// Per vertex: the element of its back, u32::MAX where the surface is one-sided.
    pub fn back_elements(&self) -> &Buffer<u32> {
        &self.elements.back_elements
    }

    /// Sum over bounces, smoothed if the settings say so; W/m2 per element.
    pub fn indirect_irradiance(&self) -> &Buffer<Vec3> {
        if self.settings.smoothing { &self.state.smoothed } else { &self.state.indirect }
    }

    /// From emitters and the environment, unreflected; W/m2 per element.
    pub fn direct_irradiance(&self) -> &Buffer<Vec3> {
        &self.state.direct
    }

    /// From punctual lights, unreflected; W/m2 per element.
    pub fn punctual_irradiance(&self) -> &Buffer<Vec3> {
        &self.state.punctual
    }

    /// Of the last bounce alone, unsmoothed; W/m2 per element. All direct light after a solve without bounces.
    pub fn last_irradiance(&self) -> &Buffer<Vec3> {
        &self.state.irradiance
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    pub fn elements(&self) -> &Elements {
        &self.elements
    }

    pub fn trees(&self) -> &Quadtrees {
        &self.trees
    }

    /// Points on sampled emitters, and who sees them.
    pub fn emitters(&self) -> &Emitters {
        &self.emitters
    }

    pub fn linking(&self) -> &Linking {
        &self.linking
    }

    /// What was counted when the links were last made.
    pub fn report(&self) -> &Report {
        &self.report
    }
}

impl State {
    fn new(
        context: &Context,
        elements: &Elements,
        trees: &Quadtrees,
        light_count: u32,
        is_glossy: bool,
    ) -> Result<Self, GpuError> {
        let count = elements.count as usize;
        let glossy_count = if is_glossy { count } else { 0 };
        // A single element's shadow rays to one light fit in any case.
        let rays = if light_count > 0 { BATCH_RAYS } else { 0 };
        Ok(Self {
            radiosity: context.buffer("implicit/radiosity", count)?,
            node_radiosity: context.buffer("implicit/node radiosity", trees.topology.node_count() as usize)?,
            irradiance: context.buffer("implicit/irradiance", count)?,
            punctual: context.buffer("implicit/punctual", count)?,
            direct: context.buffer("implicit/direct", count)?,
            indirect: context.buffer("implicit/indirect", count)?,
            smoothed: context.buffer("implicit/smoothed", count)?,
            shown_direct: context.buffer("implicit/shown direct", glossy_count)?,
            shown_indirect: context.buffer("implicit/shown indirect", glossy_count)?,
            outcomes: context.buffer("implicit/outcomes", count)?,
            visibility: context.buffer("implicit/visibility", count * light_count as usize)?,
            rays: context.buffer("implicit/shadow rays", rays)?,
            is_free: context.buffer("implicit/is free", rays)?,
        })
    }
}
