//! Plays a scene's clips: samples every channel at a time and composes the [`Pose`].
//!
//! All clips play at once, each looping by its own duration. Where two channels drive the same property of the same
//! node, the first in file order is taken ([`unplayed_channels`] names the others). Outside its keys a channel holds
//! its first or last value. Damaged tracks (too few values) leave the property at rest; nothing here panics.

use std::collections::HashSet;
use std::ops::{Add, Mul};

use glam::{Mat4, Quat, Vec3, Vec4};

use super::pose::{Pose, PoseLayout, rest_weights};
use super::{Channel, Interpolation, Scene, Track, Transform};

impl Pose {
    /// The scene `seconds` into its clips. A time that is not finite counts as 0.
    pub fn at(scene: &Scene, seconds: f32) -> Self {
        let seconds = if seconds.is_finite() { seconds } else { 0.0 };
        let mut local: Vec<Transform> = scene.nodes.iter().map(|node| node.transform).collect();
        let mut weights = rest_weights(scene);
        let layout = PoseLayout::of(scene);
        for (_, _, clip_seconds, channel) in played_channels(scene, seconds).filter(|channel| !channel.1) {
            let node = channel.node as usize;
            if let (Track::MorphWeights { target_count, .. }, Some(&first)) =
                (&channel.track, layout.weight_offset.get(node))
            {
                let count = (layout.weight_count[node] as usize).min(*target_count);
                let first = first as usize;
                sample_weights(channel, clip_seconds, &mut weights[first..first + count]);
            } else if let Some(transform) = local.get_mut(node) {
                animate(transform, channel, clip_seconds);
            }
        }
        Self::compose(scene, seconds, &local, weights)
    }
}

/// One sentence for each channel that does not play because an earlier one drives the same property.
pub fn unplayed_channels(scene: &Scene) -> Vec<String> {
    let mut notes = Vec::new();
    for (clip, _, _, channel) in played_channels(scene, 0.0).filter(|channel| channel.1) {
        let node = scene.nodes.get(channel.node as usize).map_or("", |node| node.name.as_str());
        notes.push(format!(
            "Clip {clip} ({:?}) does not play the {} of node {} ({node:?}): an earlier channel drives it.",
            scene.clips[clip].name,
            channel.track.property(),
            channel.node,
        ));
    }
    notes
}

/// Every channel as (clip index, is it overridden by an earlier one, seconds into its clip, channel).
fn played_channels(scene: &Scene, seconds: f32) -> impl Iterator<Item = (usize, bool, f32, &Channel)> {
    let mut driven = HashSet::new();
    let channels = scene.clips.iter().enumerate().flat_map(move |(index, clip)| {
        let clip_seconds = if clip.duration > 0.0 { seconds.rem_euclid(clip.duration) } else { 0.0 };
        clip.channels.iter().map(move |channel| (index, clip_seconds, channel))
    });
    channels.map(move |(index, clip_seconds, channel)| {
        let first = driven.insert((channel.node, channel.track.property()));
        (index, !first, clip_seconds, channel)
    })
}

impl Track {
    /// What the track drives, in glTF's word.
    pub fn property(&self) -> &'static str {
        match self {
            Self::Translation(_) => "translation",
            Self::Rotation(_) => "rotation",
            Self::Scale(_) => "scale",
            Self::MorphWeights { .. } => "weights",
        }
    }
}

fn animate(transform: &mut Transform, channel: &Channel, seconds: f32) {
    let (mut translation, mut rotation, mut scale) = parts(transform);
    match &channel.track {
        Track::Translation(values) => {
            translation = sample(channel, seconds, |key| values.get(key).copied(), Vec3::lerp).unwrap_or(translation);
        }
        Track::Scale(values) => {
            scale = sample(channel, seconds, |key| values.get(key).copied(), Vec3::lerp).unwrap_or(scale);
        }
        Track::Rotation(values) => {
            let value = |key| values.get(key).map(|&quat| Vec4::from(quat));
            let slerp = |a: Vec4, b: Vec4, t| Vec4::from(unit(a).slerp(unit(b), t));
            rotation = sample(channel, seconds, value, slerp).map_or(rotation, unit);
        }
        Track::MorphWeights { .. } => return,
    }
    *transform = Transform::Trs { translation, rotation, scale };
}

/// Translation, rotation, scale. glTF allows no animated matrix node; one is decomposed all the same.
fn parts(transform: &Transform) -> (Vec3, Quat, Vec3) {
    match *transform {
        Transform::Trs { translation, rotation, scale } => (translation, rotation, scale),
        Transform::Matrix(matrix) => decompose(matrix),
    }
}

fn decompose(matrix: Mat4) -> (Vec3, Quat, Vec3) {
    let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
    let rotation = if rotation.is_finite() { unit(rotation.into()) } else { Quat::IDENTITY };
    (translation, rotation, scale)
}

/// A quaternion (x, y, z, w) made unit; the identity where that cannot be.
fn unit(quat: Vec4) -> Quat {
    quat.try_normalize().map_or(Quat::IDENTITY, Quat::from_vec4)
}

fn sample_weights(channel: &Channel, seconds: f32, weights: &mut [f32]) {
    let Track::MorphWeights { target_count, weights: values } = &channel.track else { return };
    for (target, weight) in weights.iter_mut().enumerate() {
        let value = |key: usize| values.get(key * target_count + target).copied();
        if let Some(sampled) = sample(channel, seconds, value, |a, b, t| a + (b - a) * t) {
            *weight = sampled;
        }
    }
}

/// The channel's value at `seconds`. `value` gives the track's entry at a position (a key, or for CUBICSPLINE one of
/// the three of a key); `linear` mixes two values for LINEAR.
fn sample<T>(
    channel: &Channel,
    seconds: f32,
    value: impl Fn(usize) -> Option<T>,
    linear: impl Fn(T, T, f32) -> T,
) -> Option<T>
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    let times = &channel.times;
    let key = times.partition_point(|&time| time <= seconds).saturating_sub(1);
    let (start, end) = (*times.get(key)?, times.get(key + 1).copied().unwrap_or(seconds));
    let step = end - start;
    // Before the first key, at or after the last, and exactly on a key there is nothing to mix.
    let t = if step > 0.0 { ((seconds - start) / step).clamp(0.0, 1.0) } else { 0.0 };
    let has_next = key + 1 < times.len() && t > 0.0;
    match channel.interpolation {
        Interpolation::Step => value(key),
        Interpolation::Linear if has_next => Some(linear(value(key)?, value(key + 1)?, t)),
        Interpolation::Linear => value(key),
        Interpolation::CubicSpline if has_next => {
            let (v0, out_tangent) = (value(3 * key + 1)?, value(3 * key + 2)?);
            let (in_tangent, v1) = (value(3 * key + 3)?, value(3 * key + 4)?);
            Some(hermite(v0, out_tangent, in_tangent, v1, t, step))
        }
        Interpolation::CubicSpline => value(3 * key + 1),
    }
}

/// The cubic of the glTF 2.0 specification, appendix C.5: tangents are per second, `step` is the seconds between keys.
fn hermite<T>(v0: T, out_tangent: T, in_tangent: T, v1: T, t: f32, step: f32) -> T
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    let (t2, t3) = (t * t, t * t * t);
    v0 * (2.0 * t3 - 3.0 * t2 + 1.0)
        + out_tangent * (step * (t3 - 2.0 * t2 + t))
        + v1 * (3.0 * t2 - 2.0 * t3)
        + in_tangent * (step * (t3 - t2))
}
