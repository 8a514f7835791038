//! Result files: VTU meshes with fields, PVD collections of them over time, CSV tables, result files of
//! CalculiX ([`Frd`]); with the feature `vtkhdf` also whole load paths as one VTKHDF file (`VtkHdf`).
//!
//! Files appear complete or not at all: data are written to a temporary file next to the target,
//! which is then renamed. CSV tables grow one row at a time; each row is written in a single call.
//!
//! ```
//! use slipstick_results::output::{Csv, Pvd, Values, Vtu};
//! # let folder = std::env::temp_dir().join(format!("slipstick-doc-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! let points = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.],
//!               [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];
//! let mut vtu = Vtu::new(&points, &[slipstick_mesh::Element::Hex8([0, 1, 2, 3, 4, 5, 6, 7])])?;
//! vtu.point_field("displacement", 3, Values::F64(&[0.0; 24]))?;
//! vtu.cell_field("density", 1, Values::F64(&[0.5]))?;
//! vtu.save(&folder.join("step_1.vtu"))?;
//!
//! let mut pvd = Pvd::default();
//! pvd.add(1.0, "step_1.vtu")?;
//! pvd.save(&folder.join("steps.pvd"))?;
//!
//! let mut csv = Csv::create(&folder.join("history.csv"), &["iteration", "objective"])?;
//! csv.row(&[1usize.into(), (-8.31).into()])?;
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod atomic;
mod csv;
mod error;
pub mod fields;
mod frd;
#[cfg(feature = "vtkhdf")]
mod hdf5;
mod pvd;
mod pvtu;
mod read;
#[cfg(feature = "vtkhdf")]
mod vtkhdf;
mod vtu;

pub(crate) use atomic::whole_name;
pub use atomic::write_atomically;
pub use csv::{Cell, Csv};
pub use error::OutputError;
pub use frd::Frd;
pub use pvd::Pvd;
pub use read::{StoredField, read_fields};
#[cfg(feature = "vtkhdf")]
pub use vtkhdf::VtkHdf;
pub use vtu::{Values, Vtu};

/// The text escaped for an XML attribute.
fn xml(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            _ => escaped.push(c),
        }
    }
    escaped
}
