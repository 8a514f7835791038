//! Bodies from mesh files (`mesh = { file, part, scale, first_order }`).

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::rc::Rc;
use std::sync::Arc;

use slipstick_meshio::{FileMesh, MeshFileError};

use super::super::CaseCode;
use super::super::document::Table;
use super::super::reader::Reader;
use super::super::resolved::MeshFile;
use crate::file::sha256;

/// Reads a file that the case names and returns its bytes. The caller knows the folder and accesses
/// the file system.
pub type ReadFile<'f> = &'f dyn Fn(&str) -> io::Result<Vec<u8>>;

/// The contents of a file, or why it cannot be read and the remedy.
type Contents = Result<Rc<(FileMesh, String)>, (String, String)>;

/// The files that a case refers to; each is read once.
pub(super) struct MeshFiles<'f> {
    read: ReadFile<'f>,
    known: RefCell<BTreeMap<String, Contents>>,
    used: RefCell<BTreeMap<String, Used>>,
}

/// The parts of a file of which the case makes bodies.
#[derive(Default)]
struct Used {
    /// Where the case first names the file.
    path: String,
    /// The parts; `None`: the whole file.
    parts: Vec<Option<String>>,
}

impl<'f> MeshFiles<'f> {
    pub fn new(read: ReadFile<'f>) -> Self {
        Self { read, known: RefCell::default(), used: RefCell::default() }
    }

    fn get(&self, name: &str) -> Contents {
        self.known.borrow_mut().entry(name.to_owned()).or_insert_with(|| self.load(name)).clone()
    }

    /// Warns about elements of decks with sections that are in no body.
    pub fn warn_of_unused(&self, reader: &Reader) {
        for (file, Used { path, parts }) in &*self.used.borrow() {
            let Ok(contents) = self.get(file) else { continue };
            let mesh = &contents.0;
            let left_out = mesh.left_out(parts.iter().map(Option::as_deref));
            if left_out.is_empty() {
                continue;
            }
            let solids = mesh.solid_cells(None).len();
            let sections: Vec<String> = mesh.sections.iter().map(|set| format!("`{set}`")).collect();
            let message = format!("{} of the {solids} solid elements of {file} are in no body", left_out.len());
            let help = format!("the deck has sections for {}: use them as `part`", sections.join(", "));
            reader.warning(path, CaseCode::MeshFile, message, help);
        }
    }

    fn load(&self, name: &str) -> Contents {
        let bytes = (self.read)(name).map_err(|error| {
            let help = "the path is relative to the folder of the case file";
            (format!("cannot read the mesh file {name}: {error}"), help.to_owned())
        })?;
        let deck = bytes.trim_ascii_start().starts_with(b"*");
        let mesh = if deck { slipstick_deck::mesh(&bytes) } else { FileMesh::parse(&bytes) };
        let mesh = mesh.map_err(|error| explained(name, error))?;
        Ok(Rc::new((mesh, sha256(&bytes))))
    }
}

fn explained(file: &str, error: MeshFileError) -> (String, String) {
    (format!("{file}: {}: {}", error.place, error.message), error.cure)
}

/// The body; `None` after an error that leaves its surfaces unknown.
pub(super) fn mesh_file(table: &Table<'_>, body: &str, files: &MeshFiles<'_>) -> Option<MeshFile> {
    let file = table
        .string("file")
        .check(CaseCode::Empty, |file| !file.is_empty(), "is empty", "name a .msh, .inp, .vtu or .vtk file")
        .required(String::new(), "a .msh, .inp, .vtu or .vtk file, relative to the case file");
    let part = table.string("part").optional();
    let scale = table.number("scale").positive(CaseCode::OutOfRange).or(1.0);
    let first_order = table.boolean("first_order").or(false);
    let expected = table.string("sha256").optional();
    if file.is_empty() {
        return None;
    }
    let reader = table.reader;
    let error = |key: &str, (message, help): (String, String)| {
        reader.error(&table.path_of(key), CaseCode::MeshFile, message, help);
    };
    let contents = files.get(&file).map_err(|told| error("file", told)).ok()?;
    let (mesh, hash) = &*contents;
    let mut used = files.used.borrow_mut();
    let first = || Used { path: table.path_of("file"), parts: Vec::new() };
    used.entry(file.clone()).or_insert_with(first).parts.push(part.clone());
    drop(used);
    if expected.is_some_and(|expected| !expected.eq_ignore_ascii_case(hash)) {
        let help = "restore the original file, or remove the key";
        error("sha256", (format!("the SHA-256 of {file} is {hash}: the file has changed"), help.into()));
    }
    let read = match first_order {
        true => mesh.first_order_body(body, part.as_deref(), scale),
        false => mesh.body(body, part.as_deref(), scale),
    };
    let read = read.map_err(|found| {
        let key = if found.place.starts_with("part ") { "part" } else { "file" };
        error(key, explained(&file, found));
    });
    let read = read.ok()?;
    for notice in read.notices {
        let help = "no action is needed if this is intended";
        reader.warning(&table.path_of("file"), CaseCode::MeshFile, format!("{file}: {notice}"), help);
    }
    let because = |error: MeshFileError| <[String; 2]>::from(explained(&file, error));
    let unusable = read.unusable.into_iter().map(|(name, error)| (name, because(error))).collect();
    let (mesh, numbers) = (Arc::new(read.mesh), read.numbers.into());
    Some(MeshFile { part, scale, first_order, sha256: hash.clone(), mesh, numbers, unusable, file })
}
