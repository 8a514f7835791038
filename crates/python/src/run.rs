//! Optimizations in a directory, and pictures, pages and surfaces of their results.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use slipstick::build::{Problem, build, build_mesh, optimization};
use slipstick::case::{Resolved, parse_case_with, sha256};
use slipstick::design::ElementValues;
use slipstick::drive::{DriveError, Recorder, drive};
use slipstick::export::{ExportOptions, design_surface, unit_of_3mf, write_3mf, write_obj, write_stl, write_vtu};
use slipstick::mesh::Mesh;
use slipstick::optimize::Optimization;
use slipstick::output::write_atomically;
use slipstick::picture::{PictureRequest, Shown, picture};
use slipstick::render::{Canvas, RenderError};
use slipstick::report::{PageOptions, page};
use slipstick::run::{
    Checkpoint, ExitState, RESPONSES, ResultRecord, RunDirectory, RunError, RunPart, RunRecord, design_density,
    mesh_files,
};
use slipstick_service::failure::Failure;
use slipstick_service::run::SECTIONS;

use crate::arrays;
use crate::case::Case;
use crate::errors::{Error, detached};
use crate::interrupt::Watch;
use crate::problem::raised;
use crate::quantity::take_raised;
use crate::responses::{Own, Responses, described, hashed};

/// The directory of a run, with its case.
#[pyclass(frozen, module = "slipstick._slipstick")]
pub struct Run {
    directory: RunDirectory,
    resolved: Arc<Resolved>,
    mesh: Mesh,
}

