//! Problems: mesh, forward analysis, gradients and their check.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use slipstick::analysis::Gradients;
use slipstick::build::build;
use slipstick::case::Resolved;
use slipstick::design::quantity::Quantity;
use slipstick::design::{ElementValues, ObservedSteps, Response, Role, Term};
use slipstick::mesh::{Element, Mesh};
use slipstick::model::{LoadTime, Parameter};
use slipstick::overlaps::overlaps;
use slipstick::run::load_design;
use slipstick::verify::{VerifyError, VerifyOptions, verify_gradient};
use slipstick_service::check::volume_fraction;

use crate::arrays;
use crate::built::Built;
use crate::compute::{
    add_quantity, complete, forward, in_cases, no_objective, notice, noticed, observing, response, watched,
};
use crate::errors::{Error, detached};
use crate::gradient::Linearization;
use crate::parameters::{name_of, named, set_parameter};
use crate::path::Path;
use crate::quantity::defined;

/// Densities, and design variables.
type LoadedDesign<'py> = (Bound<'py, PyArray1<f64>>, Option<Bound<'py, PyArray1<f64>>>);

/// A built problem; only one thread at a time computes with it.
#[pyclass(frozen, module = "slipstick._slipstick")]
pub struct Problem {
    pub(crate) built: Arc<Built>,
    resolved: Arc<Resolved>,
    /// The case as read, before `with_parameters` changed any values.
    read: Arc<Resolved>,
    mesh: Arc<Mesh>,
    initial_density: ElementValues,
    roles: Vec<Role>,
}

/// First index and the one after the last.
type Bounds = (usize, usize);

