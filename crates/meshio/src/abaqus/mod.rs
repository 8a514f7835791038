//! Abaqus' and CalculiX' input format: `*KEYWORD, PARAMETER=VALUE` lines, each followed by lines of
//! data.
//!
//! The reader handles `*NODE`, `*ELEMENT`, `*NSET`, `*ELSET`, `*SURFACE` and the sets of
//! `*SOLID SECTION`. Models of parts and instances are made [`flat`] first, and the caller replaces
//! `*INCLUDE` by the files, see [`with_includes`]. Sets may be used before they are defined. The reader
//! refuses other keywords that place or generate nodes, counts elements that are neither solids nor
//! surfaces, skips all remaining keywords with their data, and stops at the first `*STEP`.

mod assembly;
mod include;
mod lines;
mod sets;

pub use assembly::{Card, cards, flat};
pub use include::{Places, with_includes};
pub use lines::{Keyword, Line, Lines, decoded};

use std::borrow::Cow;
use std::collections::BTreeSet;

use crate::builder::Builder;
use crate::cursor::{finite, shortened};
use crate::{CellKind, FileMesh, MeshFileError};
use sets::Sets;

/// Keywords that change the meaning of nodes and elements.
const REFUSED: &[(&str, &str)] = &[
    ("INCLUDE", "replace it by the text of the included file"),
    ("SYSTEM", "write global Cartesian coordinates"),
    ("NGEN", EXPLICIT),
    ("NFILL", EXPLICIT),
    ("NCOPY", EXPLICIT),
    ("NMAP", EXPLICIT),
    ("ELGEN", EXPLICIT),
    ("ELCOPY", EXPLICIT),
];
const EXPLICIT: &str = "write all nodes and elements explicitly";

/// The keyword that the data lines belong to.
enum Block {
    Skipped,
    /// Elements of a type that is not read.
    Others,
    Nodes {
        set: Option<String>,
    },
    Elements {
        kind: CellKind,
        set: Option<String>,
    },
    NodeSet {
        name: String,
        generate: bool,
    },
    ElementSet {
        name: String,
        generate: bool,
    },
    Faces {
        name: String,
    },
    NodeSurface {
        name: String,
    },
}

/// Reads a file.
pub(crate) fn parse(bytes: &[u8]) -> Result<FileMesh, MeshFileError> {
    let text = decoded(bytes);
    let flat = flat(&text).map_err(|error| Places::new(&text).told(error))?;
    let mut mesh = read(&flat, matches!(text, Cow::Owned(_))).map_err(|error| Places::new(&flat).told(error))?;
    mesh.notices.extend(Places::new(&text).outside());
    Ok(mesh)
}

/// Reads a flat model.
fn read(text: &[u8], latin: bool) -> Result<FileMesh, MeshFileError> {
    let mut file = Reader::default();
    let mut block = Block::Skipped;
    if latin {
        file.notices.push("lines that are not UTF-8 are read as Latin-1 (ISO 8859-1)".into());
    }
    let mut lines = Lines::new(text);
    while let Some(line) = lines.next()? {
        match line {
            Line::Keyword(keyword) if keyword.name == "STEP" => break,
            Line::Keyword(keyword) => {
                file.complete(&lines)?;
                block = file.begin(&keyword)?;
            }
            Line::Data { number, fields } => file.data(&block, number, &fields)?,
        }
    }
    file.complete(&lines)?;
    file.finish()
}

/// The mesh read so far.
#[derive(Default)]
struct Reader {
    builder: Builder,
    /// Number of nodes that are still missing for the last element.
    wanted: usize,
    sets: Sets,
    notices: Vec<String>,
    /// Element types that are read as another one.
    reduced: Vec<String>,
    /// Element types that are not read.
    others: BTreeSet<String>,
}

impl Reader {
    /// Reports an element whose nodes are incomplete.
    fn complete(&self, lines: &Lines<'_>) -> Result<(), MeshFileError> {
        if self.wanted == 0 {
            return Ok(());
        }
        let message = format!("the previous element lacks {} nodes", self.wanted);
        Err(MeshFileError::new(lines.place(), message, "give each element all its nodes"))
    }

