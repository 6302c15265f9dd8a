//! Explicit visibility [Schmitz2008]: light travels along vertex-to-vertex links found by casting rays.
//!
//! Every element casts cosine-weighted rays over its hemisphere; each hit becomes links to the corners of the triangle
//! it met, and links to one sender are merged. Casting is slow and done when surfaces move; sending light along the
//! links is fast and done whenever lights or materials change. A ray that meets nothing sees the environment, and is
//! remembered as one bit.
//!
//! | paper | here | unit | buffer |
//! |---|---|---|---|
//! | n_C | [`Settings::rays_per_element`] | – | – |
//! | C_Omega | `lib/element_rays.glsl` | unit directions | made where needed |
//! | x, y | receiver, sender | – | elements |
//! | V(x,y) G(x,y) | weight of a link: form factor x to y | 1 | [`Links`] |
//! | V of a light link | visibility | 0..1 | `explicit/visibility` |
//! | f_d | albedo | 1 | [`Elements::albedo`] |
//! | I_outgoing | radiosity B | W/m2 | `explicit/radiosity` |
//! | I_total | irradiance E, and `indirect`, its sum over bounces | W/m2 | `explicit/irradiance`, `explicit/indirect` |
//! | I_smooth | `smoothed` | W/m2 | `explicit/smoothed` |
//! | N(v), alpha_f | ring, [`Settings::feature_angle`] | –, degrees | [`Elements::ring`] |
//! | n_B | `bounces` | – | – |
//!
//! **Per frame without casting rays:** brightness of lights, emission that stays where it is, albedo, the environment.
//! **With shadow rays alone:** lights that move ([`ExplicitVisibility::trace_lights`]). **With new links:** surfaces
//! that move or deform ([`ExplicitVisibility::follow`], or spread over frames,
//! [`ExplicitVisibility::follow_within`]).
//!
//! Differs from [Schmitz2008]: radiosity and irradiance instead of radiance; a double-sided surface has elements on
//! both sides; area lights and an environment; elements inside other things look from the open beside them, or take
//! their neighbours' light. What it does not do: glossy transport between elements.
//!
//! [Schmitz2008]: crate::methods::PAPERS

mod asynchronous;
mod carried;
mod devices;
mod linking;
mod ray_count;
mod report;
mod stage;
mod views;

pub use devices::Helper;
pub use linking::ExplicitError;
pub use ray_count::RayCount;
pub use report::Report;
pub use stage::Stage;
pub use views::Shown;

use crate::gpu::shaders::elements::{EmittedRadiosity, EmittedRadiosityParams, FillUnresolved, FillUnresolvedParams};
use crate::gpu::shaders::methods::explicit_visibility as passes;
use crate::gpu::shaders::types::Ray;
use crate::gpu::{Buffer, Context, GpuError, Recorder, Sampled};
use crate::methods::pick::Pick;
use crate::scene::environment::Environment;
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::emitters::{EmitterChoice, Emitters};
use crate::stages::links::{Links, Outcomes};
use crate::stages::world::{World, WorldEnvironment};
use crate::stages::{gather, punctual};
use glam::Vec3;
use linking::{Linked, Linking, Sizes};

crate::settings! {
    /// What explicit visibility lets the user choose.
    pub struct Settings {
        /// Rays cast from every element over its hemisphere: a square grid in 4 x 4 blocks.
        rays_per_element: RayCount = RayCount::PAPER, unit "rays", paper "256, a 16 x 16 grid";
        /// Turn the ray grid of every element by its own offset, trading bands for noise.
        rotate_rays: bool = false, paper "off: every element casts the same directions";
        /// Average indirect light over the one-ring.
        smoothing: bool = true, paper "on";
        /// Neighbours take part in smoothing where normals differ by less than this.
        feature_angle: f32 = 30.0, range 0.0..=180.0, unit "degrees", paper "not given";
        /// How light of emissive surfaces reaches the elements directly.
        emitters: EmitterChoice = EmitterChoice::Auto, paper "area lights only mentioned";
        /// Points on sampled emitters, together; each element casts a shadow ray to every one.
        emitter_samples: u32 = 64, range 1..=1024, unit "points", paper "not given";
        /// Store links in 4 bytes instead of 8: faster; weights off by 1/4096, radiosity by 1/512 at most.
        packed_links: bool = false, paper "off";
        /// While surfaces move: rays for new links in a frame, which is lit along the old ones until all are new; 0 makes
        /// all of them in every frame.
        link_budget: u32 = 0, range 0..=4_000_000_000, unit "rays", paper "asynchronous, on a second device";
        /// What the picture shows.
        show: Shown = Shown::Light, paper "light";
        /// The element whose links a view shows.
        pick: Pick = Pick::Nothing, paper "not given";
        /// How far rays start off their surface, as a share of the scene's extent.
        ray_offset: f32 = 1e-5, range 1e-7..=1e-2, paper "not given";
    }
}

