//! The choice between direct factors and iterations, by predicted cost.

use super::{BYTES_PER_UNKNOWN, Nodes, SOLVES_PER_DIGIT, SchwarzSolver};
use crate::csr::{CsrMatrix, CsrPattern};
use crate::multifrontal::{BYTES_PER_OPERATION, MultifrontalSolver};
use crate::operator::ENTRY_BYTES;
use crate::robust::{Link, RobustSolver, SolverChoice};
use crate::solver::{Backend, Factorization, FactorizationError, LinearSolver, Precision};
use crate::symbolic::Symbolic;
use std::sync::Arc;

/// Unknowns below which direct factors are used without a comparison.
const LEAST_UNKNOWNS: usize = 100_000;

/// How many times as much direct factors must cost before iterations replace them. On a half-ball on a
/// plate, a load step with its gradient takes 1.2 times as long with direct factors at 100 000
/// unknowns; at 300 000, a Newton iteration takes 2.6 times as long (docs/measurements/performance.md).
const CLEARLY: f64 = 1.5;

/// Digits of the solves that are compared: those of most of Newton's iterations.
const DIGITS: f64 = 4.0;

/// Solves to these digits with the direct factors, which are in single precision.
const DIRECT_SOLVES: f64 = 3.0;

/// Relative change of the number of unknowns up to which an earlier choice holds.
const SIMILAR: f64 = 0.05;

/// Makes solvers that choose between the direct solvers of [`SolverChoice::Auto`] and iterations with
/// a [`SchwarzSolver`], by the predicted cost of each.
///
/// Direct factors are the choice up to 100 000 unknowns, and beyond unless they cost more than 1.5
/// times as much. Both costs follow from the pattern alone: operations and entries of direct factors
/// from their symbolic analysis, those of the preconditioner in proportion to unknowns and entries,
/// with the iterations of a solve to four digits. If iterations fail, direct solvers take over. Tests:
/// `iterations_are_chosen_where_direct_factors_cost_far_more`, `the_chosen_solver_is_used`.
#[derive(Debug, Clone)]
pub struct Automatic(pub Nodes);

impl Backend for Automatic {
    fn solver(&self) -> Box<dyn LinearSolver> {
        Box::new(AutomaticSolver::new(self.0.clone(), LEAST_UNKNOWNS))
    }
}

/// What [`Automatic`] chooses for a pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Whether it chooses iterations.
    pub iterative: bool,
    /// Memory of the factors. \[bytes\]
    pub bytes: f64,
    /// Floating-point operations of direct factors, or those that take as long as the preconditioner.
    pub operations: f64,
    /// Entries of direct factors.
    pub direct_entries: f64,
    /// Floating-point operations of direct factors.
    pub direct_operations: f64,
}

impl Automatic {
    /// The choice for a pattern, from an analysis of direct factors.
    pub fn forecast(pattern: &CsrPattern) -> Forecast {
        let direct = MultifrontalSolver::predict(pattern);
        let (direct_entries, direct_operations) = direct.unwrap_or((0.0, 0.0));
        let iterative = pattern.n() >= LEAST_UNKNOWNS
            && direct.is_none_or(|(entries, operations)| is_far_cheaper(pattern, entries, operations));
        let (bytes, operations) = match iterative {
            true => SchwarzSolver::predict(pattern),
            false => (SINGLE * direct_entries, direct_operations),
        };
        Forecast { iterative, bytes, operations, direct_entries, direct_operations }
    }
}

/// Memory of a number in single precision, and the cost of an operation. \[bytes\]
const SINGLE: f64 = 4.0;
const SINGLE_OPERATION: f64 = 0.5 * BYTES_PER_OPERATION;

