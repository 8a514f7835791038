//! What PETSc refuses.

/// What PETSc or MPI refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PetscError {
    /// MPI or PETSc could not be started, or were ended in this process before.
    #[error("PETSc cannot be started (error {code}); a process can start it once")]
    Start {
        /// PETSc's error code.
        code: i32,
    },
    /// A call failed.
    #[error("PETSc failed at {call} (error {code}): {message}")]
    Call {
        /// What was tried.
        call: &'static str,
        /// PETSc's error code.
        code: i32,
        /// PETSc's first message.
        message: String,
    },
    /// Options hold a character that C cannot take.
    #[error("the options for PETSc hold a zero byte")]
    Options,
    /// A small system is not solved with the options.
    #[error("a small test system is not solved with these options: {reason}")]
    Rehearsal {
        /// What the solver says.
        reason: String,
    },
    /// No solver has asked for some of the options.
    #[error("no solver has asked for {options}")]
    Unused {
        /// The options, with their dashes.
        options: String,
    },
}
