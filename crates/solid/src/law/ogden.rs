//! Ogden.

use super::constants::{BULK_MODULUS, Hooke};
use super::volume::{self, Volume};
use super::{Constant, Form, Law, Local, MaterialError, Real, Stress, Value};
use crate::registers::{AtPoints, Matrix, POINTS, array, load, load_matrix, product, transpose};
use pulp::Simd;

/// Maximum number of terms.
const TERMS: usize = 4;

/// Ogden's law in principal stretches, for rubber at any stretch.
///
/// ```text
/// Ψ = Σ_i μ_i/α_i (λ̄₁^α_i + λ̄₂^α_i + λ̄₃^α_i − 3) + U(J),   λ̄ = J^(−1/3) λ,   μ = ½ Σ_i μ_i α_i
/// ```
///
/// with the volumetric energy U that all rubber laws share (`law/volume.rs`). Some programs write 2
/// μ_i/α_i² instead of μ_i/α_i; their μ_i is μ_i α_i/2 here.
///
/// With C = Σ_a c_a N_a ⊗ N_a, w_ia = λ̄_a^α_i, its mean m_i over a, and t_a = Σ_i μ_i (w_ia − m_i),
/// the stress S = 2∂Ψ/∂C has the principal values and derivatives
///
/// ```text
/// s_a = t_a/c_a
/// ∂s_a/∂c_b = (T_ab − t_a δ_ab)/(c_a c_b),   T_ab = Σ_i μ_i α_i (½ w_ia δ_ab − (w_ia + w_ib − m_i)/6)
/// dS_ab = (s_a − s_b)/(c_a − c_b) dC_ab,   a ≠ b,   in the basis N
/// ```
///
/// The last quotient contains (c_a^p − c_b^p)/(c_a − c_b) with p = α/2. It is computed as c_b^(p−1)
/// (e^(px) − 1)/(e^x − 1), x = ln(c_a/c_b), which has no cancellation for close stretches and gives
/// p c_b^(p−1) for equal ones.
///
/// References: Ogden, Proc. R. Soc. Lond. A 326 (1972) 565–584; Simo, Taylor, Comput. Methods Appl.
/// Mech. Engrg. 85 (1991) 273–310. Test: `equal_and_close_stretches`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ogden {
    terms: usize,
    /// μ_i and α_i; zeros beyond the number of terms.
    mu: [f64; TERMS],
    alpha: [f64; TERMS],
    bulk: f64,
    limit: Hooke,
}

