//! Whatever an engine did before, its picture is the one that a new engine renders.

use clap::Parser as _;

use super::*;
use crate::app::cli::{Cli, Command};
use crate::app::values::{Format, Output};
use crate::gpu::Options;
use crate::methods::METHODS;
use crate::methods::settings::Kind;
use crate::stages::work::Unwatched;

/// Where a test says nothing else.
const PICTURE: [(&str, &str); 4] = [("--size", "30x20"), ("--elements", "400"), ("--bounces", "1"), ("--spp", "1")];

fn context() -> Context {
    Context::new(Options { validation: true, ..Options::default() }).unwrap()
}

fn request(options: &str) -> RenderRequest {
    try_request(options).unwrap()
}

fn try_request(options: &str) -> Result<RenderRequest, AppError> {
    let names_scene = options.contains("builtin:") || options.contains(".glb");
    let scene = if names_scene { "" } else { "builtin:office" };
    let unsaid = PICTURE.iter().filter(|(name, _)| !options.contains(name));
    let unsaid: String = unsaid.map(|(name, value)| format!("{name} {value} ")).collect();
    let line = format!("linklight view {scene} {unsaid} {options}");
    let Command::View(args) = Cli::try_parse_from(line.split_whitespace()).unwrap().command else { panic!("no view") };
    RenderRequest::of_picture(&args.picture, Output { path: "a.png".into(), format: Format::Png })
}

fn pixels(context: &Context, engine: &mut Engine<'_>, options: &str) -> Vec<Vec3> {
    try_pixels(context, engine, options).unwrap()
}

