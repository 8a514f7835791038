//! The laws at one point: analytic responses, a small-step reference, and derivatives.

use super::*;
use crate::dual::Dual;

const E: f64 = 700.0;
const NU: f64 = 0.32;

fn linear() -> J2Linear {
    J2Linear::from_values(&[E, NU, 30.0, 260.0].map(Value::from)).unwrap()
}

fn voce() -> J2Voce {
    J2Voce::from_values(&[E, NU, 30.0, 50.0, 12.0, 20.0].map(Value::from)).unwrap()
}

fn swift() -> J2Swift {
    J2Swift::from_values(&[E, NU, 30.0, 0.02, 0.25].map(Value::from)).unwrap()
}

fn table() -> J2Table {
    let rows: [&[f64]; 2] = [&[30.0, 40.0, 42.0, 60.0], &[0.0, 0.03, 0.1, 0.6]];
    J2Table::from_values(&[E.into(), NU.into(), rows[0].into(), rows[1].into()]).unwrap()
}

const IDENTITY: Tensor<f64> = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The stress τ = P Fᵀ and the history after a sequence of deformations.
fn drive(law: &impl Inelastic, path: impl IntoIterator<Item = Tensor<f64>>) -> (Tensor<f64>, [f64; HISTORY]) {
    let (mut history, mut stress) = ([0.0; HISTORY], [[0.0; 3]; 3]);
    for f in path {
        let (p, next) = law.update(&f, &history, 1.0);
        stress = from_fn(|i| from_fn(|j| sum(|k| p[i][k] * f[j][k])));
        history = next;
    }
    (stress, history)
}

fn uniaxial(law: &impl Inelastic, yield_stress: impl Fn(f64) -> f64) {
    // τ = E (ε − α), and the lateral strains of elasticity and of incompressible flow
    let at = |strain: f64, stress: f64, flow: f64| -> Tensor<f64> {
        let lateral = -NU * stress / E - 0.5 * flow;
        [[strain.exp(), 0.0, 0.0], [0.0, lateral.exp(), 0.0], [0.0, 0.0, lateral.exp()]]
    };
    let mut path = vec![at(20.0 / E, 20.0, 0.0)];
    for flow in [0.01, 0.05, 0.3] {
        let stress = yield_stress(flow);
        path.push(at(stress / E + flow, stress, flow));
        let (found, history) = drive(law, path.clone());
        assert!((found[0][0] - stress).abs() < 1e-12 * stress, "{found:?} {stress}");
        assert!(found[1][1].abs() < 1e-11 && found[0][1].abs() < 1e-12, "{found:?}");
        assert!((history[6] - flow).abs() < 1e-14);
        // plastic flow keeps the volume
        assert!((crate::law::determinant(&plastic(&history)) - 1.0).abs() < 1e-13);
    }
    // unloading is elastic, and compression then yields at the same stress
    let (flow, full) = (0.3, yield_stress(0.3));
    path.push(at(0.2 * full / E + flow, 0.2 * full, flow));
    let (found, history) = drive(law, path.clone());
    assert!((found[0][0] - 0.2 * full).abs() < 1e-11 && (history[6] - flow).abs() < 1e-14);
    let total = 0.4;
    let back = yield_stress(total);
    path.push(at(-back / E + 0.2, -back, 0.2));
    let (found, history) = drive(law, path);
    assert!((found[0][0] + back).abs() < 1e-11 * back && (history[6] - total).abs() < 1e-13, "{found:?} {history:?}");
}

/// By hand: a bar in tension, unloaded and compressed; logarithmic strains add up.
#[test]
fn uniaxial_stress_is_analytic() {
    uniaxial(&linear(), |flow| 30.0 + 260.0 * flow);
    let between = |flow: f64| match flow {
        0.0..0.03 => 30.0 + 10.0 * flow / 0.03,
        0.03..0.1 => 40.0 + 2.0 * (flow - 0.03) / 0.07,
        _ => 42.0 + 18.0 * (flow - 0.1) / 0.5,
    };
    uniaxial(&table(), between);
    uniaxial(&swift(), |flow| 30.0 * (1.0 + flow / 0.02).powf(0.25));
    uniaxial(&voce(), |flow| 30.0 + 20.0 * (1.0 - (-12.0 * flow).exp()) + 20.0 * flow);
}

/// A rotation after the flow turns the stress and leaves the history.
#[test]
fn rotations_turn_the_stress() {
    let f = [[1.2, 0.3, -0.1], [0.2, 0.9, 0.15], [-0.25, 0.1, 1.1]];
    let turn = [[2.0, 1.0, 2.0], [-2.0, 2.0, 1.0], [1.0, 2.0, -2.0]].map(|row| row.map(|x: f64| x / 3.0));
    let turn = turn.map(|row| [row[0], row[1], -row[2]]);
    let (stress, history) = drive(&voce(), [f]);
    let (turned, after) = drive(&voce(), [f, product(&turn, &f)]);
    for i in 0..3 {
        for j in 0..3 {
            let expected = sum(|k| sum(|l| turn[i][k] * stress[k][l] * turn[j][l]));
            assert!((turned[i][j] - expected).abs() < 1e-12 * 30.0);
        }
    }
    assert!(history.iter().zip(after).all(|(a, b)| (a - b).abs() < 1e-13));
}

