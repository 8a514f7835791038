//! The smooth surfaces for which the facets of contact pairs stand.

use super::BuildError;
use super::symmetry::mirrored;
use crate::file::{self, Case};
use nalgebra::{Matrix3, Vector3};
use slipstick_contact::kinematics::height::FacetHeight;
use slipstick_mesh::{FacetNodes, Mesh, Rotation, Shape, SmoothPatch, SmoothSurface, smooth_surface};

/// The smooth surface for which facets of a pair stand, whose corners have the positions `points`;
/// `None` if the facets are the surface itself, as those of ties and of pairs that ask for it.
pub(crate) fn smooth(
    case: &Case,
    contact: &file::Contact,
    mesh: &Mesh,
    points: &[[f64; 3]],
    facets: &[FacetNodes],
    mirrored: &[[bool; 3]],
) -> Option<SmoothSurface> {
    if contact.tied || contact.surfaces == file::Surfaces::Faceted {
        return None;
    }
    let smooth = on_facets(case, contact.feature_angle, (&mesh.nodes, points), facets, mirrored, &[]);
    (!smooth.patches.is_empty()).then_some(smooth)
}

/// The same with a feature angle in degrees; `named` are shapes that the case does not know.
fn on_facets(
    case: &Case,
    feature_angle: f64,
    (nodes, points): (&[[f64; 3]], &[[f64; 3]]),
    facets: &[FacetNodes],
    mirrored: &[[bool; 3]],
    named: &[Shape],
) -> SmoothSurface {
    let known: Vec<Shape> = case.bodies.iter().flat_map(shapes).chain(named.iter().copied()).collect();
    let mirrored = |node: u32| mirrored[node as usize];
    smooth_surface(facets, nodes, points, feature_angle.to_radians(), &known, mirrored)
}

/// The feature angle \[°\] at which the outer faces of a body are divided into smooth surfaces: that of the body's first
/// contact pair; `None` if one of its pairs asks for facets.
pub(crate) fn feature_angle(case: &Case, mesh: &Mesh, body: usize) -> Option<f64> {
    let nodes = &mesh.bodies[body].nodes;
    let touches =
        |name: &String| mesh.set_nodes(name).is_some_and(|set| set.iter().any(|&n| nodes.contains(&(n as usize))));
    let mut pairs = case.contacts.iter().filter(|pair| !pair.tied && (touches(&pair.slave) || touches(&pair.master)));
    if pairs.clone().any(|pair| pair.surfaces == file::Surfaces::Faceted) {
        return None;
    }
    Some(pairs.next().map_or(file::Contact::FEATURE_ANGLE, |pair| pair.feature_angle))
}

/// The outer facets of a body, and the smooth surface for which they stand: with the feature angle of
/// the body's first contact pair, and only themselves if one of its pairs asks for facets. Named faces may have shapes of
/// their own, such as a fillet and the cylinder that it touches.
///
/// # Errors
/// [`BuildError`] of a symmetry plane.
pub fn smooth_faces(case: &Case, mesh: &Mesh, body: usize) -> Result<(Vec<FacetNodes>, SmoothSurface), BuildError> {
    let facets: Vec<FacetNodes> = mesh.boundary(body).facets.iter().map(|facet| facet.nodes).collect();
    let mirrored = mirrored(case, mesh)?;
    let Some(angle) = feature_angle(case, mesh, body) else { return Ok((facets, SmoothSurface::default())) };
    let of = |facets: &[FacetNodes], named: &[Shape]| {
        on_facets(case, angle, (&mesh.nodes, &mesh.nodes), facets, &mirrored, named)
    };
    let elements = &mesh.bodies[body].elements;
    let own = mesh.surfaces.values().map(|surface| {
        surface.facets.iter().filter(|facet| elements.contains(&(facet.element as usize))).map(|facet| facet.nodes)
    });
    let named: Vec<Shape> =
        own.flat_map(|facets| of(&facets.collect::<Vec<_>>(), &[]).patches).filter_map(|patch| patch.shape).collect();
    let mut smooth = of(&facets, &named);
    // a flat face that touches a fillet lies on no shape
    let flat = |patch: &SmoothPatch| {
        let first = normal(mesh, &facets[patch.facets[0] as usize]);
        patch.facets.iter().all(|&f| normal(mesh, &facets[f as usize]).cross(&first).norm() < FLAT)
    };
    for patch in smooth.patches.extract_if(.., |patch| flat(patch)) {
        patch.facets.iter().for_each(|&f| smooth.heights[f as usize] = None);
    }
    Ok((facets, smooth))
}

