//! Arguments of commands that turn results into files.

use std::path::PathBuf;

use clap::{ArgAction, Args, ValueHint};

use super::values::number;

/// Arguments of `report`.
#[derive(Debug, Clone, Args)]
pub struct Report {
    /// Directory of a run
    #[arg(value_name = "RESULTS", value_hint = ValueHint::DirPath)]
    pub results: PathBuf,
    /// File to write [default: report.html in the directory]
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Replace the named file if it exists
    #[arg(long, requires = "out")]
    pub force: bool,
    /// While the run is in progress, write the page again after each iteration; an open page
    /// reloads itself
    #[arg(long)]
    pub follow: bool,
}

/// Arguments of `export`.
#[derive(Debug, Clone, Args)]
pub struct Export {
    /// Directory of a run; with --deck also a case file
    #[arg(value_name = "RESULTS", value_hint = ValueHint::AnyPath)]
    pub results: PathBuf,
    /// Binary STL file to write [default, if no file is given: design.stl in the directory]
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub stl: Option<PathBuf>,
    /// Wavefront OBJ file to write: shared points, full precision, one object per body
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub obj: Option<PathBuf>,
    /// 3MF file to write, for printing: one object per body, in the unit that the case names (mm if
    /// none)
    #[arg(long = "3mf", value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub threemf: Option<PathBuf>,
    /// STEP file to write, for CAD: solids in the unit that the case names (mm if none), with the
    /// original planes, cylinders, cones, spheres and tori, and facets elsewhere: on free-form faces and
    /// where material was removed
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub step: Option<PathBuf>,
    /// VTU file to write, for ParaView
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub vtu: Option<PathBuf>,
    /// FRD file to write, for CGX and other programs for CalculiX: displacements, stress, reactions and
    /// contact of the load path
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with_all = ["case", "body", "measure", "stl", "obj", "threemf", "step", "vtu", "iteration", "threshold", "smooth", "keep_surfaces"])]
    pub frd: Option<PathBuf>,
    /// Export the design of an iteration [default: the newest]
    #[arg(long, value_name = "NUMBER")]
    pub iteration: Option<usize>,
    /// Density above which there is material; auto: the value that preserves the volume of the
    /// densities
    #[arg(long, value_name = "DENSITY", default_value = "auto", value_parser = threshold, allow_negative_numbers = true)]
    pub threshold: Threshold,
    /// Number of smoothing passes, which remove the staircase of the elements without shrinking the
    /// surface
    #[arg(long, value_name = "NUMBER", default_value_t = 10)]
    pub smooth: usize,
    /// Whether to keep the outer faces of the bodies: contact surfaces, supports, edges
    #[arg(long, value_name = "BOOL", default_value_t = true, action = ArgAction::Set)]
    pub keep_surfaces: bool,
    /// Bodies to export, by name [default: the designed ones]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub body: Vec<String>,
    /// Write the design as a part to this folder: its surfaces, a script that fills them with
    /// elements (it needs `pip install gmsh`), and a case that analyses them under the same loads
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath, conflicts_with = "body")]
    pub case: Option<PathBuf>,
    /// Length of the edges of the part's mesh, or of the facets of a STEP file [default: that of the shortest edges of the design's elements nearby; a body that is solid everywhere keeps its mesh]
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_negative_numbers = true)]
    pub size: Option<f64>,
    /// Measure the thinnest member and the narrowest gap, and keep them for the report
    #[arg(long)]
    pub measure: bool,
    /// Write the case, with the elements of the design above the threshold, as a deck for CalculiX and
    /// Abaqus to this folder (model.inp), with a case that refers to it (case.toml)
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath, conflicts_with_all = ["case", "body", "measure", "stl", "obj", "threemf", "step", "vtu", "frd"])]
    pub deck: Option<PathBuf>,
    /// Write linear contact with this pressure per penetration instead of hard contact
    #[arg(long, value_name = "STIFFNESS", requires = "deck", value_parser = length, allow_negative_numbers = true)]
    pub contact_stiffness: Option<f64>,
    /// Leave a key of the case out of the deck although the physics changes, such as `contact.offset`;
    /// may be given several times
    #[arg(long, value_name = "KEY", requires = "deck")]
    pub ignore: Vec<String>,
    /// Replace files that exist
    #[arg(long)]
    pub force: bool,
}

/// Arguments of `ui`.
#[derive(Debug, Clone, Args)]
pub struct Ui {
    /// A case file, a deck (.inp), the directory of a run, or a folder with these [default: the current
    /// folder]
    #[arg(value_name = "PATH", value_hint = ValueHint::AnyPath)]
    pub path: Option<PathBuf>,
    /// Port of 127.0.0.1 to serve the page on [default: a free one]
    #[arg(long, value_name = "NUMBER")]
    pub port: Option<u16>,
    /// Print the address without opening the browser
    #[arg(long)]
    pub no_browser: bool,
}

/// Arguments of `verify deck`.
#[derive(Debug, Clone, Args)]
pub struct VerifyDeck {
    /// Folder that `export --deck` wrote
    #[arg(value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub folder: PathBuf,
    /// The program CalculiX
    #[arg(long, value_name = "PROGRAM", default_value = "ccx", value_hint = ValueHint::ExecutablePath)]
    pub ccx: PathBuf,
    /// Largest relative deviation at which a number counts as equal
    #[arg(long, value_name = "DEVIATION", default_value = "0.05", value_parser = length)]
    pub tolerance: f64,
}

fn length(text: &str) -> Result<f64, String> {
    number(text, |v| v > 0.0, "a positive number")
}

/// A threshold, or `auto` for the program's choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threshold(pub Option<f64>);

fn threshold(text: &str) -> Result<Threshold, String> {
    let expected = "auto or a number from 0 to 1";
    if text == "auto" {
        Ok(Threshold(None))
    } else {
        Ok(Threshold(Some(number(text, |v| (0.0..=1.0).contains(&v), expected)?)))
    }
}
