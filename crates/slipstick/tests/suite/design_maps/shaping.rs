//! Symmetric, repeated, extruded and printable designs, and passive regions.

use slipstick::case::template;
use slipstick::design::{ElementValues, Role};
use slipstick::optimize::Optimization;
use slipstick_path::Silent;

use super::uneven;
use crate::common::optimization::{finish, prepared};
use crate::common::problem;

/// The cube on a cuboid of 8 × 3 × 4 elements, of which the cuboid is designed.
fn text(design: &str, optimizer: &str) -> String {
    let text = template("cube-on-cuboid").expect("a template").text;
    let (before, _) = text.split_once("[design]").expect("a design");
    let before = before.replace("elements = [4, 1, 1]", "elements = [8, 3, 4]").replace("steps = 10", "steps = 3");
    format!(
        "{before}
[design]
bodies = ['cuboid']
volume_fraction = 0.6
{design}
[objective]
contact_force = {{ steps = 'all' }}
[optimizer]
{optimizer}
"
    )
}

/// The number of element (i, j, k) of the cuboid.
fn element([i, j, k]: [usize; 3]) -> usize {
    i + 8 * (j + 3 * k)
}

fn all() -> impl Iterator<Item = [usize; 3]> {
    (0..96).map(|e| [e % 8, e / 8 % 3, e / 24])
}

/// Where another element must have the same density.
type Image = fn([usize; 3]) -> [usize; 3];

/// Keys of [design], the number of variables, and pairs of elements with the same density.
const TIES: &[(&str, usize, &[Image])] = &[
    ("symmetry = [{ normal = 'x', at = 2 }]", 48, &[|[i, j, k]| [7 - i, j, k]]),
    ("symmetry = [{ normal = [0, 0, -2], through = [9, 9, 0.5] }]", 48, &[|[i, j, k]| [i, j, 3 - k]]),
    (
        "symmetry = [{ normal = 'x', at = 2 }, { normal = 'z', at = 0.5 }]",
        24,
        &[|[i, j, k]| [7 - i, j, k], |[i, j, k]| [i, j, 3 - k]],
    ),
    ("symmetry = [{ axis = 'y', through = [2, 0, 0.5], folds = 2 }]", 48, &[|[i, j, k]| [7 - i, j, 3 - k]]),
    ("extrude = 'z'", 24, &[|[i, j, k]| [i, j, (k + 1) % 4]]),
    (
        "extrude = [0, -1, 0]\nsymmetry = [{ normal = 'x', at = 2 }]",
        16,
        &[|[i, j, k]| [i, (j + 1) % 3, k], |[i, j, k]| [7 - i, j, k]],
    ),
    ("pattern = [{ step = [1, 0, 0], count = 4 }]", 24, &[|[i, j, k]| [(i + 2) % 8, j, k]]),
    (
        "pattern = [{ step = [2, 0, 0], count = 2 }, { step = [0, 0, 0.5], count = 2 }]",
        24,
        &[|[i, j, k]| [(i + 4) % 8, j, k], |[i, j, k]| [i, j, (k + 2) % 4]],
    ),
];

/// Ties hold to the last bit, with and without filter and projection, although a filter that is
/// truncated at the ends of a column treats its elements differently.
#[test]
fn ties_hold_to_the_last_bit() {
    for (keys, count, images) in TIES {
        for maps in ["", "density_filter = { radius = 0.8 }\nprojection = { sharpness = 3 }"] {
            let problem = problem(&text(&format!("{keys}\n{maps}"), "iterations = 1"));
            let map = problem.map().unwrap();
            assert_eq!((map.variables().count(), map.variables().designed().len()), (*count, 96), "{keys}");
            let density = map.densities(&uneven(*count));
            for (image, at) in images.iter().flat_map(|image| all().map(move |at| (image, at))) {
                assert_eq!(density[element(at)], density[element(image(at))], "{keys} {maps} {at:?}");
            }
            let different = all().filter(|&at| density[element(at)] != density[0]).count();
            assert!(different > 48);
        }
    }
}

/// A tie may be limited to a body, beside one that lacks the symmetry: the cube's elements are free.
#[test]
fn ties_of_one_body() {
    let text = text("symmetry = [{ normal = 'x', at = 2, body = 'cuboid' }]", "iterations = 1");
    let text = text.replace("bodies = ['cuboid']", "bodies = ['cuboid', 'cube']");
    let problem = problem(&text.replace("elements = [1, 1, 1]", "elements = [3, 1, 1]"));
    let variables = problem.variables().unwrap();
    assert_eq!((variables.designed().len(), variables.count()), (99, 51));
}

