//! Case files: [`file`] reads and checks a file, [`construct`] turns it into a problem, and
//! [`check`] inspects the problem before anything is solved.

pub mod check;
pub mod construct;
pub mod file;
