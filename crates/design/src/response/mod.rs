//! Responses: functions of quantities over the load path, to be minimized or bounded.
//!
//! A [`Response`] reads its quantities at chosen steps, and reduces the values to one number. The
//! values are a table with a row for each [`Term`] and a column for each load step, through all
//! load cases; the derivatives of the response with respect to the entries of the table are the
//! weights with which the quantities are pulled back.

mod curve;
mod steps;

pub use curve::{Curve, CurveError};
pub use steps::ObservedSteps;

use crate::quantity::{Dimension, Quantity};
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;
use std::sync::Arc;

/// A quantity at chosen load steps, times a weight.
#[derive(Clone)]
pub struct Term {
    /// The quantity.
    pub quantity: Arc<dyn Quantity>,
    /// The steps at which it counts, in each load case.
    pub steps: ObservedSteps,
    /// Its factor.
    pub weight: f64,
}

impl fmt::Debug for Term {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.weight, self.quantity.name(), self.steps)
    }
}

/// How the values at the observed steps become one number.
#[derive(Clone, Debug, PartialEq)]
pub enum Reduction {
    /// Their sum, each times the weight of its term and its load case.
    Sum,
    /// The largest of them, each times the weight of its term. It has a kink where the two largest
    /// are equal.
    Largest,
    /// The distance of the first term's quantity from given points, times its weight.
    Distance(Curve),
}

/// How the values of several load cases, θ_c with weight w_c, become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OverLoadCases {
    /// Σ w_c θ_c.
    #[default]
    Sum,
    /// Σ w_c θ_c / Σ w_c.
    Mean,
    /// Mean plus this multiple of the standard deviation, with w_c/Σ w as probabilities. It has a
    /// kink where all θ_c are equal; there, the derivative is that of the mean.
    MeanPlusDeviations(f64),
    /// The largest w_c θ_c. It has a kink where the two largest are equal; an optimization bounds
    /// all of them instead ([`Response::parts`]).
    Worst,
}

/// A function of quantities over the load path.
#[derive(Clone, Debug)]
pub struct Response {
    name: String,
    terms: Vec<Term>,
    reduction: Reduction,
    /// One weight for each load case, whose steps are consecutive.
    cases: Vec<f64>,
    over: OverLoadCases,
}

impl Response {
    /// Reduces the values of some terms to one number.
    pub fn new(name: impl Into<String>, terms: Vec<Term>, reduction: Reduction) -> Self {
        Self { name: name.into(), terms, reduction, cases: vec![1.0], over: OverLoadCases::Sum }
    }

    /// The sum of a quantity over steps, times a weight; it has the quantity's name.
    pub fn of(quantity: Arc<dyn Quantity>, steps: ObservedSteps, weight: f64) -> Self {
        let name = quantity.name().to_owned();
        Self::new(name, vec![Term { quantity, steps, weight }], Reduction::Sum)
    }

    /// The same for several load cases, with a weight for each; those with weight 0 do not count.
    /// The steps of a case are counted from 1.
    pub fn in_load_cases(mut self, weights: Vec<f64>) -> Self {
        self.cases = weights;
        self
    }

    /// The values of the load cases become one in this way.
    pub fn over_load_cases(mut self, over: OverLoadCases) -> Self {
        self.over = over;
        self
    }

    /// The functions whose largest is the response: those of the single load cases with a weight if
    /// the worst counts, otherwise only the response itself.
    pub fn parts(&self) -> Vec<Self> {
        match self.over {
            OverLoadCases::Worst => self.counted().map(|case| self.part(case, self.cases[case])).collect(),
            _ => vec![self.clone()],
        }
    }

    /// The load cases of the [`parts`](Self::parts); `None` if there is only one part.
    pub fn worst_of(&self) -> Option<Vec<usize>> {
        (self.over == OverLoadCases::Worst).then(|| self.counted().collect())
    }

    /// The load cases with a weight.
    fn counted(&self) -> impl Iterator<Item = usize> {
        (0..self.cases.len()).filter(|&case| self.cases[case] != 0.0)
    }

