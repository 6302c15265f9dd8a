//! What `compare` runs: methods x variations, each as the command line of the `linklight render` that repeats it.

use std::path::Path;
use std::str::FromStr;

use clap::Parser as _;

use crate::app::AppError;
use crate::app::cli::{Cli, Command, Global};
use crate::app::render::RenderRequest;
use crate::app::values::SceneSource;
use crate::display::final_gather;
use crate::methods::settings::{Assignment, SettingGroup as _};
use crate::methods::{METHODS, Method, find};

/// The method that the others are held to.
pub const REFERENCE: &str = "path-tracing";

/// Most runs of one command; a typing error in `--vary` must not ask for a week.
const MAX_RUNS: usize = 10_000;

/// One `--vary NAME=V1,V2,...`: a method's setting, or an option of `render`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variation {
    pub name: String,
    pub values: Vec<String>,
}

impl FromStr for Variation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = || "expected NAME=VALUE,VALUE,... such as rays_per_element=64,256".to_owned();
        let (name, values) = text.split_once('=').ok_or_else(form)?;
        let values: Vec<String> = values.split(',').map(str::to_owned).collect();
        if name.is_empty() || values.iter().any(String::is_empty) {
            return Err(form());
        }
        Ok(Self { name: name.trim_start_matches('-').to_owned(), values })
    }
}

/// One picture to make.
#[derive(Debug, Clone)]
pub struct Run {
    pub request: RenderRequest,
    /// What sets it apart from the other runs of its method: `rays_per_element=64`.
    pub variation: String,
    /// The command that repeats it.
    pub command: String,
    /// The global options of that command: `--vary gpu=0,1` chooses a device for each.
    pub global: Global,
}

/// The methods that were asked for, or all.
pub fn methods_or_all(chosen: &[&'static Method]) -> Vec<&'static Method> {
    if chosen.is_empty() { METHODS.iter().collect() } else { chosen.to_vec() }
}

/// What all runs share.
pub struct Plan<'a> {
    pub methods: Vec<&'static Method>,
    pub variations: &'a [Variation],
    /// For every method that has the setting.
    pub set: &'a [Assignment],
    /// Options of `render` for all runs, the reference included.
    pub options: &'a [String],
    pub global: &'a Global,
}

impl Plan<'_> {
    /// Refuses a setting that none of the methods has: a misspelt name would change nothing in silence.
    pub fn check(&self) -> Result<(), AppError> {
        let known = |name: &str| self.methods.iter().any(|method| has_setting(method, name));
        if let Some(unknown) = self.set.iter().find(|set| !known(&set.key)) {
            let keys: Vec<&str> = self.methods.iter().map(|method| method.key).collect();
            let message = format!("no method compared ({}) has the setting {:?}", keys.join(", "), unknown.key);
            return Err(AppError::Usage(message));
        }
        let runs = self.variations.iter().try_fold(self.methods.len(), |n, v| n.checked_mul(v.values.len()));
        match runs {
            Some(runs) if runs <= MAX_RUNS => Ok(()),
            _ => Err(AppError::Usage(format!(
                "--vary asks for more than {MAX_RUNS} pictures a scene; give fewer values"
            ))),
        }
    }

    /// The reference of a scene, of as many bounces as the others.
    pub fn reference(&self, scene: &SceneSource, folder: &Path) -> Result<Run, AppError> {
        let Some(method) = find(REFERENCE) else { return Err(AppError::failed("the reference is no method")) };
        self.run(scene, method, &[], &folder.join("reference.exr"))
    }

    /// Every other picture of a scene, into `folder`.
    pub fn runs(&self, scene: &SceneSource, folder: &Path) -> Result<Vec<Run>, AppError> {
        let mut runs = Vec::new();
        for method in &self.methods {
            for choice in self.choices(method) {
                let name = format!("{}-{}.exr", method.key, runs.len() + 1);
                runs.push(self.run(scene, method, &choice, &folder.join(name))?);
            }
        }
        Ok(runs)
    }

    /// Every combination of the variations that mean something to `method`; one empty one where none does.
    fn choices(&self, method: &Method) -> Vec<Vec<(&str, &str)>> {
        let mut choices = vec![Vec::new()];
        for Variation { name, values } in self.variations.iter().filter(|v| applies(method, &v.name)) {
            choices = choices
                .iter()
                .flat_map(|so_far| {
                    values.iter().map(move |value| {
                        let mut choice: Vec<(&str, &str)> = so_far.clone();
                        choice.push((name, value));
                        choice
                    })
                })
                .collect();
        }
        choices
    }

    /// One picture by `method`, with these settings and options on top of what all runs share.
    pub fn run(
        &self,
        scene: &SceneSource,
        method: &'static Method,
        choice: &[(&str, &str)],
        output: &Path,
    ) -> Result<Run, AppError> {
        let mut words = vec!["linklight".to_owned(), "render".into(), scene.to_string()];
        words.extend(["-o".to_owned(), output.display().to_string(), "--method".into(), method.key.into()]);
        if let Some(gpu) = self.global.gpu.as_ref().filter(|_| choice.iter().all(|(name, _)| *name != "gpu")) {
            words.extend(["--gpu".to_owned(), gpu.clone()]);
        }
        words.extend(options_for(method, self.options));
        for set in self.set.iter().filter(|set| has_setting(method, &set.key)) {
            words.extend(["--set".to_owned(), format!("{}={}", set.key, set.value)]);
        }
        for (name, value) in choice {
            if has_setting(method, name) {
                words.extend(["--set".to_owned(), format!("{name}={value}")]);
            } else {
                words.extend([format!("--{name}"), (*value).to_owned()]);
            }
        }
        let command = words.iter().map(|word| shell_word(word)).collect::<Vec<_>>().join(" ");
        let cli = Cli::try_parse_from(&words).map_err(|error| {
            let message = error.render().to_string();
            AppError::Usage(format!("`{command}` is not understood:\n{}", message.trim_start_matches("error: ").trim()))
        })?;
        let Command::Render(args) = cli.command else { return Err(AppError::failed("not a render")) };
        let request = RenderRequest::try_from(*args)?;
        if request.profile.is_some() || request.trace.is_some() || request.capture.is_some() {
            let message = "--profile, --trace and --capture write one file; give them to `linklight render`";
            return Err(AppError::Usage(message.into()));
        }
        let variation = choice.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ");
        let own = self.global.clone();
        let global = Global {
            validate: own.validate || cli.global.validate,
            full_barriers: own.full_barriers || cli.global.full_barriers,
            small_device: own.small_device || cli.global.small_device,
            max_memory: cli.global.max_memory.or(own.max_memory),
            gpu_timeout: cli.global.gpu_timeout.or(own.gpu_timeout),
            crash_file: cli.global.crash_file.or(own.crash_file),
            lose_device_at: cli.global.lose_device_at.or(own.lose_device_at),
            ..cli.global
        };
        Ok(Run { request, variation, command, global })
    }
}

