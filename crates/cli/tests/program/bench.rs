//! `slipstick bench`.

use super::{Place, number};
use serde_json::Value;

/// The case is measured in a separate process for each number of threads; the phases are parts of
/// the total time, and the analysis is the one that `solve` runs.
#[test]
fn phases_are_parts_of_the_whole() {
    let place = Place::new();
    let solved = place.good("solve case.toml --json").event("result");
    let ran = place.good("bench case.toml --threads 1,2 --json");
    let measurements: Vec<Value> = ran
        .out
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"))
        .filter(|event| event["event"] == "measurement")
        .collect();
    assert_eq!(measurements.len(), 2);
    for (m, threads) in measurements.iter().zip([1, 2]) {
        assert_eq!((&m["threads"], &m["elements"], &m["steps"]), (&threads.into(), &20.into(), &4.into()));
        assert_eq!(m["newton_iterations"], solved["newton_iterations"]);
        assert_eq!(m["objective"], solved["objective"]);
        assert_eq!(m["states_with_kept_factors"], m["increments"], "a case this small fits");
        for what in ["forward", "gradient", "gradient_without_kept_factors"] {
            let whole = m[what]["seconds"].as_f64().expect("a number");
            let phases = m[what]["phases"].as_object().expect("phases");
            let parts: f64 = phases.values().map(|entry| entry[0].as_f64().expect("a number")).sum();
            assert!(0.0 < parts && parts <= whole, "{what}: {parts} of {whole}");
        }
    }
}

/// The built-in half-ball: one line for each size, and the tables by phase.
#[test]
fn the_half_ball_is_measured_in_several_sizes() {
    let place = Place::new();
    let ran = place.good("bench --sizes 40,150 --threads 1 --steps 2");
    let rows: Vec<Vec<&str>> = ran.out.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows[0][0], "elements");
    let elements: Vec<f64> = rows[1..3].iter().map(|row| number(row[0])).collect();
    assert!(elements[0] < elements[1] && rows[1][3] == "2" && rows[2][3] == "2", "{rows:?}");
    let headers = ran.out.lines().filter(|line| line.trim_start().starts_with("unknowns")).count();
    assert_eq!(headers, 4, "forward, gradient with kept factors and without, evaluations:\n{}", ran.out);
    // what the march has evaluated is not computed again: only the start is, which it does not evaluate
    let row = |part: &[&str]| rows.iter().find(|row| row.get(1..=part.len()) == Some(part)).expect("a row").clone();
    let [marching, later] = ["marching", "later"].map(|when| row(&["quantities", "and", "files,", when]));
    let names = rows.iter().find(|row| row.contains(&"kinematics")).expect("the header");
    assert_eq!(names[1..5], ["contact", "kinematics", "determinant", "energy"]);
    // contact kinematics, energy, force, over two increments
    for (column, while_marching) in [(0, 0.5), (2, 1.5), (3, 0.5)] {
        let found = [&marching, &later].map(|row| number(row[5 + column]));
        assert_eq!(found, [while_marching, 1.5], "{}", ran.out);
    }
}
