//! What Abaqus/CAE writes: parts and instances, sets of one node, connectors, general contact. Expected tables follow
//! from the keywords reference of Abaqus.

use super::{CUBES, line_of, new_tables, refused, tables};

/// A unit cube as a part, used twice, one instance on the other; a reference node of the assembly.
const ASSEMBLY: &str = "*Heading\n*Part, name=Cube\n*Node\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n\
    8,0,1,1\n*Element, type=C3D8R\n1, 1,2,3,4,5,6,7,8\n*Elset, elset=Set-1\n1\n\
    *Solid Section, elset=Set-1, material=Steel\n,\n*End Part\n*Assembly, name=Assembly\n\
    *Instance, name=Low, part=Cube\n*End Instance\n*Instance, name=High, part=Cube\n0., 0., 1.\n*End Instance\n\
    *Node\n1, 0.5, 0.5, 2.\n*Nset, nset=m_Set-1\n1,\n*Nset, nset=Base, instance=Low\n1,2,3,4\n\
    *Nset, nset=Top, instance=High\n5,6,7,8\n*Elset, elset=_Up, internal, instance=Low\n1\n\
    *Surface, type=ELEMENT, name=Up\n_Up, S2\n*Elset, elset=_Down, internal, instance=High\n1\n\
    *Surface, type=ELEMENT, name=Down\n_Down, S1\n*Surface, type=ELEMENT, name=Lid\n_Down, S2\n\
    *End Assembly\n*Material, name=Steel\n*Elastic\n1000., 0.3\n\
    *Surface Interaction, name=Dry\n1.,\n*Friction, slip tolerance=0.005\n0.2,\n\
    *Contact Pair, interaction=Dry, small sliding, no thickness, type=SURFACE TO SURFACE\nDown, Up\n\
    *Step, name=Step-1, nlgeom=NO, convert SDI=NO\n*Static\n0.5, 1., 1e-05, 1.\n*Boundary\nBase, ENCASTRE\n\
    Top, 1, 2\nTop, 3, 3, -0.1\n*End Step\n";

/// With keywords of the assembly, and other motions than those of the top.
fn joined(keywords: &str, motions: &str) -> String {
    let deck = ASSEMBLY.replace("*End Assembly\n", &format!("{keywords}\n*End Assembly\n"));
    deck.replace("Top, 1, 2\nTop, 3, 3, -0.1\n", motions)
}

/// The table that begins so.
fn table(deck: &str, head: &str) -> String {
    let all = tables(deck);
    all.iter().find(|table| table.starts_with(head)).unwrap_or_else(|| panic!("no {head} in {all:?}")).clone()
}

