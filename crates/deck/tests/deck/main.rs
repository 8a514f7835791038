//! Decks and the tables that they become: one rung after the other. Expected tables follow from the
//! keywords reference of CalculiX.

mod cae;
mod joints;
mod laws;
mod materials;
mod phases;
mod second_order;

use slipstick_deck::{Translation, mesh, translate};

/// Two unit cubes, one on the other, 0.01 apart; a reference node.
const CUBES: &str = "*HEADING\nTwo cubes\n*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
    11,0,0,1.01\n12,1,0,1.01\n13,1,1,1.01\n14,0,1,1.01\n15,0,0,2.01\n16,1,0,2.01\n17,1,1,2.01\n18,0,1,2.01\n\
    *NODE, NSET=REF\n99, 0.5, 0.5, 2.01\n*NODE, NSET=ROT\n100, 0.5, 0.5, 2.01\n\
    *ELEMENT, TYPE=C3D8, ELSET=LOW\n1, 1,2,3,4,5,6,7,8\n*ELEMENT, TYPE=C3D8, ELSET=HIGH\n2, 11,12,13,14,15,16,17,18\n\
    *NSET, NSET=BASE\n1,2,3,4\n*NSET, NSET=TOP\n15,16,17,18\n*NSET, NSET=ALL_HIGH, GENERATE\n11,18\n\
    *SURFACE, NAME=UP\nLOW, S2\n*SURFACE, NAME=DOWN\nHIGH, S1\n*SURFACE, NAME=LID\nHIGH, S2\n\
    *MATERIAL, NAME=STEEL\n*ELASTIC\n1000, 0.3\n*SOLID SECTION, ELSET=LOW, MATERIAL=steel\n*SOLID SECTION, ELSET=HIGH, MATERIAL=STEEL\n\
    *SURFACE INTERACTION, NAME=DRY\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD\n*FRICTION\n0.3\n\
    *CONTACT PAIR, INTERACTION=dry, ADJUST=0.02\nDOWN, UP\n\
    *STEP\n*STATIC\n0.5, 1\n*BOUNDARY\nBASE, 1, 3\nTOP, 1, 2\nTOP, 3, 3, -0.1\n*END STEP\n";

fn translated(deck: &str) -> Translation {
    translate(deck.as_bytes(), "cubes.inp", &[]).unwrap_or_else(|error| panic!("{error}\n{deck}"))
}

/// The tables without comments, one line each.
fn tables(deck: &str) -> Vec<String> {
    let translation = translated(deck);
    assert_eq!(translation.errors(), [], "{deck}");
    let tables = translation.text.split("\n\n").map(|table| {
        let lines = table.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
        lines.collect::<Vec<_>>().join("; ")
    });
    tables.filter(|table| !table.is_empty()).collect()
}

/// The tables that are not those of [`CUBES`].
fn new_tables(deck: &str) -> Vec<String> {
    let known = tables(CUBES);
    tables(deck).into_iter().filter(|table| !known.contains(table)).collect()
}

/// Messages with their lines.
fn refused(deck: &str) -> Vec<String> {
    let line = |error: &slipstick_deck::Refusal| format!("{}: {}; {}", error.line, error.message, error.cure);
    translated(deck).errors().iter().map(line).collect()
}

/// The line of the deck on which `text` begins.
fn line_of(deck: &str, text: &str) -> usize {
    deck[..deck.find(text).expect(text)].lines().count().max(1)
        + usize::from(deck[..deck.find(text).expect(text)].ends_with('\n'))
}

