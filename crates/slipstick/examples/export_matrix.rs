//! Writes the tangent of a converged contact step, to compare linear solvers on real matrices.
//!
//! ```text
//! cargo run --release -p slipstick --example export_matrix -- 33000 contact33.bin
//! ```
//!
//! Two blocks with non-matching meshes, pressed together and slid with friction; Lagrange
//! multipliers, so that the matrix is a saddle point. Stiffness varies over three decades in a
//! smooth pattern of solid and void, as in a topology optimization; the layers next to the
//! interface are solid. The first argument is the minimum number of unknowns; a third one is the
//! ratio of the void's to the solid's stiffness instead of 1e-3.
//!
//! ```text
//! cargo run --release -p slipstick --example export_matrix -- case.toml results design.bin
//! ```
//!
//! writes the tangent at the end of the path of a case with the latest design of a run.
//!
//! The file holds little-endian numbers without gaps: n and the number of entries (u64), row
//! offsets (n + 1 u64), columns (u32), elimination groups (n u32), values (f64), numbers of the
//! unknowns among all unknowns, three per block row (n u32), the number of nodes (u64), their
//! coordinates (f64), the number of slave nodes (u64), these (u32), the body of each node (u32; the
//! largest number for nodes of rigid bodies).
//! `crates/linalg/examples/factor.rs`, `crates/petsc/examples/precondition.rs` and
//! `crates/linalg/benches/compare_pardiso.py` read it.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::time::Instant;

use slipstick::analysis::Analysis;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::design::ElementValues;
use slipstick::linalg::{CsrMatrix, Reduction};
use slipstick::mesh::Mesh;
use slipstick::path::{Held, Iteration, Silent, Span, StepProblem, Wanted};
use slipstick::run::load_density;

/// Height of each block; both are about 2 × 2 wide.
const HEIGHT: f64 = 0.5;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let start = Instant::now();
    let (file, problem, (reduction, matrix)) = match arguments.as_slice() {
        [unknowns, file, ratio @ ..] if unknowns.parse::<usize>().is_ok() && ratio.len() < 2 => {
            let unknowns: usize = unknowns.parse()?;
            let ratio = ratio.first().map_or("1e-3", String::as_str);
            let edge = (6..).find(|&m| count(m) >= unknowns).ok_or("there is no mesh of that size")?;
            let mut problem = build(&parse_case(&case(edge, ratio), "blocks.toml")?.case)?;
            let density = pattern(&problem.mesh);
            let tangent = converged_tangent(&mut problem, &density)?;
            (file, problem, tangent)
        }
        [case, results, file] => {
            let mut problem = build(&parse_case(&std::fs::read_to_string(case)?, case)?.case)?;
            let density = load_density(std::path::Path::new(results), &problem.mesh)?;
            let tangent = converged_tangent(&mut problem, &density)?;
            (file, problem, tangent)
        }
        _ => {
            return Err(
                "arguments: number of unknowns, file to write, stiffness of void; or a case file, results, file \
                        to write"
                    .into(),
            );
        }
    };
    let (mesh, slaves) = (problem.mesh, problem.analysis.model().slave_nodes());
    let seconds = start.elapsed().as_secs_f64();
    write(&matrix, &reduction, &mesh, &slaves, file)?;
    println!("{file}: {} unknowns, {} entries, made in {seconds:.1} s", matrix.n(), matrix.values.len());
    Ok(())
}

/// Layers of elements of a block with `m` elements along an edge.
fn layers(m: usize) -> usize {
    m.div_ceil(4)
}

/// Free unknowns for `m` elements along the edge of the lower block and m − 2 along that of the
/// upper one, whose nodes at the interface have multipliers.
fn count(m: usize) -> usize {
    let (lower, upper) = ((m + 1) * (m + 1), (m - 1) * (m - 1));
    3 * (lower * layers(m) + upper * layers(m - 2) + upper)
}

