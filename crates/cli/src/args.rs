//! The command line as parsed.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use slipstick::case::{Memory, Override};

use clap::{ArgAction, Args, Parser, Subcommand, ValueHint};

mod help;
mod results;
mod values;

pub use help::{Completions, Explain, Man, SchemaOf};
pub use results::{Export, Report, Threshold, Ui, VerifyDeck};
use values::{count, fraction, memory, not_negative, override_of, positive, size, step};

/// Topology optimization of bodies in three-dimensional finite-deformation frictional contact.
#[derive(Debug, Clone, Parser)]
#[command(
    name = "slipstick",
    version,
    propagate_version = true,
    arg_required_else_help = true,
    after_help = "Exit codes:\n  0  done\n  2  wrong command line, case file or other input; results cannot be written\n  \
                  3  the analysis failed, or a gradient does not agree with finite differences\n  4  interrupted: the first Ctrl-C stops when the current Newton iteration ends, a second one stops at once; finished iterations are on disk. Commands that run nothing (check, render, export, new) end by the signal\n\n\
                  A first run:\n  slipstick new half-ball\n  slipstick check half_ball.toml\n  \
                  slipstick optimize half_ball.toml"
)]
pub struct Cli {
    /// The command.
    #[command(subcommand)]
    pub command: Command,
    /// Options of all commands.
    #[command(flatten)]
    pub common: Common,
}

/// Options of all commands.
#[derive(Debug, Clone, Args)]
pub struct Common {
    /// Print results and errors as JSON, one object per line, on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// Number of threads; results do not depend on it [default: from the case file, otherwise all
    /// cores]
    #[arg(long, global = true, value_name = "NUMBER", value_parser = count)]
    pub threads: Option<NonZeroUsize>,
    /// Print errors only
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print load steps; given twice, also Newton iterations
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
}

/// A command.
#[derive(Debug, Clone, Subcommand)]
pub enum Command {
    /// Write a commented case file to start from
    New(New),
    /// Check a case without running it: sets, surfaces, initial gaps, loose bodies, problem size
    Check(Check),
    /// Run a forward analysis of the initial design, or of a given one
    Solve(Solve),
    /// Compute the objective and its gradient with respect to the densities
    Gradient(Gradient),
    /// Optimize the design
    Optimize(Optimize),
    /// Compare derivatives with finite differences, or a deck with CalculiX, on your own model
    Verify(Verify),
    /// Continue an interrupted optimization, or run more iterations
    Resume(Resume),
    /// Evaluate a design, also with other coefficients of friction
    Evaluate(Evaluate),
    /// Draw results as a PNG picture
    Render(Render),
    /// Run every entry of a study that has not finished yet, with tables and pictures
    Study(Study),
    /// Write a run as one web page: an interactive view, curves, tables, the case
    Report(Report),
    /// Open a page in the browser to edit, check and run cases, and to watch and judge runs
    Ui(Ui),
    /// Write a design as a closed triangle surface, as STEP solids for CAD, or as a deck
    Export(Export),
    /// Explain an error or warning about a case file, by its code
    Explain(Explain),
    /// Write the JSON schema of case files, for completion and checks in editors
    Schema(SchemaOf),
    /// Write the script for completing commands and options in a shell
    Completions(Completions),
    /// Write the manual page
    #[command(hide = true)]
    Man(Man),
    /// Measure the time of analysis and gradient by phase, for several sizes and numbers of threads
    Bench(Bench),
}

