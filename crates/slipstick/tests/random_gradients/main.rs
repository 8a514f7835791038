//! The adjoint gradient of random small contact problems compared with central differences, with
//! the kinks that `slipstick verify gradient` detects. The first few problems run with all tests;
//! all of them with
//!
//!     cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture

mod bodies;
#[path = "../common/mod.rs"]
mod common;
mod connections;
mod curved;
mod fields;
mod maps;
mod problem;
mod supports;
#[path = "../common/table.rs"]
mod table;

use maps::random_map;
use std::collections::BTreeMap;
use std::panic::catch_unwind;
use std::time::Instant;

use bodies::{FIRST_OF_PLASTIC, FIRST_OF_RIGID};
use connections::{FIRST_OF_BOLTS, FIRST_OF_EQUATIONS, FIRST_OF_SPRINGS};
use curved::FIRST_OF_CURVED;
use fields::FIRST_OF_FIELDS;
use problem::{
    FIRST_OF_JOINTS, FIRST_OF_QUADRATIC, FIRST_OF_QUANTITIES, FIRST_OF_SCENARIOS, FIRST_OF_SOFT, RandomProblem,
    random_problem,
};
use rayon::prelude::*;
use slipstick::analysis::AnalysisError;
use slipstick::verify::{
    DirectionCheck, GradientCheck, Quotient, Verdict, VerifyError, VerifyOptions, verify_gradient, verify_variables,
};
use slipstick_path::Silent;
use supports::FIRST_OF_SUPPORTS;

/// Largest relative error of a directional derivative.
const BOUND: f64 = 1e-6;

/// Along a random direction over the whole design and along one element.
const OPTIONS: VerifyOptions =
    VerifyOptions { directions: 1, elements: 1, step: 1e-3, halvings: 5, forward_tolerance: 1e-11, tolerance: BOUND };

/// Problems that take longer than this are reported. \[s\]
const SLOW: f64 = 20.0;

/// Result for one problem.
enum Outcome {
    Checked(GradientCheck),
    /// Its path could not be marched, for this reason.
    Failed(String),
    /// The objective is only round-off, such as the gap of closed contact: its derivatives cannot
    /// be compared.
    Zero,
    /// It panicked.
    Panicked,
}

struct Row {
    seed: u64,
    method: &'static str,
    objective: String,
    text: String,
    outcome: Outcome,
    seconds: f64,
}

/// What a derivative is taken with respect to.
#[derive(Clone, Copy)]
enum With {
    Densities,
    /// The variables of a chain of maps.
    Variables,
}

fn check(seed: u64, with: With) -> Row {
    let clock = Instant::now();
    let RandomProblem { text, method, objective, density, designed, mut problem } = random_problem(seed);
    let run = std::panic::AssertUnwindSafe(|| match with {
        With::Densities => verify_gradient(&mut problem.analysis, &density, &designed, &OPTIONS, &mut Silent),
        With::Variables => {
            let map = random_map(seed, &problem);
            let x = map.variables().mean(&density);
            verify_variables(&mut problem.analysis, &map, &x, &OPTIONS, &mut Silent)
        }
    });
    let outcome = match catch_unwind(run) {
        Ok(Ok(check)) => Outcome::Checked(check),
        Ok(Err(VerifyError::Analysis(AnalysisError::March(failure)))) => {
            let last = failure.attempts.last().map_or("no attempt".into(), |(_, kind)| kind.to_string());
            Outcome::Failed(last)
        }
        Ok(Err(VerifyError::Rounding(_))) => Outcome::Zero,
        Ok(Err(error)) => Outcome::Failed(error.to_string()),
        Err(_) => Outcome::Panicked,
    };
    let seconds = clock.elapsed().as_secs_f64();
    if seconds > SLOW {
        println!("seed {seed} ({method}) takes {seconds:.1} s");
    }
    if let Outcome::Failed(reason) = &outcome {
        println!("seed {seed} ({method}) is not marched: {reason}");
    }
    Row { seed, method, objective, text, outcome, seconds }
}

