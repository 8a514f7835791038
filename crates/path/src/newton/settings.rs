//! Settings of Newton's method: when it stops, and how accurately its linear systems are solved.

use crate::linear::SolveTolerance;
use crate::problem::Scales;

/// A bound on a norm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// Bound on the norm itself, in its own unit, as in the paper.
    Absolute(f64),
    /// Dimensionless bound on the norm divided by the problem's [`Scales`].
    Relative(f64),
}

impl Tolerance {
    pub(super) fn allows(self, norm: f64, scale: f64) -> bool {
        match self {
            Self::Absolute(bound) => norm <= bound,
            Self::Relative(bound) => norm <= bound * scale,
        }
    }

    /// The bound as a fraction of the scale.
    pub(super) fn relative_to(self, scale: f64) -> f64 {
        match self {
            Self::Absolute(bound) => bound / scale,
            Self::Relative(bound) => bound,
        }
    }

    /// Whether an increment is within the bound: an absolute bound applies to the last increment,
    /// as in the paper, unless the expected next one is much smaller, and a relative bound to the
    /// expected next increment.
    pub(super) fn allows_increment(self, last: f64, next: f64, scale: f64) -> bool {
        match self {
            Self::Absolute(bound) => last <= bound || next <= FAR_BELOW * bound,
            Self::Relative(bound) => next <= bound * scale,
        }
    }
}

/// The four bounds of the paper's section 5: ε_res, ε_disp, ε_con and ε_LMM.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Norm of the force residual R over the free unknowns.
    pub residual: Tolerance,
    /// Norm of the displacement increment: a relative bound applies to the expected next increment,
    /// an absolute bound to the last, unless a thousandth of it bounds the next.
    pub displacement: Tolerance,
    /// Norm of the contact residual H.
    pub contact: Tolerance,
    /// Norm of the multiplier increment, treated in the same way.
    pub multiplier: Tolerance,
}

impl Default for Tolerances {
    fn default() -> Self {
        let all = Tolerance::Relative(1e-9);
        Self { residual: all, displacement: all, contact: all, multiplier: all }
    }
}

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// Stopping criteria.
    pub tolerances: Tolerances,
    /// Maximum number of iterations of a (sub-)step; twice as many while the residual still falls.
    pub max_iterations: usize,
    /// Relative residual of the linear solves.
    pub linear_tolerance: f64,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self { tolerances: Tolerances::default(), max_iterations: 25, linear_tolerance: 1e-10 }
    }
}

impl NewtonOptions {
    /// Relative residual of the first linear solve.
    pub(super) fn first_forcing(&self) -> SolveTolerance {
        let least = |tolerance: f64| tolerance.max(self.linear_tolerance);
        SolveTolerance { direct: least(LOOSEST_SOLVE), iterative: least(FIRST_ITERATIVE_SOLVE) }
    }

    /// Relative residual of the next linear solve. It is proportional to the scaled residual `size`, so
    /// that convergence stays quadratic, until the tolerances are near.
    pub(super) fn forcing(&self, size: f64, scales: &Scales) -> f64 {
        let Tolerances { residual, contact, .. } = self.tolerances;
        let enough = residual.relative_to(scales.force).min(contact.relative_to(scales.multiplier));
        let proportional = (FORCING * size).max(OVERSOLVED * enough / size);
        proportional.min(LOOSEST_SOLVE).max(self.linear_tolerance)
    }
}

/// Fraction of an absolute bound that the expected next increment may reach if the last one exceeds the
/// bound.
const FAR_BELOW: f64 = 1e-3;
/// Ratio of the relative residual of a linear solve to the scaled residual of the nonlinear
/// equations, and the upper bound on the former: the residual that the nonlinearity leaves is rarely
/// below a hundredth of the previous one while the active set changes.
const FORCING: f64 = 1e-2;
const LOOSEST_SOLVE: f64 = 1e-2;
/// Relative residual of the first solve with an iterative solver, whose iterations stop there, while
/// direct factors leave far less. The forces of the prescribed motion, which enter the first
/// right-hand side, are large if a body is nearly incompressible. If a hundredth of them remains, the
/// contact starts far from its state: a block with ν = 0.499 on a slab needs 45 instead of 18 Newton
/// iterations. Test: `nearly_incompressible_bodies_take_few_iterations` (crate slipstick).
const FIRST_ITERATIVE_SOLVE: f64 = 1e-4;
/// Fraction of the tolerances below which a linear solve need not bring the residual of the nonlinear
/// equations: more digits would not be used (Kelley, Iterative Methods for Linear and Nonlinear
/// Equations, SIAM 1995, 6.3).
const OVERSOLVED: f64 = 1e-3;
#[cfg(test)]
mod tests {
    use super::*;

    /// By definition: an absolute bound applies to the norm and to the last increment, unless the next
    /// one is a thousand times smaller, and a relative bound to the fraction of the scale and to the next
    /// increment.
    #[test]
    fn bounds_are_on_norms_or_on_parts_of_scales() {
        let (absolute, relative) = (Tolerance::Absolute(0.1), Tolerance::Relative(0.1));
        let verdicts = |norm: f64| [absolute.allows(norm, 50.0), relative.allows(norm, 50.0)];
        assert_eq!(
            [0.05, 0.1, 0.2, 5.0, 6.0].map(verdicts),
            [[true, true], [true, true], [false, true], [false, true], [false, false]]
        );
        assert!(absolute.allows_increment(0.05, 7.0, 50.0) && !absolute.allows_increment(7.0, 0.05, 50.0));
        assert!(absolute.allows_increment(7.0, 9e-5, 50.0) && !absolute.allows_increment(7.0, 2e-4, 50.0));
        assert!(relative.allows_increment(7.0, 0.05, 50.0) && !relative.allows_increment(0.05, 7.0, 50.0));
    }

    /// By hand: a hundredth of the residual, between 1e-2 and the solver's own tolerance; near the
    /// tolerances, a thousandth of the stricter one.
    #[test]
    fn linear_solves_are_as_accurate_as_needed() {
        let scales = Scales { force: 10.0, multiplier: 2.0, displacement: 1.0, position: 1.0, rigidity: 0.0 };
        let mut options = NewtonOptions::default();
        let close = |found: f64, exact: f64| assert!((found / exact - 1.0).abs() < 1e-12, "{found} instead of {exact}");
        close(options.forcing(1.0, &scales), 1e-2);
        close(options.forcing(1e-3, &scales), 1e-5);
        close(options.forcing(1e-7, &scales), 1e-5);
        close(options.forcing(1e-10, &scales), 1e-2);
        options.tolerances.contact = Tolerance::Absolute(2e-12);
        close(options.forcing(1e-8, &scales), 1e-7);
        options.linear_tolerance = 1e-6;
        close(options.forcing(1e-8, &scales), 1e-6);
    }
}
