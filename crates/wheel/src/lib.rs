//! What the wheel installs in one library: the Python module `slipstick_python`, and the program.
//!
//! The crate is empty without its feature `python`, which needs a Python interpreter to link
//! against; maturin sets it.
#![cfg(feature = "python")]

mod program;

/// The extension module behind the classes of the package.
#[pyo3::pymodule]
mod _slipstick {
    #[pymodule_export]
    use super::program::main;
    #[pymodule_export]
    use slipstick_python::{
        Case, Linearization, Path, Problem, Run, optimize, read_mesh, resume, second_order_elements, set_threads,
        templates, threads, volumes,
    };

    /// Version of slipstick.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
