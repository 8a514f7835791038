//! Tests of whole parts: what they keep of the case, and what they leave out.

use slipstick_case::construct::build_mesh;
use slipstick_case::file::{LoadKind, SpringStiffness, parse_case};
use slipstick_contact::kinematics::MultiplierShape;

use super::*;

const CASE: &str = r#"
[[body]]
name = "slab"
box = { min = [0, 0, 0], max = [4, 1, 2], elements = [16, 4, 8] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
place = { translate = [0.5, 0, 0] }
[[body]]
name = "block"
box = { min = [1.5, 1.0, 0.5], max = [2.5, 1.5, 1.5], elements = [2, 1, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[surface]]
name = "pad"
body = "slab"
boxes = [{ min = [1.5, 1, 0], max = [3.5, 1, 2] }]
[[set]]
name = "feet"
within = "slab_ymin"
boxes = [{ min = [0.5, 0, 0], max = [1.5, 0, 2] }]
[[set]]
name = "tip"
nearest = [4.5, 1, 1]
[[contact]]
slave = "block_ymin"
master = "pad"
friction = 0.3
[[dirichlet]]
set = "feet"
[[dirichlet]]
set = "block_ymax"
motion = [{ t = 1.0, u = [0, -0.1, 0] }]
[load_path]
steps = 2
[design]
bodies = ["slab"]
volume_fraction = 0.5
sensitivity_filter = { radius = 0.5 }
[objective]
contact_force = { steps = "last" }
[optimizer]
iterations = 4
"#;

/// The part of a design that is solid where `solid` says so, with edges of 0.25.
fn part_of(text: &str, solid: impl Fn([f64; 3]) -> bool) -> Result<Part, PartError> {
    sized(text, solid, Some(0.25))
}

/// A case with its mesh and densities: the first body is solid where `solid` says so.
fn scene(text: &str, solid: impl Fn([f64; 3]) -> bool) -> (Case, Mesh, Vec<f64>) {
    let case = parse_case(text, "case.toml").expect("a case").case;
    let mesh = build_mesh(&case).expect("a mesh");
    let filled = |e: usize| !mesh.bodies[0].elements.contains(&e) || solid(mesh.centroid(e));
    let density = (0..mesh.elements.len()).map(|e| f64::from(u8::from(filled(e)))).collect();
    (case, mesh, density)
}

fn sized(text: &str, solid: impl Fn([f64; 3]) -> bool, size: Option<f64>) -> Result<Part, PartError> {
    let (case, mesh, density) = scene(text, solid);
    part(&case, &mesh, &density, &ExportOptions { threshold: Some(0.5), ..ExportOptions::default() }, size)
}

/// A full slab keeps its volume. Its faces, the pad of 2 × 2 and the feet of 1 × 2 keep their areas
/// exactly, even where they end within a plane.
#[test]
fn named_faces_keep_their_areas() {
    let part = part_of(CASE, |_| true).expect("a part");
    let body = &part.bodies[0];
    assert!((body.volume / 8.0 - 1.0).abs() < 1e-12, "{}", body.volume);
    assert_eq!((body.size, body.pieces.len(), body.loose.len()), (0.25, 1, 0));
    let area_of = |name: &str| {
        let face = body.faces.iter().find(|face| face.name == name).expect("the face");
        assert!((face.share - 1.0).abs() < 1e-12, "{face:?}");
        let own = (0..body.surface.triangles.len()).filter(|&t| face.patches.contains(&(body.surface.patch[t] + 1)));
        own.map(|t| 0.5 * norm(area(body.surface.corners(t)))).sum::<f64>()
    };
    for (name, expected) in [("pad", 4.0), ("feet", 2.0), ("slab_ymin", 8.0), ("slab_ymax", 8.0), ("slab_xmin", 2.0)] {
        assert!((area_of(name) / expected - 1.0).abs() < 1e-12, "{name}: {}", area_of(name));
    }
}

/// The case of the part has the same path and contact but no design, and its sets refer to the mesh
/// file; a single point is selected again by position.
#[test]
fn the_case_names_the_faces_of_the_mesh() {
    let observed = "[[quantity]]\nname = \"lift\"\ndisplacement = { set = \"tip\", component = \"y\" }\n[[contact]]";
    let part = part_of(&CASE.replace("[[contact]]", observed), |_| true).expect("a part");
    let case = &part.case;
    assert!(case.design.is_none() && case.optimizer.is_none() && case.objective.is_some());
    assert_eq!((case.contacts[0].master.as_str(), case.dirichlet[0].set.as_str()), ("pad", "feet"));
    assert_eq!((case.surfaces[0].within.as_deref(), case.surfaces[0].boxes.len()), (Some("slab_pad"), 0));
    assert_eq!((case.sets[0].within.as_deref(), case.sets[0].boxes.len()), (Some("slab_feet"), 0));
    assert_eq!(
        (part.reselected.as_slice(), case.sets[1].nearest),
        (["tip".to_owned()].as_slice(), Some([4.5, 1.0, 1.0]))
    );
    assert_eq!((case.bodies[0].shape.key(), case.bodies[0].place.translate), ("mesh", [0.0; 3]));
    assert_eq!(case.bodies[1].shape.key(), "box", "a body that is not designed stays");
    // slaves with new meshes have dual shapes, unless the case says which
    let exchanged =
        CASE.replace("slave = \"block_ymin\"\nmaster = \"pad\"", "slave = \"pad\"\nmaster = \"block_ymin\"");
    let given = exchanged.replace("friction = 0.3", "friction = 0.3\nmultiplier_shape = \"mean\"");
    let shape = |text: &str| part_of(text, |_| true).expect("a part").case.contacts[0].multiplier_shape;
    let expected = [None, Some(MultiplierShape::Dual), Some(MultiplierShape::Mean)];
    assert_eq!([CASE, &exchanged, &given].map(shape), expected);
}

/// The mesh has no group of a name that a table of the case defines, so that the part can be read; a union
/// is defined by its parts.
#[test]
fn groups_and_tables_have_different_names() {
    let text = CASE
        .replace("\"pad\"", "\"slab_pad\"")
        .replace("[[contact]]", "[[surface]]\nname = \"slab_all\"\nof = [\"slab_pad\", \"slab_xmax\"]\n[[contact]]");
    let text = text.replace("master = \"slab_pad\"", "master = \"slab_all\"");
    let part = part_of(&text, |_| true).expect("a part");
    let group = |name: &str| {
        let face = part.bodies[0].faces.iter().find(|face| face.name == name).expect("the face");
        face.group.as_deref()
    };
    assert_eq!(
        [group("slab_pad"), group("slab_xmax"), group("slab_all")],
        [Some("slab_pad_faces"), Some("slab_xmax"), None]
    );
    let [pad, all] = &part.case.surfaces[..] else { panic!("{:?}", part.case.surfaces) };
    assert_eq!((pad.name.as_str(), pad.within.as_deref()), ("slab_pad", Some("slab_pad_faces")));
    assert_eq!(all.of, ["slab_pad", "slab_xmax"]);
}

/// A set that nothing uses does not come along if the mesh of the part may have no nodes for it, nor do
/// surfaces that refer to one without material; a quantity needs its set, and material there.
#[test]
fn unused_sets_never_block_the_part() {
    let unused = "[[surface]]\nname = \"both\"\nof = [\"slab_xmax\", \"slab_ymin\"]\n\
                  [[set]]\nname = \"above\"\nwithin = \"tip\"\nboxes = [{ min = [4, 0, 0], max = [5, 2, 2] }]\n[[contact]]";
    let text = CASE.replace("[[contact]]", unused);
    let short = |[x, ..]: [f64; 3]| x < 4.0;
    let part = part_of(&text, short).expect("a part");
    assert_eq!(part.unused, ["both", "above", "tip"]);
    assert_eq!(part.case.sets.iter().map(|set| set.name.as_str()).collect::<Vec<_>>(), ["feet"]);
    assert!(part.reselected.is_empty() && part.case.surfaces.len() == 1);
    let used = CASE.replace(
        "[[contact]]",
        "[[quantity]]\nname = \"lift\"\ndisplacement = { set = \"tip\", component = \"y\" }\n[[contact]]",
    );
    let error = part_of(&used, short).expect_err("no tip");
    assert_eq!(error.to_string(), "no material is left on `tip`, which the quantity `lift` needs");
}

/// Forces of magnitude 1 + x at the nodes of the top face, x from 0.5 to 4.5. A part that ends at x = 2.5 keeps those
/// with x ≤ 2.5, and no more if a loose piece beyond it is left out.
#[test]
fn the_share_of_a_contact_force_that_a_part_keeps() {
    let (_, mesh, _) = scene(CASE, |_| true);
    let name = "slab_ymax";
    let mut forces = vec![0.0; 3 * mesh.nodes.len()];
    let (mut sum, mut kept) = (0.0, 0.0);
    for &node in mesh.set_nodes(name).expect("a face").iter() {
        let x = mesh.nodes[node as usize][0];
        forces[3 * node as usize] = 0.6 * (1.0 + x);
        forces[3 * node as usize + 1] = -0.8 * (1.0 + x);
        sum += 1.0 + x;
        kept += if x < 2.6 { 1.0 + x } else { 0.0 };
    }
    for loose in [f64::INFINITY, 4.0] {
        let part = part_of(CASE, |[x, ..]| x < 2.5 || x > loose).expect("a part");
        assert_eq!(part.bodies[0].loose.len(), usize::from(loose.is_finite()));
        let found = part.bodies[0].touching(&mesh, name, &forces).expect("a force");
        assert!((found.force / sum - 1.0).abs() < 1e-12 && (found.kept - kept / sum).abs() < 1e-12, "{found:?}");
        assert_eq!(part.bodies[0].touching(&mesh, "slab_ymin", &forces), None);
    }
}

/// A piece that touches no support is left out, with its volume; the rest keeps its named faces.
#[test]
fn loose_material_is_left_out() {
    let part = part_of(CASE, |[x, ..]| !(3.5..4.0).contains(&x)).expect("a part");
    let body = &part.bodies[0];
    assert_eq!((body.loose.len(), body.pieces.len()), (1, 1));
    let loose = body.loose[0];
    assert!((0.8..1.1).contains(&loose.volume) && loose.bounds[0][0] > 3.7, "{loose:?}");
    let share = |name: &str| body.faces.iter().find(|face| face.name == name).map(|face| face.share);
    assert_eq!(share("slab_xmax"), Some(0.0));
    assert!(share("feet").is_some_and(|share| (share - 1.0).abs() < 1e-12));
}

/// A piece without supports that a contact pair needs belongs to the part: contact holds it, as a
/// ring within a ring. A load does not.
#[test]
fn contact_holds_a_loose_piece() {
    let solid = |[x, ..]: [f64; 3]| !(1.0..1.5).contains(&x);
    let part = part_of(CASE, solid).expect("a part");
    let body = &part.bodies[0];
    assert_eq!((body.loose.len(), body.pieces.len(), body.by_contact.len()), (0, 2, 1));
    assert!(body.by_contact[0].bounds[0][0] > 1.4, "{:?}", body.by_contact);
    let share = |name: &str| body.faces.iter().find(|face| face.name == name).map_or(0.0, |face| face.share);
    assert!((share("pad") - 1.0).abs() < 0.01 && (share("feet") - 0.5).abs() < 0.01, "{:?}", body.faces);
    let pair = CASE.find("[[contact]]").expect("there")..CASE.find("[[dirichlet]]").expect("there");
    let loaded = CASE.replace(&CASE[pair], "[[load]]\nsurface = \"pad\"\npressure = 1.0\n");
    let error =
        part_of(&loaded.replace("contact_force = { steps = \"last\" }", "compliance = {}"), solid).expect_err("loose");
    let expected = "the material on `pad`, which a load needs, is a loose piece: neither a support nor a contact pair";
    assert!(
        error.to_string().contains(expected) && error.cure().contains("passive_solid"),
        "{error}; {}",
        error.cure()
    );
    // springs hold it, from either end
    let held = loaded.replace("contact_force = { steps = \"last\" }", "compliance = {}");
    for ends in ["set = \"pad\"", "set = \"block_ymin\"\nto = \"pad\""] {
        let part = part_of(&format!("{held}[[spring]]\nname = \"soft\"\n{ends}\nstiffness = 1.0\n"), solid);
        let body = &part.expect("a part").bodies[0];
        assert_eq!((body.loose.len(), body.pieces.len(), body.by_contact.len()), (0, 2, 0), "{ends}");
    }
}

/// The same pieces for a file without a part: one is loose where nothing touches it, another is held by contact.
#[test]
fn pieces_of_a_surface_are_told() {
    let pieces = |solid: &dyn Fn([f64; 3]) -> bool| {
        let (case, mesh, density) = scene(CASE, solid);
        let options = ExportOptions { threshold: Some(0.5), ..ExportOptions::default() };
        pieces_of_design(&case, &mesh, &density, &options).expect("pieces")
    };
    let apart = pieces(&|[x, ..]| !(3.5..4.0).contains(&x));
    assert_eq!((apart.len(), apart[0].pieces, apart[0].loose.len(), apart[0].by_contact.len()), (1, 2, 1, 0));
    let in_contact = pieces(&|[x, ..]| !(1.0..1.5).contains(&x));
    assert_eq!((in_contact[0].pieces, in_contact[0].loose.len(), in_contact[0].by_contact.len()), (2, 0, 1));
    // the second piece is held by contact, although the first one has a part of the contact face too
    let gap = |[x, ..]: [f64; 3]| !(2.0..2.5).contains(&x);
    let shared = pieces(&gap);
    assert_eq!((shared[0].pieces, shared[0].loose.len(), shared[0].by_contact.len()), (2, 0, 1));
    let body = &part_of(CASE, gap).expect("a part").bodies[0];
    assert_eq!(body.loose.iter().map(|piece| piece.on_contact).collect::<Vec<_>>(), [true]);
    assert!(pieces(&|[x, ..]| x < 2.0).is_empty(), "one piece");
}

/// The set of nodes whose gaps `adjust` changes belongs to the part, whose case refers to it.
#[test]
fn adjusted_nodes_stay() {
    let text = CASE
        .replace("slave = \"block_ymin\"\nmaster = \"pad\"", "slave = \"pad\"\nmaster = \"block_ymin\"")
        .replace("friction = 0.3", "friction = 0.3\nadjust = { nodes = \"line\" }")
        .replace(
            "[[contact]]",
            "[[set]]\nname = \"line\"\nboxes = [{ min = [2, 1, 0], max = [2, 1, 2] }]\n[[contact]]",
        );
    let part = part_of(&text, |[x, ..]| x < 4.0).expect("a part");
    assert!(part.case.sets.iter().any(|set| set.name == "line"), "{:?}", part.case.sets);
    assert_eq!(part.reselected, ["line"]);
}

/// A body that loses nothing keeps its shape, surfaces and sets; one that does gets a mesh.
#[test]
fn a_solid_body_keeps_its_mesh() {
    let part = sized(CASE, |_| true, None).expect("a part");
    assert_eq!((part.whole.as_slice(), part.bodies.len()), (["slab".to_owned()].as_slice(), 0));
    let case = parse_case(CASE, "case.toml").expect("a case").case;
    assert_eq!((&part.case.bodies, &part.case.surfaces, &part.case.sets), (&case.bodies, &case.surfaces, &case.sets));
    assert!(part.case.design.is_none() && part.reselected.is_empty());
    let part = sized(CASE, |[x, y, z]| x < 2.0 || y > 0.5 || z < 1.0, None).expect("a part");
    assert_eq!((part.whole.len(), part.bodies.len(), part.bodies[0].size), (0, 1, 0.25));
}

/// Regions with other materials keep their places; one without material in it would be an error.
#[test]
fn regions_keep_their_materials() {
    let soft = "material = { neo_hooke = { youngs_modulus = 500.0, poisson_ratio = 0.3 } }";
    let regions = ["min = [0.5, 0, 0], max = [1.5, 1, 2]", "centre = [4.2, 0.5, 1], radius = 0.3"]
        .map(|region| format!("[[body.section]]\nregion = {{ {region} }}\n{soft}\n"));
    let second = CASE.rfind("[[body]]").expect("a second body");
    let text = [&CASE[..second], &regions.concat(), &CASE[second..]].concat();
    let sections =
        |solid: &dyn Fn([f64; 3]) -> bool| part_of(&text, solid).expect("a part").case.bodies[0].sections.clone();
    let of_case = parse_case(&text, "case.toml").expect("a case").case.bodies[0].sections.clone();
    assert_eq!(of_case.len(), 2);
    assert_eq!(sections(&|x| x[1] < 0.5 || x[0] > 1.0), of_case);
    assert_eq!(sections(&|x| x[0] < 3.5), of_case[..1]);
}

/// A quarter of a press-fit hub, cut beside its bore: the bore keeps its nodes, other points of it lie
/// on the cylinder, and so do those of the elements between them, so that the part's bore has the area
/// of the cylinder up to the sagitta of its triangles.
#[test]
fn curved_faces_stay_on_their_shape() {
    let text = CASE
        .replace(
            "box = { min = [0, 0, 0], max = [4, 1, 2], elements = [16, 4, 8] }",
            "hollow_cylinder = { inner_radius = 2.0, outer_radius = 4.0, height = 1.0, elements = [6, 24, 2] }",
        )
        .replace("[1.5, 1.0, 0.5], max = [2.5, 1.5, 1.5]", "[2.5, 1.0, -0.5], max = [3.5, 1.5, 0.5]")
        .replace("place = { translate = [0.5, 0, 0] }\n", "")
        .replace("slab_ymin", "slab_outer")
        .replace("boxes = [{ min = [0.5, 0, 0], max = [1.5, 0, 2] }]\n", "")
        .replace("boxes = [{ min = [1.5, 1, 0], max = [3.5, 1, 2] }]", "within = \"slab_top\"")
        .replace("nearest = [4.5, 1, 1]", "nearest = [4.0, 1, 0]");
    let solid = |[x, _, z]: [f64; 3]| (x - 3.0).hypot(z) > 0.5;
    for size in [None, Some(0.3), Some(2.0)] {
        let part = sized(&text, solid, size).expect("a part");
        let (body, mesh) =
            (&part.bodies[0], build_mesh(&parse_case(&text, "case.toml").expect("a case").case).expect("a mesh"));
        assert_eq!((body.crossings, body.pieces.len()), (0, 1));
        let inner = body.faces.iter().find(|face| face.name == "slab_inner").expect("the bore");
        assert!((inner.share - 1.0).abs() < 1e-9 && body.keeps(inner), "{inner:?}");
        let own: Vec<usize> = (0..body.surface.triangles.len())
            .filter(|&t| inner.patches.contains(&(body.surface.patch[t] + 1)))
            .collect();
        let at = |n: u32| body.surface.points[n as usize];
        let points: Vec<[f64; 3]> = own.iter().flat_map(|&t| body.surface.triangles[t]).map(at).collect();
        for [x, _, z] in &points {
            assert!((x.hypot(*z) - 2.0).abs() < 1e-12);
        }
        for n in mesh.surfaces["slab_inner"].nodes() {
            assert!(points.contains(&mesh.nodes[n as usize]), "a node of the bore is gone");
        }
        // The bends between the facets stay, so no triangle leaves them.
        assert!(inner.distance < 1e-12 && inner.area_change.abs() < 1e-12, "{inner:?}");
        let on_bore = |p: [f64; 3]| (p[0].hypot(p[2]) - 2.0).abs() < 1e-12;
        let lifted = body.moves.iter().filter(|[_, to]| on_bore(*to)).count();
        // Edges and triangles: 3/2 and 1 for each triangle, and half of those on the rims.
        assert!(lifted > 5 * own.len() / 2 && lifted < 3 * own.len(), "{lifted} of {}", own.len());
    }
}

#[test]
fn what_is_no_part() {
    let error = part_of(CASE, |[x, ..]| x > 1.6).expect_err("no feet");
    assert!(error.to_string().contains("no material is left on `feet`, which a support or motion needs"), "{error}");
    let (start, end) = (CASE.find("[design]").expect("there"), CASE.find("[objective]").expect("there"));
    let error = part_of(&(CASE[..start].to_owned() + &CASE[end..]), |_| true).expect_err("no design");
    assert!(matches!(error, PartError::NoDesign), "{error}");
    assert!(matches!(part_of(CASE, |_| false), Err(PartError::Export(_))));
}

/// The script lists the patches of each group, and the surface file assigns each triangle to its
/// patch.
#[test]
fn files_for_gmsh() {
    let part = part_of(CASE, |_| true).expect("a part");
    let folder = tempfile::tempdir().expect("a folder");
    let (script, surface) = (folder.path().join(SCRIPT), folder.path().join("slab_surface.msh"));
    write_script(&script, &part.bodies).expect("written");
    write_surface(&surface, &part.bodies[0]).expect("written");
    let text = std::fs::read_to_string(script).expect("text");
    let list = text.split("BODIES = ").nth(1).and_then(|rest| rest.split("\n\n#").next()).expect("the list");
    let list: serde_json::Value = serde_json::from_str(list).expect("JSON");
    let face = part.bodies[0].faces.iter().find(|face| face.name == "pad").expect("the pad");
    assert_eq!(list[0]["groups"]["slab_pad"], serde_json::json!(face.patches));
    assert_eq!((&list[0]["mesh"], &list[0]["size"]), (&"slab_part.msh".into(), &0.25.into()));
    let text = std::fs::read_to_string(surface).expect("text");
    let triangles = text.lines().filter(|line| line.contains(" 2 2 0 ")).count();
    assert_eq!(triangles, part.bodies[0].triangles());
}

/// Forces and springs on the 9 × 17 nodes of the bottom act with their sums, also on a set that consists of faces; those
/// on the nodes of an edge cannot. Equations between the nodes of two faces are refused, those of means are not.
#[test]
fn what_acts_on_each_node_keeps_its_sum() {
    let load = |set: &str| format!("[[load]]\nsurface = \"{set}\"\nnodal_force = [0.0, -0.5, 0.25]\n");
    let spring = "[[spring]]\nname = \"soft\"\nset = \"slab_ymin\"\nnodal_stiffness = 2.0\n";
    let edge = "[[set]]\nname = \"edge\"\nboxes = [{ min = [0.5, 0, 0], max = [0.5, 0, 2] }]\n[[contact]]";
    let text =
        CASE.replace("[[contact]]", edge) + &load("slab_ymin") + &load("feet") + &load("edge") + &load("tip") + spring;
    let part = part_of(&text, |_| true).expect("a part");
    let kinds: Vec<(&str, LoadKind)> = part.case.loads.iter().map(|load| (load.surface.as_str(), load.kind)).collect();
    let force = |nodes: f64| LoadKind::Force([0.0, -0.5 * nodes, 0.25 * nodes]);
    let each = LoadKind::NodalForce([0.0, -0.5, 0.25]);
    let feet = 5.0 * 9.0;
    assert_eq!(kinds, [("slab_ymin", force(9.0 * 17.0)), ("slab_feet", force(feet)), ("edge", each), ("tip", each)]);
    assert_eq!(part.case.springs[0].stiffness, SpringStiffness::Stiffness(2.0 * 9.0 * 17.0));
    let found: Vec<_> = part.per_node.iter().map(|of| (of.name.as_str(), of.summed)).collect();
    assert_eq!(found, [("slab_ymin", Some(153)), ("feet", Some(45)), ("edge", None), ("slab_ymin", Some(153))]);

    let equation = |mean: bool| {
        format!(
            "[[equation]]\nterms = [{{ set = \"slab_xmin\", mean = {mean} }}, {{ set = \"slab_xmax\", factor = -1.0, \
             mean = {mean} }}]\n"
        )
    };
    assert!(part_of(&(CASE.to_owned() + &equation(true)), |_| true).is_ok());
    let error = part_of(&(CASE.to_owned() + &equation(false)), |_| true).unwrap_err();
    assert!(matches!(&error, PartError::NodeToNode { names } if *names == ["slab_xmin", "slab_xmax"]), "{error}");
}
