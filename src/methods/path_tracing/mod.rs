//! The reference [Kajiya1986]: unidirectional paths with next-event estimation and multiple importance sampling
//! [Veach1995].
//!
//! A path starts at the eye and is reflected until the bounce limit; nothing ends it earlier by chance, so that "k
//! bounces" means what it means for the other methods. At each surface, light is sought in two ways: one shadow ray to
//! a light, and the reflected ray itself should it end on one; both are weighted by the power heuristic. Paths advance
//! together, one kernel a step, in batches of bounded size. A picture is a function of its settings and the scene, to
//! the bit: random numbers are functions of (pixel, sample, dimension, seed), and every pixel adds its samples in order.
//!
//! | symbol | name | unit | where |
//! |---|---|---|---|
//! | L | `radiance` (`direct`, `indirect`) | W m^-2 sr^-1 | per path |
//! | beta | `throughput` | 1 | [`Path`](crate::gpu::shaders::types::Path) |
//! | p | `density` | sr^-1 or m^-2 | of a drawn direction or point |
//! | w | `reflection_weight`, `light_weight` | 1 | [Veach1995] Eq. 14 |
//! | f_r | `brdf_value` | sr^-1 | `glsl/lib/brdf.glsl` |
//!
//! Light counts as direct when it was reflected at most once. Emission, environment, punctual lights and unlit
//! surfaces are seen; unlit surfaces block light and send none, one-sided surfaces do neither from behind but block.
//!
//! [Kajiya1986]: crate::methods::PAPERS
//! [Veach1995]: crate::methods::PAPERS

mod buffers;
mod estimate;

pub use estimate::ErrorEstimate;

use crate::gpu::shaders::methods::path_tracing as passes;
use crate::gpu::shaders::types::{Batch, LightChoice, PathVertex, ViewInfo};
use crate::gpu::{Buffer, Context, GpuError, Recorder, Sampled};
use crate::scene::Scene;
use crate::scene::camera::View;
use crate::scene::geometry::Geometry;
use crate::stages::emissive_triangles::EmissiveTriangles;
use crate::stages::film::Film;
use crate::stages::trace::{self, Tracer};
use crate::stages::world::World;
use buffers::{Paths, Sums};
use glam::{UVec2, Vec3};

crate::choice! {
    /// How next-event estimation picks an emissive triangle.
    pub enum EmitterSampling {
        /// In proportion to emitted power
        Power = "power",
        /// In proportion to area
        Area = "area",
    }
}

crate::choice! {
    /// How emitters and environment are found; all three give the same picture in the limit.
    pub enum LightSampling {
        /// By shadow rays and by reflected rays, weighted
        Both = "both",
        /// By shadow rays alone
        Lights = "lights",
        /// By reflected rays alone
        Reflection = "reflection",
    }
}

crate::settings! {
    /// What the reference lets the user choose.
    pub struct Settings {
        /// How next-event estimation picks an emissive triangle.
        emitter_sampling: EmitterSampling = EmitterSampling::Power, paper "not given";
        /// How emitters and environment are found: one way alone shows its noise, the limit is the same.
        light_sampling: LightSampling = LightSampling::Both, paper "not given";
        /// Paths that are followed together; bounds memory, changes no bit of the picture.
        paths_in_flight: u32 = 262144, range 64..=1048576, unit "paths", paper "not given";
    }
}

/// What a picture is made of beside the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Pixels.
    pub width: u32,
    pub height: u32,
    /// Indirect bounces; 0 is direct light alone.
    pub bounces: u32,
    pub seed: u32,
    pub settings: Settings,
}

/// Why the reference cannot run.
#[derive(Debug, thiserror::Error)]
pub enum PathTracingError {
    #[error(
        "path tracing at {width} x {height} pixels needs {needed} bytes of device memory, {available} are available; \
         render at a smaller --size or with fewer --set paths_in_flight (now {paths_in_flight})"
    )]
    OutOfMemory { width: u32, height: u32, paths_in_flight: u32, needed: u64, available: u64 },
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// A picture in the making.
pub struct PathTracing {
    options: Options,
    emitters: EmissiveTriangles,
    paths: Paths,
    sums: Sums,
    sample_count: u32,
}

