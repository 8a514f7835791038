//! Finds the `[[surface]]` tables that select given facets and no others.
//!
//! | facets | table |
//! |---|---|
//! | those of a surface that has a name | none: its name |
//! | flat | their direction and a box around them |
//! | on a cylinder or a sphere | its mantle; with a box if other facets lie on it too |
//! | a smooth face | `connected` to a point on it; with a box, if it continues beyond |
//! | others | a box, with or without a cone of directions |
//! | none of these | a table for each smooth part of them, and one that joins the parts |
//!
//! Every table is tried with the selection that a case uses; one that selects another facet is not proposed.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;

use super::select::{angle, facets_that_meet, smooth_face};
use crate::file::{BoxRegion, Connected, Cylinder, NormalCone, Sphere, SurfaceSet};
use nalgebra::Vector3;
use slipstick_mesh::{Facet, FacetNodes, Mesh, Shape, Surface, facet_area_vector, smooth_surface};

/// How given facets are selected.
#[derive(Debug, Clone, PartialEq)]
pub struct Picked {
    /// The tables to add to the case, in order; none: the mesh has a surface of these facets.
    pub tables: Vec<SurfaceSet>,
    /// The name of the surface of the facets.
    pub surface: String,
}

/// Facets that no table selects.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct NotSelectable {
    /// Which facets, of which body.
    pub message: String,
    /// The remedy.
    pub help: String,
}

/// Most parts of which a surface is joined.
const MOST_PARTS: usize = 24;
/// Facets are flat if their normals differ by less than this. \[°\]
const FLAT: f64 = 0.5;
/// Facets of a cylinder or a sphere meet at smaller angles. \[rad\]
const SMOOTH: f64 = std::f64::consts::FRAC_PI_3;

type Key = FacetNodes;

/// The facets of faces of the mesh's elements or of the facets themselves, each given by its corners in any
/// order; a triangle may repeat a corner. `None` if one is not on the boundary of a body.
pub fn facets_of_faces(mesh: &Mesh, faces: &[[u32; 4]]) -> Option<Vec<Facet>> {
    let key = |nodes: &[u32]| {
        let mut nodes = nodes.to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    };
    let mut known: HashMap<Vec<u32>, Vec<Facet>> = HashMap::new();
    for facet in (0..mesh.bodies.len()).flat_map(|body| mesh.boundary(body).facets) {
        let element = &mesh.elements[facet.element as usize];
        known.entry(key(&facet.nodes)).or_default().push(facet);
        if !element.is_second_order() {
            continue;
        }
        let sorted = facet.nodes.sorted();
        let side = (0..element.sides()).find(|&side| element.side(side).sorted() == sorted)?;
        let of_face = element.face((0..element.faces()).find(|&face| element.sides_of(face).contains(&side))?);
        let corners = if of_face.len() == 6 { 3 } else { 4 };
        known.entry(key(&of_face[..corners])).or_default().push(facet);
    }
    let found: Option<Vec<_>> = faces.iter().map(|face| known.get(&key(face))).collect();
    let mut facets: Vec<Facet> = found?.into_iter().flatten().copied().collect();
    let mut seen = HashSet::new();
    facets.retain(|facet| seen.insert(facet.nodes.sorted()));
    Some(facets)
}

