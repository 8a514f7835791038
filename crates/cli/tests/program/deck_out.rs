//! Cases and designs as decks, read again and in CalculiX.

use super::*;

/// Everything that a deck and a case have in common: section, tie, rigid body, coupling, spring,
/// temperature, loads on faces and on mass, contact, motions with waypoints.
const ALL: &str = include_str!("decks/all.toml");
/// Equations, points and a kinematic coupling between linear elastic bodies.
const LINEAR: &str = include_str!("decks/linear.toml");

/// A rod between two supports, one of which moves, that a bolt pulls together.
const BOLT: &str = include_str!("decks/bolt.toml");

/// Solves a case, writes it as a deck, solves the deck, and compares all columns of `quantities.csv`, which
/// have the same order, relative to the largest number of a row.
fn read_again(text: &str) {
    let place = Place::new();
    place.write("case.toml", text);
    place.good("export case.toml --deck deck");
    place.good("solve case.toml -q");
    place.good("solve deck/case.toml -q");
    let plain = |name: &String| name.replace("_nodes", "");
    let (own, again) = (place.table("case_solve/quantities.csv"), place.table("deck/case_solve/quantities.csv"));
    assert!(own.len() > 2 && own.len() == again.len());
    let columns: Vec<Option<usize>> =
        own[0].iter().map(|name| again[0].iter().position(|other| plain(other) == plain(name))).collect();
    // a point of the case that only equations use has another name
    let known = columns.iter().flatten().count();
    assert!(known > 18 && known + 4 >= own[0].len(), "{:?}\n{:?}", own[0], again[0]);
    for (a, b) in own.iter().zip(&again).skip(1) {
        let size = a.iter().filter_map(|cell| cell.parse::<f64>().ok()).fold(0.0, |m: f64, x| m.max(x.abs()));
        for ((name, cell), column) in
            own[0].iter().zip(a).zip(&columns).filter(|((name, _), _)| *name != "energy_balance")
        {
            let Some(column) = column else { continue };
            let difference = (number(cell) - number(&b[*column])).abs();
            assert!(difference <= 1e-11 * size, "{name}: {cell} {}", b[*column]);
        }
    }
}

/// A deck that is written has the same solution when it is read again, to round-off.
#[test]
fn a_case_survives_as_a_deck() {
    read_again(ALL);
    read_again(LINEAR);
    read_again(BOLT);
}

/// An orthotropic law with oblique axes.
const WOOD: &str = "orthotropic = { e1 = 12000, e2 = 800, e3 = 600, nu12 = 0.4, nu13 = 0.5, nu23 = 0.3, g12 = 700, \
                    g13 = 650, g23 = 60, axis1 = [0.866, 0.3, 0.4], axis2 = [-0.2, 1, 0.1] }";

/// A block that is stretched, bent and sheared.
fn block(law: &str) -> String {
    let block = "title = \"Block\"\n[[body]]\nname = \"block\"\nbox = { min = [0, 0, 0], max = [2, 1, 1], elements = [3, 2, 2] }\n\
                 material = { LAW }\n[[dirichlet]]\nset = \"block_xmin\"\n[[dirichlet]]\nset = \"block_xmax\"\n\
                 components = [\"x\", \"y\"]\nmotion = [{ t = 0.4, u = [0.05, 0, 0] }, { t = 1, u = [0.01, 0.04, 0] }]\n\
                 [load_path]\nsteps = 5\ntolerance = { relative = 1e-11 }\n";
    block.replace("LAW", law)
}

/// Other laws and elements: quadratic tetrahedra, wedges, plasticity, second axis of time.
#[test]
fn laws_survive_as_a_deck() {
    for law in [
        "yeoh = { c10 = 10, c20 = 0.5, c30 = 0.1, bulk_modulus = 100 }",
        "ogden = { mu = [12, 3, 2], alpha = [1.3, 5, -2], bulk_modulus = 90 }",
        "mooney_rivlin = { c10 = 10, c01 = 3, bulk_modulus = 100 }",
        "neo_hooke = { youngs_modulus = 30, poisson_ratio = 0.35, form = \"isochoric\" }",
        "j2_linear = { youngs_modulus = 2000, poisson_ratio = 0.3, yield_stress = 10, hardening_modulus = 50 } }\n\
         element = \"f_bar\"\n#",
        "j2_table = { youngs_modulus = 2000, poisson_ratio = 0.3, yield_stress = [10, 14, 15], plastic_strain = [0, 0.05, 0.2] } }\n\
         element = \"f_bar\"\n#",
        WOOD,
    ] {
        read_again(&block(law));
    }
}

