//! What was clicked at, and the scene's lights, to be changed: each change is an `--edit` of the state.

use egui::{CollapsingHeader, DragValue, Response, Slider, Ui};
use glam::Vec3;

use super::engine::{Handle, Picked, Surface};
use crate::app::edits::{Edit, Property};

/// Lights that get a row of their own.
const MOST_LIGHTS: usize = 64;
/// Metres that something may be moved.
const FARTHEST: f32 = 1e6;
const DRAG: &str = "or drag it with the mouse, holding Shift";

/// The widgets of what was picked; changes go into `edits`.
pub fn picked(ui: &mut Ui, picked: &Picked, lights: &[(String, Vec3)], edits: &mut Vec<Edit>) {
    match picked {
        Picked::Light(index, handle) => {
            if let Some((name, intensity)) = lights.get(*index as usize) {
                ui.label(format!("light {index} {name}"));
                number(ui, edits, "intensity", (Property::Intensity, *index), *intensity);
                number(ui, edits, "move, m", (Property::Move, handle.node), Vec3::ZERO).on_hover_text(DRAG);
            }
        }
        Picked::Surface(surface) => material(ui, surface, edits),
    }
}

fn material(ui: &mut Ui, surface: &Surface, edits: &mut Vec<Edit>) {
    let Surface { material_index, material, handle: Handle { node: node_index, .. }, node, triangle, distance } =
        surface;
    ui.label(format!("material {material_index} {}", material.name));
    ui.weak(format!("node {node_index} {node}, triangle {triangle}, {distance:.3} m away"));
    let index = *material_index;
    ui.horizontal(|ui| {
        let old = value(edits, (Property::Albedo, index), material.base_color.truncate());
        let mut color = old.to_array();
        ui.label("albedo");
        // The widget rounds what it is given, so only what the user did counts.
        if ui.color_edit_button_rgb(&mut color).changed() {
            put(edits, (Property::Albedo, index), Vec3::from_array(color).clamp(Vec3::ZERO, Vec3::ONE));
        }
    });
    for (label, property, now) in
        [("roughness", Property::Roughness, material.roughness), ("metallic", Property::Metallic, material.metallic)]
    {
        let old = value(edits, (property, index), Vec3::splat(now));
        let mut new = old.x;
        if ui.add(Slider::new(&mut new, 0.0..=1.0).text(label)).changed() {
            put(edits, (property, index), Vec3::splat(new));
        }
    }
    number(ui, edits, "emission", (Property::Emission, index), material.emission);
    number(ui, edits, "move, m", (Property::Move, *node_index), Vec3::ZERO).on_hover_text(DRAG);
}

/// Moves what was picked by so many metres in the world.
pub fn drag(handle: &Handle, metres: Vec3, edits: &mut Vec<Edit>) {
    let what = (Property::Move, handle.node);
    let moved = value(edits, what, Vec3::ZERO) + handle.parent_from_world * metres;
    if moved.abs().max_element() <= FARTHEST {
        put(edits, what, moved);
    }
}

/// All lights of the scene.
pub fn lights(ui: &mut Ui, lights: &[(String, Vec3)], edits: &mut Vec<Edit>) {
    if lights.is_empty() {
        return;
    }
    CollapsingHeader::new(format!("Lights ({})", lights.len())).show(ui, |ui| {
        for (index, (name, intensity)) in lights.iter().enumerate().take(MOST_LIGHTS) {
            number(ui, edits, &format!("{index} {name}"), (Property::Intensity, index as u32), *intensity);
        }
    });
}

/// Three numbers.
fn number(ui: &mut Ui, edits: &mut Vec<Edit>, label: &str, what: (Property, u32), now: Vec3) -> Response {
    let row = ui.horizontal(|ui| {
        ui.label(label);
        let old = value(edits, what, now);
        let mut new = old;
        let speed = f64::from(old.abs().max_element()).max(0.5) * 0.02;
        let least = if what.0 == Property::Move { -FARTHEST } else { 0.0 };
        for axis in 0..3 {
            let widget = DragValue::new(&mut new[axis]).range(least..=1e6).speed(speed);
            if ui.add(widget.max_decimals(3).update_while_editing(false)).changed() {
                put(edits, what, new);
            }
        }
    });
    row.response
}

/// The value as edited, else as it stands.
fn value(edits: &[Edit], (property, index): (Property, u32), now: Vec3) -> Vec3 {
    let edit = edits.iter().rev().find(|edit| edit.property == property && edit.index == index);
    edit.map_or(now, |edit| edit.value)
}

fn put(edits: &mut Vec<Edit>, (property, index): (Property, u32), value: Vec3) {
    edits.retain(|edit| edit.property != property || edit.index != index);
    edits.push(Edit { property, index, value });
}
