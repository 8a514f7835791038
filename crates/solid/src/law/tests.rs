use super::*;
use crate::dual::Dual;
use crate::registers::{POINTS, invert};
use std::array::from_fn;

fn laws() -> impl Iterator<Item = Material> {
    LawKind::ALL.iter().map(|law| law.with_constants(7.0, 0.3).unwrap())
}

#[test]
fn impossible_constants_are_refused() {
    for law in LawKind::ALL {
        assert_eq!(law.with_constants(-1.0, 0.3), Err(MaterialError::YoungsModulus(-1.0)));
        assert_eq!(law.with_constants(1.0, 0.5), Err(MaterialError::PoissonRatio(0.5)));
        assert!(law.with_constants(f64::NAN, 0.3).is_err() && law.with_constants(1.0, f64::NAN).is_err());
    }
}

#[test]
fn words_name_laws() {
    assert_eq!(LawKind::NeoHooke.word(), "neo_hooke");
    for law in LawKind::ALL {
        assert_eq!(LawKind::from_word(law.word()), Some(*law));
        assert!(law.about().ends_with('.') && !law.about().starts_with(' '));
    }
    assert_eq!(LawKind::from_word("steel"), None);
}

/// For every law at one point: stress, its change, and the form of the change that a volumetric
/// exponent implies.
#[test]
fn stresses_are_derivatives_of_the_energy() {
    let f: [[f64; 3]; 3] = [[1.2, 0.3, -0.1], [0.2, 0.9, 0.15], [-0.25, 0.1, 1.1]];
    let change = [[0.4, -0.2, 0.7], [0.1, 0.3, -0.5], [0.6, -0.8, 0.2]];
    let (inverse, j) = invert(pulp::Scalar, &f);
    let at_points = |m: [[f64; 3]; 3]| m.map(|row| row.map(|x| [x; POINTS]));
    let (gradient, inverses) = (at_points(f), at_points(inverse));
    for material in laws() {
        with_law!(material, law => {
            let volumetric = law.volumetric(pulp::Scalar, &[j; POINTS]);
            let at = Local { gradient: &gradient, inverse: &inverses, volumetric: &volumetric, v: 3 };
            let (stress, slope) = (law.stress(pulp::Scalar, &at), law.stress_change(pulp::Scalar, &at, &change));
            for n in 0..9 {
                let (a, b) = (n / 3, n % 3);
                let seeded = from_fn(|i| from_fn(|k| Dual {
                    value: Dual { value: f[i][k], slope: change[i][k] },
                    slope: f64::from((i, k) == (a, b)).into(),
                }));
                let expected = law.energy(&seeded).slope;
                let [found, found_slope] = [stress, slope].map(|p| law.shear_modulus() * p[a][b]);
                assert!((found - expected.value).abs() < 1e-13 * 7.0, "{law:?}: {found} {expected:?}");
                assert!((found_slope - expected.slope).abs() < 1e-13 * 7.0, "{law:?}: {found_slope} {expected:?}");
                if let Some(exponent) = law.volumetric_exponent() {
                    let relative = |i: usize, k: usize| (0..3).map(|c| inverse[i][c] * change[c][k]).sum::<f64>();
                    let turned: f64 = (0..3).map(|c| relative(b, c) * inverse[c][a]).sum();
                    let trace: f64 = (0..3).map(|i| relative(i, i)).sum();
                    let volume = exponent * trace * inverse[b][a] + turned;
                    assert!((change[a][b] + volumetric[0] * volume - slope[a][b]).abs() < 1e-14 * 7.0);
                }
            }
        });
    }
}

/// By hand: F = 1 + ε(e ⊗ n) has energy μ ε²/2 (shear) and (λ/2 + μ) ε² (stretch) to second order,
/// in all laws.
#[test]
fn laws_share_the_small_strain_limit() {
    let (e, nu) = (7.0, 0.3);
    let (mu, lambda) = (e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)));
    for law in laws() {
        assert_eq!((law.youngs_modulus(), law.poisson_ratio()), (e, nu));
        let small = 1e-3;
        let second = |a: usize, b: usize| {
            let at = |h: f64| {
                let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                f[a][b] += h;
                law.energy(&f)
            };
            0.5 * (at(small) + at(-small)) / (small * small)
        };
        for (a, b, expected) in [(0, 1, 0.5 * mu), (2, 0, 0.5 * mu), (1, 1, 0.5 * lambda + mu)] {
            assert!((second(a, b) / expected - 1.0).abs() < 1e-4, "{law:?}: {} {expected}", second(a, b));
        }
    }
}
