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

/// −ln(Σ w exp(−k x))/k, and its derivatives with respect to x and w (Kreisselmeier and
/// Steinhauser, 1979). Not above the smallest x for weights ≥ 1; between the smallest x and the mean
/// Σ w x for weights that add up to 1. Values of weight 0 do not count and have no derivatives.
pub fn soft_minimum(values: &[f64], weights: &[f64], k: f64) -> (f64, Vec<f64>, Vec<f64>) {
    let counted = values.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
    let smallest =
        counted.fold(f64::INFINITY, |smallest: f64, (x, _)| if x.is_nan() { f64::NAN } else { smallest.min(*x) });
    if !smallest.is_finite() {
        return (smallest, vec![0.0; values.len()], vec![0.0; values.len()]);
    }
    let term = |(x, weight): (&f64, &f64)| if *weight == 0.0 { 0.0 } else { (-k * (x - smallest)).exp() };
    let terms: Vec<f64> = values.iter().zip(weights).map(term).collect();
    let sum: f64 = terms.iter().zip(weights).map(|(term, weight)| term * weight).sum();
    let by_value = terms.iter().zip(weights).map(|(term, weight)| term * weight / sum).collect();
    (smallest - sum.ln() / k, by_value, terms.iter().map(|term| -term / (k * sum)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand, and by central differences.
    #[test]
    fn they_bound_the_extremes() {
        assert_eq!(p_norm(&[3.0, -7.0, 4.0], 2.0).0, 5.0);
        assert!((soft_minimum(&[1.0, 1.0], &[1.0; 2], 10.0).0 - (1.0 - 2.0f64.ln() / 10.0)).abs() < 1e-15);
        assert_eq!(soft_minimum(&[1.0, 1.0], &[0.25, 0.75], 10.0).0, 1.0);
        // a value of weight 0 far below the others
        assert_eq!(soft_minimum(&[0.0, 1.0], &[0.0, 1.0], 1e4), (1.0, vec![0.0, 1.0], vec![0.0, -1e-4]));
        assert_eq!((p_norm(&[0.0; 2], 8.0).0, p_norm(&[1e200, 0.0], 30.0).0), (0.0, 1e200));
        assert!(p_norm(&[1.0, f64::NAN], 8.0).0.is_nan() && soft_minimum(&[f64::NAN, 1.0], &[1.0; 2], 8.0).0.is_nan());
        let at = [0.7, 1.1, 0.2, 0.9];
        let weights = [0.4, 0.1, 0.2, 0.3];
        let (_, by_value, by_weight) = soft_minimum(&at, &weights, 9.0);
        differences(|x| p_norm(x, 6.0).0, &at, &p_norm(&at, 6.0).1);
        differences(|x| soft_minimum(x, &weights, 9.0).0, &at, &by_value);
        differences(|w| soft_minimum(&at, w, 9.0).0, &weights, &by_weight);
    }

    fn differences(function: impl Fn(&[f64]) -> f64, at: &[f64], slopes: &[f64]) {
        assert_eq!(slopes.len(), at.len());
        for (i, slope) in slopes.iter().enumerate() {
            let moved = |h: f64| {
                let mut moved = at.to_vec();
                moved[i] += h;
                function(&moved)
            };
            assert!(((moved(1e-5) - moved(-1e-5)) / 2e-5 - slope).abs() < 1e-9);
        }
    }
}
