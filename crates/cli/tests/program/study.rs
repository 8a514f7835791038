//! `study`, and replacing values with `--set`.

use super::{CASE, Place};

const STUDY: &str = r#"title = "Two frictions"
expected = "expected.json"
set = ["load_path.steps = 2", "optimizer.iterations = 2"]
[[run]]
name = "rough"
command = "optimize"
case = "case.toml"
mirror = ["x", "z"]
half_turn = ["y"]
[[run]]
name = "smooth"
command = "optimize"
case = "case.toml"
set = ["contact[0].friction = 0"]
[[run]]
name = "table"
command = "evaluate"
case = "case.toml"
design = "rough"
options = ["--friction", "0,0.3"]
[[picture]]
of = "rough"
file = "pictures/rough.png"
options = ["--size", "160x120"]
[[chart]]
of = ["rough", "smooth"]
file = "pictures/both.png"
title = "Two frictions"
options = ["--size", "320x240"]
"#;

fn place(expected: &str) -> Place {
    let place = Place::new();
    place.write("study.toml", STUDY);
    place.write("expected.json", expected);
    place
}

#[test]
fn values_are_set_on_the_command_line() {
    let place = Place::new();
    let ran = place.good("solve case.toml --set contact[0].friction=0 --set load_path.steps=2");
    assert_eq!(ran.out.matches("  step ").count(), 2, "{}", ran.out);
    let text = CASE.replace("friction = 0.3", "friction = 0").replace("steps = 4", "steps = 2");
    assert_eq!(place.read("case_solve/case.toml"), text, "the run keeps the case that was run");
    place.bad(
        "solve case.toml --set contact[3].friction=0",
        2,
        &["case.toml: cannot set `contact[3]", "contact has 1 entry"],
    );
    place.bad(
        "solve case.toml --set contact[0].frictio=0",
        2,
        &["case.toml (with --set):", "did you mean `friction`?"],
    );
    place.bad("solve case.toml --set contact[0].friction", 2, &["not of the form KEY=VALUE"]);
    // An optimization is resumed with the case that it was started with.
    place.good("optimize case.toml --set contact[0].friction=0 --iterations 1");
    place.good("resume case --iterations 2");
    assert_eq!(place.json("case/run.json")["case"]["contact"][0]["friction"], 0.0);
}

/// Before anything runs, the cases of all runs are read with their replaced values.
#[test]
fn replaced_values_are_checked_first() {
    let place = place("{}");
    place.write("study.toml", &STUDY.replace("contact[0].friction = 0", "contact[0].frictio = 0"));
    place.bad("study study.toml --plan", 2, &["run `smooth`", "did you mean `friction`?"]);
}

/// A bound that no iteration meets: the table shows the violation, and no best objective.
#[test]
fn the_best_design_is_a_feasible_one() {
    let place = Place::new();
    let bound = "[[quantity]]\nname = \"peak\"\ncontact_pressure = { slave = \"block_ymin\", measure = \"peak\" }\n\
                 [[constraint]]\nquantity = \"peak\"\nmax = 1e-6\n";
    place.write("case.toml", &place.read("case.toml").replacen("[objective]", &format!("{bound}[objective]"), 1));
    place.write("study.toml", "[[run]]\nname = \"tight\"\ncommand = \"optimize\"\ncase = \"case.toml\"\noptions = [\"--iterations\", \"1\"]\n");
    place.good("study study.toml");
    let tables = place.read("study/tables.md");
    assert!(tables.contains("violation") && !tables.contains("best_objective"), "{tables}");
}

