//! From a case file to a problem that can run, with a directory for its results.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use slipstick::build::{Problem, build_on};
use slipstick::case::{Body, CaseCode, CaseDiagnostic, LinearSolverChoice, Resolved, Severity};
use slipstick::check::{Inspection, Notice, NoticeKind, bytes_to_build, inspect, start_volume};
use slipstick::design::{DesignMap, DesignVariables, Role};
use slipstick::run::load_density;
use slipstick::words::{counted, quantity};

use crate::args::{CaseFile, DesignFrom, Out};
use crate::case_file::{self, Unreadable};
use crate::commands::bytes;
use crate::failure::Failure;
use crate::memory;
use crate::{Context, Outcome};

/// A case that is read and looked at; the problem built from it goes its own way.
pub struct Setup {
    /// The case file as it was named.
    pub file: PathBuf,
    /// What it means.
    pub resolved: Resolved,
    /// What can be said about it before it runs.
    pub inspection: Inspection,
    /// Threads that it runs on.
    pub threads: usize,
    /// Number of warnings told.
    pub warnings: usize,
    /// Whether several ranks share the problem.
    problem_is_shared: bool,
    /// Where densities were taken from.
    design_of: OnceLock<PathBuf>,
}

/// Reads a case file, with values replaced as asked.
///
/// # Errors
/// [`Failure::Case`], [`Failure::Input`].
pub fn read(file: &CaseFile) -> Outcome<Resolved> {
    let path = &file.case;
    case_file::read(path, &file.set).map_err(|error| match error {
        Unreadable::Wrong(errors) => errors.into(),
        Unreadable::Encoding(at) => {
            let message = format!("{}:{}:{}: {at}", path.display(), at.line, at.column);
            Failure::input(message, "save the case file as UTF-8")
        }
        Unreadable::Override(error) => Failure::input(error.to_string(), error.cure()),
        Unreadable::Io(error) => {
            let cure = "check the name; `slipstick new half-ball` writes a case to start from";
            Failure::input(format!("cannot read the case file {}: {error}", path.display()), cure)
        }
    })
}

/// Reads and builds a case that will run, sets the number of threads, and tells warnings; `sections` are those that
/// the command cannot do without.
///
/// # Errors
/// [`Failure::Case`], [`Failure::Input`]. Of the former: a case that is too large for the machine's memory.
pub fn prepare(context: &Context, file: &CaseFile, sections: &[&str]) -> Outcome<(Setup, Problem)> {
    let resolved = read(file)?;
    resolved.require(sections)?;
    let (setup, problem) = look(context, &file.case, resolved)?;
    match setup.too_large(Severity::Error, sections.contains(&"objective")) {
        Some(diagnostic) => Err(Failure::Case(vec![diagnostic])),
        None => Ok((setup, problem)),
    }
}

/// What to do about a case that is too large.
const FEWER: &str = "take fewer elements, or a machine with more memory";

/// Refuses a case that could not be built in the memory that is available.
fn refuse_too_large(resolved: &Resolved) -> Outcome {
    let needed = bytes_to_build(&resolved.case);
    let Some(available) = memory::available().filter(|&available| needed > available) else { return Ok(()) };
    let count = |body: &Body| body.shape.element_count().unwrap_or(usize::MAX);
    let elements = resolved.case.bodies.iter().fold(0, |sum: usize, body| sum.saturating_add(count(body)));
    let (needed, available) = (bytes(needed), bytes(available));
    let message =
        format!("{elements} elements need about {needed} before anything is solved; {available} are available");
    Err(resolved.source_map.error(&largest_body(resolved), CaseCode::TooLarge, message, FEWER).into())
}

/// Where the elements of the largest body are counted.
fn largest_body(resolved: &Resolved) -> String {
    let bodies = resolved.case.bodies.iter().enumerate();
    let largest = bodies.max_by_key(|(_, body)| body.shape.element_count().unwrap_or(usize::MAX));
    largest.map_or(String::new(), |(b, body)| format!("body[{b}].{}.elements", body.shape.key()))
}

/// Builds a case to look at it, sets the number of threads, and tells warnings.
///
/// # Errors
/// [`Failure::Case`], [`Failure::Input`].
pub fn look(context: &Context, path: &Path, resolved: Resolved) -> Outcome<(Setup, Problem)> {
    refuse_too_large(&resolved)?;
    let threads = set_threads(context, &resolved)?;
    let map = &resolved.source_map;
    let machine = context.parallel.machine(resolved.case.solver.linear == LinearSolverChoice::Petsc)?;
    let mut problem = build_on(&resolved.case, &machine).map_err(|error| Failure::build(&error, map))?;
    let inspection = inspect(&resolved.case, &mut problem).map_err(|error| {
        let message = format!("the reference configuration cannot be evaluated: {error}");
        Failure::from(map.error("body", CaseCode::Mesh, message, "change shapes, placement or contact surfaces"))
    })?;
    let problem_is_shared = context.parallel.size() > 1;
    let mut setup = Setup {
        file: path.to_owned(),
        resolved,
        inspection,
        threads,
        warnings: 0,
        problem_is_shared,
        design_of: OnceLock::new(),
    };
    let (errors, warnings) = setup.diagnostics(&problem);
    setup.warnings = warnings.len();
    context.console.warnings(&warnings);
    if errors.is_empty() { Ok((setup, problem)) } else { Err(Failure::Case(errors)) }
}

