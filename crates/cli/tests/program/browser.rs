//! Reports in a browser.

use super::report::{data, pressed};
use super::*;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// Stores captions of charts with their bounds in its title, and the paths and labels of the curve.
const BOUNDED: &str = r##"<script>
const figures = [...document.querySelectorAll("figure")].map(figure => ({ caption: figure.querySelector("figcaption span").textContent, lines: figure.querySelectorAll("line.bound").length, text: [...figure.querySelectorAll("svg text")].map(text => text.textContent), paths: figure.querySelectorAll("path").length, gaps: [...figure.querySelectorAll("path")].map(path => path.getAttribute("d").match(/M/g).length) }));
document.title = JSON.stringify(figures);
</script></body>"##;

/// Bounds are lines, load cases have names, and far bounds do not flatten the curves.
#[test]
fn a_browser_shows_bounds_and_load_cases() {
    let place = pressed();
    place.good("optimize case.toml -q --iterations 1");
    let Some(figures) = tried(&place, "case", BOUNDED, "a_browser_shows_bounds_and_load_cases") else { return };
    let figures = figures.as_array().expect("figures");
    let find =
        |caption: &str| figures.iter().find(|of| of["caption"].as_str().is_some_and(|text| text.starts_with(caption)));
    let history = find("Constraint: hold ≥ 50 [N]: light heavy").expect("a chart");
    assert_eq!((&history["lines"], &history["paths"]), (&1.into(), &2.into()), "{history}");
    assert!(history["text"].as_array().expect("text").contains(&"≥ 50".into()));
    // forces that are maximized are positive, and grow upwards
    let objective = find("Sum of the contact forces [N] (maximized)").expect("a chart");
    let labels = objective["text"].as_array().expect("text");
    assert!(
        labels.len() > 2 && !labels.iter().any(|text| text.as_str().is_some_and(|text| text.starts_with('-'))),
        "{objective}"
    );
    let far = find("Constraint: amount ≤ 10000 [mm³], bound ≤ 10000 (off the chart)").expect("a chart");
    assert_eq!(far["lines"], 0, "{far}");
    let path = find("hold [N]").expect("a chart over the load path");
    assert_eq!((&path["lines"], &path["gaps"]), (&2.into(), &serde_json::json!([2])), "{path}");
    let texts = path["text"].as_array().expect("text");
    assert!(["light", "heavy", "≤ 100", "≥ 50"].iter().all(|text| texts.contains(&(*text).into())), "{path}");
    assert!(find("strain energy light heavy").is_some(), "{figures:#?}");
}

/// In a browser, the page of a run shows a warning below the title.
pub(crate) fn shows_warnings(place: &Place, run: &str, expected: &str) {
    let script = "<script>const box = document.getElementById(\"warnings\");\
                  document.title = JSON.stringify([box.hidden, box.offsetTop, box.textContent]);</script></body>";
    let Some(told) = tried(place, run, script, "shows_warnings") else { return };
    assert!(told[0] == false && told[1].as_f64().is_some_and(|top| top < 200.0), "{told}");
    assert!(told[2].as_str().is_some_and(|text| text.starts_with("Warnings of the run") && text.contains(expected)));
}

