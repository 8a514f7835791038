//! Times of load cases, and the steps between them.

/// A time of a load path: a load case, and the pseudo-time within it.
///
/// A path follows all load cases in sequence. Where one number has to stand for a time, in files and
/// checkpoints, it is that of [`on_axis`](Self::on_axis).
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
pub struct LoadTime {
    /// The load case, from 0.
    pub case: usize,
    /// Its own pseudo-time, from 0, where everything is at rest, to 1.
    pub t: f64,
}

/// From the start of a step to its end, in one load case.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Span {
    /// The load case, from 0.
    pub case: usize,
    /// Pseudo-time at the start.
    pub from: f64,
    /// Pseudo-time at the end.
    pub to: f64,
}

impl Span {
    /// From a time to a pseudo-time of the same load case.
    pub fn new(from: LoadTime, to: f64) -> Self {
        Self { case: from.case, from: from.t, to }
    }

    /// The start.
    pub fn start(self) -> LoadTime {
        LoadTime { case: self.case, t: self.from }
    }

    /// The end.
    pub fn end(self) -> LoadTime {
        LoadTime { case: self.case, t: self.to }
    }

    /// Pseudo-time that passes in the step.
    pub fn duration(self) -> f64 {
        self.to - self.from
    }
}

impl From<[f64; 2]> for Span {
    /// Between two pseudo-times of the first load case.
    fn from([from, to]: [f64; 2]) -> Self {
        Self { case: 0, from, to }
    }
}

impl From<f64> for LoadTime {
    /// A pseudo-time of the first load case.
    fn from(t: f64) -> Self {
        Self { case: 0, t }
    }
}

impl std::fmt::Display for LoadTime {
    /// The pseudo-time, and the number of a later load case, from 1.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.t.fmt(f)?;
        if self.case > 0 { write!(f, " of load case {}", self.case + 1) } else { Ok(()) }
    }
}

impl LoadTime {
    /// The start of a load case.
    pub fn start(case: usize) -> Self {
        Self { case, t: 0.0 }
    }

    /// On one axis through all load cases: case k (from 0) lies between 2k and 2k + 1.
    pub fn on_axis(self) -> f64 {
        2.0 * self.case as f64 + self.t
    }

    /// The time at a place of that axis.
    pub fn of_axis(axis: f64) -> Self {
        let case = (0.5 * axis) as usize;
        let t = axis - Self::start(case).on_axis();
        Self { case, t: if t > 1.0 { 1.0 } else { t } }
    }

    /// The same, rounded so that it does not change on its way to the axis and back. The times of a path are
    /// such times: those that a guide or a checkpoint holds are then the same, bit for bit.
    #[must_use]
    pub fn rounded(self) -> Self {
        Self { t: self.on_axis() - Self::start(self.case).on_axis(), ..self }
    }

    /// The name of the load case, if load cases have names.
    pub fn name(self, names: &[String]) -> Option<&str> {
        names.get(self.case).map(String::as_str)
    }

    /// The ends of `steps` equal steps of each of `cases` load cases.
    pub fn ends(cases: usize, steps: usize) -> Vec<Self> {
        let end = |case, n| Self { case, t: n as f64 / steps as f64 }.rounded();
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
        assert!(times.windows(2).all(|w| w[0] < w[1] && w[0].on_axis() < w[1].on_axis()));
        for (i, time) in times.iter().enumerate() {
            assert_eq!((time.case, time.t), (i / 4, (i % 4 + 1) as f64 / 4.0));
            assert_eq!(LoadTime::of_axis(time.on_axis()), *time);
        }
        for start in [LoadTime::start(0), LoadTime::start(2)] {
            assert_eq!(LoadTime::of_axis(start.on_axis()), start);
        }
        let names = ["drawn".to_owned(), "pushed".to_owned()];
        assert_eq!(LoadTime { case: 1, t: 0.25 }.name(&names), Some("pushed"));
        assert_eq!(LoadTime::from(0.25).name(&[]), None);
        assert_eq!(
            [LoadTime::from(0.25), LoadTime { case: 2, t: 0.5 }].map(|t| format!("{t:.2}")),
            ["0.25", "0.50 of load case 3"]
        );
        for time in LoadTime::ends(4, 7) {
            assert_eq!(time.rounded(), time);
            assert_eq!(LoadTime::start(time.case).on_axis() + time.t, time.on_axis());
        }
        assert_ne!(LoadTime { case: 1, t: 0.3 }.rounded().t, 0.3);
        let span = Span::new(LoadTime { case: 1, t: 0.25 }, 1.0);
        assert_eq!((span.start().t, span.end(), span.duration()), (0.25, LoadTime { case: 1, t: 1.0 }, 0.75));
    }
}
