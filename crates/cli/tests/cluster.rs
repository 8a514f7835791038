//! The program on several MPI ranks: the same designs as without MPI, one message for a failure,
//! and the files that are left if a rank is killed. Without `mpirun`, the tests report that they
//! are skipped.

#[path = "../../petsc/tests/mpirun/mod.rs"]
mod mpirun;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use slipstick::linalg::largest_or_nan;
use slipstick::output::read_fields;

const PROGRAM: &str = env!("CARGO_BIN_EXE_slipstick");

/// One half of a block that is pressed onto a slab and dragged along it, and pushed from behind in
/// a second load case.
fn case(directory: &Path, enforcement: &str) -> PathBuf {
    let text = format!(
        r#"
[[body]]
name = "slab"
box = {{ min = [0.0, 0.0, 0.0], max = [6.0, 1.5, 2.0], elements = [12, 3, 4] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[body]]
name = "block"
box = {{ min = [1.0, 1.5, 0.0], max = [2.5, 2.25, 1.75], elements = [4, 2, 4] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[contact]]
slave = "block_ymin"
master = "slab_ymax"
friction = 0.3
enforcement = {enforcement}
[[symmetry]]
normal = "z"
[[load_case]]
name = "drawn"
[[load_case]]
name = "pushed"
weight = 0.5
[[load]]
surface = "block_xmin"
pressure = 20.0
load_case = "pushed"
[[dirichlet]]
set = "slab_ymin"
[[dirichlet]]
set = "block_ymax"
motion = [{{ t = 0.4, u = [0.0, -0.05, 0.0] }}, {{ t = 1.0, u = [0.4, -0.05, 0.0] }}]
[load_path]
steps = 5
tolerance = {{ relative = 1e-12 }}
[design]
bodies = ["slab"]
volume_fraction = 0.5
sensitivity_filter = {{ radius = 0.75 }}
[objective]
contact_force = {{ steps = "all" }}
[optimizer]
iterations = 10
"#
    );
    let path = directory.join("case.toml");
    fs::write(&path, text).expect("a case");
    path
}

/// The program on this many ranks, or without MPI; `None` if there is no `mpirun`.
fn slipstick(ranks: Option<usize>) -> Option<Command> {
    let Some(ranks) = ranks else {
        return Some(Command::new(PROGRAM));
    };
    let mut run = mpirun::mpirun(ranks, Path::new(PROGRAM))?;
    run.args(["--threads", "1"]);
    Some(run)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn succeeded(output: &Output) -> String {
    assert!(output.status.success(), "{}\n{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

/// A column of a table of numbers.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let table = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut lines = table.lines();
    let at = lines.next().and_then(|head| head.split(',').position(|cell| cell == name)).expect("the column");
    lines.map(|line| line.split(',').nth(at).and_then(|cell| cell.parse().ok()).expect("a number")).collect()
}

fn assert_same_run(found: &Path, expected: &Path, bound: f64) {
    let pairs = [
        ("history.csv", "objective"),
        ("design.csv", "density"),
        ("quantities.csv", "reaction_block_ymax_x"),
        ("quantities.csv", "strain_energy"),
        ("quantities.csv", "external_work"),
        ("quantities.csv", "friction_work"),
    ];
    for (file, name) in pairs {
        let (found, expected) = (column(&found.join(file), name), column(&expected.join(file), name));
        assert_eq!(found.len(), expected.len(), "{file}");
        let largest = expected.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        let errors = found.iter().zip(&expected).map(|(f, e)| (f - e).abs() / largest);
        let error = largest_or_nan(errors);
        assert!(error < bound, "{file}: {error:e}");
    }
}

/// An optimization of a block that is lifted off ends on all ranks with one error, and leaves the
/// path; forces of contact pairs equal those without MPI.
#[test]
fn an_optimization_of_rounding_ends_on_all_ranks() {
    let place = tempfile::tempdir().expect("a directory");
    let case = case(place.path(), "{ lagrange = {} }");
    let run = |command: &str, ranks: Option<usize>, motion: &str, out: &str| {
        let mut run = slipstick(ranks)?;
        run.arg(command).arg(&case).arg("--out").arg(place.path().join(out));
        run.args(["--set", &format!("dirichlet[1].motion=[{{ t = 1, u = {motion} }}]")]);
        Some(run.output().expect("the program starts"))
    };
    let Some(output) = run("optimize", Some(2), "[0, 0.05, 0]", "away") else { return };
    let said = text(&output.stderr);
    assert!(!output.status.success(), "{said}");
    assert_eq!(said.matches("there is nothing to optimize: the objective is").count(), 1, "{said}");
    assert!(place.path().join("away/path_0010.vtu").exists(), "{said}");
    succeeded(&run("solve", None, "[0, -0.05, 0]", "alone").expect("no MPI is needed"));
    succeeded(&run("solve", Some(2), "[0, -0.05, 0]", "two").expect("mpirun is there"));
    let forces = |out: &str, name: &str| column(&place.path().join(out).join("contact.csv"), name);
    for name in ["force_x", "force_y", "peak_pressure"] {
        let (alone, two) = (forces("alone", name), forces("two", name));
        let largest = alone.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
        assert!(largest > 1.0 && alone.len() == 1 + 10, "{alone:?}");
        assert!(alone.iter().zip(&two).all(|(a, b)| (a - b).abs() < 1e-8 * largest), "{name}: {alone:?} {two:?}");
    }
}

/// Ten iterations of each method on 1, 2 and 4 ranks, against the default solver without MPI.
#[test]
fn designs_do_not_depend_on_the_ranks() {
    let place = tempfile::tempdir().expect("a directory");
    for (name, enforcement) in
        [("lagrange", "{ lagrange = {} }"), ("penalty", "{ penalty = {} }"), ("augmented", "{ augmented = {} }")]
    {
        let directory = place.path().join(name);
        fs::create_dir(&directory).expect("a directory");
        let case = case(&directory, enforcement);
        let optimize = |ranks: Option<usize>| {
            let out = directory.join(ranks.map_or("alone".into(), |ranks| format!("ranks_{ranks}")));
            let mut run = slipstick(ranks)?;
            run.arg("optimize").arg(&case).arg("--out").arg(&out);
            if ranks == Some(1) {
                run.args(["--set", "solver.linear=petsc"]);
            }
            let told = succeeded(&run.output().expect("the program starts"));
            // only the first rank prints
            assert_eq!(told.matches("volume fraction").count(), 1, "{told}");
            Some(out)
        };
        let alone = optimize(None).expect("no MPI is needed");
        for ranks in [1, 2, 4] {
            let Some(out) = optimize(Some(ranks)) else { return };
            assert_same_run(&out, &alone, 1e-9);
        }
    }
}

/// A failure of only the first rank, and one of the analysis: one message, and the exit code of a
/// run without MPI.
#[test]
fn failures_are_told_once() {
    let place = tempfile::tempdir().expect("a directory");
    let case = case(place.path(), "{ lagrange = {} }");
    let out = place.path().join("out");
    let run = |arguments: &[&str]| {
        let mut run = slipstick(Some(2))?;
        run.args(arguments).arg(&case).arg("--out").arg(&out);
        Some(run.output().expect("the program starts"))
    };
    let Some(output) = run(&["solve", "--set", "load_path.max_newton_iterations=1"]) else { return };
    let told = text(&output.stderr);
    assert_eq!(told.matches("error: ").count(), 1, "{told}");
    assert_eq!(output.status.code(), Some(3), "{told}");
    // a march that fails later: the states that converged before are written, and equal those of
    // one rank
    let (late, alone) = (place.path().join("late"), place.path().join("alone"));
    let driven = "dirichlet[1].motion=[{ t = 0.4, u = [0, -0.05, 0] }, { t = 1, u = [0, -4, 0] }]";
    for (ranks, out) in [(None, &alone), (Some(2), &late)] {
        let mut run = slipstick(ranks).expect("mpirun is there");
        run.args(["solve", "--set", driven, "--set", "load_path.steps=10", "--set", "load_path.max_cutbacks=0"]);
        let output = run.arg(&case).arg("--out").arg(out).output().expect("the program starts");
        let told = text(&output.stderr);
        assert_eq!((told.matches("error: ").count(), output.status.code()), (1, Some(3)), "{told}");
    }
    for step in 0..=4 {
        let [found, expected] = [&late, &alone].map(|out| {
            let fields = read_fields(&out.join(format!("path_{step:04}.vtu"))).expect("a state that converged");
            fields.into_iter().find(|field| field.name == "displacement").expect("the field").values
        });
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(&expected).all(|(f, e)| (f - e).abs() < 1e-9), "step {step}");
    }
    // the directory now contains a run
    let begin = Instant::now();
    let output = run(&["solve"]).expect("mpirun is there");
    let told = text(&output.stderr);
    assert_eq!((told.matches("error: ").count(), output.status.code()), (1, Some(2)), "{told}");
    assert!(begin.elapsed() < Duration::from_secs(60));
    let output = run(&["evaluate", "--design", "nowhere"]).expect("mpirun is there");
    assert!(text(&output.stderr).contains("runs on one rank"), "{}", text(&output.stderr));
}

/// A measurement on two ranks: their parts add up to the whole, and the memory that `check`
/// predicts has the right magnitude.
#[test]
fn ranks_tell_their_parts() {
    let place = tempfile::tempdir().expect("a directory");
    let case = case(place.path(), "{ lagrange = {} }");
    let Some(mut run) = slipstick(Some(2)) else { return };
    let told = succeeded(&run.arg("bench").arg(&case).args(["--steps", "2", "--json"]).output().expect("it starts"));
    let ranks: Vec<serde_json::Value> = told
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .filter(|event: &serde_json::Value| event["event"] == "measurement")
        .collect();
    assert_eq!(ranks.len(), 2, "{told}");
    let sum = |key: &str| ranks.iter().map(|rank| rank[key].as_u64().expect("a number")).sum::<u64>();
    // 12 x 3 x 4 and 4 x 2 x 4 elements, and the 5 x 5 nodes of the block's underside
    assert_eq!((sum("elements_here"), sum("slave_nodes_here")), (144 + 32, 25));
    for rank in &ranks {
        // the partition cuts through the contact
        assert!(rank["slave_nodes_here"].as_u64() > Some(0), "{rank}");
        assert!(rank["operations"].as_f64() > Some(0.0) && rank["factor_bytes"].as_f64() > Some(0.0), "{rank}");
        // a single residual is already a vector of this many unknowns
        let least = 8.0 * rank["unknowns"].as_f64().expect("a number");
        assert!(rank["forward"]["bytes_sent"].as_f64() > Some(least), "{rank}");
    }
    let check = Command::new(PROGRAM).arg("check").arg(&case).args(["--ranks", "2", "--json"]).output();
    let foreseen: serde_json::Value = serde_json::from_str(&succeeded(&check.expect("it starts"))).expect("JSON");
    let each = foreseen["bytes_on_ranks"]["each"].as_f64().expect("a number");
    let peaks: Vec<f64> = ranks.iter().map(|rank| rank["peak_bytes"].as_f64().expect("a number")).collect();
    // the libraries dominate the memory of such a small run: the prediction has the same magnitude
    assert!(peaks.iter().all(|peak| (0.4..2.5).contains(&(peak / each))), "{peaks:?} {foreseen}");
}

/// With the contact-zone preconditioner, `check` predicts less memory than with factors of the whole
/// matrix; the prediction is within a quarter of the measured peak, on one rank and on two, although
/// the run may keep factors: those of the preconditioner are of no use later.
#[test]
fn the_memory_of_a_contact_zone_is_predicted() {
    let place = tempfile::tempdir().expect("a directory");
    let case = case(place.path(), "{ lagrange = {} }");
    let text = fs::read_to_string(&case).expect("a case").replace("[12, 3, 4]", "[48, 12, 16]");
    let text = text.replace("[4, 2, 4]", "[16, 6, 16]").replace("radius = 0.75", "radius = 0.2");
    // load cases would be computed at the same time
    let loads = text.find("[[load_case]]").zip(text.find("[[dirichlet]]"));
    let (from, to) = loads.expect("load cases before the motions");
    let text = text[..from].to_owned() + &text[to..];
    let write = |method: &str| {
        let solver = format!("[solver]\nlinear = \"petsc\"\npetsc_preconditioner = \"{method}\"\n");
        fs::write(&case, text.clone() + &solver).expect("a case");
    };
    let check = || {
        let check = Command::new(PROGRAM).arg("check").arg(&case).args(["--ranks", "2", "--json"]).output();
        serde_json::from_str::<serde_json::Value>(&succeeded(&check.expect("it starts"))).expect("JSON")
    };
    write("direct");
    let direct = check();
    write("contact_zone");
    let zone = check();
    let alone = |told: &serde_json::Value| told["inspection"]["peak_bytes"].as_f64().expect("a number");
    assert!(alone(&zone) < 0.8 * alone(&direct), "{} of {}", alone(&zone), alone(&direct));
    assert_eq!(zone["inspection"]["kept_bytes"].as_f64(), Some(0.0), "{zone}");
    let each = zone["bytes_on_ranks"]["each"].as_f64().expect("a number");
    for (ranks, predicted) in [(1, alone(&zone)), (2, each)] {
        let Some(mut run) = slipstick(Some(ranks)) else { return };
        let told = run.arg("bench").arg(&case).args(["--steps", "1", "--json"]).output().expect("it starts");
        let peaks = succeeded(&told)
            .lines()
            .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
            .filter(|event| event["event"] == "measurement")
            .filter_map(|event| event["peak_bytes"].as_f64())
            .collect::<Vec<f64>>();
        assert_eq!(peaks.len(), ranks);
        assert!(peaks.iter().all(|peak| (0.75..1.25).contains(&(peak / predicted))), "{peaks:?}, {predicted}");
    }
}

/// The meshes of a run in pieces: each rank's elements, with the fields of the whole mesh, which
/// equal those of one rank at each load step; a later run in the same directory removes them.
#[test]
fn meshes_are_written_in_pieces() {
    let place = tempfile::tempdir().expect("a directory");
    let case = case(place.path(), "{ lagrange = {} }");
    let out = place.path().join("out");
    let solve = |ranks: Option<usize>, pieces: &str| {
        let mut run = slipstick(ranks)?;
        run.args(["solve", "--set", pieces, "--force"]);
        succeeded(&run.arg(&case).arg("--out").arg(&out).output().expect("the program starts"));
        Some(())
    };
    let mut alone: Option<Vec<Vec<f64>>> = None;
    for ranks in [None, Some(2)] {
        if solve(ranks, "output.pieces=true").is_none() {
            return;
        }
        let field = |file: &str, name: &str| {
            let fields = read_fields(&out.join(file)).expect("a mesh");
            fields.into_iter().find(|field| field.name == name).expect("the field").values
        };
        let steps: Vec<Vec<f64>> = (0..=10).map(|step| field(&format!("path_{step:04}.vtu"), "displacement")).collect();
        for (found, expected) in steps.iter().zip(alone.get_or_insert_with(|| steps.clone())) {
            assert_eq!(found.len(), expected.len());
            assert!(
                found.iter().zip(expected).all(|(f, e)| (*f - *e).abs() < 1e-9),
                "another state on {ranks:?} ranks"
            );
        }
        let (whole, density) = (field("path_0005.vtu", "displacement"), field("path_0005.vtu", "density"));
        let mut seen = Vec::new();
        for rank in 0..ranks.unwrap_or(1) {
            let piece = format!("path_0005.{rank}.vtu");
            for (number, displacement) in
                field(&piece, "node").iter().zip(field(&piece, "displacement").as_chunks::<3>().0)
            {
                assert_eq!(displacement, &whole[3 * *number as usize..][..3]);
            }
            let elements = field(&piece, "element");
            for (number, found) in elements.iter().zip(field(&piece, "density")) {
                assert_eq!(found, density[*number as usize]);
            }
            seen.extend(elements);
        }
        seen.sort_by(f64::total_cmp);
        assert!(seen.iter().copied().eq((0..12 * 3 * 4 + 4 * 2 * 4).map(f64::from)), "each element is in one piece");
        let named = fs::read_to_string(out.join("path.pvd")).expect("a series");
        assert!(named.contains("\"path_0005.pvtu\"") && !named.contains("_0005.vtu"), "{named}");
    }
    solve(None, "output.pieces=false").expect("no MPI is needed");
    let left = fs::read_dir(&out).expect("the run").filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let pieces = left.filter(|name| name.ends_with(".pvtu") || name.ends_with(".0.vtu") || name.ends_with(".1.vtu"));
    assert_eq!(pieces.count(), 0);
}

/// Waits until the table of an optimization contains this many iterations.
fn wait_for_iterations(count: usize, out: &Path, running: &mut Child) {
    let begin = Instant::now();
    while fs::read_to_string(out.join("history.csv")).map_or(0, |table| table.lines().count()) <= count {
        assert!(begin.elapsed() < Duration::from_secs(300) && running.try_wait().expect("a state").is_none());
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The child processes of a process.
fn children(process: u32) -> Vec<u32> {
    let parent = |id: u32| {
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        stat.rsplit(')').next()?.split_whitespace().nth(1)?.parse::<u32>().ok()
    };
    let all = fs::read_dir("/proc").expect("Linux").filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    all.filter(|&id| parent(id) == Some(process)).collect()
}

/// In the middle of an optimization, the first rank can no longer write: it reports this, and all
/// ranks end.
#[test]
fn a_file_that_cannot_be_written_ends_all_ranks() {
    let place = tempfile::tempdir().expect("a directory");
    let case = case(place.path(), "{ lagrange = {} }");
    let out = place.path().join("out");
    let Some(mut run) = slipstick(Some(2)) else { return };
    run.arg("optimize").arg(&case).args(["--iterations", "60"]).arg("--out").arg(&out);
    let mut running = run.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("the program starts");
    wait_for_iterations(2, &out, &mut running);
    // no file can replace a directory
    let table = out.join("design.csv");
    while !table.is_dir() {
        let _ = fs::remove_file(&table).and_then(|()| fs::create_dir(&table));
    }
    let blocked = Instant::now();
    while running.try_wait().expect("a state").is_none() {
        if blocked.elapsed() > Duration::from_secs(90) {
            children(running.id()).iter().for_each(|rank| {
                let _ = Command::new("kill").args(["-KILL", &rank.to_string()]).status();
            });
            panic!("the ranks wait for ever");
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let output = running.wait_with_output().expect("an end");
    let told = text(&output.stderr);
    assert!(!output.status.success() && told.matches("error: ").count() == 1 && told.contains("design.csv"), "{told}");
}

/// All ranks are asked to terminate, as by a batch system: they end, finished iterations are kept,
/// and a different number of ranks continues.
#[test]
fn a_run_that_is_told_to_end_is_resumed_on_other_ranks() {
    let place = tempfile::tempdir().expect("a directory");
    let case = case(place.path(), "{ augmented = {} }");
    let (out, whole) = (place.path().join("out"), place.path().join("whole"));
    let Some(mut run) = slipstick(Some(2)) else { return };
    run.arg("optimize").arg(&case).args(["--iterations", "6"]).arg("--out").arg(&out);
    let mut running = run.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("the program starts");
    wait_for_iterations(2, &out, &mut running);
    for rank in children(running.id()) {
        assert!(Command::new("kill").args(["-TERM", &rank.to_string()]).status().expect("kill").success());
    }
    let output = running.wait_with_output().expect("an end");
    let told = text(&output.stderr);
    assert!(output.status.code() == Some(4) && told.contains("finished iterations are kept"), "{told}");
    let mut resume = slipstick(Some(3)).expect("mpirun is there");
    succeeded(&resume.arg("resume").arg(&out).output().expect("the program starts"));
    let mut undisturbed = Command::new(PROGRAM);
    undisturbed.arg("optimize").arg(&case).args(["--iterations", "6"]).arg("--out").arg(&whole);
    succeeded(&undisturbed.output().expect("the program starts"));
    assert_same_run(&out, &whole, 1e-9);
}

/// A rank is killed during the run: the run ends soon and says why; a single rank continues and
/// reaches the design of an uninterrupted run.
#[test]
fn a_killed_rank_ends_the_run_and_another_number_goes_on() {
    let place = tempfile::tempdir().expect("a directory");
    let case = case(place.path(), "{ lagrange = {} }");
    let (out, whole) = (place.path().join("out"), place.path().join("whole"));
    let Some(mut run) = slipstick(Some(2)) else { return };
    run.arg("optimize").arg(&case).arg("--out").arg(&out);
    let mut running = run.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("the program starts");
    wait_for_iterations(3, &out, &mut running);
    let ranks = children(running.id());
    assert_eq!(ranks.len(), 2, "{ranks:?}");
    let last = ranks.iter().max().expect("two").to_string();
    assert!(Command::new("kill").args(["-KILL", &last]).status().expect("kill").success());
    let killed = Instant::now();
    let output = running.wait_with_output().expect("an end");
    assert!(killed.elapsed() < Duration::from_secs(60), "{:?}", killed.elapsed());
    assert!(!output.status.success() && text(&output.stderr).contains("signal 9"), "{}", text(&output.stderr));
    let mut resume = Command::new(PROGRAM);
    succeeded(&resume.arg("resume").arg(&out).output().expect("the program starts"));
    let mut undisturbed = Command::new(PROGRAM);
    succeeded(&undisturbed.arg("optimize").arg(&case).arg("--out").arg(&whole).output().expect("the program starts"));
    assert_same_run(&out, &whole, 1e-9);
}
