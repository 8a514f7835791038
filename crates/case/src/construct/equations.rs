//! From the equations of a case to those among displacement unknowns.

use super::BuildError;
use super::select::deformable_nodes;
use crate::file::{self, Case, EquationTerm, SpringDirection, SpringEnd, TermComponent};
use slipstick_mesh::Mesh;
use slipstick_model::model::LoadTime;
use slipstick_model::model::linear::{LinearEquation, LinearEquations};
use slipstick_model::model::prescribed::Prescribed;
use slipstick_solid::load::nodal_areas;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Unknowns that nothing but an equation determines may couple so many pairs of nodes; more cost too much
/// memory.
const MOST_COUPLINGS: usize = 4_000_000;

/// How far a node may be from its counterpart, relative to the extent of the set.
const APART: f64 = 1e-4;

/// The supports with all equations of the case. Components of points that nothing has are held.
pub(super) fn with_equations(
    prescribed: Prescribed,
    case: &Case,
    mesh: &Mesh,
    times: &[LoadTime],
) -> Result<Prescribed, BuildError> {
    let centres = super::centres::dependent(case, mesh)?;
    let given = case.equations.len() + case.points.len() + case.couplings.len() + case.bolts.len();
    if given == 0 && centres.is_empty() {
        return Ok(prescribed);
    }
    let none = case.equations.is_empty() && case.couplings.is_empty() && case.bolts.is_empty();
    for (number, load_case) in case.load_cases.iter().enumerate().filter(|_| !none) {
        if load_case.bodies.iter().any(|body| body.offset.is_some() || body.rotation.is_some()) {
            let message =
                "equations hold among displacements from the mesh, and this load case moves bodies at its start";
            let help = "move the bodies by a motion instead";
            return Err(BuildError::new(format!("load_case[{number}].bodies"), message, help));
        }
    }
    let mut equations: Vec<LinearEquation> = super::centres::equations(&centres).collect();
    for (number, equation) in case.equations.iter().enumerate() {
        let terms = of(equation, mesh, &format!("equation[{number}]"))?;
        equations.extend(terms.into_iter().map(|terms| LinearEquation { terms, number }));
    }
    super::couplings::add_equations(case, mesh, case.equations.len(), &mut equations)?;
    super::bolts::add_equations(mesh, case.equations.len() + case.couplings.len(), &mut equations);
    let points = points(case, mesh);
    let first = mesh.couplings.first().map_or(points.start, |coupling| coupling.reference as usize);
    // nodes of no element
    let of_point = |i: u32| i as usize / 3 >= first;
    let sprung = sprung(case, mesh);
    let used: BTreeSet<u32> = equations.iter().flat_map(|equation| equation.terms.iter().map(|(i, _)| *i)).collect();
    let idle =
        (3 * points.start as u32..3 * points.end as u32).filter(|i| !used.contains(i) && !sprung.contains(i)).collect();
    let prescribed = prescribed.with_idle(idle);
    let values = |time: LoadTime| {
        let mut d = vec![0.0; prescribed.fixed().len()];
        prescribed.apply(time, &mut d);
        d
    };
    let cheap = |i: u32| of_point(i) && (0..3).all(|c| !sprung.contains(&(i - i % 3 + c)));
    let linear = LinearEquations::new(&equations, prescribed.fixed(), values, times, cheap).map_err(|e| {
        let message = format!(
            "prescribed motions determine all displacements in it, and violate it by {:.1e} of its terms at pseudo-time {}",
            e.violation, e.time
        );
        if e.number == super::centres::NUMBER {
            let message = format!(
                "prescribed motions determine all other nodes of a face or hexahedron, and move its centre \
                 elsewhere, by {:.1e} of its terms at pseudo-time {}",
                e.violation, e.time
            );
            let help = "omit the centre from the sets that move, or use `shape_functions = \"lagrange\"`";
            return BuildError::new("body", message, help);
        }
        let help = "leave a component free, or change the motions so that they fulfil the equation";
        BuildError::new(place(case, e.number), message, help)
    })?;
    super::bolts::check_free(mesh, &prescribed, &linear)?;
    check_temporary(&prescribed, &linear)?;
    // what a centre depends on is in its own element
    let centre: BTreeSet<u32> = centres.iter().map(|centre| centre.node).collect();
    let couples = |i: u32| !cheap(i) && !centre.contains(&(i / 3));
    let cost: usize = linear.rows().iter().filter(|(i, _)| couples(*i)).map(|(_, terms)| terms.len().pow(2)).sum();
    if cost > MOST_COUPLINGS {
        let longest = linear.rows().iter().map(|(_, terms)| terms.len()).max().unwrap_or(0);
        let message =
            format!("an equation with {longest} free displacements couples all of their nodes with each other");
        let help = "prescribe or equate the mean of a smaller surface, or leave the point of the mean free";
        return Err(BuildError::new("equation", message, help));
    }
    Ok(prescribed.with_equations(linear))
}

