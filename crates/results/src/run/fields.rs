//! The load path of a design as files for ParaView.

use slipstick_path::{LoadTime, MarchFailure, Path, StateError, StepState};

use super::first::agree;
use super::{PathWriter, RunDirectory, RunError, on_first};
#[cfg(feature = "vtkhdf")]
use crate::output::VtkHdf;
use crate::output::{OutputError, fields};
use slipstick_mesh::Mesh;
use slipstick_model::analysis::Designs;
use slipstick_model::model::{ContactResults, StateResults};
use slipstick_model::overlaps::overlaps;
use slipstick_model::problem::Problem;
use slipstick_model::quantities::{Quantities, Slipped};

/// Writes `path_XXXX.vtu` for every completed load step, including step 0, `path.pvd`, on request
/// `path.vtkhdf`, `contact.csv` ([`ContactTable`](super::ContactTable)) and `quantities.csv`
/// ([`write_quantities`](super::write_quantities)); returns the quantities. All ranks call it; `run` is
/// that of the first rank, if it keeps one.
///
/// The slip increment of a step that was cut back is that of its last sub-step. If a state can no
/// longer be evaluated (which is rare, because it converged), its contact fields are left out.
///
/// # Errors
/// [`RunError::Output`] on the first rank, [`RunError::FirstRank`] on the others.
pub fn write_path(run: Option<&RunDirectory>, problem: &Problem, path: &Path) -> Result<Quantities, RunError> {
    let ranks = problem.analysis.model().share().ranks().clone();
    let mut writer = PathWriter::of(run, problem);
    #[cfg(feature = "vtkhdf")]
    writer.series(path.states.iter().enumerate().filter(|(index, at)| *index == 0 || at.completes.is_some()).count());
    for (index, at) in path.states.iter().enumerate() {
        writer.add(at.into(), path.state(index, &*ranks), None);
    }
    let (recording, written) = writer.finish();
    agree(&*ranks, (ranks.rank() == 0).then_some(written))?;
    Ok(recording.finish(overlaps(problem, path)))
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
    let (mesh, designs) = (&problem.mesh, problem.analysis.designs());
    let design = designs.at(failure.increment.end());
    if last.completes.is_none() && failure.path.states.len() > 1 {
        // the last two states are complete on every rank
        let previous = &failure.path.states[failure.path.states.len() - if last.rest { 1 } else { 2 }].state;
        let contact = of_contact(design.contact_results(previous, &last.state, last.time));
        let name = RunDirectory::numbered("path", failure.step);
        Files::new(run, mesh, designs).save(&name, last.time, &last.state, (&contact, &[]))?;
    }
    let complete = failure.iterate.len() == last.state.unknowns.len();
    if !complete || failure.iterate.iter().any(|value| !value.is_finite()) {
        return Ok(false);
    }
    let iterate = StepState { unknowns: failure.iterate.clone(), history: last.state.history.clone() };
    let contact = of_contact(design.contact_results(&last.state, &iterate, failure.increment.end()));
    Files::whole(run, mesh, designs).save("failure.vtu", failure.increment.end(), &iterate, (&contact, &[]))?;
    Ok(true)
}

/// Contact results, empty if they could not be computed, and nothing else.
pub(super) fn of_contact(results: Result<ContactResults, StateError>) -> StateResults {
    StateResults { contact: results.unwrap_or_default(), ..StateResults::default() }
}

/// Data needed to write the states of a run.
pub(super) struct Files<'a> {
    run: &'a RunDirectory,
    mesh: &'a Mesh,
    designs: Designs<'a>,
    /// The piece of every element, if meshes are also written in pieces.
    pieces: Option<Vec<u32>>,
    /// The file of the whole path, if it is wanted.
    #[cfg(feature = "vtkhdf")]
    series: Option<VtkHdf<'a>>,
}

impl<'a> Files<'a> {
    pub fn new(run: &'a RunDirectory, mesh: &'a Mesh, designs: Designs<'a>) -> Self {
        let pieces = run.pieces(designs.model().share(), mesh.elements.len());
        Self { pieces, ..Self::whole(run, mesh, designs) }
    }

    /// Files that are not written in pieces.
    fn whole(run: &'a RunDirectory, mesh: &'a Mesh, designs: Designs<'a>) -> Self {
        Self {
            run,
            mesh,
            designs,
            pieces: None,
            #[cfg(feature = "vtkhdf")]
            series: None,
        }
    }

    /// The states that are saved next are the `steps` steps of the path, which are also written as one file
    /// if this is wanted.
    #[cfg(feature = "vtkhdf")]
    pub fn series(&mut self, steps: usize) -> Result<(), OutputError> {
        if self.run.vtkhdf() {
            self.series = Some(VtkHdf::create(&self.run.file("path.vtkhdf"), self.mesh, steps)?);
        }
        Ok(())
    }

    /// Completes the file of the whole path.
    pub fn finish(self) -> Result<(), OutputError> {
        #[cfg(feature = "vtkhdf")]
        if let Some(series) = self.series {
            return series.finish();
        }
        Ok(())
    }

    /// Writes a state with its contact results and the slip of its slave nodes.
    pub fn save(
        &mut self,
        name: &str,
        time: LoadTime,
        state: &StepState,
        (known, slipped): (&StateResults, &[Slipped]),
    ) -> Result<(), OutputError> {
        let (mesh, design) = (self.mesh, self.designs.at(time));
        let model = design.model();
        let displacement = &state.unknowns[..3 * mesh.nodes.len()];
        let (mut elements, contact) = (design.element_fields(mesh, state, time, known), &known.contact);
        // a failed iterate may be huge, but files can contain only finite numbers
        elements.determinants.iter_mut().for_each(|j| *j = j.clamp(f64::MIN, f64::MAX));
        // If no facet is opposite, the gap is at least the search distance.
        let no_gap = model.interfaces().iter().map(|i| i.interface.reach()).fold(0.0, f64::max);
        let (density, elements) = (design.density(), &elements);
        let state = fields::State { displacement, contact, density, elements, slipped, no_gap };
        let fields = fields::of_state(mesh, &state);
        fields::write_state(&self.run.file(name), mesh, time.on_axis(), &fields, self.pieces.as_deref())?;
        #[cfg(feature = "vtkhdf")]
        if let Some(series) = &mut self.series {
            series.step(time.on_axis(), &fields)?;
        }
        Ok(())
    }
}
