//! Assembly on one and two threads of 30 × 30 × 30 hexahedra, and of six tetrahedra in the place of each, with the same
//! unknowns: `cargo bench -p slipstick-solid`.
//!
//! Throughput counts unknowns: 1 Melem/s is 1 µs per unknown.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_solid::{ElementScaling, NeoHooke, SolidModel};
use std::sync::Arc;

const ELEMENTS: usize = 30;

fn assembly(criterion: &mut Criterion) {
    let shape = BoxShape { min: [0.0; 3], max: [1.0, 1.0, 1.0], elements: [ELEMENTS; 3], grading: [1.2, 1.0, 1.0] };
    let hexahedra = box_mesh("block", &shape).expect("a box");
    let tetrahedra = hexahedra.divided(|_| true);
    for (name, mesh) in [("hexahedra", hexahedra), ("tetrahedra", tetrahedra)] {
        measure(criterion, name, &mesh);
    }
}

fn measure(criterion: &mut Criterion, name: &str, mesh: &Mesh) {
    let model = SolidModel::new(mesh, vec![NeoHooke::new(1000.0, 0.3).expect("a law")]).expect("a model");
    let unknowns = 3 * mesh.nodes.len();
    let amplitude = 0.05 / ELEMENTS as f64;
    let d: Vec<f64> = (0..unknowns).map(|i| amplitude * (i as f64 * 1.31).sin()).collect();
    let direction: Vec<f64> = (0..unknowns).map(|i| (i as f64 * 0.31).sin()).collect();
    let scalings: Vec<_> =
        (0..model.elements()).map(|e| ElementScaling::stiffness(0.1 + 0.9 * (e as f64).sin().powi(2))).collect();
    let slopes = vec![ElementScaling { factor: 1.0, gamma: 0.0 }; model.elements()];
    let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
    let scatter = model.scatter(&pattern);
    let mut matrix = BlockMatrix::new(pattern);
    let (mut nodal, mut elemental) = (vec![0.0; unknowns], vec![0.0; model.elements()]);

    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut group = criterion.benchmark_group(format!("{name}, threads: {threads}"));
        group.throughput(Throughput::Elements(unknowns as u64));
        group.bench_function("internal force", |b| {
            b.iter(|| pool.install(|| model.internal_force(&d, &scalings, &mut nodal)).expect("a state"));
        });
        group.bench_function("tangent", |b| {
            b.iter(|| pool.install(|| model.add_tangent(&d, &scalings, &scatter, &mut matrix)).expect("a state"));
        });
        group.bench_function("tangent product", |b| {
            b.iter(|| {
                let product = || model.add_tangent_product(&d, &scalings, &direction, &mut nodal);
                pool.install(product).expect("a state");
            });
        });
        group.bench_function("pull back to densities", |b| {
            let mut pull_back = || model.pull_back_density(&d, &scalings, &slopes, &direction, &mut elemental);
            b.iter(|| pool.install(&mut pull_back).expect("a state"));
        });
        group.finish();
    }
}

criterion_group!(benches, assembly);
criterion_main!(benches);
