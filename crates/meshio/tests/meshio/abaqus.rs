//! Statements of Abaqus' input format, by their definition in the keywords reference.

use crate::{parse, places, refused, sound};
use slipstick_meshio::FileMesh;

/// Two cubes beside each other along x, as a person or a preprocessor may write them.
const CUBES: &str = "*Heading
** two cubes
 anything, even commas
*Node, nset=all
 1, 0., 0., 0.
 2, 1.D0, 0., 0.
 3, 1., 1., 0.
 4, 0., 1.
 5, 0., 0., 1.
 6, 1., 0., 1.
 7, 1., 1., 1.
 8, 0., 1., 1.
 12, 2., 0., 0.
 13, 2., 1., 0.
 16, 2., 0., 1.
 17, 2., 1., 1.
 99, 50., 50., 50.
*Element, type=C3D8R,
 elset=Left
10, 1, 2, 3, 4,
 5, 6, 7, 8
*ELEMENT, TYPE=c3d8, ELSET=RIGHT
20, 2, 12, 13, 3, 6, 16, 17, 7
*ELEMENT, TYPE=S4, ELSET=skin
30, 1, 5, 8, 4
*Elset, elset=both
left, 20
*Elset, elset=counted, generate
10, 1000, 10
*Nset, nset=odd, generate
1, 17, 2
*Nset, nset=low
1, 2, 5,
6
*Nset, nset=of_left, elset=Left
*Surface, type=ELEMENT, name=above
both, S2
*Surface, name=end
RIGHT, S4
*Surface, name=shell, type=element
skin, SPOS
*Surface, name=points, type=node
low
*Material, name=steel
*Elastic
210000., 0.3
*Step
*Static
nonsense that is not read
";

#[test]
fn sets_and_surfaces_are_read() {
    let read = sound(&parse(CUBES), "a", Some("both"));
    let mesh = read.mesh;
    assert_eq!((mesh.elements.len(), mesh.nodes.len()), (2, 12), "node 99 belongs to no element");
    assert_eq!(mesh.elements[0], [0, 1, 2, 3, 4, 5, 6, 7].into());
    assert_eq!(mesh.nodes[1], [1.0, 0.0, 0.0], "Fortran's exponent");
    let facets = |name: &str| mesh.surfaces[name].facets.iter().map(|f| f.element).collect::<Vec<_>>();
    assert_eq!((facets("a_above"), facets("a_end")), (vec![0, 1], vec![1]));
    assert_eq!((facets("a_skin"), facets("a_shell")), (vec![0], vec![0]));
    // S2 is the face of nodes 5 to 8, S4 that of 2, 3, 6, 7
    assert!(mesh.surfaces["a_above"].nodes().iter().all(|&n| mesh.nodes[n as usize][2] == 1.0));
    assert!(mesh.surfaces["a_end"].nodes().iter().all(|&n| mesh.nodes[n as usize][0] == 2.0));
    let low = [[0, 0, 0], [0, 0, 1_000_000], [1_000_000, 0, 0], [1_000_000, 0, 1_000_000]];
    assert_eq!(places(&mesh, &mesh.node_sets["a_low"]), low);
    assert_eq!(mesh.node_sets["a_points"], mesh.node_sets["a_low"]);
    // 1, 3, 5, 7, 13, 17: those of the odd numbers to 17 that exist
    assert_eq!(mesh.node_sets["a_odd"], [0, 2, 4, 6, 9, 11]);
    assert_eq!(mesh.node_sets["a_of_left"], (0..8).collect::<Vec<u32>>());
    // shells are no elements of a body
    let sets: Vec<(&str, &[u32])> = mesh.element_sets.iter().map(|(set, elements)| (&**set, &elements[..])).collect();
    let expected: [(&str, &[u32]); 4] =
        [("a_Left", &[0]), ("a_RIGHT", &[1]), ("a_both", &[0, 1]), ("a_counted", &[0, 1])];
    assert_eq!(sets, expected);
    assert_eq!(read.notices, ["elements of type C3D8R are read as C3D8: trilinear, fully integrated"]);
    let counted = sound(&parse(CUBES), "a", Some("counted")).mesh;
    assert_eq!(counted.elements.len(), 2, "elements 10 and 20 of 10, 20, 30, of which 30 is a shell");
}

