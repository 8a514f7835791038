//! Finite rotations given by a rotation vector θ: the angle is |θ|, the axis θ/|θ|.
//!
//! With q = |θ|², W = [θ]×, s = sin|θ|/|θ| and c = (1 − cos|θ|)/q,
//!
//! ```text
//! R = 1 + s W + c (θθᵀ − q 1)
//! ```
//!
//! s and c are smooth functions of q, so R and its derivatives are also exact for small rotations.

use nalgebra::{Matrix3, Vector3};

/// s and c, or their derivatives with respect to q.
#[derive(Debug, Clone, Copy)]
struct Factors {
    s: f64,
    c: f64,
}

/// s and c at q, and their first and second derivatives. s solves 4q s″ + 6s′ + s = 0, and c′ =
/// (s/2 − c)/q.
fn factors(q: f64) -> [Factors; 3] {
    if q < 0.5 {
        // Σ (−q)ⁿ/(2n + 1)! and Σ (−q)ⁿ/(2n + 2)!, and their derivatives term by term
        let mut out = [Factors { s: 0.0, c: 0.0 }; 3];
        let mut factorial = 1.0; // (−1)ⁿ (2n + 1)!
        for n in 0..10_i32 {
            let (s, k) = (1.0 / factorial, f64::from(n));
            let c = s / (2.0 * k + 2.0);
            let powers = [q.powi(n), k * q.powi((n - 1).max(0)), k * (k - 1.0) * q.powi((n - 2).max(0))];
            for (to, power) in out.iter_mut().zip(powers) {
                to.s += s * power;
                to.c += c * power;
            }
            factorial *= -(2.0 * k + 2.0) * (2.0 * k + 3.0);
        }
        return out;
    }
    let angle = q.sqrt();
    let (s, c) = (angle.sin() / angle, (1.0 - angle.cos()) / q);
    let (s1, c1) = ((angle.cos() - s) / (2.0 * q), (0.5 * s - c) / q);
    let (s2, c2) = (-(s + 6.0 * s1) / (4.0 * q), (0.5 * s1 - 2.0 * c1) / q);
    [Factors { s, c }, Factors { s: s1, c: c1 }, Factors { s: s2, c: c2 }]
}

fn cross(v: &Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

/// R − 1.
pub(in crate::equations) fn turn(theta: &Vector3<f64>) -> Matrix3<f64> {
    let q = theta.norm_squared();
    let Factors { s, c } = factors(q)[0];
    cross(theta) * s + (theta * theta.transpose() - Matrix3::identity() * q) * c
}

/// ∂R/∂θ_k for k = 0, 1, 2.
///
/// Test: `derivatives_match_finite_differences`.
pub(in crate::equations) fn turn_slopes(theta: &Vector3<f64>) -> [Matrix3<f64>; 3] {
    let q = theta.norm_squared();
    let [Factors { s, c }, Factors { s: s1, c: c1 }, _] = factors(q);
    let square = theta * theta.transpose() - Matrix3::identity() * q;
    std::array::from_fn(|k| {
        let e = Vector3::ith(k, 1.0);
        let products = e * theta.transpose() + theta * e.transpose() - Matrix3::identity() * (2.0 * theta[k]);
        cross(theta) * (2.0 * s1 * theta[k]) + cross(&e) * s + square * (2.0 * c1 * theta[k]) + products * c
    })
}

/// ∂²(Σ f·R a)/∂θ∂θ for M = Σ a fᵀ.
///
/// With θ·v = tr(W M), Q = θᵀMθ − q tr M and the symmetric part S of M, the sum is tr M + s θ·v + c Q.
/// Test: `derivatives_match_finite_differences`.
pub(in crate::equations) fn curvature(theta: &Vector3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    let q = theta.norm_squared();
    let [Factors { s: _, c }, Factors { s: s1, c: c1 }, Factors { s: s2, c: c2 }] = factors(q);
    let v = Vector3::new(m[(1, 2)] - m[(2, 1)], m[(2, 0)] - m[(0, 2)], m[(0, 1)] - m[(1, 0)]);
    let (symmetric, trace) = ((m + m.transpose()) * 0.5, m.trace());
    let one = Matrix3::identity();
    let by_square = symmetric * theta * 2.0 - theta * (2.0 * trace);
    let (along, square) = (theta.dot(&v), theta.dot(&(symmetric * theta)) - q * trace);
    let dyad = theta * theta.transpose();
    let pair = |a: &Vector3<f64>| theta * a.transpose() + a * theta.transpose();
    (dyad * (4.0 * s2) + one * (2.0 * s1)) * along
        + pair(&v) * (2.0 * s1)
        + (dyad * (4.0 * c2) + one * (2.0 * c1)) * square
        + pair(&by_square) * (2.0 * c1)
        + (symmetric - one * trace) * (2.0 * c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    const SIZES: [f64; 6] = [0.0, 1e-7, 0.1, 0.705, 0.71, 3.0];

    fn vector(size: f64) -> Vector3<f64> {
        Vector3::new(0.3, -0.7, 0.5).normalize() * size
    }

    /// Against nalgebra.
    #[test]
    fn rotations_are_those_of_the_rotation_vector() {
        for size in SIZES {
            let expected = Rotation3::from_scaled_axis(vector(size)).into_inner() - Matrix3::identity();
            assert!((turn(&vector(size)) - expected).norm() < 1e-15 + 1e-15 * size, "{size}");
        }
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let m = Matrix3::new(1.0, -2.0, 0.3, 0.7, 0.4, -1.1, 2.2, 0.9, -0.6);
        let h = 1e-5;
        for size in SIZES {
            let theta = vector(size);
            let slope = |theta: &Vector3<f64>| Vector3::from_fn(|k, _| (turn_slopes(theta)[k] * m).trace());
            let hessian = curvature(&theta, &m);
            for k in 0..3 {
                let (up, down) = (theta + Vector3::ith(k, h), theta - Vector3::ith(k, h));
                let by_k = (turn(&up) - turn(&down)) / (2.0 * h);
                assert!((turn_slopes(&theta)[k] - by_k).norm() < 1e-9, "{size}");
                let column = (slope(&up) - slope(&down)) / (2.0 * h);
                assert!((hessian.column(k) - column).norm() < 1e-8, "{size}: {hessian} for {column}");
            }
        }
    }
}
