//! An iterative solver instead of factors of the whole matrix: a zone around the contact is
//! factorized, and multigrid is used for the bodies.

use crate::factors::Kind;
use crate::solver::{PetscBackend, PetscSolver};
use slipstick_linalg::{
    Alone, Backend, CsrMatrix, CsrPattern, EliminationTree, FactorPart, Factorization, FactorizationError, Layout,
    LinearSolver, Operator, Precision, Ranks, SolveError, SolveOptions, Summed, Symbolic, solve_with, test_on,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Relative residual to which one solve iterates. The verified solve around it continues from
/// there.
const TOLERANCE: f64 = 1e-6;

/// Maximum number of iterations of one solve, and number of vectors kept before a restart.
const MOST: usize = 600;
const RESTART: usize = 200;

/// Memory of MUMPS for the zone, relative to its factors with METIS ordering; and of the multigrid
/// method for each entry of the matrix, besides the two and a half copies of the matrix that any solver
/// needs. Fitted to the table of `docs/measure/cluster/zone.sh`, one rank.
const MUMPS: f64 = 1.7;
const BYTES_PER_ENTRY: f64 = 2.0;

/// Marks a diagonal entry of a block that is not in the whole matrix.
const FILLER: u32 = u32::MAX;

/// Data of the bodies for the contact-zone preconditioner.
///
/// The zone contains the unknowns of all slave nodes, those coupled to them, and so on for some
/// layers; its block of the matrix is factorized (by MUMPS). The displacements of all bodies get a
/// multigrid cycle (PETSc's GAMG) that uses their rigid motions. The preconditioner of GMRES
/// applies these in the order bodies, zone, bodies; for the transpose, it applies the transposes in
/// the same order.
#[derive(Debug, Clone)]
pub struct ContactZone {
    /// Reference coordinates of every node, which are the first block rows. \[L\]
    pub coordinates: Arc<[[f64; 3]]>,
    /// The slave nodes.
    pub slaves: Arc<[u32]>,
    /// Nodes whose unknowns are always in the zone and never in the bodies: those of rigid bodies, whose
    /// rows are as long as their surfaces.
    pub apart: Arc<[u32]>,
    /// Layers of neighbours around the slave nodes.
    pub layers: usize,
    /// Counts the iterations of all solves.
    pub iterations: Arc<AtomicUsize>,
}

impl ContactZone {
    /// Two layers: the opposite master nodes and the next nodes of the bodies, and the nodes around
    /// these.
    pub fn new(coordinates: impl Into<Arc<[[f64; 3]]>>, slaves: impl Into<Arc<[u32]>>) -> Self {
        let (coordinates, slaves) = (coordinates.into(), slaves.into());
        Self { coordinates, slaves, apart: Arc::new([]), layers: 2, iterations: Arc::default() }
    }

    /// Memory of the preconditioner and of its iterations on one rank \[bytes\], and floating-point
    /// operations of the zone's factorization, for a matrix with this pattern. `None` if the zone has
    /// too many couplings.
    pub fn predict(&self, pattern: &CsrPattern) -> Option<(f64, f64)> {
        let (numbers, _) = self.numbers(pattern, &Alone);
        let (mut row_offsets, mut columns, mut groups) = (vec![0], Vec::new(), Vec::new());
        for row in (0..pattern.n()).filter(|&row| numbers[row].is_some()) {
            columns.extend(pattern.row(row).iter().filter_map(|&column| numbers[column as usize]));
            row_offsets.push(columns.len());
            groups.push(pattern.groups()[row]);
        }
        let zone = CsrPattern::new(row_offsets, columns, groups, Vec::new()).ok()?;
        let (entries, operations) = EliminationTree::new(&zone, None).ok()?.size();
        Some((8.0 * MUMPS * entries + BYTES_PER_ENTRY * pattern.entries() as f64, operations))
    }

    /// The number of each unknown in the zone, and how many there are.
    fn numbers(&self, pattern: &CsrPattern, ranks: &dyn Ranks) -> (Vec<Option<u32>>, usize) {
        let mut next = 0;
        let number = |inside: bool| {
            inside.then(|| {
                next += 1;
                next - 1
            })
        };
        let numbers = self.contains(pattern, ranks).into_iter().map(number).collect();
        (numbers, next as usize)
    }

    /// Whether each unknown is in the zone.
    fn contains(&self, pattern: &CsrPattern, ranks: &dyn Ranks) -> Vec<bool> {
        let nodes = self.coordinates.len() as u32;
        let mut slave = vec![false; nodes as usize];
        for &node in self.slaves.iter().filter(|&&node| node < nodes) {
            slave[node as usize] = true;
        }
        let of_slave = |i: usize| slave.get(pattern.groups()[i] as usize).is_some_and(|&is| is);
        // multipliers too, if they are not grouped with their slave node
        let mut inside: Vec<bool> =
            (0..pattern.n()).map(|i| of_slave(i) || pattern.origins()[i] >= 3 * nodes).collect();
        for _ in 0..self.layers {
            let mut reached: Vec<f64> = inside.iter().map(|&is| f64::from(u8::from(is))).collect();
            for row in 0..pattern.n() {
                let columns = pattern.row(row);
                if inside[row] {
                    columns.iter().for_each(|&column| reached[column as usize] = 1.0);
                } else if columns.iter().any(|&column| inside[column as usize]) {
                    reached[row] = 1.0;
                }
            }
            ranks.sum(&mut reached);
            inside = reached.iter().map(|&reached| reached > 0.0).collect();
        }
        for (inside, origin) in inside.iter_mut().zip(pattern.origins()) {
            *inside |= self.apart.contains(&(origin / 3));
        }
        inside
    }
}

/// Makes preconditioned iterative solvers for matrices whose parts are on the ranks.
#[derive(Debug)]
pub(crate) struct ContactZoneSolver {
    backend: PetscBackend,
    data: Arc<ContactZone>,
    zone: PetscSolver,
    bulk: PetscSolver,
    proved: bool,
}

/// The division of unknowns and entries into blocks, for one pattern.
#[derive(Debug)]
struct Analysis {
    layout: Arc<Layout>,
    /// `None` if there is no contact.
    zone: Option<Block>,
    bulk: Block,
}

/// A block of the matrix, and the analysis of its pattern.
#[derive(Debug)]
struct Block {
    part: Arc<Part>,
    symbolic: Symbolic,
}

/// A block of the matrix with its own numbering.
#[derive(Debug)]
struct Part {
    pattern: Arc<CsrPattern>,
    /// Corresponding entries of this rank's vectors of the whole matrix and of the block.
    shared: Vec<(u32, u32)>,
    /// Number of unknowns of the block on this rank.
    own: usize,
    /// Source of each entry: its position in the whole pattern, or [`FILLER`].
    sources: Vec<u32>,
}

impl ContactZoneSolver {
    pub(crate) fn new(backend: &PetscBackend, data: Arc<ContactZone>) -> Self {
        let zone = PetscSolver::of(backend, Kind::Zone);
        let bulk = PetscSolver::of(backend, Kind::Bulk);
        Self { backend: backend.clone(), data, zone, bulk, proved: false }
    }

    /// The blocks for a pattern, chosen identically on all ranks.
    fn blocks(&self, pattern: &CsrPattern) -> Result<Analysis, FactorizationError> {
        let n = pattern.n();
        let told = pattern.origins().len() == n && pattern.origins().windows(2).all(|pair| pair[0] < pair[1]);
        if self.backend.ranks().any(!told) {
            let reason = "the pattern does not state the block rows of its unknowns in ascending order".into();
            return Err(FactorizationError::Backend { solver: self.name(), n, reason });
        }
        if self.backend.ranks().any(pattern.entries() >= FILLER as usize) {
            let reason = "a rank has more than 2^32 entries of the matrix; use more ranks".into();
            return Err(FactorizationError::Backend { solver: self.name(), n, reason });
        }
        let nodes = self.data.coordinates.len();
        let layout = Arc::new(self.backend.layout(pattern));
        let bulk = Part::new(&self.backend, pattern, &layout, 3 * nodes, |i| {
            let origin = pattern.origins()[i];
            (origin < 3 * nodes as u32 && !self.data.apart.contains(&(origin / 3))).then_some(origin)
        });
        let (numbers, count) = self.data.numbers(pattern, self.backend.ranks());
        let zone = Part::new(&self.backend, pattern, &layout, count, |i| numbers[i]);
        let zone = (zone.pattern.n() > 0).then(|| Block::new(zone, &self.zone)).transpose()?;
        Ok(Analysis { layout, zone, bulk: Block::new(bulk, &self.bulk)? })
    }

    /// Tests the first solver that is made, also with the transpose. A test costs as much as a
    /// solve, and every solve is verified anyway, so later ones are not tested.
    fn prove(&mut self, a: &CsrMatrix, factors: &ContactZoneFactorization) -> Result<(), FactorizationError> {
        if self.proved {
            return Ok(());
        }
        let matrix = factors.cycle.matrix();
        for transpose in [false, true] {
            test_on(&matrix, &matrix.row_weights(transpose), factors, transpose, self.name()).map_err(|error| {
                match error {
                    FactorizationError::Inaccurate { residual, .. } => {
                        let of = if transpose { "the transpose of the matrix" } else { "the matrix" };
                        let reason = format!(
                            "the iteration left a relative residual of {residual:.1e} with {of}; omit \
                         `petsc_preconditioner` to use factors of the whole matrix"
                        );
                        FactorizationError::Backend { solver: self.name(), n: a.n(), reason }
                    }
                    other => other,
                }
            })?;
        }
        self.proved = true;
        Ok(())
    }
}

impl Block {
    fn new(part: Part, solver: &PetscSolver) -> Result<Self, FactorizationError> {
        Ok(Self { symbolic: solver.analyse(&part.pattern)?, part: Arc::new(part) })
    }
}

impl Part {
    /// The block of the unknowns that get a `number` below `n`.
    fn new(
        backend: &PetscBackend,
        whole: &CsrPattern,
        layout: &Layout,
        n: usize,
        number: impl Fn(usize) -> Option<u32>,
    ) -> Self {
        let mut present = vec![None; n];
        for outer in 0..whole.n() {
            if let Some(inner) = number(outer) {
                present[inner as usize] = Some(outer);
            }
        }
        let mut row_offsets = vec![0];
        let (mut columns, mut sources, mut groups, mut origins) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (inner, outer) in present.iter().enumerate() {
            match outer {
                Some(row) => {
                    for (k, &column) in whole.row_range(*row).zip(whole.row(*row)) {
                        if let Some(column) = number(column as usize) {
                            sources.push(k as u32);
                            columns.push(column);
                        }
                    }
                    groups.push(whole.groups()[*row]);
                    origins.push(whole.origins()[*row]);
                }
                // a prescribed unknown of a node: a scaled row of the identity, on the rank that
                // owns it
                None => {
                    if backend.owner(inner as u32 / 3) == backend.ranks().rank() {
                        sources.push(FILLER);
                        columns.push(inner as u32);
                    }
                    groups.push(inner as u32 / 3);
                    origins.push(inner as u32);
                }
            }
            row_offsets.push(columns.len());
        }
        columns.shrink_to_fit();
        sources.shrink_to_fit();
        let pattern = CsrPattern::new(row_offsets, columns, groups, origins).map(Arc::new).expect(
            "the numbers of a block's unknowns ascend like those of the whole, and there is an offset for each",
        );
        let inside = backend.layout(&pattern);
        // unknowns of one group belong to one rank, in the block as in the whole matrix
        let shared = (0..layout.own() as u32).filter_map(|outer| {
            let inner = number(layout.unknown(outer as usize))?;
            inside.entry(inner as usize).map(|inner| (outer, inner as u32))
        });
        Self { shared: shared.collect(), own: inside.own(), pattern, sources }
    }

    /// An entry of the block of `a`; `filler` is on the diagonal where `a` has no row.
    fn entry(&self, k: usize, a: &CsrMatrix, filler: f64) -> f64 {
        let source = self.sources[k];
        if source == FILLER { filler } else { a.values[source as usize] }
    }

    /// The block of `a`, all of whose rows are rows of `a`.
    fn of(&self, a: &CsrMatrix) -> CsrMatrix {
        let values = (0..self.sources.len()).map(|k| self.entry(k, a, 0.0)).collect();
        CsrMatrix { pattern: self.pattern.clone(), values }
    }

    fn restrict(&self, outer: &[f64]) -> Vec<f64> {
        let mut inner = vec![0.0; self.own];
        self.shared.iter().for_each(|&(i, k)| inner[k as usize] = outer[i as usize]);
        inner
    }

    fn add(&self, inner: &[f64], outer: &mut [f64]) {
        self.shared.iter().for_each(|&(i, k)| outer[i as usize] += inner[k as usize]);
    }
}

impl LinearSolver for ContactZoneSolver {
    fn name(&self) -> &'static str {
        "PETSc with a contact zone"
    }

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        let same = |symbolic: &&Symbolic| symbolic.is_of(pattern) && symbolic.content::<Analysis>().is_some();
        let known = earlier.iter().find(same);
        // if any rank has a new pattern, all ranks make a new analysis
        if let (false, Some(symbolic)) = (self.backend.ranks().any(known.is_none()), known) {
            return Ok(symbolic.clone());
        }
        Ok(Symbolic::new(pattern, self.blocks(pattern)?))
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let analysis = symbolic.content_for::<Analysis>(a);
        self.zone.agree(analysis.as_ref().map(|_| ()).map_err(Clone::clone), a.n())?;
        let Analysis { layout, zone, bulk } = analysis?;
        let zone = match zone {
            None => None,
            Some(Block { part, symbolic }) => Some((self.zone.factorize(symbolic, &part.of(a))?, part.clone())),
        };
        let ranks = self.backend.ranks();
        let mut sums = [a.largest_in_rows().iter().sum(), a.values.len() as f64];
        ranks.sum(&mut sums);
        let [sizes, entries] = sums;
        let filler = sizes / a.n().max(1) as f64;
        let entry = |k| bulk.part.entry(k, a, filler);
        let bulk_factors = self.bulk.of_bodies(&bulk.symbolic, &self.data.coordinates, &entry)?;
        let factors = ContactZoneFactorization {
            cycle: Cycle {
                a: a.clone(),
                layout: layout.clone(),
                backend: self.backend.clone(),
                zone,
                bulk: (bulk_factors, bulk.part.clone()),
                entries: (entries / ranks.size() as f64) as usize,
            },
            iterations: self.data.iterations.clone(),
        };
        self.prove(a, &factors)?;
        Ok(Box::new(factors))
    }
}

