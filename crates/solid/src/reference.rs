//! The reference element: the energy as in a textbook, in scalar code, with derivatives from dual
//! numbers. It shares no code with the kernels, which must agree with it (`reference/tests.rs`).
//! Implement a new element here first.

use crate::dual::Dual;
use crate::law::{Real, determinant};
use crate::{Formulation, Section};
use std::array::from_fn;

/// Corner i of the parent cube.
fn corner(i: usize) -> [f64; 3] {
    [(i ^ (i >> 1)) & 1, (i >> 1) & 1, i >> 2].map(|bit| 2.0 * bit as f64 - 1.0)
}

/// Shape functions of a tetrahedron, wedge or hexahedron, by its number of nodes, at a point of the
/// parent element.
fn shapes<T: Real>(nodes: usize, [x, y, z]: [T; 3]) -> Vec<T> {
    let (one, half) = (T::from(1.0), |sign: f64, x: T| T::from(0.5) + T::from(0.5 * sign) * x);
    match nodes {
        4 => vec![one - x - y - z, x, y, z],
        6 => (0..6).map(|i| [one - x - y, x, y][i % 3] * half([-1.0, 1.0][i / 3], z)).collect(),
        _ => (0..8).map(corner).map(|[a, b, c]| half(a, x) * half(b, y) * half(c, z)).collect(),
    }
}

/// Points of the parent element and their weights. Those of a wedge are the points of a cube in
/// which two edges are collapsed to points.
fn quadrature(nodes: usize) -> Vec<([f64; 3], f64)> {
    let gauss = (0..8).map(|i| corner(i).map(|sign| sign / 3.0_f64.sqrt()));
    match nodes {
        4 => vec![([0.25; 3], 1.0 / 6.0)],
        6 => gauss.map(|[x, y, z]| ([0.25 * (1.0 + x) * (1.0 - y), 0.5 * (1.0 + y), z], 0.125 * (1.0 - y))).collect(),
        _ => gauss.map(|point| (point, 1.0)).collect(),
    }
}

/// W = s Σ w [Ψ(F̄) + (1 − γ²) Ψ_L(H̄)] of the element with n nodes X and displacements u; H =
/// ∂u/∂X, F = 1 + γH. Full: F̄ = F and H̄ = H. F̄: H̄ = H + (mean of tr H − tr H)/3; F̄ = (mean of
/// J / J)^(1/3) F, or 1 + γH̄ if the law has small strains.
pub fn energy<T: Real>(section: &Section, x: &[[f64; 3]], u: &[[T; 3]], [s, gamma]: [T; 2]) -> T {
    let (law, full, n) = (&section.material, section.formulation == Formulation::Full, x.len());
    let (zero, one, third) = (T::from(0.0), T::from(1.0), T::from(1.0 / 3.0));
    let at_point = |(at, weight): ([f64; 3], f64)| -> (T, [[T; 3]; 3]) {
        let slopes: [Vec<_>; 3] = from_fn(|b| shapes(n, from_fn(|c| Dual { value: at[c], slope: f64::from(b == c) })));
        let dx = from_fn(|a| from_fn(|b| T::from((0..n).map(|i| x[i][a] * slopes[b][i].slope).sum())));
        let du = |a: usize, b: usize| (0..n).fold(zero, |sum, i| sum + u[i][a] * T::from(slopes[b][i].slope));
        // Cramer's rule solves H ∂X/∂ξ = ∂u/∂ξ.
        let replaced = |a, b| from_fn(|c| if c == b { from_fn(|beta| du(a, beta)) } else { dx[c] });
        let h = from_fn(|a| from_fn(|b| determinant(&replaced(a, b)) / determinant(&dx)));
        (T::from(weight) * determinant(&dx), h)
    };
    let points: Vec<_> = quadrature(n).into_iter().map(at_point).collect();
    let integral = |f: &dyn Fn(&[[T; 3]; 3]) -> T| points.iter().fold(zero, |sum, (w, h)| sum + *w * f(h));
    let mean = |f: &dyn Fn(&[[T; 3]; 3]) -> T| integral(f) / integral(&|_| one);
    let plus = |h: &[[T; 3]; 3], x: T| from_fn(|a| from_fn(|b| if a == b { h[a][b] + x } else { h[a][b] }));
    let f = |h: &[[T; 3]; 3]| -> [[T; 3]; 3] { plus(&h.map(|row| row.map(|h| gamma * h)), one) };
    let (trace, j) = (|h: &[[T; 3]; 3]| h[0][0] + h[1][1] + h[2][2], |h: &[[T; 3]; 3]| determinant(&f(h)));
    let (mean_trace, mean_j) = (mean(&trace), mean(&j));
    s * integral(&|h| {
        let h_bar = if full { *h } else { plus(h, third * (mean_trace - trace(h))) };
        let ratio = |h| (third * (mean_j / j(h)).ln()).exp_m1() + one;
        let f_bar = if full || law.small_strains() { f(&h_bar) } else { f(h).map(|row| row.map(|f| ratio(h) * f)) };
        law.energy(&f_bar) + (one - gamma * gamma) * law.small_strain_energy(&h_bar)
    })
}

pub mod tests;
