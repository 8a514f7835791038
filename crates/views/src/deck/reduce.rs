//! The solid part of a design: elements above a threshold, in pieces that something holds.

use std::collections::{BTreeSet, HashMap};

use slipstick_case::file::Case;
use slipstick_mesh::{Body, Facet, Mesh, Surface};

/// The solid part of a mesh.
#[derive(Debug, Clone)]
pub struct Reduced {
    /// The remaining elements with their nodes, sets and surfaces.
    pub mesh: Mesh,
    /// Density above which elements remain.
    pub threshold: f64,
    /// Volume of the remaining elements over that of the densities, for the designed bodies.
    pub volume_ratio: f64,
    /// Elements that are left out because nothing holds their pieces: no support, contact or joint.
    pub loose: usize,
    /// Loaded surfaces that lost facets, with the area that is left as a fraction.
    pub loaded: Vec<(String, f64)>,
}

/// The elements of a design with densities above a threshold; by default, as many as have the volume of
/// the densities. Bodies outside of the design remain.
pub fn solid_part(case: &Case, mesh: &Mesh, density: &[f64], threshold: Option<f64>) -> Reduced {
    let names = case.design.as_ref().map_or(&[][..], |design| &design.bodies[..]);
    let mut designed = vec![false; mesh.elements.len()];
    for body in mesh.bodies.iter().filter(|body| names.contains(&body.name)) {
        designed[body.elements.clone()].fill(true);
    }
    let volumes = mesh.element_volumes();
    let own = || (0..mesh.elements.len()).filter(|&e| designed[e]);
    let total: f64 = own().map(|e| density[e] * volumes[e]).sum();
    let threshold = threshold.unwrap_or_else(|| {
        let mut order: Vec<usize> = own().collect();
        order.sort_by(|&a, &b| density[b].total_cmp(&density[a]));
        let mut sum = 0.0;
        let fits = |e: &&usize| {
            sum += volumes[**e];
            sum <= total * (1.0 + 1e-12)
        };
        let kept = order.iter().take_while(fits).last().map_or(1.0, |&e| density[e]);
        // just below the last one that fits
        kept - 1e-9
    });
    let mut keep: Vec<bool> = (0..mesh.elements.len()).map(|e| !designed[e] || density[e] > threshold).collect();
    let before = keep.iter().filter(|keep| **keep).count();
    drop_loose(case, mesh, &designed, &mut keep);
    let loose = before - keep.iter().filter(|keep| **keep).count();
    let left: f64 = own().filter(|&e| keep[e]).map(|e| volumes[e]).sum();
    let volume_ratio = if total > 0.0 { left / total } else { 1.0 };
    let left = restricted(mesh, &keep);
    let loaded = loaded(case, mesh, &left);
    Reduced { mesh: left, threshold, volume_ratio, loose, loaded }
}

/// Loaded surfaces of which a part is left, with the fraction of their area.
fn loaded(case: &Case, mesh: &Mesh, left: &Mesh) -> Vec<(String, f64)> {
    let names: BTreeSet<&String> = case.loads.iter().map(|load| &load.surface).collect();
    let area = |mesh: &Mesh, name: &String| Some(mesh.surface_area(mesh.surfaces.get(name)?));
    let share = |name: &String| Some((name.clone(), area(left, name)? / area(mesh, name)?));
    names.into_iter().filter_map(share).filter(|(_, share)| *share < 1.0 - 1e-9).collect()
}

