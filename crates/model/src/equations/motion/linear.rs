//! Linear equations among displacements, Σ a_i d_i = 0.
//!
//! Each equation makes one of its unknowns depend on the others: d_d = Σ c_i d_i. Gaussian elimination
//! chooses it and expresses all of them by unknowns that depend on no others, so that d = T d_independent with
//! a constant T. As for rigid bodies, the entries of dependent unknowns in y follow from the
//! others, the equations of those are Tᵀ R, and the tangent is Tᵀ K T.
//!
//! R at a dependent unknown remains in the residual: −R/c is the force of the equation there.

mod carry_over;

use crate::equations::LoadTime;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Σ a_i d_i = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearEquation {
    /// Displacement unknowns i with their factors a_i.
    pub terms: Vec<(u32, f64)>,
    /// A number by which errors name it.
    pub number: usize,
}

/// An equation that prescribed displacements violate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// [`LinearEquation::number`].
    pub number: usize,
    /// Pseudo-time at which it is violated.
    pub time: LoadTime,
    /// Its value there, relative to the sum of the magnitudes of its terms.
    pub violation: f64,
}

/// Coefficients below this fraction of the largest are round-off.
const ZERO: f64 = 1e-12;

/// Prescribed displacements fulfil an equation up to this fraction of their terms.
const FULFILLED: f64 = 1e-9;

/// A coefficient replaces another as the largest only if it is larger by this factor, so that round-off does
/// not decide between equals.
const LARGER: f64 = 1.001;

/// All equations of a model.
#[derive(Debug, Clone, Default)]
pub struct LinearEquations {
    /// Dependent unknowns, ascending, each with the unknowns on which it depends.
    rows: Vec<(u32, Vec<(u32, f64)>)>,
    /// Position in `rows` of each unknown; empty without equations.
    of: Vec<u32>,
}

const NONE: u32 = u32::MAX;

/// Σ a_i d_i of all terms with the same unknown.
type Row = BTreeMap<u32, f64>;

impl LinearEquations {
    /// Eliminates one unknown of each equation. `fixed` are the prescribed unknowns; `prescribed(i, t)` is the
    /// value of one at pseudo-time t, and `times` are the ends of all steps. Unknowns that `are_cheap`, those
    /// of nodes without elements, are eliminated first. An equation that follows from others is left out.
    ///
    /// # Errors
    /// [`Contradiction`] if all unknowns of an equation are prescribed, and do not fulfil it.
    pub fn new(
        equations: &[LinearEquation],
        fixed: &[bool],
        prescribed: impl Fn(LoadTime) -> Vec<f64>,
        times: &[LoadTime],
        are_cheap: impl Fn(u32) -> bool,
    ) -> Result<Self, Contradiction> {
        let mut uses: HashMap<u32, usize> = HashMap::new();
        equations.iter().flat_map(|equation| &equation.terms).for_each(|(i, _)| *uses.entry(*i).or_default() += 1);
        let mut solved: BTreeMap<u32, Row> = BTreeMap::new();
        // the dependent unknowns in whose rows an unknown is
        let mut users: HashMap<u32, BTreeSet<u32>> = HashMap::new();
        let mut closed: Vec<(usize, Row)> = Vec::new();
        for equation in equations {
            let mut row = Row::new();
            for &(i, a) in &equation.terms {
                match solved.get(&i) {
                    Some(known) => add(&mut row, a, known),
                    None => *row.entry(i).or_default() += a,
                }
            }
            let size = equation.terms.iter().map(|(_, a)| a.abs()).fold(0.0, f64::max);
            row.retain(|_, a| a.abs() > ZERO * size);
            let mut pivot: Option<(u32, (bool, f64))> = None;
            for (&i, &a) in row.iter().filter(|(i, _)| !fixed[**i as usize]) {
                let rank = (are_cheap(i) && uses[&i] == 1, a.abs());
                let better =
                    pivot.is_none_or(|(_, best)| (rank.0 && !best.0) || (rank.0 == best.0 && rank.1 > LARGER * best.1));
                pivot = if better { Some((i, rank)) } else { pivot };
            }
            let Some((pivot, _)) = pivot else {
                closed.push((equation.number, row));
                continue;
            };
            let a = row.remove(&pivot).expect("chosen from the row");
            row.values_mut().for_each(|value| *value /= -a);
            for user in users.remove(&pivot).unwrap_or_default() {
                let other = solved.get_mut(&user).expect("a user");
                let factor = other.remove(&pivot).expect("used");
                add(other, factor, &row);
                row.keys().for_each(|i| _ = users.entry(*i).or_default().insert(user));
            }
            row.keys().for_each(|i| _ = users.entry(*i).or_default().insert(pivot));
            solved.insert(pivot, row);
        }
        for &time in times.iter().filter(|_| !closed.is_empty()) {
            let values = prescribed(time);
            for (number, row) in &closed {
                let terms = || row.iter().map(|(&i, a)| a * values[i as usize]);
                let (sum, size) = (terms().sum::<f64>(), terms().map(f64::abs).sum::<f64>());
                if sum.abs() > FULFILLED * size {
                    return Err(Contradiction { number: *number, time, violation: sum.abs() / size });
                }
            }
        }
        let mut of = vec![NONE; if solved.is_empty() { 0 } else { fixed.len() }];
        solved.keys().zip(0..).for_each(|(i, at)| of[*i as usize] = at);
        let rows = solved.into_iter().map(|(i, row)| (i, row.into_iter().collect())).collect();
        Ok(Self { rows, of })
    }

