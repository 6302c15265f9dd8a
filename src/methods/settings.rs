//! Settings as data: a method declares each of its settings once, with [`settings!`](crate::settings), and gets a
//! typed struct with defaults, parsing from `KEY=VALUE`, a listing, and a record for outputs.
//!
//! ```
//! linklight::choice! {
//!     /// How an emitter is picked.
//!     pub enum Pick {
//!         /// In proportion to power
//!         Power = "power",
//!         /// All alike
//!         Uniform = "uniform",
//!     }
//! }
//! linklight::settings! {
//!     /// What a method lets the user choose.
//!     pub struct Settings {
//!         /// Rays cast from every element.
//!         rays: u32 = 256, range 16..=1024, unit "rays", paper "256";
//!         /// How an emitter is picked.
//!         pick: Pick = Pick::Power, paper "not given";
//!     }
//! }
//! use linklight::methods::settings::{Assignment, SettingGroup as _};
//! let settings = Settings::from_assignments(&[Assignment::parse("rays=64").unwrap()]).unwrap();
//! assert_eq!((settings.rays, settings.pick), (64, Pick::Power));
//! assert_eq!(settings.record()["pick"], "power");
//! ```
//!
//! It knows no method: the declarations live with the methods.

use std::fmt;
use std::ops::RangeInclusive;

use serde::Serialize;
use serde_json::{Map, Value};

/// One declared setting, as `linklight methods` lists it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spec {
    /// The key of `--set KEY=VALUE` and of every record.
    pub name: &'static str,
    #[serde(flatten)]
    pub kind: Kind,
    pub default: Value,
    /// Empty for pure numbers, switches and choices.
    pub unit: &'static str,
    pub doc: &'static str,
    /// The value of the method's paper, in words.
    pub paper: &'static str,
}

/// Type and range of a setting.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum Kind {
    Bool,
    Int { min: u32, max: u32 },
    Float { min: f32, max: f32 },
    Choice { values: Vec<ChoiceValue> },
    Text { form: &'static str },
}

/// One value of a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ChoiceValue {
    pub name: &'static str,
    pub doc: &'static str,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool => f.write_str("true or false"),
            Self::Int { min, max } => write!(f, "a whole number from {min} to {max}"),
            Self::Float { min, max } => write!(f, "a number from {min} to {max}"),
            Self::Text { form } => f.write_str(form),
            Self::Choice { values } => {
                let names: Vec<&str> = values.iter().map(|value| value.name).collect();
                write!(f, "one of {}", names.join(", "))
            }
        }
    }
}

/// A `KEY=VALUE` that cannot be taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    #[error("{0:?} is not of the form KEY=VALUE")]
    Form(String),
    #[error("there is no setting {key:?}; {hint}")]
    Unknown { key: String, hint: String },
    #[error("{key}={value} is not allowed; {key} is {allowed}{}", if .unit.is_empty() { String::new() } else { format!(", in {}", .unit) })]
    Value { key: String, value: String, allowed: String, unit: &'static str },
}

/// One `KEY=VALUE` of the command line, not yet matched with a method.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    pub key: String,
    pub value: String,
}

impl Assignment {
    /// Split at the first `=`. Dashes in the key read as underscores.
    pub fn parse(text: &str) -> Result<Self, SettingError> {
        match text.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() => {
                Ok(Self { key: key.trim().replace('-', "_"), value: value.trim().to_owned() })
            }
            _ => Err(SettingError::Form(text.to_owned())),
        }
    }
}

/// What [`settings!`](crate::settings) gives a struct.
pub trait SettingGroup: Default {
    /// Every setting, in order of declaration.
    fn specs() -> Vec<Spec>;

    /// Set one. Nothing changes on an error.
    fn set(&mut self, assignment: &Assignment) -> Result<(), SettingError>;

    /// Values by name, as recorded in outputs.
    fn record(&self) -> Map<String, Value>;

