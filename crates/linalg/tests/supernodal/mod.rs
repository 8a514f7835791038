//! faer's sparse LU, the independent reference: column elimination tree, COLAMD ordering, full partial
//! pivoting.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::LuError;
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use slipstick_linalg::{
    CsrMatrix, CsrPattern, Factorization, FactorizationError, LinearSolver, Precision, Scaling, Symbolic,
};
use std::sync::Arc;

const NAME: &str = "supernodal LU";

/// Sparse LU of the equilibrated matrix by faer, in double precision.
#[derive(Debug, Default)]
pub struct SupernodalSolver;

/// The analysis of a pattern.
#[derive(Debug)]
struct Analysis {
    row_offsets: Vec<u32>,
    symbolic: Arc<SymbolicLu<u32>>,
}

impl SupernodalSolver {
    /// A solver.
    pub fn new() -> Self {
        Self
    }

    /// As [`LinearSolver::factorize`], with the concrete type.
    ///
    /// # Errors
    /// As [`LinearSolver::factorize`].
    pub fn factorize_matrix(
        &mut self,
        symbolic: &Symbolic,
        a: &CsrMatrix,
    ) -> Result<SupernodalFactorization, FactorizationError> {
        let Analysis { row_offsets, symbolic } = symbolic.content_for(a)?;
        let n = a.n();
        let scaling = Scaling::equilibrate(a);
        let values = scaling.apply(a, |x| x);
        let structure = SymbolicSparseColMatRef::new_checked(n, n, row_offsets, None, a.pattern.columns());
        let transposed = SparseColMatRef::new(structure, &values);
        let mut numeric = NumericLu::new();
        let scratch = symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| backend(n, "out of memory"))?;
        symbolic
            .factorize_numeric_lu(&mut numeric, transposed, Par::Seq, MemStack::new(&mut memory), Default::default())
            .map_err(|error| match error {
                LuError::SymbolicSingular { index } => {
                    // faer pivots among rows of Aᵀ; its columns are our rows.
                    let unknown = symbolic.col_perm().arrays().0[index] as usize;
                    FactorizationError::Singular { unknown, pivot: 0.0 }
                }
                LuError::Generic(error) => backend(n, &error.to_string()),
            })?;
        let factors = SupernodalFactorization { symbolic: Arc::clone(symbolic), numeric, scaling };
        factors.check_finite()?;
        Ok(factors)
    }
}

fn backend(n: usize, reason: &str) -> FactorizationError {
    FactorizationError::Backend { solver: NAME, n, reason: reason.to_owned() }
}

impl LinearSolver for SupernodalSolver {
    fn name(&self) -> &'static str {
        NAME
    }

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        let same = |symbolic: &&Symbolic| symbolic.is_of(pattern) && symbolic.content::<Analysis>().is_some();
        if let Some(symbolic) = earlier.iter().find(same) {
            return Ok(symbolic.clone());
        }
        let n = pattern.n();
        if u32::try_from(pattern.entries()).is_err() {
            return Err(backend(n, "more than 2^32 entries"));
        }
        let row_offsets: Vec<u32> = pattern.row_offsets().iter().map(|&o| o as u32).collect();
        // Rows read as columns: faer factorizes Aᵀ, and the two solves swap roles below.
        let transposed = SymbolicSparseColMatRef::new_checked(n, n, &row_offsets, None, pattern.columns());
        let symbolic =
            factorize_symbolic_lu(transposed, Default::default()).map_err(|error| backend(n, &error.to_string()))?;
        Ok(Symbolic::new(pattern, Analysis { row_offsets, symbolic: Arc::new(symbolic) }))
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        Ok(Box::new(self.factorize_matrix(symbolic, a)?))
    }
}

/// Factors of a [`SupernodalSolver`].
#[derive(Debug)]
pub struct SupernodalFactorization {
    symbolic: Arc<SymbolicLu<u32>>,
    numeric: NumericLu<u32, f64>,
    scaling: Scaling,
}

impl SupernodalFactorization {
    /// faer divides by zero pivots without notice; a test solve detects it.
    fn check_finite(&self) -> Result<(), FactorizationError> {
        let mut test: Vec<f64> = (0..self.n()).map(|i| 1.0 + (i % 7) as f64 / 7.0).collect();
        self.solve(&mut test);
        if test.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        Err(FactorizationError::Inaccurate { solver: NAME, residual: f64::NAN })
    }

    /// Solves with A (`transpose` unset) or Aᵀ for all columns of `rhs`.
    fn run(&self, transpose: bool, rhs: &mut [f64]) {
        let n = self.n();
        assert!(rhs.len().is_multiple_of(n.max(1)));
        if rhs.is_empty() {
            return;
        }
        let (before, after) = if transpose {
            (&self.scaling.columns, &self.scaling.rows)
        } else {
            (&self.scaling.rows, &self.scaling.columns)
        };
        let multiply = |rhs: &mut [f64], factors: &[f64]| {
            for column in rhs.chunks_exact_mut(n) {
                column.iter_mut().zip(factors).for_each(|(x, factor)| *x *= factor);
            }
        };
        multiply(rhs, before);
        let columns = rhs.len() / n;
        let scratch = self.symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        let stack = MemStack::new(&mut memory);
        let factors = LuRef::new_unchecked(&self.symbolic, &self.numeric);
        let matrix = MatMut::from_column_major_slice_mut(rhs, n, columns);
        if transpose {
            factors.solve_in_place_with_conj(Conj::No, matrix, Par::Seq, stack);
        } else {
            factors.solve_transpose_in_place_with_conj(Conj::No, matrix, Par::Seq, stack);
        }
        multiply(rhs, after);
    }
}

impl Factorization for SupernodalFactorization {
    fn solve(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.n(), "the right-hand side needs one entry per unknown");
        self.run(false, rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.n(), "the right-hand side needs one entry per unknown");
        self.run(true, rhs);
    }

    fn n(&self) -> usize {
        self.scaling.rows.len()
    }

    /// An estimate: faer does not report it. Contact problems of 30 000 to 100 000 unknowns peaked
    /// at about 200 to 275 n^(4/3) entries.
    fn bytes(&self) -> usize {
        let n = self.n() as f64;
        (8.0 * (250.0 * n.powf(4.0 / 3.0)).min(n * n)) as usize
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }

    fn solve_many(&self, rhs: &mut [f64]) {
        self.run(false, rhs);
    }

    fn solve_transpose_many(&self, rhs: &mut [f64]) {
        self.run(true, rhs);
    }
}
