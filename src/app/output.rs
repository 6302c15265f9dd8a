//! What a render leaves behind: the picture with its metadata, the profile, the trace, the table of passes.

use std::io::Write;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::AppError;
use super::cli::Channel;
use super::measure;
use super::render::RenderRequest;
use super::values::Format;
use crate::display::tone_map::LightParts;
use crate::gpu::{self, Context};
use crate::report::image::{self, Metadata, Picture};
use crate::report::pass_hashes::{self, HashFile, PassHash};
use crate::report::profile::{Profile, SceneFacts};
use crate::report::table;
use crate::report::trace::{self, TimeLine};
use crate::stages::film::Film;

/// Write the picture as the request asks: radiance and channels as .exr, tone-mapped as .png. The settings, the scene
/// and the device are stored in it.
pub fn write_picture(request: &RenderRequest, mut picture: Picture, device: &gpu::DeviceInfo) -> Result<(), AppError> {
    picture.metadata = metadata(request, device)?;
    let bad = picture.rgb.iter().filter(|pixel| !pixel.is_finite()).count();
    if bad > 0 {
        tracing::warn!("{bad} of {} pixels are NaN or infinite (magenta in a .png)", picture.rgb.len());
    }
    let path = &request.output.path;
    match request.output.format {
        Format::Exr => image::write_exr(path, &picture)?,
        Format::Png => {
            let shown = request.tone.fit(&picture.rgb).to_bytes(&picture.rgb);
            image::write_png(path, picture.width, picture.height, &shown.bytes, &picture.metadata)?;
        }
    }
    Ok(())
}

/// Reads the film back: the light asked for as RGB, and the extra channels.
pub fn picture(context: &Context, request: &RenderRequest, film: &Film) -> Result<Picture, AppError> {
    let direct = context.download(&film.direct)?;
    let indirect = context.download(&film.indirect)?;
    let rgb = match request.light {
        LightParts::All => direct.iter().zip(&indirect).map(|(&d, &i)| d + i).collect(),
        LightParts::DirectOnly => direct.clone(),
        LightParts::IndirectOnly => indirect.clone(),
    };
    let mut picture = Picture::new(film.width, film.height, rgb)?;
    for channel in &request.channels {
        match channel {
            Channel::Direct => picture.add_rgb("direct", &direct)?,
            Channel::Indirect => picture.add_rgb("indirect", &indirect)?,
            Channel::Albedo => picture.add_rgb("albedo", &context.download(&film.albedo)?)?,
            Channel::Normal => picture.add_xyz("normal", &context.download(&film.normal)?)?,
            Channel::Depth => picture.add_channel("depth.Z", context.download(&film.depth)?)?,
        }
    }
    Ok(picture)
}

/// What a run measured.
pub struct Measured<'a> {
    pub context: &'a gpu::Context,
    pub time_line: &'a TimeLine,
    /// Passes of the measured frames, in submission order.
    pub records: Vec<gpu::PassRecord>,
    pub scene: SceneFacts,
    /// What the method counted.
    pub method: Value,
}

/// Write the profile and the trace that were asked for, and print the table of passes to `out`.
pub fn write_measurements(
    request: &RenderRequest,
    measured: Measured<'_>,
    out: &mut dyn Write,
) -> Result<(), AppError> {
    let clock = measure::clock(measured.context, measured.time_line);
    let records = measure::pass_records(measured.records);
    let device = measure::device(measured.context.info());
    let memory = measure::memory(&measured.context.memory_by_owner());
    let settings = request.record()?;
    if let Some(path) = &request.trace {
        let about: Map<String, Value> = [
            ("device".to_owned(), serde_json::to_value(&device)?),
            ("scene".to_owned(), serde_json::to_value(&measured.scene)?),
            ("settings".to_owned(), settings.clone().into()),
        ]
        .into_iter()
        .collect();
        trace::write(path, &measured.time_line.spans(), &records, clock, &about)?;
    }
    let mut profile = Profile::new(device, measured.scene, settings, request.frames, &records, memory);
    profile.method = measured.method;
    if let Some(path) = &request.profile {
        profile.write(path)?;
    }
    write!(out, "{}", table::render(&profile.passes))?;
    Ok(())
}

/// What a picture says about itself.
pub fn metadata(request: &RenderRequest, device: &gpu::DeviceInfo) -> Result<Metadata, AppError> {
    let facts = [
        ("Software", format!("linklight {}", env!("CARGO_PKG_VERSION"))),
        ("scene", request.scene.to_string()),
        ("device", format!("{} ({})", device.name, device.driver)),
        ("settings", json!(request.record()?).to_string()),
    ];
    Ok(facts.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
}

/// Write what every pass left in its buffers, as hashes.
pub fn write_hashes(request: &RenderRequest, context: &gpu::Context, path: &Path) -> Result<(), AppError> {
    let of_pass = |hash: gpu::PassHash| {
        PassHash::of_words(hash.path, hash.binding, hash.word_count, hash.words_per_block, hash.blocks)
    };
    let file = HashFile {
        schema: pass_hashes::SCHEMA.to_owned(),
        version: pass_hashes::VERSION,
        program: concat!("linklight ", env!("CARGO_PKG_VERSION")).to_owned(),
        device: measure::device(context.info()),
        scene: request.scene.to_string(),
        settings: request.record()?,
        passes: context.take_hashes().into_iter().map(of_pass).collect(),
    };
    file.write(path).map_err(AppError::failed)
}
