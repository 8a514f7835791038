//! Edges of bodies at which the slave surface ends: the work of frictionless contact there, and
//! gradients.

use super::gradients::{check, methods};
use super::{body, even, grid, solve};
use crate::common::problem_with;
use crate::common::scene::Scene;
use slipstick::quantities::quantities;
use slipstick_mesh::Mesh;

/// Two elastic arms, clamped at their left ends, in plane strain: the upper one is pressed down at
/// its middle until its end slides along the lower one, which bends. `pair`: slave and master. Returns
/// the fraction of the external work that contact takes, and the deflection of the lower arm's end.
fn arms(pair: [&str; 2], shape: &str, normals: &str) -> [f64; 2] {
    pressed(upper_arm(), -1.1, pair, shape, normals)
}

/// The upper arm, with a sharp edge at its end.
pub(super) fn upper_arm() -> Mesh {
    grid("up", [&even(0.0, 3.0, 30), &even(1.2, 1.6, 4), &[0.0, 0.2]])
}

/// The same with another upper arm, whose middle is moved by `v`; empty `normals` are the default.
pub(super) fn pressed(up: Mesh, v: f64, pair: [&str; 2], shape: &str, normals: &str) -> [f64; 2] {
    let [slave, master] = pair;
    let text = format!(
        "{}{}[[set]]\nname = 'all'\nboxes = [{{ min = [-9, -9, -9], max = [9, 9, 9] }}]\n\
         [[set]]\nname = 'middle'\nboxes = [{{ min = [1.49, 1.55, -9], max = [1.51, 9, 9] }}]\n\
         [[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = 0.0\n\
         multiplier_shape = '{shape}'\n{}\n\
         [[dirichlet]]\nset = 'all'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'up_xmin'\ncomponents = ['x', 'y']\n\
         [[dirichlet]]\nset = 'low_xmin'\ncomponents = ['x', 'y']\n\
         [[dirichlet]]\nset = 'middle'\ncomponents = ['y']\nmotion = [{{ t = 1, u = [0, {v:?}, 0] }}]\n\
         [[quantity]]\nname = 'end'\ndisplacement = {{ set = 'low_xmax', component = 'y' }}\n\
         [load_path]\nsteps = 24\n",
        body("up", 1.0),
        body("low", 1.0),
        if normals.is_empty() { String::new() } else { format!("normals = '{normals}'") },
    );
    let low = grid("low", [&even(0.0, 4.03, 40), &even(-0.4, 0.0, 4), &[0.0, 0.2]]);
    let solved = solve(&text, &[("up", up), ("low", low)]);
    let found = quantities(&solved.problem, &solved.forward.path);
    let last = |name: &str| *found.get(name).expect(name).last().expect("a row");
    [last("contact_work") / last("external_work"), last("end")]
}

/// The normal of the edge is that of the face it slides on: frictionless contact takes no work, and
/// either side can be the slave. With averaged normals, the edge pushes along the normal of the end
/// that bends away, which takes 2 % of the work. By default, since the arms are apart at the start, normals are those of
/// the face.
#[test]
fn frictionless_contact_at_the_end_of_an_arm_takes_no_work() {
    for shape in ["standard", "dual"] {
        let edge = arms(["up_ymin", "low_ymax"], shape, "touched");
        let face = arms(["low_ymax", "up_ymin"], shape, "touched");
        let averaged = arms(["up_ymin", "low_ymax"], shape, "averaged");
        assert_eq!(arms(["up_ymin", "low_ymax"], shape, ""), edge, "the default");
        let taken = [averaged[0], edge[0], face[0]].map(|taken| 100.0 * taken);
        let apart = 100.0 * (edge[1] / face[1] - 1.0);
        println!("{shape}: taken {taken:.2?} %, deflections {apart:.2} % apart");
        assert!(edge[0].abs() < 1e-3 && face[0].abs() < 1e-3, "{shape}: {edge:?} {face:?}");
        assert!((edge[1] / face[1] - 1.0).abs() < 3e-3, "{shape}: {edge:?} {face:?}");
        assert!(averaged[0] > 0.015, "{shape}: {averaged:?}");
    }
}

