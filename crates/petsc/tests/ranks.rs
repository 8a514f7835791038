//! Messages between ranks, and solves of matrices that are in parts. The test starts itself by
//! `mpirun` on one to four ranks; without `mpirun` it says that it is skipped.

#[path = "../../linalg/tests/common/mod.rs"]
mod common;
mod mpirun;

use common::{Brick, Random, difference, relative_residual};
use slipstick_linalg::{
    Backend, CsrMatrix, CsrPattern, Factorization, MultifrontalFactorization, Precision, Ranks, Summed, Symbolic,
    solve_verified,
};
use slipstick_petsc::{ContactZone, PetscBackend, Session};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

const BRICK: Brick = Brick { nodes: [7, 6, 5], multipliers: true, contrast: 3.0, nonsymmetry: 0.2, fixed_bottom: true };

fn main() -> ExitCode {
    mpirun::on_ranks(&[1, 2, 3, 4], rank)
}

fn rank() {
    let session = Session::start().expect("PETSc starts");
    assert!(Session::start().is_err(), "a second session");
    sums_are_exact_and_the_same(&session);
    messages_arrive(&session);
    matrices_in_parts_are_solved(&session, None, &Brick { nodes: [5, 6, 5], ..BRICK });
    matrices_in_parts_are_solved(&session, Some(zone()), &Brick { contrast: 2.0, ..BRICK });
    bad_matrices_are_refused_everywhere(&session);
    assert!(session.meet(Duration::from_secs(30)));
}

/// Sums of small integers are exact in any order; those of other numbers must have the same bits
/// everywhere.
fn sums_are_exact_and_the_same(session: &Session) {
    let (rank, size) = (session.rank(), session.size());
    for length in [0, 1, 7, 4095, 4096, 100_003] {
        let mut whole: Vec<f64> = (0..length).map(|i| ((i % 100) * (rank + 1)) as f64).collect();
        session.sum(&mut whole);
        let ranks = size * (size + 1) / 2;
        assert!(whole.iter().enumerate().all(|(i, &v)| v == ((i % 100) * ranks) as f64), "{length}");
        let mut rough = Random(rank as u64 + 5).vector(length);
        session.sum(&mut rough);
        assert_same(session, &rough);
    }
    assert!(session.any(rank + 1 == size) && !session.any(false));
}

fn assert_same(session: &Session, values: &[f64]) {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_bits().to_le_bytes()).collect();
    let all = session.gather(&bytes);
    assert!(all.iter().all(|other| *other == bytes), "ranks disagree");
}

fn messages_arrive(session: &Session) {
    let rank = session.rank();
    let sent = session.traffic();
    // every rank gets the first one's numbers, whatever its own are
    let own: Vec<f64> = (0..5000 * usize::from(rank == 0) + rank).map(|i| (i as f64).sqrt()).collect();
    let first: Vec<f64> = (0..5000).map(|i| f64::from(i).sqrt()).collect();
    assert!(session.of_first(&own) == first);
    let bytes = session.traffic().bytes - sent.bytes;
    let handed_on = if rank == 0 { 8 * first.len() as u64 } else { 0 };
    assert!(session.size() == 1 || bytes >= handed_on * (session.size() as u64 - 1), "{bytes} bytes are counted");
    // rank r hands r + 1 copies of its number to the next ones, and nothing to others
    let (size, next) = (session.size(), (rank + 1) % session.size());
    let (mut to, mut from) = (vec![0; size], vec![0; size]);
    (to[next], from[(rank + size - 1) % size]) = (rank + 1, (rank + size - 1) % size + 1);
    let before = ((rank + size - 1) % size) as f64;
    assert_eq!(session.exchange(&vec![rank as f64; rank + 1], &to, &from), vec![before; before as usize + 1]);
    let joined = session.join(&vec![rank as f64; rank]);
    assert!(joined.iter().copied().eq((0..size).flat_map(|r| vec![r as f64; r])));
    assert_eq!(session.largest(-(rank as f64)), 0.0);
    assert!(session.largest(if rank == 0 { f64::NAN } else { 1.0 }).is_nan());
    let all = session.gather(&vec![rank as u8; 3 * (rank % 2)]);
    assert_eq!(all.len(), session.size());
    assert!(all.iter().enumerate().all(|(r, m)| *m == vec![r as u8; 3 * (r % 2)]));
}

