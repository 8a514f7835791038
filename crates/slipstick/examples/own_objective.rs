//! A user-defined objective: the settlement of the top of a slab under a block that is pressed onto
//! it and drawn over it.
//!
//! ```text
//! cargo run --release -p slipstick --example own_objective
//! ```
//!
//! A quantity must provide its value at a state and its partial derivatives with respect to what it
//! reads of the state. The adjoint takes care of friction, path and density. `tests/suite/examples.rs`
//! compares the gradient with finite differences.

use std::error::Error;
use std::sync::Arc;

use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::design::{Dimension, ObservedSteps, Quantity, Response, StateDerivative, StateView};
use slipstick::path::Silent;

const CASE: &str = r#"
[[body]]
name = "slab"
box = { min = [0, 0, 0], max = [4, 1, 2], elements = [8, 2, 4] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "block"
box = { min = [0.6, 1.0, 0.3], max = [2.0, 1.7, 1.6], elements = [2, 1, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[contact]]
slave = "block_ymin"
master = "slab_ymax"
friction = 0.3
[[dirichlet]]
set = "slab_ymin"
[[dirichlet]]
set = "block_ymax"
motion = [{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.2, -0.1, 0.05] }]
[load_path]
steps = 4
[design]
bodies = ["slab"]
initial = 0.5
"#;

/// ½ Σ u_y² over some nodes. \[L²\]
struct Settlement {
    nodes: Vec<u32>,
}

impl Settlement {
    /// The y components of the nodes among the displacements.
    fn heights(&self) -> impl Iterator<Item = usize> {
        self.nodes.iter().map(|&node| 3 * node as usize + 1)
    }
}

impl Quantity for Settlement {
    fn name(&self) -> &str {
        "settlement"
    }

    fn dimension(&self) -> Dimension {
        Dimension::AREA
    }

    fn value(&self, state: &StateView) -> f64 {
        self.heights().map(|i| 0.5 * state.displacement[i].powi(2)).sum()
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for i in self.heights() {
            to.displacement[i] += weight * state.displacement[i];
        }
    }
}

/// The problem with the objective, after a check of its derivatives.
pub fn problem() -> Result<Problem, Box<dyn Error>> {
    let mut problem = build(&parse_case(CASE, "own_objective")?.case)?;
    let mut nodes: Vec<u32> =
        problem.mesh.surfaces["slab_ymax"].facets.iter().flat_map(|facet| facet.nodes.to_vec()).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let settlement = Settlement { nodes };
    // `set_objective` does this automatically in debug builds
    problem.analysis.check_quantity(&settlement)?;
    // θ is the sum over all steps
    problem.analysis.set_objective(Response::of(Arc::new(settlement), ObservedSteps::All, 1.0))?;
    Ok(problem)
}

/// Prints θ and the elements whose densities affect it most.
pub fn main() -> Result<(), Box<dyn Error>> {
    let mut problem = problem()?;
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent)?;
    let gradient = problem.analysis.gradient(&forward)?;
    println!("settlement {:.6e}", forward.value);
    let mut order: Vec<usize> = (0..gradient.len()).collect();
    order.sort_by(|&a, &b| gradient[b].abs().total_cmp(&gradient[a].abs()));
    let centroids = problem.mesh.centroids();
    for &element in &order[..5] {
        let [x, y, z] = centroids[element];
        println!("dθ/dφ of element {element} at ({x:.2}, {y:.2}, {z:.2}): {:.4e}", gradient[element]);
    }
    Ok(())
}
