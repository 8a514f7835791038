//! Verification against external references: analytic solutions, published numbers, other programs.
//! This suite writes `docs/measurements/verification.md` from `results.json`.
//!
//! The quick problems run with all tests. The whole suite writes the page:
//! `cargo test --release -p slipstick --test verification -- --ignored`; with
//! `SLIPSTICK_VERIFY=ring,hertz` only some chapters run.

mod beams;
mod chapter;
#[path = "../common/mod.rs"]
mod common;
mod cylinder;
mod finding;
mod fourc;
mod hertz;
mod mapped;
mod mindlin;
mod nafems;
mod necking;
mod objectivity;
mod patch;
mod peers;
mod plasticity;
mod press_fit;
mod ring;
mod roller;
mod sliding;
mod solved;
mod treloar;

use chapter::{Chapter, Record, chapters};
use std::time::Instant;

/// Runs a chapter and prints its findings; `None` if its data are not available.
fn run(chapter: &Chapter) -> Option<Record> {
    let start = Instant::now();
    let findings = (chapter.run)()?;
    let seconds = start.elapsed().as_secs_f64().round() as u64;
    println!("{} ({seconds} s)", chapter.title);
    for finding in &findings {
        let deviation = finding.deviation().map_or(String::new(), |d| format!("{:+.3e}", d));
        let verdict = if finding.holds() {
            ""
        } else if finding.known {
            "  outside, known"
        } else {
            "  OUTSIDE"
        };
        println!("  {:60} {:>14.8e}  {deviation}{verdict}  of {:?}", finding.what, finding.found, finding.expected);
    }
    Some(Record { seconds, findings })
}

fn assert_inside(chapter: &Chapter, record: &Record) {
    // findings that are known to lie outside must do so, or their mark and explanation are out of
    // date
    let surprises: Vec<_> = record.findings.iter().filter(|finding| finding.holds() == finding.known).collect();
    assert!(surprises.is_empty(), "{}: {surprises:#?}", chapter.title);
}

/// The page agrees with the committed results: neither was edited without the other.
#[test]
fn the_page_shows_the_results() {
    let page = std::fs::read_to_string(chapter::page_file()).expect("docs/measurements/verification.md");
    assert_eq!(page, chapter::page(&chapter::read()), "write the page again: run the suite");
}

/// Problems that take seconds, with the bounds of the whole suite.
#[test]
fn quick_problems() {
    for chapter in chapters().iter().filter(|chapter| chapter.quick) {
        let record = run(chapter).expect("quick problems need no data from elsewhere");
        assert_inside(chapter, &record);
    }
}

/// Every problem, or those listed in `SLIPSTICK_VERIFY`; writes results and page, then asserts the
/// bounds.
#[test]
#[ignore = "the whole suite takes many minutes"]
fn all_problems() {
    let chosen = std::env::var("SLIPSTICK_VERIFY").ok();
    let chosen: Option<Vec<&str>> = chosen.as_ref().map(|names| names.split(',').collect());
    let all = chapters();
    for name in chosen.iter().flatten() {
        assert!(all.iter().any(|chapter| chapter.key == *name), "SLIPSTICK_VERIFY: there is no chapter `{name}`");
    }
    let mut records = chapter::read();
    let mut done = Vec::new();
    for chapter in all.iter().filter(|chapter| chosen.as_ref().is_none_or(|names| names.contains(&chapter.key))) {
        match run(chapter) {
            Some(record) => {
                records.insert(chapter.key.into(), record);
                chapter::write(&records);
                done.push(chapter);
            }
            None => println!("SKIPPED: {}; its committed results stay", chapter.title),
        }
    }
    for chapter in done {
        assert_inside(chapter, &records[chapter.key]);
    }
}
