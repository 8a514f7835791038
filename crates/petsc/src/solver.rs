//! The linear solver: a matrix in parts, its factors, and the test that they are accurate.

use crate::contact_zone::{ContactZone, ContactZoneSolver};
use crate::error::PetscError;
use crate::factors::{DistributedMatrix, Factors, Facts, Kind};
use crate::session::Session;
use slipstick_linalg::{
    Backend, Cost, CsrMatrix, CsrPattern, FactorPart, Factorization, FactorizationError, Layout, LinearSolver,
    Operator, Precision, Ranks, Summed, Symbolic, test_on,
};
use std::sync::{Arc, Mutex, PoisonError};

/// Percentages by which MUMPS may exceed its memory estimate, tried in this order: first its
/// default.
const WORKSPACE: [i32; 5] = [0, 50, 100, 300, 1000];

/// Errors of MUMPS (INFOG(1)) that more workspace fixes.
const TOO_LITTLE_WORKSPACE: [i32; 6] = [-8, -9, -11, -14, -15, -20];

/// The error of MUMPS (INFOG(1)) for a singular matrix.
const SINGULAR: i32 = -10;

/// Bytes that a core moves during a solve in the time of one floating-point operation of a
/// factorization: the ratio of the multifrontal solver in double precision. MUMPS factorizes at a
/// similar rate (31 Gflop/s on a core, `docs/measurements/cluster.md`).
const BYTES_PER_OPERATION: f64 = 0.4;

/// Kinds of errors in messages between ranks.
const NON_FINITE: u64 = 0;
const VALUES: u64 = 1;
const ANALYSIS: u64 = 2;

/// Methods that, contrary to what PETSc reports, cannot solve with the transpose: BoomerAMG returns
/// without doing anything, and SuperLU_DIST gives wrong results if it scales rows and columns,
/// which depends on the matrix.
const KNOWN_TO_FAIL: [&str; 2] = ["hypre", "superlu_dist"];

/// PETSc solvers on the ranks of a session. Without other options, the solver is MUMPS, a direct
/// solver.
#[derive(Debug, Clone)]
pub struct PetscBackend {
    session: Session,
    owners: Arc<[u32]>,
    zone: Option<Arc<ContactZone>>,
}

impl PetscBackend {
    /// On the ranks of `session`; `owners` has, for every elimination group
    /// ([`CsrPattern::groups`]), the rank that owns its rows. The first rank owns all further
    /// groups.
    pub fn new(session: Session, owners: impl Into<Arc<[u32]>>) -> Self {
        Self { session, owners: owners.into(), zone: None }
    }

    /// The rank of an elimination group.
    pub(crate) fn owner(&self, group: u32) -> usize {
        Layout::owner(&self.owners, group, self.session.size())
    }

    /// With the contact-zone preconditioner instead of factors of the whole matrix.
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
/// Before its first factors are used, a solver tests them with the matrix and its transpose; later
/// factors are tested only with the matrix.
#[derive(Debug)]
pub struct PetscSolver {
    session: Session,
    owners: Arc<[u32]>,
    kind: Kind,
    proved: bool,
}

/// Data shared by all matrices with one pattern.
#[derive(Debug)]
struct Analysis {
    layout: Arc<Layout>,
    /// Number of entries on all ranks.
    entries: f64,
    /// These include PETSc's own analysis.
    objects: Mutex<Objects>,
}

/// PETSc's matrix and factors for a pattern, which are reused.
#[derive(Debug, Default)]
struct Objects {
    /// `None` before the first factorization, and if the latest factors still need their entries.
    matrix: Option<Arc<DistributedMatrix>>,
    factors: Option<Arc<Factors>>,
}

impl PetscSolver {
    /// A solver without a matrix yet.
    pub fn new(backend: &PetscBackend) -> Self {
        Self::of(backend, Kind::Whole)
    }

    /// A solver for a part of a preconditioner, which is not tested separately.
    pub(crate) fn of(backend: &PetscBackend, kind: Kind) -> Self {
        let (session, owners) = (backend.session.clone(), backend.owners.clone());
        Self { session, owners, kind, proved: false }
    }

