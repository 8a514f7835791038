//! What commands show of an analysis: quantities at the ends of load cases, time by phase, warnings.

use serde_json::{Value, json};
use slipstick::analysis::{Analysis, Forward};
use slipstick::build::Problem;
use slipstick::path::{Phase, Timings};
use slipstick::quantities::{EnergyJump, Quantities, QuantityRow, Subject};
use slipstick_service::failure::{Failure, Outcome};

use crate::context::Context;

/// Returns the analysis unless the user stopped it before its last load step.
pub(crate) fn whole(context: &Context, forward: &Forward, steps: usize) -> Outcome {
    if context.interrupt.requested() && forward.path.steps < steps {
        let message = format!("{} of {steps} load steps were reached", forward.path.steps);
        return Err(Failure::Interrupted { message, resume: None });
    }
    Ok(())
}

/// Numbers of open, sticking and slipping slave nodes at the end of the path.
pub(crate) fn final_status(forward: &Forward) -> [usize; 3] {
    let last = forward.path.states.last().and_then(|state| state.report.iterations.last());
    last.map_or([0; 3], |record| record.status)
}

/// A quantity with few digits, for display.
pub(crate) fn digits(value: f64) -> String {
    // Write −0 as 0.
    let (value, size) = (value + 0.0, value.abs());
    if size != 0.0 && !(1e-3..1e6).contains(&size) { format!("{value:.5e}") } else { format!("{value:.6}") }
}

/// The quantities at the end of the path, by name; of several load cases as `NAME in LOAD_CASE`, as `evaluate` prints
/// them.
pub(crate) fn last_values(quantities: &Quantities, problem: &Problem) -> Value {
    let all = ends(quantities, problem);
    let of_end = |(load_case, row): &(Option<String>, &QuantityRow)| -> Vec<(String, Value)> {
        let of =
            load_case.as_ref().filter(|_| all.len() > 1).map_or(String::new(), |load_case| format!(" in {load_case}"));
        let named = quantities.names.iter().zip(&row.values);
        named.map(|(name, value)| (format!("{}{of}", name.name), json!(value))).collect()
    };
    all.iter().flat_map(of_end).collect()
}

/// The last row of each load case, with its name; that of a single load path has none.
fn ends<'q>(quantities: &'q Quantities, problem: &Problem) -> Vec<(Option<String>, &'q QuantityRow)> {
    if problem.load_cases.is_empty() {
        return quantities.rows.last().filter(|row| row.step > 0).map(|row| (None, row)).into_iter().collect();
    }
    let steps = problem.analysis.times.len() / problem.load_cases.len();
    let end = |(number, name): (usize, &String)| {
        let row = quantities.rows.iter().rfind(|row| row.step == steps * (number + 1))?;
        Some((Some(name.clone()), row))
    };
    problem.load_cases.iter().enumerate().filter_map(end).collect()
}

/// The quantities that the case names, at the end of each load case.
pub(crate) fn case_values(quantities: &Quantities, problem: &Problem) -> Vec<(String, f64)> {
    let mut values = Vec::new();
    for (load_case, row) in ends(quantities, problem) {
        for (name, value) in quantities.names.iter().zip(&row.values).filter(|(name, _)| name.subject == Subject::Case)
        {
            let of = load_case.as_ref().map_or(String::new(), |load_case| format!(" in {load_case}"));
            values.push((format!("{}{of}", name.name), *value));
        }
    }
    values
}

/// Prints the key quantities at the end of each load case: reactions, contact forces, energies, and
/// those of the case.
pub(crate) fn print_quantities(context: &Context, quantities: &Quantities, problem: &Problem) {
    let ends = ends(quantities, problem);
    if ends.is_empty() {
        return;
    }
    for (load_case, row) in ends {
        let title =
            load_case.map_or("at the last load step:".into(), |name| format!("at the end of load case {name}:"));
        print_row(context, quantities, row, problem, &title);
    }
    context.console.overlaps(&quantities.overlaps);
    context.console.losses(&quantities.losses);
    context.console.coarse_friction(&quantities.coarse_friction);
    context.console.rough_pressures(&quantities.rough_pressures);
    context.console.on_void(&quantities.on_void);
    quantities.released.iter().for_each(|released| context.console.released(released));
    quantities.imbalance.iter().for_each(|found| context.console.imbalance(found));
    if let Some((step, part)) = quantities.holding() {
        context.console.warning(&format!(
            "up to load step {step}, the springs on free motions take {:.1} % of the work of loads, supports and \
             offsets: almost nothing holds these bodies (`solve -v` names the motions); support them or add friction",
            100.0 * part
        ));
    }
    if let Some(EnergyJump { step, before, rise, added }) = quantities.jump() {
        context.console.warning(&format!(
            "in load step {step}, the strain energy rises from {} by {}, although supports and loads do work of only \
             {}: Newton's method has probably jumped to another equilibrium; use more load steps or, with the penalty \
             method, a lower stiffness",
            digits(before),
            digits(rise),
            digits(added)
        ));
    }
}

