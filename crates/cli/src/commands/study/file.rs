//! The list of runs, as typed and checked.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use clap::Parser;
use serde::Deserialize;

use crate::Outcome;
use crate::args::Cli;
use crate::failure::Failure;

/// A study file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// A line for people.
    #[serde(default)]
    pub title: String,
    /// Values that are replaced in the case files of all runs.
    #[serde(default)]
    pub set: Vec<String>,
    /// A JSON file with the numbers that are expected, beside the study file.
    pub expected: Option<PathBuf>,
    /// The runs, in the order in which they are done.
    #[serde(default, rename = "run")]
    pub runs: Vec<Entry>,
    /// Pictures of the runs.
    #[serde(default, rename = "picture")]
    pub pictures: Vec<Picture>,
}

/// One run.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Its name, which is that of its directory too.
    pub name: String,
    /// What is done.
    pub command: Word,
    /// The case file, relative to the study file.
    pub case: PathBuf,
    /// Values that are replaced in it, after those of the study.
    #[serde(default)]
    pub set: Vec<String>,
    /// The run before this one whose design is taken.
    pub design: Option<String>,
    /// Further options of the command.
    #[serde(default)]
    pub options: Vec<String>,
    /// Directions along which the design is mirrored, to see how symmetric it is.
    #[serde(default)]
    pub mirror: Vec<Axis>,
}

/// A command that leaves a directory of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Word {
    /// `optimize`.
    Optimize,
    /// `solve`.
    Solve,
    /// `gradient`.
    Gradient,
    /// `evaluate`.
    Evaluate,
    /// `verify gradient`.
    Verify,
}

impl Word {
    /// As on the command line.
    fn words(self) -> &'static [&'static str] {
        match self {
            Self::Optimize => &["optimize"],
            Self::Solve => &["solve"],
            Self::Gradient => &["gradient"],
            Self::Evaluate => &["evaluate"],
            Self::Verify => &["verify", "gradient"],
        }
    }
}

/// A direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

/// A picture of a run.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Picture {
    /// The run.
    pub of: String,
    /// The PNG file, relative to the study file.
    pub file: PathBuf,
    /// Further options of `render`.
    #[serde(default)]
    pub options: Vec<String>,
}

/// A study: its file, read and checked, and where it stands.
#[derive(Debug)]
pub struct Study {
    /// What is to be done.
    pub file: StudyFile,
    /// The folder of the study file, in which everything is run.
    pub folder: PathBuf,
    /// The name of the directory for results in that folder: the study file's, without `.toml`.
    pub results: PathBuf,
    /// Expected numbers by run and quantity.
    pub expected: BTreeMap<String, BTreeMap<String, Expected>>,
}

/// What a number is to be.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// The value.
    pub value: Option<f64>,
    /// How far from it in proportion to it.
    #[serde(default)]
    pub relative: f64,
    /// How far from it.
    #[serde(default)]
    pub absolute: f64,
    /// The most.
    pub at_most: Option<f64>,
    /// The least.
    pub at_least: Option<f64>,
    /// Where that comes from.
    pub source: String,
}

impl Expected {
    /// Whether a number is as expected; NaN never is.
    pub fn holds(&self, found: f64) -> bool {
        let near = |value: f64| (found - value).abs() <= self.absolute.max(self.relative * value.abs());
        found.is_finite()
            && self.value.is_none_or(near)
            && self.at_most.is_none_or(|most| found <= most)
            && self.at_least.is_none_or(|least| found >= least)
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if let Some(value) = self.value {
            parts.push(format!("{value} ± {:.1e}", self.absolute.max(self.relative * value.abs())));
        }
        parts.extend(self.at_least.map(|least| format!("at least {least}")));
        parts.extend(self.at_most.map(|most| format!("at most {most}")));
        write!(f, "expected is {} ({})", parts.join(", "), self.source)
    }
}

/// What stands in a file of expected numbers.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExpectedFile {
    /// A line for people.
    #[serde(rename = "about", default)]
    _about: String,
    runs: BTreeMap<String, BTreeMap<String, Expected>>,
}

impl Study {
    /// Reads a study file and checks all of it: nothing that can be told before is found out after hours.
    ///
    /// # Errors
    /// [`Failure::Input`], with all that is wrong.
    pub fn read(path: &Path) -> Outcome<Self> {
        let file: StudyFile = toml::from_str(&text(path)?).map_err(|error| {
            Failure::input(format!("{}: {error}", path.display()), "docs/examples.md says what stands in a study file")
        })?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let stem = path.file_stem().unwrap_or_default();
        let results = if path.extension().is_some() { stem.into() } else { "results".into() };
        let expected = match &file.expected {
            Some(name) => expected(&folder.join(name))?,
            None => BTreeMap::new(),
        };
        let study = Self { file, folder, results, expected };
        let wrong = study.wrong();
        if wrong.is_empty() {
            return Ok(study);
        }
        let all = wrong.iter().map(|one| format!("{}: {one}", path.display())).collect::<Vec<_>>().join("\n       ");
        Err(Failure::input(all, "docs/examples.md says what stands in a study file"))
    }