/// The part of a rank: some entries are one rank's, others all ranks' in equal shares.
fn part(a: &CsrMatrix, session: &Session) -> CsrMatrix {
    let (rank, size) = (session.rank(), session.size());
    let (mut row_offsets, mut all_columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for i in 0..a.n() {
        let (columns, entries) = a.row(i);
        for (&j, &v) in columns.iter().zip(entries) {
            let shared = (7 * i + j as usize).is_multiple_of(5);
            if shared || (i / 40 + j as usize / 50) % size == rank {
                all_columns.push(j);
                values.push(if shared { v / size as f64 } else { v });
            }
        }
        row_offsets.push(values.len());
    }
    let (groups, origins) = (a.pattern.groups().to_vec(), a.pattern.origins().to_vec());
    let pattern = CsrPattern::new(row_offsets, all_columns, groups, origins).expect("a part of a pattern");
    CsrMatrix { pattern: Arc::new(pattern), values }
}

/// The contact zone of the brick's top.
fn zone() -> ContactZone {
    let [nx, ny, nz] = BRICK.nodes;
    let count = nx * ny * nz;
    let place = |node: usize| [node % nx, node / nx % ny, node / (nx * ny)].map(|c| c as f64);
    let slaves: Vec<u32> = (count - nx * ny..count).map(|node| node as u32).collect();
    ContactZone::new((0..count).map(place).collect::<Vec<_>>(), slaves)
}

/// Against the multifrontal solver on the whole matrix: new values on the pattern of before,
/// factors that outlive the next ones, another pattern.
fn matrices_in_parts_are_solved(session: &Session, zone: Option<ContactZone>, other: &Brick) {
    let owners: Vec<u32> = (0..300).map(|node: u32| node / 60).collect();
    let (direct, backend) = (zone.is_none(), PetscBackend::new(session.clone(), owners));
    let backend = zone.into_iter().fold(backend, PetscBackend::with_contact_zone);
    let whole = BRICK.reduced(3).0;
    let mut changed = whole.clone();
    changed.values.iter_mut().enumerate().for_each(|(k, v)| *v *= 1.0 + 0.05 * (k as f64).sin());
    let mut solver = backend.solver();
    let mut known: Option<Symbolic> = None;
    let mut factorize = |part: &CsrMatrix| {
        let symbolic = solver.analyse_after(&part.pattern, known.as_slice()).expect("an analysis");
        solver.factorize(known.insert(symbolic), part).expect("factors")
    };
    let first_part = part(&whole, session);
    let mut second_part = part(&changed, session);
    second_part.pattern = first_part.pattern.clone();
    let other = other.reduced(4).0;
    let other_part = part(&other, session);
    let first = factorize(&first_part);
    for (a, mine) in [(&changed, &second_part), (&other, &other_part), (&whole, &first_part)] {
        let factors = factorize(mine);
        assert_eq!(factors.cost().is_some(), direct);
        assert!(factors.cost().is_none_or(|cost| cost.factorization > 0.0 && cost.substitution > 0.0));
        check(session, &backend, a, mine, factors.as_ref());
    }
    check(session, &backend, &whole, &first_part, first.as_ref());
}

fn check(session: &Session, backend: &PetscBackend, a: &CsrMatrix, mine: &CsrMatrix, factors: &dyn Factorization) {
    let b = Random(8).vector(a.n());
    let exact = MultifrontalFactorization::of(a, Precision::F64).expect("factors");
    for transpose in [false, true] {
        let layout = backend.layout(&mine.pattern);
        let (mut x, mut y) = (vec![0.0; layout.own()], vec![0.0; a.n()]);
        let summed = Summed { part: mine, layout: &layout, ranks: session };
        let report =
            solve_verified(&summed, factors, transpose, &layout.restrict(&b), &mut x, 1e-11).expect("a solution");
        assert!(report.iterations <= 3, "{report:?}");
        let x = layout.join(&x, session);
        solve_verified(a, &exact, transpose, &b, &mut y, 1e-12).expect("a solution");
        assert!(relative_residual(a, transpose, &x, &b) < 1e-10);
        assert!(difference(&x, &y) < 1e-8, "{}", difference(&x, &y));
        assert_same(session, &x);
    }
}

/// A NaN entry on one rank, and a singular matrix, give the same error on all ranks.
fn bad_matrices_are_refused_everywhere(session: &Session) {
    let whole = BRICK.reduced(3).0;
    let backend = PetscBackend::new(session.clone(), vec![0, 1]);
    let mut solver = backend.solver();
    let mut mine = part(&whole, session);
    if session.rank() + 1 == session.size() {
        mine.values[11] = f64::NAN;
    }
    let error = solver.analyse_and_factorize(&mine).err().expect("NaN is refused").to_string();
    assert!(error.contains("is not finite"), "{error}");
    let loose = Brick { fixed_bottom: false, multipliers: false, nonsymmetry: 0.0, ..BRICK }.reduced(3).0;
    let error =
        solver.analyse_and_factorize(&part(&loose, session)).err().expect("a loose body is refused").to_string();
    assert!(error.contains("singular"), "{error}");
    let all = session.gather(error.as_bytes());
    assert!(all.iter().all(|other| other == error.as_bytes()));
}
