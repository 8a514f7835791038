//! Shared by the tests of the method: small scenes, status tables, finite differences of the whole
//! objective.

#![allow(dead_code)] // each test binary uses only a part

use slipstick::analysis::Forward;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case_with;
use slipstick::design::ElementValues;
use slipstick::model::NodalContact;
use slipstick_contact::ContactStatus;
use slipstick_mesh::Mesh;
use slipstick_path::{Guide, PathState, Silent, StepState};

pub mod abaqus;
pub mod optimization;
pub mod quantities;
pub mod scene;

/// Builds a case from its text.
pub fn problem(text: &str) -> Problem {
    problem_with(text, &[])
}

/// Builds a case whose bodies may be `mesh = { file = 'NAME' }`, with meshes given by name.
pub fn problem_with(text: &str, meshes: &[(&str, Mesh)]) -> Problem {
    let read = |name: &str| {
        let mesh = meshes.iter().find(|mesh| mesh.0 == name).ok_or_else(|| std::io::Error::other("no such mesh"))?;
        Ok(abaqus::abaqus(&mesh.1).into_bytes())
    };
    let resolved = parse_case_with(text, "proof.toml", &read).unwrap_or_else(|e| panic!("{e}\n{text}"));
    build(&resolved.case).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The sequence of a linear congruential generator (Knuth's MMIX constants), in [0, 1): the same on
/// every machine.
pub struct Random(u64);

impl Random {
    /// Starts the sequence at `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03)
    }

    /// The next number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// The next number in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A vector of numbers in [−size, size).
    pub fn vector(&mut self, length: usize, size: f64) -> Vec<f64> {
        (0..length).map(|_| self.within(-size, size)).collect()
    }
}

/// A heterogeneous density in [0.4, 0.9) on the design elements, 1 elsewhere.
pub fn random_density(problem: &Problem, seed: u64) -> ElementValues {
    let mut random = Random::new(seed);
    let designed = designed(problem);
    (0..problem.initial_density().len())
        .map(|e| if designed.contains(&e) { random.within(0.4, 0.9) } else { 1.0 })
        .collect()
}

/// The elements of the design.
pub fn designed(problem: &Problem) -> Vec<usize> {
    match problem.variables() {
        None => Vec::new(),
        Some(v) => {
            let inside = |r: &slipstick_design::Role| *r != slipstick_design::Role::Outside;
            v.roles().iter().enumerate().filter(|(_, r)| inside(r)).map(|(e, _)| e).collect()
        }
    }
}

/// Marches; a failure makes the test fail.
pub fn forward(problem: &mut Problem, density: &ElementValues) -> Forward {
    in_pool(|| problem.analysis.forward(density, &mut Silent)).unwrap_or_else(|e| panic!("{e}"))
}

/// Works on a thread of the pool, which then need not be handed each parallel loop.
pub fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| work())
}

/// Contact results at every accepted state after the start; all ranks must call it.
pub fn contact_path(problem: &mut Problem, forward: &Forward) -> Vec<Vec<NodalContact>> {
    let (path, ranks) = (&forward.path, problem.analysis.linear.ranks());
    let states: Vec<_> = (0..path.states.len()).map(|index| path.state(index, ranks).into_owned()).collect();
    let ends = path.states.iter().skip(1);
    // a load case does not begin at the end of the one before
    let within = states.windows(2).zip(ends).filter(|(_, end)| !end.rest);
    let results = |(w, end): (&[StepState], &PathState)| {
        problem.analysis.design_at(end.time).contact_results(&w[0], &w[1], end.time).unwrap().nodes
    };
    within.map(results).collect()
}

/// Status of every slave node at every accepted state after the start: `O`pen, s`t`ick, s`l`ip, one
/// word per state.
pub fn status_path(problem: &mut Problem, forward: &Forward) -> Vec<String> {
    let letter = |c: &NodalContact| match c.status {
        ContactStatus::Inactive => 'o',
        ContactStatus::Stick => 't',
        ContactStatus::Slip => 'l',
    };
    contact_path(problem, forward).iter().map(|nodes| nodes.iter().map(letter).collect()).collect()
}