#[test]
fn bodies_contact_and_motions() {
    let expected = [
        "[[body]]; name = \"LOW\"; mesh = { file = \"cubes.inp\", part = \"LOW\" }; \
         material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }",
        "[[body]]; name = \"HIGH\"; mesh = { file = \"cubes.inp\", part = \"HIGH\" }; \
         material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }",
        "[[contact]]; slave = \"HIGH_DOWN\"; master = \"LOW_UP\"; surfaces = \"faceted\"; friction = 0.3; adjust = 0.02",
        "[[dirichlet]]; set = \"LOW_BASE\"",
        "[[dirichlet]]; set = \"HIGH_TOP\"; motion = [{ t = 1.0, u = [0.0, 0.0, -0.1] }]",
    ];
    assert_eq!(tables(CUBES), expected);
    let translation = translated(CUBES);
    assert_eq!((translation.title.as_str(), translation.steps), ("Two cubes", 2));
    let place = format!("# cubes.inp:{} *CONTACT PAIR\n[[contact]]", line_of(CUBES, "*CONTACT PAIR"));
    assert!(translation.text.contains(&place), "{}", translation.text);
}

#[test]
fn bodies_are_connected_components() {
    // one section for both, none of the sets is a body
    let one = CUBES
        .replace("*SOLID SECTION, ELSET=HIGH, MATERIAL=STEEL\n", "")
        .replace("ELSET=LOW, MATERIAL", "ELSET=BOTH, MATERIAL");
    let one = one.replace("ELSET=LOW\n1,", "ELSET=BOTH\n1,").replace("ELSET=HIGH\n2,", "ELSET=BOTH\n2,");
    let one = one.replace("\nLOW, S2", "\n1, S2").replace("\nHIGH, ", "\n2, ");
    let tables = tables(&one);
    assert!(
        tables[0].contains("name = \"BOTH_1\"; mesh = { file = \"cubes.inp\", part = \"BOTH_1_solids\" }"),
        "{tables:?}"
    );
    assert!(tables[2].contains("slave = \"BOTH_2_DOWN\"; master = \"BOTH_1_UP\""), "{tables:?}");
    assert_eq!(mesh(one.as_bytes()).expect("a mesh").cell_sets["BOTH_2_solids"], [1]);
    // connected: one body of two sections
    let joined = CUBES
        .replace("2, 11,12,13,14,", "2, 5,6,7,8,")
        .replace("*CONTACT PAIR, INTERACTION=dry, ADJUST=0.02\nDOWN, UP\n", "");
    let joined = joined.replace(
        "*SURFACE INTER",
        "*MATERIAL, NAME=RUBBER\n*HYPERELASTIC, MOONEY-RIVLIN\n0.4, 0.1, 0.05\n*SURFACE INTER",
    );
    let joined = joined.replace("ELSET=HIGH, MATERIAL=STEEL", "ELSET=HIGH, MATERIAL=Rubber");
    let found = new_tables(&joined);
    assert!(
        found[0].starts_with("[[body]]; name = \"LOW_\"") || found[0].contains("mesh = { file = \"cubes.inp\" }"),
        "{found:?}"
    );
    assert!(
        found[1].ends_with("_HIGH\" }; material = { mooney_rivlin = { c10 = 0.4, c01 = 0.1, bulk_modulus = 40.0 } }"),
        "{found:?}"
    );
}