    fn fail(n: usize, reason: impl Into<String>) -> FactorizationError {
        FactorizationError::Backend { solver: "PETSc", n, reason: reason.into() }
    }

    /// Returns the first error of any rank on all of them.
    pub(crate) fn agree(&self, here: Result<(), FactorizationError>, n: usize) -> Result<(), FactorizationError> {
        if !self.session.any(here.is_err()) {
            return Ok(());
        }
        let message: Vec<u8> = match &here {
            Ok(()) => Vec::new(),
            Err(FactorizationError::NonFinite { row, column }) => words(&[NON_FINITE, *row as u64, *column as u64]),
            Err(FactorizationError::Values { values, entries }) => words(&[VALUES, *values as u64, *entries as u64]),
            Err(_) => words(&[ANALYSIS]),
        };
        let first = self.session.gather(&message).into_iter().find(|m| !m.is_empty()).unwrap_or_default();
        let told: Vec<u64> = first.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect();
        Err(match told[..] {
            [NON_FINITE, row, column] => FactorizationError::NonFinite { row: row as usize, column: column as usize },
            [VALUES, values, entries] => {
                FactorizationError::Values { values: values as usize, entries: entries as usize }
            }
            _ => FactorizationError::Analysis { n },
        })
    }

    /// New factors of `a`, not yet tested.
    fn factors(
        &self,
        analysis: &Analysis,
        objects: &mut Objects,
        a: &CsrMatrix,
    ) -> Result<(Arc<Factors>, Facts), PetscError> {
        let (session, layout) = (&self.session, &analysis.layout);
        let matrix = match objects.matrix.take() {
            Some(matrix) => matrix,
            None => Arc::new(DistributedMatrix::new(session, &a.pattern, layout, &self.kind)?),
        };
        matrix.set(&a.pattern, layout, &|k| a.values[k])?;
        // factors that are still in use are not replaced
        let kept = objects.factors.take().filter(|factors| Arc::strong_count(factors) == 1);
        let factors = match kept {
            Some(factors) => factors,
            None => Arc::new(Factors::new(session, &matrix, layout, &self.kind)?),
        };
        let facts = self.renew(analysis, &factors)?;
        // an iterative solver keeps using its matrix, which must then not change
        if facts.direct {
            *objects = Objects { matrix: Some(matrix), factors: Some(factors.clone()) };
        }
        Ok((factors, facts))
    }

    /// Factorizes with as much workspace as MUMPS needs.
    fn renew(&self, analysis: &Analysis, factors: &Factors) -> Result<Facts, PetscError> {
        let mut facts = factors.renew(WORKSPACE[0])?;
        for workspace in &WORKSPACE[1..] {
            if !TOO_LITTLE_WORKSPACE.contains(&facts.mumps_error) {
                break;
            }
            facts = factors.renew(*workspace)?;
        }
        if facts.bytes == 0 {
            facts.bytes = (12.0 * analysis.entries / self.session.size() as f64) as usize;
            facts.part.bytes = facts.bytes;
        }
        Ok(facts)
    }

    /// The factors, or the error, on all ranks.
    fn finish(
        &self,
        analysis: &Analysis,
        made: Result<(Arc<Factors>, Facts), PetscError>,
        n: usize,
    ) -> Result<PetscFactorization, FactorizationError> {
        let failed = self.session.any(made.is_err());
        let (factors, facts) = match made {
            Ok(made) if !failed => made,
            other => {
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
                format!("MUMPS ended with INFOG(1) = {error}, INFOG(2) = {detail}; see its manual for the meaning")
            };
            return Err(Self::fail(n, reason));
        }
        Ok(PetscFactorization { factors, layout: analysis.layout.clone(), facts })
    }

