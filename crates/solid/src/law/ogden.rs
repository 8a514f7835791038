//! Ogden.

use super::constants::{BULK_MODULUS, Hooke};
use super::principal::{Principal, Spectrum, Tensor, exponential_m1, logarithm};
use super::volume::{self, Volume};
use super::{Constant, Form, Law, Local, MaterialError, Real, Stress, Value};
use crate::registers::Matrix;
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
        let volume = Volume::new(simd, at, self.bulk / self.limit.mu);
        Spectrum::new(simd, at, volume, |c, j| self.principal(c, j))
    }

    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Spectrum<S>) -> Matrix<S> {
        prepared.stress(simd, at)
    }

    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Spectrum<S>, change: &Matrix<S>) -> Matrix<S> {
        prepared.stress_change(simd, at, change)
    }
}
