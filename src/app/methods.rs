//! `linklight methods`: every method with its paper and its settings, and the settings of display stages.

use std::io::Write;

use serde_json::{Value, json};

use super::cli::MethodsArgs;
use super::{AppError, views};
use crate::display::final_gather;
use crate::methods::METHODS;
use crate::methods::settings::{Kind, SettingGroup as _, Spec};

pub fn run(args: &MethodsArgs, out: &mut dyn Write) -> Result<(), AppError> {
    if args.views {
        return views::list(out);
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&to_json()?)?)?;
        return Ok(());
    }
    for (index, method) in METHODS.iter().enumerate() {
        let paper = method.paper;
        let separator = if index == 0 { "" } else { "\n" };
        writeln!(out, "{separator}{}: {}", method.key, method.summary)?;
        writeln!(out, "  {}. {}. {}, {}.", paper.authors, paper.title, paper.venue, paper.year)?;
        if let Some(doi) = paper.doi {
            writeln!(out, "  https://doi.org/{doi}")?;
        }
        for spec in method.specs() {
            write_setting(&spec, out)?;
        }
    }
    writeln!(out, "\n--display final-gather: gathers from the method's solution at every pixel, with visibility")?;
    for spec in final_gather::Settings::specs() {
        write_setting(&spec, out)?;
    }
    Ok(())
}

fn write_setting(spec: &Spec, out: &mut dyn Write) -> Result<(), AppError> {
    let default = match &spec.default {
        Value::String(name) => name.clone(),
        value => value.to_string(),
    };
    let unit = if spec.unit.is_empty() { String::new() } else { format!(" {}", spec.unit) };
    writeln!(out, "    --set {}={default}", spec.name)?;
    writeln!(out, "        {}", spec.doc)?;
    match &spec.kind {
        Kind::Choice { values } => {
            for value in values {
                writeln!(out, "        {}: {}", value.name, value.doc)?;
            }
        }
        kind => writeln!(out, "        {kind}{unit}")?,
    }
    writeln!(out, "        paper: {}", spec.paper)?;
    Ok(())
}

fn to_json() -> Result<Value, AppError> {
    let mut methods = Vec::with_capacity(METHODS.len());
    for method in METHODS {
        methods.push(json!({
            "key": method.key,
            "summary": method.summary,
            "paper": serde_json::to_value(method.paper)?,
            "settings": serde_json::to_value(method.specs())?,
        }));
    }
    let displays =
        json!([{ "key": "final-gather", "settings": serde_json::to_value(final_gather::Settings::specs())? }]);
    Ok(json!({ "schema": "linklight-methods", "version": 1, "methods": methods, "displays": displays }))
}
