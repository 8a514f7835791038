//! Bodies: their size and quality, and the rigid motions that supports and ties leave free.

use std::ops::Range;

use nalgebra::DMatrix;
use slipstick_mesh::{Body, Mesh};
use slipstick_model::words::{counted, quantity};

use super::{BodySummary, Notice, NoticeKind};
use crate::construct::surfaces::{curve_middles, feature_angle, is_raised};
use crate::file::{self, Case, Contact};

/// Figures about every body.
pub(super) fn bodies(mesh: &Mesh, fixed: &[bool]) -> Vec<BodySummary> {
    let (volumes, qualities) = (mesh.element_volumes(), mesh.element_qualities());
    mesh.bodies
        .iter()
        .enumerate()
        .map(|(b, body)| BodySummary {
            name: body.name.clone(),
            elements: body.elements.len(),
            nodes: body.nodes.len(),
            volume: volumes[body.elements.clone()].iter().sum(),
            quality: qualities[body.elements.clone()].iter().copied().fold(f64::INFINITY, f64::min),
            free_motions: match mesh.rigid.iter().find(|rigid| rigid.body == b) {
                Some(rigid) => fixed[3 * rigid.reference as usize..][..6].iter().filter(|fixed| !**fixed).count(),
                None => 6 - held_motions(mesh, body.nodes.clone(), fixed),
            },
        })
        .collect()
}

/// Quality below which an element counts as almost degenerate.
const POOR: f64 = 0.05;

/// A notice for each deformable body with almost degenerate elements.
pub(super) fn poor_elements(mesh: &Mesh) -> Vec<Notice> {
    let qualities = mesh.element_qualities();
    let deformable = mesh.bodies.iter().enumerate().filter(|(b, _)| mesh.rigid.iter().all(|rigid| rigid.body != *b));
    let of_body = |(b, body): (usize, &Body)| {
        let poor: Vec<usize> = body.elements.clone().filter(|&e| qualities[e] < POOR).collect();
        let worst = *poor.iter().min_by(|&&d, &&e| qualities[d].total_cmp(&qualities[e]))?;
        let [x, y, z] = mesh.centroid(worst).map(quantity);
        Some(Notice {
            kind: NoticeKind::PoorElements,
            path: format!("body[{b}]"),
            message: format!(
                "body `{}` has {} with a quality below {POOR}; the worst, {}, is at [{x}, {y}, {z}]",
                body.name,
                counted(poor.len(), "element"),
                quantity(qualities[worst]),
            ),
            help:
                "almost degenerate elements are too stiff, and turn inside out at small deformations: improve the mesh (in \
                   Gmsh: `Mesh.Optimize`, `Mesh.OptimizeNetgen`), or remove small edges and faces of the model"
                    .into(),
        })
    };
    deformable.filter_map(of_body).collect()
}

/// A notice for each body whose mid-side nodes do not all lie on the smooth surface of its faces.
pub(super) fn straight_middles(case: &Case, mesh: &Mesh) -> Vec<Notice> {
    let of_body = |(b, body): (usize, &file::Body)| {
        let mut mesh = mesh.clone();
        let angle = feature_angle(case, &mesh, b);
        let off = curve_middles(case, &mut mesh, b, angle).unwrap_or_default();
        let [x, y, z] = mesh.nodes[*off.first()? as usize].map(quantity);
        Some(Notice {
            kind: NoticeKind::StraightMiddles,
            path: format!("body[{b}].order"),
            message: format!(
                "{} of body `{}` stay off the curved surface, because elements would fold otherwise; the first is at [{x}, {y}, {z}]",
                counted(off.len(), "mid-side node"),
                body.name,
            ),
            help: "refine the mesh there until the surface bends less within an element, or let the mesher make \
                   quadratic elements (in Gmsh: `Mesh.ElementOrder = 2`, `Mesh.HighOrderOptimize`)"
                .into(),
        })
    };
    case.bodies.iter().enumerate().filter(|(_, body)| is_raised(body)).filter_map(of_body).collect()
}

/// For each body, whether bodies to which it is tied during the whole path hold it: one of them has no
/// free rigid motion, or the supports of the deformable ones together leave none.
pub(super) fn held_by_ties(case: &Case, mesh: &Mesh, bodies: &[BodySummary], fixed: &[bool]) -> Vec<bool> {
    // a surface may be the union of surfaces of several bodies
    let on = |surface: &String| {
        let facets = mesh.surfaces.get(surface).map_or(&[][..], |surface| &surface.facets);
        let has = |elements: &Range<usize>| facets.iter().any(|facet| elements.contains(&(facet.element as usize)));
        (0..bodies.len()).filter(|&b| has(&mesh.bodies[b].elements)).collect::<Vec<_>>()
    };
    let ties = case.contacts.iter().filter(|pair| pair.tied && pair.active == Contact::ALWAYS);
    let mut group: Vec<usize> = (0..bodies.len()).collect();
    for pair in ties {
        let (slaves, masters) = (on(&pair.slave), on(&pair.master));
        for (a, b) in slaves.iter().flat_map(|&a| masters.iter().map(move |&b| (a, b))) {
            let (from, to) = (group[a], group[b]);
            group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
        }
    }
    let held = |b: usize| {
        let members: Vec<usize> = (0..bodies.len()).filter(|&other| group[other] == group[b]).collect();
        // the nodes of rigid bodies count as prescribed, even if the body is free
        let deformable = members.iter().filter(|&&member| mesh.rigid.iter().all(|rigid| rigid.body != member));
        let nodes = deformable.flat_map(|&member| mesh.bodies[member].nodes.clone()).collect::<Vec<_>>();
        members.len() > 1
            && (members.iter().any(|&member| bodies[member].free_motions == 0)
                || held_motions(mesh, nodes.into_iter(), fixed) == 6)
    };
    (0..bodies.len()).map(held).collect()
}

