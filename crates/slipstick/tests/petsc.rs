//! Whole problems on the ranks of PETSc, compared with the default solver on one rank: objective,
//! gradient, statuses.
//!
//! The test starts itself with `mpirun` on one, two and four ranks; without `mpirun` it reports
//! that it is skipped. Every rank computes the reference independently.

mod common;
#[path = "../../petsc/tests/mpirun/mod.rs"]
mod mpirun;

use common::scene::{LAGRANGE, Scene, augmented, penalty};
use common::{deviation, random_density, status_path};
use slipstick::analysis::Gradients;
use slipstick::build::{Problem, build, build_on};
use slipstick::case::{PetscPreconditioner, parse_case};
use slipstick::machine::Machine;
use slipstick::petsc::Session;
use slipstick_path::Silent;
use std::process::ExitCode;
use std::time::Duration;

fn main() -> ExitCode {
    mpirun::on_ranks(&[1, 2, 4], rank)
}

fn rank() {
    let session = Session::start().expect("PETSc starts");
    let machine = Machine::of(session.clone());
    objectives_and_gradients_agree(&machine);
    a_rigid_tool_is_pressed_on(&machine);
    second_order_elements_agree(&machine);
    rigid_bodies_agree(&machine);
    joints_and_fields_agree(&machine);
    assert!(session.meet(Duration::from_secs(60)));
}

const MORE: &str = r#"
[[dirichlet]]
set = "block_ymax"
load_case = "pushed"
motion = [{ t = 1.0, u = [0, -0.12, 0] }]
[[load_case]]
name = "drawn"
[[load_case]]
name = "pushed"
weight = 0.3
[[load]]
surface = "block_xmin"
load_case = "pushed"
pressure = 15.0
[[load]]
surface = "slab_xmax"
load_case = "pushed"
traction = [9.0, -4.0, 2.0]
[solver]
linear = "petsc"
"#;

/// A block that closes a gap, is pressed onto a slab and dragged over its edge: nodes are open,
/// stick and slip; in a second load case, pressure acts on its side and on the slab's end.
fn scene(enforcement: &str, shape: &'static str) -> Scene {
    Scene {
        slab: [8, 2, 3],
        block: [3, 2, 3],
        corner: [0.15, 1.05, 0.13],
        enforcement: enforcement.into(),
        shape,
        motion: "[{ t = 0.5, u = [0.02, -0.15, 0] }, { t = 1.0, u = [0.15, -0.13, 0.04] }]".into(),
        drive: "load_case = \"drawn\"".into(),
        steps: 8,
        observed: "\"all\"",
        more: MORE.into(),
        ..Scene::default()
    }
}

/// A second body on the slab, whose pair has its own method.
fn beside(enforcement: &str) -> String {
    format!(
        r#"
[[body]]
name = "post"
box = {{ min = [2.43, 1.0, 0.2], max = [3.13, 1.8, 0.9], elements = [2, 2, 2] }}
material = {{ neo_hooke = {{ youngs_modulus = 800.0, poisson_ratio = 0.2 }} }}
[[contact]]
slave = "post_ymin"
master = "slab_ymax"
friction = 0.2
enforcement = {enforcement}
[[dirichlet]]
set = "post_ymax"
motion = [{{ t = 1.0, u = [0.1, -0.1, 0.03] }}]"#
    )
}

fn objectives_and_gradients_agree(machine: &Machine) {
    for (name, enforcement, shape) in [
        ("Lagrange", LAGRANGE.to_owned(), "standard"),
        ("Lagrange", LAGRANGE.to_owned(), "dual"),
        ("penalty", penalty(5e3), "standard"),
        ("augmented", augmented(5e3, 1e-11), "standard"),
        ("Lagrange and penalty", format!("{LAGRANGE}{}", beside(&penalty(5e3))), "standard"),
        ("augmented and Lagrange", format!("{}{}", augmented(5e3, 1e-11), beside(LAGRANGE)), "standard"),
    ] {
        agree(machine, &format!("{name}, {shape}"), &scene(&enforcement, shape).text(), &['o', 't', 'l']);
    }
}

/// Slave nodes whose displacements are all prescribed: their multipliers are coupled only to master
/// nodes, which other ranks may own.
fn a_rigid_tool_is_pressed_on(machine: &Machine) {
    let tool = Scene {
        // no more slave nodes than the master nodes can follow
        block: [2, 2, 1],
        drive: String::new(),
        more: "[[dirichlet]]\nset = \"block_ymin\"\n\
               motion = [{ t = 0.5, u = [0.02, -0.15, 0] }, { t = 1.0, u = [0.15, -0.13, 0.04] }]\n\
               [[load]]\nsurface = \"slab_xmax\"\ntraction = [9.0, -4.0, 2.0]\n\
               [solver]\nlinear = \"petsc\"\n"
            .into(),
        ..scene(LAGRANGE, "standard")
    };
    // contact forces of prescribed nodes are reactions, which that objective excludes
    let text = tool.text().replace("contact_force", "compliance");
    agree(machine, "rigid tool", &text, &['o', 't', 'l']);
}

/// The elements, and their facets of contact, of second order.
fn second_order_elements_agree(machine: &Machine) {
    let scene = Scene { slab: [4, 1, 1], block: [2, 1, 1], steps: 4, ..scene(LAGRANGE, "standard") };
    agree(machine, "second order", &scene.text().replace("[[body]]", "[[body]]\norder = 2"), &['o', 't', 'l']);
}

