//! `display/vertex` against its twin: interpolated irradiance, both lobes of punctual light, the background.
//!
//! The G-buffer comes from the device (it has a test of its own). What stands between a surface and a light is found by
//! asking every triangle: shadow maps must answer as rays do, or leave it to rays.

use crate::common::lobe;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use glam::{UVec2, Vec2, Vec3, Vec4};
use linklight::display::PixelView;
use linklight::display::direct::{Canvas, Lighting};
use linklight::display::g_buffer::GBuffer;
use linklight::display::pixel_samples::sample_offset;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::display::vertex::{self, VertexLight};
use linklight::gpu::{Context, Image};
use linklight::scene::camera::{Lens, View};
use linklight::scene::deform::world_vertices;
use linklight::scene::environment::{Environment, EnvironmentMap};
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::{Pose, PosedLight};
use linklight::scene::{LightKind, Material, Node, Primitive, Scene};
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::trace::Tracer;
use linklight::stages::world::World;
use std::f32::consts::PI;

pub const SIZE: UVec2 = UVec2::new(61, 43);
/// Radiance near 1 out of some fifty roundings; a narrow lobe multiplies errors of directions by 1 / alpha = 6.
pub const RADIANCE: Tolerance = Tolerance { absolute: 5e-5, relative: 3e-4 };
/// The map is read at a direction that drivers take through arc functions, see `environment_irradiance`.
const BACKGROUND: Tolerance = Tolerance { absolute: 2e-3, relative: 0.0 };

/// The film, or the twin's film: pixels row by row.
#[derive(Default)]
struct Pictures {
    direct: Vec<Vec3>,
    indirect: Vec<Vec3>,
    albedo: Vec<Vec3>,
    normal: Vec<Vec3>,
    depth: Vec<f32>,
    is_background: Vec<bool>,
}

pub struct Case {
    pub scene: Scene,
    pub geometry: Geometry,
    pub pose: Pose,
    pub environment: Environment,
    pub view: View,
    direct_irradiance: Vec<Vec3>,
    indirect_irradiance: Vec<Vec3>,
}

/// A floor of shiny cells under a point light and a sun, beside an unlit and a glowing panel.
pub fn case(lens: Lens) -> Case {
    let random = &mut Random(51);
    let shiny = Material {
        metallic: 0.3,
        roughness: 0.4,
        specular: 0.9,
        specular_color: Vec3::new(1.0, 0.8, 0.6),
        ..lambert(Vec3::new(0.7, 0.5, 0.3))
    };
    let glowing = Material { emission: Vec3::new(2.0, 1.0, 0.5), ..lambert(Vec3::splat(0.2)) };
    let unlit = Material { unlit: true, ..lambert(Vec3::new(0.3, 0.6, 0.9)) };
    let mut floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 6, 0);
    for normal in &mut floor.normals {
        *normal = (Vec3::Y + 0.3 * (Vec3::new(random.unit(), 0.0, random.unit()) - 0.5)).normalize();
    }
    let panel = |x: f32, material| parallelogram(Vec3::new(x, 0.1, -2.1), Vec3::X * 0.8, Vec3::Y * 0.9, 2, material);
    let lights = [
        (light(LightKind::Point, 6.0), Vec3::new(0.4, 2.5, 0.6), Vec3::NEG_Y),
        (light(LightKind::Directional, 1.5), Vec3::Y, Vec3::new(-0.3, -1.0, -0.4)),
        (light(LightKind::Spot { inner_angle: 0.3, outer_angle: 0.8 }, 9.0), Vec3::new(-1.0, 3.0, 0.0), Vec3::NEG_Y),
    ];
    let turned_away = parallelogram(Vec3::new(0.4, 0.1, -2.1), Vec3::X * -0.8, Vec3::Y * 0.9, 2, 0);
    let panels = [panel(-1.6, 1), panel(0.8, 2), turned_away];
    let primitives = std::iter::once(floor).chain(panels).collect();
    let scene = scene(vec![shiny, glowing, unlit], primitives, &lights);
    let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
    // Fronts, then backs.
    let mut values = |scale: f32| -> Vec<Vec3> {
        let value = |_| scale * Vec3::new(random.unit(), random.unit(), random.unit());
        (0..2 * geometry.vertex_count()).map(value).collect()
    };
    let (direct_irradiance, indirect_irradiance) = (values(1.0), values(2.0));
    let texels = (0..16 * 8).map(|i| Vec3::new((i % 16) as f32 / 16.0, (i / 16) as f32 / 8.0, 0.5)).collect();
    let environment = Environment::Map(EnvironmentMap { width: 16, height: 8, texels, rotation: 0.4 });
    let position = Vec3::new(0.3, 1.6, 4.0);
    let forward = (Vec3::new(0.0, 0.4, 0.0) - position).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let view = View { position, right, up: right.cross(forward), forward, lens, near: 0.05, far: None };
    let pose = Pose::rest(&scene);
    Case { scene, geometry, pose, environment, view, direct_irradiance, indirect_irradiance }
}

