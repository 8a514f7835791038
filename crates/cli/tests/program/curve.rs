//! `render --curve`: quantities of a path over each other.

use super::Place;

/// Curves of two runs in one chart, and the refusals of columns, runs and titles that do not fit.
#[test]
fn curves_are_drawn() {
    let place = Place::new();
    place.good("solve case.toml -q");
    place.good("solve case.toml -q --set contact[0].friction=0.1 --out less");
    let told = place.good("render case_solve --curve displacement_block_ymax_y reaction_block_ymax_y").out;
    assert!(told.starts_with("reaction_block_ymax_y over displacement_block_ymax_y in case_solve/curve.png"), "{told}");
    assert!(place.path("case_solve/curve.png").is_file());
    place.good("render case_solve less --curve time block_ymin_normal_force --title Forces --out both.png");
    assert!(place.path("both.png").is_file());
    let known = ["quantities.csv: has no column `tim`", "available: step, load_case, time, displacement_slab"];
    place.bad("render case_solve --curve tim strain_energy", 2, &known);
    place.bad(
        "render case_solve less --curve time strain_energy",
        2,
        &["the chart needs a file name", "--out curve.png"],
    );
    place.bad("render case_solve --title Forces", 2, &["only charts have titles", "--history or --curve"]);
    place.good("verify gradient case.toml --elements 1 --directions 1 --halvings 1 -q");
    place.bad("render case_verify --curve time strain_energy", 2, &["no quantities.csv", "a run of `solve`"]);
}

/// The printed key values are those of the last row of `quantities.csv`.
#[test]
fn key_quantities_are_printed() {
    let place = Place::new();
    let told = place.good("solve case.toml").out;
    let table = place.read("case_solve/quantities.csv");
    let (names, last) = (table.lines().next().expect("names"), table.lines().last().expect("values"));
    let value = |name: &str| -> f64 {
        let column = names.split(',').position(|known| known == name).expect("the column");
        last.split(',').nth(column).and_then(|cell| cell.parse().ok()).expect("a number")
    };
    let line = told.lines().find(|line| line.contains("reaction of block_ymax")).expect("the line");
    let printed: f64 = line.split("y ").nth(1).and_then(|rest| rest.split(',').next()?.parse().ok()).expect("y");
    assert!((printed - value("reaction_block_ymax_y")).abs() < 1e-5, "{line}");
    assert!(value("reaction_block_ymax_y") < 0.0 && value("strain_energy") > 0.0);
    assert!(told.contains("contact at block_ymin") && told.contains("external work"), "{told}");
}
