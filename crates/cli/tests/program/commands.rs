//! Each command: its files and its output.

use super::*;

/// Names of units are shown with numbers, and change none of them.
#[test]
fn units_are_shown() {
    let place = Place::with("[[body]]", "[units]\nlength = \"mm\"\nforce = \"N\"\n[[body]]");
    assert_eq!(CASE.matches("[[body]]").count(), 2);
    let text = place.read("case.toml").replacen(
        "[units]\nlength = \"mm\"\nforce = \"N\"\n[[body]]\nname = \"block\"",
        "[[body]]\nname = \"block\"",
        1,
    );
    place.write("case.toml", &text);
    place.write("plain.toml", CASE);
    let [shown, plain] = ["case", "plain"].map(|case| place.good(&format!("check {case}.toml")).out);
    assert!(shown.contains("volume [mm³]") && shown.contains("smallest mean gap [mm]"), "{shown}");
    assert!(!plain.contains("[mm"), "{plain}");
    let numbers = |text: &str| {
        let units = [" [mm³]", " [mm²]", " [mm]"].iter().fold(text.to_owned(), |text, unit| text.replace(unit, ""));
        units.split_whitespace().collect::<String>()
    };
    assert_eq!(numbers(&shown), numbers(&plain));
    let picture = |case: &str| {
        place.good(&format!("solve {case}.toml"));
        place.good(&format!("render {case}_solve --field pressure --out {case}.png"));
        std::fs::read(place.path(&format!("{case}.png"))).expect("drawn")
    };
    assert!(picture("case") != picture("plain"), "the title of the colours says N/mm²");
}

#[test]
fn new_writes_templates_that_check_accepts() {
    let place = Place::new();
    let listed = place.good("new");
    for (name, file) in [
        ("half-ball", "half_ball.toml"),
        ("ironing", "ironing.toml"),
        ("clutch", "clutch.toml"),
        ("press-fit", "press_fit.toml"),
        ("gripper", "gripper.toml"),
        ("snap-fit", "snap_fit.toml"),
        ("bracket", "bracket.toml"),
        ("cube-on-cuboid", "c.toml"),
    ] {
        assert!(listed.out.contains(name));
        place.good(&format!("new {name} --out {file}"));
        assert!(place.good(&format!("check {file}")).out.contains("no warnings"), "{name}");
    }
    place.bad("new ironing", 2, &["ironing.toml already exists", "--force"]);
    place.good("new ironing --force");
    place.bad("new billiards", 2, &["no template `billiards`", "half-ball"]);
    assert!(place.good("new ironing --out -").out.starts_with("# A stiff curved die"));
    place.bad("new my-mesh", 2, &["needs a mesh", "--mesh"]);
    place.bad("new ironing --mesh a.msh", 2, &["takes no mesh", "my-mesh"]);
    place.bad("new my-mesh --mesh a.msh", 2, &["cannot read the mesh file a.msh"]);
}

/// Either elements or random directions are enough for a comparison; at least one of them is
/// needed.
#[test]
fn verify_takes_no_elements_but_not_nothing() {
    let place = Place::new();
    let ran = place.good("verify gradient case.toml --elements 0 --directions 1 --halvings 1 --json");
    assert_eq!(ran.event("result")["checks"][0]["check"]["directions"].as_array().map(Vec::len), Some(1));
    place.bad(
        "verify gradient case.toml --elements 0 --directions 0",
        2,
        &["there is nothing to compare", "--elements"],
    );
}

