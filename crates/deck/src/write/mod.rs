//! Writes the tables of a case.

mod bodies;
mod bolts;
mod contact;
mod equations;
mod motion;
mod springs;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use slipstick_meshio::FileMesh;
use slipstick_meshio::abaqus::Places;

use crate::bodies::{Bodies, find};
use crate::ledger::Ledger;
use crate::read::Deck;
use crate::targets::{POINT, Targets};

/// The tables of a deck; `file` is its name in the case.
pub fn case(
    deck: &Deck,
    mesh: &FileMesh,
    bodies: &Bodies,
    targets: &Targets,
    file: &str,
    places: &Places,
    ledger: &mut Ledger,
) -> String {
    let (tables, names) = (String::new(), BTreeSet::new());
    let mut writer = Writer { deck, mesh, bodies, targets, file, places, ledger, text: tables, names };
    writer.bodies();
    writer.contact();
    writer.equations();
    writer.bolts();
    writer.motions();
    writer.loads();
    writer.masses();
    writer.springs();
    writer.heated();
    writer.text
}

struct Writer<'a> {
    deck: &'a Deck,
    mesh: &'a FileMesh,
    bodies: &'a Bodies,
    targets: &'a Targets,
    file: &'a str,
    places: &'a Places,
    ledger: &'a mut Ledger,
    text: String,
    /// Names of slave surfaces and unions.
    names: BTreeSet<String>,
}

impl Writer<'_> {
    /// Begins a table, with a comment on the line of the deck that it comes from.
    fn table(&mut self, header: &str, keyword: &str, line: usize) {
        let place = self.place(line);
        let _ = write!(self.text, "\n# {place} *{keyword}\n[[{header}]]\n");
    }

    fn place(&self, line: usize) -> String {
        let (file, line) = self.places.of(line);
        format!("{}:{line}", if file.is_empty() { self.file } else { file })
    }

    fn line(&mut self, text: impl AsRef<str>) {
        self.text.push_str(text.as_ref());
        self.text.push('\n');
    }

    /// The name of a set of the file on a body, or of a point.
    fn on(&self, body: usize, set: &str) -> String {
        if body == POINT {
            return set.to_owned();
        }
        FileMesh::name_on_body(&self.bodies.list[body].name, set)
    }

    /// The name of a surface of the deck in the case; a union, if it lies on several bodies.
    fn surface(&mut self, name: &str, keyword: &str, line: usize) -> Option<String> {
        let known = find(&self.mesh.face_sets, name).or_else(|| find(&self.mesh.cell_sets, name))?;
        let on = self.bodies.under(self.mesh, known);
        match on[..] {
            [] => {
                let why = format!("the surface `{name}` lies on no body");
                self.ledger.wrong(keyword, [line, line], why, "define it by faces of solid elements");
                None
            }
            [body] => Some(self.on(body, known)),
            _ => {
                let parts: Vec<String> = on.iter().map(|&body| quoted(&self.on(body, known))).collect();
                if self.names.insert(known.to_owned()) {
                    self.table("surface", "SURFACE", line);
                    let text = format!("name = {}\nof = [{}]", quoted(known), parts.join(", "));
                    self.line(text);
                }
                Some(known.to_owned())
            }
        }
    }
}

/// A TOML string.
fn quoted(text: &str) -> String {
    let mut out = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out + "\""
}

/// A TOML list of numbers.
fn vector(x: &[f64]) -> String {
    format!("[{}]", x.iter().map(|x| format!("{:?}", x + 0.0)).collect::<Vec<_>>().join(", "))
}