/// The G-buffer of one sample as the device drew it.
pub struct Surfaces {
    pub triangle: Vec<u32>,
    pub position: Vec<Vec4>,
    pub normal: Vec<Vec4>,
    pub albedo: Vec<Vec4>,
    pub specular: Vec<Vec4>,
    pub emission: Vec<Vec4>,
}

impl Surfaces {
    pub fn of(context: &Context, g_buffer: &GBuffer) -> Self {
        let image = |image: &Image| -> Vec<Vec4> {
            context.download_image::<[f32; 4]>(image, 0).unwrap().into_iter().map(Vec4::from).collect()
        };
        Self {
            triangle: context.download_image(&g_buffer.visible_triangles, 0).unwrap(),
            position: image(&g_buffer.position),
            normal: image(&g_buffer.normal),
            albedo: image(&g_buffer.albedo),
            specular: image(&g_buffer.specular),
            emission: image(&g_buffer.emission),
        }
    }
}

/// What arrives on a plane facing the light, W/m2, and the direction towards it.      [KHR_lights_punctual]
fn arriving(light: &PosedLight, point: Vec3) -> (Vec3, Vec3) {
    let offset = light.position - point;
    let falloff = match light.kind {
        LightKind::Directional => return (light.intensity, -light.direction),
        LightKind::Point => 1.0,
        LightKind::Spot { inner_angle, outer_angle } => {
            let cosine = light.direction.dot(-offset.normalize());
            ((cosine - outer_angle.cos()) / (inner_angle.cos() - outer_angle.cos())).clamp(0.0, 1.0).powi(2)
        }
    };
    (light.intensity * falloff / offset.length_squared(), offset.normalize())
}

/// Whether no triangle stands in the way from `point` to the light.
fn is_free(light: &PosedLight, point: Vec3, triangles: &[[Vec3; 3]]) -> bool {
    let way = match light.kind {
        LightKind::Directional => -light.direction * 1e3,
        _ => light.position - point,
    };
    triangles.iter().all(|&[a, b, c]| {
        let (u, v) = (b - a, c - a);
        let normal = u.cross(v);
        let t = normal.dot(a - point) / normal.dot(way);
        let at = point + t * way - a;
        let weights = [at.cross(v).dot(normal), u.cross(at).dot(normal)].map(|w| w / normal.length_squared());
        let is_within = weights[0] >= 0.0 && weights[1] >= 0.0 && weights[0] + weights[1] <= 1.0;
        !(t > 1e-4 * way.length().recip() && t < 1.0 && is_within)
    })
}

/// Lambert under GGX, sr^-1.                                          [Walter2007; Heitz2014; glTF 2.0 B.3]
pub fn brdf(albedo: Vec4, specular: Vec4, normal: Vec3, alpha: f32, to_eye: Vec3, to_light: Vec3) -> Vec3 {
    let half = (to_eye + to_light).normalize();
    let (cos_eye, cos_light) = (normal.dot(to_eye).max(1e-6), normal.dot(to_light));
    let fresnel = specular.truncate().lerp(Vec3::splat(albedo.w), (1.0 - to_eye.dot(half)).powi(5));
    let a = alpha * alpha;
    let distribution = a / (PI * (normal.cross(half).length_squared() + a * normal.dot(half).powi(2)).powi(2));
    let root = |cosine: f32| (a + (1.0 - a) * cosine * cosine).sqrt();
    let shadowing = 0.5 / (cos_light * root(cos_eye) + cos_eye * root(cos_light));
    albedo.truncate() * (1.0 - fresnel.max_element()) / PI + fresnel * distribution * shadowing
}

