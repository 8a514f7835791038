//! Contact of the case: the tables, and which body is held, which one is driven, and where to.

use std::fmt::Write as _;

use nalgebra::Vector3;

use super::survey::{Face, Pair, Part};
use super::text::{Plan, face_index, main_axis, quoted, rounded};

/// Minimum share of a surface that presses along the motion.
const BEARING: f64 = 0.25;

/// Gaps and overlaps below this fraction of the extent of the bodies are round-off of the geometry.
const CLOSED: f64 = 1e-6;

impl<'a> Plan<'a> {
    /// Chooses the held body, the driven one, and the direction between them, if there are pairs. The largest body
    /// with contact is held. The driven one is the one with the most bodies in between; of several, the largest.
    pub(super) fn roles(&mut self) {
        let (parts, pairs) = (&self.survey.parts, &self.survey.pairs);
        // the largest body comes first
        self.held = pairs.iter().flat_map(|pair| [pair.slave[0], pair.master[0]]).min().unwrap_or(0);
        let mut steps: Vec<Option<usize>> = vec![None; parts.len()];
        steps[self.held] = Some(0);
        for _ in pairs {
            for pair in pairs {
                let [a, b] = [pair.slave[0], pair.master[0]];
                for (from, to) in [(a, b), (b, a)] {
                    if let (Some(count), None) = (steps[from], steps[to]) {
                        steps[to] = Some(count + 1);
                    }
                }
            }
        }
        let reached = (0..parts.len()).filter(|&body| body != self.held && steps[body].is_some());
        let Some(driven) = reached.max_by_key(|&body| (steps[body], parts.len() - body)) else { return };
        self.driven = Some(driven);
        let direct = pairs.iter().find(|pair| pair.has(self.held) && pair.has(driven));
        let outwards = direct.and_then(|pair| {
            let towards = self.face(pair.master).direction() - self.face(pair.slave).direction();
            let sign = if pair.master[0] == self.held { -1.0 } else { 1.0 };
            (sign * towards).try_normalize(0.1)
        });
        if let Some(normal) = outwards {
            self.normal = normal;
            return;
        }
        self.closed = true;
        let towards = self.centre(self.held) - self.centre(driven);
        let by_position = (towards.amax() > 0.05 * self.extent()).then(|| main_axis(towards));
        let axes = [-Vector3::y(), -Vector3::x(), -Vector3::z()];
        let bears = |direction: &Vector3<f64>| self.bearing(driven, direction).next().is_some();
        if let Some(normal) = by_position.into_iter().chain(axes).find(bears) {
            self.normal = normal;
        }
    }

