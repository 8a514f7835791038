//! HTTP/1.1 (RFC 9112), as far as one page needs it: a request with a head and a body of known length, an answer,
//! and the connection is closed.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Largest head and body. \[bytes\]
const MOST_HEAD: usize = 16 << 10;
const MOST_BODY: usize = 16 << 20;

/// Time for the head of a request to arrive: idle connections must not keep others out.
const HEAD_PATIENCE: Duration = Duration::from_secs(3);
/// Time for a request to arrive, and for a short answer to be taken.
const PATIENCE: Duration = Duration::from_secs(20);
/// The slowest connection over which a long answer arrives whole. \[bytes/s\]
const SLOWEST: usize = 100_000;
/// What is still read of a request that was refused, and for how long: a browser shows the refusal only after it
/// has sent all.
const MOST_DRAINED: usize = 4 * MOST_BODY;
const DRAINING: Duration = Duration::from_secs(3);

/// The head of a request.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Head {
    /// `GET`, `POST`, ….
    pub method: String,
    /// Segments of the path, decoded.
    pub path: Vec<String>,
    /// Names and values of the query, decoded.
    pub query: Vec<(String, String)>,
    /// Names in lower case, and values.
    pub headers: Vec<(String, String)>,
}

/// A request that may be answered.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Request {
    /// Its head.
    pub head: Head,
    /// Its body.
    pub body: Vec<u8>,
}

impl Head {
    /// The value of a header, if it occurs once.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(of, _)| of == name);
        let value = found.next()?.1.as_str();
        found.next().is_none().then_some(value)
    }

    /// Whether a header occurs.
    pub fn has(&self, name: &str) -> bool {
        self.headers.iter().any(|(of, _)| of == name)
    }

    /// A value of the query; empty if it is missing.
    pub fn asked(&self, name: &str) -> &str {
        self.query.iter().find(|(of, _)| of == name).map_or("", |(_, value)| value)
    }

    /// Reads the lines of a head.
    pub fn parse(text: &str) -> Option<Self> {
        let mut lines = text.split("\r\n");
        let mut start = lines.next()?.split(' ');
        let (method, target, version) = (start.next()?, start.next()?, start.next()?);
        if start.next().is_some() || !version.starts_with("HTTP/1.") || !target.starts_with('/') {
            return None;
        }
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let pair = |part: &str| {
            let (name, value) = part.split_once('=').unwrap_or((part, ""));
            Some((decoded(name)?, decoded(value)?))
        };
        let header = |line: &str| {
            let (name, value) = line.split_once(':')?;
            let valid = !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic());
            valid.then(|| (name.to_ascii_lowercase(), value.trim().to_owned()))
        };
        Some(Self {
            method: method.to_owned(),
            path: path[1..].split('/').map(decoded).collect::<Option<_>>()?,
            query: query.split('&').filter(|part| !part.is_empty()).map(pair).collect::<Option<_>>()?,
            headers: lines.filter(|line| !line.is_empty()).map(header).collect::<Option<_>>()?,
        })
    }
}

/// Text with `%41` for `A`; `None` if it is not UTF-8.
fn decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, after @ ..] = rest {
        rest = after;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let digits = std::str::from_utf8(after.get(..2)?).ok()?;
        if digits.starts_with('+') {
            return None;
        }
        bytes.push(u8::from_str_radix(digits, 16).ok()?);
        rest = &after[2..];
    }
    String::from_utf8(bytes).ok()
}

/// An answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    status: u16,
    kind: &'static str,
    /// The content security policy.
    policy: &'static str,
    /// The body.
    pub body: Vec<u8>,
}

/// Nothing is loaded or run.
const NOTHING: &str = "default-src 'none'; frame-ancestors 'none'";
/// The page: its own files, and frames of this server.
const OWN: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; \
                   frame-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
/// Views and reports, which contain all they need, in a frame of the page; even if opened on their own, they
/// have an origin of their own.
const FRAMED: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'self'; sandbox allow-scripts";

impl Response {
    /// Data.
    pub fn json(value: &Value) -> Self {
        Self { status: 200, kind: "application/json", policy: NOTHING, body: value.to_string().into_bytes() }
    }

    /// A file of the page.
    pub fn file(kind: &'static str, text: impl Into<String>) -> Self {
        Self { status: 200, kind, policy: OWN, body: text.into().into_bytes() }
    }

    /// A page that contains all it needs.
    pub fn framed(html: String) -> Self {
        Self { status: 200, kind: "text/html; charset=utf-8", policy: FRAMED, body: html.into_bytes() }
    }

