//! Web pages of runs: their data and, if a browser is installed, their appearance in it.

use super::*;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// The data that the page gives its scripts.
pub(crate) fn data(html: &str) -> Value {
    let start = "<script id=\"data\" type=\"application/json\">";
    let text = html.split(start).nth(1).and_then(|rest| rest.split("</script>").next()).expect("the data");
    serde_json::from_str(text).expect("JSON, in which NaN cannot be")
}

/// Everything that could make a browser contact another machine.
fn assert_alone(html: &str) {
    let without = html.replace("http://www.w3.org/2000/svg", "");
    for address in ["http:", "https:", "url(", "import(", "fetch(", "<link", "src=\"/", "src=\"."] {
        assert!(!without.contains(address), "{address}");
    }
    assert!(html.contains("default-src 'none'"), "and forbids it");
}

/// `check` and the report list the regions of a body with several materials. Elements of the slab measure
/// 1 × 1/2 × 1.
#[test]
fn materials_of_sections() {
    let place = Place::new();
    let section = "[[body.section]]\nregion = { min = [0, 0, 0], max = [2, 1, 2] }\n\
                   material = { neo_hooke = { youngs_modulus = 4000.0, poisson_ratio = 0.3 } }\n[[body]]\nname = \"block\"";
    let case = place.read("case.toml");
    assert!(case.contains("[[body]]\nname = \"block\""), "{case}");
    place.write("case.toml", &case.replacen("[[body]]\nname = \"block\"", section, 1));
    let told = place.good("check case.toml").out;
    assert!(
        told.contains("materials of bodies with sections") && told.contains("box from [0, 0, 0] to [2, 1, 2]"),
        "{told}"
    );
    let sections = place.good("check case.toml --json").event("result")["inspection"]["sections"].clone();
    assert_eq!(sections[0]["region"], "elsewhere");
    assert!((sections[0]["volume"].as_f64().expect("a number") - 4.0).abs() < 1e-12, "{sections}");
    assert_eq!((&sections[1]["body"], &sections[1]["elements"]), (&"slab".into(), &8.into()));
    place.good("solve case.toml -q --out case");
    place.good("report case");
    let rows = data(&place.read("case/report.html"))["results"]["materials"]["rows"].clone();
    assert_eq!(
        (&rows[1][1], &rows[1][2], &rows[1][3]),
        (&"box from [0, 0, 0] to [2, 1, 2]".into(), &8.into(), &"4".into())
    );
    assert!(rows[1][4].as_str().is_some_and(|material| material.contains("4000")), "{rows}");
}

#[test]
fn a_run_as_a_page() {
    let case = CASE.replace("Block on slab", "Block </script> & @DATA@");
    let place = Place::new();
    place.write("case.toml", &case);
    place.good("optimize case.toml -q");
    let told = place.good("report case --json").event("result");
    assert_eq!((&told["designs"], &told["steps"]), (&3.into(), &5.into()));
    let html = place.read("case/report.html");
    assert_eq!(told["bytes"], html.len());
    assert_alone(&html);
    assert!(html.contains("<title>Block &lt;/script&gt; &amp; @DATA@</title>"));
    let data = data(&html);
    assert_eq!((&data["title"], &data["case_text"]), (&"Block </script> & @DATA@".into(), &case.as_str().into()));
    // 45 nodes of the slab and 18 of the block; 16 elements of the slab and 4 of the block
    let length = |name: &str| data["model"][name].as_str().map(|text| text.trim_end_matches('=').len() * 3 / 4);
    assert_eq!(length("points"), Some(12 * (45 + 18)));
    assert_eq!((length("hexes"), length("quads"), length("slaves")), (Some(32 * 20), Some(0), Some(4 * 9)));
    let numbers = |list: &str| -> Vec<u64> {
        data[list].as_array().expect("a list").iter().filter_map(|frame| frame["number"].as_u64()).collect()
    };
    assert_eq!((numbers("designs"), numbers("steps")), (vec![0, 2, 4], vec![0, 1, 2, 3, 4]));
    assert_eq!(data["steps"][2]["time"], 0.5);
    // the page rounds the stresses of the file to 1/65535 of their range
    let fields = slipstick::output::read_fields(&place.path("case/path_0004.vtu")).expect("fields");
    let expected = &fields.iter().find(|field| field.name == "von_mises_stress").expect("stresses").values;
    let packed = &data["steps"][4]["stress"];
    let (low, step) = (packed["low"].as_f64().expect("low"), packed["step"].as_f64().expect("step"));
    let codes = STANDARD.decode(packed["data"].as_str().expect("text")).expect("base64");
    assert_eq!((codes.len(), expected.len()), (2 * 20, 20));
    assert!(expected.iter().all(|stress| *stress > 0.0));
    for (code, stress) in codes.as_chunks::<2>().0.iter().zip(expected.iter()) {
        assert!((low + step * f64::from(u16::from_le_bytes(*code)) - stress).abs() <= 0.5001 * step, "{stress}");
    }
    let history = place.table("case/history.csv");
    assert_eq!(data["history"]["rows"].as_array().map(Vec::len), Some(5));
    assert_eq!(data["history"]["rows"][4][1].as_f64(), Some(number(&history[5][1])));
    assert_eq!(data["newton"]["step"], serde_json::json!([1, 2, 3, 4]));
    let last = history[5].clone();
    let counted: u64 = data["newton"]["iterations"].as_array().expect("a list").iter().filter_map(Value::as_u64).sum();
    assert_eq!(counted as f64, number(&last[7]), "Newton iterations of the last design");

    place.bad("report case --out case/history.csv", 2, &["history.csv already exists", "--force"]);
    place.good("report case --out page.html");
    place.good("report case --out page.html --force");
    place.good("optimize case.toml -q --force --iterations 1");
    assert!(!place.path("case/report.html").exists(), "a new run takes its page away");
    place.bad("report nowhere", 2, &["there is no run.json in nowhere"]);
}

