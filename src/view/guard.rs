//! Access control: checks Host, Origin and token.
//!
//! Another site can resolve one of its names to this host (DNS rebinding). Then a page of that site can make a visitor's browser
//! connect to this server. But the browser sends the name and the origin of that site in `Host` and `Origin`.

use hyper::header::{COOKIE, HOST, HeaderName, HeaderValue, ORIGIN};
use hyper::{HeaderMap, Uri};
use std::net::{IpAddr, SocketAddr};
use thiserror::Error;

/// The reason why a request is refused.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub(super) enum Refusal {
    /// The `Host` is not the name of this server.
    #[error("the Host is not this server's")]
    Host,
    /// The request comes from another page's script.
    #[error("the Origin is not this server's")]
    Origin,
    /// The request has no valid token.
    #[error("it has no token, or a wrong one")]
    Token,
}

/// An admitted browser.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Guest {
    /// The `Host` header of the request: the server's name, and its port if the browser sent one.
    pub host: String,
    /// The cookie that stores the token, if the browser sent the token in the address.
    pub cookie: Option<HeaderValue>,
}

/// Checks requests to the server.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    /// The name or address on which the server was asked to listen.
    name: String,
    /// Whether the server accepts connections from this host only.
    loopback: bool,
    /// The token without which a browser is refused. It is necessary because other users of this host, and other hosts, can reach
    /// the server too.
    token: String,
}

/// The least number of characters in a token that a user chooses.
pub(super) const SHORTEST_TOKEN: usize = 16;

impl Guard {
    /// Creates the access control of a server that listens on `address`. `name` is the name or address that the user gave for it.
    /// Browsers need this token.
    pub fn new(name: &str, address: SocketAddr, token: String) -> Self {
        Self { name: name.to_ascii_lowercase(), loopback: address.ip().is_loopback(), token }
    }

    /// Returns the token.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Checks a request. Returns the admitted browser if the request has the token. The token is in the address of the link, or in
    /// the cookie that an earlier answer set.
    ///
    /// # Errors
    /// [`Refusal`] with the failed check.
    pub fn admit(&self, uri: &Uri, headers: &HeaderMap) -> Result<Guest, Refusal> {
        let host = self.check(headers)?.to_owned();
        let name = cookie_name(&host);
        let mut parts = uri.query().unwrap_or_default().split('&');
        if parts.any(|part| part.strip_prefix("token=").is_some_and(|given| self.is_token(given))) {
            let cookie = format!("{name}={}; Path=/; HttpOnly; SameSite=Strict", self.token);
            return Ok(Guest { host, cookie: HeaderValue::try_from(cookie).ok() });
        }
        let lines = headers.get_all(COOKIE).iter().filter_map(|line| line.to_str().ok());
        let mut cookies = lines.flat_map(|line| line.split(';')).filter_map(|one| one.trim().split_once('='));
        match cookies.any(|(given, value)| given == name && self.is_token(value)) {
            true => Ok(Guest { host, cookie: None }),
            false => Err(Refusal::Token),
        }
    }

    /// Compares `given` with the token, in a time that does not depend on the position of the first difference.
    fn is_token(&self, given: &str) -> bool {
        let difference = self.token.bytes().zip(given.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
        self.token.len() == given.len() && difference == 0
    }

    /// Checks the headers of a request, and returns the `Host`. An `Origin` must name this server. A request without `Origin` passes:
    /// it cannot come from another page's script, because browsers always send the `Origin` of a script that opens a WebSocket.
    fn check<'a>(&self, headers: &'a HeaderMap) -> Result<&'a str, Refusal> {
        let host = single(headers, HOST).filter(|host| self.is_ours(host)).ok_or(Refusal::Host)?;
        match headers.contains_key(ORIGIN) {
            false => Ok(host),
            true => single(headers, ORIGIN)
                .and_then(|origin| origin.strip_prefix("http://"))
                .filter(|origin| origin.eq_ignore_ascii_case(host))
                .map(|_| host)
                .ok_or(Refusal::Origin),
        }
    }

    /// Returns whether `host` is an IP address, `localhost`, or the name on which the server was asked to listen. If the server
    /// accepts connections from this host only, the IP address must be a loopback address. The port is ignored, because a tunnel
    /// (`ssh -L`) may change the port.
    fn is_ours(&self, host: &str) -> bool {
        let Some(name) = without_port(host) else { return false };
        let name = name.to_ascii_lowercase();
        match name.parse::<IpAddr>() {
            Ok(address) => !self.loopback || address.is_loopback(),
            Err(_) => name == "localhost" || name == self.name,
        }
    }
}