/// Names of browsers in which the page can be tested.
const BROWSERS: &[&str] = &["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Operates the page's controls and stores the results in its title: the pixels drawn at first and
/// after each change.
const TRIAL: &str = r##"<script>
const canvas = document.getElementById("canvas"), gl = canvas.getContext("webgl");
const drawn = () => {
  const pixels = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let count = 0, sum = 0;
  for (let i = 0; i < pixels.length; i += 4) { count += pixels[i + 3] > 0; sum = (sum * 31 + pixels[i] + 3 * pixels[i + 1] + 7 * pixels[i + 2]) % 1000003; }
  return [count, sum];
};
const control = name => [...document.querySelectorAll("#controls label")].find(label => label.textContent.includes(name)).querySelector("input, select");
const change = (name, value) => { const input = control(name); input.value = value; input.dispatchEvent(new Event(input.tagName === "SELECT" ? "change" : "input")); return drawn(); };
const told = { state: document.documentElement.dataset.ready, start: drawn() };
// contact is seen from below, without the slab
const press = (key, times) => { for (let k = 0; k < times; k++) canvas.dispatchEvent(new KeyboardEvent("keydown", { key })); };
control("slab").click();
press("ArrowUp", 15);
told.pressure = change("Colour", "pressure");
told.status = change("Colour", "status");
control("slab").click();
press("0", 1);
told.displacement = change("Colour", "displacement");
told.stress = change("Colour", "stress");
told.undeformed = change("Displacement factor", 0);
told.first = change("Load step", 0);
told.section = change("Section", "0");
told.other = (control("other half").click(), drawn());
told.moved = change("Section at x", 1.3);
change("Section", "");
told.threshold = change("density above", 0.99);
told.designs = change("Show", "designs");
press("ArrowLeft", 1);
told.turned = drawn();
told.charts = document.querySelectorAll("figure svg").length;
// a hexahedron, a wedge on one of its faces and a tetrahedron on the wedge
const sides = facesOf(Uint32Array.from([0, 1, 2, 3, 4, 5, 6, 7, 1, 8, 2, 2, 5, 9, 6, 6, 5, 9, 6, 6, 10, 10, 10, 10]), 11).sides;
told.faces = [sides.length / 2, sides.filter(side => side < 0).length];
// the areas of sections through the unit cube, the prism and the tetrahedron below its diagonals, and a sheared cube
const corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], coordinates = list => Float32Array.from(list.flat());
const area = (hex, axis, at, points = corners) => {
  const cut = sectionOf(Uint32Array.from(hex), coordinates(points), () => true, { axis, at, side: 1 }), [u, w] = [(axis + 1) % 3, (axis + 2) % 3];
  const twice = list => list.reduce((sum, k, i) => { const j = list[(i + 1) % list.length]; return sum + cut.coordinates[3 * k + u] * cut.coordinates[3 * j + w] - cut.coordinates[3 * j + u] * cut.coordinates[3 * k + w]; }, 0);
  return cut.polygons.map(([, list]) => [twice(list) / 2, filled(list).reduce((sum, [four]) => sum + twice(four) / 2, 0)]).flat().map(size => Math.round(1e5 * size) / 1e5);
};
const sheared = by => corners.map(([x, y, z]) => [x - by * (y + z), y, z]);
told.areas = [area([0, 1, 2, 3, 4, 5, 6, 7], 1, 0.25), area([0, 1, 3, 3, 4, 5, 7, 7], 0, 0.25), area([0, 1, 3, 3, 4, 4, 4, 4], 2, 0.25), area([0, 1, 2, 3, 4, 5, 6, 7], 0, 0.25, sheared(0.5)), area([0, 1, 2, 3, 4, 5, 6, 7], 0, -0.5, sheared(1)), area([0, 1, 2, 3, 4, 5, 6, 7], 1, 2)];
document.title = JSON.stringify(told);
</script></body>"##;

/// In a real browser, the page is drawn without errors, and every control changes the picture.
#[test]
fn a_browser_shows_the_page() {
    let place = Place::new();
    place.good("optimize case.toml -q");
    let Some(told) = tried(&place, "case", TRIAL, "a_browser_shows_the_page") else { return };
    assert_eq!(told["state"], "view", "{told}");
    let pixels = |name: &str| told[name][0].as_u64().expect("a count");
    assert!(pixels("start") > 10_000, "{told}");
    let order = [
        "start",
        "pressure",
        "status",
        "displacement",
        "stress",
        "undeformed",
        "first",
        "section",
        "other",
        "moved",
        "threshold",
        "turned",
    ];
    for pair in order.windows(2) {
        assert_ne!(told[pair[0]], told[pair[1]], "{} to {}: {told}", pair[0], pair[1]);
    }
    assert!(pixels("threshold") < pixels("first"), "fewer elements: {told}");
    assert!(told["charts"].as_u64() >= Some(7), "{told}");
    // 6 + 5 + 4 faces, of which two pairs coincide
    assert_eq!(told["faces"], serde_json::json!([13, 11]), "{told}");
    // by hand: a unit square; 1 - 0.25 times the height 1; half of 0.75 squared; and of the sheared cubes, whose x is
    // 0.25 + (y + z) / 2 or y + z - 1/2 there, the unit square without the corner y + z > 3/2, and without the opposite
    // one, y + z < 1/2, too
    assert_eq!(
        told["areas"],
        serde_json::json!([[1, 1], [0.75, 0.75], [0.28125, 0.28125], [0.875, 0.875], [0.75, 0.75], []]),
        "{told}"
    );
}

