//! The answers of the server.
//!
//! | request | answer |
//! |---|---|
//! | `GET /`, `/ui.js`, `/ui.css` | the page |
//! | `GET /folder` | cases and runs of the folder, and which to open |
//! | `GET /case?case=`, `?run=` | the text of a case, or of the case of a run |
//! | `POST /check?case=` | diagnostics and outline of an edited text |
//! | `POST /save?case=&stamp=` | replaces the file, unless it is not the one that was read |
//! | `GET /model?case=` | the model of the text that was checked last, as a view |
//! | `POST /start?command=&case=&run=&force=` | starts a command |
//! | `POST /stop` | stops it |
//! | `GET /state?run=&log=` | the command, and tables and log of a run; with `log=job`, the log of the command |
//! | `GET /report?run=` | the report of a run |

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

use serde_json::{Value, json};
use slipstick::build::build_mesh;
use slipstick::case::{Resolved, sha256};
use slipstick::report::{CHARTS, PageOptions, model_page, page};
use slipstick::run::{RunRecord, bytes_of};
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::forecast::bytes_to_build;
use slipstick_service::memory::{Budget, bytes};
use slipstick_service::read::{edited, object, text_of};
use slipstick_service::run::OpenRun;

use super::folder::{Folder, Opened};
use super::http::{Request, Response};
use super::jobs::{Asked, Jobs, log_of, tail};
use super::outline::{marks, outline};

/// The state of the server. Everything else is read from files.
pub struct Server {
    folder: Folder,
    opened: Opened,
    threads: Option<NonZeroUsize>,
    jobs: Jobs,
    /// Texts that were checked last, by case.
    drafts: Mutex<BTreeMap<String, String>>,
    /// Held while a file is compared and replaced: if a page saves twice at once, one save is refused.
    saving: Mutex<()>,
    /// Held while a mesh is built, so that the memory of one is available in full.
    building: Mutex<()>,
    /// Number of the newest request for a model.
    newest: AtomicUsize,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Server {
    /// Serves a folder; commands use this number of threads.
    pub fn new(folder: Folder, opened: Opened, threads: Option<NonZeroUsize>) -> Self {
        Self {
            folder,
            opened,
            threads,
            jobs: Jobs::default(),
            drafts: Mutex::default(),
            saving: Mutex::default(),
            building: Mutex::default(),
            newest: AtomicUsize::default(),
        }
    }

    /// Answers a request that was admitted.
    pub fn answer(&self, request: &Request) -> Response {
        let path: Vec<&str> = request.head.path.iter().map(String::as_str).collect();
        let answer = match (request.head.method.as_str(), &path[..]) {
            ("GET", [""]) => Ok(Response::file("text/html; charset=utf-8", include_str!("page/ui.html"))),
            ("GET", ["ui.css"]) => Ok(Response::file("text/css; charset=utf-8", include_str!("page/ui.css"))),
            ("GET", ["ui.js"]) => {
                let script = format!("\"use strict\";\n{CHARTS}{}", include_str!("page/ui.js"));
                Ok(Response::file("text/javascript; charset=utf-8", script))
            }
            ("GET", ["folder"]) => Ok(self.names()),
            ("GET", ["case"]) => self.case(request),
            ("POST", ["check"]) => self.check(request),
            ("POST", ["save"]) => return self.save(request).unwrap_or_else(|failure| refusal(&failure)),
            ("GET", ["model"]) => self.model(request),
            ("POST", ["start"]) => self.start(request),
            ("POST", ["stop"]) => {
                self.jobs.stop();
                Ok(Response::json(&self.jobs.state()))
            }
            ("GET", ["state"]) => self.state(request),
            ("GET", ["report"]) => self.report(request),
            _ => {
                return Response::refusal(
                    404,
                    "there is no such page",
                    "open the address without what follows the token",
                );
            }
        };
        let in_frame = matches!(path[..], ["model" | "report"]);
        answer.unwrap_or_else(|failure| if in_frame { Response::plain(400, failure.text()) } else { refusal(&failure) })
    }

    fn names(&self) -> Response {
        let [cases, runs] = self.folder.names();
        let Opened { case, run } = &self.opened;
        let folder = self.folder.path();
        Response::json(&json!({ "folder": folder, "cases": cases, "runs": runs, "case": case, "run": run }))
    }

    /// The text of a case in the folder, or of the case of a run, which cannot be saved.
    fn case(&self, request: &Request) -> Outcome<Response> {
        let (case, run) = (request.head.asked("case"), request.head.asked("run"));
        let path = match case {
            "" => self.folder.run(run)?.file("case.toml"),
            name => self.folder.case(name)?,
        };
        let text = raw_text(&path)?;
        Ok(Response::json(&json!({ "text": text, "stamp": sha256(&text) })))
    }

    fn check(&self, request: &Request) -> Outcome<Response> {
        let (name, text) = (request.head.asked("case"), text(request)?);
        let path = self.folder.case(name)?;
        lock(&self.drafts).insert(name.to_owned(), text.to_owned());
        let answer = match edited(&path, text).map_err(|error| error.at(&path)) {
            Ok(resolved) => {
                let warnings: Vec<Value> = resolved.warnings.iter().map(object).collect();
                json!({ "diagnostics": warnings, "outline": outline(&resolved), "runs": runs(&resolved) })
            }
            Err(Failure::Case(errors)) => json!({ "diagnostics": errors.iter().map(object).collect::<Vec<_>>() }),
            Err(other) => return Err(other),
        };
        Ok(Response::json(&answer))
    }

    fn save(&self, request: &Request) -> Outcome<Response> {
        let (name, text) = (request.head.asked("case"), text(request)?);
        let path = self.folder.case(name)?;
        let _saving = lock(&self.saving);
        if sha256(&raw_text(&path)?) != request.head.asked("stamp") {
            let cure = "copy your text, load the page again, and make your changes in the new text";
            return Ok(Response::refusal(409, &format!("{name} was changed by another program"), cure));
        }
        self.folder.save(name, text)?;
        Ok(Response::json(&json!({ "stamp": sha256(text) })))
    }

    /// The model of the text that was checked last, otherwise of the file; of a run, that of its case.
    fn model(&self, request: &Request) -> Outcome<Response> {
        let (name, run) = (request.head.asked("case"), request.head.asked("run"));
        let path = match name {
            "" => self.folder.run(run)?.file("case.toml"),
            name => self.folder.case(name)?,
        };
        let turn = 1 + self.newest.fetch_add(1, Ordering::SeqCst);
        let draft = lock(&self.drafts).get(name).cloned();
        let Some(_building) = self.turn_to_build(turn, name, draft.as_ref()) else {
            return Ok(Response::plain(409, "the text has changed; its newer model replaces this one".into()));
        };
        let text = match draft {
            Some(text) => text,
            None => raw_text(&path)?,
        };
        let resolved = edited(&path, &text).map_err(|error| error.at(&path))?;
        let needed = bytes_to_build(&resolved.case);
        if let Some(available) = Budget::of_machine().exceeded_by(needed) {
            let message = format!("the mesh needs about {}; {} is available", bytes(needed), bytes(available));
            return Err(Failure::input(message, "use fewer elements, or a machine with more memory"));
        }
        let mesh = build_mesh(&resolved.case).map_err(|error| Failure::build(&error, &resolved.source_map))?;
        let names = marks(&serde_json::to_value(&resolved.case).unwrap_or_default());
        Ok(Response::framed(model_page(&resolved.case, &mesh, &names, &PageOptions::default()).html))
    }

    /// Waits until no mesh is built; `None` if another text was checked meanwhile and its model was requested,
    /// because the page then no longer waits for this one.
    fn turn_to_build(&self, turn: usize, name: &str, draft: Option<&String>) -> Option<MutexGuard<'_, ()>> {
        loop {
            if self.newest.load(Ordering::SeqCst) != turn && lock(&self.drafts).get(name) != draft {
                return None;
            }
            match self.building.try_lock() {
                Ok(building) => return Some(building),
                Err(TryLockError::Poisoned(broken)) => return Some(broken.into_inner()),
                Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(20)),
            }
        }
    }

    fn start(&self, request: &Request) -> Outcome<Response> {
        let head = &request.head;
        let asked = Asked {
            command: head.asked("command"),
            case: head.asked("case"),
            run: head.asked("run"),
            force: head.asked("force") == "true",
        };
        self.jobs.start(&self.folder, self.threads, &asked)?;
        Ok(Response::json(&self.jobs.state()))
    }

    fn state(&self, request: &Request) -> Outcome<Response> {
        let (job, name) = (self.jobs.state(), request.head.asked("run"));
        let log = match job["log"].as_str() {
            Some(log) if request.head.asked("log") == "job" => log.to_owned(),
            _ => log_of(name),
        };
        let run = match self.folder.run(name) {
            Ok(directory) if !name.is_empty() => {
                let record = RunRecord::read(&directory)?;
                let table = |file: &str| std::fs::read_to_string(directory.file(file)).unwrap_or_default();
                let in_progress = directory.is_in_progress();
                json!({
                    "name": name, "in_progress": in_progress, "exit": record.latest.exit, "message": record.latest.message,
                    "line": record.latest.command, "start": record.latest.start, "resumable": directory.file("checkpoint.json").is_file() && !in_progress,
                    "history": table("history.csv"), "quantities": table("quantities.csv"),
                })
            }
            _ => Value::Null,
        };
        Ok(Response::json(&json!({ "job": job, "run": run, "log": tail(&self.folder, &log) })))
    }

    fn report(&self, request: &Request) -> Outcome<Response> {
        let _building = lock(&self.building);
        let OpenRun { directory, resolved, mesh } = OpenRun::of(self.folder.run(request.head.asked("run"))?)?;
        Ok(Response::framed(page(&directory, &resolved.case, &mesh, &PageOptions::default())?.html))
    }
}

