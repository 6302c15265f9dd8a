//! What the user did: the options that decide the picture, the camera, what is shown and what was asked for.

use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use egui::{CentralPanel, Ui};
use serde_json::Value;

use super::camera::{self, CameraMode};
use super::comparison::{Compared, Comparison, Layout, OtherJob};
use super::desk::{self, Desk, Job, News, Shown};
use super::engine::{Picked, change};
use super::panel;
use super::profiler::Profiler;
use crate::app::cli::{Display, PictureArgs, ViewArgs};
use crate::app::output::Measured;
use crate::app::render::{FreeCamera, RenderRequest};
use crate::app::values::{Format, Output};
use crate::app::{AppError, crash, frame, output, state, views};
use crate::display::tone_map::LightParts;
use crate::gpu::{Context, MemoryUse, PassRecord, Reload};
use crate::methods::Method;
use crate::methods::settings::Assignment;
use crate::report::explanation::Explanation;
use crate::report::tonemap::{Operator, ToneSettings};
use crate::report::trace::TimeLine;
use crate::stages::film::Film;

/// Width of the panel, points.
pub const PANEL_WIDTH: f32 = 300.0;
/// And of the window with figures, about.
const COMPARISON_WIDTH: f32 = 330.0;
/// Longest step of time between two frames, so that a hitch makes no leap.
const LONGEST_STEP: Duration = Duration::from_millis(200);

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
    /// What the picture is compared with, and the outcome.
    pub comparison: Comparison,
    pub compared: Option<Compared>,
    /// Clicks explain pixels.
    pub explains: bool,
    pub(super) explanation: Option<Explanation>,
    pub memory: BTreeMap<String, MemoryUse>,
    profiler: Profiler,
    shows_profile: bool,
    /// Shaders that do not compile, by file, with the compiler's words; the last good ones stay.
    shader_errors: BTreeMap<&'static str, String>,
    /// A shader changed: the next picture is prepared anew.
    is_anew: bool,
    pub(super) is_bare: bool,
    /// The mouse or a key moves the camera.
    pub(super) is_steering: bool,
    /// Options and kind of the picture that was asked for.
    posted: Option<(Vec<String>, bool)>,
    asked: Option<Job>,
    /// Options of both pictures of the comparison that was asked for.
    asked_other: Option<(Vec<String>, &'static str)>,
    asked_words: Arc<Mutex<String>>,
    /// Further devices that make links.
    link_gpus: Vec<String>,
    /// Of the picture's top left pixel in the frame.
    pub(super) corner: [u32; 2],
    shots: PathBuf,
    last_tick: Instant,
    /// Of the window.
    pub frame_count: u64,
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
    /// `asked` always holds the options of the last picture that was asked for, as `linklight render` takes them.
    pub fn new(args: &ViewArgs, asked: Arc<Mutex<String>>) -> Result<Self, AppError> {
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
            comparison: Comparison {
                against: args.against,
                layout: if args.difference { Layout::Difference } else { Layout::SideBySide },
            },
            compared: None,
            explains: false,
            explanation: None,
            asked_other: None,
            memory: BTreeMap::new(),
            profiler: Profiler::new(args.profile.is_some() || args.trace.is_some()),
            shows_profile: false,
            shader_errors: BTreeMap::new(),
            is_anew: false,
            is_bare: args.bare,
            is_steering: false,
            posted: None,
            asked: None,
            asked_words: asked,
            link_gpus: args.link_gpu.clone(),
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
        let width = if self.comparison.is_side_by_side() { 2 * width } else { width };
        [width + if self.is_bare { 0 } else { PANEL_WIDTH as u32 }, height]
    }

    pub fn title(&self) -> String {
        let doing = match () {
            () if self.complaint.is_some() || self.news.failure.is_some() => "no picture",
            () if !self.is_settled() => "working",
            () => match (&self.compared, self.comparison.against) {
                (Some(Compared { relative_mse: Some(figure), spp, .. }), Some(against)) => {
                    let what = format!("relative MSE {figure:.4} to {} of {spp}", against.key);
                    return format!("linklight: {} by {} (ready, {what})", self.args.scene, self.args.method.key);
                }
                (None, Some(_)) => "comparing",
                _ => "ready",
            },
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
            if shown.link_age.is_some() {
                // The same picture again, along younger links.
                self.ask_again();
            }
            self.shown = Some(shown);
        }
        if let Some(compared) = self.news.compared.take() {
            self.compared = Some(compared);
        }
        if let Some(explanation) = self.news.explanation.take() {
            self.explanation = Some(explanation);
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

    pub fn take_records(&mut self, records: Vec<PassRecord>) {
        self.profiler.take(records);
    }

    /// The last films, to be shown as the options say now.
    pub fn pictures(&self) -> Vec<PictureShown<'_>> {
        let Some(shown) = &self.shown else { return Vec::new() };
        let request = request(&self.args).ok();
        let request = request.as_ref().unwrap_or(&shown.job.request);
        let (corner, parts, tone) = (self.corner, request.light, request.tone);
        let own = PictureShown { film: &shown.film, corner, parts, tone };
        let Some(compared) = self.compared.as_ref().filter(|_| self.comparison.against.is_some()) else {
            return vec![own];
        };
        if self.comparison.is_side_by_side() {
            let [x, y] = corner;
            return vec![own, PictureShown { film: &compared.film, corner: [x + self.args.size.0, y], parts, tone }];
        }
        let plain = ToneSettings { operator: Operator::None, exposure: 0.0, ..tone };
        vec![PictureShown { film: &compared.difference, corner, parts: LightParts::All, tone: plain }]
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
        if self.comparison.against.is_some() && !self.is_bare {
            self.show_comparison(ui);
        }
        self.show_explanation(ui);
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
        self.ask_other(desk);
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

    /// Writes what was measured of the last pictures, where that was asked for.
    pub fn write_measurements(
        &self,
        context: &Context,
        time_line: Option<&TimeLine>,
        args: &ViewArgs,
    ) -> Result<(), AppError> {
        let (Some(shown), true) = (&self.shown, args.profile.is_some() || args.trace.is_some()) else { return Ok(()) };
        let (frames, records) = self.profiler.kept();
        let mut request = shown.job.request.clone();
        (request.profile, request.trace, request.frames) = (args.profile.clone(), args.trace.clone(), frames);
        let nothing = TimeLine::default();
        let time_line = time_line.unwrap_or(&nothing);
        let measured = Measured { context, time_line, records, scene: shown.facts.clone(), method: Value::Null };
        output::write_measurements(&request, measured, &mut std::io::sink())
    }

    /// The film shown is the one that the options decide, in full quality.
    fn is_settled(&self) -> bool {
        let Some(shown) = &self.shown else { return false };
        let is_final = !shown.job.is_preview && !self.news.is_working && !self.is_moving() && shown.link_age.is_none();
        let is_current = |request: RenderRequest| change(&shown.job.request, &request).is_none();
        is_final && request(&self.args).is_ok_and(is_current)
    }

    /// Asks for the picture that the options decide, unless it was asked for.
    fn ask(&mut self, desk: &Desk) {
        let is_preview = self.is_moving();
        let posted = (state::options(&self.args), is_preview);
        if self.posted.as_ref() == Some(&posted) {
            return;
        }
        self.posted = Some(posted);
        self.compared = None;
        self.asked_other = None;
        desk.compare(None);
        match request(&self.args) {
            Ok(mut request) => {
                self.complaint = None;
                if is_preview {
                    request.spp = 1;
                }
                if request.method.key == "explicit-visibility" {
                    request.link_gpus.clone_from(&self.link_gpus);
                }
                let same = |asked: &Job| asked.is_preview == is_preview && change(&asked.request, &request).is_none();
                if !self.asked.as_ref().is_some_and(same) {
                    let job = Job { request, is_preview, is_anew: std::mem::take(&mut self.is_anew) };
                    self.asked = Some(job.clone());
                    let words: Vec<String> =
                        state::options(&self.args).iter().map(|word| crash::quoted(word)).collect();
                    *desk::lock(&self.asked_words) = words.join(" ");
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

    /// Asks for the other picture of the comparison once the picture stands.
    fn ask_other(&mut self, desk: &Desk) {
        let wanted = self.comparison.against.map(|against| (state::options(&self.args), against.key));
        if wanted.is_some() && !self.is_settled() || self.asked_other == wanted {
            return;
        }
        self.asked_other = wanted;
        self.compared = None;
        let Some(against) = self.comparison.against else { return desk.compare(None) };
        let (display, set) = self.left.get(against.key).cloned().unwrap_or_default();
        let other = PictureArgs { method: against, display, set, spp: None, view: None, ..self.args.clone() };
        match (request(&self.args), request(&other)) {
            (Ok(own), Ok(other)) => desk.compare(Some(OtherJob::new(own, other))),
            (Err(error), _) | (_, Err(error)) => self.complaint = Some(error.to_string()),
        }
    }

    fn show_comparison(&self, ui: &Ui) {
        let corner = [self.corner[0] as f32 + 10.0, self.corner[1] as f32 + 10.0];
        // Before it is laid out it counts as wide as this: a wider guess would push it over the panel.
        let window = egui::Window::new("Comparison").default_pos(corner).default_width(COMPARISON_WIDTH);
        window.resizable(false).show(ui.ctx(), |ui| {
            ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
            match &self.compared {
                Some(compared) => compared.rows(ui),
                None => drop(ui.label("waiting for the other picture")),
            }
            if self.news.is_comparing {
                ui.weak("going on");
            }
        });
    }

    fn show_explanation(&mut self, ui: &Ui) {
        let mut is_open = self.explanation.is_some();
        if let Some(explanation) = &self.explanation {
            let window = egui::Window::new("What makes up the pixel").default_width(640.0).open(&mut is_open);
            window.default_pos([PANEL_WIDTH + 20.0, 60.0]).show(ui.ctx(), |ui| {
                egui::ScrollArea::both().max_height(360.0).show(ui, |ui| {
                    ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
                    ui.monospace(explanation.to_text());
                    if let Err(mismatch) = explanation.check() {
                        ui.colored_label(egui::Color32::LIGHT_RED, mismatch.to_string());
                    }
                });
            });
        }
        if !is_open {
            self.explanation = None;
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
