//! Marches of designs: with shorter updates or interpolated energies where a path cannot be completed, and
//! with the next candidates where the optimizer rejects a design.

use super::functions::Designs;
use super::{Bounds, Optimization, OptimizeError, guard};
use crate::crushed::CrushedVoid;
use slipstick_design::{Judgement, Optimizer, VariableValues};
use slipstick_path::{LoadTime, MarchEvent, MarchObserver, StateError, StepFailureKind};
use slipstick_solid::EnergyInterpolation;

/// How many times an update is halved when the path of the new design cannot be marched.
const MAX_HALVINGS: usize = 3;

/// A design whose path could be marched.
pub(super) struct Marched {
    pub x: VariableValues,
    pub designs: Designs,
    pub halvings: usize,
    /// Newton iterations of the paths that failed earlier, and of rejected candidates.
    pub lost: usize,
    /// Void because of which energies are interpolated from this design on.
    pub crushed: Option<CrushedVoid>,
}

/// Keeps the states at which attempts failed, and passes all events on.
struct Failures<'a> {
    observer: &'a mut dyn MarchObserver,
    states: Vec<StateError>,
}

impl MarchObserver for Failures<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        if let MarchEvent::Retry { failed, .. } = event
            && let StepFailureKind::State(error) = &failed.kind
        {
            self.states.push(error.clone());
        }
        self.observer.on_event(event);
    }

    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }
}

/// The states at which these attempts failed.
fn states_of(attempts: &[(LoadTime, StepFailureKind)]) -> Vec<StateError> {
    let state = |(_, kind): &(LoadTime, StepFailureKind)| match kind {
        StepFailureKind::State(error) => Some(error.clone()),
        _ => None,
    };
    attempts.iter().filter_map(state).collect()
}

impl Optimization {
    /// Marches with the variables of the state and, as long as the optimizer rejects the result,
    /// with its next candidate.
    ///
    /// Where the schedule changes the functions or the bound on the volume, there is nothing to compare
    /// a design with, and it is accepted. A halved update is judged like a full one. It does not raise the objective
    /// either: the approximations are convex, so where both ends are no worse than the last design,
    /// nor is the middle.
    ///
    /// If the sharpness rises there, though, and the design then breaks a bound, MMA with a guard divides the rise
    /// in two: the same variables are marched with the first half of it.
    pub(super) fn march_accepted(
        &mut self,
        optimizer: &mut Optimizer,
        observer: &mut dyn MarchObserver,
    ) -> Result<Marched, OptimizeError> {
        let bounds = Bounds::of_variables(self.state.x.len());
        let comparable = !self.changes_values_at(self.state.iteration);
        let mut divisible = optimizer.is_guarded() && self.can_divide();
        let (mut x, mut halvings, mut lost) = (self.state.x.clone(), 0, 0);
        loop {
            let mut marched = self.march_or_step_back(x, observer)?;
            marched.halvings += halvings;
            marched.lost += lost;
            if std::mem::take(&mut divisible) && !marched.designs.is_rounded() {
                let values = self.values(&marched.designs, self.state.dilated_limit, None);
                if self.state.history.last().is_some_and(|last| guard::breaks_bounds(last, &values)) {
                    halvings = marched.halvings;
                    lost = marched.lost + marched.designs.newton_iterations() + marched.designs.failed_iterations();
                    self.state.divided.push(self.state.iteration);
                    x = marched.x;
                    continue;
                }
            }
            let judged = comparable && !marched.designs.is_rounded() && marched.crushed.is_none();
            // without scales, nothing has been approximated yet
            let Some(scaling) = self.state.scaling.as_ref().filter(|_| judged) else {
                return Ok(marched);
            };
            let held = Some(&*self.state.shifts);
            let values = self.values(&marched.designs, self.state.dilated_limit, held);
            let last = self.state.history.last();
            if optimizer.is_lenient() && last.is_some_and(|last| !guard::goes_too_far(last, &values)) {
                return Ok(marched);
            }
            let scaled = values.scaled(scaling);
            let ranks = self.problem.analysis.linear.ranks();
            match optimizer.judge(&marched.x, bounds.both(), scaled.objective, &scaled.constraints, ranks)? {
                Judgement::Conservative | Judgement::Exhausted => return Ok(marched),
                Judgement::Rejected(next) => x = next.x.into(),
            }
            halvings = marched.halvings;
            lost = marched.lost + marched.designs.newton_iterations() + marched.designs.failed_iterations();
            if observer.cancelled() {
                return Err(OptimizeError::Interrupted);
            }
        }
    }

    /// Marches with these variables or, if that fails, with half of the update that led to them.
    fn march_or_step_back(
        &mut self,
        mut x: VariableValues,
        observer: &mut dyn MarchObserver,
    ) -> Result<Marched, OptimizeError> {
        let (mut halvings, mut lost, mut crushed) = (0, 0, None);
        loop {
            let densities = self.realisations.densities(self.state.iteration, &self.state.divided, &x);
            let mut watched = Failures { observer: &mut *observer, states: Vec::new() };
            let marched = self.realisations.march(&mut self.problem.analysis, densities, &mut watched);
            let states = watched.states;
            let failure = match marched {
                Ok(designs) if !designs.finished(self.problem.analysis.times.len()) => {
                    return Err(OptimizeError::Interrupted);
                }
                Ok(designs) => {
                    let costly = designs.failed_iterations() > designs.newton_iterations();
                    if let Some(void) = self.rescued(&states, &x).filter(|_| costly) {
                        lost += designs.newton_iterations() + designs.failed_iterations();
                        crushed = Some(void);
                        self.interpolate_energies(true);
                        continue;
                    }
                    return Ok(Marched { x, designs, halvings, lost, crushed });
                }
                Err(failure) => failure,
            };
            let last = failure.march().map(|march| states_of(&march.attempts)).unwrap_or_default();
            let void = self.rescued(&[states, last].concat(), &x);
            if let Some((march, void)) = failure.march().zip(void) {
                lost += march.path.newton_iterations() + march.failed_iterations;
                crushed = Some(void);
                self.interpolate_energies(true);
                continue;
            }
            let back = match (failure.march(), &self.state.x_before) {
                (Some(march), Some(before)) if halvings < MAX_HALVINGS => {
                    lost += march.path.newton_iterations() + march.failed_iterations;
                    before
                }
                _ => return Err(failure.into()),
            };
            halvings += 1;
            x.iter_mut().zip(back).for_each(|(x, b)| *x = 0.5 * (*x + b));
        }
    }

    /// The void that made attempts fail with these states, if it would not with interpolated energies and may
    /// have them.
    fn rescued(&self, states: &[StateError], x: &VariableValues) -> Option<CrushedVoid> {
        let void = || self.problem.crushed_void(&self.map().densities(x), states.iter());
        self.rescue_void.then(void).flatten()
    }

    pub(super) fn interpolate_energies(&mut self, interpolate: bool) {
        let energy = interpolate.then_some(EnergyInterpolation::PUBLISHED);
        self.realisations.set_energy_interpolation(&mut self.problem.analysis, energy);
    }
}
