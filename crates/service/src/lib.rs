//! The room between the library and its front ends: a case is [read], [checked](check) against the
//! machine's [memory], and run.
//!
//! Requests and answers are plain data, and every request fails with a [`Failure`](failure::Failure).
//! The program's text, events and exit status and the exceptions of the Python package are
//! renderings of them. Nothing here prints, reads a command line or knows an interpreter.

pub mod check;
pub mod failure;
pub mod memory;
pub mod read;
pub mod run;