/// Share of even light that a surface of the G-buffer sends to the eye.
pub fn even_albedo(albedo: Vec4, specular: Vec4, alpha: f32, cos_eye: f32) -> Vec3 {
    let (diffuse, f0) = (albedo.truncate().as_dvec3(), specular.truncate().as_dvec3());
    lobe::even_albedo(diffuse, f0, albedo.w.into(), alpha.into(), cos_eye.into()).as_vec3()
}

impl Case {
    /// The twin of one sample: adds `weight` of it to `film`.
    fn vertex(&self, surfaces: &Surfaces, offset: Vec2, weight: f32, film: &mut Pictures) {
        let world = world_vertices(&self.geometry, &self.pose);
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| world.positions[vertex as usize]);
        let triangles: Vec<[Vec3; 3]> = self.geometry.triangles.iter().map(corners).collect();
        let is_orthographic = matches!(self.view.lens, Lens::Orthographic { .. });
        for index in 0..(SIZE.x * SIZE.y) as usize {
            let pixel = Vec2::new((index as u32 % SIZE.x) as f32, (index as u32 / SIZE.x) as f32);
            let ray = self.view.ray(pixel + 0.5 + offset, SIZE);
            let seen = surfaces.triangle[index];
            film.is_background[index] |= seen == 0;
            if seen == 0 {
                film.direct[index] += weight * self.environment.radiance(ray.direction);
                continue;
            }
            let (position, n) = (surfaces.position[index], surfaces.normal[index]);
            let (albedo, specular, emission) =
                (surfaces.albedo[index], surfaces.specular[index], surfaces.emission[index]);
            let (point, normal, to_eye) = (position.truncate(), n.truncate(), -ray.direction);
            let (mut direct, mut indirect) = (emission.truncate(), Vec3::ZERO);
            if emission.w > 0.5 {
                let corners = self.geometry.triangles[seen as usize - 1].map(|vertex| vertex as usize);
                let [a, b, c] = corners.map(|vertex| world.positions[vertex]);
                let geometric = (b - a).cross(c - a);
                let is_back = geometric.dot(to_eye) < 0.0;
                let geometric = if is_back { -geometric } else { geometric };
                // A back has elements of its own, here one for every vertex.
                let first = if is_back { self.geometry.vertex_count() as usize } else { 0 };
                for light in &self.pose.lights {
                    let (irradiance, to_light) = arriving(light, point);
                    let is_before = normal.dot(to_light) > 0.0 && geometric.dot(to_light) > 0.0;
                    if is_before && is_free(light, point, &triangles) {
                        let value = brdf(albedo, specular, normal, n.w, to_eye, to_light);
                        direct += value * irradiance * normal.dot(to_light);
                    }
                }
                let weights = [1.0 - position.w - specular.w, position.w, specular.w];
                let blend = |values: &[Vec3]| -> Vec3 {
                    corners.iter().zip(weights).map(|(&v, w)| w * values[first + v]).sum()
                };
                let reflectance = even_albedo(albedo, specular, n.w, normal.dot(to_eye)) / PI;
                direct += reflectance * blend(&self.direct_irradiance);
                indirect = reflectance * blend(&self.indirect_irradiance);
            }
            let along = (point - self.view.position).dot(self.view.forward);
            let depth = if is_orthographic { along } else { point.distance(self.view.position) };
            film.direct[index] += weight * direct;
            film.indirect[index] += weight * indirect;
            film.albedo[index] += weight * albedo.truncate();
            film.normal[index] += weight * normal;
            film.depth[index] += weight * depth;
        }
    }

    /// The device's film of `samples` samples, and the twin's.
    fn draw(&self, context: &Context, samples: u32) -> (Pictures, Pictures) {
        self.draw_by(context, samples, false)
    }

    /// ... where doubts are settled by the device's own rays, if it has any.
    fn draw_by(&self, context: &Context, samples: u32, by_query: bool) -> (Pictures, Pictures) {
        let Self { scene, geometry, pose, environment, view, .. } = self;
        let world = World::new(context, scene, geometry, pose, environment, false).unwrap();
        let shadow_maps = ShadowMaps::new(context, pose, SIZE.to_array()).unwrap();
        let g_buffer = GBuffer::new(context, SIZE.x, SIZE.y).unwrap();
        let film = Film::new(context, SIZE.x, SIZE.y).unwrap();
        let vertices = world_vertices(geometry, pose);
        let bvh = Bvh::build(context, &vertices.positions, &geometry.triangles).unwrap();
        let structure = context.acceleration_structure("test/structure", &world.positions, &world.triangles).unwrap();
        let direct_irradiance = &context.upload("test/direct", &self.direct_irradiance).unwrap();
        let indirect_irradiance = &context.upload("test/indirect", &self.indirect_irradiance).unwrap();
        let count = geometry.vertex_count();
        let backs: Vec<u32> = (count..2 * count).collect();
        let back_elements = &context.upload("test/back elements", &backs).unwrap();
        let light = VertexLight { direct_irradiance, indirect_irradiance, back_elements, colors: None };
        let mut recorder = context.recorder("test").unwrap();
        if let Some(structure) = structure.as_ref() {
            recorder.build_acceleration_structure(structure, &world.positions, &world.triangles);
        }
        let (world, shadow_maps, g_buffer, film) = (&world, &shadow_maps, &g_buffer, &film);
        let by_query = structure.as_ref().filter(|_| by_query).map(|structure| Tracer::ray_query(structure, world));
        let tracer = by_query.unwrap_or(Tracer::compute(&bvh, world));
        shadow_maps.draw(&mut recorder, world, pose, vertices.bounds().unwrap());
        let lighting = Lighting { world, shadow_maps, tracer, g_buffer };
        vertex::draw(&mut recorder, light, Canvas { lighting, view, samples, film });
        recorder.submit().unwrap();
        let got = Pictures {
            direct: context.download(&film.direct).unwrap(),
            indirect: context.download(&film.indirect).unwrap(),
            albedo: context.download(&film.albedo).unwrap(),
            normal: context.download(&film.normal).unwrap(),
            depth: context.download(&film.depth).unwrap(),
            is_background: Vec::new(),
        };
        let pixels = (SIZE.x * SIZE.y) as usize;
        let dark = vec![Vec3::ZERO; pixels];
        let mut expected = Pictures {
            direct: dark.clone(),
            indirect: dark.clone(),
            albedo: dark.clone(),
            normal: dark,
            depth: vec![0.0; pixels],
            is_background: vec![false; pixels],
        };
        for sample in 0..samples {
            let offset = sample_offset(sample, samples);
            let mut recorder = context.recorder("test").unwrap();
            g_buffer.draw(&mut recorder, world, &PixelView::new(view, SIZE, sample, samples));
            recorder.submit().unwrap();
            self.vertex(&Surfaces::of(context, g_buffer), offset, 1.0 / samples as f32, &mut expected);
        }
        (got, expected)
    }
}

