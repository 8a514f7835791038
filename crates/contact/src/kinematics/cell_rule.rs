//! Symmetric quadrature rules on the triangles of a clipped overlap, which meet at its area
//! centroid.
//!
//! Source: D. A. Dunavant, High degree efficient symmetrical Gaussian quadrature rules for the
//! triangle, Int. J. Numer. Meth. Eng. 21 (1985) 1129–1148.

/// A quadrature point: barycentric coordinates and weight. The weights of a rule sum to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellPoint {
    /// Barycentric coordinates with respect to the triangle's three vertices.
    pub barycentric: [f64; 3],
    /// Fraction of the triangle's area.
    pub weight: f64,
}

/// The integration rule of the mortar cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CellRule {
    /// 1 point, exact for degree 1.
    One,
    /// 3 points, exact for degree 2.
    Three,
    /// 6 points, exact for degree 4: integrates D and M of parallelograms exactly.
    Six,
    /// 7 points, exact for degree 5.
    #[default]
    Seven,
    /// 12 points, exact for degree 6.
    Twelve,
}

impl CellRule {
    /// The rule with this number of points, if there is one.
    pub fn with_points(points: usize) -> Option<Self> {
        Some(match points {
            1 => Self::One,
            3 => Self::Three,
            6 => Self::Six,
            7 => Self::Seven,
            12 => Self::Twelve,
            _ => return None,
        })
    }

    /// The polynomial degree up to which the rule is exact.
    pub fn degree(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Three => 2,
            Self::Six => 4,
            Self::Seven => 5,
            Self::Twelve => 6,
        }
    }

    /// The points of the rule.
    pub fn points(self) -> Vec<CellPoint> {
        let mut points = Vec::with_capacity(12);
        let root = 15f64.sqrt();
        match self {
            Self::One => centre(&mut points, 1.0),
            Self::Three => three(&mut points, 1.0 / 6.0, 1.0 / 3.0),
            Self::Six => {
                three(&mut points, 0.445_948_490_915_965, 0.223_381_589_678_011);
                three(&mut points, 0.091_576_213_509_771, 0.109_951_743_655_322);
            }
            Self::Seven => {
                centre(&mut points, 9.0 / 40.0);
                three(&mut points, (6.0 - root) / 21.0, (155.0 - root) / 1200.0);
                three(&mut points, (6.0 + root) / 21.0, (155.0 + root) / 1200.0);
            }
            Self::Twelve => {
                three(&mut points, 0.249_286_745_170_910, 0.116_786_275_726_379);
                three(&mut points, 0.063_089_014_491_502, 0.050_844_906_370_207);
                six(&mut points, 0.053_145_049_844_817, 0.310_352_451_033_784, 0.082_851_075_618_374);
            }
        }
        points
    }
}

fn centre(points: &mut Vec<CellPoint>, weight: f64) {
    points.push(CellPoint { barycentric: [1.0 / 3.0; 3], weight });
}

/// The three points (a, a, 1 − 2a) and their permutations.
fn three(points: &mut Vec<CellPoint>, a: f64, weight: f64) {
    let b = 1.0 - 2.0 * a;
    for barycentric in [[b, a, a], [a, b, a], [a, a, b]] {
        points.push(CellPoint { barycentric, weight });
    }
}

/// The six points (a, b, 1 − a − b) and their permutations.
fn six(points: &mut Vec<CellPoint>, a: f64, b: f64, weight: f64) {
    let c = 1.0 - a - b;
    for barycentric in [[a, b, c], [a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
        points.push(CellPoint { barycentric, weight });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rule that is requested by its number of points has this many points. There are five such
    /// numbers.
    #[test]
    fn rules_are_named_by_their_number_of_points() {
        let found: Vec<usize> = (0..100).filter(|&points| CellRule::with_points(points).is_some()).collect();
        assert_eq!(found, [1, 3, 6, 7, 12]);
        for points in found {
            assert_eq!(CellRule::with_points(points).unwrap().points().len(), points);
        }
    }

    /// ∫ over the unit triangle of λ₁^a λ₂^b = a! b! / (a + b + 2)!, times 2 for the normalized
    /// area.
    #[test]
    fn rules_integrate_monomials_to_their_degree() {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        for rule in [CellRule::One, CellRule::Three, CellRule::Six, CellRule::Seven, CellRule::Twelve] {
            for a in 0..=rule.degree() {
                for b in 0..=rule.degree() - a {
                    let found: f64 = rule
                        .points()
                        .iter()
                        .map(|p| p.weight * p.barycentric[0].powi(a as i32) * p.barycentric[1].powi(b as i32))
                        .sum();
                    let exact = 2.0 * factorial(a) * factorial(b) / factorial(a + b + 2);
                    assert!((found - exact).abs() < 5e-15, "{rule:?} λ1^{a} λ2^{b}: {found} instead of {exact}");
                }
            }
        }
    }
}
