//! Laws of rubber against Treloar's measurements, and against closed-form solutions for
//! incompressible rubber: uniaxial, equibiaxial and pure shear.

use crate::chapter::Chapter;
use crate::finding::Finding;
use slipstick::mesh::{BoxShape, Mesh, box_mesh};
use slipstick::render::{Canvas, Curve, curves_picture};
use slipstick::solid::{ElementScaling, Formulation, Material, MooneyRivlin, Ogden, Section, SolidModel, Yeoh};

pub fn chapter() -> Chapter {
    Chapter {
        key: "treloar",
        title: "Laws of rubber: Treloar's measurements",
        about: "
Treloar (Trans. Faraday Soc. 40, 1944) measured the nominal stress of vulcanized rubber in uniaxial
tension, equibiaxial tension and pure shear. Ogden's constants are those of Ogden (Proc. R. Soc.
Lond. A 326, 1972); those of the other laws are least-squares fits to the relative deviations from
the measurements. *deviation from the measurements* is the mean relative deviation of the
closed-form stress of the incompressible solid, for Mooney-Rivlin up to a stretch of 2, otherwise
over all stretches. *element* is the largest relative deviation of one hexahedron with a bulk
modulus of 10⁵ MPa from this closed form, over all measured stretches, with full integration and
with F̄.",
        remarks: "
![Nominal stress over stretch](../figures/treloar.png)

The figure shows the measurements and Ogden's law with three terms, as in figures 1 to 3 of the 1972
paper. The other laws are simpler: Yeoh's has no second invariant, and Mooney-Rivlin does not
stiffen.",
        quick: true,
        run: || Some(run()),
    }
}

fn run() -> Vec<Finding> {
    let mut findings = Vec::new();
    let ranges = [(2.0, [0.10, 0.10, 0.10]), (8.0, [0.08, 0.15, 0.07]), (8.0, [0.06, 0.06, 0.06])];
    for ((material, name), (most, bounds)) in laws(1e5).iter().zip(NAMES).zip(ranges) {
        for ((test, found), bound) in TESTS.iter().zip(deviations(material, most)).zip(bounds) {
            let what = format!("{name}, {}: deviation from the measurements", test.name);
            findings.push(Finding::at_most(what, bound, found));
        }
        findings.push(Finding::at_most(format!("{name}: element"), 5e-4, element_deviation(*material)));
    }
    findings
}

/// Largest relative deviation of an element from the closed form.
fn element_deviation(material: Material) -> f64 {
    let mut largest = 0.0_f64;
    for formulation in [Formulation::Full, Formulation::FBar] {
        let cube = Cube::new(material, formulation);
        for test in TESTS {
            for &[_, stretch] in test.data {
                let (found, expected) = (cube.loaded(stretch, test.m), closed_form(&material, stretch, test.m));
                largest = largest.max((found / expected - 1.0).abs());
            }
        }
    }
    largest
}

/// Writes the figure of the chapter.
#[test]
#[ignore = "writes docs/figures/treloar.png"]
fn figure_of_ogdens_law() {
    let mut curves = Vec::new();
    let ogden = laws(1e5)[2];
    for test in TESTS {
        let name = |what: &str| format!("{}, {what}", test.name);
        let measured = test.data.iter().map(|&[stress, stretch]| [stretch, stress]).collect();
        let last = test.data[test.data.len() - 1][1];
        let at = |k: usize| 1.0 + (last - 1.0) * k as f64 / 100.0;
        let law = (0..=100).map(|k| [at(k), closed_form(&ogden, at(k), test.m)]).collect();
        curves.push(Curve { name: name("measured"), points: measured, points_only: true });
        curves.push(Curve { name: name("Ogden"), points: law, points_only: false });
    }
    let canvas = Canvas { width: 1000, height: 700, ..Canvas::default() };
    let picture = curves_picture(
        Some("Treloar's rubber, measured, and Ogden's law"),
        &curves,
        ["Stretch", "Stress [MPa]"],
        &canvas,
    )
    .unwrap();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/figures/treloar.png");
    picture.save_png(std::path::Path::new(file)).unwrap();
}

