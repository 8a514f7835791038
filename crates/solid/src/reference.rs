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

/// Parent coordinates of the nodes of a hex27: corners, edges, faces −x, +x, −y, +y, −z, +z, centre.
fn node_of_27(i: usize) -> [f64; 3] {
    let mean = |a: usize, b: usize| from_fn(|c| 0.5 * (corner(a)[c] + corner(b)[c]));
    match i {
        0..8 => corner(i),
        8..12 => mean(i - 8, (i - 7) % 4),
        12..16 => mean(i - 8, 4 + (i - 11) % 4),
        16..20 => mean(i - 16, i - 12),
        20..26 => from_fn(|c| if c == (i - 20) / 2 { 2.0 * ((i - 20) % 2) as f64 - 1.0 } else { 0.0 }),
        _ => [0.0; 3],
    }
}

/// Shape functions of a tetrahedron, wedge or hexahedron, by its number of nodes, at a point of the
/// parent element.
fn shapes<T: Real>(nodes: usize, [x, y, z]: [T; 3]) -> Vec<T> {
    let (one, half) = (T::from(1.0), |sign: f64, x: T| T::from(0.5) + T::from(0.5 * sign) * x);
    match nodes {
        4 => vec![one - x - y - z, x, y, z],
        10 => {
            let l = [one - x - y - z, x, y, z];
            let corners = l.map(|l| l * (l + l - one)).into_iter();
            let edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];
            corners.chain(edges.map(|(a, b)| T::from(4.0) * l[a] * l[b])).collect()
        }
        27 => {
            // Lagrange polynomials through −1, 0, 1
            let line = |node: f64, x: T| match node {
                0.0 => (one + x) * (one - x),
                _ => T::from(0.5 * node) * x * (one + T::from(node) * x),
            };
            (0..27).map(node_of_27).map(|[a, b, c]| line(a, x) * line(b, y) * line(c, z)).collect()
        }
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
        10 => {
            // two orbits of the tetrahedron's symmetry: Felippa, Engrg. Comput. 21 (2004) 867–890
            let orbit = |a: f64, weight: f64| {
                (0..4).map(move |far| (from_fn(|c| if c + 1 == far { 1.0 - 3.0 * a } else { a }), weight / 6.0))
            };
            let first = orbit(0.3281633025163817, 0.1362178425370874);
            first.chain(orbit(0.1080472498984286, 0.1137821574629126)).collect()
        }
        27 => {
            let line = |i: usize| [(-0.6_f64.sqrt(), 5.0), (0.0, 8.0), (0.6_f64.sqrt(), 5.0)][i];
            let point = |[x, y, z]: [(f64, f64); 3]| ([x.0, y.0, z.0], x.1 * y.1 * z.1 / 729.0);
            (0..27).map(|i| point([i % 3, i / 3 % 3, i / 9].map(line))).collect()
        }
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

pub mod tests;