/// Arguments of `new`.
#[derive(Debug, Clone, Args)]
pub struct New {
    /// The template, or a STEP file (.step, .stp) to mesh with Gmsh for Python; if omitted, the available
    /// templates are listed
    #[arg(value_name = "TEMPLATE")]
    pub template: Option<String>,
    /// Length of the edges of elements, for a STEP file, in mm [default: about 2500 elements,
    /// and more at contact]
    #[arg(long, value_name = "LENGTH", value_parser = positive)]
    pub size: Option<f64>,
    /// Largest gap or overlap of bodies in contact, for a STEP file, in mm [default: 2 % of the diagonal of the smallest body, at most a fifth of the smallest thickness]
    #[arg(long, value_name = "LENGTH", value_parser = positive)]
    pub distance: Option<f64>,
    /// Mesh bodies of a STEP file that can be swept, such as plates, stepped shafts and rings, with hexahedra
    #[arg(long)]
    pub hexahedra: bool,
    /// Write a case for this mesh (.msh, .inp, .vtu, .vtk), with its bodies and surfaces by name
    /// (template `my-mesh`)
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub mesh: Option<PathBuf>,
    /// Write a case that takes bodies, contact, supports and loads from this deck of Abaqus or CalculiX
    /// (.inp), with a design to adapt
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with_all = ["template", "mesh"])]
    pub deck: Option<PathBuf>,
    /// Leave out a keyword of the deck although it may change the physics; may be given several times
    #[arg(long, value_name = "KEYWORD", requires = "deck")]
    pub ignore: Vec<String>,
    /// File to write; `-` is standard output [default: the name of the template or of the mesh
    /// file, with `.toml`]
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    pub force: bool,
}

/// The case file.
#[derive(Debug, Clone, Args)]
pub struct CaseFile {
    /// The case file, or a deck of Abaqus or CalculiX (.inp)
    #[arg(value_name = "CASE", value_hint = ValueHint::FilePath)]
    pub case: PathBuf,
    /// Replace or add a value, for instance `contact[0].friction=0.1`; may be given several times
    #[arg(long, value_name = "KEY=VALUE", value_parser = override_of)]
    pub set: Vec<Override>,
    /// Leave out a keyword of the deck although it may change the physics; may be given several times
    #[arg(long, value_name = "KEYWORD")]
    pub ignore: Vec<String>,
}

impl From<&Path> for CaseFile {
    /// The case file without replaced values.
    fn from(case: &Path) -> Self {
        Self { case: case.to_owned(), set: Vec::new(), ignore: Vec::new() }
    }
}

/// Options for output.
#[derive(Debug, Clone, Args)]
pub struct Out {
    /// Directory for results [default: `output.directory` of the case file, otherwise the case
    /// file's name without `.toml`, next to the case file; all commands except `optimize` append `_` and their name]
    #[arg(short, long, value_name = "DIRECTORY", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Replace the results of an earlier run in that directory
    #[arg(long)]
    pub force: bool,
}

/// A design other than the case's uniform initial design.
#[derive(Debug, Clone, Args)]
pub struct DesignFrom {
    /// Read the densities from the directory of an optimization, whose mesh may differ, or from a
    /// table (.csv)
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
    /// Also draw every named surface with its area and normal, as a picture (.png)
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with = "resolved")]
    pub picture: Option<PathBuf>,
    /// Also predict the memory per rank on this many MPI ranks (for a build with PETSc)
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
    /// Options for output.
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
    /// Options for output.
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
    /// Options for output.
    #[command(flatten)]
    pub out: Out,
    /// Maximum number of iterations [default: from the case file]
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

/// What `verify` can check.
#[derive(Debug, Clone, Subcommand)]
pub enum VerifyWhat {
    /// Compare the gradient with central differences (one-sided at densities near 0 or 1) with
    /// successively halved steps; the error decreases with the square of the step, except at kinks
    Gradient(VerifyGradient),
    /// Run a deck with CalculiX and with slipstick, and compare reactions, contact forces
    /// and displacements with each other and with what the design promised
    Deck(VerifyDeck),
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
    /// Quantity of the case to differentiate, at the last load step; may be repeated [default: the
    /// objective, and every quantity of the case]
    #[arg(long = "quantity", value_name = "NAME")]
    pub quantities: Vec<String>,
    /// Number of individual elements to vary, spread over the design; each costs two analyses per step
    #[arg(long, value_name = "NUMBER", default_value_t = 5)]
    pub elements: usize,
    /// Number of random directions over the whole design, and as many again over the densities
    /// near 0 or 1; each costs as much as an element
    #[arg(long, value_name = "NUMBER", default_value_t = 2)]
    pub directions: usize,
    /// Initial step size, in density
    #[arg(long, value_name = "STEP", default_value = "1e-4", value_parser = step)]
    pub step: f64,
    /// How often to halve the step
    #[arg(long, value_name = "NUMBER", default_value_t = 3)]
    pub halvings: u32,
    /// Largest relative error at which the gradient counts as correct
    #[arg(long, value_name = "ERROR", default_value = "1e-5", value_parser = positive)]
    pub tolerance: f64,
    /// Options for output.
    #[command(flatten)]
    pub out: Out,
}

