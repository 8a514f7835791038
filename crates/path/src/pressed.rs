//! Compares Uzawa's iteration on the smallest problem that uses it with a solution by hand: a
//! spring presses a node onto the ground, with a multiplier of the augmented Lagrangian.
//!
//! ```text
//! p = max(0, ζ − ε u)        F = φ (u − v) − p = 0        C = ζ − p = 0        v = −t
//! ```
//!
//! At the solution, u = 0 and ζ = φ t. With ζ held, each inner solve leaves the fraction φ/(φ + ε)
//! of the violation.

use crate::attempt::solve_increment;
use crate::equations::UnknownAt;
use crate::newton::Start;
use crate::{
    Adjoint, Attempt, ContactStatus, Evaluated, Inputs, Iteration, LinearSystem, LoadPath, LoadTime, MarchFailure,
    MarchOptions, Method, Path, Scales, Silent, Solver, Span, StateError, StepFailureKind, StepProblem, StepState,
    SweepOptions, Unknowns, UzawaOptions, Wanted, march, sweep,
};
use slipstick_linalg::{BlockMatrix, BlockPattern, SolverChoice};
use std::sync::Arc;

struct Pressed {
    /// φ.
    stiffness: f64,
    /// ε.
    penalty: f64,
    uzawa: UzawaOptions,
    /// Stages of a growing penalty.
    stages: usize,
    unknowns: Unknowns,
}

impl Pressed {
    fn new(stiffness: f64, penalty: f64, uzawa: UzawaOptions) -> Self {
        let free = [false, true, true, false, true, true];
        let held = [false, true, true, true, true, true];
        let unknowns = Unknowns {
            displacements: 3,
            fixed: [free, held, held].map(Vec::from),
            groups: vec![0, 0],
            designs: 1,
            ..Unknowns::default()
        };
        Self { stiffness, penalty, uzawa, stages: 0, unknowns }
    }

    /// Whether the ground pushes back.
    fn touches(&self, y: &[f64]) -> bool {
        y[3] - self.penalty * y[0] > 0.0
    }

    fn pressure(&self, y: &[f64]) -> f64 {
        (y[3] - self.penalty * y[0]).max(0.0)
    }
}

impl StepProblem for Pressed {
    type Geometry = ();
    /// The time at the end of the step.
    type Step = f64;
    type State = ();
    type Workspace = BlockMatrix;

    fn unknowns(&self) -> &Unknowns {
        &self.unknowns
    }

    fn prescribe(&self, _: LoadTime, _: &mut [f64]) {}

    fn geometry(&self, _: &[f64], _: Wanted, _: &mut BlockMatrix) -> Result<(), StateError> {
        Ok(())
    }

    fn begin(&self, _: &StepState, (): &(), span: Span, _: &mut BlockMatrix) -> Result<f64, StateError> {
        Ok(span.to)
    }

    fn evaluate(
        &self,
        time: &f64,
        y: &[f64],
        _: Option<&()>,
        _: Iteration,
        _: Wanted,
        _: &mut BlockMatrix,
    ) -> Result<Evaluated<Self>, StateError> {
        let pressure = self.pressure(y);
        let force = self.stiffness * (y[0] + time) - pressure;
        Ok(Evaluated {
            unknowns: y.to_vec(),
            residual: vec![force, 0.0, 0.0, y[3] - pressure, 0.0, 0.0],
            scales: Scales { force: 1.0, displacement: 1.0, multiplier: 1.0, position: 1.0, rigidity: 0.0 },
            active_set: vec![if self.touches(y) { ContactStatus::Slip } else { ContactStatus::Inactive }],
            geometry: (),
            state: (),
        })
    }

    fn tangent<'w>(
        &self,
        _: &f64,
        at: &Evaluated<Self>,
        matrix: &'w mut BlockMatrix,
    ) -> Result<&'w BlockMatrix, StateError> {
        // ∂p/∂u and ∂p/∂ζ
        let [by_u, by_multiplier] = if self.touches(&at.unknowns) { [-self.penalty, 1.0] } else { [0.0; 2] };
        let first = |entry: f64| [entry, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        matrix.set_zero();
        matrix.add(0, 0, &first(self.stiffness - by_u));
        matrix.add(0, 1, &first(-by_multiplier));
        matrix.add(1, 0, &first(-by_u));
        matrix.add(1, 1, &first(1.0 - by_multiplier));
        Ok(matrix)
    }

    fn finish(&self, _: &f64, _: &Evaluated<Self>) -> Result<Vec<f64>, StateError> {
        Ok(Vec::new())
    }

    fn pull_back(
        &self,
        _: &Self::Step,
        at: &Evaluated<Self>,
        adjoint: &Adjoint<'_>,
        into: &mut Inputs,
    ) -> Result<(), StateError> {
        for to in &mut into.density {
            *to += adjoint.lambda[0] * (at.residual[0] + self.pressure(&at.unknowns)) / self.stiffness;
        }
        Ok(())
    }

    fn method(&self, attempt: Attempt) -> Option<Method> {
        match attempt {
            Attempt::Setting(0) => Some(Method::Uzawa(self.uzawa)),
            Attempt::Penalty(stage) => (stage < self.stages).then_some(Method::Newton),
            _ => None,
        }
    }

    fn update_multipliers(&self, _: &f64, at: &Evaluated<Self>) -> Result<(Vec<f64>, f64), StateError> {
        let (mut y, pressure) = (at.unknowns.clone(), self.pressure(&at.unknowns));
        let violation = (y[3] - pressure).abs();
        y[3] = pressure;
        Ok((y, violation))
    }
}

