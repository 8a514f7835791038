//! The server of `slipstick ui`, asked as a browser and as others would ask.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::process::{Child, Stdio};
use std::time::Instant;

use super::*;

mod limits;
mod picks;

/// A server of the folder of a place, ended with this value.
struct Served {
    child: Child,
    port: u16,
    token: String,
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A status code and a body.
struct Answer {
    status: u16,
    head: String,
    body: String,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.body))
    }
}

impl Served {
    fn new(place: &Place, what: &str) -> Self {
        Self::by(&mut place.command(&format!("ui {what} --no-browser --json --threads 1")))
    }

    /// As a command starts it.
    fn by(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the program runs");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("piped")).read_line(&mut line).expect("a line");
        let event: Value = serde_json::from_str(&line).expect("JSON");
        let url = event["url"].as_str().expect("an address").strip_prefix("http://127.0.0.1:").expect("loopback");
        let (port, token) = url.trim_end_matches('/').split_once('/').expect("a token");
        Self { child, port: port.parse().expect("a port"), token: token.to_owned() }
    }

    /// Sends bytes and reads the answer.
    fn send(&self, bytes: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("a connection");
        // a refusal may come before all is sent
        let _ = stream.write_all(bytes).and_then(|()| stream.shutdown(Shutdown::Write));
        let mut text = Vec::new();
        let _ = stream.read_to_end(&mut text);
        let text = String::from_utf8_lossy(&text).into_owned();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        let status = head.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or(0);
        Answer { status, head: head.to_owned(), body: body.to_owned() }
    }

    fn with(&self, method: &str, path: &str, headers: &str, body: &str) -> Answer {
        let length = body.len();
        self.send(format!("{method} {path} HTTP/1.1\r\n{headers}Content-Length: {length}\r\n\r\n{body}").as_bytes())
    }

    /// As the page asks.
    fn get(&self, path: &str) -> Answer {
        self.with("GET", &format!("/{}/{path}", self.token), &format!("Host: 127.0.0.1:{}\r\n", self.port), "")
    }

    fn post(&self, path: &str, body: &str) -> Answer {
        let host = format!("127.0.0.1:{}", self.port);
        let headers = format!("Host: {host}\r\nOrigin: http://{host}\r\n");
        self.with("POST", &format!("/{}/{path}", self.token), &headers, body)
    }

