//! Possible errors in each section of a case file.

use super::*;

#[test]
fn bodies_and_material() {
    use CaseCode::*;
    one(5, "1000.0", "0.0", YoungsModulus, "0.0");
    one(5, "neo_hooke = { youngs_modulus = 1000.0", "st_venant_kirchhoff = { youngs_modulus = -2", YoungsModulus, "-2");
    one(5, "neo_hooke", "neohooke", UnknownKey, "neohooke");
    one(5, "{ youngs", "{ form = \"log\", youngs", UnknownWord, "\"log\"");
    one(5, "material", "element = \"fbar\"\nmaterial", UnknownWord, "\"fbar\"");
    one(5, "1000.0", "-1", YoungsModulus, "-1");
    one(5, "0.3", "0.5", PoissonRatio, "0.5");
    one(5, "0.3", "-1.0", PoissonRatio, "-1.0");
    one(4, "max = [4", "max = [0", BadShape, "[0, 1, 4]");
    one(4, "[4, 1, 4] }", "[4, 0, 4] }", Elements, "[4, 0");
    one(4, "[4, 1, 4] }", "[1000000, 1000, 4] }", Elements, "[1000000");
    one(4, "4] }", "4], grading = [1, 0, 1] }", OutOfRange, "[1, 0, 1]");
    one(8, "1.0", "0.0", BadShape, "0.0");
    one(9, "[0, 1, 0]", "[0, 0, 0]", OutOfRange, "[0, 0, 0]");
    one(14, "[1, 0, 1]", "[1, -1, 1]", BadShape, "[1, -1, 1]");
    one(14, "[{ min = [0, 0, 0], max = [1, 0, 1] }]", "[]", Empty, "[]");
    let ring = "half_ring = { inner_radius = 2, outer_radius = 1, width = 1, elements = [2, 1, 1] }";
    let text = GOOD.replace("half_ball = { radius = 1.0, elements = [2, 1, 1] }", ring);
    let text = text.replace("ball_dome", "ball_outer").replace("ball_flat", "ball_ends");
    only_error(&text, BadShape, (8, 48));
    let torus = "torus = { radius = 1, tube_radius = 1, elements = [1, 1, 3] }";
    let text = GOOD.replace("half_ball = { radius = 1.0, elements = [2, 1, 1] }", torus);
    let text = text.replace("ball_dome", "ball_side").replace("ball_flat", "ball_side");
    only_error(&text, BadShape, (8, 37));
}

/// Constants of the other laws: missing, of the wrong type, out of range, and contradictory.
#[test]
fn constants_of_laws() {
    use CaseCode::*;
    let elastic = "{ neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    let bad = |law: &str, code, at: &str| one(5, elastic, &format!("{{ {law} }}"), code, at);
    let help = bad("mooney_rivlin = { c10 = 1, c01 = -2, bulk_modulus = 9 }", MaterialConstants, "1, c01");
    assert_eq!(help, "give constants whose sum is greater than zero");
    let help = bad("mooney_rivlin = { c10 = 1, bulk_modulus = 9 }", MissingKey, "{ c10");
    assert_eq!(help, "the factor of the second invariant; 0 if only c10 is known");
    bad("mooney_rivlin = { c10 = 1, c01 = 0, bulk_modulus = 0 }", OutOfRange, "0 }");
    bad("mooney_rivlin = { c10 = 1, c1 = 0, bulk_modulus = 9 }", UnknownKey, "c1 =");
    bad("yeoh = { c10 = 0, c20 = 0, c30 = 0, bulk_modulus = 9 }", OutOfRange, "0, c20");
    bad("yeoh = { c10 = 1, c20 = 0, c30 = 0, youngs_modulus = 9 }", UnknownKey, "youngs_modulus");
    bad("ogden = { mu = [1, 2], alpha = [2], bulk_modulus = 9 }", MaterialConstants, "[2]");
    bad("ogden = { mu = [1], alpha = [-2], bulk_modulus = 9 }", MaterialConstants, "[1]");
    bad("ogden = { mu = [1], alpha = [0], bulk_modulus = 9 }", MaterialConstants, "[0]");
    bad("ogden = { mu = [], alpha = [2], bulk_modulus = 9 }", OutOfRange, "[]");
    bad("ogden = { mu = [1, 1, 1, 1, 1], alpha = [2], bulk_modulus = 9 }", OutOfRange, "[1, 1");
    bad("ogden = { mu = 1, alpha = [2], bulk_modulus = 9 }", WrongType, "1, alpha");
    bad("ogden = { mu = [1, 'x'], alpha = [2, 2], bulk_modulus = 9 }", WrongType, "'x'");
    let wood = "e1 = 10, e2 = 1, e3 = 1, nu12 = 0.3, nu13 = 0.3, nu23 = 0.3, g12 = 1, g13 = 1, g23 = 1";
    let bad = |from: &str, to: &str, code, at: &str| {
        bad(&format!("orthotropic = {{ {} }}", wood.replacen(from, to, 1)), code, at)
    };
    bad("g12 = 1", "g12 = -1", OutOfRange, "-1");
    bad("nu23 = 0.3", "nu23 = 1.1", MaterialConstants, "1.1");
    // each ratio alone is possible
    bad("nu23 = 0.3", "nu23 = 0.999", MaterialConstants, "0.3, nu13");
    bad("g12 = 1", "g12 = 1, axis1 = [0, 2, 0]", MaterialConstants, "{ e1");
    bad("g12 = 1", "g12 = 1, axis2 = [2, 0, 0]", MaterialConstants, "[2, 0");
    bad("g12 = 1", "g12 = 1, axis1 = [0, 0, 0]", OutOfRange, "[0, 0, 0]");
}

