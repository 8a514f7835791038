//! The quantities of a path, state by state.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::Vector3;
use slipstick_contact::ContactStatus;
use slipstick_design::quantity::{ElementData, ExternalWork, Quantity, Reads};
use slipstick_mesh::{Mesh, Rigid};
use slipstick_path::{Evaluated, LoadTime, PathState, StepState};

use super::sums::Sums;
use super::{
    Quantities, QuantityName, QuantityRow, Subject, Support, built_in, external_work, has_force_on_void, has_offset,
    normal_force, supports,
};
use crate::analysis::{Designs, PreviousData, StateData, pair_results};
use crate::equations::{
    ByPoint, ContactModel, ContactResults, Design, Known, Method, ModelInterface, NodalContact, StateResults,
};
use crate::imbalance::Imbalance;
use crate::overlaps::OpenOverlap;
use crate::problem::Problem;
use crate::releases::ReleasedEnergy;
use crate::rough_pressure::RoughPressures;
use crate::void_contact::{VoidContacts, VoidSurfaces};

/// Where a state lies on a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// When.
    pub time: LoadTime,
    /// The load step that the state completes.
    pub completes: Option<usize>,
    /// Whether the path, or a load case, starts there.
    pub rest: bool,
    /// Work that the springs on free motions take in the step to the state. \[F L\]
    pub holding_work: f64,
}

impl From<&PathState> for Reached {
    fn from(at: &PathState) -> Self {
        let PathState { time, completes, rest, ref report, .. } = *at;
        Self { time, completes, rest, holding_work: report.holding_work }
    }
}

/// Computes the quantities of a path while its states are reached.
pub struct Recording<'a> {
    designs: Designs<'a>,
    recorder: Recorder<'a>,
    reads: Reads,
    /// Load steps of a load case.
    steps: usize,
    /// Load steps that are complete, through all load cases.
    complete: usize,
    begun: bool,
    found: Quantities,
    sums: Sums,
    /// Stored energy that disappears in a step, round-off included.
    released: Vec<Release>,
    /// The part of `energy_balance` that losses and errors of friction work account for in each load case. \[F L\]
    accounted: Vec<f64>,
    pressures: RoughPressures,
    on_void: VoidContacts,
    last: Option<Last<'a>>,
}

impl<'a> Recording<'a> {
    /// Of the load paths of a problem.
    pub fn of(problem: &'a Problem) -> Self {
        let steps = problem.analysis.times.len() / problem.load_cases.len().max(1);
        Self::new(&problem.mesh, &problem.quantities, problem.analysis.designs(), steps)
    }

    /// Of load paths of `steps` load steps each, without a borrowed problem; `own` are the quantities of
    /// the case.
    pub fn new(mesh: &'a Mesh, own: &'a [Arc<dyn Quantity>], designs: Designs<'a>, steps: usize) -> Self {
        let model = designs.model();
        let external_work = external_work("external_work", mesh);
        let extremes = own.iter().filter_map(|quantity| quantity.extreme()).collect();
        let void = VoidSurfaces::of(mesh, designs.shared());
        let recorder = Recorder { mesh, model, supports: supports(mesh, model), own, extremes, external_work, void };
        let own_reads = own.iter().fold(Reads::default(), |reads, quantity| reads.or(quantity.reads()));
        let all = Reads {
            reaction: true,
            contact: true,
            elements: ElementData { energy: true, ..ElementData::default() },
            ..Reads::default()
        };
        let reads = own_reads.or(recorder.external_work.reads()).or(all);
        let found = Quantities { names: recorder.names(), ..Quantities::default() };
        let (sums, pressures, on_void, last) =
            (Sums::default(), RoughPressures::default(), VoidContacts::default(), None);
        let (released, accounted) = (Vec::new(), Vec::new());
        let begun = false;
        Self {
            designs,
            recorder,
            reads,
            steps,
            complete: 0,
            begun,
            found,
            sums,
            released,
            accounted,
            pressures,
            on_void,
            last,
        }
    }

