//! A scene on the device, ready for the method.

use crate::common::TestContext;
use glam::{UVec2, Vec3};
use linklight::display::direct::Sample;
use linklight::display::final_gather::{self, FinalGather, GatherReport, Gathered};
use linklight::display::g_buffer::GBuffer;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::gpu::Context;
use linklight::methods::surface_shadow_maps::{Lit, Settings, Stage, SurfaceShadowMaps};
use linklight::report::tonemap::ToneSettings;
use linklight::scene::atlas::{Atlas, Size};
use linklight::scene::camera::View;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{LoadOptions, Scene, builtin, deform};
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::surface_maps::{MapInput, MapOptions, MapUntil, Sequence};
use linklight::stages::trace::Tracer;
use linklight::stages::work::{Unwatched, Watch};
use linklight::stages::world::World;
use std::path::Path;

pub struct Fixture {
    pub scene: Scene,
    pub geometry: Geometry,
    pub positions: Vec<Vec3>,
    pub rest_positions: Vec<Vec3>,
    pub pose: Pose,
    pub bounds: [Vec3; 2],
    pub world: World,
    pub bvh: Bvh,
}

/// What the final gather shows of a solution.
pub struct Shown {
    pub direct: Vec<Vec3>,
    pub indirect: Vec<Vec3>,
    pub report: GatherReport,
}

impl Shown {
    /// How far its indirect light is from another's, as a share of that: root of the mean square.
    pub fn off(&self, other: &Self) -> f32 {
        let total: f32 = other.indirect.iter().map(|e| e.length_squared()).sum();
        let error: f32 = self.indirect.iter().zip(&other.indirect).map(|(a, b)| a.distance_squared(*b)).sum();
        (error / total).sqrt()
    }
}

pub fn builtin_scene(name: &str) -> Scene {
    builtin::open(&format!("builtin:{name}"), &LoadOptions::default()).unwrap()
}

impl Fixture {
    pub fn new(context: &TestContext, scene: Scene, environment: &Environment) -> Self {
        let pose = Pose::rest(&scene);
        Self::posed(context, scene, environment, pose)
    }

    /// With specular lobes, which the others leave out.
    pub fn shiny(context: &TestContext, scene: Scene, environment: &Environment) -> Self {
        let pose = Pose::rest(&scene);
        Self::of(context, scene, environment, pose, false)
    }

    pub fn posed(context: &TestContext, scene: Scene, environment: &Environment, pose: Pose) -> Self {
        Self::of(context, scene, environment, pose, true)
    }

    fn of(context: &TestContext, scene: Scene, environment: &Environment, pose: Pose, diffuse: bool) -> Self {
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let rest_positions = deform::world_positions(&geometry, &Pose::rest(&scene));
        let world = World::new(context, &scene, &geometry, &pose, environment, diffuse).unwrap();
        let vertices = deform::world_vertices(&geometry, &pose);
        let bounds = vertices.bounds().unwrap();
        let positions = context.download(&world.positions).unwrap();
        let bvh = Bvh::build(context, &positions, &geometry.triangles).unwrap();
        Self { scene, geometry, positions, rest_positions, pose, bounds, world, bvh }
    }

    pub fn tracer(&self) -> Tracer<'_> {
        Tracer::compute(&self.bvh, &self.world)
    }

    pub fn atlas(&self, resolution: u32) -> Atlas {
        Atlas::new(&self.scene, &self.geometry, &self.positions, Size::tight(resolution)).unwrap()
    }

    pub fn map_input<'a>(&'a self, atlas: &'a Atlas, cache: Option<&'a Path>) -> MapInput<'a> {
        MapInput { atlas, tracer: self.tracer(), apart: None, bounds: self.bounds, content: &[], cache }
    }

    pub fn stage<'a>(&'a self, cache: Option<&'a Path>, watch: &'a dyn Watch) -> Stage<'a> {
        Stage {
            scene: &self.scene,
            geometry: &self.geometry,
            positions: &self.positions,
            rest_positions: &self.rest_positions,
            pose: &self.pose,
            bounds: self.bounds,
            world: &self.world,
            tracer: self.tracer(),
            tone: ToneSettings::default(),
            seed: 3,
            cache,
            watch,
        }
    }

    pub fn prepare(&self, context: &TestContext, settings: Settings) -> SurfaceShadowMaps {
        SurfaceShadowMaps::prepare(context, &self.stage(None, &Unwatched), settings).unwrap()
    }

    pub fn solve(&self, context: &Context, method: &SurfaceShadowMaps, bounces: u32) {
        let mut recorder = context.recorder("test").unwrap();
        let lit = Lit { world: &self.world, tracer: self.tracer(), bvh: &self.bvh };
        method.solve(&mut recorder, lit, bounces);
        recorder.submit().unwrap();
    }

    /// One sample of each pixel of a picture, gathered from the method's solution.
    pub fn show(
        &self,
        context: &Context,
        method: &SurfaceShadowMaps,
        settings: final_gather::Settings,
        size: UVec2,
    ) -> Shown {
        let shadow_maps = ShadowMaps::new(context, &self.pose, size.to_array()).unwrap();
        let g_buffer = GBuffer::new(context, size.x, size.y).unwrap();
        let film = Film::new(context, size.x, size.y).unwrap();
        let view = View::of_scene(&self.scene, &self.pose, None, Some(self.bounds), size).unwrap();
        let display = FinalGather::new(context, size.to_array(), settings, ToneSettings::default(), 0).unwrap();
        let from = Gathered {
            world: &self.world,
            tree: &method.tree,
            tracer: self.tracer(),
            maps: method.maps.as_ref(),
            bvh: &self.bvh,
            shadow_maps: &shadow_maps,
            g_buffer: &g_buffer,
            view: &view,
        };
        let mut recorder = context.recorder("test").unwrap();
        shadow_maps.draw(&mut recorder, &self.world, &self.pose, self.bounds);
        display.draw(&mut recorder, from, Sample { index: 0, samples: 1, is_unlit: false }, &film);
        recorder.submit().unwrap();
        Shown {
            direct: context.download(&film.direct).unwrap(),
            indirect: context.download(&film.indirect).unwrap(),
            report: display.report(context).unwrap(),
        }
    }
}

pub fn options(resolution: u32, sequence: Sequence) -> MapOptions {
    MapOptions { resolution, sequence, bias: 1.0, until: MapUntil::Next, sharing: 0.0 }
}
