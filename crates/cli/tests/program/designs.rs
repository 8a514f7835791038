//! Which design an optimization returns, and what it says about it.

use super::Place;

/// A cantilever whose volume is minimised, with a bound on the deflection of its tip.
const BEAM: &str = r#"
[[body]]
name = "beam"
box = { min = [0, 0, 0], max = [6, 2, 1], elements = [6, 2, 1] }
material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[dirichlet]]
set = "beam_xmin"
[[load]]
surface = "beam_xmax"
force = [0, -1, 0]
[load_path]
steps = 1
[design]
bodies = ["beam"]
initial = 0.8
density_filter = { radius = 1.2 }
[[quantity]]
name = "V"
volume = { body = "beam" }
[[quantity]]
name = "tip"
displacement = { set = "beam_xmax", component = "y" }
[[constraint]]
quantity = "tip"
min = -0.6
[objective]
minimise = { quantity = "V" }
[optimizer]
iterations = 4
"#;

fn beam(text: &str) -> Place {
    let place = Place::new();
    place.write("case.toml", text);
    place
}

fn column(table: &[Vec<String>], name: &str) -> Vec<f64> {
    let at = table[0].iter().position(|known| known == name).unwrap_or_else(|| panic!("{name}: {:?}", table[0]));
    table[1..].iter().map(|row| row[at].parse().unwrap_or(f64::NAN)).collect()
}

/// The last design violates the bound, and the third is the best that meets it: it is the result, in
/// all files. Resumed, the run goes on from the last design, bit for bit.
#[test]
fn the_best_design_that_meets_the_constraints_is_the_result() {
    let place = beam(BEAM);
    let ran = place.good("optimize case.toml --out run");
    let history = place.table("run/history.csv");
    let (objective, violation) = (column(&history, "objective"), column(&history, "violation"));
    assert!(violation[..3] == [0.0; 3] && violation[4] > 0.03, "{violation:?}");
    assert!(objective.windows(2).all(|pair| pair[1] < pair[0]), "{objective:?}");
    assert!(ran.out.contains(" in iteration 2 of 4; design in "), "{}", ran.out);
    let expected = format!("violates `tip` by {:.2} % of its bound, so the result", 100.0 * violation[4]);
    assert!(ran.err.contains(&expected), "{expected}\n{}", ran.err);
    assert_eq!(place.json("run/result.json")["iteration"], 2);
    let quantities = place.table("run/quantities.csv");
    assert!((column(&quantities, "V")[1] - objective[2]).abs() < 1e-12 * objective[2]);
    assert!((column(&quantities, "tip")[1] - column(&history, "tip")[2]).abs() < 1e-12);
    place.good("report run");
    assert!(place.read("run/report.html").contains("result: the best design, of iteration"));
    // the densities are those of a run that ends there
    place.good("optimize case.toml --iterations 2 --out short");
    assert_eq!(place.read("run/design.csv"), place.read("short/design.csv"));
    assert!(!place.path("short/result.json").exists());

    place.good("resume run --iterations 9");
    place.good("optimize case.toml --iterations 9 --out whole");
    assert_eq!(place.read("run/design.csv"), place.read("whole/design.csv"));
    let state = |run: &str| place.json(&format!("{run}/checkpoint.json"))["x"].clone();
    assert_eq!(state("run"), state("whole"));
    assert!(!place.path("run/result.json").exists(), "the last design is the best");
}

/// No design meets the bound: the last one is the result, and a violation of 0.1 % to 1 % is not silent.
#[test]
fn a_small_violation_is_warned_of() {
    let place = beam(&BEAM.replace("initial = 0.8", "initial = 0.45"));
    let ran = place.good("optimize case.toml --iterations 12 --out long");
    assert!(!ran.err.contains("violates"), "{}", ran.err);
    let violation = column(&place.table("long/history.csv"), "violation");
    let small = violation.iter().position(|violation| *violation < 0.01).expect("the bound is met in the end");
    assert!(violation[small] > 0.001, "{violation:?}");
    let ran = place.good(&format!("optimize case.toml --iterations {small} --out run"));
    let expected = format!("the largest relative violation is {:.3} (`tip` is ", violation[small]);
    assert!(ran.err.contains(&expected), "{expected}\n{}", ran.err);
}

/// Equal bounds: the volume is kept, and the stiffness is that with an upper bound alone.
#[test]
fn equal_bounds_do_not_stall() {
    let text = BEAM
        .replace("initial = 0.8", "initial = 0.4")
        .replace("quantity = \"tip\"\nmin = -0.6", "quantity = \"V\"\nmax = 4.8")
        .replace("minimise = { quantity = \"V\" }", "compliance = {}");
    let place = beam(&text);
    place.write("equal.toml", &text.replace("max = 4.8", "min = 4.8\nmax = 4.8"));
    place.good("optimize case.toml --iterations 20 --out one");
    let one = column(&place.table("one/history.csv"), "objective");
    assert!(one[20] < 0.75 * one[0], "{one:?}");
    for method in ["mma", "gcmma"] {
        place.good(&format!("optimize equal.toml --iterations 20 --out {method} --set optimizer.method='{method}'"));
        let history = place.table(&format!("{method}/history.csv"));
        let objective = column(&history, "objective");
        assert!(objective[20] < 1.02 * one[20], "{method}: {objective:?}");
        assert!(column(&history, "violation").iter().all(|violation| *violation < 1e-5));
    }
}
