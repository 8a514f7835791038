//! The documents against the sources: equations of the paper that the code implements are referred
//! to (`Paper: (22)` in a doc comment), names, files and tests that are cited exist, keys of case
//! files are explained, links lead to files and headings, the case on the page about case files
//! builds, and the README shows the Python program of the package.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Equations that have a place in the code. Not listed: the continuous problem (1)–(11), the
/// virtual work (14), (16) that (17) comes from, (68), which is (54) without H, and (78)–(81),
/// which would count friction twice.
const IMPLEMENTED: &[(u32, u32)] = &[(12, 13), (15, 15), (17, 67), (69, 77), (82, 100)];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A Rust source of the workspace: its path with `/` and its text.
struct Source {
    path: String,
    text: String,
}

/// All Rust sources of the workspace: crates' `src`, `tests` and `examples`.
fn sources() -> Vec<Source> {
    let mut folders = vec![root().join("crates")];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of sources") {
            let path = entry.expect("entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).expect("UTF-8");
                found.push(Source { path: path.to_string_lossy().replace('\\', "/"), text });
            }
        }
    }
    assert!(found.len() > 100, "only {} sources", found.len());
    found
}

/// The sources of the program and the libraries, without tests' own folders, examples and
/// benchmarks.
fn library(sources: &[Source]) -> String {
    sources.iter().filter(|s| s.path.contains("/src/")).map(|s| s.text.as_str()).collect()
}

/// All functions.
fn functions(sources: &[Source]) -> BTreeSet<&str> {
    let name = |rest: &'_ str| rest.find(|c: char| !is_word(c)).unwrap_or(rest.len());
    sources.iter().flat_map(|s| s.text.split("fn ").skip(1)).map(|rest| &rest[..name(rest)]).collect()
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Names in backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// The cells below the heading `heading` of all tables of a document, each with its line.
fn column<'a>(text: &'a str, heading: &str) -> Vec<(&'a str, &'a str)> {
    let (mut at, mut cells) = (None, Vec::new());
    for line in text.lines() {
        let row: Vec<&str> = line.split('|').collect();
        if !line.starts_with('|') {
            at = None;
        } else if let Some(found) = row.iter().position(|c| c.trim() == heading) {
            at = Some(found);
        } else if let Some(at) = at {
            cells.push((row[at], line));
        }
    }
    let least = if heading == "law" { 3 } else { 10 };
    assert!(cells.len() >= least, "only {} cells below the heading {heading}", cells.len());
    cells
}

