//! Writes a case for a user's mesh: the file's bodies and surfaces by name, with a contact pair,
//! supports and a motion for the user to correct.
//!
//! The choices are guesses based on geometry, and the case says so. The contact pair is the pair of
//! facing surfaces of two bodies with the largest area. The larger body is held and the other one
//! is pressed onto it, each at its side away from the contact. If there is only one body, the case
//! adds a block that is pressed onto it. Surfaces and sets that the file does not name are selected
//! by direction or position.
//!
//! A mesh of a STEP file has a pair for every two surfaces called `a_touches_b` and `b_touches_a`, as the script that
//! meshes it names them.

mod contact;
mod pairs;
mod survey;
mod text;

use std::collections::BTreeSet;

use slipstick_meshio::{FileMesh, MeshFileError};
use slipstick_model::words::counted;

pub use pairs::Measured;
use survey::{Part, Survey};

/// A case for a mesh file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeshCase {
    /// The text of the case.
    pub text: String,
    /// What the case leaves out of the mesh, for the user's information: mid-side nodes, and elements
    /// that are in no body.
    pub notices: Vec<String>,
}

/// Where a mesh comes from.
#[derive(Debug, Clone)]
pub struct Step {
    /// The STEP file.
    pub file: String,
    /// The script that meshes it.
    pub script: String,
    /// What the script measured between its surfaces.
    pub measured: Vec<Measured>,
}

/// Writes a case for the mesh in `bytes`; `file` is the name of the mesh file in the case.
///
/// # Errors
/// If the file cannot be read or used: place, message and cure.
pub fn case_of_mesh(bytes: &[u8], file: &str) -> Result<MeshCase, MeshFileError> {
    write(bytes, file, None)
}

/// Writes a case for the mesh of a STEP file, in millimetres.
///
/// # Errors
/// As [`case_of_mesh`].
pub fn case_of_step(bytes: &[u8], file: &str, step: &Step) -> Result<MeshCase, MeshFileError> {
    write(bytes, file, Some(step))
}

fn write(bytes: &[u8], file: &str, step: Option<&Step>) -> Result<MeshCase, MeshFileError> {
    let mesh = FileMesh::parse(bytes)?;
    let survey = Survey::new(&mesh, step.map_or(&[], |step| &step.measured))?;
    let mut notices = Vec::new();
    if survey.left_out > 0 {
        let parts = survey.parts.iter().filter_map(|part| part.part.as_deref());
        let (elements, parts) = (counted(survey.left_out, "solid element"), parts.collect::<Vec<_>>().join(", "));
        notices.push(format!("{elements} of the file are in no body: bodies are made from {parts}"));
    }
    notices.extend(shared(&mesh, &survey.parts));
    notices.extend(survey.parts.iter().filter_map(|part| pieces(&mesh, part)));
    Ok(MeshCase { text: text::case(&survey, file, step), notices })
}

