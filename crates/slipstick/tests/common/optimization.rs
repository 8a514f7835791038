//! Whole optimizations: of a case's text, in one go and continued from written states.

use slipstick::build::optimization;
use slipstick::case::parse_case;
use slipstick::optimize::{IterationRecord, Optimization, OptimizationState};
use slipstick_path::Silent;

use super::problem;

/// The optimization of a case's text, at its start.
pub fn prepared(text: &str) -> Optimization {
    let case = parse_case(text, "case.toml").unwrap_or_else(|e| panic!("{e}\n{text}")).case;
    optimization(&case, problem(text)).unwrap()
}

/// Runs all iterations that are left.
pub fn finish(optimization: &mut Optimization) -> Vec<IterationRecord> {
    while !optimization.finished() {
        optimization.advance(&mut Silent).unwrap();
    }
    optimization.state.history.clone()
}

/// Runs `iterations` iterations, each one in an optimization of its own, which starts
/// from the written state and the path of the one before.
pub fn finish_in_pieces(text: &str, iterations: usize) -> OptimizationState {
    let (mut state, mut guides) = (None::<String>, Vec::new());
    for _ in 0..iterations {
        let mut part = prepared(text);
        if let Some(text) = &state {
            part.state = serde_json::from_str::<OptimizationState>(text).unwrap();
        }
        part.set_guides(guides);
        part.advance(&mut Silent).unwrap();
        guides = part.guides().into_iter().cloned().collect();
        state = Some(serde_json::to_string(&part.state).unwrap());
    }
    serde_json::from_str(&state.expect("at least one iteration")).unwrap()
}
