//! Laws of surfaces that are soft, penetrations that steps resolve, and multi-point constraints.

use super::{CUBES, new_tables, refused, translated};

/// The keys of the only contact pair that differ from those of hard contact.
fn contact(deck: &str) -> String {
    let found: Vec<String> = new_tables(deck).into_iter().filter(|table| table.starts_with("[[contact]]")).collect();
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].split("adjust = 0.02").nth(1).expect("a distance").to_owned()
}

#[test]
fn soft_pressures() {
    let law = |data: &str| CUBES.replace("=HARD\n", data);
    let exponential = law("=EXPONENTIAL\n0.02, 3.\n");
    assert_eq!(
        contact(&exponential),
        "; enforcement = { penalty = { pressure = { exponential = { contact_pressure = 3.0, clearance = 0.02 } }, \
         pressure_at = \"points\" } }"
    );
    // rows are pressure and penetration; a stick slope is the stiffness of sticking
    let table = law("=TABULAR\n0., 0.\n5., 0.005\n").replace("*FRICTION\n0.3\n", "*FRICTION\n0.3, 700.\n");
    assert_eq!(
        contact(&table),
        "; enforcement = { penalty = { pressure = { table = { penetration = [0.0, 0.005], pressure = [0.0, 5.0] } }, \
         stiffness = 700.0, pressure_at = \"points\" } }"
    );
    for (data, why) in [
        ("=EXPONENTIAL\n0.02\n", "it needs the gap"),
        ("=EXPONENTIAL\n0., 3.\n", "must be positive"),
        ("=TABULAR\n0., 0.\n5., 0.\n", "penetrations of a table must increase, but 0 follows 0"),
        ("=TABULAR\n0., 0.\n5., 1.\n4., 2.\n", "pressures of a table must not decrease, but 4 follows 5"),
        ("=TABULAR\n5., 0.\n6., 1.\n", "the first pressure of the table must be 0, not 5"),
        ("=TABULAR\n5.\n", "each line of a table must have a pressure and a penetration"),
    ] {
        let found = refused(&law(data));
        assert!(found.len() == 1 && found[0].contains(why), "{data}: {found:?}");
    }
}

/// A penetration of 0.1 that the first step allows at its start, and one that the second resolves within
/// its second load step.
#[test]
fn interferences() {
    let first = CUBES.replace("*STATIC\n0.5, 1\n", "*STATIC\n0.5, 1\n*CONTACT INTERFERENCE\nDOWN, UP, 0.1\n");
    assert_eq!(contact(&first), "; offset = [{ t = 0.0, offset = -0.1 }, { t = 1.0, offset = 0.0 }]");
    let second = format!("{CUBES}*STEP\n*STATIC\n0.5, 1\n*CONTACT INTERFERENCE\nDOWN, UP, 0.1\n*END STEP\n");
    assert_eq!(
        contact(&second),
        "; offset = [{ t = 0.5, offset = 0.0 }, { t = 0.75, offset = -0.05 }, { t = 1.0, offset = 0.0 }]"
    );
    // the last value in a step counts, in one keyword or two
    for twice in ["DOWN, UP, 0.3\nDOWN, UP, 0.1", "DOWN, UP, 0.3\n*CONTACT INTERFERENCE\nDOWN, UP, 0.1"] {
        assert_eq!(contact(&first.replace("DOWN, UP, 0.1", twice)), contact(&first), "{twice}");
    }
    let tied = first.replace("=HARD\n*FRICTION\n0.3\n", "=TIED\n1e6\n*FRICTION\n0.3, 1e6\n");
    let found = refused(&tied);
    assert!(found.len() == 1 && found[0].contains("in step 1 of surfaces that are tied"), "{found:?}");
    for (line, why) in [("DOWN, UP", "above 0"), ("DOWN, UP, -0.1", "above 0"), ("DOWN, OVER, 0.1", "no *CONTACT PAIR")]
    {
        let found = refused(&first.replace("DOWN, UP, 0.1", line));
        assert!(found.len() == 1 && found[0].contains(why), "{line}: {found:?}");
    }
}

