//! Every kind of light against its closed form on a Lambertian plane.

use crate::made;
use crate::render::{Rendered, Set, looking_down, mean, options};
use glam::{DVec3, Quat, UVec2, Vec2, Vec3, Vec4, vec3};
use linklight::methods::path_tracing::LightSampling;
use linklight::scene::environment::{Environment, EnvironmentMap};
use linklight::scene::{Light, LightKind, Node, Scene, Transform};
use std::f32::consts::PI;

const ALBEDO: Vec3 = Vec3::new(0.8, 0.5, 0.25);
const INTENSITY: Vec3 = Vec3::new(3.0, 2.0, 1.0);
const SIZE: u32 = 24;

/// The unit square in z = 0 facing +Z, Lambertian.
fn plane() -> Scene {
    let mut scene = made::scene_of(made::square());
    scene.materials[0].base_color = ALBEDO.extend(1.0);
    scene
}

/// The plane under a light that stands at `translation` and shines along -Z turned by `rotation`.
fn under_light(kind: LightKind, range: Option<f32>, translation: Vec3, rotation: Quat) -> Rendered {
    let mut scene = plane();
    scene.lights.push(Light { name: "light".into(), kind, intensity: INTENSITY, range });
    scene.nodes.push(Node {
        transform: Transform::Trs { translation, rotation, scale: Vec3::ONE },
        light: Some(0),
        ..Default::default()
    });
    let set = Set::new(scene, &Environment::default(), true);
    set.render(&looking_down(Vec2::splat(0.5), 0.5, 3.0), options(SIZE, 0), 64)
}

/// Compares every pixel with a function of the place it shows, averaged over the pixel; within 0.2 % of it and 0.05 %
/// of the brightest, since samples inside a pixel are few where light fades out.
fn expect(rendered: &Rendered, radiance: impl Fn(Vec3) -> Vec3) {
    let brightest = rendered.direct.iter().fold(0.0f32, |most, value| most.max(value.max_element()));
    for (pixel, found) in rendered.radiance().into_iter().enumerate() {
        let corner = Vec2::new((pixel as u32 % SIZE) as f32, (pixel as u32 / SIZE) as f32);
        let mut expected = Vec3::ZERO;
        for part in 0..64 {
            let at = (corner + (Vec2::new((part % 8) as f32, (part / 8) as f32) + 0.5) / 8.0) / SIZE as f32;
            expected += radiance(vec3(at.x, 1.0 - at.y, 0.0)) / 64.0;
        }
        let error = (found - expected).abs().max_element();
        assert!(error <= 2e-3 * expected.max_element() + 5e-4 * brightest, "pixel {pixel}: {found} for {expected}");
    }
}

const LAMP: Vec3 = Vec3::new(0.3, 0.6, 0.8);

/// rho / pi I cos / r^2.
fn of_point_light(place: Vec3) -> Vec3 {
    let offset = LAMP - place;
    ALBEDO / PI * INTENSITY * offset.z / offset.length().powi(3)
}

#[test]
fn a_point_light_falls_off_by_the_square() {
    expect(&under_light(LightKind::Point, None, LAMP, Quat::IDENTITY), of_point_light);
}

#[test]
fn a_range_cuts_a_point_light_off_smoothly() {
    let rendered = under_light(LightKind::Point, Some(1.1), LAMP, Quat::IDENTITY);
    expect(&rendered, |place| {
        let ratio = (LAMP - place).length() / 1.1;
        of_point_light(place) * (1.0 - ratio.powi(4)).clamp(0.0, 1.0)
    });
    assert!(rendered.direct.contains(&Vec3::ZERO), "some of the plane is out of range");
}