    /// The quantities so far, without overlaps and losses.
    pub fn found(&self) -> &Quantities {
        &self.found
    }

    /// All quantities, with the losses and these overlaps.
    pub fn finish(mut self, overlaps: Vec<OpenOverlap>) -> Quantities {
        self.end_case();
        let round_off = self.found.round_off();
        let mut accounted = self.accounted;
        let released = self.released.into_iter().filter(|of| of.released.energy > round_off);
        let released = released.inspect(|of| accounted[of.case] += of.apart).map(|of| of.released);
        self.found.released = released.max_by(|a, b| a.fraction.total_cmp(&b.fraction));
        let mut found = Quantities { overlaps, rough_pressures: self.pressures.reported(), ..self.found };
        let model = self.recorder.model;
        found.on_void = self.on_void.reported(model, &self.recorder.mesh.nodes);
        // penalties store energy; augmented multipliers leave a part of it
        let exact = model.interfaces().iter().all(|of| of.is_bonded() || of.enforcement.method == Method::Lagrange);
        if exact && model.viscosity().is_none() {
            found.imbalance = Imbalance::of(&found, smallest_energy(self.recorder.mesh, model, &found), &accounted);
        }
        found
    }

    /// Reports what the load case that ends has lost.
    fn end_case(&mut self) {
        self.accounted.push(self.sums.report(self.recorder.mesh, self.recorder.model, &mut self.found));
        self.on_void.end_case();
    }

    /// What was computed at the last state; `None` if it could not be evaluated.
    pub fn last(&self) -> Option<&StateResults> {
        self.last.as_ref().and_then(|last| last.results.as_ref())
    }

