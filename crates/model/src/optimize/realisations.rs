//! The designs that the same variables give: the nominal one and, on request, an eroded and a
//! dilated one.

use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

use super::functions::Designs;
use super::maps::Maps;
use super::{FunctionRecord, PrepareError};
use crate::analysis::{Analysis, AnalysisError, Forward};
use crate::problem::Problem;
use crate::side_by_side::{Stop, side_by_side};
use slipstick_design::{DensityMap, DesignVariables, ElementValues, MapParameter, Schedule, VariableValues};
use slipstick_path::{Guide, MarchEvent, MarchObserver};
use slipstick_solid::EnergyInterpolation;

/// The realizations of a design, with an analysis for each.
pub(super) struct Realisations {
    /// Of the nominal design, then of the eroded and the dilated one.
    maps: Vec<Maps>,
    /// Analyses of the eroded and the dilated design.
    others: Vec<Analysis>,
}

/// Names of three realizations.
const NAMES: [&str; 3] = ["nominal", "eroded", "dilated"];

impl Realisations {
    /// Only the nominal design; with a margin, also designs with the thresholds η + `margin` and η −
    /// `margin`. The memory for factors and histories is divided among the analyses.
    pub fn new(
        problem: &mut Problem,
        map: DensityMap,
        schedule: &Schedule,
        margin: Option<f64>,
    ) -> Result<Self, PrepareError> {
        let mut maps = vec![Maps::new(map.clone(), schedule)?];
        let Some(margin) = margin else { return Ok(Self { maps, others: Vec::new() }) };
        let threshold = map.parameter(MapParameter::Threshold).ok_or(PrepareError::NoProjection)?;
        for threshold in [threshold + margin, threshold - margin] {
            let map = map.with(MapParameter::Threshold, threshold).map_err(PrepareError::Margin)?;
            maps.push(Maps::new(map, schedule)?);
        }
        problem.analysis.march.memory /= maps.len();
        let others = [(); 2].map(|()| problem.analysis.another());
        Ok(Self { maps, others: others.into() })
    }

    /// Number of realizations.
    pub fn count(&self) -> usize {
        self.maps.len()
    }

    /// Names of the parts of the objective; empty if there is only one.
    pub fn part_names(&self, problem: &Problem) -> Vec<String> {
        let worst_of = problem.analysis.objective.as_ref().and_then(|objective| objective.worst_of());
        let cases: Vec<&str> = match &worst_of {
            Some(cases) => cases.iter().map(|&case| problem.load_cases.get(case).map_or("", |name| name)).collect(),
            None => vec![""],
        };
        let realisations = if self.count() == 1 { &[""][..] } else { &NAMES[..] };
        if cases.len() * realisations.len() == 1 {
            return Vec::new();
        }
        let name = |realisation: &str, case: &str| match (realisation, case) {
            ("", name) | (name, "") => name.to_owned(),
            (realisation, case) => format!("{realisation}_{case}"),
        };
        realisations.iter().flat_map(|of| cases.iter().map(move |case| name(of, case))).collect()
    }

    /// The variables, the same for all realizations and iterations.
    pub fn variables(&self) -> &DesignVariables {
        self.maps[0].variables()
    }

    /// The map of the nominal design.
    pub fn map(&self, iteration: usize, divided: &[usize]) -> &DensityMap {
        self.map_of(0, iteration, divided)
    }

    pub fn map_of(&self, realisation: usize, iteration: usize, divided: &[usize]) -> &DensityMap {
        self.maps[realisation].at(iteration, divided)
    }

    pub fn densities(&self, iteration: usize, divided: &[usize], x: &VariableValues) -> Vec<ElementValues> {
        self.maps.iter().map(|maps| maps.at(iteration, divided).densities(x)).collect()
    }

    /// Whether the sharpness rises at an iteration, and may do so in two parts.
    pub fn can_divide(&self, iteration: usize) -> bool {
        self.maps[0].can_divide(iteration)
    }

    pub fn set_penalization(&mut self, nominal: &mut Analysis, p: f64) {
        nominal.set_penalization(p);
        self.others.iter_mut().for_each(|analysis| analysis.set_penalization(p));
    }

    pub fn set_energy_interpolation(&mut self, nominal: &mut Analysis, energy: Option<EnergyInterpolation>) {
        nominal.set_energy_interpolation(energy);
        self.others.iter_mut().for_each(|analysis| analysis.set_energy_interpolation(energy));
    }

    /// From now on, the marches follow the paths of these designs.
    pub fn follow(&mut self, designs: &Designs) {
        for (analysis, forward) in self.others.iter_mut().zip(&designs.forwards[1..]) {
            analysis.guide = Some(Guide::of(&forward.path, analysis.linear.ranks()));
        }
    }

    /// The paths that the marches of the eroded and the dilated design follow.
    pub fn guides(&self) -> impl Iterator<Item = &Guide> {
        self.others.iter().filter_map(|analysis| analysis.guide.as_ref())
    }

    pub fn set_guides(&mut self, guides: Vec<Guide>) {
        self.others.iter_mut().zip(guides).for_each(|(analysis, guide)| analysis.guide = Some(guide));
    }

