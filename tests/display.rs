//! The display stages against closed forms: punctual light per pixel, shadows, interpolated irradiance, coverage.

mod common;

use common::TestContext;
use common::scenes::{lambert, light, nearest_texture, parallelogram, scene};
use glam::{UVec2, Vec2, Vec3, Vec4};
use linklight::display::direct::{Canvas, Lighting};
use linklight::display::g_buffer::GBuffer;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::display::vertex::{self, VertexLight};
use linklight::gpu::{Context, Options};
use linklight::scene::camera::{Lens, View};
use linklight::scene::deform::world_vertices;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{Image, LightKind, Material, Node, Scene, TextureRef};
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::trace::Tracer;
use linklight::stages::world::World;
use std::f32::consts::PI;

const SIZE: u32 = 64;

/// Looks at the origin from `eye`.
fn view(eye: Vec3, up: Vec3, tan_half: f32) -> View {
    let forward = (-eye).normalize();
    let right = forward.cross(up).normalize();
    let lens = Lens::Perspective { tan_half: Vec2::splat(tan_half) };
    View { position: eye, right, up: right.cross(forward), forward, lens, near: 0.01, far: None }
}

struct Shown {
    direct: Vec<Vec3>,
    indirect: Vec<Vec3>,
    albedo: Vec<Vec3>,
    normal: Vec<Vec3>,
    depth: Vec<f32>,
}

/// Shows `scene` with given irradiance at its vertices.
fn show(context: &Context, scene: &Scene, view: &View, samples: u32, direct: f32, indirect: f32) -> Shown {
    let geometry = Geometry::flatten(scene, 1 << 30).unwrap();
    let pose = Pose::rest(scene);
    let world = World::new(context, scene, &geometry, &pose, &Environment::Constant(Vec3::splat(0.25)), false).unwrap();
    let vertices = world_vertices(&geometry, &pose);
    let bvh = Bvh::build(context, &vertices.positions, &geometry.triangles).unwrap();
    let shadow_maps = ShadowMaps::new(context, &pose, [SIZE, SIZE]).unwrap();
    let g_buffer = GBuffer::new(context, SIZE, SIZE).unwrap();
    let film = Film::new(context, SIZE, SIZE).unwrap();
    let irradiance =
        |value: f32| context.upload("test/irradiance", &vec![Vec3::splat(value); world.vertex_count as usize]).unwrap();
    let (direct_irradiance, indirect_irradiance) = (irradiance(direct), irradiance(indirect));
    let back_elements = context.upload("test/back elements", &vec![u32::MAX; world.vertex_count as usize]).unwrap();
    let light = VertexLight {
        direct_irradiance: &direct_irradiance,
        indirect_irradiance: &indirect_irradiance,
        back_elements: &back_elements,
        colors: None,
    };
    let mut recorder = context.recorder("frame").unwrap();
    shadow_maps.draw(&mut recorder, &world, &pose, vertices.bounds().unwrap());
    let tracer = Tracer::compute(&bvh, &world);
    let (world, shadow_maps, g_buffer, film) = (&world, &shadow_maps, &g_buffer, &film);
    let lighting = Lighting { world, shadow_maps, tracer, g_buffer };
    vertex::draw(&mut recorder, light, Canvas { lighting, view, samples, film });
    recorder.submit().unwrap();
    Shown {
        direct: context.download(&film.direct).unwrap(),
        indirect: context.download(&film.indirect).unwrap(),
        albedo: context.download(&film.albedo).unwrap(),
        normal: context.download(&film.normal).unwrap(),
        depth: context.download(&film.depth).unwrap(),
    }
}

fn floor(albedo: f32, half: f32, cells: u32) -> Scene {
    let corner = Vec3::new(-half, 0.0, half);
    let plane = parallelogram(corner, Vec3::X * 2.0 * half, Vec3::NEG_Z * 2.0 * half, cells, 0);
    scene(vec![lambert(Vec3::splat(albedo))], vec![plane], &[])
}

