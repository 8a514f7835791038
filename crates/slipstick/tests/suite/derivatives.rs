//! Every derivative of the step's equations compared with central differences (order 4) at generic
//! states: randomly warped bodies, random multipliers and history, open, sticking and slipping
//! nodes, and a slave that extends over the master's edge.

use crate::common::scene::*;
use crate::common::*;
use nalgebra::{Rotation3, Unit, Vector3};
use rayon::prelude::*;
use slipstick::build::Problem;
use slipstick::design::ElementValues;
use slipstick::model::{Design, Step, Workspace};
use slipstick_contact::ContactStatus;
use slipstick_contact::enforcement::lagrange::complementarity;
use slipstick_contact::enforcement::{NodeMeasures, Stiffness, StiffnessScaling};
use slipstick_contact::friction::Friction;
use slipstick_contact::kinematics::slip::missing_share;
use slipstick_path::differences::Comparison;
use slipstick_path::{Evaluated, Held, Inputs, Iteration, StateError, StepProblem, StepState, Unknowns, Wanted};

const FRICTION: f64 = 0.4;
/// Pseudo-time of the state: no load depends on it.
const TIME: f64 = 1.0;
/// Relative to the largest entry of the derivative.
const BOUND: f64 = 1e-8;
/// c_t/c_n if a case specifies them.
const RATIO: f64 = 0.125;

/// c_t/c_n of a method; the augmented Lagrangian has its own.
fn ratio(enforcement: &str) -> f64 {
    if enforcement.contains("augmented") { 1.0 } else { RATIO }
}

fn variants() -> Vec<(String, String, &'static str)> {
    let lagrange = "{ lagrange = { stiffness = { normal = 4e3, tangential = 5e2 } } }";
    let area = "{ penalty = { stiffness = { normal = 4e3, tangential = 5e2 } } }";
    let weighted = "{ penalty = { stiffness = { normal = 3e4, tangential = 4e3 }, scaling = \"weighted\" } }";
    let augmented = "{ augmented = { stiffness = { normal = 3.2e3, tangential = 4e2 } } }";
    let methods = [
        ("Lagrange", lagrange.to_string()),
        ("penalty over area", area.into()),
        ("penalty weighted", weighted.into()),
        ("augmented", augmented.into()),
    ];
    methods
        .iter()
        .flat_map(|(name, e)| ["standard", "dual"].map(|shape| (format!("{name}, {shape}"), e.clone(), shape)))
        .collect()
}

struct Generic {
    ratio: f64,
    problem: Problem,
    density: ElementValues,
    previous: StepState,
    y: Vec<f64>,
    iteration: Iteration,
}

/// A state in which all three statuses occur, from the first suitable one of a few seeds.
fn generic(enforcement: &str, shape: &'static str, held: bool) -> Generic {
    generic_at([0.9, 1.0, 0.37], enforcement, shape, held)
}

/// The same for a given lowest corner of the block.
fn generic_at(corner: [f64; 3], enforcement: &str, shape: &'static str, held: bool) -> Generic {
    let scene = Scene {
        slab: [3, 1, 2],
        block: [2, 1, 2],
        corner,
        friction: FRICTION,
        enforcement: enforcement.into(),
        shape,
        ..Scene::default()
    };
    let mut problem = problem(&scene.text());
    let density = random_density(&problem, 1);
    problem.analysis.set_density(&density);
    let iteration = Iteration { held: if held { Held::All } else { Held::None }, ..Iteration::default() };
    let Unknowns { displacements: split, history, .. } = *problem.analysis.design.unknowns();
    let n = problem.analysis.design.unknowns().count();
    let mut generic = Generic {
        ratio: ratio(enforcement),
        problem,
        density,
        previous: StepState::default(),
        y: Vec::new(),
        iteration,
    };
    for seed in 1..1000 {
        let mut random = Random::new(seed);
        let mut state = || {
            let mut y = random.vector(split, 0.01);
            y.extend((split..n).map(|i| if i % 3 == 0 { random.within(-5.0, 40.0) } else { random.within(-8.0, 8.0) }));
            y
        };
        let (previous, y) = (state(), state());
        generic.previous = StepState { unknowns: previous, history: random.vector(history, 5.0) };
        let statuses = generic.evaluate(&y).active_set;
        let various = ContactStatus::counts(statuses.iter().copied()).iter().all(|&count| count >= 2);
        // far from every switch, so that no difference step crosses one
        let settled = (0..50).all(|_| {
            let mut near = |t: usize, y: f64| y + random.within(-1.0, 1.0) * if t < split { 2e-4 } else { 0.2 };
            let moved: Vec<f64> = y.iter().enumerate().map(|(t, y)| near(t, *y)).collect();
            generic.evaluate(&moved).active_set == statuses
        });
        if various && settled {
            generic.y = y;
            return generic;
        }
    }
    panic!("no seed has open, sticking and slipping nodes");
}

