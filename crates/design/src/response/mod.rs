//! Responses: functions of quantities over the load path, to be minimised or bounded.
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

/// A function of quantities over the load path.
#[derive(Clone, Debug)]
pub struct Response {
    name: String,
    terms: Vec<Term>,
    reduction: Reduction,
    /// One weight for each load case, whose steps are consecutive.
    cases: Vec<f64>,
}

impl Response {
    /// Reduces the values of some terms to one number.
    pub fn new(name: impl Into<String>, terms: Vec<Term>, reduction: Reduction) -> Self {
        Self { name: name.into(), terms, reduction, cases: vec![1.0] }
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
        let mut slopes: Vec<Vec<f64>> = values.iter().map(|row| vec![0.0; row.len()]).collect();
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

    /// The contribution of each step to a sum; zero for other responses.
    pub fn step_values(&self, values: &[Vec<f64>]) -> Vec<f64> {
        let steps = values.first().map_or(0, Vec::len);
        let mut parts = vec![0.0; steps];
        if self.reduction == Reduction::Sum {
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

/// A bound on a response.
#[derive(Clone, Debug)]
pub struct Constraint {
    /// The bounded response.
    pub response: Response,
    /// The bound.
    pub bound: Bound,
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
}
