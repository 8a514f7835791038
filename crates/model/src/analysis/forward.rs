//! Results of a forward analysis, and of its gradient.

use super::rounding::Rounding;
use crate::equations::Parameter;
use slipstick_design::ElementValues;
use slipstick_path::Path;

/// A forward analysis with the objective's value.
#[derive(Debug, Clone)]
pub struct Forward {
    /// Densities of all elements.
    pub density: ElementValues,
    /// All states.
    pub path: Path,
    /// For each user's step, its contribution to θ if the objective is a sum over steps, otherwise
    /// 0.
    pub step_values: Vec<f64>,
    /// θ.
    pub value: f64,
    /// The values of the objective's [parts](slipstick_design::response::Response::parts), of which θ is the largest; only θ if
    /// it has no parts; empty without an objective.
    pub parts: Vec<f64>,
    /// The values of the constraints' responses.
    pub constraints: Vec<f64>,
    /// For each of them, the value with the extremes for which smooth quantities stand; `None` if
    /// there is none.
    pub extremes: Vec<Option<f64>>,
    /// The values of the quantities of the objective's parts, then of the constraints: for each
    /// response, a row for each term, with a column for each user's step.
    pub quantities: Vec<Vec<Vec<f64>>>,
    /// A likely mistake in the case.
    pub notice: Option<ForwardNotice>,
    /// Set if θ at the end of a complete path is only round-off.
    pub rounding: Option<Rounding>,
}

/// Derivatives of the objective.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradients {
    /// dθ/dφ of every element, zero outside the design.
    pub density: ElementValues,
    /// dθ/dp of every other parameter of the model, except coefficients of friction that are 0.
    /// Contact stiffnesses that are multiples of the bodies' own stiffness at the start design vary
    /// with the moduli.
    pub parameters: Vec<(Parameter, f64)>,
}

/// A likely mistake in the case that only a complete path reveals.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ForwardNotice {
    /// There are contact pairs, but no slave node is ever in contact: contact forces are 0, or only
    /// round-off.
    #[error("contact never closed on the path: contact forces and their derivatives are 0, or round-off")]
    ContactNeverCloses,
    /// No slave node is in contact at the steps that the objective observes.
    #[error("contact is open at every step that the objective observes: its value and gradient are 0, or round-off")]
    ContactOpenWhereObserved,
    /// Contact closes in some load cases, but never in these.
    #[error("contact never closes in {}: it adds nothing to contact forces and their derivatives", in_words(.0))]
    ContactNeverClosesIn(Vec<String>),
}

impl ForwardNotice {
    /// Its name for programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::ContactNeverCloses => "contact_never_closes",
            Self::ContactOpenWhereObserved => "contact_open_where_observed",
            Self::ContactNeverClosesIn(_) => "contact_never_closes_in_load_case",
        }
    }
}

impl serde::Serialize for ForwardNotice {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.code())
    }
}

/// The load cases that a message names.
pub(super) fn in_words(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    format!("load {} {}", if names.len() == 1 { "case" } else { "cases" }, quoted.join(", "))
}
