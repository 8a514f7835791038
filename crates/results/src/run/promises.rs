//! What a design promised, and what its part keeps: quantities at the end of each load case.

use std::collections::BTreeMap;
use std::fs;

use slipstick_case::file::{Case, Constraint, CurveToFollow, ObjectiveKind, ObservedSteps, Promise};
use slipstick_design::{Bound, extreme_of};
use slipstick_model::optimize::FEASIBLE;
use slipstick_model::words::list;

use super::{ExitState, RunDirectory, RunError, RunRecord};

/// The value that a design promised, and that of its part.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The quantity, a column of `quantities.csv`.
    pub quantity: String,
    /// The load case; empty if there is only one load path.
    pub load_case: String,
    /// The load steps over which the values are the worst ones; empty: the last one.
    pub steps: Vec<usize>,
    /// The value that the design promised.
    pub promised: f64,
    /// The value in this run.
    pub found: f64,
    /// The largest value that the design promised in any load case: of all contact forces and reactions, of all peak
    /// pressures, of all energies, or of this quantity of the case.
    pub scale: f64,
    /// The bounds of the design on the quantity.
    pub bounds: Vec<Bound>,
}

impl Comparison {
    /// How far the value of this run lies beyond a bound of the design, relative to the bound; `None` if it
    /// meets all, or the design had none. Differences of 0.1 % count as met, as for designs.
    pub fn violation(&self) -> Option<(Bound, f64)> {
        let beyond = self.bounds.iter().map(|&bound| (bound, bound.violation(self.found).0));
        beyond.filter(|(_, by)| *by > FEASIBLE).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The quantity, with the load case and the load steps, if they are not the only or the last ones.
    pub fn name(&self) -> String {
        let load_case = if self.load_case.is_empty() { String::new() } else { format!(" in {}", self.load_case) };
        format!("{}{load_case}{}", self.quantity, self.at_steps())
    }

    /// The load steps in words, if they are not the last ones: ` at step 2`, `, largest of steps 1 to 4`.
    pub fn at_steps(&self) -> String {
        match (&self.steps[..], self.bounds.first()) {
            ([], _) => String::new(),
            ([step], _) => format!(" at step {step}"),
            (_, Some(Bound::AtMost(_))) => format!(", largest of steps {}", list(&self.steps)),
            _ => format!(", smallest of steps {}", list(&self.steps)),
        }
    }

    /// Whether the design itself lay beyond this bound.
    pub fn was_violated(&self, bound: Bound) -> bool {
        bound.violation(self.promised).0 > FEASIBLE
    }

    /// The relative deviation from the promise; for a promise that is small among those of its kind,
    /// relative to the largest of them. `None` if the promise is zero or round-off.
    pub fn deviation(&self) -> Option<f64> {
        let own = self.promised.abs();
        if own < SMALL * self.scale {
            return Some((self.found - self.promised) / self.scale).filter(|deviation| deviation.is_finite());
        }
        let deviation = self.found / self.promised - 1.0;
        (own > ROUND_OFF * self.found.abs() && deviation.is_finite()).then_some(deviation)
    }

    /// The deviation in words; empty if there is none.
    pub fn deviation_text(&self) -> String {
        let of = if self.promised.abs() < SMALL * self.scale { " of the largest" } else { "" };
        self.deviation().map_or(String::new(), |value| format!("{:+.1} %{of}", 100.0 * value))
    }

    /// The kind of a quantity of which all cases have several: forces, pressures or energies.
    fn kind(&self) -> Option<&'static str> {
        match self.quantity.as_str() {
            "strain_energy" | "friction_work" | "external_work" => Some("energy"),
            name if name.starts_with("reaction_") => Some("force"),
            name if name.ends_with("_normal_force") || name.ends_with("_friction_force") => Some("force"),
            name if name.ends_with("_peak_pressure") => Some("pressure"),
            _ => None,
        }
    }
}

/// Promises smaller than this fraction of the largest one of their kind are compared with that one.
const SMALL: f64 = 1e-3;

