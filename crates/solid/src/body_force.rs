//! Forces proportional to mass: gravity, and the centrifugal force of a steady rotation.
//!
//! ```text
//! f_i = Σ_e m_e ∫ N_i a(x) dV      a = g   or   a = ω² (1 − n nᵀ)(x − p)
//! ```
//!
//! with m_e the mass of element e per reference volume, and x the current position: the centrifugal
//! force grows with the distance that a point moves away from the axis. Integrals are over the reference
//! configuration, with the points of the stiffness; linear tetrahedra have four points, for N_i N_j.

use crate::section::Formulation;
use rayon::prelude::*;
use slipstick_mesh::second_order::{
    HEX27_POINTS, TET10_POINTS, WEDGE18_POINTS, hex27_shapes, tet10_shapes, wedge18_shapes,
};
use slipstick_mesh::{Element, HEX_CORNERS, Mesh};
use std::ops::Range;
use std::sync::LazyLock;

/// Force per mass as a function of the position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Acceleration {
    /// The same everywhere. \[L/T²\]
    Uniform([f64; 3]),
    /// Away from an axis of rotation, in proportion to the distance.
    Centrifugal {
        /// A point on the axis. \[L\]
        point: [f64; 3],
        /// ω² (1 − n nᵀ). \[1/T²\]
        matrix: [[f64; 3]; 3],
    },
}

impl Acceleration {
    /// That of a rotation about an axis with the angular velocity ω \[1/T\]; the direction need not be a
    /// unit vector, and is not zero.
    pub fn centrifugal(point: [f64; 3], direction: [f64; 3], angular_velocity: f64) -> Self {
        let square = direction.iter().map(|n| n * n).sum::<f64>();
        let across = |a: usize, b: usize| f64::from(u8::from(a == b)) - direction[a] * direction[b] / square;
        let matrix = std::array::from_fn(|a| std::array::from_fn(|b| angular_velocity.powi(2) * across(a, b)));
        Self::Centrifugal { point, matrix }
    }

    fn at(&self, x: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Uniform(acceleration) => *acceleration,
            Self::Centrifugal { point, matrix } => matrix.map(|row| (0..3).map(|c| row[c] * (x[c] - point[c])).sum()),
        }
    }
}

/// Values of the shape functions at the integration points of a type of elements.
#[derive(Debug)]
struct Rule {
    values: Vec<Vec<f64>>,
    slopes: Vec<Vec<[f64; 3]>>,
    weights: Vec<f64>,
}

impl Rule {
    fn new(points: &[([f64; 3], f64)], shapes: impl Fn([f64; 3]) -> (Vec<f64>, Vec<[f64; 3]>)) -> Self {
        let (values, slopes) = points.iter().map(|&(at, _)| shapes(at)).unzip();
        Self { values, slopes, weights: points.iter().map(|point| point.1).collect() }
    }

    fn of(element: &Element, formulation: Formulation) -> &'static Self {
        match element {
            Element::Tet4(_) => &TET4,
            Element::Wedge6(_) | Element::Hex8(_) => &HEX8,
            Element::Tet10(_) => &TET10,
            Element::Wedge18(_) => &WEDGE18,
            Element::Hex27(_) if formulation == Formulation::Reduced => &REDUCED_HEX27,
            Element::Hex27(_) => &HEX27,
        }
    }
}

static TET4: LazyLock<Rule> = LazyLock::new(|| {
    const A: f64 = 0.138_196_601_125_010_5; // (5 − √5)/20
    let point = |i: usize| (std::array::from_fn(|c| if i == c + 1 { 1.0 - 3.0 * A } else { A }), 1.0 / 24.0);
    Rule::new(&[0, 1, 2, 3].map(point), |[x, y, z]| {
        let slopes = vec![[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        (vec![1.0 - x - y - z, x, y, z], slopes)
    })
});

static HEX8: LazyLock<Rule> = LazyLock::new(|| {
    let points = HEX_CORNERS.map(|corner| (corner.map(|c| c / 3.0_f64.sqrt()), 1.0));
    Rule::new(&points, |at| {
        let along = |corner: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|c| 0.5 * (1.0 + corner[c] * at[c])) };
        let value = |corner: &[f64; 3]| along(corner).iter().product();
        let slope = |corner: &[f64; 3]| {
            let n = along(corner);
            std::array::from_fn(|c| 0.5 * corner[c] * n[(c + 1) % 3] * n[(c + 2) % 3])
        };
        (HEX_CORNERS.iter().map(value).collect(), HEX_CORNERS.iter().map(slope).collect())
    })
});

