//! Parts of the page.

use super::frames::thinned;
use super::pack::{Packed, base64, floats, integers};
use super::*;
use ::base64::Engine as _;
use ::base64::engine::general_purpose::STANDARD;

/// Value = low + step · code; half a step is the largest error.
#[test]
fn packed_numbers_are_within_half_a_step() {
    let values: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.37).sin() * 3e5 - 1e5).collect();
    let packed = serde_json::to_value(Packed::numbers(&values)).expect("plain");
    let (low, step) = (packed["low"].as_f64().expect("low"), packed["step"].as_f64().expect("step"));
    assert_eq!(packed["bits"], 16);
    assert!((step * 65535.0 / 6e5 - 1.0).abs() < 1e-3, "the range is 6e5");
    let codes = STANDARD.decode(packed["data"].as_str().expect("text")).expect("base64");
    assert_eq!(codes.len(), 2000);
    for (code, value) in codes.as_chunks::<2>().0.iter().zip(&values) {
        let found = low + step * f64::from(u16::from_le_bytes(*code));
        assert!((found - value).abs() <= 0.5001 * step, "{found} {value}");
    }
    for all in [&[][..], &[2.5; 3], &[f64::MIN, f64::MAX]] {
        let text = serde_json::to_string(&Packed::numbers(all)).expect("plain");
        assert!(!text.contains("null"), "{text}");
    }
    let densities = serde_json::to_value(Packed::densities([0.0, 0.5, 1.0])).expect("plain");
    assert_eq!(densities["data"], base64(&[0, 128, 255]));
}

/// RFC 4648, section 10, and the byte order of browsers.
#[test]
fn numbers_as_text() {
    assert_eq!(base64(b"foobar"), "Zm9vYmFy");
    assert_eq!(integers([1, 256]), base64(&[1, 0, 0, 0, 0, 1, 0, 0]));
    assert_eq!(floats([1.0]), base64(&[0, 0, 0x80, 0x3f]));
}

#[test]
fn many_frames_are_thinned_evenly() {
    let numbers: Vec<usize> = (0..=100).collect();
    let mut notes = Vec::new();
    assert_eq!(thinned(&numbers, 101, "designs", "design.pvd", &mut notes).len(), 101);
    assert!(notes.is_empty());
    assert_eq!(thinned(&numbers, 5, "designs", "design.pvd", &mut notes), [0, 25, 50, 75, 100]);
    assert_eq!(notes, ["This page shows 5 of 101 designs; design.pvd has all that were written."]);
    assert_eq!(thinned(&numbers, 0, "designs", "design.pvd", &mut notes), [0, 100]);
}

/// Meshes up to the limit are whole; of larger ones, only the designed plate is.
#[test]
fn large_meshes_have_a_skin() {
    let text = slipstick_case::file::template("half-ball").expect("a template").text;
    let case = slipstick_case::file::parse_case(text, "half_ball.toml").expect("a case").case;
    let mesh = slipstick_case::construct::build_mesh(&case).expect("a mesh");
    let count = mesh.elements.len();
    let [plate, ball] = [0, 1].map(|body: usize| mesh.bodies[body].elements.clone());
    let whole = model::Layout::new(&case, &mesh, count);
    assert_eq!((whole.elements.len(), whole.behind.len()), (count, 0));
    let skin = model::Layout::new(&case, &mesh, count - 1);
    assert_eq!(skin.elements.len(), plate.len());
    assert_eq!(skin.behind.len(), mesh.boundary(1).facets.len());
    assert!(skin.behind.iter().all(|&e| ball.contains(&(e as usize))));
    assert!(skin.is_designed());
}

/// The view of a model knows the faces of surfaces and the nodes of sets; other names are left out.
#[test]
fn a_model_that_has_not_run_is_shown() {
    let text = slipstick_case::file::template("half-ball").expect("a template").text;
    let case = slipstick_case::file::parse_case(text, "half_ball.toml").expect("a case").case;
    let mesh = slipstick_case::construct::build_mesh(&case).expect("a mesh");
    let names = ["ball_dome", "feet", "nothing"].map(str::to_owned);
    let page = model_page(&case, &mesh, &names, &PageOptions::default());
    let data = page.html.split("application/json\">").nth(1).and_then(|rest| rest.split("</script>").next());
    let data: Value = serde_json::from_str(data.expect("data")).expect("JSON");
    assert_eq!((&data["setup"], &data["steps"], page.notes.len()), (&true.into(), &serde_json::json!([]), 0));
    let marks = data["marks"].as_array().expect("marks");
    let bytes = |value: &Value| STANDARD.decode(value.as_str().expect("text")).expect("base64").len();
    assert_eq!(marks.len(), 2);
    assert_eq!(bytes(&marks[0]["quads"]), 16 * mesh.surfaces["ball_dome"].facets.len());
    assert_eq!(bytes(&marks[1]["points"]), 4 * mesh.set_nodes("feet").expect("a set").len());
    let small = PageOptions { model_bytes: 1000, ..PageOptions::default() };
    let page = model_page(&case, &mesh, &names, &small);
    assert!(page.notes[0].contains("too large") && page.html.len() < 100_000, "{:?}", page.notes);
}

