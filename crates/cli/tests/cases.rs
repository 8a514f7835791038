//! Runs short studies of the repository's cases with the program and checks their expected numbers.
//!
//! Each study is copied to its own folder and run there with `--only`; the program itself compares
//! the numbers with `expected.json`, whose entries give the sources of their values. Relations
//! between several runs are checked here.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases")
}

fn program(folder: &Path, words: &[&str]) -> (bool, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_slipstick")).current_dir(folder).args(words).output().expect("it runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.success(), text(&output.stdout) + &text(&output.stderr))
}

/// Runs of a study, and all their numbers.
struct Numbers(BTreeMap<(String, String), f64>);

impl Numbers {
    /// The numbers of some runs, or of all of them.
    fn of(case: &str, runs: &[&str]) -> Self {
        let place: TempDir = tempfile::tempdir().expect("a temporary folder");
        for file in std::fs::read_dir(cases().join(case)).expect("the case").map(|entry| entry.expect("a file").path())
        {
            if file.extension().is_some_and(|extension| ["toml", "json", "inp"].iter().any(|known| extension == *known))
            {
                std::fs::copy(&file, place.path().join(file.file_name().expect("a name"))).expect("copied");
            }
        }
        let only = runs.join(",");
        let words: &[&str] = if runs.is_empty() { &[] } else { &["--only", &only] };
        let (good, text) = program(place.path(), &[&["study", "study.toml"], words].concat());
        assert!(good, "{case}:\n{text}");
        let table = std::fs::read_to_string(place.path().join("study/numbers.csv")).expect("numbers");
        let rows = table.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        // a ratio of missing numbers has an empty cell
        let rows = rows.filter(|row| !row[2].is_empty());
        Self(rows.map(|row| ((row[0].clone(), row[1].clone()), row[2].parse().expect("a number"))).collect())
    }

    fn get(&self, run: &str, quantity: &str) -> f64 {
        let key = (run.to_owned(), quantity.to_owned());
        *self.0.get(&key).unwrap_or_else(|| panic!("no {quantity} of {run}"))
    }

    fn objective(&self, run: &str) -> f64 {
        self.get(run, "objective")
    }
}

/// All of section 5.1 of the paper: values and norms of gradients are those of an independent
/// implementation, and the penalty method approaches the multipliers as its stiffness increases.
#[test]
fn cube_on_cuboid() {
    let found = Numbers::of("cube_on_cuboid", &[]);
    for friction in ["05", "02"] {
        let of = |method: &str| found.objective(&format!("mu_{friction}_{method}"));
        let methods = ["pm100", "pm200", "pm500", "pm1000", "pm2000", "lmm"].map(of);
        assert!(methods.windows(2).all(|pair| pair[1] < pair[0]), "{methods:?}");
    }
}

/// Section 5.2 of the paper on a coarse mesh.
#[test]
fn half_ball_on_plate() {
    let runs = ["start", "start_penalty", "start_augmented", "short_frictionless", "short_friction", "short_gradient"];
    let found = Numbers::of("half_ball_on_plate", &runs);
    let (multipliers, augmented) = (found.objective("start"), found.objective("start_augmented"));
    assert!((augmented / multipliers - 1.0).abs() < 1e-7, "two methods, one solution: {augmented} {multipliers}");
    assert!(found.objective("start_penalty") > multipliers, "penetration takes force away");
    // Friction breaks the symmetry, along x more than along z: the ball travels by (0.5, 0.25).
    let [x, z] = ["asymmetry x", "asymmetry z"].map(|name| found.get("short_friction", name));
    assert!(x > z && z > 1e6 * found.get("short_frictionless", "asymmetry z"), "{x} {z}");
}

/// Section 5.3 of the paper on a coarse mesh: nearly all nodes slip, so the force on the uniform
/// initial design grows nearly like √(1 + μ²); the first column of the paper's Table 1 gives 1.0044
/// and 1.0291.
#[test]
fn ironing() {
    let found = Numbers::of("ironing", &["start_mu_0", "start_mu_01", "start_mu_025", "short_gradient"]);
    for (run, friction) in [("start_mu_01", 0.1), ("start_mu_025", 0.25)] {
        let growth = found.objective(run) / found.objective("start_mu_0");
        let all_slip = f64::sqrt(1.0 + friction * friction);
        assert!(growth > 1.0 && (growth - all_slip).abs() < 0.003, "{run}: {growth} {all_slip}");
    }
}

/// Section 5.4 of the paper on a coarse mesh. The augmented Lagrangian method has the paper's
/// tolerance, 1e-3 absolute; its second-order updates reach far smaller errors.
#[test]
fn clutch() {
    let found = Numbers::of("clutch", &["start", "start_by_multipliers", "short_gradient"]);
    let (multipliers, augmented) = (found.objective("start_by_multipliers"), found.objective("start"));
    assert!((augmented / multipliers - 1.0).abs() < 1e-6, "{augmented} {multipliers}");
}

/// Cases made of quantities: the values at their uniform initial designs.
#[test]
fn initial_designs_of_cases_with_quantities() {
    for case in ["seal", "gripper", "detent", "buffer", "snap"] {
        assert!(Numbers::of(case, &["start"]).objective("start").is_finite());
    }
}

/// Cases of the paper's size have its numbers of load steps and, where published, of elements.
#[test]
fn paper_sizes() {
    let expected = [
        ("half_ball_on_plate", &[("plate", 6561), ("ball", 2900)][..], 50),
        ("ironing", &[("slab", 6912), ("die", 1440)], 50),
        ("clutch", &[("lower", 43_008), ("upper", 46_848)], 100),
    ];
    for (case, bodies, steps) in expected {
        let text = std::fs::read_to_string(cases().join(case).join("case.toml")).expect("a case");
        let resolved = slipstick::case::parse_case(&text, case).unwrap_or_else(|errors| panic!("{errors}"));
        let counts = resolved.case.bodies.iter().map(|body| (body.name.as_str(), body.shape.element_count()));
        let wanted = bodies.iter().map(|&(name, count)| (name, Some(count)));
        assert!(counts.eq(wanted), "{case}");
        assert_eq!(resolved.case.load_path.steps, steps, "{case}");
    }
}

/// All command lines of the studies are valid.
#[test]
fn studies_can_be_planned() {
    let more = [
        ("half_ball_on_plate", "coarse_study.toml"),
        ("half_ball_on_plate", "paper.toml"),
        ("ironing", "unfiltered.toml"),
        ("clutch", "finer.toml"),
    ];
    let studies = ["half_ball_on_plate", "ironing", "clutch"].map(|case| (case, "study.toml"));
    for (case, study) in studies.into_iter().chain(more) {
        let (good, text) = program(&cases().join(case), &["study", study, "--plan"]);
        assert!(good && text.contains("slipstick optimize"), "{case}: {text}");
    }
}
