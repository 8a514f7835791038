//! Picked faces, forms and exports.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::*;

/// Corners of the faces of a surface that the model marks, as points of its page.
fn faces(page: &str, name: &str) -> Vec<u32> {
    let data = report::data(page);
    let mark = data["marks"].as_array().expect("marks").iter().find(|mark| mark["name"] == name).expect("marked");
    let bytes = STANDARD.decode(mark["quads"].as_str().expect("faces")).expect("base64");
    bytes.as_chunks::<4>().0.iter().map(|four| u32::from_le_bytes(*four)).collect()
}

fn body(points: &[u32]) -> String {
    serde_json::json!(points).to_string()
}

/// The hash of the saved text of a case.
fn stamp(served: &Served, case: &str) -> String {
    served.get(&format!("case?case={case}")).json()["stamp"].as_str().expect("a stamp").to_owned()
}

/// The text that the server proposes selects, in the program's own check, the area of the picked faces.
#[test]
fn picked_faces_become_tables() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    let pick = format!("pick?case=case.toml&stamp={}", stamp(&served, "case.toml"));
    // before there is a model
    let early = served.post(&format!("{pick}&name=top"), "[0,1,2,3]");
    assert!(early.status == 400 && early.body.contains("no longer in memory"), "{}", early.body);
    let model = served.get("model?case=case.toml");
    let top = faces(&model.body, "slab_ymax");
    // a whole face has a name
    let found = served.post(&format!("{pick}&name=top"), &body(&top)).json();
    let named = serde_json::json!(["slab_ymax"]);
    assert_eq!((&found["surfaces"], &found["known"], &found["added"]), (&named, &true.into(), &"".into()));
    // what it is used for is added
    let used = served.post(&format!("{pick}&name=top&use=pressure&sure=true"), &body(&top)).json();
    assert_eq!(used["added"], "[[load]]\nsurface = \"slab_ymax\"\npressure = 1.0\n");
    // one face of it has none
    let one = &top[..4];
    let found = served.post(&format!("{pick}&name=corner&use=support&degrees=20&sure=true"), &body(one)).json();
    let (added, text) = (found["added"].as_str().expect("text"), found["text"].as_str().expect("text"));
    assert!(added.starts_with("[[surface]]\nname = \"corner\"\nbody = \"slab\"\nboxes = ["), "{found}");
    assert!(added.ends_with("[[dirichlet]]\nset = \"corner\"\n"), "{found}");
    assert_eq!(text, format!("{}\n\n{added}", CASE.trim_end()));
    assert_eq!(place.read("case.toml"), CASE, "nothing is written");
    place.write("picked.toml", text);
    let out = place.good("check picked.toml --json").out;
    let lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let all = lines.iter().find_map(|line| line["inspection"]["surfaces"].as_array()).expect("surfaces");
    let corner = all.iter().find(|of| of["name"] == "corner").expect("the new surface");
    assert_eq!(corner["facets"], 1, "{corner}");
    // the page names the text whose model it shows: a later one, or that of another page, is not the model's
    let finer = CASE.replace("elements = [4, 2, 2]", "elements = [8, 2, 2]");
    let later = served.post("check?case=case.toml", &finer).json()["stamp"].as_str().expect("a stamp").to_owned();
    for stamp in ["", &*later] {
        let late = served.post(&format!("pick?case=case.toml&name=top&stamp={stamp}"), &body(&top));
        assert!(late.status == 400 && late.body.contains("not that of the text"), "{}", late.body);
    }
    assert_eq!(served.post(&format!("{pick}&name=top"), &body(&top)).status, 200);
    // the model that another page has loaded meanwhile
    let top = faces(&served.get("model?case=case.toml").body, "slab_ymax");
    assert_eq!(served.post(&format!("{pick}&name=top"), &body(&top)).status, 400);
    assert_eq!(served.post(&format!("pick?case=case.toml&name=top&stamp={later}"), &body(&top)).status, 200);
}

