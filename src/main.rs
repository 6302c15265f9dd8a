//! The `linklight` command: parses the command line, runs it, turns the outcome into an exit code.

use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser as _;
use linklight::app;

fn main() -> ExitCode {
    let words = match app::state::expand(std::env::args_os()) {
        Ok(words) => words,
        Err(error) => return failed(&error),
    };
    let cli = match app::cli::Cli::try_parse_from(words) {
        Ok(cli) => cli,
        Err(error) => {
            // `--help` and `--version` come here too, with exit code 0. A closed pipe is no reason to fail.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let mut out = std::io::stdout();
    let result = app::run(cli, &mut out).and_then(|()| Ok(out.flush()?));
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is_closed_pipe() => ExitCode::SUCCESS,
        Err(error) => failed(&error),
    }
}

fn failed(error: &app::AppError) -> ExitCode {
    let _ = writeln!(std::io::stderr(), "error: {error}");
    ExitCode::from(error.exit_code())
}
