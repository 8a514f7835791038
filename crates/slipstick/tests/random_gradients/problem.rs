//! Random small contact problems: a block of 2 to 16 elements over a slab of 2 to 16 elements,
//! anywhere in space.

use std::fmt::Write as _;

use nalgebra::{Rotation3, Unit, Vector3};
use slipstick::build::Problem;
use slipstick::case::LawKind;
use slipstick::design::ElementValues;
use slipstick::quantities::SpringForce;
use std::sync::Arc;

use slipstick_design::quantity::{PlasticStrain, Reaction};
use slipstick_design::{ObservedSteps, Reduction, Response, Term, VectorMeasure};
use slipstick_mesh::{BoxShape, box_mesh};

use super::bodies::{FIRST_OF_PLASTIC, FIRST_OF_RIGID, with_plastic_bodies, with_rigid_block};
use super::connections::{FIRST_OF_BOLTS, FIRST_OF_EQUATIONS, FIRST_OF_SPRINGS, bolt, equations, springs};
use super::curved::{FIRST_OF_CURVED, curved_problem};
use super::fields::{has_fields, with_fields};
use super::supports::{FIRST_OF_SUPPORTS, supports};
use crate::common::quantities::every_quantity;
use crate::common::{Random, designed, problem, problem_with};

/// A problem to differentiate, generated from its seed.
pub struct RandomProblem {
    /// The case's text, to reproduce the problem.
    pub text: String,
    /// Enforcement method.
    pub method: &'static str,
    /// Objective.
    pub objective: String,
    /// Densities of all elements.
    pub density: ElementValues,
    /// Elements that may vary.
    pub designed: Vec<u32>,
    /// The built case.
    pub problem: Problem,
}

pub fn one_of<T: Copy>(random: &mut Random, all: &[T]) -> T {
    all[((random.unit() * all.len() as f64) as usize).min(all.len() - 1)]
}

pub fn chance(random: &mut Random, probability: f64) -> bool {
    random.unit() < probability
}

/// Numbers of elements with a product of 2 to 16.
fn elements(random: &mut Random) -> [usize; 3] {
    loop {
        let [x, y, z] = [1, 2, 4].map(|_| 1 + (random.unit() * 4.0) as usize);
        if (2..=16).contains(&(x * y * z)) {
            return [x, y, z];
        }
    }
}

pub fn direction(random: &mut Random) -> Unit<Vector3<f64>> {
    loop {
        let v = Vector3::from_iterator(random.vector(3, 1.0));
        if (0.1..1.0).contains(&v.norm()) {
            return Unit::new_normalize(v);
        }
    }
}

pub fn place(rotation: &Rotation3<f64>, translate: Vector3<f64>) -> String {
    let (axis, angle) =
        rotation.axis_angle().map_or(([0.0, 1.0, 0.0], 0.0), |(axis, angle)| (axis.into_inner().into(), angle));
    let translate: [f64; 3] = translate.into();
    format!("{{ rotate = {{ axis = {axis:?}, degrees = {:?} }}, translate = {translate:?} }}", angle.to_degrees())
}

/// `others`: of any law for finite strains.
fn body(random: &mut Random, name: &str, size: [f64; 3], place: &str, others: bool) -> String {
    let law = match (chance(random, 0.6), others) {
        (true, _) => LawKind::NeoHooke,
        (false, false) => LawKind::StVenantKirchhoff,
        (false, true) => one_of(random, &other_laws()),
    };
    let f_bar = chance(random, 0.3);
    let poisson = random.within(0.0, if f_bar { 0.48 } else { 0.4 });
    let grading = [1.0, 1.0, 1.0].map(|one: f64| if chance(random, 0.3) { random.within(0.5, 2.0) } else { one });
    let max = size;
    format!(
        "[[body]]\nname = \"{name}\"\nbox = {{ min = [0, 0, 0], max = {max:?}, elements = {:?}, grading = {grading:?} }}\n\
         place = {place}\nmaterial = {}\n\
         element = \"{}\"\n",
        elements(random),
        law.like(random.within(500.0, 2000.0), poisson).expect("constants"),
        if f_bar { "f_bar" } else { "full" },
    )
}

