//! The extension module of the Python package `slipstick`.
//!
//! The classes that users see are written in Python, in `python/slipstick`, with their
//! documentation. They build on this module: it converts arguments and results, releases the
//! interpreter while Rust computes, and turns every failure into an exception. It never prints.
//!
//! The crate is empty without its feature `python`, which needs a Python interpreter to link
//! against; maturin sets it.
#![cfg(feature = "python")]

mod arrays;
mod case;
mod errors;
mod gradient;
mod interrupt;
mod mesh;
mod path;
mod problem;
mod program;
mod quantity;
mod responses;
mod run;

/// The extension module behind the classes of the package.
#[pyo3::pymodule]
mod _slipstick {
    #[pymodule_export]
    use super::case::{Case, templates};
    #[pymodule_export]
    use super::gradient::Linearization;
    #[pymodule_export]
    use super::mesh::{read_mesh, second_order_hexahedra, volumes};
    #[pymodule_export]
    use super::path::Path;
    #[pymodule_export]
    use super::problem::{Problem, set_threads, threads};
    #[pymodule_export]
    use super::program::main;
    #[pymodule_export]
    use super::run::{Run, optimize, resume};

    /// Version of slipstick.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
