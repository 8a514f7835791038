//! The linear solver: a matrix in parts, its factors, and proof that they serve.

use crate::contact_zone::{ContactZone, ContactZoneSolver};
use crate::error::PetscError;
use crate::factors::{DistributedMatrix, Factors, Facts, Kind};
use crate::session::Session;
use slipstick_linalg::{
    Backend, CsrMatrix, CsrPattern, FactorPart, Factorization, FactorizationError, Layout, LinearSolver, Operator,
    Precision, Ranks, Summed, check_matrix, test_on,
};
use std::sync::Arc;

/// Percentages by which MUMPS may exceed its estimate of memory, one after the other: its default first.
const WORKSPACE: [i32; 5] = [0, 50, 100, 300, 1000];

/// Errors of MUMPS (INFOG(1)) that more workspace mends.
const TOO_LITTLE_WORKSPACE: [i32; 6] = [-8, -9, -11, -14, -15, -20];

/// The error of MUMPS (INFOG(1)) that tells of a singular matrix.
const SINGULAR: i32 = -10;

/// Methods that PETSc believes to solve with the transpose: BoomerAMG returns without having done anything, SuperLU_DIST is
/// wrong where it scales rows and columns, which depends on the matrix.
const KNOWN_TO_FAIL: [&str; 2] = ["hypre", "superlu_dist"];

/// Solvers by PETSc on the ranks of a session. Without other options it is a direct solver, MUMPS.
#[derive(Debug, Clone)]
pub struct PetscBackend {
    session: Session,
    owners: Arc<[u32]>,
    zone: Option<Arc<ContactZone>>,
}

impl PetscBackend {
    /// On the ranks of `session`; `owners` has, for every elimination group ([`CsrPattern::groups`]), the rank that owns
    /// its rows. Groups beyond are the first rank's.
    pub fn new(session: Session, owners: impl Into<Arc<[u32]>>) -> Self {
        Self { session, owners: owners.into(), zone: None }
    }

    /// The rank of an elimination group.
    pub(crate) fn owner(&self, group: u32) -> usize {
        Layout::owner(&self.owners, group, self.session.size())
    }

    /// With the preconditioner by a contact zone in the place of factors of the whole matrix.
    pub fn with_contact_zone(self, zone: ContactZone) -> Self {
        Self { zone: Some(Arc::new(zone)), ..self }
    }
}

impl Backend for PetscBackend {
    fn solver(&self) -> Box<dyn LinearSolver> {
        match &self.zone {
            Some(zone) => Box::new(ContactZoneSolver::new(self, zone.clone())),
            None => Box::new(PetscSolver::new(self)),
        }
    }

    fn ranks(&self) -> &dyn Ranks {
        &self.session
    }

    fn layout(&self, pattern: &CsrPattern) -> Layout {
        Layout::new(pattern, &self.owners, &self.session)
    }
}

/// Factorizes matrices whose parts are on the ranks.
///
/// Before its first factors are used, a solver proves that they solve with the transpose too; later ones only with the
/// matrix.
#[derive(Debug)]
pub struct PetscSolver {
    session: Session,
    owners: Arc<[u32]>,
    kind: Kind,
    system: Option<System>,
    proved: bool,
}

/// What serves all matrices on one pattern.
#[derive(Debug)]
struct System {
    pattern: Arc<CsrPattern>,
    layout: Arc<Layout>,
    /// Entries of all ranks.
    entries: f64,
    matrix: Arc<DistributedMatrix>,
    factors: Option<Arc<Factors>>,
    /// Whether the matrix belongs to factors that go on with it.
    spent: bool,
}

impl PetscSolver {
    /// A solver without a matrix yet.
    pub fn new(backend: &PetscBackend) -> Self {
        Self::of(backend, Kind::Whole)
    }

    /// A solver for a part of a preconditioner, which is not tested for itself.
    pub(crate) fn of(backend: &PetscBackend, kind: Kind) -> Self {
        let (session, owners) = (backend.session.clone(), backend.owners.clone());
        Self { session, owners, kind, system: None, proved: false }
    }

    fn fail(n: usize, reason: impl Into<String>) -> FactorizationError {
        FactorizationError::Backend { solver: "PETSc", n, reason: reason.into() }
    }

