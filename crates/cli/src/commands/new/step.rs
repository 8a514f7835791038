//! Makes a case of a STEP file: writes a script that meshes it with Gmsh, runs it, and makes a case of the mesh.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use slipstick::case::{Measured, Step, case_of_step};
use slipstick::output::write_atomically;
use slipstick::words::shell_word;
use slipstick_service::failure::{Failure, Outcome};

use super::{seen_from, write};
use crate::args::New;
use crate::context::Context;

/// The script, with its options at the top.
const SCRIPT: &str = include_str!("mesh.py");

/// The part of the script that sweeps bodies, and where it is inserted.
const SWEEPS: (&str, &str) = ("# SWEEPS\n", include_str!("sweep.py"));

/// Whether a word names a STEP file instead of a template.
pub fn is_step(word: &str) -> bool {
    let extension = Path::new(word).extension().and_then(|extension| extension.to_str());
    extension.is_some_and(|extension| ["step", "stp"].iter().any(|of| extension.eq_ignore_ascii_case(of)))
}

/// The files next to a case.
struct Files {
    case: PathBuf,
    script: PathBuf,
    mesh: PathBuf,
}

impl Files {
    fn new(args: &New, step: &Path) -> Self {
        let stem = step.file_stem().unwrap_or(step.as_os_str());
        let with = |base: &Path, end: &str| {
            let mut name = base.as_os_str().to_owned();
            name.push(end);
            PathBuf::from(name)
        };
        let case = args.out.clone().unwrap_or_else(|| with(Path::new(stem), ".toml"));
        let base = match case.extension() {
            _ if case.as_os_str() == "-" => PathBuf::from(stem),
            Some(end) if end == "toml" => case.with_extension(""),
            _ => case.clone(),
        };
        Self { script: with(&base, "_mesh.py"), mesh: with(&base, ".msh"), case }
    }
}

/// Writes script, mesh and case for a STEP file.
///
/// # Errors
/// [`Failure::Input`] if the file cannot be read or meshed, or if Python or Gmsh is missing.
pub fn of_step(context: &Context, args: &New, step: &Path) -> Outcome {
    if args.mesh.is_some() {
        let cure = "omit --mesh: the STEP file is meshed by the script that this command writes";
        return Err(Failure::input("a STEP file cannot be combined with --mesh", cure));
    }
    check_header(step)?;
    let files = Files::new(args, step);
    let quiet = files.case.as_os_str() == "-";
    let seen = seen_from(&files.script, step);
    let text = script(&seen, &files, args);
    let edited = match std::fs::read(&files.script) {
        Ok(known) => known != text.as_bytes(),
        Err(error) => error.kind() != ErrorKind::NotFound,
    };
    let taken =
        [(!quiet && files.case.exists(), &files.case), (edited, &files.script), (files.mesh.exists(), &files.mesh)];
    if let Some((_, file)) = taken.iter().find(|(taken, _)| *taken && !args.force) {
        let cure = "name another case with --out, or give --force to replace it";
        return Err(Failure::input(format!("{} already exists", file.display()), cure));
    }
    write_atomically(&files.script, |writer| writer.write_all(text.as_bytes()))?;
    let measured = run(context, &files, quiet)?;
    let bytes = std::fs::read(&files.mesh).map_err(|error| {
        Failure::input(format!("cannot read {}: {error}", files.mesh.display()), "run the script on its own")
    })?;
    let name = |path: &Path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let of = Step { file: seen, script: name(&files.script), measured };
    let mesh = if quiet { files.mesh.display().to_string() } else { name(&files.mesh) };
    let case = case_of_step(&bytes, &mesh, &of).map_err(|error| {
        Failure::input(format!("{}: {}: {}", files.mesh.display(), error.place, error.message), error.cure)
    })?;
    if !quiet {
        case.notices.iter().for_each(|notice| context.console.warning(notice));
    }
    write(
        context,
        args,
        &files.case,
        &case.text,
        "step",
        "contact, supports and motion are guesses: correct them, and set the materials",
    )
}

/// Refuses a file that Gmsh could not read, before Gmsh says so in its own words.
fn check_header(step: &Path) -> Outcome {
    let bytes = std::fs::read(step).map_err(|error| {
        Failure::input(format!("cannot read the STEP file {}: {error}", step.display()), "check its name")
    })?;
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes).trim_ascii_start();
    if start.starts_with(b"ISO-10303-21") {
        return Ok(());
    }
    let what = if start.is_empty() { "is empty" } else { "is not a STEP file: it does not start with ISO-10303-21" };
    Err(Failure::input(format!("{} {what}", step.display()), "export it from CAD as STEP (AP203, AP214 or AP242)"))
}

