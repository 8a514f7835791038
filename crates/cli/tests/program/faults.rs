//! Full disks, places that cannot be written, files that are damaged, foreign or missing: each ends
//! with the documented exit code and a message with place and cure, and no data are lost. The
//! messages are in `messages/`.

use std::collections::BTreeSet;
use std::fs;
use std::process::Stdio;

use super::killed::{Random, assert_same_runs, with_short_files};
use super::meshes::{copy, meshed};
use super::*;
use crate::table::publish;

/// Messages as users see them, by fault; kept in a file for review.
#[derive(Default)]
struct Messages {
    text: String,
    tally: Tally,
}

/// Counts of one kind of fault, for the table in `docs/measurements/robustness.md`. A test asserts everything
/// that it adds here.
#[derive(Default)]
struct Tally {
    tries: usize,
    codes: BTreeSet<Option<i32>>,
    resumed: usize,
}

impl Tally {
    fn add(&mut self, ran: &Ran) {
        self.tries += 1;
        self.codes.insert(ran.code);
    }

    /// Publishes the row of a fault.
    fn publish(&self, number: usize, fault: &str) {
        let codes: Vec<String> =
            self.codes.iter().map(|code| code.map_or("killed".into(), |code| code.to_string())).collect();
        let Self { tries, resumed, .. } = self;
        let row = format!("| {fault} | {tries} | {} | {resumed} |\n", codes.join(", "));
        publish(&format!("faults_{number}"), &row);
    }
}

impl Messages {
    fn new() -> Self {
        Self::default()
    }

    fn add(&mut self, what: &str, ran: &Ran) {
        assert!(!ran.err.contains("panicked"), "{what}\n{}", ran.err);
        assert!(ran.err.contains("help: "), "{what}: no cure in\n{}", ran.err);
        self.tally.add(ran);
        let indented: String = ran.err.lines().map(|line| format!("    {line}\n")).collect();
        self.text.push_str(&format!(
            "{what} [{}]\n{}\n",
            ran.code.map_or("killed".into(), |c| c.to_string()),
            anonymous(&indented)
        ));
    }

    /// Compares with the file, or writes it if `SLIPSTICK_WRITE_MESSAGES` is set.
    fn compare(&self, name: &str) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/messages").join(name);
        if std::env::var_os("SLIPSTICK_WRITE_MESSAGES").is_some() {
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(&path, &self.text).expect("written");
        }
        let kept = fs::read_to_string(&path).expect("the messages");
        assert_eq!(kept, self.text, "{}: SLIPSTICK_WRITE_MESSAGES=1 rewrites it", path.display());
    }
}

/// Removes parts that differ between machines: hashes, numbers of more than one digit after a
/// space, and the place where a JSON text breaks off.
fn anonymous(text: &str) -> String {
    let mut words: Vec<String> = Vec::new();
    for line in text.lines() {
        let line =
            [" at line ", " while parsing "].iter().fold(line, |line, tail| line.split(tail).next().unwrap_or(line));
        let word = |word: &str| {
            let bare = word.trim_end_matches([',', ')', ';']);
            let all = |class: fn(&char) -> bool| bare.chars().all(|c| class(&c));
            match bare.len() {
                64 if all(char::is_ascii_hexdigit) => word.replace(bare, "HASH"),
                2.. if all(char::is_ascii_digit) => word.replace(bare, "N"),
                _ => word.to_owned(),
            }
        };
        words.push(line.split(' ').map(word).collect::<Vec<_>>().join(" ") + "\n");
    }
    words.concat()
}

/// A file system of some kilobytes, if this process may mount one: the run is made in it, and its
/// folder is copied out. Prints a message if this cannot be tested.
#[cfg(target_os = "linux")]
fn on_a_small_disk(place: &Place, line: &str, kilobytes: usize) -> Option<Ran> {
    let script = format!(
        "mount -t tmpfs -o size={kilobytes}k tmpfs disk || exit 99\n\
         \"$0\" \"$@\"; code=$?\ncp -a disk/. copy/ || exit 98\nexit $code"
    );
    fs::create_dir_all(place.path("disk")).expect("made");
    fs::create_dir_all(place.path("copy")).expect("made");
    let mut command = Command::new("unshare");
    command.current_dir(place.folder.path()).args(["--mount", "--map-root-user", "sh", "-c", &script]);
    command.arg(env!("CARGO_BIN_EXE_slipstick")).args(line.split_whitespace());
    let ran = command
        .output()
        .ok()
        .map(|output| Ran::new(line, output))
        .filter(|ran| ran.code != Some(99) && ran.code != Some(1));
    if ran.is_none() {
        eprintln!("SKIPPED: no file system can be mounted here; only the limit of file sizes is tested");
    }
    ran
}

