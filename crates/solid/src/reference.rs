//! The reference element: the energy as in a textbook, in scalar code, with derivatives from dual
//! numbers. It shares no code with the kernels, which must agree with it (`reference/tests.rs`).
//! Implement a new element here first: its shape functions and points in `parent.rs`.

mod parent;
pub mod tests;

use crate::dual::Dual;
use crate::law::{Real, determinant};
use crate::{Formulation, Section};
use parent::{quadrature, shapes};
use std::array::from_fn;

type Tensor<T> = [[T; 3]; 3];

/// The energy of an element with nodes X and displacements u:
///
/// ```text
/// W = s Σ_p w_p det(∂X/∂ξ) [Ψ(F) + (1 − γ²) Ψ_L(H)],      H = ∂u/∂X,  F = 1 + γH
/// ```
///
/// over the integration points p. Ψ is the law's energy, s and γ interpolate between material and void; γ = 1
/// and s = 1 for solid material. With F̄, [`averaged`] F and H replace F and H.
pub fn energy<T: Real>(section: &Section, x: &[[f64; 3]], u: &[[T; 3]], [s, gamma]: [T; 2]) -> T {
    let (law, one) = (&section.material, T::from(1.0));
    let points = displacement_gradients(x, u, section.formulation);
    let gradients = match section.formulation {
        Formulation::Full | Formulation::Reduced => {
            points.iter().map(|(_, h)| (deformation_gradient(h, gamma), *h)).collect()
        }
        _ => averaged(x, &points, gamma, law.small_strains()),
    };
    let at_point = |(f, h): &(Tensor<T>, Tensor<T>)| law.energy(f) + (one - gamma * gamma) * law.small_strain_energy(h);
    s * points.iter().zip(&gradients).fold(T::from(0.0), |sum, ((w, _), at)| sum + *w * at_point(at))
}

/// H = ∂u/∂X = ∂u/∂ξ (∂X/∂ξ)⁻¹ at each integration point, and its weight w det(∂X/∂ξ), from the shape
/// functions N_i: X(ξ) = Σ N_i(ξ) X_i and u(ξ) = Σ N_i(ξ) u_i.
fn displacement_gradients<T: Real>(x: &[[f64; 3]], u: &[[T; 3]], formulation: Formulation) -> Vec<(T, Tensor<T>)> {
    let (n, zero) = (x.len(), T::from(0.0));
    let at_point = |(at, weight): ([f64; 3], f64)| -> (T, Tensor<T>) {
        // ∂N_i/∂ξ_b, from dual numbers
        let slopes: [Vec<_>; 3] =
            from_fn(|b| shapes(n, from_fn(|c| Dual { value: at[c], slopes: [f64::from(b == c)] })));
        let dx = from_fn(|a| from_fn(|b| T::from((0..n).map(|i| x[i][a] * slopes[b][i].slopes[0]).sum())));
        let du = |a: usize, b: usize| (0..n).fold(zero, |sum, i| sum + u[i][a] * T::from(slopes[b][i].slopes[0]));
        // Cramer's rule solves H ∂X/∂ξ = ∂u/∂ξ
        let replaced = |a, b| from_fn(|c| if c == b { from_fn(|beta| du(a, beta)) } else { dx[c] });
        let h = from_fn(|a| from_fn(|b| determinant(&replaced(a, b)) / determinant(&dx)));
        (T::from(weight) * determinant(&dx), h)
    };
    let points = if n == 27 && formulation == Formulation::Reduced { 8 } else { n };
    quadrature(points).into_iter().map(at_point).collect()
}

/// F = 1 + γH.
fn deformation_gradient<T: Real>(h: &Tensor<T>, gamma: T) -> Tensor<T> {
    plus(&h.map(|row| row.map(|h| gamma * h)), T::from(1.0))
}

/// A tensor plus a multiple of the unit tensor.
fn plus<T: Real>(h: &Tensor<T>, x: T) -> Tensor<T> {
    from_fn(|a| from_fn(|b| if a == b { h[a][b] + x } else { h[a][b] }))
}

/// F̄ and H̄ at each point: the volume change of F, and the trace of H, become means over the element, which
/// prevents locking of nearly incompressible material.
///
/// ```text
/// H̄ = H + (mean of tr H − tr H)/3,      F̄ = (mean of J / J)^(1/3) F,  or 1 + γH̄ for small strains
/// ```
fn averaged<T: Real>(
    x: &[[f64; 3]],
    points: &[(T, Tensor<T>)],
    gamma: T,
    small_strains: bool,
) -> Vec<(Tensor<T>, Tensor<T>)> {
    let (one, third) = (T::from(1.0), T::from(1.0 / 3.0));
    let trace = |h: &Tensor<T>| h[0][0] + h[1][1] + h[2][2];
    let j = |h: &Tensor<T>| determinant(&deformation_gradient(h, gamma));
    let (mean_trace, mean_j) = (means(x, points, &trace), means(x, points, &j));
    let at_point = |(p, (_, h)): (usize, &(T, Tensor<T>))| {
        let h_bar = plus(h, third * (mean_trace[p] - trace(h)));
        let ratio = (third * (mean_j[p] / j(h)).ln()).exp_m1() + one;
        let scaled = || deformation_gradient(h, gamma).map(|row| row.map(|f| ratio * f));
        (if small_strains { deformation_gradient(&h_bar, gamma) } else { scaled() }, h_bar)
    };
    points.iter().enumerate().map(at_point).collect()
}

/// Means of a function of H, at each point: linear functions over a hex27, found from the normal equations,
/// and constants otherwise.
fn means<T: Real>(x: &[[f64; 3]], points: &[(T, Tensor<T>)], f: &dyn Fn(&Tensor<T>) -> T) -> Vec<T> {
    let (n, zero) = (x.len(), T::from(0.0));
    let modes: Vec<Vec<f64>> = quadrature(n)
        .iter()
        .map(|(at, _)| match n {
            27 => {
                let at = shapes(n, *at);
                (0..4).map(|m| if m == 0 { 1.0 } else { (0..n).map(|i| at[i] * x[i][m - 1]).sum() }).collect()
            }
            _ => vec![1.0],
        })
        .collect();
    let count = modes[0].len();
    let sum = |of: &dyn Fn(usize) -> T| (0..modes.len()).fold(zero, |sum, p| sum + points[p].0 * of(p));
    let mut system: Vec<Vec<T>> = (0..count)
        .map(|m| {
            let product = |n: usize| sum(&|p| T::from(modes[p][m] * modes[p][n]));
            (0..count).map(product).chain([sum(&|p| T::from(modes[p][m]) * f(&points[p].1))]).collect()
        })
        .collect();
    for m in 0..count {
        let pivot: Vec<T> = system[m].iter().map(|&x| x / system[m][m]).collect();
        for (k, row) in system.iter_mut().enumerate() {
            let share = row[m];
            (0..=count).for_each(|c| row[c] = if k == m { pivot[c] } else { row[c] - share * pivot[c] });
        }
    }
    let value = |p: usize| (0..count).fold(zero, |sum, m| sum + system[m][count] * T::from(modes[p][m]));
    (0..modes.len()).map(value).collect()
}
