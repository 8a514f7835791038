//! Matrices in parts, with vectors divided among ranks, against the same matrix on one.

use crate::common::{Brick, Random, difference};
use slipstick_linalg::{
    Alone, CsrMatrix, CsrPattern, Factorization, Layout, MultifrontalFactorization, Operator, Precision, Ranks,
    SolveError, Summed, best_in_spans, own_range, solve_verified,
};
use slipstick_ranks::threads::on_ranks;
use std::sync::Arc;

const BRICK: Brick = Brick { nodes: [6, 5, 4], multipliers: true, contrast: 2.0, nonsymmetry: 0.2, fixed_bottom: true };

/// Owners of the brick's nodes: of four ranks the third has none.
fn owners() -> Vec<u32> {
    (0..120).map(|node| [0, 1, 3][node * 3 / 120]).collect()
}

#[test]
fn ranges_make_up_the_whole() {
    for (count, size) in [(0, 3), (2, 3), (10, 4), (11, 1)] {
        let ranges = on_ranks(size, |rank| own_range(count, &rank));
        assert!(ranges.into_iter().flatten().eq(0..count));
    }
    assert_eq!((Alone.rank(), Alone.size(), own_range(11, &Alone)), (0, 1, 0..11));
}

/// The rows of a rank, and of each other row the entries in its columns where `i + j` is even: what
/// ranks add to each other's.
fn part(a: &CsrMatrix, rank: usize) -> CsrMatrix {
    let owners = owners();
    let owner = |i: usize| owners[a.pattern.groups()[i] as usize] as usize;
    let (mut row_offsets, mut all_columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for i in 0..a.n() {
        let (columns, entries) = a.row(i);
        for (&j, &v) in columns.iter().zip(entries) {
            let assembles = if (i + j as usize).is_multiple_of(2) { owner(j as usize) } else { owner(i) };
            if assembles == rank {
                all_columns.push(j);
                values.push(v);
            }
        }
        row_offsets.push(values.len());
    }
    let (groups, origins) = (a.pattern.groups().to_vec(), a.pattern.origins().to_vec());
    let pattern = CsrPattern::new(row_offsets, all_columns, groups, origins).unwrap();
    CsrMatrix { pattern: Arc::new(pattern), values }
}

/// Factors of a nearby matrix on one rank, behind the interface of divided vectors.
struct Joined<'a> {
    factors: &'a MultifrontalFactorization,
    layout: &'a Layout,
    ranks: &'a dyn Ranks,
}

impl Joined<'_> {
    fn apply(&self, rhs: &mut [f64], solve: impl FnOnce(&mut [f64])) {
        let mut whole = self.layout.join(rhs, self.ranks);
        solve(&mut whole);
        rhs.copy_from_slice(&self.layout.restrict(&whole));
    }
}

impl Factorization for Joined<'_> {
    fn solve(&self, rhs: &mut [f64]) {
        self.apply(rhs, |whole| self.factors.solve(whole));
    }
    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.apply(rhs, |whole| self.factors.solve_transpose(whole));
    }
    fn n(&self) -> usize {
        self.layout.own()
    }
    fn bytes(&self) -> usize {
        self.factors.bytes()
    }
    fn precision(&self) -> Precision {
        Precision::F64
    }
}