/// The equations that follow from a constraint of nodes of the lower cube.
fn equations(mpc: &str) -> Vec<String> {
    let deck = CUBES.replace("*MATERIAL, NAME", &format!("*MPC\n{mpc}\n*MATERIAL, NAME"));
    new_tables(&deck).into_iter().filter(|table| table.starts_with("[[equation]]")).collect()
}

/// By hand, in the unit cube of nodes 1 to 8.
#[test]
fn multi_point_constraints() {
    let terms = |list: &[(u32, char, f64)]| {
        let term = |&(node, component, factor): &(u32, char, f64)| {
            format!("{{ set = \"LOW_node_{node}\", component = \"{component}\", factor = {factor:?} }}")
        };
        format!("[[equation]]; terms = [{}]", list.iter().map(term).collect::<Vec<_>>().join(", "))
    };
    // the fourth corner of the upper face: u₈ = u₅ + (u₇ − u₆)
    assert_eq!(
        equations("PLANE, 5, 6, 7, 8"),
        [terms(&[(8, 'z', 1.0), (5, 'z', -1.0), (6, 'z', 1.0), (7, 'z', -1.0)])]
    );
    // 6 twice: the plane is that of 5, 6 and 8
    assert_eq!(equations("PLANE, 5, 6, 6, 8, 7").len(), 1);
    // across the diagonal from 1 to 7, at two thirds of which is the foot of 8
    let (near, far) = (0.333_333_333_333_333_37, 0.666_666_666_666_666_6);
    let across =
        |c: char| terms(&[(8, 'x', -1.0), (8, c, 1.0), (1, 'x', near), (1, c, -near), (7, 'x', far), (7, c, -far)]);
    assert_eq!(equations("STRAIGHT, 1, 7, 8"), [across('y'), across('z')]);
    assert_eq!(equations("SLIDER, 8, 1, 7"), equations("STRAIGHT, 1, 7, 8"));
    assert_eq!(
        equations("PIN, 5, 15"),
        ['x', 'y', 'z'].map(|c| { terms(&[(5, c, 1.0), (15, c, -1.0)]).replace("LOW_node_15", "HIGH_node_15") })
    );
    assert_eq!(equations("TIE, 5, 15"), equations("PIN, 5, 15"));
    assert_eq!(equations("LINK, 5, 1"), [terms(&[(5, 'z', 1.0), (1, 'z', -1.0)])]);
    let large = CUBES.replace("*MATERIAL, NAME", "*MPC\nLINK, 5, 1\n*MATERIAL, NAME").replace("*STEP", "*STEP, NLGEOM");
    assert!(refused(&large)[0].contains("LINK does not keep the distance at large rotations"));
    // planes and lines do not turn; two nodes that stay together do
    for (mpc, warned) in [("PLANE, 5, 6, 7, 8", true), ("SLIDER, 8, 1, 7", true), ("PIN, 5, 15", false)] {
        let notices = mesh_of(&large.replace("LINK, 5, 1", mpc)).notices;
        assert_eq!(notices.iter().any(|notice| notice.contains("right for small rotations only")), warned, "{mpc}");
        let notices = mesh_of(&large.replace("LINK, 5, 1", mpc).replace(", NLGEOM", "")).notices;
        assert_eq!(notices, [""; 0], "{mpc}");
    }
    // about z through the middle of the upper face: corners at √½ turn by u/√½, a quarter of which counts
    let mean = |step: &str| {
        let deck = CUBES.replace("100, 0.5, 0.5, 2.01", "100, 0., 0., 2.").replace("*STEP", step);
        let deck = deck.replace("*MATERIAL, NAME", "*MPC\nMEANROT, 5,5,5,6,6,6,7,7,7,8,8,8,100\n*MATERIAL, NAME");
        deck.replace("BASE, 1, 3\n", "BASE, 1, 3\n100, 1, 1, 0.01\n")
    };
    let turned = new_tables(&mean("*STEP"));
    let equation = turned.iter().find(|table| table.starts_with("[[equation]]")).expect("an equation");
    for (node, x, y) in [(5, 0.25, -0.25), (6, 0.25, 0.25), (7, -0.25, 0.25), (8, -0.25, -0.25)] {
        for (component, factor) in [("x", x), ("y", y)] {
            let term = format!("{{ set = \"LOW_node_{node}\", component = \"{component}\", factor = {factor:?} }}");
            assert!(equation.contains(&term), "{term}: {equation}");
        }
    }
    assert_eq!(equation.matches("component").count(), 9, "{equation}");
    assert!(equation.contains("component = \"x\", factor = -1.0 }]"), "{equation}");
    let large = refused(&mean("*STEP, NLGEOM"));
    assert!(large[0].contains("MEANROT does not follow large rotations"), "{large:?}");
    for (mpc, why) in [
        ("MEANROT, 5, 5, 5", "belongs to no body"),
        ("PLANE, 5, 6", "define no plane"),
        ("PLANE, 5", "three nodes that define"),
        ("PLANE, 5, 6, 6, 5", "on one line"),
        ("SLIDER, 5, 6", "three nodes"),
        ("STRAIGHT, 5, 5, 6", "coincide"),
        ("LINK, 5", "two nodes"),
        ("DIST, 5, 6", "DIST is not supported"),
        ("0, 5, 6", "continues no constraint"),
        ("PIN, 5, 77", "there is no node 77"),
    ] {
        let deck = CUBES.replace("*MATERIAL, NAME", &format!("*MPC\n{mpc}\n*MATERIAL, NAME"));
        let found = refused(&deck);
        assert!(found[0].contains(why), "{mpc}: {found:?}");
    }
    let beam = CUBES.replace("*MATERIAL, NAME", "*MPC\nBEAM, 15, 99\nBEAM, 16, 99\n*MATERIAL, NAME");
    let beam = beam.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", "99, 1, 2\n99, 3, 3, -0.1\n");
    assert!(
        new_tables(&beam).contains(
            &"[[coupling]]; name = \"beams_99\"; set = \"HIGH_beams_99\"; at = [0.5, 0.5, 2.01]; kind = \"kinematic\""
                .into()
        ),
        "{:?}",
        new_tables(&beam)
    );
}

