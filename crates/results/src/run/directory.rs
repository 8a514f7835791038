//! The directory of a run.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::RunError;
use super::lock::{self, Lock};
use crate::output::whole_name;
use slipstick_case::file::Output;
use slipstick_model::model::Share;

/// The directory of one run, and the names of its files.
#[derive(Debug, Clone)]
pub struct RunDirectory {
    path: PathBuf,
    /// The lock, if the directory is open for writing.
    lock: Option<Arc<Lock>>,
    /// Whether meshes are also written in pieces.
    in_pieces: bool,
    /// Whether the load path is also written as one file.
    vtkhdf: bool,
}

/// Files of a run with fixed names.
const FILES: &[&str] = &[
    "case.toml",
    "checkpoint.json",
    "contact.csv",
    "curve.png",
    "quantities.csv",
    "design.csv",
    "design.pvd",
    "design.stl",
    "measures.json",
    "evaluate.csv",
    "failure.vtu",
    "gradient.csv",
    "gradient.vtu",
    "history.csv",
    "history.png",
    "newton.csv",
    "path.pvd",
    "path.vtkhdf",
    "picture.png",
    "report.html",
    "verify.csv",
    "verify.json",
    "run.json",
    super::result::RESULT,
    super::warnings::WARNINGS,
    super::start_values::FILES[0],
    super::start_values::FILES[1],
];

/// The file that marks a directory as that of a run: it is written first and removed last.
const MARK: &str = "run.json";

/// Files that commands for viewing a run write to its directory, without its lock.
const OF_READERS: &[&str] = &["curve.png", "design.stl", "history.png", "measures.json", "picture.png", "report.html"];

/// Numbered files of a run: `{stem}_XXXX.vtu`, and in pieces `{stem}_XXXX.pvtu` and
/// `{stem}_XXXX.{rank}.vtu`.
const NUMBERED: &[&str] = &["design", "path"];

/// Extensions of the copies of mesh files, `mesh_XXXX.{extension}`; the last one is used for all
/// other extensions.
pub(super) const MESH_EXTENSIONS: &[&str] = &["msh", "inp", "vtu", "dat"];

impl RunDirectory {
    /// A directory for a new run, locked against other processes while this value exists. It is
    /// made if it is missing, but its parent must exist. With `force`, the files of an earlier run
    /// are removed, and no other files.
    ///
    /// # Errors
    /// [`RunError::Exists`] if there is a run, unless `force`; [`RunError::Locked`] if a run is in
    /// progress; [`RunError::Directory`] if the path cannot be a directory, if other files have the
    /// names of results, or if the operating system refuses.
    pub fn create(path: &Path, force: bool) -> Result<Self, RunError> {
        refuse_place(path)?;
        let refused = |error: io::Error| RunError::cannot_write(path, &error);
        match fs::create_dir(path) {
            Err(_) if path.is_dir() => {}
            made => made.map_err(refused)?,
        }
        let mut run = Self { path: path.to_owned(), lock: None, in_pieces: false, vtkhdf: false };
        // A directory without a run is not touched, not even by a lock, if it contains other files
        // with the names of results.
        if !run.holds_run() && !run.file(lock::NAME).exists() {
            run.refuse_names_of_results()?;
        }
        let lock = Lock::take(path);
        if run.holds_run() && !force {
            let in_progress = lock.err().filter(|error| matches!(error, RunError::Locked { .. }));
            return Err(in_progress.unwrap_or(RunError::Exists { directory: path.to_owned() }));
        }
        run.lock = Some(Arc::new(lock?));
        if run.holds_run() {
            run.clear().map_err(refused)?;
        } else {
            run.refuse_names_of_results()?;
        }
        run.remove_parts().map_err(refused)?;
        // It is better to learn now than after the first iteration that nothing can be written.
        let probe = run.file(".slipstick-probe");
        fs::write(&probe, b"").and_then(|()| fs::remove_file(&probe)).map_err(refused)?;
        Ok(run)
    }