/// Whether the preconditioner and a solve with it cost far less than direct factors, with these
/// entries and operations, and a solve with them; in the unit of [`Cost`](crate::Cost).
fn is_far_cheaper(pattern: &CsrPattern, entries: f64, operations: f64) -> bool {
    let product = ENTRY_BYTES * pattern.entries() as f64;
    let direct = SINGLE_OPERATION * operations + DIRECT_SOLVES * (SINGLE * entries + product);
    let substitution = BYTES_PER_UNKNOWN * pattern.n() as f64 + product;
    let iterations = SOLVES_PER_DIGIT * DIGITS;
    let factors = SINGLE_OPERATION * SchwarzSolver::predict(pattern).1;
    direct > CLEARLY * (factors + iterations * (substitution + product))
}

/// Chooses for each pattern, and keeps the choice while the number of unknowns hardly changes.
struct AutomaticSolver {
    direct: RobustSolver,
    /// With direct solvers as a fallback.
    iterative: RobustSolver,
    least_unknowns: usize,
}

/// The choice for a pattern, and the analysis of the chosen solver.
struct Analysis {
    iterative: bool,
    symbolic: Symbolic,
}

impl AutomaticSolver {
    fn new(nodes: Nodes, least_unknowns: usize) -> Self {
        let mut chain = vec![Link::new(SchwarzSolver::new(nodes))];
        chain.extend(SolverChoice::Auto.chain());
        Self { direct: RobustSolver::new(SolverChoice::Auto), iterative: RobustSolver::of(chain), least_unknowns }
    }

    fn chosen(&self, iterative: bool) -> &RobustSolver {
        if iterative { &self.iterative } else { &self.direct }
    }
}