    /// The response of one load case, times a factor.
    fn part(&self, case: usize, factor: f64) -> Self {
        let terms = self.terms.iter().cloned().map(|term| Term { weight: factor * term.weight, ..term });
        let mut cases = vec![0.0; self.cases.len()];
        cases[case] = 1.0;
        Self { terms: terms.collect(), cases, over: OverLoadCases::Sum, ..self.clone() }
    }

    /// The same response of the extremes for which smooth quantities stand; `None` if none of its
    /// quantities is smooth in this sense. Only its values may be used.
    pub fn extreme(&self) -> Option<Self> {
        let extremes: Vec<_> = self.terms.iter().map(|term| term.quantity.extreme()).collect();
        extremes.iter().any(Option::is_some).then(|| {
            let terms = self.terms.iter().cloned().zip(extremes);
            let terms = terms.map(|(term, extreme)| Term { quantity: extreme.unwrap_or(term.quantity), ..term });
            Self { terms: terms.collect(), ..self.clone() }
        })
    }

    /// Name for reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The quantities and their steps.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Number of the load case, from 0; the step within it, from 1; and its number of steps.
    pub fn place(&self, step: usize, steps: usize) -> (usize, usize, usize) {
        let each = (steps / self.cases.len()).max(1);
        let case = (step.saturating_sub(1) / each).min(self.cases.len() - 1);
        (case, step - case * each, each)
    }

    /// Whether the value of a term at step `step` (from 1, through all load cases) of `steps`
    /// counts.
    pub fn term_observes(&self, term: usize, step: usize, steps: usize) -> bool {
        let (case, local, each) = self.place(step, steps);
        match &self.reduction {
            _ if self.cases[case] == 0.0 => false,
            Reduction::Distance(_) => true,
            Reduction::Sum | Reduction::Largest => self.terms[term].steps.contains(local, each),
        }
    }

    /// Whether any value at a step counts.
    pub fn observes(&self, step: usize, steps: usize) -> bool {
        (0..self.terms.len()).any(|term| self.term_observes(term, step, steps))
    }

    /// Whether its value depends on the states, and not only on the densities.
    pub fn depends_on_state(&self) -> bool {
        self.terms.iter().any(|term| term.quantity.depends_on_state())
    }

    /// The dimension of a sum of quantities of the same dimension; `None` for anything else, whose
    /// round-off is not known.
    pub fn dimension(&self) -> Option<Dimension> {
        let dimension = self.terms.first()?.quantity.dimension();
        let same = self.terms.iter().all(|term| term.quantity.dimension() == dimension);
        (same && self.reduction == Reduction::Sum).then_some(dimension)
    }

    /// Whether it is a sum of its terms.
    pub fn is_sum(&self) -> bool {
        self.reduction == Reduction::Sum
    }

    /// Whether any of its quantities is a sum over the path.
    pub fn accumulates(&self) -> bool {
        self.terms.iter().any(|term| term.quantity.accumulates())
    }

    /// Whether all its quantities vanish where contact is open.
    pub fn needs_contact(&self) -> bool {
        self.terms.iter().all(|term| term.quantity.needs_contact())
    }

    /// The value, and its derivatives with respect to the entries of the table: `values[term][step
    /// − 1]`, of which those that are not observed are ignored. `times` are the ends of the steps.
    pub fn reduce(&self, values: &[Vec<f64>], times: &[f64]) -> (f64, Vec<Vec<f64>>) {
        match self.over {
            OverLoadCases::Sum => self.reduce_sum(values, times),
            OverLoadCases::Worst => {
                let parts = self.parts();
                let parts = parts.iter().map(|part| part.reduce_sum(values, times));
                let larger = |a: (f64, Vec<Vec<f64>>), b: (f64, Vec<Vec<f64>>)| {
                    if b.0 > a.0 || b.0.is_nan() { b } else { a }
                };
                parts.reduce(larger).unwrap_or_else(|| (0.0, zeros(values)))
            }
            OverLoadCases::Mean => self.mean_plus_deviations(0.0, values, times),
            OverLoadCases::MeanPlusDeviations(factor) => self.mean_plus_deviations(factor, values, times),
        }
    }

