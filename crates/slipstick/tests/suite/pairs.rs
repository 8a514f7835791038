//! Slave nodes that several contact pairs share: a block in a corner, and ties that meet along edges
//! and at a corner. Expected tractions and deformations are uniform fields, known by hand; gradients
//! are compared with central differences.

use crate::common::*;
use crate::patch::{deformation_gradients, distorted, mean};
use nalgebra::Matrix3;
use slipstick::analysis::pair_results;
use slipstick_contact::ContactStatus;
use slipstick_mesh::{BoxShape, Mesh, box_mesh};

/// A block pressed into the corner of a floor and a wall, which overlap so that both reach beyond the
/// edge of the block; `pairs`: further keys of each pair.
fn corner(tools: &str, supports: [&str; 2], pairs: [&str; 2], more: &str) -> String {
    let [floor, wall] = supports;
    let [on_floor, on_wall] = pairs;
    format!(
        "[[body]]\nname = 'block'\nbox = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [3, 3, 2] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 100.0, poisson_ratio = 0.3 }} }}\n\
         [[body]]\nname = 'floor'\nbox = {{ min = [-0.5, -0.5, -0.25], max = [1.5, 0, 1.25], elements = [4, 1, 3] }}\n\
         {tools}\n\
         [[body]]\nname = 'wall'\nbox = {{ min = [-0.5, -0.5, -0.25], max = [0, 1.5, 1.25], elements = [1, 4, 3] }}\n\
         {tools}\n\
         [[contact]]\nslave = 'block_ymin'\nmaster = 'floor_ymax'\n{on_floor}\n\
         [[contact]]\nslave = 'block_xmin'\nmaster = 'wall_xmax'\n{on_wall}\n\
         [[dirichlet]]\nset = '{floor}'\n[[dirichlet]]\nset = '{wall}'\n\
         [[load]]\nsurface = 'block_ymax'\npressure = 5.0\n\
         [[load]]\nsurface = 'block_xmax'\npressure = 5.0\n\
         [load_path]\nsteps = 2\ntolerance = {{ relative = 1e-12 }}\n{more}"
    )
}

const METHODS: [&str; 3] = [
    "enforcement = { lagrange = {} }",
    "enforcement = { penalty = { stiffness = 1e4 } }",
    "enforcement = { augmented = { stiffness = 1e4, tolerance = 1e-11 } }",
];

const SOFT: &str = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";

/// Without friction, floor and wall press on the block like the loads on the opposite sides: the
/// pressure is uniform, by both conditions at the nodes of the common edge too.
#[test]
fn a_block_in_a_rigid_corner_is_under_uniform_pressure() {
    for first in METHODS {
        for second in METHODS {
            let plane = "[[dirichlet]]\nset = 'block_zmin'\ncomponents = ['z']\n";
            let pairs = [first, second].map(|method| format!("friction = 0.0\n{method}"));
            let mut problem = problem(&corner("rigid = {}", ["floor", "wall"], [&pairs[0], &pairs[1]], plane));
            let density = problem.initial_density().clone();
            let run = forward(&mut problem, &density);
            let last = contact_path(&mut problem, &run).pop().unwrap();
            // 4 × 3 slave nodes a pair, of which the three of the edge have two rows
            assert_eq!(last.len(), 24);
            let nodes: std::collections::BTreeSet<u32> = last.iter().map(|row| row.node).collect();
            assert_eq!(nodes.len(), 21);
            // a penalty lets the block into the tools, evenly; the load follows the surface
            for row in last {
                assert_ne!(row.status, ContactStatus::Inactive);
                let [n, a, b] = row.multiplier;
                assert!((n / 5.0 - 1.0).abs() < 1e-8 && a.hypot(b) < 1e-8, "{first}, {second}: {:?}", row.multiplier);
            }
        }
    }
}

