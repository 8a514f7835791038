//! The answers of the server.
//!
//! | request | answer |
//! |---|---|
//! | `GET /`, `/ui.js`, `/ui.css` | the page |
//! | `GET /folder` | cases and runs of the folder, and which to open |
//! | `GET /case?case=`, `?run=` | the text of a case, or of the case of a run |
//! | `POST /check?case=&page=` | diagnostics and outline of an edited text, and its stamp |
//! | `POST /save?case=&stamp=` | replaces the file, unless it is not the one that was read |
//! | `GET /model?case=&page=&stamp=` | the model of the text that this page checked last, as a view; 409 if it has not this stamp |
//! | `GET /schema` | the schema of cases |
//! | `POST /values` | values of a text with their places |
//! | `POST /edit` | a text with one value changed or, without `value`, removed; the body is `{ text, path, value }` |
//! | `POST /pick?case=&stamp=&name=&use=&degrees=&sure=` | the tables that select faces of the model, if it is that of the text with this stamp |
//! | `POST /start?command=&case=&run=&kind=&force=&hexahedra=` | starts a command |
//! | `POST /stop` | stops it |
//! | `GET /state?run=&log=` | the command, and tables and log of a run; with `log=job`, the log of the command |
//! | `GET /report?run=&view=` | the report of a run, or only its view |

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::{Value, json};
use slipstick::case::{Resolved, sha256};
use slipstick::report::{CHARTS, PageOptions, page};
use slipstick::run::{RunRecord, bytes_of};
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::read::{edited, object, text_of};
use slipstick_service::run::OpenRun;

use super::folder::{Folder, Opened};
use super::forms::{values, with_value, without};
use super::http::{Request, Response};
use super::jobs::{Asked, Jobs, log_of, tail};
use super::models::{Models, Wanted};
use super::outline::outline;

/// The state of the server. Everything else is read from files.
pub struct Server {
    folder: Folder,
    opened: Opened,
    threads: Option<NonZeroUsize>,
    jobs: Jobs,
    models: Models,
    /// Held while a file is compared and replaced: if a page saves twice at once, one save is refused.
    saving: Mutex<()>,
}