    /// Runs `on_this` on this thread, beginning with the nominal design, and `on_others` on further
    /// threads, if there are some.
    fn each<T: Send>(
        &mut self,
        nominal: &mut Analysis,
        mut on_this: impl FnMut(usize, &mut Analysis) -> T,
        on_others: impl Fn(usize, &mut Analysis) -> T + Sync,
        wait: impl FnMut(),
    ) -> Vec<T> {
        if self.others.is_empty() {
            return vec![on_this(0, nominal)];
        }
        let threads = self.maps.len().min(nominal.at_once());
        // the load cases of each share its thread
        nominal.cases.one_by_one = threads > 1;
        for analysis in &mut self.others {
            analysis.cases.one_by_one = threads > 1;
            analysis.linear.interrupt_with(&nominal.linear);
        }
        let others: Vec<Mutex<&mut Analysis>> = self.others.iter_mut().map(Mutex::new).collect();
        let other = |number: usize| others[number - 1].lock().unwrap_or_else(PoisonError::into_inner);
        let on_this = |number: usize| match number {
            0 => on_this(0, nominal),
            _ => on_this(number, &mut other(number)),
        };
        let on_others = |number: usize, (): &mut ()| on_others(number, &mut other(number));
        side_by_side(self.maps.len(), &mut vec![(); threads - 1], on_this, on_others, wait)
    }

    /// Marches with the densities of all realizations. The observer sees the events of the nominal
    /// design. If another design fails, the nominal analysis gets its densities, for reports.
    pub fn march(
        &mut self,
        nominal: &mut Analysis,
        densities: Vec<ElementValues>,
        observer: &mut dyn MarchObserver,
    ) -> Result<Designs, AnalysisError> {
        if self.others.is_empty() {
            let forward = nominal.forward(&densities[0], observer)?;
            return Ok(Designs { forwards: vec![forward] });
        }
        let stop = Stop::new(self.maps.len());
        let watched = Mutex::new(observer);
        let watch = || watched.lock().unwrap_or_else(PoisonError::into_inner);
        let note = |number: usize, result: Result<Forward, AnalysisError>| {
            if result.is_err() {
                stop.failed.fetch_min(number, Ordering::Relaxed);
            }
            result
        };
        let on_this = |number: usize, analysis: &mut Analysis| {
            let mut live = Live { number, stop: &stop, observer: &mut **watch() };
            note(number, analysis.forward(&densities[number], &mut live))
        };
        let on_others = |number: usize, analysis: &mut Analysis| {
            note(number, analysis.forward(&densities[number], &mut Quiet { number, stop: &stop }))
        };
        let wait = || {
            if watch().cancelled() {
                stop.requested.store(true, Ordering::Relaxed);
            }
        };
        let marched = self.each(nominal, on_this, on_others, wait);
        let mut forwards = Vec::new();
        for (number, result) in marched.into_iter().enumerate() {
            match result {
                Ok(forward) => forwards.push(forward),
                Err(error) => {
                    if number == 0 {
                        return Err(error);
                    }
                    nominal.set_density(&densities[number]);
                    return Err(AnalysisError::Realisation { design: NAMES[number], source: Box::new(error) });
                }
            }
        }
        Ok(Designs { forwards })
    }

    /// For each realization, the derivatives of the parts of the objective and of the constraints
    /// with respect to its densities.
    pub fn gradients(
        &mut self,
        nominal: &mut Analysis,
        designs: &Designs,
    ) -> Result<Vec<Vec<ElementValues>>, AnalysisError> {
        let of = |analysis: &mut Analysis, forward: &Forward| -> Result<Vec<ElementValues>, AnalysisError> {
            let gradients = analysis.response_gradients(forward, false)?;
            Ok(gradients.into_iter().map(|gradient| gradient.density).collect())
        };
        let of = |number: usize, analysis: &mut Analysis| of(analysis, &designs.forwards[number]);
        self.each(nominal, of, of, || ()).into_iter().collect()
    }

    /// dθ/dφ of the nominal design, if θ depends on no other design: the sum of the gradients of the
    /// parts, with their multipliers.
    pub fn derivative(&self, gradients: Vec<Vec<ElementValues>>, parts: &[FunctionRecord]) -> Option<ElementValues> {
        if !self.others.is_empty() {
            return None;
        }
        let mut gradients = gradients.into_iter().next()?.into_iter();
        if parts.is_empty() {
            return gradients.next();
        }
        let mut sum: Option<ElementValues> = None;
        for (gradient, part) in gradients.zip(parts) {
            let sum = sum.get_or_insert_with(|| vec![0.0; gradient.len()].into());
            let share = part.multiplier.unwrap_or(0.0);
            sum.iter_mut().zip(&gradient).for_each(|(to, from)| *to += share * from);
        }
        sum
    }
}

/// Passes the events of the nominal design on, and asks whether to stop.
struct Live<'a> {
    number: usize,
    stop: &'a Stop,
    observer: &'a mut dyn MarchObserver,
}

impl MarchObserver for Live<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        if self.number == 0 {
            self.observer.on_event(event);
        }
    }

    fn cancelled(&self) -> bool {
        if self.observer.cancelled() {
            self.stop.requested.store(true, Ordering::Relaxed);
        }
        self.stop.concerns(self.number)
    }
}

/// Watches the march of another design on another thread.
struct Quiet<'a> {
    number: usize,
    stop: &'a Stop,
}

impl MarchObserver for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.stop.concerns(self.number)
    }
}
