//! Wrong input ends with exit code 2, and the message gives the place and the cure.

use super::*;

/// A change of the case, and what `check` must say about it.
fn refused(from: &str, to: &str, expected: &[&str]) {
    let place = Place::with(from, to);
    let ran = place.bad("check case.toml", 2, expected);
    assert!(ran.err.contains("case.toml:"), "no place in\n{}", ran.err);
    assert!(ran.err.contains("help: ") || ran.err.contains("must be"), "no cure in\n{}", ran.err);
    assert!(ran.err.contains("[slipstick::case::"), "no code in\n{}", ran.err);
    // A run reports the same and leaves nothing behind.
    place.bad("optimize case.toml", 2, expected);
    assert!(!place.path("case").exists());
}

#[test]
fn unknown_keys_and_names() {
    refused("friction = 0.3", "fricton = 0.3", &["case.toml:13:1: error: unknown key `fricton`", "friction"]);
    refused("set = \"slab_ymin\"", "set = \"slab_bottom\"", &["slab_bottom", "unknown_set"]);
    refused("slave = \"block_ymin\"", "slave = \"block\"", &["block"]);
}

#[test]
fn values_out_of_range() {
    refused("youngs_modulus = 1000.0", "youngs_modulus = -1.0", &["youngs_modulus"]);
    refused("poisson_ratio = 0.3", "poisson_ratio = 0.5", &["poisson_ratio"]);
    refused("friction = 0.3", "friction = -0.1", &["friction"]);
    refused("steps = 4", "steps = 0", &["steps"]);
    refused("elements = [4, 2, 2]", "elements = [4, 0, 2]", &["elements"]);
}

#[test]
fn designs_that_cannot_be() {
    refused("bodies = [\"slab\"]", "bodies = []", &["bodies"]);
    let all = "passive_solid = [{ min = [-1, -1, -1], max = [5, 5, 5] }]\nbodies = [\"slab\"]";
    refused("bodies = [\"slab\"]", all, &["design"]);
    let most = "passive_solid = [{ min = [-1, -1, -1], max = [3.2, 5, 5] }]\nbodies = [\"slab\"]";
    refused("bodies = [\"slab\"]", most, &["passive solid elements already fill 0.75", "infeasible_volume"]);
    // a body whose mesh cannot be read has no volume that a region could fill
    let place = Place::with("bodies = [\"slab\"]", most);
    let shape = "box = { min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }";
    place.write("case.toml", &place.read("case.toml").replace(shape, "mesh = { file = \"missing.msh\" }"));
    let told = place.bad("check case.toml", 2, &["missing.msh"]).err;
    assert!(!told.contains("already fill"), "{told}");
}

/// A file that this build cannot write is refused at its key, with the build that can.
#[cfg(not(feature = "vtkhdf"))]
#[test]
fn vtkhdf_without_the_feature() {
    let expected = ["case.toml:34:10: error: this program was built without VTKHDF files", "--features vtkhdf"];
    refused("every = 2", "every = 2\nvtkhdf = true", &expected);
}

#[test]
fn a_set_without_nodes() {
    let set = "[[set]]\nname = \"nowhere\"\nboxes = [{ min = [9, 9, 9], max = [10, 10, 10] }]\n[[contact]]";
    refused("[[contact]]", set, &["no node lies in the boxes of set `nowhere`", "empty_set"]);
}

/// A body that nothing holds is an error, because the equations are singular. If contact may hold
/// it, there is a warning.
#[test]
fn bodies_without_support() {
    let loose = "[[body]]\nname = \"stray\"\nbox = { min = [8, 0, 0], max = [9, 1, 1], elements = [1, 1, 1] }\n\
                 material = { neo_hooke = { youngs_modulus = 1.0, poisson_ratio = 0.3 } }\n[[contact]]";
    refused("[[contact]]", loose, &["body `stray` is free in 6 of its 6 rigid motions", "unsupported_body"]);
    let place = Place::with("set = \"slab_ymin\"", "set = \"slab_ymin\"\ncomponents = [\"y\"]");
    let ran = place.good("check case.toml");
    assert!(ran.err.contains("is free in 3 of its 6 rigid motions"), "{}", ran.err);
}

/// The report of a run that fails because nothing holds a body against its load: body, direction,
/// node and cure, on the terminal and in the record.
#[test]
fn a_body_that_nothing_holds_is_named() {
    let gap = CASE.replace("min = [0.6, 1.0,", "min = [0.6, 1.1,").replace("u = [0, -0.1, 0]", "u = [0, 0, 0]");
    let free = "set = \"block_ymax\"\ncomponents = [\"x\", \"z\"]";
    let place = Place::new();
    let case = gap.replace("[0.2, -0.1, 0.05]", "[0.2, 0, 0.05]").replace("set = \"block_ymax\"", free);
    let pulled = "\n[[load]]\nsurface = \"block_ymax\"\npressure = -1.0\n";
    place.write("case.toml", &(case + pulled));
    let expected = [
        "nothing holds body `block` against its load along y",
        "no support, and no contact ahead",
        "of body `block` at (",
        "no support prevents motion along y",
        "help: a support (`[[dirichlet]]`) of body `block` against motion along y",
    ];
    let ran = place.bad("solve case.toml --out results", 3, &expected);
    assert!(!ran.err.contains("unknown"), "{}", ran.err);
    assert!(place.read("results/run.json").contains("nothing holds body `block`"));
}