static TET10: LazyLock<Rule> = LazyLock::new(|| {
    Rule::new(&TET10_POINTS, |at| {
        let (values, slopes) = tet10_shapes(at);
        (values.to_vec(), slopes.to_vec())
    })
});

static WEDGE18: LazyLock<Rule> = LazyLock::new(|| {
    Rule::new(&WEDGE18_POINTS, |at| {
        let (values, slopes) = wedge18_shapes(at);
        (values.to_vec(), slopes.to_vec())
    })
});

static HEX27: LazyLock<Rule> = LazyLock::new(|| {
    Rule::new(&HEX27_POINTS, |at| {
        let (values, slopes) = hex27_shapes(at);
        (values.to_vec(), slopes.to_vec())
    })
});

static REDUCED_HEX27: LazyLock<Rule> = LazyLock::new(|| {
    Rule::new(&HEX_CORNERS.map(|corner| (corner.map(|c| c / 3.0_f64.sqrt()), 1.0)), |at| {
        let (values, slopes) = hex27_shapes(at);
        (values.to_vec(), slopes.to_vec())
    })
});

/// An element with the reference volumes of its integration points.
#[derive(Debug, Clone)]
struct Massive {
    number: usize,
    /// Nodes of coincident corners (wedges) appear twice.
    nodes: Vec<u32>,
    weights: Vec<f64>,
    rule: &'static Rule,
}

/// The elements of some bodies, as what forces on their mass are integrated over. Lists of masses have
/// one entry per element of the mesh, mass per reference volume.
#[derive(Debug, Clone)]
pub struct MassiveElements {
    elements: Vec<Massive>,
}

impl MassiveElements {
    /// The elements with numbers in a range, integrated with the points of their formulation.
    pub fn new(mesh: &Mesh, range: Range<usize>, formulation: impl Fn(usize) -> Formulation) -> Self {
        let of = |number: usize| {
            let element = &mesh.elements[number];
            let nodes: Vec<u32> = element.as_hex().map_or(element.nodes().to_vec(), |nodes| nodes.to_vec());
            let rule = Rule::of(element, formulation(number));
            let first = mesh.nodes[nodes[0] as usize];
            let weight = |(slopes, weight): (&Vec<[f64; 3]>, &f64)| {
                let mut jacobian = [[0.0; 3]; 3];
                for (&node, slope) in nodes.iter().zip(slopes) {
                    for a in 0..3 {
                        let x = mesh.nodes[node as usize][a] - first[a];
                        (0..3).for_each(|b| jacobian[a][b] += x * slope[b]);
                    }
                }
                weight * crate::law::determinant(&jacobian)
            };
            let weights = rule.slopes.iter().zip(&rule.weights).map(weight).collect();
            Massive { number, nodes, weights, rule }
        };
        Self { elements: range.map(of).collect() }
    }

    /// Adds `factor` times the nodal forces at positions `x`, from the elements that `has` selects. Does
    /// not depend on the number of threads, bit for bit. \[F\]
    pub fn add_forces(
        &self,
        acceleration: &Acceleration,
        masses: &[f64],
        factor: f64,
        x: &[f64],
        has: impl Fn(usize) -> bool + Sync,
        out: &mut [f64],
    ) {
        let of = |element: &Massive| {
            let mass = factor * masses[element.number];
            (mass != 0.0 && has(element.number)).then(|| element.forces(acceleration, mass, x))
        };
        let forces: Vec<Option<Vec<[f64; 3]>>> = self.elements.par_iter().map(of).collect();
        for (element, forces) in self.elements.iter().zip(forces) {
            for (&node, force) in element.nodes.iter().zip(forces.iter().flatten()) {
                (0..3).for_each(|c| out[3 * node as usize + c] += force[c]);
            }
        }
    }

