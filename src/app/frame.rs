//! The frame: from a staged scene to a film, by the method that was asked for.

use super::cli::Display;
use super::on_clusters::ClustersShown;
use super::on_elements::OnElements;
use super::on_texels::TexelsShown;
pub use super::output::picture;
use super::render::RenderRequest;
use super::stage::Stage;
use super::{AppError, views};
use crate::display::direct::{Canvas, Lighting, Sample};
use crate::display::final_gather::{FinalGather, Gathered, Visibility};
use crate::display::g_buffer::GBuffer;
use crate::display::shadow_maps::ShadowMaps;
use crate::display::splat::{self, SplatLight, SplatSums};
use crate::display::vertex::{self, VertexLight};
use crate::gpu::{self, Context};
use crate::methods::antiradiance::{self, Antiradiance};
use crate::methods::explicit_visibility::{self, ExplicitVisibility, Helper};
use crate::methods::face_cluster::{self, FaceClusters};
use crate::methods::implicit_visibility::ImplicitVisibility;
use crate::methods::path_tracing::{Options, PathTracing};
use crate::methods::surface_shadow_maps::SurfaceShadowMaps;
use crate::stages::film::Film;
use crate::stages::sender_tree::{SenderTree, VertexElements, VertexLeaves};
use crate::stages::work::Watch;
use glam::UVec2;
use serde_json::Value;

/// Tasks that sample a picture again and again, and may be left at any sample for a newer one.
pub const SAMPLING_TASKS: [&str; 2] = ["path-tracing", GATHER_TASK];
const GATHER_TASK: &str = "final gather";

/// Indirect bounces that the picture of a request holds: a reference of fewer or more shows something else.
pub fn bounces_held(request: &RenderRequest) -> Result<u32, AppError> {
    match request.method.key {
        "antiradiance" => Ok(request.settings::<antiradiance::Settings>()?.bounces_held(request.bounces)),
        _ => Ok(request.bounces),
    }
}

/// The method of a request, prepared for its scene: what stays from frame to frame.
pub enum Method {
    PathTracing(Box<PathTracing>),
    OnElements(Box<VertexShown>),
    OnTexels(Box<TexelsShown>),
    OnClusters(Box<ClustersShown>),
}

