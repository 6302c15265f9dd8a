//! The methods, one module per paper, all with the same headings; and the papers this program cites.
//!
//! [`METHODS`] is the table of contents. Comments cite as `[Key section, Eq. n]`; the Keys are in [`PAPERS`]. Where a
//! bare `[Key]` stands in documentation, a last line `[Key]: crate::methods::PAPERS` makes it a link.

pub mod antiradiance;
pub mod carried;
pub mod explicit_visibility;
pub mod face_cluster;
pub mod implicit_visibility;
mod papers;
pub mod path_tracing;
pub mod pick;
pub mod settings;
pub mod surface_shadow_maps;

use serde_json::{Map, Value};

pub use papers::{PAPERS, Paper};

use papers::{DACHSBACHER_2007, DONG_2007, GOBBETTI_2003, KAJIYA_1986, RITSCHEL_2008, SCHMITZ_2008};
use settings::{Assignment, SettingError, SettingGroup, Spec};

/// Values of all settings by name, or what is wrong with an assignment.
type Recorded = Result<Map<String, Value>, SettingError>;

/// A way to compute global illumination.
#[derive(Debug, Clone, Copy)]
pub struct Method {
    /// The value of `--method`.
    pub key: &'static str,
    pub paper: &'static Paper,
    /// One line.
    pub summary: &'static str,
    specs: fn() -> Vec<Spec>,
    record: fn(&[Assignment]) -> Recorded,
}

impl PartialEq for Method {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Eq for Method {}

impl Method {
    const fn new<S: SettingGroup>(key: &'static str, paper: &'static Paper, summary: &'static str) -> Self {
        Self { key, paper, summary, specs: S::specs, record: |set| Ok(S::from_assignments(set)?.record()) }
    }

    /// The settings the method declares.
    pub fn specs(&self) -> Vec<Spec> {
        (self.specs)()
    }

    /// Every setting's value after `assignments`, as recorded in outputs; also the check of the assignments.
    pub fn record(&self, assignments: &[Assignment]) -> Result<Map<String, Value>, SettingError> {
        (self.record)(assignments)
    }
}

/// No method: stands for whichever reaches the error of `--target-error` fastest.
pub static AUTO: Method = Method::new::<path_tracing::Settings>("auto", &papers::KAJIYA_1986, "picked by pilot runs");

/// Every method of the program, the default one first.
pub const METHODS: &[Method] = &[
    Method::new::<explicit_visibility::Settings>(
        "explicit-visibility",
        &SCHMITZ_2008,
        "vertex-to-vertex links found by ray casting; light is gathered along them",
    ),
    Method::new::<antiradiance::Settings>(
        "antiradiance",
        &DACHSBACHER_2007,
        "light crosses surfaces freely, and negative light sent on by each surface takes away what was blocked",
    ),
    Method::new::<implicit_visibility::Settings>(
        "implicit-visibility",
        &DONG_2007,
        "no rays: in each direction bin of an element the nearest node of surfel trees wins, and its light is gathered",
    ),
    Method::new::<surface_shadow_maps::Settings>(
        "surface-shadow-maps",
        &RITSCHEL_2008,
        "texels of an atlas gather from a tree of texels; compressed depth cube maps tell who sees whom",
    ),
    Method::new::<face_cluster::Settings>(
        "face-cluster",
        &GOBBETTI_2003,
        "vector irradiance on higher-order bases is shot between clusters of faces; no links are kept",
    ),
    Method::new::<path_tracing::Settings>(
        "path-tracing",
        &KAJIYA_1986,
        "the reference: unidirectional paths, next-event estimation, multiple importance sampling",
    ),
];

/// The method of that key.
pub fn find(key: &str) -> Option<&'static Method> {
    METHODS.iter().find(|method| method.key == key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use settings::Kind;

    #[test]
    fn the_tables_are_complete_and_unambiguous() {
        let keys: Vec<&str> = METHODS.iter().map(|method| method.key).collect();
        for (index, key) in keys.iter().enumerate() {
            assert!(!keys[..index].contains(key), "{key} is there twice");
            assert!(key.chars().all(|c| c.is_ascii_lowercase() || c == '-'), "{key}");
        }
        for method in METHODS {
            assert!(PAPERS.contains(method.paper), "{} is cited but not listed", method.paper.key);
        }
    }

    /// A default must be a value the user may give.
    #[test]
    fn every_default_can_be_set() {
        for method in METHODS {
            for spec in method.specs() {
                let text = match (&spec.default, &spec.kind) {
                    (Value::String(name), Kind::Choice { .. } | Kind::Text { .. }) => name.clone(),
                    (value, _) => value.to_string(),
                };
                let assignment = Assignment { key: spec.name.to_owned(), value: text };
                let record = method.record(&[assignment]).unwrap_or_else(|error| panic!("{}: {error}", method.key));
                assert_eq!(record[spec.name], spec.default);
            }
        }
    }
}
