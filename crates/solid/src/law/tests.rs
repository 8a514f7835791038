use super::*;
use crate::dual::Dual;
use crate::registers::{POINTS, invert};
use std::array::from_fn;

fn laws() -> impl Iterator<Item = Material> {
    LawKind::ALL.iter().map(|law| law.like(7.0, 0.3).unwrap())
}

#[test]
fn impossible_constants_are_refused() {
    let key = |law: LawKind, e: f64, nu: f64| law.like(e, nu).unwrap_err().key;
    for law in LawKind::ALL {
        assert_eq!(key(*law, -1.0, 0.3), "youngs_modulus");
        assert_eq!(key(*law, 1.0, 0.5), "poisson_ratio");
        assert!(law.like(f64::NAN, 0.3).is_err() && law.like(1.0, f64::NAN).is_err());
        // sets each constant out of range
        let values = law.like(1.0, 0.3).unwrap().values();
        for (i, constant) in law.constants().iter().enumerate() {
            let mut values = values.clone();
            values[i] = match values[i] {
                Value::Number(_) => f64::NAN.into(),
                Value::Numbers(_) => Value::Numbers(Vec::new()),
            };
            assert_eq!(law.with_values(&values).unwrap_err().key, constant.key);
        }
    }
    let message = NeoHooke::new(-1.0, 0.3).unwrap_err().to_string();
    assert_eq!(message, "`youngs_modulus` must be greater than zero");
    let unstable = MooneyRivlin::new(0.1, -0.2, 10.0).unwrap_err();
    assert_eq!(unstable.key, "c10");
    assert!(Ogden::new(&[1.0, 2.0], &[2.0], 10.0).is_err() && Ogden::new(&[-1.0], &[2.0], 10.0).is_err());
    let parallel = Orthotropic::new([1.0; 3], [0.3; 3], [0.4; 3], [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
    assert_eq!(parallel.unwrap_err().key, "axis2");
    let unstable = Orthotropic::new([1.0; 3], [0.3, 0.3, 1.1], [0.4; 3], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(unstable.unwrap_err().key, "nu23");
}

/// A law can be rebuilt from its constants, and scaling its moduli scales its stresses.
#[test]
fn constants_make_the_law() {
    let f: [[f64; 3]; 3] = [[1.2, 0.3, -0.1], [0.2, 0.9, 0.15], [-0.25, 0.1, 1.1]];
    for law in laws() {
        assert_eq!(law.kind().with_values(&law.values()), Ok(law));
        let stiffer = law.stiffened(4.0).unwrap();
        assert_eq!(stiffer.youngs_modulus(), 4.0 * law.youngs_modulus());
        assert!((stiffer.energy(&f) / law.energy(&f) - 4.0).abs() < 1e-14, "{law}");
        assert!(law.stiffened(-1.0).is_err() && law.stiffened(f64::INFINITY).is_err());
        let softer = law.with_youngs_modulus(0.3).unwrap();
        assert!((softer.youngs_modulus() - 0.3).abs() < 1e-16, "{softer}");
        assert!((softer.poisson_ratio() / law.poisson_ratio() - 1.0).abs() < 1e-14, "{softer}");
    }
    let elastic = NeoHooke::new(0.1, 0.3).unwrap();
    assert_eq!(Material::from(elastic).with_youngs_modulus(0.7), Ok(NeoHooke::new(0.7, 0.3).unwrap().into()));
    assert_eq!(Material::from(elastic).to_string(), "{ neo_hooke = { youngs_modulus = 0.1, poisson_ratio = 0.3 } }");
}

/// The derivative with respect to Young's modulus is that at constant yield stress, so a finite change of the
/// modulus keeps all constants of hardening.
#[test]
fn stiffer_metals_yield_at_the_same_stress() {
    for kind in LawKind::ALL.iter().filter(|kind| kind.has_memory()) {
        let law = kind.like(1000.0, 0.3).unwrap();
        for stiffer in [law.stiffened(1.5).unwrap(), law.with_youngs_modulus(1500.0).unwrap()] {
            assert_eq!(stiffer.youngs_modulus(), 1500.0);
            let kept = |of: &Material| {
                of.constants().filter(|(c, _)| c.key != "youngs_modulus").map(|(_, v)| v).collect::<Vec<_>>()
            };
            assert_eq!(kept(&stiffer), kept(&law), "{stiffer}");
        }
    }
}

#[test]
fn words_name_laws() {
    assert_eq!(LawKind::NeoHooke.word(), "neo_hooke");
    for law in LawKind::ALL {
        let forms = LawKind::forms(law.word());
        let found = forms.iter().find(|(form, _)| Some(*form) == law.form()).map(|(_, law)| *law);
        assert_eq!(found.or(LawKind::from_word(law.word())), Some(*law));
        assert!(law.about().ends_with('.') && !law.about().starts_with(' '));
    }
    assert_eq!(LawKind::from_word("steel"), None);
    assert_eq!(
        LawKind::forms("neo_hooke").iter().map(|(form, _)| *form).collect::<Vec<_>>(),
        ["power", "ln", "isochoric"]
    );
    assert_eq!(
        NeoHookeLn::new(2.0, 0.1).map(Material::from).unwrap().to_string(),
        "{ neo_hooke = { form = \"ln\", youngs_modulus = 2.0, poisson_ratio = 0.1 } }"
    );
}

/// F without symmetry, and F with equal and close stretches, with and without rotation. At equal
/// stretches, principal directions are not unique and quotients of differences become limits.
fn deformations() -> Vec<[[f64; 3]; 3]> {
    let turn = [[2.0, 1.0, 2.0], [-2.0, 2.0, 1.0], [1.0, 2.0, -2.0]].map(|row| row.map(|x: f64| x / 3.0));
    let axes = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, -1.0]];
    let stretched = |stretches: [f64; 3]| {
        from_fn(|a| from_fn(|b| (0..3).map(|k| turn[a][k] * stretches[k] * axes[k][b]).sum::<f64>()))
    };
    let mut out = vec![
        [[1.2, 0.3, -0.1], [0.2, 0.9, 0.15], [-0.25, 0.1, 1.1]],
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[1.1, 0.0, 0.0], [0.0, 1.1, 0.0], [0.0, 0.0, 0.8]],
        [[1.3, 0.0, 0.0], [0.0, 1.3, 0.0], [0.0, 0.0, 1.3]],
    ];
    for gap in [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3] {
        out.push(stretched([1.2, 1.0 + gap, 1.0]));
        out.push(stretched([0.7, 1.3, 1.3 - gap]));
        out.push(stretched([1.1 + gap, 1.1, 1.1 - 2.0 * gap]));
    }
    out
}