impl PathTracing {
    /// Sizes its buffers for a picture and finds the emitters of the world's present pose.
    pub fn new(
        context: &Context,
        scene: &Scene,
        geometry: &Geometry,
        world: &World,
        options: Options,
    ) -> Result<Self, PathTracingError> {
        let Options { width, height, settings, .. } = options;
        let pixels = u64::from(width) * u64::from(height);
        // No more than one buffer can hold; how many there are changes no pixel.
        let most = context.limits().storage_buffer_bytes / size_of::<PathVertex>() as u64;
        let paths_in_flight = settings.paths_in_flight.min(u32::try_from(most).unwrap_or(u32::MAX)).max(1);
        let needed = Sums::BYTES_PER_PIXEL * pixels + Paths::BYTES_PER_PATH * u64::from(paths_in_flight);
        let available = context.available_bytes();
        if needed > available {
            return Err(PathTracingError::OutOfMemory { width, height, paths_in_flight, needed, available });
        }
        let mut tracing = Self {
            options,
            emitters: EmissiveTriangles::new(context, scene, geometry)?,
            paths: Paths::new(context, paths_in_flight as usize)?,
            sums: Sums::new(context, pixels as usize)?,
            sample_count: 0,
        };
        tracing.prepare(context, world)?;
        Ok(tracing)
    }

    /// Starts the picture anew for the world's present pose.
    pub fn prepare(&mut self, context: &Context, world: &World) -> Result<(), GpuError> {
        self.sample_count = 0;
        match self.options.settings.emitter_sampling {
            EmitterSampling::Power => {
                self.emitters.update(context, world, |m| f64::from(m.area) * f64::from(m.emission))
            }
            EmitterSampling::Area => self.emitters.update(context, world, |m| f64::from(m.area)),
        }
    }

    /// Samples per pixel so far.
    pub fn sample_count(&self) -> u32 {
        self.sample_count
    }

    /// How many samples of every pixel are followed together: fewer at a time leave the device idle.
    pub fn samples_at_once(&self) -> u32 {
        let pixels = (self.options.width * self.options.height).max(1);
        (self.paths.count() / pixels).max(1)
    }

    /// Adds `samples` samples to every pixel.
    pub fn sample(
        &mut self,
        recorder: &mut Recorder<'_>,
        world: &World,
        tracer: &Tracer<'_>,
        view: &View,
        samples: u32,
    ) {
        let pixels = self.options.width * self.options.height;
        let last_sample = self.sample_count.saturating_add(samples);
        for first_pixel in (0..pixels).step_by(self.paths.count() as usize) {
            let pixel_count = (pixels - first_pixel).min(self.paths.count());
            let samples_at_once = self.paths.count() / pixel_count;
            for first_sample in (self.sample_count..last_sample).step_by(samples_at_once as usize) {
                let batch_samples = (last_sample - first_sample).min(samples_at_once);
                let path_count = batch_samples * pixel_count;
                let batch = Batch { path_count, pixel_count, first_pixel, first_sample, seed: self.options.seed };
                // One label for all batches: the times of a pass add up over them.
                recorder.scope("batch", |recorder| self.batch(recorder, world, tracer, view, batch));
            }
        }
        self.sample_count = last_sample;
    }

