//! Two-level overlapping Schwarz preconditioner: an iterative solver whose cost grows linearly with
//! the number of unknowns.
//!
//! One application of the preconditioner consists of two steps:
//!
//! 1. *Subdomains.* The nodes are divided into compact parts of about [`PART`] unknowns. With
//!    multipliers, their boundaries stay away from contact. Each part is extended by the nodes
//!    around it. The blocks of the matrix on these overlapping subdomains are factorized in single
//!    precision by the multifrontal solver, and the factors are stored with 16 bits per entry. A
//!    slave node, its multipliers and the opposite master nodes are neighbours in the graph of the
//!    matrix, so contact conditions lie within subdomains. The factors handle their zero diagonal
//!    entries, unsymmetric slip couplings, and stiff elements next to soft ones.
//! 2. *Coarse space.* Within small boxes, strongly coupled nodes of a body form aggregates, so
//!    solid and void do not share an aggregate. Each aggregate has the six rigid motions of its
//!    reference coordinates, smoothed by a block-Jacobi step. The Galerkin product with these
//!    motions, which has one coarse unknown for about 24 unknowns, is also factorized, in single
//!    precision unless some motions are weakly supported. For the next matrix with the same pattern,
//!    if most subdomains keep their factors, the motions keep their displacements. Their multipliers,
//!    and the part of the product that comes from the other subdomains or from those that touch
//!    contact, are recomputed.
//!
//! With the restricted additive operator M₁ of the first step and that of the second, Q = P (Rᵀ A
//! P)⁻¹ Rᵀ, the preconditioner is M = M₁ + Q (I − A M₁), and its transpose, with the same factors,
//! is Mᵀ = Qᵀ + M₁ᵀ (I − Aᵀ Qᵀ). The residuals I − A M₁ and I − Aᵀ Qᵀ use A in single precision.
//! [`solve_verified`](crate::solve_verified) iterates with this preconditioner.
//!
//! References: Smith, Bjørstad and Gropp, *Domain Decomposition*, Cambridge University Press (1996);
//! Cai and Sarkis, SIAM J. Sci. Comput. 21 (1999), for restricted additive Schwarz; Vaněk, Mandel and
//! Brezina, Computing 56 (1996), for smoothed aggregation. Test: `crates/linalg/tests/suite/schwarz.rs`.

mod aggregates;
mod choice;
mod coarse;
mod galerkin;
mod local;
mod motions;
mod partition;
mod transfer;
mod vertices;

use crate::csr::{CsrMatrix, CsrPattern};
use crate::multifrontal::MultifrontalFactorization;
use crate::robust::{Link, RobustSolver, SolverChoice};
use crate::solver::{
    Backend, Cost, FactorPart, Factorization, FactorizationError, LinearSolver, Precision, check_columns,
};
use crate::symbolic::Symbolic;
pub use choice::{Automatic, Forecast};
use coarse::Coarse;
use galerkin::Kept;
use local::{Subdomain, SubdomainFactors};
use motions::Displacements;
use rayon::prelude::*;
use std::sync::Arc;
use vertices::Vertices;

const NAME: &str = "Schwarz preconditioner";

/// Number of unknowns of a part. With parts of 3000, 4500 and 9000, the preconditioner was applied 112,
/// 110 and 98 times in a load step of the half-ball with 294,000 unknowns, and 91, 95 and 99 times in
/// two steps of the clutch with 297,000 (measured while parts could end at the contact). The factors of
/// small parts take less time and memory.
pub const PART: usize = 3000;

/// Layers of nodes by which parts are extended. Two layers would save a quarter of the iterations
/// and more than double the memory.
const LAYERS: usize = 1;

/// Layers of nodes around a slave node that are put into its part. If parts may end at the contact,
/// blocks with 101,000 unknowns need 42 instead of 26 iterations.
const TOGETHER: usize = 2;

/// Number of solves that reduce a residual to a tenth; ten digits take 20 to 29 at 35,000 to
/// 303,000 unknowns.
const SOLVES_PER_DIGIT: f64 = 3.0;

/// [`Cost::further`], measured by `cargo run --release -p slipstick-linalg --example schwarz`.
const FURTHER: f64 = 0.45;

