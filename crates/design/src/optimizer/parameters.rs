//! Parameters of the method of moving asymptotes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::MmaError;

/// Parameters of the method of moving asymptotes, version of 2007, named as in Svanberg's notes.
///
/// Lengths are relative to the range `upper − lower` of each variable, so no parameter has a unit.
/// Elastic variables `y` make every subproblem feasible: MMA minimizes `f₀(x) + z + Σ_i (c y_i + ½ d
/// y_i²)` subject to `f_i(x) − a_i z − y_i ≤ 0`, `y ≥ 0`, where `y_i` is a violation of constraint
/// `i` that costs `c` per unit. The coefficients `a_i` are 0, except for
/// [functions whose largest is minimized](super::Functions::largest_of): there, they are 1, and `z`
/// is the largest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MmaParameters {
    /// Distance of the asymptotes in the first two iterations. In (0, ∞).
    pub asyinit: f64,
    /// Factor by which the asymptotes move away if a variable keeps moving in one direction. At
    /// least 1.
    pub asyincr: f64,
    /// Factor by which the asymptotes move closer if a variable oscillates. In (0, 1].
    pub asydecr: f64,
    /// Smallest distance of the asymptotes. In (0, `asymax`].
    pub asymin: f64,
    /// Largest distance of the asymptotes.
    pub asymax: f64,
    /// A step leaves at least this part of the distance to the asymptotes. In (0, 1).
    pub albefa: f64,
    /// Largest change of a variable in a step: 0.1 in a case file, as in the paper; 0.5 in the
    /// notes. In (0, 1].
    pub move_limit: f64,
    /// Curvature that is added to each function. In (0, ∞).
    pub raa0: f64,
    /// Linear penalty for violating a constraint: well above the multipliers, after scaling. At
    /// least 0, `c + d > 0`.
    pub c: f64,
    /// Quadratic penalty for violating a constraint. At least 0.
    pub d: f64,
    /// Residual to which the subproblem is solved. In (0, 1).
    pub subproblem_tolerance: f64,
}

impl Default for MmaParameters {
    fn default() -> Self {
        Self {
            asyinit: 0.5,
            asyincr: 1.2,
            asydecr: 0.7,
            asymin: 0.01,
            asymax: 10.0,
            albefa: 0.1,
            move_limit: 0.5,
            raa0: 1e-5,
            c: 1000.0,
            d: 1.0,
            subproblem_tolerance: 1e-7,
        }
    }
}

impl MmaParameters {
    /// The notes' values ([`Default`]) with a move limit of 0.1, as in the paper, section 5.
    pub fn for_densities() -> Self {
        Self { move_limit: 0.1, ..Self::default() }
    }

    /// Each parameter by name.
    pub fn by_name(&mut self) -> [(&'static str, &mut f64); 11] {
        [
            ("move_limit", &mut self.move_limit),
            ("asyinit", &mut self.asyinit),
            ("asyincr", &mut self.asyincr),
            ("asydecr", &mut self.asydecr),
            ("asymin", &mut self.asymin),
            ("asymax", &mut self.asymax),
            ("albefa", &mut self.albefa),
            ("raa0", &mut self.raa0),
            ("c", &mut self.c),
            ("d", &mut self.d),
            ("subproblem_tolerance", &mut self.subproblem_tolerance),
        ]
    }

    /// Every parameter that is out of its range: its name, its value, and the range.
    pub fn out_of_range(&self) -> impl Iterator<Item = (&'static str, f64, &'static str)> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        let inside = |value: f64| value > 0.0 && value < 1.0;
        let checks = [
            ("asyinit", self.asyinit, positive(self.asyinit), "positive and finite"),
            ("asyincr", self.asyincr, self.asyincr >= 1.0 && self.asyincr.is_finite(), "at least 1 and finite"),
            ("asydecr", self.asydecr, self.asydecr > 0.0 && self.asydecr <= 1.0, "in (0, 1]"),
            ("asymax", self.asymax, positive(self.asymax), "positive and finite"),
            (
                "asymin",
                self.asymin,
                self.asymin > 0.0 && !(self.asymin > self.asymax && self.asymax > 0.0),
                "in (0, asymax]",
            ),
            ("albefa", self.albefa, inside(self.albefa), "in (0, 1)"),
            ("move_limit", self.move_limit, self.move_limit > 0.0 && self.move_limit <= 1.0, "in (0, 1]"),
            ("raa0", self.raa0, positive(self.raa0), "positive and finite"),
            ("d", self.d, not_negative(self.d), "finite and not negative"),
            ("c", self.c, not_negative(self.c) && !(self.c + self.d == 0.0), "finite and not negative, with c + d > 0"),
            ("subproblem_tolerance", self.subproblem_tolerance, inside(self.subproblem_tolerance), "in (0, 1)"),
        ];
        checks.into_iter().filter(|check| !check.2).map(|(name, value, _, range)| (name, value, range))
    }

    /// Checks every parameter against its range.
    ///
    /// # Errors
    ///
    /// [`MmaError::Parameter`] with the first parameter that is out of range.
    pub fn check(&self) -> Result<(), MmaError> {
        match self.out_of_range().next() {
            Some((name, value, range)) => Err(MmaError::Parameter { name, value, range }),
            None => Ok(()),
        }
    }
}
