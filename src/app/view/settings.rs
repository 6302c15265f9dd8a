//! A widget for every setting, made from its declaration.

use egui::{ComboBox, DragValue, TextEdit, Ui};
use serde_json::Value;

use crate::methods::settings::{Assignment, Kind, Spec};

/// A row per setting of `specs`; what the user chooses is put into `assignments`, the default taken out.
pub fn rows(ui: &mut Ui, specs: &[Spec], assignments: &mut Vec<Assignment>) {
    for spec in specs {
        let default = text(&spec.default);
        let given = assignments.iter().rev().find(|assignment| assignment.key == spec.name);
        let old = given.map_or_else(|| default.clone(), |assignment| assignment.value.clone());
        ui.horizontal(|ui| {
            let about =
                format!("{}\n\n{} {}\ndefault {default}; paper: {}", spec.doc, spec.kind, spec.unit, spec.paper);
            ui.label(spec.name.replace('_', " ")).on_hover_text(about);
            let new = widget(ui, spec, &old);
            if new != old {
                assignments.retain(|assignment| assignment.key != spec.name);
                if new != default {
                    assignments.push(Assignment { key: spec.name.to_owned(), value: new });
                }
            }
        });
    }
}

fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// The value after this frame.
fn widget(ui: &mut Ui, spec: &Spec, old: &str) -> String {
    match &spec.kind {
        Kind::Bool => {
            let mut on = matches!(old, "true" | "on" | "yes" | "1");
            ui.checkbox(&mut on, "");
            on.to_string()
        }
        Kind::Int { min, max } => {
            let mut number = old.parse().unwrap_or(*min);
            let speed = f64::from(number).abs().max(8.0) * 0.02;
            ui.add(DragValue::new(&mut number).range(*min..=*max).speed(speed).update_while_editing(false));
            number.to_string()
        }
        Kind::Float { min, max } => {
            let mut number: f32 = old.parse().unwrap_or(*min);
            let before = number;
            let speed = f64::from(number.abs().max(0.01)) * 0.02;
            ui.add(
                DragValue::new(&mut number).range(*min..=*max).speed(speed).max_decimals(6).update_while_editing(false),
            );
            // Untouched values keep their spelling.
            if number == before { old.to_owned() } else { number.to_string() }
        }
        Kind::Choice { values } => {
            let mut chosen = old.to_owned();
            ComboBox::from_id_salt(spec.name).selected_text(old).show_ui(ui, |ui| {
                for value in values {
                    ui.selectable_value(&mut chosen, value.name.to_owned(), value.name).on_hover_text(value.doc);
                }
            });
            chosen
        }
        Kind::Text { .. } => {
            // Taken when the user is done with it.
            let id = ui.id().with(("setting", spec.name));
            let mut draft = ui.data_mut(|data| data.get_temp::<String>(id)).unwrap_or_else(|| old.to_owned());
            let response = ui.add(TextEdit::singleline(&mut draft).desired_width(80.0));
            if response.has_focus() {
                ui.data_mut(|data| data.insert_temp(id, draft));
                return old.to_owned();
            }
            ui.data_mut(|data| data.remove::<String>(id));
            if response.lost_focus() { draft } else { old.to_owned() }
        }
    }
}
