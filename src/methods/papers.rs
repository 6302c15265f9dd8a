//! What this program cites, by Key. A Key is the first author's name and the year.

use serde::Serialize;

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

pub(super) const SCHMITZ_2008: Paper = Paper {
    key: "Schmitz2008",
    title: "Interactive Global Illumination for Deformable Geometry in CUDA",
    authors: "Arne Schmitz, Markus Tavenrath, Leif Kobbelt",
    year: 2008,
    venue: "Computer Graphics Forum 27(7), Pacific Graphics",
    doi: Some("10.1111/j.1467-8659.2008.01347.x"),
};

pub(super) const DACHSBACHER_2007: Paper = Paper {
    key: "Dachsbacher2007",
    title: "Implicit Visibility and Antiradiance for Interactive Global Illumination",
    authors: "Carsten Dachsbacher, Marc Stamminger, George Drettakis, Fr\u{e9}do Durand",
    year: 2007,
    venue: "ACM Transactions on Graphics 26(3), SIGGRAPH",
    doi: Some("10.1145/1276377.1276453"),
};

pub(super) const DONG_2007: Paper = Paper {
    key: "Dong2007",
    title: "Interactive Global Illumination Using Implicit Visibility",
    authors: "Zhao Dong, Jan Kautz, Christian Theobalt, Hans-Peter Seidel",
    year: 2007,
    venue: "Pacific Graphics 2007",
    doi: Some("10.1109/PG.2007.37"),
};

pub(super) const GOBBETTI_2003: Paper = Paper {
    key: "Gobbetti2003",
    title: "Hierarchical Higher Order Face Cluster Radiosity for Global Illumination Walkthroughs of Complex \
            Non-Diffuse Environments",
    authors: "Enrico Gobbetti, Leonardo Span\u{f2}, Marco Agus",
    year: 2003,
    venue: "Computer Graphics Forum 22(3), Eurographics",
    doi: Some("10.1111/1467-8659.t01-1-00704"),
};

pub(super) const KAJIYA_1986: Paper = Paper {
    key: "Kajiya1986",
    title: "The Rendering Equation",
    authors: "James T. Kajiya",
    year: 1986,
    venue: "Computer Graphics 20(4), SIGGRAPH",
    doi: Some("10.1145/15922.15902"),
};

