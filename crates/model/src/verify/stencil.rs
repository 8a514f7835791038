//! Difference formulas of second order.

/// The points at which θ is evaluated in addition to the density itself, in steps along the
/// direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stencil {
    /// At φ + hv and φ − hv.
    Central,
    /// At φ + hv and φ + 2hv.
    OneSided,
}

impl Stencil {
    /// The two points, in steps.
    pub fn places(self) -> [f64; 2] {
        match self {
            Self::Central => [1.0, -1.0],
            Self::OneSided => [1.0, 2.0],
        }
    }

    /// The derivative from θ(φ) and θ at both [`places`](Self::places). Its error is h² θ‴/6 for
    /// the central formula, −h² θ‴/3 for the one-sided one.
    pub fn difference(self, h: f64, value: f64, [near, far]: [f64; 2]) -> f64 {
        match self {
            Self::Central => (near - far) / (2.0 * h),
            Self::OneSided => (4.0 * near - far - 3.0 * value) / (2.0 * h),
        }
    }

    /// h² θ″ at the middle one of the three points.
    pub fn second_difference(self, value: f64, [near, far]: [f64; 2]) -> f64 {
        match self {
            Self::Central => near - 2.0 * value + far,
            Self::OneSided => far - 2.0 * near + value,
        }
    }

    /// Maximum factor by which the formula amplifies round-off of the values, apart from the
    /// division by the step.
    pub fn amplification(self) -> f64 {
        match self {
            Self::Central => 1.0,
            Self::OneSided => 4.0,
        }
    }
}

/// The sign of the direction in which a density has room for a given distance within [0, 1].
pub(super) fn inwards(density: f64, way: f64) -> f64 {
    if density + way <= 1.0 || density < 0.5 { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By Taylor's series, both formulas are exact for quadratic functions; for cubic ones the
    /// errors are h² θ‴/6 and −h² θ‴/3.
    #[test]
    fn errors_are_those_of_taylors_series() {
        let theta = |x: f64, cubic: f64| 0.7 - 1.3 * x + 2.9 * x * x + cubic * x * x * x;
        let slope = |x: f64, cubic: f64| -1.3 + 5.8 * x + 3.0 * cubic * x * x;
        for (stencil, factor) in [(Stencil::Central, 1.0 / 6.0), (Stencil::OneSided, -1.0 / 3.0)] {
            for (h, cubic) in [(0.1, 0.0), (0.1, 1.7), (0.05, 1.7), (-0.05, 1.7)] {
                let x = 0.4;
                let values = stencil.places().map(|steps| theta(x + steps * h, cubic));
                let error = stencil.difference(h, theta(x, cubic), values) - slope(x, cubic);
                let expected = factor * h * h * 6.0 * cubic;
                assert!((error - expected).abs() < 1e-14, "{stencil:?} {h}: {error} for {expected}");
            }
        }
    }

    #[test]
    fn densities_move_inwards() {
        let found = [(1.0, 2e-3), (0.9995, 2e-3), (0.0, 2e-3), (5e-4, 2e-3), (0.5, 2e-3)].map(|(d, w)| inwards(d, w));
        assert_eq!(found, [-1.0, -1.0, 1.0, 1.0, 1.0]);
    }
}
