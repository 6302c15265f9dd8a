//! What the user did: the options that decide the picture, the camera, what is shown and what was asked for.

use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use egui::{CentralPanel, Key, PointerButton, Sense, Ui};
use glam::{UVec2, Vec2, Vec3};

use super::camera::{self, CameraMode};
use super::desk::{Desk, Job, News, Shown};
use super::engine::{Picked, change};
use super::panel;
use super::profiler::Profiler;
use crate::app::cli::{Display, PictureArgs, ViewArgs};
use crate::app::render::{FreeCamera, RenderRequest};
use crate::app::values::{Format, Output};
use crate::app::{AppError, frame, output, state, views};
use crate::display::tone_map::LightParts;
use crate::gpu::{Context, MemoryUse, PassRecord, Reload};
use crate::methods::settings::Assignment;
use crate::methods::{METHODS, Method};
use crate::report::image::{MAX_PIXELS, MAX_SIDE};
use crate::report::tonemap::ToneSettings;
use crate::stages::film::Film;

/// Width of the panel, points.
pub const PANEL_WIDTH: f32 = 300.0;
/// Longest step of time between two frames, so that a hitch makes no leap.
const LONGEST_STEP: Duration = Duration::from_millis(200);
/// Seconds a step of the animation takes, by key.
const ANIMATION_STEP: f32 = 1.0 / 30.0;

/// The state of the viewer.
pub struct Viewer {
    /// What the widgets show and change; the picture follows.
    pub args: PictureArgs,
    pub camera_mode: CameraMode,
    pub is_playing: bool,
    pub news: News,
    /// Why the present options give no picture.
    pub complaint: Option<String>,
    /// What was last done, for the user to read.
    pub note: Option<String>,
    pub shown: Option<Shown>,
    pub wants_screenshot: bool,
    pub wants_state: bool,
    pub wants_to_quit: bool,
    /// The window's surface is to be made anew.
    pub wants_new_surface: bool,
    /// What was clicked at.
    pub picked: Option<Picked>,
    pub memory: BTreeMap<String, MemoryUse>,
    profiler: Profiler,
    shows_profile: bool,
    /// Shaders that do not compile, by file, with the compiler's words; the last good ones stay.
    shader_errors: BTreeMap<&'static str, String>,
    /// A shader changed: the next picture is prepared anew.
    is_anew: bool,
    is_bare: bool,
    /// The mouse or a key moves the camera.
    is_steering: bool,
    /// Options and kind of the picture that was asked for.
    posted: Option<(Vec<String>, bool)>,
    asked: Option<Job>,
    /// Of the picture's top left pixel in the frame.
    corner: [u32; 2],
    shots: PathBuf,
    last_tick: Instant,
    frame_count: u64,
    /// Display and settings of methods that were left.
    left: HashMap<&'static str, (Option<Display>, Vec<Assignment>)>,
}

/// What is to be drawn.
pub struct PictureShown<'v> {
    pub film: &'v Film,
    pub corner: [u32; 2],
    pub parts: LightParts,
    pub tone: ToneSettings,
}

impl Viewer {
    pub fn new(args: &ViewArgs) -> Result<Self, AppError> {
        request(&args.picture)?;
        let mut picture = args.picture.clone();
        // The widgets know the setting.
        views::resolve(&mut picture)?;
        Ok(Self {
            args: picture,
            camera_mode: CameraMode::default(),
            is_playing: false,
            news: News::default(),
            complaint: None,
            note: None,
            shown: None,
            wants_screenshot: false,
            wants_state: false,
            wants_to_quit: false,
            wants_new_surface: false,
            picked: None,
            memory: BTreeMap::new(),
            profiler: Profiler::default(),
            shows_profile: false,
            shader_errors: BTreeMap::new(),
            is_anew: false,
            is_bare: args.bare,
            is_steering: false,
            posted: None,
            asked: None,
            corner: [0; 2],
            shots: args.shots.clone(),
            last_tick: Instant::now(),
            frame_count: 0,
            left: HashMap::new(),
        })
    }

