//! Errors in the input of the optimizer.

use super::Functions;
use thiserror::Error;

/// Why the optimizer cannot make a step. Its history is unchanged by the failed call.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MmaError {
    /// A parameter is out of range.
    #[error("MMA parameter {name} = {value}; it must be {range}")]
    Parameter {
        /// Its name.
        name: &'static str,
        /// The given value.
        value: f64,
        /// The allowed range.
        range: &'static str,
    },
    /// A vector has the wrong length.
    #[error("{what} has {found} entries, expected {expected}")]
    Length {
        /// Which vector.
        what: String,
        /// The length it must have.
        expected: usize,
        /// The length it has.
        found: usize,
    },
    /// An entry is infinite or not a number.
    #[error("{what} is {value} at entry {index}; the analysis that computed it has failed or overflowed")]
    NotFinite {
        /// Which vector or number.
        what: String,
        /// Entry, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A variable is outside its bounds, or the bounds are contradictory.
    #[error(
        "variable {index} = {value} is outside its bounds [{lower}, {upper}]; start from a design within the bounds"
    )]
    Bounds {
        /// Variable, from 0.
        index: usize,
        /// Its value.
        value: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A design is not between the asymptotes of the approximations by which it is judged.
    #[error(
        "variable {index} = {value} is not between the asymptotes {lower} and {upper}; judge a result of the last step, \
         or a design between it and the one before"
    )]
    Asymptotes {
        /// Variable, from 0.
        index: usize,
        /// Its value.
        value: f64,
        /// Its lower asymptote.
        lower: f64,
        /// Its upper asymptote.
        upper: f64,
    },
    /// The subproblem was not solved, which only happens for functions of extremely different
    /// scales.
    #[error(
        "the MMA subproblem stopped at residual {residual:e}; scale objective and constraints so that their largest \
         derivatives are near 1"
    )]
    Subproblem {
        /// Euclidean norm of the violations of the subproblem's optimality conditions.
        residual: f64,
    },
}

/// Checks one vector: its length and that every entry is finite.
pub(super) fn check_vector(what: &str, vector: &[f64], expected: usize) -> Result<(), MmaError> {
    if vector.len() != expected {
        return Err(MmaError::Length { what: what.to_owned(), expected, found: vector.len() });
    }
    match vector.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(MmaError::NotFinite { what: what.to_owned(), index, value: vector[index] }),
        None => Ok(()),
    }
}

/// Checks the functions of a problem with `n` variables and `m` constraints.
pub(super) fn check_functions(n: usize, m: usize, functions: &Functions<'_>) -> Result<(), MmaError> {
    let &Functions { objective, objective_gradient, constraints, constraint_gradients, largest_of } = functions;
    if !objective.is_finite() {
        return Err(MmaError::NotFinite { what: "the objective".to_owned(), index: 0, value: objective });
    }
    check_vector("the objective gradient", objective_gradient, n)?;
    check_vector("the list of constraint values", constraints, m)?;
    if largest_of > m {
        let what = "the list of functions whose largest is minimised".to_owned();
        return Err(MmaError::Length { what, expected: m, found: largest_of });
    }
    if constraint_gradients.len() != m {
        let what = "the list of constraint gradients".to_owned();
        return Err(MmaError::Length { what, expected: m, found: constraint_gradients.len() });
    }
    for (index, gradient) in constraint_gradients.iter().enumerate() {
        check_vector(&format!("the gradient of constraint {index}"), gradient, n)?;
    }
    Ok(())
}

/// Checks that `lower ≤ x ≤ upper`, all finite.
pub(super) fn check_point(n: usize, x: &[f64], [lower, upper]: [&[f64]; 2]) -> Result<(), MmaError> {
    check_vector("the design", x, n)?;
    check_vector("the lower bound", lower, n)?;
    check_vector("the upper bound", upper, n)?;
    match (0..n).find(|&j| !(lower[j] <= x[j] && x[j] <= upper[j])) {
        Some(index) => Err(MmaError::Bounds { index, value: x[index], lower: lower[index], upper: upper[index] }),
        None => Ok(()),
    }
}
