//! Words and units for the axes of charts, and the curve that a design shall follow.

use std::path::Path;

use slipstick_case::file::{Case, Combination, Dimension, ObjectiveKind};
use slipstick_results::run::RunError;

use crate::render::{Curve, ObjectiveAxis, read_curves};

/// The name of a column of `quantities.csv` for an axis, in words, with its unit if the case names it.
pub fn axis(case: &Case, column: &str) -> String {
    if let Some(of) = case.quantities.iter().find(|of| of.name == column) {
        let name = of.label.clone().unwrap_or_else(|| sentence(&of.name));
        return name + &unit(case, of.kind.dimension());
    }
    let (words, dimension) = described(column);
    words + &dimension.map_or(String::new(), |dimension| unit(case, dimension))
}

/// The axis of objectives: named after the only quantity in it, growing upwards if that is maximized.
pub fn objective_axis(case: &Case) -> ObjectiveAxis {
    let of =
        |name: &str, dimension, negated| ObjectiveAxis { name: format!("{name}{}", unit(case, dimension)), negated };
    let single = |combination: &Combination, negated: bool| match &combination.sum[..] {
        [term] if term.weight == 1.0 => ObjectiveAxis { name: axis(case, &term.quantity), negated },
        _ => ObjectiveAxis { negated, ..ObjectiveAxis::default() },
    };
    match case.objective.as_ref().map(|objective| &objective.kind) {
        None => ObjectiveAxis::default(),
        Some(ObjectiveKind::ContactForce { .. }) => of("Sum of the contact forces", Dimension::FORCE, true),
        Some(ObjectiveKind::Compliance { .. }) => of("Compliance", Dimension::WORK, false),
        Some(ObjectiveKind::Minimise(combination)) => single(combination, false),
        Some(ObjectiveKind::Maximise(combination)) => single(combination, true),
        Some(ObjectiveKind::Follow(_)) => of("Relative distance from the curve", Dimension::NONE, false),
    }
}

/// The points that the objective asks a quantity to pass through, if the column `y` is this quantity: over the
/// values of column `x` of a run at their pseudo-times.
///
/// # Errors
/// Those of [`read_curves`].
pub fn requested(results: &Path, case: &Case, [x, y]: [&str; 2]) -> Result<Option<Curve>, RunError> {
    let Some(ObjectiveKind::Follow(curve)) = case.objective.as_ref().map(|objective| &objective.kind) else {
        return Ok(None);
    };
    if curve.quantity != y {
        return Ok(None);
    }
    let path = match &read_curves(results, "", "time", x)?[..] {
        [only] => only.points.clone(),
        _ => return Ok(None),
    };
    let points = curve.points.iter().filter_map(|&[time, value]| Some([between(&path, time)?, value])).collect();
    Ok(Some(Curve { name: "Requested".into(), points, points_only: true }))
}

/// The value at a time, linear between those of a path.
fn between(path: &[[f64; 2]], time: f64) -> Option<f64> {
    if let Some(exact) = path.iter().find(|point| point[0] == time) {
        return Some(exact[1]);
    }
    path.windows(2).find(|pair| pair[0][0] < time && time < pair[1][0]).map(|pair| {
        let share = (time - pair[0][0]) / (pair[1][0] - pair[0][0]);
        pair[0][1] + share * (pair[1][1] - pair[0][1])
    })
}

fn unit(case: &Case, dimension: Dimension) -> String {
    let name = crate::picture::named(&case.units, dimension);
    if name.is_empty() { name } else { format!(" [{}]", name.trim()) }
}