/// Optimizes the design of a case in its own directory.
#[pyfunction]
#[pyo3(signature = (case, density, iterations, directory, force, command, own, callback=None, progress=None))]
pub fn optimize(
    py: Python<'_>,
    case: &Case,
    density: Option<PyReadonlyArray1<'_, f64>>,
    iterations: Option<usize>,
    directory: PathBuf,
    force: bool,
    command: Vec<String>,
    own: Option<Own>,
    callback: Option<Py<PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Run> {
    let density = density.as_ref().map(arrays::densities);
    detached(py, || {
        let resolved = &case.resolved;
        let (responses, mut record) = Responses::of(own);
        let of_python = responses.have_objective();
        let mut optimization = prepare(resolved, density, responses)?;
        if let (Some(record), Some(objective), true) =
            (&mut record, &optimization.problem.analysis.objective, of_python)
        {
            *record = described(record, &resolved.case, objective)?;
        }
        if let Some(iterations) = iterations {
            optimization.set_iterations(iterations);
        }
        let part = RunPart::starting(command, rayon::current_num_threads());
        let run = slipstick::run::Run::start(&directory, resolved, &case.file, &case.mesh_files(), part, force)?;
        let hash = match &record {
            Some(record) => {
                write_atomically(&run.directory().file(RESPONSES), |writer| writer.write_all(record.as_bytes()))
                    .map_err(RunError::from)?;
                sha256(&hashed(resolved.source_map.text(), record))
            }
            None => {
                // of an earlier run in this directory
                let _ = std::fs::remove_file(run.directory().file(RESPONSES));
                run.case_sha256().to_owned()
            }
        };
        let checkpoint = Checkpoint::new(hash, optimization.iterations(), Vec::new(), optimization.state.clone());
        let mut watch = Watch::new(progress, callback);
        finish(run, resolved, &mut optimization, checkpoint, &mut watch)?;
        Run::open_directory(&directory)
    })
}

/// Continues an optimization from its last finished iteration.
#[pyfunction]
#[pyo3(signature = (directory, iterations, command, own, callback=None, progress=None))]
pub fn resume(
    py: Python<'_>,
    directory: PathBuf,
    iterations: Option<usize>,
    command: Vec<String>,
    own: Option<Own>,
    callback: Option<Py<PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Run> {
    detached(py, || {
        let taken = RunDirectory::take_up(&directory)?;
        let mut checkpoint = Checkpoint::read(&taken)?;
        let record = RunRecord::read(&taken)?;
        let (path, text) = case_of(&taken)?;
        let (responses, own) = Responses::of(own);
        let found = own.map_or_else(|| sha256(&text), |own| sha256(&hashed(&text, &own)));
        let expected = checkpoint.case_sha256.clone();
        if expected != found {
            return Err(RunError::OtherCase { path, expected, found }.into());
        }
        let resolved = read(&path, &text)?;
        let mut optimization = prepare(&resolved, None, responses)?;
        checkpoint.restore(&taken, &mut optimization)?;
        let iterations = iterations.unwrap_or(checkpoint.iterations);
        optimization.set_iterations(iterations);
        if optimization.finished() && record.latest.exit == ExitState::Finished {
            drop(taken);
            return Run::open_directory(&directory);
        }
        checkpoint.iterations = iterations;
        checkpoint.reopen();
        optimization.state = checkpoint.state.clone();
        let part = RunPart::starting(command, rayon::current_num_threads());
        let run = slipstick::run::Run::take_up(taken.writing(&resolved.case.output), record, part)?;
        let mut watch = Watch::new(progress, callback);
        finish(run, &resolved, &mut optimization, checkpoint, &mut watch)?;
        Run::open_directory(&directory)
    })
}

/// An optimization of a case at its start, from these densities if given.
fn prepare(resolved: &Resolved, density: Option<ElementValues>, responses: Responses) -> Result<Optimization, Error> {
    let own = responses.have_objective();
    let sections: Vec<&str> = SECTIONS.iter().copied().filter(|section| !(own && *section == "objective")).collect();
    resolved.require(&sections)?;
    let map = &resolved.source_map;
    let mut problem: Problem = build(&resolved.case).map_err(|error| Error::build(&error, map))?;
    responses.apply(&mut problem)?;
    if let Some(density) = density {
        // the case sets the densities of passive elements and of those outside the design
        problem.start_from(&density);
    }
    optimization(&resolved.case, problem).map_err(|error| Error::build(&error, map))
}

/// Runs an optimization to its end and records how it ended.
fn finish(
    run: slipstick::run::Run,
    resolved: &Resolved,
    optimization: &mut Optimization,
    checkpoint: Checkpoint,
    watch: &mut Watch,
) -> Result<(), Error> {
    let outcome = advance(&run, resolved, optimization, checkpoint, watch);
    let (exit, message) = match &outcome {
        Ok(()) => (ExitState::Finished, None),
        Err(Error::Interrupted(message)) => (ExitState::Interrupted, Some(message.clone())),
        Err(Error::Python(error)) => (ExitState::Interrupted, Some(error.to_string())),
        Err(Error::Analysis(report)) => (ExitState::Failed, Some(report.to_string())),
        Err(Error::Input { message, .. } | Error::Internal(message)) => (ExitState::Failed, Some(message.clone())),
        Err(Error::Case(_) | Error::Os { .. }) => (ExitState::Failed, None),
    };
    let written = run.end(exit, message);
    outcome?;
    Ok(written?)
}

fn advance(
    run: &slipstick::run::Run,
    resolved: &Resolved,
    optimization: &mut Optimization,
    checkpoint: Checkpoint,
    watch: &mut Watch,
) -> Result<(), Error> {
    // of an earlier call
    drop(take_raised());
    let ranks = optimization.problem.analysis.linear.ranks();
    let recorder = Recorder::new(Some(run.directory()), checkpoint, resolved.case.output.every, ranks)?;
    optimization.problem.analysis.linear.set_interrupt(Some(watch.interrupt()));
    watch.expect(optimization);
    let driven = drive(optimization, Some(recorder), watch);
    // an exception of a quantity, whose value was then not a number
    raised()?;
    match driven {
        // a callback may fail at the last design, when nothing is left to stop
        Ok(_) => watch.check(),
        Err(DriveError::Interrupted) => {
            watch.check()?;
            Err(Error::Interrupted("finished iterations are kept".into()))
        }
        Err(DriveError::Analysis { report, .. }) => Err(Error::Analysis(report)),
        Err(DriveError::Mma(error)) => Err(Error::input(
            format!("the optimizer failed: {error}"),
            "check history.csv; a smaller `optimizer.mma.move_limit` may help",
        )),
        Err(DriveError::Run(error)) => Err(error.into()),
    }
}

/// The run's copy of its case: file and text.
fn case_of(directory: &RunDirectory) -> Result<(PathBuf, String), Error> {
    let path = directory.file("case.toml");
    let text = std::fs::read_to_string(&path).map_err(|source| RunError::Read { path: path.clone(), source })?;
    Ok((path, text))
}

fn read(path: &Path, text: &str) -> Result<Resolved, Error> {
    Ok(parse_case_with(text, &path.display().to_string(), &mesh_files(path))?)
}

#[pymethods]
impl Run {
    /// Opens the directory of a run.
    #[staticmethod]
    fn open(py: Python<'_>, directory: PathBuf) -> PyResult<Self> {
        detached(py, || Self::open_directory(&directory))
    }

    /// The directory.
    #[getter]
    fn directory(&self) -> PathBuf {
        self.directory.path().to_owned()
    }

    /// All evaluated designs, as a JSON list.
    fn history(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || {
            let checkpoint = Checkpoint::read(&self.directory)?;
            serde_json::to_string(&checkpoint.state.history).map_err(|error| Error::Internal(error.to_string()))
        })
    }

    /// The iteration of the design that is the result.
    fn result_iteration(&self, py: Python<'_>) -> PyResult<usize> {
        detached(py, || {
            if let Some(result) = ResultRecord::read(&self.directory)? {
                return Ok(result.iteration);
            }
            Ok(Checkpoint::read(&self.directory)?.state.history.len().saturating_sub(1))
        })
    }

    /// Names of the constraints, in the order of their values in the history.
    fn constraints(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        detached(py, || Ok(Checkpoint::read(&self.directory)?.state.constraints))
    }

    /// Densities of a design; the newest one without a number.
    #[pyo3(signature = (iteration=None))]
    fn density<'py>(&self, py: Python<'py>, iteration: Option<usize>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let density = detached(py, || Ok(design_density(&self.directory, &self.mesh, iteration)?))?;
        Ok(Vec::from(density).into_pyarray(py))
    }

    /// Draws a result as a PNG file; returns the name of the field.
    #[pyo3(signature = (file, field, step, iteration, view, deformed, threshold, smooth, bodies, size))]
    fn render(
        &self,
        py: Python<'_>,
        file: PathBuf,
        field: Option<String>,
        step: Option<usize>,
        iteration: Option<usize>,
        view: Option<String>,
        deformed: Option<f64>,
        threshold: Option<f64>,
        smooth: bool,
        bodies: Option<Vec<String>>,
        size: (u32, u32),
    ) -> PyResult<String> {
        detached(py, || {
            let shown = match (step, iteration) {
                (Some(step), _) => Shown::Step(step),
                (None, Some(iteration)) => Shown::Iteration(iteration),
                (None, None) => Shown::Newest,
            };
            let canvas = Canvas { width: size.0, height: size.1, ..Canvas::default() };
            let request =
                PictureRequest { field, shown, view, displacement_factor: deformed, threshold, smooth, bodies, canvas };
            let drawn = picture(&self.directory, &self.resolved.case, &self.mesh, &request).map_err(Failure::from)?;
            drawn.picture.save_png(&file).map_err(|error| match error {
                RenderError::Output(error) => Failure::from(error),
                other => slipstick::picture::PictureError::from(other).into(),
            })?;
            Ok(drawn.field)
        })
    }

    /// Writes the run as a web page; returns notes about it.
    fn report(&self, py: Python<'_>, file: PathBuf) -> PyResult<Vec<String>> {
        detached(py, || {
            let page = page(&self.directory, &self.resolved.case, &self.mesh, &PageOptions::default())?;
            write_atomically(&file, |writer| writer.write_all(page.html.as_bytes())).map_err(Failure::from)?;
            Ok(page.notes)
        })
    }

    /// Writes a design as a closed surface, in the format of the file's extension; returns
    /// threshold, volume of the surface and volume of the densities.
    #[pyo3(signature = (file, iteration, threshold, smooth, keep_surfaces, bodies))]
    fn export(
        &self,
        py: Python<'_>,
        file: PathBuf,
        iteration: Option<usize>,
        threshold: Option<f64>,
        smooth: usize,
        keep_surfaces: bool,
        bodies: Vec<String>,
    ) -> PyResult<(f64, f64, f64)> {
        detached(py, || {
            let length = self.resolved.case.units.length.as_deref();
            let extension = file.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
            if !["stl", "obj", "3mf", "vtu"].contains(&extension.as_str()) {
                let message = format!("{} ends neither in .stl, .obj, .3mf nor .vtu", file.display());
                return Err(Error::input(message, "give the file one of these extensions, which selects the format"));
            }
            if extension == "3mf" {
                unit_of_3mf(length).map_err(Failure::from)?;
            }
            let density = design_density(&self.directory, &self.mesh, iteration)?;
            let options = ExportOptions { threshold, smoothing: smooth, keep_surfaces, bodies };
            let export = design_surface(&self.mesh, &density, &options).map_err(Failure::from)?;
            let names: Vec<&str> = self.mesh.bodies.iter().map(|body| body.name.as_str()).collect();
            let written = match extension.as_str() {
                "stl" => write_stl(&file, &export.surface),
                "obj" => write_obj(&file, &export.surface, &names),
                "3mf" => write_3mf(&file, &export.surface, &names, length),
                _ => write_vtu(&file, &export.surface),
            };
            written.map_err(Failure::from)?;
            Ok((export.threshold, export.surface.volume(), export.density_volume))
        })
    }
}

impl Run {
    fn open_directory(path: &Path) -> Result<Self, Error> {
        let directory = RunDirectory::open(path)?;
        let (file, text) = case_of(&directory)?;
        let resolved = read(&file, &text)?;
        let mesh = build_mesh(&resolved.case).map_err(|error| Error::build(&error, &resolved.source_map))?;
        Ok(Self { directory, resolved: Arc::new(resolved), mesh })
    }
}