#[test]
fn check_shows_sizes_and_resolved_cases_are_cases() {
    let place = Place::new();
    let ran = place.good("check case.toml");
    // 5 · 3 · 3 and 3 · 2 · 3 nodes; a gap of 0 at the start; 45 − 15 and 18 − 9 free nodes with 9
    // multiplier nodes.
    for part in ["slab", "block_ymin on slab_ymax", "0.000e0 at node", "unknowns of a step"] {
        assert!(ran.out.contains(part), "{part}\n{}", ran.out);
    }
    let event = place.good("check case.toml --json").event("result");
    let inspection = &event["inspection"];
    assert_eq!(inspection["bodies"][0]["nodes"], 45);
    assert_eq!(inspection["unknowns"], 3 * (30 + 9 + 9));
    assert_eq!(inspection["designed"], 16);
    assert_eq!(inspection["contacts"][0]["covered"], 9);

    let resolved = place.good("check case.toml --resolved").out;
    place.write("resolved.toml", &resolved);
    assert_eq!(place.good("check resolved.toml --resolved").out, resolved, "a fixed point");
    let again = place.good("check resolved.toml --json").event("result");
    assert_eq!(&again["inspection"], inspection);
}

#[test]
fn solve_writes_the_load_path() {
    let place = Place::new();
    let ran = place.good("solve case.toml -vv");
    assert_eq!(ran.out.lines().filter(|line| line.trim_start().starts_with("step")).count(), 4);
    assert!(ran.out.contains("|R|"), "Newton iterations at -vv");
    for step in 0..=4 {
        assert!(place.path(&format!("case_solve/path_000{step}.vtu")).exists());
    }
    let collection = place.read("case_solve/path.pvd");
    assert_eq!(collection.matches("<DataSet").count(), 5);
    assert!(collection.contains("timestep=\"0.25\"") && collection.contains("path_0004.vtu"));
    assert_eq!(place.read("case_solve/case.toml"), CASE);
    let record = place.json("case_solve/run.json");
    assert_eq!(record["exit"], "finished");
    assert_eq!(record["case"]["load_path"]["steps"], 4);
    assert_eq!(record["case_sha256"].as_str().map(str::len), Some(64));
    assert_eq!(record["command"][1], "solve");

    // Newton's table ends every step below the tolerance, with the iterations counted from 1.
    let newton = place.table("case_solve/newton.csv");
    let column = |name: &str| newton[0].iter().position(|found| found == name).expect("a column");
    let (step, iteration, residual) = (column("step"), column("newton_iteration"), column("residual"));
    for pair in newton[1..].windows(2) {
        let follows = pair[1][step] == pair[0][step];
        let expected = if follows { number(&pair[0][iteration]) + 1.0 } else { 1.0 };
        assert_eq!(number(&pair[1][iteration]), expected);
        assert!(follows || number(&pair[0][residual]) < 1e-6);
    }
}

#[test]
fn gradient_of_the_file_is_that_of_the_difference() {
    let place = Place::new();
    let base = place.good("gradient case.toml --json").event("result");
    let table = place.table("case_gradient/gradient.csv");
    assert_eq!(table[0], ["element", "body", "density", "derivative"]);
    assert_eq!(table.len(), 1 + 20);
    assert!(table[17..].iter().all(|row| row[1] == "block" && number(&row[3]) == 0.0), "not designed");
    assert!(place.path("case_gradient/gradient.vtu").exists());
    // A central difference through tables of densities: element 9 of the slab.
    let mut values = Vec::new();
    for density in [0.501, 0.499] {
        let rows: Vec<String> = (0..20).map(|e| format!("{e},{}", if e == 9 { density } else { 0.5 })).collect();
        place.write("moved.csv", &format!("element,density\n{}\n", rows.join("\n")));
        let ran = place.good("solve case.toml --design moved.csv --json --force");
        values.push(ran.event("result")["objective"].as_f64().expect("a number"));
    }
    let difference = (values[0] - values[1]) / 0.002;
    let adjoint = number(&table[10][3]);
    assert!((difference / adjoint - 1.0).abs() < 1e-5, "{difference} {adjoint}");
    assert!(base["objective"].as_f64().expect("a number") < 0.0);
}

