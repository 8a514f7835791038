//! Singular, ill-conditioned, badly scaled and broken matrices.

use crate::common::{Brick, Random, relative_residual};
use crate::supernodal::SupernodalSolver;
use slipstick_linalg::{
    CsrMatrix, CsrPattern, FactorizationError, LinearSolver, MultifrontalSolver, Precision, RobustSolver, SolverChoice,
    solve_verified,
};
use std::sync::Arc;

const BRICK: Brick =
    Brick { nodes: [9, 8, 7], multipliers: true, contrast: 3.0, nonsymmetry: 0.05, fixed_bottom: true };

fn solvers() -> Vec<Box<dyn LinearSolver>> {
    vec![
        Box::new(SupernodalSolver::new()),
        Box::new(MultifrontalSolver::strict()),
        Box::new(MultifrontalSolver::new(Precision::F64)),
        Box::new(RobustSolver::new(SolverChoice::Auto)),
    ]
}

fn csr(rows: &[Vec<(u32, f64)>], groups: Vec<u32>) -> CsrMatrix {
    let (mut row_offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for row in rows {
        columns.extend(row.iter().map(|e| e.0));
        values.extend(row.iter().map(|e| e.1));
        row_offsets.push(values.len());
    }
    let pattern = CsrPattern::new(row_offsets, columns, groups, vec![]).unwrap();
    CsrMatrix { pattern: Arc::new(pattern), values }
}

/// Slave nodes whose displacements are all prescribed leave their multipliers without a partner.
#[test]
fn multipliers_of_prescribed_nodes_are_handled() {
    let (a, mut fixed, groups) = BRICK.assemble(7);
    for slave in [BRICK.node(0, 3, 6), BRICK.node(4, 4, 6), BRICK.node(5, 4, 6)] {
        fixed[3 * slave..3 * slave + 3].fill(true);
    }
    fixed[3 * BRICK.node(6, 6, 6)] = true;
    let reduction = slipstick_linalg::Reduction::new(a.pattern(), &fixed, &groups);
    let a = reduction.reduce(&a);
    let b = Random(8).vector(a.n());
    let mut x = vec![0.0; a.n()];
    let mut solver = RobustSolver::new(SolverChoice::Auto);
    let factors = solver.analyse_and_factorize(&a).unwrap();
    assert_eq!(solver.used(), Some("multifrontal LU in single precision"));
    let report = solve_verified(&a, factors.as_ref(), false, &b, &mut x, 1e-10).unwrap();
    assert!(report.iterations <= 2, "{report:?}");
}

/// Bodies without supports, of sizes and contrasts where rounding leaves pivots on either side of
/// the smallest accepted one: always reported as singular, never by way of stricter pivoting.
#[test]
fn floating_bodies_are_reported_as_singular() {
    for (edge, contrast) in [(5, 0.0), (8, 0.0), (8, 3.0), (10, 9.0), (12, 0.0)] {
        let brick = Brick { nodes: [edge; 3], fixed_bottom: false, multipliers: false, nonsymmetry: 0.0, contrast };
        let (a, _) = brick.reduced(16);
        for choice in [SolverChoice::Auto, SolverChoice::Multifrontal { precision: Precision::F32 }] {
            let error = RobustSolver::new(choice).analyse_and_factorize(&a).err();
            assert!(
                matches!(error, Some(FactorizationError::Singular { pivot, .. }) if pivot < 1e-12),
                "{edge} {contrast} {choice:?}: {error:?}"
            );
        }
    }
}

/// An unknown without any coupling is named.
#[test]
fn an_empty_row_is_named() {
    let rows = vec![vec![(0, 2.0), (1, 1.0)], vec![(0, 1.0), (1, 3.0)], vec![(2, 0.0)], vec![(3, 1.0)]];
    let a = csr(&rows, vec![0, 1, 2, 3]);
    let error = RobustSolver::new(SolverChoice::Auto).analyse_and_factorize(&a).err();
    assert_eq!(error, Some(FactorizationError::Singular { unknown: 2, pivot: 0.0 }));
    let error = SupernodalSolver::new().analyse_and_factorize(&a).err();
    assert!(error.is_some());
}

#[test]
fn entries_that_are_not_finite_are_located() {
    let (mut a, _) = Brick { nodes: [3, 3, 3], ..BRICK }.reduced(17);
    let k = a.pattern.row_range(5).start + 2;
    a.values[k] = f64::INFINITY;
    let column = a.pattern.columns()[k] as usize;
    for mut solver in solvers() {
        let error = solver.analyse_and_factorize(&a).err();
        assert_eq!(error, Some(FactorizationError::NonFinite { row: 5, column }));
    }
}

#[test]
fn values_that_are_too_few_are_refused() {
    let mut a = csr(&[vec![(0, 1.0), (1, 1.0)], vec![(1, 1.0)]], vec![0, 0]);
    a.values.pop();
    for mut solver in solvers() {
        let error = solver.analyse_and_factorize(&a).err();
        assert_eq!(error, Some(FactorizationError::Values { values: 2, entries: 3 }));
    }
}

/// Rows and columns scaled over 24 decades: equilibration restores the accuracy.
#[test]
fn badly_scaled_rows_and_columns_do_no_harm() {
    let (mut a, _) = BRICK.reduced(18);
    let scale = |i: usize| 10f64.powi((i * 7 % 25) as i32 - 12);
    for i in 0..a.n() {
        for k in a.pattern.row_range(i) {
            a.values[k] *= scale(i) * scale(3 * a.pattern.columns()[k] as usize + 1);
        }
    }
    let x: Vec<f64> = (0..a.n()).map(|j| (1.0 + (j % 5) as f64) / scale(3 * j + 1)).collect();
    let mut b = vec![0.0; a.n()];
    a.mul(&x, &mut b);
    MultifrontalSolver::new(Precision::F64).analyse_and_factorize(&a).unwrap().solve(&mut b);
    let error = b.iter().zip(&x).fold(0.0, |m: f64, (b, x)| m.max((b / x - 1.0).abs()));
    assert!(error < 1e-8, "largest relative error {error:e}");
}

/// Void-like stiffness down to 10⁻⁹ of the solid: regular, and recognized as such.
#[test]
fn strong_stiffness_contrast_is_not_mistaken_for_singularity() {
    let (a, _) = Brick { contrast: 9.0, ..BRICK }.reduced(23);
    let b = Random(24).vector(a.n());
    for choice in [SolverChoice::Auto, SolverChoice::Multifrontal { precision: Precision::F32 }] {
        let mut solver = RobustSolver::new(choice);
        let factors = solver.analyse_and_factorize(&a).unwrap();
        let mut x = vec![0.0; a.n()];
        solve_verified(&a, factors.as_ref(), true, &b, &mut x, 1e-10).unwrap();
        assert_ne!(solver.used(), Some("multifrontal LU with strict pivoting"));
    }
}

/// Hilbert matrix of order n, without structure.
fn hilbert(n: usize) -> CsrMatrix {
    let rows: Vec<Vec<(u32, f64)>> =
        (0..n).map(|i| (0..n).map(|j| (j as u32, 1.0 / (i + j + 1) as f64)).collect()).collect();
    csr(&rows, (0..n as u32).collect())
}

/// Hilbert matrices: order 14 (condition beyond 1e17) must be refused; order 8 (condition 1.5e10)
/// is within reach even of single-precision factors with GMRES.
#[test]
fn hopelessly_conditioned_matrices_are_refused() {
    let choice = SolverChoice::Multifrontal { precision: Precision::F32 };
    let error = RobustSolver::new(choice).analyse_and_factorize(&hilbert(14)).err();
    assert!(
        matches!(error, Some(FactorizationError::Singular { .. } | FactorizationError::Inaccurate { .. })),
        "{error:?}"
    );
    let a = hilbert(8);
    let factors = RobustSolver::new(choice).analyse_and_factorize(&a).unwrap();
    let b = Random(25).vector(8);
    let mut x = vec![0.0; 8];
    let report = solve_verified(&a, factors.as_ref(), false, &b, &mut x, 1e-4).unwrap();
    assert!(relative_residual(&a, false, &x, &b) <= 1e-4, "{report:?}");
}

/// A slender cantilever, discretized by finite differences (biharmonic operator, clamped and free
/// ends). Its condition number of about n⁴ is too large for single precision, so the chain falls
/// back to double precision. By beam theory, the tip deflection under a unit tip force is
/// n³/3 + O(n²).
#[test]
fn single_precision_gives_way_to_double() {
    let n = 1000;
    // Curvature κ = D u with zero value and slope at the clamp; stiffness Dᵀ D.
    let curvature = |i: usize| -> Vec<(usize, f64)> {
        [(i.checked_sub(2), 1.0), (i.checked_sub(1), -2.0), (Some(i), 1.0)]
            .into_iter()
            .filter_map(|(j, v)| j.map(|j| (j, v)))
            .collect()
    };
    let mut dense: Vec<std::collections::BTreeMap<u32, f64>> = vec![Default::default(); n];
    for i in 0..n {
        for &(r, v) in &curvature(i) {
            for &(c, w) in &curvature(i) {
                *dense[r].entry(c as u32).or_insert(0.0) += v * w;
            }
        }
    }
    let rows: Vec<Vec<(u32, f64)>> = dense.into_iter().map(|row| row.into_iter().collect()).collect();
    let a = csr(&rows, (0..n as u32).collect());
    let mut solver = RobustSolver::new(SolverChoice::Multifrontal { precision: Precision::F32 });
    let factors = solver.analyse_and_factorize(&a).unwrap();
    assert_eq!(solver.used(), Some("multifrontal LU in double precision"));
    let mut x = vec![0.0; n];
    x[n - 1] = 1.0;
    factors.solve(&mut x);
    let expected = (n as f64).powi(3) / 3.0;
    assert!((x[n - 1] / expected - 1.0).abs() < 2.0 / n as f64, "{} {expected}", x[n - 1]);
}
