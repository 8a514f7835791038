//! Pictures of results.

use super::*;

/// Width and height of a PNG file: the first chunk, IHDR, begins with them (PNG specification,
/// 11.2.2).
fn size(bytes: &[u8]) -> (u32, u32) {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "the signature");
    assert_eq!(&bytes[12..16], b"IHDR");
    let number = |at: usize| u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    (number(16), number(20))
}

fn drawn(place: &Place, line: &str, file: &str) -> Vec<u8> {
    place.good(line);
    std::fs::read(place.path(file)).unwrap_or_else(|error| panic!("{line}: {file}: {error}"))
}

/// Without options: the newest design, deformed at the last step, in the run's directory.
#[test]
fn the_newest_design_by_default() {
    let place = Place::new();
    place.good("optimize case.toml -q");
    let ran = place.good("render case");
    assert!(ran.out.contains("case/picture.png"), "{}", ran.out);
    let picture = std::fs::read(place.path("case/picture.png")).expect("drawn");
    assert_eq!(size(&picture), (900, 720));
    let last = drawn(&place, "render case --field density --step 4 --out step.png", "step.png");
    assert!(last == drawn(&place, "render case --field density --out newest.png", "newest.png"), "the last step");
    assert!(picture != drawn(&place, "render case --deformed 0 --out flat.png", "flat.png"), "undeformed differs");

    // A path that does not belong to the newest design is not shown with it.
    let table = place.read("case/design.csv");
    let row = table.lines().nth(4).expect("element 3");
    place.write("case/design.csv", &table.replace(row, "3,slab,0.9"));
    assert!(picture != drawn(&place, "render case", "case/picture.png"));
    place.bad("render case --deformed 2", 2, &["no displacements of this design"]);

    // The elements have their densities as colours; a surface at a given density is another one.
    let flat = drawn(&place, "render case --deformed 0 --out flat.png", "flat.png");
    assert!(flat == drawn(&place, "render case --smooth --deformed 0 --out smooth.png", "smooth.png"));
    assert!(flat != drawn(&place, "render case --field density --deformed 0 --out bricks.png", "bricks.png"));
    assert!(flat != drawn(&place, "render case --smooth --threshold 0.3 --deformed 0 --out low.png", "low.png"));
    place.bad("render case --smooth --threshold 1", 2, &["density"]);

    // The picture belongs to the run: a new run removes it.
    place.good("optimize case.toml -q --force --iterations 1");
    assert!(!place.path("case/picture.png").exists());
}

#[test]
fn fields_steps_and_views() {
    let place = Place::new();
    place.good("optimize case.toml -q");
    let mut seen = Vec::new();
    for field in ["density", "pressure", "contact_gap", "displacement", "derivative", "body", "traction"] {
        let line = format!("render case --field {field} --size 300x200 --out {field}.png");
        let picture = drawn(&place, &line, &format!("{field}.png"));
        assert_eq!(size(&picture), (300, 200));
        assert!(!seen.contains(&picture), "{field} looks like another");
        seen.push(picture);
    }
    let first = drawn(&place, "render case --iteration 0 --threshold 0 --out a.png", "a.png");
    let second = drawn(&place, "render case --iteration 2 --threshold 0 --out b.png --view top", "b.png");
    assert!(first != second);
    // An initial design below the default threshold is shown whole.
    place.good("solve case.toml -q --set design.initial=0.4");
    let whole = drawn(&place, "render case_solve --threshold 0 --out whole.png", "whole.png");
    assert!(whole == drawn(&place, "render case_solve --out grey.png", "grey.png"));
    assert!(whole != drawn(&place, "render case_solve --threshold 0.5 --out none.png", "none.png"));
    let event = place.good("render case --json").event("result");
    assert_eq!(event["file"], "case/picture.png");
}

/// If nothing is designed, densities would give a single colour, so contact pressure or
/// displacement is drawn instead, with a message.
#[test]
fn a_field_is_chosen_where_nothing_is_designed() {
    let place = Place::new();
    let design = CASE.find("[design]").expect("a design");
    place.write("case.toml", &CASE[..design]);
    place.good("solve case.toml -q");
    let ran = place.good("render case_solve");
    let expected = "contact_pressure in case_solve/picture.png (no body is designed; --field draws another field)";
    assert_eq!(ran.out.trim(), expected);
    let chosen = std::fs::read(place.path("case_solve/picture.png")).expect("drawn");
    assert!(chosen == drawn(&place, "render case_solve --field pressure --out pressure.png", "pressure.png"));
    assert!(chosen != drawn(&place, "render case_solve --field density --out density.png", "density.png"));
    let event = place.good("render case_solve --json").event("result");
    assert_eq!(event["field"], "contact_pressure");

    place.write("away.toml", &CASE[..design].replace("-0.1", "0.1"));
    place.good("solve away.toml -q");
    assert!(
        place.good("render away_solve").out.starts_with("displacement in away_solve/picture.png (no body is designed;")
    );
    // at rest there is nothing else to draw
    assert_eq!(place.good("render away_solve --step 0").out.trim(), "density in away_solve/picture.png");

    // full material everywhere also gives a single colour; a design does not
    place.write("full.toml", CASE);
    place.good("solve full.toml -q --set design.initial=1.0 --out full");
    assert!(place.good("render full").out.contains("contact_pressure in full/picture.png (all densities are 1;"));
    place.good("solve full.toml -q --out grey");
    assert_eq!(place.good("render grey").out.trim(), "density in grey/picture.png");
}

