//! Writes a case as a deck that CalculiX runs and Abaqus reads, and compares its results.
//!
//! ```text
//! case, mesh ──reduced──▶ solid part of a design ──deck──▶ model.inp, case.toml, deck.json
//!                                      model.inp ──ccx──▶ model.frd, model.dat ──results──▶ values per quantity
//! ```
//!
//! A deck has steps; a case has one path with curves over pseudo-time. All curves are sampled at the ends
//! of load steps, and each interval in which all of them are linear becomes a step: at the ends of load
//! steps, deck and case prescribe the same. What a deck cannot hold is a [`Note`] at its key, which
//! refuses the deck if the physics would change.

mod bodies;
mod compare;
mod hardness;
mod history;
mod joints;
mod press;
mod reduce;
mod results;
mod supports;
mod symmetry;
#[cfg(test)]
mod tests;
mod text;
mod warnings;

use serde::{Deserialize, Serialize};
use slipstick_case::construct::{BuildError, moved_mesh, sections};
use slipstick_case::file::{Case, Promise};
use slipstick_mesh::Mesh;
use slipstick_solid::Sections;

pub use compare::{Compared, Source};
pub use reduce::{Reduced, solid_part};
pub use results::{ResultsError, Values};

use bodies::Names;
use history::History;

/// What cannot be written, or not exactly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Note {
    /// The key of the case, such as `contact[0].offset`.
    pub key: String,
    /// Why.
    pub message: String,
    /// What to do about it.
    pub cure: String,
    /// Whether the deck would be another problem; otherwise it is close.
    pub refused: bool,
}

/// A deck with its case.
#[derive(Debug, Clone)]
pub struct Written {
    /// The deck.
    pub deck: String,
    /// A case that takes its tables from the deck and has the quantities and promises.
    pub case: String,
    /// What is compared with CalculiX.
    pub record: DeckRecord,
    /// What is not written, or not exactly.
    pub notes: Vec<Note>,
}

/// A deck in `deck.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeckRecord {
    /// File name of the deck.
    pub deck: String,
    /// File name of its case.
    pub case: String,
    /// The load case; `None`: the only one.
    pub load_case: Option<String>,
    /// What is compared.
    pub compared: Vec<Compared>,
    /// Quantities that are not compared, with reasons.
    pub left_out: Vec<(String, String)>,
    /// Largest pressure per penetration that CalculiX has where contact is hard in the case; `None`: no such contact.
    /// \[F/L³\]
    #[serde(default)]
    pub contact_stiffness: Option<f64>,
}

/// What to write.
#[derive(Debug, Clone, Copy)]
pub struct DeckOptions<'a> {
    /// Position of the load case.
    pub load_case: usize,
    /// Keys that may be left out although the physics changes, as in [`Note::key`] without numbers in
    /// brackets, or with them.
    pub ignored: &'a [String],
    /// Slope of linear contact instead of hard contact. \[F/L³\]
    pub contact_stiffness: Option<f64>,
    /// Values that the design promises.
    pub promises: &'a [Promise],
}

/// A case as a deck; `mesh` is that of the case, or the part of it that is solid.
///
/// # Errors
/// [`BuildError`] at a table whose sets do not exist in the mesh. What a deck cannot hold is in
/// [`Written::notes`].
pub fn deck(case: &Case, mesh: &Mesh, options: DeckOptions<'_>) -> Result<Written, BuildError> {
    let load_case = case.load_cases.get(options.load_case);
    let file = |stem: &str, end: &str| match load_case {
        Some(load_case) => format!("{stem}_{}.{end}", load_case.name),
        None => format!("{stem}.{end}"),
    };
    // a deck has bodies in one piece
    let touching: Vec<usize> = mesh.cuts.iter().map(|cut| mesh.touching(cut)).collect();
    let uncut;
    let mesh = if mesh.cuts.is_empty() {
        mesh
    } else {
        uncut = mesh.uncut();
        &uncut
    };
    // regions hold before bodies move
    let sections = sections(case, mesh)?;
    let moved = moved_mesh(case, mesh, options.load_case)?;
    let mesh = moved.as_ref().unwrap_or(mesh);
    let pressed = press::pressed(case, mesh);
    let mesh = pressed.as_ref().unwrap_or(mesh);
    let (deck_file, case_file) = (file("model", "inp"), file("case", "toml"));
    let mut writer = Writer {
        case,
        mesh,
        sections: &sections,
        options,
        notes: Vec::new(),
        names: Names::new(mesh),
        model: String::new(),
        next_node: mesh.nodes.len() as u32,
        next_element: mesh.elements.len() as u32,
        history: History::new(case.load_path.steps),
        external: vec![0.0; 3 * mesh.nodes.len()],
        slope: None,
    };
    let mut text = writer.heading();
    writer.contact();
    writer.couplings();
    writer.springs()?;
    writer.motions();
    writer.held_couplings();
    writer.bolts(&touching);
    writer.equations()?;
    writer.loads(&writer.masses());
    writer.temperatures();
    writer.settings();
    writer.interrupted_supports();
    writer.early_fits();
    let record = writer.compared(&deck_file, &case_file);
    let steps = writer.steps(&record);
    let (case, left_out) = writer.case_text(&deck_file);
    let record = DeckRecord { left_out: [record.left_out, left_out].concat(), ..record };
    let bodies = writer.bodies();
    text.push_str(&bodies);
    text.push_str(&writer.sets());
    text.push_str(&writer.model);
    text.push_str(&steps);
    Ok(Written { deck: text, case, record, notes: writer.notes })
}

/// Everything that is being written.
struct Writer<'a> {
    case: &'a Case,
    mesh: &'a Mesh,
    /// Materials of the elements.
    sections: &'a Sections,
    options: DeckOptions<'a>,
    notes: Vec<Note>,
    names: Names,
    /// Keywords between the mesh and the first step.
    model: String,
    /// Numbers of further nodes and elements, from 0.
    next_node: u32,
    next_element: u32,
    history: History,
    /// Loads at the end of the path, at reference positions, three for each node. \[F\]
    external: Vec<f64>,
    /// Largest pressure per penetration of contact that is hard in the case. \[F/L³\]
    slope: Option<f64>,
}

impl Writer<'_> {
    /// Notes that the deck is close to the case, but differs.
    fn warn(&mut self, key: impl Into<String>, message: impl Into<String>, cure: impl Into<String>) {
        let (key, message, cure) = (key.into(), message.into(), cure.into());
        self.notes.push(Note { key, message, cure, refused: false });
    }

    /// Notes that the deck would be another problem.
    fn refuse(&mut self, key: impl Into<String>, message: impl Into<String>, cure: impl Into<String>) {
        let (key, message) = (key.into(), message.into());
        let bare: String = {
            let mut inside = false;
            let outside = |c: &char| {
                inside = (inside || *c == '[') && *c != ']';
                !inside && *c != ']'
            };
            key.chars().filter(outside).collect()
        };
        let refused = !self.options.ignored.iter().any(|ignored| *ignored == key || *ignored == bare);
        let cure = format!("{}; `--ignore {bare}` leaves it out", cure.into());
        self.notes.push(Note { key, message, cure, refused });
    }

    /// Keys of the load path that a deck cannot have.
    fn settings(&mut self) {
        if self.case.load_path.viscosity != 0.0 {
            self.refuse("load_path.viscosity", "static steps of a deck have no viscosity", "set it to 0");
        }
    }
}