/// Of its own, or of the final gather that shows it.
fn has_setting(method: &Method, name: &str) -> bool {
    let of_display = || final_gather::Settings::specs().iter().any(|spec| spec.name == name);
    method.specs().iter().any(|spec| spec.name == name) || method.key != REFERENCE && of_display()
}

/// A setting applies to the methods that have it; any other name is an option of `render`, for all of them.
fn applies(method: &Method, name: &str) -> bool {
    has_setting(method, name) || !METHODS.iter().any(|other| has_setting(other, name))
}

/// The reference has pixels of its own: what a display stage is told means nothing to it, or something else.
fn options_for(method: &Method, options: &[String]) -> Vec<String> {
    const DISPLAY_OPTIONS: [&str; 3] = ["--display", "--elements", "--spp"];
    let mut kept = Vec::new();
    let mut words = options.iter();
    while let Some(word) = words.next() {
        let name = word.split('=').next().unwrap_or(word);
        if method.key == REFERENCE && DISPLAY_OPTIONS.contains(&name) {
            if name == word {
                words.next();
            }
            continue;
        }
        kept.push(word.clone());
    }
    kept
}

/// As a POSIX shell reads it back.
fn shell_word(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan<'a>(variations: &'a [Variation], set: &'a [Assignment], options: &'a [String]) -> Plan<'a> {
        let methods = vec![find("explicit-visibility").unwrap(), find(REFERENCE).unwrap()];
        Plan { methods, variations, set, options, global: &Global::UNSAID }
    }

    fn texts(words: &[&str]) -> Vec<String> {
        words.iter().map(|word| (*word).to_owned()).collect()
    }

    #[test]
    fn settings_and_options_vary_where_they_mean_something() {
        let folder = tempfile::tempdir().unwrap();
        let variations: Vec<Variation> =
            ["rays_per_element=64,256", "elements=500,1000,2000"].map(|text| text.parse().unwrap()).to_vec();
        let set = [Assignment::parse("smoothing=false").unwrap()];
        let options = texts(&["--bounces", "2", "--spp=9", "--diffuse"]);
        let plan = plan(&variations, &set, &options);
        plan.check().unwrap();
        let scene: SceneSource = "builtin:furnace".parse().unwrap();
        let runs = plan.runs(&scene, folder.path()).unwrap();
        let explicit: Vec<&Run> = runs.iter().filter(|run| run.request.method.key != REFERENCE).collect();
        assert_eq!(explicit.len(), 6);
        assert_eq!(explicit[5].variation, "rays_per_element=256 elements=2000");
        assert_eq!(explicit[5].request.elements, Some(2000));
        assert!(explicit.iter().all(|run| run.request.spp == 9 && run.request.bounces == 2 && run.request.diffuse));
        assert!(explicit[0].command.contains("--set smoothing=false --set rays_per_element=64 --elements 500"));

        let reference = plan.reference(&scene, folder.path()).unwrap();
        assert_eq!((reference.request.spp, reference.request.bounces, reference.request.elements), (64, 2, None));
    }

    #[test]
    fn what_means_nothing_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let scene: SceneSource = "builtin:furnace".parse().unwrap();
        for bad in ["", "a", "a=", "=1", "a=1,,2"] {
            assert!(bad.parse::<Variation>().is_err(), "{bad:?}");
        }
        let set = [Assignment::parse("rays_per_elemnt=64").unwrap()];
        assert!(plan(&[], &set, &[]).check().unwrap_err().to_string().contains("rays_per_elemnt"));
        let many = vec![Variation { name: "seed".into(), values: vec!["1".into(); 200] }; 3];
        assert!(plan(&many, &[], &[]).check().unwrap_err().to_string().contains("fewer"));
        let misspelt = ["elemnts=5".parse().unwrap()];
        for plan in [
            plan(&misspelt, &[], &[]),
            plan(&[], &[], &texts(&["--profile", "p.json"])),
            plan(&[], &[], &texts(&["--method", "path-tracing"])),
        ] {
            assert!(matches!(plan.runs(&scene, folder.path()), Err(AppError::Usage(_))));
        }
    }

    #[test]
    fn commands_survive_a_shell() {
        assert_eq!(shell_word("builtin:maze"), "builtin:maze");
        assert_eq!(shell_word("a b'c"), r"'a b'\''c'");
    }
}
