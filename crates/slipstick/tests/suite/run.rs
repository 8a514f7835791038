//! The directory of a run: files are read back, and unsuitable ones are rejected.

use std::fs;

use crate::common::scene::Scene;
use slipstick::analysis::{AnalysisError, Designs};
use slipstick::build::{Problem, optimization};
use slipstick::case::parse_case;
use slipstick::design::ElementValues;
use slipstick::drive::{DriveObserver, Recorder, drive};
use slipstick::output::read_fields;
use slipstick::quantities::Recording;
use slipstick::ranks::Alone;
use slipstick::run::{
    Checkpoint, ExitState, FailureReport, FunctionNames, History, NewtonTable, PathWriter, RunDirectory, RunError,
    RunPart, RunRecord, load_density, load_design, read_density, sha256, write_densities, write_failure, write_path,
};
use slipstick_path::{
    FailedAttempt, LoadTime, MarchEvent, MarchFailure, MarchObserver, Path, Rung, Silent, StateError, StepFailureKind,
};
use tempfile::TempDir;

fn small() -> (String, Problem) {
    let text = Scene { steps: 3, ..Scene::default() }.text();
    let problem = crate::common::problem(&text);
    (text, problem)
}

fn directory() -> (TempDir, RunDirectory) {
    let folder = tempfile::tempdir().unwrap();
    let run = RunDirectory::create(&folder.path().join("run"), false).unwrap();
    (folder, run)
}

