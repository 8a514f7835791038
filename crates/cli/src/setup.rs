//! From a case file to a problem that can run, with a directory for its results.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use slipstick::build::Problem;
use slipstick::case::{CaseCode, Resolved};
use slipstick::design::{DesignVariables, ElementValues, Role};
use slipstick::run::{StoredDesign, bytes_of, load_design};
use slipstick::words::{counted, quantity};
use slipstick_service::check::{self, Checked, above_volume_bound};
use slipstick_service::read::case_or_deck;

use crate::args::{CaseFile, DesignFrom, Out};
use crate::context::Context;
use slipstick_service::failure::{Failure, Outcome};

/// A case that has been read and checked; the problem built from it is separate.
pub struct Setup {
    /// The case file, as named by the user.
    pub file: PathBuf,
    /// The case, and facts about it that are known before it runs.
    pub checked: Checked,
    /// Where the densities come from.
    design_of: OnceLock<PathBuf>,
}

/// Reads a case file, with values replaced as requested.
///
/// # Errors
/// [`Failure::Case`], [`Failure::Input`].
pub fn read(file: &CaseFile) -> Outcome<Resolved> {
    let path = &file.case;
    case_or_deck(path, &file.set, &file.ignore).map_err(|error| error.at(path))
}

/// Reads and builds a case that will run, sets the number of threads, and shows warnings;
/// `sections` are those that the command needs.
///
/// # Errors
/// [`Failure::Case`], [`Failure::Input`]. The former includes a case that is too large for the
/// machine's memory.
pub fn prepare(context: &Context, file: &CaseFile, sections: &[&str]) -> Outcome<(Setup, Problem)> {
    prepare_for(context, file, sections, None)
}

/// As [`prepare`], for a number of iterations other than that of the case.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_for(
    context: &Context,
    file: &CaseFile,
    sections: &[&str],
    iterations: Option<usize>,
) -> Outcome<(Setup, Problem)> {
    let (checked, problem) = check::prepare(context, read(file)?, sections, iterations)?;
    Ok((Setup::new(&file.case, checked), problem))
}

/// Builds a case to inspect it, sets the number of threads, and shows warnings.
///
/// # Errors
/// [`Failure::Case`], [`Failure::Input`].
pub fn look(context: &Context, path: &Path, resolved: Resolved) -> Outcome<(Setup, Problem)> {
    let (checked, problem) = check::check(context, resolved)?;
    Ok((Setup::new(path, checked), problem))
}

impl Setup {
    /// A checked case of this file.
    pub fn new(file: &Path, checked: Checked) -> Self {
        Self { file: file.to_owned(), checked, design_of: OnceLock::new() }
    }

    /// Whether results in this directory would replace the requested design.
    pub fn replaces_design(&self, path: &Path) -> bool {
        let same = |results: &PathBuf| {
            let from = if results.is_file() { results.parent().unwrap_or(Path::new("")) } else { results };
            let from = if from.as_os_str().is_empty() { Path::new(".") } else { from };
            matches!((from.canonicalize(), path.canonicalize()), (Ok(a), Ok(b)) if a == b)
        };
        self.design_of.get().is_some_and(same)
    }

    /// Densities to analyse: the case's uniform initial design, or those of an earlier run.
    ///
    /// # Errors
    /// [`Failure::Input`] if they do not match the case; [`Failure::Case`] if the case has no
    /// `design` section.
    pub fn density(&self, context: &Context, problem: &Problem, from: &DesignFrom) -> Outcome<ElementValues> {
        match &from.design {
            Some(results) => self.density_of(context, problem, results),
            None => Ok(problem.initial_density().clone()),
        }
    }

    /// Densities of an earlier run, or of a table; warns if the case keeps its own values for some
    /// elements.
    ///
    /// # Errors
    /// As [`Setup::density`].
    pub fn density_of(&self, context: &Context, problem: &Problem, results: &Path) -> Outcome<ElementValues> {
        Ok(self.stored_design(context, problem, results)?.density)
    }

    /// A design of an earlier run, or of a table. Its densities are those of the case where the
    /// case sets them.
    fn stored_design(&self, context: &Context, problem: &Problem, results: &Path) -> Outcome<StoredDesign> {
        self.checked.resolved.require(&["design"])?;
        let designed = self.checked.resolved.case.design.as_ref().map_or(&[][..], |design| &design.bodies);
        let mut found = load_design(results, &problem.mesh, designed)?;
        let _ = self.design_of.set(results.to_owned());
        if let Some(elements) = found.mapped_from {
            context.console.warning(&format!(
                "{}: the run has a different mesh; its design is mapped from {elements} elements to {}",
                results.display(),
                problem.mesh.elements.len()
            ));
        }
        let Some(variables) = problem.variables() else { return Ok(found) };
        // The case sets the densities of passive elements and of those outside the design.
        let mut kept = found.density.clone();
        for (kept, role) in kept.iter_mut().zip(variables.roles()) {
            *kept = role.fixed_density().unwrap_or(*kept);
        }
        if let Some(message) = replaced(variables, &found.density, &kept) {
            context.console.warning(&format!("{}: {message}", results.display()));
        }
        found.density = kept;
        Ok(found)
    }

