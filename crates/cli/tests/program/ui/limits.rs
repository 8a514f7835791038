//! What several requests at once, slow clients and processes of other terminals may do.

use super::*;

/// Starts an optimization in another terminal; returns when its directory is locked and has a record.
fn elsewhere(place: &Place, served: &Served) -> Child {
    let mut command = place.command("optimize case.toml --out case -q --threads 1");
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program runs");
    wait_for("the run to begin", || served.get("state?run=case").json()["run"]["in_progress"] == true);
    child
}

fn wait_for(what: &str, mut done: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !done() {
        assert!(begin.elapsed() < Duration::from_secs(60), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The log of a run is only replaced by a command that may replace the run.
#[test]
fn a_run_of_another_terminal_keeps_its_log() {
    let place = Place::with("iterations = 4", "iterations = 400");
    let served = Served::new(&place, "case.toml");
    place.write("case.ui.log", "kept\n");
    let mut child = elsewhere(&place, &served);
    for query in
        ["command=optimize&case=case.toml&force=true", "command=optimize&case=case.toml", "command=resume&run=case"]
    {
        let refused = served.post(&format!("start?{query}"), "");
        assert!(refused.status == 400 && refused.body.contains("another slipstick process is writing to case"));
    }
    assert_eq!(
        (place.read("case.ui.log"), served.get("state?run=case").json()["job"].is_null()),
        ("kept\n".into(), true)
    );
    child.kill().expect("runs still");
    child.wait().expect("ended");
    // what its process has left behind blocks nobody
    let refused = served.post("start?command=optimize&case=case.toml", "");
    assert!(
        refused.status == 400 && refused.body.contains("already contains the results of a run"),
        "{}",
        refused.body
    );
    assert_eq!(place.read("case.ui.log"), "kept\n");
}

/// Of saves with the same stamp, one replaces the file, and the others learn that it has changed.
#[test]
fn parallel_saves_are_one_after_the_other() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    for round in 0..10 {
        let stamp = served.get("case?case=case.toml").json()["stamp"].as_str().expect("a stamp").to_owned();
        let texts: Vec<String> = (0..8).map(|k| format!("{CASE}\n# {round} {k} {}\n", "x".repeat(k << 14))).collect();
        let save = |text: &String| served.post(&format!("save?case=case.toml&stamp={stamp}"), text).status;
        let statuses: Vec<u16> = std::thread::scope(|scope| {
            let all: Vec<_> = texts.iter().map(|text| scope.spawn(|| save(text))).collect();
            all.into_iter().map(|one| one.join().expect("no panic")).collect()
        });
        let saved: Vec<&String> =
            texts.iter().zip(&statuses).filter(|(_, status)| **status == 200).map(|of| of.0).collect();
        assert_eq!((saved.len(), statuses.iter().filter(|status| **status == 409).count()), (1, 7), "{statuses:?}");
        assert!(place.read("case.toml") == *saved[0], "the file is the text whose save succeeded");
    }
}

/// Models are built one at a time, and those of texts that were edited meanwhile are not built at all.
#[test]
fn a_newer_text_replaces_models_that_wait() {
    let place = Place::new();
    let served = Served::new(&place, "case.toml");
    let text = |n: usize| CASE.replace("elements = [4, 2, 2]", &format!("elements = [{n}, 2, 2]"));
    let large = CASE.replace("elements = [4, 2, 2]", "elements = [90, 90, 90]");
    assert_eq!(served.post("check?case=case.toml", &large).status, 200);
    std::thread::scope(|scope| {
        let model = || served.get("model?case=case.toml");
        let first = scope.spawn(model);
        std::thread::sleep(Duration::from_millis(150));
        let waiting: Vec<_> = (5..9)
            .map(|n| {
                assert_eq!(served.post("check?case=case.toml", &text(n)).status, 200);
                let one = scope.spawn(model);
                std::thread::sleep(Duration::from_millis(30));
                one
            })
            .collect();
        let mut answers: Vec<Answer> = waiting.into_iter().map(|one| one.join().expect("no panic")).collect();
        let last = answers.pop().expect("four");
        assert_eq!((first.join().expect("no panic").status, last.status), (200, 200));
        assert_eq!(report::data(&last.body)["model"]["bodies"][0]["hexes"], serde_json::json!([0, 32]));
        for answer in answers {
            assert!(answer.status == 409 && answer.body.contains("the text has changed"), "{}", answer.status);
        }
    });
}

/// Connections on which nothing arrives are closed soon, so that a request is answered again.
#[test]
fn idle_connections_do_not_keep_others_out() {
    let place = Place::new();
    let served = Served::new(&place, ".");
    let begin = Instant::now();
    let idle: Vec<TcpStream> =
        (0..64).map(|_| TcpStream::connect(("127.0.0.1", served.port)).expect("a connection")).collect();
    wait_for("an answer", || served.get("folder").status == 200);
    assert!(begin.elapsed() < Duration::from_secs(12), "{:?}", begin.elapsed());
    drop(idle);
}

/// Without file descriptors left, the server waits rather than spins, and answers as soon as there are some.
#[test]
#[cfg(target_os = "linux")]
fn too_few_file_descriptors_cost_no_time() {
    let place = Place::new();
    let mut command = Command::new("sh");
    let line = "ulimit -n 12; exec \"$0\" ui . --no-browser --json --threads 1";
    let served = Served::by(command.current_dir(place.path(".")).args(["-c", line, env!("CARGO_BIN_EXE_slipstick")]));
    let idle: Vec<TcpStream> =
        (0..24).map(|_| TcpStream::connect(("127.0.0.1", served.port)).expect("a connection")).collect();
    let ticks = || -> u64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", served.child.id())).expect("Linux");
        let after = stat.rsplit_once(')').expect("a name").1;
        // user and system time, in hundredths of a second (proc_pid_stat(5))
        after.split_whitespace().skip(11).take(2).map(|count| count.parse::<u64>().expect("a number")).sum()
    };
    std::thread::sleep(Duration::from_millis(300));
    let before = ticks();
    std::thread::sleep(Duration::from_secs(2));
    assert!(ticks() - before < 40, "{} of 200", ticks() - before);
    drop(idle);
    wait_for("an answer", || served.get("folder").status == 200);
}

/// A browser reads an answer after it has sent all; a refusal must wait for it.
#[test]
fn a_text_that_is_too_large_is_refused_readably() {
    let place = Place::new();
    let served = Served::new(&place, ".");
    let host = format!("127.0.0.1:{}", served.port);
    let head = format!("POST /{}/save HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n", served.token);
    let mut stream = TcpStream::connect(&host).expect("a connection");
    write!(stream, "{head}Content-Length: {}\r\n\r\n", 17 << 20).expect("sent");
    stream.write_all(&vec![b'x'; 17 << 20]).expect("all of the text is taken");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("no reset");
    assert!(answer.starts_with("HTTP/1.1 413 ") && answer.contains("the text is too large"), "{answer}");
}

/// Ctrl-C in the terminal of the server, and closing that terminal, signal all processes that it started.
#[test]
#[cfg(unix)]
fn what_ends_the_server_from_its_terminal_stops_its_run_in_order() {
    use std::os::unix::process::CommandExt as _;
    // under `nohup`, for instance, the server inherits that signals are ignored
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.map_or(0, |mask| u64::from_str_radix(mask.trim(), 16).expect("a mask"));
    for (signal, number) in [("-INT", 2), ("-HUP", 1)] {
        if ignored & (1 << (number - 1)) != 0 {
            println!("SKIPPED: {signal} is ignored here");
            continue;
        }
        let place = Place::with("iterations = 4", "iterations = 400");
        let mut served = Served::by(place.command("ui case.toml --no-browser --json --threads 1").process_group(0));
        assert_eq!(served.post("start?command=optimize&case=case.toml", "").status, 200);
        let rows = |state: Value| state["run"]["history"].as_str().map_or(0, |table| table.lines().count());
        wait_for("two iterations", || rows(served.get("state?run=case").json()) > 2);
        let group = format!("-{}", served.child.id());
        assert!(Command::new("kill").args([signal, "--", &group]).status().expect("kill runs").success());
        assert!(!served.child.wait().expect("ends").success());
        let later = Served::new(&place, "case");
        wait_for("the run to stop", || later.get("state?run=case").json()["run"]["in_progress"] == false);
        let state = later.get("state?run=case").json();
        assert_eq!(
            (&state["run"]["exit"], &state["run"]["resumable"]),
            (&"interrupted".into(), &true.into()),
            "{signal}"
        );
    }
}
