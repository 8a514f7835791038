//! Tests of decks as text.

use slipstick_case::construct::build_mesh;
use slipstick_case::file::parse_case;

use super::*;

const CASE: &str = r#"
[[body]]
name = "base"
box = { min = [0, 0, -1], max = [2, 2, 0], elements = [2, 2, 1] }
material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "post"
box = { min = [0, 0, 0], max = [1, 1, 4], elements = [2, 2, 4] }
material = { linear_elastic = { youngs_modulus = 2000.0, poisson_ratio = 0.3 } }
[[body.section]]
region = { min = [0, 0, 1], max = [1, 1, 3] }
material = { linear_elastic = { youngs_modulus = 500.0, poisson_ratio = 0.3 } }
[[contact]]
slave = "post_zmin"
master = "base_zmax"
friction = 0.0
[[dirichlet]]
set = "base_zmin"
[[dirichlet]]
set = "post_zmax"
[[load_case]]
name = "one"
bodies = [{ body = "post", offset = OFFSET }]
[load_path]
steps = 1
"#;

/// A case as a deck.
fn written(text: &str) -> Written {
    let case = parse_case(text, "case.toml").expect("a case").case;
    let mesh = build_mesh(&case).expect("a mesh");
    let options = DeckOptions { load_case: 0, ignored: &[], contact_stiffness: None, promises: &[] };
    deck(&case, &mesh, options).expect("a deck")
}

/// The lines of all sets of elements of a deck.
fn element_sets(text: &str) -> Vec<String> {
    let deck = written(text).deck;
    let sets = deck.split("*ELSET, ").skip(1);
    sets.map(|rest| rest.split("\n*").next().unwrap_or_default().trim_end().to_owned()).collect()
}

/// Regions select elements where the case places its bodies, whatever a load case or a press fit moves: by hand, the
/// second and third of four layers of four elements, after four elements of the base.
#[test]
fn sections_of_moved_bodies() {
    let expected =
        ["ELSET=post_section_1\n5, 6, 7, 8, 17, 18, 19, 20", "ELSET=post_section_2\n9, 10, 11, 12, 13, 14, 15, 16"];
    for offset in ["[0, 0, 0]", "[0, 0, 1]", "[0, 0, 10]"] {
        assert_eq!(element_sets(&CASE.replace("OFFSET", offset)), expected, "{offset}");
    }
}

/// What a deck says of soft contact. Expected values: runs of CalculiX 2.20, in which two blocks with a table have no
/// force, and two with an exponential pressure end where it would hold them apart.
#[test]
fn soft_contact_warns() {
    let notes = |law: &str| {
        let soft = format!("friction = 0.0\nenforcement = {{ penalty = {{ pressure = {law} }} }}");
        let text = CASE.replace("OFFSET", "[0, 0, 0]").replace("friction = 0.0", &soft);
        let of_pressure = |note: &Note| note.key == "contact[0].enforcement.penalty.pressure" && !note.refused;
        let notes = written(&text).notes.into_iter().filter(of_pressure);
        notes.map(|note| format!("{} ({})", note.message, note.cure)).collect::<Vec<_>>()
    };
    let table = notes("{ table = { penetration = [0.0, 0.01], pressure = [0.0, 5.0] } }");
    assert!(table.len() == 1 && table[0].contains("ignores") && table[0].contains("NODE TO SURFACE"), "{table:?}");
    let exponential = notes("{ exponential = { contact_pressure = 3.0, clearance = 0.02 } }");
    assert!(exponential.len() == 1 && exponential[0].contains("--contact-stiffness"), "{exponential:?}");
}