/// The tables for these facets, of any bodies; the last one gets this name, or one like it if it is taken.
/// Angles in degrees between facets of one smooth face are tried in the given order.
///
/// # Errors
/// [`NotSelectable`] names the body and the place of facets that no table selects.
///
/// Tests: `faces_of_all_shapes_are_selected`, `what_no_table_selects_is_refused`.
pub fn pick(mesh: &Mesh, facets: &[Facet], name: &str, degrees: &[f64]) -> Result<Picked, NotSelectable> {
    let wanted: HashSet<Key> = facets.iter().map(|facet| facet.nodes.sorted()).collect();
    if wanted.is_empty() {
        let (message, help) = ("no face is picked".into(), "click on a face of the model".into());
        return Err(NotSelectable { message, help });
    }
    let named = Named::of(mesh);
    if let Some(surface) = named.exactly(&wanted) {
        return Ok(Picked { tables: Vec::new(), surface });
    }
    let name = unused(mesh, name);
    let mut groups: Vec<Vec<Facet>> = vec![Vec::new(); mesh.bodies.len()];
    for facet in facets {
        groups[mesh.body_of_element(facet.element as usize).unwrap_or(0)].push(*facet);
    }
    let groups = groups.into_iter().enumerate().filter(|(_, group)| !group.is_empty()).collect::<Vec<_>>();
    if let [(body, group)] = &groups[..] {
        let parts = parts(mesh, group, degrees);
        let all_named = parts.len() > 1 && parts.iter().all(|part| named.exactly(&keys(part)).is_some());
        if !all_named && let Some(table) = single(mesh, *body, group, &name, degrees) {
            return Ok(Picked { tables: vec![table], surface: name });
        }
    }
    let parts: Vec<(usize, Vec<Facet>)> = groups
        .iter()
        .flat_map(|(body, group)| parts(mesh, group, degrees).into_iter().map(move |part| (*body, part)))
        .collect();
    if parts.len() > MOST_PARTS {
        let message = format!("the picked faces have more than {MOST_PARTS} separate parts");
        return Err(NotSelectable { message, help: format!("pick at most {MOST_PARTS}, or a larger angle") });
    }
    let (mut tables, mut of) = (Vec::new(), Vec::new());
    for (body, part) in &parts {
        if let Some(known) = named.exactly(&keys(part)) {
            of.push(known);
            continue;
        }
        let own = unused(mesh, &format!("{name}_{}", 1 + tables.len()));
        let table = single(mesh, *body, part, &own, degrees).ok_or_else(|| refusal(mesh, *body, part))?;
        tables.push(table);
        of.push(own);
    }
    if parts.len() < 2 {
        return Err(refusal(mesh, parts[0].0, &parts[0].1));
    }
    tables.push(SurfaceSet { name: name.clone(), of, ..SurfaceSet::default() });
    Ok(Picked { tables, surface: name })
}

fn refusal(mesh: &Mesh, body: usize, part: &[Facet]) -> NotSelectable {
    let [x, y, z] = centre(mesh, part).map(|c| rounded(c, decimals(size(mesh, part)).max(0)));
    let message = format!(
        "no [[surface]] selects exactly these {} facets of {} around [{x}, {y}, {z}]",
        part.len(),
        mesh.bodies[body].name
    );
    let help = "pick whole smooth faces, with a larger or smaller angle, or name the faces in the program that made \
                the mesh";
    NotSelectable { message, help: help.into() }
}

/// A name that the mesh does not use yet.
fn unused(mesh: &Mesh, name: &str) -> String {
    let taken = |name: &String| mesh.names().contains(&name.as_str()) || mesh.body(name).is_some();
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    std::iter::once(name.to_owned()).chain(numbered).find(|name| !taken(name)).unwrap_or_default()
}

/// The surfaces of a mesh by their facets.
struct Named<'a>(Vec<(&'a String, HashSet<Key>)>);

impl<'a> Named<'a> {
    fn of(mesh: &'a Mesh) -> Self {
        Self(mesh.surfaces.iter().map(|(name, surface)| (name, keys(&surface.facets))).collect())
    }

    fn exactly(&self, wanted: &HashSet<Key>) -> Option<String> {
        self.0.iter().find(|(_, facets)| facets == wanted).map(|(name, _)| (*name).clone())
    }
}

fn keys(facets: &[Facet]) -> HashSet<Key> {
    facets.iter().map(|facet| facet.nodes.sorted()).collect()
}

/// Smooth parts of facets.
fn parts(mesh: &Mesh, facets: &[Facet], degrees: &[f64]) -> Vec<Vec<Facet>> {
    let (mut rest, mut parts) = (facets.to_vec(), Vec::new());
    let degrees = degrees.first().copied().unwrap_or(30.0);
    while let Some(first) = rest.first() {
        let part = smooth_face(mesh, rest.clone(), centre(mesh, &[*first]), degrees);
        let taken = keys(&part);
        rest.retain(|facet| !taken.contains(&facet.nodes.sorted()));
        // a facet that touches another one may be nearer to its own centre
        if part.is_empty() || parts.len() > MOST_PARTS {
            parts.push(rest);
            break;
        }
        parts.push(part);
    }
    parts
}