/// The examples of FIPS 180-4's test vectors.
#[test]
fn hashes_are_sha256() {
    assert_eq!(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_eq!(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

#[test]
fn a_directory_belongs_to_one_run() {
    let (folder, run) = directory();
    assert!(matches!(RunDirectory::open(run.path()), Err(RunError::NoRun { .. })));
    let of_runs =
        ["run.json", "history.csv", "design_0012.vtu", "path_10000.vtu", "design_0012.pvtu", "design_0012.3.vtu"];
    for name in of_runs.into_iter().chain(["design_x.vtu", "mesh_0001.2.vtu", "notes.txt"]) {
        fs::write(run.file(name), "x").unwrap();
    }
    let error = RunDirectory::create(run.path(), false).unwrap_err();
    assert!(matches!(error, RunError::Locked { .. }), "{error}");
    let error = RunDirectory::create(run.path(), true).unwrap_err();
    assert!(matches!(error, RunError::Locked { .. }), "{error}");
    let error = RunDirectory::take_up(run.path()).unwrap_err();
    assert!(matches!(error, RunError::Locked { .. }), "{error}");
    assert!(RunDirectory::open(run.path()).is_ok(), "to read");
    let path = run.path().to_owned();
    drop(run);
    let error = RunDirectory::create(&path, false).unwrap_err();
    assert!(matches!(error, RunError::Exists { .. }) && error.cure().contains("--force"), "{error}");
    assert!(path.join("history.csv").exists(), "nothing was touched");
    drop(RunDirectory::create(&path, true).unwrap());
    let mut left: Vec<_> = fs::read_dir(&path).unwrap().map(|e| e.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["design_x.vtu", "mesh_0001.2.vtu", "notes.txt", "run.lock"], "only files of a run are removed");
    let error = RunDirectory::create(&folder.path().join("a/b"), false).unwrap_err();
    assert!(error.to_string().contains("there is no directory"), "{error}");
}

#[test]
fn records_are_read_back_with_their_earlier_parts() {
    let (_folder, run) = directory();
    let (text, _) = small();
    let case = parse_case(&text, "c.toml").unwrap().case;
    let mut record = RunRecord::starting(RunPart::starting(vec!["slipstick".into()], 3), &case, "c.toml", &text);
    record.write(&run).unwrap();
    assert_eq!(RunRecord::read(&run).unwrap().latest.exit, ExitState::Running);
    record.end(ExitState::Interrupted, None);
    let record = record.resumed(RunPart::starting(vec!["again".into()], 1));
    record.write(&run).unwrap();
    let found = RunRecord::read(&run).unwrap();
    assert_eq!(found, record);
    assert_eq!((found.earlier[0].exit, found.earlier[0].threads), (ExitState::Interrupted, 3));
    assert_eq!(found.case["load_path"]["steps"], 3);
    fs::write(run.file("run.json"), "{}").unwrap();
    assert!(matches!(RunRecord::read(&run), Err(RunError::Damaged { .. })));
}

/// Densities come back as the same bits, whatever their number of digits.
#[test]
fn densities_are_read_back_bit_for_bit() {
    let (_folder, run) = directory();
    let (_, problem) = small();
    let density: ElementValues = (0..problem.mesh.elements.len()).map(|e| 1.0 / (e as f64 + 3.0)).collect();
    let table = run.file("design.csv");
    write_densities(&table, &problem.mesh, &density, Some(&density), None).unwrap();
    assert_eq!(load_density(run.path(), &problem.mesh).unwrap(), density);
    assert_eq!(read_density(&table, &problem.mesh).unwrap(), density);
    let text = fs::read_to_string(&table).unwrap();
    assert_eq!(text.lines().nth(1), Some("0,slab,0.3333333333333333,0.3333333333333333"));
    assert!(load_design(run.path(), &problem.mesh, &[]).unwrap().variables.is_none());
    let variables: ElementValues = density.iter().map(|phi| phi / 7.0).collect();
    let other = run.file("mapped.csv");
    write_densities(&other, &problem.mesh, &density, None, Some(&variables)).unwrap();
    assert_eq!(load_design(&other, &problem.mesh, &[]).unwrap().variables, Some(variables));
    assert_eq!(load_density(&other, &problem.mesh).unwrap(), density);
    let changed = fs::read_to_string(&other).unwrap().replacen(",0.047619", ",1.047619", 1);
    fs::write(&other, changed).unwrap();
    let error = load_design(&other, &problem.mesh, &[]).unwrap_err().to_string();
    assert!(error.contains("is not a design_variable in [0, 1]"), "{error}");
    let mut bad = density.clone();
    bad[1] = f64::NAN;
    let error = write_densities(&table, &problem.mesh, &density, Some(&bad), None).unwrap_err();
    assert!(error.to_string().contains("`derivative` is NaN at entry 1"), "{error}");
    assert_eq!(fs::read_to_string(&table).unwrap(), text, "the old table is unchanged");
}

/// A checkpoint is the state, number for number; continuing drops the last evaluation only if no
/// update followed it.
#[test]
fn a_checkpoint_is_the_state_bit_for_bit() {
    let (_folder, run) = directory();
    let (text, _) = small();
    let text = text.replace("[design]", "[optimizer]\niterations = 2\n[design]\nvolume_fraction = 0.5");
    let case = parse_case(&text, "c.toml").unwrap().case;
    let mut optimization = optimization(&case, crate::common::problem(&text)).unwrap();
    let mut rows = Vec::new();
    for n in 1..=2 {
        optimization.advance(&mut Silent).unwrap();
        rows.push(10 * n);
    }
    let saved = Checkpoint::new(sha256(&text), 2, rows.clone(), optimization.state.clone());
    saved.write(&run).unwrap();
    let mut found = Checkpoint::read(&run).unwrap();
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&found.state.x), bits(&optimization.state.x));
    assert_eq!(found.state.optimizer, optimization.state.optimizer);
    assert_eq!(found.state.history, optimization.state.history);
    found.reopen();
    assert_eq!((found.state.history.len(), found.newton_rows.len()), (2, 2), "an update has followed each");

    let last = optimization.advance(&mut Silent).unwrap();
    assert!(optimization.finished());
    let evaluated = optimization.evaluated().unwrap();
    assert!(evaluated.gradient.is_none(), "the last design needs no gradient");
    assert_eq!(last.value, optimization.state.history[2].objective);
    rows.push(30);
    let mut found = Checkpoint::new(sha256(&text), 2, rows, optimization.state.clone());
    found.reopen();
    assert_eq!((found.state.history.len(), found.newton_rows.len()), (2, 2), "the last is evaluated again");
    fs::write(run.file("checkpoint.json"), "{\"format\": 1}").unwrap();
    assert!(matches!(Checkpoint::read(&run), Err(RunError::Damaged { .. })));
}

struct Table(NewtonTable);

impl MarchObserver for Table {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        self.0.record(event);
    }
}

