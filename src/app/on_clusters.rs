//! The method whose light lives on clusters of faces, with the display stages that show it.

use super::AppError;
use super::cli::Display;
use super::frame::{Gathering, check_visibility, gather_samples};
use super::render::{RenderRequest, cache_folder};
use super::stage::Stage;
use crate::display::direct::{Canvas, Lighting};
use crate::display::final_gather::{FinalGather, Gathered};
use crate::display::g_buffer::GBuffer;
use crate::display::irradiance_vector;
use crate::display::shadow_maps::ShadowMaps;
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::methods::face_cluster::{self, FaceClusterError, FaceClusters, Report, Solution};
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::film::Film;
use crate::stages::irradiance_vector::ElementLight;
use crate::stages::punctual;
use crate::stages::sender_tree::{VertexElements, VertexLeaves};
use crate::stages::work::Watch;
use glam::Vec3;
use std::path::Path;

/// Rays start off their surface by so much of the scene's extent.
const RAY_OFFSET: f32 = 1e-5;
/// Shadow rays of a batch.
const SHADOW_RAYS: usize = 1 << 19;

/// Face-cluster radiosity, ready to be shown.
pub struct ClustersShown {
    pub(super) method: FaceClusters,
    pub(super) shadow_maps: ShadowMaps,
    pub(super) g_buffer: GBuffer,
    pub(super) gather: Option<Gather>,
}

/// The final gather, and the tree over the scene's triangles that it gathers from.
pub(super) struct Gather {
    at_vertices: AtVertices,
    leaves: VertexLeaves,
    display: FinalGather,
}

/// What a solution on clusters says at the scene's vertices: elements, and their irradiance in W/m2.
pub struct AtVertices {
    pub elements: Elements,
    pub punctual: Buffer<Vec3>,
    pub direct: Buffer<Vec3>,
    pub indirect: Buffer<Vec3>,
}

/// What the method sees of a staged scene.
pub(super) fn cluster_stage<'a>(
    stage: &'a Stage,
    cache: Option<&'a Path>,
    watch: &'a dyn Watch,
) -> face_cluster::Stage<'a> {
    face_cluster::Stage {
        scene: &stage.scene,
        geometry: &stage.geometry,
        rest_positions: &stage.rest_positions,
        pose: &stage.pose,
        bounds: stage.bounds,
        environment: &stage.environment,
        world: &stage.world,
        bvh: &stage.bvh,
        cluster_cache: cache,
        watch,
    }
}

impl AtVertices {
    /// The elements, and what punctual lights bring them by shadow rays; the rest is dark yet.
    pub fn new(context: &Context, stage: &Stage) -> Result<Self, GpuError> {
        let topology = ElementTopology::new(&stage.scene, &stage.geometry, &stage.rest_positions);
        let elements = Elements::new(context, topology, &stage.rest_positions, &stage.world, RAY_OFFSET)?;
        let count = elements.count as usize;
        let irradiance = |name: &str| context.buffer::<Vec3>(&format!("at vertices/{name}"), count);
        let (punctual, direct, indirect) = (irradiance("punctual")?, irradiance("direct")?, irradiance("indirect")?);
        let light_count = stage.world.light_count as usize;
        let visibility = context.buffer("at vertices/visibility", (light_count * count).max(1))?;
        let rays = context.buffer("at vertices/rays", SHADOW_RAYS)?;
        let is_free = context.buffer("at vertices/is free", SHADOW_RAYS)?;
        let mut recorder = context.recorder("at vertices")?;
        let (tracer, world) = (stage.tracer(), &stage.world);
        punctual::trace_visibility(&mut recorder, &tracer, world, &elements, &rays, &is_free, &visibility);
        punctual::irradiance(&mut recorder, world, &elements, &visibility, &punctual);
        recorder.submit()?;
        Ok(Self { elements, punctual, direct, indirect })
    }

    /// Takes over what the leaves around the vertices say.
    pub fn fill(&self, recorder: &mut Recorder<'_>, stage: &Stage, light: ElementLight<'_>) {
        light.at_elements(recorder, &stage.world, &self.elements, [&self.direct, &self.indirect]);
    }
}

impl Gather {
    /// Where the request shows by a final gather.
    fn of_display(context: &Context, request: &RenderRequest, stage: &Stage) -> Result<Option<Self>, AppError> {
        if request.display != Some(Display::FinalGather) {
            return Ok(None);
        }
        let settings = request.final_gather_settings()?;
        check_visibility(request, settings.gather_visibility, false)?;
        let at_vertices = AtVertices::new(context, stage)?;
        let positions = context.download(&stage.world.positions)?;
        let backs = &at_vertices.elements.topology.back_elements;
        let options = settings.tree_options();
        let leaves = VertexLeaves::new(context, &positions, &stage.geometry.triangles, backs, options)
            .map_err(AppError::failed)?;
        let display = FinalGather::new(context, [request.width, request.height], settings, request.tone, request.seed)?;
        Ok(Some(Self { at_vertices, leaves, display }))
    }

