//! The camera under the mouse: around a place (orbit), or through the scene (fly).

use glam::{Quat, Vec2, Vec3};

use crate::app::render::FreeCamera;
use crate::scene::camera::{Lens, View};

/// What dragging and keys do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CameraMode {
    /// Dragging turns about what is looked at.
    #[default]
    Orbit,
    /// Dragging turns the head, W A S D Q E move.
    Fly,
}

/// Radians per pixel dragged.
const TURN_SPEED: f32 = 0.006;
/// Share of the distance to what is looked at, per notch of the wheel.
const DOLLY_STEP: f32 = 0.1;
/// Keeps the eye from the poles, where up and forward coincide; radians.
const POLE: f32 = 0.02;

/// The free camera that sees what `view` sees, looking at a place at about the middle of the scene's depth.
pub fn of_view(view: &View, bounds: [Vec3; 2]) -> FreeCamera {
    let middle = bounds[0].midpoint(bounds[1]);
    let radius = (bounds[1] - bounds[0]).length() * 0.5;
    let distance = (middle - view.position).dot(view.forward).max(0.1 * radius).max(1e-3);
    let tan_half = match view.lens {
        Lens::Perspective { tan_half } => tan_half.y,
        // As tall at what is looked at.
        Lens::Orthographic { half_extent } => half_extent.y / distance,
    };
    let fov = (2.0 * tan_half.atan()).to_degrees().clamp(1.0, 170.0);
    FreeCamera { eye: view.position, look_at: view.position + view.forward * distance, fov }
}

/// Turns by so many pixels dragged.
pub fn turn(camera: &mut FreeCamera, mode: CameraMode, pixels: Vec2) {
    let forward = camera.look_at - camera.eye;
    let yaw = Quat::from_rotation_y(-pixels.x * TURN_SPEED);
    let pitch_before = forward.angle_between(Vec3::Y);
    let pitch = (pitch_before + pixels.y * TURN_SPEED).clamp(POLE, std::f32::consts::PI - POLE) - pitch_before;
    let right = forward.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
    let turned = yaw * (Quat::from_axis_angle(right, -pitch) * forward);
    match mode {
        CameraMode::Orbit => camera.eye = camera.look_at - turned,
        CameraMode::Fly => camera.look_at = camera.eye + turned,
    }
}

/// How far so many pixels are, across what is `depth` metres away, in a picture so many pixels high.
pub fn across(camera: &FreeCamera, pixels: Vec2, depth: f32, height: f32) -> Vec3 {
    let forward = camera.look_at - camera.eye;
    let right = forward.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
    let up = right.cross(forward).normalize_or_zero();
    let metres_per_pixel = 2.0 * depth * (camera.fov.to_radians() * 0.5).tan() / height.max(1.0);
    (right * pixels.x - up * pixels.y) * metres_per_pixel
}

/// Moves sideways so that what is looked at follows the mouse, in a picture so many pixels high.
pub fn pan(camera: &mut FreeCamera, pixels: Vec2, height: f32) {
    let step = -across(camera, pixels, (camera.look_at - camera.eye).length(), height);
    camera.eye += step;
    camera.look_at += step;
}

/// Nearer (positive) or farther.
pub fn dolly(camera: &mut FreeCamera, notches: f32) {
    let forward = camera.look_at - camera.eye;
    camera.eye = camera.look_at - forward * (1.0 - DOLLY_STEP).powf(notches);
}

/// Flies along right, up and forward, metres.
pub fn fly(camera: &mut FreeCamera, metres: Vec3) {
    let forward = (camera.look_at - camera.eye).normalize_or_zero();
    let right = forward.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
    let step = right * metres.x + Vec3::Y * metres.y + forward * metres.z;
    camera.eye += step;
    camera.look_at += step;
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    const CAMERA: FreeCamera =
        FreeCamera { eye: Vec3::new(0.0, 1.0, 4.0), look_at: Vec3::new(0.0, 1.0, 0.0), fov: 40.0 };

    #[test]
    fn an_orbit_keeps_its_distance_and_a_turned_head_its_place() {
        let mut orbit = CAMERA;
        turn(&mut orbit, CameraMode::Orbit, Vec2::new(100.0, -30.0));
        assert!((orbit.eye.distance(orbit.look_at) - 4.0).abs() < 1e-5 && orbit.look_at == CAMERA.look_at);
        assert!(orbit.eye.x < 0.0 && orbit.eye.distance(CAMERA.eye) > 1.0, "the scene follows the mouse");
        let mut fly = CAMERA;
        turn(&mut fly, CameraMode::Fly, Vec2::new(100.0, 0.0));
        assert_eq!(fly.eye, CAMERA.eye);
    }

    #[test]
    fn no_drag_turns_over_a_pole() {
        for mode in [CameraMode::Orbit, CameraMode::Fly] {
            for dy in [-1e5, 1e5] {
                let mut camera = CAMERA;
                turn(&mut camera, mode, Vec2::new(3.0, dy));
                let angle = (camera.look_at - camera.eye).angle_between(Vec3::Y);
                assert!(angle > 0.5 * POLE && angle < std::f32::consts::PI - 0.5 * POLE, "{angle}");
            }
        }
    }

    #[test]
    fn a_camera_taken_from_a_view_sees_the_same() {
        let size = UVec2::new(64, 48);
        let view = View::framed([Vec3::ZERO, Vec3::ONE], size);
        let camera = of_view(&view, [Vec3::ZERO, Vec3::ONE]);
        let again = View::towards(camera.eye, camera.look_at, camera.fov.to_radians(), size);
        for point in [Vec3::ZERO, Vec3::ONE, Vec3::new(0.3, 0.9, 0.1)] {
            let (a, b) = (view.project(point, size).unwrap().0, again.project(point, size).unwrap().0);
            assert!(a.distance(b) < 1e-2, "{a} {b}");
        }
    }

    #[test]
    fn panning_moves_what_is_looked_at_with_the_mouse() {
        let size = UVec2::new(200, 100);
        let mut camera = CAMERA;
        let point = camera.look_at;
        pan(&mut camera, Vec2::new(10.0, -5.0), 100.0);
        let at = View::towards(camera.eye, camera.look_at, 40f32.to_radians(), size).project(point, size).unwrap().0;
        assert!(at.distance(Vec2::new(110.0, 45.0)) < 0.1, "{at}");
    }

    #[test]
    fn the_wheel_never_passes_what_is_looked_at() {
        let mut camera = CAMERA;
        dolly(&mut camera, 200.0);
        assert!((camera.look_at - camera.eye).dot(Vec3::NEG_Z) > 0.0);
    }
}
