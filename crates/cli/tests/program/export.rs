//! Designs as surfaces.

use super::*;

/// Triangles of a binary STL file by the bits of their corners (80 bytes, a count, 50 bytes each:
/// normal, three corners).
fn triangles(bytes: &[u8]) -> Vec<[[u32; 3]; 3]> {
    let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let corner = |t: usize, c: usize| std::array::from_fn(|k| word(84 + 50 * t + 12 + 12 * c + 4 * k));
    assert_eq!(bytes.len(), 84 + 50 * word(80) as usize);
    (0..word(80) as usize).map(|t| std::array::from_fn(|c| corner(t, c))).collect()
}

/// The surface as a program that reads STL sees it: points are equal if their bits are equal, and
/// every edge occurs once in each direction. The volume is that of the design's table.
#[test]
fn the_design_as_a_closed_surface() {
    let place = Place::new();
    // Densities that differ strongly between neighbours, as at the end of an optimization.
    let rows: Vec<String> = (0..20).map(|e| format!("{e},{}", [1.0, 0.9, 0.02, 0.1, 1.0][e % 5])).collect();
    place.write("start.csv", &format!("element,density\n{}\n", rows.join("\n")));
    place.good("optimize case.toml --design start.csv --iterations 1 -q");
    let ran = place.good("export case --json").event("result");
    assert_eq!(ran["files"][0], "case/design.stl");
    let bytes = std::fs::read(place.path("case/design.stl")).expect("written");
    let triangles = triangles(&bytes);
    assert_eq!(ran["triangles"], triangles.len());
    let mut edges = std::collections::HashSet::new();
    for t in &triangles {
        for k in 0..3 {
            assert!(edges.insert((t[k], t[(k + 1) % 3])), "an edge twice in one direction");
        }
    }
    assert!(edges.iter().all(|(a, b)| edges.contains(&(*b, *a))), "an edge without its other side");
    // Elements of the slab measure 1 × 1/2 × 1.
    let table = place.table("case/design.csv");
    let sum: f64 = table[1..17].iter().map(|row| 0.5 * number(&row[2])).sum();
    let volume = |name: &str| ran[name].as_f64().expect("a number");
    assert!((volume("density_volume") / sum - 1.0).abs() < 1e-12);
    assert!((volume("volume") / sum - 1.0).abs() < 0.05, "{ran}");

    // A new run removes the surface of the old one; other files are not touched unless requested.
    place.good("export case --obj a.obj --vtu a.vtu --threshold 0.3 --smooth 0 --iteration 0 --body slab");
    assert!(place.read("a.obj").starts_with("# slipstick") && place.path("a.vtu").exists());
    place.good("export case --3mf a.3mf");
    let archive = std::fs::read(place.path("a.3mf")).expect("written");
    assert!(archive.starts_with(b"PK\x03\x04") && archive.len() > 1000);
    place.good("export case");
    place.bad("export case --obj a.obj", 2, &["a.obj already exists", "--force"]);
    place.good("export case --obj a.obj --force --keep-surfaces false");
    place.good("optimize case.toml -q --force --iterations 1");
    assert!(!place.path("case/design.stl").exists());
}

#[test]
fn what_cannot_be_exported() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 1 -q");
    place.bad("export case --threshold 1", 2, &["no density is above 1", "threshold below"]);
    place.bad("export case --iteration 0", 2, &["no threshold preserves the volume", "--threshold"]);
    place.bad("export case --iteration 7", 2, &["design_0007.vtu", "was not written", "available iterations: 0 to 1"]);
    place.bad("export case --body plate", 2, &["no body `plate`", "slab, block"]);
    place.bad("export case --threshold 2", 2, &["auto or a number from 0 to 1"]);
    place.bad("export case --stl design.obj", 2, &["design.obj does not end in .stl"]);
    let case = place.read("case/case.toml").replacen("[[body]]", "[units]\nlength = \"furlong\"\n[[body]]", 1);
    place.write("miles.toml", &case);
    place.good("optimize miles.toml --iterations 1 -q");
    place.bad("export miles --threshold 0.4 --3mf a.3mf", 2, &["3MF has no unit `furlong`", "[units] length"]);
    place.bad(
        "export case --threshold 0.1 --stl no/a.stl",
        2,
        &["cannot write no/a.stl", "create the folder no first"],
    );
    place.bad("export nowhere", 2, &["there is no run.json in nowhere"]);
    std::fs::remove_file(place.path("case/design.csv")).expect("there");
    place.bad("export case", 2, &["there is no design.csv in case"]);
}