/// Commands for which a case has the sections.
fn runs(resolved: &Resolved) -> Vec<&'static str> {
    let all = [("solve", &["dirichlet"][..]), ("optimize", slipstick_service::optimization::SECTIONS)];
    all.iter().filter(|(_, sections)| resolved.require(sections).is_ok()).map(|(command, _)| *command).collect()
}

fn text(request: &Request) -> Outcome<&str> {
    std::str::from_utf8(&request.body).map_err(|_| Failure::input("the text is not UTF-8", "use a browser"))
}

/// The text of a case file or a deck itself.
fn raw_text(path: &Path) -> Outcome<String> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("inp")) {
        let read = |error| Failure::input(format!("cannot read {}: {error}", path.display()), "check the file");
        // characters that cannot be read would be lost when it is saved
        return String::from_utf8(bytes_of(path).map_err(read)?).map_err(|_| {
            Failure::input(format!("{} is not UTF-8", path.display()), "save it as UTF-8 to edit it here")
        });
    }
    text_of(path).map_err(|error| error.at(path))
}

fn refusal(failure: &Failure) -> Response {
    let (message, cure) = match failure {
        Failure::Input { message, cure } | Failure::Check { message, cure } => (message.clone(), cure.as_str()),
        Failure::Case(diagnostics) => {
            (diagnostics.iter().map(|of| of.plain()).collect::<Vec<_>>().join("\n"), "correct the case")
        }
        other => (other.text(), ""),
    };
    Response::refusal(400, &message, cure)
}