    /// Passes the blocks of the derivative of [`add_forces`](Self::add_forces) with respect to the positions
    /// to `add`: row node, column node, and the row-major block.
    pub fn tangent(
        &self,
        acceleration: &Acceleration,
        masses: &[f64],
        factor: f64,
        has: impl Fn(usize) -> bool,
        mut add: impl FnMut(u32, u32, &[f64; 9]),
    ) {
        let Acceleration::Centrifugal { matrix, .. } = acceleration else { return };
        for element in self.elements.iter().filter(|element| has(element.number)) {
            let mass = factor * masses[element.number];
            for (i, &row) in element.nodes.iter().enumerate() {
                for (k, &column) in element.nodes.iter().enumerate() {
                    let points = element.rule.values.iter().zip(&element.weights);
                    let both = mass * points.map(|(n, w)| w * n[i] * n[k]).sum::<f64>();
                    if both != 0.0 {
                        add(row, column, &std::array::from_fn(|at| both * matrix[at / 3][at % 3]));
                    }
                }
            }
        }
    }

    /// Adds `factor` λᵀ ∂f/∂φ_e of every element that `has` selects; `slopes` are the derivatives of the
    /// masses with respect to the densities.
    pub fn pull_back_density(
        &self,
        acceleration: &Acceleration,
        slopes: &[f64],
        (factor, x): (f64, &[f64]),
        lambda: &[f64],
        has: impl Fn(usize) -> bool,
        out: &mut [f64],
    ) {
        for element in self.elements.iter().filter(|element| slopes[element.number] != 0.0 && has(element.number)) {
            let forces = element.forces(acceleration, factor * slopes[element.number], x);
            let work = |(&node, force): (&u32, &[f64; 3])| -> f64 {
                (0..3).map(|c| lambda[3 * node as usize + c] * force[c]).sum()
            };
            out[element.number] += element.nodes.iter().zip(&forces).map(work).sum::<f64>();
        }
    }
}

impl Massive {
    fn forces(&self, acceleration: &Acceleration, mass: f64, x: &[f64]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.nodes.len()];
        for (values, weight) in self.rule.values.iter().zip(&self.weights) {
            let coordinate =
                |c: usize| self.nodes.iter().zip(values).map(|(&n, value)| value * x[3 * n as usize + c]).sum();
            let force = acceleration.at(std::array::from_fn(coordinate)).map(|a| mass * weight * a);
            for (out, value) in out.iter_mut().zip(values) {
                (0..3).for_each(|c| out[c] += value * force[c]);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// A box of 2 × 1 × 3 with each type of elements; the nodes of quadratic ones are moved if `size` is not 0.
    fn meshes(size: f64) -> Vec<(&'static str, Mesh)> {
        let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 3.0], elements: [2, 1, 2], grading: [1.3, 1.0, 0.8] };
        let hex8 = box_mesh("box", &shape).unwrap();
        let tet4 = hex8.divided(|_| true);
        let bent = |of: &[[f64; 3]]| -> [f64; 3] {
            let mean = |c: usize| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64;
            let [x, y, z] = [mean(0), mean(1), mean(2)];
            let bump = size * x * (2.0 - x) * y * (1.0 - y) * z * (3.0 - z);
            [x + bump, y + 0.5 * bump, z - bump]
        };
        let hex27 = hex8.second_order(bent).unwrap();
        let tet10 = tet4.second_order(bent).unwrap();
        let wedge18 = hex8.divided_into_wedges(|_| Some(1)).second_order(bent).unwrap();
        vec![("hex8", hex8), ("tet4", tet4), ("hex27", hex27), ("tet10", tet10), ("wedge18", wedge18)]
    }

    fn positions(mesh: &Mesh) -> Vec<f64> {
        mesh.nodes.iter().flatten().copied().collect()
    }

