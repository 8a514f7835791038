//! Options of the comparison.

/// Options of the comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct VerifyOptions {
    /// Number of random directions over all designed elements.
    pub directions: usize,
    /// Number of single elements, spread over the design.
    pub elements: usize,
    /// Largest step in density; smaller ones are obtained by halving it.
    pub step: f64,
    /// How many times the step is halved.
    pub halvings: u32,
    /// Relative tolerance of the forward analyses.
    pub forward_tolerance: f64,
    /// Relative error up to which a direction is [`Verdict::Right`](super::Verdict::Right).
    pub tolerance: f64,
}

impl Default for VerifyOptions {
    fn default() -> Self {
        Self { directions: 2, elements: 3, step: 1e-3, halvings: 4, forward_tolerance: 1e-11, tolerance: 1e-5 }
    }
}
