//! Requests of a front end that is none: their answers, events and failures.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use slipstick::build::Problem;
use slipstick::case::{CaseCode, Resolved, parse_case, template};
use slipstick::drive::DriveObserver;
use slipstick::optimize::OptimizationState;
use slipstick::path::{MarchEvent, MarchObserver, Silent};
use slipstick::run::{Checkpoint, ExitState, Run, RunDirectory, RunRecord};
use slipstick_service::check::{Checked, check, prepare};
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::forecast::bytes_to_build;
use slipstick_service::host::{Event, Host};
use slipstick_service::memory::Budget;
use slipstick_service::optimization::{RecordedOptimization, Resume, Resumed, SECTIONS, optimization, resume};
use slipstick_service::run::start;

/// A host with a budget, which writes its events down.
struct Listener {
    memory: Budget,
    heard: Mutex<Vec<String>>,
}

impl Listener {
    fn new() -> Self {
        Self { memory: Budget::of(8e9), heard: Mutex::default() }
    }

    fn heard(&self) -> Vec<String> {
        self.heard.lock().expect("not poisoned").clone()
    }
}

impl Host for Listener {
    fn threads(&self, of_case: Option<usize>) -> Outcome<usize> {
        Ok(of_case.unwrap_or(1))
    }

    fn memory(&self) -> Budget {
        self.memory
    }

    fn line(&self) -> Vec<String> {
        vec!["test".into()]
    }

    fn tell(&self, event: Event<'_>) {
        self.heard.lock().expect("not poisoned").push(match event {
            Event::Warnings(warnings) => format!("{} warnings", warnings.len()),
            Event::Prepared(inspection) => format!("{} steps", inspection.steps),
            Event::Started(started) => format!("{} with {} threads", started.command, started.threads),
        });
    }
}

/// Five elements, ten load steps, three iterations.
fn resolved() -> Resolved {
    let text = template("cube-on-cuboid").expect("a template").text;
    let text = text.replace("min = 0.0 }", "min = 1e-3 }\nvolume_fraction = 0.5");
    parse_case(&format!("{text}\n[optimizer]\nmma = {{}}\niterations = 3\n"), "case.toml").expect("a case")
}

fn started(host: &Listener, directory: &Path) -> RecordedOptimization {
    let (checked, problem) = prepare(host, resolved(), SECTIONS, None).expect("it can run");
    let run: Run = start(host, &checked, ("optimize", Path::new("case.toml")), directory, false).expect("a run");
    let Checked { resolved, .. } = checked;
    let optimization = optimization(&resolved, problem).expect("an optimization");
    RecordedOptimization::start(optimization, &resolved, Some(run), None).expect("recorded")
}

fn resumed(host: &Listener, results: &Path, iterations: Option<usize>, responses: Option<&str>) -> Outcome<Resumed> {
    let request = Resume { results, iterations, responses, sections: SECTIONS };
    resume(host, &request, |_: &mut Problem| Ok(()))
}

/// Drives an optimization to its end.
fn finish(recorded: RecordedOptimization, observer: &mut dyn DriveObserver) -> Outcome<OptimizationState> {
    let (driven, outcome) = recorded.drive(observer);
    let state = driven.optimization.state.clone();
    driven.end(outcome.map(|_| state))
}

/// Stops in the middle of the path of a design.
struct Stop {
    at: usize,
    now: AtomicBool,
}

impl MarchObserver for Stop {
    fn on_event(&mut self, _: &MarchEvent<'_>) {}

    fn cancelled(&self) -> bool {
        self.now.load(Ordering::Relaxed)
    }
}

impl DriveObserver for Stop {
    fn begins(&mut self, iteration: usize) {
        self.now.store(iteration >= self.at, Ordering::Relaxed);
    }
}

/// Against the same optimization without interruption.
#[test]
fn a_cancelled_optimization_resumes_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let [whole, parts] = ["whole", "parts"].map(|name| folder.path().join(name));
    let host = Listener::new();
    let expected = finish(started(&host, &whole), &mut Silent).expect("it ends");

    let mut stop = Stop { at: 2, now: AtomicBool::new(false) };
    let failure = finish(started(&host, &parts), &mut stop).expect_err("cancelled");
    let Failure::Interrupted { resume: Some(directory), .. } = &failure else { panic!("{}", failure.text()) };
    assert_eq!(directory, &parts);
    let open = RunDirectory::open(&parts).expect("a run");
    assert_eq!(RunRecord::read(&open).expect("a record").latest.exit, ExitState::Interrupted);
    assert_eq!(Checkpoint::read(&open).expect("a checkpoint").state.iteration, 2);

