//! Why a valid case cannot be built.

use crate::file::CaseCode;

/// Why a valid case cannot be built: the place in the case, the problem, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {message}; {help}")]
pub struct BuildError {
    /// Its stable code.
    pub code: CaseCode,
    /// Dotted path of the offending entry in the case file, like `contact[0].slave`.
    pub path: String,
    /// What is wrong.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl BuildError {
    /// An error at this place, with the code that errors at this place have.
    pub fn new(path: impl Into<String>, message: impl ToString, help: impl Into<String>) -> Self {
        let path = path.into();
        Self { code: code_of(&path), path, message: message.to_string(), help: help.into() }
    }

    /// The same with a more specific code.
    pub fn with_code(self, code: CaseCode) -> Self {
        Self { code, ..self }
    }
}

/// The code of an error at this place, if none is more specific.
fn code_of(path: &str) -> CaseCode {
    let has = |part: &str| path.contains(part);
    match path.split(['[', '.']).next().unwrap_or_default() {
        "body" if has(".material") => CaseCode::OutOfRange,
        "body" => CaseCode::Mesh,
        "set" | "surface" if has(".within") => CaseCode::UnknownSet,
        "set" | "surface" => CaseCode::EmptySet,
        "dirichlet" => CaseCode::ConflictingDirichlet,
        "contact" if has(".cell_rule") => CaseCode::CellRule,
        "design" if has(".bodies") => CaseCode::UnknownBody,
        "design" if has(".initial") => CaseCode::Fraction,
        "design" if has(".volume_fraction") => CaseCode::InfeasibleVolume,
        "design" if has(".symmetry") || has(".pattern") || has(".extrude") => CaseCode::AsymmetricMesh,
        "design" if has(".overhang") => CaseCode::Unsupported,
        "design" => CaseCode::ContradictoryPassive,
        "optimizer" if has(".volume_fraction") => CaseCode::InfeasibleVolume,
        "objective" if has(".contact_force") => CaseCode::NoContact,
        "objective" => CaseCode::Steps,
        _ => CaseCode::Unsupported,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_have_a_code_and_errors_may_have_another() {
        let code = |path: &str| BuildError::new(path, "", "").code;
        assert_eq!(code("body[0].material.table"), CaseCode::OutOfRange);
        assert_eq!(code("body[1]"), CaseCode::Mesh);
        assert_eq!(code("design.symmetry[0]"), CaseCode::AsymmetricMesh);
        assert_eq!(code("solver.linear"), CaseCode::Unsupported);
        let error = BuildError::new("contact[0].slave", "there is no surface `x`", "");
        assert_eq!(error.with_code(CaseCode::UnknownSet).code, CaseCode::UnknownSet);
    }
}
