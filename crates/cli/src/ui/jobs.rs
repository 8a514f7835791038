//! Runs of the page: this program as another process, whose output goes to a file next to its results. It goes
//! on if the page is closed or the server is killed. Ctrl-C in the server's terminal, and closing that terminal,
//! also reach the run, which then stops in order: nobody could stop it later without its process id.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::{Value, json};
use slipstick::words::shell_word;
use slipstick_service::failure::{Failure, Outcome};

use super::folder::Folder;
use crate::process;

/// Bytes at the end of a log that the page shows.
const SHOWN: u64 = 64 << 10;

/// What can be exported: the option, and what is added to the name of the run.
const EXPORTS: &[(&str, &str)] =
    &[("vtu", ".vtu"), ("stl", ".stl"), ("3mf", ".3mf"), ("step", ".step"), ("case", "_part"), ("deck", "_deck")];

/// The latest command of the page; one runs at a time.
#[derive(Default)]
pub struct Jobs(Mutex<Option<Job>>);

struct Job {
    child: Child,
    /// The command line, as one would type it.
    line: String,
    /// The log, as a name in the folder.
    log: String,
    run: String,
    code: Option<i32>,
    ended: bool,
    stopped: bool,
}

impl Job {
    fn look(&mut self) {
        if self.ended {
            return;
        }
        match self.child.try_wait() {
            Ok(None) => {}
            Ok(Some(status)) => (self.ended, self.code) = (true, status.code()),
            // the system no longer knows the process, and no later command could start
            Err(_) => self.ended = true,
        }
    }
}

/// What the page asks for.
pub struct Asked<'a> {
    /// `check`, `solve`, `optimize`, `resume`, `export` or `new`.
    pub command: &'a str,
    /// The case; for `new`, a STEP file or a deck.
    pub case: &'a str,
    /// The run to resume or to export.
    pub run: &'a str,
    /// What is exported: one of [`EXPORTS`].
    pub kind: &'a str,
    /// Whether earlier results are replaced.
    pub force: bool,
    /// Whether bodies of a STEP file are swept, with hexahedra.
    pub hexahedra: bool,
}

impl Jobs {
    fn lock(&self) -> MutexGuard<'_, Option<Job>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Starts a command. The log of an earlier run is only replaced if the command may replace that run.
    ///
    /// # Errors
    /// [`Failure::Input`] if one runs already, if it would replace a run, or if it cannot be started.
    pub fn start(&self, folder: &Folder, threads: Option<NonZeroUsize>, asked: &Asked<'_>) -> Outcome {
        let mut current = self.lock();
        if let Some(job) = current.as_mut() {
            job.look();
            if !job.ended {
                return Err(Failure::input("a command of this page runs already", "wait for it, or press Stop"));
            }
        }
        let (mut words, run, log) = line(folder, asked)?;
        if let Some(threads) = threads.filter(|_| !["export", "new"].contains(&asked.command)) {
            words.extend(["--threads".into(), threads.to_string()]);
        }
        refuse_run(folder, asked, &run)?;
        let mut command = process::again()?;
        let file = folder.within(&log)?;
        let (err, out) = appended(&file, asked.command == "resume").map_err(|error| {
            Failure::input(format!("cannot write {}: {error}", file.display()), "free some space, or allow writing")
        })?;
        command.args(&words).current_dir(folder.path()).stdin(Stdio::null()).stdout(out).stderr(err);
        let child = command.spawn().map_err(process::refused)?;
        let line = words.iter().fold("slipstick".to_owned(), |line, word| line + " " + &shell_word(word));
        *current = Some(Job { child, line, log, run, code: None, ended: false, stopped: false });
        Ok(())
    }

    /// Stops the command: within a Newton iteration if it can, at once if it is asked again.
    pub fn stop(&self) {
        if let Some(job) = self.lock().as_mut() {
            job.look();
            if !job.ended && (job.stopped || !interrupt(&job.child)) {
                // it may have ended by itself
                let _ = job.child.kill();
            }
            job.stopped = true;
        }
    }

    /// The latest command: its line, its run, whether it runs, and how it ended.
    pub fn state(&self) -> Value {
        let mut current = self.lock();
        let Some(job) = current.as_mut() else { return Value::Null };
        job.look();
        json!({
            "line": job.line, "run": job.run, "log": job.log, "running": !job.ended, "code": job.code,
            "stopping": job.stopped && !job.ended,
        })
    }
}

