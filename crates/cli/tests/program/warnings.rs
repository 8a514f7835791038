//! What commands warn about.

use super::*;

/// A ball of a few facets that is pressed into a slab by 0.08 while the mean gap stays open.
#[test]
fn an_overlap_without_force_is_told() {
    let place = Place::new();
    let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    let text = format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [3, 1, 3], elements = [9, 3, 9] }}\n{material}\n\
         [[body]]\nname = 'ball'\nhalf_ball = {{ radius = 1.0, elements = [2, 1, 2] }}\n\
         place = {{ translate = [1.5, 2.0, 1.5] }}\n{material}\n\
         [[contact]]\nslave = 'ball_dome'\nmaster = 'slab_ymax'\nfriction = 0.3\nsurfaces = 'faceted'\n\
         [[dirichlet]]\nset = 'slab_ymin'\n\
         [[dirichlet]]\nset = 'ball_flat'\nmotion = [{{ t = 1, u = [0, -0.08, 0] }}]\n[load_path]\nsteps = 2\n"
    );
    place.write("ball.toml", &text);
    let ran = place.good("solve ball.toml");
    let expected = "warning: in load step 2, `ball_dome` lies up to 0.08 below `slab_ymax` at node";
    assert!(ran.err.contains(expected) && ran.err.contains("help: refine both surfaces"), "{}", ran.err);
    let events = place.good("solve ball.toml --json --force").events();
    let warning = events.iter().find(|event| event["code"] == "open_overlap").expect("a warning");
    assert_eq!((&warning["event"], &warning["overlap"]["step"]), (&"warning".into(), &2.into()));
    assert!(warning["overlap"]["depth"].as_f64().is_some_and(|depth| (depth - 0.08).abs() < 1e-9), "{warning}");
}

/// A block arrives on a strip in the middle of the last of four steps, in which it also slides: its friction work is
/// twice what finer steps give (`friction_of_coarse_steps_is_judged`).
#[test]
fn steps_that_are_coarse_for_friction_work_are_told() {
    let place = Place::new();
    let body = |name: &str, bounds: &str, modulus: f64| {
        format!(
            "[[body]]\nname = '{name}'\nbox = {bounds}\n\
             material = {{ neo_hooke = {{ youngs_modulus = {modulus:?}, poisson_ratio = 0.3 }} }}\n"
        )
    };
    let text = format!(
        "{}{}[[contact]]\nslave = 'up_ymin'\nmaster = 'low_ymax'\nfriction = 0.3\n\
         [[dirichlet]]\nset = 'low_ymin'\n[[dirichlet]]\nset = 'low_zmin'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'low_zmax'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'up_ymax'\nmotion = [{{ t = 1, u = [0.2, -0.04, 0] }}]\n[load_path]\nsteps = 4\n",
        body("low", "{ min = [0, 0, 0], max = [3, 1, 0.5], elements = [9, 3, 1] }", 10.0),
        body("up", "{ min = [1, 1.035, 0], max = [2, 2, 0.5], elements = [3, 3, 1] }", 1000.0)
    );
    place.write("press.toml", &text);
    let expected = "warning: load steps are coarse for the friction work of `up_ymin` with `low_ymax`";
    let ran = place.good("solve press.toml");
    assert!(ran.err.contains(expected) && ran.err.contains("help: use more load steps"), "{}", ran.err);
    let events = place.good("solve press.toml --json --force").events();
    let warning = events.iter().find(|event| event["code"] == "coarse_friction").expect("a warning");
    let [work, error] = ["work", "error"].map(|key| warning["friction"][key].as_f64().expect("a number"));
    assert!((error / work - 0.5).abs() < 1e-9, "{warning}");
    // the report has the warning, too; that of a run of an earlier version opens without
    let page = || {
        place.good("report press_solve");
        report::data(&place.read("press_solve/report.html"))["warnings"].clone()
    };
    let kept = page();
    assert!(kept[0]["message"].as_str().is_some_and(|text| text.starts_with("load steps are coarse")), "{kept}");
    assert!(kept[0]["help"].as_str().is_some_and(|text| text.starts_with("use more load steps")), "{kept}");
    // contact begins within the last step, so the work of its force is as coarse
    assert_eq!(kept.as_array().map(Vec::len), Some(2));
    assert!(
        kept[1]["message"].as_str().is_some_and(|text| text.contains("of which other findings account for")),
        "{kept}"
    );
    browser::shows_warnings(&place, "press_solve", "load steps are coarse");
    std::fs::remove_file(place.path("press_solve/warnings.json")).expect("it was there");
    assert_eq!(page(), serde_json::json!([]));
    let finer = place.good("solve press.toml --force --set load_path.steps=256");
    assert!(!place.path("press_solve/warnings.json").exists());
    assert!(!finer.err.contains("coarse for the friction work"), "{}", finer.err);
}