/// A method's solution for one frame, before any display.
pub enum Solved<'a> {
    Elements(&'a dyn OnElements),
    Texels(&'a SurfaceShadowMaps),
    Clusters(&'a FaceClusters, Box<face_cluster::Solution>),
    /// On no surface: pixels.
    Pixels,
}

/// A method with the display stages that show it.
pub struct VertexShown {
    pub(super) method: Box<dyn OnElements>,
    pub(super) shadow_maps: ShadowMaps,
    pub(super) g_buffer: GBuffer,
    pub(super) gather: Option<Gather>,
    /// Where flat patches are drawn.
    pub(super) splat_sums: Option<SplatSums>,
}

/// A final gather, and what it draws from.
pub(super) struct Gathering<'a> {
    pub display: &'a mut FinalGather,
    pub tree: &'a SenderTree,
    pub shadow_maps: &'a ShadowMaps,
    pub g_buffer: &'a GBuffer,
    /// Surface shadow maps may tell what is seen.
    pub has_maps: bool,
}

/// The final gather, and the tree that the method's vertices fill.
pub(super) struct Gather {
    leaves: VertexLeaves,
    display: FinalGather,
}

/// What a method sees of a staged scene.
pub(super) fn explicit_stage<'a>(stage: &'a Stage, watch: &'a dyn Watch) -> explicit_visibility::Stage<'a> {
    explicit_visibility::Stage {
        scene: &stage.scene,
        geometry: &stage.geometry,
        rest_positions: &stage.rest_positions,
        environment: &stage.environment,
        world: &stage.world,
        tracer: stage.tracer(),
        watch,
    }
}

fn path_tracing(context: &Context, request: &RenderRequest, stage: &Stage) -> Result<PathTracing, AppError> {
    let options = Options {
        width: request.width,
        height: request.height,
        bounces: request.bounces,
        seed: request.seed,
        settings: request.settings()?,
    };
    let Stage { scene, geometry, world, .. } = stage;
    PathTracing::new(context, scene, geometry, world, options).map_err(AppError::failed)
}

impl Method {
    /// Everything a method does once per scene and pose.
    pub fn prepare(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        watch: &dyn Watch,
    ) -> Result<Self, AppError> {
        match request.method.key {
            "path-tracing" => Ok(Self::PathTracing(Box::new(path_tracing(context, request, stage)?))),
            "explicit-visibility" => {
                let (settings, own) = (request.settings()?, explicit_stage(stage, watch));
                let helper = |gpu: &String| {
                    let (gpu, validation) = (Some(gpu.clone()), context.validates());
                    let options = gpu::Options { gpu, validation, ..gpu::Options::default() };
                    Helper::new(options, &own, &stage.pose, settings).map_err(AppError::failed)
                };
                let helpers: Vec<Helper> = request.link_gpus.iter().map(helper).collect::<Result<_, _>>()?;
                let method = ExplicitVisibility::prepare_over(context, &own, settings, helpers);
                let method = method.map_err(AppError::failed)?;
                tracing::info!("{}", method.report());
                Self::on_elements(context, request, stage, Box::new(method))
            }
            "implicit-visibility" => {
                let settings = request.settings()?;
                let method = ImplicitVisibility::prepare(context, &explicit_stage(stage, watch), settings);
                Self::on_elements(context, request, stage, Box::new(method.map_err(AppError::failed)?))
            }
            "antiradiance" => {
                let method = Antiradiance::prepare(context, &explicit_stage(stage, watch), request.settings()?);
                let method = method.map_err(AppError::failed)?;
                tracing::info!("{}", method.report());
                Self::on_elements(context, request, stage, Box::new(method))
            }
            "surface-shadow-maps" => {
                Ok(Self::OnTexels(Box::new(TexelsShown::prepare(context, request, stage, watch)?)))
            }
            "face-cluster" => Ok(Self::OnClusters(Box::new(ClustersShown::prepare(context, request, stage, watch)?))),
            other => Err(AppError::failed(format!("method {other} cannot be rendered"))),
        }
    }

    fn on_elements(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        method: Box<dyn OnElements>,
    ) -> Result<Self, AppError> {
        let shadow_maps = ShadowMaps::new(context, &stage.pose, [request.width, request.height])?;
        let g_buffer = GBuffer::new(context, request.width, request.height)?;
        let gather = Gather::of_display(context, request, stage, &*method)?;
        let splat_sums = splat_sums(context, request)?;
        Ok(Self::OnElements(Box::new(VertexShown { method, shadow_maps, g_buffer, gather, splat_sums })))
    }

    /// The solution of `request.bounces` bounces alone.
    pub fn solve(
        &mut self,
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        watch: &dyn Watch,
    ) -> Result<Solved<'_>, AppError> {
        match self {
            Self::OnElements(shown) => {
                shown.method.solve(context, &explicit_stage(stage, watch), request.bounces)?;
                Ok(Solved::Elements(&*shown.method))
            }
            Self::OnTexels(shown) => Ok(Solved::Texels(shown.solve(context, stage, request.bounces)?)),
            Self::OnClusters(shown) => {
                let (method, solution) = shown.solve(context, stage, request.bounces, watch)?;
                Ok(Solved::Clusters(method, Box::new(solution)))
            }
            Self::PathTracing(_) => Ok(Solved::Pixels),
        }
    }

    /// What the method made and counted, by its own names.
    pub fn report(&self) -> Result<Value, AppError> {
        Ok(match self {
            Self::PathTracing(_) => Value::Null,
            Self::OnElements(shown) => shown.method.facts()?,
            Self::OnTexels(shown) => serde_json::to_value(shown.report())?,
            Self::OnClusters(shown) => serde_json::to_value(shown.report())?,
        })
    }

    /// Takes over albedo and intensities that changed, without new links; false where all must be prepared anew.
    pub fn relight(&self, context: &Context, stage: &Stage) -> Result<bool, AppError> {
        match self {
            Self::PathTracing(_) => Ok(true),
            Self::OnElements(shown) => shown.method.relight(context, &stage.world).map(|()| true),
            Self::OnTexels(_) | Self::OnClusters(_) => Ok(false),
        }
    }

    /// Takes over surfaces and lights that moved (`has_moved`, else links that are older than that go on being made);
    /// false where all must be prepared anew.
    pub fn follow(
        &mut self,
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        has_moved: bool,
        watch: &dyn Watch,
    ) -> Result<bool, AppError> {
        match self {
            Self::PathTracing(_) => Ok(true),
            Self::OnElements(shown) => {
                shown.method.follow(context, &explicit_stage(stage, watch), has_moved)?;
                shown.gather = Gather::of_display(context, request, stage, &*shown.method)?;
                Ok(true)
            }
            Self::OnTexels(shown) => shown.follow(context, request, stage, watch),
            Self::OnClusters(_) => Ok(false),
        }
    }

    /// The final gather that shows it, if one does.
    pub(super) fn gathering(&mut self) -> Option<Gathering<'_>> {
        match self {
            Self::PathTracing(_) => None,
            Self::OnElements(shown) => {
                let VertexShown { shadow_maps, g_buffer, gather, .. } = &mut **shown;
                let Gather { leaves, display } = gather.as_mut()?;
                Some(Gathering { display, tree: &leaves.tree, shadow_maps, g_buffer, has_maps: false })
            }
            Self::OnTexels(shown) => shown.gathering(),
            Self::OnClusters(shown) => shown.gathering(),
        }
    }

    /// Frames since the oldest links were made, where they are older than the surfaces' places.
    pub fn link_age(&self) -> Option<u32> {
        match self {
            Self::OnElements(shown) => shown.method.link_age(),
            _ => None,
        }
    }

    /// Takes over what `request` changed of the picture alone: its size, its display and what that was told. The
    /// solution stays.
    pub fn show(&mut self, context: &Context, request: &RenderRequest, stage: &Stage) -> Result<(), AppError> {
        match self {
            Self::PathTracing(method) => **method = path_tracing(context, request, stage)?,
            Self::OnElements(shown) => {
                shown.g_buffer = GBuffer::new(context, request.width, request.height)?;
                shown.shadow_maps = ShadowMaps::new(context, &stage.pose, [request.width, request.height])?;
                shown.gather = Gather::of_display(context, request, stage, &*shown.method)?;
                shown.splat_sums = splat_sums(context, request)?;
            }
            Self::OnTexels(shown) => shown.show(context, request, stage)?,
            Self::OnClusters(shown) => shown.show(context, request, stage)?,
        }
        Ok(())
    }

    /// One frame into `film`. Where the user ends it early, [`AppError::Partial`] says that the film holds a part.
    pub fn frame(
        &mut self,
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        film: &Film,
        watch: &dyn Watch,
    ) -> Result<(), AppError> {
        self.light_frame(context, request, stage, film, watch)?;
        if request.shows_bad_values { views::paint_bad_values(context, film) } else { Ok(()) }
    }

    fn light_frame(
        &mut self,
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        film: &Film,
        watch: &dyn Watch,
    ) -> Result<(), AppError> {
        let Stage { world, view, pose, bounds, .. } = stage;
        match self {
            Self::PathTracing(method) => {
                method.prepare(context, world)?;
                // Each submission is one batch of samples, so that the user can interrupt between them.
                while method.sample_count() < request.spp {
                    watch.step(request.method.key, method.sample_count().into(), request.spp.into())?;
                    let samples = method.samples_at_once().min(request.spp - method.sample_count());
                    let mut recorder = context.recorder("frame")?;
                    recorder.scope("path-tracing", |recorder| {
                        method.sample(recorder, world, &stage.tracer(), view, samples);
                    });
                    recorder.submit()?;
                }
                watch.step(request.method.key, request.spp.into(), request.spp.into())?;
                let mut recorder = context.recorder("frame")?;
                recorder.scope("path-tracing", |recorder| method.resolve(recorder, film));
                recorder.submit()?;
                if let Some(estimate) = method.error_estimate(context)? {
                    tracing::info!(
                        "standard error of the picture's mean {:.3} %, of a pixel {:.1} %",
                        100.0 * estimate.relative_mean_error,
                        100.0 * estimate.relative_pixel_error
                    );
                }
                Ok(())
            }
            Self::OnElements(shown) => {
                let VertexShown { method, shadow_maps, g_buffer, gather, splat_sums } = &mut **shown;
                if let Some(gather) = gather {
                    // One bounce less: the gather adds it.
                    method.solve(context, &explicit_stage(stage, watch), request.bounces.saturating_sub(1))?;
                    return gather.frame(context, request, stage, (&**method, shadow_maps, g_buffer), film, watch);
                }
                method.solve(context, &explicit_stage(stage, watch), request.bounces)?;
                let size = UVec2::new(request.width, request.height);
                let colors = method.false_colors(context, world, view, size)?;
                let (direct_irradiance, indirect_irradiance) = method.look(context, world, view)?;
                let mut recorder = context.recorder("frame")?;
                recorder.scope("display", |recorder| {
                    let light = VertexLight {
                        direct_irradiance,
                        indirect_irradiance,
                        back_elements: &method.elements().back_elements,
                        colors: colors.as_ref(),
                    };
                    shadow_maps.draw(recorder, world, pose, *bounds);
                    // False colours are those of vertices.
                    let (tracer, samples) = (stage.tracer(), request.spp);
                    let canvas =
                        Canvas { lighting: Lighting { world, shadow_maps, tracer, g_buffer }, view, samples, film };
                    match (splat_sums, method.splats(), light.colors) {
                        (Some(sums), Some(splats), None) => {
                            splat::draw(recorder, SplatLight { vertices: light, splats, sums }, canvas);
                        }
                        _ => vertex::draw(recorder, light, canvas),
                    }
                });
                recorder.submit()?;
                Ok(())
            }
            Self::OnTexels(shown) => shown.frame(context, request, stage, film, watch),
            Self::OnClusters(shown) => shown.frame(context, request, stage, film, watch),
        }
    }
}