/// Bodies that penetrate each other at the start are reported before every run, with the place in
/// the case file.
#[test]
fn a_penetrating_start_is_told() {
    let place = Place::with("min = [0.6, 1.0,", "min = [0.6, 0.98,");
    for line in ["check case.toml", "solve case.toml"] {
        let ran = place.good(line);
        let expected = "case.toml:10:1: warning: `block_ymin` and `slab_ymax` penetrate each other by 2.000e-2";
        assert!(ran.err.contains(expected), "{}", ran.err);
        assert!(ran.err.contains("help: move a body away"), "{}", ran.err);
    }
    assert_eq!(place.good("solve case.toml --force --quiet").err, "");
}

#[test]
fn sections_that_a_command_needs() {
    let place = Place::with("[optimizer]\niterations = 4\n", "");
    place.good("solve case.toml");
    place.bad("optimize case.toml", 2, &["no section [optimizer]", "missing_section"]);
    let place = Place::with("volume_fraction = 0.5\n", "");
    place.bad("optimize case.toml", 2, &["volume_fraction", "help: "]);
}

#[test]
fn directories_that_cannot_take_results() {
    let place = Place::new();
    place.good("solve case.toml --out results");
    place.write("results/notes.txt", "mine");
    let before = place.read("results/run.json");
    place.bad("solve case.toml --out results", 2, &["results already contains the results of a run", "--force"]);
    assert_eq!(place.read("results/run.json"), before);
    place.good("gradient case.toml --out results --force");
    assert_eq!(place.read("results/notes.txt"), "mine", "only files of the run are replaced");
    assert!(!place.path("results/path.pvd").exists());

    place.bad("solve case.toml --out case.toml", 2, &["a file with that name exists", "--out"]);
    place.bad("solve case.toml --out case.toml/results", 2, &["there is no directory case.toml", "--out"]);
    place.bad("solve case.toml --out no/such/place", 2, &["there is no directory no/such", "create it first"]);
}

/// A read-only directory. The superuser may write everywhere, so the command must then succeed.
#[cfg(unix)]
#[test]
fn a_directory_without_permission_to_write() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::new();
    let locked = place.path("locked");
    std::fs::create_dir(&locked).expect("made");
    std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(0o500)).expect("set");
    if std::fs::write(locked.join("probe"), b"").is_ok() {
        place.good("solve case.toml --out locked");
    } else {
        place.bad("solve case.toml --out locked", 2, &["cannot create the directory locked", "permission"]);
    }
    std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(0o700)).expect("set");
}

#[test]
fn files_that_are_not_there() {
    let place = Place::new();
    place.bad("check nothing.toml", 2, &["cannot read the case file nothing.toml", "slipstick new"]);
    place.bad("evaluate case.toml --design nothing", 2, &["cannot read nothing"]);
    std::fs::create_dir(place.path("empty")).expect("made");
    place.bad("solve case.toml --design empty", 2, &["there is no design.csv in empty"]);
    place.bad("solve", 2, &["<CASE>"]);
}

#[test]
fn densities_that_do_not_fit() {
    let place = Place::new();
    let rows = |change: &dyn Fn(usize) -> String| -> String { (0..20).map(|e| change(e) + "\n").collect() };
    let check = |text: &str, expected: &str| {
        place.write("d.csv", text);
        place.bad("solve case.toml --design d.csv", 2, &["d.csv", expected, "help: "]);
    };
    check("element,phi\n", "d.csv:1: there is no column `density`");
    check(&format!("element,density\n{}", rows(&|e| format!("{e},{}", 0.6 * e as f64))), "d.csv:4: `1.2");
    check(&format!("element,density\n{}", rows(&|e| format!("{},0.5", e / 2))), "appears a second time");
    check(&format!("element,density\n{}21,0.5\n", rows(&|e| format!("{e},0.5"))), "`21` is not an element");
    check("element,density\n0,0.5\n", "element 1 of 20 is missing");
    check(&format!("element,body,density\n{}", rows(&|e| format!("{e},block,0.5"))), "to `slab` in the case");
}

