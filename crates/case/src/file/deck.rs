//! Cases that take their tables from a deck (`deck = { file, ignore }`).
//!
//! The text of such a case is read with the tables of the deck below it, so that everything else sees a
//! case file like any other: replaced values, messages, the copy in a run.

use std::fmt::Write as _;
use std::io;
use std::ops::Range;
use std::sync::Arc;

use miette::NamedSource;
use slipstick_deck::{Ledger, translate};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document::Table;
use super::reader::Reader;
use super::{CaseCode, CaseDiagnostic, CaseErrors, ReadFile, Severity, SourceMap};

/// A case file with the tables of its deck.
#[derive(Debug, Clone)]
pub struct WithDeck {
    /// A complete case file.
    pub text: String,
    /// How the keywords of the deck were treated.
    pub ledger: Ledger,
}

/// `max_newton_iterations` of a deck: contact between coarse facets that overlap in the mesh takes up to 40.
const ITERATIONS: usize = 50;

/// Begins the part of a text that comes from a deck.
const MARK: &str = "# The tables below are those of the deck ";

/// Decks of more bytes than this are not shown in messages.
const SHOWN: usize = 1 << 24;

/// The case file for a deck alone.
pub fn case_of_deck(file: &str) -> String {
    format!("deck = {{ file = {} }}\n", toml::Value::from(file))
}

/// The text of a case with the tables of its deck in place of the key `deck`; `None` if it has none.
/// Keywords in `ignored` are left out of the deck, besides those that the case ignores.
///
/// # Errors
/// If the deck cannot be read or translated, at its lines.
pub fn with_deck(
    text: &str,
    file_name: &str,
    files: ReadFile<'_>,
    ignored: &[String],
) -> Result<Option<WithDeck>, CaseErrors> {
    let (document, syntax_errors) = DeTable::parse_recoverable(text);
    let root = document.get_ref();
    if !syntax_errors.is_empty() || !root.contains_key("deck") {
        return Ok(None);
    }
    let reader = Reader::new(text, file_name);
    let key = key(&reader, root);
    let (source_map, diagnostics) = reader.into_parts();
    let (Some((file, own, span)), true) = (key, diagnostics.is_empty()) else {
        let unknown = || source_map.error("deck", CaseCode::WrongType, "the deck is not a table", "");
        return Err(CaseErrors::collect(diagnostics).unwrap_or_else(unknown));
    };
    let ignored = [own, ignored.to_vec()].concat();
    let bytes = files(&file).map_err(|error| unreadable(&source_map, &file, &error))?;
    let shown = |name: &str, line: usize, message: &str, cure: &str| {
        let text = if name == file && bytes.len() < SHOWN {
            String::from_utf8_lossy(&bytes).into_owned()
        } else {
            String::new()
        };
        at_line(name, text, line, message, cure)
    };
    let translation = translate(&bytes, &file, &ignored).map_err(|error| {
        let (name, line) = error.place.rsplit_once(", ").unwrap_or((&file, &error.place));
        match line.strip_prefix("line ").and_then(|line| line.parse().ok()) {
            Some(line) => CaseErrors::from(shown(name, line, &error.message, &error.cure)),
            None => shown(&file, 1, &format!("{}: {}", error.place, error.message), &error.cure).into(),
        }
    })?;
    let errors = translation.errors().into_iter().map(|e| shown(&e.file, e.line, &e.message, &e.cure)).collect();
    if let Some(errors) = CaseErrors::collect(errors) {
        return Err(errors);
    }
    let title = match root.contains_key("title") || translation.title.is_empty() {
        true => String::new(),
        false => format!("title = {}   ", toml::Value::from(translation.title.as_str())),
    };
    let mut all = format!("{}{title}# deck {file}: see below{}", &text[..span.start], &text[span.end..]);
    let _ = write!(all, "\n{MARK}{file}.\n");
    if !root.contains_key("load_path") {
        let _ = write!(all, "[load_path]\nsteps = {}\nmax_newton_iterations = {ITERATIONS}\n", translation.steps);
    }
    all.push_str(&translation.text);
    Ok(Some(WithDeck { text: all, ledger: translation.ledger }))
}

/// The file and ignored keywords of the key `deck`, and where it is in the text.
fn key(reader: &Reader, root: &DeTable<'_>) -> Option<(String, Vec<String>, Range<usize>)> {
    let (key, value) = root.iter().find(|(key, _)| key.get_ref() == "deck")?;
    let span = key.span().start..value.span().end;
    let table = reader.table(value, "deck".into())?;
    if span.start > value.span().start || !matches!(value.get_ref(), DeValue::Table(_)) || is_header(reader, value) {
        let help = "write deck = { file = \"model.inp\" } before the first table";
        reader.error("deck", CaseCode::WrongType, "`deck` must be an inline table", help);
        return None;
    }
    let (file, ignored) = keys(&table);
    table.finish();
    (!file.is_empty()).then_some((file, ignored, span))
}

fn is_header(reader: &Reader, value: &Spanned<DeValue<'_>>) -> bool {
    let text = reader.text();
    text.get(value.span()).is_none_or(|text| !text.trim_start().starts_with('{'))
}

fn keys(table: &Table<'_>) -> (String, Vec<String>) {
    let help = "an input deck of Abaqus or CalculiX, relative to the case file";
    let file = table
        .string("file")
        .check(CaseCode::Empty, |file| !file.is_empty(), "is empty", "name an .inp file")
        .required(String::new(), help);
    let ignored = table.list("ignore", |value, path| table.reader.string(value, &path)).or(Vec::new());
    (file, ignored)
}

