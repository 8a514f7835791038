//! `slipstick new part.step`.

use std::io::Write as _;

use super::*;

/// A pin of radius 4.95 mm in the bore of a lug, of radius 5 mm: a gap of 0.05 mm. The STEP file is in metres.
const LUG: &str = r#"
import gmsh, re
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
occ.cut([(3, occ.addBox(-0.015, -0.015, 0, 0.03, 0.03, 0.008))], [(3, occ.addCylinder(0, 0, -0.001, 0, 0, 0.01, 0.005))])
occ.addCylinder(0, 0, -0.004, 0, 0, 0.016, 0.00495)
occ.synchronize()
gmsh.write("lug.step")
text = open("lug.step").read().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)")
for number, name in ((1, "my lug"), (2, "pin")):
    text = re.sub(rf"'Open CASCADE STEP translator [0-9. ]*\.{number}'", f"'{name}'", text)
open("Lug.STP", "w").write(text)
"#;

pub(super) fn python() -> String {
    std::env::var("SLIPSTICK_PYTHON").unwrap_or_else(|_| "python3".into())
}

/// Whether Python runs a statement; if not, the test is skipped, and that is said.
pub(super) fn runs(statement: &str) -> bool {
    let found = Command::new(python()).args(["-c", statement]).output().is_ok_and(|output| output.status.success());
    if !found {
        // Print directly to the terminal, because the test harness captures `eprintln!`.
        let _ = writeln!(std::io::stderr(), "SKIPPED: {} does not run `{statement}`", python());
    }
    found
}

/// Runs the program with an environment variable, and expects a failure that says all of `expected`.
fn bad_with(place: &Place, line: &str, (key, value): (&str, &str), expected: &[&str]) {
    let ran = Ran::new(line, place.command(line).env(key, value).output().expect("the program runs"));
    assert_eq!(ran.code, Some(2), "{line}\n{}\n{}", ran.out, ran.err);
    for part in expected {
        assert!(ran.err.contains(part), "{line}: no `{part}` in\n{}", ran.err);
    }
}

/// Bodies, contact, gap and unit come from the file; the case is accepted, also that of the mesh alone.
#[test]
fn a_step_file_becomes_a_case() {
    if !runs("import gmsh") {
        return;
    }
    let place = Place::new();
    place.write("make.py", LUG);
    let made = Command::new(python()).arg("make.py").current_dir(place.path("")).output().expect("Python");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    std::fs::create_dir(place.path("cases")).expect("a folder");
    place.good("new Lug.STP --size 4 --out cases/lug.toml");
    let text = place.read("cases/lug.toml");
    for expected in [
        "length = \"mm\"",
        "elements from (-15, -15, 0) to (15, 15, 8)",
        "elements from (-4.95, -4.95, -4) to (4.95, 4.95, 12)",
        "# pin_touches_my_lug and my_lug_touches_pin have a gap of 0.05.",
        "slave = \"pin_touches_my_lug\"   # the convex side",
        "master = \"my_lug_touches_pin\"",
        "set = \"my_lug_ymin\"",
        "set = \"pin_zmax\"",
    ] {
        assert!(text.contains(expected), "{expected}\n{text}");
    }
    let checked = place.good("check cases/lug.toml").out;
    assert!(checked.contains("no warnings"), "{checked}");
    let script = place.read("cases/lug_mesh.py");
    assert!(script.contains("SIZE = 4.0 ") && script.contains("DISTANCE = None"), "{script}");
    // as after the script has run elsewhere
    place.good("new --mesh cases/lug.msh --out cases/again.toml");
    let again = place.read("cases/again.toml");
    assert!(again.contains("slave = \"pin_touches_my_lug\""), "{again}");
    // nothing is replaced without --force
    place.bad("new Lug.STP --size 4 --out cases/lug.toml", 2, &["lug.toml already exists", "--force"]);
    place.bad("new Lug.STP --out cases/lug.toml", 2, &["already exists"]);
    // a distance below the gap
    let said = place.good("new Lug.STP --size 4 --distance 0.01 --out cases/lug.toml --force").err;
    assert!(said.contains("no faces of two bodies are within 0.01 mm") && said.contains("--distance"), "{said}");
}

