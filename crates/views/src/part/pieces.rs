//! The pieces of a body's material: held ones are kept, loose ones are left out.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use slipstick_case::file::{Case, SpringEnd};
use slipstick_mesh::Mesh;

use super::patches::{NamedFaces, shells};
use crate::export::{ExportError, ExportOptions, TriangleSurface, labelled_surface};
use crate::vector::{cross, dot, norm, subtract};

/// A loose piece of material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoosePiece {
    /// Its volume. \[L³\]
    pub volume: f64,
    /// The lowest and highest corners of its bounding box. \[L\]
    pub bounds: [[f64; 3]; 2],
    /// Whether it is on a contact face.
    pub on_contact: bool,
}

/// The material of a body without its loose pieces.
#[derive(Debug)]
pub(super) struct Pieces {
    pub surface: TriangleSurface,
    /// Whether each triangle of the whole surface belongs to a piece that is kept.
    pub held: Vec<bool>,
    /// The number of the piece to which each triangle belongs, including triangles of cavities.
    pub piece: Vec<u32>,
    /// The loose pieces, largest first.
    pub loose: Vec<LoosePiece>,
    /// The labels of their triangles.
    pub loose_labels: BTreeSet<u32>,
}

/// Keeps the pieces with a triangle that `held` accepts or, if there is none, the largest piece.
pub(super) fn pieces(surface: &TriangleSurface, held: impl Fn(usize) -> bool) -> Pieces {
    let (shell, count) = shells(surface);
    let mut triangles: Vec<Vec<usize>> = vec![Vec::new(); count];
    shell.iter().enumerate().for_each(|(t, &number)| triangles[number as usize].push(t));
    let volume = |shell: &[usize]| -> f64 {
        let origin = surface.corners(shell[0])[0];
        let part = |&t: &usize| {
            let [a, b, c] = surface.corners(t).map(|p| subtract(p, origin));
            dot(a, cross(b, c)) / 6.0
        };
        shell.iter().map(part).sum()
    };
    let volumes: Vec<f64> = triangles.iter().map(|shell| volume(shell)).collect();
    let outside: Vec<usize> = (0..count).filter(|&s| volumes[s] > 0.0).collect();
    // A cavity belongs to the smallest shell around it.
    let owner = |s: usize| -> Option<usize> {
        if volumes[s] > 0.0 {
            return Some(s);
        }
        let x = surface.corners(triangles[s][0])[0];
        let around = outside.iter().copied().filter(|&o| winding(surface, &triangles[o], x) > 0.5);
        around.min_by(|&a, &b| volumes[a].total_cmp(&volumes[b]))
    };
    let owners: Vec<Option<usize>> = (0..count).map(owner).collect();
    let mut kept: Vec<usize> = outside.iter().copied().filter(|&s| triangles[s].iter().any(|&t| held(t))).collect();
    if kept.is_empty() {
        kept.extend(outside.iter().copied().max_by(|&a, &b| volumes[a].total_cmp(&volumes[b])));
    }
    let mut loose: Vec<LoosePiece> = outside
        .iter()
        .filter(|s| !kept.contains(s))
        .map(|&s| {
            let own = (0..count).filter(|&other| owners[other] == Some(s));
            LoosePiece {
                volume: own.map(|shell| volumes[shell]).sum(),
                bounds: bounds(surface, &triangles[s]),
                on_contact: false,
            }
        })
        .collect();
    loose.sort_by(|a, b| b.volume.total_cmp(&a.volume));
    let number = |t: usize| owners[shell[t] as usize].and_then(|owner| kept.iter().position(|&k| k == owner));
    let left_out = (0..surface.triangles.len()).filter(|&t| number(t).is_none());
    let loose_labels = left_out.filter_map(|t| surface.labels.get(t).copied()).collect();
    let piece = (0..surface.triangles.len()).filter_map(|t| Some(number(t)? as u32)).collect();
    let attached = surface.restricted(|t| number(t).is_some());
    let held = (0..surface.triangles.len()).map(|t| number(t).is_some()).collect();
    Pieces { surface: attached, held, piece, loose, loose_labels }
}

