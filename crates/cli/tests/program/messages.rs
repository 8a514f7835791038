//! The program's messages about wrong input, kept in `messages.txt` next to this file: the place,
//! the error, and the cure.
//!
//! After a change of messages,
//! `UPDATE_MESSAGES=1 cargo test -p slipstick-cli --test program messages` rewrites the file; read
//! it before you commit it.

use super::*;

/// A change of one line of the case: the mistake, the original text, and its replacement.
const CHANGES: &[(&str, &str, &str)] = &[
    ("a string without quotes", "title = \"Block on slab\"", "title = Block on slab"),
    ("a bracket is missing", "elements = [4, 2, 2] }", "elements = [4, 2, 2 }"),
    ("a key twice", "friction = 0.3", "friction = 0.3\nfriction = 0.2"),
    ("a misspelt key", "friction = 0.3", "fricton = 0.3"),
    ("a required key misspelt", "material = {", "materiel = {"),
    ("a required key with another name", "friction = 0.3", "mu = 0.3"),
    ("a required key with an extra word", "friction = 0.3", "friction_coefficient = 0.3"),
    ("a misspelt section", "[optimizer]", "[optimiser]"),
    ("a misspelt section that others need", "[[contact]]", "[[contat]]"),
    ("a key of another table", "steps = 4", "steps = 4\niterations = 4"),
    ("a key is missing", "friction = 0.3\n", ""),
    ("two shapes", "name = \"slab\"", "name = \"slab\"\nhalf_ball = { radius = 1.0, elements = [2, 1, 1] }"),
    ("an unknown material", "material = { neo_hooke", "material = { rubber"),
    ("a string instead of a number", "friction = 0.3", "friction = \"rough\""),
    ("a promise without values", "[objective]", "[[promise]]\nquantity = \"strain_energy\"\n[objective]"),
    (
        "promises for more load cases",
        "[objective]",
        "[[promise]]\nquantity = \"strain_energy\"\nvalues = [1.0, 2.0]\n[objective]",
    ),
    (
        "a promise twice",
        "[objective]",
        "[[promise]]\nquantity = \"a\"\nvalues = [1.0]\n[[promise]]\nquantity = \"a\"\nvalues = [1.0]\n[objective]",
    ),
    ("a fraction instead of a count", "steps = 4", "steps = 4.5"),
    ("too few components", "max = [4, 1, 2]", "max = [4, 1]"),
    ("not a number", "friction = 0.3", "friction = nan"),
    ("an infinite number", "youngs_modulus = 1000.0", "youngs_modulus = inf"),
    ("a negative modulus", "youngs_modulus = 1000.0", "youngs_modulus = -1000.0"),
    ("an incompressible material", "poisson_ratio = 0.3", "poisson_ratio = 0.5"),
    ("a box inside out", "max = [4, 1, 2]", "max = [4, -1, 2]"),
    ("no elements", "elements = [4, 2, 2]", "elements = [4, 0, 2]"),
    ("negative friction", "friction = 0.3", "friction = -0.1"),
    ("too few integration points", "name = \"slab\"", "name = \"slab\"\nelement = \"reduced\"\norder = 2"),
    ("no steps", "steps = 4", "steps = 0"),
    ("two bodies with the same name", "name = \"block\"", "name = \"slab\""),
    ("a name with a blank", "name = \"block\"", "name = \"the block\""),
    ("an unknown surface", "slave = \"block_ymin\"", "slave = \"block_bottom\""),
    ("a body instead of a surface", "slave = \"block_ymin\"", "slave = \"block\""),
    ("one surface twice", "slave = \"block_ymin\"", "slave = \"slab_ymax\""),
    ("surfaces of one body", "slave = \"block_ymin\"", "slave = \"slab_ymin\""),
    ("an unknown enforcement", "friction = 0.3", "friction = 0.3\nenforcement = { nitsche = {} }"),
    (
        "different settings of Uzawa's iteration",
        "friction = 0.3",
        "friction = 0.3\nenforcement = { augmented = { max_uzawa = 50 } }\n[[contact]]\nfriction = 0\nslave = \"slab_xmax\"\n\
         master = \"block_ymax\"\nenforcement = { augmented = {} }",
    ),
    ("a stiffness of zero", "friction = 0.3", "friction = 0.3\nenforcement = { penalty = { stiffness = 0 } }"),
    ("a rule that does not exist", "friction = 0.3", "friction = 0.3\ncell_rule = 5"),
    ("a search radius too small", "friction = 0.3", "friction = 0.3\nsearch_radius = 1e-4"),
    ("an unknown multiplier shape", "friction = 0.3", "friction = 0.3\nmultiplier_shape = \"quadratic\""),
    ("an unknown set", "set = \"slab_ymin\"", "set = \"slab_bottom\""),
    ("an unknown component", "set = \"slab_ymin\"", "set = \"slab_ymin\"\ncomponents = [\"u\"]"),
    ("waypoints out of order", "{ t = 1.0, u", "{ t = 0.4, u"),
    ("a waypoint after the end", "{ t = 1.0, u", "{ t = 2.0, u"),
    ("an angle without an axis", "u = [0.2, -0.1, 0.05] }", "u = [0.2, -0.1, 0.05], angle = 10 }"),
    (
        "a rotation by more than 90 degrees in a load step",
        "u = [0.2, -0.1, 0.05] }]",
        "angle = 300 }]\nrotation = { direction = [0, 1, 0], point = [1, 1, 1] }",
    ),
    ("one node moved twice", "set = \"slab_ymin\"", "set = \"block_ymax\""),
    ("a tolerance of one", "relative = 1e-11", "relative = 1.0"),
    ("an unknown design body", "bodies = [\"slab\"]", "bodies = [\"plate\"]"),
    ("no design body", "bodies = [\"slab\"]", "bodies = []"),
    ("an initial design without material", "initial = 0.5", "initial = 0.0"),
    ("a volume above one", "volume_fraction = 0.5", "volume_fraction = 1.5"),
    ("a penalization below one", "p = 3.0", "p = 0.5"),
    ("a filter without size", "radius = 1.2", "radius = 0"),
    (
        "all of the design is passive",
        "initial = 0.5",
        "initial = 0.5\npassive_solid = [{ min = [-1, -1, -1], max = [9, 9, 9] }]",
    ),
    ("a symmetry that the mesh lacks", "initial = 0.5", "initial = 0.5\nsymmetry = [{ normal = \"x\", at = 1.9 }]"),
    (
        "a rotation that the mesh lacks",
        "initial = 0.5",
        "initial = 0.5\nsymmetry = [{ axis = \"y\", through = [2, 0, 1], folds = 3 }]",
    ),
    (
        "a symmetry of a body that is not designed",
        "initial = 0.5",
        "initial = 0.5\nsymmetry = [{ normal = \"x\", at = 2, body = \"block\" }]",
    ),
    ("a symmetry about nothing", "initial = 0.5", "initial = 0.5\nsymmetry = [{ at = 2 }]"),
    ("a rotation without sectors", "initial = 0.5", "initial = 0.5\nsymmetry = [{ axis = \"y\", folds = 1 }]"),
    ("too few cells", "initial = 0.5", "initial = 0.5\npattern = [{ step = [1, 0, 0], count = 3 }]"),
    ("too many cells", "initial = 0.5", "initial = 0.5\npattern = [{ step = [2, 0, 0], count = 3 }]"),
    ("a pattern that stands still", "initial = 0.5", "initial = 0.5\npattern = [{ step = [0, 0, 0], count = 3 }]"),
    ("an extrusion across the mesh", "initial = 0.5", "initial = 0.5\nextrude = [1, 0.2, 0]"),
    ("an extrusion along no axis", "initial = 0.5", "initial = 0.5\nextrude = \"w\""),
    ("an overhang filter without direction", "initial = 0.5", "initial = 0.5\noverhang = {}"),
    ("an overhang filter with filtered gradients", "initial = 0.5", "initial = 0.5\noverhang = { direction = \"y\" }"),
    (
        "an overhang filter of a ball",
        "bodies = [\"slab\"]\ninitial = 0.5\nvolume_fraction = 0.5\nsimp = { p = 3.0, min = 1e-3 }\n\
         sensitivity_filter = { radius = 1.2 }",
        "bodies = [\"slab\", \"ball\"]\nvolume_fraction = 0.5\noverhang = { direction = \"y\" }\n\
         [[body]]\nname = \"ball\"\nhalf_ball = { radius = 1, elements = [2, 1, 1] }\nplace = { translate = [9, 9, 9] }\n\
         material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n[[dirichlet]]\nset = \"ball_flat\"",
    ),
    ("a region of no kind", "initial = 0.5", "initial = 0.5\npassive_void = [{ radius = 1 }]"),
    (
        "a region of two kinds",
        "initial = 0.5",
        "initial = 0.5\npassive_void = [{ centre = [0, 0, 0], body = \"slab\", radius = 1 }]",
    ),
    (
        "a region at an unknown surface",
        "initial = 0.5",
        "initial = 0.5\npassive_solid = [{ surface = \"slab_ymaxx\", within = 0.1 }]",
    ),
    ("a region of an unknown part", "initial = 0.5", "initial = 0.5\npassive_solid = [{ part = \"slab_core\" }]"),
    ("a region of an unknown body", "initial = 0.5", "initial = 0.5\npassive_solid = [{ body = \"slap\" }]"),
    (
        "a schedule that runs backwards",
        "iterations = 4",
        "iterations = 4\nschedule = { volume_fraction = [[2, 0.6], [1, 0.5]] }",
    ),
    (
        "a schedule before the first iteration",
        "iterations = 4",
        "iterations = 4\nschedule = { volume_fraction = [[-1, 0.6], [1, 0.5]] }",
    ),
    (
        "a schedule of a radius without a filter",
        "iterations = 4",
        "iterations = 4\nschedule = { filter_radius = [[0, 1.5], [2, 1.2]] }",
    ),
    (
        "a scheduled volume below that of passive elements",
        "sensitivity_filter = { radius = 1.2 }\n[objective]\ncontact_force = { steps = \"last\" }\n[optimizer]\n\
         iterations = 4",
        "passive_solid = [{ surface = \"slab_xmin\", within = 1 }]\n[objective]\ncontact_force = {}\n[optimizer]\n\
         iterations = 4\nschedule = { volume_fraction = [[0, 0.5], [2, 0.2]] }",
    ),
    ("a load step that does not exist", "steps = \"last\"", "steps = [2, 5]"),
    ("a contact force of only prescribed nodes", "set = \"block_ymax\"", "set = \"block_ymin\""),
    ("an unknown objective", "contact_force = {", "stiffness = {"),
    ("no iterations", "iterations = 4", "iterations = 0"),
    ("an asymptote factor above one", "iterations = 4", "iterations = 4\nmma = { asydecr = 1.5 }"),
    ("an unknown solver", "every = 2", "every = 2\n[solver]\nlinear = \"pardiso\""),
    ("a solver that is not built in", "every = 2", "every = 2\n[solver]\nlinear = \"cudss\""),
    ("a string instead of true", "every = 2", "every = 2\npieces = \"yes\""),
    ("memory without a unit", "every = 2", "every = 2\n[adjoint]\nmemory = \"8\""),
    (
        "a mesh file that does not exist",
        "box = { min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }",
        "mesh = { file = \"slab.msh\" }",
    ),
    (
        "a mesh file of unknown format",
        "box = { min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }",
        "mesh = { file = \"notes.txt\" }",
    ),
    ("results in a folder with a control character", "every = 2", "every = 2\ndirectory = \"a\\nb\""),
    (
        "a set without nodes",
        "[[contact]]",
        "[[set]]\nname = \"far\"\nboxes = [{ min = [9, 9, 9], max = [10, 10, 10] }]\n[[contact]]",
    ),
    ("a load on an unknown surface", "[load_path]", "[[load]]\nsurface = \"slab_top\"\npressure = 1.0\n[load_path]"),
    (
        "a load with two values",
        "[load_path]",
        "[[load]]\nsurface = \"slab_ymax\"\npressure = 1.0\nforce = [0, -1, 0]\n[load_path]",
    ),
    ("a load without a value", "[load_path]", "[[load]]\nsurface = \"slab_ymax\"\n[load_path]"),
    ("a symmetry plane normal to no axis", "[[contact]]", "[[symmetry]]\nnormal = \"w\"\n[[contact]]"),
    ("a load case that does not exist", "set = \"slab_ymin\"", "set = \"slab_ymin\"\nload_case = \"second\""),
    ("a load case without weight", "[load_path]", "[[load_case]]\nname = \"first\"\nweight = 0.0\n[load_path]"),
    (
        "friction of a pair that does not exist",
        "[load_path]",
        "[[load_case]]\nname = \"dry\"\npairs = [{ slave = \"block_ymax\", friction = 0.1 }]\n[load_path]",
    ),
    (
        "friction of a pair whose slave is misspelt",
        "[[contact]]\nslave = \"block_ymin\"",
        "[[load_case]]\nname = \"dry\"\npairs = [{ slave = \"block_ymin\", friction = 0.1 }]\n\
         [[contact]]\nslave = \"block_ymim\"",
    ),
    (
        "a load case in which a body does not differ",
        "[load_path]",
        "[[load_case]]\nname = \"dry\"\nbodies = [{ body = \"block\" }]\n[load_path]",
    ),
    (
        "a factor on a support",
        "[load_path]",
        "[[load_case]]\nname = \"far\"\nmotions = [{ set = \"slab_ymin\", factor = 2 }]\n[load_path]",
    ),
    (
        "a factor on no load",
        "[load_path]",
        "[[load_case]]\nname = \"heavy\"\nloads = [{ surface = \"slab_xmax\", factor = 2 }]\n[load_path]",
    ),
    ("load cases without deviations", "[objective]", "[objective]\nload_cases = { mean_plus_deviations = 0 }"),
    ("load cases combined otherwise", "[objective]", "[objective]\nload_cases = \"best\""),
    ("a minimum thickness and a sensitivity filter", "initial = 0.5", "initial = 0.5\nminimum_thickness = 0.5"),
    (
        "a minimum thickness and another radius",
        "sensitivity_filter = { radius = 1.2 }",
        "minimum_thickness = 0.5\ndensity_filter = { radius = 1 }",
    ),
    (
        "a minimum thickness and another threshold",
        "sensitivity_filter = { radius = 1.2 }",
        "minimum_thickness = 0.5\nprojection = { threshold = 0.4 }",
    ),
    ("a set without conditions", "[[contact]]", "[[set]]\nname = \"far\"\n[[contact]]"),
    (
        "a body that nothing holds",
        "[[contact]]",
        "[[body]]\nname = \"stray\"\nbox = { min = [8, 0, 0], max = [9, 1, 1], elements = [1, 1, 1] }\n\
         material = { neo_hooke = { youngs_modulus = 1.0, poisson_ratio = 0.3 } }\n[[contact]]",
    ),
];

