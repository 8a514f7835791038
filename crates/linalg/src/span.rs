//! Initial guess of an iteration from the solutions of similar systems.

use crate::csr::norm_on;
use crate::operator::Operator;
use crate::vectors;
use slipstick_ranks::Ranks;

/// Fraction of a product that must be independent of the others for its vector to count.
const NEW: f64 = 1e-6;

/// The combination of `vectors` with the least ‖b − A x‖₂; zero if none reduces it.
///
/// One product with A per vector. Reference: Fischer, Projection techniques for iterative solution
/// of Ax = b with successive right-hand sides, Comput. Methods Appl. Mech. Engrg. 163 (1998).
///
/// # Panics
/// If a length differs from the number of rows.
pub fn best_in_span<'a>(a: &dyn Operator, rhs: &[f64], vectors: impl IntoIterator<Item = &'a [f64]>) -> Vec<f64> {
    let ranks = a.ranks();
    let norm = |v: &[f64]| norm_on(v, ranks);
    let mut residual = rhs.to_vec();
    let mut best = vec![0.0; rhs.len()];
    let mut basis: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    for vector in vectors {
        let mut x = vector.to_vec();
        let mut product = vec![0.0; x.len()];
        a.mul(&x, &mut product);
        let whole = norm(&product);
        // done twice, for full orthogonality
        for (y, q) in basis.iter().chain(&basis) {
            let shared = dot(q, &product, ranks);
            add(-shared, q, &mut product);
            add(-shared, y, &mut x);
        }
        let new = norm(&product);
        if !(new > NEW * whole) || !new.is_finite() {
            continue;
        }
        product.iter_mut().for_each(|p| *p /= new);
        x.iter_mut().for_each(|x| *x /= new);
        let coefficient = dot(&product, &residual, ranks);
        add(-coefficient, &product, &mut residual);
        add(coefficient, &x, &mut best);
        basis.push((x, product));
    }
    if norm(&residual) < norm(rhs) { best } else { vec![0.0; rhs.len()] }
}

fn dot(a: &[f64], b: &[f64], ranks: &dyn Ranks) -> f64 {
    let mut sum = [vectors::dot(a, b)];
    ranks.sum(&mut sum);
    sum[0]
}

fn add(factor: f64, from: &[f64], to: &mut [f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
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

    /// b = A (1, 2, 0) lies in the span; the third vector repeats the first.
    #[test]
    fn a_solution_in_the_span_is_found() {
        let vectors: [&[f64]; 3] = [&[1.0, 1.0, 0.0], &[0.0, 1.0, 0.0], &[2.0, 2.0, 0.0]];
        let x = best_in_span(&example(), &[4.0, 6.0, 0.0], vectors);
        for (x, expected) in x.iter().zip([1.0, 2.0, 0.0]) {
            assert!((x - expected).abs() < 1e-14);
        }
    }

    /// A (0, 0, 1) = (0, 0, 4) is orthogonal to b: nothing to gain.
    #[test]
    fn vectors_without_use_give_zero() {
        assert_eq!(best_in_span(&example(), &[4.0, 6.0, 0.0], [[0.0, 0.0, 1.0].as_slice()]), [0.0; 3]);
        assert_eq!(best_in_span(&example(), &[4.0, 6.0, 0.0], [[f64::NAN; 3].as_slice()]), [0.0; 3]);
    }
}