/// Colours a page by plastic strain and stores the pixels, and what the legend says, in its title.
const PLASTIC: &str = r##"<script>
const select = [...document.querySelectorAll("#controls label")].find(label => label.textContent.includes("Colour")).querySelector("select");
const told = { fields: [...select.options].map(option => option.value), pictures: [] };
for (const field of ["stress", "plastic"]) { select.value = field; select.dispatchEvent(new Event("change")); told.pictures.push(document.getElementById("legend").textContent); }
document.title = JSON.stringify(told);
</script></body>"##;

/// Plastic strains are fields of the view where bodies yield, the same as in the files, and none elsewhere.
#[test]
fn plastic_strains_are_on_the_page() {
    let place = Place::new();
    let page = |run: &str| {
        place.good(&format!("report {run}"));
        data(&place.read(&format!("{run}/report.html")))
    };
    place.good("solve case.toml -q");
    assert!(page("case_solve")["steps"][4]["plastic"].is_null());
    let yields = "{ j2_linear = { youngs_modulus = 1000.0, poisson_ratio = 0.3, yield_stress = 5.0, hardening_modulus = 100.0 } }";
    place.write("case.toml", &CASE.replace("{ neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }", yields));
    place.good("solve case.toml -q --out yields");
    let fields = slipstick::output::read_fields(&place.path("yields/path_0004.vtu")).expect("fields");
    let expected = &fields.iter().find(|field| field.name == "plastic_strain").expect("plastic strains").values;
    let largest = expected.iter().fold(0.0, |a: f64, b| a.max(*b));
    let packed = &page("yields")["steps"][4]["plastic"];
    let (low, step) = (packed["low"].as_f64().expect("low"), packed["step"].as_f64().expect("step"));
    let codes = STANDARD.decode(packed["data"].as_str().expect("text")).expect("base64");
    assert!(largest > 1e-3 && codes.len() == 2 * expected.len(), "{largest}");
    for (code, strain) in codes.as_chunks::<2>().0.iter().zip(expected.iter()) {
        assert!((low + step * f64::from(u16::from_le_bytes(*code)) - strain).abs() <= 0.5001 * step, "{strain}");
    }
    let Some(told) = tried(&place, "yields", PLASTIC, "plastic_strains_are_on_the_page") else { return };
    assert!(told["fields"].as_array().expect("fields").contains(&"plastic".into()), "{told}");
    assert!(told["pictures"][0].as_str().expect("a legend").starts_with("von Mises stress"), "{told}");
    let legend = told["pictures"][1].as_str().expect("a legend");
    assert!(legend.starts_with("equivalent plastic strain0") && legend.contains("at this step up to"), "{told}");
}

/// Plays the load path, and stores the steps that are shown meanwhile in its title.
const PLAYED: &str = r##"<script>
const step = [...document.querySelectorAll("#controls label")].find(label => label.textContent.includes("Load step")), input = step.querySelector("input");
const button = step.parentElement.querySelector("button"), told = { names: [button.getAttribute("aria-label")], steps: [input.value] };
input.addEventListener("input", () => told.steps.push(input.value));
button.click();
told.names.push(button.getAttribute("aria-label"));
setTimeout(() => {
  button.click();
  told.names.push(button.getAttribute("aria-label"));
  const count = told.steps.length;
  setTimeout(() => { told.after = told.steps.length - count; told.shown = step.textContent; document.title = JSON.stringify(told); }, 2000);
}, 4500);
</script></body>"##;

/// From the last step, playing begins again at the first, goes through all of them, and starts over until it is
/// paused.
#[test]
fn a_browser_plays_the_load_path() {
    let place = Place::new();
    place.good("solve case.toml -q");
    let Some(told) = tried(&place, "case_solve", PLAYED, "a_browser_plays_the_load_path") else { return };
    let steps: Vec<&str> = told["steps"].as_array().expect("steps").iter().filter_map(Value::as_str).collect();
    assert_eq!(steps[..8], ["4", "0", "1", "2", "3", "4", "0", "1"], "{told}");
    assert_eq!(told["names"], serde_json::json!(["Play load path", "Pause load path", "Play load path"]), "{told}");
    assert_eq!(told["after"], 0, "{told}");
    assert!(told["shown"].as_str().is_some_and(|text| text.contains(", t = ")), "{told}");
}

