//! The method whose light lives on the texels of an atlas, with the display stages that show it.

use super::AppError;
use super::cli::Display;
use super::frame::{Gathering, check_visibility, gather_samples};
use super::render::{RenderRequest, cache_folder};
use super::stage::Stage;
use crate::display::direct::{Canvas, Lighting};
use crate::display::final_gather::{self, FinalGather, Gathered, Visibility};
use crate::display::g_buffer::GBuffer;
use crate::display::glossy_texels::GlossyTexels;
use crate::display::lightmap::{self, Gloss, Lightmap, TexelLight};
use crate::display::shadow_maps::ShadowMaps;
use crate::gpu::Context;
use crate::methods::pick::seen_triangle;
use crate::methods::surface_shadow_maps::{self, Lit, Report, SurfaceShadowMaps};
use crate::report::image::write_exr;
use crate::stages::film::Film;
use crate::stages::work::Watch;
use glam::{UVec2, Vec3};
use std::path::Path;

/// Surface shadow maps, ready to be shown.
pub struct TexelsShown {
    method: SurfaceShadowMaps,
    shadow_maps: ShadowMaps,
    g_buffer: GBuffer,
    shown: Shown,
}

/// See [`TexelsShown::lightmap`].
pub struct LightmapShown<'a> {
    pub display: &'a Lightmap,
    pub shadow_maps: &'a ShadowMaps,
    pub g_buffer: &'a GBuffer,
    pub method: &'a SurfaceShadowMaps,
    /// As the last frame left it.
    pub gloss: Option<Gloss<'a>>,
}

enum Shown {
    FinalGather(Box<FinalGather>),
    Lightmap(Box<Lightmap>, Option<Box<GlossyTexels>>),
}

impl Shown {
    fn new(context: &Context, request: &RenderRequest, method: &SurfaceShadowMaps) -> Result<Self, AppError> {
        if request.display == Some(Display::Lightmap) {
            let gathers = method.settings().glossy_bounce && !request.diffuse;
            let gather = || {
                let settings = final_gather::Settings { gather_visibility: Visibility::Auto, ..Default::default() };
                GlossyTexels::new(context, &method.atlas, settings, request.tone, request.seed)
            };
            let gloss = gathers.then(gather).transpose()?.map(Box::new);
            return Ok(Self::Lightmap(Box::new(Lightmap::new(context, &method.atlas)?), gloss));
        }
        let size = [request.width, request.height];
        let settings = request.final_gather_settings()?;
        check_visibility(request, settings.gather_visibility, method.maps.is_some())?;
        let display = FinalGather::new(context, size, settings, request.tone, request.seed)?;
        Ok(Self::FinalGather(Box::new(display)))
    }
}

/// What the method sees of a staged scene.
fn of_scene<'a>(
    request: &RenderRequest,
    stage: &'a Stage,
    positions: &'a [Vec3],
    cache: Option<&'a Path>,
    watch: &'a dyn Watch,
) -> surface_shadow_maps::Stage<'a> {
    surface_shadow_maps::Stage {
        scene: &stage.scene,
        geometry: &stage.geometry,
        positions,
        rest_positions: &stage.rest_positions,
        pose: &stage.pose,
        bounds: stage.bounds,
        world: &stage.world,
        tracer: stage.tracer(),
        tone: request.tone,
        seed: request.seed,
        cache,
        watch,
    }
}

impl TexelsShown {
    pub fn prepare(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        watch: &dyn Watch,
    ) -> Result<Self, AppError> {
        let (positions, cache) = (context.download(&stage.world.positions)?, cache_folder());
        let of_scene = of_scene(request, stage, &positions, cache.as_deref(), watch);
        let method = SurfaceShadowMaps::prepare(context, &of_scene, request.settings()?).map_err(AppError::failed)?;
        tracing::info!("{}", method.report());
        let shown = Shown::new(context, request, &method)?;
        let shadow_maps = ShadowMaps::new(context, &stage.pose, [request.width, request.height])?;
        let g_buffer = GBuffer::new(context, request.width, request.height)?;
        Ok(Self { method, shadow_maps, g_buffer, shown })
    }

    /// As [`super::frame::Method::follow`].
    pub fn follow(
        &mut self,
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        watch: &dyn Watch,
    ) -> Result<bool, AppError> {
        let positions = context.download(&stage.world.positions)?;
        let of_scene = of_scene(request, stage, &positions, None, watch);
        self.method.place(context, &of_scene).map_err(AppError::failed)
    }

    /// A picture of the atlas or of a map, in place of the scene.
    fn flat_frame(&self, context: &Context, stage: &Stage, film: &Film) -> Result<(), AppError> {
        let size = UVec2::new(film.width, film.height);
        let positions = context.download(&stage.world.positions)?;
        let triangles = context.download(&stage.world.triangles)?;
        let texel = self.method.picked_texel(|pixel| {
            let seen = seen_triangle(&positions, &triangles, &stage.view, pixel, size)?;
            let ray = stage.view.ray(pixel.as_vec2() + 0.5, size);
            Some((ray.origin + seen.distance * ray.direction, seen))
        });
        let Some(flat) = self.method.flat_picture(texel) else { return Ok(()) };
        let mut recorder = context.recorder("frame")?;
        for buffer in [&film.direct, &film.indirect, &film.albedo, &film.normal] {
            recorder.fill(buffer, 0);
        }
        recorder.fill(&film.depth, 0);
        recorder.submit()?;
        Ok(context.write(&film.direct, &flat.fitted(size))?)
    }