/// The pieces of a body's material that stay, and what becomes of the others.
pub(super) struct Fate {
    pub kept: Pieces,
    /// Pieces that only a contact pair holds, beside those with a support, the largest first.
    pub by_contact: Vec<LoosePiece>,
    /// Names of the faces with material on loose pieces.
    pub left_out: BTreeSet<String>,
}

/// Decides which pieces of a body's surface are held: by a support or a joint or, where a face is on no
/// such piece, by contact.
pub(super) fn fate(case: &Case, faces: &NamedFaces, surface: &TriangleSurface) -> Fate {
    let supports: Vec<&String> = case
        .dirichlet
        .iter()
        .map(|support| &support.set)
        .chain(case.springs.iter().flat_map(|spring| {
            let to = spring.to.iter().filter_map(|to| match to {
                SpringEnd::Set(to) => Some(to),
                SpringEnd::Point(_) => None,
            });
            to.chain([&spring.set])
        }))
        .chain(case.contacts.iter().filter(|pair| pair.tied).flat_map(|pair| [&pair.slave, &pair.master]))
        .chain(case.couplings.iter().map(|coupling| &coupling.set))
        .chain(case.equations.iter().flat_map(|equation| equation.terms.iter().map(|term| &term.set)))
        .collect();
    let on = |t: usize, names: &[&String]| faces.of(surface.labels[t]).iter().any(|name| names.contains(&name));
    let mut kept = pieces(surface, |t| on(t, &supports));
    let names = |labels: &BTreeSet<u32>| labels.iter().flat_map(|&label| faces.of(label)).cloned().collect();
    let mut left_out: BTreeSet<String> = names(&kept.loose_labels);
    // contact holds pieces such as a ring inside a ring
    let on_kept: BTreeSet<String> = names(&kept.surface.labels.iter().copied().collect());
    let pairs: Vec<&String> = case.contacts.iter().flat_map(|pair| [&pair.slave, &pair.master]).collect();
    let missing: Vec<&String> =
        pairs.iter().copied().filter(|&name| left_out.contains(name) && !on_kept.contains(name)).collect();
    let mut by_contact = Vec::new();
    if !missing.is_empty() {
        let held = |t: usize| kept.held[t] || on(t, &missing);
        let with_contact = pieces(surface, held);
        let unsupported = std::mem::take(&mut kept.loose);
        kept = with_contact;
        by_contact.extend(unsupported.into_iter().filter(|piece| !kept.loose.contains(piece)));
        left_out = names(&kept.loose_labels);
    }
    let apart = pieces(surface, |t| kept.held[t] || on(t, &pairs)).loose;
    kept.loose.iter_mut().for_each(|piece| piece.on_contact = !apart.contains(piece));
    Fate { kept, by_contact, left_out }
}

/// The pieces of a design that nothing holds, and those that only contact holds.
#[derive(Debug, Clone, PartialEq)]
pub struct PiecesOfBody {
    /// Name of the body.
    pub body: String,
    /// Pieces of its material; a cavity is none.
    pub pieces: usize,
    /// Those that neither a support nor contact holds, the largest first.
    pub loose: Vec<LoosePiece>,
    /// Those that only contact holds, the largest first.
    pub by_contact: Vec<LoosePiece>,
}

/// The pieces of each body of a surface of the design, for bodies of several ones.
///
/// # Errors
/// As [`labelled_surface`].
pub fn pieces_of_design(
    case: &Case,
    mesh: &Mesh,
    density: &[f64],
    options: &ExportOptions,
) -> Result<Vec<PiecesOfBody>, ExportError> {
    let all: Vec<usize> = (0..mesh.bodies.len()).collect();
    let faces = NamedFaces::new(mesh, &all);
    let surface = labelled_surface(mesh, density, options, &faces.labels)?.surface;
    let of_body = |body: usize| {
        let own = surface.restricted(|t| surface.bodies[t] as usize == body);
        if own.triangles.is_empty() {
            return None;
        }
        let Fate { kept, by_contact, .. } = fate(case, &faces, &own);
        let pieces = kept.piece.iter().max().map_or(0, |&most| most as usize + 1) + kept.loose.len();
        let body = mesh.bodies[body].name.clone();
        let (touching, loose): (Vec<_>, Vec<_>) = kept.loose.into_iter().partition(|piece| piece.on_contact);
        let mut by_contact: Vec<LoosePiece> = by_contact.into_iter().chain(touching).collect();
        by_contact.sort_by(|a, b| b.volume.total_cmp(&a.volume));
        (pieces > 1).then_some(PiecesOfBody { body, pieces, loose, by_contact })
    };
    Ok(all.into_iter().filter_map(of_body).collect())
}

