//! State files: what decides a picture, as the options of `linklight render`, one a line, so that a file says itself
//! how to repeat its picture. `linklight view` writes them; `--state FILE` takes them.
//!
//! ```text
//! # linklight 0.1.0: linklight render --state FILE -o out.png
//! builtin:cornell-box
//! --method=explicit-visibility
//! --bounces=4
//! ```

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use glam::Vec3;

use super::AppError;
use super::cli::PictureArgs;
use crate::files;
use crate::report::write::write_text;
use crate::scene::environment::load::EnvironmentSource;

/// Longest state file that is read, bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Commands that take `--state`.
const COMMANDS: [&str; 2] = ["render", "view"];

/// The command line with the content of a state file in the place of `--state FILE`, before all other options of the
/// command, so that those override it.
pub fn expand(args: impl IntoIterator<Item = OsString>) -> Result<Vec<OsString>, AppError> {
    let mut args: Vec<OsString> = args.into_iter().collect();
    let Some(command) = args.iter().skip(1).position(|arg| COMMANDS.iter().any(|command| arg == *command)) else {
        return Ok(args);
    };
    let first = command + 2;
    let named = |arg: &OsString| arg.to_str().and_then(|arg| arg.strip_prefix("--state=")).map(PathBuf::from);
    let Some(at) = (first..args.len()).find(|&i| args[i] == "--state" || named(&args[i]).is_some()) else {
        return Ok(args);
    };
    let option = args.remove(at);
    let path = match named(&option) {
        Some(path) => path,
        None if at < args.len() => args.remove(at).into(),
        None => return Err(AppError::Usage("--state needs a file, such as one that `linklight view` wrote".into())),
    };
    let given: Vec<String> = args[first..].iter().filter_map(|arg| option_name(arg.to_str()?)).collect();
    let lines = read(&path)?;
    let stays = |line: &OsString| line.to_str().and_then(option_name).is_none_or(|name| !is_overridden(&name, &given));
    args.splice(first..first, lines.into_iter().filter(stays));
    Ok(args)
}

/// The name of `--name` or `--name=value`.
fn option_name(word: &str) -> Option<String> {
    word.strip_prefix("--").map(|rest| rest.split('=').next().unwrap_or(rest).to_owned())
}

/// Whether an option of a state gives way to those of the command line. A camera of the scene replaces a free one;
/// settings and edits add up, the last of each standing.
fn is_overridden(name: &str, given: &[String]) -> bool {
    let is_given = |name: &str| given.iter().any(|other| other == name);
    match name {
        "set" | "edit" => false,
        "eye" | "look-at" | "fov" => is_given(name) || is_given("camera"),
        "direct-only" | "indirect-only" => is_given("direct-only") || is_given("indirect-only"),
        name => is_given(name),
    }
}

fn read(path: &Path) -> Result<Vec<OsString>, AppError> {
    let refuse = |reason: String| AppError::Usage(format!("cannot take the state {}: {reason}", path.display()));
    let bytes = files::metadata(path).map_err(|error| refuse(error.to_string()))?.len();
    if bytes > MAX_BYTES {
        return Err(refuse(format!("{bytes} bytes long, at most {MAX_BYTES} are read; is it another file?")));
    }
    let text = files::read_to_string(path).map_err(|error| refuse(error.to_string()))?;
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    Ok(lines.map(OsString::from).collect())
}

/// Writes a state file, whole or not at all.
pub fn write(path: &Path, args: &PictureArgs) -> Result<(), AppError> {
    let version = env!("CARGO_PKG_VERSION");
    let mut text = format!("# linklight {version}: linklight render --state FILE -o out.png\n");
    for option in options(args) {
        text += &option;
        text.push('\n');
    }
    Ok(write_text(path, &text)?)
}