/// All elastic laws for finite strains except the forms of neo-Hooke.
fn other_laws() -> Vec<LawKind> {
    let finite = |law: &LawKind| law.word() != LawKind::NeoHooke.word() && *law != LawKind::LinearElastic;
    LawKind::ALL.iter().copied().filter(|law| finite(law) && !law.has_memory()).collect()
}

pub fn enforcement(random: &mut Random) -> (&'static str, String) {
    let method = one_of(random, &["Lagrange", "penalty", "augmented"]);
    let own = chance(random, 0.5);
    let stiffness = random.within(5e3, 4e4);
    let given = if own { format!("stiffness = {stiffness:?}") } else { String::new() };
    let text = match method {
        "Lagrange" => "{ lagrange = {} }".to_owned(),
        "penalty" => format!("{{ penalty = {{ {given} }} }}"),
        _ => format!("{{ augmented = {{ {given}{} max_uzawa = 100 }} }}", if own { "," } else { "" }),
    };
    (method, text)
}

/// Problems from this seed on are those of quantities with pressures that are not in proportion to the penetration.
pub const FIRST_OF_SOFT: u64 = 20_000;

/// The penalty method with such a pressure.
fn soft(random: &mut Random) -> String {
    let stiffness = random.within(5e3, 4e4);
    let law = match chance(random, 0.5) {
        true => {
            let (pressure, clearance) = (random.within(5.0, 50.0), random.within(0.01, 0.05));
            format!("exponential = {{ contact_pressure = {pressure:?}, clearance = {clearance:?} }}")
        }
        false => {
            let (first, last) = (random.within(5.0, 50.0), random.within(100.0, 500.0));
            format!("table = {{ penetration = [-0.01, 0.01, 0.05], pressure = [0, {first:?}, {last:?}] }}")
        }
    };
    format!("{{ penalty = {{ pressure = {{ {law} }}, stiffness = {stiffness:?} }} }}")
}

/// Waypoints of the block's top in the frame of the slab: pressed down, moved along, perhaps lifted
/// or turned.
fn motion(random: &mut Random, turn: &Rotation3<f64>, gap: f64) -> String {
    let depth = gap + random.within(0.02, 0.1);
    let along = one_of(random, &[0.0, 0.05, 0.3]);
    let mut points = vec![(0.4, Vector3::new(0.0, -depth, 0.0))];
    let end =
        Vector3::new(random.within(-along, along), -depth * random.within(0.7, 1.3), random.within(-along, along));
    if chance(random, 0.15) {
        points.push((0.6, Vector3::new(0.3 * end.x, random.within(0.0, 0.05), 0.3 * end.z)));
    }
    points.push((1.0, end));
    let degrees = if chance(random, 0.3) { random.within(-6.0, 6.0) } else { 0.0 };
    let mut text = String::from("[");
    for (t, u) in points {
        let u: [f64; 3] = (turn * u).into();
        let _ = write!(text, "{{ t = {t}, u = {u:?}, angle = {:?} }}, ", degrees * t);
    }
    text + "]"
}

/// Problems from this seed on have an objective that is drawn from all quantities.
pub const FIRST_OF_QUANTITIES: u64 = 1050;

/// Problems from this seed on have load cases that differ in friction, moduli, motions and positions.
pub const FIRST_OF_SCENARIOS: u64 = 2050;

/// Problems from this seed on have pairs that are tied, have an offset or a largest shear stress, or
/// act during a part of the load path, bodies of any law, and an objective that is drawn from all
/// quantities.
pub const FIRST_OF_JOINTS: u64 = 3000;

fn joined(seed: u64) -> bool {
    (FIRST_OF_JOINTS..FIRST_OF_QUADRATIC).contains(&seed)
}

