//! Long work, watched: stages and methods say how far they are, and hear whether they are still wanted.

/// Whoever asked for the work wants it no longer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted; nothing was written")]
pub struct Interrupted;

/// Told between two steps of long work; the command line shows a bar and listens for Ctrl-C.
pub trait Watch {
    /// `done` of `total` steps of `task` are done. An error ends the work: pass it on.
    fn step(&self, task: &str, done: u64, total: u64) -> Result<(), Interrupted>;
}

/// Nobody watches.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn step(&self, _: &str, _: u64, _: u64) -> Result<(), Interrupted> {
        Ok(())
    }
}
