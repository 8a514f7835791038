//! The case of a part: what it keeps of the design's case, and what changes with the new meshes.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use slipstick_case::file::{
    Adjust, Case, LoadKind, MeshFile, NodeSet, Placement, QuantityKind, Region, Shape, SpringEnd, SpringStiffness,
    SurfaceSet,
};
use slipstick_case::quantity::PressureWord;
use slipstick_contact::kinematics::MultiplierShape;
use slipstick_mesh::{Mesh, facet_area_vector};

use super::patches::NamedFaces;
use super::per_node::{self, PerNode};
use super::{Acts, NamedFace, PartBody, PartError, Reduced, Scarce, on_body};
use crate::vector::{dot, norm};

/// A case without a design, and its files and sets.
pub(super) struct Carried {
    pub case: Case,
    /// Names of mesh files in the design's case and in the part's.
    pub copies: Vec<(String, String)>,
    /// Node sets that are selected again by position.
    pub reselected: Vec<String>,
    /// Surfaces and sets that are left out: nothing uses them, and they may be empty.
    pub unused: Vec<String>,
    pub scarce: Vec<Scarce>,
    /// Faces of which a part is missing that matters.
    pub reduced: Vec<Reduced>,
    /// Forces and springs that the design's case gives for each node.
    pub per_node: Vec<PerNode>,
}

/// Share below which hardly anything of a face is left.
const SCARCE: f64 = 0.01;

/// Shares below which what acts per area on a face, and contact on it, differ from the design.
const PER_AREA: f64 = 0.98;
const IN_CONTACT: f64 = 0.9;

/// Gives each surface and set of a body its name in the mesh file: `{body}_{name}`, or the name
/// itself if it already starts with `{body}_`. A name that a table of the case defines is not used again;
/// a union of surfaces needs none, since its parts have theirs.
pub(super) fn name_groups(case: &Case, body: &str, faces: &mut [NamedFace]) {
    let prefix = format!("{body}_");
    let unions = case.surfaces.iter().filter(|surface| !surface.of.is_empty());
    let unions: BTreeSet<&String> = unions.map(|surface| &surface.name).collect();
    let defined = case.surfaces.iter().map(|surface| &surface.name).chain(case.sets.iter().map(|set| &set.name));
    let mut taken: BTreeSet<String> = defined.cloned().collect();
    let stays = |face: &&mut NamedFace| face.name.starts_with(&prefix) && !taken.contains(&face.name);
    let (kept, named): (Vec<_>, Vec<_>) = faces.iter_mut().filter(|face| !unions.contains(&face.name)).partition(stays);
    for face in kept {
        taken.insert(face.name.clone());
        face.group = Some(face.name.clone());
    }
    for face in named {
        let mut group = format!("{prefix}{}", face.name.strip_prefix(&prefix).unwrap_or(&face.name));
        while !taken.insert(group.clone()) {
            group += "_faces";
        }
        face.group = Some(group);
    }
}

