//! Prescribed data along the load path: displacements, rotations, loads, symmetry planes; and displacements
//! that follow from others.

pub(in crate::equations) mod approach;
pub(in crate::equations) mod dependent;
pub mod linear;
pub(in crate::equations) mod loose;
pub mod prescribed;
pub(in crate::equations) mod restraints;
pub(in crate::equations) mod rigid;
pub(in crate::equations) mod rotation;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

/// A coordinate direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// x, index 0.
    X,
    /// y (up), index 1.
    Y,
    /// z, index 2.
    Z,
}

impl Component {
    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// A symmetry plane: the bodies lie on one side of it, and their mirror image on the other side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Symmetry {
    /// The axis normal to it.
    pub normal: Component,
    /// Its coordinate along that axis. \[L\]
    pub at: f64,
}

/// A prescribed displacement of a set of nodes; without a motion, the nodes are held.
#[derive(Debug, Clone, PartialEq, JsonSchema)]
pub struct Dirichlet {
    /// Surface or node set.
    pub set: String,
    /// The load case in which it acts; `None`: in all. In the others, the nodes are held if nothing
    /// else moves them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_case: Option<String>,
    /// The prescribed components, ascending and unique; the others are free.
    #[schemars(with = "Vec<Motion>")]
    pub components: Vec<Component>,
    /// For a rigid body: the prescribed components of its rotation vector, ascending and unique.
    #[schemars(skip)]
    pub rotations: Vec<Component>,
    /// Waypoints; linear in between, starting at rest at t = 0; constant after the last one. Empty:
    /// held.
    pub motion: Vec<Waypoint>,
    /// The axis of rotation for the waypoints' angles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<RotationAxis>,
    /// Pseudo-time from which it acts, 0 ≤ t < 1. If that is not 0, the nodes are free before; then they move from
    /// where they are to the first waypoint, or stay there if there is none.
    pub from: f64,
    /// When it ends, if it does.
    #[schemars(with = "Option<f64>")]
    pub until: Option<Until>,
}

/// The end of a support: it holds until a pseudo-time, and lets go over the next load step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Until {
    /// Until when it holds, 0 < t ≤ 1.
    pub t: f64,
    /// When the nodes are free.
    pub released: f64,
}

/// A component as a case file writes it: of the translation, or of a rigid body's rotation.
#[derive(Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Motion {
    X,
    Y,
    Z,
    Rx,
    Ry,
    Rz,
}

/// Translations and rotations are written as one list of components, as in case files.
impl Serialize for Dirichlet {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Written<'a> {
            set: &'a str,
            #[serde(skip_serializing_if = "Option::is_none")]
            load_case: &'a Option<String>,
            components: Vec<Motion>,
            motion: &'a [Waypoint],
            #[serde(skip_serializing_if = "Option::is_none")]
            rotation: &'a Option<RotationAxis>,
            #[serde(skip_serializing_if = "Option::is_none")]
            from: Option<f64>,
            #[serde(skip_serializing_if = "Option::is_none")]
            until: Option<f64>,
        }
        let Self { set, load_case, components, rotations, motion, rotation, from, until } = self;
        let (from, until) = ((*from > 0.0).then_some(*from), until.map(|until| until.t));
        let along = components.iter().map(|component| match component {
            Component::X => Motion::X,
            Component::Y => Motion::Y,
            Component::Z => Motion::Z,
        });
        let about = rotations.iter().map(|component| match component {
            Component::X => Motion::Rx,
            Component::Y => Motion::Ry,
            Component::Z => Motion::Rz,
        });
        let components = along.chain(about).collect();
        Written { set, load_case, components, motion, rotation, from, until }.serialize(serializer)
    }
}

impl Dirichlet {
    /// Displacement \[L\] and angle \[degrees\] at pseudo-time `t`.
    ///
    /// Piecewise linear through (0, 0) and the waypoints; constant after the last one. The rotation
    /// is applied first, then the displacement.
    pub fn at(&self, t: f64) -> ([f64; 3], f64) {
        let mut last = Waypoint { t: 0.0, u: [0.0; 3], angle: 0.0 };
        for &next in &self.motion {
            if t <= next.t {
                let s = ((t - last.t) / (next.t - last.t)).clamp(0.0, 1.0);
                let mix = |a: f64, b: f64| if s == 1.0 { b } else { a + s * (b - a) };
                let u = std::array::from_fn(|i| mix(last.u[i], next.u[i]));
                return (u, mix(last.angle, next.angle));
            }
            last = next;
        }
        (last.u, last.angle)
    }
}

