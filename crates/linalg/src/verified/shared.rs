//! Iterations of several right-hand sides in one space of directions.

use super::report::SolveOptions;
use super::solve::{Found, Solve};
use crate::basis::{Added, Basis};
use crate::csr::norm_on;
use slipstick_ranks::Ranks;

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
    directions: Vec<Vec<f64>>,
    /// Their products.
    basis: Basis,
    members: Vec<Member>,
}

/// The iteration of one right-hand side.
struct Member {
    /// The solution at the start.
    x: Vec<f64>,
    /// What has been taken from the residual: its components along the first of the products.
    components: Vec<f64>,
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
                components: Vec::new(),
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
        let members = solves.iter().map(member).collect();
        Self { directions: Vec::new(), basis: Basis::default(), members }
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
        let known = self.basis.len();
        let mut usable = true;
        for (z, w) in found {
            match self.basis.add(w, ranks) {
                Added::Yes => self.directions.push(z),
                Added::Dependent => {}
                Added::NotFinite => usable = false,
            }
        }
        if !usable {
            // the factors or the matrix, which all share, are unusable
            let open = self.members.iter_mut().filter(|member| !member.ended);
            open.for_each(|member| (member.ended, member.finite) = (true, false));
        }
        let exhausted = self.basis.len() == known;
        for (member, solve) in self.members.iter_mut().zip(solves).filter(|(member, _)| !member.ended) {
            member.minimise(&self.basis, known, ranks);
            member.judge(0.5 * solve.target, exhausted, options);
        }
    }

    /// What each right-hand side has found.
    pub(super) fn end(self) -> Vec<Found> {
        let Self { directions, basis, members } = self;
        let found = |member: Member| {
            let Member { mut x, components, taken, given_up, finite, .. } = member;
            basis.combine(components, &directions, &mut x);
            Found { x, taken, given_up, finite }
        };
        members.into_iter().map(found).collect()
    }
}

impl Member {
    /// Minimizes the residual over the directions from number `known` on.
    fn minimise(&mut self, basis: &Basis, known: usize, ranks: &dyn Ranks) {
        self.components.extend(basis.reduce(known, &mut self.residual, ranks));
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
