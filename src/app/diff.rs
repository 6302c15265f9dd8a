//! `linklight diff A B`: the error figures of picture A against reference B, optionally as a test with limits.

use std::io::Write;
use std::path::Path;
use std::str::FromStr;

use serde_json::{Value, json};

use super::AppError;
use super::cli::{DiffArgs, HeatMap};
use super::values::extension;
use crate::methods::settings::suggest;
use crate::report::errors::{ErrorFigures, compare};
use crate::report::image::{self, Metadata, Picture};
use crate::report::tonemap::ToneSettings;
use crate::report::{heat_map, write};

/// A figure of the listing, by the name that `--fail-above` takes.
pub struct Figure {
    pub name: &'static str,
    pub doc: &'static str,
    /// As printed; `None` is undefined.
    pub value: fn(&ErrorFigures) -> Option<f64>,
    /// What a limit is held against: 0 is perfect, more is worse.
    error: fn(&ErrorFigures) -> Option<f64>,
}

pub const FIGURES: [Figure; 7] = [
    Figure { name: "rmse", doc: "root mean square error of radiance", value: rmse, error: rmse },
    Figure { name: "relmse", doc: "relative mean square error", value: |f| f.relative_mse, error: |f| f.relative_mse },
    Figure {
        name: "energy",
        doc: "mean of A over mean of B",
        value: |f| f.mean_ratio,
        error: |f| f.mean_ratio.map(|ratio| (ratio - 1.0).abs()),
    },
    Figure {
        name: "p95",
        doc: "95th percentile of the relative error",
        value: |f| f.relative_error_p95,
        error: |f| f.relative_error_p95,
    },
    Figure { name: "ssim", doc: "structural similarity", value: |f| Some(f.ssim), error: |f| Some(1.0 - f.ssim) },
    Figure { name: "flip", doc: "mean FLIP error", value: |f| Some(f.flip_mean), error: |f| Some(f.flip_mean) },
    Figure {
        name: "flip-p95",
        doc: "95th percentile of the FLIP error",
        value: |f| Some(f.flip_p95),
        error: |f| Some(f.flip_p95),
    },
];

fn rmse(figures: &ErrorFigures) -> Option<f64> {
    Some(figures.rmse)
}

/// One `--fail-above FIGURE=LIMIT`.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Index into the figures.
    figure: usize,
    limit: f64,
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, limit) = text.split_once('=').ok_or("expected FIGURE=LIMIT, such as relmse=0.01")?;
        let names = FIGURES.map(|figure| figure.name);
        let figure = names
            .iter()
            .position(|known| *known == name)
            .ok_or_else(|| format!("there is no figure {name:?}; {}", suggest(name, &names)))?;
        match limit.parse::<f64>() {
            Ok(limit) if limit.is_finite() && limit >= 0.0 => Ok(Self { figure, limit }),
            _ => Err(format!("the limit {limit:?} is not a number of at least 0")),
        }
    }
}

pub fn run(args: &DiffArgs, out: &mut dyn Write) -> Result<(), AppError> {
    if let Some(output) = &args.output {
        if extension(output) != "png" {
            return Err(AppError::Usage(format!("the heat map {} must end in .png", output.display())));
        }
        write::check_writable(output)?;
    }
    let picture = read(&args.picture, args.layer.as_deref())?;
    let reference = read(&args.reference, args.layer.as_deref())?;
    let mask = args.mask.as_deref().map(image::read).transpose()?;
    let tone = ToneSettings { operator: args.tonemap, exposure: args.exposure, ..ToneSettings::default() };
    let comparison = compare(&picture, &reference, mask.as_ref(), &tone)?;

    if let Some(output) = &args.output {
        let map = match args.map {
            HeatMap::Flip => &comparison.flip_map,
            HeatMap::Relative => &comparison.relative_map,
        };
        let names = [("picture", &args.picture), ("reference", &args.reference)];
        let mut metadata: Metadata =
            names.iter().map(|(key, path)| ((*key).to_owned(), path.display().to_string())).collect();
        metadata.insert("Software".to_owned(), "linklight".to_owned());
        image::write_png(output, reference.width, reference.height, &heat_map::to_bytes(map), &metadata)?;
    }

    let figures = &comparison.figures;
    let exceeded: Vec<&Limit> = args.fail_above.iter().filter(|limit| is_above(limit, figures)).collect();
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&to_json(args, figures))?)?;
    } else {
        writeln!(out, "{:<10} {:<12} compared of {}x{}", "pixels", figures.pixels, reference.width, reference.height)?;
        for figure in &FIGURES {
            writeln!(out, "{:<10} {:<12} {}", figure.name, number((figure.value)(figures)), figure.doc)?;
        }
    }
    if exceeded.is_empty() {
        return Ok(());
    }
    let complaints: Vec<String> = exceeded.iter().map(|limit| complaint(limit, figures)).collect();
    Err(AppError::AboveLimit(format!("{} differs too much: {}", args.picture.display(), complaints.join("; "))))
}

/// The picture itself, or one of its layers in place of its RGB.
fn read(path: &Path, layer: Option<&str>) -> Result<Picture, AppError> {
    let picture = image::read(path)?;
    let Some(layer) = layer else { return Ok(picture) };
    let Some(rgb) = picture.layer(layer) else {
        let names = picture.layer_names();
        let known = if names.is_empty() { "it has no layers".to_owned() } else { suggest(layer, &names) };
        return Err(AppError::failed(format!("{} has no layer {layer:?} of three channels; {known}", path.display())));
    };
    Ok(Picture::new(picture.width, picture.height, rgb)?)
}

/// An undefined figure (black reference) is above every limit: it is never good.
pub fn is_above(limit: &Limit, figures: &ErrorFigures) -> bool {
    (FIGURES[limit.figure].error)(figures).is_none_or(|error| error > limit.limit)
}

pub fn complaint(limit: &Limit, figures: &ErrorFigures) -> String {
    let figure = &FIGURES[limit.figure];
    match (figure.error)(figures) {
        Some(error) => format!("{} {} is above {}", figure.name, number(Some(error)), limit.limit),
        None => format!("{} is undefined (the reference is black)", figure.name),
    }
}

pub fn number(value: Option<f64>) -> String {
    match value {
        None => "undefined".to_owned(),
        Some(value) if value != 0.0 && !(1e-4..1e6).contains(&value.abs()) => format!("{value:.5e}"),
        Some(value) => format!("{value:.6}"),
    }
}

/// Figures and limits; `version` changes when a field changes its meaning.
fn to_json(args: &DiffArgs, figures: &ErrorFigures) -> Value {
    let values: serde_json::Map<String, Value> =
        FIGURES.iter().map(|figure| (figure.name.to_owned(), json!((figure.value)(figures)))).collect();
    let limits: Vec<Value> = args
        .fail_above
        .iter()
        .map(|limit| {
            let figure = &FIGURES[limit.figure];
            let (error, above) = ((figure.error)(figures), is_above(limit, figures));
            json!({ "figure": figure.name, "error": error, "limit": limit.limit, "above": above })
        })
        .collect();
    json!({
        "schema": "linklight-diff", "version": 1,
        "picture": args.picture, "reference": args.reference, "layer": args.layer, "mask": args.mask,
        "pixels": figures.pixels, "figures": values, "limits": limits,
    })
}
