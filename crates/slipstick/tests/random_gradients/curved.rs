//! Random small problems with curved surfaces whose facets do not match, and with nodes in two pairs.

use std::fmt::Write as _;

use nalgebra::{Rotation3, Unit, Vector3};
use slipstick::design::ElementValues;
use slipstick_mesh::{BoxShape, Mesh, box_mesh};

use super::problem::{RandomProblem, chance, draw_objective, enforcement, one_of, place};
use crate::common::{Random, designed, problem_with};

/// Problems from this seed on have curved surfaces, or, for every fourth seed, a block in a corner.
pub const FIRST_OF_CURVED: u64 = 8000;

/// Height of a surface above the plane that touches it at the origin.
#[derive(Clone, Copy)]
enum Profile {
    Flat,
    /// A cylinder along z.
    Cylinder(f64),
    Sphere(f64),
    /// No shape that is recognized: curvatures along x and z.
    Paraboloid(f64, f64),
}

impl Profile {
    fn height(self, x: f64, z: f64) -> f64 {
        let cap = |radius: f64, square: f64| radius - (radius * radius - square).sqrt();
        match self {
            Self::Flat => 0.0,
            Self::Cylinder(radius) => cap(radius, x * x),
            Self::Sphere(radius) => cap(radius, x * x + z * z),
            Self::Paraboloid(along, across) => 0.5 * (along * x * x + across * z * z),
        }
    }
}

/// A box whose bottom or top follows `height(x, z)`, and the nodes between both in proportion, with linear or
/// quadratic elements. `lifted`: −1 for the bottom, 1 for the top.
fn curved_box(name: &str, shape: &BoxShape, second: bool, lifted: f64, height: impl Fn(f64, f64) -> f64) -> Mesh {
    let mut mesh = box_mesh(name, shape).expect("a box");
    if second {
        let mean = |of: &[[f64; 3]]| std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64);
        mesh = mesh.second_order(mean).expect("hexahedra");
    }
    let [bottom, top] = [shape.min[1], shape.max[1]];
    for [x, y, z] in &mut mesh.nodes {
        let share = (*y - bottom) / (top - bottom);
        *y += height(*x, *z) * if lifted > 0.0 { share } else { 1.0 - share };
    }
    mesh
}

/// Numbers of elements along x, y and z: more along x.
fn elements(random: &mut Random) -> [usize; 3] {
    [one_of(random, &[2, 3, 4]), 1, one_of(random, &[1, 2])]
}

fn material(random: &mut Random) -> String {
    let (modulus, poisson) = (random.within(500.0, 2000.0), random.within(0.0, 0.4));
    format!("material = {{ neo_hooke = {{ youngs_modulus = {modulus:?}, poisson_ratio = {poisson:?} }} }}\n")
}

/// A contact pair with friction, enforcement and shapes of its own.
fn pair(random: &mut Random, slave: &str, master: &str, enforcement: &str) -> String {
    let friction = if chance(random, 0.15) { 0.0 } else { random.within(0.0, 0.8) };
    let mut text = format!(
        "[[contact]]\nslave = \"{slave}\"\nmaster = \"{master}\"\nfriction = {friction:?}\n\
         multiplier_shape = \"{}\"\nsurfaces = \"{}\"\nnormals = \"{}\"\nenforcement = {enforcement}\n",
        one_of(random, &["standard", "dual", "mean"]),
        one_of(random, &["smooth", "smooth", "smooth", "faceted"]),
        one_of(random, &["averaged", "touched"]),
    );
    if chance(random, 0.25) {
        let _ = writeln!(text, "offset = {:?}", random.within(-0.01, 0.01));
    }
    text
}