#[test]
fn a_spot_light_fades_between_its_cones() {
    let (inner_angle, outer_angle) = (0.3f32, 0.7f32);
    let rendered = under_light(LightKind::Spot { inner_angle, outer_angle }, None, LAMP, Quat::IDENTITY);
    expect(&rendered, |place| {
        let cosine = (LAMP - place).normalize().z;
        let scale = 1.0 / (inner_angle.cos() - outer_angle.cos());
        let cone = ((cosine - outer_angle.cos()) * scale).clamp(0.0, 1.0);
        of_point_light(place) * cone * cone
    });
}

#[test]
fn a_directional_light_is_the_same_everywhere() {
    let angle = 0.7f32;
    let rendered = under_light(LightKind::Directional, None, Vec3::ZERO, Quat::from_rotation_x(angle));
    let expected = ALBEDO / PI * INTENSITY * angle.cos();
    assert!(rendered.direct.iter().all(|found| (found - expected).abs().max_element() < 1e-6));
    // From below, nothing.
    let below = under_light(LightKind::Directional, None, Vec3::ZERO, Quat::from_rotation_x(PI - angle));
    assert!(below.direct.iter().all(|&found| found == Vec3::ZERO));
}

/// Many lights: one is asked at a time, the mean is that of all.
#[test]
fn many_lights_add_up() {
    let mut scene = plane();
    let places: Vec<Vec3> = (0..9).map(|k| vec3(0.25 * (k % 3) as f32, 0.4 * (k / 3) as f32, 1.0)).collect();
    for (k, &translation) in places.iter().enumerate() {
        let intensity = INTENSITY * (1.0 + k as f32);
        scene.lights.push(Light { name: String::new(), kind: LightKind::Point, intensity, range: None });
        let transform = Transform::Trs { translation, rotation: Quat::IDENTITY, scale: Vec3::ONE };
        scene.nodes.push(Node { transform, light: Some(k as u32), ..Default::default() });
    }
    let set = Set::new(scene, &Environment::default(), true);
    let rendered = set.render(&looking_down(Vec2::splat(0.5), 0.5, 3.0), options(SIZE, 0), 256);
    let mut expected = DVec3::ZERO;
    for step in 0..200 * 200 {
        let place = vec3((step % 200) as f32 + 0.5, (step / 200) as f32 + 0.5, 0.0) / 200.0;
        for (k, lamp) in places.iter().enumerate() {
            let offset = lamp - place;
            let radiance = ALBEDO / PI * INTENSITY * (1.0 + k as f32) * offset.z / offset.length().powi(3);
            expected += radiance.as_dvec3() / 4e4;
        }
    }
    let (found, expected) = (mean(&rendered.direct), expected.as_vec3());
    assert!((found / expected - 1.0).abs().max_element() < 2e-3, "{found} for {expected}");
}

/// L = rho L_env.
#[test]
fn a_uniform_environment_reflects_by_the_albedo() {
    let radiance = vec3(1.0, 2.0, 0.5);
    let set = Set::new(plane(), &Environment::Constant(radiance), true);
    for light_sampling in [LightSampling::Reflection, LightSampling::Both, LightSampling::Lights] {
        let mut options = options(SIZE, 0);
        options.settings.light_sampling = light_sampling;
        let rendered = set.render(&looking_down(Vec2::splat(0.5), 0.5, 3.0), options, 256);
        let ratio = mean(&rendered.direct) / (ALBEDO * radiance);
        let tolerance = if light_sampling == LightSampling::Reflection { 1e-5 } else { 2e-3 };
        assert!((ratio - 1.0).abs().max_element() < tolerance, "{light_sampling:?}: {ratio}");
    }
    // Seen itself, it is what it is.
    let beside = set.render(&looking_down(Vec2::splat(5.0), 0.5, 3.0), options(SIZE, 2), 4);
    assert!(beside.direct.iter().all(|&found| found == radiance));
    assert!(beside.depth.iter().all(|&depth| depth == 0.0));
}

