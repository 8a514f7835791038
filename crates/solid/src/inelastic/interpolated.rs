//! The linear part of an element whose energy is interpolated.
//!
//! With the fraction γ of the displacements v, the stiffness s and the history h of the point,
//!
//! ```text
//! W = s ∫ [ Ψ(F̄(γv), h) + (1 − γ²) Ψ_L(H̄(v)) ] dV      h′ = G(F̄(γv), h)
//! f = s [ γ f₀(γv, h) + (1 − γ²) K_L v ]               ∂f/∂v = s [ γ² K₀(γv, h) + (1 − γ²) K_L ]
//! ```
//!
//! so the material flows, and yields, at the scaled displacements. Void (γ = 0) is linear elastic and its
//! history remains zero; solid (γ = 1) is the law. H̄ is the linear term of F̄ at rest. The derivative of
//! λ·f + η·h′ with respect to γ is
//!
//! ```text
//! s λ·f₀ + γ s λ·K₀ v − 2γ s λ·K_L v + (∂(η·h′)/∂F̄) : δF̄(v)
//! ```
//!
//! Source of the interpolation: [`crate::EnergyInterpolation`].

use super::points::{Deformed, PointElement, Tensor};
use crate::block::State;
use crate::law::{Hooke, Law as _, with_memory};
use std::array::from_fn;

/// Ψ_L at the points of an element.
pub(super) struct Linear<'a> {
    element: &'a PointElement,
    rest: Deformed,
    /// H̄ along v.
    strains: Vec<Tensor>,
    hooke: Hooke,
}

impl<'a> Linear<'a> {
    /// At the displacements of a state; `None` if they are not numbers.
    pub fn of(element: &'a PointElement, state: State<'_>) -> Option<Self> {
        let rest = element.rest()?;
        let strains = element.change(&rest, &element.unexpanded(state));
        let material = &state.sections[element.section as usize].material;
        Some(Self { element, rest, strains, hooke: with_memory!(material, law => *law.hooke()) })
    }

    /// ∂Ψ_L/∂H.
    fn stress(&self, h: &Tensor) -> Tensor {
        let volume = self.hooke.lambda * (h[0][0] + h[1][1] + h[2][2]);
        from_fn(|a| from_fn(|b| self.hooke.mu * (h[a][b] + h[b][a]) + if a == b { volume } else { 0.0 }))
    }

    /// A factor times K_L v.
    pub fn forces(&self, factor: f64) -> Vec<[f64; 3]> {
        let of = |(h, weight): (&Tensor, &f64)| self.stress(h).map(|row| row.map(|x| factor * weight * x));
        let tensors: Vec<Tensor> = self.strains.iter().zip(&self.element.weights).map(of).collect();
        self.element.forces(&self.rest, &tensors)
    }

    /// A factor times K_L, as [`PointElement::tangent`].
    pub fn tangent(&self, factor: f64) -> Vec<f64> {
        let Hooke { lambda, mu, .. } = self.hooke;
        let one = |i: usize, j: usize| f64::from(u8::from(i == j));
        let entry = |a: usize, b: usize, c: usize, d: usize| {
            lambda * one(a, b) * one(c, d) + mu * (one(a, c) * one(b, d) + one(a, d) * one(b, c))
        };
        let of = |weight: &f64| -> [[f64; 9]; 9] {
            from_fn(|row| from_fn(|column| factor * weight * entry(row / 3, row % 3, column / 3, column % 3)))
        };
        let moduli: Vec<_> = self.element.weights.iter().map(of).collect();
        self.element.tangent(&self.rest, &vec![[[0.0; 3]; 3]; moduli.len()], &moduli)
    }

    /// λ·K_L v, for λ at the nodes of the element.
    pub fn product(&self, lambda: &[[f64; 3]]) -> f64 {
        let changes = self.element.change(&self.rest, lambda);
        let of = |((h, change), weight): ((&Tensor, &Tensor), &f64)| weight * contract(&self.stress(h), change);
        self.strains.iter().zip(&changes).zip(&self.element.weights).map(of).sum()
    }

    /// ∫ Ψ_L. \[F L\]
    pub fn energy(&self) -> f64 {
        let of = |(h, weight): (&Tensor, &f64)| weight * self.hooke.energy(h);
        self.strains.iter().zip(&self.element.weights).map(of).sum()
    }
}

impl PointElement {
    /// Without displacements.
    fn rest(&self) -> Option<Deformed> {
        self.at(vec![from_fn(|a| from_fn(|b| f64::from(u8::from(a == b)))); self.points()])
    }

    /// v at the nodes, relative to the first.
    pub(super) fn unexpanded(&self, state: State<'_>) -> Vec<[f64; 3]> {
        let mut v = self.gather(state.d);
        if let Some(heat) = &state.heat {
            let stretch = heat.stretches[self.number()];
            heat.without_expansion(&self.nodes, stretch, stretch, &mut v);
        }
        let first = v[0];
        v.iter().map(|v| from_fn(|c| v[c] - first[c])).collect()
    }

    /// Σ_q T_q : δF̄_q along v, the derivative with respect to γ at fixed T.
    pub(super) fn along(&self, at: &Deformed, tensors: &[Tensor], v: &[[f64; 3]]) -> f64 {
        self.change(at, v).iter().zip(tensors).map(|(change, t)| contract(t, change)).sum()
    }

    /// λ·(Σ_q T_q : δ²F̄_q) v, which vanishes without F̄.
    pub(super) fn curvature(&self, at: &Deformed, tensors: &[Tensor], lambda: &[[f64; 3]], v: &[[f64; 3]]) -> f64 {
        if self.average.is_none() {
            return 0.0;
        }
        let matrix = self.tangent(at, tensors, &vec![[[0.0; 9]; 9]; tensors.len()]);
        let v = v.as_flattened();
        let rows = matrix.chunks_exact(v.len()).zip(lambda.as_flattened());
        rows.map(|(row, lambda)| lambda * row.iter().zip(v).map(|(k, v)| k * v).sum::<f64>()).sum()
    }
}

pub(super) fn contract(x: &Tensor, y: &Tensor) -> f64 {
    x.as_flattened().iter().zip(y.as_flattened()).map(|(x, y)| x * y).sum()
}
