//! Animations: channels that move nodes or morph weights over time.

use super::accessor::{Accessor, Component, Selection};
use super::document::Document;
use super::error::Fault;
use super::json::{List, Object};
use super::node::{Tree, unit_rotation};
use crate::scene::{Channel, Clip, Interpolation, Track};
use glam::{Quat, Vec3};
use std::collections::HashSet;

const FLOAT: [(Component, bool); 1] = [(Component::F32, false)];
const FLOAT_OR_NORMALIZED: [(Component, bool); 5] = [
    (Component::F32, false),
    (Component::I8, true),
    (Component::U8, true),
    (Component::I16, true),
    (Component::U16, true),
];

/// Reads one animation: the channels that move something in `tree`. `target_count` gives the morph targets of the
/// file's nodes. A channel that cannot be played is left out with a note; `None` when nothing is left.
pub fn read(
    document: &Document,
    object: &Object,
    tree: &Tree,
    target_count: impl Fn(usize) -> usize,
) -> Result<Option<Clip>, Fault> {
    let samplers = object.list("samplers")?;
    let mut clip = Clip { name: object.name(), ..Clip::default() };
    let mut moved = HashSet::new();
    for channel in object.list("channels")?.objects() {
        let channel = channel?;
        let read = read_channel(document, &channel, &samplers, tree, &target_count, &mut moved);
        let Some(channel) = document.tolerate("An animation channel", read)?.flatten() else { continue };
        clip.duration = clip.duration.max(channel.times.last().copied().unwrap_or(0.0));
        clip.channels.push(channel);
    }
    Ok(Some(clip).filter(|clip| !clip.channels.is_empty()))
}

/// `None` when the channel moves nothing of the scene.
fn read_channel<'a>(
    document: &Document,
    channel: &Object<'a>,
    samplers: &List,
    tree: &Tree,
    target_count: impl Fn(usize) -> usize,
    moved: &mut HashSet<(u32, &'a str)>,
) -> Result<Option<Channel>, Fault> {
    let target = channel.require("target", channel.object("target")?)?;
    let sampler = channel.require("sampler", channel.index("sampler", "samplers", samplers.len())?)?;
    let path = target.require("path", target.text("path")?)?;
    let Some(file_node) = target.index("node", "nodes", tree.index_of.len())? else {
        document.notes.say("Animation channels that name no node were left out.");
        return Ok(None);
    };
    let Some(node) = tree.index_of[file_node] else { return Ok(None) };
    let targets = target_count(file_node);
    if path == "weights" && targets == 0 {
        return Err(target.invalid("node", "must name a node with morph targets where the path is weights"));
    }
    if !moved.insert((node, path)) {
        return Err(target.invalid("path", "must not be one that another channel of the animation moves already"));
    }
    let (times, interpolation, track) = read_sampler(document, &samplers.object(sampler)?, &target, path, targets)?;
    Ok(Some(Channel { node, interpolation, times, track }))
}

/// The keys of a sampler that moves `path` of `target`.
fn read_sampler(
    document: &Document,
    sampler: &Object,
    target: &Object,
    path: &str,
    target_count: usize,
) -> Result<(Vec<f32>, Interpolation, Track), Fault> {
    let interpolation = match sampler.text("interpolation")?.unwrap_or("LINEAR") {
        "STEP" => Interpolation::Step,
        "LINEAR" => Interpolation::Linear,
        "CUBICSPLINE" => Interpolation::CubicSpline,
        _ => return Err(sampler.invalid("interpolation", "must be STEP, LINEAR or CUBICSPLINE")),
    };
    let input = sampler.require("input", Accessor::open(document, sampler, "input")?)?;
    let output = sampler.require("output", Accessor::open(document, sampler, "output")?)?;
    input.expect("animation input", &["SCALAR"], &FLOAT)?;
    let values_per_key = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let weights_per_value = if path == "weights" { target_count } else { 1 };
    let value_count = (input.count as u64).saturating_mul(values_per_key).saturating_mul(weights_per_value as u64);
    if output.count as u64 != value_count {
        let rule = format!("must hold {value_count} values for the {} keys of {}", input.count, sampler.pointer());
        return Err(Fault::invalid(format!("{}/count", output.pointer), rule, output.count));
    }

    let track = match path {
        "translation" => {
            output.expect("translation", &["VEC3"], &FLOAT)?;
            Track::Translation(output.read(document, Selection::All, Vec3::from_array)?)
        }
        "scale" => {
            output.expect("scale", &["VEC3"], &FLOAT)?;
            Track::Scale(output.read(document, Selection::All, Vec3::from_array)?)
        }
        "rotation" => {
            output.expect("rotation", &["VEC4"], &FLOAT_OR_NORMALIZED)?;
            let mut rotations = output.read(document, Selection::All, Quat::from_array)?;
            // Of a cubic key's three entries only the middle one is a rotation; the others are its rates.
            let (first, step) = if values_per_key == 3 { (1, 3) } else { (0, 1) };
            for rotation in rotations.iter_mut().skip(first).step_by(step) {
                *rotation = unit_rotation(rotation.to_array()).unwrap_or_else(|| {
                    document.notes.say("An animated rotation of length zero was taken as no rotation.");
                    Quat::IDENTITY
                });
            }
            Track::Rotation(rotations)
        }
        "weights" => {
            output.expect("morph weights", &["SCALAR"], &FLOAT_OR_NORMALIZED)?;
            let weights = output.read(document, Selection::All, |[weight]: [f32; 1]| weight)?;
            Track::MorphWeights { target_count, weights }
        }
        _ => return Err(target.invalid("path", "must be translation, rotation, scale or weights")),
    };
    let times = input.read(document, Selection::All, |[time]: [f32; 1]| time)?;
    let mut before = -1.0;
    for (key, time) in times.iter().enumerate() {
        if *time < 0.0 || *time <= before {
            let seen = format!("{time} s in element {key}");
            return Err(Fault::invalid(&input.pointer, "animation times must not be negative and must increase", seen));
        }
        before = *time;
    }
    Ok((times, interpolation, track))
}
