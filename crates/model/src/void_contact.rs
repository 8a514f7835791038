//! Contact forces on material that a part made from the design will not have.
//!
//! Where a contact surface belongs to void elements, contact acts on them as on solid ones, and their small stiffness
//! carries a part of the force. A part has no such surface. The force of a pair on void is Σ w_k ‖Σ_j b_jk z_j‖ over
//! the points k of a surface, with the share w_k of void in the stiffness Σ E_e A_f of the facets around the point (a
//! node at the rim of solid material presses on the solid); of slave and master, the larger sum counts. Test:
//! `contact_on_void_is_reported` (slipstick/tests/suite/void_contact.rs).

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use slipstick_mesh::{ContactMap, FacetNodes, Mesh, facet_area};

use crate::equations::{ContactModel, ContactResults, Design, NodalContact, point_forces};
use crate::words::quantity;

/// Density below which an element is void.
pub const VOID: f64 = 0.1;

/// Part of a contact force on void above which it is reported.
const COUNTED: f64 = 0.01;

/// Contact forces of a load case below this part of the largest one are not judged.
const ROUND_OFF: f64 = 1e-8;

/// A contact pair whose force acts on void by more than 1 %.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VoidContact {
    /// Number of the pair.
    pub pair: usize,
    /// Names of slave and master.
    pub surfaces: [String; 2],
    /// The load step with the largest force on void, counted through all load cases.
    pub step: usize,
    /// That force. \[F\]
    pub force: f64,
    /// The same as a fraction of the pair's largest contact force in the load case.
    pub fraction: f64,
    /// Point of the surface with most of it.
    pub node: u32,
    /// Its position in the reference configuration. \[L\]
    pub position: [f64; 3],
}

impl fmt::Display for VoidContact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.position.map(quantity);
        write!(
            f,
            "contact of `{}` with `{}` acts on void: in load step {}, a force of {} ({:.1} % of the largest contact \
             force) on elements with a density below {VOID}, most of it at node {}, [{x}, {y}, {z}]",
            self.surfaces[0],
            self.surfaces[1],
            self.step,
            quantity(self.force),
            100.0 * self.fraction,
            self.node,
        )
    }
}

impl VoidContact {
    /// The remedy.
    pub fn help(&self) -> String {
        "a part made from this design has no surface there: keep a solid skin with `design.passive_solid` \
         (`surface`, `within`), or fill the region"
            .into()
    }
}

/// The void at the points of the surfaces of every pair: slave and master.
#[derive(Debug, Default)]
pub(crate) struct VoidSurfaces {
    /// Of each pair.
    shares: Vec<Shares>,
}

/// Of slave and master: by point, the share of void in the stiffness around it, if there is any.
type Shares = [BTreeMap<u32, f64>; 2];

/// The force of a pair on void.
#[derive(Debug, Clone, Copy, Default)]
struct OnVoid {
    force: f64,
    /// All of the surface's. \[F\]
    whole: f64,
    /// The largest part of `force`, and its point.
    worst: (f64, u32),
}

impl VoidSurfaces {
    /// Of a design.
    pub fn of(mesh: &Mesh, design: &Design) -> Self {
        let (model, density) = (&**design.model(), design.density());
        if !model.has_design() {
            return Self::default();
        }
        let points = ContactMap::new(mesh).points(&mesh.nodes);
        let touching = mesh.node_elements();
        let element = |facet: &FacetNodes| {
            let mut nodes = facet.iter().map(|&node| touching.of(node as usize));
            let first = nodes.next().unwrap_or_default();
            let others: Vec<&[u32]> = nodes.collect();
            first.iter().copied().find(|element| others.iter().all(|of| of.contains(element)))
        };
        let side = |facets: &[FacetNodes]| {
            let mut around: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
            for (facet, element) in facets.iter().filter_map(|facet| Some((facet, element(facet)?))) {
                let stiffness = model.modulus(element, design.scalings()) * facet_area(&facet.corners(&points));
                let void = model.is_designed(element) && density[element as usize] < VOID;
                for &node in facet.iter() {
                    let [of_void, all] = around.entry(node).or_default();
                    (*of_void, *all) = (*of_void + if void { stiffness } else { 0.0 }, *all + stiffness);
                }
            }
            around
                .into_iter()
                .filter(|(_, [void, _])| *void > 0.0)
                .map(|(node, [void, all])| (node, void / all))
                .collect()
        };
        let shares = model.interfaces().iter().map(|pair| {
            let interface = &pair.interface;
            if pair.is_bonded() {
                return Shares::default();
            }
            [side(interface.slave_facets()), side(interface.master_facets())]
        });
        Self { shares: shares.collect() }
    }