fn with_light(mut base: Scene, kind: LightKind, intensity: f32, position: Vec3, direction: Vec3) -> Scene {
    let lit = scene(vec![], vec![], &[(light(kind, intensity), position, direction)]);
    base.nodes.extend(lit.nodes);
    base.lights = lit.lights;
    base
}

fn close(value: f32, expected: f32, relative: f32) -> bool {
    (value - expected).abs() <= relative * expected.abs()
}

#[test]
fn a_point_light_on_a_plane_follows_the_closed_form() {
    let context = TestContext::new();
    let eye = Vec3::new(0.0, 3.0, 0.0);
    let view = view(eye, Vec3::NEG_Z, 0.5);
    let position = Vec3::new(0.3, 2.0, -0.2);
    let scene = with_light(floor(0.6, 4.0, 4), LightKind::Point, 5.0, position, Vec3::NEG_Y);
    let shown = show(&context, &scene, &view, 1, 0.0, 0.0);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let ray = view.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), UVec2::splat(SIZE));
            let t = -ray.origin.y / ray.direction.y;
            let point = ray.origin + t * ray.direction;
            let offset = position - point;
            // rho / pi * I cos / r^2
            let expected = 0.6 / PI * 5.0 * (offset.y / offset.length()) / offset.length_squared();
            let i = (y * SIZE + x) as usize;
            assert!(close(shown.direct[i].x, expected, 1e-4), "pixel {x}, {y}: {} for {expected}", shown.direct[i].x);
            assert!(close(shown.depth[i], t, 1e-4), "pixel {x}, {y}: depth {} for {t}", shown.depth[i]);
            assert!(shown.indirect[i] == Vec3::ZERO && close(shown.albedo[i].x, 0.6, 1e-6));
            assert!(shown.normal[i].distance(Vec3::Y) < 1e-5);
        }
    }
}

#[test]
fn spot_and_directional_lights_follow_their_closed_forms() {
    let context = TestContext::new();
    let view = view(Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Z, 0.2);
    let centre = ((SIZE / 2) * SIZE + SIZE / 2) as usize;
    let sun = with_light(floor(0.5, 4.0, 1), LightKind::Directional, 2.0, Vec3::Y, Vec3::new(0.0, -1.0, -1.0));
    let shown = show(&context, &sun, &view, 1, 0.0, 0.0);
    let expected = 0.5 / PI * 2.0 * std::f32::consts::FRAC_1_SQRT_2;
    assert!(shown.direct.iter().all(|d| close(d.x, expected, 1e-4)), "{} for {expected}", shown.direct[centre].x);

    let kind = LightKind::Spot { inner_angle: 0.1, outer_angle: 0.2 };
    let spot = with_light(floor(0.5, 4.0, 1), kind, 8.0, Vec3::new(0.0, 2.0, 0.0), Vec3::NEG_Y);
    let shown = show(&context, &spot, &view, 1, 0.0, 0.0);
    let expected = 0.5 / PI * 8.0 / 4.0;
    assert!(close(shown.direct[centre].x, expected, 1e-3), "{} for {expected}", shown.direct[centre].x);
    assert_eq!(shown.direct[0], Vec3::ZERO, "beyond the outer angle it is dark");
}

