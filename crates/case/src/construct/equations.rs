//! From the equations of a case to those among displacement unknowns.

use super::BuildError;
use super::select::nodes_of;
use crate::file::{self, Case, EquationTerm, TermComponent};
use slipstick_mesh::Mesh;
use slipstick_model::model::linear::{LinearEquation, LinearEquations};
use slipstick_model::model::prescribed::Prescribed;
use slipstick_solid::load::nodal_areas;
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
    times: &[f64],
) -> Result<Prescribed, BuildError> {
    if case.equations.is_empty() && case.points.is_empty() {
        return Ok(prescribed);
    }
    for (number, load_case) in case.load_cases.iter().enumerate().filter(|_| !case.equations.is_empty()) {
        if load_case.bodies.iter().any(|body| body.offset.is_some() || body.rotation.is_some()) {
            let message =
                "equations hold among displacements from the mesh, and this load case moves bodies at its start";
            let help = "move the bodies by a motion instead";
            return Err(BuildError::new(format!("load_case[{number}].bodies"), message, help));
        }
    }
    let mut equations = Vec::new();
    for (number, equation) in case.equations.iter().enumerate() {
        let terms = of(equation, mesh, &format!("equation[{number}]"))?;
        equations.extend(terms.into_iter().map(|terms| LinearEquation { terms, number }));
    }
    let points = points(case, mesh);
    let of_point = |i: u32| points.contains(&(i as usize / 3));
    let sprung: Vec<u32> = case
        .springs
        .iter()
        .flat_map(|spring| {
            [
                Some(&spring.set),
                match &spring.to {
                    Some(file::SpringEnd::Set(to)) => Some(to),
                    _ => None,
                },
            ]
        })
        .flatten()
        .filter_map(|set| mesh.set_nodes(set))
        .flat_map(|nodes| nodes.to_vec())
        .collect();
    let used: std::collections::BTreeSet<u32> =
        equations.iter().flat_map(|equation| equation.terms.iter().map(|(i, _)| *i)).collect();
    let idle = (3 * points.start as u32..3 * points.end as u32)
        .filter(|i| !used.contains(i) && !sprung.contains(&(i / 3)))
        .collect();
    let prescribed = prescribed.with_idle(idle);
    let values = |time: f64| {
        let mut d = vec![0.0; prescribed.fixed().len()];
        prescribed.apply(time, &mut d);
        d
    };
    let cheap = |i: u32| of_point(i) && !sprung.contains(&(i / 3));
    let linear = LinearEquations::new(&equations, prescribed.fixed(), values, times, cheap).map_err(|e| {
        let message = format!(
            "prescribed motions determine all displacements in it, and violate it by {:.1e} of its terms at pseudo-time {}",
            e.violation, e.time
        );
        let help = "leave a component free, or change the motions so that they fulfil the equation";
        BuildError::new(format!("equation[{}]", e.number), message, help)
    })?;
    let cost: usize = linear.rows().iter().filter(|(i, _)| !of_point(*i)).map(|(_, terms)| terms.len().pow(2)).sum();
    if cost > MOST_COUPLINGS {
        let longest = linear.rows().iter().map(|(_, terms)| terms.len()).max().unwrap_or(0);
        let message =
            format!("an equation with {longest} free displacements couples all of their nodes with each other");
        let help = "prescribe or equate the mean of a smaller surface, or leave the point of the mean free";
        return Err(BuildError::new("equation", message, help));
    }
    Ok(prescribed.with_equations(linear))
}

/// The nodes of the points of a case: the last ones of the mesh.
pub(super) fn points(case: &Case, mesh: &Mesh) -> Range<usize> {
    mesh.nodes.len() - case.points.len()..mesh.nodes.len()
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
    let nodes = deformable_nodes(mesh, &term.set, path)?;
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

/// The nodes of a set, none of which belongs to a rigid body.
pub(super) fn deformable_nodes(mesh: &Mesh, set: &str, path: &str) -> Result<Vec<u32>, BuildError> {
    let nodes = nodes_of(mesh, set, path)?;
    let of_rigid = |rigid: &&slipstick_mesh::Rigid| {
        nodes.iter().any(|&node| mesh.bodies[rigid.body].nodes.contains(&(node as usize)))
    };
    if let Some(rigid) = mesh.rigid.iter().find(of_rigid) {
        let body = &mesh.bodies[rigid.body].name;
        let message = format!("`{set}` has nodes of the rigid body `{body}`, which moves as a whole");
        return Err(BuildError::new(path, message, format!("name the body: set = \"{body}\" is its reference point")));
    }
    Ok(nodes)
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
    let mut taken = std::collections::BTreeSet::new();
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