    /// The first error of a rank, on all of them.
    pub(crate) fn agree(&self, here: Result<(), FactorizationError>, n: usize) -> Result<(), FactorizationError> {
        if !self.session.any(here.is_err()) {
            return Ok(());
        }
        let message = match &here {
            Ok(()) => Vec::new(),
            Err(FactorizationError::NonFinite { row, column }) => {
                [*row as u64, *column as u64].iter().flat_map(|v| v.to_le_bytes()).collect()
            }
            Err(_) => vec![0],
        };
        let first = self.session.gather(&message).into_iter().find(|m| !m.is_empty()).unwrap_or_default();
        let number = |at: usize| first.get(at..at + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
        Err(match (number(0), number(8)) {
            (Some(row), Some(column)) => FactorizationError::NonFinite { row: row as usize, column: column as usize },
            _ => FactorizationError::Pattern { n },
        })
    }

    /// The system of this pattern, made where any rank has a new one.
    fn system(&mut self, a: &CsrMatrix) -> Result<&mut System, PetscError> {
        let known = self.system.as_ref().is_some_and(|s| Arc::ptr_eq(&s.pattern, &a.pattern));
        if self.session.any(!known) || self.system.is_none() {
            self.system = None;
            let pattern = a.pattern.clone();
            let layout = Arc::new(Layout::new(&pattern, &self.owners, &self.session));
            let mut entries = [pattern.entries() as f64];
            self.session.sum(&mut entries);
            let matrix = Arc::new(DistributedMatrix::new(&self.session, &pattern, &layout, &self.kind)?);
            self.system = Some(System { pattern, layout, entries: entries[0], matrix, factors: None, spent: false });
        }
        Ok(self.system.as_mut().expect("made above"))
    }

    /// New factors of `a`, not yet tested.
    fn factors(&mut self, a: &CsrMatrix) -> Result<(Arc<Factors>, Facts), PetscError> {
        let (session, kind) = (self.session.clone(), self.kind.clone());
        let system = self.system(a)?;
        if std::mem::take(&mut system.spent) {
            system.matrix = Arc::new(DistributedMatrix::new(&session, &system.pattern, &system.layout, &kind)?);
        }
        system.matrix.set(&a.values)?;
        // factors that are still in use stay
        let kept = system.factors.take().filter(|factors| Arc::strong_count(factors) == 1);
        let factors = match kept {
            Some(factors) => factors,
            None => Arc::new(Factors::new(&session, &system.matrix, &system.layout, &kind)?),
        };
        let mut facts = factors.renew(WORKSPACE[0])?;
        for workspace in &WORKSPACE[1..] {
            if !TOO_LITTLE_WORKSPACE.contains(&facts.mumps_error) {
                break;
            }
            facts = factors.renew(*workspace)?;
        }
        if facts.bytes == 0 {
            facts.bytes = (12.0 * system.entries / session.size() as f64) as usize;
            facts.part.bytes = facts.bytes;
        }
        // an iteration goes on with its matrix, which must then stay as it is
        system.spent = !facts.direct;
        if facts.direct {
            system.factors = Some(factors.clone());
        }
        Ok((factors, facts))
    }

    /// Whether the factors serve, for the transpose too if that was not seen before.
    fn prove(&mut self, a: &CsrMatrix, factors: &PetscFactorization) -> Result<(), FactorizationError> {
        let matrix = Summed { part: a, layout: &factors.layout, ranks: &self.session };
        test_on(&matrix, &matrix.row_weights(false), factors, false, "PETSc")?;
        if self.proved {
            return Ok(());
        }
        let name = &factors.facts.name;
        let known = KNOWN_TO_FAIL.iter().any(|method| name.contains(method));
        let cure = "the gradient needs it; leave `petsc_options` out for MUMPS, or choose a method that has it";
        if known || !factors.facts.transposes {
            return Err(Self::fail(a.n(), format!("{name} has no solve with the transpose: {cure}")));
        }
        test_on(&matrix, &matrix.row_weights(true), factors, true, "PETSc").map_err(|error| match error {
            FactorizationError::Inaccurate { residual, .. } => {
                let found = format!("it left a relative residual of {residual:.1e}");
                Self::fail(a.n(), format!("{name} solves, but not with the transpose ({found}): {cure}"))
            }
            other => other,
        })?;
        self.proved = true;
        Ok(())
    }
}

impl LinearSolver for PetscSolver {
    fn name(&self) -> &'static str {
        "PETSc"
    }

    fn factorize(&mut self, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let n = a.n();
        let known = self.system.as_ref().is_some_and(|s| Arc::ptr_eq(&s.pattern, &a.pattern));
        let here = if n > i32::MAX as usize { Err(FactorizationError::Pattern { n }) } else { check_matrix(a, known) };
        self.agree(here, n)?;
        let made = self.factors(a);
        let failed = self.session.any(made.is_err());
        let (factors, facts) = match made {
            Ok(made) if !failed => made,
            other => {
                self.system = None;
                let reason = other.err().map_or("it failed on another rank".into(), |error| error.to_string());
                return Err(Self::fail(n, reason));
            }
        };
        if facts.mumps_error < 0 {
            let (error, detail) = (facts.mumps_error, facts.mumps_detail);
            let reason = if error == SINGULAR {
                format!(
                    "the matrix is singular after {detail} pivots; a body may be free to move, or a contact \
                         constraint may repeat a prescribed displacement"
                )
            } else {
                format!("MUMPS ended with INFOG(1) = {error}, INFOG(2) = {detail}; its manual tells what that means")
            };
            return Err(Self::fail(n, reason));
        }
        let layout = self.system.as_ref().expect("made with the factors").layout.clone();
        let factors = PetscFactorization { factors, layout, facts };
        if matches!(self.kind, Kind::Whole) {
            self.prove(a, &factors)?;
        }
        Ok(Box::new(factors))
    }
}

/// Factors on all ranks.
#[derive(Debug)]
struct PetscFactorization {
    factors: Arc<Factors>,
    layout: Arc<Layout>,
    facts: Facts,
}

impl PetscFactorization {
    /// A failed solve leaves NaN, which no verified solve takes for a solution.
    fn apply(&self, transpose: bool, rhs: &mut [f64]) {
        match self.factors.solve(transpose, rhs) {
            Ok(x) => rhs.copy_from_slice(&x),
            Err(_) => rhs.fill(f64::NAN),
        }
    }
}

impl Factorization for PetscFactorization {
    fn solve(&self, rhs: &mut [f64]) {
        self.apply(false, rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.apply(true, rhs);
    }

    fn n(&self) -> usize {
        self.layout.own()
    }

    /// Of the rank that has most.
    fn bytes(&self) -> usize {
        self.facts.bytes
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }

    fn operations(&self) -> f64 {
        self.facts.operations
    }

    fn part(&self) -> FactorPart {
        self.facts.part
    }
}
