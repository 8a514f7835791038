//! Checks whether the prescribed motions can close the contact pairs at all.
//!
//! Consider a body without loads whose prescribed nodes all follow one rigid motion and leave no
//! rigid motion free. It moves rigidly until it touches something: its elastic energy stays zero.
//! If both bodies of a pair are of this kind, and neither belongs to another pair that may touch,
//! the positions of the pair's surfaces are known along the whole path before anything is solved.
//! Other pairs are not checked: loads, contact elsewhere, free motions and supports that deform a
//! body can close any gap.

use super::bodies::held_motions;
use super::distance::{SurfacePair, largest_difference};
use super::{Notice, NoticeKind};
use crate::construct::Problem;
use crate::file::{Case, Contact, Load};
use nalgebra::{Rotation3, Unit, Vector3};
use slipstick_mesh::{FacetNodes, Mesh};
use slipstick_model::model::LoadTime;
use slipstick_model::words::quantity;

/// Surfaces that come closer than this fraction of the smallest facet may touch.
const NEAR: f64 = 1e-2;

/// Prescribed displacements that differ by less than this fraction of the bodies' size belong to
/// the same rigid motion.
const RIGID: f64 = 1e-9;

/// Number of times within a load step at which distances are computed before the surfaces count as
/// touching.
const LOOKS: usize = 60;

/// A contact pair that no prescribed motion closes.
pub(super) struct Open {
    /// Number of the pair.
    pub pair: usize,
    /// Distance between its surfaces at the start. \[L\]
    gap: f64,
    /// Smallest distance at the end of a load step. \[L\]
    closest: f64,
    /// Largest relative motion of the surfaces. \[L\]
    motion: f64,
}

impl Open {
    /// As a notice.
    pub fn notice(&self, case: &Case) -> Notice {
        let contact = &case.contacts[self.pair];
        let closed = self.gap - self.closest;
        let motion = match self.motion {
            0.0 => "there is no relative motion".into(),
            motion if closed > 1e-9 * self.gap => {
                format!(
                    "the prescribed motions, of up to {}, close at most {} of it",
                    quantity(motion),
                    quantity(closed)
                )
            }
            motion => format!("the prescribed motions, of up to {}, do not reduce it", quantity(motion)),
        };
        Notice {
            kind: NoticeKind::NeverCloses,
            path: format!("contact[{}]", self.pair),
            message: format!(
                "`{}` and `{}` never touch: the initial gap is {}, and {motion}",
                contact.slave,
                contact.master,
                quantity(self.gap)
            ),
            help:
                "move a body with its `place.translate`, make the motion longer or change its direction, or omit the pair"
                    .into(),
        }
    }
}

/// The contact pairs that no prescribed motion closes, in any load case.
pub(super) fn never_closed(case: &Case, problem: &Problem) -> Vec<Open> {
    let mesh = &problem.mesh;
    let surface = |name: &str| -> Option<(Vec<FacetNodes>, usize)> {
        let facets = &mesh.surfaces.get(name)?.facets;
        let body = mesh.body_of_element(facets.first()?.element as usize)?;
        Some((facets.iter().map(|facet| facet.nodes).collect(), body))
    };
    let pairs: Vec<_> = case.contacts.iter().map(|c| Some((surface(&c.slave)?, surface(&c.master)?))).collect();
    let on_mass = |load: &Load, body: usize| {
        load.acts_on_mass() && load.body.as_ref().is_none_or(|name| *name == mesh.bodies[body].name)
    };
    let expands = |body: usize| {
        let name = &mesh.bodies[body].name;
        !case.temperatures.is_empty() && case.bodies.iter().any(|known| known.name == *name && known.expands())
    };
    let loaded: Vec<usize> = case.loads.iter().filter_map(|load| Some(surface(&load.surface)?.1)).collect();
    let fixed = problem.analysis.model().contact_fixed();
    let steady = |body: usize| {
        !loaded.contains(&body)
            && !case.loads.iter().any(|load| on_mass(load, body))
            && !expands(body)
            && mesh.cuts.iter().all(|cut| cut.body != body)
            && held_motions(mesh, mesh.bodies[body].nodes.clone(), fixed) == 6
    };
    let open: Vec<Option<Open>> = pairs
        .iter()
        .enumerate()
        .map(|(pair, surfaces)| {
            let contact = &case.contacts[pair];
            if contact.tied
                || contact.adjust.is_some()
                || !contact.offset.is_empty()
                || contact.active != Contact::ALWAYS
                || contact.enforcement.pressure_law().is_some_and(|law| law.reach() > 0.0)
            {
                return None;
            }
            let ((slave, a), (master, b)) = surfaces.as_ref()?;
            let both = (steady(*a) && steady(*b)).then_some([*a, *b])?;
            let [gap, closest, motion] = approach(case, problem, [slave, master], both)?;
            Some(Open { pair, gap, closest, motion })
        })
        .collect();
    // a body that another pair may press is not known to move rigidly
    let bodies = |pair: usize| pairs[pair].as_ref().map(|((_, a), (_, b))| [*a, *b]);
    let pressed: Vec<usize> =
        (0..pairs.len()).filter(|&pair| open[pair].is_none()).filter_map(bodies).flatten().collect();
    let alone = |open: &Open| bodies(open.pair).is_some_and(|both| both.iter().all(|body| !pressed.contains(body)));
    open.into_iter().flatten().filter(alone).collect()
}

