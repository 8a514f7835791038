//! Replays the corpus of the fuzz targets (`fuzz/`) without a fuzzer: none of its files may make a
//! reader panic or hang. Inputs that a fuzzer finds are added to the corpus when the error is
//! fixed.

#[path = "../../../fuzz/src/targets.rs"]
mod targets;

use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// All files in some folders, relative to the repository's root; entries may also be single files.
fn files(of: &[&str]) -> Vec<PathBuf> {
    let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let mut all: Vec<PathBuf> = Vec::new();
    for folder in of {
        let entries = fs::read_dir(root.join(folder)).unwrap_or_else(|error| panic!("{folder}: {error}"));
        all.extend(entries.map(|entry| entry.expect("an entry").path()).filter(|path| path.is_file()));
    }
    all.sort_unstable();
    all
}

/// Runs a target over folders with at least `least` files.
fn replay(target: fn(&[u8]), folders: &[&str], least: usize) {
    let files = files(folders);
    assert!(files.len() >= least, "{} files in {folders:?}", files.len());
    for path in files {
        let bytes = fs::read(&path).expect("readable");
        let clock = Instant::now();
        target(&bytes);
        assert!(clock.elapsed() < Duration::from_secs(5), "{} takes {:?}", path.display(), clock.elapsed());
    }
}

const MESHES: &str = "crates/meshio/tests/data";
const TEMPLATES: &str = "crates/case/src/file/templates";

#[test]
fn case_files() {
    replay(targets::case, &["fuzz/corpus/case", "fuzz/corpus/model", TEMPLATES, "cases/ironing"], 20);
}

#[test]
fn models() {
    replay(targets::model, &["fuzz/corpus/model", TEMPLATES], 20);
}

#[test]
fn mesh_files() {
    replay(targets::gmsh, &["fuzz/corpus/gmsh", MESHES], 20);
    replay(targets::abaqus, &["fuzz/corpus/abaqus", MESHES], 20);
    replay(targets::vtu, &["fuzz/corpus/vtu", MESHES], 20);
}

#[test]
fn decks() {
    replay(targets::deck, &["fuzz/corpus/deck", "cases/links"], 7);
}

#[test]
fn files_of_runs() {
    replay(targets::density, &["fuzz/corpus/density"], 10);
    replay(targets::checkpoint, &["fuzz/corpus/checkpoint"], 10);
    replay(targets::start_values, &["fuzz/corpus/start_values"], 4);
}
