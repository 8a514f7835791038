//! The smooth surfaces for which the facets of contact pairs stand.

use crate::case::{self, Case};
use nalgebra::{Matrix3, Vector3};
use slipstick_contact::kinematics::height::FacetHeight;
use slipstick_mesh::{FacetNodes, Mesh, Rotation, Shape, SmoothSurface, smooth_surface};

/// The smooth surface for which facets of a pair stand, whose corners have the positions `points`;
/// `None` if the facets are the surface itself, as those of ties and of pairs that ask for it.
pub(crate) fn smooth(
    case: &Case,
    contact: &case::Contact,
    mesh: &Mesh,
    points: &[[f64; 3]],
    facets: &[FacetNodes],
    mirrored: &[[bool; 3]],
) -> Option<SmoothSurface> {
    if contact.tied || contact.surfaces == case::Surfaces::Faceted {
        return None;
    }
    let known: Vec<Shape> = case.bodies.iter().flat_map(shapes).collect();
    let smooth = smooth_surface(facets, &mesh.nodes, points, contact.feature_angle.to_radians(), &known, |node| {
        mirrored[node as usize]
    });
    (!smooth.patches.is_empty()).then_some(smooth)
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
fn shapes(body: &case::Body) -> Vec<Shape> {
    let origin = Vector3::zeros();
    let cylinder = |axis, radius| Shape::Cone { point: origin, axis, radius, slope: 0.0 };
    let own = match body.shape {
        case::Shape::Box { .. } | case::Shape::Mesh(_) => Vec::new(),
        case::Shape::HalfBall { radius, .. } | case::Shape::Ball { radius, .. } => {
            vec![Shape::Sphere { centre: origin, radius }]
        }
        case::Shape::HollowCylinder { inner_radius, outer_radius, .. } => {
            [inner_radius, outer_radius].map(|radius| cylinder(Vector3::y(), radius)).to_vec()
        }
        case::Shape::HalfRing { inner_radius, outer_radius, .. } => {
            [inner_radius, outer_radius].map(|radius| cylinder(Vector3::z(), radius)).to_vec()
        }
        case::Shape::Cone { bottom_radius, top_radius, height, .. } => {
            let slope = (top_radius - bottom_radius) / height;
            vec![Shape::Cone { point: origin, axis: Vector3::y(), radius: bottom_radius, slope }]
        }
        case::Shape::Torus { radius, tube_radius, .. } => {
            vec![Shape::Torus { centre: origin, axis: Vector3::y(), radius, tube: tube_radius }]
        }
    };
    let turn = body.place.rotate.and_then(|r| Rotation { axis: r.axis, degrees: r.degrees }.matrix().ok());
    let turn = turn.map_or_else(Matrix3::identity, |rows| Matrix3::from_fn(|r, c| rows[r][c]));
    let place = Vector3::from(body.place.translate);
    own.into_iter().map(|shape| shape.moved(&turn, &place)).collect()
}
