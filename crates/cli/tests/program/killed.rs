//! Optimizations that are killed (SIGKILL), at random times and while they write a checkpoint, and
//! resumed: in the end, their files equal those of an uninterrupted run, bit for bit.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::Stdio;
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::*;
use crate::table::publish;

/// The sequence of a linear congruential generator (Knuth's MMIX constants).
pub struct Random(pub u64);

impl Random {
    /// The next number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// The next whole number below a bound.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.unit() * bound as f64) as usize
    }
}

/// Names of the files in a folder.
fn files(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    entries.map(|name| name.to_string_lossy().into_owned()).collect()
}

/// Asserts that two runs contain the same files with the same bytes, except for the seconds in the
/// history and the times and command lines in the record. A run may also have been warned of what was
/// missing when it was resumed.
pub fn assert_same_runs(place: &Place, one: &str, other: &str) {
    let results = |run: &str| {
        let mut names = files(&place.path(run));
        names.remove("warnings.json");
        names
    };
    let names = results(one);
    assert_eq!(names, results(other), "files of {one} and {other}");
    for name in names.iter().filter(|name| !["history.csv", "run.json"].contains(&name.as_str())) {
        let read = |run: &str| fs::read(place.path(run).join(name)).expect(name);
        assert!(read(one) == read(other), "{name} of {one} and {other} differs");
    }
    let history = |run: &str| -> Vec<Vec<String>> {
        let rows = place.table(&format!("{run}/history.csv"));
        rows.iter().map(|row| row[..row.len() - 1].to_vec()).collect()
    };
    assert_eq!(history(one), history(other));
    for run in [one, other] {
        assert_eq!(place.json(&format!("{run}/run.json"))["exit"], "finished", "{run}");
    }
}

const ITERATIONS: &str = "iterations = 12";

/// Incomplete files left by a killed process.
fn parts(folder: &Path) -> BTreeSet<String> {
    let all = if folder.exists() { files(folder) } else { BTreeSet::new() };
    all.into_iter().filter(|name| name.ends_with(".tmp")).collect()
}

/// Where a kill hit an optimization of four load steps, judged by the events that were printed and
/// by whether it left an incomplete file.
fn place_of_kill(told: &str, part: bool) -> &'static str {
    if part {
        return "while a file was written";
    }
    // The last line may be cut off.
    let last = told.lines().rev().find_map(|line| serde_json::from_str::<Value>(line).ok());
    match last.as_ref().map(|event| (event["event"].as_str().unwrap_or_default(), &event["step"])) {
        None | Some(("start", _)) => "before the first load step of a process",
        Some(("step", step)) if *step == 4 => "gradient and update of the design",
        Some(("step", _)) => "load step",
        Some(("iteration", _)) => {
            "while the files of an iteration were written, or during the first load step after that"
        }
        _ => "files of the last path, or the end",
    }
}

/// The number of kills for each place.
type Kills = BTreeMap<&'static str, usize>;

/// Kills and resumes a run, with a random number of threads each time, until it ends by itself.
fn drive_with_kills(place: &Place, run: &str, longest: Duration, random: &mut Random) -> Kills {
    let mut kills = Kills::new();
    loop {
        // A run that is killed before its first checkpoint is started again, as the message of
        // `resume` says.
        let begun = place.path(run).join("checkpoint.json").exists();
        let line = if begun { format!("resume {run}") } else { format!("optimize case.toml --out {run} --force") };
        let line = format!("{line} --json --threads {}", 1 + random.below(3));
        let before = parts(&place.path(run));
        let mut command = place.command(&line);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs");
        sleep(longest.mul_f64(random.unit()));
        child.kill().expect("killed, or ended before");
        let ended = child.wait_with_output().expect("ends");
        if ended.status.signal().is_none() {
            let said = String::from_utf8_lossy(&ended.stderr).into_owned();
            assert!(ended.status.success(), "{line} after {kills:?}\n{said}");
            return kills;
        }
        let part = !parts(&place.path(run)).is_subset(&before);
        *kills.entry(place_of_kill(&String::from_utf8_lossy(&ended.stdout), part)).or_default() += 1;
        assert!(kills.values().sum::<usize>() < 200, "no progress");
    }
}

/// At least `SLIPSTICK_KILLS` kills, or 24 if it is not set.
#[test]
fn runs_that_are_killed_again_and_again_end_as_if_nothing_had_been() {
    let wanted = std::env::var("SLIPSTICK_KILLS").map_or(24, |text| text.parse().expect("SLIPSTICK_KILLS"));
    let place = Place::with("iterations = 4", ITERATIONS);
    let clock = Instant::now();
    place.good("optimize case.toml --out whole -q");
    let whole = clock.elapsed();
    let (mut random, mut kills, mut runs) = (Random(20_261_121), Kills::new(), 0);
    while kills.values().sum::<usize>() < wanted {
        runs += 1;
        let run = format!("killed_{runs}");
        for (at, count) in drive_with_kills(&place, &run, whole.mul_f64(0.4), &mut random) {
            *kills.entry(at).or_default() += count;
        }
        // Bit for bit, or the test ends here.
        assert_same_runs(&place, "whole", &run);
        fs::remove_dir_all(place.path(&run)).expect("removed");
        assert!(runs < 4 * wanted, "{kills:?} only");
    }
    let rows: String = kills.iter().map(|(at, count)| format!("| {at} | {count} | yes |\n")).collect();
    let all: usize = kills.values().sum();
    publish(
        "kills",
        &format!(
            "| where a kill hit | kills | resumed bit for bit |\n|---|---|---|\n{rows}| together, in {runs} runs | {all} | yes |\n"
        ),
    );
}