/// Promises smaller than this fraction of the value of the part are round-off.
const ROUND_OFF: f64 = 1e-6;

/// Reactions smaller than this fraction of the largest one are round-off of a symmetric case.
const NEGLIGIBLE: f64 = 1e-6;

/// The values that a run of a design promises: quantities of the case, contact forces, peak
/// pressures, reactions and energies at the end of each load case. Empty if the run has no complete
/// load path, or if it is an optimization that has not finished.
///
/// # Errors
/// [`RunError::Read`]; those of [`RunRecord::read`].
pub fn promises(run: &RunDirectory, case: &Case) -> Result<Vec<Promise>, RunError> {
    if run.file("history.csv").is_file() && RunRecord::read(run)?.latest.exit != ExitState::Finished {
        // the path may be that of an earlier design
        return Ok(Vec::new());
    }
    let Some(table) = rows(run, case)? else { return Ok(Vec::new()) };
    let (columns, rows) = (&table.columns, table.ends());
    let values_of = |name: &str| -> Option<Vec<f64>> {
        let column = columns.iter().position(|column| column == name)?;
        rows.iter().map(|row| row.get(column)?.parse().ok()).collect()
    };
    // a bounded smooth measure is followed by the extreme for which it stands
    let bounded = |name: &String| case.constraints.iter().any(|of| of.quantity == *name);
    let with_extreme = |name: &String| [Some(name.clone()), bounded(name).then(|| extreme_of(name))];
    let quantities = case.quantities.iter().flat_map(|quantity| with_extreme(&quantity.name));
    let mut names: Vec<String> = quantities.flatten().collect();
    for contact in &case.contacts {
        names.extend(of_pair(case, &contact.slave).iter().map(|what| format!("{}_{what}", contact.slave)));
    }
    let mut reactions: Vec<String> = Vec::new();
    for support in &case.dirichlet {
        reactions.extend(["x", "y", "z"].map(|axis| format!("reaction_{}_{axis}", support.set)));
    }
    let size =
        |name: &String| values_of(name).map_or(0.0, |values| values.iter().fold(0.0, |a: f64, v| a.max(v.abs())));
    let largest = reactions.iter().map(size).fold(0.0, f64::max);
    names.extend(reactions.into_iter().filter(|name| size(name) > NEGLIGIBLE * largest));
    names.extend(["strain_energy", "friction_work", "external_work"].map(str::to_owned));
    let mut promises: Vec<Promise> = Vec::new();
    for quantity in names {
        let values = values_of(&quantity);
        if let Some(values) = values.filter(|_| promises.iter().all(|other| other.quantity != quantity)) {
            promises.push(Promise { quantity, values, max: None, min: None, steps: ObservedSteps::Last });
        }
    }
    add_bounds(&mut promises, case);
    promises.extend(bounds_before_the_end(&table, case));
    for of in objective_before_the_end(&table, case) {
        let known = |other: &Promise| (&other.quantity, &other.steps) == (&of.quantity, &of.steps);
        if !promises.iter().any(known) {
            promises.push(of);
        }
    }
    Ok(promises)
}

/// The columns of a pair that are compared: a tie has neither friction nor a contact pressure.
fn of_pair(case: &Case, slave: &str) -> &'static [&'static str] {
    if case.is_tie(slave) { &OF_PAIR[..1] } else { OF_PAIR }
}

/// Columns of a pair, after the name of its slave; the first is that of any pair.
const OF_PAIR: &[&str] = &["normal_force", "friction_force", "peak_pressure"];

fn of_contact(rest: &str) -> bool {
    rest.strip_prefix('_').is_some_and(|what| OF_PAIR.contains(&what))
}

