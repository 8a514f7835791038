//! Reads case files.

use std::io;
use std::path::Path;

use slipstick::case::{
    CaseDiagnostic, CaseErrors, KeywordUse, Ledger, NotUtf8, Override, OverrideError, Resolved, Severity, case_of_deck,
    override_case, parse_case_with, utf8, with_deck,
};
use slipstick::run::{bytes_of, mesh_files};

use crate::failure::Failure;

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

impl Unreadable {
    /// The failure to read the case file at this path.
    pub fn at(self, path: &Path) -> Failure {
        match self {
            Self::Wrong(errors) => errors.into(),
            Self::Encoding(at) => {
                let message = format!("{}:{}:{}: {at}", path.display(), at.line, at.column);
                Failure::input(message, "save the case file as UTF-8")
            }
            Self::Override(error) => Failure::input(error.to_string(), error.cure()),
            Self::Io(error) => {
                let cure = "check the name; `slipstick new half-ball` writes a case to start from";
                Failure::input(format!("cannot read the case file {}: {error}", path.display()), cure)
            }
        }
    }
}

/// Reads a case file, replaces values, and checks it. Places in messages refer to the changed text;
/// the file name in messages says so.
///
/// # Errors
///
/// [`Unreadable`]; as a [`Failure`], all kinds are wrong input.
pub fn case_file(path: &Path, overrides: &[Override]) -> Result<Resolved, Unreadable> {
    case_or_deck(path, overrides, &[])
}

/// As [`case_file`], also for a deck of Abaqus or CalculiX (`.inp`), whose keywords in `ignored` are left
/// out.
///
/// # Errors
///
/// As [`case_file`].
pub fn case_or_deck(path: &Path, overrides: &[Override], ignored: &[String]) -> Result<Resolved, Unreadable> {
    case_of_text(path, text_of(path)?, overrides, ignored)
}

/// As [`case_or_deck`], with this text instead of that of the case file, which may have been edited. A deck is
/// read as it is on disk, since it may consist of several files.
///
/// # Errors
///
/// As [`case_file`].
pub fn edited(path: &Path, text: &str) -> Result<Resolved, Unreadable> {
    let text = if deck_name(path).is_some() { text_of(path)? } else { text.to_owned() };
    case_of_text(path, text, &[], &[])
}

fn case_of_text(
    path: &Path,
    mut text: String,
    overrides: &[Override],
    ignored: &[String],
) -> Result<Resolved, Unreadable> {
    let mut name = path.display().to_string();
    let files = mesh_files(path);
    let deck = with_deck(&text, &name, &files, ignored).map_err(Unreadable::Wrong)?.map(|with| {
        text = with.text;
        with.ledger
    });
    let changed = override_case(&text, &name, overrides).map_err(Unreadable::Override)?;
    if changed != text {
        name += " (with --set)";
    }
    let resolved = parse_case_with(&changed, &name, &files).map_err(Unreadable::Wrong)?;
    Ok(Resolved { deck, ..resolved })
}

/// The text of a case file; for a deck, that of a case which refers to it.
///
/// # Errors
///
/// If the file cannot be read, or is not UTF-8.
pub fn text_of(path: &Path) -> Result<String, Unreadable> {
    match deck_name(path) {
        Some(deck) => std::fs::metadata(path).map(|_| case_of_deck(&deck)).map_err(Unreadable::Io),
        None => utf8(bytes_of(path).map_err(Unreadable::Io)?).map_err(Unreadable::Encoding),
    }
}

/// The name of a deck in its folder; `None` for a case file.
fn deck_name(path: &Path) -> Option<String> {
    path.extension().filter(|extension| extension.eq_ignore_ascii_case("inp"))?;
    Some(path.file_name()?.to_string_lossy().into_owned())
}

/// How the keywords of a deck are treated, for programs.
pub fn keywords(ledger: &Ledger) -> Vec<serde_json::Value> {
    let entry = |entry: &KeywordUse| {
        serde_json::json!({
            "keyword": entry.keyword, "file": entry.file, "line": entry.line, "use": entry.how.word(), "how": entry.how.text(),
        })
    };
    ledger.uses.iter().map(entry).collect()
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
    fn diagnostics_have_place_and_code() {
        let errors = parse_case("titel = 1\n[load_path]\nsteps = 0\n", "c.toml").expect_err("wrong");
        let object = object(errors.diagnostics().last().expect("an error"));
        assert_eq!((&object["line"], &object["column"]), (&3.into(), &9.into()));
        assert_eq!(object["code"], "slipstick::case::steps");
    }

    #[test]
    fn a_missing_file_is_an_error() {
        assert!(matches!(case_file(Path::new("no/such/case.toml"), &[]), Err(Unreadable::Io(_))));
    }
}
