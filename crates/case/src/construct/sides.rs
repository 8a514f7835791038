//! Which side of a contact pair should be the slave.
//!
//! Contact conditions hold at the nodes of the slave in the mean over its facets, so the slave should be the side
//! that resolves the contact: smaller facets first, then the convex side on one that is not, then the softer side.
//! The order is that of the manuals of Abaqus (Analysis User's Guide, main and secondary surfaces) and Ansys
//! (Contact Technology Guide, designating contact and target surfaces). A rigid side is never chosen.

use super::symmetry::mirrored;
use super::{edges, facets_of, interface_of, largest_facet, mesh, surfaces};
use crate::file::{self, Case, Sides};
use crate::quantity::{ContactForce, ContactPressure, ContactShare, FrictionWork, Gap, QuantityKind};
use slipstick_mesh::{ContactMap, FacetHeights, FacetNodes, Mesh, facet_area};

/// Ratio of the sizes of facets up to which they are similar.
pub(super) const SIMILAR: f64 = 1.5;

/// Ratio of the moduli up to which bodies are similarly stiff.
const SIMILAR_MODULUS: f64 = 1.2;

/// Heights below this part of the facet size are round-off.
const ROUND_OFF: f64 = 1e-6;

/// Facets are larger than others from this ratio of their sizes on; those of matching meshes differ by round-off.
const LARGER: f64 = 1.01;

/// One side of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Side {
    /// Median size of the facets that are close to the other side. \[L\]
    pub size: f64,
    /// Whether its facets stand for a surface that is convex on average.
    pub convex: bool,
    /// Whether some of its facets stand for a curved surface.
    curved: bool,
    /// Whether it belongs to a rigid body.
    rigid: bool,
    /// Young's modulus of its body at small strains. \[F/L²\]
    modulus: f64,
}

/// Meshes with more elements are not built only to correct sides.
const LARGEST_MESH: usize = 1_000_000;

/// Numbers of the pairs whose master should be the slave: with [`Sides::Chosen`], because it suits better, and with
/// [`Sides::Corrected`], because contact would be missed. None if the mesh cannot be built, since building the problem
/// reports why; with `Corrected` also if it has more than a million elements.
pub(crate) fn exchanged(case: &Case) -> Vec<usize> {
    let open = |contact: &file::Contact| {
        contact.slave != contact.master
            && match contact.sides {
                Sides::AsGiven => false,
                Sides::Chosen => true,
                Sides::Corrected => {
                    !contact.tied && may_be_convex(case, &contact.master) && !is_measured_in_part(case, &contact.slave)
                }
            }
    };
    let elements = |body: &file::Body| body.shape.element_count().unwrap_or(usize::MAX);
    let is_large = case.bodies.iter().map(elements).fold(0, usize::saturating_add) > LARGEST_MESH;
    let open = |contact: &file::Contact| open(contact) && (contact.sides == Sides::Chosen || !is_large);
    if !case.contacts.iter().any(open) {
        return Vec::new();
    }
    let Ok(mesh) = mesh::open_mesh(case) else { return Vec::new() };
    let Ok(mirrored) = mirrored(case, &mesh) else { return Vec::new() };
    let points = ContactMap::new(&mesh).points(&mesh.nodes);
    // pairs are named by their slaves
    let mut slaves: Vec<&str> = case.contacts.iter().map(|contact| contact.slave.as_str()).collect();
    let mut out = Vec::new();
    for (i, contact) in case.contacts.iter().enumerate().filter(|(_, contact)| open(contact)) {
        let better = of(case, contact, &mesh, &points, &mirrored).is_some_and(|[slave, master]| match contact.sides {
            Sides::Corrected => {
                // the program starts its threads after it has read the case
                let alone = || rayon::ThreadPoolBuilder::new().num_threads(1).build().ok();
                let at_rim = || at_rim(case, contact, i, [slave, master], &mesh, &points, &mirrored);
                let rim = || slave.faces_a_rim(&master) && alone().is_some_and(|one| one.install(at_rim));
                (slave.misses(&master) && !slave.curved) || rim()
            }
            _ => master.precedes(&slave),
        });
        if better && !slaves.contains(&contact.master.as_str()) {
            slaves[i] = &contact.master;
            out.push(i);
        }
    }
    out
}

/// Whether a surface may belong to a body that is not a box.
fn may_be_convex(case: &Case, surface: &str) -> bool {
    let owner = |body: &&file::Body| surface.strip_prefix(&body.name).is_some_and(|rest| rest.starts_with('_'));
    let body = case.bodies.iter().filter(owner).max_by_key(|body| body.name.len());
    body.is_none_or(|body| !matches!(body.shape, file::Shape::Box { .. }))
}

/// Whether a quantity of a pair counts only a part of the slave surface, so that the pair keeps its sides.
fn is_measured_in_part(case: &Case, surface: &str) -> bool {
    case.quantities.iter().any(|quantity| match &quantity.kind {
        QuantityKind::ContactForce(ContactForce { slave, within: Some(_), .. })
        | QuantityKind::ContactPressure(ContactPressure { slave, within: Some(_), .. })
        | QuantityKind::ContactShare(ContactShare { slave, within: Some(_), .. })
        | QuantityKind::FrictionWork(FrictionWork { slave, within: Some(_), .. })
        | QuantityKind::Gap(Gap { slave, within: Some(_), .. }) => slave == surface,
        _ => false,
    })
}