/// A support that begins or ends holds a dependent displacement only through all others of its equation, as those of
/// an element with 20 nodes hold its centre.
fn check_temporary(prescribed: &Prescribed, linear: &LinearEquations) -> Result<(), BuildError> {
    let motions: BTreeMap<u32, u32> =
        prescribed.temporary().iter().map(|support| (support.unknown, support.motion)).collect();
    for (dependent, terms) in linear.rows() {
        let Some(motion) = motions.get(dependent) else { continue };
        if !terms.iter().all(|(i, _)| motions.get(i) == Some(motion) || prescribed.fixed()[*i as usize]) {
            let message = format!(
                "an equation determines a displacement of node {}, so a support that begins or ends cannot hold it",
                dependent / 3
            );
            let help = "leave the node out of the set, or hold all other nodes of the equation too";
            return Err(BuildError::new(format!("dirichlet[{motion}].set"), message, help));
        }
    }
    Ok(())
}

/// The equations of an `[[equation]]`: the unknowns of each with their factors.
pub type EquationsOfTable = Vec<Vec<(u32, f64)>>;

/// The equations between displacement unknowns 3 n + c of each `[[equation]]` of a case: unknowns with
/// their factors; `mesh` is that of the case.
///
/// # Errors
/// [`BuildError`] at an equation whose sets do not exist or do not fit.
pub fn equations_of(case: &Case, mesh: &Mesh) -> Result<Vec<EquationsOfTable>, BuildError> {
    let of = |(i, equation)| of(equation, mesh, &format!("equation[{i}]"));
    case.equations.iter().enumerate().map(of).collect()
}

/// The displacement unknowns in whose directions springs act.
fn sprung(case: &Case, mesh: &Mesh) -> BTreeSet<u32> {
    let mut unknowns = BTreeSet::new();
    for spring in &case.springs {
        let acts = |c: usize| match spring.direction {
            Some(SpringDirection::Fixed(direction)) => direction[c] != 0.0,
            Some(SpringDirection::Word(_)) | None => true,
        };
        let to = match &spring.to {
            Some(SpringEnd::Set(to)) => Some(to),
            Some(SpringEnd::Point(_)) | None => None,
        };
        for set in [&spring.set].into_iter().chain(to) {
            let nodes = mesh.set_nodes(set).unwrap_or_default();
            unknowns
                .extend(nodes.iter().flat_map(|node| (0..3).filter(|&c| acts(c)).map(move |c| 3 * node + c as u32)));
        }
    }
    unknowns
}

/// The table of an equation with this number.
fn place(case: &Case, number: usize) -> String {
    match number.checked_sub(case.equations.len()) {
        None => format!("equation[{number}]"),
        Some(at) => match at.checked_sub(case.couplings.len()) {
            None => format!("coupling[{at}]"),
            Some(bolt) => format!("bolt[{bolt}]"),
        },
    }
}

/// The nodes of the points of a case and of its bolts: the last ones of the mesh.
pub(super) fn points(case: &Case, mesh: &Mesh) -> Range<usize> {
    mesh.nodes.len() - case.points.len() - case.bolts.len()..mesh.nodes.len()
}

/// The terms of an equation's nodes and components.
fn of(equation: &file::Equation, mesh: &Mesh, path: &str) -> Result<Vec<Vec<(u32, f64)>>, BuildError> {
    let mut columns = Vec::with_capacity(equation.terms.len());
    for (k, term) in equation.terms.iter().enumerate() {
        columns.push(nodes_with_weights(term, mesh, &format!("{path}.terms[{k}].set"))?);
    }
    let each = |k: usize| !equation.terms[k].mean && columns[k].len() > 1;
    let leader = (0..columns.len()).find(|&k| each(k));
    let count = leader.map_or(1, |k| columns[k].len());
    let mut counterparts: Vec<Vec<u32>> = Vec::with_capacity(columns.len());
    for (k, column) in columns.iter().enumerate() {
        counterparts.push(match leader {
            Some(first) if each(k) => {
                let sets = [first, k].map(|k| equation.terms[k].set.as_str());
                opposite(mesh, [&columns[first], column], sets, &format!("{path}.terms[{k}].set"))?
            }
            _ => Vec::new(),
        });
    }
    let components: Vec<Option<usize>> = match equation.terms.iter().all(|term| term.component.is_none()) {
        true => (0..3).map(Some).collect(),
        false => vec![None],
    };
    let mut all = Vec::with_capacity(count * components.len());
    for at in 0..count {
        for component in &components {
            let mut terms = Vec::new();
            for (k, (term, column)) in equation.terms.iter().zip(&columns).enumerate() {
                let along = direction(term.component, *component);
                let own: Vec<(u32, f64)> = if each(k) { vec![(counterparts[k][at], 1.0)] } else { column.clone() };
                for (node, weight) in own {
                    let parts = (0..3).filter(|&c| along[c] != 0.0);
                    terms.extend(parts.map(|c| (3 * node + c as u32, term.factor * weight * along[c])));
                }
            }
            all.push(terms);
        }
    }
    Ok(all)
}