/// The disk fills up at various times: the run ends with code 2, names the file, and can be resumed
/// from its last finished iteration once there is space.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_a_run_that_resumes() {
    let place = Place::new();
    place.good("optimize case.toml --out whole -q");
    let mut tally = Tally::default();
    for kilobytes in [4, 24, 48, 72, 96, 120] {
        let Some(ran) = on_a_small_disk(&place, "optimize case.toml --out disk/run -q", kilobytes) else { return };
        assert_eq!(ran.code, Some(2), "{kilobytes} kB\n{}", ran.err);
        assert!(ran.err.contains("No space left on device"), "{}", ran.err);
        assert!(ran.err.contains("disk/run"), "no place in {}", ran.err);
        assert!(ran.err.contains("the free space"), "no cure in {}", ran.err);
        tally.add(&ran);
        if place.path("copy/run/checkpoint.json").exists() {
            place.good("resume copy/run -q");
            assert_same_runs(&place, "whole", "copy/run");
            tally.resumed += 1;
        }
        fs::remove_dir_all(place.path("copy")).expect("removed");
    }
    assert!(tally.resumed >= 3, "{}", tally.resumed);
    tally.publish(1, "disk full at various moments");
}

/// The same with a limit on file sizes, which every Unix has: files that exceed it cannot be
/// written.
#[test]
fn files_that_cannot_grow_end_a_run_that_resumes() {
    let place = Place::new();
    place.good("optimize case.toml --out whole -q");
    let mut messages = Messages::new();
    for (blocks, what) in [(1, "nothing longer than 512 bytes"), (10, "nothing longer than 5 kB")] {
        let line = "optimize case.toml --out run -q --force";
        let output = with_short_files(&place, line, blocks, true).output().expect("sh");
        let ran = Ran::new(line, output);
        assert_eq!(ran.code, Some(2), "{}", ran.err);
        messages.add(what, &ran);
    }
    messages.compare("full_disk.txt");
    place.good("resume run -q");
    assert_same_runs(&place, "whole", "run");
    messages.tally.resumed += 1;
    messages.tally.publish(2, "limit on the size of files (`ulimit -f`)");
}

/// A folder in place of a file cannot be written, even by the superuser, who is not bound by file
/// modes.
#[test]
fn places_that_cannot_be_written() {
    let place = Place::new();
    let mut messages = Messages::new();
    place.write("file", "mine");
    messages.add("a file instead of the folder", &place.bad("optimize case.toml --out file", 2, &[]));
    messages.add("a folder in a file", &place.bad("optimize case.toml --out file/run", 2, &[]));
    for name in ["run.lock", "run.json", "checkpoint.json", "design.csv"] {
        fs::create_dir_all(place.path("run").join(name)).expect("made");
        let what = format!("a folder named {name}");
        messages.add(&what, &place.bad("optimize case.toml --out run -q", 2, &[]));
        fs::remove_dir_all(place.path("run")).expect("removed");
    }
    // During the run.
    place.good("optimize case.toml --out run -q --iterations 2");
    fs::create_dir(place.path("run/design_0004.vtu")).expect("made");
    let before = place.read("run/checkpoint.json");
    messages.add("a folder instead of a later file", &place.bad("resume run --iterations 4 -q", 2, &[]));
    assert_ne!(place.read("run/checkpoint.json"), before, "finished iterations are kept");
    fs::remove_dir(place.path("run/design_0004.vtu")).expect("removed");
    place.good("resume run --iterations 4 -q");
    place.good("optimize case.toml --out whole -q");
    assert_same_runs(&place, "whole", "run");
    messages.compare("places.txt");
    messages.tally.resumed += 1;
    messages.tally.publish(3, "places that cannot be written");
}

