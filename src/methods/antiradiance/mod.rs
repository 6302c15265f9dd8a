//! Antiradiance [Dachsbacher2007]: light crosses surfaces freely, and each surface sends on, as negative light, what hit
//! it; the two cancel where something was in the way.
//!
//! No ray is cast between elements. A hierarchy of leaves exchanges light along links chosen by size and distance alone;
//! each node keeps its light by direction, in bins of equal solid angle. A step carries reflected light less
//! antiradiance along all links, without visibility; at the leaves, what arrived is reflected, and goes on negated where
//! it came from. Iterated, the negative light grows into the shadows.
//!
//! | paper | here | unit | buffer |
//! |---|---|---|---|
//! | P_i, x_i, n_i, a_i | leaf; centre, normal, area | m, –, m2 | [`Hierarchy::nodes`], [`Hierarchy::leaves`] |
//! | omega_j, m | bin and its direction, [`Settings::bins`] | –, 1 | [`DeviceBins::directions`] |
//! | omega_bin | 4 pi / m | sr | – |
//! | I_ex = I_L - I_A | `exitant`, per area of its node | W m^-2 sr^-1 | `antiradiance/exitant` |
//! | L_in | `incident` | W m^-2 sr^-1 | `antiradiance/incident` |
//! | F | weight of a transfer, times the sender's area | 1 | [`Transfers`] |
//! | U | global pass and push | – | [`Transfers::gather`] |
//! | f | Lambert, and GGX at leaves of [`Settings::gloss_threshold`] and more | sr^-1 | [`Gloss`] |
//! | K, J | local pass: reflection, go-through | – | – |
//! | E | `source`, as radiosity | W/m2 | `antiradiance/source` |
//! | – | `means`, `peaks`: what arrived before anything was taken away | W m^-2 sr^-1, 1 | `antiradiance/means`, `antiradiance/peaks` |
//! | A | the negative part of `exitant` | W m^-2 sr^-1 | `antiradiance/exitant` |
//!
//! **Per frame without link work:** lights, emission that stays where it is, albedo, the environment. **With new form
//! factors over standing links:** surfaces that move within [`Settings::motion_margin`]. **With new links:** any motion
//! ([`Antiradiance::follow`]).
//!
//! Differs from [Dachsbacher2007]: a leaf is both sides of its vertex's cell and sits at the cell's centre; the
//! cosines and bins at leaves are those of the actual direction; a sender is read in every bin that it covers, a flat
//! one by samples of its rectangle, from close by as the rectangle's sides cut the bins (selectable); open surfaces
//! block light that meets their backs; incident radiance may not fall far below zero (selectable); both schemes are
//! damped where changes grow; flat parts of rounded meshes are nodes of their own; farther senders are discs, never more
//! than half of the sphere; links are made on the device, none between solids back to back; what a leaf receives along
//! links of the nodes above is scaled to what an even light would bring to the leaf itself (selectable). A patch of a
//! flat part is made of the cells of its vertices, one or many ([`Settings::leaves`]). Direct light of punctual lights
//! and sampled emitters is that of shadow rays. Elements inside of other things, dark by their neighbours' negative
//! light, show what arrives at the nearest in the open (`stages::stand_ins`). Glossy leaves reflect their incident bins
//! through their lobes, none narrower than a bin.
//! What it does not do: transparent surfaces, refinement by the light that is sent.
//!
//! [Dachsbacher2007]: crate::methods::PAPERS

mod bin_count;
mod carried;
mod gloss;
mod linking;
mod links;
mod report;
mod scheme;
mod settings;
mod tables;
mod views;

pub use bin_count::BinCount;
pub use gloss::Gloss;
pub use linking::{LinkingError, TransferWindow, Transfers};
pub use links::{NodeLinks, link_solid_angle};
pub use report::Report;
pub use scheme::{Residual, growth_rate};
pub use settings::{Backs, Leaves, Scheme, Settings};
pub use tables::{LocalStep, TableWindow, Tables, binned};
pub use views::{DebugView, half};

