//! Checked access to the file's JSON: every value read knows its JSON pointer, its type and its range are tested
//! where it is read, and nothing that is not read can fail.
//!
//! The file is kept as a [`Value`] tree rather than read into fixed structures, because real files bend the schema in
//! places that do not matter to a renderer (`"count": 3.0`, a channel without a node, a scene without nodes).

use super::error::{Fault, shown};
use serde_json::{Map, Value};
use std::fmt;

/// A JSON object and where it stands in the file.
#[derive(Debug, Clone)]
pub struct Object<'a> {
    map: &'a Map<String, Value>,
    pointer: String,
}

/// A JSON array and where it stands in the file. An absent array is an empty one.
#[derive(Debug, Clone, Default)]
pub struct List<'a> {
    values: &'a [Value],
    pointer: String,
}

impl<'a> Object<'a> {
    pub fn root(value: &'a Value) -> Result<Self, Fault> {
        Self::new(value, String::new())
    }

    fn new(value: &'a Value, pointer: String) -> Result<Self, Fault> {
        match value {
            Value::Object(map) => Ok(Self { map, pointer }),
            other => Err(Fault::invalid(here(&pointer), "must be an object", Seen(other))),
        }
    }

    pub fn pointer(&self) -> &str {
        here(&self.pointer)
    }

    pub fn has(&self, key: &str) -> bool {
        self.map.contains_key(key)
    }

    pub fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.map.keys().map(String::as_str)
    }

    pub fn at(&self, key: &str) -> String {
        format!("{}/{}", self.pointer, key.replace('~', "~0").replace('/', "~1"))
    }

    /// The error that the value at `key` breaks `rule`.
    pub fn invalid(&self, key: &str, rule: impl Into<String>) -> Fault {
        match self.map.get(key) {
            Some(value) => Fault::invalid(self.at(key), rule, Seen(value)),
            None => Fault::invalid(self.at(key), rule, "absent"),
        }
    }

    /// `Ok(None)` becomes the error that `key` is missing.
    pub fn require<T>(&self, key: &str, value: Option<T>) -> Result<T, Fault> {
        value.ok_or_else(|| self.invalid(key, "is required"))
    }

    pub fn object(&self, key: &str) -> Result<Option<Object<'a>>, Fault> {
        self.map.get(key).map(|value| Object::new(value, self.at(key))).transpose()
    }

    pub fn list(&self, key: &str) -> Result<List<'a>, Fault> {
        match self.map.get(key) {
            None => Ok(List { values: &[], pointer: self.at(key) }),
            Some(Value::Array(values)) => Ok(List { values, pointer: self.at(key) }),
            Some(_) => Err(self.invalid(key, "must be an array")),
        }
    }

    pub fn extension(&self, name: &str) -> Result<Option<Object<'a>>, Fault> {
        match self.object("extensions")? {
            Some(extensions) => extensions.object(name),
            None => Ok(None),
        }
    }

    pub fn text(&self, key: &str) -> Result<Option<&'a str>, Fault> {
        match self.map.get(key) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text)),
            Some(_) => Err(self.invalid(key, "must be a string")),
        }
    }

    /// The object's name; a missing or ill-typed one is empty, since nothing depends on it.
    pub fn name(&self) -> String {
        self.map.get("name").and_then(Value::as_str).unwrap_or_default().to_owned()
    }

    pub fn boolean(&self, key: &str) -> Result<Option<bool>, Fault> {
        match self.map.get(key) {
            None => Ok(None),
            Some(Value::Bool(value)) => Ok(Some(*value)),
            Some(_) => Err(self.invalid(key, "must be true or false")),
        }
    }

    pub fn integer(&self, key: &str) -> Result<Option<u64>, Fault> {
        let Some(value) = self.map.get(key) else { return Ok(None) };
        let integer = integer(value).ok_or_else(|| self.invalid(key, "must be a non-negative integer"))?;
        Ok(Some(integer))
    }

    /// A reference into a list of `count` entries called `list`.
    pub fn index(&self, key: &str, list: &str, count: usize) -> Result<Option<usize>, Fault> {
        let Some(index) = self.integer(key)? else { return Ok(None) };
        in_list(index, count).ok_or_else(|| self.invalid(key, reference_rule(list, count))).map(Some)
    }

    pub fn number(&self, key: &str) -> Result<Option<f32>, Fault> {
        let Some(value) = self.map.get(key) else { return Ok(None) };
        number(value).ok_or_else(|| self.invalid(key, NUMBER_RULE)).map(Some)
    }

    pub fn number_or(&self, key: &str, default: f32) -> Result<f32, Fault> {
        Ok(self.number(key)?.unwrap_or(default))
    }

    pub fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f32; N]>, Fault> {
        if !self.has(key) {
            return Ok(None);
        }
        let numbers = self.list(key)?.numbers()?;
        let count = numbers.len();
        let array = numbers
            .try_into()
            .map_err(|_| Fault::invalid(self.at(key), format!("must hold {N} numbers"), format!("{count} numbers")))?;
        Ok(Some(array))
    }
}

