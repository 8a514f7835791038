//! Objectives and constraints that Python gives an optimization.

use serde_json::{Map, Value};
use slipstick::analysis::ResponseRefused;
use slipstick::build::Problem;
use slipstick::case::Case;
use slipstick::design::{Bound, Constraint, ObservedSteps, Reduction, Response, Term};

use crate::compute::{add_quantity, find};
use crate::errors::Error;
use crate::quantity::{Definition, defined};

/// Load steps at which a quantity counts: `None` for the last one; an empty list for all.
type Steps = Option<Vec<usize>>;

/// Definitions of quantities; name, steps and weight of the terms of an objective; name, steps,
/// smallest and largest value of bounded quantities; and the record of all of these.
pub type Own = (Vec<Definition>, Vec<(String, Steps, f64)>, Vec<(String, Steps, Option<f64>, Option<f64>)>, String);

/// An objective and constraints other than those of the case.
#[derive(Default)]
pub struct Responses {
    quantities: Vec<Definition>,
    /// Empty: that of the case.
    objective: Vec<(String, Steps, f64)>,
    /// In addition to those of the case.
    constraints: Vec<(String, Steps, Option<f64>, Option<f64>)>,
}

impl Responses {
    /// The responses, and the record of them that the run keeps.
    pub fn of(own: Option<Own>) -> (Self, Option<String>) {
        own.map_or_else(Default::default, |(quantities, objective, constraints, record)| {
            (Self { quantities, objective, constraints }, Some(record))
        })
    }

    /// Whether there is an objective other than that of the case.
    pub fn have_objective(&self) -> bool {
        !self.objective.is_empty()
    }

    /// Replaces the objective and adds the constraints.
    ///
    /// # Errors
    /// [`Error::Input`] for an unknown quantity, steps outside the path, or a wrong derivative.
    pub fn apply(self, problem: &mut Problem) -> Result<(), Error> {
        for quantity in self.quantities {
            add_quantity(problem, defined(quantity))?;
        }
        let refused = |error: ResponseRefused| Error::input(error.to_string(), "choose steps of the load path");
        let cases = problem.load_cases.len().max(1);
        let each = problem.analysis.times.len() / cases;
        if !self.objective.is_empty() {
            let names: Vec<&str> = self.objective.iter().map(|(name, ..)| name.as_str()).collect();
            let name = names.join(" + ");
            let terms = self.objective.iter().map(|(name, steps, weight)| {
                Ok(Term { quantity: find(problem, name)?, steps: observed(name, steps, each)?, weight: *weight })
            });
            let terms = terms.collect::<Result<Vec<Term>, Error>>()?;
            let response = Response::new(name, terms, Reduction::Sum).in_load_cases(vec![1.0; cases]);
            problem.analysis.set_objective(response).map_err(refused)?;
        }
        let mut constraints = problem.analysis.constraints.clone();
        for (name, steps, least, largest) in &self.constraints {
            let quantity = find(problem, name)?;
            let steps = observed(name, steps, each)?;
            let observed: Vec<usize> = (1..=each).filter(|&step| steps.contains(step, each)).collect();
            let both = least.is_some() && largest.is_some();
            let bounds = [(largest.map(Bound::AtMost), "_max"), (least.map(Bound::AtLeast), "_min")];
            for (bound, suffix) in bounds.into_iter().filter_map(|(bound, suffix)| Some((bound?, suffix))) {
                for (case, &step) in (0..cases).flat_map(|case| observed.iter().map(move |step| (case, step))) {
                    // named as those of a case
                    let mut label = format!("{name}{}", if both { suffix } else { "" });
                    if observed.len() > 1 {
                        label += &format!("_{step}");
                    }
                    if cases > 1 {
                        label += &format!("_{}", problem.load_cases[case]);
                    }
                    let mut weights = vec![0.0; cases];
                    weights[case] = 1.0;
                    let term = Term { quantity: quantity.clone(), steps: ObservedSteps::Only(vec![step]), weight: 1.0 };
                    let response = Response::new(label, vec![term], Reduction::Sum).in_load_cases(weights);
                    constraints.push(Constraint { response, bound, corrected: true });
                }
            }
        }
        problem.analysis.set_constraints(constraints).map_err(refused)
    }
}

/// The load steps at which the quantity `name` counts, of `each` in a load case.
fn observed(name: &str, steps: &Steps, each: usize) -> Result<ObservedSteps, Error> {
    let observed = match steps.as_deref() {
        None => ObservedSteps::Last,
        Some([]) => ObservedSteps::All,
        Some(steps) => ObservedSteps::Only(steps.to_vec()),
    };
    let wrong = |error| Error::input(format!("`{name}`: {error}"), format!("the load path has steps 1 to {each}"));
    observed.check(each).map_err(wrong)?;
    Ok(observed)
}

/// The record with what a page says of the objective: its description and its unit.
pub fn described(record: &str, case: &Case, objective: &Response) -> Result<String, Error> {
    let failed = |error: serde_json::Error| Error::Internal(error.to_string());
    let mut record: Map<String, Value> = serde_json::from_str(record).map_err(failed)?;
    record.insert("about".into(), about(case, objective.terms()).into());
    record.insert("unit".into(), unit(case, objective.terms()).into());
    serde_json::to_string(&record).map_err(failed)
}

/// A weighted sum in words, like the description of an objective of a case.
fn about(case: &Case, terms: &[Term]) -> String {
    let same = terms.iter().all(|term| term.steps == terms[0].steps);
    let of = |term: &Term| {
        let name = format!("`{}`", term.quantity.name());
        let weighted = if term.weight == 1.0 { name } else { format!("{} × {name}", term.weight) };
        if same { weighted } else { format!("{weighted} {}", term.steps) }
    };
    let mut sum = terms.iter().map(of).collect::<Vec<_>>().join(" + ");
    if same {
        sum = if terms.len() > 1 { format!("({sum})") } else { sum };
        sum += &format!(", {}", terms[0].steps);
    }
    if !case.load_cases.is_empty() {
        sum += " of each load case";
    }
    sum
}

/// The unit of a sum, or its dimension where units have no names; empty for plain numbers and for
/// terms of different dimensions.
fn unit(case: &Case, terms: &[Term]) -> String {
    let dimension = terms[0].quantity.dimension();
    if terms.iter().any(|term| term.quantity.dimension() != dimension) {
        return String::new();
    }
    match case.units.bracket(dimension).trim_matches([' ', '[', ']']) {
        "" => dimension.symbol().to_owned(),
        unit => unit.to_owned(),
    }
}