/// Wrong commands on the valid case.
const COMMANDS: &[&str] = &[
    "optimise case.toml",
    "check nothing.toml",
    "check case.toml --set friction",
    "check case.toml --set contact[3].friction=0.1",
    "check case.toml --threads 0",
    "solve case.toml --out no/such/place",
    "solve case.toml --design notes.txt",
    "evaluate case.toml --design nothing",
    "verify gradient case.toml --elements 0 --directions 0",
    "resume nothing",
    "render nothing",
    "export nothing",
    "export nothing --case part --size 0",
    "study nothing.toml",
    "new billiards",
    "explain slipstick::case::nothing",
];

/// Descriptions of wrong input, and the messages.
fn said() -> Vec<(String, String)> {
    let mut said = Vec::new();
    for &(what, from, to) in CHANGES {
        let place = Place::with(from, to);
        place.write("case.toml", &CASE.replacen(from, to, 1));
        place.write("notes.txt", "This is no mesh.\n");
        let err = place.bad("check case.toml", 2, &[]).err;
        said.push((what.to_owned(), err));
    }
    for &line in COMMANDS {
        let place = Place::new();
        place.write("notes.txt", "These are no densities.\n");
        said.push((format!("slipstick {line}"), place.bad(line, 2, &[]).err));
    }
    said
}

