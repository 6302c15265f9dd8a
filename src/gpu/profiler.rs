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

/// Records that a context holds until they are read, about 60 MB: long work must not fill the memory with them.
pub(super) const RECORDS_KEPT: usize = 1 << 18;

/// Appends what there is room for. False when the room ends with these records: once until the kept ones are taken.
pub(super) fn keep(kept: &mut Vec<PassRecord>, mut records: Vec<PassRecord>) -> bool {
    let room = RECORDS_KEPT - kept.len();
    let fits = records.len() <= room || room == 0;
    records.truncate(room);
    kept.append(&mut records);
    fits
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_kept_up_to_their_limit_and_the_first_loss_is_told() {
        let record = |start_ns| PassRecord {
            path: String::new(),
            name: "test",
            start_ns,
            end_ns: 0,
            bytes_read: 0,
            bytes_written: 0,
            counters: Vec::new(),
            overlapped: false,
        };
        let mut kept = Vec::new();
        assert!(keep(&mut kept, (0..RECORDS_KEPT as u64 - 2).map(record).collect()));
        assert!(!keep(&mut kept, vec![record(1), record(2), record(3)]));
        assert!(keep(&mut kept, vec![record(4)]), "told once");
        assert_eq!((kept.len(), kept.last().unwrap().start_ns), (RECORDS_KEPT, 2));
        kept.clear();
        assert!(keep(&mut kept, vec![record(5)]) && kept.len() == 1);
    }
}
