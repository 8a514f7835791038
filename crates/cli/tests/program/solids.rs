//! `slipstick export --step`, read by Open CASCADE.

use std::f64::consts::PI;

use super::step::{python, runs};
use super::*;

/// A ring of radii 3 and 6 mm and height 4 mm, about the y axis, with 3 × 96 × 4 elements.
const RING: &str = r#"
[units]
length = "mm"
[[body]]
name = "ring"
hollow_cylinder = { height = 4.0, inner_radius = 3.0, outer_radius = 6.0, elements = [3, 96, 4] }
material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[dirichlet]]
set = "ring_bottom"
[[dirichlet]]
set = "ring_top"
motion = [{ t = 1.0, u = [0, -0.001, 0] }]
[load_path]
steps = 1
[design]
bodies = ["ring"]
initial = 0.5
volume_fraction = 0.5
[[quantity]]
name = "load"
reaction = { set = "ring_top", component = [0, -1, 0] }
[objective]
maximise = { quantity = "load" }
"#;

/// Reads a STEP file, heals and meshes it; prints the numbers before and after healing, and the volume of the mesh.
const READ: &str = r#"
import collections, gmsh, json, sys
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
def seen():
    occ.synchronize()
    return {"entities": [len(gmsh.model.getEntities(d)) for d in range(4)],
            "volumes": [occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3)],
            "areas": sorted([gmsh.model.getType(2, tag), occ.getMass(2, tag)] for _, tag in gmsh.model.getEntities(2)),
            "names": [gmsh.model.getEntityName(3, tag) for _, tag in gmsh.model.getEntities(3)]}
gmsh.logger.start()
occ.importShapes(sys.argv[1])
read = seen()
occ.healShapes([], 1e-7)
healed = seen()
said = [line for line in gmsh.logger.get() if line.startswith(("Error", "Warning"))]
box = gmsh.model.getBoundingBox(-1, -1)
gmsh.option.setNumber("Mesh.MeshSizeMax", (box[3] - box[0]) / 12)
gmsh.model.mesh.generate(3)
tags, _ = gmsh.model.mesh.getElementsByType(4)
mesh = float(sum(gmsh.model.mesh.getElementQualities(tags, "volume")))
print(json.dumps({"read": read, "healed": healed, "mesh": mesh, "said": said}))
"#;

/// What Open CASCADE finds in a file.
fn read(place: &Place, file: &str) -> Value {
    place.write("read.py", READ);
    let output =
        Command::new(python()).args(["read.py", file]).current_dir(place.path("")).output().expect("Python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("numbers")
}

/// Healing changes nothing, reading and healing say nothing, and the body has this volume.
fn assert_valid(found: &Value, volume: f64, tolerance: f64) {
    assert_eq!(found["read"]["entities"], found["healed"]["entities"], "healing changes the solid");
    assert_eq!(found["said"].as_array().map(Vec::len), Some(0), "{}", found["said"]);
    let of = |when: &str| found[when]["volumes"][0].as_f64().expect("a number");
    let volumes = of("read");
    assert!((volumes / of("healed") - 1.0).abs() < 1e-9, "healing changes the volume");
    assert!((volumes / volume - 1.0).abs() < tolerance, "{volumes} instead of {volume}");
    let mesh = found["mesh"].as_f64().expect("a number");
    assert!((mesh / volume - 1.0).abs() < 0.02, "{mesh} instead of {volume}");
}

/// Solves the ring with the elements that are `solid` by their numbers across the wall, around and along the axis.
fn solve(place: &Place, solid: impl Fn([usize; 3]) -> bool) {
    let line = |e: usize| format!("{e},{}\n", u8::from(solid([e % 3, e / 3 % 96, e / 288])));
    let lines: String = (0..1152).map(line).collect();
    place.write("start.csv", &format!("element,density\n{lines}"));
    place.good("solve ring.toml --design start.csv --out ring -q --force");
}

/// The whole ring is exact: volume π (6² − 3²) 4 and area of the bore 2π 3 · 4; the surface of the part is not.
#[test]
fn a_ring_is_exact() {
    if !runs("import gmsh") {
        return;
    }
    let place = Place::new();
    place.write("ring.toml", RING);
    solve(&place, |_| true);
    let told = place.good("export ring --step ring.step --threshold 0.5 --size 0.5").out;
    assert!(told.contains("1 solid: 2 plane faces, 4 on cylinders") && told.contains("0 facets"), "{told}");
    let found = read(&place, "ring.step");
    assert_valid(&found, PI * 27.0 * 4.0, 1e-6);
    assert_eq!(found["read"]["names"][0], "Shapes/ring");
    let areas = found["read"]["areas"].as_array().expect("a list");
    let of = |kind: &str| -> f64 { areas.iter().filter(|a| a[0] == kind).filter_map(|a| a[1].as_f64()).sum() };
    assert!((of("Cylinder") / (PI * 18.0 * 4.0) - 1.0).abs() < 1e-6, "{areas:?}");
    assert!((of("Plane") / (PI * 27.0 * 2.0) - 1.0).abs() < 1e-6, "{areas:?}");
    // in metres, a thousand times as large
    place.write("ring.toml", &RING.replace("length = \"mm\"", "length = \"m\""));
    solve(&place, |_| true);
    place.good("export ring --step ring.stp --threshold 0.5 --size 0.5");
    assert_valid_volume(&read(&place, "ring.stp"), PI * 27.0 * 4.0 * 1e9);
}

/// A disc of radius 8 and height 2 mm with a hub of radius 3 and height 6, and a fillet of radius 1 between them, with a
/// name for each face.
const HUB: &str = r#"
import gmsh
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
body, _ = occ.fuse([(3, occ.addCylinder(0, 0, 0, 0, 0, 2, 8))], [(3, occ.addCylinder(0, 0, 0, 0, 0, 6, 3))])
occ.synchronize()
def at(curve):
    box = gmsh.model.getBoundingBox(1, curve)
    return abs(box[3] - 3) < 0.01 and abs(box[2] - 2) < 0.01 and abs(box[5] - 2) < 0.01
body = occ.fillet([body[0][1]], [curve for _, curve in gmsh.model.getEntities(1) if at(curve)][:1], [1])
occ.synchronize()
gmsh.model.addPhysicalGroup(3, [body[0][1]], name="hub")
for _, face in gmsh.model.getBoundary(body, oriented=False):
    box = gmsh.model.getBoundingBox(2, face)
    gmsh.model.addPhysicalGroup(2, [face], name="lower" if box[5] < 1 else "upper" if box[2] > 5 else f"face_{face}")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.8)
gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 20)
gmsh.model.mesh.generate(3)
gmsh.write("hub.msh")
"#;

/// A fillet that touches a plane and a cylinder is a torus of radii 4 and 1 about the axis. By Pappus, its area is 2π times the
/// first moment of a quarter of a circle, 4 · π/2 − 1, and its volume that of a square without a quarter of a circle.
#[test]
fn a_fillet_is_exact() {
    if !runs("import gmsh") {
        return;
    }
    let place = Place::new();
    place.write("make.py", HUB);
    let made = Command::new(python()).arg("make.py").current_dir(place.path("")).output().expect("Python");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let body = RING.lines().find(|line| line.starts_with("hollow_cylinder")).expect("a body");
    let case = RING.replace(body, "mesh = { file = \"hub.msh\" }").replace("name = \"ring\"", "name = \"hub\"");
    let case =
        case.replace("[\"ring\"]", "[\"hub\"]").replace("ring_bottom", "hub_lower").replace("ring_top", "hub_upper");
    place.write("hub.toml", &case);
    place.good("solve hub.toml --set design.initial=1.0 --set design.volume_fraction=1.0 --out hub -q");
    let told = place.good("export hub --step hub.step --threshold 0.5");
    assert!(told.out.contains("0 facets") && !told.err.contains("as facets"), "{}\n{}", told.out, told.err);
    let found = read(&place, "hub.step");
    let fillet = 2.0 * PI * (3.5 - PI / 4.0 * (4.0 - 4.0 / (3.0 * PI)));
    assert_valid(&found, PI * (64.0 * 2.0 + 9.0 * 4.0) + fillet, 1e-6);
    let areas = found["read"]["areas"].as_array().expect("a list");
    let torus: f64 = areas.iter().filter(|area| area[0] == "Torus").filter_map(|area| area[1].as_f64()).sum();
    assert!((torus / (2.0 * PI * (2.0 * PI - 1.0)) - 1.0).abs() < 1e-6, "{areas:?}");
}

fn assert_valid_volume(found: &Value, volume: f64) {
    let read = found["read"]["volumes"][0].as_f64().expect("a number");
    assert!((read / volume - 1.0).abs() < 1e-6, "{read} instead of {volume}");
}

/// Facets of the cut end at the exact cylinders and planes.
#[test]
fn facets_end_at_exact_surfaces() {
    if !runs("import gmsh") {
        return;
    }
    let place = Place::new();
    place.write("ring.toml", RING);
    // a step all around, and a hole through the wall
    solve(&place, |[_, around, along]| along == 0 || (around + 8 * along < 60 && !(20..28).contains(&around)));
    let ran = place.good("export ring --step cut.step --threshold 0.5 --size 0.5 --json").event("result");
    let facets = ran["step"]["facets"].as_u64().expect("a number");
    assert!(facets > 20 && ran["step"]["curved_as_facets"] == 0, "{ran}");
    let found = read(&place, "cut.step");
    // chords of 3.75° have 0.07 % less area than their circle
    assert_valid(&found, ran["step"]["bodies"][0]["volume"].as_f64().expect("a number"), 1e-3);
    let areas = found["read"]["areas"].as_array().expect("a list");
    assert!(areas.iter().filter(|area| area[0] == "Cylinder").count() >= 4, "{areas:?}");
}

/// Beside a part, whose surface it takes, the STEP file is the same as alone.
#[test]
fn a_step_file_beside_a_part_is_the_same() {
    let place = Place::new();
    place.write("ring.toml", RING);
    solve(&place, |[_, around, along]| along == 0 || around < 60);
    place.good("export ring --step alone.step --threshold 0.5 --size 0.8");
    place.good("export ring --step beside.step --case part --threshold 0.5 --size 0.8");
    let (alone, beside) = (place.read("alone.step"), place.read("beside.step"));
    assert!(alone == beside, "{} and {} bytes", alone.len(), beside.len());
}

#[test]
fn what_cannot_be_a_step_file() {
    let place = Place::new();
    place.write("ring.toml", &RING.replace("length = \"mm\"", "length = \"furlong\""));
    solve(&place, |_| true);
    place.bad("export ring --step a.step", 2, &["STEP has no unit `furlong`", "[units] length"]);
    place.bad("export ring --step a.stl", 2, &["a.stl does not end in .step", "--step"]);
    place.bad("export ring --step a.step --keep-surfaces false", 2, &["outer faces", "omit --keep-surfaces"]);
    place.bad("export ring --size 1", 2, &["--size is for --case and --step"]);
}