#[test]
fn messages_name_the_place_the_problem_and_the_cure() {
    let said = said();
    assert!(said.len() >= 70, "{}", said.len());
    for (what, message) in &said {
        let place = message.lines().any(|line| line.starts_with("case.toml:") || line.starts_with("error: "));
        assert!(place, "{what}: no place\n{message}");
        let cure = ["help: ", "tip: ", "For more information", " must "].iter().any(|word| message.contains(word));
        assert!(cure, "{what}: no cure\n{message}");
        assert!(!message.contains("panicked"), "{what}\n{message}");
    }
    let text: String = said.iter().map(|(what, message)| format!("== {what}\n{}\n", message.trim_end())).collect();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/messages.txt");
    if std::env::var_os("UPDATE_MESSAGES").is_some() {
        std::fs::write(&file, &text).expect("written");
    }
    let kept = std::fs::read_to_string(&file).expect("messages.txt");
    for (kept, now) in kept.split("== ").zip(text.split("== ")) {
        assert_eq!(now, kept, "another message: if it is better, UPDATE_MESSAGES=1 keeps it");
    }
    assert_eq!(kept.len(), text.len());
}

const LIFTED: &str = "[[load_case]]\nname = 'down'\n[[load_case]]\nname = 'up'\n\
                      bodies = [{ body = 'block', offset = [0, 0.3, 0] }]\nmotion_factor = 0.5\n[load_path]";

