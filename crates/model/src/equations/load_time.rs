//! Times of load cases, and the pseudo-times of a path through several of them.

/// A time of a load case.
///
/// A path follows all load cases in sequence, on one axis of pseudo-time: case k (from 0) runs from
/// 2k, where everything is at rest, to 2k + 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadTime {
    /// The load case, from 0.
    pub case: usize,
    /// Its own pseudo-time, from 0 to 1.
    pub t: f64,
}

impl LoadTime {
    /// The start of a load case.
    pub fn start(case: usize) -> Self {
        Self { case, t: 0.0 }
    }

    /// At a pseudo-time of the path.
    pub fn on_path(time: f64) -> Self {
        let case = (0.5 * time) as usize;
        Self { case, t: (time - Self::start(case).of_path()).min(1.0) }
    }

    /// The pseudo-time of the path.
    pub fn of_path(self) -> f64 {
        2.0 * self.case as f64 + self.t
    }

    /// The name of the load case at a pseudo-time of the path, if load cases have names, and its own
    /// pseudo-time.
    pub fn named(names: &[String], time: f64) -> (Option<&str>, f64) {
        let Self { case, t } = Self::on_path(time);
        names.get(case).map_or((None, time), |name| (Some(name), t))
    }

    /// Pseudo-times of the path at the ends of `steps` equal steps of each of `cases` load cases.
    pub fn ends(cases: usize, steps: usize) -> Vec<f64> {
        let end = |case, n| Self { case, t: n as f64 / steps as f64 }.of_path();
        (0..cases).flat_map(|case| (1..=steps).map(move |n| end(case, n))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_is_in_its_case() {
        let times = LoadTime::ends(3, 4);
        assert_eq!(times.len(), 12);
        assert!(times.windows(2).all(|w| w[0] < w[1]));
        for (i, &time) in times.iter().enumerate() {
            let LoadTime { case, t } = LoadTime::on_path(time);
            assert_eq!(case, i / 4);
            assert!((t - (i % 4 + 1) as f64 / 4.0).abs() < 1e-15);
        }
        for start in [LoadTime::start(0), LoadTime::start(2)] {
            assert_eq!(LoadTime::on_path(start.of_path()), start);
        }
        let names = ["drawn".to_owned(), "pushed".to_owned()];
        assert_eq!(LoadTime::named(&names, 2.25), (Some("pushed"), 0.25));
        assert_eq!(LoadTime::named(&[], 0.25), (None, 0.25));
    }
}
