//! The folder that the page shows. Cases and runs are named by a single word, and lie in it.

use std::path::{Component, Path, PathBuf};

use slipstick::output::write_atomically;
use slipstick::run::{RunDirectory, RunRecord, bytes_of};
use slipstick_service::failure::{Failure, Outcome};

/// The folder.
pub struct Folder(PathBuf);

/// What the page shows first.
#[derive(Debug, Default, PartialEq)]
pub struct Opened {
    /// A case file or a deck; empty: none.
    pub case: String,
    /// A run; empty: none.
    pub run: String,
    /// A STEP file; empty: none.
    pub step: String,
}

impl Folder {
    /// The folder of a case file, of a deck, or of a run, or the folder itself.
    ///
    /// # Errors
    /// [`Failure::Input`] if there is none.
    pub fn of(path: &Path) -> Outcome<(Self, Opened)> {
        let wrong = |error| Failure::input(format!("cannot open {}: {error}", path.display()), "check the name");
        let whole = path.canonicalize().map_err(wrong)?;
        let name = whole.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let parent = || Self(whole.parent().unwrap_or(Path::new("/")).to_owned());
        if whole.is_file() {
            if is_step(&name) {
                return Ok((parent(), Opened { step: name, ..Opened::default() }));
            }
            if !is_case(&name) {
                let cure = "name a case file (.toml), a deck (.inp), a STEP file, the directory of a run, or a folder \
                            with these";
                return Err(Failure::input(format!("{} is not a case", path.display()), cure));
            }
            return Ok((parent(), Opened { case: name, ..Opened::default() }));
        }
        let Ok(directory) = RunDirectory::open(&whole) else { return Ok((Self(whole), Opened::default())) };
        let record = RunRecord::read(&directory)?;
        let of = Path::new(&record.case_file).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let folder = parent();
        let case = if folder.case(&of).is_ok() { of } else { String::new() };
        Ok((folder, Opened { case, run: name, ..Opened::default() }))
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// A case file or deck of the folder.
    ///
    /// # Errors
    /// [`Failure::Input`] if it has none of this name.
    pub fn case(&self, name: &str) -> Outcome<PathBuf> {
        let path = self.within(name)?;
        if path.is_file() && is_case(name) {
            return Ok(path);
        }
        Err(Failure::input(format!("there is no case {name} in {}", self.0.display()), "choose one of the list"))
    }

    /// The directory of a run in the folder.
    ///
    /// # Errors
    /// [`Failure::Input`] if it has none of this name.
    pub fn run(&self, name: &str) -> Outcome<RunDirectory> {
        Ok(RunDirectory::open(&self.within(name)?)?)
    }

    /// The path of a name that is a single word and leads to a place in the folder; it need not exist.
    ///
    /// # Errors
    /// [`Failure::Input`].
    pub fn within(&self, name: &str) -> Outcome<PathBuf> {
        let mut parts = Path::new(name).components();
        let single = matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name);
        let path = self.0.join(name);
        // a link leads elsewhere
        let inside = path.canonicalize().map_or(!path.is_symlink(), |found| found == path);
        if single && !name.contains(['/', '\\', ':', '\0']) && inside {
            return Ok(path);
        }
        let message = format!("{name:?} is not a name in {}", self.0.display());
        Err(Failure::input(message, "the page only opens files of the folder with which it was started"))
    }

    /// A deck or a STEP file of the folder, of which `slipstick new` makes a case.
    ///
    /// # Errors
    /// [`Failure::Input`] if it has none of this name.
    pub fn source(&self, name: &str) -> Outcome<PathBuf> {
        let path = self.within(name)?;
        if path.is_file() && (is_step(name) || Self::is_deck(name)) {
            return Ok(path);
        }
        let message = format!("there is no deck or STEP file {name} in {}", self.0.display());
        Err(Failure::input(message, "choose one of the list"))
    }

    /// Whether a name is that of a deck.
    pub fn is_deck(name: &str) -> bool {
        has_extension(name, &["inp"])
    }

    /// What the names of runs of a case begin with: its name without the extension, but for a deck that shares
    /// this with a case file.
    pub fn stem(&self, case: &str) -> String {
        let stem = Path::new(case).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let shared = Self::is_deck(case) && self.case(&format!("{stem}.toml")).is_ok();
        if shared { format!("{stem}_inp") } else { stem }
    }

    /// Names of cases, runs and STEP files, in order.
    pub fn names(&self) -> [Vec<String>; 3] {
        let entries = std::fs::read_dir(&self.0).into_iter().flatten().filter_map(Result::ok);
        let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
        names.sort();
        let of = |known: &dyn Fn(&str) -> bool| names.iter().filter(|name| known(name)).cloned().collect();
        [
            of(&|name| self.case(name).is_ok()),
            of(&|name| self.run(name).is_ok()),
            of(&|name| is_step(name) && self.source(name).is_ok()),
        ]
    }

    /// Whether a file is there that another program than this one has written, as its header says.
    pub fn is_step_of_cad(&self, name: &str) -> bool {
        let head = |path: PathBuf| bytes_of(&path).map(|bytes| bytes[..bytes.len().min(1024)].to_vec());
        let own = |head: Vec<u8>| String::from_utf8_lossy(&head).contains("'slipstick'");
        self.within(name).ok().filter(|path| path.is_file()).is_some_and(|path| head(path).is_ok_and(|head| !own(head)))
    }

    /// Whether the case of a run was made from this STEP file: the script that `slipstick new` has written meshes it.
    pub fn is_step_of_case(&self, run: &RunDirectory, name: &str) -> bool {
        let Ok(record) = RunRecord::read(run) else { return false };
        let line = format!("STEP = {}", serde_json::json!(name));
        let named = record.inputs.iter().map(|input| input.name.as_str()).chain([record.case_file.as_str()]);
        let stems = named.filter_map(|named| Path::new(named).file_stem()?.to_str());
        let scripts = stems.filter_map(|stem| self.within(&format!("{stem}_mesh.py")).ok());
        scripts
            .filter_map(|script| bytes_of(&script).ok())
            .any(|text| String::from_utf8_lossy(&text).lines().any(|one| one.trim_end() == line))
    }

    /// Replaces the text of a case.
    ///
    /// # Errors
    /// [`Failure::Input`] if it cannot be written.
    pub fn save(&self, name: &str, text: &str) -> Outcome {
        let path = self.case(name)?;
        // the byte order mark that some editors write is not part of the text
        let marked = bytes_of(&path).is_ok_and(|bytes| bytes.starts_with(MARK));
        let mark = if marked && !text.as_bytes().starts_with(MARK) { MARK } else { b"" };
        Ok(write_atomically(&path, |writer| {
            writer.write_all(mark)?;
            writer.write_all(text.as_bytes())
        })?)
    }
}

/// The byte order mark of UTF-8.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Whether a name is that of a case file or a deck.
fn is_case(name: &str) -> bool {
    has_extension(name, &["toml", "inp"])
}

/// Whether a name is that of a STEP file.
fn is_step(name: &str) -> bool {
    has_extension(name, &["step", "stp"])
}

fn has_extension(name: &str, known: &[&str]) -> bool {
    let extension = Path::new(name).extension().and_then(|of| of.to_str()).unwrap_or_default();
    known.iter().any(|known| extension.eq_ignore_ascii_case(known))
}
