//! What goes to standard error: log lines and progress bars that do not overwrite each other.

use std::io::{self, IsTerminal as _, Write};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

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
    pub fn progress(&self, task: &str, length: u64) -> Progress {
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
pub struct Progress(ProgressBar);

impl Progress {
    /// `count` more steps are done.
    pub fn advance(&self, count: u64) {
        self.0.inc(count);
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