/// Direct light of all pixels, then what is indirect; or why there is no picture with these options.
pub(super) fn try_pixels(context: &Context, engine: &mut Engine<'_>, options: &str) -> Result<Vec<Vec3>, AppError> {
    let film = engine.render(&try_request(options)?, &Unwatched)?;
    let mut pixels = context.download(&film.direct).unwrap();
    pixels.extend(context.download(&film.indirect).unwrap());
    Ok(pixels)
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
    assert_eq!(depth("", "--seconds 1"), Some(Depth::Follow));
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

/// Without bounces glossy elements show nothing of the bounces that were there before.
#[test]
fn fewer_bounces_leave_nothing_of_more() {
    let context = context();
    for method in ["explicit-visibility", "implicit-visibility", "antiradiance", "surface-shadow-maps", "face-cluster"]
    {
        let scene = "builtin:cornell-box --edit material:0.roughness=0.3 --edit material:0.metallic=1";
        let coarse = match method {
            "surface-shadow-maps" => "--set atlas_resolution=40 --set map_resolution=8 --set keep_maps=false",
            "face-cluster" => "--set threshold=0.001",
            _ => "",
        };
        let with = |bounces: u32| format!("{scene} --method {method} {coarse} --bounces {bounces}");
        let mut engine = Engine::new(&context);
        let more = pixels(&context, &mut engine, &with(2));
        let fewer = pixels(&context, &mut engine, &with(0));
        assert!(fewer == pixels(&context, &mut Engine::new(&context), &with(0)), "{method}: not a new engine's");
        assert!(fewer != more, "{method}: bounces are seen");
        // Nor do views of what a method holds.
        let specs = METHODS.iter().find(|m| m.key == method).unwrap().specs();
        let pick = if specs.iter().any(|spec| spec.name == "pick") { "--set pick=3" } else { "" };
        let views = specs.into_iter().filter(|spec| ["show", "view"].contains(&spec.name));
        for (name, values) in views.filter_map(|spec| match spec.kind {
            Kind::Choice { values } => Some((spec.name, values)),
            _ => None,
        }) {
            for value in values {
                let with = |bounces: u32| format!("{} --set {name}={} {pick}", with(bounces), value.name);
                let mut engine = Engine::new(&context);
                pixels(&context, &mut engine, &with(2));
                let fewer = pixels(&context, &mut engine, &with(0));
                assert!(fewer == pixels(&context, &mut Engine::new(&context), &with(0)), "{method}: {}", value.name);
            }
        }
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

#[test]
fn what_was_picked_is_dragged_along_the_picture() {
    let context = context();
    let mut engine = Engine::new(&context);
    let plain = request("builtin:tea-room --method path-tracing");
    engine.render(&plain, &Unwatched).unwrap();
    let place = |engine: &Engine<'_>, triangle: usize| {
        let world = &engine.stage().unwrap().world;
        let vertex = context.download(&world.triangles).unwrap()[triangle].x;
        context.download(&world.positions).unwrap()[vertex as usize]
    };
    let (mut moved, mut nodes) = (0, std::collections::BTreeSet::new());
    for pixel in (0..600).step_by(61).map(|i| UVec2::new(i % 30, i / 30)) {
        let Some(Picked::Surface(surface)) = engine.pick(&plain, pixel).unwrap() else { continue };
        let handle = surface.handle;
        assert!(handle.depth > 0.0 && handle.depth <= surface.distance * 1.001, "{handle:?}, {} m", surface.distance);
        if !nodes.insert(handle.node) {
            continue;
        }
        let (before, metres) = (place(&engine, surface.triangle), Vec3::new(0.25, -0.5, 0.125));
        let mut edits = Vec::new();
        crate::app::view::editor::drag(&handle, 0.5 * metres, &mut edits);
        crate::app::view::editor::drag(&handle, 0.5 * metres, &mut edits);
        assert_eq!(edits.len(), 1, "one edit grows");
        engine.render(&RenderRequest { edits, ..plain.clone() }, &Unwatched).unwrap();
        let after = place(&engine, surface.triangle);
        assert!((after - before).distance(metres) < 1e-4, "node {}: {before} to {after}", handle.node);
        engine.render(&plain, &Unwatched).unwrap();
        moved += 1;
    }
    assert!(moved >= 2, "{moved} nodes");
    assert_eq!(context.validation_messages(), [""; 0]);
}

/// Frames of [`frames_with_everything_moving_allocate_nothing`]; LINKLIGHT_FRAMES=1000 for a longer film.
const FRAMES: &str = "60";

#[test]
fn frames_with_everything_moving_allocate_nothing() {
    let frames: u32 = std::env::var("LINKLIGHT_FRAMES").as_deref().unwrap_or(FRAMES).parse().unwrap();
    let context = context();
    // Links of all elements in every frame take their time.
    for (method, frames, warm_up) in [
        ("path-tracing", frames, 3),
        ("implicit-visibility --set bins=2", frames.div_ceil(10), 3),
        // Two sets of links, each made in two frames, and then with room for more than before.
        (
            "explicit-visibility --set rays_per_element=16 --set link_budget=60000",
            if frames > 60 { frames } else { 18 },
            9,
        ),
    ] {
        let mut engine = Engine::new(&context);
        let (mut made, mut held) = ((0, 0), 0);
        let mut last = (Vec::new(), Vec::new());
        for frame in 0..frames {
            let t = f64::from(frame % 97) / 48.5;
            let (x, z) = (3.0 * t.cos(), 3.0 * t.sin());
            let options = format!(
                "builtin:dancer --method {method} --seconds {} --eye {x},1.5,{z} --look-at 0,1,0 --size 16x12 \
                 --edit material:0.albedo={}",
                0.04 * t,
                0.3 + 0.1 * t
            );
            let film = engine.render(&request(&options), &Unwatched).unwrap();
            let now = (context.download(&film.direct).unwrap(), context.download(&film.depth).unwrap());
            assert!(now != last, "{method}: frame {frame} shows something else");
            last = now;
            context.take_records();
            let memory: u64 = context.memory_by_owner().values().map(|memory| memory.current_bytes).sum();
            if frame == warm_up {
                (made, held) = ((context.allocation_count(), context.pipeline_count()), memory);
            } else if frame > warm_up {
                let now = (context.allocation_count(), context.pipeline_count());
                assert_eq!((now, memory), (made, held), "{method}: allocations, pipelines, bytes after frame {frame}");
            }
        }
        println!("{method}: {frames} frames, {} allocations, {} pipelines, {held} bytes", made.0, made.1);
    }
    assert_eq!(context.validation_messages(), [""; 0]);
}

#[test]
fn surfaces_that_move_are_followed_and_links_grow_young_again() {
    let context = context();
    let mut engine = Engine::new(&context);
    let budget = "builtin:dancer --set rays_per_element=64 --set link_budget=20000";
    pixels(&context, &mut engine, budget);
    assert_eq!(engine.link_age(), None);
    let moved = format!("{budget} --seconds 0.7");
    let first = pixels(&context, &mut engine, &moved);
    assert_eq!(engine.link_age(), Some(1), "lit along the old links");
    let aged = format!("{moved} --view link-age");
    let frames = (0..64).take_while(|_| {
        pixels(&context, &mut engine, &moved);
        engine.link_age().is_some()
    });
    assert!((1..60).contains(&frames.count()), "they are made within some frames");
    let last = pixels(&context, &mut engine, &moved);
    assert!(last == pixels(&context, &mut Engine::new(&context), &moved) && last != first);
    assert!(pixels(&context, &mut engine, &aged) != last, "ages are shown");
    assert_eq!(context.validation_messages(), [""; 0]);
}

#[test]
fn a_second_picture_is_compared_step_by_step() {
    use crate::app::view::comparison::OtherJob;
    let context = context();
    let (mut ours, mut other) = (Engine::new(&context), Engine::new(&context));
    let own = request("builtin:cornell-box --set rays_per_element=256 --spp 16");
    let film = ours.render(&own, &Unwatched).unwrap();
    let reference = request("builtin:cornell-box --method path-tracing");
    let mut job = Some(OtherJob::new(own, reference));
    let mut figures = Vec::new();
    let mut before = None;
    for _ in 0..5 {
        let Some(next) = job.take() else { break };
        let (compared, rest) =
            next.work(&context, (&mut ours, &mut other), &film, before.as_ref(), &Unwatched).unwrap();
        let compared = compared.unwrap();
        figures.push((compared.spp, compared.relative_mse.unwrap(), compared.bounces.len()));
        (before, job) = (Some(compared), rest);
    }
    // A picture, its bounces, and ever finer ones: noise falls, and light agrees.
    assert_eq!(figures.iter().map(|f| (f.0, f.2)).collect::<Vec<_>>(), [(8, 0), (8, 2), (16, 2), (32, 2), (64, 2)]);
    assert!(figures[4].1 < figures[0].1 && figures[4].1 > 0.0, "{figures:?}");
    let compared = before.unwrap();
    assert!((compared.mean_ratio.unwrap() - 1.0).abs() < 0.1, "{:?}", compared.mean_ratio);
    for [own, other] in &compared.bounces {
        assert!((own / other - 1.0).abs() < 0.2, "{:?}", compared.bounces);
    }
    assert!(context.download(&compared.difference.direct).unwrap().iter().any(|color| *color != Vec3::ZERO));
}