/// Selections without a condition, or with one that selects nothing in any mesh.
#[test]
fn surfaces_and_sets() {
    use CaseCode::*;
    let boxes = "boxes = [{ min = [0, 0, 0], max = [1, 0, 1] }]";
    one(14, boxes, "plane = { point = [0, 0, 0], normal = [0, 0, 0] }", OutOfRange, "[0, 0, 0] }");
    one(14, boxes, "plane = { point = [0, 0, 0], normal = [0, 1, 0], tolerance = -1 }", OutOfRange, "-1");
    one(14, boxes, "plane = { normal = [0, 1, 0] }", MissingKey, "{ normal");
    one(14, boxes, "cylinder = { start = [0, 0, 1], end = [0, 0, 1], radius = 1 }", BadShape, "[0, 0, 1], radius");
    one(14, boxes, "cylinder = { start = [0, 0, 0], end = [0, 0, 1], radius = 0 }", BadShape, "0 }");
    one(14, boxes, "nearest = [1, 2]", WrongType, "[1, 2]");
    let all = GOOD.replace("within = \"plate_ymin\"", "").replace(boxes, "");
    let help = only_error(&all, MissingKey, (11, 1));
    assert_eq!(help, "give one or more of: boxes, plane, cylinder, nearest, within, body");
    let surface = |keys: &str| GOOD.replacen("[[set]]", &format!("[[surface]]\nname = \"top\"\n{keys}\n[[set]]"), 1);
    let up = "normal = { direction = [0, 1, 0] }";
    parse_case(&surface(&format!("body = \"plate\"\n{up}")), "case.toml").unwrap_or_else(|errors| panic!("{errors}"));
    only_error(&surface("body = \"plate\""), MissingKey, (11, 1));
    only_error(&surface(up), MissingKey, (11, 1));
    only_error(&surface(&format!("body = \"plat\"\n{up}")), UnknownBody, (13, 8));
    only_error(&surface("body = \"plate\"\nwithin = \"ball_dome\""), UnknownSet, (14, 10));
    only_error(&surface("body = \"plate\"\nwithin = \"feet\""), UnknownSet, (14, 10));
    only_error(&surface("body = \"plate\"\nboxes = []"), Empty, (14, 9));
    let steep = "body = \"plate\"\nnormal = { direction = [0, 1, 0], degrees = 181 }";
    only_error(&surface(steep), OutOfRange, (14, 45));
    let text = surface(&format!("body = \"plate\"\n{up}")).replace("\"top\"", "\"plate_ymax\"");
    only_error(&text, DuplicateName, (12, 8));
}

#[test]
fn units() {
    one(1, "\"good\"", "\"good\"\nunits = { length = \"\" }", CaseCode::Empty, "\"\" }");
    one(1, "\"good\"", "\"good\"\nunits = { lenght = \"mm\" }", CaseCode::UnknownKey, "lenght");
}

