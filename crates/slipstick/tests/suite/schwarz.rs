//! The iterative solver on a whole path with friction, compared with the direct one and with finite
//! differences.

use crate::common::scene::{LAGRANGE, penalty};
use crate::common::{in_pool, random_density};
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::design::ElementValues;
use slipstick::path::Silent;

/// The half-ball that is pressed into the plate and slid, with 10,000 unknowns in two parts, and the
/// first three of its load steps.
fn problem(linear: &str) -> Problem {
    let text = include_str!("../../../../docs/measure/performance/half_ball.toml")
        .replace("[14, 3, 14]", "[20, 4, 20]")
        .replace("[10, 2, 1]", "[14, 3, 1]")
        .replace("\"schwarz\"", linear);
    let mut problem = build(&parse_case(&text, "half_ball.toml").expect("a valid case").case).expect("a problem");
    problem.analysis.times.truncate(3);
    problem
}

fn value(problem: &mut Problem, density: &ElementValues) -> f64 {
    in_pool(|| problem.analysis.forward(density, &mut Silent)).expect("a path").value
}

fn size(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Sources: the direct solver, and a central difference in the direction of the gradient. Steps converge
/// to 1e-8, so values agree to about that; a difference quotient has half of the digits.
#[test]
fn values_and_gradients_are_those_of_the_direct_solver() {
    let mut direct = problem("\"direct\"");
    let mut iterative = problem("\"schwarz\"");
    let density = random_density(&direct, 5);
    let [expected, found] = [&mut direct, &mut iterative].map(|problem| {
        let forward = in_pool(|| problem.analysis.forward(&density, &mut Silent)).expect("a path");
        let gradient = in_pool(|| problem.analysis.gradient(&forward)).expect("a gradient");
        (forward.value, gradient)
    });
    println!("{:?} {:?}", expected.0, found.0);
    assert!((found.0 / expected.0 - 1.0).abs() < 1e-8);
    let difference: Vec<f64> = expected.1.iter().zip(found.1.iter()).map(|(a, b)| a - b).collect();
    println!("{:e} of {:e}", size(&difference), size(&expected.1));
    assert!(size(&difference) < 1e-6 * size(&expected.1));
    let step = 1e-4 / size(&found.1);
    let moved = |sign: f64| -> ElementValues {
        density.iter().zip(found.1.iter()).map(|(phi, g)| phi + sign * step * g).collect()
    };
    let (ahead, behind) = (moved(1.0), moved(-1.0));
    let quotient = (value(&mut iterative, &ahead) - value(&mut iterative, &behind)) / (2.0 * step);
    let slope = found.1.iter().map(|g| g * g).sum::<f64>();
    println!("{quotient:e} {slope:e}");
    assert!((quotient / slope - 1.0).abs() < 1e-4);
}

/// A block on a slab, with 10,000 unknowns in two parts: two load steps, the second with slip.
struct Blocks {
    enforcement: String,
    /// Poisson's ratio of the slab.
    poisson: f64,
    /// Elements of the slab and of the block.
    elements: [[usize; 3]; 2],
    /// Keys of the bodies.
    keys: &'static str,
    block: &'static str,
    pair: &'static str,
    drive: &'static str,
    objective: &'static str,
}

impl Default for Blocks {
    fn default() -> Self {
        Self {
            enforcement: LAGRANGE.into(),
            poisson: 0.3,
            elements: [[18, 8, 18], [8, 4, 8]],
            keys: "",
            block: "material = { neo_hooke = { youngs_modulus = 700.0, poisson_ratio = 0.3 } }",
            pair: "slave = 'block_ymin'\nmaster = 'slab_ymax'",
            drive: "[[dirichlet]]\nset = 'block_ymax'\n\
                    motion = [{ t = 0.5, u = [0.0, -0.02, 0.0] }, { t = 1.0, u = [0.02, -0.03, 0.01] }]",
            objective: "contact_force",
        }
    }
}

impl Blocks {
    fn problem(&self, linear: &str) -> Problem {
        let Self { enforcement, poisson, elements: [slab, block], keys, block: kind, pair, drive, objective } = self;
        let text = format!(
            "[[body]]\nname = 'slab'\nbox = {{ min = [-1.0, -0.8, -1.0], max = [1.0, 0.0, 1.0], elements = {slab:?} }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = {poisson} }} }}\n{keys}\n\
             [[body]]\nname = 'block'\nbox = {{ min = [-0.4, 0.0, -0.5], max = [0.5, 0.5, 0.4], elements = {block:?} }}\n\
             {kind}\n{keys}\n\
             [[contact]]\n{pair}\nfriction = 0.3\nenforcement = {enforcement}\n\
             [[dirichlet]]\nset = 'slab_ymin'\n{drive}\n\
             [load_path]\nsteps = 2\n\
             [design]\nbodies = ['slab']\ninitial = 0.5\n\
             [objective]\n{objective} = {{ steps = 'last' }}\n\
             [solver]\nlinear = '{linear}'\n"
        );
        build(&parse_case(&text, "blocks.toml").expect("a valid case").case).expect("a problem")
    }

    /// Compares value and gradient with those of the direct solver. If that had taken over, it would have
    /// needed the same operations.
    fn compare(&self) {
        let run = |linear: &str| {
            let mut problem = self.problem(linear);
            let density = random_density(&problem, 7);
            let forward = in_pool(|| problem.analysis.forward(&density, &mut Silent)).expect("a path");
            let gradient = in_pool(|| problem.analysis.gradient(&forward)).expect("a gradient");
            let counts = problem.analysis.linear.counts();
            (forward.value, gradient, counts.operations / counts.factorizations as f64)
        };
        let (direct, iterative) = (run("direct"), run("schwarz"));
        let difference: Vec<f64> = direct.1.iter().zip(iterative.1.iter()).map(|(a, b)| a - b).collect();
        let error = size(&difference) / size(&direct.1);
        println!("{:e} {:e}, gradient {error:e}, {:e} {:e}", direct.0, iterative.0, direct.2, iterative.2);
        assert!((iterative.0 / direct.0 - 1.0).abs() < 1e-8);
        assert!(error < 1e-6, "{error:e}");
        assert!(iterative.2 != direct.2, "direct solvers have taken over");
    }
}

/// Source of this and the next tests: the direct solver.
#[test]
fn with_penalties() {
    Blocks { enforcement: penalty(2e4), ..Blocks::default() }.compare();
}

/// The block is rigid and free to turn about an axis.
#[test]
fn with_a_rigid_body() {
    let drive = "[[dirichlet]]\nset = 'block'\ncomponents = ['x', 'y', 'z', 'ry', 'rz']\n\
                 motion = [{ t = 0.5, u = [0.0, -0.02, 0.0] }, { t = 1.0, u = [0.02, -0.03, 0.01] }]";
    let pair = "slave = 'slab_ymax'\nmaster = 'block_ymin'";
    Blocks { block: "rigid = {}", pair, drive, ..Blocks::default() }.compare();
}

#[test]
fn with_quadratic_elements() {
    Blocks { elements: [[9, 4, 9], [4, 2, 4]], keys: "order = 2", ..Blocks::default() }.compare();
}

/// Only contact and friction hold the block, under a pressure and a traction.
#[test]
fn with_a_body_held_by_contact() {
    let drive = "[[load]]\nsurface = 'block_ymax'\npressure = 20.0\n\
                 [[load]]\nsurface = 'block_xmin'\ntraction = [3.0, 0.0, 1.0]";
    Blocks { drive, objective: "compliance", ..Blocks::default() }.compare();
}

/// The direct solver's first solves are exact in practice, those of the iterative one are not: they must
/// be good enough for Newton's method to take about as many iterations.
#[test]
fn nearly_incompressible_bodies_take_few_iterations() {
    let blocks = Blocks {
        poisson: 0.499,
        elements: [[16, 6, 16], [8, 4, 8]],
        block: "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.499 } }",
        keys: "element = 'f_bar'",
        drive: "[[dirichlet]]\nset = 'block_ymax'\n\
                motion = [{ t = 0.5, u = [0.0, -0.002, 0.0] }, { t = 1.0, u = [0.002, -0.003, 0.001] }]",
        ..Blocks::default()
    };
    let iterations = ["direct", "schwarz"].map(|linear| {
        let mut problem = blocks.problem(linear);
        let density = problem.initial_density().clone();
        let forward = in_pool(|| problem.analysis.forward(&density, &mut Silent)).expect("a path");
        forward.path.states.iter().map(|state| state.report.iterations.len()).sum::<usize>()
    });
    println!("{iterations:?} Newton iterations");
    assert!(iterations[1] <= iterations[0] + 3, "{iterations:?}");
}
