//! The kinds of cells that mesh files hold.

macro_rules! cell_kinds {
    ($($variant:ident $name:literal $dimension:literal $nodes:literal,)+) => {
        /// The shape and order of a cell. Only [`CellKind::Tet4`] and [`CellKind::Hex8`] can become elements, only
        /// [`CellKind::Triangle3`] and [`CellKind::Quad4`] facets; the others are read so that they can be passed over,
        /// or named in an error.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum CellKind {
            $(#[doc = concat!("`", $name, "`")] $variant,)+
        }

        impl CellKind {
            /// Name with the number of nodes, like `hex8`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)+ }
            }

            /// 0 for points to 3 for solids.
            pub fn dimension(self) -> u8 {
                match self { $(Self::$variant => $dimension,)+ }
            }

            /// Number of nodes.
            pub fn node_count(self) -> usize {
                match self { $(Self::$variant => $nodes,)+ }
            }
        }
    };
}

cell_kinds! {
    Point "point" 0 1,
    Line2 "line2" 1 2,
    Line3 "line3" 1 3,
    Triangle3 "triangle3" 2 3,
    Triangle6 "triangle6" 2 6,
    Quad4 "quad4" 2 4,
    Quad8 "quad8" 2 8,
    Quad9 "quad9" 2 9,
    Tet4 "tet4" 3 4,
    Tet10 "tet10" 3 10,
    Pyramid5 "pyramid5" 3 5,
    Pyramid13 "pyramid13" 3 13,
    Pyramid14 "pyramid14" 3 14,
    Wedge6 "wedge6" 3 6,
    Wedge15 "wedge15" 3 15,
    Wedge18 "wedge18" 3 18,
    Hex8 "hex8" 3 8,
    Hex20 "hex20" 3 20,
    Hex27 "hex27" 3 27,
}

impl CellKind {
    /// What to do about a cell that can become neither an element nor a facet.
    pub(crate) fn cure(self) -> &'static str {
        match self {
            Self::Line3
            | Self::Triangle6
            | Self::Quad8
            | Self::Quad9
            | Self::Tet10
            | Self::Pyramid13
            | Self::Pyramid14
            | Self::Wedge15
            | Self::Wedge18
            | Self::Hex20
            | Self::Hex27 => {
                "second order is not supported: write first order (Gmsh: Mesh.ElementOrder = 1; Abaqus: C3D4, C3D8)"
            }
            _ => {
                "only tetrahedra and hexahedra are supported: mesh with tetrahedra, or by a transfinite or swept, recombined \
                 scheme, or name a `part` without others"
            }
        }
    }
}