#[test]
fn reference_nodes_are_named_by_sets() {
    let driven = "m_Set-1, 1, 2\nm_Set-1, 3, 3, -0.1\nm_Set-1, 4, 6\n";
    for keywords in [
        "*Rigid Body, ref node=m_Set-1, elset=High.Set-1",
        // bare numbers of the assembly are those of its own nodes
        "*Rigid Body, ref node=1, elset=High.Set-1",
        "*Nset, nset=Alias\nm_Set-1\n*Rigid Body, ref node=ALIAS, elset=High.Set-1",
    ] {
        let deck = joined(keywords, driven);
        let body = table(&deck, "[[body]]; name = \"High_Set-1\"");
        assert!(body.contains("rigid = { reference = [0.5, 0.5, 2.0] }"), "{keywords}: {body}");
        let motion = table(&deck, "[[dirichlet]]; set = \"High_Set-1\"");
        assert!(motion.ends_with("motion = [{ t = 1.0, u = [0.0, 0.0, -0.1] }]"), "{motion}");
    }
    let tied = joined("*Rigid Body, ref node=m_Set-1, tie nset=Top", driven);
    assert!(table(&tied, "[[dirichlet]]; set = \"High_Set-1_Top\"").ends_with("u = [0.0, 0.0, -0.1] }]"));
    // those of a part are nodes of each of its instances
    for node in ["9", "RP"] {
        let part = format!("*Node\n9, 0.5, 0.5, 1.\n*Nset, nset=RP\n9,\n*Rigid Body, ref node={node}, elset=Set-1\n");
        let deck = ASSEMBLY.replace("*End Part\n", &format!("{part}*End Part\n"));
        let deck = deck.replace("Base, ENCASTRE", "Low.RP, ENCASTRE").replace("\nTop,", "\nHigh.RP,");
        for (name, at) in [("Low", "1.0"), ("High", "2.0")] {
            let body = table(&deck, &format!("[[body]]; name = \"{name}_Set-1\""));
            assert!(body.contains(&format!("rigid = {{ reference = [0.5, 0.5, {at}] }}")), "{node}: {body}");
        }
    }
    // in data, too
    let rigid = "*Rigid Body, ref node=1, elset=High.Set-1";
    assert_eq!(tables(&joined(rigid, &driven.replace("m_Set-1", "1"))), tables(&joined(rigid, driven)));
    let equations = |deck: &str| -> Vec<String> {
        tables(deck).into_iter().filter(|table| table.starts_with("[[equation]]")).collect()
    };
    let equal = |ends: [&str; 2]| {
        let [a, b] = ends.map(|set| format!("{{ set = \"{set}\", component = \"x\", factor = "));
        format!("[[equation]]; terms = [{a}1.0 }}, {b}-1.0 }}]")
    };
    let own = joined("*Equation\n2\n1, 1, 1., Low.5, 1, -1.", "");
    assert_eq!(equations(&own), [equal(["node_17", "Low_Set-1_node_5"])], "after 8 nodes of each instance");
    for names in ["5, 1, 1., 6, 1, -1.", "A, 1, 1., B, 1, -1."] {
        let part = format!("*Nset, nset=A\n5\n*Nset, nset=B\n6\n*Equation\n2\n{names}\n*End Part\n");
        let ends = [["Low_Set-1_node_5", "Low_Set-1_node_6"], ["High_Set-1_node_13", "High_Set-1_node_14"]];
        assert_eq!(equations(&ASSEMBLY.replace("*End Part\n", &part)), ends.map(equal), "of each instance");
        let pin =
            part.replace(&format!("*Equation\n2\n{names}"), &format!("*MPC\nPIN, {}, {}", &names[..1], &names[10..11]));
        assert_eq!(equations(&ASSEMBLY.replace("*End Part\n", &pin)).len(), 6, "three of each instance");
    }
    let surfaces = "*Surface, type=NODE, name=Top_CNS_, internal\nTop, 1.\n";
    for (keywords, set, kind) in [
        ("surface=Lid\n*Kinematic", "Lid", "kinematic"),
        ("surface=Lid, influence radius=WHOLE SURFACE\n*Distributing, weighting method=UNIFORM", "Lid", "distributing"),
        ("surface=Top_CNS_\n*Kinematic\n1, 1\n2, 2\n3, 3", "Top_CNS_", "kinematic"),
        ("surface=Top_CNS_\n*Distributing", "Top_CNS_", "distributing"),
    ] {
        let coupling = format!("{surfaces}*Coupling, constraint name=C, ref node=m_Set-1, {keywords}");
        let expected =
            format!("[[coupling]]; name = \"C\"; set = \"High_Set-1_{set}\"; at = [0.5, 0.5, 2.0]; kind = \"{kind}\"");
        assert_eq!(table(&joined(&coupling, driven), "[[coupling]]"), expected);
    }
    for (keywords, message) in [
        ("*Rigid Body, ref node=Top, elset=High.Set-1", "it needs a reference node"),
        ("*Rigid Body, ref node=m_Set-1, tie nset=Top, nset=Top", "several of NSET, TIE NSET and PIN NSET"),
        (
            "*Rigid Body, ref node=m_Set-1, elset=High.Set-1, tie nset=Base",
            "all nodes of one body, and some of another",
        ),
        (
            "*Rigid Body, ref node=m_Set-1, elset=High.Set-1, pin nset=Base",
            "all nodes of one body, and some of another",
        ),
        ("*Rigid Body, ref node=m_Set-1, elset=High.Set-1, nset=Base", "all nodes of one body, and some of another"),
        (
            "*Node\n7, 2, 0, 2\n*Nset, nset=More\nTop, 7\n*Rigid Body, ref node=m_Set-1, elset=High.Set-1, tie nset=More\n\
             *Equation\n2\n7, 1, 1., Low.5, 1, -1.",
            "belongs to no element, and an equation joins it",
        ),
        (
            "*Nset, nset=Two\nm_Set-1, m_Set-1, Low.3\n*Rigid Body, ref node=Two, elset=High.Set-1",
            "needs a reference node",
        ),
        ("*Coupling, constraint name=C, ref node=Top, surface=Lid\n*Kinematic", "a node or a set of one node"),
        ("*Coupling, ref node=m_Set-1, surface=Lid, influence radius=0.1\n*Kinematic", "a part of its surface"),
        (
            "*Surface, type=NODE, name=More\nTop, 1.\nHigh.1, 1.\n*Coupling, ref node=m_Set-1, surface=More\n*Distributing",
            "is on no free face all of whose corners are in this set",
        ),
        ("*Coupling, ref node=m_Set-1, surface=Lid\n*Distributing, weighting method=LINEAR", "WEIGHTING METHOD is not"),
    ] {
        let messages = refused(&joined(keywords, driven));
        assert!(messages.iter().any(|text| text.contains(message)), "{keywords}: {messages:?}");
    }
}