/// The smallest relative error of a direction among its smooth central differences and, two step
/// lengths at a time, their extrapolation (4 D(h/2) − D(h))/3 to order 4.
fn best(direction: &DirectionCheck) -> Option<f64> {
    let smooth = |q: &&Quotient| q.kink.is_empty() && !q.kinked && !q.cut_back;
    let quotients: Vec<&Quotient> = direction.quotients.iter().filter(smooth).collect();
    let scale = |q: &Quotient| (q.difference - direction.adjoint).abs() / q.relative_error;
    let extrapolated = quotients.windows(2).filter(|q| q[0].step == 2.0 * q[1].step).map(|q| {
        let difference = (4.0 * q[1].difference - q[0].difference) / 3.0;
        (difference - direction.adjoint).abs() / scale(q[0]).max(scale(q[1]))
    });
    quotients.iter().map(|q| q.relative_error).chain(extrapolated).filter(|error| error.is_finite()).reduce(f64::min)
}

/// The verdict on a direction; truncation, which extrapolation removes, does not count.
fn verdict(direction: &DirectionCheck) -> Verdict {
    if best(direction).is_some_and(|error| error <= BOUND) { Verdict::Right } else { direction.verdict }
}

/// Counts of a suite, and its largest error.
#[derive(Default)]
struct Tally {
    problems: usize,
    directions: usize,
    right: usize,
    kinks: usize,
    cut_back: usize,
    round_off: usize,
    off: usize,
    failed: usize,
    worst: f64,
}

impl Tally {
    fn add(&mut self, row: &Row) {
        self.problems += 1;
        if matches!(row.outcome, Outcome::Zero) {
            let directions = OPTIONS.directions + OPTIONS.elements;
            self.directions += directions;
            self.round_off += directions;
            return;
        }
        let Outcome::Checked(check) = &row.outcome else {
            self.failed += 1;
            return;
        };
        self.directions += check.directions.len();
        for direction in &check.directions {
            match verdict(direction) {
                Verdict::Right => {
                    self.right += 1;
                    self.worst = self.worst.max(best(direction).unwrap_or(f64::INFINITY));
                }
                Verdict::Kink => self.kinks += 1,
                Verdict::CutBack => self.cut_back += 1,
                Verdict::NotResolvable => self.round_off += 1,
                Verdict::Off => self.off += 1,
            }
        }
    }

    fn line(&self, name: &str) -> String {
        let Self { problems, directions, right, kinks, cut_back, round_off, off, failed, worst } = self;
        format!(
            "| {name} | {problems} | {failed} | {directions} | {right} | {kinks} | {cut_back} | {round_off} | {off} | {worst:.1e} |"
        )
    }
}

const HEADER: &str = "| | problems | path not completed | directions | right | kink | other cut-backs | below round-off | wrong | largest error |\n\
                      |---|---|---|---|---|---|---|---|---|---|";

/// Checks the problems of these seeds, prints the results, and asserts that no derivative is wrong;
/// returns the table.
fn suite(seeds: std::ops::Range<u64>, with: With) -> String {
    let rows: Vec<Row> = seeds.into_par_iter().map(|seed| check(seed, with)).collect();
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    let mut reasons: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    let mut wrong = Vec::new();
    for row in &rows {
        for name in [row.method, &row.objective, "together"] {
            tallies.entry(name.to_owned()).or_default().add(row);
        }
        match &row.outcome {
            Outcome::Failed(reason) => {
                let kind = reason.split(|c: char| c.is_ascii_digit()).next().unwrap_or_default().trim().to_owned();
                let kind = if kind.is_empty() { "Uzawa, or inverted elements".into() } else { kind };
                reasons.entry(kind).or_default().push(row.seed);
            }
            Outcome::Zero => {}
            Outcome::Panicked => wrong.push(format!("seed {}: panicked\n{}", row.seed, row.text)),
            Outcome::Checked(check) => {
                for direction in check.directions.iter().filter(|direction| verdict(direction) == Verdict::Off) {
                    wrong.push(format!("seed {} ({}): {direction:#?}\n{}", row.seed, row.method, row.text));
                }
            }
        }
    }
    let seconds: Vec<f64> = rows.iter().map(|row| row.seconds).collect();
    println!(
        "{:.0} s of one core; the slowest problem {:.1} s",
        seconds.iter().sum::<f64>(),
        seconds.iter().copied().fold(0.0, f64::max)
    );
    let lines: Vec<String> = tallies.iter().map(|(name, tally)| tally.line(name)).collect();
    let table = format!("{HEADER}\n{}\n", lines.join("\n"));
    println!("{table}");
    reasons.iter().for_each(|(reason, seeds)| println!("{} not marched: {reason}… (seeds {seeds:?})", seeds.len()));
    assert!(wrong.is_empty(), "{} derivatives are wrong\n{}", wrong.len(), wrong.join("\n"));
    let all = &tallies["together"];
    assert!(all.worst <= BOUND, "{:e}", all.worst);
    // A suite that compares little proves little.
    assert!(all.failed * 20 <= all.problems, "{} of {} cannot be marched", all.failed, all.problems);
    assert!(all.right * 10 >= all.directions * 8, "{} of {} directions are compared", all.right, all.directions);
    table
}

