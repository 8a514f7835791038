//! Case files without errors: meaning, defaults, templates, round trip, warnings, places.

use slipstick_case::file::*;
use slipstick_solid::Orthotropic;

fn parse(text: &str) -> Resolved {
    parse_case(text, "case.toml").unwrap_or_else(|errors| panic!("{errors}"))
}

fn half_ball() -> Resolved {
    parse(template("half-ball").expect("a template").text)
}

#[test]
fn every_template_parses_without_warning() {
    for template in TEMPLATES {
        let resolved = parse(template.text);
        assert!(resolved.warnings.is_empty(), "{}: {:?}", template.name, resolved.warnings);
        let elements: usize = resolved.case.bodies.iter().filter_map(|body| body.shape.element_count()).sum();
        // By hand: 14·3·14 + (10²·2 + 1·(10² + 4·10·2)); 18·6·8 + 24·1·10; 3·34·6 + 3·38·6;
        // 3·36·2 + 10·48·2; 50·30 + 64·4; 100·20 + 64·4·2 + 128·2; 24·20·4 + 48·3; 4 + 1.
        let expected = match template.name {
            "half-ball" => 968,
            "ironing" => 1104,
            "clutch" => 1296,
            "press-fit" => 1176,
            "gripper" => 1756,
            "snap-fit" => 2768,
            "bracket" => 2064,
            _ => 5,
        };
        assert_eq!(elements, expected, "{}", template.name);
    }
    assert_eq!(template("cube_on_cuboid"), template("cube-on-cuboid"));
    assert_eq!(template("wheel"), None);
}

#[test]
fn the_cases_of_the_repository_parse() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/half_ball_on_plate");
    let text = std::fs::read_to_string(format!("{folder}/coarse.toml")).expect("readable");
    let resolved = parse(&text);
    resolved.require(&["contact", "dirichlet", "design", "objective", "optimizer"]).expect("complete");
}

#[test]
fn values_and_defaults_are_as_documented() {
    let case = half_ball().case;
    assert_eq!(case.bodies[1].shape, Shape::HalfBall { radius: 1.2, elements: [10, 2, 1] });
    assert_eq!(case.bodies[1].place.translate, [-0.5, 1.2, -0.25]);
    assert_eq!(case.bodies[0].material, LawKind::NeoHooke.like(1000.0, 0.3).expect("constants"));
    assert_eq!(case.contacts[0].enforcement, lagrange(Some(2.0), None, StiffnessScaling::Area));
    assert_eq!(case.dirichlet[0].components, [Component::X, Component::Y, Component::Z]);
    assert!(case.dirichlet[0].motion.is_empty());
    assert_eq!((case.load_path.max_newton_iterations, case.load_path.max_cutbacks), (25, 8));
    assert_eq!(case.load_path.tolerance.relative, 1e-9);
    let kind = ObjectiveKind::ContactForce { steps: ObservedSteps::Last };
    assert_eq!(case.objective, Some(Objective { kind, load_cases: OverLoadCases::Sum }));
    let Optimizer { mma, method, inner_iterations, adaptive, .. } = case.optimizer.expect("given");
    assert_eq!((method, inner_iterations), (OptimizerMethod::Mma, None));
    // the template gives a move limit
    assert!(!adaptive);
    assert_eq!((mma.move_limit, mma.asyinit, mma.asydecr, mma.c), (0.1, 0.5, 0.7, 1000.0));
    let minimal = parse(
        "[[body]]\nname = 'a'\nmaterial.neo_hooke = { youngs_modulus = 1, poisson_ratio = 0 }\n\
         box = { min = [0, 0, 0], max = [1, 1, 1], elements = [1, 0x2, 1_0] }\n\
         [[dirichlet]]\nset = 'a_ymin'\n[load_path]\nsteps = 1\n",
    )
    .case;
    let Shape::Box { elements, grading, .. } = minimal.bodies[0].shape else { panic!("a box") };
    assert_eq!((elements, grading), ([1, 2, 10], [1.0; 3]));
    assert_eq!((minimal.design, minimal.output.every), (None, 10));
    assert_eq!(
        minimal.solver,
        Solver {
            linear: LinearSolverChoice::Auto,
            petsc_options: None,
            petsc_preconditioner: PetscPreconditioner::Direct,
            threads: None
        }
    );
}