/// Adds the bounds of the design that hold only at the ends of load cases. Those of a smooth measure are bounds on the
/// extreme for which it stands, unless they are for the measure itself.
fn add_bounds(promises: &mut [Promise], case: &Case) {
    let steps = case.load_path.steps;
    let at_end = |constraint: &&Constraint| steps_of(&constraint.steps, steps).is_empty();
    for constraint in case.constraints.iter().filter(at_end) {
        let extreme = constraint.corrected.then(|| extreme_of(&constraint.quantity));
        let of = [extreme, Some(constraint.quantity.clone())];
        let found = of.iter().flatten().find_map(|name| promises.iter().position(|promise| promise.quantity == *name));
        let Some(promise) = found.map(|number| &mut promises[number]) else { continue };
        let tighter = |known: Option<f64>, new: Option<f64>, pick: fn(f64, f64) -> f64| match (known, new) {
            (Some(known), Some(new)) => Some(pick(known, new)),
            (known, new) => known.or(new),
        };
        promise.max = tighter(promise.max, constraint.max, f64::min);
        promise.min = tighter(promise.min, constraint.min, f64::max);
    }
}

/// The load steps of a path of `last` steps that are meant; none if that is only the last one.
fn steps_of(steps: &ObservedSteps, last: usize) -> Vec<usize> {
    let all: Vec<usize> = (1..=last).filter(|&step| steps.contains(step, last)).collect();
    if all == [last] { Vec::new() } else { all }
}

/// The bounds of the design at load steps before the last, each with the worst values over its steps.
fn bounds_before_the_end(table: &Rows, case: &Case) -> Vec<Promise> {
    let last = case.load_path.steps;
    let mut promises = Vec::new();
    for constraint in &case.constraints {
        let steps = steps_of(&constraint.steps, last);
        let extreme = constraint.corrected.then(|| extreme_of(&constraint.quantity));
        let of = [extreme, Some(constraint.quantity.clone())];
        let Some(quantity) = of.into_iter().flatten().find(|name| table.columns.contains(name)) else { continue };
        if steps.is_empty() {
            continue;
        }
        for [max, min] in [[constraint.max, None], [None, constraint.min]] {
            let bounded = max.is_some() || min.is_some();
            let values = table.worst(&quantity, &steps, max.is_some());
            if let Some(values) = values.filter(|_| bounded) {
                promises.push(Promise {
                    quantity: quantity.clone(),
                    values,
                    max,
                    min,
                    steps: constraint.steps.clone(),
                });
            }
        }
    }
    promises
}

/// More load steps than this are not promised one by one.
const MOST_STEPS: usize = 12;

/// The quantities of the objective at each load step before the last that it observes; of a curve to follow, at the
/// points that are load steps.
fn objective_before_the_end(table: &Rows, case: &Case) -> Vec<Promise> {
    let last = case.load_path.steps;
    let before_the_end = |steps: &ObservedSteps| (1..last).filter(|&step| steps.contains(step, last)).collect();
    let (quantities, steps): (Vec<&String>, Vec<usize>) = match case.objective.as_ref().map(|of| &of.kind) {
        Some(ObjectiveKind::Minimise(of) | ObjectiveKind::Maximise(of)) => {
            (of.sum.iter().map(|term| &term.quantity).collect(), before_the_end(&of.steps))
        }
        Some(ObjectiveKind::Follow(CurveToFollow { quantity, points })) => {
            let steps = points.iter().map(|[t, _]| t * last as f64).filter(|s| (s - s.round()).abs() < 1e-6);
            (vec![quantity], steps.map(|s| s.round() as usize).filter(|step| (1..last).contains(step)).collect())
        }
        _ => return Vec::new(),
    };
    if steps.len() > MOST_STEPS {
        return Vec::new();
    }
    let each = quantities.into_iter().flat_map(|quantity| steps.iter().map(move |&step| (quantity, step)));
    let promise = |(quantity, step): (&String, usize)| {
        let values = table.worst(quantity, &[step], true)?;
        Some(Promise {
            quantity: quantity.clone(),
            values,
            max: None,
            min: None,
            steps: ObservedSteps::Only(vec![step]),
        })
    };
    each.filter_map(promise).collect()
}