/// Refuses what the command itself would refuse, before its log replaces that of the run.
fn refuse_run(folder: &Folder, asked: &Asked<'_>, run: &str) -> Outcome {
    let Ok(directory) = folder.run(run) else { return Ok(()) };
    if directory.is_in_progress() {
        let message = format!("another slipstick process is writing to {run}");
        return Err(Failure::input(message, "wait until it ends, or stop it in the terminal in which it was started"));
    }
    if asked.command != "resume" && !asked.force {
        let message = format!("{run} already contains the results of a run");
        return Err(Failure::input(message, "tick \u{201c}replace earlier results\u{201d}, or rename the directory"));
    }
    Ok(())
}

/// A log, opened twice: for errors and for output. What it contains is removed, unless the command continues it.
fn appended(file: &Path, continues: bool) -> std::io::Result<(File, File)> {
    if !continues {
        // a file that is open for appending cannot be made shorter on Windows
        File::create(file)?;
    }
    let out = File::options().create(true).append(true).open(file)?;
    Ok((out.try_clone()?, out))
}

/// Words after the program's name, the name of the run, and that of the log.
fn line(folder: &Folder, asked: &Asked<'_>) -> Outcome<(Vec<String>, String, String)> {
    let Asked { command, case, run, kind, force, hexahedra } = *asked;
    let words = |list: &[&str]| list.iter().map(|word| (*word).to_owned()).collect::<Vec<String>>();
    if command == "resume" {
        folder.run(run)?;
        return Ok((words(&["resume", &argument(run)]), run.to_owned(), log_of(run)));
    }
    let forced = |mut line: Vec<String>| {
        line.extend(force.then(|| "--force".into()));
        line
    };
    if command == "export" {
        let directory = folder.run(run)?;
        let Some((option, ending)) = EXPORTS.iter().find(|(option, _)| *option == kind) else {
            return Err(Failure::input(format!("{kind:?} cannot be exported"), "use the buttons of the page"));
        };
        let mut to = format!("{run}{ending}");
        let source = |to: &str| folder.is_step_of_cad(to) || folder.is_step_of_case(&directory, to);
        if kind == "step" && source(&to) {
            to = format!("{run}_optimized.step");
            if source(&to) {
                let message = format!("{to} is a file of another program, or that from which the case was made");
                return Err(Failure::input(message, "rename it, so that the export does not replace it"));
            }
        }
        folder.within(&to)?;
        let line = words(&["export", &argument(run), &format!("--{option}"), &argument(&to)]);
        return Ok((forced(line), String::new(), log_of(&format!("{run}_export"))));
    }
    if command == "new" {
        let (_, name) = (folder.source(case)?, argument(case));
        let deck = Folder::is_deck(case);
        let mut line = if deck { words(&["new", "--deck", &name]) } else { words(&["new", &name]) };
        line.extend((hexahedra && !deck).then(|| "--hexahedra".into()));
        return Ok((forced(line), String::new(), log_of(&format!("{case}_new"))));
    }
    folder.case(case)?;
    let stem = folder.stem(case);
    let file = argument(case);
    if command == "check" {
        return Ok((words(&["check", &file]), String::new(), log_of(&format!("{stem}_check"))));
    }
    let run = match command {
        "solve" => format!("{stem}_solve"),
        "optimize" => stem,
        _ => return Err(Failure::input(format!("there is no button for {command:?}"), "use those of the page")),
    };
    folder.within(&run)?;
    let line = words(&[command, &file, "--out", &argument(&run)]);
    let log = log_of(&run);
    Ok((forced(line), run, log))
}

/// A name as an argument, also if it begins like an option.
fn argument(name: &str) -> String {
    if name.starts_with('-') { format!("./{name}") } else { name.to_owned() }
}

/// The log of a run.
pub fn log_of(run: &str) -> String {
    format!("{run}.ui.log")
}

/// The end of a log; empty if there is none.
pub fn tail(folder: &Folder, name: &str) -> String {
    let read = |path: PathBuf| -> std::io::Result<Vec<u8>> {
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(SHOWN)))?;
        let mut bytes = Vec::new();
        file.take(SHOWN).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let bytes = folder.within(name).ok().and_then(|path| read(path).ok()).unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Sends what Ctrl-C sends; whether this is possible.
fn interrupt(child: &Child) -> bool {
    cfg!(unix)
        && Command::new("kill").args(["-INT", &child.id().to_string()]).status().is_ok_and(|status| status.success())
}