/// A prism is meshed with second-order hexahedra (Gmsh's type 12), and with wedges (13) where two edges of a hexahedron
/// would meet at a flat corner on a smooth curve. Its volume is that of the shape, and each surface still consists of
/// the same faces. Any other body gets tetrahedra (11), with a warning.
#[test]
fn prisms_are_meshed_with_hexahedra() {
    if !runs("import gmsh") {
        return;
    }
    const KINDS: &str = r#"
import gmsh
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open("lug.msh")
for _, group in gmsh.model.getPhysicalGroups(3):
    solids = gmsh.model.getEntitiesForPhysicalGroup(3, group)
    kinds = {int(kind) for solid in solids for kind in gmsh.model.mesh.getElements(3, solid)[0]}
    print(gmsh.model.getPhysicalName(3, group), *sorted(kinds))
"#;
    let place = Place::new();
    let ball = LUG.replace("occ.synchronize()", "occ.addSphere(0, 0, 0.022, 0.0099)\nocc.synchronize()");
    place.write("make.py", &ball.replace("(2, \"pin\"))", "(2, \"pin\"), (3, \"ball\"))"));
    place.write("kinds.py", KINDS);
    let run = |script: &str| {
        let ran = Command::new(python()).arg(script).current_dir(place.path("")).output().expect("Python");
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        String::from_utf8_lossy(&ran.stdout).into_owned()
    };
    run("make.py");
    let said = place.good("new Lug.STP --size 4 --hexahedra --out lug.toml").err;
    assert!(
        said.contains("ball reaches its axis of revolution: it gets tetrahedra")
            && !said.contains("lug is")
            && !said.contains("pin is"),
        "{said}"
    );
    let kinds = run("kinds.py");
    for (body, expected) in [("my_lug", vec!["12", "12 13"]), ("pin", vec!["12", "12 13"]), ("ball", vec!["11"])] {
        let found = kinds.lines().find_map(|line| line.strip_prefix(&format!("{body} "))).expect("a body");
        assert!(expected.contains(&found), "{kinds}");
    }
    let checked = place.good("check lug.toml --json").events();
    let result = checked.into_iter().find(|event| event["event"] == "result").expect("a result");
    let pi = std::f64::consts::PI;
    let lug = 30.0 * 30.0 * 8.0 - pi * 25.0 * 8.0;
    let pin = pi * 4.95 * 4.95 * 16.0;
    for (name, volume) in [("my_lug", lug), ("pin", pin)] {
        let bodies = result["inspection"]["bodies"].as_array().expect("bodies");
        let body = bodies.iter().find(|body| body["name"] == name).expect("a body");
        let found = body["volume"].as_f64().expect("a volume");
        assert!((found / volume - 1.0).abs() < 1e-4, "{name}: {found} instead of {volume}");
        // a flat corner has almost none
        assert!(body["quality"].as_f64().expect("a quality") > 0.1, "{body}");
    }
    // The pin's cylinder, in and beyond the bore, its lower end, and a side. Areas are those of the facets: with 40 around
    // a circle (half of a quadratic edge each), that of a cylinder is too small by 1 − sin(π/40)/(π/40), 0.10 %,
    // and that of a disc by 1 − sin(π/20)/(π/20), 0.41 %.
    for (surface, area, facets) in [
        ("pin_touches_my_lug", 2.0 * pi * 4.95 * 16.0, 1.1e-3),
        ("my_lug_touches_pin", 2.0 * pi * 5.0 * 8.0, 1.1e-3),
        ("pin_zmin", pi * 4.95 * 4.95, 4.2e-3),
        ("my_lug_xmin", 30.0 * 8.0, 1e-9),
    ] {
        let surfaces = result["inspection"]["surfaces"].as_array().expect("surfaces");
        let found = surfaces.iter().find(|of| of["name"] == surface).expect("a surface")["area"].as_f64();
        assert!((found.expect("an area") / area - 1.0).abs() < facets, "{surface}: {found:?} instead of {area}");
    }
}