/// MMA is adaptive unless a move limit is given, by itself or in a schedule, or gradients are filtered;
/// GCMMA never is.
#[test]
fn mma_is_adaptive_unless_it_is_tuned() {
    let text = template("half-ball").expect("a template").text;
    let limit = "mma = { move_limit = 0.1 }        # the largest change of a variable in an iteration";
    assert!(text.contains(limit) && text.contains("density_filter"));
    let bare = text.replace(limit, "");
    let adaptive = |text: &str| parse(text).case.optimizer.expect("given").adaptive;
    assert!(adaptive(&bare) && !adaptive(text));
    assert!(adaptive(&text.replace(limit, "mma = { asyinit = 0.3 }")));
    assert!(adaptive(&text.replace(limit, "mma = { move_limit = 0.1 }\nadaptive = true")));
    assert!(!adaptive(&text.replace(limit, "adaptive = false")));
    assert!(!adaptive(&text.replace(limit, "method = \"gcmma\"")));
}

/// A projection whose sharpness is not given becomes sharper over the iterations of the case: after 30, 45 and 60 % of
/// them. A given sharpness, a given schedule and a few iterations leave it as it is. If `--iterations` cuts the default
/// schedule off, the help names the key that it belongs to.
#[test]
fn projections_are_continued_by_default() {
    let text = template("half-ball").expect("a template").text;
    let line = |key: &str| text.lines().find(|line| line.starts_with(key)).expect("the line");
    let bare = text.replace(line("schedule ="), "").replace(line("iterations ="), "iterations = 40");
    let entries = |text: &str| parse(text).case.optimizer.expect("given").schedule.sharpness.entries().to_vec();
    assert_eq!(entries(&bare), [(0, 1.0), (12, 2.0), (18, 4.0), (24, 8.0)]);
    assert_eq!(entries(&bare.replace("iterations = 40", "iterations = 10")), [(0, 1.0), (3, 2.0), (5, 4.0), (6, 8.0)]);
    assert_eq!(entries(&bare.replace("iterations = 40", "iterations = 9")), []);
    assert_eq!(entries(&bare.replace(line("projection ="), "projection = { sharpness = 8 }")), []);
    assert_eq!(entries(&bare.replace(line("projection ="), "")), []);
    let given = bare.replace("iterations = 40", "iterations = 40\nschedule = { sharpness = [[0, 3]] }");
    assert_eq!(entries(&given), [(0, 3.0)]);
    let mut resolved = parse(&bare);
    resolved.expect_iterations(20);
    let [warning] = &resolved.warnings[..] else { panic!("{:?}", resolved.warnings) };
    assert!(warning.help().starts_with("set `optimizer.iterations` instead"), "{}", warning.help());
}

#[test]
fn energy_interpolation_is_off_unless_asked_for() {
    let text = template("half-ball").expect("a template").text;
    let with = |value: &str| {
        let text = text.replace("simp = {", &format!("energy_interpolation = {value}\nsimp = {{"));
        parse(&text).case.design.expect("given").energy_interpolation
    };
    assert_eq!(half_ball().case.design.expect("given").energy_interpolation, None);
    assert_eq!(with("{}"), Some(EnergyInterpolation { threshold: 0.01, sharpness: 500.0 }));
    let given = EnergyInterpolation { threshold: 0.1, sharpness: 20.0 };
    assert_eq!(with("{ threshold = 0.1, sharpness = 20 }"), Some(given));
}