/// The case of the part; `solid` says which elements of the design have material.
pub(super) fn carried(
    case: &Case,
    mesh: &Mesh,
    faces: &NamedFaces,
    bodies: &[PartBody],
    solid: &dyn Fn(usize) -> bool,
) -> Result<Carried, PartError> {
    let mut part = case.clone();
    if !part.title.is_empty() {
        part.title += ": the part";
    }
    part.design = None;
    part.optimizer = None;
    part.constraints.clear();
    part.output.directory = None;
    for body in part.bodies.iter_mut().filter(|body| bodies.iter().any(|designed| designed.name == body.name)) {
        // a region without material has no elements in the mesh of the part, which would be an error
        let elements = mesh.body(&body.name).map_or(0..0, |body| body.elements.clone());
        let inside = |region: &Region, e: usize| region.contains(mesh.centroid(e)) != Some(false);
        body.sections.retain(|section| elements.clone().any(|e| solid(e) && inside(&section.region, e)));
        let of_file = body.sections.iter().find_map(|section| match &section.region {
            Region::Part { part } => Some(part.clone()),
            _ => None,
        });
        if let Some(part) = of_file {
            return Err(PartError::SectionOfFile { body: body.name.clone(), part });
        }
    }
    let copies = shapes(&mut part, bodies);
    let find =
        |name: &str| bodies.iter().find_map(|body| Some((body, body.faces.iter().find(|face| face.name == name)?)));
    let left = |name: &str| find(name).filter(|(_, face)| !face.patches.is_empty());
    let designed = |name: &str| {
        let named = |body: &PartBody| mesh.bodies.iter().position(|other| other.name == body.name);
        bodies.iter().filter_map(named).any(|body| on_body(mesh, name, body))
    };
    // a surface or set without material is removed, which is an error if the case needs it
    let mut gone: BTreeSet<String> = mesh.names().into_iter().map(str::to_owned).collect();
    gone.retain(|name| designed(name) && left(name).is_none());
    for surface in part.surfaces.iter_mut().filter(|surface| surface.of.is_empty()) {
        if let Some((body, face)) = left(&surface.name) {
            let (name, body, within) = (surface.name.clone(), body.name.clone(), face.group.clone());
            *surface = SurfaceSet { name, body: Some(body), within, ..SurfaceSet::default() };
        }
    }
    for pair in part.contacts.iter_mut().filter(|pair| !pair.tied && left(&pair.slave).is_some()) {
        // divided triangles have nodes with very different areas: where few of them touch, pressures scatter with
        // standard shapes; few facets have a shape of their own by default
        if !of_few_facets(mesh, &pair.slave, pair.feature_angle) {
            pair.multiplier_shape.get_or_insert(MultiplierShape::Dual);
        }
    }
    let whole = |name: &str| faces.whole.contains_key(name);
    for set in part.sets.iter_mut().filter(|set| whole(&set.name)) {
        if let Some((_, face)) = left(&set.name) {
            let (name, within) = (set.name.clone(), face.group.clone());
            *set = NodeSet { name, within, ..NodeSet::default() };
        }
    }
    let by_position: BTreeSet<String> =
        mesh.node_sets.keys().filter(|name| designed(name) && !whole(name)).cloned().collect();
    let unused = without_unused(&mut part, |name| gone.contains(name) || by_position.contains(name));
    // a set without nodes of solid elements would select none, or the nearest of another place
    let solid_nodes: BTreeSet<u32> =
        (0..mesh.elements.len()).filter(|&e| solid(e)).flat_map(|e| mesh.elements[e].nodes().to_vec()).collect();
    let filled = |name: &str| mesh.set_nodes(name).is_some_and(|nodes| nodes.iter().any(|n| solid_nodes.contains(n)));
    let mut reselected = Vec::new();
    for set in part.sets.iter().filter(|set| by_position.contains(&set.name) && filled(&set.name)) {
        reselected.push(set.name.clone());
        gone.remove(&set.name);
    }
    part.surfaces.retain(|surface| !gone.contains(&surface.name));
    part.sets.retain(|set| !gone.contains(&set.name));
    let mut scarce: Vec<Scarce> = Vec::new();
    for (name, used) in uses(&part) {
        let of_case = case.sets.iter().any(|set| set.name == name);
        let of_file = mesh.node_sets.contains_key(&name) && !of_case && designed(&name);
        if of_file && !faces.whole.contains_key(&name) {
            return Err(PartError::NotFaces { name });
        }
        if gone.contains(&name) && bodies.iter().any(|body| body.left_out.contains(&name)) {
            return Err(PartError::Loose { name, used });
        }
        if gone.contains(&name) {
            return Err(PartError::NoMaterial { name, used });
        }
        let face = bodies.iter().flat_map(|body| &body.faces).find(|face| face.name == name);
        if let Some(share) = face.map(|face| face.share).filter(|&share| share < SCARCE)
            && scarce.iter().all(|known| known.name != name)
        {
            scarce.push(Scarce { name, used, share });
        }
    }
    let nearest: BTreeSet<String> =
        part.sets.iter().filter(|set| set.nearest.is_some()).map(|set| set.name.clone()).collect();
    let per_node = per_node::summed(&mut part, mesh, bodies, |name| nearest.contains(name))?;
    let reduced = reduced(&part, bodies);
    Ok(Carried { case: part, copies, reselected, unused, scarce, reduced, per_node })
}

/// Angle between neighbouring facets of a curved slave from which the default shape is another one, once division has
/// halved it. \[degrees\]
const FEW_FACETS: f64 = 30.0;

