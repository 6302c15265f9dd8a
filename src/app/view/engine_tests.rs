//! Whatever an engine did before, its picture is the one that a new engine renders.

use clap::Parser as _;
use glam::{UVec2, Vec3};

use super::*;
use crate::app::cli::{Cli, Command};
use crate::app::values::{Format, Output};
use crate::gpu::Options;
use crate::stages::work::Unwatched;

/// Where a test says nothing else.
const PICTURE: [(&str, &str); 4] = [("--size", "30x20"), ("--elements", "400"), ("--bounces", "1"), ("--spp", "1")];

pub(super) fn context() -> Context {
    Context::new(Options { validation: true, ..Options::default() }).unwrap()
}

fn request(options: &str) -> RenderRequest {
    let scene = if options.contains("builtin:") { "" } else { "builtin:office" };
    let unsaid = PICTURE.iter().filter(|(name, _)| !options.contains(name));
    let unsaid: String = unsaid.map(|(name, value)| format!("{name} {value} ")).collect();
    let line = format!("linklight view {scene} {unsaid} {options}");
    let Command::View(args) = Cli::try_parse_from(line.split_whitespace()).unwrap().command else { panic!("no view") };
    RenderRequest::of_picture(&args.picture, Output { path: "a.png".into(), format: Format::Png }).unwrap()
}

pub(super) fn pixels(context: &Context, engine: &mut Engine<'_>, options: &str) -> Vec<Vec3> {
    let film = engine.render(&request(options), &Unwatched).unwrap();
    let mut pixels = context.download(&film.direct).unwrap();
    pixels.extend(context.download(&film.indirect).unwrap());
    pixels
}

#[test]
fn the_depth_of_a_change_is_what_it_needs() {
    let depth = |old: &str, new: &str| change(&request(old), &request(new));
    assert_eq!(depth("", "--exposure 1 --indirect-only"), None, "tone mapping alone");
    assert_eq!(depth("", "--eye 1,1,1 --look-at 0,0,0"), Some(Depth::Frame));
    assert_eq!(depth("", "--bounces 3"), Some(Depth::Frame));
    assert_eq!(depth("", "--edit material:1.albedo=0.5"), Some(Depth::Light));
    assert_eq!(depth("--edit light:0.intensity=1", "--edit light:0.intensity=2"), Some(Depth::Light));
    assert_eq!(depth("", "--size 31x20"), Some(Depth::Display));
    assert_eq!(depth("--display final-gather", "--display final-gather --exposure 1"), Some(Depth::Display));
    assert_eq!(depth("", "--set rays_per_element=64"), Some(Depth::Method));
    assert_eq!(depth("", "--seconds 1"), Some(Depth::Stage));
    assert_eq!(depth("--edit node:1.move=1,0,0", ""), Some(Depth::Stage));
    assert_eq!(depth("", "--method path-tracing"), Some(Depth::Stage), "it needs no elements");
}

#[test]
fn changes_leave_no_trace_of_what_was_before() {
    let context = context();
    let others = [
        "--edit material:1.albedo=0.9,0.1,0.2 --edit light:0.intensity=0.5",
        "--edit material:1.albedo=0.9,0.1,0.2 --edit material:0.roughness=0.3",
        "--edit material:1.albedo=0.9,0.1,0.2",
        "--edit node:2.move=0.1,0,0.2",
        "--eye 1,1.5,1 --look-at 0,1,-3 --bounces 2",
        "--seconds 0.5 --size 20x30",
    ];
    for (method, others) in [
        ("explicit-visibility --set rays_per_element=64", &others[..]),
        ("implicit-visibility builtin:cornell-box --set bins=8", &others[2..4]),
        ("antiradiance builtin:cornell-box", &others[2..4]),
        ("path-tracing builtin:cornell-box", &others[2..4]),
    ] {
        let mut engine = Engine::new(&context);
        let with = |options: &str| format!("--method {method} {options}");
        let first = pixels(&context, &mut engine, &with(""));
        for options in others {
            let changed = pixels(&context, &mut engine, &with(options));
            let fresh = pixels(&context, &mut Engine::new(&context), &with(options));
            assert!(changed == fresh, "{method} {options}: another picture than a new engine's");
        }
        assert!(first == pixels(&context, &mut engine, &with("")), "{method}: back to the first");
        let gray = pixels(&context, &mut engine, &with("--edit material:0.albedo=0.1"));
        assert!(gray != first, "{method}: an edit is seen");
    }
    assert_eq!(context.validation_messages(), [""; 0]);
}

#[test]
fn an_interrupted_picture_is_made_whole_by_the_next_request() {
    struct Never;
    impl Watch for Never {
        fn step(&self, _: &str, _: u64, _: u64) -> Result<(), crate::stages::work::Interrupted> {
            Err(crate::stages::work::Interrupted)
        }
    }
    let context = context();
    let mut engine = Engine::new(&context);
    assert!(engine.render(&request(""), &Never).is_err(), "nothing was placed yet");
    let whole = pixels(&context, &mut engine, "");
    assert!(engine.render(&request("--set rays_per_element=64"), &Never).is_err());
    assert!(pixels(&context, &mut engine, "") == whole);
    assert_eq!(context.validation_messages(), [""; 0]);
}

#[test]
fn a_click_finds_what_the_pixel_shows() {
    let context = context();
    let mut engine = Engine::new(&context);
    let film = engine.render(&request(""), &Unwatched).unwrap();
    let depth = context.download(&film.depth).unwrap();
    // Lights are caught within some pixels of theirs; the office has few.
    let pick = |i: u32| match engine.pick(&request(""), UVec2::new(i % 30, i / 30)).unwrap() {
        Some(Picked::Surface(surface)) => Some((UVec2::new(i % 30, i / 30), surface)),
        _ => None,
    };
    let (pixel, surface) = (0..600).step_by(37).find_map(pick).expect("a surface somewhere");
    let seen = depth[(pixel.y * 30 + pixel.x) as usize];
    assert!((surface.distance / seen - 1.0).abs() < 0.05, "{} m, the film has {seen} m", surface.distance);
    let scene = &engine.stage().unwrap().scene;
    assert_eq!(scene.materials[surface.material_index as usize].name, surface.material.name);
}
