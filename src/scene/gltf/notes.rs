//! What was skipped, approximated or repaired while loading: each said once, in a bounded list.

use std::cell::RefCell;
use std::collections::HashSet;

/// A damaged file can have something to say about each of a million objects; nobody reads on after this many.
const MAX_NOTES: usize = 64;

/// Collects notes in the order they are first said.
#[derive(Debug, Default)]
pub struct Notes {
    said: RefCell<Said>,
}

#[derive(Debug, Default)]
struct Said {
    notes: Vec<String>,
    seen: HashSet<String>,
    left_off: usize,
}

impl Notes {
    pub fn say(&self, note: impl Into<String>) {
        let note = note.into();
        let mut said = self.said.borrow_mut();
        if said.seen.contains(&note) {
            return;
        }
        if said.notes.len() == MAX_NOTES {
            said.left_off += 1;
            return;
        }
        said.seen.insert(note.clone());
        said.notes.push(note);
    }

    pub fn into_vec(self) -> Vec<String> {
        let mut said = self.said.into_inner();
        if said.left_off > 0 {
            said.notes.push(format!("{} further notes are left off.", said.left_off));
        }
        said.notes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_said_once_and_bounded() {
        let notes = Notes::default();
        for index in 0..1000 {
            notes.say("again");
            notes.say(format!("note {index}"));
        }
        let notes = notes.into_vec();
        assert_eq!(notes.len(), MAX_NOTES + 1);
        assert_eq!(notes[0], "again");
        assert!(notes[MAX_NOTES].starts_with("937 further"), "{}", notes[MAX_NOTES]);
    }
}