    /// Starts a command and waits until it ends; its state.
    fn done(&self, query: &str) -> Value {
        let started = self.post(&format!("start?{query}"), "");
        assert_eq!(started.status, 200, "{}", started.body);
        let begin = Instant::now();
        loop {
            let state = self.get("state?run=&log=job").json();
            if state["job"]["running"] == false {
                return state;
            }
            assert!(begin.elapsed() < Duration::from_secs(100), "{state}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

#[test]
fn the_page_is_served_whole() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    let files = ["", "ui.css", "ui.js"].map(|name| served.get(name));
    let size: usize = files.iter().map(|file| file.body.len()).sum();
    assert!(files.iter().all(|file| file.status == 200) && size < 200_000, "{size}");
    assert!(files[0].head.contains("default-src 'none'; script-src 'self'"), "{}", files[0].head);
    assert!(files[0].head.contains("frame-ancestors 'none'"));
    let folder = served.get("folder").json();
    assert_eq!((&folder["case"], &folder["cases"]), (&"case.toml".into(), &serde_json::json!(["case.toml"])));
    assert_eq!(served.get("case?case=case.toml").json()["text"], CASE);
    assert_eq!(served.get("nothing").status, 404);
}

/// Another user of the machine can connect, but does not know the token.
#[test]
fn without_the_token_nothing_is_answered() {
    let place = Place::new();
    let served = Served::new(&place, ".");
    assert!(served.token.len() == 32 && served.token.bytes().all(|byte| byte.is_ascii_hexdigit()));
    let host = format!("Host: 127.0.0.1:{}\r\n", served.port);
    let mut wrong = served.token.clone();
    wrong.replace_range(31.., if wrong.ends_with('0') { "1" } else { "0" });
    for path in
        ["/", "/folder", "/ui.js", &format!("/{wrong}/folder"), &format!("/{}x/", served.token), "//folder", "/schema"]
    {
        let answer = served.with("GET", path, &host, "");
        assert!(answer.status == 403 && answer.body.contains("token"), "{path}: {}", answer.body);
        assert!(!answer.body.contains(&served.token) && !answer.head.contains(&served.token));
    }
    // two servers have different ones
    assert_ne!(served.token, Served::new(&place, ".").token);
}

/// What other users of the machine can see, command lines and readable files, does not contain the token: the browser gets
/// a file that only this user can read.
#[test]
#[cfg(target_os = "linux")]
fn other_users_do_not_see_the_token() {
    use std::os::unix::fs::PermissionsExt as _;
    let place = Place::new();
    std::fs::create_dir(place.path("programs")).expect("a folder");
    // instead of the desktop's
    place.write(
        "programs/xdg-open",
        "#!/bin/sh\nstat -c %a \"$1\" > opened.new\necho \"$@\" >> opened.new\ncat \"$1\" >> opened.new\nmv opened.new opened\n",
    );
    let executable = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(place.path("programs/xdg-open"), executable).expect("executable");
    let path = format!("{}:{}", place.path("programs").display(), std::env::var("PATH").unwrap_or_default());
    let mut command = place.command("ui . --json");
    let served = Served::by(command.env("PATH", path).env_remove("SSH_CONNECTION"));
    let begin = Instant::now();
    while !place.path("opened").exists() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no browser is opened");
        std::thread::sleep(Duration::from_millis(20));
    }
    let opened = place.read("opened");
    let mut lines = opened.lines();
    assert_eq!(lines.next(), Some("600"), "{opened}");
    assert!(lines.next().is_some_and(|words| !words.contains(&served.token)), "{opened}");
    assert!(lines.collect::<String>().contains(&format!("/{}/", served.token)), "{opened}");
    let words = std::fs::read(format!("/proc/{}/cmdline", served.child.id())).expect("the command line");
    assert!(!String::from_utf8_lossy(&words).contains(&served.token));
}

/// All of 127.0.0.0/8 is this machine on Linux; the server listens on one address of it, and on none of another
/// interface.
#[test]
#[cfg(target_os = "linux")]
fn it_listens_on_one_address() {
    let place = Place::new();
    let served = Served::new(&place, ".");
    assert!(TcpStream::connect(("127.0.0.1", served.port)).is_ok());
    assert!(TcpStream::connect(("127.0.0.2", served.port)).is_err());
}

/// A page of another site whose name leads to 127.0.0.1 sends its own name; a tunnel has another port.
#[test]
fn other_names_are_refused() {
    let place = Place::new();
    let served = Served::new(&place, ".");
    let path = format!("/{}/folder", served.token);
    let port = served.port;
    for host in
        ["evil.example", &format!("evil.example:{port}"), "127.0.0.1.evil.example", "localhost.evil.example", ""]
    {
        let answer = served.with("GET", &path, &format!("Host: {host}\r\n"), "");
        assert!(answer.status == 403 && answer.body.contains("name"), "{host}: {}", answer.body);
    }
    assert_eq!(served.with("GET", &path, "", "").status, 403);
    let twice = format!("Host: 127.0.0.1:{port}\r\nHost: evil.example\r\n");
    assert_eq!(served.with("GET", &path, &twice, "").status, 403);
    for host in ["localhost:9000", "127.0.0.1:9000", "localhost"] {
        assert_eq!(served.with("GET", &path, &format!("Host: {host}\r\n"), "").status, 200, "{host}");
    }
}

/// Even if another page knew the token, it could change nothing.
#[test]
fn other_pages_change_nothing() {
    let place = Place::new();
    let served = Served::new(&place, ".");
    let stop = format!("/{}/stop", served.token);
    let host = format!("127.0.0.1:{}", served.port);
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1", &format!("https://{host}"), ""] {
        let headers = format!("Host: {host}\r\nOrigin: {origin}\r\n");
        assert_eq!(served.with("POST", &stop, &headers, "").status, 403, "{origin}");
        assert_eq!(served.with("GET", &format!("/{}/folder", served.token), &headers, "").status, 403, "{origin}");
    }
    // forms of old browsers send none
    assert_eq!(served.with("POST", &stop, &format!("Host: {host}\r\n"), "").status, 403);
    assert_eq!(served.post("stop", "").status, 200);
    for path in ["check", "save", "pick", "values", "edit", "start"] {
        let headers = format!("Host: {host}\r\nOrigin: http://evil.example\r\n");
        assert_eq!(served.with("POST", &format!("/{}/{path}", served.token), &headers, "").status, 403, "{path}");
        assert_eq!(served.get(path).status, 404, "{path}");
    }
    // a picture of another page could send a GET, which therefore changes nothing
    assert_eq!(served.get("stop").status, 404);
    assert_eq!(served.with("PUT", &stop, &format!("Host: {host}\r\n"), "").status, 405);
}

#[test]
fn only_files_of_the_folder_are_opened() {
    let place = Place::new();
    std::fs::create_dir(place.path("inner")).expect("made");
    place.write("inner/case.toml", CASE);
    place.write("secret.toml", "title = \"secret\"\n");
    let served = Served::new(&place, "inner");
    assert_eq!(served.get("folder").json()["cases"], serde_json::json!(["case.toml"]));
    let absolute = place.path("secret.toml").display().to_string().replace('/', "%2F");
    let mut names =
        vec!["../secret.toml", "..%2Fsecret.toml", "..%2fsecret.toml", ".%2Fcase.toml", "..", "", "case.toml%00"];
    names.extend([&*absolute, "inner%2Fcase.toml", "..%5Csecret.toml", "C:secret.toml", "%2E%2E%2Fsecret.toml"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(place.path("secret.toml"), place.path("inner/link.toml")).expect("a link");
        std::os::unix::fs::symlink(place.path("none"), place.path("inner/broken")).expect("a link");
        names.extend(["link.toml", "broken"]);
    }
    for name in names {
        for path in ["case?case", "case?run", "model?case", "report?run"] {
            let answer = served.get(&format!("{path}={name}"));
            assert!(answer.status == 400 && answer.body.contains("is not a name in"), "{path} {name}: {}", answer.body);
        }
        let posts =
            ["save?case", "check?case", "pick?name=a&case", "start?command=check&case", "start?command=new&case"];
        for path in posts.into_iter().chain(["start?command=resume&run", "start?command=export&kind=vtu&run"]) {
            let answer = served.post(&format!("{path}={name}"), "[0,1,2,3]");
            let refused = answer.status == 400 && answer.body.contains("is not a name in");
            assert!(refused, "{path} {name}: {}", answer.body);
        }
        let state = served.get(&format!("state?run={name}"));
        assert!(state.status == 200 && state.json()["run"].is_null() && state.json()["log"] == "", "{}", state.body);
    }
    assert_eq!(place.read("secret.toml"), "title = \"secret\"\n");
    assert_eq!(served.post("start?command=rm&case=case.toml", "").status, 400);
}

/// What the page shows at a line is what `slipstick check` says, for the text as it is edited.
#[test]
fn an_edited_text_is_checked_and_saved() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    let wrong = CASE.replace("friction = 0.3", "frction = 0.3").replace("steps = 4", "steps = 0");
    let found = served.post("check?case=case.toml", &wrong).json();
    assert_eq!(place.read("case.toml"), CASE, "nothing is written");
    place.write("wrong.toml", &wrong);
    let Ran { out, .. } = place.run("check wrong.toml --json");
    let told: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let diagnostics = found["diagnostics"].as_array().expect("a list");
    assert_eq!(diagnostics.len(), 2, "{diagnostics:#?}");
    for one in diagnostics {
        let same = |of: &&Value| ["code", "line", "column", "message", "help"].iter().all(|key| of[key] == one[key]);
        assert_eq!(told.iter().filter(same).count(), 1, "{one} {out}");
    }
    assert!(found["outline"].is_null());
    // a valid text has its parts, with lines
    let good = CASE.replace("Block on slab", "Block on a slab");
    let found = served.post("check?case=case.toml", &good).json();
    let contacts = found["outline"].as_array().expect("groups").iter().find(|group| group["title"] == "Contacts");
    let pair = &contacts.expect("contacts")["items"][0];
    assert_eq!(
        (&pair["name"], &pair["marks"]),
        (&"block_ymin on slab_ymax".into(), &serde_json::json!(["block_ymin", "slab_ymax"]))
    );
    let line = CASE.lines().position(|line| line == "[[contact]]").expect("a table") + 1;
    assert!(pair["line"].as_u64().is_some_and(|at| (line..line + 2).contains(&(at as usize))), "{pair}");
    assert_eq!(found["runs"], serde_json::json!(["solve", "optimize"]));
    // the model is that of the text
    let finer = good.replace("elements = [4, 2, 2]", "elements = [8, 2, 2]");
    served.post("check?case=case.toml", &finer);
    let model = served.get("model?case=case.toml");
    assert!(model.status == 200 && model.head.contains("sandbox allow-scripts"), "{}", model.head);
    let data = report::data(&model.body);
    assert_eq!(data["model"]["bodies"][0]["hexes"], serde_json::json!([0, 32]));
    let marks: Vec<&Value> = data["marks"].as_array().expect("marks").iter().map(|mark| &mark["name"]).collect();
    assert_eq!(marks, ["block_ymin", "slab_ymax", "slab_ymin", "block_ymax"]);
    // saved once; a text that another program has changed meanwhile is not lost
    let stamp = served.get("case?case=case.toml").json()["stamp"].as_str().expect("a stamp").to_owned();
    let saved = served.post(&format!("save?case=case.toml&stamp={stamp}"), &good);
    assert_eq!((saved.status, place.read("case.toml")), (200, good.clone()));
    let late = served.post(&format!("save?case=case.toml&stamp={stamp}"), CASE);
    assert!(late.status == 409 && late.body.contains("another program"), "{}", late.body);
    assert_eq!(place.read("case.toml"), good);
}

/// The byte order mark that some editors write stays at the start of the file, and is not part of the text.
#[test]
fn a_byte_order_mark_stays() {
    let place = Place::new();
    place.write("case.toml", &format!("\u{feff}{CASE}"));
    let served = Served::new(&place, "case.toml");
    let read = served.get("case?case=case.toml").json();
    assert_eq!(read["text"], CASE);
    let text = format!("{CASE}# more\n");
    for text in [&text, CASE] {
        let stamp = served.get("case?case=case.toml").json()["stamp"].as_str().expect("a stamp").to_owned();
        assert_eq!(served.post(&format!("save?case=case.toml&stamp={stamp}"), text).status, 200);
        assert_eq!(place.read("case.toml"), format!("\u{feff}{text}"));
    }
}

/// A text with too many elements does not end the server.
#[test]
fn a_model_that_is_too_large_is_refused() {
    let place = Place::with("elements = [4, 2, 2]", "elements = [40000, 20000, 2000]");
    let served = Served::new(&place, "case.toml");
    let answer = served.get("model?case=case.toml");
    assert!(answer.status == 400 && answer.body.contains("more than 1000000 elements"), "{}", answer.body);
    assert_eq!(served.get("folder").status, 200);
}

/// Runs are those of the command line that is shown, and read from their files.
#[test]
fn commands_run_and_are_followed() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    let state = served.done("command=check&case=case.toml");
    assert_eq!(
        (&state["job"]["code"], &state["job"]["line"]),
        (&0.into(), &"slipstick check case.toml --threads 1".into())
    );
    assert!(state["log"].as_str().is_some_and(|log| log.contains("supports and motions")), "{state}");

