//! The series of a run open in PyVista unchanged: steps, fields, and values equal to those of the
//! tables; the VTKHDF file has the arrays of the VTU files.
//!
//! On demand, with a Python that has PyVista: `PYTHON=venv/bin/python cargo test --release -p
//! slipstick-cli --features vtkhdf --test pyvista -- --ignored --nocapture`

use std::process::Command;

/// Runs the program on a new case, then a script of `tests/pyvista` on its results.
fn compare(line: &str, script: &str) {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let there = Command::new(&python).args(["-c", "import pyvista"]).output();
    assert!(
        there.is_ok_and(|output| output.status.success()),
        "{python} has no pyvista: pip install pyvista, or name another Python by PYTHON"
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let program = |line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_slipstick"));
        let output = command.current_dir(&folder).args(line.split(' ')).output().expect("the program runs");
        assert!(output.status.success(), "{line}\n{}", String::from_utf8_lossy(&output.stderr));
    };
    program("new half-ball");
    program(line);
    let script = format!("{}/tests/pyvista/{script}", env!("CARGO_MANIFEST_DIR"));
    let output = Command::new(python).arg(script).arg(folder.path().join("half_ball")).output().expect("Python runs");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    println!("{said}");
}

#[test]
#[ignore = "needs Python with pyvista"]
fn series_open_in_pyvista() {
    compare("optimize half_ball.toml --iterations 2 --set load_path.steps=4 --set output.every=1", "series.py");
}

#[cfg(feature = "vtkhdf")]
#[test]
#[ignore = "needs Python with pyvista"]
fn the_temporal_file_has_the_arrays_of_the_series() {
    compare("solve half_ball.toml --set load_path.steps=4 --set output.vtkhdf=true", "vtkhdf.py");
}
