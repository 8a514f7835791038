//! Objective and volume fraction over the iterations, for one optimization or for several in one
//! chart.

use super::RenderError;
use super::chart::{Dash, Line, Plot, chart};
use super::colour::{Colour, ColourMap};
use super::picture::{Canvas, Picture};
use slipstick_model::optimize::IterationRecord;

/// The history of an optimization, with a name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunHistory {
    /// Its name in the legend.
    pub name: String,
    /// Iteration, objective and volume fraction of each evaluated design.
    pub rows: Vec<[f64; 3]>,
}

/// What the axis of objectives shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObjectiveAxis {
    /// Its name, with the unit.
    pub name: String,
    /// Whether minus the objective is drawn, as for an objective that is maximized.
    pub negated: bool,
}

impl Default for ObjectiveAxis {
    /// The objective as it is minimized.
    fn default() -> Self {
        Self { name: "Objective".into(), negated: false }
    }
}

/// Objective and volume fraction over the iterations; `limit` is the bound on the volume fraction.
///
/// # Errors
/// [`RenderError::NotFinite`], [`RenderError::Size`], [`RenderError::Supersampling`].
pub fn history_picture(
    history: &[IterationRecord],
    limit: Option<f64>,
    canvas: &Canvas,
) -> Result<Picture, RenderError> {
    let line = |value: fn(&IterationRecord) -> f64, tone| Line {
        name: String::new(),
        points: history.iter().map(|r| [r.iteration as f64, value(r)]).collect(),
        colour: ColourMap::Viridis.at(tone),
        dash: Dash::Solid,
        marked: true,
    };
    let axis = ObjectiveAxis::default();
    let plots = plots(&axis, vec![line(|r| r.objective, 0.2)], vec![line(|r| r.volume_fraction, 0.55)], limit);
    chart(None, &plots, ITERATION, canvas)
}

/// Objectives and volume fractions of several optimizations over their iterations, with a legend if there
/// is more than one;
/// `limit` is their common bound on the volume fraction.
///
/// Lines differ in colour and dash, so that overlapping lines are both visible, and lines can be
/// distinguished in black-and-white print.
///
/// # Errors
/// [`RenderError::TooManyLines`], [`RenderError::NotFinite`], [`RenderError::Size`],
/// [`RenderError::Supersampling`].
pub fn histories_picture(
    title: Option<&str>,
    runs: &[RunHistory],
    objective: &ObjectiveAxis,
    limit: Option<f64>,
    canvas: &Canvas,
) -> Result<Picture, RenderError> {
    check_count(runs.len())?;
    let lines = |column: usize, sign: f64| {
        let line = |(number, run): (usize, &RunHistory)| {
            let points = run.rows.iter().map(|row| [row[0], sign * row[column]]).collect();
            let (colour, dash) = style(number);
            let name = if runs.len() > 1 { run.name.clone() } else { String::new() };
            Line { name, points, colour, dash, marked: false }
        };
        runs.iter().enumerate().map(line).collect()
    };
    chart(
        title,
        &plots(objective, lines(1, if objective.negated { -1.0 } else { 1.0 }), lines(2, 1.0), limit),
        ITERATION,
        canvas,
    )
}

/// Refuses more lines than can be distinguished.
pub(super) fn check_count(lines: usize) -> Result<(), RenderError> {
    if lines > MOST_LINES {
        return Err(RenderError::TooManyLines { found: lines, limit: MOST_LINES });
    }
    Ok(())
}

/// Colour and dash of a line of several, by number.
pub(super) fn style(number: usize) -> (Colour, Dash) {
    (COLOURS[number % COLOURS.len()], DASHES[number % DASHES.len()])
}

const ITERATION: &str = "Iteration";

fn plots(axis: &ObjectiveAxis, objective: Vec<Line>, volume_fraction: Vec<Line>, limit: Option<f64>) -> [Plot; 2] {
    [
        Plot { title: axis.name.clone(), lines: objective, level: None, share: 2.0 },
        Plot { title: "Volume fraction".into(), lines: volume_fraction, level: limit, share: 1.0 },
    ]
}

/// Colours that colour-blind readers can distinguish: M. Okabe and K. Ito, Color Universal Design,
/// 2008, without yellow, which is too light on white.
const COLOURS: [Colour; 7] = [
    Colour([0, 114, 178]),
    Colour([213, 94, 0]),
    Colour([0, 158, 115]),
    Colour([204, 121, 167]),
    Colour([86, 180, 233]),
    Colour([230, 159, 0]),
    Colour([0, 0, 0]),
];

const DASHES: [Dash; 4] = [Dash::Solid, Dash::Dashed, Dash::DashDotted, Dash::Dotted];

/// Number of lines that differ in colour or dash: 7 and 4 have no common divisor.
const MOST_LINES: usize = COLOURS.len() * DASHES.len();