/// Euclidean norm.
pub fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// ‖a − b‖/‖b‖.
pub fn deviation(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    norm(&difference) / norm(b)
}

/// The derivative of θ along a random direction of the design, from the gradient and from central differences of order
/// 4 of the whole path, which must not pass a kink.
pub fn along_a_direction(problem: &mut Problem, density: &ElementValues, seed: u64, h: f64) -> (f64, f64) {
    let base = forward(problem, density);
    let gradient = problem.analysis.gradient(&base).unwrap_or_else(|e| panic!("{e}"));
    let direction = Random::new(seed).vector(density.len(), 1.0);
    let mut at = |h: f64| {
        let moved: ElementValues = density.iter().zip(&direction).map(|(d, v)| d + h * v).collect();
        forward(problem, &moved).value
    };
    let expected = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    (gradient.iter().zip(&direction).map(|(g, v)| g * v).sum(), expected)
}

/// Central differences of θ over the whole design, of order 4: `(8 (θ₊₁ − θ₋₁) − (θ₊₂ − θ₋₂))/12h`.
/// `None` if an active set at one of the points differs from `expected`, so that a kink may lie
/// within ±2h. The steps must be those of the base run: use [`fix_steps`] for sub-steps.
pub fn differences(problem: &mut Problem, density: &ElementValues, h: f64, expected: &[String]) -> Option<Vec<f64>> {
    let mut gradient = Vec::new();
    for e in designed(problem) {
        let mut value = |shift: f64| {
            let mut moved = density.clone();
            moved[e] += shift;
            let run = forward(problem, &moved);
            (status_path(problem, &run) == expected).then_some(run.value)
        };
        let (p1, m1, p2, m2) = (value(h)?, value(-h)?, value(2.0 * h)?, value(-2.0 * h)?);
        gradient.push((8.0 * (p1 - m1) - (p2 - m2)) / (12.0 * h));
    }
    Some(gradient)
}

/// A gradient with the result of its comparison.
pub struct GradientCheck {
    /// ‖adjoint − differences‖/‖differences‖ over the whole design, the best of the step sizes.
    pub error: f64,
    /// θ.
    pub value: f64,
    /// Adjoint gradient over the design elements.
    pub adjoint: Vec<f64>,
    /// Statuses of all accepted states.
    pub statuses: Vec<String>,
    /// The base run.
    pub forward: Forward,
}

/// Turns the accepted sub-steps of a run into load steps, still with only the user's last step
/// observed: a perturbed run must neither choose different steps nor cut back.
pub fn fix_steps(problem: &mut Problem, base: &Forward) {
    problem.analysis.times = base.path.states.iter().filter(|s| !s.rest).map(|s| s.time).collect();
    problem.analysis.march.newton.max_iterations = 40;
    problem.analysis.march.max_cutbacks = 0;
}

/// Compares the adjoint gradient with central differences of order 4, step sizes 1e-3 … 1e-4 until
/// one agrees to 1e-8.
///
/// # Panics
/// If active sets change within the smallest step.
pub fn check_gradient(problem: &mut Problem, density: &ElementValues) -> GradientCheck {
    let base = forward(problem, density);
    let statuses = status_path(problem, &base);
    let whole = in_pool(|| problem.analysis.gradient(&base)).unwrap_or_else(|e| panic!("{e}"));
    let adjoint: Vec<f64> = designed(problem).into_iter().map(|e| whole[e]).collect();
    if base.path.states.iter().any(|s| !s.rest && s.completes.is_none()) {
        fix_steps(problem, &base);
    }
    // paths of nearby designs start from the states of this one
    let guide = Guide::of(&base.path, problem.analysis.linear.ranks()).holding_steps();
    let unguided = problem.analysis.guide.replace(guide);
    let mut error = f64::INFINITY;
    for h in [1e-3, 4e-4, 1e-4] {
        if let Some(expected) = differences(problem, density, h, &statuses) {
            error = error.min(deviation(&adjoint, &expected));
        }
        if error < 1e-8 {
            break;
        }
    }
    problem.analysis.guide = unguided;
    assert!(error.is_finite(), "an active set changes within every step size; statuses {statuses:?}");
    GradientCheck { error, value: base.value, adjoint, statuses, forward: base }
}
