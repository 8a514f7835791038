//! Tables of pages such as `docs/measurements/robustness.md`, which scripts such as
//! `docs/measure/robustness/measure.sh`
//! insert there.

use std::path::Path;

/// Prints a table and, if `SLIPSTICK_TABLES` names a folder, also writes it there as `{name}.md`.
pub fn publish(name: &str, table: &str) {
    println!("{table}");
    if let Some(folder) = std::env::var_os("SLIPSTICK_TABLES") {
        let path = Path::new(&folder).join(format!("{name}.md"));
        std::fs::write(&path, table).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
}