    /// Opens the directory of an earlier run for reading.
    ///
    /// # Errors
    /// [`RunError::NoRun`] if it contains none.
    pub fn open(path: &Path) -> Result<Self, RunError> {
        let run = Self { path: path.to_owned(), lock: None, in_pieces: false, vtkhdf: false };
        if run.holds_run() { Ok(run) } else { Err(RunError::NoRun { directory: path.to_owned(), file: MARK }) }
    }

    /// Opens the directory of an earlier run to continue it; it is locked against other processes
    /// while this value exists.
    ///
    /// # Errors
    /// As [`RunDirectory::open`]; [`RunError::Locked`] if another process writes to it;
    /// [`RunError::Directory`] if the operating system refuses.
    pub fn take_up(path: &Path) -> Result<Self, RunError> {
        let mut run = Self::open(path)?;
        run.lock = Some(Arc::new(Lock::take(path)?));
        run.remove_parts().map_err(|error| RunError::cannot_write(path, &error))?;
        Ok(run)
    }

    fn holds_run(&self) -> bool {
        self.file(MARK).is_file()
    }

    /// Whether a process is writing to this directory now.
    pub fn is_in_progress(&self) -> bool {
        Lock::is_taken(&self.path)
    }

    /// The directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in the directory.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Name of the numbered file of a design or load step.
    pub fn numbered(stem: &str, number: usize) -> String {
        format!("{stem}_{number:04}.vtu")
    }

    /// The same directory, with the additional files that `[output]` requests: meshes in pieces, one
    /// per rank (`pieces`), and the load path as one file (`vtkhdf`).
    pub fn writing(self, output: &Output) -> Self {
        Self { in_pieces: output.pieces, vtkhdf: output.vtkhdf, ..self }
    }

    /// Whether the load path is also written as one file, `path.vtkhdf`.
    pub fn vtkhdf(&self) -> bool {
        self.vtkhdf
    }

    /// The piece of every element, if meshes are also written in pieces.
    pub fn pieces(&self, share: &Share, elements: usize) -> Option<Vec<u32>> {
        self.in_pieces.then(|| (0..elements).map(|element| share.rank_of(element)).collect())
    }

    /// The entry of a series for a numbered file: the file itself, or the file that lists its
    /// pieces.
    pub fn in_series(&self, name: &str) -> String {
        let stem = name.strip_suffix(".vtu").filter(|_| self.in_pieces);
        stem.map_or_else(|| name.to_owned(), |stem| format!("{stem}.pvtu"))
    }

    /// The file of the whole mesh for an entry of a series.
    pub fn whole_of(shown: &str) -> String {
        shown.strip_suffix(".pvtu").map_or_else(|| shown.to_owned(), |stem| format!("{stem}.vtu"))
    }

    /// Numbers of the existing numbered files of a kind (`design`, `path`), ascending.
    ///
    /// # Errors
    /// [`RunError::Read`].
    pub fn numbers(&self, stem: &str) -> Result<Vec<usize>, RunError> {
        let mut all = Vec::new();
        for entry in fs::read_dir(&self.path).map_err(RunError::read(&self.path))? {
            let name = entry.map_err(RunError::read(&self.path))?.file_name();
            let digits =
                name.to_str().and_then(|name| name.strip_prefix(stem)?.strip_prefix('_')?.strip_suffix(".vtu"));
            all.extend(digits.and_then(|digits| digits.parse::<usize>().ok()));
        }
        all.sort_unstable();
        Ok(all)
    }

    /// Pseudo-times of the states of the load path by file name, as `path.pvd` lists them: of the load cases
    /// one after the other ([`LoadTime::of_axis`](slipstick_path::LoadTime::of_axis)). Empty without this
    /// file.
    ///
    /// # Errors
    /// [`RunError::Read`].
    pub fn path_times(&self) -> Result<Vec<(String, f64)>, RunError> {
        let path = self.file("path.pvd");
        if !path.is_file() {
            return Ok(Vec::new());
        }
        let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
        let value = |tag: &str, name: &str| -> Option<String> {
            let start = tag.find(&format!(" {name}=\""))? + name.len() + 3;
            tag[start..].split('"').next().map(str::to_owned)
        };
        let file = |tag: &str| value(tag, "file").map(|shown| Self::whole_of(&shown));
        let entry = |tag: &str| Some((file(tag)?, value(tag, "timestep")?.parse().ok()?));
        Ok(text.split("<DataSet").skip(1).filter_map(entry).collect())
    }