/// The path, and dζ/dφ at its end.
fn pressed(problem: &Pressed, times: &[f64]) -> Result<(Path, f64), Box<MarchFailure>> {
    let workspace = &mut BlockMatrix::new(Arc::new(BlockPattern::from_rows(&[vec![0, 1], vec![0, 1]])));
    let mut linear = LinearSystem::new(SolverChoice::Auto);
    let mut solver = Solver { problem, linear: &mut linear, workspace };
    let rest = StepState { unknowns: vec![0.0; 6], history: Vec::new() };
    let options = MarchOptions { max_cutbacks: 0, ..MarchOptions::default() };
    let path = march(&mut solver, &LoadPath::new(rest, times), &options, &mut Silent)?;
    let mut last = UnknownAt { state: path.states.len() - 1, unknown: 3 };
    let gradient = sweep(&mut solver, &path, &mut last, &SweepOptions::default()).unwrap();
    Ok((path, gradient[0].design[0]))
}

const ACCELERATED: UzawaOptions = UzawaOptions { tolerance: 1e-10, max_iterations: 20, memory: 5 };

/// The plain and the accelerated iterations end at u = 0, ζ = φ t even for a soft penalty, and the
/// gradient dζ/dφ = t does not depend on the iteration.
#[test]
fn uzawa_finds_the_multiplier() {
    let plain = UzawaOptions { max_iterations: 80, memory: 0, ..ACCELERATED };
    for (uzawa, penalty) in [(plain, 8.0), (ACCELERATED, 8.0), (ACCELERATED, 0.05)] {
        let (path, gradient) = pressed(&Pressed::new(2.0, penalty, uzawa), &[0.4, 1.0]).unwrap();
        for (at, time) in path.states[1..].iter().zip([0.4, 1.0]) {
            let y = &at.state.unknowns;
            assert!(y[0].abs() < 1e-9 && (y[3] - 2.0 * time).abs() < 1e-9, "{uzawa:?}, {penalty}: {y:?}");
            assert_eq!(at.active_set, [ContactStatus::Slip]);
        }
        assert!((gradient - 1.0).abs() < 1e-9, "{uzawa:?}, {penalty}: {gradient}");
    }
}

/// By hand: with ε = φ/40, each plain iteration leaves 40/41 of the violation, so 20 iterations
/// leave over half of it.
#[test]
fn uzawa_reports_that_it_was_too_slow() {
    let slow = Pressed::new(2.0, 0.05, UzawaOptions { memory: 0, ..ACCELERATED });
    let failure = pressed(&slow, &[1.0]).expect_err("too slow");
    let StepFailureKind::Uzawa { iterations, violation, tolerance } = failure.attempts.last().expect("an attempt").1
    else {
        panic!("{failure}");
    };
    assert_eq!((iterations, tolerance), (20, 1e-10));
    // the first update has the violation φ ε/(φ + ε), here for t = 1
    let expected = 2.0 * 0.05 / 2.05 * (40.0_f64 / 41.0).powi(19);
    assert!((violation - expected).abs() < 1e-9, "{violation} for {expected}");
}

/// Three stages of Newton's method with the multiplier held, and Newton's method for the step's own equations:
/// u = 0, ζ = φ t. With a held multiplier of 0, a stage ends at u = −φ t/(φ + ε).
#[test]
fn a_growing_penalty_ends_at_the_multiplier() {
    let problem = Pressed { stages: 3, ..Pressed::new(2.0, 8.0, ACCELERATED) };
    let workspace = &mut BlockMatrix::new(Arc::new(BlockPattern::from_rows(&[vec![0, 1], vec![0, 1]])));
    let mut linear = LinearSystem::new(SolverChoice::Auto);
    let mut solver = Solver { problem: &problem, linear: &mut linear, workspace };
    let start = || Start::<Pressed> { at_start: true, ..Start::guess(vec![0.0; 6]) };
    let newton = MarchOptions::default().newton;
    let (y, report, _) = solve_increment(&mut solver, &0.7, start(), 0.7.into(), Attempt::Penalty(0), &newton).unwrap();
    assert!(y[0].abs() < 1e-12 && (y[3] - 1.4).abs() < 1e-12, "{y:?}");
    assert!(report.rescued);
    let starts = report.iterations.iter().filter(|record| record.iteration == 1).count();
    assert_eq!(starts, 4, "three stages and the step itself: {:?}", report.iterations);
    // the first increment passes through the ground without touching it, the second comes back
    let moved = report.iterations[0].displacement - report.iterations[1].displacement;
    assert!((moved - 1.4 / 10.0).abs() < 1e-6, "{moved}");
}
