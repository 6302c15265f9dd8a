//! Pictures of a glossy room against long path tracing: the error falls with bins, and with elements.

use std::path::Path;
use std::process::{Command, Stdio};

fn linklight(arguments: &[&str]) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    let output = program.env_remove("RUST_LOG").stdin(Stdio::null()).args(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The white surfaces as rough metal: floor, ceiling, back wall and boxes reflect by their lobes alone.
fn render(path: &Path, arguments: &str) {
    const ROOM: &str = "--size 40x40 --bounces 2 --indirect-only --edit material:0.metallic=1 \
                        --edit material:0.roughness=0.6 --quiet";
    let mut all = vec!["render", "builtin:cornell-box", "-o", path.to_str().unwrap()];
    all.extend(ROOM.split_whitespace().chain(arguments.split_whitespace()));
    linklight(&all);
}

#[test]
fn the_error_of_a_glossy_room_falls_with_bins_and_elements() {
    let folder = tempfile::tempdir().unwrap();
    let (reference, picture) = (folder.path().join("reference.exr"), folder.path().join("picture.exr"));
    render(&reference, "--method path-tracing --spp 512");
    let error = |elements: u32, bins: u32| {
        let method = format!("--method implicit-visibility --spp 4 --elements {elements} --set bins={bins}");
        render(&picture, &method);
        let text = linklight(&["diff", picture.to_str().unwrap(), reference.to_str().unwrap(), "--json"]);
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let figure = |name: &str| json["figures"][name].as_f64().unwrap();
        println!("{elements} elements, N = {bins}: relMSE {:.4}, energy {:.3}", figure("relmse"), figure("energy"));
        (figure("relmse"), figure("energy"))
    };
    let (few, _) = error(600, 10);
    let (coarse, _) = error(3000, 3);
    let (best, energy) = error(3000, 10);
    assert!((energy - 1.0).abs() < 0.03, "energy {energy}");
    assert!(
        best < 0.8 * few && best < 0.8 * coarse && best < 0.1,
        "{few} with few elements, {coarse} with few bins, {best}"
    );
}
