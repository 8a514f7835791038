//! Orthotropic elasticity.

use super::constants::Hooke;
use super::{Constant, Form, Law, Local, MaterialError, Range, Real, Stress, Value};
use crate::registers::{Matrix, array, load_matrix, product, transpose};
use pulp::Simd;
use std::array::from_fn;

/// Orthotropic elasticity between the Green-Lagrange strain E and the second Piola-Kirchhoff
/// stress S, for printed and rolled parts.
///
/// ```text
/// Ψ = ½ E:C:E,   E = (FᵀF − 1)/2,   S = C:E,   P = F S
/// ```
///
/// In the material axes 1, 2, 3 the stiffness C follows from the engineering constants: a stress
/// along i alone causes the strains 1/E_i along i and −ν_ij/E_i along j, and ν_ij/E_i = ν_ji/E_j.
/// G_ij relates shear stress and shear angle in the plane of i and j.
///
/// The law uses E instead of the small strain ε, so it is objective and parts may rotate: printed
/// parts are often thin and undergo large bending at small strains. It softens in compression like
/// [`super::StVenantKirchhoff`], which is its isotropic case.
///
/// Reference: Jones, Mechanics of Composite Materials (1999), sections 2.3 and 2.4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orthotropic {
    /// The constants as given: E₁, E₂, E₃, ν₁₂, ν₁₃, ν₂₃, G₁₂, G₁₃, G₂₃.
    engineering: [f64; 9],
    /// Axes 1 and 2 as given.
    directions: [[f64; 3]; 2],
    /// ∂S/∂(2E) divided by the mean shear modulus, in the global axes, in the order of [`PAIRS`]; a
    /// column for an off-diagonal entry represents both of its positions.
    stiffness: [[f64; 6]; 6],
    /// The small-strain limit, averaged over all directions.
    limit: Hooke,
}

/// The third of Sylvester's conditions.
const DETERMINANT: &str = "the determinant of the compliance times e1 e2 e3";

/// Rows and columns of the entries of a symmetric matrix.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// The entry of [`PAIRS`] in row a and column b.
const ENTRY: [[usize; 3]; 3] = [[0, 5, 4], [5, 1, 3], [4, 3, 2]];

impl Orthotropic {
    /// From E₁, E₂, E₃ \[F/L²\], ν₁₂, ν₁₃, ν₂₃, G₁₂, G₁₃, G₂₃ \[F/L²\], and the directions of axes
    /// 1 and 2; the second is made perpendicular to the first.
    ///
    /// # Errors
    /// A modulus ≤ 0, parallel axes, strains with energy ≤ 0, or a value that is not finite.
    pub fn new(
        youngs_moduli: [f64; 3],
        poisson_ratios: [f64; 3],
        shear_moduli: [f64; 3],
        axes: [[f64; 3]; 2],
    ) -> Result<Self, MaterialError> {
        let numbers = youngs_moduli.into_iter().chain(poisson_ratios).chain(shear_moduli).map(Value::from);
        let axes = axes.iter().map(|axis| Value::from(&axis[..]));
        Self::from_values(&numbers.chain(axes).collect::<Vec<_>>())
    }
}

/// Unit vectors along the material axes, as columns; `None` if the directions are parallel.
fn material_axes([first, second]: [[f64; 3]; 2]) -> Option<[[f64; 3]; 3]> {
    let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |a: [f64; 3]| {
        let length = dot(&a, &a).sqrt();
        a.map(|x| x / length)
    };
    let (first, second) = (unit(first), unit(second));
    let along = dot(&first, &second);
    if along.abs() > 0.999 {
        return None;
    }
    let second = unit(from_fn(|c| second[c] - along * first[c]));
    let third: [f64; 3] =
        from_fn(|c| first[(c + 1) % 3] * second[(c + 2) % 3] - first[(c + 2) % 3] * second[(c + 1) % 3]);
    Some(array(|c, axis| [first, second, third][axis][c]))
}

/// Inverse and determinant of a symmetric 3×3 matrix.
fn inverse(m: &[[f64; 3]; 3]) -> ([[f64; 3]; 3], f64) {
    let (inverse, determinant) = crate::registers::invert(pulp::Scalar, m);
    (array(|a, b| 0.5 * (inverse[a][b] + inverse[b][a])), determinant)
}

const fn modulus(key: &'static str, about: &'static str, help: &'static str) -> Constant {
    Constant { key, about, help, form: Form::Modulus(Range::Positive) }
}

const fn ratio(key: &'static str, about: &'static str, help: &'static str) -> Constant {
    Constant { key, about, help, form: Form::Number(Range::Any) }
}