    /// A refusal, with its remedy.
    pub fn refusal(status: u16, message: &str, cure: &str) -> Self {
        Self { status, ..Self::json(&serde_json::json!({ "error": message, "cure": cure })) }
    }

    /// A refusal as text, for a frame.
    pub fn plain(status: u16, text: String) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", ..Self::framed(text) }
    }

    /// Sends it, within a time that its size decides, however slowly it is taken.
    pub fn write(&self, mut stream: &TcpStream) -> std::io::Result<()> {
        let reason = match self.status {
            200 => "OK",
            400 => "Bad Request",
            403 => "Forbidden",
            404 => "Not Found",
            405 => "Method Not Allowed",
            409 => "Conflict",
            413 => "Content Too Large",
            _ => "Refused",
        };
        let head = format!(
            "HTTP/1.1 {} {reason}\r\nContent-Type: {}\r\nContent-Length: {}\r\nContent-Security-Policy: {}\r\n\
             X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCache-Control: no-store\r\n\
             Cross-Origin-Resource-Policy: same-origin\r\nConnection: close\r\n\r\n",
            self.status,
            self.kind,
            self.body.len(),
            self.policy
        );
        let until = Instant::now() + PATIENCE + Duration::from_secs((self.body.len() / SLOWEST) as u64);
        for part in std::iter::once(head.as_bytes()).chain(self.body.chunks(64 << 10)) {
            let mut rest = part;
            while !rest.is_empty() {
                let left = until.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    return Err(ErrorKind::TimedOut.into());
                }
                stream.set_write_timeout(Some(left))?;
                match stream.write(rest) {
                    Ok(0) => return Err(ErrorKind::WriteZero.into()),
                    Ok(count) => rest = &rest[count..],
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(error) => return Err(error),
                }
            }
        }
        stream.flush()
    }
}

/// Reads what a client still sends after its request was refused, within bounds. A connection that is closed
/// with unread bytes is reset, and the client loses the answer.
pub fn drain(mut stream: &TcpStream) {
    let until = Instant::now() + DRAINING;
    let mut part = vec![0; 64 << 10];
    let mut read = 0;
    // the client learns that the answer has ended
    let _ = stream.shutdown(Shutdown::Write);
    while read < MOST_DRAINED {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() || stream.set_read_timeout(Some(left)).is_err() {
            return;
        }
        match stream.read(&mut part) {
            Ok(count) if count > 0 => read += count,
            _ => return,
        }
    }
}

/// Reads a request. `admit` sees its head before its body is read.
///
/// # Errors
/// The refusal.
pub fn read(mut stream: &TcpStream, admit: impl FnOnce(Head) -> Result<Head, Response>) -> Result<Request, Response> {
    let malformed = || Response::refusal(400, "the request is no HTTP/1.1", "use a browser");
    let begin = Instant::now();
    let mut bytes = Vec::new();
    let mut part = [0; 4096];
    // at most until the deadline, however slowly bytes arrive
    let mut more = |bytes: &mut Vec<u8>, until: Instant| -> Result<(), Response> {
        let left = until.saturating_duration_since(Instant::now());
        stream.set_read_timeout(Some(left.max(Duration::from_millis(1)))).map_err(|_| malformed())?;
        match stream.read(&mut part) {
            Ok(count) if count > 0 && !left.is_zero() => bytes.extend_from_slice(&part[..count]),
            _ => return Err(malformed()),
        }
        Ok(())
    };
    let end = loop {
        if let Some(end) = bytes.windows(4).position(|four| four == b"\r\n\r\n") {
            break end;
        }
        if bytes.len() > MOST_HEAD {
            return Err(Response::refusal(413, "the head of the request is too large", "use a browser"));
        }
        more(&mut bytes, begin + HEAD_PATIENCE)?;
    };
    let head = std::str::from_utf8(&bytes[..end]).ok().and_then(Head::parse).ok_or_else(malformed)?;
    let head = admit(head)?;
    let length = match head.header("content-length").map(str::parse::<usize>) {
        _ if head.has("transfer-encoding") => return Err(malformed()),
        Some(Ok(length)) => length,
        None if !head.has("content-length") => 0,
        _ => return Err(malformed()),
    };
    if length > MOST_BODY {
        return Err(Response::refusal(413, "the text is too large", "keep meshes in files of their own"));
    }
    let mut body = bytes.split_off(end + 4);
    while body.len() < length {
        more(&mut body, begin + PATIENCE)?;
    }
    body.truncate(length);
    Ok(Request { head, body })
}