/// A clutch of two rings with 34 and 38 elements around, each with its own cyclic symmetry, and with
/// mirror planes through the axis.
#[test]
fn rings_have_sectors() {
    let text = template("clutch").expect("a template").text;
    let with = |keys: &str| {
        let problem = problem(&text.replace("initial = 0.2\n", keys));
        let variables = problem.variables().unwrap();
        (variables.designed().len(), variables.count())
    };
    let all = 3 * 6 * (34 + 38);
    assert_eq!(with("symmetry = [{ axis = 'y', folds = 2 }]\n"), (all, all / 2));
    let lower = "{ axis = 'y', folds = 17, body = 'lower' }";
    let upper = "{ axis = [0, 2, 0], folds = 19, body = 'upper' }";
    assert_eq!(with(&format!("symmetry = [{lower}, {upper}]\n")), (all, 3 * 6 * 4));
    // in each of the layers, the two elements of a sector mirror each other
    let planes = "{ normal = 'z', at = 0 }";
    assert_eq!(with(&format!("symmetry = [{lower}, {upper}, {planes}]\nextrude = 'y'\n")), (all, 3 * 2));
}

/// Passive elements keep their densities; their images are designed and tied to each other.
#[test]
fn passive_elements_are_left_out_of_ties() {
    let passive = "passive_solid = [{ min = [0, 0, 0], max = [0.5, 1, 1] }]";
    let problem = problem(&text(&format!("symmetry = [{{ normal = 'x', at = 2 }}]\n{passive}"), "iterations = 1"));
    let variables = problem.variables().unwrap();
    assert_eq!((variables.designed().len(), variables.count()), (84, 48));
    let density = problem.map().unwrap().densities(&uneven(48));
    for at in all().filter(|at| at[0] > 0 && at[0] < 7) {
        assert_eq!(density[element(at)], density[element([7 - at[0], at[1], at[2]])]);
    }
    assert!(all().filter(|at| at[0] == 0).all(|at| density[element(at)] == 1.0));
    assert!(all().filter(|at| at[0] == 7).all(|at| density[element(at)] != 1.0));
}

/// With a sensitivity filter, whole optimizations stay symmetric and improve.
#[test]
fn sensitivity_filters_work_with_ties() {
    let keys = "sensitivity_filter = { radius = 0.8 }\nsymmetry = [{ normal = 'x', at = 2 }]\nextrude = 'z'";
    let mut optimization = prepared(&text(keys, "iterations = 4"));
    let history = finish(&mut optimization);
    assert_eq!(optimization.state.x.len(), 12);
    let density = optimization.density();
    for [i, j, k] in all() {
        assert_eq!(density[element([i, j, k])], density[element([7 - i, j, (k + 1) % 4])]);
    }
    assert!(history.last().unwrap().objective < history[0].objective, "{history:?}");
}

/// In a tied optimization from the start of another one, a design that is not symmetric counts with
/// its mean, and a symmetric one is kept to the last bit.
#[test]
fn a_design_starts_from_means() {
    let mut problem = problem(&text("pattern = [{ step = [1, 0, 0], count = 4 }]", "iterations = 1"));
    let values: ElementValues =
        (0..problem.mesh.elements.len()).map(|e| if e < 96 { 0.1 * (e % 8) as f64 } else { 1.0 }).collect();
    problem.start_from(&values);
    for at in all() {
        // the mean over i, i + 2, i + 4 and i + 6
        let expected = 0.1 * (at[0] % 2 + 3) as f64;
        assert!((problem.initial_density()[element(at)] - expected).abs() < 1e-15);
    }
    let symmetric = problem.initial_density().clone();
    problem.start_from(&symmetric);
    assert_eq!(*problem.initial_density(), symmetric);
}

/// Each designed element is at most a little denser than its densest support.
fn assert_printable(optimization: &Optimization, below: impl Fn([usize; 3]) -> Option<[usize; 3]>, across: [usize; 2]) {
    let density = optimization.density();
    let cells = [8, 3, 4];
    let mut checked = 0;
    for at in all() {
        let Some(under) = below(at) else { continue };
        let mut supports = vec![under];
        for axis in across {
            for next in [under[axis].wrapping_sub(1), under[axis] + 1].into_iter().filter(|next| *next < cells[axis]) {
                let mut beside = under;
                beside[axis] = next;
                supports.push(beside);
            }
        }
        let support = supports.iter().map(|&at| density[element(at)]).fold(0.0, f64::max);
        assert!(density[element(at)] <= support + 0.05, "{at:?}");
        checked += 1;
    }
    assert!(checked >= 64);
}

