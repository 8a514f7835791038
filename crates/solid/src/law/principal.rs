//! Laws in principal stretches: spectra of symmetric matrices, functions of them, and the stress that
//! follows from principal stresses.
//!
//! With C = Σ_a c_a N_a ⊗ N_a, the deviatoric part of the second Piola–Kirchhoff stress S has the same
//! principal directions. A law gives its principal values s_a, their derivatives and the quotients
//! (s_a − s_b)/(c_a − c_b), which are finite for equal stretches ([`Principal`]).

use super::volume::Volume;
use super::{Local, Real};
use crate::registers::{AtPoints, Matrix, POINTS, array, load, load_matrix, product, transpose};
use pulp::Simd;

/// Principal values of S and their derivatives, divided by the shear modulus.
pub(crate) struct Principal {
    /// s_a.
    pub stress: [f64; 3],
    /// ∂s_a/∂c_b.
    pub slopes: [[f64; 3]; 3],
    /// (s_a − s_b)/(c_a − c_b) for (a, b) = (1, 2), (2, 0), (0, 1).
    pub quotients: [f64; 3],
}

/// Intermediate results shared by the stresses at the points of a register.
#[derive(Clone, Copy)]
pub(crate) struct Spectrum<S: Simd> {
    volume: Volume<S>,
    /// N, one principal direction in each column.
    directions: Matrix<S>,
    /// The deviatoric part of S.
    stress: Matrix<S>,
    slopes: Matrix<S>,
    quotients: [S::f64s; 3],
}

/// N (entries 0 to 8), ∂s_a/∂c_b (9 to 17), s_a (18 to 20) and the quotients (21 to 23) at
/// `count` points, beginning with `first`. This is scalar code, compiled once for all
/// instruction sets.
#[inline(never)]
fn prepare_lanes(
    principal: impl Fn([f64; 3], f64) -> Principal,
    at: &Local<'_>,
    first: usize,
    count: usize,
    lanes: &mut [AtPoints; 24],
) {
    for lane in 0..count {
        let f: [[f64; 3]; 3] = array(|a, b| at.gradient[a][b][first + lane]);
        let c = array(|a, b| f[0][a] * f[0][b] + f[1][a] * f[1][b] + f[2][a] * f[2][b]);
        let (values, n) = spectrum(c);
        let Principal { stress, slopes, quotients } = principal(values, at.determinant[first + lane]);
        for a in 0..3 {
            for b in 0..3 {
                lanes[3 * a + b][lane] = n[a][b];
                lanes[9 + 3 * a + b][lane] = slopes[a][b];
            }
            lanes[18 + a][lane] = stress[a];
            lanes[21 + a][lane] = quotients[a];
        }
    }
}

impl<S: Simd> Spectrum<S> {
    /// From `principal`, a function of the eigenvalues of C, and J.
    #[inline(always)]
    pub fn new(simd: S, at: &Local<'_>, volume: Volume<S>, principal: impl Fn([f64; 3], f64) -> Principal) -> Self {
        let first = S::F64_LANES * at.v;
        let mut lanes = [[0.0; POINTS]; 24];
        prepare_lanes(principal, at, first, S::F64_LANES, &mut lanes);
        let lane = |i: usize| load::<S>(&lanes[i], 0);
        let directions = array(|a, b| lane(3 * a + b));
        let scaled = array(|a, b| simd.mul_f64s(directions[a][b], lane(18 + b)));
        Self {
            volume,
            directions,
            stress: product(simd, &scaled, &transpose::<S>(&directions)),
            slopes: array(|a, b| lane(9 + 3 * a + b)),
            quotients: [lane(21), lane(22), lane(23)],
        }
    }

    /// F S and the pressure.
    #[inline(always)]
    pub fn stress(&self, simd: S, at: &Local<'_>) -> Matrix<S> {
        let f = load_matrix::<S>(at.gradient, at.v);
        self.volume.add_stress(simd, at, &product(simd, &f, &self.stress))
    }

