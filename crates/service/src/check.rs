//! Checks a case before it runs: what is built from it, what is wrong, and whether it fits into the
//! memory of this machine.

use slipstick::build::{Problem, build_on};
use slipstick::case::{Body, Case, CaseCode, CaseDiagnostic, Resolved, Severity};
use slipstick::check::{Inspection, NoticeKind, bytes_to_build, inspect};
use slipstick::design::ElementValues;
use slipstick::machine::Machine;
use slipstick::path::Interrupt;

use crate::failure::{Failure, Outcome};
use crate::memory::{self, bytes};

/// A case that has been built and inspected.
pub struct Checked {
    /// What is built from it.
    pub problem: Problem,
    /// Facts that are known before it runs.
    pub inspection: Inspection,
    /// Why it cannot run; empty if it can.
    pub errors: Vec<CaseDiagnostic>,
    /// What is probably a mistake, with the warnings of the case's reader.
    pub warnings: Vec<CaseDiagnostic>,
}

impl Checked {
    /// The same, if it can run.
    ///
    /// # Errors
    /// [`Failure::Case`].
    pub fn accepted(self) -> Outcome<Self> {
        if self.errors.is_empty() { Ok(self) } else { Err(Failure::Case(self.errors)) }
    }
}

/// Builds and inspects a case for the ranks of a machine, all of which call this; `interrupt` stops
/// what the problem computes, now and later.
///
/// # Errors
/// [`Failure::Case`] if nothing can be built, or not be evaluated.
pub fn check(resolved: &Resolved, machine: &Machine, interrupt: Option<Interrupt>) -> Outcome<Checked> {
    let map = &resolved.source_map;
    let mut problem = build_on(&resolved.case, machine).map_err(|error| Failure::build(&error, map))?;
    problem.analysis.linear.set_interrupt(interrupt);
    let inspection = inspect(&resolved.case, &mut problem).map_err(|error| {
        let message = format!("the reference configuration cannot be evaluated: {error}");
        Failure::from(map.error("body", CaseCode::Mesh, message, "change shapes, placement or contact surfaces"))
    })?;
    let (errors, warnings) = diagnostics(resolved, &inspection, &problem);
    Ok(Checked { problem, inspection, errors, warnings })
}

/// What to do about a case that is too large.
const FEWER: &str = "use fewer elements, or a machine with more memory";

/// Refuses a case that could not be built in the memory that is available.
///
/// # Errors
/// [`Failure::Case`].
pub fn refuse_too_large(resolved: &Resolved) -> Outcome {
    let needed = bytes_to_build(&resolved.case);
    let Some(available) = memory::available().filter(|&available| needed > available) else { return Ok(()) };
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

/// The diagnostic for a case whose run, with or without a gradient, needs more memory than is
/// available; `None` if it fits or this is unknown.
pub fn too_large(
    resolved: &Resolved,
    inspection: &Inspection,
    severity: Severity,
    gradient: bool,
) -> Option<CaseDiagnostic> {
    let Inspection { peak_bytes, kept_bytes, .. } = *inspection;
    let kept = if gradient { kept_bytes } else { 0.0 };
    let needed = peak_bytes - kept_bytes + kept;
    let available = memory::available().filter(|&available| needed > available)?;
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
            NoticeKind::IdleLoad => (CaseCode::Motion, Severity::Warning),
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

/// Filled fraction of the design domain; `None` without a design.
pub fn volume_fraction(problem: &Problem, density: &ElementValues) -> Option<f64> {
    let variables = problem.variables()?;
    let volumes = variables.on_domain(&problem.mesh.element_volumes().into());
    let filled: f64 = variables.on_domain(density).iter().zip(&volumes).map(|(density, volume)| density * volume).sum();
    Some(filled / volumes.iter().sum::<f64>())
}