    let state = served.done("command=optimize&case=case.toml");
    assert_eq!(state["job"]["line"], "slipstick optimize case.toml --out case --threads 1");
    let (run, log) = (served.get("state?run=case").json()["run"].clone(), state["log"].as_str().expect("text"));
    assert_eq!((&run["exit"], &run["in_progress"]), (&"finished".into(), &false.into()));
    assert_eq!(run["history"], place.read("case/history.csv"));
    assert_eq!(run["quantities"], place.read("case/quantities.csv"));
    assert!(log.contains("objective") && place.read("case.ui.log") == log, "{log}");
    let words = place.json("case/run.json")["command"].clone();
    assert_eq!(words.as_array().expect("words")[1..], ["optimize", "case.toml", "--out", "case", "--threads", "1"]);
    // the same command from a terminal gives the same design
    place.good("optimize case.toml --out other -q");
    assert_eq!(place.read("other/design.csv"), place.read("case/design.csv"));
    let report = served.get("report?run=case");
    assert_eq!(report::data(&report.body)["designs"].as_array().map(Vec::len), Some(3));

    // earlier results are only replaced if this is asked for, and a failure says why
    let refused = served.post("start?command=optimize&case=case.toml", "");
    assert!(
        refused.status == 400 && refused.body.contains("already contains the results of a run"),
        "{}",
        refused.body
    );
    assert_eq!(place.read("case.ui.log"), log, "a refused command keeps the log of the run");
    assert_eq!(served.done("command=optimize&case=case.toml&force=true")["job"]["code"], 0);
    // a server that is started later shows the run and its log
    let later = Served::new(&place, "case");
    let folder = later.get("folder").json();
    assert_eq!((&folder["case"], &folder["run"]), (&"case.toml".into(), &"case".into()));
    let state = later.get("state?run=case").json();
    assert!(state["job"].is_null() && state["log"].as_str().is_some_and(|log| log.contains("objective")), "{state}");
}

