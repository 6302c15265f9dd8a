//! Bases and cubature rules, of the unit square and of triangles, as settings.

use crate::gpu::shaders::types::CubatureNode;
use crate::methods::settings::SettingValue;
use glam::Vec2;

crate::choice! {
    /// The first functions of `lib/cluster_basis.glsl`.
    pub enum Basis {
        /// 1
        Constant = "constant",
        /// 1, u, v
        Linear = "linear",
        /// 1, u, v, uv
        Bilinear = "bilinear",
        /// 1, u, v, uv, u^2, v^2
        Quadratic = "quadratic",
        /// All of degree 3 and less
        Cubic = "cubic",
    }
}

/// As `--set` knows it.
pub(super) fn name(value: impl SettingValue) -> String {
    value.to_json().as_str().unwrap_or_default().to_owned()
}

impl Basis {
    /// How many they are.
    pub fn functions(self) -> u32 {
        match self {
            Self::Constant => 1,
            Self::Linear => 3,
            Self::Bilinear => 4,
            Self::Quadratic => 6,
            Self::Cubic => 10,
        }
    }

    /// Highest degree of a function.
    pub fn degree(self) -> u32 {
        match self {
            Self::Constant => 0,
            Self::Linear => 1,
            Self::Bilinear | Self::Quadratic => 2,
            Self::Cubic => 3,
        }
    }
}

crate::choice! {
    /// A cubature rule of the square, and one of triangles with as many nodes.
    pub enum Rule {
        /// The centre, degree 1
        One = "one",
        /// 2 x 2 of Gauss, degree 3
        Four = "four",
        /// Degree 4
        Six = "six",
        /// Radon's, degree 5
        Seven = "seven",
        /// 4 x 4 of Gauss, degree 7
        Sixteen = "sixteen",
    }
}

impl Rule {
    /// Polynomials of this degree are integrated exactly, also on triangles.
    pub fn degree(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Four => 3,
            Self::Six => 4,
            Self::Seven => 5,
            Self::Sixteen => 7,
        }
    }

    /// Of half its degree, which are as many as its nodes can tell apart.
    pub fn functions(self) -> u32 {
        let degree = self.degree() / 2;
        (degree + 1) * (degree + 2) / 2
    }

    /// Weights sum to 1.                                                        [Cools2003, C2: 3-1, 4-1, 5-1]
    pub fn nodes(self) -> Vec<CubatureNode> {
        let table: Vec<(f64, f64, f64)> = match self {
            Self::One => vec![(0.0, 0.0, 4.0)],
            Self::Four => grid(&[(-(1.0f64 / 3.0).sqrt(), 1.0), ((1.0f64 / 3.0).sqrt(), 1.0)]),
            Self::Six => {
                let (x, upper, lower) = (0.774_596_669_241_483, 0.390_885_162_530_071, -0.852_765_377_881_771);
                vec![
                    (0.0, -0.356_822_089_773_090, 1.286_412_084_888_852),
                    (0.0, 0.934_172_358_962_716, 0.491_365_692_888_926),
                    (x, upper, 0.761_883_709_085_613),
                    (-x, upper, 0.761_883_709_085_613),
                    (x, lower, 0.349_227_402_025_498),
                    (-x, lower, 0.349_227_402_025_498),
                ]
            }
            Self::Seven => {
                let (far, x, y) = ((14.0f64 / 15.0).sqrt(), 0.6f64.sqrt(), (1.0f64 / 3.0).sqrt());
                let mut table = vec![(0.0, 0.0, 8.0 / 7.0), (0.0, far, 20.0 / 63.0), (0.0, -far, 20.0 / 63.0)];
                table.extend([(x, y), (-x, y), (x, -y), (-x, -y)].map(|(x, y)| (x, y, 5.0 / 9.0)));
                table
            }
            Self::Sixteen => {
                let (near, far) = (0.339_981_043_584_856_3, 0.861_136_311_594_052_6);
                let (heavy, light) = (0.652_145_154_862_546_1, 0.347_854_845_137_453_85);
                grid(&[(-far, light), (-near, heavy), (near, heavy), (far, light)])
            }
        };
        let node = |&(x, y, weight): &(f64, f64, f64)| CubatureNode {
            uv: Vec2::new((0.5 + 0.5 * x) as f32, (0.5 + 0.5 * y) as f32),
            weight: (weight / 4.0) as f32,
        };
        table.iter().map(node).collect()
    }

    /// Of a triangle, by the shares of its second and third corner; weights sum to 1. All of them positive, which the
    /// usual rule of degree 3 lacks.                               [Cools2003, T2: 4-1, 5-1; Stroud1971, conical product]
    pub fn triangle_nodes(self) -> Vec<CubatureNode> {
        let corners = |of: [(f64, f64); 2]| -> Vec<(f64, f64, f64)> {
            of.iter().flat_map(|&(a, w)| [(a, a, w), (1.0 - 2.0 * a, a, w), (a, 1.0 - 2.0 * a, w)]).collect()
        };
        let table = match self {
            Self::One => vec![(1.0 / 3.0, 1.0 / 3.0, 1.0)],
            Self::Four => cone(
                &[
                    (0.155_051_025_721_682_2, 0.318_041_381_743_977_2),
                    (0.644_948_974_278_317_8, 0.181_958_618_256_022_8),
                ],
                &[(-(1.0f64 / 3.0).sqrt(), 1.0), ((1.0f64 / 3.0).sqrt(), 1.0)],
            ),
            Self::Six => corners([
                (0.445_948_490_915_965, 0.223_381_589_678_011),
                (0.091_576_213_509_771, 0.109_951_743_655_322),
            ]),
            Self::Seven => {
                let root = 15f64.sqrt();
                let mut table = vec![(1.0 / 3.0, 1.0 / 3.0, 0.225)];
                table.extend(corners([
                    ((6.0 - root) / 21.0, (155.0 - root) / 1200.0),
                    ((6.0 + root) / 21.0, (155.0 + root) / 1200.0),
                ]));
                table
            }
            Self::Sixteen => {
                let (near, far) = (0.339_981_043_584_856_3, 0.861_136_311_594_052_6);
                let (heavy, light) = (0.652_145_154_862_546_1, 0.347_854_845_137_453_85);
                cone(
                    &[
                        (0.057_104_196_114_517_7, 0.135_506_913_431_488),
                        (0.276_843_013_638_123_8, 0.203_464_568_010_271_4),
                        (0.583_590_432_368_916_8, 0.129_847_547_608_232_5),
                        (0.860_240_135_656_219_5, 0.031_180_970_950_008_1),
                    ],
                    &[(-far, light), (-near, heavy), (near, heavy), (far, light)],
                )
            }
        };
        let node = |&(b, c, weight): &(f64, f64, f64)| CubatureNode {
            uv: Vec2::new(b as f32, c as f32),
            weight: weight as f32,
        };
        table.iter().map(node).collect()
    }
}

