//! Gaps that no prescribed motion closes are predicted, and no others: compared with hand
//! calculations and with the actual load path.

use slipstick_case::check::{NoticeKind, inspect};
use slipstick_case::file::{CaseCode, TEMPLATES, parse_case};
use slipstick_model::analysis::ForwardNotice;
use slipstick_path::Silent;

use crate::build;

/// A block above a slab with this gap; the caller appends supports and motions.
fn bodies(gap: f64) -> String {
    let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    let (bottom, top) = (1.0 + gap, 1.7 + gap);
    format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }}\n{material}\n\
         [[body]]\nname = 'block'\nbox = {{ min = [0.6, {bottom:?}, 0.3], max = [2.0, {top:?}, 1.6], elements = [2, 1, 2] }}\n\
         {material}\n[[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\nfriction = 0.3\n\
         [[dirichlet]]\nset = 'slab_ymin'\n"
    )
}

fn driven(u: &str) -> String {
    format!("[[dirichlet]]\nset = 'block_ymax'\nmotion = [{{ t = 1.0, u = {u} }}]\n")
}

/// The prediction of `check` for a case with this number of steps: the messages about pairs that
/// never close.
fn foreseen(text: &str, steps: usize) -> Vec<String> {
    let text = format!("{text}\n[load_path]\nsteps = {steps}\n");
    let resolved = parse_case(&text, "gap.toml").unwrap_or_else(|e| panic!("{e}\n{text}"));
    let mut problem = build(&resolved.case).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let notices = inspect(&resolved.case, &mut problem).expect("inspected").notices;
    let never = notices.into_iter().filter(|notice| notice.kind == NoticeKind::NeverCloses);
    never.map(|notice| format!("{}: {}", notice.path, notice.message)).collect()
}

/// Whether contact closes on the path that is marched.
fn closes(text: &str, steps: usize) -> bool {
    let text = format!("{text}\n[load_path]\nsteps = {steps}\n");
    let resolved = parse_case(&text, "gap.toml").unwrap_or_else(|e| panic!("{e}\n{text}"));
    let mut problem = build(&resolved.case).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    forward.notice != Some(ForwardNotice::ContactNeverCloses)
}

/// Down by 0.3 and sideways by 0.4, a motion of 0.5: the numbers are those of the text, and the
/// message contains all of them.
#[test]
fn the_pair_the_gap_and_the_motion_are_named() {
    let text = bodies(0.8) + &driven("[0.4, -0.3, 0]");
    assert_eq!(
        foreseen(&text, 4),
        ["contact[0]: `block_ymin` and `slab_ymax` never touch: the initial gap is 0.8, and the prescribed motions, \
             of up to 0.5, close at most 0.3 of it"]
    );
    let away = foreseen(&(bodies(0.25) + &driven("[0, 0.3, 0]")), 4);
    assert!(away[0].ends_with("the initial gap is 0.25, and the prescribed motions, of up to 0.3, do not reduce it"));
    let held = foreseen(&(bodies(0.25) + "[[dirichlet]]\nset = 'block_ymax'\n"), 1);
    assert!(held[0].ends_with("and there is no relative motion"), "{held:?}");
    assert_eq!(CaseCode::NeverCloses.as_str(), "slipstick::case::never_closes", "a stable code");
}

/// The prediction agrees with the path on both sides of a gap as large as the motion.
#[test]
fn the_path_does_what_is_foreseen() {
    for gap in [0.0, 0.1, 0.27, 0.33, 0.6] {
        let text = bodies(gap) + &driven("[0.1, -0.3, 0]");
        assert_eq!(foreseen(&text, 4).is_empty(), gap < 0.3, "{gap}");
        assert_eq!(closes(&text, 4), gap < 0.3, "{gap}");
    }
}

/// In one step from one side to the other: there is a gap at both ends, but not in between.
#[test]
fn what_is_passed_in_a_step_is_seen() {
    for depth in [-0.6, -3.0, -40.0] {
        let text = bodies(0.5) + &driven(&format!("[0, {depth:?}, 0]"));
        assert_eq!(foreseen(&text, 1), Vec::<String>::new(), "{depth}");
    }
    assert_eq!(foreseen(&(bodies(0.5) + &driven("[0, -0.4, 0]")), 1).len(), 1);
}

