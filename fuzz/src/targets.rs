//! What is done with the bytes of a file that may hold anything. Each function returns, whatever
//! they are; a panic is a finding. The test `corpus` of the service layer runs them over the corpus.

use std::path::Path;
use std::sync::OnceLock;

use slipstick::build;
use slipstick::case::{CaseErrors, Resolved, case_of_deck, parse_case_with, utf8, with_deck};
use slipstick::check::inspect;
use slipstick::design::Functions;
use slipstick::linalg::Alone;
use slipstick::mesh::Mesh;
use slipstick::meshio::{FileMesh, vtu as vtu_file};
use slipstick::optimize::{Optimization, OptimizationState};
use slipstick::run::{Checkpoint, RunDirectory, StartValuesFile, read_density, sha256};
use slipstick_service::forecast::{bytes_to_build, forecast};
use tempfile::TempDir;

/// The mesh file that every name in a fuzzed case stands for.
const MESH: &[u8] = include_bytes!("../../crates/meshio/tests/data/gmsh_41_ascii.msh");

/// Two blocks of a few elements, the upper one pressed down.
const SMALL: &str = include_str!("../small.toml");

fn read(text: &str) -> Option<Resolved> {
    match parse_case_with(text, "case.toml", &|_| Ok(MESH.to_vec())) {
        Ok(resolved) => Some(resolved),
        Err(errors) => {
            told(&errors);
            None
        }
    }
}

fn told(errors: &CaseErrors) {
    assert!(!errors.diagnostics().is_empty());
    for diagnostic in errors.diagnostics() {
        assert!(!diagnostic.message().is_empty() && diagnostic.line() > 0, "{diagnostic:?}");
        drop(diagnostic.plain());
    }
}

/// Text of a case file: what is read and resolved can be written, and is then the same case.
pub fn case(data: &[u8]) {
    let Some(resolved) = utf8(data.to_vec()).ok().and_then(|text| read(&text)) else { return };
    drop(resolved.require(&["dirichlet", "design", "objective", "optimizer"]));
    assert!(bytes_to_build(&resolved.case) >= 0.0);
    let text = toml::to_string_pretty(&resolved.case).expect("a case can be written");
    let again = parse_case_with(&text, "resolved.toml", &|_| Ok(MESH.to_vec()));
    let again = again.unwrap_or_else(|errors| panic!("{errors}\n{text}"));
    assert_eq!(again.case, resolved.case, "{text}");
}

/// Text of a small case file that is built and inspected.
pub fn model(data: &[u8]) {
    let Some(resolved) = utf8(data.to_vec()).ok().and_then(|text| read(&text)) else { return };
    let elements = resolved.case.bodies.iter().map(|body| body.shape.element_count().unwrap_or(usize::MAX));
    if elements.fold(0, usize::saturating_add) <= 200 {
        built(&resolved);
    }
}

/// A deck of some kilobytes as a case: the tables of one that is not refused can be read, and the model is built and
/// inspected.
pub fn deck(data: &[u8]) {
    if !begins(data, b'*') || data.len() > 32 << 10 {
        return;
    }
    let files = |_: &str| Ok(data.to_vec());
    let with = match with_deck(&case_of_deck("model.inp"), "case.toml", &files, &[]) {
        Ok(with) => with.expect("a case with a deck"),
        Err(errors) => return told(&errors),
    };
    match parse_case_with(&with.text, "case.toml", &files) {
        Ok(resolved) => built(&resolved),
        Err(errors) => told(&errors),
    }
}

fn built(resolved: &Resolved) {
    match build::build(&resolved.case) {
        Ok(mut problem) => {
            let seen = inspect(&resolved.case, &mut problem);
            drop(seen.and_then(|_| forecast(&resolved.case, &mut problem, 1)));
        }
        Err(error) => {
            assert!(!error.message.is_empty() && !error.help.is_empty(), "{error:?}");
            drop(resolved.source_map.error(&error.path, slipstick::case::CaseCode::Mesh, &error.message, &error.help));
        }
    }
}

fn mesh_file(data: &[u8]) {
    let file = match FileMesh::parse(data) {
        Ok(file) => file,
        Err(error) => {
            assert!(!error.place.is_empty() && !error.message.is_empty() && !error.cure.is_empty(), "{error:?}");
            return;
        }
    };
    let parts: Vec<String> = file.parts().take(8).map(str::to_owned).collect();
    for part in parts.iter().map(|part| Some(part.as_str())).chain([None]) {
        for body in [file.body("a", part, 0.5), file.first_order_body("a", part, 0.5)].into_iter().flatten() {
            drop(body.mesh.check());
        }
    }
}

