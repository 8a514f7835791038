//! The load path of a design as files for ParaView.

use slipstick_mesh::Mesh;
use slipstick_path::{MarchFailure, Path, StepState};

use super::{RunDirectory, RunError};
use crate::analysis::NodalContact;
use crate::model::ContactModel;
use crate::output::{OutputError, Pvd, fields};

/// The failing iterate, a whole mesh always.
const FAILURE: &str = "failure.vtu";

/// Writes `path_XXXX.vtu` of every completed load step, step 0 included, and `path.pvd`; returns how many steps.
///
/// The slip increment of a step that was cut back is that of its last sub-step. Where a state cannot be evaluated any
/// more (it converged, so that is rare), its contact fields are left out.
///
/// # Errors
/// [`RunError::Output`].
pub fn write_path(run: &RunDirectory, mesh: &Mesh, model: &mut ContactModel, path: &Path) -> Result<usize, RunError> {
    let ranks = model.share().ranks().clone();
    let mut collection = Pvd::default();
    let written = path.with_states(&*ranks, |state| {
        let mut written = 0;
        for (index, at) in path.states.iter().enumerate() {
            let step = match at.completes {
                Some(step) => step,
                None if index == 0 => 0,
                None => continue,
            };
            let (now, previous) = (state(index), state(if at.rest { index } else { index - 1 }));
            let contact = model.contact_results(&previous, &now).unwrap_or_default();
            let name = RunDirectory::numbered("path", step);
            save(run, &name, mesh, model, at.time, &now, &contact)?;
            collection.add(at.time, run.in_series(&name))?;
            written += 1;
        }
        Ok::<usize, OutputError>(written)
    })?;
    collection.save(&run.file("path.pvd"))?;
    Ok(written)
}

/// Writes what a failed march leaves: the completed load steps as [`write_path`] does, the last converged sub-step
/// after them if it completes no step, and `failure.vtu`, the failing iterate; returns whether that one is finite and
/// was written.
///
/// # Errors
/// [`RunError::Output`].
pub fn write_failure(
    run: &RunDirectory,
    mesh: &Mesh,
    model: &mut ContactModel,
    failure: &MarchFailure,
) -> Result<bool, RunError> {
    write_path(run, mesh, model, &failure.path)?;
    let Some(last) = failure.path.states.last() else { return Ok(false) };
    if last.completes.is_none() && failure.path.states.len() > 1 {
        // the last two states are whole on every rank
        let previous = &failure.path.states[failure.path.states.len() - if last.rest { 1 } else { 2 }].state;
        let contact = model.contact_results(previous, &last.state).unwrap_or_default();
        let name = RunDirectory::numbered("path", failure.step);
        save(run, &name, mesh, model, last.time, &last.state, &contact)?;
    }
    let complete = failure.iterate.len() == last.state.unknowns.len();
    if !complete || failure.iterate.iter().any(|value| !value.is_finite()) {
        return Ok(false);
    }
    let iterate = StepState { unknowns: failure.iterate.clone(), history: last.state.history.clone() };
    let contact = model.contact_results(&last.state, &iterate).unwrap_or_default();
    save(run, FAILURE, mesh, model, failure.increment.1, &iterate, &contact)?;
    Ok(true)
}

fn save(
    run: &RunDirectory,
    name: &str,
    mesh: &Mesh,
    model: &ContactModel,
    time: f64,
    state: &StepState,
    contact: &[NodalContact],
) -> Result<(), OutputError> {
    let displacement = &state.unknowns[..3 * mesh.nodes.len()];
    let mut determinants = model.smallest_determinants(mesh, displacement);
    // a failed iterate may be far out, and a file holds finite numbers
    determinants.iter_mut().for_each(|j| *j = j.clamp(f64::MIN, f64::MAX));
    // Where nothing lies opposite, the gap is at least the distance that was searched.
    let reach = model.interfaces().iter().map(|i| i.interface.reach()).fold(0.0, f64::max);
    let pieces = run.pieces(model.share(), mesh.elements.len()).filter(|_| name != FAILURE);
    let (file, density) = (run.file(name), model.density());
    fields::write_state(&file, mesh, time, displacement, contact, density, &determinants, reach, pieces.as_deref())
}