/// Values at the pixels that do, or do not, show some background.
fn where_background<T: Copy>(values: &[T], pictures: &Pictures, wanted: bool) -> Vec<T> {
    let kept = values.iter().zip(&pictures.is_background).filter(|(_, is)| **is == wanted);
    kept.map(|(value, _)| *value).collect()
}

#[test]
fn vertex_agrees_with_its_twin() {
    let context = TestContext::new();
    let lenses = [
        ("perspective", Lens::Perspective { tan_half: Vec2::new(0.75, 0.53) }),
        ("orthographic", Lens::Orthographic { half_extent: Vec2::new(2.6, 1.8) }),
    ];
    for (name, lens) in lenses {
        let mut case = case(lens);
        for samples in [1, 3] {
            let what = |of: &str| format!("{name}, {samples} samples, {of}");
            let (got, expected) = case.draw(&context, samples);
            for (background, tolerance) in [(false, RADIANCE), (true, BACKGROUND)] {
                let pick = |values: &[Vec3]| where_background(values, &expected, background);
                assert!(pick(&expected.direct).len() > 200, "both kinds of pixel are there");
                hold(&what("direct"), &pick(&got.direct), &pick(&expected.direct), tolerance);
            }
            hold(&what("indirect"), &got.indirect, &expected.indirect, RADIANCE);
            hold(&what("albedo"), &got.albedo, &expected.albedo, RADIANCE);
            hold(&what("normal"), &got.normal, &expected.normal, RADIANCE);
            hold(&what("depth"), &got.depth, &expected.depth, RADIANCE);
        }

        // A twin that leaves something out is told apart.
        let (_, expected) = case.draw(&context, 1);
        let lights = std::mem::take(&mut case.pose.lights);
        for left_out in 0..lights.len() {
            case.pose.lights = lights.clone();
            case.pose.lights.remove(left_out);
            let (_, wrong) = case.draw(&context, 1);
            tells_apart(&format!("{name}: light {left_out} left out"), &wrong.direct, &expected.direct, RADIANCE);
        }
        case.pose.lights = lights;
        std::mem::swap(&mut case.direct_irradiance, &mut case.indirect_irradiance);
        let (_, wrong) = case.draw(&context, 1);
        tells_apart(&format!("{name}: irradiances exchanged"), &wrong.indirect, &expected.indirect, RADIANCE);
        case.environment = Environment::Constant(Vec3::splat(0.5));
        let (_, wrong) = case.draw(&context, 1);
        tells_apart(&format!("{name}: another background"), &wrong.direct, &expected.direct, BACKGROUND);
    }
}

