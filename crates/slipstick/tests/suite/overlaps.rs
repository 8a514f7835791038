//! Bodies that overlap while contact transmits no force: the depth, node and step by hand, and none
//! where contact acts or bodies are apart.

use slipstick::build::build;
use slipstick::case::parse_case;
use slipstick::check::{NoticeKind, inspect};
use slipstick::overlaps::{OpenOverlap, overlaps};
use slipstick_path::Silent;

const SLAB: &str = "[[body]]\nname = 'slab'\n\
    box = { min = [0, 0, 0], max = [3, 1, 3], elements = [9, 3, 9] }\n\
    material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n\
    [[dirichlet]]\nset = 'slab_ymin'\n";

const STIFF: &str = "material = { neo_hooke = { youngs_modulus = 1e6, poisson_ratio = 0.3 } }\n";

/// A cube of side 1 on its corner, which touches the slab, or starts lower by `low`.
fn corner(low: f64, motion: &str) -> String {
    let height = 1.0 + 0.75_f64.sqrt() - low;
    format!(
        "{SLAB}[[body]]\nname = 'cube'\nbox = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5], elements = [3, 3, 3] }}\n\
         place = {{ rotate = {{ axis = [-1, 0, 1], degrees = {} }}, translate = [1.2, {height:?}, 1.5] }}\n{STIFF}\
         [[surface]]\nname = 'three'\nof = ['cube_xmin', 'cube_ymin', 'cube_zmin']\n\
         [[surface]]\nname = 'rest'\nof = ['cube_xmax', 'cube_ymax', 'cube_zmax']\n\
         [[contact]]\nslave = 'slab_ymax'\nmaster = 'three'\nfriction = 0.2\n\
         [[dirichlet]]\nset = 'rest'\nmotion = {motion}\n[load_path]\nsteps = 4\n",
        (1.0 / 3.0_f64.sqrt()).acos().to_degrees()
    )
}

/// A half ball of radius 1 that touches the slab.
fn ball(elements: &str, motion: &str) -> String {
    format!(
        "{SLAB}[[body]]\nname = 'ball'\nhalf_ball = {{ radius = 1.0, elements = {elements} }}\n\
         place = {{ translate = [1.5, 2.0, 1.5] }}\n{STIFF}\
         [[contact]]\nslave = 'ball_dome'\nmaster = 'slab_ymax'\nfriction = 0.3\nsurfaces = 'faceted'\n\
         [[dirichlet]]\nset = 'ball_flat'\nmotion = {motion}\n[load_path]\nsteps = 4\n"
    )
}

/// Overlaps on the path, and the number of nodes in contact at its end.
fn found(text: &str) -> (Vec<OpenOverlap>, usize) {
    let mut problem = crate::common::problem(text);
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    let last = forward.path.states.last().expect("a state");
    (overlaps(&problem, &forward.path), last.active_set.iter().filter(|status| status.is_closed()).count())
}

/// The bodies move rigidly since no force acts: a corner is as deep as it was moved below the height
/// at which it touched, and so is the lowest node of a ball.
#[test]
fn corner_and_ball_overlap_without_force() {
    let down = "[{ t = 0.5, u = [0, -0.2, 0] }, { t = 0.75, u = [0, -0.1, 0] }, { t = 1, u = [0, 0.1, 0] }]";
    let (of_corner, closed) = found(&corner(0.0, down));
    let [overlap] = &of_corner[..] else { panic!("{of_corner:?}") };
    assert_eq!((closed, overlap.step, overlap.on_slave), (0, 2, false));
    assert!((overlap.depth - 0.2).abs() < 1e-9, "{overlap:?}");
    assert!(overlap.position.iter().zip([1.2, 0.8, 1.5]).all(|(a, b)| (a - b).abs() < 1e-9), "{overlap:?}");
    assert!(overlap.to_string().contains("in load step 2, `three` lies up to 0.2 below `slab_ymax`"), "{overlap}");
    assert!(overlap.help().contains("let the pointed or finer side, `three`, be the slave"));

    let (of_ball, closed) = found(&ball("[2, 1, 2]", "[{ t = 1, u = [0, -0.08, 0] }]"));
    let [overlap] = &of_ball[..] else { panic!("{of_ball:?}") };
    assert_eq!((closed, overlap.step, overlap.on_slave), (0, 4, true));
    assert!((overlap.depth - 0.08).abs() < 1e-9, "{overlap:?}");
    assert!(!overlap.help().contains("be the slave"));
}

/// Contact that acts, resolved by finer facets, and bodies that stay apart.
#[test]
fn nothing_is_said_of_resolved_or_open_contact() {
    let (resolved, closed) = found(&ball("[8, 4, 8]", "[{ t = 1, u = [0, -0.08, 0] }]"));
    assert!(closed > 0 && resolved.is_empty(), "{closed}, {resolved:?}");
    let (apart, closed) = found(&corner(0.0, "[{ t = 1, u = [0.3, 0.05, 0] }]"));
    assert!(closed == 0 && apart.is_empty(), "{apart:?}");
}

/// The corner starts 0.1 below the slab.
#[test]
fn an_overlap_at_the_start_is_checked() {
    for (low, expected) in [(0.1, true), (0.0, false)] {
        let resolved = parse_case(&corner(low, "[{ t = 1, u = [0, 0.3, 0] }]"), "case.toml").expect("a case");
        let mut problem = build(&resolved.case).expect("a problem");
        let notices = inspect(&resolved.case, &mut problem).expect("inspected").notices;
        let overlap = notices.iter().find(|notice| notice.kind == NoticeKind::OpenOverlap);
        assert_eq!(overlap.is_some(), expected, "{notices:?}");
        if let Some(notice) = overlap {
            assert!(notice.message.starts_with("at the start, `three` lies up to 0.1 below `slab_ymax`"), "{notice:?}");
            assert_eq!(notice.path, "contact[0]");
        }
    }
}