/// Whether the master, but not the slave, ends at an edge of its body on an inclined surface: contact at the rim of a
/// bore lies within the facets of a plug, and its mean gap is open there.
pub(crate) fn at_rim(
    case: &Case,
    contact: &file::Contact,
    pair: usize,
    [slave, master]: [Side; 2],
    mesh: &Mesh,
    points: &[[f64; 3]],
    mirrored: &[[bool; 3]],
) -> bool {
    if !slave.faces_a_rim(&master) || contact.normals.is_some() {
        return false;
    }
    let Ok(size) = largest_facet(contact, pair, mesh, points) else { return false };
    let inclined = |contact: &file::Contact| {
        let interface = interface_of(case, contact, pair, mesh, points, mirrored, 2.0 * size);
        interface.is_ok_and(|interface| edges::is_inclined(&interface, contact, mesh, points, mirrored))
    };
    let (slave, master) = (contact.master.clone(), contact.slave.clone());
    inclined(&file::Contact { slave, master, ..contact.clone() }) && !inclined(contact)
}

/// Slave and master of a pair; `None` if a surface is unknown or empty. `points` are the positions of the corners of
/// contact facets, `mirrored` the axes normal to symmetry planes through the nodes.
pub(crate) fn of(
    case: &Case,
    contact: &file::Contact,
    mesh: &Mesh,
    points: &[[f64; 3]],
    mirrored: &[[bool; 3]],
) -> Option<[Side; 2]> {
    let facets = |name: &str| facets_of(mesh, name, "").ok().filter(|facets| !facets.is_empty());
    let sides = [facets(&contact.slave)?, facets(&contact.master)?];
    let near = [close_to(&sides[0], &sides[1], points), close_to(&sides[1], &sides[0], points)];
    let side = |i: usize| {
        let node = *sides[i][0].first()? as usize;
        let body = mesh.bodies.iter().position(|body| body.nodes.contains(&node))?;
        let smooth = surfaces::smooth(case, contact, mesh, points, &near[i], mirrored);
        let heights = smooth.iter().flat_map(|smooth| smooth.heights.iter().zip(&near[i]));
        let bulges: Vec<f64> =
            heights.filter_map(|(heights, facet)| Some(bulge(heights.as_ref()?, facet.len()))).collect();
        let definition = case.bodies.get(body)?;
        Some(Side {
            size: median_size(&near[i], points),
            curved: !bulges.is_empty(),
            convex: bulges.iter().sum::<f64>() > ROUND_OFF * median_size(&near[i], points),
            rigid: definition.rigid.is_some(),
            modulus: definition.material.youngs_modulus(),
        })
    };
    Some([side(0)?, side(1)?])
}

/// Height of the smooth surface above the middle of a facet relative to the mean over its corners, which those of
/// second-order elements do not share with the surface. \[L\]
fn bulge(heights: &FacetHeights, corners: usize) -> f64 {
    let mean = |points: &[usize]| points.iter().map(|&i| heights[i]).sum::<f64>() / points.len() as f64;
    // rows of 5, 4, 3, 2 and 1 control points on a triangle, of 5 on a quadrilateral
    match corners {
        3 => mean(&[6, 7, 10]) - mean(&[0, 4, 14]),
        _ => heights[12] - mean(&[0, 4, 20, 24]),
    }
}

impl Side {
    /// Whether this side should be the slave rather than the `other`.
    fn precedes(&self, other: &Self) -> bool {
        if self.rigid || other.rigid {
            return other.rigid && !self.rigid;
        }
        let finer = other.size / self.size;
        if !(1.0 / SIMILAR..=SIMILAR).contains(&finer) {
            return finer > 1.0;
        }
        if self.convex != other.convex {
            return self.convex;
        }
        self.modulus * SIMILAR_MODULUS < other.modulus
    }

    /// Whether this side, as the slave, may be a plug in a bore whose rim touches it.
    fn faces_a_rim(&self, other: &Self) -> bool {
        !self.rigid && !other.rigid && self.convex && !other.convex
    }

    /// Whether contact of this side, as the slave, is missed where the other side penetrates it: a convex surface
    /// whose facets are smaller touches within a facet, over which the mean gap is still open.
    pub(crate) fn misses(&self, other: &Self) -> bool {
        !self.rigid && !other.rigid && other.convex && !self.convex && self.size > LARGER * other.size
    }
}

/// The facets of a side whose boxes overlap that of the other side, widened by the largest facet; all if there are
/// none, as where bodies meet later.
pub(super) fn close_to(facets: &[FacetNodes], others: &[FacetNodes], points: &[[f64; 3]]) -> Vec<FacetNodes> {
    let all = others.iter().chain(facets).map(|facet| facet_area(&facet.corners(points)).sqrt());
    let margin = all.fold(0.0, f64::max);
    let other = box_of(others.iter().flat_map(|facet| facet.iter()), points);
    let meets = |facet: &&FacetNodes| {
        let own = box_of(facet.iter(), points);
        (0..3).all(|c| own[0][c] <= other[1][c] + margin && own[1][c] >= other[0][c] - margin)
    };
    let near: Vec<FacetNodes> = facets.iter().filter(meets).copied().collect();
    if near.is_empty() { facets.to_vec() } else { near }
}

/// The lowest and the highest coordinates of nodes.
fn box_of<'a>(nodes: impl Iterator<Item = &'a u32>, points: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let start = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    nodes.map(|&node| points[node as usize]).fold(start, |[low, high], x| {
        [std::array::from_fn(|c| low[c].min(x[c])), std::array::from_fn(|c| high[c].max(x[c]))]
    })
}

/// Median of the square roots of the facets' areas. \[L\]
pub(super) fn median_size(facets: &[FacetNodes], points: &[[f64; 3]]) -> f64 {
    let mut sizes: Vec<f64> = facets.iter().map(|facet| facet_area(&facet.corners(points)).sqrt()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    sizes[sizes.len() / 2]
}