#[test]
fn laws_of_surfaces() {
    let pair = |law: &str| {
        let deck = CUBES.replace("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD\n*FRICTION\n0.3\n", law);
        tables(&deck).into_iter().find(|table| table.starts_with("[[contact]]")).expect("a pair")
    };
    let linear = pair("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n5e4\n*FRICTION, TAUMAX=7\n0.2, 1e4\n");
    let law = "friction = 0.2; shear_limit = 7.0; adjust = 0.02; enforcement = { penalty = { stiffness = { \
               normal = 50000.0, tangential = 10000.0 }, pressure_at = \"points\" } }";
    assert!(linear.ends_with(law), "{linear}");
    assert!(pair("").ends_with("friction = 0.0; adjust = 0.02"));
    let gap = |deck: &str| {
        let table = tables(deck).into_iter().find(|table| table.starts_with("[[contact]]")).expect("a pair");
        table.split("friction = 0.3; ").nth(1).expect("what follows").to_owned()
    };
    let clearance = CUBES.replace("*STEP", "*CLEARANCE, MASTER=up, SLAVE=DOWN, VALUE=-0.03\n*STEP");
    assert_eq!(gap(&clearance), "adjust = { gap = -0.03 }");
    assert_eq!(gap(&CUBES.replace("ADJUST=0.02", "ADJUST=all_high")), "adjust = { nodes = \"HIGH_ALL_HIGH\" }");
    assert!(refused(&CUBES.replace("ADJUST=0.02", "ADJUST=NOWHERE"))[0].contains("neither a distance nor a node set"));
    assert!(refused(&clearance.replace("SLAVE=DOWN", "SLAVE=LID"))[0].contains("no *CONTACT PAIR of `LID` and `up`"));
    let tied = clearance.replace("PRESSURE-OVERCLOSURE=HARD\n", "PRESSURE-OVERCLOSURE=TIED\n1e5\n");
    assert!(refused(&tied)[0].contains("surfaces that are tied"), "{:?}", refused(&tied));
    assert!(refused(&clearance.replace(", VALUE=-0.03", ""))[0].contains("needs a VALUE"));
    assert!(pair("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TIED\n1e5\n").ends_with("tied = true"));
    let tie = new_tables(&CUBES.replace("*STEP", "*TIE, NAME=glue, POSITION TOLERANCE=0.1\nDOWN, UP\n*STEP"));
    assert_eq!(tie[0], "[[surface]]; name = \"HIGH_DOWN_2\"; of = [\"HIGH_DOWN\"]", "the slave of two pairs");
    assert_eq!(tie[1], "[[contact]]; slave = \"HIGH_DOWN_2\"; master = \"LOW_UP\"; tied = true");
    let nodes = CUBES.replace("*SURFACE, NAME=DOWN\nHIGH, S1", "*SURFACE, NAME=DOWN, TYPE=NODE\n11\n12\n13\n14");
    assert_eq!(tables(&nodes), tables(CUBES), "the faces between the nodes");
    assert_eq!(mesh(nodes.as_bytes()).expect("a mesh").face_sets["DOWN"].len(), 1);
}

#[test]
fn nodes_are_grouped_by_their_motion() {
    let deck = CUBES.replace("BASE, 1, 3\n", "1, 1, 3\n2, 1, 3\n3, 3\n4, 3, 3, 0.0\nTOP, 1\n");
    let found = new_tables(&deck);
    assert_eq!(
        found,
        ["[[dirichlet]]; set = \"LOW_held_1\"", "[[dirichlet]]; set = \"LOW_held_2\"; components = [\"z\"]"]
    );
    let mesh = mesh(deck.as_bytes()).expect("a mesh");
    assert_eq!((&mesh.node_sets["held_1"], &mesh.node_sets["held_2"]), (&vec![0, 1], &vec![2, 3]));
    let named = CUBES.replace("BASE, 1, 3\n", "BASE, ENCASTRE\nALL_HIGH, XSYMM\n");
    assert!(
        new_tables(&named).iter().any(|table| table == "[[dirichlet]]; set = \"HIGH_ALL_HIGH\"; components = [\"x\"]")
    );
}

