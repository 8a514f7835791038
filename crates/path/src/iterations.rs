//! Records of iterations: the norms of each, and how a (sub-)step converged.

/// Norms of one iteration, as absolute values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct IterationRecord {
    /// Number of tangent solves so far in this Newton loop.
    pub iteration: usize,
    /// ‖R‖ over the free displacements, after the update. \[F\]
    pub residual: f64,
    /// ‖H‖. \[F/L²\]
    pub contact: f64,
    /// ‖Δd‖ of the update. \[L\]
    pub displacement: f64,
    /// ‖Δζ‖ of the update. \[F/L²\]
    pub multiplier: f64,
    /// Fraction of the Newton increment that was taken.
    pub step_length: f64,
    /// Numbers of contact nodes that are open, sticking, slipping.
    pub status: [usize; 3],
}

/// Number of iterations that [`still_falls`] considers.
pub(crate) const JUDGED: usize = 5;

/// Whether, over the last iterations, the force residual fell to less than half without an increase
/// of the contact residual; if so, more iterations would probably converge.
pub fn still_falls(iterations: &[IterationRecord]) -> bool {
    let [first, .., last] = &iterations[iterations.len().saturating_sub(JUDGED)..] else { return false };
    last.residual < 0.5 * first.residual && last.contact <= first.contact
}

/// How a (sub-)step converged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepReport {
    /// All Newton iterations, concatenated over all Uzawa iterations.
    pub iterations: Vec<IterationRecord>,
    /// Newton iterations of the attempts that failed between the previous state and this one.
    pub failed_iterations: usize,
    /// Uzawa iterations (0 for methods without them).
    pub uzawa: usize,
    /// Whether Newton's method failed, and [Uzawa's iteration over all
    /// multipliers](crate::Attempt::Rescue) or a [growing penalty](crate::Attempt::Penalty) led to the state: it may
    /// lie beyond a jump of the contact.
    pub rescued: bool,
    /// Whether the step [holds free motions](crate::HoldFreeMotions).
    pub holds: bool,
    /// The motions that are free at the state and so were held, in words.
    pub left_free: Vec<String>,
    /// Norm of the forces that hold them, relative to the forces in equilibrium.
    pub holding: f64,
    /// Work that these forces take in the step. \[F L\]
    pub holding_work: f64,
    /// If the last Newton iteration was limited by round-off of the positions, the remaining
    /// relative residual; `None` if it met the tolerances.
    pub rounded: Option<f64>,
}