    fn face(&self, [body, face]: [usize; 2]) -> &'a Face {
        &self.survey.parts[body].faces[face]
    }

    /// The pairs of a body that press along a direction.
    fn bearing(&self, body: usize, direction: &Vector3<f64>) -> impl Iterator<Item = &'a Pair> {
        let direction = *direction;
        let pairs = self.survey.pairs.iter().filter(move |pair| pair.has(body));
        let parts = &self.survey.parts;
        pairs.filter(move |pair| parts[pair.slave[0]].faces[pair.slave[1]].bearing(&direction) > BEARING)
    }

    /// Whether contact hinders the driven body from sliding along a direction, as a bolt in a hole.
    pub(super) fn blocked(&self, along: &Vector3<f64>) -> bool {
        let named = |pair: &Pair| pair.reason.is_some();
        self.closed || self.driven.is_some_and(|driven| self.bearing(driven, along).any(named))
    }

    /// The way of the driven body until it presses on the held one.
    pub(super) fn gap(&self, driven: usize) -> f64 {
        if !self.closed {
            let direct = self.survey.pairs.iter().find(|pair| pair.has(self.held) && pair.has(driven));
            return direct.map_or(0.0, |pair| pair.gap[0]);
        }
        // through all bodies in between
        let bearing = |pair: &&Pair| self.face(pair.slave).bearing(&self.normal) > BEARING;
        self.survey.pairs.iter().filter(bearing).map(|pair| pair.gap[1].max(0.0)).sum()
    }

    /// The faces of a body that are in contact.
    pub(super) fn contact_faces(&self, body: usize) -> Vec<&'a Face> {
        let sides = self.survey.pairs.iter().flat_map(|pair| [pair.slave, pair.master]);
        sides.filter(|side| side[0] == body).map(|side| self.face(side)).collect()
    }

    /// Where a body is moved that contact surrounds: at its far side, or at plane faces next to the contact, as the
    /// ends of a pin.
    pub(super) fn driven_sides(&mut self, body: usize) -> Vec<String> {
        let part: &'a Part = &self.survey.parts[body];
        let contact = self.contact_faces(body);
        let free = |face: &&Face| face.selected.is_none() && !contact.iter().any(|other| face.is_within(other));
        let others: Vec<&Face> = part.faces.iter().filter(free).collect();
        let far = |face: &&&Face| face.direction().dot(&self.normal) < -0.5;
        let ends = |face: &&&Face| face.is_plane() && face.direction().dot(&self.normal).abs() < 0.1;
        if others.iter().any(|face| far(&face)) || !others.iter().any(|face| ends(&face)) {
            return vec![self.far_side(body, -self.normal)];
        }
        others.iter().filter(ends).map(|face| face.name.clone()).collect()
    }

    /// All tables `[[contact]]`.
    pub(super) fn contact(&mut self) -> String {
        let survey = self.survey;
        let mut text = String::new();
        for pair in &survey.pairs {
            match pair.reason {
                Some(reason) => self.named_pair(&mut text, pair, reason),
                None => {
                    let gap = rounded(pair.gap[0].max(0.0));
                    let why = format!("These surfaces face each other; their facets come as close as {gap}.");
                    let (slave, master) = (self.use_face(pair.slave), self.use_face(pair.master));
                    guessed(&mut text, &slave, &master, &why);
                }
            }
        }
        if survey.pairs.is_empty() {
            let (slave, master, why) = self.without_pair();
            guessed(&mut text, &slave, &master, &why);
        }
        text
    }

    /// A pair that the mesh names.
    fn named_pair(&self, text: &mut String, pair: &Pair, reason: &str) {
        let (slave, master) = (self.face(pair.slave), self.face(pair.master));
        let size = self.extent();
        let [low, high] = pair.gap.map(|gap| if gap.abs() < CLOSED * size { 0.0 } else { gap });
        let shown = |x: f64| rounded(x.abs());
        let found = match (low < 0.0, high > 0.0) {
            (false, false) => "touch".to_owned(),
            (false, true) if shown(low) == shown(high) => format!("have a gap of {}", shown(low)),
            (false, true) => format!("have a gap of {} to {}", shown(low), shown(high)),
            (true, false) if shown(low) == shown(high) => format!("overlap by {}", shown(low)),
            (true, _) => format!("overlap by up to {}", shown(low)),
        };
        let _ = write!(
            text,
            "\n# {} and {} {found}.\n[[contact]]\nslave = {}   # {reason}\nmaster = {}\nfriction = 0.2   # instead, `tied = \
             true` glues the bodies together\n",
            slave.name,
            master.name,
            quoted(&slave.name),
            quoted(&master.name),
        );
        if low < 0.0 {
            let _ = writeln!(
                text,
                "# a press fit: the overlap, and 1 % for the facets, is pressed apart until t = 0.5\noffset = [{{ t = 0, \
                 offset = {:?} }}, {{ t = 0.5, offset = 0 }}]",
                rounded(1.01 * low)
            );
        }
    }

    /// Slave and master if no surfaces face each other, and the reason for the choice.
    fn without_pair(&mut self) -> (String, String, String) {
        let parts = &self.survey.parts;
        let Some(driven) = self.driven else {
            let master = match self.top() {
                Some(face) => self.use_face([self.held, face_index(&parts[self.held], face)]),
                None => self.skin(self.held, Vector3::y()),
            };
            return (format!("{}_ymin", self.tool()), master, "The block touches the top of the body.".into());
        };
        let (slave, master) = (self.skin(driven, self.normal), self.skin(self.held, -self.normal));
        (
            slave,
            master,
            "No two surfaces face each other; these are the sides of the bodies that point towards each other.".into(),
        )
    }
}

fn guessed(text: &mut String, slave: &str, master: &str, why: &str) {
    let _ = write!(
        text,
        "\n# {why}\n[[contact]]\nslave = {}          # carries the multipliers: the finer or the more curved side\n\
         master = {}\nfriction = 0.2\n",
        quoted(slave),
        quoted(master)
    );
}