/// The page is written again after iterations and, without the reload, at the end.
#[test]
fn a_page_follows_a_run() {
    let place = Place::new();
    let mut run = place.command("optimize case.toml -q --iterations 12").spawn().expect("it runs");
    while !place.path("case/history.csv").is_file() {
        assert!(run.try_wait().expect("known").is_none(), "the run ended before it could be followed");
        std::thread::sleep(Duration::from_millis(5));
    }
    let events = place.good("report case --follow --json").events();
    assert!(run.wait().expect("it ends").success());
    let (last, pages) = events.split_last().expect("events");
    assert!(!pages.is_empty() && pages.iter().all(|event| event["event"] == "page"), "{events:?}");
    assert_eq!(last["event"], "result");
    let data = data(&place.read("case/report.html"));
    assert_eq!(data["history"]["rows"].as_array().map(Vec::len), Some(13));
    assert!(data["reload"].is_null());
}

/// While a run goes on, its page shows the load path of an earlier design, and says of which; steps of another design
/// do not mix with it.
#[test]
fn a_page_names_the_design_of_its_load_path() {
    let place = Place::new();
    place.good("optimize case.toml -q --iterations 2");
    let page = || {
        place.good("report case");
        data(&place.read("case/report.html"))
    };
    assert!(page()["path_of"].is_null());
    let names = [0, 1, 2, 3, 4].map(|step| format!("case/path_{step:04}.vtu"));
    let before = names.each_ref().map(|name| std::fs::read(place.path(name)).expect("read"));
    place.good("resume case -q --iterations 3");
    assert!(page()["path_of"].is_null());
    for (name, bytes) in names.iter().zip(&before).take(3) {
        std::fs::write(place.path(name), bytes).expect("written");
    }
    let data = page();
    assert_eq!(data["path_of"], "the design of iteration 2");
    let steps: Vec<&Value> = data["steps"].as_array().expect("steps").iter().map(|step| &step["number"]).collect();
    assert_eq!(steps, [0, 1, 2]);
    let notes = data["notes"].to_string();
    assert!(notes.contains("2 load steps of an earlier design left out"), "{notes}");
    assert!(notes.contains("contact forces are those of the design of iteration 2."), "{notes}");
}

