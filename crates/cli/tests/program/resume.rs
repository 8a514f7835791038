//! Going on with an optimization.

use super::*;

/// Two updates, then two more, are the same as four at once: every number of the checkpoint, the history but for its
/// seconds, and the tables of designs and Newton iterations.
#[test]
fn a_resumed_run_is_the_uninterrupted_one_bit_for_bit() {
    let place = Place::new();
    place.good("optimize case.toml --out whole");
    place.good("optimize case.toml --out parts --iterations 2");
    assert!(place.path("parts/design_0002.vtu").exists());
    place.good("resume parts --iterations 4");
    for name in ["checkpoint.json", "design.csv", "newton.csv", "design.pvd", "design_0004.vtu", "path_0004.vtu"] {
        let read = |run: &str| std::fs::read(place.path(run).join(name)).expect(name);
        assert!(read("whole") == read("parts"), "{name} differs");
    }
    let history = |run: &str| -> Vec<Vec<String>> {
        let rows = place.table(&format!("{run}/history.csv"));
        rows.iter().map(|row| row[..row.len() - 1].to_vec()).collect()
    };
    assert_eq!(history("whole"), history("parts"));
    let record = place.json("parts/run.json");
    assert_eq!(record["exit"], "finished");
    assert_eq!(record["earlier"].as_array().map(Vec::len), Some(1));
}

#[test]
fn a_finished_run_has_nothing_left() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 1");
    let before = place.read("case/checkpoint.json");
    assert!(place.good("resume case").out.contains("nothing is left to do"));
    assert_eq!(place.read("case/checkpoint.json"), before);
}

#[test]
fn what_cannot_be_resumed_is_refused() {
    let place = Place::new();
    place.bad("resume nowhere", 2, &["nowhere holds no run.json", "directory that an optimization has written"]);
    place.good("solve case.toml");
    place.bad("resume case_solve", 2, &["holds no checkpoint.json"]);

    place.good("optimize case.toml --iterations 1");
    place.write("case/case.toml", &CASE.replace("friction = 0.3", "friction = 0.4"));
    place.bad("resume case --iterations 3", 2, &["is not the case", "SHA-256", "--design"]);
    place.write("case/case.toml", CASE);

    let checkpoint = place.read("case/checkpoint.json");
    place.write("case/checkpoint.json", &checkpoint[..checkpoint.len() / 2]);
    place.bad("resume case --iterations 3", 2, &["is not a checkpoint", "start anew"]);
    place.write("case/checkpoint.json", &checkpoint);
    place.good("resume case --iterations 3");
}

/// A run that was killed between its files goes on from its checkpoint: rows behind it are replaced.
#[test]
fn rows_behind_the_checkpoint_are_replaced() {
    let place = Place::new();
    place.good("optimize case.toml --out whole");
    place.good("optimize case.toml --out killed --iterations 3");
    for name in ["history.csv", "newton.csv"] {
        let name = format!("killed/{name}");
        let mut text = place.read(&name);
        let last = text.lines().last().expect("a row").to_owned();
        text.push_str(&format!("{last}\n{}", &last[..last.len() / 2]));
        place.write(&name, &text);
    }
    place.good("resume killed --iterations 4");
    assert_eq!(place.read("whole/newton.csv"), place.read("killed/newton.csv"));
    assert_eq!(place.table("whole/history.csv").len(), place.table("killed/history.csv").len());
    assert_eq!(place.read("whole/checkpoint.json"), place.read("killed/checkpoint.json"));
}
