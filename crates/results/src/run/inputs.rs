//! The mesh files that a case names, and their copies in the directory of a run.
//!
//! A run keeps its inputs, so that it can be resumed, drawn and moved whatever happens to the
//! originals. `run.json` contains the names and hashes; a copy that has changed is rejected.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::directory::MESH_EXTENSIONS;
use super::{RunDirectory, RunError, RunRecord, sha256};
use crate::output::write_atomically;
use slipstick_case::file::{Case, ReadFile, Shape};

/// A file that a case names, and the copy that a run keeps.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFile {
    /// Its name in the case.
    pub name: String,
    /// The copy in the run's directory.
    pub stored: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

/// The bytes of a regular file. A pipe or device may never end, and reading it could not be interrupted.
fn regular(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is not a regular file but a folder, pipe or device"));
    }
    fs::read(path)
}

/// The bytes of a file or a pipe. A device such as `/dev/zero` may have no end.
///
/// # Errors
/// Those of the operating system, and that it is a device.
pub fn bytes_of(path: &Path) -> io::Result<Vec<u8>> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = fs::metadata(path)?.file_type();
        if kind.is_char_device() || kind.is_block_device() {
            return Err(io::Error::other("it is a device, not a file"));
        }
    }
    fs::read(path)
}

/// The bytes of a file, with the files that an Abaqus or CalculiX deck includes in their places.
pub fn with_includes(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = regular(path)?;
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("inp")) {
        return Ok(bytes);
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let included = slipstick_meshio::abaqus::with_includes(bytes, &|name| regular(&folder.join(name)));
    included.map_err(|error| io::Error::other(error.to_string()))
}

/// A reader for the mesh files that a case file names: from its folder or, if it is the `case.toml`
/// of a run, from the run's copies, which must not have changed. For
/// [`parse_case_with`](slipstick_case::file::parse_case_with).
pub fn mesh_files(case_file: &Path) -> impl Fn(&str) -> io::Result<Vec<u8>> {
    let folder = case_file.parent().map(Path::to_owned).unwrap_or_default();
    let of_run = case_file.file_name().is_some_and(|name| name == "case.toml");
    let run = RunDirectory::open(if folder.as_os_str().is_empty() { Path::new(".") } else { &folder });
    let record = run.ok().filter(|_| of_run).and_then(|run| RunRecord::read(&run).ok());
    let copies: BTreeMap<String, (PathBuf, String)> = record
        .into_iter()
        .flat_map(|record| record.inputs)
        .map(|input| (input.name, (folder.join(input.stored), input.sha256)))
        .collect();
    move |name| {
        let Some((copy, expected)) = copies.get(name) else { return with_includes(&folder.join(name)) };
        let bytes = fs::read(copy).map_err(|error| {
            let message = format!("the run's copy {}: {error}; restore it, or start a new run", copy.display());
            io::Error::new(error.kind(), message)
        })?;
        let found = sha256(&bytes);
        if found == *expected {
            return Ok(bytes);
        }
        let copy = copy.display();
        let message = format!(
            "{copy} is not the mesh that this run was started with: its SHA-256 is {found}, not {expected}; restore \
             the original file, or start a new run"
        );
        Err(io::Error::other(message))
    }
}

/// Copies the mesh files that a case names into the directory of a run; `read` reads them, as for
/// [`parse_case_with`](slipstick_case::file::parse_case_with).
///
/// # Errors
/// [`RunError::Damaged`] if a file has changed since the case was read; [`RunError::Read`],
/// [`RunError::Output`].
pub fn keep_mesh_files(
    run: &RunDirectory,
    case: &Case,
    case_file: &Path,
    read: ReadFile<'_>,
) -> Result<Vec<InputFile>, RunError> {
    let mut kept: Vec<InputFile> = Vec::new();
    for body in &case.bodies {
        let Shape::Mesh(mesh) = &body.shape else { continue };
        if kept.iter().any(|input| input.name == mesh.file) {
            continue;
        }
        let path = case_file.parent().unwrap_or(Path::new("")).join(&mesh.file);
        let bytes = read(&mesh.file).map_err(RunError::read(&path))?;
        if sha256(&bytes) != mesh.sha256 {
            let (reason, cure) = ("has changed since the case was read".into(), "run the command again".into());
            return Err(RunError::Damaged { path, reason, cure });
        }
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let extension = MESH_EXTENSIONS.iter().find(|known| known.eq_ignore_ascii_case(extension)).unwrap_or(&"dat");
        let stored = format!("mesh_{:04}.{extension}", kept.len() + 1);
        write_atomically(&run.file(&stored), |writer| writer.write_all(&bytes))?;
        kept.push(InputFile { name: mesh.file.clone(), stored, sha256: mesh.sha256.clone() });
    }
    Ok(kept)
}
