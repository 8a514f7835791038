//! What begins, ends or changes within the path, as a deck: supports, friction, press fits. Expected values: CalculiX
//! 2.20, and the same case before it was written.

use super::deck_out::{has_ccx, verified};
use super::*;

/// A bar that is bent and let go, then pulled from where it is, while a support keeps a side where it finds it.
const SUPPORTS: &str = r#"
[[body]]
name = "bar"
box = { min = [0, 0, 0], max = [4, 1, 1], elements = [8, 2, 2] }
material = { st_venant_kirchhoff = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[set]]
name = "root"
boxes = [{ min = [0, 0, 0], max = [0, 1, 1] }]
[[set]]
name = "side"
boxes = [{ min = [0.3, 0, 0], max = [4, 0, 1] }]
[[dirichlet]]
set = "root"
[[dirichlet]]
set = "bar_xmax"
components = ["y"]
until = 0.4
motion = [{ t = 0.4, u = [0, -0.2, 0] }]
[[dirichlet]]
set = "bar_xmax"
components = ["x"]
from = 0.6
motion = [{ t = 0.8, u = [0.05, 0, 0] }, { t = 1, u = [0.02, 0, 0] }]
[[dirichlet]]
set = "side"
components = ["z"]
from = 0.4
[[load]]
surface = "bar_zmax"
force = [0.1, 1, 0.5]
[load_path]
steps = 10
tolerance = { relative = 1e-10 }
"#;

