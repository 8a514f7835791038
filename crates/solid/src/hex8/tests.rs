use super::geometry::CORNER;
use super::*;
use crate::LawKind;
use crate::reference::tests::sections;

type Corners = [[f64; 3]; 8];

/// Scalings of an element by its density: solid, scaled, grey and empty with interpolated energy.
const SCALINGS: [ElementScaling; 4] = [
    ElementScaling::SOLID,
    ElementScaling::stiffness(0.2),
    ElementScaling { factor: 0.3, gamma: 0.6, ..ElementScaling::SOLID },
    ElementScaling { factor: 0.1, gamma: 0.0, ..ElementScaling::SOLID },
];

fn geometry() -> ReferenceGeometry {
    let corners = std::array::from_fn(|i| {
        let c = CORNER[i];
        [c[0] + 0.1 * c[1] * c[2], 0.8 * c[1] - 0.1 * c[0], 1.2 * c[2] + 0.05 * c[0] * c[1]]
    });
    ReferenceGeometry::new(&corners).unwrap()
}

/// A displacement without any symmetry.
fn generic() -> Corners {
    std::array::from_fn(|i| std::array::from_fn(|a| 0.1 * ((3 * i + a) as f64 * 1.7).sin()))
}

const YOUNGS_MODULUS: f64 = 210.0;

/// All sections at all scalings.
fn variants() -> impl Iterator<Item = (Section, ElementScaling)> {
    sections().flat_map(|section| SCALINGS.map(|scaling| (section, scaling)))
}

/// The displacements of the gradient `h` at the corners of [-½, ½]³.
fn linear(h: &[[f64; 3]; 3]) -> (ReferenceGeometry, Corners) {
    let cube = ReferenceGeometry::new(&CORNER.map(|c| c.map(|x| 0.5 * x))).unwrap();
    (cube, CORNER.map(|c| std::array::from_fn(|a| (0..3).map(|b| 0.5 * h[a][b] * c[b]).sum::<f64>())))
}

/// Expected value: Ψ_L of a linear displacement field times the volume of a unit cube; for linear
/// elasticity λ/2 (tr ε)² + μ ε:ε, computed by hand. Small-strain laws have this energy at any
/// scaling.
#[test]
fn an_empty_element_is_linear_elastic() {
    // large, and beyond inversion
    let h = [[-2.5, 0.4, 0.1], [0.3, 0.7, -0.2], [0.0, 0.5, -0.6]];
    let (cube, d) = linear(&h);
    assert!(smallest_determinant(&cube, &d) < 0.0);
    let (trace, nu) = (h[0][0] + h[1][1] + h[2][2], 0.3);
    let squares: f64 = (0..9).map(|n| (0.5 * (h[n / 3][n % 3] + h[n % 3][n / 3])).powi(2)).sum();
    let mu = YOUNGS_MODULUS / (2.0 * (1.0 + nu));
    let lambda = YOUNGS_MODULUS * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    for section in sections() {
        let linear = section.material.small_strains();
        let expected = section.material.small_strain_energy(&h);
        let by_hand = 0.5 * lambda * trace * trace + mu * squares;
        assert!(!linear || (expected / by_hand - 1.0).abs() < 1e-14);
        for gamma in [0.0, 1.0] {
            let found = energy(&section, ElementScaling { gamma, ..ElementScaling::SOLID }, &cube, &d);
            assert_eq!(found.is_some(), linear || gamma == 0.0);
            assert!(
                found.is_none_or(|found| (found / expected - 1.0).abs() < 1e-14),
                "{section:?}: {found:?} {expected}"
            );
        }
        assert!(
            internal_force(&section, ElementScaling { factor: 1.0, gamma: 0.3, ..ElementScaling::SOLID }, &cube, &d)
                .is_some()
        );
    }
}

/// If the deformation is uniform, the mean of J is J: the formulations agree, and the energy is
/// that of the law.
#[test]
fn formulations_agree_on_uniform_deformation() {
    let h = [[-0.3, 0.4, 0.1], [0.3, 0.5, -0.2], [0.0, 0.25, 0.2]];
    let (cube, d) = linear(&h);
    let f = std::array::from_fn(|a| std::array::from_fn(|b| h[a][b] + f64::from(a == b)));
    // linear elements have no reduced integration
    let sections: Vec<Section> = sections().filter(|section| section.formulation != Formulation::Reduced).collect();
    assert_eq!(sections.len(), 2 * LawKind::ALL.len());
    for pair in sections.chunks(2) {
        let (full, bar) = (pair[0], pair[1]);
        let force = |section: &Section| internal_force(section, ElementScaling::SOLID, &cube, &d).unwrap();
        for (x, y) in force(&full).as_flattened().iter().zip(force(&bar).as_flattened()) {
            assert!((x - y).abs() < 1e-13 * YOUNGS_MODULUS, "{full:?}: {x} {y}");
        }
        for section in [full, bar] {
            let (found, expected) =
                (energy(&section, ElementScaling::SOLID, &cube, &d).unwrap(), section.material.energy(&f));
            assert!((found / expected - 1.0).abs() < 1e-13, "{section:?}: {found} {expected}");
        }
        let force =
            |section: &Section| internal_force(section, ElementScaling::SOLID, &geometry(), &generic()).unwrap();
        assert!((force(&full)[0][0] - force(&bar)[0][0]).abs() > 1e-3 * YOUNGS_MODULUS);
    }
}

