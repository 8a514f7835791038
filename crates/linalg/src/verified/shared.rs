//! Iterations of several right-hand sides in one space of directions.

use super::report::SolveOptions;
use super::solve::{Found, Solve};
use crate::csr::norm_on;
use crate::vectors::{dots, subtract};
use slipstick_ranks::Ranks;

/// A direction counts as new if this much of its product is outside the span of the others.
const NEW: f64 = 1e-6;

/// Generalized conjugate residuals for several right-hand sides: each iteration adds the
/// preconditioned residual of each of them to one space, in which all residuals are minimized.
///
/// With factors of a nearby matrix, residuals soon lie in the few directions in which the factors are
/// wrong, which are the same for all right-hand sides: together, they find them in fewer iterations.
/// For one right-hand side, the iterates are those of GMRES.
///
/// References: Eisenstat, Elman and Schultz, SIAM J. Numer. Anal. 20 (1983), for one right-hand side;
/// O'Leary, Linear Algebra Appl. 29 (1980), for blocks of them. Test:
/// `right_hand_sides_share_directions`.
pub(super) struct SharedCycle {
    /// Orthonormal products A z of the directions.
    products: Vec<Vec<f64>>,
    directions: Vec<Vec<f64>>,
    members: Vec<Member>,
}

/// The iteration of one right-hand side.
struct Member {
    x: Vec<f64>,
    residual: Vec<f64>,
    norm: f64,
    /// Norm of the residual at the start.
    beta: f64,
    taken: usize,
    /// Maximum number of iterations.
    steps: usize,
    ended: bool,
    given_up: bool,
    finite: bool,
}

impl SharedCycle {
    pub(super) fn new(solves: &[&Solve<'_>], options: &SolveOptions) -> Self {
        let member = |solve: &&Solve<'_>| {
            let beta = solve.matrix.norm_of(&solve.residual);
            let left = options.max_iterations.saturating_sub(solve.report.iterations);
            Member {
                x: solve.x.to_vec(),
                residual: solve.residual.clone(),
                norm: beta,
                beta,
                taken: 0,
                steps: left.min(options.restart.max(1)),
                ended: false,
                given_up: false,
                finite: true,
            }
        };
        Self { products: Vec::new(), directions: Vec::new(), members: solves.iter().map(member).collect() }
    }

    /// The directions to be preconditioned next; none at the end.
    pub(super) fn next(&self) -> Vec<Vec<f64>> {
        let open = self.members.iter().filter(|member| !member.ended);
        open.map(|member| member.residual.iter().map(|r| r / member.norm).collect()).collect()
    }

    /// Adds preconditioned directions and their products with the matrix.
    pub(super) fn extend(
        &mut self,
        solves: &[&Solve<'_>],
        found: impl Iterator<Item = (Vec<f64>, Vec<f64>)>,
        options: &SolveOptions,
    ) {
        let ranks = solves[0].matrix.a.ranks();
        let known = self.products.len();
        if !found.fold(true, |usable, (z, w)| self.add(z, w, ranks) && usable) {
            // the factors or the matrix, which all share, are unusable
            let open = self.members.iter_mut().filter(|member| !member.ended);
            open.for_each(|member| (member.ended, member.finite) = (true, false));
        }
        let added = (&self.products[known..], &self.directions[known..]);
        for (member, solve) in self.members.iter_mut().zip(solves).filter(|(member, _)| !member.ended) {
            member.minimise(added, ranks);
            member.judge(0.5 * solve.target, added.0.is_empty(), options);
        }
    }

    /// Orthonormalizes a product, and combines the directions in the same way. Drops it if it is in
    /// the span of the others; `false` if it is not finite.
    fn add(&mut self, mut z: Vec<f64>, mut w: Vec<f64>, ranks: &dyn Ranks) -> bool {
        let size = norm_on(&w, ranks);
        for _ in 0..2 {
            let mut components = dots(&w, &self.products);
            ranks.sum(&mut components);
            subtract(&mut w, &components, &self.products);
            subtract(&mut z, &components, &self.directions);
        }
        let left = norm_on(&w, ranks);
        if left > NEW * size {
            w.iter_mut().for_each(|w| *w /= left);
            z.iter_mut().for_each(|z| *z /= left);
            self.products.push(w);
            self.directions.push(z);
        }
        left.is_finite()
    }

    /// What each right-hand side has found.
    pub(super) fn end(self) -> Vec<Found> {
        let found = |Member { x, taken, given_up, finite, .. }: Member| Found { x, taken, given_up, finite };
        self.members.into_iter().map(found).collect()
    }
}

impl Member {
    /// Minimizes the residual over new directions, whose products are orthonormal and orthogonal to
    /// earlier ones.
    fn minimise(&mut self, (products, directions): (&[Vec<f64>], &[Vec<f64>]), ranks: &dyn Ranks) {
        let mut components = dots(&self.residual, products);
        ranks.sum(&mut components);
        subtract(&mut self.residual, &components, products);
        components.iter_mut().for_each(|component| *component = -*component);
        subtract(&mut self.x, &components, directions);
        self.norm = norm_on(&self.residual, ranks);
        self.taken += 1;
    }

    fn judge(&mut self, wanted: f64, exhausted: bool, options: &SolveOptions) {
        self.finite = self.norm.is_finite();
        if !self.finite || self.norm <= wanted || exhausted || self.taken == self.steps {
            self.ended = true;
            return;
        }
        let course = [self.beta, self.norm, wanted];
        if options.alternative.is_some_and(|other| other.beats(self.taken, course)) {
            (self.ended, self.given_up) = (true, true);
        }
    }
}