fn document(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The equation numbers of a tag: `(41), (46)–(50)` is 41, 46, 47, 48, 49, 50. Other text in
/// between is skipped.
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

fn implemented() -> BTreeSet<u32> {
    IMPLEMENTED.iter().flat_map(|&(from, to)| from..=to).collect()
}

#[test]
fn implemented_equations_are_referenced() {
    let sources = sources();
    let text = library(&sources);
    let tags = text.lines().filter_map(|line| line.split_once("Paper: "));
    let referenced: BTreeSet<u32> = tags.flat_map(|(_, tag)| numbers(tag)).collect();
    println!("{} equations of the paper are referred to, {} must be", referenced.len(), implemented().len());
    let missing: Vec<_> = implemented().difference(&referenced).copied().collect();
    assert!(missing.is_empty(), "no `Paper: (n)` names the equations {missing:?}");
}

/// The table from equations to code lists what is implemented and nothing else.
#[test]
fn the_table_of_equations_is_complete() {
    let text = document("docs/method/notation.md");
    let (_, section) = text.split_once("\n## 8 ").expect("section 8");
    let listed: BTreeSet<u32> = column(section, "equations").iter().flat_map(|(cell, _)| numbers(cell)).collect();
    assert_eq!(listed, implemented());
}

/// The column headed "Rust" of each table in `docs/method/notation.md`: every name of every path in it is
/// a word of the sources.
#[test]
fn names_in_the_notation_exist() {
    let sources = sources();
    let text = library(&sources);
    let words: BTreeSet<&str> = text.split(|c| !is_word(c)).collect();
    let mut checked = 0;
    for (cell, line) in column(&document("docs/method/notation.md"), "Rust") {
        for name in quoted(cell).flat_map(|path| path.split("::")) {
            assert!(words.contains(name), "docs/method/notation.md: `{name}` is in no source: {line}");
            checked += 1;
        }
    }
    assert!(checked > 100, "only {checked} names were found in the tables");
}

/// Names that follow `Test: ` or `Tests: ` in a comment, which may continue on the next line, up to
/// the end of the sentence.
fn cited(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("Test: `").chain(text.match_indices("Tests: `")) {
        let rest = &text[at..];
        let end = [". ", ".\n", ";", "\n\n"].iter().filter_map(|stop| rest.find(stop)).min().unwrap_or(rest.len());
        found.extend(quoted(&rest[..end]));
    }
    found
}

/// Tests that comments name after `Test: `, and documents in their tables, are functions, or files,
/// of the workspace.
#[test]
fn cited_tests_exist() {
    let sources = sources();
    let functions = functions(&sources);
    let exists = |name: &str| match name.contains('/') {
        true => sources.iter().any(|s| s.path.contains(&format!("/{name}"))),
        false => functions.contains(name),
    };
    let mut checked = 0;
    let mut check = |name: &str, place: &str| {
        assert!(exists(name), "{place} cites the test `{name}`, which does not exist");
        checked += 1;
    };
    for source in sources.iter().filter(|s| s.path.contains("/src/")) {
        // comment lines joined, so that a list of names may be broken
        let joined: Vec<&str> = source.text.lines().map(|l| l.trim_start().trim_start_matches(['/', '!'])).collect();
        cited(&joined.join("\n")).iter().for_each(|name| check(name, &source.path));
    }
    for (file, heading) in [("docs/method/notation.md", "pinned by"), ("docs/measurements/claims.md", "test")] {
        for (cell, line) in column(&document(file), heading) {
            quoted(cell).for_each(|name| check(name, line));
        }
    }
    assert!(checked > 60, "only {checked} cited tests were found");
}

/// Files that tables of the documents name, by the end of their path.
#[test]
fn cited_files_exist() {
    let sources = sources();
    for (file, heading) in [
        ("docs/method/notation.md", "where"),
        ("docs/measurements/claims.md", "code"),
        ("docs/measurements/performance.md", "code"),
    ] {
        for (cell, line) in column(&document(file), heading) {
            for name in quoted(cell).filter(|name| name.ends_with(".rs")) {
                let ends = |s: &Source| s.path.ends_with(&format!("/{name}"));
                assert!(sources.iter().any(ends), "{file}: there is no file `{name}`: {line}");
            }
        }
    }
}

/// The pages about case files against the reader of case files: every key and word that the reader
/// requests is explained, and every key in the tables is known to the reader.
#[test]
fn every_key_of_a_case_file_is_documented() {
    let sources = sources();
    let text_of = |parts: &[&str]| -> String {
        sources.iter().filter(|s| parts.iter().any(|part| s.path.contains(part))).map(|s| s.text.as_str()).collect()
    };
    let reader = text_of(&["/src/file/read/", "/case/src/quantity/"]);
    // reads keys of its own, among strings that are none
    let deck = text_of(&["/case/src/file/deck.rs"]);
    // the list of quantities names their kinds
    let list = text_of(&["/case/src/quantity/mod.rs"]);
    let kinds = list.rsplit("quantities! {").next().and_then(|rest| rest.split('}').next()).unwrap_or_default();
    let kinds: BTreeSet<&str> = kinds.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(kinds.contains("reaction"), "{kinds:?}");
    let word = |text: &'_ str| text.find(|c: char| !(c.is_ascii_lowercase() || c == '_')).unwrap_or(text.len());
    let read: BTreeSet<&str> = reader
        .split("(\"")
        .skip(1)
        .filter(|rest| rest[word(rest)..].starts_with('"'))
        .map(|rest| &rest[..word(rest)])
        .collect();
    let text: String = case_file_pages().iter().map(|page| document(page)).collect();
    let documented: BTreeSet<&str> = quoted(&text).flat_map(|code| code.split(|c| !is_word(c))).collect();
    assert!(read.len() > 60, "only {} keys were found", read.len());
    let laws = slipstick::case::LawKind::ALL.iter();
    let constants: BTreeSet<&str> = laws.flat_map(|law| law.constants()).map(|constant| constant.key).collect();
    let keys: BTreeSet<&str> = read.union(&constants).chain(&kinds).copied().collect();
    let missing: Vec<_> = keys.iter().filter(|key| !documented.contains(*key)).collect();
    assert!(missing.is_empty(), "the pages in docs/case_file do not explain {missing:?}");
    for (cell, line) in column(&text, "key") {
        for key in quoted(cell) {
            let quoted = format!("\"{key}\"");
            let known =
                constants.contains(key) || kinds.contains(key) || reader.contains(&quoted) || deck.contains(&quoted);
            assert!(known, "docs/case_file: `{key}` is no key: {line}");
        }
    }
    let laws: Vec<&str> = column(&text, "law").into_iter().flat_map(|(cell, _)| quoted(cell)).collect();
    assert_eq!(laws, slipstick::case::LawKind::WORDS, "one row per law in docs/case_file/bodies.md");
}

/// Markdown files in a folder below the root, and in the folders in it if `deep`, by name.
fn pages(folder: &str, deep: bool) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(root().join(folder)).unwrap_or_else(|error| panic!("{folder}: {error}")) {
        let entry = entry.expect("entry");
        let name = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if deep && entry.path().is_dir() {
            found.extend(pages(&name, deep));
        } else if name.ends_with(".md") {
            found.push(name);
        }
    }
    found.sort();
    found
}

