//! Supports, motions and loads.

use super::{Writer, quoted, vector};
use crate::history::{Curve, value_at};
use crate::read::{Field, NORMAL};
use crate::targets::Held;

const COMPONENTS: [&str; 6] = ["\"x\"", "\"y\"", "\"z\"", "\"rx\"", "\"ry\"", "\"rz\""];

impl Writer<'_> {
    pub(super) fn motions(&mut self) {
        let targets = self.targets;
        for held in &targets.held {
            for &body in &held.bodies {
                let set =
                    held.set.as_ref().map_or_else(|| self.bodies.list[body].name.clone(), |set| self.on(body, set));
                self.table("dirichlet", "BOUNDARY", held.line);
                self.line(format!("set = {}", quoted(&set)));
                let all = if held.set.is_some() && self.coupled(held.set.as_ref()).is_none() { 3 } else { 6 };
                if held.components.len() < all {
                    let names: Vec<&str> = held.components.iter().map(|(c, _)| COMPONENTS[usize::from(*c)]).collect();
                    self.line(format!("components = [{}]", names.join(", ")));
                }
                if held.from > 0.0 {
                    self.line(format!("from = {:?}", held.from));
                }
                held.until.into_iter().for_each(|until| self.line(format!("until = {until:?}")));
                self.motion(held, body);
            }
        }
    }

    /// The reference node of the coupling with this name.
    fn coupled(&self, name: Option<&String>) -> Option<u32> {
        self.targets.couplings.iter().find(|coupling| Some(&coupling.name) == name).map(|coupling| coupling.node)
    }

    /// The motion and, of a rigid body, its rotation about one axis.
    fn motion(&mut self, held: &Held, body: usize) {
        let moves = |curve: &Curve| curve.iter().any(|point| point[1] != 0.0);
        // without a motion, a support that begins late stays where it is
        let counts = |(_, curve): &&(u8, Curve)| moves(curve) || (held.from > 0.0 && !curve.is_empty());
        let moving: Vec<&(u8, Curve)> = held.components.iter().filter(counts).collect();
        if moving.is_empty() {
            return;
        }
        let turning: Vec<u8> = moving.iter().map(|(component, _)| *component).filter(|&c| c > 2).collect();
        if turning.len() > 1 {
            let cure = "prescribe a rotation about one of the axes x, y and z";
            return self.ledger.refuse("BOUNDARY", held.line, "a rotation about several axes is not supported", cure);
        }
        let rigid = self.bodies.list.get(body).and_then(|body| body.rigid);
        let node = match rigid {
            Some(rigid) => self.bodies.position(self.deck.rigids[rigid].reference),
            None => self.coupled(held.set.as_ref()),
        };
        if let (Some(&axis), Some(_)) = (turning.first(), node) {
            let at = node.map_or([0.0; 3], |node| self.mesh.points[node as usize]);
            let mut direction = [0.0; 3];
            direction[usize::from(axis - 3)] = 1.0;
            self.line(format!("rotation = {{ point = {}, direction = {} }}", vector(&at), vector(&direction)));
        }
        let mut times: Vec<f64> = moving.iter().flat_map(|(_, curve)| curve.iter().map(|point| point[0])).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let waypoint = |&t: &f64| {
            let mut u = [0.0; 3];
            for (component, curve) in moving.iter().filter(|(component, _)| *component < 3) {
                u[usize::from(*component)] = value_at(curve, t);
            }
            let angle =
                moving.iter().find(|(component, _)| *component > 2).map(|(_, curve)| value_at(curve, t).to_degrees());
            let angle = angle.map_or(String::new(), |angle| format!(", angle = {angle:?}"));
            format!("{{ t = {t:?}, u = {}{angle} }}", vector(&u))
        };
        let motion: Vec<String> = times.iter().map(waypoint).collect();
        self.line(format!("motion = [{}]", motion.join(", ")));
    }

    pub(super) fn loads(&mut self) {
        let targets = self.targets;
        // components of one force with the same course are one load
        let mut written = vec![false; targets.forces.len()];
        for (index, force) in targets.forces.iter().enumerate() {
            if written[index] {
                continue;
            }
            let (_, factors) = scaled(&force.curve);
            let moment = force.component > 2;
            let mut vector_of = [0.0; 3];
            for (other, part) in targets.forces.iter().enumerate().skip(index) {
                let (base, course) = scaled(&part.curve);
                let same = (part.component > 2) == moment && part.set == force.set && part.bodies == force.bodies;
                let component = usize::from(part.component % 3);
                if same && course == factors && vector_of[component] == 0.0 && !written[other] {
                    vector_of[component] = base;
                    written[other] = true;
                }
            }
            for &body in &force.bodies {
                let set =
                    force.set.as_ref().map_or_else(|| self.bodies.list[body].name.clone(), |set| self.on(body, set));
                let kind = match (&force.set, moment) {
                    (Some(_), _) if self.coupled(force.set.as_ref()).is_none() => "nodal_force",
                    (_, false) => "force",
                    (_, true) => "moment",
                };
                self.table("load", "CLOAD", force.line);
                self.line(format!("surface = {}\n{kind} = {}", quoted(&set), vector(&vector_of)));
                self.amplitude(&factors);
            }
        }
        for pressure in &targets.pressures {
            let (value, factors) = scaled(&pressure.curve);
            for &body in &pressure.bodies {
                let surface = quoted(&self.on(body, &pressure.surface));
                self.table("load", "DLOAD", pressure.line);
                let kind = match pressure.direction == NORMAL {
                    true => format!("pressure = {value:?}"),
                    false => format!("traction = {}", vector(&pressure.direction.map(|n| value * n))),
                };
                self.line(format!("surface = {surface}\n{kind}"));
                self.amplitude(&factors);
            }
        }
    }

    /// Gravity and rotation.
    pub(super) fn masses(&mut self) {
        let targets = self.targets;
        for load in &targets.masses {
            let (value, factors) = scaled(&load.curve);
            let kind = match load.field {
                Field::Gravity(direction) => format!("gravity = {}", vector(&direction.map(|n| value * n))),
                // the amplitude has the sign of ω²
                Field::Centrifugal(point, direction) => format!(
                    "centrifugal = {{ point = {}, direction = {}, angular_velocity = {:?} }}",
                    vector(&point),
                    vector(&direction),
                    value.abs().sqrt()
                ),
            };
            let negative = matches!(load.field, Field::Centrifugal(..)) && value < 0.0;
            let factors: Curve = factors.iter().map(|&[t, f]| [t, if negative { -f } else { f }]).collect();
            let all = load.bodies.len() == self.bodies.list.len();
            let bodies = load.bodies.iter().map(|&body| self.bodies.list[body].name.clone());
            let bodies: Vec<Option<String>> = if all { vec![None] } else { bodies.map(Some).collect() };
            for body in bodies {
                self.table("load", "DLOAD", load.line);
                body.into_iter().for_each(|body| self.line(format!("body = {}", quoted(&body))));
                self.line(&kind);
                self.amplitude(&factors);
            }
        }
    }

    /// Changes of temperature.
    pub(super) fn heated(&mut self) {
        let targets = self.targets;
        for heated in &targets.heated {
            let (change, factors) = scaled(&heated.curve);
            let all = heated.set.is_none() && heated.bodies.len() == self.bodies.list.len();
            let of = |body: &usize| match &heated.set {
                Some(set) => format!("set = {}\n", quoted(&self.on(*body, set))),
                None => format!("body = {}\n", quoted(&self.bodies.list[*body].name)),
            };
            let places: Vec<String> = if all { vec![String::new()] } else { heated.bodies.iter().map(of).collect() };
            for place in places {
                self.table("temperature", "TEMPERATURE", heated.line);
                self.line(format!("{place}change = {change:?}"));
                self.amplitude(&factors);
            }
        }
    }

    fn amplitude(&mut self, factors: &Curve) {
        if factors[..] != [[1.0, 1.0]] {
            let points = factors.iter().map(|[t, factor]| format!("{{ t = {t:?}, factor = {factor:?} }}"));
            let points = points.collect::<Vec<_>>().join(", ");
            self.line(format!("amplitude = [{points}]"));
        }
    }
}

/// The value of largest magnitude, and the factors on it.
fn scaled(curve: &Curve) -> (f64, Curve) {
    let largest =
        curve.iter().fold(0.0, |largest: f64, [_, value]| if value.abs() > largest.abs() { *value } else { largest });
    (largest, curve.iter().map(|&[t, value]| [t, value / largest + 0.0]).collect())
}