/// Whether some neighbouring facets of a surface meet at such an angle, and not at a sharp edge.
fn of_few_facets(mesh: &Mesh, surface: &str, sharp: f64) -> bool {
    let mut normals: BTreeMap<[u32; 2], [f64; 3]> = BTreeMap::new();
    for facet in mesh.surfaces.get(surface).iter().flat_map(|surface| &surface.facets) {
        let normal = facet_area_vector(&mesh.facet_coordinates(facet));
        let nodes: Vec<u32> = facet.nodes.iter().copied().collect();
        for (k, &a) in nodes.iter().enumerate() {
            let b = nodes[(k + 1) % nodes.len()];
            if let Some(other) = normals.insert([a.min(b), a.max(b)], normal) {
                let angle = (dot(normal, other) / (norm(normal) * norm(other))).clamp(-1.0, 1.0).acos().to_degrees();
                if angle >= FEW_FACETS && angle <= sharp {
                    return true;
                }
            }
        }
    }
    false
}

/// The faces that something acts on per area, or in contact, and of which a part is missing.
fn reduced(case: &Case, bodies: &[PartBody]) -> Vec<Reduced> {
    let mut faces: Vec<(&String, Acts)> = Vec::new();
    for load in &case.loads {
        match load.kind {
            LoadKind::Pressure(_) => faces.push((&load.surface, Acts::Pressure)),
            LoadKind::Traction(_) => faces.push((&load.surface, Acts::Traction)),
            _ => {}
        }
    }
    for spring in case.springs.iter().filter(|spring| matches!(spring.stiffness, SpringStiffness::StiffnessPerArea(_)))
    {
        faces.push((&spring.set, Acts::Spring));
    }
    for pair in &case.contacts {
        let acts = if pair.tied { Acts::Tie } else { Acts::Contact };
        faces.extend([(&pair.slave, acts), (&pair.master, acts)]);
    }
    for quantity in &case.quantities {
        let of = match &quantity.kind {
            QuantityKind::ContactPressure(of) if of.measure != PressureWord::Peak => Some((&of.slave, &of.within)),
            QuantityKind::Gap(of) => Some((&of.slave, &of.within)),
            QuantityKind::ContactShare(of) => Some((&of.slave, &of.within)),
            _ => None,
        };
        faces.extend(of.map(|(slave, within)| (within.as_ref().unwrap_or(slave), Acts::Measured)));
    }
    let share = |name: &String| -> Option<f64> {
        Some(bodies.iter().flat_map(|body| &body.faces).find(|face| face.name == *name)?.share)
    };
    let mut found: Vec<Reduced> = Vec::new();
    for (name, acts) in faces {
        let limit = if matches!(acts, Acts::Contact | Acts::Tie) { IN_CONTACT } else { PER_AREA };
        let Some(share) = share(name).filter(|&share| share >= SCARCE && share < limit) else { continue };
        if found.iter().all(|known| known.name != *name || known.acts != acts) {
            found.push(Reduced { name: name.clone(), acts, share });
        }
    }
    found
}

/// Removes the surfaces and sets that nothing uses and that may be empty on the part, themselves or
/// because of one that they refer to; returns their names.
fn without_unused(part: &mut Case, uncertain: impl Fn(&str) -> bool) -> Vec<String> {
    let mut unused: Vec<String> = Vec::new();
    loop {
        let used: BTreeSet<String> = uses(part).into_iter().map(|(name, _)| name).collect();
        let surface = part.surfaces.iter().position(|surface| {
            let mut parts = surface.within.iter().chain(&surface.of).chain([&surface.name]);
            !used.contains(&surface.name) && parts.any(|name| uncertain(name))
        });
        let set = part.sets.iter().position(|set| {
            !used.contains(&set.name) && set.within.iter().chain([&set.name]).any(|name| uncertain(name))
        });
        match (surface, set) {
            (Some(surface), _) => unused.push(part.surfaces.remove(surface).name),
            (None, Some(set)) => unused.push(part.sets.remove(set).name),
            (None, None) => return unused,
        }
    }
}

