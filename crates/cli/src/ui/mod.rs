//! `slipstick ui`: a page in the browser to edit, check, run and judge cases of a folder.
//!
//! ```text
//! browser ──http (one request per connection)──▶ admission ──▶ api ──▶ service: check while one types, report
//!                                                              ├──▶ models: the mesh, and picked faces
//!                                                              └──▶ jobs: this program as another process
//! ```
//!
//! Runs are other processes with the command lines that the page shows. What they are and how they go is read
//! from their files, so the page can be loaded again at any time, and runs that were started elsewhere are shown
//! too. The server is part of the program rather than a crate: it answers one request per connection, and a
//! library would be larger than these lines and leave their limits (time, size, number of connections) to others.
//!
//! Who may ask is decided in [`admission`], and which files may be named in [`folder`].

mod admission;
mod api;
mod folder;
mod forms;
mod http;
mod jobs;
mod models;
mod outline;

use std::io::Write as _;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use serde_json::json;

use crate::args::Ui;
use crate::context::Context;
use admission::Token;
use api::Server;
use folder::Folder;
use slipstick_service::failure::{Failure, Outcome};

/// Connections at the same time; a browser opens about six.
const MOST_CONNECTIONS: usize = 32;

/// Serves the page until the process is ended.
///
/// # Errors
/// [`Failure::Input`] if there is nothing to open, or if the port is taken.
pub fn run(context: &Context, args: &Ui) -> Outcome {
    let (folder, opened) = Folder::of(args.path.as_deref().unwrap_or(Path::new(".")))?;
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, args.port.unwrap_or(0))).map_err(|error| {
        let port = args.port.map_or("any port".into(), |port| format!("port {port}"));
        Failure::input(format!("cannot listen on {port} of 127.0.0.1: {error}"), "name another with --port")
    })?;
    let port = listener.local_addr().map_or(0, |at| at.port());
    let token = Token::random()?;
    let url = format!("http://127.0.0.1:{port}/{}/", token.text());
    context.console.event("ui", json!({ "url": url, "folder": folder.path() }));
    context.console.text(&format!("{url}\n  serves {} until Ctrl-C", folder.path().display()));
    if std::env::var_os("SSH_CONNECTION").is_some() {
        context.console.text(&format!(
            "  from another machine: ssh -L {port}:127.0.0.1:{port} HOST, then open the same address there"
        ));
    } else if !args.no_browser {
        open(&url);
    }
    let threads = context.common.threads;
    let server = Arc::new(Server::new(folder, opened, threads));
    serve(&listener, &Arc::new(token), &server);
    Ok(())
}

fn serve(listener: &TcpListener, token: &Arc<Token>, server: &Arc<Server>) {
    let open = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            // the system may have no file descriptors left, and would say so again at once
            std::thread::sleep(Duration::from_millis(50));
            continue;
        };
        if open.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
            open.fetch_sub(1, Ordering::SeqCst);
            continue;
        }
        let (token, server, open) = (Arc::clone(token), Arc::clone(server), Leaving(Arc::clone(&open)));
        // a system without threads left refuses this one connection
        let _ = std::thread::Builder::new().spawn(move || {
            let _open = open;
            answer(&stream, &token, &server);
        });
    }
}

/// Counts a connection until it is closed, also if its thread panics.
struct Leaving(Arc<AtomicUsize>);

impl Drop for Leaving {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// One request and its answer.
fn answer(stream: &TcpStream, token: &Token, server: &Server) {
    let request = http::read(stream, |head| admission::admit(head, token));
    let whole = request.is_ok();
    let response = request.map_or_else(|refused| refused, |request| server.answer(&request));
    // the browser may have gone
    if response.write(stream).is_ok() && !whole {
        http::drain(stream);
    }
}

/// Opens the page in the browser. Other users can read command lines, so the browser gets a file that only
/// this user can read, which refers to the address; without a desktop, nothing happens.
fn open(url: &str) {
    let Some(file) = referring(url) else { return };
    let opener = match std::env::consts::OS {
        "macos" => Command::new("open"),
        "windows" => Command::new("explorer"),
        _ => Command::new("xdg-open"),
    };
    let mut opener = opener;
    let started = opener.arg(&file).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    std::thread::spawn(move || {
        if let Ok(mut child) = started {
            let _ = child.wait();
        }
        std::thread::sleep(Duration::from_secs(30));
        let _ = std::fs::remove_file(file);
    });
}

fn referring(url: &str) -> Option<PathBuf> {
    let name = format!("slipstick-ui-{}.html", Token::random().ok()?.text());
    let file = std::env::temp_dir().join(name);
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let text =
        format!("<!DOCTYPE html><meta http-equiv=\"refresh\" content=\"0; url={url}\"><a href=\"{url}\">slipstick</a>");
    options.open(&file).ok()?.write_all(text.as_bytes()).ok()?;
    Some(file)
}