/// One application of the preconditioner.
struct Cycle {
    a: CsrMatrix,
    layout: Arc<Layout>,
    backend: PetscBackend,
    /// `None` if there is no contact.
    zone: Option<(Box<dyn Factorization>, Arc<Part>)>,
    bulk: (Box<dyn Factorization>, Arc<Part>),
    /// Average number of matrix entries per rank, so that decisions based on memory are the same on
    /// all ranks.
    entries: usize,
}

impl Cycle {
    fn matrix(&self) -> Summed<'_> {
        Summed { part: &self.a, layout: &self.layout, ranks: self.backend.ranks() }
    }

    /// Applies bodies, zone, bodies; because this order is symmetric, the transpose applies their
    /// transposes in the same order.
    fn apply(&self, transpose: bool, rhs: &mut [f64]) {
        let matrix = self.matrix();
        let mut x = vec![0.0; rhs.len()];
        let mut left = rhs.to_vec();
        let bulk = &self.bulk;
        let turns = self.zone.as_ref().map_or(vec![bulk], |zone| vec![bulk, zone, bulk]);
        for (k, (factors, part)) in turns.into_iter().enumerate() {
            if k > 0 {
                matrix.residual(transpose, &x, rhs, &mut left);
            }
            let mut inner = part.restrict(&left);
            if transpose {
                factors.solve_transpose(&mut inner);
            } else {
                factors.solve(&mut inner);
            }
            part.add(&inner, &mut x);
        }
        rhs.copy_from_slice(&x);
    }
}