/// Two steps: 2 + 4 load steps. The motion of the first stays; forces end with `OP=NEW`.
#[test]
fn steps_are_one_path() {
    let second = "*END STEP\n*STEP\n*STATIC\n0.25, 1.\n*BOUNDARY\nTOP, 1, 1, 0.03\n*DLOAD, OP=NEW\n*DSLOAD, OP=NEW\nLID, P, -2\n*END STEP\n";
    let deck = CUBES.replace("*END STEP\n", second).replacen("*BOUNDARY", "*DLOAD\nLOW, P2, 3.\n*BOUNDARY", 1);
    assert_eq!(
        new_tables(&deck),
        [
            "[[dirichlet]]; set = \"HIGH_TOP\"; motion = [{ t = 0.3333333333333333, u = [0.0, 0.0, -0.1] }, { t = 1.0, u = [0.03, 0.0, -0.1] }]",
            "[[load]]; surface = \"LOW_pressed_1\"; pressure = 3.0; amplitude = [{ t = 0.3333333333333333, factor = 1.0 }, { t = 1.0, factor = 0.0 }]",
            "[[load]]; surface = \"HIGH_LID\"; pressure = -2.0; amplitude = [{ t = 0.3333333333333333, factor = -0.0 }, { t = 1.0, factor = 1.0 }]",
        ]
        .map(|table| table.replace("-0.0 }", "0.0 }"))
    );
    assert_eq!(translated(&deck).steps, 6);
    // with one keyword only, CalculiX 2.20 ends the loads of both, and Abaqus those of this one
    let half = deck.replace("*DLOAD, OP=NEW\n", "");
    let start = format!("{}: *DSLOAD: OP=NEW ends the *DLOAD of line", line_of(&half, "*DSLOAD, OP=NEW"));
    assert!(refused(&half)[0].starts_with(&start), "{:?}", refused(&half));
}

/// `OP=NEW` ends what it does not name; what a later step names first begins there, also at 0. A condition that comes
/// back, and one of a rigid body, are refused.
#[test]
fn supports_begin_and_end_with_steps() {
    let step = |cards: &str| format!("*END STEP\n*STEP\n*STATIC\n0.25, 1.\n{cards}*END STEP\n");
    let deck = CUBES.replace("*END STEP\n", &step("*BOUNDARY, OP=NEW\nBASE, 1, 3\nTOP, 1, 1\n5, 1, 1\n"));
    let t = 1.0 / 3.0;
    assert_eq!(
        new_tables(&deck),
        [
            "[[dirichlet]]; set = \"HIGH_TOP\"; components = [\"x\"]".to_owned(),
            format!(
                "[[dirichlet]]; set = \"HIGH_TOP\"; components = [\"y\", \"z\"]; until = {t:?}; \
                 motion = [{{ t = {t:?}, u = [0.0, 0.0, -0.1] }}]"
            ),
            format!(
                "[[dirichlet]]; set = \"LOW_held_1\"; components = [\"x\"]; from = {t:?}; \
                 motion = [{{ t = 1.0, u = [0.0, 0.0, 0.0] }}]"
            ),
        ]
    );
    let back = step("*BOUNDARY, OP=NEW\nBASE, 1, 3\n*END STEP\n*STEP\n*STATIC\n*BOUNDARY\nTOP, 3, 3, -0.1\n");
    let errors = refused(&CUBES.replace("*END STEP\n", &back));
    assert!(errors[0].contains("a later one prescribes again"), "{errors:?}");
}

/// Load steps are on the points of a table, or of the polynomial 10 x³ − 15 x⁴ + 6 x⁵ of Abaqus' SMOOTH STEP.
#[test]
fn amplitudes_are_waypoints() {
    let smooth = CUBES.replace("*STEP\n", "*AMPLITUDE, NAME=A, DEFINITION=SMOOTH STEP\n0, 0, 0.5, 1.0\n*STEP\n");
    let found = new_tables(&smooth.replace("TOP, 3, 3, -0.1\n", "*CLOAD, AMPLITUDE=A\n15, 1, 1.\n"));
    // x = 0.2 … 1, from the values by hand
    let factors = [0.05792, 0.31744, 0.68256, 0.94208, 1.0];
    let amplitude = found[1].split("factor = ").skip(1).map(|rest| rest.split(' ').next()?.parse().ok());
    let amplitude: Vec<f64> = amplitude.map(|factor: Option<f64>| factor.expect("a number")).collect();
    assert_eq!(amplitude.len(), factors.len(), "{found:?}");
    assert!(amplitude.iter().zip(factors).all(|(found, factor)| (found - factor).abs() < 1e-12), "{found:?}");
    let deck = CUBES.replace("*STEP\n", "*AMPLITUDE, NAME=SAW\n0, 0, 0.5, 1.0,\n1.0, 0.5\n*STEP\n");
    let deck = deck.replace("TOP, 3, 3, -0.1\n", "*BOUNDARY, AMPLITUDE=Saw\nTOP, 3, 3, -0.1\n");
    assert_eq!(
        new_tables(&deck),
        [
            "[[dirichlet]]; set = \"HIGH_TOP\"; motion = [{ t = 0.5, u = [0.0, 0.0, -0.1] }, { t = 1.0, u = [0.0, 0.0, -0.05] }]"
        ]
    );
}

