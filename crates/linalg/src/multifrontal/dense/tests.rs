use super::*;
use registers::Level;
use std::cell::Cell;

thread_local! {
    /// Instruction set of the kernels of this thread; none for the best.
    pub(super) static LEVEL: Cell<Option<Level>> = const { Cell::new(None) };
}

/// Runs a test on one thread with each instruction set of this processor.
fn at_all_levels(test: impl Fn() + Sync) {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    #[cfg(target_arch = "x86_64")]
    let levels = match Level::best() {
        Level::Avx512 => vec![Level::Portable, Level::Avx2, Level::Avx512],
        Level::Avx2 => vec![Level::Portable, Level::Avx2],
        Level::Portable => vec![Level::Portable],
    };
    #[cfg(not(target_arch = "x86_64"))]
    let levels = vec![Level::Portable];
    for level in levels {
        one_thread.install(|| {
            LEVEL.set(Some(level));
            test();
            LEVEL.set(None);
        });
    }
}

/// Column-major matrix.
#[derive(Clone)]
struct Matrix<T> {
    rows: usize,
    columns: usize,
    values: Vec<T>,
}

impl<T: Scalar> Matrix<T> {
    fn from_fn(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let values = (0..rows * columns).map(|k| T::from_f64(entry(k % rows, k / rows))).collect();
        Self { rows, columns, values }
    }

    fn pseudo_random(m: usize, n: usize) -> Self {
        Self::from_fn(m, n, |i, j| ((i * 7919 + j * 104_729 + i * j) as f64 * 0.618).sin())
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.values[i + j * self.rows].to_f64()
    }

    fn view(&self) -> View<'_, T> {
        View::new(&self.values, self.rows, self.columns)
    }

    fn change(&mut self) -> ViewMut<'_, T> {
        ViewMut::new(&mut self.values, self.rows, self.columns)
    }

    /// Entry of A B by definition, in double precision.
    fn times(&self, b: &Self, i: usize, j: usize) -> f64 {
        (0..self.columns).map(|k| self.at(i, k) * b.at(k, j)).sum()
    }

    /// The unit lower (`lower` set) or the upper triangle.
    fn triangle(&self, lower: bool) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| match (i.cmp(&j), lower) {
            (std::cmp::Ordering::Equal, true) => 1.0,
            (std::cmp::Ordering::Greater, false) | (std::cmp::Ordering::Less, true) => 0.0,
            _ => self.at(i, j),
        })
    }
}

fn largest_entry(m: usize, n: usize, entry: impl Fn(usize, usize) -> f64) -> f64 {
    (0..m * n).map(|k| entry(k % m, k / m).abs()).fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
}

/// Blocks within larger matrices of any size around registers, blocks and copies: products are those
/// by definition, and nothing else changes.
fn products_agree<T: Scalar>(tolerance: f64) {
    for (m, n, k) in [(1, 1, 1), (7, 3, 5), (8, 8, 8), (25, 33, 2), (50, 9, 300), (193, 31, 17), (200, 70, 259)] {
        for transposed in [false, true] {
            let a = Matrix::<T>::pseudo_random(m + 2, k + 1);
            let b = if transposed { Matrix::pseudo_random(n + 3, k + 1) } else { Matrix::pseudo_random(k + 3, n + 1) };
            let before = Matrix::<T>::pseudo_random(m + 5, n + 2);
            let mut c = before.clone();
            let block = c.change().split_rows(2).1.split_rows(m).0.split_columns(1).1.split_columns(n).0;
            let of_b = if transposed { b.view().transpose() } else { b.view() };
            subtract(block, a.view().block(1, 1, m, k), of_b.block(1, 1, k, n), Part::Whole);
            let error = largest_entry(m + 5, n + 2, |i, j| {
                let inside = (2..2 + m).contains(&i) && (1..1 + n).contains(&j);
                let product: f64 = match inside {
                    true => (0..k).map(|l| a.at(i - 1, l + 1) * of_b.get(l + 1, j).to_f64()).sum(),
                    false => 0.0,
                };
                c.at(i, j) - before.at(i, j) + product
            });
            assert!(error < tolerance * k as f64, "{m} {n} {k} {transposed}: {error:e}");
        }
    }
}

#[test]
fn products_agree_with_their_definition() {
    at_all_levels(|| {
        products_agree::<f64>(1e-15);
        products_agree::<f32>(5e-7);
    });
}

/// P A = L U for small sizes, one panel and several, entry by entry; partial pivoting leaves no
/// multiplier above one.
#[test]
fn factorizations_restore_the_matrix() {
    at_all_levels(|| {
        for n in [1, 3, 8, 9, 30, ONE_PANEL, 2 * ONE_PANEL + 37] {
            let a = Matrix::<f64>::pseudo_random(n, n);
            let mut factors = a.clone();
            let mut order = vec![0u32; n];
            lu(factors.change(), &mut order);
            let (lower, upper) = (factors.triangle(true), factors.triangle(false));
            let error = largest_entry(n, n, |i, j| lower.times(&upper, i, j) - a.at(order[i] as usize, j));
            assert!(error < 1e-11, "largest difference {error:e}");
            assert!(largest_entry(n, n, |i, j| lower.at(i, j)) <= 1.0);
        }
    });
}

