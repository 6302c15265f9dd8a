//! A scene made ready for the method, in one value, and what a solve leaves on its leaves.

use crate::common::TestContext;
use glam::{Mat3, Vec3};
use linklight::gpu::shaders::types::{FaceElement, SharedVectors};
use linklight::methods::face_cluster::{FaceClusterError, FaceClusters, Settings, Stage};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::tessellate::{Fineness, tessellate};
use linklight::scene::{self, LoadOptions, Scene, deform};
use linklight::stages::bvh::Bvh;
use linklight::stages::work::Unwatched;
use linklight::stages::world::World;

const MEMORY: u64 = 1 << 30;

/// A scene at rest, on the device, with its hierarchy.
pub struct Fixture {
    pub scene: Scene,
    pub geometry: Geometry,
    pub positions: Vec<Vec3>,
    pub pose: Pose,
    pub bounds: [Vec3; 2],
    pub environment: Environment,
    pub world: World,
    pub bvh: Bvh,
}

pub fn builtin_scene(name: &str) -> Scene {
    scene::open(&format!("builtin:{name}"), &LoadOptions::default()).unwrap()
}

impl Fixture {
    /// Tessellated to edges of at most `max_edge` (metres).
    pub fn lit(context: &TestContext, scene: Scene, max_edge: Option<f32>, environment: Environment) -> Self {
        let geometry = Geometry::flatten(&scene, MEMORY).unwrap();
        let pose = Pose::rest(&scene);
        let geometry = match max_edge {
            Some(length) => tessellate(geometry, &pose, Fineness::MaxEdge(length), MEMORY).unwrap().geometry,
            None => geometry,
        };
        let vertices = deform::world_vertices(&geometry, &pose);
        let bounds = vertices.bounds().unwrap();
        let positions = vertices.positions;
        let world = World::new(context, &scene, &geometry, &pose, &environment, true).unwrap();
        let bvh = Bvh::build(context, &positions, &geometry.triangles).unwrap();
        Self { scene, geometry, positions, pose, bounds, environment, world, bvh }
    }

    pub fn new(context: &TestContext, scene: Scene, max_edge: Option<f32>) -> Self {
        Self::lit(context, scene, max_edge, Environment::default())
    }

    pub fn stage(&self) -> Stage<'_> {
        Stage {
            scene: &self.scene,
            geometry: &self.geometry,
            rest_positions: &self.positions,
            pose: &self.pose,
            bounds: self.bounds,
            environment: &self.environment,
            world: &self.world,
            bvh: &self.bvh,
            cluster_cache: None,
            watch: &Unwatched,
        }
    }

    /// Prepared and solved.
    pub fn solve(&self, context: &TestContext, settings: Settings, bounces: u32) -> FaceClusters {
        self.try_solve(context, settings, bounces).unwrap()
    }

    pub fn try_solve(
        &self,
        context: &TestContext,
        settings: Settings,
        bounces: u32,
    ) -> Result<FaceClusters, FaceClusterError> {
        let mut method = FaceClusters::prepare(context, &self.stage(), settings)?;
        method.solve(context, &self.stage(), bounces)?;
        Ok(method)
    }
}

/// A leaf element with the irradiance of its mean normal, W/m2, mean over its faces.
pub struct Leaf {
    pub index: u32,
    pub element: FaceElement,
    pub direct: Vec3,
    pub indirect: Vec3,
}

/// All leaves.
pub fn leaves(context: &TestContext, method: &FaceClusters) -> Vec<Leaf> {
    let count = method.report().elements as usize;
    let state = method.state();
    let functions = state.direct().len() / state.elements.len();
    let means = context.download_range(state.function_means(), 0..count * functions).unwrap();
    let elements = context.download_range(&state.elements, 0..count).unwrap();
    let direct = context.download_range(state.direct(), 0..count * functions).unwrap();
    let indirect = context.download_range(state.indirect(), 0..count * functions).unwrap();
    let mut leaves = Vec::new();
    for (i, element) in elements.into_iter().enumerate() {
        if element.children == u32::MAX {
            let normal = element.axis_z * ((element.facing[4] - element.facing[5]) / element.area.max(1e-30));
            let along = |of: &[[[f32; 3]; 3]]| -> Vec3 {
                let own = i * functions..(i + 1) * functions;
                let values = of[own.clone()].iter().zip(&means[own]);
                values.map(|(v, &mean)| mean * (Mat3::from_cols_array_2d(v).transpose() * normal)).sum()
            };
            leaves.push(Leaf {
                index: leaves.len() as u32,
                direct: along(&direct),
                indirect: along(&indirect),
                element,
            });
        }
    }
    leaves
}

/// Received by all leaves that `wanted` chooses, W, and their area, m2.
pub fn received(leaves: &[Leaf], wanted: impl Fn(&FaceElement) -> bool) -> (f64, f64) {
    let chosen = leaves.iter().filter(|leaf| wanted(&leaf.element));
    chosen.fold((0.0, 0.0), |(power, area), leaf| {
        let a = f64::from(leaf.element.area);
        (power + a * f64::from(leaf.direct.x + leaf.indirect.x), area + a)
    })
}

/// Nine numbers out of a record with a shared exponent.
pub fn of_shared(record: &SharedVectors, unit: f32) -> [f32; 9] {
    let exponent: u32 = (0..3).map(|c| (record.words[c] >> 30) << (2 * c)).sum();
    let mantissa = |bits: u32| if bits < 512 { bits as f32 } else { bits as f32 - 1024.0 };
    let value = |k: usize| mantissa(record.words[k / 3] >> (10 * (k % 3)) & 0x3ff);
    std::array::from_fn(|k| unit * value(k) / 512.0 * 2f32.powi(exponent as i32 - 48))
}