/// A waypoint of a prescribed motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Waypoint {
    /// Pseudo-time, 0 < t ≤ 1, increasing.
    pub t: f64,
    /// Displacement of the whole set from the reference configuration, in addition to the
    /// rotation. \[L\]
    pub u: [f64; 3],
    /// Angle from the reference configuration, in degrees, right-handed about the axis.
    pub angle: f64,
}

/// A load on a surface, a rigid body or the mass of bodies; along the path, its value is multiplied by `amplitude`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Load {
    /// The surface, or the name of the rigid body; empty for loads on mass.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub surface: String,
    /// The body on whose mass the load acts; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// The load case in which it acts; `None`: in all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_case: Option<String>,
    /// The kind of load and its value.
    #[serde(flatten)]
    pub kind: LoadKind,
    /// Waypoints; linear in between, starting from 0 at t = 0; constant after the last one.
    pub amplitude: Vec<AmplitudePoint>,
}

impl Load {
    /// What it acts on: a surface or body, or `all bodies`.
    pub fn target(&self) -> &str {
        match &self.body {
            Some(body) => body,
            None if self.surface.is_empty() => "all bodies",
            None => &self.surface,
        }
    }

    /// Whether it acts on the mass of bodies.
    pub fn acts_on_mass(&self) -> bool {
        matches!(self.kind, LoadKind::Gravity(_) | LoadKind::Centrifugal(_))
    }

    /// The factor at pseudo-time `t`: piecewise linear through (0, 0) and the waypoints.
    pub fn factor(&self, t: f64) -> f64 {
        factor(&self.amplitude, t)
    }
}

/// The factor of an amplitude at pseudo-time `t`: piecewise linear through (0, 0) and the waypoints.
pub(in crate::equations) fn factor(amplitude: &[AmplitudePoint], t: f64) -> f64 {
    let mut last = AmplitudePoint { t: 0.0, factor: 0.0 };
    for &next in amplitude {
        if t < next.t {
            return last.factor + (t - last.t) / (next.t - last.t) * (next.factor - last.factor);
        }
        last = next;
    }
    last.factor
}

/// A change of the temperature; along the path, it is multiplied by `amplitude`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Temperature {
    /// The body; `None`: all, or the nodes of a set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Surface or node set; elements have the mean of their nodes, where other nodes count as unchanged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<String>,
    /// The load case in which it acts; `None`: in all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_case: Option<String>,
    /// Change of the temperature from that at which the bodies are free of stress.
    pub change: f64,
    /// Waypoints; linear in between, starting from 0 at t = 0; constant after the last one.
    pub amplitude: Vec<AmplitudePoint>,
}

/// The kind of a load on a surface, and its value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadKind {
    /// Acts on the deformed surface against its outward normal, per deformed area. \[F/L²\]
    Pressure(f64),
    /// Dead load of fixed direction, per reference area. \[F/L²\]
    Traction([f64; 3]),
    /// Resultant of a dead load that is spread evenly over the reference area, or acts at the reference
    /// point of a rigid body. \[F\]
    Force([f64; 3]),
    /// Moment on a rigid body. It is conjugate to the rotation vector θ, its work is ∫ m·dθ: a moment
    /// about a fixed axis while the body turns about this axis. \[F L\]
    Moment([f64; 3]),
    /// Dead load: this force on each node of a set. \[F\]
    NodalForce([f64; 3]),
    /// Acceleration of gravity, which acts on mass. \[L/T²\]
    Gravity([f64; 3]),
    /// Centrifugal force of a steady rotation, which acts on mass; the amplitude is a factor on ω².
    Centrifugal(Centrifugal),
}

/// A steady rotation. The centrifugal force grows with the current distance from the axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Centrifugal {
    /// A point on the axis, which stays where it is. \[L\]
    pub point: [f64; 3],
    /// The direction of the axis; need not be a unit vector, is not zero.
    pub direction: [f64; 3],
    /// Angular velocity ω, in radians per unit of time. \[1/T\]
    pub angular_velocity: f64,
}

/// A waypoint of a load's amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct AmplitudePoint {
    /// Pseudo-time, 0 < t ≤ 1, increasing.
    pub t: f64,
    /// Factor on the load's value.
    pub factor: f64,
}

/// The axis of a prescribed rotation, in the reference configuration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct RotationAxis {
    /// A point on it. \[L\]
    pub point: [f64; 3],
    /// Its direction; need not be a unit vector, is not zero.
    pub direction: [f64; 3],
}