    fn begin(&mut self, keyword: &Keyword<'_>) -> Result<Block, MeshFileError> {
        if let Some((name, cure)) = REFUSED.iter().find(|(name, _)| *name == keyword.name) {
            return Err(keyword.error(format!("*{name} is not supported"), *cure));
        }
        let optional = |parameter| keyword.parameter(parameter).map(str::to_owned);
        Ok(match keyword.name.as_str() {
            "NODE" if keyword.has("SYSTEM") && optional("SYSTEM").as_deref() != Some("R") => {
                return Err(keyword.error("nodes are not in Cartesian coordinates", "write SYSTEM=R"));
            }
            "NODE" => Block::Nodes { set: optional("NSET") },
            "ELEMENT" => match self.element_type(keyword)? {
                Some(kind) => Block::Elements { kind, set: optional("ELSET") },
                None => Block::Others,
            },
            "NSET" => match keyword.parameter("ELSET") {
                Some(elements) => {
                    self.sets.nodes_of_elements(keyword.required("NSET")?, elements, keyword.line);
                    Block::Skipped
                }
                None => Block::NodeSet { name: keyword.required("NSET")?, generate: keyword.has("GENERATE") },
            },
            "SOLID SECTION" => {
                keyword.parameter("ELSET").into_iter().for_each(|set| self.sets.section(set));
                Block::Skipped
            }
            "ELSET" => Block::ElementSet { name: keyword.required("ELSET")?, generate: keyword.has("GENERATE") },
            "SURFACE" => match keyword.parameter("TYPE").map(str::to_ascii_uppercase).as_deref() {
                None | Some("ELEMENT") => Block::Faces { name: keyword.required("NAME")? },
                Some("NODE") => Block::NodeSurface { name: keyword.required("NAME")? },
                Some(_) => Block::Skipped,
            },
            _ => Block::Skipped,
        })
    }

    /// The shape of the elements; `None` for elements that are neither solids nor surfaces nor lines.
    fn element_type(&mut self, keyword: &Keyword<'_>) -> Result<Option<CellKind>, MeshFileError> {
        let name = keyword.required("TYPE")?.to_ascii_uppercase();
        let Some(kind) = kind(&name) else {
            if !["C3D", "DC3D", "AC3D", "CPS", "CPE", "CAX"].iter().any(|family| name.starts_with(family)) {
                self.others.insert(name);
                return Ok(None);
            }
            let message = format!("elements of type {} are not supported", shortened(&name));
            return Err(keyword.error(
                message,
                "use C3D4, C3D6, C3D8, C3D10, C3D20 or C3D27 for bodies, and S or M3D elements with 3, 4, 6, 8 or 9 nodes \
                 for surfaces, or remove these elements",
            ));
        };
        if kind == CellKind::Hex8 && name != "C3D8" && !self.reduced.contains(&name) {
            self.reduced.push(name);
        }
        Ok(Some(kind))
    }

    fn data(&mut self, block: &Block, line: usize, fields: &[&str]) -> Result<(), MeshFileError> {
        match block {
            Block::Skipped => Ok(()),
            Block::Others => {
                self.sets.skipped.extend(fields[0].parse::<u64>());
                Ok(())
            }
            Block::Nodes { set } => self.node(set.as_deref(), line, fields),
            Block::Elements { kind, set } => self.element(*kind, set.as_deref(), line, fields),
            Block::NodeSet { name, generate } => self.sets.nodes(name, line, fields, *generate),
            Block::ElementSet { name, generate } => self.sets.elements(name, line, fields, *generate),
            Block::Faces { name } => self.sets.faces(name, line, fields),
            Block::NodeSurface { name } => self.sets.nodes(name, line, &fields[..1], false),
        }
    }

    /// Number and up to three coordinates; omitted ones are zero.
    fn node(&mut self, set: Option<&str>, line: usize, fields: &[&str]) -> Result<(), MeshFileError> {
        let number = lines::number(fields[0], line)?;
        let mut x = [0.0; 3];
        for (x, field) in x.iter_mut().zip(fields[1..].iter().filter(|field| !field.is_empty())) {
            // Fortran writes exponents with a D.
            let value = field.replace(['d', 'D'], "e").parse().ok().and_then(finite);
            *x = value.ok_or_else(|| {
                let message = format!("`{}` is not a coordinate", shortened(field));
                MeshFileError::new(format!("line {line}"), message, "give three finite numbers")
            })?;
        }
        self.builder.point(number, x);
        if let Some(set) = set {
            self.sets.node(set, number, line);
        }
        Ok(())
    }