#[test]
fn parts_make_the_matrix() {
    let a = BRICK.reduced(3).0;
    let x = Random(5).vector(a.n());
    let [mut forward, mut transposed, mut sizes] = [const { Vec::new() }; 3].map(|_: Vec<f64>| vec![0.0; a.n()]);
    a.mul(&x, &mut forward);
    a.mul_transpose(&x, &mut transposed);
    a.absolute_product(false, &x, &mut sizes);
    let all = on_ranks(4, |ranks| {
        let mine = part(&a, ranks.rank());
        let layout = Layout::new(&mine.pattern, &owners(), &ranks);
        let summed = Summed { part: &mine, layout: &layout, ranks: &ranks };
        let own = layout.restrict(&x);
        let mut y = vec![0.0; own.len()];
        let mut product = |multiply: &dyn Fn(&[f64], &mut [f64])| {
            multiply(&own, &mut y);
            layout.join(&y, &ranks)
        };
        let products = [
            product(&|x, y| summed.mul(x, y)),
            product(&|x, y| summed.mul_transpose(x, y)),
            product(&|x, y| summed.absolute_product(false, x, y)),
        ];
        let weights = [false, true].map(|transpose| layout.join(&summed.row_weights(transpose), &ranks));
        let norms = [false, true].map(|transpose| summed.infinity_norm(transpose));
        let here = (layout.own(), (0..layout.own()).all(|entry| layout.entry(layout.unknown(entry)) == Some(entry)));
        (products, weights, norms, here)
    });
    for (products, weights, norms, (_, inverse)) in &all {
        for (found, expected) in products.iter().zip([&forward, &transposed, &sizes]) {
            assert!(difference(found, expected) < 1e-14);
        }
        // no entry has terms of two ranks here, so that sums of sizes are those of the matrix
        for (transpose, (norm, weights)) in [false, true].into_iter().zip(norms.iter().zip(weights)) {
            assert!((norm / a.infinity_norm(transpose) - 1.0).abs() < 1e-14);
            // sizes of rows are sums of the parts' largest entries, at most four times the largest
            // of all
            let ratio = weights.iter().zip(a.row_weights(transpose)).map(|(here, alone)| here / alone);
            assert!(ratio.clone().all(|ratio| (1.0 / 16.0..=16.0).contains(&ratio)), "{:?}", ratio.collect::<Vec<_>>());
        }
        assert!(inverse);
    }
    let own: Vec<usize> = all.iter().map(|rank| rank.3.0).collect();
    assert_eq!((own.iter().sum::<usize>(), own[2]), (a.n(), 0));
}

/// GMRES with the factors of a nearby matrix, on ranks of which one has nothing, from a start in
/// the span of two vectors.
#[test]
fn divided_systems_are_solved() {
    let a = BRICK.reduced(3).0;
    let mut nearby = a.clone();
    nearby.values.iter_mut().enumerate().for_each(|(k, v)| *v *= 1.0 + 0.02 * (k as f64).sin());
    let factors = MultifrontalFactorization::of(&nearby, Precision::F64).unwrap();
    let (b, other) = (Random(8).vector(a.n()), Random(9).vector(a.n()));
    for transpose in [false, true] {
        let mut expected = vec![0.0; a.n()];
        let alone = solve_verified(&a, &factors, transpose, &b, &mut expected, 1e-12).unwrap();
        let all = on_ranks(4, |ranks| {
            let mine = part(&a, ranks.rank());
            let layout = Layout::new(&mine.pattern, &owners(), &ranks);
            let summed = Summed { part: &mine, layout: &layout, ranks: &ranks };
            let joined = Joined { factors: &factors, layout: &layout, ranks: &ranks };
            let mut x = vec![0.0; layout.own()];
            let report = solve_verified(&summed, &joined, transpose, &layout.restrict(&b), &mut x, 1e-12).unwrap();
            let solution = layout.join(&x, &ranks);
            let (b, other) = (layout.restrict(&b), layout.restrict(&other));
            let mut image = vec![0.0; x.len()];
            summed.mul(&x, &mut image);
            let start = best_in_spans(&summed, &[image], vec![vec![other, x.clone()]]).remove(0);
            let mut bad = b.clone();
            if ranks.rank() == 3 {
                bad[0] = f64::NAN;
            }
            let refused = solve_verified(&summed, &joined, transpose, &bad, &mut x, 1e-12);
            (report, solution, layout.join(&start, &ranks), refused)
        });
        for (report, solution, start, refused) in &all {
            assert_eq!(report.iterations, alone.iterations);
            assert!(difference(solution, &expected) < 1e-9);
            assert!(*solution == all[0].1, "the same bits on all ranks");
            assert!(difference(start, &expected) < 1e-9);
            assert!(matches!(refused, Err(SolveError::NonFiniteRightHandSide { .. })), "{refused:?}");
        }
    }
    assert_eq!(Layout::whole(3).restrict(&Layout::whole(3).join(&[1.0, 2.0, 3.0], &Alone)), [1.0, 2.0, 3.0]);
}

/// Nothing that another rank owns is borrowed unless an entry touches it.
#[test]
fn only_what_is_touched_is_borrowed() {
    let a = BRICK.reduced(3).0;
    let far = on_ranks(4, |ranks| {
        let mine = part(&a, ranks.rank());
        let layout = Layout::new(&mine.pattern, &owners(), &ranks);
        let local = layout.spread(&vec![1.0; layout.own()], &ranks);
        let touched: Vec<bool> =
            (0..a.n()).map(|i| !mine.row(i).0.is_empty() || mine.pattern.columns().contains(&(i as u32))).collect();
        (0..a.n()).all(|i| local[i] == f64::from(u8::from(touched[i] || layout.entry(i).is_some())))
    });
    assert_eq!(far, [true; 4]);
}
