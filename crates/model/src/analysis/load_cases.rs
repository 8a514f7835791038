//! The load cases of an analysis: the model of each, and their paths side by side.
//!
//! Each load case starts at rest, so their marches and sweeps do not depend on each other. As many
//! run at a time as there are threads, each with a solver and buffers of its own, which remember
//! nothing from one load case to the next. Results are the same bits for any number of threads.

use std::ops::Range;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use slipstick_design::ElementValues;
use slipstick_design::response::Response;
use slipstick_linalg::Alone;
use slipstick_path::{
    FailedAttempt, LinearSystem, LoadPath, MarchEvent, MarchFailure, MarchObserver, MarchOptions, Path, PathGradient,
    Remedy, Solver, SweepError, SweepOptions, march, sweep_states,
};
use slipstick_solid::MaterialError;

use super::Analysis;
use super::chain::{Adapter, add_density_derivative};
use crate::equations::{ContactModel, Design, LoadTime, Variation, Workspace};
use crate::side_by_side::{Stop, side_by_side};

/// The number of load cases, and the models of those that differ.
#[derive(Clone, Default)]
pub struct LoadCases {
    /// One entry per load case; empty: a single one.
    varied: Vec<Option<Varied>>,
    /// Their names, for messages; empty for a single one.
    names: Vec<String>,
    /// Whether they run one after the other on any number of threads.
    pub(crate) one_by_one: bool,
}

/// A load case whose model differs.
#[derive(Clone)]
struct Varied {
    variation: Variation,
    design: Design,
}

impl Varied {
    fn new(design: &Design, variation: Variation) -> Result<Self, MaterialError> {
        let model = Arc::new(design.model().varied(&variation)?);
        Ok(Self { variation, design: Design::new(model, design.density()) })
    }
}

impl LoadCases {
    /// `variations` has an entry for each load case; `None`: its model is that of `design`.
    ///
    /// # Errors
    /// The number of the load case whose model is impossible, and why.
    pub fn new(design: &Design, variations: Vec<Option<Variation>>) -> Result<Self, (usize, MaterialError)> {
        let of = |(number, variation): (usize, Option<Variation>)| {
            let varied = variation.map(|variation| Varied::new(design, variation)).transpose();
            varied.map_err(|error| (number, error))
        };
        let varied = variations.into_iter().enumerate().map(of).collect::<Result<_, _>>()?;
        Ok(Self { varied, names: Vec::new(), one_by_one: false })
    }

    /// Gives them names, for messages.
    pub fn named(mut self, names: Vec<String>) -> Self {
        self.names = names;
        self
    }

    /// Their names; empty if they have none.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of load cases, at least 1.
    pub fn count(&self) -> usize {
        self.varied.len().max(1)
    }

    /// How the model of a load case differs from the others.
    pub fn variation(&self, case: usize) -> Option<&Variation> {
        self.varied.get(case)?.as_ref().map(|varied| &varied.variation)
    }

    /// The discrete problem of a load case; `shared` is that of the load cases that do not differ.
    fn design<'a>(&'a self, shared: &'a Design, case: usize) -> &'a Design {
        let varied = self.varied.get(case).and_then(Option::as_ref);
        varied.map_or(shared, |varied| &varied.design)
    }

    /// The discrete problem of the load case at a pseudo-time; `shared` is that of the load cases
    /// that do not differ.
    pub fn design_at<'a>(&'a self, shared: &'a Design, time: LoadTime) -> &'a Design {
        self.design(shared, if self.count() > 1 { time.case } else { 0 })
    }

    /// Removes the load cases' own coefficients of friction; takes effect when they follow the model again.
    pub(super) fn share_friction(&mut self) {
        self.varied.iter_mut().flatten().for_each(|varied| varied.variation.friction.fill(None));
    }

    /// Follows a change of the model that all load cases share.
    pub(super) fn follow(&mut self, design: &Design) {
        for varied in self.varied.iter_mut().flatten() {
            let variation = varied.variation.clone();
            *varied = Varied::new(design, variation).expect("moduli that were possible before");
        }
    }

    pub(super) fn set_density(&mut self, density: &ElementValues) {
        for varied in self.varied.iter_mut().flatten() {
            varied.design = Design::new(varied.design.model().clone(), density);
        }
    }

    /// The user's steps of each load case among the ends `times` of all of them.
    fn steps(&self, times: &[LoadTime]) -> Vec<Range<usize>> {
        let start = |case: usize| times.partition_point(|time| time.case < case);
        let ends = (1..self.count()).map(start).chain([times.len()]);
        let mut begin = 0;
        ends.map(|end| std::mem::replace(&mut begin, end)..end).collect()
    }
}

/// The discrete problems of all load cases.
#[derive(Clone, Copy)]
pub struct Designs<'a> {
    shared: &'a Design,
    cases: &'a LoadCases,
}

impl<'a> Designs<'a> {
    /// `shared` is that of the load cases that do not differ.
    pub fn new(shared: &'a Design, cases: &'a LoadCases) -> Self {
        Self { shared, cases }
    }