#[test]
fn forces_on_nodes() {
    let deck = CUBES.replace("TOP, 3, 3, -0.1\n", "*CLOAD\nTOP, 3, -2.\nTOP, 1, 1.\n15, 1, 0.5\n");
    let found = new_tables(&deck);
    let loads: Vec<&String> = found.iter().filter(|table| table.starts_with("[[load]]")).collect();
    assert_eq!(loads.len(), 3, "{found:?}");
    assert!(
        loads.iter().any(|load| load.contains("surface = \"HIGH_TOP\"; nodal_force = [0.0, 0.0, -2.0]")),
        "{loads:?}"
    );
    assert!(loads.iter().any(|load| load.ends_with("nodal_force = [1.5, 0.0, 0.0]")), "node 15 has both: {loads:?}");
}

/// What changes the physics is refused with its line and a remedy, all at once, unless it is ignored.
#[test]
fn what_is_not_supported_is_refused() {
    for (from, to, what, cure) in [
        ("*STEP", "*MPC\nDIST,1,2\n*STEP", "*MPC: DIST is not supported", "*CONTACT PAIR"),
        ("*STEP", "*MPC\nBEAM,1,2\n*STEP", "*MPC: a beam needs", "--ignore \"MPC\""),
        ("*STATIC\n0.5, 1", "*DYNAMIC\n0.5, 1", "*DYNAMIC", "use *STATIC"),
        ("*BOUNDARY", "*DLOAD\nLOW, BX, 9.81\n*BOUNDARY", "*DLOAD: the load `BX`", "pressure"),
        ("*ELASTIC\n", "*ELASTIC, TYPE=ANISO\n", "*ELASTIC: TYPE=ANISO", "isotropic"),
        ("*STEP", "*ORIENTATION, NAME=R, SYSTEM=SPHERICAL\n0,0,0, 0,0,1\n*STEP", "*ORIENTATION: SYSTEM=SPH", "RECT"),
        ("=HARD", "=SCALE FACTOR\n2", "PRESSURE-OVERCLOSURE=SCALE FACTOR", "LINEAR"),
        (
            "*STATIC\n0.5, 1",
            "*STATIC\n0.5, 1\n*CONTACT INTERFERENCE, SHRINK\nDOWN, UP",
            "*CONTACT INTERFERENCE: SHRINK",
            "deepest",
        ),
        ("*BOUNDARY", "*BOUNDARY, FIXED", "*BOUNDARY: FIXED keeps what the step before has reached", "prescribe zero"),
        ("*STEP", "*INITIAL CONDITIONS, TYPE=STRESS\n1, 5.\n*STEP", "*INITIAL CONDITIONS", "unstressed"),
        ("*FRICTION\n0.3\n", "*FRICTION, ROUGH\n", "*FRICTION: rough", "*TIE"),
    ] {
        let deck = CUBES.replacen(from, to, 1);
        let found = refused(&deck);
        assert!(found.len() == 1 && found[0].contains(what) && found[0].contains(cure), "{to}: {found:?}");
        let keyword = what.trim_start_matches('*').split(':').next().expect("a keyword");
        let keyword = if what.starts_with('*') { keyword } else { "SURFACE BEHAVIOR" };
        let ignored = translate(deck.as_bytes(), "cubes.inp", &[keyword.to_lowercase()]).expect("a mesh");
        assert!(ignored.errors().is_empty() || keyword == "ELASTIC", "{keyword}: {:?}", ignored.errors());
        assert!(ignored.ledger.uses.iter().any(|entry| entry.keyword == keyword && entry.how.word() == "ignored"));
    }
}

