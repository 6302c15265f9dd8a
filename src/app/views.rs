//! Debug views: what a picture can show in place of light, as one table.
//!
//! Methods and display stages declare their views as values of a setting; `--view NAME` sets it, `linklight methods
//! --views` lists all. Views of one element take it from the setting `pick`, an element's number or a pixel.

use std::io::Write;

use super::AppError;
use super::cli::{Display, PictureArgs};
use super::render::{RenderRequest, displays};
use crate::display::final_gather;
use crate::gpu::Context;
use crate::methods::settings::{Assignment, ChoiceValue, Kind, SettingGroup as _, Spec, suggest};
use crate::methods::{METHODS, Method};
use crate::stages::film::Film;
use glam::Vec3;

/// Settings whose values are views; the default is light.
const VIEW_SETTINGS: [&str; 3] = ["view", "show", "gather_shows"];

/// One view, and the setting that asks for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DebugView {
    pub setting: &'static str,
    pub value: ChoiceValue,
}

/// Those of a method, seen through a display stage of its own.
pub fn of_method(method: &Method) -> Vec<DebugView> {
    among(&method.specs())
}

/// Those of the per-pixel final gather, whatever it gathers from.
pub fn of_final_gather() -> Vec<DebugView> {
    among(&final_gather::Settings::specs())
}

fn among(specs: &[Spec]) -> Vec<DebugView> {
    let mut views = Vec::new();
    for spec in specs.iter().filter(|spec| VIEW_SETTINGS.contains(&spec.name)) {
        let Kind::Choice { values } = &spec.kind else { continue };
        let others = values.iter().filter(|value| spec.default != value.name);
        views.extend(others.map(|&value| DebugView { setting: spec.name, value }));
    }
    views
}

/// The view that every method and display has: of the film, whatever made it.
pub const BAD_VALUES: ChoiceValue =
    ChoiceValue { name: "bad-values", doc: "NaN magenta, infinite yellow, negative blue; all else gray" };

/// Puts the setting that `--view` stands for in its place; the view of the film has none, and stays.
pub fn resolve(args: &mut PictureArgs) -> Result<(), AppError> {
    if shows_bad_values(args) {
        return Ok(());
    }
    let Some(name) = args.view.take() else { return Ok(()) };
    let display = displays(args.method).first().map(|&default| args.display.unwrap_or(default));
    // A gather shows no colours of elements, and nothing else shows cuts.
    let (views, of) = match display {
        Some(Display::FinalGather) => {
            let mut views = of_final_gather();
            // Pictures of the atlas need no display.
            if args.method.key == "surface-shadow-maps" {
                views.extend(of_method(args.method));
            }
            (views, "--display final-gather")
        }
        _ => (of_method(args.method), args.method.key),
    };
    if let Some(view) = views.iter().find(|view| view.value.name == name) {
        args.set.push(Assignment { key: view.setting.to_owned(), value: name });
        return Ok(());
    }
    let names: Vec<&str> = views.iter().map(|view| view.value.name).collect();
    let hint = if names.is_empty() { "it has none".to_owned() } else { suggest(&name, &names) };
    Err(AppError::Usage(format!("{of} has no view {name:?}; {hint} (linklight methods --views lists all)")))
}

/// Whether the view of the film is asked for.
pub fn shows_bad_values(args: &PictureArgs) -> bool {
    args.view.as_deref() == Some(BAD_VALUES.name)
}

/// Paints a film by what is wrong with its values.
pub fn paint_bad_values(context: &Context, film: &Film) -> Result<(), AppError> {
    let (direct, indirect) = (context.download(&film.direct)?, context.download(&film.indirect)?);
    let mean = direct.iter().zip(&indirect).map(|(d, i)| (*d + *i).element_sum()).filter(|sum| sum.is_finite());
    let mean = mean.sum::<f32>() / (3 * direct.len().max(1)) as f32;
    let colors: Vec<Vec3> = direct.iter().zip(&indirect).map(|(&d, &i)| color_of(d, i, mean)).collect();
    context.write(&film.direct, &colors)?;
    Ok(context.write(&film.indirect, &vec![Vec3::ZERO; colors.len()])?)
}

/// The colour of a pixel in a picture of that mean.
fn color_of(direct: Vec3, indirect: Vec3, mean: f32) -> Vec3 {
    let both = [direct, indirect];
    if both.iter().any(|value| value.is_nan()) {
        Vec3::new(1.0, 0.0, 1.0)
    } else if both.iter().any(|value| !value.is_finite()) {
        Vec3::new(1.0, 1.0, 0.0)
    } else if both.iter().any(|value| value.min_element() < 0.0) {
        Vec3::new(0.0, 0.2, 1.0)
    } else {
        let shown = ((direct + indirect).element_sum() / (3.0 * mean.max(1e-30))).min(1e6);
        Vec3::splat(0.25 * shown / (1.0 + shown))
    }
}

