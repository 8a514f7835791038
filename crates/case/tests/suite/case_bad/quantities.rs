//! Mistakes in quantities, objectives and constraints: one error each, with the place and the
//! remedy.

use super::{GOOD, errors};
use crate::build;
use slipstick_case::construct::optimization;
use slipstick_case::file::{CaseCode, parse_case};

const QUANTITIES: &str = r#"
[[quantity]]
name = "grip"
contact_force = { slave = "ball_dome", component = "normal" }
[[quantity]]
name = "push"
reaction = { set = "ball_flat", component = "y" }
[[constraint]]
quantity = "push"
max = 5.0
"#;

fn with(from: &str, to: &str) -> String {
    let text = GOOD.replace("[objective]\ncontact_force = { steps = \"last\" }\n", "") + QUANTITIES;
    let text = text + "[objective]\nmaximise = { quantity = \"grip\", steps = \"all\" }\n";
    assert!(from.is_empty() || text.contains(from), "{from}");
    text.replace(from, to)
}

#[test]
fn one_mistake_is_one_error() {
    parse_case(&with("", ""), "case.toml").expect("right");
    for (from, to, code, message, help) in [
        ("normal", "nomral", CaseCode::UnknownWord, "`component` cannot be `nomral`", "normal"),
        ("\"ball_dome\", component", "\"plate_ymax\", component", CaseCode::UnknownSet, "not the slave", "ball_dome"),
        (
            "\"ball_flat\", component",
            "\"ball_flta\", component",
            CaseCode::UnknownSet,
            "no surface or set",
            "ball_flat",
        ),
        (
            "reaction = { set = \"ball_flat\", component = \"y\" }",
            "mass = { mass_density = 0 }",
            CaseCode::OutOfRange,
            "`mass_density` must be positive",
            "kg/mm³",
        ),
        (", component = \"y\"", "", CaseCode::MissingKey, "`component`", "a direction [x, y, z]"),
        (
            "reaction = { set = \"ball_flat\", component = \"y\" }",
            "contact_pressure = { slave = \"ball_dome\", measure = \"spread\", sharpness = 9 }",
            CaseCode::ChooseOne,
            "`sharpness` has no effect",
            "remove it, or choose the measure \"peak\" or \"minimum\"",
        ),
        ("component = \"y\"", "component = [0, 0, 0]", CaseCode::OutOfRange, "zero vector", "[0, 1, 0]"),
        (
            "name = \"push\"",
            "name = \"grip\"",
            CaseCode::DuplicateName,
            "two quantities are called `grip`",
            "different",
        ),
        ("quantity = \"push\"", "quantity = \"pull\"", CaseCode::UnknownSet, "no quantity called `pull`", "push"),
        ("max = 5.0", "", CaseCode::MissingKey, "the constraint has no bound", "max, min"),
        ("max = 5.0", "max = 5.0\nmin = 6.0", CaseCode::OutOfRange, "at least 6 and at most 5", "swap"),
        ("max = 5.0", "max = 5.0\nsteps = [11]", CaseCode::Steps, "load step 11", ""),
        ("maximise", "maximize", CaseCode::UnknownKey, "unknown key `maximize`", "maximise"),
        ("quantity = \"grip\", steps", "sum = [], steps", CaseCode::Empty, "no term", "sum = ["),
        (
            "maximise = { quantity = \"grip\", steps = \"all\" }",
            "follow = { quantity = \"grip\", points = [[0.5, 1], [0.4, 2]] }",
            CaseCode::OutOfRange,
            "0.4 is not above 0.5",
            "in the order",
        ),
    ] {
        let found = errors(&with(from, to));
        let [error] = found.diagnostics() else { panic!("{to}: {found}") };
        assert_eq!(error.code(), code, "{error}");
        assert!(error.to_string().contains(message), "{to}: {error}");
        assert!(error.help().contains(help), "{to}: {}", error.help());
    }
}