#[test]
fn mistakes_are_told_at_their_lines() {
    for (from, to, what) in [
        ("BASE, 1, 3", "BASES, 1, 3", "there is no set of nodes `BASES`"),
        ("BASE, 1, 3", "77, 1, 3", "there is no node 77"),
        ("BASE, 1, 3", "BASE, one", "first and last component"),
        ("TOP, 3, 3, -0.1", "TOP, 3, 3, -0.1x", "`-0.1x` is not a number"),
        ("DOWN, UP", "DOWN, OVER", "there is no surface `OVER`"),
        ("DOWN, UP", "DOWN", "a slave and a master"),
        ("INTERACTION=dry", "INTERACTION=wet", "there is no surface interaction `WET`"),
        ("MATERIAL=steel", "MATERIAL=iron", "there is no material `IRON`"),
        ("ELSET=LOW, MATERIAL", "ELSET=LOWER, MATERIAL", "there is no set of elements `LOWER`"),
        ("1000, 0.3", "", "it has no constants"),
        ("*SOLID SECTION, ELSET=HIGH, MATERIAL=STEEL\n", "", "1 solid elements have no *SOLID SECTION"),
    ] {
        let deck = CUBES.replacen(from, to, 1);
        let found = refused(&deck);
        assert!(found.iter().any(|error| error.contains(what)), "{to}: {found:?}");
    }
    let both = refused(&CUBES.replace("BASE, 1, 3", "BASES, 1, 3").replace("DOWN, UP", "DOWN, OVER"));
    assert_eq!(both.len(), 2, "{both:?}");
    let line = line_of(CUBES, "BASE, 1, 3");
    assert!(both.iter().any(|error| error.starts_with(&format!("{line}: *BOUNDARY"))), "{both:?}");
    let end = CUBES.find("*STEP").expect("a step");
    assert!(refused(&CUBES[..end])[0].contains("the deck has no step"));
}

/// Lines end and keywords are written as on other systems; tables are the same.
#[test]
fn other_ways_to_write() {
    assert_eq!(tables(&CUBES.replace('\n', "\r\n")), tables(CUBES));
    let lower: String = CUBES
        .lines()
        .map(|line| if line.starts_with('*') { line.to_lowercase() } else { line.to_owned() } + "\n")
        .collect();
    let lower =
        lower.replace("elset=low", "elset=LOW").replace("elset=high", "elset=HIGH").replace("nset=base", "nset=BASE");
    let lower = lower.replace("name=up", "name=UP").replace("name=down", "name=DOWN").replace("nset=top", "nset=TOP");
    assert_eq!(tables(&lower), tables(CUBES));
    let continued =
        CUBES.replace("*CONTACT PAIR, INTERACTION=dry, ADJUST=0.02", "*CONTACT PAIR, INTERACTION=dry,\n ADJUST=0.02");
    assert_eq!(tables(&continued), tables(CUBES));
}

