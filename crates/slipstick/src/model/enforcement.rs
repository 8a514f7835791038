//! How the contact conditions of each interface are enforced, and with which stiffness.
//!
//! Each interface has a method of its own. What differs between them differs by slave node: which unknowns, history and
//! rows it has. Uzawa's iteration goes over all nodes of the augmented Lagrangian together, while the multipliers of the
//! Lagrange method are unknowns of its inner solves.

use super::{ContactModel, SlaveData};
use slipstick_contact::enforcement::{Stiffness, StiffnessScaling};
use slipstick_path::{Held, UzawaOptions};

/// How an interface is enforced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enforcement {
    /// The method.
    pub method: Method,
    /// c of the Lagrange method, on which the solution does not depend; ε of the others.
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
    /// As multiple of the bodies' own stiffness E/h at the interface, with E the moduli of both sides in series and h the
    /// facet size: ε h/E or c h A/E, unit-free.
    ///
    /// The penalty method takes E at the start design, because ε must not depend on the design; the others take the
    /// current E, because their solution does not depend on it.
    Relative {
        /// The multiple.
        factor: f64,
        /// What the product is brought to multiply; for weighted measures, by the reference area of each node.
        scaling: StiffnessScaling,
    },
    /// Values in units.
    Absolute(Stiffness),
}

/// When Uzawa's iteration stops; one for all interfaces that have it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uzawa {
    /// Tolerance, most iterations, acceleration.
    pub options: UzawaOptions,
    /// Whether the tolerance bounds |ζ − ẑ|/ε (the paper's measure, a weighted gap) instead of the change of traction
    /// relative to the largest traction.
    pub absolute: bool,
}

/// Default of ε h/E of the penalty and augmented Lagrangian methods; also the stiffness of contact at partly covered
/// nodes.
pub const DEFAULT_STIFFNESS: f64 = 10.0;

/// Default of c_n h A/E of the Lagrange method.
pub const DEFAULT_COMPLEMENTARITY: f64 = 2.0;

/// c_t/c_n of the Lagrange method where they follow from a factor; docs/robustness.md compares choices.
pub const TANGENTIAL_COMPLEMENTARITY: f64 = 2.5;

/// c h A/E in second-order updates of the augmented Lagrangian's multipliers, and ε h/E in the first attempt to rescue a step of
/// the Lagrange method.
pub(super) const UPDATE_STIFFNESS: f64 = 5.0;

/// Most Uzawa iterations where a tolerance far below the case's own is asked for.
const TIGHT_ITERATIONS: usize = 10_000;

impl Method {
    /// Whether the multipliers are unknowns.
    pub fn has_multipliers(self) -> bool {
        self != Self::Penalty
    }
}

/// Which unknowns are not solved for, by which multipliers are held.
pub(super) struct FixedUnknowns {
    none: Vec<bool>,
    augmented: Vec<bool>,
    all: Vec<bool>,
}

impl FixedUnknowns {
    /// Of displacements alone.
    pub(super) fn new(displacements: &[bool]) -> Self {
        let [none, augmented, all] = [(); 3].map(|()| displacements.to_vec());
        Self { none, augmented, all }
    }

    /// Adds the multiplier of a slave node whose components are fixed as in `none` where no multiplier is held.
    pub(super) fn add_multiplier(&mut self, none: [bool; 3], method: Method) {
        self.none.extend(none);
        self.augmented.extend(if method == Method::Lagrange { none } else { [true; 3] });
        self.all.extend([true; 3]);
    }

    pub(super) fn of(&self, held: Held) -> &[bool] {
        match held {
            Held::None => &self.none,
            Held::Augmented => &self.augmented,
            Held::All => &self.all,
        }
    }
}

impl ContactModel {
    /// Method of slave node j.
    pub(super) fn method_of(&self, j: usize) -> Method {
        self.interfaces[self.slaves[j].interface as usize].enforcement.method
    }

    /// Whether an interface has this method.
    pub(super) fn has(&self, method: Method) -> bool {
        self.interfaces.iter().any(|i| i.enforcement.method == method)
    }

    /// Length of the history: two tangential tractions per slave node where an interface has the penalty method, those of
    /// other interfaces' nodes zero.
    pub(super) fn tangential_history(&self) -> usize {
        if self.has(Method::Penalty) { 2 * self.slaves.len() } else { 0 }
    }

    /// ε or c of every slave node, as given or from the present hardness; that of the start design for the penalty method.
    pub(super) fn node_stiffness(&self) -> Vec<Stiffness> {
        let of = |(j, slave): (usize, &SlaveData)| {
            let Enforcement { method, stiffness } = self.interfaces[slave.interface as usize].enforcement;
            let hardness = if method == Method::Penalty { self.start_hardness[j] } else { self.hardness[j] };
            match stiffness {
                // weighted measures of the half are half of the whole's
                GivenStiffness::Absolute(Stiffness { normal, tangential, scaling: StiffnessScaling::Weighted }) => {
                    Stiffness {
                        normal: normal * slave.images,
                        tangential: tangential * slave.images,
                        scaling: StiffnessScaling::Weighted,
                    }
                }
                GivenStiffness::Absolute(stiffness) => stiffness,
                GivenStiffness::Relative { factor, scaling } => {
                    let both = match scaling {
                        StiffnessScaling::Area | StiffnessScaling::ReferenceArea => factor * hardness,
                        StiffnessScaling::Weighted => factor * hardness / slave.area,
                    };
                    let ratio = if method == Method::Lagrange { TANGENTIAL_COMPLEMENTARITY } else { 1.0 };
                    Stiffness { normal: both, tangential: ratio * both, scaling }
                }
            }
        };
        self.slaves.iter().enumerate().map(of).collect()
    }

    /// A multiple of the bodies' own stiffness at slave node j.
    pub(super) fn own_stiffness(&self, j: usize, factor: f64) -> Stiffness {
        let both = factor * self.hardness[j];
        Stiffness { normal: both, tangential: both, scaling: StiffnessScaling::Area }
    }

    /// Uzawa's iteration, where an interface has the augmented Lagrangian.
    pub fn uzawa(&self) -> Option<Uzawa> {
        self.uzawa
    }

    /// Sets when Uzawa's iteration stops; nothing where no interface has it.
    pub fn set_uzawa(&mut self, uzawa: Option<Uzawa>) {
        self.uzawa = self.uzawa.and(uzawa);
    }

    /// Sets the tolerance of Uzawa's iteration, relative; nothing where no interface has it.
    pub fn set_uzawa_tolerance(&mut self, tolerance: f64) {
        if let Some(Uzawa { options, absolute }) = &mut self.uzawa {
            *absolute = false;
            options.tolerance = tolerance;
            options.max_iterations = options.max_iterations.max(TIGHT_ITERATIONS);
        }
    }
}
