//! Which side of a contact pair is the slave where the case leaves it open, and the warning where it does not.

use crate::build;
use slipstick_case::check::{NoticeKind, inspect};
use slipstick_case::file::{Case, Sides, parse_case};

const SOFT: &str = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
const HARD: &str = "material = { neo_hooke = { youngs_modulus = 9000.0, poisson_ratio = 0.3 } }";

/// `upper` on a slab of a soft material with these elements, with these sides and other keys of the pair.
fn case(elements: &str, upper: &str, sides: [&str; 2], more: &str) -> Case {
    let [slave, master] = sides;
    let text = format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [-2, -1, -1], max = [2, 0, 1], elements = {elements} }}\n{SOFT}\n\
         [[body]]\nname = 'upper'\n{upper}\n\
         [[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = 0.2\n{more}\n\
         [[dirichlet]]\nset = 'slab_ymin'\n[[dirichlet]]\nset = 'upper'\nmotion = [{{ t = 1, u = [0, -0.01, 0] }}]\n\
         [[quantity]]\nname = 'force'\ncontact_force = {{ slave = '{slave}', component = 'normal' }}\n[load_path]\nsteps = 2\n"
    );
    let top = if upper.contains("half_ball") { "set = 'upper_flat'" } else { "set = 'upper_ymax'" };
    let text = text.replace("set = 'upper'", if upper.contains("rigid") { "set = 'upper'" } else { top });
    parse_case(&text, "sides.toml").unwrap_or_else(|e| panic!("{e}\n{text}")).case
}

/// By the rules of docs/edges.md, whichever order the sides are named in.
#[test]
fn the_finer_the_convex_and_the_softer_side_is_chosen() {
    let ball = |more: &str| {
        format!("half_ball = {{ radius = 0.8, elements = [2, 2, 2] }}\nplace = {{ translate = [0, 0.8, 0] }}\n{more}")
    };
    let block = |elements: &str, more: &str| {
        format!("box = {{ min = [-0.5, 0, -0.5], max = [0.5, 1, 0.5], elements = {elements} }}\n{more}")
    };
    for (elements, upper, face, chosen) in [
        // facets of 0.3 on facets of 0.6: the ball; on facets of 0.1: the slab
        ("[7, 2, 3]", ball(HARD), "upper_dome", "upper_dome"),
        ("[40, 2, 20]", ball(HARD), "upper_dome", "slab_ymax"),
        // similar facets: the convex side, although it is harder
        ("[13, 2, 7]", ball(HARD), "upper_dome", "upper_dome"),
        // similar flat facets: the softer one
        ("[8, 2, 4]", block("[2, 2, 2]", HARD), "upper_ymin", "slab_ymax"),
        // not a rigid one, however fine
        ("[4, 2, 2]", block("[9, 2, 9]", "rigid = {}"), "upper_ymin", "slab_ymax"),
    ] {
        for sides in [[face, "slab_ymax"], ["slab_ymax", face]] {
            let found = case(elements, &upper, sides, "sides = 'chosen'");
            let [pair] = &found.contacts[..] else { panic!("one pair") };
            assert_eq!((pair.slave.as_str(), pair.sides), (chosen, Sides::AsGiven), "{elements} {upper}");
            assert_ne!(pair.master, pair.slave);
            build(&found).unwrap_or_else(|e| panic!("{e}"));
        }
    }
    // of equal sides, the first; and as they are given without the key
    for sides in [["upper_ymin", "slab_ymax"], ["slab_ymax", "upper_ymin"]] {
        let equal = case("[8, 2, 4]", &block("[2, 2, 2]", SOFT), sides, "sides = 'chosen'");
        assert_eq!(equal.contacts[0].slave, sides[0]);
        let given = case("[8, 2, 4]", &block("[9, 2, 9]", SOFT), sides, "");
        assert_eq!(given.contacts[0].slave, sides[0]);
    }
}

/// A ball with facets of 0.3 on a slave with facets of 0.45, which are less than twice as large: contact may be missed
/// within a facet, and only with these sides.
#[test]
fn a_slave_that_misses_a_convex_master_is_told() {
    let ball =
        format!("half_ball = {{ radius = 0.8, elements = [2, 2, 2] }}\nplace = {{ translate = [0, 0.8, 0] }}\n{HARD}");
    let told = |sides: [&str; 2]| {
        let case = case("[10, 2, 4]", &ball, sides, "sides = 'as_given'");
        let mut problem = build(&case).unwrap_or_else(|e| panic!("{e}"));
        let notices = inspect(&case, &mut problem).expect("inspected").notices;
        let coarse = notices.into_iter().filter(|notice| notice.kind == NoticeKind::CoarseSlave);
        coarse.map(|notice| notice.message).collect::<Vec<_>>()
    };
    let found = told(["slab_ymax", "upper_dome"]);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].ends_with("the master is convex, and touches within a slave facet before the mean gap closes"));
    assert_eq!(told(["upper_dome", "slab_ymax"]), Vec::<String>::new());
}