/// Solid bottom or top elements of the slab, and all of the block.
fn layers(bottom: f64, top: f64) -> String {
    let density = |e: usize| if e < 16 { [bottom, top][e / 4 % 2] } else { 1.0 };
    let rows: Vec<String> = (0..20).map(|e| format!("{e},{}", density(e))).collect();
    format!("element,density\n{}\n", rows.join("\n"))
}

/// The slab of 4 × 1 × 2 unit hexahedra in Gmsh's format, with the groups that the part's case
/// names: what Gmsh would write, but simpler.
fn slab_mesh() -> String {
    let node = |x: usize, y: usize, z: usize| 1 + x + 5 * (y + 2 * z);
    let mut nodes = String::new();
    for (z, y, x) in (0..3).flat_map(|z| (0..2).flat_map(move |y| (0..5).map(move |x| (z, y, x)))) {
        nodes += &format!("{} {x} {y} {z}\n", node(x, y, z));
    }
    let mut elements: Vec<String> = Vec::new();
    for (z, x) in (0..2).flat_map(|z| (0..4).map(move |x| (z, x))) {
        let at = |y: usize| [node(x, y, z), node(x + 1, y, z), node(x + 1, y, z + 1), node(x, y, z + 1)];
        let text = |nodes: &[usize]| nodes.iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
        elements.push(format!("5 2 1 1 {} {}", text(&at(1)), text(&at(0))));
        elements.push(format!("3 2 2 2 {}", text(&at(0))));
        elements.push(format!("3 2 3 3 {}", text(&at(1))));
    }
    let lines: String = (1..).zip(&elements).map(|(k, line)| format!("{k} {line}\n")).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n3 1 \"slab\"\n2 2 \"slab_ymin\"\n2 3 \"slab_ymax\"\n\
         $EndPhysicalNames\n$Nodes\n30\n{nodes}$EndNodes\n$Elements\n{}\n{lines}$EndElements\n",
        elements.len()
    )
}

