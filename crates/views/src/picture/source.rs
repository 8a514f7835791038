//! The results of a run that can be drawn.

use std::path::PathBuf;

use slipstick_mesh::Mesh;
use slipstick_model::words::list;

use super::{PictureError, PictureRequest, Shown};
use slipstick_results::output::{StoredField, read_fields};
use slipstick_results::run::{RunDirectory, RunError, read_density};

/// A result that can be drawn.
pub(super) struct Source {
    /// Where it comes from.
    pub place: PathBuf,
    /// Its description, for the caption.
    pub what: String,
    pub fields: Vec<StoredField>,
}

impl Source {
    fn numbered(run: &RunDirectory, stem: &str, number: usize, what: String) -> Result<Self, PictureError> {
        Self::file(run.file(&RunDirectory::numbered(stem, number)), what)
    }

    fn file(place: PathBuf, what: String) -> Result<Self, PictureError> {
        let fields = read_fields(&place).map_err(RunError::from)?;
        Ok(Self { place, what, fields })
    }

    pub fn values(&self, name: &str) -> Option<&[f64]> {
        self.fields.iter().find(|field| field.name == name).map(|field| &field.values[..])
    }

    /// The field of this name, or the only one with this word in its name.
    pub fn find(&self, name: &str) -> Option<&StoredField> {
        let whole = self.fields.iter().find(|field| field.name == name);
        let mut partly = self.fields.iter().filter(|field| field.name.split('_').any(|word| word == name));
        whole.or_else(|| partly.next().filter(|_| partly.next().is_none()))
    }
}

/// The results that may have the field, the first choice first.
pub(super) fn sources(run: &RunDirectory, mesh: &Mesh, request: &PictureRequest) -> Result<Vec<Source>, PictureError> {
    let (steps, iterations) = (run.numbers("path")?, run.numbers("design")?);
    let pick = |stem, what, number, known: &[usize]| {
        if known.contains(&number) {
            return Ok(vec![Source::numbered(run, stem, number, format!("{what} {number}"))?]);
        }
        let known = if known.is_empty() { "none".into() } else { list(known) };
        Err(PictureError::NotWritten { directory: run.path().to_owned(), what, number, known })
    };
    match request.shown {
        Shown::Iteration(number) => return pick("design", "iteration", number, &iterations),
        Shown::Step(number) => return pick("path", "load step", number, &steps),
        Shown::Failure => {
            let place = run.file("failure.vtu");
            if !place.is_file() {
                return Err(PictureError::NoFailure { directory: run.path().to_owned() });
            }
            return Ok(vec![Source::file(place, "failing iterate".into())?]);
        }
        Shown::Newest => {}
    }
    let table = run.file("design.csv");
    if !table.is_file() && steps.is_empty() {
        return Err(RunError::NoRun { directory: run.path().to_owned(), file: "design.csv" }.into());
    }
    let mut all = Vec::new();
    if let Some(&last) = steps.last() {
        all.push(Source::numbered(run, "path", last, format!("load step {last}"))?);
    }
    if table.is_file() {
        let values = read_density(&table, mesh)?;
        // A path left by an earlier part of the run is not that of the newest design.
        let other = all.first().is_none_or(|path| path.values("density") != Some(&values[..]));
        if other {
            let fields =
                vec![StoredField { name: "density".into(), on_points: false, components: 1, values: values.into() }];
            all.insert(0, Source { place: table, what: "newest design".into(), fields });
        }
    }
    let gradient = run.file("gradient.vtu");
    if gradient.is_file() {
        all.push(Source::file(gradient, "gradient".into())?);
    }
    // The last design has no derivative, because only an update needs one; the design before it has
    // one.
    for &number in iterations.iter().rev().take(2) {
        all.push(Source::numbered(run, "design", number, format!("iteration {number}"))?);
    }
    Ok(all)
}