/// Sections name the sets that have a material, whatever the case of their letters and however often.
#[test]
fn sections_and_sets_of_faces_are_told() {
    let section = |sets: &str| CUBES.replace("*Material", &format!("{sets}*Material"));
    let mesh = parse(&section("*Solid Section, elset=LEFT, material=steel\n*SOLIDSECTION, ELSET=Left\n"));
    assert_eq!(mesh.sections, ["Left"]);
    assert_eq!(mesh.left_out([Some("Left")]), [1], "the right cube");
    assert!(mesh.left_out([Some("Left"), Some("RIGHT")]).is_empty() && mesh.left_out([None]).is_empty());
    assert_eq!(mesh.sets_of_faces.iter().collect::<Vec<_>>(), ["RIGHT", "both", "skin"]);
    let none = parse(CUBES);
    assert!(none.sections.is_empty() && none.left_out([Some("Left")]).is_empty(), "without sections, any part will do");
}

/// Without a face, a surface consists of the faces of the set that no other solid shares: 5 of each
/// of two cubes that share one, whether or not the set has both.
#[test]
fn a_surface_without_faces_is_the_free_one() {
    let with = |of: &str| CUBES.replace("both, S2", &format!("{of},"));
    let mesh = sound(&parse(&with("both")), "a", Some("both")).mesh;
    assert_eq!((mesh.surfaces["a_above"].facets.len(), mesh.boundary(0).facets.len()), (10, 10));
    let mesh = sound(&parse(&with("Left")), "a", Some("both")).mesh;
    let above = &mesh.surfaces["a_above"];
    assert!(above.facets.len() == 5 && above.facets.iter().all(|facet| facet.element == 0));
    let shell = sound(&parse(&with("skin")), "a", Some("both")).mesh;
    assert_eq!(shell.surfaces["a_above"], shell.surfaces["a_skin"]);
}

/// An element with the nodes of an earlier one is used once, and counted.
#[test]
fn repeated_elements_are_counted() {
    let text = CUBES
        .replace("*ELEMENT, TYPE=S4", "30, 2, 12, 13, 3, 6, 16, 17, 7\n*ELEMENT, TYPE=S4")
        .replace("30, 1,", "40, 1,");
    let read = sound(&parse(&text), "a", None);
    assert_eq!(read.mesh.elements.len(), 2);
    assert!(
        read.notices.contains(&"1 element repeats the nodes of an earlier one and is used once".to_owned()),
        "{:?}",
        read.notices
    );
}

/// The package meshio writes entities of Gmsh as if they were a set of elements.
#[test]
fn entities_of_gmsh_are_no_elements() {
    let with =
        |set: &str| CUBES.replace("*Elset, elset=both", &format!("*ELSET, ELSET={set}\n0,-1,4,-3\n*Elset, elset=both"));
    let mesh = parse(&with("gmsh:bounding_entities"));
    assert!(mesh.cell_sets.keys().all(|name| !name.contains(':')), "{:?}", mesh.cell_sets.keys());
    let error = refused(&with("mine"));
    assert!(error.to_string().contains("there is no element 0"), "{error}");
}

/// Of one of two cubes that share nodes, the shared face is an outer one.
#[test]
fn a_part_is_a_body_of_its_own() {
    let mesh = sound(&parse(CUBES), "right", Some("RIGHT")).mesh;
    assert_eq!((mesh.elements.len(), mesh.nodes.len()), (1, 8));
    assert_eq!(mesh.surfaces.keys().collect::<Vec<_>>(), ["right_above", "right_end"]);
    let text = CUBES.replace("RIGHT, S4", "RIGHT, S6");
    let mesh = sound(&parse(&text), "right", Some("RIGHT")).mesh;
    assert!(mesh.surfaces["right_end"].nodes().iter().all(|&n| mesh.nodes[n as usize][0] == 1.0));
    let both = sound(&parse(&text), "a", Some("both"));
    assert!(!both.mesh.surfaces.contains_key("a_end") && both.mesh.surfaces.contains_key("a_above"));
    let error = &both.unusable["a_end"];
    assert!(error.place.contains("surface `end`") && error.place.contains("nodes [3, 2, 6, 7]"), "{error}");
    assert!(error.message.contains("lies between two elements"), "{error}");
}

