//! `slipstick resume`: continues an optimization, bit for bit.

use slipstick::words::counted;
use slipstick_service::optimization::{Resume, Resumed, SECTIONS, resume};

use super::optimize::drive;
use crate::args;
use crate::context::Context;
use slipstick_service::failure::{Failure, Outcome};

/// Continues an optimization from its last finished iteration.
///
/// # Errors
/// As [`slipstick_service::failure::Failure`] lists them, in particular [`slipstick_service::failure::Failure::Input`] if
/// the case's text is not the one that the run was started with.
pub fn run(context: &Context, args: &args::Resume) -> Outcome {
    if !args.set.is_empty() {
        let results = args.results.display();
        return Err(Failure::input(
            "a run continues with the case that it was started with: --set is for new runs",
            format!("`slipstick optimize CASE --design {results} --set …` starts one from the design of this run"),
        ));
    }
    let iterations = args.iterations.map(usize::from);
    let request = Resume { results: &args.results, iterations, responses: None, sections: SECTIONS };
    match resume(context, &request, |_| Ok::<(), Failure>(()))? {
        Resumed::InProgress(recorded) => drive(context, *recorded),
        Resumed::Complete { directory, iterations, criteria_met } => {
            context.console.text(&format!(
                "the run is complete after {}: {}",
                counted(iterations, "iteration"),
                match criteria_met {
                    true => "the criteria for stopping are met".to_owned(),
                    false => format!("give --iterations above {iterations} for more"),
                }
            ));
            let told = serde_json::json!({ "command": "resume", "directory": directory, "iterations": iterations });
            context.console.event("result", told);
            Ok(())
        }
    }
}