/// The script with its options set.
fn script(step: &str, files: &Files, args: &New) -> String {
    let name = |path: &Path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let (script, mesh) = (name(&files.script), name(&files.mesh));
    // which must not end within a name
    let comment = |name: &str| shell_word(name).replace(char::is_control, "?");
    // a JSON string is a string of Python
    let string = |text: &str| serde_json::Value::from(text).to_string();
    let mut text = SCRIPT
        .replace(SWEEPS.0, SWEEPS.1)
        .replace("python3 SCRIPT", &format!("python3 {}", comment(&script)))
        .replace("--mesh MESH", &format!("--mesh {}", comment(&mesh)))
        .replace("STEP = \"part.step\"", &format!("STEP = {}", string(step)))
        .replace("MESH = \"part.msh\"", &format!("MESH = {}", string(&mesh)));
    for (option, value) in [("SIZE", args.size), ("DISTANCE", args.distance)] {
        if let Some(value) = value {
            text = text.replace(&format!("\n{option} = None"), &format!("\n{option} = {value:?}"));
        }
    }
    if args.hexahedra {
        text = text.replace("\nHEXAHEDRA = False", "\nHEXAHEDRA = True");
    }
    text
}

/// Runs the script, and returns what it measured.
fn run(context: &Context, files: &Files, quiet: bool) -> Outcome<Vec<Measured>> {
    let python = std::env::var_os("SLIPSTICK_PYTHON").unwrap_or_else(|| "python3".into());
    let shown = python.to_string_lossy().into_owned();
    let (script, mesh) = (files.script.display().to_string(), files.mesh.display().to_string());
    let elsewhere =
        format!("or run {script} where it is installed, and then `slipstick new --mesh {}`", shell_word(&mesh));
    if !quiet {
        context.console.text(&format!("meshing with {shown} {}", shell_word(&script)));
    }
    let output = Command::new(&python).arg(&files.script).output().map_err(|error| {
        let message = match error.kind() {
            ErrorKind::NotFound => format!("Python was not found: there is no program `{shown}`"),
            _ => format!("cannot start `{shown}`: {error}"),
        };
        let cure = format!("install Python and `pip install gmsh`; SLIPSTICK_PYTHON names another Python; {elsewhere}");
        Failure::input(message, cure)
    })?;
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if output.status.success() {
        let told = out.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        let measured: Vec<Measured> = told.filter_map(|words| measured(&words)).collect();
        if !quiet {
            for warning in out.lines().filter_map(|line| line.strip_prefix("warning ")) {
                context.console.warning(warning);
            }
            if measured.is_empty() && out.lines().filter(|line| line.starts_with("body ")).count() > 1 {
                context.console.warning(&no_contact(&out));
            }
        }
        return Ok(measured);
    }
    let said = err.find("error: ").map(|at| &err[at + "error: ".len()..]);
    if let Some((message, cure)) = said.and_then(|said| said.trim().split_once("\n    help: ")) {
        let cure = match cure {
            "pip install gmsh" => format!(
                "`{shown} -m pip install gmsh`, and run this command again; SLIPSTICK_PYTHON names another Python; {elsewhere}"
            ),
            cure => cure.to_owned(),
        };
        return Err(Failure::input(message, cure));
    }
    let last = err.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("without a message");
    Err(Failure::input(
        format!("{script} failed ({}): {last}", output.status),
        "run the script by itself to see all of its output; another --size, or the removal of small faces in CAD, may help",
    ))
}

/// What to say if no bodies touch.
fn no_contact(out: &str) -> String {
    let distance = out.lines().find_map(|line| line.strip_prefix("distance ")).unwrap_or("the distance");
    format!(
        "no faces of two bodies are within {distance} mm of each other: give a larger --distance, or move the bodies in CAD"
    )
}

/// A line `contact SURFACE SURFACE SMALLEST LARGEST` of the script.
fn measured(words: &[&str]) -> Option<Measured> {
    let ["contact", one, two, low, high] = words else { return None };
    let surfaces = [(*one).to_owned(), (*two).to_owned()];
    Some(Measured { surfaces, gap: [low.parse().ok()?, high.parse().ok()?] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_files_are_told_from_templates() {
        for (word, expected) in [
            ("part.step", true),
            ("a/b.STP", true),
            ("Part.Step", true),
            ("half-ball", false),
            ("part.msh", false),
            ("step", false),
            (".step", false),
        ] {
            assert_eq!(is_step(word), expected, "{word}");
        }
    }

    /// Every option of the script that the program sets is in it once, so that it is replaced.
    #[test]
    fn the_script_has_the_options() {
        for option in [
            "python3 SCRIPT",
            "--mesh MESH",
            "STEP = \"part.step\"",
            "MESH = \"part.msh\"",
            "\nSIZE = None",
            "\nDISTANCE = None",
            "\nHEXAHEDRA = False",
            SWEEPS.0,
        ] {
            assert_eq!(SCRIPT.matches(option).count(), 1, "{option}");
        }
    }

    #[test]
    fn measured_gaps_are_read() {
        let found = measured(&["contact", "a_touches_b", "b_touches_a", "-0.1", "2e-3"]).expect("a pair");
        assert_eq!(found.surfaces, ["a_touches_b", "b_touches_a"]);
        assert_eq!(found.gap, [-0.1, 2e-3]);
        assert_eq!(measured(&["body", "a", "12"]), None);
    }
}