/// The scene and every option that is not at its default: what `linklight render` needs for the same picture.
pub fn options(args: &PictureArgs) -> Vec<String> {
    let mut options = vec![args.scene.to_string()];
    let mut option = |name: &str, value: String| options.push(format!("--{name}={value}"));
    option("method", args.method.key.to_owned());
    if let Some(display) = args.display {
        option("display", name(&display));
    }
    option("bounces", args.bounces.to_string());
    option("size", format!("{}x{}", args.size.0, args.size.1));
    if let Some(spp) = args.spp {
        option("spp", spp.to_string());
    }
    if args.seconds != 0.0 {
        option("seconds", args.seconds.to_string());
    }
    if let Some(camera) = &args.camera {
        option("camera", camera.name.clone());
    }
    if let (Some(eye), Some(look_at)) = (args.eye, args.look_at) {
        option("eye", place(eye));
        option("look-at", place(look_at));
        option("fov", args.fov.to_string());
    }
    match &args.env {
        Some(EnvironmentSource::Constant(radiance)) => option("env", place(*radiance)),
        Some(EnvironmentSource::File(path)) => option("env", path.display().to_string()),
        None => {}
    }
    if args.env_turn != 0.0 {
        option("env-turn", args.env_turn.to_string());
    }
    if let Some(elements) = args.elements {
        option("elements", elements.to_string());
    }
    option("exposure", args.exposure.to_string());
    option("tonemap", name(&args.tonemap));
    option("rays", name(&args.rays));
    option("seed", args.seed.to_string());
    for set in &args.set {
        option("set", format!("{}={}", set.key, set.value));
    }
    if let Some(view) = &args.view {
        option("view", view.clone());
    }
    for edit in &args.edit {
        option("edit", edit.to_string());
    }
    let switches =
        [("diffuse", args.diffuse), ("direct-only", args.direct_only), ("indirect-only", args.indirect_only)];
    options.extend(switches.iter().filter(|(_, on)| *on).map(|(name, _)| format!("--{name}")));
    options
}

/// Numbers as they read back, bit for bit.
fn place(place: Vec3) -> String {
    format!("{},{},{}", place.x, place.y, place.z)
}

/// As the command line spells a value.
pub fn name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::app::cli::{Cli, Command};

    fn words(line: &str) -> Vec<OsString> {
        line.split_whitespace().map(OsString::from).collect()
    }

    fn picture(words: Vec<OsString>) -> Result<PictureArgs, String> {
        match Cli::try_parse_from(words).map_err(|error| error.to_string())?.command {
            Command::View(args) => Ok(args.picture),
            Command::Render(args) => Ok(args.picture),
            _ => Err("another command".into()),
        }
    }

    #[test]
    fn a_written_state_reads_back_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.state");
        for line in [
            "linklight view builtin:maze",
            "linklight view a.glb --method path-tracing --spp 9 --bounces 2 --size 33x21 --seconds 0.1 --direct-only \
             --camera 2 --env 0.1,0,2 --env-turn -30.5 --diffuse --elements 77 --exposure -1.25 --tonemap filmic \
             --rays compute --seed 5 --set emitter-sampling=area",
            "linklight view a.gltf --display final-gather --eye -1.1,2,3e-3 --look-at 0,1.7,-4 --fov 33.3 \
             --env sky.hdr --indirect-only --edit material:0.albedo=0.5 --edit node:1.move=-1,0,0.125 --set rays_per_element=64 --set gather_visibility=rays",
        ] {
            let args = picture(words(line)).unwrap();
            write(&file, &args).unwrap();
            let mut replay = words("linklight render");
            replay.push(format!("--state={}", file.display()).into());
            replay.extend(words("-o out.exr"));
            let again = picture(expand(replay).unwrap()).unwrap();
            assert_eq!(options(&again), options(&args), "{line}");
            assert_eq!((again.eye, again.look_at, again.fov), (args.eye, args.look_at, args.fov));
        }
    }

    #[test]
    fn further_options_override_a_state() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.state");
        write(&file, &picture(words("linklight view builtin:maze --bounces 2 --seed 3")).unwrap()).unwrap();
        let mut line = words("linklight render --bounces 7 --state");
        line.push(file.clone().into());
        line.extend(words("-o a.png"));
        let args = picture(expand(line).unwrap()).unwrap();
        assert_eq!((args.bounces, args.seed), (7, 3));

        write(
            &file,
            &picture(words("linklight view a.glb --eye 1,2,3 --look-at 0,0,0 --set rays_per_element=64")).unwrap(),
        )
        .unwrap();
        let mut line = words("linklight render --camera=1 --set smoothing=false -o a.png --state");
        line.push(file.into());
        let args = picture(expand(line).unwrap()).unwrap();
        assert_eq!((args.eye, args.look_at, args.set.len()), (None, None, 2));
        assert_eq!(args.camera.unwrap().name, "1");
    }

    #[test]
    fn what_is_no_state_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("none");
        for line in [vec!["linklight", "view", "--state", missing.to_str().unwrap()], vec!["l", "render", "--state"]] {
            assert!(matches!(expand(line.into_iter().map(OsString::from)), Err(AppError::Usage(_))));
        }
        let file = folder.path().join("odd");
        std::fs::write(&file, "builtin:maze\n--bounces=many\n").unwrap();
        let line = vec!["linklight".into(), "view".into(), "--state".into(), file.into_os_string()];
        assert!(picture(expand(line).unwrap()).unwrap_err().contains("many"));
        let untouched = words("linklight methods --json");
        assert_eq!(expand(untouched.clone()).unwrap(), untouched);
    }
}
