//! Pictures, environments, files kept between runs, and what measuring commands write and read again.

use crate::Target;
use crate::mutate::{self, Random};
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage as _,
};
use glam::Vec3;
use linklight::app;
use linklight::report::bench_file::BenchFile;
use linklight::report::image::{self, Picture};
use linklight::report::pass_hashes::HashFile;
use linklight::report::profile::Profile;
use linklight::scene::environment::load::{self as environment, EnvironmentLimits};
use linklight::stages::clusters::{ClusterTree, MeshFaces, cache as clusters};
use linklight::stages::surface_maps::{CompressedMaps, Found, Key, Run, cache as surface_maps};
use serde_json::{Value, json};
use std::io::Cursor;
use std::path::Path;

pub const ENVIRONMENT: Target = Target {
    name: "environment",
    runs: 1_500,
    seeds: radiance_pictures,
    mutate: bend_bytes,
    read: read_environment,
    max_bytes: 64 << 20,
};
pub const PICTURE: Target = Target {
    name: "picture",
    runs: 1_500,
    seeds: pictures,
    mutate: bend_picture,
    read: read_picture,
    max_bytes: 96 << 20,
};
pub const SURFACE_MAPS: Target = Target {
    name: "surface-maps",
    runs: 2_000,
    seeds: surface_maps_file,
    mutate: bend_summed_first,
    read: read_surface_maps,
    max_bytes: 8 << 20,
};
pub const CLUSTERS: Target = Target {
    name: "clusters",
    runs: 4_000,
    seeds: || vec![clusters::encode(&tree())],
    mutate: bend_summed_last,
    read: read_clusters,
    max_bytes: 8 << 20,
};
pub const PROFILE: Target =
    Target { name: "profile", runs: 2_000, seeds: profiles, mutate: bend_json, read: read_profile, max_bytes: 8 << 20 };
pub const BENCH: Target = Target {
    name: "bench",
    runs: 1_000,
    seeds: measurements,
    mutate: bend_json,
    read: read_measurements,
    max_bytes: 16 << 20,
};

fn bend_bytes(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let seed = random.pick(seeds).clone();
    mutate::bytes(random, seed)
}

fn bend_picture(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = bend_bytes(random, seeds);
    if bytes.starts_with(b"\x89PNG") && !random.one_in(8) {
        mutate::mend_png(&mut bytes);
    }
    bytes
}

/// Small pictures of radiance: .exr by every compression, in several layouts, and .hdr.
fn radiance_pictures() -> Vec<Vec<u8>> {
    let value = |i: usize| ((i * 37) % 101) as f32 / 25.0;
    let compressions = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
    ];
    let mut files = Vec::new();
    for (index, compression) in compressions.into_iter().enumerate() {
        let size = exr::prelude::Vec2(9 + index, 5);
        let channels = ["B", "G", "R"].map(|name| {
            let values = (0..size.area()).map(value);
            let samples = match index % 2 {
                0 => FlatSamples::F32(values.collect()),
                _ => FlatSamples::F16(values.map(exr::prelude::f16::from_f32).collect()),
            };
            AnyChannel::new(name, samples)
        });
        let mut encoding = Encoding { compression, ..Encoding::FAST_LOSSLESS };
        if index % 3 == 0 {
            encoding.blocks = exr::image::Blocks::Tiles(exr::prelude::Vec2(4, 4));
        }
        let layer = Layer::new(
            size,
            LayerAttributes::named("light"),
            encoding,
            AnyChannels::sort(channels.into_iter().collect()),
        );
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).expect("memory to write to");
        files.push(bytes.into_inner());
    }
    // Below 8 pixels a row stays plain; above, runs are told.
    for width in [3, 24] {
        let pixels: Vec<::image::Rgb<f32>> = (0..width * 4).map(|i| ::image::Rgb([value(i / 5), 1.0, 0.25])).collect();
        let mut bytes = Vec::new();
        ::image::codecs::hdr::HdrEncoder::new(&mut bytes).encode(&pixels, width, 4).expect("memory to write to");
        files.push(bytes);
    }
    files
}

fn read_environment(input: &[u8], _: &Path) {
    let limits = EnvironmentLimits { max_extent: 2048, max_memory_bytes: 16 << 20 };
    let Ok(loaded) = environment::load_bytes(Path::new("fuzz"), input, 0.3, &limits) else { return };
    let up = loaded.environment.radiance(Vec3::Y);
    assert!(up.is_finite() && up.min_element() >= 0.0, "radiance {up}");
    assert!(loaded.environment.size_bytes() <= limits.max_memory_bytes);
}

fn pictures() -> Vec<Vec<u8>> {
    let mut files = radiance_pictures();
    for (width, height, text) in [(4, 3, "plain"), (17, 9, "\u{e4}\u{f6}\u{fc} beyond ASCII")] {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.add_itxt_chunk("Comment".into(), text.into()).unwrap();
        encoder.add_ztxt_chunk("Software".into(), "linklight".into()).unwrap();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&vec![99; (width * height * 3) as usize]).unwrap();
        writer.finish().unwrap();
        files.push(bytes);
    }
    files
}