/// Memory of the factors, and of the copy of the matrix and the analysis. \[bytes\]
const BYTES_PER_UNKNOWN: f64 = 4400.0;
const BYTES_PER_ENTRY: f64 = 16.0;

/// Floating-point operations that take as long as computing the preconditioner; the factors alone need
/// 1.3e5.
const OPERATIONS_PER_UNKNOWN: f64 = 4e5;

/// Unknowns above which direct solvers are not tried after the preconditioner has failed: their
/// factors would need more than about 10 GB.
const LARGEST_FALLBACK: usize = 600_000;

/// The data of a mesh's nodes that the coarse space needs. Nodes are the first block rows of the
/// matrix ([`CsrPattern::origins`]).
#[derive(Debug, Clone)]
pub struct Nodes {
    /// Reference coordinates. \[L\]
    pub coordinates: Arc<[[f64; 3]]>,
    /// Body of each node; `None` for the nodes of rigid bodies, whose unknowns couple to whole
    /// surfaces. Each of these unknowns is also a coarse unknown.
    pub bodies: Arc<[Option<u32>]>,
}

impl Nodes {
    fn body(&self, node: u32) -> Option<u32> {
        self.bodies.get(node as usize).copied().flatten()
    }

    /// Whether an unknown with this [origin](CsrPattern::origins) is a multiplier.
    fn is_multiplier(&self, origin: u32) -> bool {
        origin as usize >= 3 * self.coordinates.len()
    }

    fn position(&self, node: u32) -> [f64; 3] {
        self.coordinates[node as usize]
    }
}

/// Creates solver chains that start with a [`SchwarzSolver`] and, up to 600 000 unknowns, continue
/// with the direct solvers of [`SolverChoice::Auto`].
#[derive(Debug, Clone)]
pub struct Schwarz(pub Nodes);

impl Backend for Schwarz {
    fn solver(&self) -> Box<dyn LinearSolver> {
        let mut chain = vec![Link::new(SchwarzSolver::new(self.0.clone()))];
        chain.extend(SolverChoice::Auto.chain().into_iter().map(|link| link.up_to(LARGEST_FALLBACK)));
        Box::new(RobustSolver::of(chain))
    }
}

/// Creates the preconditioner for matrices of meshes, on a single rank; see the [module](self).
#[derive(Debug)]
pub struct SchwarzSolver {
    nodes: Nodes,
    latest: Option<Latest>,
}

/// Data of the latest matrix.
#[derive(Debug)]
struct Latest {
    subdomains: Arc<[Subdomain]>,
    factors: Vec<Arc<SubdomainFactors>>,
    coarse: CoarseBasis,
}

/// What coarse spaces of similar matrices share.
#[derive(Debug)]
struct CoarseBasis {
    displacements: Arc<Displacements>,
    product: Option<Kept>,
    /// Which subdomains touch contact or have got new factors since the displacements were computed.
    changed: Vec<bool>,
}

impl CoarseBasis {
    fn new(a: &CsrMatrix, vertices: &Vertices, nodes: &Nodes, subdomains: &[Subdomain]) -> Self {
        let multiplier = motions::multipliers(a, nodes);
        let changed = subdomains.iter().map(|subdomain| subdomain.touches(vertices, &multiplier)).collect();
        Self { displacements: Arc::new(Displacements::new(a, vertices, nodes)), product: None, changed }
    }

    /// The vertices that the changed subdomains own.
    fn near(&self, vertices: &Vertices, subdomains: &[Subdomain]) -> Vec<bool> {
        let mut near = vec![false; vertices.len()];
        let changed = subdomains.iter().zip(&self.changed).filter(|(_, changed)| **changed);
        for i in changed.flat_map(|(subdomain, _)| subdomain.own_unknowns()) {
            near[vertices.of[i as usize] as usize] = true;
        }
        near
    }
}

/// The subdomains for a pattern.
#[derive(Debug)]
struct Analysis {
    vertices: Vertices,
    subdomains: Arc<[Subdomain]>,
}

impl SchwarzSolver {
    /// A solver for matrices of a mesh with these nodes.
    pub fn new(nodes: Nodes) -> Self {
        Self { nodes, latest: None }
    }

