//! The pictures of the documentation: optimizes a case and draws the design, the state at the end, and the history.
//!
//! ```text
//! cargo run --release --example gallery -- cases/half_ball_on_plate/half_ball.toml [iterations] [folder]
//! ```
//!
//! writes `{case's folder}.png` and `{case's folder}_history.png` into the folder, `docs/figures` by default.

use std::error::Error;
use std::path::{Path, PathBuf};

use slipstick::analysis::NodalContact;
use slipstick::build::build;
use slipstick::case::parse_case;
use slipstick::optimize::{IterationRecord, Optimization};
use slipstick::render::{
    Canvas, ColourMap, Cut, Field, FieldValues, Picture, RenderError, RenderOptions, Style, View, design_picture,
    history_picture, state_picture,
};
use slipstick_mesh::Mesh;
use slipstick_path::Silent;

/// Elements below count as void in the pictures.
const THRESHOLD: f64 = 0.5;

/// What the figure shows.
pub struct Result_<'a> {
    pub mesh: &'a Mesh,
    pub density: &'a [f64],
    pub displacement: &'a [f64],
    pub contact: &'a [NodalContact],
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = PathBuf::from(arguments.next().ok_or("usage: gallery CASE [ITERATIONS] [FOLDER]")?);
    let iterations: Option<usize> = arguments.next().map(|n| n.parse()).transpose()?;
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/figures".into()));

    let case = parse_case(&std::fs::read_to_string(&file)?, &file.to_string_lossy())?.case;
    let mut optimization = Optimization::new(&case, build(&case)?)?;
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
    let states = &forward.as_ref().ok_or("the case asks for no analysis")?.path.states;
    let [.., before, last] = states.as_slice() else { return Err("the load path has no steps".into()) };
    let density = optimization.evaluated().ok_or("no design was evaluated")?.density.clone();
    let limit = optimization.volume_limit();
    let problem = &mut optimization.problem;
    let contact = problem.analysis.model.contact_results(&before.state, &last.state)?;
    let displacement = &last.state.unknowns[..3 * problem.mesh.nodes.len()];
    let result = Result_ { mesh: &problem.mesh, density: &density, displacement, contact: &contact };

    std::fs::create_dir_all(&folder)?;
    let name = file.parent().and_then(Path::file_name).map_or("design".into(), |n| n.to_string_lossy());
    figure(&result)?.save_png(&folder.join(format!("{name}.png")))?;
    let canvas = Canvas { width: 900, height: 600, ..Canvas::default() };
    let curves = history_picture(&optimization.state.history, Some(limit), &canvas)?;
    curves.save_png(&folder.join(format!("{name}_history.png")))?;
    Ok(())
}

/// The design and the state at the end of the path, beside each other.
pub fn figure(result: &Result_<'_>) -> Result<Picture, RenderError> {
    let Result_ { mesh, density, displacement, contact } = *result;
    let canvas = Canvas { width: 760, height: 640, ..Canvas::default() };
    let options = RenderOptions { canvas, colour_map: ColourMap::ViridisReversed, ..RenderOptions::default() };
    let design = RenderOptions { caption: Some("optimized plate, density > 0.5".into()), ..options.clone() };
    let design = design_picture(mesh, density, THRESHOLD, &design)?;

    let mut pressure = vec![0.0; mesh.nodes.len()];
    for at in contact {
        pressure[at.node as usize] = at.traction[0];
    }
    let field = Field { title: "pressure", values: FieldValues::Nodes(&pressure) };
    let state = RenderOptions {
        caption: Some("end of the path: contact pressure".into()),
        bodies: Some(vec!["ball".into()]),
        view: View::named("iso_below")?,
        others: Style::Translucent(0.35),
        ..options.clone()
    };
    let pressed = state_picture(mesh, displacement, density, THRESHOLD, &field, &state)?;
    let state = RenderOptions {
        caption: Some("end of the path".into()),
        view: View::named("front")?,
        cut: Some(Cut { normal: [0.0, 0.0, 1.0], offset: 0.05 }),
        ..options
    };
    let cut = state_picture(mesh, displacement, density, THRESHOLD, &Field::density(density), &state)?;
    Picture::beside(&[design, cut, pressed])
}