/// Prints the key quantities of a row.
fn print_row(context: &Context, quantities: &Quantities, row: &QuantityRow, problem: &Problem, title: &str) {
    let ties = problem.analysis.model().interfaces().iter().filter(|pair| pair.bond.is_some());
    let ties: Vec<&String> = ties.map(|pair| &pair.surfaces[0]).collect();
    let named = || quantities.names.iter().zip(&row.values);
    let value = |subject: &Subject, what: &str| {
        let found = named().find(|(name, _)| name.subject == *subject && name.what == what);
        digits(found.map_or(0.0, |(_, value)| *value))
    };
    let mut lines: Vec<(String, String)> = Vec::new();
    for (name, found) in named() {
        match &name.subject {
            Subject::Support(set) => {
                let Some(axis) = name.what.strip_prefix("reaction_") else { continue };
                let title = format!("reaction of {set}");
                match lines.iter_mut().find(|(known, _)| *known == title) {
                    Some((_, text)) => *text += &format!(", {axis} {}", digits(*found)),
                    None => lines.push((title, format!("{axis} {}", digits(*found)))),
                }
            }
            pair @ Subject::Pair(slave) if name.what == "normal_force" && ties.contains(&slave) => {
                let pulled = if *found < 0.0 { " (tension)" } else { "" };
                let text = format!(
                    "normal force {}{pulled}, shear forces of the nodes {}",
                    digits(*found),
                    value(pair, "friction_force")
                );
                lines.push((format!("tie at {slave}"), text));
            }
            pair @ Subject::Pair(slave) if name.what == "normal_force" => {
                let [friction, pressure] = ["friction_force", "peak_pressure"].map(|what| value(pair, what));
                let mut text = format!("normal {}, friction {friction}, peak pressure {pressure}", digits(*found));
                if named().any(|(name, _)| name.subject == *pair && name.what == "force_on_void") {
                    text += &format!(", on void {}", value(pair, "force_on_void"));
                }
                lines.push((format!("contact at {slave}"), text));
            }
            bolt @ Subject::Bolt(called) if name.what == "bolt_force" => {
                let text = format!("force {}, overlap {}", digits(*found), value(bolt, "overlap"));
                lines.push((format!("bolt {called}"), text));
            }
            _ => {}
        }
    }
    let [work, stored, friction] =
        ["external_work", "strain_energy", "friction_work"].map(|what| value(&Subject::Whole, what));
    let further = [
        ("spring_energy", "springs"),
        ("plastic_work", "plastic"),
        ("offset_work", "work of offsets"),
        ("thermal_work", "work of temperatures"),
        ("viscous_work", "viscous"),
        ("holding_work", "springs on free motions"),
    ]
    .into_iter();
    let has = |what: &str| quantities.names.iter().any(|name| name.subject == Subject::Whole && name.what == what);
    let more: String = further
        .filter(|(what, _)| has(what))
        .map(|(what, name)| format!(", {name} {}", value(&Subject::Whole, what)))
        .collect();
    lines.push(("energy".into(), format!("external work {work}, stored {stored}, friction {friction}{more}")));
    for (name, found) in named().filter(|(name, _)| name.subject == Subject::Case) {
        lines.push((name.name.clone(), digits(*found)));
    }
    let width = lines.iter().map(|(title, _)| title.chars().count()).max().unwrap_or_default();
    context.console.text(title);
    for (title, text) in lines {
        context.console.text(&format!("  {title:width$}  {text}"));
    }
}

/// Time by phase: seconds and number of calls.
pub(crate) fn phases(spent: &Timings) -> Value {
    let entry = |phase: Phase| (phase.name().to_owned(), json!([spent.seconds(phase), spent.calls(phase)]));
    Value::Object(Phase::ALL.into_iter().map(entry).collect())
}

/// Warns if direct solvers had to replace the iterative one.
pub(crate) fn warn_of_fallbacks(context: &Context, analysis: &Analysis) {
    let count = analysis.linear.counts().fallbacks;
    if count > 0 {
        context.console.warning(&format!(
            "the iterative solver failed for {count} linear system{}, and direct solvers took over: they may need more \
             time and memory than `slipstick check` predicts; if this happens often, set `[solver] linear = \"direct\"`",
            if count == 1 { "" } else { "s" }
        ));
    }
}

/// Prints the time by phase if verbose.
pub(crate) fn print_phases(context: &Context, what: &str, spent: &Timings) {
    if context.console.shows(1) {
        let part = |phase: Phase| format!("{} {:.2} s", phase.name().replace('_', " "), spent.seconds(phase));
        context.console.text(&format!("{what}: {}", Phase::ALL.map(part).join(", ")));
    }
}
#[cfg(test)]
mod tests {
    #[test]
    fn quantities_are_short() {
        assert_eq!(super::digits(-9.876_543_21), "-9.876543");
        assert_eq!(super::digits(1.234e-7), "1.23400e-7");
        assert_eq!((super::digits(0.0), super::digits(-0.0)), ("0.000000".into(), "0.000000".into()));
    }
}
