//! The unknowns and inputs of a problem, and a state of them.

/// State at the end of a (sub-)step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StepState {
    /// y: displacements (3 per node), then multipliers if the method has them (3 per slave node).
    pub unknowns: Vec<f64>,
    /// h: explicit, node-local history; empty if the method has none.
    pub history: Vec<f64>,
}

/// Which multipliers an inner solve holds fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Held {
    /// None: displacements and multipliers are solved for together.
    #[default]
    None,
    /// Those that Uzawa's iteration updates: the multipliers of the augmented Lagrangian.
    Augmented,
    /// All, including those of the Lagrange method, while a step is [rescued](crate::Attempt::Rescue).
    All,
}

/// The unknowns and inputs of a problem: how many there are, and which are solved for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Unknowns {
    /// Number of displacement unknowns. They come first.
    pub displacements: usize,
    /// Which unknowns are not solved for if no multiplier is held, if those of the augmented
    /// Lagrangian are, and if all are: one entry per unknown.
    pub fixed: [Vec<bool>; 3],
    /// Elimination group of every block row (three unknowns), see [`slipstick_linalg::Reduction`].
    pub groups: Vec<u32>,
    /// Length of the history.
    pub history: usize,
    /// Number of design densities.
    pub designs: usize,
    /// Number of parameters, in addition to the design, with respect to which the path can be
    /// differentiated: coefficients of friction, moduli, amplitudes of prescribed motions and
    /// loads.
    pub parameters: usize,
    /// Number of reference positions, three per node, with respect to which the equations can be differentiated.
    pub positions: usize,
}

impl Unknowns {
    /// Only displacements, with the `fixed` ones prescribed, and `designs` densities.
    pub fn displacements(fixed: &[bool], designs: usize) -> Self {
        Self {
            displacements: fixed.len(),
            fixed: [(); 3].map(|()| fixed.to_vec()),
            groups: (0..fixed.len() as u32 / 3).collect(),
            designs,
            ..Self::default()
        }
    }

    /// Number of all unknowns.
    pub fn count(&self) -> usize {
        self.fixed[0].len()
    }

    /// Which unknowns are prescribed, or held.
    pub fn fixed(&self, held: Held) -> &[bool] {
        &self.fixed[held as usize]
    }
}