#[test]
fn contact() {
    use CaseCode::*;
    one(18, "0.3", "-0.1", Friction, "-0.1");
    let both = "[[contact]]\nslave = \"plate_ymax\"\nmaster = \"ball_dome\"\nfriction = 0.3\n\n[[dirichlet]]";
    only_error(&GOOD.replacen("[[dirichlet]]", both, 1), DuplicateName, (20, 1));
    one(18, "0.3", "0.3\ncell_rule = 5", CellRule, "5");
    one(18, "0.3", "0.3\nmultiplier_shape = \"double\"", UnknownWord, "\"double\"");
    one(18, "0.3", "0.3\nsearch_radius = -1", OutOfRange, "-1");
    one(19, "lagrange = {}", "penalty = { stiffness = 0 }", OutOfRange, "0 }");
    one(19, "lagrange = {}", "penalty = { stiffness = { tangential = 1 } }", MissingKey, "{ tang");
    let points = "penalty = { pressure_at = \"points\", scaling = \"weighted\" }";
    one(19, "lagrange = {}", points, Unsupported, "\"weighted\"");
    one(19, "lagrange = {}", "augmented = { tolerance = 0.0 }", OutOfRange, "0.0");
    one(19, "lagrange = {}", "lagrange = { stiffness = 1, complementarity_parameter = 5.0 }", ChooseOne, "5.0");
}

/// The shapes are such that no two surfaces of the same body can meet.
#[test]
fn a_body_in_contact_with_itself() {
    for (slave, master) in [("plate_ymin", "plate_ymax"), ("plate_xmin", "plate_ymax"), ("ball_dome", "ball_flat")] {
        let text = GOOD.replace("\"ball_dome\"", &format!("\"{slave}\""));
        let text = text.replace("\"plate_ymax\"", &format!("\"{master}\""));
        only_error(&text, CaseCode::SameBody, (17, 10));
    }
}

/// Beyond 1e±50, volumes and their squares exceed the range of floating-point numbers.
#[test]
fn numbers_beyond_any_unit() {
    use CaseCode::OutOfRange;
    assert_eq!(one(4, "[4, 1, 4], e", "[1e308, 1, 4], e", OutOfRange, "1e308"), "use other units");
    one(4, "[0, 0, 0]", "[-1e51, 0, 0]", OutOfRange, "-1e51");
    one(5, "1000.0", "1e308", OutOfRange, "1e308");
    one(5, "1000.0", "1e-308", OutOfRange, "1e-308");
    one(8, "radius = 1.0", "radius = 1e-60", OutOfRange, "1e-60");
    one(9, "[2, 2, 2]", "[2, 2, 1e308]", OutOfRange, "1e308");
    one(18, "0.3", "1e200", OutOfRange, "1e200");
    one(24, "u = [0, -1, 0]", "u = [0, -1e308, 0]", OutOfRange, "-1e308");
    one(32, "0.5", "1e308", OutOfRange, "1e308");
    // A whole number is a number, however long.
    one(24, "u = [0, -1, 0]", &format!("u = [0, -1{}, 0]", "0".repeat(60)), OutOfRange, "-1000");
    let long = GOOD.replace("1000.0", "100000000000000000000");
    let case = parse_case(&long, "case.toml").unwrap_or_else(|errors| panic!("{errors}")).case;
    assert_eq!(case.bodies[0].material.youngs_modulus(), 1e20);
}

/// Elements without any stiffness are allowed, but reported.
#[test]
fn void_without_stiffness_is_told() {
    let resolved = parse_case(&GOOD.replace("min = 1e-3", "min = 0"), "case.toml").unwrap_or_else(|e| panic!("{e}"));
    let told: Vec<_> = resolved.warnings.iter().map(|w| (w.code(), w.line(), w.column())).collect();
    assert_eq!(told, [(CaseCode::Simp, 31, 23)]);
    assert!(resolved.warnings[0].message().contains("no stiffness"));
    // Without an optimizer no element becomes void.
    let alone =
        GOOD.replace("min = 1e-3", "min = 0").replace("[optimizer]\nmma = { move_limit = 0.1 }\niterations = 30\n", "");
    assert!(parse_case(&alone, "case.toml").unwrap_or_else(|e| panic!("{e}")).warnings.is_empty());
}

