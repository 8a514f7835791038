//! Values of quantities, with the product of any weights and their derivatives.

use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use slipstick::analysis::Forward;
use slipstick::design::Response;

use crate::arrays;
use crate::built::Built;
use crate::compute::{observing, watched};
use crate::errors::{Error, detached};
use crate::parameters::named;

/// The values of quantities along a path, and what pulls weights back.
#[pyclass(frozen, module = "slipstick._slipstick")]
pub struct Linearization {
    built: Arc<Built>,
    response: Response,
    forward: Forward,
}

impl Linearization {
    pub(crate) fn new(built: Arc<Built>, response: Response, forward: Forward) -> Self {
        Self { built, response, forward }
    }
}

/// Derivatives with respect to densities and parameters.
type Derivatives<'py> = (Bound<'py, PyArray1<f64>>, Vec<(&'static str, String, f64)>);

#[pymethods]
impl Linearization {
    /// Values: a row for each quantity, a column for each load step.
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rows = &self.forward.quantities[0];
        let steps = rows.first().map_or(0, Vec::len);
        arrays::matrix(py, rows.concat(), steps)
    }

    /// Derivatives of the sum of all values times these weights, which have the shape of the
    /// values.
    fn pull_back<'py>(
        &self,
        py: Python<'py>,
        weights: PyReadonlyArray2<'_, f64>,
        parameters: bool,
    ) -> PyResult<Derivatives<'py>> {
        let weights: Vec<Vec<f64>> = weights.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
        let gradients = detached(py, || {
            let mut problem = self.built.lock()?;
            observing(&mut problem, &self.response, |problem| {
                watched(problem, None, |problem, _| {
                    let gradients = problem.analysis.pull_back(&self.forward, weights, parameters);
                    gradients.map_err(|error| Error::analysis(problem, &error))
                })
            })
        })?;
        let parameters = if parameters { named(&self.built.case.case, &gradients) } else { Vec::new() };
        Ok((Vec::from(gradients.density).into_pyarray(py), parameters))
    }
}
