//! The load path of a design as files for ParaView.

use slipstick_path::{MarchFailure, Path, PathState, StepState};

use super::first::agree;
use super::tables::{ContactTable, write_quantities};
use super::{RunDirectory, RunError, on_first};
#[cfg(feature = "vtkhdf")]
use crate::output::VtkHdf;
use crate::output::{OutputError, Pvd, fields};
use slipstick_model::analysis::pair_results;
use slipstick_model::model::ContactResults;
use slipstick_model::problem::Problem;
use slipstick_model::quantities::{Quantities, Slipped, quantities};

/// Writes `path_XXXX.vtu` for every completed load step, including step 0, `path.pvd`, on request
/// `path.vtkhdf`, `contact.csv` ([`ContactTable`]) and `quantities.csv` ([`write_quantities`]);
/// returns the quantities. All ranks call it; `run` is that of the first rank, if it keeps one.
///
/// The slip increment of a step that was cut back is that of its last sub-step. If a state can no
/// longer be evaluated (which is rare, because it converged), its contact fields are left out.
///
/// # Errors
/// [`RunError::Output`] on the first rank, [`RunError::FirstRank`] on the others.
pub fn write_path(run: Option<&RunDirectory>, problem: &Problem, path: &Path) -> Result<Quantities, RunError> {
    let (mesh, analysis) = (&problem.mesh, &problem.analysis);
    let ranks = analysis.model().share().ranks().clone();
    let quantities = quantities(problem, path);
    let written = path.with_states(&*ranks, |state| {
        let Some(run) = run else { return Ok(()) };
        let steps = path.states.iter().enumerate().filter(|(index, at)| step_of(*index, at).is_some()).count();
        let mut files = Files::new(run, problem).with_series(steps)?;
        let (mut collection, mut forces) = (Pvd::default(), ContactTable::new(mesh));
        let mut last = None;
        for (index, at) in path.states.iter().enumerate() {
            let Some(step) = step_of(index, at) else { continue };
            let now = state(index);
            // usually the one that was written last
            let before = last.take().filter(|(of, _)| of + 1 == index).map(|(_, state)| state);
            let previous = match before {
                _ if at.rest => now.clone(),
                Some(before) => before,
                None => state(index - 1),
            };
            let contact = analysis.design_at(at.time).contact_results(&previous, &now, at.time).unwrap_or_default();
            let name = RunDirectory::numbered("path", step);
            let slipped = quantities.rows.iter().find(|row| row.step == step).map_or(&[][..], |row| &row.slipped);
            files.save(&name, at.time, &now, (&contact, slipped))?;
            collection.add(at.time, run.in_series(&name))?;
            // a state that cannot be evaluated has no results
            if !contact.nodes.is_empty() {
                forces.add(step, at.time, &pair_results(analysis.model(), &contact));
            }
            last = Some((index, now));
        }
        collection.save(&run.file("path.pvd"))?;
        forces.save(run)?;
        write_quantities(run, &quantities)?;
        Ok(files.finish()?)
    });
    agree(&*ranks, written)?;
    Ok(quantities)
}

/// The load step that a state of a path completes; its first state is step 0.
fn step_of(index: usize, at: &PathState) -> Option<usize> {
    at.completes.or((index == 0).then_some(0))
}

/// Writes the results of a failed march, also on several ranks: the completed load steps, as
/// [`write_path`] does; then the last converged sub-step, if it does not complete a step; and
/// `failure.vtu`, the failing iterate. Returns whether the iterate is finite and was written. All
/// ranks call it; `run` is that of the first rank, if it keeps one.
///
/// # Errors
/// [`RunError::Output`] on the first rank, [`RunError::FirstRank`] on the others.
pub fn write_failure(run: Option<&RunDirectory>, problem: &Problem, failure: &MarchFailure) -> Result<bool, RunError> {
    write_path(run, problem, &failure.path)?;
    let written = on_first(&**problem.analysis.model().share().ranks(), || {
        run.map_or(Ok(false), |run| write_last(run, problem, failure))
    })?;
    Ok(written.unwrap_or(false))
}