fn bounds(surface: &TriangleSurface, triangles: &[usize]) -> [[f64; 3]; 2] {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for corner in triangles.iter().flat_map(|&t| surface.corners(t)) {
        for c in 0..3 {
            bounds[0][c] = bounds[0][c].min(corner[c]);
            bounds[1][c] = bounds[1][c].max(corner[c]);
        }
    }
    bounds
}

/// The winding number of a shell about a point, 1 inside and 0 outside: the sum of the solid angles
/// of its triangles divided by 4π.
///
/// Method: A. Van Oosterom, J. Strackee, The solid angle of a plane triangle, IEEE Trans. Biomed.
/// Eng. 30 (1983) 125–126.
fn winding(surface: &TriangleSurface, triangles: &[usize], x: [f64; 3]) -> f64 {
    let angle = |&t: &usize| {
        let [a, b, c] = surface.corners(t).map(|p| subtract(p, x));
        let (p, q, r) = (norm(a), norm(b), norm(c));
        let volume = dot(a, cross(b, c));
        2.0 * volume.atan2(p * q * r + dot(a, b) * r + dot(b, c) * p + dot(c, a) * q)
    };
    triangles.iter().map(angle).sum::<f64>() / (4.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{ExportOptions, design_surface};
    use slipstick_mesh::{BoxShape, box_mesh};

    /// A hollow cube of 5³ elements with a cavity of 3³ and a solid element within it, two elements
    /// away from a bar of 1 × 5 × 5 elements.
    #[test]
    fn loose_pieces_are_left_out() {
        let shape = BoxShape { min: [0.0; 3], max: [8.0, 5.0, 5.0], elements: [8, 5, 5], grading: [1.0; 3] };
        let mesh = box_mesh("block", &shape).expect("a box");
        let density: Vec<f64> = (0..mesh.elements.len())
            .map(|e| {
                let [x, y, z] = mesh.centroid(e);
                let far = (x - 2.5).abs().max((y - 2.5).abs()).max((z - 2.5).abs());
                f64::from(u8::from(x > 7.0 || x < 5.0 && !(0.9..1.9).contains(&far)))
            })
            .collect();
        let options = ExportOptions { threshold: Some(0.4), smoothing: 0, ..ExportOptions::default() };
        let surface = design_surface(&mesh, &density, &options).expect("a surface").surface;
        assert_eq!(surface.pieces(), 4);
        let left = |t: usize| surface.corners(t).iter().all(|p| p[0] == 0.0);
        let right = |t: usize| surface.corners(t).iter().all(|p| p[0] == 8.0);
        let cube = pieces(&surface, left);
        let (bar, inner) = (cube.loose[0], cube.loose[1]);
        assert_eq!((cube.surface.pieces(), cube.loose.len()), (2, 2), "the cube and its cavity");
        assert!(cube.piece.iter().all(|&piece| piece == 0));
        assert!(bar.bounds[0][0] > 6.5 && bar.bounds[1] == [8.0, 5.0, 5.0], "{bar:?}");
        assert!(inner.volume < bar.volume && inner.bounds[0][0] > 1.5 && inner.bounds[1][0] < 3.5, "{inner:?}");
        let whole = surface.volume();
        assert!((cube.surface.volume() + bar.volume + inner.volume - whole).abs() < 1e-12 * whole);
        // Without a support, the largest piece remains; with two, both.
        assert_eq!(pieces(&surface, |_| false).surface, cube.surface);
        let both = pieces(&surface, |t| left(t) || right(t));
        assert_eq!((both.surface.pieces(), both.loose.len()), (3, 1));
        assert_eq!(both.piece.iter().max(), Some(&1));
    }
}
