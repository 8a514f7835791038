//! The command line, as typed.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use slipstick::case::{Memory, Override};

use clap::{ArgAction, Args, Parser, Subcommand, ValueHint};

mod help;
mod results;
mod values;

pub use help::{Completions, Explain, Man, SchemaOf};
pub use results::{Export, Report, Threshold};
use values::{count, fraction, memory, not_negative, override_of, positive, size, step};

/// Topology optimization of bodies in three-dimensional finite-deformation frictional contact.
#[derive(Debug, Clone, Parser)]
#[command(
    name = "slipstick",
    version,
    propagate_version = true,
    arg_required_else_help = true,
    after_help = "Exit codes:\n  0  done\n  2  wrong command line, case file or other input; results cannot be written\n  \
                  3  the analysis failed, or a gradient is not what differences say\n  4  interrupted: Ctrl-C stops when the current attempt at a load step ends, twice at once; finished iterations are on disk\n\n\
                  A first run:\n  slipstick new half-ball\n  slipstick check half_ball.toml\n  \
                  slipstick optimize half_ball.toml"
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Options of every command.
    #[command(flatten)]
    pub common: Common,
}

/// Options of every command.
#[derive(Debug, Clone, Args)]
pub struct Common {
    /// Print results and errors as JSON, one object per line, on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// Threads; results do not depend on them [default: the case file's, else all cores]
    #[arg(long, global = true, value_name = "NUMBER", value_parser = count)]
    pub threads: Option<NonZeroUsize>,
    /// Print errors only
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print more: load steps; twice: Newton iterations
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
}

/// A command.
#[derive(Debug, Clone, Subcommand)]
pub enum Command {
    /// Write a commented case file to start from
    New(New),
    /// Look at a case without running it: sets, surfaces, initial gaps, loose bodies, size
    Check(Check),
    /// Forward analysis of the start design, or of a given one
    Solve(Solve),
    /// Objective and its gradient with respect to the densities
    Gradient(Gradient),
    /// Optimize the design
    Optimize(Optimize),
    /// Check derivatives on your own model
    Verify(Verify),
    /// Go on with an optimization that was interrupted, or make more iterations
    Resume(Resume),
    /// Evaluate a design under other conditions
    Evaluate(Evaluate),
    /// Draw results as a PNG picture
    Render(Render),
    /// Do all runs that a file lists, but those that are done, with tables and pictures
    Study(Study),
    /// Write a run as one web page: a view that turns, curves, tables, the case
    Report(Report),
    /// Write a design as a closed triangle surface for CAD, meshing or printing
    Export(Export),
    /// Explain the code of an error or warning about a case file
    Explain(Explain),
    /// Write the JSON schema of case files, with which editors complete and check them
    Schema(SchemaOf),
    /// Write the script that completes commands and options in a shell
    Completions(Completions),
    /// Write the manual page
    #[command(hide = true)]
    Man(Man),
    /// Measure where the time of analysis and gradient goes, by size and number of threads
    Bench(Bench),
}

/// Arguments of `new`.
#[derive(Debug, Clone, Args)]
pub struct New {
    /// Which template; without it, all are listed
    #[arg(value_name = "TEMPLATE")]
    pub template: Option<String>,
    /// Write a case for this mesh (.msh, .inp, .vtu), with its bodies and surfaces by name: the template `my-mesh`
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub mesh: Option<PathBuf>,
    /// File to write; `-` is standard output [default: the template's name, or the mesh file's, with `.toml`]
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Replace the file where it exists
    #[arg(long)]
    pub force: bool,
}

/// The case file.
#[derive(Debug, Clone, Args)]
pub struct CaseFile {
    /// The case file
    #[arg(value_name = "CASE", value_hint = ValueHint::FilePath)]
    pub case: PathBuf,
    /// Replace or add a value, as in `contact[0].friction=0.1`; may be given several times
    #[arg(long, value_name = "KEY=VALUE", value_parser = override_of)]
    pub set: Vec<Override>,
}

impl From<&Path> for CaseFile {
    /// The file as it is.
    fn from(case: &Path) -> Self {
        Self { case: case.to_owned(), set: Vec::new() }
    }
}

/// Where results go.
#[derive(Debug, Clone, Args)]
pub struct Out {
    /// Directory for results [default: the case file's `output.directory`, else its name without `.toml`, beside it; all
    /// commands but `optimize` add `_` and their name]
    #[arg(short, long, value_name = "DIRECTORY", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Replace results of an earlier run in that directory
    #[arg(long)]
    pub force: bool,
}

