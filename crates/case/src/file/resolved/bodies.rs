//! Bodies.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::{MeshFile, Region};
pub use slipstick_solid::{Formulation, LawKind, Material};

/// A body: shape, placement, material.
#[derive(Debug, Clone, PartialEq, JsonSchema)]
pub struct Body {
    /// Unique name; the body's surfaces are called `{name}_{face}`.
    pub name: String,
    /// Shape and mesh.
    #[serde(flatten)]
    pub shape: Shape,
    /// Placement of the shape, which is generated in its own frame.
    pub place: Placement,
    /// That it does not deform; its motion has six unknowns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rigid: Option<Rigid>,
    /// Mass per reference volume of the solid, on which gravity and rotation act; > 0 if given. \[M/L³\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_density: Option<f64>,
    /// Coefficient of thermal expansion α: a change ΔT of the temperature stretches by 1 + α ΔT.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_expansion: Option<f64>,
    /// The material of the solid (density 1). For a rigid body that of the stiffest other body, from
    /// which default stiffnesses of contact follow.
    pub material: Material,
    /// A line about which the axes of an orthotropic material turn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes_about: Option<AxesAbout>,
    /// Regions of the body with other materials; where they overlap, the last one counts.
    #[serde(rename = "section")]
    pub sections: Vec<BodySection>,
    /// How its elements are integrated.
    pub element: Formulation,
    /// Shape functions of its hexahedra and wedges of second order.
    #[serde(skip_serializing_if = "ShapeFunctions::are_lagrange")]
    pub shape_functions: ShapeFunctions,
    /// 1: the elements of the shape, linear ones or those of the mesh file; 2: linear ones get
    /// mid-side nodes, so that hexahedra have 27 nodes, wedges 18 and tetrahedra 10. The new nodes of curved
    /// shapes lie on the true shape, those of meshes from files midway.
    pub order: u8,
}

/// A rigid body is written without material and element, which the reader refuses there.
impl Serialize for Body {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Written<'a> {
            name: &'a str,
            #[serde(flatten)]
            shape: &'a Shape,
            place: Placement,
            #[serde(skip_serializing_if = "Option::is_none")]
            rigid: Option<Rigid>,
            #[serde(skip_serializing_if = "Option::is_none")]
            mass_density: Option<f64>,
            #[serde(skip_serializing_if = "Option::is_none")]
            thermal_expansion: Option<f64>,
            #[serde(skip_serializing_if = "Option::is_none")]
            material: Option<Material>,
            #[serde(skip_serializing_if = "Option::is_none")]
            axes_about: Option<AxesAbout>,
            #[serde(rename = "section", skip_serializing_if = "<[BodySection]>::is_empty")]
            sections: &'a [BodySection],
            #[serde(skip_serializing_if = "Option::is_none")]
            element: Option<Formulation>,
            #[serde(skip_serializing_if = "ShapeFunctions::are_lagrange")]
            shape_functions: ShapeFunctions,
            order: u8,
        }
        let Self { name, shape, place, rigid, mass_density, thermal_expansion, material, sections, axes_about, .. } =
            self;
        let Self { element, shape_functions, order, .. } = self;
        let deforms = rigid.is_none();
        let (material, element) = (deforms.then_some(*material), deforms.then_some(*element));
        let (place, rigid, shape_functions, order) = (*place, *rigid, *shape_functions, *order);
        let (mass_density, thermal_expansion, axes_about) = (*mass_density, *thermal_expansion, *axes_about);
        let first = Written {
            name,
            shape,
            place,
            rigid,
            mass_density,
            thermal_expansion,
            material,
            axes_about,
            sections,
            element,
            shape_functions,
            order,
        };
        first.serialize(serializer)
    }
}

impl Body {
    /// Whether a part of it has mass.
    pub fn has_mass(&self) -> bool {
        self.mass_density.is_some() || self.sections.iter().any(|section| section.mass_density.is_some())
    }

    /// Whether a part of it expands with temperature.
    pub fn expands(&self) -> bool {
        let of = |expansion: Option<f64>| expansion.is_some_and(|alpha| alpha != 0.0);
        of(self.thermal_expansion) || self.sections.iter().any(|section| of(section.thermal_expansion))
    }

    /// Its materials: its own, and those of its sections.
    pub fn materials(&self) -> impl Iterator<Item = &Material> {
        std::iter::once(&self.material).chain(self.sections.iter().map(|section| &section.material))
    }
}

