//! The paper's section 5.1: θ and the sensitivity of every element of the cube on the cuboid, for
//! the penalty method with increasing stiffness, the augmented Lagrangian and the Lagrange
//! multiplier method, at two coefficients of friction.
//!
//! ```text
//! cargo run --release -p slipstick --example cube_on_cuboid
//! ```
//!
//! prints a Markdown table and writes `docs/figures/cube_on_cuboid.csv` and `.svg`. The values
//! agree with an independent implementation to 1e-9 (θ) and 1e-7 (sensitivities):
//! `tests/reference.rs`.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use slipstick::build::build;
use slipstick::case::parse_case;
use slipstick::design::ElementValues;
use slipstick::output::{Cell, Csv, write_atomically};
use slipstick::path::Silent;

const CASE: &str = include_str!("../../../cases/cube_on_cuboid/case.toml");
const FRICTION: [f64; 2] = [0.5, 0.2];
const COLUMNS: [&str; 9] =
    ["friction", "method", "theta", "element_1", "element_2", "element_3", "element_4", "cube", "deviation"];

/// One bar of every group: θ and dθ/dφ of elements ① to ④ and of the cube.
struct Result51 {
    friction: f64,
    method: String,
    value: f64,
    gradient: ElementValues,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut results = Vec::new();
    for friction in FRICTION {
        for (method, enforcement) in methods() {
            results.push(analyse(friction, method, &enforcement)?);
        }
    }
    print!("{}", markdown(&results));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/figures");
    std::fs::create_dir_all(&folder)?;
    write_csv(&folder.join("cube_on_cuboid.csv"), &results)?;
    let figure: PathBuf = folder.join("cube_on_cuboid.svg");
    let drawing = svg::figure(&results);
    write_atomically(&figure, |writer| writer.write_all(drawing.as_bytes()))?;
    Ok(())
}

fn methods() -> Vec<(String, String)> {
    let penalty = |stiffness: u32| {
        let value = format!("{{ penalty = {{ stiffness = {stiffness}, scaling = \"weighted\" }} }}");
        (format!("PM {stiffness}"), value)
    };
    let mut all: Vec<_> = [100, 200, 500, 1000, 2000].map(penalty).into();
    let augmented = "{ augmented = { stiffness = 1000, scaling = \"weighted\", tolerance = 1e-6, \
                     tolerance_scaling = \"absolute\", max_uzawa = 500 } }";
    all.push(("ALM 1000".into(), augmented.into()));
    all.push(("LMM".into(), "{ lagrange = {} }".into()));
    all
}

fn analyse(friction: f64, method: String, enforcement: &str) -> Result<Result51, Box<dyn Error>> {
    let text = CASE
        .replace("friction = 0.5 ", &format!("friction = {friction} "))
        .replace("\nenforcement = { lagrange = {} }", &format!("\nenforcement = {enforcement}"));
    let case = parse_case(&text, "case.toml")?.case;
    let mut problem = build(&case)?;
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent)?;
    let gradient = problem.analysis.gradient(&forward)?;
    Ok(Result51 { friction, method, value: forward.value, gradient })
}

/// Norm of the difference between dθ/dφ and that of the Lagrange multiplier method, relative to the
/// latter.
fn deviation(of: &Result51, results: &[Result51]) -> f64 {
    let reference = results.iter().find(|r| r.friction == of.friction && r.method == "LMM");
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    reference.map_or(f64::NAN, |reference| {
        let difference = norm(&mut of.gradient.iter().zip(&reference.gradient).map(|(a, b)| a - b));
        difference / norm(&mut reference.gradient.iter().copied())
    })
}

fn markdown(results: &[Result51]) -> String {
    let mut text = String::new();
    for friction in FRICTION {
        let _ = writeln!(text, "\nμ = {friction}\n");
        text.push_str("| method | θ | ① | ② | ③ | ④ | cube | off from LMM |\n|---|--:|--:|--:|--:|--:|--:|--:|\n");
        for result in results.iter().filter(|r| r.friction == friction) {
            let _ = write!(text, "| {} | {:.6}", result.method, result.value);
            for value in &result.gradient {
                let _ = write!(text, " | {value:.5}");
            }
            let _ = writeln!(text, " | {:.1e} |", deviation(result, results));
        }
    }
    text
}

fn write_csv(path: &Path, results: &[Result51]) -> Result<(), Box<dyn Error>> {
    let mut csv = Csv::create(path, &COLUMNS)?;
    for result in results {
        let mut row: Vec<Cell> = vec![result.friction.into(), result.method.as_str().into(), result.value.into()];
        row.extend(result.gradient.iter().map(|&value| Cell::from(value)));
        row.push(deviation(result, results).into());
        csv.row(&row)?;
    }
    Ok(())
}

/// The figure: two panels, one per coefficient of friction; groups of bars, one bar per method.
mod svg {
    use super::{FRICTION, Result51};
    use std::fmt::Write as _;