#[test]
fn verify_passes_and_fails_by_its_tolerance() {
    let place = Place::new();
    let line = "verify gradient case.toml --elements 2 --directions 1 --halvings 2";
    let ran = place.good(line);
    assert!(ran.out.contains("random direction 1") && ran.out.contains("confirmed:"), "{}", ran.out);
    let report = place.json("case_verify/verify.json");
    let worst = report["checks"][0]["check"]["worst"].as_f64().expect("compared");
    assert!(worst < 1e-6 && report["right"] == true, "{worst}");
    // three directions with three steps each
    assert_eq!(place.table("case_verify/verify.csv").len(), 1 + 9);
    // For such a large step, the difference has a truncation error of second order.
    let strict = format!("{line} --force --step 0.3");
    place.bad(&strict, 3, &["the gradient has an error of", "--step"]);
    assert_eq!(place.json("case_verify/verify.json")["right"], false);
    // Round-off limits what can be compared.
    let strict = format!("{line} --force --tolerance 1e-15");
    place.bad(&strict, 3, &["nothing could be compared", "agree to round-off", "a larger --step"]);
    assert_eq!(place.json("case_verify/run.json")["exit"], "failed");
    place.bad("verify gradient case.toml", 2, &["already contains the results of a run"]);
}

/// A stiff body next to a soft one, and coordinates that are large compared with the bodies, cost
/// digits of the objective; an error of that size does not mean that the gradient is wrong.
#[test]
fn verify_tells_round_off_from_errors() {
    let line = "verify gradient case.toml --elements 3 --directions 0 --tolerance 1e-7 --json";
    let block = "elements = [2, 1, 2] }\nmaterial = { neo_hooke = { youngs_modulus = ";
    let stiff = CASE.replace(&format!("{block}1000.0"), &format!("{block}1e9"));
    assert_ne!(stiff, CASE);
    let far = CASE.replace("name = \"slab\"", "name = \"slab\"\nplace = { translate = [1e8, 0, 0] }");
    let far = far.replace("name = \"block\"", "name = \"block\"\nplace = { translate = [1e8, 0, 0] }");
    for case in [stiff, far] {
        let place = Place::new();
        place.write("case.toml", &case);
        place.run(line);
        let check = place.json("case_verify/verify.json")["checks"][0]["check"].clone();
        let directions = check["directions"].as_array().expect("a list");
        let verdicts: Vec<_> = directions.iter().map(|direction| direction["verdict"].as_str().unwrap_or("")).collect();
        assert_eq!(verdicts.len(), 3);
        assert!(verdicts.contains(&"not_resolvable"), "{check:#}");
        assert!(verdicts.iter().all(|verdict| ["right", "not_resolvable"].contains(verdict)), "{check:#}");
    }
}

/// Few Newton iterations and large steps: some designs far from the given one fail in a step that
/// it completed, and are cut back. This is reported, and not mistaken for a kink. The depth at
/// which it happens depends on single Newton iterations, so several are tried.
#[test]
fn verify_names_other_cut_backs() {
    let place = Place::new();
    let mut met = false;
    for (depth, most) in
        ["0.6", "0.7", "0.8", "0.9", "0.5", "0.75", "0.85"].iter().flat_map(|d| [1, 2, 3].map(|m| (d, m)))
    {
        let case = CASE
            .replace("steps = 4", &format!("steps = 2\nmax_newton_iterations = {most}"))
            .replace("t = 0.5, u = [0, -0.1, 0]", &format!("t = 0.5, u = [0, -{depth}, 0]"))
            .replace("u = [0.2, -0.1, 0.05]", &format!("u = [0.6, -{depth}, 0.05]"));
        place.write("case.toml", &case);
        let line = "verify gradient case.toml --force --elements 5 --directions 3 --step 0.3 --halvings 1";
        let ran = place.run(line);
        let table = place.table("case_verify/verify.csv");
        let column = |name: &str| table[0].iter().position(|found| found == name).expect("a column");
        let (kinks, cut_back) = (column("kinks"), column("cut_back"));
        assert!(table[1..].iter().all(|row| row[cut_back] == "0" || row[kinks] == "0"), "one reason for each");
        let named = table[1..].iter().any(|row| row[cut_back] == "1");
        assert_eq!(named, ran.out.contains("cut back differently"), "{}\n{}", ran.out, ran.err);
        met |= named;
        if met {
            break;
        }
    }
    assert!(met, "no design was cut back differently");
}