/// Simple shear: the rate equations ḃ = l b + b lᵀ − 2 γ̇ n b with q = σ_y, integrated by the method of
/// Runge and Kutta with 4,000 steps, against the law's steps, extrapolated from 200 and 400.
#[test]
fn simple_shear_agrees_with_small_steps() {
    let law = linear();
    let mu = law.elastic.hooke().mu;
    let total = 0.8;
    let of_b = |b: &Tensor<f64>| -> Tensor<f64> {
        let strain = f64::isotropic(b, Isotropic::Logarithm).map(|row| row.map(|x| 0.5 * x));
        split(&strain).1.map(|row| row.map(|x| 2.0 * mu * x))
    };
    let size = |stress: &Tensor<f64>| equivalent(stress);
    // rate of b per shear, and of α
    let rate = |b: &Tensor<f64>, strain: f64| -> (Tensor<f64>, f64) {
        let drag: Tensor<f64> =
            from_fn(|i| from_fn(|j| if i == 0 { b[1][j] } else { 0.0 } + if j == 0 { b[i][1] } else { 0.0 }));
        let stress = of_b(b);
        let q = size(&stress);
        let normal = stress.map(|row| row.map(|x| 1.5 * x / q));
        let flow = product(&normal, b).map(|row| row.map(|x| -2.0 * x));
        let h = 1e-5;
        let slope = |along: &Tensor<f64>| {
            let at = |s: f64| size(&of_b(&from_fn(|i| from_fn(|j| b[i][j] + s * along[i][j]))));
            (at(h) - at(-h)) / (2.0 * h)
        };
        if q < 30.0 + 260.0 * strain - 1e-6 {
            return (drag, 0.0);
        }
        let gamma = (slope(&drag) / (260.0 - slope(&flow))).max(0.0);
        (from_fn(|i| from_fn(|j| drag[i][j] + gamma * flow[i][j])), gamma)
    };
    // begin at the yield point, found by bisection
    let elastic =
        |shear: f64| -> Tensor<f64> { [[1.0 + shear * shear, shear, 0.0], [shear, 1.0, 0.0], [0.0, 0.0, 1.0]] };
    let (mut low, mut high) = (0.0, 0.5);
    for _ in 0..100 {
        let mid = 0.5 * (low + high);
        if size(&of_b(&elastic(mid))) < 30.0 { low = mid } else { high = mid }
    }
    let (mut b, mut strain) = (elastic(high), 0.0);
    let n = 4000;
    let step = (total - high) / f64::from(n);
    let moved = |b: &Tensor<f64>, k: &(Tensor<f64>, f64), s: f64| -> Tensor<f64> {
        from_fn(|i| from_fn(|j| b[i][j] + s * k.0[i][j]))
    };
    for _ in 0..n {
        let k1 = rate(&b, strain);
        let k2 = rate(&moved(&b, &k1, 0.5 * step), strain + 0.5 * step * k1.1);
        let k3 = rate(&moved(&b, &k2, 0.5 * step), strain + 0.5 * step * k2.1);
        let k4 = rate(&moved(&b, &k3, step), strain + step * k3.1);
        b = from_fn(|i| {
            from_fn(|j| b[i][j] + step / 6.0 * (k1.0[i][j] + 2.0 * k2.0[i][j] + 2.0 * k3.0[i][j] + k4.0[i][j]))
        });
        strain += step / 6.0 * (k1.1 + 2.0 * k2.1 + 2.0 * k3.1 + k4.1);
    }
    let reference = of_b(&b);
    let in_steps = |n: u32| {
        let sheared = |s: u32| [[1.0, total * f64::from(s) / f64::from(n), 0.0], IDENTITY[1], IDENTITY[2]];
        drive(&law, (1..=n).map(sheared))
    };
    let (coarse, fine) = (in_steps(200), in_steps(400));
    for (i, j) in [(0, 1), (0, 0), (1, 1)] {
        let extrapolated = 2.0 * fine.0[i][j] - coarse.0[i][j];
        assert!((extrapolated - reference[i][j]).abs() < 2e-3, "{i}{j}: {extrapolated} {}", reference[i][j]);
    }
    assert!((2.0 * fine.1[6] - coarse.1[6] - strain).abs() < 1e-5, "{} {strain}", fine.1[6]);
}

