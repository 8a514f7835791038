//! Semi-smooth Newton's method for one (sub-)step.

use crate::failure::{StateError, StepFailure, StepFailureKind};
use crate::linear::LinearSystem;
use crate::problem::{Scales, StepProblem};

/// A bound on a norm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// On the norm itself, in its unit, as in the paper.
    Absolute(f64),
    /// On the norm divided by the problem's [`Scales`]: free of units.
    Relative(f64),
}

impl Tolerance {
    fn allows(self, norm: f64, scale: f64) -> bool {
        match self {
            Self::Absolute(bound) => norm <= bound,
            Self::Relative(bound) => norm <= bound * scale,
        }
    }
}

/// The four bounds of the paper's section 5: ε_res, ε_disp, ε_con and ε_LMM.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Norm of the force residual R over the free unknowns.
    pub residual: Tolerance,
    /// Norm of the displacement increment.
    pub displacement: Tolerance,
    /// Norm of the contact residual H.
    pub contact: Tolerance,
    /// Norm of the multiplier increment.
    pub multiplier: Tolerance,
}

impl Default for Tolerances {
    fn default() -> Self {
        let all = Tolerance::Relative(1e-9);
        Self { residual: all, displacement: all, contact: all, multiplier: all }
    }
}

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// When to stop.
    pub tolerances: Tolerances,
    /// Most iterations of a (sub-)step.
    pub max_iterations: usize,
    /// Relative residual of the linear solves.
    pub linear_tolerance: f64,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self { tolerances: Tolerances::default(), max_iterations: 25, linear_tolerance: 1e-10 }
    }
}

/// Norms of one iteration, absolute.
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
    /// Contact nodes that are open, sticking, slipping.
    pub status: [usize; 3],
}

/// How a (sub-)step converged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepReport {
    /// All Newton iterations, of all Uzawa iterations one after the other.
    pub iterations: Vec<IterationRecord>,
    /// Uzawa iterations (0 for methods without).
    pub uzawa: usize,
}

/// Largest growth of the residual over its value after the first solve that still counts as on its way.
const DIVERGED: f64 = 1e8;

/// Solves F(y) = 0 from `y`, whose prescribed entries still hold the last step's values, to the prescribed values of
/// `target`. The Dirichlet increment is carried through the tangent: K_ff Δy_f = −F_f − K_fp Δy_p in the first solve.
///
/// Paper: (28)–(30), (36), (45). Test: `newton_converges_quadratically` (crate slipstick).
pub(crate) fn solve(
    problem: &mut dyn StepProblem,
    linear: &mut LinearSystem,
    y: &mut [f64],
    target: &[f64],
    options: &NewtonOptions,
    report: &mut StepReport,
) -> Result<(), StepFailure> {
    let mut records = Vec::new();
    let result = iterate(problem, linear, y, target, options, &mut records);
    report.iterations.extend_from_slice(&records);
    result.map_err(|kind| StepFailure { kind, iterations: std::mem::take(&mut report.iterations), iterate: y.to_vec() })
}

fn iterate(
    problem: &mut dyn StepProblem,
    linear: &mut LinearSystem,
    y: &mut [f64],
    target: &[f64],
    options: &NewtonOptions,
    records: &mut Vec<IterationRecord>,
) -> Result<(), StepFailureKind> {
    let n = problem.unknowns();
    let displacements = problem.displacements();
    let mut residual = vec![0.0; n];
    problem.residual(y, &mut residual)?;
    let mut sets = ActiveSets::default();
    let mut reference = f64::INFINITY;
    for iteration in 1..=options.max_iterations {
        let fixed = problem.fixed().to_vec();
        let mut rhs: Vec<f64> = residual.iter().map(|r| -r).collect();
        let groups = problem.groups().to_vec();
        let matrix = problem.tangent(y)?;
        let mut prescribed = vec![0.0; n];
        if iteration == 1 {
            for i in 0..displacements {
                if fixed[i] {
                    prescribed[i] = target[i] - y[i];
                }
            }
            let mut carried = vec![0.0; n];
            matrix.mul(&prescribed, &mut carried);
            rhs.iter_mut().zip(&carried).for_each(|(r, c)| *r -= c);
        }
        let factored = linear.factorize(matrix, &fixed, &groups)?;
        let mut increment = factored.solve(&rhs, false, options.linear_tolerance)?;
        for i in 0..displacements {
            if iteration == 1 && fixed[i] {
                increment[i] = prescribed[i];
            }
        }
        finite(&increment, "the Newton increment")?;
        // a first increment carries the prescribed motion, so it is taken whole
        let step_length = advance(problem, y, &increment, &mut residual, if iteration == 1 { 0 } else { 4 })?;
        if iteration == 1 {
            for i in 0..displacements {
                if fixed[i] {
                    y[i] = target[i];
                }
            }
        }
        let record = record(problem, iteration, &residual, &increment, &fixed, step_length);
        records.push(record);
        let scales = problem.scales();
        if converged(&record, &scales, &options.tolerances) {
            return Ok(());
        }
        let size = record.residual / scales.force + record.contact / scales.multiplier;
        if iteration == 1 {
            reference = size.max(1.0);
        } else if !(size < DIVERGED * reference) {
            return Err(StepFailureKind::Diverged);
        }
        if let Some(nodes) = sets.cycling(problem.active_set()) {
            return Err(StepFailureKind::Cycling { nodes });
        }
    }
    Err(StepFailureKind::TooManyIterations(options.max_iterations))
}

