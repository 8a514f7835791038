//! Elements and facets, given by their nodes: tetrahedra, wedges and hexahedra, triangles and
//! quadrilaterals.

use std::fmt;
use std::ops::{Deref, DerefMut, Range};

/// Local node numbers of the six faces of a hex8, each counter-clockwise seen from outside.
///
/// Hex8 numbering: 0–3 counter-clockwise on the face ζ = −1 seen from inside (ζ > −1), 4–7 above
/// them.
pub const HEX_FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// Local node numbers of the four faces of a tet4, each counter-clockwise seen from outside.
///
/// Tet4 numbering: 0–2 counter-clockwise seen from node 3. The faces are in the order of Abaqus.
pub const TET_FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

/// Local node numbers of the two triangular faces of a wedge6, its faces 0 and 1, each
/// counter-clockwise seen from outside.
///
/// Wedge6 numbering: 0–2 counter-clockwise seen from inside, 3–5 above them, as in Gmsh, Abaqus and
/// VTK 9.7. Earlier versions of VTK number wedges in the opposite sense. The faces are in the order
/// of Abaqus.
pub const WEDGE_TRIANGLES: [[usize; 3]; 2] = [[0, 2, 1], [3, 4, 5]];

/// Local node numbers of the three quadrilateral faces of a wedge6, its faces 2 to 4, each
/// counter-clockwise seen from outside.
pub const WEDGE_QUADRILATERALS: [[usize; 4]; 3] = [[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]];

/// The corners of a wedge6 as corners of a hex8 in which two edges have no length.
///
/// The trilinear map of this hexahedron is the map of the wedge. With ξ, η, ζ of the parent cube,
/// the shape functions of coinciding corners add up to those of the wedge, N = L(ξ, η) (1 ∓ ζ)/2,
/// where L = (1−ξ)(1−η)/4, (1+ξ)(1−η)/4 and (1+η)/2 are the area coordinates of the triangle.
/// Test: `a_wedge_is_a_hexahedron_with_two_edges_of_no_length`.
pub const WEDGE_AS_HEX: [usize; 8] = [0, 1, 2, 2, 3, 4, 5, 5];

/// Corners at the ends of the six edges of a tetrahedron. Node 4 + i of a tet10 lies on edge i, as in
/// VTK and Abaqus; Gmsh swaps the last two.
pub const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// Corners at the ends of the twelve edges of a hexahedron. Node 8 + i of a hex27 lies on edge i, as
/// in VTK and Abaqus.
pub const HEX_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The nodes of a hex27 at the centres of its faces, in the order of [`HEX_FACES`]. Node 26 is at the
/// centre of the element. This is the numbering of VTK's triquadratic hexahedron.
pub const HEX_FACE_CENTRES: [usize; 6] = [24, 25, 22, 21, 23, 20];

/// Corners at the ends of the nine edges of a wedge. Node 6 + i of a wedge18 lies on edge i, as in VTK and
/// Abaqus; node 15 + i at the centre of quadrilateral i of [`WEDGE_QUADRILATERALS`], as in VTK.
pub const WEDGE_EDGES: [[usize; 2]; 9] = [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];

/// The four linear triangles of a face with six nodes: corners 0–2, then the middles of the edges
/// from each corner to the next.
const SUB_TRIANGLES: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

/// The four bilinear quadrilaterals of a face with nine nodes: corners 0–3, the middles of the edges
/// from each corner to the next, the centre.
const SUB_QUADRILATERALS: [[usize; 4]; 4] = [[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]];

/// Number of facets of a face of a second-order element.
pub const SUB_FACETS: usize = 4;