/// A design other than the case's uniform start.
#[derive(Debug, Clone, Args)]
pub struct DesignFrom {
    /// Take the densities from results of an optimization: its directory, or a table of densities (.csv)
    #[arg(long, value_name = "RESULTS", value_hint = ValueHint::AnyPath)]
    pub design: Option<PathBuf>,
}

/// Arguments of `check`.
#[derive(Debug, Clone, Args)]
pub struct Check {
    /// The case file.
    #[command(flatten)]
    pub case: CaseFile,
    /// Print the case with all defaults filled in, as a case file
    #[arg(long)]
    pub resolved: bool,
    /// Predict memory on so many ranks of MPI as well, which a build with PETSc runs on
    #[arg(long, value_name = "NUMBER", value_parser = count)]
    pub ranks: Option<NonZeroUsize>,
}

/// Arguments of `solve`.
#[derive(Debug, Clone, Args)]
pub struct Solve {
    /// The case file.
    #[command(flatten)]
    pub case: CaseFile,
    /// The design.
    #[command(flatten)]
    pub design: DesignFrom,
    /// Where results go.
    #[command(flatten)]
    pub out: Out,
}

/// Arguments of `gradient`.
#[derive(Debug, Clone, Args)]
pub struct Gradient {
    /// The case file.
    #[command(flatten)]
    pub case: CaseFile,
    /// The design.
    #[command(flatten)]
    pub design: DesignFrom,
    /// Where results go.
    #[command(flatten)]
    pub out: Out,
}

/// Arguments of `optimize`.
#[derive(Debug, Clone, Args)]
pub struct Optimize {
    /// The case file.
    #[command(flatten)]
    pub case: CaseFile,
    /// The start design.
    #[command(flatten)]
    pub design: DesignFrom,
    /// Where results go.
    #[command(flatten)]
    pub out: Out,
    /// Most iterations [default: the case file's]
    #[arg(long, value_name = "NUMBER", value_parser = count)]
    pub iterations: Option<NonZeroUsize>,
}

/// Arguments of `verify`.
#[derive(Debug, Clone, Args)]
pub struct Verify {
    /// What to check.
    #[command(subcommand)]
    pub what: VerifyWhat,
}

/// What `verify` checks.
#[derive(Debug, Clone, Subcommand)]
pub enum VerifyWhat {
    /// The gradient against central differences (one-sided at densities near 0 or 1), at halved steps: the error falls as the
    /// square of the step, but at kinks
    Gradient(VerifyGradient),
}

/// Arguments of `verify gradient`.
#[derive(Debug, Clone, Args)]
pub struct VerifyGradient {
    /// The case file.
    #[command(flatten)]
    pub case: CaseFile,
    /// The design.
    #[command(flatten)]
    pub design: DesignFrom,
    /// Elements to differentiate by one at a time, spread over the design; costs two analyses each and step
    #[arg(long, value_name = "NUMBER", default_value_t = 5)]
    pub elements: usize,
    /// Random directions over the whole design, and as many over the densities near 0 or 1; cost as much as an element
    #[arg(long, value_name = "NUMBER", default_value_t = 2)]
    pub directions: usize,
    /// First step in density
    #[arg(long, value_name = "STEP", default_value = "1e-4", value_parser = step)]
    pub step: f64,
    /// How often the step is halved
    #[arg(long, value_name = "NUMBER", default_value_t = 3)]
    pub halvings: u32,
    /// Relative error up to which the gradient counts as right
    #[arg(long, value_name = "ERROR", default_value = "1e-5", value_parser = positive)]
    pub tolerance: f64,
    /// Where results go.
    #[command(flatten)]
    pub out: Out,
}

/// Arguments of `resume`.
#[derive(Debug, Clone, Args)]
pub struct Resume {
    /// Directory of the optimization
    #[arg(value_name = "RESULTS", value_hint = ValueHint::DirPath)]
    pub results: PathBuf,
    /// Most iterations in all [default: what was asked for before]
    #[arg(long, value_name = "NUMBER", value_parser = count)]
    pub iterations: Option<NonZeroUsize>,
    /// Refused, with what does it: a run keeps its case
    #[arg(long, value_name = "KEY=VALUE", hide = true)]
    pub set: Vec<String>,
}

/// Arguments of `evaluate`.
#[derive(Debug, Clone, Args)]
pub struct Evaluate {
    /// The case file.
    #[command(flatten)]
    pub case: CaseFile,
    /// Take the densities from results of an optimization: its directory, or a table of densities (.csv)
    #[arg(long, value_name = "RESULTS", value_hint = ValueHint::AnyPath)]
    pub design: PathBuf,
    /// Coefficients of friction for all contact pairs, one evaluation each [default: the case file's]
    #[arg(long, value_name = "MU", value_delimiter = ',', value_parser = not_negative)]
    pub friction: Vec<f64>,
    /// Where results go.
    #[command(flatten)]
    pub out: Out,
}