/// A block of serendipity hexahedra that a set or equations move, and a ring with forces on faces: the deck, which lacks
/// the centres of faces, has the reactions and the energy of the case. F̄, which it lacks too, gives a warning.
#[test]
fn second_order_bodies_survive_as_a_deck() {
    let body = "[[body]]\nname = \"a\"\norder = 2\nshape_functions = \"serendipity\"\n\
                box = { min = [0, 0, 0], max = [2, 1, 1], elements = [2, 1, 1] }\n\
                material = { st_venant_kirchhoff = { youngs_modulus = 1000, poisson_ratio = 0.3 } }\n\
                [[dirichlet]]\nset = \"a_xmin\"\n[load_path]\nsteps = 2\ntolerance = { relative = 1e-11 }\n";
    let turned = "[[dirichlet]]\nset = \"a_xmax\"\nrotation = { point = [0, 0.5, 0.5], direction = [1, 0, 0] }\n\
                  motion = [{ t = 1, u = [0, 0, 0], angle = 2 }]\n";
    let pulled = "[[point]]\nname = \"p\"\nat = [3, 0, 0]\n[[dirichlet]]\nset = \"p\"\n\
                  motion = [{ t = 1, u = [0.1, 0, 0] }]\n[[equation]]\nterms = [{ set = \"a_xmax\", component = \"x\"MEAN }, \
                  { set = \"p\", component = \"x\", factor = -1 }]\n";
    let place = Place::new();
    let moved = [turned, &pulled.replace("MEAN", ", mean = true"), &pulled.replace("MEAN", "")];
    for text in moved.map(|motion| format!("{body}{motion}")).into_iter().chain([RING.to_owned()]) {
        place.write("case.toml", &text);
        place.good("export case.toml --deck deck --force");
        place.good("solve case.toml -q --force");
        place.good("solve deck/case.toml -q --force");
        let (own, again) = (place.table("case_solve/quantities.csv"), place.table("deck/case_solve/quantities.csv"));
        let (row, other) = (&own[own.len() - 1], &again[again.len() - 1]);
        let mut compared = 0;
        let is_compared = |name: &str| name.contains("reaction") || name == "strain_energy";
        for (name, cell) in own[0].iter().zip(row).filter(|(name, _)| is_compared(name)) {
            let Some(at) = again[0].iter().position(|known| known.replace("_nodes", "") == *name) else { continue };
            assert!((number(cell) - number(&other[at])).abs() < 1e-8 * 50.0, "{name}: {cell} {}", other[at]);
            compared += 1;
        }
        assert!(compared >= 4, "{:?}\n{:?}", own[0], again[0]);
    }
    place.write("case.toml", &body.replace("shape_functions = \"serendipity\"", "element = \"f_bar\""));
    let written = place.good("export case.toml --deck deck --force");
    assert!(format!("{}{}", written.out, written.err).contains("F̄ is lost in `a`"), "{} {}", written.out, written.err);
}

/// A ring of 15-node wedges under its weight, of which a part acts on the nodes of the support.
const WEDGES: &str = r#"
[[body]]
name = "ring"
mesh = { file = "ring.inp" }
shape_functions = "serendipity"
mass_density = 7.8e-6
material = { linear_elastic = { youngs_modulus = 210000.0, poisson_ratio = 0.3 } }
[[dirichlet]]
set = "ring_fixed"
[[load]]
gravity = [0, -9.81e6, 0]
[load_path]
steps = 1
"#;

/// A ring of 20-node hexahedra with a traction on its curved face and a force on its end: it is bent, sheared and
/// compressed.
const RING: &str = r#"
[[body]]
name = "ring"
order = 2
shape_functions = "serendipity"
hollow_cylinder = { inner_radius = 1.0, outer_radius = 1.6, height = 2.0, elements = [1, 8, 2] }
material = { linear_elastic = { youngs_modulus = 1000, poisson_ratio = 0.3 } }
[[dirichlet]]
set = "ring_bottom"
[[load]]
surface = "ring_outer"
traction = [1.0, 2.0, -0.5]
[[load]]
surface = "ring_top"
force = [0.3, -8.0, 4.0]
[load_path]
steps = 2
"#;