    /// So that the picture has the size that was asked for, pixels.
    pub fn window_size(&self) -> [u32; 2] {
        let (width, height) = self.args.size;
        [width + if self.is_bare { 0 } else { PANEL_WIDTH as u32 }, height]
    }

    pub fn title(&self) -> String {
        let doing = match () {
            () if self.complaint.is_some() || self.news.failure.is_some() => "no picture",
            () if self.is_settled() => "ready",
            () => "working",
        };
        format!("linklight: {} by {} ({doing})", self.args.scene, self.args.method.key)
    }

    /// Whether the interface moves by itself.
    pub fn is_moving(&self) -> bool {
        self.is_playing || self.is_steering
    }

    pub fn take_news(&mut self, desk: &Desk) -> Result<(), AppError> {
        self.news = desk.news();
        if let Some(end) = self.news.end.take() {
            return Err(end);
        }
        if let Some(shown) = self.news.shown.take() {
            self.profiler.finish_frame(shown.milliseconds);
            self.shown = Some(shown);
        }
        if let Some(picked) = self.news.picked.take() {
            self.picked = picked;
        }
        self.profiler.bandwidth = self.news.bandwidth.take().or(self.profiler.bandwidth);
        Ok(())
    }

    /// Shaders that were compiled anew, or would not.
    pub fn take_reloads(&mut self, reloads: &[Reload]) {
        for reload in reloads {
            match &reload.result {
                Ok(()) => {
                    self.shader_errors.remove(reload.file);
                    self.is_anew = true;
                    self.ask_again();
                }
                Err(error) => {
                    self.shader_errors.insert(reload.file, error.clone());
                }
            }
        }
    }

    pub fn toggle_profile(&mut self, desk: &Desk) {
        self.shows_profile = !self.shows_profile;
        if self.shows_profile && self.profiler.bandwidth.is_none() {
            desk.measure_bandwidth();
        }
    }

    /// A frame of the window was drawn.
    pub fn take_records(&mut self, records: Vec<PassRecord>) {
        self.profiler.take(records);
        self.frame_count += 1;
    }