    /// That of the load case at a pseudo-time.
    pub fn at(self, time: LoadTime) -> &'a Design {
        self.cases.design_at(self.shared, time)
    }

    /// That of the load cases that do not differ; all have its densities.
    pub fn shared(self) -> &'a Design {
        self.shared
    }

    /// The model without what load cases change.
    pub fn model(self) -> &'a ContactModel {
        self.shared.model()
    }
}

/// The solver and the buffers of one load case at a time.
struct Worker {
    linear: LinearSystem,
    workspace: Workspace,
}

impl Analysis {
    /// The discrete problem of the load case at a pseudo-time, with the densities of the last
    /// analysis.
    pub fn design_at(&self, time: LoadTime) -> &Design {
        self.cases.design_at(&self.design, time)
    }

    /// The discrete problems of all load cases, with the densities of the last analysis.
    pub fn designs(&self) -> Designs<'_> {
        Designs::new(&self.design, &self.cases)
    }

    /// How many load cases, or realizations of a design, can run at the same time: as many as there
    /// are threads, and one if several ranks solve together.
    pub fn at_once(&self) -> usize {
        if self.linear.ranks().size() == 1 { rayon::current_num_threads() } else { 1 }
    }

    /// Further solvers and buffers: one for each load case that can run at the same time, except
    /// the first.
    fn workers(&self) -> Vec<Worker> {
        let wanted = if self.cases.one_by_one { 1 } else { self.cases.count().min(self.at_once()) };
        let worker = |_| Worker { linear: self.linear.another(), workspace: self.workspace.another() };
        (1..wanted).map(worker).collect()
    }

    fn absorb(&mut self, workers: Vec<Worker>) {
        for mut worker in workers {
            self.linear.absorb(&mut worker.linear);
            self.workspace.timings = self.workspace.timings + worker.workspace.timings;
        }
    }

    /// Marches along all load cases.
    pub(super) fn march_all(
        &mut self,
        options: &MarchOptions,
        observer: &mut dyn MarchObserver,
    ) -> Result<Path, Box<MarchFailure>> {
        let steps = self.cases.steps(&self.times);
        let count = steps.len();
        let options = MarchOptions { memory: options.memory / count, ..*options };
        let mut workers = self.workers();
        let one_by_one = workers.is_empty();
        let stop = Stop::new(count);
        let Self { design, cases, linear, workspace, times, guide, .. } = self;
        let (design, guide, times) = (&*design, guide.as_ref(), &times[..]);
        let one =
            |case: usize, linear: &mut LinearSystem, workspace: &mut Workspace, observer: &mut dyn MarchObserver| {
                workspace.forget();
                let problem = cases.design(design, case);
                let ends: Vec<f64> = times[steps[case].clone()].iter().map(|time| time.t).collect();
                let load_path = LoadPath {
                    begin: LoadTime::start(case),
                    start: problem.model().rest(),
                    times: &ends,
                    steps_before: steps[case].start,
                    guide,
                    histories: problem.history_update(),
                };
                let marched = march(&mut Solver { problem, linear, workspace }, &load_path, &options, observer);
                if marched.is_err() {
                    stop.failed.fetch_min(case, Ordering::Relaxed);
                }
                marched
            };
        let of_worker = |case: usize, worker: &mut Worker| {
            let mut events = Buffered { case, stop: &stop, accepted: 0, retries: Vec::new() };
            let marched = one(case, &mut worker.linear, &mut worker.workspace, &mut events);
            (marched, events.retries)
        };
        let watched = Mutex::new(&mut *observer);
        let watch = || watched.lock().unwrap_or_else(PoisonError::into_inner);
        let own = |case: usize| {
            if one_by_one || case == 0 {
                let mut live = Live { case, stop: &stop, observer: &mut **watch() };
                (one(case, linear, workspace, &mut live), Vec::new())
            } else {
                let events = Buffered { case, stop: &stop, accepted: 0, retries: Vec::new() };
                let mut asking = Asking { events, observer: &**watch() };
                let marched = one(case, linear, workspace, &mut asking);
                (marched, asking.events.retries)
            }
        };
        let wait = || {
            if watch().cancelled() {
                stop.requested.store(true, Ordering::Relaxed);
            }
        };
        let marched = side_by_side(count, &mut workers, own, of_worker, wait);
        self.absorb(workers);
        let steps = self.cases.steps(&self.times);
        let mut path = Path::default();
        for ((case, (marched, retries)), steps) in marched.into_iter().enumerate().zip(steps) {
            let told = one_by_one || case == 0;
            match marched {
                Ok(next) => {
                    if !told {
                        replay(&next, &retries, observer);
                    }
                    let unfinished = next.steps < steps.end;
                    path.append(next);
                    if unfinished {
                        break;
                    }
                }
                Err(mut failure) => {
                    if !told {
                        replay(&failure.path, &retries, observer);
                    }
                    failure.failed_iterations += path.failed_iterations();
                    path.append(std::mem::take(&mut failure.path));
                    failure.path = path;
                    return Err(failure);
                }
            }
        }
        Ok(path)
    }

    /// Derivatives of the first responses along all load cases; `slopes` are those of each response
    /// with respect to the values of its terms at the user's steps.
    pub(super) fn sweep_all(
        &mut self,
        path: &Path,
        responses: &[&Response],
        slopes: &[Vec<Vec<f64>>],
        options: &SweepOptions,
    ) -> Result<Vec<PathGradient>, SweepError> {
        let steps = self.times.len();
        let states = path.load_cases();
        let mut workers = self.workers();
        let Self { design, cases, linear, workspace, .. } = self;
        let design = &*design;
        let one = |case: usize, linear: &mut LinearSystem, workspace: &mut Workspace| {
            let problem = cases.design(design, case);
            if states.len() > 1 {
                workspace.forget();
                linear.forget();
            }
            let mut adapter = Adapter::new(path, responses, slopes, steps, options.parameters);
            let mut solver = Solver { problem, linear, workspace };
            sweep_states(&mut solver, path, states[case].clone(), &mut adapter, options)
        };
        let own = |case: usize| one(case, linear, workspace);
        let of_worker = |case: usize, worker: &mut Worker| one(case, &mut worker.linear, &mut worker.workspace);
        let swept = side_by_side(states.len(), &mut workers, own, of_worker, || ());
        self.absorb(workers);
        let names = self.model().all_parameters();
        let mut gradients: Vec<PathGradient> = Vec::new();
        for (case, part) in swept.into_iter().enumerate() {
            let mut part = part?;
            if let Some(variation) = self.cases.variation(case) {
                for (name, derivative) in part.iter_mut().flat_map(|of| names.iter().zip(&mut of.parameters)) {
                    *derivative = variation.to_model(*name, *derivative);
                }
            }
            if gradients.is_empty() {
                gradients = part;
                continue;
            }
            for (to, from) in gradients.iter_mut().zip(&part) {
                to.design.iter_mut().zip(&from.design).for_each(|(to, from)| *to += from);
                to.parameters.iter_mut().zip(&from.parameters).for_each(|(to, from)| *to += from);
                to.positions.iter_mut().zip(&from.positions).for_each(|(to, from)| *to += from);
            }
        }
        for ((response, slopes), gradient) in responses.iter().zip(slopes).zip(&mut gradients) {
            add_density_derivative(&self.design, response, slopes, &mut gradient.design);
        }
        Ok(gradients)
    }
}