/// Whether CalculiX is installed.
pub(crate) fn has_ccx() -> bool {
    let found = Command::new("ccx").arg("-v").output().is_ok();
    if !found {
        println!("skipped: CalculiX (ccx) is not installed");
    }
    found
}

/// The numbers of a deck in both programs.
pub(crate) fn verified(place: &Place, folder: &str, tolerance: &str) -> Value {
    place.good(&format!("verify deck {folder} --json --tolerance {tolerance}")).event("deck")
}

/// Expected values: CalculiX 2.20. Elements and constraints coincide, so only the digits of its files and its
/// criterion of convergence differ.
#[test]
fn calculix_agrees_without_contact() {
    if !has_ccx() {
        return;
    }
    let place = Place::new();
    place.write("case.toml", LINEAR);
    place.good("export case.toml --deck deck");
    let compared = verified(&place, "deck", "1e-3");
    assert!(compared["displacements"].as_f64().expect("a number") < 1e-4, "{compared}");
    assert!(compared["compared"].as_array().expect("rows").len() >= 9, "{compared}");
    place.write("case.toml", &LINEAR.replace("kinematic", "distributing"));
    place.good("export case.toml --deck deck --force");
    verified(&place, "deck", "1e-3");
    for text in [BOLT, &block(WOOD)] {
        place.write("case.toml", text);
        place.good("export case.toml --deck deck --force");
        let compared = verified(&place, "deck", "1e-3");
        assert!(compared["displacements"].as_f64().expect("a number") < 1e-4, "{compared}");
    }
    // a part of these forces acts on centres of faces, which the deck lacks
    place.write("case.toml", RING);
    place.good("export case.toml --deck deck --force");
    let compared = verified(&place, "deck", "1e-4");
    assert!(compared["displacements"].as_f64().expect("a number") < 1e-5, "{compared}");
    let rows = compared["compared"].as_array().expect("rows");
    let reaction = |row: &&Value| row["quantity"].as_str().is_some_and(|name| name.starts_with("reaction_ring_bottom"));
    assert_eq!(rows.iter().filter(reaction).count(), 3, "{compared}");
    // a part of the weight acts on centres of faces, which the deck lacks
    place.write("ring.inp", include_str!("../../../slipstick/tests/data/ring_of_wedges.inp"));
    place.write("case.toml", WEDGES);
    place.good("export case.toml --deck deck --force");
    assert!(place.read("deck/model.inp").contains("TYPE=C3D15"));
    let compared = verified(&place, "deck", "1e-4");
    assert!(compared["displacements"].as_f64().expect("a number") < 1e-4, "{compared}");
    let rows = compared["compared"].as_array().expect("rows");
    let near = |row: &Value| row["deviation"].as_f64().is_some_and(|deviation| deviation < 1e-5);
    assert!(rows.len() == 3 && rows.iter().all(near), "{compared}");
}

/// A block that expands freely has no reactions. Both programs report different round-off, which does not count
/// as a deviation.
#[test]
fn forces_that_are_zero_do_not_deviate() {
    if !has_ccx() {
        return;
    }
    let planes = ["x", "y", "z"].map(|c| format!("[[dirichlet]]\nset = \"a_{c}min\"\ncomponents = [\"{c}\"]\n"));
    let place = Place::new();
    place.write(
        "case.toml",
        &format!(
            "[[body]]\nname = \"a\"\nbox = {{ min = [0, 0, 0], max = [3, 1, 1], elements = [6, 2, 2] }}\n\
             material = {{ linear_elastic = {{ youngs_modulus = 2e5, poisson_ratio = 0.3 }} }}\n\
             thermal_expansion = 1.2e-5\n[[temperature]]\nchange = 100\n{}[load_path]\nsteps = 2\n",
            planes.concat()
        ),
    );
    place.good("export case.toml --deck deck");
    let shown = place.good("verify deck deck --tolerance 1e-6").out;
    let rows: Vec<&str> = shown.lines().filter(|line| line.starts_with("  reaction_a_")).collect();
    assert!(rows.len() == 3 && rows.iter().all(|row| row.ends_with(" zero")), "{shown}");
}

