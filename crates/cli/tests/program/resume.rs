//! Resuming an optimization.

use super::*;

/// Two updates and then two more give the same as four at once: every number of the checkpoint, the
/// history except for its seconds, and the tables of designs and Newton iterations. With GCMMA, the
/// first of the later updates is judged by approximations that were stored.
#[test]
fn a_resumed_run_is_the_uninterrupted_one_bit_for_bit() {
    resumed("");
    resumed(" --set optimizer.method=\"gcmma\" --set optimizer.mma.move_limit=0.9");
}

fn resumed(settings: &str) {
    let place = Place::new();
    place.good(&format!("optimize case.toml --out whole{settings}"));
    place.good(&format!("optimize case.toml --out parts --iterations 2{settings}"));
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
    assert!(place.good("resume case").out.contains("the run is complete"));
    assert_eq!(place.read("case/checkpoint.json"), before);
}

#[test]
fn what_cannot_be_resumed_is_refused() {
    let place = Place::new();
    place.bad(
        "resume case --set a=b",
        2,
        &["continues with the case", "`slipstick optimize CASE --design case --set …`"],
    );
    place.bad("resume nowhere", 2, &["there is no run.json in nowhere", "directory of a run"]);
    place.good("solve case.toml");
    place.bad("resume case_solve", 2, &["there is no checkpoint.json in case_solve"]);

    place.good("optimize case.toml --iterations 1");
    place.write("case/case.toml", &CASE.replace("friction = 0.3", "friction = 0.4"));
    place.bad("resume case --iterations 3", 2, &["is not the case", "SHA-256", "--design"]);
    place.write("case/case.toml", CASE);

    let checkpoint = place.read("case/checkpoint.json");
    place.write("case/checkpoint.json", &checkpoint[..checkpoint.len() / 2]);
    place.bad("resume case --iterations 3", 2, &["is not a checkpoint", "start a new run"]);
    place.write("case/checkpoint.json", &checkpoint);
    place.good("resume case --iterations 3");
}

/// Every error in a checkpoint is reported with its file and a cure; nothing panics, and nothing is
/// written.
#[test]
fn damaged_checkpoints_are_refused() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 3");
    let whole = place.json("case/checkpoint.json");
    let mut damages: Vec<(String, Value)> = Vec::new();
    let mut spoil = |pointer: &str, to: Value| {
        let mut spoilt = whole.clone();
        *spoilt.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}")) = to;
        damages.push((pointer.to_owned(), spoilt));
    };
    for list in ["x", "x_before", "mma/x1", "mma/x2", "mma/low", "mma/upp", "scaling/constraints", "history"] {
        let pointer = format!("/state/{list}");
        let values = whole.pointer(&pointer).and_then(Value::as_array).unwrap_or_else(|| panic!("{pointer}")).clone();
        let longer: Vec<Value> = values.iter().chain(values.last()).cloned().collect();
        spoil(&pointer, values[..values.len() - 1].into());
        spoil(&pointer, longer.into());
        for wrong in [Value::from("text"), Value::from(1), Value::from(Vec::<f64>::new())] {
            spoil(&pointer, wrong);
        }
        // A number that is not finite is `null` in JSON.
        spoil(&format!("{pointer}/0"), Value::Null);
        spoil(&format!("{pointer}/0"), "text".into());
    }
    let values: [(&str, Vec<Value>); 10] = [
        ("/state/x/0", vec![(-0.1).into(), 1.5.into(), 1e300.into()]),
        ("/state/x_before/15", vec![2.0.into()]),
        ("/state/x_before", vec![Value::Null]),
        ("/state/iteration", vec![0.into(), 2.into(), 5.into(), u64::MAX.into(), (-1).into(), 1.5.into()]),
        ("/state/mma/iteration", vec![0.into(), 2.into(), u64::MAX.into()]),
        ("/state/mma/n", vec![0.into(), 15.into(), u64::MAX.into()]),
        ("/state/mma/m", vec![0.into(), 2.into()]),
        ("/state/mma/parameters/move_limit", vec![0.into(), (-1).into(), Value::Null]),
        ("/state/scaling", vec![Value::Null, 1.into()]),
        ("/state/scaling/objective", vec![0.into(), (-1).into(), Value::Null]),
    ];
    for (pointer, wrong) in values {
        wrong.into_iter().for_each(|value| spoil(pointer, value));
    }
    for (pointer, wrong) in [
        ("/state/mma/low/3", Value::from(7.0)),
        ("/state/mma/x1/3", Value::from(-7.0)),
        ("/state/history/1/iteration", Value::from(0)),
        ("/state/history/1/change", Value::Null),
        ("/state/history/1/objective", Value::Null),
        ("/newton_rows", Value::from(vec![1, 2])),
        ("/newton_rows/1", Value::from(100_000)),
        ("/format", Value::from(99)),
        ("/state", Value::Null),
        ("/iterations", Value::from(-1)),
        ("", Value::from(vec![1])),
    ] {
        spoil(pointer, wrong);
    }
    assert!(damages.len() > 80);
    for (pointer, damage) in damages {
        place.write("case/checkpoint.json", &sealed(&damage));
        let ran = place.run("resume case --iterations 5");
        let said = (ran.code, ran.err.contains("panicked"), ran.err.contains("help: "), ran.err.contains("case/"));
        assert_eq!(said, (Some(2), false, true, true), "{pointer}\n{}", ran.err);
    }
    std::fs::write(place.path("case/checkpoint.json"), b"{\xff").expect("written");
    place.bad("resume case", 2, &["case/checkpoint.json", "is not a checkpoint", "start a new run"]);

    place.write("case/checkpoint.json", &whole.to_string());
    place.bad("resume case --iterations 5", 2, &["changed or damaged after it was written"]);
    place.write("case/checkpoint.json", &sealed(&whole));
    place.good("resume case --iterations 5");
}

/// The text of a checkpoint with the hash of the text before it, as the program would have written
/// it.
fn sealed(checkpoint: &Value) -> String {
    let mut checkpoint = checkpoint.clone();
    let object = checkpoint.as_object_mut().map(|object| object.remove("sha256")).is_some();
    let text = checkpoint.to_string();
    match text.strip_suffix('}').filter(|_| object) {
        Some(text) => format!("{text},\"sha256\":\"{}\"}}", slipstick::run::sha256(text)),
        None => text,
    }
}

/// A run that was killed between writing its files continues from its checkpoint: later rows are
/// replaced.
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