/// A post next to the block, which approaches sideways.
#[test]
fn sideways_motions_close_gaps() {
    let post = |u: f64| {
        let text = bodies(0.5).replace("'block_ymin'", "'block_xmin'").replace("'slab_ymax'", "'post_xmax'");
        let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
        let post = "[[body]]\nname = 'post'\nbox = { min = [-2, 0, 0], max = [-1, 3, 2], elements = [1, 3, 2] }\n";
        format!("{post}{material}\n[[dirichlet]]\nset = 'post_ymin'\n{text}{}", driven(&format!("[{u:?}, 0, 0]")))
    };
    assert_eq!(foreseen(&post(-1.5), 3).len(), 1, "1.6 apart");
    assert!(foreseen(&post(-1.7), 3).is_empty() && foreseen(&post(-30.0), 1).is_empty());
}

/// A block 0.5 above the slab rotates about an axis through the middle of its top: a corner, 0.7
/// below and 0.7 to the side, reaches its lowest point at 45 degrees, 0.99 below the axis. By hand:
/// 0.29 of the gap are closed.
#[test]
fn rotations_are_followed() {
    let turned = |gap: f64, degrees: f64| {
        let (y, axis) = (1.7 + gap, "direction = [0, 0, 1]");
        bodies(gap)
            + &format!(
                "[[dirichlet]]\nset = 'block_ymax'\nrotation = {{ point = [1.3, {y:?}, 0.0], {axis} }}\n\
                 motion = [{{ t = 1.0, angle = {degrees:?} }}]\n"
            )
    };
    let told = foreseen(&turned(0.5, 90.0), 18);
    let closed: f64 =
        told[0].split("close at most ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap().parse().unwrap();
    let by_hand = 0.7 * 2f64.sqrt() - 0.7;
    assert!((closed - by_hand).abs() < 1e-4, "{closed} for {by_hand}");
    assert!(foreseen(&turned(0.28, 90.0), 18).is_empty());
    assert_eq!(foreseen(&turned(0.28, 10.0), 18).len(), 1);
}

/// Bodies about which no prediction is possible: loaded, free to move, deformed by their supports,
/// pressed by another pair.
#[test]
fn nothing_is_said_of_what_cannot_be_foreseen() {
    let quiet = |text: &str| assert_eq!(foreseen(text, 2), Vec::<String>::new(), "{text}");
    let guided = "[[dirichlet]]\nset = 'block_ymax'\ncomponents = ['x', 'z']\n";
    quiet(&(bodies(0.8) + guided));
    quiet(&(bodies(0.8) + guided + "[[load]]\nsurface = 'block_ymax'\npressure = 1.0\n"));
    quiet(&(bodies(0.8) + &driven("[0, -0.3, 0]") + "[[load]]\nsurface = 'block_xmax'\ntraction = [0, -5, 0]\n"));
    quiet(&(bodies(0.8) + &driven("[0, -0.3, 0]") + "[[load]]\nsurface = 'slab_xmax'\ntraction = [0, 5, 0]\n"));
    // two faces of the block are driven separately: the parts between and beyond them follow
    // elastically
    let bent = "[[dirichlet]]\nset = 'block_xmin'\n[[dirichlet]]\nset = 'block_xmax'\n\
                motion = [{ t = 1.0, u = [0, -0.3, 0] }]\n";
    quiet(&(bodies(0.8) + bent));
    // the slab is pressed from below by a stamp that can lift it
    let stamp = "[[body]]\nname = 'stamp'\nbox = { min = [3.5, -1, 0], max = [4.5, 0, 2], elements = [1, 1, 2] }\n\
                 material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n\
                 [[contact]]\nslave = 'stamp_ymax'\nmaster = 'slab_ymin'\nfriction = 0\n\
                 [[dirichlet]]\nset = 'stamp_ymin'\nmotion = [{ t = 1.0, u = [0, 0.1, 0] }]\n";
    let held = bodies(0.8).replace("set = 'slab_ymin'", "set = 'slab_xmin'");
    quiet(&(held + &driven("[0, -0.3, 0]") + stamp));
}

/// Supports of some components, symmetry planes and bodies that move together are rigid motions
/// too.
#[test]
fn partly_held_bodies_are_foreseen() {
    let rollers = "[[dirichlet]]\nset = 'block_zmin'\ncomponents = ['z']\n[[dirichlet]]\nset = 'block_ymax'\n\
                   components = ['x', 'y']\nmotion = [{ t = 1.0, u = [0, -0.3, 0] }]\n";
    assert_eq!(foreseen(&(bodies(0.8) + rollers), 2).len(), 1);
    assert_eq!(foreseen(&(bodies(0.2) + rollers), 2).len(), 0);
    // both move down, the block farther
    let both =
        bodies(0.8).replace("set = 'slab_ymin'\n", "set = 'slab_ymin'\nmotion = [{ t = 1.0, u = [0, -5, 0] }]\n");
    let told = foreseen(&(both.clone() + &driven("[0, -5.3, 0]")), 2);
    assert!(told[0].contains("the prescribed motions, of up to 0.3, close at most 0.3 of it"), "{told:?}");
    assert_eq!(foreseen(&(both + &driven("[0, -5.9, 0]")), 2).len(), 0);
}

/// One load case that closes the pair is enough.
#[test]
fn all_load_cases_count() {
    let text = |second: f64| {
        let case = |name: &str, y: f64| {
            format!(
                "[[dirichlet]]\nset = 'block_ymax'\nload_case = '{name}'\nmotion = [{{ t = 1.0, u = [0, {y:?}, 0] }}]\n"
            )
        };
        bodies(0.8)
            + "[[load_case]]\nname = 'first'\n[[load_case]]\nname = 'second'\n"
            + &case("first", -0.3)
            + &case("second", second)
    };
    assert!(foreseen(&text(-0.9), 3).is_empty());
    let told = foreseen(&text(-0.6), 3);
    assert!(told.len() == 1 && told[0].contains("close at most 0.6 of it"), "{told:?}");
}

/// No false alarm: the templates, and the cases of the repository.
#[test]
fn cases_that_work_are_left_alone() {
    let mut texts: Vec<String> = TEMPLATES.iter().map(|template| template.text.to_owned()).collect();
    for case in ["clutch/coarse", "cube_on_cuboid/case", "half_ball_on_plate/coarse", "ironing/coarse"] {
        let file = format!("{}/../../cases/{case}.toml", env!("CARGO_MANIFEST_DIR"));
        texts.push(std::fs::read_to_string(&file).expect("readable"));
    }
    for text in texts {
        let resolved = parse_case(&text, "case.toml").unwrap_or_else(|e| panic!("{e}"));
        let mut problem = build(&resolved.case).unwrap_or_else(|e| panic!("{e}"));
        let notices = inspect(&resolved.case, &mut problem).expect("inspected").notices;
        assert!(notices.is_empty(), "{}: {notices:?}", resolved.case.title);
    }
}

/// The case of the issue: a half-ball 0.8 above the plate's corner that is pressed down by 0.3.
#[test]
fn the_half_ball_beside_its_plate_is_told() {
    let text = TEMPLATES.iter().find(|template| template.name == "half-ball").expect("there").text;
    let text = text.replace("translate = [-0.5, 1.2, -0.25]", "translate = [1.5, 2.0, 1.5]");
    let resolved = parse_case(&text, "case.toml").unwrap_or_else(|e| panic!("{e}"));
    let mut problem = build(&resolved.case).unwrap_or_else(|e| panic!("{e}"));
    let notices = inspect(&resolved.case, &mut problem).expect("inspected").notices;
    assert!(matches!(&notices[..], [one] if one.kind == NoticeKind::NeverCloses), "{notices:?}");
    assert!(notices[0].message.contains("the initial gap is 0.8"), "{}", notices[0].message);
}