/// Decks with pieces missing, doubled or replaced: each is read or refused, with place and remedy.
#[test]
fn damaged_decks_are_read_or_refused() {
    let more = "*AMPLITUDE, NAME=A\n0, 0, 1, 2\n*TIE\nDOWN, UP\n*RIGID BODY, NSET=ALL_HIGH, REF NODE=99, ROT NODE=100\n*STEP, NLGEOM";
    let deck = CUBES.replacen("*STEP", more, 1).replace(
        "*END STEP\n",
        "*CLOAD, AMPLITUDE=A\nTOP, 1, 2.\n99, 4, 1.\n*DLOAD\nLOW, P4, 2.\n*END STEP\n*STEP\n*STATIC\n0.1, 1\n\
         *BOUNDARY\nBASE, 1, 3\n*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE\nDOWN, UP\n*END STEP\n",
    );
    let pieces = [
        "",
        "0",
        "-1",
        "1e308",
        "nan",
        "99999999999999999999",
        ",",
        "\n",
        "*",
        "*STEP\n",
        "TOP",
        "C3D4",
        "=",
        "\u{b5}",
        "GENERATE",
    ];
    let mut seed = 20_260_u64;
    let mut below = |bound: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((seed >> 33) as usize) % bound.max(1)
    };
    assert_eq!(refused(&deck), [""; 0]);
    let (mut read, mut wrong) = (0, 0);
    for _ in 0..4000 {
        let mut words: Vec<String> = deck.split_inclusive([',', '\n', '=', ' ']).map(str::to_owned).collect();
        for _ in 0..=below(3) {
            let (at, other) = (below(words.len()), below(words.len()));
            match below(4) {
                0 => drop(words.remove(at)),
                1 => words.insert(at, words[other].clone()),
                2 => words.swap(at, other),
                _ => words[at] = pieces[below(pieces.len())].to_owned(),
            }
        }
        let text = words.concat();
        let meshed = mesh(text.as_bytes());
        match translate(text.as_bytes(), "cubes.inp", &[]) {
            Ok(translation) => {
                let errors = translation.errors();
                assert!(
                    errors.iter().all(|error| error.line > 0 && !error.message.is_empty() && !error.cure.is_empty())
                );
                if errors.is_empty() {
                    read += 1
                } else {
                    wrong += 1
                }
                assert!(meshed.is_ok(), "{text}");
            }
            Err(error) => {
                assert!(!error.place.is_empty() && !error.cure.is_empty() && meshed.is_err(), "{error}\n{text}");
                wrong += 1;
            }
        }
    }
    assert!(read > 100 && wrong > 1000, "{read} read, {wrong} refused");
}

#[test]
fn pressures_act_on_faces_that_exist() {
    let deck = |load: &str| CUBES.replacen("*BOUNDARY", &format!("*DLOAD\n{load}\n*BOUNDARY"), 1);
    assert!(refused(&deck("3, P1, 1.")).iter().any(|error| error.contains("no such element or set of elements")));
    let wedge = deck("3, P6, 1.")
        .replace("*NSET, NSET=BASE", "*ELEMENT, TYPE=C3D6, ELSET=LOW\n3, 1,2,3,5,6,7\n*NSET, NSET=BASE");
    assert!(refused(&wedge).iter().any(|error| error.contains("element 3 has no face 6")), "{:?}", refused(&wedge));
}

/// `GRAV`: acceleration and direction; `CENTRIF`: ω², a point on the axis, its direction.
#[test]
fn loads_on_mass() {
    let heavy = CUBES.replace("1000, 0.3\n", "1000, 0.3\n*DENSITY\n2.5\n");
    let heavy = heavy.replacen("*STEP", "*ELSET, ELSET=ALL\nLOW, HIGH\n*STEP", 1);
    let deck = |loads: &str| heavy.replacen("*BOUNDARY", &format!("*DLOAD\n{loads}\n*BOUNDARY"), 1);
    let found = new_tables(&deck("ALL, GRAV, 9.81, 0, 0, -2\nHIGH, CENTRIF, 16., 1, 2, 3, 0, 0, 5"));
    assert!(found[..2].iter().all(|table| table.ends_with("; mass_density = 2.5")), "{found:?}");
    assert_eq!(
        found[2..],
        [
            "[[load]]; gravity = [0.0, 0.0, -9.81]",
            "[[load]]; body = \"HIGH\"; centrifugal = { point = [1.0, 2.0, 3.0], direction = [0.0, 0.0, 5.0], angular_velocity = 4.0 }",
        ]
    );
    assert!(refused(&deck("2, GRAV, 9.81, 0, 0, 0")).iter().any(|error| error.contains("the direction is zero")));
    let light = deck("ALL, GRAV, 9.81, 0, 0, -1").replace("*DENSITY\n2.5\n", "");
    assert!(refused(&light)[0].contains("no material has a density"), "{:?}", refused(&light));
    let part = deck("1, GRAV, 9.81, 0, 0, -1").replace("2, 11,12,13,14,", "2, 5,6,7,8,").replace("DOWN, UP\n", "");
    assert!(
        refused(&part.replace("*CONTACT PAIR, INTERACTION=dry, ADJUST=0.02\n", ""))[0].contains("a part of a body")
    );
}

