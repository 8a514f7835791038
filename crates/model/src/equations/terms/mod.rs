//! The terms of the equations: the law of each slave node, and one list of forces on nodes: loads, springs, viscous
//! forces, bolts, supports that begin or end, springs that hold free motions. Temperatures act through the elements.

pub(in crate::equations) mod bolts;
pub(in crate::equations) mod enforcement;
pub(in crate::equations) mod law;
pub(in crate::equations) mod loads;
pub mod node;
pub(in crate::equations) mod springs;
pub(in crate::equations) mod supports;
pub(in crate::equations) mod temperature;
pub(in crate::equations) mod viscosity;

use crate::equations::evaluated::Step;
use crate::equations::loose::FreeMotions;
use crate::equations::supports::TemporarySupports;
use crate::equations::{ContactModel, Design, LoadTime};
use slipstick_linalg::BlockMatrix;

/// Where the forces of terms are evaluated.
#[derive(Clone, Copy)]
pub(in crate::equations) struct TermState<'a> {
    pub design: &'a Design,
    pub time: LoadTime,
    /// Unknowns; displacements come first.
    pub y: &'a [f64],
    /// The step, from whose start rates are measured, and the free motions that it holds; `None` for a state by
    /// itself, at which forces that need a step are zero.
    pub step: Option<(&'a Step, &'a FreeMotions)>,
}

impl<'a> TermState<'a> {
    /// That of an evaluation in a step.
    pub fn of(design: &'a Design, step: &'a Step, y: &'a [f64], free: &'a FreeMotions) -> Self {
        Self { design, time: step.time, y, step: Some((step, free)) }
    }

    pub fn model(&self) -> &'a ContactModel {
        &self.design.model
    }
}

/// Forces on nodes besides those of elements and contact, which add to R. Each rank adds those of its part.
pub(in crate::equations) trait ForceTerm {
    /// Whether f_int contains it, so that its energy is strain energy and reactions balance it.
    fn is_internal(&self) -> bool {
        false
    }

    /// Adds its part of R. \[F\]
    fn add_force(&self, at: TermState<'_>, out: &mut [f64]);

    /// Adds the derivative with respect to the displacements.
    fn add_tangent(&self, at: TermState<'_>, matrix: &mut BlockMatrix);

    /// Adds λᵀ times the derivative with respect to the unknowns before the step.
    fn pull_back_previous(&self, at: TermState<'_>, lambda: &[f64], out: &mut [f64]) {
        let _ = (at, lambda, out);
    }

    /// Adds λᵀ times the derivative with respect to the density of every element, on every rank that of the
    /// whole model.
    fn pull_back_density(&self, at: TermState<'_>, lambda: &[f64], out: &mut [f64]) {
        let _ = (at, lambda, out);
    }
}

impl ContactModel {
    /// The forces on nodes, in the order in which they are added.
    pub(in crate::equations) fn terms(&self) -> [&dyn ForceTerm; 6] {
        [&self.loads, &self.springs, &self.viscosity, &self.bolts, &TemporarySupports, &self.loose]
    }
}

impl TermState<'_> {
    /// Adds the forces of the terms that f_int contains, or of the others.
    pub fn add_forces(self, internal: bool, out: &mut [f64]) {
        let terms = self.model().terms();
        terms.iter().filter(|term| term.is_internal() == internal).for_each(|term| term.add_force(self, out));
    }
}