/// Returns the value of the header `name` if the request has exactly one such header.
fn single(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?.to_str().ok()?;
    values.next().is_none().then_some(value)
}

/// Strips the port: `a:1` becomes `a`, `[::1]:1` becomes `::1`. Returns `None` if the text after the name is not a port.
fn without_port(host: &str) -> Option<&str> {
    let (name, rest) = match host.strip_prefix('[') {
        Some(bracketed) => bracketed.split_once(']')?,
        None => host.split_at(host.find(':').unwrap_or(host.len())),
    };
    let is_port = |port: &str| port.bytes().all(|byte| byte.is_ascii_digit());
    (rest.is_empty() || rest.strip_prefix(':').is_some_and(is_port)).then_some(name)
}

/// Returns the name of the cookie. Browsers share cookies between the ports of a host, so the name contains the port that the
/// browser uses.
fn cookie_name(host: &str) -> String {
    let port = host.rsplit_once(':').map_or("", |(_, port)| port);
    let is_port = !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit());
    format!("dq_servo_{}", if is_port { port } else { "80" })
}

/// Returns whether a user may choose this token. It must be long enough, and valid in an address and in a cookie.
pub(super) fn is_usable(token: &str) -> bool {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_".contains(&byte);
    token.len() >= SHORTEST_TOKEN && token.bytes().all(is_plain)
}