/// A design: the promise, the deck in both programs; the contact integrals differ on a coarse mesh.
#[test]
fn a_design_as_a_deck() {
    let place = Place::with("volume_fraction = 0.5", "volume_fraction = 0.6");
    place.good("optimize case.toml -q");
    let written = place.good("export case --deck deck --threshold 0.3");
    assert!(written.out.contains("density above 0.3") && written.out.contains("verify deck deck"), "{}", written.out);
    let deck = place.read("deck/model.inp");
    assert!(deck.contains("*HYPERELASTIC, NEO HOOKE") && deck.contains("*CONTACT PAIR"), "{deck}");
    assert!(written.err.contains("contact[0].surfaces") && written.err.contains("isochoric"), "{}", written.err);
    let record = place.json("deck/deck.json");
    let promised = |row: &Value| row["column"] == "block_ymin_normal_force" && row["promised"].as_f64().is_some();
    assert!(record["decks"][0]["compared"].as_array().expect("rows").iter().any(promised), "{record}");
    place.good("solve deck/case.toml -q");
    place.bad("export case --deck deck", 2, &["already exists", "--force"]);
    place.bad("export case --deck case", 2, &["did not write", "another folder"]);
    place.good("export case --deck deck --force --contact-stiffness 1e5");
    assert!(place.read("deck/model.inp").contains("PRESSURE-OVERCLOSURE=LINEAR\n100000.0"));
    if has_ccx() {
        let compared = verified(&place, "deck", "0.5");
        let row = |row: &&Value| row["quantity"] == "block_ymin_normal_force";
        let row = compared["compared"].as_array().expect("rows").iter().find(row).cloned().expect("compared");
        assert!(row["deviation"].as_f64().expect("a number").abs() < 0.2, "{row}");
    }
}

/// On a curved slave, CalculiX reports the resultant along the mean normal, not the sum of normal forces: the
/// resultant is compared, which equals the reaction of the slab.
#[test]
fn forces_on_curved_slaves_are_resultants() {
    let material = "material = { st_venant_kirchhoff = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    let text = format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [3, 1, 3], elements = [9, 3, 9] }}\n{material}\n\
         [[body]]\nname = 'ball'\nhalf_ball = {{ radius = 1.0, elements = [8, 4, 8] }}\n\
         place = {{ translate = [1.5, 2.0, 1.5] }}\n{material}\n\
         [[contact]]\nslave = 'ball_dome'\nmaster = 'slab_ymax'\nfriction = 0.0\nsurfaces = 'faceted'\n\
         [[quantity]]\nname = 'pressed'\ncontact_force = {{ slave = 'ball_dome', component = 'normal' }}\n\
         [[dirichlet]]\nset = 'slab_ymin'\n\
         [[dirichlet]]\nset = 'ball_flat'\nmotion = [{{ t = 1, u = [0, -0.2, 0] }}]\n[load_path]\nsteps = 2\n"
    );
    let place = Place::new();
    place.write("ball.toml", &text);
    let written = place.good("export ball.toml --deck deck");
    let record = place.json("deck/deck.json");
    let names = |what: &str| record["decks"][0][what].to_string();
    assert!(!names("compared").contains("normal_force") && !names("compared").contains("pressed"), "{record}");
    assert!(names("left_out").contains("normal_force") && names("left_out").contains("pressed"), "{record}");
    assert!(written.out.contains("not compared: pressed: the surface is curved"), "{}", written.out);
    place.good("solve deck/case.toml -q");
    let table = place.table("deck/case_solve/quantities.csv");
    let last = table.last().expect("a row");
    let of = |name: &str| number(&last[table[0].iter().position(|column| column == name).expect(name)]);
    let (resultant, reaction) = (of("ball_dome_resultant_y"), of("reaction_slab_ymin_nodes_y"));
    assert!(reaction > 1.0 && (resultant - reaction).abs() < 1e-6 * reaction, "{resultant} {reaction}");
    if has_ccx() {
        verified(&place, "deck", "0.05");
    }
}

/// A block with a law between two symmetry planes, under a cover that is pressed onto it by 0.05.
fn quarter(law: &str, cover: &str, pressed: &str) -> String {
    format!(
        "[[body]]\nname = 'block'\nbox = {{ min = [0, 0, 0], max = [2, 1, 2], elements = [2, 1, 2] }}\n\
         material = {{ {law} }}\n\
         [[body]]\nname = 'cover'\nbox = {{ min = [0, 1, 0], max = [3, 2, 3], elements = [1, 1, 1] }}\n{cover}\n\
         [[contact]]\nslave = 'block_ymax'\nmaster = 'cover_ymin'\nfriction = 0.3\nsurfaces = 'faceted'\n\
         [[symmetry]]\nnormal = 'x'\n[[symmetry]]\nnormal = 'z'\n[[dirichlet]]\nset = 'block_ymin'\n\
         [[dirichlet]]\n{pressed}\nmotion = [{{ t = 1, u = [0, -0.05, 0] }}]\n\
         [load_path]\nsteps = 2\ntolerance = {{ relative = 1e-11 }}\n"
    )
}