/// Springs along the line between two nodes and along global axes, and what no spring can be.
#[test]
fn connectors_are_springs() {
    let with = |section: &str, behavior: &str| {
        let elements =
            "*Element, type=CONN3D2, elset=Wire\n1, Low.5, High.7\n*Connector Section, elset=Wire, behavior=B\n";
        let deck = joined(&format!("{elements}{section},"), "Top, 1, 2\nTop, 3, 3, -0.1\n");
        deck.replace("*Surface Inter", &format!("*Connector Behavior, name=B\n{behavior}*Surface Inter"))
    };
    let elastic =
        |component: u8, stiffness: f64| format!("*Connector Elasticity, component={component}\n{stiffness:?},\n");
    let springs = |deck: &str| -> Vec<String> {
        tables(deck).into_iter().filter(|table| table.starts_with("[[spring]]")).collect()
    };
    let spring = |number: u8, ends: [u8; 2], direction: &str, stiffness: f64| {
        format!(
            "[[spring]]; name = \"spring_{number}\"; set = \"Low_Set-1_sprung_{}\"; to = \"High_Set-1_sprung_{}\"; \
             direction = {direction}; nodal_stiffness = {stiffness:?}",
            ends[0], ends[1]
        )
    };
    // from (0, 0, 1) to (1, 1, 2), without NLGEOM
    let axial = springs(&with("Axial", &elastic(1, 100.0)));
    assert_eq!(axial, [spring(1, [1, 2], "[-1.0, -1.0, -1.0]", 100.0)]);
    let turning = with("Axial", &elastic(1, 100.0)).replace("nlgeom=NO", "nlgeom=YES");
    assert_eq!(springs(&turning), [spring(1, [1, 2], "\"line\"", 100.0)]);
    let axes = springs(&with("Cartesian", &(elastic(1, 100.0) + &elastic(3, 50.0))));
    let expected = [spring(1, [1, 2], "[1.0, 0.0, 0.0]", 100.0), spring(2, [3, 4], "[0.0, 0.0, 1.0]", 50.0)];
    assert_eq!(axes, expected);
    for elements in ["CONN3D2, elset=Wire", "SPRINGA, elset=Wire", "CONN3D2"] {
        let line = format!("*Element, type={elements}");
        let deck = joined(&format!("{line}\n1, Low.5, High.7"), "Top, 1, 2\nTop, 3, 3, -0.1\n");
        let start = format!("{}: *ELEMENT: no *", line_of(&deck, &line));
        let messages = refused(&deck);
        assert!(
            messages[0].starts_with(&start) && messages[0].contains("gives these elements a stiffness"),
            "{messages:?}"
        );
    }
    for (section, behavior, message) in [
        ("Hinge", elastic(1, 1.0), "connectors of the kind `HINGE` are not supported"),
        ("Axial", elastic(2, 1.0), "AXIAL connectors have no component 2"),
        ("Axial", elastic(1, -1.0), "a line with a stiffness > 0"),
        ("Axial", elastic(4, 1.0), "one of the components 1 to 3"),
        ("Axial", "*Connector Elasticity, component=1\n100., 20.\n50., 300.\n".into(), "depends on temperature"),
        ("Axial", "*Connector Elasticity, component=1, nonlinear\n0., 0.\n1., 1.\n".into(), "NONLINEAR is not"),
        ("Axial", "*Connector Damping, component=1\n1.\n".into(), "has no *CONNECTOR ELASTICITY"),
        ("Cartesian\nOri", elastic(1, 1.0), "*CONNECTOR SECTION: there is no orientation `ORI`"),
        ("Cartesian\nOri, Other", elastic(1, 1.0), "different axes at their nodes"),
    ] {
        let messages = refused(&with(section, &behavior));
        assert!(messages.iter().any(|text| text.contains(message)), "{section}: {messages:?}");
    }
}

