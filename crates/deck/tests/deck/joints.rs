//! Rigid bodies, springs, equations, couplings, bolts and local axes.

use slipstick_deck::mesh;

use super::{CUBES, line_of, new_tables, refused, tables, translated};

#[test]
fn rigid_bodies_have_a_reference_point() {
    let deck = CUBES.replace("*STEP\n", "*RIGID BODY, NSET=ALL_HIGH, REF NODE=99, ROT NODE=100\n*STEP\n");
    let deck =
        deck.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", "99, 1, 2\n100, 1, 2\n100, 3, 3, 0.5\n*CLOAD\n99, 3, -20\n");
    assert_eq!(
        new_tables(&deck),
        [
            "[[body]]; name = \"HIGH\"; mesh = { file = \"cubes.inp\", part = \"HIGH\" }; rigid = { reference = [0.5, 0.5, 2.01] }",
            "[[dirichlet]]; set = \"HIGH\"; components = [\"x\", \"y\", \"rx\", \"ry\", \"rz\"]; \
             rotation = { point = [0.5, 0.5, 2.01], direction = [0.0, 0.0, 1.0] }; \
             motion = [{ t = 1.0, u = [0.0, 0.0, 0.0], angle = 28.64788975654116 }]",
            "[[load]]; surface = \"HIGH\"; force = [0.0, 0.0, -20.0]",
        ]
    );
    // a face: its nodes move with the reference node
    let face = CUBES.replace("*STEP\n", "*RIGID BODY, NSET=TOP, REF NODE=99\n*STEP\n");
    let held = face.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", "99, 1, 2\n99, 3, 3, -0.1\n99, 4, 6\n");
    assert_eq!(new_tables(&held), [""; 0], "as in the deck without it");
    // one that may turn is coupled to it, with the displacements of the rotation node as rotations
    let face = face.replace("REF NODE=99", "REF NODE=99, ROT NODE=100");
    let free = face.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", "99, 3, 3, -0.1\n100, 1, 1\n*CLOAD\n100, 2, 3.5\n");
    assert_eq!(
        new_tables(&free),
        [
            "[[coupling]]; name = \"rigid_99\"; set = \"HIGH_TOP\"; at = [0.5, 0.5, 2.01]; kind = \"kinematic\"",
            "[[dirichlet]]; set = \"rigid_99\"; components = [\"z\", \"rx\"]; \
             motion = [{ t = 1.0, u = [0.0, 0.0, -0.1] }]",
            "[[load]]; surface = \"rigid_99\"; moment = [0.0, 3.5, 0.0]",
        ]
    );
    let turned = refused(&face.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", "99, 1, 3\n100, 1, 3, 0.1\n"));
    assert!(turned[0].contains("only be rigid if all components"), "{turned:?}");
    let far = free.replace("100, 1, 1\n", "100, 1, 1, 0.2\n");
    let refusal = refused(&far.replace("*STEP\n", "*STEP, NLGEOM\n"));
    assert!(refusal[0].contains("turns by 0.2, and only rotations up to 0.04"), "{refusal:?}");
    assert_eq!(refused(&far), [""; 0]);
    let own = refused(&face.replace("REF NODE=99", "REF NODE=15"));
    assert!(own[0].contains("its reference node belongs to no body"), "{own:?}");
}

/// Springs to the ground on both cubes, between nodes, to a node that is held, and between rigid bodies.
#[test]
fn springs() {
    let with = |elements: &str, before: &str| {
        let deck = CUBES.replace("*MATERIAL, NAME", &format!("{elements}*MATERIAL, NAME"));
        deck.replace("*STEP", &format!("{before}*STEP"))
    };
    let ground =
        with("*ELEMENT, TYPE=SPRING1, ELSET=GROUND\n71, 5\n72, 6\n73, 6\n74, 15\n*SPRING, ELSET=ground\n3\n20.\n", "");
    assert_eq!(
        new_tables(&ground),
        [
            "[[spring]]; name = \"spring_1\"; set = \"LOW_sprung_1\"; direction = [0.0, 0.0, 1.0]; nodal_stiffness = 20.0",
            "[[spring]]; name = \"spring_2\"; set = \"HIGH_sprung_1\"; direction = [0.0, 0.0, 1.0]; nodal_stiffness = 20.0",
            "[[spring]]; name = \"spring_3\"; set = \"LOW_sprung_2\"; direction = [0.0, 0.0, 1.0]; nodal_stiffness = 20.0",
        ]
    );
    assert_eq!(mesh(ground.as_bytes()).unwrap().node_sets["sprung_1"].len(), 3);
    // the first axis of the orientation, (3, 4, 0)/5, and the second, perpendicular to it
    let axes = "*ORIENTATION, NAME=Oblique\n3., 4., 0., 0., 1., 0.\n";
    for (component, direction) in [(1, "[0.6, 0.8, 0.0]"), (2, "[-0.8, 0.6, 0.0]"), (3, "[0.0, 0.0, 1.0]")] {
        let section = format!("{axes}*SPRING, ELSET=ground, ORIENTATION=OBLIQUE\n{component}\n");
        let found = new_tables(&ground.replace("*SPRING, ELSET=ground\n3\n", &section));
        let expected = format!("[[spring]]; name = \"spring_1\"; set = \"LOW_sprung_1\"; direction = {direction};");
        assert!(found[0].replace("-0.0", "0.0").starts_with(&expected), "{found:?}");
    }
    let turned =
        |axes: &str| ground.replace("*SPRING, ELSET=ground", &format!("{axes}*SPRING, ELSET=ground, ORIENTATION=A"));
    assert!(refused(&turned(""))[0].contains("there is no orientation `A`"));
    let cylinder = turned("*ORIENTATION, NAME=A, SYSTEM=CYLINDRICAL\n0., 0., 0., 0., 0., 1.\n");
    assert!(refused(&cylinder)[0].contains("springs along cylindrical axes"), "{:?}", refused(&cylinder));
    let joined =
        with("*ELEMENT, TYPE=SPRING2\n71, 5, 11\n*ELSET, ELSET=JOINT\n71\n*SPRING, ELSET=JOINT\n2, 2\n7\n", "");
    assert_eq!(
        new_tables(&joined),
        [
            "[[spring]]; name = \"spring_1\"; set = \"LOW_sprung_1\"; to = \"HIGH_sprung_2\"; direction = [0.0, 1.0, 0.0]; \
          nodal_stiffness = 7.0"
        ]
    );
    // along (0, −0.8, 0.6) by hand: the third of rectangular axes whose first two are x and (0, 0.6, 0.8)
    let slanted = "*ORIENTATION, NAME=Slant\n1, 0, 0, 0, 0.6, 0.8\n";
    let section = "*SPRING, ELSET=A, ORIENTATION=slant";
    for (elements, to) in [
        (format!("*ELEMENT, TYPE=SPRING1, ELSET=A\n71, 5\n{section}\n3\n7\n"), ""),
        (format!("*ELEMENT, TYPE=SPRING2, ELSET=A\n71, 5, 11\n{section}\n3, 3\n7\n"), "to = \"HIGH_sprung_2\"; "),
        (
            "*ELEMENT, TYPE=CONN3D2, ELSET=A\n71, 5, 11\n*CONNECTOR SECTION, ELSET=A, BEHAVIOR=B\nCARTESIAN\nSLANT\n\
             *CONNECTOR BEHAVIOR, NAME=B\n*CONNECTOR ELASTICITY, COMPONENT=3\n7\n"
                .to_owned(),
            "to = \"HIGH_sprung_2\"; ",
        ),
    ] {
        let expected = format!(
            "[[spring]]; name = \"spring_1\"; set = \"LOW_sprung_1\"; {to}direction = [0.0, -0.8, 0.6]; nodal_stiffness = 7.0"
        );
        assert_eq!(new_tables(&with(&format!("{slanted}{elements}"), "")), [expected]);
    }
    let rope = "*ELEMENT, TYPE=SPRINGA, ELSET=ROPE\n71, 99, 7\n*SPRING, ELSET=ROPE\n\n2.5D1\n";
    assert_eq!(
        new_tables(&with(rope, "*BOUNDARY\n99, 1, 3\n")),
        ["[[spring]]; name = \"spring_1\"; set = \"LOW_sprung_1\"; to = [0.5, 0.5, 2.01]; \
          direction = [0.5, 0.5, -1.0099999999999998]; nodal_stiffness = 25.0"]
    );
    let turning = with(rope, "*BOUNDARY\n99, 1, 3\n").replace("*STEP", "*STEP, NLGEOM");
    assert!(translated(&turning).text.contains("to = [0.5, 0.5, 2.01]\ndirection = \"line\"\nnodal_stiffness = 25.0"));
    let free = with(rope, "");
    let line = line_of(&free, "*SPRING, ELSET");
    assert_eq!(
        refused(&free),
        [format!(
            "{line}: *SPRING: an end is a node of no body, which is not held; attach springs to bodies, and to nodes \
             that *BOUNDARY holds; `--ignore \"SPRING\"` leaves it out"
        )]
    );
    for (wrong, message) in [
        ("*ELEMENT, TYPE=SPRINGA, ELSET=A\n71, 1\n", "has a number and 2 nodes"),
        ("*SPRING, ELSET=A\n1\n5\n", "no set of spring elements `A`"),
        ("*ELEMENT, TYPE=SPRING2, ELSET=A\n71, 1, 11\n*SPRING, ELSET=A\n1, 2\n5\n", "between different components"),
        ("*ELEMENT, TYPE=SPRING1, ELSET=A\n71, 1\n*SPRING, ELSET=A\n1\n-5\n", "one with its stiffness > 0"),
        ("*ELEMENT, TYPE=SPRING1, ELSET=A\n71, 1\n*SPRING, ELSET=A, ORIENTATION=O\n1\n5\n", "no orientation `O`"),
        (
            "*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n0, 0, 0, 0, 0, 1\n\
             *ELEMENT, TYPE=SPRING1, ELSET=A\n71, 1\n*SPRING, ELSET=A, ORIENTATION=O\n1\n5\n",
            "springs along cylindrical axes are not supported",
        ),
        ("*ELEMENT, TYPE=SPRING1, ELSET=A\n71, 1\n*SPRING, ELSET=A, NONLINEAR\n1\n5\n", "NONLINEAR is not supported"),
    ] {
        let messages = refused(&with(wrong, ""));
        assert!(messages.iter().any(|text| text.contains(message)), "{wrong}: {messages:?}");
    }
}

/// As many springs as a meshed foundation has: the search for a name of each set was of third order in their number.
#[test]
fn thousands_of_springs() {
    let springs: String = (0..5000).map(|k| format!("{}, 5, 11\n", 1000 + k)).collect();
    let elements = format!("*ELEMENT, TYPE=SPRING2, ELSET=A\n{springs}*SPRING, ELSET=A\n2, 2\n7\n*MATERIAL, NAME");
    assert_eq!(new_tables(&CUBES.replace("*MATERIAL, NAME", &elements)).len(), 5000);
}

/// Equations between nodes of bodies and a node of no body, which becomes a point: its motion and its force.
#[test]
fn equations() {
    let deck =
        CUBES.replace("*STEP", "*EQUATION\n3\n5, 1, 1., 11, 1, -1.,\n99, 2, 5D-1\n2\n6, 3, 1.0, 12, 3, -1.0\n*STEP");
    let deck = deck.replace("TOP, 1, 2", "99, 1, 1, 0.\n*CLOAD\n99, 2, 4.\n*BOUNDARY\nTOP, 1, 2");
    assert_eq!(
        new_tables(&deck),
        [
            "[[point]]; name = \"node_99\"; at = [0.5, 0.5, 2.01]",
            "[[equation]]; terms = [{ set = \"LOW_node_5\", component = \"x\", factor = 1.0 }, \
             { set = \"HIGH_node_11\", component = \"x\", factor = -1.0 }, { set = \"node_99\", component = \"y\", factor = 0.5 }]",
            "[[equation]]; terms = [{ set = \"LOW_node_6\", component = \"z\", factor = 1.0 }, \
             { set = \"HIGH_node_12\", component = \"z\", factor = -1.0 }]",
            "[[dirichlet]]; set = \"node_99\"; components = [\"x\"]",
            "[[load]]; surface = \"node_99\"; nodal_force = [0.0, 4.0, 0.0]",
        ]
    );
    for (data, message) in [
        ("5, 1, 1.", "begins with a line that has the number of its terms"),
        ("2\n5, 1, 1., 6, 1", "a term has a node or a set"),
        ("2\n5, 1, 1., 6, 4, 1.", "a component from 1 to 3"),
        ("2\n5, 1, 1.", "fewer terms than it announces"),
        ("1\n5, 1, 1., 6, 1, 1.", "more terms than it announces"),
        ("2\n5, 1, 1., 777, 1, 1.", "there is no node 777"),
    ] {
        let messages = refused(&CUBES.replace("*STEP", &format!("*EQUATION\n{data}\n*STEP")));
        assert!(messages.iter().any(|text| text.contains(message)), "{data}: {messages:?}");
    }
}

/// Couplings with a motion, a rotation, a force and a moment at their reference nodes.
#[test]
fn couplings() {
    let deck = CUBES.replace(
        "*STEP",
        "*COUPLING, REF NODE=99, SURFACE=LID, CONSTRAINT NAME=PULL\n*DISTRIBUTING\n1, 6\n\
         *COUPLING, REF NODE=100, SURFACE=UP, CONSTRAINT NAME=turn\n*KINEMATIC\n1, 3\n*STEP",
    );
    let deck =
        deck.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", "100, 1, 5\n100, 6, 6, 0.1\n*CLOAD\n99, 3, 2.\n99, 5, 3.\n");
    assert_eq!(
        new_tables(&deck),
        [
            "[[coupling]]; name = \"PULL\"; set = \"HIGH_LID\"; at = [0.5, 0.5, 2.01]; kind = \"distributing\"",
            "[[coupling]]; name = \"turn\"; set = \"LOW_UP\"; at = [0.5, 0.5, 2.01]; kind = \"kinematic\"",
            "[[dirichlet]]; set = \"turn\"; rotation = { point = [0.5, 0.5, 2.01], direction = [0.0, 0.0, 1.0] }; \
             motion = [{ t = 1.0, u = [0.0, 0.0, 0.0], angle = 5.729577951308233 }]",
            "[[load]]; surface = \"PULL\"; force = [0.0, 0.0, 2.0]",
            "[[load]]; surface = \"PULL\"; moment = [0.0, 3.0, 0.0]",
        ]
    );
    for (keywords, message) in [
        ("*COUPLING, REF NODE=99\n*KINEMATIC\n", "needs REF NODE=…, a node or a set of one node, and SURFACE=…"),
        ("*COUPLING, REF NODE=99, SURFACE=LID\n", "does not say how"),
        ("*COUPLING, REF NODE=99, SURFACE=NONE\n*KINEMATIC\n", "no surface `NONE`"),
        ("*COUPLING, REF NODE=5, SURFACE=LID\n*KINEMATIC\n", "the reference node on none"),
        ("*COUPLING, REF NODE=99, SURFACE=LID\n*KINEMATIC\n1, 2\n", "only couplings of all components 1 to 3"),
        ("*KINEMATIC\n1, 3\n", "it follows no *COUPLING"),
    ] {
        let messages = refused(&CUBES.replace("*STEP", &format!("{keywords}*STEP")));
        assert!(messages.iter().any(|text| text.contains(message)), "{keywords}: {messages:?}");
    }
}

/// The upper of two bonded halves is pulled onto the lower one: a section between the elements of a column.
#[test]
fn sections_are_pulled_together() {
    let column = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,2\n6,1,0,2\n7,1,1,2\n8,0,1,2\n\
        9,0,0,3\n10,1,0,3\n11,1,1,3\n12,0,1,3\n*NODE, NSET=PULL\n99, 0,0,0\n\
        *ELEMENT, TYPE=C3D8, ELSET=COLUMN\n1, 1,2,3,4,5,6,7,8\n2, 5,6,7,8,9,10,11,12\n*NSET, NSET=BASE\n1,2,3,4\n\
        *SURFACE, NAME=CUT\n1, S2\n*MATERIAL, NAME=STEEL\n*ELASTIC\n1000, 0.3\n\
        *SOLID SECTION, ELSET=COLUMN, MATERIAL=STEEL\n*PRE-TENSION SECTION, SURFACE=CUT, NODE=99\n\
        *STEP\n*STATIC\n0.5, 1\n*BOUNDARY\nBASE, 1, 3\n*CLOAD\nPULL, 1, 30\n*END STEP\n";
    let bolt = |text: &str| tables(text).into_iter().find(|table| table.starts_with("[[bolt]]")).expect("a bolt");
    let expected = "[[bolt]]; name = \"CUT\"; body = \"COLUMN\"; \
                    section = { point = [0.5, 0.5, 2.0], normal = [0.0, 0.0, 1.0], radius = 0.8838834764831844 }; ";
    assert_eq!(bolt(column), format!("{expected}force = [{{ t = 1.0, force = 30.0 }}]; keeps = \"force\""));
    let kept = format!("{column}*STEP\n*STATIC\n0.5, 1\n*BOUNDARY, FIXED\nPULL, 1, 1\n*END STEP\n");
    assert_eq!(bolt(&kept), format!("{expected}force = [{{ t = 0.5, force = 30.0 }}]"));
    // the load may end once the length is kept
    let ended = kept.replace("PULL, 1, 1\n", "PULL, 1, 1\n*CLOAD, OP=NEW\n");
    assert_eq!(bolt(&ended), format!("{expected}force = [{{ t = 0.5, force = 30.0 }}]"));
    let turned = column.replace("NODE=99\n", "NODE=99\n0., 0.02, 1.\n");
    assert!(bolt(&turned).contains("normal = [0.0, 0.02, 1.0]"));
    let released = refused(&format!("{kept}*STEP\n*STATIC\n*BOUNDARY, OP=NEW\nBASE, 1, 3\n*END STEP\n"));
    assert!(released[0].contains("kept and then released"), "{released:?}");
    // two signs cancel
    let reversed = column.replace("NODE=99\n", "NODE=99\n0., 0., -1.\n").replace("PULL, 1, 30", "PULL, 1, -30");
    assert_eq!(
        bolt(&reversed),
        format!("{expected}force = [{{ t = 1.0, force = 30.0 }}]; keeps = \"force\"")
            .replace("0.0, 1.0]", "0.0, -1.0]")
    );
    for (from, to, message) in [
        ("NODE=99", "NODE=98", "node 98 does not exist, or belongs to an element"),
        ("NODE=99", "NODE=5", "node 5 does not exist, or belongs to an element"),
        ("SURFACE=CUT", "SURFACE=CUTS", "there is no surface `CUTS`"),
        ("SURFACE=CUT, ", "", "it needs SURFACE=… and NODE=…"),
        ("NODE=99\n", "NODE=99\n0., 0., -1.\n", "the force of a section pushes its parts apart"),
        ("NODE=99\n", "NODE=99\n0., 0.6, 0.8\n", "the direction is oblique to the faces"),
        ("*STEP", "*PRE-TENSION SECTION, SURFACE=CUT, NODE=99\n*STEP", "node 99 belongs to another section"),
        ("*STEP", "*BOUNDARY, FIXED\nPULL, 1, 1\n*STEP", "before and in the first step, there is nothing"),
        ("PULL, 1, 30", "PULL, 2, 30", "the section has no force"),
        ("PULL, 1, 30", "PULL, 1, -30", "the force of a section pushes its parts apart"),
        ("BASE, 1, 3", "BASE, 1, 3\nPULL, 1, 1, 0.1", "a prescribed displacement of the section is not supported"),
        ("*BOUNDARY\n", "*BOUNDARY, FIXED\nBASE, 1, 1\n*BOUNDARY\n", "before and in the first step, there is nothing"),
    ] {
        let found = refused(&column.replace(from, to)).join("\n");
        assert!(found.contains(message), "{message}: {found}");
    }
}

/// Local axes: along a global one, of all components, and of one component, which needs an equation.
#[test]
fn motions_along_local_axes() {
    let rotated = |axes: &str, conditions: &str| {
        let deck = CUBES.replace("*STEP\n", &format!("*TRANSFORM, NSET=TOP, TYPE={axes}\n*STEP\n"));
        deck.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", conditions)
    };
    // a turn by 90° about z: the local x is y, the local y is −x
    let quarter = "R\n0., 1., 0., -1., 0., 0.";
    let motion = |x: f64, y: f64| format!("motion = [{{ t = 1.0, u = [{x:?}, {y:?}, 0.0] }}]");
    let held = "[[dirichlet]]; set = \"HIGH_TOP\"; components = [";
    assert_eq!(new_tables(&rotated(quarter, "TOP, 1, 1, 0.2\n")), [format!("{held}\"y\"]; {}", motion(0.0, 0.2))]);
    assert_eq!(new_tables(&rotated(quarter, "TOP, 2, 2, 0.2\n")), [format!("{held}\"x\"]; {}", motion(-0.2, 0.0))]);
    // all components of axes that are turned by the angle with the sides 3, 4 and 5
    let oblique = "R\n3., 4., 0., -4., 3., 0.";
    let all = new_tables(&rotated(oblique, "TOP, 1, 1, 0.5\nTOP, 2, 3\n"));
    assert!(all.len() == 1 && all[0].contains("u = [0.3, 0.4, 0.0]"), "{all:?}");
    // one component: an equation for each node, with a point if it moves
    let one = new_tables(&rotated(oblique, "TOP, 2, 2\n"));
    assert_eq!(one.len(), 4, "{one:?}");
    assert_eq!(
        one[0],
        "[[equation]]; terms = [{ set = \"HIGH_node_15\", component = \"x\", factor = -0.8 }, \
         { set = \"HIGH_node_15\", component = \"y\", factor = 0.6 }]"
    );
    let driven = new_tables(&rotated(oblique, "15, 2, 2, 0.1\n"));
    assert_eq!(driven.len(), 3, "{driven:?}");
    assert_eq!(driven[0], "[[point]]; name = \"node_15_motion_1\"; at = [0.0, 0.0, 2.01]");
    assert!(driven[1].ends_with("{ set = \"node_15_motion_1\", component = \"x\", factor = -1.0 }]"), "{driven:?}");
    assert!(driven[2].contains("set = \"node_15_motion_1\"; components = [\"x\"]; motion = [{ t = 1.0"), "{driven:?}");
    // the components of an equation are local ones too
    let tied = rotated(oblique, "TOP, 3, 3\n").replace("*STEP\n", "*EQUATION\n2\n15, 2, 1., 16, 2, -1.\n*STEP\n");
    let terms = new_tables(&tied).into_iter().find(|table| table.starts_with("[[equation]]")).expect("an equation");
    let node = |number: u32, x: f64, y: f64| {
        let term = |c: &str, a: f64| format!("{{ set = \"HIGH_node_{number}\", component = \"{c}\", factor = {a:?} }}");
        format!("{}, {}", term("x", x), term("y", y))
    };
    assert_eq!(terms, format!("[[equation]]; terms = [{}, {}]", node(15, -0.8, 0.6), node(16, 0.8, -0.6)));
    // those of a constraint of nodes are not
    let pinned = rotated(oblique, "TOP, 3, 3\n").replace("*STEP\n", "*MPC\nPIN, 15, 5\n*STEP\n");
    let pinned: Vec<String> =
        new_tables(&pinned).into_iter().filter(|table| table.starts_with("[[equation]]")).collect();
    let pin = |c: &str| {
        let of = |set: &str, factor: f64| format!("{{ set = \"{set}\", component = \"{c}\", factor = {factor:?} }}");
        format!("[[equation]]; terms = [{}, {}]", of("HIGH_node_15", 1.0), of("LOW_node_5", -1.0))
    };
    assert_eq!(pinned, ["x", "y", "z"].map(pin));
    // cylindrical axes about z through (0.5, 0.5): the radial direction at node 17 is the diagonal
    let cylinder = "C\n0.5, 0.5, 0., 0.5, 0.5, 1.";
    let force = new_tables(&rotated(cylinder, "TOP, 3, 3\n*CLOAD\n17, 1, 2.\n"));
    for force_at in ["nodal_force = [1.41421356", "nodal_force = [0.0, 1.41421356"] {
        assert!(force.iter().any(|table| table.contains(force_at)), "2/√2 along x and y: {force:?}");
    }
    assert!(force.iter().any(|table| *table == format!("{held}\"z\"]")), "the axis is z: {force:?}");
    // node 15 lies on the axis: what holds one of the directions across it holds both
    let on_axis = "C\n0., 0., 0., 0., 0., 1.";
    let held_there = new_tables(&rotated(on_axis, "15, 2, 2\n"));
    assert_eq!(held_there, ["[[dirichlet]]; set = \"HIGH_held_1\"; components = [\"x\", \"y\"]"]);
    let driven_there = refused(&rotated(on_axis, "15, 1, 1, 0.1\n"));
    assert!(driven_there[0].contains("node 15 lies on the axis"), "{driven_there:?}");
    assert!(refused(&rotated("R\n1, 0, 0, 2, 0, 0", "TOP, 3, 3\n"))[0].contains("do not determine the axes"));
    assert!(refused(&rotated("S\n0, 0, 0, 0, 0, 1", "TOP, 3, 3\n"))[0].contains("TYPE=S is not supported"));
}