#[test]
fn tables_and_fields_of_a_path() {
    let (_folder, run) = directory();
    let (_, mut problem) = small();
    let density = problem.initial_density().clone();
    let mut table = Table(NewtonTable::open(&run, 0).unwrap());
    let forward = problem.analysis.forward(&density, &mut table).unwrap();
    table.0.check().unwrap();
    assert_eq!(table.0.rows(), forward.path.newton_iterations());
    let text = fs::read_to_string(run.file("newton.csv")).unwrap();
    assert_eq!(text.lines().count(), 1 + table.0.rows());
    assert!(text.lines().last().unwrap().starts_with("0,3,1.0,"), "{text}");

    assert_eq!(write_path(Some(&run), &problem, &forward.path).unwrap().rows.len(), 4);
    for step in 0..=3 {
        assert!(run.file(&RunDirectory::numbered("path", step)).exists());
    }
    let mut history = History::open(&run, FunctionNames::default(), &[]).unwrap();
    let record = slipstick::optimize::IterationRecord { objective: -2.5, status: [1, 2, 3], ..Default::default() };
    history.record(&record, 1.23456).unwrap();
    drop(history);
    let text = fs::read_to_string(run.file("history.csv")).unwrap();
    assert_eq!(text.lines().nth(1), Some("0,-2.5,0.0,,,0.0,0.0,0,0,0,1,2,3,0,0,1.235"));
    History::open(&run, FunctionNames::default(), &[]).unwrap();
    assert_eq!(fs::read_to_string(run.file("history.csv")).unwrap().lines().count(), 1, "from row 0 again");
}

/// Files written while the path is computed are those written at its end: with sub-steps, several load cases on
/// one thread and side by side, and a march that fails.
#[test]
fn a_path_can_be_written_while_it_is_computed() {
    let cases = "[[load_case]]\nname = 'one'\n[[load_case]]\nname = 'two'\n";
    let quick =
        Scene { steps: 2, load_path: "max_newton_iterations = 6".into(), more: cases.into(), ..Scene::default() };
    let failing = Scene { motion: "[{ t = 1.0, u = [0, -2.4, 0] }]".into(), steps: 8, ..Scene::default() };
    let threads = |count| rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
    let mut cut_back = false;
    for (scene, count, fails) in [(&quick, 1, false), (&quick, 2, false), (&failing, 1, true)] {
        let (_one, live) = directory();
        let (_other, at_end) = directory();
        let mut problem = crate::common::problem(&scene.text());
        let density = problem.initial_density().clone();
        problem.analysis.set_density(&density);
        let (design, cases) = (problem.analysis.design.clone(), problem.analysis.cases.clone());
        let designs = Designs::new(&design, &cases);
        let steps = problem.analysis.times.len() / cases.count();
        let recording = Recording::new(&problem.mesh, &problem.quantities, designs, steps);
        let mut writer = PathWriter::new(Some(&live), &problem.mesh, designs, recording).live();
        let marched = threads(count).install(|| problem.analysis.forward(&density, &mut writer));
        assert_eq!(marched.is_err(), fails);
        let path = match &marched {
            Ok(forward) => &forward.path,
            Err(error) => &error.march().expect("a failed march").path,
        };
        assert!(path.steps > 1);
        cut_back |= path.increments() > path.steps;
        // before the writer completes them
        let text = |run: &RunDirectory, name: &str| fs::read_to_string(run.file(name)).unwrap();
        let grown = ["contact.csv", "quantities.csv", "path.pvd"].map(|name| text(&live, name));
        let (recording, written) = writer.finish();
        written.unwrap();
        let quantities = write_path(Some(&at_end), &problem, path).unwrap();
        assert_eq!(recording.found().rows, quantities.rows);
        assert_eq!(grown, ["contact.csv", "quantities.csv", "path.pvd"].map(|name| text(&at_end, name)));
        let names = |run: &RunDirectory| {
            let mut names: Vec<_> = fs::read_dir(run.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names
        };
        assert_eq!(names(&live), names(&at_end));
        for name in names(&live) {
            let of = |run: &RunDirectory| fs::read(run.path().join(&name)).unwrap();
            assert!(of(&live) == of(&at_end), "{name:?}");
        }
    }
    assert!(cut_back, "there are sub-steps");
}

/// The load path on the disk when an iteration begins.
struct Snapshots<'a> {
    run: &'a RunDirectory,
    taken: Vec<[Vec<u8>; 3]>,
}

