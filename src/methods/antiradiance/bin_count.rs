//! How many direction bins an element has: whole squares of cells in each octant.

use crate::methods::settings::{ChoiceValue, Kind, SettingValue};
use serde_json::Value;
use std::ops::RangeInclusive;

/// `m = 8 k^2` bins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BinCount {
    octant_side: u32,
}

const CHOICES: [(u32, &str, &str); 9] = [
    (3, "72", "3 x 3 cells an octant"),
    (4, "128", "4 x 4"),
    (5, "200", "5 x 5"),
    (6, "288", "6 x 6"),
    (7, "392", "7 x 7"),
    (8, "512", "8 x 8"),
    (9, "648", "9 x 9"),
    (10, "800", "10 x 10"),
    (11, "968", "11 x 11"),
];

impl BinCount {
    /// `None` unless the count is one of those allowed.
    pub fn new(count: u32) -> Option<Self> {
        let allowed = CHOICES.iter().find(|(k, ..)| 8 * k * k == count);
        allowed.map(|&(octant_side, ..)| Self { octant_side })
    }

    pub const fn of_octant_side(octant_side: u32) -> Self {
        Self { octant_side }
    }

    /// Bins over the whole sphere.
    pub fn get(self) -> u32 {
        8 * self.octant_side * self.octant_side
    }

    /// Cells a side of an octant, k.
    pub fn octant_side(self) -> u32 {
        self.octant_side
    }
}

impl SettingValue for BinCount {
    fn kind(_: Option<RangeInclusive<Self>>) -> Kind {
        Kind::Choice { values: CHOICES.iter().map(|&(_, name, doc)| ChoiceValue { name, doc }).collect() }
    }

    fn parse(text: &str) -> Option<Self> {
        text.parse().ok().and_then(Self::new)
    }

    fn to_json(self) -> Value {
        self.get().into()
    }

    fn is_in(self, _: &Kind) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_squares_are_taken() {
        for (k, name, _) in CHOICES {
            assert_eq!(BinCount::parse(name).unwrap(), BinCount::of_octant_side(k));
            assert_eq!(BinCount::of_octant_side(k).get().to_string(), name);
        }
        assert!([0, 8, 100, 127, 1024].iter().all(|&count| BinCount::new(count).is_none()));
    }
}
