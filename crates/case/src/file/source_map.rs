//! The place of each value of a case in its file.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use miette::NamedSource;
use slipstick_model::words::visible;

use super::{CaseCode, CaseDiagnostic, CaseErrors, Severity};

/// Finds the place in the file of a value named by its path, like `contact[0].slave` or
/// `body[1].material.neo_hooke.youngs_modulus`.
///
/// With it, problems that are found later (an empty set, an initial penetration) can still point to
/// the file.
#[derive(Debug, Clone)]
pub struct SourceMap {
    source: Arc<NamedSource<String>>,
    line_starts: Vec<usize>,
    spans: BTreeMap<String, Range<usize>>,
}

impl SourceMap {
    pub(super) fn new(text: &str, file_name: &str) -> Self {
        let newlines = text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n');
        Self {
            source: Arc::new(NamedSource::new(file_name, text.to_owned()).with_language("TOML")),
            line_starts: std::iter::once(0).chain(newlines.map(|(i, _)| i + 1)).collect(),
            spans: BTreeMap::new(),
        }
    }

    pub(super) fn insert(&mut self, path: String, span: Range<usize>) {
        self.spans.insert(path, span);
    }

    /// The file's name as given to the parser.
    pub fn file(&self) -> &str {
        self.source.name()
    }

    /// The file's text.
    pub fn text(&self) -> &str {
        self.source.inner()
    }

    /// Whether the file contains the value, rather than a default.
    pub fn contains(&self, path: &str) -> bool {
        self.spans.contains_key(path)
    }

    /// Byte range of a value; if it is not in the file, that of the nearest enclosing table; if
    /// there is none, the start of the file.
    pub fn span(&self, path: &str) -> Range<usize> {
        let mut path = path;
        loop {
            if let Some(span) = self.spans.get(path) {
                return span.clone();
            }
            match path.rfind(['.', '[']) {
                Some(end) => path = &path[..end],
                None => return 0..0,
            }
        }
    }

    /// Line and column, both from 1, columns in characters.
    pub fn position(&self, offset: usize) -> (usize, usize) {
        let line = self.line_starts.partition_point(|&start| start <= offset);
        let start = self.line_starts[line - 1];
        let before = self.text().get(start..offset).unwrap_or_default();
        (line, before.chars().count() + 1)
    }

    /// A diagnostic at the value that `path` names.
    pub fn diagnostic(
        &self,
        severity: Severity,
        path: &str,
        code: CaseCode,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> CaseDiagnostic {
        self.diagnostic_at(severity, self.span(path), code, message, help)
    }

    pub(super) fn diagnostic_at(
        &self,
        severity: Severity,
        span: Range<usize>,
        code: CaseCode,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> CaseDiagnostic {
        let end = self.text().len();
        let span = span.start.min(end)..span.end.clamp(span.start.min(end), end);
        let (line, column) = self.position(span.start);
        let mut help = help.into();
        if let Some(origin) = super::deck::origin(self.text(), span.start) {
            help = [help, format!("this table comes from {origin}")]
                .into_iter()
                .filter(|text| !text.is_empty())
                .collect::<Vec<_>>()
                .join("; ");
        }
        CaseDiagnostic {
            code,
            severity,
            message: visible(&message.into()).into_owned(),
            label: String::new(),
            help: visible(&help).into_owned(),
            span,
            line,
            column,
            source: Arc::clone(&self.source),
        }
    }

    /// A single error at the value that `path` names.
    pub fn error(&self, path: &str, code: CaseCode, message: impl Into<String>, help: impl Into<String>) -> CaseErrors {
        self.diagnostic(Severity::Error, path, code, message, help).into()
    }

    /// A warning at the value that `path` names.
    pub fn warning(
        &self,
        path: &str,
        code: CaseCode,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> CaseDiagnostic {
        self.diagnostic(Severity::Warning, path, code, message, help)
    }
}
