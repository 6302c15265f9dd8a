//! The panel beside the picture: everything that decides it, and how the work stands.

use egui::{Button, CollapsingHeader, Color32, ComboBox, DragValue, ProgressBar, ScrollArea, Slider, Ui};

use super::camera::CameraMode;
use super::desk::Desk;
use super::viewer::Viewer;
use super::{editor, settings};
use crate::app::cli::Display;
use crate::app::render::displays;
use crate::app::state::name;
use crate::app::views;
use crate::display::final_gather;
use crate::methods::METHODS;
use crate::methods::settings::SettingGroup as _;
use crate::report::tonemap::Operator;
use clap::ValueEnum;

const MOST_ELEMENTS: u32 = 50_000_000;

pub fn show(ui: &mut Ui, viewer: &mut Viewer, desk: &Desk) {
    work(ui, viewer, desk);
    ui.separator();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        method(ui, viewer);
        ui.separator();
        light(ui, viewer);
        ui.separator();
        viewer.comparison.rows(ui);
        bad_values(ui, viewer);
        ui.checkbox(&mut viewer.explains, "clicks explain a pixel").on_hover_text("X");
        ui.separator();
        camera(ui, viewer);
        animation(ui, viewer);
        ui.separator();
        scene(ui, viewer);
        let specs = viewer.args.method.specs();
        CollapsingHeader::new(format!("Settings of {}", viewer.args.method.key))
            .default_open(true)
            .show(ui, |ui| settings::rows(ui, &specs, &mut viewer.args.set));
        if shown_by(viewer) == Some(Display::FinalGather) {
            CollapsingHeader::new("Settings of the final gather")
                .default_open(true)
                .show(ui, |ui| settings::rows(ui, &final_gather::Settings::specs(), &mut viewer.args.set));
        }
    });
}

/// What was clicked at, and the lights.
fn scene(ui: &mut Ui, viewer: &mut Viewer) {
    let lights = viewer.shown.as_ref().map(|shown| shown.lights.clone()).unwrap_or_default();
    match &viewer.picked {
        Some(picked) => editor::picked(ui, picked, &lights, &mut viewer.args.edit),
        None => {
            ui.weak("click at a surface or a light to change it");
        }
    }
    editor::lights(ui, &lights, &mut viewer.args.edit);
    if !viewer.args.edit.is_empty() && ui.button("Undo all changes").clicked() {
        viewer.args.edit.clear();
        viewer.picked = None;
    }
    ui.separator();
}

/// Progress, errors, and what to do about them.
fn work(ui: &mut Ui, viewer: &mut Viewer, desk: &Desk) {
    ui.horizontal(|ui| {
        if ui.button("Screenshot").on_hover_text("F12: .png, .exr and .state into --shots").clicked() {
            viewer.wants_screenshot = true;
        }
        if ui.button("Save state").on_hover_text("F5: a file for --state").clicked() {
            viewer.wants_state = true;
        }
        if ui.button("Profile").on_hover_text("P: times of all passes").clicked() {
            viewer.toggle_profile(desk);
        }
        let is_working = viewer.news.is_working;
        if ui.add_enabled(is_working, Button::new("Cancel")).on_hover_text("Escape").clicked() {
            desk.cancel();
        }
        if viewer.news.failure.is_some() && ui.button("Again").on_hover_text("R").clicked() {
            viewer.ask_again();
        }
    });
    match &viewer.news.progress {
        Some(progress) if viewer.news.is_working => {
            let share = progress.done as f32 / progress.total.max(1) as f32;
            ui.add(ProgressBar::new(share).text(format!("{} {}/{}", progress.task, progress.done, progress.total)));
        }
        _ => {
            let text = match &viewer.shown {
                Some(shown) => {
                    let age = shown.link_age.map(|age| format!(", links {age} frames old")).unwrap_or_default();
                    let (ms, facts) = (shown.milliseconds, &shown.facts);
                    format!("{ms:.1} ms, {} elements, {} triangles{age}", facts.elements, facts.triangles)
                }
                None => "loading".to_owned(),
            };
            ui.label(text);
        }
    }
    for problem in viewer.complaint.iter().chain(&viewer.news.failure) {
        ui.colored_label(Color32::LIGHT_RED, problem);
    }
    if let Some(note) = &viewer.note {
        ui.weak(note);
    }
}

/// How the method's solution is shown, if it is not with pixels of its own.
fn shown_by(viewer: &Viewer) -> Option<Display> {
    let default = displays(viewer.args.method).first().copied();
    default.map(|default| viewer.args.display.unwrap_or(default))
}