pub use super::explicit_visibility::Stage;
use crate::gpu::shaders::methods::antiradiance as passes;
use crate::gpu::shaders::types::Ray;
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::scene::facets::Facets;
use crate::scene::patches::Patches;
use crate::scene::surfaces::Surfaces;
use crate::stages::direction_bins::DeviceBins;
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::emitters::Emitters;
use crate::stages::hidden_parts::HiddenPartsError;
use crate::stages::hierarchy::{Behind, Hierarchy, HierarchyPlan};
use crate::stages::punctual;
use crate::stages::splats::Splats;
use crate::stages::stand_ins::StandIns;
use crate::stages::work::{Interrupted, Watch};
use crate::stages::world::World;
use glam::Vec3;

/// Why the method cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum AntiradianceError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Linking(#[from] LinkingError),
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    #[error(transparent)]
    HiddenParts(#[from] HiddenPartsError),
    #[error(
        "antiradiance: {what} of {nodes} nodes and {bins} bins needs {needed} bytes, {available} are available; lower \
         bins or --elements{}", if *.half { "" } else { ", or set half_tables=true" }
    )]
    OutOfMemory { what: &'static str, nodes: u64, bins: u32, half: bool, needed: u64, available: u64 },
    #[error(
        "antiradiance grows: after {steps} steps of the {scheme} scheme changes are multiplied by about {rate:.2} each \
         step (spectral radius above 1){}; lower undershoot, or set scheme=asymmetric, spread=cone, or fewer bins",
        if *.scheme == "symmetric" { ", though damped" } else { "" }
    )]
    Growth { steps: u32, rate: f64, scheme: &'static str },
}

/// The method on one scene: hierarchy, links, tables.
pub struct Antiradiance {
    settings: Settings,
    elements: Elements,
    stand_ins: StandIns,
    emitters: Emitters,
    hierarchy: Hierarchy,
    splats: Splats,
    bins: DeviceBins,
    links: NodeLinks,
    transfers: Transfers,
    tables: Tables,
    state: State,
    residuals: Vec<Residual>,
    /// Whether the tables hold bounces of this solution: without any they hold direct light, or another solution.
    has_bounced: bool,
    /// Reflected light so far, of the sources' light.
    bounced: f32,
    /// Power of the sources' light, W.
    source_power: f64,
    /// Of the last symmetric iteration: share of its steps.
    damping: f32,
    kept: Option<carried::Kept>,
    report: Report,
}

/// Light by element, W/m2, and scratch.
struct State {
    irradiance: Buffer<Vec3>,
    punctual: Buffer<Vec3>,
    /// From emitters and the environment.
    direct: Buffer<Vec3>,
    indirect: Buffer<Vec3>,
    smoothed: Buffer<Vec3>,
    /// Indirect light as the eye sees it.
    shown: Buffer<Vec3>,
    /// Direct light of emitters and the environment as the eye sees it.
    shown_direct: Buffer<Vec3>,
    /// Per light, then per element; 0..1.
    visibility: Buffer<f32>,
    /// Shadow rays of a batch, and their answers.
    rays: Buffer<Ray>,
    is_free: Buffer<u32>,
}

/// Shadow rays of a batch, where a buffer may be that large.
const SHADOW_RAYS: usize = 1 << 19;

impl Antiradiance {
    /// Makes elements, hierarchy and links, and casts all shadow rays: everything but the light itself.
    pub fn prepare(context: &Context, stage: &Stage<'_>, settings: Settings) -> Result<Self, AntiradianceError> {
        Self::prepare_within(context, stage, settings, u64::MAX)
    }

