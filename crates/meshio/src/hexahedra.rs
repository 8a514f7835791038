//! Second-order hexahedra: the order of their nodes, and the missing nodes of those with 20 nodes.

use std::collections::HashMap;

use slipstick_mesh::{Element, HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES};

/// The nodes of a 27-node hexahedron at the centres of its faces, in the order of [`HEX_FACES`],
/// and at its own centre.
const CENTRES: [usize; 7] = {
    let mut out = [26; 7];
    let mut face = 0;
    while face < 6 {
        out[face] = HEX_FACE_CENTRES[face];
        face += 1;
    }
    out
};

/// Positions of the nodes of [`CENTRES`] on the serendipity shape of the first 20 nodes.
pub(crate) fn serendipity_centres(nodes: &[u32], at: impl Fn(u32) -> [f64; 3]) -> [[f64; 3]; 7] {
    let sum = |of: &[usize], c: usize| of.iter().map(|&local| at(nodes[local])[c]).sum::<f64>();
    let combine = |corners: &[usize], middles: &[usize], by_middle: f64| -> [f64; 3] {
        std::array::from_fn(|c| by_middle * sum(middles, c) - 0.25 * sum(corners, c))
    };
    std::array::from_fn(|place| match HEX_FACES.get(place) {
        Some(corners) => {
            let on = |edge: &[usize; 2]| edge.iter().all(|corner| corners.contains(corner));
            let middles: Vec<usize> = (0..12).filter(|&edge| on(&HEX_EDGES[edge])).map(|edge| 8 + edge).collect();
            combine(corners, &middles, 0.5)
        }
        None => combine(&[0, 1, 2, 3, 4, 5, 6, 7], &[8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19], 0.25),
    })
}

/// The nodes of a 27-node hexahedron with the last seven in the order of [`Element::Hex27`].
/// Programs order these differently, so positions decide: each slot gets the node nearest to its
/// position on the serendipity shape of the other 20.
pub(crate) fn in_order(nodes: &[u32], at: impl Fn(u32) -> [f64; 3]) -> [u32; 27] {
    let mut out: [u32; 27] = std::array::from_fn(|i| nodes[i]);
    let mut rest: Vec<u32> = nodes[20..].to_vec();
    for (place, wanted) in CENTRES.into_iter().zip(serendipity_centres(nodes, &at)) {
        let distance = |node: u32| -> f64 { at(node).iter().zip(wanted).map(|(x, y)| (x - y) * (x - y)).sum() };
        let nearest = (0..rest.len()).min_by(|&a, &b| distance(rest[a]).total_cmp(&distance(rest[b])));
        if let Some(nearest) = nearest {
            out[place] = rest.remove(nearest);
        }
    }
    out
}

/// Sorted corners of the faces, in the order of [`HEX_FACES`], and of the element.
pub(crate) fn keys(nodes: &[u32]) -> [Vec<u32>; 7] {
    std::array::from_fn(|place| {
        let mut key = HEX_FACES.get(place).map_or(nodes[..8].to_vec(), |face| face.map(|c| nodes[c]).to_vec());
        key.sort_unstable();
        key
    })
}

/// Second-order hexahedra as elements, from cells of 20 or 27 nodes.
///
/// The last seven of 27 nodes may be in any order. Cells of 20 nodes get nodes at the centres of
/// their faces and at their own centre, on the serendipity shape. These nodes are added to
/// `points`; two cells with a common face share its centre.
///
/// # Panics
/// If a cell has a different number of nodes, or a node without a point.
pub fn second_order_hexahedra(cells: &[&[u32]], points: &mut Vec<[f64; 3]>) -> Vec<Element> {
    let mut centres: HashMap<Vec<u32>, u32> = HashMap::new();
    let mut elements: Vec<[u32; 27]> = Vec::with_capacity(cells.len());
    for nodes in cells {
        assert!([20, 27].contains(&nodes.len()), "hexahedra of second order have 20 or 27 nodes");
        let mut all = [u32::MAX; 27];
        if nodes.len() == 27 {
            all = in_order(nodes, |node| points[node as usize]);
            centres.extend(keys(nodes).into_iter().zip(CENTRES.map(|place| all[place])));
        } else {
            all[..20].copy_from_slice(nodes);
        }
        elements.push(all);
    }
    for (nodes, all) in cells.iter().zip(&mut elements).filter(|(nodes, _)| nodes.len() == 20) {
        let positions = serendipity_centres(nodes, |node| points[node as usize]);
        for ((key, place), position) in keys(nodes).into_iter().zip(CENTRES).zip(positions) {
            all[place] = *centres.entry(key).or_insert_with(|| {
                points.push(position);
                (points.len() - 1) as u32
            });
        }
    }
    elements.into_iter().map(Element::Hex27).collect()
}
