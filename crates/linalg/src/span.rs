//! Initial guess of an iteration from the solutions of similar systems.

use crate::basis::{Added, Basis};
use crate::csr::norm_on;
use crate::operator::Operator;
use slipstick_ranks::Ranks;

/// Right-hand sides whose vectors are multiplied together.
const TOGETHER: usize = 2;

/// For each of several right-hand sides, the combination of its vectors with the least ‖b − A x‖₂;
/// zero if none reduces it.
///
/// One product with A per vector; those of a few right-hand sides are computed together, with the
/// same bits as alone. Reference: Fischer, Projection techniques for iterative solution of Ax = b
/// with successive right-hand sides, Comput. Methods Appl. Mech. Engrg. 163 (1998).
///
/// # Panics
/// If a length differs from the number of rows, or if there are not as many spans as right-hand
/// sides.
pub fn best_in_spans(a: &dyn Operator, rhs: &[Vec<f64>], spans: Vec<Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
    assert_eq!(rhs.len(), spans.len(), "each right-hand side needs a span");
    let mut spans = spans.into_iter();
    let mut all = Vec::with_capacity(rhs.len());
    for rhs in rhs.chunks(TOGETHER) {
        let spans: Vec<Vec<Vec<f64>>> = spans.by_ref().take(TOGETHER).collect();
        let counts: Vec<usize> = spans.iter().map(Vec::len).collect();
        let vectors = spans.concat();
        let mut products: Vec<Vec<f64>> = vectors.iter().map(|v| vec![0.0; v.len()]).collect();
        a.mul_many(&vectors, &mut products);
        let mut pairs = vectors.into_iter().zip(products);
        all.extend(rhs.iter().zip(counts).map(|(rhs, count)| best(rhs, pairs.by_ref().take(count), a.ranks())));
    }
    all
}

/// The best combination of vectors, each given with its product.
fn best(rhs: &[f64], pairs: impl Iterator<Item = (Vec<f64>, Vec<f64>)>, ranks: &dyn Ranks) -> Vec<f64> {
    let (mut basis, mut directions) = (Basis::default(), Vec::new());
    for (x, product) in pairs {
        if basis.add(product, ranks) == Added::Yes {
            directions.push(x);
        }
    }
    let (mut best, mut residual) = (vec![0.0; rhs.len()], rhs.to_vec());
    let components = basis.reduce(0, &mut residual, ranks);
    if norm_on(&residual, ranks) < norm_on(rhs, ranks) {
        basis.combine(components, &directions, &mut best);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csr::{CsrMatrix, CsrPattern};
    use std::sync::Arc;

    /// [ 2 1 0 ; 0 3 0 ; 0 0 4 ]
    fn example() -> CsrMatrix {
        let pattern = CsrPattern::new(vec![0, 2, 3, 4], vec![0, 1, 1, 2], vec![0, 1, 2], vec![]).unwrap();
        CsrMatrix { pattern: Arc::new(pattern), values: vec![2.0, 1.0, 3.0, 4.0] }
    }

    fn best_of(rhs: &[[f64; 3]], spans: &[&[[f64; 3]]]) -> Vec<Vec<f64>> {
        let rhs: Vec<Vec<f64>> = rhs.iter().map(|b| b.to_vec()).collect();
        let spans = spans.iter().map(|span| span.iter().map(|x| x.to_vec()).collect()).collect();
        best_in_spans(&example(), &rhs, spans)
    }

    /// b = A (1, 2, 0) lies in the span; the third vector repeats the first.
    #[test]
    fn a_solution_in_the_span_is_found() {
        let vectors = [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [2.0, 2.0, 0.0]];
        let x = best_of(&[[4.0, 6.0, 0.0]], &[&vectors]).remove(0);
        for (x, expected) in x.iter().zip([1.0, 2.0, 0.0]) {
            assert!((x - expected).abs() < 1e-14);
        }
    }

    /// A (0, 0, 1) = (0, 0, 4) is orthogonal to b: nothing to gain.
    #[test]
    fn vectors_without_use_give_zero() {
        assert_eq!(best_of(&[[4.0, 6.0, 0.0]], &[&[[0.0, 0.0, 1.0]]]), [[0.0; 3]]);
        assert_eq!(best_of(&[[4.0, 6.0, 0.0]], &[&[[f64::NAN; 3]]]), [[0.0; 3]]);
    }

    /// By definition: together as alone, bit for bit, also with spans of different sizes.
    #[test]
    fn several_right_hand_sides_are_solved_as_alone() {
        let rhs = [[4.0, 6.0, 0.3], [1.0, 0.1, 0.7], [0.2, 5.0, 1.0], [1.0, 1.0, 1.0]];
        let first: &[[f64; 3]] = &[[1.0, 1.0, 0.1], [0.3, 1.0, 0.0]];
        let spans: [&[[f64; 3]]; 4] = [first, &[], &[[0.7, 0.2, 0.4]], &[[0.1, 1.0, 0.6], [1.0, 0.0, 0.9], [0.5; 3]]];
        let alone: Vec<Vec<f64>> = rhs.iter().zip(spans).flat_map(|(b, span)| best_of(&[*b], &[span])).collect();
        assert_eq!(best_of(&rhs, &spans), alone);
        assert!(alone[0].iter().any(|x| *x != 0.0) && alone[1] == [0.0; 3]);
    }
}
