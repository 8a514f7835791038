//! The series of a run open in PyVista unchanged: steps, fields, and values equal to those of the
//! tables.
//!
//! On demand, with a Python that has PyVista: `PYTHON=venv/bin/python cargo test --release -p
//! slipstick-cli --test pyvista -- --ignored --nocapture`

use std::process::Command;

#[test]
#[ignore = "needs Python with pyvista"]
fn series_open_in_pyvista() {
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
    program("optimize half_ball.toml --iterations 2 --set load_path.steps=4 --set output.every=1");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/pyvista/series.py");
    let output = Command::new(python).arg(script).arg(folder.path().join("half_ball")).output().expect("Python runs");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    println!("{said}");
}