/// A run that stopped in iteration 4, whose load path is that of iteration 2: each number says which design it
/// belongs to, and no chart is that of the unfinished iteration.
#[test]
fn a_page_of_an_interrupted_run_names_iterations() {
    let place = Place::new();
    place.good("optimize case.toml -q --iterations 2");
    let names: Vec<String> = (0..=4).map(|step| format!("case/path_{step:04}.vtu")).collect();
    let before: Vec<Vec<u8>> = names.iter().map(|name| std::fs::read(place.path(name)).expect("read")).collect();
    place.good("resume case -q --iterations 3");
    for (name, bytes) in names.iter().zip(&before) {
        std::fs::write(place.path(name), bytes).expect("written");
    }
    let newton = place.read("case/newton.csv");
    let last = newton.lines().last().expect("a row");
    let unfinished = last.replacen("3,", "4,", 1);
    assert!(last.starts_with("3,") && unfinished.starts_with("4,"), "{last}");
    place.write("case/newton.csv", &format!("{newton}{unfinished}\n"));
    place.good("report case");
    let data = data(&place.read("case/report.html"));
    assert_eq!(data["origin"], serde_json::json!({ "newest": 3, "path": 2 }));
    assert_eq!(data["newton"]["what"], " of iteration 2");
    let counted: u64 = data["newton"]["iterations"].as_array().expect("a list").iter().filter_map(Value::as_u64).sum();
    assert_eq!(counted as f64, number(&place.table("case/history.csv")[3][7]), "Newton iterations of iteration 2");
    let rows = data["results"]["rows"].to_string();
    assert!(rows.contains("objective θ, iteration 3 [") && rows.contains("material in slab, iteration 3 ["), "{rows}");
}

/// Every kind of run has a page, with its results.
#[test]
fn pages_of_other_runs() {
    let place = Place::new();
    place.good("solve case.toml");
    place.good("gradient case.toml");
    place.good("verify gradient case.toml --elements 1 --directions 1 --halvings 1");
    place.good("evaluate case.toml --design case_solve --friction 0,0.2");
    let page = |run: &str| {
        place.good(&format!("report {run}"));
        data(&place.read(&format!("{run}/report.html")))
    };
    assert_eq!(page("case_solve")["steps"].as_array().map(Vec::len), Some(5));
    assert!(page("case_gradient")["designs"][0]["derivative"].is_object());
    let verify = page("case_verify")["verify"].clone();
    assert!(verify["verdict"].as_str().is_some_and(|text| text.starts_with("Confirmed")), "{verify}");
    assert_eq!(verify["rows"].as_array().map(Vec::len), Some(2));
    assert_eq!(page("case_evaluate")["evaluate"]["rows"][1][0], 0.2);
    // A run that failed says so first.
    let case = CASE.replace("steps = 4", "steps = 1\nmax_newton_iterations = 1\nmax_cutbacks = 0");
    place.write("case.toml", &case);
    place.run("solve case.toml --out failed");
    let failed = page("failed");
    assert!(
        failed["notes"][0].as_str().is_some_and(|note| note.starts_with("The run failed: load step 1 failed: ")),
        "{failed:#}"
    );
}

/// A block is pressed by a force, without friction: by equilibrium, the contact force equals the
/// load. Half of the slab's volume of 8 is material.
#[test]
fn the_page_shows_forces_and_material() {
    let place = Place::new();
    let pressed = CASE
        .replace("motion = [{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.2, -0.1, 0.05] }]", "components = [\"x\", \"z\"]")
        .replace("friction = 0.3", "friction = 0.0")
        .replace("[load_path]", "[[load]]\nsurface = \"block_ymax\"\nforce = [0, -40, 0]\namplitude = [{ t = 0.5, factor = 1.25 }, { t = 1, factor = 1 }]\n[load_path]")
        .replace("title", "units = { length = \"mm\", force = \"N\" }\ntitle");
    place.write("case.toml", &pressed);
    place.good("optimize case.toml --iterations 1 -q");
    let rows = place.table("case/contact.csv");
    assert_eq!(rows.len(), 1 + 5, "the start and four steps");
    for (row, force) in rows[1..].iter().zip([0.0, 25.0, 50.0, 45.0, 40.0]) {
        // across the load, the block is held
        assert!((number(&row[5]) - force).abs() < 1e-6 && number(&row[7]) >= force - 1e-6, "{row:?}");
        // at least the mean over the block's lower face
        assert!(number(&row[8]) >= force / (1.4 * 1.3) - 1e-9, "{row:?}");
    }
    place.good("report case");
    let results = data(&place.read("case/report.html"))["results"].clone();
    let rows: Vec<&Value> = results["rows"].as_array().expect("rows").iter().collect();
    assert_eq!(rows[0][0], "objective θ [N]");
    // the chart shows what is maximized, and grows with it
    assert_eq!(
        (&results["title"], &results["negated"]),
        (&"Sum of the contact forces [N] (maximized)".into(), &true.into())
    );
    assert_eq!(rows[1][0], "material in slab [mm³]");
    assert!(
        rows[1][1]
            .as_str()
            .is_some_and(|text| text.ends_with("; the bound is 0.5") && text.contains(" of 8, a fraction of 0."))
    );
    assert!(
        results["objective"]
            .as_str()
            .is_some_and(|text| text.contains("magnitudes of the nodal contact forces, friction included"))
    );
    let pair = &results["contact"]["rows"][0];
    assert_eq!((&pair[0], &pair[1]), (&"block_ymin on slab_ymax".into(), &4.into()));
    assert!(pair[2].as_str().is_some_and(|vector| vector.contains(",\u{a0}40,\u{a0}")), "{pair}");
    assert!(
        pair[4].as_str().is_some_and(|largest| largest.starts_with("50.") && largest.ends_with(" at step 2")),
        "{pair}"
    );
    // a run without a path still has a page
    place.good("gradient case.toml -q");
    place.good("report case_gradient");
    assert!(data(&place.read("case_gradient/report.html"))["results"].is_null());
}