/// The problem of a seed.
pub fn curved_problem(seed: u64) -> RandomProblem {
    let mut random = Random::new(seed);
    let r = &mut random;
    let direction = Unit::new_normalize(Vector3::from_iterator(r.vector(3, 1.0)));
    let turn = Rotation3::from_axis_angle(&direction, r.within(0.0, 3.0));
    let shift = Vector3::from_iterator(r.vector(3, 5.0));
    let corner = seed.is_multiple_of(4);
    // block and slab are curved towards each other, or the slab is a seat for the block
    let radius = r.within(0.8, 3.0);
    let block = match one_of(r, &[0, 1, 2]) {
        _ if corner => Profile::Flat,
        0 => Profile::Cylinder(radius),
        1 => Profile::Sphere(radius),
        _ => Profile::Paraboloid(1.0 / radius, r.within(-0.2, 0.5) / radius),
    };
    let wider = r.within(1.0, 1.3);
    let (slab, sign) = match (one_of(r, &[0, 0, 1, 2]), block) {
        _ if corner => (Profile::Flat, 0.0),
        (0, Profile::Cylinder(radius)) => (Profile::Cylinder(wider * radius), 1.0),
        (0, Profile::Sphere(radius)) => (Profile::Sphere(wider * radius), 1.0),
        (0 | 1, _) => (Profile::Cylinder(r.within(1.5, 4.0)), -1.0),
        _ => (Profile::Flat, 0.0),
    };
    let [width, depth] = [r.within(0.3, 0.5), r.within(0.2, 0.4)];
    let shape = |min, max, elements| BoxShape { min, max, elements, grading: [1.0; 3] };
    let below = shape([-0.7, -0.6, -0.5], [0.7, 0.0, 0.5], elements(r));
    let above = shape([-width, 0.0, -depth], [width, 0.6, depth], elements(r));
    let [second_below, second_above] = [0; 2].map(|_| !corner && chance(r, 0.25));
    let mut meshes = vec![
        ("slab", curved_box("slab", &below, second_below, 1.0, |x, z| sign * slab.height(x, z))),
        ("block", curved_box("block", &above, second_above, -1.0, |x, z| block.height(x, z))),
    ];
    if corner {
        let wall = shape([width, 0.05, -0.5], [width + 0.5, 0.7, 0.5], elements(r));
        meshes.push(("wall", box_mesh("wall", &wall).expect("a box")));
    }
    let gap = if chance(r, 0.5) { 0.0 } else { r.within(0.0, 0.02) };
    let at = Vector3::new(if corner { 0.0 } else { r.within(-0.05, 0.05) }, gap, r.within(-0.05, 0.05));
    let mut text = String::new();
    for (name, _) in &meshes {
        let at = if *name == "block" { turn * at + shift } else { shift };
        let _ =
            write!(text, "[[body]]\nname = \"{name}\"\nmesh = {{ file = '{name}' }}\nplace = {}\n", place(&turn, at));
        text += &material(r);
    }
    let (method, how) = enforcement(r);
    let block_is_slave = corner || chance(r, 0.6);
    let [slave, master] = if block_is_slave { ["block_ymin", "slab_ymax"] } else { ["slab_ymax", "block_ymin"] };
    text += &pair(r, slave, master, &how);
    if corner {
        text += &pair(r, "block_xmax", "wall_xmin", &how);
        text += "[[dirichlet]]\nset = \"wall_xmax\"\n";
    }
    let down = gap + r.within(0.02, 0.06);
    let along = if corner { r.within(0.01, 0.04) } else { r.within(-0.1, 0.1) };
    let end = Vector3::new(along, -down * r.within(0.8, 1.2), r.within(-0.05, 0.05));
    let first = Vector3::new(if corner { 0.5 * along } else { 0.0 }, -down, 0.0);
    let [first, end]: [[f64; 3]; 2] = [first, end].map(|u| (turn * u).into());
    let degrees = if !corner && chance(r, 0.4) { r.within(-5.0, 5.0) } else { 0.0 };
    let pivot: [f64; 3] = (turn * Vector3::new(0.0, radius, 0.0) + shift).into();
    let axis: [f64; 3] = (turn * Vector3::z()).into();
    let _ = write!(
        text,
        "[[dirichlet]]\nset = \"slab_ymin\"\n\
         [[dirichlet]]\nset = \"block_ymax\"\nmotion = [{{ t = 0.4, u = {first:?}, angle = 0.0 }}, \
         {{ t = 1.0, u = {end:?}, angle = {degrees:?} }}]\nrotation = {{ point = {pivot:?}, direction = {axis:?} }}\n\
         [load_path]\nsteps = {}\nmax_cutbacks = 4\n\
         [design]\nbodies = {}\ninitial = 0.5\nsimp = {{ p = {:?}, min = 0.01 }}\n\
         [objective]\nminimise = {{ quantity = \"press\" }}\n\
         [[quantity]]\nname = \"press\"\nreaction = {{ set = \"slab_ymin\", component = \"norm\" }}\n",
        one_of(r, &[3, 4, 5]),
        one_of(r, &["[\"slab\"]", "[\"block\"]", "[\"slab\", \"block\"]"]),
        r.within(1.0, 4.0),
    );
    let mut problem = problem_with(&text, &meshes);
    let elements = designed(&problem);
    let lowest = one_of(r, &[0.1, 0.4]);
    let mut density = ElementValues::from(vec![1.0; problem.initial_density().len()]);
    elements.iter().for_each(|&e| density[e] = r.within(lowest, 0.95));
    let kind = if corner { "corner" } else { "curved" };
    let objective = format!("{kind}: {}", draw_objective(r, &mut problem));
    let designed = elements.iter().map(|&e| e as u32).collect();
    RandomProblem { text, method, objective, density, designed, problem }
}
