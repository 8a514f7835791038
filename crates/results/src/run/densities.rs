//! Densities of elements as tables.

use std::path::{Path, PathBuf};

use slipstick_design::ElementValues;
use slipstick_mesh::Mesh;

use super::{RunDirectory, RunError, bytes_of};
use crate::output::{OutputError, read_fields, write_atomically};
use slipstick_case::file::utf8;
use slipstick_model::words::list;

/// Column of the design variables, and name of their field.
pub const DESIGN_VARIABLE: &str = "design_variable";

/// Writes a table with a row per element: `element` (from 0, over all bodies), `body`, `density`
/// and, where given, `derivative` (dθ/dφ) and `design_variable`. The table is written completely or
/// not at all.
///
/// # Errors
/// [`OutputError`]; [`OutputError::NotFinite`] before anything is written.
///
/// # Panics
/// If there is not one value per element.
pub fn write_densities(
    path: &Path,
    mesh: &Mesh,
    density: &ElementValues,
    derivative: Option<&ElementValues>,
    variables: Option<&ElementValues>,
) -> Result<(), OutputError> {
    let others = [("derivative", derivative), (DESIGN_VARIABLE, variables)];
    let others: Vec<(&str, &ElementValues)> =
        others.into_iter().filter_map(|(name, values)| Some((name, values?))).collect();
    for (name, values) in [("density", density)].iter().chain(&others) {
        assert_eq!(values.len(), mesh.elements.len(), "one value per element");
        let position = values.iter().position(|value| !value.is_finite());
        if let Some(entry) = position {
            return Err(OutputError::NotFinite { name: (*name).into(), entry, value: values[entry] });
        }
    }
    write_atomically(path, |writer| {
        let names: String = others.iter().map(|(name, _)| format!(",{name}")).collect();
        writeln!(writer, "element,body,density{names}")?;
        for body in &mesh.bodies {
            for element in body.elements.clone() {
                write!(writer, "{element},{},{:?}", body.name, density[element])?;
                for (_, values) in &others {
                    write!(writer, ",{:?}", values[element])?;
                }
                writeln!(writer)?;
            }
        }
        Ok(())
    })
}

/// The densities of a design: `results` is the directory of a run, or a table itself.
///
/// # Errors
/// As [`read_density`]; [`RunError::NoRun`] for a directory without `design.csv`.
pub fn load_density(results: &Path, mesh: &Mesh) -> Result<ElementValues, RunError> {
    read_density(&table_of(results)?, mesh)
}

/// `results` itself, or the table of the run in that directory.
pub(super) fn table_of(results: &Path) -> Result<PathBuf, RunError> {
    if !results.is_dir() {
        return Ok(results.to_owned());
    }
    let table = results.join("design.csv");
    if !table.is_file() {
        return Err(RunError::NoRun { directory: results.to_owned(), file: "design.csv" });
    }
    Ok(table)
}

/// The densities of a design of a run: the newest one, or that of an iteration whose fields were
/// written.
///
/// # Errors
/// As [`load_density`]; [`RunError::Densities`] if the iteration has no file, or if its file has a
/// different mesh.
pub fn design_density(run: &RunDirectory, mesh: &Mesh, iteration: Option<usize>) -> Result<ElementValues, RunError> {
    let Some(number) = iteration else { return load_density(run.path(), mesh) };
    let path = run.file(&RunDirectory::numbered("design", number));
    let wrong = |reason: &str, cure: String| RunError::Densities {
        path: path.clone(),
        line: None,
        reason: reason.into(),
        cure,
    };
    let known = run.numbers("design")?;
    if !known.contains(&number) {
        let known = if known.is_empty() { "none".into() } else { list(&known) };
        return Err(wrong("this iteration was not written", format!("available iterations: {known}")));
    }
    let fields = read_fields(&path)?;
    let density = fields.into_iter().find(|field| field.name == "density" && !field.on_points);
    match density.filter(|field| field.values.len() == mesh.elements.len()) {
        Some(field) => Ok(field.values.into()),
        None => Err(wrong("has no densities for this mesh", "use another iteration".into())),
    }
}

