//! `display/irradiance_vector` against its twin: every channel shines along its own vector, per pixel and per vertex.

use crate::common::{Random, TestContext};
use crate::compare::{hold, tells_apart};
use crate::display::{Case, RADIANCE, SIZE, Surfaces, brdf, case};
use crate::irradiance_vector::{FUNCTIONS, Leaves, REACH, UNIT, packed};
use glam::{Mat3, UVec2, Vec2, Vec3, Vec4};
use linklight::display::direct::{Canvas, Lighting};
use linklight::display::g_buffer::GBuffer;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::display::{PixelView, irradiance_vector};
use linklight::gpu::Context;
use linklight::gpu::shaders::types::LeafElement;
use linklight::scene::camera::Lens;
use linklight::scene::deform::world_vertices;
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::irradiance_vector::ElementLight;
use linklight::stages::trace::Tracer;
use linklight::stages::world::World;

const LEAST_ALPHA: f32 = 0.2;

/// The scene of the display's tests without its lights, its floor in two leaves, its panels in one, all backs in one.
struct Lit {
    case: Case,
    leaves: Leaves,
    triangle_leaves: Vec<UVec2>,
    direct: Vec<Mat3>,
    indirect: Vec<Mat3>,
}

impl Lit {
    fn new(lens: Lens) -> Self {
        let mut case = case(lens);
        case.pose.lights.clear();
        let random = &mut Random(77);
        let flat = |center: Vec3, axis_y: Vec3, half_extent: Vec3| LeafElement {
            center,
            axis_x: Vec3::X,
            axis_y,
            half_extent,
        };
        let half = Vec3::new(1.0, 2.0, 0.01);
        let panels = flat(Vec3::new(0.0, 0.5, -2.1), Vec3::Y, Vec3::new(2.0, 0.6, 0.1));
        let shapes = vec![
            flat(Vec3::NEG_X, Vec3::NEG_Z, half),
            flat(Vec3::X, Vec3::NEG_Z, half),
            panels,
            LeafElement { axis_y: Vec3::NEG_Y, ..panels },
        ];
        let rows = vec![vec![1], vec![0], vec![], vec![]];
        let positions = world_vertices(&case.geometry, &case.pose).positions;
        let leaf_of = |t: &[u32; 3]| {
            let centre = t.iter().map(|&v| positions[v as usize]).sum::<Vec3>() / 3.0;
            if centre.y > 0.01 { UVec2::new(2, 3) } else { UVec2::new(u32::from(centre.x > 0.0), u32::MAX) }
        };
        let triangle_leaves = case.geometry.triangles.iter().map(leaf_of).collect();
        // Mostly from above and from the front; eighths are halves exactly.
        let mut vectors = || -> Vec<Mat3> {
            let mut eighth = |low: f32| low + random.below(9) as f32 / 8.0;
            let constant = |at: &mut dyn FnMut(f32) -> f32| {
                Mat3::from_cols_array(
                    &[-0.5, 0.5, 0.5].repeat(3).iter().map(|&low| at(low)).collect::<Vec<_>>().try_into().unwrap(),
                )
            };
            (0..4 * FUNCTIONS).map(|k| constant(&mut eighth) * if k % FUNCTIONS == 0 { 4.0 } else { 0.5 }).collect()
        };
        let (direct, indirect) = (vectors(), vectors());
        Self { case, leaves: Leaves { shapes, rows }, triangle_leaves, direct, indirect }
    }

    /// Of light along the columns of `vectors`, towards the eye.
    fn radiance(vectors: Mat3, [albedo, specular]: [Vec4; 2], normal: Vec3, alpha: f32, to_eye: Vec3) -> Vec3 {
        let channel = |c: usize| {
            let v = vectors.col(c);
            let along = normal.dot(v);
            let value = || brdf(albedo, specular, normal, alpha.max(LEAST_ALPHA), to_eye, v.normalize());
            if along > 0.0 { value()[c] * along } else { 0.0 }
        };
        Vec3::new(channel(0), channel(1), channel(2))
    }

    /// Direct and indirect light of every pixel.
    fn twin(&self, surfaces: &Surfaces, per_vertex: bool) -> [Vec<Vec3>; 2] {
        let world = world_vertices(&self.case.geometry, &self.case.pose);
        let is_orthographic = matches!(self.case.view.lens, Lens::Orthographic { .. });
        let towards = |point: Vec3| match is_orthographic {
            true => -self.case.view.forward,
            false => (self.case.view.position - point).normalize(),
        };
        let pixel = |index: usize, vectors: &[Mat3]| -> Vec3 {
            let seen = surfaces.triangle[index];
            if seen == 0 || surfaces.emission[index].w <= 0.5 {
                return Vec3::ZERO;
            }
            let (position, n) = (surfaces.position[index], surfaces.normal[index]);
            let look = [surfaces.albedo[index], surfaces.specular[index]];
            let corners = self.case.geometry.triangles[seen as usize - 1].map(|vertex| vertex as usize);
            let [a, b, c] = corners.map(|vertex| world.positions[vertex]);
            let is_back = (b - a).cross(c - a).dot(towards(position.truncate())) < 0.0;
            let sides = self.triangle_leaves[seen as usize - 1];
            let leaf = if is_back && sides.y != u32::MAX { sides.y } else { sides.x } as usize;
            let shade = |point: Vec3, normal: Vec3| {
                Self::radiance(self.leaves.light(vectors, leaf, point), look, normal, n.w, towards(point))
            };
            if !per_vertex {
                return shade(position.truncate(), n.truncate());
            }
            let weights = [1.0 - position.w - look[1].w, position.w, look[1].w];
            let side = if is_back { -1.0 } else { 1.0 };
            let corner = |(&v, w): (&usize, f32)| w * shade(world.positions[v], side * world.normals[v]);
            corners.iter().zip(weights).map(corner).sum()
        };
        [&self.direct, &self.indirect].map(|vectors| (0..surfaces.triangle.len()).map(|i| pixel(i, vectors)).collect())
    }

