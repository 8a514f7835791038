//! Hexahedra of 20 nodes, which get those at the centres of their faces and their own.

use super::{mesh, refused, tables};

/// A unit cube with 20 nodes: the corners 1 to 8, and the nodes 9 to 20 between them.
fn cube(keywords: &str) -> String {
    let corners = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2]];
    let edges = [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
    let middle = |[a, b]: [usize; 2]| [0, 1, 2].map(|c| (corners[a][c] + corners[b][c]) / 2);
    let points = corners.into_iter().chain(edges.map(middle));
    let lines: String = points
        .zip(1..)
        .map(|([x, y, z], number)| {
            format!("{number}, {}, {}, {}\n", 0.5 * f64::from(x), 0.5 * f64::from(y), 0.5 * f64::from(z))
        })
        .collect();
    let numbers: Vec<String> = (1..=20).map(|number: u32| number.to_string()).collect();
    format!(
        "*NODE, NSET=ALL\n{lines}*ELEMENT, TYPE=C3D20, ELSET=CUBE\n1, {},\n{}\n*NSET, NSET=BASE\n1,2,3,4,9,10,11,12\n\
         *NSET, NSET=TOP\n5,6,7,8,13,14,15,16\n*MATERIAL, NAME=M\n*ELASTIC\n1000, 0.3\n*EXPANSION\n1e-5\n\
         *SOLID SECTION, ELSET=CUBE, MATERIAL=M\n{keywords}",
        numbers[..10].join(", "),
        numbers[10..].join(", ")
    )
}

/// The numbers of the nodes of a set in the mesh of a deck.
fn numbers(deck: &str, set: &str) -> Vec<u64> {
    let mesh = mesh(deck.as_bytes()).expect("a mesh");
    mesh.node_sets[set].iter().map(|&node| mesh.point_numbers[node as usize]).collect()
}

/// The new nodes 21 … 27 lie at the centres of the six faces and of the cube; sets of all other nodes of a face have
/// its centre.
#[test]
fn centres_lie_on_the_shape_of_20_nodes() {
    let deck = cube("*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\nTOP, 3, 3, -0.1\n*END STEP\n");
    let found = mesh(deck.as_bytes()).expect("a mesh");
    let mut centres = found.points[20..].to_vec();
    centres.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    let h = 0.5;
    let expected = [[0.0, h, h], [h, 0.0, h], [h, h, 0.0], [h, h, h], [h, h, 1.0], [h, 1.0, h], [1.0, h, h]];
    assert_eq!(centres, expected);
    for (set, z) in [("BASE", 0.0), ("TOP", 1.0)] {
        let nodes = &found.node_sets[set];
        assert_eq!((nodes.len(), found.points[nodes[8] as usize]), (9, [h, h, z]));
    }
    assert_eq!(found.node_sets["ALL"].len(), 27);
    let motions: Vec<String> = tables(&deck).into_iter().filter(|table| table.contains("dirichlet")).collect();
    assert_eq!(motions.len(), 2);
    assert!(motions[1].contains("set = \"CUBE_TOP\""), "{motions:?}");
}

/// Conditions node by node, of which one is known by its number, prescribe the centre too, by the shape of 20 nodes:
/// of the values x² on the face, −1/4 (0 + 1 + 1 + 0) + 1/2 (1/4 + 1 + 1/4 + 0) = 1/4.
#[test]
fn the_centre_of_prescribed_nodes_is_prescribed() {
    let lines: String = [(5, 0.0), (6, 1.0), (7, 1.0), (8, 0.0), (13, 0.25), (14, 1.0), (15, 0.25), (16, 0.0)]
        .map(|(node, value)| format!("{node}, 3, 3, {value}\n"))
        .concat();
    let deck = cube(&format!("*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\n{lines}*END STEP\n"));
    let table =
        tables(&deck).into_iter().find(|table| table.contains("u = [0.0, 0.0, 0.25]")).expect("nodes that move by 1/4");
    let set = table.split("\"CUBE_").nth(1).and_then(|rest| rest.split('"').next()).expect("a set").to_owned();
    let mut found = numbers(&deck, &set);
    found.sort_unstable();
    assert_eq!(found[..2], [13, 15]);
    let mesh = mesh(deck.as_bytes()).expect("a mesh");
    assert_eq!(mesh.points[mesh.node_sets[&set][2] as usize], [0.5, 0.5, 1.0]);
}

/// Forces act on the nodes of the deck, not on the centre between them: eight times −2, not nine times.
#[test]
fn forces_act_on_the_nodes_of_the_deck() {
    let deck = cube("*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\n*CLOAD\nTOP, 3, -2\n*END STEP\n");
    let table = tables(&deck).into_iter().find(|table| table.contains("nodal_force")).expect("a load");
    let set = table.split("\"CUBE_").nth(1).and_then(|rest| rest.split('"').next()).expect("a set").to_owned();
    assert_eq!(numbers(&deck, &set), [5, 6, 7, 8, 13, 14, 15, 16], "{table}");
}