/// Sine of the angle between facets of a flat face that is round-off.
const FLAT: f64 = 1e-6;

/// The unit normal of a facet.
fn normal(mesh: &Mesh, facet: &FacetNodes) -> Vector3<f64> {
    let at = |k: usize| Vector3::from(mesh.nodes[facet[k.min(facet.len() - 1)] as usize]);
    (at(2) - at(0)).cross(&(at(3) - at(1))).try_normalize(0.0).unwrap_or_default()
}

/// Whether the mesh file of a body has linear elements that are to become quadratic.
pub(crate) fn is_raised(body: &file::Body) -> bool {
    matches!(&body.shape, file::Shape::Mesh(file) if body.order == 2 && !file.mesh.has_second_order())
}

/// Puts the mid-side nodes of a [raised](is_raised) body onto the smooth surface for which the file's facets stand, with
/// this feature angle \[°\]; none moves if there is no angle. Returns the nodes that do not reach it.
///
/// # Errors
/// [`BuildError`] of a symmetry plane.
pub(crate) fn curve_middles(
    case: &Case,
    mesh: &mut Mesh,
    body: usize,
    feature_angle: Option<f64>,
) -> Result<Vec<u32>, BuildError> {
    let Some(angle) = feature_angle else { return Ok(Vec::new()) };
    let mirrored = mirrored(case, mesh)?;
    let nodes = mesh.nodes.clone();
    let smooth = |facets: &[FacetNodes]| on_facets(case, angle, (&nodes, &nodes), facets, &mirrored, &[]);
    Ok(mesh.curve_middles(body, smooth))
}

/// The heights of a smooth surface above its facets, whose corners have the positions `points`.
pub(super) fn heights(
    smooth: Option<SmoothSurface>,
    facets: &[FacetNodes],
    points: &[[f64; 3]],
) -> Vec<Option<FacetHeight>> {
    let heights = smooth.map_or_else(Vec::new, |smooth| smooth.heights);
    let corners = |facet: &FacetNodes| -> Vec<_> { facet.iter().map(|&n| Vector3::from(points[n as usize])).collect() };
    let above = heights.into_iter().zip(facets);
    above.map(|(heights, facet)| Some(FacetHeight::new(heights?, &corners(facet)))).collect()
}

/// The curved surfaces of a generated body, where it is placed.
fn shapes(body: &file::Body) -> Vec<Shape> {
    let origin = Vector3::zeros();
    let cylinder = |axis, radius| Shape::Cone { point: origin, axis, radius, slope: 0.0 };
    let own = match body.shape {
        file::Shape::Box { .. } | file::Shape::Mesh(_) => Vec::new(),
        file::Shape::HalfBall { radius, .. } | file::Shape::Ball { radius, .. } => {
            vec![Shape::Sphere { centre: origin, radius }]
        }
        file::Shape::HollowCylinder { inner_radius, outer_radius, .. } => {
            [inner_radius, outer_radius].map(|radius| cylinder(Vector3::y(), radius)).to_vec()
        }
        file::Shape::HalfRing { inner_radius, outer_radius, .. } => {
            [inner_radius, outer_radius].map(|radius| cylinder(Vector3::z(), radius)).to_vec()
        }
        file::Shape::Cone { bottom_radius, top_radius, height, .. } => {
            let slope = (top_radius - bottom_radius) / height;
            vec![Shape::Cone { point: origin, axis: Vector3::y(), radius: bottom_radius, slope }]
        }
        file::Shape::Torus { radius, tube_radius, .. } => {
            vec![Shape::Torus { centre: origin, axis: Vector3::y(), radius, tube: tube_radius }]
        }
    };
    let turn = body.place.rotate.and_then(|r| Rotation { axis: r.axis, degrees: r.degrees }.matrix().ok());
    let turn = turn.map_or_else(Matrix3::identity, |rows| Matrix3::from_fn(|r, c| rows[r][c]));
    let place = Vector3::from(body.place.translate);
    own.into_iter().map(|shape| shape.moved(&turn, &place)).collect()
}
