//! One quantity of a load path over another, for one run or for several in one chart.

use std::fs;
use std::path::Path;

use slipstick_results::run::{RunDirectory, RunError};

use super::RenderError;
use super::chart::{Dash, Line, Plot, chart};
use super::history::{check_count, style};
use super::picture::{Canvas, Picture};

/// A curve with a name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// Its name in the legend.
    pub name: String,
    /// Abscissa and ordinate at each load step.
    pub points: Vec<[f64; 2]>,
    /// Whether only its points are drawn, without a line: measurements, or values that are asked for.
    pub points_only: bool,
}

/// Column `y` over column `x` of the `quantities.csv` of a run: one curve per load case and
/// coefficient of friction, named `name`, followed by these if there are several curves. Steps
/// whose state could not be evaluated are left out.
///
/// # Errors
/// [`RunError::NoRun`] for a directory without a run or without `quantities.csv`;
/// [`RunError::Read`]; [`RunError::Damaged`] for a table without one of the columns, or with rows
/// that are incomplete or not numeric.
pub fn read_curves(results: &Path, name: &str, x: &str, y: &str) -> Result<Vec<Curve>, RunError> {
    let table = RunDirectory::open(results)?.file("quantities.csv");
    if !table.is_file() {
        return Err(RunError::NoRun { directory: results.to_owned(), file: "quantities.csv" });
    }
    let text = fs::read_to_string(&table).map_err(RunError::read(&table))?;
    curves(&text, name, [x, y]).map_err(|(reason, cure)| RunError::Damaged { path: table, reason, cure })
}

/// Several curves in one chart, with a legend if there is more than one, and the names of the axes.
///
/// # Errors
/// [`RenderError::TooManyLines`], [`RenderError::NotFinite`], [`RenderError::Size`],
/// [`RenderError::Supersampling`].
pub fn curves_picture(
    title: Option<&str>,
    curves: &[Curve],
    [x, y]: [&str; 2],
    canvas: &Canvas,
) -> Result<Picture, RenderError> {
    check_count(curves.len())?;
    let solid = curves.iter().filter(|curve| !curve.points_only).count();
    let line = |(number, curve): (usize, &Curve)| {
        let (colour, dash) = style(number);
        let name = if curves.len() > 1 { curve.name.clone() } else { String::new() };
        let (colour, dash) = if curve.points_only { (colour, Dash::None) } else { (colour, dash) };
        // with many runs or points, markers hide the lines
        let marked = curve.points_only || (solid <= 2 && curve.points.len() <= 60);
        Line { name, points: curve.points.clone(), colour, dash, marked }
    };
    let lines = curves.iter().enumerate().map(line).collect();
    chart(title, &[Plot { title: y.to_owned(), lines, level: None, share: 2.0 }], x, canvas)
}

fn curves(text: &str, name: &str, columns: [&str; 2]) -> Result<Vec<Curve>, (String, String)> {
    let mut lines = text.lines().enumerate();
    let header: Vec<&str> = lines.next().map_or("", |(_, line)| line).split(',').collect();
    let find = |column: &str| header.iter().position(|found| *found == column);
    let needed = |column: &str| {
        find(column).ok_or_else(|| (format!("has no column `{column}`"), format!("available: {}", header.join(", "))))
    };
    let [x, y] = [needed(columns[0])?, needed(columns[1])?];
    let (case, friction) = (needed("load_case")?, find("friction"));
    let mut all: Vec<([&str; 2], Curve)> = Vec::new();
    for (number, line) in lines.filter(|(_, line)| !line.is_empty()) {
        let cells: Vec<&str> = line.split(',').collect();
        let wrong = |what: String| (format!("line {}: {what}", number + 1), "run the case again".to_owned());
        if cells.len() != header.len() {
            return Err(wrong(format!("{} cells instead of {}", cells.len(), header.len())));
        }
        if cells[x].is_empty() || cells[y].is_empty() {
            continue;
        }
        let value = |at: usize| {
            let number = cells[at].parse::<f64>().ok().filter(|value| value.is_finite());
            number.ok_or_else(|| wrong(format!("`{}` is not a number", cells[at])))
        };
        let point = [value(x)?, value(y)?];
        let path = [cells[case], friction.map_or("", |column| cells[column])];
        match all.iter_mut().find(|(known, _)| *known == path) {
            Some((_, curve)) => curve.points.push(point),
            None => all.push((path, Curve { name: name.to_owned(), points: vec![point], points_only: false })),
        }
    }
    let differ = |k: usize| all.iter().any(|(path, _)| path[k] != all[0].0[k]);
    let (cases, coefficients) = (differ(0), differ(1));
    let named = |([case, friction], mut curve): ([&str; 2], Curve)| {
        if cases {
            curve.name += &format!(", load case {case}");
        }
        if coefficients {
            curve.name += &format!(", friction {friction}");
        }
        curve
    };
    Ok(all.into_iter().map(named).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "step,load_case,time,u,f\n0,0,0.0,0.0,0.0\n1,0,1.0,0.5,-2.0\n2,1,0.5,0.1,\n3,1,1.0,0.2,-3.0\n";

    #[test]
    fn a_curve_per_load_case() {
        let found = curves(TABLE, "run", ["u", "f"]).unwrap();
        let expected = [("run, load case 0", vec![[0.0, 0.0], [0.5, -2.0]]), ("run, load case 1", vec![[0.2, -3.0]])];
        assert_eq!(found, expected.map(|(name, points)| Curve { name: name.into(), points, points_only: false }));
        let evaluations = "friction,step,load_case,time,f\n0.0,1,0,1.0,4.0\n0.5,1,0,1.0,6.0\n";
        let found = curves(evaluations, "run", ["time", "f"]).unwrap();
        let expected = [("run, friction 0.0", [1.0, 4.0]), ("run, friction 0.5", [1.0, 6.0])];
        assert_eq!(
            found,
            expected.map(|(name, point)| Curve { name: name.into(), points: vec![point], points_only: false })
        );
        let one = curves("step,load_case,time,f\n1,0,1.0,4.0\n", "run", ["time", "f"]).unwrap();
        assert_eq!(one, [Curve { name: "run".into(), points: vec![[1.0, 4.0]], points_only: false }]);
    }

    #[test]
    fn wrong_tables_are_refused() {
        let (reason, cure) = curves(TABLE, "run", ["u", "force"]).unwrap_err();
        assert_eq!(
            (reason.as_str(), cure.as_str()),
            ("has no column `force`", "available: step, load_case, time, u, f")
        );
        assert_eq!(curves("step,load_case,f\n1,0\n", "", ["step", "f"]).unwrap_err().0, "line 2: 2 cells instead of 3");
        assert_eq!(
            curves("step,load_case,f\n1,0,x\n", "", ["step", "f"]).unwrap_err().0,
            "line 2: `x` is not a number"
        );
    }
}
