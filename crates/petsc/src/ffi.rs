//! Declarations of `shim.h`.

use std::ffi::{c_char, c_int, c_void};

/// MPI and PETSc.
#[repr(C)]
pub struct RawSession {
    _private: [u8; 0],
}

/// A distributed matrix.
#[repr(C)]
pub struct RawMatrix {
    _private: [u8; 0],
}

/// A KSP with its factors.
#[repr(C)]
pub struct RawFactors {
    _private: [u8; 0],
}

/// `ss_facts`: the properties that a factorization reports.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct RawFacts {
    pub direct: i32,
    pub transposes: i32,
    pub is_mumps: i32,
    pub mumps_error: i32,
    pub mumps_detail: i64,
    pub megabytes: f64,
    pub operations: f64,
    pub megabytes_here: f64,
    pub operations_here: f64,
    pub name: [c_char; 64],
}

/// `ss_row`: states a row of a matrix.
pub type GiveRow = unsafe extern "C" fn(
    data: *mut c_void,
    k: i64,
    row: *mut i32,
    count: *mut i32,
    columns: *mut *const i32,
    values: *mut *const f64,
);

unsafe extern "C" {
    pub fn ss_start(out: *mut *mut RawSession) -> c_int;
    pub fn ss_end(session: *mut RawSession);
    pub fn ss_message(session: *mut RawSession, text: *mut c_char, capacity: i64) -> c_int;
    pub fn ss_rank(session: *const RawSession) -> i32;
    pub fn ss_size(session: *const RawSession) -> i32;
    pub fn ss_size_here(session: *const RawSession) -> i32;
    pub fn ss_options(session: *mut RawSession, options: *const c_char) -> c_int;
    pub fn ss_unused(session: *mut RawSession, text: *mut c_char, capacity: i64) -> c_int;

    pub fn ss_sum(session: *mut RawSession, values: *mut f64, count: i64);
    pub fn ss_any(session: *mut RawSession, here: i32) -> i32;
    pub fn ss_gather_lengths(session: *mut RawSession, length: i64, lengths: *mut i64);
    pub fn ss_gather(session: *mut RawSession, here: *const c_char, lengths: *const i64, all: *mut c_char);
    pub fn ss_exchange(session: *mut RawSession, values: *const f64, to: *const i64, all: *mut f64, from: *const i64);
    pub fn ss_meet(session: *mut RawSession, seconds: f64) -> i32;
    pub fn ss_abort(session: *mut RawSession, code: i32);

    pub fn ss_matrix_new(
        session: *mut RawSession,
        own: i64,
        n: i64,
        block: i32,
        rows: i64,
        give: GiveRow,
        data: *mut c_void,
        out: *mut *mut RawMatrix,
    ) -> c_int;
    pub fn ss_matrix_set(
        session: *mut RawSession,
        matrix: *mut RawMatrix,
        rows: i64,
        give: GiveRow,
        data: *mut c_void,
    ) -> c_int;
    pub fn ss_matrix_rigid(session: *mut RawSession, matrix: *mut RawMatrix, coordinates: *const f64) -> c_int;
    pub fn ss_matrix_free(matrix: *mut RawMatrix);

    pub fn ss_factors_new(
        session: *mut RawSession,
        matrix: *mut RawMatrix,
        kind: i32,
        out: *mut *mut RawFactors,
    ) -> c_int;
    pub fn ss_factors_renew(
        session: *mut RawSession,
        factors: *mut RawFactors,
        matrix: *mut RawMatrix,
        workspace: i32,
        facts: *mut RawFacts,
    ) -> c_int;
    pub fn ss_factors_solve(
        session: *mut RawSession,
        factors: *mut RawFactors,
        transpose: i32,
        rhs: *const f64,
        x: *mut f64,
    ) -> c_int;
    pub fn ss_factors_free(factors: *mut RawFactors);
}