pub(super) const RITSCHEL_2008: Paper = Paper {
    key: "Ritschel2008",
    title: "Interactive Global Illumination Based on Coherent Surface Shadow Maps",
    authors: "Tobias Ritschel, Thorsten Grosch, Jan Kautz, Hans-Peter Seidel",
    year: 2008,
    venue: "Graphics Interface 2008",
    doi: None,
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
        key: "Andrew1979",
        title: "Another Efficient Algorithm for Convex Hulls in Two Dimensions",
        authors: "A. M. Andrew",
        year: 1979,
        venue: "Information Processing Letters 9(5)",
        doi: Some("10.1016/0020-0190(79)90072-3"),
    },
    Paper {
        key: "Arvo1990",
        title: "Particle Transport and Image Synthesis",
        authors: "James Arvo, David Kirk",
        year: 1990,
        venue: "Computer Graphics 24(4), SIGGRAPH",
        doi: Some("10.1145/97879.97886"),
    },
    Paper {
        key: "Arvo1995",
        title: "Analytic Methods for Simulated Light Transport",
        authors: "James Arvo",
        year: 1995,
        venue: "Dissertation, Yale University",
        doi: None,
    },
    Paper {
        key: "Baum1989",
        title: "Improving Radiosity Solutions Through the Use of Analytically Determined Form-Factors",
        authors: "Daniel R. Baum, Holly E. Rushmeier, James M. Winget",
        year: 1989,
        venue: "Computer Graphics 23(3), SIGGRAPH",
        doi: Some("10.1145/74334.74367"),
    },
    Paper {
        key: "Blelloch1990",
        title: "Prefix Sums and Their Applications",
        authors: "Guy E. Blelloch",
        year: 1990,
        venue: "Technical Report CMU-CS-90-190, Carnegie Mellon University",
        doi: None,
    },
    Paper {
        key: "Burley2020",
        title: "Practical Hash-based Owen Scrambling",
        authors: "Brent Burley",
        year: 2020,
        venue: "Journal of Computer Graphics Techniques 9(4)",
        doi: None,
    },
    Paper {
        key: "Chao1982",
        title: "A General Purpose Unequal Probability Sampling Plan",
        authors: "Min-Te Chao",
        year: 1982,
        venue: "Biometrika 69(3)",
        doi: Some("10.1093/biomet/69.3.653"),
    },
    Paper {
        key: "Ciura2001",
        title: "Best Increments for the Average Case of Shellsort",
        authors: "Marcin Ciura",
        year: 2001,
        venue: "Fundamentals of Computation Theory, LNCS 2138",
        doi: Some("10.1007/3-540-44669-9_12"),
    },
    Paper {
        key: "Cools2003",
        title: "An Encyclopaedia of Cubature Formulas",
        authors: "Ronald Cools",
        year: 2003,
        venue: "Journal of Complexity 19(3)",
        doi: Some("10.1016/S0885-064X(03)00011-6"),
    },
    Paper {
        key: "Cranley1976",
        title: "Randomization of Number Theoretic Methods for Multiple Integration",
        authors: "R. Cranley, T. N. L. Patterson",
        year: 1976,
        venue: "SIAM Journal on Numerical Analysis 13(6)",
        doi: Some("10.1137/0713071"),
    },
    DACHSBACHER_2007,
    Paper {
        key: "Dammertz2008",
        title: "Image Synthesis by Rank-1 Lattices",
        authors: "Holger Dammertz, Alexander Keller",
        year: 2008,
        venue: "Monte Carlo and Quasi-Monte Carlo Methods 2006, Springer",
        doi: None,
    },
    Paper {
        key: "Debevec2005",
        title: "A Median Cut Algorithm for Light Probe Sampling",
        authors: "Paul Debevec",
        year: 2005,
        venue: "SIGGRAPH Posters",
        doi: None,
    },
    DONG_2007,
    Paper {
        key: "Duff2017",
        title: "Building an Orthonormal Basis, Revisited",
        authors: "Tom Duff, James Burgess, Per Christensen, Christophe Hery, Andrew Kensler, Max Liani, Ryusuke Villemin",
        year: 2017,
        venue: "Journal of Computer Graphics Techniques 6(1)",
        doi: None,
    },
    Paper {
        key: "Dupuy2023",
        title: "Sampling Visible GGX Normals with Spherical Caps",
        authors: "Jonathan Dupuy, Anis Benyoub",
        year: 2023,
        venue: "Computer Graphics Forum 42(8), High-Performance Graphics",
        doi: Some("10.1111/cgf.14867"),
    },
    Paper {
        key: "Efron1979",
        title: "Bootstrap Methods: Another Look at the Jackknife",
        authors: "Bradley Efron",
        year: 1979,
        venue: "The Annals of Statistics 7(1)",
        doi: Some("10.1214/aos/1176344552"),
    },
    Paper {
        key: "Ericson2004",
        title: "Real-Time Collision Detection",
        authors: "Christer Ericson",
        year: 2004,
        venue: "Morgan Kaufmann",
        doi: None,
    },
    Paper {
        key: "Garland2001",
        title: "Hierarchical Face Clustering on Polygonal Surfaces",
        authors: "Michael Garland, Andrew Willmott, Paul S. Heckbert",
        year: 2001,
        venue: "Symposium on Interactive 3D Graphics",
        doi: Some("10.1145/364338.364345"),
    },
    GOBBETTI_2003,
    Paper {
        key: "Goldsmith1987",
        title: "Automatic Creation of Object Hierarchies for Ray Tracing",
        authors: "Jeffrey Goldsmith, John Salmon",
        year: 1987,
        venue: "IEEE Computer Graphics and Applications 7(5)",
        doi: Some("10.1109/MCG.1987.276983"),
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
    Paper {
        key: "Hertel2009",
        title: "A Hybrid GPU Rendering Pipeline for Alias-Free Hard Shadows",
        authors: "Stefan Hertel, Kai Hormann, Rüdiger Westermann",
        year: 2009,
        venue: "Eurographics (Areas Papers)",
        doi: None,
    },
    Paper {
        key: "Jarzynski2020",
        title: "Hash Functions for GPU Rendering",
        authors: "Mark Jarzynski, Marc Olano",
        year: 2020,
        venue: "Journal of Computer Graphics Techniques 9(3)",
        doi: None,
    },
    KAJIYA_1986,
    Paper {
        key: "Kreutzer2014",
        title: "A Unified Sparse Matrix Data Format for Efficient General Sparse Matrix-Vector Multiplication on Modern \
                Processors with Wide SIMD Units",
        authors: "Moritz Kreutzer, Georg Hager, Gerhard Wellein, Holger Fehske, Alan R. Bishop",
        year: 2014,
        venue: "SIAM Journal on Scientific Computing 36(5)",
        doi: Some("10.1137/130930352"),
    },
    Paper {
        key: "Mann1947",
        title: "On a Test of Whether one of Two Random Variables is Stochastically Larger than the Other",
        authors: "Henry B. Mann, Donald R. Whitney",
        year: 1947,
        venue: "The Annals of Mathematical Statistics 18(1)",
        doi: Some("10.1214/aoms/1177730491"),
    },
    Paper {
        key: "Meyer2010",
        title: "On Floating-Point Normal Vectors",
        authors: "Quirin Meyer, Jochen S\u{fc}\u{df}muth, Gerd Su\u{df}ner, Marc Stamminger, G\u{fc}nther Greiner",
        year: 2010,
        venue: "Computer Graphics Forum 29(4), Eurographics Symposium on Rendering",
        doi: Some("10.1111/j.1467-8659.2010.01737.x"),
    },
    Paper {
        key: "Moller1997",
        title: "Fast, Minimum Storage Ray-Triangle Intersection",
        authors: "Tomas Moller, Ben Trumbore",
        year: 1997,
        venue: "Journal of Graphics Tools 2(1)",
        doi: Some("10.1080/10867651.1997.10487468"),
    },
    Paper {
        key: "Ramamoorthi2001",
        title: "An Efficient Representation for Irradiance Environment Maps",
        authors: "Ravi Ramamoorthi, Pat Hanrahan",
        year: 2001,
        venue: "SIGGRAPH 2001",
        doi: Some("10.1145/383259.383317"),
    },
    Paper {
        key: "Reinhard2002",
        title: "Photographic Tone Reproduction for Digital Images",
        authors: "Erik Reinhard, Michael Stark, Peter Shirley, James Ferwerda",
        year: 2002,
        venue: "ACM Transactions on Graphics 21(3), SIGGRAPH",
        doi: Some("10.1145/566654.566575"),
    },
    RITSCHEL_2008,
    Paper {
        key: "Roberts2018",
        title: "The Unreasonable Effectiveness of Quasirandom Sequences",
        authors: "Martin Roberts",
        year: 2018,
        venue: "extremelearning.com.au",
        doi: None,
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
        key: "Steele2014",
        title: "Fast Splittable Pseudorandom Number Generators",
        authors: "Guy Lewis Steele, Doug Lea, Christine H. Flood",
        year: 2014,
        venue: "OOPSLA",
        doi: Some("10.1145/2660193.2660195"),
    },
    Paper {
        key: "Toussaint1983",
        title: "Solving Geometric Problems with the Rotating Calipers",
        authors: "Godfried Toussaint",
        year: 1983,
        venue: "IEEE MELECON",
        doi: None,
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
        key: "Waechter2019",
        title: "A Fast and Robust Method for Avoiding Self-Intersection",
        authors: "Carsten Waechter, Nikolaus Binder",
        year: 2019,
        venue: "Ray Tracing Gems",
        doi: Some("10.1007/978-1-4842-4427-2_6"),
    },
    Paper {
        key: "Walter2005",
        title: "Lightcuts: A Scalable Approach to Illumination",
        authors: "Bruce Walter, Sebastian Fernandez, Adam Arbree, Kavita Bala, Michael Donikian, Donald P. Greenberg",
        year: 2005,
        venue: "ACM Transactions on Graphics 24(3), SIGGRAPH",
        doi: Some("10.1145/1073204.1073318"),
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
    Paper {
        key: "Wilcoxon1945",
        title: "Individual Comparisons by Ranking Methods",
        authors: "Frank Wilcoxon",
        year: 1945,
        venue: "Biometrics Bulletin 1(6)",
        doi: Some("10.2307/3001968"),
    },
    Paper {
        key: "Woop2013",
        title: "Watertight Ray/Triangle Intersection",
        authors: "Sven Woop, Carsten Benthin, Ingo Wald",
        year: 2013,
        venue: "Journal of Computer Graphics Techniques 2(1)",
        doi: None,
    },
    Paper {
        key: "Ylitie2017",
        title: "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs",
        authors: "Henri Ylitie, Tero Karras, Samuli Laine",
        year: 2017,
        venue: "High-Performance Graphics",
        doi: Some("10.1145/3105762.3105773"),
    },
    Paper {
        key: "Zhang2010",
        title: "On Maximum-Principle-Satisfying High Order Schemes for Scalar Conservation Laws",
        authors: "Xiangxiong Zhang, Chi-Wang Shu",
        year: 2010,
        venue: "Journal of Computational Physics 229(9)",
        doi: None,
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn keys_are_sorted_and_name_author_and_year() {
        assert!(PAPERS.is_sorted_by_key(|paper| paper.key));
        for paper in PAPERS {
            let name = paper.key.trim_end_matches(char::is_numeric);
            assert_eq!(paper.key, format!("{name}{}", paper.year));
            let first_author = paper.authors.split(',').next().unwrap_or_default();
            assert!(first_author.ends_with(name), "{}: {first_author}", paper.key);
        }
    }

    /// Every `[Key` of the sources, shaders and tests is in the list.
    #[test]
    fn every_citation_has_its_paper() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut cited = 0;
        for folder in ["src", "glsl", "tests"] {
            for file in files(&root.join(folder)) {
                // Broken inputs of tests need not be text.
                let Ok(text) = String::from_utf8(std::fs::read(&file).unwrap()) else { continue };
                for key in citations(&text) {
                    assert!(
                        PAPERS.iter().any(|paper| paper.key == key),
                        "[{key}] in {} is not in PAPERS",
                        file.display()
                    );
                    cited += 1;
                }
            }
        }
        assert!(cited > 20, "only {cited} citations were found");
    }

    #[test]
    fn citations_are_recognised() {
        let text = "as in [Schmitz2008 3.2], [Wang2004]: but not [0], [Vec3], a[Index2], [Some2008x] or [1986]";
        assert_eq!(citations(text), ["Schmitz2008", "Wang2004"]);
    }

    /// Names with a year behind a bracket, up to anything but a letter or digit.
    fn citations(text: &str) -> Vec<&str> {
        let keys = text.split('[').skip(1).filter_map(|rest| {
            let key = &rest[..rest.find(|c: char| !c.is_ascii_alphanumeric())?];
            let name = key.trim_end_matches(|c: char| c.is_ascii_digit());
            let named =
                name.starts_with(|c: char| c.is_ascii_uppercase()) && name.chars().all(|c| c.is_ascii_alphabetic());
            (named && key.len() == name.len() + 4).then_some(key)
        });
        keys.collect()
    }

    fn files(folder: &Path) -> Vec<std::path::PathBuf> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                found.extend(files(&path));
            } else if path.extension().is_some_and(|extension| extension != "glb" && extension != "bin") {
                found.push(path);
            }
        }
        found
    }
}