/// General contact with named pairs has their laws; contact of everything is refused.
#[test]
fn general_contact_of_named_pairs() {
    let pair = "*Contact Pair, interaction=Dry, small sliding, no thickness, type=SURFACE TO SURFACE\nDown, Up\n";
    let with = |keywords: &str| ASSEMBLY.replace(pair, keywords);
    let inclusions = "*Contact\n*Contact Inclusions\nDown, Up\n";
    let expected = table(ASSEMBLY, "[[contact]]");
    for assigned in [" , , Dry", "Up, Down, DRY", "Down, , Dry"] {
        let deck = with(&format!("{inclusions}*Contact Property Assignment\n{assigned}\n"));
        assert_eq!(table(&deck, "[[contact]]"), expected, "{assigned}");
    }
    // the order of the keywords does not matter, and of several lines, the last counts
    let before =
        with("*Contact\n*Contact Property Assignment\n , , None\nUp, Down, Dry\n*Contact Inclusions\nDown, Up\n");
    assert_eq!(table(&before, "[[contact]]"), expected);
    assert_eq!(table(&with(inclusions), "[[contact]]"), expected.replace("0.2", "0.0"), "hard, without friction");
    let twice = with(&inclusions.replace("Down, Up\n", "Down, Up\nUp, Down\n"));
    assert_eq!(tables(&twice), tables(&with(inclusions)), "a pair counts once");
    for other in ["Lid, , Dry", "Down, Lid, Dry", " , Nowhere, Dry"] {
        let deck = with(&format!("{inclusions}*Contact Property Assignment\n{other}\n"));
        let start = format!("{}: *CONTACT PROPERTY ASSIGNMENT: no line of *CONTACT INCLUSIONS", line_of(&deck, other));
        assert!(refused(&deck)[0].starts_with(&start), "{other}: {:?}", refused(&deck));
    }
    for (keywords, message) in [
        ("*Contact\n", "*CONTACT: nothing says which surfaces may touch"),
        ("*Contact, op=NEW\n*Contact Inclusions\nDown, Up\n", "*CONTACT: the parameter OP is not supported"),
    ] {
        assert!(refused(&with(keywords))[0].contains(message), "{:?}", refused(&with(keywords)));
    }
    for (in_step, keyword) in [
        ("*Contact", "CONTACT"),
        ("*Contact Inclusions\nDown, Lid", "CONTACT INCLUSIONS"),
        ("*Contact Property Assignment\n , , Dry", "CONTACT PROPERTY ASSIGNMENT"),
    ] {
        let deck = with(inclusions).replace("*Boundary", &format!("{in_step}\n*Boundary"));
        let message = format!("*{keyword}: general contact that a step changes is not supported");
        assert!(refused(&deck)[0].contains(&message), "{:?}", refused(&deck));
    }
    let how = super::translated(&with(inclusions)).ledger.table();
    assert!(
        how.iter().any(|row| row[0] == "*CONTACT INCLUSIONS" && row[3].contains("out of small ones without strain"))
    );
    let all = with("*Contact\n*Contact Inclusions, ALL EXTERIOR\n");
    assert!(refused(&all)[0].contains("contact of everything with everything"), "{:?}", refused(&all));
    let own = with("*Contact\n*Contact Inclusions\nDown,\n");
    assert!(refused(&own)[0].contains("two different surfaces"), "{:?}", refused(&own));
}

