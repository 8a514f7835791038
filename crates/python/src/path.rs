//! The states of a load path.

use std::ffi::CString;
use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use slipstick::analysis::{Designs, LoadCases};
use slipstick::linalg::Alone;
use slipstick::model::{ContactResults, Design};
use slipstick::path::PathState;
use slipstick::quantities::{Quantities, Recording, quantities};
use slipstick::report::{PageOptions, page};
use slipstick::run::{ExitState, PathWriter, Run, RunDirectory, RunPart, write_densities};
use slipstick_service::failure::Failure;

use crate::arrays;
use crate::built::Built;
use crate::errors::{Error, detached};
use crate::quantity::take_raised;

/// A marched load path.
#[pyclass(frozen, module = "slipstick._slipstick")]
pub struct Path {
    built: Arc<Built>,
    /// The model at the densities of the path.
    design: Design,
    /// The models of its load cases.
    cases: LoadCases,
    path: slipstick::path::Path,
    value: Option<f64>,
}

/// Names, units, and a row of values for each load step.
type Table<'py> = (Vec<String>, Vec<&'static str>, Bound<'py, PyArray2<f64>>);

#[pymethods]
impl Path {
    /// θ, if the case has an objective.
    #[getter]
    fn value(&self) -> Option<f64> {
        self.value
    }

    /// For every load step: load case, pseudo-time within it, increments, Newton iterations.
    fn steps(&self) -> Vec<(Option<String>, f64, usize, usize)> {
        let mut steps = Vec::new();
        let (mut increments, mut iterations) = (0, 0);
        let names = self.built.case.case.load_case_names();
        for state in self.path.states.iter().filter(|state| !state.rest) {
            increments += 1;
            iterations += state.report.iterations.len();
            if state.completes.is_some() {
                let case = state.time.name(&names);
                steps.push((case.map(str::to_owned), state.time.t, increments, iterations));
                (increments, iterations) = (0, 0);
            }
        }
        steps
    }

    /// Displacements of all nodes at the end of a load step, from 1.
    fn displacement<'py>(&self, py: Python<'py>, step: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (_, state) = self.state(step).map_err(|error| error.raise(py))?;
        let unknowns = &state.state.unknowns[..self.design.model().prescribed().fixed().len()];
        Ok(arrays::matrix(py, unknowns.to_vec(), 3))
    }

    /// Contact of all slave nodes at the end of a load step, from 1: a dictionary of arrays.
    fn contact<'py>(&self, py: Python<'py>, step: usize) -> PyResult<Bound<'py, PyDict>> {
        let results = detached(py, || {
            let (index, state) = self.state(step)?;
            let [previous, now] =
                [if state.rest { index } else { index - 1 }, index].map(|i| self.path.state(i, &Alone));
            let design = self.cases.design_at(&self.design, state.time);
            let results = design.contact_results(&previous, &now, state.time);
            results.map_err(|error| Error::Internal(format!("a converged state cannot be evaluated: {error}")))
        })?;
        self.arrays(py, &results)
    }

    /// The quantities of supports, pairs, bodies and case at every load step.
    fn quantities<'py>(&self, py: Python<'py>) -> PyResult<Table<'py>> {
        let found: Quantities = detached(py, || {
            let mut problem = self.built.lock()?;
            let analysis = &mut problem.analysis;
            let own = (analysis.design.clone(), analysis.cases.clone());
            (analysis.design, analysis.cases) = (self.design.clone(), self.cases.clone());
            let found = quantities(&problem, &self.path);
            (problem.analysis.design, problem.analysis.cases) = own;
            take_raised().map_or(Ok(found), |error| Err(Error::Python(error)))
        })?;
        let losses = found.losses.iter().map(|loss| format!("{loss}; {}", loss.help()));
        let released = found.released.iter().map(|released| format!("{released}; {}", released.help()));
        let coarse = found.coarse_friction.iter().map(|work| format!("{work}; {}", work.help()));
        let unbalanced = found.imbalance.iter().map(|imbalance| format!("{imbalance}; {}", imbalance.help()));
        let rough = found.rough_pressures.iter().map(|pressure| format!("{pressure}; {}", pressure.help()));
        let on_void = found.on_void.iter().map(|contact| format!("{contact}; {}", contact.help()));
        for message in losses.chain(coarse).chain(rough).chain(on_void).chain(released).chain(unbalanced) {
            let warning = py.import("slipstick")?.getattr("SlipstickWarning")?;
            let message = CString::new(message).unwrap_or_default();
            PyErr::warn(py, &warning, &message, 2)?;
        }
        let names = found.names.iter().map(|name| name.name.clone()).collect();
        let units = found.names.iter().map(|name| name.unit).collect();
        let rows: Vec<f64> = found.rows.iter().filter(|row| row.step > 0).flat_map(|row| row.values.clone()).collect();
        Ok((names, units, arrays::matrix(py, rows, found.names.len())))
    }

    /// The interactive view of the path as a web page; the folder, which must be empty, takes the files of a run.
    fn view(&self, py: Python<'_>, folder: PathBuf, command: Vec<String>) -> PyResult<String> {
        detached(py, || {
            let problem = self.built.lock()?;
            let designs = Designs::new(&self.design, &self.cases);
            let part = RunPart::starting(command, rayon::current_num_threads());
            let resolved = &self.built.case;
            // the page needs no copies of mesh files
            let run = Run::start(&folder, resolved, FilePath::new("case.toml"), &|_| Ok(Vec::new()), part, false)?;
            let steps = problem.analysis.times.len() / self.cases.count();
            let recording = Recording::new(&problem.mesh, &problem.quantities, designs, steps);
            let mut writer = PathWriter::new(Some(run.directory()), &problem.mesh, designs, recording);
            for (index, at) in self.path.states.iter().enumerate() {
                writer.add(at.into(), self.path.state(index, &Alone), None);
            }
            writer.finish().1?;
            let file = run.directory().file("design.csv");
            write_densities(&file, &problem.mesh, self.design.density(), None, None).map_err(Failure::from)?;
            let directory = RunDirectory::open(&folder)?;
            run.end(ExitState::Finished, None)?;
            let options = PageOptions { view_only: true, ..PageOptions::default() };
            Ok(page(&directory, &resolved.case, &problem.mesh, &options)?.html)
        })
    }

    /// Densities of the path.
    fn density<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        Vec::from(self.design.density().clone()).into_pyarray(py)
    }
}

