//! Which design an optimization returns, and what it says about it.

use super::Place;

/// A cantilever whose volume is minimized, with a bound on the deflection of its tip.
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
adaptive = false
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
    let state = |run: &str| place.json(&format!("{run}/checkpoint.json"))["state"]["x"].clone();
    assert!(state("whole").is_array());
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

/// A cover that is pressed onto a pad in its middle and lifts off elsewhere.
const LIFTED: &str = r#"
symmetry = [{ normal = "z" }, { normal = "x" }]
[[body]]
name = "pad"
box = { min = [0, 0, 0], max = [3, 0.6, 0.5], elements = [9, 2, 1] }
material = { neo_hooke = { youngs_modulus = 50.0, poisson_ratio = 0.4 } }
[[body]]
name = "cover"
box = { min = [0, 0.6, 0], max = [3, 2.6, 0.5], elements = [9, 6, 1] }
material = { neo_hooke = { youngs_modulus = 2000.0, poisson_ratio = 0.3 } }
[[contact]]
slave = "pad_ymax"
master = "cover_ymin"
friction = 0.2
[[surface]]
name = "push"
body = "cover"
boxes = [{ min = [-1, 2.59, -1], max = [0.6, 2.7, 9] }]
[[dirichlet]]
set = "pad_ymin"
[[load]]
surface = "push"
force = [0, -5.0, 0]
[load_path]
steps = 2
[[quantity]]
name = "least"
contact_pressure = { slave = "pad_ymax", measure = "minimum" }
[[quantity]]
name = "volume"
volume = { body = "cover" }
[design]
bodies = ["cover"]
initial = 0.2
density_filter = { radius = 0.5 }
[objective]
compliance = {}
[[constraint]]
quantity = "least"
min = 0.5
[[constraint]]
quantity = "volume"
min = 1.05
max = 1.05
[optimizer]
iterations = 16
"#;

/// A bound on the least pressure closes gaps, with a prescribed volume: the first design lifts off, and the
/// result is far stiffer. (When open nodes had no derivatives, the compliance rose to more than 12.)
#[test]
fn a_bound_on_the_least_pressure_closes_gaps() {
    let place = beam(LIFTED);
    place.good("optimize case.toml --out run");
    let history = place.table("run/history.csv");
    let [objective, least, volume] = ["objective", "least_extreme", "volume_fraction"].map(|of| column(&history, of));
    assert!(least[0] == 0.0 && objective[0] > 7.0, "{least:?} {objective:?}");
    let recalled = place.path("run/result.json").is_file().then(|| place.json("run/result.json")["iteration"].as_u64());
    let result = recalled.flatten().map_or(16, |iteration| iteration as usize);
    assert!(least[result] >= 0.4995 && objective[result] < 1.0, "{least:?} {objective:?}");
    assert!((volume[result] / 0.35 - 1.0).abs() < 1e-4, "{volume:?}");
}