/// Elements of second order are drawn without their mid-side nodes; the marked surface covers as many of their faces as
/// it has facets, 4 for each face.
#[test]
fn surfaces_of_second_order_elements_are_marked() {
    let text = slipstick_case::file::template("half-ball").expect("a template").text;
    let text = text.replace("name = \"ball\"\n", "name = \"ball\"\norder = 2\n");
    let case = slipstick_case::file::parse_case(&text, "half_ball.toml").expect("a case").case;
    let mesh = slipstick_case::construct::build_mesh(&case).expect("a mesh");
    let options = PageOptions { whole_elements: mesh.elements.len(), ..PageOptions::default() };
    let page = model_page(&case, &mesh, &["ball_dome".to_owned()], &options);
    let data = page.html.split("application/json\">").nth(1).and_then(|rest| rest.split("</script>").next());
    let data: Value = serde_json::from_str(data.expect("data")).expect("JSON");
    let points = |value: &Value| -> Vec<u32> {
        let bytes = STANDARD.decode(value.as_str().expect("text")).expect("base64");
        bytes.as_chunks::<4>().0.iter().map(|four| u32::from_le_bytes(*four)).collect()
    };
    let key = |corners: [u32; 4]| {
        let mut corners = corners;
        corners.sort_unstable();
        corners
    };
    let marked = points(&data["marks"][0]["quads"]);
    let marked: std::collections::HashSet<_> = marked.as_chunks::<4>().0.iter().map(|&corners| key(corners)).collect();
    let hexes = points(&data["model"]["hexes"]);
    let sides = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let faces = hexes.as_chunks::<8>().0.iter().flat_map(|hex| sides.map(|side| key(side.map(|k: usize| hex[k]))));
    let facets = mesh.surfaces["ball_dome"].facets.len();
    assert!(facets > 0 && facets.is_multiple_of(4), "{facets}");
    assert_eq!(faces.filter(|face| marked.contains(face)).count(), facets / 4);
}

#[test]
fn text_is_no_markup() {
    assert_eq!(escaped("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
}

/// Options of all commands may come first, with values.
#[test]
fn the_command_is_found_behind_options() {
    let found = |line: &str| command(&line.split(' ').map(str::to_owned).collect::<Vec<_>>()).to_owned();
    assert_eq!(found("/bin/slipstick --threads 1 solve case.toml -q --out a"), "solve");
    assert_eq!(found("slipstick -q optimize solve"), "optimize");
    assert_eq!(found("slipstick --json --threads=2 resume case"), "optimize");
    assert_eq!(found("study.py"), "run");
}

/// Where there is Node.js, the page's own functions are run.
#[test]
fn rounded_designs_keep_their_volume_and_outer_faces() {
    let faces = include_str!("page/viewer.js").split("const VERTEX").next().unwrap_or_default();
    let script = [faces, include_str!("page/smooth.js"), include_str!("page/smooth_check.js")].concat();
    let Ok(ran) = std::process::Command::new("node").args(["-e", &script]).output() else { return };
    let errors = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(String::from_utf8_lossy(&ran.stdout).trim(), "true", "{errors}");
}

/// Where there is Node.js: of two faces under the pointer, the one in front is picked, as their planes say. The first
/// has the depth −x, and its middle is behind the second, which is parallel to the view at the depth z.
#[test]
fn a_click_picks_the_face_in_front() {
    let check = "
        const pickedAt = (x, z, order) => {
          const viewer = Object.assign(Object.create(Viewer.prototype), {
            canvas: { clientWidth: 100, clientHeight: 100 }, yaw: 0, pitch: 0, zoom: 1, radius: 1, centre: [0, 0, 0], shift: [0, 0],
          });
          const small = [[-.6, -.1], [-.4, -.1], [-.4, .1], [-.6, .1]].flatMap(corner => [...corner, z]);
          viewer.shown = { points: [-1, -1, 1, 1, -1, -1, 1, 1, -1, -1, 1, 1, ...small], nodes: [...order, 4, 5, 6, 7], section: null };
          return viewer.pick(50 + 50 * x, 50);
        };
        const square = [0, 1, 2, 3], triangles = [[0, 1, 3, 3], [0, 0, 1, 3], [0, 1, 1, 3], [0, 1, 3, 0]];
        const found = [square, ...triangles].map(order => [pickedAt(-.5, .2, order), pickedAt(-.5, .7, order), pickedAt(-.2, .7, order)]);
        console.log(JSON.stringify(found), pickedAt(-.5, .2, [3, 2, 1, 0]));";
    let script = [include_str!("page/viewer.js"), check].concat();
    let Ok(ran) = std::process::Command::new("node").args(["-e", &script]).output() else { return };
    let errors = String::from_utf8_lossy(&ran.stderr);
    let expected = format!("[{}] 1", ["[0,1,0]"; 5].join(","));
    assert_eq!(String::from_utf8_lossy(&ran.stdout).trim(), expected, "{errors}");
}