/// A command that is killed (SIGXFSZ) as soon as one of its files exceeds this many blocks of 512
/// bytes; with `told`, writing fails instead.
pub fn with_short_files(place: &Place, line: &str, blocks: u64, told: bool) -> Command {
    let trap = if told { "trap '' XFSZ; " } else { "" };
    let mut command = Command::new("sh");
    command.current_dir(place.folder.path());
    command.args(["-c", &format!("{trap}ulimit -c 0; ulimit -f {blocks}; exec \"$0\" \"$@\"")]);
    command.arg(env!("CARGO_BIN_EXE_slipstick")).args(line.split_whitespace());
    command
}

/// The system kills the process while it writes a checkpoint, which is the largest file at that
/// time. The previous checkpoint stays intact, the incomplete file is removed, and the run ends as
/// if nothing had happened.
#[test]
fn a_run_killed_within_the_writing_of_a_checkpoint_resumes() {
    let place = Place::new();
    // More densities, and no other large file before the run's end.
    let case = CASE.replace("elements = [4, 2, 2]", "elements = [8, 4, 4]").replace("every = 2", "every = 100");
    place.write("case.toml", &case.replace("[load_path]", "[load_path]\nstart_values = \"last_state\""));
    place.good("optimize case.toml --out whole -q");
    place.good("optimize case.toml --out cut --iterations 2 -q");
    // The uninterrupted run does not write this file at the end of the first part.
    fs::remove_file(place.path("cut/design_0002.vtu")).expect("there");
    let before = place.read("cut/checkpoint.json");
    let largest = ["newton.csv", "history.csv", "design.csv", "run.json"];
    let length = |name: &str| fs::metadata(place.path("cut").join(name)).expect(name).len();
    let largest = largest.iter().map(|name| length(name)).max().expect("some");
    let blocks = before.len() as u64 * 9 / 10 / 512;
    assert!(largest + 3000 < blocks * 512, "{largest} of {}", before.len());
    let killed = with_short_files(&place, "resume cut --iterations 4 -q", blocks, false).status().expect("sh");
    assert_eq!(killed.signal(), Some(SIGXFSZ), "{killed}");
    let left: Vec<String> = parts(&place.path("cut")).into_iter().collect();
    assert!(matches!(&left[..], [part] if part.starts_with("checkpoint.json.")), "{left:?}");
    assert_eq!(place.read("cut/checkpoint.json"), before, "the last one is whole");
    place.good("resume cut --iterations 4 -q");
    assert_same_runs(&place, "whole", "cut");
}

/// The number of this signal on Linux and macOS.
const SIGXFSZ: i32 = 25;

/// A run killed after its last checkpoint but before the files of its path still has work to do.
#[test]
fn a_run_killed_within_its_last_files_writes_them() {
    let place = Place::new();
    place.good("optimize case.toml --out whole -q");
    place.good("optimize case.toml --out cut -q");
    for name in ["path.pvd", "path_0003.vtu", "path_0004.vtu"] {
        fs::remove_file(place.path("cut").join(name)).expect(name);
    }
    let record = place.read("cut/run.json").replacen("\"finished\"", "\"running\"", 1);
    place.write("cut/run.json", &record);
    place.good("resume cut -q");
    assert_same_runs(&place, "whole", "cut");
}

/// A process that was killed before it wrote the first file of its run, or while it removed an
/// earlier run, does not block the directory; other files in it are kept.
#[test]
fn a_start_that_was_killed_blocks_nobody() {
    let place = Place::new();
    fs::create_dir(place.path("case")).expect("made");
    place.write("case/run.lock", "");
    place.write("case/checkpoint.json.123.tmp", "{");
    place.write("case/notes.json.123.tmp", "mine");
    place.write("case/picture.png.123.tmp", "being drawn");
    place.good("optimize case.toml -q --iterations 1");
    let left = files(&place.path("case"));
    assert!(!left.contains("checkpoint.json.123.tmp"));
    assert!(left.contains("notes.json.123.tmp") && left.contains("picture.png.123.tmp"), "{left:?}");

    fs::remove_file(place.path("case/checkpoint.json")).expect("there");
    place.bad("resume case", 2, &["there is no checkpoint.json in case", "start it again with --force"]);
    place.good("optimize case.toml -q --iterations 1 --force");
}

/// Many processes start at once on one directory: one makes the run, and the others say why they do
/// not.
#[test]
fn of_many_starts_at_once_one_runs() {
    let place = Place::new();
    for round in 0..4 {
        let line = format!("optimize case.toml --out run_{round} -q --iterations 1 --threads 1");
        let spawn = || place.command(&line).stderr(Stdio::piped()).process_group(0).spawn().expect("the program runs");
        let all: Vec<_> = (0..4).map(|_| spawn()).collect();
        let mut made = 0;
        for child in all {
            let ended = child.wait_with_output().expect("ends");
            let said = String::from_utf8_lossy(&ended.stderr).into_owned();
            match ended.status.code() {
                Some(0) => made += 1,
                code => {
                    assert_eq!(code, Some(2), "{said}");
                    let known = ["another slipstick process is writing to", "already contains the results of a run"];
                    assert!(known.iter().any(|known| said.contains(known)), "{said}");
                }
            }
        }
        assert_eq!(made, 1);
    }
    place.good("optimize case.toml --out whole -q --iterations 1");
    (0..4).for_each(|round| assert_same_runs(&place, "whole", &format!("run_{round}")));
}