/// Returns 128 random bits from the operating system, in hexadecimal.
///
/// # Errors
/// The operating system's error if it has no random numbers.
pub(super) fn random_token() -> std::io::Result<String> {
    let mut bytes = [0; 16];
    std::io::Read::read_exact(&mut std::fs::File::open("/dev/urandom")?, &mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(name: &str, address: &str) -> Guard {
        Guard::new(name, address.parse().unwrap(), random_token().unwrap())
    }

    fn map(headers: &[(HeaderName, &str)]) -> HeaderMap {
        let pairs = headers.iter().map(|(name, value)| (name.clone(), value.parse().unwrap()));
        let mut map = HeaderMap::new();
        for (name, value) in pairs {
            map.append(name, value);
        }
        map
    }

    fn check(guard: &Guard, headers: &[(HeaderName, &str)]) -> Result<(), Refusal> {
        guard.check(&map(headers)).map(|_| ())
    }

    #[test]
    fn only_names_of_this_server_are_hosts() {
        let loopback = guard("127.0.0.1", "127.0.0.1:8123");
        for ours in
            ["127.0.0.1:8123", "localhost:8123", "LOCALHOST", "localhost:9000", "[::1]:8123", "127.0.0.1"]
        {
            assert_eq!(check(&loopback, &[(HOST, ours)]), Ok(()), "{ours}");
        }
        for foreign in [
            "evil.example",
            "localhost.evil.example:8123",
            "192.168.1.7:8123",
            "127.0.0.1.evil.example",
            "",
            "[",
            "0x7f.1",
            "localhost:80; script-src *",
            "[::1]8123",
        ] {
            assert_eq!(check(&loopback, &[(HOST, foreign)]), Err(Refusal::Host), "{foreign}");
        }
        assert_eq!(check(&loopback, &[]), Err(Refusal::Host));
        let twice = [(HOST, "localhost"), (HOST, "evil.example")];
        assert_eq!(check(&loopback, &twice), Err(Refusal::Host));
        let network = guard("Robot.local", "192.168.1.7:8123");
        for ours in ["192.168.1.7:8123", "robot.local:8123", "10.0.0.1"] {
            assert_eq!(check(&network, &[(HOST, ours)]), Ok(()), "{ours}");
        }
        assert_eq!(check(&network, &[(HOST, "evil.example")]), Err(Refusal::Host));
    }

    #[test]
    fn a_script_of_another_page_is_refused() {
        let guard = guard("127.0.0.1", "127.0.0.1:8123");
        let from = |origin| check(&guard, &[(HOST, "localhost:8123"), (ORIGIN, origin)]);
        assert_eq!(from("http://localhost:8123"), Ok(()));
        for foreign in [
            "http://evil.example",
            "http://localhost:9999",
            "http://127.0.0.1:8123",
            "null",
            "https://localhost:8123",
            "",
        ] {
            assert_eq!(from(foreign), Err(Refusal::Origin), "{foreign}");
        }
    }

    /// Returns the cookie that an admitted browser gets, if any.
    fn admit(guard: &Guard, path: &str, headers: &[(HeaderName, &str)]) -> Result<Option<String>, Refusal> {
        let guest = guard.admit(&path.parse().unwrap(), &map(headers))?;
        Ok(guest.cookie.map(|cookie| cookie.to_str().unwrap().to_owned()))
    }

    #[test]
    fn the_link_lets_in_and_its_cookie_does_afterwards_and_nothing_else() {
        for (name, address) in [("127.0.0.1", "127.0.0.1:8123"), ("0.0.0.0", "0.0.0.0:8123")] {
            let (one, other) = (guard(name, address), guard(name, address));
            let token = one.token();
            assert_eq!(token.len(), 32);
            assert_ne!(token, other.token());
            let host = (HOST, "127.0.0.1:9000");
            let cookie = admit(&one, &format!("/?token={token}"), std::slice::from_ref(&host));
            let cookie = cookie.unwrap().unwrap();
            assert_eq!(cookie, format!("dq_servo_9000={token}; Path=/; HttpOnly; SameSite=Strict"));
            let kept = cookie.split(';').next().unwrap();
            let among = format!("other=1; {kept}; dq_servo_9001={}", other.token());
            for cookies in [kept, &among] {
                assert_eq!(admit(&one, "/main.js", &[host.clone(), (COOKIE, cookies)]), Ok(None));
            }
            for wrong in ["/", "/?token=", "/?other", &format!("/?token={}", &token[1..]), "/?token=é"] {
                let Ok(uri) = wrong.parse::<Uri>() else { continue };
                assert_eq!(
                    one.admit(&uri, &map(std::slice::from_ref(&host))).unwrap_err(),
                    Refusal::Token,
                    "{wrong}"
                );
            }
            // A cookie of another port belongs to another server.
            for foreign in ["dq_servo_9000=", &kept.replace("9000", "9001"), &kept[..kept.len() - 1]] {
                let refused = admit(&one, "/", &[host.clone(), (COOKIE, foreign)]);
                assert_eq!(refused, Err(Refusal::Token), "{foreign}");
            }
            let evil =
                admit(&one, "/session", &[host.clone(), (COOKIE, kept), (ORIGIN, "http://127.0.0.1:1")]);
            assert_eq!(evil, Err(Refusal::Origin));
        }
    }

    #[test]
    fn a_token_that_is_given_is_long_and_plain() {
        assert!(is_usable("0123456789abcDEF-_"));
        for not in
            ["", "short", "0123456789abcde", "0123456789abcdef;", "0123456789abcdef ", "0123456789abcdefé"]
        {
            assert!(!is_usable(not), "{not}");
        }
    }
}