/// Rubber with a bulk modulus of 100 μ, and a law that is a thousand times stiffer.
const RUBBER: &str = "mooney_rivlin = { c10 = 0.5, c01 = 0.0, bulk_modulus = 49.667 }";
const HARDER: &str = "material = { mooney_rivlin = { c10 = 500.0, c01 = 0.0, bulk_modulus = 2000.0 } }";

/// A rigid body that ends on symmetry planes moves in both: its reference node is held, but none of its nodes, which
/// CalculiX refuses. The planes alone hold the body as a support of all its components does.
#[test]
fn rigid_bodies_on_symmetry_planes() {
    let place = Place::new();
    place.write("case.toml", &quarter(RUBBER, "rigid = {}", "set = 'cover'"));
    place.good("export case.toml --deck deck");
    let deck = place.read("deck/model.inp");
    place.good("solve deck/case.toml -q");
    place.write("free.toml", &quarter(RUBBER, "rigid = {}", "set = 'cover'\ncomponents = ['y']"));
    place.good("export free.toml --deck free");
    place.good("solve free/case.toml -q");
    let (held, free) = (place.table("deck/case_solve/quantities.csv"), place.table("free/case_solve/quantities.csv"));
    for name in ["reaction_cover_y", "block_ymax_normal_force", "block_ymax_friction_force"] {
        let of = |table: &[Vec<String>]| {
            let column = table[0].iter().position(|column| column == name).expect(name);
            number(&table[table.len() - 1][column])
        };
        let (held, free) = (of(&held), of(&free));
        assert!(held.abs() > 1.0 && (held - free).abs() < 1e-9 * held.abs(), "{name}: {held} {free}");
    }
    let (_, sets) = deck.split_once("*NSET, NSET=symmetry_x\n").expect("the set");
    let nodes: Vec<u32> = sets
        .lines()
        .take_while(|line| !line.starts_with('*'))
        .flat_map(|line| line.split(", "))
        .map(|n| n.parse().expect("a number"))
        .collect();
    // the block has the first 18 nodes, six of which lie on the plane
    assert!(nodes.len() == 6 && nodes.iter().all(|&node| node <= 18), "{nodes:?}");
    if has_ccx() {
        // the coarse mesh and two steps of friction differ sideways
        verified(&place, "deck", "0.1");
    }
}

/// Components that supports and planes share belong to the first support, in both programs: rows have the reactions of
/// the case. Expected values: CalculiX 2.20, as in `calculix_agrees_without_contact`.
#[test]
fn reactions_where_supports_share_nodes() {
    let text = "[[body]]\nname = 'block'\nbox = { min = [0, 0, 0], max = [2, 1, 1], elements = [4, 2, 2] }\n\
                material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n\
                [[symmetry]]\nnormal = 'z'\n[[dirichlet]]\nset = 'block_xmin'\n\
                [[dirichlet]]\nset = 'block_ymin'\ncomponents = ['y']\n\
                [[dirichlet]]\nset = 'block_xmax'\ncomponents = ['x']\nmotion = [{ t = 1, u = [0.1, 0, 0] }]\n[load_path]\nsteps = 1\n\
                [[quantity]]\nname = 'side'\nreaction = { set = 'block_ymin', component = 'y' }\n\
                [[quantity]]\nname = 'plane'\nreaction = { set = 'block_zmin', component = 'z' }\n";
    let place = Place::new();
    place.write("case.toml", text);
    place.good("export case.toml --deck deck");
    place.good("solve case.toml -q");
    place.good("solve deck/case.toml -q");
    let (own, again) = (place.table("case_solve/quantities.csv"), place.table("deck/case_solve/quantities.csv"));
    let last = |table: &[Vec<String>], name: &str| {
        let column = table[0].iter().position(|column| column == name).expect(name);
        number(&table[table.len() - 1][column])
    };
    let all = [("xmin", "x"), ("xmin", "y"), ("xmin", "z"), ("ymin", "y"), ("xmax", "x")];
    let mut rows: Vec<(String, f64)> = all
        .iter()
        .map(|(set, c)| (format!("reaction_block_{set}_nodes_{c}"), last(&own, &format!("reaction_block_{set}_{c}"))))
        .collect();
    rows.extend(["side", "plane"].map(|name| (name.to_owned(), last(&own, name))));
    for (name, expected) in &rows {
        let here = last(&again, name);
        assert!(expected.abs() > 0.1 && (here - expected).abs() < 1e-9 * 100.0, "{name}: {here} {expected}");
    }
    if has_ccx() {
        let compared = verified(&place, "deck", "1e-3");
        let compared = compared["compared"].as_array().expect("rows");
        for (name, expected) in &rows {
            let row = compared.iter().find(|row| row["quantity"] == name.as_str()).expect(name);
            let there = row["ccx"].as_f64().expect("a number");
            assert!((there - expected).abs() < 1e-3 * expected.abs().max(1.0), "{row} {expected}");
        }
    }
}