/// Writes the last converged sub-step, if it does not complete a step, and the failing iterate, if
/// it is finite.
fn write_last(run: &RunDirectory, problem: &Problem, failure: &MarchFailure) -> Result<bool, RunError> {
    let Some(last) = failure.path.states.last() else { return Ok(false) };
    let design = problem.analysis.design_at(failure.increment.1);
    if last.completes.is_none() && failure.path.states.len() > 1 {
        // the last two states are complete on every rank
        let previous = &failure.path.states[failure.path.states.len() - if last.rest { 1 } else { 2 }].state;
        let contact = design.contact_results(previous, &last.state, last.time).unwrap_or_default();
        let name = RunDirectory::numbered("path", failure.step);
        Files::new(run, problem).save(&name, last.time, &last.state, (&contact, &[]))?;
    }
    let complete = failure.iterate.len() == last.state.unknowns.len();
    if !complete || failure.iterate.iter().any(|value| !value.is_finite()) {
        return Ok(false);
    }
    let iterate = StepState { unknowns: failure.iterate.clone(), history: last.state.history.clone() };
    let contact = design.contact_results(&last.state, &iterate, failure.increment.1).unwrap_or_default();
    Files::whole(run, problem).save("failure.vtu", failure.increment.1, &iterate, (&contact, &[]))?;
    Ok(true)
}

/// Data needed to write the states of a run.
struct Files<'a> {
    run: &'a RunDirectory,
    problem: &'a Problem,
    /// The piece of every element, if meshes are also written in pieces.
    pieces: Option<Vec<u32>>,
    /// The file of the whole path, if it is wanted.
    #[cfg(feature = "vtkhdf")]
    series: Option<VtkHdf<'a>>,
}

impl<'a> Files<'a> {
    fn new(run: &'a RunDirectory, problem: &'a Problem) -> Self {
        let pieces = run.pieces(problem.analysis.model().share(), problem.mesh.elements.len());
        Self { pieces, ..Self::whole(run, problem) }
    }

    /// Files that are not written in pieces.
    fn whole(run: &'a RunDirectory, problem: &'a Problem) -> Self {
        Self {
            run,
            problem,
            pieces: None,
            #[cfg(feature = "vtkhdf")]
            series: None,
        }
    }

    /// The states that are saved next are the `steps` steps of the path.
    #[cfg_attr(not(feature = "vtkhdf"), expect(unused_variables))]
    fn with_series(self, steps: usize) -> Result<Self, OutputError> {
        #[cfg(feature = "vtkhdf")]
        if self.run.vtkhdf() {
            let series = Some(VtkHdf::create(&self.run.file("path.vtkhdf"), &self.problem.mesh, steps)?);
            return Ok(Self { series, ..self });
        }
        Ok(self)
    }

    /// Completes the file of the whole path.
    fn finish(self) -> Result<(), OutputError> {
        #[cfg(feature = "vtkhdf")]
        if let Some(series) = self.series {
            return series.finish();
        }
        Ok(())
    }

    /// Writes a state with its contact results and the slip of its slave nodes.
    fn save(
        &mut self,
        name: &str,
        time: f64,
        state: &StepState,
        (contact, slipped): (&ContactResults, &[Slipped]),
    ) -> Result<(), OutputError> {
        let (mesh, design) = (&self.problem.mesh, self.problem.analysis.design_at(time));
        let model = design.model();
        let displacement = &state.unknowns[..3 * mesh.nodes.len()];
        let mut elements = design.element_fields(mesh, displacement, time, &contact.force);
        // a failed iterate may be huge, but files can contain only finite numbers
        elements.determinants.iter_mut().for_each(|j| *j = j.clamp(f64::MIN, f64::MAX));
        // If no facet is opposite, the gap is at least the search distance.
        let no_gap = model.interfaces().iter().map(|i| i.interface.reach()).fold(0.0, f64::max);
        let (density, elements) = (design.density(), &elements);
        let state = fields::State { displacement, contact, density, elements, slipped, no_gap };
        let fields = fields::of_state(mesh, &state);
        fields::write_state(&self.run.file(name), mesh, time, &fields, self.pieces.as_deref())?;
        #[cfg(feature = "vtkhdf")]
        if let Some(series) = &mut self.series {
            series.step(time, &fields)?;
        }
        Ok(())
    }
}