/// A notice for every two parts that share nodes in the file: the bodies of the case do not.
fn shared(mesh: &FileMesh, parts: &[Part]) -> Vec<String> {
    let nodes_of = |part: &Part| -> BTreeSet<u32> {
        let cells = mesh.solid_cells(part.part.as_deref());
        cells.iter().flat_map(|&cell| mesh.cells.nodes(cell as usize)).copied().collect()
    };
    let nodes: Vec<BTreeSet<u32>> = parts.iter().map(nodes_of).collect();
    let pairs = (0..parts.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    let notice = |(a, b): (usize, usize)| {
        let count = nodes[a].intersection(&nodes[b]).count();
        (count > 0).then(|| {
            format!(
                "`{}` and `{}` share {} of the file, but bodies of a case are separate: for one body of both \
                 materials, read a part that contains both and give one of them a `[[body.section]]`",
                parts[a].name,
                parts[b].name,
                counted(count, "node")
            )
        })
    };
    pairs.filter_map(notice).collect()
}

/// A notice for a part of several pieces that share no nodes.
fn pieces(mesh: &FileMesh, part: &Part) -> Option<String> {
    // reading the case reports a body that cannot be read
    let body = mesh.body(&part.name, part.part.as_deref(), 1.0).ok()?;
    let count = body.mesh.connected_parts(0).len();
    (count > 1).then(|| {
        format!(
            "`{}` consists of {count} pieces that share no nodes: for a body of each, give them groups in the mesher \
             (Gmsh: a physical volume each; Abaqus and CalculiX: an ELSET each)",
            part.name
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cubes with a common face, in sets of their own: by hand, they share four nodes.
    #[test]
    fn bodies_that_share_nodes_are_named() {
        let deck = |second: &str| {
            format!(
                "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n5, 0, 0, 1\n6, 1, 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n\
                 9, 0, 0, 2\n10, 1, 0, 2\n11, 1, 1, 2\n12, 0, 1, 2\n13, 0, 0, 1\n14, 1, 0, 1\n15, 1, 1, 1\n16, 0, 1, 1\n\
                 *ELEMENT, TYPE=C3D8, ELSET=low\n1, 1, 2, 3, 4, 5, 6, 7, 8\n\
                 *ELEMENT, TYPE=C3D8, ELSET=high\n2, {second}, 9, 10, 11, 12\n"
            )
        };
        let notices = case_of_mesh(deck("5, 6, 7, 8").as_bytes(), "cubes.inp").expect("a case").notices;
        assert!(notices.len() == 1 && notices[0].contains("share 4 nodes of the file"), "{notices:?}");
        assert!(notices[0].contains("`low`") && notices[0].contains("`high`"), "{notices:?}");
        let apart = case_of_mesh(deck("13, 14, 15, 16").as_bytes(), "cubes.inp").expect("a case").notices;
        assert!(apart.is_empty(), "{apart:?}");
        let one = deck("13, 14, 15, 16").replace("high", "low");
        let notices = case_of_mesh(one.as_bytes(), "cubes.inp").expect("a case").notices;
        assert!(notices.len() == 1 && notices[0].contains("2 pieces that share no nodes"), "{notices:?}");
    }

    /// A deck as Gmsh writes it: sets of the entities of the geometry, then those of the groups. A case has each
    /// body and face once, under the name of its group; faces without a group keep the name of the entity.
    #[test]
    fn groups_come_before_entities_of_gmsh() {
        let deck = "*Heading\n*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n5, 0, 0, 1\n6, 1, 0, 1\n7, 1, 1, 1\n\
                    8, 0, 1, 1\n*ELEMENT, type=CPS4, ELSET=Surface1\n1, 1, 4, 3, 2\n*ELEMENT, type=CPS4, ELSET=Surface2\n\
                    2, 5, 6, 7, 8\n*ELEMENT, type=C3D8, ELSET=Volume1\n3, 1, 2, 3, 4, 5, 6, 7, 8\n\
                    *ELSET,ELSET=floor\n1\n*ELSET,ELSET=pad\n3\n";
        let mesh = FileMesh::parse(deck.as_bytes()).expect("a mesh");
        let survey = Survey::new(&mesh, &[]).expect("a survey");
        let bodies: Vec<_> = survey.parts.iter().map(|part| part.part.as_deref()).collect();
        assert_eq!(bodies, [Some("pad")]);
        let faces: Vec<_> = survey.parts[0].faces.iter().map(|face| face.name.as_str()).collect();
        assert_eq!(faces, ["pad_Surface2", "pad_floor"]);
    }

    /// A cube of elements in Abaqus' format, with a surface on its lower and on its upper side.
    fn cube(deck: &mut String, name: &str, low: f64, [below, above]: [&str; 2], first: usize) {
        *deck += "*NODE\n";
        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
        for (corner, [x, y]) in corners.into_iter().chain(corners).enumerate() {
            let z = if corner < 4 { low } else { low + 1.0 };
            *deck += &format!("{}, {x}, {y}, {z}\n", first + corner);
        }
        let nodes: Vec<String> = (first..first + 8).map(|node| node.to_string()).collect();
        *deck += &format!("*ELEMENT, TYPE=C3D8, ELSET={name}\n{first}, {}\n", nodes.join(", "));
        *deck += &format!("*SURFACE, NAME={name}_{below}\n{first}, S1\n*SURFACE, NAME={name}_{above}\n{first}, S2\n");
    }

    /// Three cubes, one above the other: by hand, the two lower ones overlap by 0.02 and the two upper ones have a gap of
    /// 0.1. Both pairs are in contact, the lowest cube is held, the highest one moves down, and nothing holds the middle.
    #[test]
    fn surfaces_that_touch_by_name_become_pairs() {
        let mut deck = String::new();
        cube(&mut deck, "a", 0.0, ["floor", "touches_b"], 1);
        cube(&mut deck, "b", 0.98, ["touches_a", "touches_c"], 11);
        cube(&mut deck, "c", 2.08, ["touches_b", "top"], 21);
        let pair = |one: &str, two: &str, gap| Measured { surfaces: [one.into(), two.into()], gap: [gap; 2] };
        let measured = vec![pair("a_touches_b", "b_touches_a", -0.02), pair("b_touches_c", "c_touches_b", 0.1)];
        let step = Step { file: "parts/abc.step".into(), script: "abc_mesh.py".into(), measured };
        let text = case_of_step(deck.as_bytes(), "abc.msh", &step).expect("a case").text;
        for expected in [
            "# A case for parts/abc.step, meshed in mm by abc_mesh.py.",
            "title = \"abc.step\"",
            "[units]\nlength = \"mm\"",
            "overlap by 0.02.\n[[contact]]",
            "offset = [{ t = 0, offset = -0.0202 }, { t = 0.5, offset = 0 }]",
            "have a gap of 0.1.\n[[contact]]",
            "held fixed\nset = \"a_floor\"",
            "set = \"c_top\"\nmotion = [{ t = 1.0, u = [0.0, 0.0, -0.11] }]",
        ] {
            assert!(text.contains(expected), "{expected}\n{text}");
        }
        assert_eq!(text.matches("[[dirichlet]]").count(), 2, "{text}");
        // the same names without a STEP file
        let text = case_of_mesh(deck.as_bytes(), "abc.inp").expect("a case").text;
        assert!(text.matches("[[contact]]").count() == 2 && text.contains("# [units]"), "{text}");
    }
}