impl LinearSolver for AutomaticSolver {
    fn name(&self) -> &'static str {
        "automatic choice of a solver"
    }

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        let own = || earlier.iter().filter_map(|symbolic| Some((symbolic, symbolic.content::<Analysis>()?)));
        if let Some((known, _)) = own().find(|(symbolic, _)| symbolic.is_of(pattern)) {
            return Ok(known.clone());
        }
        let mut helpful: Vec<Symbolic> = own().map(|(_, analysis)| analysis.symbolic.clone()).collect();
        let n = pattern.n();
        let similar = |symbolic: &Symbolic| symbolic.pattern().n().abs_diff(n) as f64 <= SIMILAR * n as f64;
        let iterative = match own().next().filter(|(symbolic, _)| similar(symbolic)) {
            _ if n < self.least_unknowns => false,
            Some((_, analysis)) => analysis.iterative,
            None => {
                let direct = MultifrontalSolver::new(Precision::F32).analyse_after(pattern, &helpful).ok();
                let size = direct.as_ref().and_then(MultifrontalSolver::size);
                helpful.splice(0..0, direct);
                // direct factors can be too large even for an analysis
                size.is_none_or(|(entries, operations)| is_far_cheaper(pattern, entries, operations))
            }
        };
        let symbolic = self.chosen(iterative).analyse_after(pattern, &helpful)?;
        Ok(Symbolic::new(pattern, Analysis { iterative, symbolic }))
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let Analysis { iterative, symbolic } = symbolic.content_for(a)?;
        match iterative {
            true => self.iterative.factorize(symbolic, a),
            false => self.direct.factorize(symbolic, a),
        }
    }

    fn precision(&self) -> Precision {
        self.direct.precision()
    }

    fn insist_on_direct(&mut self) -> bool {
        self.iterative.insist_on_direct()
    }

    fn insist_on_double(&mut self) -> bool {
        let iterative = self.iterative.insist_on_double();
        self.direct.insist_on_double() || iterative
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The couplings of the nodes of a box: a node and its 26 neighbours, with three unknowns each.
    fn box_of([nx, ny, nz]: [usize; 3]) -> (Arc<CsrPattern>, Nodes) {
        let near = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
        let (mut offsets, mut columns, mut groups, mut coordinates) = (vec![0], Vec::new(), Vec::new(), Vec::new());
        for node in 0..nx * ny * nz {
            let [x, y, z] = [node % nx, node / nx % ny, node / (nx * ny)];
            coordinates.push([x as f64, y as f64, z as f64]);
            let mut row = Vec::new();
            for k in near(z, nz) {
                for j in near(y, ny) {
                    row.extend(near(x, nx).flat_map(|i| (0..3).map(move |c| (3 * ((k * ny + j) * nx + i) + c) as u32)));
                }
            }
            for _ in 0..3 {
                columns.extend(&row);
                offsets.push(columns.len());
                groups.push(node as u32);
            }
        }
        let origins = (0..groups.len() as u32).collect();
        let pattern = Arc::new(CsrPattern::new(offsets, columns, groups, origins).expect("columns ascend"));
        (pattern, Nodes { bodies: vec![Some(0); coordinates.len()].into(), coordinates: coordinates.into() })
    }

    /// Source: George's bound for nested dissection. Operations grow as n² for a cube and as n^(3/2)
    /// for a plate, so that direct factors stay cheap for a plate of as many unknowns.
    #[test]
    fn iterations_are_chosen_where_direct_factors_cost_far_more() {
        let forecast = |shape| Automatic::forecast(&box_of(shape).0);
        let (cube, plate) = (forecast([44, 44, 44]), forecast([206, 206, 2]));
        println!("{cube:?} {plate:?} {:?}", forecast([34, 34, 34]));
        assert!(cube.iterative && !plate.iterative && !forecast([20, 20, 20]).iterative);
        assert!(cube.bytes < SINGLE * cube.direct_entries && plate.bytes == SINGLE * plate.direct_entries);
    }

    /// A stiffness of 1 between neighbours and to the ground. The solver uses what was chosen, keeps
    /// the choice for a similar pattern, and turns to direct factors if the preconditioner cannot be
    /// made, or if it must.
    #[test]
    fn the_chosen_solver_is_used() {
        let (pattern, nodes) = box_of([6, 5, 4]);
        let value = |(i, j): (usize, u32)| {
            let neighbour = j as usize != i && j as usize % 3 == i % 3;
            if neighbour { -1.0 } else { f64::from(u8::from(j as usize == i)) * pattern.row(i).len() as f64 / 3.0 }
        };
        let places = (0..pattern.n()).flat_map(|i| pattern.row(i).iter().map(move |&j| (i, j)));
        let a = CsrMatrix { values: places.map(value).collect(), pattern: pattern.clone() };
        let is_iterative = |factors: &dyn Factorization| factors.cost().is_some_and(|cost| cost.solves_per_digit > 0.0);

        let mut solver = AutomaticSolver::new(nodes.clone(), LEAST_UNKNOWNS);
        let symbolic = solver.analyse(&pattern).expect("an analysis");
        assert!(!symbolic.content::<Analysis>().expect("a choice").iterative);
        assert!(!is_iterative(&*solver.factorize(&symbolic, &a).expect("factors")));

        let with = |solver: &AutomaticSolver| Analysis {
            iterative: true,
            symbolic: solver.iterative.analyse(&pattern).expect("an analysis"),
        };
        let mut solver = AutomaticSolver::new(nodes, 0);
        let earlier = Symbolic::new(&pattern, with(&solver));
        let similar = Arc::new(box_of([6, 5, 4]).0.as_ref().clone());
        let kept = solver.analyse_after(&similar, std::slice::from_ref(&earlier)).expect("an analysis");
        assert!(kept.content::<Analysis>().expect("a choice").iterative);
        let other = box_of([7, 5, 4]).0;
        let new = solver.analyse_after(&other, std::slice::from_ref(&earlier)).expect("an analysis");
        assert!(!new.content::<Analysis>().expect("a choice").iterative);
        assert!(is_iterative(&*solver.factorize(&earlier, &a).expect("a preconditioner")));
        assert!(solver.insist_on_direct() && !solver.insist_on_direct());
        assert!(!is_iterative(&*solver.factorize(&earlier, &a).expect("direct factors")));

        let nothing = Nodes { coordinates: Vec::new().into(), bodies: Vec::new().into() };
        let mut solver = AutomaticSolver::new(nothing, 0);
        let symbolic = Symbolic::new(&pattern, with(&solver));
        assert!(!is_iterative(&*solver.factorize(&symbolic, &a).expect("direct factors")));
    }
}