/// Number of the six rigid motions of a body, or a part of it, that prescribed displacements
/// suppress.
pub(super) fn held_motions(mesh: &Mesh, nodes: impl Iterator<Item = usize> + Clone, fixed: &[bool]) -> usize {
    let gram = rigid_motions(mesh, nodes, fixed);
    let largest = gram.diagonal().max();
    if largest == 0.0 {
        return 0;
    }
    gram.symmetric_eigenvalues().iter().filter(|&&e| e > HELD * largest).count()
}

/// Fraction of the largest eigenvalue below which a rigid motion counts as free.
const HELD: f64 = 1e-10;

/// The axes along which a body, or a part of it, can still move despite the prescribed
/// displacements, and the axes about whose directions it can rotate.
pub fn free_motions(mesh: &Mesh, nodes: impl Iterator<Item = usize> + Clone, fixed: &[bool]) -> ([bool; 3], [bool; 3]) {
    let gram = rigid_motions(mesh, nodes, fixed);
    let largest = gram.diagonal().max();
    let eigen = gram.symmetric_eigen();
    let free: Vec<usize> = (0..6).filter(|&i| eigen.eigenvalues[i] <= HELD * largest).collect();
    if free.is_empty() {
        return ([false; 3], [false; 3]);
    }
    let motions = DMatrix::from_fn(6, free.len(), |c, i| eigen.eigenvectors[(c, free[i])]);
    // unit translations in the span of the free motions; unit rotations, about any point, in the
    // span of their rotations
    let translation = |c: usize| motions.row(c).norm_squared() > 1.0 - FREE;
    let turns = motions.rows(3, 3).into_owned().svd(true, false);
    let basis = turns.u.unwrap_or_default();
    let strong = (0..turns.singular_values.len()).filter(|&i| turns.singular_values[i] > FREE);
    let strong: Vec<usize> = strong.collect();
    let rotation = |c: usize| strong.iter().map(|&i| basis[(c, i)].powi(2)).sum::<f64>() > 1.0 - FREE;
    (std::array::from_fn(translation), std::array::from_fn(rotation))
}

/// Tolerance on the squared length of the projection of a unit vector onto a subspace that contains
/// it.
const FREE: f64 = 1e-6;

/// Gram matrix of the six rigid motions of a body, three translations and three rotations about its
/// centre with arms relative to its size, summed over its prescribed displacements.
fn rigid_motions(mesh: &Mesh, nodes: impl Iterator<Item = usize> + Clone, fixed: &[bool]) -> DMatrix<f64> {
    let count = nodes.clone().count() as f64;
    let mut centre = [0.0; 3];
    for n in nodes.clone() {
        (0..3).for_each(|c| centre[c] += mesh.nodes[n][c] / count);
    }
    let mut size = 0.0;
    let mut gram = DMatrix::<f64>::zeros(6, 6);
    let arms: Vec<[f64; 3]> = nodes.clone().map(|n| std::array::from_fn(|c| mesh.nodes[n][c] - centre[c])).collect();
    for arm in &arms {
        size = f64::max(size, arm.iter().map(|a| a * a).sum::<f64>().sqrt());
    }
    for (n, arm) in nodes.zip(&arms) {
        let arm = arm.map(|a| a / size.max(f64::MIN_POSITIVE));
        for c in (0..3).filter(|&c| fixed[3 * n + c]) {
            // displacement component c of a translation and of a rotation about each axis:
            // (ω × arm)_c
            let (c1, c2) = ((c + 1) % 3, (c + 2) % 3);
            let mut row = [0.0; 6];
            row[c] = 1.0;
            row[3 + c1] = arm[c2];
            row[3 + c2] = -arm[c1];
            for i in 0..6 {
                for j in 0..6 {
                    gram[(i, j)] += row[i] * row[j];
                }
            }
        }
    }
    gram
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// A unit cube whose corner (1, 1, 1) moves to (p, p, p). There, the edges are (−p, 1 − p, 1 − p) and permutations,
    /// with the determinant 2 − 3 p up to its sign; for p = 0.675, the quality is 0.025 / 0.8167³ = 0.0459. Rigid bodies
    /// may have any shape.
    #[test]
    fn almost_degenerate_elements_are_told() {
        let cube = |p: f64| {
            let shape = BoxShape { min: [0.0; 3], max: [1.0; 3], elements: [1; 3], grading: [1.0; 3] };
            let mut mesh = box_mesh("cube", &shape).expect("a box");
            let corner = mesh.nodes.iter_mut().find(|x| **x == [1.0; 3]).expect("the corner");
            *corner = [p; 3];
            mesh
        };
        assert_eq!(poor_elements(&cube(0.69)), []);
        let notices = poor_elements(&cube(0.675));
        let [notice] = &notices[..] else { panic!("{notices:?}") };
        assert_eq!((notice.kind, notice.path.as_str()), (NoticeKind::PoorElements, "body[0]"));
        let start = "body `cube` has 1 element with a quality below 0.05; the worst, 0.0459";
        assert!(notice.message.starts_with(start), "{notice:?}");
    }
}