/// Reads the densities of all elements from a table with the columns `element` and `density`, in
/// any order of rows; a column `body` is compared with the mesh, other columns are ignored. Cells
/// may be quoted.
///
/// # Errors
/// [`RunError::Read`]; [`RunError::Densities`] if a column or an element is missing, an element
/// appears twice or is not in the mesh, or a density is not a number in \[0, 1\].
pub fn read_density(path: &Path, mesh: &Mesh) -> Result<ElementValues, RunError> {
    read_column(path, mesh, "density")?.ok_or_else(|| wrong(path, Some(1), "there is no column `density`".into()))
}

fn wrong(path: &Path, line: Option<usize>, reason: String) -> RunError {
    RunError::Densities {
        path: path.to_owned(),
        line,
        reason,
        cure: "use a table written by a run of a case with the same bodies and meshes".into(),
    }
}

/// The column of this name; `None` if there is no such column.
pub(super) fn read_column(path: &Path, mesh: &Mesh, name: &str) -> Result<Option<ElementValues>, RunError> {
    let bytes = bytes_of(path).map_err(RunError::read(path))?;
    let text = utf8(bytes).map_err(|error| RunError::Densities {
        path: path.to_owned(),
        line: Some(error.line),
        reason: error.to_string(),
        cure: "save the table as UTF-8".into(),
    })?;
    let wrong = |line: Option<usize>, reason: String| wrong(path, line, reason);
    let mut lines = text.lines().enumerate();
    let header: Vec<&str> = cells(lines.next().map_or("", |line| line.1));
    let column = |name: &str| header.iter().position(|&found| found == name);
    let needed = |name: &str| column(name).ok_or_else(|| wrong(Some(1), format!("there is no column `{name}`")));
    let (element_at, body_at) = (needed("element")?, column("body"));
    let Some(density_at) = column(name) else { return Ok(None) };
    let count = mesh.elements.len();
    let mut density = vec![f64::NAN; count];
    for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let at = Some(number + 1);
        let cells: Vec<&str> = cells(line);
        let cell = |column: usize| cells.get(column).copied().unwrap_or_default();
        let element = cell(element_at).parse().ok().filter(|&element: &usize| element < count);
        let element = element.ok_or_else(|| {
            let last = count.saturating_sub(1);
            wrong(at, format!("`{}` is not an element: the mesh has elements 0 to {last}", cell(element_at)))
        })?;
        let value = cell(density_at).parse().ok().filter(|value: &f64| (0.0..=1.0).contains(value));
        let value = value.ok_or_else(|| wrong(at, format!("`{}` is not a {name} in [0, 1]", cell(density_at))))?;
        let body = mesh.body_of_element(element).map(|body| mesh.bodies[body].name.as_str());
        if let Some(column) = body_at.filter(|&column| body != Some(cell(column))) {
            let (found, body) = (cell(column), body.unwrap_or("none"));
            let reason = format!("element {element} belongs to body `{found}` here, but to `{body}` in the case");
            return Err(wrong(at, reason));
        }
        if !density[element].is_nan() {
            return Err(wrong(at, format!("element {element} appears a second time")));
        }
        density[element] = value;
    }
    match density.iter().position(|value| value.is_nan()) {
        Some(element) => Err(wrong(None, format!("element {element} of {count} is missing"))),
        None => Ok(Some(density.into())),
    }
}

/// The cells of a line, without the quotes that spreadsheets put around them.
fn cells(line: &str) -> Vec<&str> {
    let bare = |cell: &str| cell.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).map(str::len);
    line.split(',').map(str::trim).map(|cell| bare(cell).map_or(cell, |length| cell[1..=length].trim())).collect()
}