/// Faces of two bodies become a contact pair; the slave has the smaller facets: those of the block measure 0.7 × 0.65, of the
/// slab 1 × 1.
#[test]
fn two_picked_faces_become_a_contact_pair() {
    let place = Place::new();
    let without = CASE.replace("[[contact]]\nslave = \"block_ymin\"\nmaster = \"slab_ymax\"\nfriction = 0.3\n", "");
    // the view shows faces that the case uses
    let loads =
        ["slab_ymax", "block_ymin"].map(|of| format!("[[load]]\nsurface = \"{of}\"\npressure = 1.0\n")).concat();
    place.write(
        "case.toml",
        &without
            .split("[design]")
            .next()
            .expect("the load path")
            .replace("[load_path]", &format!("{loads}[load_path]")),
    );
    let served = Served::new(&place, "case.toml");
    let pick = format!("pick?case=case.toml&name=touch&use=contact&stamp={}", stamp(&served, "case.toml"));
    let model = served.get("model?case=case.toml");
    let (top, bottom) = (faces(&model.body, "slab_ymax"), faces(&model.body, "block_ymin"));
    // named faces need no tables; the order of picking does not matter
    for points in [[&*top, &*bottom].concat(), [&*bottom, &*top].concat()] {
        let found = served.post(&format!("{pick}&sure=true"), &body(&points)).json();
        assert_eq!(found["surfaces"], serde_json::json!(["block_ymin", "slab_ymax"]), "{found}");
        let added = "[[contact]]\nslave = \"block_ymin\"   # smaller facets\nmaster = \"slab_ymax\"\nfriction = 0.2\n";
        assert_eq!(found["added"], added);
    }
    // parts of faces get tables; the program accepts the case
    let found = served.post(&format!("{pick}&sure=true"), &body(&[&top[..4], &bottom[..4]].concat())).json();
    let (added, text) = (found["added"].as_str().expect("text"), found["text"].as_str().expect("text"));
    assert!(
        added.contains("name = \"touch_slave\"\nbody = \"block\"") && added.contains("name = \"touch_master\""),
        "{added}"
    );
    place.write("picked.toml", text);
    let out = place.run("check picked.toml").out;
    assert!(out.contains("touch_slave") && out.contains("touch_master"), "{out}");
    // one body has no second side
    let one = served.post(&pick, &body(&top));
    assert!(one.status == 400 && one.body.contains("picked are those of `slab`"), "{}", one.body);
}

/// The slave deforms, although the facets of the rigid body are smaller.
#[test]
fn a_rigid_body_becomes_the_master() {
    let place = Place::new();
    let head = CASE.split("[[contact]]").next().expect("bodies");
    let (slab, block) = head.split_once("name = \"block\"").expect("two bodies");
    let rigid = block.lines().filter(|line| !line.starts_with("material")).collect::<Vec<_>>().join("\n");
    place.write(
        "case.toml",
        &format!(
            "{slab}name = \"block\"{rigid}\nrigid = {{}}\n[[load]]\nsurface = \"slab_ymax\"\npressure = 1.0\n\
             [[dirichlet]]\nset = \"slab_ymin\"\n[[dirichlet]]\nset = \"block\"\n[[contact]]\n\
             slave = \"slab_xmin\"\nmaster = \"block_ymin\"\nfriction = 0.2\n[load_path]\nsteps = 1\n"
        ),
    );
    let served = Served::new(&place, "case.toml");
    let model = served.get("model?case=case.toml");
    let points = [faces(&model.body, "block_ymin"), faces(&model.body, "slab_ymax")].concat();
    let pick = format!("pick?case=case.toml&name=touch&use=contact&stamp={}", stamp(&served, "case.toml"));
    let found = served.post(&pick, &body(&points)).json();
    assert_eq!(found["surfaces"], serde_json::json!(["slab_ymax", "block_ymin"]), "{found}");
    assert!(found["added"].as_str().is_some_and(|text| text.contains("# the master is rigid")), "{found}");
}

/// Two pages edit one case: each gets the model of its own text.
#[test]
fn pages_have_texts_of_their_own() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    let finer = CASE.replace("elements = [4, 2, 2]", "elements = [8, 2, 2]");
    served.post("check?case=case.toml&page=a", &finer);
    served.post("check?case=case.toml&page=b", CASE);
    let elements = |page: &str| {
        report::data(&served.get(&format!("model?case=case.toml&page={page}")).body)["model"]["bodies"][0]["hexes"]
            .clone()
    };
    assert_eq!((elements("a"), elements("b")), (serde_json::json!([0, 32]), serde_json::json!([0, 16])));
    // the file of a page that has checked nothing
    assert_eq!(elements("c"), serde_json::json!([0, 16]));
    // the text of a page is forgotten after those of many others; another model is not shown instead
    let checked = served.post("check?case=case.toml&page=a", &finer).json()["stamp"].clone();
    let of_a = format!("model?case=case.toml&page=a&stamp={}", checked.as_str().expect("a stamp"));
    assert_eq!(served.get(&of_a).status, 200);
    for page in 0..16 {
        served.post(&format!("check?case=case.toml&page=other{page}"), CASE);
    }
    let late = served.get(&of_a);
    assert!(late.status == 409 && late.body.contains("no longer in memory"), "{}", late.body);
    // unless the saved file has this text
    place.write("case.toml", &finer);
    assert_eq!(served.get(&of_a).status, 200);
}

