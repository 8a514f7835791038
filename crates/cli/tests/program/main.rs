//! The real program on tiny cases, end to end.

#[path = "../../../slipstick/tests/common/abaqus.rs"]
mod abaqus;
mod bad_input;
mod bench;
mod browser;
mod commands;
mod curve;
mod deck_out;
mod deck_path;
mod designs;
mod export;
#[cfg(unix)]
mod faults;
#[cfg(unix)]
mod killed;
mod manners;
#[cfg(target_os = "linux")]
mod memory;
mod meshes;
#[cfg(unix)]
mod messages;
mod quantities;
mod render;
mod report;
mod resume;
mod solids;
mod step;
mod stop;
mod study;
#[path = "../../../slipstick/tests/common/table.rs"]
mod table;
mod ties;
mod ui;
mod warnings;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

/// A block of 2 × 1 × 2 elements pressed onto a slab of 4 × 2 × 2 elements and dragged over it; 20
/// elements, 16 of them designed.
const CASE: &str = r#"title = "Block on slab"
[[body]]
name = "slab"
box = { min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "block"
box = { min = [0.6, 1.0, 0.3], max = [2.0, 1.7, 1.6], elements = [2, 1, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[contact]]
slave = "block_ymin"
master = "slab_ymax"
friction = 0.3
[[dirichlet]]
set = "slab_ymin"
[[dirichlet]]
set = "block_ymax"
motion = [{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.2, -0.1, 0.05] }]
[load_path]
steps = 4
tolerance = { relative = 1e-11 }
[design]
bodies = ["slab"]
initial = 0.5
volume_fraction = 0.5
simp = { p = 3.0, min = 1e-3 }
sensitivity_filter = { radius = 1.2 }
[objective]
contact_force = { steps = "last" }
[optimizer]
iterations = 4
[output]
every = 2
"#;

/// A folder with the case, and the program to run in it.
struct Place {
    folder: TempDir,
}

impl Place {
    fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        place.write("case.toml", CASE);
        place
    }

    /// With a change of the case, which must contain `from`.
    fn with(from: &str, to: &str) -> Self {
        let place = Self::new();
        assert!(CASE.contains(from), "{from}");
        place.write("case.toml", &CASE.replace(from, to));
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).expect("JSON")
    }

    /// Rows of a CSV table as lists of cells, header first.
    fn table(&self, name: &str) -> Vec<Vec<String>> {
        self.read(name).lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    }

    fn command(&self, line: &str) -> Command {
        command(self.folder.path(), line)
    }

    fn run(&self, line: &str) -> Ran {
        Ran::new(line, self.command(line).output().expect("the program runs"))
    }

    /// Runs a command that must succeed.
    fn good(&self, line: &str) -> Ran {
        let ran = self.run(line);
        assert_eq!(ran.code, Some(0), "{line}\n{}\n{}", ran.out, ran.err);
        ran
    }

    /// Runs a command that must end with `code` and print all of `expected` to standard error.
    fn bad(&self, line: &str, code: i32, expected: &[&str]) -> Ran {
        let ran = self.run(line);
        assert_eq!(ran.code, Some(code), "{line}\n{}\n{}", ran.out, ran.err);
        for part in expected {
            assert!(ran.err.contains(part), "{line}: no `{part}` in\n{}", ran.err);
        }
        ran
    }
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipstick"));
    command.current_dir(folder).args(line.split_whitespace());
    command
}

/// The output of a command.
struct Ran {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Ran {
    fn new(line: &str, output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap_or_else(|error| panic!("{line}: {error}"));
        Self { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }

    /// Standard output as one JSON object per line.
    fn events(&self) -> Vec<Value> {
        self.out.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
    }

    /// The last event of this name.
    fn event(&self, name: &str) -> Value {
        let found = self.events().into_iter().rfind(|event| event["event"] == name);
        found.unwrap_or_else(|| panic!("no event {name} in\n{}", self.out))
    }
}

fn number(cell: &str) -> f64 {
    cell.parse().unwrap_or_else(|_| panic!("`{cell}` is no number"))
}
