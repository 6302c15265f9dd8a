//! Ctrl-C (and SIGTERM) as a flag that long work polls, so that it ends between two steps with nothing half-written.

use crate::stages::work::Interrupted;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code when the user insists.
const EXIT_AT_ONCE: i32 = 130;

/// Cheap to clone; all clones see the same flag.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    requested: Arc<AtomicBool>,
}

impl Interrupt {
    /// Catch Ctrl-C and SIGTERM from now on. The first asks the work to end, the second ends the process at once.
    /// Where no handler can be set the default remains: the process ends, still without half-written files.
    pub fn install() -> Self {
        let interrupt = Self::default();
        let requested = Arc::clone(&interrupt.requested);
        let handler = move || {
            if requested.swap(true, Ordering::SeqCst) {
                std::process::exit(EXIT_AT_ONCE);
            }
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            tracing::debug!("no handler for interrupts: {error}");
        }
        interrupt
    }

    /// Ask the work to end, as Ctrl-C does.
    pub fn request(&self) {
        self.requested.store(true, Ordering::SeqCst);
    }

    /// An error once the user asked to stop. Call it between steps of long work.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.requested.load(Ordering::SeqCst) { Err(Interrupted) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_reaches_every_clone() {
        let interrupt = Interrupt::default();
        let worker = interrupt.clone();
        assert_eq!(worker.check(), Ok(()));
        interrupt.request();
        assert_eq!(worker.check(), Err(Interrupted));
    }
}