/// Beside the block, a bolt pulls a rod that springs join to the slab; the mean of a face is that of a point on a
/// spring, another face is coupled to a loaded point, and gravity and a temperature act on the rod.
fn joints_and_fields_agree(machine: &Machine) {
    let more = r#"
[[body]]
name = "rod"
box = { min = [9, 0, 0], max = [13, 1, 1], elements = [4, 2, 2] }
material = { neo_hooke = { youngs_modulus = 900, poisson_ratio = 0.3 } }
mass_density = 2.0
thermal_expansion = 1e-3
[[dirichlet]]
set = "rod_xmax"
[[spring]]
name = "link"
set = "rod_xmin"
to = "slab_xmax"
stiffness = 300
[[bolt]]
name = "tie"
body = "rod"
section = { point = [11.2, 0.5, 0.5], normal = [1, 0.1, 0] }
force = [{ t = 0.5, force = 12 }]
[[point]]
name = "mean"
at = [0, 0, 0]
[[spring]]
name = "foot"
set = "mean"
stiffness = 50
[[equation]]
terms = [{ set = "mean" }, { set = "slab_xmin", mean = true, factor = -1 }]
[[coupling]]
name = "end"
set = "block_zmax"
at = [1, 1.5, 2]
kind = "distributing"
[[load]]
surface = "end"
force = [0, 0, 2]
[[load]]
body = "rod"
gravity = [0, -3, 0]
[[temperature]]
body = "rod"
change = 8
[solver]
linear = "petsc"
"#;
    let scene = Scene { drive: String::new(), more: more.into(), ..scene(LAGRANGE, "standard") };
    agree(machine, "joints and fields", &scene.text(), &['o', 't', 'l']);
}

/// A rigid beam under a force and a moment rests on two blocks, tilts, and is pulled along them.
fn rigid_bodies_agree(machine: &Machine) {
    let block = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = '{name}'\n\
             box = {{ min = [{x:?}, 0, 0], max = [{:?}, 1, 1], elements = [3, 3, 3] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
             [[dirichlet]]\nset = '{name}_ymin'\n\
             [[contact]]\nslave = '{name}_ymax'\nmaster = 'beam_ymin'\nfriction = 0.3\n",
            x + 1.0
        )
    };
    let text = [
        block("left", 0.0),
        block("right", 3.0),
        "[[body]]\nname = 'beam'\nbox = { min = [-0.5, 0.99, -0.2], max = [4.5, 1.3, 1.2], elements = [10, 1, 3] }\n\
         rigid = {}\n\
         [[load]]\nsurface = 'beam'\nforce = [0, -30, 0]\n\
         [[load]]\nsurface = 'beam'\nmoment = [0, 0, 15]\n\
         [[dirichlet]]\nset = 'beam'\ncomponents = ['x', 'z', 'rx', 'ry']\nmotion = [{ t = 0.5, u = [0, 0, 0] }, { t = 1, u = [0.1, 0, 0] }]\n\
         [load_path]\nsteps = 6\ntolerance = { relative = 1e-12 }\n\
         [design]\nbodies = ['left', 'right']\ninitial = 0.5\n[objective]\ncompliance = {}\n[solver]\nlinear = 'petsc'\n"
            .to_owned(),
    ]
    .concat();
    agree(machine, "rigid beam", &text, &['t', 'l']);
}

/// Objective, gradients and statuses on the ranks compared with those of the default solver; `seen`
/// are statuses that must occur.
fn agree(machine: &Machine, name: &str, text: &str, seen: &[char]) {
    let case = parse_case(text, "proof.toml").unwrap_or_else(|e| panic!("{e}\n{text}")).case;
    let mut alone = case.clone();
    alone.solver.linear = slipstick::case::LinearSolverChoice::Auto;
    let (value, gradients, statuses) = solved(build(&alone).expect("a problem"));
    let all: String = statuses.concat();
    assert!(seen.iter().all(|status| all.contains(*status)), "{statuses:?}");
    for preconditioner in [PetscPreconditioner::Direct, PetscPreconditioner::ContactZone] {
        let mut case = case.clone();
        case.solver.petsc_preconditioner = preconditioner;
        let name = format!("{name}, {preconditioner:?}");
        let (other, others, same) = solved(build_on(&case, machine).expect("a problem"));
        assert_eq!(statuses, same, "{name}");
        assert!((other - value).abs() <= 1e-9 * value.abs(), "{name}: {other} {value}");
        let error = deviation(&others.density, &gradients.density);
        assert!(error < 1e-9, "{name}: {error:e}");
        if machine.ranks().rank() == 0 {
            let objective = (other / value - 1.0).abs();
            println!("{name}: relative differences: objective {objective:.1e}, density gradient {error:.1e}");
        }
        for ((parameter, a), (_, b)) in others.parameters.iter().zip(&gradients.parameters) {
            assert!((a - b).abs() <= 1e-8 * b.abs().max(value.abs() * 1e-3), "{name}, {parameter:?}: {a} {b}");
        }
    }
}

fn solved(mut problem: Problem) -> (f64, Gradients, Vec<String>) {
    let density = random_density(&problem, 7);
    // on this thread, the only one that may call MPI
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    let gradients = problem.analysis.gradients(&forward).unwrap_or_else(|e| panic!("{e}"));
    let statuses = status_path(&mut problem, &forward);
    (forward.value, gradients, statuses)
}
