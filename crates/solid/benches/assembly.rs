//! Assembly on one thread of 30 × 30 × 30 hexahedra, of six tetrahedra instead of each, and of 15 × 15
//! × 15 times as many elements of second order, all with the same unknowns: `cargo bench -p
//! slipstick-solid`. Prints the shortest of 30 times of each, because other load on the machine affects
//! it least. Then the hexahedra with every law, relative to neo-Hooke, in both formulations.
//!
//! `cargo bench -p slipstick-solid --bench assembly -- plastic` instead compares elements that flow with
//! elastic ones of the same type, in time of the processor.

use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_solid::{
    ElementScaling, Formulation, Hencky, LawKind, NeoHooke, Section, SolidAdjoint, SolidModel, SolidStep,
};
use std::sync::Arc;
use std::time::Instant;

const ELEMENTS: usize = 30;
const SAMPLES: usize = 30;
const OPERATIONS: [&str; 4] = ["internal force", "tangent", "tangent product", "pull back to densities"];

fn main() {
    if std::env::args().any(|argument| argument == "plastic") {
        return plastic();
    }
    let hexahedra = block(ELEMENTS);
    let tetrahedra = hexahedra.divided(|_| true);
    let half = block(ELEMENTS / 2);
    let middle = |of: &[[f64; 3]]| std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64);
    let [hex27, tet10] =
        [half.clone(), half.divided(|_| true)].map(|mesh| mesh.second_order(middle).expect("hexahedra, tetrahedra"));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let neo_hooke: Section = NeoHooke::new(1000.0, 0.3).expect("a law").into();
    let meshes = [("hex8", &hexahedra), ("tet4", &tetrahedra), ("hex27", &hex27), ("tet10", &tet10)];
    let times = meshes.map(|(_, mesh)| pool.install(|| measure(mesh, neo_hooke)));
    print!("{:24}", "one thread [ms]");
    meshes.iter().for_each(|(name, _)| print!(" {name:>8} {:>7}", "ratio"));
    println!();
    for (k, name) in OPERATIONS.iter().enumerate() {
        print!("{name:24}");
        times.iter().for_each(|of| print!(" {:>8.2} {:>7.2}", of[k], of[k] / times[0][k]));
        println!();
    }
    println!();
    for (name, mesh) in meshes {
        println!("{name:5} {:>7} elements, {} unknowns", mesh.elements.len(), 3 * mesh.nodes.len());
    }
    for formulation in [Formulation::Full, Formulation::FBar] {
        let of = |law: &LawKind| {
            let material = law.like(1000.0, 0.3).expect("a law");
            pool.install(|| measure(&hexahedra, Section::new(material, formulation)))
        };
        let base = of(&LawKind::NeoHooke);
        println!("\n{formulation:?}, microseconds per hexahedron (times neo_hooke)");
        for law in LawKind::ALL {
            let times = of(law);
            let cells = times.iter().zip(base).map(|(time, base)| {
                format!("{:>8.3} ({:>5.2})", 1e3 * time / hexahedra.elements.len() as f64, time / base)
            });
            println!("{:20} {}", law.word(), cells.collect::<Vec<_>>().join(" "));
        }
    }
}

/// Elements per direction of the table of plastic elements; half as many of second order.
const PLASTIC: usize = 8;

/// Every point of the plastic elements flows. The elastic ones have the same elasticity, Hencky's law.
fn plastic() {
    let hexahedra = block(PLASTIC);
    let half = block(PLASTIC / 2);
    let middle = |of: &[[f64; 3]]| std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64);
    let [hex27, tet10] =
        [half.clone(), half.divided(|_| true)].map(|mesh| mesh.second_order(middle).expect("hexahedra, tetrahedra"));
    let kind = LawKind::from_word("j2_linear").expect("a law");
    let flowing = kind.with_values(&[1000.0, 0.3, 1e-3, 100.0].map(Into::into)).expect("a law");
    let elastic = Hencky::new(1000.0, 0.3).expect("a law").into();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let columns = [
        ("hex8", &hexahedra, Formulation::Full),
        ("hex8 F\u{304}", &hexahedra, Formulation::FBar),
        ("hex27 F\u{304}", &hex27, Formulation::FBar),
        ("tet10", &tet10, Formulation::Full),
    ];
    println!("microseconds per element on one thread: elastic, flowing (times elastic)");
    print!("{:24}", "");
    columns.iter().for_each(|(name, ..)| print!(" {name:^26}"));
    println!();
    let times = columns.map(|(_, mesh, formulation)| {
        pool.install(|| {
            let per_element = |section| {
                let (common, memory) = measure_with_memory(mesh, section);
                let each = |time: f64| 1e3 * time / mesh.elements.len() as f64;
                (common.map(each), memory.map(each))
            };
            [elastic, flowing].map(|material| per_element(Section::new(material, formulation)))
        })
    });
    for (k, name) in ["internal force", "tangent", "pull back to densities"].iter().enumerate() {
        print!("{name:24}");
        for [(elastic, _), (flowing, _)] in &times {
            print!(" {:>8.2} {:>8.2} ({:>5.1})", elastic[k], flowing[k], flowing[k] / elastic[k]);
        }
        println!();
    }
    for (k, name) in ["new history", "pull back to history"].iter().enumerate() {
        print!("{name:24}");
        times.iter().for_each(|[_, (_, memory)]| print!(" {:>8} {:>8.2} {:>7}", "–", memory[k], ""));
        println!();
    }
}