/// A run's files cut at several lengths and with bits flipped: `resume` refuses those that it reads
/// and writes nothing.
#[test]
fn damaged_files_of_a_run() {
    let place = Place::new();
    place.good("optimize case.toml --out whole -q");
    place.good("optimize case.toml --out run -q --iterations 2");
    let mut messages = Messages::new();
    let (mut tally, mut random) = (Tally::default(), Random(7));
    for name in ["checkpoint.json", "start_values_0.bin", "case.toml", "run.json", "history.csv", "newton.csv"] {
        let path = place.path("run").join(name);
        let whole = fs::read(&path).expect(name);
        let mut damages: Vec<(String, Vec<u8>)> = Vec::new();
        let table = name.ends_with(".csv");
        let mut lengths = vec![0, 1, whole.len() / 2, whole.len() / 3];
        // The last row of a table belongs to a design that is evaluated again.
        lengths.extend(if table { vec![] } else { vec![whole.len() - 40, whole.len() - 2] });
        for length in lengths {
            damages.push((format!("cut to {length} bytes"), whole[..length].to_vec()));
        }
        // Any bit of the hashed files; no result depends on the contents of the others.
        let hashed = ["checkpoint.json", "start_values_0.bin", "case.toml"].contains(&name);
        for _ in 0..if hashed { 20 } else { 0 } {
            let mut changed = whole.clone();
            let at = random.below(whole.len());
            changed[at] ^= 1 << random.below(8);
            damages.push((format!("byte {at} changed"), changed));
        }
        damages.push(("gone".into(), Vec::new()));
        for (n, (what, bytes)) in damages.iter().enumerate() {
            if what == "gone" {
                fs::remove_file(&path).expect(name)
            } else {
                fs::write(&path, bytes).expect(name)
            }
            let mut others = Contents::of(&place, "run", name);
            let ran = place.run("resume run --iterations 4 -q");
            assert_eq!(ran.code, Some(2), "{name} {what}: {}", ran.err);
            tally.add(&ran);
            assert!(ran.err.contains("run/") || what == "gone", "{name} {what}: no place in {}", ran.err);
            if ["history.csv", "newton.csv"].contains(&name) {
                // The record says how the attempt ended; rows of a design that is evaluated again
                // are removed.
                others.0.retain(|(name, _)| !["run.json", "history.csv", "newton.csv"].contains(&name.as_str()));
            }
            others.assert_unchanged(&place, "run", name, what);
            match n {
                0 => messages.add(&format!("{name} emptied"), &ran),
                2 => messages.add(&format!("{name} cut in half"), &ran),
                _ if what == "gone" => messages.add(&format!("{name} gone"), &ran),
                _ => {}
            }
        }
        fs::write(&path, &whole).expect(name);
    }
    messages.compare("damaged.txt");
    place.good("resume run --iterations 4 -q");
    assert_same_runs(&place, "whole", "run");
    tally.resumed += 1;
    tally.publish(4, "files of a run emptied, truncated, altered by one bit, or deleted");
}

/// The bytes of all files of a run except one.
struct Contents(Vec<(String, Vec<u8>)>);

impl Contents {
    fn of(place: &Place, run: &str, but: &str) -> Self {
        let entries = fs::read_dir(place.path(run)).expect("a folder").map(|entry| entry.expect("an entry").path());
        let mut all: Vec<_> = entries.filter(|path| path.is_file() && !path.ends_with(but)).collect();
        all.sort_unstable();
        let name = |path: &PathBuf| path.file_name().expect("a name").to_string_lossy().into_owned();
        Self(all.iter().map(|path| (name(path), fs::read(path).expect("readable"))).collect())
    }

    fn assert_unchanged(&self, place: &Place, run: &str, but: &str, what: &str) {
        for (name, before) in &self.0 {
            let after = fs::read(place.path(run).join(name));
            assert!(after.is_ok_and(|after| after == *before), "{but} {what}: {name} was changed");
        }
        let parts = Self::of(place, run, but).0.into_iter().filter(|(name, _)| name.ends_with(".tmp"));
        assert_eq!(parts.count(), 0, "{but} {what}: parts of files");
    }
}