/// Passes the events of a load case on to the caller's observer at once.
struct Live<'a> {
    case: usize,
    stop: &'a Stop,
    observer: &'a mut dyn MarchObserver,
}

impl MarchObserver for Live<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        self.observer.on_event(event);
    }

    fn cancelled(&self) -> bool {
        if self.observer.cancelled() {
            self.stop.requested.store(true, Ordering::Relaxed);
        }
        self.stop.concerns(self.case)
    }
}

/// Keeps the events of a load case until those of the earlier ones have been passed on.
struct Buffered<'a> {
    case: usize,
    stop: &'a Stop,
    accepted: usize,
    retries: Vec<Retry>,
}

/// The same on the caller's thread, where the caller's observer can be asked whether to stop.
struct Asking<'a> {
    events: Buffered<'a>,
    observer: &'a dyn MarchObserver,
}

impl MarchObserver for Asking<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        self.events.on_event(event);
    }

    fn cancelled(&self) -> bool {
        if self.observer.cancelled() {
            self.events.stop.requested.store(true, Ordering::Relaxed);
        }
        self.events.cancelled()
    }
}

/// A failed attempt.
struct Retry {
    /// How many (sub-)steps were accepted before.
    after: usize,
    step: usize,
    failed: FailedAttempt,
    remedy: Remedy,
}

impl MarchObserver for Buffered<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        match *event {
            MarchEvent::Accepted { .. } => self.accepted += 1,
            MarchEvent::Retry { step, failed, remedy } => {
                self.retries.push(Retry { after: self.accepted, step, failed: failed.clone(), remedy });
            }
        }
    }

    fn cancelled(&self) -> bool {
        self.stop.concerns(self.case)
    }
}

/// Passes the events of a load case on, in their order.
fn replay(path: &Path, retries: &[Retry], observer: &mut dyn MarchObserver) {
    let mut retries = retries.iter().peekable();
    let mut retry = |accepted: usize, observer: &mut dyn MarchObserver| {
        while let Some(Retry { step, failed, remedy, .. }) = retries.next_if(|retry| retry.after <= accepted) {
            observer.on_event(&MarchEvent::Retry { step: *step, failed, remedy: *remedy });
        }
    };
    let states = (0..path.states.len()).filter(|&index| !path.states[index].rest);
    let mut accepted = 0;
    for index in states {
        retry(accepted, observer);
        // observers see histories that are not kept; load cases side by side are on one rank
        let state = &*path.accepted(index, &Alone);
        observer.on_event(&MarchEvent::Accepted { state, evaluated: None });
        accepted += 1;
    }
    retry(accepted, observer);
}