impl<'a> List<'a> {
    pub fn len(&self) -> usize {
        self.values.len()
    }

    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    pub fn at(&self, index: usize) -> String {
        format!("{}/{index}", self.pointer)
    }

    pub fn object(&self, index: usize) -> Result<Object<'a>, Fault> {
        match self.values.get(index) {
            Some(value) => Object::new(value, self.at(index)),
            None => Err(Fault::invalid(self.at(index), "must exist, since it is referred to", "absent")),
        }
    }

    pub fn objects(&self) -> impl Iterator<Item = Result<Object<'a>, Fault>> {
        self.values.iter().enumerate().map(|(index, value)| Object::new(value, self.at(index)))
    }

    pub fn texts(&self) -> Result<Vec<&'a str>, Fault> {
        self.read("must be a string", Value::as_str)
    }

    pub fn numbers(&self) -> Result<Vec<f32>, Fault> {
        self.read(NUMBER_RULE, number)
    }

    /// References into a list of `count` entries called `list`.
    pub fn indices(&self, list: &str, count: usize) -> Result<Vec<usize>, Fault> {
        self.read(&reference_rule(list, count), |value| in_list(integer(value)?, count))
    }

    fn read<T>(&self, rule: &str, read: impl Fn(&'a Value) -> Option<T>) -> Result<Vec<T>, Fault> {
        let read_one = |(index, value)| read(value).ok_or_else(|| Fault::invalid(self.at(index), rule, Seen(value)));
        self.values.iter().enumerate().map(read_one).collect()
    }
}

/// The pointer of the root is the empty string, which reads badly in a sentence.
fn here(pointer: &str) -> &str {
    if pointer.is_empty() { "the document" } else { pointer }
}

const NUMBER_RULE: &str = "must be a number that a 32-bit float can hold";

fn number(value: &Value) -> Option<f32> {
    value.as_f64().map(|number| number as f32).filter(|number| number.is_finite())
}

/// JSON has one kind of number, so `3.0` is an integer too. Above 2^53 a float no longer says which one.
fn integer(value: &Value) -> Option<u64> {
    let whole = |number: &f64| *number >= 0.0 && *number <= 9_007_199_254_740_992.0 && number.fract() == 0.0;
    value.as_u64().or_else(|| value.as_f64().filter(whole).map(|number| number as u64))
}

fn in_list(index: u64, count: usize) -> Option<usize> {
    usize::try_from(index).ok().filter(|index| *index < count)
}

fn reference_rule(list: &str, count: usize) -> String {
    match count {
        0 => format!("refers to the {list}, of which the file has none"),
        _ => format!("must refer to one of the file's {count} {list} (0 to {})", count - 1),
    }
}

/// A JSON value as a message shows it: scalars themselves, containers by their kind.
struct Seen<'a>(&'a Value);

impl fmt::Display for Seen<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Value::Null => f.write_str("null"),
            Value::Bool(value) => write!(f, "{value}"),
            Value::Number(value) => write!(f, "{value}"),
            Value::String(value) => f.write_str(&shown(value)),
            Value::Array(values) => write!(f, "an array of {}", values.len()),
            Value::Object(map) => write!(f, "an object of {} members", map.len()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn integers_may_be_written_as_floats_but_must_be_whole() {
        let value = json!({ "a": 3.0, "b": 3.5, "c": -1, "d": 1e300, "e": 18446744073709551615u64 });
        let object = Object::root(&value).unwrap();
        assert_eq!(object.integer("a").unwrap(), Some(3));
        assert_eq!(object.integer("e").unwrap(), Some(u64::MAX));
        assert_eq!(object.integer("absent").unwrap(), None);
        for key in ["b", "c", "d"] {
            assert!(object.integer(key).unwrap_err().to_string().starts_with(&format!("/{key}: must be")));
        }
    }

    #[test]
    fn numbers_beyond_single_precision_are_refused() {
        let value = json!({ "a": 1e39, "b": [1, 2, -1e39] });
        let object = Object::root(&value).unwrap();
        assert!(object.number("a").is_err());
        let message = object.numbers::<3>("b").unwrap_err().to_string();
        assert!(message.starts_with("/b/2: "), "{message}");
    }

    #[test]
    fn pointers_escape_what_rfc_6901_reserves() {
        let value = json!({ "a/b~c": 1 });
        let message = Object::root(&value).unwrap().text("a/b~c").unwrap_err().to_string();
        assert!(message.starts_with("/a~1b~0c: must be a string, but it is 1;"), "{message}");
    }

    #[test]
    fn references_name_the_list_and_its_size() {
        let value = json!({ "mesh": 4, "children": [0, 9] });
        let object = Object::root(&value).unwrap();
        assert_eq!(object.index("mesh", "meshes", 5).unwrap(), Some(4));
        let message = object.index("mesh", "meshes", 4).unwrap_err().to_string();
        assert!(
            message.starts_with("/mesh: must refer to one of the file's 4 meshes (0 to 3), but it is 4"),
            "{message}"
        );
        let message = object.list("children").unwrap().indices("nodes", 2).unwrap_err().to_string();
        assert!(message.starts_with("/children/1: "), "{message}");
    }
}