#[test]
fn motion() {
    use CaseCode::*;
    one(24, "t = 0.5", "t = 1.0", MotionTime, "1.0, u = [1");
    one(24, "t = 1.0", "t = 1.5", MotionTime, "1.5");
    one(24, "t = 0.5", "t = 0.0", MotionTime, "0.0");
    one(24, ", u = [1, -1, 0]", "", Motion, "{ t = 1.0");
    one(24, "u = [1, -1, 0]", "angle = 30", Motion, "30");
    one(24, "motion", "components = [\"y\", \"z\"]\nmotion", Motion, "[1, -1, 0]");
    one(21, "\"feet\"", "\"feet\"\ncomponents = [\"x\", \"v\"]", UnknownWord, "\"v\"");
    one(21, "\"feet\"", "\"feet\"\ncomponents = []", Empty, "[]");
    one(21, "\"feet\"", "\"feet\"\ncomponents = [\"x\", \"x\"]", DuplicateName, "[\"x\"");
}

#[test]
fn load_path_objective_and_run() {
    use CaseCode::*;
    one(26, "10", "0", Steps, "0");
    one(26, "10", "-3", Steps, "-3");
    one(34, "\"last\"", "[1, 11]", Steps, "11");
    assert_eq!(one(34, "\"last\"", "[11]", Steps, "11"), "load steps are numbered 1 to 10");
    one(34, "\"last\"", "[0]", Steps, "0]");
    one(34, "\"last\"", "[-1]", Steps, "-1");
    one(34, "\"last\"", "[2, 2]", Steps, "[2, 2]");
    one(34, "\"last\"", "[]", Empty, "[]");
    one(34, "\"last\"", "[1.5]", WrongType, "1.5");
    one(34, "\"last\"", "[99999999999999999999]", OutOfRange, "999");
    one(26, "10", "1000001", Steps, "1000001");
    one(26, "10", "9223372036854775808", OutOfRange, "922");
    assert!(one(26, "10", "1e300", WrongType, "1e300").contains("without a decimal point"));
    one(34, "\"last\"", "[3, 2]", Steps, "[3, 2]");
    one(34, "\"last\"", "\"lst\"", UnknownWord, "\"lst\"");
    one(37, "30", "0", OutOfRange, "0");
    one(39, "10", "0", OutOfRange, "0");
    one(41, "auto", "umfpack", UnknownWord, "\"umfpack\"");
}

#[test]
fn design_and_optimizer() {
    use CaseCode::*;
    let help = one(28, "bodies", "extrud = \"y\"\nbodies", UnknownKey, "extrud");
    assert_eq!(help, "did you mean `extrude`?");
    let region = "passive_solid = { min = [0, 0, 0], max = [1, 1, 1] }\nbodies";
    assert_eq!(one(28, "bodies", region, WrongType, "{ min"), "write [[design.passive_solid]] for each of them");
    one(28, "[\"plate\"]", "[]", EmptyDesign, "[]");
    one(29, "0.3", "0.0", Fraction, "0.0");
    one(30, "0.3", "1.1", Fraction, "1.1");
    one(31, "p = 3", "p = 0.5", Simp, "0.5");
    one(31, "1e-3", "1.0", Simp, "1.0");
    one(31, "1e-3", "-0.1", Simp, "-0.1");
    let with = |energy: &str| format!("1e-3 }}\nenergy_interpolation = {energy}");
    one(31, "1e-3 }", &with("{ threshold = 0 }"), OutOfRange, "0 }\nsens");
    one(31, "1e-3 }", &with("{ threshold = 1.0 }"), OutOfRange, "1.0");
    one(31, "1e-3 }", &with("{ sharpness = 0.0 }"), OutOfRange, "0.0");
    one(31, "1e-3 }", &with("true"), WrongType, "true");
    one(31, "1e-3 }", &with("{ beta = 500 }"), UnknownKey, "beta");
    let void = |keys: &str| format!("1e-3 }}\n{keys}");
    one(31, "1e-3 }", &void("void_poisson_ratio = 0.5"), Simp, "0.5");
    one(31, "1e-3 }", &void("void_poisson_ratio = 0.3"), Simp, "0.3");
    one(31, "1e-3 }", &void("bulk_p = 2"), Simp, "2");
    one(31, "1e-3 }", &void("void_poisson_ratio = 0.2\nbulk_p = 0.9"), Simp, "0.9");
    one(32, "0.5", "0", OutOfRange, "0");
    one(36, "0.1", "0", OutOfRange, "0 }");
    one(36, "0.1", "0.1, asydecr = 1.2", OutOfRange, "1.2");
    let method = |keys: &str| format!("mma = {{ move_limit = 0.1 }}\n{keys}");
    let line = "mma = { move_limit = 0.1 }";
    one(36, line, &method("method = \"gcma\""), UnknownWord, "\"gcma\"");
    one(36, line, &method("inner_iterations = 5"), Unsupported, "5");
    one(36, line, &method("method = \"mma\"\ninner_iterations = 5"), Unsupported, "5");
    one(36, line, &method("method = \"gcmma\"\ninner_iterations = -1"), OutOfRange, "-1");
    one(36, line, &method("method = \"gcmma\"\nadaptive = true"), Unsupported, "true");
}