/// Drops pieces of designed bodies, joined by faces, without a node that the case needs.
fn drop_loose(case: &Case, mesh: &Mesh, designed: &[bool], keep: &mut [bool]) {
    let sets = case.dirichlet.iter().map(|of| &of.set);
    let sets = sets.chain(case.contacts.iter().flat_map(|pair| [&pair.slave, &pair.master]));
    let sets = sets.chain(case.springs.iter().map(|of| &of.set)).chain(case.couplings.iter().map(|of| &of.set));
    let sets = sets.chain(case.equations.iter().flat_map(|of| of.terms.iter().map(|term| &term.set)));
    let mut needed: BTreeSet<u32> = sets.filter_map(|set| mesh.set_nodes(set)).flat_map(|set| set.to_vec()).collect();
    for (axis, symmetry) in case.symmetries.iter().map(|symmetry| (symmetry.normal.index(), symmetry)) {
        let near = |x: &[f64; 3]| (x[axis] - symmetry.at).abs() < 1e-9 * (1.0 + symmetry.at.abs());
        needed.extend((0..mesh.nodes.len() as u32).filter(|&node| near(&mesh.nodes[node as usize])));
    }
    let mut parent: Vec<u32> = (0..mesh.elements.len() as u32).collect();
    fn root(parent: &mut [u32], mut e: u32) -> u32 {
        while parent[e as usize] != e {
            parent[e as usize] = parent[parent[e as usize] as usize];
            e = parent[e as usize];
        }
        e
    }
    let mut faces: HashMap<Vec<u32>, u32> = HashMap::new();
    for e in (0..mesh.elements.len()).filter(|&e| keep[e] && designed[e]) {
        for face in 0..mesh.elements[e].faces() {
            let mut nodes = mesh.elements[e].face(face).to_vec();
            nodes.sort_unstable();
            if let Some(other) = faces.insert(nodes, e as u32) {
                let (a, b) = (root(&mut parent, e as u32), root(&mut parent, other));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let mut held = BTreeSet::new();
    for e in (0..mesh.elements.len()).filter(|&e| keep[e] && designed[e]) {
        if mesh.elements[e].nodes().iter().any(|node| needed.contains(node)) {
            held.insert(root(&mut parent, e as u32));
        }
    }
    for e in (0..mesh.elements.len()).filter(|&e| designed[e]) {
        keep[e] = keep[e] && held.contains(&root(&mut parent, e as u32));
    }
}

/// The mesh with some of its elements, and the nodes that they have; nodes of no element remain.
fn restricted(mesh: &Mesh, keep: &[bool]) -> Mesh {
    let mut of_element = vec![false; mesh.nodes.len()];
    mesh.elements.iter().flat_map(|element| element.nodes()).for_each(|&node| of_element[node as usize] = true);
    let mut used: Vec<bool> = of_element.iter().map(|of| !of).collect();
    let kept = || (0..mesh.elements.len()).filter(|&e| keep[e]);
    kept().flat_map(|e| mesh.elements[e].nodes()).for_each(|&node| used[node as usize] = true);
    let count = |flags: &[bool]| -> Vec<u32> {
        let mut next = 0;
        let mut before = Vec::with_capacity(flags.len() + 1);
        for &flag in flags {
            before.push(next);
            next += u32::from(flag);
        }
        before.push(next);
        before
    };
    let (node, element) = (count(&used), count(keep));
    let range = |of: &[u32], range: &std::ops::Range<usize>| of[range.start] as usize..of[range.end] as usize;
    let numbers = |of: &[u32], flags: &[bool], all: &[u32]| -> Vec<u32> {
        all.iter().filter(|&&n| flags[n as usize]).map(|&n| of[n as usize]).collect()
    };
    let facet = |facet: &Facet| Facet {
        nodes: facet.nodes.map(|n| node[n as usize]),
        element: element[facet.element as usize],
    };
    let surface = |surface: &Surface| Surface {
        facets: surface.facets.iter().filter(|facet| keep[facet.element as usize]).map(facet).collect(),
    };
    let body = |body: &Body| Body {
        name: body.name.clone(),
        elements: range(&element, &body.elements),
        nodes: range(&node, &body.nodes),
    };
    let mut out = Mesh {
        nodes: (0..mesh.nodes.len()).filter(|&n| used[n]).map(|n| mesh.nodes[n]).collect(),
        elements: kept().map(|e| mesh.elements[e].map(|n| node[n as usize])).collect(),
        bodies: mesh.bodies.iter().map(body).collect(),
        node_sets: mesh.node_sets.iter().map(|(name, set)| (name.clone(), numbers(&node, &used, set))).collect(),
        surfaces: mesh.surfaces.iter().map(|(name, of)| (name.clone(), surface(of))).collect(),
        element_sets: mesh
            .element_sets
            .iter()
            .map(|(name, set)| (name.clone(), numbers(&element, keep, set)))
            .collect(),
        rigid: mesh.rigid.clone(),
        couplings: mesh.couplings.clone(),
        cuts: mesh.cuts.clone(),
    };
    out.rigid.iter_mut().for_each(|rigid| rigid.reference = node[rigid.reference as usize]);
    out.couplings.iter_mut().for_each(|coupling| coupling.reference = node[coupling.reference as usize]);
    for cut in &mut out.cuts {
        cut.reference = node[cut.reference as usize];
        cut.sides.iter_mut().for_each(|[e, _]| *e = element[*e as usize]);
        cut.nodes.as_flattened_mut().iter_mut().for_each(|n| *n = node[*n as usize]);
    }
    out
}