const CHANGE: [[f64; 3]; 3] = [[0.4, -0.2, 0.7], [0.1, 0.3, -0.5], [0.6, -0.8, 0.2]];

/// Stress and its change, divided by the shear modulus.
fn stresses(law: &impl Law, f: &[[f64; 3]; 3], change: &[[f64; 3]; 3]) -> [[[f64; 3]; 3]; 2] {
    let (inverse, j) = invert(pulp::Scalar, f);
    let at_points = |m: [[f64; 3]; 3]| m.map(|row| row.map(|x| [x; POINTS]));
    let volumetric = law.volumetric(pulp::Scalar, &[j; POINTS]);
    let (gradient, inverse) = (&at_points(*f), &at_points(inverse));
    let at = Local { gradient, inverse, determinant: &[j; POINTS], volumetric: &volumetric, v: 3 };
    let prepared = law.prepare(pulp::Scalar, &at);
    [law.stress(pulp::Scalar, &at, &prepared), law.stress_change(pulp::Scalar, &at, &prepared, change)]
}

/// For every law at one point: stress, its change, and the form of the change that a volumetric
/// exponent implies.
#[test]
fn stresses_are_derivatives_of_the_energy() {
    for (material, f) in laws().flat_map(|law| deformations().into_iter().map(move |f| (law, f))) {
        with_law!(material, law => {
            let [stress, slope] = stresses(&law, &f, &CHANGE);
            for n in 0..9 {
                let (a, b) = (n / 3, n % 3);
                let seeded = from_fn(|i| from_fn(|k| Dual {
                    value: Dual { value: f[i][k], slopes: [CHANGE[i][k]] },
                    slopes: [f64::from((i, k) == (a, b)).into()],
                }));
                let expected = law.energy(&seeded).slopes[0];
                let [found, found_slope] = [stress, slope].map(|p| law.shear_modulus() * p[a][b]);
                assert!((found - expected.value).abs() < 1e-13 * 7.0, "{law:?} {f:?}: {found} {expected:?}");
                assert!((found_slope - expected.slopes[0]).abs() < 1e-13 * 7.0, "{law:?} {f:?}: {found_slope} {expected:?}");
                if let Some(exponent) = law.volumetric_exponent() {
                    let (inverse, j) = invert(pulp::Scalar, &f);
                    let volumetric = law.volumetric(pulp::Scalar, &[j; POINTS])[0];
                    let relative = |i: usize, k: usize| (0..3).map(|c| inverse[i][c] * CHANGE[c][k]).sum::<f64>();
                    let turned: f64 = (0..3).map(|c| relative(b, c) * inverse[c][a]).sum();
                    let trace: f64 = (0..3).map(|i| relative(i, i)).sum();
                    let volume = exponent * trace * inverse[b][a] + turned;
                    assert!((CHANGE[a][b] + volumetric * volume - slope[a][b]).abs() < 1e-14 * 7.0);
                }
            }
        });
    }
}