    /// Bytes of the preconditioner for a matrix on `pattern`, including the analysis, and
    /// floating-point operations that take as long as computing it; both grow in proportion to
    /// unknowns and entries. Measured for 100,000 unknowns.
    pub fn predict(pattern: &CsrPattern) -> (f64, f64) {
        let (n, entries) = (pattern.n() as f64, pattern.entries() as f64);
        (BYTES_PER_UNKNOWN * n + BYTES_PER_ENTRY * entries, OPERATIONS_PER_UNKNOWN * n)
    }

    /// Checks that the pattern assigns each unknown to a node, and that 32 bits can number its entries.
    fn check(&self, pattern: &CsrPattern) -> Result<(), FactorizationError> {
        let (n, count) = (pattern.n(), self.nodes.coordinates.len());
        if u32::try_from(pattern.entries()).is_err() {
            let reason = format!("the matrix has {} entries; the most are 2^32 − 1", pattern.entries());
            return Err(FactorizationError::Backend { solver: NAME, n, reason });
        }
        let known = pattern.origins().len() == n
            && self.nodes.bodies.len() == count
            && pattern.groups().iter().all(|&group| (group as usize) < count);
        let reason = "the pattern does not state the nodes of its unknowns";
        if known { Ok(()) } else { Err(FactorizationError::Backend { solver: NAME, n, reason: reason.into() }) }
    }
}

impl LinearSolver for SchwarzSolver {
    fn name(&self) -> &'static str {
        NAME
    }

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        let own = |symbolic: &&Symbolic| symbolic.is_of(pattern) && symbolic.content::<Analysis>().is_some();
        if let Some(known) = earlier.iter().find(own) {
            return Ok(known.clone());
        }
        self.check(pattern)?;
        let vertices = Vertices::new(pattern);
        let all = (0..vertices.len() as u32).collect();
        let mut parts = partition::bisect(
            all,
            pattern.n().div_ceil(PART),
            &|v| self.nodes.position(vertices.nodes[v as usize]),
            &|v| vertices.members(v as usize).len(),
        );
        partition::keep_together(&mut parts, &vertices, TOGETHER, |v| {
            vertices.members(v).iter().any(|&i| self.nodes.is_multiplier(pattern.origins()[i as usize]))
        });
        let subdomain = |own: &Vec<u32>| Subdomain::new(pattern, &vertices, own, LAYERS);
        let subdomains: Result<Vec<Subdomain>, _> = parts.par_iter().with_max_len(1).map(subdomain).collect();
        let subdomains = subdomains?.into();
        Ok(Symbolic::new(pattern, Analysis { vertices, subdomains }))
    }

    /// # Errors
    /// Those of the subdomains' factors, and [`FactorizationError::Singular`] if coarse motions are
    /// free: nothing holds a body, not even contact.
    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let Analysis { vertices, subdomains } = symbolic.content_for(a)?;
        let latest = self.latest.take().filter(|latest| Arc::ptr_eq(&latest.subdomains, subdomains));
        let (earlier, basis) = match latest {
            Some(latest) => (latest.factors.into_iter().map(Some).collect(), Some(latest.coarse)),
            None => (vec![None; subdomains.len()], None),
        };
        let factorize = |(subdomain, earlier): (&Subdomain, _)| subdomain.factorize(a, earlier);
        let factors: Result<Vec<(Arc<SubdomainFactors>, bool)>, _> =
            subdomains.par_iter().zip(earlier).with_max_len(1).map(factorize).collect();
        let (factors, kept): (Vec<Arc<SubdomainFactors>>, Vec<bool>) = factors?.into_iter().unzip();
        let most = 2 * kept.iter().filter(|kept| **kept).count() > kept.len();
        let mut basis = match basis.filter(|_| most) {
            Some(mut basis) => {
                basis.changed.iter_mut().zip(&kept).for_each(|(changed, kept)| *changed |= !kept);
                basis
            }
            None => CoarseBasis::new(a, vertices, &self.nodes, subdomains),
        };
        let near = basis.near(vertices, subdomains);
        let earlier = basis.product.take();
        let (coarse, product) = Coarse::new(a, vertices, &self.nodes, &basis.displacements, earlier, &near)?;
        basis.product = Some(product);
        self.latest = Some(Latest { subdomains: subdomains.clone(), factors: factors.clone(), coarse: basis });
        let (a, made) = (a.rounded(), kept.iter().map(|kept| !kept).collect());
        Ok(Box::new(SchwarzFactorization { a, subdomains: subdomains.clone(), factors, made, coarse }))
    }

    fn precision(&self) -> Precision {
        Precision::F32
    }

    fn is_iterative(&self) -> bool {
        true
    }
}