impl Law for Orthotropic {
    const CONSTANTS: &'static [Constant] = &[
        modulus("e1", "Young's modulus E₁ > 0 along axis 1. [F/L²]", "Young's modulus along axis 1"),
        modulus("e2", "Young's modulus E₂ > 0 along axis 2. [F/L²]", "Young's modulus along axis 2"),
        modulus("e3", "Young's modulus E₃ > 0 along axis 3. [F/L²]", "Young's modulus along axis 3"),
        ratio(
            "nu12",
            "Poisson's ratio ν₁₂: stress along 1, contraction along 2.",
            "stress along 1, contraction along 2",
        ),
        ratio(
            "nu13",
            "Poisson's ratio ν₁₃: stress along 1, contraction along 3.",
            "stress along 1, contraction along 3",
        ),
        ratio(
            "nu23",
            "Poisson's ratio ν₂₃: stress along 2, contraction along 3.",
            "stress along 2, contraction along 3",
        ),
        modulus("g12", "Shear modulus G₁₂ > 0. [F/L²]", "the shear modulus in the plane of axes 1 and 2"),
        modulus("g13", "Shear modulus G₁₃ > 0. [F/L²]", "the shear modulus in the plane of axes 1 and 3"),
        modulus("g23", "Shear modulus G₂₃ > 0. [F/L²]", "the shear modulus in the plane of axes 2 and 3"),
        Constant {
            key: "axis1",
            about: "Direction of axis 1 in the undeformed bodies; any length.",
            help: "a direction [x, y, z]",
            form: Form::Direction([1.0, 0.0, 0.0]),
        },
        Constant {
            key: "axis2",
            about: "Direction of axis 2; its part perpendicular to axis 1 counts. Axis 3 is perpendicular to both.",
            help: "a direction [x, y, z]",
            form: Form::Direction([0.0, 1.0, 0.0]),
        },
    ];

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        let engineering: [f64; 9] = from_fn(|i| values[i].number());
        let [e1, e2, e3, nu12, nu13, nu23, g12, g13, g23] = engineering;
        let directions = [values[9].padded(), values[10].padded()];
        let Some(axes) = material_axes(directions) else {
            let help = "give two directions at an angle, by default axis1 = [1, 0, 0] and axis2 = [0, 1, 0]";
            return Err(MaterialError::new("axis2", "axis1 and axis2 are parallel".into(), help));
        };
        let compliance = [
            [1.0 / e1, -nu12 / e1, -nu13 / e1],
            [-nu12 / e1, 1.0 / e2, -nu23 / e2],
            [-nu13 / e1, -nu23 / e2, 1.0 / e3],
        ];
        let (normal, determinant) = inverse(&compliance);
        // Sylvester's criterion; each number is 1 without Poisson's effect
        let plane = |a: usize, b: usize| 1.0 - compliance[a][b].powi(2) / (compliance[a][a] * compliance[b][b]);
        let unstable = |key: &'static str, of: &str, number: f64| {
            let problem = format!("some strain would have no positive energy: {of} is {number}, not greater than zero");
            let help = match of {
                DETERMINANT => "give smaller Poisson's ratios: each of them is possible, but not all three together",
                _ => "give a smaller Poisson's ratio: nu_ij^2 must be less than E_i/E_j",
            };
            Err(MaterialError::new(key, problem, help))
        };
        for (key, of, number) in [
            ("nu12", "1 - nu12^2 e2/e1", plane(0, 1)),
            ("nu13", "1 - nu13^2 e3/e1", plane(0, 2)),
            ("nu23", "1 - nu23^2 e3/e2", plane(1, 2)),
            ("nu12", DETERMINANT, determinant * e1 * e2 * e3),
        ] {
            if !(number > 0.0) {
                return unstable(key, of, number);
            }
        }
        // Voigt's averages
        let sum = |of: &dyn Fn(usize, usize) -> bool| {
            (0..9).filter(|n| of(n / 3, n % 3)).map(|n| normal[n / 3][n % 3]).sum::<f64>()
        };
        let bulk = sum(&|_, _| true) / 9.0;
        let mu = (sum(&|a, b| a == b) + 2.0 * (g12 + g13 + g23) - 3.0 * bulk) / 10.0;
        let mut stiffness = [[0.0; 6]; 6];
        for (column, &(a, b)) in PAIRS.iter().enumerate() {
            // the strain with entries ½ at (a, b) and (b, a), in the material axes
            let strain: [[f64; 3]; 3] = array(|i, k| {
                let both = if a == b { 0.5 } else { 1.0 };
                0.5 * both * (axes[a][i] * axes[b][k] + axes[b][i] * axes[a][k])
            });
            let stress: [[f64; 3]; 3] = array(|i, k| match (i, k) {
                (0, 1) | (1, 0) => 2.0 * g12 * strain[i][k],
                (0, 2) | (2, 0) => 2.0 * g13 * strain[i][k],
                (1, 2) | (2, 1) => 2.0 * g23 * strain[i][k],
                _ => (0..3).map(|c| normal[i][c] * strain[c][c]).sum(),
            });
            for (row, &(c, d)) in PAIRS.iter().enumerate() {
                let entry = (0..9).map(|n| axes[c][n / 3] * stress[n / 3][n % 3] * axes[d][n % 3]).sum::<f64>();
                stiffness[row][column] = entry / mu;
            }
        }
        Ok(Self { engineering, directions, stiffness, limit: Hooke::from_moduli(bulk, mu) })
    }

    fn values(&self) -> Vec<Value> {
        let numbers = self.engineering.iter().map(|&number| Value::Number(number));
        numbers.chain(self.directions.iter().map(|axis| Value::from(&axis[..]))).collect()
    }

    /// The isotropic stiffness with additions that do not change its averages, in inclined axes.
    fn like(limit: Hooke) -> Result<Self, MaterialError> {
        let Hooke { lambda, mu, .. } = limit;
        let (c, _) = inverse(&array(|a, b| lambda + if a == b { (2.0 + [0.4, -0.1, -0.3][a]) * mu } else { 0.0 }));
        Self::new(
            [1.0 / c[0][0], 1.0 / c[1][1], 1.0 / c[2][2]],
            [-c[0][1] / c[0][0], -c[0][2] / c[0][0], -c[1][2] / c[1][1]],
            [1.2, 0.7, 1.1].map(|share| share * mu),
            [[1.0, 2.0, 2.0], [2.0, 1.0, -2.0]],
        )
    }

    fn hooke(&self) -> &Hooke {
        &self.limit
    }

    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T {
        let product = |a: usize, b: usize| (0..3).fold(T::from(0.0), |sum, c| sum + f[c][a] * f[c][b]);
        self.quadratic(&array(|a, b| T::from(0.5) * (product(a, b) - T::from(f64::from(a == b)))))
    }

    fn small_strain_energy<T: Real>(&self, h: &[[T; 3]; 3]) -> T {
        self.quadratic(&array(|a, b| T::from(0.5) * (h[a][b] + h[b][a])))
    }
}