/// Whether a picture shows a view in place of light.
pub fn is_shown(request: &RenderRequest) -> bool {
    if request.shows_bad_values {
        return true;
    }
    let views = of_method(request.method).into_iter().chain(of_final_gather());
    let mut asked = request.assignments.iter().chain(&request.display_assignments);
    let names: Vec<DebugView> = views.collect();
    asked.any(|set| names.iter().any(|view| view.setting == set.key && view.value.name == set.value))
}

/// Every view with what it shows.
pub fn list(out: &mut dyn Write) -> Result<(), AppError> {
    for method in METHODS {
        write(out, method.key, &of_method(method))?;
    }
    write(out, "--display final-gather", &of_final_gather())?;
    write(out, "every method and display", &[DebugView { setting: "", value: BAD_VALUES }])
}

fn write(out: &mut dyn Write, owner: &str, views: &[DebugView]) -> Result<(), AppError> {
    if !views.is_empty() {
        writeln!(out, "{owner}")?;
    }
    for DebugView { value, .. } in views {
        writeln!(out, "    --view {:16} {}", value.name, value.doc)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::app::cli::{Cli, Command};
    use crate::app::values::{Format, Output};

    fn request(options: &str) -> Result<RenderRequest, String> {
        let line = format!("linklight view builtin:maze {options}");
        let cli = Cli::try_parse_from(line.split_whitespace()).map_err(|error| error.to_string())?;
        let Command::View(args) = cli.command else { return Err("no view".into()) };
        let output = Output { path: "a.png".into(), format: Format::Png };
        RenderRequest::of_picture(&args.picture, output).map_err(|error| error.to_string())
    }

    #[test]
    fn a_view_is_the_setting_it_stands_for() {
        let mut count = 0;
        for method in METHODS {
            for view in of_method(method) {
                let name = view.value.name;
                let by_name = request(&format!("--method {} --view {name}", method.key)).unwrap();
                let by_setting = request(&format!("--method {} --set {}={name}", method.key, view.setting)).unwrap();
                assert_eq!(by_name.assignments, by_setting.assignments);
                assert_ne!(by_name.assignments, request(&format!("--method {}", method.key)).unwrap().assignments);
                count += 1;
            }
        }
        assert!(count >= 10, "{count} views of methods");
        let gather = request("--display final-gather --view cut-size").unwrap();
        assert_eq!(
            gather.display_assignments,
            request("--display final-gather --set gather_shows=cut-size").unwrap().display_assignments
        );
    }

    #[test]
    fn what_is_no_view_is_refused_with_those_there_are() {
        let refused = |options: &str| request(options).unwrap_err();
        assert!(refused("--method path-tracing --view charts").contains("has none"), "path tracing has no views");
        assert!(refused("--method implicit-visibility --view chart").contains("charts"));
        assert!(refused("--method implicit-visibility --display final-gather --view charts").contains("cut-size"));
        assert!(refused("--method antiradiance --view radiance").contains("no view"), "light is no debug view");
    }

    #[test]
    fn bad_values_are_told_apart_whatever_the_method() {
        let good = Vec3::splat(0.5);
        let colors = [
            color_of(Vec3::new(1.0, f32::NAN, -1.0), good, 1.0),
            color_of(good, Vec3::new(f32::INFINITY, 0.0, 0.0), 1.0),
            color_of(good, Vec3::new(0.0, -1e-20, 0.0), 1.0),
        ];
        let gray = |color: Vec3| color.x == color.y && color.y == color.z && color.is_finite();
        assert!(colors.iter().all(|color| !gray(*color)) && colors[0] != colors[1] && colors[1] != colors[2]);
        assert!([Vec3::ZERO, good, Vec3::splat(1e30)].iter().all(|&value| gray(color_of(value, good, 0.0))));
        for method in METHODS {
            assert!(request(&format!("--method {} --view bad-values", method.key)).unwrap().shows_bad_values);
        }
        assert!(!request("").unwrap().shows_bad_values);
    }

    #[test]
    fn the_list_has_every_view() {
        let mut text = Vec::new();
        list(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        for name in [
            "charts",
            "bins",
            "antiradiance",
            "residual",
            "elements",
            "cut-size",
            "link-age",
            "links-in",
            "links-out",
            "bad-values",
            "depth-map",
            "traversal-order",
        ] {
            assert!(text.contains(&format!("--view {name} ")), "{name} in\n{text}");
        }
    }
}