    /// Defaults changed by `assignments`, the last of a key standing.
    fn from_assignments(assignments: &[Assignment]) -> Result<Self, SettingError> {
        let mut settings = Self::default();
        for assignment in assignments {
            settings.set(assignment)?;
        }
        Ok(settings)
    }
}

/// A type a setting may have: `bool`, `u32`, `f32`, or a [`choice!`](crate::choice).
pub trait SettingValue: Copy {
    /// The kind with its range; numbers without a declared range take all of their type.
    fn kind(range: Option<RangeInclusive<Self>>) -> Kind;
    /// `None` if the text does not name a value of the type. Ranges are checked by [`parse_value`].
    fn parse(text: &str) -> Option<Self>;
    fn to_json(self) -> Value;
    /// Whether the value lies in the kind's range.
    fn is_in(self, kind: &Kind) -> bool;
}

impl SettingValue for bool {
    fn kind(_: Option<RangeInclusive<Self>>) -> Kind {
        Kind::Bool
    }

    fn parse(text: &str) -> Option<Self> {
        match text {
            "true" | "on" | "yes" | "1" => Some(true),
            "false" | "off" | "no" | "0" => Some(false),
            _ => None,
        }
    }

    fn to_json(self) -> Value {
        self.into()
    }

    fn is_in(self, _: &Kind) -> bool {
        true
    }
}

impl SettingValue for u32 {
    fn kind(range: Option<RangeInclusive<Self>>) -> Kind {
        let (min, max) = range.unwrap_or(0..=u32::MAX).into_inner();
        Kind::Int { min, max }
    }

    fn parse(text: &str) -> Option<Self> {
        text.parse().ok()
    }

    fn to_json(self) -> Value {
        self.into()
    }

    fn is_in(self, kind: &Kind) -> bool {
        matches!(kind, Kind::Int { min, max } if (*min..=*max).contains(&self))
    }
}

impl SettingValue for f32 {
    fn kind(range: Option<RangeInclusive<Self>>) -> Kind {
        let (min, max) = range.unwrap_or(f32::MIN..=f32::MAX).into_inner();
        Kind::Float { min, max }
    }

    fn parse(text: &str) -> Option<Self> {
        text.parse().ok().filter(|value: &f32| value.is_finite())
    }

    /// The shortest decimal that reads back as the same `f32` (0.1, not 0.10000000149).
    fn to_json(self) -> Value {
        self.to_string().parse::<f64>().map_or(Value::Null, Value::from)
    }

    fn is_in(self, kind: &Kind) -> bool {
        matches!(kind, Kind::Float { min, max } if (*min..=*max).contains(&self))
    }
}

/// Parse and check the value of one assignment; used by the code of [`settings!`](crate::settings).
pub fn parse_value<T: SettingValue>(
    assignment: &Assignment,
    range: Option<RangeInclusive<T>>,
    unit: &'static str,
) -> Result<T, SettingError> {
    let kind = T::kind(range);
    T::parse(&assignment.value).filter(|value| value.is_in(&kind)).ok_or_else(|| SettingError::Value {
        key: assignment.key.clone(),
        value: assignment.value.clone(),
        allowed: kind.to_string(),
        unit,
    })
}

/// The error for a key that no setting of `specs` has.
pub fn unknown_setting(key: &str, specs: &[Spec]) -> SettingError {
    let names: Vec<&str> = specs.iter().map(|spec| spec.name).collect();
    let hint = if names.is_empty() { "this method has no settings".to_owned() } else { suggest(key, &names) };
    SettingError::Unknown { key: key.to_owned(), hint }
}

