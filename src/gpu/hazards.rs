//! Which barriers a sequence of passes needs, from what each reads and writes.

use std::collections::HashSet;

/// Objects touched since the last full barrier.
#[derive(Default)]
pub(super) struct Hazards {
    read: HashSet<u64>,
    written: HashSet<u64>,
    /// Inside an overlap nothing conflicts by promise.
    overlapping: bool,
}

/// One object a pass touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Access {
    pub id: u64,
    pub reads: bool,
    pub writes: bool,
}

impl Hazards {
    /// Notes the accesses of the next pass; true when a barrier must stand before it.
    pub fn needs_barrier(&mut self, accesses: &[Access]) -> bool {
        let conflict = |a: &Access| {
            (a.reads && self.written.contains(&a.id))
                || (a.writes && (self.written.contains(&a.id) || self.read.contains(&a.id)))
        };
        let needed = !self.overlapping && accesses.iter().any(conflict);
        if needed {
            self.clear();
        }
        for access in accesses {
            if access.reads {
                self.read.insert(access.id);
            }
            if access.writes {
                self.written.insert(access.id);
            }
        }
        needed
    }

    /// After a full barrier.
    pub fn clear(&mut self) {
        self.read.clear();
        self.written.clear();
    }

    pub fn set_overlapping(&mut self, overlapping: bool) {
        self.overlapping = overlapping;
    }

    pub fn is_overlapping(&self) -> bool {
        self.overlapping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(id: u64, kind: &str) -> Access {
        Access { id, reads: kind.contains('r'), writes: kind.contains('w') }
    }

    #[test]
    fn every_order_of_two_accesses() {
        for (first, second, expected) in [
            ("r", "r", false),
            ("r", "w", true),
            ("w", "r", true),
            ("w", "w", true),
            ("rw", "r", true),
            ("r", "rw", true),
        ] {
            let mut hazards = Hazards::default();
            assert!(!hazards.needs_barrier(&[access(1, first)]));
            assert_eq!(hazards.needs_barrier(&[access(1, second)]), expected, "{first} then {second}");
            assert!(!hazards.needs_barrier(&[access(2, "rw")]), "another object never conflicts");
        }
    }

    #[test]
    fn a_barrier_forgets_what_was_before_it() {
        let mut hazards = Hazards::default();
        hazards.needs_barrier(&[access(1, "w"), access(2, "w")]);
        assert!(hazards.needs_barrier(&[access(1, "r")]));
        assert!(!hazards.needs_barrier(&[access(2, "r")]), "the barrier covered object 2 as well");
    }

    #[test]
    fn an_overlap_waives_the_check_but_is_remembered() {
        let mut hazards = Hazards::default();
        hazards.set_overlapping(true);
        hazards.needs_barrier(&[access(1, "w")]);
        assert!(!hazards.needs_barrier(&[access(1, "w")]));
        hazards.set_overlapping(false);
        assert!(hazards.needs_barrier(&[access(1, "r")]));
    }
}