/// The page about case files and those of their tables.
fn case_file_pages() -> Vec<String> {
    let mut names = vec!["docs/case_file.md".to_owned()];
    names.extend(pages("docs/case_file", false));
    names
}

/// Documents, and the pages of the cases.
fn documents() -> Vec<String> {
    let mut names = pages(".", false);
    names.push("crates/python/README.md".into());
    for folder in fs::read_dir(root().join("cases")).expect("cases") {
        let name = folder.expect("entry").file_name().to_string_lossy().into_owned();
        let page = format!("cases/{name}/README.md");
        if root().join(&page).exists() {
            names.push(page);
        }
    }
    names.extend(pages("docs", true));
    names
}

/// The table of contents of each book lists all its pages.
#[test]
fn every_page_is_in_a_table_of_contents() {
    let others = ["developers/", "measurements/", "method/"];
    for book in ["docs", "docs/developers", "docs/measurements", "docs/method"] {
        let contents = document(&format!("{book}/SUMMARY.md"));
        for page in documents().iter().filter_map(|name| name.strip_prefix(&format!("{book}/"))) {
            let other = page == "SUMMARY.md" || others.iter().any(|folder| page.starts_with(folder));
            assert!(other || contents.contains(&format!("]({page})")), "{book}/SUMMARY.md does not list {page}");
        }
    }
}

/// `docs/developers/crates.md` explains every direct dependency of the default build.
#[test]
fn every_crate_of_the_build_is_explained() {
    let text = document("docs/developers/crates.md");
    let mut counted = 0;
    for folder in fs::read_dir(root().join("crates")).expect("readable") {
        let manifest = fs::read_to_string(folder.expect("readable").path().join("Cargo.toml")).expect("a manifest");
        let manifest: toml::Table = manifest.parse().expect("TOML");
        for (name, value) in manifest.get("dependencies").and_then(toml::Value::as_table).into_iter().flatten() {
            let optional = value.get("optional").is_some() && name != "metis-sys";
            if !optional && !name.starts_with("slipstick") {
                assert!(
                    text.contains(&format!("| `{name}` |")),
                    "docs/developers/crates.md does not say why `{name}` is there"
                );
                counted += 1;
            }
        }
    }
    assert!(counted > 20, "{counted}");
}

/// Anchors of a page: of its headings, as GitHub and mdBook make them, and those that it sets itself.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut fenced = false;
    for line in text.lines() {
        fenced ^= line.starts_with("```");
        if !fenced && line.starts_with('#') {
            let heading = line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
            found.insert(heading.chars().filter(|&c| is_word(c) || c == '-').collect());
        }
        let own = line.split("<a id=\"").skip(1).filter_map(|rest| rest.split('"').next());
        found.extend(own.map(str::to_owned));
    }
    found
}