/// Arguments of `resume`.
#[derive(Debug, Clone, Args)]
pub struct Resume {
    /// Directory of the optimization
    #[arg(value_name = "RESULTS", value_hint = ValueHint::DirPath)]
    pub results: PathBuf,
    /// Maximum number of iterations in total [default: as in the original run]
    #[arg(long, value_name = "NUMBER", value_parser = count)]
    pub iterations: Option<NonZeroUsize>,
    /// Refused, since a run keeps its case; the message names the alternative
    #[arg(long, value_name = "KEY=VALUE", hide = true)]
    pub set: Vec<String>,
}

/// Arguments of `evaluate`.
#[derive(Debug, Clone, Args)]
pub struct Evaluate {
    /// The case file.
    #[command(flatten)]
    pub case: CaseFile,
    /// Read the densities from the directory of an optimization, whose mesh may differ, or from a
    /// table (.csv)
    #[arg(long, value_name = "RESULTS", value_hint = ValueHint::AnyPath)]
    pub design: PathBuf,
    /// Coefficients of friction, one evaluation for each, applied to all contact pairs in all load cases
    /// [default: from the case file]
    #[arg(long, value_name = "MU", value_delimiter = ',', value_parser = not_negative)]
    pub friction: Vec<f64>,
    /// Options for output.
    #[command(flatten)]
    pub out: Out,
}

/// Arguments of `render`.
#[derive(Debug, Clone, Args)]
pub struct Render {
    /// Directory of a run; with --curve, several; with --history, several directories or tables of
    /// histories (.csv)
    #[arg(value_name = "RESULTS", required = true, value_hint = ValueHint::AnyPath)]
    pub results: Vec<PathBuf>,
    /// Plot objectives and volume fractions over the iterations, all runs in one chart
    #[arg(long, conflicts_with_all = ["field", "step", "iteration", "failure", "view", "deformed", "threshold", "smooth", "bodies", "plain"])]
    pub history: bool,
    /// Plot column Y of quantities.csv against column X, such as a reaction against a displacement,
    /// all runs in one chart; for an unknown name, the available ones are listed
    #[arg(long, num_args = 2, value_names = ["X", "Y"], conflicts_with_all = ["history", "field", "step", "iteration", "failure", "view", "deformed", "threshold", "smooth", "bodies", "plain"])]
    pub curve: Vec<String>,
    /// Only these runs, by name, in this order (with --history)
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "history")]
    pub runs: Vec<String>,
    /// Title of the chart (with --history or --curve)
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Field to colour by: density, pressure, gap, displacement, …; for an unknown name, the available ones
    /// are listed [default: the smooth surface of the design; if all densities are 1, as without a designed
    /// body, contact pressure or displacement; if none exceeds 0.5, density]
    #[arg(long, value_name = "NAME")]
    pub field: Option<String>,
    /// Draw the state at the end of a load step [default: the newest design, at the last load step
    /// if available]
    #[arg(long, value_name = "NUMBER", conflicts_with = "iteration")]
    pub step: Option<usize>,
    /// Draw the design of an iteration, undeformed
    #[arg(long, value_name = "NUMBER")]
    pub iteration: Option<usize>,
    /// Draw the iterate at which a load step finally failed, coloured by default by the smallest
    /// determinant of each element
    #[arg(long, conflicts_with_all = ["step", "iteration"])]
    pub failure: bool,
    /// View: iso, front, side, top, …; for an unknown name, the available ones are listed [default:
    /// iso; for contact fields, from the contact side]
    #[arg(long, value_name = "NAME")]
    pub view: Option<String>,
    /// Scale factor for displacements; 0 draws the undeformed shape [default: 1]
    #[arg(long, value_name = "SCALE", value_parser = not_negative)]
    pub deformed: Option<f64>,
    /// Draw the elements of the design whose density exceeds this value, or with --smooth their surface
    /// [default: with --field, 0.5; 0 if no density exceeds 0.5, and with --failure; otherwise the surface that
    /// preserves the volume of the densities]
    #[arg(long, value_name = "DENSITY", value_parser = fraction)]
    pub threshold: Option<f64>,
    /// Draw the design as the smooth surface that `export` writes, deformed if displacements are available;
    /// it has the same volume as the densities unless --threshold is given
    #[arg(long, conflicts_with_all = ["field", "failure"])]
    pub smooth: bool,
    /// Draw only these bodies [default: with a field of contact, those with a slave surface; otherwise all,
    /// and those that are not designed as glass if the field is one of the design]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub bodies: Vec<String>,
    /// Leave out the supports, motions, loads and planes of symmetry of the case, the undeformed shape and
    /// the scale bar
    #[arg(long)]
    pub plain: bool,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "900x720", value_parser = size)]
    pub size: (u32, u32),
    /// File to write [default: picture.png in the directory; with --history or --curve of a single
    /// directory, history.png or curve.png]
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
}