    /// The sum of the forces is the mass times the acceleration at the centre of mass, and their moment
    /// about the origin that of a force there, exactly.
    #[test]
    fn resultants_of_a_box() {
        let gravity = Acceleration::Uniform([1.0, -2.0, 0.5]);
        let rotation = Acceleration::centrifugal([0.5, 0.0, 0.0], [0.0, 0.0, -3.0], 2.0);
        for (name, mesh) in meshes(0.0) {
            let elements = MassiveElements::new(&mesh, 0..mesh.elements.len(), |_| Formulation::Full);
            let (x, masses) = (positions(&mesh), vec![7.0; mesh.elements.len()]);
            let sum = |acceleration: &Acceleration| {
                let mut forces = vec![0.0; x.len()];
                elements.add_forces(acceleration, &masses, 1.0, &x, |_| true, &mut forces);
                let sum: [f64; 3] = std::array::from_fn(|c| forces.iter().skip(c).step_by(3).sum());
                let turn: f64 =
                    (0..x.len() / 3).map(|n| x[3 * n] * forces[3 * n + 1] - x[3 * n + 1] * forces[3 * n]).sum();
                (sum, turn)
            };
            let near = |found: f64, expected: f64| {
                assert!((found - expected).abs() < 1e-11 * 42.0, "{name}: {found} instead of {expected}");
            };
            // mass 42 with its centre at (1, 0.5, 1.5)
            let (force, turn) = sum(&gravity);
            [42.0, -84.0, 21.0].iter().zip(force).for_each(|(expected, found)| near(found, *expected));
            near(turn, 42.0 * (1.0 * -2.0 - 0.5 * 1.0));
            let (force, turn) = sum(&rotation);
            [42.0 * 4.0 * 0.5, 42.0 * 4.0 * 0.5, 0.0]
                .iter()
                .zip(force)
                .for_each(|(expected, found)| near(found, *expected));
            // ∫ x a_y − y a_x = 4 ∫ 0.5 y
            near(turn, 42.0 * 4.0 * 0.5 * 0.5);
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let rotation = Acceleration::centrifugal([0.5, 0.1, -0.3], [1.0, 2.0, -3.0], 1.7);
        for (name, mesh) in meshes(0.1) {
            let elements = MassiveElements::new(&mesh, 0..mesh.elements.len(), |_| Formulation::Full);
            let x = positions(&mesh);
            let spread = |i: usize| (0.618_033_988_749_894_9 * (i + 1) as f64).fract() - 0.5;
            let masses: Vec<f64> = (0..mesh.elements.len()).map(|e| 2.0 + spread(e)).collect();
            let [lambda, v]: [Vec<f64>; 2] = [3, 7].map(|k| (0..x.len()).map(|i| spread(k * i)).collect());
            let product = |x: &[f64], masses: &[f64]| {
                let mut out = vec![0.0; x.len()];
                elements.add_forces(&rotation, masses, 0.7, x, |_| true, &mut out);
                out.iter().zip(&lambda).map(|(f, l)| f * l).sum::<f64>()
            };
            let mut along = 0.0;
            elements.tangent(
                &rotation,
                &masses,
                0.7,
                |_| true,
                |row, column, block| {
                    for (at, value) in block.iter().enumerate() {
                        along += lambda[3 * row as usize + at / 3] * value * v[3 * column as usize + at % 3];
                    }
                },
            );
            let moved: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x + v).collect();
            // forces are linear in the positions, and in the masses
            let difference = product(&moved, &masses) - product(&x, &masses);
            assert!((along - difference).abs() < 1e-11, "{name}: {along} {difference}");
            let slopes: Vec<f64> = (0..masses.len()).map(|e| 1.0 + spread(5 * e)).collect();
            let mut by_density = vec![0.0; masses.len()];
            elements.pull_back_density(&rotation, &slopes, (0.7, &x), &lambda, |_| true, &mut by_density);
            for e in 0..masses.len() {
                let mut heavier = masses.clone();
                heavier[e] += slopes[e];
                let difference = product(&x, &heavier) - product(&x, &masses);
                assert!((by_density[e] - difference).abs() < 1e-11, "{name}: {} {difference}", by_density[e]);
            }
        }
    }
}