/// Central differences of order 4 of a vector function along coordinate `t` of `at`.
fn difference(at: &[f64], t: usize, h: f64, mut f: impl FnMut(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut value = |s: f64| {
        let mut moved = at.to_vec();
        moved[t] += s * h;
        f(&moved)
    };
    let (p1, m1, p2, m2) = (value(1.0), value(-1.0), value(2.0), value(-2.0));
    (0..p1.len()).map(|i| (8.0 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / (12.0 * h)).collect()
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

impl Generic {
    fn design(&self) -> &Design {
        &self.problem.analysis.design
    }

    fn split(&self) -> usize {
        self.design().unknowns().displacements
    }

    /// The step from the previous state, with derivatives.
    fn step(&self, workspace: &mut Workspace) -> Step {
        let geometry = self.design().geometry(&self.previous.unknowns, Wanted::Derivatives, workspace).unwrap();
        self.design().begin(&self.previous, &geometry, [0.0, TIME].into(), workspace).unwrap()
    }

    /// The equations at `y`, with derivatives.
    fn evaluate(&self, y: &[f64]) -> Evaluated<Design> {
        let mut workspace = Workspace::default();
        let step = self.step(&mut workspace);
        self.design().evaluate(&step, y, None, self.iteration, Wanted::Both, &mut workspace).unwrap()
    }

    fn residual(&self, y: &[f64]) -> Vec<f64> {
        self.evaluate(y).residual
    }

    fn history(&self, y: &[f64]) -> Vec<f64> {
        let mut workspace = Workspace::default();
        self.design().finish(&self.step(&mut workspace), &self.evaluate(y)).unwrap()
    }

    /// The measures of all slave nodes at `y`.
    fn measures(&self, y: &[f64]) -> Vec<NodeMeasures> {
        let contact = self.design().contact_at(&self.previous, y, 1.0.into(), false).unwrap();
        (0..).map_while(|j| contact.measures(j).copied()).collect()
    }

    /// The parameter c_n of every active node, from C_n = c_n (g̃ + k ζ_n).
    fn parameters(&self) -> Vec<f64> {
        let y = self.y.clone();
        let out = self.residual(&y);
        let split = self.split();
        let measures = self.measures(&y);
        measures
            .iter()
            .enumerate()
            .map(|(j, at)| match at.covered() {
                true => out[split + 3 * j] / (at.gap + at.compliance().0 * y[split + 3 * j]),
                false => 0.0,
            })
            .collect()
    }

    /// F with the parameters c held at `parameters`: they only affect the iteration and are not
    /// differentiated.
    fn frozen(&self, y: &[f64], parameters: &[f64], statuses: &[ContactStatus]) -> Vec<f64> {
        let mut out = self.residual(y);
        let split = self.split();
        let measures = self.measures(y);
        for (j, at) in measures.iter().enumerate().filter(|(j, _)| statuses[*j].is_closed()) {
            let zeta = Vector3::from_column_slice(&y[split + 3 * j..][..3]);
            let c = Stiffness {
                normal: parameters[j],
                tangential: self.ratio * parameters[j],
                scaling: StiffnessScaling::Weighted,
            };
            let value = complementarity(zeta, at, Friction::coulomb(FRICTION), &c).value;
            out[split + 3 * j..][..3].copy_from_slice(value.as_slice());
        }
        out
    }
}

fn check_tangent(name: &str, generic: &Generic, with_multipliers: bool) {
    let y = generic.y.clone();
    let split = generic.split();
    let n = if with_multipliers { y.len() } else { split };
    let columns: Vec<Vec<f64>> = {
        let mut workspace = Workspace::default();
        let step = generic.step(&mut workspace);
        let matrix = generic.design().tangent(&step, &generic.evaluate(&y), &mut workspace).unwrap();
        (0..n)
            .map(|t| {
                let (mut unit, mut column) = (vec![0.0; y.len()], vec![0.0; y.len()]);
                unit[t] = 1.0;
                matrix.mul(&unit, &mut column);
                column
            })
            .collect()
    };
    let mut statuses = Vec::new();
    let mut parameters = Vec::new();
    if with_multipliers {
        statuses = generic.evaluate(&y).active_set;
        parameters = generic.parameters();
    }
    // blocks (R, C) × (d, ζ): each relative to its own largest entry
    let mut worst = [[0.0f64; 2]; 2];
    let mut size = [[0.0f64; 2]; 2];
    for (t, column) in columns.iter().enumerate() {
        let h = if t < split { 1e-5 } else { 1e-2 };
        let expected = difference(&y, t, h, |y| match with_multipliers {
            true => generic.frozen(y, &parameters, &statuses),
            false => generic.residual(y),
        });
        for i in 0..n {
            let (r, c) = (usize::from(i >= split), usize::from(t >= split));
            worst[r][c] = worst[r][c].max((column[i] - expected[i]).abs());
            size[r][c] = size[r][c].max(expected[i].abs());
        }
    }
    for r in 0..2 {
        for c in 0..2 {
            if size[r][c] > 0.0 {
                println!("{name}: block {r}{c} {:.1e}", worst[r][c] / size[r][c]);
                assert!(
                    worst[r][c] < BOUND * size[r][c],
                    "{name}: block {r}{c}: {:e} of {:e}",
                    worst[r][c],
                    size[r][c]
                );
            }
        }
    }
}

#[test]
fn tangent_matches_finite_differences() {
    variants().into_par_iter().for_each(|(name, enforcement, shape)| {
        let with_multipliers = !enforcement.contains("penalty");
        check_tangent(&name, &generic(&enforcement, shape, false), with_multipliers);
        if with_multipliers {
            check_tangent(&format!("{name}, held"), &generic(&enforcement, shape, true), false);
        }
    });
}

/// A block extends beyond the slab's edge, and its outermost facets are hardly covered: there the
/// condition is compliant, and its compliance depends on the area.
#[test]
fn tangent_on_slivers_matches_finite_differences() {
    variants().into_par_iter().for_each(|(name, enforcement, shape)| {
        let with_multipliers = !enforcement.contains("penalty");
        for held in [false, true].into_iter().filter(|held| !held || !enforcement.contains("penalty")) {
            let generic = generic_at([-0.32, 1.0, 0.37], &enforcement, shape, held);
            let y = generic.y.clone();
            let measures = generic.measures(&y);
            let active = generic.evaluate(&y).active_set;
            let soft = measures.iter().zip(&active).filter(|(at, a)| a.is_closed() && at.compliance().0 > 0.0).count();
            assert_eq!(soft > 0, with_multipliers, "{name}: {soft} active slivers");
            check_tangent(&format!("{name}, held: {held}"), &generic, with_multipliers && !held);
        }
    });
}

/// The pull-back at generic states, of which some previous rows are slivers, so that both rows measure the slip.
/// `inputs::every_input_is_pulled_back` compares densities and parameters, at converged states: elsewhere,
/// settings of the iteration depend on them.
#[test]
fn pull_back_matches_finite_differences_at_generic_states() {
    variants().into_par_iter().for_each(|(name, enforcement, shape)| {
        check_pull_back(&name, &generic(&enforcement, shape, false));
        let sliver = generic_at([-0.32, 1.0, 0.37], &enforcement, shape, false);
        let (previous, reference) = (sliver.previous.clone(), sliver.measures(&sliver.y.clone()));
        let before = sliver.measures(&previous.unknowns);
        let shares = before.iter().zip(&reference).map(|(b, r)| missing_share(b.area, r.reference_area).0);
        assert!(shares.clone().any(|share| 0.0 < share && share < 1.0), "{name}: {:?}", shares.collect::<Vec<_>>());
        check_pull_back(&format!("{name}, slivers"), &sliver);
    });
}

fn check_pull_back(name: &str, generic: &Generic) {
    let model = generic.design().model();
    let comparison = Comparison {
        problem: &|_: &Inputs| Design::new(model.clone(), &generic.density),
        workspace: &|_: &Design| Workspace::default(),
        span: [0.0, TIME].into(),
        at: Inputs {
            unknowns: generic.y.clone(),
            previous: generic.previous.unknowns.clone(),
            history: generic.previous.history.clone(),
            ..Inputs::default()
        },
        increments: [1e-5, 1e-5, 1e-3, 1e-3, 0.0, 0.0],
        history: Vec::new(),
    };
    for deviation in comparison.deviations().unwrap() {
        println!("{name}: {deviation:?}");
        assert!(deviation.relative() < BOUND, "{name}: {deviation:?}");
    }
}

/// A sticking traction rotates with the bodies: the history's components are preserved under any
/// common rotation of both bodies in a step, including a spin about the contact normal (docs/method, §3).
/// The stiffness multiplies the round-off of the slip.
#[test]
fn sticking_traction_is_kept_under_rotation() {
    for shape in ["standard", "dual"] {
        let soft = "{ penalty = { stiffness = { normal = 4e3, tangential = 1e1 } } }";
        let mut generic = generic(soft, shape, false);
        let coordinates: Vec<f64> = generic.problem.mesh.nodes.iter().flatten().copied().collect();
        let mut previous = generic.previous.clone();
        // well inside the friction cone: pressed together by 0.03, little traction
        for (t, d) in previous.unknowns.iter_mut().enumerate() {
            let on_block = generic.problem.mesh.body("block").unwrap().nodes.contains(&(t / 3));
            if on_block && t % 3 == 1 {
                *d -= 0.03;
            }
        }
        previous.history.iter_mut().for_each(|h| *h *= 0.1);
        generic.previous.clone_from(&previous);
        for (axis, degrees) in [(Vector3::y(), 30.0), (Vector3::y(), 120.0), (Vector3::new(1.0, 0.3, -2.0), 75.0)] {
            let turn = Rotation3::from_axis_angle(&Unit::new_normalize(axis), f64::to_radians(degrees));
            let mut turned = Vec::new();
            for (p, d) in coordinates.chunks_exact(3).zip(previous.unknowns.chunks_exact(3)) {
                let reference = Vector3::new(p[0], p[1], p[2]);
                let moved = turn * (reference + Vector3::new(d[0], d[1], d[2])) - reference;
                turned.extend_from_slice(moved.as_slice());
            }
            let history = generic.history(&turned);
            let statuses = generic.evaluate(&turned).active_set;
            let sticking: Vec<usize> =
                (0..history.len() / 2).filter(|&j| statuses[j] == ContactStatus::Stick).collect();
            assert!(sticking.len() >= 4, "{sticking:?}");
            let scale = largest(previous.history.iter().copied());
            for j in sticking {
                for c in [2 * j, 2 * j + 1] {
                    let error = (history[c] - previous.history[c]).abs() / scale;
                    assert!(error < 1e-13, "{degrees}° node {j}: {error:e}");
                }
            }
        }
    }
}

/// A block that moves as a whole in one step: down through the slab beyond the search radius, or
/// sideways off its edge.
#[test]
fn a_step_beyond_the_search_radius_is_refused() {
    let problem = problem(&Scene::default().text());
    let block = problem.mesh.bodies[1].nodes.clone();
    let (design, mut workspace) = (&problem.analysis.design, Workspace::default());
    let reach = design.model().interfaces()[0].interface.reach();
    let rest = design.model().rest();
    let geometry = design.geometry(&rest.unknowns, Wanted::Residual, &mut workspace).unwrap();
    let step = design.begin(&rest, &geometry, [0.0, TIME].into(), &mut workspace).unwrap();
    let mut after = |u: [f64; 3]| {
        let mut y = rest.unknowns.clone();
        block.clone().for_each(|n| y[3 * n..3 * n + 3].copy_from_slice(&u));
        let wanted = Wanted::Derivatives;
        let at = design.evaluate(&step, &y, None, Iteration::default(), wanted, &mut workspace).unwrap();
        design.finish(&step, &at).map(|_| ())
    };
    assert_eq!(after([0.0, -0.5 * reach, 0.0]), Ok(()));
    assert_eq!(after([10.0 * reach, 0.0, 0.0]), Ok(()));
    let through = -(1.2 + 2.0 * reach);
    match after([0.0, through, 0.0]) {
        Err(StateError::PassedThrough { depth, reach: searched, .. }) => {
            assert!((depth + through).abs() < 1e-12 * depth, "{depth}");
            assert_eq!(searched, reach);
        }
        other => panic!("{other:?}"),
    }
}