    /// dF S + F dS and the change of the pressure.
    #[inline(always)]
    pub fn stress_change(&self, simd: S, at: &Local<'_>, change: &Matrix<S>) -> Matrix<S> {
        let (f, inverse) = (load_matrix::<S>(at.gradient, at.v), load_matrix::<S>(at.inverse, at.v));
        let n = &self.directions;
        // dC in the basis N
        let (f_n, change_n) = (product(simd, &f, n), product(simd, change, n));
        let half = product(simd, &transpose::<S>(&f_n), &change_n);
        let slope = |a: usize| {
            let sum = simd.mul_f64s(self.slopes[a][0], half[0][0]);
            let sum = simd.mul_add_e_f64s(self.slopes[a][1], half[1][1], sum);
            let sum = simd.mul_add_e_f64s(self.slopes[a][2], half[2][2], sum);
            simd.add_f64s(sum, sum)
        };
        let diagonal = [slope(0), slope(1), slope(2)];
        let principal: Matrix<S> = array(|a, b| {
            if a == b {
                diagonal[a]
            } else {
                simd.mul_f64s(self.quotients[3 - a - b], simd.add_f64s(half[a][b], half[b][a]))
            }
        });
        // F N dS Nᵀ
        let material = product(simd, &product(simd, &f_n, &principal), &transpose::<S>(n));
        let geometric = product(simd, change, &self.stress);
        let p = array(|a, b| simd.add_f64s(material[a][b], geometric[a][b]));
        let relative = product(simd, &inverse, change);
        let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
        let turned = product(simd, &relative, &inverse);
        self.volume.add_change(simd, &inverse, trace, &turned, &p)
    }
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix, by Jacobi's method.
///
/// Reference: Golub, Van Loan, Matrix Computations (2013), section 8.5. Test:
/// `spectra_of_symmetric_matrices`.
pub(crate) fn spectrum(mut c: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut n = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // quadratic convergence: the sixth sweep no longer changes anything
    for _ in 0..10 {
        let size = c[0][0].abs() + c[1][1].abs() + c[2][2].abs();
        let off = c[0][1].abs() + c[0][2].abs() + c[1][2].abs();
        // also ends for NaN
        if !(off > 1e-17 * size) {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if c[p][q] == 0.0 {
                continue;
            }
            let theta = 0.5 * (c[q][q] - c[p][p]) / c[p][q];
            let t = theta.signum() / (theta.abs() + (1.0 + theta * theta).sqrt());
            let cos = 1.0 / (1.0 + t * t).sqrt();
            let sin = t * cos;
            let (shift, r) = (t * c[p][q], 3 - p - q);
            let (cp, cq) = (c[p][r], c[q][r]);
            c[p][p] -= shift;
            c[q][q] += shift;
            (c[p][q], c[q][p]) = (0.0, 0.0);
            let (rp, rq) = (cos * cp - sin * cq, sin * cp + cos * cq);
            (c[p][r], c[r][p], c[q][r], c[r][q]) = (rp, rp, rq, rq);
            for row in &mut n {
                (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
            }
        }
    }
    ([c[0][0], c[1][1], c[2][2]], n)
}

/// A 3×3 matrix over any number type.
#[derive(Clone, Copy)]
pub(super) struct Tensor<T>(pub [[T; 3]; 3]);

impl<T: Real> Tensor<T> {
    /// FᵀF.
    pub fn of(f: &[[T; 3]; 3]) -> Self {
        Self(array(|a, b| f[0][a] * f[0][b] + f[1][a] * f[1][b] + f[2][a] * f[2][b]))
    }

    pub fn trace(&self) -> T {
        self.0[0][0] + self.0[1][1] + self.0[2][2]
    }

    /// Adds a multiple of the identity.
    pub fn plus(&self, x: T) -> Self {
        Self(array(|a, b| if a == b { self.0[a][b] + x } else { self.0[a][b] }))
    }

    fn times(&self, factor: T) -> Self {
        Self(self.0.map(|row| row.map(|x| factor * x)))
    }

    fn add(&self, other: &Self) -> Self {
        Self(array(|a, b| self.0[a][b] + other.0[a][b]))
    }

    fn product(&self, other: &Self) -> Self {
        Self(array(|a, b| (1..3).fold(self.0[a][0] * other.0[0][b], |sum, k| sum + self.0[a][k] * other.0[k][b])))
    }

    fn inverse(&self) -> Self {
        let m = &self.0;
        let cofactor = |a: usize, b: usize| {
            let (a1, a2, b1, b2) = ((a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3);
            m[a1][b1] * m[a2][b2] - m[a1][b2] * m[a2][b1]
        };
        let det = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
        Self(array(|a, b| cofactor(b, a) / det))
    }

    /// Largest absolute value among the entries of the difference from the identity.
    fn strain(&self) -> f64 {
        let entry = |n: usize| (self.0[n / 3][n % 3].value() - f64::from(n.is_multiple_of(4))).abs();
        (0..9).map(entry).fold(0.0, f64::max)
    }
}

/// ln C of a positive definite C: takes square roots until C is close to the identity, then sums
/// the series 2 artanh Z, Z = (C − 1)(C + 1)⁻¹.
pub(super) fn logarithm<T: Real>(c: &Tensor<T>) -> Tensor<T> {
    let (mut root, mut factor) = (*c, 2.0);
    // for |C − 1| ≤ 1/4, Z² is below 1/40; the bound on `factor` ends the loop if C is not positive
    // definite
    while root.strain() > 0.25 && factor < 1e4 {
        root = square_root(&root);
        factor *= 2.0;
    }
    let one = T::from(1.0);
    let z = root.plus(T::from(-1.0)).product(&root.plus(one).inverse());
    let square = z.product(&z);
    let mut series = Tensor([[T::from(0.0); 3]; 3]).plus(T::from(1.0 / 23.0));
    for n in (0..11).rev() {
        series = series.product(&square).plus(T::from(1.0 / (2 * n + 1) as f64));
    }
    z.product(&series).times(T::from(factor))
}

/// The square root, by the Denman–Beavers iteration.
fn square_root<T: Real>(c: &Tensor<T>) -> Tensor<T> {
    let half = T::from(0.5);
    let (mut root, mut inverse) = (*c, Tensor([[T::from(0.0); 3]; 3]).plus(T::from(1.0)));
    let mut last = 0;
    for _ in 0..50 {
        let next = root.add(&inverse.inverse()).times(half);
        inverse = inverse.add(&root.inverse()).times(half);
        let change = (0..9).map(|n| (next.0[n / 3][n % 3].value() - root.0[n / 3][n % 3].value()).abs());
        let converged = change.fold(0.0, f64::max) <= 1e-8 * (1.0 + next.trace().value().abs());
        root = next;
        // convergence is now quadratic: two more iterations reach round-off, also in two
        // derivatives
        if converged {
            last += 1;
        }
        if last == 3 {
            break;
        }
    }
    root
}

/// e^(pL) − 1: halves pL until it is small, sums the series, and then doubles with (1 + X)² − 1 =
/// 2X + X².
pub(super) fn exponential_m1<T: Real>(l: &Tensor<T>, p: f64) -> Tensor<T> {
    let size = p.abs() * l.plus(T::from(1.0)).strain();
    // halving does not help if the size is NaN or infinite
    let halvings = if size > 0.1 && size < 1e4 { (10.0 * size).log2().ceil() as i32 } else { 0 };
    let small = l.times(T::from(p * 0.5_f64.powi(halvings)));
    // X (1 + X/2 (1 + X/3 (…)))
    let mut series = small.times(T::from(1.0 / 13.0));
    for n in (1..13).rev() {
        series = small.times(T::from(1.0 / f64::from(n))).product(&series.plus(T::from(1.0)));
    }
    for _ in 0..halvings {
        series = series.times(T::from(2.0)).add(&series.product(&series));
    }
    series
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: C N = N diag(c), NᵀN = 1, for distinct, close and equal eigenvalues.
    #[test]
    fn spectra_of_symmetric_matrices() {
        let mut tried = 0;
        for gap in [0.0, 1e-16, 1e-12, 1e-8, 1e-4, 1e-1, 1.0] {
            for values in [[1.0, 1.0 + gap, 1.0 - 0.3 * gap], [3.0, 3.0 + gap, 0.01], [1e-3, 50.0, 50.0 + gap]] {
                let axes = [[2.0, 1.0, 2.0], [-2.0, 2.0, 1.0], [1.0, 2.0, -2.0]].map(|row| row.map(|x: f64| x / 3.0));
                let c = array(|a, b| (0..3).map(|k| axes[a][k] * values[k] * axes[b][k]).sum::<f64>());
                let (found, n) = spectrum(c);
                for a in 0..3 {
                    for b in 0..3 {
                        let product: f64 = (0..3).map(|k| c[a][k] * n[k][b]).sum();
                        assert!((product - n[a][b] * found[b]).abs() < 1e-15 * 50.0, "{values:?}: {found:?} {n:?}");
                        let dot: f64 = (0..3).map(|k| n[k][a] * n[k][b]).sum();
                        assert!((dot - f64::from(a == b)).abs() < 1e-15, "{values:?}: {n:?}");
                    }
                }
                tried += 1;
            }
        }
        assert_eq!(tried, 21);
    }

    /// Powers of a tensor with known eigenvalues.
    #[test]
    fn powers_of_tensors() {
        for stretch in [1.0, 1.3, 8.0, 0.02, 1e3] {
            let c = Tensor([[stretch, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]]);
            for p in [-2.0, 0.65, 2.5] {
                let found = exponential_m1(&logarithm(&c), p).0[0][0] + 1.0;
                let expected: f64 = f64::powf(stretch, p);
                let bound = (1.0 + (p * stretch.ln()).abs()) * 1e-14;
                // the function computes the power minus 1
                assert!((found - expected).abs() < bound * expected.max(1.0), "{stretch}^{p}: {found} {expected}");
            }
        }
    }
}
