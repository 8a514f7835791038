//! Input decks of Abaqus and CalculiX, translated to the tables of a case file.
//!
//! ```text
//! deck ──abaqus::cards──▶ keywords ──read──▶ Deck ──┐
//!  └────FileMesh::parse──▶ mesh ──bodies────────────┴─write──▶ TOML tables, mesh with further sets, ledger
//! ```
//!
//! [`translate`] gives the text of the tables; in it, the meshes of bodies refer to the deck itself.
//! [`mesh`] reads the same deck as a mesh, with the sets of elements, faces and nodes that the text names
//! and the deck does not. Both depend only on the bytes of the deck.
//!
//! The [`Ledger`] lists every keyword as used, translated, ignored or refused. What changes the physics
//! is refused, unless the caller accepts to ignore the keyword.
//!
//! ```
//! let deck = "*NODE, NSET=base\n1, 0,0,0\n2, 1,0,0\n3, 0,1,0\n*NODE\n4, 0,0,1\n\
//!             *ELEMENT, TYPE=C3D4, ELSET=part\n7, 1,2,3,4\n*MATERIAL, NAME=steel\n*ELASTIC\n210e3, 0.3\n\
//!             *SOLID SECTION, ELSET=part, MATERIAL=steel\n*BOUNDARY\nbase, 1, 3\n\
//!             *STEP\n*STATIC\n*CLOAD\n4, 3, -5.0\n*END STEP\n";
//! let translation = slipstick_deck::translate(deck.as_bytes(), "model.inp", &[]).unwrap();
//! assert!(translation.errors().is_empty());
//! assert!(translation.text.contains("linear_elastic = { youngs_modulus = 210000.0, poisson_ratio = 0.3 }"));
//! assert_eq!(slipstick_deck::mesh(deck.as_bytes()).unwrap().node_sets["base"], [0, 1, 2]);
//! ```

mod bodies;
mod constants;
mod history;
mod ledger;
mod read;
mod rigid_surfaces;
mod targets;
mod vector;
mod write;

use slipstick_meshio::abaqus::{Places, cards, decoded, flat};
use slipstick_meshio::{FileMesh, MeshFileError};

pub use ledger::{How, KeywordUse, Ledger, Refusal};

use bodies::Bodies;
use targets::Targets;

/// A deck as the tables of a case.
#[derive(Debug, Clone)]
pub struct Translation {
    /// The deck's heading.
    pub title: String,
    /// The tables, in TOML. Comments name the lines of the deck.
    pub text: String,
    /// Number of load steps.
    pub steps: usize,
    /// How every keyword was treated.
    pub ledger: Ledger,
}

impl Translation {
    /// Why the deck cannot be used, in the order of its lines.
    pub fn errors(&self) -> Vec<Refusal> {
        self.ledger.refusals()
    }
}

/// Translates a deck; `file` is its name in the case, and keywords in `ignored` are left out whatever
/// they mean.
///
/// # Errors
/// If its mesh cannot be read. What cannot be translated is in the [`Ledger`].
pub fn translate(bytes: &[u8], file: &str, ignored: &[String]) -> Result<Translation, MeshFileError> {
    let text = decoded(bytes);
    let flat = flat(&text).map_err(|error| Places::new(&text).told(error))?;
    let places = Places::new(&flat);
    let mut ledger = Ledger::new(file, ignored);
    let mut deck = read::deck(&cards(&flat)?, &mut ledger);
    let mut mesh = FileMesh::parse(&flat)?;
    deck.thicken_rigid_surfaces(&mut mesh, &mut ledger);
    let centres = mesh.complete_centres();
    let bodies = Bodies::new(&mut mesh, &centres, &deck, &mut ledger);
    deck.evaluate_constants(&mesh, &centres, &bodies, &mut ledger);
    let targets = Targets::new(&mut mesh, &centres, &deck, &bodies, &mut ledger);
    let text = write::case(&deck, &mesh, &bodies, &targets, file, &places, &mut ledger);
    ledger.place(&places);
    Ok(Translation { title: deck.title, text, steps: targets.load_steps, ledger })
}

/// Reads a deck as a mesh. If it has steps, the mesh has the sets that [`translate`] names in addition to
/// those of the file.
///
/// # Errors
/// As [`FileMesh::parse`].
pub fn mesh(bytes: &[u8]) -> Result<FileMesh, MeshFileError> {
    let text = decoded(bytes);
    let flat = flat(&text).map_err(|error| Places::new(&text).told(error))?;
    let mut mesh = FileMesh::parse(&flat)?;
    mesh.notices.extend(Places::new(&text).outside());
    mesh.notices.dedup();
    let cards = cards(&flat)?;
    if cards.iter().any(|card| card.keyword.name == "STEP") {
        let mut ledger = Ledger::new("", &[]);
        let mut deck = read::deck(&cards, &mut ledger);
        // the case of the deck has F̄ for these
        mesh.notices.retain(|notice| !notice.contains("are read as C3D8:"));
        if !deck.spring_elements.is_empty() {
            mesh.notices.retain(|notice| !only_springs(notice));
        }
        deck.thicken_rigid_surfaces(&mut mesh, &mut ledger);
        let centres = mesh.complete_centres();
        let bodies = Bodies::new(&mut mesh, &centres, &deck, &mut ledger);
        deck.evaluate_constants(&mesh, &centres, &bodies, &mut ledger);
        Targets::new(&mut mesh, &centres, &deck, &bodies, &mut ledger);
    }
    Ok(mesh)
}

/// Whether a notice of elements that are not read names only springs, which [`translate`] reads.
fn only_springs(notice: &str) -> bool {
    let types = notice.split_once(" of type ").and_then(|(_, rest)| rest.strip_suffix(" not read"));
    let types = types.and_then(|types| types.strip_suffix(" is").or_else(|| types.strip_suffix(" are")));
    types.is_some_and(|types| types.split(", ").all(|name| name.starts_with("SPRING") || name == "CONN3D2"))
}