/// Gratings, a leaning fin that the sun grazes, and waves of a smooth mesh: maps of a few texels a bar can tell their
/// shadows nowhere near the borders, and every pixel must have what rays find.
#[test]
fn shadows_are_those_of_rays() {
    let context = TestContext::new();
    let mut case = case(Lens::Perspective { tan_half: Vec2::new(0.75, 0.53) });
    let mut parts: Vec<Primitive> = Vec::new();
    for bar in 0..12 {
        let x = -1.9 + 0.32 * bar as f32;
        parts.push(parallelogram(Vec3::new(x, 0.9, 1.5), Vec3::X * 0.11, Vec3::new(0.3, 0.2, -3.0), 1, 0));
    }
    // The sun comes along the fin but for three degrees.
    let sun = case.pose.lights.iter().find(|light| light.kind == LightKind::Directional).unwrap().direction;
    let along = Vec3::new(sun.z, 0.0, -sun.x).normalize();
    let leaning = sun.cross(along).normalize() * 0.05 - sun.normalize();
    parts.push(parallelogram(Vec3::new(-1.6, 0.0, -0.6), along * 1.5, leaning * 0.8, 1, 0));
    let mut waves = parallelogram(Vec3::new(-1.2, 0.25, 1.8), Vec3::X * 2.6, Vec3::NEG_Z * 1.2, 24, 0);
    for (position, normal) in waves.positions.iter_mut().zip(&mut waves.normals) {
        *normal = Vec3::new(-0.9 * (9.0 * position.x).cos(), 1.0, 0.0).normalize();
        position.y += 0.1 * (9.0 * position.x).sin();
    }
    parts.push(waves);
    for part in parts {
        case.scene.nodes.push(Node { mesh: Some(case.scene.meshes.len() as u32), ..Node::default() });
        case.scene.meshes.extend(scene(vec![], vec![part], &[]).meshes);
    }
    case.geometry = Geometry::flatten(&case.scene, 1 << 30).unwrap();
    case.pose = Pose::rest(&case.scene);
    case.direct_irradiance = vec![Vec3::ZERO; 2 * case.geometry.vertex_count() as usize];
    case.indirect_irradiance = case.direct_irradiance.clone();
    for by_query in [false, true] {
        let (got, expected) = case.draw_by(&context, 1, by_query);
        let is_off = |(got, expected): &(&Vec3, &Vec3)| got.distance(**expected) > 1e-3 * (1.0 + expected.length());
        let wrong = got.direct.iter().zip(&expected.direct).filter(is_off).count();
        let dark = expected.direct.iter().filter(|direct| direct.max_element() < 0.02).count();
        println!("ray query {by_query}: {wrong} of {} pixels are wrong, {dark} are dark", got.direct.len());
        // A ray may pass an edge on either side by rounding.
        assert!(wrong <= 3 && dark > 100, "{wrong} wrong, {dark} dark");
    }
}
