//! One file per subcommand, and what they share: the command line, errors with exit codes, interruption, progress.
//!
//! | module | command |
//! |---|---|
//! | [`render`] | `linklight render`: a scene by a method into a picture |
//! | [`bake`] | `linklight bake`: a solution into the scene |
//! | `view` | `linklight view`: a scene in a window |
//! | [`mod@bench`] | `linklight bench`: how long frames and passes take, with confidence |
//! | [`compare`] | `linklight compare`: methods and settings beside the reference, as a page |
//! | [`leak`] | `linklight leak`: light through closed walls, by method |
//! | [`lag`] | `linklight lag`: frames until a change of the lights is seen |
//! | [`papers`] | `linklight papers`: the papers' tables and figures, measured here |
//! | [`diff`] | `linklight diff`: error figures of two pictures |
//! | [`diverge`] | `linklight diverge`: the first pass in which two runs part |
//! | [`devices`] | `linklight devices`: GPUs, usable or not |
//! | [`methods`] | `linklight methods`: methods and their settings |
//!
//! A command writes what it was asked for to `out`; notes, progress and logs go to standard error.

pub mod bake;
pub mod bench;
pub mod cli;
mod cli_evidence;
pub mod compare;
pub mod console;
mod crash;
pub mod devices;
pub mod diff;
pub mod diverge;
pub mod edits;
mod error;
mod explain;
mod frame;
pub mod interrupt;
pub mod lag;
pub mod leak;
pub mod measure;
pub mod methods;
mod on_clusters;
mod on_elements;
mod on_texels;
pub mod output;
pub mod papers;
pub mod render;
mod stage;
pub mod state;
mod target;
pub mod values;
mod view;
pub mod views;

use std::io::Write;

pub use error::AppError;

/// Run a parsed command line.
pub fn run(cli: cli::Cli, out: &mut dyn Write) -> Result<(), AppError> {
    let console = console::Console::start(cli.global.verbosity());
    match cli.command {
        cli::Command::Render(args) => {
            let request = render::RenderRequest::try_from(*args)?;
            let interrupt = interrupt::Interrupt::install();
            render::run(&request, &cli.global, &console, &interrupt, out)
        }
        cli::Command::View(args) => view::run(&args, &cli.global),
        cli::Command::Bench(args) => {
            let interrupt = interrupt::Interrupt::install();
            bench::run(&args, &cli.global, &console, &interrupt, out)
        }
        cli::Command::Compare(args) => {
            let interrupt = interrupt::Interrupt::install();
            compare::run(&args, &cli.global, &console, &interrupt, out)
        }
        cli::Command::Bake(args) => {
            let interrupt = interrupt::Interrupt::install();
            bake::run(&args, &cli.global, &console, &interrupt, out)
        }
        cli::Command::Papers(args) => {
            let interrupt = interrupt::Interrupt::install();
            papers::run(&args, &cli.global, &console, &interrupt, out)
        }
        cli::Command::Leak(args) => {
            let interrupt = interrupt::Interrupt::install();
            leak::run(&args, &cli.global, &console, &interrupt, out)
        }
        cli::Command::Lag(args) => {
            let interrupt = interrupt::Interrupt::install();
            lag::run(&args, &cli.global, &console, &interrupt, out)
        }
        cli::Command::Diff(args) => diff::run(&args, out),
        cli::Command::Diverge(args) => diverge::run(&args, out),
        cli::Command::Devices(args) => devices::run(&args, &cli.global, out),
        cli::Command::Methods(args) => methods::run(&args, out),
    }
}
