//! Whole problems on the ranks of PETSc against the default solver alone: objective, gradient, statuses.
//!
//! The test starts itself by `mpirun` on one, two and four ranks; without `mpirun` it says that it is skipped. Every
//! rank computes the reference for itself.

mod common;

use common::scene::{LAGRANGE, Scene, augmented, penalty};
use common::{deviation, random_density, status_path};
use slipstick::analysis::Gradients;
use slipstick::build::{Problem, build, build_on};
use slipstick::case::{Case, parse_case};
use slipstick::machine::Machine;
use slipstick::petsc::Session;
use std::process::{Command, ExitCode};
use std::time::Duration;

const RANKS: &[&str] = &["1", "2", "4"];

fn main() -> ExitCode {
    if std::env::var_os("SLIPSTICK_TEST_RANK").is_some() {
        return rank();
    }
    let program = std::env::current_exe().expect("a path");
    for ranks in RANKS {
        let mut run = Command::new("mpirun");
        run.args(["--oversubscribe", "-n", ranks]).arg(&program);
        run.env("SLIPSTICK_TEST_RANK", "1").env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1");
        run.env("RAYON_NUM_THREADS", "1");
        // OpenMPI refuses the superuser, whom containers have, unless told twice
        run.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
        match run.status() {
            Err(error) => {
                println!("skipped: mpirun cannot be started: {error}");
                return ExitCode::SUCCESS;
            }
            Ok(status) if status.success() => println!("{ranks} ranks: ok"),
            Ok(status) => {
                println!("{ranks} ranks: {status}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}

fn rank() -> ExitCode {
    let session = Session::start().expect("PETSc starts");
    let machine = Machine::of(session.clone());
    objectives_and_gradients_agree(&machine);
    assert!(session.meet(Duration::from_secs(60)));
    ExitCode::SUCCESS
}

/// A block that closes a gap, is pressed on a slab and drawn over its edge: nodes are open, stick and slip.
fn scene(enforcement: &str, shape: &'static str) -> Scene {
    Scene {
        slab: [8, 2, 3],
        block: [3, 2, 3],
        corner: [0.15, 1.05, 0.13],
        enforcement: enforcement.into(),
        shape,
        motion: "[{ t = 0.5, u = [0.02, -0.15, 0] }, { t = 1.0, u = [0.15, -0.13, 0.04] }]".into(),
        drive: String::new(),
        steps: 8,
        observed: "\"all\"",
        more: "[solver]\nlinear = \"petsc\"".into(),
        ..Scene::default()
    }
}

fn objectives_and_gradients_agree(machine: &Machine) {
    for (enforcement, shape) in [
        (LAGRANGE.to_owned(), "standard"),
        (LAGRANGE.to_owned(), "dual"),
        (penalty(5e3), "standard"),
        (augmented(5e3, 1e-11), "standard"),
    ] {
        let text = scene(&enforcement, shape).text();
        let case = parse_case(&text, "proof.toml").unwrap_or_else(|e| panic!("{e}\n{text}")).case;
        let mut alone = case.clone();
        alone.solver.linear = slipstick::case::LinearSolverChoice::Auto;
        let (value, gradients, statuses) = solved(&alone, build(&alone).expect("a problem"));
        let (other, others, same) = solved(&case, build_on(&case, machine).expect("a problem"));
        assert_eq!(statuses, same, "{enforcement}");
        let all: String = statuses.concat();
        assert!(['o', 't', 'l'].iter().all(|status| all.contains(*status)), "{statuses:?}");
        assert!((other - value).abs() <= 1e-9 * value.abs(), "{enforcement}: {other} {value}");
        let error = deviation(&others.density, &gradients.density);
        assert!(error < 1e-9, "{enforcement}: {error:e}");
        for ((name, a), (_, b)) in others.parameters.iter().zip(&gradients.parameters) {
            assert!((a - b).abs() <= 1e-8 * b.abs().max(value.abs() * 1e-3), "{enforcement}, {name:?}: {a} {b}");
        }
    }
}

fn solved(_: &Case, mut problem: Problem) -> (f64, Gradients, Vec<String>) {
    let density = random_density(&problem, 7);
    let forward = common::forward(&mut problem, &density);
    let gradients = problem.analysis.gradients(&forward).unwrap_or_else(|e| panic!("{e}"));
    let statuses = status_path(&mut problem, &forward);
    (forward.value, gradients, statuses)
}