/// Shape functions of hexahedra and wedges of second order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeFunctions {
    /// Those of 27 and 18 nodes.
    #[default]
    Lagrange,
    /// Those of 20 and 15 nodes. The nodes at the centres of elements and faces follow from the others, in the mesh and
    /// at each displacement; but the centres of slave faces with multipliers are free.
    Serendipity,
}

impl ShapeFunctions {
    /// Whether they are those of all nodes.
    pub fn are_lagrange(&self) -> bool {
        *self == Self::Lagrange
    }
}

/// A region of a body with a material of its own.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BodySection {
    /// The elements whose centroids lie in it.
    pub region: Region,
    /// Their material.
    pub material: Material,
    /// Their mass per reference volume; `None`: that of the body. > 0 \[M/L³\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_density: Option<f64>,
    /// Their coefficient of thermal expansion; `None`: that of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_expansion: Option<f64>,
    /// A line about which the axes of their orthotropic material turn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes_about: Option<AxesAbout>,
}

/// A line about which the axes of an orthotropic material turn: the components of its `axis1` and
/// `axis2` are radial, tangential and axial, at the centroid of each element.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct AxesAbout {
    /// A point on the line. \[L\]
    pub point: [f64; 3],
    /// Its direction, of any length.
    pub direction: [f64; 3],
}

/// A rigid body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Rigid {
    /// Reference point, whose displacement and rotation are the unknowns, after placement; default:
    /// the centre of its bounding box. \[L\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<[f64; 3]>,
}

/// The shapes that can be meshed, and meshes from files. y is up; lengths in \[L\].
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// An axis-aligned box. Faces `xmin xmax ymin ymax zmin zmax`.
    Box {
        /// Lowest corner.
        min: [f64; 3],
        /// Highest corner; greater than `min` in every direction.
        max: [f64; 3],
        /// Elements along x, y, z; at least 1.
        elements: [usize; 3],
        /// Ratio of the last to the first element size, per direction; 1 is uniform.
        grading: [f64; 3],
    },
    /// A solid half-ball, dome down (−y), with the centre of its flat face at the origin. Faces
    /// `flat dome`.
    HalfBall {
        /// Radius.
        radius: f64,
        /// `[n, h, m]`: the core is n × n × h elements (h downward), wrapped by m layers:
        /// n²h + m(n² + 4nh) elements.
        elements: [usize; 3],
    },
    /// A hollow cylinder about the y axis, from y = 0 to `height`. Faces `bottom top inner outer`.
    HollowCylinder {
        /// Inner radius.
        inner_radius: f64,
        /// Outer radius.
        outer_radius: f64,
        /// Height.
        height: f64,
        /// Elements radially, around (at least 3), axially.
        elements: [usize; 3],
    },
    /// The lower half (y ≤ 0) of a ring about the z axis. Faces `outer inner ends zmin zmax`.
    HalfRing {
        /// Outer radius.
        outer_radius: f64,
        /// Inner radius.
        inner_radius: f64,
        /// Width along z, from −width/2 to width/2.
        width: f64,
        /// Elements around (at least 2), radially, across (along z).
        elements: [usize; 3],
    },
    /// A solid ball centred at the origin. Face `side`.
    Ball {
        /// Radius.
        radius: f64,
        /// `[n, h, m]`: each half is a half-ball of these numbers.
        elements: [usize; 3],
    },
    /// A solid truncated cone about the y axis, from y = 0 to `height`; a cylinder if the radii are
    /// equal. Faces `bottom top side`.
    Cone {
        /// Radius at y = 0.
        bottom_radius: f64,
        /// Radius at y = `height`.
        top_radius: f64,
        /// Height.
        height: f64,
        /// `[n, m, k]`: a core of n × n elements in m rings, in k layers along the axis.
        elements: [usize; 3],
    },
    /// A torus about the y axis, centred at the origin. Face `side`.
    Torus {
        /// Distance of the tube's centre from the axis.
        radius: f64,
        /// Radius of the tube.
        tube_radius: f64,
        /// `[n, m, k]`: a core of n × n elements in m rings, k times around the axis (at least 3).
        elements: [usize; 3],
    },
    /// A mesh from a file, with its surfaces and node sets.
    Mesh(MeshFile),
}