/// Where flat patches are drawn, if the display draws them.
fn splat_sums(context: &Context, request: &RenderRequest) -> Result<Option<SplatSums>, AppError> {
    match request.display {
        Some(Display::Splat) => Ok(Some(SplatSums::new(context, request.width, request.height)?)),
        _ => Ok(None),
    }
}

impl Gather {
    /// Where the request shows by a final gather.
    fn of_display(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        method: &dyn OnElements,
    ) -> Result<Option<Self>, AppError> {
        let is_asked = request.display == Some(Display::FinalGather);
        is_asked.then(|| Self::new(context, request, stage, method)).transpose()
    }

    fn new(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        method: &dyn OnElements,
    ) -> Result<Self, AppError> {
        let settings = request.final_gather_settings()?;
        check_visibility(request, settings.gather_visibility, false)?;
        let positions = context.download(&stage.world.positions)?;
        let back_elements = &method.elements().topology.back_elements;
        let options = settings.tree_options();
        let leaves = VertexLeaves::new(context, &positions, &stage.geometry.triangles, back_elements, options)
            .map_err(AppError::failed)?;
        let display = FinalGather::new(context, [request.width, request.height], settings, request.tone, request.seed)?;
        Ok(Self { leaves, display })
    }

    fn frame(
        &self,
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        (method, shadow_maps, g_buffer): (&dyn OnElements, &ShadowMaps, &GBuffer),
        film: &Film,
        watch: &dyn Watch,
    ) -> Result<(), AppError> {
        let world = &stage.world;
        let elements = method.elements();
        let elements = VertexElements {
            emission: &elements.emission,
            albedo: &elements.albedo,
            punctual: method.punctual_irradiance(),
            direct: method.direct_irradiance(),
            indirect: method.indirect_irradiance(),
        };
        let mut recorder = context.recorder("frame")?;
        self.leaves.fill(&mut recorder, elements, request.bounces > 0);
        recorder.scope("display", |recorder| shadow_maps.draw(recorder, world, &stage.pose, stage.bounds));
        recorder.submit()?;
        let gathered = Gathered {
            world,
            tree: &self.leaves.tree,
            tracer: stage.tracer(),
            maps: None,
            bvh: &stage.bvh,
            shadow_maps,
            g_buffer,
            view: &stage.view,
        };
        gather_samples(context, request, &self.display, gathered, film, watch)
    }
}