#[test]
fn optimize_writes_history_designs_and_the_last_path() {
    let place = Place::new();
    let ran = place.good("optimize case.toml");
    assert_eq!(ran.out.lines().filter(|line| line.contains("change")).count(), 5);
    let history = place.table("case/history.csv");
    assert_eq!(history.len(), 1 + 5, "four updates, five designs");
    assert_eq!(&history[0][..3], ["iteration", "objective", "volume_fraction"]);
    let objective = |row: usize| number(&history[row][1]);
    assert!(objective(5) < objective(1), "the objective is minimised");
    assert!(history[1..].iter().all(|row| number(&row[2]) <= 0.5 + 1e-6), "volume");
    assert!(history[5][3].is_empty() && number(&history[4][3]) > 0.0, "no change after the last");
    for name in ["design_0000.vtu", "design_0002.vtu", "design_0004.vtu", "path_0004.vtu", "design.pvd", "path.pvd"] {
        assert!(place.path("case").join(name).exists(), "{name}");
    }
    assert!(!place.path("case/design_0001.vtu").exists(), "every second");
    assert_eq!(place.read("case/design.pvd").matches("<DataSet").count(), 3);

    // The last design, evaluated separately from other start values, has the last objective.
    let alone = place.good("solve case.toml --design case --json").event("result");
    let alone = alone["objective"].as_f64().expect("a number");
    assert!((alone / objective(5) - 1.0).abs() < 1e-9, "{alone} {}", objective(5));
    // An optimization that starts from that design begins with its objective.
    place.good("optimize case.toml --design case --out second --iterations 1");
    assert_eq!(number(&place.table("second/history.csv")[1][1]), alone);
}

#[test]
fn evaluate_makes_the_table_of_other_frictions() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 2 -q");
    let ran = place.good("evaluate case.toml --design case --friction 0,0.3");
    assert!(ran.out.contains("objective/volume fraction"));
    let table = place.table("case_evaluate/evaluate.csv");
    assert_eq!(table.len(), 3);
    let history = place.table("case/history.csv");
    let ratio = number(&table[2][1]) / number(&history[3][1]);
    assert!((ratio - 1.0).abs() < 1e-9, "from other start values, the history's objective at the case's own friction");
    assert!((number(&table[2][1]) / number(&table[2][2]) - number(&table[2][3])).abs() < 1e-9);
    assert_ne!(table[1][1], table[2][1]);
    // Without friction no node sticks.
    assert_eq!(table[1][7], "0");
    let own = place.good("evaluate case.toml --design case/design.csv --json --force").event("evaluation");
    assert_eq!(own["friction"], 0.3);
}

#[test]
fn events_are_one_object_per_line() {
    let place = Place::with("min = [0.6, 1.0,", "min = [0.6, 0.99,");
    let events = place.good("optimize case.toml --iterations 1 --json").events();
    let names: Vec<&str> = events.iter().filter_map(|event| event["event"].as_str()).collect();
    assert_eq!(names.len(), events.len(), "each has a name");
    let count = |name: &str| names.iter().filter(|found| **found == name).count();
    assert_eq!((count("start"), count("iteration"), count("result")), (1, 2, 1));
    assert_eq!(count("step"), 2 * 4);
    let warning = events.iter().find(|event| event["event"] == "warning").expect("it penetrates");
    assert_eq!(warning["code"], "slipstick::case::penetrating_start");
    assert_eq!(names.last(), Some(&"result"));

    let error = place.run("optimize case.toml --json");
    assert_eq!(error.code, Some(2));
    assert!(error.event("error")["message"].as_str().expect("text").contains("already"));
    assert_eq!(place.good("solve case.toml --quiet").out, "");
}

