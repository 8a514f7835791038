//! Values over the steps of a deck.

use std::collections::BTreeMap;

use crate::read::{Amplitude, Deck};

/// Waypoints (t, value) in the pseudo-time of the case, linear in between; the value is 0 at t = 0.
pub type Curve = Vec<[f64; 2]>;

/// The steps of a deck in pseudo-time.
pub struct Timeline {
    /// Number of load steps of each step.
    pub counts: Vec<usize>,
}

/// Number of load steps of a step with amplitudes, at least.
const RESOLVED: usize = 10;
/// And of any step, at most.
const MOST: usize = 1000;

impl Timeline {
    pub fn new(deck: &Deck) -> Self {
        let count = |step: &crate::read::Step| {
            let count = ((step.period / step.increment - 1e-6).ceil().max(1.0) as usize).min(MOST);
            let amplitude = |name: &Option<String>| name.is_some();
            let follows = step.conditions.items.iter().any(|c| amplitude(&c.amplitude))
                || step.loads.iter().any(|load| amplitude(&load.amplitude))
                || step.temperatures.iter().any(|of| amplitude(&of.amplitude));
            if follows { count.max(RESOLVED) } else { count }
        };
        Self { counts: deck.steps.iter().map(count).collect() }
    }

    /// Number of load steps of the case.
    pub fn total(&self) -> usize {
        self.counts.iter().sum::<usize>().max(1)
    }

    /// Pseudo-time at load step `j` of step `k`.
    pub fn at(&self, k: usize, j: usize) -> f64 {
        (self.counts[..k.min(self.counts.len())].iter().sum::<usize>() + j) as f64 / self.total() as f64
    }
}

/// A value that steps change.
#[derive(Debug, Clone)]
pub struct Track {
    pub curve: Curve,
    /// The first step that names it, and its line.
    pub first: usize,
    pub line: usize,
    /// The step in which it ends, if `OP=NEW` does not name it again.
    pub ended: Option<usize>,
    /// Whether it ended before, and a later step names it again.
    pub returns: bool,
    /// Whether it keeps what it finds (`FIXED`), and whether a later step moves it all the same.
    pub stays: bool,
    pub moves_on: bool,
    /// The set that the deck names.
    pub set: Option<String>,
    /// At the end of the last step that named it.
    pub current: f64,
}

/// What a step says of a value: terms with their amplitudes.
struct Said<'a> {
    terms: Vec<(f64, Option<&'a Amplitude>)>,
    line: usize,
    set: Option<String>,
    /// Whether it keeps what it has (`FIXED`).
    stays: bool,
}

/// Values by what they belong to, over the steps.
pub struct Tracks<'a, K> {
    timeline: &'a Timeline,
    deck: &'a Deck,
    pub tracks: BTreeMap<K, Track>,
    said: BTreeMap<K, Said<'a>>,
    /// Whether the values of one step add up, rather than replace each other.
    adds: bool,
}

impl<'a, K: Ord + Clone> Tracks<'a, K> {
    pub fn new(timeline: &'a Timeline, deck: &'a Deck, adds: bool) -> Self {
        Self { timeline, deck, tracks: BTreeMap::new(), said: BTreeMap::new(), adds }
    }

    /// Records what the current step says of `key`.
    pub fn say(&mut self, key: K, value: f64, amplitude: Option<&'a Amplitude>, line: usize, set: Option<&str>) {
        let said = self.said.entry(key).or_insert_with(|| Said { terms: vec![], line, set: None, stays: false });
        if !self.adds {
            said.terms.clear();
        }
        said.terms.push((value, amplitude));
        (said.line, said.set, said.stays) = (line, set.map(str::to_owned), false);
    }

    /// Records that the current step keeps what `key` has.
    pub fn keep(&mut self, key: K, line: usize, set: Option<&str>) {
        let said = Said { terms: vec![], line, set: set.map(str::to_owned), stays: true };
        self.said.insert(key, said);
    }