/// A micro sign in the encoding of Western European Windows programs; comments may have any.
#[test]
fn latin_1_is_read() {
    let text = CUBES.replacen(" anything", " mu = \u{b5}, anything", 1);
    let bytes: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let file = FileMesh::parse(&bytes).expect("readable");
    assert!(file.notices[0].contains("Latin-1"), "{:?}", file.notices);
    assert_eq!(file.points, parse(CUBES).points);
    let comment = [b"** \xfc\n", CUBES.as_bytes()].concat();
    assert!(FileMesh::parse(&comment).expect("readable").notices.iter().all(|notice| !notice.contains("Latin-1")));
}

#[test]
fn errors_name_line_and_cure() {
    let cases = [
        ("*Heading", "*Part, name=P", "line 1", "*END PART"),
        ("*Heading", "*Include, input=x.inp", "line 1", "text of the included file"),
        ("*Heading", "*Assembly, name=A\n*Nset, nset=x, instance=P-1", "line 2", "name an *INSTANCE"),
        ("*Node, nset=all", "*Node, system=C", "line 4", "SYSTEM=R"),
        ("type=C3D8R", "type=C3D9", "line 18", "use C3D4, C3D6, C3D8, C3D10"),
        (" 2, 1.D0", " 2, 1.F0", "line 6", "finite"),
        (" 2, 1.D0", " 2, inf", "line 6", "finite"),
        ("\n 5, 6, 7, 8", "", "line 21", "all its nodes"),
        ("13, 3, 6, 16, 17, 7", "13, 3, 6, 16, 17, 7, 8", "line 23", "new line"),
        ("left, 20", "lefty, 20", "line 27", "define it"),
        ("left, 20", "counted, both\n*Elset, elset=counted\nboth", "line 27", "one of the references"),
        ("left, 20", "left, 21", "line 27", "remove it"),
        ("RIGHT, S4", "RIGHT, S7", "line 39", "S1 to S6"),
        ("RIGHT, S4", "RIGHT, SPOS", "line 39", "SPOS"),
        ("elset=both", "set=both", "line 26", "add this parameter"),
        ("20, 2, 12", "20, 2, 11", "element 20", "all its nodes"),
        ("20, 2, 12", "10, 2, 12", "element 10", "a unique number"),
        (" 8, 0.", " 7, 0.", "node 7", "a unique number"),
    ];
    for (from, to, place, cure) in cases {
        assert!(CUBES.contains(from), "{from}");
        let error = refused(&CUBES.replacen(from, to, 1));
        assert!(error.place.starts_with(place), "{to}: {error}");
        assert!(error.cure.contains(cure), "{to}: {error}");
    }
}

/// A corner of a cube; its faces by the element's definition in the reference: S1 of nodes 1, 2, 3,
/// S2 of 1, 4, 2, S3 of 2, 4, 3, S4 of 3, 4, 1.
#[test]
fn faces_of_tetrahedra_are_those_of_abaqus() {
    let text = |side: usize| {
        format!(
            "*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*Element, type=C3D4\n1, 1, 2, 3, 4\n\
             *Surface, name=face\n1, S{side}\n"
        )
    };
    for (side, nodes) in [(1, [1, 2, 3]), (2, [1, 2, 4]), (3, [2, 3, 4]), (4, [1, 3, 4])] {
        let mesh = sound(&parse(&text(side)), "a", None).mesh;
        assert_eq!(mesh.surfaces["a_face"].nodes(), nodes.map(|n| n - 1));
    }
    let error = refused(&text(5));
    assert!(error.message.contains("a tet4, has no face S5") && error.cure.contains("S1 to S4"), "{error}");
}