/// A table after a list in one line would be no TOML.
#[test]
fn tables_that_the_text_cannot_take_are_refused() {
    let inline = "load = [{ surface = \"block_ymax\", pressure = 1.0 }]\n";
    let place = Place::new();
    place.write("case.toml", &format!("{inline}{CASE}"));
    let served = Served::new(&place, "case.toml");
    let top = faces(&served.get("model?case=case.toml").body, "slab_ymax");
    let pick = format!("pick?case=case.toml&name=top&stamp={}", stamp(&served, "case.toml"));
    for sure in [false, true] {
        let answer = served.post(&format!("{pick}&use=force&sure={sure}"), &body(&top));
        assert!(answer.status == 400 && answer.body.contains("`load` is an inline list"), "{}", answer.body);
    }
    assert_eq!(served.post(&format!("{pick}&use=support&sure=true"), &body(&top[..4])).status, 200);
}

#[test]
fn what_is_no_pick_is_refused() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    let top = body(&faces(&served.get("model?case=case.toml").body, "slab_ymax"));
    let known = stamp(&served, "case.toml");
    for (query, points, part) in [
        ("name=top", "[]", "no face is picked"),
        ("name=top", "[0,1,2]", "no faces of the model"),
        ("name=top", "[0,1,2,4000000000]", "no faces of the model"),
        ("name=top", "[0,0,0,0]", "no faces of the model"),
        ("name=top", "[-1]", "not a list of numbers"),
        ("name=top", "x", "not a list of numbers"),
        ("name=", &*top, "not a name of a surface"),
        ("name=a%22b", &*top, "not a name of a surface"),
        ("name=top&use=weight", &*top, "there is no use"),
    ] {
        let answer = served.post(&format!("pick?case=case.toml&stamp={known}&{query}"), points);
        assert!(answer.status == 400 && answer.body.contains(part), "{query} {points}: {}", answer.body);
    }
    // a deck has no tables for them
    let deck = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,3,4,5,6,7,8\n*NSET,NSET=ALL,GENERATE\n1,8\n*MATERIAL,NAME=M\n*ELASTIC\n1000,0.3\n*SOLID SECTION,ELSET=E,MATERIAL=M\n*STEP\n*STATIC\n*BOUNDARY\nALL,1,3\n*END STEP\n";
    place.write("cube.inp", deck);
    let model = served.get("model?case=cube.inp");
    assert_eq!(model.status, 200, "{}", model.body);
    let answer = served.post(&format!("pick?case=cube.inp&name=top&stamp={}", stamp(&served, "cube.inp")), "[0,1,2,3]");
    assert!(answer.status == 400 && answer.body.contains("deck = \\\"cube.inp\\\""), "{}", answer.body);
}

/// A field changes one value of the text that it is given, and writes nothing.
#[test]
fn forms_change_single_values() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    let schema = served.get("schema").json();
    let written: Value = serde_json::from_str(&place.good("schema").out).expect("JSON");
    assert_eq!(schema, written);
    let values = served.post("values", CASE).json();
    let friction =
        values.as_array().expect("a list").iter().find(|of| of["path"] == "contact[0].friction").expect("there");
    assert_eq!((&friction["kind"], &friction["text"]), (&"number".into(), &"0.3".into()));
    let edit = |text: &str, path: &str, value: Option<&str>| {
        let mut body = serde_json::json!({ "text": text, "path": path });
        if let Some(value) = value {
            body["value"] = value.into();
        }
        served.post("edit", &body.to_string())
    };
    let edited = edit(CASE, "contact[0].friction", Some("0.25")).json();
    assert_eq!(edited["text"], CASE.replace("friction = 0.3", "friction = 0.25"));
    // a key is removed with its line; one that is not there cannot be
    let removed = edit(CASE, "contact[0].friction", None).json();
    assert_eq!(removed["text"], CASE.replace("friction = 0.3\n", ""));
    assert_eq!(edit(CASE, "contact[0].tied", None).status, 400);
    // a value may be longer than the head of a request
    let long = format!("\"{}\"", "x".repeat(100_000));
    let edited = edit(CASE, "title", Some(&long));
    assert!(edited.status == 200 && edited.json()["text"].as_str().is_some_and(|text| text.contains(&long)));
    for body in ["", "[]", "{}", "{\"text\":1,\"path\":\"a\"}", "{\"text\":\"\",\"path\":\"a\",\"value\":1}"] {
        assert_eq!(served.post("edit", body).status, 400, "{body}");
    }
    let wrong = edit(CASE, "contact[3].friction", Some("0.25"));
    assert!(wrong.status == 400 && wrong.body.contains("contact has 1 entry"), "{}", wrong.body);
    assert_eq!(edit("a = ", "a", Some("1")).status, 400);
    assert_eq!(place.read("case.toml"), CASE);
}