#[test]
fn an_occluder_shades_exactly_what_it_hides() {
    let context = TestContext::new();
    let view = view(Vec3::new(0.0, 3.0, 1e-3), Vec3::NEG_Z, 0.4);
    for (kind, direction) in [
        (LightKind::Point, Vec3::NEG_Y),
        (LightKind::Directional, Vec3::NEG_Y),
        (LightKind::Spot { inner_angle: 0.9, outer_angle: 1.0 }, Vec3::NEG_Y),
    ] {
        // A square of side 0.4 at height 1.5, under the light at height 2, above the camera's sight.
        let mut base = floor(0.5, 4.0, 1);
        let hider =
            scene(vec![], vec![parallelogram(Vec3::new(-0.2, 1.5, 0.2), Vec3::X * 0.4, Vec3::NEG_Z * 0.4, 1, 0)], &[]);
        base.nodes.push(linklight::scene::Node { mesh: Some(base.meshes.len() as u32), ..Default::default() });
        base.meshes.extend(hider.meshes);
        let hidden = with_light(base, kind, 5.0, Vec3::new(0.0, 2.0, 0.0), direction);
        let shown = show(&context, &hidden, &view, 1, 0.0, 0.0);
        // On the floor the shadow reaches 0.2 * 2 / 0.5 = 0.8 m from a light at height 2, 0.2 m from the sun.
        let reach = if kind == LightKind::Directional { 0.2 } else { 0.8 };
        for y in 0..SIZE {
            for x in 0..SIZE {
                let i = (y * SIZE + x) as usize;
                if shown.depth[i] < 2.5 {
                    continue; // the occluder itself
                }
                let ray = view.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), UVec2::splat(SIZE));
                let point = ray.origin - ray.origin.y / ray.direction.y * ray.direction;
                let edge = point.x.abs().max(point.z.abs()) - reach;
                if edge < -0.03 {
                    assert_eq!(shown.direct[i], Vec3::ZERO, "{kind:?} pixel {x}, {y} at {point} is in shadow");
                } else if edge > 0.03 {
                    assert!(shown.direct[i].x > 0.0, "{kind:?} pixel {x}, {y} at {point} is lit");
                }
            }
        }
    }
}

/// A normal map raises nothing: behind a fin, the shadow on a floor with one begins at the fin.
#[test]
fn a_normal_map_lets_no_sun_through() {
    let context = TestContext::new();
    let mut base = floor(0.5, 20.0, 1);
    // Leans by the arc cosine of 0.6, as far towards the sun as the floor itself.
    let rgba = vec![128, 230, 204, 255];
    base.images = vec![Image { name: "lean".into(), width: 1, height: 1, rgba, srgb: false }];
    base.textures = vec![nearest_texture(0)];
    let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    base.materials[0].normal_texture = Some(TextureRef { texture: 0, uv_set: 0, transform });
    let fin = parallelogram(Vec3::new(-0.5, 0.0, 2.0), Vec3::NEG_Z * 4.0, Vec3::Y, 1, 0);
    base.nodes.push(Node { mesh: Some(base.meshes.len() as u32), ..Node::default() });
    base.meshes.extend(scene(vec![], vec![fin], &[]).meshes);
    let sunny = with_light(base, LightKind::Directional, 2.0, Vec3::Y, Vec3::new(1.0, -1.0, 0.0).normalize());
    // All that is seen lies in the fin's shadow, which is a metre wide.
    let shown = show(&context, &sunny, &view(Vec3::new(0.0, 3.0, 1e-3), Vec3::NEG_Z, 0.127), 1, 0.0, 0.0);
    let lit = shown.direct.iter().filter(|direct| **direct != Vec3::ZERO).count();
    println!("{lit} of {} pixels in shadow are lit", shown.direct.len());
    assert!(shown.normal.iter().all(|normal| normal.y < 0.7), "the map leans: {}", shown.normal[0]);
    assert_eq!(lit, 0);
    // Beyond the shadow there is sun.
    let shown = show(&context, &sunny, &view(Vec3::new(0.0, 9.0, 1e-3), Vec3::NEG_Z, 0.4), 1, 0.0, 0.0);
    assert!(shown.direct.iter().any(|direct| direct.x > 0.1));
}