/// A name as words that begin with a capital.
pub(crate) fn sentence(name: &str) -> String {
    let text = name.replace('_', " ");
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// A column that every run has, in words, and its dimension.
fn described(column: &str) -> (String, Option<Dimension>) {
    let words = |name: &str| name.replace('_', " ");
    let axes = ["x", "y", "z"];
    let split = column.rsplit_once('_').filter(|(_, axis)| axes.contains(axis));
    if let Some((rest, axis)) = split {
        let starts =
            [("displacement_", "Displacement", Dimension::LENGTH), ("reaction_", "Reaction", Dimension::FORCE)];
        for (start, what, dimension) in starts {
            if let Some(set) = rest.strip_prefix(start) {
                return (format!("{what} of {} in {axis}", words(set)), Some(dimension));
            }
        }
        if let Some(pair) = rest.strip_suffix("_force") {
            return (format!("Contact force at {} in {axis}", words(pair)), Some(Dimension::FORCE));
        }
        if rest == "symmetry_reaction" {
            return (format!("Reaction of the symmetry plane in {axis}"), Some(Dimension::FORCE));
        }
    }
    for (end, what, dimension) in [
        ("_normal_force", "Normal force", Dimension::FORCE),
        ("_friction_force", "Friction force", Dimension::FORCE),
        ("_peak_pressure", "Peak pressure", Dimension::STRESS),
        ("_contact_area", "Contact area", Dimension::AREA),
        ("_force_on_void", "Contact force on void", Dimension::FORCE),
        ("_friction_work", "Friction work", Dimension::WORK),
    ] {
        if let Some(pair) = column.strip_suffix(end) {
            return (format!("{what} at {}", words(pair)), Some(dimension));
        }
    }
    match column {
        "time" => ("Pseudo-time".into(), None),
        "step" => ("Load step".into(), None),
        _ if column.starts_with("strain_energy") || column.ends_with("_work") || column == "energy_balance" => {
            (sentence(column), Some(Dimension::WORK))
        }
        _ => (sentence(column), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_case::file::parse_case;

    fn case(units: &str, objective: &str) -> Case {
        let text = format!(
            "{units}\n[[body]]\nname = 'cube'\nbox = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [2, 2, 2] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
             [[dirichlet]]\nset = 'cube_ymin'\n[[dirichlet]]\nset = 'cube_ymax'\nmotion = [{{ t = 1, u = [0, 1, 0] }}]\n\
             [load_path]\nsteps = 2\n[design]\nbodies = ['cube']\nvolume_fraction = 0.5\n\
             [[quantity]]\nname = 'pull'\nlabel = 'Pulling force'\nreaction = {{ set = 'cube_ymax', component = 'y' }}\n\
             [[quantity]]\nname = 'mean_rise'\ndisplacement = {{ set = 'cube_ymax', component = 'y' }}\n{objective}\n"
        );
        parse_case(&text, "cube.toml").unwrap_or_else(|errors| panic!("{errors:?}")).case
    }

    const MM: &str = "units = { length = 'mm', force = 'N' }";

    #[test]
    fn columns_are_words_with_units() {
        let of = case(MM, "[objective]\nmaximise = { quantity = 'pull' }");
        for (column, expected) in [
            ("pull", "Pulling force [N]"),
            ("mean_rise", "Mean rise [mm]"),
            ("time", "Pseudo-time"),
            ("displacement_arm_root_x", "Displacement of arm root in x [mm]"),
            ("reaction_arm_root_y", "Reaction of arm root in y [N]"),
            ("crown_force_z", "Contact force at crown in z [N]"),
            ("crown_peak_pressure", "Peak pressure at crown [MPa]"),
            ("crown_contact_area", "Contact area at crown [mm²]"),
            ("strain_energy_arm", "Strain energy arm [N mm]"),
            ("crown_open", "Crown open"),
        ] {
            assert_eq!(axis(&of, column), expected);
        }
        assert_eq!(axis(&case("", "[objective]\nmaximise = { quantity = 'pull' }"), "pull"), "Pulling force");
    }

    #[test]
    fn maximized_objectives_grow_upwards() {
        let of = |objective: &str| objective_axis(&case(MM, &format!("[objective]\n{objective}")));
        assert_eq!(
            of("maximise = { quantity = 'pull' }"),
            ObjectiveAxis { name: "Pulling force [N]".into(), negated: true }
        );
        assert_eq!(
            of("minimise = { quantity = 'mean_rise' }"),
            ObjectiveAxis { name: "Mean rise [mm]".into(), negated: false }
        );
        assert!(!of("follow = { quantity = 'pull', points = [[0.5, 1.0], [1.0, 2.0]] }").negated);
    }

    #[test]
    fn requested_points_lie_on_the_path() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("run.json"), "{}").expect("written");
        let table = "step,load_case,time,u,pull\n0,0,0.0,0.0,0.0\n1,0,0.5,3.0,1.0\n2,0,1.0,4.0,5.0\n";
        std::fs::write(folder.path().join("quantities.csv"), table).expect("written");
        let of = case(MM, "[objective]\nfollow = { quantity = 'pull', points = [[0.25, 1.0], [1.0, 2.0]] }");
        let found = requested(folder.path(), &of, ["u", "pull"]).expect("read").expect("a curve");
        assert_eq!(found.points, [[1.5, 1.0], [4.0, 2.0]]);
        assert_eq!(requested(folder.path(), &of, ["pull", "u"]).expect("read"), None);
    }
}