const NAMES: [&str; 3] = ["Mooney-Rivlin", "Yeoh", "Ogden"];

/// Nominal stress \[MPa\] and stretch of vulcanized rubber.
///
/// Source: Treloar, Trans. Faraday Soc. 40 (1944) 59–70, as digitized in
/// github.com/Chongran-Zhao/Hyperelastic-fitting (Treloar_1944).
const UNIAXIAL: [[f64; 2]; 24] = [
    [0.0255, 1.02],
    [0.1344, 1.125],
    [0.2256, 1.24],
    [0.3169, 1.39],
    [0.4081, 1.585],
    [0.5003, 1.9],
    [0.5886, 2.18],
    [0.6769, 2.42],
    [0.8633, 3.02],
    [1.0497, 3.57],
    [1.2263, 4.03],
    [1.5892, 4.76],
    [1.9522, 5.36],
    [2.3152, 5.75],
    [2.6879, 6.15],
    [3.0411, 6.4],
    [3.4139, 6.6],
    [3.7769, 6.85],
    [4.13, 7.05],
    [4.493, 7.15],
    [4.8658, 7.25],
    [5.2287, 7.4],
    [5.5917, 7.5],
    [6.3176, 7.6],
];
const EQUIBIAXIAL: [[f64; 2]; 16] = [
    [0.0925, 1.027],
    [0.157, 1.065],
    [0.2387, 1.115],
    [0.257, 1.14],
    [0.3282, 1.2],
    [0.4364, 1.31],
    [0.5146, 1.42],
    [0.6557, 1.68],
    [0.7652, 1.94],
    [0.9617, 2.49],
    [1.2386, 3.03],
    [1.4401, 3.43],
    [1.7096, 3.75],
    [1.9845, 4.07],
    [2.2065, 4.26],
    [2.4426, 4.45],
];
const PURE_SHEAR: [[f64; 2]; 13] = [
    [0.0667, 1.03],
    [0.1589, 1.12],
    [0.2452, 1.19],
    [0.3326, 1.31],
    [0.4189, 1.46],
    [0.5925, 1.84],
    [0.7652, 2.38],
    [0.9418, 2.97],
    [1.1183, 3.47],
    [1.2851, 3.95],
    [1.4617, 4.37],
    [1.6285, 4.69],
    [1.805, 4.97],
];

/// A homogeneous deformation, with the principal stretches λ, λ^m and λ^(−1−m) of an incompressible
/// solid.
#[derive(Debug, Clone, Copy)]
struct Test {
    name: &'static str,
    m: f64,
    data: &'static [[f64; 2]],
}

const TESTS: [Test; 3] = [
    Test { name: "uniaxial", m: -0.5, data: &UNIAXIAL },
    Test { name: "equibiaxial", m: 1.0, data: &EQUIBIAXIAL },
    Test { name: "pure shear", m: 0.0, data: &PURE_SHEAR },
];

/// Ogden's constants for these measurements, 6.3, 0.012 and −0.1 kgf/cm².
///
/// Source: Ogden, Proc. R. Soc. Lond. A 326 (1972) 565–584.
const KGF_PER_CM2: f64 = 0.098_066_5;
const MU: [f64; 3] = [6.3 * KGF_PER_CM2, 0.012 * KGF_PER_CM2, -0.1 * KGF_PER_CM2];
const ALPHA: [f64; 3] = [1.3, 5.0, -2.0];
/// Constants with the least squares of relative deviations from the measurements of all three tests:
/// up to a stretch of 2 for Mooney-Rivlin, at all stretches for Yeoh. \[MPa\]
const MOONEY: [f64; 2] = [0.188, 0.0085];
const YEOH: [f64; 3] = [0.193, -0.00179, 4.4e-5];