#[test]
fn materials_and_elements_are_read() {
    let text = template("half-ball").expect("a template").text;
    assert_eq!(half_ball().case.bodies[1].element, Formulation::Full);
    let text = text.replace("neo_hooke", "st_venant_kirchhoff").replace("[[body]]", "[[body]]\nelement = \"f_bar\"");
    let case = parse(&text).case;
    assert!(case.bodies.iter().all(|body| body.element == Formulation::FBar));
    assert_eq!(case.bodies[0].material, LawKind::StVenantKirchhoff.like(1000.0, 0.3).expect("constants"));
    let written = toml::to_string(&case).expect("writable");
    assert_eq!(parse(&written).case, case, "{written}");
}

/// Every law with its own constants, as Rust writes and as a case writes them; constants that have a
/// default may be omitted.
#[test]
fn every_law_is_read() {
    let text = template("half-ball").expect("a template").text;
    let elastic = "{ neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    for law in LawKind::ALL {
        let material = law.like(700.0, 0.3).expect("constants");
        let case = parse(&text.replace(elastic, &material.to_string())).case;
        assert!(case.bodies.iter().all(|body| body.material == material), "{material}");
        let written = toml::to_string(&case).expect("writable");
        assert_eq!(parse(&written).case, case, "{written}");
    }
    let named = elastic.replace("{ youngs", "{ form = \"power\", youngs");
    assert_eq!(parse(&text.replace(elastic, &named)).case, parse(text).case);
    let wood = "{ orthotropic = { e1 = 10, e2 = 1, e3 = 0.5, nu12 = 0.3, nu13 = 0.4, nu23 = 0.3, g12 = 0.8, g13 = 0.7, \
                g23 = 0.1 } }";
    let Material::Orthotropic(found) = parse(&text.replace(elastic, wood)).case.bodies[0].material else {
        panic!("an orthotropic material")
    };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let expected = Orthotropic::new([10.0, 1.0, 0.5], [0.3, 0.4, 0.3], [0.8, 0.7, 0.1], axes);
    assert_eq!(Ok(found), expected);
    // rubber locks too; the message names the constant that makes it incompressible
    let rubber = text.replace(elastic, "{ yeoh = { c10 = 1, c20 = 0, c30 = 0, bulk_modulus = 1000 } }");
    let warnings = parse(&rubber).warnings;
    assert_eq!((warnings.len(), warnings[0].code()), (2, CaseCode::Locking));
    assert!(warnings[0].to_string().contains("a Poisson's ratio of 0.499"), "{}", warnings[0]);
}

fn lagrange(factor: Option<f64>, stiffness: Option<Stiffness>, scaling: StiffnessScaling) -> Enforcement {
    Enforcement::Lagrange { complementarity_parameter: factor, stiffness, scaling }
}