    fn mean_plus_deviations(&self, factor: f64, values: &[Vec<f64>], times: &[f64]) -> (f64, Vec<Vec<f64>>) {
        let parts: Vec<(f64, f64, Vec<Vec<f64>>)> = self
            .counted()
            .map(|case| {
                let (value, slopes) = self.part(case, 1.0).reduce_sum(values, times);
                (self.cases[case], value, slopes)
            })
            .collect();
        let all: f64 = parts.iter().map(|part| part.0).sum();
        let mean = parts.iter().map(|(weight, value, _)| weight / all * value).sum::<f64>();
        let variance: f64 = parts.iter().map(|(weight, value, _)| weight / all * (value - mean).powi(2)).sum();
        let deviation = variance.sqrt();
        let mut slopes = zeros(values);
        for (weight, value, of_part) in &parts {
            let off = if deviation > 0.0 { (value - mean) / deviation } else { 0.0 };
            let by_value = weight / all * (1.0 + factor * off);
            let both = slopes.iter_mut().flatten().zip(of_part.iter().flatten());
            both.for_each(|(to, from)| *to += by_value * from);
        }
        (mean + factor * deviation, slopes)
    }

    /// As [`reduce`](Self::reduce), with the weighted sum over the load cases.
    fn reduce_sum(&self, values: &[Vec<f64>], times: &[f64]) -> (f64, Vec<Vec<f64>>) {
        let mut slopes = zeros(values);
        let value = match &self.reduction {
            Reduction::Sum => {
                let parts = self.step_values(values);
                self.each(times.len(), |term, step| {
                    slopes[term][step - 1] = self.cases[self.place(step, times.len()).0] * self.terms[term].weight;
                });
                parts.iter().sum()
            }
            Reduction::Largest => {
                let mut largest: Option<(f64, usize, usize)> = None;
                self.each(times.len(), |term, step| {
                    let value = self.terms[term].weight * values[term][step - 1];
                    if largest.is_none_or(|(known, ..)| value > known || value.is_nan()) {
                        largest = Some((value, term, step));
                    }
                });
                largest.map_or(0.0, |(value, term, step)| {
                    slopes[term][step - 1] = self.terms[term].weight;
                    value
                })
            }
            Reduction::Distance(curve) => {
                let weight = self.terms[0].weight;
                let (distance, slope) = curve.distance(&values[0], times);
                slopes[0] = slope.into_iter().map(|slope| weight * slope).collect();
                weight * distance
            }
        };
        (value, slopes)
    }

    /// The values of the load cases that count, with their numbers: with their weights, except for a
    /// [mean](Self::is_mean), which weighs them itself.
    pub fn in_each_load_case(&self, values: &[Vec<f64>], times: &[f64]) -> Vec<(usize, f64)> {
        let of = |case: usize| {
            let weight = if self.is_mean() { 1.0 } else { self.cases[case] };
            (case, self.part(case, weight).reduce_sum(values, times).0)
        };
        self.counted().map(of).collect()
    }

    /// Whether it is a mean over the load cases, with or without deviations.
    pub fn is_mean(&self) -> bool {
        matches!(self.over, OverLoadCases::Mean | OverLoadCases::MeanPlusDeviations(_))
    }

    /// Whether it is the sum of its contributions at all steps of all load cases.
    pub fn adds_up(&self) -> bool {
        self.reduction == Reduction::Sum && self.over == OverLoadCases::Sum
    }

    /// The contribution of each step to a sum; zero for other responses.
    pub fn step_values(&self, values: &[Vec<f64>]) -> Vec<f64> {
        let steps = values.first().map_or(0, Vec::len);
        let mut parts = vec![0.0; steps];
        if self.adds_up() {
            self.each(steps, |term, step| {
                let weight = self.cases[self.place(step, steps).0] * self.terms[term].weight;
                parts[step - 1] += weight * values[term][step - 1];
            });
        }
        parts
    }

    /// Visits the observed steps of every term.
    fn each(&self, steps: usize, mut visit: impl FnMut(usize, usize)) {
        for term in 0..self.terms.len() {
            (1..=steps).filter(|&step| self.term_observes(term, step, steps)).for_each(|step| visit(term, step));
        }
    }
}

fn zeros(values: &[Vec<f64>]) -> Vec<Vec<f64>> {
    values.iter().map(|row| vec![0.0; row.len()]).collect()
}