#[test]
fn gradients_of_the_first_random_problems() {
    suite(0..18, With::Densities);
    suite(FIRST_OF_QUANTITIES..FIRST_OF_QUANTITIES + 18, With::Densities);
}

/// The same through ties, density filters, projections and overhang filters.
#[test]
fn gradients_with_respect_to_variables_of_the_first_random_problems() {
    suite(18..30, With::Variables);
    suite(FIRST_OF_QUANTITIES + 18..FIRST_OF_QUANTITIES + 30, With::Variables);
}

/// The same of load cases with friction, moduli, motions and positions of their own.
#[test]
fn gradients_of_random_load_cases() {
    suite(FIRST_OF_SCENARIOS + 20..FIRST_OF_SCENARIOS + 26, With::Variables);
}

/// The same of tied surfaces, offsets, largest shear stresses, and pairs that act during a part of
/// the path.
#[test]
fn gradients_of_random_joints() {
    suite(FIRST_OF_JOINTS..FIRST_OF_JOINTS + 16, With::Densities);
}

/// The same with hexahedra of 27 and tetrahedra of ten nodes on one side or both, with respect to
/// densities, for objectives drawn from all quantities.
#[test]
fn gradients_of_random_quadratic_elements() {
    suite(FIRST_OF_QUADRATIC..FIRST_OF_QUADRATIC + 12, With::Densities);
}

/// The same with bodies that yield, with linear and quadratic elements.
#[test]
fn gradients_of_random_plastic_bodies() {
    suite(FIRST_OF_PLASTIC..FIRST_OF_PLASTIC + 16, With::Densities);
}

/// The same with a rigid block, whose rotations are prescribed, free or loaded by a moment.
#[test]
fn gradients_of_random_rigid_bodies() {
    suite(FIRST_OF_RIGID..FIRST_OF_RIGID + 40, With::Densities);
}

/// The same with bodies of all these kinds that have mass, under gravity and in a rotation, and whose temperature
/// changes.
#[test]
fn gradients_of_random_bodies_in_fields() {
    for first in [FIRST_OF_JOINTS, FIRST_OF_QUADRATIC, FIRST_OF_PLASTIC, FIRST_OF_RIGID] {
        suite(first + FIRST_OF_FIELDS..first + FIRST_OF_FIELDS + 8, With::Densities);
    }
}

/// The same with curved surfaces whose facets do not match, and with nodes in two pairs, as at the edge of a
/// block in a corner; normals at edges are averaged or those of the face that is touched.
#[test]
fn gradients_of_random_curved_surfaces_and_corners() {
    suite(FIRST_OF_CURVED..FIRST_OF_CURVED + 20, With::Densities);
}

/// The same with springs to the ground and between the bodies.
#[test]
fn gradients_of_random_springs() {
    suite(FIRST_OF_SPRINGS..FIRST_OF_SPRINGS + 16, With::Densities);
}

/// The same with linear equations among displacements.
#[test]
fn gradients_of_random_equations() {
    suite(FIRST_OF_EQUATIONS..FIRST_OF_EQUATIONS + 16, With::Densities);
}

/// The same with a bolt that pulls one of the bodies.
#[test]
fn gradients_of_random_bolts() {
    suite(FIRST_OF_BOLTS..FIRST_OF_BOLTS + 16, With::Densities);
}

/// The same with supports that begin or end within the load path.
#[test]
fn gradients_of_random_temporary_supports() {
    suite(FIRST_OF_SUPPORTS..FIRST_OF_SUPPORTS + 16, With::Densities);
}

/// The same with pressures that follow an exponential or a table.
#[test]
fn gradients_of_random_soft_contact() {
    suite(FIRST_OF_SOFT..FIRST_OF_SOFT + 16, With::Densities);
}

