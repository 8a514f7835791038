//! Symbols for what holds and moves bodies: cones at supports, arrows, planes of symmetry.

use super::RenderError;
use super::colour::Colour;
use super::error::check_finite;
use super::scene::Scene;
use super::space::{Vector, cross, dot, subtract, unit};

/// A symbol in a scene. \[L\]
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A small cone that touches a point which cannot move towards it.
    Support {
        /// The point.
        at: [f64; 3],
        /// From the point to the base of the cone.
        outward: [f64; 3],
    },
    /// An arrow along joined points, for a prescribed motion.
    Motion {
        /// The points; the arrow's head is at the last one.
        path: Vec<[f64; 3]>,
        /// Text at its start.
        label: String,
    },
    /// An arrow along joined points, for a force or pressure.
    Force {
        /// The points; the arrow's head is at the last one.
        path: Vec<[f64; 3]>,
        /// Text at its start.
        label: String,
    },
    /// The corners of a piece of a plane of symmetry.
    Plane([[f64; 3]; 4]),
}

impl Mark {
    /// The positions between which it lies, except for its thickness.
    fn points(&self) -> Vec<[f64; 3]> {
        match self {
            Self::Support { at, outward } => vec![*at, *outward],
            Self::Motion { path, .. } | Self::Force { path, .. } => path.clone(),
            Self::Plane(corners) => corners.to_vec(),
        }
    }
}

/// Colours of supports, motions and forces, which differ from those of bodies and fields.
const SUPPORT: Colour = Colour([92, 99, 112]);
const MOTION: Colour = Colour([213, 94, 0]);
const FORCE: Colour = Colour([0, 114, 178]);

/// Lengths of a cone and of an arrow's head, and the radii of these and of a shaft, relative to the size of the bodies.
const CONE: f64 = 0.022;
const HEAD: f64 = 0.036;
const SHAFT: f64 = 0.005;

/// Length of a straight arrow relative to the size of the bodies.
pub(crate) const ARROW: f64 = 0.13;

/// Sides of cones and shafts.
const SIDES: u32 = 20;

/// A text at a position, away from a second one.
#[derive(Debug, Clone)]
pub(super) struct Label {
    pub text: String,
    pub at: Vector,
    pub from: Vector,
    pub colour: Colour,
}

impl Scene<'_> {
    /// Adds a symbol, as large as suits bodies of this size. \[L\]
    ///
    /// # Errors
    /// [`RenderError::NotFinite`].
    pub fn add_mark(&mut self, mark: &Mark, size: f64) -> Result<(), RenderError> {
        check_finite("mark", mark.points().into_iter().flatten().chain([size]))?;
        match mark {
            Mark::Support { at, outward } => {
                let base = along(*at, CONE * size, unit(*outward));
                self.turn(&[(*at, 0.0), (base, 0.42 * CONE * size), (base, 0.0)], SUPPORT)
            }
            Mark::Motion { path, label } => self.arrow(path, label, MOTION, size),
            Mark::Force { path, label } => self.arrow(path, label, FORCE, size),
            Mark::Plane(corners) => {
                (0..4).for_each(|k| self.chains.push([corners[k], corners[(k + 1) % 4]]));
                Ok(())
            }
        }
    }

    fn arrow(&mut self, path: &[Vector], text: &str, colour: Colour, size: f64) -> Result<(), RenderError> {
        let [.., before, tip] = path else { return Ok(()) };
        let direction = unit(subtract(*tip, *before));
        let neck = along(*tip, -HEAD * size, direction);
        let mut shaft: Vec<Vector> = path[..path.len() - 1].to_vec();
        // a shaft that ends within the head
        shaft.retain(|at| dot(subtract(neck, *at), direction) > 0.0 || path.len() > 2);
        shaft.push(neck);
        for pair in shaft.windows(2) {
            let radius = SHAFT * size;
            self.turn(&[(pair[0], 0.0), (pair[0], radius), (pair[1], radius), (pair[1], 0.0)], colour)?;
        }
        self.turn(&[(neck, 0.0), (neck, 0.4 * HEAD * size), (*tip, 0.0)], colour)?;
        if !text.is_empty() {
            self.labels.push(Label { text: text.to_owned(), at: path[0], from: *tip, colour });
        }
        Ok(())
    }

    /// Adds the surface that a profile of centres and radii gives around its axis.
    fn turn(&mut self, profile: &[(Vector, f64)], colour: Colour) -> Result<(), RenderError> {
        let axis =
            profile.windows(2).map(|pair| unit(subtract(pair[1].0, pair[0].0))).find(|axis| dot(*axis, *axis) > 0.5);
        let Some(axis) = axis else { return Ok(()) };
        let least = (0..3).min_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs())).unwrap_or(0);
        let mut other = [0.0; 3];
        other[least] = 1.0;
        let across = unit(cross(axis, other));
        let upward = cross(axis, across);
        let first = self.points.len() as u32;
        for (centre, radius) in profile {
            self.points.extend((0..SIDES).map(|k| -> Vector {
                let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / f64::from(SIDES)).sin_cos();
                std::array::from_fn(|c| centre[c] + radius * (cosine * across[c] + sine * upward[c]))
            }));
        }
        let mut triangles = Vec::new();
        for ring in 0..profile.len() as u32 - 1 {
            let node = |ring: u32, k: u32| first + ring * SIDES + k % SIDES;
            for k in 0..SIDES {
                // a ring without a radius is a point
                if profile[ring as usize].1 > 0.0 {
                    triangles.push([node(ring, k), node(ring, k + 1), node(ring + 1, k)]);
                }
                if profile[ring as usize + 1].1 > 0.0 {
                    triangles.push([node(ring, k + 1), node(ring + 1, k + 1), node(ring + 1, k)]);
                }
            }
        }
        self.add_surface(&triangles, colour)
    }
}

/// A position, moved by a length in a direction.
fn along(at: Vector, length: f64, direction: Vector) -> Vector {
    std::array::from_fn(|c| at[c] + length * direction[c])
}

/// The size of the box around some positions: its diagonal.
pub(crate) fn diagonal(points: impl IntoIterator<Item = [f64; 3]>) -> f64 {
    let start = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let [low, high] = points.into_iter().fold(start, |[low, high], x| {
        [std::array::from_fn(|c| low[c].min(x[c])), std::array::from_fn(|c| high[c].max(x[c]))]
    });
    let sides = subtract(high, low);
    if sides[0] >= 0.0 { dot(sides, sides).sqrt() } else { 0.0 }
}