/// A bound on a response.
#[derive(Clone, Debug)]
pub struct Constraint {
    /// The bounded response.
    pub response: Response,
    /// The bound.
    pub bound: Bound,
    /// Whether the bound holds for the extreme itself where a smooth measure errs on the unsafe side
    /// ([`Bound::correction`]).
    pub corrected: bool,
}

/// A bound on a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// From above.
    AtMost(f64),
    /// From below.
    AtLeast(f64),
}

impl Bound {
    /// g ≤ 0 where the bound is met, and ∂g/∂value: the distance from the bound, relative to its
    /// magnitude unless it is 0.
    pub fn violation(self, value: f64) -> (f64, f64) {
        let (sign, bound) = match self {
            Self::AtMost(bound) => (1.0, bound),
            Self::AtLeast(bound) => (-1.0, bound),
        };
        let slope = if bound == 0.0 { sign } else { sign / bound.abs() };
        (slope * (value - bound), slope)
    }

    /// What to add to a smooth value so that the bound holds for the extreme for which it stands; 0 if
    /// the smooth value is on the safe side, as a p-norm below an upper bound is.
    ///
    /// The optimizer holds it constant within an iteration, so that derivatives stay exact, and adapts
    /// it in the next. Le et al. (2010) adapt a factor; a difference also works where the extreme is 0,
    /// as at open nodes.
    pub fn correction(self, smooth: f64, extreme: f64) -> f64 {
        if self.violation(extreme).0 > self.violation(smooth).0 { extreme - smooth } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::{Compliance, Volume};

    fn term(steps: ObservedSteps, weight: f64) -> Term {
        Term { quantity: Arc::new(Compliance::default()), steps, weight }
    }

    fn check_slopes(response: &Response, values: &[Vec<f64>], times: &[f64]) {
        let (_, slopes) = response.reduce(values, times);
        for (term, row) in slopes.iter().enumerate() {
            for (step, slope) in row.iter().enumerate() {
                let moved = |h: f64| {
                    let mut moved = values.to_vec();
                    moved[term][step] += h;
                    response.reduce(&moved, times).0
                };
                let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((difference - slope).abs() < 1e-9, "{term} {step}: {slope} instead of {difference}");
            }
        }
    }

    /// Three cases of four steps, of which the last and the second are observed: weights computed
    /// by hand, derivatives by differences.
    #[test]
    fn weights_and_steps_of_each_case() {
        let response = Response::new("sum", vec![term(ObservedSteps::Only(vec![2, 4]), -1.0)], Reduction::Sum)
            .in_load_cases(vec![1.0, 0.25, 2.0]);
        let observed: Vec<usize> = (1..=12).filter(|&step| response.observes(step, 12)).collect();
        assert_eq!(observed, [2, 4, 6, 8, 10, 12]);
        let values = [(1..=12).map(f64::from).collect::<Vec<f64>>()];
        let times: Vec<f64> = (1..=12).map(f64::from).collect();
        assert_eq!(response.reduce(&values, &times).0, -(2.0 + 4.0) - 0.25 * (6.0 + 8.0) - 2.0 * (10.0 + 12.0));
        assert_eq!(response.step_values(&values)[5], -0.25 * 6.0);
        check_slopes(&response, &values, &times);
    }

    /// By hand: three cases of weights 1, 2 and 1 with θ = 3, 5 and 11, and a case without weight.
    #[test]
    fn several_load_cases_become_one() {
        let of = |over| {
            Response::new("sum", vec![term(ObservedSteps::Last, 1.0)], Reduction::Sum)
                .in_load_cases(vec![1.0, 2.0, 0.0, 1.0])
                .over_load_cases(over)
        };
        let values = [vec![9.0, 3.0, 9.0, 5.0, 9.0, 90.0, 9.0, 11.0]];
        let times: Vec<f64> = (1..=8).map(f64::from).collect();
        let reduce = |over| of(over).reduce(&values, &times).0;
        assert_eq!((reduce(OverLoadCases::Sum), reduce(OverLoadCases::Worst)), (24.0, 11.0));
        assert_eq!(
            (of(OverLoadCases::Worst).worst_of(), of(OverLoadCases::Sum).worst_of()),
            (Some(vec![0, 1, 3]), None)
        );
        let parts: Vec<f64> =
            of(OverLoadCases::Worst).parts().iter().map(|part| part.reduce(&values, &times).0).collect();
        assert_eq!(parts, [3.0, 10.0, 11.0]);
        assert_eq!(reduce(OverLoadCases::Mean), 6.0);
        // variance (9 + 2 · 1 + 25)/4
        assert_eq!(reduce(OverLoadCases::MeanPlusDeviations(0.5)), 6.0 + 0.5 * 3.0);
        for over in
            [OverLoadCases::Sum, OverLoadCases::Mean, OverLoadCases::Worst, OverLoadCases::MeanPlusDeviations(0.5)]
        {
            check_slopes(&of(over), &values, &times);
        }
        let equal = [vec![4.0; 8]];
        let (value, slopes) = of(OverLoadCases::MeanPlusDeviations(2.0)).reduce(&equal, &times);
        assert_eq!((value, slopes[0][1], slopes[0][3]), (4.0, 0.25, 0.5));
    }

    /// By hand: the largest of 2 × the first quantity at the last step and 1 × the second at all
    /// steps.
    #[test]
    fn the_largest_of_several() {
        let terms = vec![term(ObservedSteps::Last, 2.0), term(ObservedSteps::All, 1.0)];
        let response = Response::new("largest", terms, Reduction::Largest);
        let (values, times) = ([vec![9.0, 1.0, 2.0], vec![1.0, 5.0, 3.0]], [0.2, 0.7, 1.0]);
        assert_eq!(response.reduce(&values, &times).0, 5.0);
        check_slopes(&response, &values, &times);
        assert!(response.reduce(&[vec![9.0, 1.0, f64::NAN], vec![1.0, 5.0, 3.0]], &times).0.is_nan());
    }

    #[test]
    fn the_distance_from_a_curve() {
        let curve = Curve::new(vec![(0.1, 0.5), (0.7, 2.0), (1.0, -1.0)]).unwrap();
        let response = Response::new("distance", vec![term(ObservedSteps::All, 3.0)], Reduction::Distance(curve));
        let (values, times) = ([vec![1.0, 1.8, 0.3]], [0.2, 0.8, 1.0]);
        check_slopes(&response, &values, &times);
    }

    #[test]
    fn dimensions_are_those_of_sums() {
        let volume = Term { quantity: Arc::new(Volume::new("v", vec![1.0])), steps: ObservedSteps::Last, weight: 1.0 };
        let of = |terms, reduction| Response::new("x", terms, reduction).dimension();
        assert_eq!(of(vec![volume.clone()], Reduction::Sum), Some(Dimension::VOLUME));
        assert_eq!(of(vec![volume.clone(), term(ObservedSteps::Last, 1.0)], Reduction::Sum), None);
        assert_eq!(of(vec![volume.clone()], Reduction::Largest), None);
        assert!(!Response::new("x", vec![volume], Reduction::Sum).depends_on_state());
    }

    #[test]
    fn violations_by_hand() {
        assert_eq!(Bound::AtMost(-4.0).violation(-3.0), (0.25, 0.25));
        assert_eq!(Bound::AtLeast(2.0).violation(3.0), (-0.5, -0.5));
        assert_eq!(Bound::AtMost(0.0).violation(3.0), (3.0, 1.0));
    }

    /// Only values on the unsafe side are corrected, to the extreme.
    #[test]
    fn corrections_make_smooth_values_safe() {
        let (least, most) = (Bound::AtLeast(0.5), Bound::AtMost(2.0));
        // a smooth minimum lies above the true one, and a p-norm above the largest value
        assert_eq!(least.correction(0.5, 0.25), -0.25);
        assert_eq!(least.violation(0.5 + least.correction(0.5, 0.25)).0, 0.5);
        assert_eq!((least.correction(0.4, 0.5), most.correction(2.5, 2.0)), (0.0, 0.0));
        assert_eq!(most.correction(1.0, 1.5), 0.5);
        assert_eq!(Bound::AtLeast(0.0).correction(0.25, 0.0), -0.25);
        assert_eq!(least.correction(0.5, f64::NAN), 0.0);
    }
}