/// Problems with a kink closer than the smallest step, or small compared to the curvature:
/// one-sided differences agree with the adjoint to second order, central ones do not. They are
/// reported as kinks, not as errors.
#[test]
fn kinks_next_to_the_design_are_no_errors() {
    for seed in [163, 182, 750] {
        let Outcome::Checked(check) = check(seed, With::Densities).outcome else {
            panic!("seed {seed} cannot be marched")
        };
        assert!(check.count(Verdict::Kink) >= 1, "seed {seed}: {check:#?}");
        assert_eq!(check.count(Verdict::Off), 0, "seed {seed}: {check:#?}");
    }
}

#[test]
#[ignore = "takes minutes: cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture"]
fn gradients_of_two_thousand_random_problems() {
    let seeds = chosen_seeds();
    if seeds.end - seeds.start == 1 {
        println!("{}", random_problem(seeds.start).text);
    }
    let table = suite(seeds, With::Densities);
    table::publish("random_gradients", &table);
    publish("0_densities", "two bodies, with respect to densities", &table);
}

#[test]
#[ignore = "takes minutes: cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture"]
fn gradients_with_respect_to_variables_of_two_thousand_random_problems() {
    let table = suite(chosen_seeds(), With::Variables);
    publish(
        "1_variables",
        "the same, with respect to variables that a random chain of maps turns into densities",
        &table,
    );
}

#[test]
#[ignore = "takes minutes: cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture"]
fn gradients_of_two_hundred_random_load_cases() {
    let table = suite(FIRST_OF_SCENARIOS..FIRST_OF_SCENARIOS + 100, With::Densities);
    publish("2_load_cases", "load cases with their own friction, moduli, motions, positions", &table);
    let table = suite(FIRST_OF_SCENARIOS + 100..FIRST_OF_SCENARIOS + 200, With::Variables);
    publish("3_load_cases_variables", "load cases, with respect to such design variables", &table);
}

#[test]
#[ignore = "takes minutes: cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture"]
fn gradients_of_five_hundred_random_joints() {
    let table = suite(FIRST_OF_JOINTS..FIRST_OF_JOINTS + 500, With::Densities);
    publish(
        "4_joints",
        "ties, offsets, limits of the shear stress, pairs that are active for part of the path",
        &table,
    );
}

#[test]
#[ignore = "takes minutes: cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture"]
fn gradients_of_two_hundred_random_problems_with_quadratic_elements() {
    let table = suite(FIRST_OF_QUADRATIC..FIRST_OF_QUADRATIC + 200, With::Densities);
    publish("5_quadratic", "27-node hexahedra and 10-node tetrahedra", &table);
}

#[test]
#[ignore = "takes minutes: cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture"]
fn gradients_of_three_hundred_random_rigid_bodies() {
    let table = suite(FIRST_OF_RIGID..FIRST_OF_RIGID + 300, With::Densities);
    publish("6_rigid", "rigid bodies", &table);
}

#[test]
#[ignore = "takes minutes: cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture"]
fn gradients_of_two_hundred_random_plastic_bodies() {
    let table = suite(FIRST_OF_PLASTIC..FIRST_OF_PLASTIC + 200, With::Densities);
    publish("7_plastic", "plastic bodies", &table);
}

#[test]
#[ignore = "takes minutes: cargo test --release -p slipstick --test random_gradients -- --ignored --nocapture"]
fn gradients_of_two_hundred_random_curved_surfaces_and_corners() {
    let table = suite(FIRST_OF_CURVED..FIRST_OF_CURVED + 200, With::Densities);
    publish("8_curved", "curved surfaces whose facets do not match, and nodes in two pairs", &table);
}

/// Publishes the sums of a suite as a row of the table by kind of problem.
fn publish(file: &str, kind: &str, table: &str) {
    let sums = table.lines().find_map(|line| line.strip_prefix("| together |")).expect("a row of sums");
    table::publish(&format!("random_kind_{file}"), &format!("| {kind} |{sums}\n"));
}

/// All seeds without load cases, or those that environment variables choose.
fn chosen_seeds() -> std::ops::Range<u64> {
    let bound = |name: &str, other: u64| std::env::var(name).map_or(other, |text| text.parse().expect(name));
    bound("SLIPSTICK_RANDOM_FROM", 0)..bound("SLIPSTICK_RANDOM_TO", FIRST_OF_SCENARIOS)
}
