//! Files that a deck includes, and the places of lines in them.

use std::collections::BTreeSet;
use std::io;

use super::lines::{Line, Lines, decoded};
use crate::MeshFileError;
use crate::cursor::shortened;

/// Begins a comment that says which line of which file follows: `**# 12 "bolts.inp"`. An empty name is
/// that of the deck.
pub(super) const MARK: &str = "**# ";

/// A mark that the next line of the text is this one.
pub(super) fn mark(line: usize, file: &str) -> String {
    format!("{MARK}{line} \"{file}\"\n")
}

/// How deeply files may include each other.
const DEPTH: usize = 32;

/// The text of a deck with all included files in place of `*INCLUDE`, with comments that keep the
/// [`Places`] of lines; unchanged if it includes nothing. `read` reads a file by its path relative to the
/// deck.
///
/// # Errors
/// If a file cannot be read, or includes itself.
pub fn with_includes(bytes: Vec<u8>, read: &dyn Fn(&str) -> io::Result<Vec<u8>>) -> Result<Vec<u8>, MeshFileError> {
    if !has_keyword(&bytes, "INCLUDE") {
        return Ok(bytes);
    }
    let mut expansion = Expansion { read, out: Vec::with_capacity(bytes.len()), open: Vec::new() };
    expansion.file("", &bytes)?;
    Ok(expansion.out)
}

/// Whether a line begins with `*` and this keyword.
pub(super) fn has_keyword(bytes: &[u8], keyword: &str) -> bool {
    bytes.split(|&byte| byte == b'\n').any(|line| {
        let Some(rest) = line.trim_ascii_start().strip_prefix(b"*") else { return false };
        let rest = rest.trim_ascii_start();
        let ends = |byte: Option<&u8>| byte.is_none_or(|&byte| byte == b',' || byte.is_ascii_whitespace());
        rest.get(..keyword.len()).is_some_and(|start| start.eq_ignore_ascii_case(keyword.as_bytes()))
            && ends(rest.get(keyword.len()))
    })
}

struct Expansion<'r> {
    read: &'r dyn Fn(&str) -> io::Result<Vec<u8>>,
    out: Vec<u8>,
    open: Vec<String>,
}

impl Expansion<'_> {
    fn file(&mut self, name: &str, bytes: &[u8]) -> Result<(), MeshFileError> {
        let text = decoded(bytes);
        let mut number = 0;
        let mut rest: &[u8] = &text;
        if !name.is_empty() {
            self.out.extend(mark(1, name).bytes());
        }
        while !rest.is_empty() {
            let end = rest.iter().position(|&byte| byte == b'\n').map_or(rest.len(), |end| end + 1);
            let line = &rest[..end];
            if !has_keyword(line, "INCLUDE") {
                self.out.extend(line);
                (rest, number) = (&rest[end..], number + 1);
                continue;
            }
            let mut lines = Lines::after(rest, number);
            let Some(Line::Keyword(keyword)) = lines.next()? else { break };
            let input = keyword.required("INPUT").map_err(|error| at(error, name))?;
            self.include(&input, keyword.line, name)?;
            (rest, number) = lines.rest();
            self.out.extend(mark(number + 1, name).bytes());
        }
        if !self.out.ends_with(b"\n") {
            self.out.push(b'\n');
        }
        Ok(())
    }

    fn include(&mut self, input: &str, line: usize, from: &str) -> Result<(), MeshFileError> {
        let error = |message: String, cure: &str| at(MeshFileError::new(format!("line {line}"), message, cure), from);
        let path = input.replace('\\', "/");
        let shown = shortened(&path);
        if self.open.contains(&path) || self.open.len() >= DEPTH {
            return Err(error(format!("`{shown}` includes itself"), "remove this *INCLUDE"));
        }
        let bytes = (self.read)(&path).map_err(|cause| {
            error(
                format!("cannot read the included file `{shown}`: {cause}"),
                "the path is relative to the folder of the deck",
            )
        })?;
        self.open.push(path.clone());
        self.file(&path, &bytes)?;
        self.open.pop();
        Ok(())
    }
}

fn at(error: MeshFileError, file: &str) -> MeshFileError {
    if file.is_empty() { error } else { MeshFileError { place: format!("{file}, {}", error.place), ..error } }
}

/// The places in files of the lines of a text with marks.
pub struct Places {
    /// Number of the line after a mark, the line of the file that it is, and the file.
    marks: Vec<(usize, usize, String)>,
}

impl Places {
    /// Finds the marks.
    pub fn new(text: &[u8]) -> Self {
        let lines = text.split(|&byte| byte == b'\n').zip(1..);
        let mark = |(line, number): (&[u8], usize)| {
            let rest = std::str::from_utf8(line.strip_prefix(MARK.as_bytes())?).ok()?;
            let (line, file) = rest.trim_end().split_once(' ')?;
            Some((number + 1, line.parse().ok()?, file.trim_matches('"').to_owned()))
        };
        Self { marks: lines.filter_map(mark).collect() }
    }

    /// File and line of a line of the text; the name of the deck itself is empty.
    pub fn of(&self, line: usize) -> (&str, usize) {
        match self.marks[..self.marks.partition_point(|mark| mark.0 <= line)].last() {
            Some((after, at, file)) => (file, at + line - after),
            None => ("", line),
        }
    }

    /// Notices about files outside of the folder of the deck.
    pub fn outside(&self) -> BTreeSet<String> {
        let outside =
            |path: &&String| path.starts_with('/') || path.contains(':') || path.split('/').any(|part| part == "..");
        let files = self.marks.iter().map(|(_, _, file)| file).filter(outside);
        files.map(|file| format!("the deck includes `{}`, which is outside of its folder", shortened(file))).collect()
    }

    /// An error with its place in a file.
    pub fn told(&self, error: MeshFileError) -> MeshFileError {
        let Some(line) = error.place.strip_prefix("line ").and_then(|line| line.parse().ok()) else { return error };
        let (file, line) = self.of(line);
        at(MeshFileError { place: format!("line {line}"), ..error }, file)
    }
}
