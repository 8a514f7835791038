//! Everything on which the equations of a step depend, by name.

use crate::unknowns::{StepState, Unknowns};

/// The inputs of a step's equations F and G, one list for each: their values (`T = f64`, or
/// dual numbers), or derivatives with respect to them.
///
/// A new kind of input is a new field here: the [sweep](crate::sweep()) passes it on, and the
/// [comparison with differences](crate::differences) tests it in every problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Inputs<T = f64> {
    /// y_n, the unknowns at the end of the step: displacements (three per node), then multipliers.
    /// \[L, F/L²\]
    pub unknowns: Vec<T>,
    /// y_{n−1}, the unknowns at its start. \[L, F/L²\]
    pub previous: Vec<T>,
    /// h_{n−1}, the history at its start.
    pub history: Vec<T>,
    /// φ, one density per element.
    pub density: Vec<T>,
    /// p, the problem's [parameters](Unknowns::parameters).
    pub parameters: Vec<T>,
    /// X, the reference positions of the nodes, three each. \[L\]
    pub position: Vec<T>,
}

impl<T> Default for Inputs<T> {
    fn default() -> Self {
        let [unknowns, previous, history, density, parameters, position] = [(); 6].map(|()| Vec::new());
        Self { unknowns, previous, history, density, parameters, position }
    }
}

impl<T> Inputs<T> {
    /// The names of the fields, in order.
    pub const NAMES: [&'static str; 6] = ["unknowns", "previous", "history", "density", "parameters", "position"];

    /// The fields, in the order of their [names](Self::NAMES).
    pub fn fields(&self) -> [&[T]; 6] {
        let Self { unknowns, previous, history, density, parameters, position } = self;
        [unknowns, previous, history, density, parameters, position]
    }

    /// The fields, to be changed.
    pub fn fields_mut(&mut self) -> [&mut Vec<T>; 6] {
        let Self { unknowns, previous, history, density, parameters, position } = self;
        [unknowns, previous, history, density, parameters, position]
    }

    /// The same function of every entry.
    pub fn map<S>(&self, mut of: impl FnMut(&T) -> S) -> Inputs<S> {
        let [unknowns, previous, history, density, parameters, position] =
            self.fields().map(|field| field.iter().map(&mut of).collect());
        Inputs { unknowns, previous, history, density, parameters, position }
    }
}

impl Inputs {
    /// A zero for every input of a problem.
    pub fn zero(unknowns: &Unknowns) -> Self {
        let zeros = |count: usize| vec![0.0; count];
        Self {
            unknowns: zeros(unknowns.count()),
            previous: zeros(unknowns.count()),
            history: zeros(unknowns.history),
            density: zeros(unknowns.designs),
            parameters: zeros(unknowns.parameters),
            position: zeros(unknowns.positions),
        }
    }

    /// The state at the start of the step.
    pub fn previous_state(&self) -> StepState {
        StepState { unknowns: self.previous.clone(), history: self.history.clone() }
    }
}
