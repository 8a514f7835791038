//! Admits requests that know the token and come from a page of this server.
//!
//! | threat | refused by |
//! |---|---|
//! | another machine | the server listens on 127.0.0.1 |
//! | another user of this machine | the token: 128 random bits in the address, which only the terminal of the user and a file of the user show |
//! | a page of another site, whose name leads to 127.0.0.1 (DNS rebinding) | the name in `Host` |
//! | a page of another site that sends requests here | the token, and `Origin` of all requests that change something |
//! | a page of another site that shows this one in a frame | `frame-ancestors` of the content security policy |
//! | text of a case or a run that is markup | the page makes text nodes only; views and reports have an origin of their own (`sandbox`) |

use slipstick_service::failure::{Failure, Outcome};

use super::http::{Head, Response};

/// The secret in the address of the page.
pub struct Token(String);

impl Token {
    /// 128 random bits of the operating system.
    ///
    /// # Errors
    /// [`Failure::Input`] if it has none.
    pub fn random() -> Outcome<Self> {
        let mut bytes = [0_u8; 16];
        getrandom::fill(&mut bytes).map_err(|error| {
            Failure::input(format!("the system gives no random numbers: {error}"), "see the message of the system")
        })?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Its text.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// Whether a text is the token, in a time that does not depend on how much of it is right.
    fn is(&self, text: &str) -> bool {
        let (a, b) = (self.0.as_bytes(), text.as_bytes());
        a.len() == b.len() && a.iter().zip(b).fold(0, |different, (a, b)| different | (a ^ b)) == 0
    }
}

/// Admits a request, without the token in its path, or refuses it.
///
/// # Errors
/// The refusal.
pub fn admit(mut head: Head, token: &Token) -> Result<Head, Response> {
    let refused = |why: &str| Err(Response::refusal(403, why, "open the address that `slipstick ui` has printed"));
    let Some(host) = head.header("host").map(str::to_owned) else { return refused("the request names no host") };
    // the port may be that of a tunnel
    if !["127.0.0.1", "localhost"].contains(&host.rsplit_once(':').map_or(&*host, |(name, _)| name)) {
        return refused("this is not the name of this server");
    }
    if head.path.is_empty() || !token.is(&head.path[0]) {
        return refused("the address lacks the token");
    }
    head.path.remove(0);
    let own = head.header("origin") == Some(&format!("http://{host}"));
    match head.method.as_str() {
        "GET" if own || !head.has("origin") => Ok(head),
        "POST" if own => Ok(head),
        "GET" | "POST" => refused("the request comes from another page"),
        _ => Err(Response::refusal(405, "this method is not known here", "use GET or POST")),
    }
}