/// Changes from the initial temperature, of whole bodies and of sets of nodes, over two steps.
#[test]
fn temperatures() {
    let warm = CUBES.replace("1000, 0.3\n", "1000, 0.3\n*EXPANSION, ZERO=3.\n1.2e-5\n");
    let deck = |given: &str| {
        let warm = warm.replacen(
            "*STEP",
            "*NSET, NSET=LOW_NODES, GENERATE\n1, 8\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\nLOW_NODES, 20\n*STEP",
            1,
        );
        warm.replacen("*BOUNDARY", &format!("*TEMPERATURE\n{given}\n*BOUNDARY"), 1)
    };
    let found = new_tables(&deck("LOW_NODES, 120\nTOP, 40"));
    assert!(found[..2].iter().all(|table| table.ends_with("; thermal_expansion = 1.2e-5")), "{found:?}");
    assert_eq!(
        found[2..],
        ["[[temperature]]; body = \"LOW\"; change = 100.0", "[[temperature]]; set = \"HIGH_heated_1\"; change = 40.0",]
    );
    // the second step cools the nodes of one body again
    let later = deck("LOW_NODES, 120") + "*STEP\n*STATIC\n0.5, 1\n*TEMPERATURE\nLOW_NODES, 20\n*END STEP\n";
    let found = new_tables(&later);
    let cooled = "[[temperature]]; body = \"LOW\"; change = 100.0; \
                  amplitude = [{ t = 0.5, factor = 1.0 }, { t = 1.0, factor = 0.0 }]";
    assert!(found.iter().any(|table| table == cooled), "{found:?}");
    let swinging =
        deck("LOW_NODES, 120").replace("*TEMPERATURE\n", "*AMPLITUDE, NAME=A\n0,0,1,1\n*TEMPERATURE, AMPLITUDE=A\n");
    assert!(refused(&swinging)[0].contains("do not start from 0"), "{:?}", refused(&swinging));
    // without expansion, temperatures do not matter
    let rigid = deck("LOW_NODES, 120").replace("*EXPANSION, ZERO=3.\n1.2e-5\n", "");
    assert_eq!(tables(&rigid).iter().filter(|table| table.contains("temperature")).count(), 0);
}

/// Facets of linear elements are flat, those of second-order elements curved: a pair with one of the latter
/// keeps the default of case files.
#[test]
fn only_linear_elements_have_flat_facets() {
    let tetrahedron = CUBES
        .replace(
            "11,0,0,1.01\n12,1,0,1.01\n13,1,1,1.01\n14,0,1,1.01\n15,0,0,2.01\n16,1,0,2.01\n17,1,1,2.01\n18,0,1,2.01\n",
            "11,0,0,1.01\n12,1,0,1.01\n13,0,1,1.01\n14,0,0,2.01\n15,.5,0,1.01\n16,.5,.5,1.01\n17,0,.5,1.01\n\
             18,0,0,1.51\n19,.5,0,1.51\n20,0,.5,1.51\n",
        )
        .replace(
            "TYPE=C3D8, ELSET=HIGH\n2, 11,12,13,14,15,16,17,18",
            "TYPE=C3D10, ELSET=HIGH\n2, 11,12,13,14,15,16,17,18,19,20",
        );
    let found = tables(&tetrahedron);
    let pair = "[[contact]]; slave = \"HIGH_DOWN\"; master = \"LOW_UP\"; friction = 0.3; adjust = 0.02";
    assert!(found.iter().any(|table| table == pair), "{found:?}");
    assert!(tables(CUBES).iter().any(|table| table == &pair.replace("friction", "surfaces = \"faceted\"; friction")));
}