/// A ring with a cone on its rim, a stepped shaft, a quarter of a pipe bend, a box with imprints on a side and on its top, an
/// O-ring and a spacer with holes are swept: no tetrahedra, and no flat elements. Volumes are those of Pappus'
/// theorem.
#[test]
fn bodies_of_revolution_and_imprinted_prisms_are_swept() {
    if !runs("import gmsh") {
        return;
    }
    let place = Place::new();
    place.write(
        "make.py",
        r#"
import gmsh, math
occ = gmsh.model.occ
def write(name):
    occ.synchronize()
    for face in occ.getEntities(2):
        if len(gmsh.model.getAdjacencies(*face)[0]) == 0:
            occ.remove([face], recursive=True)
    occ.synchronize()
    gmsh.write(name + ".step")
    gmsh.clear()
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
points = [occ.addPoint(r, 0, z) for r, z in ((5, 0), (10, 0), (10, 4), (8, 6), (5, 6))]
lines = [occ.addLine(points[i - 1], points[i]) for i in range(5)]
occ.revolve([(2, occ.addPlaneSurface([occ.addCurveLoop(lines)]))], 0, 0, 0, 0, 0, 1, math.tau)
write("ring")
occ.fuse([(3, occ.addCylinder(0, 0, 0, 0, 0, 10, 5))], [(3, occ.addCylinder(0, 0, 10, 0, 0, 6, 3))])
write("shaft")
pipe, _ = occ.cut([(2, occ.addDisk(20, 0, 0, 4, 4))], [(2, occ.addDisk(20, 0, 0, 3, 3))])
occ.rotate(pipe, 20, 0, 0, 1, 0, 0, math.pi / 2)
occ.revolve(pipe, 0, 0, 0, 0, 0, 1, math.pi / 2)
write("bend")
body = occ.addBox(0, 0, 0, 20, 10, 6)
side, top = occ.addRectangle(0, 0, 0, 6, 3), occ.addDisk(15, 5, 6, 2, 2)
occ.rotate([(2, side)], 0, 0, 0, 1, 0, 0, math.pi / 2)
occ.translate([(2, side)], 4, 0, 2)
occ.fragment([(3, body)], [(2, side), (2, top)])
write("box")
occ.addTorus(0, 0, 0, 20, 2)
write("oring")
occ.cut([(3, occ.addCylinder(0, 0, 0, 0, 0, 5, 10))], [(3, occ.addCylinder(0, 0, -1, 0, 0, 7, 6))])
occ.cut(occ.getEntities(3), [(3, occ.addCylinder(8 * math.cos(k), 8 * math.sin(k), -1, 0, 0, 7, 1)) for k in range(6)])
write("spacer")
"#,
    );
    let made = Command::new(python()).arg("make.py").current_dir(place.path("")).output().expect("Python");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let pi = std::f64::consts::PI;
    // the area of the profile times the way of its centroid: 5 × 6 minus the corner of 2 × 2 / 2 at radius 10 − 2/3
    let ring = 2.0 * pi * (30.0 * 7.5 - 2.0 * (10.0 - 2.0 / 3.0));
    let shaft = pi * (25.0 * 10.0 + 9.0 * 6.0);
    let bend = pi * (16.0 - 9.0) * 20.0 * pi / 2.0;
    let (seal, spacer) = (2.0 * pi * pi * 20.0 * 4.0, pi * 5.0 * (100.0 - 36.0 - 6.0));
    let all = [("ring", ring), ("shaft", shaft), ("bend", bend), ("box", 1200.0), ("oring", seal), ("spacer", spacer)];
    for (name, volume) in all {
        let said = place.good(&format!("new {name}.step --hexahedra")).err;
        assert!(!said.contains("tetrahedra"), "{name}: {said}");
        // beside a hole, Gmsh divides a quadrangle by the wrong diagonal, which is noticed
        assert_eq!(
            said.contains("overlapping hexahedra in part: swept bodies get wedges"),
            name == "spacer",
            "{name}: {said}"
        );
        let checked = place.good(&format!("check {name}.toml --json")).events();
        let result = checked.into_iter().find(|event| event["event"] == "result").expect("a result");
        let body = &result["inspection"]["bodies"][0];
        let found = body["volume"].as_f64().expect("a volume");
        assert!((found / volume - 1.0).abs() < 3e-4, "{name}: {found} instead of {volume}");
        assert!(body["quality"].as_f64().expect("a quality") > 0.1, "{name}: {body}");
    }
}