#[test]
fn filters_and_projection() {
    use CaseCode::*;
    let line = "sensitivity_filter = { radius = 0.5 }";
    let density = |keys: &str| format!("density_filter = {{ radius = 0.5 }}\n{keys}");
    parse_case(&GOOD.replace(line, &density("projection = {}")), "case.toml")
        .unwrap_or_else(|errors| panic!("{errors}"));
    one(
        32,
        "{ radius = 0.5 }",
        "{ radius = 0.5 }\ndensity_filter = { radius = 0.5 }",
        Unsupported,
        "{ radius = 0.5 }\n[obj",
    );
    one(32, "{ radius = 0.5 }", "{ radius = 0.5 }\nprojection = {}", Unsupported, "{}");
    one(32, line, "density_filter = { radius = 0 }", OutOfRange, "0 }");
    one(32, line, "density_filter = { radius = 1, boundary = \"solid\" }", UnknownWord, "\"solid");
    one(32, line, "density_filter = {}", MissingKey, "{}");
    one(32, line, "density_filter = { radius = 1, edge = 1 }", UnknownKey, "edge");
    one(32, line, &density("projection = { sharpness = 0 }"), OutOfRange, "0 }\n[obj");
    one(32, line, &density("projection = { sharpness = -2 }"), OutOfRange, "-2");
    one(32, line, &density("projection = { threshold = 1.1 }"), OutOfRange, "1.1");
    one(32, line, &density("projection = { threshold = -0.1 }"), OutOfRange, "-0.1");
    one(32, line, &density("projection = { beta = 8 }"), UnknownKey, "beta");
}

#[test]
fn schedules_and_criteria() {
    use CaseCode::*;
    let good = GOOD.replace("sensitivity_filter", "projection = {}\ndensity_filter");
    let parsed =
        |key: &str| parse_case(&good.replace("iterations = 30", &format!("iterations = 30\n{key}")), "case.toml");
    let resolved =
        parsed("schedule = { sharpness = [[0, 1], [20, 4]], move_limit = [[5, 0.05]] }\noptimality = 1e-3").unwrap();
    assert!(resolved.warnings.is_empty(), "{:?}", resolved.warnings);
    let warned = |key: &str| parsed(key).unwrap().warnings.iter().map(|w| (w.code(), w.line())).collect::<Vec<_>>();
    assert_eq!(warned("schedule = { p = [[0, 1], [20, 2]] }"), [(Simp, 39)]);
    assert_eq!(warned("schedule = { p = [[0, 1], [30, 3]] }"), [(LateSchedule, 39)]);
    let with = |key: &str| format!("30\n{key}");
    one(37, "30", &with("optimality = -7"), OutOfRange, "-7");
    one(37, "30", &with("discreteness = 1.25"), OutOfRange, "1.25");
    one(37, "30", &with("schedule = { sharpness = [[0, 1]] }"), Unsupported, "[[0");
    one(37, "30", &with("schedule = { p = [] }"), Empty, "[]");
    one(37, "30", &with("schedule = { p = [[0, 0.5], [9, 3]] }"), OutOfRange, "[0, 0.5]");
    one(37, "30", &with("schedule = { p = [[5, 2], [5, 3]] }"), OutOfRange, "[5, 3]");
    one(37, "30", &with("schedule = { p = [[-1, 3]] }"), OutOfRange, "[-1");
    one(37, "30", &with("schedule = { p = [3] }"), WrongType, "3]");
    one(37, "30", &with("schedule = { p = [[0.5, 3]] }"), WrongType, "0.5");
    one(37, "30", &with("schedule = { move_limit = [[0, 1.5]] }"), OutOfRange, "[0, 1.5]");
    one(37, "30", &with("schedule = { radius = [[0, 1.5]] }"), UnknownKey, "radius");
}

