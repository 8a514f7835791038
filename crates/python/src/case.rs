//! Cases: from text to a problem, with diagnostics as data.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use slipstick::case::{CaseCode, Override, Resolved, TEMPLATES, override_case, parse_case_with, with_deck};
use slipstick::run::mesh_files;
use slipstick_service::check::{Checked, above_volume_bound, check};
use slipstick_service::read::{Unreadable, keywords, text_of};

use crate::errors::{Error, detached, diagnostics_as_json};
use crate::host::Interpreter;
use crate::problem::Problem;

/// A case that has been read and checked.
#[pyclass(frozen, module = "slipstick._slipstick")]
pub struct Case {
    pub(crate) resolved: Arc<Resolved>,
    /// The file from which the case was read, or which it represents: paths of mesh files are
    /// relative to it.
    pub(crate) file: PathBuf,
    /// Mesh files that exist only in memory, by the names that the case gives them.
    files: Arc<Files>,
}

/// Contents of files by name.
type Files = HashMap<String, Vec<u8>>;

/// Names and descriptions of the templates.
#[pyfunction]
pub fn templates() -> Vec<(&'static str, &'static str, &'static str)> {
    TEMPLATES.iter().map(|template| (template.name, template.about, template.text)).collect()
}

#[pymethods]
impl Case {
    /// Reads a case file or a deck, whose keywords in `ignored` are left out.
    #[staticmethod]
    fn load(py: Python<'_>, file: PathBuf, ignored: Vec<String>) -> PyResult<Self> {
        detached(py, || {
            let what = "cannot read the case file";
            let text = text_of(&file).map_err(|error| match error {
                Unreadable::Io(error) => Error::Os { what, path: file.clone(), error },
                error => error.at(&file).into(),
            })?;
            Self::read(&text, &file.display().to_string(), &file, Arc::default(), &ignored)
        })
    }

    /// Reads a text; `name` is for messages, `file` the place that paths of mesh files refer to;
    /// `files` are the contents of files that exist only in memory.
    #[staticmethod]
    fn of_text(py: Python<'_>, text: &str, name: &str, file: PathBuf, files: Files) -> PyResult<Self> {
        detached(py, || Self::read(text, name, &file, Arc::new(files), &[]))
    }

    /// The same case with values replaced, each given as `KEY=VALUE` with a value in TOML, and with
    /// further files.
    fn replace(&self, py: Python<'_>, values: Vec<String>, files: Files) -> PyResult<Self> {
        detached(py, || {
            let files = match files.is_empty() {
                true => self.files.clone(),
                false => Arc::new((*self.files).clone().into_iter().chain(files).collect()),
            };
            let wrong = |error: slipstick::case::OverrideError| Error::input(error.to_string(), error.cure());
            let values: Result<Vec<Override>, _> = values.iter().map(|value| value.parse()).collect();
            let map = &self.resolved.source_map;
            let text = override_case(map.text(), map.file(), &values.map_err(wrong)?).map_err(wrong)?;
            let name = map.file().trim_end_matches(CHANGED);
            let case = Self::read(&text, &format!("{name}{CHANGED}"), &self.file, files, &[])?;
            // the text has the tables of the deck, and refers to it for meshes alone
            let resolved = Resolved { deck: self.resolved.deck.clone(), ..(*case.resolved).clone() };
            Ok(Self { resolved: Arc::new(resolved), ..case })
        })
    }

    /// The text of the case.
    #[getter]
    fn text(&self) -> &str {
        self.resolved.source_map.text()
    }

    /// The name that messages use.
    #[getter]
    fn name(&self) -> &str {
        self.resolved.source_map.file()
    }

    /// The file from which the case was read, or which it represents.
    #[getter]
    fn file(&self) -> PathBuf {
        self.file.clone()
    }

