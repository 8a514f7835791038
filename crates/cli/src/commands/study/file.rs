//! Parses and checks the list of runs.

use std::path::{Path, PathBuf};

use clap::Parser;
use serde::Deserialize;

use super::entry::{Entry, Word};
use super::expected::Expectations;
use super::grid::{Grid, expand};
use crate::args::Cli;
use crate::setup::text;
use slipstick_service::failure::{Failure, Outcome};

/// A study file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// A title for the reader.
    #[serde(default)]
    pub title: String,
    /// Values to replace in the case files of all runs.
    #[serde(default)]
    pub set: Vec<String>,
    /// A JSON file with expected numbers, next to the study file.
    pub expected: Option<PathBuf>,
    /// The runs, in the order of execution.
    #[serde(default, rename = "run")]
    pub runs: Vec<Entry>,
    /// Pictures of the runs.
    #[serde(default, rename = "picture")]
    pub pictures: Vec<Picture>,
    /// Histories of several runs in one chart.
    #[serde(default, rename = "chart")]
    pub charts: Vec<Chart>,
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

/// The histories of optimizations in one chart.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chart {
    /// The runs, in the order of the legend.
    pub of: Vec<String>,
    /// The PNG file, relative to the study file.
    pub file: PathBuf,
    /// Title of the chart.
    pub title: Option<String>,
    /// Further options of `render --history`.
    #[serde(default)]
    pub options: Vec<String>,
}

/// A study: its file, read and checked, and the folder of the file.
#[derive(Debug)]
pub struct Study {
    /// The runs, pictures and charts.
    pub file: StudyFile,
    /// The folder of the study file, in which all commands run.
    pub folder: PathBuf,
    /// The name of the directory for results in that folder: the name of the study file without
    /// `.toml`.
    pub results: PathBuf,
    /// Expected numbers.
    pub expected: Expectations,
    /// The grids, whose runs are among those of the file.
    pub grids: Vec<Grid>,
}

impl Study {
    /// Reads a study file and checks all of it, so that mistakes are not found after hours of
    /// computation.
    ///
    /// # Errors
    /// [`Failure::Input`], with all errors.
    pub fn read(path: &Path) -> Outcome<Self> {
        let mut file: StudyFile = toml::from_str(&text(path)?).map_err(|error| {
            Failure::input(format!("{}: {error}", path.display()), "docs/studies.md describes study files")
        })?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let stem = path.file_stem().unwrap_or_default();
        let results = if path.extension().is_some() { stem.into() } else { "results".into() };
        let expected = match &file.expected {
            Some(name) => Expectations::read(&folder.join(name))?,
            None => Expectations::default(),
        };
        let (runs, grids, mut wrong) = expand(std::mem::take(&mut file.runs), &file.set, &folder);
        file.runs = runs;
        for chart in &mut file.charts {
            let runs = |name: &String| match grids.iter().find(|grid| grid.name == *name) {
                Some(grid) => grid.runs().cloned().collect(),
                None => vec![name.clone()],
            };
            chart.of = chart.of.iter().flat_map(runs).collect();
        }
        let study = Self { file, folder, results, expected, grids };
        wrong.extend(study.wrong());
        if wrong.is_empty() {
            return Ok(study);
        }
        let all = wrong.iter().map(|one| format!("{}: {one}", path.display())).collect::<Vec<_>>().join("\n       ");
        Err(Failure::input(all, "docs/studies.md describes study files"))
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

    /// The command line of a chart.
    pub fn chart_line(&self, chart: &Chart) -> Vec<String> {
        let mut line = vec!["render".into()];
        line.extend(chart.of.iter().map(|run| self.results.join(run).display().to_string()));
        line.push("--history".into());
        line.extend(chart.title.iter().flat_map(|title| ["--title".into(), title.clone()]));
        line.extend(chart.options.iter().cloned());
        line.extend(["--out".into(), chart.file.display().to_string()]);
        line
    }

    /// All errors.
    fn wrong(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        let runs = &self.file.runs;
        if runs.is_empty() {
            wrong.push("there is no [[run]]".into());
        }
        for (number, run) in runs.iter().enumerate() {
            let name = &run.name;
            let of_grid = self.grids.iter().any(|grid| grid.runs().any(|one| one == name));
            let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-' || (of_grid && c == '.');
            if name.is_empty() || !name.chars().all(good) {
                wrong.push(format!("run `{name}`: a name consists of letters, digits, `_` and `-`"));
            }
            if runs[..number].iter().any(|other| other.name == *name) {
                wrong.push(format!("run `{name}`: there are two runs with this name"));
            }
            if let Some(design) = run.design.as_ref().filter(|&d| !runs[..number].iter().any(|other| other.name == *d))
            {
                wrong.push(format!("run `{name}`: no earlier run is called `{design}`"));
            }
            if !self.folder.join(&run.case).is_file() {
                wrong.push(format!("run `{name}`: there is no file {}", self.folder.join(&run.case).display()));
            }
            if let Err(reason) = command_line(&self.line(run)) {
                wrong.push(format!("run `{name}`: {reason}"));
            }
        }
        for picture in &self.file.pictures {
            if let Some(grid) = self.grids.iter().find(|grid| grid.name == picture.of) {
                let runs = grid.runs().map(String::as_str).collect::<Vec<_>>().join(", ");
                let file = picture.file.display();
                wrong.push(format!("picture {file}: `{}` is a grid; name one of its runs: {runs}", grid.name));
            } else if !runs.iter().any(|run| run.name == picture.of) {
                wrong.push(format!("picture {}: no run is called `{}`", picture.file.display(), picture.of));
            }
            if let Err(reason) = command_line(&self.picture_line(picture)) {
                wrong.push(format!("picture {}: {reason}", picture.file.display()));
            }
        }
        for chart in &self.file.charts {
            wrong.extend(
                self.wrong_chart(chart).into_iter().map(|one| format!("chart {}: {one}", chart.file.display())),
            );
        }
        for name in self.expected.names().into_iter().filter(|&name| !runs.iter().any(|run| run.name == *name)) {
            wrong.push(format!("there are expected numbers for `{name}`, but no run with this name"));
        }
        wrong
    }

    /// Errors in a chart.
    fn wrong_chart(&self, chart: &Chart) -> Vec<String> {
        let mut wrong = Vec::new();
        if chart.of.is_empty() {
            wrong.push("`of` lists no run".into());
        }
        for (number, name) in chart.of.iter().enumerate() {
            match self.file.runs.iter().find(|run| run.name == *name) {
                None => wrong.push(format!("no run is called `{name}`")),
                Some(run) if run.command != Word::Optimize => {
                    wrong.push(format!("run `{name}` is not an optimization and has no history"));
                }
                Some(_) if chart.of[..number].contains(name) => wrong.push(format!("run `{name}` is listed twice")),
                Some(_) => {}
            }
        }
        if !chart.of.is_empty() {
            wrong.extend(command_line(&self.chart_line(chart)).err());
        }
        wrong
    }
}

/// The error in a command line, on one line.
fn command_line(words: &[String]) -> Result<(), String> {
    let line = std::iter::once("slipstick").chain(words.iter().map(String::as_str));
    let wrong = |error: clap::Error| {
        let text = error.to_string();
        let first = text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
        first.trim_start_matches("error: ").to_owned()
    };
    Cli::try_parse_from(line).map(|_| ()).map_err(wrong)
}
