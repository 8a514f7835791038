//! The distance of a quantity from given points over pseudo-time.

/// Points (t, value) that a quantity should pass through.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    points: Vec<(f64, f64)>,
    /// Largest magnitude of the values.
    size: f64,
}

/// Why points do not form a curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// There is no point.
    #[error("the curve has no point")]
    Empty,
    /// A time is not positive or not above the one before.
    #[error("the times of the curve must be above 0 and ascending; {time} is not")]
    Time {
        /// The time.
        time: f64,
    },
    /// A value is not finite.
    #[error("a value of the curve is {value}, which is not a finite number")]
    Value {
        /// The value.
        value: f64,
    },
    /// All values are zero, so there is no scale for the distance.
    #[error("all values of the curve are 0; bound the quantity instead")]
    Zero,
}

impl Curve {
    /// Through these points, with ascending times above 0.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn new(points: Vec<(f64, f64)>) -> Result<Self, CurveError> {
        let mut before = 0.0;
        for &(time, value) in &points {
            if !(time.is_finite() && time > before) {
                return Err(CurveError::Time { time });
            }
            if !value.is_finite() {
                return Err(CurveError::Value { value });
            }
            before = time;
        }
        let size = points.iter().fold(0.0, |size: f64, (_, value)| size.max(value.abs()));
        match (points.is_empty(), size == 0.0) {
            (true, _) => Err(CurveError::Empty),
            (_, true) => Err(CurveError::Zero),
            _ => Ok(Self { points, size }),
        }
    }

    /// Root mean square of the differences at the points, relative to the largest magnitude of
    /// their values, and its derivatives with respect to the values at the steps. Between steps,
    /// the quantity is linear in pseudo-time; at time 0, it is 0; beyond the last step, it keeps
    /// its last value.
    pub fn distance(&self, values: &[f64], times: &[f64]) -> (f64, Vec<f64>) {
        let mut slopes = vec![0.0; values.len()];
        let scale = 1.0 / (self.size * self.size * self.points.len() as f64);
        let mut square = 0.0;
        for &(time, wanted) in &self.points {
            let (after, share) = place(time, times);
            let before = if after == 0 { 0.0 } else { values[after - 1] };
            let off = before + share * (values[after] - before) - wanted;
            square += scale * off * off;
            slopes[after] += scale * off * share;
            if after > 0 {
                slopes[after - 1] += scale * off * (1.0 - share);
            }
        }
        let distance = square.sqrt();
        if distance > 0.0 {
            slopes.iter_mut().for_each(|slope| *slope /= distance);
        }
        (distance, slopes)
    }
}

/// The step at whose end or before which a time lies, and its share of the way to that end.
fn place(time: f64, times: &[f64]) -> (usize, f64) {
    let after = times.iter().position(|&end| end >= time).unwrap_or(times.len() - 1);
    let before = if after == 0 { 0.0 } else { times[after - 1] };
    (after, ((time - before) / (times[after] - before)).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: values 1 and 3 at times 0.5 and 1.0, points on the line to the first step, between
    /// both and at the end.
    #[test]
    fn distances_by_hand() {
        let curve = Curve::new(vec![(0.25, 0.5), (0.75, 1.0), (1.0, 4.0)]).unwrap();
        let (distance, slopes) = curve.distance(&[1.0, 3.0], &[0.5, 1.0]);
        assert!((distance - (2.0f64 / 3.0).sqrt() / 4.0).abs() < 1e-15);
        for (i, slope) in slopes.iter().enumerate() {
            let moved = |h: f64| {
                let mut values = [1.0, 3.0];
                values[i] += h;
                curve.distance(&values, &[0.5, 1.0]).0
            };
            assert!(((moved(1e-6) - moved(-1e-6)) / 2e-6 - slope).abs() < 1e-9);
        }
        assert_eq!(Curve::new(vec![(0.5, 1.0)]).unwrap().distance(&[1.0, 3.0], &[0.5, 1.0]), (0.0, vec![0.0; 2]));
    }

    #[test]
    fn wrong_points_are_refused() {
        assert_eq!(Curve::new(vec![]), Err(CurveError::Empty));
        assert_eq!(Curve::new(vec![(0.5, 0.0)]), Err(CurveError::Zero));
        assert_eq!(Curve::new(vec![(0.5, 1.0), (0.5, 2.0)]), Err(CurveError::Time { time: 0.5 }));
        assert!(matches!(Curve::new(vec![(0.5, f64::NAN)]), Err(CurveError::Value { .. })));
    }
}