    /// The device's film and surfaces; direct light without what the surfaces emit.
    fn draw(&self, context: &Context, per_vertex: bool) -> ([Vec<Vec3>; 2], Surfaces) {
        let Case { scene, geometry, pose, environment, view, .. } = &self.case;
        let world = World::new(context, scene, geometry, pose, environment, false).unwrap();
        let shadow_maps = ShadowMaps::new(context, pose, SIZE.to_array()).unwrap();
        let g_buffer = GBuffer::new(context, SIZE.x, SIZE.y).unwrap();
        let film = Film::new(context, SIZE.x, SIZE.y).unwrap();
        let halves = |vectors: &[Mat3]| context.upload("test/vectors", &vectors.iter().map(packed).collect::<Vec<_>>());
        let (direct, indirect) = (halves(&self.direct).unwrap(), halves(&self.indirect).unwrap());
        let light = ElementLight {
            leaves: &context.upload("test/leaves", &self.leaves.shapes).unwrap(),
            triangle_leaves: &context.upload("test/triangle leaves", &self.triangle_leaves).unwrap(),
            direct: &direct,
            indirect: &indirect,
            unit: UNIT,
            functions: FUNCTIONS as u32,
            neighbour_offsets: &context.upload("test/rows", &self.leaves.row_starts()).unwrap(),
            neighbours: &context.upload("test/neighbours", &self.leaves.rows.concat()).unwrap(),
            reach: REACH,
            colors: &context.upload("test/colors", &[Vec3::ZERO]).unwrap(),
            shows_colors: false,
            least_alpha: LEAST_ALPHA,
            per_vertex,
        };
        let positions = world_vertices(geometry, pose).positions;
        let bvh = Bvh::build(context, &positions, &geometry.triangles).unwrap();
        let (world, shadow_maps, g_buffer, film) = (&world, &shadow_maps, &g_buffer, &film);
        let tracer = Tracer::compute(&bvh, world);
        let mut recorder = context.recorder("test").unwrap();
        let lighting = Lighting { world, shadow_maps, tracer, g_buffer };
        let canvas = Canvas { lighting, view, samples: 1, film };
        irradiance_vector::draw(&mut recorder, light, canvas);
        g_buffer.draw(&mut recorder, world, &PixelView::new(view, SIZE, 0, 1));
        recorder.submit().unwrap();
        let surfaces = Surfaces::of(context, g_buffer);
        let [mut direct, indirect] = [&film.direct, &film.indirect].map(|of| context.download(of).unwrap());
        for (index, pixel) in direct.iter_mut().enumerate() {
            let is_background = surfaces.triangle[index] == 0;
            *pixel = if is_background { Vec3::ZERO } else { *pixel - surfaces.emission[index].truncate() };
        }
        ([direct, indirect], surfaces)
    }
}

#[test]
fn irradiance_vector_agrees_with_its_twin() {
    let context = TestContext::new();
    let lenses = [
        Lens::Perspective { tan_half: Vec2::new(0.75, 0.53) },
        Lens::Orthographic { half_extent: Vec2::new(2.6, 1.8) },
    ];
    for lens in lenses {
        let mut lit = Lit::new(lens);
        for per_vertex in [false, true] {
            let (got, surfaces) = lit.draw(&context, per_vertex);
            let expected = lit.twin(&surfaces, per_vertex);
            assert!(expected[0].iter().filter(|light| light.min_element() > 0.0).count() > 500, "most pixels are lit");
            for (k, what) in ["direct", "indirect"].into_iter().enumerate() {
                hold(&format!("{what}, per vertex {per_vertex}"), &got[k], &expected[k], RADIANCE);
            }
            tells_apart("shaded elsewhere", &lit.twin(&surfaces, !per_vertex)[0], &expected[0], RADIANCE);
            let rows = std::mem::replace(&mut lit.leaves.rows, vec![Vec::new(); 4]);
            tells_apart("without neighbours", &lit.twin(&surfaces, per_vertex)[0], &expected[0], RADIANCE);
            lit.leaves.rows = rows;
        }
    }
}