/// What is exported, and what is made of a deck, are commands like others.
#[test]
fn exports_and_new_cases_are_commands() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    served.done("command=optimize&case=case.toml");
    for (kind, to) in [("vtu", "case.vtu"), ("stl", "case.stl"), ("deck", "case_deck")] {
        let state = served.done(&format!("command=export&run=case&kind={kind}"));
        let job = &state["job"];
        assert_eq!(
            (&job["code"], &job["line"]),
            (&0.into(), &format!("slipstick export case --{kind} {to}").into()),
            "{state}"
        );
        assert!(place.path(to).exists());
    }
    // a STEP file of another program is not what an export replaces; one of this program is
    place.write("case.step", "ISO-10303-21;\nHEADER;\nFILE_NAME('','',(''),(''),'','CAD','');\nENDSEC;\n");
    let line = |query: &str| served.done(&format!("command=export&run=case&kind=step{query}"))["job"]["line"].clone();
    assert_eq!(line("&force=true"), "slipstick export case --step case_optimized.step --force");
    assert!(place.read("case.step").contains("'CAD'"));
    std::fs::copy(place.path("case_optimized.step"), place.path("case.step")).expect("copied");
    assert_eq!(line(""), "slipstick export case --step case.step");
    // nor is that from which the case was made, even if this program has written it
    place.write("case_mesh.py", "STEP = \"case.step\"\n");
    assert_eq!(line("&force=true"), "slipstick export case --step case_optimized.step --force");
    place.write("case_mesh.py", "STEP = \"other.step\"\n");
    assert_eq!(line("&force=true"), "slipstick export case --step case.step --force");
    for name in ["case.step", "case_optimized.step"] {
        place.write(name, "ISO-10303-21;\nHEADER;\nFILE_NAME('','',(''),(''),'','CAD','');\nENDSEC;\n");
    }
    let refused = served.post("start?command=export&run=case&kind=step&force=true", "");
    assert!(refused.status == 400 && refused.body.contains("case_optimized.step is a file of"), "{}", refused.body);
    assert!(place.read("case_optimized.step").contains("'CAD'"));
    // existing files are only replaced if this is asked for
    assert_eq!(served.done("command=export&run=case&kind=vtu")["job"]["code"], 2);
    assert_eq!(served.done("command=export&run=case&kind=vtu&force=true")["job"]["code"], 0);
    for query in
        ["export&run=case&kind=rm", "export&run=nothing&kind=vtu", "new&case=case.toml", "new&case=..%2Fa.step"]
    {
        assert_eq!(served.post(&format!("start?command={query}"), "").status, 400, "{query}");
    }
    // a case of the deck, whose runs and logs differ from those of the deck
    std::fs::copy(place.path("case_deck/model.inp"), place.path("model.inp")).expect("copied");
    let state = served.done("command=new&case=model.inp");
    assert_eq!(
        (&state["job"]["code"], &state["job"]["line"]),
        (&0.into(), &"slipstick new --deck model.inp".into()),
        "{state}"
    );
    assert_eq!(served.get("folder").json()["cases"], serde_json::json!(["case.toml", "model.inp", "model.toml"]));
    let run = |case: &str| served.done(&format!("command=solve&case={case}"))["job"]["run"].clone();
    assert_eq!((run("model.inp"), run("model.toml")), ("model_inp_solve".into(), "model_solve".into()));
}

#[test]
fn step_files_are_offered() {
    let place = Place::new();
    place.write("part.step", "ISO-10303-21;\n");
    let served = Served::new(&place, "part.step");
    let folder = served.get("folder").json();
    assert_eq!((&folder["step"], &folder["steps"]), (&"part.step".into(), &serde_json::json!(["part.step"])));
    // whether Gmsh is installed or not, the command says what is wrong with this file
    let state = served.done("command=new&case=part.step");
    assert_eq!(state["job"]["line"], "slipstick new part.step");
    assert_eq!(state["job"]["code"], 2, "{state}");
    let state = served.done("command=new&case=part.step&hexahedra=true&force=true");
    assert_eq!(state["job"]["line"], "slipstick new part.step --hexahedra --force");
}

/// The view of a run without its tables, for two side by side; and its objective as the case states it.
#[test]
fn views_of_runs_are_served() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    served.done("command=optimize&case=case.toml");
    let view = served.get("report?run=case&view=true");
    assert!(view.status == 200 && view.head.contains("sandbox allow-scripts"), "{}", view.head);
    assert_eq!(report::data(&view.body)["view_only"], true);
    let run = served.get("state?run=case").json()["run"].clone();
    assert_eq!(run["objective"]["maximized"], true, "{run}");
}