/// The method on one scene: its elements, links and light.
pub struct ExplicitVisibility {
    settings: Settings,
    sizes: Sizes,
    elements: Elements,
    emitters: Emitters,
    links: Links,
    outcomes: Outcomes,
    /// Makes the next links, in the memory of those before the present ones.
    linking: Linking,
    /// Further devices that make links.
    helpers: Vec<Helper>,
    ages: asynchronous::Ages,
    state: State,
    /// Averaged to the density of the rays.
    environment: WorldEnvironment,
    report: Report,
}

/// Light on the elements, W/m2, and scratch; `element_count` entries each unless said otherwise.
struct State {
    radiosity: Buffer<Vec3>,
    /// What the last pass gathered.
    irradiance: Buffer<Vec3>,
    punctual: Buffer<Vec3>,
    /// From emitters and the environment.
    direct: Buffer<Vec3>,
    indirect: Buffer<Vec3>,
    smoothed: Buffer<Vec3>,
    /// Per light, then per element; 0..1.
    visibility: Buffer<f32>,
    /// Shadow rays of a batch, and their answers.
    rays: Buffer<Ray>,
    is_free: Buffer<u32>,
}

impl ExplicitVisibility {
    /// Makes elements and links and casts all shadow rays: everything but the light itself.
    pub fn prepare(context: &Context, stage: &Stage<'_>, settings: Settings) -> Result<Self, ExplicitError> {
        Self::prepare_within(context, stage, settings, u64::MAX)
    }

    /// As [`Self::prepare`], with links made by `helpers` too, now and whenever surfaces move.
    pub fn prepare_over(
        context: &Context,
        stage: &Stage<'_>,
        settings: Settings,
        helpers: Vec<Helper>,
    ) -> Result<Self, ExplicitError> {
        Self::prepare_by(context, stage, settings, u64::MAX, helpers)
    }

    /// As [`Self::prepare`], within `budget` bytes of device memory.
    pub fn prepare_within(
        context: &Context,
        stage: &Stage<'_>,
        settings: Settings,
        budget: u64,
    ) -> Result<Self, ExplicitError> {
        Self::prepare_by(context, stage, settings, budget, Vec::new())
    }

    fn prepare_by(
        context: &Context,
        stage: &Stage<'_>,
        settings: Settings,
        budget: u64,
        mut helpers: Vec<Helper>,
    ) -> Result<Self, ExplicitError> {
        let topology = ElementTopology::new(stage.scene, stage.geometry, stage.rest_positions);
        let sizes = Sizes::new(context, &topology, stage.world.light_count, &settings, budget)?;

        let elements = stage.elements(context, topology, settings.ray_offset)?;
        let (choice, samples) = (settings.emitters, settings.emitter_samples);
        let emitters = Emitters::new(context, stage.geometry, stage.rest_positions, &elements, choice, samples)?;
        let outcomes = Outcomes::new(context, elements.count, settings.rays_per_element.get())?;
        let linked = Linked { settings: &settings, elements: &elements, outcomes: &outcomes, sizes: &sizes };
        let mut linking = Linking::new(context, linked)?;
        let device_elements = linking::build(context, stage, linked, &mut linking, &mut helpers)?;
        let links = linking.builder.take(context)?;
        let mut method = Self {
            report: Report {
                device_elements,
                ..Report::new(context, &settings, &elements, &emitters, &links, &outcomes)?
            },
            state: State::new(context, &elements, stage.world.light_count, sizes.shadow_rays())?,
            environment: linking::averaged_environment(context, stage.environment, settings.rays_per_element)?,
            settings,
            sizes,
            elements,
            emitters,
            links,
            outcomes,
            linking,
            helpers,
            ages: asynchronous::Ages::default(),
        };
        let mut recorder = context.recorder("explicit-visibility")?;
        method.trace_emitters(&mut recorder, stage);
        method.trace_lights(&mut recorder, stage);
        recorder.submit()?;
        Ok(method)
    }

