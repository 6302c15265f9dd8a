//! A scene with a tree over its triangles, ready to be gathered from.

use crate::common::TestContext;
use glam::{UVec2, Vec2, Vec3};
use linklight::display::direct::Sample;
use linklight::display::final_gather::{FinalGather, GatherReport, Gathered, Settings};
use linklight::display::g_buffer::GBuffer;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::gpu::Recorder;
use linklight::gpu::shaders::types::SenderLeaf;
use linklight::report::tonemap::ToneSettings;
use linklight::scene::camera::{Lens, View};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{Scene, deform};
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::sender_tree::{SenderTree, triangle_leaves};
use linklight::stages::trace::Tracer;
use linklight::stages::world::World;

pub const SIZE: UVec2 = UVec2::new(40, 30);

pub struct Fixture {
    pub pose: Pose,
    pub world: World,
    pub bvh: Bvh,
    pub leaves: Vec<SenderLeaf>,
    pub view: View,
    pub seed: u32,
    bounds: [Vec3; 2],
}

/// What a gather leaves.
pub struct Gather {
    pub direct: Vec<Vec3>,
    pub indirect: Vec<Vec3>,
    pub report: GatherReport,
    /// World positions and normals; zero normals where nothing is seen.
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
}

pub fn view(position: Vec3, target: Vec3, tan_half: f32) -> View {
    let forward = (target - position).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let lens = Lens::Perspective { tan_half: Vec2::new(tan_half * 4.0 / 3.0, tan_half) };
    View { position, right, up: right.cross(forward), forward, lens, near: 0.01, far: None }
}

impl Fixture {
    pub fn new(context: &TestContext, scene: &Scene, environment: &Environment, diffuse: bool, view: View) -> Self {
        let geometry = Geometry::flatten(scene, 1 << 30).unwrap();
        let pose = Pose::rest(scene);
        let world = World::new(context, scene, &geometry, &pose, environment, diffuse).unwrap();
        let vertices = deform::world_vertices(&geometry, &pose);
        let bvh = Bvh::build(context, &vertices.positions, &geometry.triangles).unwrap();
        let one_sided = vec![u32::MAX; vertices.positions.len()];
        let (leaves, _) = triangle_leaves(&vertices.positions, &geometry.triangles, &one_sided);
        let bounds = vertices.bounds().unwrap();
        Self { pose, world, bvh, leaves, view, seed: 7, bounds }
    }

    /// Gathers `samples` from leaves that emit and reflect these, W/m2.
    pub fn gather(
        &self,
        context: &TestContext,
        settings: Settings,
        emitted: &[Vec3],
        reflected: &[Vec3],
        samples: u32,
    ) -> Gather {
        let tree = SenderTree::build(context, &self.leaves, settings.tree_options()).unwrap();
        let sent = [emitted, reflected].map(|values| context.upload("test/sent", values).unwrap());
        self.gather_from(context, settings, &tree, samples, |recorder| tree.pull(recorder, &sent[0], &sent[1]))
    }

    /// ... from any tree, which `pull` fills.
    pub fn gather_from(
        &self,
        context: &TestContext,
        settings: Settings,
        tree: &SenderTree,
        samples: u32,
        pull: impl FnOnce(&mut Recorder<'_>),
    ) -> Gather {
        let shadow_maps = ShadowMaps::new(context, &self.pose, SIZE.to_array()).unwrap();
        let g_buffer = GBuffer::new(context, SIZE.x, SIZE.y).unwrap();
        let film = Film::new(context, SIZE.x, SIZE.y).unwrap();
        let display = FinalGather::new(context, SIZE.to_array(), settings, ToneSettings::default(), self.seed).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        pull(&mut recorder);
        shadow_maps.draw(&mut recorder, &self.world, &self.pose, self.bounds);
        let from = Gathered {
            world: &self.world,
            tree,
            tracer: Tracer::compute(&self.bvh, &self.world),
            maps: None,
            bvh: &self.bvh,
            shadow_maps: &shadow_maps,
            g_buffer: &g_buffer,
            view: &self.view,
        };
        for index in 0..samples {
            display.draw(&mut recorder, from, Sample { index, samples, is_unlit: false }, &film);
        }
        recorder.submit().unwrap();
        let positions: Vec<[f32; 4]> = context.download_image(&g_buffer.position, 0).unwrap();
        Gather {
            direct: context.download(&film.direct).unwrap(),
            indirect: context.download(&film.indirect).unwrap(),
            report: display.report(context).unwrap(),
            positions: positions.iter().map(|p| Vec3::new(p[0], p[1], p[2])).collect(),
            normals: context.download(&film.normal).unwrap(),
        }
    }
}
