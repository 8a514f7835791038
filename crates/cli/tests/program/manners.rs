//! What the program says about itself, and other small matters that users notice.

use super::*;

#[test]
fn codes_are_explained() {
    let place = Place::new();
    let all = place.good("explain").out;
    assert!(all.contains("unknown_key") && all.contains("penetrating_start"), "{all}");
    // In the form shown in messages: in brackets and with its prefix.
    let place = Place::with("friction = 0.3", "fricton = 0.3");
    let message = place.bad("check case.toml", 2, &["unknown_key"]).err;
    let mut brackets = message.split('[').filter_map(|part| Some(part.split_once(']')?.0.to_owned()));
    let code = brackets.find(|text| text.starts_with("slipstick::case::")).expect("a code");
    for asked in [code.clone(), format!("[{code}]"), "unknown_key".into()] {
        let text = place.good(&format!("explain {asked}")).out;
        assert!(text.contains("A key that does not exist here.") && text.contains("docs/case_file.md"), "{text}");
    }
    let event = place.good("explain locking --json").event("result");
    assert_eq!(event["code"], "slipstick::case::locking");
    place.bad("explain key", 2, &["no code `key`", "unknown_key, missing_key"]);
    place.bad("explain billiards", 2, &["no code `billiards`", "lists all"]);
}

#[test]
fn shells_and_man_know_the_commands() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = place.good(&format!("completions {shell}")).out;
        assert!(script.contains("slipstick") && script.contains("evaluate"), "{shell}");
    }
    place.bad("completions cmd", 2, &["cmd", "bash"]);
    assert!(place.good("man").out.contains(".TH slipstick 1"));
    assert!(place.good("man optimize").out.contains(".TH slipstick-optimize 1"));
    place.bad("man billiards", 2, &["no command `billiards`"]);
}

/// A terminal keeps the line of every iteration, with the progress below them. `script`
/// (util-linux, bsdutils) provides the terminal.
#[cfg(target_os = "linux")]
#[test]
fn a_terminal_keeps_the_table_of_iterations() {
    let place = Place::new();
    let line = format!("{} optimize case.toml --iterations 3", env!("CARGO_BIN_EXE_slipstick"));
    let shown = Command::new("script")
        .args(["-qec", &line, "/dev/null"])
        .current_dir(place.folder.path())
        .env("TERM", "xterm")
        .stdin(std::process::Stdio::null())
        .output();
    let Ok(output) = shown else {
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), "SKIPPED a_terminal_keeps_the_table_of_iterations: no `script`");
        return;
    };
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{shown}");
    let piped = place.good("optimize case.toml --iterations 3 --out piped").out;
    let table = |text: &str| -> Vec<String> {
        let row = |line: &str| Some(line[line.find("  objective ")? - 5..line.find("  Newton ")?].to_owned());
        text.lines().filter_map(row).collect()
    };
    assert_eq!(table(&piped).len(), 4, "{piped}");
    assert_eq!(table(&shown), table(&piped), "{shown}");
    assert!(shown.contains("iteration 2: step "), "{shown}");
}

/// The schema is written to the given file, and replaces an existing one only on request.
#[test]
fn the_schema_is_written() {
    let place = Place::new();
    let schema: Value = serde_json::from_str(&place.good("schema").out).expect("JSON");
    assert_eq!(schema["title"], "slipstick case file");
    place.good("schema --out case.schema.json");
    assert_eq!(place.json("case.schema.json"), schema);
    place.bad("schema --out case.toml", 2, &["case.toml already exists", "--force"]);
    place.good("schema --out case.schema.json --force");
}

/// Errors about counts use the program's own words.
#[test]
fn counts_are_greater_than_zero() {
    let place = Place::new();
    for line in ["optimize case.toml --iterations 0", "resume case --iterations -1", "solve case.toml --threads 0.5"] {
        place.bad(line, 2, &[]);
    }
    place.bad("optimize case.toml --iterations 0", 2, &["a whole number greater than zero is expected"]);
}

/// Steps that the objective does not observe have no value, rather than the value 0.
#[test]
fn only_observed_steps_have_values() {
    let place = Place::new();
    let event = place.good("solve case.toml --json").event("result");
    let values = event["step_values"].as_array().expect("a list");
    assert_eq!(values.len(), 4);
    assert!(values[..3].iter().all(Value::is_null), "{values:?}");
    assert_eq!(values[3], event["objective"]);
    let place = Place::with("steps = \"last\"", "steps = \"all\"");
    let event = place.good("solve case.toml --json").event("result");
    let sum: f64 = event["step_values"].as_array().expect("a list").iter().filter_map(Value::as_f64).sum();
    assert!((sum / event["objective"].as_f64().expect("a number") - 1.0).abs() < 1e-12);
}

/// The last design has no derivative, because only an update needs one, and its table has no column
/// for it.
#[test]
fn tables_of_densities_have_no_empty_column() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 1 -q");
    assert_eq!(place.table("case/design.csv")[0], ["element", "body", "density"]);
    assert!(place.table("case/design.csv").iter().all(|row| row.len() == 3));
    place.good("gradient case.toml --design case");
}

#[test]
fn a_history_with_other_rows_is_not_gone_on_with() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 3 -q");
    let whole = place.read("case/history.csv");
    let lines: Vec<&str> = whole.lines().collect();
    let without = |row: usize| -> String {
        lines.iter().enumerate().filter(|(at, _)| *at != row).map(|(_, line)| format!("{line}\n")).collect()
    };
    for row in [1, 2, 3] {
        place.write("case/history.csv", &without(row));
        place.bad(
            "resume case --iterations 4",
            2,
            &["history.csv: line", "rows were changed, added or removed", "help: "],
        );
        assert_eq!(place.read("case/history.csv"), without(row), "it is left as it is");
    }
    place.write("case/history.csv", &whole);
    place.good("resume case --iterations 4");
    assert_eq!(place.table("case/history.csv").len(), 1 + 5);
}