/// Relative links of the documents lead to files, and to headings of pages.
#[test]
fn links_lead_to_files_and_headings() {
    let (mut files, mut headings) = (0, 0);
    for name in &documents() {
        let text = document(name);
        let folder = root().join(name).parent().expect("a file").to_path_buf();
        for rest in text.split("](").skip(1) {
            let link = rest.split(')').next().expect("a first part");
            let (target, anchor) = link.split_once('#').unwrap_or((link, ""));
            if target.contains("://") {
                continue;
            }
            let file = if target.is_empty() { root().join(name) } else { folder.join(target) };
            assert!(file.exists(), "{name} links to {target}, which does not exist");
            files += 1;
            if !anchor.is_empty() && file.extension().is_some_and(|end| end == "md") {
                let page = fs::read_to_string(&file).expect("a page");
                assert!(anchors(&page).contains(anchor), "{name} links to {link}: there is no such heading");
                headings += 1;
            }
        }
    }
    assert!(files > 100 && headings > 50, "only {files} links to files and {headings} to headings were found");
}

/// `docs/errors.md` lists every code with its meaning; `docs/measure/errors.sh` writes it.
#[test]
fn the_page_about_errors_lists_every_code() {
    let page = document("docs/errors.md");
    for &code in slipstick::case::CaseCode::ALL {
        let name = code.as_str().rsplit("::").next().expect("a last part");
        let row = format!("| `{name}` | {} |", code.about());
        assert!(page.contains(&row), "docs/errors.md: run docs/measure/errors.sh: {row}");
    }
}

#[test]
fn the_case_on_the_page_about_case_files_builds() {
    let page = document("docs/case_file.md");
    let case = page.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a case file");
    let resolved = slipstick::case::parse_case(case, "docs/case_file.md").unwrap_or_else(|errors| panic!("{errors}"));
    assert!(resolved.warnings.is_empty(), "{:?}", resolved.warnings);
    resolved.require(&["contact", "dirichlet", "design", "objective", "optimizer"]).expect("complete");
    let problem = slipstick::build::build(&resolved.case).unwrap_or_else(|error| panic!("{error}"));
    // by hand: 12·3·4 + 4·2·4
    assert_eq!(problem.mesh.elements.len(), 176);
}

#[test]
fn the_readme_shows_the_program_of_the_python_package() {
    let program = |name: &str| {
        let text = document(name);
        text.split("```python\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a program").to_owned()
    };
    assert_eq!(program("README.md"), program("crates/python/README.md"));
}

/// A crate that includes a file from elsewhere builds here, but not from its package.
#[test]
fn crates_include_their_own_files() {
    let absolute = |path: &Path| path.canonicalize().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut files = 0;
    for source in sources() {
        let Some((own, inner)) = source.path.split_once("/src/") else { continue };
        if inner.ends_with("tests.rs") || inner.contains("tests/") {
            continue;
        }
        for rest in ["include_str!(\"", "include_bytes!(\""].iter().flat_map(|word| source.text.split(word).skip(1)) {
            let (name, _) = rest.split_once('"').expect("the end of a name");
            let file = absolute(&Path::new(&source.path).with_file_name(name));
            assert!(file.starts_with(absolute(Path::new(own))), "{} includes {name} of another folder", source.path);
            files += 1;
        }
    }
    assert!(files > 5, "only {files} included files");
}

/// Files outside of Cargo that name the version: a release must not announce two.
#[test]
fn one_version() {
    let version = env!("CARGO_PKG_VERSION");
    for (file, line) in [
        ("CITATION.cff", format!("version: {version}\n")),
        ("packaging/conda/recipe.yaml", format!("  version: \"{version}\"\n")),
        ("CHANGELOG.md", format!("## {version}")),
    ] {
        assert!(document(file).contains(&line), "{file} has another version than {version}");
    }
}

#[test]
fn ranges_and_lists_of_equations_are_read() {
    let read = |tag: &str| numbers(tag).into_iter().collect::<Vec<_>>();
    assert_eq!(read("(37)–(39) and (46), Popp et al. (2010); `f(x)`. (23b)–(24)"), [23, 24, 37, 38, 39, 46]);
    assert!(read("section 2.3.").is_empty());
}

#[test]
fn citations_are_read() {
    let text = "Paper: (1). Tests: `a`, `b` (tests/b.rs),\n `c`. Not `this`.\n\nTest: `d`\n\n`e`";
    assert_eq!(cited(text), ["d", "a", "b", "c"]);
}
