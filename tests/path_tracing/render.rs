//! A scene made ready, and rendered by the reference.

use crate::common::TestContext;
use glam::{UVec2, Vec3};
use linklight::gpu::Context;
use linklight::methods::path_tracing::{ErrorEstimate, Options, PathTracing, Settings};
use linklight::scene::builtin::{self, Source};
use linklight::scene::camera::View;
use linklight::scene::deform::world_vertices;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{self, Scene};
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::trace::Tracer;
use linklight::stages::world::World;

/// Settings of small renders.
pub fn options(size: u32, bounces: u32) -> Options {
    Options { width: size, height: size, bounces, seed: 1, settings: Settings::default() }
}

pub fn builtin(name: &str) -> Scene {
    let Source::File(bytes) = builtin::resolve(name).unwrap();
    scene::load_bytes(name, bytes).unwrap()
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
        let context: &Context = &self.context;
        let mut tracing = PathTracing::new(context, &self.scene, &self.geometry, &self.world, options).unwrap();
        let film = Film::new(context, options.width, options.height).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        tracing.sample(&mut recorder, &self.world, &Tracer::Compute(&self.bvh, (&self.world).into()), view, samples);
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
