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

mod deck;
mod diagnostics;
pub(crate) mod document;
mod encoding;
mod explain;
mod field;
mod from_deck;
mod from_mesh;
pub(crate) mod names;
mod overrides;
mod parse;
pub(crate) mod read;
pub(crate) mod reader;
mod resolved;
mod schema;
mod sha256;
mod source_map;
mod syntax;
mod templates;

pub use deck::{WithDeck, case_of_deck, with_deck};
pub use diagnostics::{CaseCode, CaseDiagnostic, CaseErrors, Severity};
pub use encoding::{NotUtf8, utf8};
pub use from_deck::design_of_deck;
pub use from_mesh::{Measured, MeshCase, Step, case_of_mesh, case_of_step};
pub use overrides::{Override, OverrideError, override_case};
pub use parse::{Resolved, parse_case, parse_case_with};
pub use read::ReadFile;
pub use resolved::*;
pub use schema::schema;
pub use sha256::{hexadecimal, sha256};
pub use slipstick_deck::{How, KeywordUse, Ledger};
pub use source_map::SourceMap;
pub use templates::{TEMPLATES, Template, template};