    /// Whether there are no equations.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Whether an unknown depends on others.
    #[inline]
    pub fn is_dependent(&self, unknown: usize) -> bool {
        self.of.get(unknown).is_some_and(|&at| at != NONE)
    }

    /// The dependent unknowns, each with those on which it depends.
    pub fn rows(&self) -> &[(u32, Vec<(u32, f64)>)] {
        &self.rows
    }

    fn row(&self, unknown: usize) -> Option<&[(u32, f64)]> {
        let at = self.of.get(unknown).filter(|&&at| at != NONE)?;
        Some(&self.rows[*at as usize].1)
    }

    /// The nodes on whose unknowns those of a node depend.
    fn sources(&self, node: usize) -> Vec<u32> {
        let terms = (3 * node..3 * node + 3).filter_map(|i| self.row(i)).flatten();
        let mut nodes: Vec<u32> = terms.map(|(i, _)| i / 3).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Adds to a list of nodes those on which they depend.
    pub fn add_sources(&self, nodes: &mut Vec<u32>) {
        if self.is_empty() {
            return;
        }
        let sources: Vec<u32> = nodes.iter().flat_map(|&node| self.sources(node as usize)).collect();
        nodes.extend(sources);
        nodes.sort_unstable();
        nodes.dedup();
    }

    /// Couplings in the sparsity pattern, in addition to those of the nodes. A node that nothing but an
    /// equation couples with others adds none.
    pub fn couple(&self, rows: &mut [Vec<u32>]) {
        let mut nodes: Vec<u32> = self.rows.iter().map(|(i, _)| i / 3).collect();
        nodes.dedup();
        let alone = |node: u32, rows: &[Vec<u32>]| rows[node as usize].iter().all(|&other| other == node);
        nodes.retain(|&node| !(alone(node, rows) && rows[node as usize].len() < 2));
        let sources: Vec<Vec<u32>> = nodes.iter().map(|&node| self.sources(node as usize)).collect();
        let own = |rows: &[Vec<u32>]| -> Vec<Vec<u32>> {
            let of = |&node: &u32| {
                let mut row = rows[node as usize].clone();
                row.sort_unstable();
                row.dedup();
                row
            };
            nodes.iter().map(of).collect()
        };
        for (own, sources) in own(rows).iter().zip(&sources) {
            own.iter().for_each(|&row| rows[row as usize].extend(sources));
        }
        for (own, sources) in own(rows).iter().zip(&sources) {
            sources.iter().for_each(|&source| rows[source as usize].extend(own));
        }
    }

    /// For every coordinate, whether it is prescribed: a dependent one is if all that it depends on are.
    pub fn truly_fixed(&self, fixed: &[bool]) -> Vec<bool> {
        let mut out = fixed.to_vec();
        for (i, terms) in &self.rows {
            out[*i as usize] = terms.iter().all(|(i, _)| fixed[*i as usize]);
        }
        out
    }

    /// Writes the dependent displacements.
    pub fn place(&self, y: &mut [f64]) {
        for (i, terms) in &self.rows {
            y[*i as usize] = terms.iter().map(|(i, c)| c * y[*i as usize]).sum();
        }
    }

    /// Adds T v to the entries of dependent unknowns.
    pub fn spread(&self, v: &mut [f64]) {
        for (i, terms) in &self.rows {
            v[*i as usize] += terms.iter().map(|(i, c)| c * v[*i as usize]).sum::<f64>();
        }
    }

    /// Adds Tᵀ v to the entries of the unknowns on which others depend.
    pub fn gather(&self, v: &mut [f64]) {
        for (i, terms) in &self.rows {
            let value = v[*i as usize];
            terms.iter().filter(|_| value != 0.0).for_each(|(i, c)| v[*i as usize] += c * value);
        }
    }

    /// Tᵀ v, which replaces derivatives with respect to dependent unknowns.
    pub fn pull_back(&self, v: &mut [f64]) {
        self.gather(v);
        self.rows.iter().for_each(|(i, _)| v[*i as usize] = 0.0);
    }
}

/// Adds a multiple of another row.
fn add(row: &mut Row, factor: f64, other: &Row) {
    other.iter().for_each(|(i, a)| *row.entry(*i).or_default() += factor * a);
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_linalg::{BlockMatrix, BlockPattern};
    use std::sync::Arc;

    fn equation(number: usize, terms: &[(u32, f64)]) -> LinearEquation {
        LinearEquation { terms: terms.to_vec(), number }
    }

    fn eliminated(
        equations: &[LinearEquation],
        fixed: &[u32],
        values: &[f64],
    ) -> Result<LinearEquations, Contradiction> {
        let fixed: Vec<bool> = (0..values.len() as u32).map(|i| fixed.contains(&i)).collect();
        let at = |time: LoadTime| values.iter().map(|value| time.t * value).collect();
        LinearEquations::new(equations, &fixed, at, &[0.5.into(), 1.0.into()], |_| false)
    }

    /// A chain of equations in any order gives displacements that fulfil all of them; one that follows from
    /// the others adds nothing.
    #[test]
    fn a_chain_is_resolved() {
        let chain = [
            equation(0, &[(0, 1.0), (3, -2.0)]),
            equation(1, &[(3, 1.0), (7, 0.5), (8, -1.0)]),
            equation(2, &[(7, 1.0), (4, 1.0)]),
            equation(3, &[(0, 1.0), (7, 1.0), (8, -2.0)]),
        ];
        let linear = eliminated(&chain, &[8], &[0.0; 9]).unwrap();
        assert_eq!(linear.rows().len(), 3);
        let mut y: Vec<f64> = (0..9).map(|i| 1.0 + 0.3 * f64::from(i)).collect();
        linear.place(&mut y);
        for equation in &chain {
            let sum: f64 = equation.terms.iter().map(|(i, a)| a * y[*i as usize]).sum();
            assert!(sum.abs() < 1e-14, "{equation:?}: {sum}");
        }
        // all independent unknowns are as before
        assert!((0..9).filter(|&i| !linear.is_dependent(i)).all(|i| y[i] == 1.0 + 0.3 * i as f64));
    }

    #[test]
    fn prescribed_displacements_may_contradict() {
        let equal = [equation(5, &[(0, 1.0), (1, -1.0)])];
        assert!(eliminated(&equal, &[0, 1], &[2.0, 2.0, 0.0]).unwrap().is_empty());
        let error = eliminated(&equal, &[0, 1], &[2.0, 1.0, 0.0]).unwrap_err();
        assert_eq!(error, Contradiction { number: 5, time: 0.5.into(), violation: 1.0 / 3.0 });
    }

    /// Tᵀ K T by hand: the product with any vector, and the rows of dependent unknowns.
    #[test]
    fn the_tangent_is_carried_over() {
        let each = [equation(0, &[(1, 2.0), (5, 1.0), (6, -1.0)]), equation(1, &[(8, 1.0), (0, 0.5)])];
        // all components of a node alike
        let alike = [0, 1, 2].map(|c| equation(c as usize, &[(6 + c, 1.0), (c, 0.25), (3 + c, -0.75)]));
        is_carried_over(&each);
        is_carried_over(&alike);
        is_carried_over(&[&alike[..2], &[equation(2, &[(8, 1.0), (2, 0.3)])]].concat());
    }

    fn is_carried_over(equations: &[LinearEquation]) {
        let linear = eliminated(equations, &[5], &[0.0; 9]).unwrap();
        let mut rows = vec![vec![0, 1], vec![0, 1, 2], vec![1, 2]];
        linear.couple(&mut rows);
        let mut matrix = BlockMatrix::new(Arc::new(BlockPattern::from_rows(&rows)));
        let value = |row: usize, column: usize| ((row * 31 + column * 17) as f64).sin();
        for (row, columns) in [vec![0, 1], vec![0, 1, 2], vec![1, 2]].iter().enumerate() {
            for &column in columns {
                matrix.add(row, column, &std::array::from_fn(|at| value(3 * row + at / 3, 3 * column + at % 3)));
            }
        }
        let v: Vec<f64> = (0..9).map(|i| (1.7 * f64::from(i)).cos()).collect();
        // K T v, then Tᵀ
        let mut spread = v.clone();
        linear.place(&mut spread);
        let mut expected = vec![0.0; 9];
        matrix.mul(&spread, &mut expected);
        linear.gather(&mut expected);
        linear.carry_over(&mut matrix);
        let mut product = vec![0.0; 9];
        matrix.mul(&v, &mut product);
        for (product, expected) in product.iter().zip(&expected) {
            assert!((product - expected).abs() < 1e-13, "{product} {expected}");
        }
        let mut gathered = v.clone();
        linear.pull_back(&mut gathered);
        let mut along = v.clone();
        (0..9).filter(|&i| linear.is_dependent(i)).for_each(|i| along[i] = 0.0);
        linear.spread(&mut along);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((dot(&v, &along) - dot(&gathered, &along)).abs() < 1e-13);
    }
}