/// A map with a small, strong sun: E = integral of L cos over the upper half.
#[test]
fn an_environment_map_is_drawn_by_importance() {
    let (width, height) = (64u32, 32u32);
    let sun = |x: u32, y: u32| (x, y) == (20, 9);
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        if sun(x, y) { vec3(900.0, 800.0, 600.0) } else { vec3(0.2, 0.3, 0.1 + 0.01 * y as f32) }
    };
    let texels = (0..width * height).map(texel).collect();
    let environment = Environment::Map(EnvironmentMap { width, height, texels, rotation: 0.4 });
    let mut scene = plane();
    // Up is +Y for the map: the plane lies down.
    scene.nodes[0].transform =
        Transform::Trs { translation: Vec3::ZERO, rotation: Quat::from_rotation_x(-PI / 2.0), scale: Vec3::ONE };
    let set = Set::new(scene, &environment, true);
    let view = crate::render::view_along(vec3(0.5, 3.0, -0.5), Vec3::NEG_Y, Vec3::NEG_Z, 0.5);
    let mut irradiance = DVec3::ZERO;
    let steps = 1500;
    for k in 0..steps * steps {
        // Equal solid angles.
        let y = (f64::from(k / steps) + 0.5) / f64::from(steps);
        let phi = std::f64::consts::TAU * (f64::from(k % steps) + 0.5) / f64::from(steps);
        let sine = (1.0 - y * y).sqrt();
        let direction = DVec3::new(sine * phi.cos(), y, sine * phi.sin()).as_vec3();
        irradiance += environment.radiance(direction).as_dvec3() * y;
    }
    let irradiance = irradiance * (std::f64::consts::TAU / f64::from(steps * steps));
    let expected = ALBEDO / PI * irradiance.as_vec3();
    for light_sampling in [LightSampling::Both, LightSampling::Lights] {
        let mut options = options(SIZE, 0);
        options.settings.light_sampling = light_sampling;
        let rendered = set.render(&view, options, 64);
        let ratio = mean(&rendered.direct) / expected;
        println!("{light_sampling:?}: {ratio}, {:?}", rendered.estimate);
        assert!((ratio - 1.0).abs().max_element() < 3e-3, "{light_sampling:?}: {ratio}");
        assert!(rendered.estimate.unwrap().relative_pixel_error < 0.3, "importance must find the sun");
    }
}

/// An emitter over the plane: the closed form of parallel squares; from behind it sends nothing unless it is
/// double-sided.
#[test]
fn emitters_send_from_their_front() {
    let with_emitter = |facing_down: bool, double_sided: bool| {
        let mut scene = plane();
        scene.materials[0].base_color = Vec4::ONE;
        let mut square = made::square();
        square.material = 1;
        square.positions.iter_mut().for_each(|position| position.z = 1.0);
        if facing_down {
            square.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            square.normals = vec![Vec3::NEG_Z; 4];
        }
        scene.meshes[0].primitives.push(square);
        let emission = Vec3::splat(1.0 / PI);
        let base_color = Vec4::new(0.0, 0.0, 0.0, 1.0);
        scene.materials.push(linklight::scene::Material { emission, base_color, double_sided, ..made::material() });
        let set = Set::new(scene, &Environment::default(), true);
        set.render(&looking_down(Vec2::splat(0.5), 0.5, 0.5), options(SIZE, 0), 128)
    };
    for (facing_down, double_sided) in [(true, false), (true, true), (false, true)] {
        let found = PI * mean(&with_emitter(facing_down, double_sided).direct);
        assert!((found - 0.199_825).abs().max_element() < 1e-3, "{facing_down} {double_sided}: {found}");
    }
    assert!(with_emitter(false, false).direct.iter().all(|&found| found == Vec3::ZERO));
}

/// Reading the whole set at once needs a square picture.
#[test]
fn pictures_need_not_be_square() {
    let set = Set::new(plane(), &Environment::Constant(Vec3::ONE), true);
    let mut options = options(8, 0);
    options.height = 3;
    let view = set.view(None, UVec2::new(8, 3));
    assert_eq!(set.render(&view, options, 1).direct.len(), 24);
}