/// A value, its derivatives, and a notice.
type ValueAndGradient<'py> = (f64, Bound<'py, PyArray1<f64>>, Vec<(&'static str, String, f64)>, Option<String>);

#[pymethods]
impl Problem {
    /// Coordinates of all nodes.
    fn nodes<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::table(py, &self.mesh.nodes).into_any()
    }

    /// Nodes and numbers of the elements with `nodes` nodes.
    fn elements<'py>(&self, py: Python<'py>, nodes: usize) -> (Bound<'py, PyAny>, Bound<'py, PyAny>) {
        let of = |element: &&Element| element.nodes().len() == nodes;
        let entries = self.mesh.elements.iter().filter(of).flat_map(|e| e.nodes()).map(|&n| i64::from(n)).collect();
        let numbered = self.mesh.elements.iter().enumerate().filter(|(_, element)| of(element));
        let numbers = arrays::numbers(py, numbered.map(|(number, _)| number as u32));
        (arrays::matrix(py, entries, nodes).into_any(), numbers.into_any())
    }

    /// Name, elements and nodes of every body, as ranges.
    fn bodies(&self) -> Vec<(String, Bounds, Bounds)> {
        let of = |body: &slipstick::mesh::Body| {
            (body.name.clone(), (body.elements.start, body.elements.end), (body.nodes.start, body.nodes.end))
        };
        self.mesh.bodies.iter().map(of).collect()
    }

    /// Nodes of every node set and surface.
    fn sets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let sets = PyDict::new(py);
        for (name, nodes) in &self.mesh.node_sets {
            sets.set_item(name, arrays::numbers(py, nodes.iter().copied()))?;
        }
        for (name, surface) in &self.mesh.surfaces {
            sets.set_item(name, arrays::numbers(py, surface.nodes()))?;
        }
        Ok(sets)
    }

    /// Corners of every facet of every surface, −1 for the fourth of a triangle; a face of a
    /// second-order element is one facet.
    fn surfaces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let surfaces = PyDict::new(py);
        for (name, surface) in &self.mesh.surfaces {
            let faces = self.mesh.faces_of_surface(surface);
            let corners = faces.iter().flat_map(|face| {
                let corners = if matches!(face.len(), 3 | 6) { 3 } else { 4 };
                (0..4).map(move |c| if c < corners { i64::from(face[c]) } else { -1 })
            });
            surfaces.set_item(name, arrays::matrix(py, corners.collect(), 4))?;
        }
        Ok(surfaces)
    }

    /// Densities at the start.
    fn initial_density<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        Vec::from(self.initial_density.clone()).into_pyarray(py)
    }

    /// Densities of an earlier run or of a table, and its design variables if it lists them.
    fn load_design<'py>(&self, py: Python<'py>, results: PathBuf) -> PyResult<LoadedDesign<'py>> {
        let designed = self.resolved.case.design.as_ref().map_or(&[][..], |design| &design.bodies);
        let found = detached(py, || Ok(load_design(&results, &self.mesh, designed)?))?;
        let array = |values: ElementValues| Vec::from(values).into_pyarray(py);
        Ok((array(found.density), found.variables.map(array)))
    }

    /// Numbers of the elements whose density is a design variable.
    fn designed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let designed = self.roles.iter().enumerate().filter(|(_, role)| **role == Role::Designed);
        arrays::numbers(py, designed.map(|(e, _)| e as u32))
    }

    /// Number of elements.
    #[getter]
    fn element_count(&self) -> usize {
        self.mesh.elements.len()
    }

    /// Ends of the load steps in pseudo-time.
    fn times(&self, py: Python<'_>) -> PyResult<Vec<f64>> {
        let axis = |times: &[LoadTime]| times.iter().map(|time| time.on_axis()).collect();
        detached(py, || Ok(axis(&self.built.lock()?.analysis.times)))
    }

    /// Names of the load cases; empty if there is only one without a name.
    fn load_cases(&self) -> Vec<String> {
        self.resolved.case.load_case_names()
    }

    /// Names of the quantities of the case, then of those that were added.
    fn quantities(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let name = |quantity: &Arc<dyn Quantity>| quantity.name().to_owned();
        detached(py, || Ok(self.built.lock()?.quantities.iter().map(name).collect()))
    }

    /// Adds a quantity, once its derivatives are known to be right: its name, powers of force and
    /// length, what it reads (see `Definition`), and whether it accumulates.
    fn add(
        &self,
        py: Python<'_>,
        adapter: Py<PyAny>,
        name: String,
        dimension: (i32, i32),
        reads: Vec<String>,
        accumulates: bool,
    ) -> PyResult<()> {
        let quantity = defined((adapter, name, dimension, reads, accumulates));
        detached(py, || {
            let mut problem = self.built.lock()?;
            add_quantity(&mut problem, quantity)?;
            let added = problem.quantities.last().cloned();
            self.built.added().extend(added);
            Ok(())
        })
    }

    /// Kind, place in the case and value of every parameter, in the order of their derivatives.
    fn parameters(&self, py: Python<'_>) -> PyResult<Vec<(&'static str, String, f64)>> {
        let case = &self.resolved.case;
        let names = detached(py, || Ok(self.built.lock()?.analysis.model().parameter_names()))?;
        let of = |parameter: Parameter| {
            let (kind, place) = name_of(case, parameter);
            let value = match parameter {
                Parameter::Friction { interface } => case.contacts[interface].friction,
                Parameter::YoungsModulus { body } => case.bodies[body].material.youngs_modulus(),
                Parameter::Expansion { body } => case.bodies[body].thermal_expansion.unwrap_or(0.0),
                Parameter::Amplitude { .. }
                | Parameter::Preload { .. }
                | Parameter::Load { .. }
                | Parameter::Temperature { .. } => 1.0,
            };
            (kind, place, value)
        };
        Ok(names.into_iter().map(of).collect())
    }

    /// Rebuilds the problem with new parameter values, keyed as in
    /// [`parameters`](Self::parameters); added quantities are kept.
    fn with_parameters(&self, py: Python<'_>, values: Vec<(String, String, f64)>) -> PyResult<Self> {
        detached(py, || {
            let mut resolved = (*self.read).clone();
            let names = self.built.lock()?.analysis.model().parameter_names();
            for (kind, place, value) in values {
                let of = |parameter: &&Parameter| name_of(&self.resolved.case, **parameter) == (&kind, place.clone());
                let parameter = names.iter().find(of);
                let parameter = parameter.ok_or_else(|| Error::Internal(format!("no parameter {kind} of {place}")))?;
                set_parameter(&mut resolved.case, *parameter, value)?;
            }
            let map = &resolved.source_map;
            let mut problem = build(&resolved.case).map_err(|error| Error::build(&error, map))?;
            let added = self.built.added().clone();
            problem.quantities.extend(added.iter().cloned());
            let new = Self { read: self.read.clone(), ..Self::new(Arc::new(resolved), problem) };
            *new.built.added() = added;
            Ok(new)
        })
    }

    /// Filled fraction of the design domain; `None` without a design.
    fn volume_fraction(&self, py: Python<'_>, density: PyReadonlyArray1<'_, f64>) -> PyResult<Option<f64>> {
        let density = arrays::densities(&density);
        detached(py, || Ok(volume_fraction(&*self.built.lock()?, &density)))
    }

    /// Refuses a case without an objective.
    fn require_objective(&self, py: Python<'_>) -> PyResult<()> {
        if self.has_objective() { Ok(()) } else { Err(no_objective().raise(py)) }
    }

    /// Marches the load path, optionally with another coefficient of friction in all pairs.
    #[pyo3(signature = (density, progress=None, friction=None))]
    fn solve(
        &self,
        py: Python<'_>,
        density: PyReadonlyArray1<'_, f64>,
        progress: Option<Py<PyAny>>,
        friction: Option<f64>,
    ) -> PyResult<(Path, Option<String>)> {
        let density = arrays::densities(&density);
        detached(py, || {
            let mut problem = self.built.lock()?;
            let models =
                |problem: &slipstick::build::Problem| (problem.analysis.design.clone(), problem.analysis.cases.clone());
            let own = models(&problem);
            if let Some(friction) = friction {
                problem.analysis.set_friction(friction);
            }
            let forward = watched(&mut problem, progress, |problem, watch| {
                let forward = problem.analysis.forward_only(&density, watch);
                complete(problem, forward)
            });
            let found = forward.as_ref().map_or_else(|_| Vec::new(), |forward| overlaps(&problem, &forward.path));
            let used = models(&problem);
            if friction.is_some() {
                (problem.analysis.design, problem.analysis.cases) = own;
            }
            let forward = forward?;
            let value = self.has_objective().then_some(forward.value);
            let notice = noticed(forward.notice.as_ref().map(ToString::to_string), &found);
            Ok((Path::new(self.built.clone(), used, forward.path, value), notice))
        })
    }

    /// θ and its derivatives with respect to densities and, if requested, parameters.
    #[pyo3(signature = (density, parameters=false, progress=None))]
    fn value_and_gradient<'py>(
        &self,
        py: Python<'py>,
        density: PyReadonlyArray1<'_, f64>,
        parameters: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<ValueAndGradient<'py>> {
        let density = arrays::densities(&density);
        let (value, gradients, notice) = detached(py, || {
            let mut problem = self.built.lock()?;
            if problem.analysis.objective.is_none() {
                return Err(no_objective());
            }
            watched(&mut problem, progress, |problem, watch| {
                let forward = forward(problem, &density, watch)?;
                let analysis = &mut problem.analysis;
                // as `optimize` does, without derivatives that were not requested
                let gradients = match parameters {
                    true => analysis.gradients(&forward),
                    false => analysis.gradient(&forward).map(|density| Gradients { density, parameters: Vec::new() }),
                };
                let gradients = gradients.map_err(|error| Error::analysis(problem, &error))?;
                let notice = noticed(notice(&forward), &overlaps(problem, &forward.path));
                Ok((forward.value, gradients, notice))
            })
        })?;
        let parameters = named(&self.resolved.case, &gradients);
        Ok((value, Vec::from(gradients.density).into_pyarray(py), parameters, notice))
    }

    /// The values of quantities at every step, and their linearization.
    #[pyo3(signature = (density, names, progress=None))]
    fn linearize(
        &self,
        py: Python<'_>,
        density: PyReadonlyArray1<'_, f64>,
        names: Vec<String>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Linearization> {
        let density = arrays::densities(&density);
        detached(py, || {
            let mut problem = self.built.lock()?;
            let response = response(&problem, &names)?;
            let forward = observing(&mut problem, &response, |problem| {
                watched(problem, progress, |problem, watch| forward(problem, &density, watch))
            })?;
            Ok(Linearization::new(self.built.clone(), response, forward))
        })
    }

    /// Compares a gradient with differences; returns the comparison as JSON. `name` is that of a
    /// quantity, whose value at the last step is differentiated; without it, the objective is.
    #[pyo3(signature = (density, name, directions, elements, step, halvings, tolerance, progress=None))]
    fn check_gradient(
        &self,
        py: Python<'_>,
        density: PyReadonlyArray1<'_, f64>,
        name: Option<String>,
        directions: usize,
        elements: usize,
        step: f64,
        halvings: u32,
        tolerance: f64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<String> {
        let density = arrays::densities(&density);
        let designed: Vec<u32> =
            (0..).zip(&self.roles).filter(|(_, role)| **role == Role::Designed).map(|(e, _)| e).collect();
        let options = VerifyOptions { directions, elements, step, halvings, tolerance, ..VerifyOptions::default() };
        detached(py, || {
            let mut problem = self.built.lock()?;
            let response = match &name {
                Some(name) => {
                    let Term { quantity, .. } = response(&problem, std::slice::from_ref(name))?.terms()[0].clone();
                    in_cases(&problem, Response::of(quantity, ObservedSteps::Last, 1.0))
                }
                None => problem.analysis.objective.clone().ok_or_else(no_objective)?,
            };
            let check = observing(&mut problem, &response, |problem| {
                watched(problem, progress, |problem, watch| {
                    verify_gradient(&mut problem.analysis, &density, &designed, &options, watch).map_err(|error| {
                        match error {
                            VerifyError::Analysis(error) => Error::analysis(problem, &error),
                            VerifyError::Rounding(rounding) => {
                                let message = format!("nothing can be compared: {rounding}");
                                Error::input(message, rounding.cures().join("; "))
                            }
                            VerifyError::Interrupted => Error::Interrupted(String::new()),
                        }
                    })
                })
            })?;
            serde_json::to_string(&check).map_err(|error| Error::Internal(error.to_string()))
        })
    }
}

impl Problem {
    /// Whether the case has an objective.
    fn has_objective(&self) -> bool {
        self.resolved.source_map.contains("objective")
    }

    pub(crate) fn new(resolved: Arc<Resolved>, problem: slipstick::build::Problem) -> Self {
        let roles = problem.variables().map_or(Vec::new(), |variables| variables.roles().to_vec());
        Self {
            mesh: Arc::new(problem.mesh.clone()),
            initial_density: problem.initial_density().clone(),
            roles,
            built: Arc::new(Built::new(problem, resolved.clone())),
            read: resolved.clone(),
            resolved,
        }
    }
}

/// Sets the number of threads for all computations of the process, and starts them.
#[pyfunction]
pub fn set_threads(py: Python<'_>, threads: usize) -> PyResult<()> {
    detached(py, || {
        if threads == 0 {
            return Err(Error::input("threads is 0", "give at least 1"));
        }
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(|_| {
            let cure = "call it before anything is computed, or set RAYON_NUM_THREADS before Python starts";
            Error::input("the threads are already running", cure)
        })
    })
}

/// Number of compute threads; starts them if necessary.
#[pyfunction]
pub fn threads() -> usize {
    rayon::current_num_threads()
}