/// Results do not depend on the number of threads.
#[test]
fn threads_do_not_change_results() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 2 --threads 1 --out one");
    place.good("optimize case.toml --iterations 2 --threads 2 --out two");
    assert_eq!(place.read("one/checkpoint.json"), place.read("two/checkpoint.json"));
    assert_eq!(place.json("one/run.json")["threads"], 1);
}

/// An objective that is only round-off ends an optimization with an error; the computed results are
/// kept, and `resume` reports the same.
#[test]
fn an_optimization_of_rounding_ends() {
    let place = Place::new();
    // 0.5 above the slab, and pressed down by 0.1
    let away =
        CASE.replace("min = [0.6, 1.0, 0.3], max = [2.0, 1.7, 1.6]", "min = [0.6, 1.5, 0.3], max = [2.0, 2.2, 1.6]");
    place.write("case.toml", &away);
    let foreseen = [
        "case.toml:10:1: warning: `block_ymin` and `slab_ymax` never touch: the initial gap is 0.5",
        "close at most 0.1 of it",
        "[slipstick::case::never_closes]",
    ];
    let ran = place.good("check case.toml");
    assert!(foreseen.iter().all(|part| ran.err.contains(part)), "{}", ran.err);
    assert!(!ran.err.contains("no_contact") && ran.out.contains("see the warnings"), "{}", ran.err);
    let expected = [
        "error: there is nothing to optimize: the objective is",
        "contact never closes on the path",
        "help: make the motions close the gap",
        "kept: case: ",
    ];
    let ran = place.bad("optimize case.toml", 3, &[&foreseen[..], &expected].concat());
    assert_eq!(ran.out, "", "no iteration was made");
    assert_eq!(place.json("case/run.json")["exit"], "failed");
    for name in ["design.csv", "checkpoint.json", "path.pvd", "path_0004.vtu", "contact.csv"] {
        assert!(place.path("case").join(name).exists(), "{name}");
    }
    place.bad("resume case", 3, &expected[..2]);
    let told = place.run("optimize case.toml --json --force").event("error");
    assert!(told["failure"]["cures"].as_array().is_some_and(|cures| cures.len() == 2) && told["exit"] == 3, "{told}");
    place.good("render case --field displacement");
    assert!(place.good("explain never_closes").out.contains("place.translate"));
}

/// Five iterations are enough without friction but not with it in the third step: the first row is
/// kept, and the failure names the coefficient.
#[test]
fn evaluate_goes_on_after_a_failure() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 1 -q");
    let few = "--set load_path.max_newton_iterations=4 --set load_path.max_cutbacks=0";
    let line = format!("evaluate case.toml --design case --friction 0.3,0 {few}");
    let expected =
        ["load step 1 failed: with friction 0.3, no convergence in 4 Newton iterations", "kept: case_evaluate"];
    place.bad(&line, 3, &expected);
    let table = place.table("case_evaluate/evaluate.csv");
    assert_eq!((table[1][0].as_str(), table[1][1].as_str()), ("0.3", ""));
    assert!(number(&table[2][1]) < 0.0, "the analysis without friction: {:?}", table[2]);
}

