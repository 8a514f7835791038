//! Changes a problem in code, observes its run, and computes the derivatives of its contact forces
//! with respect to friction, Young's moduli, the amplitude of the motion, and the densities.
//!
//! ```text
//! cargo run --release -p slipstick --example sensitivities
//! ```
//!
//! `tests/suite/examples.rs` compares the derivatives with finite differences.

use std::error::Error;

use slipstick::build::build;
use slipstick::case::{Case, Shape, parse_case};
use slipstick::model::Parameter;
use slipstick::path::{MarchEvent, MarchObserver};

/// A template of the program, as a starting point.
const TEXT: &str = include_str!("../../case/src/file/templates/cube_on_cuboid.toml");

/// The parameters of the model.
#[derive(Debug, Clone, Copy)]
pub struct Numbers {
    /// Coefficient of friction.
    pub friction: f64,
    /// Young's modulus of the cube. \[F/L²\]
    pub modulus: f64,
    /// Factor on the motion.
    pub amplitude: f64,
}

/// The numbers of the example.
pub const NUMBERS: Numbers = Numbers { friction: 0.2, modulus: 2000.0, amplitude: 1.0 };

/// A [`Case`] is plain data: every key of a case file is a field with the same name.
pub fn case(numbers: Numbers) -> Result<Case, Box<dyn Error>> {
    let mut case = parse_case(TEXT, "cube_on_cuboid.toml")?.case;
    let (cuboid, cube) = (0, 1);
    if let Shape::Box { elements, .. } = &mut case.bodies[cuboid].shape {
        *elements = [8, 2, 2];
    }
    let material = &mut case.bodies[cube].material;
    *material = material.with_youngs_modulus(numbers.modulus)?;
    case.contacts[0].friction = numbers.friction;
    for waypoint in &mut case.dirichlet[1].motion {
        waypoint.u = waypoint.u.map(|u| numbers.amplitude * u);
    }
    Ok(case)
}

/// Counts events; an observer of a long run could print them, or stop the run.
#[derive(Debug, Default)]
pub struct Watch {
    /// Accepted states.
    pub accepted: usize,
    /// Their Newton iterations.
    pub iterations: usize,
    /// Attempts that failed and were repeated.
    pub retries: usize,
}

impl MarchObserver for Watch {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        match event {
            MarchEvent::Accepted { state, .. } => {
                self.accepted += 1;
                self.iterations += state.report.iterations.len();
                println!("t = {:.2}: {} iterations", state.time, state.report.iterations.len());
            }
            MarchEvent::Retry { step, failed, .. } => {
                self.retries += 1;
                println!("step {step} is tried again: {}", failed.kind);
            }
        }
    }

    fn cancelled(&self) -> bool {
        self.retries > 100
    }
}

/// Prints θ and its derivatives.
pub fn main() -> Result<(), Box<dyn Error>> {
    let mut problem = build(&case(NUMBERS)?)?;
    let density = problem.initial_density().clone();
    let mut watch = Watch::default();
    let forward = problem.analysis.forward(&density, &mut watch)?;
    let gradients = problem.analysis.gradients(&forward)?;
    println!(
        "{} states, {} iterations; sum of contact force norms {:.6}",
        watch.accepted, watch.iterations, -forward.value
    );
    for (parameter, derivative) in &gradients.parameters {
        let name = match parameter {
            Parameter::Friction { .. } => "friction".into(),
            Parameter::YoungsModulus { body } => format!("modulus of {}", problem.mesh.bodies[*body].name),
            Parameter::Amplitude { motion } => format!("amplitude of motion {motion}"),
            Parameter::Preload { bolt } => format!("force of bolt {bolt}"),
            Parameter::Load { load } => format!("amplitude of load {load}"),
            Parameter::Expansion { body } => format!("thermal expansion of {}", problem.mesh.bodies[*body].name),
            Parameter::Temperature { change } => format!("amplitude of temperature {change}"),
        };
        println!("derivative of θ with respect to the {name}: {derivative:.6e}");
    }
    let largest = gradients.density.iter().fold(0.0, |largest: f64, d| largest.max(d.abs()));
    println!("largest derivative with respect to a density: {largest:.6e}");
    Ok(())
}
