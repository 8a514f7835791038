//! Hertz's contact of a rigid sphere and a block, with three facets over the half-width.

use crate::common::*;
use crate::table::publish;
use slipstick::mesh::{BoxShape, Mesh, box_mesh};
use std::f64::consts::PI;

const YOUNG: f64 = 1000.0;
const POISSON: f64 = 0.3;
/// Radius of the sphere; that of the contact is 1, so that the approach is 1/R.
const RADIUS: f64 = 200.0;
/// Edge of the block, whose far faces are held: displacements there are 0.2 % of the approach.
const SIZE: f64 = 200.0;

/// A box of elements whose nodes are moved from a box [0, 1]³.
fn mapped(name: &str, count: [usize; 3], place: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let shape = BoxShape { min: [0.0; 3], max: [1.0; 3], elements: count, grading: [1.0; 3] };
    let mut mesh = box_mesh(name, &shape).expect("a box");
    mesh.nodes.iter_mut().for_each(|x| *x = place(*x));
    mesh
}

/// Coordinates at multiples of `size`, past the contact, and then with growing distances up to
/// [`SIZE`].
fn ticks(size: f64) -> Vec<f64> {
    let fine = (1.6 / size).ceil() as usize;
    let mut ticks: Vec<f64> = (0..=fine).map(|i| size * i as f64).collect();
    let mut step = size;
    while *ticks.last().unwrap() < SIZE {
        step *= 1.5;
        ticks.push(ticks.last().unwrap() + step);
    }
    let (start, end) = (ticks[fine], *ticks.last().unwrap());
    ticks.iter_mut().skip(fine + 1).for_each(|x| *x = start + (*x - start) * (SIZE - start) / (end - start));
    ticks
}

/// Peak pressure and approach, divided by Hertz's for the same force, of a quarter of a block with
/// `across` contact facets over the half-width under a sphere with facets 0.9 times as large.
fn hertz(order: usize, across: usize, surfaces: &str) -> [f64; 2] {
    let facet = 1.0 / across as f64;
    // a quadratic element has two facets along an edge
    let ticks = ticks(facet * order as f64);
    let count = ticks.len() - 1;
    let at = |x: f64| ticks[(x * count as f64).round() as usize];
    let block = mapped("block", [count; 3], |[x, y, z]| [at(x), -at(1.0 - y), at(z)]);
    let around = (2.0 / (0.9 * facet)).ceil() as usize;
    let width = 0.9 * facet * around as f64;
    let cap = mapped("cap", [around, 1, around], |[x, y, z]| {
        let (x, z) = (width * x, width * z);
        [x, if y > 0.5 { 5.0 } else { RADIUS - (RADIUS * RADIUS - x * x - z * z).sqrt() }, z]
    });
    let approach = 1.0 / RADIUS;
    let text = format!(
        "[[body]]\nname = 'block'\norder = {order}\nmesh = {{ file = 'block' }}\n\
         material = {{ linear_elastic = {{ youngs_modulus = {YOUNG:?}, poisson_ratio = {POISSON:?} }} }}\n\
         [[body]]\nname = 'cap'\nmesh = {{ file = 'cap' }}\nrigid = {{}}\n\
         [[symmetry]]\nnormal = 'x'\n[[symmetry]]\nnormal = 'z'\n\
         [[dirichlet]]\nset = 'cap'\nmotion = [{{ t = 1, u = [0, {:?}, 0] }}]\n\
         [[dirichlet]]\nset = 'block_ymin'\n[[dirichlet]]\nset = 'block_xmax'\n[[dirichlet]]\nset = 'block_zmax'\n\
         [[contact]]\nslave = 'block_ymax'\nmaster = 'cap_ymin'\nfriction = 0\nsurfaces = '{surfaces}'\n\
         [load_path]\nsteps = 1\n",
        -approach
    );
    let mut problem = problem_with(&text, &[("block", block), ("cap", cap)]);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let last = |name: &str| *found.get(name).unwrap_or_else(|| panic!("no {name}")).last().unwrap();
    let (force, peak) = (4.0 * last("block_ymax_force_y").abs(), last("block_ymax_peak_pressure"));
    let modulus = YOUNG / (1.0 - POISSON * POISSON);
    let radius = (0.75 * force * RADIUS / modulus).cbrt();
    [peak / (1.5 * force / (PI * radius * radius)), approach / (radius * radius / RADIUS)]
}

/// Peak pressure within 5 % and approach within 1 %, with three facets of quadratic elements over the
/// half-width.
#[test]
#[ignore = "takes half a minute"]
fn three_facets_over_the_half_width() {
    let [peak, approach] = hertz(2, 3, "smooth");
    assert!((peak - 1.0).abs() < 0.05 && (approach - 1.0).abs() < 0.01, "{peak} {approach}");
}

/// Writes the table of docs/measurements/curved.md into the folder that `SLIPSTICK_TABLES` names.
#[test]
#[ignore = "takes minutes"]
fn table_of_hertz() {
    let mut table = String::from(
        "| elements | facets over a | peak pressure, surfaces | approach, surfaces | peak pressure, facets | approach, \
         facets |\n|---|---|---|---|---|---|\n",
    );
    for (order, across) in [(1, 3), (1, 6), (1, 9), (2, 3), (2, 4)] {
        let name = ["linear", "quadratic"][order - 1];
        table += &format!("| {name} | {across} |");
        for surfaces in ["smooth", "faceted"] {
            let [peak, approach] = hertz(order, across, surfaces);
            table += &format!(" {:+.1} % | {:+.1} % |", 100.0 * (peak - 1.0), 100.0 * (approach - 1.0));
            if surfaces == "smooth" {
                assert!((peak - 1.0).abs() < 0.05, "order {order}, {across} facets: {peak}");
                assert!(order == 1 || (approach - 1.0).abs() < 0.01, "order {order}, {across} facets: {approach}");
            }
        }
        table += "\n";
    }
    publish("hertz", &table);
}