/// A run with a coarser mesh gives a case its design, by position: the two elements along x that
/// divide one of the run have its density. A table that is given as a file must match the mesh.
#[test]
fn a_design_of_another_mesh_is_mapped() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 2 --out coarse");
    let fine = "case.toml --set body[0].box.elements=[8,2,2]";
    let ran = place.good(&format!("gradient {fine} --design coarse --out fine"));
    let told = "warning: coarse: the run has a different mesh; its design is mapped from 20 elements to 36";
    assert!(ran.err.contains(told), "{}", ran.err);
    let densities = |table: &str| -> Vec<f64> {
        let table = place.read(table);
        table.lines().skip(1).map(|row| row.split(',').nth(2).expect("a density").parse().expect("a number")).collect()
    };
    let (coarse, fine_densities) = (densities("coarse/design.csv"), densities("fine/gradient.csv"));
    assert!(coarse[..16].iter().any(|phi| (phi - 0.5).abs() > 0.01), "the coarse design has changed: {coarse:?}");
    for (e, phi) in fine_densities[..32].iter().enumerate() {
        let parent = e / 8 * 4 + e % 8 / 2;
        assert!((phi - coarse[parent]).abs() < 1e-12, "element {e}: {phi} instead of {}", coarse[parent]);
    }
    let table = format!("solve {fine} --design coarse/design.csv --out table");
    place.bad(&table, 2, &["element 16 belongs to body `block` here, but to `slab` in the case"]);
    let renamed = place.read("case.toml").replace("\"slab\"", "\"plate\"").replace("slab_y", "plate_y");
    place.write("renamed.toml", &renamed);
    let line = "solve renamed.toml --set body[0].box.elements=[8,2,2] --design coarse --out other";
    place.bad(line, 2, &["the run has a different mesh and no body `plate`", "those of the run are: slab, block"]);
}

/// In an initial design of 1, no density can increase: differences are one-sided, and their error
/// decreases with the square of the step.
#[test]
fn gradients_are_verified_at_full_material() {
    let place = Place::with("initial = 0.5\nvolume_fraction = 0.5", "initial = 1.0\nvolume_fraction = 1.0");
    let ran = place.good("verify gradient case.toml --elements 2 --directions 1 --halvings 2 --step 0.005");
    assert!(
        ran.out.contains("random direction 1 off the bounds: adjoint") && ran.out.contains("confirmed: "),
        "{}",
        ran.out
    );
    let norm = ran.out.split("norm of its gradient ").nth(1).and_then(|rest| rest.lines().next()).expect("a norm");
    let derivatives = place.good("gradient case.toml --json").event("result");
    let expected = derivatives["gradient_norm"].as_f64().expect("a number");
    assert!((number(norm) / expected - 1.0).abs() < 1e-5 && expected > 1.0, "{norm} {expected}");
    let table = place.table("case_verify/verify.csv");
    let column = |name: &str| table[0].iter().position(|found| found == name).expect(name);
    assert!(table[1..].iter().all(|row| row[column("one_sided")] == "1"));
    let error = |row: usize| number(&table[row][column("relative_error")]);
    for row in [1, 2] {
        let order = (error(row) / error(row + 1)).log2();
        assert!((order - 2.0).abs() < 0.1, "{order}");
    }
    // with some densities at a bound, the interior ones are compared as usual and the others
    // separately
    let rows: Vec<String> =
        (0..20).map(|e| format!("{e},{}", if e % 4 == 0 || e > 15 { "1.0" } else { "0.5" })).collect();
    place.write("mixed.csv", &format!("element,density\n{}\n", rows.join("\n")));
    let line = "verify gradient case.toml --design mixed.csv --elements 1 --directions 1 --halvings 1 --out mixed";
    let out = place.good(line).out;
    for name in ["random direction 1: adjoint", "random direction 1 off the bounds: adjoint", "element "] {
        assert!(out.contains(name), "{name}: {out}");
    }
    assert_eq!(out.matches("one-sided differences").count(), 1, "{out}");
}

