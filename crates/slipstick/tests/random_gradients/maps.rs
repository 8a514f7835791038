//! Chains of design maps.

use crate::common::Random;
use slipstick::build::Problem;
use slipstick_design::{DensityFilter, DensityMap, PrintedBox, Projection, Ties};
use slipstick_mesh::Body;

use super::problem::{chance, one_of};

/// A chain of maps for the problem of a seed: ties of random elements, a density filter and a
/// projection, and an overhang filter of the bodies, each in some of the problems, but at least one.
pub fn random_map(seed: u64, problem: &Problem) -> DensityMap {
    let mut random = Random::new(!seed);
    let r = &mut random;
    let variables = problem.variables().cloned().expect("a design");
    let centroids = problem.mesh.centroids();
    let centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
    let volumes = variables.domain_volumes(&problem.mesh.element_volumes()).expect("volumes");
    let (radius, sharpness, threshold) = (r.within(0.3, 1.5), r.within(0.5, 6.0), r.within(0.2, 0.8));
    let [filtered, projected, tied, printed] = [0.8, 0.8, 0.5, 0.4].map(|probability| chance(r, probability));
    let filter = DensityFilter::new(&centroids, &volumes, radius).expect("a filter");
    let projection = Projection::new(sharpness, threshold).expect("a projection");
    let mut ties = Ties::new(variables.domain().len());
    for _ in (0..ties.len() / 2).filter(|_| tied) {
        let [a, b] = [r.unit(), r.unit()].map(|at| ((at * ties.len() as f64) as usize).min(ties.len() - 1));
        ties.join(a, b);
    }
    let boxes: Vec<PrintedBox> = problem.mesh.bodies.iter().map(|body| printed_box(r, problem, body)).collect();
    let mut map = DensityMap::new(variables.tied(ties));
    if filtered {
        map = map.filtered(filter);
    }
    if projected || !(filtered || tied || printed) {
        map = map.projected(projection);
    }
    if printed { map.printed(&boxes) } else { map }
}

/// A body as a box of elements, printed in a random direction; the numbers of its elements along the
/// axes follow from their coordinates.
fn printed_box(random: &mut Random, problem: &Problem, body: &Body) -> PrintedBox {
    // in a box, the second element follows the first one along x, as long as they share a face
    let elements = &problem.mesh.elements[body.elements.clone()];
    let shared =
        |a: usize, b: usize| elements[a].nodes().iter().filter(|node| elements[b].nodes().contains(node)).count();
    let along_x = (1..elements.len()).find(|&e| shared(e - 1, e) != 4).unwrap_or(elements.len());
    let rows = elements.len() / along_x;
    let along_y = (1..rows).find(|&row| shared((row - 1) * along_x, row * along_x) != 4).unwrap_or(rows);
    PrintedBox {
        first: body.elements.start as u32,
        cells: [along_x, along_y, rows / along_y],
        axis: one_of(random, &[0, 1, 2]),
        downwards: chance(random, 0.5),
        mirrored: [[false; 2]; 3],
    }
}
