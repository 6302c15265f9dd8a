//! Options become one typed request, or a complaint.

use clap::Parser as _;

use super::*;
use crate::app::cli::{Cli, Command};
use crate::methods::{explicit_visibility, path_tracing};

/// The request of a command line after `linklight render scene.glb -o FOLDER/out.exr`.
fn request(options: &[&str]) -> Result<RenderRequest, String> {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.exr");
    let mut line = vec!["linklight", "render", "scene.glb", "-o", output.to_str().unwrap()];
    line.extend(options);
    match Cli::try_parse_from(line).map_err(|error| error.to_string())?.command {
        Command::Render(args) => RenderRequest::try_from(*args).map_err(|error| error.to_string()),
        _ => Err("another command".to_owned()),
    }
}

#[test]
fn no_options_give_the_documented_defaults() {
    let request = request(&[]).unwrap();
    assert_eq!((request.method.key, request.display), ("explicit-visibility", Some(Display::Vertex)));
    assert_eq!((request.bounces, request.frames, request.seed, request.seconds), (4, 1, 0, 0.0));
    assert_eq!((request.width, request.height, request.light), (960, 540, LightParts::All));
    assert_eq!(request.settings::<explicit_visibility::Settings>().unwrap(), Default::default());
    let record = request.record().unwrap();
    assert_eq!(record["settings"]["rays_per_element"], 256);
    assert_eq!(record["spp"], 4);
    assert!(!record.contains_key("exposure"), "what has no effect is not recorded");
}

#[test]
fn options_arrive_typed() {
    let options = "--method path-tracing --spp 9 --bounces 0 --size 8x6 --seconds 1.5 --frames 3 --camera 2 \
                   --env 0.1,0,2 --diffuse --direct-only --elements 5000 --exposure -1 --tonemap filmic --seed 7 \
                   --set emitter-sampling=area --channels depth,direct,depth";
    let request = request(&options.split_whitespace().collect::<Vec<_>>()).unwrap();
    assert_eq!((request.spp, request.bounces, request.width, request.height), (9, 0, 8, 6));
    assert_eq!((request.seconds, request.frames, request.seed), (1.5, 3, 7));
    assert_eq!(request.camera.as_ref().unwrap().index, Some(2));
    assert_eq!(request.environment, Some(EnvironmentSource::Constant(glam::Vec3::new(0.1, 0.0, 2.0))));
    assert_eq!((request.diffuse, request.light, request.elements), (true, LightParts::DirectOnly, Some(5000)));
    assert_eq!(request.tone.exposure, -1.0);
    assert_eq!(request.channels, [Channel::Direct, Channel::Depth]);
    let settings: path_tracing::Settings = request.settings().unwrap();
    assert_eq!(settings.emitter_sampling, path_tracing::EmitterSampling::Area);
    let record = request.record().unwrap();
    assert_eq!(record["environment"], json!([0.1, 0.0, 2.0]));
    assert_eq!((&record["spp"], &record["light"], &record["camera"]), (&json!(9), &json!("direct"), &json!("2")));
}

#[test]
fn contradictions_are_refused() {
    let cases: [(&[&str], &str); 11] = [
        (&["--method", "surface-shadow-maps", "--display", "vertex"], "texels, not vertices"),
        (&["--display", "lightmap"], "vertices, not an atlas"),
        (&["--lightmap", "a.exr"], "needs --method surface-shadow-maps"),
        (&["--method", "path-tracing", "--display", "vertex"], "pixels of its own"),
        (&["--indirect-only", "--bounces", "0"], "at least 1 bounce"),
        (&["--indirect-only", "--direct-only"], "cannot be used with"),
        (&["--set", "rays=4"], "did you mean rotate_rays or rays_per_element?"),
        (&["--set", "rays_per_element=4"], "one of 16, 64, 144, 256"),
        (&["--bounces", "65"], "0..=64"),
        (&["--profile", "a.json", "--trace", "a.json"], "two outputs are called a.json"),
        (&["--profile", "no/such/folder/a.json"], "does not exist"),
    ];
    for (options, expected) in cases {
        let message = request(options).unwrap_err();
        assert!(message.contains(expected), "{options:?}: {message}");
    }
}