    /// As [`Self::prepare`], within `budget` bytes of device memory.
    pub fn prepare_within(
        context: &Context,
        stage: &Stage<'_>,
        settings: Settings,
        budget: u64,
    ) -> Result<Self, AntiradianceError> {
        let topology = ElementTopology::new(stage.scene, stage.geometry, stage.rest_positions);
        let elements = Elements::new(context, topology, stage.rest_positions, stage.world, settings.ray_offset)?;
        let stand_ins = stage.stand_ins(context, &elements)?;
        let (choice, samples) = (settings.emitters, settings.emitter_samples);
        let emitters = Emitters::new(context, stage.geometry, stage.rest_positions, &elements, choice, samples)?;

        let surfaces = Surfaces::new(stage.geometry, stage.rest_positions);
        let facets = Facets::new(stage.geometry, stage.rest_positions, &surfaces);
        let behind = match settings.backs {
            Backs::Open => Behind::BlockOpen,
            Backs::All => Behind::BlockAll,
            Backs::None => Behind::Pass,
        };
        let moves = stage.moving_parts();
        let margin = |vertex: u32| {
            let part = stage.geometry.vertex_part[vertex as usize];
            if moves[part as usize] { settings.motion_margin } else { 0.0 }
        };
        let patches = patches(stage, &elements, &facets, &settings);
        let plan = HierarchyPlan::new(&elements, &surfaces, &facets, &patches, behind, margin);
        let budget = check_memory(context, &plan, &settings, budget)?;
        let hierarchy = Hierarchy::new(context, plan, &elements, stage.world)?;
        let splats = Splats::new(context, &hierarchy, &facets, stage.geometry, &elements)?;
        let bins = DeviceBins::new(context, settings.bins.octant_side(), settings.spread)?;
        let (threshold, bin_count) = (settings.gloss_threshold, settings.bins.get());
        let gloss =
            Gloss::new(context, &hierarchy, &elements, stage.world, threshold, (bin_count, settings.half_tables))?;
        let (environment, half, undershoot) = (stage.environment, settings.half_tables, settings.undershoot);
        let tables = Tables::new(context, &hierarchy, &bins, environment, half, undershoot, gloss)?;
        let mut recorder = context.recorder("antiradiance")?;
        tables.update_norms(&mut recorder, &hierarchy, &bins);
        tables.update_albedo(&mut recorder, &hierarchy, &elements);
        recorder.submit()?;

        let links = NodeLinks::refine(context, &hierarchy, link_solid_angle(&settings), 0, budget)?;
        links.even_out(context, &hierarchy, &settings, &tables.scales)?;
        let transfers = Transfers::new(context, &links, &hierarchy, &bins, &tables.cosine_norms, &settings, budget)?;
        let mut method = Self {
            report: Report::new(&settings, &elements, &emitters, &hierarchy, &links, &transfers),
            state: State::new(context, &elements, stage.world.light_count)?,
            residuals: Vec::new(),
            has_bounced: false,
            bounced: 1.0,
            source_power: 0.0,
            damping: settings.damping,
            kept: None,
            settings,
            elements,
            stand_ins,
            emitters,
            hierarchy,
            splats,
            bins,
            links,
            transfers,
            tables,
        };
        method.trace(context, stage)?;
        Ok(method)
    }

    /// Follows surfaces that moved or deformed (the world is posed, the tracer refitted): links made anew, or, with
    /// `standing_links`, new form factors over the links there are.        [Dachsbacher2007 3.3]
    pub fn follow(
        &mut self,
        context: &Context,
        stage: &Stage<'_>,
        standing_links: bool,
    ) -> Result<(), AntiradianceError> {
        let mut recorder = context.recorder("antiradiance")?;
        self.elements.place(&mut recorder, stage.world);
        self.elements.update_materials(&mut recorder, stage.world);
        self.hierarchy.place(&mut recorder, &self.elements, stage.world);
        self.splats.place(&mut recorder, &self.hierarchy);
        self.tables.update_norms(&mut recorder, &self.hierarchy, &self.bins);
        self.tables.update_albedo(&mut recorder, &self.hierarchy, &self.elements);
        recorder.submit()?;
        if !standing_links {
            let (solid_angle, expected) = (link_solid_angle(&self.settings), self.links.count);
            self.links = NodeLinks::refine(context, &self.hierarchy, solid_angle, expected, u64::MAX)?;
        }
        self.links.even_out(context, &self.hierarchy, &self.settings, &self.tables.scales)?;
        // The old ones go first: two sets may not fit.
        self.transfers.windows.clear();
        self.transfers = Transfers::new(
            context,
            &self.links,
            &self.hierarchy,
            &self.bins,
            &self.tables.cosine_norms,
            &self.settings,
            u64::MAX,
        )?;
        self.report =
            Report::new(&self.settings, &self.elements, &self.emitters, &self.hierarchy, &self.links, &self.transfers);
        self.trace(context, stage)
    }