/// A block pressed onto a slab whose volume is minimized, with a bound on the least pressure.
const PRESSED: &str = r#"
[[body]]
name = "slab"
box = { min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "block"
box = { min = [0.6, 1.0, 0.3], max = [2.0, 1.7, 1.6], elements = [3, 1, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[contact]]
slave = "block_ymin"
master = "slab_ymax"
friction = 0.3
[[dirichlet]]
set = "slab_ymin"
[[dirichlet]]
set = "block_ymax"
motion = [{ t = 1.0, u = [0, -0.1, 0] }]
[load_path]
steps = 2
[design]
bodies = ["slab"]
initial = 0.8
simp = { p = 3.0, min = 1e-3 }
density_filter = { radius = 0.8 }
[[quantity]]
name = "least"
contact_pressure = { slave = "block_ymin", measure = "minimum" }
[[quantity]]
name = "volume"
volume = { body = "slab" }
[[constraint]]
quantity = "least"
min = 12.0
[objective]
minimise = { quantity = "volume" }
[optimizer]
iterations = 20
"#;

/// The bound holds for the least pressure itself, of which the smooth minimum lies above: a bound on the
/// latter alone is met by a design whose least pressure violates it, and a warning says so. The
/// difference is part of the state: a resumed run is the uninterrupted one.
#[test]
fn bounds_on_smooth_minima_hold_for_the_least_value() {
    let place = beam(PRESSED);
    for method in ["mma", "gcmma"] {
        let run = format!("optimize case.toml --set optimizer.method='{method}' --out");
        let ran = place.good(&format!("{run} {method}"));
        assert!(!ran.err.contains("the design violates"), "{method}: {}", ran.err);
        let [smooth, least] =
            ["least", "least_extreme"].map(|of| column(&place.table(&format!("{method}/quantities.csv")), of));
        assert!(least[2] >= 0.999 * 12.0 && smooth[2] > 1.1 * least[2], "{method}: {smooth:?} {least:?}");
        let history = place.table(&format!("{method}/history.csv"));
        let [violation, least] = ["violation", "least_extreme"].map(|of| column(&history, of));
        for (violation, least) in violation.iter().zip(least) {
            assert!((violation - (1.0 - least / 12.0).max(0.0)).abs() < 1e-12, "{method}: {violation} at {least}");
        }
        // without the correction
        let ran = place.good(&format!("{run} smooth_{method} --set constraint[0].corrected=false"));
        let [smooth, least] =
            ["least", "least_extreme"].map(|of| column(&place.table(&format!("smooth_{method}/quantities.csv")), of));
        assert!(smooth[2] >= 0.999 * 12.0 && least[2] < 0.75 * 12.0, "{method}: {smooth:?} {least:?}");
        let expected = format!("violates it by {:.2} %; without `corrected = false`", 100.0 * (1.0 - least[2] / 12.0));
        assert!(ran.err.contains(&expected), "{method}: {expected}\n{}", ran.err);
    }
    // a violation is that of the extreme, under its own name, in the console and in the report
    let ran = place.good("optimize case.toml --iterations 1 --set constraint[0].min=100 --out far");
    let history = place.table("far/history.csv");
    let [smooth, least] = ["least", "least_extreme"].map(|of| column(&history, of)[1]);
    assert!(smooth > 1.05 * least, "{smooth} {least}");
    let shown = slipstick::words::quantity(least);
    let expected = format!("is {:.3} (the extreme `least_extreme` is {shown};", 1.0 - least / 100.0);
    assert!(ran.err.contains(&expected), "{expected}\n{}", ran.err);
    place.good("report far");
    let page = super::report::data(&place.read("far/report.html"));
    let told = page["results"]["quantities"]["rows"][0].to_string();
    let expected = format!("violated by {:.2} % at step 2 by the extreme itself, ", 100.0 - least);
    assert!(told.contains(&expected), "{expected}\n{told}");
    place.good("optimize case.toml --set optimizer.method='gcmma' --iterations 12 --out whole");
    place.good("optimize case.toml --set optimizer.method='gcmma' --iterations 7 --out part");
    place.good("resume part --iterations 12");
    let state = |run: &str| place.json(&format!("{run}/checkpoint.json"))["state"].clone();
    assert!(state("whole")["shifts"][0].as_f64().is_some_and(|shift| shift < 0.0));
    assert_eq!(state("whole"), state("part"));
}

/// The solid end of a beam that begins as void is loose until material joins it to the support.
#[test]
fn loose_pieces_are_reported_during_the_run() {
    let text = BEAM
        .replace("initial = 0.8", "initial = 0.2\npassive_solid = [{ surface = \"beam_xmax\", within = 1.0 }]")
        .replace("min = -0.6", "min = -0.2")
        .replace("iterations = 4", "iterations = 8");
    let ran = beam(&text).good("optimize case.toml --out run");
    let loose: Vec<&str> = ran.err.lines().filter(|line| line.contains("neither a support")).collect();
    assert!(
        loose.len() == 1 && loose[0].contains("from iteration 0 on, neither a support nor contact holds one piece"),
        "{}",
        ran.err
    );
    assert!(ran.out.contains("no piece of the design is loose"), "{}", ran.out);
    // and again at the end, if it stays
    let text = text.replace("iterations = 8", "iterations = 1");
    let ran = beam(&text).good("optimize case.toml --out run");
    assert_eq!(ran.err.matches("neither a support").count(), 2, "{}", ran.err);
}

/// A jump of the sharpness makes the approximations of MMA poor: without a guard, every step leaves the
/// bound further. With it, the run ends with a design that meets the bound; it resumes bit for bit.
#[test]
fn a_jump_of_the_sharpness_does_not_break_the_bound() {
    let text = BEAM
        .replace("elements = [6, 2, 1]", "elements = [12, 4, 2]")
        .replace("{ radius = 1.2 }", "{ radius = 0.8 }\nprojection = { sharpness = 1.0 }")
        .replace("initial = 0.8", "initial = 0.6")
        .replace("min = -0.6", "min = -0.3")
        .replace("iterations = 4", "iterations = 18\nschedule = { sharpness = [[0, 1], [12, 16]] }");
    let place = beam(&text);
    place.good("optimize case.toml --out plain");
    assert!(column(&place.table("plain/history.csv"), "violation")[18] > 1.0);
    place.write("case.toml", &text.replace("adaptive = false\n", ""));
    let ran = place.good("optimize case.toml --out guarded");
    assert!(!ran.err.contains("violates"), "{}", ran.err);
    let history = place.table("guarded/history.csv");
    assert!(column(&history, "inner_iterations").iter().sum::<f64>() > 0.0);
    assert!(column(&history, "violation")[18] < 1e-3);
    // the jump alone would break the bound: it is made in two halves, at iterations 12 and 14
    assert!(ran.out.contains("iteration 12: the sharpness rises in two halves"), "{}", ran.out);
    assert_eq!(place.json("guarded/checkpoint.json")["state"]["divided"], serde_json::json!([12]));
    // a small rise is made at once
    place.good("optimize case.toml --set optimizer.schedule.sharpness=[[0,1],[12,1.5]] --out small");
    assert!(place.json("small/checkpoint.json")["state"]["divided"].is_null());
    for iterations in [13, 14] {
        place.good(&format!("optimize case.toml --iterations {iterations} --out short --force"));
        place.good("resume short --iterations 18");
        assert_eq!(place.read("short/design.csv"), place.read("guarded/design.csv"));
    }
}
