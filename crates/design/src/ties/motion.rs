//! Motions of space that map a symmetric body onto itself.

/// A rigid motion or a reflection. Lengths in \[L\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Reflection at the plane through a point; the nonzero normal need not be a unit vector.
    Mirror {
        /// A point on the plane.
        through: [f64; 3],
        /// Its normal.
        normal: [f64; 3],
    },
    /// Rotation by a fraction of a full turn about an axis.
    Rotation {
        /// A point on the axis.
        through: [f64; 3],
        /// Nonzero direction of the axis; need not be a unit vector.
        axis: [f64; 3],
        /// The rotation is 1/`folds` of a full turn; at least 1.
        folds: usize,
    },
    /// Translation by a vector.
    Translation([f64; 3]),
}

impl Motion {
    /// The image of a point under the motion.
    pub fn image(&self, point: [f64; 3]) -> [f64; 3] {
        match *self {
            Self::Mirror { through, normal } => {
                let normal = unit(normal);
                let twice = 2.0 * dot(difference(point, through), normal);
                std::array::from_fn(|k| point[k] - twice * normal[k])
            }
            Self::Rotation { through, axis, folds } => {
                // Rodrigues' formula
                let axis = unit(axis);
                let (sin, cos) = (std::f64::consts::TAU / folds as f64).sin_cos();
                let from = difference(point, through);
                let (along, across) = (dot(from, axis), cross(axis, from));
                std::array::from_fn(|k| through[k] + cos * from[k] + sin * across[k] + (1.0 - cos) * along * axis[k])
            }
            Self::Translation(step) => std::array::from_fn(|k| point[k] + step[k]),
        }
    }
}

/// The point's projection onto the plane through the origin that is normal to a direction.
pub(super) fn across(point: [f64; 3], direction: [f64; 3]) -> [f64; 3] {
    let direction = unit(direction);
    let along = dot(point, direction);
    std::array::from_fn(|k| point[k] - along * direction[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The unit vector along `a`; coordinate axes are returned exactly.
fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: [f64; 3], b: [f64; 3]) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-15), "{a:?} {b:?}");
    }

    #[test]
    fn images_by_hand() {
        let mirror = Motion::Mirror { through: [1.0, 0.0, 0.0], normal: [2.0, 0.0, 0.0] };
        assert_eq!(mirror.image([0.25, 3.0, 4.0]), [1.75, 3.0, 4.0]);
        let diagonal = Motion::Mirror { through: [0.0; 3], normal: [1.0, -1.0, 0.0] };
        close(diagonal.image([0.5, 2.0, 7.0]), [2.0, 0.5, 7.0]);
        // a quarter turn about z through (1, 1): x to y
        let quarter = Motion::Rotation { through: [1.0, 1.0, 0.0], axis: [0.0, 0.0, 3.0], folds: 4 };
        close(quarter.image([2.0, 1.0, 5.0]), [1.0, 2.0, 5.0]);
        assert_eq!(Motion::Translation([1.0, 0.0, -2.0]).image([0.5; 3]), [1.5, 0.5, -1.5]);
        assert_eq!(across([1.0, 2.0, 3.0], [0.0, 0.0, -1.0]), [1.0, 2.0, 0.0]);
    }
}
