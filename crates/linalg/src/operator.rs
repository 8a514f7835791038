//! The operations of a matrix that a verified solve needs; the matrix may be a sum of parts on
//! several ranks.

use crate::csr::CsrMatrix;
use crate::layout::Layout;
use crate::scaling::Scaling;
use slipstick_ranks::{Alone, Ranks};

/// Memory of an entry of a [`CsrMatrix`]: value and column. \[bytes\]
pub(crate) const ENTRY_BYTES: f64 = 12.0;

/// A square matrix that can be multiplied, as it is and transposed.
///
/// With several ranks, vectors and all data on rows and columns cover the unknowns of this rank.
pub trait Operator {
    /// Number of rows and columns of this rank.
    fn n(&self) -> usize;

    /// The ranks that hold the other parts.
    fn ranks(&self) -> &dyn Ranks {
        &Alone
    }

    /// `y = A x`.
    ///
    /// # Panics
    /// If a length differs from the number of rows.
    fn mul(&self, x: &[f64], y: &mut [f64]);

    /// `y = Aᵀ x`.
    ///
    /// # Panics
    /// If a length differs from the number of rows.
    fn mul_transpose(&self, x: &[f64], y: &mut [f64]);

    /// `Y = A X` for several vectors, each product as that of [`Operator::mul`].
    ///
    /// # Panics
    /// If a length differs from the number of rows.
    fn mul_many(&self, x: &[Vec<f64>], y: &mut [Vec<f64>]) {
        x.iter().zip(y).for_each(|(x, y)| self.mul(x, y));
    }

    /// ‖A‖∞ (with `transpose`: of Aᵀ), or a bound on it of the same size, for the whole matrix.
    fn infinity_norm(&self, transpose: bool) -> f64;

    /// `y = |A| |x|`, or `y = |Aᵀ| |x|` if `transpose` is set: the round-off of the product is
    /// proportional to it.
    fn absolute_product(&self, transpose: bool, x: &[f64], y: &mut [f64]);

    /// Factors that scale the rows of A (of Aᵀ with `transpose`) to the same size, regardless of
    /// the units of unknowns and equations and of the stiffness of the bodies.
    fn row_weights(&self, transpose: bool) -> Vec<f64>;

    /// Cost of a product with the whole matrix, summed over the ranks, in the unit of
    /// [`Cost`](crate::Cost). All ranks call this together and get the same number. \[bytes moved\]
    fn product_cost(&self) -> f64;

    /// `r = b − A x`, or `r = b − Aᵀ x` if `transpose` is set.
    fn residual(&self, transpose: bool, x: &[f64], b: &[f64], r: &mut [f64]) {
        if transpose {
            self.mul_transpose(x, r);
        } else {
            self.mul(x, r);
        }
        for (r, b) in r.iter_mut().zip(b) {
            *r = b - *r;
        }
    }
}

impl Operator for CsrMatrix {
    fn n(&self) -> usize {
        self.pattern.n()
    }

    fn mul(&self, x: &[f64], y: &mut [f64]) {
        CsrMatrix::mul(self, x, y);
    }

    fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        CsrMatrix::mul_transpose(self, x, y);
    }

    fn mul_many(&self, x: &[Vec<f64>], y: &mut [Vec<f64>]) {
        CsrMatrix::mul_many(self, x, y);
    }

    fn infinity_norm(&self, transpose: bool) -> f64 {
        CsrMatrix::infinity_norm(self, transpose)
    }

    fn absolute_product(&self, transpose: bool, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for (i, xi) in x.iter().enumerate() {
            let (places, values) = self.row(i);
            for (&j, value) in places.iter().zip(values) {
                if transpose {
                    y[j as usize] += (value * xi).abs();
                } else {
                    y[i] += (value * x[j as usize]).abs();
                }
            }
        }
    }

    fn row_weights(&self, transpose: bool) -> Vec<f64> {
        Scaling::equilibrate(self).of(transpose)
    }

    /// One pass over values and columns.
    fn product_cost(&self) -> f64 {
        ENTRY_BYTES * self.values.len() as f64
    }
}

/// The sum of the matrices that the ranks hold, all with the same number of rows. Vectors are the
/// own parts of a [`Layout`].
#[derive(Debug, Clone, Copy)]
pub struct Summed<'a> {
    /// The part of this rank.
    pub part: &'a CsrMatrix,
    /// The ranks' shares of the unknowns.
    pub layout: &'a Layout,
    /// The ranks that hold the other parts.
    pub ranks: &'a dyn Ranks,
}

impl Summed<'_> {
    /// Applies `product` to the own vector `x`; the result is an own vector, summed over all parts.
    fn product(&self, x: &[f64], y: &mut [f64], product: impl FnOnce(&[f64], &mut [f64])) {
        if self.ranks.size() == 1 {
            product(x, y);
            return;
        }
        let x = self.layout.spread(x, self.ranks);
        let mut terms = vec![0.0; x.len()];
        product(&x, &mut terms);
        y.copy_from_slice(&self.layout.collect(&terms, self.ranks));
    }
}

impl Operator for Summed<'_> {
    fn n(&self) -> usize {
        self.layout.own()
    }

    fn ranks(&self) -> &dyn Ranks {
        self.ranks
    }

    fn mul(&self, x: &[f64], y: &mut [f64]) {
        self.product(x, y, |x, y| self.part.mul(x, y));
    }

    fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        self.product(x, y, |x, y| self.part.mul_transpose(x, y));
    }

    fn mul_many(&self, x: &[Vec<f64>], y: &mut [Vec<f64>]) {
        if self.ranks.size() == 1 {
            self.part.mul_many(x, y);
        } else {
            x.iter().zip(y).for_each(|(x, y)| self.mul(x, y));
        }
    }

    /// A bound: the largest sum of the parts' absolute row sums. It is the norm itself on one rank.
    fn infinity_norm(&self, transpose: bool) -> f64 {
        let sums = self.layout.collect(&self.part.absolute_sums(transpose), self.ranks);
        self.ranks.largest(sums.into_iter().fold(0.0, f64::max))
    }

    /// A bound: the sum of the parts' products.
    fn absolute_product(&self, transpose: bool, x: &[f64], y: &mut [f64]) {
        self.product(x, y, |x, y| self.part.absolute_product(transpose, x, y));
    }

    fn row_weights(&self, transpose: bool) -> Vec<f64> {
        let scaling = Scaling::equilibrate_by(self.part, |sizes| {
            let own = self.layout.collect(sizes, self.ranks);
            *sizes = self.layout.spread(&own, self.ranks);
        });
        self.layout.restrict(&scaling.of(transpose))
    }

    fn product_cost(&self) -> f64 {
        let mut sum = [self.part.product_cost()];
        self.ranks.sum(&mut sum);
        sum[0]
    }
}