fn begins(data: &[u8], with: u8) -> bool {
    data.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&with)
}

/// Gmsh's `.msh`.
pub fn gmsh(data: &[u8]) {
    if begins(data, b'$') {
        mesh_file(data);
    }
}

/// Abaqus' and CalculiX' `.inp`.
pub fn abaqus(data: &[u8]) {
    if begins(data, b'*') {
        mesh_file(data);
    }
}

/// VTK's `.vtu`, as a mesh and as fields.
pub fn vtu(data: &[u8]) {
    if begins(data, b'<') {
        mesh_file(data);
        drop(vtu_file::read(data));
    }
}

struct Small {
    folder: TempDir,
    run: RunDirectory,
    mesh: Mesh,
}

fn optimization() -> Optimization {
    let resolved = read(SMALL).expect("a case");
    let problem = build::build(&resolved.case).expect("a problem");
    build::optimization(&resolved.case, problem).expect("an optimization")
}

/// The small case's mesh and a folder for files, made once per process.
fn small() -> &'static Small {
    static PLACE: OnceLock<Small> = OnceLock::new();
    PLACE.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let run = RunDirectory::create(&folder.path().join("run"), false).expect("a run");
        Small { run, folder, mesh: optimization().problem.mesh }
    })
}

fn stored(folder: &Path, name: &str, data: &[u8]) -> std::path::PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, data).expect("a file");
    path
}

/// A table of densities.
pub fn density(data: &[u8]) {
    let small = small();
    let path = stored(small.folder.path(), &format!("density_{:?}.csv", std::thread::current().id()), data);
    match read_density(&path, &small.mesh) {
        Ok(density) => {
            assert_eq!(density.len(), small.mesh.elements.len());
            assert!(density.iter().all(|value| (0.0..=1.0).contains(value)));
        }
        Err(error) => assert!(!error.to_string().is_empty() && !error.cure().is_empty()),
    }
}

/// The text of `checkpoint.json`: what is taken up is a state that the optimizer goes on with.
pub fn checkpoint(data: &[u8]) {
    let Ok(found) = serde_json::from_slice::<Checkpoint>(data) else { return };
    // Its files of start values are the other target's.
    if !found.start_values.is_empty() {
        return;
    }
    thread_local!(static AT_START: std::cell::RefCell<Optimization> = optimization().into());
    AT_START.with_borrow_mut(|optimization| {
        let start = optimization.state.clone();
        if found.restore(&small().run, optimization).is_ok() {
            let _ = optimization.finished();
            assert!(optimization.density().iter().all(|value| (0.0..=1.0).contains(value)));
            next_update(&mut optimization.state);
        }
        optimization.state = start;
    });
}

/// One update of the design with made-up derivatives.
fn next_update(state: &mut OptimizationState) {
    let n = state.x.len();
    let slope: Vec<f64> = (0..n).map(|i| (i as f64).sin() - 0.3).collect();
    let volume = vec![vec![1.0 / n as f64; n]];
    let level = [state.x.iter().sum::<f64>() / n as f64 - 0.5];
    let (lower, upper) = (vec![0.0; n], vec![1.0; n]);
    let functions = Functions::new(1.0, &slope, &level, &volume);
    let step = state.optimizer.update(&state.x, [&lower, &upper], &functions, &Alone);
    if let Ok(step) = step {
        assert!(step.x.iter().all(|value| (0.0..=1.0).contains(value)), "{:?}", step.x);
    }
}

/// A file of start values, under its right hash.
pub fn start_values(data: &[u8]) {
    let run = &small().run;
    stored(run.path(), "start_values_0.bin", data);
    let name = serde_json::json!({ "file": "start_values_0.bin", "sha256": sha256(data) });
    let file: StartValuesFile = serde_json::from_value(name).expect("a name");
    slipstick::ranks::threads::on_ranks(2, |rank| drop(file.read(run, &rank)));
    if let Ok(guide) = file.read(run, &Alone) {
        assert!(guide.length() > 0 && data.len() > 4 * guide.length() * guide.times().len());
    }
}