    const WIDTH: f64 = 560.0;
    const HEIGHT: f64 = 400.0;
    /// Left, top, right and bottom of the drawing area within its panel.
    const AREA: [f64; 4] = [62.0, 84.0, 546.0, 330.0];
    const GROUPS: [&str; 6] = ["①", "②", "③", "④", "cube", "θ"];
    /// Blues that darken with the stiffness for the penalty method, then two colours that are
    /// distinct from them and from each other, also for colour-blind readers.
    const COLOURS: [&str; 7] = ["#c6dbef", "#9ecae1", "#6baed6", "#3182bd", "#08519c", "#e6a100", "#b2182b"];

    pub(super) fn figure(results: &[Result51]) -> String {
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {HEIGHT}\" font-family=\"sans-serif\" \
             font-size=\"12\" role=\"img\">\n<title>Objective and element sensitivities of the cube on the cuboid</title>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
            2.0 * WIDTH
        );
        let lowest = results.iter().flat_map(|r| r.gradient.iter().copied().chain([r.value])).fold(0.0, f64::min);
        let highest = results.iter().flat_map(|r| r.gradient.iter().copied().chain([r.value])).fold(0.0, f64::max);
        let tick = 5.0;
        let range = [(lowest / tick).floor() * tick, (highest / tick).ceil() * tick];
        for (panel, friction) in FRICTION.into_iter().enumerate() {
            let bars: Vec<&Result51> = results.iter().filter(|r| r.friction == friction).collect();
            let state = if panel == 0 { "stick" } else { "slip" };
            let _ = writeln!(out, "<g transform=\"translate({} 0)\">", WIDTH * panel as f64);
            out.push_str(&panel_of(&bars, &format!("μ = {friction} ({state} at the last step)"), range, tick));
            out.push_str("</g>\n");
        }
        legend(&mut out, results);
        out.push_str("</svg>\n");
        out
    }

    fn panel_of(bars: &[&Result51], title: &str, range: [f64; 2], tick: f64) -> String {
        let [left, top, right, bottom] = AREA;
        let y = |value: f64| top + (range[1] - value) / (range[1] - range[0]) * (bottom - top);
        let mut out = String::new();
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"14\">{title}</text>",
            0.5 * (left + right),
            top - 12.0
        );
        let ticks = ((range[1] - range[0]) / tick).round() as usize;
        for n in 0..=ticks {
            let value = range[0] + tick * n as f64;
            let colour = if value == 0.0 { "#333" } else { "#ddd" };
            let at = y(value);
            let _ = writeln!(out, "<path d=\"M{left} {at:.2}H{right}\" stroke=\"{colour}\"/>");
            let _ =
                writeln!(out, "<text x=\"{}\" y=\"{:.2}\" text-anchor=\"end\">{value}</text>", left - 6.0, at + 4.0);
        }
        let group = (right - left) / GROUPS.len() as f64;
        let bar = 0.8 * group / bars.len() as f64;
        for (g, name) in GROUPS.iter().enumerate() {
            let start = left + group * g as f64;
            for (b, result) in bars.iter().enumerate() {
                let value = result.gradient.get(g).copied().unwrap_or(result.value);
                let (from, to) = (y(value.max(0.0)), y(value.min(0.0)));
                let x = start + 0.1 * group + bar * b as f64;
                let _ = writeln!(
                    out,
                    "<rect x=\"{x:.2}\" y=\"{from:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{}\"><title>{}, {name}: \
                     {value:.5}</title></rect>",
                    0.92 * bar,
                    (to - from).max(0.5),
                    COLOURS[b],
                    result.method
                );
            }
            let middle = start + 0.5 * group;
            let _ =
                writeln!(out, "<text x=\"{middle:.2}\" y=\"{}\" text-anchor=\"middle\">{name}</text>", bottom + 20.0);
        }
        let rule = left + group * (GROUPS.len() - 1) as f64;
        let _ = writeln!(out, "<path d=\"M{rule:.2} {top}V{bottom}\" stroke=\"#999\" stroke-dasharray=\"3 3\"/>");
        let middle = 0.5 * (top + bottom);
        let _ = writeln!(
            out,
            "<text transform=\"translate(16 {middle}) rotate(-90)\" text-anchor=\"middle\">dθ/dφ of an element, and θ</text>"
        );
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">element</text>",
            0.5 * (left + rule),
            bottom + 42.0
        );
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">objective</text>",
            0.5 * (rule + right),
            bottom + 42.0
        );
        out
    }

    fn legend(out: &mut String, results: &[Result51]) {
        let names: Vec<&str> = results.iter().take(COLOURS.len()).map(|r| r.method.as_str()).collect();
        let step = 110.0;
        let start = WIDTH - 0.5 * step * names.len() as f64;
        for (n, name) in names.iter().enumerate() {
            let x = start + step * n as f64;
            let _ = writeln!(
                out,
                "<rect x=\"{x}\" y=\"22\" width=\"14\" height=\"14\" fill=\"{}\"/><text x=\"{}\" y=\"34\">{name}</text>",
                COLOURS[n],
                x + 20.0
            );
        }
    }
}