/// Of at most so many pixels.
const MAX_PIXELS: u64 = 1 << 18;

fn read_picture(input: &[u8], folder: &Path) {
    let path = folder.join("picture");
    std::fs::write(&path, input).unwrap();
    let Ok(picture) = image::read_within(&path, MAX_PIXELS) else { return };
    let count = picture.width as usize * picture.height as usize;
    assert!(count as u64 <= MAX_PIXELS && picture.rgb.len() == count);
    assert!(picture.channels.iter().all(|channel| channel.values.len() == count));
}

fn key() -> Key {
    Key::over(&[b"a scene"])
}

fn surface_maps_file() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let runs = (0..9).map(|i| Run { depth: 1000 * i, first: if i < 4 { i } else { i - 4 } }).collect();
    let maps = CompressedMaps { offsets: vec![0, 4, 9], runs, place_count: 12 };
    surface_maps::write(folder.path(), &key(), &maps).unwrap();
    vec![std::fs::read(key().file_in(folder.path())).unwrap()]
}

/// Bends a file that opens with the hash of the rest, and mostly puts the hash right.
fn bend_summed_first(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let body = mutate::bytes(random, seeds[0][32..].to_vec());
    let hash = if random.one_in(8) { [0; 32] } else { *blake3::hash(&body).as_bytes() };
    [hash.to_vec(), body].concat()
}

/// As [`bend_summed_first`], with the hash at the end.
fn bend_summed_last(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut body = mutate::bytes(random, seeds[0][..seeds[0].len() - 32].to_vec());
    let hash = if random.one_in(8) { [0; 32] } else { *blake3::hash(&body).as_bytes() };
    body.extend(hash);
    body
}

fn read_surface_maps(input: &[u8], folder: &Path) {
    std::fs::write(key().file_in(folder), input).unwrap();
    let Found::Maps(maps) = surface_maps::read(folder, &key()) else { return };
    // What look-ups trust.
    assert_eq!((maps.offsets.first(), maps.offsets.last()), (Some(&0), Some(&(maps.runs.len() as u32))));
    assert!(maps.offsets.windows(2).all(|pair| pair[0] <= pair[1]));
    assert!(maps.runs.iter().all(|run| u32::from(run.first) < maps.place_count));
    for place in
        [0, maps.place_count / 2, maps.place_count.saturating_sub(1)].into_iter().filter(|p| *p < maps.place_count)
    {
        (0..maps.pixel_count()).for_each(|pixel| _ = maps.depth(place, pixel));
    }
}

const FACES: usize = 40;

fn tree() -> ClusterTree {
    let positions: Vec<Vec3> =
        (0..FACES + 2).map(|i| Vec3::new(i as f32, (i % 2) as f32, ((i * i) % 7) as f32 * 0.2)).collect();
    let triangles: Vec<[u32; 3]> = (0..FACES as u32).map(|i| [i, i + 1 + i % 2, i + 2 - i % 2]).collect();
    let values = vec![Vec3::splat(0.5); FACES];
    ClusterTree::build(&MeshFaces {
        positions: &positions,
        triangles: &triangles,
        albedo: &values,
        reflectance: &values,
        emission: &values,
    })
}

fn read_clusters(input: &[u8], _: &Path) {
    let Some(tree) = clusters::decode(input, FACES) else { return };
    // Walks as the renderer does: every cluster's faces are those of its children.
    let mut stack = vec![0];
    let mut leaves = 0;
    while let Some(cluster) = stack.pop() {
        match tree.children(cluster) {
            Some(children) => stack.extend(children),
            None => leaves += 1,
        }
        assert!(stack.len() <= FACES, "a walk that does not end");
    }
    assert_eq!(leaves, FACES);
    let mut faces = tree.faces.clone();
    faces.sort_unstable();
    assert!(faces.iter().copied().eq(0..FACES as u32));
}

/// Names of fields, and values of other types.
const WORDS: [&str; 20] = [
    "schema",
    "version",
    "passes",
    "ms",
    "values",
    "frame",
    "device",
    "subjects",
    "yardsticks",
    "memory",
    "path",
    "blocks",
    "bytes",
    "bytes_per_block",
    "copy_ms",
    "verdict",
    "slower",
    "linklight-profile",
    "linklight-bench",
    "linklight-hashes",
];

fn bend_json(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let seed = random.pick(seeds);
    if random.one_in(6) {
        return mutate::bytes(random, seed.clone());
    }
    let mut document: Value = serde_json::from_slice(seed).expect("a valid seed");
    mutate::document(random, &mut document, &WORDS);
    document.to_string().into_bytes()
}

fn device() -> Value {
    json!({ "name": "a device", "driver": "a driver", "kind": "CPU", "api": "1.3.0" })
}

