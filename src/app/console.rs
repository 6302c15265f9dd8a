//! What goes to standard error: log lines and progress bars that do not overwrite each other.

use std::cell::RefCell;
use std::io::{self, IsTerminal as _, Write};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

use super::AppError;
use super::interrupt::Interrupt;
use crate::stages::work::{Interrupted, Watch};

/// How much is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only, no progress bar.
    Quiet,
    /// Notes and warnings.
    Normal,
    /// Also what is done step by step (`-v`).
    Detailed,
    /// Everything (`-vv`).
    All,
}

impl Verbosity {
    /// Other crates are heard from one step later than our own modules.
    fn filter(self) -> &'static str {
        match self {
            Self::Quiet => "error",
            Self::Normal => "warn,linklight=info",
            Self::Detailed => "warn,linklight=debug",
            Self::All => "debug,linklight=trace",
        }
    }
}

/// Progress bars and log lines on standard error. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Console {
    bars: MultiProgress,
    visible: bool,
}

impl Console {
    /// Start logging. `RUST_LOG`, when set and readable, decides in place of `verbosity`.
    pub fn start(verbosity: Verbosity) -> Self {
        let visible = verbosity != Verbosity::Quiet && io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let console = Self { bars: MultiProgress::with_draw_target(target), visible };

        let ours = || EnvFilter::new(verbosity.filter());
        let (filter, complaint) = match std::env::var("RUST_LOG") {
            Ok(directives) if !directives.is_empty() => match EnvFilter::try_new(&directives) {
                Ok(filter) => (filter, None),
                Err(error) => (ours(), Some(format!("RUST_LOG={directives:?} is not understood and ignored: {error}"))),
            },
            _ => (ours(), None),
        };
        // A second start in one process (tests) keeps the first subscriber.
        let _ = tracing_subscriber::fmt()
            .with_env_filter(filter)
            .with_writer(console.clone())
            .with_ansi(io::stderr().is_terminal())
            .without_time()
            .with_target(verbosity == Verbosity::All)
            .try_init();
        if let Some(complaint) = complaint {
            tracing::warn!("{complaint}");
        }
        console
    }

    /// A bar over `length` steps; silent where standard error is no terminal. Dropping it removes it.
    fn progress(&self, task: &str, length: u64) -> Progress {
        if !self.visible {
            return Progress(ProgressBar::hidden());
        }
        let style = ProgressStyle::with_template("{msg:24} {wide_bar} {pos}/{len} {elapsed} left {eta}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = self.bars.add(ProgressBar::new(length)).with_style(style).with_message(task.to_owned());
        Progress(bar)
    }
}

/// A running progress bar.
#[derive(Debug)]
struct Progress(ProgressBar);

/// Shows a bar for whatever long work is done at the time, and ends it where the user asks.
pub struct Watcher<'a> {
    console: &'a Console,
    interrupt: &'a Interrupt,
    bar: RefCell<Option<(String, Progress)>>,
}

impl<'a> Watcher<'a> {
    pub fn new(console: &'a Console, interrupt: &'a Interrupt) -> Self {
        Self { console, interrupt, bar: RefCell::new(None) }
    }

    /// What one run of many gave, or its error in words; the errors that end them all are passed on: no GPU, and the
    /// user's Ctrl-C, which may come wrapped in an error of the work it ended.
    pub fn attempt<T>(&self, result: Result<T, AppError>) -> Result<Result<T, String>, AppError> {
        match result {
            Ok(done) => Ok(Ok(done)),
            Err(AppError::Partial(_)) => Err(Interrupted.into()),
            Err(error @ (AppError::Interrupted(_) | AppError::NoGpu(_))) => Err(error),
            Err(error) => {
                *self.bar.borrow_mut() = None;
                self.interrupt.check()?;
                Ok(Err(error.to_string()))
            }
        }
    }
}

impl Watch for Watcher<'_> {
    fn step(&self, task: &str, done: u64, total: u64) -> Result<(), Interrupted> {
        let mut bar = self.bar.borrow_mut();
        if done >= total {
            *bar = None;
        } else {
            if bar.as_ref().is_none_or(|(name, _)| name != task) {
                *bar = Some((task.to_owned(), self.console.progress(task, total)));
            }
            if let Some((_, bar)) = &*bar {
                bar.0.set_position(done);
            }
        }
        self.interrupt.check()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

impl Write for Console {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bars.suspend(|| io::stderr().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

impl<'a> MakeWriter<'a> for Console {
    type Writer = Self;

    fn make_writer(&'a self) -> Self::Writer {
        self.clone()
    }
}