/// The promised values of a case's design that lie beyond their bounds, compared with themselves.
pub fn unmet(promises: &[Promise], case: &Case) -> Vec<Comparison> {
    let names = case.load_case_names();
    let of = |promise: &Promise| -> Vec<Comparison> {
        let (steps, bounds) = (steps_of(&promise.steps, case.load_path.steps), bounds_of(promise));
        let each = promise.values.iter().enumerate().map(|(number, &value)| Comparison {
            quantity: promise.quantity.clone(),
            load_case: names.get(number).cloned().unwrap_or_default(),
            steps: steps.clone(),
            promised: value,
            found: value,
            scale: 0.0,
            bounds: bounds.clone(),
        });
        each.filter(|of| of.violation().is_some()).collect()
    };
    promises.iter().flat_map(of).collect()
}

fn bounds_of(promise: &Promise) -> Vec<Bound> {
    [promise.max.map(Bound::AtMost), promise.min.map(Bound::AtLeast)].into_iter().flatten().collect()
}

/// The promises of a case and the values of its run. Empty if the case has none, or if the run has
/// no complete load path; quantities that the run does not have are left out.
///
/// # Errors
/// [`RunError::Read`].
pub fn comparisons(run: &RunDirectory, case: &Case) -> Result<Vec<Comparison>, RunError> {
    if case.promises.is_empty() {
        return Ok(Vec::new());
    }
    let Some(table) = rows(run, case)? else { return Ok(Vec::new()) };
    let names = case.load_case_names();
    let mut found = Vec::new();
    // parts of earlier versions also promise the friction of ties
    let known = |name: &str| {
        let tie = case.contacts.iter().find(|pair| name.strip_prefix(&pair.slave).is_some_and(of_contact));
        tie.is_none_or(|pair| of_pair(case, &pair.slave).iter().any(|what| name == format!("{}_{what}", pair.slave)))
    };
    for promise in case.promises.iter().filter(|promise| known(&promise.quantity)) {
        let last = case.load_path.steps;
        let steps = steps_of(&promise.steps, last);
        let of = if steps.is_empty() { &[last][..] } else { &steps };
        let Some(values) = table.worst(&promise.quantity, of, promise.max.is_some()) else { continue };
        for (number, (value, &promised)) in values.into_iter().zip(&promise.values).enumerate() {
            let steps = steps.clone();
            let (quantity, load_case) = (promise.quantity.clone(), names.get(number).cloned().unwrap_or_default());
            let bounds = bounds_of(promise);
            found.push(Comparison { quantity, load_case, steps, promised, found: value, scale: 0.0, bounds });
        }
    }
    for kind in ["energy", "force", "pressure"] {
        let of_kind =
            |of: &&Comparison| of.kind() == Some(kind) && case.quantities.iter().all(|q| q.name != of.quantity);
        let scale = found.iter().filter(of_kind).map(|of| of.promised.abs()).fold(0.0, f64::max);
        found.iter_mut().filter(|of| of_kind(&&**of)).for_each(|of| of.scale = scale);
    }
    // of anything else, its values in other load cases
    let own: Vec<f64> = found
        .iter()
        .map(|of| found.iter().filter(|other| other.quantity == of.quantity))
        .map(|alike| alike.map(|other| other.promised.abs()).fold(0.0, f64::max))
        .collect();
    found.iter_mut().zip(own).for_each(|(of, own)| of.scale = of.scale.max(own));
    Ok(found)
}

/// The table `quantities.csv`.
struct Rows {
    columns: Vec<String>,
    /// Rows of each load case, of the load steps 1, 2, …
    rows: Vec<Vec<Vec<String>>>,
}

impl Rows {
    /// The rows at the ends of load cases.
    fn ends(&self) -> Vec<&Vec<String>> {
        self.rows.iter().filter_map(|rows| rows.last()).collect()
    }