const OF_PATH: [&str; 3] = ["quantities.csv", "contact.csv", "path_0003.vtu"];

impl MarchObserver for Snapshots<'_> {}

impl DriveObserver for Snapshots<'_> {
    fn begins(&mut self, _iteration: usize) {
        self.taken.push(OF_PATH.map(|name| fs::read(self.run.file(name)).unwrap_or_default()));
    }
}

/// With every second design, an optimization writes the path of that design, which is the one that an analysis of
/// the same densities finds; at its end, that of the last.
#[test]
fn an_optimization_writes_its_load_path_meanwhile() {
    let (_folder, run) = directory();
    let (text, mut other) = small();
    let text = text.replace("[design]", "[optimizer]\niterations = 3\n[design]\nvolume_fraction = 0.5");
    let case = parse_case(&text, "c.toml").unwrap().case;
    let mut optimization = optimization(&case, crate::common::problem(&text)).unwrap();
    let initial = optimization.density();
    let checkpoint = Checkpoint::new(sha256(&text), 3, Vec::new(), optimization.state.clone());
    let recorder = Recorder::new(Some(&run), checkpoint, 2, &Alone).unwrap();
    let mut observer = Snapshots { run: &run, taken: Vec::new() };
    // more steps than this path has
    fs::write(run.file("path_0004.vtu"), "of an earlier run").unwrap();
    drive(&mut optimization, Some(recorder), &mut observer).unwrap();
    let taken = observer.taken;
    assert_eq!(taken.len(), 4);
    assert!(taken[0].iter().all(Vec::is_empty));
    let (_other, alone) = directory();
    let forward = other.analysis.forward(&initial, &mut Silent).unwrap();
    write_path(Some(&alone), &other, &forward.path).unwrap();
    let expected = OF_PATH.map(|name| fs::read(alone.file(name)).unwrap());
    assert!(taken[1] == expected, "the path of the initial design");
    assert!(taken[2] == taken[1], "every second design");
    let end = OF_PATH.map(|name| fs::read(run.file(name)).unwrap());
    assert!(taken[3] != taken[2] && end != taken[3]);
    assert!(!run.file("path_0004.vtu").exists());
    // the path of the last design is on the disk
    let density = |name: &str| {
        let fields = read_fields(&run.file(name)).unwrap();
        fields.into_iter().find(|field| field.name == "density").unwrap().values.to_vec()
    };
    assert_eq!(density("path_0003.vtu"), density("design_0003.vtu"));
    assert_ne!(density("design_0003.vtu"), density("design_0002.vtu"));
}