/// The keys of the pair of a problem with joints.
fn joint(seed: u64, friction: &str, enforcement: &str) -> String {
    let mut random = Random::new(!seed ^ 0x5bd1);
    let r = &mut random;
    if chance(r, 0.3) {
        return "tied = true\n".to_owned();
    }
    let mut keys = format!("{friction}enforcement = {enforcement}\n");
    let [limited, offset, part] = [0.6, 0.6, 0.4].map(|probability| chance(r, probability));
    if limited {
        let _ = writeln!(keys, "shear_limit = {:?}", r.within(1.0, 60.0));
    }
    if offset {
        let [start, middle, end] = [0.01, 0.04, 0.02].map(|size| r.within(-0.5 * size, size));
        let points = [(0.0, start), (0.5, middle), (1.0, end)].map(|(t, d)| format!("{{ t = {t:?}, offset = {d:?} }}"));
        let _ = writeln!(keys, "offset = [{}]", points.join(", "));
    }
    if part || !(limited || offset) {
        let _ = writeln!(keys, "active = [{:?}, {:?}]", r.within(0.0, 0.3), r.within(0.7, 1.0));
    }
    keys
}

/// Problems from this seed on have quadratic elements in one or both bodies, with few elements.
pub const FIRST_OF_QUADRATIC: u64 = 5000;

/// What the hexahedra of a body become.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Hex8,
    Hex27,
    Wedge18,
    Tet10,
}

/// The problem of a text whose bodies have quadratic elements: the boxes are replaced by meshes, with
/// nodes between the corners moved inside the bodies.
fn quadratic(random: &mut Random, text: &str) -> Problem {
    let mut kinds = [Kind::Hex8; 2];
    while kinds == [Kind::Hex8; 2] {
        kinds = [0, 1].map(|_| one_of(random, &[Kind::Hex8, Kind::Hex27, Kind::Wedge18, Kind::Tet10]));
    }
    let case = slipstick::case::parse_case(text, "random.toml").expect("a case").case;
    let mut text = text.to_owned();
    let mut meshes = Vec::new();
    for ((body, kind), size) in case.bodies.iter().zip(kinds).zip([0.03, 0.03]) {
        let slipstick::case::Shape::Box { min, max, elements, grading } = body.shape else { unreachable!("a box") };
        let elements = elements.map(|n| n.min(2));
        let shape = BoxShape { min, max, elements, grading };
        let mesh = box_mesh(&body.name, &shape).expect("a box");
        let bent = |of: &[[f64; 3]]| -> [f64; 3] {
            let mean: [f64; 3] = std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64);
            let inside = (0..3).all(|c| mean[c] > min[c] + 1e-9 && mean[c] < max[c] - 1e-9);
            std::array::from_fn(|c| {
                mean[c] + if inside { size * (9.0 * mean[c] + mean[(c + 1) % 3]).sin() } else { 0.0 }
            })
        };
        let mesh = match kind {
            Kind::Hex8 => mesh,
            Kind::Hex27 => mesh.second_order(bent).expect("hexahedra"),
            Kind::Wedge18 => {
                let along = one_of(random, &[0, 1, 2]);
                mesh.divided_into_wedges(|_| Some(along)).second_order(bent).expect("wedges")
            }
            Kind::Tet10 => mesh.divided(|_| true).second_order(bent).expect("tetrahedra"),
        };
        let start = text.find(&format!("name = \"{}\"\nbox", body.name)).expect("a body");
        let start = start + text[start..].find("box").expect("a box");
        let end = start + text[start..].find('\n').expect("a line");
        text.replace_range(start..end, &format!("mesh = {{ file = '{}' }}", body.name));
        meshes.push((body.name.clone(), mesh));
    }
    let meshes: Vec<(&str, slipstick_mesh::Mesh)> = meshes.iter().map(|(name, mesh)| (&**name, mesh.clone())).collect();
    problem_with(&text, &meshes)
}

