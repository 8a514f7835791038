//! Multi-point constraints as equations and couplings.

use std::collections::BTreeMap;

use super::{CoupledFace, Finder};
use crate::read::{Equation, EquationTerm, Mpc, MpcKind, Target};
use crate::vector::{cross, dot, sub, unit};

/// Components of directions below this are zero.
const NOTHING: f64 = 1e-9;

/// Sine of the angle below which three nodes lie on one line.
const LINE: f64 = 1e-6;

/// Nodes with weights of their displacements.
type Weighted<'a> = &'a [(u32, f64)];

impl Finder<'_> {
    /// The equations of all constraints. Those of rigid beams become couplings.
    pub(super) fn multi_point(&mut self) -> Vec<Equation> {
        let (deck, mut found) = (self.deck, Vec::new());
        let mut beams: BTreeMap<u32, (Vec<u32>, usize)> = BTreeMap::new();
        for mpc in &deck.mpcs {
            let columns: Vec<Vec<u32>> =
                mpc.targets.iter().map(|target| self.own_nodes(target, "MPC", mpc.lines)).collect();
            let nodes = columns.concat();
            if matches!(mpc.kind, MpcKind::Plane | MpcKind::Straight | MpcKind::Slider) {
                self.warn_of_turns(mpc);
            }
            match mpc.kind {
                MpcKind::Plane => self.plane(mpc, &nodes, &mut found),
                MpcKind::Straight => self.straight(mpc, &nodes, &mut found),
                MpcKind::Slider => {
                    let &[first, a, b] = &nodes[..] else {
                        self.miscounted(mpc, "it needs three nodes");
                        continue;
                    };
                    self.straight(mpc, &[a, b, first], &mut found);
                }
                MpcKind::MeanRotation => self.mean_rotation(mpc, &nodes, &mut found),
                MpcKind::Pin | MpcKind::Link => {
                    let [first, second] = &columns[..] else {
                        self.miscounted(mpc, "it needs two nodes, or two sets of equally many");
                        continue;
                    };
                    if first.len() != second.len() && second.len() != 1 {
                        self.miscounted(mpc, "it needs two nodes, or two sets of equally many");
                        continue;
                    }
                    for (at, &p) in first.iter().enumerate() {
                        let q = second[if second.len() == 1 { 0 } else { at }];
                        self.pair(mpc, [p, q], &mut found);
                    }
                }
                MpcKind::Beam => {
                    let Some((&last, first)) = nodes.split_last().filter(|(_, first)| !first.is_empty()) else {
                        self.miscounted(mpc, "it needs two nodes, or a set and a node");
                        continue;
                    };
                    beams.entry(last).or_insert_with(|| (Vec::new(), mpc.lines[0])).0.extend(first);
                }
            }
        }
        for (node, (nodes, line)) in beams {
            self.beam(node, nodes, line);
        }
        found
    }

    /// Warns that planes and lines do not turn with their nodes.
    fn warn_of_turns(&mut self, mpc: &Mpc) {
        let line = mpc.lines[0];
        if self.deck.steps.iter().any(|step| step.nlgeom) {
            let how = "`[[equation]]`: planes and lines of PLANE, STRAIGHT and SLIDER keep the directions of the mesh, \
                       although steps have NLGEOM, so that results are right for small rotations only: where they turn \
                       by an angle φ, a node that slides along them by s errs by s sin φ across them (1 % of s at 0.01 \
                       rad). If they turn more, press the nodes onto a *RIGID BODY, with *CONTACT PAIR without friction";
            self.mesh.notices.push(format!("line {line}: *MPC: {how}"));
            self.ledger.translated("MPC", line, how);
        }
    }

    fn miscounted(&mut self, mpc: &Mpc, why: &str) {
        self.ledger.wrong("MPC", mpc.lines, why, "correct the line");
    }

    fn point_of(&self, node: u32) -> [f64; 3] {
        self.mesh.points[node as usize]
    }

    /// All nodes remain in the plane of the first two and the first that is not on a line with them.
    fn plane(&mut self, mpc: &Mpc, nodes: &[u32], found: &mut Vec<Equation>) {
        let &[a, b, ref rest @ ..] = nodes else {
            return self.miscounted(mpc, "it needs three nodes that define the plane, and others");
        };
        let x = self.point_of(a);
        let first = sub(self.point_of(b), x);
        let beside = |&node: &u32| {
            let second = sub(self.point_of(node), x);
            let across = cross(first, second);
            let size = dot(first, first).sqrt() * dot(second, second).sqrt();
            let normal = unit(across).filter(|_| dot(across, across).sqrt() > LINE * size)?;
            Some((node, second, across, normal))
        };
        let Some((c, second, across, normal)) = rest.iter().find_map(beside) else {
            return self.miscounted(mpc, "its nodes lie on one line and define no plane: name others first");
        };
        for &node in rest.iter().filter(|node| ![a, b, c].contains(node)) {
            let arm = sub(self.point_of(node), x);
            let area = dot(across, normal);
            let (eta, zeta) = (dot(cross(arm, second), normal) / area, dot(cross(first, arm), normal) / area);
            let weights = [(node, 1.0), (a, eta + zeta - 1.0), (b, -eta), (c, -zeta)];
            found.push(self.weighted(mpc, &weights, normal));
        }
    }

    /// All nodes remain on the line through the first two.
    fn straight(&mut self, mpc: &Mpc, nodes: &[u32], found: &mut Vec<Equation>) {
        let &[a, b, ref rest @ ..] = nodes else {
            return self.miscounted(mpc, "it needs two nodes that define the line, and others");
        };
        let along = sub(self.point_of(b), self.point_of(a));
        let Some(unit) = unit(along) else {
            return self.miscounted(mpc, "its first two nodes coincide: name others first");
        };
        let main = (0..3).fold(0, |main, c| if unit[c].abs() > unit[main].abs() { c } else { main });
        for &node in rest.iter().filter(|node| ![a, b].contains(node)) {
            let share = dot(sub(self.point_of(node), self.point_of(a)), along) / dot(along, along);
            let weights = [(node, 1.0), (a, share - 1.0), (b, -share)];
            // two directions across the line, each with a component of its own that the equation determines
            for other in (0..3).filter(|&c| c != main) {
                let mut across = [0.0; 3];
                (across[other], across[main]) = (1.0, -unit[other] / unit[main]);
                found.push(self.weighted(mpc, &weights, across));
            }
        }
    }

    /// Two nodes that stay together, or at the same distance.
    fn pair(&mut self, mpc: &Mpc, [p, q]: [u32; 2], found: &mut Vec<Equation>) {
        let weights = [(p, 1.0), (q, -1.0)];
        if mpc.kind == MpcKind::Pin {
            for component in 0..3 {
                let mut axis = [0.0; 3];
                axis[component] = 1.0;
                found.push(self.weighted(mpc, &weights, axis));
            }
            return;
        }
        if self.deck.steps.iter().any(|step| step.nlgeom) {
            let cure = "use a *SPRING of type SPRINGA, which turns with its ends, 100 times as stiff as the bodies there (Young's \
                        modulus times the size of their elements), or no NLGEOM";
            self.ledger.refuse("MPC", mpc.lines[0], "LINK does not keep the distance at large rotations", cure);
        }
        match unit(sub(self.point_of(p), self.point_of(q))) {
            Some(direction) => found.push(self.weighted(mpc, &weights, direction)),
            None => self.miscounted(mpc, "the nodes coincide: write PIN"),
        }
    }

    /// The mean of the rotations of nodes about an axis through their centre is the first component of the last node,
    /// whose position is the direction a of the axis. For small rotations, with positions p and displacements u relative
    /// to those of the centre,
    ///
    /// ```text
    /// φ = 1/N Σ (a × p)·u/|p − (a·p) a|²
    /// ```
    fn mean_rotation(&mut self, mpc: &Mpc, nodes: &[u32], found: &mut Vec<Equation>) {
        let Some((&last, first)) = nodes.split_last().filter(|(_, first)| !first.is_empty()) else {
            return self.miscounted(mpc, "it needs nodes, and a last one for the rotation and its axis");
        };
        if self.deck.steps.iter().any(|step| step.nlgeom) {
            let cure =
                "write *COUPLING with *DISTRIBUTING, and prescribe the rotation of its reference node, or no NLGEOM";
            self.ledger.refuse("MPC", mpc.lines[0], "MEANROT does not follow large rotations", cure);
        }
        let Some(axis) = unit(self.point_of(last)).filter(|_| self.bodies.of(last).is_none()) else {
            let why = "the last node of MEANROT belongs to no body, and its position is the direction of the axis";
            return self.miscounted(mpc, why);
        };
        // the deck names each node three times
        let mut own = first.to_vec();
        own.sort_unstable();
        own.dedup();
        let count = own.len() as f64;
        let sum = |of: &[[f64; 3]]| of.iter().fold([0.0; 3], |sum, x| std::array::from_fn(|c| sum[c] + x[c]));
        let points: Vec<[f64; 3]> = own.iter().map(|&node| self.point_of(node)).collect();
        let centre = sum(&points).map(|x| x / count);
        let by_displacement = |x: &[f64; 3]| {
            let around = cross(axis, sub(*x, centre));
            let square = dot(around, around);
            let far = square > LINE * LINE * dot(sub(*x, centre), sub(*x, centre));
            if far { around.map(|component| component / (count * square)) } else { [0.0; 3] }
        };
        let slopes: Vec<[f64; 3]> = points.iter().map(by_displacement).collect();
        let mean = sum(&slopes).map(|slope| slope / count);
        let terms = own
            .iter()
            .zip(&slopes)
            .flat_map(|(&node, slope)| (0..3).map(move |c| (node, c, slope[usize::from(c)] - mean[usize::from(c)])));
        let mut terms: Vec<(u32, u8, f64)> = terms.collect();
        let largest = terms.iter().fold(0.0, |largest: f64, term| largest.max(term.2.abs()));
        if largest == 0.0 {
            return self.miscounted(mpc, "all nodes of MEANROT lie on its axis");
        }
        terms.retain(|term| term.2.abs() > NOTHING * largest);
        // the first term is the one that the equation determines
        terms.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        terms.push((last, 0, -1.0));
        let number = |node: u32| Target::Node(self.mesh.point_numbers[node as usize]);
        let term = |(node, component, factor): (u32, u8, f64)| EquationTerm { target: number(node), component, factor };
        let terms = terms.into_iter().map(term).collect();
        found.push(Equation { terms, global: true, lines: mpc.lines });
    }

    /// The weighted sum of displacements has no component along a direction.
    fn weighted(&self, mpc: &Mpc, nodes: Weighted<'_>, direction: [f64; 3]) -> Equation {
        let mut order = [0u8, 1, 2];
        order.sort_by(|&a, &b| direction[usize::from(b)].abs().total_cmp(&direction[usize::from(a)].abs()));
        let term = |&(node, weight): &(u32, f64), component: u8| EquationTerm {
            target: Target::Node(self.mesh.point_numbers[node as usize]),
            component,
            factor: weight * direction[usize::from(component)],
        };
        let terms = nodes.iter().flat_map(|node| order.map(|component| term(node, component)));
        let terms = terms.filter(|term| term.factor.abs() > NOTHING).collect();
        Equation { terms, global: true, lines: mpc.lines }
    }

    /// A kinematic coupling of nodes to a node of no body.
    fn beam(&mut self, node: u32, mut nodes: Vec<u32>, line: usize) {
        nodes.sort_unstable();
        nodes.dedup();
        let body = self.bodies.of(nodes[0]);
        let (Some(body), None, true) = (body, self.bodies.of(node), nodes.iter().all(|&n| self.bodies.of(n) == body))
        else {
            let why = "a beam needs nodes of one body, and then a node of none";
            let cure = "write *COUPLING with *KINEMATIC and a reference node of its own";
            return self.ledger.refuse("MPC", line, why, cure);
        };
        let name = format!("beams_{}", self.mesh.point_numbers[node as usize]);
        self.mesh.node_sets.insert(name.clone(), nodes);
        let (rotation, surface, kinematic, keyword) = (None, name.clone(), true, "MPC");
        self.couplings.push(CoupledFace { node, rotation, name, surface, body, kinematic, keyword, line });
    }
}