/// Pairs that are tied, cleared by name, or removed, added and removed again.
#[test]
fn pairs_of_contact() {
    let tied = CUBES.replace("*CONTACT PAIR, INTERACTION=dry, ADJUST=0.02", "*CONTACT PAIR, INTERACTION=dry, TIED");
    assert_eq!(table(&tied, "[[contact]]"), "[[contact]]; slave = \"HIGH_DOWN\"; master = \"LOW_UP\"; tied = true");
    let clear =
        CUBES.replace("dry, ADJUST=0.02\nDOWN, UP\n", "dry, CPSET=P-1\nDOWN, UP\n*CLEARANCE, CPSET=p-1, VALUE=0.01\n");
    assert!(table(&clear, "[[contact]]").ends_with("adjust = { gap = 0.01 }"));
    let unknown = clear.replace("CPSET=p-1", "CPSET=p-2");
    let line = line_of(&unknown, "*CLEARANCE");
    assert!(refused(&unknown)[0].starts_with(&format!("{line}: *CLEARANCE: there is no *CONTACT PAIR of `P-2`")));
    let step = |change: &str| {
        format!("*STEP\n*STATIC\n1, 1\n*MODEL CHANGE, TYPE=CONTACT PAIR, {change}\nDOWN, UP\n*END STEP\n")
    };
    let deck = format!("{CUBES}{}{}{}", step("REMOVE"), step("ADD"), step("REMOVE")).replace("0.5, 1\n", "1, 1\n");
    let active: Vec<String> = tables(&deck).into_iter().filter(|table| table.starts_with("[[contact]]")).collect();
    assert_eq!(active.len(), 2, "{active:?}");
    assert!(active[0].contains("slave = \"HIGH_DOWN\"; master = \"LOW_UP\"; active = [0.0, 0.25]"), "{active:?}");
    assert!(active[1].contains("slave = \"HIGH_DOWN_2\"; master = \"LOW_UP\"; active = [0.5, 0.75]"), "{active:?}");
    assert!(refused(&format!("{CUBES}{}", step("ADD")))[0].contains("there is no such pair"));
}

/// Tractions, and gravity on the whole model, which has no name.
#[test]
fn loads_of_abaqus() {
    let dsload = |parameters: &str, line: &str| {
        CUBES.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", &format!("*DSLOAD{parameters}\n{line}\n"))
    };
    let expected = ["[[load]]; surface = \"HIGH_LID\"; traction = [3.0, 0.0, -4.0]"];
    let oblique = "LID, TRVEC, 5., 6., 0., -8.";
    assert_eq!(new_tables(&dsload("", oblique)), expected);
    let large = dsload(", FOLLOWER=NO, CONSTANT RESULTANT=YES", oblique).replace("*STEP", "*STEP, NLGEOM");
    assert_eq!(table(&large, "[[load]]"), expected[0]);
    let turning = dsload("", oblique).replace("*STEP", "*STEP, NLGEOM");
    assert!(refused(&turning)[0].contains("write FOLLOWER=NO, CONSTANT RESULTANT=YES"), "{:?}", refused(&turning));
    assert!(refused(&dsload("", "LID, TRVEC, 5., 0., 0., 0."))[0].contains("the direction is zero"));
    assert!(refused(&dsload("", "LID, HP, 5., 0., 1."))[0].contains("only pressures P and tractions TRVEC"));
    // a direction is the same at another length, to rounding; with OP=NEW, another one may follow
    let later = |load: &str| {
        let deck = dsload("", "LID, TRVEC, 1., 1., 1., -1.").replace("0.5, 1\n", "1, 1\n");
        format!("{deck}*STEP\n*STATIC\n1, 1\n{load}\n*END STEP\n")
    };
    let loads = |deck: &str| -> Vec<String> {
        tables(deck).into_iter().filter(|table| table.starts_with("[[load]]")).collect()
    };
    for same in ["3., 3., -3.", "0.577350, 0.577350, -0.577350"] {
        let found = loads(&later(&format!("*DSLOAD\nLID, TRVEC, 2., {same}")));
        assert_eq!(found.len(), 1, "{found:?}");
        // 2/√3, reached along a line
        assert!(found[0].starts_with("[[load]]; surface = \"HIGH_LID\"; traction = [1.154700538"), "{found:?}");
    }
    // OP=NEW of forces ends forces, that of distributed loads these
    for (keyword, ends) in [("*CLOAD, OP=NEW\n15, 1, 0.", [false, true]), ("*DSLOAD, OP=NEW\nUP, P, 0.", [true, false])]
    {
        let deck = later(keyword).replacen("*DSLOAD", "*CLOAD\n5, 1, 2.\n*DSLOAD", 1);
        let found = loads(&deck);
        for (kind, ends) in ["traction", "nodal_force"].into_iter().zip(ends) {
            let load = found.iter().find(|load| load.contains(kind)).unwrap_or_else(|| panic!("{kind}: {found:?}"));
            assert_eq!(load.ends_with("{ t = 1.0, factor = 0.0 }]"), ends, "{keyword:?}: {load}");
        }
    }
    let turned = later("*DSLOAD\nLID, TRVEC, 2., 1., 1., 1.");
    let line = line_of(&turned, "LID, TRVEC, 2.");
    assert!(refused(&turned)[0].starts_with(&format!("{line}: *DSLOAD: the direction of the traction")));
    let both = "*DSLOAD, OP=NEW\nLID, TRVEC, 1., 1., 1., -1.\nLID, TRVEC, 2., 1., 1., 1.";
    assert_eq!(loads(&later(both)).len(), 2);
    let heavy = CUBES.replace("*ELASTIC", "*DENSITY\n2.,\n*ELASTIC");
    let heavy = heavy.replace("*END STEP", "*DLOAD\n, GRAV, 9.81, 0., 0., -1.\n*END STEP");
    assert_eq!(table(&heavy, "[[load]]"), "[[load]]; gravity = [0.0, 0.0, -9.81]");
    // a point mass matters only to loads on mass
    let point =
        |deck: &str| deck.replace("*MATERIAL", "*ELEMENT, TYPE=MASS, ELSET=M\n9, 99\n*MASS, ELSET=M\n3.\n*MATERIAL");
    assert_eq!(tables(&point(CUBES)), tables(CUBES));
    for load in ["GRAV, 9.81, 0., 0., -1.", "CENTRIF, 4., 0., 0., 0., 0., 0., 1."] {
        let deck = point(&heavy.replace("GRAV, 9.81, 0., 0., -1.", load));
        let start = format!("{}: *MASS: the load on mass at line {}", line_of(&deck, "*MASS,"), line_of(&deck, load));
        assert!(refused(&deck)[0].starts_with(&start), "{:?}", refused(&deck));
    }
}

