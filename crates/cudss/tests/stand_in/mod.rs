//! The stand-in for the CUDA driver and cuDSS, compiled from C.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Compiles the stand-in into `folder`, under the names by which both libraries are found.
pub fn compile(folder: &Path) -> [PathBuf; 2] {
    let [driver, cudss] = ["libcuda.so.1", "libcudss.so.1"].map(|name| folder.join(name));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cudss/tests/stand_in/stand_in.c");
    let compiler = std::env::var("CC").unwrap_or("cc".into());
    let mut command = Command::new(compiler);
    command.args(["-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror", "-o"]).arg(&driver).arg(source).arg("-lm");
    assert!(command.status().unwrap().success());
    // one library with the functions of both
    std::os::unix::fs::symlink(&driver, &cudss).unwrap();
    [driver, cudss]
}
