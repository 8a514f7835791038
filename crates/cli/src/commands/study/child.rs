//! A command in a separate process.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;

use crate::context::Context;
use crate::process;
use crate::summary::digits;
use slipstick_service::failure::Outcome;

/// How a command ended.
pub struct Ended {
    /// Its exit code; `None` if the system stopped it.
    pub code: Option<i32>,
    /// Its events that are kept: results and evaluations.
    pub events: Vec<Value>,
    /// Its error.
    pub error: Option<String>,
}

/// Runs this program with other arguments in `folder`, reports its iterations, and waits until it
/// ends.
///
/// Ctrl-C reaches the child too, which stops at its next opportunity. A request to terminate
/// reaches only this process; it stops the child at the child's next event, since the files on disk
/// are valid at any time.
///
/// # Errors
/// [`Failure::Input`](slipstick_service::failure::Failure::Input) if no process can be started.
pub fn run(context: &Context, folder: &Path, line: &[String]) -> Outcome<Ended> {
    let mut command = process::again()?;
    command.args(line).arg("--json").stdout(Stdio::piped()).stderr(Stdio::null());
    if !folder.as_os_str().is_empty() {
        command.current_dir(folder);
    }
    if let Some(threads) = context.common.threads {
        command.args(["--threads", &threads.to_string()]);
    }
    let mut child = command.spawn().map_err(process::refused)?;
    let mut ended = Ended { code: None, events: Vec::new(), error: None };
    let mut asked = false;
    if let Some(out) = child.stdout.take() {
        for text in BufReader::new(out).lines().map_while(Result::ok) {
            let Ok(event) = serde_json::from_str::<Value>(&text) else { continue };
            take(context, &mut ended, event);
            if asked {
                // It may have ended by itself.
                let _ = child.kill();
            }
            asked = context.interrupt.requested();
        }
    }
    ended.code = child.wait().map_err(process::refused)?.code();
    Ok(ended)
}

fn take(context: &Context, ended: &mut Ended, event: Value) {
    let text = |key: &str| event[key].as_str().unwrap_or_default().to_owned();
    match event["event"].as_str() {
        Some("result" | "evaluation") => ended.events.push(event),
        Some("error") => {
            let place = if event["file"].is_string() {
                format!("{}:{}:{}: ", text("file"), event["line"], event["column"])
            } else {
                String::new()
            };
            let message = format!("{place}{}", text("message"));
            ended.error = Some(ended.error.take().map_or(message.clone(), |before| format!("{before}\n{message}")));
        }
        Some("iteration") if context.console.shows(1) => {
            let objective = event["objective"].as_f64().unwrap_or(f64::NAN);
            context.console.text(&format!("    {:>5}  {}", event["iteration"], digits(objective)));
        }
        _ => {}
    }
}
