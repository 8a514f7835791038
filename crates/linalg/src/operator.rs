//! What a verified solve asks of a matrix, which may be the sum of parts on several ranks.

use crate::csr::CsrMatrix;
use crate::layout::Layout;
use crate::scaling::Scaling;
use slipstick_ranks::{Alone, Ranks};

/// Memory of an entry of a [`CsrMatrix`]: value and column. \[bytes\]
const ENTRY_BYTES: f64 = 12.0;

/// A square matrix that can be multiplied, as it is and transposed.
///
/// Vectors, and all that is told of rows and columns, are of the unknowns of this rank, where there are several.
pub trait Operator {
    /// Number of rows and columns of this rank.
    fn n(&self) -> usize;

    /// Who has the others.
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

    /// ‖A‖∞ (with `transpose`: of Aᵀ), or a bound on it of the same size: of the whole matrix.
    fn infinity_norm(&self, transpose: bool) -> f64;

    /// `y = |A| |x|`, or `y = |Aᵀ| |x|` where `transpose` is set: what the rounding errors of the product are in proportion to.
    fn absolute_product(&self, transpose: bool, x: &[f64], y: &mut [f64]);

    /// Factors that bring rows of A (of Aᵀ with `transpose`) to one size, whatever the units of unknowns and equations and
    /// however stiff what they belong to.
    fn row_weights(&self, transpose: bool) -> Vec<f64>;

    /// Cost of a product with the whole matrix, summed over the ranks, in the unit of [`Cost`](crate::Cost). All ranks
    /// call this together and get the same number. \[bytes moved\]
    fn product_cost(&self) -> f64;

    /// `r = b − A x`, or `r = b − Aᵀ x` where `transpose` is set.
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

/// The sum of the matrices that the ranks hold, all with the same number of rows. Vectors are the own parts of a
/// [`Layout`].
#[derive(Debug, Clone, Copy)]
pub struct Summed<'a> {
    /// The part of this rank.
    pub part: &'a CsrMatrix,
    /// Which unknowns are whose.
    pub layout: &'a Layout,
    /// Who has the others.
    pub ranks: &'a dyn Ranks,
}

impl Summed<'_> {
    /// What `product` makes of the own vector `x`: an own vector, the sum of all parts'.
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

    /// A bound: the largest sum of the parts' absolute row sums. It is the norm itself on one rank.
    fn infinity_norm(&self, transpose: bool) -> f64 {
        let sums = self.layout.collect(&self.part.absolute_sums(transpose), self.ranks);
        self.ranks.largest(sums.into_iter().fold(0.0, f64::max))
    }

    /// A bound: the sum of the parts'.
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