/// Closed-form nominal stress of the incompressible solid, by hand: the axis that is free of load
/// has the stretch λ^(−1−m).
fn closed_form(material: &Material, stretch: f64, m: f64) -> f64 {
    let (l, free) = (stretch, stretch.powf(-1.0 - m));
    let across = stretch.powf(m);
    let first = l * l + across * across + free * free;
    // 2 (λ − λ₃²/λ) (W₁ + λ₂² W₂)
    let of_invariants = |w1: f64, w2: f64| 2.0 * (l - free * free / l) * (w1 + across * across * w2);
    match material {
        Material::MooneyRivlin(_) => of_invariants(MOONEY[0], MOONEY[1]),
        Material::Yeoh(_) => {
            let x = first - 3.0;
            of_invariants(YEOH[0] + 2.0 * YEOH[1] * x + 3.0 * YEOH[2] * x * x, 0.0)
        }
        _ => MU.iter().zip(ALPHA).map(|(mu, alpha)| mu * (l.powf(alpha) - free.powf(alpha)) / l).sum(),
    }
}

fn laws(bulk: f64) -> [Material; 3] {
    [
        MooneyRivlin::new(MOONEY[0], MOONEY[1], bulk).unwrap().into(),
        Yeoh::new(YEOH, bulk).unwrap().into(),
        Ogden::new(&MU, &ALPHA, bulk).unwrap().into(),
    ]
}

/// A cube of one element, whose nominal stresses along x and z are the forces on its faces.
struct Cube {
    mesh: Mesh,
    model: SolidModel,
}

impl Cube {
    fn new(material: Material, formulation: Formulation) -> Self {
        let shape = BoxShape { min: [0.0; 3], max: [1.0; 3], elements: [1; 3], grading: [1.0; 3] };
        let mesh = box_mesh("cube", &shape).unwrap();
        let model = SolidModel::new(&mesh, vec![Section::new(material, formulation)]).unwrap();
        Self { mesh, model }
    }

    fn stresses(&self, stretches: [f64; 3]) -> [f64; 3] {
        let moved = |x: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|c| (stretches[c] - 1.0) * x[c]) };
        let d: Vec<f64> = self.mesh.nodes.iter().flat_map(moved).collect();
        let mut force = vec![0.0; d.len()];
        self.model.internal_force(&d, &[ElementScaling::SOLID], &mut force).unwrap();
        let on = |c: usize| self.mesh.nodes.iter().enumerate().filter(move |(_, x)| x[c] == 1.0).map(|(n, _)| n);
        std::array::from_fn(|c| on(c).map(|n| force[3 * n + c]).sum())
    }

    /// Nominal stress along x where that along z vanishes: z by the secant method.
    fn loaded(&self, stretch: f64, m: f64) -> f64 {
        let at = |z: f64| {
            let across = if m == -0.5 { z } else { stretch.powf(m) };
            self.stresses([stretch, across, z])
        };
        let start = stretch.powf(-1.0 - m);
        let (mut a, mut b) = (start, start * (1.0 + 1e-6));
        for _ in 0..20 {
            let (p, q) = (at(a)[2], at(b)[2]);
            if q == p {
                break;
            }
            (a, b) = (b, b - q * (b - a) / (q - p));
            if (b / a - 1.0).abs() < 1e-15 {
                break;
            }
        }
        at(b)[0]
    }
}

/// Mean relative deviation from the measurements, up to a stretch.
fn deviations(material: &Material, most: f64) -> [f64; 3] {
    TESTS.map(|test| {
        let used: Vec<_> = test.data.iter().filter(|[_, stretch]| *stretch <= most).collect();
        let of = |[stress, stretch]: &[f64; 2]| (closed_form(material, *stretch, test.m) / stress - 1.0).abs();
        used.iter().map(|point| of(point)).sum::<f64>() / used.len() as f64
    })
}
