//! The methods, one module per paper, all with the same headings; and the papers this program cites.
//!
//! [`METHODS`] is the table of contents. Comments cite as `[Key section, Eq. n]`; the Keys are in [`PAPERS`]. Where a
//! bare `[Key]` stands in documentation, a last line `[Key]: crate::methods::PAPERS` makes it a link.

pub mod explicit_visibility;
pub mod path_tracing;
pub mod settings;

use serde::Serialize;
use serde_json::{Map, Value};

use settings::{Assignment, SettingError, SettingGroup, Spec};

/// A publication cited in comments and listings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Paper {
    /// As cited: `Schmitz2008`.
    pub key: &'static str,
    pub title: &'static str,
    pub authors: &'static str,
    pub year: u16,
    pub venue: &'static str,
    /// `None` where the publication has none.
    pub doi: Option<&'static str>,
}

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

/// Every method of the program, the default one first.
pub const METHODS: &[Method] = &[
    Method::new::<explicit_visibility::Settings>(
        "explicit-visibility",
        &SCHMITZ_2008,
        "vertex-to-vertex links found by ray casting; light is gathered along them",
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

const SCHMITZ_2008: Paper = Paper {
    key: "Schmitz2008",
    title: "Interactive Global Illumination for Deformable Geometry in CUDA",
    authors: "Arne Schmitz, Markus Tavenrath, Leif Kobbelt",
    year: 2008,
    venue: "Computer Graphics Forum 27(7), Pacific Graphics",
    doi: Some("10.1111/j.1467-8659.2008.01347.x"),
};

const KAJIYA_1986: Paper = Paper {
    key: "Kajiya1986",
    title: "The Rendering Equation",
    authors: "James T. Kajiya",
    year: 1986,
    venue: "Computer Graphics 20(4), SIGGRAPH",
    doi: Some("10.1145/15922.15902"),
};

/// Everything cited, by key.
pub const PAPERS: &[Paper] = &[
    Paper {
        key: "Andersson2020",
        title: "FLIP: A Difference Evaluator for Alternating Images",
        authors: "Pontus Andersson, Jim Nilsson, Tomas Akenine-M\u{f6}ller, Magnus Oskarsson, Kalle \u{c5}str\u{f6}m, \
                  Mark D. Fairchild",
        year: 2020,
        venue: "Proceedings of the ACM on Computer Graphics and Interactive Techniques 3(2)",
        doi: Some("10.1145/3406183"),
    },
    Paper {
        key: "Hable2010",
        title: "Uncharted 2: HDR Lighting",
        authors: "John Hable",
        year: 2010,
        venue: "Game Developers Conference",
        doi: None,
    },
    Paper {
        key: "Heitz2014",
        title: "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs",
        authors: "Eric Heitz",
        year: 2014,
        venue: "Journal of Computer Graphics Techniques 3(2)",
        doi: None,
    },
    KAJIYA_1986,
    Paper {
        key: "Reinhard2002",
        title: "Photographic Tone Reproduction for Digital Images",
        authors: "Erik Reinhard, Michael Stark, Peter Shirley, James Ferwerda",
        year: 2002,
        venue: "ACM Transactions on Graphics 21(3), SIGGRAPH",
        doi: Some("10.1145/566654.566575"),
    },
    SCHMITZ_2008,
    Paper {
        key: "Shirley1997",
        title: "A Low Distortion Map Between Disk and Square",
        authors: "Peter Shirley, Kenneth Chiu",
        year: 1997,
        venue: "Journal of Graphics Tools 2(3)",
        doi: Some("10.1080/10867651.1997.10487479"),
    },
    Paper {
        key: "Veach1995",
        title: "Optimally Combining Sampling Techniques for Monte Carlo Rendering",
        authors: "Eric Veach, Leonidas J. Guibas",
        year: 1995,
        venue: "Proceedings of SIGGRAPH 95",
        doi: Some("10.1145/218380.218498"),
    },
    Paper {
        key: "Walter2007",
        title: "Microfacet Models for Refraction through Rough Surfaces",
        authors: "Bruce Walter, Stephen R. Marschner, Hongsong Li, Kenneth E. Torrance",
        year: 2007,
        venue: "Eurographics Symposium on Rendering",
        doi: Some("10.2312/EGWR/EGSR07/195-206"),
    },
    Paper {
        key: "Wang2004",
        title: "Image Quality Assessment: From Error Visibility to Structural Similarity",
        authors: "Zhou Wang, Alan C. Bovik, Hamid R. Sheikh, Eero P. Simoncelli",
        year: 2004,
        venue: "IEEE Transactions on Image Processing 13(4)",
        doi: Some("10.1109/TIP.2003.819861"),
    },
];

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
        assert!(PAPERS.is_sorted_by_key(|paper| paper.key), "sorted by key");
        for method in METHODS {
            assert!(PAPERS.contains(method.paper), "{} is cited but not listed", method.paper.key);
        }
        for paper in PAPERS {
            assert!(paper.key.ends_with(&paper.year.to_string()), "{}", paper.key);
        }
    }

    /// A default must be a value the user may give.
    #[test]
    fn every_default_can_be_set() {
        for method in METHODS {
            for spec in method.specs() {
                let text = match (&spec.default, &spec.kind) {
                    (Value::String(name), Kind::Choice { .. }) => name.clone(),
                    (value, _) => value.to_string(),
                };
                let assignment = Assignment { key: spec.name.to_owned(), value: text };
                let record = method.record(&[assignment]).unwrap_or_else(|error| panic!("{}: {error}", method.key));
                assert_eq!(record[spec.name], spec.default);
            }
        }
    }
}