/// Polynomials in the strain invariants that are other laws.
#[test]
fn polynomials_of_rubber() {
    let law = |keyword: &str| {
        let deck = CUBES.replace("*ELASTIC\n1000, 0.3\n", &format!("*HYPERELASTIC{keyword}\n"));
        let body = table(&deck, "[[body]]");
        body[body.find("material = ").expect("a material")..].to_owned()
    };
    let same = |keywords: [&str; 2]| assert_eq!(law(keywords[0]), law(keywords[1]));
    same([", REDUCED POLYNOMIAL, N=1\n1., 0.01", ", NEO HOOKE\n1., 0.01"]);
    same([", REDUCED POLYNOMIAL, N=2\n1., 0.1, 0.01, 0.", ", YEOH\n1., 0.1, 0., 0.01, 0., 0."]);
    same([", REDUCED POLYNOMIAL, N=3\n1., 0.1, 0.2, 0.01, 0., 0.", ", YEOH\n1., 0.1, 0.2, 0.01, 0., 0."]);
    same([", MODULI=LONG TERM\n1., 0.2, 0.01", ", MOONEY-RIVLIN\n1., 0.2, 0.01"]);
    same([", POLYNOMIAL, N=1\n1., 0.2, 0.01", ", MOONEY-RIVLIN\n1., 0.2, 0.01"]);
    let refusal =
        |keyword: &str| refused(&CUBES.replace("*ELASTIC\n1000, 0.3\n", &format!("*HYPERELASTIC{keyword}\n")));
    assert!(refusal(", POLYNOMIAL, N=2\n1., 0.2, 0.1, 0.1, 0.1, 0.01, 0.")[0].contains("this form of the energy"));
    assert!(refusal(", REDUCED POLYNOMIAL, N=2\n1., 0.1, 0.01, 0.1")[0].contains("D2 is not supported"));
}

