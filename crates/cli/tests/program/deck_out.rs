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

/// Other laws and elements: quadratic tetrahedra, wedges, plasticity, second axis of time.
#[test]
fn laws_survive_as_a_deck() {
    let block = "title = \"Block\"\n[[body]]\nname = \"block\"\nbox = { min = [0, 0, 0], max = [2, 1, 1], elements = [3, 2, 2] }\n\
                 material = { LAW }\n[[dirichlet]]\nset = \"block_xmin\"\n[[dirichlet]]\nset = \"block_xmax\"\n\
                 components = [\"x\", \"y\"]\nmotion = [{ t = 0.4, u = [0.05, 0, 0] }, { t = 1, u = [0.01, 0.04, 0] }]\n\
                 [load_path]\nsteps = 5\ntolerance = { relative = 1e-11 }\n";
    for law in [
        "yeoh = { c10 = 10, c20 = 0.5, c30 = 0.1, bulk_modulus = 100 }",
        "ogden = { mu = [12, 3, 2], alpha = [1.3, 5, -2], bulk_modulus = 90 }",
        "mooney_rivlin = { c10 = 10, c01 = 3, bulk_modulus = 100 }",
        "neo_hooke = { youngs_modulus = 30, poisson_ratio = 0.35, form = \"isochoric\" }",
        "j2_linear = { youngs_modulus = 2000, poisson_ratio = 0.3, yield_stress = 10, hardening_modulus = 50 } }\n\
         element = \"f_bar\"\n#",
        "j2_table = { youngs_modulus = 2000, poisson_ratio = 0.3, yield_stress = [10, 14, 15], plastic_strain = [0, 0.05, 0.2] } }\n\
         element = \"f_bar\"\n#",
    ] {
        read_again(&block.replace("LAW", law));
    }
}

/// Whether CalculiX is installed.
fn has_ccx() -> bool {
    let found = Command::new("ccx").arg("-v").output().is_ok();
    if !found {
        println!("skipped: CalculiX (ccx) is not installed");
    }
    found
}

/// The numbers of a deck in both programs.
fn verified(place: &Place, folder: &str, tolerance: &str) -> Value {
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
    place.write("case.toml", BOLT);
    place.good("export case.toml --deck deck --force");
    let compared = verified(&place, "deck", "1e-3");
    assert!(compared["displacements"].as_f64().expect("a number") < 1e-4, "{compared}");
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

/// Load cases have a deck each; what a deck cannot hold is refused with the key.
#[test]
fn what_a_deck_cannot_hold() {
    let cases =
        "[[load_case]]\nname = \"a\"\nfriction = 0.1\n[[load_case]]\nname = \"b\"\nmotion_factor = 0.5\n[design]";
    let place = Place::with("[design]", cases);
    place.good("export case.toml --deck deck");
    assert!(place.read("deck/model_a.inp").contains("*FRICTION\n0.1, "));
    assert!(place.read("deck/model_b.inp").contains("block_ymax_nodes, 2, 2, -0.05"));
    let place = Place::with("friction = 0.3", "friction = 0.3\noffset = 0.01");
    place.bad("export case.toml --deck deck", 2, &["`contact[0].offset`", "--ignore contact.offset"]);
    place.good("export case.toml --deck deck --ignore contact.offset");
    place.bad("export case.toml", 2, &["is a file", "--deck DIR"]);
    place.bad("verify deck nowhere", 2, &["deck.json", "export RUN --deck DIR"]);
    place.bad("verify deck deck --ccx ./no_such_program", 2, &["cannot run", "install CalculiX"]);
}