/// An element, given by its global node numbers; tetrahedra and hexahedra are numbered as in VTK.
///
/// The surface of a second-order element consists of linear **facets** over all its nodes, four for
/// each face. Surfaces, contact, pictures and checks see only these. Volume, quality, stiffness and
/// surface loads use the quadratic shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Element {
    /// Linear tetrahedron, see [`TET_FACES`].
    Tet4([u32; 4]),
    /// Linear wedge (triangular prism), see [`WEDGE_TRIANGLES`].
    Wedge6([u32; 6]),
    /// Trilinear hexahedron, see [`HEX_FACES`].
    Hex8([u32; 8]),
    /// Quadratic tetrahedron: corners as in [`Self::Tet4`], then the nodes on [`TET_EDGES`].
    Tet10([u32; 10]),
    /// Quadratic wedge: corners as in [`Self::Wedge6`], then the nodes on [`WEDGE_EDGES`] and at the centres of
    /// [`WEDGE_QUADRILATERALS`].
    Wedge18([u32; 18]),
    /// Triquadratic hexahedron: corners as in [`Self::Hex8`], then the nodes on [`HEX_EDGES`], at
    /// [`HEX_FACE_CENTRES`] and at the centre.
    Hex27([u32; 27]),
}

impl Element {
    /// Global node numbers.
    pub fn nodes(&self) -> &[u32] {
        match self {
            Self::Tet4(nodes) => nodes,
            Self::Wedge6(nodes) => nodes,
            Self::Hex8(nodes) => nodes,
            Self::Tet10(nodes) => nodes,
            Self::Wedge18(nodes) => nodes,
            Self::Hex27(nodes) => nodes,
        }
    }

    /// Global numbers of the corners, which are the first nodes.
    pub fn corners(&self) -> &[u32] {
        match self {
            Self::Tet10(nodes) => &nodes[..4],
            Self::Wedge18(nodes) => &nodes[..6],
            Self::Hex27(nodes) => &nodes[..8],
            first_order => first_order.nodes(),
        }
    }

    /// Whether the shape functions are quadratic.
    pub fn is_second_order(&self) -> bool {
        matches!(self, Self::Tet10(_) | Self::Wedge18(_) | Self::Hex27(_))
    }

    /// The same element with other node numbers.
    pub fn map(self, number: impl FnMut(u32) -> u32) -> Self {
        match self {
            Self::Tet4(nodes) => Self::Tet4(nodes.map(number)),
            Self::Wedge6(nodes) => Self::Wedge6(nodes.map(number)),
            Self::Hex8(nodes) => Self::Hex8(nodes.map(number)),
            Self::Tet10(nodes) => Self::Tet10(nodes.map(number)),
            Self::Wedge18(nodes) => Self::Wedge18(nodes.map(number)),
            Self::Hex27(nodes) => Self::Hex27(nodes.map(number)),
        }
    }

    /// Number of faces.
    pub fn faces(&self) -> usize {
        match self {
            Self::Tet4(_) | Self::Tet10(_) => TET_FACES.len(),
            Self::Wedge6(_) | Self::Wedge18(_) => WEDGE_TRIANGLES.len() + WEDGE_QUADRILATERALS.len(),
            Self::Hex8(_) | Self::Hex27(_) => HEX_FACES.len(),
        }
    }

