//! The directory that belongs to one run.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::RunError;

/// A directory that belongs to one run, and the names of its files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunDirectory {
    path: PathBuf,
}

/// Files of a run by their whole names.
const FILES: &[&str] = &[
    "case.toml",
    "checkpoint.json",
    "design.csv",
    "design.pvd",
    "evaluate.csv",
    "failure.vtu",
    "gradient.csv",
    "gradient.vtu",
    "history.csv",
    "newton.csv",
    "path.pvd",
    "verify.csv",
    "verify.json",
    "run.json",
];

/// Files of a run that are numbered: `{stem}_XXXX.vtu`.
const NUMBERED: &[&str] = &["design", "path"];

impl RunDirectory {
    /// Looks whether [`RunDirectory::create`] would refuse, and changes nothing.
    ///
    /// # Errors
    /// [`RunError::Exists`], unless `force`; [`RunError::Directory`] where no directory can be.
    pub fn refuse_existing(path: &Path, force: bool) -> Result<(), RunError> {
        let directory = || path.to_owned();
        if path.join("run.json").exists() && !force {
            return Err(RunError::Exists { directory: directory() });
        }
        if path.exists() && !path.is_dir() {
            let (reason, cure) = ("a file of that name exists".into(), "name another directory with --out".into());
            return Err(RunError::Directory { directory: directory(), reason, cure });
        }
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        if let Some(parent) = parent.filter(|parent| !parent.is_dir()) {
            let reason = format!("there is no directory {}", parent.display());
            let cure = "make it first, or name another directory with --out".into();
            return Err(RunError::Directory { directory: directory(), reason, cure });
        }
        Ok(())
    }

    /// A directory for a new run: made where it is missing (its parent is not). With `force`, the files of an earlier
    /// run are removed, and nothing but those.
    ///
    /// # Errors
    /// As [`RunDirectory::refuse_existing`]; [`RunError::Directory`] if the operating system refuses.
    pub fn create(path: &Path, force: bool) -> Result<Self, RunError> {
        Self::refuse_existing(path, force)?;
        let refused = |error: io::Error| RunError::Directory {
            directory: path.to_owned(),
            reason: error.to_string(),
            cure: "check the permission to write there, or name another directory with --out".into(),
        };
        if !path.is_dir() {
            fs::create_dir(path).map_err(refused)?;
        }
        let run = Self { path: path.to_owned() };
        if run.file("run.json").is_file() {
            run.clear().map_err(refused)?;
        } else if let Some(name) = run.own_name_taken().map_err(refused)? {
            return Err(RunError::Directory {
                directory: path.to_owned(),
                reason: format!("it holds `{name}`, which is not of a run but has the name of a result"),
                cure: "name another directory with --out, or move the file away".into(),
            });
        }
        // Better to learn now than after the first iteration that nothing can be written.
        let probe = run.file(".slipstick-probe");
        fs::write(&probe, b"").and_then(|()| fs::remove_file(&probe)).map_err(refused)?;
        Ok(run)
    }

    /// The directory of an earlier run.
    ///
    /// # Errors
    /// [`RunError::NoRun`] where it holds none.
    pub fn open(path: &Path) -> Result<Self, RunError> {
        if path.join("run.json").is_file() {
            Ok(Self { path: path.to_owned() })
        } else {
            Err(RunError::NoRun { directory: path.to_owned(), file: "run.json" })
        }
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

    /// A file in the directory that a run would replace.
    fn own_name_taken(&self) -> io::Result<Option<String>> {
        for entry in fs::read_dir(&self.path)? {
            let name = entry?.file_name();
            if let Some(name) = name.to_str().filter(|name| is_numbered(name) || FILES.contains(name)) {
                return Ok(Some(name.to_owned()));
            }
        }
        Ok(None)
    }

    /// Removes the files of an earlier run; `run.json`, which marks the directory, last.
    fn clear(&self) -> io::Result<()> {
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            if entry.file_name().to_str().is_some_and(is_numbered) {
                fs::remove_file(entry.path())?;
            }
        }
        for name in FILES {
            match fs::remove_file(self.file(name)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }
}

/// Whether a name is `{stem}_{digits}.vtu` of a run.
fn is_numbered(name: &str) -> bool {
    NUMBERED.iter().any(|stem| {
        let digits = name.strip_prefix(stem).and_then(|rest| rest.strip_prefix('_'));
        let digits = digits.and_then(|rest| rest.strip_suffix(".vtu"));
        digits.is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()))
    })
}