/// A load case in which contact never closes is named, whether it leaves a part of the objective, is
/// the worst, or is one of three designs; `check` lists the gap at the start of each.
#[test]
fn load_cases_without_contact_are_named() {
    let place = Place::with("[load_path]", LIFTED);
    let told = "warning: contact never closes in load case `up`";
    assert!(place.good("solve case.toml").err.contains(told));
    let once = place.good("optimize case.toml --iterations 1").err;
    assert_eq!(once.matches(told).count(), 1, "{once}");
    place.bad(
        "optimize case.toml --set objective.load_cases=worst --out worst",
        3,
        &["only round-off: contact never closes in load case `up`", "make the motions close the gap"],
    );
    let three = "--set design.minimum_thickness=1.2";
    let text = place.read("case.toml").replace("sensitivity_filter = { radius = 1.2 }", "");
    place.write("case.toml", &text);
    let ran = place.good(&format!("optimize case.toml --iterations 1 --out three {three}"));
    assert!(ran.err.contains(told), "{}", ran.err);
    assert!(ran.out.contains("  the objective is the largest of: nominal "), "{}", ran.out);
    let worst = format!("optimize case.toml --set objective.load_cases=worst --out worst3 {three}");
    place.bad(&worst, 3, &["contact never closes in load case `up`"]);

    let check = place.good("check case.toml").out;
    assert!(check.contains("0.000e0 at node") && check.contains(" in down\n"), "{check}");
    assert!(check.contains("3.000e-1 at node") && check.contains(" in up\n"), "{check}");
}