    /// The files that exist only in memory.
    #[getter]
    fn files<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let files = PyDict::new(py);
        for (name, bytes) in &*self.files {
            files.set_item(name, PyBytes::new(py, bytes))?;
        }
        Ok(files)
    }

    /// How the keywords of its deck are treated, as JSON; `None` without a deck.
    fn deck(&self) -> Option<String> {
        let ledger = self.resolved.deck.as_ref()?;
        Some(serde_json::Value::from(keywords(ledger)).to_string())
    }

    /// The case with all defaults filled in, as JSON.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || serde_json::to_string(&self.resolved.case).map_err(|error| Error::Internal(error.to_string())))
    }

    /// The constants of a body's materials that change when Young's modulus of the small-strain limit of
    /// its own gets this value, and those of its sections change by the same factor, as entries of the case.
    fn moduli(&self, py: Python<'_>, body: usize, youngs_modulus: f64) -> PyResult<Vec<(String, String)>> {
        detached(py, || {
            let of = &self.resolved.case.bodies[body];
            let wrong = |error: slipstick::solid::MaterialError| Error::input(error.to_string(), error.help);
            let factor = youngs_modulus / of.material.youngs_modulus();
            let mut entries = Vec::new();
            for (number, material) in of.materials().enumerate() {
                let place = match number.checked_sub(1) {
                    None => format!("body[{body}].material"),
                    Some(section) => format!("body[{body}].section[{section}].material"),
                };
                let changed = match number {
                    0 => material.with_youngs_modulus(youngs_modulus),
                    _ => material.stiffened(factor),
                };
                let changed = changed.map_err(wrong)?;
                let law = changed.kind().word();
                for (constant, value) in changed.constants().filter(|(constant, _)| constant.is_modulus()) {
                    let value = serde_json::to_string(&value).map_err(|error| Error::Internal(error.to_string()))?;
                    entries.push((format!("{place}.{law}.{}", constant.key), value));
                }
            }
            Ok(entries)
        })
    }

    /// Builds and inspects the problem; returns it and the warnings as JSON.
    fn build(&self, py: Python<'_>) -> PyResult<(Problem, String)> {
        detached(py, || {
            let (Checked { warnings, .. }, problem) = self.checked()?;
            Ok((Problem::new(self.resolved.clone(), problem), diagnostics_as_json(&warnings)))
        })
    }

    /// Facts known before anything is solved, and the warnings, both as JSON.
    fn check(&self, py: Python<'_>) -> PyResult<(String, String)> {
        detached(py, || {
            let (checked, problem) = self.checked()?;
            let mut warnings = checked.warnings.clone();
            let known = warnings.iter().any(|warning| warning.code() == CaseCode::InitialVolume);
            let warning = above_volume_bound(&self.resolved, &problem);
            warnings.extend(warning.filter(|_| !known));
            let found = serde_json::to_string(&checked.facts()).map_err(|error| Error::Internal(error.to_string()))?;
            Ok((found, diagnostics_as_json(&warnings)))
        })
    }
}

/// Reads files in memory, and those next to a case file.
fn reader<'a>(files: &'a Files, case_file: &'a Path) -> impl Fn(&str) -> io::Result<Vec<u8>> + use<'a> {
    let on_disk = mesh_files(case_file);
    move |name| files.get(name).map_or_else(|| on_disk(name), |bytes| Ok(bytes.clone()))
}

/// Added to the name of a case with replaced values.
const CHANGED: &str = " (with replaced values)";

impl Case {
    fn read(text: &str, name: &str, file: &Path, files: Arc<Files>, ignored: &[String]) -> Result<Self, Error> {
        let contents = reader(&files, file);
        let (with, deck) = match with_deck(text, name, &contents, ignored)? {
            Some(with) => (with.text, Some(with.ledger)),
            None => (text.to_owned(), None),
        };
        let resolved = Resolved { deck, ..parse_case_with(&with, name, &contents)? };
        drop(contents);
        Ok(Self { resolved: Arc::new(resolved), file: file.to_owned(), files })
    }

    /// Reads the mesh files that the case names.
    pub(crate) fn mesh_files(&self) -> impl Fn(&str) -> io::Result<Vec<u8>> + use<'_> {
        reader(&self.files, &self.file)
    }

    /// The problem, and facts about the case. Rejects what the program rejects.
    fn checked(&self) -> Result<(Checked, slipstick::build::Problem), Error> {
        Ok(check(&Interpreter::default(), (*self.resolved).clone())?)
    }
}
