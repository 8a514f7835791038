//! The program with a stand-in for the GPU and its libraries: designs equal those of the processor,
//! and the error names a missing library.
#![cfg(unix)]

#[path = "../../cudss/tests/stand_in/mod.rs"]
mod stand_in;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const PROGRAM: &str = env!("CARGO_BIN_EXE_slipstick");

/// A block that is pressed onto a slab and dragged along it.
const CASE: &str = r#"
[[body]]
name = "slab"
box = { min = [0.0, 0.0, 0.0], max = [3.0, 1.0, 1.0], elements = [6, 2, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "block"
box = { min = [0.6, 1.0, 0.0], max = [1.7, 1.5, 1.0], elements = [3, 1, 3] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[contact]]
slave = "block_ymin"
master = "slab_ymax"
friction = 0.3
[[dirichlet]]
set = "slab_ymin"
[[dirichlet]]
set = "block_ymax"
motion = [{ t = 0.4, u = [0.0, -0.05, 0.0] }, { t = 1.0, u = [0.3, -0.05, 0.0] }]
[load_path]
steps = 4
[design]
bodies = ["slab"]
volume_fraction = 0.5
[objective]
contact_force = { steps = "all" }
[optimizer]
iterations = 2
"#;

/// Optimizes with a solver for two iterations.
fn optimize(folder: &Path, linear: &str, libraries: &Path) -> Output {
    fs::write(folder.join("case.toml"), CASE).unwrap();
    let set = format!("solver.linear=\"{linear}\"");
    let mut command = Command::new(PROGRAM);
    command.args(["optimize", "case.toml", "--iterations", "2", "--quiet", "--set", &set, "--out", linear]);
    command.env("LD_LIBRARY_PATH", libraries).env("STAND_IN_COUNT", folder.join("count"));
    command.current_dir(folder).output().unwrap()
}

/// Objective, volume and optimality of each design, if they are given.
fn history(folder: &Path) -> Vec<[Option<f64>; 3]> {
    let text = fs::read_to_string(folder.join("history.csv")).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let place = |name: &str| names.iter().position(|other| *other == name).unwrap();
    let places = ["objective", "volume_fraction", "optimality"].map(place);
    let row = |line: &str| {
        let values: Vec<&str> = line.split(',').collect();
        places.map(|place| values[place].parse().ok())
    };
    lines.map(row).collect()
}

#[test]
fn designs_are_those_of_the_processor() {
    let folder = tempfile::tempdir().unwrap();
    stand_in::compile(folder.path());
    let found = ["direct", "cudss"].map(|linear| {
        let output = optimize(folder.path(), linear, folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        history(&folder.path().join(linear))
    });
    assert_eq!((found[0].len(), found[1].len()), (3, 3));
    let [expected, numbers] = found.each_ref().map(|rows| rows.as_flattened());
    for (expected, found) in expected.iter().zip(numbers) {
        match (expected, found) {
            (Some(expected), Some(found)) => assert!((found - expected).abs() <= 1e-8 * expected.abs(), "{found:?}"),
            (expected, found) => assert_eq!(expected, found),
        }
    }
    assert_eq!(expected.iter().flatten().count(), 8, "the last design has no optimality: {expected:?}");
    let factorizations = fs::read_to_string(folder.path().join("count")).unwrap();
    assert!(factorizations.trim().parse::<usize>().unwrap() > 10, "{factorizations}");
}

#[test]
fn a_missing_library_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let output = optimize(folder.path(), "cudss", folder.path());
    let stderr = String::from_utf8_lossy(&output.stderr);
    if output.status.success() || stderr.contains("no NVIDIA GPU") {
        return println!("skipped: the libraries are installed here");
    }
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    for words in ["cannot be loaded", "libcu", "LD_LIBRARY_PATH"] {
        assert!(stderr.contains(words), "{words} is not in: {stderr}");
    }
}
