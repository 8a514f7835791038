//! Ties next to contact: what commands and the report say of them.

use super::report::data;
use super::*;

/// A cap tied to the block of [`CASE`], which it presses; nothing is designed.
fn tied() -> Place {
    let cap = "[[body]]\nname = \"cap\"\nbox = { min = [0.6, 1.7, 0.3], max = [2.0, 2.2, 1.6], elements = [3, 1, 2] }\n\
               material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n\
               [[contact]]\nslave = \"cap_ymin\"\nmaster = \"block_ymax\"\ntied = true\n[[contact]]";
    let design = CASE.find("[design]").expect("a design");
    let place = Place::new();
    let text = CASE[..design].replacen("[[contact]]", cap, 1).replace("set = \"block_ymax\"", "set = \"cap_ymax\"");
    place.write("case.toml", &text);
    place
}

/// A tie has no friction and no contact pressure; its normal force is the column of that name.
#[test]
fn ties_are_printed_as_ties() {
    let place = tied();
    let told = place.good("solve case.toml").out;
    let line = |start: &str| told.lines().find(|line| line.trim_start().starts_with(start)).expect("a line").to_owned();
    let tie = line("tie at cap_ymin");
    let table = place.table("case_solve/quantities.csv");
    let value = |name: &str| {
        let column = table[0].iter().position(|known| known == name).expect("the column");
        number(&table[table.len() - 1][column])
    };
    let expected = format!(
        "normal force {:.6}, shear forces of the nodes {:.6}",
        value("cap_ymin_normal_force"),
        value("cap_ymin_friction_force")
    );
    assert!(tie.ends_with(&expected) && value("cap_ymin_normal_force") > 0.0, "{tie}\n{expected}");
    assert!(line("contact at block_ymin").contains(", friction "), "{told}");
    assert!(!told.contains("contact at cap_ymin"), "{told}");

    place.good("report case_solve");
    let page = data(&place.read("case_solve/report.html"));
    let pair = |number: usize| page["results"]["contact"]["rows"][number].clone();
    assert_eq!((&pair(0)[0], &pair(0)[5]), (&"cap_ymin on block_ymax (tie)".into(), &"".into()));
    assert_eq!(pair(1)[0], "block_ymin on slab_ymax");
    assert_ne!(pair(1)[5], "");
    // the view shows the contact of the block's nine nodes, not the traction of the tie
    let slaves = page["model"]["slaves"].as_str().expect("numbers").trim_end_matches('=').len() * 3 / 4;
    assert_eq!(slaves, 4 * 9);

    // a promise of its friction, as earlier versions wrote it, is not compared
    let promise = |what: &str| format!("[[promise]]\nquantity = \"cap_ymin_{what}\"\nvalues = [100.0]\n");
    let text = place.read("case.toml") + &promise("normal_force") + &promise("friction_force");
    place.write("case.toml", &text);
    let told = place.good("solve case.toml --force").out;
    let compared = told.split("compared with").nth(1).expect("a comparison");
    assert!(compared.contains("cap_ymin_normal_force") && !compared.contains("cap_ymin_friction_force"), "{told}");
}

/// The tie's tractions do not change a picture of the contact pressure, nor its scale: it is the picture
/// of a run without them.
#[test]
fn pictures_of_contact_leave_ties_out() {
    let place = tied();
    place.good("solve case.toml -q");
    let drawn = |line: &str, name: &str| {
        place.good(&format!("render case_solve {line} --out {name}"));
        std::fs::read(place.path(name)).expect("a picture")
    };
    let chosen = drawn("", "chosen.png");
    assert!(chosen == drawn("--field pressure --bodies block", "block.png"), "the cap is not drawn");
    // all tractions are in their own field
    assert!(drawn("--field traction", "traction.png") != chosen);
    // with the ties alone, they are what there is
    let only = place.read("case.toml").replace("friction = 0.3", "tied = true");
    place.write("only.toml", &only);
    place.good("solve only.toml -q");
    place.good("render only_solve --field pressure --out only.png");
}
