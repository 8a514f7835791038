//! `slipstick bench`: time by phase, size and number of threads.

mod half_ball;
mod measure;

use std::process::Stdio;

use serde_json::{Value, json};
use slipstick::path::Phase;
use slipstick::run::Machine;
use slipstick::words::counted;

use crate::args::Bench;
use crate::context::Context;
use crate::parallel::Parallel;
use crate::process;
use crate::table::lines;
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::memory::bytes;

/// Measures forward analysis and gradient of a case, or of the half-ball on its plate in several
/// sizes, each in a separate process, and prints a table.
///
/// # Errors
/// [`Failure::Check`] if an analysis fails; [`Failure::Input`] if the program cannot start itself.
pub fn run(context: &Context, args: &Bench) -> Outcome {
    if args.worker {
        let measurement = measure::measure(context, args)?;
        context.console.raw(&format!("{measurement}\n"));
        return Ok(());
    }
    if Parallel::launched() {
        return on_ranks(context, args);
    }
    let mut all = Vec::new();
    let sizes = if args.case.is_some() { vec![None] } else { args.sizes.iter().copied().map(Some).collect() };
    for size in sizes {
        for &threads in &args.threads {
            if context.interrupt.requested() {
                return Err(Failure::Interrupted { message: "no results are kept".into(), resume: None });
            }
            let mut measurement = child(args, size.map(usize::from), threads.get())?;
            if context.console.shows(1) {
                let (elements, seconds) = (&measurement["elements"], &measurement["forward"]["seconds"]);
                context
                    .console
                    .text(&format!("{elements} elements, {}: forward {seconds} s", counted(threads.get(), "thread")));
            }
            all.push(measurement.clone());
            measurement["command"] = "bench".into();
            context.console.event("measurement", measurement);
        }
    }
    conclude(context, args, &all, &tables(&all));
    Ok(())
}

/// Measures once, on all MPI ranks; the first rank reports the results of all.
fn on_ranks(context: &Context, args: &Bench) -> Outcome {
    let own = measure::measure(context, args)?;
    let all = context.parallel.ranks().gather(own.to_string().as_bytes());
    let all: Vec<Value> = all.iter().filter_map(|text| serde_json::from_slice(text).ok()).collect();
    for measurement in &all {
        let mut measurement = measurement.clone();
        measurement["command"] = "bench".into();
        context.console.event("measurement", measurement);
    }
    let mut text = tables(&all[..1]);
    text.push(format!("\non each of {}", all.len()));
    text.extend(by_rank(&all));
    conclude(context, args, &all, &text);
    Ok(())
}

/// Prints the tables, and the machine on which they were measured.
fn conclude(context: &Context, args: &Bench, all: &[Value], tables: &[String]) {
    let machine = Machine::this();
    context.console.event("result", json!({ "command": "bench", "machine": machine, "measurements": all.len() }));
    context.console.lines(tables);
    if args.cpu {
        context.console.text("\ntimes are those of the processors, all threads together");
    }
    let processor = processor().map_or(String::new(), |name| format!(", {name}"));
    context.console.text(&format!(
        "\n{} {}{processor}, {}",
        machine.os,
        machine.architecture,
        counted(machine.cores, "core")
    ));
}

/// A measurement in a separate process.
fn child(args: &Bench, size: Option<usize>, threads: usize) -> Outcome<Value> {
    let failed = |message: String| Failure::Check { message, cure: "see the messages of the analysis above".into() };
    let mut command = process::again()?;
    command.args(["bench", "--worker", "--quiet", "--threads", &threads.to_string()]);
    if let Some(case) = &args.case {
        command.arg(case);
    }
    let options = [
        ("--sizes", size.map(|size| size.to_string())),
        ("--steps", args.steps.map(|steps| steps.to_string())),
        ("--memory", args.memory.map(|memory| memory.to_string())),
        ("--responses", args.responses.map(|number| number.to_string())),
    ];
    for (name, value) in options {
        if let Some(value) = value {
            command.args([name, &value]);
        }
    }
    if args.cpu {
        command.arg("--cpu");
    }
    if let Some(design) = &args.design.design {
        command.arg("--design").arg(design);
    }
    let output = command.stderr(Stdio::inherit()).output().map_err(process::refused)?;
    if !output.status.success() {
        return Err(failed(format!("the measurement ended with {}", output.status)));
    }
    serde_json::from_slice(&output.stdout)
        .map_err(|error| failed(format!("the measurement printed no result: {error}")))
}