    /// Follows surfaces that moved or deformed (the world is posed, the tracer refitted): new links, new shadow rays.
    pub fn follow(&mut self, context: &Context, stage: &Stage<'_>) -> Result<(), ExplicitError> {
        let mut recorder = context.recorder("explicit-visibility")?;
        self.elements.place(&mut recorder, stage.world);
        self.elements.update_materials(&mut recorder, stage.world);
        recorder.submit()?;
        for helper in &self.helpers {
            helper.follow(context, stage.world)?;
        }
        // The old links go first: two sets may not fit.
        self.links.clear();
        self.linking.builder.clear();
        let Self { settings, elements, outcomes, sizes, linking, helpers, .. } = self;
        let linked = Linked { settings, elements, outcomes, sizes };
        let device_elements = linking::build(context, stage, linked, linking, helpers)?;
        self.linking.swap(&mut self.links);
        self.ages.renew();
        let report = Report::new(context, &self.settings, &self.elements, &self.emitters, &self.links, &self.outcomes)?;
        self.report = Report { device_elements, ..report };
        let mut recorder = context.recorder("explicit-visibility")?;
        self.trace_emitters(&mut recorder, stage);
        self.trace_lights(&mut recorder, stage);
        Ok(recorder.submit()?)
    }

    /// Casts the shadow rays to all punctual lights anew, after one has moved.       [Schmitz2008 3.3, light links]
    pub fn trace_lights(&mut self, recorder: &mut Recorder<'_>, stage: &Stage<'_>) {
        let State { rays, is_free, visibility, .. } = &self.state;
        self.report.light_rays = recorder.scope("trace lights", |recorder| {
            punctual::trace_visibility(recorder, &stage.tracer, stage.world, &self.elements, rays, is_free, visibility)
        });
    }

    fn trace_emitters(&mut self, recorder: &mut Recorder<'_>, stage: &Stage<'_>) {
        let State { rays, is_free, .. } = &self.state;
        self.report.emitter_rays = recorder.scope("trace emitters", |recorder| {
            self.emitters.trace(recorder, &stage.tracer, stage.world, &self.elements, rays, is_free)
        });
    }

    /// Another environment, seen through the same rays.
    pub fn set_environment(&mut self, context: &Context, environment: &Environment) -> Result<(), GpuError> {
        self.environment = linking::averaged_environment(context, environment, self.settings.rays_per_element)?;
        Ok(())
    }

    /// Takes over the world's present materials: albedo always; emission too, as long as the same parts emit in about
    /// the same proportion (the points on them stay).
    pub fn update_materials(&self, recorder: &mut Recorder<'_>, world: &World) {
        self.elements.update_materials(recorder, world);
    }

    /// The light of direct illumination and `bounces` more.                                   [Schmitz2008 3.3]
    pub fn solve(&self, recorder: &mut Recorder<'_>, world: &World, bounces: u32) {
        let (elements, s) = (&self.elements, &self.state);
        recorder.scope("direct", |recorder| self.direct_light(recorder, world));
        elements.reflect(recorder, &s.irradiance, &s.radiosity); // B_0

        recorder.fill(&s.indirect, 0);
        for bounce in 1..=bounces {
            recorder.scope(format_args!("bounce {bounce}"), |recorder| {
                gather::over_links(recorder, &self.links, &s.radiosity, &s.irradiance); // Eq. 3
                self.fill_unresolved(recorder, &s.irradiance);
                elements.add(recorder, &s.irradiance, &s.indirect);
                elements.reflect(recorder, &s.irradiance, &s.radiosity); // Eq. 4
            });
        }
        if self.settings.smoothing {
            let feature_angle = self.settings.feature_angle.to_radians();
            elements.smooth(recorder, feature_angle, &s.indirect, &s.smoothed); // Eqs. 5, 6
        }
    }