    /// All nodes of one face, counter-clockwise seen from outside: corners, then the middles of the
    /// edges from each corner to the next, then the centre.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn face(&self, face: usize) -> FaceNodes {
        let middle = |edges: &[[usize; 2]], a: usize, b: usize| {
            edges.iter().position(|&edge| edge == [a, b] || edge == [b, a]).expect("an edge of the face")
        };
        match self {
            Self::Tet10(nodes) => {
                let [a, b, c] = TET_FACES[face];
                let on = |a, b| 4 + middle(&TET_EDGES, a, b);
                FaceNodes::of(&[a, b, c, on(a, b), on(b, c), on(c, a)].map(|local| nodes[local]))
            }
            Self::Wedge18(nodes) => {
                let on = |a, b| 6 + middle(&WEDGE_EDGES, a, b);
                if let Some(&[a, b, c]) = WEDGE_TRIANGLES.get(face) {
                    return FaceNodes::of(&[a, b, c, on(a, b), on(b, c), on(c, a)].map(|local| nodes[local]));
                }
                let quadrilateral = face - WEDGE_TRIANGLES.len();
                let [a, b, c, d] = WEDGE_QUADRILATERALS[quadrilateral];
                let local = [a, b, c, d, on(a, b), on(b, c), on(c, d), on(d, a), 15 + quadrilateral];
                FaceNodes::of(&local.map(|local| nodes[local]))
            }
            Self::Hex27(nodes) => {
                let [a, b, c, d] = HEX_FACES[face];
                let on = |a, b| 8 + middle(&HEX_EDGES, a, b);
                let local = [a, b, c, d, on(a, b), on(b, c), on(c, d), on(d, a), HEX_FACE_CENTRES[face]];
                FaceNodes::of(&local.map(|local| nodes[local]))
            }
            first_order => first_order.side(face).into(),
        }
    }

    /// The facets of one face.
    pub fn sides_of(&self, face: usize) -> Range<usize> {
        let count = if self.is_second_order() { SUB_FACETS } else { 1 };
        count * face..count * (face + 1)
    }

    /// Number of facets: one for each face, four if the element is of second order.
    pub fn sides(&self) -> usize {
        self.sides_of(self.faces() - 1).end
    }

    /// Nodes of one facet, counter-clockwise seen from outside.
    ///
    /// # Panics
    /// If there is no such facet.
    pub fn side(&self, side: usize) -> FacetNodes {
        match self {
            Self::Tet4(nodes) => TET_FACES[side].map(|corner| nodes[corner]).into(),
            Self::Wedge6(nodes) => match side {
                0 | 1 => WEDGE_TRIANGLES[side].map(|corner| nodes[corner]).into(),
                _ => WEDGE_QUADRILATERALS[side - 2].map(|corner| nodes[corner]).into(),
            },
            Self::Hex8(nodes) => HEX_FACES[side].map(|corner| nodes[corner]).into(),
            Self::Tet10(_) | Self::Wedge18(_) | Self::Hex27(_) => {
                self.face(side / SUB_FACETS).facets()[side % SUB_FACETS]
            }
        }
    }

    /// Nodes of a hexahedron with the same map: the element's own, or those of a wedge by
    /// [`WEDGE_AS_HEX`]; `None` for tetrahedra and second-order elements.
    pub fn as_hex(&self) -> Option<[u32; 8]> {
        match self {
            Self::Tet4(_) | Self::Tet10(_) | Self::Wedge18(_) | Self::Hex27(_) => None,
            Self::Wedge6(nodes) => Some(WEDGE_AS_HEX.map(|corner| nodes[corner])),
            Self::Hex8(nodes) => Some(*nodes),
        }
    }
}

impl From<[u32; 4]> for Element {
    fn from(nodes: [u32; 4]) -> Self {
        Self::Tet4(nodes)
    }
}

impl From<[u32; 6]> for Element {
    fn from(nodes: [u32; 6]) -> Self {
        Self::Wedge6(nodes)
    }
}

impl From<[u32; 8]> for Element {
    fn from(nodes: [u32; 8]) -> Self {
        Self::Hex8(nodes)
    }
}

impl From<[u32; 10]> for Element {
    fn from(nodes: [u32; 10]) -> Self {
        Self::Tet10(nodes)
    }
}

impl From<[u32; 18]> for Element {
    fn from(nodes: [u32; 18]) -> Self {
        Self::Wedge18(nodes)
    }
}

impl From<[u32; 27]> for Element {
    fn from(nodes: [u32; 27]) -> Self {
        Self::Hex27(nodes)
    }
}

/// All nodes of a face of an element, 3, 4, 6 or 9; dereferences to a slice.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct FaceNodes {
    /// Beyond `count`: `u32::MAX`.
    nodes: [u32; 9],
    count: u8,
}

impl FaceNodes {
    fn of(from: &[u32]) -> Self {
        let mut nodes = [u32::MAX; 9];
        nodes[..from.len()].copy_from_slice(from);
        Self { nodes, count: from.len() as u8 }
    }

