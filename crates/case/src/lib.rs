//! Case files: [`mod@file`] reads and checks a file, [`construct`] turns it into a problem, and
//! [`check`] inspects the problem before anything is solved. [`quantity`] lists what can be measured,
//! minimized and bounded.

pub mod check;
pub mod construct;
pub mod file;
pub mod quantity;