/// The direction of a term in the equation along an axis, or the only one.
fn direction(component: Option<TermComponent>, axis: Option<usize>) -> [f64; 3] {
    let unit = |axis: usize| std::array::from_fn(|c| f64::from(u8::from(c == axis)));
    match (component, axis) {
        (Some(TermComponent::Axis(axis)), _) => unit(axis.index()),
        (Some(TermComponent::Direction(v)), _) => {
            let length = v[0].hypot(v[1]).hypot(v[2]);
            v.map(|x| x / length)
        }
        (None, axis) => unit(axis.unwrap_or(0)),
    }
}

/// The nodes of a term; of a mean, with weights that add up to 1.
fn nodes_with_weights(term: &EquationTerm, mesh: &Mesh, path: &str) -> Result<Vec<(u32, f64)>, BuildError> {
    if let Some(rigid) = mesh.rigid.iter().find(|rigid| mesh.bodies[rigid.body].name == term.set) {
        return Ok(vec![(rigid.reference, 1.0)]);
    }
    let nodes = nodes_in_equations(mesh, &term.set, path)?;
    if !term.mean {
        return Ok(nodes.into_iter().map(|node| (node, 1.0)).collect());
    }
    let weights: Vec<(u32, f64)> = match mesh.surfaces.get(&term.set) {
        Some(surface) => nodal_areas(&mesh.faces_of_surface(surface), mesh.nodes.as_flattened()),
        None => nodes.into_iter().map(|node| (node, 1.0)).collect(),
    };
    let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
    let share = |(node, weight): (u32, f64)| (node, weight / sum);
    Ok(weights.into_iter().map(share).filter(|(_, weight)| weight.abs() > 1e-12).collect())
}

/// The nodes of a set that may appear in equations.
pub(super) fn nodes_in_equations(mesh: &Mesh, set: &str, path: &str) -> Result<Vec<u32>, BuildError> {
    let help = |body: &str| format!("name the body: set = \"{body}\" is its reference point");
    deformable_nodes(mesh, set, path, help)
}

/// For each node of the first set, the node of the second one at the same place relative to the centre of its
/// set.
fn opposite(
    mesh: &Mesh,
    [first, second]: [&[(u32, f64)]; 2],
    sets: [&str; 2],
    path: &str,
) -> Result<Vec<u32>, BuildError> {
    let fail = |message: String| {
        let help = "an equation pairs the nodes of two sets by their places relative to the centres of the sets: mesh \
                    both alike, or use `mean = true`";
        BuildError::new(path, message, help)
    };
    if first.len() != second.len() {
        let [a, b] = [first.len(), second.len()];
        return Err(fail(format!("`{}` has {a} nodes, and `{}` has {b}", sets[0], sets[1])));
    }
    let at = |node: u32| mesh.nodes[node as usize];
    let centre = |nodes: &[(u32, f64)]| -> [f64; 3] {
        std::array::from_fn(|c| nodes.iter().map(|(node, _)| at(*node)[c]).sum::<f64>() / nodes.len() as f64)
    };
    let (a, b) = (centre(first), centre(second));
    let relative = |node: u32, centre: [f64; 3]| -> [f64; 3] { std::array::from_fn(|c| at(node)[c] - centre[c]) };
    let size = |x: [f64; 3]| x[0].hypot(x[1]).hypot(x[2]);
    let extent = first.iter().map(|(node, _)| size(relative(*node, a))).fold(0.0, f64::max);
    let mut taken = BTreeSet::new();
    let mut found = Vec::with_capacity(first.len());
    for &(node, _) in first {
        let place = relative(node, a);
        let distance = |other: u32| {
            let other = relative(other, b);
            size(std::array::from_fn(|c| other[c] - place[c]))
        };
        let nearest = second.iter().map(|(other, _)| *other).min_by(|&p, &q| distance(p).total_cmp(&distance(q)));
        match nearest.filter(|&other| distance(other) <= APART * extent && taken.insert(other)) {
            Some(other) => found.push(other),
            None => {
                let x = at(node);
                return Err(fail(format!(
                    "no node of `{}` is opposite to the node of `{}` at {x:?}",
                    sets[1], sets[0]
                )));
            }
        }
    }
    Ok(found)
}