/// A block that is pressed without friction and then dragged.
const FRICTION: &str = r#"
[[body]]
name = "low"
box = { min = [0, 0, 0], max = [2, 1, 2], elements = [4, 2, 4] }
material = { st_venant_kirchhoff = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "top"
box = { min = [0.5, 1, 0.5], max = [1.5, 2, 1.5], elements = [3, 2, 3] }
material = { st_venant_kirchhoff = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[contact]]
slave = "top_ymin"
master = "low_ymax"
friction = 0.3
friction_path = [{ t = 0.25, factor = 0 }, { t = 0.5, factor = 1 }, { t = 0.75, factor = 0.5 }]
surfaces = "faceted"
[[dirichlet]]
set = "low_ymin"
[[dirichlet]]
set = "top_ymax"
motion = [{ t = 0.25, u = [0, -0.05, 0] }, { t = 1, u = [0.3, -0.05, 0] }]
[load_path]
steps = 12
"#;

/// Half a bush with half a pin, which is oversized.
const FIT: &str = r#"
[[body]]
name = "bush"
half_ring = { inner_radius = 4.0, outer_radius = 8.0, width = 2.0, elements = [16, 4, 1] }
material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "pin"
half_ring = { inner_radius = 2.0, outer_radius = 4.0, width = 2.0, elements = [16, 3, 1] }
material = { linear_elastic = { youngs_modulus = 2000.0, poisson_ratio = 0.3 } }
[[symmetry]]
normal = "y"
[[contact]]
slave = "bush_inner"
master = "pin_outer"
friction = 0.0
surfaces = "faceted"
offset = [{ t = 0.5, offset = 0.02 }]
[[set]]
name = "far"
boxes = [{ min = [-9, -1, -1], max = [-7.9, 0.01, 1] }]
[[dirichlet]]
set = "far"
components = ["x"]
[[dirichlet]]
set = "bush_zmin"
components = ["z"]
[[dirichlet]]
set = "pin_zmin"
components = ["z"]
[[load]]
surface = "bush_outer"
pressure = 3.0
amplitude = [{ t = 0.5, factor = 0 }, { t = 1, factor = 1 }]
[load_path]
steps = 4
"#;

/// The last value of a column of a table whose name ends like this.
fn last(place: &Place, table: &str, column: &str) -> f64 {
    let table = place.table(table);
    let at = table[0].iter().position(|name| name == column).unwrap_or_else(|| panic!("{column} in {:?}", table[0]));
    number(&table[table.len() - 1][at])
}

/// Supports that begin late are written in their step, and an end as `OP=NEW` with all others; `FIXED` keeps what it
/// finds. Read again, the case is the same, and CalculiX agrees as with permanent supports.
#[test]
fn supports_begin_and_end_in_decks() {
    let place = Place::new();
    place.write("case.toml", SUPPORTS);
    place.good("export case.toml --deck deck");
    let deck = place.read("deck/model.inp");
    let (_, later) = deck.split_once("*BOUNDARY, OP=NEW\n").expect("a support ends");
    let boundary: Vec<&str> = later.lines().take_while(|line| *line != "*CLOAD").collect();
    let held = ["1, 1", "2, 2", "3, 3"].map(|c| format!("bar_root, {c}, 0.0"));
    assert_eq!(boundary[..3], held.each_ref().map(String::as_str));
    assert_eq!(boundary[3..], ["*BOUNDARY, FIXED", "bar_side, 3, 3"]);
    assert!(later.contains("*BOUNDARY\nbar_xmax_nodes, 1, 1, 0.05\n"), "{deck}");
    place.good("solve case.toml -q");
    place.good("solve deck/case.toml -q");
    for (own, again) in [
        ("reaction_root_x", "reaction_bar_root_x"),
        ("reaction_root_z", "reaction_bar_root_z"),
        ("reaction_bar_xmax_x", "reaction_bar_xmax_nodes_x"),
        ("reaction_side_z", "reaction_bar_side_z"),
        ("strain_energy", "strain_energy"),
    ] {
        let (own, again) =
            (last(&place, "case_solve/quantities.csv", own), last(&place, "deck/case_solve/quantities.csv", again));
        assert!(own != 0.0 && (own - again).abs() < 1e-8 * own.abs(), "{own} {again}");
    }
    // a step of the deck would end on the way to the first waypoint
    place.write("wrong.toml", &SUPPORTS.replace("t = 0.8", "t = 0.9").replace("until = 0.4", "until = 0.7"));
    place.bad("export wrong.toml --deck wrong", 2, &["dirichlet[2].motion", "t = 0.7", "add a waypoint there"]);
    if has_ccx() {
        let compared = verified(&place, "deck", "1e-3");
        assert!(compared["displacements"].as_f64().expect("a number") < 1e-5, "{compared}");
        assert!(compared["compared"].as_array().expect("rows").len() >= 5, "{compared}");
    }
}

/// A coefficient that changes linearly changes in each load step, and is never zero, which CalculiX refuses.
#[test]
fn friction_changes_in_decks() {
    let place = Place::new();
    place.write("case.toml", FRICTION);
    place.good("export case.toml --deck deck");
    let deck = place.read("deck/model.inp");
    assert_eq!(deck.matches("*CHANGE FRICTION, INTERACTION=interaction_1\n*FRICTION\n").count(), 6);
    place.good("solve case.toml -q");
    place.good("solve deck/case.toml -q");
    let own = last(&place, "case_solve/quantities.csv", "top_ymin_friction_force");
    let again = last(&place, "deck/case_solve/quantities.csv", "top_ymin_friction_force");
    assert!(own > 1.0 && (own - again).abs() < 1e-6 * own, "{own} {again}");
    if has_ccx() {
        verified(&place, "deck", "0.03");
    }
}

/// An interference is an overlap of the meshes, which CalculiX closes over the first step. The slave's radius then
/// grows by the interference, so that values differ by its ratio to the radius, 0.5 %.
#[test]
fn press_fits_in_decks() {
    let place = Place::new();
    place.write("case.toml", FIT);
    let written = place.good("export case.toml --deck deck");
    assert!(
        written.err.contains("contact[0].offset") && written.err.contains("moved outward by 0.02"),
        "{}",
        written.err
    );
    place.good("solve case.toml -q");
    place.good("solve deck/case.toml -q");
    let own = last(&place, "case_solve/quantities.csv", "bush_inner_normal_force");
    let again = last(&place, "deck/case_solve/quantities.csv", "bush_inner_normal_force");
    assert!(own > 10.0 && (own - again).abs() < 0.01 * own, "{own} {again}");
    let later = FIT.replace("offset = [{ t = 0.5", "offset = [{ t = 0.25, offset = 0 }, { t = 0.5");
    place.write("later.toml", &later);
    place.bad("export later.toml --deck later", 2, &["contact[0].offset", "give it one waypoint"]);
    if has_ccx() {
        verified(&place, "deck", "0.03");
    }
}

/// A load case that moves and turns a body starts there in its deck.
#[test]
fn moved_bodies_in_decks() {
    let cases = "[[load_case]]\nname = 'centre'\n[[load_case]]\nname = 'aside'\n\
                 bodies = [{ body = 'top', offset = [0.2, 0, -0.1], rotation = { point = [1, 0, 1], direction = [0, 1, 0], angle = 20 } }]\n";
    let text = FRICTION.replace("[load_path]", &format!("{cases}[load_path]"));
    let text = text.replace("friction_path = ", "# ").replace("steps = 12", "steps = 4");
    let place = Place::new();
    place.write("case.toml", &text);
    place.good("export case.toml --deck deck");
    place.good("solve case.toml -q");
    place.good("solve deck/case_aside.toml -q");
    for column in ["top_ymin_normal_force", "top_ymin_friction_force"] {
        let own = last(&place, "case_solve/quantities.csv", column);
        let again = last(&place, "deck/case_aside_solve/quantities.csv", column);
        assert!(own > 1.0 && (own - again).abs() < 1e-6 * own, "{column}: {own} {again}");
    }
    place.write("tied.toml", &text.replace("friction = 0.3", "tied = true").replace("surfaces = \"faceted\"", ""));
    place.bad("export tied.toml --deck tied", 2, &["load_case[1].bodies[0]", "but not ties", "a case of its own"]);
}

/// The values of a block of an `.frd` file at its last state, by node.
fn block(text: &str, name: &str, components: usize) -> Vec<(u32, Vec<f64>)> {
    let start = text.rfind(&format!("\n -4  {name} ")).unwrap_or_else(|| panic!("a block {name}"));
    let rows = text[start..].lines().skip(2).skip_while(|line| line.starts_with(" -5"));
    let value = |row: &str, c: usize| row[13 + 12 * c..25 + 12 * c].trim().parse().expect("a number");
    rows.take_while(|line| line.starts_with(" -1"))
        .map(|row| (row[3..13].trim().parse().expect("a node"), (0..components).map(|c| value(row, c)).collect()))
        .collect()
}

/// The result file of a run has the nodes, elements, displacements and forces of that which CalculiX writes for the same
/// deck, and stresses that differ as element means from extrapolated ones: the block is in uniform tension.
#[test]
fn result_files_are_those_of_calculix() {
    if !has_ccx() {
        return;
    }
    let text = "[[body]]\nname = 'block'\nbox = { min = [0, 0, 0], max = [2, 1, 1], elements = [2, 1, 1] }\nORDER\n\
                material = { st_venant_kirchhoff = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n\
                [[dirichlet]]\nset = 'block_xmin'\ncomponents = ['x']\n[[dirichlet]]\nset = 'block_ymin'\ncomponents = ['y']\n\
                [[dirichlet]]\nset = 'block_zmin'\ncomponents = ['z']\n\
                [[dirichlet]]\nset = 'block_xmax'\ncomponents = ['x']\nmotion = [{ t = 1, u = [0.1, 0, 0] }]\n\
                [load_path]\nsteps = 1\ntolerance = { relative = 1e-11 }\n";
    let second = "order = 2\nshape_functions = 'serendipity'\nelement = 'reduced'";
    for order in ["", second] {
        let place = Place::new();
        place.write("case.toml", &text.replace("ORDER", order));
        place.good("export case.toml --deck deck");
        verified(&place, "deck", "1e-3");
        place.good("export deck/case_solve --frd own.frd");
        let (own, theirs) = (place.read("own.frd"), place.read("deck/model.frd"));
        // nodes and elements, without the groups and materials of elements
        let part = |text: &str, from: &str| -> Vec<String> {
            let (_, rest) = text.split_once(&format!("\n    {from}C ")).expect("a block");
            let rows = rest.lines().skip(1).take_while(|line| *line != " -3");
            rows.map(|row| if from == "3" && row.starts_with(" -1") { row[..18].to_owned() } else { row.to_owned() })
                .collect()
        };
        // nodes of second order have other numbers when the deck is read again, in the same order
        let places = |text: &str| part(text, "2").iter().map(|row| row[13..].to_owned()).collect::<Vec<_>>();
        assert_eq!(places(&own), places(&theirs));
        assert!(order == second || (part(&own, "2"), part(&own, "3")) == (part(&theirs, "2"), part(&theirs, "3")));
        for (name, components, tolerance) in [("DISP", 3, 1e-5), ("FORC", 3, 1e-4), ("STRESS", 6, 1e-4)] {
            let (own, theirs) = (block(&own, name, components), block(&theirs, name, components));
            let size = theirs.iter().flat_map(|(_, values)| values).fold(0.0, |size: f64, value| size.max(value.abs()));
            assert!(own.len() == theirs.len() && size > 0.0);
            for ((node, a), (other, b)) in own.iter().zip(&theirs) {
                let differ = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(
                    (node == other || order == second) && differ <= tolerance * size,
                    "{name} {node} {other}: {a:?} {b:?}"
                );
            }
        }
    }
}
