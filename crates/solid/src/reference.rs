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

/// W = s Σ w [Ψ(F̄) + (1 − γ²) Ψ_L(H̄)] of the element with n nodes X and displacements u; H =
/// ∂u/∂X, F = 1 + γH. Full: F̄ = F and H̄ = H. F̄: H̄ = H + (mean of tr H − tr H)/3; F̄ = (mean of
/// J / J)^(1/3) F, or 1 + γH̄ if the law has small strains.
pub fn energy<T: Real>(section: &Section, x: &[[f64; 3]], u: &[[T; 3]], [s, gamma]: [T; 2]) -> T {
    let (law, full, n) = (&section.material, section.formulation == Formulation::Full, x.len());
    let (zero, one, third) = (T::from(0.0), T::from(1.0), T::from(1.0 / 3.0));
    let at_point = |(at, weight): ([f64; 3], f64)| -> (T, [[T; 3]; 3]) {
        let slopes: [Vec<_>; 3] =
            from_fn(|b| shapes(n, from_fn(|c| Dual { value: at[c], slopes: [f64::from(b == c)] })));
        let dx = from_fn(|a| from_fn(|b| T::from((0..n).map(|i| x[i][a] * slopes[b][i].slopes[0]).sum())));
        let du = |a: usize, b: usize| (0..n).fold(zero, |sum, i| sum + u[i][a] * T::from(slopes[b][i].slopes[0]));
        // Cramer's rule solves H ∂X/∂ξ = ∂u/∂ξ.
        let replaced = |a, b| from_fn(|c| if c == b { from_fn(|beta| du(a, beta)) } else { dx[c] });
        let h = from_fn(|a| from_fn(|b| determinant(&replaced(a, b)) / determinant(&dx)));
        (T::from(weight) * determinant(&dx), h)
    };
    let points: Vec<_> = quadrature(n).into_iter().map(at_point).collect();
    // The means are linear functions over a hex27, found from the normal equations, and constants
    // otherwise.
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
    let mean = |f: &dyn Fn(&[[T; 3]; 3]) -> T| -> Vec<T> {
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
    };
    let plus = |h: &[[T; 3]; 3], x: T| from_fn(|a| from_fn(|b| if a == b { h[a][b] + x } else { h[a][b] }));
    let f = |h: &[[T; 3]; 3]| -> [[T; 3]; 3] { plus(&h.map(|row| row.map(|h| gamma * h)), one) };
    let (trace, j) = (|h: &[[T; 3]; 3]| h[0][0] + h[1][1] + h[2][2], |h: &[[T; 3]; 3]| determinant(&f(h)));
    let (mean_trace, mean_j) = (mean(&trace), mean(&j));
    s * points.iter().enumerate().fold(zero, |sum, (p, (w, h))| {
        let h_bar = if full { *h } else { plus(h, third * (mean_trace[p] - trace(h))) };
        let ratio = |h| (third * (mean_j[p] / j(h)).ln()).exp_m1() + one;
        let f_bar = if full || law.small_strains() { f(&h_bar) } else { f(h).map(|row| row.map(|f| ratio(h) * f)) };
        sum + *w * (law.energy(&f_bar) + (one - gamma * gamma) * law.small_strain_energy(&h_bar))
    })
}