/// Locks a value, also if a thread that held it has panicked.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Server {
    /// Serves a folder; commands use this number of threads.
    pub fn new(folder: Folder, opened: Opened, threads: Option<NonZeroUsize>) -> Self {
        Self { folder, opened, threads, jobs: Jobs::default(), models: Models::default(), saving: Mutex::default() }
    }

    /// Answers a request that was admitted.
    pub fn answer(&self, request: &Request) -> Response {
        let path: Vec<&str> = request.head.path.iter().map(String::as_str).collect();
        let answer = match (request.head.method.as_str(), &path[..]) {
            ("GET", [""]) => Ok(Response::file("text/html; charset=utf-8", include_str!("page/ui.html"))),
            ("GET", ["ui.css"]) => Ok(Response::file("text/css; charset=utf-8", include_str!("page/ui.css"))),
            ("GET", ["ui.js"]) => {
                let parts = [include_str!("page/ui.js"), include_str!("page/compare.js"), include_str!("page/form.js")];
                let script = format!("\"use strict\";\n{CHARTS}{}", parts.concat());
                Ok(Response::file("text/javascript; charset=utf-8", script))
            }
            ("GET", ["folder"]) => Ok(self.names()),
            ("GET", ["case"]) => self.case(request),
            ("POST", ["check"]) => self.check(request),
            ("POST", ["save"]) => return self.save(request).unwrap_or_else(|failure| refusal(&failure)),
            ("GET", ["model"]) => self.model(request),
            ("GET", ["schema"]) => Ok(Response::json(&slipstick::case::schema())),
            ("POST", ["values"]) => text(request).map(|text| Response::json(&values(text))),
            ("POST", ["edit"]) => edit(request),
            ("POST", ["pick"]) => self.pick(request),
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
        let [cases, runs, steps] = self.folder.names();
        let Opened { case, run, step } = &self.opened;
        let folder = self.folder.path();
        Response::json(
            &json!({ "folder": folder, "cases": cases, "runs": runs, "steps": steps, "case": case, "run": run, "step": step }),
        )
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
        self.models.keep(request.head.asked("page"), name, text);
        let mut answer = match edited(&path, text).map_err(|error| error.at(&path)) {
            Ok(resolved) => {
                let warnings: Vec<Value> = resolved.warnings.iter().map(object).collect();
                json!({ "diagnostics": warnings, "outline": outline(&resolved), "runs": runs(&resolved) })
            }
            Err(Failure::Case(errors)) => json!({ "diagnostics": errors.iter().map(object).collect::<Vec<_>>() }),
            Err(other) => return Err(other),
        };
        answer["stamp"] = sha256(text).into();
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
        self.models.page(request.head.asked("page"), name, &path, request.head.asked("stamp"))
    }

    /// The tables that select picked faces.
    fn pick(&self, request: &Request) -> Outcome<Response> {
        let head = &request.head;
        let case = head.asked("case");
        let path = self.folder.case(case)?;
        let wrong = |_| Failure::input("the picked faces are not a list of numbers", "use the buttons of the page");
        let points = serde_json::from_slice(&request.body).map_err(wrong)?;
        let degrees = head.asked("degrees").parse().ok().filter(|angle| (0.0..=180.0).contains(angle)).unwrap_or(30.0);
        let (name, purpose, sure) = (head.asked("name"), head.asked("use"), head.asked("sure") == "true");
        let plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-';
        if name.is_empty() || !name.bytes().all(plain) {
            let message = format!("{name:?} is not a name of a surface");
            return Err(Failure::input(message, "use letters, digits, `_` and `-`"));
        }
        let wanted = Wanted { case, stamp: head.asked("stamp"), name, purpose, degrees, sure, points };
        self.models.pick(&path, &wanted).map(|found| Response::json(&found))
    }

    fn start(&self, request: &Request) -> Outcome<Response> {
        let head = &request.head;
        let asked = Asked {
            command: head.asked("command"),
            case: head.asked("case"),
            run: head.asked("run"),
            kind: head.asked("kind"),
            force: head.asked("force") == "true",
            hexahedra: head.asked("hexahedra") == "true",
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
                    "objective": objective(&record.case), "history": table("history.csv"), "quantities": table("quantities.csv"),
                })
            }
            _ => Value::Null,
        };
        Ok(Response::json(&json!({ "job": job, "run": run, "log": tail(&self.folder, &log) })))
    }

    fn report(&self, request: &Request) -> Outcome<Response> {
        let _alone = self.models.alone();
        let OpenRun { directory, resolved, mesh } = OpenRun::of(self.folder.run(request.head.asked("run"))?)?;
        let options = PageOptions { view_only: request.head.asked("view") == "true", ..PageOptions::default() };
        Ok(Response::framed(page(&directory, &resolved.case, &mesh, &options)?.html))
    }
}

/// What an optimization made small or large, and whether the objective of its tables is the negative of it.
fn objective(case: &Value) -> Value {
    let kind = case["objective"].as_object().and_then(|of| of.keys().find(|key| *key != "load_cases"));
    let (text, maximized) = match kind.map(String::as_str) {
        Some("contact_force") => ("contact force, maximized", true),
        Some("compliance") => ("compliance, minimized", false),
        Some("maximise") => ("maximized", true),
        Some("minimise") => ("minimized", false),
        Some("follow") => ("distance from the curve, minimized", false),
        _ => return Value::Null,
    };
    json!({ "text": text, "maximized": maximized })
}

/// Commands for which a case has the sections.
fn runs(resolved: &Resolved) -> Vec<&'static str> {
    let all = [("solve", &["dirichlet"][..]), ("optimize", slipstick_service::optimization::SECTIONS)];
    all.iter().filter(|(_, sections)| resolved.require(sections).is_ok()).map(|(command, _)| *command).collect()
}

fn edit(request: &Request) -> Outcome<Response> {
    let wrong = || Failure::input("the body is not `{ text, path, value }`", "use the fields of the page");
    let asked: Value = serde_json::from_slice(&request.body).map_err(|_| wrong())?;
    let (Some(text), Some(path)) = (asked["text"].as_str(), asked["path"].as_str()) else { return Err(wrong()) };
    let text = match asked.get("value").map(Value::as_str) {
        None => without(text, path)?,
        Some(Some(value)) => with_value(text, path, value)?,
        Some(None) => return Err(wrong()),
    };
    Ok(Response::json(&json!({ "text": text })))
}

fn text(request: &Request) -> Outcome<&str> {
    std::str::from_utf8(&request.body).map_err(|_| Failure::input("the text is not UTF-8", "use a browser"))
}

/// The text of a case file or a deck itself.
pub fn raw_text(path: &Path) -> Outcome<String> {
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
