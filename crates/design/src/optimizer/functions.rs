//! The data that an optimizer needs about a problem at a design.

/// Values and derivatives of the functions of a problem at a design x, scaled by
/// [`Scaling`](super::Scaling).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Functions<'a> {
    /// f₀(x), to be minimised.
    pub objective: f64,
    /// ∂f₀/∂x_j.
    pub objective_gradient: &'a [f64],
    /// g_i(x) ≤ 0.
    pub constraints: &'a [f64],
    /// ∂g_i/∂x_j, as `[i][j]`.
    pub constraint_gradients: &'a [Vec<f64>],
}

impl<'a> Functions<'a> {
    /// In the order of the fields.
    pub fn new(
        objective: f64,
        objective_gradient: &'a [f64],
        constraints: &'a [f64],
        constraint_gradients: &'a [Vec<f64>],
    ) -> Self {
        Self { objective, objective_gradient, constraints, constraint_gradients }
    }
}
