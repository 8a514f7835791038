//! Least residuals over the span of some directions, whose products with a matrix form a basis.

use crate::csr::norm_on;
use crate::vectors::{dots, subtract};
use slipstick_ranks::Ranks;

/// A product counts as new if this much of it is outside the span of the others.
const NEW: f64 = 1e-6;

/// If more than this much of a product is outside the span of the others, removing its components once
/// is enough; otherwise they are removed twice.
const ENOUGH: f64 = 0.7;

/// Products A Z = Q R of directions Z, with orthonormal Q and an upper triangle R.
///
/// The directions themselves are not combined: a residual is reduced along Q, and R gives the
/// coefficients of the directions once they are needed.
///
/// Reference: Daniel, Gragg, Kaufman and Stewart, Math. Comp. 30 (1976), for the number of passes.
#[derive(Debug, Default)]
pub(crate) struct Basis {
    vectors: Vec<Vec<f64>>,
    /// The columns of R.
    triangle: Vec<Vec<f64>>,
}

/// What has become of a product.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Added {
    Yes,
    /// It is in the span of the others, and was dropped.
    Dependent,
    /// It is not finite, and was dropped.
    NotFinite,
}

impl Basis {
    /// Number of products that have been added.
    pub fn len(&self) -> usize {
        self.vectors.len()
    }

    /// Adds the product of a direction.
    pub fn add(&mut self, mut product: Vec<f64>, ranks: &dyn Ranks) -> Added {
        let size = norm_on(&product, ranks);
        let (mut left, mut column) = (size, vec![0.0; self.vectors.len()]);
        for _ in 0..2 {
            let components = self.reduce(0, &mut product, ranks);
            column.iter_mut().zip(components).for_each(|(sum, component)| *sum += component);
            left = norm_on(&product, ranks);
            if left > ENOUGH * size {
                break;
            }
        }
        if !left.is_finite() {
            return Added::NotFinite;
        }
        if !(left > NEW * size) {
            return Added::Dependent;
        }
        product.iter_mut().for_each(|p| *p /= left);
        column.push(left);
        self.triangle.push(column);
        self.vectors.push(product);
        Added::Yes
    }

    /// Removes the components of a residual along the products from number `first` on, and returns them.
    pub fn reduce(&self, first: usize, residual: &mut [f64], ranks: &dyn Ranks) -> Vec<f64> {
        let mut components = dots(residual, &self.vectors[first..]);
        ranks.sum(&mut components);
        subtract(residual, &components, &self.vectors[first..]);
        components
    }

    /// Adds to `x` the combination of `directions` whose product has these components.
    pub fn combine(&self, mut components: Vec<f64>, directions: &[Vec<f64>], x: &mut [f64]) {
        for k in (0..components.len()).rev() {
            let column = &self.triangle[k];
            components[k] /= column[k];
            let coefficient = components[k];
            components.iter_mut().zip(&column[..k]).for_each(|(other, entry)| *other -= entry * coefficient);
        }
        components.iter_mut().for_each(|coefficient| *coefficient = -*coefficient);
        subtract(x, &components, directions);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_ranks::Alone;

    /// By hand, with the directions as their own products: (3, 4, 5) is reduced to (0, 0, 5) by two
    /// directions that are nearly parallel; (6, 8, 0) adds nothing.
    #[test]
    fn residuals_are_reduced_by_independent_directions() {
        let directions = [vec![1.0, 0.0, 0.0], vec![1.0, 1e-3, 0.0]];
        let mut basis = Basis::default();
        assert!(directions.iter().all(|z| basis.add(z.clone(), &Alone) == Added::Yes));
        assert_eq!(basis.add(vec![6.0, 8.0, 0.0], &Alone), Added::Dependent);
        assert_eq!(basis.add(vec![f64::NAN; 3], &Alone), Added::NotFinite);
        assert_eq!(basis.len(), 2);
        let mut residual = [3.0, 4.0, 5.0];
        let components = basis.reduce(0, &mut residual, &Alone);
        assert!((residual[0].abs() + residual[1].abs()) < 1e-12 && residual[2] == 5.0, "{residual:?}");
        let mut x = [1.0; 3];
        basis.combine(components, &directions, &mut x);
        // 1 + (3, 4, 0)
        assert!(x.iter().zip([4.0, 5.0, 1.0]).all(|(x, expected)| (x - expected).abs() < 1e-9), "{x:?}");
    }
}