/// Arguments of `study`.
#[derive(Debug, Clone, Args)]
pub struct Study {
    /// The study, a TOML file with a list of runs
    #[arg(value_name = "STUDY", value_hint = ValueHint::FilePath)]
    pub study: PathBuf,
    /// Only these runs, by name
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Print what would be done, without doing it
    #[arg(long)]
    pub plan: bool,
}

/// Arguments of `bench`.
#[derive(Debug, Clone, Args)]
pub struct Bench {
    /// A case file [default: a half-ball pressed into a plate and slid over it, at several
    /// mesh sizes]
    #[arg(value_name = "CASE", value_hint = ValueHint::FilePath)]
    pub case: Option<PathBuf>,
    /// The design.
    #[command(flatten)]
    pub design: DesignFrom,
    /// Approximate numbers of elements of the half-ball on its plate; on MPI ranks only the first
    /// is used
    #[arg(
        long,
        value_name = "NUMBERS",
        value_delimiter = ',',
        default_value = "1000,3000,9400",
        conflicts_with_all = ["case", "design"],
        value_parser = count
    )]
    pub sizes: Vec<NonZeroUsize>,
    /// Numbers of threads; on MPI ranks only the first is used
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "1,2", value_parser = count)]
    pub threads: Vec<NonZeroUsize>,
    /// Number of load steps from the start of the path [default: all of a case; 10 of the
    /// half-ball's 50]
    #[arg(long, value_name = "NUMBER", value_parser = count)]
    pub steps: Option<NonZeroUsize>,
    /// Memory for factors that are kept for the gradient [default: `adjoint.memory` of the case]
    #[arg(long, value_name = "MEMORY", value_parser = memory)]
    pub memory: Option<Memory>,
    /// Also measure the gradients of this many responses together: contact forces, displacements
    /// and reactions at all load steps
    #[arg(long, value_name = "NUMBER", value_parser = count)]
    pub responses: Option<NonZeroUsize>,
    /// Measure processor time, summed over all threads, instead of wall time
    #[arg(long)]
    pub cpu: bool,
    /// Measure once, in this process
    #[arg(long, hide = true)]
    pub worker: bool,
}

#[cfg(test)]
mod tests;
