//! Pictures survive a round trip, damaged files are refused.

use super::*;

fn gradient(width: u32, height: u32) -> Picture {
    let rgb = (0..width * height).map(|i| Vec3::new(i as f32 * 0.37, 1.0 / (i + 1) as f32, 100.0)).collect();
    Picture::new(width, height, rgb).unwrap()
}

#[test]
fn exr_keeps_every_bit_of_pixels_channels_and_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut picture = gradient(7, 5);
    picture.rgb[3] = Vec3::new(f32::MAX, -0.0, f32::MIN_POSITIVE);
    let normals: Vec<Vec3> = (0..35).map(|i| Vec3::new(0.0, i as f32, -1.0)).collect();
    let direct: Vec<Vec3> = picture.rgb.iter().map(|rgb| *rgb * 0.5).collect();
    picture.add_channel("depth.Z", (0..35).map(|i| i as f32).collect()).unwrap();
    picture.add_rgb("direct", &direct).unwrap();
    picture.add_xyz("normal", &normals).unwrap();
    picture.metadata.insert("scene".into(), "caf\u{e9} \u{1F3E0} \"quoted\"".into());
    picture.metadata.insert("settings".into(), "{\"bounces\":4}".into());
    write_exr(&path, &picture).unwrap();

    let read = read(&path).unwrap();
    assert_eq!(read.metadata, picture.metadata);
    assert_eq!((read.width, read.height, read.encoding), (7, 5, Encoding::Radiance));
    let bits = |rgb: &[Vec3]| rgb.iter().flat_map(|v| v.to_array()).map(f32::to_bits).collect::<Vec<_>>();
    assert_eq!(bits(&read.rgb), bits(&picture.rgb));
    assert_eq!(read.layer("normal").unwrap(), normals);
    assert_eq!(bits(&read.layer("direct").unwrap()), bits(&direct));
    assert_eq!(read.layer("depth"), None);
    assert_eq!(read.layer_names(), ["depth", "direct", "normal"]);
}

#[test]
fn the_same_picture_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let mut picture = gradient(200, 100);
    for key in ["scene", "method", "settings", "device"] {
        picture.metadata.insert(key.into(), "value".into());
    }
    let bytes = |name: &str| {
        let path = folder.path().join(name);
        write_exr(&path, &picture).unwrap();
        std::fs::read(path).unwrap()
    };
    assert_eq!(bytes("a.exr"), bytes("b.exr"));
}

#[test]
fn png_keeps_bytes_and_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let bytes: Vec<u8> = (0..=255).flat_map(|i| [i, 255 - i, i / 2]).collect();
    let metadata = Metadata::from([("scene".into(), "\u{3b8}".into()), ("Software".into(), "linklight".into())]);
    write_png(&path, 16, 16, &bytes, &metadata).unwrap();
    let read = read(&path).unwrap();
    assert_eq!(read.encoding, Encoding::Display);
    assert_eq!(read.metadata, metadata);
    let encoded: Vec<u8> = read
        .rgb
        .iter()
        .flat_map(|rgb| rgb.to_array())
        .map(|value| (super::super::tonemap::srgb_encode(value) * 255.0).round() as u8)
        .collect();
    assert_eq!(encoded, bytes);
}

#[test]
fn hdr_files_are_linear_radiance() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hdr");
    let file = std::fs::File::create(&path).unwrap();
    let pixels = [::image::Rgb([1.0f32, 2.0, 4.0]), ::image::Rgb([0.25, 0.5, 0.125])];
    ::image::codecs::hdr::HdrEncoder::new(file).encode(&pixels, 2, 1).unwrap();
    let read = read(&path).unwrap();
    assert_eq!(read.encoding, Encoding::Radiance);
    assert_eq!(read.rgb, [Vec3::new(1.0, 2.0, 4.0), Vec3::new(0.25, 0.5, 0.125)]);
}

#[test]
fn wrong_lengths_and_sizes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(Picture::new(2, 2, vec![Vec3::ZERO; 3]), Err(PictureError::Shape { found: 3, expected: 4, .. })));
    let path = folder.path().join("a.png");
    assert!(matches!(write_png(&path, 2, 2, &[0; 5], &Metadata::new()), Err(PictureError::Shape { .. })));
    assert!(matches!(write_png(&path, 0, 2, &[], &Metadata::new()), Err(PictureError::TooLarge { .. })));
    let mut picture = gradient(2, 2);
    assert!(picture.add_channel("depth.Z", vec![0.0; 5]).is_err());
    picture.add_channel("depth.Z", vec![0.0; 4]).unwrap();
    picture.add_channel("depth.Z", vec![0.0; 4]).unwrap();
    let message = write_exr(&folder.path().join("a.exr"), &picture).unwrap_err().to_string();
    assert!(message.contains("twice"), "{message}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "a refused write leaves nothing behind");
}

#[test]
fn other_files_are_refused_by_content() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in [("empty.png", &b""[..]), ("text.exr", b"not a picture"), ("short.exr", b"\x76\x2f")] {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        assert!(matches!(read(&path), Err(PictureError::UnknownFormat(_))), "{name}");
    }
    assert!(matches!(read(folder.path()), Err(PictureError::File(_))));
    assert!(matches!(read(&folder.path().join("missing.png")), Err(PictureError::File(_))));
}

/// Truncated and damaged files end in an error or a picture, never in a panic.
#[test]
fn damaged_files_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut picture = gradient(20, 17);
    picture.metadata.insert("a".into(), "b".into());
    let exr = folder.path().join("a.exr");
    write_exr(&exr, &picture).unwrap();
    let png = folder.path().join("a.png");
    write_png(&png, 8, 8, &[77; 192], &picture.metadata).unwrap();
    let hdr = folder.path().join("a.hdr");
    let pixels = vec![::image::Rgb([1.0f32, 2.0, 4.0]); 64];
    ::image::codecs::hdr::HdrEncoder::new(std::fs::File::create(&hdr).unwrap()).encode(&pixels, 8, 8).unwrap();

    let damaged = folder.path().join("damaged");
    let mut refused = 0;
    for original in [exr, png, hdr] {
        let bytes = std::fs::read(original).unwrap();
        for length in (0..bytes.len()).step_by(1 + bytes.len() / 60) {
            std::fs::write(&damaged, &bytes[..length]).unwrap();
            refused += usize::from(read(&damaged).is_err());
        }
        for position in 0..bytes.len().min(500) {
            let mut changed = bytes.clone();
            changed[position] ^= 0xff;
            std::fs::write(&damaged, &changed).unwrap();
            refused += usize::from(read(&damaged).is_err());
        }
    }
    assert!(refused > 200, "only {refused} damaged files were refused");
}