/// Files of another run in place of a run's own.
#[test]
fn files_of_another_run() {
    let place = Place::new();
    let other = CASE.replace("friction = 0.3", "friction = 0.4");
    place.write("other.toml", &other);
    place.good("optimize case.toml --out run -q --iterations 2");
    place.good("optimize other.toml --out other -q --iterations 2");
    let mut messages = Messages::new();
    messages.add("another case in the folder of a run", &place.bad("optimize other.toml --out run", 2, &[]));
    for name in ["checkpoint.json", "start_values_0.bin", "case.toml", "history.csv"] {
        let own = fs::read(place.path("run").join(name)).expect(name);
        fs::copy(place.path("other").join(name), place.path("run").join(name)).expect(name);
        let mut others = Contents::of(&place, "run", name);
        messages.add(&format!("{name} of another run"), &place.bad("resume run --iterations 4", 2, &[]));
        others.0.retain(|(other, _)| name != "history.csv" || other != "run.json");
        others.assert_unchanged(&place, "run", name, "foreign");
        fs::write(place.path("run").join(name), own).expect(name);
    }
    messages.compare("foreign.txt");
    place.good("resume run --iterations 4 -q");
    place.good("optimize case.toml --out whole -q");
    assert_same_runs(&place, "whole", "run");
    messages.tally.resumed += 1;
    messages.tally.publish(5, "files or folder of another run");
}

/// Mesh files that are missing, damaged or changed, before a run and in its directory.
#[test]
fn mesh_files_that_are_not_what_they_were() {
    let place = meshed();
    let mut messages = Messages::new();
    place.good("optimize case.toml --out whole -q --iterations 4");
    place.good("optimize case.toml --out run -q --iterations 2");
    let original = place.path("meshes/pair.msh");
    fs::remove_file(&original).expect("removed");
    messages.add("no mesh file", &place.bad("optimize case.toml", 2, &[]));
    copy(&place, "gmsh_22_ascii.msh", "meshes/pair.msh");
    let whole = fs::read(&original).expect("the mesh");
    fs::write(&original, &whole[..whole.len() / 2]).expect("written");
    messages.add("half a mesh file", &place.bad("optimize case.toml", 2, &[]));
    assert!(!place.path("case").exists());

    let kept = place.path("run/mesh_0001.msh");
    let own = fs::read(&kept).expect("the copy");
    for (what, bytes) in [
        ("another mesh in the run", Some(&whole[..])),
        ("half a mesh in the run", Some(&own[..own.len() / 2])),
        ("no mesh in the run", None),
    ] {
        match bytes {
            Some(bytes) => fs::write(&kept, bytes).expect("written"),
            None => fs::remove_file(&kept).expect("removed"),
        }
        let others = Contents::of(&place, "run", "mesh_0001.msh");
        messages.add(what, &place.bad("resume run --iterations 4", 2, &[]));
        others.assert_unchanged(&place, "run", "mesh_0001.msh", what);
    }
    fs::write(&kept, own).expect("written");
    place.good("resume run --iterations 4 -q");
    assert_same_runs(&place, "whole", "run");
    messages.compare("meshes.txt");
    messages.tally.resumed += 1;
    messages.tally.publish(6, "mesh files deleted, truncated or changed");
}

/// The messages of a second start on a running optimization, which does not affect the first one.
#[test]
fn two_runs_in_one_folder() {
    let place = Place::with("iterations = 4", "iterations = 4000");
    let mut child = place.command("optimize case.toml -q").stdout(Stdio::null()).spawn().expect("it runs");
    while !place.path("case/checkpoint.json").exists() {
        assert!(child.try_wait().expect("told").is_none(), "ended");
        std::thread::sleep(Duration::from_millis(5));
    }
    let mut messages = Messages::new();
    for line in ["optimize case.toml -q", "optimize case.toml -q --force", "resume case -q"] {
        messages.add(line, &place.bad(line, 2, &[]));
    }
    assert!(child.try_wait().expect("told").is_none(), "the first continues");
    child.kill().expect("killed");
    child.wait().expect("ends");
    messages.compare("two_runs.txt");
    // The first process has been killed.
    let made = place.json("case/checkpoint.json")["state"]["iteration"].as_u64().expect("a number") as usize;
    place.good(&format!("resume case -q --iterations {}", made + 1));
    place.good(&format!("optimize case.toml --out whole -q --iterations {}", made + 1));
    assert_same_runs(&place, "whole", "case");
    messages.tally.resumed += 1;
    messages.tally.publish(7, "a second run in the folder of a running one");
}
