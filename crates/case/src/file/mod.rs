//! The case file: reading it, checking it and reporting its errors.
//!
//! A case file is TOML. [`parse_case`] reads it in two stages: it parses the text into a tree that
//! knows the place of each value, then converts the tree to a [`Case`], with every value checked
//! and every default filled in. Reading does not stop at the first error but collects all of them;
//! each has a stable [`CaseCode`] and points at file, line and column. Errors that are found later,
//! while the model is built, point to the file through the [`SourceMap`].
//!
//! ```
//! let text = slipstick_case::file::template("half-ball").unwrap().text;
//! let resolved = slipstick_case::file::parse_case(text, "half_ball.toml").unwrap();
//! assert_eq!(resolved.case.bodies[0].name, "plate");
//!
//! let errors = slipstick_case::file::parse_case("titel = 'a'", "case.toml").unwrap_err();
//! assert!(errors.to_string().starts_with("case.toml:1:1: error: "));
//! ```

mod diagnostics;
mod encoding;
mod explain;
mod field;
mod from_mesh;
mod names;
mod overrides;
mod read;
mod reader;
mod resolved;
mod schema;
mod sha256;
mod source_map;
mod syntax;
mod templates;
mod typed;

pub use diagnostics::{CaseCode, CaseDiagnostic, CaseErrors, Severity};
pub use encoding::{NotUtf8, utf8};
pub use from_mesh::{MeshCase, case_of_mesh};
pub use overrides::{Override, OverrideError, override_case};
pub use resolved::*;
pub use schema::schema;
pub use sha256::{hexadecimal, sha256};
pub use source_map::SourceMap;
pub use templates::{TEMPLATES, Template, template};

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

/// Reads a file that the case names and returns its bytes. The caller knows the folder and accesses
/// the file system.
pub type ReadFile<'f> = &'f dyn Fn(&str) -> io::Result<Vec<u8>>;

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
fn requirements(text: &str) -> Vec<reader::Requirement> {
    let reader = reader::Reader::new(text, "");
    let (document, _) = DeTable::parse_recoverable(text);
    read::case(typed::Table::new(&reader, document.get_ref(), String::new()), &|_| Err(io::Error::other("")));
    reader.into_requirements()
}

/// Reads and checks a case file and the mesh files that it refers to.
///
/// # Errors
///
/// As for [`parse_case`]; and errors in the mesh files, at the places that refer to them.
pub fn parse_case_with(text: &str, file_name: &str, files: ReadFile<'_>) -> Result<Resolved, CaseErrors> {
    let reader = reader::Reader::new(text, file_name);
    let (document, syntax_errors) = DeTable::parse_recoverable(text);
    if !syntax_errors.is_empty() {
        syntax::report(&reader, text, &syntax_errors);
        let (source_map, diagnostics) = reader.into_parts();
        let unknown = || source_map.error("", CaseCode::Syntax, "the text is not TOML", "");
        return Err(CaseErrors::collect(diagnostics).unwrap_or_else(unknown));
    }
    let root = typed::Table::new(&reader, document.get_ref(), String::new());
    let case = read::case(root, files);
    let (source_map, mut warnings) = reader.into_parts();
    if let Some(errors) = CaseErrors::collect(warnings.clone()) {
        return Err(errors);
    }
    warnings.sort_by_key(|warning| warning.span().start);
    Ok(Resolved { case, warnings, source_map })
}