    /// Starts from the design of an earlier run or of a table, if one is given: from its variables,
    /// if it lists them, otherwise from its densities as variables.
    ///
    /// # Errors
    /// As [`Setup::density`].
    pub fn start_from(&self, context: &Context, problem: &mut Problem, from: &DesignFrom) -> Outcome {
        let Some(results) = &from.design else { return Ok(()) };
        let stored = self.stored_design(context, problem, results)?;
        let mapped = problem.map().is_some_and(|map| !map.is_identity());
        if mapped && stored.variables.is_none() {
            context.console.warning(&format!(
                "{}: there is no column `design_variable`; the densities are the variables at the start, which the \
                 case filters or projects",
                results.display()
            ));
        }
        problem.start_from(&stored.variables.filter(|_| mapped).unwrap_or(stored.density));
        Ok(())
    }

    /// Warns about an initial design that exceeds the volume bound; `known` says whether the case
    /// reader has done so.
    pub fn warn_of_volume(&self, context: &Context, problem: &Problem, known: bool) -> usize {
        let warning = above_volume_bound(&self.checked.resolved, problem).filter(|_| !known);
        context.console.warnings(warning.as_slice());
        usize::from(warning.is_some())
    }

    /// Whether the case's uniform initial design exceeds the bound; the case reader has then warned
    /// about it.
    pub fn starts_above_bound(&self) -> bool {
        self.checked.resolved.warnings.iter().any(|warning| warning.code() == CaseCode::InitialVolume)
    }

    /// The directory for results: as requested, otherwise as given in the case, otherwise next to
    /// the case file under its name; commands other than `optimize` append their own name.
    pub fn directory(&self, out: &Out, command: &str) -> PathBuf {
        if let Some(directory) = &out.out {
            return directory.clone();
        }
        let beside = self.file.parent().unwrap_or(Path::new(""));
        let mut name = match &self.checked.resolved.case.output.directory {
            Some(directory) => beside.join(directory).into_os_string(),
            None if self.file.extension().is_some() => self.file.with_extension("").into_os_string(),
            None => self.file.with_extension("results").into_os_string(),
        };
        if command != "optimize" {
            name.push(format!("_{command}"));
        }
        name.into()
    }
}

/// Densities that differ by less count as equal.
const SAME_DENSITY: f64 = 1e-9;

/// The densities of a table that the case replaces, and their replacements; `None` if it uses all
/// of them.
fn replaced(variables: &DesignVariables, found: &[f64], kept: &[f64]) -> Option<String> {
    let groups = [
        (Role::Solid, "passive solid element"),
        (Role::Void, "passive void element"),
        (Role::Outside, "element of bodies that are not designed"),
    ];
    let (mut parts, mut all) = (Vec::new(), 0);
    for (role, what) in groups {
        let differs = |e: &usize| variables.roles()[*e] == role && (found[*e] - kept[*e]).abs() > SAME_DENSITY;
        let elements: Vec<usize> = (0..found.len()).filter(differs).collect();
        let Some(&first) = elements.first() else { continue };
        let values = elements.iter().map(|&e| found[e]);
        let (low, high) = values.fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), v| (l.min(v), h.max(v)));
        let from =
            if high - low > SAME_DENSITY { format!("{} … {}", quantity(low), quantity(high)) } else { quantity(low) };
        let what = match what.split_once(' ') {
            Some(("element", rest)) => format!("{} {rest}", counted(elements.len(), "element")),
            _ => counted(elements.len(), what),
        };
        parts.push(format!("{what} from {from} to {}", quantity(kept[first])));
        all += elements.len();
    }
    let (count, which) = (found.len(), parts.join(", "));
    (all > 0).then(|| {
        format!("densities of {all} of {count} elements are replaced, because the case prescribes them: {which}")
    })
}

/// The text of a file that a command reads besides its case.
///
/// # Errors
/// [`Failure::Input`] if it cannot be read.
pub fn text(path: &Path) -> Outcome<String> {
    let text = bytes_of(path).and_then(|bytes| String::from_utf8(bytes).map_err(std::io::Error::other));
    text.map_err(|error| Failure::input(format!("cannot read {}: {error}", path.display()), "check the name"))
}