#[test]
fn a_study_does_what_is_not_done() {
    let place = place(r#"{ "runs": { "rough": { "iteration": { "value": 2, "source": "as asked for" } } } }"#);
    let plan = place.good("study study.toml --plan");
    assert_eq!(plan.out.matches("to do").count(), 3, "{}", plan.out);
    let ran = place.good("study study.toml");
    assert_eq!(ran.out.matches("slipstick optimize").count(), 2, "{}", ran.out);
    for name in [
        "study/rough/design.csv",
        "study/table/evaluate.csv",
        "study/tables.md",
        "pictures/rough.png",
        "pictures/both.png",
    ] {
        assert!(place.path(name).is_file(), "{name}");
    }
    let numbers = place.table("study/numbers.csv");
    let value = |run: &str, quantity: &str| {
        let row = numbers.iter().find(|row| row[0] == run && row[1] == quantity);
        row.unwrap_or_else(|| panic!("{run} {quantity} in {numbers:?}"))[2].parse::<f64>().expect("a number")
    };
    // With its own friction, the design has the final objective of its optimization.
    let (evaluated, optimized) = (value("table", "objective at 0.3"), value("rough", "objective"));
    assert!((evaluated / optimized - 1.0).abs() < 1e-9, "{evaluated} {optimized}");
    for image in ["x", "z", "half turn y"] {
        let asymmetry = value("rough", &format!("asymmetry {image}"));
        assert!(asymmetry > 0.0 && asymmetry <= 1.0, "{image}: {asymmetry}");
    }
    assert!(place.read("study/tables.md").contains("| objective, μ = 0.3 |"));

    let again = place.good("study study.toml");
    assert_eq!((again.out.matches("already finished").count(), again.out.matches("slipstick ").count()), (3, 0));
    // The quantities measured on a design can change without repeating the run that made it.
    let measured = STUDY.replace("mirror = [\"x\", \"z\"]", "mirror = [\"y\"]");
    place.write("study.toml", &measured);
    let more = place.good("study study.toml");
    assert_eq!(more.out.matches("already finished").count(), 3, "{}", more.out);
    let numbers = place.read("study/numbers.csv");
    assert!(numbers.contains("rough,asymmetry y,") && !numbers.contains("rough,asymmetry x,"), "{numbers}");
    // Only runs that depend on a changed line are repeated.
    place.write("study.toml", &STUDY.replace("friction = 0\"", "friction = 0.1\""));
    let changed = place.good("study study.toml");
    assert_eq!(changed.out.matches("already finished").count(), 2, "{}", changed.out);
    assert!(changed.out.contains("smooth: slipstick optimize"));
}

#[test]
fn an_interrupted_optimization_of_a_study_is_resumed() {
    let place = place(r#"{ "runs": {} }"#);
    place.good("study study.toml --only rough");
    let whole = place.read("study/rough/history.csv");
    // In the state left by a killed run: the record says that it is not finished.
    let mut record = place.json("study/rough.json");
    record["finished"] = false.into();
    place.write("study/rough.json", &record.to_string());
    let ran = place.good("study study.toml --only rough");
    assert!(ran.out.contains("rough: slipstick resume"), "{}", ran.out);
    assert_eq!(place.read("study/rough/history.csv"), whole);
    assert_eq!(place.json("study/rough.json")["numbers"]["iteration"], 2.0);
}

#[test]
fn numbers_that_are_not_as_expected_are_told() {
    let place = place(r#"{ "runs": { "rough": { "objective": { "at_least": 1, "source": "a guess" } } } }"#);
    let told = ["rough: objective is -", "expected at least 1 (a guess)", "1 number is not as expected"];
    place.bad("study study.toml --only rough", 3, &told);
    assert!(place.read("study/numbers.csv").contains(",no"));
}

/// Ratios of two numbers of the same run and of different runs.
#[test]
fn ratios_of_numbers_are_compared() {
    let ratio = |of: &str, to: &str, is: &str| {
        format!(r#"{{ "of": {of}, "to": {to}, "is": {{ {is}, "source": "by hand" }} }}"#)
    };
    let of_table = r#"["table", "objective at 0.3"]"#;
    let good = [
        ratio(of_table, r#"["rough", "objective"]"#, r#""value": 1, "relative": 1e-9"#),
        ratio(of_table, r#"["table", "objective at 0"]"#, r#""at_least": 1"#),
        ratio(of_table, r#"["smooth", "objective"]"#, r#""value": 7"#),
    ];
    let place = place(&format!(r#"{{ "ratios": [{}] }}"#, good.join(", ")));
    // Expectations for runs that were not requested are ignored.
    place.good("study study.toml --only rough,table");
    let numbers = place.table("study/numbers.csv");
    let row = |name: &str| numbers.iter().find(|row| row[0] == "table" && row[1] == name);
    let own = row("objective at 0.3 / objective at 0").expect("friction adds to the force");
    let value = |name: &str| row(name).map(|row| row[2].parse::<f64>().expect("a number")).expect("there");
    let quotient = value("objective at 0.3") / value("objective at 0");
    assert_eq!((own[2].parse::<f64>().expect("a number"), own[3].as_str()), (quotient, "yes"));
    assert!(row("objective at 0.3 / objective of rough").is_some_and(|row| row[3] == "yes"), "{numbers:?}");
    let told = ["table: objective at 0.3 / objective of smooth is ", "expected 7 ± 0.0e0 (by hand)", "1 number is"];
    place.bad("study study.toml", 3, &told);
    assert!(place.read("study/tables.md").contains("| table: objective at 0.3 / objective of rough | "));

    let missing = ratio(r#"["rough", "objectiv"]"#, of_table, r#""value": 1"#);
    place.write("expected.json", &format!(r#"{{ "ratios": [{missing}] }}"#));
    place.bad("study study.toml", 3, &["rough: objectiv / objective at 0.3 of table is NaN"]);
    let nothing = ratio(of_table, r#"["nobody", "objective"]"#, r#""relative": 1"#);
    place.write("expected.json", &format!(r#"{{ "ratios": [{nothing}] }}"#));
    place.bad("study study.toml", 2, &["table: objective at 0.3 / objective of nobody has none of value"]);
    place.write("expected.json", &format!(r#"{{ "ratios": [{}] }}"#, nothing.replace("relative", "value")));
    place.bad("study study.toml", 2, &["there are expected numbers for `nobody`"]);
}

/// A chart is drawn when all of its runs are there, from no other command's line.
#[test]
fn charts_wait_for_their_runs() {
    let place = place(r#"{ "runs": {} }"#);
    place.good("study study.toml --only rough");
    assert!(!place.path("pictures/both.png").exists(), "smooth is missing");
    place.good("study study.toml --only smooth");
    let drawn = std::fs::read(place.path("pictures/both.png")).expect("drawn");
    let line = "render study/rough study/smooth --history --title Two_frictions --size 320x240 --out by_hand.png";
    place.good(line);
    let by_hand = std::fs::read(place.path("by_hand.png")).expect("drawn");
    assert!(drawn != by_hand, "the title has a space");
    assert_eq!(drawn[16..24], by_hand[16..24], "the size");

    let wrong = |from: &str, to: &str, told: &[&str]| {
        place.write("study.toml", &STUDY.replace(from, to));
        place.bad("study study.toml --plan", 2, told);
    };
    let of = "of = [\"rough\", \"smooth\"]";
    wrong(of, "of = [\"rough\", \"smoth\"]", &["chart pictures/both.png: no run is called `smoth`"]);
    wrong(of, "of = [\"table\"]", &["chart pictures/both.png: run `table` is not an optimization and has no history"]);
    wrong(of, "of = [\"rough\", \"rough\"]", &["chart pictures/both.png: run `rough` is listed twice"]);
    wrong(of, "of = []", &["chart pictures/both.png: `of` lists no run"]);
    wrong("--size\", \"320x240", "--view\", \"top", &["chart pictures/both.png: the argument", "--history"]);
    wrong("title = \"Two frictions\"\noptions", "titel = \"\"\noptions", &["unknown field `titel`"]);
}

#[test]
fn wrong_studies_are_refused_whole() {
    let place = place(r#"{ "runs": { "nobody": { "objective": { "value": 1, "source": "" } } } }"#);
    let wrong = STUDY
        .replace("name = \"smooth\"", "name = \"rough\"")
        .replace("design = \"rough\"", "design = \"later\"")
        .replace("--friction", "--fricton")
        .replace("of = \"rough\"", "of = \"none\"")
        .replace("contact[0].friction = 0", "contact[0].friction");
    place.write("study.toml", &wrong);
    let told = [
        "run `rough`: there are two runs with this name",
        "no earlier run is called `later`",
        "unexpected argument '--fricton'",
        "no run is called `none`",
        "not of the form KEY=VALUE",
        "there are expected numbers for `nobody`",
    ];
    place.bad("study study.toml", 2, &told);
    assert!(!place.path("study").exists(), "nothing was begun");
    place.write("study.toml", &STUDY.replace("command = \"evaluate\"", "command = \"evaluat\""));
    place.bad("study study.toml", 2, &["study.toml", "unknown variant `evaluat`"]);
    place.bad("study none.toml", 2, &["cannot read none.toml"]);
    place.write("study.toml", STUDY);
    place.write("expected.json", r#"{ "runs": {} }"#);
    place.bad("study study.toml --only roug", 2, &["no run is called `roug`", "rough, smooth, table"]);
}

/// A run that fails stops only the runs that need it.
#[test]
fn a_failed_run_does_not_stop_the_others() {
    let place = place(r#"{ "runs": {} }"#);
    let mut study = STUDY.replacen(
        "mirror",
        "set = [\"load_path.max_newton_iterations = 1\", \"load_path.max_cutbacks = 0\"]\nmirror",
        1,
    );
    study = study.replace("options = [\"--friction\", \"0,0.3\"]\n", "");
    place.write("study.toml", &study);
    let ran = place.bad("study study.toml", 3, &["rough: load step 1 failed", "table: skipped, because rough failed"]);
    assert!(ran.err.contains("2 runs failed (rough, table)"), "{}", ran.err);
    assert!(place.path("study/smooth/design.csv").is_file());
}

const GRID: &str = r#"[[run]]
name = "slide"
command = "solve"
case = "case.toml"
set = ["load_path.steps = 2"]
grid = { friction = [0.0, 0.2], "load_path.tolerance.relative" = [1e-7, 1e-9] }
tabulate = ["block_ymin_normal_force"]
"#;

/// Each combination of values is a run of its own; its numbers are those of the case with these
/// values.
#[test]
fn grids_are_tabulated() {
    let place = Place::new();
    place.write("study.toml", GRID);
    assert_eq!(place.good("study study.toml --plan").out.matches("to do").count(), 4);
    let ran = place.good("study study.toml");
    let header = "slide friction load_path.tolerance.relative objective volume_fraction block_ymin_normal_force";
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    assert!(ran.out.lines().any(|line| words(line) == words(header)), "{}", ran.out);
    let table = &place.table("study/grid_slide.csv")[1..];
    let values: Vec<[&str; 3]> = table.iter().map(|row| [&*row[0], &*row[1], &*row[2]]).collect();
    let (loose, tight) = (values[0][2], values[1][2]);
    assert_eq!([loose, tight].map(|one| one.parse::<f64>().ok()), [Some(1e-7), Some(1e-9)]);
    assert_eq!(values.iter().map(|row| row[1]).collect::<Vec<_>>(), ["0.0", "0.0", "0.2", "0.2"]);
    let column = |name: &str| {
        let header = place.read("study/grid_slide.csv").lines().next().unwrap_or_default().to_owned();
        header.split(',').position(|one| one == name).unwrap_or_else(|| panic!("{name} in {header}"))
    };
    let number = |row: usize, name: &str| table[row][column(name)].parse::<f64>().expect("a number");
    // without friction, none; with friction, at most μ times the normal force
    let friction = "block_ymin_friction_force";
    assert!(number(1, friction).abs() < 1e-9 * number(1, "block_ymin_normal_force"));
    assert!(number(3, friction) > 0.1 * number(3, "block_ymin_normal_force"), "{table:?}");
    place.good(
        "solve case.toml --set contact[*].friction=0.2 --set load_path.steps=2 --set load_path.tolerance.relative=1e-9",
    );
    let alone = place.table("case_solve/quantities.csv");
    let header = place.read("case_solve/quantities.csv");
    let at = header.lines().next().unwrap_or_default().split(',').position(|one| one == friction).expect("a column");
    assert_eq!(alone.last().expect("a row")[at].parse::<f64>().ok(), Some(number(3, friction)));
    assert!(place.read("study/tables.md").contains("| slide | friction |"));

    // Another value adds runs; finished ones are kept.
    place.write("study.toml", &GRID.replace("[0.0, 0.2]", "[0.0, 0.1, 0.2]"));
    let more = place.good("study study.toml --only slide");
    assert_eq!((more.out.matches("already finished").count(), more.out.matches("slipstick solve").count()), (4, 2));
}

#[test]
fn wrong_grids_are_errors() {
    let place = Place::new();
    let bad = |old: &str, new: &str, told: &[&str]| {
        assert!(GRID.contains(old));
        place.write("study.toml", &GRID.replace(old, new));
        place.bad("study study.toml --plan", 2, told);
    };
    bad("[0.0, 0.2]", "0.2", &["run `slide`: grid: `friction` is 0.2; give a list"]);
    bad("[0.0, 0.2]", "[0.0, -0.2]", &["the case of `slide_-0.2_", "`friction`"]);
    bad("friction =", "frictio =", &["the case of `slide_", "unknown key `frictio`"]);
    bad("friction =", "\"load[*].amplitude\" =", &["there is no list load"]);
    place.write("study.toml", &format!("{GRID}[[picture]]\nof = 'slide'\nfile = 'a.png'\n"));
    place.bad("study study.toml --plan", 2, &["`slide` is a grid; name one of its runs: slide_0.0_"]);
}
