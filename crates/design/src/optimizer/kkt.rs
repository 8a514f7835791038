//! Optimality residual of a design.

use serde::{Deserialize, Serialize};

use super::error::{check_functions, check_point, check_vector};
use super::{Functions, MmaError, MmaParameters, MmaStep};

/// Residual of the optimality conditions of the problem that MMA solves; both are zero at an
/// optimum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KktResidual {
    /// Euclidean norm of all residuals.
    pub norm: f64,
    /// Largest absolute residual.
    pub max: f64,
}

/// Accumulates residuals.
struct Accumulator {
    squares: f64,
    max: f64,
}

impl Accumulator {
    fn add(&mut self, residual: f64) {
        self.squares += residual * residual;
        self.max = self.max.max(residual.abs());
    }
}

/// Residual of the Karush–Kuhn–Tucker conditions at the result `step.x` of a step, with the
/// multipliers of its subproblem and with values and gradients evaluated **at `step.x`** (the check
/// of the notes).
///
/// The multipliers of the bounds belong to the bounds of the step; if the move limit restrains a
/// variable, this appears in the residual. Values and gradients must have the same scaling as for
/// the step.
///
/// # Errors
///
/// If lengths are wrong, an entry is not finite, or the design is outside its bounds.
pub fn kkt_residual(
    parameters: &MmaParameters,
    step: &MmaStep,
    bounds: [&[f64]; 2],
    functions: &Functions<'_>,
) -> Result<KktResidual, MmaError> {
    let (n, m) = (step.x.len(), step.lambda.len());
    check_point(n, &step.x, bounds)?;
    check_functions(n, m, functions)?;
    let on_variables = [("xi", &step.xi, n), ("eta", &step.eta, n)];
    let on_constraints = [("y", &step.y, m), ("mu", &step.mu, m), ("slack", &step.slack, m)];
    for (what, vector, length) in on_variables.into_iter().chain(on_constraints) {
        check_vector(what, vector, length)?;
    }
    let bound_multipliers = |j: usize, _: f64| (step.xi[j], step.eta[j]);
    Ok(residual(parameters, &step.x, bounds, functions, step, bound_multipliers))
}

/// The same at the initial design of the step. There, the multipliers of the bounds are computed
/// from the gradient of the Lagrangian, so the residual is `∂L/∂x_j` times the distance to the
/// bound towards which it pushes.
pub(super) fn residual_at_input(
    parameters: &MmaParameters,
    x: &[f64],
    bounds: [&[f64]; 2],
    functions: &Functions<'_>,
    step: &MmaStep,
) -> KktResidual {
    let bound_multipliers = |_: usize, slope: f64| (slope.max(0.0), (-slope).max(0.0));
    residual(parameters, x, bounds, functions, step, bound_multipliers)
}

/// All conditions: stationarity in `x`, `y`, `z`, feasibility, complementarity. Notes, section on
/// the KKT conditions.
fn residual(
    parameters: &MmaParameters,
    x: &[f64],
    bounds: [&[f64]; 2],
    functions: &Functions<'_>,
    step: &MmaStep,
    bound_multipliers: impl Fn(usize, f64) -> (f64, f64),
) -> KktResidual {
    let (p, [lower, upper]) = (parameters, bounds);
    let &Functions { objective_gradient, constraints, constraint_gradients, largest_of, .. } = functions;
    let mut sum = Accumulator { squares: 0.0, max: 0.0 };
    for j in 0..x.len() {
        let mut slope = objective_gradient[j];
        for (lambda, gradient) in step.lambda.iter().zip(constraint_gradients) {
            slope += lambda * gradient[j];
        }
        let (xi, eta) = bound_multipliers(j, slope);
        sum.add(slope - xi + eta);
        sum.add(xi * (x[j] - lower[j]));
        sum.add(eta * (upper[j] - x[j]));
    }
    for i in 0..constraints.len() {
        sum.add(p.c + p.d * step.y[i] - step.mu[i] - step.lambda[i]);
        let z = if i < largest_of { step.z } else { 0.0 };
        sum.add(constraints[i] - z - step.y[i] + step.slack[i]);
        sum.add(step.mu[i] * step.y[i]);
        sum.add(step.lambda[i] * step.slack[i]);
    }
    sum.add(1.0 - step.zeta - step.lambda[..largest_of].iter().sum::<f64>());
    if largest_of == 0 {
        sum.add(step.zeta * step.z);
    }
    KktResidual { norm: sum.squares.sqrt(), max: sum.max }
}
