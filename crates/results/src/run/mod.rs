//! The files that a run writes and reads, in one directory per run.
//!
//! | file | contents | written |
//! |---|---|---|
//! | `run.json` | who ran what, when, on what machine, and how it ended: [`RunRecord`] | at start and end |
//! | `case.toml` | the case file's text | at start |
//! | `mesh_XXXX.msh`, … | copies of the mesh files that the case names: [`InputFile`] | at start |
//! | `history.csv` | one row per evaluated design: [`History`] | row by row |
//! | `newton.csv` | one row per Newton iteration: [`NewtonTable`] | row by row |
//! | `checkpoint.json` | everything that the next iteration depends on: [`Checkpoint`] | after every iteration |
//! | `warnings.json` | what the program warned of: [`RunWarning`] | with each warning |
//! | `result.json` | the iteration of the best design, if the last one is not the result: [`ResultRecord`] | at the end |
//! | `design.csv` | density of every element of the last evaluated design, at the end of the result; its derivative if an update followed; its design variable, if this is not the density | after every iteration |
//! | `start_values_X.bin` | path of the last design, which the next march follows: [`StartValuesFile`] | after every iteration |
//! | `design_XXXX.vtu`, `design.pvd` | designs as fields, by iteration | every few iterations, as set by `[output]` `every` |
//! | `path_XXXX.vtu`, `path.pvd` | load path of the last evaluated design, by load step | `solve`: after each load step; others: at the end, also of a failed march; `optimize`: also every few iterations |
//! | `quantities.csv` | reactions, contact forces and energies, by load step: [`write_quantities`] | with the load path |
//! | `contact.csv` | resultant and peak pressure of each contact pair, by load step: [`ContactTable`] | with the load path |
//! | `path_XXXX.pvtu`, `path_XXXX.N.vtu`, also for designs | the same in pieces, one per rank | with `[output]` `pieces` |
//! | `path.vtkhdf` | the load steps of `path.pvd` in one file: `VtkHdf` | with `[output]` `vtkhdf`, in a build with the feature `vtkhdf` |
//! | `failure.vtu` | the iterate at which a march finally failed | when this happens |
//! | `gradient.csv`, `gradient.vtu` | dθ/dφ of every element, for runs that compute it | at the end |
//! | `picture.png` | a result as a picture: `slipstick_views::picture` | on request |
//! | `curve.png` | one quantity over another | on request |
//! | `history.png` | the curves of `history.csv` | on request |
//! | `report.html` | the run as a web page: `slipstick_views::report` | on request |
//! | `design.stl` | a design as a surface: `slipstick_views::export` | on request |
//! | `measures.json` | thinnest member and narrowest gap of a design: `slipstick_views::export` | on request |
//! | `responses.json` | objective and constraints that are not those of the case: [`RESPONSES`] | at start |
//! | `run.lock` | nothing; its lock shows that a process is writing here | at start |
//! | `evaluate.csv`, `verify.csv`, `verify.json` | results of runs that evaluate a design or verify its gradient | during the run |
//!
//! Files appear complete or not at all, and tables grow by complete lines, so a killed run leaves
//! its last finished iteration behind, and [`Checkpoint`] continues from it bit for bit. A
//! directory belongs to one run: [`RunDirectory::create`] refuses a directory that contains another
//! run, and only one process at a time writes to it.

mod checkpoint;
mod clock;
mod densities;
mod directory;
mod error;
mod failure;
mod fields;
mod first;
mod inputs;
mod kept;
mod lifetime;
mod lock;
mod loosening;
mod path_writer;
mod places;
mod promises;
mod record;
mod result;
mod seal;
mod start_values;
mod symmetry;
mod tables;
mod transfer;
mod warnings;

pub use checkpoint::Checkpoint;
pub use densities::{design_density, load_density, read_density, write_densities};
pub use directory::RunDirectory;
pub use error::RunError;
pub use failure::FailureReport;
pub use fields::{write_failure, write_path};
pub use first::on_first;
pub use inputs::{InputFile, bytes_of, keep_mesh_files, mesh_files, with_includes};
pub use kept::{Kept, keep_failure};
pub use lifetime::Run;
pub use path_writer::PathWriter;
pub use places::Place;
pub use promises::{Comparison, comparisons, promises, unmet};
pub use record::{ExitState, Machine, RunPart, RunRecord};
pub use result::ResultRecord;
pub use slipstick_case::file::sha256;
pub use start_values::StartValuesFile;
pub use symmetry::{Image, asymmetry};
pub use tables::{ContactTable, FunctionNames, History, NewtonTable, write_evaluations, write_quantities};
pub use transfer::{StoredDesign, load_design};
pub use warnings::RunWarning;

/// The file with the objective and the constraints that the Python package gave a run; `about` and
/// `unit`, if they are there, describe the objective.
pub const RESPONSES: &str = "responses.json";
