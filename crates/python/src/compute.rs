//! Computations with a problem: their observers, quantities, responses and notices.

use std::sync::Arc;

use pyo3::prelude::*;
use slipstick::analysis::{AnalysisError, Forward, ForwardNotice};
use slipstick::build::Problem;
use slipstick::design::quantity::{Quantity, WrongDerivative};
use slipstick::design::{ElementValues, ObservedSteps, Reduction, Response, Term};
use slipstick::overlaps::OpenOverlap;
use slipstick::quantities::column_names;

use crate::errors::Error;
use crate::interrupt::Watch;
use crate::quantity::{Defined, take_raised};

/// Computes with a problem until Ctrl-C, or an exception of `progress`, stops it.
pub fn watched<T>(
    problem: &mut Problem,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&mut Problem, &mut Watch) -> Result<T, Error>,
) -> Result<T, Error> {
    // of an earlier call
    drop(take_raised());
    let mut watch = Watch::new(progress, None);
    problem.analysis.linear.set_interrupt(Some(watch.interrupt()));
    let result = work(problem, &mut watch);
    problem.analysis.linear.set_interrupt(None);
    let raised = raised();
    // an interrupted computation reports the interruption, not its incomplete result
    watch.check()?;
    raised?;
    result
}

/// Adds a quantity, once its derivatives are known to be right.
///
/// # Errors
/// [`Error::Input`] if they are wrong, or if the name is taken; the exception of the quantity.
pub fn add_quantity(problem: &mut Problem, quantity: Defined) -> Result<(), Error> {
    let name = quantity.name();
    let taken = column_names(&problem.mesh, problem.analysis.model());
    if taken.iter().any(|taken| taken == name) || problem.quantities.iter().any(|quantity| quantity.name() == name) {
        return Err(Error::input(format!("there is a quantity called `{name}` already"), "choose another name"));
    }
    let checked = problem.analysis.check_quantity(&quantity);
    raised()?;
    checked.map_err(|wrong| {
        let WrongDerivative { name, step, argument, derivative, difference } = wrong;
        let message = format!(
            "quantity `{name}` at step {step}: its derivative with respect to the {argument} is {derivative:e} \
             along a direction in which differences of its value give {difference:e}"
        );
        let cure = "correct `derivative`, which returns the partial derivatives with respect to each field of \
                    the state that `value` uses, with the other fields fixed";
        Error::input(message, cure)
    })?;
    problem.quantities.push(Arc::new(quantity));
    Ok(())
}

/// The exception of a quantity that was defined in Python.
pub fn raised() -> Result<(), Error> {
    take_raised().map_or(Ok(()), |error| Err(Error::Python(error)))
}

/// A complete forward analysis.
pub fn forward(problem: &mut Problem, density: &ElementValues, watch: &mut Watch) -> Result<Forward, Error> {
    let forward = problem.analysis.forward(density, watch);
    complete(problem, forward)
}

/// A forward analysis that has reached the end of the load path.
pub fn complete(problem: &Problem, forward: Result<Forward, AnalysisError>) -> Result<Forward, Error> {
    let forward = forward.map_err(|error| Error::analysis(problem, &error))?;
    let (steps, all) = (forward.path.steps, problem.analysis.times.len());
    if steps < all {
        return Err(Error::analysis(problem, &AnalysisError::Unfinished { steps, all }));
    }
    Ok(forward)
}

/// Computes with another objective and without constraints, which are then restored.
pub fn observing<T>(problem: &mut Problem, response: &Response, work: impl FnOnce(&mut Problem) -> T) -> T {
    let objective = problem.analysis.objective.replace(response.clone());
    let constraints = std::mem::take(&mut problem.analysis.constraints);
    let result = work(problem);
    problem.analysis.objective = objective;
    problem.analysis.constraints = constraints;
    result
}

/// The quantity of this name.
pub fn find(problem: &Problem, name: &str) -> Result<Arc<dyn Quantity>, Error> {
    let found = problem.quantities.iter().find(|quantity| quantity.name() == name);
    found.cloned().ok_or_else(|| Error::input(format!("there is no quantity called `{name}`"), known(problem)))
}

/// The available quantities, for messages.
pub fn known(problem: &Problem) -> String {
    let known: Vec<&str> = problem.quantities.iter().map(|quantity| quantity.name()).collect();
    match known.is_empty() {
        true => "the case has none: add a [[quantity]]".to_owned(),
        false => format!("quantities of the case: {}", known.join(", ")),
    }
}

/// The quantities of these names at every step of every load case.
pub fn response(problem: &Problem, names: &[String]) -> Result<Response, Error> {
    let term = |name: &String| Ok(Term { quantity: find(problem, name)?, steps: ObservedSteps::All, weight: 1.0 });
    let terms = names.iter().map(term).collect::<Result<Vec<Term>, Error>>()?;
    if terms.is_empty() {
        return Err(Error::input("no quantity is named", known(problem)));
    }
    Ok(in_cases(problem, Response::new("quantities", terms, Reduction::Sum)))
}

/// A response that counts in every load case.
pub fn in_cases(problem: &Problem, response: Response) -> Response {
    response.in_load_cases(vec![1.0; problem.load_cases.len().max(1)])
}

pub fn no_objective() -> Error {
    Error::input("the case has no objective", "add an [objective], or differentiate quantities with `vjp`")
}

/// Notices about the value of a path.
pub fn notice(forward: &Forward) -> Option<String> {
    let rounding = forward.rounding.as_ref().map(|rounding| format!("{rounding}; so are its derivatives"));
    rounding.or_else(|| forward.notice.as_ref().map(ForwardNotice::to_string))
}

/// A notice together with overlaps of bodies without a contact force.
pub fn noticed(notice: Option<String>, overlaps: &[OpenOverlap]) -> Option<String> {
    let found = overlaps.iter().map(|overlap| format!("{overlap}; {}", overlap.help()));
    let all: Vec<String> = notice.into_iter().chain(found).collect();
    (!all.is_empty()).then(|| all.join("\n"))
}