fn unreadable(map: &SourceMap, file: &str, error: &io::Error) -> CaseErrors {
    let help = "the path is relative to the folder of the case file";
    map.error("deck.file", CaseCode::Deck, format!("cannot read the deck {file}: {error}"), help)
}

/// A diagnostic at a line of a deck.
fn at_line(file: &str, text: String, line: usize, message: &str, cure: &str) -> CaseDiagnostic {
    let start = text.split_inclusive('\n').take(line - 1).map(str::len).sum::<usize>().min(text.len());
    let length = text[start..].lines().next().map_or(0, str::len);
    CaseDiagnostic {
        code: CaseCode::Deck,
        severity: Severity::Error,
        message: message.to_owned(),
        label: String::new(),
        help: cure.to_owned(),
        span: start..start + length,
        line,
        column: 1,
        source: Arc::new(NamedSource::new(file, text)),
    }
}

/// The line of the deck from which the table around a place of a case comes, such as
/// `model.inp:12 *CONTACT PAIR`.
pub(super) fn origin(text: &str, at: usize) -> Option<&str> {
    let start = text.find(MARK)?;
    let part = text.get(start..at)?;
    part.lines().rev().filter_map(|line| line.strip_prefix("# ")).find(|line| line.contains(" *"))
}

#[cfg(test)]
mod tests {
    use super::super::parse_case_with;
    use super::*;

    const DECK: &str = "*HEADING\nA \"block\"\n*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
        *NSET, NSET=low\n1,2,3,4\n*NSET, NSET=high\n5,6,7,8\n*ELEMENT, TYPE=C3D8, ELSET=block\n1, 1,2,3,4,5,6,7,8\n\
        *MATERIAL, NAME=steel\n*ELASTIC\n1000, 0.3\n*SOLID SECTION, ELSET=block, MATERIAL=steel\n\
        *STEP, NLGEOM\n*STATIC\n0.25, 1\n*BOUNDARY\nlow, 1, 3\nhigh, 3, 3, -0.1\n*NODE PRINT, NSET=high\nRF\n*END STEP\n";

    fn files(deck: &str) -> impl Fn(&str) -> io::Result<Vec<u8>> {
        let deck = deck.to_owned();
        move |name| {
            if name == "block.inp" { Ok(deck.clone().into_bytes()) } else { Err(io::Error::other("no such file")) }
        }
    }

    #[test]
    fn a_deck_is_a_case() {
        let text = "deck = { file = \"block.inp\" }\n[[quantity]]\nname = \"F\"\nreaction = { set = \"block_high\", component = \"z\" }\n";
        let resolved = parse_case_with(text, "case.toml", &files(DECK)).expect("a case");
        let case = &resolved.case;
        assert_eq!((case.title.as_str(), case.load_path.steps, case.quantities.len()), ("A \"block\"", 4, 1));
        assert_eq!((case.dirichlet.len(), case.dirichlet[0].set.as_str()), (2, "block_low"));
        let ledger = resolved.deck.expect("a deck");
        let how = |keyword: &str| ledger.uses.iter().find(|entry| entry.keyword == keyword).expect(keyword).how.word();
        assert_eq!(["ELASTIC", "NODE PRINT", "NSET"].map(how), ["translated", "ignored", "used"]);
        // the text that a run keeps is complete, and keeps its meaning
        let again = parse_case_with(resolved.source_map.text(), "case.toml", &files(DECK)).expect("a case");
        assert!(again.case == resolved.case && again.deck.is_none());
    }

    #[test]
    fn what_a_deck_cannot_have_is_said_at_its_line() {
        let deck = DECK.replace("*NODE PRINT", "*MPC\nBEAM, 1, 2\n*DLOAD\nblock, BX, 9.81\n*NODE PRINT");
        let text = "deck = { file = \"block.inp\" }\n";
        let errors = parse_case_with(text, "case.toml", &files(&deck)).expect_err("refused");
        let told: Vec<String> = errors.diagnostics().iter().map(CaseDiagnostic::plain).collect();
        assert_eq!(told.len(), 2, "{told:?}");
        assert!(told[0].starts_with("block.inp:28:1: error: *MPC:"), "{told:?}");
        assert!(told[1].starts_with("block.inp:31:1: error: *DLOAD: the load `BX`"), "{told:?}");
        let text = "deck = { file = \"block.inp\", ignore = [\"mpc\", \"*DLOAD\"] }\n";
        assert!(parse_case_with(text, "case.toml", &files(&deck)).is_ok());
    }

    #[test]
    fn errors_in_tables_of_a_deck_name_its_line() {
        let deck = DECK.replace("1000, 0.3", "1000, 0.5");
        let errors = parse_case_with("deck = { file = \"block.inp\" }", "case.toml", &files(&deck)).expect_err("wrong");
        let told = errors.diagnostics()[0].plain();
        assert!(told.contains("poisson_ratio") && told.contains("block.inp:21 *SOLID SECTION"), "{told}");
        for (text, what) in [
            ("deck = { file = \"other.inp\" }", "no such file"),
            ("deck = 3", "a table"),
            ("[deck]\nfile = \"block.inp\"", "before the first table"),
            ("deck = { file = \"block.inp\", ignored = [] }", "did you mean `ignore`?"),
            ("deck = { }", "needs the key `file`"),
        ] {
            let told = parse_case_with(text, "case.toml", &files(DECK)).expect_err("wrong").diagnostics()[0].plain();
            assert!(told.contains(what), "{told}");
        }
    }
}
