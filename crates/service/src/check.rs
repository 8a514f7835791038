//! Checks a case before it runs: what is built from it, what is wrong, and whether it fits into the
//! memory.

use serde::Serialize;
use slipstick::build::{Problem, build_on};
use slipstick::case::{Body, Case, CaseCode, CaseDiagnostic, LinearSolverChoice, Resolved, Severity};
use slipstick::check::{Inspection, NoticeKind, inspect, start_volume};
use slipstick::design::ElementValues;

use crate::failure::{Failure, Outcome};
use crate::forecast::{Forecast, bytes_to_build, forecast};
use crate::host::{Event, Host};
use crate::memory::{Budget, bytes};

/// A case that has been built and inspected; the problem built from it is separate.
#[derive(Debug)]
pub struct Checked {
    /// The case.
    pub resolved: Resolved,
    /// Facts that are known before it runs.
    pub inspection: Inspection,
    /// What its run needs.
    pub forecast: Forecast,
    /// Number of threads.
    pub threads: usize,
    /// What is probably a mistake, with the warnings of the case's reader.
    pub warnings: Vec<CaseDiagnostic>,
}

/// Builds and inspects a case, starts the threads, and tells warnings. All ranks call it.
///
/// # Errors
/// [`Failure::Case`] if the case cannot be built within the memory, or cannot run; [`Failure::Input`]
/// if threads or ranks cannot be started.
pub fn check(host: &dyn Host, resolved: Resolved) -> Outcome<(Checked, Problem)> {
    refuse_too_large(&resolved, host.memory())?;
    let case = &resolved.case;
    let threads = host.threads(case.solver.threads)?;
    let machine = host.machine(case.solver.linear == LinearSolverChoice::Petsc)?;
    let map = &resolved.source_map;
    let mut problem = build_on(case, &machine).map_err(|error| Failure::build(&error, map))?;
    problem.analysis.linear.set_interrupt(host.interrupt());
    let seen =
        inspect(case, &mut problem).and_then(|seen| Ok((seen, forecast(case, &mut problem, host.ranks().size())?)));
    let (inspection, forecast) = seen.map_err(|error| {
        let message = format!("the reference configuration cannot be evaluated: {error}");
        Failure::from(map.error("body", CaseCode::Mesh, message, "change shapes, placement or contact surfaces"))
    })?;
    let (errors, warnings) = diagnostics(&resolved, &inspection, &problem);
    host.tell(Event::Warnings(&warnings));
    if !errors.is_empty() {
        return Err(Failure::Case(errors));
    }
    Ok((Checked { resolved, inspection, forecast, threads, warnings }, problem))
}

/// As [`check`], for a case that will run: with these sections, for this number of iterations if it is
/// not that of the case, and within the memory.
///
/// # Errors
/// As [`check`]; [`Failure::Case`] if a section is missing, or if the run would need more memory.
pub fn prepare(
    host: &dyn Host,
    mut resolved: Resolved,
    sections: &[&str],
    iterations: Option<usize>,
) -> Outcome<(Checked, Problem)> {
    resolved.require(sections)?;
    if let Some(iterations) = iterations {
        resolved.expect_iterations(iterations);
    }
    let (checked, problem) = check(host, resolved)?;
    if let Some(diagnostic) = checked.too_large(host, Severity::Error, sections.contains(&"objective")) {
        return Err(Failure::Case(vec![diagnostic]));
    }
    host.tell(Event::Prepared(&checked.inspection));
    Ok((checked, problem))
}

/// What is known of a case before it runs, as data.
#[derive(Debug, Serialize)]
pub struct Facts<'a> {
    #[serde(flatten)]
    inspection: &'a Inspection,
    #[serde(flatten)]
    forecast: &'a Forecast,
}

impl Checked {
    /// What is known before it runs.
    pub fn facts(&self) -> Facts<'_> {
        Facts { inspection: &self.inspection, forecast: &self.forecast }
    }

    /// The diagnostic for a case whose run, with or without a gradient, needs more memory than there is;
    /// `None` if it fits or this is unknown.
    pub fn too_large(&self, host: &dyn Host, severity: Severity, gradient: bool) -> Option<CaseDiagnostic> {
        let Self { resolved, forecast, .. } = self;
        // only the launcher knows how ranks share the memory of machines; `check --ranks` predicts it
        if host.ranks().size() > 1 {
            return None;
        }
        let Forecast { peak_bytes, kept_bytes, .. } = *forecast;
        let kept = if gradient { kept_bytes } else { 0.0 };
        let needed = peak_bytes - kept_bytes + kept;
        let available = host.memory().exceeded_by(needed)?;
        let message = format!("a run needs about {}; {} is available", bytes(needed), bytes(available));
        let map = &resolved.source_map;
        let told = |path: &str, help: &str| map.diagnostic(severity, path, CaseCode::TooLarge, message, help);
        // Kept factors only save time.
        if needed - kept > available {
            return Some(told(&largest_body(resolved), FEWER));
        }
        let room = (resolved.case.adjoint.memory.0 as f64).min(kept) - (needed - available);
        let room = (room / 1e6).floor().max(0.0);
        Some(told("adjoint.memory", &format!("keep fewer factors: `[adjoint]` `memory = \"{room} MB\"`")))
    }
}

/// What to do about a case that is too large.
const FEWER: &str = "use fewer elements, or a machine with more memory";