/// The preconditioner of a matrix.
struct SchwarzFactorization {
    /// In single precision, like the factors.
    a: CsrMatrix<f32>,
    subdomains: Arc<[Subdomain]>,
    factors: Vec<Arc<SubdomainFactors>>,
    /// Which of these were not taken over from an earlier matrix.
    made: Vec<bool>,
    coarse: Coarse,
}

impl SchwarzFactorization {
    fn local(&self, transpose: bool, rhs: &[f64], x: &mut [f64]) {
        local::solve(&self.subdomains, &self.factors, transpose, self.n(), rhs, x);
    }

    /// b − A x in each column, or with the transpose of A.
    fn residual(&self, transpose: bool, x: &[f64], rhs: &[f64]) -> Vec<f64> {
        let mut left = vec![0.0; rhs.len()];
        let n = self.n().max(1);
        for (x, left) in x.chunks_exact(n).zip(left.chunks_exact_mut(n)) {
            if transpose {
                self.a.mul_transpose(x, left);
            } else {
                self.a.mul(x, left);
            }
        }
        left.iter_mut().zip(rhs).for_each(|(left, rhs)| *left = rhs - *left);
        left
    }

    /// The factors computed for this matrix.
    fn new_factors(&self) -> impl Iterator<Item = &MultifrontalFactorization> {
        let made = self.factors.iter().zip(&self.made).filter(|(_, made)| **made);
        made.map(|(subdomain, _)| &subdomain.factors).chain([self.coarse.factors()])
    }

    fn operations(&self) -> f64 {
        self.new_factors().map(|factors| factors.statistics().operations).sum()
    }
}

impl Factorization for SchwarzFactorization {
    fn solve(&self, rhs: &mut [f64]) {
        self.solve_many(rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.solve_transpose_many(rhs);
    }

    fn solve_many(&self, rhs: &mut [f64]) {
        check_columns(self.n(), rhs.len());
        let mut x = vec![0.0; rhs.len()];
        self.local(false, rhs, &mut x);
        self.coarse.solve(false, self.n(), &self.residual(false, &x, rhs), &mut x);
        rhs.copy_from_slice(&x);
    }

    fn solve_transpose_many(&self, rhs: &mut [f64]) {
        check_columns(self.n(), rhs.len());
        let mut x = vec![0.0; rhs.len()];
        self.coarse.solve(true, self.n(), rhs, &mut x);
        let left = self.residual(true, &x, rhs);
        self.local(true, &left, &mut x);
        rhs.copy_from_slice(&x);
    }

    fn n(&self) -> usize {
        self.a.n()
    }

    /// Includes the copy of the matrix that the second step needs.
    fn bytes(&self) -> usize {
        let local: usize = self.factors.iter().map(|subdomain| subdomain.bytes()).sum();
        local + self.coarse.bytes() + 4 * self.a.values.len()
    }

    fn precision(&self) -> Precision {
        Precision::F32
    }

    /// Counts the factors computed for this matrix, as the next one will also keep some, and, as passes
    /// over its data, the Galerkin product; a solve costs one pass over all factors and the matrix.
    fn cost(&self) -> Option<Cost> {
        let factors: f64 = self.new_factors().filter_map(Factorization::cost).map(|cost| cost.factorization).sum();
        let substitution = self.bytes() as f64 + 4.0 * self.a.values.len() as f64;
        Some(Cost {
            factorization: factors + self.coarse.product_cost(),
            substitution,
            solves_per_digit: SOLVES_PER_DIGIT,
            further: FURTHER,
        })
    }

    fn part(&self) -> FactorPart {
        FactorPart { bytes: self.bytes(), operations: self.operations() }
    }
}