/// The first table that selects exactly these facets of a body.
fn single(mesh: &Mesh, body: usize, facets: &[Facet], name: &str, degrees: &[f64]) -> Option<SurfaceSet> {
    let boundary = mesh.boundary(body);
    let wanted = keys(facets);
    let exact = |table: &SurfaceSet| {
        let found = facets_that_meet(mesh, Surface { facets: boundary.facets.clone() }, table);
        found.facets.len() == wanted.len() && keys(&found.facets) == wanted
    };
    let empty =
        SurfaceSet { name: name.to_owned(), body: Some(mesh.bodies[body].name.clone()), ..SurfaceSet::default() };
    candidates(mesh, facets, &empty, degrees).into_iter().find(exact)
}

fn candidates(mesh: &Mesh, facets: &[Facet], empty: &SurfaceSet, degrees: &[f64]) -> Vec<SurfaceSet> {
    let area = |facet: &Facet| Vector3::from(facet_area_vector(&mesh.facet_coordinates(facet)));
    let total: Vector3<f64> = facets.iter().map(area).sum();
    let widest = facets.iter().map(|facet| angle(area(facet).into(), total.into())).fold(0.0, f64::max);
    let places = decimals(size(mesh, facets));
    let quantum = 10f64.powi(-places);
    let boxes = vec![around(mesh, facets, places)];
    let mut all = Vec::new();
    let cone = |degrees: f64| NormalCone { direction: direction(total), degrees };
    let in_box = |of: &SurfaceSet| SurfaceSet { boxes: boxes.clone(), ..of.clone() };
    if widest < FLAT {
        all.push(in_box(&SurfaceSet { normal: Some(cone(1.0)), ..empty.clone() }));
    }
    let shape = shape(mesh, facets, empty, quantum);
    all.extend(shape.clone());
    for &degrees in degrees.iter().chain(&[30.0, 20.0, 10.0]) {
        let to = centre(mesh, &[nearest(mesh, facets)]).map(|c| rounded(c, places));
        all.push(SurfaceSet { connected: Some(Connected { to, degrees }), ..empty.clone() });
    }
    all.extend(shape.map(|shape| in_box(&shape)));
    let connected: Vec<_> = all.iter().filter(|table| table.connected.is_some()).map(in_box).collect();
    all.extend(connected);
    if widest < 90.0 {
        all.push(in_box(&SurfaceSet { normal: Some(cone((widest + 0.1).ceil())), ..empty.clone() }));
    }
    all.push(in_box(empty));
    all
}

/// A cylinder or sphere on which all nodes lie.
fn shape(mesh: &Mesh, facets: &[Facet], empty: &SurfaceSet, quantum: f64) -> Option<SurfaceSet> {
    let corners: Vec<FacetNodes> = facets.iter().map(|facet| facet.nodes).collect();
    let patches = smooth_surface(&corners, &mesh.nodes, &mesh.nodes, SMOOTH, &[], |_| [false; 3]).patches;
    let [patch] = &patches[..] else { return None };
    let shape = patch.shape.filter(|_| patch.facets.len() == facets.len())?;
    let nodes = Surface { facets: facets.to_vec() }.nodes();
    let points: Vec<Vector3<f64>> = nodes.iter().map(|&node| Vector3::from(mesh.nodes[node as usize])).collect();
    let size = size(mesh, facets);
    let places = decimals(size) + 2;
    // a tolerance of one digit that covers the rounding of the numbers and the distance of the nodes
    let tolerance = |residual: f64| {
        let least = (2.0 * residual).max(10.0 * quantum);
        let power = 10f64.powi(least.log10().floor() as i32);
        rounded((least / power).ceil() * power, (-power.log10().round()) as i32)
    };
    match shape {
        Shape::Sphere { centre, radius } => {
            let sphere = Sphere {
                centre: std::array::from_fn(|c| rounded(centre[c], places)),
                radius: rounded(radius, places),
                tolerance: Some(tolerance(shape.residual(&points))),
            };
            Some(SurfaceSet { sphere: Some(sphere), ..empty.clone() })
        }
        Shape::Cone { point, axis, radius, slope } if slope.abs() < 1e-6 => {
            let along = points.iter().map(|x| (x - point).dot(&axis));
            let [low, high] = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], s| [a.min(s), b.max(s)]);
            let end = |s: f64| std::array::from_fn(|c| rounded((point + s * axis)[c], places));
            let cylinder = Cylinder {
                start: end(low),
                end: end(high),
                radius: rounded(radius, places),
                tolerance: Some(tolerance(shape.residual(&points))),
            };
            Some(SurfaceSet { cylinder: Some(cylinder), ..empty.clone() })
        }
        _ => None,
    }
}