fn failure(problem: &Problem, path: Path, kinds: Vec<StepFailureKind>) -> MarchFailure {
    let mut iterate = path.states[path.states.len() - 1].state.unknowns.clone();
    iterate[3 * (problem.mesh.nodes.len() - 1)] += 0.01;
    let attempts: Vec<_> =
        kinds.into_iter().enumerate().map(|(n, kind)| (0.5f64.powi(n as i32).into(), kind)).collect();
    let tried = |(time, kind): &(LoadTime, StepFailureKind)| FailedAttempt {
        time: *time,
        rung: if time.t < 1.0 { Rung::LastState } else { Rung::Predicted },
        kind: kind.clone(),
        iterations: 10,
    };
    let iterations = path.states.last().map_or(vec![], |state| state.report.iterations.clone());
    MarchFailure {
        step: 3,
        increment: [0.66, 0.7].into(),
        tried: attempts.iter().map(tried).collect(),
        exhausted: false,
        attempts,
        iterate,
        at_start: false,
        iterations,
        failed_iterations: 70,
        path,
    }
}

/// The place in a failure message is the place in the mesh: element 2 of the slab (4 × 1 × 1 unit
/// cubes) has its centroid at (2.5, 0.5, 0.5), and slave node positions are those of the block's
/// lower face.
#[test]
fn failures_name_places_attempts_and_cures() {
    let (_folder, run) = directory();
    let (_, mut problem) = small();
    let density = problem.initial_density().clone();
    let mut path = problem.analysis.forward(&density, &mut Silent).unwrap().path;
    path.states.truncate(3);
    path.steps = 2;
    let slaves = problem.analysis.model().slave_nodes();
    let inverted = StepFailureKind::State(StateError::InvertedElements { elements: vec![2, 4] });
    let slow = StepFailureKind::TooManyIterations { iterations: 25, changing: vec![] };
    let kinds = vec![inverted.clone(), inverted.clone(), slow.clone(), inverted];
    let failed = failure(&problem, path.clone(), kinds);
    let report = FailureReport::of_march(&failed, &problem);
    assert_eq!(report.places[0].to_string(), "element 2 of body `slab` at (2.5000, 0.5000, 0.5000)");
    assert_eq!(report.places[1].body, "block");
    assert_eq!(report.attempts.len(), 3, "two alike in a row are one");
    assert!(report.attempts[0].contains("2 times") && report.attempts[1].contains("25 Newton iterations"));
    assert!(report.cures.iter().any(|cure| cure.contains("max_newton_iterations")), "cures of every reason");
    assert!(report.to_string().contains("cost: 70 Newton iterations in failed attempts"), "{report}");
    assert!(report.to_string().starts_with("load step 3 failed: 2 inverted elements"), "{report}");
    let told = "from a predicted state: 1 attempt, 10 iterations\n      from the last state: 3 attempts, 30 iterations";
    assert!(report.to_string().contains(told), "{report}");

    let cycling = StepFailureKind::Cycling { nodes: vec![1] };
    let report = FailureReport::of_march(&failure(&problem, path.clone(), vec![cycling]), &problem);
    assert_eq!((report.places[0].number, report.places[0].position[1]), (slaves[1], 1.0));
    let index = 3 * (problem.mesh.nodes.len() + 2);
    let lost = AnalysisError::State(StateError::NotFinite { quantity: "the residual".into(), index });
    assert_eq!(FailureReport::new(&lost, &problem).places[0].number, slaves[2]);

    assert!(write_failure(Some(&run), &problem, &failed).unwrap());
    assert!(run.file("failure.vtu").exists() && run.file("path_0002.vtu").exists());
    assert!(!run.file("path_0003.vtu").exists());
    let mut lost = failed;
    lost.iterate[0] = f64::NAN;
    fs::remove_file(run.file("failure.vtu")).unwrap();
    assert!(!write_failure(Some(&run), &problem, &lost).unwrap());
    assert!(!run.file("failure.vtu").exists(), "a state that is no number is not drawn");
}