/// A block whose side lies on a wall is compressed and driven into it at its top: without friction, contact takes no
/// work. The driven face counts as a face of the block, so that the edge between it and the slave surface has the
/// normal of the wall, which it digs into; with averaged normals, it pushes along the normal of the side. If the top is
/// only held along its normal, it may be a section of a larger block.
#[test]
fn frictionless_contact_of_a_driven_edge_takes_no_work() {
    let text = |normals: &str, drop: f64| {
        format!(
            "[[body]]\nname = 'block'\nbox = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [3, 4, 3] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 800, poisson_ratio = 0.1 }} }}\n\
             [[body]]\nname = 'wall'\nbox = {{ min = [-0.4, 0, -0.2], max = [0, 1.5, 1.2], elements = [1, 5, 4] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 7000, poisson_ratio = 0.3 }} }}\n\
             [[contact]]\nslave = 'block_xmin'\nmaster = 'wall_xmax'\nfriction = 0\nnormals = '{normals}'\n\
             [[dirichlet]]\nset = 'wall_xmin'\n\
             [[dirichlet]]\nset = 'block_ymin'\ncomponents = ['y']\n\
             [[dirichlet]]\nset = 'block_ymax'\nmotion = [{{ t = 1, u = [-0.04, {drop:?}, 0] }}]\n\
             [load_path]\nsteps = 16\n"
        )
    };
    let taken = |normals: &str| {
        let solved = solve(&text(normals, -0.04), &[]);
        let found = quantities(&solved.problem, &solved.forward.path);
        let last = |name: &str| *found.get(name).expect(name).last().expect("a row");
        last("contact_work") / last("external_work")
    };
    let (averaged, touched) = (taken("averaged"), taken("touched"));
    println!("taken: {:.2} %, {:.2} %", 100.0 * averaged, 100.0 * touched);
    assert!(averaged.abs() > 0.04 && touched.abs() < 0.01, "{averaged}, {touched}");
    // the inner nodes of the upper edge of the side
    for (drop, expected) in [(-0.04, 2), (0.0, 0)] {
        let problem = problem_with(&text("touched", drop), &[]);
        let at = |node: u32| problem.mesh.nodes[node as usize];
        let nodes = problem.analysis.model().interfaces()[0].interface.slave_nodes();
        let inner = nodes.iter().filter(|slave| at(slave.node)[1] == 1.0 && (at(slave.node)[2] - 0.5).abs() < 0.4);
        assert_eq!(inner.filter(|slave| slave.follows_master()).count(), expected, "{drop}");
    }
}

