//! One hex8 element: internal force, tangent, energy.
//!
//! With G_i = ∂N_i/∂X at a Gauss point, F = I + Σ d_i ⊗ G_i, J = det F and the spatial gradients g_i = F⁻ᵀ G_i:
//!
//! ```text
//! f_ia     = Σ w 2c (F_aB G_iB − J^(−2β) g_ia)
//! K_ia,kb  = Σ w 2c [ δ_ab G_i·G_k + J^(−2β) (2β g_ia g_kb + g_ka g_ib) ]
//! ```

use crate::material::NeoHooke;

/// Number of Gauss points.
pub const POINTS: usize = 8;

type Matrix = [[f64; 3]; 3];

/// Signs of the corners in the parent cube, VTK numbering.
const CORNER: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Reference geometry of an element at its Gauss points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceGeometry {
    /// ∂N_i/∂X at each point. \[1/L\]
    pub gradients: [[[f64; 3]; 8]; POINTS],
    /// Weight times det(∂X/∂ξ) at each point. \[L³\]
    pub weights: [f64; POINTS],
}

impl ReferenceGeometry {
    /// `None` if the Jacobian determinant is not positive at a Gauss point.
    pub fn new(corners: &[[f64; 3]; 8]) -> Option<Self> {
        let mut out = Self { gradients: [[[0.0; 3]; 8]; POINTS], weights: [0.0; POINTS] };
        let abscissa = 1.0 / 3f64.sqrt();
        for (point, corner) in CORNER.iter().enumerate() {
            let xi = corner.map(|c| c * abscissa);
            let mut parent = [[0.0; 3]; 8];
            let mut jacobian = [[0.0; 3]; 3];
            for i in 0..8 {
                let s = CORNER[i];
                let f: [f64; 3] = std::array::from_fn(|c| 1.0 + s[c] * xi[c]);
                parent[i] = [0.125 * s[0] * f[1] * f[2], 0.125 * s[1] * f[0] * f[2], 0.125 * s[2] * f[0] * f[1]];
                for a in 0..3 {
                    for b in 0..3 {
                        jacobian[a][b] += corners[i][a] * parent[i][b];
                    }
                }
            }
            let (inverse, det) = invert(&jacobian);
            if !(det > 0.0 && det.is_finite()) {
                return None;
            }
            out.weights[point] = det;
            for i in 0..8 {
                for a in 0..3 {
                    out.gradients[point][i][a] = (0..3).map(|b| parent[i][b] * inverse[b][a]).sum();
                }
            }
        }
        Some(out)
    }
}

