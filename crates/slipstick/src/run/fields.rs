//! The load path of a design as files for ParaView.

use slipstick_mesh::Mesh;
use slipstick_path::{MarchFailure, Path, StepState};

use super::tables::ContactTable;
use super::{RunDirectory, RunError};
use crate::analysis::pair_results;
use crate::model::{ContactResults, Design};
use crate::output::{OutputError, Pvd, fields};

/// Writes `path_XXXX.vtu` of every completed load step, step 0 included, `path.pvd`, and `contact.csv` ([`ContactTable`]);
/// returns how many steps.
///
/// The slip increment of a step that was cut back is that of its last sub-step. Where a state cannot be evaluated any
/// more (it converged, so that is rare), its contact fields are left out.
///
/// # Errors
/// [`RunError::Output`].
pub fn write_path(run: &RunDirectory, mesh: &Mesh, design: &Design, path: &Path) -> Result<usize, RunError> {
    let ranks = design.model().share().ranks().clone();
    let pieces = run.pieces(design.model().share(), mesh.elements.len());
    let (mut collection, mut forces) = (Pvd::default(), ContactTable::new(mesh));
    let written = path.with_states(&*ranks, |state| {
        let mut written = 0;
        let mut last = None;
        for (index, at) in path.states.iter().enumerate() {
            let step = match at.completes {
                Some(step) => step,
                None if index == 0 => 0,
                None => continue,
            };
            let now = state(index);
            // mostly the one that was written last
            let before = last.take().filter(|(of, _)| of + 1 == index).map(|(_, state)| state);
            let previous = match before {
                _ if at.rest => now.clone(),
                Some(before) => before,
                None => state(index - 1),
            };
            let contact = design.contact_results(&previous, &now).unwrap_or_default();
            let name = RunDirectory::numbered("path", step);
            save(run, &name, mesh, design, at.time, &now, &contact, pieces.as_deref())?;
            collection.add(at.time, run.in_series(&name))?;
            // a state that cannot be evaluated has no results
            if !contact.nodes.is_empty() {
                forces.add(step, at.time, &pair_results(design.model().interfaces(), &contact));
            }
            written += 1;
            last = Some((index, now));
        }
        Ok::<usize, OutputError>(written)
    })?;
    collection.save(&run.file("path.pvd"))?;
    forces.save(run)?;
    Ok(written)
}

/// Writes what a failed march leaves: the completed load steps as [`write_path`] does, also on several ranks, the last
/// converged sub-step after them if it completes no step, and `failure.vtu`, the failing iterate; returns whether that one
/// is finite and was written.
///
/// # Errors
/// [`RunError::Output`].
pub fn write_failure(
    run: &RunDirectory,
    mesh: &Mesh,
    design: &Design,
    failure: &MarchFailure,
) -> Result<bool, RunError> {
    write_path(run, mesh, design, &failure.path)?;
    let Some(last) = failure.path.states.last() else { return Ok(false) };
    if last.completes.is_none() && failure.path.states.len() > 1 {
        // the last two states are whole on every rank
        let previous = &failure.path.states[failure.path.states.len() - if last.rest { 1 } else { 2 }].state;
        let contact = design.contact_results(previous, &last.state).unwrap_or_default();
        let name = RunDirectory::numbered("path", failure.step);
        let pieces = run.pieces(design.model().share(), mesh.elements.len());
        save(run, &name, mesh, design, last.time, &last.state, &contact, pieces.as_deref())?;
    }
    let complete = failure.iterate.len() == last.state.unknowns.len();
    if !complete || failure.iterate.iter().any(|value| !value.is_finite()) {
        return Ok(false);
    }
    let iterate = StepState { unknowns: failure.iterate.clone(), history: last.state.history.clone() };
    let contact = design.contact_results(&last.state, &iterate).unwrap_or_default();
    save(run, "failure.vtu", mesh, design, failure.increment.1, &iterate, &contact, None)?;
    Ok(true)
}

fn save(
    run: &RunDirectory,
    name: &str,
    mesh: &Mesh,
    design: &Design,
    time: f64,
    state: &StepState,
    contact: &ContactResults,
    pieces: Option<&[u32]>,
) -> Result<(), OutputError> {
    let displacement = &state.unknowns[..3 * mesh.nodes.len()];
    let mut determinants = design.model().smallest_determinants(mesh, displacement);
    // a failed iterate may be far out, and a file holds finite numbers
    determinants.iter_mut().for_each(|j| *j = j.clamp(f64::MIN, f64::MAX));
    // Where nothing lies opposite, the gap is at least the distance that was searched.
    let reach = design.model().interfaces().iter().map(|i| i.interface.reach()).fold(0.0, f64::max);
    let (file, density) = (run.file(name), design.density());
    fields::write_state(&file, mesh, time, displacement, contact, density, &determinants, reach, pieces)
}
