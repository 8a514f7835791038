//! A picture of a run's results.

mod grey;
mod marks;
mod source;

use std::collections::BTreeSet;
use std::path::PathBuf;

use slipstick_mesh::{Mesh, facet_area_vector};

use self::grey::{THRESHOLD, has_surface, is_grey};
pub(crate) use self::marks::named;
use self::marks::{Shape, marks};
use self::source::{Source, sources};
use crate::charts::sentence;
use crate::export::{ExportError, ExportOptions, design_surface};
use crate::render::{
    Canvas, ColourMap, Field, FieldValues, Mark, Picture, RenderError, RenderOptions, Style, View, design_picture,
    state_picture, surface_picture,
};
use slipstick_case::file::Case;
use slipstick_results::output::StoredField;
use slipstick_results::output::fields::field_dimension;
use slipstick_results::run::{RunDirectory, RunError};

/// Which result is shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Shown {
    /// The newest design, in its state at the end of the load path if available.
    #[default]
    Newest,
    /// The design of an iteration, undeformed.
    Iteration(usize),
    /// The state at the end of a load step; 0 is the start.
    Step(usize),
    /// The iterate at which a march finally failed.
    Failure,
}

/// What is drawn, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureRequest {
    /// Name of a field, or a word that occurs only in its name: `pressure` for `contact_pressure`.
    /// `None` for densities or, if all of them are 1, for contact pressure or displacement.
    pub field: Option<String>,
    /// Which result.
    pub shown: Shown,
    /// Name of a view ([`View::names`]); `None` for one that shows the field.
    pub view: Option<String>,
    /// Factor on displacements; `None` for 1, if there are displacements.
    pub displacement_factor: Option<f64>,
    /// Elements whose density does not exceed this value are left out; `None` for a surface that preserves the
    /// volume or, with a field, for 0.5, or for 0 if no density exceeds 0.5.
    pub threshold: Option<f64>,
    /// Whether to draw the design as the smooth surface that is exported; if no threshold is given, it
    /// preserves the volume of the densities. Without field and threshold, a design is drawn so too.
    pub smooth: bool,
    /// The bodies to show; `None` for those with the field, and the others as glass, except around
    /// contact surfaces, which they would hide.
    pub bodies: Option<Vec<String>>,
    /// Whether supports, motions, loads, planes of symmetry, the undeformed shape and a scale bar are drawn.
    pub marks: bool,
    /// Size and smoothness.
    pub canvas: Canvas,
}

impl Default for PictureRequest {
    /// The newest design's surface; if nothing is designed, its contact pressure or
    /// displacement.
    fn default() -> Self {
        Self {
            field: None,
            shown: Shown::Newest,
            view: None,
            displacement_factor: None,
            threshold: None,
            smooth: false,
            bodies: None,
            marks: true,
            canvas: Canvas::default(),
        }
    }
}

