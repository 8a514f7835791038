//! Checks that the pages of the book work: their shell blocks are run in order, and must print the
//! text shown.
//!
//! | block | meaning |
//! |---|---|
//! | `sh` | run, each in its own shell, all blocks of a page in one folder that contains the repository's `cases` |
//! | `sh slow` | the same on demand; in ordinary tests, its optimizations make one iteration |
//! | `text` | output of the previous block: its lines in order; `…` is any text, a line `…` any lines |
//! | `text slow` | the same, compared on demand |
//! | `sh python`, `sh gmsh`, `sh ccx` | run where Python, Gmsh for Python, or CalculiX is installed |
//! | `toml NAME`, `python NAME` | a file |
//!
//! On demand, in some minutes:
//! `cargo test --release -p slipstick-cli --test tutorials -- --ignored`

#![cfg(unix)]

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

const PAGES: [&str; 11] = [
    "install.md",
    "requirements.md",
    "materials.md",
    "tutorials/first_design.md",
    "tutorials/my_mesh.md",
    "tutorials/from_cad.md",
    "tutorials/part.md",
    "tutorials/report.md",
    "tutorials/verify_gradient.md",
    "decks.md",
    "how_to.md",
];

/// A fenced block of a page.
struct Block<'a> {
    line: usize,
    words: Vec<&'a str>,
    text: String,
}

fn blocks(page: &str) -> Vec<Block<'_>> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut open = false;
    for (number, line) in page.lines().enumerate() {
        match line.strip_prefix("```") {
            Some(_) if open => open = false,
            Some(words) => {
                open = true;
                blocks.push(Block { line: number + 1, words: words.split(' ').collect(), text: String::new() });
            }
            None if open => {
                let block = blocks.last_mut().expect("open");
                block.text += line;
                block.text.push('\n');
            }
            None => {}
        }
    }
    assert!(!open, "a block has no end");
    blocks
}

/// Whether the line is as shown: `…` is any text, and runs of spaces are equal.
fn alike(shown: &str, line: &str) -> bool {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let (shown, line) = (words(shown), words(line));
    let mut parts = shown.split('…').map(str::trim);
    let Some(mut rest) = line.strip_prefix(parts.next().unwrap_or("")) else { return false };
    let parts: Vec<&str> = parts.collect();
    let Some((last, middle)) = parts.split_last() else { return rest.is_empty() };
    for part in middle {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

/// The first of the shown lines that is not printed in its place.
fn missing<'a>(shown: &'a str, printed: &str) -> Option<&'a str> {
    let mut lines = printed.lines();
    let mut any = false;
    for shown in shown.lines() {
        if shown.trim() == "…" {
            any = true;
            continue;
        }
        let found =
            if any { lines.any(|line| alike(shown, line)) } else { lines.next().is_some_and(|l| alike(shown, l)) };
        if !found {
            return Some(shown);
        }
        any = false;
    }
    None
}

/// A program that a block needs and that is not installed.
fn lacks(words: &[&str]) -> Option<&'static str> {
    let needed: [(_, &[&str]); 3] =
        [("python", &["python3", "--version"]), ("gmsh", &["python3", "-c", "import gmsh"]), ("ccx", &["ccx", "-v"])];
    let (word, command) = needed.into_iter().find(|(word, _)| words.contains(word))?;
    let found = Command::new(command[0]).args(&command[1..]).output();
    // CalculiX ends with another status than 0 whatever it is asked
    let works = found.is_ok_and(|output| word == "ccx" || output.status.success());
    (!works).then_some(word)
}

fn run(page: &str, whole: bool) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the repository");
    let text = std::fs::read_to_string(root.join("docs").join(page)).unwrap_or_else(|error| panic!("{page}: {error}"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::os::unix::fs::symlink(root.join("cases"), folder.path().join("cases")).expect("linked");
    let program = PathBuf::from(env!("CARGO_BIN_EXE_slipstick"));
    let path = format!("{}:{}", program.parent().expect("a folder").display(), std::env::var("PATH").expect("a path"));
    let (mut printed, mut commands, mut skipped, mut lacking) = (String::new(), 0, false, 0);
    for Block { line, words, text } in blocks(&text) {
        let slow = words.get(1) == Some(&"slow");
        match words[0] {
            "sh" if let Some(program) = lacks(&words) => {
                // Print directly to the terminal, because the test harness captures `eprintln!`.
                let _ = writeln!(std::io::stderr(), "SKIPPED docs/{page}:{line}: no {program}");
                (skipped, lacking) = (true, lacking + 1);
            }
            "sh" => {
                skipped = false;
                let quick = |line: &str| match line.starts_with("slipstick optimize") {
                    true => format!("{line} --iterations 1\n"),
                    false => format!("{line}\n"),
                };
                let script = if slow && !whole { text.lines().map(quick).collect() } else { text.clone() };
                let shell = Command::new("sh").args(["-euc", &script]).current_dir(&folder).env("PATH", &path).output();
                let output = shell.expect("a shell");
                let said = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "docs/{page}:{line}:\n{text}\n{said}");
                printed = String::from_utf8_lossy(&output.stdout).into_owned();
                commands += 1;
            }
            "text" if (whole || !slow) && !skipped => {
                if let Some(shown) = missing(&text, &printed) {
                    panic!("docs/{page}:{line}: not printed: {shown}\nbut:\n{printed}");
                }
            }
            "text" => {}
            "toml" | "python" if words.len() == 2 => {
                std::fs::write(folder.path().join(words[1]), text).expect("written")
            }
            _ => {}
        }
    }
    assert!(commands + lacking > 1, "docs/{page} has no commands");
}

#[test]
fn commands_of_the_pages_run() {
    for page in PAGES {
        run(page, false);
    }
}

#[test]
#[ignore = "takes minutes"]
fn commands_of_the_pages_run_as_they_are() {
    for page in PAGES {
        run(page, true);
    }
}

#[test]
fn lines_are_compared() {
    assert!(alike("a  b", "a b") && alike("a … c", "a b c") && alike("…", "x") && alike("a …", "a b"));
    assert!(!alike("a b", "a c") && !alike("a … d", "a b c") && !alike("… b", "a c"));
    let printed = "one\ntwo\nthree\nfour\n";
    for right in ["one\ntwo\n…\n", "…\nthree\nfour\n", "one\n…\nfour\n", "…\n", "one\ntwo\nthree\nfour\n"] {
        assert_eq!(missing(right, printed), None, "{right}");
    }
    for (wrong, line) in [("two\n", "two"), ("one\n…\nfive\n", "five"), ("…\nfour\nthree\n", "three")] {
        assert_eq!(missing(wrong, printed), Some(line), "{wrong}");
    }
}