impl Shape {
    /// The key that names the shape in the case file.
    pub fn key(&self) -> &'static str {
        match self {
            Self::Box { .. } => "box",
            Self::HalfBall { .. } => "half_ball",
            Self::HollowCylinder { .. } => "hollow_cylinder",
            Self::HalfRing { .. } => "half_ring",
            Self::Ball { .. } => "ball",
            Self::Cone { .. } => "cone",
            Self::Torus { .. } => "torus",
            Self::Mesh(_) => "mesh",
        }
    }

    /// The faces of this shape's mesh; its surfaces are called `{body}_{face}`. Empty for a mesh
    /// from a file, which has its own surfaces.
    pub fn faces(&self) -> &'static [&'static str] {
        match self {
            Self::Box { .. } => &["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"],
            Self::HalfBall { .. } => &["flat", "dome"],
            Self::HollowCylinder { .. } => &["bottom", "top", "inner", "outer"],
            Self::HalfRing { .. } => &["outer", "inner", "ends", "zmin", "zmax"],
            Self::Ball { .. } | Self::Torus { .. } => &["side"],
            Self::Cone { .. } => &["bottom", "top", "side"],
            Self::Mesh(_) => &[],
        }
    }

    /// Number of elements in the mesh of this shape; `None` if it overflows.
    pub fn element_count(&self) -> Option<usize> {
        match *self {
            Self::Box { elements, .. } | Self::HollowCylinder { elements, .. } | Self::HalfRing { elements, .. } => {
                elements.iter().try_fold(1usize, |product, &n| product.checked_mul(n))
            }
            Self::HalfBall { elements, .. } => half_ball_elements(elements),
            Self::Ball { elements, .. } => half_ball_elements(elements)?.checked_mul(2),
            Self::Cone { elements: [n, m, k], .. } | Self::Torus { elements: [n, m, k], .. } => {
                n.checked_mul(n)?.checked_add(n.checked_mul(m)?.checked_mul(4)?)?.checked_mul(k)
            }
            Self::Mesh(ref file) => Some(file.mesh.elements.len()),
        }
    }

    /// Number of nodes in the mesh of this shape; rounded if it is large.
    pub fn node_count(&self) -> f64 {
        match *self {
            Self::Box { elements, .. } | Self::HalfRing { elements, .. } => {
                elements.iter().map(|&n| n as f64 + 1.0).product()
            }
            Self::HollowCylinder { elements: [radial, around, axial], .. } => {
                (radial as f64 + 1.0) * around as f64 * (axial as f64 + 1.0)
            }
            Self::HalfBall { elements, .. } => half_ball_nodes(elements),
            Self::Ball { elements, .. } => {
                let [n, _, m] = elements.map(|n| n as f64);
                // the halves share a disc
                2.0 * half_ball_nodes(elements) - (n + 1.0) * (n + 1.0) - 4.0 * n * m
            }
            Self::Cone { elements: [n, m, k], .. } => disc_nodes(n, m) * (k as f64 + 1.0),
            Self::Torus { elements: [n, m, k], .. } => disc_nodes(n, m) * k as f64,
            Self::Mesh(ref file) => file.mesh.nodes.len() as f64,
        }
    }
}

fn half_ball_elements([n, h, m]: [usize; 3]) -> Option<usize> {
    let square = n.checked_mul(n)?;
    let layer = square.checked_add(n.checked_mul(h)?.checked_mul(4)?)?;
    square.checked_mul(h)?.checked_add(m.checked_mul(layer)?)
}

/// The nodes of the core, plus its boundary without the flat face once for every layer.
fn half_ball_nodes(elements: [usize; 3]) -> f64 {
    let [n, h, m] = elements.map(|n| n as f64);
    let square = (n + 1.0) * (n + 1.0);
    square * (h + 1.0) + m * (square + 4.0 * n * h)
}

/// The nodes of a square core in m rings.
fn disc_nodes(n: usize, m: usize) -> f64 {
    (n as f64 + 1.0).powi(2) + 4.0 * n as f64 * m as f64
}

/// Rotation about the origin, then translation.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct Placement {
    /// The rotation; `None`: no rotation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotate: Option<Rotate>,
    /// The translation. \[L\]
    pub translate: [f64; 3],
}

/// A rotation about an axis through the origin, right-handed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Rotate {
    /// Direction of the axis; need not be a unit vector, is not zero.
    pub axis: [f64; 3],
    /// Angle in degrees.
    pub degrees: f64,
}

/// An axis-aligned region of the reference configuration, bounds included. \[L\]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct BoxRegion {
    /// Lowest corner.
    pub min: [f64; 3],
    /// Highest corner; at or above `min` in every direction.
    pub max: [f64; 3],
}

impl BoxRegion {
    /// Whether the point is in the region, bounds included.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        (0..3).all(|i| self.min[i] <= point[i] && point[i] <= self.max[i])
    }
}
