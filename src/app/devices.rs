//! `linklight devices`: every Vulkan device, usable or not with the reason, and which one would be taken.

use std::io::Write;

use serde_json::{Value, json};

use super::AppError;
use super::cli::{DevicesArgs, Global};
use crate::gpu::{DeviceInfo, OptionalFeatures, choose_device, list_devices};

/// Exit code 3 where no device is usable (or none that `--gpu` names), after the list.
pub fn run(args: &DevicesArgs, global: &Global, out: &mut dyn Write) -> Result<(), AppError> {
    let devices = list_devices()?;
    let chosen = choose_device(&devices, global.gpu.as_deref());
    let taken = chosen.as_ref().ok().map(|device| device.index);
    if args.json {
        let list: Vec<Value> = devices.iter().map(|device| to_json(device, taken)).collect();
        let json = json!({ "schema": "linklight-devices", "version": 1, "devices": list });
        writeln!(out, "{}", serde_json::to_string_pretty(&json)?)?;
    } else {
        for device in &devices {
            write_device(device, taken, out)?;
        }
    }
    chosen?;
    Ok(())
}

fn write_device(device: &DeviceInfo, taken: Option<usize>, out: &mut dyn Write) -> Result<(), AppError> {
    let mark = if taken == Some(device.index) { "*" } else { " " };
    writeln!(out, "{mark} {}  {} ({})", device.index, device.name, device.kind)?;
    writeln!(out, "     driver     {}, Vulkan {}", device.driver, device.api_version)?;
    let gib = device.memory_bytes as f64 / f64::from(1 << 30);
    let mib = device.max_storage_buffer_bytes / (1 << 20);
    writeln!(out, "     memory     {gib:.1} GiB, at most {mib} MiB in one storage buffer")?;
    writeln!(out, "     subgroup   {} threads", device.subgroup_size)?;
    let (present, absent): (Vec<_>, Vec<_>) = optional(&device.optional).into_iter().partition(|(_, has)| *has);
    let names = |features: &[(&str, bool)]| {
        let names: Vec<&str> = features.iter().map(|(name, _)| *name).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    };
    writeln!(out, "     optional   {}; without: {}", names(&present), names(&absent))?;
    if device.missing.is_empty() {
        let verdict = if taken == Some(device.index) { "usable, taken" } else { "usable" };
        writeln!(out, "     verdict    {verdict}")?;
    } else {
        writeln!(out, "     verdict    not usable: lacks {}", device.missing.join(", "))?;
    }
    Ok(())
}

fn optional(features: &OptionalFeatures) -> [(&'static str, bool); 8] {
    [
        ("ray query", features.ray_query),
        ("16-bit storage", features.storage_16bit),
        ("pipeline statistics", features.pipeline_statistics),
        ("memory budget", features.memory_budget),
        ("calibrated timestamps", features.calibrated_timestamps),
        ("device fault", features.device_fault),
        ("buffer markers", features.buffer_marker),
        ("sampler anisotropy", features.sampler_anisotropy),
    ]
}

fn to_json(device: &DeviceInfo, taken: Option<usize>) -> Value {
    let features: serde_json::Map<String, Value> =
        optional(&device.optional).into_iter().map(|(name, has)| (name.to_owned(), has.into())).collect();
    json!({
        "index": device.index,
        "name": device.name,
        "kind": device.kind,
        "driver": device.driver,
        "api": device.api_version,
        "memory_bytes": device.memory_bytes,
        "max_storage_buffer_bytes": device.max_storage_buffer_bytes,
        "subgroup_size": device.subgroup_size,
        "usable": device.missing.is_empty(),
        "missing": device.missing,
        "optional": features,
        "taken": taken == Some(device.index),
    })
}