/// Two or three load cases, and how their objectives become one. `turn` is the frame of the slab,
/// and `pivot` and `axis` are those of a rotation, if bodies may be rotated.
fn scenarios(random: &mut Random, turn: &Rotation3<f64>, rotation: Option<([f64; 3], [f64; 3])>) -> (String, String) {
    let mut text = String::new();
    for case in 0..one_of(random, &[2, 2, 3]) {
        let _ = write!(text, "[[load_case]]\nname = \"case_{case}\"\nweight = {:?}\n", random.within(0.3, 2.0));
        let drawn = [
            ("friction", 0.5, random.within(0.0, 1.5)),
            ("modulus_factor", 0.4, random.within(0.7, 1.4)),
            ("motion_factor", 0.4, random.within(0.8, 1.2)),
        ];
        for (key, _, value) in drawn.into_iter().filter(|(_, probability, _)| chance(random, *probability)) {
            let _ = writeln!(text, "{key} = {value:?}");
        }
        let offset = Vector3::new(random.within(-0.1, 0.1), random.within(-0.01, 0.01), random.within(-0.1, 0.1));
        let offset: [f64; 3] = (turn * offset).into();
        let degrees = random.within(-3.0, 3.0);
        let (moved, turned) = (chance(random, 0.5), chance(random, 0.3));
        let rotation = rotation.filter(|_| turned).map(|(point, direction)| {
            format!(", rotation = {{ point = {point:?}, direction = {direction:?}, angle = {degrees:?} }}")
        });
        if moved {
            let rotation = rotation.unwrap_or_default();
            let _ = writeln!(text, "bodies = [{{ body = \"block\", offset = {offset:?}{rotation} }}]");
        }
    }
    let over = ["\"sum\"", "\"mean\"", "\"worst\"", "{ mean_plus_deviations = 1.5 }"];
    (one_of(random, &over).to_owned(), text)
}

/// Sets an objective of one to three quantities with weights, summed over steps or the largest of
/// them; returns its description.
pub fn draw_objective(random: &mut Random, problem: &mut Problem) -> String {
    // without loads, the compliance is 0
    let mut all = every_quantity(problem);
    all.retain(|quantity| quantity.name() != "compliance");
    if problem.analysis.model().has_memory() {
        let elements: Vec<u32> = (0..problem.mesh.elements.len() as u32).collect();
        all.push(Arc::new(PlasticStrain::new("plastic strain", elements, 6.0).expect("a quantity")));
    }
    let sprung = problem.analysis.model().springs();
    for name in sprung.names() {
        let along = VectorMeasure::along([0.4, 1.0, -0.7]).expect("a direction");
        all.push(Arc::new(SpringForce::new("spring force", sprung.of(name).to_vec(), along)));
    }
    for bolt in problem.analysis.model().bolts().list() {
        let along = VectorMeasure::along([1.0, 0.0, 0.0]).expect("a direction");
        all.push(Arc::new(Reaction::new("force of the bolt", vec![bolt.unknown], along).expect("one unknown")));
    }
    let temporary = problem.analysis.model().prescribed().temporary();
    if !temporary.is_empty() {
        let unknowns = temporary.iter().map(|support| support.unknown).collect();
        all.push(Arc::new(Reaction::new("force of supports", unknowns, VectorMeasure::Norm).expect("unknowns")));
    }
    let count = one_of(random, &[1, 1, 1, 2, 3]);
    let worst = chance(random, 0.2);
    let steps = problem.analysis.times.len();
    let mut term = || Term {
        quantity: all[(random.unit() * all.len() as f64) as usize].clone(),
        steps: match (random.unit() * 3.0) as usize {
            0 => ObservedSteps::Last,
            1 => ObservedSteps::All,
            _ => ObservedSteps::Only(vec![1 + (random.unit() * steps as f64) as usize]),
        },
        weight: random.within(0.2, 2.0),
    };
    let terms: Vec<Term> = (0..count).map(|_| term()).collect();
    let name = match (&terms[..], worst) {
        ([one], false) => one.quantity.name().to_owned(),
        (_, false) => "sum of quantities".into(),
        (_, true) => "largest of quantities".into(),
    };
    let reduction = if worst { Reduction::Largest } else { Reduction::Sum };
    problem.analysis.objective = Some(Response::new(name.clone(), terms, reduction));
    name
}