    /// Follows a batch of paths from the eye to the bounce limit and adds what they bring.
    fn batch(&self, recorder: &mut Recorder<'_>, world: &World, tracer: &Tracer<'_>, view: &View, batch: Batch) {
        let (p, count) = (&self.paths, batch.path_count as usize);
        let choice = self.light_choice(world);
        let is_found_by_reflection = self.options.settings.light_sampling != LightSampling::Lights
            && (self.emitters.count > 0 || world.environment.info.is_black == 0);

        recorder.scope("camera", |recorder| {
            self.camera_rays(recorder, view, batch);
            trace::closest_hit(recorder, tracer, &p.rays, &p.hits, count);
            self.arrive(recorder, world, batch, choice, &p.direct, false);
            self.features(recorder, batch);
        });
        for depth in 0..=self.options.bounces {
            // The vertex at depth 0 reflects light for the first time: that is direct light.
            let is_direct = depth == 0;
            let radiance = if is_direct { &p.direct } else { &p.indirect };
            let is_last = depth == self.options.bounces;
            let body = |recorder: &mut Recorder<'_>| {
                self.next_event(recorder, world, batch, choice, depth);
                trace::any_hit(recorder, tracer, &p.shadow_rays, &p.visibility, count);
                self.scatter(recorder, batch, depth, radiance);
                if !is_last || is_found_by_reflection {
                    trace::closest_hit(recorder, tracer, &p.rays, &p.hits, count);
                    self.arrive(recorder, world, batch, choice, radiance, is_last);
                }
            };
            if is_direct {
                recorder.scope("direct", body);
            } else {
                recorder.scope(format_args!("bounce {depth}"), body);
            }
        }
        self.accumulate(recorder, batch);
    }

    /// Writes the mean of all samples so far to `film`, which has the picture's size.
    pub fn resolve(&self, recorder: &mut Recorder<'_>, film: &Film) {
        let pixel_count = (self.options.width * self.options.height).min(film.pixel_count());
        recorder.dispatch(
            &passes::Resolve {
                direct_sum: &self.sums.direct,
                indirect_sum: &self.sums.indirect,
                albedo_sum: &self.sums.albedo,
                normal_sum: &self.sums.normal,
                depth_sum: &self.sums.depth,
                direct: &film.direct,
                indirect: &film.indirect,
                albedo: &film.albedo,
                normal: &film.normal,
                depth: &film.depth,
                params: passes::ResolveParams { pixel_count, sample_count: self.sample_count.max(1) },
            },
            pixel_count,
        );
    }

    /// The picture's error as its own two halves tell it; `None` below two samples. Reads the sums back.
    pub fn error_estimate(&self, context: &Context) -> Result<Option<ErrorEstimate>, GpuError> {
        if self.sample_count < 2 {
            return Ok(None);
        }
        let [direct, indirect] = [context.download(&self.sums.direct)?, context.download(&self.sums.indirect)?];
        let even = context.download(&self.sums.even)?;
        let total = direct.iter().zip(&indirect).map(|(&direct, &indirect)| direct + indirect);
        Ok(ErrorEstimate::from_sums(total, &even, self.sample_count))
    }

    /// Every kind of light that there is gets the same share of the shadow rays.
    fn light_choice(&self, world: &World) -> LightChoice {
        let by_shadow_rays = self.options.settings.light_sampling != LightSampling::Reflection;
        let emitters = by_shadow_rays && self.emitters.count > 0;
        let environment = by_shadow_rays && world.environment.info.is_black == 0;
        let punctual = world.light_count > 0;
        let kinds = [emitters, environment, punctual].map(|is_there| if is_there { 1.0 } else { 0.0 });
        let share = 1.0 / kinds.iter().sum::<f32>().max(1.0);
        let [emitters, environment, punctual] = kinds.map(|kind| kind * share);
        LightChoice { emitters, environment, punctual }
    }

    /// Specialisation of the kernels: `BY_BOTH`, `BY_LIGHTS` or `BY_REFLECTION`.
    fn found(&self) -> u32 {
        match self.options.settings.light_sampling {
            LightSampling::Both => 0,
            LightSampling::Lights => 1,
            LightSampling::Reflection => 2,
        }
    }

    fn camera_rays(&self, recorder: &mut Recorder<'_>, view: &View, batch: Batch) {
        let p = &self.paths;
        let size = UVec2::new(self.options.width, self.options.height);
        recorder.dispatch(
            &passes::CameraRays {
                rays: &p.rays,
                paths: &p.paths,
                direct: &p.direct,
                indirect: &p.indirect,
                params: passes::CameraRaysParams { view: ViewInfo::from(view), size, batch },
            },
            batch.path_count,
        );
    }

    fn arrive(
        &self,
        recorder: &mut Recorder<'_>,
        world: &World,
        batch: Batch,
        choice: LightChoice,
        radiance: &Buffer<Vec3>,
        is_last: bool,
    ) {
        let (p, environment) = (&self.paths, &world.environment);
        recorder.dispatch(
            &passes::Arrive {
                rays: &p.rays,
                hits: &p.hits,
                paths: &p.paths,
                triangles: &world.triangles,
                triangle_materials: &world.triangle_materials,
                positions: &world.positions,
                normals: &world.normals,
                tangents: &world.tangents,
                attributes: &world.attributes,
                materials: &world.materials,
                emitter_density: &self.emitters.density,
                environment_info: &environment.info_buffer,
                environment_cells: &environment.cells,
                environment_map: Sampled { image: &environment.map, sampler: &environment.sampler },
                radiance,
                vertices: &p.vertices,
                textures: &world.textures,
                params: passes::ArriveParams { path_count: batch.path_count, is_last: u32::from(is_last), choice },
                constants: passes::ArriveConstants { found: self.found() },
            },
            batch.path_count,
        );
    }

    fn features(&self, recorder: &mut Recorder<'_>, batch: Batch) {
        recorder.dispatch(
            &passes::Features {
                hits: &self.paths.hits,
                vertices: &self.paths.vertices,
                albedo_sum: &self.sums.albedo,
                normal_sum: &self.sums.normal,
                depth_sum: &self.sums.depth,
                params: passes::FeaturesParams { batch },
            },
            batch.pixel_count,
        );
    }

    fn next_event(&self, recorder: &mut Recorder<'_>, world: &World, batch: Batch, choice: LightChoice, depth: u32) {
        let (p, environment) = (&self.paths, &world.environment);
        recorder.dispatch(
            &passes::NextEvent {
                rays: &p.rays,
                paths: &p.paths,
                vertices: &p.vertices,
                triangles: &world.triangles,
                triangle_materials: &world.triangle_materials,
                positions: &world.positions,
                attributes: &world.attributes,
                materials: &world.materials,
                emitters: &self.emitters.table,
                lights: &world.lights,
                environment_info: &environment.info_buffer,
                environment_cells: &environment.cells,
                environment_map: Sampled { image: &environment.map, sampler: &environment.sampler },
                shadow_rays: &p.shadow_rays,
                connections: &p.connections,
                textures: &world.textures,
                params: passes::NextEventParams {
                    batch,
                    depth,
                    emitter_count: self.emitters.count,
                    light_count: world.light_count,
                    choice,
                },
                constants: passes::NextEventConstants { found: self.found() },
            },
            batch.path_count,
        );
    }

    fn scatter(&self, recorder: &mut Recorder<'_>, batch: Batch, depth: u32, radiance: &Buffer<Vec3>) {
        let p = &self.paths;
        recorder.dispatch(
            &passes::Scatter {
                vertices: &p.vertices,
                visibility: &p.visibility,
                connections: &p.connections,
                rays: &p.rays,
                paths: &p.paths,
                radiance,
                params: passes::ScatterParams { batch, depth },
            },
            batch.path_count,
        );
    }

    fn accumulate(&self, recorder: &mut Recorder<'_>, batch: Batch) {
        recorder.dispatch(
            &passes::Accumulate {
                direct: &self.paths.direct,
                indirect: &self.paths.indirect,
                direct_sum: &self.sums.direct,
                indirect_sum: &self.sums.indirect,
                even_sum: &self.sums.even,
                params: passes::AccumulateParams { batch },
            },
            batch.pixel_count,
        );
    }
}