#[test]
fn all_enforcements_and_shapes_are_read() {
    let text = template("cube-on-cuboid").expect("a template").text;
    let with = |enforcement: &str| {
        let text = text.replace("{ lagrange = {} }", enforcement);
        parse(&text).case.contacts[0].enforcement.clone()
    };
    let both = |value| Some(Stiffness { normal: value, tangential: value });
    let paper = "{ lagrange = { stiffness = { normal = 2.0, tangential = 1.0 }, scaling = \"weighted\" } }";
    let c = Some(Stiffness { normal: 2.0, tangential: 1.0 });
    assert_eq!(with(paper), lagrange(None, c, StiffnessScaling::Weighted));
    assert_eq!(
        with("{ lagrange = { complementarity_parameter = 3 } }"),
        lagrange(Some(3.0), None, StiffnessScaling::Area)
    );
    assert_eq!(
        with("{ penalty = {} }"),
        Enforcement::Penalty {
            pressure: None,
            pressure_at: PressureAt::Nodes,
            stiffness: None,
            scaling: StiffnessScaling::Area
        }
    );
    assert_eq!(
        with("{ penalty = { stiffness = 1000, scaling = \"weighted\" } }"),
        Enforcement::Penalty {
            pressure: None,
            pressure_at: PressureAt::Nodes,
            stiffness: both(1000.0),
            scaling: StiffnessScaling::Weighted
        }
    );
    assert_eq!(
        with("{ penalty = { stiffness = { normal = 2.0, tangential = 1.0 } } }"),
        Enforcement::Penalty {
            pressure: None,
            pressure_at: PressureAt::Nodes,
            stiffness: Some(Stiffness { normal: 2.0, tangential: 1.0 }),
            scaling: StiffnessScaling::Area
        }
    );
    let soft = "{ penalty = { pressure = { exponential = { contact_pressure = 3, clearance = 0.02 } } } }";
    let pressure = Some(Pressure::Exponential { contact_pressure: 3.0, clearance: 0.02 });
    let (pressure_at, scaling) = (PressureAt::Nodes, StiffnessScaling::Area);
    assert_eq!(with(soft), Enforcement::Penalty { pressure, pressure_at, stiffness: None, scaling });
    let pressure_at = PressureAt::Points;
    assert_eq!(
        with("{ penalty = { pressure_at = \"points\" } }"),
        Enforcement::Penalty { pressure: None, pressure_at, stiffness: None, scaling }
    );
    assert_eq!(
        with("{ augmented = { stiffness = 100, tolerance = 1e-9, max_uzawa = 50 } }"),
        Enforcement::Augmented {
            stiffness: both(100.0),
            scaling: StiffnessScaling::Area,
            tolerance: 1e-9,
            tolerance_scaling: ToleranceScaling::Relative,
            max_uzawa: 50,
            acceleration: 8
        }
    );
    let cylinder = "hollow_cylinder = { inner_radius = 2, outer_radius = 5, height = 8, \
                    elements = [1, 8, 1] }";
    let text = text
        .replace("box = { min = [0.6, 1.0, 0.1], max = [1.4, 1.8, 0.9], elements = [1, 1, 1] }", cylinder)
        .replace("cube_ymin", "cube_bottom")
        .replace("cube_ymax", "cube_top");
    assert_eq!(parse(&text).case.bodies[1].shape.element_count(), Some(8));
}

/// Written out as TOML, a resolved case is a case file with the same meaning; as JSON it contains
/// no null.
#[test]
fn a_resolved_case_is_a_case_file() {
    for template in TEMPLATES {
        let mut case = parse(template.text).case;
        case.units = Units { length: Some("mm".into()), force: None };
        let body = case.bodies[0].name.clone();
        let normal = Some(NormalCone { direction: [0.0, 1.0, 0.0], degrees: 30.0 });
        case.surfaces.push(SurfaceSet { name: "up".into(), body: Some(body), normal, ..SurfaceSet::default() });
        let plane = Some(Plane { point: [0.0; 3], normal: [1.0, 0.0, 0.0], tolerance: None });
        let cylinder = Some(Cylinder { start: [0.0; 3], end: [1.0, 0.0, 0.0], radius: 2.0, tolerance: None });
        let (name, within, nearest) = ("one".into(), Some("up".into()), Some([1.0, 2.0, 3.0]));
        case.sets.push(NodeSet { name, within, plane, cylinder, nearest, ..NodeSet::default() });
        if let Some(Objective { kind: ObjectiveKind::ContactForce { steps }, .. }) = &mut case.objective {
            *steps = ObservedSteps::Only(vec![1, 4]);
        }
        let moved = case.dirichlet.iter_mut().find(|of| !of.motion.is_empty()).expect("a motion");
        moved.components = vec![Component::X, Component::Y, Component::Z];
        moved.rotation = Some(RotationAxis { point: [0.1, 0.2, 0.3], direction: [0.0, 1.0, 0.0] });
        moved.motion[0].angle = 12.5;
        let text = toml::to_string(&case).expect("writable");
        assert_eq!(parse(&text).case, case, "{text}");
        assert!(!serde_json::to_string(&case).expect("writable").contains("null"));
    }
}

