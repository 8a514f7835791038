//! The Rust side of the Python package `slipstick`.
//!
//! The classes that users see are written in Python, in `python/slipstick`, with their
//! documentation. They build on this crate: it converts arguments and results, releases the
//! interpreter while Rust computes, and turns every failure into an exception. It never prints.
//! `slipstick-wheel` makes the extension module of it.
//!
//! The crate is empty without its feature `python`, which needs a Python interpreter to link
//! against.
#![cfg(feature = "python")]

mod arrays;
mod built;
mod case;
mod compute;
mod errors;
mod gradient;
mod host;
mod interrupt;
mod mesh;
mod parameters;
mod path;
mod problem;
mod quantity;
mod responses;
mod run;

pub use case::{Case, templates};
pub use gradient::Linearization;
pub use mesh::{read_mesh, second_order_elements, volumes};
pub use path::Path;
pub use problem::{Problem, set_threads, threads};
pub use run::{Run, optimize, resume};