/// A ring in a ring of radius r. By hand: a node of one side stands off from the chord of the other, with N divisions, by up
/// to r (1 − cos π/N); with 20 and 24 divisions, both occur, the second at 1.5° from the middle of the chord. Sides of the same
/// division have no gap, whatever their division along the axis.
#[test]
fn different_divisions_of_a_fit_warn() {
    let radius = 10.0;
    let notes = |inner: [usize; 2], order: usize, play: f64| {
        let ring = |name: &str, from: f64, to: f64, [around, along]: [usize; 2]| {
            format!(
                "[[body]]\nname = '{name}'\norder = {order}\nhollow_cylinder = {{ inner_radius = {from:?}, \
                 outer_radius = {to:?}, height = 2.0, elements = [1, {around}, {along}] }}\n\
                 material = {{ linear_elastic = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        let text = format!(
            "{}{}[[contact]]\nslave = 'hub_inner'\nmaster = 'shaft_outer'\nfriction = 0.1\n\
             [[dirichlet]]\nset = 'hub_bottom'\n[[dirichlet]]\nset = 'shaft_bottom'\n[load_path]\nsteps = 1\n",
            ring("hub", radius, 20.0, [24, 2]),
            ring("shaft", 5.0, radius - play, inner)
        );
        let notes = written(&text).notes.into_iter().filter(|note| note.key == "contact[0].master");
        notes.map(|note| note.message).collect::<Vec<_>>()
    };
    let none: Vec<String> = vec![];
    assert_eq!(
        (notes([24, 3], 1, 0.0), notes([24, 3], 1, 0.1), notes([20, 2], 2, 0.0)),
        (none.clone(), none.clone(), none)
    );
    for play in [0.0, 0.02] {
        let [message] = &notes([20, 2], 1, play)[..] else { panic!("no warning") };
        let (_, rest) = message.split_once("varies by ").expect("a number");
        let varies: f64 = rest.split(',').next().and_then(|number| number.parse().ok()).expect("a number");
        let (coarse, fine) = (std::f64::consts::PI / 20.0, std::f64::consts::PI / 24.0);
        let expected = radius * (1.0 - coarse.cos()) + radius * (1.5_f64.to_radians().cos() - fine.cos());
        assert!((varies / expected - 1.0).abs() < 0.02, "{message}, by hand {expected}");
    }
    // a block on a plane
    let block = written(&CASE.replace("OFFSET", "[0, 0, 0]"));
    assert!(block.notes.iter().all(|note| note.key != "contact[0].master"), "{:?}", block.notes);
}

/// By hand (Zienkiewicz and Taylor, The Finite Element Method, vol. 1): of a force on a face of eight nodes, each corner has
/// −1/12 and each middle of an edge 1/3.
#[test]
fn forces_on_faces_of_second_order_are_consistent() {
    for shape in ["serendipity", "lagrange"] {
        let text = format!(
            "[[body]]\nname = 'a'\norder = 2\nshape_functions = '{shape}'\n\
             box = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [1, 1, 1] }}\n\
             material = {{ linear_elastic = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
             [[dirichlet]]\nset = 'a_zmin'\n[[load]]\nsurface = 'a_zmax'\nforce = [12, 0, 0]\n[load_path]\nsteps = 1\n"
        );
        let Written { deck, notes, .. } = written(&text);
        assert!(notes.iter().all(|note| !note.refused), "{notes:?}");
        let (_, loads) = deck.split_once("*CLOAD\n").expect("forces");
        let lines = loads.lines().take_while(|line| !line.starts_with('*'));
        let mut values: Vec<(String, f64)> = lines
            .map(|line| {
                let (target, value) = line.split_once(", 1, ").expect("a force along x");
                (target.to_owned(), value.parse().expect("a number"))
            })
            .collect();
        values.sort_by(|a, b| a.1.total_cmp(&b.1));
        let of_set = |name: &str| {
            let rest = deck.split(&format!("*NSET, NSET={name}\n")).nth(1).expect("a set");
            rest.split("\n*").next().unwrap_or_default().split([',', '\n']).filter(|x| !x.trim().is_empty()).count()
        };
        let total: f64 = values.iter().map(|(target, value)| value * of_set(target) as f64).sum();
        assert!((total - 12.0).abs() < 1e-9, "{values:?}");
        let near = |(_, value): &(String, f64)| (value + 1.0).abs() < 1e-9 || (value - 4.0).abs() < 1e-9;
        assert!(values.iter().all(near) && values.len() >= 2, "{shape}: {values:?}");
    }
}
