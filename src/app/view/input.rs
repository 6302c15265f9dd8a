//! What keys and the mouse do over the picture.

use egui::{Key, PointerButton, Sense, Ui};
use glam::{UVec2, Vec2, Vec3};

use super::camera::{self, CameraMode};
use super::desk::Desk;
use super::editor;
use super::viewer::Viewer;
use crate::app::render::FreeCamera;
use crate::methods::METHODS;
use crate::report::image::{MAX_PIXELS, MAX_SIDE};

/// Seconds a step of the animation takes, by key.
const ANIMATION_STEP: f32 = 1.0 / 30.0;

impl Viewer {
    pub(super) fn keys(&mut self, ui: &Ui, desk: &Desk, step: f32) {
        // With the modifiers of the moment it was pressed: all may be released again within one slow frame.
        let pressed_with = |wanted: Key, with_command: bool, repeats: bool| {
            let is_it = |event: &egui::Event| {
                matches!(event, egui::Event::Key { key, pressed: true, modifiers, repeat, .. }
                    if *key == wanted && modifiers.command == with_command && (repeats || !*repeat))
            };
            // How often: in one slow frame a key may come twice.
            ui.ctx().input(|input| input.events.iter().filter(|event| is_it(event)).count())
        };
        // A key that is held down for long switches once, and steps on and on.
        let presses = |key| pressed_with(key, false, false);
        let pressed = |key| presses(key) > 0;
        let switched = |key| presses(key) % 2 == 1;
        let steps = |key| pressed_with(key, false, true);
        let duration = self.shown.as_ref().map_or(0.0, |shown| shown.duration);
        if switched(Key::F1) {
            self.is_bare = !self.is_bare;
        }
        if pressed(Key::F12) {
            self.wants_screenshot = true;
        }
        if pressed(Key::F5) {
            self.wants_state = true;
        }
        if pressed(Key::R) {
            self.ask_again();
        }
        if switched(Key::P) {
            self.toggle_profile(desk);
        }
        if switched(Key::X) {
            self.explains = !self.explains;
        }
        if pressed(Key::Escape) {
            desk.cancel();
            self.explanation = None;
        }
        if switched(Key::Space) {
            self.is_playing = !self.is_playing && duration > 0.0;
        }
        self.wants_to_quit |= pressed_with(Key::Q, true, false) > 0;
        self.wants_new_surface |= pressed_with(Key::L, true, false) > 0;
        for (key, other) in [(Key::PageDown, 1), (Key::PageUp, METHODS.len() - 1)] {
            for _ in 0..presses(key) {
                let at = METHODS.iter().position(|method| method.key == self.args.method.key).unwrap_or(0);
                self.choose_method(&METHODS[(at + other) % METHODS.len()]);
            }
        }
        for (key, seconds) in [(Key::Comma, -ANIMATION_STEP), (Key::Period, ANIMATION_STEP)] {
            for _ in 0..steps(key) {
                self.step_animation(seconds, duration);
            }
        }
        if switched(Key::C) {
            self.camera_mode = match self.camera_mode {
                CameraMode::Orbit => CameraMode::Fly,
                CameraMode::Fly => CameraMode::Orbit,
            };
        }
        if self.camera_mode == CameraMode::Fly {
            let down = |key| f32::from(u8::from(ui.ctx().input(|input| input.key_down(key))));
            let way = Vec3::new(down(Key::D) - down(Key::A), down(Key::E) - down(Key::Q), down(Key::W) - down(Key::S));
            if let (true, Some(shown)) = (way != Vec3::ZERO, &self.shown) {
                let size = (shown.bounds[1] - shown.bounds[0]).length();
                self.move_camera(|camera| camera::fly(camera, way * (0.25 * size * step)));
            }
        }
    }

    /// The picture's place, and the mouse over it.
    pub(super) fn steer(&mut self, ui: &mut Ui, desk: &Desk) {
        let rect = ui.max_rect();
        let scale = ui.ctx().pixels_per_point();
        let pixels = |points: f32| (points * scale).round().max(0.0) as u32;
        self.corner = [pixels(rect.min.x), pixels(rect.min.y)];
        let size = [pixels(rect.max.x), pixels(rect.max.y)].map(|side| side.min(MAX_SIDE));
        let (width, height) = (size[0].saturating_sub(self.corner[0]), size[1].saturating_sub(self.corner[1]));
        // Two pictures share the width.
        let width = if self.comparison.is_side_by_side() { width / 2 } else { width };
        if width > 0 && height > 0 && u64::from(width) * u64::from(height) <= MAX_PIXELS {
            self.args.size = (width, height);
        }

        let response = ui.interact(rect, ui.id().with("picture"), Sense::click_and_drag());
        let dragged = response.drag_delta() * scale;
        let dragged = Vec2::new(dragged.x, dragged.y);
        let notches =
            if response.hovered() { ui.ctx().input(|input| input.smooth_scroll_delta().y) / 50.0 } else { 0.0 };
        let (mode, rows) = (self.camera_mode, height as f32);
        // What was picked follows the mouse; the picture follows when it is let go.
        let moves_picked = self.picked.is_some() && ui.ctx().input(|input| input.modifiers.shift);
        if moves_picked && response.dragged_by(PointerButton::Primary) {
            self.move_picked(dragged, rows);
            return;
        }
        if response.dragged() {
            self.is_steering = true;
        }
        if let (true, Some(at)) = (response.clicked(), response.interact_pointer_pos()) {
            let [left, top] = self.corner;
            let mut pixel = UVec2::new(pixels(at.x).saturating_sub(left), pixels(at.y).saturating_sub(top));
            if self.comparison.is_side_by_side() {
                pixel.x %= width.max(1);
            }
            if self.explains {
                desk.explain(pixel);
            } else {
                desk.pick(pixel);
            }
        }
        if response.dragged_by(PointerButton::Primary) && dragged != Vec2::ZERO {
            self.move_camera(|camera| camera::turn(camera, mode, dragged));
        } else if response.dragged() && dragged != Vec2::ZERO {
            self.move_camera(|camera| camera::pan(camera, dragged, rows));
        }
        if notches != 0.0 {
            self.move_camera(|camera| camera::dolly(camera, notches));
        }
    }

    fn move_picked(&mut self, pixels: Vec2, rows: f32) {
        let (Some(camera), Some(picked)) = (self.free_camera(), &self.picked) else { return };
        if pixels != Vec2::ZERO {
            let handle = picked.handle();
            editor::drag(&handle, camera::across(&camera, pixels, handle.depth, rows), &mut self.args.edit);
        }
    }

    pub(super) fn move_camera(&mut self, change: impl FnOnce(&mut FreeCamera)) {
        let Some(mut camera) = self.free_camera() else { return };
        change(&mut camera);
        let FreeCamera { eye, look_at, fov } = camera;
        if eye.is_finite() && look_at.is_finite() && eye != look_at && eye.abs().max_element() < 1e9 {
            (self.args.eye, self.args.look_at, self.args.fov) = (Some(eye), Some(look_at), fov);
            self.is_steering = true;
        }
    }
}