/// Half of a cube; its faces by the element's definition in the references of Abaqus and CalculiX:
/// S1 of nodes 1, 2, 3, S2 of 4, 5, 6, S3 of 1, 2, 5, 4, S4 of 2, 3, 6, 5, S5 of 3, 1, 4, 6.
#[test]
fn faces_of_wedges_are_those_of_abaqus() {
    let text = |side: usize| {
        format!(
            "*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n5, 1, 0, 1\n6, 0, 1, 1\n\
             *Element, type=C3D6\n1, 1, 2, 3, 4, 5, 6\n*Surface, name=face\n1, S{side}\n"
        )
    };
    let faces: [(usize, &[u32]); 5] =
        [(1, &[1, 2, 3]), (2, &[4, 5, 6]), (3, &[1, 2, 4, 5]), (4, &[2, 3, 5, 6]), (5, &[1, 3, 4, 6])];
    for (side, nodes) in faces {
        let mesh = sound(&parse(&text(side)), "a", None).mesh;
        assert_eq!(mesh.surfaces["a_face"].nodes(), nodes.iter().map(|n| n - 1).collect::<Vec<_>>());
    }
    let error = refused(&text(6));
    assert!(error.message.contains("a wedge6, has no face S6") && error.cure.contains("wedges S1 to S5"), "{error}");
}

/// Sets may name sets that the file defines later, also of other sets.
#[test]
fn sets_are_defined_after_their_use() {
    let text = CUBES
        .replace("*Elset, elset=both\nleft, 20\n", "")
        .replace("*Material", "*Elset, elset=both\nlater\n*Elset, elset=later\nLEFT, right\n*Material");
    let mesh = parse(&text);
    assert_eq!((&mesh.cell_sets["both"], &mesh.cell_sets["later"]), (&vec![0, 1], &vec![0, 1]));
    assert_eq!(sound(&mesh, "a", Some("both")).mesh.surfaces["a_above"].facets.len(), 2);
}

/// Elements that are no part of a mesh are counted, in sets too.
#[test]
fn springs_and_masses_are_counted() {
    let others = "*Element, type=SPRINGA, elset=Springs\n71, 1, 12\n72, 2, 13\n*Elset, elset=both\nleft, 71, 20";
    let mesh = parse(&CUBES.replace("*Elset, elset=both\nleft, 20", others));
    assert_eq!(mesh.cell_sets["both"], [0, 1]);
    assert!(mesh.notices.contains(&"2 elements of type SPRINGA are not read".to_owned()), "{:?}", mesh.notices);
}

