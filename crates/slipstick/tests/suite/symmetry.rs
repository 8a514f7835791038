//! Symmetry planes: a half and a quarter of the bodies compared with the whole, and with finite
//! differences.

use crate::common::scene::{LAGRANGE, augmented, penalty};
use crate::common::*;
use slipstick::build::{Problem, optimization};
use slipstick::design::ElementValues;
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_path::Silent;
use std::collections::BTreeMap;

/// A block with a curved bottom that is pressed onto a slab and, if `slides`, moved along x;
/// everything is symmetric in z, and in x at rest. `axes`: which halves are meshed (x, z).
#[derive(Debug, Clone, Copy)]
struct Cut {
    axes: [bool; 2],
    slides: bool,
    shape: &'static str,
    /// Whether the gap is measured between smooth surfaces.
    smooth: bool,
    /// Whether the bodies consist of wedges along z, which a plane normal to z does not change.
    wedges: bool,
}

impl Cut {
    fn text(&self, enforcement: &str) -> String {
        let mut text = String::new();
        for name in ["slab", "block"] {
            text += &format!(
                "[[body]]\nname = '{name}'\nmesh = {{ file = '{name}' }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            );
        }
        for (axis, _) in ["x", "z"].iter().zip(self.axes).filter(|(_, cut)| *cut) {
            text += &format!("[[symmetry]]\nnormal = '{axis}'\n");
        }
        let slide = if self.slides { ", { t = 1.0, u = [0.35, -0.22, 0] }" } else { "" };
        text += &format!(
            "[[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\nfriction = 0.3\nmultiplier_shape = '{}'\n\
             surfaces = '{}'\nenforcement = {enforcement}\n[[dirichlet]]\nset = 'slab_ymin'\n[[dirichlet]]\nset = 'block_ymax'\n\
             motion = [{{ t = 0.5, u = [0, -0.2, 0] }}{slide}]\n[load_path]\nsteps = 6\ntolerance = {{ relative = 1e-12 }}\n\
             [design]\nbodies = ['slab', 'block']\ninitial = 0.5\nvolume_fraction = 0.5\nsensitivity_filter = {{ radius = 0.7 }}\n\
             [objective]\ncontact_force = {{ steps = 'all' }}\n[optimizer]\niterations = 2\n",
            self.shape,
            if self.smooth { "smooth" } else { "faceted" }
        );
        text
    }

    fn meshes(&self) -> Vec<(&'static str, Mesh)> {
        let part = |name, size: f64, y: [f64; 2], elements: [usize; 3]| {
            let low = self.axes.map(|cut| if cut { 0.0 } else { -size });
            let count = |axis: usize, whole: usize| if self.axes[axis] { whole / 2 } else { whole };
            let shape = BoxShape {
                min: [low[0], y[0], low[1]],
                max: [size, y[1], size],
                elements: [count(0, elements[0]), elements[1], count(1, elements[2])],
                grading: [1.0; 3],
            };
            box_mesh(name, &shape).unwrap()
        };
        let slab = part("slab", 1.5, [0.0, 1.0], [6, 2, 4]);
        let mut block = part("block", 0.8, [1.0, 1.8], [4, 1, 6]);
        for [x, y, z] in &mut block.nodes {
            *y += (0.25 * *x * *x + 0.2 * *z * *z) * (1.8 - *y) / 0.8;
        }
        let along = self.wedges.then_some(2);
        vec![("slab", slab), ("block", block)]
            .into_iter()
            .map(|(name, mesh)| (name, mesh.divided_into_wedges(|_| along)))
            .collect()
    }

    fn problem(&self, enforcement: &str) -> Problem {
        problem_with(&self.text(enforcement), &self.meshes())
    }
}

/// Key of a place, equal for the same nodes and elements of part and whole.
fn key(x: [f64; 3]) -> [i64; 3] {
    x.map(|x| (x * 1e6).round() as i64)
}

/// Key of a node: nodes of the two bodies may coincide.
fn node_key(mesh: &Mesh, node: usize) -> (usize, [i64; 3]) {
    (usize::from(node >= mesh.bodies[1].nodes.start), key(mesh.nodes[node]))
}

/// A density that is symmetric in x and z.
fn density(problem: &Problem) -> ElementValues {
    let wave = |x: [f64; 3]| 0.65 + 0.2 * (5.0 * x[0] * x[0] + 3.0 * x[1]).sin() * (4.0 * x[2] * x[2]).cos();
    problem.mesh.centroids().into_iter().map(wave).collect()
}

/// Largest differences between part and whole.
#[derive(Debug)]
struct Apart {
    /// Relative, of θ.
    objective: f64,
    /// Of displacements on the path. \[L\]
    displacement: f64,
    /// Of tractions at the end, relative to the largest.
    traction: f64,
    /// Of the gradient, relative to its largest entry.
    gradient: f64,
}

/// Compares part and whole; `supports`: with simple supports on the planes instead.
fn compare(cut: Cut, enforcement: &str, supports: bool) -> Apart {
    let mut text = cut.text(enforcement);
    if supports {
        for axis in ["x", "z"] {
            let normal = if axis == "x" { "[1, 0, 0]" } else { "[0, 0, 1]" };
            text = text.replace(
                &format!("[[symmetry]]\nnormal = '{axis}'\n"),
                &format!(
                    "[[set]]\nname = 'cut_{axis}'\nplane = {{ point = [0, 0, 0], normal = {normal} }}\n\
                     [[set]]\nname = 'free_{axis}'\nwithin = 'cut_{axis}'\nboxes = [{{ min = [-9, 0.01, -9], max = [9, 1.79, 9] }}]\n\
                     [[dirichlet]]\nset = 'free_{axis}'\ncomponents = ['{axis}']\n"
                ),
            );
        }
    }
    let mut part = problem_with(&text, &cut.meshes());
    let mut whole = Cut { axes: [false; 2], ..cut }.problem(enforcement);
    let images = f64::from(1 << cut.axes.iter().filter(|&&cut| cut).count());
    assert!(part.mesh.elements.len() as f64 * images == whole.mesh.elements.len() as f64);
    let densities = [density(&part), density(&whole)];
    let (a, b) = (forward(&mut part, &densities[0]), forward(&mut whole, &densities[1]));
    let mut apart =
        Apart { objective: (a.value * images / b.value - 1.0).abs(), displacement: 0.0, traction: 0.0, gradient: 0.0 };
    let place: BTreeMap<_, usize> = (0..whole.mesh.nodes.len()).map(|n| (node_key(&whole.mesh, n), n)).collect();
    for ((_, p), (_, q)) in a.path.completed().zip(b.path.completed()) {
        for n in 0..part.mesh.nodes.len() {
            let m = place[&node_key(&part.mesh, n)];
            for c in 0..3 {
                let difference = p.state.unknowns[3 * n + c] - q.state.unknowns[3 * m + c];
                apart.displacement = apart.displacement.max(difference.abs());
            }
        }
    }
    let (p, q) = (contact_path(&mut part, &a).pop().unwrap(), contact_path(&mut whole, &b).pop().unwrap());
    let expected: BTreeMap<_, _> = q.iter().map(|c| (key(whole.mesh.nodes[c.node as usize]), c)).collect();
    let largest = q.iter().map(|c| c.multiplier[0]).fold(0.0, f64::max);
    assert!(largest > 50.0, "pressed by {largest}");
    for c in &p {
        let e = expected[&key(part.mesh.nodes[c.node as usize])];
        for (found, expected) in c.global_multiplier.iter().zip(e.global_multiplier) {
            apart.traction = apart.traction.max((found - expected).abs() / largest);
        }
    }
    let (f, g) = (part.analysis.gradient(&a).unwrap(), whole.analysis.gradient(&b).unwrap());
    let scale = g.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
    let element: BTreeMap<_, usize> =
        whole.mesh.centroids().into_iter().enumerate().map(|(e, x)| (key(x), e)).collect();
    for (e, x) in part.mesh.centroids().into_iter().enumerate() {
        apart.gradient = apart.gradient.max((f[e] - g[element[&key(x)]]).abs() / scale);
    }
    apart
}

/// The bounds are our own: the remaining error is due to the overlap of slave facets that are
/// inclined to the plane, whose projection is cut there. Simple supports at the plane, with their
/// one-sided normals and tractions across it, are far worse.
#[test]
fn a_part_is_a_part_of_the_whole() {
    let weighted = "{ penalty = { stiffness = 100000.0, scaling = 'weighted' } }".to_string();
    for enforcement in [LAGRANGE.to_string(), penalty(2e4), weighted, augmented(1e4, 1e-11)] {
        let slides = |shape| Cut { axes: [false, true], slides: true, shape, smooth: false, wedges: false };
        let rests = Cut { axes: [true, true], slides: false, shape: "standard", smooth: false, wedges: false };
        let wedges = Cut { wedges: true, ..slides("standard") };
        let smooth = Cut { smooth: true, ..slides("standard") };
        for cut in [slides("standard"), slides("dual"), rests, wedges, smooth] {
            let apart = compare(cut, &enforcement, false);
            println!("{enforcement} {cut:?}: {apart:?}");
            let Apart { objective, displacement, traction, gradient } = apart;
            // the cut also misses the height above the part that it cuts off
            let factor = if cut.smooth { 2.0 } else { 1.0 };
            assert!(objective < 1e-4 && displacement < 1e-3, "{apart:?}");
            assert!(traction < factor * 2e-3 && gradient < factor * 1e-3, "{apart:?}");
            let supports = compare(cut, &enforcement, true);
            assert!(supports.traction > 10.0 * traction, "{apart:?}, with mere supports {supports:?}");
        }
    }
}

/// The part's own gradient compared with central differences, for all methods.
#[test]
fn gradients_of_a_part_match_finite_differences() {
    for enforcement in [LAGRANGE.to_string(), penalty(2e4), augmented(1e4, 1e-11)] {
        let cut = Cut { axes: [false, true], slides: true, shape: "standard", smooth: false, wedges: false };
        let mut problem = cut.problem(&enforcement);
        let density = random_density(&problem, 3);
        let (found, expected) = along_a_direction(&mut problem, &density, 9, 1e-5);
        assert!((found / expected - 1.0).abs() < 1e-7, "{enforcement}: {found:e} instead of {expected:e}");
    }
}

/// Two steps of the optimizer agree between part and whole: objective, volume and filters are
/// consistent.
#[test]
fn designs_of_a_part_are_those_of_the_whole() {
    let cut = Cut { axes: [false, true], slides: true, shape: "standard", smooth: false, wedges: false };
    let filters = ["sensitivity_filter = {", "projection = { sharpness = 2 }\ndensity_filter = {"];
    for filter in filters {
        let designs = [cut, Cut { axes: [false; 2], ..cut }].map(|cut| design(cut, filter));
        let [part, whole] = designs;
        assert_eq!(2 * part.len(), whole.len());
        let (low, high) = whole.values().fold((1.0, 0.0), |(low, high), v| (f64::min(low, *v), f64::max(high, *v)));
        assert!(high - low > 0.1, "the design hardly moved: {low} to {high}");
        for (place, density) in part {
            assert!((density - whole[&place]).abs() < 1e-3, "{place:?}: {density} and {}", whole[&place]);
        }
    }
}

/// The optimized density at each centroid.
fn design(cut: Cut, filter: &str) -> BTreeMap<[i64; 3], f64> {
    let read = |name: &str| {
        let mesh = cut.meshes().into_iter().find(|mesh| mesh.0 == name).unwrap().1;
        Ok(abaqus::abaqus(&mesh).into_bytes())
    };
    let text = cut.text(LAGRANGE).replace("sensitivity_filter = {", filter);
    let case = slipstick::case::parse_case_with(&text, "symmetry.toml", &read).unwrap().case;
    let mut optimization = optimization(&case, problem_with(&text, &cut.meshes())).unwrap();
    while !optimization.finished() {
        optimization.advance(&mut Silent).unwrap();
    }
    let design = optimization.density();
    let places = optimization.problem.mesh.centroids();
    places.into_iter().map(key).zip(design.to_vec()).collect()
}

#[test]
fn planes_that_are_none_are_refused() {
    let cut = Cut { axes: [false, true], slides: true, shape: "standard", smooth: false, wedges: false };
    let read = |name: &str| {
        let mesh = cut.meshes().into_iter().find(|mesh| mesh.0 == name).unwrap().1;
        Ok(abaqus::abaqus(&mesh).into_bytes())
    };
    let told = |text: &str| {
        let case = slipstick::case::parse_case_with(text, "symmetry.toml", &read).unwrap().case;
        slipstick::build::build(&case).err().expect("refused").to_string()
    };
    let text = cut.text(LAGRANGE);
    let through = told(&text.replace("normal = 'z'", "normal = 'z'\nat = 0.375"));
    assert!(through.contains("symmetry[0].at: no node lies within"), "{through}");
    let sides = told(&text.replace("normal = 'z'", "normal = 'z'\nat = 0.75"));
    assert!(sides.contains("symmetry[0].at: bodies lie on both sides of the plane z = 0.75"), "{sides}");
    let off = told(&text.replace("u = [0.35, -0.22, 0]", "u = [0.35, -0.22, 0.1]"));
    assert!(off.contains("dirichlet[1].motion: node") && off.contains("off its symmetry plane"), "{off}");
}

/// An eighth of a cube under pressure, held only by three symmetry planes: uniaxial stress, whose
/// stretches must give the stresses by (100). A load on a plane has no effect, which is reported.
#[test]
fn planes_alone_hold_an_eighth_of_a_cube() {
    let text = "[[body]]\nname = 'cube'\nbox = { min = [0, 0, 0], max = [1, 1, 1], elements = [2, 2, 2] }\n\
                material = { neo_hooke = { youngs_modulus = 100.0, poisson_ratio = 0.3 } }\n\
                [[symmetry]]\nnormal = 'x'\n[[symmetry]]\nnormal = 'y'\n[[symmetry]]\nnormal = 'z'\n\
                [[load]]\nsurface = 'cube_ymax'\ntraction = [0, -20, 0]\n[[load]]\nsurface = 'cube_ymin'\npressure = 3\n\
                [load_path]\nsteps = 2\ntolerance = { relative = 1e-13 }\n";
    let resolved = slipstick::case::parse_case(text, "cube.toml").unwrap();
    resolved.require(&["dirichlet"]).expect("planes hold it");
    assert!(resolved.warnings.is_empty(), "{:?}", resolved.warnings);
    let mut problem = slipstick::build::build(&resolved.case).unwrap();
    let told = slipstick::check::inspect(&resolved.case, &mut problem).unwrap();
    let notices: Vec<&str> = told.notices.iter().map(|notice| notice.path.as_str()).collect();
    assert_eq!(notices, ["load[1].surface"]);
    assert_eq!(told.bodies[0].free_motions, 0);
    let density = problem.initial_density().clone();
    let forward = forward(&mut problem, &density);
    let d = &forward.path.states.last().unwrap().state.unknowns;
    let corner = problem.mesh.nodes.iter().position(|x| *x == [1.0; 3]).unwrap();
    // P_yy = −20, P_xx = 0: 2c (λ − J^(−2β)/λ) along each axis
    let (c, beta) = (100.0 / 5.2, 0.3 / 0.4);
    let [x, y, z] = [0, 1, 2].map(|axis| 1.0 + d[3 * corner + axis]);
    let volume = x * y * z;
    let stress = |l: f64| 2.0 * c * (l - volume.powf(-2.0 * beta) / l);
    assert!((stress(y) + 20.0).abs() < 1e-9, "{}", stress(y));
    assert!(stress(x).abs() < 1e-9 && stress(z).abs() < 1e-9, "{} {}", stress(x), stress(z));
}
