//! Rays and projection agree; cameras are found; framing holds the bounds.

use glam::{Mat4, Quat, UVec2, Vec2, Vec3, uvec2, vec2};
use linklight::scene::camera::{CameraError, Lens, View};
use linklight::scene::pose::{Pose, PosedCamera};
use linklight::scene::{Camera, Node, Projection, Scene, Transform};
use proptest::prelude::*;

use crate::made::assert_near;

const SIZE: UVec2 = uvec2(640, 360);

fn posed(world_from_camera: Mat4, projection: Projection) -> PosedCamera {
    PosedCamera { node: 0, camera: 0, world_from_camera, projection }
}

fn projections() -> impl Strategy<Value = Projection> {
    let far = prop_oneof![Just(None), (100.0f32..1000.0).prop_map(Some)];
    let perspective = (0.2f32..2.5, 0.01f32..1.0, far);
    prop_oneof![
        perspective.prop_map(|(fov_y, near, far)| Projection::Perspective { fov_y, near, far }),
        (0.5f32..9.0, 0.5f32..9.0).prop_map(|(half_width, half_height)| Projection::Orthographic {
            half_width,
            half_height,
            near: 0.5,
            far: 500.0,
        }),
    ]
}

proptest! {
    #[test]
    fn points_of_a_ray_project_to_its_pixel(
        projection in projections(),
        pixel in (0.0f32..640.0, 0.0f32..360.0),
        angles in prop::array::uniform3(-3.0f32..3.0),
        t in 0.01f32..1.0,
    ) {
        let turn = Quat::from_euler(glam::EulerRot::YXZ, angles[0], angles[1], angles[2]);
        // Scale and mirroring of a camera node are ignored.
        let world = Mat4::from_scale_rotation_translation(Vec3::new(2.0, 2.0, -2.0), turn, Vec3::new(3.0, -1.0, 2.0));
        let view = View::of_camera(&posed(world, projection), SIZE);
        let ray = view.ray(pixel.into(), SIZE);
        prop_assert!((ray.direction.length() - 1.0).abs() < 1e-5);
        let point = ray.origin + ray.direction * (ray.t_min + t * 50.0);
        let (seen, depth) = view.project(point, SIZE).unwrap();
        prop_assert!((seen - Vec2::from(pixel)).length() < 0.02, "{seen} for {pixel:?}");
        prop_assert!((0.0..=1.0).contains(&depth), "{depth}");
        let near = view.project(ray.origin + ray.direction * ray.t_min, SIZE).unwrap().1;
        prop_assert!((near - 1.0).abs() < 1e-3, "near depth {near}");
        if ray.t_max.is_finite() {
            let far = view.project(ray.origin + ray.direction * ray.t_max, SIZE).unwrap().1;
            prop_assert!(far.abs() < 1e-3, "far depth {far}");
        }
        prop_assert!((view.right.cross(view.up) + view.forward).length() < 1e-5);
    }

    #[test]
    fn a_framed_view_holds_the_bounds_and_fills_the_picture(
        low in prop::array::uniform3(-50.0f32..50.0),
        extent in prop::array::uniform3(0.0f32..20.0),
        size in (16u32..2000, 16u32..2000),
    ) {
        let (low, size) = (Vec3::from(low), uvec2(size.0, size.1));
        let high = low + Vec3::from(extent) + 0.01;
        let view = View::framed([low, high], size);
        let mut reach = 0.0f32;
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 1 { high[axis] } else { low[axis] };
            let (pixel, depth) = view.project(Vec3::new(pick(0), pick(1), pick(2)), size).unwrap();
            let device = (pixel / size.as_vec2() * 2.0 - 1.0).abs().max_element();
            prop_assert!(device <= 1.0 && depth > 0.0 && depth < 1.0, "corner at {device}, depth {depth}");
            reach = reach.max(device);
        }
        prop_assert!(reach > 0.6, "the bounds fill only {reach} of the picture");
    }
}

#[test]
fn y_points_down_and_near_is_one() {
    let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None };
    let view = View::of_camera(&posed(Mat4::IDENTITY, projection), SIZE);
    let (above, near) = view.project(Vec3::new(0.0, 0.1, -1.0), SIZE).unwrap();
    let (right, far) = view.project(Vec3::new(0.1, 0.0, -10.0), SIZE).unwrap();
    assert!(above.y < 180.0 && right.x > 320.0 && near > far && far > 0.0);
    assert!(view.project(Vec3::Z, SIZE).is_none());
    // The top edge of the picture is half the field of view up.
    let top = view.ray(vec2(320.0, 0.0), SIZE);
    assert_near(top.direction, Vec3::new(0.0, 0.5f32.sin(), -0.5f32.cos()), 1e-6);
}

#[test]
fn orthographic_frames_are_kept_whole() {
    let projection = Projection::Orthographic { half_width: 8.0, half_height: 2.0, near: 0.0, far: 10.0 };
    let view = View::of_camera(&posed(Mat4::IDENTITY, projection), uvec2(200, 100));
    assert_eq!(view.lens, Lens::Orthographic { half_extent: vec2(8.0, 4.0) });
}

#[test]
fn cameras_are_found_by_name_node_or_position() {
    let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None };
    let node = |name: &str, x: f32, camera| Node {
        name: name.into(),
        camera,
        transform: Transform::Matrix(Mat4::from_translation(Vec3::X * x)),
        ..Default::default()
    };
    let scene = Scene {
        nodes: vec![node("empty", 0.0, None), node("door", 1.0, Some(1)), node("window", 2.0, Some(0))],
        cameras: ["wide", "0"].map(|name| Camera { name: name.into(), projection }).to_vec(),
        ..Default::default()
    };
    let pose = Pose::rest(&scene);
    let find = |wanted| View::of_scene(&scene, &pose, wanted, None, SIZE).map(|view| view.position.x);
    assert_eq!(find(None), Ok(1.0));
    assert_eq!(find(Some("window")), Ok(2.0));
    assert_eq!(find(Some("wide")), Ok(2.0));
    assert_eq!(find(Some("1")), Ok(2.0));
    // A name wins over a position.
    assert_eq!(find(Some("0")), Ok(1.0));
    let error = find(Some("roof")).unwrap_err();
    let CameraError::Unknown { available, .. } = &error;
    assert_eq!(available.len(), 2);
    assert!(error.to_string().contains("roof") && error.to_string().contains("door"), "{error}");

    let bare = Scene::default();
    let framed = View::of_scene(&bare, &Pose::rest(&bare), None, None, SIZE).unwrap();
    assert_eq!(framed, View::framed([Vec3::NEG_ONE, Vec3::ONE], SIZE));
}