    /// Number and nodes, on as many lines as needed.
    fn element(
        &mut self,
        kind: CellKind,
        set: Option<&str>,
        line: usize,
        fields: &[&str],
    ) -> Result<(), MeshFileError> {
        for field in fields.iter().filter(|field| !field.is_empty()) {
            let number = lines::number(field, line)?;
            if self.wanted > 0 {
                self.builder.nodes.push(number);
                self.wanted -= 1;
                continue;
            }
            if !std::ptr::eq(*field, fields[0]) {
                let (name, count) = (kind.name(), kind.node_count());
                let message = format!("a {name} has {count} nodes, and this line goes on after the last one");
                let help = "start each element on a new line, and give the one before it all its nodes";
                return Err(MeshFileError::new(format!("line {line}"), message, help));
            }
            self.builder.cell(kind, number);
            self.wanted = kind.node_count();
            if let Some(set) = set {
                self.sets.element(set, number, line);
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<FileMesh, MeshFileError> {
        let (mut mesh, nodes) = self.builder.finish()?;
        let skipped = self.sets.skipped.len();
        self.sets.resolve(&mut mesh, &nodes)?;
        mesh.notices.extend(self.notices);
        if !self.others.is_empty() {
            let types = self.others.into_iter().collect::<Vec<_>>().join(", ");
            let (elements, are) =
                if skipped == 1 { ("1 element".into(), "is") } else { (format!("{skipped} elements"), "are") };
            mesh.notices.push(format!("{elements} of type {types} {are} not read"));
        }
        if !self.reduced.is_empty() {
            let types = self.reduced.join(", ");
            mesh.notices.push(format!("elements of type {types} are read as C3D8: trilinear, fully integrated"));
        }
        Ok(mesh)
    }
}

/// Families of element types by the beginning of their names, and their shapes by number of nodes
/// (for beams, by order). The letters after the number (reduced integration, hybrid, …) do not
/// change the mesh.
const FAMILIES: &[(&str, &[(&str, CellKind)])] = &[
    ("C3D", SOLIDS),
    ("CPS", FACES),
    ("CPE", FACES),
    ("CAX", FACES),
    ("M3D", FACES),
    ("SFM3D", FACES),
    ("R3D", &[("2", CellKind::Line2), ("3", CellKind::Triangle3), ("4", CellKind::Quad4)]),
    ("STRI", &[("3", CellKind::Triangle3), ("65", CellKind::Triangle6)]),
    ("S", FACES),
    ("T3D", &[("2", CellKind::Line2), ("3", CellKind::Line3)]),
    ("T2D", &[("2", CellKind::Line2), ("3", CellKind::Line3)]),
    ("B", &[("31", CellKind::Line2), ("32", CellKind::Line3)]),
];
const SOLIDS: &[(&str, CellKind)] = &[
    ("4", CellKind::Tet4),
    ("5", CellKind::Pyramid5),
    ("6", CellKind::Wedge6),
    ("8", CellKind::Hex8),
    ("10", CellKind::Tet10),
    ("15", CellKind::Wedge15),
    ("20", CellKind::Hex20),
    ("27", CellKind::Hex27),
];
const FACES: &[(&str, CellKind)] = &[
    ("3", CellKind::Triangle3),
    ("4", CellKind::Quad4),
    ("6", CellKind::Triangle6),
    ("8", CellKind::Quad8),
    ("9", CellKind::Quad9),
];

/// The shape of an element type, if it belongs to a body, surface or line.
fn kind(name: &str) -> Option<CellKind> {
    if name.starts_with("C3D15V") {
        // with nodes at the centres of its quadrilaterals
        return Some(CellKind::Wedge18);
    }
    FAMILIES.iter().find_map(|(family, kinds)| {
        let rest = name.strip_prefix(family)?;
        let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        kinds.iter().find(|(nodes, _)| *nodes == &rest[..digits]).map(|&(_, kind)| kind)
    })
}