/// By hand: the loads on the opposite sides. At the common edge, too, the peak pressure of a pair is not the
/// mean of both.
#[test]
fn each_pair_in_a_corner_has_its_own_peak_pressure() {
    let plane = "[[dirichlet]]\nset = 'block_zmin'\ncomponents = ['z']\n";
    let text = corner("rigid = {}", ["floor", "wall"], ["friction = 0.0"; 2], plane);
    let mut problem =
        problem(&text.replace("surface = 'block_xmax'\npressure = 5.0", "surface = 'block_xmax'\npressure = 2.0"));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let [.., before, last] = &run.path.states[..] else { panic!("a path") };
    let results = problem.analysis.design.contact_results(&before.state, &last.state, 1.0.into()).unwrap();
    let peaks: Vec<f64> =
        pair_results(problem.analysis.model(), &results).iter().map(|pair| pair.peak_pressure).collect();
    assert!((peaks[0] / 5.0 - 1.0).abs() < 1e-8 && (peaks[1] / 2.0 - 1.0).abs() < 1e-8, "{peaks:?}");
}

/// Each pair transmits its own force: that of the floor is the floor's reaction, that of the wall
/// the wall's; and all nodes that slide do so with Coulomb's ratio of their own pair.
#[test]
fn each_pair_in_a_corner_has_its_own_force_and_friction() {
    for [first, second] in [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [2, 0]] {
        let pairs = [format!("friction = 0.2\n{}", METHODS[first]), format!("friction = 0.1\n{}", METHODS[second])];
        let supports = ["floor_ymin", "wall_xmin"];
        let mut problem = problem(&corner(SOFT, supports, [&pairs[0], &pairs[1]], ""));
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let last = contact_path(&mut problem, &run).pop().unwrap();
        let found = slipstick::quantities::quantities(&problem, &run.path);
        for (rows, set, friction) in [(&last[..12], "floor_ymin", 0.2), (&last[12..], "wall_xmin", 0.1)] {
            let mut slipping = 0;
            for row in rows {
                let [n, a, b] = row.multiplier;
                slipping += usize::from(row.status == ContactStatus::Slip);
                assert!(row.status != ContactStatus::Slip || (a.hypot(b) / (friction * n) - 1.0).abs() < 1e-8);
            }
            assert!(slipping > 0);
            for (c, axis) in ["x", "y"].into_iter().enumerate() {
                // z is minus the traction on the slave, so its sum is the force on the tool
                let force: f64 = rows.iter().map(|row| row.covered_area * row.global_multiplier[c]).sum();
                let reaction = *found.get(&format!("reaction_{set}_{axis}")).unwrap().last().unwrap();
                assert!((force + reaction).abs() < 1e-8, "{set} {axis}: {force} and {reaction}");
            }
        }
    }
}

/// All methods, mixed too, and a tie next to a contact with friction.
#[test]
fn gradient_of_a_block_in_a_corner() {
    let objective = "[design]\nbodies = ['block']\ninitial = 0.6\n[objective]\ncompliance = {}\n";
    let with_friction = METHODS.map(|method| format!("friction = 0.2\n{method}"));
    let tied = "tied = true".to_owned();
    let [l, p, a] = &with_friction;
    for [first, second] in [[l, l], [p, p], [a, a], [l, p], [p, a], [l, &tied], [&tied, p], [&tied, &tied]] {
        let mut problem = problem(&corner(SOFT, ["floor_ymin", "wall_xmin"], [first, second], objective));
        let density = random_density(&problem, 5);
        let check = check_gradient(&mut problem, &density);
        println!("{first}, {second}: error {:.1e}, {:?}", check.error, check.statuses);
        assert!(check.error < 1e-7, "{first}, {second}: the gradient is off by {:e}", check.error);
    }
}