    /// Adds the next state of the path, with the march's evaluation of it, if that is at hand. All ranks
    /// call it.
    pub fn add(&mut self, at: Reached, now: Cow<'a, StepState>, evaluated: Option<&Evaluated<Design>>) {
        let before = self.last.take().filter(|_| !at.rest);
        if before.is_none() && self.begun {
            self.end_case();
        }
        let (recorder, designs) = (&self.recorder, self.designs);
        let design = designs.at(at.time);
        if before.is_none() {
            self.sums = Sums { own: vec![0.0; recorder.own.len()], ..Sums::default() };
        }
        let sums = &mut self.sums;
        let previous = before.as_ref().map_or(&now, |last| &last.state);
        let known = Known::of(before.as_ref().and_then(|last| last.seen.kinematics.clone()), evaluated);
        let evaluated = StateData::of(design, self.reads, at.time, (previous, &now), known);
        let step = at.completes.or((!self.begun).then_some(0));
        let in_progress = if at.rest { 0 } else { at.completes.unwrap_or(self.complete + 1) };
        self.begun = true;
        self.complete = at.completes.unwrap_or(self.complete);
        let mut data = match evaluated {
            Ok(data) if !sums.broken => data,
            _ => {
                sums.broken = true;
                self.found.rows.extend(step.map(|step| recorder.unknown(step, at.time, self.found.names.len())));
                self.last = Some(Last { time: at.time, state: now, ..Last::default() });
                return;
            }
        };
        let contact = data.results.take().unwrap_or_default();
        let pressed = pressed(design.model(), &contact, at.time);
        let stored = design.stored_slopes(&now.unknowns, at.time);
        let heated = design.energies_by_stretch((at.time, &now), &data.elements.energy).unwrap_or_default();
        let (old, seen) = match before {
            Some(mut last) => {
                let seen = std::mem::take(&mut last.seen);
                (Some(last), seen)
            }
            None => (None, PreviousData::at_rest(design, at.time, &now)),
        };
        let mut data = data.after(seen, design);
        let none = ContactResults::default();
        // the step of the load case in progress
        let place = (in_progress.saturating_sub(1) % self.steps.max(1) + 1, self.steps);
        let value = |quantity: &dyn Quantity| quantity.value(&data.view(design, &now, place));
        let own: Vec<f64> = recorder.own.iter().map(|quantity| value(&**quantity)).collect();
        let extremes: Vec<f64> = recorder.extremes.iter().map(|quantity| value(&**quantity)).collect();
        if let Some(old) = &old {
            let external = value(&recorder.external_work);
            let both = old.pressed.iter().zip(&pressed);
            let offset = both.map(|(old, new)| 0.5 * (old[0] + new[0]) * (new[1] - old[1])).sum::<f64>();
            sums.external += external;
            sums.offset += offset;
            let stretches = [old.time, at.time].map(|time| design.model().stretches(time));
            let thermal: f64 = (0..heated.len().min(old.heated.len()))
                .map(|e| 0.5 * (old.heated[e] + heated[e]) * (stretches[1][e] - stretches[0][e]))
                .sum();
            sums.thermal += thermal;
            sums.done += external.abs() + offset.abs() + thermal.abs();
            let known = sums.lost.total() - sums.coarse.total();
            let before = old.results.as_ref().map_or(&none, |results| &results.contact);
            let friction: f64 = sums.friction.iter().sum();
            let both = [&old.stored[..], &stored];
            sums.add(design.model(), (&old.state, old.time, before), (&now, at.time, &contact), both);
            sums.add_friction(design.model(), [&before.nodes, &contact.nodes], data.friction_of_step());
            sums.add_own(recorder.own, &own);
            sums.holding += at.holding_work;
            let viscous = recorder.model.viscosity().work(&old.state.unknowns, &now.unknowns, at.time.t - old.time.t);
            sums.viscous += viscous;
            let taken = sums.friction.iter().sum::<f64>() - friction + viscous + at.holding_work;
            let energies = old.results.as_ref().map_or(&[][..], |results| &results.energies);
            let stored = recorder.stored(energies, &old.state);
            sums.largest = sums.largest.max(stored);
            let energies = [stored, recorder.stored(&data.elements.energy, &now), sums.largest];
            // where material flows, the plastic work of a step is not known here; soft contact stores energy itself,
            // and where a pair ends, its energy is released on purpose
            let apart = recorder.model.interfaces().iter().any(|pair| {
                pair.pressure.is_some() || pair.at_points || pair.is_active(old.time) && !pair.is_active(at.time)
            });
            let released = (!recorder.model.has_memory() && !apart).then(|| {
                let (done, contact) = (external + offset + thermal, [&before.nodes[..], &contact.nodes[..]]);
                ReleasedEnergy::between(
                    recorder.model,
                    &recorder.mesh.nodes,
                    in_progress,
                    energies,
                    [done, taken],
                    contact,
                )
            });
            // what contact loses in this step, and the error of its friction work, count apart
            let known = sums.lost.total() - sums.coarse.total() - known;
            self.released.extend(released.flatten().map(|released| Release {
                case: self.accounted.len(),
                apart: released.energy - known,
                released,
            }));
        }
        if let Some(step) = step {
            self.pressures.add((design.model(), recorder.own), &recorder.mesh.nodes, step, &contact);
            self.on_void.add(&recorder.void, design.model(), step, &contact);
            self.found.rows.push(QuantityRow {
                step,
                time: at.time,
                values: recorder.values(&now, &data, &contact, sums, [&own, &extremes]),
                slipped: sums.slipped.clone(),
            });
        }
        let (internal_force, energies) = (data.internal.clone(), std::mem::take(&mut data.elements.energy));
        let seen = match at.rest {
            true => PreviousData::at_rest(design, at.time, &now).with(data.kinematics),
            false => data.into_previous(&now),
        };
        let results = Some(StateResults { contact, internal_force, energies });
        self.last = Some(Last { time: at.time, state: now, results, pressed, heated, stored, seen });
    }
}

/// Stored energy that disappears in a step.
struct Release {
    /// The load case, from 0.
    case: usize,
    released: ReleasedEnergy,
    /// Without what contact loses in the step. \[F L\]
    apart: f64,
}