impl Ogden {
    /// From μ_i \[F/L²\], α_i and the bulk modulus K \[F/L²\].
    ///
    /// # Errors
    /// No term or more than four, lists of different lengths, α_i = 0, Σ μ_i α_i ≤ 0, K ≤ 0, or a
    /// value that is not finite.
    pub fn new(mu: &[f64], alpha: &[f64], bulk_modulus: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[mu.into(), alpha.into(), bulk_modulus.into()])
    }

    /// The terms, as (μ_i, α_i).
    fn each(&self) -> impl Iterator<Item = (f64, f64)> {
        self.mu.into_iter().zip(self.alpha).take(self.terms)
    }

    /// N (entries 0 to 8), ∂s_a/∂c_b (9 to 17), s_a (18 to 20) and the quotients (21 to 23) at
    /// `count` points, beginning with `first`. This is scalar code, compiled once for all
    /// instruction sets.
    #[inline(never)]
    fn prepare_lanes(&self, at: &Local<'_>, first: usize, count: usize, lanes: &mut [AtPoints; 24]) {
        for lane in 0..count {
            let f: [[f64; 3]; 3] = array(|a, b| at.gradient[a][b][first + lane]);
            let c = array(|a, b| f[0][a] * f[0][b] + f[1][a] * f[1][b] + f[2][a] * f[2][b]);
            let (values, n) = spectrum(c);
            let Principal { stress, slopes, quotients } = self.principal(values, at.determinant[first + lane]);
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

    /// Principal stresses and their derivatives, divided by the shear modulus, for the eigenvalues
    /// `c` of C, and J.
    fn principal(&self, c: [f64; 3], j: f64) -> Principal {
        let ln_j = j.ln() / 3.0;
        let ln = c.map(|c| 0.5 * c.ln() - ln_j);
        let mut t = [0.0; 3];
        let mut slopes = [[0.0; 3]; 3];
        // (t_a − t_b)/(c_a − c_b) for (a, b) = (1, 2), (2, 0), (0, 1)
        let mut quotients = [0.0; 3];
        // ln(c_a/c_b) and e^x − 1 over c_a − c_b
        let ratio: [f64; 3] = std::array::from_fn(|k| {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            ((c[a] - c[b]) / c[b]).ln_1p()
        });
        for (mu, alpha) in self.each() {
            let mu = mu / self.limit.mu;
            let w = ln.map(|ln| (alpha * ln).exp());
            let mean = (w[0] + w[1] + w[2]) / 3.0;
            for a in 0..3 {
                t[a] += mu * (w[a] - mean);
                slopes[a][a] += 0.5 * mu * alpha * w[a];
                for b in 0..3 {
                    slopes[a][b] -= mu * alpha / 6.0 * (w[a] + w[b] - mean);
                }
                let (first, second) = ((a + 1) % 3, (a + 2) % 3);
                // w_ib (e^(px) − 1) / (c_b (e^x − 1)), where c_b (e^x − 1) = c_a − c_b
                let power = if ratio[a] == 0.0 {
                    0.5 * alpha / c[second]
                } else {
                    (0.5 * alpha * ratio[a]).exp_m1() / (c[first] - c[second])
                };
                quotients[a] += mu * w[second] * power;
            }
        }
        let mut out = Principal { stress: [0.0; 3], slopes: [[0.0; 3]; 3], quotients: [0.0; 3] };
        for a in 0..3 {
            out.stress[a] = t[a] / c[a];
            for b in 0..3 {
                let own = if a == b { t[a] } else { 0.0 };
                out.slopes[a][b] = (slopes[a][b] - own) / (c[a] * c[b]);
            }
            let (first, second) = ((a + 1) % 3, (a + 2) % 3);
            out.quotients[a] = (quotients[a] - t[second] / c[second]) / c[first];
        }
        out
    }
}

/// Principal values of S and their derivatives, divided by the shear modulus.
struct Principal {
    /// s_a.
    stress: [f64; 3],
    /// ∂s_a/∂c_b.
    slopes: [[f64; 3]; 3],
    /// (s_a − s_b)/(c_a − c_b) for (a, b) = (1, 2), (2, 0), (0, 1).
    quotients: [f64; 3],
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

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix, by Jacobi's method.
///
/// Reference: Golub, Van Loan, Matrix Computations (2013), section 8.5. Test:
/// `spectra_of_symmetric_matrices`.
fn spectrum(mut c: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
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

impl Law for Ogden {
    const CONSTANTS: &'static [Constant] = &[
        Constant {
            key: "mu",
            about: "Moduli μ_i, one for each term, at most four; Σ μ_i α_i > 0 is twice the shear modulus. [F/L²]",
            help: "the moduli of the terms, for instance [0.63, 0.0012, -0.01]",
            form: Form::Moduli { most: TERMS },
        },
        Constant {
            key: "alpha",
            about: "Exponents α_i of the stretches, not zero, one for each term.",
            help: "the exponents of the terms, for instance [1.3, 5.0, -2.0]",
            form: Form::Numbers { most: TERMS },
        },
        BULK_MODULUS,
    ];

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        let [terms, exponents] = [0, 1].map(|i| values[i].numbers().len());
        if terms != exponents {
            let problem = format!("there are {terms} moduli `mu`, but {exponents} exponents `alpha`");
            return Err(MaterialError::new("alpha", problem, "give one exponent for each modulus"));
        }
        let (mu, alpha): ([f64; TERMS], [f64; TERMS]) = (values[0].padded(), values[1].padded());
        if alpha[..terms].contains(&0.0) {
            let help = "omit the term: its energy does not depend on the stretches";
            return Err(MaterialError::new("alpha", "an exponent is zero".into(), help));
        }
        let shear = 0.5 * mu.iter().zip(alpha).map(|(mu, alpha)| mu * alpha).sum::<f64>();
        if !(shear > 0.0) {
            let problem =
                format!("the shear modulus, half the sum of mu alpha, is {shear}: the undeformed solid is not stable");
            return Err(MaterialError::new("mu", problem, "give each modulus the sign of its exponent"));
        }
        let bulk = values[2].number();
        Ok(Self { terms, mu, alpha, bulk, limit: Hooke::from_moduli(bulk, shear) })
    }

    fn values(&self) -> Vec<Value> {
        vec![self.mu[..self.terms].into(), self.alpha[..self.terms].into(), self.bulk.into()]
    }

    /// Most of the shear modulus comes from the first of Ogden's three exponents for Treloar's
    /// data.
    fn like(limit: Hooke) -> Result<Self, MaterialError> {
        let (alpha, shares) = ([1.3, 5.0, -2.0], [0.85, 0.05, 0.1]);
        let mu: [f64; 3] = std::array::from_fn(|i| 2.0 * shares[i] / alpha[i] * limit.mu);
        Self::new(&mu, &alpha, limit.bulk())
    }

    fn hooke(&self) -> &Hooke {
        &self.limit
    }

    /// Σ_a λ̄_a^α is J^(−α/3) tr C^(α/2). Powers of C come from its logarithm, a smooth function of
    /// C: unlike eigenvectors, it has derivatives even where stretches coincide.
    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T {
        let (_, u) = volume::energy(self.bulk, f);
        let ln_c = logarithm(&Tensor::of(f));
        // deviatoric part
        let third = T::from(1.0 / 3.0) * ln_c.trace();
        let ln_c = ln_c.plus(T::from(0.0) - third);
        self.each().fold(u, |sum, (mu, alpha)| sum + T::from(mu / alpha) * exponential_m1(&ln_c, 0.5 * alpha).trace())
    }
}

impl Stress for Ogden {
    type Prepared<S: Simd> = Spectrum<S>;

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.limit.mu
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, simd: S, at: &Local<'_>) -> Spectrum<S> {
        let first = S::F64_LANES * at.v;
        let zero = simd.splat_f64s(0.0);
        let mut out = Spectrum {
            volume: Volume::new(simd, at, self.bulk / self.limit.mu),
            directions: [[zero; 3]; 3],
            stress: [[zero; 3]; 3],
            slopes: [[zero; 3]; 3],
            quotients: [zero; 3],
        };
        let mut lanes = [[0.0; POINTS]; 24];
        self.prepare_lanes(at, first, S::F64_LANES, &mut lanes);
        let lane = |i: usize| load::<S>(&lanes[i], 0);
        out.directions = array(|a, b| lane(3 * a + b));
        out.slopes = array(|a, b| lane(9 + 3 * a + b));
        out.quotients = [lane(21), lane(22), lane(23)];
        let scaled = array(|a, b| simd.mul_f64s(out.directions[a][b], lane(18 + b)));
        out.stress = product(simd, &scaled, &transpose::<S>(&out.directions));
        out
    }

    /// F S and the pressure.
    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Spectrum<S>) -> Matrix<S> {
        let f = load_matrix::<S>(at.gradient, at.v);
        prepared.volume.add_stress(simd, at, &product(simd, &f, &prepared.stress))
    }

    /// dF S + F dS and the change of the pressure.
    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Spectrum<S>, change: &Matrix<S>) -> Matrix<S> {
        let (f, inverse) = (load_matrix::<S>(at.gradient, at.v), load_matrix::<S>(at.inverse, at.v));
        let n = &prepared.directions;
        // dC in the basis N
        let (f_n, change_n) = (product(simd, &f, n), product(simd, change, n));
        let half = product(simd, &transpose::<S>(&f_n), &change_n);
        let slope = |a: usize| {
            let sum = simd.mul_f64s(prepared.slopes[a][0], half[0][0]);
            let sum = simd.mul_add_e_f64s(prepared.slopes[a][1], half[1][1], sum);
            let sum = simd.mul_add_e_f64s(prepared.slopes[a][2], half[2][2], sum);
            simd.add_f64s(sum, sum)
        };
        let diagonal = [slope(0), slope(1), slope(2)];
        let principal: Matrix<S> = array(|a, b| {
            if a == b {
                diagonal[a]
            } else {
                simd.mul_f64s(prepared.quotients[3 - a - b], simd.add_f64s(half[a][b], half[b][a]))
            }
        });
        // F N dS Nᵀ
        let material = product(simd, &product(simd, &f_n, &principal), &transpose::<S>(n));
        let geometric = product(simd, change, &prepared.stress);
        let p = array(|a, b| simd.add_f64s(material[a][b], geometric[a][b]));
        let relative = product(simd, &inverse, change);
        let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
        let turned = product(simd, &relative, &inverse);
        prepared.volume.add_change(simd, &inverse, trace, &turned, &p)
    }
}

/// A 3×3 matrix over any number type.
#[derive(Clone, Copy)]
struct Tensor<T>([[T; 3]; 3]);

impl<T: Real> Tensor<T> {
    /// FᵀF.
    fn of(f: &[[T; 3]; 3]) -> Self {
        Self(array(|a, b| f[0][a] * f[0][b] + f[1][a] * f[1][b] + f[2][a] * f[2][b]))
    }

    fn trace(&self) -> T {
        self.0[0][0] + self.0[1][1] + self.0[2][2]
    }

    /// Adds a multiple of the identity.
    fn plus(&self, x: T) -> Self {
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
fn logarithm<T: Real>(c: &Tensor<T>) -> Tensor<T> {
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
fn exponential_m1<T: Real>(l: &Tensor<T>, p: f64) -> Tensor<T> {
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