/// Inverse and determinant of a 3×3 matrix; the inverse is meaningless where the determinant vanishes.
#[inline]
fn invert(m: &[[f64; 3]; 3]) -> ([[f64; 3]; 3], f64) {
    let cofactor = |a: usize, b: usize| {
        let (a1, a2, b1, b2) = ((a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3);
        m[a1][b1] * m[a2][b2] - m[a1][b2] * m[a2][b1]
    };
    let det = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    (std::array::from_fn(|a| std::array::from_fn(|b| cofactor(b, a) / det)), det)
}

/// F, its inverse and J at one Gauss point; `None` if J ≤ 0 or not finite.
#[inline]
fn deformation(gradients: &[[f64; 3]; 8], d: &[[f64; 3]; 8]) -> Option<(Matrix, Matrix, f64)> {
    let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for i in 0..8 {
        for a in 0..3 {
            for b in 0..3 {
                f[a][b] += d[i][a] * gradients[i][b];
            }
        }
    }
    let (inverse, j) = invert(&f);
    (j > 0.0 && j.is_finite()).then_some((f, inverse, j))
}

/// Internal force f = ∂W/∂d of the element at displacements `d`. \[F\]. `None` if J ≤ 0 at a Gauss point.
///
/// Paper: (18), (100). Tests: `force_is_the_gradient_of_the_energy`, `reference_element` (tests/reference.rs).
#[inline]
pub fn internal_force(material: &NeoHooke, at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> Option<[[f64; 3]; 8]> {
    let mut force = [[0.0; 3]; 8];
    for point in 0..POINTS {
        let gradients = &at.gradients[point];
        let (f, inverse, j) = deformation(gradients, d)?;
        let (scale, volumetric) = (at.weights[point] * material.modulus(), j.powf(-material.exponent()));
        let mut stress = [[0.0; 3]; 3];
        for a in 0..3 {
            for b in 0..3 {
                stress[a][b] = scale * (f[a][b] - volumetric * inverse[b][a]);
            }
        }
        for i in 0..8 {
            for a in 0..3 {
                for b in 0..3 {
                    force[i][a] += stress[a][b] * gradients[i][b];
                }
            }
        }
    }
    Some(force)
}

/// Tangent ∂f/∂d: block (i, k) at `[8 i + k]`, row-major 3×3. \[F/L\]. Symmetric. `None` if J ≤ 0 at a Gauss point.
///
/// Test: `tangent_is_the_derivative_of_the_force`.
#[inline]
pub fn tangent(material: &NeoHooke, at: &ReferenceGeometry, d: &[[f64; 3]; 8], out: &mut [[f64; 9]; 64]) -> Option<()> {
    *out = [[0.0; 9]; 64];
    for point in 0..POINTS {
        let gradients = &at.gradients[point];
        let (_, inverse, j) = deformation(gradients, d)?;
        let scale = at.weights[point] * material.modulus();
        let volumetric = scale * j.powf(-material.exponent());
        let mut spatial = [[0.0; 3]; 8];
        for i in 0..8 {
            for a in 0..3 {
                spatial[i][a] = (0..3).map(|b| inverse[b][a] * gradients[i][b]).sum();
            }
        }
        for i in 0..8 {
            for k in i..8 {
                let (gi, gk) = (&spatial[i], &spatial[k]);
                let dot: f64 = (0..3).map(|b| gradients[i][b] * gradients[k][b]).sum();
                let block = &mut out[8 * i + k];
                for a in 0..3 {
                    block[4 * a] += scale * dot;
                    for b in 0..3 {
                        block[3 * a + b] += volumetric * (material.exponent() * gi[a] * gk[b] + gk[a] * gi[b]);
                    }
                }
            }
        }
    }
    for i in 0..8 {
        for k in 0..i {
            let upper = out[8 * k + i];
            out[8 * i + k] = std::array::from_fn(|e| upper[3 * (e % 3) + e / 3]);
        }
    }
    Some(())
}

/// Strain energy of the element. \[F L\]. `None` if J ≤ 0 at a Gauss point.
pub fn energy(material: &NeoHooke, at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> Option<f64> {
    let mut energy = 0.0;
    for point in 0..POINTS {
        let (f, _, j) = deformation(&at.gradients[point], d)?;
        let i1 = f.iter().flatten().map(|x| x * x).sum();
        energy += at.weights[point] * material.energy(j, i1);
    }
    Some(energy)
}

/// Smallest J over the Gauss points: what says how near an element is to inversion.
pub fn smallest_determinant(at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> f64 {
    at.gradients
        .iter()
        .map(|g| deformation(g, d).map_or(f64::NEG_INFINITY, |(_, _, j)| j))
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn element() -> (NeoHooke, ReferenceGeometry, [[f64; 3]; 8]) {
        let corners = std::array::from_fn(|i| {
            let c = CORNER[i];
            [c[0] + 0.1 * c[1] * c[2], 0.8 * c[1] - 0.1 * c[0], 1.2 * c[2] + 0.05 * c[0] * c[1]]
        });
        let d = std::array::from_fn(|i| std::array::from_fn(|a| 0.1 * ((3 * i + a) as f64 * 1.7).sin()));
        (NeoHooke::new(210.0, 0.3).unwrap(), ReferenceGeometry::new(&corners).unwrap(), d)
    }

    #[test]
    fn force_is_the_gradient_of_the_energy() {
        let (material, geometry, d) = element();
        let force = internal_force(&material, &geometry, &d).unwrap();
        for i in 0..8 {
            for a in 0..3 {
                let at = |h: f64| {
                    let mut moved = d;
                    moved[i][a] += h;
                    energy(&material, &geometry, &moved).unwrap()
                };
                let fd = (8.0 * (at(1e-3) - at(-1e-3)) - (at(2e-3) - at(-2e-3))) / 12e-3;
                assert!((fd - force[i][a]).abs() < 1e-7, "{fd} {}", force[i][a]);
            }
        }
    }

    #[test]
    fn tangent_is_the_derivative_of_the_force() {
        let (material, geometry, d) = element();
        let mut k = [[0.0; 9]; 64];
        tangent(&material, &geometry, &d, &mut k).unwrap();
        for node in 0..8 {
            for b in 0..3 {
                let at = |h: f64| {
                    let mut moved = d;
                    moved[node][b] += h;
                    internal_force(&material, &geometry, &moved).unwrap()
                };
                let (p, m, pp, mm) = (at(1e-3), at(-1e-3), at(2e-3), at(-2e-3));
                for i in 0..8 {
                    for a in 0..3 {
                        let fd = (8.0 * (p[i][a] - m[i][a]) - (pp[i][a] - mm[i][a])) / 12e-3;
                        assert!((fd - k[8 * i + node][3 * a + b]).abs() < 1e-7);
                    }
                }
            }
        }
    }

    #[test]
    fn an_inverted_element_has_no_force() {
        let (material, geometry, mut d) = element();
        d[6] = [-5.0, -5.0, -5.0];
        assert!(internal_force(&material, &geometry, &d).is_none());
        assert!(smallest_determinant(&geometry, &d) < 0.0);
    }
}