/// The last state that was added.
#[derive(Default)]
struct Last<'a> {
    time: LoadTime,
    state: Cow<'a, StepState>,
    /// `None` if it could not be evaluated.
    results: Option<StateResults>,
    /// Force against the offset of each pair, and the offset. \[F, L\]
    pressed: Vec<[f64; 2]>,
    /// Derivatives of the elements' energies with respect to their free expansion. \[F L\]
    heated: Vec<f64>,
    /// [`Design::stored_slopes`].
    stored: Vec<ByPoint>,
    /// What quantities at the next state see of it.
    seen: PreviousData,
}

/// Energies below this are round-off: 1e-10 of what it takes to compress the smallest element by the largest prescribed
/// motion. \[F L\]
fn smallest_energy(mesh: &Mesh, model: &ContactModel, found: &Quantities) -> f64 {
    let times: Vec<LoadTime> = found.rows.iter().map(|row| row.time).collect();
    let (solid, motion) = (model.solid(), model.prescribed().largest(&times));
    let sizes = mesh.element_volumes().into_iter().filter(|volume| *volume > 0.0);
    let modulus = (0..solid.elements()).map(|e| solid.material(e).youngs_modulus()).fold(0.0, f64::max);
    let size = sizes.reduce(f64::min).map_or(0.0, f64::cbrt);
    1e-10 * modulus * size * motion * motion
}

/// The force against the offset of each pair, Σ s_j A_j ζ_nj, and the offset, at a pseudo-time.
/// \[F, L\]
fn pressed(model: &ContactModel, contact: &ContactResults, time: LoadTime) -> Vec<[f64; 2]> {
    let of = |(pair, nodes): (&ModelInterface, &[NodalContact])| {
        let slant = |j: usize| pair.slants.get(j).copied().unwrap_or(1.0);
        let force = |(j, at): (usize, &NodalContact)| slant(j) * at.covered_area * at.multiplier[0];
        [nodes.iter().enumerate().map(force).sum(), pair.offset_at(time)]
    };
    model.interfaces().iter().zip(model.by_pair(&contact.nodes)).map(of).collect()
}

struct Recorder<'a> {
    mesh: &'a Mesh,
    model: &'a ContactModel,
    supports: Vec<Support>,
    own: &'a [Arc<dyn Quantity>],
    /// Extremes for which smooth ones of them stand.
    extremes: Vec<Arc<dyn Quantity>>,
    external_work: ExternalWork,
    void: VoidSurfaces,
}