/// Lists of load steps count within each load case; files and tables count through all of them.
#[test]
fn steps_of_objectives_count_within_load_cases() {
    let text = CASE.replace("[load_path]", "[[load_case]]\nname = \"one\"\n[[load_case]]\nname = \"two\"\n[load_path]");
    let place = Place::new();
    place.write("case.toml", &text.replace("steps = \"last\"", "steps = [2, 4]"));
    let event = place.good("solve case.toml --json").event("result");
    let values = event["step_values"].as_array().expect("a list");
    let observed: Vec<usize> = (1..=8).filter(|step| !values[step - 1].is_null()).collect();
    assert_eq!(observed, [2, 4, 6, 8]);
    assert!(place.path("case_solve/path_0008.vtu").exists());
    let rows = place.table("case_solve/contact.csv");
    let cell = |row: usize| (rows[row][0].clone(), rows[row][1].clone(), rows[row][2].clone());
    assert_eq!(cell(7), ("6".into(), "1".into(), "0.5".into()), "step 6 is the second of the second load case");
    place.bad("check case.toml --set objective.contact_force.steps=[5]", 2, &["there is no load step 5", "1 to 4"]);
}

/// Load cases are reported by name, and their parts of the objective equal those of separate runs.
#[test]
fn load_cases_are_told_by_their_names() {
    let place = Place::new();
    let driven = CASE.find("[[dirichlet]]\nset = \"block_ymax\"").expect("the driven face");
    let (bodies, rest) = (&CASE[..driven], &CASE[CASE.find("[load_path]").expect("a load path")..]);
    let motion =
        |name: &str, u: &str| format!("[[dirichlet]]\nset = \"block_ymax\"\n{name}motion = [{{ t = 1.0, u = {u} }}]\n");
    let named = |name: &str, u: &str| motion(&format!("load_case = \"{name}\"\n"), u);
    let (back, forth) = ("[-0.1, -0.08, 0]", "[0.2, -0.1, 0.05]");
    place.write("back.toml", &format!("{bodies}{}{rest}", motion("", back)));
    place.write("forth.toml", &format!("{bodies}{}{rest}", motion("", forth)));
    let cases = "[[load_case]]\nname = \"back\"\n[[load_case]]\nname = \"forth\"\nweight = 0.5\n";
    place.write("both.toml", &format!("{bodies}{}{}{cases}{rest}", named("back", back), named("forth", forth)));
    let value = |case: &str| {
        let event = place.good(&format!("solve {case}.toml --json --out {case}_json")).event("result");
        event["objective"].as_f64().expect("a number")
    };
    let parts = [value("back"), 0.5 * value("forth")];
    assert!((value("both") / (parts[0] + parts[1]) - 1.0).abs() < 1e-9);
    let told = place.good("solve both.toml").out;
    for line in ["step   4  back t = 1.00000", "step   5  forth t = 0.25000"] {
        assert!(told.contains(line), "no `{line}` in\n{told}");
    }
    let (_, shares) = told.split_once("objective ").expect("the objective");
    let shares = shares.lines().next().expect("a line");
    for (name, part) in ["back", "forth"].iter().zip(parts) {
        let (_, told) = shares.split_once(&format!("{name} ")).expect("a part");
        let told = number(told.split([',', ' ']).next().expect("a number"));
        assert!((told / part - 1.0).abs() < 1e-6, "{name}: {told} for {part}");
    }
    let steps = place.good("solve both.toml --json --force").events();
    let names: Vec<&Value> = steps.iter().filter(|e| e["event"] == "step").map(|e| &e["load_case"]).collect();
    assert!(names[..4].iter().all(|name| *name == "back") && names[4..].iter().all(|name| *name == "forth"));
    place.good("report both_solve");
    assert_eq!(place.read("both_solve/report.html").matches("\"load_case\":\"forth\",\"time\":").count(), 4);
}

/// Results never replace the design that they are computed from.
#[test]
fn a_design_is_not_overwritten_by_what_is_made_of_it() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 1");
    let before = place.read("case/design.csv");
    for line in [
        "evaluate case.toml --design case --out case --force",
        "solve case.toml --design case/design.csv --out case --force",
    ] {
        place.bad(line, 2, &["case contains the requested design", "--out"]);
    }
    assert_eq!(place.read("case/design.csv"), before);
    assert!(place.path("case/checkpoint.json").exists());
}