/// What `check` rejects is not written either, for the same reason.
#[test]
fn cases_that_cannot_be_built_are_no_decks() {
    let place = Place::new();
    let text = quarter(RUBBER, "rigid = {}", "set = 'cover'").replace("min = [0, 1, 0]", "min = [-1, 1, 0]");
    place.write("case.toml", &text);
    let why = ["bodies lie on both sides of the plane x = 0"];
    place.bad("check case.toml", 2, &why);
    place.bad("export case.toml --deck deck", 2, &why);
    assert!(!place.path("deck").exists());
}

/// Hard contact of rubber, which CalculiX makes 25 per length here, half as stiff as the rubber is in compression:
/// stiffer linear contact is written. Expected value: the normal force of the case, where contact does not give way.
#[test]
fn hard_contact_of_soft_bodies_is_written_as_stiff_contact() {
    let place = Place::new();
    let text = quarter(RUBBER, HARDER, "set = 'cover_ymax'");
    place.write("case.toml", &text);
    let written = place.good("export case.toml --deck deck");
    assert!(written.err.contains("2.500e1") && written.err.contains("`--contact-stiffness`"), "{}", written.err);
    assert!(place.read("deck/model.inp").contains("PRESSURE-OVERCLOSURE=LINEAR"));
    place.good("solve case.toml -q");
    let table = place.table("case_solve/quantities.csv");
    let column = table[0].iter().position(|name| name == "block_ymax_normal_force").expect("the column");
    let expected = number(&table[table.len() - 1][column]);
    if has_ccx() {
        let compared = verified(&place, "deck", "0.05");
        let row = |row: &&Value| row["quantity"] == "block_ymax_normal_force";
        let row = compared["compared"].as_array().expect("rows").iter().find(row).cloned().expect("compared");
        let there = row["ccx"].as_f64().expect("a number");
        assert!((there - expected).abs() < 0.02 * expected, "{row} {expected}");
        place.bad(
            "verify deck deck --tolerance 1e-9",
            3,
            &["help: contact in CalculiX is a spring: export with `--contact-stiffness"],
        );
    }
    // stiff bodies with the same elements keep hard contact
    place.write(
        "case.toml",
        &text.replace(RUBBER, "st_venant_kirchhoff = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }"),
    );
    place.good("export case.toml --deck deck --force");
    assert!(place.read("deck/model.inp").contains("PRESSURE-OVERCLOSURE=HARD"));
}

/// Load cases have a deck each; what a deck cannot hold is refused with the key.
#[test]
fn what_a_deck_cannot_hold() {
    let cases =
        "[[load_case]]\nname = \"a\"\nfriction = 0.1\n[[load_case]]\nname = \"b\"\nmotion_factor = 0.5\n[design]";
    let place = Place::with("[design]", cases);
    place.good("export case.toml --deck deck");
    assert!(place.read("deck/model_a.inp").contains("*FRICTION\n0.1, "));
    assert!(place.read("deck/model_b.inp").contains("block_ymax_nodes, 2, 2, -0.05"));
    let place = Place::with(
        "friction = 0.3",
        "friction = 0.3\noffset = [{ t = 0.5, offset = 0.01 }, { t = 1, offset = 0.03 }]",
    );
    place.bad("export case.toml --deck deck", 2, &["`contact[0].offset`", "--ignore contact.offset"]);
    place.good("export case.toml --deck deck --ignore contact.offset");
    place.bad("export case.toml", 2, &["is a file", "--deck DIR"]);
    place.bad("verify deck nowhere", 2, &["deck.json", "export RUN --deck DIR"]);
    place.bad("verify deck deck --ccx ./no_such_program", 2, &["cannot run", "install CalculiX"]);
}