/// From a design to its part: the case has the promises of the run, and `solve` and `report` compare
/// them with a run of the part. A mesh of hexahedra stands in for that of Gmsh.
#[test]
fn a_part_and_its_promises() {
    let place = Place::new();
    place.write("start.csv", &layers(1.0, 0.9));
    // half-way up the slab, where the part's mesh has no nodes
    let unused = "[[set]]\nname = \"middle\"\nbody = \"slab\"\nboxes = [{ min = [0, 0.5, 0], max = [4, 0.5, 2] }]\n";
    place.write("case.toml", &place.read("case.toml").replacen("[[contact]]", &format!("{unused}[[contact]]"), 1));
    // a bound that neither the design nor its part meets, of a smooth measure
    let bound = "[[quantity]]\nname = \"peak\"\ncontact_pressure = { slave = \"block_ymin\", measure = \"peak\" }\n\
                 [[constraint]]\nquantity = \"peak\"\nmax = 1.5\n";
    place.write("case.toml", &place.read("case.toml").replacen("[objective]", &format!("{bound}[objective]"), 1));
    place.good("solve case.toml --design start.csv --out case -q");
    let ran = place.good("export case --case part --threshold 0.5 --size 0.5 --measure --json");
    assert!(!place.read("part/case.toml").contains("middle"));
    let told = place.good("export case --case part --threshold 0.5 --size 0.5 --force");
    assert!(told.err.contains("the design violates a bound: `peak_extreme` is "), "{}", told.err);
    let told = told.out;
    assert!(told.contains("`middle` left out of the part's case: nothing uses it"), "{told}");
    let part = ran.event("part");
    let body = &part["part"]["bodies"][0];
    assert_eq!((&body["name"], &body["pieces"]), (&"slab".into(), &1.into()));
    assert!((body["volume"].as_f64().expect("a number") / 8.0 - 1.0).abs() < 1e-12, "{body}");
    assert_eq!(body["faces"]["slab_ymax"]["share"], 1.0);
    // all of the slab of 4 × 1 × 2 is above the threshold, so it is 1 thick and has no gap
    let measures = ran.event("measures");
    assert!((measures["member"]["length"].as_f64().expect("a number") - 1.0).abs() < 1e-12, "{measures}");
    assert_eq!(measures["member"], part["part"]["measures"]["member"]);
    let alone = place.good("export case --threshold 0.5 --measure --json --stl alone.stl").event("measures");
    assert_eq!(measures["member"], alone["member"]);
    assert!(measures["gap"].is_null() && place.path("case/measures.json").exists());
    assert!(!place.path("case/design.stl").exists(), "only the part was requested");
    let script = place.read("part/mesh.py");
    assert!(script.contains("\"slab_ymax\": [") && script.contains("slab_surface.msh"), "{script}");
    assert!(place.read("part/slab_surface.msh").starts_with("$MeshFormat\n2.2 0 8\n"));
    let case = place.read("part/case.toml");
    assert!(case.contains("[[promise]]") && !case.contains("[design"), "{case}");
    place.bad("check part/case.toml", 2, &["slab_part.msh"]);
    place.bad("export case --case part", 2, &["part/case.toml already exists", "--force"]);

    // the load path of an optimization that was stopped may be that of an earlier design
    place.good("optimize case.toml -q --iterations 1 --out stopped");
    let promises = |what: &str| {
        place.good(&format!("export stopped --case {what} --threshold 0.1 --size 0.5"));
        place.read(&format!("{what}/case.toml")).matches("[[promise]]").count()
    };
    assert!(promises("finished") > 0);
    place.write("stopped/run.json", &place.read("stopped/run.json").replace("\"finished\"", "\"interrupted\""));
    assert_eq!(promises("interrupted"), 0);

    place.write("part/slab_part.msh", &slab_mesh());
    place.good("check part/case.toml");
    let ran = place.good("solve part/case.toml --json");
    let all = ran.event("promises")["promises"].clone();
    let (design, part) = (place.table("case/quantities.csv"), place.table("part/case_solve/quantities.csv"));
    let value = |table: &[Vec<String>], name: &str| {
        let column = table[0].iter().position(|column| column == name).expect("the column");
        number(&table.last().expect("rows")[column])
    };
    let names: Vec<&str> = all.as_array().expect("a list").iter().filter_map(|of| of["quantity"].as_str()).collect();
    for needed in ["block_ymin_normal_force", "reaction_slab_ymin_y", "strain_energy"] {
        assert!(names.contains(&needed), "{names:?}");
    }
    for of in all.as_array().expect("a list") {
        let name = of["quantity"].as_str().expect("a name");
        let [promised, found, deviation] =
            ["promised", "found", "deviation"].map(|key| of[key].as_f64().expect("a number"));
        assert_eq!((promised, found), (value(&design, name), value(&part, name)), "{name}");
        assert!((deviation - (found / promised - 1.0)).abs() < 1e-12, "{name}");
    }
    let told = place.good("solve part/case.toml --force");
    let warned = "the part violates a bound, as did the design: `peak_extreme` is ";
    assert!(told.err.contains(warned) && told.err.contains("beyond ≤ 1.5"), "{}", told.err);
    let told = told.out;
    assert!(told.contains("compared with what the design promised:") && told.contains(" %"), "{told}");
    assert!(told.contains("≤ 1.5, violated"), "{told}");
    place.good("report part/case_solve");
    let html = place.read("part/case_solve/report.html");
    assert!(html.contains("\"promise\":{\"columns\":[\"quantity\",\"design\",\"part\",\"deviation\",\"bound\"]"));
    place.good("report case");
    assert!(place.read("case/report.html").contains("thinnest member"));
}

