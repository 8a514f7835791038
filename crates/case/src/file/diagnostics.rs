//! Errors and warnings about a case file, each with a stable code and its place in the file.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

macro_rules! case_codes {
    ($($(#[doc = $doc:literal])+ $variant:ident => $name:literal,)+) => {
        /// Stable codes of all errors and warnings about a case file.
        ///
        /// A code keeps its meaning from version to version; the wording of a message may change.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum CaseCode { $($(#[doc = $doc])+ $variant,)+ }

        impl CaseCode {
            /// Every code.
            pub const ALL: &[Self] = &[$(Self::$variant),+];

            /// The code as messages show it: `slipstick::case::unknown_key`.
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => concat!("slipstick::case::", $name),)+ }
            }

            /// What it means, in a sentence or two.
            pub fn about(self) -> &'static str {
                match self { $(Self::$variant => concat!($($doc),+).trim_ascii(),)+ }
            }
        }
    };
}

case_codes! {
    /// The text is not TOML.
    Syntax => "syntax",
    /// A key that does not exist here.
    UnknownKey => "unknown_key",
    /// A required key is missing.
    MissingKey => "missing_key",
    /// A section that the command needs is missing.
    MissingSection => "missing_section",
    /// A value of the wrong type.
    WrongType => "wrong_type",
    /// None or several of a group of keys are given, although exactly one is required (a body's
    /// shape, a material, …).
    ChooseOne => "choose_one",
    /// A word that is not one of the allowed ones.
    UnknownWord => "unknown_word",
    /// A number that is infinite or not a number.
    NotFinite => "not_finite",
    /// A number is out of range, and no more specific code applies.
    OutOfRange => "out_of_range",
    /// An empty list or name where a value is needed.
    Empty => "empty",
    /// A name with characters other than letters, digits, `_` and `-`.
    BadName => "bad_name",
    /// Two bodies, sets or surfaces with the same name, or one entry listed twice.
    DuplicateName => "duplicate_name",
    /// There is no body with this name.
    UnknownBody => "unknown_body",
    /// There is no set or surface with this name.
    UnknownSet => "unknown_set",
    /// A node set where a surface is needed.
    NotASurface => "not_a_surface",
    /// A box or ring whose lower bound is not below its upper bound.
    BadShape => "bad_shape",
    /// Invalid number of elements.
    Elements => "elements",
    /// Young's modulus is not positive.
    YoungsModulus => "youngs_modulus",
    /// Poisson's ratio is outside (−1, 1/2).
    PoissonRatio => "poisson_ratio",
    /// Constants of a material that contradict each other, or make the undeformed solid unstable.
    MaterialConstants => "material_constants",
    /// The coefficient of friction is negative.
    Friction => "friction",
    /// Slave and master are the same surface.
    SameSurface => "same_surface",
    /// Slave and master are surfaces of the same body.
    SameBody => "same_body",
    /// There is no integration rule with this number of points.
    CellRule => "cell_rule",
    /// The times of waypoints do not increase, or lie outside (0, 1].
    MotionTime => "motion_time",
    /// A motion that contradicts itself or the other keys of its table.
    Motion => "motion",
    /// Two conditions prescribe the same component of the same nodes.
    ConflictingDirichlet => "conflicting_dirichlet",
    /// Invalid number of load steps, or a load step that does not exist.
    Steps => "steps",
    /// A SIMP parameter is out of range.
    Simp => "simp",
    /// A density or volume fraction is outside (0, 1]; as a warning: a schedule ends with another bound
    /// on the volume than all other commands use.
    Fraction => "fraction",
    /// The design has no elements to optimize.
    EmptyDesign => "empty_design",
    /// The passive solid elements already exceed the volume fraction.
    InfeasibleVolume => "infeasible_volume",
    /// The passive solid and passive void regions share elements.
    ContradictoryPassive => "contradictory_passive",
    /// The mesh of the design bodies does not have the symmetry, the pattern or the columns that the
    /// design is to have.
    AsymmetricMesh => "asymmetric_mesh",
    /// The initial design violates the volume constraint because of its density or its passive
    /// solid elements (warning).
    InitialVolume => "initial_volume",
    /// A passive region contains no element of the design (warning).
    EmptyPassiveRegion => "empty_passive_region",
    /// The filter radius is so small that no element has a neighbour within it (warning).
    IdleFilter => "idle_filter",
    /// The void of a designed body is stiffer than a body that touches it (warning).
    StiffVoid => "stiff_void",
    /// The objective is the work of the loads, and temperatures move the loads as well (warning).
    HeatedCompliance => "heated_compliance",
    /// An optimizer that relies on exact gradients gets filtered ones (warning).
    FilteredGradients => "filtered_gradients",
    /// An entry of a schedule that no update follows (warning).
    LateSchedule => "late_schedule",
    /// Supports and prescribed motions leave a body free to move (warning).
    UnsupportedBody => "unsupported_body",
    /// A waypoint of a motion lies between two load steps and is skipped (warning).
    CornerBetweenSteps => "corner_between_steps",
    /// The objective is a sum of contact forces, but there is no contact; as a warning: at the
    /// start, no part of the master lies opposite a slave surface.
    NoContact => "no_contact",
    /// No prescribed motion brings the surfaces of a contact pair together (warning).
    NeverCloses => "never_closes",
    /// Averaged normals of a slave surface differ strongly from the normals of its facets
    /// (warning).
    AveragedNormals => "averaged_normals",
    /// The slave facets of a contact pair are much coarser than the master facets (warning).
    CoarseSlave => "coarse_slave",
    /// Supports on one plane hold both sides of a tie (warning).
    HeldTwice => "held_twice",
    /// The slave surface belongs to a rigid body (warning).
    RigidSlave => "rigid_slave",
    /// The shape cannot be meshed.
    Mesh => "mesh",
    /// A mesh file cannot be read, or does not contain what the case asks for; as a warning: part
    /// of it was repaired or omitted.
    MeshFile => "mesh_file",
    /// A deck of Abaqus or CalculiX contains a mistake, or something that changes the physics and is not
    /// supported.
    Deck => "deck",
    /// A body consists of parts that are not connected, or has coincident nodes that are not merged
    /// (warning).
    Disconnected => "disconnected",
    /// Elements of a body are almost degenerate (warning).
    PoorElements => "poor_elements",
    /// Mid-side nodes of a body do not lie on the smooth surface of its faces (warning).
    StraightMiddles => "straight_middles",
    /// The case needs more memory than the machine has.
    TooLarge => "too_large",
    /// A set or surface that selects nothing.
    EmptySet => "empty_set",
    /// Bodies penetrate each other at the start.
    PenetratingStart => "penetrating_start",
    /// A tolerance is so large that the results do not satisfy the equations (warning).
    LooseTolerance => "loose_tolerance",
    /// Tetrahedra, wedges or fully integrated hexahedra are too stiff for a nearly incompressible
    /// material; or F̄ is requested for tetrahedra, where it has no effect (warning).
    Locking => "locking",
    /// A setting that cannot be combined with another.
    Unsupported => "unsupported",
}

