//! Meshes of tetrahedra, wedges and hexahedra, linear or quadratic, of several bodies, with named node sets and oriented
//! surfaces.
//!
//! This crate covers only geometry and topology, no physics.
//!
//! * [`Mesh`] is the data model; [`Mesh::merge`] and [`Mesh::transform`] assemble bodies.
//! * [`box_mesh`], [`ball`], [`half_ball`], [`hollow_cylinder`], [`half_ring`], [`cone`] and [`torus`]
//!   generate single bodies.
//! * [`Mesh::check`] finds defects that would spoil an analysis; each [`MeshDefect`] has its place
//!   and cure.
//! * [`FacetTree`] finds the facets of a surface near a given box, for the contact search.
//!
//! Lengths are in the user's unit \[L\]; y is up; node, element and facet numbers count from 0.
//!
//! ```
//! use slipstick_mesh::{BoxShape, Mesh, Placement, box_mesh};
//!
//! # fn main() -> Result<(), slipstick_mesh::MeshError> {
//! let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 1.0], elements: [4, 2, 2], grading: [1.0; 3] };
//! let slab = box_mesh("slab", &shape)?;
//! let mut die = box_mesh("die", &shape)?;
//! die.transform(&Placement { rotate: None, translate: [0.0, 1.5, 0.0] })?;
//! let mesh = Mesh::merge(vec![slab, die])?;
//! mesh.validate()?;
//! assert_eq!(mesh.surfaces["die_ymin"].facets.len(), 8);
//! assert_eq!(mesh.set_nodes("slab_ymax").map(|nodes| nodes.len()), Some(15));
//! # Ok(())
//! # }
//! ```

mod assemble;
mod check;
mod contact_map;
mod cut;
mod defect;
mod divide;
mod element;
mod error;
mod generate;
mod geometry;
mod mesh;
mod quadratic_facet;
mod rigid;
mod search;
pub mod second_order;
mod select;
mod serendipity;
mod shapes;
mod smooth;
mod topology;
pub mod vector;

pub use assemble::{Placement, Rotation};
pub use contact_map::ContactMap;
pub use cut::{Cut, CutError};
pub use defect::MeshDefect;
pub use element::{
    Element, FaceNodes, FacetCorners, FacetNodes, HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES, SUB_FACETS, TET_EDGES,
    TET_FACES, WEDGE_AS_HEX, WEDGE_EDGES, WEDGE_QUADRILATERALS, WEDGE_TRIANGLES,
};
pub use error::MeshError;
pub use generate::{
    BallShape, BoxShape, ConeShape, HalfBallShape, HalfRingShape, HollowCylinderShape, TorusShape, ball, box_mesh,
    cone, half_ball, half_ring, hollow_cylinder, torus,
};
pub use geometry::{
    HEX_CORNERS, WEDGE_CORNERS, facet_area, facet_area_vector, facet_corner_areas, hex_jacobian, hex_scaled_jacobian,
    tet_scaled_jacobian, tet_volume, wedge_jacobian, wedge_scaled_jacobian,
};
pub use mesh::{Body, Facet, Mesh, Surface};
pub use quadratic_facet::{FaceFunctions, NodeGaps, QuadraticFacet};
pub use rigid::{Coupling, Reference, Rigid};
pub use search::FacetTree;
pub use serendipity::SerendipityCentre;
pub use smooth::{FacetHeights, Shape, SmoothPatch, SmoothSurface, control_points, smooth_surface};
pub use topology::NodeElements;