    /// Removes the numbered files of a kind, and their pieces, with a larger number than `last`.
    pub(super) fn remove_after(&self, stem: &str, last: usize) -> io::Result<()> {
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            let name = entry.file_name();
            let number = name
                .to_str()
                .filter(|name| is_numbered(name))
                .and_then(|name| name.strip_prefix(stem)?.strip_prefix('_')?.split('.').next()?.parse::<usize>().ok());
            if number.is_some_and(|number| number > last) {
                fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    }

    /// Refuses a directory with a file that a run would replace.
    fn refuse_names_of_results(&self) -> Result<(), RunError> {
        let refused = |error: io::Error| RunError::cannot_write(&self.path, &error);
        for entry in fs::read_dir(&self.path).map_err(refused)? {
            let name = entry.map_err(refused)?.file_name();
            if let Some(name) = name.to_str().filter(|name| is_numbered(name) || FILES.contains(name)) {
                return Err(RunError::Directory {
                    directory: self.path.clone(),
                    reason: format!("it contains `{name}`, which is named like a result but does not belong to a run"),
                    cure: "name another directory with --out, or move the file away".into(),
                });
            }
        }
        Ok(())
    }

    /// Removes the files of an earlier run; `run.json`, which marks the directory, is removed last.
    fn clear(&self) -> io::Result<()> {
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            if entry.file_name().to_str().is_some_and(is_numbered) {
                fs::remove_file(entry.path())?;
            }
        }
        for name in FILES.iter().filter(|name| **name != MARK).chain([&MARK]) {
            match fs::remove_file(self.file(name)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }

    /// Removes incomplete files left by a killed process; the caller has the lock.
    fn remove_parts(&self) -> io::Result<()> {
        for entry in fs::read_dir(&self.path)? {
            let name = entry?.file_name();
            let whole = name.to_str().and_then(|name| whole_name(name));
            if whole.is_some_and(|whole| is_numbered(whole) || FILES.contains(&whole) && !OF_READERS.contains(&whole)) {
                fs::remove_file(self.path.join(name))?;
            }
        }
        Ok(())
    }
}

/// Refuses a path that cannot become a directory.
fn refuse_place(path: &Path) -> Result<(), RunError> {
    let directory = || path.to_owned();
    if path.exists() && !path.is_dir() {
        let (reason, cure) = ("a file with that name exists".into(), "name another directory with --out".into());
        return Err(RunError::Directory { directory: directory(), reason, cure });
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Some(parent) = parent.filter(|parent| !parent.is_dir()) {
        let reason = format!("there is no directory {}", parent.display());
        let cure = "create it first, or name another directory with --out".into();
        return Err(RunError::Directory { directory: directory(), reason, cure });
    }
    Ok(())
}

/// Whether a name is `{stem}_{digits}.{extension}` of a run, or the name of a piece.
fn is_numbered(name: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let numbered = |stem: &str, extension: &str| {
        let rest = name.strip_prefix(stem).and_then(|rest| rest.strip_prefix('_'));
        let rest = rest.and_then(|rest| rest.strip_suffix(extension)).and_then(|rest| rest.strip_suffix('.'));
        rest.is_some_and(|rest| match rest.split_once('.') {
            Some((number, piece)) => extension == "vtu" && stem != "mesh" && digits(number) && digits(piece),
            None => digits(rest),
        })
    };
    NUMBERED.iter().any(|stem| numbered(stem, "vtu") || numbered(stem, "pvtu"))
        || MESH_EXTENSIONS.iter().any(|extension| numbered("mesh", extension))
}
