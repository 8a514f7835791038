//! Which designs of an optimization the numbers of a page belong to.

use serde::Serialize;

use super::tables::Table;
use slipstick_results::run::{ResultRecord, RunDirectory, RunError};

/// The design of a load path.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) enum PathOf {
    /// There is no path, or its design is not known.
    #[default]
    Unknown,
    /// That of `design.csv`.
    Newest,
    /// That of an iteration.
    Iteration(usize),
}

/// Iterations of an optimization; none for other runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub(super) struct Origin {
    /// That of `design.csv`, objective and violation: the result, or the last evaluated design.
    pub newest: Option<usize>,
    /// That of the load path, with its quantities and contact forces.
    pub path: Option<usize>,
}

impl Origin {
    pub fn of(run: &RunDirectory, history: Option<&Table>, path: &PathOf) -> Result<Self, RunError> {
        let Some(history) = history else { return Ok(Self::default()) };
        let last = || history.rows.last()?.first()?.as_f64().map(|number| number as usize);
        let newest = ResultRecord::read(run)?.map(|of| of.iteration).or_else(last);
        let path = match *path {
            PathOf::Unknown => None,
            PathOf::Newest => newest,
            PathOf::Iteration(number) => Some(number),
        };
        Ok(Self { newest, path })
    }

    /// `, iteration 3` for numbers of the newest design, if others on the page are of another one.
    pub fn of_newest(self) -> String {
        match self.newest.filter(|_| self.path != self.newest) {
            Some(number) => format!(", iteration {number}"),
            None => String::new(),
        }
    }
}
