//! Responses that observe the same values are swept once.
//!
//! A maximum and a minimum of one quantity at one load step, or an objective that a constraint bounds
//! as well, have the same derivatives, up to their sign.

use std::sync::Arc;

use slipstick_design::response::Response;
use slipstick_path::PathGradient;

/// For each response, the first one with the same derivatives, and a factor of 1 or −1.
#[derive(Debug, PartialEq)]
pub struct Repeated {
    of: Vec<(usize, f64)>,
}

impl Repeated {
    /// `slopes` are the derivatives of each response with respect to the values of its terms.
    pub fn new(responses: &[Response], slopes: &[Vec<Vec<f64>>]) -> Self {
        let mut of: Vec<(usize, f64)> = Vec::new();
        for r in 0..responses.len() {
            let earlier = (0..r).filter(|&first| of[first].0 == first);
            let known = earlier.filter(|&first| same_quantities(&responses[first], &responses[r]));
            let factor = |first: usize| Some((first, factor(&slopes[first], &slopes[r])?));
            of.push(known.filter_map(factor).next().unwrap_or((r, 1.0)));
        }
        Self { of }
    }

    /// The responses to sweep.
    pub fn once(&self) -> impl Iterator<Item = usize> {
        self.of.iter().enumerate().filter(|(r, (first, _))| r == first).map(|(r, _)| r)
    }

    /// The gradients of all responses from those of the swept ones.
    pub fn gradients(&self, swept: &[PathGradient]) -> Vec<PathGradient> {
        let place = |first: usize| self.once().position(|r| r == first).expect("it is swept");
        let one = |&(first, factor): &(usize, f64)| {
            let PathGradient { design, parameters, positions } = &swept[place(first)];
            let times = |values: &[f64]| values.iter().map(|value| factor * value).collect();
            PathGradient { design: times(design), parameters: times(parameters), positions: times(positions) }
        };
        self.of.iter().map(one).collect()
    }
}

fn same_quantities(a: &Response, b: &Response) -> bool {
    let mut pairs = a.terms().iter().zip(b.terms());
    a.terms().len() == b.terms().len() && pairs.all(|(a, b)| Arc::ptr_eq(&a.quantity, &b.quantity))
}

/// The factor of 1 or −1 between two tables of derivatives.
fn factor(of: &[Vec<f64>], other: &[Vec<f64>]) -> Option<f64> {
    let is = |factor: f64| of.iter().flatten().zip(other.iter().flatten()).all(|(a, b)| *b == factor * a);
    [1.0, -1.0].into_iter().find(|&factor| is(factor))
}

#[cfg(test)]
mod tests {
    use slipstick_design::ObservedSteps;
    use slipstick_design::quantity::{Dimension, Quantity, StateDerivative, StateView};

    use super::*;

    struct Some;

    impl Quantity for Some {
        fn name(&self) -> &str {
            "some"
        }

        fn dimension(&self) -> Dimension {
            Dimension::FORCE
        }

        fn value(&self, _: &StateView) -> f64 {
            0.0
        }

        fn pull_back(&self, _: &StateView, _: f64, _: &mut StateDerivative) {}
    }

    #[test]
    fn equal_and_opposite_responses_are_swept_once() {
        let (one, other): (Arc<dyn Quantity>, Arc<dyn Quantity>) = (Arc::new(Some), Arc::new(Some));
        let of = |quantity: &Arc<dyn Quantity>, weight| Response::of(quantity.clone(), ObservedSteps::All, weight);
        let responses = [of(&one, -1.0), of(&other, 1.0), of(&one, 1.0), of(&one, 1.0), of(&one, 2.0)];
        let slopes: Vec<Vec<Vec<f64>>> =
            [[-1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0, 0.0]].map(|row| vec![row.to_vec()]).into();
        let repeated = Repeated::new(&responses, &slopes);
        assert_eq!(repeated.of, [(0, 1.0), (1, 1.0), (0, -1.0), (3, 1.0), (4, 1.0)]);
        let gradient =
            |value: f64| PathGradient { design: vec![value], parameters: vec![2.0 * value], positions: Vec::new() };
        let all = repeated.gradients(&[1.0, 2.0, 3.0, 4.0].map(gradient));
        let found: Vec<[f64; 2]> = all.iter().map(|one| [one.design[0], one.parameters[0]]).collect();
        assert_eq!(found, [[1.0, 2.0], [2.0, 4.0], [-1.0, -2.0], [3.0, 6.0], [4.0, 8.0]]);
    }
}