#[test]
fn what_cannot_be_drawn() {
    let place = Place::new();
    place.good("optimize case.toml -q");
    place.bad("render case --field colour", 2, &["no field `colour` in case", "contact_pressure, ", "density"]);
    place.bad("render case --field contact", 2, &["no field `contact`"]);
    place.bad("render case --iteration 2 --field pressure", 2, &["design_0002.vtu", "objective_derivative"]);
    place.bad("render case --step 9", 2, &["case has no load step 9", "available: 0 to 4"]);
    place.bad("render case --iteration 1", 2, &["case has no iteration 1", "available: 0, 2, 4"]);
    place.bad("render case --view inside", 2, &["no view `inside`", "iso_below"]);
    place.bad("render case --iteration 2 --deformed 3", 2, &["no displacements"]);
    place.bad("render case --size 0x5", 2, &["at least 160x120"]);
    place.bad("render case --size large", 2, &["900x720"]);
    place.bad("render case --step 1 --iteration 1", 2, &["cannot be used with"]);
    place.bad("render case --threshold 2", 2, &["from 0 to 1"]);
    place.bad("render case --out case.toml", 2, &["case.toml does not end in .png"]);
    place.write("notes.png", "mine");
    place.bad("render case --out notes.png", 2, &["notes.png exists and is not a picture"]);
    assert_eq!(place.read("notes.png"), "mine");
    place.bad("render nowhere", 2, &["there is no run.json in nowhere"]);

    let bytes = std::fs::read(place.path("case/path_0004.vtu")).expect("written");
    std::fs::write(place.path("case/path_0004.vtu"), &bytes[..bytes.len() / 2]).expect("written");
    place.bad("render case", 2, &["path_0004.vtu", "ends early"]);
}

/// The history of a run goes to its directory; those of several go to a file, from directories and
/// tables alike.
#[test]
fn histories_in_one_frame() {
    let place = Place::new();
    place.good("optimize case.toml -q");
    place.good("optimize case.toml -q --out smooth --set contact[0].friction=0");
    let ran = place.good("render case --history --size 320x240");
    assert!(ran.out.contains("histories of case in case/history.png"), "{}", ran.out);
    let one = std::fs::read(place.path("case/history.png")).expect("drawn");
    assert_eq!(size(&one), (320, 240));
    let two = drawn(&place, "render case smooth --history --size 320x240 --out two.png", "two.png");
    assert!(one != two);
    let event = place.good("render case smooth --history --out two.png --json").event("result");
    assert_eq!(event["runs"].to_string(), r#"["case","smooth"]"#);

    // The same numbers in a table, except for the volume bound, which a table does not contain.
    let mut table = String::new();
    for name in ["smooth", "case"] {
        let text = place.read(&format!("{name}/history.csv"));
        let mut lines = text.lines();
        let header = lines.next().expect("a header");
        if table.is_empty() {
            table = format!("run,{header}\n");
        }
        lines.for_each(|line| table += &format!("{name},{line}\n"));
    }
    place.write("all.csv", &table);
    let rows = drawn(&place, "render all.csv --history --runs case,smooth --out rows.png", "rows.png");
    let apart = drawn(&place, "render case/history.csv smooth/history.csv --history --out apart.png", "apart.png");
    assert!(rows != apart, "names differ");
    place.write("case.csv", &place.read("case/history.csv"));
    place.write("smooth.csv", &place.read("smooth/history.csv"));
    let named = drawn(&place, "render case.csv smooth.csv --history --out named.png", "named.png");
    assert!(named == rows, "the same runs");
    let told = place.good("render all.csv case --history --out more.png");
    assert!(told.out.contains("histories of smooth, all.csv: case, case in more.png"), "{}", told.out);

    place.bad("render case smooth", 2, &["2 results were given for one picture", "--history"]);
    place.bad("render all.csv", 2, &["all.csv is a table", "--history"]);
    place.bad("render case smooth --history", 2, &["the chart needs a file name", "--out"]);
    place.bad("render case case --history --out c.png", 2, &["case is given twice"]);
    place.bad("render all.csv --history --runs rough --out c.png", 2, &["no run is called `rough`", "smooth, case"]);
    place.bad("render case --history --view top", 2, &["cannot be used with"]);
    place.bad("render case --title Title", 2, &["--history"]);
    place.bad(
        "render case/design.csv --history --out c.png",
        2,
        &["design.csv: line 1: there is no column `iteration`"],
    );
    place.bad("render none.csv --history --out c.png", 2, &["cannot read none.csv"]);
    place.good("solve case.toml -q");
    place.bad("render case_solve --history", 2, &["there is no history.csv in case_solve", "optimization"]);
    // The chart belongs to the run: a new run removes it.
    place.good("optimize case.toml -q --force --iterations 1");
    assert!(!place.path("case/history.png").exists());
}

/// Only the named bodies are drawn.
#[test]
fn bodies_that_are_shown() {
    let place = Place::new();
    place.good("optimize case.toml -q");
    let whole = drawn(&place, "render case --view top --out whole.png", "whole.png");
    let slab = drawn(&place, "render case --view top --bodies slab --out slab.png", "slab.png");
    assert!(whole != slab, "without the body above");
    let names: Vec<String> = place.json("case/run.json")["case"]["body"]
        .as_array()
        .expect("bodies")
        .iter()
        .map(|body| body["name"].as_str().expect("a name").to_owned())
        .collect();
    assert!(names.len() == 2 && names.contains(&"slab".to_owned()), "{names:?}");
    let pressure = drawn(&place, "render case --field pressure --out pressure.png", "pressure.png");
    let other = drawn(&place, "render case --field pressure --bodies slab --out other.png", "other.png");
    assert!(pressure != other, "the slave body by default");
    place.bad("render case --bodies slap", 2, &["there is no body `slap`", &names.join(", ")]);
    place.bad("render case --smooth --bodies slap", 2, &["there is no body `slap`"]);
}
