//! A block of nearly incompressible material, bent to a sector of a ring, against Rivlin's exact
//! solution.

use slipstick_linalg::{
    BlockMatrix, BlockPattern, LinearSolver, Reduction, RobustSolver, SolverChoice, solve_verified,
};
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_solid::{
    ElementScaling, Formulation, Material, MooneyRivlin, NeoHooke, Ogden, Section, SolidModel, Yeoh,
};
use std::sync::Arc;

/// Thickness, length and width of the block, along x, y and z.
const SIZE: [f64; 3] = [1.0, 2.0, 0.25];
const NU: f64 = 0.4999;

/// The exact flexure of an incompressible neo-Hookean block with free faces: (X, Y) goes to radius
/// r and angle ωY with (ωr)² = s, s = s₁ + 2ωX, s₁ s₂ = 1 at the two faces. Stretches are √s around
/// and 1/√s across.
///
/// Reference: Rivlin, Proc. R. Soc. Lond. A 195 (1949) 463–473.
struct Flexure {
    omega: f64,
    inner: f64,
}

impl Flexure {
    /// Turn of the ends against each other by `bend`. \[rad\]
    fn new(bend: f64) -> Self {
        let omega = bend / SIZE[1];
        let h = omega * SIZE[0];
        Self { omega, inner: (1.0 + h * h).sqrt() - h }
    }

    /// Displacement of the material point `x`; the block's mid-plane y = 0 stays.
    fn displacement(&self, x: [f64; 3]) -> [f64; 3] {
        let radius = (self.inner + 2.0 * self.omega * x[0]).sqrt() / self.omega;
        let angle = self.omega * x[1];
        [radius * angle.cos() - 1.0 / self.omega - x[0], radius * angle.sin() - x[1], 0.0]
    }

    /// ∫ μ/2 (s + 1/s − 2) dX over the thickness, times length and width, for μ = 1.
    fn energy(&self) -> f64 {
        let (s1, s2) = (self.inner, 1.0 / self.inner);
        let integral = 0.5 * (s2 * s2 - s1 * s1) + (s2 / s1).ln() - 2.0 * (s2 - s1);
        0.25 / self.omega * integral * SIZE[1] * SIZE[2]
    }
}

/// Moves the prescribed unknowns by `increment`, through the tangent in the first iteration, and
/// the others to equilibrium.
fn newton(model: &SolidModel, mesh: &Mesh, fixed: &[bool], mut increment: Vec<f64>, d: &mut [f64]) {
    let scalings = vec![ElementScaling::SOLID; mesh.elements.len()];
    let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
    let groups: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    let (scatter, reduction) = (model.scatter(&pattern), Reduction::new(&pattern, fixed, &groups));
    let (mut matrix, mut force) = (BlockMatrix::new(pattern), vec![0.0; d.len()]);
    let mut solver = RobustSolver::new(SolverChoice::Auto);
    for iteration in 0..50 {
        model.internal_force(d, &scalings, &mut force).expect("a state");
        if iteration > 0 && reduction.restrict(&force).iter().all(|r| r.abs() < 1e-9) {
            return;
        }
        matrix.set_zero();
        model.add_tangent(d, &scalings, &scatter, &mut matrix).expect("a state");
        let mut residual = vec![0.0; d.len()];
        matrix.mul(&increment, &mut residual);
        residual.iter_mut().zip(&force).for_each(|(r, f)| *r += f);
        let (system, rhs) = (reduction.reduce(&matrix), reduction.restrict(&residual));
        let factors = solver.analyse_and_factorize(&system).expect("factors");
        let mut step = vec![0.0; rhs.len()];
        solve_verified(&system, factors.as_ref(), false, &rhs, &mut step, 1e-10).expect("a solution");
        let mut change = vec![0.0; d.len()];
        reduction.prolong(&step, &mut change);
        for i in 0..d.len() {
            d[i] += increment[i] - change[i];
        }
        increment.fill(0.0);
    }
    panic!("no equilibrium");
}