    /// The force of each pair on void. \[F\]
    pub fn forces(&self, model: &ContactModel, contact: &ContactResults) -> Vec<f64> {
        self.on_void(model, contact).into_iter().map(|of| of.force).collect()
    }

    fn on_void(&self, model: &ContactModel, contact: &ContactResults) -> Vec<OnVoid> {
        let of = |own: bool, shares: &Shares, nodes: &[NodalContact], rows: &[Vec<(u32, f64)>]| {
            if shares.iter().all(BTreeMap::is_empty) {
                return OnVoid::default();
            }
            let forces = point_forces(nodes, rows);
            let size = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
            // both surfaces together carry the force twice
            let whole = 0.5 * forces.values().map(size).sum::<f64>();
            let side = |shares: &BTreeMap<u32, f64>| {
                let points: Vec<(f64, u32)> =
                    shares.iter().filter_map(|(k, share)| Some((share * size(forces.get(k)?), *k))).collect();
                let worst = points.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
                let force: f64 = points.iter().map(|(force, _)| force).sum();
                // a surface that touches itself is both sides
                OnVoid { force: if own { 0.5 * force } else { force }, whole, worst }
            };
            let [slave, master] = [side(&shares[0]), side(&shares[1])];
            if slave.force >= master.force { slave } else { master }
        };
        let pairs = model.by_pair(&contact.nodes).zip(model.by_pair(&contact.transfer));
        let own = model.interfaces().iter().map(|pair| pair.interface.is_with_itself());
        let all = self.shares.iter().zip(own).zip(pairs);
        all.map(|((shares, own), (nodes, rows))| of(own, shares, nodes, rows)).collect()
    }
}

/// The largest forces on void so far.
#[derive(Debug, Default)]
pub(crate) struct VoidContacts {
    /// Of each pair in the load case in progress.
    case: Vec<Worst>,
    /// Of each pair in the load case whose force acts on void by the largest part.
    worst: Vec<Worst>,
    /// The largest contact force of all load cases. \[F\]
    largest: f64,
}

/// The largest force on void in a load case, its load step, and the largest contact force of the pair.
#[derive(Debug, Clone, Copy, Default)]
struct Worst {
    on_void: OnVoid,
    step: usize,
    /// \[F\]
    largest: f64,
}

impl Worst {
    fn fraction(&self) -> f64 {
        if self.largest > 0.0 { self.on_void.force / self.largest } else { 0.0 }
    }
}

impl VoidContacts {
    /// Adds the end of a load step.
    pub fn add(&mut self, void: &VoidSurfaces, model: &ContactModel, step: usize, contact: &ContactResults) {
        let found = void.on_void(model, contact);
        self.case.resize(found.len(), Worst::default());
        for (known, now) in self.case.iter_mut().zip(found) {
            known.largest = known.largest.max(now.whole);
            self.largest = self.largest.max(now.whole);
            if now.force > known.on_void.force {
                (known.on_void, known.step) = (now, step);
            }
        }
    }

    /// Ends a load case: of each pair, the case with the larger fraction stays, unless its forces are round-off.
    pub fn end_case(&mut self) {
        let case = std::mem::take(&mut self.case);
        self.worst.resize(self.worst.len().max(case.len()), Worst::default());
        for (worst, case) in self.worst.iter_mut().zip(case) {
            if case.fraction() > worst.fraction() && case.largest > ROUND_OFF * self.largest {
                *worst = case;
            }
        }
    }

    /// Pairs for which it is more than 1 % of the largest contact force of a load case.
    pub fn reported(self, model: &ContactModel, reference: &[[f64; 3]]) -> Vec<VoidContact> {
        let pairs = model.interfaces().iter().zip(self.worst).enumerate();
        let found = pairs.filter(|(_, (_, worst))| worst.fraction() > COUNTED);
        found
            .map(|(pair, (interface, worst))| {
                let OnVoid { force, worst: (_, node), .. } = worst.on_void;
                let (surfaces, fraction) = (interface.surfaces.clone(), worst.fraction());
                let position = reference.get(node as usize).copied().unwrap_or_default();
                VoidContact { pair, surfaces, step: worst.step, force, fraction, node, position }
            })
            .collect()
    }
}
