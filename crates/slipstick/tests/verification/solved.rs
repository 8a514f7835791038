//! A solved case, and measurements on it.

use crate::common::abaqus::abaqus;
use nalgebra::Vector3;
use slipstick::analysis::Forward;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case_with;
use slipstick::meshio::FileMesh;
use slipstick::model::NodalContact;
use slipstick_path::Silent;
use std::collections::HashMap;

/// A deck of linear elements of one body with quadratic ones, whose edges are straight.
pub fn straight_quadratic(deck: &str, body: &str) -> String {
    let read = FileMesh::parse(deck.as_bytes()).and_then(|mesh| mesh.body(body, None, 1.0)).expect("a body");
    let middle = |of: &[[f64; 3]]| std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64);
    abaqus(&read.mesh.second_order(middle).expect("linear elements"))
}

/// A case's text and its mesh files.
#[derive(Default)]
pub struct Scene {
    /// TOML.
    pub text: String,
    /// Contents of mesh files by name.
    pub files: HashMap<String, String>,
}

impl From<String> for Scene {
    fn from(text: String) -> Self {
        Self { text, files: HashMap::new() }
    }
}

/// A solved case.
pub struct Solved {
    /// The case.
    pub problem: Problem,
    /// Its path.
    pub forward: Forward,
}

impl Scene {
    /// Builds and solves.
    ///
    /// # Panics
    /// If there are errors in the case, or the path is incomplete.
    pub fn solve(&self) -> Solved {
        let read = |name: &str| {
            let text = self.files.get(name).ok_or_else(|| std::io::Error::other("no such mesh"))?;
            Ok(text.as_bytes().to_vec())
        };
        let resolved = parse_case_with(&self.text, "case.toml", &read).unwrap_or_else(|e| panic!("{e}\n{}", self.text));
        let mut problem = build(&resolved.case).unwrap_or_else(|e| panic!("{e}\n{}", self.text));
        let density = problem.initial_density().clone();
        let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}\n{}", self.text));
        Solved { problem, forward }
    }
}

impl Solved {
    /// Number of load steps.
    pub fn steps(&self) -> usize {
        self.problem.analysis.times.len()
    }

    /// Index in the path of the state that completes a load step (from 1).
    fn at(&self, step: usize) -> usize {
        let states = &self.forward.path.states;
        states.iter().position(|s| s.completes == Some(step)).expect("the path came to its end")
    }

    /// Nodal displacements after a load step.
    pub fn displacements(&self, step: usize) -> &[f64] {
        &self.forward.path.states[self.at(step)].state.unknowns[..3 * self.problem.mesh.nodes.len()]
    }

    /// Displacement of a node after a load step.
    pub fn displacement(&self, node: u32, step: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&self.displacements(step)[3 * node as usize..][..3])
    }

    /// Current position of a node after a load step.
    pub fn position(&self, node: u32, step: usize) -> Vector3<f64> {
        Vector3::from(self.problem.mesh.nodes[node as usize]) + self.displacement(node, step)
    }

    /// Internal minus external forces of all nodes after a load step: reactions at prescribed
    /// displacements.
    fn forces(&self, step: usize) -> Vec<f64> {
        let d = self.displacements(step);
        let mut force = vec![0.0; d.len()];
        let time = self.problem.analysis.times[step - 1];
        let mut loads = force.clone();
        self.problem.analysis.design.external_force(d, time, &mut loads);
        let state = &self.forward.path.states[self.at(step)].state;
        let history = self.problem.analysis.model().solid_history(state);
        self.problem.analysis.design.internal_force(d, (time, history), &mut force).expect("a converged state");
        force.iter_mut().zip(loads).for_each(|(f, load)| *f -= load);
        force
    }

    /// Sum of the reactions on a set after a load step.
    pub fn reaction(&self, set: &str, step: usize) -> Vector3<f64> {
        let force = self.forces(step);
        let nodes = self.problem.mesh.set_nodes(set).expect("a set");
        nodes.iter().map(|&n| Vector3::from_column_slice(&force[3 * n as usize..][..3])).sum()
    }

    /// Moment of the reactions on a set about the origin after a load step.
    pub fn moment(&self, set: &str, step: usize) -> Vector3<f64> {
        let force = self.forces(step);
        let nodes = self.problem.mesh.set_nodes(set).expect("a set");
        let of = |n: u32| self.position(n, step).cross(&Vector3::from_column_slice(&force[3 * n as usize..][..3]));
        nodes.iter().map(|&n| of(n)).sum()
    }

    /// Contact of all slave nodes after a load step.
    pub fn contact(&mut self, step: usize) -> Vec<NodalContact> {
        let at = self.at(step);
        let states = &self.forward.path.states;
        let (previous, state, time) = (states[at - 1].state.clone(), states[at].state.clone(), states[at].time);
        self.problem.analysis.design.contact_results(&previous, &state, time).expect("a converged state").nodes
    }
}

/// `material = …` of a neo-Hookean body.
pub fn neo_hooke(modulus: f64, ratio: f64) -> String {
    format!("material = {{ neo_hooke = {{ youngs_modulus = {modulus:?}, poisson_ratio = {ratio:?} }} }}")
}