#[test]
fn keys_of_selections_and_units_are_read() {
    let text = half_ball().source_map.text().to_owned()
        + "\n[units]\nlength = 'cm'\nforce = 'N'\n[[surface]]\nname = 'top'\nbody = 'ball'\n\
           boxes = [{ min = [0, 0, 0], max = [1, 1, 1] }]\nnormal.direction = [0, -1, 0]\n\
           [[set]]\nname = 'disc'\nwithin = 'top'\nnearest = [1, 2, 3]\n\
           plane = { point = [1, 0, 0], normal = [0, 1, 0], tolerance = 0.5 }\n\
           cylinder = { start = [0, 0, 0], end = [0, 1, 0], radius = 2 }\n";
    let case = parse(&text).case;
    assert_eq!(case.units.bracket(Dimension::STRESS), " [N/cm²]");
    let top = &case.surfaces[0];
    assert_eq!((top.body.as_deref().unwrap(), top.boxes.len(), &top.within), ("ball", 1, &None));
    assert_eq!(top.normal, Some(NormalCone { direction: [0.0, -1.0, 0.0], degrees: 45.0 }), "by default");
    let disc = case.sets.last().expect("a set");
    assert_eq!(disc.within.as_deref(), Some("top"), "a surface that the case selects is one");
    assert_eq!(disc.plane.and_then(|plane| plane.tolerance), Some(0.5));
    assert_eq!(disc.cylinder.map(|cylinder| cylinder.radius), Some(2.0));
    assert_eq!(disc.nearest, Some([1.0, 2.0, 3.0]));
}

#[test]
fn motion_is_piecewise_linear_and_holds_its_end() {
    let mut motion = half_ball().case.dirichlet[1].clone();
    assert_eq!(motion.at(0.0), ([0.0; 3], 0.0));
    assert_eq!(motion.at(0.4), ([0.0, -0.20, 0.0], 0.0));
    assert_eq!(motion.at(1.0), ([0.5, -0.30, 0.25], 0.0));
    let (u, _) = motion.at(0.7);
    for (found, expected) in u.iter().zip([0.25, -0.25, 0.125]) {
        assert!((found - expected).abs() < 1e-15, "{u:?}");
    }
    motion.motion.truncate(1);
    assert_eq!(motion.at(0.9), ([0.0, -0.20, 0.0], 0.0));
}

#[test]
fn what_is_left_out_of_a_way_point_stays() {
    let text = template("half-ball").expect("a template").text.replace(
        "{ t = 1.0, u = [0.5, -0.30, 0.25] },",
        "{ t = 0.5, angle = 30 }, { t = 1.0, u = [0, -0.2, 0] },\n]\nrotation = { point = [0, 0, 0], \
         direction = [0, 1, 0] }\n#",
    );
    let text = text.replace("#   # slid to the plate's centre and pressed further\n]", "");
    let motion = parse(&text).case.dirichlet[1].motion.clone();
    assert_eq!(motion[1], Waypoint { t: 0.5, u: [0.0, -0.20, 0.0], angle: 30.0 });
    assert_eq!(motion[2], Waypoint { t: 1.0, u: [0.0, -0.2, 0.0], angle: 30.0 });
}

