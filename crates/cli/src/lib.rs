//! The parts of the slipstick program: command line, reading of case files with reports of their errors, exit codes.

pub mod args;
pub mod case_file;
pub mod exit;
