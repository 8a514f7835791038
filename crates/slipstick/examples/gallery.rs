//! The pictures of the documentation: optimizes a case and draws the design, the state at the end,
//! and the history.
//!
//! ```text
//! cargo run --release --example gallery -- cases/half_ball_on_plate/coarse.toml [iterations] [folder]
//! ```
//!
//! With the case's folder as NAME, it writes into `docs/figures`, or the given folder:
//!
//! * `NAME.png`: the surface of the design, and all bodies at the end of the path,
//! * `NAME_pressure.png`: contact pressure on the slave surfaces,
//! * `NAME_history.png`: objective and volume fraction over the iterations.

use std::error::Error;
use std::path::{Path, PathBuf};

use slipstick::build::{build, optimization};
use slipstick::case::parse_case;
use slipstick::export::{ExportOptions, design_surface};
use slipstick::mesh::Mesh;
use slipstick::optimize::IterationRecord;
use slipstick::path::Silent;
use slipstick::render::{
    Canvas, Field, FieldValues, Picture, RenderError, RenderOptions, Style, View, history_picture, state_picture,
    surface_picture,
};

/// Elements with a density below this count as void in the pictures.
const THRESHOLD: f64 = 0.5;

/// A design and the end of its load path.
struct Outcome<'a> {
    mesh: &'a Mesh,
    density: &'a [f64],
    displacement: &'a [f64],
    /// Contact pressure at the slave nodes.
    pressure: &'a [(u32, f64)],
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = PathBuf::from(arguments.next().ok_or("usage: gallery CASE [ITERATIONS] [FOLDER]")?);
    let iterations: Option<usize> = arguments.next().map(|n| n.parse()).transpose()?;
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/figures".into()));

    let case = parse_case(&std::fs::read_to_string(&file)?, &file.to_string_lossy())?.case;
    let mut optimization = optimization(&case, build(&case)?)?;
    if let Some(iterations) = iterations {
        optimization.set_iterations(iterations);
    }
    let mut forward = None;
    while !optimization.finished() {
        let analysed = optimization.advance(&mut Silent)?;
        if let Some(IterationRecord { iteration, objective, .. }) = optimization.state.history.last() {
            println!("{iteration:4} {objective:.6}");
        }
        forward = Some(analysed);
    }
    let states = &forward.as_ref().ok_or("the case has no analysis")?.path.states;
    let [.., before, last] = states.as_slice() else { return Err("the load path has no steps".into()) };
    let density = optimization.evaluated().ok_or("no design was evaluated")?.density.clone();
    let limit = optimization.volume_limit().ok_or("the volume is not bounded")?;
    let problem = &mut optimization.problem;
    let contact = problem.analysis.design.contact_results(&before.state, &last.state, last.time)?;
    let pressure: Vec<(u32, f64)> =
        contact.nodes.iter().map(|at| (at.node, contact.pressure[at.node as usize])).collect();
    let displacement = &last.state.unknowns[..3 * problem.mesh.nodes.len()];
    let outcome = Outcome { mesh: &problem.mesh, density: &density, displacement, pressure: &pressure };

    std::fs::create_dir_all(&folder)?;
    let name = file.canonicalize()?;
    let name = name.parent().and_then(Path::file_name).map_or("design".into(), |n| n.to_string_lossy());
    let save = |picture: Picture, suffix: &str| picture.save_png(&folder.join(format!("{name}{suffix}.png")));
    save(design_and_state(&outcome)?, "")?;
    save(contact_pressure(&outcome)?, "_pressure")?;
    let canvas = Canvas { width: 800, height: 560, ..Canvas::default() };
    save(history_picture(&optimization.state.history, Some(limit), &canvas)?, "_history")?;
    Ok(())
}

/// The surface of the design, next to all bodies at the end of the path.
fn design_and_state(outcome: &Outcome<'_>) -> Result<Picture, Box<dyn Error>> {
    let Outcome { mesh, density, displacement, .. } = *outcome;
    let surface = design_surface(mesh, density, &ExportOptions::default())?.surface;
    let canvas = Canvas { width: 800, height: 640, ..Canvas::default() };
    let options = RenderOptions { canvas, domain: false, ..RenderOptions::default() };
    Ok(Picture::beside(&[
        surface_picture(mesh, &surface, None, &options)?,
        surface_picture(mesh, &surface, Some(displacement), &options)?,
    ])?)
}

/// The deformed slave bodies from below.
fn contact_pressure(outcome: &Outcome<'_>) -> Result<Picture, RenderError> {
    let Outcome { mesh, density, displacement, pressure } = *outcome;
    let mut nodal = vec![0.0; mesh.nodes.len()];
    pressure.iter().for_each(|&(node, value)| nodal[node as usize] = value);
    let slave = |nodes: &std::ops::Range<usize>| pressure.iter().any(|(node, _)| nodes.contains(&(*node as usize)));
    let bodies = mesh.bodies.iter().filter(|body| slave(&body.nodes)).map(|body| body.name.clone()).collect();
    let options = RenderOptions {
        canvas: Canvas { width: 760, height: 560, ..Canvas::default() },
        caption: Some("contact pressure at the end of the path".into()),
        bodies: Some(bodies),
        view: View::named("iso_below")?,
        others: Style::Hidden,
        domain: false,
        ..RenderOptions::default()
    };
    let field = Field { title: "pressure", values: FieldValues::Nodes(&nodal) };
    state_picture(mesh, displacement, density, THRESHOLD, &field, &options)
}