    /// Casts the shadow rays to lights and emitters anew.
    pub fn trace(&mut self, context: &Context, stage: &Stage<'_>) -> Result<(), AntiradianceError> {
        let State { rays, is_free, visibility, .. } = &self.state;
        let (tracer, world, elements) = (&stage.tracer, stage.world, &self.elements);
        let mut recorder = context.recorder("antiradiance")?;
        recorder.scope("trace emitters", |recorder| {
            self.emitters.trace(recorder, tracer, world, elements, rays, is_free);
        });
        recorder.scope("trace lights", |recorder| {
            punctual::trace_visibility(recorder, tracer, world, elements, rays, is_free, visibility);
        });
        Ok(recorder.submit()?)
    }

    /// Takes over the world's present materials: no link work. Which leaves are glossy stays.
    pub fn update_materials(&self, recorder: &mut Recorder<'_>, world: &World) {
        self.elements.update_materials(recorder, world);
        self.tables.update_albedo(recorder, &self.hierarchy, &self.elements);
        gloss::measure(recorder, &self.hierarchy, &self.elements, world, &self.tables.gloss.lobes);
    }

    /// The light of direct illumination and `bounces` more.                                 [Dachsbacher2007 4.2]
    pub fn solve(
        &mut self,
        context: &Context,
        world: &World,
        bounces: u32,
        watch: &dyn Watch,
    ) -> Result<(), AntiradianceError> {
        self.residuals.clear();
        self.solve_linked(context, watch)?;
        let mut recorder = context.recorder("antiradiance")?;
        recorder.scope("direct", |recorder| self.direct_light(recorder, world));
        recorder.submit()?;
        self.solve_indirect(context, bounces, watch)?;

        let mut recorder = context.recorder("antiradiance")?;
        recorder.scope("to elements", |recorder| {
            self.to_elements(recorder, &self.tables.irradiance, &self.state.indirect);
            self.stand_ins.take_over(recorder, &self.state.indirect);
            if self.settings.smoothing {
                let feature_angle = self.settings.feature_angle.to_radians();
                self.elements.smooth(recorder, feature_angle, &self.state.indirect, &self.state.smoothed);
                self.stand_ins.take_over(recorder, &self.state.smoothed);
            }
        });
        Ok(recorder.submit()?)
    }

    /// Direct light on the elements: by kind, and what needs no link in `irradiance`.
    fn direct_light(&self, recorder: &mut Recorder<'_>, world: &World) {
        let (elements, s) = (&self.elements, &self.state);
        punctual::irradiance(recorder, world, elements, &s.visibility, &s.punctual);
        self.emitters.irradiance(recorder, world, elements, &s.irradiance);
        self.to_elements(recorder, &self.tables.linked, &s.direct);
        elements.add(recorder, &s.irradiance, &s.direct);
        elements.add(recorder, &s.punctual, &s.irradiance);
        self.reflect_direct(recorder, world);
        // Last: hidden elements reflect nothing of it.
        self.stand_ins.take_over(recorder, &s.punctual);
        self.stand_ins.take_over(recorder, &s.direct);
    }

    /// The leaves' sources: what they emit along links, or what they reflect of all direct light.
    fn sources(&self, recorder: &mut Recorder<'_>, is_emission: bool) {
        let leaf_count = self.hierarchy.leaf_count();
        let pass = passes::Sources {
            leaves: &self.hierarchy.leaves,
            members: &self.hierarchy.members,
            back_elements: &self.elements.back_elements,
            area: &self.elements.area,
            albedo: &self.elements.albedo,
            emission: &self.elements.emission,
            is_sampled: &self.emitters.is_sampled,
            direct_irradiance: &self.state.irradiance,
            linked_irradiance: &self.tables.linked,
            source: &self.tables.source,
            radiosity: &self.tables.radiosity,
            params: passes::SourcesParams { leaf_count, is_emission: u32::from(is_emission) },
        };
        recorder.dispatch(&pass, leaf_count);
    }

