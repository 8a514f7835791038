//! Symmetry planes, supports, motions, loads and the load path.

use schemars::JsonSchema;
use serde::Serialize;

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

/// A symmetry plane: the bodies are those on one side of it, and what is on the other side is their mirror image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Symmetry {
    /// The axis that it stands across.
    pub normal: Component,
    /// Its coordinate along that axis. \[L\]
    pub at: f64,
}

/// A load case: from rest, along a load path of its own, of the same bodies and design.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LoadCase {
    /// Unique name.
    pub name: String,
    /// What its part of the objective is multiplied by, > 0.
    pub weight: f64,
}

/// A prescribed displacement of a set of nodes; without motion: held.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Dirichlet {
    /// Surface or node set.
    pub set: String,
    /// The load case in which it acts; `None`: in all. In the others, the nodes are held if nothing else moves them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_case: Option<String>,
    /// The components prescribed, ascending and unique; the others are free.
    pub components: Vec<Component>,
    /// Way points, piecewise linear in time from rest at t = 0; empty: held. After the last one, as there.
    pub motion: Vec<Waypoint>,
    /// The axis that the way points' angles turn about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<RotationAxis>,
}

impl Dirichlet {
    /// Displacement \[L\] and angle \[degrees\] at pseudo-time `t`.
    ///
    /// Piecewise linear through (0, 0) and the way points; constant after the last one. The rotation comes first,
    /// then the displacement.
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

/// A point of a prescribed motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Waypoint {
    /// Pseudo-time, 0 < t ≤ 1, increasing.
    pub t: f64,
    /// Displacement from the reference configuration (of the whole set, besides the rotation). \[L\]
    pub u: [f64; 3],
    /// Angle from the reference configuration, in degrees, right-handed about the axis.
    pub angle: f64,
}

/// A load on a surface, along the path `amplitude` times the value.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Load {
    /// The surface.
    pub surface: String,
    /// The load case in which it acts; `None`: in all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_case: Option<String>,
    /// What acts.
    #[serde(flatten)]
    pub kind: LoadKind,
    /// Way points, piecewise linear in time from 0 at t = 0; constant after the last one.
    pub amplitude: Vec<AmplitudePoint>,
}

impl Load {
    /// The factor at pseudo-time `t`: piecewise linear through (0, 0) and the way points.
    pub fn factor(&self, t: f64) -> f64 {
        let mut last = AmplitudePoint { t: 0.0, factor: 0.0 };
        for &next in &self.amplitude {
            if t < next.t {
                return last.factor + (t - last.t) / (next.t - last.t) * (next.factor - last.factor);
            }
            last = next;
        }
        last.factor
    }
}

/// What acts on a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadKind {
    /// On the deformed surface, against its outward normal, per deformed area. \[F/L²\]
    Pressure(f64),
    /// Dead load of fixed direction, per reference area. \[F/L²\]
    Traction([f64; 3]),
    /// Resultant of a dead load that is spread evenly over the reference area. \[F\]
    Force([f64; 3]),
}

/// A point of a load's course.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct AmplitudePoint {
    /// Pseudo-time, 0 < t ≤ 1, increasing.
    pub t: f64,
    /// What multiplies the load's value.
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

/// Steps of pseudo-time from 0 to 1, and Newton's method in each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct LoadPath {
    /// Number N ≥ 1 of equal steps, of each load case.
    pub steps: usize,
    /// When Newton's iteration has converged.
    pub tolerance: Tolerance,
    /// Newton iterations before a step counts as failed.
    pub max_newton_iterations: usize,
    /// How often a failed step's increment may be halved.
    pub max_cutbacks: usize,
    /// Where Newton's iteration starts.
    pub start_values: StartValues,
}

/// Where Newton's iteration starts in a step. The solution does not depend on it, beyond the tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StartValues {
    /// In an optimization at the last state plus the increment of the previous design, else extrapolated.
    PreviousDesign,
    /// On the line through the last two states while the motion goes on as before, else at the last state.
    Extrapolated,
    /// At the last state.
    LastState,
}

/// Newton's tolerances: relative ones hold throughout, absolute ones where given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Tolerance {
    /// Bound on every norm relative to its own scale in the step. Unit-free.
    pub relative: f64,
    /// Absolute bound on the norm of the force residual (ε_res). \[F\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// Absolute bound on the norm of the displacement increment (ε_disp). \[L\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<f64>,
    /// Absolute bound on the norm of the contact residual (ε_con).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<f64>,
    /// Absolute bound on the norm of the multiplier increment (ε_LMM). \[F/L²\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub multiplier: Option<f64>,
}
