//! Several load cases in sequence on one axis of pseudo-time: case k (from 0) runs from 2k, where
//! everything is at rest, to 2k + 1.

/// Pseudo-time at which a load case starts.
pub fn start(case: usize) -> f64 {
    2.0 * case as f64
}

/// The load case at a pseudo-time, and its own pseudo-time in [0, 1].
pub fn place(time: f64) -> (usize, f64) {
    let case = (0.5 * time) as usize;
    (case, (time - start(case)).min(1.0))
}

/// The name of the load case at a pseudo-time, if load cases have names, and its own pseudo-time.
pub fn named(names: &[String], time: f64) -> (Option<&str>, f64) {
    let (case, own) = place(time);
    names.get(case).map_or((None, time), |name| (Some(name), own))
}

/// Ends of `steps` equal steps of each of `cases` load cases.
pub fn times(cases: usize, steps: usize) -> Vec<f64> {
    (0..cases).flat_map(|case| (1..=steps).map(move |n| start(case) + n as f64 / steps as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_is_in_its_case() {
        let times = times(3, 4);
        assert_eq!(times.len(), 12);
        assert!(times.windows(2).all(|w| w[0] < w[1]));
        for (i, &time) in times.iter().enumerate() {
            let (case, own) = place(time);
            assert_eq!(case, i / 4);
            assert!((own - (i % 4 + 1) as f64 / 4.0).abs() < 1e-15);
        }
        assert_eq!([place(0.0), place(start(2))], [(0, 0.0), (2, 0.0)]);
        let names = ["drawn".to_owned(), "pushed".to_owned()];
        assert_eq!(named(&names, 2.25), (Some("pushed"), 0.25));
        assert_eq!(named(&[], 0.25), (None, 0.25));
    }
}