/// Optimized designs can be printed, in any direction.
#[test]
fn designs_are_printable() {
    let maps = "density_filter = { radius = 0.5 }\nprojection = { sharpness = 4 }\ninitial = 0.6";
    let run = |direction: &str| {
        let design = format!("{maps}\noverhang = {{ direction = '{direction}' }}");
        let mut optimization = prepared(&text(&design, "iterations = 6\nmma = { move_limit = 0.3 }"));
        let history = finish(&mut optimization);
        assert!(optimization.density().iter().all(|phi| (0.0..=1.0).contains(phi)));
        let best = history.iter().map(|record| record.objective).fold(f64::INFINITY, f64::min);
        assert!(best < history[0].objective, "{history:?}");
        optimization
    };
    assert_printable(&run("y"), |[i, j, k]| Some([i, j.checked_sub(1)?, k]), [0, 2]);
    assert_printable(&run("-x"), |[i, j, k]| (i < 7).then_some([i + 1, j, k]), [1, 2]);
}

#[test]
fn passive_regions_by_hand() {
    let solid = |region: &str| -> Vec<usize> {
        let problem = problem(&text(&format!("passive_solid = [{region}]"), "iterations = 1").replace("0.6\n", "1\n"));
        let roles = problem.variables().unwrap().roles();
        (0..96).filter(|&e| roles[e] == Role::Solid).collect()
    };
    let where_ = |inside: fn([usize; 3]) -> bool| all().filter(|&at| inside(at)).map(element).collect::<Vec<usize>>();
    // centroids at 0.25 + i/2, (j + 1/2)/3, (k + 1/2)/4
    assert_eq!(solid("{ min = [0, 0, 0], max = [1, 1, 0.25] }"), where_(|[i, _, k]| i < 2 && k == 0));
    assert_eq!(
        solid("{ start = [0.25, 0, 0.5], end = [0.25, 0.6, 0.5], radius = 0.2 }"),
        where_(|[i, j, k]| i == 0 && j < 2 && (k == 1 || k == 2))
    );
    assert_eq!(
        solid("{ axis = 'x', through = [9, 0.5, 0.5], radius = 0.2 }"),
        where_(|[_, j, k]| j == 1 && (k == 1 || k == 2))
    );
    assert_eq!(solid("{ centre = [2.25, 0.5, 0.375], radius = 0.1 }"), [element([4, 1, 1])]);
    assert_eq!(solid("{ surface = 'cuboid_ymax', within = 0.2 }"), where_(|[_, j, _]| j == 2));
    assert_eq!(solid("{ surface = 'cuboid_xmin', within = 0.8 }"), where_(|[i, _, _]| i < 2));
    // the cube covers the top from 0.6 to 1.4 and from 0.1 to 0.9
    assert_eq!(solid("{ surface = 'cube_ymin', within = 0.17 }"), where_(|[i, j, _]| j == 2 && (i == 1 || i == 2)));
    assert_eq!(solid("{ set = 'cuboid_zmin', within = 0.126 }"), where_(|[_, _, k]| k == 0));
    let set = "[[set]]\nname = 'edge'\nboxes = [{ min = [0, 1, 0], max = [4, 1, 0] }]\n[design]";
    let on_edge = text("passive_solid = [{ set = 'edge', within = 0.33 }]", "iterations = 1");
    let problem = problem(&on_edge.replace("[design]", set));
    let found = problem.variables().unwrap().roles().iter().filter(|role| **role == Role::Solid).count();
    // from the centroid of an element at the edge to its nodes: (1/4² + 1/6² + 1/8²)^½ = 0.325
    assert_eq!(found, 8);
    let mut whole = prepared(
        &text("passive_solid = [{ body = 'cuboid' }]", "iterations = 1")
            .replace("bodies = ['cuboid']", "bodies = ['cuboid', 'cube']")
            .replace("volume_fraction = 0.6", "volume_fraction = 1.0"),
    );
    assert_eq!(whole.state.x.len(), 1);
    whole.advance(&mut Silent).unwrap();
}