/// The error of a run that fails is in its record and in its log.
#[test]
fn a_run_that_fails_says_why() {
    let place = Place::new();
    // nothing holds the block against its load
    let gap = CASE.replace("min = [0.6, 1.0,", "min = [0.6, 1.1,").replace("u = [0, -0.1, 0]", "u = [0, 0, 0]");
    let free = "set = \"block_ymax\"\ncomponents = [\"x\", \"z\"]";
    let case = gap.replace("[0.2, -0.1, 0.05]", "[0.2, 0, 0.05]").replace("set = \"block_ymax\"", free);
    place.write("case.toml", &(case + "\n[[load]]\nsurface = \"block_ymax\"\npressure = -1.0\n"));
    let served = Served::new(&place, "case.toml");
    let state = served.done("command=solve&case=case.toml");
    assert_eq!(state["job"]["code"], 3);
    let run = served.get("state?run=case_solve").json()["run"].clone();
    assert_eq!(run["exit"], "failed");
    for text in [&state["log"], &run["message"]] {
        assert!(text.as_str().is_some_and(|text| text.contains("nothing holds body `block` against its load along y")));
    }
    assert_eq!(served.get("report?run=case_solve").status, 200);
}

/// Stop ends a run in order, and Resume continues it to the same design.
#[test]
#[cfg(unix)]
fn a_stopped_run_resumes_bit_for_bit() {
    let place = Place::with("iterations = 4", "iterations = 200");
    let served = Served::new(&place, "case.toml");
    assert_eq!(served.post("start?command=optimize&case=case.toml", "").status, 200);
    let begin = Instant::now();
    while served.get("state?run=case").json()["run"]["history"].as_str().is_none_or(|table| table.lines().count() < 3) {
        assert!(begin.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
    }
    // one at a time
    let second = served.post("start?command=check&case=case.toml", "");
    assert!(second.status == 400 && second.body.contains("runs already"), "{}", second.body);
    let running = served.get("state?run=case").json();
    assert_eq!((&running["run"]["in_progress"], &running["run"]["exit"]), (&true.into(), &"running".into()));
    assert_eq!(served.post("stop", "").json()["stopping"], true);
    let stopped = loop {
        let state = served.get("state?run=case").json();
        if state["job"]["running"] == false {
            break state;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    assert_eq!((&stopped["job"]["code"], &stopped["run"]["exit"]), (&4.into(), &"interrupted".into()));
    assert_eq!(stopped["run"]["resumable"], true);
    assert_eq!(served.done("command=resume&run=case")["job"]["code"], 0);
    place.good("optimize case.toml --out whole -q");
    assert_eq!(place.read("case/design.csv"), place.read("whole/design.csv"));
}

/// Text of a case that is markup stays text.
#[test]
fn names_are_no_markup() {
    let title = "</script><img src=x onerror=alert(1)>";
    let place = Place::with("Block on slab", title);
    let served = Served::new(&place, "case.toml");
    for page in [served.get("model?case=case.toml"), served.get("")] {
        assert!(page.status == 200 && !page.body.contains("<img src=x"), "markup");
    }
    assert_eq!(report::data(&served.get("model?case=case.toml").body)["title"], title);
    // the page makes no markup of text
    let script = served.get("ui.js").body;
    assert!(
        !["innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("]
            .iter()
            .any(|way| script.contains(way))
    );
}

#[test]
fn other_input_than_a_browser_sends_is_refused() {
    let place = Place::new();
    let served = Served::new(&place, ".");
    let (token, host) = (&served.token, format!("Host: 127.0.0.1:{}\r\n", served.port));
    for bytes in [
        "\r\n\r\n",
        "GET\r\n\r\n",
        "GET / HTTP/2\r\n\r\n",
        "GET / HTTP/1.1\r\nno header\r\n\r\n",
        "GET /%zz HTTP/1.1\r\n\r\n",
        "GET /%ff HTTP/1.1\r\n\r\n",
    ] {
        assert_eq!(served.send(bytes.as_bytes()).status, 400, "{bytes:?}");
    }
    assert_eq!(served.send(&[b'a'; 40_000]).status, 413);
    let post = |length: &str| {
        let origin = format!("Origin: http://127.0.0.1:{}\r\n", served.port);
        served.send(format!("POST /{token}/stop HTTP/1.1\r\n{host}{origin}{length}\r\n\r\n").as_bytes()).status
    };
    assert_eq!(post("Content-Length: 999999999"), 413);
    assert_eq!(post("Content-Length: -1"), 400);
    assert_eq!(post("Content-Length: 1\r\nContent-Length: 2"), 400);
    assert_eq!(post("Transfer-Encoding: chunked"), 400);
    // a body that does not arrive
    assert_eq!(post("Content-Length: 5"), 400);
    assert_eq!(served.get("folder").status, 200);
}

#[test]
fn what_cannot_be_opened_is_an_error() {
    let place = Place::new();
    place.write("mesh.vtu", "");
    for (what, message) in [("nothing.toml", "cannot open nothing.toml"), ("mesh.vtu", "mesh.vtu is not a case")] {
        let Ran { code, err, .. } = place.run(&format!("ui {what} --no-browser"));
        assert!(code == Some(2) && err.contains(message), "{err}");
    }
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    let Ran { code, err, .. } = place.run(&format!("ui . --no-browser --port {port}"));
    assert!(code == Some(2) && err.contains("--port"), "{err}");
}
