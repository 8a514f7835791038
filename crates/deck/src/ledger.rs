//! How each keyword of a deck is treated.

use std::collections::BTreeMap;

use slipstick_meshio::abaqus::Places;

/// How a keyword is treated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum How {
    /// It defines the mesh, its sets, or what other keywords refer to.
    Used,
    /// It is translated; how.
    Translated(String),
    /// It does not change the physics, or the user accepts that; why.
    Ignored(String),
    /// It cannot be translated; why.
    Refused(String),
}

impl How {
    /// `used`, `translated`, `ignored` or `refused`.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::Translated(_) => "translated",
            Self::Ignored(_) => "ignored",
            Self::Refused(_) => "refused",
        }
    }

    /// How or why; empty for [`How::Used`].
    pub fn text(&self) -> &str {
        match self {
            Self::Used => "",
            Self::Translated(text) | Self::Ignored(text) | Self::Refused(text) => text,
        }
    }
}

/// A keyword at its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeywordUse {
    /// In capitals, without the asterisk.
    pub keyword: String,
    /// The file, as the deck or an `*INCLUDE` names it.
    pub file: String,
    /// Its line.
    pub line: usize,
    /// How it is treated.
    pub how: How,
}

/// Why a deck cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The file, as the deck or an `*INCLUDE` names it.
    pub file: String,
    /// The line.
    pub line: usize,
    /// The keyword, in capitals, and what is wrong.
    pub message: String,
    /// What to do.
    pub cure: String,
}

/// Every keyword of a deck, and what is refused.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Ledger {
    /// In the order of the deck.
    pub uses: Vec<KeywordUse>,
    refusals: Vec<Refusal>,
    ignored: Vec<String>,
    file: String,
}

impl Ledger {
    pub(crate) fn new(file: &str, ignored: &[String]) -> Self {
        let plain = |keyword: &String| {
            let keyword = keyword.trim_start_matches('*').to_ascii_uppercase();
            keyword.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        Self { file: file.to_owned(), ignored: ignored.iter().map(plain).collect(), ..Self::default() }
    }

    /// Whether the user accepts that a keyword is left out.
    pub(crate) fn ignores(&self, keyword: &str) -> bool {
        self.ignored.iter().any(|ignored| ignored == keyword)
    }

    /// Sets how the keyword of a line is treated; the first refusal of a keyword stays.
    pub(crate) fn set(&mut self, keyword: &str, line: usize, how: How) {
        let known = self.uses.iter_mut().rev().find(|entry| entry.line == line && entry.keyword == keyword);
        match known {
            Some(entry) if matches!(entry.how, How::Refused(_)) => {}
            Some(entry) => entry.how = how,
            None => self.uses.push(KeywordUse { keyword: keyword.to_owned(), file: String::new(), line, how }),
        }
    }

    pub(crate) fn used(&mut self, keyword: &str, line: usize) {
        self.set(keyword, line, How::Used);
    }

    pub(crate) fn translated(&mut self, keyword: &str, line: usize, how: impl Into<String>) {
        self.set(keyword, line, How::Translated(how.into()));
    }

    pub(crate) fn ignored(&mut self, keyword: &str, line: usize, why: impl Into<String>) {
        self.set(keyword, line, How::Ignored(why.into()));
    }

    /// Refuses a keyword because of one of its lines, unless the user ignores it.
    pub(crate) fn refuse_at(&mut self, keyword: &str, lines: [usize; 2], why: impl Into<String>, cure: &str) {
        let (why, [line, _]) = (why.into(), lines);
        if self.ignores(keyword) {
            return self.set(keyword, line, How::Ignored(format!("as requested: {why}")));
        }
        let cure = format!("{cure}; `--ignore \"{keyword}\"` leaves it out");
        self.reject(keyword, lines, why, cure);
    }

    fn reject(&mut self, keyword: &str, [line, at]: [usize; 2], why: String, cure: String) {
        self.set(keyword, line, How::Refused(why.clone()));
        let refusal = Refusal { file: String::new(), line: at, message: format!("*{keyword}: {why}"), cure };
        if !self.refusals.contains(&refusal) {
            self.refusals.push(refusal);
        }
    }

    /// Refuses a keyword, unless the user ignores it.
    pub(crate) fn refuse(&mut self, keyword: &str, line: usize, why: impl Into<String>, cure: &str) {
        self.refuse_at(keyword, [line, line], why, cure);
    }

    /// An error that the user cannot accept.
    pub(crate) fn wrong(&mut self, keyword: &str, lines: [usize; 2], why: impl Into<String>, cure: &str) {
        self.reject(keyword, lines, why.into(), cure.to_owned());
    }

    /// How much is refused so far.
    pub(crate) fn count(&self) -> usize {
        self.refusals.len()
    }

    /// Why the deck cannot be used.
    pub(crate) fn refusals(&self) -> Vec<Refusal> {
        let mut refusals = self.refusals.clone();
        refusals.sort_by(|a, b| (&a.file, a.line).cmp(&(&b.file, b.line)));
        refusals
    }

    /// Replaces lines of the flat text by places in files.
    pub(crate) fn place(&mut self, places: &Places) {
        let deck = self.file.clone();
        let named = |file: &str| if file.is_empty() { deck.clone() } else { file.to_owned() };
        for entry in &mut self.uses {
            let (file, line) = places.of(entry.line);
            (entry.file, entry.line) = (named(file), line);
        }
        // a card of a part counts once, whatever the number of instances
        let mut seen = Vec::new();
        self.uses.retain(|entry| {
            let new = !seen.contains(entry);
            if new && seen.len() < 10_000 {
                seen.push(entry.clone());
            }
            new
        });
        for refusal in &mut self.refusals {
            let (file, line) = places.of(refusal.line);
            (refusal.file, refusal.line) = (named(file), line);
        }
        self.refusals.dedup();
    }

    /// The table for people: keyword, how it is treated, lines, and how or why.
    pub fn table(&self) -> Vec<[String; 4]> {
        let mut rows: BTreeMap<(usize, &str, &str), (&'static str, Vec<String>)> = BTreeMap::new();
        let order = |how: &How| match how {
            How::Refused(_) => 0,
            How::Translated(_) => 1,
            How::Used => 2,
            How::Ignored(_) => 3,
        };
        for entry in &self.uses {
            let key = (order(&entry.how), entry.keyword.as_str(), entry.how.text());
            let line =
                if entry.file == self.file { entry.line.to_string() } else { format!("{}:{}", entry.file, entry.line) };
            rows.entry(key).or_insert_with(|| (entry.how.word(), Vec::new())).1.push(line);
        }
        rows.into_iter()
            .map(|((_, keyword, text), (word, lines))| {
                [format!("*{keyword}"), word.to_owned(), shown(&lines), text.to_owned()]
            })
            .collect()
    }
}

/// Up to six lines.
fn shown(lines: &[String]) -> String {
    match lines.len() {
        0..=6 => lines.join(", "),
        more => format!("{}, … ({more})", lines[..5].join(", ")),
    }
}