/// Strain energy of the bent block with `n` elements through the thickness, or twice as many wedges
/// along a direction: its ends turn as in the exact solution.
fn energy(material: Material, formulation: Formulation, bend: f64, n: usize, wedges: Option<usize>) -> f64 {
    let half = 0.5 * SIZE[1];
    let shape =
        BoxShape { min: [0.0, -half, 0.0], max: [SIZE[0], half, SIZE[2]], elements: [n, 2 * n, 1], grading: [1.0; 3] };
    let mesh = box_mesh("block", &shape).unwrap().divided_into_wedges(|_| wedges);
    let model = SolidModel::new(&mesh, vec![Section::new(material, formulation)]).unwrap();
    let at_end = |x: &[f64; 3]| (x[1].abs() - half).abs() < 1e-12;
    // plane strain
    let fixed: Vec<bool> = mesh.nodes.iter().flat_map(|x| [at_end(x), at_end(x), true]).collect();
    let mut d = vec![0.0; fixed.len()];
    let steps = 40;
    for step in 1..=steps {
        let flexure = Flexure::new(bend * step as f64 / steps as f64);
        let target = mesh.nodes.iter().flat_map(|x| flexure.displacement(*x));
        let increment = target.zip(&d).zip(&fixed).map(|((target, d), fixed)| if *fixed { target - d } else { 0.0 });
        newton(&model, &mesh, &fixed, increment.collect(), &mut d);
    }
    model.energy(&d, &vec![ElementScaling::SOLID; mesh.elements.len()]).unwrap()
}

fn error(formulation: Formulation, bend: f64, n: usize) -> f64 {
    error_with(formulation, bend, n, None)
}

fn error_with(formulation: Formulation, bend: f64, n: usize, wedges: Option<usize>) -> f64 {
    // μ = 1
    let material = NeoHooke::new(2.0 * (1.0 + NU), NU).unwrap().into();
    let error = energy(material, formulation, bend, n, wedges) / Flexure::new(bend).energy() - 1.0;
    println!("{formulation:?}, {n} elements, wedges {wedges:?}, bend {bend}: error {error:.2e}");
    error
}

/// At a finite bend F̄ finds the energy, the better the finer.
#[test]
fn f_bar_finds_the_exact_flexure() {
    let [coarse, fine] = [4, 8].map(|n| error(Formulation::FBar, 1.0, n));
    assert!(coarse.abs() < 0.1 && fine.abs() < 0.3 * coarse.abs());
}

/// The same for laws of rubber with μ = 1 and K = 5000: in plane strain I₁ = I₂, so that Mooney-Rivlin
/// is neo-Hookean, as are Yeoh with one term and Ogden with the exponent 2 or −2.
#[test]
fn f_bar_finds_the_exact_flexure_of_rubber() {
    let laws: [Material; 4] = [
        MooneyRivlin::new(0.3, 0.2, 5e3).unwrap().into(),
        Yeoh::new([0.5, 0.0, 0.0], 5e3).unwrap().into(),
        Ogden::new(&[1.0], &[2.0], 5e3).unwrap().into(),
        Ogden::new(&[0.6, -0.4], &[2.0, -2.0], 5e3).unwrap().into(),
    ];
    for law in laws {
        let exact = Flexure::new(1.0).energy();
        let [coarse, fine] = [4, 8].map(|n| energy(law, Formulation::FBar, 1.0, n, None) / exact - 1.0);
        println!("{law}: errors {coarse:.2e}, {fine:.2e}");
        assert!(coarse.abs() < 0.1 && fine.abs() < 0.3 * coarse.abs(), "{law}: {coarse:e} {fine:e}");
        // a small bend, which locks fully integrated elements
        let [full, bar] = [Formulation::Full, Formulation::FBar]
            .map(|formulation| energy(law, formulation, 1e-3, 4, None) / Flexure::new(1e-3).energy() - 1.0);
        println!("{law}, small bend: errors {full:.2e}, {bar:.2e}");
        assert!(full > 2.0 && bar.abs() < 0.1, "{law}: {full:e} {bar:e}");
    }
}

/// Fully integrated elements store several times the energy. The bend is small: they would need a
/// hydrostatic tension beyond μ, which is all that this law can carry.
#[test]
fn f_bar_does_not_lock() {
    let (full, bar) = (error(Formulation::Full, 1e-3, 4), error(Formulation::FBar, 1e-3, 4));
    assert!(full > 2.0 && bar.abs() < 0.1);
}

/// A wedge sees its volume change as a whole with F̄. This unlocks the bend where the axis of the
/// wedges lies in the plane of bending; with the triangles in that plane they lock as plane
/// triangles do.
#[test]
fn f_bar_unlocks_wedges_but_in_the_plane_of_their_triangles() {
    for along in [0, 1] {
        assert!(error_with(Formulation::FBar, 1e-3, 4, Some(along)).abs() < 0.1);
        assert!(error_with(Formulation::Full, 1e-3, 4, Some(along)) > 2.0);
    }
    assert!(error_with(Formulation::FBar, 1e-3, 4, Some(2)) > 2.0);
}