#[test]
fn passive_elements() {
    use CaseCode::*;
    let row = "{ min = [0, 0, 0], max = [4, 1, 1] }";
    let one_more = "{ min = [0, 0, 1], max = [1, 1, 2] }";
    let passive = |text: &str| format!("sensitivity_filter = {{ radius = 0.5 }}\n{text}");
    let line = GOOD.lines().nth(31).expect("line 32");
    let four = GOOD.replace(line, &passive(&format!("passive_solid = [{row}]")));
    parse_case(&four, "case.toml").unwrap_or_else(|errors| panic!("{errors}"));
    let five = GOOD.replace(line, &passive(&format!("passive_solid = [{row}, {one_more}]")));
    only_error(&five, InfeasibleVolume, (30, 19));
    let text = passive(&format!("passive_solid = [{row}]\npassive_void = [{row}]"));
    only_error(&GOOD.replace(line, &text), ContradictoryPassive, (34, 16));
}

#[test]
fn an_objective_of_contact_needs_contact() {
    let text = GOOD.replace("[[contact]]", "[contact_pair]");
    let errors = errors(&text);
    let found: Vec<_> = errors.diagnostics().iter().map(|d| (d.code(), d.line(), d.column())).collect();
    assert_eq!(found, [(CaseCode::UnknownKey, 15, 2), (CaseCode::NoContact, 34, 17)]);
    let compliance = GOOD.replace("contact_force", "compliance");
    let help = only_error(&compliance, CaseCode::ChooseOne, (34, 14));
    assert!(help.contains("[[load]]"), "{help}");
}

#[test]
fn options_of_petsc() {
    use CaseCode::*;
    let with = |linear: &str, options: &str| format!("linear = \"{linear}\"\npetsc_options = {options}");
    one(41, "linear = \"auto\"", &with("petsc", "\"mat_mumps_icntl_14 60\""), OutOfRange, "\"mat_mumps");
    one(41, "linear = \"auto\"", &with("petsc", "\"\""), OutOfRange, "\"\"");
    one(41, "linear = \"auto\"", &with("petsc", "14"), WrongType, "14");
    one(41, "linear = \"auto\"", &with("strict", "\"-ksp_type gmres\""), Unsupported, "\"-ksp_type");
    one(41, "linear = \"auto\"", "linear = \"pets\"", UnknownWord, "\"pets\"");
    let with = |linear: &str, word: &str| format!("linear = \"{linear}\"\npetsc_preconditioner = {word}");
    one(41, "linear = \"auto\"", &with("petsc", "\"zone\""), UnknownWord, "\"zone\"");
    one(41, "linear = \"auto\"", &with("strict", "\"contact_zone\""), Unsupported, "\"contact_zone\"");
}

/// Results are kept in a folder of their own.
#[test]
fn directories_that_are_no_folder_of_their_own() {
    let with = |path: &str| GOOD.replace("every = 10", &format!("directory = \"{path}\""));
    for path in ["/", ".", "./", "..", "results/.."] {
        let errors = parse_case(&with(path), "case.toml").expect_err(path).to_string();
        assert!(errors.contains("is no folder of its own"), "{path}: {errors}");
    }
    for path in ["results", "./results", "/tmp/results/", "../results"] {
        assert!(parse_case(&with(path), "case.toml").is_ok(), "{path}");
    }
}

/// Tied surfaces have no friction, in any load case.
#[test]
fn friction_of_tied_pairs_in_load_cases() {
    let tied = GOOD.replace("friction = 0.3\nenforcement = { lagrange = {} }", "tied = true");
    let of_pair = format!("{tied}\n[[load_case]]\nname = 'a'\npairs = [{{ slave = 'ball_dome', friction = 0.1 }}]\n");
    let error = parse_case(&of_pair, "case.toml").expect_err("tied").to_string();
    assert!(error.contains("`ball_dome` is tied, and has no friction in any load case"), "{error}");
    let of_all = parse_case(&format!("{tied}\n[[load_case]]\nname = 'a'\nfriction = 0.1\n"), "case.toml");
    let warnings = of_all.unwrap_or_else(|errors| panic!("{errors}")).warnings;
    assert!(warnings.iter().any(|warning| warning.to_string().contains("all contact pairs are tied")), "{warnings:?}");
}