    /// A solver for the bodies, at these coordinates of the nodes, which are block rows. `value` gives
    /// the entries by their positions in the pattern.
    pub(crate) fn of_bodies(
        &self,
        symbolic: &Symbolic,
        coordinates: &[[f64; 3]],
        value: &dyn Fn(usize) -> f64,
    ) -> Result<Box<dyn Factorization>, FactorizationError> {
        let pattern = symbolic.pattern();
        let n = pattern.n();
        let analysis = symbolic.content::<Analysis>().ok_or(FactorizationError::Analysis { n })?;
        let make = || {
            let (session, layout) = (&self.session, &analysis.layout);
            let matrix = Arc::new(DistributedMatrix::new(session, pattern, layout, &self.kind)?);
            matrix.set(pattern, layout, value)?;
            matrix.set_rigid_motions(&layout.restrict(coordinates.as_flattened()))?;
            let factors = Arc::new(Factors::new(session, &matrix, layout, &self.kind)?);
            let facts = self.renew(analysis, &factors)?;
            Ok((factors, facts))
        };
        Ok(Box::new(self.finish(analysis, make(), n)?))
    }

    /// Tests the factors, also with the transpose unless this has been done before.
    fn prove(&mut self, a: &CsrMatrix, factors: &PetscFactorization) -> Result<(), FactorizationError> {
        let matrix = Summed { part: a, layout: &factors.layout, ranks: &self.session };
        test_on(&matrix, &matrix.row_weights(false), factors, false, "PETSc")?;
        if self.proved {
            return Ok(());
        }
        let name = &factors.facts.name;
        let known = KNOWN_TO_FAIL.iter().any(|method| name.contains(method));
        let cure = "the gradient needs it; omit `petsc_options` to use MUMPS, or choose a method that supports it";
        if known || !factors.facts.transposes {
            return Err(Self::fail(a.n(), format!("{name} cannot solve with the transpose: {cure}")));
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

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        let n = pattern.n();
        if n > i32::MAX as usize {
            return Err(Self::fail(n, "there are more than 2^31 unknowns"));
        }
        let same = |symbolic: &&Symbolic| symbolic.is_of(pattern) && symbolic.content::<Analysis>().is_some();
        let known = earlier.iter().find(same);
        // if any rank has a new pattern, all ranks make a new analysis
        if let (false, Some(symbolic)) = (self.session.any(known.is_none()), known) {
            return Ok(symbolic.clone());
        }
        let layout = Arc::new(Layout::new(pattern, &self.owners, &self.session));
        let mut entries = [pattern.entries() as f64];
        self.session.sum(&mut entries);
        Ok(Symbolic::new(pattern, Analysis { layout, entries: entries[0], objects: Mutex::default() }))
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let n = a.n();
        let analysis = symbolic.content_for::<Analysis>(a);
        self.agree(analysis.as_ref().map(|_| ()).map_err(Clone::clone), n)?;
        let analysis = analysis?;
        // `factors` removes the objects while it works, so that a panic leaves none behind
        let mut objects = analysis.objects.lock().unwrap_or_else(PoisonError::into_inner);
        let made = self.factors(analysis, &mut objects, a);
        let factors = self.finish(analysis, made, n).inspect_err(|_| *objects = Objects::default())?;
        if matches!(self.kind, Kind::Whole) {
            self.prove(a, &factors)?;
        }
        Ok(Box::new(factors))
    }
}

/// Encodes numbers as a message.
fn words(numbers: &[u64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Factors on all ranks.
#[derive(Debug)]
struct PetscFactorization {
    factors: Arc<Factors>,
    layout: Arc<Layout>,
    facts: Facts,
}

impl PetscFactorization {
    /// A failed solve leaves NaN, which no verified solve accepts as a solution.
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

    /// The largest value of any rank.
    fn bytes(&self) -> usize {
        self.facts.bytes
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }

    /// From the operations of all ranks and the largest part of the factors; `None` if PETSc
    /// reports no operations.
    fn cost(&self) -> Option<Cost> {
        let factorization = BYTES_PER_OPERATION * self.facts.operations;
        let substitution = self.facts.bytes as f64;
        (factorization > 0.0).then_some(Cost { factorization, substitution, solves_per_digit: 0.0, further: 1.0 })
    }

    fn part(&self) -> FactorPart {
        self.facts.part
    }
}