/// Arguments of `render`.
#[derive(Debug, Clone, Args)]
pub struct Render {
    /// Directory of a run; with --history several, or tables of histories (.csv)
    #[arg(value_name = "RESULTS", required = true, value_hint = ValueHint::AnyPath)]
    pub results: Vec<PathBuf>,
    /// Objectives and volume fractions over the iterations, all runs in one frame
    #[arg(long, conflicts_with_all = ["field", "step", "iteration", "failure", "view", "deformed", "threshold", "smooth", "bodies"])]
    pub history: bool,
    /// Only these runs, by name, in this order; with --history
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "history")]
    pub runs: Vec<String>,
    /// Text above; with --history
    #[arg(long, value_name = "TEXT", requires = "history")]
    pub title: Option<String>,
    /// What gives the colours: pressure, gap, displacement, …; an unknown name lists all [default: density, or where all
    /// densities are 1, as without a designed body, contact pressure or displacement]
    #[arg(long, value_name = "NAME")]
    pub field: Option<String>,
    /// The state at the end of a load step [default: the newest design, at the last step where that is there]
    #[arg(long, value_name = "NUMBER", conflicts_with = "iteration")]
    pub step: Option<usize>,
    /// The design of an iteration, undeformed
    #[arg(long, value_name = "NUMBER")]
    pub iteration: Option<usize>,
    /// The iterate at which a load step failed for good, by default with the smallest determinant of each element
    #[arg(long, conflicts_with_all = ["step", "iteration"])]
    pub failure: bool,
    /// From where: iso, front, side, top, …; an unknown name lists all [default: iso; contact from its side]
    #[arg(long, value_name = "NAME")]
    pub view: Option<String>,
    /// Factor on displacements, 0 for the undeformed shape [default: 1]
    #[arg(long, value_name = "SCALE", value_parser = not_negative)]
    pub deformed: Option<f64>,
    /// Elements with no more density are left out [default: 0.5; 0 where the design has none above, and with
    /// --failure; with --smooth the one of the densities' volume]
    #[arg(long, value_name = "DENSITY", value_parser = fraction)]
    pub threshold: Option<f64>,
    /// The design as the smooth surface that `export` writes, undeformed, above the density of the same volume unless
    /// --threshold says another
    #[arg(long, conflicts_with_all = ["field", "failure", "deformed"])]
    pub smooth: bool,
    /// Show these bodies and nothing else [default: those with the field, others as context]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub bodies: Vec<String>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "900x720", value_parser = size)]
    pub size: (u32, u32),
    /// File to write [default: picture.png in the directory; history.png with --history, if it is one directory]
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
}

/// Arguments of `study`.
#[derive(Debug, Clone, Args)]
pub struct Study {
    /// The list of runs, a TOML file
    #[arg(value_name = "STUDY", value_hint = ValueHint::FilePath)]
    pub study: PathBuf,
    /// Only these runs, by name
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Say what would be done, and do nothing
    #[arg(long)]
    pub plan: bool,
}

/// Arguments of `bench`.
#[derive(Debug, Clone, Args)]
pub struct Bench {
    /// A case file [default: a half ball pressed into a plate and slid over it, in several sizes]
    #[arg(value_name = "CASE", value_hint = ValueHint::FilePath)]
    pub case: Option<PathBuf>,
    /// The design.
    #[command(flatten)]
    pub design: DesignFrom,
    /// Sizes of the half ball on its plate: elements, about; on ranks of MPI the first
    #[arg(
        long,
        value_name = "NUMBERS",
        value_delimiter = ',',
        default_value = "1000,3000,9400",
        conflicts_with_all = ["case", "design"],
        value_parser = count
    )]
    pub sizes: Vec<NonZeroUsize>,
    /// Numbers of threads; on ranks of MPI the first
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "1,2", value_parser = count)]
    pub threads: Vec<NonZeroUsize>,
    /// Load steps from the start of the path [default: all of a case; 10 of the half ball's 50]
    #[arg(long, value_name = "NUMBER", value_parser = count)]
    pub steps: Option<NonZeroUsize>,
    /// Memory for factors that are kept for the gradient [default: the case's `adjoint.memory`]
    #[arg(long, value_name = "MEMORY", value_parser = memory)]
    pub memory: Option<Memory>,
    /// Measure the time that processors spend on it, all threads together, instead of the time that passes
    #[arg(long)]
    pub cpu: bool,
    /// Measure in this process, once
    #[arg(long, hide = true)]
    pub worker: bool,
}

#[cfg(test)]
mod tests;