/// Two thousand bodies of about a million elements: the case is refused before it is meshed, at the
/// largest body.
#[cfg(target_os = "linux")]
#[test]
fn cases_larger_than_the_memory() {
    let mut case = CASE.replace("elements = [4, 2, 2]", "elements = [1000, 10, 100]");
    for number in 0..2000 {
        case += &format!(
            "[[body]]\nname = \"more_{number}\"\n\
             box = {{ min = [{number}, 5, 0], max = [{}, 6, 1], elements = [100, 100, 99] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1.0, poisson_ratio = 0.3 }} }}\n",
            number + 1
        );
    }
    let place = Place::new();
    place.write("case.toml", &case);
    for line in ["check case.toml", "solve case.toml"] {
        let began = std::time::Instant::now();
        let expected =
            ["case.toml:4:54: error: 1981000004 elements need about 17.1", " TB before anything", "too_large"];
        place.bad(line, 2, &expected);
        assert!(began.elapsed().as_secs() < 20, "nothing is built");
    }
}

/// Files in encodings other than UTF-8 are refused at the first invalid byte; the byte-order mark
/// that editors write, and the quotes and line ends of spreadsheets, are ignored.
#[test]
fn encodings_and_line_ends() {
    let place = Place::new();
    let latin = CASE.replace("Block on slab", "Gr\u{f6}\u{df}e").chars().map(|c| c as u8).collect::<Vec<u8>>();
    std::fs::write(place.path("latin.toml"), latin).expect("written");
    place.bad("check latin.toml", 2, &["latin.toml:1:12: byte 12 of the file, 0xF6, is not UTF-8", "save the case"]);
    place.write("bom.toml", &format!("\u{feff}{CASE}"));
    place.write("crlf.toml", &CASE.replace('\n', "\r\n"));
    for name in ["bom", "crlf"] {
        assert!(place.good(&format!("check {name}.toml")).out.contains("no warnings"), "{name}");
    }

    let rows: String = (0..20).map(|e| format!("{e},{},0.5\n", if e < 16 { "slab" } else { "block" })).collect();
    let table = format!("element,body,density\n{rows}");
    let quoted: Vec<String> =
        table.lines().map(|l| l.split(',').map(|c| format!("\"{c}\"")).collect::<Vec<_>>().join(",")).collect();
    place.write("d.csv", &format!("\u{feff}{}\r\n", quoted.join("\r\n")));
    place.good("solve case.toml --design d.csv");
    std::fs::write(
        place.path("d.csv"),
        table.replace("5,slab", "5,sl\u{e4}b").chars().map(|c| c as u8).collect::<Vec<u8>>(),
    )
    .expect("written");
    place.bad("solve case.toml --design d.csv --force", 2, &["d.csv:7: byte", "0xE4, is not UTF-8", "as UTF-8"]);
}

#[test]
fn more_threads_than_any_machine_has() {
    let place = Place::new();
    for line in ["check case.toml --threads 1000000", "solve case.toml --threads 1000000"] {
        place.bad(line, 2, &["1000000 threads were requested; at most", "more threads than cores"]);
    }
    place.write("case.toml", &format!("{CASE}[solver]\nthreads = 1000000\n"));
    place.bad("check case.toml", 2, &["1000000 threads"]);
}

/// Output that cannot be written is an error, reported after the work is done; a reader that closes
/// the pipe is not an error.
#[cfg(target_os = "linux")]
#[test]
fn output_that_cannot_be_written() {
    use std::process::Stdio;
    let place = Place::new();
    let full = || std::fs::File::options().write(true).open("/dev/full").expect("Linux has it");
    for line in
        ["check case.toml", "check case.toml --json", "check case.toml --resolved", "new", "--help", "--version"]
    {
        let output = place.command(line).stdout(full()).output().expect("the program runs");
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {err}");
        assert!(line.starts_with('-') || err.contains("cannot write to standard output"), "{line}: {err}");
    }
    let status =
        place.command("solve case.toml --json").stdout(full()).stderr(Stdio::null()).status().expect("it runs");
    assert_eq!(status.code(), Some(2));
    assert!(place.path("case_solve/path_0004.vtu").exists(), "the work is done");
    // No message can be shown, but the exit code is right.
    for (line, code) in [("check nothing.toml", 2), ("check case.toml", 0)] {
        let status = place.command(line).stdout(Stdio::null()).stderr(full()).status().expect("it runs");
        assert_eq!(status.code(), Some(code), "{line}");
    }
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let status = place.command("check case.toml").stdout(writer).status().expect("it runs");
    assert_eq!(status.code(), Some(0));
}

/// A device has no end: it is refused instead of filling the memory.
#[cfg(unix)]
#[test]
fn devices_are_no_input() {
    let place = Place::new();
    for line in ["check /dev/zero", "solve case.toml --design /dev/zero", "study /dev/zero"] {
        place.bad(line, 2, &["/dev/zero", "it is a device, not a file"]);
    }
}