/// A half-sentence that names what was probably meant, else everything there is.
pub fn suggest(name: &str, candidates: &[&str]) -> String {
    let mut near: Vec<(usize, &str)> = candidates
        .iter()
        .map(|candidate| (strsim::damerau_levenshtein(name, candidate), *candidate))
        .filter(|(distance, candidate)| {
            *distance <= (candidate.len().max(name.len()) / 3).max(1)
                || (name.len() >= 3 && (candidate.contains(name) || name.contains(candidate)))
        })
        .collect();
    near.sort();
    match near.as_slice() {
        [] => format!("there are {}", candidates.join(", ")),
        near => {
            let names: Vec<&str> = near.iter().take(3).map(|(_, candidate)| *candidate).collect();
            format!("did you mean {}?", names.join(" or "))
        }
    }
}

/// Declare a struct of settings; see the [module](crate::methods::settings). Each field reads
/// `name: type = default[, range a..=b][, unit "..."], paper "...";` below its documentation.
#[macro_export]
macro_rules! settings {
    ($(#[doc = $struct_doc:literal])* pub struct $group:ident { $(
        $(#[doc = $doc:literal])+
        $name:ident : $type:ty = $default:expr $(, range $range:expr)? $(, unit $unit:literal)?, paper $paper:literal;
    )* }) => {
        $(#[doc = $struct_doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $group { $(
            $(#[doc = $doc])+
            #[doc = concat!("\n\nPaper: ", $paper, ".")]
            pub $name: $type,
        )* }

        impl Default for $group {
            fn default() -> Self {
                Self { $($name: $default,)* }
            }
        }

        impl $crate::methods::settings::SettingGroup for $group {
            fn specs() -> Vec<$crate::methods::settings::Spec> {
                vec![$($crate::methods::settings::Spec {
                    name: stringify!($name),
                    kind: <$type as $crate::methods::settings::SettingValue>::kind($crate::settings!(@range $($range)?)),
                    default: $crate::methods::settings::SettingValue::to_json(Self::default().$name),
                    unit: concat!($($unit)?),
                    doc: concat!($($doc),+).trim(),
                    paper: $paper,
                },)*]
            }

            fn set(
                &mut self,
                assignment: &$crate::methods::settings::Assignment,
            ) -> Result<(), $crate::methods::settings::SettingError> {
                $(if assignment.key == stringify!($name) {
                    let range = $crate::settings!(@range $($range)?);
                    self.$name = $crate::methods::settings::parse_value(assignment, range, concat!($($unit)?))?;
                    return Ok(());
                })*
                Err($crate::methods::settings::unknown_setting(&assignment.key, &Self::specs()))
            }

            fn record(&self) -> serde_json::Map<String, serde_json::Value> {
                let mut record = serde_json::Map::new();
                $(record.insert(
                    stringify!($name).to_owned(),
                    $crate::methods::settings::SettingValue::to_json(self.$name),
                );)*
                record
            }
        }
    };
    (@range) => { None };
    (@range $range:expr) => { Some($range) };
}

/// Declare an enum a setting may have as its type; each value reads `Variant = "name",` below its documentation.
#[macro_export]
macro_rules! choice {
    ($(#[doc = $enum_doc:literal])* pub enum $choice:ident { $(
        $(#[doc = $doc:literal])+
        $variant:ident = $name:literal,
    )+ }) => {
        $(#[doc = $enum_doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $choice { $($(#[doc = $doc])+ $variant,)+ }

        impl $crate::methods::settings::SettingValue for $choice {
            fn kind(_: Option<std::ops::RangeInclusive<Self>>) -> $crate::methods::settings::Kind {
                let values = vec![$($crate::methods::settings::ChoiceValue {
                    name: $name,
                    doc: concat!($($doc),+).trim(),
                },)+];
                $crate::methods::settings::Kind::Choice { values }
            }

            fn parse(text: &str) -> Option<Self> {
                match text {
                    $($name => Some(Self::$variant),)+
                    _ => None,
                }
            }

            fn to_json(self) -> serde_json::Value {
                match self { $(Self::$variant => $name.into(),)+ }
            }

            fn is_in(self, _: &$crate::methods::settings::Kind) -> bool {
                true
            }
        }
    };
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