    /// The command line of a run, in the study's folder.
    pub fn line(&self, run: &Entry) -> Vec<String> {
        let mut line: Vec<String> = run.command.words().iter().map(|&word| word.into()).collect();
        line.push(run.case.display().to_string());
        line.extend(self.file.set.iter().chain(&run.set).flat_map(|one| ["--set".into(), one.clone()]));
        if let Some(design) = &run.design {
            line.extend(["--design".into(), self.results.join(design).display().to_string()]);
        }
        line.extend(run.options.iter().cloned());
        line.extend(["--out".into(), self.results.join(&run.name).display().to_string()]);
        line
    }

    /// The command line of a picture.
    pub fn picture_line(&self, picture: &Picture) -> Vec<String> {
        let mut line = vec!["render".into(), self.results.join(&picture.of).display().to_string()];
        line.extend(picture.options.iter().cloned());
        line.extend(["--out".into(), picture.file.display().to_string()]);
        line
    }

    /// All that is wrong.
    fn wrong(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        let runs = &self.file.runs;
        if runs.is_empty() {
            wrong.push("there is no [[run]]".into());
        }
        for (number, run) in runs.iter().enumerate() {
            let name = &run.name;
            let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            if name.is_empty() || !name.chars().all(good) {
                wrong.push(format!("run `{name}`: a name is letters, digits, `_` and `-`"));
            }
            if runs[..number].iter().any(|other| other.name == *name) {
                wrong.push(format!("run `{name}`: there are two of that name"));
            }
            if let Some(design) = run.design.as_ref().filter(|&d| !runs[..number].iter().any(|other| other.name == *d))
            {
                wrong.push(format!("run `{name}`: no run before it is called `{design}`"));
            }
            if !self.folder.join(&run.case).is_file() {
                wrong.push(format!("run `{name}`: there is no file {}", self.folder.join(&run.case).display()));
            }
            if let Err(reason) = command_line(&self.line(run)) {
                wrong.push(format!("run `{name}`: {reason}"));
            }
        }
        for picture in &self.file.pictures {
            if !runs.iter().any(|run| run.name == picture.of) {
                wrong.push(format!("picture {}: no run is called `{}`", picture.file.display(), picture.of));
            }
            if let Err(reason) = command_line(&self.picture_line(picture)) {
                wrong.push(format!("picture {}: {reason}", picture.file.display()));
            }
        }
        for name in self.expected.keys().filter(|&name| !runs.iter().any(|run| run.name == *name)) {
            wrong.push(format!("numbers are expected of `{name}`, but no run is called so"));
        }
        wrong
    }
}

/// What is wrong with a command line, in one line.
fn command_line(words: &[String]) -> Result<(), String> {
    let line = std::iter::once("slipstick").chain(words.iter().map(String::as_str));
    let wrong = |error: clap::Error| {
        let text = error.to_string();
        let first = text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
        first.trim_start_matches("error: ").to_owned()
    };
    Cli::try_parse_from(line).map(|_| ()).map_err(wrong)
}

fn text(path: &Path) -> Outcome<String> {
    std::fs::read_to_string(path)
        .map_err(|error| Failure::input(format!("cannot read {}: {error}", path.display()), "check the name"))
}

fn expected(path: &Path) -> Outcome<BTreeMap<String, BTreeMap<String, Expected>>> {
    let cure = "docs/examples.md says what stands in a file of expected numbers";
    let file: ExpectedFile = serde_json::from_str(&text(path)?)
        .map_err(|error| Failure::input(format!("{}: {error}", path.display()), cure))?;
    for (run, quantities) in &file.runs {
        for (name, one) in quantities {
            if one.value.is_none() && one.at_most.is_none() && one.at_least.is_none() {
                let message =
                    format!("{}: {run}: {name} says neither value, nor at_most, nor at_least", path.display());
                return Err(Failure::input(message, cure));
            }
        }
    }
    Ok(file.runs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_compared() {
        let read = |text: &str| serde_json::from_str::<Expected>(text).expect("right");
        let near = read(r#"{ "value": -2, "relative": 0.1, "source": "by hand" }"#);
        assert!(near.holds(-2.19) && near.holds(-1.81) && !near.holds(-2.21) && !near.holds(f64::NAN));
        let between = read(r#"{ "at_least": 0, "at_most": 1, "source": "by hand" }"#);
        assert!(between.holds(0.0) && between.holds(1.0) && !between.holds(1.1) && !between.holds(-0.1));
    }
}
