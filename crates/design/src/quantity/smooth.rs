//! Smooth substitutes for the largest and the smallest of some numbers.

/// p-norm (Σ max(x, 0)^p)^(1/p) ≥ max x, and its derivatives; the values are given in units of
/// their largest one, so that no power overflows.
pub fn p_norm(values: &[f64], p: f64) -> (f64, Vec<f64>) {
    let largest = values.iter().fold(0.0, |largest: f64, x| if x.is_nan() { f64::NAN } else { largest.max(*x) });
    if largest == 0.0 || !largest.is_finite() {
        return (largest, vec![0.0; values.len()]);
    }
    let relative: Vec<f64> = values.iter().map(|x| (x / largest).max(0.0)).collect();
    let sum: f64 = relative.iter().map(|x| x.powf(p)).sum();
    let norm = sum.powf(1.0 / p);
    let slope = |x: &f64| if *x > 0.0 { (x / norm).powf(p - 1.0) } else { 0.0 };
    let slopes = relative.iter().map(slope).collect();
    (largest * norm, slopes)
}

/// −ln(Σ exp(−k x))/k ≤ min x, and its derivatives (Kreisselmeier and Steinhauser, 1979).
pub fn soft_minimum(values: &[f64], k: f64) -> (f64, Vec<f64>) {
    let smallest =
        values.iter().fold(f64::INFINITY, |smallest, x| if x.is_nan() { f64::NAN } else { smallest.min(*x) });
    if !smallest.is_finite() {
        return (smallest, vec![0.0; values.len()]);
    }
    let terms: Vec<f64> = values.iter().map(|x| (-k * (x - smallest)).exp()).collect();
    let sum: f64 = terms.iter().sum();
    (smallest - sum.ln() / k, terms.iter().map(|term| term / sum).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand, and by central differences.
    #[test]
    fn they_bound_the_extremes() {
        assert_eq!(p_norm(&[3.0, -7.0, 4.0], 2.0).0, 5.0);
        assert!((soft_minimum(&[1.0, 1.0], 10.0).0 - (1.0 - 2.0f64.ln() / 10.0)).abs() < 1e-15);
        assert_eq!((p_norm(&[0.0; 2], 8.0).0, p_norm(&[1e200, 0.0], 30.0).0), (0.0, 1e200));
        assert!(p_norm(&[1.0, f64::NAN], 8.0).0.is_nan() && soft_minimum(&[f64::NAN, 1.0], 8.0).0.is_nan());
        let at = [0.7, 1.1, 0.2, 0.9];
        type Smooth = fn(&[f64]) -> (f64, Vec<f64>);
        for function in [(|x| p_norm(x, 6.0)) as Smooth, |x| soft_minimum(x, 9.0)] {
            let (_, slopes) = function(&at);
            for (i, slope) in slopes.iter().enumerate() {
                let moved = |h: f64| {
                    let mut moved = at;
                    moved[i] += h;
                    function(&moved).0
                };
                assert!(((moved(1e-5) - moved(-1e-5)) / 2e-5 - slope).abs() < 1e-9);
            }
        }
    }
}