/// Refuses a gather by maps where there are none.
pub(super) fn check_visibility(request: &RenderRequest, asked: Visibility, has_maps: bool) -> Result<(), AppError> {
    if asked == Visibility::Maps && !has_maps {
        return Err(AppError::Usage(format!(
            "gather_visibility=maps needs surface shadow maps, and {} has none here; use rays, or --method \
             surface-shadow-maps with visibility=maps",
            request.method.key
        )));
    }
    Ok(())
}

/// Gathers a solution sample by sample: each is a submission, so that the user can interrupt between them.
pub(super) fn gather_samples(
    context: &Context,
    request: &RenderRequest,
    display: &FinalGather,
    gathered: Gathered<'_>,
    film: &Film,
    watch: &dyn Watch,
) -> Result<(), AppError> {
    for index in 0..request.spp {
        watch.step(GATHER_TASK, index.into(), request.spp.into())?;
        let mut recorder = context.recorder("frame")?;
        recorder.scope("display", |recorder| {
            display.draw(recorder, gathered, Sample { index, samples: request.spp, is_unlit: false }, film);
        });
        recorder.submit()?;
    }
    watch.step(GATHER_TASK, request.spp.into(), request.spp.into())?;
    display.show_cut_sizes(context, film)?;
    let report = display.report(context)?;
    tracing::info!("{report}");
    Ok(())
}
