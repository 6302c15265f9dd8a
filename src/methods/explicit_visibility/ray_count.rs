//! How many rays an element casts: a square grid of whole 4 x 4 blocks.

use crate::methods::settings::{ChoiceValue, Kind, SettingValue};
use serde_json::Value;
use std::ops::RangeInclusive;

/// A square number of rays whose root is a multiple of 4.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RayCount(u32);

const CHOICES: [(u32, &str, &str); 8] = [
    (16, "16", "4 x 4"),
    (64, "64", "8 x 8"),
    (144, "144", "12 x 12"),
    (256, "256", "16 x 16"),
    (400, "400", "20 x 20"),
    (576, "576", "24 x 24"),
    (784, "784", "28 x 28"),
    (1024, "1024", "32 x 32"),
];

impl RayCount {
    /// The paper's 16 x 16.
    pub const PAPER: Self = Self(256);

    /// `None` unless the count is one of those allowed.
    pub fn new(count: u32) -> Option<Self> {
        CHOICES.iter().any(|&(allowed, ..)| allowed == count).then_some(Self(count))
    }

    pub fn get(self) -> u32 {
        self.0
    }

    /// Rays a side of the grid.
    pub fn side(self) -> u32 {
        self.0.isqrt()
    }
}

impl SettingValue for RayCount {
    fn kind(_: Option<RangeInclusive<Self>>) -> Kind {
        Kind::Choice { values: CHOICES.iter().map(|&(_, name, doc)| ChoiceValue { name, doc }).collect() }
    }

    fn parse(text: &str) -> Option<Self> {
        text.parse().ok().and_then(Self::new)
    }

    fn to_json(self) -> Value {
        self.0.into()
    }

    fn is_in(self, _: &Kind) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_blocks_are_taken() {
        for (count, name, _) in CHOICES {
            let rays = RayCount::parse(name).unwrap();
            assert_eq!((rays.get(), rays.side() * rays.side(), rays.side() % 4), (count, count, 0));
        }
        assert!([0, 32, 100, 1025].iter().all(|&count| RayCount::new(count).is_none()));
    }
}