/// Name of the processor, if Linux provides it.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// The numbers of all measurements, in tables.
fn tables(all: &[Value]) -> Vec<String> {
    let seconds = |m: &Value, what: &str| m[what]["seconds"].as_f64();
    let cell = |value: Option<f64>, digits: usize| value.map_or("–".into(), |v| format!("{v:.digits$}"));
    let head = |m: &Value| [&m["unknowns"], &m["threads"]].map(|v| v.to_string()).to_vec();
    let whole: Vec<Vec<String>> = all
        .iter()
        .map(|m| {
            let (forward, kept) = (seconds(m, "forward"), seconds(m, "gradient"));
            let recomputed = seconds(m, "gradient_without_kept_factors");
            let ratio = |part: Option<f64>| part.zip(forward).map(|(part, forward)| part / forward);
            let mut row = vec![m["elements"].to_string()];
            row.extend(head(m));
            row.extend(
                [&m["steps"], &m["newton_iterations"], &m["forward"]["solves"]["factorizations"]]
                    .map(|v| v.to_string()),
            );
            row.extend([cell(forward, 2), cell(kept, 2), cell(ratio(kept), 3)]);
            row.extend([cell(recomputed, 2), cell(ratio(recomputed), 3)]);
            row.push(format!("{}/{}", m["states_with_kept_factors"], m["increments"]));
            row.push(m["peak_bytes"].as_f64().map_or("–".into(), bytes));
            row
        })
        .collect();
    let header = [
        "elements",
        "unknowns",
        "threads",
        "steps",
        "Newton",
        "factors",
        "forward [s]",
        "gradient [s]",
        "ratio",
        "without kept [s]",
        "ratio",
        "kept",
        "memory",
    ];
    let mut text = lines(&header, &whole);
    let rows: Vec<Vec<String>> = all.iter().flat_map(together).collect();
    if !rows.is_empty() {
        text.push("\ngradients of several responses together, with kept factors".into());
        text.extend(lines(&["unknowns", "threads", "responses", "seconds", "over one"], &rows));
    }
    for (title, what, per) in [
        ("\nper Newton iteration of the forward analysis [ms]", "forward", "newton_iterations"),
        ("\nper increment of the gradient, with kept factors [ms]", "gradient", "increments"),
        ("\nper increment of the gradient, without [ms]", "gradient_without_kept_factors", "increments"),
    ] {
        let rows: Vec<Vec<String>> =
            all.iter().filter(|m| !m[what].is_null()).map(|m| by_phase(m, what, per)).collect();
        if !rows.is_empty() {
            let mut header = vec!["unknowns", "threads"];
            header.extend(Phase::ALL.map(Phase::name));
            header.extend(["other", "sum"]);
            text.push(title.into());
            text.extend(lines(&header, &rows));
        }
    }
    text.extend(evaluations(all));
    text
}

/// How often elements and contact are evaluated per increment, in each part of a measurement.
fn evaluations(all: &[Value]) -> Vec<String> {
    let (mut names, mut rows) = (Vec::new(), Vec::new());
    for m in all {
        let results = &m["results"];
        for (part, of, increments) in [
            ("forward", &m["forward"], &m["increments"]),
            ("gradient", &m["gradient_without_kept_factors"], &m["increments"]),
            ("quantities and files, marching", &results["marching"], &results["increments"]),
            ("quantities and files, later", &results["later"], &results["increments"]),
        ] {
            let increments = increments.as_f64().unwrap_or(1.0).max(1.0);
            let Some(counts) = of["evaluations"].as_object() else { continue };
            names = counts.keys().cloned().collect();
            let mut row = vec![m["unknowns"].to_string(), part.to_owned()];
            row.extend(counts.values().map(|count| format!("{:.2}", count.as_f64().unwrap_or(0.0) / increments)));
            rows.push(row);
        }
    }
    if rows.is_empty() {
        return Vec::new();
    }
    let header: Vec<&str> = ["unknowns", ""].into_iter().chain(names.iter().map(String::as_str)).collect();
    let mut text = vec!["\nevaluations of all elements, and of contact, per increment".into()];
    text.extend(lines(&header, &rows));
    text
}