    /// Ends a step. If it `replaces` earlier ones (`OP=NEW`), what it does not name ends.
    pub fn step(&mut self, k: usize, replaces: bool) {
        if replaces {
            for (_, track) in self.tracks.iter_mut().filter(|(key, _)| !self.said.contains_key(key)) {
                track.ended.get_or_insert(k);
                if self.adds && track.current != 0.0 {
                    track.hold(self.timeline.at(k, 0));
                    track.reach(self.timeline.at(k, self.timeline.counts[k]), 0.0);
                }
            }
        }
        let count = self.timeline.counts[k];
        for (key, said) in std::mem::take(&mut self.said) {
            let new = || Track {
                curve: vec![],
                first: k,
                line: said.line,
                ended: None,
                returns: false,
                stays: said.stays,
                moves_on: false,
                set: None,
                current: 0.0,
            };
            let track = self.tracks.entry(key).or_insert_with(new);
            track.returns |= track.ended.is_some();
            track.ended = None;
            if !said.stays || track.first == k {
                track.set = said.set;
            }
            let start = track.current;
            track.moves_on |= track.stays && !said.stays;
            if said.stays {
                continue;
            }
            track.hold(self.timeline.at(k, 0));
            if said.terms.iter().all(|(_, amplitude)| amplitude.is_none()) {
                let end = said.terms.iter().map(|(value, _)| value).sum();
                track.reach(self.timeline.at(k, count), end);
                continue;
            }
            let before: f64 = self.deck.steps[..k].iter().map(|step| step.period).sum();
            for j in 1..=count {
                let share = j as f64 / count as f64;
                let time = share * self.deck.steps[k].period;
                let term = |(value, amplitude): &(f64, Option<&Amplitude>)| match amplitude {
                    Some(amplitude) => value * amplitude.at(if amplitude.total { before + time } else { time }),
                    None => start + share * (value - start),
                };
                track.reach(self.timeline.at(k, j), said.terms.iter().map(term).sum());
            }
        }
    }
}

impl Track {
    /// Keeps the value until `t`.
    fn hold(&mut self, t: f64) {
        if t > 0.0 && self.curve.last().is_none_or(|last| last[0] < t) {
            self.curve.push([t, self.current]);
        }
    }

    fn reach(&mut self, t: f64, value: f64) {
        self.curve.push([t, value]);
        self.current = value;
    }

    /// The curve without waypoints that lie on the line between their neighbours.
    pub fn simple(&self) -> Curve {
        simple(&self.curve)
    }

    /// Whether it begins after the first step, or a later step removes it.
    pub fn is_temporary(&self) -> bool {
        self.first > 0 || self.ended.is_some() || self.returns
    }

    /// The same for a motion. One that begins after the first step moves from where the node is to its first waypoint.
    pub fn motion(&self) -> Curve {
        match &self.curve[..] {
            [_, first, rest @ ..] if self.first > 0 => {
                let shifted = |&[t, value]: &[f64; 2]| [t - first[0], value - first[1]];
                let rest = simple(&rest.iter().map(shifted).collect());
                let back = rest.iter().map(|[t, value]| [t + first[0], value + first[1]]);
                std::iter::once(*first).chain(back).collect()
            }
            _ => self.simple(),
        }
    }
}

/// The value of a curve at a time.
pub fn value_at(curve: &Curve, t: f64) -> f64 {
    let mut last = [0.0, 0.0];
    for &point in curve {
        if point[0] >= t {
            return last[1] + (point[1] - last[1]) * (t - last[0]) / (point[0] - last[0]);
        }
        last = point;
    }
    last[1]
}

fn simple(curve: &Curve) -> Curve {
    let mut kept: Curve = Vec::new();
    let size = curve.iter().fold(0.0, |size: f64, point| size.max(point[1].abs()));
    for (i, point) in curve.iter().enumerate() {
        let last = kept.last().copied().unwrap_or([0.0, 0.0]);
        let straight = curve.get(i + 1).is_some_and(|next| {
            let between = last[1] + (next[1] - last[1]) * (point[0] - last[0]) / (next[0] - last[0]);
            (between - point[1]).abs() <= 1e-12 * size
        });
        // after the last waypoint, the value is constant
        let constant = i + 1 == curve.len() && !kept.is_empty() && last[1] == point[1];
        if !straight && !constant {
            kept.push(*point);
        }
    }
    kept
}