/// The times of force, tangent and pull-back to densities, and of the new history and the pull-back
/// to the previous one, in a step from rest in which all points flow. \[ms\]
fn measure_with_memory(mesh: &Mesh, section: Section) -> ([f64; 3], [f64; 2]) {
    let model = SolidModel::new(mesh, vec![section]).expect("a model");
    let unknowns = 3 * mesh.nodes.len();
    // uniaxial strain, with waves
    let of = |(i, x): (usize, &[f64; 3])| [0.02 * x[0] + 1e-5 * (i as f64 * 1.31).sin(), 0.0, 0.0];
    let d: Vec<f64> = mesh.nodes.iter().enumerate().flat_map(of).collect();
    let lambda: Vec<f64> = (0..unknowns).map(|i| (i as f64 * 0.31).sin()).collect();
    let scalings = vec![ElementScaling::SOLID; model.elements()];
    let slopes = vec![ElementScaling { factor: 1.0, ..ElementScaling::NONE }; model.elements()];
    let before = vec![0.0; model.history()];
    let step = SolidStep { scalings: &scalings, history: &before, stretches: &[] };
    let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
    let scatter = model.scatter(&pattern);
    let mut matrix = BlockMatrix::new(pattern);
    let (mut nodal, mut elemental) = (vec![0.0; unknowns], vec![0.0; model.elements()]);
    let mut history = before.clone();
    model.update_history(&d, step, &mut history).expect("a state");
    let points = history.len() / slipstick_solid::law::HISTORY;
    assert_eq!(model.flowing(&before, &history).len(), points, "every point flows");
    let eta = vec![1.0; history.len()];
    let adjoint = SolidAdjoint { forces: &lambda, history: &eta };
    let common = [
        mean(|| model.internal_force(&d, step, &mut nodal).expect("a state")),
        mean(|| model.add_tangent(&d, step, &scatter, &mut matrix).expect("a state")),
        mean(|| model.pull_back_density(&d, step, &slopes, &lambda, &mut elemental).expect("a state")),
    ];
    let mut out = vec![0.0; history.len()];
    let memory = [
        mean(|| model.update_history(&d, step, &mut history).expect("a state")),
        mean(|| model.pull_back_previous(&d, step, adjoint, &mut out).expect("a state")),
    ];
    (common, memory)
}

fn block(elements: usize) -> Mesh {
    let shape = BoxShape { min: [0.0; 3], max: [1.0, 1.0, 1.0], elements: [elements; 3], grading: [1.2, 1.0, 1.0] };
    box_mesh("block", &shape).expect("a box")
}

/// The shortest time of each operation. \[ms\]
fn measure(mesh: &Mesh, section: Section) -> [f64; 4] {
    let model = SolidModel::new(mesh, vec![section]).expect("a model");
    let unknowns = 3 * mesh.nodes.len();
    let amplitude = 0.05 / ELEMENTS as f64;
    let d: Vec<f64> = (0..unknowns).map(|i| amplitude * (i as f64 * 1.31).sin()).collect();
    let direction: Vec<f64> = (0..unknowns).map(|i| (i as f64 * 0.31).sin()).collect();
    let scalings: Vec<_> =
        (0..model.elements()).map(|e| ElementScaling::stiffness(0.1 + 0.9 * (e as f64).sin().powi(2))).collect();
    let slopes = vec![ElementScaling { factor: 1.0, ..ElementScaling::NONE }; model.elements()];
    let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
    let scatter = model.scatter(&pattern);
    let mut matrix = BlockMatrix::new(pattern);
    let (mut nodal, mut elemental) = (vec![0.0; unknowns], vec![0.0; model.elements()]);
    [
        shortest(|| model.internal_force(&d, &scalings, &mut nodal).expect("a state")),
        shortest(|| model.add_tangent(&d, &scalings, &scatter, &mut matrix).expect("a state")),
        shortest(|| model.add_tangent_product(&d, &scalings, &direction, &mut nodal).expect("a state")),
        shortest(|| model.pull_back_density(&d, &scalings, &slopes, &direction, &mut elemental).expect("a state")),
    ]
}

/// Mean time of the processor. On systems other than Linux, it is the time of the clock. \[ms\]
fn mean(mut work: impl FnMut()) -> f64 {
    let clock = Instant::now();
    let used = || {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
        let nanoseconds = text.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
        nanoseconds.map_or_else(|| 1e3 * clock.elapsed().as_secs_f64(), |time| 1e-6 * time)
    };
    work();
    let (begin, mut repeats) = (used(), 0);
    loop {
        work();
        repeats += 1;
        let time = used() - begin;
        if time > 300.0 {
            return time / f64::from(repeats);
        }
    }
}

fn shortest(mut work: impl FnMut()) -> f64 {
    let one = |_| {
        let clock = Instant::now();
        work();
        1e3 * clock.elapsed().as_secs_f64()
    };
    (0..SAMPLES).map(one).fold(f64::INFINITY, f64::min)
}
