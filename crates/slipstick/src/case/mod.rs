//! The case file: what a user types, what it means, and what is wrong with it.
//!
//! A case file is TOML. [`parse_case`] reads it in two stages: the text becomes a tree that knows the place of each
//! value, the tree becomes a [`Case`], in which everything is checked and every default filled in. Errors are
//! collected, not thrown at the first; each has a stable [`CaseCode`] and points at file, line and column. What
//! turns out wrong only while the model is built points back at the file through the [`SourceMap`].
//!
//! ```
//! let text = slipstick::case::template("half-ball").unwrap().text;
//! let resolved = slipstick::case::parse_case(text, "half_ball.toml").unwrap();
//! assert_eq!(resolved.case.bodies[0].name, "plate");
//!
//! let errors = slipstick::case::parse_case("titel = 'a'", "case.toml").unwrap_err();
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
pub use source_map::SourceMap;
pub use templates::{TEMPLATES, Template, template};

use std::io;

use toml::de::DeTable;

/// A case without errors, with the warnings about it and the places of its values.
#[derive(Debug, Clone)]
pub struct Resolved {
    /// What the file means.
    pub case: Case,
    /// What is allowed but probably not meant, in the order of the file.
    pub warnings: Vec<CaseDiagnostic>,
    /// Where each value stands.
    pub source_map: SourceMap,
}

impl Resolved {
    /// Asks for sections that a command cannot do without, by name: `design`, `objective`, `optimizer`, `contact`,
    /// `dirichlet`.
    ///
    /// # Errors
    ///
    /// [`CaseCode::MissingSection`] for each that the file lacks, at the file's start.
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
                "a commented example: `slipstick new half-ball`",
            )
        };
        match CaseErrors::collect(missing.map(error).collect()) {
            Some(errors) => Err(errors),
            None => Ok(()),
        }
    }
}

/// How the files are read that a case names: bytes by the name in the case. The caller knows the folder, and touches the
/// file system.
pub type ReadFile<'f> = &'f dyn Fn(&str) -> io::Result<Vec<u8>>;

/// Reads and checks a case file that names no other files; `file_name` is only shown in messages.
///
/// # Errors
///
/// All errors of the file at once. Where the text is not TOML, only that: what lies behind a syntax error cannot be
/// trusted.
pub fn parse_case(text: &str, file_name: &str) -> Result<Resolved, CaseErrors> {
    parse_case_with(text, file_name, &|_| Err(io::Error::other("the case is read without its folder")))
}

/// Reads and checks a case file and the mesh files that it names.
///
/// # Errors
///
/// As [`parse_case`]; and what is wrong with the files, at the places where they are named.
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