/// The problem of a seed.
pub fn random_problem(seed: u64) -> RandomProblem {
    if (FIRST_OF_CURVED..FIRST_OF_SPRINGS).contains(&seed) {
        return curved_problem(seed);
    }
    let mut pressure = None;
    let (more, seed) = match seed {
        FIRST_OF_SOFT.. => {
            let k = seed - FIRST_OF_SOFT;
            pressure = Some(soft(&mut Random::new(!k)));
            (String::new(), FIRST_OF_QUANTITIES + k)
        }
        FIRST_OF_SUPPORTS.. => {
            let k = seed - FIRST_OF_SUPPORTS;
            (supports(&mut Random::new(!k)), FIRST_OF_QUANTITIES + k)
        }
        FIRST_OF_BOLTS.. => {
            let k = seed - FIRST_OF_BOLTS;
            (bolt(&mut Random::new(!k)), FIRST_OF_QUANTITIES + k)
        }
        FIRST_OF_EQUATIONS.. => {
            let k = seed - FIRST_OF_EQUATIONS;
            (equations(&mut Random::new(!k)), FIRST_OF_QUANTITIES + k)
        }
        FIRST_OF_SPRINGS.. => {
            let k = seed - FIRST_OF_SPRINGS;
            (springs(&mut Random::new(!k)), FIRST_OF_QUANTITIES + k)
        }
        _ => (String::new(), seed),
    };
    let mut random = Random::new(seed);
    let r = &mut random;
    let slab = [r.within(1.5, 4.0), r.within(0.5, 1.2), r.within(0.8, 2.0)];
    let block = [r.within(0.5, 1.2), r.within(0.4, 1.0), r.within(0.5, 1.2)];
    let gap = if chance(r, 0.5) { 0.0 } else { r.within(0.0, 0.02) };
    // The block stands somewhere over the slab's top, perhaps partly beyond its edge, rotated about
    // the vertical.
    let spin = Rotation3::from_axis_angle(&Vector3::y_axis(), if chance(r, 0.5) { 0.0 } else { r.within(-3.0, 3.0) });
    let centre = Vector3::new(slab[0] * r.within(0.15, 0.85), slab[1] + gap, slab[2] * r.within(0.2, 0.8));
    let corner = centre - spin * Vector3::new(0.5 * block[0], 0.0, 0.5 * block[2]);
    let turn = Rotation3::from_axis_angle(&direction(r), r.within(0.0, 3.0));
    let shift = Vector3::from_iterator(r.vector(3, 5.0));
    let places = [place(&turn, shift), place(&(turn * spin), turn * corner + shift)];
    let (method, enforcement) = enforcement(r);
    let (method, enforcement) = pressure.map_or((method, enforcement), |law| ("soft", law));
    let slaves = if chance(r, 0.6) { ["block_ymin", "slab_ymax"] } else { ["slab_ymax", "block_ymin"] };
    let axis: [f64; 3] = (turn * direction(r).into_inner()).into();
    let pivot: [f64; 3] = (turn * (centre + Vector3::new(0.0, block[1], 0.0)) + shift).into();
    let others = joined(seed);
    let bodies = [body(r, "slab", slab, &places[0], others), body(r, "block", block, &places[1], others)].concat();
    let friction = if chance(r, 0.12) { 0.0 } else { r.within(0.0, 2.0) };
    // Determined by the seed and not drawn, so that the rest of a problem does not depend on it.
    let edge_cover = [0.5, 0.5, 0.05, 1.0][(seed % 4) as usize];
    let friction = format!("friction = {friction:?}\nedge_cover = {edge_cover:?}\n");
    let interaction = match joined(seed) {
        true => joint(seed, &friction, &enforcement),
        false => format!("{friction}enforcement = {enforcement}\n"),
    };
    let viscosity = if joined(seed) && seed.is_multiple_of(3) { "viscosity = 50.0\n" } else { "" };
    let method = if interaction.starts_with("tied") { "tied" } else { method };
    let text = format!(
        "{bodies}[[contact]]\nslave = \"{}\"\nmaster = \"{}\"\n\
         multiplier_shape = \"{}\"\n{interaction}\
         [[dirichlet]]\nset = \"slab_ymin\"\n\
         [[dirichlet]]\nset = \"block_ymax\"\nmotion = {}\nrotation = {{ point = {pivot:?}, direction = {axis:?} }}\n\
         [load_path]\n{viscosity}steps = {}\nstart_values = \"{}\"\nmax_cutbacks = 4\n\
         [design]\nbodies = {}\ninitial = 0.5\nsimp = {{ p = {:?}, min = {:?} }}\n{}\
         [objective]\ncontact_force = {{ steps = \"{}\" }}\n",
        slaves[0],
        slaves[1],
        one_of(r, &["standard", "dual"]),
        motion(r, &turn, gap),
        one_of(r, &[3, 4, 5, 6]),
        one_of(r, &["extrapolated", "last_state"]),
        one_of(r, &["[\"slab\"]", "[\"block\"]", "[\"slab\", \"block\"]"]),
        r.within(1.0, 4.0),
        one_of(r, &[1e-3, 1e-2]),
        if chance(r, 0.15) { "energy_interpolation = {}\n" } else { "" },
        one_of(r, &["last", "all"]),
    );
    let mut over = String::new();
    let text = if !(FIRST_OF_SCENARIOS..FIRST_OF_JOINTS).contains(&seed) {
        text
    } else {
        let rotation = (!text.contains("energy_interpolation")).then_some((pivot, axis));
        let load_cases;
        (over, load_cases) = scenarios(r, &turn, rotation);
        format!("{text}load_cases = {over}\n{load_cases}")
    };
    let text = if seed < FIRST_OF_RIGID {
        text
    } else {
        let middle = turn * (centre + Vector3::new(0.0, 0.5 * block[1], 0.0)) + shift;
        // otherwise it tips over the edge
        let inside = |c: usize| centre[c].min(slab[c] - centre[c]) > 0.4 * block[c];
        with_rigid_block(r, &text, middle.into(), gap == 0.0 && inside(0) && inside(2))
    };
    let text = text + &more;
    let is_plastic = (FIRST_OF_PLASTIC..FIRST_OF_RIGID).contains(&seed);
    let text = if is_plastic { with_plastic_bodies(r, &text) } else { text };
    let text = if has_fields(seed) { with_fields(seed, &text) } else { text };
    let mut problem = match seed {
        FIRST_OF_PLASTIC..FIRST_OF_RIGID if seed.is_multiple_of(2) => problem(&text),
        FIRST_OF_QUADRATIC..FIRST_OF_RIGID => quadratic(r, &text),
        _ => problem(&text),
    };
    let elements = designed(&problem);
    let lowest = one_of(r, &[0.1, 0.4]);
    let mut density = ElementValues::from(vec![1.0; problem.initial_density().len()]);
    elements.iter().for_each(|&e| density[e] = r.within(lowest, 0.95));
    let mut objective = if chance(r, 0.7) { "contact force" } else { "reaction force" }.to_owned();
    if seed >= FIRST_OF_RIGID {
        objective = format!("rigid: {}", draw_objective(r, &mut problem));
    } else if is_plastic {
        objective = format!("plastic: {}", draw_objective(r, &mut problem));
    } else if seed >= FIRST_OF_QUADRATIC {
        objective = format!("quadratic: {}", draw_objective(r, &mut problem));
    } else if (FIRST_OF_SCENARIOS..FIRST_OF_JOINTS).contains(&seed) {
        objective = format!("load cases: {over}");
    } else if seed >= FIRST_OF_QUANTITIES {
        objective = draw_objective(r, &mut problem);
    } else if objective == "reaction force" {
        let nodes = problem.mesh.set_nodes("block_ymax").expect("the block's top").to_vec();
        let unknowns = nodes.iter().flat_map(|node| (0..3).map(move |c| 3 * node + c)).collect();
        let along = VectorMeasure::along(direction(r).into_inner().into()).expect("a direction");
        let force = Reaction::new("reaction", unknowns, along).expect("a quantity");
        problem.analysis.objective = Some(Response::of(Arc::new(force), ObservedSteps::Last, -1.0));
    }
    let designed = elements.iter().map(|&e| e as u32).collect();
    RandomProblem { text, method, objective, density, designed, problem }
}