/// A picture, and the field that gives its colours.
#[derive(Debug)]
pub struct Drawn {
    /// The picture.
    pub picture: Picture,
    /// The field's full name.
    pub field: String,
    /// Why that field was chosen; `None` if it was requested or shows a design.
    pub why: Option<&'static str>,
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// A file of the run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The picture itself.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The smooth surface of a design.
    #[error(transparent)]
    Surface(#[from] ExportError),
    /// A field that the results do not have, or whose name is ambiguous.
    #[error("there is no field `{name}` in {}", .place.display())]
    UnknownField {
        /// The requested name.
        name: String,
        /// The file or directory that was searched.
        place: PathBuf,
        /// The available fields.
        known: String,
    },
    /// A step or iteration without a file.
    #[error("{} has no {what} {number}", .directory.display())]
    NotWritten {
        /// The directory.
        directory: PathBuf,
        /// `load step` or `iteration`.
        what: &'static str,
        /// The requested number.
        number: usize,
        /// The available numbers.
        known: String,
    },
    /// The failing iterate was requested, but no march has failed.
    #[error("{} has no failure.vtu", .directory.display())]
    NoFailure {
        /// The directory.
        directory: PathBuf,
    },
    /// Displacements were requested, but there are none.
    #[error("{} has no displacements of this design", .directory.display())]
    NoDisplacement {
        /// The directory.
        directory: PathBuf,
    },
}

impl PictureError {
    /// The remedy, for users of the program.
    pub fn cure(&self) -> String {
        match self {
            Self::Run(error) => error.cure(),
            Self::Surface(error) => error.cure(),
            Self::Render(_) => "`slipstick help render` lists the options of a picture".into(),
            Self::UnknownField { known, .. } => format!("available fields: {known}"),
            Self::NotWritten { known, .. } => format!("available: {known}"),
            Self::NoFailure { .. } => "omit --failure: no load step of this run has finally failed".into(),
            Self::NoDisplacement { .. } => "omit --deformed, or analyse the design with `slipstick solve`".into(),
        }
    }
}

/// Draws a result of a run; `mesh` is that of its case.
///
/// Contact fields are drawn on the slave bodies alone, seen from the contact side, and without the values of
/// ties if there is other contact; densities and their
/// derivatives on the design, with the other bodies as glass; other fields on all bodies, vectors
/// by their magnitude. If bodies are named, only these are drawn.
///
/// # Errors
/// [`PictureError`].
pub fn picture(run: &RunDirectory, case: &Case, mesh: &Mesh, request: &PictureRequest) -> Result<Drawn, PictureError> {
    let sources = sources(run, mesh, request)?;
    let (name, why) = match &request.field {
        Some(name) => (name.as_str(), None),
        None => natural(case, &sources, request),
    };
    let Some((source, field)) = sources.iter().find_map(|s| Some((s, s.find(name)?))) else {
        let mut known: Vec<&str> = sources.iter().flat_map(|s| s.fields.iter().map(|f| f.name.as_str())).collect();
        known.sort_unstable();
        known.dedup();
        let place = sources.first().map_or(run.path().to_owned(), |source| source.place.clone());
        let place = if request.shown == Shown::Newest { run.path().to_owned() } else { place };
        return Err(PictureError::UnknownField { name: name.to_owned(), place, known: known.join(", ") });
    };
    let asked = request.field.is_some() || request.threshold.is_some() || request.shown == Shown::Failure;
    let natural = !asked && field.name == "density" && has_surface(case, mesh, &field.values);
    let picture = match (request.smooth, natural) {
        (true, _) => smooth_picture(run, case, mesh, request, source, field)?,
        // a design that has no surface yet is drawn by its elements
        (false, true) => match smooth_picture(run, case, mesh, request, source, field) {
            Err(PictureError::Surface(_)) => field_picture(run, case, mesh, request, source, field)?,
            drawn => drawn?,
        },
        (false, false) => field_picture(run, case, mesh, request, source, field)?,
    };
    Ok(Drawn { picture, field: field.name.clone(), why })
}

/// The most informative field if none is requested, and why it is not the density. If all densities
/// are 1, because nothing is designed or no material has been removed yet, they would give a single
/// colour.
fn natural(case: &Case, sources: &[Source], request: &PictureRequest) -> (&'static str, Option<&'static str>) {
    let first = sources.iter().find(|source| source.values("density").is_some());
    let full = first.and_then(|source| source.values("density")).is_some_and(|all| all.iter().all(|&phi| phi == 1.0));
    let why = if case.design.is_none() { "no body is designed" } else { "all densities are 1" };
    let shows = |name: &str| {
        first.and_then(|source| source.values(name)).is_some_and(|all| all.iter().any(|value| *value != 0.0))
    };
    match request.shown {
        Shown::Failure => ("smallest_determinant", None),
        _ if request.smooth || !full => ("density", None),
        _ if shows("contact_pressure") => ("contact_pressure", Some(why)),
        _ if shows("displacement") => ("displacement", Some(why)),
        _ => ("density", None),
    }
}

/// A field on the bodies that have it.
fn field_picture(
    run: &RunDirectory,
    case: &Case,
    mesh: &Mesh,
    request: &PictureRequest,
    source: &Source,
    field: &StoredField,
) -> Result<Picture, PictureError> {
    let displacement = source.values("displacement");
    if displacement.is_none() && request.displacement_factor.is_some_and(|factor| factor != 0.0) {
        return Err(PictureError::NoDisplacement { directory: run.path().to_owned() });
    }
    let solid = vec![1.0; mesh.elements.len()];
    let density = source.values("density").unwrap_or(&solid);
    let grey = is_grey(case, mesh, density);
    let threshold = request.threshold.unwrap_or(if grey { 0.0 } else { THRESHOLD });
    let options = options(case, mesh, (request, threshold), source, field)?;
    if field.name == "density" && displacement.is_none() {
        return Ok(design_picture(mesh, density, threshold, &options)?);
    }
    let lengths: Vec<f64>;
    let untied = without_ties(case, mesh, field);
    let values = match field.components {
        1 => untied.as_deref().unwrap_or(&field.values),
        n => {
            lengths = field.values.chunks_exact(n).map(|v| v.iter().map(|c| c * c).sum::<f64>().sqrt()).collect();
            &lengths[..]
        }
    };
    let values = if field.on_points { FieldValues::Nodes(values) } else { FieldValues::Elements(values) };
    let unit = field_dimension(&field.name).map_or(String::new(), |dimension| named(&case.units, dimension));
    let unit = if unit.is_empty() { unit } else { format!(" [{}]", unit.trim()) };
    let title = sentence(&field.name.replace("mises", "Mises")) + &unit;
    let still = vec![0.0; 3 * mesh.nodes.len()];
    let field = Field { title: &title, values };
    Ok(state_picture(mesh, displacement.unwrap_or(&still), density, threshold, &field, &options)?)
}

/// The design as a smooth surface, deformed if there are displacements.
fn smooth_picture(
    run: &RunDirectory,
    case: &Case,
    mesh: &Mesh,
    request: &PictureRequest,
    source: &Source,
    density: &StoredField,
) -> Result<Picture, PictureError> {
    let designed = || case.design.as_ref().map_or_else(Vec::new, |design| design.bodies.clone());
    let bodies = request.bodies.clone().unwrap_or_else(designed);
    let how = ExportOptions { threshold: request.threshold, bodies, ..ExportOptions::default() };
    let export = design_surface(mesh, &density.values, &how)?;
    let given = request.threshold.map_or(String::new(), |threshold| format!(", density > {threshold}"));
    let displacement = source.values("displacement");
    if displacement.is_none() && request.displacement_factor.is_some_and(|factor| factor != 0.0) {
        return Err(PictureError::NoDisplacement { directory: run.path().to_owned() });
    }
    let options = options(case, mesh, (request, export.threshold), source, density)?;
    let deformed = match options.displacement_factor {
        0.0 if displacement.is_some() => ", undeformed".into(),
        factor if displacement.is_some() && factor != 1.0 => format!(", displacements × {factor}"),
        _ => String::new(),
    };
    let what = if request.shown == Shown::Newest { "" } else { &source.what };
    let caption = format!("{what}{given}{deformed}").trim_start_matches(", ").to_owned();
    let options = RenderOptions { caption: (!caption.is_empty()).then(|| sentence(&caption)), ..options };
    Ok(surface_picture(mesh, &export.surface, displacement, &options)?)
}

fn options(
    case: &Case,
    mesh: &Mesh,
    (request, threshold): (&PictureRequest, f64),
    source: &Source,
    field: &StoredField,
) -> Result<RenderOptions, RenderError> {
    let contact = field.on_points && field.name != "displacement";
    let (bodies, others, natural) = if contact {
        let (bodies, below) = slaves(case, mesh);
        (Some(bodies), Style::Hidden, if below { "iso_below" } else { "iso" })
    } else if field.on_points || field.name == "body" || field.name == "smallest_determinant" {
        let all = mesh.bodies.iter().map(|body| body.name.clone()).collect();
        (Some(all), Style::Hidden, "iso")
    } else {
        (None, RenderOptions::default().others, "iso")
    };
    let (bodies, others) = match &request.bodies {
        Some(only) => (Some(only.clone()), Style::Hidden),
        None => (bodies, others),
    };
    let factor = request.displacement_factor.unwrap_or(1.0);
    let deformed = match source.values("displacement") {
        Some(_) if factor == 0.0 => ", undeformed".into(),
        Some(_) if factor != 1.0 => format!(", displacements × {factor}"),
        _ => String::new(),
    };
    // if nothing is left out, the caption does not mention the density
    let full = source.values("density").is_some_and(|all| all.iter().all(|&phi| phi == 1.0));
    let density = if full { String::new() } else { format!(", density > {threshold}") };
    let shown = |body: &str| {
        let only = bodies.as_ref().filter(|_| others == Style::Hidden);
        only.is_none_or(|only| only.iter().any(|name| name == body))
    };
    Ok(RenderOptions {
        marks: if request.marks { symbols(case, mesh, source, (threshold, factor), shown) } else { Vec::new() },
        undeformed: request.marks && !contact,
        length_unit: case.units.length.clone().filter(|_| request.marks),
        colour_map: if from_zero(field) { ColourMap::ViridisFromGrey } else { ColourMap::default() },
        canvas: request.canvas,
        view: View::named(request.view.as_deref().unwrap_or(natural))?,
        bodies,
        others,
        edges: ["density", "body", "smallest_determinant"].contains(&field.name.as_str()),
        displacement_factor: factor,
        caption: Some(sentence(&format!("{}{density}{deformed}", source.what))),
        ..RenderOptions::default()
    })
}

/// The symbols of the case at the bodies that are shown.
fn symbols(
    case: &Case,
    mesh: &Mesh,
    source: &Source,
    (threshold, factor): (f64, f64),
    shown: impl Fn(&str) -> bool,
) -> Vec<Mark> {
    let mut points = mesh.nodes.clone();
    for (point, by) in points.iter_mut().zip(source.values("displacement").unwrap_or(&[]).as_chunks::<3>().0) {
        (0..3).for_each(|c| point[c] += factor * by[c]);
    }
    let mut kept = vec![false; mesh.elements.len()];
    for body in mesh.bodies.iter().filter(|body| shown(&body.name)) {
        kept[body.elements.clone()].fill(true);
    }
    for (kept, density) in kept.iter_mut().zip(source.values("density").unwrap_or(&[])) {
        *kept &= *density > threshold;
    }
    marks(case, &Shape { mesh, points, kept })
}

/// Whether zero means that there is nothing: no contact, no slip, no work.
fn from_zero(field: &StoredField) -> bool {
    const NAMES: [&str; 6] = [
        "contact_pressure",
        "contact_traction",
        "contact_force",
        "slip_increment",
        "accumulated_slip",
        "friction_work",
    ];
    NAMES.contains(&field.name.as_str()) && (field.components > 1 || field.values.iter().all(|value| *value >= 0.0))
}

/// Names of fields in which ties would look like contact.
const OF_CONTACT: &[&str] =
    &["contact_pressure", "contact_gap", "contact_status", "slip_increment", "accumulated_slip"];

/// The values of a field of contact without those of ties, as at nodes without contact; `None` if there is
/// nothing to leave out. The tractions of ties are in the field of all tractions.
fn without_ties(case: &Case, mesh: &Mesh, field: &StoredField) -> Option<Vec<f64>> {
    let contact = OF_CONTACT.contains(&field.name.as_str());
    if !contact || case.contacts.iter().all(|pair| pair.tied == case.contacts[0].tied) {
        return None;
    }
    let nodes = |tied: bool| {
        let pairs = case.contacts.iter().filter(move |pair| pair.tied == tied);
        pairs.filter_map(|pair| mesh.surfaces.get(&pair.slave)).flat_map(|surface| surface.nodes())
    };
    let touching: BTreeSet<u32> = nodes(false).collect();
    let mut values = field.values.to_vec();
    let none = if field.name == "contact_status" { -1.0 } else { 0.0 };
    nodes(true).filter(|node| !touching.contains(node)).for_each(|node| values[node as usize] = none);
    Some(values)
}

/// Bodies with a slave surface, of ties only if there is no other contact, and whether these surfaces face
/// down.
fn slaves(case: &Case, mesh: &Mesh) -> (Vec<String>, bool) {
    let (mut names, mut up) = (Vec::new(), 0.0);
    for facet in case.shown_contacts().filter_map(|pair| mesh.surfaces.get(&pair.slave)).flat_map(|s| &s.facets) {
        up += facet_area_vector(&mesh.facet_coordinates(facet))[1];
        let body = mesh.body_of_element(facet.element as usize).map(|body| &mesh.bodies[body].name);
        if let Some(body) = body.filter(|body| !names.contains(*body)) {
            names.push(body.clone());
        }
    }
    if names.is_empty() {
        names = mesh.bodies.iter().map(|body| body.name.clone()).collect();
    }
    (names, up < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_case::construct::build_mesh;
    use slipstick_case::file::parse_case;

    /// A block on a slab, with a cap that is tied to it: at the block's upper nodes, which are slaves of the
    /// tie alone, contact has no value.
    #[test]
    fn ties_are_no_contact() {
        let body = |name: &str, low: f64, high: f64| {
            format!(
                "[[body]]\nname = '{name}'\nbox = {{ min = [0, {low:?}, 0], max = [1, {high:?}, 1], elements = [1, 1, 1] }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        let bodies = body("slab", 0.0, 1.0) + &body("block", 1.0, 2.0) + &body("cap", 2.0, 3.0);
        let pair = |slave: &str, master: &str, how: &str| {
            format!("[[contact]]\nslave = '{slave}'\nmaster = '{master}'\n{how}\n")
        };
        let case = |first: &str| {
            let text = bodies.clone()
                + &pair("block_ymin", "slab_ymax", first)
                + &pair("block_ymax", "cap_ymin", "tied = true")
                + "[[dirichlet]]\nset = 'slab_ymin'\n[load_path]\nsteps = 1\n";
            parse_case(&text, "ties.toml").expect("a case").case
        };
        let mixed = case("friction = 0.3");
        let mesh = build_mesh(&mixed).expect("a mesh");
        let field = |name: &str| {
            let values = vec![5.0; mesh.nodes.len()];
            StoredField { name: name.into(), on_points: true, components: 1, values }
        };
        let upper = &mesh.surfaces["block_ymax"].nodes();
        for (name, none) in [("contact_pressure", 0.0), ("contact_status", -1.0)] {
            let values = without_ties(&mixed, &mesh, &field(name)).expect("ties are left out");
            for (node, value) in values.iter().enumerate() {
                assert_eq!(*value, if upper.contains(&(node as u32)) { none } else { 5.0 }, "{name} at node {node}");
            }
        }
        assert!(without_ties(&mixed, &mesh, &field("displacement")).is_none());
        assert!(
            without_ties(&case("tied = true"), &mesh, &field("contact_pressure")).is_none(),
            "there is nothing else"
        );
        assert!(mixed.is_tie("block_ymax") && !mixed.is_tie("block_ymin") && !mixed.is_tie("slab_ymax"));
    }
}