/// A slave of one node gets the face around it that faces the master.
#[test]
fn a_node_touches_with_the_faces_around_it() {
    let deck = CUBES.replace("*SURFACE, NAME=DOWN\nHIGH, S1\n", "*SURFACE, NAME=DOWN, TYPE=NODE\n12\n");
    let mesh = slipstick_deck::mesh(deck.as_bytes()).expect("a mesh");
    assert_eq!(mesh.face_sets["DOWN"].len(), 1);
    assert_eq!(mesh.face_sets["DOWN"][0], mesh_of(CUBES).face_sets["DOWN"][0]);
    assert!(mesh.notices.iter().any(|notice| notice.contains("also beyond the nodes")), "{:?}", mesh.notices);
    assert_eq!(translated(&deck).errors(), []);
    // the whole lower cube faces all sides; distorted and scaled by 400.1, its areas sum up to 3e-11, along x and z. A face
    // around two opposite corners of the upper cube is against this sum
    let closed = deck
        .replace("TYPE=NODE\n12\n", "TYPE=NODE\n12\n18\n")
        .replace("NAME=UP\nLOW, S2\n", "NAME=UP\nLOW, S1\nLOW, S2\nLOW, S3\nLOW, S4\nLOW, S5\nLOW, S6\n");
    let (start, rest) = closed.split_once("*NODE\n").expect("nodes");
    let (nodes, end) = rest.split_once("*NODE, NSET=REF").expect("another node");
    let large = |line: &str| {
        let fields = line.split(',').enumerate();
        let x = fields.map(|(k, field)| if k == 0 { field.to_owned() } else { scaled(field) });
        x.collect::<Vec<_>>().join(", ") + "\n"
    };
    let nodes: String = nodes.replace("7,1,1,1\n", "7,1.1234,1.2345,1.0321\n").lines().map(large).collect();
    let found = refused(&format!("{start}*NODE\n{nodes}*NODE, NSET=REF{end}"));
    assert!(found.len() == 1 && found[0].contains("no face of an element has all its nodes in `DOWN`"), "{found:?}");
}

fn mesh_of(deck: &str) -> slipstick_meshio::FileMesh {
    slipstick_deck::mesh(deck.as_bytes()).expect("a mesh")
}

fn scaled(coordinate: &str) -> String {
    format!("{:?}", 400.1 * coordinate.parse::<f64>().expect("a number"))
}
