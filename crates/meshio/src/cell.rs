//! The kinds of cells in mesh files.

macro_rules! cell_kinds {
    ($($variant:ident $name:literal $label:literal $dimension:literal $nodes:literal $corners:ident,)+) => {
        /// The shape and order of a cell. Tetrahedra, wedges and hexahedra can become elements,
        /// triangles and quadrilaterals facets. The others are read so that they can be skipped or
        /// named in an error.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum CellKind {
            $(#[doc = concat!("`", $name, "`")] $variant,)+
        }

        impl CellKind {
            /// Name with the number of nodes, for instance `hex8`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)+ }
            }

            /// The name, with the name in Abaqus and CalculiX if there is one: `hex20 (C3D20)`.
            pub fn label(self) -> &'static str {
                match self { $(Self::$variant => $label,)+ }
            }

            /// From 0 for points to 3 for solids.
            pub fn dimension(self) -> u8 {
                match self { $(Self::$variant => $dimension,)+ }
            }

            /// Number of nodes.
            pub fn node_count(self) -> usize {
                match self { $(Self::$variant => $nodes,)+ }
            }

            /// The first-order cell with the same corners, which are the first nodes of any cell.
            pub fn first_order(self) -> Self {
                match self { $(Self::$variant => Self::$corners,)+ }
            }
        }
    };
}

cell_kinds! {
    Point "point" "point" 0 1 Point,
    Line2 "line2" "line2" 1 2 Line2,
    Line3 "line3" "line3" 1 3 Line2,
    Triangle3 "triangle3" "triangle3" 2 3 Triangle3,
    Triangle6 "triangle6" "triangle6" 2 6 Triangle3,
    Quad4 "quad4" "quad4" 2 4 Quad4,
    Quad8 "quad8" "quad8" 2 8 Quad4,
    Quad9 "quad9" "quad9" 2 9 Quad4,
    Tet4 "tet4" "tet4 (C3D4)" 3 4 Tet4,
    Tet10 "tet10" "tet10 (C3D10)" 3 10 Tet4,
    Pyramid5 "pyramid5" "pyramid5 (C3D5)" 3 5 Pyramid5,
    Pyramid13 "pyramid13" "pyramid13" 3 13 Pyramid5,
    Pyramid14 "pyramid14" "pyramid14" 3 14 Pyramid5,
    Wedge6 "wedge6" "wedge6 (C3D6)" 3 6 Wedge6,
    Wedge15 "wedge15" "wedge15 (C3D15)" 3 15 Wedge6,
    Wedge18 "wedge18" "wedge18 (C3D15V)" 3 18 Wedge6,
    Hex8 "hex8" "hex8 (C3D8)" 3 8 Hex8,
    Hex20 "hex20" "hex20 (C3D20)" 3 20 Hex8,
    Hex27 "hex27" "hex27 (C3D27)" 3 27 Hex8,
}

/// How to make second-order elements usable.
const FIRST_ORDER: &str = "`first_order = true` in the body's `mesh` drops mid-side nodes; or write first-order \
                           elements (Gmsh: Mesh.ElementOrder = 1; Abaqus: C3D4, C3D6, C3D8)";

impl CellKind {
    /// Whether the cell has nodes other than its corners.
    pub fn is_second_order(self) -> bool {
        self.first_order() != self
    }

    /// Whether the cell can become an element.
    pub fn is_element(self) -> bool {
        self.dimension() == 3 && self.first_order() != Self::Pyramid5
    }

    /// What to do about a cell that can become neither an element nor a facet.
    pub(crate) fn cure(self) -> &'static str {
        match self.first_order() {
            Self::Pyramid5 => {
                "pyramids are not supported: use only hexahedra, wedges or tetrahedra, or name a `part` without \
                 pyramids"
            }
            _ if self.is_second_order() => FIRST_ORDER,
            _ => "surfaces must consist of triangles and quadrilaterals, bodies of tetrahedra, wedges and hexahedra",
        }
    }
}