/// A design without material has no ratio of objective and volume.
#[test]
fn a_design_of_void_is_evaluated() {
    let place = Place::new();
    let rows = |body: &str, density: f64, elements: std::ops::Range<usize>| {
        elements.map(|element| format!("{element},{body},{density}\n")).collect::<String>()
    };
    place.write(
        "void.csv",
        &format!("element,body,density\n{}{}", rows("slab", 0.0, 0..16), rows("block", 1.0, 16..20)),
    );
    let ran = place.good("evaluate case.toml --design void.csv --friction 0.1 --set design.simp.min=0.01");
    assert!(ran.out.contains("volume fraction 0.00000"), "{}", ran.out);
    let table = place.table("case_evaluate/evaluate.csv");
    let ratio = table[0].iter().position(|name| name.starts_with("objective_over")).expect("a column");
    assert_eq!(table[1][ratio], "");
    assert!(table[1][ratio - 2].parse::<f64>().expect("θ") < 0.0, "{table:?}");
}

/// The warning about a late schedule is for the iterations that are made.
#[test]
fn late_schedules_are_those_of_the_iterations_asked_for() {
    let place = Place::with("iterations = 4", "iterations = 4\nschedule = { p = [[0, 1], [2, 3]] }");
    let told = "no update follows the entry for iteration 2";
    assert!(!place.good("optimize case.toml").err.contains(told));
    let short = place.good("optimize case.toml --iterations 2 --force");
    assert!(short.err.contains(&format!("{told}: there are 2 iterations")), "{}", short.err);
    assert!(!place.good("resume case --iterations 3").err.contains(told));
    let late = Place::with("iterations = 4", "iterations = 4\nschedule = { p = [[0, 1], [4, 3]] }");
    let told = "no update follows the entry for iteration 4: there are 4 iterations";
    assert!(late.good("check case.toml").err.contains(told));
    assert!(!late.good("optimize case.toml --iterations 5").err.contains("no update follows"));
}
