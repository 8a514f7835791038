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

/// The lines of all sets of elements of a deck.
fn element_sets(text: &str) -> Vec<String> {
    let case = parse_case(text, "case.toml").expect("a case").case;
    let mesh = build_mesh(&case).expect("a mesh");
    let options = DeckOptions { load_case: 0, ignored: &[], contact_stiffness: None, promises: &[] };
    let deck = deck(&case, &mesh, options).expect("a deck").deck;
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