/// Replaces the shapes of the designed bodies and the names of the other bodies' mesh files;
/// returns the latter.
fn shapes(part: &mut Case, bodies: &[PartBody]) -> Vec<(String, String)> {
    let mut taken: BTreeSet<String> = bodies.iter().flat_map(|body| [body.mesh_file(), body.surface_file()]).collect();
    let mut copies: Vec<(String, String)> = Vec::new();
    for body in &mut part.bodies {
        if let Some(designed) = bodies.iter().find(|designed| designed.name == body.name) {
            body.place = Placement::default();
            body.shape = Shape::Mesh(MeshFile {
                file: designed.mesh_file(),
                part: Some(body.name.clone()),
                scale: 1.0,
                first_order: false,
                sha256: String::new(),
                mesh: Arc::default(),
                numbers: Arc::default(),
                unusable: Default::default(),
            });
            continue;
        }
        let Shape::Mesh(file) = &mut body.shape else { continue };
        if let Some((_, copy)) = copies.iter().find(|(name, _)| *name == file.file) {
            file.file.clone_from(copy);
            continue;
        }
        let name = std::path::Path::new(&file.file).file_name().map(|name| name.to_string_lossy().into_owned());
        let mut copy = name.unwrap_or_else(|| file.file.clone());
        while !taken.insert(copy.clone()) {
            copy.insert(0, '_');
        }
        copies.push((file.file.clone(), copy.clone()));
        file.file = copy;
    }
    copies
}

/// All surfaces and sets that a case needs, each with the table that names it.
fn uses(case: &Case) -> Vec<(String, String)> {
    let mut uses = Vec::new();
    let mut need = |name: &str, table: String| uses.push((name.to_owned(), table));
    for contact in &case.contacts {
        need(&contact.slave, "a contact pair".into());
        need(&contact.master, "a contact pair".into());
        if let Some(nodes) = contact.adjust.as_ref().and_then(Adjust::nodes) {
            need(nodes, "`adjust` of a contact pair".into());
        }
    }
    for support in &case.dirichlet {
        need(&support.set, "a support or motion".into());
    }
    for load in case.loads.iter().filter(|load| !load.acts_on_mass()) {
        need(&load.surface, "a load".into());
    }
    for temperature in &case.temperatures {
        temperature.set.iter().for_each(|set| need(set, "a change of temperature".into()));
    }
    for spring in &case.springs {
        need(&spring.set, format!("the spring `{}`", spring.name));
        if let Some(SpringEnd::Set(to)) = &spring.to {
            need(to, format!("the spring `{}`", spring.name));
        }
    }
    for term in case.equations.iter().flat_map(|equation| &equation.terms) {
        need(&term.set, "an equation".into());
    }
    for coupling in &case.couplings {
        need(&coupling.set, format!("the coupling `{}`", coupling.name));
    }
    for surface in &case.surfaces {
        let parts = surface.within.iter().chain(&surface.of);
        parts.for_each(|part| need(part, format!("the surface `{}`", surface.name)));
    }
    for set in &case.sets {
        set.within.iter().for_each(|within| need(within, format!("the set `{}`", set.name)));
    }
    for quantity in &case.quantities {
        quantity.kind.sets().into_iter().for_each(|name| need(name, format!("the quantity `{}`", quantity.name)));
    }
    uses
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, HollowCylinderShape, box_mesh, hollow_cylinder};

    /// Facets of a cylinder with n divisions meet at 360°/n; those of a cube only at its edges, which are sharp.
    #[test]
    fn facets_that_stay_few_when_they_are_divided() {
        for (divisions, few) in [(8, true), (11, true), (13, false), (24, false)] {
            let shape =
                HollowCylinderShape { height: 1.0, inner_radius: 1.0, outer_radius: 2.0, elements: [1, divisions, 2] };
            let mesh = hollow_cylinder("ring", &shape).expect("a ring");
            assert_eq!(of_few_facets(&mesh, "ring_outer", 60.0), few, "{divisions}");
            assert!(!of_few_facets(&mesh, "ring_outer", 20.0), "edges between facets are sharp");
        }
        let shape = BoxShape { min: [0.0; 3], max: [1.0; 3], elements: [2; 3], grading: [1.0; 3] };
        assert!(!of_few_facets(&box_mesh("cube", &shape).expect("a cube"), "cube_ymax", 60.0));
    }
}
