//! tmp
#[path = "../tests/common/mod.rs"]
mod common;
use common::Brick;
use slipstick_linalg::*;
fn main() {
    for e in [5, 8, 12, 18] { for c in [0.0, 3.0, 6.0, 9.0, 12.0] { for fixed in [false, true] {
        let (a, _) = Brick { nodes: [e; 3], multipliers: fixed, contrast: c, nonsymmetry: 0.0, fixed_bottom: fixed }.reduced(1);
        let m = MultifrontalSolver::new(Precision::F64).factorize_matrix(&a).map(|f| f.statistics()).map_err(|e| e.to_string().chars().take(80).collect::<String>());
        let r = RobustSolver::new(SolverChoice::Auto).factorize(&a).map(|_| ()).map_err(|e| e.to_string().chars().take(80).collect::<String>());
        println!("{e} {c} fixed {fixed}: {m:?} | {r:?}");
    }}}
}