/// Half of the square is cut out by its texture, half stands: at x < 0. The sun throws its shadow 0.7 m aside, out from
/// under it.
#[test]
fn a_mask_shades_where_it_is_not_cut_out() {
    let context = TestContext::new();
    let view = view(Vec3::new(0.0, 3.0, 1e-3), Vec3::NEG_Z, 0.4);
    for (kind, direction, reach, shift) in [
        (LightKind::Point, Vec3::NEG_Y, 0.8, 0.0),
        (LightKind::Directional, Vec3::new(0.7, -1.5, 0.0).normalize(), 0.2, 0.7),
    ] {
        let mut base = floor(0.5, 4.0, 1);
        let mut square = parallelogram(Vec3::new(-0.2, 1.5, 0.2), Vec3::X * 0.4, Vec3::NEG_Z * 0.4, 1, 1);
        // What is multiplied to 0.72 and 0.36 lies on one side of the cutoff where a factor is missed.
        square.colors = vec![Vec4::new(1.0, 1.0, 1.0, 0.8); square.positions.len()];
        square.uv[1] = square.uv[0].iter().map(|uv| Vec2::new(1.0 - uv.x, uv.y)).collect();
        let rgba = vec![255, 255, 255, 255, 255, 255, 255, 128];
        base.images = vec![Image { name: "half".into(), width: 2, height: 1, rgba, srgb: false }];
        base.textures = vec![nearest_texture(0)];
        let base_color_texture =
            Some(TextureRef { texture: 0, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] });
        let mut mask = Material { base_color_texture, alpha_cutoff: Some(0.5), ..lambert(Vec3::splat(0.2)) };
        mask.base_color.w = 0.9;
        base.materials.push(mask);
        base.nodes.push(Node { mesh: Some(base.meshes.len() as u32), ..Node::default() });
        base.meshes.extend(scene(vec![], vec![square], &[]).meshes);
        let hidden = with_light(base, kind, 5.0, Vec3::new(0.0, 2.0, 0.0), direction);
        let shown = show(&context, &hidden, &view, 1, 0.0, 0.0);
        let mut counts = [0; 2];
        for (i, direct) in shown.direct.iter().enumerate().filter(|(i, _)| shown.depth[*i] > 2.5) {
            let pixel = Vec2::new((i as u32 % SIZE) as f32, (i as u32 / SIZE) as f32);
            let ray = view.ray(pixel + 0.5, UVec2::splat(SIZE));
            let point = ray.origin - ray.origin.y / ray.direction.y * ray.direction;
            let x = point.x - shift;
            let edge = (x.abs().max(point.z.abs()) - reach).max(x);
            if edge.abs() > 0.03 {
                assert_eq!(*direct == Vec3::ZERO, edge < 0.0, "{kind:?} at {point}: {direct}");
                counts[usize::from(edge < 0.0)] += 1;
            }
        }
        assert!(counts.iter().all(|count| *count > 10), "{kind:?}: pixels lit and in shadow {counts:?}");
    }
}

#[test]
fn irradiance_and_background_are_shown_as_they_are() {
    let context = TestContext::new();
    let view = view(Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Z, 1.0);
    let shown = show(&context, &floor(0.5, 1.0, 3), &view, 4, PI, 2.0 * PI);
    let (centre, corner) = (((SIZE / 2) * SIZE + SIZE / 2) as usize, 0);
    // L = rho E / pi, direct and indirect apart; the environment fills the rest.
    assert!(close(shown.direct[centre].x, 0.5, 1e-4), "{}", shown.direct[centre]);
    assert!(close(shown.indirect[centre].x, 1.0, 1e-4), "{}", shown.indirect[centre]);
    assert!(
        close(shown.direct[corner].x, 0.25, 1e-5) && shown.indirect[corner] == Vec3::ZERO && shown.depth[corner] == 0.0
    );
    // The plane covers a third of the width: its share of the pixels, antialiased.
    let covered: f32 = shown.albedo.iter().map(|a| a.x / 0.5).sum::<f32>() / (SIZE * SIZE) as f32;
    assert!(close(covered, 1.0 / 9.0, 0.02), "{covered}");
}

#[test]
fn the_picture_does_not_depend_on_barriers_or_optional_features() {
    let scene = with_light(floor(0.5, 1.0, 3), LightKind::Point, 5.0, Vec3::new(0.3, 2.0, 0.0), Vec3::NEG_Y);
    let view = view(Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Z, 1.0);
    let picture = |options: Options| {
        let context = TestContext::with(options);
        let shown = show(&context, &scene, &view, 2, 1.0, 1.0);
        shown.direct.iter().chain(&shown.indirect).flat_map(|v| v.to_array().map(f32::to_bits)).collect::<Vec<_>>()
    };
    let plain = picture(Options::default());
    assert!(plain == picture(Options::default()), "twice the same bits");
    assert!(plain == picture(Options { full_barriers: true, ..Options::default() }), "a hazard is missed");
    assert!(plain == picture(Options { no_optional_features: true, ..Options::default() }));
}