impl Stress for Orthotropic {
    /// S.
    type Prepared<S: Simd> = Matrix<S>;

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.limit.mu
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, simd: S, at: &Local<'_>) -> Matrix<S> {
        let f = load_matrix::<S>(at.gradient, at.v);
        let mut doubled = product(simd, &transpose::<S>(&f), &f);
        for a in 0..3 {
            doubled[a][a] = simd.sub_f64s(doubled[a][a], simd.splat_f64s(1.0));
        }
        self.second_stress(simd, &doubled)
    }

    /// F S.
    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, second: &Matrix<S>) -> Matrix<S> {
        product(simd, &load_matrix::<S>(at.gradient, at.v), second)
    }

    /// dF S + F dS, where 2 dE = FᵀdF + (FᵀdF)ᵀ.
    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, second: &Matrix<S>, change: &Matrix<S>) -> Matrix<S> {
        let f = load_matrix::<S>(at.gradient, at.v);
        let half = product(simd, &transpose::<S>(&f), change);
        let of_second = self.second_stress(simd, &array(|a, b| simd.add_f64s(half[a][b], half[b][a])));
        let (geometric, material) = (product(simd, change, second), product(simd, &f, &of_second));
        array(|a, b| simd.add_f64s(geometric[a][b], material[a][b]))
    }
}

impl Orthotropic {
    /// S divided by the mean shear modulus, for 2E.
    #[inline(always)]
    fn second_stress<S: Simd>(&self, simd: S, doubled: &Matrix<S>) -> Matrix<S> {
        let row = |row: &[f64; 6]| {
            let mut sum = simd.mul_f64s(simd.splat_f64s(row[0]), doubled[0][0]);
            for column in 1..6 {
                let (a, b) = PAIRS[column];
                sum = simd.mul_add_e_f64s(simd.splat_f64s(row[column]), doubled[a][b], sum);
            }
            sum
        };
        let rows = [
            row(&self.stiffness[0]),
            row(&self.stiffness[1]),
            row(&self.stiffness[2]),
            row(&self.stiffness[3]),
            row(&self.stiffness[4]),
            row(&self.stiffness[5]),
        ];
        array(|a, b| rows[ENTRY[a][b]])
    }

    /// ½ E:C:E, computed from the engineering constants and therefore independent of the stiffness
    /// that the stress uses.
    fn quadratic<T: Real>(&self, strain: &[[T; 3]; 3]) -> T {
        let [e1, e2, e3, nu12, nu13, nu23, g12, g13, g23] = self.engineering;
        let axes = material_axes(self.directions).unwrap_or_default();
        let own: [[T; 3]; 3] = array(|i, k| {
            let term = |n: usize| T::from(axes[n / 3][i] * axes[n % 3][k]) * strain[n / 3][n % 3];
            (1..9).fold(term(0), |sum, n| sum + term(n))
        });
        let (normal, _) = inverse(&[
            [1.0 / e1, -nu12 / e1, -nu13 / e1],
            [-nu12 / e1, 1.0 / e2, -nu23 / e2],
            [-nu13 / e1, -nu23 / e2, 1.0 / e3],
        ]);
        let shear = [(g12, own[0][1]), (g13, own[0][2]), (g23, own[1][2])];
        let shear = shear.iter().fold(T::from(0.0), |sum, &(g, angle)| sum + T::from(2.0 * g) * angle * angle);
        let term = |n: usize| T::from(0.5 * normal[n / 3][n % 3]) * own[n / 3][n / 3] * own[n % 3][n % 3];
        (0..9).fold(shear, |sum, n| sum + term(n))
    }
}
