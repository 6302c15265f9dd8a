//! The setting of debug views that names one element: by its number, or by the pixel it is seen through.

use super::settings::{Kind, SettingValue};
use serde_json::Value;
use std::ops::RangeInclusive;

/// The element that a debug view is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pick {
    Nothing,
    Element(u32),
    /// From the top left corner of the picture.
    Pixel {
        x: u32,
        y: u32,
    },
}

impl SettingValue for Pick {
    fn kind(_: Option<RangeInclusive<Self>>) -> Kind {
        Kind::Text { form: "none, the number of an element, or a pixel as X,Y" }
    }

    fn parse(text: &str) -> Option<Self> {
        match text.split_once(',') {
            None if text == "none" => Some(Self::Nothing),
            None => text.parse().ok().map(Self::Element),
            Some((x, y)) => Some(Self::Pixel { x: x.trim().parse().ok()?, y: y.trim().parse().ok()? }),
        }
    }

    fn to_json(self) -> Value {
        match self {
            Self::Nothing => "none".into(),
            Self::Element(element) => element.to_string().into(),
            Self::Pixel { x, y } => format!("{x},{y}").into(),
        }
    }

    fn is_in(self, _: &Kind) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picks_read_as_they_are_recorded() {
        for pick in [Pick::Nothing, Pick::Element(7), Pick::Pixel { x: 120, y: 0 }] {
            assert_eq!(Pick::parse(pick.to_json().as_str().unwrap()), Some(pick));
        }
        assert!(["", "7,", ",", "1,2,3", "-1", "x"].iter().all(|text| Pick::parse(text).is_none()));
    }
}
