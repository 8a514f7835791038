//! Matrices and factors of PETSc, with their lifetimes.

use crate::error::PetscError;
use crate::ffi::{self, RawFactors, RawFacts, RawMatrix};
use crate::session::{Session, check};
use slipstick_linalg::{CsrPattern, FactorPart, Layout};
use std::ffi::{CStr, c_void};
use std::sync::Arc;

/// The matrix that is factorized, which determines the prefix of its options.
#[derive(Debug, Clone)]
pub(crate) enum Kind {
    /// The whole matrix: options without a prefix.
    Whole,
    /// The contact zone: options with the prefix `zone_`.
    Zone,
    /// The bodies, with three unknowns per node: options with the prefix `bulk_`.
    Bulk,
}

/// A PETSc matrix whose entries are given as those of the ranks' parts.
#[derive(Debug)]
pub(crate) struct DistributedMatrix {
    session: Session,
    raw: *mut RawMatrix,
}

// SAFETY: the pointer is used only under the session's lock.
unsafe impl Send for DistributedMatrix {}
// SAFETY: as above.
unsafe impl Sync for DistributedMatrix {}

impl DistributedMatrix {
    /// With the entries of `pattern` on this rank, whose values are not set yet.
    pub(crate) fn new(
        session: &Session,
        pattern: &CsrPattern,
        layout: &Layout,
        kind: &Kind,
    ) -> Result<Self, PetscError> {
        let block = if matches!(kind, Kind::Bulk) { 3 } else { 1 };
        let (own, n) = (layout.own() as i64, pattern.n() as i64);
        let mut rows = Rows::new(pattern, layout, &|_| 0.0);
        let mut matrix = Self { session: session.clone(), raw: std::ptr::null_mut() };
        let calls = session.calls();
        let data = (&raw mut rows).cast();
        // SAFETY: a live session; `give_row` gets `rows`, which outlives the call and has `n` rows. `Drop`
        // frees the objects that were made.
        let code = unsafe { ffi::ss_matrix_new(*calls, own, n, block, n, give_row, data, &mut matrix.raw) };
        let made = check(&calls, "making the matrix", code);
        drop(calls);
        made.map(|()| matrix)
    }

    /// Sets the values: `value` gives those of this rank's part by their positions in the pattern.
    pub(crate) fn set(
        &self,
        pattern: &CsrPattern,
        layout: &Layout,
        value: &dyn Fn(usize) -> f64,
    ) -> Result<(), PetscError> {
        let mut rows = Rows::new(pattern, layout, value);
        let calls = self.session.calls();
        let data = (&raw mut rows).cast();
        // SAFETY: a live session and matrix; `give_row` gets `rows`, which outlives the call and has `n` rows.
        let code = unsafe { ffi::ss_matrix_set(*calls, self.raw, pattern.n() as i64, give_row, data) };
        check(&calls, "assembling the matrix", code)
    }

    /// Sets the coordinates of this rank's nodes, from which PETSc forms rigid motions.
    pub(crate) fn set_rigid_motions(&self, coordinates: &[f64]) -> Result<(), PetscError> {
        let calls = self.session.calls();
        // SAFETY: a live session and matrix; there is a coordinate per row of this rank.
        let code = unsafe { ffi::ss_matrix_rigid(*calls, self.raw, coordinates.as_ptr()) };
        check(&calls, "setting rigid motions", code)
    }
}

impl Drop for DistributedMatrix {
    fn drop(&mut self) {
        let _calls = self.session.calls();
        // SAFETY: made by the shim, or null, and freed once.
        unsafe { ffi::ss_matrix_free(self.raw) };
    }
}

/// The rows of a rank's part, one at a time.
struct Rows<'a> {
    pattern: &'a CsrPattern,
    layout: &'a Layout,
    value: &'a dyn Fn(usize) -> f64,
    /// Of the latest row, in PETSc's numbering, in which unknowns of the first rank come first.
    columns: Vec<i32>,
    values: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn new(pattern: &'a CsrPattern, layout: &'a Layout, value: &'a dyn Fn(usize) -> f64) -> Self {
        Self { pattern, layout, value, columns: Vec::new(), values: Vec::new() }
    }
}