fn profiles() -> Vec<Vec<u8>> {
    let ms = json!({ "min": 1.0, "median": 2.0, "max": 3.5, "total": 8.0 });
    let pass = json!({
        "path": "frame/a", "name": "a", "calls": 4, "ms": ms, "bytes_read": 10, "bytes_written": 20,
        "counters": { "threads": 64 }, "overlapped": false,
    });
    let profile = json!({
        "schema": "linklight-profile", "version": 1, "program": { "name": "linklight", "version": "0.1.0" },
        "device": device(), "scene": { "name": "s", "triangles": 3, "elements": 5, "lights": 1 }, "settings": { "a": 1 },
        "frames": 2, "passes": [pass.clone(), pass], "method": null, "total_ms": 16.0,
        "memory": { "bytes": 1, "peak_bytes": 2, "owners": [{ "owner": "bvh", "bytes": 1, "peak_bytes": 2 }] },
    });
    let output = |path: &str, blocks: [u32; 3]| json!({ "path": path, "binding": "radiosity", "bytes": 300, "bytes_per_block": 128, "blocks": blocks });
    let hashes = json!({
        "schema": "linklight-hashes", "version": 1, "program": "linklight 0.1.0", "device": device(), "scene": "s",
        "settings": {}, "passes": [output("frame/a", [1, 2, 3]), output("frame/b", [4, 5, 6])],
    });
    vec![profile.to_string().into_bytes(), hashes.to_string().into_bytes()]
}

fn read_profile(input: &[u8], folder: &Path) {
    let (path, whole) = (folder.join("profile.json"), folder.join("whole.json"));
    std::fs::write(&path, input).unwrap();
    if let Ok(profile) = Profile::read(&path) {
        profile.write(&whole).unwrap();
    }
    if let Ok(hashes) = HashFile::read(&path) {
        std::fs::write(&whole, &profiles()[1]).unwrap();
        let other = HashFile::read(&whole).unwrap();
        for found in [hashes.first_difference(&other, None), other.first_difference(&hashes, Some(&hashes))] {
            drop(found.map(|found| found.to_string()));
        }
    }
}

fn measurements() -> Vec<Vec<u8>> {
    let values: Vec<f64> = (0..9).map(|i| 2.0 + 0.01 * f64::from(i)).collect();
    let times = json!({ "median": 2.04, "low": 2.0, "high": 2.08, "values": values });
    let subject = json!({
        "scene": "s", "scene_hash": "00", "method": "m", "variation": "", "command": "c", "settings": {}, "device": 0,
        "prepare_ms": 1.0, "frame": times, "against_first": { "ratio": 1.0, "low": 0.9, "high": 1.1, "verdict": "not-shown" },
        "passes": [{ "path": "frame/a", "times": times, "bytes": 100, "bandwidth_share": 0.5 }],
    });
    let yardstick = json!({
        "device": device(), "copy_bytes": 1, "copy_ms": values, "multiply_add_flops": 1, "multiply_add_ms": values,
        "empty_ms": values, "cpu_ms": values,
    });
    let file = json!({
        "schema": "linklight-bench", "version": 1, "program": "linklight 0.1.0", "environment": { "LP_NUM_THREADS": "2" },
        "rounds": 9, "warm_up": { "rounds": 3, "drift": 0.01, "settled": true }, "yardsticks": [yardstick],
        "subjects": [subject],
    });
    vec![file.to_string().into_bytes()]
}

/// Read, and held against a sound one as `linklight bench --read NEW --against OLD` does, either way round.
fn read_measurements(input: &[u8], folder: &Path) {
    let (path, sound) = (folder.join("bench.json"), folder.join("sound.json"));
    std::fs::write(&path, input).unwrap();
    if BenchFile::read(&path).is_err() {
        return;
    }
    std::fs::write(&sound, &measurements()[0]).unwrap();
    for [new, old] in [[&path, &sound], [&sound, &path], [&path, &path]] {
        let words = ["linklight", "--quiet", "bench", "--read"].map(std::ffi::OsString::from);
        let words = words.into_iter().chain([new.into(), "--against".into(), old.into()]);
        let cli = <app::cli::Cli as clap::Parser>::try_parse_from(words).expect("a sound command line");
        // Nothing in common is an error, and no fault.
        drop(app::run(cli, &mut Vec::new()));
    }
}

pub fn seeds_are_valid() {
    let limits = EnvironmentLimits::default();
    for (index, seed) in radiance_pictures().iter().enumerate() {
        let loaded = environment::load_bytes(Path::new("seed"), seed, 0.0, &limits);
        assert!(loaded.is_ok(), "picture {index}: {:?}", loaded.err());
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seed");
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        &path
    };
    for seed in pictures() {
        let picture: Picture = image::read(read(&seed)).unwrap_or_else(|error| panic!("{error}"));
        assert!(picture.width > 0);
    }
    assert!(clusters::decode(&clusters::encode(&tree()), FACES).is_some());
    std::fs::write(key().file_in(folder.path()), &surface_maps_file()[0]).unwrap();
    assert!(matches!(surface_maps::read(folder.path(), &key()), Found::Maps(_)));
    Profile::read(read(&profiles()[0])).unwrap();
    HashFile::read(read(&profiles()[1])).unwrap();
    BenchFile::read(read(&measurements()[0])).unwrap();
}