impl Path {
    pub(crate) fn new(
        built: Arc<Built>,
        (design, cases): (Design, LoadCases),
        path: slipstick::path::Path,
        value: Option<f64>,
    ) -> Self {
        Self { built, design, cases, path, value }
    }

    /// The state that completes a step, with its index.
    fn state(&self, step: usize) -> Result<(usize, &PathState), Error> {
        let mut states = self.path.states.iter().enumerate();
        let found = states.find(|(_, state)| state.completes == Some(step));
        found.ok_or_else(|| {
            let cure = format!("the path has load steps 1 to {}", self.path.steps);
            Error::input(format!("there is no load step {step}"), cure)
        })
    }

    fn arrays<'py>(&self, py: Python<'py>, results: &ContactResults) -> PyResult<Bound<'py, PyDict>> {
        let nodes = &results.nodes;
        let interfaces = self.design.model().interfaces().iter().enumerate();
        let pair = interfaces.flat_map(|(i, model)| model.interface.slave_nodes().iter().map(move |_| i as u32));
        let of = |node: u32| 3 * node as usize;
        let vectors = |values: &[f64]| -> Vec<f64> {
            nodes.iter().flat_map(|at| values[of(at.node)..of(at.node) + 3].to_vec()).collect()
        };
        let contact = PyDict::new(py);
        contact.set_item("node", arrays::numbers(py, nodes.iter().map(|at| at.node)))?;
        contact.set_item("pair", arrays::numbers(py, pair))?;
        contact.set_item("status", nodes.iter().map(|at| at.status.code()).collect::<Vec<u8>>().into_pyarray(py))?;
        let numbers: [(&str, Vec<f64>); 3] = [
            ("pressure", nodes.iter().map(|at| results.pressure[at.node as usize]).collect()),
            ("gap", nodes.iter().map(|at| at.gap.unwrap_or(f64::NAN)).collect()),
            ("area", nodes.iter().map(|at| at.covered_area).collect()),
        ];
        for (name, values) in numbers {
            contact.set_item(name, values.into_pyarray(py))?;
        }
        contact.set_item("traction", arrays::matrix(py, vectors(&results.traction), 3))?;
        contact.set_item("force", arrays::matrix(py, vectors(&results.force), 3))?;
        contact.set_item("slip", arrays::matrix(py, nodes.iter().flat_map(|at| at.slip).collect(), 2))?;
        Ok(contact)
    }
}