    /// For each load case, the largest or smallest value of a column over load steps; `None` if there is no such
    /// column, or a value is not a number.
    fn worst(&self, column: &str, steps: &[usize], largest: bool) -> Option<Vec<f64>> {
        let column = self.columns.iter().position(|of| of == column)?;
        let of_case = |rows: &Vec<Vec<String>>| -> Option<f64> {
            let value = |&step: &usize| rows.get(step.checked_sub(1)?)?.get(column)?.parse::<f64>().ok();
            let values = steps.iter().map(value).collect::<Option<Vec<f64>>>()?;
            values.into_iter().reduce(if largest { f64::max } else { f64::min })
        };
        self.rows.iter().map(of_case).collect()
    }
}

/// The rows of all load steps; `None` if the file does not exist, belongs to an evaluation under several
/// coefficients of friction, or lacks such a row.
fn rows(run: &RunDirectory, case: &Case) -> Result<Option<Rows>, RunError> {
    let path = run.file("quantities.csv");
    if !path.is_file() {
        return Ok(None);
    }
    let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<String>>();
    let mut lines = text.lines();
    let columns = cells(lines.next().unwrap_or_default());
    if columns.first().is_none_or(|first| first != "step") {
        return Ok(None);
    }
    let all: BTreeMap<String, Vec<String>> = lines.map(cells).map(|row| (row[0].clone(), row)).collect();
    let row = |step: usize| all.get(&step.to_string()).cloned();
    let steps = case.load_path.steps;
    let of_case = |number: usize| (1..=steps).map(|step| row(number * steps + step)).collect::<Option<Vec<_>>>();
    let rows = (0..case.steps() / steps).map(of_case).collect::<Option<Vec<_>>>();
    Ok(rows.map(|rows| Rows { columns, rows }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Promises that vanish by symmetry are compared with the largest of their kind, and round-off not
    /// at all.
    #[test]
    fn deviations_have_a_sensible_scale() {
        let of = |quantity: &str, promised: f64, found: f64, scale: f64| {
            let (quantity, load_case) = (quantity.to_owned(), String::new());
            Comparison { quantity, load_case, steps: Vec::new(), promised, found, scale, bounds: Vec::new() }
                .deviation()
        };
        assert_eq!(of("reaction_low_y", -100.0, -105.0, 100.0).map(|d| (1e9 * d).round()), Some(5e7));
        assert_eq!(of("reaction_low_x", 1e-15, -0.5, 100.0).map(|d| (1e9 * d).round()), Some(-5e6));
        let small = Comparison {
            quantity: "reaction_low_x".into(),
            load_case: String::new(),
            steps: Vec::new(),
            promised: 0.02,
            found: 0.001,
            scale: 100.0,
            bounds: Vec::new(),
        };
        assert_eq!(small.deviation_text(), "-0.0 % of the largest");
        assert_eq!(Comparison { scale: 1.0, ..small }.deviation_text(), "-95.0 %");
        assert_eq!(of("lift", 1e-15, -4.95e-3, 0.0), None);
        assert_eq!(of("lift", 0.0, 1.0, 0.0), None);
        assert_eq!(of("lift", 2.0, 1.0, 0.0), Some(-0.5));
    }

    /// The largest violation counts, relative to its bound; 0.1 % count as met.
    #[test]
    fn bounds_of_the_design_hold_for_the_part() {
        let of = |found: f64, bounds: Vec<Bound>| {
            let (quantity, load_case) = ("stress".to_owned(), String::new());
            Comparison { quantity, load_case, steps: Vec::new(), promised: 35.0, found, scale: 0.0, bounds }.violation()
        };
        let (most, least) = (Bound::AtMost(40.0), Bound::AtLeast(20.0));
        assert_eq!(of(44.0, vec![least, most]), Some((most, 0.1)));
        assert_eq!(of(15.0, vec![least, most]), Some((least, 0.25)));
        assert_eq!([of(40.03, vec![most]), of(30.0, vec![least, most]), of(99.0, vec![])], [None, None, None]);
    }

    /// The bound on a smooth measure is one on its extreme, unless it is for the measure itself; one that does not hold
    /// at the last load step is none.
    #[test]
    fn bounds_belong_to_extremes() {
        let text = slipstick_case::file::template("half-ball").expect("a template").text;
        let quantity =
            "[[quantity]]\nname = \"peak\"\ncontact_pressure = { slave = \"ball_dome\", measure = \"peak\" }\n";
        let bounds = |constraint: &str| {
            let text = format!("{text}\n{quantity}[[constraint]]\nquantity = \"peak\"\nmax = 40\n{constraint}\n");
            let case = slipstick_case::file::parse_case(&text, "case.toml").expect("a case").case;
            let promise = |name: &str| Promise {
                quantity: name.into(),
                values: vec![30.0],
                max: None,
                min: None,
                steps: ObservedSteps::Last,
            };
            let mut promises = ["peak", "peak_extreme"].map(promise);
            add_bounds(&mut promises, &case);
            promises.map(|promise| promise.max)
        };
        assert_eq!(bounds(""), [None, Some(40.0)]);
        assert_eq!(bounds("corrected = false"), [Some(40.0), None]);
        assert_eq!(bounds("steps = [1]"), [None, None]);
    }

    /// By hand: the quantity at the steps of the objective, and at those points of a curve that are load steps, without the
    /// last one, which is promised anyway.
    #[test]
    fn the_objective_is_promised_at_its_steps() {
        let text = slipstick_case::file::template("half-ball").expect("a template").text;
        let (start, rest) = text.split_once("[objective]").expect("an objective");
        let rest = rest.split_once("\n[").map_or("", |(_, rest)| rest);
        let quantity =
            "[[quantity]]\nname = \"f\"\ncontact_force = { slave = \"ball_dome\", component = \"normal\" }\n";
        let of = |objective: &str| {
            let text = format!("{start}\n{quantity}[objective]\n{objective}\n[{rest}");
            let case = slipstick_case::file::parse_case(&text, "case.toml").expect("a case").case;
            let row = |step: usize| vec![step.to_string(), format!("{}", 10 * step)];
            let rows = vec![(1..=case.load_path.steps).map(row).collect()];
            let found = objective_before_the_end(&Rows { columns: vec!["step".into(), "f".into()], rows }, &case);
            let last = case.load_path.steps;
            (last, found.into_iter().map(|of| (steps_of(&of.steps, last), of.values)).collect::<Vec<_>>())
        };
        let (last, found) = of("maximise = { quantity = \"f\", steps = [2, 5] }");
        assert!(last >= 10 && last.is_multiple_of(10), "{last}");
        assert_eq!(found, [(vec![2], vec![20.0]), (vec![5], vec![50.0])]);
        let half = last / 2;
        let points = "follow = { quantity = \"f\", points = [[0.123, 1.0], [0.5, 2.0], [1.0, 3.0]] }";
        assert_eq!(of(points).1, [(vec![half], vec![10.0 * half as f64])]);
        assert_eq!((of("minimise = { quantity = \"f\" }").1, of("contact_force = {}").1), (vec![], vec![]));
    }

    /// By hand: the largest of steps 1 and 2 in each of two load cases, and the smallest of all.
    #[test]
    fn the_worst_over_steps_counts() {
        let rows = [["1", "5"], ["2", "3"], ["3", "9"]].map(|row| row.map(str::to_owned).to_vec()).to_vec();
        let other = [["4", "-1"], ["5", "2"], ["6", "0"]].map(|row| row.map(str::to_owned).to_vec()).to_vec();
        let table = Rows { columns: vec!["step".into(), "f".into()], rows: vec![rows, other] };
        assert_eq!(table.worst("f", &[1, 2], true), Some(vec![5.0, 2.0]));
        assert_eq!(table.worst("f", &[1, 2, 3], false), Some(vec![3.0, -1.0]));
        assert_eq!((table.worst("f", &[4], true), table.worst("g", &[1], true)), (None, None));
        assert_eq!(steps_of(&ObservedSteps::All, 3), [1, 2, 3]);
        assert!(steps_of(&ObservedSteps::Last, 3).is_empty() && steps_of(&ObservedSteps::Only(vec![3]), 3).is_empty());
    }
}