/// The times of several responses in a measurement.
fn together(m: &Value) -> Vec<Vec<String>> {
    let rows: Vec<(u64, f64)> = m["responses"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|row| Some((row[0].as_u64()?, row[1].as_f64()?)))
        .collect();
    let one = rows.first().map_or(f64::NAN, |(_, seconds)| *seconds);
    let line = |(number, seconds): &(u64, f64)| {
        let head = [&m["unknowns"], &m["threads"]].map(|v| v.to_string());
        [&head[..], &[number.to_string(), format!("{seconds:.2}"), format!("{:.2}", seconds / one)]].concat()
    };
    rows.iter().map(line).collect()
}

/// The share of each rank in a measurement.
fn by_rank(all: &[Value]) -> Vec<String> {
    let header = [
        "rank",
        "elements",
        "slave nodes",
        "assembly, forward [s]",
        "Gflop, all factors",
        "largest factors",
        "memory",
        "sent, forward",
        "sent, gradient",
    ];
    let size = |value: &Value| value.as_f64().map_or("–".into(), bytes);
    let rows: Vec<Vec<String>> = all
        .iter()
        .map(|m| {
            let phase = |phase: Phase| m["forward"]["phases"][phase.name()][0].as_f64().unwrap_or(0.0);
            vec![
                m["rank"].to_string(),
                m["elements_here"].to_string(),
                m["slave_nodes_here"].to_string(),
                format!("{:.2}", phase(Phase::Solid) + phase(Phase::Contact)),
                format!("{:.1}", 1e-9 * m["operations"].as_f64().unwrap_or(0.0)),
                size(&m["factor_bytes"]),
                size(&m["peak_bytes"]),
                size(&m["forward"]["bytes_sent"]),
                size(&m["gradient_without_kept_factors"]["bytes_sent"]),
            ]
        })
        .collect();
    lines(&header, &rows)
}

/// Milliseconds by phase, divided by the count `per`.
fn by_phase(m: &Value, what: &str, per: &str) -> Vec<String> {
    let count = m[per].as_f64().unwrap_or(1.0).max(1.0);
    let spent = |phase: Phase| m[what]["phases"][phase.name()][0].as_f64().unwrap_or(0.0);
    let sum = m[what]["seconds"].as_f64().unwrap_or(0.0);
    let known: f64 = Phase::ALL.into_iter().map(spent).sum();
    let mut row = vec![m["unknowns"].to_string(), m["threads"].to_string()];
    let all = Phase::ALL.into_iter().map(spent).chain([sum - known, sum]);
    row.extend(all.map(|seconds| format!("{:.1}", 1e3 * seconds / count)));
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computed by hand: 2 s forward in 4 iterations, 0.2 s gradient over 2 increments.
    #[test]
    fn tables_divide_by_what_they_say() {
        let spent = |seconds: f64| json!({ "seconds": seconds, "phases": { "solid": [0.1, 4], "factor": [0.06, 1] } });
        let m = json!({
            "elements": 10, "unknowns": 30, "threads": 1, "steps": 2, "increments": 2, "newton_iterations": 4,
            "forward": spent(2.0), "gradient": spent(0.2),
            "gradient_without_kept_factors": null, "states_with_kept_factors": 2, "peak_bytes": 3e9,
        });
        let text = tables(&[m]);
        assert_eq!(text.len(), 2 + 2 * 3);
        let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&text[1])[6..], ["2.00", "0.20", "0.100", "–", "–", "2/2", "3.0", "GB"].map(str::to_owned));
        assert_eq!(
            words(&text[4])[2..],
            ["25.0", "0.0", "0.0", "15.0", "0.0", "0.0", "460.0", "500.0"].map(str::to_owned)
        );
        assert_eq!(
            words(&text[7])[2..],
            ["50.0", "0.0", "0.0", "30.0", "0.0", "0.0", "20.0", "100.0"].map(str::to_owned)
        );
    }
}
