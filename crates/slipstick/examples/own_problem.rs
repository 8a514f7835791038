//! A user-defined problem on slipstick's load path: a spring pulls a block that sticks and slips.
//!
//! ```text
//! cargo run --release -p slipstick --example own_problem
//! ```
//!
//! [`Slider`] states its equations in about forty lines (`crates/path/src/slider.rs`). The tutorial
//! `docs/developers/own_problem.md` explains it; `tests/suite/examples.rs` compares the page with the output
//! of this program.

use std::error::Error;

use slipstick::linalg::SolverChoice;
use slipstick::path::equations::{Differentiated, UnknownAt};
use slipstick::path::slider::Slider;
use slipstick::path::{
    LinearSystem, LoadPath, MarchOptions, Path, PathGradient, Silent, Solver, SweepOptions, march, sweep,
};

/// The path of a slider with this spring, and the derivative of the last position with respect to
/// the spring's stiffness.
fn pulled(stiffness: f64) -> Result<(Path, PathGradient), Box<dyn Error>> {
    let slider = Differentiated(Slider::new(stiffness));
    let mut linear = LinearSystem::new(SolverChoice::Auto);
    let mut solver = Solver { problem: &slider, linear: &mut linear, workspace: &mut slider.workspace() };
    let load_path = LoadPath::new(slider.rest(), &[0.02, 0.04, 0.06, 0.2, 1.0]);
    let path = march(&mut solver, &load_path, &MarchOptions::default(), &mut Silent)?;
    let mut last = UnknownAt { state: path.states.len() - 1, unknown: 0 };
    let mut gradients = sweep(&mut solver, &path, &mut last, &SweepOptions::default())?;
    Ok((path, gradients.swap_remove(0)))
}

/// The output of the program.
pub fn printed() -> Result<String, Box<dyn Error>> {
    let (path, gradient) = pulled(2.0)?;
    let mut text = "time   position   friction   Newton   status\n".to_owned();
    for state in &path.states[1..] {
        let last = state.report.iterations.last().ok_or("no iteration")?;
        let status = ["open", "stick", "slip"][last.status.iter().position(|&count| count > 0).unwrap_or(0)];
        let (position, friction) = (state.state.unknowns[0], state.state.history[0]);
        let newton = state.report.iterations.len();
        text += &format!("{:4.2}   {position:8.5}   {friction:8.5}   {newton:6}   {status}\n", state.time);
    }
    let h = 1e-5;
    let position =
        |stiffness: f64| Ok::<f64, Box<dyn Error>>(pulled(stiffness)?.0.states[path.steps].state.unknowns[0]);
    let difference = (position(2.0 + h)? - position(2.0 - h)?) / (2.0 * h);
    text += &format!("d position / d stiffness: adjoint {:.7}, difference {difference:.7}\n", gradient.design[0]);
    Ok(text)
}

/// Prints the path and the derivative.
pub fn main() -> Result<(), Box<dyn Error>> {
    print!("{}", printed()?);
    Ok(())
}