    /// The linear facets of which the face consists, in its winding.
    pub fn facets(&self) -> Vec<FacetNodes> {
        match **self {
            [_, _, _, _, _, _] => SUB_TRIANGLES.map(|facet| facet.map(|local| self.nodes[local]).into()).to_vec(),
            [_, _, _, _, _, _, _, _, _] => {
                SUB_QUADRILATERALS.map(|facet| facet.map(|local| self.nodes[local]).into()).to_vec()
            }
            _ => FacetNodes::new(self).into_iter().collect(),
        }
    }
}

impl From<FacetNodes> for FaceNodes {
    fn from(facet: FacetNodes) -> Self {
        Self::of(&facet)
    }
}

impl Deref for FaceNodes {
    type Target = [u32];

    #[inline]
    fn deref(&self) -> &[u32] {
        &self.nodes[..usize::from(self.count)]
    }
}

impl fmt::Debug for FaceNodes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

/// The three or four global node numbers of a triangle or quadrilateral, in its winding;
/// dereferences to a slice.
///
/// Ordered by the nodes, then by their number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FacetNodes {
    /// The fourth of a triangle is `u32::MAX`.
    nodes: [u32; 4],
    count: u8,
}

impl FacetNodes {
    /// The nodes of a triangle (three) or quadrilateral (four); `None` for any other number.
    pub fn new(nodes: &[u32]) -> Option<Self> {
        match *nodes {
            [a, b, c] => Some([a, b, c].into()),
            [a, b, c, d] => Some([a, b, c, d].into()),
            _ => None,
        }
    }

    /// The same facet with other node numbers.
    #[must_use]
    pub fn map(mut self, mut number: impl FnMut(u32) -> u32) -> Self {
        self.iter_mut().for_each(|node| *node = number(*node));
        self
    }

    /// The nodes in ascending order: the same for all windings of one face.
    #[must_use]
    pub fn sorted(mut self) -> Self {
        self.sort_unstable();
        self
    }

    /// The same winding, starting at another node.
    pub(crate) fn starting_at(mut self, node: u32) -> Option<Self> {
        let start = self.iter().position(|&n| n == node)?;
        self.rotate_left(start);
        Some(self)
    }

    /// The opposite winding, starting at the same node.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        self[1..].reverse();
        self
    }

    /// Coordinates of the nodes. \[L\]
    ///
    /// # Panics
    /// If a node has no coordinates.
    pub fn corners(&self, coordinates: &[[f64; 3]]) -> FacetCorners {
        let at = |node: u32| coordinates[node as usize];
        match **self {
            [a, b, c] => FacetCorners::Triangle([a, b, c].map(at)),
            _ => FacetCorners::Quadrilateral(self.nodes.map(at)),
        }
    }
}

/// Corner coordinates of a facet. \[L\]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FacetCorners {
    /// Three corners.
    Triangle([[f64; 3]; 3]),
    /// Four corners, of a bilinear facet.
    Quadrilateral([[f64; 3]; 4]),
}

impl From<[[f64; 3]; 3]> for FacetCorners {
    fn from(corners: [[f64; 3]; 3]) -> Self {
        Self::Triangle(corners)
    }
}

impl From<[[f64; 3]; 4]> for FacetCorners {
    fn from(corners: [[f64; 3]; 4]) -> Self {
        Self::Quadrilateral(corners)
    }
}

impl From<[u32; 3]> for FacetNodes {
    fn from([a, b, c]: [u32; 3]) -> Self {
        Self { nodes: [a, b, c, u32::MAX], count: 3 }
    }
}

impl From<[u32; 4]> for FacetNodes {
    fn from(nodes: [u32; 4]) -> Self {
        Self { nodes, count: 4 }
    }
}

impl Deref for FacetNodes {
    type Target = [u32];

    #[inline]
    fn deref(&self) -> &[u32] {
        &self.nodes[..usize::from(self.count)]
    }
}

impl DerefMut for FacetNodes {
    fn deref_mut(&mut self) -> &mut [u32] {
        &mut self.nodes[..usize::from(self.count)]
    }
}

impl<'a> IntoIterator for &'a FacetNodes {
    type Item = &'a u32;
    type IntoIter = std::slice::Iter<'a, u32>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl fmt::Debug for FacetNodes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}