/// Mean of the corners.
fn centre(mesh: &Mesh, facets: &[Facet]) -> [f64; 3] {
    let corners: Vec<u32> = facets.iter().flat_map(|facet| facet.nodes.to_vec()).collect();
    let sum: Vector3<f64> = corners.iter().map(|&node| Vector3::from(mesh.nodes[node as usize])).sum();
    (sum / corners.len().max(1) as f64).into()
}

/// The facet nearest to the middle of all.
fn nearest(mesh: &Mesh, facets: &[Facet]) -> Facet {
    let middle = Vector3::from(centre(mesh, facets));
    let distance = |facet: &Facet| (Vector3::from(centre(mesh, &[*facet])) - middle).norm();
    let least = facets.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    least.copied().unwrap_or(facets[0])
}

fn bounds(mesh: &Mesh, facets: &[Facet]) -> [[f64; 3]; 2] {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for node in facets.iter().flat_map(|facet| facet.nodes.to_vec()) {
        for (c, &x) in mesh.nodes[node as usize].iter().enumerate() {
            bounds[0][c] = bounds[0][c].min(x);
            bounds[1][c] = bounds[1][c].max(x);
        }
    }
    bounds
}

/// The diagonal of the box around facets. \[L\]
fn size(mesh: &Mesh, facets: &[Facet]) -> f64 {
    let [min, max] = bounds(mesh, facets).map(Vector3::from);
    (max - min).norm().max(f64::MIN_POSITIVE)
}

/// Decimal places of a hundred-thousandth of a length, or finer.
fn decimals(size: f64) -> i32 {
    5 - size.log10().floor().clamp(-200.0, 200.0) as i32
}

fn rounded(value: f64, places: i32) -> f64 {
    let text = format!("{value:.*}", places.max(0) as usize);
    // no minus sign before zero
    text.parse::<f64>().unwrap_or(value) + 0.0
}

/// The box around facets, a little wider.
fn around(mesh: &Mesh, facets: &[Facet], places: i32) -> BoxRegion {
    let [min, max] = bounds(mesh, facets);
    let margin = 10f64.powi(-places);
    BoxRegion { min: min.map(|x| rounded(x - margin, places)), max: max.map(|x| rounded(x + margin, places)) }
}

fn direction(of: Vector3<f64>) -> [f64; 3] {
    of.try_normalize(0.0).unwrap_or(Vector3::x()).map(|c| rounded(c, 6)).into()
}

impl SurfaceSet {
    /// The table as text of a case file.
    pub fn toml(&self) -> String {
        let list = |x: &[f64; 3]| format!("[{}, {}, {}]", x[0], x[1], x[2]);
        let quoted = |name: &String| toml_edit::Value::from(name).to_string();
        let within = |tolerance: Option<f64>| tolerance.map_or(String::new(), |t| format!(", tolerance = {t}"));
        let mut text = format!("[[surface]]\nname = {}\n", quoted(&self.name));
        let mut line = |key: &str, value: String| {
            let _ = writeln!(text, "{key} = {value}");
        };
        if let Some(body) = &self.body {
            line("body", quoted(body));
        }
        if !self.of.is_empty() {
            line("of", format!("[{}]", self.of.iter().map(quoted).collect::<Vec<_>>().join(", ")));
        }
        if let Some(name) = &self.within {
            line("within", quoted(name));
        }
        let region = |of: &BoxRegion| format!("{{ min = {}, max = {} }}", list(&of.min), list(&of.max));
        if !self.boxes.is_empty() {
            line("boxes", format!("[{}]", self.boxes.iter().map(region).collect::<Vec<_>>().join(", ")));
        }
        if let Some(NormalCone { direction, degrees }) = &self.normal {
            line("normal", format!("{{ direction = {}, degrees = {degrees} }}", list(direction)));
        }
        if let Some(Cylinder { start, end, radius, tolerance }) = &self.cylinder {
            let (start, end, more) = (list(start), list(end), within(*tolerance));
            line("cylinder", format!("{{ start = {start}, end = {end}, radius = {radius}{more} }}"));
        }
        if let Some(Sphere { centre, radius, tolerance }) = &self.sphere {
            let more = within(*tolerance);
            line("sphere", format!("{{ centre = {}, radius = {radius}{more} }}", list(centre)));
        }
        if let Some(Connected { to, degrees }) = &self.connected {
            line("connected", format!("{{ to = {}, degrees = {degrees} }}", list(to)));
        }
        text
    }
}