/// A rotation of the deformed body rotates its forces and changes nothing else. Without strain
/// there is no force. Small-strain laws do not have this property.
#[test]
fn forces_turn_with_the_body() {
    // rotation by 73° about (1, 2, 2)/3, by Rodrigues' formula
    let (axis, angle) = ([1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0], 73.0_f64.to_radians());
    let cross = [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]];
    let turn: [[f64; 3]; 3] = std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            let identity = f64::from(a == b);
            angle.cos() * identity + angle.sin() * cross[a][b] + (1.0 - angle.cos()) * axis[a] * axis[b]
        })
    });
    let turned = |x: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|a| (0..3).map(|b| turn[a][b] * x[b]).sum()) };
    let corners = CORNER;
    let reference = ReferenceGeometry::new(&corners).unwrap();
    for section in sections().filter(|section| !section.material.small_strains()) {
        for size in [0.0, 1.0] {
            let d = generic().map(|d| d.map(|d| size * d));
            let moved: Corners = std::array::from_fn(|i| {
                let x = turned(&std::array::from_fn(|a| corners[i][a] + d[i][a]));
                std::array::from_fn(|a| x[a] - corners[i][a])
            });
            let force = |d: &Corners| internal_force(&section, ElementScaling::SOLID, &reference, d).unwrap();
            for (found, expected) in force(&moved).iter().zip(&force(&d).map(|f| turned(&f))) {
                for a in 0..3 {
                    assert!((found[a] - expected[a]).abs() < 1e-13 * YOUNGS_MODULUS, "{section:?}");
                }
            }
        }
    }
}

/// The portable loops and those for the current instruction set agree up to round-off.
#[test]
fn instruction_sets_agree() {
    let (geometry, d) = (geometry(), generic());
    let scale = YOUNGS_MODULUS;
    let mut scratch = Scratch::new();
    for (section, scaling) in variants() {
        let found = internal_force(&section, scaling, &geometry, &d).unwrap();
        let portable =
            interpolated::internal_force(pulp::Scalar, &mut scratch, &section, &geometry, scaling, &d).unwrap();
        for (x, y) in found.as_flattened().iter().zip(portable.as_flattened()) {
            assert!((x - y).abs() < 1e-14 * scale, "{x} {y}");
        }
        let mut k = [[0.0; 9]; 64];
        tangent(&section, scaling, &geometry, &d, &mut k).unwrap();
        let mut portable = [[0.0; 9]; 64];
        interpolated::tangent(pulp::Scalar, &mut scratch, &section, &geometry, scaling, &d, |i, j, block| {
            assert!(i <= j);
            for (sum, x) in portable[8 * i + j].iter_mut().zip(block) {
                *sum += x;
            }
        });
        for (n, block) in portable.iter().enumerate().filter(|(n, _)| n / 8 <= n % 8) {
            for (x, y) in k[n].iter().zip(block) {
                assert!((x - y).abs() < 1e-14 * scale, "{x} {y}");
            }
        }
    }
}

/// Without strain there is no force, not even round-off: at rest and after a large translation.
#[test]
fn a_translation_has_no_force() {
    let geometry = geometry();
    for (section, scaling) in variants() {
        for shift in [0.0, 1e6] {
            let d = [[shift, -0.3 * shift, 0.7 * shift]; 8];
            let force = internal_force(&section, scaling, &geometry, &d).unwrap();
            assert!(force.as_flattened().iter().all(|&f| f == 0.0), "{section:?} {scaling:?}");
        }
    }
}

#[test]
fn an_inverted_element_has_no_force() {
    let (geometry, mut d) = (geometry(), generic());
    d[6] = [-5.0, -5.0, -5.0];
    for section in sections() {
        let force = internal_force(&section, ElementScaling::SOLID, &geometry, &d);
        assert_eq!(force.is_some(), section.material.small_strains());
    }
    assert!(smallest_determinant(&geometry, &d) < 0.0);
}
