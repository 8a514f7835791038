//! Memory of runs: what `check` predicts, what they take, and what is refused.

use super::*;

/// The case with more elements, this method and these further tables.
fn larger(enforcement: &str, more: &str) -> Place {
    let case = CASE
        .replace("elements = [4, 2, 2]", "elements = [16, 8, 10]")
        .replace("elements = [2, 1, 2]", "elements = [6, 3, 6]")
        .replace("tolerance = { relative = 1e-11 }", "")
        .replace("friction = 0.3", &format!("friction = 0.3\nenforcement = {enforcement}"));
    let place = Place::new();
    place.write("case.toml", &format!("{case}{more}"));
    place
}

/// Prediction and measurement (`VmHWM`) agree to a quarter without kept factors, whatever the method. With them the
/// prediction is a bound: steps share factors as long as the active set stays.
#[test]
fn predicted_memory_is_that_of_runs() {
    let none = "[adjoint]\nmemory = \"0\"\n";
    let cases = [
        ("Lagrange", "{ lagrange = {} }", none),
        ("penalty", "{ penalty = {} }", none),
        ("plain Uzawa", "{ augmented = { acceleration = 0, tolerance = 1e-2 } }", none),
        ("double precision", "{ penalty = {} }", "[adjoint]\nmemory = \"0\"\n[solver]\nlinear = \"multifrontal\"\n"),
        ("kept factors", "{ lagrange = {} }", ""),
    ];
    for (name, enforcement, more) in cases {
        let place = larger(enforcement, more);
        let inspection = place.good("--json check case.toml").event("result")["inspection"].clone();
        let predicted = |name: &str| inspection[name].as_f64().expect("a number");
        let result = place.good("--json optimize case.toml --iterations 1 --threads 1").event("result");
        let measured = result["peak_bytes"].as_f64().expect("a number");
        let (most, least) = (predicted("peak_bytes"), predicted("peak_bytes") - predicted("kept_bytes"));
        println!("{name}: {:.1} to {:.1} MB predicted, {:.1} MB measured", least / 1e6, most / 1e6, measured / 1e6);
        assert!(measured < 1.25 * most && measured > 0.75 * least, "{name}: {measured:e}, {least:e} to {most:e}");
    }
}

/// A run that would not fit into the memory that the process may have is refused before it begins, with what helps: less for
/// kept factors where that is enough, else fewer elements. `check` says the same and shows the rest.
#[test]
fn runs_larger_than_the_memory() {
    let place = Place::new();
    let case = CASE.replace("elements = [4, 2, 2]", "elements = [12, 8, 8]").replace("steps = 4", "steps = 40");
    place.write("case.toml", &case);
    let limited = |line: &str, megabytes: f64| {
        let mut command = Command::new("sh");
        command.current_dir(place.folder.path()).env("MALLOC_ARENA_MAX", "1").arg("-c");
        command.arg(format!("ulimit -v {:.0}; exec \"$0\" --threads 1 \"$@\"", 1e6 * megabytes / 1024.0));
        command.arg(env!("CARGO_BIN_EXE_slipstick")).args(line.split_whitespace());
        Ran::new(line, command.output().expect("sh"))
    };
    let inspection = place.good("--json check case.toml").event("result")["inspection"].clone();
    let number = |name: &str| inspection[name].as_f64().expect("a number") / 1e6;
    let (peak, kept) = (number("peak_bytes"), number("kept_bytes"));
    assert!(kept > 0.5 * peak, "{kept} of {peak}");
    // Addresses of the program's own text and stacks come on top, so a little less than the limit is left.
    for (megabytes, help) in [(peak, "memory = \""), (peak - kept, "take fewer elements")] {
        let ran = limited("gradient case.toml", megabytes);
        assert_eq!(ran.code, Some(2), "{}", ran.err);
        for part in ["a run needs about", "too_large", help] {
            assert!(ran.err.contains(part), "no `{part}` in {}", ran.err);
        }
        let checked = limited("check case.toml", megabytes);
        assert_eq!(checked.code, Some(0), "{}", checked.err);
        assert!(checked.err.contains("warning: a run needs about"), "{}", checked.err);
    }
    assert!(!place.path("case_gradient").exists(), "nothing began");
}
