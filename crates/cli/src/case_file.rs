//! Reads a case file and shows its errors.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use slipstick::case::{
    CaseDiagnostic, CaseErrors, NotUtf8, Override, OverrideError, Resolved, Severity, override_case, parse_case_with,
    utf8,
};
use slipstick::run::mesh_files;

/// Why there is no case.
#[derive(Debug)]
pub enum Unreadable {
    /// The file cannot be read.
    Io(io::Error),
    /// A value to be replaced has no place in the file.
    Override(OverrideError),
    /// The file is not UTF-8 text.
    Encoding(NotUtf8),
    /// The file has errors.
    Wrong(CaseErrors),
}

/// Reads a case file, replaces values, and checks it. Places in messages refer to the changed text;
/// the file name in messages says so.
///
/// # Errors
///
/// [`Unreadable`]; all kinds end the program with exit code 2.
pub fn read(path: &Path, overrides: &[Override]) -> Result<Resolved, Unreadable> {
    let text = utf8(std::fs::read(path).map_err(Unreadable::Io)?).map_err(Unreadable::Encoding)?;
    let mut name = path.display().to_string();
    let changed = override_case(&text, &name, overrides).map_err(Unreadable::Override)?;
    if changed != text {
        name += " (with --set)";
    }
    parse_case_with(&changed, &name, &mesh_files(path)).map_err(Unreadable::Wrong)
}

/// Diagnostics for people: with the lines of the file on a terminal, otherwise
/// `file:line:column: …`.
pub fn report(diagnostics: &[CaseDiagnostic], terminal: bool) -> String {
    let mut text = String::new();
    let handler = miette::GraphicalReportHandler::new();
    for diagnostic in diagnostics {
        if !terminal || handler.render_report(&mut text, diagnostic).is_err() {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}", diagnostic.plain());
        }
    }
    text
}

/// A diagnostic for programs.
pub fn object(diagnostic: &CaseDiagnostic) -> serde_json::Value {
    let severity = match diagnostic.severity() {
        Severity::Error => "error",
        Severity::Warning => "warning",
    };
    serde_json::json!({
        "severity": severity,
        "code": diagnostic.code().as_str(),
        "file": diagnostic.file(),
        "line": diagnostic.line(),
        "column": diagnostic.column(),
        "message": diagnostic.message(),
        "help": diagnostic.help(),
    })
}

#[cfg(test)]
mod tests {
    use slipstick::case::parse_case;

    use super::*;

    #[test]
    fn errors_are_shown_with_place_and_code() {
        let errors = parse_case("titel = 1\n[load_path]\nsteps = 0\n", "c.toml").expect_err("wrong");
        let plain = report(errors.diagnostics(), false);
        assert!(plain.contains("c.toml:1:1: error: unknown key `titel`"), "{plain}");
        assert!(plain.contains("c.toml:3:9: error: `steps`"), "{plain}");
        let shown = report(errors.diagnostics(), true);
        assert!(shown.contains("slipstick::case::steps") && shown.contains("steps = 0"), "{shown}");
        let object = object(errors.diagnostics().last().expect("an error"));
        assert_eq!((&object["line"], &object["column"]), (&3.into(), &9.into()));
        assert_eq!(object["code"], "slipstick::case::steps");
    }

    #[test]
    fn a_missing_file_is_an_error() {
        assert!(matches!(read(Path::new("no/such/case.toml"), &[]), Err(Unreadable::Io(_))));
    }
}