/// A block that lies on a slab has averaged normals by default, unless it is more than 2.5 times as stiff, or a support
/// drives nodes of its side, which then follow the master. A ring whose facets meet at 13.8° follows a slab with
/// larger facets only; one of 20° follows any.
#[test]
fn edges_that_dig_in_follow_the_master_by_default() {
    let follow = |block: &str, modulus: f64, slave: &str, slab: [usize; 3], drive: &str| {
        let text = format!(
            "[[body]]\nname = 'block'\n{block}\n\
             material = {{ neo_hooke = {{ youngs_modulus = {modulus:?}, poisson_ratio = 0.3 }} }}\n\
             [[body]]\nname = 'slab'\nbox = {{ min = [-2, -1, -1], max = [2, 0, 1], elements = {slab:?} }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000, poisson_ratio = 0.3 }} }}\n\
             [[contact]]\nslave = '{slave}'\nmaster = 'slab_ymax'\nfriction = 0.1\nsides = 'as_given'\n\
             [[dirichlet]]\nset = 'slab_ymin'\n\
             [[dirichlet]]\nset = '{drive}'\nmotion = [{{ t = 1, u = [0.1, -0.04, 0] }}]\n[load_path]\nsteps = 2\n"
        );
        let problem = problem_with(&text, &[]);
        let nodes = problem.analysis.model().interfaces()[0].interface.slave_nodes();
        let follow = nodes.iter().filter(|slave| slave.follows_master());
        follow.map(|slave| problem.mesh.nodes[slave.node as usize]).collect::<Vec<_>>()
    };
    let block = "box = { min = [-0.6, 0, -0.5], max = [0.6, 0.7, 0.5], elements = [3, 2, 2] }";
    let of = |modulus: f64, drive: &str| follow(block, modulus, "block_ymin", [8, 2, 4], drive).len();
    assert_eq!([1000.0, 2400.0, 100.0].map(|modulus| of(modulus, "block_ymax")), [0; 3]);
    // all nodes of the bottom at its edges, of 4 × 3
    assert_eq!(of(2600.0, "block_ymax"), 10);
    assert_eq!(of(1000.0, "block_xmax"), 10, "the lower edge of the driven face digs in");
    let ring = |elements: usize, slab: usize| {
        let ring = format!(
            "half_ring = {{ inner_radius = 0.4, outer_radius = 0.9, width = 1, elements = [{elements}, 2, 2] }}\n\
             place = {{ translate = [0, 0.91, 0] }}"
        );
        let found = follow(&ring, 1000.0, "block_outer", [slab, 2, 4], "block_ends");
        // away from the ring's own edges
        found.iter().filter(|[_, y, z]| *y < 0.5 && z.abs() < 0.4).count() > 0
    };
    assert_eq!([ring(13, 6), ring(13, 30), ring(9, 30)], [true, false, true]);
}

/// A rigid punch with sharp edges, 1 wide, lies on an elastic layer. Its edges dig in whether a motion or a force drives
/// it: pressed by the force that the motion needs, it comes to the same place, where its edges are those of a slave
/// surface with all three faces. Frictionless contact takes a tenth of the work that it takes with averaged normals.
#[test]
fn a_rigid_punch_digs_in_however_it_is_driven() {
    let punch = |slave: &str, normals: &str, force: Option<f64>| {
        let drive = match force {
            None => "[[dirichlet]]\nset = 'up'\nmotion = [{ t = 1, u = [0, -0.1, 0] }]\n".into(),
            Some(force) => format!(
                "[[dirichlet]]\nset = 'up'\ncomponents = ['x', 'z', 'rx', 'ry', 'rz']\n\
                 [[load]]\nsurface = 'up'\nforce = [0, {:?}, 0]\n",
                -force
            ),
        };
        let normals = if normals.is_empty() { String::new() } else { format!("normals = '{normals}'\n") };
        let text = format!(
            "[[body]]\nname = 'low'\nbox = {{ min = [-2, -1, 0], max = [2, 0, 0.5], elements = [16, 4, 1] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000, poisson_ratio = 0.3 }} }}\n\
             [[body]]\nname = 'up'\nbox = {{ min = [-0.5, 0, 0], max = [0.5, 0.5, 0.5], elements = [4, 2, 1] }}\nrigid = {{}}\n\
             [[surface]]\nname = 'faces'\nof = ['up_ymin', 'up_xmin', 'up_xmax']\n\
             [[contact]]\nslave = '{slave}'\nmaster = 'low_ymax'\nfriction = 0.0\nsides = 'as_given'\n{normals}\
             [[dirichlet]]\nset = 'low_ymin'\n\
             [[dirichlet]]\nset = 'low_zmin'\ncomponents = ['z']\n[[dirichlet]]\nset = 'low_zmax'\ncomponents = ['z']\n\
             {drive}[load_path]\nsteps = 10\ntolerance = {{ relative = 1e-12 }}\n"
        );
        let solved = solve(&text, &[]);
        let found = quantities(&solved.problem, &solved.forward.path);
        let last = |name: &str| *found.get(name).expect(name).last().expect("a row");
        [last("reaction_low_ymin_y"), last("displacement_up_y"), (last("contact_work") / last("external_work")).abs()]
    };
    let moved = punch("up_ymin", "", None);
    let loaded = punch("up_ymin", "", Some(moved[0]));
    let [faces, averaged] = [punch("faces", "", None), punch("up_ymin", "averaged", None)];
    println!("{moved:?} {loaded:?} {faces:?} {averaged:?}");
    assert!((loaded[1] / -0.1 - 1.0).abs() < 1e-8, "{loaded:?}");
    assert!((faces[0] / moved[0] - 1.0).abs() < 1e-8, "{faces:?} {moved:?}");
    assert!(moved[2] < 2e-4 && averaged[2] > 5e-4, "{moved:?} {averaged:?}");
    let away = punch("up_ymin", "averaged", Some(moved[0]));
    assert!((away[1] / -0.1 - 1.0).abs() > 1e-4, "averaged normals would be another model: {away:?}");
}