#[test]
fn warnings_have_code_and_place() {
    let text = template("half-ball").expect("a template").text;
    let warned = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let text = text.replace(from, to);
        let warnings = parse(&text).warnings;
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert_eq!(warnings[0].severity(), Severity::Warning);
        let line = text.lines().nth(warnings[0].line() - 1).expect("in the file").to_owned();
        (warnings[0].code(), line[warnings[0].column() - 1..].to_owned())
    };
    let (code, at) = warned("t = 0.4", "t = 0.45");
    assert_eq!(code, CaseCode::CornerBetweenSteps);
    assert!(at.starts_with("0.45, u"), "{at}");
    let (code, at) = warned("initial = 0.25", "initial = 0.5");
    assert_eq!((code, at.as_str()), (CaseCode::InitialVolume, "0.5"));
    let exact = |line: &&str| !["projection", "schedule"].iter().any(|key| line.starts_with(key));
    let filtered =
        text.replace("density_filter", "sensitivity_filter").replace("[optimizer]", "[optimizer]\nmethod = \"gcmma\"");
    let filtered: Vec<&str> = filtered.lines().filter(exact).collect();
    let warnings = parse(&filtered.join("\n")).warnings;
    assert_eq!((warnings.len(), warnings[0].code()), (1, CaseCode::FilteredGradients));
    assert_eq!(filtered[warnings[0].line() - 1], "method = \"gcmma\"");
    let (code, at) = warned("set = \"ball_flat\"", "set = \"plate_xmin\"");
    assert_eq!((code, at.as_str()), (CaseCode::UnsupportedBody, "\"ball\""));
    let (code, at) = warned("enforcement = { lagrange = {} }", "enforcement = { augmented = { tolerance = 10 } }");
    assert_eq!(code, CaseCode::LooseTolerance);
    assert!(at.starts_with("10 }"), "{at}");
    let absolute = "enforcement = { augmented = { tolerance = 10, tolerance_scaling = \"absolute\" } }";
    assert!(parse(&text.replace("enforcement = { lagrange = {} }", absolute)).warnings.is_empty(), "it has units");
    // Both bodies have the material; only the ball is nearly incompressible.
    let soft = |element: &str| {
        let (before, ball) = text.split_once("name = \"ball\"").expect("the second body");
        let ball = ball.replacen("poisson_ratio = 0.3 } }", &format!("poisson_ratio = 0.46 }} }}{element}"), 1);
        parse(&format!("{before}name = \"ball\"{ball}")).warnings
    };
    let warnings = soft("");
    assert_eq!((warnings.len(), warnings[0].code()), (1, CaseCode::Locking));
    assert!(soft("\nelement = \"f_bar\"").is_empty());
    let (code, at) = warned("{ t = 0.4", "{ t = 0.2, u = [0, 0, 0] }, # \n { t = 0.40001");
    assert_eq!(code, CaseCode::CornerBetweenSteps);
    assert!(at.starts_with("0.40001"), "{at}");
}

#[test]
fn later_errors_point_back_at_the_file() {
    let resolved = half_ball();
    let map = &resolved.source_map;
    let text = map.text();
    assert_eq!(&text[map.span("contact[0].slave")], "\"ball_dome\"");
    assert_eq!(&text[map.span("set[0].boxes[2].min[0]")], &text[map.span("set[0].boxes[2].min")]);
    assert_eq!(&text[map.span("body[1].material.neo_hooke.poisson_ratio")], "0.3");
    // A default is not in the file: its table is reported instead.
    assert_eq!(&text[map.span("contact[0].search_radius")], "[[contact]]");
    assert!(!map.contains("contact[0].search_radius"));
    let errors = map.error("set[0].boxes", CaseCode::EmptySet, "the set is empty", "widen it");
    let line = 1 + text.lines().position(|line| line == "boxes = [").expect("a line");
    let expected =
        format!("case.toml:{line}:9: error: the set is empty [slipstick::case::empty_set]\n    help: widen it");
    assert_eq!(errors.to_string(), expected);
}

#[test]
fn codes_are_unique_and_named_alike() {
    let mut names: Vec<&str> = CaseCode::ALL.iter().map(|code| code.as_str()).collect();
    assert!(names.iter().all(|name| name.starts_with("slipstick::case::")));
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), CaseCode::ALL.len());
}

#[test]
fn sections_that_a_command_needs_are_asked_for() {
    let resolved = parse(template("cube-on-cuboid").expect("a template").text);
    resolved.require(&["design", "objective"]).expect("both are there");
    let errors = resolved.require(&["design", "optimizer"]).expect_err("no optimizer");
    assert_eq!(errors.diagnostics().len(), 1);
    assert_eq!(errors.diagnostics()[0].code(), CaseCode::MissingSection);
    assert!(errors.to_string().contains("no section [optimizer]"));
}

#[test]
fn boxes_hold_their_bounds() {
    let region = BoxRegion { min: [0.0; 3], max: [1.0, 1.0, 0.0] };
    assert!(region.contains([0.0, 1.0, 0.0]));
    assert!(!region.contains([0.0, 1.0, 1e-12]));
    assert!(!region.contains([f64::NAN, 0.0, 0.0]));
}