    /// Irradiance that was not reflected before: by kind, and the sum in `irradiance`.
    fn direct_light(&self, recorder: &mut Recorder<'_>, world: &World) {
        let (elements, s) = (&self.elements, &self.state);
        punctual::irradiance(recorder, world, elements, &s.visibility, &s.punctual); // Eq. 2
        self.fill_unresolved(recorder, &s.punctual);

        self.emitters.irradiance(recorder, world, elements, &s.direct);
        if self.emitters.plan.linked_parts > 0 {
            let pass = EmittedRadiosity {
                emission: &elements.emission,
                is_sampled: &self.emitters.is_sampled,
                radiosity: &s.radiosity,
                params: EmittedRadiosityParams { element_count: elements.count },
            };
            recorder.dispatch(&pass, elements.count);
            gather::over_links(recorder, &self.links, &s.radiosity, &s.irradiance);
            elements.add(recorder, &s.irradiance, &s.direct);
        }
        if self.environment.info.is_black == 0 {
            let pass = passes::EnvironmentIrradiance {
                element_normals: &elements.normals,
                escaped: &self.outcomes.escaped,
                environment_info: &self.environment.info_buffer,
                environment_map: Sampled { image: &self.environment.map, sampler: &self.environment.sampler },
                irradiance: &s.irradiance,
                params: passes::EnvironmentIrradianceParams {
                    element_count: elements.count,
                    side: self.settings.rays_per_element.side(),
                    is_rotated: u32::from(self.settings.rotate_rays),
                },
            };
            recorder.dispatch(&pass, elements.count);
            elements.add(recorder, &s.irradiance, &s.direct);
        }
        self.fill_unresolved(recorder, &s.direct);

        recorder.copy(&s.direct, &s.irradiance);
        elements.add(recorder, &s.punctual, &s.irradiance);
    }

    /// Elements inside other things take over their neighbours' light.
    fn fill_unresolved(&self, recorder: &mut Recorder<'_>, irradiance: &Buffer<Vec3>) {
        if self.report.unresolved_elements == 0 {
            return;
        }
        let pass = FillUnresolved {
            outcomes: &self.outcomes.counts,
            ring_offsets: &self.elements.ring_offsets,
            ring: &self.elements.ring,
            element_normals: &self.elements.normals,
            irradiance,
            params: FillUnresolvedParams {
                element_count: self.elements.count,
                ray_count: self.settings.rays_per_element.get(),
            },
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

    /// The further devices that make links.
    pub fn helpers(&self) -> &[Helper] {
        &self.helpers
    }

    pub fn links(&self) -> &Links {
        &self.links
    }

    pub fn outcomes(&self) -> &Outcomes {
        &self.outcomes
    }

    /// What was counted when the links were last built.
    pub fn report(&self) -> &Report {
        &self.report
    }
}

impl State {
    fn new(context: &Context, elements: &Elements, light_count: u32, shadow_rays: usize) -> Result<Self, GpuError> {
        let count = elements.count as usize;
        Ok(Self {
            radiosity: context.buffer("explicit/radiosity", count)?,
            irradiance: context.buffer("explicit/irradiance", count)?,
            punctual: context.buffer("explicit/punctual", count)?,
            direct: context.buffer("explicit/direct", count)?,
            indirect: context.buffer("explicit/indirect", count)?,
            smoothed: context.buffer("explicit/smoothed", count)?,
            visibility: context.buffer("explicit/visibility", count * light_count as usize)?,
            rays: context.buffer("explicit/shadow rays", shadow_rays)?,
            is_free: context.buffer("explicit/is free", shadow_rays)?,
        })
    }
}