fn method(ui: &mut Ui, viewer: &mut Viewer) {
    let mut chosen = viewer.args.method;
    ComboBox::from_label("method").selected_text(chosen.key).show_ui(ui, |ui| {
        for method in METHODS {
            if ui.selectable_label(method.key == chosen.key, method.key).on_hover_text(method.summary).clicked() {
                chosen = method;
            }
        }
    });
    if chosen.key != viewer.args.method.key {
        viewer.choose_method(chosen);
    }
    if let Some(mut display) = shown_by(viewer) {
        let before = display;
        choice(ui, "display", displays(viewer.args.method), &mut display);
        if display != before {
            viewer.args.display = Some(display);
        }
    }
    let args = &mut viewer.args;
    ui.add(Slider::new(&mut args.bounces, 0..=16).clamping(egui::SliderClamping::Edits).text("bounces"));
    let mut spp = args.spp.unwrap_or(0);
    ui.horizontal(|ui| {
        ui.label("samples a pixel").on_hover_text("0: the default");
        ui.add(DragValue::new(&mut spp).range(0..=65_536).update_while_editing(false));
    });
    args.spp = (spp > 0).then_some(spp);
    let mut elements = args.elements.unwrap_or(0);
    ui.horizontal(|ui| {
        ui.label("elements").on_hover_text("0: the default");
        ui.add(DragValue::new(&mut elements).range(0..=MOST_ELEMENTS).speed(100.0).update_while_editing(false));
        ui.label("seed");
        ui.add(DragValue::new(&mut args.seed).update_while_editing(false));
    });
    args.elements = (elements > 0).then_some(elements);
}

fn light(ui: &mut Ui, viewer: &mut Viewer) {
    let args = &mut viewer.args;
    ui.horizontal(|ui| {
        let parts = (args.direct_only, args.indirect_only);
        for (label, value) in [("all light", (false, false)), ("direct", (true, false)), ("indirect", (false, true))] {
            if ui.selectable_label(parts == value, label).clicked() {
                (args.direct_only, args.indirect_only) = value;
            }
        }
        ui.checkbox(&mut args.diffuse, "diffuse");
    });
    ui.add(Slider::new(&mut args.exposure, -8.0..=8.0).clamping(egui::SliderClamping::Edits).text("exposure"));
    choice(ui, "tone map", Operator::value_variants(), &mut args.tonemap);
    if args.env.is_some() {
        ui.add(Slider::new(&mut args.env_turn, -180.0..=180.0).text("environment, degrees"));
    }
}

fn bad_values(ui: &mut Ui, viewer: &mut Viewer) {
    let mut shows = views::shows_bad_values(&viewer.args);
    if ui.checkbox(&mut shows, "NaN, infinite, negative").on_hover_text(views::BAD_VALUES.doc).changed() {
        viewer.args.view = shows.then(|| views::BAD_VALUES.name.to_owned());
    }
}

fn camera(ui: &mut Ui, viewer: &mut Viewer) {
    ui.horizontal(|ui| {
        let about = "Drag to turn, with the right button to pan, wheel to move nearer; fly: W A S D Q E. Key C";
        ui.selectable_value(&mut viewer.camera_mode, CameraMode::Orbit, "orbit").on_hover_text(about);
        ui.selectable_value(&mut viewer.camera_mode, CameraMode::Fly, "fly").on_hover_text(about);
        if ui.add_enabled(viewer.args.eye.is_some(), Button::new("Reset camera")).clicked() {
            viewer.reset_camera();
        }
    });
    let cameras = viewer.shown.as_ref().map(|shown| shown.cameras.clone()).unwrap_or_default();
    if cameras.len() > 1 {
        let chosen = viewer.args.camera.as_ref().map_or("first", |camera| camera.name.as_str()).to_owned();
        ComboBox::from_label("camera").selected_text(&chosen).show_ui(ui, |ui| {
            for (index, camera) in cameras.iter().enumerate() {
                if ui.selectable_label(false, format!("{index} {camera}")).clicked() {
                    viewer.args.camera = index.to_string().parse().ok();
                    viewer.reset_camera();
                }
            }
        });
    }
}

fn animation(ui: &mut Ui, viewer: &mut Viewer) {
    let duration = viewer.shown.as_ref().map_or(0.0, |shown| shown.duration);
    if duration <= 0.0 {
        return;
    }
    ui.horizontal(|ui| {
        if ui.button(if viewer.is_playing { "Pause" } else { "Play" }).on_hover_text("Space").clicked() {
            viewer.is_playing = !viewer.is_playing;
        }
        if ui.button("<").on_hover_text("Comma").clicked() {
            viewer.step_animation(-1.0 / 30.0, duration);
        }
        if ui.button(">").on_hover_text("Period").clicked() {
            viewer.step_animation(1.0 / 30.0, duration);
        }
        ui.add(Slider::new(&mut viewer.args.seconds, 0.0..=duration).text("s"));
    });
}

/// A list of the values an option has on the command line.
fn choice<T: ValueEnum + PartialEq + Copy>(ui: &mut Ui, label: &str, values: &[T], chosen: &mut T) {
    ComboBox::from_label(label).selected_text(name(chosen)).show_ui(ui, |ui| {
        for value in values {
            ui.selectable_value(chosen, *value, name(value));
        }
    });
}
