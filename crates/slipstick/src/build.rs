//! From a case to a problem.

use crate::case::Case;
use crate::machine::Machine;

pub use slipstick_case::construct::*;

/// Builds mesh, model, load path, design and objective in a single process.
///
/// # Errors
/// [`BuildError`] at the place in the case that cannot be built.
pub fn build(case: &Case) -> Result<Problem, BuildError> {
    build_on(case, &Machine::default())
}