/// A second name of a slave surface makes it the slave of two pairs: without the name, an error says
/// so. Two tools press on one face; the integral of the traction over the face is the sum of their
/// forces.
#[test]
fn two_tools_press_on_one_face() {
    let text = |second: &str| {
        let tool = |name: &str, x: f64| {
            format!(
                "[[body]]\nname = '{name}'\nbox = {{ min = [{x:?}, 1, 0], max = [{:?}, 1.5, 1], \
                 elements = [2, 1, 2] }}\n{SOFT}\n[[dirichlet]]\nset = '{name}_ymax'\n\
                 motion = [{{ t = 1, u = [0, -0.02, 0] }}]\n",
                x + 0.45
            )
        };
        format!(
            "[[body]]\nname = 'block'\nbox = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [4, 2, 2] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 100.0, poisson_ratio = 0.3 }} }}\n{}{}\
             [[surface]]\nname = 'again'\nof = ['block_ymax']\n\
             [[contact]]\nslave = 'block_ymax'\nmaster = 'left_ymin'\nfriction = 0.3\n\
             [[contact]]\nslave = '{second}'\nmaster = 'right_ymin'\nfriction = 0.1\n\
             [[dirichlet]]\nset = 'block_ymin'\n[load_path]\nsteps = 2\ntolerance = {{ relative = 1e-12 }}\n",
            tool("left", 0.0),
            tool("right", 0.55)
        )
    };
    let case = slipstick::case::parse_case(&text("block_ymax"), "tools.toml").unwrap().case;
    let error = slipstick::build::build(&case).err().unwrap();
    assert_eq!(error.path, "contact[1].slave");
    assert!(error.to_string().contains("is the slave of contact[0] too"), "{error}");
    let mut problem = problem(&text("again"));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let force = |set: &str| *found.get(&format!("reaction_{set}_ymax_y")).unwrap().last().unwrap();
    assert!(force("left") < -0.1 && force("right") < -0.1);
    let below = *found.get("reaction_block_ymin_y").unwrap().last().unwrap();
    assert!((force("left") + force("right") + below).abs() < 1e-8);
    let [before, last] = [1, 2].map(|k| run.path.states[run.path.states.len() - 3 + k].clone());
    let contact = problem.analysis.design.contact_results(&before.state, &last.state, last.time).unwrap();
    let x: Vec<[f64; 3]> = problem
        .mesh
        .nodes
        .iter()
        .zip(last.state.unknowns.chunks(3))
        .map(|(x, d)| std::array::from_fn(|c| x[c] + d[c]))
        .collect();
    let mut integral = 0.0;
    for facet in &problem.mesh.surfaces["block_ymax"].facets {
        let areas = slipstick_mesh::facet_corner_areas(&facet.nodes.corners(&x));
        integral += facet.nodes.iter().zip(areas).map(|(&n, a)| a * contact.traction[3 * n as usize + 1]).sum::<f64>();
    }
    assert!((integral + below).abs() < 1e-8, "{integral} and {below}");
}

/// Replaces the hexahedra of a box by other elements.
type Divide = fn(&Mesh) -> Mesh;

/// Blocks of unit size in a grid of `count`, tied to each other and pulled along x by a traction of 10.
/// `elements` gives the division of each block.
fn tied_blocks(count: [usize; 3], elements: impl Fn(usize) -> [usize; 3], swap: usize, divide: Divide) -> Blocks {
    let (mut text, mut ties, mut loads, mut meshes) = (String::new(), String::new(), String::new(), Vec::new());
    let (mut number, mut ties_so_far) = (0, 0);
    for z in 0..count[2] {
        for y in 0..count[1] {
            for x in 0..count[0] {
                let (at, name) = ([x, y, z], format!("b{x}{y}{z}"));
                let min = at.map(|c| c as f64);
                let shape = BoxShape { min, max: min.map(|c| c + 1.0), elements: elements(number), grading: [1.0; 3] };
                meshes.push((name.clone(), divide(&box_mesh(&name, &shape).unwrap())));
                number += 1;
                text += &format!(
                    "[[body]]\nname = '{name}'\nmesh = {{ file = '{name}' }}\n\
                     material = {{ neo_hooke = {{ youngs_modulus = 100.0, poisson_ratio = 0.3 }} }}\n"
                );
                for (c, axis) in ["x", "y", "z"].into_iter().enumerate().filter(|&(c, _)| at[c] + 1 < count[c]) {
                    let mut next = at;
                    next[c] += 1;
                    let sides = [format!("{name}_{axis}max"), format!("b{}{}{}_{axis}min", next[0], next[1], next[2])];
                    let (slave, master) = ((ties_so_far / swap) % 2, 1 - (ties_so_far / swap) % 2);
                    ties_so_far += 1;
                    let (slave, master) = (&sides[slave], &sides[master]);
                    ties += &format!("[[contact]]\nslave = '{slave}'\nmaster = '{master}'\ntied = true\n");
                }
                if x + 1 == count[0] {
                    loads += &format!("[[load]]\nsurface = '{name}_xmax'\npressure = -10.0\n");
                }
            }
        }
    }
    let planes = "[[symmetry]]\nnormal = 'x'\n[[symmetry]]\nnormal = 'y'\n[[symmetry]]\nnormal = 'z'\n";
    let path = "[load_path]\nsteps = 1\ntolerance = { relative = 1e-13 }\n";
    (text + &ties + &loads + planes + path, meshes)
}

