//! How the contact conditions of each interface are enforced, and with which stiffness.
//!
//! Each interface has its own method. The methods differ at each slave node, in its unknowns,
//! history and rows. Uzawa's iteration treats all nodes of the augmented Lagrangian together, while
//! the multipliers of the Lagrange method are unknowns of its inner solves.

use crate::equations::ContactModel;
use slipstick_contact::enforcement::{Stiffness, StiffnessScaling};
use slipstick_path::{StepState, UzawaOptions};
use std::ops::Range;

/// How an interface is enforced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enforcement {
    /// The method.
    pub method: Method,
    /// c of the Lagrange method, which does not affect the solution; ε of the other methods.
    pub stiffness: GivenStiffness,
}

/// The methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Lagrange multipliers, solved for with the displacements.
    Lagrange,
    /// Penalty.
    Penalty,
    /// Augmented Lagrangian, by Uzawa's iteration.
    Augmented,
}

/// ε or c of an interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GivenStiffness {
    /// A multiple of the bodies' own stiffness E/h at the interface, with E the moduli of both
    /// sides in series and h the facet size: ε h/E or c h A/E, unit-free.
    ///
    /// The penalty method uses E at the start design, because ε must not depend on the design; the
    /// others use the current E, because their solution does not depend on it.
    Relative {
        /// The multiple.
        factor: f64,
        /// The measures that the stiffness multiplies; for weighted measures it is divided by the
        /// reference area of each node.
        scaling: StiffnessScaling,
    },
    /// Values with units.
    Absolute(Stiffness),
}

/// When Uzawa's iteration stops; common to all interfaces that use it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uzawa {
    /// Tolerance, maximum number of iterations, acceleration.
    pub options: UzawaOptions,
    /// Whether the tolerance bounds |ζ − ẑ|/ε (the paper's measure, a weighted gap) instead of the
    /// change of traction relative to the largest traction.
    pub absolute: bool,
}

/// Default of ε h/E of the penalty and augmented Lagrangian methods; also the stiffness of contact
/// at partly covered nodes.
pub const DEFAULT_STIFFNESS: f64 = 10.0;

/// Default of c_n h A/E of the Lagrange method.
pub const DEFAULT_COMPLEMENTARITY: f64 = 2.0;

/// c_t/c_n of the Lagrange method if they are derived from a factor; docs/measurements/robustness.md compares
/// choices.
pub const TANGENTIAL_COMPLEMENTARITY: f64 = 2.5;

/// c h A/E in second-order updates of the augmented Lagrangian's multipliers, and ε h/E in the
/// first attempt to rescue a step of the Lagrange method.
pub(in crate::equations) const UPDATE_STIFFNESS: f64 = 5.0;

/// Maximum number of Uzawa iterations if a tolerance far below the case's own is requested.
const TIGHT_ITERATIONS: usize = 10_000;

impl Method {
    /// Whether the multipliers are unknowns.
    pub fn has_multipliers(self) -> bool {
        self != Self::Penalty
    }
}

/// The parts of a history.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(in crate::equations) struct HistoryLayout {
    /// Tangential tractions of the penalty method, two per slave node.
    pub contact: Range<usize>,
    /// History of the elements with memory.
    pub solid: Range<usize>,
}

impl ContactModel {
    /// The history of the elements with memory at a state.
    pub fn solid_history<'a>(&self, state: &'a StepState) -> &'a [f64] {
        &state.history[self.history.solid.clone()]
    }

    /// Whether elements have memory.
    pub fn has_memory(&self) -> bool {
        self.solid.history() > 0
    }

    /// Method of slave node j.
    pub(in crate::equations) fn method_of(&self, j: usize) -> Method {
        self.interfaces[self.slaves[j].interface as usize].enforcement.method
    }

    /// Whether an interface has this method.
    pub(in crate::equations) fn has(&self, method: Method) -> bool {
        self.interfaces.iter().any(|i| i.enforcement.method == method)
    }

    /// Length of the history: two tangential tractions per slave node if an interface has the
    /// penalty method; those of other interfaces' nodes are zero.
    fn tangential_history(&self) -> usize {
        if self.has(Method::Penalty) { 2 * self.slaves.len() } else { 0 }
    }

    /// Where a history holds what.
    pub(in crate::equations) fn history_layout(&self) -> HistoryLayout {
        let contact = self.tangential_history();
        HistoryLayout { contact: 0..contact, solid: contact..contact + self.solid.history() }
    }

    /// Uzawa's iteration, if an interface has the augmented Lagrangian.
    pub fn uzawa(&self) -> Option<Uzawa> {
        self.uzawa
    }

    /// Sets when Uzawa's iteration stops; does nothing if no interface uses it.
    pub(crate) fn set_uzawa(&mut self, uzawa: Option<Uzawa>) {
        self.uzawa = self.uzawa.and(uzawa);
    }

    /// Sets the relative tolerance of Uzawa's iteration; does nothing if no interface uses it.
    pub(crate) fn set_uzawa_tolerance(&mut self, tolerance: f64) {
        if let Some(Uzawa { options, absolute }) = &mut self.uzawa {
            *absolute = false;
            options.tolerance = tolerance;
            options.max_iterations = options.max_iterations.max(TIGHT_ITERATIONS);
        }
    }
}
