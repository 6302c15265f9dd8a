//! A scene posed on the device with its hierarchy, ready for a method on elements, in one value.

use super::TestContext;
use glam::Vec3;
use linklight::methods::explicit_visibility::Stage;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::tessellate::{Fineness, tessellate};
use linklight::scene::{self, LoadOptions, Scene, deform};
use linklight::stages::bvh::Bvh;
use linklight::stages::trace::Tracer;
use linklight::stages::work::Unwatched;
use linklight::stages::world::World;

const MEMORY: u64 = 1 << 30;

/// A scene, posed, on the device, with its hierarchy.
pub struct Fixture {
    pub scene: Scene,
    pub geometry: Geometry,
    pub rest_positions: Vec<Vec3>,
    pub environment: Environment,
    pub world: World,
    pub bvh: Bvh,
}

pub fn builtin_scene(name: &str) -> Scene {
    scene::open(&format!("builtin:{name}"), &LoadOptions::default()).unwrap()
}

impl Fixture {
    /// Tessellated to edges of at most `max_edge` (metres), posed by `pose`.
    pub fn posed(
        context: &TestContext,
        scene: Scene,
        max_edge: Option<f32>,
        environment: Environment,
        pose: impl Fn(&Scene) -> Pose,
    ) -> Self {
        let geometry = Geometry::flatten(&scene, MEMORY).unwrap();
        let rest = Pose::rest(&scene);
        let (geometry, rest_positions) = match max_edge {
            Some(length) => {
                let cut = tessellate(geometry, &rest, Fineness::MaxEdge(length), MEMORY).unwrap();
                (cut.geometry, cut.rest_positions)
            }
            None => {
                let positions = deform::world_positions(&geometry, &rest);
                (geometry, positions)
            }
        };
        let pose = pose(&scene);
        let world = World::new(context, &scene, &geometry, &pose, &environment, true).unwrap();
        let positions = context.download(&world.positions).unwrap();
        let bvh = Bvh::build(context, &positions, &geometry.triangles).unwrap();
        Self { scene, geometry, rest_positions, environment, world, bvh }
    }

    pub fn new(context: &TestContext, scene: Scene, max_edge: Option<f32>) -> Self {
        Self::posed(context, scene, max_edge, Environment::default(), Pose::rest)
    }

    pub fn stage(&self) -> Stage<'_> {
        Stage {
            scene: &self.scene,
            geometry: &self.geometry,
            rest_positions: &self.rest_positions,
            environment: &self.environment,
            world: &self.world,
            tracer: Tracer::compute(&self.bvh, &self.world),
            watch: &Unwatched,
        }
    }
}

/// What a solve leaves, downloaded.
#[derive(Debug, PartialEq)]
pub struct Solution {
    pub punctual: Vec<Vec3>,
    pub direct: Vec<Vec3>,
    pub indirect: Vec<Vec3>,
    /// Of the last bounce alone; all direct light without bounces.
    pub last: Vec<Vec3>,
}