    let Resumed::InProgress(recorded) = resumed(&host, &parts, None, None).expect("resumed") else {
        panic!("an iteration is left")
    };
    let found = finish(*recorded, &mut Silent).expect("it ends");
    let bits = |state: &OptimizationState| state.x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&found), bits(&expected));
    assert_eq!(found.history, expected.history);
    assert_eq!(RunRecord::read(&open).expect("a record").latest.exit, ExitState::Finished);
    let tail = host.heard().split_off(host.heard().len() - 3);
    assert_eq!(tail, ["0 warnings", "10 steps", "resume with 1 threads"]);

    let complete = resumed(&host, &parts, None, None).expect("nothing is left to do");
    assert!(matches!(complete, Resumed::Complete { iterations: 3, criteria_met: false, .. }));
    let more = resumed(&host, &parts, Some(4), None).expect("resumed");
    assert!(matches!(more, Resumed::InProgress(_)), "more iterations are something to do");
}

/// A run with another text or with other responses is another run, and no process takes what another
/// one writes.
#[test]
fn only_the_run_that_was_started_is_resumed() {
    let folder = tempfile::tempdir().expect("a folder");
    let directory = folder.path().join("run");
    let host = Listener::new();
    let refused = |outcome: Outcome<Resumed>| match outcome {
        Err(Failure::Input { message, .. }) => message,
        Err(other) => panic!("{}", other.text()),
        Ok(_) => panic!("resumed"),
    };
    let none = refused(resumed(&host, &directory, None, None));
    assert!(none.contains("run"), "{none}");

    let recorded = started(&host, &directory);
    let locked = refused(resumed(&host, &directory, None, None));
    assert!(locked.contains("is writing to"), "{locked}");
    finish(recorded, &mut Stop { at: 1, now: AtomicBool::new(false) }).expect_err("cancelled");

    let other = refused(resumed(&host, &directory, None, Some("own responses")));
    assert!(other.contains("case.toml"), "{other}");
    let file = directory.join("case.toml");
    let text = std::fs::read_to_string(&file).expect("readable");
    std::fs::write(&file, format!("{text}# another\n")).expect("written");
    let other = refused(resumed(&host, &directory, None, None));
    assert!(other.contains("case.toml"), "{other}");
    std::fs::write(&file, text).expect("written");
    assert!(resumed(&host, &directory, None, None).is_ok());
}

/// The budget is the host's: what exceeds it is refused before it is built, or before it runs.
#[test]
fn what_exceeds_the_memory_is_refused() {
    let codes = |memory: Budget, check: &dyn Fn(&dyn Host) -> Outcome| {
        let host = Listener { memory, ..Listener::new() };
        let Err(Failure::Case(diagnostics)) = check(&host) else { panic!("not refused") };
        (diagnostics.iter().map(|one| (one.code(), one.message().to_owned())).collect::<Vec<_>>(), host.heard())
    };
    let to_build = bytes_to_build(&resolved().case);
    let (refused, heard) = codes(Budget::of(0.9 * to_build), &|host| check(host, resolved()).map(drop));
    assert!(matches!(&refused[..], [(CaseCode::TooLarge, text)] if text.contains("before anything is solved")));
    assert!(heard.is_empty(), "nothing was built: {heard:?}");

    let (checked, _) = check(&Listener::new(), resolved()).expect("it can be built");
    let needed = checked.forecast.peak_bytes;
    let run = |host: &dyn Host| prepare(host, resolved(), SECTIONS, None).map(drop);
    let (refused, heard) = codes(Budget::of(0.999 * needed), &run);
    assert!(matches!(&refused[..], [(CaseCode::TooLarge, text)] if text.starts_with("a run needs about")));
    assert_eq!(heard, ["0 warnings"]);
    assert!(run(&Listener { memory: Budget::of(1.001 * needed), ..Listener::new() }).is_ok());
}

/// Every failure has its state in the record of a run, and a text with its cure.
#[test]
fn failures_have_a_text_and_a_state() {
    let input = Failure::input("no such file", "check the name");
    assert_eq!(
        (input.text().as_str(), input.state()),
        ("error: no such file\n    help: check the name", ExitState::Failed)
    );
    let interrupted = Failure::Interrupted { message: "kept".into(), resume: Some("run".into()) };
    assert_eq!(interrupted.state(), ExitState::Interrupted);
    assert_eq!(interrupted.text(), "interrupted: kept\n    continue with: slipstick resume run");
    let missing = prepare(&Listener::new(), resolved(), &["contact", "output.directory"], None);
    let Err(Failure::Case(diagnostics)) = missing else { panic!("a section is missing") };
    assert!(Failure::Case(diagnostics).text().starts_with("case.toml:"));
}