/// The case file of the blocks; `ratio` is the stiffness of void relative to that of solid.
fn case(m: usize, ratio: &str) -> String {
    let (k, l) = (m - 2, layers(m - 2));
    let material = "{ neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    format!(
        r#"
[[body]]
name = "lower"
box = {{ min = [0.0, 0.0, 0.0], max = [2.0, {HEIGHT}, 2.0], elements = [{m}, {layers}, {m}] }}
material = {material}

[[body]]
name = "upper"
box = {{ min = [0.1, {HEIGHT}, 0.1], max = [1.85, {top}, 1.85], elements = [{k}, {l}, {k}] }}
material = {material}

[[contact]]
slave = "upper_ymin"
master = "lower_ymax"
friction = 0.2
enforcement = {{ lagrange = {{}} }}

[[dirichlet]]
set = "lower_ymin"

[[dirichlet]]
set = "upper_ymax"
motion = [{{ t = 0.5, u = [0.0, -0.005, 0.0] }}, {{ t = 1.0, u = [0.003, -0.006, 0.001] }}]

[load_path]
steps = 2

[design]
bodies = ["lower", "upper"]
initial = 1.0
simp = {{ p = 3.0, min = {ratio} }}
"#,
        layers = layers(m),
        top = 2.0 * HEIGHT,
    )
}

/// Smooth void and solid regions.
fn pattern(mesh: &Mesh) -> ElementValues {
    let layer = HEIGHT / 4.0;
    mesh.centroids()
        .iter()
        .map(|[x, y, z]| {
            if (y - HEIGHT).abs() < layer {
                return 1.0;
            }
            let wave = (9.0 * x + 1.0).sin() * (7.0 * y).cos() + (8.0 * z).sin() * (5.0 * x + 6.0 * y).cos();
            0.5 * (1.0 + (3.0 * wave).tanh())
        })
        .collect()
}

/// Marches and returns the free part of the tangent at the end.
fn converged_tangent(problem: &mut Problem, density: &ElementValues) -> Result<(Reduction, CsrMatrix), Box<dyn Error>> {
    let forward = problem.analysis.forward(density, &mut Silent)?;
    let [.., previous, last] = forward.path.states.as_slice() else {
        return Err("the path is empty".into());
    };
    let Analysis { design, workspace, .. } = &mut problem.analysis;
    let wanted = Wanted::Derivatives;
    let geometry = design.geometry(&previous.state.unknowns, wanted, workspace)?;
    let step = design.begin(&previous.state, &geometry, Span::new(previous.time, last.time.t), workspace)?;
    let at = design.evaluate(&step, &last.state.unknowns, None, Iteration::default(), wanted, workspace)?;
    let tangent = design.tangent(&step, &at, workspace)?;
    let (fixed, groups) = (design.unknowns().fixed(Held::None), &design.unknowns().groups);
    let reduction = Reduction::new(tangent.pattern(), fixed, groups);
    let free = reduction.reduce(tangent);
    Ok((reduction, free))
}

fn write(a: &CsrMatrix, reduction: &Reduction, mesh: &Mesh, slaves: &[u32], file: &str) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(file)?);
    let mut long = |number: usize| out.write_all(&(number as u64).to_le_bytes());
    long(a.n())?;
    long(a.values.len())?;
    a.pattern.row_offsets().iter().try_for_each(|&offset| long(offset))?;
    a.pattern.columns().iter().chain(a.pattern.groups()).try_for_each(|number| out.write_all(&number.to_le_bytes()))?;
    a.values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))?;
    let origins = (0..a.n()).map(|unknown| reduction.origin(unknown));
    origins.into_iter().try_for_each(|(row, b)| out.write_all(&((3 * row + b) as u32).to_le_bytes()))?;
    out.write_all(&(mesh.nodes.len() as u64).to_le_bytes())?;
    mesh.nodes.as_flattened().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    out.write_all(&(slaves.len() as u64).to_le_bytes())?;
    slaves.iter().try_for_each(|node| out.write_all(&node.to_le_bytes()))?;
    let mut bodies = vec![u32::MAX; mesh.nodes.len()];
    mesh.bodies.iter().zip(0..).for_each(|(body, number)| bodies[body.nodes.clone()].fill(number));
    bodies.iter().try_for_each(|body| out.write_all(&body.to_le_bytes()))?;
    out.flush()
}