    /// Fills the tree with the solution; without `has_reflected` with emission alone.
    fn fill(&self, recorder: &mut Recorder<'_>, stage: &Stage, light: ElementLight<'_>, has_reflected: bool) {
        let AtVertices { elements, punctual, direct, indirect } = &self.at_vertices;
        self.at_vertices.fill(recorder, stage, light);
        let (emission, albedo) = (&elements.emission, &elements.albedo);
        let elements = VertexElements { emission, albedo, punctual, direct, indirect };
        self.leaves.fill(recorder, elements, has_reflected);
    }
}

impl ClustersShown {
    /// As [`super::frame::Method::gathering`].
    pub(super) fn gathering(&mut self) -> Option<Gathering<'_>> {
        let Self { shadow_maps, g_buffer, gather, .. } = self;
        let Gather { leaves, display, .. } = gather.as_mut()?;
        Some(Gathering { display, tree: &leaves.tree, shadow_maps, g_buffer, has_maps: false })
    }

    pub fn prepare(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        watch: &dyn Watch,
    ) -> Result<Self, AppError> {
        let cache = cache_folder().map(|folder| folder.join("clusters"));
        let stage_of = cluster_stage(stage, cache.as_deref(), watch);
        let method = FaceClusters::prepare(context, &stage_of, request.settings()?).map_err(AppError::failed)?;
        let shadow_maps = ShadowMaps::new(context, &stage.pose, [request.width, request.height])?;
        let g_buffer = GBuffer::new(context, request.width, request.height)?;
        let gather = Gather::of_display(context, request, stage)?;
        Ok(Self { method, shadow_maps, g_buffer, gather })
    }

    pub fn report(&self) -> &Report {
        self.method.report()
    }

    /// The solution of `bounces` bounces alone.
    pub fn solve(
        &mut self,
        context: &Context,
        stage: &Stage,
        bounces: u32,
        watch: &dyn Watch,
    ) -> Result<(&FaceClusters, Solution), AppError> {
        self.method.solve(context, &cluster_stage(stage, None, watch), bounces).map_err(AppError::failed)?;
        let solution = self.method.keep(context).map_err(AppError::failed)?;
        Ok((&self.method, solution))
    }

    /// As [`super::frame::Method::show`].
    pub fn show(&mut self, context: &Context, request: &RenderRequest, stage: &Stage) -> Result<(), AppError> {
        self.g_buffer = GBuffer::new(context, request.width, request.height)?;
        self.shadow_maps = ShadowMaps::new(context, &stage.pose, [request.width, request.height])?;
        self.gather = Gather::of_display(context, request, stage)?;
        Ok(())
    }

    pub fn frame(
        &mut self,
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        film: &Film,
        watch: &dyn Watch,
    ) -> Result<(), AppError> {
        let Self { method, shadow_maps, g_buffer, gather } = self;
        let (shadow_maps, g_buffer) = (&*shadow_maps, &*g_buffer);
        // A final gather adds a bounce of its own.
        let bounces = if gather.is_some() { request.bounces.saturating_sub(1) } else { request.bounces };
        let partial = match method.solve(context, &cluster_stage(stage, None, watch), bounces) {
            Err(FaceClusterError::Interrupted(interrupted)) => {
                // Whole passes of light can be shown; what was under way is dropped.
                let last = method.report().iterations.last().ok_or(interrupted)?;
                let after = format!("{} of {bounces} bounces", last.name);
                method.locate(context, &cluster_stage(stage, None, watch)).map_err(AppError::failed)?;
                Some(AppError::Partial(after))
            }
            other => {
                other.map_err(AppError::failed)?;
                None
            }
        };
        let solution = method.keep(context).map_err(AppError::failed)?;
        tracing::info!("{}", method.report());
        let (world, view, light) = (&stage.world, &stage.view, method.light(&solution));
        let mut recorder = context.recorder("frame")?;
        recorder.scope("display", |recorder| {
            shadow_maps.draw(recorder, world, &stage.pose, stage.bounds);
            match gather.as_ref().filter(|_| !light.shows_colors) {
                Some(gather) => gather.fill(recorder, stage, light, request.bounces > 0),
                None => {
                    let (tracer, samples) = (stage.tracer(), request.spp);
                    let canvas =
                        Canvas { lighting: Lighting { world, shadow_maps, tracer, g_buffer }, view, samples, film };
                    irradiance_vector::draw(recorder, light, canvas);
                }
            }
        });
        recorder.submit()?;
        if let Some(gather) = gather.as_ref().filter(|_| !light.shows_colors) {
            let (tree, tracer, bvh) = (&gather.leaves.tree, stage.tracer(), &stage.bvh);
            let gathered = Gathered { world, tree, tracer, maps: None, bvh, shadow_maps, g_buffer, view };
            gather_samples(context, request, &gather.display, gathered, film, watch)?;
        }
        partial.map_or(Ok(()), Err)
    }
}