/// A block that is lifted off: the objective is 0, and every command that runs an analysis says
/// why.
#[test]
fn contact_that_never_closes_is_told() {
    let away =
        CASE.replace("u = [0, -0.1, 0]", "u = [0, 0.1, 0]").replace("u = [0.2, -0.1, 0.05]", "u = [0.2, 0.1, 0]");
    let place = Place::new();
    place.write("case.toml", &away);
    for line in ["solve case.toml", "gradient case.toml", "evaluate case.toml --design case_solve"] {
        let ran = place.good(line);
        assert!(ran.err.contains("warning: contact never closed on the path"), "{line}: {}", ran.err);
    }
    let ran = place.good("gradient case.toml --json --force");
    assert_eq!(ran.event("warning")["message"].as_str().map(|m| m.contains("so are its derivatives")), Some(true));
    let expected =
        ["nothing could be compared: the objective is", "contact never closes on the path", "place.translate"];
    place.bad("verify gradient case.toml --elements 1 --directions 0", 3, &expected);

    // Lifted off after the first half, and only the last step counts.
    place.write("case.toml", &CASE.replace("u = [0.2, -0.1, 0.05]", "u = [0.2, 0.1, 0]"));
    place.bad("solve case.toml", 2, &["already contains the results of a run"]);
    let ran = place.good("solve case.toml --force");
    assert!(ran.err.contains("open at every step that the objective observes"), "{}", ran.err);
    place.bad(
        "optimize case.toml",
        3,
        &["contact is open at every load step that the objective observes", "newton.csv"],
    );
    place.write("case.toml", CASE);
    assert_eq!(place.good("solve case.toml --force").err, "");
}

/// Bottom and front of the block as one slave surface: `check` counts the three nodes of the edge
/// between them, and warns if that edge counts as smooth.
#[test]
fn edges_of_slave_surfaces_are_reported() {
    let place = Place::new();
    let nose = "[[surface]]\nname = \"nose\"\nbody = \"block\"\n\
                boxes = [{ min = [-9, 0.9, -9], max = [9, 1.1, 9] }, { min = [1.9, -9, -9], max = [2.1, 9, 9] }]\n";
    let case = CASE.replace("slave = \"block_ymin\"", "slave = \"nose\"") + nose;
    assert!(case.contains("slave = \"nose\""));
    place.write("case.toml", &case);
    let ran = place.good("check case.toml");
    assert!(ran.out.contains("3 nodes of nose lie on edges sharper than 45°"), "{}", ran.out);
    assert!(!ran.err.contains("averaged_normals"), "{}", ran.err);
    let ran = place.good("check case.toml --set contact[0].feature_angle=100");
    for part in ["3 nodes whose averaged normal", "by up to 45°, at node", "[slipstick::case::averaged_normals]"] {
        assert!(ran.err.contains(part), "{part}: {}", ran.err);
    }
    assert!(!ran.out.contains("sharper than"), "{}", ran.out);
}