    fn to_elements(&self, recorder: &mut Recorder<'_>, leaf_irradiance: &Buffer<Vec3>, irradiance: &Buffer<Vec3>) {
        let vertex_count = self.elements.back_elements.len() as u32;
        let pass = passes::ToElements {
            share_offsets: &self.hierarchy.share_offsets,
            shares: &self.hierarchy.shares,
            back_elements: &self.elements.back_elements,
            leaf_irradiance,
            irradiance,
            params: passes::ToElementsParams { vertex_count },
        };
        recorder.dispatch(&pass, vertex_count);
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

    /// Whose light an element shows: its own, unless it stands inside of something.
    pub fn shown_by(&self, element: u32) -> u32 {
        self.stand_ins.of(element)
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    pub fn elements(&self) -> &Elements {
        &self.elements
    }

    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    /// Its leaves on flat surfaces, for display.
    pub fn splats(&self) -> &Splats {
        &self.splats
    }

    pub fn bins(&self) -> &DeviceBins {
        &self.bins
    }

    pub fn links(&self) -> &NodeLinks {
        &self.links
    }

    pub fn transfers(&self) -> &Transfers {
        &self.transfers
    }

    pub fn tables(&self) -> &Tables {
        &self.tables
    }

    /// Of the last solve, step by step.
    pub fn residuals(&self) -> &[Residual] {
        &self.residuals
    }

    /// Share of its steps that the last symmetric iteration took.
    pub fn damping(&self) -> f32 {
        self.damping
    }

    /// What was counted when the links were last made.
    pub fn report(&self) -> &Report {
        &self.report
    }
}

impl State {
    fn new(context: &Context, elements: &Elements, light_count: u32) -> Result<Self, GpuError> {
        let count = elements.count as usize;
        let shadow_rays = SHADOW_RAYS.min(context.limits().storage_buffer_bytes as usize / size_of::<Ray>());
        Ok(Self {
            irradiance: context.buffer("antiradiance/direct irradiance", count)?,
            punctual: context.buffer("antiradiance/punctual", count)?,
            direct: context.buffer("antiradiance/direct", count)?,
            indirect: context.buffer("antiradiance/indirect", count)?,
            smoothed: context.buffer("antiradiance/smoothed", count)?,
            shown: context.buffer("antiradiance/shown", count)?,
            shown_direct: context.buffer("antiradiance/shown direct", count)?,
            visibility: context.buffer("antiradiance/visibility", count * light_count as usize)?,
            rays: context.buffer("antiradiance/shadow rays", shadow_rays)?,
            is_free: context.buffer("antiradiance/is free", shadow_rays)?,
        })
    }
}

/// Refuses tables that do not fit; what is left of `budget` for links.
fn check_memory(
    context: &Context,
    plan: &HierarchyPlan,
    settings: &Settings,
    budget: u64,
) -> Result<u64, AntiradianceError> {
    let (nodes, bins, half) = (plan.nodes.len() as u64, settings.bins.get(), settings.half_tables);
    let refuse =
        |what, needed, available| Err(AntiradianceError::OutOfMemory { what, nodes, bins, half, needed, available });
    let table = Tables::table_bytes(nodes as u32, bins, half);
    let cells = 4 * (nodes * u64::from(bins) + 1);
    let largest = context.limits().storage_buffer_bytes;
    if cells > largest || cells > 4 * u64::from(u32::MAX) {
        return refuse("a list of cells", cells, largest.min(4 * u64::from(u32::MAX)));
    }
    if Tables::window_bins(nodes as u32, half, largest).is_none() {
        return refuse("a window of eight bins", Tables::table_bytes(nodes as u32, 8, half), largest);
    }
    let needed = 2 * table + cells;
    let available = budget.min(context.available_bytes());
    if needed > available {
        return refuse("the tables", needed, available);
    }
    Ok(budget - needed)
}

/// Which vertices make a leaf together.                                                     [Dachsbacher2007 3.1, 4.3]
fn patches(stage: &Stage<'_>, elements: &Elements, facets: &Facets, settings: &Settings) -> Patches {
    let positions = stage.rest_positions;
    let incident = &elements.topology.incident;
    let vertices: Vec<u32> = (0..incident.row_count()).filter(|&vertex| !incident.row(vertex).is_empty()).collect();
    match settings.leaves {
        Leaves::Vertices => Patches::of_vertices(&vertices, positions, facets),
        Leaves::Patches => {
            let (low, high) = positions.iter().fold((Vec3::MAX, Vec3::MIN), |(a, b), &p| (a.min(p), b.max(p)));
            Patches::of_squares(&vertices, positions, facets, settings.patch_side * (high - low).length())
        }
    }
}