impl Recorder<'_> {
    fn names(&self) -> Vec<QuantityName> {
        let mut names = built_in(self.mesh, self.model, &self.supports);
        for quantity in self.own {
            let (name, unit) = (quantity.name().to_owned(), quantity.dimension().symbol());
            names.push(QuantityName { name: name.clone(), subject: Subject::Case, what: name, unit });
        }
        for extreme in &self.extremes {
            let (name, unit) = (extreme.name().to_owned(), extreme.dimension().symbol());
            names.push(QuantityName { name: name.clone(), subject: Subject::Extreme, what: name, unit });
        }
        names
    }

    /// Moment of the forces at the nodes of a rigid body about its reference point, at its current
    /// position. \[F L\]
    fn moment(&self, rigid: &Rigid, d: &[f64], force: &[f64]) -> [f64; 3] {
        let vector = |v: &[f64], node: usize| Vector3::from_column_slice(&v[3 * node..][..3]);
        let place = |node: usize| Vector3::from(self.mesh.nodes[node]) + vector(d, node);
        let centre = place(rigid.reference as usize);
        let nodes = self.mesh.bodies[rigid.body].nodes.clone();
        nodes.map(|node| (place(node) - centre).cross(&vector(force, node))).sum::<Vector3<f64>>().into()
    }

    /// Energy of elements, with these energies, and springs. \[F L\]
    fn stored(&self, energies: &[f64], state: &StepState) -> f64 {
        energies.iter().sum::<f64>() + self.model.springs().energy(&state.unknowns)
    }

    fn unknown(&self, step: usize, time: LoadTime, count: usize) -> QuantityRow {
        QuantityRow { step, time, values: vec![f64::NAN; count], slipped: Vec::new() }
    }

    fn values(
        &self,
        state: &StepState,
        data: &StateData,
        contact: &ContactResults,
        sums: &Sums,
        [own, extremes]: [&[f64]; 2],
    ) -> Vec<f64> {
        let mut values = Vec::new();
        for support in &self.supports {
            let (nodes, components) = support.nodes();
            if let Some(rigid) = &support.rigid {
                let at = 3 * rigid.reference as usize;
                values.extend_from_slice(&state.unknowns[at..at + 3]);
                values.extend(self.model.rotation(rigid, &state.unknowns).unwrap_or_default());
            } else if support.set.is_some() {
                for c in 0..3 {
                    let sum: f64 = nodes.iter().map(|&node| state.unknowns[3 * node as usize + c]).sum();
                    values.push(sum / nodes.len() as f64);
                }
            }
            for c in (0..3).filter(|&c| components[c]) {
                let own = support.unknowns.iter().filter(|&&unknown| unknown as usize % 3 == c);
                values.push(own.map(|&unknown| data.reaction[unknown as usize]).sum());
            }
            if let Some(rigid) = &support.rigid {
                values.extend(self.moment(rigid, &state.unknowns, &data.reaction));
            }
        }
        for bolt in self.model.bolts().list() {
            let unknown = bolt.unknown as usize;
            values.extend([data.reaction[unknown], state.unknowns[unknown]]);
        }
        let results = pair_results(self.model, contact);
        let on_void = self.void.forces(self.model, contact);
        for (i, (nodes, result)) in self.model.by_pair(&contact.nodes).zip(&results).enumerate() {
            let in_contact = || nodes.iter().filter(|at| at.status.is_closed());
            let friction = |at: &NodalContact| at.covered_area * at.multiplier[1].hypot(at.multiplier[2]);
            values.extend(result.force);
            values.push(normal_force(nodes));
            values.push(nodes.iter().map(friction).sum());
            values.push(result.peak_pressure);
            values.push(in_contact().map(|at| at.covered_area).sum());
            values.extend(ContactStatus::counts(nodes.iter().map(|at| at.status)).map(|count| count as f64));
            values.push(sums.friction.get(i).copied().unwrap_or(0.0));
            let force = on_void.get(i).copied().unwrap_or(0.0);
            values.extend(has_force_on_void(self.model, &self.model.interfaces()[i]).then_some(force));
        }
        let energies = self.mesh.bodies.iter().map(|body| data.elements.energy[body.elements.clone()].iter().sum());
        let energies: Vec<f64> = energies.collect();
        values.extend(&energies);
        let (stored, dissipated) = (energies.iter().sum::<f64>(), sums.friction.iter().sum::<f64>());
        values.extend([stored, dissipated, sums.external, sums.contact]);
        let plastic: f64 = data.elements.plastic_work.iter().sum();
        values.extend(self.model.has_memory().then_some(plastic));
        values.extend(has_offset(self.model).then_some(sums.offset));
        values.extend(self.model.has_temperatures().then_some(sums.thermal));
        let springs = self.model.springs();
        let sprung = springs.energy(&state.unknowns);
        values.extend((!springs.is_empty()).then_some(sprung));
        values.extend((!self.model.viscosity().is_none()).then_some(sums.viscous));
        values.extend(self.model.may_move_freely().then_some(sums.holding));
        let taken = stored + sprung + plastic + dissipated + sums.viscous + sums.holding;
        values.push(sums.external + sums.offset + sums.thermal - taken);
        let own = self.own.iter().zip(own).zip(&sums.own);
        values.extend(own.map(|((quantity, value), sum)| if quantity.accumulates() { *sum } else { *value }));
        values.extend(extremes);
        // −0 is written as 0
        values.iter_mut().for_each(|value| *value += 0.0);
        values
    }
}