/// Stress and history by F, the previous history and the strength, against central differences, in
/// elastic and plastic steps, for equal principal strains too.
#[test]
fn derivatives_of_an_update_match_differences() {
    fn check(law: &impl Inelastic) {
        let bent = [[1.1, 0.05, -0.1], [0.02, 0.93, 0.07], [-0.04, 0.1, 1.03]];
        let pulled = [[1.3, 0.0, 0.0], [0.0, 0.9, 0.0], [0.0, 0.0, 0.9]];
        let small = [[1.001, 0.0, 0.002], [0.0, 1.0, 0.0], [0.0, 0.001, 1.0]];
        let (_, worked) = drive(law, [bent]);
        for (f, history) in
            [(bent, [0.0; HISTORY]), (pulled, worked), (pulled, [0.0; HISTORY]), (small, [0.0; HISTORY])]
        {
            let all = |x: &[f64; 17]| -> [f64; 16] {
                let f = from_fn(|a| from_fn(|b| x[3 * a + b]));
                let (p, h) = law.update(&f, &from_fn(|i| x[9 + i]), x[16]);
                from_fn(|i| if i < 9 { p[i / 3][i % 3] } else { h[i - 9] })
            };
            let x: [f64; 17] = from_fn(|i| match i {
                0..9 => f[i / 3][i % 3],
                9..16 => history[i - 9],
                _ => 0.8,
            });
            let dual = |i: usize| Dual::<f64, 17> { value: x[i], slopes: from_fn(|k| f64::from(k == i)) };
            let (p, h) = law.update(&from_fn(|a| from_fn(|b| dual(3 * a + b))), &from_fn(|i| dual(9 + i)), dual(16));
            for k in 0..17 {
                let step = 1e-6;
                let at = |s: f64| {
                    let mut x = x;
                    x[k] += s * step;
                    all(&x)
                };
                let (plus, minus) = (at(1.0), at(-1.0));
                for i in 0..16 {
                    let found = if i < 9 { p[i / 3][i % 3].slopes[k] } else { h[i - 9].slopes[k] };
                    let difference = (plus[i] - minus[i]) / (2.0 * step);
                    let bound = if i < 9 { 2e-6 * E } else { 2e-7 };
                    assert!((found - difference).abs() < bound, "{i} by {k}: {found} {difference}");
                }
            }
        }
    }
    check(&linear());
    check(&voce());
    check(&swift());
    check(&table());
}

/// The plastic work is the integral of the yield stress.
#[test]
fn work_is_the_integral_of_the_yield_stress() {
    fn check(hardening: &impl Hardening) {
        for strain in [0.0, 0.02, 0.7] {
            let (mut sum, n) = (0.0, 1000);
            for i in 0..n {
                sum += hardening.yield_stress(strain * (f64::from(i) + 0.5) / f64::from(n)) * strain / f64::from(n);
            }
            assert!((sum - hardening.work(strain)).abs() < 1e-5 * (1.0 + sum));
            let h = 1e-6;
            let slope = (hardening.yield_stress(strain + h) - hardening.yield_stress(strain - h)) / (2.0 * h);
            assert!((slope - hardening.slope(strain)).abs() < 1e-5);
        }
    }
    check(&linear().hardening);
    check(&voce().hardening);
    check(&swift().hardening);
    check(&table().hardening);
}

/// Between the rows of its table, a curve deviates by less than a thousandth up to a plastic strain of 1.
#[test]
fn tables_stand_for_curves() {
    for (law, exact) in
        [(swift().into(), false), (voce().into(), false), (linear().into(), true), (table().into(), true)]
    {
        let law: Material = law;
        let of = law.hardening().expect("a law of plasticity");
        assert_eq!(of.exact, exact);
        let curve = |strain: f64| with_memory!(law, law => law.hardening.yield_stress(strain));
        for (strains, stresses) in of.strains.windows(2).zip(of.stresses.windows(2)).filter(|(two, _)| two[1] <= 1.0) {
            let middle = curve(0.5 * (strains[0] + strains[1]));
            let error = (0.5 * (stresses[0] + stresses[1]) - middle).abs() / middle;
            assert!(error < if exact { 1e-14 } else { 1e-3 }, "{law:?} between {strains:?}: {error:e}");
        }
    }
}

/// Beyond the last row, the yield stress is constant; wrong tables are refused.
#[test]
fn tables_are_read_as_decks_mean_them() {
    let hardening = table().hardening;
    assert_eq!((hardening.yield_stress(0.9), hardening.slope(0.9)), (60.0, 0.0));
    let key = |stress: &[f64], strain: &[f64]| {
        J2Table::from_values(&[E.into(), NU.into(), stress.into(), strain.into()]).unwrap_err().key
    };
    assert_eq!(key(&[30.0, 40.0], &[0.0]), "plastic_strain");
    assert_eq!(key(&[30.0], &[0.1]), "plastic_strain");
    assert_eq!(key(&[30.0, 40.0], &[0.0, 0.0]), "plastic_strain");
    assert_eq!(key(&[-30.0, 40.0], &[0.0, 0.1]), "yield_stress");
    assert_eq!(key(&[30.0, 20.0], &[0.0, 0.1]), "yield_stress");
}