/// Stores the notes and results that the page shows in its title.
const SHOWN: &str = r##"<script>
const note = document.querySelector("#notes p"), results = document.getElementById("results");
const wide = [...document.querySelectorAll(".scroll")].filter(box => box.scrollWidth > box.clientWidth + 1).map(box => box.id);
document.title = JSON.stringify({
  note: note ? note.innerText.split("\n") : [], height: note ? note.clientHeight : 0, results: results.hidden ? "" : results.innerText, wide,
  field: [...document.querySelectorAll("#controls label")].filter(label => label.textContent.includes("Colour")).map(label => label.querySelector("select").value).join(),
});
</script></body>"##;

/// The lines of a failure message remain separate lines; the results of a run without a design fit
/// the width of a page, and the view has colours.
#[test]
fn a_browser_shows_failures_and_results() {
    let test = "a_browser_shows_failures_and_results";
    let place = Place::with("steps = 4", "steps = 1\nmax_newton_iterations = 1\nmax_cutbacks = 0");
    place.run("solve case.toml --out failed");
    let Some(told) = tried(&place, "failed", SHOWN, test) else { return };
    let lines: Vec<&str> = told["note"].as_array().expect("lines").iter().filter_map(Value::as_str).collect();
    assert!(lines.len() > 5 && lines[0].starts_with("The run failed: load step 1 failed: "), "{lines:#?}");
    assert!(lines.iter().any(|line| line.trim_start().starts_with("help: ")), "{lines:#?}");
    assert!(told["height"].as_u64() > Some(100), "{told}");
    let design = CASE.find("[design]").expect("a design");
    place.write("case.toml", &CASE[..design]);
    place.good("solve case.toml -q");
    let told = tried(&place, "case_solve", SHOWN, test).expect("a browser");
    assert!(told["results"].as_str().is_some_and(|text| text.contains("block_ymin on slab_ymax")), "{told}");
    assert_eq!((&told["wide"], &told["field"]), (&serde_json::json!([]), &"displacement".into()), "{told}");
}

/// The limit on densities below which elements are hidden.
const LIMIT: &str = r##"<script>
document.title = [...document.querySelectorAll("#controls label")].find(label => label.textContent.includes("density above")).querySelector("input").value;
</script></body>"##;

/// An initial design of 0.3 nearly everywhere is shown, although no density exceeds 0.5 but those of the other body
/// and of a few passive elements.
#[test]
fn a_browser_shows_a_grey_design() {
    let solid = "initial = 0.3\npassive_solid = [{ min = [0, 0, 0], max = [1, 1, 1] }]";
    let place = Place::with("initial = 0.5", solid);
    place.good("gradient case.toml -q");
    let Some(limit) = tried(&place, "case_gradient", LIMIT, "a_browser_shows_a_grey_design") else { return };
    assert_eq!(limit, 0);
}

/// Chooses a colour, a load step and a quantity, and after the page has been loaded again, stores
/// what it shows in its title.
const FOLLOWED: &str = r##"<script>
const control = name => [...document.querySelectorAll("#controls label")].find(label => label.textContent.includes(name)).querySelector("input, select");
const up = document.querySelector("#quantities-controls select[aria-label=y]");
if (kept.state) {
  document.title = JSON.stringify({ colour: control("Colour").value, step: control("Load step").value, up: up.value });
  // a pressed pointer keeps the page from loading again
  dispatchEvent(new Event("pointerdown"));
} else [[control("Colour"), "pressure", "change"], [control("Load step"), 2, "input"], [up, "strain_energy", "change"]].forEach(([input, value, event]) => { input.value = value; input.dispatchEvent(new Event(event)); });
</script></body>"##;

/// The open page of a run in progress loads itself again and keeps the reader's choices.
#[test]
fn a_browser_follows_a_run() {
    let place = Place::new();
    place.good("optimize case.toml -q --iterations 1");
    let follow =
        |html: String| html.replace("type=\"application/json\">{", "type=\"application/json\">{\"reload\":0.5,");
    let Some(shown) = tried_as(&place, "case", FOLLOWED, follow, "a_browser_follows_a_run") else { return };
    assert_eq!(shown, serde_json::json!({ "colour": "pressure", "step": "2", "up": "strain_energy" }));
}

/// Counts the lines of the curve, and the points on the axis of the energies.
const LINES: &str = r##"<script>
const [curve_of, energies] = document.querySelectorAll("#quantities-charts figure > svg");
document.title = JSON.stringify([[...curve_of.querySelectorAll("path")].filter(path => path.getAttribute("d").startsWith("M")).length, energies.querySelectorAll("circle").length]);
</script></body>"##;

