//! The tests of the Python package, with the Python that is here.
//!
//! Builds the extension, lays it beside the package's Python files and runs pytest. Set
//! `SLIPSTICK_PYTHON` to choose another Python than `python3`. What the tests need beyond numpy and
//! pytest is optional; pytest says what it skips.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
fn the_python_package() {
    let python = std::env::var("SLIPSTICK_PYTHON").unwrap_or_else(|_| "python3".into());
    let needs = "import sys, numpy, pytest; sys.exit(sys.version_info < (3, 10))";
    if !Command::new(&python).args(["-c", needs]).output().is_ok_and(|ran| ran.status.success()) {
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED the_python_package: {python} is not Python 3.10 or later with numpy and pytest"
        );
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let target = target();
    let built = Command::new(env!("CARGO"))
        // the whole workspace, so that what the tests have built is used again
        .args(["build", "--release", "--workspace", "--features", "slipstick-wheel/python", "--target-dir"])
        .arg(&target)
        .current_dir(root)
        .status();
    assert!(built.expect("cargo").success(), "the extension builds");
    let place = tempfile::tempdir().expect("a folder");
    let package = place.path().join("slipstick");
    copy(&root.join("python/slipstick"), &package);
    let names = ["lib_slipstick.so", "lib_slipstick.dylib", "_slipstick.dll"];
    let library = names.map(|name| target.join("release").join(name)).into_iter().find(|library| library.exists());
    let name = if cfg!(windows) { "_slipstick.pyd" } else { "_slipstick.abi3.so" };
    std::fs::copy(library.expect("the extension"), package.join(name)).expect("copied");
    let ran = Command::new(&python)
        .args(["-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", "tests"])
        .env("PYTHONPATH", place.path())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .current_dir(root)
        .status();
    assert!(ran.expect("pytest").success(), "pytest fails");
}

/// The folder in which cargo has built this test.
fn target() -> PathBuf {
    let test = std::env::current_exe().expect("a path");
    // target/release/deps/suite-…
    test.ancestors().nth(3).expect("three folders").to_owned()
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry").path();
        let name = entry.file_name().expect("a name");
        if name == "__pycache__" || entry.extension().is_some_and(|end| end == "so" || end == "pyd") {
            continue;
        }
        match entry.is_dir() {
            true => copy(&entry, &to.join(name)),
            false => drop(std::fs::copy(&entry, to.join(name)).expect("copied")),
        }
    }
}
