//! The same picture wherever it is rendered: on a device of the least limits, with a barrier before every pass, by one
//! thread or two, by vectors of other widths; and on other drivers, or refused by the name of what they lack.

use linklight::report::image;
use std::path::Path;
use std::process::{Command, Output};

fn linklight(words: &[&str], environment: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_linklight"));
    command.args(words).envs(environment.iter().copied()).output().expect("the program starts")
}

/// A render of a small scene, as bits.
fn render(folder: &Path, method: &str, options: &[&str], environment: &[(&str, &str)]) -> Vec<[u32; 3]> {
    let path = folder.join("out.exr");
    let small = ["--size", "20x14", "--bounces", "2", "--spp", "2", "--quiet"];
    let output = ["render", "builtin:cornell-box", "-o", path.to_str().unwrap(), "--method", method];
    let elements: &[&str] = match method {
        "surface-shadow-maps" => &["--set", "atlas_resolution=16", "--set", "keep_maps=false"],
        "path-tracing" | "face-cluster" => &[],
        _ => &["--elements", "300"],
    };
    let run = linklight(&[&output[..], &small, elements, options].concat(), environment);
    assert!(run.status.success(), "{method} {options:?}: {}", String::from_utf8_lossy(&run.stderr));
    let picture = image::read(&path).unwrap_or_else(|error| panic!("{error}"));
    assert!(picture.rgb.iter().any(|pixel| pixel.max_element() > 0.0), "{method}: a black picture");
    picture.rgb.iter().map(|pixel| pixel.to_array().map(f32::to_bits)).collect()
}

const METHODS: [&str; 6] = [
    "explicit-visibility",
    "implicit-visibility",
    "antiradiance",
    "surface-shadow-maps",
    "face-cluster",
    "path-tracing",
];

#[test]
fn small_devices_and_full_barriers_change_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    for method in METHODS {
        let plain = render(folder.path(), method, &[], &[]);
        let small = render(folder.path(), method, &["--small-device", "--full-barriers"], &[]);
        assert!(small == plain, "{method}: another picture on a small device with full barriers");
    }
}

#[test]
fn threads_and_vector_widths_change_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    for method in ["explicit-visibility", "antiradiance"] {
        let [narrow, wide] = [("1", "256"), ("2", "512")].map(|(threads, width)| {
            let environment = [("LP_NUM_THREADS", threads), ("LP_NATIVE_VECTOR_WIDTH", width)];
            render(folder.path(), method, &[], &environment)
        });
        assert!(narrow == wide, "{method}: another picture by other threads and vectors");
    }
    // The comparison can fail.
    let others = ["--seed", "1"];
    let paths = |options: &[&str]| render(folder.path(), "path-tracing", options, &[]);
    assert!(paths(&[]) != paths(&others), "another seed is another picture");
}

/// SwiftShader, as the package chromium-common ships it.
const SWIFTSHADER: &str = "/usr/lib/chromium/vk_swiftshader_icd.json";

#[test]
fn a_driver_that_lacks_something_is_refused_by_its_name() {
    if !Path::new(SWIFTSHADER).exists() {
        println!("skipped: {SWIFTSHADER} is not installed (package chromium-common; tools/setup --test installs it)");
        return;
    }
    let driver = [("VK_DRIVER_FILES", SWIFTSHADER), ("VK_ICD_FILENAMES", SWIFTSHADER)];
    let devices = linklight(&["devices"], &driver);
    let listed = String::from_utf8_lossy(&devices.stdout).into_owned();
    assert!(listed.contains("SwiftShader"), "{listed}");
    if devices.status.success() {
        let folder = tempfile::tempdir().unwrap();
        render(folder.path(), "explicit-visibility", &[], &driver);
        return;
    }
    assert_eq!(devices.status.code(), Some(3));
    // It has neither 64-bit integers nor their atomics, nor push descriptors.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.png");
    let refused = linklight(&["render", "builtin:furnace", "-o", path.to_str().unwrap()], &driver);
    assert_eq!(refused.status.code(), Some(3));
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("SwiftShader") && said.contains("lacks"), "{said}");
    for feature in ["shaderInt64", "shaderBufferInt64Atomics", "VK_KHR_push_descriptor"] {
        assert!(said.contains(feature) && listed.contains(feature), "{feature} is not in: {said}\n{listed}");
    }
    assert!(!path.exists());
}