/// Distance between two surfaces at the start, the smallest distance at the end of a load step, and
/// their largest relative motion, as prescribed by the nodes of their bodies; `None` if they touch
/// on the way, or a body deforms or is moved at the start of a load case.
fn approach(case: &Case, problem: &Problem, facets: [&[FacetNodes]; 2], bodies: [usize; 2]) -> Option<[f64; 3]> {
    // the distance at the start would be different in each load case
    if case.load_cases.iter().flat_map(|of| &of.bodies).any(|body| body.offset.is_some() || body.rotation.is_some()) {
        return None;
    }
    let mesh = &problem.mesh;
    let pair = SurfacePair::new(facets);
    let reference: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
    let near = NEAR * pair.smallest_facet(mesh);
    let gap = pair.distance(&reference)?;
    let (mut x, mut last, mut next) = (reference.clone(), reference.clone(), reference.clone());
    let (mut closest, mut known, mut largest) = (gap, gap, 0.0f64);
    let mut prescribed = vec![0.0; reference.len()];
    for &time in &problem.analysis.times {
        let LoadTime { case: load_case, t: own } = time;
        if own <= problem.analysis.times[0].t * (1.0 + 1e-9) {
            // each load case starts at rest
            last.copy_from_slice(&reference);
            known = gap;
        }
        problem.analysis.design_at(time).model().prescribed().apply(time, &mut prescribed);
        for body in bodies {
            let pose = Pose::of(case, problem, body, load_case, own, &prescribed)?;
            mesh.bodies[body]
                .nodes
                .clone()
                .for_each(|n| next[3 * n..][..3].copy_from_slice(&pose.place(mesh.nodes[n])));
        }
        let against =
            |from: &[f64]| largest_difference(pair.displacements(0, from, &next), pair.displacements(1, from, &next));
        largest = largest.max(against(&reference));
        // Surfaces at a distance d with a relative motion m cannot touch during the first d/m of
        // the way.
        let motion = against(&last);
        let (mut way, mut looks) = (0.0, 0);
        loop {
            let rest = (1.0 - way) * motion;
            if known > rest + near {
                known -= rest;
                break;
            }
            x.iter_mut().zip(last.iter().zip(&next)).for_each(|(x, (a, b))| *x = a + way * (b - a));
            let here = pair.distance(&x)?;
            if here <= near || looks == LOOKS {
                return None;
            }
            looks += 1;
            // advance as long as they cannot touch, at most to the end
            let safe = f64::min((here - 0.5 * near) / motion, 1.0 - way);
            let on = if here > rest + near { 0.0 } else { safe };
            (way, known) = (way + on, here - on * motion);
        }
        // `known` is a lower bound: the distance is computed only if it may be the smallest so far
        if known < closest {
            known = pair.distance(&next)?;
            closest = closest.min(known);
        }
        std::mem::swap(&mut last, &mut next);
    }
    Some([gap, closest, largest])
}

/// A rigid motion: x = R (X − p) + p + u.
struct Pose {
    rotation: Rotation3<f64>,
    point: Vector3<f64>,
    shift: Vector3<f64>,
}

impl Pose {
    /// The rigid motion that all prescribed displacements of a body follow at a time of a load
    /// case. The candidates are rest, the motion of one `[[dirichlet]]` table, and a translation;
    /// `None` if none of them fits.
    fn of(
        case: &Case,
        problem: &Problem,
        body: usize,
        load_case: usize,
        time: f64,
        prescribed: &[f64],
    ) -> Option<Self> {
        let mesh = &problem.mesh;
        let model = problem.analysis.model().prescribed();
        let of_body = |unknown: u32| mesh.bodies[body].nodes.contains(&(unknown as usize / 3));
        if model.temporary().iter().any(|support| of_body(support.unknown)) {
            return None;
        }
        let fixed = model.fixed();
        let name = case.load_cases.get(load_case).map(|load_case| &load_case.name);
        let acting = case.dirichlet.iter().filter(|d| d.load_case.is_none() || d.load_case.as_ref() == name);
        let of_table = acting.map(|condition| {
            let ((u, degrees), axis) = (condition.at(time), condition.rotation);
            let turn = axis.map_or_else(Rotation3::identity, |axis| {
                let direction = Unit::new_normalize(Vector3::from(axis.direction));
                Rotation3::from_axis_angle(&direction, degrees.to_radians())
            });
            let point = axis.map_or_else(Vector3::zeros, |axis| axis.point.into());
            Self { rotation: turn, point, shift: u.into() }
        });
        let nodes = || mesh.bodies[body].nodes.clone();
        let component = |c: usize| nodes().find(|n| fixed[3 * n + c]).map(|n| prescribed[3 * n + c]);
        let shift = Vector3::new(component(0)?, component(1)?, component(2)?);
        let still = |shift| Self { rotation: Rotation3::identity(), point: Vector3::zeros(), shift };
        let extent = extent(mesh, nodes());
        let fits = |pose: &Self| {
            nodes().all(|n| {
                let at = pose.place(mesh.nodes[n]);
                (0..3).all(|c| {
                    let off = at[c] - mesh.nodes[n][c] - prescribed[3 * n + c];
                    !fixed[3 * n + c] || off.abs() <= RIGID * (extent + shift.amax())
                })
            })
        };
        [still(Vector3::zeros()), still(shift)].into_iter().chain(of_table).find(fits)
    }

    /// The image of a point of the reference configuration.
    fn place(&self, x: [f64; 3]) -> [f64; 3] {
        (self.rotation * (Vector3::from(x) - self.point) + self.point + self.shift).into()
    }
}

/// Size of a body plus its distance from the origin, the scale of its round-off. \[L\]
fn extent(mesh: &Mesh, nodes: impl Iterator<Item = usize>) -> f64 {
    nodes.flat_map(|n| mesh.nodes[n]).fold(0.0, |size: f64, x| size.max(x.abs()))
}
