//! Partition of a mesh's elements into parts of about equal work with few connections between them.

use slipstick_mesh::{FacetTree, Mesh, Surface};
use std::collections::BTreeMap;

/// Work on a slave facet, relative to that on an element. According to the times of
/// `slipstick bench` it is between about 30, if most facets are open, and 70, if all are closed.
/// But elements also take memory: if one rank has few elements, the others have more.
const CONTACT_WORK: i32 = 12;

/// Weight of the graph's edge between elements that face each other in contact; the weight between
/// neighbours is their number of common nodes, 3 or 4.
const CONTACT_TIE: i32 = 8;

/// The part, of `parts`, to which each element belongs; `pairs` are the names of slave and master
/// surfaces.
///
/// Uses METIS on the graph of elements with a common face. Elements that face each other at the
/// start are also connected, so that few contact pairs are split between ranks.
pub(in crate::equations) fn partition(mesh: &Mesh, pairs: &[(&str, &str)], parts: usize) -> Vec<u32> {
    let mut edges = neighbours(mesh);
    let mut weights = vec![1; mesh.elements.len()];
    for (slave, master) in pairs {
        if let (Some(slave), Some(master)) = (mesh.surfaces.get(*slave), mesh.surfaces.get(*master)) {
            slave.facets.iter().for_each(|facet| weights[facet.element as usize] += CONTACT_WORK);
            tie(mesh, slave, master, &mut edges);
        }
    }
    let mut graph = Graph { offsets: vec![0], ..Graph::default() };
    for row in &edges {
        graph.neighbours.extend(row.keys().map(|&e| e as i32));
        graph.ties.extend(row.values());
        graph.offsets.push(graph.neighbours.len() as i32);
    }
    let found = cut(graph, weights, parts);
    // without METIS, or if it fails: slices in the order of the mesh
    found.unwrap_or_else(|| (0..mesh.elements.len()).map(|e| (e * parts / mesh.elements.len()) as u32).collect())
}

/// A symmetric graph without loops, as METIS expects it.
#[derive(Default)]
struct Graph {
    offsets: Vec<i32>,
    neighbours: Vec<i32>,
    ties: Vec<i32>,
}

#[cfg(feature = "metis")]
fn cut(graph: Graph, weights: Vec<i32>, parts: usize) -> Option<Vec<u32>> {
    slipstick_linalg::partition_graph(graph.offsets, graph.neighbours, weights, graph.ties, parts).ok()
}

#[cfg(not(feature = "metis"))]
fn cut(_: Graph, _: Vec<i32>, _: usize) -> Option<Vec<u32>> {
    None
}

/// For every element, the elements that share a face with it, and the number of common nodes.
fn neighbours(mesh: &Mesh) -> Vec<BTreeMap<u32, i32>> {
    let around = mesh.node_elements();
    let of = |(element, own): (usize, &slipstick_mesh::Element)| {
        let mut common = BTreeMap::new();
        for &other in own.nodes().iter().flat_map(|&node| around.of(node as usize)) {
            *common.entry(other).or_insert(0) += 1;
        }
        common.retain(|&other, nodes| other as usize != element && *nodes >= 3);
        common
    };
    mesh.elements.iter().enumerate().map(of).collect()
}

/// Connects the elements of slave facets with those of master facets within a facet's size.
fn tie(mesh: &Mesh, slave: &Surface, master: &Surface, edges: &mut [BTreeMap<u32, i32>]) {
    let coordinates: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
    let facets: Vec<_> = master.facets.iter().map(|facet| facet.nodes).collect();
    let tree = FacetTree::build(&facets, &coordinates);
    let mut hits = Vec::new();
    for facet in &slave.facets {
        let corners = facet.nodes.iter().map(|&n| mesh.nodes[n as usize]);
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in corners {
            for c in 0..3 {
                low[c] = low[c].min(corner[c]);
                high[c] = high[c].max(corner[c]);
            }
        }
        let size = (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max);
        hits.clear();
        tree.query(low.map(|l| l - 0.5 * size), high.map(|h| h + 0.5 * size), &mut hits);
        for &hit in &hits {
            let (a, b) = (facet.element, master.facets[hit as usize].element);
            if a != b {
                edges[a as usize].insert(b, CONTACT_TIE);
                edges[b as usize].insert(a, CONTACT_TIE);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// Parts of a bar are of about the same size, and each is in one piece with few cut faces.
    #[test]
    fn parts_are_balanced_and_compact() {
        let shape = BoxShape { min: [0.0; 3], max: [12.0, 2.0, 2.0], elements: [24, 4, 4], grading: [1.0; 3] };
        let mesh = box_mesh("bar", &shape).unwrap();
        for parts in [1, 2, 3, 4] {
            let of = partition(&mesh, &[], parts);
            assert_eq!(of.len(), mesh.elements.len());
            for part in 0..parts as u32 {
                let size = of.iter().filter(|&&p| p == part).count() as f64;
                assert!((size * parts as f64 / of.len() as f64 - 1.0).abs() < 0.1, "{parts} parts, {size}");
            }
            let edges = neighbours(&mesh);
            let cut = |e: usize| edges[e].keys().filter(|&&o| of[o as usize] != of[e]).count();
            let faces: usize = (0..of.len()).map(cut).sum::<usize>() / 2;
            // a plane across the bar cuts 16 faces
            assert!(faces <= 24 * (parts - 1), "{parts} parts, {faces} faces");
        }
    }

    /// Two bars that touch along their length: each part contains a half of both, with the elements
    /// on both sides of the contact.
    #[test]
    fn what_touches_stays_together() {
        let bar = |name: &str, low: f64| {
            let (min, max) = ([0.0, low, 0.0], [12.0, low + 2.0, 2.0]);
            box_mesh(name, &BoxShape { min, max, elements: [24, 4, 4], grading: [1.0; 3] }).unwrap()
        };
        let mesh = Mesh::merge(vec![bar("lower", 0.0), bar("upper", 2.0)]).unwrap();
        let of = partition(&mesh, &[("upper_ymin", "lower_ymax")], 2);
        let centroids = mesh.centroids();
        let elements = |name: &str| mesh.surfaces[name].facets.iter().map(|facet| facet.element as usize);
        let mut apart = 0;
        for above in elements("upper_ymin") {
            let opposite = |&e: &usize| [0, 2].iter().all(|&c| (centroids[e][c] - centroids[above][c]).abs() < 0.1);
            let below = elements("lower_ymax").find(opposite).unwrap();
            apart += usize::from(of[above] != of[below]);
        }
        assert!(apart <= 4, "{apart} of 96 pairs are split between ranks");
        for part in [0, 1] {
            assert!(elements("upper_ymin").filter(|&e| of[e] == part).count() > 38, "contact is work for both");
        }
    }
}
