//! Optimizations in a directory, and pictures, pages and surfaces of their results.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use slipstick::case::Resolved;
use slipstick::design::ElementValues;
use slipstick::export::{
    ExportOptions, design_surface, unit_of_3mf, unit_of_length, write_3mf, write_obj, write_stl, write_vtu,
};
use slipstick::mesh::Mesh;
use slipstick::optimize::Optimization;
use slipstick::output::write_atomically;
use slipstick::part::{Solids, solids, write_step};
use slipstick::picture::{PictureRequest, Shown, picture};
use slipstick::render::{Canvas, RenderError};
use slipstick::report::{PageOptions, page};
use slipstick::run::{Checkpoint, ExitState, ResultRecord, RunDirectory, RunPart, RunWarning, design_density};
use slipstick_service::check;
use slipstick_service::failure::Failure;
use slipstick_service::optimization::{
    self as service, RecordedOptimization, Resume, Resumed, SECTIONS, SECTIONS_OF_OWN,
};
use slipstick_service::run::OpenRun;

use crate::arrays;
use crate::case::Case;
use crate::compute::raised;
use crate::errors::{Error, detached};
use crate::host::Interpreter;
use crate::interrupt::Watch;
use crate::quantity::take_raised;
use crate::responses::{Own, Responses, described};

/// The directory of a run, with its case.
#[pyclass(frozen, module = "slipstick._slipstick")]
pub struct Run {
    directory: RunDirectory,
    resolved: Arc<Resolved>,
    mesh: Mesh,
    /// What the optimization that made it warns of.
    #[pyo3(get)]
    warnings: Vec<String>,
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
        let mut watch = Watch::new(progress, callback);
        let host = Interpreter { line: command.clone(), interrupt: Some(watch.interrupt()), ..Interpreter::default() };
        let prepared = prepare(&host, resolved, density, responses, iterations);
        // what an interrupted check says is not why it ended
        watch.check()?;
        let mut optimization = prepared?;
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
        let recorded = RecordedOptimization::start(optimization, resolved, Some(run), record.as_deref())?;
        watch.keep_in(&directory, false, &host);
        let warnings = finish(recorded, watch)?;
        Ok(Run { warnings, ..Run::open_directory(&directory)? })
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
        let (responses, own) = Responses::of(own);
        let mut watch = Watch::new(progress, callback);
        let host = Interpreter { line: command, interrupt: Some(watch.interrupt()), ..Interpreter::default() };
        let sections = sections(&responses);
        let request = Resume { results: &directory, iterations, responses: own.as_deref(), sections };
        let resumed = service::resume(&host, &request, |problem| responses.apply(problem));
        // what an interrupted check says is not why it ended
        watch.check()?;
        let warnings = match resumed? {
            Resumed::InProgress(recorded) => {
                watch.keep_in(&directory, true, &host);
                finish(*recorded, watch)?
            }
            // nothing was left to do; the design is as it was
            Resumed::Complete { directory, .. } => {
                let kept = RunWarning::read(&RunDirectory::open(&directory)?)?;
                kept.into_iter().filter(|warning| warning.of_result).map(|warning| warning.message).collect()
            }
        };
        Ok(Run { warnings, ..Run::open_directory(&directory)? })
    })
}

/// Sections that a case needs to be optimized with these responses.
fn sections(responses: &Responses) -> &'static [&'static str] {
    if responses.have_objective() { SECTIONS_OF_OWN } else { SECTIONS }
}

/// An optimization of a case at its start, from these densities if given.
fn prepare(
    host: &Interpreter,
    resolved: &Resolved,
    density: Option<ElementValues>,
    responses: Responses,
    iterations: Option<usize>,
) -> Result<Optimization, Error> {
    let (_, mut problem) = check::prepare(host, resolved.clone(), sections(&responses), iterations)?;
    responses.apply(&mut problem)?;
    if let Some(density) = density {
        // the case sets the densities of passive elements and of those outside the design
        problem.start_from(&density);
    }
    Ok(service::optimization(resolved, problem)?)
}