/// A case and its meshes.
type Blocks = (String, Vec<(String, Mesh)>);

/// Uniaxial tension passes through four blocks around an edge and eight around a corner, with
/// matching meshes, where the conditions at cross points are exactly redundant, and others.
#[test]
fn uniform_stress_passes_through_ties_that_meet() {
    let kinds: [(&str, Divide); 6] = [
        ("hexahedra", Mesh::clone),
        ("wedges", |mesh| distorted(mesh.divided_into_wedges(|_| Some(1)))),
        ("tetrahedra", |mesh| mesh.divided(|_| true)),
        ("27-node hexahedra", |mesh| distorted(mesh.second_order(mean).unwrap())),
        ("18-node wedges", |mesh| mesh.divided_into_wedges(|_| Some(1)).second_order(mean).unwrap()),
        ("ten-node tetrahedra", |mesh| mesh.divided(|_| true).second_order(mean).unwrap()),
    ];
    for (what, divide) in kinds {
        for count in [[2, 2, 1], [2, 2, 2]] {
            for matching in [true, false] {
                for swap in [1, 2, 100] {
                    let elements = |k: usize| match matching {
                        true => [2, 2, 2],
                        false => [2 + k % 2, 2 + usize::from(k % 3 == 1), 1 + k % 3],
                    };
                    let (text, meshes) = tied_blocks(count, elements, swap, divide);
                    let meshes: Vec<(&str, Mesh)> =
                        meshes.iter().map(|(name, mesh)| (name.as_str(), mesh.clone())).collect();
                    let mut problem = problem_with(&text, &meshes);
                    let density = problem.initial_density().clone();
                    let run = forward(&mut problem, &density);
                    let last = run.path.states.last().unwrap().state.clone();
                    let d = &last.unknowns;
                    let all: Vec<Matrix3<f64>> = (0..problem.mesh.elements.len())
                        .flat_map(|element| deformation_gradients(&problem.mesh, element, d))
                        .collect();
                    // stretched along x, narrower across, everywhere alike
                    let first = all[0];
                    assert!(first[(0, 0)] > 1.05 && (first[(1, 1)] - first[(2, 2)]).abs() < 1e-10);
                    let off = all.iter().map(|f| (f - first).amax()).fold(0.0, f64::max);
                    let contact = contact_path(&mut problem, &run).pop().unwrap();
                    let traction = contact.iter().filter(|row| row.covered_area > 0.0).map(|row| {
                        let z = nalgebra::Vector3::from(row.global_multiplier);
                        // the ties across x transmit 10 per current area, the others nothing
                        z.norm().min((z.norm() - 10.0 * first[(1, 1)] * first[(2, 2)]).abs())
                    });
                    let traction = traction.fold(0.0, f64::max);
                    let name = format!("{what}, {count:?}, matching: {matching}, swapped every {swap}");
                    println!("{name}: F off by {off:.1e}, traction by {traction:.1e}");
                    assert!(off < 1e-10 && traction < 1e-8, "{name}: F off by {off:e}, traction by {traction:e}");
                }
            }
        }
    }
}