    /// As [`super::frame::Method::gathering`].
    pub(super) fn gathering(&mut self) -> Option<Gathering<'_>> {
        let Self { method, shadow_maps, g_buffer, shown } = self;
        let Shown::FinalGather(display) = shown else { return None };
        Some(Gathering { display, tree: &method.tree, shadow_maps, g_buffer, has_maps: method.maps.is_some() })
    }

    /// What shows the atlas, where it is shown by a filter over its texels.
    pub fn lightmap(&self) -> Option<LightmapShown<'_>> {
        let Self { method, shadow_maps, g_buffer, shown } = self;
        match shown {
            Shown::Lightmap(display, gloss) => {
                let gloss = gloss.as_ref().map(|gloss| gloss.gloss());
                Some(LightmapShown { display, shadow_maps, g_buffer, method, gloss })
            }
            Shown::FinalGather(_) => None,
        }
    }

    pub fn report(&self) -> Report {
        self.method.report()
    }

    /// The solution of `bounces` bounces alone.
    pub fn solve(&self, context: &Context, stage: &Stage, bounces: u32) -> Result<&SurfaceShadowMaps, AppError> {
        let mut recorder = context.recorder("frame")?;
        recorder.scope("surface-shadow-maps", |recorder| {
            let lit = Lit { world: &stage.world, tracer: stage.tracer(), bvh: &stage.bvh };
            self.method.solve(recorder, lit, bounces);
        });
        recorder.submit()?;
        Ok(&self.method)
    }

    /// As [`super::frame::Method::show`].
    pub fn show(&mut self, context: &Context, request: &RenderRequest, stage: &Stage) -> Result<(), AppError> {
        self.shown = Shown::new(context, request, &self.method)?;
        self.g_buffer = GBuffer::new(context, request.width, request.height)?;
        self.shadow_maps = ShadowMaps::new(context, &stage.pose, [request.width, request.height])?;
        Ok(())
    }

    pub fn frame(
        &self,
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        film: &Film,
        watch: &dyn Watch,
    ) -> Result<(), AppError> {
        let (world, method) = (&stage.world, &self.method);
        if method.settings().show != surface_shadow_maps::Shown::Light {
            return self.flat_frame(context, stage, film);
        }
        // A final gather adds a bounce of its own; a lightmap shows what there is.
        let gathers = matches!(self.shown, Shown::FinalGather(_));
        self.solve(context, stage, if gathers { request.bounces.saturating_sub(1) } else { request.bounces })?;
        let mut recorder = context.recorder("frame")?;
        if gathers && request.bounces == 0 {
            method.emit_only(&mut recorder);
        }
        recorder.scope("display", |recorder| self.shadow_maps.draw(recorder, world, &stage.pose, stage.bounds));
        recorder.submit()?;
        if let Some(path) = &request.lightmap {
            let [mut irradiance, indirect] =
                [context.download(method.direct_irradiance())?, context.download(method.indirect_irradiance())?];
            irradiance.iter_mut().zip(indirect).for_each(|(sum, value)| *sum += value);
            write_exr(path, &lightmap::picture(&method.atlas, &irradiance)?)?;
        }
        let gathered = Gathered {
            world,
            tree: &method.tree,
            tracer: stage.tracer(),
            maps: method.maps.as_ref(),
            bvh: &stage.bvh,
            shadow_maps: &self.shadow_maps,
            g_buffer: &self.g_buffer,
            view: &stage.view,
        };
        match &self.shown {
            Shown::FinalGather(display) => gather_samples(context, request, display, gathered, film, watch),
            Shown::Lightmap(display, gloss) => {
                let light = TexelLight {
                    direct_irradiance: method.direct_irradiance(),
                    indirect_irradiance: method.indirect_irradiance(),
                    gloss: gloss.as_ref().map(|gloss| gloss.gloss()),
                };
                let mut recorder = context.recorder("frame")?;
                recorder.scope("display", |recorder| {
                    if let Some(gloss) = gloss {
                        method.send_before_last(recorder);
                        gloss.draw(recorder, &method.texels, gathered, request.spp);
                    }
                    let (shadow_maps, g_buffer, view) = (&self.shadow_maps, &self.g_buffer, &stage.view);
                    let (tracer, samples) = (stage.tracer(), request.spp);
                    let canvas =
                        Canvas { lighting: Lighting { world, shadow_maps, tracer, g_buffer }, view, samples, film };
                    display.draw(recorder, light, canvas);
                });
                Ok(recorder.submit()?)
            }
        }
    }
}
