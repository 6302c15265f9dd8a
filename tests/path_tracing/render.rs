//! A scene made ready, and rendered by the reference.

use crate::common::TestContext;
use glam::{UVec2, Vec2, Vec3};
use linklight::gpu::Context;
use linklight::methods::path_tracing::{ErrorEstimate, Options, PathTracing, Settings};
use linklight::scene::camera::{Lens, View};
use linklight::scene::deform::world_vertices;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{self, LoadOptions, Scene};
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::trace::Tracer;
use linklight::stages::world::World;

/// Settings of small renders.
pub fn options(size: u32, bounces: u32) -> Options {
    Options { width: size, height: size, bounces, seed: 1, settings: Settings::default() }
}

pub fn builtin(name: &str) -> Scene {
    scene::open(&format!("builtin:{name}"), &LoadOptions::default()).unwrap()
}

/// Everything that belongs to one scene.
pub struct Set {
    pub context: TestContext,
    pub scene: Scene,
    pub geometry: Geometry,
    pub world: World,
    pub bvh: Bvh,
    pub pose: Pose,
}

/// A picture and how sure it is.
pub struct Rendered {
    pub direct: Vec<Vec3>,
    pub indirect: Vec<Vec3>,
    pub albedo: Vec<Vec3>,
    pub normal: Vec<Vec3>,
    pub depth: Vec<f32>,
    pub estimate: Option<ErrorEstimate>,
}

impl Set {
    pub fn new(scene: Scene, environment: &Environment, diffuse: bool) -> Self {
        let context = TestContext::new();
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let pose = Pose::rest(&scene);
        let world = World::new(&context, &scene, &geometry, &pose, environment, diffuse).unwrap();
        let positions = world_vertices(&geometry, &pose).positions;
        let bvh = Bvh::build(&context, &positions, &geometry.triangles).unwrap();
        Self { context, scene, geometry, world, bvh, pose }
    }

    /// A built-in scene, every surface Lambertian.
    pub fn builtin(name: &str) -> Self {
        Self::new(builtin(name), &Environment::default(), true)
    }

    /// Through the camera of that name or index, the first one by default.
    pub fn view(&self, camera: Option<&str>, size: UVec2) -> View {
        View::of_scene(&self.scene, &self.pose, camera, None, size).unwrap()
    }

    pub fn render(&self, view: &View, options: Options, samples: u32) -> Rendered {
        self.render_in_steps(view, options, &[samples])
    }

    /// Samples added a few at a time, each step in a submission of its own.
    pub fn render_in_steps(&self, view: &View, options: Options, steps: &[u32]) -> Rendered {
        let mut tracing = PathTracing::new(&self.context, &self.scene, &self.geometry, &self.world, options).unwrap();
        self.finish(&mut tracing, view, options, steps)
    }

    /// Prepared where the scene stands, rendered after everything moved to `pose`.
    pub fn render_moved(&self, pose: &Pose, view: &View, samples: u32) -> Rendered {
        let options = options(32, 0);
        let mut tracing = PathTracing::new(&self.context, &self.scene, &self.geometry, &self.world, options).unwrap();
        let mut recorder = self.context.recorder("test").unwrap();
        self.world.pose(&mut recorder, pose);
        self.bvh.refit(&mut recorder, &self.world.positions).unwrap();
        recorder.submit().unwrap();
        tracing.prepare(&self.context, &self.world).unwrap();
        self.finish(&mut tracing, view, options, &[samples])
    }

    fn finish(&self, tracing: &mut PathTracing, view: &View, options: Options, steps: &[u32]) -> Rendered {
        let context: &Context = &self.context;
        let tracer = Tracer::Compute(&self.bvh, (&self.world).into());
        let film = Film::new(context, options.width, options.height).unwrap();
        for &samples in steps {
            let mut recorder = context.recorder("test").unwrap();
            tracing.sample(&mut recorder, &self.world, &tracer, view, samples);
            recorder.submit().unwrap();
        }
        let mut recorder = context.recorder("test").unwrap();
        tracing.resolve(&mut recorder, &film);
        recorder.submit().unwrap();
        Rendered {
            direct: context.download(&film.direct).unwrap(),
            indirect: context.download(&film.indirect).unwrap(),
            albedo: context.download(&film.albedo).unwrap(),
            normal: context.download(&film.normal).unwrap(),
            depth: context.download(&film.depth).unwrap(),
            estimate: tracing.error_estimate(context).unwrap(),
        }
    }
}

impl Rendered {
    /// Direct and indirect light together.
    pub fn radiance(&self) -> Vec<Vec3> {
        self.direct.iter().zip(&self.indirect).map(|(&direct, &indirect)| direct + indirect).collect()
    }
}

pub fn mean(values: &[Vec3]) -> Vec3 {
    let sum = values.iter().fold(glam::DVec3::ZERO, |sum, value| sum + value.as_dvec3());
    (sum / values.len() as f64).as_vec3()
}

/// An orthographic view of a square of `2 half_extent` metres, from an eye along `forward`.
pub fn view_along(position: Vec3, forward: Vec3, up: Vec3, half_extent: f32) -> View {
    let lens = Lens::Orthographic { half_extent: Vec2::splat(half_extent) };
    View { position, right: forward.cross(up), up, forward, lens, near: 0.0, far: None }
}

/// As [`view_along`], at z = `height` looking along -Z at `centre`, picture up = +Y.
pub fn looking_down(centre: Vec2, half_extent: f32, height: f32) -> View {
    view_along(centre.extend(height), Vec3::NEG_Z, Vec3::Y, half_extent)
}