/// A plate of two triangles and a quadrilateral that is pressed onto a cube from above: solids behind the facets.
#[test]
fn rigid_surfaces_get_solids_on_the_side_that_does_not_touch() {
    let with = |side: &str, facets: &str| {
        let plate = format!(
            "*NODE\n31,0,0,1.5\n32,1,0,1.5\n33,1,1,1.5\n34,0,1,1.5\n35,2,0,1.5\n36,2,1,1.5\n\
             *ELEMENT, TYPE=R3D4, ELSET=TOOL\n{facets}\n\
             *SURFACE, NAME=FACE\nTOOL, {side}\n*RIGID BODY, ELSET=TOOL, REF NODE=99\n"
        );
        let deck = CUBES.replace("*ELEMENT, TYPE=C3D8, ELSET=HIGH\n2, 11,12,13,14,15,16,17,18\n", &plate);
        let deck = deck.replace("*SURFACE, NAME=DOWN\nHIGH, S1\n*SURFACE, NAME=LID\nHIGH, S2\n", "");
        let deck = deck
            .replace("*SOLID SECTION, ELSET=HIGH, MATERIAL=STEEL\n", "")
            .replace("ADJUST=0.02\nDOWN, UP", "ADJUST=0.6\nUP, FACE");
        deck.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", "99, 1, 2\n99, 3, 3, -0.1\n99, 4, 6\n")
    };
    let triangles = "*ELEMENT, TYPE=R3D3, ELSET=TOOL\n4, 32,36,33\n5, 32,35,36";
    for (side, quadrilateral, triangles) in [
        ("SNEG", "3, 31,32,33,34", triangles),
        ("SPOS", "3, 31,34,33,32", "*ELEMENT, TYPE=R3D3, ELSET=TOOL\n4, 32,33,36\n5, 32,36,35"),
    ] {
        let deck = with(side, &format!("{quadrilateral}\n{triangles}"));
        let body = table(&deck, "[[body]]; name = \"TOOL\"");
        assert!(body.contains("part = \"TOOL\" }; rigid = { reference = [0.5, 0.5, 2.01] }"), "{body}");
        let pair = table(&deck, "[[contact]]");
        assert!(pair.contains("slave = \"LOW_UP\"; master = \"TOOL_FACE\""), "{pair}");
        let mesh = slipstick_deck::mesh(deck.as_bytes()).expect("a mesh");
        let tool = mesh.body("TOOL", Some("TOOL"), 0.5).expect("a body").mesh;
        assert_eq!(tool.check(), [], "no solid is turned inside out");
        // one hexahedron and two wedges as thick as the mean edge, above the facets
        let z: Vec<f64> = mesh.points[mesh.points.len() - 6..].iter().map(|x| x[2]).collect();
        let mean = (4.0 + 2.0 * (2.0 + 2.0_f64.sqrt())) / 10.0;
        assert_eq!(mesh.cell_sets["TOOL"].len(), 6, "{side}");
        assert!(z.iter().all(|z| (z - 1.5 - mean).abs() < 1e-12), "{side}: {z:?}");
    }
    let both = with("SNEG", "3, 31,32,33,34").replace("TOOL, SNEG", "TOOL, SNEG\nTOOL, SPOS");
    assert!(refused(&both)[0].contains("touches on both of its sides"), "{:?}", refused(&both));
    // a surface may name elements by number, and those of nodes are no elements
    let named = "3, 31,32,33,34";
    let by_number = with("SNEG", named).replace("TOOL, SNEG", "3, SNEG");
    let points = |deck: &str| slipstick_deck::mesh(deck.as_bytes()).expect("a mesh").points;
    assert_eq!(tables(&by_number), tables(&with("SNEG", named)));
    assert_eq!(points(&by_number), points(&with("SNEG", named)));
    assert_ne!(points(&by_number), points(&with("SPOS", named)), "the other side");
    let nodes = by_number.replace("*RIGID", "*SURFACE, NAME=POINTS, TYPE=NODE\n3\n*RIGID");
    assert_eq!(tables(&nodes), tables(&by_number));
    // facets without ELSET that the rigid body does not have
    let more = with("SNEG", &format!("{named}\n*ELEMENT, TYPE=R3D4\n4, 32,35,36,33"));
    let start = format!(
        "{}: *ELEMENT: R3D4: a rigid surface that no *RIGID BODY names",
        line_of(&more, "*ELEMENT, TYPE=R3D4\n")
    );
    assert!(refused(&more)[0].starts_with(&start), "{:?}", refused(&more));
    let added = more.replace("*SURFACE, NAME=FACE", "*ELSET, ELSET=TOOL\n4\n*SURFACE, NAME=FACE");
    assert_eq!(refused(&added), [""; 0]);
    let free = with("SNEG", "3, 31,32,33,34").replace("*RIGID BODY, ELSET=TOOL, REF NODE=99\n", "");
    assert!(refused(&free)[0].contains("that no *RIGID BODY names"), "{:?}", refused(&free));
    let folded = with("SNEG", "3, 31,32,32,34");
    assert!(refused(&folded)[0].contains("fold onto each other"), "{:?}", refused(&folded));
}
