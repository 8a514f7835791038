//! Small dense systems.

/// Solves `A x = b` in place (`b` becomes `x`; `A`, stored by rows, is overwritten) by elimination
/// with partial pivoting after scaling the rows; `false` if a pivot is zero or not finite.
pub(super) fn solve_dense(a: &mut [f64], b: &mut [f64]) -> bool {
    let n = b.len();
    // Without the scaling, pivots of constraints with different scales would be compared.
    for row in 0..n {
        let largest = a[row * n..(row + 1) * n].iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        if !(largest > 0.0 && largest.is_finite()) {
            return false;
        }
        a[row * n..(row + 1) * n].iter_mut().for_each(|value| *value /= largest);
        b[row] /= largest;
    }
    for column in 0..n {
        let size = |row: usize| a[row * n + column].abs();
        let pivot = (column..n).fold(column, |best, row| if size(row) > size(best) { row } else { best });
        if !(size(pivot) > 0.0 && size(pivot).is_finite()) {
            return false;
        }
        for k in 0..n {
            a.swap(column * n + k, pivot * n + k);
        }
        b.swap(column, pivot);
        for row in column + 1..n {
            let factor = a[row * n + column] / a[column * n + column];
            for k in column..n {
                a[row * n + k] -= factor * a[column * n + k];
            }
            b[row] -= factor * b[column];
        }
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| a[row * n + k] * b[k]).sum();
        b[row] = (b[row] - known) / a[row * n + row];
    }
    b.iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Hilbert-like system with a known solution; the order and scales of its rows require
    /// pivoting.
    #[test]
    fn known_solution() {
        let rows = [[0.0, 1e8, 2e8], [1.0, 0.5, 1.0 / 3.0], [1e-9, 2e-9, -3e-9]];
        let x = [1.0, -2.0, 3.0];
        let mut b: Vec<f64> = rows.iter().map(|row| (0..3).map(|k| row[k] * x[k]).sum()).collect();
        assert!(solve_dense(&mut rows.concat(), &mut b));
        for k in 0..3 {
            assert!((b[k] - x[k]).abs() < 1e-14);
        }
    }

    #[test]
    fn singular_systems_are_noticed() {
        assert!(!solve_dense(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0]));
        assert!(!solve_dense(&mut [0.0], &mut [1.0]));
        assert!(!solve_dense(&mut [f64::NAN], &mut [1.0]));
    }
}