/// A box outside the slab, and a radius below the distance between two centroids: elements of the
/// slab are 1 × 0.5 × 1.
#[test]
fn settings_without_effect_are_told() {
    let place = Place::with(
        "sensitivity_filter = { radius = 1.2 }",
        "sensitivity_filter = { radius = 0.5 }\npassive_void = [{ min = [90, 0, 0], max = [91, 1, 1] }]",
    );
    let told = place.good("check case.toml").err;
    for part in [
        "the region has no effect: no element of the design bodies has its centroid in it [slipstick::case::empty_passive_region]",
        "the filter has no effect: the closest centroids of neighbouring elements are 0.5 apart [slipstick::case::idle_filter]",
    ] {
        assert!(told.contains(part), "{told}");
    }
    let told = place.good("check case.toml --set design.sensitivity_filter.radius=0.51").err;
    assert!(!told.contains("idle_filter"), "{told}");
    // the top and one end: centroids of the elements at the top lie 0.25 below it, those of the two others at the end 0.5
    // behind it
    let place = Place::with(
        "sensitivity_filter = { radius = 1.2 }",
        "sensitivity_filter = { radius = 1.2 }\npassive_solid = [{ surface = 'skin', within = 0.3 }]\n\
         [[surface]]\nname = 'skin'\nof = ['slab_ymax', 'slab_xmin']\n",
    );
    let told = place.good("check case.toml").err;
    for part in [
        "the skin has gaps: of 10 elements at `skin`, 2 are not in it",
        "no farther away than 0.3",
        "a `within` of 0.5005 closes",
    ] {
        assert!(told.contains(part), "{told}");
    }
    let told =
        place.good("check case.toml --set design.passive_solid[0].within=0.5 --set design.volume_fraction=0.7").err;
    assert!(!told.contains("gaps"), "{told}");
}

/// The objective `contact_force` leaves out forces on prescribed displacements, and `check` names the slave nodes
/// whose forces it misses: 3 of the 9 under a block that is moved at one side.
#[test]
fn slave_nodes_that_the_objective_leaves_out_are_told() {
    let place = Place::new();
    assert!(!place.good("check case.toml").err.contains("leaves out"));
    let told = place.good("check case.toml --set dirichlet[1].set=block_xmin").err;
    for part in [
        "`block_xmin` holds or moves 3 of the 9 nodes of `block_ymin` that face `slab_ymax`: the objective \
         `contact_force` leaves out forces on prescribed displacements",
        "hold nodes outside the contact surface",
    ] {
        assert!(told.contains(part), "{told}");
    }
}

/// Rollers on one plane on both sides of a tie leave the traction along their direction undetermined;
/// a symmetry plane does not, and neither do rollers on different planes, or contact.
#[test]
fn supports_on_both_sides_of_a_pair_are_told() {
    let rollers = "[[dirichlet]]\nset = \"slab_zmin\"\ncomponents = [\"z\"]\n\
                   [[dirichlet]]\nset = \"block_zmin\"\ncomponents = [\"z\"]\n[load_path]";
    let place = Place::with("[load_path]", rollers);
    let contact = place.read("case.toml");
    place.write("tied.toml", &contact.replace("friction = 0.3", "tied = true"));
    let flat = "tied.toml --set dirichlet[1].motion=[{t=1,u=[0,-0.1,0]}]";
    assert!(!place.good(&format!("check {flat}")).err.contains("held_twice"));
    let flush = format!("{flat} --set body[1].box.min=[0.6,1.0,0.0]");
    let told = place.good(&format!("check {flush}")).err;
    for part in [
        "[[dirichlet]] tables hold 3 nodes of `block_ymin` and the nodes of `slab_ymax` on the plane z = 0 along z",
        "use `[[symmetry]]` with `normal = \"z\"` and `at = 0`",
    ] {
        assert!(told.contains(part), "{told}");
    }
    assert!(!place.good(&format!("check {}", flush.replace("tied.toml", "case.toml"))).err.contains("held_twice"));
    let place = Place::with("[load_path]", "[[symmetry]]\nnormal = \"z\"\nat = 0.0\n[load_path]");
    place.write("tied.toml", &place.read("case.toml").replace("friction = 0.3", "tied = true"));
    assert!(!place.good(&format!("check {flush}")).err.contains("held_twice"));
}

