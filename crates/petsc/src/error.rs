//! Errors of PETSc.

/// An error of PETSc or MPI.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PetscError {
    /// MPI or PETSc could not be started, or was ended earlier in this process.
    #[error("PETSc cannot be started (error {code}); a process can start it once")]
    Start {
        /// PETSc's error code.
        code: i32,
    },
    /// A call failed.
    #[error("PETSc failed at {call} (error {code}): {message}")]
    Call {
        /// The attempted operation.
        call: &'static str,
        /// PETSc's error code.
        code: i32,
        /// PETSc's first message.
        message: String,
    },
    /// Options contain a character that C strings cannot contain.
    #[error("the options for PETSc contain a zero byte")]
    Options,
    /// The options do not solve a small system.
    #[error("these options do not solve a small test system: {reason}")]
    Rehearsal {
        /// The solver's message.
        reason: String,
    },
    /// No solver uses some of the options.
    #[error("no solver uses {options}")]
    Unused {
        /// The options, with their dashes.
        options: String,
    },
}
