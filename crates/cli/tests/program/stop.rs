//! Runs that stop early, because of Ctrl-C or a failure.

use std::collections::BTreeSet;

use slipstick::output::read_fields;

use super::*;

#[cfg(unix)]
mod by_signal {
    use super::*;
    use std::io::{BufRead, BufReader, Read};
    use std::process::{Child, Stdio};
    use std::time::Duration;

    fn interrupt(child: &Child) {
        let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
        assert!(sent.success());
    }

    /// Starts a command and interrupts it after the first event with this name.
    fn interrupted_after(place: &Place, line: &str, event: &str) -> (Option<i32>, String, String) {
        let mut child =
            place.command(line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs");
        let mut reader = BufReader::new(child.stdout.take().expect("piped"));
        let mut out = String::new();
        while !out.lines().any(|line| line.contains(&format!("\"event\":\"{event}\""))) {
            assert!(reader.read_line(&mut out).expect("text") > 0, "ended before {event}:\n{out}");
        }
        interrupt(&child);
        reader.read_to_string(&mut out).expect("text");
        let mut err = String::new();
        child.stderr.take().expect("piped").read_to_string(&mut err).expect("text");
        (child.wait().expect("ends").code(), out, err)
    }

    #[test]
    fn an_interrupted_optimization_resumes_bit_for_bit() {
        let place = Place::with("iterations = 4", "iterations = 40");
        let (code, out, err) = interrupted_after(&place, "optimize case.toml --json", "iteration");
        assert_eq!(code, Some(4), "{out}{err}");
        // in the words of the book
        let book = include_str!("../../../../docs/how_to.md");
        let quoted = book.split("## Stop a run").nth(1).and_then(|rest| rest.split("```").nth(1)).expect("a block");
        let quoted = quoted.lines().nth(1).expect("a line");
        assert!(quoted.starts_with("stopping when") && err.contains(quoted), "{quoted}\n{err}");
        let last: Value = serde_json::from_str(out.lines().last().expect("a line")).expect("JSON");
        assert_eq!((&last["event"], &last["exit"], &last["resume"]), (&"error".into(), &4.into(), &"case".into()));
        assert_eq!(place.json("case/run.json")["exit"], "interrupted");
        let reached = place.json("case/checkpoint.json")["state"]["iteration"].as_u64().expect("a number");
        assert!((1..40).contains(&reached), "{reached}");

        place.good("resume case -q");
        place.good("optimize case.toml --out whole -q");
        for name in ["checkpoint.json", "design.csv", "newton.csv"] {
            assert_eq!(place.read(&format!("case/{name}")), place.read(&format!("whole/{name}")), "{name}");
        }
    }

    /// There is a checkpoint even before the first iteration is finished.
    #[test]
    fn an_optimization_interrupted_at_once_resumes_from_its_start() {
        let place = Place::with("steps = 4", "steps = 60");
        let (code, _, err) = interrupted_after(&place, "optimize case.toml --json --iterations 1", "step");
        assert_eq!(code, Some(4), "{err}");
        assert_eq!(place.json("case/checkpoint.json")["state"]["iteration"], 0);
        place.good("resume case -q");
        assert_eq!(place.table("case/history.csv").len(), 1 + 2);
    }

    /// A command that has nothing to finish ends by the signal: this surface would take long to remesh.
    #[test]
    fn a_request_to_terminate_ends_an_export() {
        use std::os::unix::process::ExitStatusExt;
        let place = Place::new();
        place.good("optimize case.toml --iterations 1 -q");
        let mut child =
            place.command("export case --threshold 0.1 --case part --size 0.006").spawn().expect("the program runs");
        // long enough for a handler that would swallow the signal
        std::thread::sleep(Duration::from_millis(500));
        let sent = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill runs");
        assert!(sent.success() && child.wait().expect("ends").signal() == Some(15));
        assert!(!place.path("part").exists());
    }

    /// Only one process at a time writes to a directory; the lock of a killed process blocks
    /// nobody.
    #[test]
    fn a_run_in_progress_is_left_alone() {
        let place = Place::with("iterations = 4", "iterations = 4000");
        let mut child = place.command("optimize case.toml --json").stdout(Stdio::piped()).spawn().expect("it runs");
        let mut reader = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        while !line.contains("\"event\":\"iteration\"") {
            line.clear();
            assert!(reader.read_line(&mut line).expect("text") > 0, "ended before an iteration");
        }
        let started = place.json("case/run.json")["start"].clone();
        for line in ["resume case", "optimize case.toml", "optimize case.toml --force", "solve case.toml --out case"] {
            place.bad(line, 2, &["another slipstick process is writing to case", "help: wait until it ends"]);
        }
        assert_eq!(place.json("case/run.json")["start"], started);
        place.good("render case");
        child.kill().expect("killed");
        child.wait().expect("ends");
        assert!(place.path("case/run.lock").exists(), "left behind");
        let made = place.json("case/checkpoint.json")["state"]["iteration"].as_u64().expect("a number");
        place.good(&format!("resume case -q --iterations {}", made + 1));
    }

    /// Differences of incomplete paths are meaningless.
    #[test]
    fn an_interrupted_verification_says_so() {
        let place = Place::with("steps = 4", "steps = 60");
        let (code, out, err) = interrupted_after(&place, "verify gradient case.toml --json", "step");
        assert_eq!(code, Some(4), "{out}{err}");
        let last: Value = serde_json::from_str(out.lines().last().expect("a line")).expect("JSON");
        assert_eq!((&last["event"], &last["message"]), (&"error".into(), &"nothing was compared".into()));
        assert_eq!(place.json("case_verify/run.json")["exit"], "interrupted");
        assert!(!place.path("case_verify/verify.csv").exists());
    }

    /// A block that is crushed: no state follows step 11, and the attempt may take a million Newton
    /// iterations. SIGTERM stops within one of them, and the states are on disk.
    #[test]
    fn an_attempt_at_a_step_is_interrupted() {
        let place = Place::with("steps = 4", "steps = 4");
        std::fs::write(place.path("crushed.toml"), CRUSHED).expect("written");
        let mut child =
            place.command("solve crushed.toml --json").stdout(Stdio::piped()).spawn().expect("the program runs");
        let mut reader = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        while !line.contains("\"step\":11") {
            line.clear();
            assert!(reader.read_line(&mut line).expect("text") > 0, "ended before step 11");
        }
        std::thread::sleep(Duration::from_millis(500));
        assert!(child.try_wait().expect("known").is_none(), "the attempt lasts");
        // the curves up to step 11 can be plotted meanwhile
        for name in ["quantities.csv", "contact.csv"] {
            let table = place.table(&format!("crushed_solve/{name}"));
            assert_eq!(table.last().expect("a row")[0], "11", "{name}");
        }
        assert!(place.read("crushed_solve/path.pvd").contains("path_0011.vtu"));
        place.good("render crushed_solve --curve time strain_energy");
        let sent = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill runs");
        assert!(sent.success());
        let ended = (0..300).find_map(|_| {
            std::thread::sleep(Duration::from_millis(100));
            child.try_wait().expect("known")
        });
        if ended.is_none() {
            child.kill().expect("killed");
        }
        assert_eq!(ended.expect("ends within an iteration").code(), Some(4));
        assert!(place.path("crushed_solve/path_0011.vtu").exists());
        assert_eq!(place.json("crushed_solve/run.json")["exit"], "interrupted");
    }

    /// What a killed run leaves behind is the beginning of what the whole run writes.
    #[test]
    fn a_killed_analysis_leaves_its_curves() {
        let place = Place::with("steps = 4", "steps = 60");
        let mut child =
            place.command("solve case.toml --json --out killed").stdout(Stdio::piped()).spawn().expect("it runs");
        let mut reader = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        while !line.contains("\"step\":9,") {
            line.clear();
            assert!(reader.read_line(&mut line).expect("text") > 0, "ended before step 9");
        }
        child.kill().expect("killed");
        child.wait().expect("ends");
        place.good("solve case.toml --out whole -q");
        for name in ["quantities.csv", "contact.csv"] {
            let [killed, whole] = ["killed", "whole"].map(|run| place.read(&format!("{run}/{name}")));
            assert!(whole.starts_with(&killed) && killed.ends_with('\n'), "{name}");
            let steps: Vec<&str> = killed.lines().skip(1).map(|line| line.split(',').next().expect("a cell")).collect();
            assert!(steps.len() > 9 && steps.contains(&"9") && whole.len() > killed.len(), "{name}: {steps:?}");
        }
        let listed = place.read("killed/path.pvd").matches(".vtu").count();
        assert!((10..61).contains(&listed), "{listed}");
        for step in 0..listed {
            let name = format!("path_{step:04}.vtu");
            let [killed, whole] =
                ["killed", "whole"].map(|run| std::fs::read(place.path(run).join(&name)).expect("it"));
            assert!(killed == whole, "{name}");
        }
        place.good("render killed --curve time strain_energy");
        place.good("render killed -o picture.png");
    }

    const CRUSHED: &str = r#"
[[body]]
name = "block"
box = { min = [0.0, 0.0, 0.0], max = [2.0, 1.0, 1.0], elements = [8, 4, 4] }
material = { neo_hooke = { youngs_modulus = 10.0, poisson_ratio = 0.4 } }

[[body]]
name = "plate"
box = { min = [0.3, 1.0, 0.1], max = [1.7, 1.5, 0.9], elements = [6, 2, 3] }
material = { neo_hooke = { youngs_modulus = 10.0, poisson_ratio = 0.4 } }

[[contact]]
slave = "plate_ymin"
master = "block_ymax"
friction = 0.3

[[dirichlet]]
set = "block_ymin"

[[dirichlet]]
set = "plate_ymax"
motion = [{ t = 1.0, u = [0.0, -1.6, 0.0] }]

[load_path]
steps = 20
max_newton_iterations = 1000000
"#;

    #[test]
    fn an_interrupted_analysis_keeps_its_states() {
        let place = Place::with("steps = 4", "steps = 400");
        let (code, _, err) = interrupted_after(&place, "solve case.toml --json", "step");
        assert_eq!(code, Some(4), "{err}");
        assert!(place.path("case_solve/path_0001.vtu").exists());
        assert!(!place.path("case_solve/path_0400.vtu").exists());
    }
}

/// Three Newton iterations are not enough for these steps, and no smaller ones are allowed.
#[test]
fn a_failed_march_says_why_and_keeps_what_it_has() {
    let place = Place::with("steps = 4", "steps = 4\nmax_newton_iterations = 3\nmax_cutbacks = 0");
    let expected = [
        "load step 1 failed",
        "no convergence in 3 Newton iterations",
        "reached: t = 0",
        "last Newton iterations:",
        "      3: residual ",
        "tried:",
        "help: more Newton iterations (`load_path.max_newton_iterations`): the residual was still decreasing",
        "help: more load steps",
        "`slipstick render case_solve --failure` draws it",
    ];
    place.bad("solve case.toml", 3, &expected);
    assert!(place.path("case_solve/failure.vtu").exists() && place.path("case_solve/path_0000.vtu").exists());
    let record = place.json("case_solve/run.json");
    assert_eq!(record["exit"], "failed");
    assert!(record["message"].as_str().expect("text").contains("load step 1 failed"));
    let event = place.run("optimize case.toml --json").event("error");
    assert_eq!((&event["exit"], &event["failure"]["step"]), (&3.into(), &1.into()));
    let failed = place.table("case/newton.csv");
    assert_eq!(failed[0].last().map(String::as_str), Some("failure"));
}

/// The block driven through the slab's support: elements are turned inside out, and are named with
/// body and place. The failing iterate shows them, in its file and in a picture.
#[test]
fn inverted_elements_are_named() {
    let place = Place::with("t = 0.5, u = [0, -0.1, 0]", "t = 0.5, u = [0, -2.2, 0]");
    let expected = ["inverted element", "first: element ", "of body `", "help: ", "kept: case_solve"];
    place.bad("solve case.toml", 3, &expected);
    // The states that converged before are kept.
    assert!(place.path("case_solve/path_0001.vtu").exists() && place.path("case_solve/path.pvd").exists());

    let failure = place.run("solve case.toml --json --force").event("error")["failure"].clone();
    let fields = read_fields(&place.path("case_solve/failure.vtu")).expect("the failing iterate");
    let determinants = &fields.iter().find(|field| field.name == "smallest_determinant").expect("its field").values;
    let places = failure["places"].as_array().expect("places");
    assert!(!places.is_empty());
    for at in places {
        let element = at["number"].as_u64().expect("a number") as usize;
        assert!(at["kind"] == "element" && determinants[element] <= 0.0, "{at}: {}", determinants[element]);
    }
    place.good("render case_solve --failure -o failure.png");
    assert!(std::fs::read(place.path("failure.png")).expect("a picture").starts_with(b"\x89PNG"));
    place.good("solve case.toml --out whole --set dirichlet[1].motion=[{t=1,u=[0,-0.1,0]}]");
    place.bad("render whole --failure", 2, &["whole has no failure.vtu", "help: omit --failure"]);
}

/// Friction of 20 in one long step: two nodes keep changing between stick and slip, and are named.
#[test]
fn nodes_that_go_on_changing_their_status_are_named() {
    let place = Place::with("friction = 0.3", "friction = 20.0");
    let case = place.read("case.toml").replace("steps = 4", "steps = 1\nmax_cutbacks = 0");
    let motion = case.lines().find(|line| line.starts_with("motion")).expect("the motion").to_owned();
    place.write("case.toml", &case.replace(&motion, "motion = [{ t = 1.0, u = [-0.228, -0.092, -0.461] }]"));
    let expected = [
        "load step 1 failed: no convergence in 25 Newton iterations: 1 slave node still changes between stick",
        "    at node ",
        "of body `block` at (",
        "    last Newton iterations:",
        "help: more load steps",
        "help: another `complementarity_parameter`",
    ];
    let ran = place.bad("solve case.toml", 3, &expected);
    assert!(!ran.err.contains("max_newton_iterations"), "more of the same would not help\n{}", ran.err);
    let failure = place.run("solve case.toml --json --force").event("error")["failure"].clone();
    let iterations = failure["iterations"].as_array().expect("iterations");
    let statuses: BTreeSet<String> = iterations.iter().map(|iteration| iteration["status"].to_string()).collect();
    assert!(iterations.len() == 5 && statuses.len() == 2, "{iterations:?}");
    let places = failure["places"].as_array().expect("places");
    assert_eq!(places.len(), 1);
    for at in places {
        // on the block's lower face
        assert!(at["kind"] == "node" && at["position"][1] == 1.0, "{at}");
    }
    place.good("render case_solve --failure --field status");
}

/// Elements that are pressed through themselves: a stiffer void is a remedy only if there is a design.
#[test]
fn remedies_are_those_of_the_case() {
    let place = Place::new();
    let case = place.read("case.toml").replace("steps = 4", "steps = 1\nmax_cutbacks = 0");
    let motion = case.lines().find(|line| line.starts_with("motion")).expect("the motion").to_owned();
    let case = case.replace(&motion, "motion = [{ t = 1.0, u = [0, -1.4, 0] }]");
    let undesigned = &case[..case.find("[design]").expect("a design")];
    place.write("undesigned.toml", undesigned);
    place.write("case.toml", &case);
    let [with, without] =
        ["case", "undesigned"].map(|case| place.bad(&format!("solve {case}.toml"), 3, &["inverted"]).err);
    assert!(with.contains("help: a stiffer void (`design.simp.min`)"), "{with}");
    assert!(!without.contains("simp.min") && without.contains("help: more load steps"), "{without}");
}