/// What acts per area on a face of which a part is missing shrinks with it, and a contact face may be lost: both are
/// said. An export that replaces another one removes its mesh, and bounds at other steps are named.
#[test]
fn a_face_that_is_partly_missing() {
    let place = Place::new();
    let bound = "[[quantity]]\nname = \"reaction\"\nreaction = { set = \"slab_ymin\", component = \"y\" }\n\
                 [[constraint]]\nquantity = \"reaction\"\nmax = 50.0\nsteps = \"all\"\n\
                 [[load]]\nsurface = \"slab_ymax\"\npressure = 0.01\n\
                 [[quantity]]\nname = \"least\"\ncontact_pressure = { slave = \"slab_ymax\", measure = \"minimum\" }\n";
    place.write("case.toml", &place.read("case.toml").replacen("[objective]", &format!("{bound}[objective]"), 1));
    let sides = "slave = \"block_ymin\"\nmaster = \"slab_ymax\"";
    let exchanged = "slave = \"slab_ymax\"\nmaster = \"block_ymin\"";
    place.write("case.toml", &place.read("case.toml").replacen(sides, exchanged, 1));
    // the bottom, and half of the top layer along x
    let solid = |e: usize| e >= 16 || (e / 4).is_multiple_of(2) || e % 4 < 2;
    let rows: Vec<String> = (0..20).map(|e| format!("{e},{}", f64::from(u8::from(solid(e))))).collect();
    place.write("start.csv", &format!("element,density\n{}\n", rows.join("\n")));
    place.good("solve case.toml --design start.csv --out case -q");
    let told = place.good("export case --case part --threshold 0.5 --size 0.5");
    for expected in [
        "% of `slab_ymax` is left, and a pressure acts there per area",
        "unlike that of a `force`",
        "% of `slab_ymax` is left, and quantities of the case measure pressure or gap there",
        "a solid skin there (`[[design.passive_solid]]`",
    ] {
        assert!(told.err.contains(expected), "{}", told.err);
    }
    // the block ends where the material does
    assert!(
        told.out.contains("of the contact face `slab_ymax` is left, with 100.0 % of its contact force"),
        "{}",
        told.out
    );
    // the bound at all steps, with the worst value of the design
    let promised = place.read("part/case.toml");
    let table = place.table("case/quantities.csv");
    let column = table[0].iter().position(|name| name == "reaction").expect("the quantity");
    let worst = table[1..].iter().map(|row| number(&row[column])).fold(f64::NEG_INFINITY, f64::max);
    let of_all = promised.split("[[promise]]").find(|one| one.contains("steps = \"all\"")).expect("a promise");
    assert!(of_all.contains("max = 50.0") && of_all.contains(&format!("{worst:?}")), "{of_all}\n{worst}");
    place.write("part/slab_part.msh", "of an earlier design");
    place.good("export case --case part --threshold 0.5 --size 0.5 --force");
    assert!(!place.path("part/slab_part.msh").exists());
    // the block on material below the threshold
    let below = |e: usize| if e < 16 && (e / 4) % 2 == 1 { [0.4, 1.0][usize::from(e % 4 > 1)] } else { 1.0 };
    let rows: Vec<String> = (0..20).map(|e| format!("{e},{}", below(e))).collect();
    place.write("start.csv", &format!("element,density\n{}\n", rows.join("\n")));
    place.good("solve case.toml --design start.csv --out case -q --force");
    let told = place.good("export case --case below --threshold 0.5 --size 0.5 --smooth 0").err;
    let lost = told
        .lines()
        .find_map(|line| line.strip_prefix("warning: ")?.split_once(" % of the contact force on `slab_ymax`"));
    let (lost, rest) = lost.unwrap_or_else(|| panic!("{told}"));
    // the isosurface ends at x = 4/3; nodes are numbered along x, y and z
    let fields = slipstick::output::read_fields(&place.path("case/path_0004.vtu")).expect("fields");
    let forces = &fields.iter().find(|field| field.name == "contact_force").expect("a field").values;
    let force =
        |i: usize, k: usize| forces[3 * (i + 5 * (2 + 3 * k))..].iter().take(3).map(|f| f * f).sum::<f64>().sqrt();
    let up_to = |last: usize| (0..=last).flat_map(|i| (0..3).map(move |k| force(i, k))).sum::<f64>();
    assert!((number(lost) - 100.0 * up_to(1) / up_to(4)).abs() < 0.051 && number(lost) > 10.0, "{told}");
    assert!(rest.contains("path_0004.vtu"), "{told}");
    let record = place.read("below/part.json");
    let record: Value = serde_json::from_str(&record).expect("a record");
    let kept = record["bodies"][0]["faces"]["slab_ymax"]["contact_force"].as_f64().expect("a share");
    assert!((100.0 * (1.0 - kept) - number(lost)).abs() < 0.051, "{record}");
}