impl fmt::Display for CaseCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Whether a diagnostic prevents the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Severity {
    /// The case cannot run.
    Error,
    /// The case can run, but the input is probably a mistake.
    Warning,
}

/// One error or warning about a case file.
///
/// `Display` writes only the message; [`CaseDiagnostic::plain`] puts the place in front of it. As a
/// [`miette::Diagnostic`] it carries the source text, so that a report can show the lines.
#[derive(Debug, Clone)]
pub struct CaseDiagnostic {
    pub(super) code: CaseCode,
    pub(super) severity: Severity,
    pub(super) message: String,
    pub(super) label: String,
    pub(super) help: String,
    pub(super) span: Range<usize>,
    pub(super) line: usize,
    pub(super) column: usize,
    pub(super) source: Arc<NamedSource<String>>,
}

impl CaseDiagnostic {
    /// The stable code.
    pub fn code(&self) -> CaseCode {
        self.code
    }

    /// Error or warning.
    pub fn severity(&self) -> Severity {
        self.severity
    }

    /// What is wrong, in one line.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// What to do about it; may be empty.
    pub fn help(&self) -> &str {
        &self.help
    }

    /// The file's name as given to the parser.
    pub fn file(&self) -> &str {
        self.source.name()
    }

    /// Line, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Column in characters, from 1.
    pub fn column(&self) -> usize {
        self.column
    }

    /// Byte range in the file's text.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// The same diagnostic with this short text at the marked place.
    pub fn with_label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// `file:line:column: error: message [code]`, then the help, as one or two lines.
    pub fn plain(&self) -> String {
        let severity = match self.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let Self { line, column, message, code, help, .. } = self;
        let mut text = format!("{}:{line}:{column}: {severity}: {message} [{code}]", self.file());
        if !help.is_empty() {
            text.push_str("\n    help: ");
            text.push_str(help);
        }
        text
    }
}

impl fmt::Display for CaseDiagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for CaseDiagnostic {}

impl Diagnostic for CaseDiagnostic {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.code))
    }

    fn severity(&self) -> Option<miette::Severity> {
        Some(match self.severity {
            Severity::Error => miette::Severity::Error,
            Severity::Warning => miette::Severity::Warning,
        })
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        (!self.help.is_empty()).then(|| Box::new(&self.help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(self.source.as_ref())
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let label = (!self.label.is_empty()).then(|| self.label.clone());
        let length = self.span.end - self.span.start;
        Some(Box::new(std::iter::once(LabeledSpan::new(label, self.span.start, length))))
    }
}

/// All errors of a case file, in the order of the file; never empty.
///
/// Warnings are omitted, because they may be a consequence of an error.
///
/// `Display` writes one `file:line:column: error: message [code]` per diagnostic. A program that
/// renders with miette iterates over [`CaseErrors::diagnostics`], each of which is a
/// [`miette::Diagnostic`].
#[derive(Debug, Clone)]
pub struct CaseErrors {
    diagnostics: Vec<CaseDiagnostic>,
}

impl CaseErrors {
    /// The errors among these diagnostics, sorted by place; `None` if there are none.
    pub fn collect(mut diagnostics: Vec<CaseDiagnostic>) -> Option<Self> {
        diagnostics.retain(|diagnostic| diagnostic.severity == Severity::Error);
        diagnostics.sort_by_key(|diagnostic| (diagnostic.span.start, diagnostic.span.end));
        (!diagnostics.is_empty()).then_some(Self { diagnostics })
    }

    /// The errors in the order of the file.
    pub fn diagnostics(&self) -> &[CaseDiagnostic] {
        &self.diagnostics
    }
}

impl From<CaseDiagnostic> for CaseErrors {
    fn from(diagnostic: CaseDiagnostic) -> Self {
        Self { diagnostics: vec![diagnostic] }
    }
}

impl fmt::Display for CaseErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.diagnostics.iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            f.write_str(&diagnostic.plain())?;
        }
        Ok(())
    }
}

impl std::error::Error for CaseErrors {}
