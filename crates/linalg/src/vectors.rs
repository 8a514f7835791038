//! Operations on long vectors: parallel, with the bits of the sequential loops.

use rayon::prelude::*;

/// Entries of a vector that one task treats.
const PER_TASK: usize = 8192;

/// Dot products that one task computes together.
const TOGETHER: usize = 4;

/// Dot products of `w` with each of `vectors`. Each is summed in the order of the entries; several at
/// once hide the latency of the additions.
pub(crate) fn dots(w: &[f64], vectors: &[Vec<f64>]) -> Vec<f64> {
    let group = |group: &[Vec<f64>]| -> Vec<f64> {
        let [a, b, c, d] = group else { return group.iter().map(|v| dot(w, v)).collect() };
        // the neutral element of a sum
        let mut sums = [-0.0; TOGETHER];
        for ((((w, a), b), c), d) in w.iter().zip(a).zip(b).zip(c).zip(d) {
            sums[0] += w * a;
            sums[1] += w * b;
            sums[2] += w * c;
            sums[3] += w * d;
        }
        sums.to_vec()
    };
    if w.len() < PER_TASK {
        return vectors.chunks(TOGETHER).flat_map(group).collect();
    }
    vectors.par_chunks(TOGETHER).flat_map_iter(group).collect()
}

/// Dot product, summed in the order of the entries.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Sum of the squares of all entries, in several sums that do not wait for each other.
pub(crate) fn square(v: &[f64]) -> f64 {
    let (whole, rest) = v.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for v in whole {
        sums.iter_mut().zip(v).for_each(|(sum, x)| *sum += x * x);
    }
    sums.iter().sum::<f64>() + rest.iter().map(|x| x * x).sum::<f64>()
}

/// max |vᵢ|, or NaN if an entry is NaN.
pub(crate) fn largest(v: &[f64]) -> f64 {
    let (whole, rest) = v.as_chunks::<8>();
    // several at once do not wait for each other
    let (mut sizes, mut nan) = ([0.0; 8], false);
    for v in whole {
        for (size, x) in sizes.iter_mut().zip(v) {
            *size = if x.abs() > *size { x.abs() } else { *size };
            nan |= x.is_nan();
        }
    }
    if nan || rest.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    sizes.iter().chain(rest).fold(0.0, |m, x| m.max(x.abs()))
}

/// `w −= Σ factors · vectors`, one vector after the other.
pub(crate) fn subtract(w: &mut [f64], factors: &[f64], vectors: &[Vec<f64>]) {
    w.par_chunks_mut(PER_TASK).enumerate().for_each(|(k, w)| {
        for (factor, v) in factors.iter().zip(vectors) {
            w.iter_mut().zip(&v[k * PER_TASK..]).for_each(|(w, v)| *w -= factor * v);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 1² + … + 19² = 19 · 20 · 39 / 6.
    #[test]
    fn squares_are_summed() {
        let v: Vec<f64> = (1..20).map(f64::from).collect();
        assert_eq!((square(&v), square(&v[..0])), (2470.0, 0.0));
    }

    #[test]
    fn the_largest_is_found_anywhere() {
        for k in [0, 3, 8, 17, 18] {
            let mut v = [0.5; 19];
            v[k] = -2.0;
            assert_eq!(largest(&v), 2.0);
            v[k] = f64::NAN;
            assert!(largest(&v).is_nan());
        }
    }

    /// By definition: the sequential loops, bit for bit, for vectors of one task and of several.
    #[test]
    fn bits_are_those_of_sequential_loops() {
        for (n, count) in [(5, 3), (3 * PER_TASK + 17, 7)] {
            let vector = |k: usize| (0..n).map(|i| ((i * i + 7 * k) as f64).sin()).collect::<Vec<f64>>();
            let vectors: Vec<Vec<f64>> = (0..count).map(vector).collect();
            let mut w = vector(count);
            let found = dots(&w, &vectors);
            let expected: Vec<f64> = vectors.iter().map(|v| w.iter().zip(v).map(|(w, v)| w * v).sum()).collect();
            assert_eq!(found, expected);
            let mut expected = w.clone();
            for (factor, v) in found.iter().zip(&vectors) {
                expected.iter_mut().zip(v).for_each(|(w, v)| *w -= factor * v);
            }
            subtract(&mut w, &found, &vectors);
            assert_eq!(w, expected);
        }
    }
}