#[test]
fn what_is_no_part() {
    let place = Place::new();
    place.write("start.csv", &layers(0.0, 1.0));
    place.good("solve case.toml --design start.csv --out case -q");
    place.bad("export case --case part", 2, &["no material is left on `slab_ymin`", "support", "passive_solid"]);
    assert!(!place.path("part").exists());
    // a corner of one element is above the threshold
    place.write("start.csv", &layers(0.0, 1.0).replace("\n0,0\n", "\n0,0.52\n"));
    place.good("solve case.toml --design start.csv --out corner -q");
    let err = place.good("export corner --case sliver --threshold 0.5 --smooth 0").err;
    assert!(err.contains("% of `slab_ymin`, which a support or motion needs, is left"), "{err}");
    place.bad("export case --case case --threshold 0.5 --force", 2, &["case holds a run", "another folder"]);
    for shared in [".", ".."] {
        let told = [&*format!("{shared} is no folder of its own"), "--case part"];
        place.bad(&format!("export case --case {shared} --threshold 0.5 --force"), 2, &told);
        place.bad(&format!("export case --deck {shared} --force"), 2, &["is no folder of its own", "--deck deck"]);
    }
    let record = place.read("case/run.json");
    place.write("case/run.json", &record[..record.len() / 2]);
    place.bad("export case --case part --threshold 0.5", 2, &["run.json", "is not the record of a run"]);
    place.write("case/run.json", &record);
    std::fs::create_dir(place.path("other")).expect("a new folder");
    std::fs::copy(place.path("case.toml"), place.path("other/case.toml")).expect("a copy");
    place.bad("export case --case other --threshold 0.5 --force", 2, &["case.toml is not the case of a part"]);
    place.bad("export case --case fine --threshold 0.5 --size 1e-4", 2, &["would have about", "give --size "]);
    assert!(place.read("case/case.toml").contains("[objective]"));
    place.bad("export case --size 1", 2, &["--case"]);
    place.bad("export case --case part --size 0", 2, &["a positive number"]);
    place.bad("export case --case part --size -1", 2, &["a positive number"]);
    // without quantities there is nothing to promise
    place.write("start.csv", &layers(1.0, 1.0));
    place.good("solve case.toml --design start.csv --out case -q --force");
    std::fs::remove_file(place.path("case/quantities.csv")).expect("there");
    let err = place.good("export case --case part --threshold 0.5").err;
    assert!(err.contains("no quantities of this design"), "{err}");
    // nothing is removed, so the body keeps its mesh, and there is nothing to mesh
    let told = place.good("export case --case whole --threshold 0.5").out;
    assert!(told.contains("part slab: solid everywhere, so it keeps its mesh") && !told.contains("gmsh"), "{told}");
    assert!(!place.path("whole/mesh.py").exists());
    place.good("solve whole/case.toml");
}

/// A load path as a result file of CalculiX: the blocks of the last state against the fields of its VTU file,
/// whose reader has its own tests. (CGX 2.20 reads such a file without a complaint.)
#[test]
fn a_load_path_as_a_result_file() {
    let place = Place::new();
    place.good("solve case.toml --out run -q");
    let told = place.good("export run --frd run.frd").out;
    assert!(told.contains("run.frd with 4 states"), "{told}");
    let text = place.read("run.frd");
    assert_eq!(text.matches("\n -4  DISP        4    1\n").count(), 4);
    let fields = slipstick::output::read_fields(&place.path("run/path_0004.vtu")).expect("fields");
    let field = |name: &str| &fields.iter().find(|field| field.name == name).expect("a field").values;
    let block = |name: &str, components: usize| -> Vec<f64> {
        let start = text.rfind(&format!("\n -4  {name} ")).expect("a block");
        let rows = text[start..].lines().skip(2).skip_while(|line| line.starts_with(" -5"));
        let values = |row: &str| -> Vec<f64> {
            (0..components).map(|c| row[13 + 12 * c..25 + 12 * c].trim().parse().expect("a number")).collect()
        };
        rows.take_while(|line| line.starts_with(" -1")).flat_map(values).collect()
    };
    let close = |found: &[f64], expected: &[f64]| {
        let size = expected.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
        assert_eq!(found.len(), expected.len());
        assert!(size > 0.0 && found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-5 * size));
    };
    close(&block("DISP", 3), field("displacement"));
    close(&block("FORC", 3), field("reaction"));
    let contact = block("CONTACT", 2);
    close(&contact.iter().skip(1).step_by(2).copied().collect::<Vec<_>>(), field("contact_pressure"));
    place.bad("export run --frd run.frd", 2, &["run.frd already exists", "--force"]);
    place.bad("export run --frd run.vtu", 2, &["does not end in .frd"]);
    place.bad("export run --frd other.frd --stl a.stl", 2, &["cannot be used with"]);
    std::fs::create_dir(place.path("empty")).expect("a new folder");
    place.bad("export empty --frd other.frd", 2, &["empty"]);
}
