//! What ran, how long, and how much it moved: one record per pass, in the order of the commands.

/// One timed pass.
#[derive(Debug, Clone, PartialEq)]
pub struct PassRecord {
    /// Enclosing scopes and the program, `frame/explicit-visibility/bounce 2/gather/links`.
    pub path: String,
    /// The program (or transfer) alone, `gather/links`.
    pub name: &'static str,
    /// Device clock, nanoseconds.
    pub start_ns: u64,
    pub end_ns: u64,
    /// Bytes the algorithm has to move: as stated at the call, else every bound object once.
    pub bytes_read: u64,
    pub bytes_written: u64,
    /// Named counts: threads or vertices asked for, and with statistics on what the device counted.
    pub counters: Vec<(&'static str, u64)>,
    /// No barrier stood between this pass and the one before it: their times overlap.
    pub overlapped: bool,
}

/// A moment on both clocks, to lay device times beside host times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockPair {
    /// Device clock, nanoseconds.
    pub device_ns: u64,
    /// CLOCK_MONOTONIC, nanoseconds.
    pub host_ns: u64,
    /// How far the pair may be off.
    pub max_deviation_ns: u64,
}

/// What a pass costs by its algorithm, where that is not "every bound object once".
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Cost {
    pub bytes_read: u64,
    pub bytes_written: u64,
}