/// y ← y + α Δ with α halved up to `halvings` times until the residual exists; returns α.
fn advance(
    problem: &mut dyn StepProblem,
    y: &mut [f64],
    increment: &[f64],
    residual: &mut [f64],
    halvings: usize,
) -> Result<f64, StateError> {
    let start = y.to_vec();
    let mut length = 1.0;
    for attempt in 0..=halvings {
        for i in 0..y.len() {
            y[i] = start[i] + length * increment[i];
        }
        match problem.residual(y, residual).and_then(|()| finite(residual, "the residual")) {
            Ok(()) => return Ok(length),
            Err(error) if attempt == halvings => return Err(error),
            Err(_) => length *= 0.5,
        }
    }
    unreachable!("the loop returns in its last pass")
}

fn finite(values: &[f64], quantity: &'static str) -> Result<(), StateError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(StateError::NotFinite { quantity, index }),
        None => Ok(()),
    }
}

fn record(
    problem: &dyn StepProblem,
    iteration: usize,
    residual: &[f64],
    increment: &[f64],
    fixed: &[bool],
    step_length: f64,
) -> IterationRecord {
    let split = problem.displacements();
    let free_norm = |values: &[f64], offset: usize| {
        values.iter().enumerate().filter(|(i, _)| !fixed[offset + i]).map(|(_, v)| v * v).sum::<f64>().sqrt()
    };
    let mut status = [0; 3];
    for &s in problem.active_set() {
        status[s as usize] += 1;
    }
    IterationRecord {
        iteration,
        residual: free_norm(&residual[..split], 0),
        contact: free_norm(&residual[split..], split),
        displacement: step_length * free_norm(&increment[..split], 0),
        multiplier: step_length * free_norm(&increment[split..], split),
        step_length,
        status,
    }
}

fn converged(record: &IterationRecord, scales: &Scales, tolerances: &Tolerances) -> bool {
    tolerances.residual.allows(record.residual, scales.force)
        && tolerances.displacement.allows(record.displacement, scales.displacement)
        && tolerances.contact.allows(record.contact, scales.multiplier)
        && tolerances.multiplier.allows(record.multiplier, scales.multiplier)
}

/// Recognises an active set that comes back again and again.
#[derive(Default)]
struct ActiveSets {
    history: Vec<Vec<u8>>,
}

impl ActiveSets {
    /// Adds the set of this iteration. `Some(positions that change)` if the same set was left and met again at least
    /// three times.
    fn cycling(&mut self, now: &[u8]) -> Option<Vec<u32>> {
        let changed = self.history.last().is_some_and(|last| last != now);
        let returns = self.history.iter().filter(|set| set.as_slice() == now).count();
        let cycle = changed && returns >= 3;
        let nodes = cycle.then(|| {
            (0..now.len() as u32)
                .filter(|&i| self.history.iter().rev().take(8).any(|set| set[i as usize] != now[i as usize]))
                .collect()
        });
        self.history.push(now.to_vec());
        nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alternating_active_set_is_recognised_and_a_settled_one_is_not() {
        let mut sets = ActiveSets::default();
        let verdicts: Vec<_> = (0..8).map(|k| sets.cycling(&[1, (k % 2) as u8])).collect();
        assert_eq!(verdicts.iter().position(Option::is_some), Some(6));
        assert_eq!(verdicts[6], Some(vec![1]));
        let mut sets = ActiveSets::default();
        assert!((0..20).all(|_| sets.cycling(&[1, 2]).is_none()));
    }
}