/// Lines across the triangle at `heights`, places along each: a rule for the weight 1 - x on [0, 1], and one on [-1, 1].
fn cone(heights: &[(f64, f64)], line: &[(f64, f64)]) -> Vec<(f64, f64, f64)> {
    let row = |&(x, w): &(f64, f64)| {
        line.iter().map(move |&(y, v)| (x, (1.0 - x) * (0.5 + 0.5 * y), w * v)).collect::<Vec<_>>()
    };
    heights.iter().flat_map(row).collect()
}

fn grid(line: &[(f64, f64)]) -> Vec<(f64, f64, f64)> {
    line.iter().flat_map(|&(y, weight)| line.iter().map(move |&(x, w)| (x, y, w * weight))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error over monomials of `degree`: of a rule on the square, and on the triangle (0, 0), (1, 0), (0, 1).
    fn error(nodes: &[CubatureNode], degree: u32, is_triangle: bool) -> f64 {
        let monomial = |i: u32, j: u32| -> f64 {
            let sum = |n: &CubatureNode| {
                f64::from(n.weight) * f64::from(n.uv.x).powi(i as i32) * f64::from(n.uv.y).powi(j as i32)
            };
            let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
            let exact = if is_triangle {
                2.0 * factorial(i) * factorial(j) / factorial(i + j + 2)
            } else {
                1.0 / f64::from((i + 1) * (j + 1))
            };
            (nodes.iter().map(sum).sum::<f64>() - exact).abs()
        };
        (0..=degree).map(|i| monomial(i, degree - i)).fold(0.0, f64::max)
    }

    #[test]
    fn rules_are_exact_up_to_their_degree_and_not_beyond() {
        for rule in [Rule::One, Rule::Four, Rule::Six, Rule::Seven, Rule::Sixteen] {
            for (nodes, is_triangle) in [(rule.nodes(), false), (rule.triangle_nodes(), true)] {
                assert_eq!(nodes.len(), rule.nodes().len());
                for degree in 0..=rule.degree() {
                    let error = error(&nodes, degree, is_triangle);
                    assert!(error < 1e-6, "{rule:?} of degree {degree}, triangle {is_triangle}: {error}");
                }
                assert!(error(&nodes, rule.degree() + 1, is_triangle) > 1e-6, "{rule:?} is better than said");
            }
        }
    }
}