/// A column of zeros has a zero on the diagonal of U, whatever the other columns.
#[test]
fn zero_columns_leave_zero_pivots() {
    let n = 20;
    let mut a = Matrix::<f64>::from_fn(n, n, |i, j| if j == 11 { 0.0 } else { ((i * 31 + j * 17) as f64).sin() });
    let mut order = vec![0u32; n];
    lu(a.change(), &mut order);
    assert_eq!(a.at(11, 11), 0.0);
}

fn solves_agree<T: Scalar>(tolerance: f64) {
    for (n, m) in [(1, 1), (5, 3), (8, 17), (13, 40), (150, 700)] {
        let entry = |i: usize, j: usize| if i == j { 2.0 } else { ((i * 31 + j * 17) as f64).sin() / n as f64 };
        let triangle = Matrix::<T>::from_fn(n, n, entry);
        let (upper, lower) = (triangle.triangle(false), triangle.triangle(true));
        let b = Matrix::<T>::pseudo_random(m, n);
        let mut x = b.clone();
        solve_upper_right(triangle.view(), x.change());
        let error = largest_entry(m, n, |i, j| x.times(&upper, i, j) - b.at(i, j));
        assert!(error < tolerance, "{n} {m}: {error:e}");
        let mut y = b.clone();
        let transposed = Matrix::<T>::from_fn(n, n, |i, j| entry(j, i));
        solve_upper_right(transposed.view().transpose(), y.change());
        assert_eq!(largest_entry(m, n, |i, j| x.at(i, j) - y.at(i, j)), 0.0);
        let c = Matrix::<T>::pseudo_random(n, m);
        let mut y = c.clone();
        solve_unit_lower(triangle.view(), y.change());
        let error = largest_entry(n, m, |i, j| lower.times(&y, i, j) - c.at(i, j));
        assert!(error < tolerance, "{n} {m}: {error:e}");
    }
}

#[test]
fn solves_agree_with_their_definition() {
    at_all_levels(|| {
        solves_agree::<f64>(1e-13);
        solves_agree::<f32>(1e-4);
    });
}

/// Sizes of one panel, of several, and of several tiles: L Lᵀ restores the matrix, entry by
/// entry; its upper triangle is not read. An indefinite matrix is noticed in any panel.
#[test]
fn cholesky_restores_the_matrix() {
    at_all_levels(|| {
        for n in [1, 9, 30, ONE_PANEL, 2 * ONE_PANEL + 37] {
            let b = Matrix::<f64>::pseudo_random(n, n);
            let transposed = Matrix::from_fn(n, n, |i, j| b.at(j, i));
            let mut a =
                Matrix::<f64>::from_fn(n, n, |i, j| b.times(&transposed, i, j) + if i == j { n as f64 } else { 0.0 });
            let mut factor = Matrix::<f64>::from_fn(n, n, |i, j| if i < j { f64::NAN } else { a.at(i, j) });
            assert!(cholesky(factor.change()));
            let lower = Matrix::<f64>::from_fn(n, n, |i, j| if i < j { 0.0 } else { factor.at(i, j) });
            let mut rest = a.clone();
            subtract_symmetric_product(rest.change(), lower.view());
            let error = largest_entry(n, n, |i, j| if i < j { 0.0 } else { rest.at(i, j) });
            assert!(error < 1e-10, "{n}: {error:e}");
            let by_definition =
                largest_entry(n, n, |i, j| (0..n).map(|k| lower.at(i, k) * lower.at(j, k)).sum::<f64>() - a.at(i, j));
            assert!(by_definition < 1e-10, "{n}: {by_definition:e}");
            a.values[n * n - 1] = -1.0;
            assert!(!cholesky(a.change()), "{n}");
        }
    });
}

/// Entry by entry, for a size beyond one block.
#[test]
fn mirrored_matrices_are_symmetric() {
    let n = 75;
    let mut a: Vec<f64> = (0..n * n).map(|k| if k % n >= k / n { k as f64 } else { f64::NAN }).collect();
    mirror(&mut a, n);
    assert!((0..n * n).all(|k| a[k] == (k % n).max(k / n) as f64 + ((k % n).min(k / n) * n) as f64));
}

#[test]
fn a_hidden_nan_makes_the_largest_entry_infinite() {
    let mut values = vec![1.0f32; 100];
    values[97] = -3.0;
    assert_eq!(largest(&values), 3.0);
    values[40] = f32::NAN;
    assert_eq!(largest(&values), f64::INFINITY);
}
