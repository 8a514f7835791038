//! Case files: [`case`] reads and checks a file, [`build`] turns it into a problem, and [`check`]
//! inspects the problem before anything is solved.

pub mod build;
pub mod case;
pub mod check;