/// States the `k`-th row of [`Rows`].
///
/// # Safety
/// `data` points to `Rows` with more than `k` rows, which nothing else uses, and the others to places for
/// the answer.
unsafe extern "C" fn give_row(
    data: *mut c_void,
    k: i64,
    row: *mut i32,
    count: *mut i32,
    columns: *mut *const i32,
    values: *mut *const f64,
) {
    // SAFETY: as for this function.
    let rows = unsafe { &mut *data.cast::<Rows<'_>>() };
    let k = k as usize;
    rows.columns.clear();
    rows.columns.extend(rows.pattern.row(k).iter().map(|&column| rows.layout.number(column as usize) as i32));
    rows.values.clear();
    rows.values.extend(rows.pattern.row_range(k).map(rows.value));
    // SAFETY: as for this function.
    unsafe {
        *row = rows.layout.number(k) as i32;
        *count = rows.columns.len() as i32;
        *columns = rows.columns.as_ptr();
        *values = rows.values.as_ptr();
    }
}

/// The properties that a factorization reports.
#[derive(Debug, Clone)]
pub(crate) struct Facts {
    pub(crate) name: String,
    pub(crate) direct: bool,
    pub(crate) transposes: bool,
    pub(crate) mumps_error: i32,
    pub(crate) mumps_detail: i64,
    pub(crate) bytes: usize,
    pub(crate) operations: f64,
    /// The share of this rank.
    pub(crate) part: FactorPart,
}

/// A KSP with its factors.
#[derive(Debug)]
pub(crate) struct Factors {
    session: Session,
    raw: *mut RawFactors,
    /// The factorized matrix.
    matrix: Arc<DistributedMatrix>,
    /// Number of unknowns of this rank.
    own: usize,
}

// SAFETY: the pointer is used only under the session's lock.
unsafe impl Send for Factors {}
// SAFETY: as above.
unsafe impl Sync for Factors {}

impl Factors {
    pub(crate) fn new(
        session: &Session,
        matrix: &Arc<DistributedMatrix>,
        layout: &Layout,
        kind: &Kind,
    ) -> Result<Self, PetscError> {
        let number = match kind {
            Kind::Whole => 0,
            Kind::Zone => 1,
            Kind::Bulk => 2,
        };
        let own = layout.own();
        let mut factors = Self { session: session.clone(), raw: std::ptr::null_mut(), matrix: matrix.clone(), own };
        let calls = session.calls();
        // SAFETY: a live session and matrix. `Drop` frees the objects that were made.
        let code = unsafe { ffi::ss_factors_new(*calls, matrix.raw, number, &mut factors.raw) };
        let result = check(&calls, "making the solver", code);
        drop(calls);
        result.map(|()| factors)
    }

    /// Factorizes the current matrix, with the previous analysis if there is one.
    pub(crate) fn renew(&self, workspace: i32) -> Result<Facts, PetscError> {
        let mut raw = RawFacts {
            direct: 0,
            transposes: 0,
            is_mumps: 0,
            mumps_error: 0,
            mumps_detail: 0,
            megabytes: 0.0,
            operations: 0.0,
            megabytes_here: 0.0,
            operations_here: 0.0,
            name: [0; 64],
        };
        let calls = self.session.calls();
        // SAFETY: live objects of the shim, and a place for the facts.
        let code = unsafe { ffi::ss_factors_renew(*calls, self.raw, self.matrix.raw, workspace, &mut raw) };
        check(&calls, "factorizing", code)?;
        // SAFETY: the shim ends the name with a zero, within its length.
        let name = unsafe { CStr::from_ptr(raw.name.as_ptr()) }.to_string_lossy().into_owned();
        Ok(Facts {
            name,
            direct: raw.direct != 0,
            transposes: raw.transposes != 0,
            mumps_error: raw.mumps_error,
            mumps_detail: raw.mumps_detail,
            bytes: (1e6 * raw.megabytes) as usize,
            operations: raw.operations,
            part: FactorPart { bytes: (1e6 * raw.megabytes_here) as usize, operations: raw.operations_here },
        })
    }

    /// A⁻¹ `rhs` or A⁻ᵀ `rhs`, of which this rank has its part.
    pub(crate) fn solve(&self, transpose: bool, rhs: &[f64]) -> Result<Vec<f64>, PetscError> {
        assert_eq!(rhs.len(), self.own, "a right-hand side has an entry per unknown of the rank");
        let mut x = vec![0.0; rhs.len()];
        let calls = self.session.calls();
        // SAFETY: live objects of the shim; both arrays have an entry per row of this rank.
        let code =
            unsafe { ffi::ss_factors_solve(*calls, self.raw, i32::from(transpose), rhs.as_ptr(), x.as_mut_ptr()) };
        check(&calls, "solving", code)?;
        Ok(x)
    }
}

impl Drop for Factors {
    fn drop(&mut self) {
        let _calls = self.session.calls();
        // SAFETY: made by the shim, or null, and freed once.
        unsafe { ffi::ss_factors_free(self.raw) };
    }
}
