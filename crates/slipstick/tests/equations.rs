//! The documents against the sources: equations of the paper that the code implements are referred to (`Paper: (22)` in
//! a doc comment), names in `docs/notation.md` exist, and the case in the README builds.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Equations of sections 2–4 that have a place in the code. Not listed: what only defines notation or the continuous
/// problem, and identities that hold because nothing is computed.
const IMPLEMENTED: &[(u32, u32)] = &[
    (15, 15),
    (17, 20),
    (22, 22),
    (24, 26),
    (28, 41),
    (43, 43),
    (45, 61),
    (66, 66),
    (69, 70),
    (75, 77),
    (82, 84),
    (86, 89),
    (91, 98),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// All Rust sources of the workspace, without tests' own folders.
fn sources() -> String {
    let mut folders: Vec<PathBuf> =
        fs::read_dir(root().join("crates")).expect("crates").map(|e| e.expect("entry").path().join("src")).collect();
    let mut text = String::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of sources") {
            let path = entry.expect("entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                text += &fs::read_to_string(&path).expect("UTF-8");
            }
        }
    }
    text
}

/// The equation numbers of a tag: `(41), (46)–(50)` is 41, 46, 47, 48, 49, 50. Other text in between is skipped.
fn numbers(tag: &str) -> BTreeSet<u32> {
    let mut found = BTreeSet::new();
    let mut range_from = None;
    for piece in tag.split('(').skip(1) {
        let digits: String = piece.chars().take_while(char::is_ascii_digit).collect();
        let rest = piece[digits.len()..].trim_start_matches(|c: char| c.is_ascii_lowercase());
        let number = digits.parse::<u32>().ok().filter(|n| (1..=100).contains(n) && rest.starts_with(')'));
        let Some(number) = number else {
            range_from = None;
            continue;
        };
        found.extend(range_from.unwrap_or(number)..=number);
        range_from = rest.starts_with(")–").then_some(number);
    }
    found
}

#[test]
fn implemented_equations_are_referenced() {
    let sources = sources();
    let tags = sources.lines().filter_map(|line| line.split_once("Paper: "));
    let referenced: BTreeSet<u32> = tags.flat_map(|(_, tag)| numbers(tag)).collect();
    let implemented: BTreeSet<u32> = IMPLEMENTED.iter().flat_map(|&(from, to)| from..=to).collect();
    println!("{} equations of the paper are referred to, {} must be", referenced.len(), implemented.len());
    let missing: Vec<_> = implemented.difference(&referenced).collect();
    assert!(missing.is_empty(), "no `Paper: (n)` names the equations {missing:?}");
}

/// The column headed "Rust" of each table in `docs/notation.md`: the last name of every path in it is a word of the
/// sources.
#[test]
fn names_in_the_notation_exist() {
    let sources = sources();
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let words: BTreeSet<&str> = sources.split(|c| !word(c)).collect();
    let text = fs::read_to_string(root().join("docs/notation.md")).expect("docs/notation.md");
    let (mut column, mut checked) = (None, 0);
    for line in text.lines() {
        let cells: Vec<&str> = line.split('|').collect();
        if !line.starts_with('|') {
            column = None;
        } else if let Some(at) = cells.iter().position(|c| c.trim() == "Rust") {
            column = Some(at);
        } else if let Some(at) = column {
            for name in cells[at].split('`').skip(1).step_by(2).flat_map(|path| path.split("::")) {
                assert!(words.contains(name), "docs/notation.md: `{name}` is in no source: {line}");
                checked += 1;
            }
        }
    }
    assert!(checked > 80, "only {checked} names were found in the tables");
}

#[test]
fn the_case_in_the_readme_builds() {
    let readme = fs::read_to_string(root().join("README.md")).expect("README.md");
    let case = readme.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a case file");
    let resolved = slipstick::case::parse_case(case, "README.md").unwrap_or_else(|errors| panic!("{errors}"));
    assert!(resolved.warnings.is_empty(), "{:?}", resolved.warnings);
    resolved.require(&["contact", "dirichlet", "design", "objective", "optimizer"]).expect("complete");
    let problem = slipstick::build::build(&resolved.case).unwrap_or_else(|error| panic!("{error}"));
    // by hand: 12·3·4 + 4·2·4
    assert_eq!(problem.mesh.hexes.len(), 176);
}

#[test]
fn ranges_and_lists_of_equations_are_read() {
    let read = |tag: &str| numbers(tag).into_iter().collect::<Vec<_>>();
    assert_eq!(read("(37)–(39) and (46), Popp et al. (2010); `f(x)`. (23b)–(24)"), [23, 24, 37, 38, 39, 46]);
    assert!(read("section 2.3.").is_empty());
}