/// Runs an optimization to its end and records how it ended. Returns what its designs warn of.
fn finish(mut recorded: RecordedOptimization, mut watch: Watch) -> Result<Vec<String>, Error> {
    // of an earlier call
    drop(take_raised());
    recorded.optimization.problem.analysis.linear.set_interrupt(Some(watch.interrupt()));
    watch.expect(&recorded.optimization);
    let (driven, outcome) = recorded.drive(&mut watch);
    // an exception of a quantity, whose value was then not a number; a callback may fail at the last
    // design, when nothing is left to stop
    let of_python = raised().and_then(|()| match &outcome {
        Ok(_) | Err(Failure::Interrupted { .. }) => watch.check(),
        Err(_) => Ok(()),
    });
    let outcome = of_python.and_then(|()| Ok(outcome.map(drop)?));
    if outcome.is_ok() {
        watch.judge_result(&driven.optimization, driven.run());
    }
    let (exit, message) = match &outcome {
        Ok(()) => (ExitState::Finished, None),
        Err(Error::Interrupted(message)) => (ExitState::Interrupted, Some(message.clone())),
        Err(Error::Python(error)) => (ExitState::Interrupted, Some(error.to_string())),
        Err(Error::Analysis(report)) => (ExitState::Failed, Some(report.to_string())),
        Err(Error::Input { message, .. } | Error::Internal(message)) => (ExitState::Failed, Some(message.clone())),
        Err(Error::Case(_) | Error::Os { .. }) => (ExitState::Failed, None),
    };
    let written = driven.end_as(exit, message);
    outcome?;
    written?;
    Ok(watch.warnings)
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
    #[pyo3(signature = (file, field, step, iteration, view, deformed, threshold, smooth, bodies, plain, size))]
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
        plain: bool,
        size: (u32, u32),
    ) -> PyResult<String> {
        detached(py, || {
            let shown = match (step, iteration) {
                (Some(step), _) => Shown::Step(step),
                (None, Some(iteration)) => Shown::Iteration(iteration),
                (None, None) => Shown::Newest,
            };
            let canvas = Canvas { width: size.0, height: size.1, ..Canvas::default() };
            let request = PictureRequest {
                field,
                shown,
                view,
                displacement_factor: deformed,
                threshold,
                smooth,
                bodies,
                marks: !plain,
                canvas,
            };
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

    /// The interactive view of the run as a web page.
    fn view(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || {
            let options = PageOptions { view_only: true, ..PageOptions::default() };
            Ok(page(&self.directory, &self.resolved.case, &self.mesh, &options)?.html)
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
            if !["stl", "obj", "3mf", "vtu", "step", "stp"].contains(&extension.as_str()) {
                let message = format!("{} ends neither in .stl, .obj, .3mf, .vtu, .step nor .stp", file.display());
                return Err(Error::input(message, "give the file one of these extensions, which selects the format"));
            }
            if extension == "3mf" {
                unit_of_3mf(length).map_err(Failure::from)?;
            }
            let density = design_density(&self.directory, &self.mesh, iteration)?;
            let options = ExportOptions { threshold, smoothing: smooth, keep_surfaces, bodies };
            if ["step", "stp"].contains(&extension.as_str()) {
                unit_of_length(length, "STEP").map_err(Failure::from)?;
                let Solids { bodies, export } =
                    solids(&self.resolved.case, &self.mesh, &density, &options, None, &[]).map_err(Failure::from)?;
                write_step(&file, &bodies, length).map_err(Failure::from)?;
                let volume = bodies.iter().map(|body| body.volume).sum();
                return Ok((export.threshold, volume, export.density_volume));
            }
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
        let OpenRun { directory, resolved, mesh } = OpenRun::open(path)?;
        Ok(Self { directory, resolved: Arc::new(resolved), mesh, warnings: Vec::new() })
    }
}
