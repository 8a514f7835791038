//! Laws with memory: the stress at the end of a load step depends on the history at its start.
//!
//! A law with memory is written once, over [`Differentiable`] numbers: with f64 it gives stress and new
//! history, with dual numbers also their derivatives with respect to F, the previous history and the
//! strength. Elements with such a law are in `inelastic/`.

use super::Real;
use super::principal::spectrum;
use crate::dual::Dual;
use std::array::from_fn;

/// A 3×3 matrix.
pub(crate) type Tensor<R> = [[R; 3]; 3];

/// Number of history variables at an integration point.
pub const HISTORY: usize = 7;

/// A function f of a symmetric matrix by its eigenvalues, Σ f(c_a) N_a ⊗ N_a.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Isotropic {
    /// ln.
    Logarithm,
    /// exp.
    Exponential,
}

impl Isotropic {
    fn value(self, x: f64) -> f64 {
        match self {
            Self::Logarithm => x.ln(),
            Self::Exponential => x.exp(),
        }
    }

    /// (f(a) − f(b))/(a − b), without cancellation; f′ if a = b.
    fn quotient(self, a: f64, b: f64) -> f64 {
        let difference = a - b;
        match self {
            Self::Logarithm if difference == 0.0 => 1.0 / b,
            Self::Logarithm => (difference / b).ln_1p() / difference,
            Self::Exponential if difference == 0.0 => b.exp(),
            Self::Exponential => b.exp() * difference.exp_m1() / difference,
        }
    }
}

/// Numbers in which a law with memory is written: f64, and dual numbers with any number of directions.
pub(crate) trait Differentiable: Real {
    /// An isotropic function of a symmetric matrix. Its derivatives exist for equal eigenvalues too.
    fn isotropic(c: &Tensor<Self>, function: Isotropic) -> Tensor<Self>;
}

impl Differentiable for f64 {
    fn isotropic(c: &Tensor<f64>, function: Isotropic) -> Tensor<f64> {
        let (values, n) = spectrum(*c);
        let f = values.map(|x| function.value(x));
        from_fn(|i| from_fn(|j| (0..3).map(|a| n[i][a] * f[a] * n[j][a]).sum()))
    }
}

impl<const N: usize> Differentiable for Dual<f64, N> {
    /// The derivative along dC is Σ_ab f[c_a, c_b] (N_aᵀ dC N_b) N_a ⊗ N_b with the divided differences
    /// f[a, b]. Reference: Higham, Functions of Matrices (2008), theorem 3.11 (Daleckiĭ and Kreĭn).
    fn isotropic(c: &Tensor<Self>, function: Isotropic) -> Tensor<Self> {
        let (values, n) = spectrum(c.map(|row| row.map(|x| x.value)));
        let f = values.map(|x| function.value(x));
        let quotients: Tensor<f64> = from_fn(|a| from_fn(|b| function.quotient(values[a], values[b])));
        let mut out: Tensor<Self> =
            from_fn(|i| from_fn(|j| Self::from((0..3).map(|a| n[i][a] * f[a] * n[j][a]).sum::<f64>())));
        for k in 0..N {
            let change: Tensor<f64> = from_fn(|i| from_fn(|j| c[i][j].slopes[k]));
            if change.as_flattened().iter().all(|&x| x == 0.0) {
                continue;
            }
            let half: Tensor<f64> = from_fn(|i| from_fn(|b| (0..3).map(|j| change[i][j] * n[j][b]).sum()));
            let inner: Tensor<f64> =
                from_fn(|a| from_fn(|b| quotients[a][b] * (0..3).map(|i| n[i][a] * half[i][b]).sum::<f64>()));
            let half: Tensor<f64> = from_fn(|i| from_fn(|b| (0..3).map(|a| n[i][a] * inner[a][b]).sum()));
            for i in 0..3 {
                for j in 0..3 {
                    out[i][j].slopes[k] = (0..3).map(|b| half[i][b] * n[j][b]).sum();
                }
            }
        }
        out
    }
}

/// A law with memory.
pub(crate) trait Inelastic {
    /// P and the history at the end of a step that starts with the history `previous`. `strength` is the
    /// factor by which the density scales the law's strength relative to its stiffness. With its own
    /// result as the previous history, the function returns the same stress.
    fn update<R: Differentiable>(
        &self,
        f: &Tensor<R>,
        previous: &[R; HISTORY],
        strength: R,
    ) -> (Tensor<R>, [R; HISTORY]);

    /// Kirchhoff stress τ at a state with this history. \[F/L²\]
    fn kirchhoff<R: Differentiable>(&self, f: &Tensor<R>, history: &[R; HISTORY]) -> Tensor<R>;

    /// Elastic energy, and the work done on the history so far (plastic work), per reference volume at a
    /// state with this history. \[F/L²\]
    fn energies<R: Differentiable>(&self, f: &Tensor<R>, history: &[R; HISTORY], strength: R) -> [R; 2];
}
