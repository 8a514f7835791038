//! From the text of a case file to the resolved case.

use super::deck::{WithDeck, with_deck};
use super::document::Table;
use super::read::{self, ReadFile};
use super::reader::{Reader, Requirement};
use super::{Case, CaseCode, CaseDiagnostic, CaseErrors, Severity, Sides, SourceMap, syntax};
use slipstick_deck::Ledger;
use std::io;
use toml::de::DeTable;

/// A case without errors, its warnings, and the places of its values.
#[derive(Debug, Clone)]
pub struct Resolved {
    /// The case.
    pub case: Case,
    /// Input that is allowed but probably a mistake, in the order of the file.
    pub warnings: Vec<CaseDiagnostic>,
    /// The place of each value.
    pub source_map: SourceMap,
    /// How the keywords of the deck were treated, if the case was read with one.
    pub deck: Option<Ledger>,
}

impl Resolved {
    /// Warns about entries of the schedule that come too late for this number of iterations, instead
    /// of that of the case.
    pub fn expect_iterations(&mut self, iterations: usize) {
        self.warnings.retain(|warning| warning.code() != CaseCode::LateSchedule);
        let schedule = self.case.optimizer.as_ref().map(|optimizer| &optimizer.schedule);
        for (key, last) in schedule.map(|schedule| schedule.late(iterations)).unwrap_or_default() {
            let (message, help) = read::late(last, iterations);
            let path = format!("optimizer.schedule.{key}");
            // the default schedule belongs to the iterations of the case
            let help = match self.source_map.contains(&path) {
                true => help,
                false => "set `optimizer.iterations` instead, to which the default schedule belongs",
            };
            let warning = self.source_map.diagnostic(Severity::Warning, &path, CaseCode::LateSchedule, message, help);
            self.warnings.push(warning);
        }
    }

    /// Checks that the sections that a command needs are present, by name: `design`, `objective`,
    /// `optimizer`, `contact`, `dirichlet`.
    ///
    /// # Errors
    ///
    /// [`CaseCode::MissingSection`] for each missing section, at the start of the file.
    pub fn require(&self, sections: &[&str]) -> Result<(), CaseErrors> {
        // symmetry planes can hold bodies by themselves
        let needless = |section: &str| section == "dirichlet" && !self.case.symmetries.is_empty();
        let missing = sections.iter().filter(|section| !self.source_map.contains(section) && !needless(section));
        let error = |section: &&str| {
            self.source_map.diagnostic(
                Severity::Error,
                section,
                CaseCode::MissingSection,
                format!("the case has no section [{section}]"),
                "for a commented example, run `slipstick new half-ball`",
            )
        };
        match CaseErrors::collect(missing.map(error).collect()) {
            Some(errors) => Err(errors),
            None => Ok(()),
        }
    }
}

/// Reads and checks a case file that refers to no other files; `file_name` only appears in
/// messages.
///
/// # Errors
///
/// All errors of the file at once. If the text is not TOML, only the syntax errors, since the text
/// after them cannot be interpreted reliably.
pub fn parse_case(text: &str, file_name: &str) -> Result<Resolved, CaseErrors> {
    parse_case_with(text, file_name, &|_| Err(io::Error::other("the case is read without its folder")))
}

/// What the reader requires of the tables in a text, whether the text has it or not.
pub(super) fn requirements(text: &str) -> Vec<Requirement> {
    let reader = Reader::new(text, "");
    let (document, _) = DeTable::parse_recoverable(text);
    read::case(Table::new(&reader, document.get_ref(), String::new()), &|_| Err(io::Error::other("")), &[]);
    reader.into_requirements()
}

/// Reads and checks a case file and the mesh files that it refers to.
///
/// # Errors
///
/// As for [`parse_case`]; and errors in the mesh files, at the places that refer to them.
pub fn parse_case_with(text: &str, file_name: &str, files: ReadFile<'_>) -> Result<Resolved, CaseErrors> {
    if let Some(WithDeck { text, ledger }) = with_deck(text, file_name, files, &[])? {
        let resolved = parse_case_with(&text, file_name, files)?;
        return Ok(Resolved { deck: Some(ledger), ..resolved });
    }
    let mut resolved = parse(text, file_name, files, &[])?;
    let exchanged = crate::construct::sides::exchanged(&resolved.case);
    if !exchanged.is_empty() {
        resolved = parse(text, file_name, files, &exchanged)?;
    }
    resolved.case.contacts.iter_mut().for_each(|contact| contact.sides = Sides::AsGiven);
    Ok(resolved)
}

/// The same without a deck, with slave and master of the pairs with these numbers exchanged.
fn parse(text: &str, file_name: &str, files: ReadFile<'_>, exchanged: &[usize]) -> Result<Resolved, CaseErrors> {
    let reader = Reader::new(text, file_name);
    let (document, syntax_errors) = DeTable::parse_recoverable(text);
    if !syntax_errors.is_empty() {
        syntax::report(&reader, text, &syntax_errors);
        let (source_map, diagnostics) = reader.into_parts();
        let unknown = || source_map.error("", CaseCode::Syntax, "the text is not TOML", "");
        return Err(CaseErrors::collect(diagnostics).unwrap_or_else(unknown));
    }
    let root = Table::new(&reader, document.get_ref(), String::new());
    let case = read::case(root, files, exchanged);
    let (source_map, mut warnings) = reader.into_parts();
    if let Some(errors) = CaseErrors::collect(warnings.clone()) {
        return Err(errors);
    }
    warnings.sort_by_key(|warning| warning.span().start);
    Ok(Resolved { case, warnings, source_map, deck: None })
}