/// The change of the stress at equal and close stretches, against central differences (order 4) of
/// the stress: independent of dual numbers and of the matrix functions in Ogden's energy.
#[test]
fn equal_and_close_stretches() {
    let h = 1e-3;
    for (material, f) in laws().flat_map(|law| deformations().into_iter().map(move |f| (law, f))) {
        with_law!(material, law => {
            let at = |steps: f64| stresses(&law, &from_fn(|a| from_fn(|b| f[a][b] + steps * h * CHANGE[a][b])), &CHANGE)[0];
            let near = [at(1.0), at(-1.0), at(2.0), at(-2.0)];
            let slope = stresses(&law, &f, &CHANGE)[1];
            for n in 0..9 {
                let [p1, m1, p2, m2] = near.map(|p| p[n / 3][n % 3]);
                let difference = (8.0 * (p1 - m1) - (p2 - m2)) / (12.0 * h);
                assert!((slope[n / 3][n % 3] - difference).abs() < 1e-8, "{law:?} {f:?}: {slope:?} {difference}");
            }
        });
    }
}

/// The energy at 1 + εH is that of the small-strain limit to second order, and the limit has, on
/// average over all directions, the E and ν that were requested: of the moduli C_abcd = ∂²Ψ/∂H_ab
/// ∂H_cd, C_aabb is 9K and C_abab is 3K + 10μ.
#[test]
fn laws_have_their_small_strain_limit() {
    let (e, nu) = (7.0, 0.3);
    let (mu, bulk) = (e / (2.0 * (1.0 + nu)), e / (3.0 * (1.0 - 2.0 * nu)));
    let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-13;
    for law in laws() {
        assert!(near(law.youngs_modulus(), e) && near(law.poisson_ratio(), nu), "{law}");
        let moduli = |first: usize, second: usize| {
            let seeded = |f: &dyn Fn(usize, usize) -> f64| -> [[Dual<Dual<f64>>; 3]; 3] {
                let unit = |n: usize, a: usize, b: usize| f64::from(n == 3 * a + b);
                from_fn(|a| {
                    from_fn(|b| Dual {
                        value: Dual { value: f(a, b), slopes: [unit(first, a, b)] },
                        slopes: [Dual { value: unit(second, a, b), slopes: [0.0] }],
                    })
                })
            };
            let limit = law.small_strain_energy(&seeded(&|_, _| 0.0));
            let at_rest = law.energy(&seeded(&|a, b| f64::from(a == b)));
            assert!(at_rest.value.value.abs() < 1e-15 && at_rest.slopes[0].value.abs() < 1e-15, "{law}: {at_rest:?}");
            let [found, expected] = [at_rest, limit].map(|energy| energy.slopes[0].slopes[0]);
            assert!((found - expected).abs() < 1e-13 * e, "{law}, {first} {second}: {found} {expected}");
            expected
        };
        let sums = |of: &dyn Fn(usize, usize) -> f64| (0..9).map(|n| of(n / 3, n % 3)).sum::<f64>();
        assert!(near(sums(&|a, b| moduli(4 * a, 4 * b)), 9.0 * bulk), "{law}");
        assert!(near(sums(&|a, b| moduli(3 * a + b, 3 * a + b)), 3.0 * bulk + 10.0 * mu), "{law}");
    }
}

