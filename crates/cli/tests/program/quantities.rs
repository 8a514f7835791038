//! Quantities that a case names: printed, tabulated, maximized, bounded and verified.

use super::{CASE, Place, number};

/// The block drags the slab: the normal force is maximized with a bounded sideways reaction.
fn place() -> Place {
    let place = Place::new();
    let text = CASE
        .replace(
            "[objective]\ncontact_force = { steps = \"last\" }",
            "[objective]\nmaximise = { quantity = \"press\" }",
        )
        .replace("sensitivity_filter = { radius = 1.2 }\n", "")
        + r#"
[[quantity]]
name = "press"
contact_force = { slave = "block_ymin", component = "normal" }
[[quantity]]
name = "drag"
reaction = { set = "block_ymax", component = "x" }
[[quantity]]
name = "settlement"
displacement = { set = "slab_ymax", component = [0, -1, 0] }
[[quantity]]
name = "stress"
stress = { body = "slab" }
[[constraint]]
quantity = "drag"
max = 6.0
[[constraint]]
quantity = "settlement"
min = 0.01
steps = [2, 4]
"#;
    place.write("case.toml", &text);
    place
}

fn column(table: &[Vec<String>], name: &str) -> Vec<f64> {
    let at = table[0].iter().position(|known| known == name).unwrap_or_else(|| panic!("{name}: {:?}", table[0]));
    table[1..].iter().map(|row| row[at].parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn quantities_are_maximised_and_bounded() {
    let place = place();
    let told = place.good("optimize case.toml --iterations 12 --set optimizer.adaptive=false").out;
    let history = place.table("case/history.csv");
    let (drag, violation) = (column(&history, "drag"), column(&history, "violation"));
    let settlement = column(&history, "settlement_4");
    assert!(column(&history, "multiplier_drag").iter().take(12).all(|multiplier| *multiplier >= 0.0));
    for (n, violation) in violation.iter().enumerate() {
        let expected = (drag[n] / 6.0 - 1.0)
            .max(1.0 - settlement[n] / 0.01)
            .max(column(&history, "volume_fraction")[n] / 0.5 - 1.0);
        assert!((violation - expected.max(0.0)).abs() < 1e-9, "{n}: {violation} {expected}");
    }
    // the start design violates the bound, the last ones nearly meet it
    assert!(drag[0] > 6.1 && drag[12] < 6.05, "{drag:?}");
    let objective = column(&history, "objective");
    // the result is the best design that meets its constraints within a thousandth
    let feasible = (0..=12).filter(|&n| violation[n] <= 1e-3);
    let result = feasible.reduce(|a, b| if objective[b] < objective[a] { b } else { a }).expect("feasible designs");
    assert!(violation[12] > 1e-3 && place.json("case/result.json")["iteration"] == result, "{violation:?}");
    let quantities = place.table("case/quantities.csv");
    let press = column(&quantities, "press");
    assert!((press[4] + objective[result]).abs() < 1e-9 * press[4], "{press:?} {objective:?}");
    assert!((column(&quantities, "drag")[4] - drag[result]).abs() < 1e-9);
    assert!((column(&quantities, "reaction_block_ymax_x")[4] - drag[result]).abs() < 1e-9);
    assert!(told.contains("  press ") && told.contains("  stress "), "{told}");
    place.good("render case --curve drag press --out curve.png");
    assert!(place.path("curve.png").is_file());
}

/// One iteration with a move limit of 0.1 leads from half of the material to two fifths at best, not to
/// one fifth. The warning states the violation of the last design, V / V_max − 1 with V from the history.
#[test]
fn a_design_that_violates_its_constraints_is_warned_of() {
    let place = Place::with("volume_fraction = 0.5", "volume_fraction = 0.2");
    let told = place.good("optimize case.toml --iterations 1").err;
    let violation = column(&place.table("case/history.csv"), "volume_fraction")[1] / 0.2 - 1.0;
    assert!(violation > 0.99, "{violation}");
    let expected = format!("the design violates its constraints: the largest relative violation is {violation:.3} (");
    assert!(told.contains(&expected), "{expected}\n{told}");
}

/// Stopped after some iterations and resumed, an optimization with constraints is the uninterrupted
/// one.
#[test]
fn constrained_optimizations_resume_bit_for_bit() {
    let place = place();
    place.good("optimize case.toml --iterations 5 --out whole");
    place.good("optimize case.toml --iterations 2 --out part");
    place.good("resume part --iterations 5");
    assert_eq!(place.read("whole/design.csv"), place.read("part/design.csv"));
    let without_seconds = |text: String| -> Vec<String> {
        text.lines().map(|line| line.rsplit_once(',').map_or(String::new(), |(cells, _)| cells.to_owned())).collect()
    };
    assert_eq!(without_seconds(place.read("whole/history.csv")), without_seconds(place.read("part/history.csv")));
    assert_eq!(place.read("whole/quantities.csv"), place.read("part/quantities.csv"));
}

#[test]
fn all_quantities_are_verified_unless_chosen() {
    let place = place();
    let line = "verify gradient case.toml --elements 1 --directions 1 --halvings 2";
    let told = place.good(line).out;
    for name in ["objective", "press", "drag", "settlement", "stress"] {
        assert!(told.contains(&format!("{name} ")), "{name}: {told}");
    }
    let checks = place.json("case_verify/verify.json")["checks"].clone();
    assert_eq!(checks.as_array().map(Vec::len), Some(5));
    place.good(&format!("{line} --quantity stress --force"));
    assert_eq!(place.json("case_verify/verify.json")["checks"][0]["quantity"], "stress");
    place.bad(&format!("{line} --quantity strss --force"), 2, &["no quantity called `strss`", "press, drag"]);
}

/// `evaluate` prints the quantities that the case names, once for each coefficient of friction.
#[test]
fn evaluate_prints_quantities_of_the_case() {
    let place = place();
    place.good("solve case.toml");
    let ran = place.good("evaluate case.toml --design case_solve --friction 0,0.3");
    let header = ran.out.lines().find(|line| line.contains("objective/volume")).expect("a header");
    let names: Vec<&str> = header.split_whitespace().skip(7).collect();
    assert_eq!(names, ["press", "drag", "settlement", "stress"], "{header}");
    let table = place.table("case_evaluate/quantities.csv");
    let (drag, steps) = (column(&table, "drag"), column(&table, "step"));
    let last: Vec<f64> = drag.iter().zip(&steps).filter(|(_, step)| **step == 4.0).map(|(drag, _)| *drag).collect();
    assert_eq!(last.len(), 2);
    for (value, friction) in last.iter().zip(["0", "0.3"]) {
        let row = ran.out.lines().find(|line| line.split_whitespace().next() == Some(friction)).expect("a row");
        let printed: f64 = row.split_whitespace().nth(7).expect("drag").parse().expect("a number");
        assert!((printed - value).abs() <= 1e-6 * value.abs().max(1.0), "{row} {value}");
    }
}

/// `solve` prints the key quantities at the end of each load case.
#[test]
fn solve_summarises_each_load_case() {
    let place = place();
    let cases = "\n[[load_case]]\nname = \"light\"\nmotion_factor = 0.5\n[[load_case]]\nname = \"heavy\"\n";
    place.write("case.toml", &(place.read("case.toml") + cases));
    let told = place.good("solve case.toml").out;
    let table = place.table("case_solve/quantities.csv");
    let (press, steps) = (column(&table, "press"), column(&table, "step"));
    for (name, step) in [("light", 4.0), ("heavy", 8.0)] {
        let part = told.split(&format!("at the end of load case {name}:")).nth(1).expect("a summary");
        let line = part.lines().find(|line| line.trim_start().starts_with("press ")).expect("press");
        let printed: f64 = line.split_whitespace().nth(1).expect("a value").parse().expect("a number");
        let row = steps.iter().position(|&known| known == step).expect("a row");
        assert!((printed - press[row]).abs() <= 1e-6 * press[row].abs(), "{name}: {line} {}", press[row]);
    }
}

/// A block slides on two others, with a coefficient of friction of its own on each: the second pair
/// has a surface with the same facets as its slave. All nodes that touch slide, so friction is μ times
/// the normal force.
#[test]
fn a_slave_has_its_own_friction_on_each_master() {
    let place = Place::new();
    place.write("case.toml", TWO_MASTERS);
    let quantities = place.good("--json solve case.toml").event("result")["quantities"].clone();
    for (slave, friction) in [("top_ymin", 0.1), ("top_second", 0.4)] {
        let [normal, tangential] =
            ["normal", "friction"].map(|of| quantities[format!("{slave}_{of}_force")].as_f64().expect("a force"));
        assert!(normal > 1.0 && (tangential / normal - friction).abs() < 1e-6, "{slave}: {tangential} of {normal}");
    }
    let same = TWO_MASTERS.replace("slave = \"top_second\"", "slave = \"top_ymin\"");
    place.write("case.toml", &same);
    place.bad("check case.toml", 2, &["is the slave of contact[0] too", "give the slave a second name"]);
}

const TWO_MASTERS: &str = r#"[[body]]
name = "left"
box = { min = [0, 0, 0], max = [2, 1, 1], elements = [4, 2, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "right"
box = { min = [2.2, 0, 0], max = [4, 1, 1], elements = [4, 2, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "top"
box = { min = [0.5, 1, 0.1], max = [3.5, 1.6, 0.9], elements = [6, 2, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[surface]]
name = "top_second"
of = ["top_ymin"]
[[contact]]
slave = "top_ymin"
master = "left_ymax"
friction = 0.1
[[contact]]
slave = "top_second"
master = "right_ymax"
friction = 0.4
[[dirichlet]]
set = "left_ymin"
[[dirichlet]]
set = "right_ymin"
[[dirichlet]]
set = "top_ymax"
motion = [{ t = 1, u = [0.05, -0.03, 0] }]
[load_path]
steps = 3
"#;

/// The coefficients that are asked for count in load cases with one of their own too; a grid over friction, which
/// would have no effect there, is refused.
#[test]
fn friction_of_load_cases() {
    let place = Place::new();
    let all = place.read("case.toml");
    let cases = "[[load_case]]\nname = \"dry\"\nfriction = 0.6\n[[load_case]]\nname = \"oiled\"\nfriction = 0.1\n";
    place.write("cases.toml", &format!("{all}{cases}"));
    place.good("solve cases.toml -q");
    place.good("evaluate cases.toml --design cases_solve/design.csv --friction 0.1,0.6 -q");
    place.good("solve case.toml --set contact[0].friction=0.6 --design cases_solve/design.csv -q");
    let force = |file: &str, step: usize| -> Vec<String> {
        let table = place.table(file);
        let at = |name: &str| table[0].iter().position(|of| of == name).expect("a column");
        let rows = table.iter().skip(1).filter(|row| row[at("step")] == step.to_string());
        rows.map(|row| row[at("block_ymin_friction_force")].clone()).collect()
    };
    let (dry, both) = (force("case_solve/quantities.csv", 4), force("cases_evaluate/quantities.csv", 4));
    assert_eq!((both.len(), number(&both[1])), (2, number(&dry[0])), "0.6 in the first load case");
    let oiled = force("cases_evaluate/quantities.csv", 8);
    assert_eq!(
        (number(&oiled[0]), number(&oiled[1])),
        (number(&both[0]), number(&both[1])),
        "all load cases are alike"
    );
    let study =
        "[[run]]\nname = \"mu\"\ncommand = \"solve\"\ncase = \"cases.toml\"\ngrid = { friction = [0.1, 0.2] }\n";
    place.write("study.toml", study);
    place.bad("study study.toml", 2, &["the load case `dry` of `mu_0.1` sets its own", "load_case[…].friction"]);
}

/// A node that is a slave in two pairs counts once: the second pair, of the same slave surface with a side that it
/// never reaches, changes nothing.
#[test]
fn slave_nodes_of_two_pairs_count_once() {
    let objective = |further: &str| {
        let place =
            Place::with("[[dirichlet]]\nset = \"slab_ymin\"", &format!("{further}[[dirichlet]]\nset = \"slab_ymin\""));
        let result = place.good("optimize case.toml --iterations 1 --json").event("result");
        result["objective"].as_f64().expect("a number")
    };
    let once = objective("");
    let twice = objective(
        "[[surface]]\nname = \"sole\"\nof = [\"block_ymin\"]\n\
         [[contact]]\nslave = \"sole\"\nmaster = \"slab_xmax\"\nfriction = 0.3\n",
    );
    assert!((once - twice).abs() < 1e-8 * once.abs(), "{once} {twice}");
}