/// A part used twice: the second one is moved by 10 along x, then turned by 90° about the line x = 10
/// along z, so that (1, 0, 0) comes to (10, 1, 0). Sets of the assembly name instances.
#[test]
fn instances_are_placed() {
    let part = &CUBES[CUBES.find("*Node").expect("nodes")..CUBES.find("*Material").expect("material")];
    let text = format!(
        "*Heading\n*PART, NAME=Cube\n{part}*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=One, PART=cube\n\
         *END INSTANCE\n*INSTANCE, NAME=Two, PART=CUBE\n10, 0, 0\n10, 0, 0, 10, 0, 1, 90\n*END INSTANCE\n\
         *NODE\n1, 7, 7, 7\n*NSET, NSET=ref\n1\n*NSET, NSET=tips, INSTANCE=Two\n2, low\n*NSET, NSET=tips, INSTANCE=one\n2\n\
         *ELSET, ELSET=halves, INSTANCE=TWO\n20\n*ELSET, ELSET=halves, INSTANCE=One\nleft\n\
         *SURFACE, NAME=ends\nTwo.right, S4\n*END ASSEMBLY\n*STEP\n"
    );
    let mesh = parse(&text);
    assert_eq!((mesh.points.len(), mesh.solid_cells(None).len()), (27, 4));
    assert_eq!(mesh.points[0], [0.0; 3]);
    let moved = mesh.points[13 + 1].map(|x| (x * 1e9).round() / 1e9);
    assert_eq!(moved, [10.0, 1.0, 0.0], "translated, then turned");
    assert_eq!(mesh.points[26], [7.0; 3]);
    assert_eq!(mesh.node_sets["ref"], [26], "the node of the assembly");
    assert_eq!(mesh.node_sets["tips"], [1, 13, 14, 17, 18], "node 2 of both and `low` of the second");
    let halves = &mesh.cell_sets["halves"];
    assert_eq!(halves.len(), 2);
    assert_eq!(mesh.cell_sets["Two_RIGHT"], [halves[1]]);
    assert_eq!(mesh.face_sets["ends"].len(), 1);
    for (body, part) in [("a", "One_both"), ("b", "Two_both")] {
        let read = sound(&mesh, body, Some(part)).mesh;
        assert_eq!((read.elements.len(), read.nodes.len()), (2, 12));
        assert_eq!(read.surfaces.contains_key(&format!("{body}_ends")), body == "b");
    }
    for (from, to, what) in [
        ("PART=CUBE", "PART=Cone", "define it with *PART"),
        ("NAME=Two", "NAME=one", "a name of its own"),
        ("10, 0, 0, 10, 0, 1, 90", "10, 0, 0, 10, 0, 0, 90", "two different points"),
        ("INSTANCE=TWO", "INSTANCE=Three", "name an *INSTANCE"),
        ("2, low", "2, lower", "define it"),
    ] {
        let place = format!("line {}", 1 + text.lines().position(|line| line.contains(from)).expect(from));
        let error = refused(&text.replacen(from, to, 1));
        assert!(error.place == place && error.cure.contains(what), "{to}: {error}");
    }
}

/// Included files are read where they are named; errors name file and line.
#[test]
fn includes_are_read() {
    use slipstick_meshio::abaqus::with_includes;
    let at = CUBES.find("*Elset, elset=both").expect("sets");
    let (head, tail) = CUBES.split_at(at);
    let deck = format!("{head}*INCLUDE, INPUT=\"sub\\sets.inp\"\n*Include,\n input=../free.inp\n");
    let files = |sets: String| {
        move |name: &str| match name {
            "sub/sets.inp" => Ok(sets.clone().into_bytes()),
            "../free.inp" => Ok(b"*Nset, nset=last\n1".to_vec()),
            _ => Err(std::io::Error::other("not there")),
        }
    };
    let read = |deck: &str, sets: &str| with_includes(deck.as_bytes().to_vec(), &files(sets.to_owned()));
    let text = read(&deck, &tail.replace("*Step", "** no step")).expect("included");
    let mesh = FileMesh::parse(&text).expect("readable");
    let notices: Vec<&String> = mesh.notices.iter().filter(|notice| notice.contains("includes")).collect();
    assert_eq!(mesh.node_sets["last"], [0]);
    assert_eq!((mesh.cell_sets.len(), mesh.face_sets.len()), (6, 2));
    assert!(notices.len() == 1 && notices[0].contains("../free.inp"), "{notices:?}");
    assert!(read(CUBES, "").expect("nothing to include") == CUBES.as_bytes());
    let error = FileMesh::parse(&read(&deck, &tail.replace("left, 20", "lefty, 20")).expect("included"));
    assert_eq!(error.expect_err("no such set").place, "sub/sets.inp, line 2");
    let after = deck.clone() + "*Elset, elset=wrong\nnone";
    let error = FileMesh::parse(&read(&after, &tail.replace("*Step", "**")).expect("included"));
    assert_eq!(error.expect_err("no such set").place, format!("line {}", after.lines().count()));
    for (sets, what) in [("*INCLUDE, INPUT=sub/sets.inp", "includes itself"), ("*INCLUDE, INPUT=x", "not there")] {
        let error = read(&deck, sets).expect_err("refused");
        assert!(error.place == "sub/sets.inp, line 1" && error.message.contains(what), "{error}");
    }
}