/// By default, the ball becomes the slave of a slab with larger facets, with a warning, and a quantity that names the slab
/// is the force on the slab; a block stays the master, as does the ball on a finer slab, and if the case insists.
#[test]
fn sides_that_miss_contact_are_swapped() {
    let ball =
        format!("half_ball = {{ radius = 0.8, elements = [2, 2, 2] }}\nplace = {{ translate = [0, 0.8, 0] }}\n{HARD}");
    let block = format!("box = {{ min = [-0.5, 0, -0.5], max = [0.5, 1, 0.5], elements = [6, 2, 6] }}\n{HARD}");
    let slave = |elements: &str, upper: &str, face: &str, more: &str| {
        let case = case(elements, upper, ["slab_ymax", face], more);
        assert_eq!(case.contacts[0].sides, Sides::AsGiven);
        case.contacts[0].slave.clone()
    };
    assert_eq!(slave("[10, 2, 4]", &ball, "upper_dome", ""), "upper_dome");
    assert_eq!(slave("[10, 2, 4]", &ball, "upper_dome", "sides = 'corrected'"), "upper_dome");
    assert_eq!(slave("[10, 2, 4]", &ball, "upper_dome", "sides = 'as_given'"), "slab_ymax");
    assert_eq!(slave("[40, 2, 20]", &ball, "upper_dome", ""), "slab_ymax");
    assert_eq!(slave("[8, 2, 4]", &block, "upper_ymin", ""), "slab_ymax");

    let text = format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [-2, -1, -1], max = [2, 0, 1], elements = [10, 2, 4] }}\n{SOFT}\n\
         [[body]]\nname = 'ball'\n{ball}\n\
         [[contact]]\nslave = 'slab_ymax'\nmaster = 'ball_dome'\nfriction = 0\n\
         [[dirichlet]]\nset = 'slab_ymin'\n[[dirichlet]]\nset = 'ball_flat'\n\
         [[quantity]]\nname = 'slab'\ncontact_force = {{ slave = 'slab_ymax', component = 'y' }}\n\
         [load_path]\nsteps = 2\n"
    );
    let resolved = parse_case(&text, "sides.toml").unwrap_or_else(|e| panic!("{e}"));
    let told: Vec<String> = resolved.warnings.iter().map(ToString::to_string).collect();
    assert!(told.len() == 1 && told[0].contains("slave and master are swapped"), "{told:?}");
    let force = format!("{:?}", resolved.case.quantities[0].kind);
    assert!(force.contains("Direction([0.0, -1.0, 0.0])") && force.contains("slave: \"ball_dome\""), "{force}");

    // a quantity that counts a part of the slave surface keeps the sides
    let part = "[[set]]\nname = 'part'\nwithin = 'slab_ymax'\nboxes = [{ min = [-1, 0, -1], max = [1, 0, 1] }]\n";
    let within = text.replace("component = 'y' }", "component = 'y', within = 'part' }") + part;
    let resolved = parse_case(&within, "sides.toml").unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((resolved.case.contacts[0].slave.as_str(), resolved.warnings.len()), ("slab_ymax", 0));
    build(&resolved.case).unwrap_or_else(|e| panic!("{e}"));
    // a box whose name begins that of the ball
    let names = text.replace("'ball", "'slab_ball");
    assert_eq!(parse_case(&names, "sides.toml").expect("a case").case.contacts[0].slave, "slab_ball_dome");
}

/// A plug that tapers in a bore, by the rim of which it is held: the bore is the slave, whichever side is named. Without a
/// taper, and where the case gives the normals, the sides stay.
#[test]
fn the_rim_of_a_bore_becomes_the_slave() {
    let slave = |top: f64, more: &str| {
        let text = format!(
            "[[body]]\nname = 'plate'\nhollow_cylinder = {{ inner_radius = 0.5, outer_radius = 1.2, height = 0.5, \
             elements = [2, 24, 2] }}\n{SOFT}\n\
             [[body]]\nname = 'plug'\ncone = {{ bottom_radius = 0.42, top_radius = {top}, height = 0.9, \
             elements = [4, 2, 4] }}\nplace = {{ translate = [0, 0.05, 0] }}\n{HARD}\n\
             [[contact]]\nslave = 'plug_side'\nmaster = 'plate_inner'\nfriction = 0.3\n{more}\n\
             [[dirichlet]]\nset = 'plate_outer'\n[[dirichlet]]\nset = 'plug_top'\n[load_path]\nsteps = 2\n"
        );
        parse_case(&text, "sides.toml").unwrap_or_else(|e| panic!("{e}\n{text}")).case.contacts[0].slave.clone()
    };
    assert_eq!(slave(0.56, ""), "plate_inner");
    assert_eq!(slave(0.42, ""), "plug_side");
    assert_eq!(slave(0.56, "normals = 'averaged'"), "plug_side");
    assert_eq!(slave(0.56, "sides = 'as_given'"), "plug_side");
}

/// A block whose right half lies beyond the end of a slab at x = 2: by hand, the nodes at 2.5 and 3 have nothing
/// opposite, 3 × 2; `within` leaves them out.
#[test]
fn nodes_without_a_master_in_a_smallest_pressure() {
    let block = format!("box = {{ min = [1, 0, -1], max = [3, 1, 1], elements = [4, 1, 2] }}\n{SOFT}");
    let smallest = "[[set]]\nname = 'near'\nwithin = 'upper_ymin'\nboxes = [{ min = [1, 0, -1], max = [2, 0, 1] }]\n\
                    [[quantity]]\nname = 'least'\ncontact_pressure = { slave = 'upper_ymin', measure = 'minimum' }\n";
    let told = |more: &str| -> Vec<String> {
        let case = case("[8, 2, 4]", &block, ["upper_ymin", "slab_ymax"], more);
        let mut problem = build(&case).unwrap_or_else(|e| panic!("{e}"));
        let notices = inspect(&case, &mut problem).expect("inspected").notices;
        let alone = notices.into_iter().filter(|notice| notice.kind == NoticeKind::NothingOpposite);
        alone.map(|notice| format!("{}: {}", notice.path, notice.message)).collect()
    };
    assert_eq!(told(""), [""; 0]);
    let found = told(smallest);
    assert!(found.len() == 1 && found[0].contains("opposite 6 nodes of `upper_ymin`"), "{found:?}");
    assert!(found[0].starts_with("quantity[0].contact_pressure: "), "{found:?}");
    assert_eq!(told(&smallest.replace("'minimum'", "'minimum', within = 'near'")), [""; 0]);
}