/// A table of densities that the case partly replaces, and an initial design above the volume
/// bound. Computed by hand: the upper layer of the slab, 8 of its 16 elements (and of 20 in total),
/// is solid, so half of the slab is already filled.
#[test]
fn passive_elements_are_told() {
    let passive = "passive_solid = [{ min = [0, 0.5, 0], max = [4, 1, 2] }]\n";
    let place = Place::with(
        "initial = 0.5\nvolume_fraction = 0.5",
        &format!("initial = 0.5\nvolume_fraction = 0.6\n{passive}"),
    );
    let start = [
        "case.toml:26:17: warning: the initial design fills 0.75 of the design bodies, more than the bound of 0.6: passive solid \
         elements already fill 0.5, and the designed elements start at 0.5 [slipstick::case::initial_volume]",
        "help: an initial density of 0.2 (`initial`) in the designed elements",
    ];
    for line in ["check case.toml", "optimize case.toml --iterations 1 --out first"] {
        let ran = place.good(line);
        assert!(start.iter().all(|part| ran.err.contains(part)), "{line}: {}", ran.err);
    }
    // other commands do not check the bound, and there is no warning about an initial design below
    // it
    assert_eq!(place.good("solve case.toml").err, "");
    assert_eq!(place.good("check case.toml --set design.initial=0.2").err, "");
    // a filter spreads the solid layer: less is left for the others, and the advice works, also with a projection
    for filter in ["density_filter = { radius = 0.6 }", "density_filter = { radius = 0.6 }\nprojection = {}"] {
        let text = place.read("case.toml").replace("sensitivity_filter = { radius = 1.2 }", filter);
        place.write("blurred.toml", &text);
        let told = place.good("check blurred.toml").err;
        let advice = told.split("an initial density of ").nth(1).and_then(|rest| rest.split(' ').next());
        let advice = advice.expect("advice");
        assert!((0.001..0.2).contains(&number(advice)), "{told}");
        assert_eq!(place.good(&format!("check blurred.toml --set design.initial={advice}")).err, "");
        let more = number(advice) + 0.002;
        assert!(place.good(&format!("check blurred.toml --set design.initial={more}")).err.contains("initial_volume"));
    }
    // 0.3 everywhere except in one passive element, and in one element of the block
    let of = |e: usize| {
        if e == 4 {
            0.9
        } else if e == 17 {
            0.25
        } else {
            0.3
        }
    };
    let rows: Vec<String> = (0..20).map(|e| format!("{e},{}", of(e))).collect();
    place.write("grey.csv", &format!("element,density\n{}\n", rows.join("\n")));
    let expected = "warning: grey.csv: densities of 12 of 20 elements are replaced, because the case prescribes them: 8 \
                    passive solid elements from 0.3 … 0.9 to 1, 4 elements of bodies that are not designed from 0.25 … 0.3 to 1";
    for line in
        ["solve", "gradient", "optimize --iterations 1", "evaluate", "verify gradient --elements 0 --directions 1"]
    {
        let ran = place.good(&format!("{line} case.toml --design grey.csv --out {}_grey", &line[..5]));
        assert!(ran.err.contains(expected), "{line}: {}", ran.err);
    }
    // a design made by this case has the densities that the case prescribes
    assert_eq!(place.good("solve case.toml --design first --out again").err, "");
    // the given initial design counts, not the uniform one: 0.5 + 0.3/2
    let ran = place.good("optimize case.toml --design grey.csv --iterations 1 --out other");
    assert!(
        ran.err.contains("the initial design fills 0.65 of the design bodies") && !ran.err.contains("0.75"),
        "{}",
        ran.err
    );
}

/// Stiffnesses beyond the range of single precision, in which the preconditioner multiplies: its
/// iterations fail, the objective is that of the direct solver, and a warning says what happened.
#[test]
fn a_failed_iterative_solver_is_reported() {
    let stiff = |solver: &str| {
        let text = format!("{CASE}\n[solver]\nlinear = \"{solver}\"\n");
        text.replace("youngs_modulus = 1000.0", "youngs_modulus = 1e40")
    };
    let place = Place::new();
    let [direct, iterative] = ["direct", "schwarz"].map(|solver| {
        place.write(&format!("{solver}.toml"), &stiff(solver));
        place.good(&format!("solve {solver}.toml"))
    });
    let objective = |ran: &Ran| ran.out.lines().find(|line| line.starts_with("objective")).map(str::to_owned);
    assert!(objective(&direct).is_some() && objective(&direct) == objective(&iterative), "{}", iterative.out);
    let told = "warning: the iterative solver failed for";
    assert!(iterative.err.contains(told) && !direct.err.contains(told), "{}", iterative.err);
}