    /// The last film, to be shown as the options say now.
    pub fn picture(&self) -> Option<PictureShown<'_>> {
        let shown = self.shown.as_ref()?;
        let request = request(&self.args).ok();
        let request = request.as_ref().unwrap_or(&shown.job.request);
        Some(PictureShown { film: &shown.film, corner: self.corner, parts: request.light, tone: request.tone })
    }

    /// Lays the interface out, lets it change the options, and asks for the picture they decide.
    pub fn interface(&mut self, ui: &mut Ui, desk: &Desk) {
        let step = self.last_tick.elapsed().min(LONGEST_STEP).as_secs_f32();
        self.last_tick = Instant::now();
        self.is_steering = false;
        if !ui.ctx().text_edit_focused() {
            self.keys(ui, desk, step);
        }
        if !self.is_bare {
            let side = egui::Panel::left("controls").resizable(false).exact_size(PANEL_WIDTH);
            side.show(ui, |ui| panel::show(ui, self, desk));
        }
        CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| self.steer(ui, desk));
        if self.shows_profile {
            let window = egui::Window::new("Profile").default_width(560.0).default_pos([PANEL_WIDTH + 20.0, 20.0]);
            window.show(ui.ctx(), |ui| self.profiler.show(ui, &self.memory));
        }
        if !self.shader_errors.is_empty() {
            egui::Window::new("Shaders kept as they were").default_pos([PANEL_WIDTH + 20.0, 40.0]).show(
                ui.ctx(),
                |ui| {
                    for error in self.shader_errors.values() {
                        ui.colored_label(egui::Color32::LIGHT_RED, egui::RichText::new(error).monospace());
                    }
                },
            );
        }
        if self.is_playing && !self.news.is_working {
            let duration = self.shown.as_ref().map_or(0.0, |shown| shown.duration);
            self.step_animation(step, duration);
        }
        let holds = ui.ctx().input(|input| input.pointer.any_down()) && !self.is_steering;
        if !holds {
            self.ask(desk);
        }
    }

    /// To another method, with the display and settings it had when it was last left.
    pub fn choose_method(&mut self, method: &'static Method) {
        let args = &mut self.args;
        let (display, set) = self.left.remove(method.key).unwrap_or_default();
        let old = (std::mem::replace(&mut args.display, display), std::mem::replace(&mut args.set, set));
        self.left.insert(args.method.key, old);
        args.method = method;
    }

    pub fn step_animation(&mut self, seconds: f32, duration: f32) {
        let next = self.args.seconds + seconds;
        self.args.seconds = if duration > 0.0 { next.rem_euclid(duration) } else { 0.0 };
    }

    /// The free camera, which starts as the camera that is shown.
    pub fn free_camera(&self) -> Option<FreeCamera> {
        match (self.args.eye, self.args.look_at) {
            (Some(eye), Some(look_at)) => Some(FreeCamera { eye, look_at, fov: self.args.fov }),
            _ => self.shown.as_ref().map(|shown| camera::of_view(&shown.view, shown.bounds)),
        }
    }

    /// Back to the scene's own.
    pub fn reset_camera(&mut self) {
        (self.args.eye, self.args.look_at) = (None, None);
    }

    /// Screenshots and states wait for the picture that the options decide.
    pub fn do_actions(&mut self, context: &Context, desk: &Desk) -> Result<(), AppError> {
        if !(self.wants_screenshot || self.wants_state) || !self.is_settled() || desk.news_are_waiting() {
            return Ok(());
        }
        let name = |number: u32, ending: &str| self.shots.join(format!("shot-{number:03}.{ending}"));
        let is_free = |number: &u32| ["state", "png", "exr"].iter().all(|ending| !name(*number, ending).exists());
        let number = (1..1000).find(is_free).unwrap_or(1000);
        let done = state::write(&name(number, "state"), &self.args).and_then(|()| {
            let (true, Some(shown)) = (self.wants_screenshot, &self.shown) else { return Ok(()) };
            for (ending, format) in [("png", Format::Png), ("exr", Format::Exr)] {
                let mut request = request(&self.args)?;
                request.output = Output { path: name(number, ending), format };
                let picture = frame::picture(context, &request, &shown.film)?;
                output::write_picture(&request, picture, context.info())?;
            }
            Ok(())
        });
        let (pipelines, memory) = (context.pipeline_count(), context.memory_by_owner());
        let bytes: u64 = memory.values().map(|memory| memory.current_bytes).sum();
        tracing::info!("{} frames shown, {pipelines} pipelines made, {bytes} bytes on the device", self.frame_count);
        let what = if self.wants_screenshot { "png, .exr and .state" } else { "state" };
        (self.wants_screenshot, self.wants_state) = (false, false);
        self.note = Some(match done {
            Ok(()) => format!("{} is written as .{what}", self.shots.join(format!("shot-{number:03}")).display()),
            Err(error) => format!("not written: {error}"),
        });
        Ok(())
    }

    /// The film shown is the one that the options decide, in full quality.
    fn is_settled(&self) -> bool {
        let Some(shown) = &self.shown else { return false };
        let is_final = !shown.job.is_preview && !self.news.is_working && !self.is_moving();
        let is_current = |request: RenderRequest| change(&shown.job.request, &request).is_none();
        is_final && request(&self.args).is_ok_and(is_current)
    }

    fn keys(&mut self, ui: &Ui, desk: &Desk, step: f32) {
        // With the modifiers of the moment it was pressed: all may be released again within one slow frame.
        let pressed_with = |wanted: Key, with_command: bool| {
            let is_it = |event: &egui::Event| {
                matches!(event, egui::Event::Key { key, pressed: true, modifiers, .. }
                    if *key == wanted && modifiers.command == with_command)
            };
            ui.ctx().input(|input| input.events.iter().any(is_it))
        };
        let pressed = |key| pressed_with(key, false);
        let duration = self.shown.as_ref().map_or(0.0, |shown| shown.duration);
        if pressed(Key::F1) {
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
        if pressed(Key::P) {
            self.toggle_profile(desk);
        }
        if pressed(Key::Escape) {
            desk.cancel();
        }
        if pressed(Key::Space) {
            self.is_playing = !self.is_playing && duration > 0.0;
        }
        self.wants_to_quit |= pressed_with(Key::Q, true);
        self.wants_new_surface |= pressed_with(Key::L, true);
        for (key, other) in [(Key::PageDown, 1), (Key::PageUp, METHODS.len() - 1)] {
            if pressed(key) {
                let at = METHODS.iter().position(|method| method.key == self.args.method.key).unwrap_or(0);
                self.choose_method(&METHODS[(at + other) % METHODS.len()]);
            }
        }
        for (key, seconds) in [(Key::Comma, -ANIMATION_STEP), (Key::Period, ANIMATION_STEP)] {
            if pressed(key) {
                self.step_animation(seconds, duration);
            }
        }
        if pressed(Key::C) {
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
    fn steer(&mut self, ui: &mut Ui, desk: &Desk) {
        let rect = ui.max_rect();
        let scale = ui.ctx().pixels_per_point();
        let pixels = |points: f32| (points * scale).round().max(0.0) as u32;
        self.corner = [pixels(rect.min.x), pixels(rect.min.y)];
        let size = [pixels(rect.max.x), pixels(rect.max.y)].map(|side| side.min(MAX_SIDE));
        let (width, height) = (size[0].saturating_sub(self.corner[0]), size[1].saturating_sub(self.corner[1]));
        if width > 0 && height > 0 && u64::from(width) * u64::from(height) <= MAX_PIXELS {
            self.args.size = (width, height);
        }

        let response = ui.interact(rect, ui.id().with("picture"), Sense::click_and_drag());
        let dragged = response.drag_delta() * scale;
        let dragged = Vec2::new(dragged.x, dragged.y);
        let notches =
            if response.hovered() { ui.ctx().input(|input| input.smooth_scroll_delta().y) / 50.0 } else { 0.0 };
        let (mode, rows) = (self.camera_mode, height as f32);
        if response.dragged() {
            self.is_steering = true;
        }
        if let (true, Some(at)) = (response.clicked(), response.interact_pointer_pos()) {
            let [left, top] = self.corner;
            desk.pick(UVec2::new(pixels(at.x).saturating_sub(left), pixels(at.y).saturating_sub(top)));
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

    fn move_camera(&mut self, change: impl FnOnce(&mut FreeCamera)) {
        let Some(mut camera) = self.free_camera() else { return };
        change(&mut camera);
        let FreeCamera { eye, look_at, fov } = camera;
        if eye.is_finite() && look_at.is_finite() && eye != look_at && eye.abs().max_element() < 1e9 {
            (self.args.eye, self.args.look_at, self.args.fov) = (Some(eye), Some(look_at), fov);
            self.is_steering = true;
        }
    }

    /// Asks for the picture that the options decide, unless it was asked for.
    fn ask(&mut self, desk: &Desk) {
        let is_preview = self.is_moving();
        let posted = (state::options(&self.args), is_preview);
        if self.posted.as_ref() == Some(&posted) {
            return;
        }
        self.posted = Some(posted);
        match request(&self.args) {
            Ok(mut request) => {
                self.complaint = None;
                if is_preview {
                    request.spp = 1;
                }
                let same = |asked: &Job| asked.is_preview == is_preview && change(&asked.request, &request).is_none();
                if !self.asked.as_ref().is_some_and(same) {
                    let job = Job { request, is_preview, is_anew: std::mem::take(&mut self.is_anew) };
                    self.asked = Some(job.clone());
                    self.news.is_working = true;
                    desk.ask(job);
                }
            }
            Err(error) => {
                let text = error.to_string();
                self.complaint = Some(text.split("\n\n").next().unwrap_or_default().to_owned());
            }
        }
    }

    /// Asks again for what was cancelled or failed.
    pub fn ask_again(&mut self) {
        (self.posted, self.asked) = (None, None);
    }
}

/// The request of the options, as a PNG nobody writes.
fn request(args: &PictureArgs) -> Result<RenderRequest, AppError> {
    RenderRequest::of_picture(args, Output { path: "view.png".into(), format: Format::Png })
}