/// Temperatures between the nodes of the deck are linear: 10 at the base and 30 at the top are 20 at the centre.
#[test]
fn temperatures_are_linear_between_nodes() {
    let sides = "*NSET, NSET=SIDE\n17,18,19,20\n";
    let deck = cube(&format!(
        "{sides}*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\n*TEMPERATURE\nBASE, 10\nTOP, 30\nSIDE, 20\n*END STEP\n"
    ));
    let all = tables(&deck);
    let heated: Vec<&String> = all.iter().filter(|table| table.contains("[[temperature]]")).collect();
    assert_eq!(heated.len(), 3, "{heated:?}");
    let sizes: Vec<usize> = heated
        .iter()
        .map(|table| {
            let set = table.split("\"CUBE_").nth(1).and_then(|rest| rest.split('"').next()).expect("a set");
            numbers(&deck, set).len()
        })
        .collect();
    // both faces have nine nodes; four nodes, four centres of faces and that of the cube lie between them
    assert_eq!(sizes, [9, 9, 9], "{heated:?}");
}

/// The body has the shape functions of 20 nodes, with eight points for `C3D20R`, and no equations of its own for the
/// centres, whatever equations and forces name.
#[test]
fn hexahedra_of_20_nodes_are_serendipity_elements() {
    let pairs: String = (6..=8).chain(13..=16).map(|node: u32| format!("2\n{node}, 3, 1, 5, 3, -1\n")).collect();
    let deck = cube(&format!("*EQUATION\n{pairs}*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\n*CLOAD\n5, 3, -2\n*END STEP\n"));
    let all = tables(&deck);
    assert_eq!(all.iter().filter(|table| table.contains("[[equation]]")).count(), 7);
    let body = |all: &[String]| all.iter().find(|table| table.contains("[[body]]")).expect("a body").clone();
    assert!(body(&all).contains("shape_functions = \"serendipity\"") && !body(&all).contains("element ="), "{all:?}");
    let reduced = body(&tables(&deck.replace("TYPE=C3D20", "TYPE=C3D20R")));
    assert!(reduced.contains("element = \"reduced\"") && reduced.contains("serendipity"), "{reduced}");
}

/// A centre that belongs to a prescribed set is not prescribed where one of its other nodes is not: here node 5 is not
/// in the set, but in ALL, of which x is prescribed.
#[test]
fn a_centre_moves_with_its_nodes() {
    let deck = cube(
        "*NSET, NSET=REST\n6,7,8,13,14,15,16\n*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\nALL, 1, 1\nREST, 3, 3, -0.1\n\
         *END STEP\n",
    );
    let held: Vec<String> = tables(&deck).into_iter().filter(|table| table.contains("[[dirichlet]]")).collect();
    let moving = held.iter().find(|table| table.contains("-0.1")).expect("a motion");
    let set = moving.split("\"CUBE_").nth(1).and_then(|rest| rest.split('"').next()).expect("a set");
    let mut found = numbers(&deck, set);
    found.sort_unstable();
    assert_eq!(found, [6, 7, 8, 13, 14, 15, 16]);
}

/// Pressures per penetration follow from the gap at each integration point, as in CalculiX.
#[test]
fn linear_contact_has_its_pressure_at_the_points() {
    let pair = "*SURFACE, NAME=LID\nCUBE, S2\n*SURFACE, NAME=FLOOR\nCUBE, S1\n*SURFACE INTERACTION, NAME=I\n\
                *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1e5\n*CONTACT PAIR, INTERACTION=I\nLID, FLOOR\n";
    let of = |deck: &str| tables(deck).into_iter().find(|table| table.contains("[[contact]]")).expect("a pair");
    let linear = of(&cube(&format!("{pair}*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\n*END STEP\n")));
    let law = "enforcement = { penalty = { stiffness = 100000.0, pressure_at = \"points\" } }";
    assert!(linear.contains(law) && !linear.contains("multiplier_shape"), "{linear}");
    let hard = cube(&format!("{pair}*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\n*END STEP\n"));
    let hard = of(&hard.replace("=LINEAR\n1e5\n", "=HARD\n"));
    assert!(!hard.contains("pressure_at"), "{hard}");
}

/// Nodes between corners lie on the faces of a coupling, one on another face does not.
#[test]
fn couplings_have_all_nodes_of_their_faces() {
    let with = |more: &str| {
        let deck = cube("*NODE\n99, 0.5, 0.5, 1.5\n*SURFACE, NAME=S, TYPE=NODE\nTOP\n");
        let coupling = "*COUPLING, REF NODE=99, SURFACE=S, CONSTRAINT NAME=C\n*DISTRIBUTING\n";
        let step = "*STEP\n*STATIC\n*BOUNDARY\nBASE, 1, 3\n*CLOAD\n99, 3, -2\n*END STEP\n";
        format!("{deck}{more}{coupling}{step}")
    };
    let table = tables(&with("")).into_iter().find(|table| table.starts_with("[[coupling]]")).expect("a coupling");
    assert!(table.contains("set = \"CUBE_S\"") && table.ends_with("kind = \"distributing\""), "{table}");
    // node 17 lies between a corner of the top and one of the base
    let messages = refused(&with("17,\n"));
    assert!(messages[0].contains("*COUPLING: node 17 of `S` is on no free face"), "{messages:?}");
}