/// The block is pressed by a force in two load cases, without friction: by equilibrium, the contact force equals the
/// load, which rises in four equal steps.
pub(crate) fn pressed() -> Place {
    let place = Place::new();
    let loads = "[[load_case]]\nname = \"light\"\n[[load_case]]\nname = \"heavy\"\n\
                 [[load]]\nload_case = \"light\"\nsurface = \"block_ymax\"\nforce = [0, -40, 0]\n\
                 [[load]]\nload_case = \"heavy\"\nsurface = \"block_ymax\"\nforce = [0, -80, 0]\n\
                 [[quantity]]\nname = \"hold\"\ncontact_force = { slave = \"block_ymin\", component = \"y\" }\n\
                 [[quantity]]\nname = \"amount\"\nvolume = { body = \"slab\" }\n\
                 [[constraint]]\nquantity = \"hold\"\nmin = 50\nmax = 100\n\
                 [[constraint]]\nquantity = \"amount\"\nmax = 1e4\n[load_path]";
    let pressed = CASE
        .replace(
            "motion = [{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.2, -0.1, 0.05] }]",
            "components = [\"x\", \"z\"]",
        )
        .replace("friction = 0.3", "friction = 0.0")
        .replace("[load_path]", loads)
        .replace("title", "units = { length = \"mm\", force = \"N\" }\ntitle");
    place.write("case.toml", &pressed);
    place
}

/// 40 misses 50 by 20 %. The slab has half of its volume of 8.
#[test]
fn the_page_shows_quantities_and_bounds() {
    let place = pressed();
    place.good("solve case.toml -q");
    place.good("report case_solve");
    let data = data(&place.read("case_solve/report.html"));
    let table = &data["results"]["quantities"];
    assert_eq!(
        table["columns"],
        serde_json::json!([
            "quantity",
            "load case",
            "at its last step",
            "smallest on the path",
            "largest on the path",
            "bound"
        ])
    );
    assert_eq!(
        table["rows"],
        serde_json::json!([
            [
                "hold [N]",
                "light",
                "40",
                "10 at step 1",
                "40 at step 4",
                "✓ ≤ 100; ✗ ≥ 50: violated by 20.00 % at step 4"
            ],
            ["hold [N]", "heavy", "80", "20 at step 5", "80 at step 8", "✓ ≤ 100; ✓ ≥ 50"],
            ["amount [mm³]", "", "4", "", "", "✓ ≤ 10000"],
        ])
    );
    // a run that does not bound anything has no such column, and one without quantities no table
    place.write(
        "case.toml",
        &CASE.replace("[load_path]", "[[quantity]]\nname = \"work\"\nexternal_work = {}\n[load_path]"),
    );
    place.good("solve case.toml -q --force");
    place.good("report case_solve");
    let data = self::data(&place.read("case_solve/report.html"));
    assert_eq!(data["results"]["quantities"]["columns"].as_array().map(Vec::len), Some(4));
}

/// Messages distinguish singular and plural.
#[test]
fn counts_agree_with_their_nouns() {
    let place = Place::new();
    place.good("gradient case.toml -q");
    assert!(place.good("report case_gradient").out.starts_with("1 design, 0 load steps, "));
    place.good("optimize case.toml --iterations 1 -q");
    let out = place.good("resume case --iterations 1").out;
    assert!(out.contains("the run is complete after 1 iteration: "), "{out}");
    place.bad("check case.toml --set contact[3].friction=0.1", 2, &["contact has 1 entry, numbered from 0"]);
}