/// Of many faces, the largest have names of their own, and the others one name together.
#[test]
fn small_faces_have_one_name() {
    if !runs("import gmsh") {
        return;
    }
    let place = Place::new();
    place.write(
        "make.py",
        r#"
import gmsh
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
bores = [(3, occ.addCylinder(10 * i, 0, -1, 0, 0, 6, 1 + 0.1 * i)) for i in range(5)]
occ.cut([(3, occ.addBox(-5, -5, 0, 50, 10, 4))], bores)
occ.synchronize()
gmsh.write("strip.step")
"#,
    );
    let run = |script: &str| {
        let ran = Command::new(python()).arg(script).current_dir(place.path("")).output().expect("Python");
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    };
    run("make.py");
    place.good("new strip.step --size 4");
    let script = place.read("strip_mesh.py");
    assert!(script.contains("\nNAMED = 100\n"));
    place.write("strip_mesh.py", &script.replace("NAMED = 100", "NAMED = 3"));
    run("strip_mesh.py");
    place.good("new --mesh strip.msh --out again.toml");
    let checked = place.good("check again.toml --json").events();
    let result = checked.into_iter().find(|event| event["event"] == "result").expect("a result");
    let surfaces = result["inspection"]["surfaces"].as_array().expect("surfaces");
    let area =
        |name: &str| surfaces.iter().find(|of| of["name"] == name).map(|of| of["area"].as_f64().expect("an area"));
    // bores of radius 1.2, 1.3 and 1.4; those of 1 and 1.1 together. At least 36 facets around each are at most
    // 1 − sin(π/36)/(π/36) = 0.13 % too small
    let pi = std::f64::consts::PI;
    for (name, radius) in [("part_bore_1", 1.2), ("part_bore_2", 1.3), ("part_bore_3", 1.4), ("part_other", 2.1)] {
        let (found, expected) = (area(name).expect(name), 2.0 * pi * radius * 4.0);
        assert!((found / expected - 1.0).abs() < 1.3e-3, "{name}: {found} instead of {expected}");
    }
    assert_eq!(area("part_bore_4"), None);
}

/// Without Gmsh or Python, the script stays, and the error says what to do.
#[test]
fn a_step_file_needs_gmsh() {
    let place = Place::new();
    place.write("part.step", "ISO-10303-21;\nEND-ISO-10303-21;\n");
    let expected =
        ["there is no program `/nowhere/python`", "pip install gmsh", "SLIPSTICK_PYTHON", "new --mesh part.msh"];
    bad_with(&place, "new part.step", ("SLIPSTICK_PYTHON", "/nowhere/python"), &expected);
    assert!(place.read("part_mesh.py").contains("STEP = \"part.step\""));
    if !runs("import sys") {
        return;
    }
    std::fs::create_dir(place.path("lacking")).expect("a folder");
    place.write("lacking/gmsh.py", "raise ImportError(\"No module named 'gmsh'\")\n");
    let folder = place.path("lacking").display().to_string();
    let expected = ["No module named 'gmsh'", "-m pip install gmsh", "run part_mesh.py where it is installed"];
    bad_with(&place, "new part.step", ("PYTHONPATH", &folder), &expected);
    assert!(!place.path("part.toml").exists() && !place.path("part.msh").exists());
}

/// Files and options that cannot be used.
#[test]
fn wrong_step_files_are_refused() {
    let place = Place::new();
    place.bad("new nothing.step", 2, &["cannot read the STEP file nothing.step", "check its name"]);
    place.write("empty.stp", "");
    place.bad("new empty.stp", 2, &["empty.stp is empty", "AP203"]);
    place.write("mesh.STEP", "$MeshFormat\n");
    place.bad("new mesh.STEP", 2, &["is not a STEP file", "ISO-10303-21"]);
    place.bad("new mesh.STEP --mesh a.msh", 2, &["a STEP file cannot be combined with --mesh"]);
    place.bad("new half-ball --size 2", 2, &["--size, --distance and --hexahedra are for STEP files"]);
    place.bad("new mesh.STEP --size 0", 2, &["greater than zero"]);
    if runs("import gmsh") {
        place.write("none.step", "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n");
        place.bad("new none.step", 2, &["none.step", "help: "]);
        place.write("half.step", "ISO-10303-21;\nHEADER;\n");
        place.bad("new half.step", 2, &["half.step", "help: "]);
    }
}
