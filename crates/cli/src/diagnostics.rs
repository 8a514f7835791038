//! Diagnostics as text.

use std::fmt::Write as _;

use slipstick::case::CaseDiagnostic;

/// Diagnostics for people: with the lines of the file on a terminal, otherwise
/// `file:line:column: …`.
pub fn report(diagnostics: &[CaseDiagnostic], terminal: bool) -> String {
    let mut text = String::new();
    let handler = miette::GraphicalReportHandler::new();
    for diagnostic in diagnostics {
        if !terminal || handler.render_report(&mut text, diagnostic).is_err() {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}", diagnostic.plain());
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use slipstick::case::parse_case;

    use super::*;

    #[test]
    fn errors_are_shown_with_place_and_code() {
        let errors = parse_case("titel = 1\n[load_path]\nsteps = 0\n", "c.toml").expect_err("wrong");
        let plain = report(errors.diagnostics(), false);
        assert!(plain.contains("c.toml:1:1: error: unknown key `titel`"), "{plain}");
        assert!(plain.contains("c.toml:3:9: error: `steps`"), "{plain}");
        let shown = report(errors.diagnostics(), true);
        assert!(shown.contains("slipstick::case::steps") && shown.contains("steps = 0"), "{shown}");
    }
}