impl Amplitude {
    /// The factor at a time: linear between the points, or a polynomial of degree 5 without slope and curvature at
    /// the points (`SMOOTH STEP`); constant outside.
    pub fn at(&self, time: f64) -> f64 {
        let next = self.points.partition_point(|point| point[0] <= time);
        let point = |at: usize| self.points.get(at).copied();
        match (next.checked_sub(1).and_then(point), point(next)) {
            (Some([t, a]), Some([u, b])) => {
                let x = (time - t) / (u - t);
                let share = if self.smooth { x * x * x * (10.0 - 15.0 * x + 6.0 * x * x) } else { x };
                a + (b - a) * share
            }
            (Some([_, a]), None) | (None, Some([_, a])) => a,
            (None, None) => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::{Change, Step};

    fn deck(periods: &[(f64, f64)]) -> Deck {
        let step = |&(period, increment): &(f64, f64)| Step {
            nlgeom: false,
            period,
            increment,
            conditions: Change { replaces: false, items: vec![] },
            loads: vec![],
            new: vec![],
            temperatures: vec![],
        };
        Deck { steps: periods.iter().map(step).collect(), ..Deck::default() }
    }

    /// Two steps of 2 and 3 load steps: t = 0.4 and 1. A value reaches 1 in the first, stays, and another
    /// one goes on to 4; forces of one step add up.
    #[test]
    fn values_grow_over_steps_and_stay() {
        let deck = deck(&[(1.0, 0.5), (6.0, 2.0)]);
        let timeline = Timeline::new(&deck);
        assert_eq!((timeline.total(), timeline.at(1, 0), timeline.at(1, 3)), (5, 0.4, 1.0));
        let mut tracks = Tracks::new(&timeline, &deck, true);
        tracks.say("stays", 1.0, None, 5, Some("set"));
        tracks.say("goes on", 0.5, None, 6, None);
        tracks.say("goes on", 0.5, None, 7, None);
        tracks.step(0, false);
        tracks.say("goes on", 4.0, None, 8, None);
        tracks.step(1, false);
        assert_eq!(tracks.tracks["stays"].simple(), [[0.4, 1.0]]);
        assert_eq!(tracks.tracks["goes on"].simple(), [[0.4, 1.0], [1.0, 4.0]]);
        let mut ended = Tracks::new(&timeline, &deck, true);
        ended.say("ends", 2.0, None, 5, None);
        ended.step(0, false);
        ended.step(1, true);
        assert_eq!(
            (ended.tracks["ends"].simple(), ended.tracks["ends"].ended),
            (vec![[0.4, 2.0], [1.0, 0.0]], Some(1))
        );
    }

    /// An amplitude with a corner at half of the step, and one in total time.
    #[test]
    fn amplitudes_are_followed() {
        let deck = deck(&[(1.0, 0.1), (2.0, 0.2)]);
        let timeline = Timeline::new(&deck);
        let up_and_down = Amplitude { points: vec![[0.0, 0.0], [0.5, 1.0], [1.0, 0.0]], smooth: false, total: false };
        let total = Amplitude { points: vec![[0.0, 0.0], [3.0, 3.0]], smooth: false, total: true };
        let mut tracks = Tracks::new(&timeline, &deck, false);
        tracks.say(0, 2.0, Some(&up_and_down), 1, None);
        tracks.say(1, 1.0, Some(&total), 1, None);
        tracks.step(0, false);
        tracks.say(1, 1.0, Some(&total), 1, None);
        tracks.step(1, false);
        assert_eq!(tracks.tracks[&0].simple(), [[0.25, 2.0], [0.5, 0.0]]);
        assert_eq!(tracks.tracks[&1].simple(), [[0.5, 1.0], [1.0, 3.0]]);
    }
}