/// Quantities that the design cannot change are refused when the case is built.
#[test]
fn constant_quantities_are_refused() {
    for (from, to, message) in [
        (
            "reaction = { set = \"ball_flat\"",
            "reaction = { set = \"plate_xmax\"",
            "no such component is prescribed at `plate_xmax`",
        ),
        (
            "reaction = { set = \"ball_flat\"",
            "displacement = { set = \"ball_flat\"",
            "is prescribed, so it does not depend",
        ),
        (
            "reaction = { set = \"ball_flat\", component = \"y\" }",
            "compliance = {}",
            "has no load, so its compliance is always 0",
        ),
        (
            "reaction = { set = \"ball_flat\", component = \"y\" }",
            "external_work = { set = \"plate_xmax\" }",
            "no load and no prescribed motion acts on `plate_xmax`, so their work is always 0",
        ),
        (
            "reaction = { set = \"ball_flat\", component = \"y\" }",
            "displacement = { set = \"plate_xmax\", component = \"x\", relative_to = \"plate_xmax\" }",
            "does not move relative to itself",
        ),
        (
            "reaction = { set = \"ball_flat\", component = \"y\" }",
            "volume = { body = \"ball\" }",
            "`ball` is not designed, so its volume does not change",
        ),
        (
            "reaction = { set = \"ball_flat\", component = \"y\" }",
            "mass = { body = \"ball\", mass_density = 1.2e-6 }",
            "`ball` is not designed, so its volume does not change",
        ),
        (
            "reaction = { set = \"ball_flat\", component = \"y\" }",
            "stress = { within = [{ min = [9, 9, 9], max = [10, 10, 10] }] }",
            "no element has its centroid in these boxes",
        ),
        ("\"push\"", "\"strain_energy\"", "`strain_energy` is the name of a column that every run writes"),
        ("\"push\"", "\"violation\"", "`violation` is the name of a column that every run writes"),
    ] {
        let case = parse_case(&with(from, to), "case.toml").expect("read").case;
        let error = build(&case).err().expect("refused");
        assert!(error.path.starts_with("quantity[1].") && error.message.contains(message), "{error}");
    }
}

/// The resolved case is a case file that gives the same case, and an optimization needs a bound.
#[test]
fn resolved_quantities_can_be_read_again() {
    let resolved = parse_case(&with("", ""), "case.toml").expect("right").case;
    let text = toml::to_string(&resolved).expect("TOML");
    let again = parse_case(&text, "again.toml").unwrap_or_else(|errors| panic!("{errors}\n{text}")).case;
    assert_eq!(resolved, again);
    // a design without a bound has no use for material
    let free = with("volume_fraction = 0.3\n", "").replace("[[constraint]]\nquantity = \"push\"\nmax = 5.0\n", "");
    let found = errors(&free);
    let [error] = found.diagnostics() else { panic!("{found}") };
    assert!(error.help().contains("[[constraint]]"), "{error}");
    let bounded = with("volume_fraction = 0.3\n", "");
    let case = parse_case(&bounded, "case.toml").expect("bounded by a constraint").case;
    optimization(&case, build(&case).expect("builds")).expect("needs no bound on the volume");
}

/// Bounds of several tables on one quantity have different names, and the same bound twice is
/// refused.
#[test]
fn bounds_have_names_of_their_own() {
    let table = |bound: &str| format!("[[constraint]]\nquantity = \"push\"\nmax = 5.0\n{bound}");
    let replaced = |bounds: &str| {
        let text = with("[[constraint]]\nquantity = \"push\"\nmax = 5.0\n", &table(bounds));
        build(&parse_case(&text, "case.toml").expect("read").case)
    };
    let problem =
        replaced("[[constraint]]\nquantity = \"push\"\nmin = 1.0\n").unwrap_or_else(|error| panic!("{error}"));
    let names: Vec<&str> = problem.analysis.constraints.iter().map(|of| of.response.name()).collect();
    let last = problem.analysis.times.len();
    assert!(
        names.contains(&&*format!("push_max_{last}")) && names.contains(&&*format!("push_min_{last}")),
        "{names:?}"
    );
    let error = replaced("[[constraint]]\nquantity = \"push\"\nmax = 4.0\n").err().expect("refused");
    let message = format!("two bounds have the name `push_max_{last}`");
    assert!(error.path.starts_with("constraint[") && error.message.contains(&message), "{error}");
}