/// Evaluations with two coefficients of friction are two lines; the energies are those of the last,
/// at rest and at four steps.
#[test]
fn a_browser_shows_every_evaluation() {
    let place = Place::new();
    place.good("solve case.toml -q");
    place.good("evaluate case.toml --design case_solve --friction 0,0.2 -q");
    let Some(lines) = tried(&place, "case_evaluate", LINES, "a_browser_shows_every_evaluation") else { return };
    assert_eq!(lines, serde_json::json!([2, 15]));
}

/// The value that a script at the end of a run's page stores in its title; `None` without a
/// browser.
fn tried(place: &Place, run: &str, script: &str, test: &str) -> Option<Value> {
    tried_as(place, run, script, |html| html, test)
}

fn tried_as(place: &Place, run: &str, script: &str, change: impl Fn(String) -> String, test: &str) -> Option<Value> {
    let found = BROWSERS.iter().find(|name| Command::new(name).arg("--version").output().is_ok());
    let Some(browser) = found else {
        // Print directly to the terminal, because the test harness captures `eprintln!`.
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), "SKIPPED {test}: none of {BROWSERS:?} is installed");
        return None;
    };
    place.good(&format!("report {run}"));
    let html = place.read(&format!("{run}/report.html"));
    place.write("trial.html", &change(html.replace("</body>", script)));
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        .args(["--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update"])
        .args(["--disable-sync", "--enable-logging=stderr", "--window-size=900,900", "--virtual-time-budget=10000"])
        .arg(format!("--user-data-dir={}", place.path(&format!("profile_{run}")).display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", place.path("trial.html").display()))
        .output()
        .expect("the browser runs");
    let (dom, log) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let faults: Vec<&str> =
        log.lines().filter(|line| line.contains("CONSOLE") && !line.contains("GPU stall")).collect();
    assert!(faults.is_empty(), "{faults:#?}");
    let title = dom.split("<title>").nth(1).and_then(|rest| rest.split("</title>").next()).expect("a title");
    let title = title.replace("&quot;", "\"").replace("&nbsp;", " ").replace("&amp;", "&");
    Some(serde_json::from_str(&title).unwrap_or_else(|e| panic!("{e}: {title}\n{log}")))
}

/// The page shows the design in Firefox too: in the interactive view or, if there is no WebGL (as
/// is usual in headless mode), as a picture. This is checked by the colours of a screenshot, which
/// a page without both does not have.
#[test]
#[ignore = "needs Firefox"]
fn firefox_shows_the_page() {
    let there = |name: &&&str| Command::new(name).arg("--version").output().is_ok();
    let found = ["firefox-esr", "firefox"].iter().find(there);
    let browser = found.expect("neither firefox-esr nor firefox is installed");
    let place = Place::new();
    place.good("optimize case.toml -q");
    place.good("report case");
    let html = place.read("case/report.html");
    place.write("hidden.html", &html.replace("</body>", "<style>canvas, img { visibility: hidden }</style></body>"));
    let colours = |page: &str| {
        let picture = place.path("screenshot.png");
        let output = Command::new(browser)
            .args(["--headless", "--no-remote", "--window-size=900,900", "--profile"])
            .arg(profile(&place, page))
            .arg("--screenshot")
            .arg(&picture)
            .arg(format!("file://{}", place.path(page).display()))
            .output()
            .expect("the browser runs");
        let file = std::fs::File::open(&picture);
        let file = file.unwrap_or_else(|e| panic!("no screenshot: {e}\n{}", String::from_utf8_lossy(&output.stderr)));
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a picture");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut pixels).expect("a picture");
        let samples = info.color_type.samples();
        let saturated =
            |pixel: &&[u8]| pixel[..3].iter().max().unwrap_or(&0) - pixel[..3].iter().min().unwrap_or(&0) > 60;
        pixels.chunks_exact(samples).filter(saturated).count()
    };
    let (with, without) = (colours("case/report.html"), colours("hidden.html"));
    assert!(with > 10_000 && without < 100, "{with} coloured pixels with the view, {without} without");
}

/// A separate browser profile for each page.
fn profile(place: &Place, page: &str) -> PathBuf {
    let folder = place.path(&format!("profile_{}", page.replace(['/', '.'], "_")));
    std::fs::create_dir_all(&folder).expect("made");
    folder
}