/// A slave surface of two blocks: its edges dig in if any of the two is much stiffer than the slab, whichever comes first.
#[test]
fn any_stiff_body_of_a_slave_digs_in() {
    let followers = |moduli: [f64; 2]| {
        let block = |name: &str, from: f64, modulus: f64| {
            format!(
                "[[body]]\nname = '{name}'\n\
                 box = {{ min = [{from:?}, 0, -0.5], max = [{:?}, 0.5, 0.5], elements = [2, 1, 2] }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = {modulus:?}, poisson_ratio = 0.3 }} }}\n\
                 [[dirichlet]]\nset = '{name}_ymax'\nmotion = [{{ t = 1, u = [0, -0.04, 0] }}]\n",
                from + 0.6
            )
        };
        let text = format!(
            "{}{}[[body]]\nname = 'slab'\nbox = {{ min = [-2, -1, -1], max = [2, 0, 1], elements = [8, 2, 4] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000, poisson_ratio = 0.3 }} }}\n\
             [[surface]]\nname = 'feet'\nof = ['one_ymin', 'two_ymin']\n\
             [[contact]]\nslave = 'feet'\nmaster = 'slab_ymax'\nfriction = 0.1\nsides = 'as_given'\n\
             [[dirichlet]]\nset = 'slab_ymin'\n[load_path]\nsteps = 2\n",
            block("one", -1.0, moduli[0]),
            block("two", 0.4, moduli[1]),
        );
        let problem = problem_with(&text, &[]);
        let nodes = problem.analysis.model().interfaces()[0].interface.slave_nodes();
        nodes.iter().filter(|slave| slave.follows_master()).count()
    };
    // all but the middle of the 3 × 3 nodes of each foot
    assert_eq!([[1e3, 1e3], [1e3, 1e5], [1e5, 1e3]].map(followers), [0, 16, 16]);
}

/// A block whose bottom alone is the slave is pressed onto a slab and dragged: all nodes of the bottom
/// lie on edges of the block, and their normals depend on both bodies.
#[test]
fn gradient_where_the_slave_surface_ends_at_an_edge() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let scene = Scene {
                slab: [3, 1, 2],
                block: [2, 1, 1],
                corner: [0.4, 1.0, 0.1],
                enforcement: enforcement.clone(),
                shape,
                friction: 0.4,
                motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.2, -0.12, 0.06] }]".into(),
                steps: 5,
                ..Scene::default()
            };
            let text = scene.text().replace("multiplier_shape", "normals = \"touched\"\nmultiplier_shape");
            let mut problem = problem_with(&text, &[]);
            let nodes = problem.analysis.model().interfaces()[0].interface.slave_nodes();
            assert!(nodes.len() == 6 && nodes.iter().all(|slave| slave.follows_master()), "{method} {shape}");
            let (statuses, _) = check(&format!("{method} {shape}"), &mut problem);
            let moving = |state: &Vec<char>| state.iter().filter(|status| **status != 'o').count() > 2;
            assert!(statuses.last().is_some_and(moving), "{method} {shape}: {statuses:?}");
        }
    }
}