/// An orthotropic solid with isotropic constants equals St. Venant-Kirchhoff, for any axes. The
/// engineering constants have their usual meaning: a small unit stress along axis 1 causes strains
/// of 1/E₁ along it and of −ν₁₂/E₁ and −ν₁₃/E₁ across.
#[test]
fn engineering_constants_have_their_meaning() {
    let (e, nu) = (7.0, 0.3);
    let g = e / (2.0 * (1.0 + nu));
    let axes = [[1.0, 2.0, 2.0], [2.0, 1.0, -2.0]];
    let isotropic = Orthotropic::new([e; 3], [nu; 3], [g; 3], axes).unwrap();
    let same = StVenantKirchhoff::new(e, nu).unwrap();
    for f in deformations() {
        let ([p, slope], [q, other]) = (stresses(&isotropic, &f, &CHANGE), stresses(&same, &f, &CHANGE));
        for n in 0..9 {
            let (a, b) = (n / 3, n % 3);
            assert!((p[a][b] - q[a][b]).abs() < 1e-14 * 7.0 && (slope[a][b] - other[a][b]).abs() < 1e-14 * 7.0);
        }
        assert!((isotropic.energy(&f) - same.energy(&f)).abs() < 1e-14 * e);
    }
    let unit = axes.map(|axis: [f64; 3]| axis.map(|x| x / 3.0));
    let third = [-2.0 / 3.0, 2.0 / 3.0, -1.0 / 3.0];
    let wood = Orthotropic::new([10.0, 2.0, 1.0], [0.4, 0.3, 0.2], [1.5, 1.2, 0.3], axes).unwrap();
    let strain = |own: [f64; 3]| -> [[f64; 3]; 3] {
        from_fn(|a| {
            from_fn(|b| {
                own[0] * unit[0][a] * unit[0][b] + own[1] * unit[1][a] * unit[1][b] + own[2] * third[a] * third[b]
            })
        })
    };
    let rest = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let stress = stresses(&wood, &rest, &strain([1.0 / 10.0, -0.4 / 10.0, -0.3 / 10.0]))[1];
    for n in 0..9 {
        let expected = unit[0][n / 3] * unit[0][n % 3];
        assert!((wood.shear_modulus() * stress[n / 3][n % 3] - expected).abs() < 1e-14, "{stress:?}");
    }
    // a shear angle in the plane of axes 2 and 3
    let shear = from_fn(|a| from_fn(|b| unit[1][a] * third[b]));
    let stress = stresses(&wood, &rest, &shear)[1];
    for n in 0..9 {
        let (a, b) = (n / 3, n % 3);
        let expected = 0.3 * (unit[1][a] * third[b] + third[a] * unit[1][b]);
        assert!((wood.shear_modulus() * stress[a][b] - expected).abs() < 1e-14, "{stress:?}");
    }
}
