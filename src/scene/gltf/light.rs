//! KHR_lights_punctual: point, spot and directional lights.

use super::document::Document;
use super::error::Fault;
use super::json::{List, Object};
use crate::scene::{Light, LightKind};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

pub const EXTENSION: &str = "KHR_lights_punctual";

/// The lights that nodes refer to.
pub fn list<'a>(document: &Document<'a>) -> Result<List<'a>, Fault> {
    match document.root.extension(EXTENSION)? {
        Some(extension) => extension.list("lights"),
        None => Ok(List::default()),
    }
}

/// The light a node refers to.
pub fn of_node(node: &Object, lights: &List) -> Result<Option<usize>, Fault> {
    let Some(extension) = node.extension(EXTENSION)? else { return Ok(None) };
    extension.require("light", extension.index("light", "lights", lights.len())?).map(Some)
}

/// Reads one light; `None` where its kind is unknown, which is noted.
pub fn read(document: &Document, object: &Object) -> Result<Option<Light>, Fault> {
    let kind = match object.require("type", object.text("type")?)? {
        "point" => LightKind::Point,
        "directional" => LightKind::Directional,
        "spot" => read_spot(document, object)?,
        _ => {
            let pointer = object.pointer();
            document.notes.say(format!("{pointer} is not a point, spot or directional light and was left out."));
            return Ok(None);
        }
    };
    let color = Vec3::from(object.numbers("color")?.unwrap_or([1.0; 3]));
    let intensity = object.number_or("intensity", 1.0)?;
    if color.min_element() < 0.0 || intensity < 0.0 {
        document.notes.say(format!("{} has a negative colour or intensity, taken as zero.", object.pointer()));
    }
    let intensity = (color.max(Vec3::ZERO) * intensity.max(0.0)).min(Vec3::splat(f32::MAX));
    // A directional light has no place to measure a range from.
    let range = object.number("range")?.filter(|_| kind != LightKind::Directional);
    if range.is_some_and(|range| range <= 0.0) {
        document.notes.say(format!("{} has a range that is not positive, taken as unlimited.", object.pointer()));
    }
    Ok(Some(Light { name: object.name(), kind, intensity, range: range.filter(|range| *range > 0.0) }))
}

fn read_spot(document: &Document, object: &Object) -> Result<LightKind, Fault> {
    let spot = object.object("spot")?;
    let angle = |key, default| spot.as_ref().map_or(Ok(default), |spot| spot.number_or(key, default));
    let (inner, outer) = (angle("innerConeAngle", 0.0)?, angle("outerConeAngle", FRAC_PI_4)?);
    let is_sound = (0.0..outer).contains(&inner) && outer <= FRAC_PI_2;
    if spot.is_none() || !is_sound {
        let pointer = object.pointer();
        let note = format!("{pointer} lacks cone angles with 0 <= inner < outer <= pi/2; the nearest such were taken.");
        document.notes.say(note);
    }
    let outer_angle = outer.clamp(1e-3, FRAC_PI_2);
    // The two differ, so that the falloff between them never divides by zero.
    Ok(LightKind::Spot { inner_angle: inner.clamp(0.0, outer_angle * 0.999), outer_angle })
}
