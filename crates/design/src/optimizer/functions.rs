//! The data that an optimizer needs about a problem at a design.

/// Values and derivatives of the functions of a problem at a design x, scaled by
/// [`Scaling`](super::Scaling).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Functions<'a> {
    /// f₀(x), to be minimized.
    pub objective: f64,
    /// ∂f₀/∂x_j.
    pub objective_gradient: &'a [f64],
    /// g_i(x) ≤ 0.
    pub constraints: &'a [f64],
    /// ∂g_i/∂x_j, as `[i][j]`.
    pub constraint_gradients: &'a [Vec<f64>],
    /// The first so many g_i are not constraints, but functions whose largest is minimized, in
    /// addition to f₀: a variable z with g_i(x) ≤ z takes part in the minimization (the bound
    /// formulation).
    pub largest_of: usize,
}

impl<'a> Functions<'a> {
    /// An objective and constraints.
    pub fn new(
        objective: f64,
        objective_gradient: &'a [f64],
        constraints: &'a [f64],
        constraint_gradients: &'a [Vec<f64>],
    ) -> Self {
        Self { objective, objective_gradient, constraints, constraint_gradients, largest_of: 0 }
    }

    /// The largest of the first `count` constraints is minimized: see
    /// [`largest_of`](Self::largest_of).
    pub fn minimising_the_largest_of(self, count: usize) -> Self {
        Self { largest_of: count, ..self }
    }
}
