//! How the program ends.

use std::process::{ExitCode, Termination};

use slipstick_service::failure::Failure;

/// The program's exit codes. Invalid command lines also end with 2, which is clap's own code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Ok = 0,
    /// Wrong command line, case file or other input.
    BadInput = 2,
    /// The analysis failed.
    AnalysisFailed = 3,
    /// Interrupted; the results so far are on disk.
    Interrupted = 4,
}

impl From<&Failure> for Exit {
    fn from(failure: &Failure) -> Self {
        match failure {
            Failure::Case(_) | Failure::Input { .. } => Self::BadInput,
            Failure::Analysis { .. } | Failure::Check { .. } => Self::AnalysisFailed,
            Failure::Interrupted { .. } => Self::Interrupted,
        }
    }
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        ExitCode::from(self as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `--help` lists them.
    #[test]
    fn failures_have_their_exit_code() {
        let check = Failure::Check { message: String::new(), cure: String::new() };
        let interrupted = Failure::Interrupted { message: String::new(), resume: None };
        let codes = [&Failure::Case(Vec::new()), &Failure::input("", ""), &check, &interrupted];
        assert_eq!(codes.map(|failure| Exit::from(failure) as u8), [2, 2, 3, 4]);
    }
}