impl Factorization for Cycle {
    fn solve(&self, rhs: &mut [f64]) {
        self.apply(false, rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.apply(true, rhs);
    }

    fn n(&self) -> usize {
        self.layout.own()
    }

    fn bytes(&self) -> usize {
        self.zone.as_ref().map_or(0, |(zone, _)| zone.bytes()) + self.bulk.0.bytes() + 8 * self.entries
    }

    fn part(&self) -> FactorPart {
        let zone = self.zone.as_ref().map_or(FactorPart::default(), |(zone, _)| zone.part());
        FactorPart { bytes: zone.bytes + self.bulk.0.part().bytes + 8 * self.a.values.len(), ..zone }
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }
}

/// The iterative solver with that preconditioner.
struct ContactZoneFactorization {
    cycle: Cycle,
    iterations: Arc<AtomicUsize>,
}

impl ContactZoneFactorization {
    /// If the iteration does not converge, it leaves its best approximation, and the verified solve
    /// around it detects this.
    fn iterate(&self, transpose: bool, rhs: &mut [f64]) {
        let matrix = self.cycle.matrix();
        let options = SolveOptions { tolerance: TOLERANCE, max_iterations: MOST, restart: RESTART, alternative: None };
        let mut x = vec![0.0; rhs.len()];
        let iterations = match solve_with(&matrix, &self.cycle, transpose, rhs, &mut x, &options) {
            Ok(report) => report.iterations,
            Err(SolveError::NotConverged { report, .. }) => report.iterations,
            Err(_) => {
                x.fill(f64::NAN);
                0
            }
        };
        self.iterations.fetch_add(iterations + 1, Ordering::Relaxed);
        rhs.copy_from_slice(&x);
    }
}

impl Factorization for ContactZoneFactorization {
    fn solve(&self, rhs: &mut [f64]) {
        self.iterate(false, rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.iterate(true, rhs);
    }

    fn n(&self) -> usize {
        self.cycle.n()
    }

    fn bytes(&self) -> usize {
        self.cycle.bytes()
    }

    fn part(&self) -> FactorPart {
        self.cycle.part()
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }
}
