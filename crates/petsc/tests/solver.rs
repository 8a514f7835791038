//! Options for PETSc: methods that cannot solve with the transpose are refused, others are
//! verified.

#[path = "../../linalg/tests/common/mod.rs"]
mod common;

use common::{Brick, Random};
use slipstick_linalg::{Backend, CsrMatrix, solve_verified};
use slipstick_petsc::{PetscBackend, Session};

const BRICK: Brick =
    Brick { nodes: [7, 6, 5], multipliers: false, contrast: 1.0, nonsymmetry: 0.05, fixed_bottom: true };

/// One test, for a process has one session and PETSc one set of options.
#[test]
fn methods_without_transposed_solves_are_refused() {
    let session = Session::start().unwrap();
    let backend = PetscBackend::new(session.clone(), vec![0]);
    let (small, _) = BRICK.reduced(1);
    let solve_with = |a: &CsrMatrix, options: &str| -> Result<(), String> {
        let b = Random(2).vector(a.n());
        session.set_options(options).map_err(|e| e.to_string())?;
        let factors = backend.solver().analyse_and_factorize(a).map_err(|e| e.to_string())?;
        for transpose in [false, true] {
            let mut x = vec![0.0; a.n()];
            solve_verified(a, factors.as_ref(), transpose, &b, &mut x, 1e-10).map_err(|e| e.to_string())?;
        }
        Ok(())
    };
    let solve = |options: &str| solve_with(&small, options);
    assert_eq!(solve(""), Ok(()));
    assert_eq!(solve("-pc_factor_mat_solver_type petsc"), Ok(()));
    assert_eq!(solve("-ksp_type gmres -ksp_rtol 1e-8 -pc_type ilu"), Ok(()));
    // where MUMPS asks for more workspace than it foresaw, it gets it
    let (large, _) = Brick { nodes: [16, 16, 16], ..BRICK }.reduced(1);
    assert_eq!(
        solve_with(&large, "-ksp_type preonly -pc_type lu -pc_factor_mat_solver_type mumps -mat_mumps_icntl_14 -95"),
        Ok(())
    );
    // its transposed solve returns without having done anything
    let hypre = solve("-ksp_type gmres -pc_type hypre").unwrap_err();
    assert!(hypre.contains("transpose"), "{hypre}");
    // and that of SuperLU_DIST is wrong for some matrices
    let distributed = solve("-ksp_type preonly -pc_type lu -pc_factor_mat_solver_type superlu_dist").unwrap_err();
    assert!(distributed.contains("transpose"), "{distributed}");
    let unknown = solve("-pc_type lu -pc_factor_mat_solver_type nonesuch").unwrap_err();
    assert!(unknown.contains("nonesuch"), "{unknown}");
    assert!(session.set_options("a\0b").is_err());
    // options are tried before anything depends on them
    let direct = "-ksp_type preonly -pc_type lu -pc_factor_mat_solver_type mumps -mat_mumps_icntl_14 60";
    assert_eq!(session.try_options(direct, false), Ok(()));
    assert_eq!(session.try_options("-zone_mat_mumps_icntl_14 60 -bulk_mg_levels_ksp_max_it 2", true), Ok(()));
    let told = |options: &str| session.try_options(options, false).unwrap_err().to_string();
    assert_eq!(told("-mat_mumps_icntl_414 60 -ksp_typ gmres"), "no solver uses -ksp_typ -mat_mumps_icntl_414");
    assert!(told("-ksp_type gmres -pc_type hypre").contains("transpose"));
}