/// Threads that any machine can be asked for; one with more cores, for as many.
const MOST_THREADS: usize = 1024;

fn set_threads(context: &Context, resolved: &Resolved) -> Outcome<usize> {
    let asked = context.common.threads.map(usize::from).or(resolved.case.solver.threads);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = asked.unwrap_or(context.parallel.threads(cores));
    let most = cores.max(MOST_THREADS);
    if threads > most {
        let cure = format!("there are {cores} cores; more threads than cores make nothing faster");
        return Err(Failure::input(format!("{threads} threads are asked for; at most {most} can be"), cure));
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(|error| {
        Failure::input(format!("cannot start {threads} threads: {error}"), "ask for fewer with --threads")
    })?;
    Ok(threads)
}

impl Setup {
    /// Errors and warnings at their places in the case file.
    ///
    /// A body that supports leave free is an error where no contact could hold it: its equations are singular.
    fn diagnostics(&self, problem: &Problem) -> (Vec<CaseDiagnostic>, Vec<CaseDiagnostic>) {
        let map = &self.resolved.source_map;
        let mut warnings = self.resolved.warnings.clone();
        let mut errors = Vec::new();
        for notice in &self.inspection.notices {
            let (code, severity) = match notice.kind {
                NoticeKind::LooseBody if self.touches_nothing(problem, &notice.path) => {
                    (CaseCode::UnsupportedBody, Severity::Error)
                }
                NoticeKind::LooseBody => (CaseCode::UnsupportedBody, Severity::Warning),
                NoticeKind::Disconnected => (CaseCode::Disconnected, Severity::Warning),
                NoticeKind::Divided => (CaseCode::MeshFile, Severity::Warning),
                NoticeKind::PenetratingStart => (CaseCode::PenetratingStart, Severity::Warning),
                NoticeKind::NothingOpposite => (CaseCode::NoContact, Severity::Warning),
                NoticeKind::NeverCloses => (CaseCode::NeverCloses, Severity::Warning),
                NoticeKind::AveragedNormals => (CaseCode::AveragedNormals, Severity::Warning),
                NoticeKind::CoarseSlave => (CaseCode::CoarseSlave, Severity::Warning),
                NoticeKind::EmptyPassiveRegion => (CaseCode::EmptyPassiveRegion, Severity::Warning),
                NoticeKind::IdleFilter => (CaseCode::IdleFilter, Severity::Warning),
                NoticeKind::IdleLoad => (CaseCode::Motion, Severity::Warning),
                NoticeKind::InitialVolume => (CaseCode::InitialVolume, Severity::Warning),
            };
            let diagnostic = map.diagnostic(severity, &notice.path, code, &notice.message, &notice.help);
            // The reader of the case warns of bodies without any condition; what is known now says more.
            let name = map.span(&format!("{}.name", notice.path));
            warnings.retain(|other| other.code() != code || other.span() != name);
            if severity == Severity::Error { errors.push(diagnostic) } else { warnings.push(diagnostic) }
        }
        (errors, warnings)
    }

    /// What is wrong with a case whose run, with or without a gradient, needs more memory than there is; `None` if it fits,
    /// or nobody knows.
    pub fn too_large(&self, severity: Severity, gradient: bool) -> Option<CaseDiagnostic> {
        // how many ranks share this machine with which memory is the launcher's matter: `check --ranks`
        if self.problem_is_shared {
            return None;
        }
        let Inspection { peak_bytes, kept_bytes, .. } = self.inspection;
        let kept = if gradient { kept_bytes } else { 0.0 };
        let needed = peak_bytes - kept_bytes + kept;
        let available = memory::available().filter(|&available| needed > available)?;
        let message = format!("a run needs about {}; {} are available", bytes(needed), bytes(available));
        let map = &self.resolved.source_map;
        let told = |path: &str, help: &str| map.diagnostic(severity, path, CaseCode::TooLarge, message, help);
        // Kept factors save time, no more.
        if needed - kept > available {
            return Some(told(&largest_body(&self.resolved), FEWER));
        }
        let room = (self.resolved.case.adjoint.memory.0 as f64).min(kept) - (needed - available);
        let room = (room / 1e6).floor().max(0.0);
        Some(told("adjoint.memory", &format!("give less to kept factors: `[adjoint]` `memory = \"{room} MB\"`")))
    }

    /// Whether no contact pair has a surface of the body that `path` (`body[1]`) names.
    fn touches_nothing(&self, problem: &Problem, path: &str) -> bool {
        let number = path.trim_start_matches("body[").trim_end_matches(']').parse::<usize>();
        let Some(body) = number.ok().and_then(|number| problem.mesh.bodies.get(number)) else { return false };
        let surfaces = &problem.mesh.surfaces;
        let on_body = |name: &String| {
            let facets = surfaces.get(name).map_or(&[][..], |surface| &surface.facets);
            facets.iter().any(|facet| body.elements.contains(&(facet.element as usize)))
        };
        !self.resolved.case.contacts.iter().any(|pair| on_body(&pair.slave) || on_body(&pair.master))
    }

    /// Whether results in this directory would take the place of the design that is asked for.
    pub fn replaces_design(&self, path: &Path) -> bool {
        let same = |results: &PathBuf| {
            let from = if results.is_file() { results.parent().unwrap_or(Path::new("")) } else { results };
            let from = if from.as_os_str().is_empty() { Path::new(".") } else { from };
            matches!((from.canonicalize(), path.canonicalize()), (Ok(a), Ok(b)) if a == b)
        };
        self.design_of.get().is_some_and(same)
    }

    /// Densities to analyse: the case's uniform start, or those of an earlier run.
    ///
    /// # Errors
    /// [`Failure::Input`] if they do not fit; [`Failure::Case`] if the case has no design to put them into.
    pub fn density(&self, context: &Context, problem: &Problem, from: &DesignFrom) -> Outcome<Vec<f64>> {
        match &from.design {
            Some(results) => self.density_of(context, problem, results),
            None => Ok(problem.initial_density.clone()),
        }
    }

    /// Densities of an earlier run, or of a table; warns where the case keeps its own instead.
    ///
    /// # Errors
    /// As [`Setup::density`].
    pub fn density_of(&self, context: &Context, problem: &Problem, results: &Path) -> Outcome<Vec<f64>> {
        self.resolved.require(&["design"])?;
        let found = load_density(results, &problem.mesh)?;
        let _ = self.design_of.set(results.to_owned());
        let Some(variables) = &problem.variables else { return Ok(found) };
        // Passive elements and those outside of the design are the case's own.
        let kept = DesignMap::apply(variables, &variables.restrict(&found));
        if let Some(message) = replaced(variables, &found, &kept) {
            context.console.warning(&format!("{}: {message}", results.display()));
        }
        Ok(kept)
    }

    /// Warns of a start design that fills more than the bound; `known` is whether the reader of the case has done so.
    pub fn warn_of_volume(&self, context: &Context, problem: &Problem, known: bool) -> usize {
        let notice = start_volume(&self.resolved.case, problem, &problem.initial_density).filter(|_| !known);
        let told = |notice: Notice| {
            let map = &self.resolved.source_map;
            map.diagnostic(Severity::Warning, &notice.path, CaseCode::InitialVolume, notice.message, notice.help)
        };
        let warnings: Vec<CaseDiagnostic> = notice.into_iter().map(told).collect();
        context.console.warnings(&warnings);
        warnings.len()
    }

    /// Whether the case's own uniform start is above the bound, of which its reader has warned.
    pub fn starts_above_bound(&self) -> bool {
        self.resolved.warnings.iter().any(|warning| warning.code() == CaseCode::InitialVolume)
    }

    /// Where results go: as asked, else as the case says, else beside the case file under its name; commands other than
    /// `optimize` append their own.
    pub fn directory(&self, out: &Out, command: &str) -> PathBuf {
        if let Some(directory) = &out.out {
            return directory.clone();
        }
        let beside = self.file.parent().unwrap_or(Path::new(""));
        let mut name = match &self.resolved.case.output.directory {
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

/// Densities that differ by less are the same.
const SAME_DENSITY: f64 = 1e-9;

/// Which densities of a table the case does not take, and what it takes instead; `None` where it takes all.
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
        format!("densities of {all} of {count} elements are replaced, because the case keeps them as they are: {which}")
    })
}

/// Filled fraction of the design domain; `None` without a design.
pub fn volume_fraction(problem: &Problem, density: &[f64]) -> Option<f64> {
    let domain = problem.variables.as_ref()?.domain();
    let volumes = problem.mesh.element_volumes();
    let sum = |value: &dyn Fn(usize) -> f64| domain.iter().map(|&e| value(e as usize)).sum::<f64>();
    Some(sum(&|e| volumes[e] * density[e]) / sum(&|e| volumes[e]))
}
