//! The chapters of the suite, and the page generated from them.

use crate::finding::{Expected, Finding};
use crate::{
    beams, cylinder, fourc, hertz, mindlin, nafems, necking, objectivity, patch, peers, plasticity, press_fit, ring,
    roller, sliding, treloar,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A problem, or several problems from one source.
pub struct Chapter {
    /// Name for `SLIPSTICK_VERIFY`.
    pub key: &'static str,
    /// Heading.
    pub title: &'static str,
    /// The computed problem, and the source of the expected numbers. Markdown.
    pub about: &'static str,
    /// Interpretation of the findings: discretization, known deviations and their cause. Markdown,
    /// or empty.
    pub remarks: &'static str,
    /// Whether it runs with all other tests, not only on request.
    pub quick: bool,
    /// Computes; `None` if the external data are not available.
    pub run: fn() -> Option<Vec<Finding>>,
}

/// All chapters, in the order of the page.
pub fn chapters() -> Vec<Chapter> {
    let mut all = vec![patch::chapter()];
    all.extend(sliding::chapters());
    all.extend([ring::chapter(), press_fit::chapter(), objectivity::chapter()]);
    all.extend([cylinder::chapter(), treloar::chapter(), roller::chapter(), beams::chapter()]);
    all.extend(plasticity::chapters());
    all.push(necking::chapter());
    all.extend(peers::chapters());
    all.extend([hertz::chapter(), mindlin::chapter(), nafems::chapter(), fourc::chapter()]);
    all
}

/// The last findings of a chapter.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Record {
    /// Time of the run in seconds, rounded.
    pub seconds: u64,
    /// Its numbers.
    pub findings: Vec<Finding>,
}

impl Record {
    /// How many numbers have a bound.
    fn bounded(&self) -> usize {
        let free = |finding: &&Finding| matches!(finding.expected, Expected::Compare(_) | Expected::Shown);
        self.findings.iter().filter(|finding| !free(finding)).count()
    }

    /// How many numbers lie outside their bound.
    fn outside(&self) -> usize {
        self.findings.iter().filter(|finding| !finding.holds()).count()
    }
}

/// The last findings of all chapters, by key.
pub type Records = BTreeMap<String, Record>;

fn records_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/verification/results.json")
}

/// The page of the suite.
pub fn page_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/measurements/verification.md")
}

/// The committed results.
pub fn read() -> Records {
    let text = std::fs::read_to_string(records_file()).unwrap_or_else(|_| "{}".into());
    serde_json::from_str(&text).expect("results.json is what the suite wrote")
}

/// Writes results and page.
pub fn write(records: &Records) {
    let text = serde_json::to_string_pretty(records).expect("numbers");
    std::fs::write(records_file(), text + "\n").expect("the suite's folder is writable");
    std::fs::write(page_file(), page(records)).expect("the folder of documents is writable");
}

const HEAD: &str = "\
# Verification

This page compares results of slipstick with analytic solutions, published numbers and other
programs. The suite `crates/slipstick/tests/verification` computes all its numbers and writes the
page; do not edit it by hand. Gradients are verified elsewhere, against finite differences
([method](../method/contact.md), `slipstick verify gradient`).

    cargo test --release -p slipstick --test verification -- --ignored       all problems; writes results and this page
    SLIPSTICK_VERIFY=ring,hertz cargo test …                                 some of them

The column *expected* contains one of three things: the value from the source with the relative
bound that the suite asserts; a band; or *at most*, for quantities that should be zero. *compared
with* means that there is no bound and the deviation itself is the result, as in the steps of a
convergence study. Numbers without an expectation help to explain others. *seconds* are wall time, on
machines that also ran other programs. The bounds are not fitted to the results: numbers outside are
marked as such, and the text explains why they are outside.
";

/// Comparisons that other pages describe. Their tests assert bounds on the deviations.
const ELSEWHERE: &str = "
Other tests compare with outside numbers too:

| problem | compared with | largest deviation | where |
|---|---|---|---|
| block sliding between two blocks, μ = 0.5 | code_aster (SSNP503): pressures where an edge lies at a node | 0.06 % of a pressure | [edges](edges.md#comparison-with-code_aster), `tests/suite/edges` |
";

/// The page of these results.
pub fn page(records: &Records) -> String {
    let mut page = HEAD.to_owned();
    let chapters = chapters();
    page += "\n| problem | numbers | with a bound | outside | seconds |\n|---|---|---|---|---|\n";
    for chapter in &chapters {
        let anchor: String = chapter
            .title
            .to_lowercase()
            .chars()
            .filter_map(|c| if c == ' ' { Some('-') } else { (c.is_alphanumeric() || "-_".contains(c)).then_some(c) })
            .collect();
        let _ = match records.get(chapter.key) {
            Some(record) => writeln!(
                page,
                "| [{}](#{anchor}) | {} | {} | {} | {} |",
                chapter.title,
                record.findings.len(),
                record.bounded(),
                record.outside(),
                record.seconds
            ),
            None => writeln!(page, "| {} | not run | | | |", chapter.title),
        };
    }
    let all: Vec<&Record> = chapters.iter().filter_map(|chapter| records.get(chapter.key)).collect();
    let sum = |of: &dyn Fn(&Record) -> usize| all.iter().map(|record| of(record)).sum::<usize>();
    let _ = writeln!(
        page,
        "| total | {} | {} | {} | {} |",
        sum(&|record| record.findings.len()),
        sum(&Record::bounded),
        sum(&Record::outside),
        all.iter().map(|record| record.seconds).sum::<u64>()
    );
    page += ELSEWHERE;
    for chapter in &chapters {
        let _ = writeln!(page, "\n## {}\n\n{}", chapter.title, chapter.about.trim());
        if let Some(record) = records.get(chapter.key) {
            page += "\n| | expected | found | deviation |\n|---|---|---|---|\n";
            for finding in &record.findings {
                page += &row(finding);
            }
        }
        if !chapter.remarks.is_empty() {
            let _ = writeln!(page, "\n{}", chapter.remarks.trim());
        }
    }
    page
}

fn row(finding: &Finding) -> String {
    let expected = match finding.expected {
        Expected::Value { value, within } => format!("{} ± {}", number(value), percent(within).trim_start_matches('+')),
        Expected::Band { low, high } => format!("{} … {}", number(low), number(high)),
        Expected::AtMost(most) => format!("at most {}", number(most)),
        Expected::Compare(value) => format!("compared with {}", number(value)),
        Expected::Shown => String::new(),
    };
    let outside = if finding.holds() { "" } else { " **outside**" };
    let deviation = match finding.deviation() {
        Some(0.0) if matches!(finding.expected, Expected::Band { .. }) => "inside".into(),
        Some(deviation) => percent(deviation),
        None => String::new(),
    };
    format!("| {} | {expected} | {} | {deviation}{outside} |\n", finding.what, number(finding.found))
}

/// Six significant digits, or two with an exponent for small numbers.
fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".into()
    } else if size < 1e-3 {
        format!("{value:.1e}")
    } else {
        let digits = (5 - size.log10().floor() as i32).clamp(0, 8) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    }
}

fn percent(deviation: f64) -> String {
    match deviation.abs() {
        0.0 => "0".into(),
        size if size < 1e-5 => format!("{deviation:+.1e}"),
        size if size < 1e-3 => format!("{:+.3} %", 100.0 * deviation),
        _ => format!("{:+.2} %", 100.0 * deviation),
    }
}
