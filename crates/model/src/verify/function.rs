//! The function whose gradient is compared.

use crate::analysis::{Analysis, AnalysisError, Forward, Rounding};
use slipstick_design::{DensityMap, ElementValues};
use slipstick_path::{MarchObserver, StepFailureKind, SweepError, Tolerance, Tolerances};

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// An analysis failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The objective is only round-off, and so are its differences.
    #[error("{0}")]
    Rounding(Rounding),
    /// Interrupted; differences of incomplete paths have no meaning.
    #[error("interrupted")]
    Interrupted,
}
/// θ as a function of one number per element: its density or, with a map, the variable of which it is
/// the first element.
pub(super) struct Function<'a> {
    pub(super) analysis: &'a mut Analysis,
    pub(super) map: Option<&'a DensityMap>,
}

impl Function<'_> {
    /// Computes the whole path at these numbers.
    pub(super) fn forward(
        &mut self,
        at: &ElementValues,
        observer: &mut dyn MarchObserver,
    ) -> Result<Forward, VerifyError> {
        let mapped = self.map.map(|map| map.densities(&map.variables().at_first(at)));
        let forward = self.analysis.forward(mapped.as_ref().unwrap_or(at), observer)?;
        if forward.path.steps < self.analysis.times.len() { Err(VerifyError::Interrupted) } else { Ok(forward) }
    }

    /// The gradient with respect to these numbers.
    pub(super) fn gradient(&mut self, forward: &Forward, at: &ElementValues) -> Result<ElementValues, VerifyError> {
        let gradient = self.analysis.gradient(forward).map_err(|error| match error {
            AnalysisError::Sweep(SweepError { kind: StepFailureKind::Interrupted, .. }) => VerifyError::Interrupted,
            error => error.into(),
        })?;
        Ok(match self.map {
            Some(map) => map.variables().spread(&map.pull_back(&map.variables().at_first(at), &gradient)),
            None => gradient,
        })
    }
}

pub(super) fn set_tolerance(analysis: &mut Analysis, tolerance: f64) {
    let bound = Tolerance::Relative(tolerance);
    analysis.march.newton.tolerances =
        Tolerances { residual: bound, displacement: bound, contact: bound, multiplier: bound };
    analysis.set_uzawa_tolerance(tolerance);
}