/// Refuses a case that could not be built in this memory.
fn refuse_too_large(resolved: &Resolved, memory: Budget) -> Outcome {
    let needed = bytes_to_build(&resolved.case);
    let Some(available) = memory.exceeded_by(needed) else { return Ok(()) };
    let count = |body: &Body| body.shape.element_count().unwrap_or(usize::MAX);
    let elements = resolved.case.bodies.iter().fold(0, |sum: usize, body| sum.saturating_add(count(body)));
    let (needed, available) = (bytes(needed), bytes(available));
    let message =
        format!("{elements} elements need about {needed} before anything is solved; {available} is available");
    Err(resolved.source_map.error(&largest_body(resolved), CaseCode::TooLarge, message, FEWER).into())
}

/// The place in the case that sets the number of elements of the largest body.
fn largest_body(resolved: &Resolved) -> String {
    let bodies = resolved.case.bodies.iter().enumerate();
    let largest = bodies.max_by_key(|(_, body)| body.shape.element_count().unwrap_or(usize::MAX));
    largest.map_or(String::new(), |(b, body)| format!("body[{b}].{}.elements", body.shape.key()))
}

/// Errors and warnings about a built case at their places in the case file, those of its reader
/// included.
///
/// A body that supports leave free is an error if no contact could hold it: its equations are
/// singular.
fn diagnostics(
    resolved: &Resolved,
    inspection: &Inspection,
    problem: &Problem,
) -> (Vec<CaseDiagnostic>, Vec<CaseDiagnostic>) {
    let map = &resolved.source_map;
    let mut warnings = resolved.warnings.clone();
    let mut errors = Vec::new();
    for notice in &inspection.notices {
        let (code, severity) = match notice.kind {
            NoticeKind::LooseBody if touches_nothing(&resolved.case, problem, &notice.path) => {
                (CaseCode::UnsupportedBody, Severity::Error)
            }
            NoticeKind::LooseBody => (CaseCode::UnsupportedBody, Severity::Warning),
            NoticeKind::Disconnected => (CaseCode::Disconnected, Severity::Warning),
            NoticeKind::Divided => (CaseCode::MeshFile, Severity::Warning),
            NoticeKind::PoorElements => (CaseCode::PoorElements, Severity::Warning),
            NoticeKind::StraightMiddles => (CaseCode::StraightMiddles, Severity::Warning),
            NoticeKind::PenetratingStart | NoticeKind::OpenOverlap => (CaseCode::PenetratingStart, Severity::Warning),
            NoticeKind::TiedApart => (CaseCode::NoContact, Severity::Warning),
            NoticeKind::NothingOpposite => (CaseCode::NoContact, Severity::Warning),
            NoticeKind::NeverCloses => (CaseCode::NeverCloses, Severity::Warning),
            NoticeKind::AveragedNormals => (CaseCode::AveragedNormals, Severity::Warning),
            NoticeKind::RigidSlave => (CaseCode::RigidSlave, Severity::Warning),
            NoticeKind::CoarseSlave => (CaseCode::CoarseSlave, Severity::Warning),
            NoticeKind::HeldTwice => (CaseCode::HeldTwice, Severity::Warning),
            NoticeKind::EmptyPassiveRegion => (CaseCode::EmptyPassiveRegion, Severity::Warning),
            NoticeKind::IdleFilter => (CaseCode::IdleFilter, Severity::Warning),
            NoticeKind::StiffVoid => (CaseCode::StiffVoid, Severity::Warning),
            NoticeKind::HeatedCompliance => (CaseCode::HeatedCompliance, Severity::Warning),
            NoticeKind::IdleLoad | NoticeKind::HeldInObjective => (CaseCode::Motion, Severity::Warning),
            NoticeKind::InitialVolume => (CaseCode::InitialVolume, Severity::Warning),
        };
        let diagnostic = map.diagnostic(severity, &notice.path, code, &notice.message, &notice.help);
        // The case reader warns about bodies without any condition; this diagnostic is more
        // specific.
        if notice.kind == NoticeKind::LooseBody {
            let name = map.span(&format!("{}.name", notice.path));
            warnings.retain(|other| other.code() != code || other.span() != name);
        }
        if severity == Severity::Error { errors.push(diagnostic) } else { warnings.push(diagnostic) }
    }
    (errors, warnings)
}

/// Whether no contact pair has a surface of the body that `path` (`body[1]`) names.
fn touches_nothing(case: &Case, problem: &Problem, path: &str) -> bool {
    let number = path.trim_start_matches("body[").trim_end_matches(']').parse::<usize>();
    let Some(body) = number.ok().and_then(|number| problem.mesh.bodies.get(number)) else { return false };
    let surfaces = &problem.mesh.surfaces;
    let on_body = |name: &String| {
        let facets = surfaces.get(name).map_or(&[][..], |surface| &surface.facets);
        facets.iter().any(|facet| body.elements.contains(&(facet.element as usize)))
    };
    !case.contacts.iter().any(|pair| on_body(&pair.slave) || on_body(&pair.master))
}

/// The warning about an initial design that exceeds the volume bound.
pub fn above_volume_bound(resolved: &Resolved, problem: &Problem) -> Option<CaseDiagnostic> {
    let notice = start_volume(&resolved.case, problem, problem.initial_density())?;
    let (map, code) = (&resolved.source_map, CaseCode::InitialVolume);
    Some(map.diagnostic(Severity::Warning, &notice.path, code, notice.message, notice.help))
}

/// Filled fraction of the design domain; `None` without a design.
pub fn volume_fraction(problem: &Problem, density: &ElementValues) -> Option<f64> {
    let variables = problem.variables()?;
    let volumes = variables.on_domain(&problem.mesh.element_volumes().into());
    let filled: f64 = variables.on_domain(density).iter().zip(&volumes).map(|(density, volume)| density * volume).sum();
    Some(filled / volumes.iter().sum::<f64>())
}
